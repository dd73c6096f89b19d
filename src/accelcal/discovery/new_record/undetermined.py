"""What coefficients and slopes that a calibration does not determine may be."""

from __future__ import annotations

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arrays import Array
from accelcal.compensate.coefficients import PARAMETERS, SLOPES, Compensation
from accelcal.discovery.columns import dummies
from accelcal.discovery.new_record.calibration_errors import CalibrationErrors
from accelcal.discovery.new_record.errors_counted import heat_of
from accelcal.discovery.new_record.same_clamping import Fixtures
from accelcal.discovery.new_record.simulated import ERRORS, Simulated
from accelcal.geometry import accelerations
from accelcal.model import design_matrix
from accelcal.recalibrations.comparable import ALIKE, BIAS_PER_DEGREE, SCALE_FACTOR_PER_DEGREE
from accelcal.results.calibration import Calibration
from accelcal.results.tables_in_use import tables_in_use

_USUAL = dict(zip(SLOPES, 2 * (BIAS_PER_DEGREE, SCALE_FACTOR_PER_DEGREE, 0.0), strict=True))
"""Standard uncertainty of slopes that nothing tells."""


def with_usual_slopes(errors: CalibrationErrors, found: Compensation) -> CalibrationErrors:
    """The same errors; of a calibration of one level, which tells no slopes, with usual ones."""
    if found.several_levels:
        return errors
    sizes = np.array([_USUAL.get(name, 0.0) for name in ERRORS])
    return errors._replace(
        rest=errors.rest + np.diag(sizes**2), dof=np.where(sizes > 0.0, np.inf, errors.dof)
    )


def by_usual_heat(fixtures: Fixtures, simulated: Simulated, declared: Apparatus) -> Array:
    """What errors of temperatures do beside a calibration of one level, by usual slopes.

    There is one of all readings of the calibration, and one of each run of the record, where
    declared; shape (n, k) [g].
    """
    runs = dummies(simulated.conditions.run)
    if fixtures.found.several_levels:
        return np.empty((len(runs), 0))
    of_calibration, own = _heat(fixtures, declared)
    slopes = BIAS_PER_DEGREE, SCALE_FACTOR_PER_DEGREE
    acting = simulated.by_error[:, [ERRORS.index(name) for name in ("k0", "K1")]] * slopes
    by_run = (acting[:, :, None] * runs[:, None, :]).reshape(len(runs), -1)
    return np.hstack([of_calibration * acting, own * by_run])


def _heat(fixtures: Fixtures, declared: Apparatus) -> tuple[float, float]:
    return heat_of(fixtures.calibration) or 0.0, declared.temperature_uncertainty or 0.0


def said_of_usual_slopes(
    fixtures: Fixtures, simulated: Simulated, declared: Apparatus
) -> list[str]:
    """Say that a record is beside the one level of its calibration, or may be."""
    away, heat = float(np.abs(simulated.conditions.excess).max()), max(_heat(fixtures, declared))
    if fixtures.found.several_levels or max(away, heat) <= ALIKE:
        return []
    told = (
        f"readings are up to {away:.2g} degC off the calibration, which tells"
        if away > ALIKE
        else f"temperatures have errors of {heat:.2g} degC, and the calibration tells"
    )
    return [
        f"{told} no slopes: U counts what usual ones make of it, {1e6 * BIAS_PER_DEGREE:g} ug/degC"
        f" and {1e6 * SCALE_FACTOR_PER_DEGREE:g} ppm/degC"
    ]


def undetermined(found: Compensation) -> list[int]:
    """Places among `ERRORS` of what a calibration does not determine."""
    symbols = (*found.symbols, *(found.other.symbols if found.other else ()))
    return [place for place, symbol in enumerate(symbols) if symbol in found.undetermined]


def of_undetermined(calibration: Calibration, found: Compensation) -> Array:
    """What each coefficient that is not determined does to `ERRORS`, shape (18, k).

    Those that are determined stand for what they took up of it at the angles of the calibration:
    beside a K3 that is taken as 0, K1 is K1 + K3 in steps of 90 deg.
    """
    lost = undetermined(found)
    acting = np.eye(len(ERRORS))[:, lost]
    angle = tables_in_use(calibration, found.T0_degC).main.residuals.angle_deg
    columns = design_matrix(accelerations(angle))
    told = [place for place in range(len(PARAMETERS)) if place not in lost]
    of_main = columns @ acting[: len(PARAMETERS)]
    acting[told] -= np.linalg.pinv(columns[:, told]) @ of_main
    return acting
