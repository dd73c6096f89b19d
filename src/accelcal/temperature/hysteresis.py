"""Hysteresis of the bias, from levels that were reached both by heating and by cooling.

Only two runs at one level tell of a loop. At its lowest and its highest level it may close or not:
there half of what the loop is elsewhere is expected of each run, and may be missing or come twice.
Its width may differ from level to level: each has a half width h of its own, the laws go through
the middle of both branches, and h_T is the mean of h over the levels.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.estimate.launch import reached_by, same_levels
from accelcal.estimate.uncertainty import Component, Intervals, interval_stack, propagate
from accelcal.results.quantity import Quantity
from accelcal.temperature.bilinear import chance_of_misfit

_HALF_OPEN = 0.5
"""Where the bias of the lowest and of the highest level is taken to lie, in half widths from the
middle towards the branch on which they are reached, and its standard uncertainty: the loop may be
closed there, or as wide as it is elsewhere."""


class Branches(NamedTuple):
    """On which branch of the loop n tables lie, alike in all records of one course of levels."""

    # shape (n, L): a column for each level that was reached both ways: 1 after heating, -1 after
    # cooling
    paired: Array
    # shape (n, L): the same, and at the lowest and the highest level what is expected of the loop
    # there, from the mean half width
    acting: Array
    # shape (n, m): columns of what lies off the middle by an amount that no pair shows: levels
    # reached one way only, the first level, of which nobody knows how it was reached, and the
    # lowest and the highest one, off what is expected there
    loose: Array
    mean: Array  # shape (n, L): weights that take the mean temperature of each level of `paired`

    def off_the_middle(self, half_widths: Array) -> Array:
        """Columns of the errors of `loose`, of the size of the root mean square half width [g].

        From half widths of shape (..., L) to columns of shape (..., n, m).
        """
        squares = half_widths**2
        size = np.sqrt(squares.sum(axis=-1) / max(squares.shape[-1], 1))
        return np.asarray(size[..., None, None] * self.loose)


def branches_of(temperature: Array, order: Places) -> Branches:
    """Tell on which branch each of n levels [degC] lies, which were met in an order, shape (n,).

    Where no level was reached both ways, there is no column.
    """
    in_order = reached_by(temperature[order].tolist())
    nothing = np.zeros((temperature.size, 0))
    if in_order is None:
        return Branches(nothing, nothing, nothing, nothing)
    reached = in_order[np.argsort(order)]
    masks = [np.isin(np.arange(reached.size), level) for level in same_levels(temperature)]
    both = [mask for mask in masks if {-1.0, 1.0} <= set(reached[mask].tolist())]
    known = np.nan_to_num(reached)
    one_way = known * ~np.any(both, axis=0)
    ends = np.stack([masks[0], masks[-1]], axis=1)
    loose = np.column_stack([one_way, np.isnan(reached), _HALF_OPEN * ends])
    paired = np.column_stack([known * mask for mask in both])
    towards = _HALF_OPEN * (1.0 * masks[-1] - masks[0]) / len(both)
    return Branches(
        paired=paired,
        acting=paired + towards[:, None],
        loose=loose[:, loose.any(axis=0)],
        mean=np.column_stack([mask / mask.sum() for mask in both]),
    )


class Hysteresis(NamedTuple):
    """Half widths of the loop of R records, and their mean over the levels."""

    mean: Array  # shape (R,): h_T [g]; NaN without a level
    # its uncertainty, shape (R, 1), which is not less than the scatter of the half widths tells,
    # with L - 1 degrees of freedom
    intervals: Intervals
    # shape (R, L): half the bias after heating less the bias after cooling, of each level [g], and
    # the levels [degC]
    half_widths: Array
    temperature: Array
    p: Array  # shape (R,): probability that levels alike differ so much; NaN where it is unknown

    def quantity(self, index: int) -> Quantity | None:
        """h_T of one record; None without a level."""
        if not self.half_widths.shape[1]:
            return None
        return self.intervals.of_record(index).around(self.mean[[index]], "g")[0]


def mean_hysteresis(
    half_widths: Array, components: Mapping[str, Component], temperature: Array
) -> Hysteresis:
    """Average the half widths over the levels.

    The half widths, shape (R, L), are half the bias after heating less the bias after cooling, of
    each level [g], with the components of their errors; the levels are of the same shape [degC].
    """
    records, size = half_widths.shape
    if size == 0:
        nothing = np.full(records, np.nan)
        unknown = Intervals(*[nothing[:, None]] * len(Intervals._fields))
        return Hysteresis(nothing, unknown, half_widths, temperature, nothing)
    of_mean = propagate(components, np.full((1, size), 1.0 / size))
    told = np.sum([part.covariance[:, 0, 0] for part in of_mean.values()], axis=0)
    seen = half_widths.var(axis=1, ddof=1) / size if size > 1 else np.zeros(records)
    missing = Component(
        np.maximum(seen - told, 0.0)[:, None, None], np.full((records, 1), max(size - 1.0, 1.0))
    )
    found = interval_stack({**of_mean, "scatter of the levels": missing})
    p = np.full(records, np.nan)
    if size > 1:
        p = chance_of_misfit(half_widths, components, np.diff(np.eye(size), axis=0))
    return Hysteresis(half_widths.mean(axis=1), found, half_widths, temperature, p)
