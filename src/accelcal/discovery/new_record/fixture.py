"""What the fixture angles of two tests do to their difference.

The angle of a test is in each of its readings, and in each misalignment that it measured on one
side only: that of `+` is delta - delta0, that of `-` is delta + delta0.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.coefficients import Compensation
from accelcal.compensate.of_table import cross_name
from accelcal.discovery.new_record.simulated import ERRORS
from accelcal.model import CROSS_AXES
from accelcal.record import TumbleRecord
from accelcal.results.calibration import Calibration

_MISALIGNMENTS = ERRORS.index("delta"), ERRORS.index("other delta")
_ANGLES = ERRORS.index("delta0"), ERRORS.index("other delta0")
_COLUMNS = [cross_name(name) for name in CROSS_AXES]


def is_freed(calibration: Calibration, axis: str) -> bool:
    """Whether both sides of an axis tell its misalignment without the fixture angle."""
    return axis in {cross_name(told.axis) for told in calibration.fixture_angle}


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
    """Fixture angles of a record and of its calibration.

    Attributes
    ----------
    calibration : Calibration
        The calibration.
    found : Compensation
        What it gives.
    size : float or None
        Standard uncertainty of each angle [rad]; None where it is not known.
    """

    calibration: Calibration
    found: Compensation
    size: float | None

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
