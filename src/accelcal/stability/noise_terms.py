"""Noise coefficients from the Allan deviation, each only where its slope is really there.

========  ==========================================  ==================  =====
name      noise                                       Allan deviation     slope
========  ==========================================  ==================  =====
Q         quantisation, white noise of the integral   sqrt(3) Q / tau     -1
N         white noise (velocity random walk)          N / sqrt(tau)       -1/2
B         flicker noise (bias instability)            sqrt(2 ln2/pi) B    0
K         random walk of the bias                     K sqrt(tau / 3)     +1/2
R         ramp                                        R tau / sqrt(2)     +1
========  ==========================================  ==================  =====
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from accelcal.results.stability import AllanDeviation, Estimate

__all__ = ["TERMS", "NoiseTerm", "noise_terms"]

Array = NDArray[np.float64]

OCTAVES_LED = 2.0
"""Octaves of averaging time over which a term must be the largest one."""

_WORTH_A_TERM = 6.63  # chi-squared of one degree of freedom at 1 %
_NEIGHBOURS = 0.7  # correlation one octave apart: 0.5 in white noise, 0.9 in random walk
_FLAT = 2.0 * math.log(2.0) / math.pi
_FEWEST_POINTS = 4
_Z = 1.959964  # 95 %, two-sided


@dataclass(frozen=True, slots=True)
class NoiseTerm:
    """One term of the Allan variance.

    Attributes
    ----------
    name : str
        What it is.
    slope : str
        Slope of its Allan deviation.
    unit : str
        What the unit of the output is followed by.
    variance : callable
        Allan variance at an averaging time [s] for a coefficient of 1.
    """

    name: str
    slope: str
    unit: str
    variance: Callable[[Array], Array]


TERMS: Mapping[str, NoiseTerm] = MappingProxyType(
    {
        "Q": NoiseTerm("quantisation", "-1", "*s", lambda tau: 3.0 / tau**2),
        "N": NoiseTerm("white noise", "-1/2", "/sqrt(Hz)", lambda tau: 1.0 / tau),
        "B": NoiseTerm("bias instability", "0", "", lambda tau: np.full_like(tau, _FLAT)),
        "K": NoiseTerm("random walk", "+1/2", "/sqrt(s)", lambda tau: tau / 3.0),
        "R": NoiseTerm("ramp", "+1", "/s", lambda tau: 0.5 * tau**2),
    }
)
"""Symbol -> term; IEEE 1293 and IEEE 952 use the same ones."""


@dataclass(frozen=True, slots=True)
class _Fit:
    names: tuple[str, ...]
    squares: Array  # of the coefficients
    covariance: Array
    chi2: float


def noise_terms(allan: AllanDeviation, unit: str) -> dict[str, Estimate]:
    """Noise coefficients that an Allan deviation shows.

    Parameters
    ----------
    allan : AllanDeviation
        At octaves of averaging time.
    unit : str
        Unit of the deviation.

    Returns
    -------
    dict of str to Estimate
        An entry for each of `TERMS`; its value is None, with the reason, where the term is not
        identified.

    Notes
    -----
    The Allan variance is a sum of the terms with coefficients not below 0. Of all sums, the one
    with the least chi-squared is taken, where each term has to lower it by 6.63 (1 %). A term of
    that sum is identified where it is the largest one over at least `OCTAVES_LED` octaves. The
    variances weigh by their equivalent degrees of freedom; those of neighbouring octaves correlate.

    Examples
    --------
    >>> from accelcal.stability.allan import overlapping_allan
    >>> white = np.random.default_rng(1).normal(size=4000)
    >>> terms = noise_terms(overlapping_allan([white]), "g")
    >>> [name for name, term in terms.items() if term.value is not None]
    ['N']
    """
    tau = np.array(allan.tau_s)
    variance = np.array(allan.deviation) ** 2
    if tau.size < _FEWEST_POINTS or not variance.all():
        finding = f"{tau.size} averaging times; at least {_FEWEST_POINTS} octaves are wanted"
        return {name: Estimate(None, unit + t.unit, finding=finding) for name, t in TERMS.items()}
    best = _best_fit(tau, variance, np.array(allan.edf))
    return {name: _estimate(name, best, tau, unit) for name in TERMS}


def _best_fit(tau: Array, variance: Array, edf: Array) -> _Fit:
    most = min(len(TERMS), tau.size - 1)
    subsets = [names for n in range(1, most + 1) for names in combinations(TERMS, n)]
    fits = [fit for names in subsets if (fit := _fit(names, tau, variance, edf))]
    return min(fits, key=lambda fit: fit.chi2 + _WORTH_A_TERM * len(fit.names))


def _fit(names: tuple[str, ...], tau: Array, variance: Array, edf: Array) -> _Fit | None:
    """Generalised least squares on the variances; None where a coefficient is not above 0."""
    design = np.stack([TERMS[name].variance(tau) for name in names], axis=1)
    order = np.arange(tau.size)
    correlation = _NEIGHBOURS ** np.abs(order[:, None] - order)
    root = np.linalg.cholesky(2.0 * correlation / np.sqrt(np.outer(edf, edf)))
    expected = variance
    for _ in range(8):
        relative = np.linalg.solve(root, design / expected[:, None])
        normal = relative.T @ relative
        squares = np.linalg.solve(normal, relative.T @ np.linalg.solve(root, variance / expected))
        if (squares <= 0.0).any():
            return None
        expected = design @ squares
    left = np.linalg.solve(root, variance / expected - 1.0)
    # the logarithm of the determinant keeps too large a fit from looking good
    chi2 = float(left @ left) + 2.0 * float(np.log(expected).sum())
    return _Fit(names, squares, np.linalg.inv(normal), chi2)


def _estimate(name: str, fit: _Fit, tau: Array, unit: str) -> Estimate:
    term = TERMS[name]
    if name not in fit.names:
        finding = f"not identified: the curve needs no slope {term.slope}"
        return Estimate(None, unit + term.unit, finding=finding)
    led = _octaves_led(name, fit, tau)
    if led < OCTAVES_LED:
        finding = (
            f"not identified: slope {term.slope} leads over {led:.1f} octaves only, "
            f"{OCTAVES_LED:g} are wanted"
        )
        return Estimate(None, unit + term.unit, finding=finding)
    at = fit.names.index(name)
    square, error = float(fit.squares[at]), float(fit.covariance[at, at]) ** 0.5
    relative = _Z * error / (2.0 * square)  # of the coefficient, in logarithm
    value = square**0.5
    lower, upper = value * math.exp(-relative), value * math.exp(relative)
    return Estimate(value, unit + term.unit, lower, upper, 2.0 * (square / error) ** 2)


def _octaves_led(name: str, fit: _Fit, tau: Array) -> float:
    """Octaves of averaging time where a term is the largest."""
    fine = np.geomspace(tau[0], tau[-1], 400)
    parts = np.stack(
        [s * TERMS[n].variance(fine) for n, s in zip(fit.names, fit.squares, strict=True)]
    )
    leads = parts.argmax(axis=0) == fit.names.index(name)
    return float(leads.mean() * np.log2(tau[-1] / tau[0]))
