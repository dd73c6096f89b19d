"""The mean of several runs at one level, made once for the terminal, the notebook and the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from accelcal.compensate.at_temperature import mean_of_runs
from accelcal.report.calibration_rows import SHOWN_COEFFICIENTS, LawRow, law_row, meaning_of

if TYPE_CHECKING:
    from accelcal.results.calibration import Calibration


def mean_rows(calibration: Calibration) -> tuple[str, list[LawRow]] | None:
    """Name the runs, and make a line of each coefficient; None where there is no such mean."""
    found = mean_of_runs(calibration)
    if found is None:
        return None
    rows = []
    for name, symbol, coefficient, factor, unit in SHOWN_COEFFICIENTS:
        own = found.coefficients[symbol]
        meaning = meaning_of(found.first, symbol, coefficient) or symbol
        rows.append(law_row(name, meaning, own, factor, unit or own.unit))
    return found.runs, rows
