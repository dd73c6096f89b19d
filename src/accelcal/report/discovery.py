"""A discovery as a colleague would tell it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from accelcal.errors import InputError
from accelcal.model import symbol_of
from accelcal.plural import listed
from accelcal.report.findings import chance, noise_line, where_lines
from accelcal.report.lines import aligned, notes, sections, unit_of, wrapped
from accelcal.report.numbers import matching_digits, significant, told
from accelcal.results.discovery import Discovery
from accelcal.results.findings import Change, Detectable, FoundEffect
from accelcal.shown_units import in_small_unit, plain, readable

if TYPE_CHECKING:
    from accelcal.effects.effect import Effect
    from accelcal.results.quantity import Quantity


NOT_SURE = "not sure"

CHANGE_HEADINGS = ("before", "U (95 %)", "after", "U (95 %)", "change")

_ROUNDING = 1e-10
"""Change of a coefficient over K1 that the arithmetic of a fit may make [g/g^n, or per degC]."""


def text(found: Discovery) -> str:
    """Tell a discovery in lines of at most 100 characters."""
    return sections(
        _head(found),
        _faults(found),
        _verdict(found),
        _where(found),
        *(_effect(found, effect) for effect in found.effects),
        _changes(found),
        _open(found),
        notes(found.notes),
    )


def _head(found: Discovery) -> Iterator[str]:
    unit = unit_of(found.serial, found.source)
    yield from wrapped(f"DISCOVERY  {unit}, {found.readings} readings")
    yield from wrapped(noise_line(found.noise))


def _faults(found: Discovery) -> Iterator[str]:
    if found.faults:
        yield "Faults of the readings, before any physics"
    for fault in found.faults:
        yield from wrapped(fault.finding, "  - ")


def _verdict(found: Discovery) -> Iterator[str]:
    yield from wrapped(outcome(found, chance(found.p_value)))
    yield ""
    yield from aligned(gap_rows(found), right={1, 2} if found.changes_gap else {1})


def outcome(found: Discovery, p: str) -> str:
    """Tell in a sentence what was discovered, with the chance of noise as it is written."""
    if found.effects:
        names = listed(with_doubts(found, effect) for effect in found.effects)
        more = ", and something that no known effect explains" if found.has_more else ""
        return f"Model and readings disagree ({p}). What is missing: {names}{more}."
    if found.unexplained:
        return f"Model and readings disagree ({p}), and no known effect explains it."
    but = ", but " * bool(found.reservations) + ", and ".join(found.reservations)
    if found.faults:
        return f"Beside these faults model and readings agree ({p}): nothing else shows{but}."
    return f"Model and readings agree ({p}): nothing is missing that shows{but}."


def with_doubts(found: Discovery, effect: FoundEffect) -> str:
    """Name of an effect, and in brackets what makes it uncertain."""
    others = len(effect.indistinguishable)
    or_else = [f"or {_alias_names(effect) if others == 1 else f'one of {others} others'}"]
    doubts = or_else * bool(others) + [NOT_SURE] * (effect.id in found.doubtful)
    return f"{effect.name} ({'; '.join(doubts)})" if doubts else effect.name


def gap_rows(found: Discovery) -> list[tuple[str, ...]]:
    """Tell the gap, before and after where it becomes another one, and its unit, with a heading."""
    rows: list[tuple[str, ...]] = [("gap", "before", "after", "")]
    rows.append(("all readings, rms", *_both(found.before.rms, found.after.rms), "ug"))
    held = (found.before.heldout_rms, found.after.heldout_rms)
    if held[0] is not None and held[1] is not None:
        rows.append(("readings left out, rms", *_both(held[0], held[1]), "ug"))
    chi2 = (found.before.reduced_chi2, found.after.reduced_chi2)
    rows.append(("chi^2 per degree of freedom", *(significant(value, 3) for value in chi2), ""))
    if found.changes_gap:
        return rows
    return [("gap", "value", ""), *(row[:2] + row[3:] for row in rows[1:])]


def _both(before: float, after: float) -> tuple[str, str]:
    return significant(before * 1e6, 3), significant(after * 1e6, 3)


def _where(found: Discovery) -> Iterator[str]:
    if found.effects or found.unexplained:
        structure = found.unexplained.structure if found.unexplained else ""
        yield from where_lines(found.where, structure)


NOT_REGISTERED = (
    "An effect of your own that is not registered here. accelcal.register, or --effects with its"
    " file, makes it known to reports, pictures, fit, compare and twin."
)


def _effect(found: Discovery, effect: FoundEffect) -> Iterator[str]:
    entry = entry_of(effect.id, effect.parameters)
    yield from wrapped(f"{effect.name.capitalize()}  [{effect.id}], {chance(effect.p_value)}")
    if entry is not None:
        yield from wrapped(f"{entry.physics} Term: {entry.formula}", "  ")
        yield from wrapped(entry.signature, "  ")
    else:
        yield from wrapped(NOT_REGISTERED, "  ")
    for name, quantity in effect.parameters.items():
        taken_up = ", as the coefficients take it up" if quantity.value is None else ""
        yield from wrapped(f"{name} = {told(quantity)}{taken_up}{or_as_well(effect, name)}", "  ")
    if len(found.effects) > 1:
        before, after = _both(effect.gap_before, effect.gap_after)
        yield f"  gap {before} -> {after} ug"
    for said in aliases(effect):
        yield from wrapped(said, "  ")


def or_as_well(effect: FoundEffect, name: str) -> str:
    """Tell what other values of a parameter explain the readings as well, behind its value."""
    places = {place[name] for place in effect.elsewhere if name in place}
    others = sorted(places - {effect.parameters[name].value})
    return f", or as well {' or '.join(f'{other:g}' for other in others)}" if others else ""


def entry_of(name: str, parameters: Iterable[str] = ()) -> Effect | None:
    """Entry of an effect; None for one of a user's own that is not registered here."""
    from accelcal.effects.empirical import effect_of

    try:
        return effect_of(name, parameters)
    except InputError:
        return None


def aliases(effect: FoundEffect) -> list[str]:
    """Say what explains the readings as well, and how to tell them apart; empty where nothing."""
    if not effect.indistinguishable:
        return []
    apart = [f"To tell them apart: {effect.to_tell_apart}."] if effect.to_tell_apart else []
    return [f"It could as well be: {_alias_names(effect)}.", *apart]


def _alias_names(effect: FoundEffect) -> str:
    """Names of the effects that explain the readings as well, or their ids where unknown here."""
    others = {other: entry_of(other) for other in effect.indistinguishable}
    return ", ".join(entry.name if entry else other for other, entry in others.items())


def _changes(found: Discovery) -> Iterator[str]:
    if not found.effects:
        return
    yield "What it changes in the coefficients (over K1)"
    rows = [("", *CHANGE_HEADINGS, ""), *map(change_row, found.coefficients)]
    yield from aligned(rows, right={1, 2, 3, 4, 5}, indent="  ")


def change_row(item: Change) -> tuple[str, ...]:
    """Tell a coefficient: its symbol, what `CHANGE_HEADINGS` say, and the unit."""
    scale, unit = in_small_unit(item.after.unit)
    change = (item.after.value or 0.0) - (item.before.value or 0.0)
    change = change if abs(change) > _ROUNDING else 0.0
    ends = (text for side in (item.before, item.after) for text in _side(item, side, scale))
    return (symbol_of(item.coefficient), *ends, _digits(change, item, item.after, scale), unit)


def _side(item: Change, side: Quantity, scale: float) -> tuple[str, str]:
    half = matching_digits(0.0, side.expanded_uncertainty, scale)[1]
    if item.coefficient == "K1":  # relative to the fit that the search started from
        return "", half
    return _digits(side.value or 0.0, item, side, scale), half


def _digits(value: float, item: Change, side: Quantity, scale: float) -> str:
    """Write a number with the digits of its U, else with four of the coefficient, two of K1."""
    if side.expanded_uncertainty is not None:
        return matching_digits(value, side.expanded_uncertainty, scale)[0]
    if item.coefficient == "K1":  # the change alone
        return significant(value * scale, 2) if value else "0"
    largest = max(abs(q.value or 0.0) for q in (item.before, item.after)) * scale
    decimals = len(significant(largest, 4).partition(".")[2])
    return f"{round(value * scale, decimals) + 0.0:.{decimals}f}"


def _open(found: Discovery) -> Iterator[str]:
    if found.smallest_detectable:
        yield "What this test would show nine times in ten, from this size on"
        yield from wrapped(", ".join(map(_detectable, found.smallest_detectable)), "  ")
    if found.undetectable:
        yield "What this test cannot show, and what would take it up"
        for item in found.undetectable:
            if item.absorbed_by:
                yield f"  {item.id}: {', '.join(map(symbol_of, item.absorbed_by))}"
        if untold := [item.id for item in found.undetectable if not item.absorbed_by]:
            yield from wrapped(f"nothing tells of {', '.join(untold)}", "  ")
    if found.next_measurement:
        yield "Next measurement"
        yield from wrapped(found.next_measurement, "  ")


def _detectable(item: Detectable) -> str:
    factor, unit = readable(item.unit, item.value)
    return f"{item.id} {significant(factor * item.value, 2)} {plain(unit)}"
