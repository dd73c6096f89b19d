"""Scatter of the strokes beyond the declared one, alike in all readings or in proportion to it.

The deviation of the samples within a reading tells how well their mean is known, if nothing else
changes from stroke to stroke. Where strokes scatter more, something does. If that is the same in
all readings, as the fit of the head is, the ratios of the declared deviations say nothing of the
readings any more, and weights by them would promise too much. If the samples are correlated, the
scatter is a multiple of the declared one, and the ratios stand. The replicates tell.

References
----------
H. D. Patterson, R. Thompson, "Recovery of inter-block information when block sizes are unequal",
Biometrika 58 (1971) 545: the residual likelihood.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints
from accelcal.estimate.pure_error import FEW, Scatter, pure_error
from accelcal.estimate.trend import directed
from accelcal.numerics.grouping import Grouped, grouped
from accelcal.numerics.probability import f_exceeds

_SIGNIFICANT = 0.01

_SHARES = np.linspace(0.0, 1.0, 21)
"""Shares of the variance that all readings may have alike."""

_LEAST_FREE = 1e-9
"""Share of a reading that its mean leaves free; below it, nothing contradicts the reading."""


class _Replicates(NamedTuple):
    """Readings of a table with the declared scatter of each, and the cells of replicates."""

    size: Array
    output: Array
    cells: Grouped

    def own(self) -> Scatter:
        """Scatter about the means of the cells, in units of the declared one."""
        return pure_error(self.output[None], self.size, self.cells)

    def but_the_worst(self) -> _Replicates:
        """All but the reading that the others contradict most: an outlier is no scatter."""
        weight, cell = self.size**-2.0, self.cells.cell
        whole = np.bincount(cell, weight)
        away = self.output - (np.bincount(cell, weight * self.output) / whole)[cell]
        free = np.maximum(1.0 - weight / whole[cell], _LEAST_FREE)
        against = away**2 * weight / free
        kept = np.arange(against.size) != against.argmax()
        return _Replicates(self.size[kept], self.output[kept], grouped(cell[kept]))

    def share(self) -> float:
        """Mean share of what is alike, by the residual likelihood."""
        declared = self.size**2 / np.mean(self.size**2)
        variance = np.outer(declared, 1.0 - _SHARES) + _SHARES
        weight = 1.0 / variance
        whole = self.cells.sums(weight)
        means = self.cells.sums(self.output[:, None] * weight) / whole
        squares = np.sum(weight * (self.output[:, None] - means[self.cells.cell]) ** 2, axis=0)
        dof = self.size.size - self.cells.key.size
        logs = np.log(variance).sum(axis=0) + np.log(whole).sum(axis=0) + dof * np.log(squares)
        likelihood = np.exp(-0.5 * (logs - logs.min()))
        return float(likelihood @ _SHARES / likelihood.sum())


def with_even_scatter(size: Array, dof: float, output: Array, head: Array, stroke: Ints) -> Array:
    """Draw declared scatters together as far as the strokes scatter alike.

    Parameters
    ----------
    size : ndarray, shape (n,)
        Declared standard uncertainty of each reading of a table [output unit].
    dof : float
        Their degrees of freedom.
    output : ndarray, shape (n,)
        The readings [output unit].
    head : ndarray, shape (n,)
        Head position of each [deg].
    stroke : ndarray of int, shape (n,)
        Its stroke.

    Returns
    -------
    ndarray, shape (n,)
        Scatters with the mean square of those declared. The same array where replicates do not
        contradict these, at 1 %, or are too few.

    Notes
    -----
    Variances are (1 - w) of the declared one and w of its mean, up to a factor. The mean of w is
    taken over its likelihood in the deviations of replicates from their mean: with few of them
    the likeliest w is often 0 or 1 by chance. Replicates are those of one direction, if there are
    such, as backlash is no scatter, and all but the worst.

    Examples
    --------
    >>> size, head = np.array([1.0, 9.0] * 8), np.array([0.0, 90.0] * 8)
    >>> stroke = np.repeat(np.arange(8) + 1, 2)
    >>> uneven = size * np.repeat([1.0, -1.0, -1.0, 1.0], 4)
    >>> with_even_scatter(size, 99.0, uneven, head, stroke) is size
    True
    >>> with_even_scatter(size, 99.0, 40.0 * uneven / size, head, stroke).round(1)[:2].tolist()
    [5.5, 7.2]
    """
    for key in (directed(head, stroke), head):
        told = _Replicates(size, output, grouped(key)).but_the_worst()
        own = told.own()
        if own.dof >= FEW:
            break
    if own.dof < FEW or not f_exceeds(_SIGNIFICANT, own.variance, own.dof, dof).all():
        return size
    share = told.share()
    return np.asarray(np.sqrt((1.0 - share) * size**2 + share * np.mean(size**2)))
