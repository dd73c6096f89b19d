"""What the fixture angles and the head of two tests do to their difference.

The angle of a test is in each of its readings, and in each misalignment that it measured on one
side only: that of `+` is delta - delta0, that of `-` is delta + delta0.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arrays import Array
from accelcal.compensate.coefficients import Compensation
from accelcal.compensate.of_table import cross_name
from accelcal.discovery.new_record.calibration_errors import CalibrationErrors
from accelcal.discovery.new_record.simulated import ERRORS, Simulated, is_freed
from accelcal.discovery.noise.of_readings import ReadingNoise
from accelcal.estimate.same_head import is_same_head
from accelcal.head_angles import head_positions
from accelcal.model import CROSS_AXES
from accelcal.numerics.grouping import distinct
from accelcal.record import TumbleRecord
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import ErrorSource

_MISALIGNMENTS = ERRORS.index("delta"), ERRORS.index("other delta")
_ANGLES = ERRORS.index("delta0"), ERRORS.index("other delta0")
_COLUMNS = [cross_name(name) for name in CROSS_AXES]


def by_fixture(calibration: Calibration, found: Compensation, size: float) -> Array:
    """What a fixture angle of a size [rad] in each cross axis does to `ERRORS`, shape (18, 2)."""
    acting = np.zeros((len(ERRORS), len(_COLUMNS)))
    mountings = [table.mounting for table in calibration.tables]
    for row, axis in zip(_MISALIGNMENTS, found.axes, strict=False):
        if not is_freed(calibration, axis.name):
            own = next(m for m in mountings if cross_name(m) == axis.name)
            sign = -1.0 if own.endswith("+") else 1.0
            acting[row, _COLUMNS.index(axis.name)] = sign * size
    return acting


def said_of_fixture(size: float) -> str:
    """Say that the fixture angles count."""
    return (
        "the fixture angle of each test counts with a standard uncertainty of"
        f" {1e6 * size:.3g} urad"
    )


class Fixtures(NamedTuple):
    """Fixture angles of a record and of its calibration."""

    calibration: Calibration
    found: Compensation  # what it gives
    size: float | None  # standard uncertainty of each angle [rad]; None where it is not known

    def difference(self, by_error: Array, *, same: bool) -> Array:
        """What the angles do to n readings of derivatives `by_error`, shape (n, 18).

        There is a column for each independent angle, shape (n, 2) or (n, 4) [g]: both tests have
        the `same` ones where they were clamped alike.
        """
        size = self.size or 0.0
        calibrated = by_fixture(self.calibration, self.found, size)
        record = np.zeros_like(calibrated)
        for row, axis in zip(_ANGLES, self.found.axes, strict=False):
            column = _COLUMNS.index(axis.name)
            record[row, column] = size
            if is_freed(self.calibration, axis.name):  # it is known apart
                calibrated[row, column] = size
        of_record, of_calibration = by_error @ record, by_error @ calibrated
        return of_record - of_calibration if same else np.hstack([of_record, of_calibration])

    def notes(self, record: TumbleRecord) -> Iterator[str]:
        """Say what the side of the mounting leaves open, a sentence each."""
        if self.size is not None:
            yield said_of_fixture(self.size)
            return
        sides = {table.mounting for table in self.calibration.tables}
        for mounting in sorted({str(side) for side in record.mounting} - sides):
            if not is_freed(self.calibration, cross_name(mounting)):
                yield (
                    f"mounting {mounting} is the other side of what was calibrated: twice the"
                    " fixture angle counts as a change of the misalignment; calibrate on both"
                    " sides, or give its standard uncertainty by fixture_uncertainty=..."
                )


class Seen(NamedTuple):
    """A record beside what its calibration simulates, with all that is uncertain in both."""

    record: TumbleRecord
    simulated: Simulated
    noise: ReadingNoise
    dof: float  # degrees of freedom of the noise
    declared: Apparatus  # errors that count
    known: dict[str, ErrorSource]  # those of them that the calibration knew, by their names
    errors: CalibrationErrors
    step: float  # step of the readings [g]
    paused: Array  # what effects may do in pauses that no times tell, (n, k) [g]
    fixtures: Fixtures


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
