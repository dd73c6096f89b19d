"""Strokes that are wrong together: fits without one of them, or without those of one direction.

Others that are wrong alike are told by the wave that each of them holds.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.gates.plan import TablePlan, once_a_plan, rank_and_inverse
from accelcal.numerics.grouping import Grouped

_INDEPENDENT = 1e-9  # singular value, over the largest, of a column that the others do not make


class Basis(NamedTuple):
    """A basis of the columns of a design in which their normal matrix is one."""

    columns: Array  # shape (n, r), for r columns of p that are independent
    of_design: Array  # from the columns of the design, shape (p, r)

    @classmethod
    def of(cls, design: Array) -> Basis:
        """Basis of the columns of a design, shape (n, p)."""
        columns, size, rows = np.linalg.svd(design, full_matrices=False)
        told = size > _INDEPENDENT * size[0]  # fewer where angles fall together
        return cls(columns[:, told], rows[told].T / size[told])

    def fit(self, output: Array) -> Fit:
        """Fit readings of shape (n, T)."""
        values = self.columns.T @ output
        residual = output - self.columns @ values
        return Fit(self, values, residual, (residual**2).sum(axis=0))


class Fit(NamedTuple):
    """The fits in the order given."""

    basis: Basis
    values: Array  # the coefficients in this basis, shape (r, T)
    residual: Array  # shape (n, T)
    squares: Array  # of the residuals, shape (T,)

    def of_tables(self, rows: Places) -> Fit:
        """Return the fits of some tables."""
        arrays = (each[..., rows] for each in (self.values, self.residual, self.squares))
        return Fit(self.basis, *arrays)


class Groups(NamedTuple):
    """Groups of strokes that may be wrong against the others: single ones, and those back."""

    strokes: Grouped
    members: Mask  # which of the S strokes are in each group, shape (groups, S)

    @classmethod
    def of(cls, strokes: Grouped) -> Groups:
        """Groups of some strokes; none where there is one stroke."""
        number, back = strokes.key.size, strokes.key % 2 == 0
        single = np.eye(number, dtype=np.bool_)[int(number <= 2) :]  # of two it is either
        several = 1 < back.sum() < number
        return cls(strokes, np.vstack([single, back]) if several else single)

    def sums(self, values: Array) -> Array:
        """Sum over the readings of each group, from shape (n, T) to shape (groups, T)."""
        return np.tensordot(self.members, self.strokes.sums(values), axes=1)

    def products(self, values: Array, columns: Array) -> Array:
        """Sum values times columns over the readings of each group, shape (groups, T, k)."""
        return np.tensordot(self.members, self.strokes.products(values, columns), axes=1)


class LeftOut(NamedTuple):
    """What fits without each group need."""

    groups: Groups
    inverse: Array  # (1 - B' B)^-1 of the rows B of the basis of each group, shape (groups, p, p)

    @classmethod
    def of(cls, basis: Array, groups: Groups) -> LeftOut:
        """Make ready what depends on the plan alone."""
        normal = np.eye(basis.shape[1]) - groups.products(basis, basis)
        return cls(groups, rank_and_inverse(normal)[1])

    def squares(self, fit: Fit) -> Array:
        """Least squared residuals of the fits without one of the groups, shape (T,).

        Where r are those of a group in the whole fit, they are less by r (1 - B B')^-1 r, which is
        r r + r B (1 - B' B)^-1 B' r.
        """
        pull = self.groups.products(fit.residual, fit.basis.columns)
        taken = self.groups.sums(fit.residual**2) + (pull @ self.inverse * pull).sum(axis=2)
        return np.asarray(fit.squares - taken.max(axis=0))


# -- several strokes that are wrong alike ----------------------------------------------------------


FEWEST = 4
"""Strokes of which some may be wrong: of three, one is, or the other two are."""

_MOST = 0.7  # share of the squared residuals that must be waves: an order explains eight ninths


class Waves(NamedTuple):
    """Cosine and sine of the head angle, and how much of them is in each stroke."""

    strokes: Grouped
    columns: Array  # cosine and sine at each reading, shape (n, 2)
    inverse: Array  # inverse of their normal matrix in each stroke, shape (S, 2, 2) or (T, S, 2, 2)

    @classmethod
    def of(cls, angle: Array, strokes: Grouped, there: Array | None = None) -> Waves:
        """Waves of readings at some angles [deg], which T tables with gaps may lack."""
        phase = np.radians(angle)
        columns = np.stack([np.cos(phase), np.sin(phase)], axis=1)
        known = columns if there is None else there[..., None] * columns
        normal = strokes.products(known, columns)
        inverse = np.linalg.pinv(normal, hermitian=True)
        return cls(strokes, columns, np.asarray(inverse, dtype=np.float64))

    def sums(self, values: Array) -> Array:
        """Products with values of shape (n, T), summed over each stroke, shape (S, T, 2)."""
        return self.strokes.products(values, self.columns)

    def fit(self, values: Array) -> Array:
        """Amplitudes of the waves in each stroke, shape (S, T, 2)."""
        return np.asarray(self.sums(values) @ self.inverse)


@once_a_plan
def _waves(plan: TablePlan) -> Waves:
    return Waves.of(plan.angle, plan.strokes, plan.there)


def differ_by_waves(plan: TablePlan, residual: Array) -> Mask:
    """Tell where most of the residuals, shape (n, T), is a wave in each stroke, shape (T,).

    Some strokes may be wrong alike there.
    """
    squares = (residual**2).sum(axis=0)
    if plan.strokes.key.size < FEWEST:
        return np.zeros(squares.size, dtype=np.bool_)
    waves = _waves(plan)
    sums = waves.sums(residual)
    inverse = waves.inverse
    fit = sums @ inverse if inverse.ndim == 3 else np.einsum("stk,tskl->stl", sums, inverse)
    of_waves = np.einsum("stk,stk->t", fit, sums)
    return np.asarray(of_waves > _MOST * squares)


def odd_strokes(plan: TablePlan, output: Array, angle: Array, sign: float) -> Mask:
    """Find the strokes that hold the wave of most others once they are in another order.

    The order has other angles of the readings [deg] and a sign of the outputs, shape (n, T). They
    are two strokes or more, at most half of all, shape (S, T); none where there are no such ones.
    """
    given = _waves(plan).fit(output)
    other = sign * Waves.of(angle, plan.strokes).fit(output)
    from_middle = np.linalg.norm(given - np.median(given, axis=0), axis=2)
    usual = np.take_along_axis(given, from_middle.argmin(axis=0)[None, :, None], axis=0)
    odd = np.linalg.norm(other - usual, axis=2) < np.linalg.norm(given - usual, axis=2)
    number = odd.sum(axis=0)
    return np.asarray(odd & (number >= 2) & (2 * number <= plan.strokes.key.size))
