"""The mean of several runs at one level, made once for the terminal, the notebook and the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from accelcal.report.calibration_rows import SHOWN_COEFFICIENTS, LawRow, law_row, meaning_of

if TYPE_CHECKING:
    from accelcal.compensate.at_temperature import MeanOfRuns


def rows_of_mean(found: MeanOfRuns) -> list[LawRow]:
    """Make a line of each coefficient."""
    rows = []
    for name, symbol, coefficient, factor, unit in SHOWN_COEFFICIENTS:
        own = found.coefficients[symbol]
        meaning = meaning_of(found.first, symbol, coefficient) or symbol
        rows.append(law_row(name, meaning, own, factor, unit or own.unit))
    return rows
