"""How quickly readings can follow one another: quicker ones have times in another unit than s."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array

QUICKEST = 0.1
"""Mean time from reading to reading that no head is quick enough for [s]."""


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
