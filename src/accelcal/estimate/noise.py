"""Reading noise: the part of the errors that is new in each reading.

Readings are rounded to the step of the voltmeter, which strokes average out or not. Noise of a step
or more makes the rounding error of a reading new in each stroke, and the scatter of the strokes
holds it. Noise much smaller than the step leaves the strokes at a position alike; then their
scatter tells too little, and the same rounding error stays in all of them.

References
----------
B. Widrow, I. Kollar, Quantization Noise, Cambridge 2008, chapter 5: the characteristic function of
a rounded value, from which the mean rounding error under normal noise follows as a Fourier series.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import compress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.trend import FEW, Scatter, pure_error
from accelcal.numerics.probability import f_exceeds

LEAST_NOISE = 1e-9
"""Noise below which replicates are alike: they tell nothing of what readings scatter by [g]."""

ALIKE = (
    "replicates are alike to the last digit, so that nothing tells the noise of the readings;"
    " read more digits, or simulate some noise"
)
"""What is said where nothing can be found without a noise."""

_SIGNIFICANT = 0.01

_OF_STEP = 0.5
"""Noise in steps below which a scatter follows the places of the readings between two steps."""

_ROUNDED = 1e-10
"""Noise, as a share of the readings, below which it may be that of the arithmetic."""

_TOO_WIDE = 2.0
"""Declared scatter over that of replicates from which the intervals are told to be too wide."""


class ReadingNoise(NamedTuple):
    """Standard deviation of one reading of a table, in one record or in each of a stack.

    All have an axis of the records where they are of a stack.

    Attributes
    ----------
    factor : float or ndarray
        Standard deviation of a reading over the declared scatter of the table, or the standard
        deviation itself where none is declared [output unit]; NaN where nothing tells it.
    dof : float or ndarray
        Degrees of freedom.
    source : str or ndarray of str
        ``"replicates"``, ``"replicates of all tables"``, ``"declared"``, ``"residuals"``
        or ``"none"``.
    excess : float or ndarray
        Ratio of the scatter of replicates to the declared one, where it is significantly above 1,
        else NaN.
    shortfall : float or ndarray
        Ratio of the declared scatter to that of replicates, where it is 2 or more and so by more
        than chance, else NaN.
    """

    factor: Any
    dof: Any
    source: Any
    excess: Any = np.nan
    shortfall: Any = np.nan

    @classmethod
    def of(cls, factor: Array, dof: Any, source: str) -> ReadingNoise:
        """Noise that is known in the same way in all records."""
        like = np.zeros_like(factor)
        untold = like + np.nan
        return cls(factor, like + dof, np.full(factor.shape, source), untold, untold)

    def of_records(self, records: int | slice | Places) -> ReadingNoise:
        """Return that of some records of a stack, or of one alone."""
        return ReadingNoise(*(part[records] for part in self))

    def rounding(self, table: PreparedTable, step: ArrayLike) -> Rounding:
        """Rounding errors of the readings of a table that this noise does not hold."""
        seen = self.source != "declared"
        return rounding(self.factor * table.scatter.min(), step, seen=seen)

    def with_rounding(self, table: PreparedTable, step: ArrayLike) -> ReadingNoise:
        """Noise that gives the means of the positions all of their errors but those of the head.

        Residuals hold their rounding errors already.
        """
        common, own = self.rounding(table, step)
        readings = table.readings / table.at_head.key.size
        more = np.hypot(own, common * readings**0.5) / table.scatter.min()
        untold = self.source != "residuals"
        return self._replace(factor=np.hypot(self.factor, untold * more))


def is_noise(size: Array, step: Array, output: Array) -> Mask:
    """Tell where a standard deviation, shape (R,), is more than rounding makes.

    The readings, shape (R, n), have steps [output unit].
    """
    return np.asarray(size > np.maximum(_OF_STEP * step, _ROUNDED * np.abs(output).max(axis=1)))


def noise_of_stack(tables: Sequence[PreparedTable], outputs: Sequence[Array]) -> list[ReadingNoise]:
    """Estimate the reading noise of each table from what its replicates allow.

    The tables are of any of R records, their readings of shape (R, n), pseudo-values where the fit
    is robust [output unit].

    Notes
    -----
    Pure error is the scatter of the readings at one head position of one table about their mean.
    A table with fewer than three degrees of freedom of it borrows from the others that declare no
    scatter; without any, the residuals of their fits are taken, which then contain the head errors
    as well.
    """
    pairs = zip(tables, outputs, strict=True)
    pure = [pure_error(y, table.scatter, table.at_head) for table, y in pairs]
    bare = [table.scatter_dof is None for table in tables]
    of_all = _of_all_tables(
        list(compress(tables, bare)), list(compress(outputs, bare)), list(compress(pure, bare))
    )
    return [
        _declared(own, table.scatter_dof, _last_digit(y) / table.scatter.min())
        if table.scatter_dof is not None
        else _of_readings(y, *((own, "replicates") if np.all(own.dof >= FEW) else of_all))
        for table, y, own in zip(tables, outputs, pure, strict=True)
    ]


def _of_all_tables(
    tables: Sequence[PreparedTable], outputs: Sequence[Array], pure: Sequence[Scatter]
) -> tuple[Scatter, str]:
    """What a table with too few replicates takes: the scatter of all, else that of residuals."""
    pooled = Scatter.pooled(pure)
    if np.all(pooled.dof >= FEW):
        return pooled, "replicates of all tables"
    residual = Scatter.pooled(map(_residual_scatter, tables, outputs))
    return residual, "residuals" if residual.dof >= 1 else "none"


def _of_readings(y: Array, scatter: Scatter, source: str) -> ReadingNoise:
    if source == "none":
        return ReadingNoise.of(np.full(len(y), np.nan), 0.0, "none")
    noise = np.maximum(np.sqrt(scatter.variance), _last_digit(y))
    return ReadingNoise.of(noise, scatter.dof, source)


def _last_digit(y: Array) -> Array:
    """Rounding error that readings still have which are all alike to the last digit."""
    return np.asarray(4.0 * np.finfo(float).eps * np.abs(y).max(axis=1))


def _declared(own: Scatter, declared_dof: float, last_digit: Array) -> ReadingNoise:
    """Declared scatter, unless the replicates contradict it."""
    found = ReadingNoise.of(np.ones_like(own.squares), declared_dof, "declared")
    if own.dof < FEW:
        return found
    excess = f_exceeds(_SIGNIFICANT, own.variance, own.dof, declared_dof)
    factor = np.sqrt(own.variance)
    return ReadingNoise(
        np.where(excess, factor, found.factor),
        np.where(excess, own.dof, found.dof),
        np.where(excess, "replicates", found.source),
        np.where(excess, factor, np.nan),
        _shortfall(own, declared_dof, last_digit),
    )


def _shortfall(own: Scatter, declared_dof: float, last_digit: Array) -> Array:
    """Declared scatter over that of replicates, where it is clearly larger.

    Replicates that are alike to the last digit tell nothing of the noise.
    """
    tells = own.variance > last_digit**2
    ratio = 1.0 / np.where(tells, own.variance, 1.0)
    clear = f_exceeds(_SIGNIFICANT, ratio, declared_dof, own.dof) & (ratio >= _TOO_WIDE**2)
    return np.where(tells & clear, np.sqrt(ratio), np.nan)


def _residual_scatter(table: PreparedTable, y: Array) -> Scatter:
    squares = table.least_squares.fit(y).squares
    return Scatter(squares, float(y.shape[1] - len(table.estimability.kept)))


# -- rounding --------------------------------------------------------------------------------------


_WHOLE = 1.0 / 12.0  # variance of a rounding error, in steps
_NOISES = np.linspace(0.0, 1.5, 301)  # in steps; beyond, replicates share no rounding error


class Rounding(NamedTuple):
    """Standard deviations of rounding errors that the reading noise does not hold [output unit]."""

    common: Array  # part that is the same in all readings at one position
    own: Array  # part that is new in each reading


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
