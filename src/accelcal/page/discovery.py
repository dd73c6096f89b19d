"""The report of a discovery, told in its order."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import PurePath

from accelcal.model import symbol_of
from accelcal.page.blocks import (
    Block,
    Bullets,
    Chapter,
    Facts,
    Figure,
    Gallery,
    Highlight,
    Note,
    Paragraph,
    Section,
    Table,
    Tone,
)
from accelcal.page.pictures import picture
from accelcal.plural import counted
from accelcal.record import TumbleRecord
from accelcal.report.discovery import (
    CHANGE_HEADINGS,
    NOT_REGISTERED,
    aliases,
    change_row,
    entry_of,
    gap_rows,
    or_as_well,
    outcome,
)
from accelcal.report.findings import chance, factor_rows, noise_line, probability
from accelcal.report.lines import sentence
from accelcal.report.numbers import significant, sized
from accelcal.report.typeset import typeset
from accelcal.results.discovery import Discovery
from accelcal.results.findings import FoundEffect
from accelcal.shown_units import plain, readable
from accelcal.units import MICRO


def discovery_chapter(found: Discovery, record: TumbleRecord | None, name: str) -> Chapter:
    """Make the report of a discovery; `name` sets its pictures apart on a page of several.

    Without the record, the signatures over its residuals are not drawn.
    """
    tone, outcome = _outcome(found)
    sections = (
        _faults(found),
        _where(found, name),
        *(_effect(found, place, record, name) for place in range(len(found.effects))),
        _gap(found, name),
        _changes(found, name),
        _open(found),
        _next(found),
        _provenance(found),
    )
    return Chapter(
        sort="Discovery",
        title=found.serial or PurePath(found.source).name,
        subtitle=f"{found.readings} readings from {found.source}",
        tone=tone,
        outcome=outcome,
        lede=_lede(found),
        highlights=list(_highlights(found)),
        sections=[section for section in sections if section is not None],
    )


def _outcome(found: Discovery) -> tuple[Tone, str]:
    if found.effects:
        return "warn", f"{counted(len(found.effects), 'effect')} found"
    if found.unexplained:
        return "bad", "unexplained"
    if found.faults:
        return "warn", "faults of the readings"
    if found.reservations:
        return "warn", "nothing missing that shows, but the noise may hide something"
    return "good", "nothing missing that shows"


def _lede(found: Discovery) -> str:
    said = outcome(found, typeset(chance(found.p_value)))
    if not found.faults:
        return said
    return f"{counted(len(found.faults), 'fault')} of the readings came first. {said}"


def _highlights(found: Discovery) -> Iterator[Highlight]:
    before, after = (significant(gap.rms * MICRO) for gap in (found.before, found.after))
    if not found.changes_gap:
        yield Highlight("gap, rms", f"{before} µg", "of all readings")
        return
    yield Highlight("gap of all readings, rms", f"{before} → {after} µg", "before → after")
    held = found.before.heldout_rms, found.after.heldout_rms
    if held[0] is not None and held[1] is not None:
        shown = " → ".join(significant(value * MICRO) for value in held if value is not None)
        yield Highlight("gap of readings left out", f"{shown} µg", "before → after")
    for effect in found.effects:
        first = next((q for q in effect.parameters.values() if q.value is not None), None)
        if first is not None:
            value, _, uncertainty = sized(first).partition(" +- ")
            uncertainty, _, unit = uncertainty.partition(" ")
            detail = f"± {uncertainty} (95 %)" if uncertainty else effect.id
            yield Highlight(effect.name, typeset(f"{value} {unit}"), typeset(detail))


def _faults(found: Discovery) -> Section | None:
    if not found.faults:
        return None
    said = [typeset(fault.finding) for fault in found.faults]
    intro = "Looked for before any physics; what follows is found without them."
    return Section("Faults of the readings", [Note("warn", intro, said)])


def _where(found: Discovery, name: str) -> Section | None:
    if not found.where:
        return None
    heading, *rows = factor_rows(found.where)
    shown = [(factor.replace("*", " × "), share, typeset(p)) for factor, share, p in rows]
    caption = "Shares of the sum of squares, in the measure of the noise"
    shares = Table(caption, heading, shown, (1,))
    blocks: list[Block] = []
    if found.effects or found.unexplained:
        words = (
            "Share of the disagreement by factor of the test.",
            "Bars of the shares; the table below has the numbers.",
        )
        blocks.append(Gallery([picture(f"{name}where", found.plot.where, words), shares]))
    else:
        said = "No factor of the test has more than noise would give it."
        blocks += [Paragraph(said), shares]
    blocks.append(Paragraph(typeset(sentence(noise_line(found.noise)))))
    if found.unexplained:
        pattern = typeset(found.unexplained.structure)
        blocks.append(Note("bad", "A pattern that no known effect explains", [pattern]))
    return Section("Where simulation and measurement disagree", blocks)


def _effect(found: Discovery, place: int, record: TumbleRecord | None, name: str) -> Section:
    effect = found.effects[place]
    entry = entry_of(effect.id, effect.parameters)
    blocks: list[Block] = []
    if entry is not None:
        blocks.append(Paragraph(typeset(entry.physics)))
        blocks.append(
            Facts([("term", typeset(entry.formula)), ("signature", typeset(entry.signature))])
        )
    else:
        blocks.append(Paragraph(NOT_REGISTERED))
    caption = typeset(f"Its size ({chance(effect.p_value)})")
    size = Table(caption, ("parameter", "value (95 %)"), _parameters(effect))
    if record is None:
        said = "The signature is drawn over the residuals where the readings are given as well."
        blocks += [size, Paragraph(said)]
    elif effect.id in (earlier.id for earlier in found.effects[:place]):  # one picture has both
        blocks.append(size)
    else:
        blocks.append(
            Gallery([_signature(found, effect, record, f"{name}signature-{place}"), size])
        )
    if others := [typeset(said) for said in aliases(effect)]:
        blocks.append(Note("plain", "These readings fit others as well", others))
    return Section(f"{sentence(effect.name)} ({effect.id})", blocks)


def _parameters(effect: FoundEffect) -> list[tuple[str, str]]:
    return [
        (name.replace("_", " "), typeset(sized(quantity) + or_as_well(effect, name)))
        for name, quantity in effect.parameters.items()
    ]


def _signature(found: Discovery, effect: FoundEffect, record: TumbleRecord, name: str) -> Figure:
    words = (
        f"Signature of {effect.name} over the residuals that it explains.",
        "Points are readings less the model without this effect; the line is what it adds.",
    )
    return picture(name, partial(found.plot.signature, record, effect.id), words)


def _gap(found: Discovery, name: str) -> Section:
    (*heading, _), *rows = (tuple(map(typeset, row)) for row in gap_rows(found))
    numeric = range(1, len(heading))
    table = Table("Rms and χ² of reading minus model", (*heading, "unit"), rows, numeric)
    if not found.changes_gap:
        return Section("The gap", [table])
    words = (
        "The gap between model and readings, effect by effect; the dotted line is the noise of"
        " a reading.",
        "The gap before and after, fitted and left out; the table below has the numbers.",
    )
    drawn = picture(f"{name}gap", found.plot.gap, words)
    return Section("The gap, before and after", [Gallery([drawn, table])])


def _changes(found: Discovery, name: str) -> Section | None:
    if not (found.effects and found.coefficients):
        return None
    words = (
        "Coefficients without and with what was found, in 95 % half widths of the fit without it."
        " The interval with it counts what else the effects may be.",
        "Changes of the coefficients; the table below has the numbers.",
    )
    rows = [tuple(map(typeset, change_row(item))) for item in found.coefficients]
    headings = ("coefficient", *CHANGE_HEADINGS, "unit")
    table = Table("Coefficients over K₁", headings, rows, (1, 2, 3, 4, 5))
    drawn = picture(f"{name}changes", found.plot.changes, words, (3.8, 3.4))
    return Section("What it changes in the coefficients", [Gallery([drawn]), table])


def _open(found: Discovery) -> Section:
    blocks: list[Block] = []
    if found.undetectable:
        rows = [
            (
                _named(item.id),
                typeset(", ".join(map(symbol_of, item.absorbed_by))) or "nothing tells of it",
            )
            for item in found.undetectable
        ]
        caption = "Effects that this test cannot show, whatever their size"
        blocks.append(Table(caption, ("effect", "taken up by"), rows))
    if found.smallest_detectable:
        sizes = [(_named(d.id), *_scaled(d.value, d.unit)) for d in found.smallest_detectable]
        caption = "Smallest size that would be found nine times in ten"
        headings = ("effect", "size", "unit")
        blocks.append(Table(caption, headings, sizes, (1,), folded=True))
    if not blocks:
        blocks.append(Paragraph("Nothing of the catalogue is hidden from this test."))
    return Section("What these readings cannot tell", blocks)


def _named(identifier: str) -> str:
    entry = entry_of(identifier)
    return identifier if entry is None else f"{entry.name} ({identifier})"


def _scaled(value: float, unit: str) -> tuple[str, str]:
    scale, shown = readable(unit, value)
    return typeset(significant(value * scale, 2)), typeset(plain(shown))


def _next(found: Discovery) -> Section | None:
    if not found.next_measurement:
        return None
    return Section(
        "The next measurement", [Note("plain", "Measure next", [typeset(found.next_measurement)])]
    )


def _provenance(found: Discovery) -> Section:
    blocks: list[Block] = [Bullets([typeset(note) for note in found.notes])] if found.notes else []
    facts = [
        ("serial number", found.serial or "not recorded"),
        ("input", found.source),
        ("SHA-256 of the input", found.sha256 or "not recorded"),
        ("readings", str(found.readings)),
        ("reference temperature", f"{found.T0_degC:g} °C"),
        ("fixture angle taken as given", typeset(f"{MICRO * found.delta0_rad:g} urad")),
        ("false-alarm rate", f"{found.alpha:g} over the whole catalogue"),
        ("chance of noise, over all", typeset(probability(found.p_value))),
        ("software", found.software or "not recorded"),
    ]
    return Section("Notes and provenance", [*blocks, Facts(facts)])
