"""What coefficients that a calibration does not determine may be."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.coefficients import PARAMETERS, Compensation
from accelcal.discovery.new_record.simulated import ERRORS
from accelcal.results.calibration import Calibration
from accelcal.results.tables_in_use import tables_in_use


def of_undetermined(calibration: Calibration, found: Compensation) -> Array:
    """What each coefficient that is not determined does to `ERRORS`, shape (18, k).

    Those that are determined stand for what they took up of it at the angles of the calibration:
    beside a K3 that is taken as 0, K1 is K1 + K3 in steps of 90 deg.
    """
    symbols = (*found.symbols, *(found.other.symbols if found.other else ()))
    lost = [place for place, symbol in enumerate(symbols) if symbol in found.undetermined]
    acting = np.eye(len(ERRORS))[:, lost]
    angle = np.deg2rad(tables_in_use(calibration, found.T0_degC).main.residuals.angle_deg)
    a_i, a_p = np.cos(angle), np.sin(angle)
    columns = np.stack([np.ones_like(a_i), a_i, a_i**2, a_i**3, a_p, a_i * a_p], axis=1)
    told = [place for place in range(len(PARAMETERS)) if place not in lost]
    of_main = columns @ acting[: len(PARAMETERS)]
    acting[told] -= np.linalg.pinv(columns[:, told]) @ of_main
    return acting
