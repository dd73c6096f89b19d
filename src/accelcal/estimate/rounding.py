"""Rounding of the readings to the step of the voltmeter: what strokes average out and what not.

Noise of a step or more makes the rounding error of a reading new in each stroke, and the scatter
of the strokes holds it. Noise much smaller than the step leaves the strokes at a position alike;
then their scatter tells too little, and the same rounding error stays in all of them.

References
----------
B. Widrow, I. Kollar, Quantization Noise, Cambridge 2008, chapter 5: the characteristic function of
a rounded value, from which the mean rounding error under normal noise follows as a Fourier series.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array

_WHOLE = 1.0 / 12.0  # variance of a rounding error, in steps
_NOISES = np.linspace(0.0, 1.5, 301)  # in steps; beyond, replicates share no rounding error


class Rounding(NamedTuple):
    """Standard deviations of the rounding error that the reading noise does not hold.

    Attributes
    ----------
    common : ndarray
        Part that is the same in all readings at one position [output unit].
    own : ndarray
        Part that is new in each reading [output unit].
    """

    common: Array
    own: Array


def rounding(noise: ArrayLike, step: ArrayLike, *, seen: ArrayLike) -> Rounding:
    """Split the rounding error of a reading.

    Parameters
    ----------
    noise : array_like
        Standard deviation of a reading; NaN where unknown [output unit].
    step : array_like
        Step of the readings, 0 for none [output unit].
    seen : array_like of bool
        Whether `noise` is the scatter of rounded readings, and not that before the rounding. The
        residuals of one stroke count as such: where they come out small beside the step, they are
        no more to be trusted than the scatter of strokes.

    Returns
    -------
    Rounding
        Both parts, in the common shape of the arguments.

    Notes
    -----
    The mean of many readings of one value x is off by a function of x of period one step. Under
    normal noise s, in steps, its mean square over all x is

        common^2 = sum_k exp(-4 pi^2 k^2 s^2) / (2 pi^2 k^2),

    from 1/12 without noise to 4e-6 at s = 0.5. All of rounding and noise is s^2 + 1/12, so strokes
    scatter by s^2 + 1/12 - common^2, and this tells s from their scatter.

    Examples
    --------
    >>> float(rounding(0.0, 1.0, seen=True).common ** 2 * 12)
    1.0
    >>> round(float(rounding(1.0, 1.0, seen=False).own ** 2 * 12), 9)
    1.0
    """
    size, given = np.asarray(step, dtype=np.float64), np.asarray(noise, dtype=np.float64)
    given = np.where(np.isnan(given), 0.0, given) / np.where(size > 0.0, size, 1.0)
    common = _common_variance()
    scatter = np.sqrt(_NOISES**2 + _WHOLE - common)
    shared = np.where(seen, np.interp(given, scatter, common), np.interp(given, _NOISES, common))
    own = np.where(seen, 0.0, np.sqrt(np.maximum(_WHOLE - shared, 0.0)))
    return Rounding(size * np.sqrt(shared), size * own)


@cache
def _common_variance() -> Array:
    """Variance of the mean rounding error at `_NOISES`."""
    k = np.arange(1.0, 200.0)[:, None]
    series = np.exp(-((2.0 * np.pi * k * _NOISES) ** 2)) / (2.0 * (np.pi * k) ** 2)
    # these terms are enough but at noise 0, where the sum of the whole series is known
    common = np.where(_NOISES > 0.0, series.sum(axis=0), _WHOLE)
    common[-1] = 0.0  # in place of 1e-40
    return common
