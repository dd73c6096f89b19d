"""Stepwise regression, forward and back, by BIC and by extended BIC."""

from __future__ import annotations

from math import comb, log

import numpy as np

from rivals.dictionary import Dictionary, Floats

NEW = 0.02
"""Part of a column that must be new beside those chosen."""

MOST = 8


def stepwise(given: Dictionary, *, extended: bool) -> list[int]:
    """Choose columns, in the order in which they come in.

    Parameters
    ----------
    given : Dictionary
        The columns.
    extended : bool
        Whether a model also pays for the number of models of its size (Chen and Chen 2008,
        gamma = 1).

    Returns
    -------
    list of int
        Places of the columns.
    """
    chosen: list[int] = []
    score = _score(given, chosen, extended=extended)
    while len(chosen) < MOST:
        larger = [*chosen, _next(given, chosen)]
        better = _score(given, larger, extended=extended)
        if better >= score:
            break
        chosen, score = _pruned(given, larger, better, extended=extended)
    return chosen


def _pruned(
    given: Dictionary, chosen: list[int], score: float, *, extended: bool
) -> tuple[list[int], float]:
    """Drop columns, the last one excepted, as long as that is better."""
    for place in chosen[:-1]:
        fewer = [other for other in chosen if other != place]
        lower = _score(given, fewer, extended=extended)
        if lower < score:
            return _pruned(given, fewer, lower, extended=extended)
    return chosen, score


def _next(given: Dictionary, chosen: list[int]) -> int:
    basis = _basis(given, chosen)
    left = given.columns - basis @ (basis.T @ given.columns)
    length = np.linalg.norm(left, axis=0)
    gain = np.where(length > NEW, np.abs(given.reading @ left) / np.maximum(length, NEW), 0.0)
    return int(np.argmax(gain))


def _score(given: Dictionary, chosen: list[int], *, extended: bool) -> float:
    basis, size = _basis(given, chosen), len(chosen)
    squares = float(given.reading @ given.reading - np.sum((basis.T @ given.reading) ** 2))
    paid = size * log(given.freedom)
    if extended:
        paid += 2.0 * log(comb(given.columns.shape[1], size))
    return given.freedom * log(squares / given.freedom) + paid


def _basis(given: Dictionary, chosen: list[int]) -> Floats:
    return np.linalg.qr(given.columns[:, chosen])[0]
