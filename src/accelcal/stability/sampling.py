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
