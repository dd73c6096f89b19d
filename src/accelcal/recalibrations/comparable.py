"""Which calibrations of a unit can be compared: one unit, one mounting, one level, dates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.numerics.grouping import grouped
from accelcal.numerics.probability import NORMAL_FACTOR
from accelcal.plural import counted, listed
from accelcal.recalibrations.entries import NO_UNIT, Entry, Numbers, day, names_day, year
from accelcal.reference import USUAL_TEMPERATURE
from accelcal.serials import notes_of_alike, serials_alike
from accelcal.units import conversion_factor

FEWEST = 3
"""Calibrations that a drift with an interval needs."""

_ONE_LEVEL = 2.0  # degC; runs closer than this are at one level
ALIKE = 0.05
"""Difference of temperatures that changes a scale factor by 25 ppm at most [degC]."""

_WEEK = 7.0 / 365.25  # years; tests closer than this that agree are of one mounting, or nearly

_ALIKE_READINGS = 0.01  # of a standard uncertainty, by which values of one calibration may differ

BIAS_PER_DEGREE = 40e-6
"""Size of a usual temperature slope of the bias, that of the AL-15 of the paper [g/degC]."""

SCALE_FACTOR_PER_DEGREE = 500e-6
"""The same of the scale factor [1/degC]."""


@dataclass(frozen=True, slots=True)
class Comparable:
    """Calibrations of one unit that can be compared, by date."""

    entries: tuple[Entry, ...]
    years: tuple[float, ...]  # dates of the entries [years since 1970]
    temperature: float | None  # the level [degC]; None where temperatures are unknown
    notes: tuple[str, ...]  # what was left out, and why

    @property
    def rise(self) -> Array:
        """Temperatures less the level, 0 where unknown [degC]."""
        level = self.temperature or 0.0
        held = [level if e.temperature is None else e.temperature for e in self.entries]
        return np.array(held, dtype=float) - level


def comparable(
    entries: Sequence[Entry],
    serial: str | None,
    mounting: str | None,
    temperature: float | None,
) -> Comparable:
    """Choose the calibrations of one unit that can be compared, at least `FEWEST`.

    Without a serial it is the only unit, without a mounting that of most tables, without a
    temperature [degC] the level that most dates have.

    Raises
    ------
    InputError
        If there is no such unit, mounting or level, or too little is left.
    """
    notes: list[str] = []
    chosen = _of_unit(entries, serial)
    alike = serials_alike(dict.fromkeys(map(_name, entries)))
    notes += [note for own in alike if _name(chosen[0]) in own for note in notes_of_alike(own)]
    name = f"serial {chosen[0].serial}" if chosen[0].serial else "the unit"
    chosen = _of_mounting(chosen, mounting, notes)
    chosen = _dated(chosen, name, notes)
    chosen, level = _at_level(chosen, temperature, notes)
    chosen = _one_a_week(_one_a_test(_whole(chosen, notes), notes), notes)
    dates = len({year(entry.date) for entry in chosen})
    if dates < FEWEST:
        left_out = f" ({'; '.join(notes)})" if notes else ""
        raise InputError(
            f"{name} has calibrations of {counted(dates, 'date')} to compare, and a drift needs"
            f" {FEWEST}; add results{left_out}"
        )
    chosen.sort(key=lambda entry: (year(entry.date) or 0.0, entry.source))
    years = tuple(year(entry.date) or 0.0 for entry in chosen)
    return Comparable(tuple(chosen), years, level, tuple(notes))


def _of_unit(entries: Sequence[Entry], serial: str | None) -> list[Entry]:
    have = list(dict.fromkeys(map(_name, entries)))
    if not have:
        raise InputError("no calibration is given; give what accelcal batch or fit wrote")
    if serial is None and len(have) > 1:
        raise InputError(
            f"several units; choose one by its serial, or take fleet_history: {listed(have)}"
        )
    chosen = [entry for entry in entries if serial is None or _name(entry) == serial]
    if not chosen:
        as_number = serial is not None and serial.lstrip("0") in have
        remedy = "; read them by pandas.read_csv(..., dtype={'serial': str})" if as_number else ""
        raise InputError(f"no serial {serial!r} in the results; there is {listed(have)}{remedy}")
    return chosen


def _name(entry: Entry) -> str:
    return entry.serial or "(none)"


def _of_mounting(entries: list[Entry], mounting: str | None, notes: list[str]) -> list[Entry]:
    have = Counter(entry.mounting for entry in entries)
    chosen = have.most_common(1)[0][0] if mounting is None else mounting
    kept = [entry for entry in entries if entry.mounting == chosen]
    if not kept:
        raise InputError(f"no mounting {chosen!r} in the results; there is {', '.join(have)}")
    if len(have) > 1:
        notes.append(f"mounting {chosen} is followed; there is {', '.join(have)}")
    return kept


def _dated(entries: list[Entry], name: str, notes: list[str]) -> list[Entry]:
    kept = [entry for entry in entries if year(entry.date) is not None]
    lost = [entry for entry in entries if year(entry.date) is None]
    if lost:
        first = lost[0].source if lost[0].date is None else f"{lost[0].date!r} of {lost[0].source}"
        notes.append(
            f"{len(lost)} of {len(entries)} tables have no date that can be read, first {first};"
            " write '# date: 2024-05-31' above the readings"
        )
    if not kept:
        raise InputError(f"{name}: {notes[-1]}")
    return kept


def _at_level(
    entries: list[Entry], temperature: float | None, notes: list[str]
) -> tuple[list[Entry], float | None]:
    """Tables at one level, and the mean of their temperatures; None where none is known."""
    known = [entry for entry in entries if entry.temperature is not None]
    if not known:
        if temperature is not None:
            raise InputError("no temperature in the results; leave out the temperature asked for")
        notes.append("temperatures are unknown; calibrations are compared as if at one")
        return entries, None
    asked = _usual_level(known) if temperature is None else temperature
    kept = [entry for entry in known if _is_near(entry, asked)]
    left = {round(entry.temperature or 0.0) for entry in known if not _is_near(entry, asked)}
    others = ", ".join(map(str, sorted(left)))
    if not kept:
        raise InputError(f"no calibration at {asked:g} degC; there is {others} degC")
    held = np.array([entry.temperature for entry in kept], dtype=float)
    notes.extend(_said_of_level(held, others))
    return kept, float(held.mean())


def _usual_level(known: list[Entry]) -> float:
    """The temperature near which most dates have a table; of equal ones that nearest to 20 degC."""
    held = np.array([entry.temperature for entry in known], dtype=float)
    _, date, _ = grouped(np.array([entry.date for entry in known]))

    def dates(level: float) -> int:
        return int(np.count_nonzero(np.bincount(date[np.abs(held - level) <= _ONE_LEVEL])))

    levels: dict[float, None] = dict.fromkeys(held.tolist())  # each once, in their order
    return max(levels, key=lambda level: (dates(level), -abs(level - USUAL_TEMPERATURE)))


def _is_near(entry: Entry, level: float) -> bool:
    return abs((entry.temperature or 0.0) - level) <= _ONE_LEVEL


def _said_of_level(held: Array, others: str) -> Iterator[str]:
    if others:
        yield (
            f"compared at {held.mean():.4g} degC; runs at {others} degC are left out"
            " (choose by temperature)"
        )
    spread = float(np.ptp(held))
    if spread > ALIKE:
        yield (
            f"temperatures differ by {spread:.2g} degC, which nothing corrects for: what usual"
            f" slopes make of it ({1e6 * BIAS_PER_DEGREE:g} ug/degC and"
            f" {1e6 * SCALE_FACTOR_PER_DEGREE:g} ppm/degC) counts as uncertain"
        )


def _whole(entries: list[Entry], notes: list[str]) -> list[Entry]:
    """Tables with values and uncertainties, in one output unit."""
    kept = [entry for entry in entries if entry.is_complete]
    if len(kept) < len(entries):
        notes.append(
            f"{len(entries) - len(kept)} of {len(entries)} tables have no uncertainty and are left"
            " out; repeat strokes"
        )
    return _at_one_place(_in_one_unit(kept, notes), notes)


def _in_one_unit(entries: list[Entry], notes: list[str]) -> list[Entry]:
    """Tables whose scale factors can be given in the unit of most, in this unit."""
    units = Counter(entry.unit for entry in entries)

    def followed(unit: str) -> tuple[int, int]:
        alike = (other for other in units if conversion_factor(other, unit) is not None)
        return sum(units[other] for other in alike), units[unit]

    common = max(units, key=followed, default="")
    factors = {unit: conversion_factor(unit, common) for unit in units}
    kept = [entry for entry in entries if factors[entry.unit] is not None]
    lost = [unit for unit in units if factors[unit] is None]
    if lost:
        first = {entry.unit: entry.source for entry in reversed(entries)}
        differ = ", ".join(f"{_said_of_unit(unit)} in {first[unit]}" for unit in lost)
        missing = "; declare '# unit: mA' where it is" if NO_UNIT in units else ""
        notes.append(
            f"output units differ, and {_said_of_unit(common)} is followed: left out are"
            f" {len(entries) - len(kept)} of {len(entries)} tables, {differ}{missing}"
        )
    others = [unit for unit in units if unit != common and unit not in lost]
    if others:
        notes.append(f"scale factors of outputs in {', '.join(others)} are converted to {common}/g")
    return [
        replace(entry, scale_factor=_scaled(entry.scale_factor, factors[entry.unit]), unit=common)
        for entry in kept
    ]


def _said_of_unit(unit: str) -> str:
    return "none given" if unit == NO_UNIT else unit


def _at_one_place(entries: list[Entry], notes: list[str]) -> list[Entry]:
    """Tables with bias and scale factor in the local g of most, as far as it is declared."""
    places = Counter(entry.gravity for entry in entries if entry.gravity)
    if len(places) < 2:
        return entries
    common = max(places, key=lambda gravity: places[gravity])
    others = ", ".join(f"{gravity:g}" for gravity in places if gravity != common)
    told = f"calibrations where g is {others} m/s^2 are converted to g = {common:g} m/s^2"
    silent = sum(not entry.gravity for entry in entries)
    if silent:
        told += f"; {counted(silent, 'table')} without gravity {'is' if silent == 1 else 'are'} not"
    notes.append(told)
    return [_in_local_g(entry, common) for entry in entries]


def _in_local_g(entry: Entry, gravity: float) -> Entry:
    ratio = gravity / (entry.gravity or gravity)
    bias, scale_factor = _scaled(entry.bias, 1.0 / ratio), _scaled(entry.scale_factor, ratio)
    return replace(entry, bias=bias, scale_factor=scale_factor, gravity=gravity)


def _scaled(numbers: Numbers, factor: float | None) -> Numbers:
    return tuple(None if number is None else (factor or 1.0) * number for number in numbers)


def _one_a_test(entries: list[Entry], notes: list[str]) -> list[Entry]:
    """Runs of one test at the level as one, whose uncertainty is not smaller for that.

    They share what scatters from one calibration to the next, so that they are no calibrations of
    their own.
    """
    tests: dict[tuple[str, ...], list[Entry]] = {}
    for entry in entries:
        tests.setdefault(entry.test, []).append(entry)
    by_run = [_by_run(own) for own in tests.values()]
    if any(len(runs) > 1 for runs in by_run):
        notes.append("runs of one test at the level are averaged")
    sources = [tuple(dict.fromkeys(run.source for run in runs)) for runs in tests.values()]
    copies = [f"{name} (as in {first})" for first, *others in sources for name in others]
    if copies:
        notes.append(f"the same readings again count once: {listed(copies)}")
    notes.extend(_given_again([same for runs in by_run for same in runs]))
    return [_mean([_mean(same) for same in runs]) for runs in by_run]


def _one_a_week(entries: list[Entry], notes: list[str]) -> list[Entry]:
    """Tests of a week as one where they agree; they share what scatters, as runs of a test do."""
    weeks: list[list[Entry]] = []
    apart: dict[str, None] = {}
    for entry in sorted(entries, key=lambda entry: year(entry.date) or 0.0):
        if not (weeks and _in_a_week(weeks[-1][0], entry)):
            weeks.append([entry])
        elif _disagree([*weeks[-1], entry]):
            apart[day(entry.date)] = None
            weeks.append([entry])
        else:
            weeks[-1].append(entry)
    again = dict.fromkeys(day(own[0].date) for own in weeks if len(own) > 1)
    if again:
        notes.append(f"tests of a week are averaged: from {listed(again)}")
    if apart:
        notes.append(
            "tests that differ from those of the week before by more than their uncertainties are"
            f" calibrations of their own: {listed(apart)}"
        )
    return [replace(_mean(own), source=_sources(own)) for own in weeks]


def _in_a_week(first: Entry, later: Entry) -> bool:
    """Whether two tests are less than a week apart, by dates that both name a day."""
    since = (year(later.date) or 0.0) - (year(first.date) or 0.0)
    return names_day(first.date) and names_day(later.date) and since < _WEEK


def _sources(tests: Sequence[Entry]) -> str:
    return "; ".join(dict.fromkeys(test.source for test in tests))


def _disagree(tests: Sequence[Entry]) -> bool:
    """Whether 95 % intervals do not meet."""
    for name in ("bias", "scale_factor"):
        value, size, *_ = np.array([getattr(test, name) for test in tests], dtype=float).T
        half = NORMAL_FACTOR * size
        if (value - half).max() > (value + half).min():
            return True
    return False


def _by_run(entries: Sequence[Entry]) -> list[list[Entry]]:
    """Tables of one test by their run; without its name by their order in a source."""
    unnamed: Counter[str] = Counter()
    found: dict[tuple[str, int], list[Entry]] = {}
    for entry in entries:
        if entry.run is None:
            unnamed[entry.source] += 1
        place = 0 if entry.run is not None else unnamed[entry.source]
        found.setdefault((entry.run or "", place), []).append(entry)
    return list(found.values())


def _given_again(alike: Sequence[Sequence[Entry]]) -> Iterator[str]:
    """Say which calibrations are given several times, and where they say different things."""
    again = [same[0].source for same in alike if len(same) > len({own.source for own in same})]
    if again:
        yield (
            "calibrations that are given more than once, as in a table of batch and in a document"
            f" of fit, count once: {listed(dict.fromkeys(again))}"
        )
    differ = [same[0].source for same in alike if len(same) > 1 and _differ(same)]
    if differ:
        yield (
            "calibrations of the same readings differ, as by other options of fit, and their mean"
            f" counts: {listed(dict.fromkeys(differ))}; give one of each"
        )


def _differ(same: Sequence[Entry]) -> bool:
    """Whether values of the same readings are apart by more than rounding and other libraries."""
    for name in ("bias", "scale_factor"):
        value, size, *_ = np.array([getattr(own, name) for own in same], dtype=float).T
        if max(np.ptp(value), np.ptp(size)) > _ALIKE_READINGS * size.min():
            return True
    return False


def _mean(runs: Sequence[Entry]) -> Entry:
    if len(runs) == 1:
        return runs[0]

    def mean(name: str) -> tuple[float, ...]:
        values, *sizes = np.array([getattr(run, name) for run in runs], dtype=float).T
        return (float(values.mean()), *(float(np.sqrt(np.mean(size**2))) for size in sizes))

    known = [run.temperature for run in runs if run.temperature is not None]
    return replace(
        runs[0],
        temperature=float(np.mean(known)) if known else None,
        bias=mean("bias"),
        scale_factor=mean("scale_factor"),
        warned=tuple(dict.fromkeys(gate for run in runs for gate in run.warned)),
    )
