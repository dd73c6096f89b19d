"""What a head error shows in the means of many positions: sums over contrasts not worked out.

Were all contrasts worked out, as `accelcal.estimate.head.LackOfFit` does it, time and memory would
grow with the third and the second power of the number of positions. But each mean depends on the
error of its own position alone. So in the covariance V = 1 + t D D' of the means, where D says how
the errors act on them and t is the variance of an error over that of the noise, positions are
independent, and only the p coefficients of the model Q bring them together: every sum over the
contrasts follows from a matrix p by p,

    K(t) = Q' V^-1 Q = C + sum v v' / (1 + t D'D),   v = Q' D / |D| at each position,

where C is of what of the model no head error shows. K of the model beside the means has their
squares over their variances in its last pivot, and its determinant, with that of V, is that of the
variances of the contrasts (restricted likelihood).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.contrasts import LEAST_SHOWN, LEAST_STRENGTH

# Here no contrast is worked out, so none of those below `LEAST_SHOWN` can be left out. Instead the
# noise is taken to be at least as large as the head error shows in them, and `against` takes off
# what they hold.


class ManyPositions(NamedTuple):
    """Lack of fit at many positions, in R records.

    Attributes
    ----------
    positions : ndarray, shape (J,)
        Head positions of all tables [deg].
    contrasts : int
        Number of independent contrasts, those without any head error among them.
    acting : ndarray, shape (..., J)
        Sum over the tables of the squares of how the error of a position acts on its mean, in units
        of the reading noise [1/rad^2].
    shown : ndarray, shape (..., J, P + 1)
        Model and, last, means of the tables in the direction in which the error acts on them.
    unseen : ndarray, shape (..., P + 1, P + 1)
        Sums of products of what is left of them.
    """

    positions: Array
    contrasts: int
    acting: Array
    shown: Array
    unseen: Array

    @classmethod
    def of(
        cls,
        positions: Array,
        contrasts: int,
        models: Sequence[Array],
        acting: Sequence[Array],
        means: Sequence[Array],
    ) -> ManyPositions:
        """Bring tables together.

        Parameters
        ----------
        positions : ndarray, shape (J,)
            Head positions of all tables [deg].
        contrasts : int
            Positions less coefficients, of all tables.
        models : sequence of ndarray, shape (J, p)
            Orthonormal columns of the model of the means of each table, zero where it has none.
        acting : sequence of ndarray, shape (R, J)
            How the error of a position acts on its mean [1/rad].
        means : sequence of ndarray, shape (R, J)
            The means over their uncertainty.
        """
        whole = np.sum(np.square(acting), axis=0)
        size = np.sqrt(np.where(whole > 0.0, whole, np.inf))
        shares = [(d / size)[..., None] for d in acting]
        columns = zip(shares, _side_by_side(models, means), strict=True)
        shown = np.asarray(sum(share * own for share, own in columns))
        columns = zip(shares, _side_by_side(models, means), strict=True)
        left = (own - share * shown for share, own in columns)
        unseen = sum(x.mT @ x for x in left)
        return cls(positions, contrasts, whole, shown, np.asarray(unseen))

    @property
    def number(self) -> Places:
        """Number of contrasts, shape (...)."""
        return np.full(self.acting.shape[:-1], self.contrasts)

    @property
    def strongest(self) -> Array:
        """How much a head error shows where it shows most, shape (...) [1/rad]."""
        return np.asarray(np.sqrt(self.acting.max(axis=-1)))

    def largest(self) -> Array:
        """Size of the largest error that a position seems to have, shape (...) [rad]."""
        size = np.sqrt(np.where(self._tells(), self.acting, np.inf))
        return np.asarray((np.abs(self.shown[..., -1]) / size).max(axis=-1))

    def telling(self) -> tuple[ManyPositions, Array]:
        """Return what tells of the head and its degrees of freedom at the least, shape (...).

        So many contrasts hardly feel the few that tell of the noise only: they remain.
        """
        number = self._tells().sum(axis=-1) - (self.unseen.shape[-1] - 1)
        return self, np.maximum(number, 1.0)

    def _tells(self) -> Mask:
        return np.asarray(self.acting > (LEAST_STRENGTH * self.strongest[..., None]) ** 2)

    def in_units_of(self, noise: Array) -> ManyPositions:
        """Return the same where the reading noise is `noise` times what it was, shape (...)."""
        scale = np.ones(self.unseen.shape[:-1])
        scale[..., -1] /= noise
        return self._replace(
            acting=self.acting / noise[..., None] ** 2,
            shown=self.shown * scale[..., None, :],
            unseen=self.unseen * scale[..., None, :] * scale[..., None],
        )

    def of_records(self, records: int | slice) -> ManyPositions:
        """Return that of some records of a stack, or of one alone."""
        own = {name: getattr(self, name)[records] for name in ("acting", "shown", "unseen")}
        return self._replace(**own)

    def deviance(self, noise: Array, head: Array) -> tuple[Array, Array]:
        """The same as `accelcal.estimate.contrasts.LackOfFit.deviance`."""
        found = [self._deviance(*both) for both in _each(noise, head)]
        spread, squares = (np.stack(values, axis=-1) for values in zip(*found, strict=True))
        return spread, squares

    def _deviance(self, noise: Array, head: Array) -> tuple[Array, Array]:
        ratio, noise = self._ratio(noise, head)
        share, whole = self._whole(ratio)
        model, means, across = whole[..., :-1, :-1], whole[..., -1, -1], whole[..., :-1, -1]
        taken = (across * np.linalg.solve(model, across[..., None])[..., 0]).sum(axis=-1)
        spread = np.linalg.slogdet(model)[1] - np.log(share).sum(axis=-1)
        return spread + self.contrasts * np.log(noise), np.maximum(means - taken, 0.0) / noise

    def _ratio(self, noise: Array, head: Array) -> tuple[Array, Array]:
        """Variance of the head over that of the noise, and the latter [rad^2]."""
        noise = np.maximum(noise, head * (LEAST_SHOWN * self.strongest) ** 2)
        return head / noise, noise

    def _whole(self, ratio: Array) -> tuple[Array, Array]:
        """1 / (1 + t D'D), shape (..., J), and K of the model beside the means."""
        share = 1.0 / (1.0 + ratio[..., None] * self.acting)
        return share, self.unseen + _products(self.shown, share)

    def information(self, noise: Array, head: Array) -> Array:
        """Sum over the contrasts of (noise / variance)^2, shape (..., m), see `deviance`."""
        return np.stack([self._information(*both) for both in _each(noise, head)], axis=-1)

    def _information(self, noise: Array, head: Array) -> Array:
        ratio, _ = self._ratio(noise, head)
        slope, bend = self._slope(ratio)
        # The sum of x^2 with x = 1 / (1 + t s^2), as s^2 / (1 + t s^2) is (1 - x) / t and its
        # derivative by t is -(1 - x)^2 / t^2.
        return np.asarray(self.contrasts - 2.0 * ratio * slope - ratio**2 * bend)

    def _slope(self, ratio: Array) -> tuple[Array, Array]:
        """Sum of s^2 / (1 + t s^2) over the contrasts of strength s, and its derivative by t."""
        share, whole = self._whole(ratio)
        one, two = share * self.acting, (share * self.acting) ** 2
        model, columns = whole[..., :-1, :-1], self.shown[..., :-1]
        first, second = (np.linalg.solve(model, _products(columns, share * x)) for x in (one, two))
        squared = np.einsum("...pq,...qp->...", first, first)
        bend = -two.sum(axis=-1) - squared + 2.0 * np.linalg.trace(second)
        return one.sum(axis=-1) - np.linalg.trace(first), bend

    def against(self, head: Array) -> tuple[Array, Array]:
        """Number of contrasts that show the head, and their squares over their variances, (...)."""
        one = np.ones_like(head)
        # a head variance so large that all contrasts but the hidden ones are nothing beside it
        far = (LEAST_SHOWN * self.strongest) ** -2.0
        squares, hidden = (self._deviance(one, variance)[1] for variance in (head**2, far))
        return np.round(far * self._slope(far)[0]), np.maximum(squares - hidden, 0.0)

    def seen(self, uncertainty: Array) -> SeenAtMany:
        """Return the errors as far as they are seen, where one has this uncertainty [rad]."""
        ratio, _ = self._ratio(np.ones_like(uncertainty), uncertainty**2)
        share, whole = self._whole(ratio)
        model, across = whole[..., :-1, :-1], whole[..., :-1, -1]
        inverse = np.asarray(np.linalg.inv(model))
        left = self.shown[..., -1] - _times(self.shown[..., :-1], _times(inverse, across))
        acting = share * np.sqrt(self.acting)
        columns = np.sqrt(ratio)[..., None, None] * acting[..., None] * self.shown[..., :-1]
        values = ratio[..., None] * acting * left
        return SeenAtMany(values, ratio, share, columns, inverse)


class SeenAtMany(NamedTuple):
    """Errors of many positions as far as the lack of fit shows them, in R records.

    Attributes
    ----------
    values : ndarray, shape (..., J)
        The errors [rad].
    ratio : ndarray, shape (...)
        Variance of one that was taken, over that of the noise [rad^2].
    share, columns, inverse : ndarray, shape (..., J), (..., J, P), (..., P, P)
        What of true errors is missed is share * errors + columns @ inverse @ columns.T @ errors.
    """

    values: Array
    ratio: Array
    share: Array
    columns: Array
    inverse: Array

    def noise(self, influence: Array) -> Array:
        """The same as `accelcal.estimate.contrasts.SeenErrors.noise`."""
        left = self._left(influence)
        return np.asarray(self.ratio[..., None, None] * ((influence - left) @ left.mT))

    def missed(self, influence: Array, uncertainty: Array) -> Array:
        """Covariance by what of the errors is missed, of `uncertainty`, shape (...) [rad]."""
        left = self._left(influence)
        return np.asarray(uncertainty[..., None, None] ** 2 * (left @ left.mT))

    def _left(self, influence: Array) -> Array:
        """What is missed of the errors does to the quantities, shape (..., k, J)."""
        through = influence @ self.columns @ self.inverse @ self.columns.mT
        return np.asarray(influence * self.share[..., None, :] + through)


def _side_by_side(models: Sequence[Array], means: Sequence[Array]) -> Iterator[Array]:
    """Columns of the models of all tables, zero in the other tables, and the means."""
    widths = [model.shape[1] for model in models]
    ends = np.cumsum(widths)
    for model, mean, end in zip(models, means, ends.tolist(), strict=True):
        whole = np.zeros((*mean.shape, sum(widths) + 1))
        whole[..., end - model.shape[1] : end] = model
        whole[..., -1] = mean
        yield whole


def _each(noise: Array, head: Array) -> Iterator[tuple[Array, Array]]:
    """Pairs of values along the last axis."""
    both = np.broadcast_arrays(noise, head)
    return zip(*(np.moveaxis(values, -1, 0) for values in both), strict=True)


def _products(columns: Array, weight: Array) -> Array:
    return np.asarray((columns * weight[..., None]).mT @ columns)


def _times(matrix: NDArray[Any], vector: NDArray[Any]) -> Array:
    return np.asarray((matrix @ vector[..., None])[..., 0])
