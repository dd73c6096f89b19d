"""Scale factor and bias that drift anew in each run, as in a chamber that has not settled.

Without a second temperature nobody knows what a degree does to them, so that no entry of the
catalogue says what a drift of the chamber looks like: it is told as what it does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import dummies
from accelcal.discovery.explanation import CONTRADICTION, chance_beside
from accelcal.discovery.family import Family, agrees
from accelcal.discovery.spans import orthonormal, squares_in
from accelcal.results.findings import Unexplained
from accelcal.units import HOUR, MICRO

_SCALE, _BIAS = "the scale factor", "the bias"
_UNITS = {_SCALE: "ppm/h", _BIAS: "ug/h"}


def drift_anew(family: Family, alpha: float) -> Unexplained | None:
    """Find drifts of them from the start of each run that leave nothing but noise, if needed.

    They have one rate in all runs, else one in each, which takes both of them. There is none in a
    record of one run, where entries of the catalogue say as much, nor where the temperature slopes
    are known, which the chamber's has.
    """
    c, labels = family.comparison.model.conditions, family.comparison.record.run_labels
    if len(labels) < 2 or c.per_degree.any():
        return None
    time = (c.gain * c.run_time / HOUR)[:, None]
    bias, scale = time, time * c.indicated[:, None]
    runs = dummies(c.run)
    for columns in (
        {_SCALE: scale},
        {_SCALE: scale, _BIAS: bias},
        {_SCALE: runs * scale, _BIAS: runs * bias},
    ):
        p_value = _chance(family, list(columns.values()), alpha)
        if p_value is not None:
            return _told(family, columns, p_value)
    return None


def _chance(family: Family, columns: Sequence[Array], alpha: float) -> float | None:
    """Largest chance of noise of one beside the others; None where they do not explain all."""
    space = family.space
    shown = [space.see(each) for each in columns]
    if not agrees(family, orthonormal(np.hstack(shown)), CONTRADICTION * alpha):
        return None
    largest = 0.0
    for place, own in enumerate(shown):
        others = orthonormal(np.hstack([space.nothing(), *shown[:place], *shown[place + 1 :]]))
        largest = max(largest, chance_beside(family.comparison, own, others) * family.tests)
    return largest if largest < alpha else None


def _told(family: Family, columns: Mapping[str, Array], p_value: float) -> Unexplained:
    space, seen = family.space, family.comparison.seen
    shown = space.see(np.hstack(list(columns.values())))
    sizes = np.linalg.lstsq(shown, seen, rcond=None)[0] * MICRO
    rates = " and ".join(
        f"{what} drifts by {', '.join(f'{size:.3g}' for size in own)} {_UNITS[what]}"
        for what, own in zip(columns, np.split(sizes, len(columns)), strict=True)
    )
    runs = "" if sizes.size == len(columns) else ", in the order of the runs"
    return Unexplained(
        f"{rates}, anew from the start of each run{runs}, as in a chamber that has not settled or a"
        " unit that warms up; runs at another temperature, or the actual temperature of each"
        " reading, would tell",
        squares_in(orthonormal(shown), seen) / float(seen @ seen),
        p_value,
    )
