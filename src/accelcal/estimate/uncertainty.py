"""From components of error to standard and expanded uncertainties (GUM).

A component is a covariance matrix of what is estimated, with degrees of freedom. The standard
uncertainty adds the variances of the components. The expanded uncertainty multiplies it by
Student's factor for effective degrees of freedom: the mean of the components' degrees of freedom,
harmonic and weighted by their shares of the variance,

    1 / dof = sum (share / dof of the component).

The formula of Welch and Satterthwaite (GUM G.4) weights by the squares of the shares. It trusts a
variance that happened to come out small, and with the two degrees of freedom of a head error on 8
positions it holds the truth in 92 to 95 % where 95 % are meant. The formula here holds it in 94.2
to 96.3 %, whatever the shares (benchmarks/coverage.py --choices). Where one component is all there
is, both give Student's interval.

One degree of freedom is too few even for that: its variance is so often far too small that beside
other errors the interval would hold the truth in 90.7 to 96.3 %. That of a head or of launches
counts as half of one, and all together as one at least: then it is 93.8 to 97.2 %.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.arrays import Array, Places
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.covariance import BY_OTHERS, NO_COVARIANCE, rows_of
from accelcal.results.documents.fields import finite_or_none
from accelcal.results.quantity import Quantity

_TERMS = 25  # of the polynomial for Student's factor
_ENDLESS = 1e6  # from here on Student's factor is the normal one to 1e-6

FEWEST = 0.5
"""What one degree of freedom counts as beside other errors."""


# The share dof / (dof + this) of what known errors explain is taken off a scatter, to leave the
# size of an error that adds to it. Were it all (restricted maximum likelihood), the size would be
# zero too often where both are alike, and for the head on 8 positions the 95 % intervals would hold
# the truth in 90 to 93 % (benchmarks/coverage.py --choices). This way they hold it in 93.5 % or
# more whatever the head error, and in 98 % where there is none. Many dof need less of this caution.
# Nothing is taken off the scatter of one degree of freedom, which is too often small by itself: on
# 7 positions the intervals would hold the truth in 91 to 95 % in place of 93 to 97 %.
_CAUTION = 6.0


class Component(NamedTuple):
    """One source of error in a set of estimates, or in those of each record of a stack.

    Attributes
    ----------
    covariance : ndarray, shape (..., p, p)
        Covariance that the source gives to the estimates; NaN where its size is unknown.
    dof : ndarray, shape (..., p)
        Degrees of freedom of its variance in each estimate; infinite where declared.
    """

    covariance: Array
    dof: Array

    def part(self, indices: slice) -> Component:
        """Return the component of some of the estimates."""
        return Component(self.covariance[..., indices, indices], self.dof[..., indices])

    def of_records(self, records: int | slice | Places) -> Component:
        """Return that of some records of a stack, or of one alone."""
        return Component(self.covariance[records], self.dof[records])

    @property
    def over_dof(self) -> Array:
        """The covariance over its degrees of freedom, of two estimates by their geometric mean."""
        with np.errstate(divide="ignore"):  # without any, nothing is known of the covariance
            root = np.sqrt(1.0 / self.dof)
        return np.asarray(self.covariance * root[..., :, None] * root[..., None, :])

    @property
    def variances(self) -> Array:
        """Variance of each estimate, shape (..., p)."""
        return np.array(np.linalg.diagonal(self.covariance))  # contiguous


class Intervals(NamedTuple):
    """Uncertainties of many estimates; NaN where nothing in data or declarations tells them.

    Attributes
    ----------
    standard : ndarray, shape (..., p)
        Standard uncertainties.
    expanded : ndarray, shape (..., p)
        Half widths of the 95 % intervals.
    factor : ndarray, shape (..., p)
        Coverage factors, expanded over standard.
    dof : ndarray, shape (..., p)
        Effective degrees of freedom; `factor` is Student's for them. A million and more count as
        infinite.
    """

    standard: Array
    expanded: Array
    factor: Array
    dof: Array

    def of_record(self, record: int) -> Intervals:
        """Return those of one record of a stack."""
        return Intervals(*(part[record] for part in self))

    def around(self, values: Array, units: Iterable[str]) -> list[Quantity]:
        """Join those of p estimates to their values."""
        return quantities(units, values, self.standard, self.expanded, self.dof)


def quantities(
    units: Iterable[str], value: Array, standard: Array, expanded: Array, dof: Array
) -> list[Quantity]:
    """Make quantities of p numbers each; what is NaN, and endless dof, are not told.

    Examples
    --------
    >>> import numpy as np
    >>> two, none = np.array([2.0]), np.array([np.nan])
    >>> quantities(["g"], two, none, none, np.array([np.inf]))[0].to_document()["value"]
    2.0
    """
    parts = (map(finite_or_none, part.tolist()) for part in (value, standard, expanded, dof))
    rows = zip(units, *parts, strict=True)
    return [Quantity(own, u, unit, half_width, free) for unit, own, u, half_width, free in rows]


def propagate(components: Mapping[str, Component], jacobian: Array) -> dict[str, Component]:
    """Carry components of p estimates over to m quantities by their derivatives, (..., m, p).

    Each takes the fewest degrees of freedom of the estimates that it depends on.
    """
    depends = _of_all(jacobian != 0.0, 2)
    found = {}
    for name, part in components.items():
        covariance = jacobian @ part.covariance @ jacobian.mT
        dof = _of_all(part.dof, 1)[..., None, :]
        fewest = np.where(depends, dof, np.inf).min(axis=-1)
        found[name] = Component(covariance, np.broadcast_to(fewest, covariance.shape[:-1]))
    return found


def _of_all(values: NDArray[Any], axes: int) -> NDArray[Any]:
    """Take one record for all where they are equal: so they mostly are, and it saves the work."""
    alike = values.ndim > axes and (values == values[:1]).all()
    return values[:1] if alike else values


def covariance_fields(names: Sequence[str], components: Mapping[str, Component]) -> dict[str, Any]:
    """Fields of `CorrelatedBySource`, by which a result keeps the covariance of named quantities.

    They are empty where an error is unknown.
    """
    parts = components.values()
    covariance = _even(np.sum([part.covariance for part in parts], axis=0))
    if not np.isfinite(covariance).all():
        return dict(NO_COVARIANCE)
    by_others = ((name, components[name].covariance) for name in BY_OTHERS if name in components)
    return {
        "covariance_names": tuple(names),
        "covariance_matrix": rows_of(covariance),
        "over_dof_matrix": rows_of(_even(np.sum([part.over_dof for part in parts], axis=0))),
        "shares": {name: rows_of(own) for name, own in by_others if own.any()},
    }


def _even(matrix: Array) -> Array:
    """Make a covariance symmetric to the last digit; readings without noise leave only rounding."""
    return np.asarray((matrix + matrix.mT) / 2.0)


def interval_stack(components: Mapping[str, Component]) -> Intervals:
    """Combine components of p estimates to the uncertainties of many records, shape (..., p).

    Examples
    --------
    >>> import numpy as np
    >>> noise = Component(np.full((3, 1, 1), 4.0), np.full((3, 1), 10.0))
    >>> interval_stack({"reading": noise}).factor.round(3).ravel().tolist()
    [2.228, 2.228, 2.228]
    """
    parts = components.values()
    return combined([part.variances for part in parts], [part.dof for part in parts])


def combined(variances: Sequence[Array], freedom: Sequence[Array]) -> Intervals:
    """Combine variances by several components, shape (..., p), with their degrees of freedom.

    Examples
    --------
    >>> import numpy as np
    >>> combined([np.array([4.0])], [np.array([10.0])]).standard.tolist()
    [2.0]
    """
    variance = np.asarray(sum(variances))
    exact = variance <= 0.0
    over_dof = [
        np.divide(part, dof, out=np.zeros_like(variance), where=part > 0.0)
        for part, dof in zip(variances, freedom, strict=True)
    ]
    inverse = sum(over_dof) / np.where(exact, 1.0, variance)
    inverse = np.where(inverse > 1.0 / _ENDLESS, inverse, 0.0 * inverse)
    inverse = np.minimum(inverse, 1.0)
    factor = np.exp(_polynomial(_powers_of_factor(), 2.0 * inverse - 1.0))  # Student's, of 95 %
    standard = np.sqrt(np.where(exact, 0.0, variance))
    with np.errstate(divide="ignore"):
        dof = 1.0 / inverse
    return Intervals(standard, factor * standard, factor, dof)


def share_taken_off(dof: ArrayLike) -> Array:
    """Share of what known errors explain that is taken off a scatter of so many degrees of freedom.

    Examples
    --------
    >>> share_taken_off([1.0, 2.0]).tolist()
    [0.0, 0.25]
    """
    free = np.asarray(dof, dtype=np.float64)
    return np.where(free < 2.0, 0.0, free / (free + _CAUTION))


def counted(dof: ArrayLike) -> Array:
    """Degrees of freedom as they count beside other errors: fewer than two are cut, one to a half.

    Examples
    --------
    >>> counted([1.0, 2.0, 3.0]).tolist()
    [0.5, 2.0, 3.0]
    """
    free = np.asarray(dof, dtype=np.float64)
    return np.where(free < 2.0, FEWEST * free**2, free)


def welch_satterthwaite(variances: ArrayLike, dof: ArrayLike) -> Array:
    """Effective degrees of freedom, JCGM 100 (G.2b), for who asks for those of the GUM.

    Parameters
    ----------
    variances : array_like, shape (n, ...)
        Variance that each of n components gives to some estimates.
    dof : array_like, shape (n,) or (n, ...)
        Degrees of freedom of each.

    Returns
    -------
    ndarray, shape (...)
        u^4 / sum (u_i^4 / dof_i), infinite where all are.

    Examples
    --------
    >>> welch_satterthwaite([[9.0], [16.0]], [9.0, 16.0]).round(9).tolist()
    [25.0]
    """
    parts, freedom = np.asarray(variances, dtype=np.float64), np.asarray(dof, dtype=np.float64)
    freedom = freedom.reshape(freedom.shape + (1,) * (parts.ndim - freedom.ndim))
    total = parts.sum(axis=0)
    shares = np.divide(parts, total, out=np.zeros_like(parts), where=total > 0.0)
    inverse = np.asarray((shares**2 / freedom).sum(axis=0))
    found: Array = np.divide(1.0, inverse, out=np.full_like(inverse, np.inf), where=inverse > 0.0)
    return found


@cache
def _powers_of_factor() -> list[float]:
    """Polynomial for the logarithm of Student's factor, the highest power last.

    It is a smooth function of the inverse degrees of freedom: a polynomial holds it to 2e-14 from
    one degree of freedom to infinitely many. Its Chebyshev terms fall so fast that its powers, of
    which the sum takes a third of the time, lose none of these digits.
    """
    points = np.pi * (np.arange(_TERMS) + 0.5) / _TERMS
    values = np.log(_exact_factors(0.5 * (np.cos(points) + 1.0)))
    terms = 2.0 / _TERMS * np.cos(np.outer(np.arange(_TERMS), points)) @ values
    terms[0] /= 2.0
    powers, (before, own) = np.zeros(_TERMS), np.eye(2, _TERMS)
    for term in terms:
        powers += term * before
        before, own = own, 2.0 * np.roll(own, 1) - before
    found: list[float] = powers.tolist()
    return found


def _exact_factors(inverse: Array) -> Array:
    dof = [1.0 / x if x > 1.0 / _ENDLESS else np.inf for x in inverse.tolist()]
    return np.array([student_quantile(LEVEL, d) for d in dof])


def _polynomial(powers: Sequence[float], x: Array) -> Array:
    """Sum of powers (Horner), in place: an array for each step takes twice the time."""
    found = np.full_like(x, powers[-1])
    for factor in powers[-2::-1]:
        found *= x
        found += factor
    return found
