"""A disagreement that no effect explains, taken up by terms of its own."""

from __future__ import annotations

import numpy as np

from accelcal.discovery.explanation import Explanation
from accelcal.discovery.family import Family, judge
from accelcal.discovery.instance import Instance
from accelcal.discovery.spans import orthonormal, squares_in
from accelcal.effects.effect import Effect
from accelcal.effects.empirical import FACTORS, empirical
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import grouped

_NEEDED = 0.01


def empirical_explanation(family: Family) -> Explanation | None:
    """Explain a disagreement by terms of the head position that have no other cause.

    There is one for each factor that needs it, the worst first; None where none can have one.
    """
    comparison, space, seen = family.comparison, family.space, family.comparison.seen
    c = comparison.model.conditions
    angles = grouped(head_positions(c.angle))[0]
    terms: list[Effect] = []
    columns, p_values = space.nothing(), []
    for _ in FACTORS:
        judged = judge(family, orthonormal(columns) if terms else None)
        p, factor = min(
            (float(p), block.factor)
            for block, p in zip(family.blocks, judged.blocks, strict=True)
            if block.factor in FACTORS
        )
        if p * family.tests >= _NEEDED:
            break
        terms.append(empirical(factor, angles.tolist()))
        columns = np.hstack([columns, space.see(c.gain[:, None] * terms[-1].columns(c))])
        p_values.append(p)
    if not terms:
        return None
    sizes = np.linalg.lstsq(columns, seen, rcond=1e-6)[0].reshape(len(terms), -1)
    mixtures = sizes / np.linalg.norm(sizes, axis=1, keepdims=True)
    instances = tuple(
        Instance(term, tuple(mixture), {})
        for term, mixture in zip(terms, mixtures.tolist(), strict=True)
    )
    directions = comparison.directions(*instances)
    squares = squares_in(orthonormal(directions), seen)
    return Explanation(instances, directions, squares, tuple(p_values), passes=False)
