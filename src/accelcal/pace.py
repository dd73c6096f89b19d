"""How quickly readings follow one another: the quickest ones have times in another unit than s."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array

QUICKEST = 0.1
"""Mean time from reading to reading that no head is quick enough for [s]."""

LATEST = 1e11
"""Times beyond it are in another unit than s: that of the clocks of computers counts to 2e9 [s]."""

_DATES = 20_000.0, 80_000.0
"""Days from 1899-12-30 to 1954 and to 2119, as spreadsheets count dates."""

_LONGEST = 31.0
"""Days, or seconds, of a launch: a test of stability takes longer than so many seconds."""


def too_quick(time: Array) -> str:
    """Say that times, shape (n,), are in another unit than s, such as days of a spreadsheet.

    It tells the times, and that no head is so quick; it is empty where the readings follow each
    other by `QUICKEST` or more on the mean, or all have one time.

    Examples
    --------
    >>> import numpy as np
    >>> too_quick(np.arange(54) / 1440.0), too_quick(60.0 * np.arange(54))
    ('54 readings in 0.0368 s, and no head turns so quickly', '')
    """
    span = float(np.ptp(time))
    if not 0.0 < span < QUICKEST * (time.size - 1):
        return ""
    return f"{time.size} readings in {span:.3g} s, and no head turns so quickly"


def is_in_days(time: Array) -> bool:
    """Tell whether the times of one or more samples are dates as a spreadsheet counts them.

    They are so where they lie in our days, and would be of less than a minute in seconds.

    Examples
    --------
    >>> import numpy as np
    >>> days = 45000.0 + np.arange(100) * 5.0 / 86400.0
    >>> is_in_days(days), is_in_days(86400.0 * days), is_in_days(45000.0 + np.arange(100))
    (True, False, False)
    """
    earliest, latest = _DATES
    first, last = float(time.min()), float(time.max())
    return earliest <= first and last <= latest and last - first < _LONGEST
