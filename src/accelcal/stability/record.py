"""The record of a stability test: one launch or several, each a series of outputs in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from datetime import UTC, datetime, timedelta
from html import escape
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from accelcal.arguments.kinds import each_of, expect
from accelcal.arguments.numbers import check_number, check_side_by_side, number_array
from accelcal.arguments.options import check_text, check_texts, check_written
from accelcal.arguments.temperatures import refuse_other_temperatures
from accelcal.arrays import Array, EqualByContents, kept
from accelcal.errors import InputError
from accelcal.escapes import visible
from accelcal.plural import counted
from accelcal.units import headed_by_units

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Launch", "StabilityRecord", "averaged", "split_at_gaps"]


@dataclass(frozen=True, slots=True, eq=False)
class Launch(EqualByContents):
    """One launch: from power on to power off.

    Attributes
    ----------
    label : str
        Its name.
    time : ndarray, shape (n,)
        Time since the first sample, increasing [s]; given dates and times of day become that.
    output : ndarray, shape (n,)
        Output [unit of the record].
    temperature : ndarray, shape (n,), or None
        Temperature [degC].
    input : ndarray, shape (n,), or None
        Applied acceleration, where the test moves it in small steps [g].

    Raises
    ------
    InputError
        If the columns are no series of one length in time, Series of different indices, or a
        temperature is none of a test.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.Launch("cold", time=[0.0, 1.0, 2.0], output=[0.1, 0.2, 0.1])
    <Launch cold: 3 samples in 2 s>
    """

    label: str
    time: Array
    output: Array
    temperature: Array | None = None
    input: Array | None = None

    def __post_init__(self) -> None:
        check_written(label=self.label)
        given = {item.name: getattr(self, item.name) for item in fields(self)[1:]}
        check_side_by_side(**given)
        for name, values in {**given, "time": _seconds(self.time)}.items():
            if name in ("time", "output") or values is not None:
                object.__setattr__(self, name, kept(number_array(values, name)))
        _check(self)

    def __repr__(self) -> str:
        return visible(f"<Launch {self.label}: {self.output.size} samples in {self.duration:g} s>")

    @property
    def duration(self) -> float:
        """Time from first to last sample [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def interval(self) -> float:
        """Median time between samples [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def is_at_rest(self) -> bool:
        """Whether the applied acceleration stays the same."""
        return self.input is None or bool(np.all(self.input == self.input[0]))

    def select(self, kept: slice | NDArray[Any], label: str) -> Launch:
        """Keep some samples under another name.

        Parameters
        ----------
        kept : slice or ndarray
            The samples, as numpy indexes them.
        label : str
            The new name.

        Returns
        -------
        Launch
            The samples; time counts from the first of them.
        """
        return self.map(lambda values: values[kept], label)

    def map(self, function: Callable[[Array], Array], label: str) -> Launch:
        """Apply a function to time and every column.

        Parameters
        ----------
        function : callable
            Takes an array of shape (n,) and gives one of its own length, the same for all.
        label : str
            The new name.

        Returns
        -------
        Launch
            The launch; time counts from its first sample.
        """
        time = function(self.time)
        return Launch(
            label,
            time - time[0],
            function(self.output),
            None if self.temperature is None else function(self.temperature),
            None if self.input is None else function(self.input),
        )


def _seconds(time: Any) -> Any:
    """Dates and durations as seconds since the first; anything else as it is."""
    values = np.asarray(time)
    if values.ndim != 1 or not values.size:
        return time
    if values.dtype.kind == "O":
        values = _without_zone(values)
    if values.dtype.kind not in "mM":
        return time
    values = values.astype(f"{values.dtype.kind}8[us]")
    return (values - values[0]) / np.timedelta64(1, "s")


def _without_zone(values: NDArray[Any]) -> NDArray[Any]:
    """Dates of Python or pandas as those of numpy, of a zone in UTC; durations alike."""
    if all(isinstance(value, timedelta) for value in values):
        return values.astype("timedelta64[us]")
    zones = {getattr(value, "tzinfo", None) is not None for value in values}
    if not all(isinstance(value, datetime) for value in values) or len(zones) > 1:
        return values
    if True in zones:
        values = np.array([value.astimezone(UTC).replace(tzinfo=None) for value in values])
    return values.astype("datetime64[us]")


def _check(launch: Launch) -> None:
    if launch.time.ndim != 1 or launch.time.shape != launch.output.shape:
        raise InputError(
            f"launch {launch.label}: {launch.time.size} times and {launch.output.size} outputs; "
            "give one time for each output"
        )
    for name in ("temperature", "input"):
        values = getattr(launch, name)
        if values is not None and values.shape != launch.time.shape:
            raise InputError(
                f"launch {launch.label}: {values.size} values of {name} for {launch.time.size}"
                " times; give one for each, or none"
            )
    if launch.temperature is not None:
        refuse_other_temperatures(launch.temperature, f"launch {launch.label}: ")
    if launch.time.size < 3:
        raise InputError(
            f"launch {launch.label}: {counted(launch.time.size, 'sample')}; a launch has at least 3"
        )
    known = (launch.time, launch.output, *([] if launch.input is None else [launch.input]))
    if not all(np.isfinite(values).all() for values in known):
        raise InputError(
            f"launch {launch.label}: a time, output or input is not finite; leave such samples out"
        )
    if not (np.diff(launch.time) > 0.0).all():
        raise InputError(
            f"launch {launch.label}: time does not increase; sort the samples and name the launches"
        )


@dataclass(frozen=True, slots=True, eq=False)
class StabilityRecord(EqualByContents):
    """All launches of one accelerometer.

    Attributes
    ----------
    launches : tuple of Launch
        In the order in which they took place.
    unit : str or None
        Unit of the output.
    serial : str or None
        Serial number.
    source : str
        Where the record came from.
    notes : tuple of str
        What the reader set aside.

    Examples
    --------
    >>> import accelcal
    >>> launch = accelcal.Launch("1", [0.0, 1.0, 2.0], [0.1, 0.2, 0.1])
    >>> accelcal.StabilityRecord((launch,), unit="mA")
    <StabilityRecord <record>: 1 launch, 3 samples>
    """

    launches: tuple[Launch, ...]
    unit: str | None = None
    serial: str | None = None
    source: str = "<record>"
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        check_text(unit=self.unit, serial=self.serial)
        check_written(source=self.source)
        check_texts(notes=self.notes)
        object.__setattr__(self, "launches", each_of(self.launches, Launch))
        if not self.launches:
            raise InputError("a stability record without launches; give at least one")

    def __repr__(self) -> str:
        samples = sum(launch.output.size for launch in self.launches)
        count = f"{counted(len(self.launches), 'launch')}, {counted(samples, 'sample')}"
        name = f"serial {self.serial}" if self.serial else self.source
        return visible(f"<StabilityRecord {name}: {count}>")

    def _repr_html_(self) -> str:
        table = headed_by_units(self.to_frame()).to_html(max_rows=20)
        return f"<p>{escape(repr(self)[1:-1])}</p>{table}"

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the samples, a line each.

        Returns
        -------
        pandas.DataFrame
            The label of the launch, the time since its first sample and the output; temperature
            and input where a launch has them. ``frame.attrs["units"]`` maps columns to units.

        Examples
        --------
        >>> import accelcal
        >>> launch = accelcal.Launch("1", [0.0, 1.0, 2.0], [0.1, 0.2, 0.1])
        >>> frame = accelcal.StabilityRecord((launch,), unit="mA").to_frame()
        >>> frame["output"].tolist(), frame.attrs["units"]
        ([0.1, 0.2, 0.1], {'time': 's', 'output': 'mA'})
        """
        import pandas as pd

        units = {"time": "s", "output": self.unit, "temperature": "degC", "input": "g"}
        parts = [
            pd.DataFrame(
                {"launch": launch.label}
                | {name: v for name in units if (v := getattr(launch, name)) is not None}
            )
            for launch in self.launches
        ]
        frame = pd.concat(parts, ignore_index=True)
        frame.attrs["units"] = {
            name: unit for name, unit in units.items() if unit and name in frame
        }
        return frame


def split_at_gaps(record: StabilityRecord, gap: float) -> StabilityRecord:
    """Take every longer pause of a record as a new launch.

    Parameters
    ----------
    record : StabilityRecord
        The record.
    gap : float
        Pause from which on a new launch begins [s].

    Returns
    -------
    StabilityRecord
        With at least as many launches.

    Raises
    ------
    InputError
        If the gap is not above 0, or a piece has fewer than 3 samples.

    Examples
    --------
    >>> launch = Launch("1", [0, 1, 2, 100, 101, 102], [1, 2, 1, 5, 6, 5])
    >>> [piece.label for piece in split_at_gaps(StabilityRecord((launch,)), 60.0).launches]
    ['1.1', '1.2']
    """
    expect(record, StabilityRecord)
    check_number(gap=gap)
    if not gap > 0.0:
        raise InputError(f"launch gap {gap:g} s; a pause between launches is above 0")
    pieces: list[Launch] = []
    for launch in record.launches:
        starts = np.flatnonzero(np.diff(launch.time) > gap) + 1
        edges = [0, *starts.tolist(), launch.time.size]
        for number, (first, end) in enumerate(pairwise(edges), 1):
            label = f"{launch.label}.{number}" if len(starts) else launch.label
            pieces.append(launch.select(slice(first, end), label))
    return replace(record, launches=tuple(pieces))


def averaged(record: StabilityRecord, seconds: float) -> StabilityRecord:
    """Average the samples of every launch over equal spans of time.

    Parameters
    ----------
    record : StabilityRecord
        The record.
    seconds : float
        Length of a span [s]; an incomplete last span is left out.

    Returns
    -------
    StabilityRecord
        One sample a span that has any.

    Raises
    ------
    InputError
        If the length is not above 0, or leaves fewer than 3 samples in a launch.

    Examples
    --------
    >>> launch = Launch("1", np.arange(9.0), np.arange(9.0))
    >>> averaged(StabilityRecord((launch,)), 3.0).launches[0].output.tolist()
    [1.0, 4.0, 7.0]
    """
    expect(record, StabilityRecord)
    check_number(seconds=seconds)
    if not seconds > 0.0:
        raise InputError(f"averaging over {seconds:g} s; the time is above 0")
    return replace(record, launches=tuple(_averaged(item, seconds) for item in record.launches))


def _averaged(launch: Launch, seconds: float) -> Launch:
    elapsed = launch.time - launch.time[0]
    span = np.floor(elapsed / seconds * (1.0 + 1e-12)).astype(np.int64)
    complete = int(np.floor((elapsed[-1] + launch.interval) / seconds * (1.0 + 1e-9)))
    keep = span < complete
    number = np.unique(span[keep], return_inverse=True)[1]
    count = np.bincount(number)
    if count.size < 3:
        raise InputError(
            f"launch {launch.label}: averages over {seconds:g} s leave {count.size} samples; "
            "average over less"
        )
    return launch.map(lambda v: np.bincount(number, weights=v[keep]) / count, launch.label)
