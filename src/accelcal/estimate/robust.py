"""Readings made safe against outliers by what their replicates say.

An outlier is a reading that its replicates contradict: the other strokes at the same position of
the same table. Huber's M-estimator is applied there, not to the residuals of the fit, in which
the errors of the head positions hide a bad reading.

References
----------
P. J. Huber, Robust Statistics, Wiley 1981, sections 7.6 and 7.8: with pseudo-values in place of
the readings, ordinary least squares gives the M-estimate and its standard uncertainty.

M. I. Shamos, "Geometry and statistics: problems at the interface", in Algorithms and Complexity,
Academic Press 1976: the scale from the median difference of pairs. A median deviation from the
median would be a third too small for three strokes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Places
from accelcal.errors import DesignError
from accelcal.numerics.grouping import Grouped, grouped

_BEND = 1.345  # 95 % efficiency on normal errors (Huber 1981)
_NORMAL_PAIRS = 1.0483  # of normal errors: sigma over the median |difference| of two of them
_PARTNERS = 32  # pairs of each replicate; all pairs tell the scale hardly better
_ROUNDS = 100  # at most, of the M-estimate of each centre
_SETTLED = 1e-9  # the last step is smaller than this, in standard deviations of a centre
_TELLING = 3  # readings at one position that tell which of them is wrong
_AGREES = 2.5  # standard deviations from the centre within which a reading bears it out


def pseudo_values(output: Array, cell: Array, scatter: ArrayLike = 1.0) -> Array:
    """Replace readings by Huber's pseudo-values about the centre of their replicates.

    The readings are of shape (n,) or (T, n), NaN where there is none, the cells of replicates of
    shape (n,), and the scatter, the standard uncertainty of each reading or anything proportional
    to it, of either. Pseudo-values of clean readings are close to these [output unit].

    Raises
    ------
    DesignError
        If no position has three readings, so that nothing can contradict a reading.

    Notes
    -----
    All positions of a table share one scale, from the differences of all pairs of replicates, or
    where a position has more than 66, of each with 64 of the others. Of two readings at a position
    nothing tells which one is wrong, so an outlier is made harmless only where there are three or
    more; fewer stay as they are, and what they scatter stays in the noise. It stays there too where
    no majority of the readings bears out the centre that they have. Where more than half of all
    these pairs are equal, each position takes its median.

    Examples
    --------
    >>> import numpy as np
    >>> y = np.array([1.0, 1.1, 0.9, 1.0, 50.0])
    >>> bool(abs(pseudo_values(y, np.zeros(5)).mean() - 1.0) < 0.1)
    True
    """
    cells = grouped(cell)
    if cells.members.max() < _TELLING:
        raise DesignError(
            "the robust option compares the strokes at one position, and no position has three"
            " readings; measure more strokes or fit without it"
        )
    y = np.atleast_2d(output)
    weight = np.where(np.isnan(y), 0.0, 1.0 / np.asarray(scatter, dtype=np.float64))
    places = cells.parts
    scale = _scale(y, weight, places)
    unit = weight / np.where(scale > 0.0, scale, np.inf)  # no scale: medians stay
    medians = np.concatenate([_medians(y[:, place]) for place in places], axis=1)
    centre = _settled(np.nan_to_num(y), unit, np.nan_to_num(medians), cells)
    pseudo = _pseudo(y, unit, centre, cells)
    return np.asarray(np.where(np.isnan(y), np.nan, pseudo)).reshape(output.shape)


def _sums(values: Array, cells: Grouped) -> Array:
    """Sum over the readings of each cell, from shape (T, n) to shape (T, cells)."""
    return cells.sums(values.T).T


def _information(unit: Array, cells: Grouped) -> Array:
    """Sum of the weights of each cell, shape (T, cells)."""
    return np.maximum(_sums(unit**2, cells), np.finfo(float).tiny)


def _settled(y: Array, unit: Array, centre: Array, cells: Grouped) -> Array:
    """M-estimate of the centre of each cell, shape (T, cells); what has settled moves no more."""
    information = _information(unit, cells)
    moving = np.arange(len(y))
    for _ in range(_ROUNDS):
        u = unit[moving]
        bent = np.clip(u * (y[moving] - centre[moving][:, cells.cell]), -_BEND, _BEND)
        step = _sums(u * bent, cells) / information[moving]
        centre[moving] += step
        far = np.abs(step) * np.sqrt(information[moving]) >= _SETTLED
        moving = moving[far.any(axis=1)]
        if moving.size == 0:
            break
    return centre


def _pseudo(y: Array, unit: Array, centre: Array, cells: Grouped) -> Array:
    residual = unit * (y - centre[:, cells.cell])
    known = unit > 0.0
    has = _sums(known.astype(np.float64), cells)
    agree = _sums((known & (np.abs(residual) < _AGREES)).astype(np.float64), cells)
    told = (has >= _TELLING) & (agree > 0.5 * has)
    judged = known & told[:, cells.cell]
    readings = np.maximum(judged.sum(axis=1, keepdims=True), 1)
    centres = told.sum(axis=1, keepdims=True)
    straight = (judged & (np.abs(residual) < _BEND)).sum(axis=1, keepdims=True) / readings
    # mean of the derivative of psi, Huber (7.6.10)
    straight = np.maximum(straight, 1.0 / readings)
    straight = straight / (1.0 + centres / readings * (1.0 - straight) / straight)
    bent = np.clip(residual, -_BEND, _BEND) / np.where(known, straight * unit, 1.0)
    # Bending would hide an outlier in the noise where nothing tells which reading it is.
    off = _sums(unit * residual, cells) / _information(unit, cells)
    whole = y - np.where(has < _TELLING, 0.0, off)[:, cells.cell]
    return np.where(known & ~judged, whole, centre[:, cells.cell] + bent)


def _scale(y: Array, weight: Array, places: list[Places]) -> Array:
    """Robust standard deviation of a reading of weight 1, from the differences of replicates."""
    with np.errstate(divide="ignore"):
        variance = weight**-2.0

    def of_pairs(place: Places) -> Array:
        first, second = (place[own] for own in _pairs(place.size))
        spread = np.sqrt(0.5 * (variance[:, first] + variance[:, second]))
        return np.asarray(np.abs(y[:, first] - y[:, second]) / spread)

    every = np.concatenate([of_pairs(place) for place in places], axis=1)
    return np.nan_to_num(_NORMAL_PAIRS * _medians(every))


def _pairs(replicates: int) -> tuple[Places, Places]:
    """All pairs of replicates, or each with `_PARTNERS` others on both sides, near and far."""
    far = (replicates - 1) // 2
    if far <= _PARTNERS:
        return np.triu_indices(replicates, 1)
    steps = np.linspace(1, far, _PARTNERS).astype(np.intp)
    first = np.repeat(np.arange(replicates), steps.size)
    return first, (first + np.tile(steps, replicates)) % replicates


def _medians(values: Array) -> Array:
    """Median of each row without its NaN, shape (T, 1); NaN where there is nothing else."""
    ordered = np.sort(values, axis=1)  # NaN come last
    last = np.maximum((~np.isnan(values)).sum(axis=1, keepdims=True) - 1, 0)
    middle = np.concatenate([last // 2, (last + 1) // 2], axis=1)
    return np.asarray(np.take_along_axis(ordered, middle, axis=1).mean(axis=1, keepdims=True))
