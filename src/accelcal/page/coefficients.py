"""Sections of a report on what was calibrated: tables, temperature laws, angles, effects."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from accelcal.page.blocks import Block, Bullets, Gallery, Paragraph, Section, Table
from accelcal.page.pictures import pictures
from accelcal.page.typeset import typeset
from accelcal.plural import counted
from accelcal.report.calibration import (
    fixture_angle_rows,
    reversed_mountings,
    scale_factor_elsewhere,
    sizes_of,
)
from accelcal.report.calibration_rows import (
    HEADINGS,
    LAW_HEADINGS,
    coefficient_rows,
    strong_correlations,
    temperature_laws,
)
from accelcal.report.lines import sentence
from accelcal.report.numbers import significant
from accelcal.results.calibration import Calibration
from accelcal.results.table import TableCalibration
from accelcal.units import MICRO

_HEADINGS = ("coefficient", "symbol", *HEADINGS[2:])
_LAW_HEADINGS = ("quantity", "symbol", *LAW_HEADINGS[2:])


def place(table: TableCalibration) -> str:
    """Name a table by its run, temperature and mounting."""
    temperature = table.temperature_degC
    where = "" if temperature is None else f", {temperature:.4g} degC"
    return f"run {table.run}{typeset(where)}, mounting {table.mounting}"


def coefficients(calibration: Calibration) -> Section:
    """Tell the coefficients of each table, and what they stand for."""
    intro = (
        "U is the half width of the interval that holds the true value with a probability of 95 %,"
        " u the standard uncertainty. Values are per power of local g."
    )
    blocks: list[Block] = [Paragraph(intro)]
    for table in calibration.tables:
        blocks += _of_table(table, calibration.g_local_m_s2)
    return Section("Coefficients", blocks)


def _of_table(table: TableCalibration, local_gravity: float | None) -> Iterator[Block]:
    found = coefficient_rows(table)
    plain = (r._replace(standard=_plain(r.standard)) for r in found)
    rows = [(r.name, r.symbol, *r[3:]) for r in plain]
    count = f"{table.readings} readings, {counted(table.dof, 'degree')} of freedom"
    yield Table(
        f"{sentence(place(table))} ({count})", _HEADINGS, _set(rows), frozenset({2, 3, 5, 6})
    )
    said = [f"{r.symbol} stands for {r.meaning}" for r in found if r.meaning]
    said += [line.strip() for line in scale_factor_elsewhere(table, local_gravity)]
    said += strong_correlations(table)
    if said or table.warnings:
        yield Bullets([typeset(sentence) for sentence in (*said, *table.warnings)])
    if table.covariance_matrix:
        yield _correlations(table)


def _plain(number: str) -> str:
    """A number without an exponent, beside others of its size."""
    return significant(float(number), 2) if "e" in number else number


def _correlations(table: TableCalibration) -> Table:
    names = table.covariance_names
    told = [[_correlation(value) for value in row] for row in table.correlation.tolist()]
    rows = [(name, *row) for name, row in zip(names, told, strict=True)]
    numeric = frozenset(range(1, len(names) + 1))
    caption = f"Correlation of the coefficients, {place(table)}"
    return Table(caption, _set([("", *names)])[0], _set(rows), numeric, folded=True)


def _correlation(value: float) -> str:
    return "" if math.isnan(value) else f"{round(value, 2) + 0.0:.2f}"


def temperature(calibration: Calibration, name: str) -> Section | None:
    """Tell the temperature laws, with bands and loop; None where there is one level only."""
    model = calibration.temperature_model
    if not model:
        return None
    told = []
    for whose, found in temperature_laws(calibration):
        caption = f"Bilinear laws{whose} about T0 = {calibration.T0_degC:g} degC"
        rows = [(row[0].strip(), *row[1:]) for row in found]
        told.append(Table(typeset(caption), _LAW_HEADINGS, _set(_sided(rows)), frozenset({2, 3})))
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
    told = [
        (
            f"Above, the law of the {quantity} with its 95 % band, and the runs with their 95 %"
            " intervals; below, the runs less the law. Where a level is met again, arrows lead from"
            " run to run: the loop of hysteresis.",
            f"The {quantity} against temperature: points of the runs, the bilinear law and its"
            " band; the table below has its numbers.",
        )
        for quantity in what
    ]
    return pictures(f"{name}temperature", calibration.plot.temperature, told, (3.8, 4.4), rows=2)


def fixture_angles(calibration: Calibration) -> Section | None:
    """Tell the fixture angles; None where no axis was measured on both sides."""
    blocks: list[Block] = []
    for found in calibration.fixture_angle:
        told = reversed_mountings(found)
        caption = f"Mountings {told}, the misalignment free of the fixture angle"
        blocks.append(
            Table(caption, _LAW_HEADINGS, _set(fixture_angle_rows(found)), frozenset({2, 3}))
        )
    return Section("Fixture angle", blocks) if blocks else None


def effects(calibration: Calibration) -> Section | None:
    """Tell the effects that were taken out of the readings; None where there are none."""
    rows = []
    for effect in calibration.effects:
        gaps = [significant(gap * MICRO) for gap in (effect.gap_before, effect.gap_after)]
        rows.append((effect.name, typeset(sizes_of(effect)), *gaps))
    if not rows:
        return None
    headings = ("effect", "size in this record (95 %)", "gap before [µg]", "gap after [µg]")
    caption = "Effects taken out of the readings before the fit"
    return Section("Effects taken out", [Table(caption, headings, rows, frozenset({2, 3}))])


def _set(rows: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
    return [tuple(map(typeset, row)) for row in rows]
