"""What a tumble test leaves behind: the readings of one accelerometer and how they were taken.

A **record** holds all readings of one accelerometer. A **run** is one visit to a temperature; the
readings of one run in one mounting make one **table** Y_JK, which is fitted by its own
coefficients.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from accelcal.arguments import check_number
from accelcal.errors import InputError
from accelcal.geometry import MOUNTINGS, is_mounting
from accelcal.grouping import distinct

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Apparatus", "TumbleRecord", "naming"]


_LARGEST = {
    "head_uncertainty": (0.1, "rad"),
    "launch_uncertainty": (1.0, "g"),
    "launch_sf_uncertainty": (0.1, "as a part of one"),
    "temperature_uncertainty": (100.0, "degC"),
    "resolution": (1e20, "in the output unit"),
}


@dataclass(frozen=True, slots=True)
class Apparatus:
    """What is declared of the stand and the place; None means not declared.

    Attributes
    ----------
    local_gravity : float or None
        Local gravity [m/s^2].
    head_uncertainty : float or None
        Standard uncertainty of one head position, as an angle [rad], which is the acceleration in
        g at the position where it acts most.
    launch_uncertainty : float or None
        Standard uncertainty of the bias from run to run [g].
    launch_sf_uncertainty : float or None
        Relative standard uncertainty of the scale factor from run to run [1].
    temperature_uncertainty : float or None
        Standard uncertainty of a temperature [degC].
    resolution : float or None
        Step of the output [output unit].

    Raises
    ------
    InputError
        If a value is negative or not finite, or the gravity is not that of a place on Earth.
    """

    local_gravity: float | None = None
    head_uncertainty: float | None = None
    launch_uncertainty: float | None = None
    launch_sf_uncertainty: float | None = None
    temperature_uncertainty: float | None = None
    resolution: float | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            given = getattr(self, item.name)
            if given is not None and (not isinstance(given, Real) or isinstance(given, bool)):
                check_number(**{item.name: given})
            value = None if item.name == "local_gravity" else given
            if value is not None and not 0 <= value < np.inf:
                raise InputError(f"{item.name} is {value}; it is a finite number, zero or more")
            largest, unit = _LARGEST.get(item.name, (np.inf, ""))
            if value is not None and value >= largest:
                raise InputError(f"{item.name} is {value}; it is below {largest:g} {unit}")
        if self.local_gravity is not None and not 9.7 < self.local_gravity < 9.9:
            raise InputError(
                f"local gravity {self.local_gravity} m/s^2 is found nowhere on Earth; it lies"
                " between 9.76 and 9.84, in m/s^2"
            )


@dataclass(frozen=True, slots=True, eq=False)
class TumbleRecord:
    """Readings of one accelerometer in a tumble test, one entry a reading.

    `accelcal.read_table` makes it of a file, `accelcal.read_arrays` of arrays or a DataFrame.

    Attributes
    ----------
    output : ndarray of float, shape (n,)
        Readings Y, finite [output unit].
    angle : ndarray of float, shape (n,)
        Head angle [deg].
    temperature : ndarray of float, shape (n,)
        Temperature of the reading, NaN where unknown [degC].
    stroke : ndarray of int, shape (n,)
        Stroke k from 1; odd forward, even back.
    run : ndarray of int, shape (n,)
        Index into `run_labels`, in the order in which the runs were made.
    run_labels : tuple of str
        Names of the runs.
    mounting : ndarray of str, shape (n,)
        One of `accelcal.geometry.MOUNTINGS`.
    clamping : ndarray of float, shape (n,), or None
        Angle at which the fixture is clamped on the head: its graduation stands at `angle` plus
        this; one value a run and mounting. None where it is 0 [deg].
    position : ndarray of int, shape (n,)
        Position number J from 1; 0 where the angle was given instead.
    time : ndarray of float, shape (n,), or None
        Time of the reading [s].
    std : ndarray of float, shape (n,), or None
        Standard deviation of the samples averaged into a reading; NaN where unknown [output unit].
    count : ndarray of float, shape (n,), or None
        Number of samples averaged into a reading; NaN where unknown.
    line : ndarray of int, shape (n,), or None
        Line of the source that holds the reading.
    serial : str or None
        Serial number of the accelerometer.
    unit : str or None
        Output unit.
    positions : int
        Number of positions in a full turn, as declared for numbered positions.
    reference_temperature : float or None
        T0 [degC].
    apparatus : Apparatus
        What is declared of the stand.
    date : str or None
        Date of the test, as written.
    metadata : mapping of str to str
        Everything else that was written about the test.
    source : str
        Where the record came from.
    notes : tuple of str
        What the reader set aside or assumed, one sentence each.
    sha256 : str or None
        SHA-256 of the bytes of the source, in hexadecimal; None where there were none.

    Raises
    ------
    InputError
        If the arrays differ in length, are empty, or hold a value outside its range.
    """

    output: NDArray[np.float64]
    angle: NDArray[np.float64]
    temperature: NDArray[np.float64]
    stroke: NDArray[np.int64]
    run: NDArray[np.int64]
    run_labels: tuple[str, ...]
    mounting: NDArray[np.str_]
    position: NDArray[np.int64]
    time: NDArray[np.float64] | None = None
    std: NDArray[np.float64] | None = None
    count: NDArray[np.float64] | None = None
    line: NDArray[np.int64] | None = None
    clamping: NDArray[np.float64] | None = None
    serial: str | None = None
    unit: str | None = None
    positions: int = 8
    reference_temperature: float | None = None
    apparatus: Apparatus = field(default_factory=Apparatus)
    date: str | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)
    source: str = "<table>"
    notes: tuple[str, ...] = ()
    sha256: str | None = None

    def __post_init__(self) -> None:
        self._check_lengths()
        self._check_values()
        for array in self._arrays().values():
            array.setflags(write=False)  # a record is evidence: nobody edits it in place

    def _arrays(self) -> dict[str, NDArray[Any]]:
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    def _check_lengths(self) -> None:
        n = self.output.size
        if n == 0:
            raise InputError("a record without readings; it needs at least one")
        for name, array in self._arrays().items():
            if array.shape != (n,):
                raise InputError(f"{name} has shape {array.shape}; with {n} outputs it is ({n},)")

    def _check_values(self) -> None:
        rules = [
            ("output", np.isfinite(self.output), "a finite number"),
            ("angle", np.isfinite(self.angle), "a finite number of degrees"),
            ("stroke", self.stroke >= 1, "1 or more"),
            ("run", (self.run >= 0) & (self.run < len(self.run_labels)), "an index of run_labels"),
            ("mounting", is_mounting(self.mounting), f"one of {', '.join(MOUNTINGS)}"),
            ("temperature", ~np.isinf(self.temperature), "a finite number of degC or unknown"),
        ]
        for name, good, rule in rules:
            if not good.all():
                value = getattr(self, name)[~good][0]
                raise InputError(f"{name} {value} in a record; it is {rule}")
        self._check_clampings()

    def _check_clampings(self) -> None:
        if self.clamping is None:
            return
        if not np.isfinite(self.clamping).all():
            raise InputError("a clamping of a record is not finite; it is a number of degrees")
        for mask in self.table_masks():
            met = distinct(self.clamping[mask])
            if met.size > 1:
                run = self.run_labels[int(self.run[mask][0])]
                raise InputError(
                    f"run {run} holds clampings {met[0]:g} and {met[1]:g} deg; a clamping is a run"
                    " of its own: name the runs in a column run"
                )

    @property
    def graduation(self) -> NDArray[np.float64]:
        """Graduation of the head at each reading: `angle` plus `clamping` [deg]."""
        return self.angle if self.clamping is None else self.angle + self.clamping

    @property
    def mean_temperature(self) -> float:
        """Mean of the known temperatures; NaN where none is known [degC]."""
        known = self.temperature[np.isfinite(self.temperature)]
        return float(known.mean()) if known.size else float("nan")

    def __len__(self) -> int:
        return int(self.output.size)

    def __eq__(self, other: object) -> bool:
        """Equal in every reading and declaration; the source, its lines and notes do not count."""
        if not isinstance(other, TumbleRecord):
            return NotImplemented
        aside = {"source", "notes", "line", "sha256"}
        return all(
            _same(getattr(self, item.name), getattr(other, item.name))
            for item in fields(self)
            if item.name not in aside
        )

    def __repr__(self) -> str:
        name = f"serial {self.serial!r}" if self.serial else repr(self.source)
        return (
            f"<TumbleRecord {name}: {len(self)} readings, {len(self.run_labels)} runs,"
            f" {distinct(np.mod(self.angle, 360.0)).size} positions>"
        )

    def _repr_html_(self) -> str:
        from accelcal.report.notebook_results import record_html

        return record_html(self)

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the readings, a line each, as `accelcal.read_arrays` takes them back.

        Returns
        -------
        pandas.DataFrame
            Columns are the arrays that there are, the run by its label;
            ``frame.attrs["units"]`` maps columns to units.
        """
        import pandas as pd

        columns = self._arrays() | {"run": np.array(self.run_labels, dtype=object)[self.run]}
        frame = pd.DataFrame({name: columns[name] for name in columns if name != "line"})
        output = self.unit or "output unit"
        units = {"output": output, "std": output, "angle": "deg", "time": "s"}
        units |= {"temperature": "degC"}
        frame.attrs["units"] = {name: units[name] for name in frame.columns if name in units}
        return frame

    def select(self, mask: NDArray[np.bool_]) -> TumbleRecord:
        """Keep only the readings where `mask` is true, and all run labels.

        Parameters
        ----------
        mask : ndarray of bool, shape (n,)
            Readings to keep.

        Returns
        -------
        TumbleRecord
            A new record.
        """
        kept: dict[str, Any] = {name: array[mask] for name, array in self._arrays().items()}
        return replace(self, **kept)

    def tables(self) -> Iterator[TumbleRecord]:
        """Iterate over the tables: one for each run and mounting, in order."""
        return map(self.select, self.table_masks())

    def table_masks(self) -> Iterator[NDArray[np.bool_]]:
        """Iterate over the readings of each table, in the order of `tables`."""
        sides = [side for side in (self.mounting == name for name in MOUNTINGS) if side.any()]
        for index in range(len(self.run_labels)):
            of_run = self.run == index
            yield from (mask for mask in (of_run & side for side in sides) if mask.any())

    def provenance(self, options: Mapping[str, Any]) -> dict[str, Any]:
        """Tell where the readings came from and what was declared, as a part of a JSON document.

        Parameters
        ----------
        options : mapping of str to object
            What was asked of those who work on the readings.

        Returns
        -------
        dict
            Keys sha256, metadata, declared, notes and options.
        """
        declared = {item.name: getattr(self.apparatus, item.name) for item in fields(Apparatus)}
        return {
            "sha256": self.sha256,
            "metadata": dict(self.metadata),
            "declared": {name: value for name, value in declared.items() if value is not None},
            "notes": list(self.notes),
            "options": dict(options),
        }

    def with_apparatus(self, **declared: Any) -> TumbleRecord:
        """Replace some declarations of the apparatus.

        Parameters
        ----------
        **declared : float or None
            Fields of `Apparatus`.

        Returns
        -------
        TumbleRecord
            A new record.
        """
        return replace(self, apparatus=replace(self.apparatus, **declared))


@contextmanager
def naming(record: TumbleRecord) -> Iterator[None]:
    """Say of which file an `InputError` is, and where its readings begin.

    Parameters
    ----------
    record : TumbleRecord
        What the error is about.

    Examples
    --------
    >>> import accelcal
    >>> from dataclasses import replace
    >>> record = replace(accelcal.simulate(seed=1), source="unit7.csv")
    >>> with naming(record):
    ...     raise InputError("too few angles; add some")
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: unit7.csv: too few angles; add some
    """
    try:
        yield
    except InputError as error:
        line = None if record.line is None else int(record.line[0])
        raise error.at(record.source, line) from None


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.shape == b.shape and bool(
            np.array_equal(a, b, equal_nan=np.issubdtype(a.dtype, np.floating))
        )
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return False
    return bool(a == b)
