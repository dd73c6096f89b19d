"""Even series out of real ones: gaps, missing samples and irregular times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.plural import counted
from accelcal.stability.record import Launch

JITTER = 0.1
"""Part of the interval by which a sample may be off its time."""

LONGEST_FILLED = 5
"""Missing samples in a row that a straight line may stand for."""

MOST_FILLED = 0.01
"""Part of the samples that may be filled in."""

_GAP = LONGEST_FILLED + 1.5
_UNEVEN = 0.5
"""Excess of the variance by spans of unequal numbers of samples, times the root of their number:
white noise is then too large by half its standard uncertainty or less."""
_KEPT = 0.9
"""Part of the samples that wider spans must keep."""


class EvenSeries(NamedTuple):
    """Pieces of evenly spaced samples.

    Attributes
    ----------
    interval : float
        Time between samples [s].
    pieces : tuple of ndarray
        The pieces, in their order.
    notes : tuple of str
        What was done to get them.
    """

    interval: float
    pieces: tuple[Array, ...]
    notes: tuple[str, ...]


class _Piece(NamedTuple):
    """Evenly spaced output, how many samples it was made of, and how many in each span."""

    output: Array
    samples: int
    in_spans: Array


def even_series(launches: Sequence[Launch]) -> EvenSeries:
    """Cut launches into pieces of evenly spaced samples.

    Parameters
    ----------
    launches : sequence of Launch
        The launches.

    Returns
    -------
    EvenSeries
        One piece a launch where nothing is missing.

    Notes
    -----
    Samples on a common raster stay as they are. A few missing ones, at most `MOST_FILLED` of all
    and `LONGEST_FILLED` in a row, are filled in by a straight line; a longer gap ends the piece.
    Samples off the raster are averaged over equal spans, each wide enough to hold at least one. A
    mean of n samples of white noise has a variance by 1/n, and the mean of 1/n exceeds one over
    the mean n: spans are doubled until that matters little.

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
    ratio = steps / interval
    inside = ratio <= _GAP
    gaps = int(np.sum(~inside))
    notes = [f"{counted(gaps, 'gap')}: the series is cut there"] if gaps else []
    if np.all(np.abs(ratio[inside] - np.round(ratio[inside])) <= JITTER):
        missing = int(np.sum(np.round(ratio[inside]) - 1))
        longest = LONGEST_FILLED if missing <= MOST_FILLED * steps.size else 0
        if missing:
            done = "filled in by a straight line" if longest else "taken as gaps"
            notes.append(f"{counted(missing, 'missing sample')} in short gaps: {done}")
        filled = [p for launch in launches for p in _on_raster(launch, interval, longest + 1.5)]
        return _series(interval, filled, notes, launches)
    shortest = float(steps[inside].max()) * (1.0 + 1e-9)
    width, spans = _even_enough(launches, shortest, _GAP * interval)
    notes.append(f"irregular times: averaged over spans of {width:.4g} s")
    return _series(width, spans, notes, launches)


def _series(
    interval: float, pieces: Sequence[_Piece], notes: list[str], launches: Sequence[Launch]
) -> EvenSeries:
    """Even series with a note of the samples that are in no piece."""
    total = sum(launch.time.size for launch in launches)
    lost = total - sum(piece.samples for piece in pieces)
    if lost:
        where = "in pieces shorter than three means, or in the last span of a piece"
        notes.append(f"{lost} of {counted(total, 'sample')} not used, {where}")
    return EvenSeries(interval, tuple(piece.output for piece in pieces), tuple(notes))


def _pieces(launch: Launch, longest: float) -> list[tuple[Array, Array]]:
    """Time and output of a launch, cut where a step is longer."""
    cuts = np.flatnonzero(np.diff(launch.time) > longest) + 1
    pairs = zip(np.split(launch.time, cuts), np.split(launch.output, cuts), strict=True)
    return [(time, output) for time, output in pairs if time.size >= 3]


def _on_raster(launch: Launch, interval: float, steps: float) -> list[_Piece]:
    even = []
    for time, output in _pieces(launch, steps * interval):
        place = np.concatenate([[0.0], np.cumsum(np.round(np.diff(time) / interval))])
        output = np.interp(np.arange(place[-1] + 1.0), place, output)
        even.append(_Piece(output, time.size, np.ones(output.size)))
    return even


def _even_enough(
    launches: Sequence[Launch], width: float, longest: float
) -> tuple[float, list[_Piece]]:
    """Means over spans of that width, or of wider ones whose numbers of samples are alike."""
    spans = [piece for launch in launches for piece in _in_spans(launch, width, longest)]
    samples = np.concatenate([np.zeros(0), *(piece.in_spans for piece in spans)])
    if not samples.size:
        return width, spans
    excess = float(samples.mean() * (1.0 / samples).mean()) - 1.0
    if excess <= _UNEVEN / samples.size**0.5:
        return width, spans
    wider = _even_enough(launches, 2.0 * width, longest)
    kept = sum(piece.samples for piece in wider[1]) >= _KEPT * samples.sum()
    return wider if kept else (width, spans)


def _in_spans(launch: Launch, width: float, longest: float) -> list[_Piece]:
    even = []
    for time, output in _pieces(launch, longest):
        span = np.floor((time - time[0]) / width).astype(np.int64)
        count = np.bincount(span)
        means = np.bincount(span, weights=output) / np.maximum(count, 1)
        whole = count[:-1].astype(np.float64)  # the last span is not complete
        even.append(_Piece(means[:-1], int(whole.sum()), whole))
    return [piece for piece in even if piece.output.size >= 3]
