"""Standard uncertainty of averaged readings from the columns `std` and `n`.

A standard deviation of few samples scatters itself. Weights by it would favour the readings whose
samples happen to agree, and promise more than they give. So the deviations of a table are compared
with each other, and each is drawn to the others by what chance alone makes of it; those at one
position count as one, as far as they scatter by chance.

The deviation of the samples within a reading tells how well their mean is known, if nothing else
changes from stroke to stroke. Where strokes scatter more, something does. If that is the same in
all readings, as the fit of the head is, the ratios of the declared deviations say nothing of the
readings any more, and weights by them would promise too much. If the samples are correlated, the
scatter is a multiple of the declared one, and the ratios stand. The replicates tell.

References
----------
R. DerSimonian, R. Kacker, "Random-effects model for meta-analysis of clinical trials: an update",
Contemp. Clin. Trials 28 (2007) 105.

G. K. Smyth, "Linear models and empirical Bayes methods for assessing differential expression in
microarray experiments", Stat. Appl. Genet. Mol. Biol. 3 (2004) 3, sections 3 and 6.2.

H. D. Patterson, R. Thompson, "Recovery of inter-block information when block sizes are unequal",
Biometrika 58 (1971) 545: the residual likelihood.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Ints, Places
from accelcal.estimate.trend import FEW, Scatter, directed, pure_error
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import Grouped, grouped
from accelcal.numerics.probability import f_exceeds
from accelcal.record import TumbleRecord

_FEWEST = 3.0
"""Degrees of freedom that a variance counts for at least: it has no mean with two or fewer."""

_ALMOST_ALIKE = 0.04
"""Variance of log sigma^2 up to which deviations count by their samples: sigma within 10 %."""

_SURE = 3.0
"""Standard deviations of chance beyond which readings at one position differ in their noise."""


class DeclaredScatter(NamedTuple):
    """What a table of n readings declares of their scatter."""

    size: Array  # standard uncertainties, ones where not all are declared [output unit], shape (n,)
    dof: float | None  # of all together; None where not declared
    doubt: Array  # variance of the logarithm of its square, beside what all share, shape (n,)


def declared_scatter(record: TumbleRecord) -> DeclaredScatter:
    """Standard uncertainty of each averaged reading of a table, where it declares them all.

    Notes
    -----
    Without the numbers of samples, `std` is the standard uncertainty of the reading itself. Where
    the strokes scatter more, and alike, the sizes are drawn together, see `with_even_scatter`.
    """
    found = _of_samples(record)
    if found.dof is None or np.ptp(found.size) == 0.0:
        return found
    head = head_positions(record.angle)
    size = with_even_scatter(found.size, found.dof, record.output, head, record.stroke)
    return found._replace(size=size)


def is_weighted(record: TumbleRecord) -> bool:
    """Whether declared scatters differ, so that readings have a say in their weights."""
    return record.std is not None and bool(
        np.ptp(record.std) > 0.0 or (record.count is not None and np.ptp(record.count) > 0.0)
    )


def moderated(squares: Array, dof: Array) -> tuple[Array, Array]:
    """Moderate n variances with their degrees of freedom, each by what the others tell of it.

    They are drawn to each other, and one for all where they scatter by no more than chance; with
    them come the variances of their logarithms, beside what all share.

    Notes
    -----
    With true variances d0 s0^2 / chi^2(d0) the inverse of one is expected at
    (d0 + dof) / (d0 s0^2 + dof s^2), which is the best weight, and itself at d / (d - 2) times the
    inverse of that, d = d0 + dof (Smyth 2004).

    Examples
    --------
    >>> [part.tolist() for part in moderated(np.array([1.0, 2.0]), np.array([3.0, 3.0]))]
    [[1.5, 1.5], [0.0, 0.0]]
    """
    if squares.size < 2:
        return squares, np.zeros_like(squares)
    logs, chance = np.log(squares) + _bias_of_log(dof), _variance_of_log(dof)
    told = _beyond_chance(logs, chance)
    if told == 0.0:  # they scatter by no more than chance
        return np.full_like(squares, squares @ dof / dof.sum()), np.zeros_like(squares)
    prior = (1.0 + np.sqrt(1.0 + 2.0 * told)) / told  # by the first two terms of the variance
    middle = np.exp(np.average(logs, weights=1.0 / (told + chance)) - _bias_of_log(prior))
    best = (prior * middle + dof * squares) / (prior + dof)
    counted = np.maximum(prior + dof, _FEWEST)
    return best * counted / (counted - 2.0), 2.0 / (prior + dof)


def _of_samples(record: TumbleRecord) -> DeclaredScatter:
    """What the samples of each reading tell."""
    sure = np.zeros(len(record))
    if record.std is None or not np.all(record.std > 0):
        return DeclaredScatter(np.ones(len(record)), None, sure)
    if record.count is None or not np.all(record.count >= 1):
        return DeclaredScatter(record.std.copy(), np.inf, sure)
    dof, squares, doubt = record.count - 1.0, record.std**2, sure
    some = dof > 0.0  # one sample has no deviation: what is declared of it stands
    if not some.any():
        return DeclaredScatter(np.sqrt(squares / record.count), np.inf, sure)
    if np.ptp(squares[some]) > 0.0:
        place = grouped(head_positions(record.angle[some])).cell
        squares[some], doubt[some] = _compared(squares[some], dof[some], place)
    return DeclaredScatter(np.sqrt(squares / record.count), float(dof.sum()), doubt)


def _compared(squares: Array, dof: Array, place: Places) -> tuple[Array, Array]:
    """Variances of samples, moderated; one for all readings at a position, if chance allows it.

    Noise that follows the angle is alike at one position. Each reading by itself would be drawn to
    the middle of all positions, and promise too much where the noise is large.
    """
    logs, chance = np.log(squares) + _bias_of_log(dof), _variance_of_log(dof)
    excess, expected = _excess(logs, chance, place)
    repeats = place.size - 1 - int(place.max())
    if excess > _SURE * expected * (2.0 / max(repeats, 1)) ** 0.5:
        return moderated(squares, dof)
    whole = np.asarray(np.bincount(place, dof), dtype=np.float64)
    found, doubt = moderated(np.bincount(place, dof * squares) / whole, whole)
    return found[place], doubt[place]


def _beyond_chance(values: Array, chance: Array) -> float:
    """Variance of values beyond those of chance, 0 at least (DerSimonian and Kacker 2007)."""
    weight = 1.0 / (_ALMOST_ALIKE + chance)
    excess, _ = _excess(values, chance, np.zeros(values.size, dtype=np.intp))
    return max(excess, 0.0) / float((weight * (1.0 - weight / weight.sum())).sum())


def _excess(values: Array, chance: Array, group: Places) -> tuple[float, float]:
    """Weighted squares of values about the means of their groups, beyond those of chance."""
    weight = 1.0 / (_ALMOST_ALIKE + chance)
    whole = np.bincount(group, weight)
    away = values - (np.bincount(group, weight * values) / whole)[group]
    expected = float(weight * (1.0 - weight / whole[group]) @ chance)
    return float(weight @ away**2) - expected, expected


def _variance_of_log(dof: Array) -> Array:
    """Variance of log chi^2, the trigamma function of half of it (DLMF 5.15.8), to 8 %."""
    return 2.0 / dof + 2.0 / dof**2 + 4.0 / (3.0 * dof**3)


def _bias_of_log(dof: ArrayLike) -> Array:
    """By how much the mean of log(chi^2 / dof) is below 0 (DLMF 5.11.2), from 1 on to 5 %."""
    inverse = 1.0 / np.asarray(dof)
    return np.asarray(np.minimum(inverse + inverse**2 / 3.0, 2.0 * inverse))


# -- what the strokes say of it --------------------------------------------------------------------


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
    """Draw the declared scatters of n readings together as far as the strokes scatter alike.

    Scatters and readings are in output units; the former have degrees of freedom together, the head
    positions [deg] and strokes are those of the readings. The mean square stays. It is the same
    array where replicates do not contradict the declared ones, at 1 %, or are too few.

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
