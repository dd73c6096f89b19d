"""Temperature laws with their 95 % bands."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.propagation import interval_of_parts, propagated
from accelcal.results.temperature import TemperatureModel

_PARTS = ("at_T0", "above", "below")


def law_and_band(model: TemperatureModel, name: str, rise: Array) -> tuple[Array, Array] | None:
    """Work out the law of ``"k0"``, ``"K1"`` or ``"delta"`` at T - T0, shape (n,), and its band.

    That is the law, NaN on a side whose slope is not determined, and the half width of its 95 %
    interval; of K1 the change from T0, both over K1 at T0. It is None where there is no value at
    T0.
    """
    law = model.laws[name]
    if law.at_T0 is None or law.at_T0.value is None:
        return None
    columns = np.stack([np.ones(rise.size), rise.clip(min=0.0), rise.clip(max=0.0)])
    values = [0.0 if (q := getattr(law, part)) is None else q.value or 0.0 for part in _PARTS]
    scale = 1.0
    if name == "K1":
        scale, values[0] = law.at_T0.value, 0.0
    middle = np.asarray(values) @ columns
    if name == "K1":
        columns[0] += middle  # the relative error of K1N is one of the whole scale factor
    half = _half_width(model, name, columns, scale)
    middle[((law.above is None) & (rise > 0.0)) | ((law.below is None) & (rise < 0.0))] = np.nan
    return middle, half


def _half_width(model: TemperatureModel, name: str, columns: Array, scale: float) -> Array:
    """Half width of the band, from the covariance of value and slopes."""
    place = {told: i for i, told in enumerate(model.covariance_names)}
    names = [f"{name} {part}" for part in _PARTS]
    known = [i for i, part in enumerate(names) if part in place]
    own = [place[names[i]] for i in known]
    blocks = np.zeros((2, 3, 3))
    for block, whole in zip(blocks, (model.covariance, model.over_dof), strict=True):
        block[np.ix_(known, known)] = whole[np.ix_(own, own)]
    units = np.array([1.0 / scale, 1.0, 1.0])
    parts = [getattr(model.laws[name], part) for part in _PARTS]
    if all(part is None or part.coverage_factor is None for part in parts):
        return np.zeros(columns.shape[1])
    covariance, over_dof = blocks * np.outer(units, units)
    found = propagated(covariance, over_dof, list(columns))
    return np.asarray(interval_of_parts([found]).expanded)
