"""What a calibration says that its uncertainties do not count, for who uses its numbers alone."""

from __future__ import annotations

from collections.abc import Sequence

from accelcal.results.calibration import Calibration
from accelcal.results.table import TableCalibration

LESS_CERTAIN = "less certain than U says"
LEFT_OUT = "the intervals leave it out"
EXTRAPOLATED = "U holds nothing of a curvature"
FEWER = "may hold the truth in fewer than 95 of 100 cases"

NOT_COUNTED = "U does not count"
NO_SHIFT = "includes no shift from launch to launch"
NO_HEAT = "U of the laws includes no error of the temperature"
NOT_IN_U = "is not in U of the coefficients"

_TOO_SMALL = (LESS_CERTAIN, LEFT_OUT, EXTRAPOLATED, FEWER)
OF_USE = (NOT_COUNTED, NO_SHIFT, NO_HEAT, NOT_IN_U)
"""By these words the sentences are known, in results from files too."""


def beyond_uncertainty(
    calibration: Calibration,
    tables: Sequence[TableCalibration],
    *,
    by_laws: bool,
    also: Sequence[str] = (),
) -> list[str]:
    """List the sentences of a calibration by which its uncertainties are too small.

    The tables are those of it that are used; `also` are words of further sentences, of `OF_USE`,
    which name what those who use the numbers for an acceleration mostly count themselves.

    Examples
    --------
    >>> import accelcal
    >>> plan = accelcal.TumblePlan(positions=6, temperatures=(20.0,))
    >>> record = accelcal.simulate(plan=plan, seed=1).with_apparatus(head_uncertainty=None)
    >>> calibration = accelcal.fit(record)
    >>> beyond_uncertainty(calibration, calibration.tables, by_laws=False)
    ['head error neither declared nor visible at these angles: the intervals leave it out; declare\
 head_uncertainty']
    """
    said = [*calibration.warnings, *(text for table in tables for text in table.warnings)]
    if by_laws:
        models = calibration.temperature_model, calibration.second_axis_model
        said += [text for model in models if model for text in model.warnings]
    return [
        text for text in dict.fromkeys(said) if any(words in text for words in (*_TOO_SMALL, *also))
    ]
