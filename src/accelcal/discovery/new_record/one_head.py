"""Whether a calibration and a record have one head in common, and what its errors do to both."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.new_record.calibration_errors import CalibrationErrors
from accelcal.discovery.new_record.simulated import Simulated
from accelcal.estimate.same_head import is_same_head
from accelcal.head_angles import head_positions
from accelcal.numerics.sorting import distinct
from accelcal.record import TumbleRecord
from accelcal.results.calibration import Calibration


def is_one_head(
    calibration: Calibration, record: TumbleRecord, errors: CalibrationErrors, told: bool | None
) -> bool | None:
    """Tell whether both were measured on one head, see `accelcal.estimate.same_head.is_same_head`.

    None where nothing tells it, or where it would not help: the fixture of the record is clamped at
    another angle than 0, or nothing tells at which positions the calibration was measured.
    """
    metadata = calibration.provenance.get("metadata", {})
    one_file = is_same_file(calibration, record)
    same = is_same_head(metadata, record.metadata, told, one_file=one_file)
    is_turned = record.clamping is not None and bool(np.any(np.mod(record.clamping, 360.0)))
    return None if same and (is_turned or not errors.positions.size) else same


def is_same_file(calibration: Calibration, record: TumbleRecord) -> bool:
    """Tell whether the calibration was fitted to these very readings."""
    return bool(record.sha256) and record.sha256 == calibration.provenance.get("sha256")


def is_turned_over(calibration: Calibration, record: TumbleRecord) -> bool:
    """Tell whether an axis stands on the side that the calibration has not.

    There the errors of one head add up, while they cancel on the same side.
    """
    return not set(map(str, distinct(record.mounting))) <= {t.mounting for t in calibration.tables}


def head_difference(errors: CalibrationErrors, simulated: Simulated, record: TumbleRecord) -> Array:
    """What errors of one head do to n readings less what they did to the calibration.

    It is the change of the residual by an error of each of k head positions, shape (n, k) [g/rad].
    """
    at = head_positions(record.graduation)
    positions = distinct(np.concatenate([at, errors.positions]))
    by_head = np.zeros((errors.by_head.shape[0], positions.size))
    by_head[:, np.searchsorted(positions, errors.positions)] = errors.by_head
    acting = np.equal.outer(at, positions) * simulated.per_radian[:, None]
    return np.asarray(acting - simulated.by_error @ by_head)
