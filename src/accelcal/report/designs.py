"""Tests compared before they are made, as text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from accelcal.apparatus import SOURCE_UNITS
from accelcal.model import COEFFICIENTS, SLOPES, symbol_of
from accelcal.report.lines import aligned, sections, wrapped
from accelcal.report.numbers import significant
from accelcal.results.designs import BLIND, DesignComparison, Forecast, TestDesign, Visibility
from accelcal.shown_units import SMALL_UNITS, in_small_unit, plain, readable

_OTHERS = ("k0 at T0", "K1 at T0", "delta at T0", "delta0")
_LETTERS = {
    "reading": "r",
    "head": "h",
    "launch": "l",
    "launch_sf": "s",
    "temperature": "t",
    "resolution": "q",
}
_UNITS = {**SOURCE_UNITS, "reading": "g", "resolution": "g"}
_LARGE_FACTOR = 2.2
_ABREAST = 7
_NAMED = 3
_NEARLY = 1.1


def text(found: DesignComparison) -> str:
    """Tell what compared tests would give, what effects they show, and which one to book."""
    told = set(found.names())
    groups = [[name for name in names if name in told] for names in _groups(found)]
    *first, last = (list(_table(found, names)) for names in groups if names)
    return sections(
        _head(found),
        *first,
        [*last, *_legend(found)],
        _expanded(found, groups[0]),
        _booking(found),
        _what_time_buys(found),
        _lost(found.designs),
        *_effects(found.designs),
        _notes(found),
    )


def _head(found: DesignComparison) -> Iterator[str]:
    yield "Standard uncertainty that each test would give: positions x strokes"
    yield stand_line(found.stand, declared=found.declared)
    yield (
        f"a reading {found.pace['reading']:g} s, a turn {found.pace['turn']:g} s, a soak"
        f" {found.pace['soak']:g} h, a mounting {found.pace['mount']:g} h"
    )


def _groups(found: DesignComparison) -> tuple[Sequence[str], ...]:
    """Coefficients, slopes, and of the others what some test may tell.

    These are values at T0 from all runs, where a level is met twice, and the fixture angle.
    """
    repeated = any(len(set(d.temperatures)) < len(d.temperatures) for d in found.designs)
    return COEFFICIENTS, tuple(SLOPES), _OTHERS if repeated else _OTHERS[-1:]


def stand_line(stand: Mapping[str, float], *, declared: bool) -> str:
    """Write the errors of a stand in one line."""
    parts = [f"{name} {scaled(size, _UNITS[name])}" for name, size in stand.items() if size]
    how = "" if declared else "; none of it declared to the fit"
    return f"stand (standard uncertainties): {', '.join(parts) or 'no errors'}{how}"


def scaled(size: float, unit: str) -> str:
    """Write a size in the unit in which a person reads it."""
    factor, shown = in_small_unit(unit)
    return f"{significant(size * factor, 3)} {shown}"


def _table(
    found: DesignComparison, names: Sequence[str], *, expanded: bool = False
) -> Iterator[str]:
    units = found.units()
    several = len({(d.temperatures, d.mountings) for d in found.designs}) > 1
    place = ["temperatures", "mountings"] if several else []
    head = ["test", *place, "readings", "hours"]
    fronts = {name: found.front(name) for name in names}
    rows = [[*head, *(f"{name} [{SMALL_UNITS[units[name]]}]" for name in names)]]
    for i, design in enumerate(found.designs):
        where = [" ".join(f"{t:g}" for t in design.temperatures), " ".join(design.mountings)]
        cells = [_cell(design.forecast(n), i in fronts[n], expanded=expanded) for n in names]
        rows.append(
            [
                design.label,
                *(where if several else []),
                str(design.readings),
                f"{design.hours:.1f}",
                *cells,
            ]
        )
    yield from aligned(rows, right=set(range(1 + len(place), len(rows[0]))))


def _cell(forecast: Forecast | None, on_front: bool, *, expanded: bool) -> str:
    """A number with a letter for its main source, * on the front, ~ where it is of a sum."""
    if forecast is None:
        return "-   "
    value = forecast.expanded_uncertainty if expanded else forecast.standard_uncertainty
    if value is None:
        return "?   "
    sum_of = "~" if forecast.stands_for else " "
    letter = _LETTERS.get(forecast.mostly_from, " ")
    number = significant(value * in_small_unit(forecast.unit)[0], 3)
    return f"{number} {letter}{'*' if on_front else ' '}{sum_of}"


def _legend(found: DesignComparison) -> Iterator[str]:
    used = {f.mostly_from for d in found.designs for f in d.forecasts}
    letters = ", ".join(f"{_LETTERS[s]} {s}" for s in _LETTERS if s in used)
    yield f"mostly from: {letters}; * no quicker test is as good; ~ of a sum, see below; - not told"
    sets = {(d.temperatures, d.mountings) for d in found.designs}
    if len(sets) == 1:
        levels, sides = next(iter(sets))
        yield f"at {', '.join(f'{t:g}' for t in levels)} degC, mounting {', '.join(sides)}"
    if any(len(levels) > 1 for levels, _ in sets):
        yield "K0 to M_ip are those of one run in each mounting, the nearest to T0"
    lists = {d.stops: d.angles for d in found.designs if d.choice}
    for stops, angles in lists.items():
        yield from wrapped(f"{stops}: {', '.join(f'{angle:g}' for angle in angles)} deg")


def _expanded(found: DesignComparison, names: Sequence[str]) -> Iterator[str]:
    if not found.declared or _large_factors(found):
        yield "Expanded uncertainty U (95 %), by the degrees of freedom that the test would have"
        yield from _table(found, names, expanded=True)


def _large_factors(found: DesignComparison) -> bool:
    shown = (f for d in found.designs for f in d.forecasts if f.name in COEFFICIENTS)
    return any(
        f.expanded_uncertainty is None
        or f.expanded_uncertainty > _LARGE_FACTOR * f.standard_uncertainty
        for f in shown
    )


def _booking(found: DesignComparison) -> Iterator[str]:
    if not found.targets:
        return
    units = found.units()
    limits = (f"u({n}) <= {scaled(limit, units[n])}" for n, limit in found.targets.items())
    wanted = ", ".join(limits)
    good = found.meeting()
    if good:
        best = found.designs[good[0]]
        more = "; discover needs two cycles" * (best.strokes < 4)
        yield from wrapped(f"Book {_described(best)}: the quickest of these with {wanted}{more}")
    else:
        yield from wrapped(f"None of these has {wanted}; more strokes would: no floor is above it")


def _what_time_buys(found: DesignComparison) -> Iterator[str]:
    names = [name for names in _groups(found) for name in names]
    fronts = {name: [found.designs[i] for i in found.front(name)] for name in names}
    rows = [_worth(name, front) for name, front in fronts.items() if front]
    if rows:
        yield "What more time buys: the best of these, and the quickest within 10 % of it"
        yield from aligned(rows, right={1}, indent="  ", headed=False)


def _worth(name: str, front: Sequence[TestDesign]) -> list[str]:
    sizes = [_forecast(design, name) for design in front]
    best = sizes[-1].standard_uncertainty
    near = next(i for i, f in enumerate(sizes) if f.standard_uncertainty <= _NEARLY * best)
    size = scaled(sizes[near].standard_uncertainty, sizes[near].unit)
    quick = f"{_described(front[near])} gives {size}"
    return [
        name,
        scaled(best, sizes[-1].unit),
        f"by {_described(front[-1])}",
        quick if near + 1 < len(front) else "",
        f"floor {scaled(sizes[-1].floor, sizes[-1].unit)}",
    ]


def _forecast(design: TestDesign, name: str) -> Forecast:
    found = design.forecast(name)
    assert found is not None
    return found


def _described(design: TestDesign) -> str:
    return f"{design.label} ({design.hours:.1f} h)"


def _lost(designs: Sequence[TestDesign]) -> Iterator[str]:
    by_stops = {d.stops: d.lost for d in designs if d.lost}
    if by_stops:
        yield "What cannot be told apart"
    for stops, lost in by_stops.items():
        yield f"  {stops} positions:" if stops.isdigit() else f"  {stops}:"
        yield from (f"    {sentence}" for sentence in lost)


def _effects(designs: Sequence[TestDesign]) -> Iterator[Iterable[str]]:
    """Parts on effects that no test shows, on the others, and on tests that show none."""
    shown = [d for d in designs if d.effects]
    hidden = _hidden_everywhere(shown)
    if hidden:
        yield [
            "Effects of the catalogue that none of these tests shows, and what takes them up",
            *(f"  {name}: {taken}" for name, taken in hidden.items()),
        ]
    for start in range(0, len(shown), _ABREAST):
        yield _effect_table(shown[start : start + _ABREAST], set(hidden))
    blind = [d.label for d in designs if d.is_blind]
    if blind:
        yield [
            f"{', '.join(blind)}: {BLIND}, for want of replicates; two cycles or more show effects"
        ]


def _hidden_everywhere(designs: Sequence[TestDesign]) -> dict[str, str]:
    """Effects that no test shows, with what most tests have in their place."""
    ids = dict.fromkeys(item.id for d in designs for item in d.effects)
    found = {}
    for name in ids:
        own = [item for d in designs for item in d.effects if item.id == name]
        if all(item.smallest is None for item in own):
            taken = [_taken_up(item) for item in own]
            found[name] = max(taken, key=taken.count)
    return found


def _effect_table(designs: Sequence[TestDesign], hidden: set[str]) -> Iterator[str]:
    yield (
        "Other effects: the size that is found nine times in ten (= another effect looks the same),"
        " or what takes it up"
    )
    ids = dict.fromkeys(item.id for d in designs for item in d.effects if item.id not in hidden)
    rows = [["", *(d.label for d in designs), ""]]
    for name in ids:
        own = [next((item for item in d.effects if item.id == name), None) for d in designs]
        unit = next((v.unit for v in own if v is not None and v.unit), "")
        factor, shown = readable(unit, [v.smallest for v in own if v is not None])
        rows.append([name, *(_seen(v, factor) for v in own), plain(shown)])
    yield from aligned(rows, right=set(range(1, len(designs) + 1)), indent="  ")


def _seen(item: Visibility | None, factor: float) -> str:
    if item is None:
        return ""
    if item.smallest is None:
        return f"{_taken_up(item)}  "
    return f"{significant(item.smallest * factor, 2)} {'=' if item.aliases else ' '}"


def _taken_up(item: Visibility) -> str:
    """Names of the coefficients that take an effect up, slopes by their symbols."""
    names = list(map(symbol_of, item.absorbed_by or ()))
    return f"{len(names)} of them" if len(names) > _NAMED else " ".join(names) or "nothing"


def _notes(found: DesignComparison) -> Iterator[str]:
    of_designs = dict.fromkeys(note for design in found.designs for note in design.notes)
    notes = (note for note in of_designs if not note.startswith(BLIND))
    for note in (*found.notes, *notes):
        yield from wrapped(f"note: {note}")
