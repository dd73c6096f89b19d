"""Overlapping Allan deviation with noise identification and intervals, by allantools."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array
from accelcal.errors import not_installed
from accelcal.results.stability import AllanDeviation

__all__ = ["octaves", "overlapping_allan"]

_Row = tuple[float, float, float, float, float, int, int]

FEWEST_MEANS = 5
"""Averaging times go up to this part of the longest piece."""

_ENOUGH_TO_IDENTIFY = 30
_ENOUGH_TO_BE_SURE = 128
"""Means whose correlation tells the noise by itself; that of 30 means of white noise is every
fourth time that of another noise."""


def octaves(pieces: Sequence[Array]) -> list[int]:
    """Averaging factors 1, 2, 4, ... that a series bears.

    Parameters
    ----------
    pieces : sequence of ndarray
        Pieces of evenly spaced samples.

    Returns
    -------
    list of int
        Numbers of samples, up to a fifth of the longest piece.

    Examples
    --------
    >>> octaves([np.zeros(100)])
    [1, 2, 4, 8, 16]
    """
    longest = max((piece.size for piece in pieces), default=0)
    return [2**k for k in range(60) if 2**k * FEWEST_MEANS <= longest]


def overlapping_allan(
    pieces: Sequence[ArrayLike],
    interval: float = 1.0,
    *,
    factors: Sequence[int] | None = None,
    level: float = 0.95,
) -> AllanDeviation:
    """Overlapping Allan deviation of a series in one or several pieces.

    Parameters
    ----------
    pieces : sequence of array_like
        Pieces of evenly spaced samples, such as launches or the parts between gaps.
    interval : float, default 1
        Time between samples [s].
    factors : sequence of int, optional
        Averaging factors; by default octaves.
    level : float, default 0.95
        Probability of the intervals.

    Returns
    -------
    AllanDeviation
        An entry for each factor that has a second difference.

    Raises
    ------
    InputError
        If allantools is not installed.

    Notes
    -----
    `allantools.oadev` evaluates each piece. Pieces are pooled by their numbers of second
    differences, none of which reaches over a gap. The noise is identified by the lag-1
    autocorrelation of the longest piece (Riley, `allantools.autocorr_noise_id`) as long as 30
    means are left, and taken from the last such time beyond. Of a sum of noises the one with the
    smaller exponent prevails at the longer time, so that with less than 128 means a larger exponent
    than before is chance, and not taken. The equivalent degrees of freedom are
    those of Greenhall and Riley (`allantools.edf_greenhall`), added over the pieces, and the limits
    those of chi-squared (NIST SP 1065, eq. 45).

    Examples
    --------
    >>> white = np.random.default_rng(1).normal(size=1000)
    >>> result = overlapping_allan([white])
    >>> result.tau_s[:3], result.alpha[:3]
    ((1.0, 2.0, 4.0), (0, 0, 0))
    """
    tools = _allantools()
    series = [np.asarray(piece, dtype=np.float64) for piece in pieces]
    chosen = octaves(series) if factors is None else [int(factor) for factor in factors]
    rows: list[_Row] = []
    alpha: int | None = None
    longest = max(series, key=lambda piece: piece.size, default=np.zeros(0))
    for factor in chosen:
        parts = [_one_piece(tools, piece, factor, interval) for piece in series]
        count = sum(number for _, number in parts)
        if not count:
            continue
        alpha = _noise(tools, longest, factor, alpha)
        dev = float(np.sqrt(sum(n * v for v, n in parts) / count))
        with_any = [piece.size + 1 for piece, (_, n) in zip(series, parts, strict=True) if n]
        edf = sum(_edf(tools, alpha, factor, size) for size in with_any)
        lower, upper = tools.confidence_interval(dev, edf, level)
        rows.append((factor * interval, dev, float(lower), float(upper), edf, count, alpha))
    return _columns(rows, level)


def _columns(rows: list[_Row], level: float) -> AllanDeviation:
    if not rows:
        return AllanDeviation()
    tau, deviation, lower, upper, edf, count, alpha = zip(*rows, strict=True)
    return AllanDeviation(tau, deviation, lower, upper, edf, count, alpha, level)


def _allantools() -> Any:
    try:
        import allantools  # type: ignore[import-untyped]
    except ImportError:
        raise not_installed("the Allan deviation", "allantools", "stability") from None
    return allantools


def _one_piece(tools: Any, piece: Array, factor: int, interval: float) -> tuple[float, int]:
    """Allan variance of a piece and its number of second differences."""
    if piece.size + 1 - 2 * factor < 2:
        return 0.0, 0
    taus = [factor * interval]
    _, dev, _, count = tools.oadev(piece, rate=1.0 / interval, data_type="freq", taus=taus)
    return (float(dev[0]) ** 2, int(count[0])) if len(dev) else (0.0, 0)


def _noise(tools: Any, piece: Array, factor: int, before: int | None) -> int:
    """Exponent of the noise: from the samples, from the factor before, or white."""
    known = 0 if before is None else before
    if piece.size // factor < _ENOUGH_TO_IDENTIFY or np.ptp(piece) == 0.0:
        return known
    found = int(min(max(tools.autocorr_noise_id(piece, factor, data_type="freq")[0], -2), 2))
    is_sure = before is None or piece.size // factor >= _ENOUGH_TO_BE_SURE
    return found if is_sure else min(found, known)


@lru_cache(1024)
def _edf(tools: Any, alpha: int, factor: int, size: int) -> float:
    """Equivalent degrees of freedom of a piece with `size` points of the integrated output."""
    try:
        edf = tools.edf_greenhall(alpha, 2, factor, size, overlapping=True)
    except NotImplementedError:
        edf = tools.edf_simple(size, factor, alpha)
    return max(float(edf), 1.0)
