"""How the coefficients of (4) are correlated: values at T0, slopes, and what has no slope."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.at_temperature import CoefficientsAt
from accelcal.error_budget.coefficients import Coefficients, Conditions
from accelcal.error_budget.components import SLOPES, sensitivity
from accelcal.model import CROSS_AXES, ERROR_TERMS, LAWS
from accelcal.results.covariance import CorrelatedBySource
from accelcal.results.error_budget import ErrorComponent


class Shared(NamedTuple):
    """What the errors of two coefficients have in common.

    Attributes
    ----------
    correlation : float
        Their covariance over both standard uncertainties.
    over_dof : float
        The same with each source of error over its degrees of freedom.
    """

    correlation: float
    over_dof: float


Correlations = dict[tuple[str, str], Shared]
"""Symbols of two components -> what the errors of their coefficients share."""


class Added(NamedTuple):
    """What correlation adds at n points.

    Attributes
    ----------
    variance : ndarray, shape (n,)
        To the combined variance [g^2].
    over_dof : ndarray, shape (n,)
        To the sum of the variances, each over its degrees of freedom [g^2].
    """

    variance: Array
    over_dof: Array


def covariance(
    correlations: Sequence[Correlations], points: Conditions, parts: Sequence[ErrorComponent]
) -> Added:
    """Sum of 2 r u u' over all pairs of correlated coefficients, GUM (16).

    And what one alone has over degrees of freedom fewer than the 1 that its component tells.

    Returns
    -------
    Added
        The sum, and that of what the sources of error have in common.

    Notes
    -----
    The covariance is that of the fit. Laws from all readings do not tell how they are correlated
    with k2, k3 and delta_ip, which count as uncorrelated with them: mostly on the safe side.
    """
    correlated = correlated_symbols(correlations)
    signed = {part.symbol: _signed(part, points) for part in parts if part.symbol in correlated}
    total = np.zeros((2, points.rise.size))
    above = points.rise > 0.0
    for found, there in zip(correlations, (above, ~above), strict=True):
        for (first, second), shared in found.items():
            product = signed.get(first, 0.0) * signed.get(second, 0.0)  # 0 where one is unknown
            total += np.outer(shared, np.where(there, 2.0 * product, 0.0))
    return Added(*total)


def correlated_symbols(correlations: Sequence[Correlations]) -> frozenset[str]:
    """Symbols of the components that are correlated with others."""
    return frozenset(symbol for found in correlations for pair in found for symbol in pair)


def _signed(part: ErrorComponent, points: Conditions) -> Array:
    """Standard uncertainty with the sign by which the coefficient acts."""
    at_T0 = {slope: name for name, (_, slope) in SLOPES.items()}
    name = at_T0.get(part.symbol, part.symbol)
    acting = sensitivity(name, points)
    acting = acting * points.rise if part.symbol in at_T0 else acting
    return np.asarray(part.standard_uncertainty * np.sign(acting))


def correlations_of(coefficients: Coefficients) -> list[Correlations]:
    """What the coefficients share where the slopes above T0 act, and where those below do."""
    return [_correlations(coefficients, side) for side in ("above", "below")]


def correlations_of_other_axis(coefficients: Coefficients) -> list[Correlations]:
    """Take those of its misalignment at T0 and the slopes on either side."""
    model, (name, _) = coefficients.second, coefficients.of_other_axis
    if model is None or name not in coefficients.slopes:
        return [{}, {}]
    symbols = ({"delta at_T0": name, f"delta {s}": SLOPES[name][1]} for s in ("above", "below"))
    return [_by_pairs(model, [own.get(n) for n in model.covariance_names]) for own in symbols]


def _correlations(coefficients: Coefficients, side: str) -> Correlations:
    model = coefficients.model
    if model is None:
        return _alone(coefficients)
    symbols = {name: name for name in ("k2", "k3")}
    for name, law in zip(coefficients.slopes, LAWS, strict=False):
        symbols |= {f"{law} at_T0": name, f"{law} {side}": SLOPES[name][1]}
    main = list(coefficients.slopes)[2]
    symbols["delta_ip"] = next(a.coupling for a in CROSS_AXES.values() if a.misalignment == main)
    names = model.covariance_names
    signs = _signs(coefficients, names, "K1 at_T0")
    return _by_pairs(model, [symbols.get(name) for name in names], signs)


def _signs(coefficients: Coefficients, names: Sequence[str], scale_factor: str) -> Array:
    """Signs from K1 beside quotients by it, which laws and means have, to the dK1/K1 of (4)."""
    turned = (coefficients.at_T0["K1"].value or 0.0) < 0.0
    return np.array([-1.0 if turned and name == scale_factor else 1.0 for name in names])


def _alone(coefficients: Coefficients) -> Correlations:
    """Correlations of (1) stand for those of (2): the quotient by K1 changes next to nothing.

    A mean of runs has those of (2) with K1.
    """
    axis = CROSS_AXES[coefficients.mounting[0]]
    of_axis = {"delta": axis.misalignment, "delta_ip": axis.coupling}
    terms = [ERROR_TERMS.get(name, name) for name in coefficients.alone.covariance_names]
    symbols = [of_axis.get(term, term) for term in terms]
    kept = [symbol if symbol in coefficients.at_T0 else None for symbol in symbols]
    of_mean = isinstance(coefficients.alone, CoefficientsAt)
    return _by_pairs(coefficients.alone, kept, _signs(coefficients, terms, "K1" if of_mean else ""))


def _by_pairs(
    known: CorrelatedBySource | CoefficientsAt,
    symbols: Sequence[str | None],
    sign: Array | float = 1.0,
) -> Correlations:
    """What the errors of each pair of quantities have in common, with the signs they are to have.

    The symbol None leaves one out, as an exact one is.
    """
    covariance, over_dof = known.covariance, known.over_dof
    sigma = sign * np.sqrt(np.diagonal(covariance))
    kept = [(i, symbol) for i, symbol in enumerate(symbols[: sigma.size]) if symbol and sigma[i]]
    found = {
        (one, two): Shared(
            *(float(m[i, j] / (sigma[i] * sigma[j])) for m in (covariance, over_dof))
        )
        for (i, one), (j, two) in combinations(kept, 2)
    }
    beyond = {name: float(over_dof[i, i] / sigma[i] ** 2) - 1.0 for i, name in kept}
    few = {(name, name): Shared(0.0, 0.5 * more) for name, more in beyond.items() if more > 0.0}
    return found | few if found else found
