"""Many units through their recalibrations, as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterator

from accelcal.escapes import visible
from accelcal.plural import counted
from accelcal.report.lines import aligned, hanging, sections
from accelcal.report.numbers import in_millionths
from accelcal.results.fleet_history import DOUBT, FleetHistory, UnitOfFleet
from accelcal.results.unit_history import Jump
from accelcal.shown_units import SMALL_UNITS

_SHOWN = 40

_HEADINGS = ("serial", "attention", "n", "last", "ug/year", "U", "ppm/year", "U", "jump before")
_RIGHT = {2, 4, 5, 6, 7}


def text(fleet: FleetHistory) -> str:
    """Write a fleet as a table, a line for each unit, and what chance makes of so many."""
    return sections(_heading(fleet), _units(fleet), _legend(fleet))


def _heading(fleet: FleetHistory) -> Iterator[str]:
    units = fleet.units
    yield f"History of {counted(len(units), 'unit')}; intervals are of 95 %"
    left = len(units) - fleet.judged
    yield (
        f"jumps    {_found(fleet, 'jump', fleet.searched)}, at alpha = {fleet.alpha:g}; noise"
        f" alone: {fleet.jumps_by_chance:.2g}"
    )
    yield (
        f"drifts   {_found(fleet, 'drift', fleet.judged)}; noise alone: up to"
        f" {fleet.drifts_by_chance:.2g}"
    )
    if fleet.due_before is not None:
        yield f"due      {_number(fleet, 'due')}, no calibration known since {fleet.due_before}"
    if left:
        yield f"{counted(left, 'unit')} cannot be judged: CSV and JSON tell why"


def _units(fleet: FleetHistory) -> Iterator[str]:
    told = [unit for unit in fleet.units if unit.trends or unit.attention]
    if told:
        yield from aligned([_HEADINGS, *map(_cells, told[:_SHOWN])], right=_RIGHT)
    if others := told[_SHOWN:]:
        urgent = sum(bool(unit.attention) for unit in others)
        most = f"and {counted(len(others), 'other unit')}, {urgent} of them with attention"
        yield f"{most} (CSV and JSON have all)"


def _found(fleet: FleetHistory, finding: str, among: int) -> str:
    """How many units of those that were looked at have a finding, and how many for sure."""
    sure, doubtful = _number(fleet, finding), _number(fleet, finding + DOUBT)
    return f"{sure + doubtful} of {counted(among, 'unit')}, {sure} without {DOUBT}"


def _number(fleet: FleetHistory, finding: str) -> int:
    return sum(finding in unit.attention for unit in fleet.units)


def _cells(unit: UnitOfFleet) -> tuple[str, ...]:
    drifts = [cell for trend in unit.trends for cell in in_millionths(trend.drift_of_a_walk)]
    jumps = [jump for trend in unit.trends for jump in trend.jumps]
    told = "; ".join(map(_jump, sorted(jumps, key=lambda jump: jump.before)))
    return (
        visible(unit.serial),
        ", ".join(unit.attention),
        str(unit.calibrations),
        unit.last or "",
        *(drifts or [""] * 4),
        told,
    )


def _jump(jump: Jump) -> str:
    unit = SMALL_UNITS[jump.size.unit]
    return f"{jump.before}: {in_millionths(jump.size)[0]} {unit}"


def _legend(fleet: FleetHistory) -> Iterator[str]:
    yield from hanging(
        "Drifts of the bias [ug/year] and of the scale factor [ppm/year] have the U of units that"
        " may wander. drift: beyond its U. remark: a calibration stands apart, the unit wanders,"
        " its drift slows or grows, a jump may be a bend or come from the temperature, or checks"
        " find readings that are swapped, out of proportion or in another unit."
    )
    yield from hanging(
        f"{DOUBT}: noise alone shows as much in one unit or more of such a fleet. Without it, in"
        " less than one."
    )
    if any(unit.attention for unit in fleet.units):
        yield "--serial tells all of one unit."
    for note in fleet.notes:
        yield from hanging(f"note: {visible(note)}")
