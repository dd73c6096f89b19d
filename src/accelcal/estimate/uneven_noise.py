"""Reading noise that differs by position, as that of temperatures which nobody recorded.

One noise for all readings then makes some intervals too short and others too wide. The scatter at
each position tells its own, if there are strokes enough, in the table or in all of them together.
Where it does not, positions with the same size of a_i tell it together: errors of the angle act as
sin th, those of scale factor and temperature as cos th, and neither knows the sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Mask
from accelcal.estimate.noise import ReadingNoise, is_noise
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.trend import FEW
from accelcal.estimate.uncertainty import welch_satterthwaite
from accelcal.model import SCALE_FACTOR
from accelcal.numerics.grouping import distinct
from accelcal.numerics.probability import f_exceeds

_SIGNIFICANT = 0.01
_SIGNIFICANT_TOGETHER = 0.05
"""Of positions taken together: their variances are sure enough to be used by a weaker test."""

_FEW_TOGETHER = 2
"""Degrees of freedom below which even positions with the same size of a_i say too little."""


class UnevenNoise(NamedTuple):
    """Scatter of the readings of a table at each of its J positions, in R records.

    Attributes
    ----------
    differs : ndarray of bool, shape (R,)
        Whether the positions differ by more than chance.
    clearly : ndarray of bool, shape (R,)
        Whether they do so at 1 %.
    variance : ndarray, shape (R, J)
        Variance of a reading.
    dof : ndarray, shape (J,), or (R, J) where the records have gaps of their own
        Its degrees of freedom.
    of_size : ndarray, shape (R,)
        Those of the noise of the table, where other tables tell how it differs by position;
        infinite where the table alone tells.
    mirrored : ndarray of bool, shape (R,)
        Whether positions with the same size of a_i told their variance together.
    mirrors : ndarray, shape (J, C)
        1 where a position has one of the C sizes of a_i, else 0.
    """

    differs: Mask
    clearly: Mask
    variance: Array
    dof: Array
    of_size: Array
    mirrored: Mask
    mirrors: Array

    def of_records(self, records: int | slice) -> UnevenNoise:
        """Return that of some records of a stack, or of one alone."""
        by_record = ("differs", "clearly", "variance", "of_size", "mirrored")
        return self._replace(**{name: getattr(self, name)[records] for name in by_record})

    def noise(self, influence: Array) -> tuple[Array, Array]:
        """What the noise of D records that differ does to coefficients, (D, p, p), and its dof.

        The influence is the covariance that noise of variance 1 at one position gives, shape (J, p,
        p), or (R, J, p, p) where that is of each record. The degrees of freedom, shape (D, p), are
        after Welch and Satterthwaite.
        """
        own, every = self.variance[self.differs], np.broadcast_to(self.dof, self.variance.shape)
        influence = influence if influence.ndim == 3 else influence[self.differs]
        parts = own[:, :, None] * np.diagonal(influence, axis1=-2, axis2=-1)
        shared, dof = self.mirrored[self.differs], np.empty(parts.shape[::2])
        together, free = np.einsum("djp,jc->cdp", parts[shared], self.mirrors), every[self.differs]
        dof[shared] = welch_satterthwaite(together, (free[shared] @ self.mirrors).T)
        dof[~shared] = welch_satterthwaite(parts[~shared].swapaxes(0, 1), free[~shared].T)
        inverse = 1.0 / dof + 1.0 / self.of_size[self.differs, None]
        return (own[:, :, None, None] * influence).sum(axis=1), 1.0 / inverse


class _Scatter(NamedTuple):
    """Scatter of the readings of a table about the means of its J positions, in R records.

    Attributes
    ----------
    kind : tuple
        What must be equal in two tables for their scatter to differ alike by position.
    squares : ndarray, shape (R, J)
        Sums of squares, in units of the noise of the table.
    dof : ndarray, shape (J,) or (R, J)
        Their degrees of freedom; 0 where the scatter is declared.
    is_noise : ndarray of bool, shape (R,)
        Whether it is more than rounding makes.
    """

    kind: tuple[object, ...]
    squares: Array
    dof: Array
    is_noise: Mask

    @classmethod
    def of(cls, table: PreparedTable, output: Array, noise: ReadingNoise, step: Array) -> _Scatter:
        at = table.at_head
        kind = table.scatter_dof is None, table.mounting, at.key.tobytes()
        more = is_noise(noise.factor, step, output)
        if table.scatter_dof is not None:
            return cls(kind, np.zeros((len(output), at.key.size)), np.zeros(at.key.size), more)
        there = np.isfinite(table.scatter) * 1.0
        members = at.sums(there[..., None])[..., 0]
        means = at.weighted_sums(output, there) / members
        size = np.where(noise.factor > 0.0, noise.factor, 1.0)
        apart = (output.T - means.T[at.cell]) / size
        return cls(kind, at.weighted_sums((apart**2).T, there), members - 1.0, more)

    @property
    def tells(self) -> Mask:
        """Where it shows noise that differs by position, shape () or (R,)."""
        return self.is_enough(FEW)

    def is_enough(self, few: int) -> Mask:
        """Where there are several variances, each with so many degrees of freedom, () or (R,)."""
        return np.asarray((self.dof.min(axis=-1) >= few) & (self.dof.shape[-1] > 1))

    def or_else(self, other: _Scatter) -> _Scatter:
        """Take another one where this tells too little."""
        tells = self.tells
        squares, dof = (
            np.where(tells[..., None], a, b) for a, b in zip(self[1:3], other[1:3], strict=True)
        )
        return _Scatter(self.kind, squares, dof, np.where(tells, self.is_noise, other.is_noise))

    def together(self, mirrors: Array) -> _Scatter:
        """Add up that of positions with the same size of a_i."""
        return self._replace(squares=self.squares @ mirrors, dof=self.dof @ mirrors)

    def variances(self, size: Array) -> Array:
        """Variances of a reading, with the noise of the table."""
        return size[:, None] ** 2 * self.squares / np.where(self.dof > 0.0, self.dof, 1.0)

    def differs(self, enough: int, *levels: float) -> Mask:
        """Tell which records scatter by more than chance at each level, shape (levels, R)."""
        known = self.is_enough(enough)
        if not known.any():
            return np.zeros((len(levels), len(self.squares)), dtype=np.bool_)
        dof = np.maximum(self.dof, 1.0)
        return known & differ((self.squares / dof).T, dof.T, np.reshape(levels, (-1, 1)))


def uneven_noises(
    tables: Sequence[PreparedTable],
    outputs: Sequence[Array],
    noises: Sequence[ReadingNoise],
    steps: Sequence[Array],
) -> list[UnevenNoise]:
    """Tell of each table whether the readings scatter alike at all positions.

    The readings are of shape (R, n), with steps of shape (R,) [output unit], and have a noise in
    common in each table. It never differs with declared scatter. A table with fewer than four
    readings at any position takes the scatter of all tables of its mounting and positions together.
    Where no position differs, those with the same size of a_i are taken together.
    """
    own = list(map(_Scatter.of, tables, outputs, noises, steps))
    told = own if all(scatter.tells.all() for scatter in own) else _with_others(own)
    return list(map(_uneven, tables, told, own, outputs, noises))


def _with_others(scatters: Sequence[_Scatter]) -> list[_Scatter]:
    """Those that tell enough, and for the others that of all tables of their kind together."""
    kinds: dict[tuple[object, ...], list[_Scatter]] = {}
    for own in scatters:
        kinds.setdefault(own.kind, []).append(own)
    together = {
        kind: _Scatter(
            kind,
            np.sum([s.squares for s in own], axis=0),
            np.sum([s.dof for s in own], axis=0),
            np.all([s.is_noise for s in own], axis=0),
        )
        for kind, own in kinds.items()
    }
    return [
        own if len(kinds[own.kind]) == 1 else own.or_else(together[own.kind]) for own in scatters
    ]


def _uneven(
    table: PreparedTable, told: _Scatter, own: _Scatter, output: Array, noise: ReadingNoise
) -> UnevenNoise:
    mirrors, size = _mirrors(table), noise.factor
    together = told.together(mirrors)
    (told_apart,) = told.differs(FEW, _SIGNIFICANT)
    likely, clearly = together.differs(_FEW_TOGETHER, _SIGNIFICANT_TOGETHER, _SIGNIFICANT)
    of_sizes = together.variances(size) @ mirrors.T
    variance = np.where(told_apart[:, None], told.variances(size), of_sizes)
    least = np.sqrt(variance.min(axis=1))  # that of the arithmetic, where readings are rounded
    tells = told.is_noise & is_noise(least, np.zeros_like(least), output)
    return UnevenNoise(
        differs=tells & (told_apart | likely),
        clearly=tells & (told_apart | clearly),
        variance=variance,
        dof=told.dof,
        of_size=np.where((told is own) | own.tells, np.inf, noise.dof),
        mirrored=~told_apart,
        mirrors=mirrors,
    )


def _mirrors(table: PreparedTable) -> Array:
    """Which positions have the same size of a_i: a column each, shape (J, C)."""
    size = np.zeros(table.at_head.key.size)
    size[table.at_head.cell] = np.abs(table.design[:, SCALE_FACTOR])
    return np.asarray(np.equal.outer(np.round(size, 2), distinct(np.round(size, 2))), dtype=float)


def differ(variance: Array, dof: ArrayLike, level: ArrayLike) -> Mask:
    """Tell where k variances, shape (k, R), differ by more than chance, by Bartlett's test [1]_.

    The degrees of freedom are of shape (k,) or (k, R); with levels of shape (L, 1), probabilities
    that equal ones pass for different, the answer is of shape (L, R).

    References
    ----------
    .. [1] M. S. Bartlett, "Properties of sufficiency and statistical tests", Proc. R. Soc. A 160
       (1937) 268-282.

    Examples
    --------
    >>> differ(np.array([[1.0, 1.0], [1.1, 9.0]]), [10.0, 10.0], 0.01).tolist()
    [False, True]
    """
    freedom = np.reshape(dof, (len(variance), -1))
    whole, others = freedom.sum(axis=0), len(variance) - 1.0
    pooled = (freedom * variance).sum(axis=0) / whole
    share = np.divide(variance, pooled, out=np.ones_like(variance), where=pooled > 0.0)
    squares = -(freedom * np.log(np.maximum(share, np.finfo(float).tiny))).sum(axis=0)
    squares /= 1.0 + ((1.0 / freedom).sum(axis=0) - 1.0 / whole) / (3.0 * others)
    return f_exceeds(level, squares / others, others, np.inf)
