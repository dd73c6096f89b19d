"""What several units tell of their stand, as a colleague would tell it."""

from __future__ import annotations

from collections.abc import Iterator
from statistics import median

from accelcal.model import symbol_of
from accelcal.plural import listed
from accelcal.report.discovery import NOT_SURE
from accelcal.report.findings import chance, probability
from accelcal.report.lines import aligned, notes, sections, sentence, wrapped
from accelcal.report.numbers import in_millionths, significant, told
from accelcal.results.findings import Change
from accelcal.results.stand_discovery import StandDiscovery, StandEffect
from accelcal.shown_units import in_small_unit

WHOSE = {
    "stand": "of the stand, with one value in all units",
    "unit": "of single units, not of the stand",
    "undecided": "undecided, of the stand or of the units",
}
"""What the verdict on an effect says."""

NOTHING = "Nothing that the units share is missing, and none has anything of its own."
SHARED = "What the units share, and no known effect explains"

_WORTH_TELLING = 0.005
"""Part by which an uncertainty shrinks that is told as a gain."""


def text(found: StandDiscovery) -> str:
    """Tell what several units tell of their stand, in lines of at most 100 characters."""
    return sections(
        _head(found),
        *(_effect(found, effect) for effect in found.effects),
        _unexplained(found),
        _positions(found),
        _gains(found),
        notes(found.notes),
    )


def _head(found: StandDiscovery) -> Iterator[str]:
    yield from wrapped(f"STAND  {len(found.units)} units: {', '.join(found.units)}")
    yield ""
    if not found.effects and found.common.unexplained is None:
        yield NOTHING
    for verdict, said in WHOSE.items():
        names = [title(found, e) for e in found.effects if e.verdict == verdict]
        if names:
            yield from wrapped(f"{sentence(said)}: {listed(names)}.")


def title(found: StandDiscovery, effect: StandEffect) -> str:
    """Name of an effect, and in brackets whether it is not sure."""
    return f"{effect.name} ({NOT_SURE})" if effect.id in found.doubtful else effect.name


def _effect(found: StandDiscovery, effect: StandEffect) -> Iterator[str]:
    yield f"{effect.name.capitalize()}  [{effect.id}], {effect.verdict}, {chance(effect.p_value)}"
    for name, quantity in effect.parameters.items():
        yield f"  {name} = {told(quantity)}"
    if effect.found_in:
        yield from wrapped(f"found beside the others in: {', '.join(effect.found_in)}", "  ")
    spread = f"they differ by less than {100.0 * effect.spread:.0f} % of it (95 %)"
    if effect.verdict == "unit":
        spread = "they differ from unit to unit"
    one = f"one size for all: chance of noise {probability(effect.p_one_value)}; {spread}"
    yield from wrapped(one, "  ")
    rows = [(name, told(effect.sizes[name])) for name in found.units]
    yield from aligned(rows, right=(), indent="    ", headed=False)
    if effect.indistinguishable:
        yield from wrapped(f"It could as well be: {', '.join(effect.indistinguishable)}.", "  ")


def _unexplained(found: StandDiscovery) -> Iterator[str]:
    if found.common.unexplained:
        yield SHARED
        yield from wrapped(found.common.unexplained.structure, "  ")


def _positions(found: StandDiscovery) -> Iterator[str]:
    if found.head:
        yield "Head positions, of what does not look like coefficients [urad, 95 %]"
        rows = [
            (f"{angle:g} deg", f"{error} +- {expanded}")
            for angle, error, expanded in head_rows(found)
        ]
        yield from aligned(rows, right={0}, indent="  ", headed=False)


def head_rows(found: StandDiscovery) -> Iterator[tuple[float, str, str]]:
    """Tell the error of each head position: angle [deg], value and half width [urad]."""
    for position in found.head:
        yield position.angle_deg, *in_millionths(position.error)


def _gains(found: StandDiscovery) -> Iterator[str]:
    if not found.coefficients:
        return
    yield "What the joint estimate gains: standard uncertainty of each unit's coefficients, median"
    rows: list[tuple[str, ...]] = [("", "stand from own readings", "from all", "smaller by", "")]
    gains = [_gain(changes) for changes in zip(*found.coefficients.values(), strict=True)]
    rows += [row for row, shrunk in gains if shrunk >= _WORTH_TELLING]
    if len(rows) > 1:
        yield from aligned(rows, right={1, 2, 3}, indent="  ")
    if any(shrunk < _WORTH_TELLING for _, shrunk in gains):
        others = [row[0] for row, shrunk in gains if shrunk < _WORTH_TELLING]
        yield from wrapped(f"no smaller by half a percent: {', '.join(others)}", "  ")


def gain_rows(found: StandDiscovery) -> list[tuple[str, ...]]:
    """Tell what the joint estimate gains: coefficient, own, joint, smaller by, unit."""
    return [_gain(changes)[0] for changes in zip(*found.coefficients.values(), strict=True)]


def _gain(changes: tuple[Change, ...]) -> tuple[tuple[str, ...], float]:
    """Row of a coefficient, and the part by which its uncertainty shrinks."""
    name, unit = symbol_of(changes[0].coefficient), changes[0].after.unit
    pairs = [(c.before.standard_uncertainty, c.after.standard_uncertainty) for c in changes]
    known = [(before, after) for before, after in pairs if before and after]
    if not known:
        return (name, "", "", "", ""), 0.0
    scale, shown = in_small_unit(unit)
    before, after = (median(column) * scale for column in zip(*known, strict=True))
    shrunk = 1.0 - median(after / before for before, after in known)
    row = (name, significant(before), significant(after), f"{100.0 * shrunk:.1f} %", shown)
    return row, shrunk
