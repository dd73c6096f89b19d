"""Coefficients level by level: straight lines in temperature between what was calibrated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.compensate.coefficients import PARAMETERS, Compensation
from accelcal.compensate.propagation import Part, linear_sum, ratio, variance_of
from accelcal.effects.static import Samples
from accelcal.estimate.launch import SAME_LEVEL

__all__ = ["LevelCompensation", "LevelTable"]

_NEAREST = 0.25
"""A level is a neighbour from this part of an interval on: nearer ones tell a curvature badly."""

_DELTA, _DELTA_IP = (PARAMETERS.index(name) for name in ("delta", "delta_ip"))


class LevelTable(NamedTuple):
    """Coefficients at L levels, `PARAMETERS` in their units, with straight lines between.

    Attributes
    ----------
    rise : ndarray, shape (L,)
        Temperature of each level minus T0, ascending [degC].
    values : ndarray, shape (L, 6)
        The coefficients.
    common : ndarray, shape (2, L, 6, 6)
        Covariance at each level, NaN where unknown, and with each source over its degrees of
        freedom, of what may be the same at several levels: errors of the head, and all that nothing
        says to be independent.
    own : ndarray, shape (2, L, 6, 6)
        The same of what is new at each level: noise of the readings, shifts from launch to launch,
        and errors of the temperature.

    Notes
    -----
    At the part w of an interval the coefficients are (1 - w) p + w q. Whatever the correlation of
    the common errors of p and q, the covariance of theirs is at most (1 - w) P + w Q in any
    direction, and it is that where they are the same. That of what is independent is
    (1 - w)^2 P + w^2 Q. Outside the levels, where a weight is negative, the first is
    (a + b) (a P + b Q), with a and b the sizes of the weights.

    What the straight line misses is not known. Curves of second and third order through the two
    levels and their neighbours tell what it may be: the mean square of the differences between
    them and the line is added, as a matrix, since a curvature acts on all coefficients together.
    Where T0 lies between two levels, where the laws break and nothing shows it, the square of what
    the lines of the neighbouring intervals say of T0 is added too.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> from accelcal.compensate.choice import compensation
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> table = compensation(calibration, by="levels").table
    >>> table.rise.tolist()
    [-60.0, 0.0, 60.0]
    >>> K1 = table.values[:, 1]
    >>> [round(float(value), 6) for value in (table.at(np.array(30.0))[1], K1[1:].mean())]
    [1.37107, 1.37107]
    """

    rise: Array
    values: Array
    common: Array
    own: Array

    def at(self, rise: Array) -> Array:
        """Coefficients at each temperature, shape (..., 6)."""
        if self.rise.size == 1:
            return np.broadcast_to(self.values[0], (*np.shape(rise), len(PARAMETERS)))
        at, part = self._place(rise)
        part = part[..., None]
        return np.asarray((1.0 - part) * self.values[at] + part * self.values[at + 1])

    def slope(self, rise: Array) -> Array:
        """Change of the coefficients with temperature, shape (..., 6) [per degC]."""
        if self.rise.size == 1:
            return np.zeros((*np.shape(rise), len(PARAMETERS)))
        slopes = np.diff(self.values, axis=0) / np.diff(self.rise)[:, None]
        return np.asarray(slopes[self._place(rise)[0]])

    def error(self, rise: Array, jacobian: Array) -> Part:
        """Variance of what has the derivatives J by the coefficients.

        Parameters
        ----------
        rise : ndarray, shape (n,)
            T - T0 of each sample [degC].
        jacobian : ndarray, shape (n, 6)
            The derivatives.

        Returns
        -------
        Part
            The variance with its degrees of freedom, of each sample.
        """
        variance, over_dof = np.zeros(rise.shape), np.zeros(rise.shape)
        at, _ = self._place(rise)
        for interval in np.unique(at).tolist():
            here = at == interval
            inside, rows = rise[here], jacobian[here]
            for weight, (covariance, told) in self._terms(interval, inside):
                variance[here] += weight * variance_of(rows, covariance)
                if told.any():
                    over_dof[here] += weight * variance_of(rows, told)
            missed = np.einsum("nj,knj->kn", rows, self.departures(interval, inside))
            variance[here] += (missed**2).sum(axis=0)
        return Part(variance, ratio(variance, over_dof))

    def errors_at(self, rise: float) -> Array:
        """Covariance at a temperature, and with each source over its dof, shape (2, 6, 6)."""
        place = np.array([rise])
        (interval,), _ = self._place(place)
        missed = self.departures(int(interval), place)[:, 0]
        errors = np.stack([missed.T @ missed, np.zeros((6, 6))])
        for weight, own in self._terms(int(interval), place):
            errors = errors + weight * own
        return errors

    def departures(self, interval: int, rise: Array) -> Array:
        """Curves through the neighbouring levels minus the straight line of an interval.

        Parameters
        ----------
        interval : int
            Its place.
        rise : ndarray, shape (n,)
            T - T0 [degC].

        Returns
        -------
        ndarray, shape (curves, n, 6)
            Over the root of their number, so that the sum of squares is their mean square, and
            behind them a line that breaks at T0, where that lies between the two levels. None where
            there are two levels.
        """
        if self.rise.size == 1:
            return np.zeros((0, rise.size, len(PARAMETERS)))
        low, high = self.rise[interval], self.rise[interval + 1]
        curves, beside = self._curves(interval), ((rise - low) * (rise - high))[:, None]
        found = [
            beside * (second + third * (rise - self.rise[origin])[:, None]) / len(curves) ** 0.5
            for second, third, origin in curves
        ]
        if low < -SAME_LEVEL and high > SAME_LEVEL and found:
            found.append(
                np.outer(np.minimum(1.0 - rise / low, 1.0 - rise / high), self._break(interval))
            )
        return np.array(found).reshape(-1, rise.size, len(PARAMETERS))

    def _break(self, interval: int) -> Array:
        """How far the lines of the neighbouring intervals, drawn on to T0, are off that of one."""
        ends = ((interval, -1), (interval + 1, 1))
        others = [(end, self._neighbour(end, step, interval)) for end, step in ends]
        drawn_on = [
            self.values[end] - self.rise[end] * self._divided([end, other])
            for end, other in others
            if other is not None
        ]
        return np.asarray(np.mean(drawn_on, axis=0) - self.at(np.zeros(())))

    def _place(self, rise: Array) -> tuple[Places, Array]:
        """Interval of each temperature, and which part of it lies below."""
        if self.rise.size == 1:
            return np.zeros(np.shape(rise), dtype=np.intp), np.zeros(np.shape(rise))
        at = np.searchsorted(self.rise, rise, side="right") - 1
        at = np.clip(at, 0, self.rise.size - 2)
        low, high = self.rise[at], self.rise[at + 1]
        return at, np.asarray((rise - low) / (high - low))

    def _terms(self, interval: int, rise: Array) -> list[tuple[Array, Array]]:
        """Weights, with the errors that each belongs to, shape (2, 6, 6)."""
        if self.rise.size == 1:
            return [(np.ones(rise.shape), errors[:, 0]) for errors in (self.common, self.own)]
        _, above = self._place(rise)
        weights = (1.0 - above, above)
        size = abs(weights[0]) + abs(weights[1])
        return [
            (weight, errors[:, interval + end])
            for end, part in enumerate(weights)
            for weight, errors in ((size * abs(part), self.common), (part**2, self.own))
        ]

    def _curves(self, interval: int) -> list[tuple[Array, Array, int]]:
        """Divided differences of second and third order, and the level the third begins at."""
        low, high = interval, interval + 1
        below, above = self._neighbour(low, -1, low), self._neighbour(high, 1, low)
        found = [
            (self._divided([low, high, other]), np.zeros(len(PARAMETERS)), other)
            for other in (below, above)
            if other is not None
        ]
        first, second = (below, above) if below is not None else (above, below)
        if first is not None and second is None:  # at an end: two neighbours on one side
            second = self._neighbour(first, -1 if first < low else 1, low)
        if first is not None and second is not None:
            three = [low, high, first]
            found.append((self._divided(three), self._divided([*three, second]), first))
        return found

    def _neighbour(self, level: int, step: int, interval: int) -> int | None:
        """Next level on one side that is far enough away; the last one where none is."""
        others = range(level + step, self.rise.size if step > 0 else -1, step)
        least = _NEAREST * (self.rise[interval + 1] - self.rise[interval])
        for other in others:
            if abs(self.rise[other] - self.rise[level]) >= least:
                return other
        return others[-1] if others else None

    def _divided(self, levels: Sequence[int]) -> Array:
        """Divided difference of the coefficients over some levels."""
        if len(levels) == 1:
            return np.asarray(self.values[levels[0]])
        change = self._divided(levels[1:]) - self._divided(levels[:-1])
        return np.asarray(change / (self.rise[levels[-1]] - self.rise[levels[0]]))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LevelCompensation(Compensation):
    """Coefficients level by level.

    Attributes
    ----------
    table : LevelTable
        The levels of the main axis; the laws, the covariance and the other fields of `Compensation`
        are those of the level nearest to T0, without slopes.
    other_table : LevelTable or None
        Those of the other cross axis, of which delta and delta_ip count.
    """

    table: LevelTable
    other_table: LevelTable | None = None

    __eq__ = object.__eq__  # arrays have no one answer
    __hash__ = object.__hash__

    @property
    def _tables(self) -> tuple[LevelTable, ...]:
        """One for each cross axis."""
        return (self.table,) if self.other_table is None else (self.table, self.other_table)

    def parameters(self, rise: Array) -> list[tuple[Any, ...]]:
        """`PARAMETERS` at T - T0, with those of each cross axis in its turn."""
        return [tuple(np.moveaxis(table.at(rise), -1, 0)) for table in self._tables]

    def error(self, samples: Samples, a_i: Array, bracket: Array) -> Part:
        """Variance of the bracket of the model from the coefficients [g^2]."""
        one, nothing, along = np.ones_like(a_i), np.zeros_like(a_i), samples.cross[0]
        rows = [one, bracket / samples.scale, a_i**2, a_i**3, along, a_i * along]
        main = self.table.error(samples.rise, np.stack(rows, axis=-1))
        if self.other_table is None:
            return main
        along = samples.cross[1]
        rows = [nothing] * _DELTA + [along, a_i * along]
        return linear_sum(main, self.other_table.error(samples.rise, np.stack(rows, axis=-1)))

    def heat_sensitivity(self, samples: Samples, a_i: Array, bracket: Array) -> Array:
        """Change of the bracket of the model with temperature [g/degC]."""
        slope = self.table.slope(samples.rise)
        rows = (np.ones_like(a_i), bracket / samples.scale, a_i**2, a_i**3)
        total = np.sum([slope[..., i] * row for i, row in enumerate(rows)], axis=0)
        for table, along in zip(self._tables, samples.cross, strict=True):
            of_axis = table.slope(samples.rise)
            total = total + (of_axis[..., _DELTA] + of_axis[..., _DELTA_IP] * a_i) * along
        of_effects = self.effects.heat_sensitivity(samples, a_i) if self.effects else 0.0
        return np.asarray(total + of_effects)
