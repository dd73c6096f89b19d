"""What a tumble test leaves behind: the readings of one accelerometer and how they were taken.

A **record** holds all readings of one accelerometer. A **run** is one visit to a temperature; the
readings of one run in one mounting make one **table** Y_JK, which is fitted by its own
coefficients.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from accelcal.apparatus import Apparatus
from accelcal.arguments.kinds import as_given
from accelcal.arguments.options import check_choice, check_text, check_texts, check_written
from accelcal.arguments.temperatures import check_temperature, outside_tests
from accelcal.arrays import Array, EqualByContents, Ints, Mask, Places, kept
from accelcal.errors import InputError
from accelcal.frozen_mapping import kept_mapping
from accelcal.geometry import MOUNTINGS, is_mounting
from accelcal.head_angles import head_positions, nominal_angles
from accelcal.numerics.grouping import distinct
from accelcal.plural import counted

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["TumbleRecord", "naming"]

_DTYPES = {
    **dict.fromkeys(("output", "angle", "temperature"), "fiu"),
    **dict.fromkeys(("stroke", "run"), "iu"),
    "mounting": "U",
    "position": "iu",
    **dict.fromkeys(("time", "std", "count"), "fiu"),
    "line": "iu",
    "clamping": "fiu",
}
"""Array of a record, in order -> kinds of its numbers or texts, as NumPy names them."""

_IN_WORDS = {"fiu": "numbers", "iu": "whole numbers", "U": "texts"}

_KINDS: dict[str, tuple[type | tuple[type, ...], str]] = {
    **dict.fromkeys(_DTYPES, (np.ndarray, "an array, as accelcal.read_arrays makes it")),
    "positions": ((int, np.integer), "a whole number, 2 or more"),
    "apparatus": (Apparatus, "an accelcal.Apparatus(...)"),
    "metadata": ((dict, Mapping), "a mapping such as {'operator': 'A. N.'}"),
}
"""Attribute of a record that is no text or number -> its kind, and that in words."""


@dataclass(frozen=True, slots=True, eq=False)
class TumbleRecord(EqualByContents):
    """Readings of one accelerometer in a tumble test, one entry a reading.

    `accelcal.read_table` makes it of a file, `accelcal.read_arrays` of arrays or a DataFrame.
    Records are equal that are so in every reading and declaration, whatever their source.

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
        Index into `run_labels`, from 0 in the order in which the runs were made.
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
        If something is of another kind, or the arrays differ in length, are empty, or hold a value
        outside its range.

    Examples
    --------
    >>> import accelcal
    >>> record = accelcal.simulate(seed=1)
    >>> record
    <TumbleRecord serial 'AL-15': 162 readings, 3 runs, 8 positions>
    >>> record.to_frame().shape
    (162, 7)
    """

    _NOT_COMPARED: ClassVar[frozenset[str]] = frozenset({"source", "notes", "line", "sha256"})

    output: Array
    angle: Array
    temperature: Array
    stroke: Ints
    run: Ints
    run_labels: tuple[str, ...]
    mounting: NDArray[np.str_]
    position: Ints
    time: Array | None = None
    std: Array | None = None
    count: Array | None = None
    line: Ints | None = None
    clamping: Array | None = None
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
        self._check_kinds()
        self._check_lengths()
        self._check_values()
        for name, array in self._arrays().items():  # a record is evidence: nobody edits it in place
            object.__setattr__(self, name, kept(array))
        object.__setattr__(self, "metadata", kept_mapping(self.metadata))

    def _arrays(self) -> dict[str, Any]:
        return {name: own for name in _DTYPES if (own := getattr(self, name)) is not None}

    def _check_kinds(self) -> None:
        for name, (kinds, rule) in _KINDS.items():
            value = getattr(self, name)
            if not isinstance(value, kinds) and (value is not None or name not in _OPTIONAL):
                raise InputError(f"{name} of a record is {as_given(value)}; it is {rule}")
        check_texts(run_labels=self.run_labels, notes=self.notes)
        check_text(serial=self.serial, unit=self.unit, date=self.date, sha256=self.sha256)
        check_written(source=self.source)
        if self.reference_temperature is not None:
            check_temperature(reference_temperature=self.reference_temperature)

    def _check_lengths(self) -> None:
        n = self.output.size
        if n == 0:
            raise InputError("a record without readings; it needs at least one")
        for name, array in self._arrays().items():
            if array.shape != (n,):
                raise InputError(f"{name} has shape {array.shape}; with {n} outputs it is ({n},)")
            if array.dtype.kind not in _DTYPES[name]:
                rule = _IN_WORDS[_DTYPES[name]]
                raise InputError(f"{name} of a record is of {array.dtype}; it is of {rule}")

    def _check_values(self) -> None:
        if self.positions < 2:
            raise InputError(f"positions of a record is {self.positions}; it is 2 or more")
        known = ~outside_tests(self.temperature)
        rules = [
            ("output", np.isfinite(self.output), "a finite number"),
            ("angle", np.isfinite(self.angle), "a finite number of degrees"),
            ("stroke", self.stroke >= 1, "1 or more"),
            ("run", (self.run >= 0) & (self.run < len(self.run_labels)), "an index of run_labels"),
            ("mounting", is_mounting(self.mounting), f"one of {', '.join(MOUNTINGS)}"),
            ("temperature", known, "from -200 to 250 degC, or unknown"),
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
                told = f"clampings {met[0]:g} and {met[1]:g} deg; a clamping is a run of its own"
                raise InputError(f"run {run} holds {told}: name the runs in a column run")

    @property
    def graduation(self) -> Array:
        """Graduation of the head at each reading: `angle` plus `clamping` [deg]."""
        return self.angle if self.clamping is None else self.angle + self.clamping

    @property
    def head_angles(self) -> Array:
        """Positions of the test, each once, at their nominal angles within one turn [deg]."""
        return distinct(head_positions(nominal_angles(self.angle)))

    @property
    def mean_temperature(self) -> float:
        """Mean of the known temperatures; NaN where none is known [degC]."""
        known = self.temperature[np.isfinite(self.temperature)]
        return float(known.mean()) if known.size else float("nan")

    def __len__(self) -> int:
        return int(self.output.size)

    def __repr__(self) -> str:
        name = f"serial {self.serial!r}" if self.serial else repr(self.source)
        size = f"{len(self)} readings, {counted(distinct(self.run).size, 'run')}"
        return f"<TumbleRecord {name}: {size}, {self.head_angles.size} positions>"

    def _repr_html_(self) -> str:
        from accelcal.report.notebook import record_html

        return record_html(self)

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the readings, a line each, as `accelcal.read_arrays` takes them back.

        Returns
        -------
        pandas.DataFrame
            The arrays, the run by its label. ``frame.attrs`` has the units of columns, by their
            names, and what is declared of the test, as ``"units"`` and ``"declared"``.
        """
        import pandas as pd

        columns = self._arrays() | {"run": np.array(self.run_labels, dtype=object)[self.run]}
        untold = {"line"} if self.position.any() else {"line", "position"}
        frame = pd.DataFrame({name: columns[name] for name in columns if name not in untold})
        if (self.position == 0).any() and "position" in frame:
            frame["position"] = frame["position"].astype("Int64").where(self.position > 0)
        units = {"output": self.unit, "std": self.unit, "angle": "deg", "clamping": "deg"}
        units |= {"time": "s", "temperature": "degC"}
        frame.attrs["units"] = {name: units[name] for name in columns if units.get(name)}
        named = ("serial", "date", "reference_temperature", "positions")
        declared = {name: getattr(self, name) for name in named} | asdict(self.apparatus)
        frame.attrs["declared"] = declared | {"metadata": dict(self.metadata)}
        return frame

    def select(self, mask: Mask | None = None, *, run: str | None = None) -> TumbleRecord:
        """Keep only some readings, and all run labels.

        Parameters
        ----------
        mask : ndarray of bool, shape (n,), optional
            Readings to keep; by default all those of `run`.
        run : str, optional
            Label of the run to keep.

        Returns
        -------
        TumbleRecord
            A new record.

        Raises
        ------
        InputError
            If the mask is something else, there is no such run, or nothing is kept.

        Examples
        --------
        >>> import accelcal
        >>> accelcal.simulate(seed=1).select(run="2")
        <TumbleRecord serial 'AL-15': 54 readings, 1 run, 8 positions>
        """
        mask = np.ones(len(self), dtype=bool) if mask is None and run is not None else mask
        if not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (len(self),):
            rule = f"an array of {len(self)} truth values, one for each reading"
            raise InputError(f"mask is {as_given(mask)}; it is {rule}")
        if run is not None:
            check_choice(self.run_labels, run=run)
            mask = mask & (self.run == self.run_labels.index(run))
        return self.taken(mask)

    def taken(self, readings: Mask | Places) -> TumbleRecord:
        """Take readings in an order of their own, and all run labels.

        Parameters
        ----------
        readings : ndarray of bool or int
            A truth value for each reading, or the places of some.

        Returns
        -------
        TumbleRecord
            A new record.
        """
        return replace(self, **{name: own[readings] for name, own in self._arrays().items()})

    def tables(self) -> tuple[TumbleRecord, ...]:
        """Tables of the record: one for each run and mounting, in order."""
        return tuple(map(self.taken, self.table_masks()))

    def table_masks(self) -> Iterator[Mask]:
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
        return {
            "sha256": self.sha256,
            "metadata": dict(self.metadata),
            "declared": {k: v for k, v in asdict(self.apparatus).items() if v is not None},
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


_OPTIONAL = {item.name for item in fields(TumbleRecord) if item.default is None}


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
