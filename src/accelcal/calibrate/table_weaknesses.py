"""What a reader must know of the readings of a table before using what they give.

A large fixture angle, such as another zero of the head, takes something off K1 unseen. An angle d0
beyond the one taken as given acts as K1 cos(th + d0). A table takes K1 cos(d0) for its scale
factor, and the rest for a misalignment. Both sides of an axis tell that angle; one side leaves it
in M.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.reversal import fixture_angle_stack
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.sizes import LARGEST_RATIOS
from accelcal.geometry import side_of
from accelcal.model import MISALIGNMENT, SCALE_FACTOR
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


# -- a large fixture angle -------------------------------------------------------------------------


_LOST = 5e-6
"""Part of K1 that a fixture angle may take off without a word."""


def of_large_turn(
    tables: Sequence[PreparedTable], estimate: JointEstimate, delta0: float
) -> Sentence:
    """Say what a large fixture angle takes off K1, where that is more than some ppm."""
    beyond = fixture_angle_stack(tables, estimate)
    return _of_one_side(tables, estimate, delta0) if beyond is None else _told(beyond, delta0)


def _told(beyond: Array, delta0: float) -> Sentence:
    lost = beyond**2 / 2.0
    return Sentence(
        lost > _LOST,
        lambda beyond, lost: (
            f"both sides tell a fixture angle delta0 of {delta0 + beyond:.6f} rad, and the tables"
            f" take it as {delta0:g} rad: in the mean of both sides K1 is {1e6 * lost:.0f} ppm too"
            " small, and others are off too; fit again with that delta0"
        ),
        [beyond, lost],
    )


def _of_one_side(
    tables: Sequence[PreparedTable], estimate: JointEstimate, delta0: float
) -> Sentence:
    coefficients = np.stack(estimate.coefficients, axis=-1)
    tilt, k1 = coefficients[..., MISALIGNMENT, :], coefficients[..., SCALE_FACTOR, :]
    ratios = tilt / k1
    at = np.abs(ratios).argmax(axis=-1)
    largest = np.take_along_axis(ratios, at[..., None], axis=-1)[..., 0]
    turn = np.array([side_of(table.mounting) for table in tables])[at] * largest
    lost = largest**2 / 2.0
    where = [f" in table {n} of {len(tables)}" for n, _ in enumerate(tables, 1)]
    where = where if len(tables) > 1 else [""]
    return Sentence(
        (lost > _LOST) & (np.abs(largest) < LARGEST_RATIOS["M"]),
        lambda at, largest, turn, lost: (
            f"delta is {1e3 * largest:.3g} mrad{where[at]}: if all of it is the fixture angle or"
            f" the zero of the head, K1 is {1e6 * lost:.0f} ppm too small, and delta0 is"
            f" {delta0 - turn:.3g} rad"
        ),
        [at, largest, turn, lost],
    )
