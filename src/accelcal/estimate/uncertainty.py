"""From components of error to standard and expanded uncertainties (GUM).

A component is a covariance matrix of what is estimated, with degrees of freedom. The standard
uncertainty adds the variances of the components. The expanded uncertainty multiplies it by
Student's factor for effective degrees of freedom: the mean of the components' degrees of freedom,
harmonic and weighted by their shares of the variance,

    1 / dof = sum (share / dof of the component).

The formula of Welch and Satterthwaite (GUM G.4) weights by the squares of the shares. It trusts a
variance that happened to come out small, and with the two degrees of freedom of a head error on 8
positions it holds the truth in 92 to 95 % where 95 % are meant. The formula here holds it in 94.2
to 96.3 %, whatever the shares (benchmarks/coverage.py). Where one component is all there is, both
give Student's interval.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.probability import student_quantile

__all__ = ["LEVEL", "Component", "Interval", "intervals", "propagate"]

Array = NDArray[np.float64]

LEVEL = 0.95
"""Probability of the intervals that accelcal prints."""

_ENDLESS = 1e6  # from here on Student's factor is the normal one to 1e-6


class Component(NamedTuple):
    """One source of error in a set of estimates.

    Attributes
    ----------
    covariance : ndarray, shape (p, p)
        Covariance that the source gives to the estimates; NaN where its size is unknown.
    dof : ndarray, shape (p,)
        Degrees of freedom of its variance in each estimate; infinite where declared.
    """

    covariance: Array
    dof: Array

    def part(self, indices: slice) -> Component:
        """Return the component of some of the estimates."""
        return Component(self.covariance[indices, indices], self.dof[indices])


class Interval(NamedTuple):
    """Uncertainty of one estimate; None where nothing in the data or the declarations tells it.

    Attributes
    ----------
    standard : float or None
        Standard uncertainty.
    expanded : float or None
        Half width of the 95 % interval.
    factor : float or None
        Coverage factor, expanded over standard.
    dof : float or None
        Effective degrees of freedom; `factor` is Student's for them. A million and more count as
        infinite.
    """

    standard: float | None
    expanded: float | None
    factor: float | None
    dof: float | None


def propagate(components: Mapping[str, Component], jacobian: Array) -> dict[str, Component]:
    """Carry components over to quantities derived from the estimates.

    Parameters
    ----------
    components : mapping of str to Component
        Components of p estimates.
    jacobian : ndarray, shape (m, p)
        Derivatives of the m derived quantities.

    Returns
    -------
    dict of str to Component
        Components of the derived quantities; each takes the fewest degrees of freedom of the
        estimates that it depends on.
    """
    return {
        name: Component(
            jacobian @ part.covariance @ jacobian.T,
            np.where(jacobian != 0.0, part.dof, np.inf).min(axis=1),
        )
        for name, part in components.items()
    }


def intervals(components: Mapping[str, Component], level: float = LEVEL) -> list[Interval]:
    """Combine components to the uncertainty of each estimate.

    Parameters
    ----------
    components : mapping of str to Component
        Components of p estimates.
    level : float, default 0.95
        Probability of the interval.

    Returns
    -------
    list of Interval
        One an estimate.

    Examples
    --------
    >>> import numpy as np
    >>> noise = Component(np.array([[4.0]]), np.array([10.0]))
    >>> round(intervals({"reading": noise})[0].factor, 3)
    2.228
    """
    parts = list(components.values())
    size = parts[0].dof.size
    return [
        _interval([(float(p.covariance[i, i]), float(p.dof[i])) for p in parts], level)
        for i in range(size)
    ]


def _interval(parts: list[tuple[float, float]], level: float) -> Interval:
    variance = sum(v for v, _ in parts)
    if math.isnan(variance):
        return Interval(None, None, None, None)
    if variance <= 0.0:
        return Interval(0.0, 0.0, student_quantile(level, math.inf), math.inf)
    inverse = sum(v / variance / dof for v, dof in parts if v > 0.0)
    dof = 1.0 / inverse if inverse > 1.0 / _ENDLESS else math.inf
    factor = student_quantile(level, dof)
    return Interval(math.sqrt(variance), factor * math.sqrt(variance), factor, dof)
