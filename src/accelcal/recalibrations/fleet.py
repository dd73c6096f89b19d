"""Many units through their recalibrations: each judged alone, and what chance makes of so many."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from accelcal.arguments.options import check_text
from accelcal.errors import InputError
from accelcal.numerics.probability import LEVEL, student_survival
from accelcal.plural import counted
from accelcal.recalibrations.entries import Entry, Frames, day, entries_of, year
from accelcal.recalibrations.history import QUANTITIES, check_options, judged_history
from accelcal.results.calibration import Calibration
from accelcal.results.fleet_history import DOUBT, FleetHistory, UnitOfFleet, UnitTrend
from accelcal.results.quantity import Quantity
from accelcal.results.unit_history import Trend
from accelcal.serials import notes_of_alike
from accelcal.version import SOFTWARE

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["fleet_history"]


def fleet_history(
    calibrations: Frames | pd.DataFrame | Iterable[Calibration | Entry],
    *,
    mounting: str | None = None,
    temperature: float | None = None,
    alpha: float = 0.01,
    due_before: str | None = None,
) -> FleetHistory:
    """Follow many units through their recalibrations, those that need attention first.

    Parameters
    ----------
    calibrations : BatchFrames, DataFrame or iterable of Calibration or Entry
        What `accelcal.batch` returns or its frame of tables, what `accelcal.fit` returns, or what
        `accelcal.recalibrations.entries.entries_of` takes from these.
    mounting, temperature, alpha
        As of `accelcal.history`, which judges each unit.
    due_before : str, optional
        Date; units are due whose last calibration is before it, of an unknown date or in the
        future.

    Returns
    -------
    FleetHistory
        A row for each unit.

    Raises
    ------
    InputError
        If no unit can be judged and `due_before` is not given, or an option breaks a rule.

    Notes
    -----
    Of m units that do not jump, ``alpha * m`` have a jump named by noise, and ``p * m`` one of a
    p-value of p or less; whether units share errors does not change these numbers. The p-value of
    a drift is that of Student's t, of the drift that counts what scatters as a walk, doubled as
    bias and scale factor are both looked at.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import accelcal
    >>> records = [
    ...     replace(accelcal.simulate(seed=10 * unit + n), serial=f"A{unit}", date=f"20{10 + n}")
    ...     for unit in range(2)
    ...     for n in range(5)
    ... ]
    >>> accelcal.fleet_history(map(accelcal.fit, records)).to_frame()["calibrations"].tolist()
    [5, 5]
    """
    entries = entries_of(calibrations)
    check_options(None, mounting, temperature, alpha)
    due = _due(due_before)
    named = _by_serial(entries)
    if not named:
        raise InputError("no serial number in the results; give what accelcal batch or fit wrote")
    units = [_alone(name, own, mounting, temperature, alpha) for name, own in named.items()]
    judged = sum(bool(unit.trends) for unit in units)
    if not judged and due is None:
        first = units[0].notes[0]
        raise InputError(f"none of {counted(len(units), 'unit')} can be judged; first: {first}")
    searched = sum(unit.jump_p_value is not None for unit in units)
    among = [_among(unit, searched, judged, due) for unit in units]
    return FleetHistory(
        units=tuple(sorted(among, key=_urgency)),
        alpha=alpha,
        due_before=due_before,
        searched=searched,
        jumps_by_chance=alpha * searched,
        drifts_by_chance=round(QUANTITIES * (1.0 - LEVEL) * judged, 9),
        notes=tuple(_notes(entries, named)),
        software=SOFTWARE,
    )


def _due(date: str | None) -> float | None:
    check_text(due_before=date)
    if date is None:
        return None
    found = year(date)
    if found is None:
        raise InputError(f"due_before={date!r} is no date; write it as 2024-05-31")
    return found


def _is_to_come(date: str | None) -> bool:
    """Whether a date is in the future, everywhere on Earth."""
    return day(date) > str(datetime.now(UTC).date() + timedelta(days=1))


def _by_serial(entries: Sequence[Entry]) -> dict[str, list[Entry]]:
    named: dict[str, list[Entry]] = {}
    for entry in entries:
        if entry.serial:
            named.setdefault(entry.serial, []).append(entry)
    return named


def _notes(entries: Sequence[Entry], named: Iterable[str]) -> Iterator[str]:
    yield from notes_of_alike(named)
    dates = {entry.serial: day(entry.date) for entry in entries if _is_to_come(entry.date)}
    if found := ", ".join(f"{serial} ({date})" for serial, date in dates.items() if serial):
        yield f"dates in the future: {found}"
    lost = sum(not entry.serial for entry in entries)
    if lost:
        yield f"{counted(lost, 'table')} without a serial number: left out"


# -- one unit --------------------------------------------------------------------------------------


def _alone(
    serial: str,
    entries: Sequence[Entry],
    mounting: str | None,
    temperature: float | None,
    alpha: float,
) -> UnitOfFleet:
    """What the history of a unit tells, whatever the fleet."""
    days = sorted({day(entry.date) for entry in entries if year(entry.date) is not None})
    first, last = (days[0], days[-1]) if days else (None, None)
    try:
        history, remarks = judged_history(entries, None, mounting, temperature, alpha)
    except InputError as error:
        undated = {entry.test for entry in entries if year(entry.date) is None}
        count = len(days) + len(undated)
        return UnitOfFleet(serial, count, first, last, notes=(str(error),))
    return UnitOfFleet(
        serial=serial,
        calibrations=len(history.trends[0].points),
        first=first,
        last=last,
        mounting=history.mounting,
        temperature_degC=history.temperature_degC,
        trends=tuple(UnitTrend(t.symbol, t.drift, _walk(t), t.jumps) for t in history.trends),
        jump_p_value=_chance_of_jump(history.trends),
        drift_p_value=_chance_of_drift(history.trends),
        remarks=remarks,
        notes=tuple(note for note in history.notes if note not in remarks),
    )


def _walk(trend: Trend) -> Quantity:
    return trend.drift_of_a_walk or trend.drift


def _chance_of_jump(trends: Sequence[Trend]) -> float | None:
    """Chance that noise has so large a jump in a unit; each counts both quantities already."""
    others = [trend.no_other_jump for trend in trends if trend.no_other_jump is not None]
    return min([*others, *(jump.p_value for own in trends for jump in own.jumps)], default=None)


def _chance_of_drift(trends: Sequence[Trend]) -> float:
    """Chance that noise makes so large a drift of one of the quantities."""
    drifts = map(_walk, trends)
    chances = [2.0 * student_survival(_ratio(own), own.dof or math.inf) for own in drifts]
    return min(1.0, QUANTITIES * min(chances))


def _ratio(drift: Quantity) -> float:
    return abs(drift.value or 0.0) / (drift.standard_uncertainty or math.inf)


# -- among the others ------------------------------------------------------------------------------


def _among(unit: UnitOfFleet, searched: int, judged: int, due: float | None) -> UnitOfFleet:
    """Judge a unit as one of those that were searched for jumps, and that have a drift."""
    jumps = None if unit.jump_p_value is None else searched * unit.jump_p_value
    drifts = None if unit.drift_p_value is None else judged * unit.drift_p_value
    found = []
    if any(trend.jumps for trend in unit.trends):
        found.append("jump" + DOUBT * _is_doubtful(jumps))
    if any(trend.drift_of_a_walk.is_off_zero for trend in unit.trends):
        found.append("drift" + DOUBT * _is_doubtful(drifts))
    if unit.remarks:
        found.append("remark")
    last = None if _is_to_come(unit.last) else year(unit.last)
    if due is not None and (last is None or last < due):
        found.append("due")
    return replace(unit, attention=tuple(found), jumps_by_chance=jumps, drifts_by_chance=drifts)


def _is_doubtful(by_chance: float | None) -> bool:
    """Whether noise alone shows as much in one unit or more of such a fleet."""
    return by_chance is not None and by_chance >= 1.0


def _urgency(unit: UnitOfFleet) -> tuple[bool | float | str, ...]:
    """What sorts units, the most urgent first; those that are due alone by their last dates."""
    chances = [own for own in (unit.jumps_by_chance, unit.drifts_by_chance) if own is not None]
    return (
        {"jump", "drift"}.isdisjoint(unit.attention),
        not {*unit.attention} - {"due"},
        "due" not in unit.attention,
        0.0 if unit.attention == ("due",) else min(chances, default=math.inf),
        unit.last or "",
    )
