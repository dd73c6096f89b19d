"""What a reader must know of the readings of one table before using what they give."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from accelcal.arrays import Mask
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.record import TumbleRecord
from accelcal.sentences import Sentence


def of_table(table: PreparedTable, noise: ReadingNoise, uneven: Mask) -> Iterator[Sentence]:
    """Return what to know of the readings of a table, in R records of one plan."""
    for text in table.estimability.sentences():
        yield Sentence(True, text)
    yield from _of_declared_scatter(table.record)
    yield Sentence(
        noise.source == "none",
        "no uncertainty: one reading a coefficient and no declared std; repeat strokes or give"
        " the columns std and n",
    )
    yield Sentence(
        noise.source == "residuals",
        "reading noise from the residuals of the fit, as too few readings are repeated; repeat"
        " strokes for narrower intervals",
    )
    yield Sentence(
        ~np.isnan(noise.excess),
        lambda excess: (
            f"the strokes scatter {excess:.2g} times more than the declared std;"
            " uncertainties follow the strokes"
        ),
        [noise.excess],
    )
    yield Sentence(
        ~np.isnan(noise.shortfall),
        lambda shortfall: (
            f"the declared std is {shortfall:.2g} times the scatter of the strokes, and U and the"
            f" checks follow it; {_remedy(table.record)}"
        ),
        [noise.shortfall],
    )
    yield Sentence(
        uneven,
        "the strokes scatter more at some positions than at others: U follows the scatter at each",
    )


def _of_declared_scatter(record: TumbleRecord) -> Iterator[Sentence]:
    std, count = record.std, record.count
    if std is not None and not np.all(std > 0.0):
        lacking = {"missing": np.isnan(std).any(), "zero": (std == 0.0).any()}
        what = " or ".join(word for word, found in lacking.items() if found)
        where = "some" if (std > 0.0).any() else "all"
        yield Sentence(
            True, f"std is {what} at {where} readings, so the declared scatter is not used at all"
        )
    elif count is not None and not np.all(count >= 1.0):
        yield Sentence(True, "n is missing at some readings, so std is taken as that of each mean")


def _remedy(record: TumbleRecord) -> str:
    if record.count is None:
        return "if it is that of single samples, give their number in a column n"
    return "check the columns std and n: they may hold more than the scatter of the samples"
