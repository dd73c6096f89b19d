"""The report of a calibration: tables, temperature laws, angles, effects, and the evidence."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import PurePath
from typing import Any, NamedTuple

from accelcal.compensate.at_temperature import mean_of_runs, means_of_runs
from accelcal.page import evidence
from accelcal.page.blocks import (
    Block,
    Bullets,
    Chapter,
    Gallery,
    Highlight,
    Note,
    Paragraph,
    Section,
    Table,
    Tone,
)
from accelcal.page.evidence import place
from accelcal.page.pictures import pictures
from accelcal.plot.temperature import returns_to_a_level
from accelcal.plural import counted, degrees_of_freedom, listed
from accelcal.report.calibration import (
    as_found_of,
    fixture_angle_rows,
    in_microradians,
    reversed_mountings,
    scale_factor_elsewhere,
    sizes_of,
)
from accelcal.report.calibration_rows import (
    HEADINGS,
    LAW_HEADINGS,
    SHOWN_COEFFICIENTS,
    alarms,
    coefficient_rows,
    correlations,
    first_alarms,
    rows_of_mean,
    strong_correlations,
    table_title,
    temperature_laws,
    temperature_rows,
    without_uncertainty,
)
from accelcal.report.lines import sentence
from accelcal.report.numbers import significant
from accelcal.report.typeset import typeset
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration
from accelcal.results.tables_in_use import tables_in_use
from accelcal.results.usable import is_misprinted
from accelcal.units import MICRO

_HIGHLIGHTED = ("K1", "k0", "delta")
_UNITS = {"1": ""}
_OF_MISPRINTS = (
    "The printed equations (6) are misprinted; what their symbols really are is said below each"
    " table. Fit by least-squares or closed-form."
)


def calibration_chapter(calibration: Calibration, name: str) -> Chapter:
    """Make the report of a calibration; `name` sets its pictures apart on a page of several."""
    tone, outcome = _outcome(calibration)
    date = f"tested {calibration.date}, " if calibration.date else ""
    sections = (
        _warnings(calibration),
        evidence.verdict(calibration),
        _coefficients(calibration),
        evidence.open_questions(calibration),
        _temperature(calibration, name),
        _fixture_angles(calibration),
        _effects(calibration),
        evidence.residuals(calibration, name),
        evidence.budget(calibration, name),
        evidence.checks(calibration),
        evidence.provenance(calibration),
    )
    return Chapter(
        sort="Calibration",
        title=str(calibration.serial or PurePath(calibration.source).name),
        subtitle=f"{date}from {calibration.source}",
        tone=tone,
        outcome=outcome,
        lede=_lede(calibration),
        highlights=list(_highlights(calibration)),
        sections=[section for section in sections if section is not None],
    )


def _outcome(calibration: Calibration) -> tuple[Tone, str]:
    """How it came out: the verdict, or else what the checks say."""
    verdict = None if calibration.verdict is None else calibration.verdict.outcome
    outcomes: tuple[tuple[bool, Tone, str], ...] = (
        (is_misprinted(calibration), "bad", "not a calibration"),
        (verdict == "fail", "bad", "fails its data sheet"),
        (bool(alarms(calibration)), "warn", "checks warn"),
        (bool(without_uncertainty(calibration)), "warn", "no uncertainty"),
        (verdict == "pass", "good", "keeps its data sheet"),
        (verdict is not None, "warn", "data sheet: some limits open"),
        (_not_made(calibration) > 0, "plain", "no check warns"),
        (True, "good", "no check warns"),
    )
    return next((tone, said) for holds, tone, said in outcomes if holds)


class _Main(NamedTuple):
    """One of the numbers that a report begins with, and whether the symbol is a sum of several."""

    name: str
    symbol: str
    value: str
    expanded: str
    unit: str
    is_sum: bool = False


def _main_numbers(calibration: Calibration) -> list[_Main]:
    """Scale factor, bias and misalignment: by the laws at T0, else of the table nearest to it.

    Nothing where the symbols are misprinted.
    """
    if is_misprinted(calibration):
        return []
    model = calibration.temperature_model
    if mean := mean_of_runs(calibration):
        rows = zip(SHOWN_COEFFICIENTS, rows_of_mean(mean), strict=True)
        return [_Main(*row, row[1] != own[1]) for own, row in rows if own[1] in _HIGHLIGHTED]
    if model is None or not _has_laws(calibration):
        return _of_nearest(calibration)
    laws = {row[1]: _Main(*row) for row in temperature_rows(calibration, model)}
    return [laws[symbol] for symbol in ("K1N", "k0N", "deltaN")]  # as `_HIGHLIGHTED`


def _of_nearest(calibration: Calibration) -> list[_Main]:
    table = tables_in_use(calibration).main
    free, found = _free_misalignment(calibration, table), []
    for row in coefficient_rows(table):
        name, own = row.name, (row.value, row.expanded, row.unit)
        if row.symbol == "delta" and free is not None:
            name, own = f"{name} without fixture angle", in_microradians(free)
        if row.symbol in _HIGHLIGHTED:
            found.append(_Main(name, row.meaning or row.symbol, *own, is_sum=bool(row.meaning)))
    return found


def _lede(calibration: Calibration) -> str:
    if is_misprinted(calibration):
        return _OF_MISPRINTS
    scale_factor, bias, _ = map(_with, _main_numbers(calibration))
    told = f"Scale factor {scale_factor} and bias {bias}{_origin(calibration)}. "
    said = typeset(told) + _said_of_verdict(calibration) + _said_of_checks(calibration)
    return said.rstrip()


def _with(number: _Main) -> str:
    if number.value == "not determined":
        return "not determined"
    told = f"{number.value} +- {number.expanded} {number.unit}" if number.expanded else number.value
    return f"{told} (which is {number.symbol})" if number.is_sum else told


def _origin(calibration: Calibration) -> str:
    """Where the main numbers hold, what they are from, and what was taken out of it."""
    names = listed(effect.name for effect in calibration.effects)
    return _readings(calibration) + f", with {names} taken out" * bool(names)


def _readings(calibration: Calibration) -> str:
    tables = calibration.tables
    total = counted(sum(table.readings for table in tables), "reading")
    if _has_laws(calibration):
        return (
            f" at {calibration.T0_degC:.4g} degC by the temperature laws, from {total} in"
            f" {counted(len(tables), 'table')}"
        )
    used, mean = tables_in_use(calibration), mean_of_runs(calibration)
    table = used.main
    level = mean.temperature if mean else table.temperature_degC
    where = "" if level is None else f" at {level:.4g} degC"
    if len(tables) == 1:
        return f"{where}, from {total}"
    if mean:
        averaged = counted(sum(own.readings for own in used.of_main), "reading")
        return f"{where} by the mean of {mean.runs}, from {averaged}"
    own = counted(table.readings, "reading")
    return f"{where}, from the {own} of {table_title(table)}, one of {len(tables)} tables"


def _has_laws(calibration: Calibration) -> bool:
    model = calibration.temperature_model
    return model is not None and model.K1.at_T0 is not None


def _said_of_verdict(calibration: Calibration) -> str:
    verdict = calibration.verdict
    if verdict is None:
        return ""
    failed = [limit.limit for limit in verdict.judgements if limit.outcome == "fail"]
    names = ", ".join(dict.fromkeys(name.replace("_", " ") for name in failed))
    of = verdict.specification
    if failed:
        return f"It fails the data sheet {of} in {names}. "
    open_ = [limit for limit in verdict.judgements if limit.outcome != "pass"]
    if open_:
        return (
            f"It breaks no limit of {of}, but {len(open_)} of {len(verdict.judgements)} are open. "
        )
    return f"It keeps all limits of {of}. "


def _said_of_checks(calibration: Calibration) -> str:
    """Say which checks warn, and which were not made; the outcome tells when none warns."""
    warned, skipped = len(alarms(calibration)), _not_made(calibration)
    if warned:
        return f"{counted(warned, 'check').capitalize()} warn{'s' if warned == 1 else ''}."
    judged = "No check warns. " if calibration.verdict is not None else ""
    return judged + (f"{counted(skipped, 'check')} could not be made." if skipped else "")


def _not_made(calibration: Calibration) -> int:
    """How many checks could not be made, of all tables and of the record as a whole."""
    gates = [gate for table in calibration.tables for gate in table.gates]
    return sum(gate.verdict not in ("pass", "warn") for gate in (*gates, *calibration.gates))


def _highlights(calibration: Calibration) -> Iterator[Highlight]:
    for number in (*_main_numbers(calibration), *_loop(calibration)):
        if number.value == "not determined":
            continue
        unit = _UNITS.get(number.unit, number.unit)
        known = number.expanded not in ("", "unknown")
        detail = f"± {typeset(number.expanded)} (95 %)" if known else "uncertainty unknown"
        name = f"{number.name} {typeset(number.symbol)}"
        yield Highlight(name, typeset(f"{number.value} {unit}"), detail)


def _loop(calibration: Calibration) -> list[_Main]:
    """The hysteresis of the bias, by which it is off its law either way; empty where unknown."""
    model = calibration.temperature_model
    if model is None or model.hysteresis is None:
        return []
    return [_Main(*temperature_rows(calibration, model)[-1])]


def _free_misalignment(calibration: Calibration, table: TableCalibration) -> Quantity | None:
    """The misalignment of a table free of the fixture angle, where it is known."""
    found = calibration.misalignment(table)
    return None if found is table.error_model["delta"] else found


def _warnings(calibration: Calibration) -> Section | None:
    blocks: list[Block] = []
    bare, warned = without_uncertainty(calibration), first_alarms(calibration)
    if bare:
        blocks.append(Note("bad", "No uncertainty", [typeset(item) for item in bare]))
    if warned:
        blocks.append(Note("warn", "Clear these up first", [typeset(item) for item in warned]))
    return Section("Before you use these numbers", blocks) if blocks else None


_HEADINGS = ("coefficient", "symbol", *HEADINGS[2:])
_LAW_HEADINGS = ("quantity", "symbol", *LAW_HEADINGS[2:])


def _coefficients(calibration: Calibration) -> Section:
    intro = (
        "U is the half width of the interval that holds the true value with a probability of 95 %,"
        " u the standard uncertainty. Values are per power of local g."
    )
    blocks: list[Block] = [Paragraph(intro)]
    for mean in means_of_runs(calibration):
        rows = _set(rows_of_mean(mean))
        blocks.append(Table(f"Mean of {mean.runs}", _LAW_HEADINGS, rows, (2, 3)))
    for table in calibration.tables:
        blocks += _of_table(table, calibration.g_local_m_s2)
    told = [_correlations(table) for table in calibration.tables if table.covariance_matrix]
    return Section("Coefficients", [*blocks, Gallery(told)] if told else blocks)


def _of_table(table: TableCalibration, local_gravity: float | None) -> Iterator[Block]:
    found = coefficient_rows(table)
    plain = (r._replace(standard=_plain(r.standard)) for r in found)
    rows = [(r.name, r.symbol, *r[3:]) for r in plain]
    count = f"{table.readings} readings, {degrees_of_freedom(table.dof)}"
    yield Table(f"{sentence(place(table))} ({count})", _HEADINGS, _set(rows), (2, 3, 5, 6))
    said = [f"{r.symbol} stands for {r.meaning}" for r in found if r.meaning]
    said += [line.strip() for line in scale_factor_elsewhere(table, local_gravity)]
    said += strong_correlations(table)
    if said or table.warnings:
        yield Bullets([typeset(sentence) for sentence in (*said, *table.warnings)])


def _plain(number: str) -> str:
    """A number without an exponent, beside others of its size."""
    return significant(float(number), 2) if "e" in number else number


def _correlations(table: TableCalibration) -> Table:
    names, found = correlations(table)
    told = [[_correlation(value) for value in row] for row in found.tolist()]
    rows = [(name, *row) for name, row in zip(names, told, strict=True)]
    numeric = range(1, len(names) + 1)
    caption = f"Correlation of the coefficients, {place(table)}"
    return Table(caption, _set([("", *names)])[0], _set(rows), numeric, folded=True)


def _correlation(value: float) -> str:
    return "" if math.isnan(value) else f"{round(value, 2) + 0.0:.2f}"


def _temperature(calibration: Calibration, name: str) -> Section | None:
    """Tell the temperature laws, with bands and loop; None where there is one level only."""
    model = calibration.temperature_model
    if not model:
        return None
    told = []
    for whose, found in temperature_laws(calibration):
        caption = f"Bilinear laws{whose} about T0 = {calibration.T0_degC:g} degC"
        rows = [(row[0].strip(), *row[1:]) for row in found]
        told.append(Table(typeset(caption), _LAW_HEADINGS, _set(_sided(rows)), (2, 3)))
    blocks: list[Block] = [Gallery([*_temperature_pictures(calibration, name), told[0]]), *told[1:]]
    if model.warnings:
        blocks.append(Bullets([typeset(sentence) for sentence in model.warnings]))
    return Section("Temperature", blocks)


def _sided(rows: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
    """Say in each row of a slope whose it is: rows are read alone on a phone."""
    told: list[tuple[str, ...]] = []
    of = ""
    for name, *rest in rows:
        if name.startswith("slope"):
            told.append((f"{of}, {name}", *rest))
        else:
            of = name.removesuffix(" at T0")
            told.append((name, *rest))
    return told


def _temperature_pictures(calibration: Calibration, name: str) -> Any:
    what = ("bias", "scale factor", "misalignment")
    again = returns_to_a_level(calibration)
    loop = " Arrows lead from run to run, as a level is met again: the loop of hysteresis." * again
    told = [
        (
            f"Above, the law of the {quantity} with its 95 % band, and the runs with their 95 %"
            f" intervals; below, the runs less the law.{loop}",
            f"The {quantity} against temperature: points of the runs, the bilinear law and its"
            " band; the table below has its numbers.",
        )
        for quantity in what
    ]
    return pictures(f"{name}temperature", calibration.plot.temperature, told, (3.8, 4.4), rows=2)


def _fixture_angles(calibration: Calibration) -> Section | None:
    """Tell the fixture angles; None where no axis was measured on both sides."""
    blocks: list[Block] = []
    for found in calibration.fixture_angle:
        told = reversed_mountings(found)
        caption = f"Mountings {told}, the misalignment free of the fixture angle"
        blocks.append(Table(caption, _LAW_HEADINGS, _set(fixture_angle_rows(found)), (2, 3)))
    return Section("Fixture angle", blocks) if blocks else None


def _effects(calibration: Calibration) -> Section | None:
    """Tell the effects that were taken out of the readings; None where there are none."""
    rows = []
    for effect in calibration.effects:
        gaps = [significant(gap * MICRO) for gap in (effect.gap_before, effect.gap_after)]
        size = sizes_of(effect) + as_found_of(calibration, effect)
        rows.append((effect.name, typeset(size), *gaps))
    if not rows:
        return None
    headings = ("effect", "size in this record (95 %)", "gap before [µg]", "gap after [µg]")
    caption = "Effects taken out of the readings before the fit"
    return Section("Effects taken out", [Table(caption, headings, rows, (2, 3))])


def _set(rows: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
    return [tuple(map(typeset, row)) for row in rows]
