"""Overlapping Allan deviation with noise identification and intervals, of even series."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array
from accelcal.errors import not_installed
from accelcal.plural import counted
from accelcal.results.stability import AllanDeviation
from accelcal.stability.record import Launch

__all__ = ["octaves", "overlapping_allan"]

JITTER = 0.1
"""Part of the interval by which a sample may be off its time."""

LONGEST_FILLED = 5
"""Missing samples in a row that a straight line may stand for."""

MOST_FILLED = 0.01
"""Part of the samples that may be filled in."""

_GAP = LONGEST_FILLED + 1.5


class EvenSeries(NamedTuple):
    """Pieces of evenly spaced samples."""

    interval: float  # time between samples [s]
    pieces: tuple[Array, ...]  # in their order
    notes: tuple[str, ...]  # what was done to get them


def even_series(launches: Sequence[Launch]) -> EvenSeries:
    """Cut launches into pieces of evenly spaced samples, one a launch where nothing is missing.

    Notes
    -----
    Samples on a common raster stay as they are. A few missing ones, at most `MOST_FILLED` of all
    and `LONGEST_FILLED` in a row, are filled in by a straight line; a longer gap ends the piece.
    Samples off the raster are taken as evenly spaced at their mean interval, each brought to its
    time by the slope of its piece. White noise and a ramp stay what they are, and a random walk
    does on the average. Means over equal spans would hold unlike numbers of samples, which makes
    white noise too large.

    Examples
    --------
    >>> even_series([Launch("1", [0, 1, 2, 50, 51, 52], [1, 2, 1, 5, 6, 5])]).notes
    ('1 gap: the series is cut there',)
    """
    interval = float(np.median([launch.interval for launch in launches]))
    alike = [x for x in launches if abs(x.interval / interval - 1.0) <= 2.0 * JITTER]
    others = [x.label for x in launches if abs(x.interval / interval - 1.0) > 2.0 * JITTER]
    if alike and others:
        series = even_series(alike)
        note = f"launch {', '.join(others)}: left out, sampled at another interval"
        return series._replace(notes=(*series.notes, note))
    steps = np.concatenate([np.diff(launch.time) for launch in launches])
    inside = steps[steps <= _GAP * interval] / interval
    if np.all(np.abs(inside - np.round(inside)) <= JITTER):
        missing = int(np.sum(np.round(inside) - 1))
        longest = LONGEST_FILLED if missing <= MOST_FILLED * steps.size else 0
        notes = _of_gaps(steps.size - inside.size)
        if missing:
            done = "filled in by a straight line" if longest else "taken as gaps"
            notes.append(f"{counted(missing, 'missing sample')} in short gaps: {done}")
        pieces = _pieces(launches, (longest + 1.5) * interval)
        outputs = [_on_raster(*piece, interval) for piece in pieces]
    else:
        most = _GAP * interval * float(inside.mean())
        interval = float(steps[steps <= most].mean())
        notes = _of_gaps(int(np.sum(steps > most)))
        notes.append(f"irregular times: taken as even, {interval:.4g} s apart as on the average")
        pieces = _pieces(launches, most)
        outputs = [_evened(*piece, interval) for piece in pieces]
    total = sum(launch.time.size for launch in launches)
    if lost := total - sum(time.size for time, _ in pieces):
        samples = counted(total, "sample")
        notes.append(f"{lost} of {samples} not used, in pieces of fewer than three")
    return EvenSeries(interval, tuple(outputs), tuple(notes))


def _of_gaps(gaps: int) -> list[str]:
    return [f"{counted(gaps, 'gap')}: the series is cut there"] if gaps else []


def _pieces(launches: Sequence[Launch], longest: float) -> list[tuple[Array, Array]]:
    """Time and output of launches, cut where a step is longer; pieces of three or more."""
    found: list[tuple[Array, Array]] = []
    for launch in launches:
        cuts = np.flatnonzero(np.diff(launch.time) > longest) + 1
        found += zip(np.split(launch.time, cuts), np.split(launch.output, cuts), strict=True)
    return [(time, output) for time, output in found if time.size >= 3]


def _on_raster(time: Array, output: Array, interval: float) -> Array:
    place = np.concatenate([[0.0], np.cumsum(np.round(np.diff(time) / interval))])
    return np.interp(np.arange(place[-1] + 1.0), place, output)


def _evened(time: Array, output: Array, interval: float) -> Array:
    from_middle = time - time.mean()
    slope = from_middle @ output / (from_middle @ from_middle)
    late = interval * np.arange(time.size) - time
    return np.asarray(output + slope * (late - late.mean()))


def was_off(launch: Launch) -> str | None:
    """Say that a launch may be several, with the power off between them.

    By its longest pause, where it pauses longer than it was recorded; else None.

    Examples
    --------
    >>> was_off(Launch("1", [0, 1, 2, 100, 101, 102], [1, 2, 1, 5, 6, 5]))
    'launch 1 pauses for up to 98 s; if the unit was off, give the launch gap'
    """
    steps = np.diff(launch.time)
    if steps[steps > _GAP * np.median(steps)].sum() <= 0.5 * steps.sum():
        return None
    pause = f"launch {launch.label} pauses for up to {float(steps.max()):.3g} s"
    return f"{pause}; if the unit was off, give the launch gap"


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
