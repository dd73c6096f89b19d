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
from dataclasses import dataclass, replace
from itertools import combinations
from types import MappingProxyType

import numpy as np

from accelcal.arrays import Array
from accelcal.numerics.probability import NORMAL_FACTOR
from accelcal.results.stability import AllanDeviation, Estimate

__all__ = ["TERMS", "NoiseTerm", "noise_terms"]

OCTAVES_LED = 2.0
"""Octaves of averaging time over which a term must be the largest one."""

_WORTH_A_TERM = 6.63  # chi-squared of one degree of freedom at 1 %
_FREQUENCIES = 8192
_STEPS = 8
_KNOWN_TO = 1e-3  # relative, of an Allan variance
_FLAT = 2.0 * math.log(2.0) / math.pi
_FEWEST_POINTS = 4


def _step(frequency: Array) -> Array:
    """Squared gain of the difference of neighbouring samples."""
    return np.asarray(4.0 * np.sin(math.pi * frequency) ** 2)


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
    spectrum : callable
        Two-sided spectral density, per cycle a sample, at a frequency [cycles a sample] and an
        interval between samples [s]; 0 for a ramp, which is not random.
    """

    name: str
    slope: str
    unit: str
    variance: Callable[[Array], Array]
    spectrum: Callable[[Array, float], Array]


TERMS: Mapping[str, NoiseTerm] = MappingProxyType(
    {
        "Q": NoiseTerm(
            "quantisation", "-1", "*s", lambda tau: 3.0 / tau**2, lambda f, dt: _step(f) / dt**2
        ),
        "N": NoiseTerm(
            "white noise",
            "-1/2",
            "/sqrt(Hz)",
            lambda tau: 1.0 / tau,
            lambda f, dt: np.full_like(f, 1.0 / dt),
        ),
        "B": NoiseTerm(
            "bias instability",
            "0",
            "",
            lambda tau: np.full_like(tau, _FLAT),
            lambda f, _dt: 0.5 / (math.pi * f),
        ),
        "K": NoiseTerm(
            "random walk", "+1/2", "/sqrt(s)", lambda tau: tau / 3.0, lambda f, dt: dt / _step(f)
        ),
        "R": NoiseTerm(
            "ramp", "+1", "/s", lambda tau: 0.5 * tau**2, lambda f, _dt: np.zeros_like(f)
        ),
    }
)
"""Symbol -> term; IEEE 1293 and IEEE 952 use the same ones."""


@dataclass(frozen=True, slots=True)
class _Curve:
    tau: Array
    variance: Array
    products: Array  # see `_products`

    def root(self, names: tuple[str, ...], squares: Array, expected: Array) -> Array:
        """Cholesky factor of the covariance of the variances at coefficients."""
        at = [list(TERMS).index(name) for name in names]
        own = self.products[np.ix_(at, at)]
        covariance = np.einsum("i,j,ijkl->kl", squares, squares, own)
        # A floor: a record without noise still has rounding errors, and keeps the matrix definite.
        floor = (_KNOWN_TO * np.maximum(expected, self.variance)) ** 2
        return np.linalg.cholesky(covariance + np.diag(floor))


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
        identified, and its limits are what the curve allows it to be.

    Notes
    -----
    The Allan variance is a sum of the terms with coefficients not below 0. Of all sums, the one
    with the least chi-squared is taken, where each term has to lower it by 6.63 (1 %). A term of
    that sum is identified where it is the largest one over at least `OCTAVES_LED` octaves. The
    variances at all averaging times come from the same samples; their covariance is that of
    Gaussian noise with the spectrum of the terms, over the numbers of second differences.

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
        finding = f"{tau.size} averaging times; at least {_FEWEST_POINTS} octaves are needed"
        return {name: Estimate(None, unit + t.unit, finding=finding) for name, t in TERMS.items()}
    best = _best_fit(_Curve(tau, variance, _products(tau, np.array(allan.count))))
    found = {name: _estimate(name, best, tau, unit) for name in TERMS}
    return {name: _limited(name, told, allan) for name, told in found.items()}


def _limited(name: str, told: Estimate, allan: AllanDeviation) -> Estimate:
    """Limits of a term without value: at no averaging time is it larger than the whole curve."""
    if told.value is not None:
        return told
    highest = np.array(allan.upper) ** 2 / TERMS[name].variance(np.array(allan.tau_s))
    return replace(told, lower=0.0, upper=float(highest.min()) ** 0.5)


def _products(tau: Array, count: Array) -> Array:
    """Covariance of the Allan variances by pairs of terms, shape (terms, terms, taus, taus).

    An Allan variance is the power behind the filter |H|^2 = 2 sin^4(pi f m) / (m sin(pi f))^2, and
    of Gaussian noise two such powers have the covariance 2/n times the integral of H^2 H'^2 S^2.
    """
    factor = np.round(tau / tau[0])
    edges = np.geomspace(0.01 / factor[-1], 0.5, _FREQUENCIES)
    f, width = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    gain = 8.0 * np.sin(math.pi * f * factor[:, None]) ** 4 / (factor[:, None] ** 2 * _step(f))
    gain *= np.sqrt(4.0 * width / count[:, None])  # both signs of the frequency
    spectra = [term.spectrum(f, float(tau[0])) for term in TERMS.values()]
    found = np.array([[(gain * one * other) @ gain.T for other in spectra] for one in spectra])
    mean = tau[:, None] * np.sqrt(width) * _mean_gain(f, factor, count)
    ramp = list(TERMS).index("R")
    found[ramp] = found[:, ramp] = [(mean * one) @ mean.T for one in spectra]
    return found


def _mean_gain(f: Array, factor: Array, count: Array) -> Array:
    """Gain of the mean of the differences of neighbouring averages, shape (taus, frequencies).

    A ramp adds the same to all of them, so that of its product with the noise the mean counts. The
    sum over n differences, of m samples each, of a piece is a filter sin(pi f n) / sin(pi f) behind
    that of one of them. Pieces are as many as differences get less by two a sample.
    """
    pieces = max((count[0] - count[1]) / (2.0 * (factor[1] - factor[0])), 1.0)
    n, m = (count / pieces)[:, None], factor[:, None]
    one = 2.0 * np.sin(math.pi * f * m) ** 2 / np.sin(math.pi * f)
    return np.asarray(one * np.sin(math.pi * f * n) / (np.sin(math.pi * f) * n * m * pieces**0.5))


def _best_fit(curve: _Curve) -> _Fit:
    most = min(len(TERMS), curve.tau.size - 1)
    subsets = [names for n in range(1, most + 1) for names in combinations(TERMS, n)]
    fits = [fit for names in subsets if (fit := _fit(names, curve))]
    return min(fits, key=lambda fit: fit.chi2 + _WORTH_A_TERM * len(fit.names))


def _fit(names: tuple[str, ...], curve: _Curve) -> _Fit | None:
    """Generalised least squares on the variances; None where a coefficient is not above 0."""
    design = np.stack([TERMS[name].variance(curve.tau) for name in names], axis=1)
    start = np.linalg.lstsq(design / curve.variance[:, None], np.ones(curve.tau.size))[0]
    squares = np.asarray(start, dtype=np.float64)
    for _ in range(_STEPS):
        squares = np.maximum(squares, 0.0)
        root = curve.root(names, squares, design @ squares)
        scaled = np.linalg.solve(root, design)
        normal = scaled.T @ scaled
        right = scaled.T @ np.linalg.solve(root, curve.variance)
        squares = np.asarray(np.linalg.solve(normal, right), dtype=np.float64)
    if (squares <= 0.0).any():
        return None
    left = np.linalg.solve(root, curve.variance - design @ squares)
    # The covariance grows with the fit. Without the logarithm of its determinant, as the likelihood
    # has it, a fit that is too large would look good.
    chi2 = float(left @ left) + 2.0 * float(np.log(np.diagonal(root)).sum())
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
            f"{OCTAVES_LED:g} are needed"
        )
        return Estimate(None, unit + term.unit, finding=finding)
    at = fit.names.index(name)
    square, error = float(fit.squares[at]), float(fit.covariance[at, at]) ** 0.5
    relative = NORMAL_FACTOR * error / (2.0 * square)  # of the logarithm of the root
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
