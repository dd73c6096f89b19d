"""Effects that a test shows as one and the same, or nearly."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.candidates import Candidates
from accelcal.discovery.spans import orthonormal

EXACT = 0.999
"""Principal cosine above which two effects are one and the same for a test."""

NEAR = 0.9
"""Principal cosine above which two effects are hard to tell apart."""


class Aliases(NamedTuple):
    """Effects that a test shows as the same as one effect."""

    id: str
    exact: tuple[str, ...]  # others whose principal cosine with it is above `EXACT`
    near: tuple[tuple[str, float], ...]  # others above `NEAR`, with their cosines, largest first


def aliases(found: Candidates) -> tuple[Aliases, ...]:
    """Find which effects a test shows as the same, for each that can be seen."""
    names = [effect.id for effect in found.effects]
    spans, table = _spans(found), []
    for place, name in enumerate(names):
        row = _cosines(found, place, spans)
        others = [pair for pair in zip(names, row, strict=True) if pair[0] != name]
        near = sorted((pair for pair in others if NEAR < pair[1] <= EXACT), key=lambda p: -p[1])
        exact = tuple(other for other, cosine in others if cosine > EXACT)
        table.append(Aliases(name, exact, tuple(near)))
    return tuple(table)


def _cosines(found: Candidates, place: int, spans: Sequence[Array]) -> list[float]:
    """Largest principal cosines between the instances of one effect and of each, E values.

    Where both effects have a sign, opposite ones are not alike. The phases of several amplitudes
    are one span.
    """
    signed = [effect.amplitudes[0].minimum == 0.0 for effect in found.effects]
    one = spans[place].transpose(0, 2, 1)[:, None]
    cosines = []
    for number, other in enumerate(spans):
        products = one @ other[None]
        if products.shape[2:] != (1, 1):
            products = np.linalg.norm(products, ord=2, axis=(2, 3))
        elif not (signed[place] and signed[number]):
            products = np.abs(products)
        cosines.append(1.0 if number == place else float(products.max()))
    return cosines


def _spans(found: Candidates) -> list[Array]:
    """For each effect the spans of its instances of one shape, (shapes, m, dimensions)."""
    spans = []
    for number, effect in enumerate(found.effects):
        own = np.flatnonzero(found.owner == number)
        if len(effect.amplitudes) == 1:
            spans.append(found.directions[:, own].T[:, :, None])
            continue
        shapes = groupby(own, key=lambda i: dict(found.instances[i].shape))
        spans.append(
            np.stack([orthonormal(found.directions[:, list(places)]) for _, places in shapes])
        )
    return spans
