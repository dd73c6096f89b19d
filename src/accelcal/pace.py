"""How quickly readings follow one another: the quickest ones have times in another unit than s."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.units import DAY

QUICKEST = 0.1
"""Mean time from reading to reading that no head is quick enough for [s]."""

_DATES = 20_000.0, 80_000.0
"""Days from 1899-12-30 to 1954 and to 2119, as spreadsheets count dates."""

_LONGEST = 0.002
"""Days between samples, nearly three minutes, above which times of the day in s are as likely."""

_SHORTEST = 1e-5
"""Days between samples, nearly a second, below which times in s would be of 100 kHz."""

_WHOLE = 0.02
"""Seconds beside whole ones that the mean interval of samples may have."""


def too_quick(time: Array) -> str:
    """Say that times are in another unit than s, such as the days of a spreadsheet.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the readings of a record [s].

    Returns
    -------
    str
        The times, and that no head is so quick; empty where the readings follow each other by
        `QUICKEST` or more on the mean, or all have one time.

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
    """Tell whether the times of samples are dates as a spreadsheet counts them.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times in their order, of two or more samples.

    Returns
    -------
    bool
        True where they are of this age and whole seconds apart, if they are taken as days.

    Examples
    --------
    >>> import numpy as np
    >>> days = 45000.0 + np.arange(100) * 5.0 / 86400.0
    >>> is_in_days(days), is_in_days(86400.0 * days), is_in_days(45000.0 + np.arange(100) / 1000.0)
    (True, False, False)
    """
    earliest, latest = _DATES
    step = float(time[-1] - time[0]) / (time.size - 1)
    if not (earliest <= time[0] and time[-1] <= latest and 0.0 < step < _LONGEST):
        return False
    seconds = step * DAY
    return step < _SHORTEST or abs(seconds - round(seconds)) < _WHOLE
