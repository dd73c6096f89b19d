"""Hysteresis of the bias, from levels that were reached both by heating and by cooling.

Only two runs at one level tell of a loop. At its lowest and its highest level it may close or not:
there each run is uncertain by what the loop is elsewhere. Its width may differ from level to level:
each has a half width h of its own, the laws go through the middle of both branches, and h_T is the
mean of h over the levels.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.launch import reached_by, same_levels
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component, intervals, propagate
from accelcal.probability import f_survival
from accelcal.results.quantity import Quantity
from accelcal.temperature.bilinear import quantity

__all__ = ["Branches", "branches", "confounded", "mean_hysteresis"]

Array = NDArray[np.float64]

_SIGNIFICANT = 0.001

_OPEN = 1.0 / np.sqrt(3.0)
"""Standard uncertainty, in half widths, of a level where the loop may be closed or as wide as it is
elsewhere: anything between both branches is as likely."""


class Branches(NamedTuple):
    """On which branch of the loop R tables lie.

    Attributes
    ----------
    paired : ndarray, shape (R, L)
        A column for each level that was reached both ways: 1 after heating, -1 after cooling.
    loose : ndarray, shape (R, m)
        Columns of what lies off the middle by an amount that no pair shows: levels reached one
        way only, the first level, of which nobody knows how it was reached, and the lowest and the
        highest one.
    temperature : ndarray, shape (L,)
        The levels of `paired` [degC].
    """

    paired: Array
    loose: Array
    temperature: Array

    def off_the_middle(self, half_widths: Array) -> Array:
        """Columns of the errors of `loose`, of the size of the root mean square half width [g]."""
        size = np.sqrt(np.mean(half_widths**2)) if half_widths.size else 0.0
        return np.asarray(size * self.loose)


def branches(tables: Sequence[PreparedTable]) -> Branches:
    """Tell on which branch each table lies, see `accelcal.estimate.launch.reached_by`.

    Parameters
    ----------
    tables : sequence of PreparedTable
        R tables of one mounting.

    Returns
    -------
    Branches
        Without any column where no level was reached both ways.
    """
    temperature = np.array([table.record.mean_temperature for table in tables])
    order = np.argsort([int(table.record.run[0]) for table in tables], kind="stable")
    in_order = reached_by(temperature[order].tolist())
    nothing = np.zeros((len(tables), 0))
    if in_order is None:
        return Branches(nothing, nothing, np.zeros(0))
    reached = in_order[np.argsort(order)]
    masks = [np.isin(np.arange(reached.size), level) for level in same_levels(temperature)]
    both = [mask for mask in masks if {-1.0, 1.0} <= set(reached[mask].tolist())]
    known = np.nan_to_num(reached)
    one_way = known * ~np.any(both, axis=0)
    ends = _OPEN * np.stack([masks[0], masks[-1]], axis=1)
    loose = np.column_stack([one_way, np.isnan(reached), ends])
    return Branches(
        paired=np.column_stack([known * mask for mask in both]),
        loose=loose[:, loose.any(axis=0)],
        temperature=np.array([temperature[mask].mean() for mask in both]),
    )


def mean_hysteresis(
    half_widths: Array, components: Mapping[str, Component], temperature: Array
) -> tuple[Quantity | None, tuple[str, ...]]:
    """Average the half widths over the levels.

    Parameters
    ----------
    half_widths : ndarray, shape (L,)
        Half the bias after heating less the bias after cooling, of each level [g].
    components : mapping of str to Component
        Components of their errors.
    temperature : ndarray, shape (L,)
        The levels [degC].

    Returns
    -------
    Quantity or None
        h_T [g]; None without a level. Its uncertainty is not less than the scatter of the half
        widths tells, with L - 1 degrees of freedom.
    tuple of str
        What is to be said where the levels differ by more than their uncertainty.
    """
    size = half_widths.size
    if size == 0:
        return None, ()
    of_mean = propagate(components, np.full((1, size), 1.0 / size))
    told = sum(float(part.covariance[0, 0]) for part in of_mean.values())
    seen = float(half_widths.var(ddof=1)) / size if size > 1 else 0.0
    missing = Component(np.full((1, 1), max(seen - told, 0.0)), np.full(1, max(size - 1.0, 1.0)))
    interval = intervals({**of_mean, "scatter of the levels": missing})[0]
    said = tuple(_differing(half_widths, components, temperature))
    return quantity(float(half_widths.mean()), interval, "g"), said


def _differing(
    half_widths: Array, components: Mapping[str, Component], temperature: Array
) -> Iterator[str]:
    covariance = np.asarray(sum(part.covariance for part in components.values()))
    dof = half_widths.size - 1
    if dof == 0 or not np.isfinite(covariance).all():
        return
    contrast = np.diff(np.eye(dof + 1), axis=0)
    found, spread = contrast @ half_widths, contrast @ covariance @ contrast.T
    squares = float(found @ np.linalg.pinv(spread, hermitian=True) @ found)
    if f_survival(squares / dof, float(dof), np.inf) < _SIGNIFICANT:
        each = ", ".join(
            f"{1e6 * h:.3g} ug at {at:.3g} degC"
            for h, at in zip(half_widths, temperature, strict=True)
        )
        yield f"the hysteresis differs by level: {each}; h_T is their mean, and U holds the scatter"


def confounded(estimate: JointEstimate, hysteresis: Quantity | None) -> Iterator[str]:
    """Say that launches may pass for hysteresis, where nobody declared how far they shift.

    Parameters
    ----------
    estimate : JointEstimate
        Tells where the shift from launch to launch is from.
    hysteresis : Quantity or None
        h_T.

    Yields
    ------
    str
        A sentence.
    """
    if hysteresis is None or estimate.bias_shift.source == "declared":
        return
    if estimate.bias_shift.source == "none":
        yield (
            "launch_uncertainty not declared: h_T is half the difference of launches, and what"
            " their biases shift by cannot be told from it; U of h_T leaves that out"
        )
    else:
        yield (
            "launch_uncertainty not declared: launches and a hysteresis that differs by level"
            " cannot be told apart; the shift from launch to launch takes the hysteresis as alike"
            " at all levels"
        )
