"""Fits without one of the strokes, or without those of one direction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.gates.replicate_plan import rank_and_inverse
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

    single: slice  # strokes
    back: Places  # strokes of one more group, none where there is no such group
    strokes: Grouped

    @classmethod
    def of(cls, strokes: Grouped) -> Groups:
        """Groups of some strokes; none where there is one stroke."""
        number = strokes.key.size
        back = np.flatnonzero(strokes.key % 2 == 0)
        single = slice(int(number == 2), number if number > 1 else 0)  # of two it is either
        return cls(single, back if 1 < back.size < number else back[:0], strokes)

    @property
    def number(self) -> int:
        """How many groups there are."""
        return int(self.single.stop - self.single.start) + bool(self.back.size)

    def sums(self, values: Array) -> Array:
        """Sum over the readings of each group, from shape (n, T) to shape (groups, T)."""
        return self._of_groups(self.strokes.sums(values))

    def products(self, values: Array, columns: Array) -> Array:
        """Sum values times columns over the readings of each group, shape (groups, T, k)."""
        return self._of_groups(self.strokes.products(values, columns))

    def _of_groups(self, of_strokes: Array) -> Array:
        single = of_strokes[self.single]
        if not self.back.size:
            return single
        return np.concatenate([single, of_strokes[self.back].sum(axis=0, keepdims=True)])

    def strokes_of(self, group: int) -> Mask:
        """Tell the strokes of a group, shape (S,)."""
        place = self.single.start + group
        chosen = np.zeros(self.strokes.key.size, dtype=np.bool_)
        chosen[place if place < self.single.stop else self.back] = True
        return chosen


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
