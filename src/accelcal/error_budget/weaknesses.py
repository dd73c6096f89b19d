"""What a reader of an error budget must know before using it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.at_temperature import means_of_runs
from accelcal.effects.left_in_use import beyond_in_use, left_in_use, static_in_use
from accelcal.effects.static import how_taken_up
from accelcal.error_budget.coefficients import Coefficients
from accelcal.error_budget.conditions import Conditions
from accelcal.error_budget.random_part import FEW_LAUNCHES, NOT_IDENTIFIED, RandomPart
from accelcal.results.calibration import Calibration
from accelcal.results.tables_in_use import tables_in_use
from accelcal.results.usable import gates_that_warn, not_determined

_CALIBRATED_WITHIN = 1.001  # a tumble test reaches 1 local g
_RANDOM_NAMES = {
    "launch": "bias from launch to launch (k0L)",
    "drift": "drift (k0D)",
    "fluctuation": "fluctuation (k0F)",
    "hysteresis": "hysteresis (h_T)",
    "threshold": "threshold (p)",
    "scale_factor": "scale factor instability (k1)",
}


def weaknesses(
    calibration: Calibration,
    coefficients: Coefficients,
    random: RandomPart,
    points: Conditions,
    expanded: Array,
    *,
    exact: bool,
) -> Iterator[str]:
    """Say where a budget is extrapolated, incomplete or of first order.

    Parameters
    ----------
    calibration : Calibration
        What was calibrated.
    coefficients : Coefficients
        Its coefficients.
    random : RandomPart
        The bounds.
    points : Conditions
        The points.
    expanded : ndarray, shape (n,)
        Expanded uncertainty [local g].
    exact : bool
        Whether the scale factor was taken beyond the first order of (4).
    """
    yield from gates_that_warn(calibration, calibration.tables)
    yield from beyond_in_use(calibration, calibration.tables, by_laws=True)
    yield from how_taken_up(calibration)
    taken_up = [item.id for item in static_in_use(calibration)]
    yield from left_in_use(calibration, taken_up)
    if points.extrapolated.any():
        yield "temperatures marked * lie outside the calibrated ones; (4) is extrapolated there"
    largest = float(np.abs(points.acceleration).max())
    if largest > _CALIBRATED_WITHIN:
        yield (
            f"accelerations up to {largest:g} g: a tumble test calibrates within 1 g, and (4) is"
            " extrapolated beyond"
        )
    missing = [name for key, name in _RANDOM_NAMES.items() if not getattr(random, key).origin]
    if missing:
        yield f"these random errors are not declared, and taken as 0: {', '.join(missing)}"
    yield from random.warnings
    yield from _drift(random)
    used = tables_in_use(calibration)
    groups = (used.of_main, used.of_second) if used.by_laws else [[t] for t in used.nearest]
    yield from not_determined([group for group in groups if group])
    yield from _several_runs(calibration)
    unknown = [n for n, q in coefficients.at_T0.items() if q.standard_uncertainty is None]
    if unknown:
        yield f"the uncertainty of {', '.join(unknown)} is unknown and left out"
    if not exact:
        yield from _first_order(coefficients, points, expanded)


def _several_runs(calibration: Calibration) -> Iterator[str]:
    """Say whose coefficients they are, where several runs have no laws."""
    for mean in means_of_runs(calibration):
        yield (
            f"no temperature law, so the coefficients of mounting {mean.first.mounting} are the"
            f" mean of {mean.runs}"
        )


def _drift(random: RandomPart) -> Iterator[str]:
    if random.drift.origin == NOT_IDENTIFIED:
        yield (
            "the stability test does not tell the drift (k0D) from none: it counts by the limit of"
            " its interval; a longer test, or more launches, make that smaller"
        )
    if random.drift.origin == FEW_LAUNCHES:
        yield (
            "the drift (k0D) is that of one or two launches, and is taken as alike in all: three"
            " launches or more tell how far they differ"
        )


def _first_order(coefficients: Coefficients, points: Conditions, expanded: Array) -> Iterator[str]:
    change = coefficients.slope("K1", points.rise, "value") * points.rise
    left_out = (change / (1.0 + change) - change) * points.acceleration.input
    worst = int(np.abs(left_out).argmax())
    if abs(left_out[worst]) > expanded[worst]:
        yield (
            "(4) has beta dT, the first order of (K1 - K1N)/K1 in (2), and leaves out"
            f" {1e6 * left_out[worst]:+.0f} ug at a_i = {points.acceleration.input[worst]:g} g,"
            f" dT = {points.rise[worst]:+g} degC; ask for the exact form"
        )
