"""Contrasts of the position means, what each says of the head, and the grid that searches it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.arrays import Array, Places

# Three looks, each finer and nearer to the lowest point, evaluate half as much as two (16 and 1).
_STRIDES = (64, 8, 1)


class Grid(NamedTuple):
    """Points exp(start + i * step), i from 0 to points - 1, for each of many functions."""

    start: ArrayLike  # logarithm of the first point, shape (..., 1)
    step: ArrayLike  # of the ratio of the points, shape (..., 1)
    points: ArrayLike  # how many, shape (..., 1)

    def at(self, place: Places) -> Array:
        """Return the points at some places, shape (..., m); the last one beyond the end."""
        inside = np.minimum(np.maximum(place, 0), np.asarray(self.points) - 1)
        return np.asarray(np.exp(self.start + inside * np.asarray(self.step)))

    def least(self, function: Callable[[Array], Array]) -> tuple[Array, Array]:
        """Find the lowest point of each function and its value there, both of shape (..., 1).

        The function takes points, shape (..., m), and gives its values there. Its valleys are wider
        than 64 points: each 64th is looked at, then each eighth about the lowest of them, then
        each.

        Examples
        --------
        >>> grid = Grid(np.zeros((2, 1)), np.full((2, 1), 0.01), np.full((2, 1), 500))
        >>> middle = np.array([[2.0], [30.0]])
        >>> grid.least(lambda x: np.log(x / middle) ** 2)[0].round(1).ravel().tolist()
        [2.0, 30.0]
        """
        places = np.arange(0, int(np.max(self.points)) + _STRIDES[0] - 1, _STRIDES[0])
        for wide, step in pairwise(_STRIDES):
            lowest = _lowest(places, function(self.at(places)))
            places = lowest + np.arange(-wide, wide + 1, step)
        points = self.at(places)
        values = function(points)
        return _lowest(points, values), _lowest(values, values)


def _lowest(points: NDArray[Any], values: Array) -> NDArray[Any]:
    """Of the points of each function, the one with the least value, shape (..., 1)."""
    best = np.argmin(values, axis=-1)[..., None]
    return np.take_along_axis(np.broadcast_to(points, values.shape), best, axis=-1)


# Where the size of the head error is estimated, contrasts are left out in which it acts with less
# than this share of its action on the contrast that shows it best: they tell of the noise only.
LEAST_STRENGTH = 0.05

# Some contrasts between tables rest on small differences of their coefficients, such as noise and
# rounding make. Those in which the head shows less than this share of its action are left out.
LEAST_SHOWN = 1e-4


class LackOfFit(NamedTuple):
    """What the means of the positions say against the model, in units of the reading noise.

    All arrays but `positions` begin with an axis of the records where they are of a stack. A
    contrast that tells nothing has the strength 0.

    Attributes
    ----------
    positions : ndarray, shape (J,)
        Head positions of all tables [deg].
    contrasts : ndarray, shape (..., q)
        Independent contrasts, each of variance 1 + (u * strength)^2 under a head error u.
    strengths : ndarray, shape (..., q)
        How much a head error of 1 rad shows in each contrast [1/rad].
    directions : ndarray, shape (..., J, q)
        Pattern over the head positions that each contrast sees.
    """

    positions: Array
    contrasts: Array
    strengths: Array
    directions: Array

    @property
    def number(self) -> Places:
        """Number of contrasts, shape (...)."""
        return np.asarray((self.strengths > 0.0).sum(axis=-1))

    @property
    def strongest(self) -> Array:
        """How much a head error shows where it shows most, shape (...) [1/rad]."""
        return np.asarray(self.strengths.max(axis=-1, initial=0.0))

    def largest(self) -> Array:
        """Size of the largest error that a contrast seems to show, shape (...) [rad]."""
        strength = np.where(self.strengths > 0.0, self.strengths, np.inf)
        return np.asarray((np.abs(self.contrasts) / strength).max(axis=-1))

    def telling(self) -> tuple[LackOfFit, Places]:
        """Return what tells of the head and its degrees of freedom, shape (...)."""
        telling = self.strengths > LEAST_STRENGTH * self.strongest[..., None]
        strengths, contrasts = (np.where(telling, x, 0.0) for x in (self.strengths, self.contrasts))
        found = self._replace(strengths=strengths, contrasts=contrasts)
        return found, found.number

    def deviance(self, noise: Array, head: Array) -> tuple[Array, Array]:
        """Sums over the contrasts of log(variance) and of contrast^2 / variance.

        The variances are noise + head * strength^2, of noise and head position [rad^2], shape (...,
        m).
        """
        variance = self._variances(noise, head)
        nothing = (self.strengths.shape[-1] - self.number)[..., None] * np.log(noise)
        squares = (self.contrasts[..., None] ** 2 / variance).sum(axis=-2)
        return np.log(variance).sum(axis=-2) - nothing, squares

    def information(self, noise: Array, head: Array) -> Array:
        """Sum over the contrasts of (noise / variance)^2, shape (..., m), see `deviance`."""
        share = noise[..., None, :] / self._variances(noise, head)
        shown = self.strengths[..., None] > 0.0
        return np.asarray(np.where(shown, share**2, 0.0).sum(axis=-2))

    def _variances(self, noise: Array, head: Array) -> Array:
        return np.asarray(noise[..., None, :] + self.strengths[..., None] ** 2 * head[..., None, :])

    def against(self, head: Array) -> tuple[Places, Array]:
        """Number of contrasts that show the head, and their squares over their variances, (...)."""
        allowed = 1.0 + (head[..., None] * self.strengths) ** 2
        return self.number, (self.contrasts**2 / allowed).sum(axis=-1)

    def seen(self, uncertainty: Array) -> SeenErrors:
        """Return the errors as far as they are seen, where one has this uncertainty [rad]."""
        size = uncertainty[..., None]
        gain = size**2 * self.strengths / (1.0 + (size * self.strengths) ** 2)
        from_noise = self.directions * gain[..., None, :]
        back = self.directions.mT
        unseen = np.eye(self.positions.size) - (from_noise * self.strengths[..., None, :]) @ back
        values = (self.directions @ (gain * self.contrasts)[..., None])[..., 0]
        return SeenErrors(values, unseen, from_noise)

    def in_units_of(self, noise: Array) -> LackOfFit:
        """Return the same contrasts where the reading noise is `noise` times what it was."""
        size = noise[..., None]
        return self._replace(contrasts=self.contrasts / size, strengths=self.strengths / size)

    def of_records(self, records: int | slice) -> LackOfFit:
        """Return those of some records of a stack, or of one alone."""
        return LackOfFit(self.positions, *(each[records] for each in self[1:]))


class SeenErrors(NamedTuple):
    """Errors of the head as far as the lack of fit shows them, in R records."""

    values: Array  # error of each position [rad], shape (..., J)
    unseen: Array  # leaves of the true errors what is missed, shape (..., J, J)
    from_noise: Array  # from unit contrasts of the noise to errors [rad], shape (..., J, q)

    def noise(self, influence: Array) -> Array:
        """Covariance by the noise in what is seen, of quantities on which it acts, (..., k, J)."""
        return _square(influence @ self.from_noise)

    def missed(self, influence: Array, uncertainty: Array) -> Array:
        """Covariance by what of the errors is missed, of `uncertainty`, shape (...) [rad]."""
        return _square(influence @ (uncertainty[..., None, None] * self.unseen))


def _square(matrix: Array) -> Array:
    """Each matrix times its transpose; of a copy, as numpy is slower with one matrix twice."""
    return np.asarray(matrix @ np.ascontiguousarray(matrix.mT))
