"""The report of what several units tell of their stand."""

from __future__ import annotations

from functools import partial

from accelcal.page.blocks import Block, Bullets, Chapter, Gallery, Note, Paragraph, Section, Table
from accelcal.page.pictures import picture
from accelcal.plural import counted
from accelcal.report.findings import chance, probability
from accelcal.report.lines import sentence
from accelcal.report.numbers import sized
from accelcal.report.stand_discovery import NOTHING, SHARED, WHOSE, gain_rows, head_rows, title
from accelcal.report.typeset import typeset
from accelcal.results.stand_discovery import StandDiscovery, StandEffect


def stand_chapter(found: StandDiscovery, name: str) -> Chapter:
    """Make the report of a stand; `name` sets its pictures apart on a page of several."""
    sections = (
        *(_effect(found, e, f"{name}sizes-{i}") for i, e in enumerate(found.effects)),
        _unexplained(found),
        _head(found, name),
        _gains(found),
        _notes(found),
    )
    return Chapter(
        sort="Stand",
        title=f"The stand of {len(found.units)} units",
        subtitle=", ".join(found.units),
        tone="warn" if found.effects or found.common.unexplained else "good",
        outcome=counted(len(found.effects), "effect") if found.effects else "nothing missing",
        lede=_lede(found),
        highlights=(),
        sections=[section for section in sections if section is not None],
    )


def _lede(found: StandDiscovery) -> str:
    said = [f"{sentence(title(found, e))} is {WHOSE[e.verdict]}." for e in found.effects]
    if not said and found.common.unexplained is None:
        said = [NOTHING]
    return " ".join(said) or "The units share a pattern that no known effect explains."


def _effect(found: StandDiscovery, effect: StandEffect, name: str) -> Section:
    p = f"{sentence(chance(effect.p_value))}; one size for all: {probability(effect.p_one_value)}."
    rows = [
        *((name.replace("_", " "), quantity) for name, quantity in effect.parameters.items()),
        *((f"size in {unit}", effect.sizes[unit]) for unit in found.units),
    ]
    sizes = [(what, typeset(sized(quantity))) for what, quantity in rows]
    words = (f"Size of {effect.name}, unit by unit.", "The table below has the numbers.")
    drawn = picture(name, partial(found.plot.sizes, effect.id), words)
    table = Table("Sizes", ("of", "value (95 %)"), sizes)
    blocks: list[Block] = [
        Paragraph(f"It is {WHOSE[effect.verdict]}. {p}"),
        Gallery([drawn, table]),
    ]
    if effect.indistinguishable:
        other = f"It could as well be: {', '.join(effect.indistinguishable)}."
        blocks.append(Note("plain", "These readings fit others as well", [other]))
    return Section(f"{sentence(effect.name)} ({effect.id})", blocks)


def _unexplained(found: StandDiscovery) -> Section | None:
    if found.common.unexplained is None:
        return None
    pattern = typeset(found.common.unexplained.structure)
    return Section(SHARED, [Note("bad", "Pattern", [pattern])])


def _head(found: StandDiscovery, name: str) -> Section | None:
    if not found.head:
        return None
    words = ("Errors of the head positions.", "The table below has the numbers.")
    rows = [(f"{angle:g}°", *map(typeset, shown)) for angle, *shown in head_rows(found)]
    headings = ("head angle", "error [µrad]", "U (95 %)")
    caption = "True minus nominal, of what does not look like coefficients"
    table = Table(caption, headings, rows, (1, 2))
    return Section("The head", [Gallery([picture(f"{name}head", found.plot.head, words), table])])


def _gains(found: StandDiscovery) -> Section | None:
    if not found.coefficients:
        return None
    rows = [tuple(map(typeset, row)) for row in gain_rows(found)]
    headings = ("coefficient", "stand from own readings", "from all", "smaller by", "unit")
    caption = "Standard uncertainty of each unit's coefficients, median"
    return Section("What the joint estimate gains", [Table(caption, headings, rows, (1, 2, 3))])


def _notes(found: StandDiscovery) -> Section | None:
    return Section("Notes", [Bullets(list(map(typeset, found.notes)))]) if found.notes else None
