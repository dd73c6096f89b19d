"""Parameters of effects that are found, estimated together, with their uncertainties."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance
from accelcal.discovery.spans import scaled
from accelcal.discovery.tied import quantities
from accelcal.discovery.untold import Sizes, Untold, fitted_sizes, not_shown, slopes_of
from accelcal.effects.parameter import Parameter
from accelcal.numerics.probability import LEVEL, NORMAL_FACTOR, student_quantile
from accelcal.results.quantity import Quantity


def parameters_of(
    comparison: Comparison, instances: Sequence[Instance], *, ranges: bool = True
) -> tuple[dict[str, Quantity], ...]:
    """Estimate all parameters of each of some effects together.

    The number of a reading or of a position has no uncertainty. An amplitude that the base model
    takes up, as K0 and K2 take one of the two of an eccentricity, has no value.

    Notes
    -----
    Amplitudes by linear least squares in the space that the base model leaves; uncertainties of all
    parameters together from the derivatives by the nonlinear ones at the solution. Those that the
    readings do not tell are held, and without `ranges` they add no uncertainty to the others. What
    coefficients tell is estimated from them.
    """
    open_ones = not_shown(comparison, instances)
    held = {(one.place, one.parameter.name): one for one in open_ones}
    sizes = fitted_sizes(comparison, instances)
    of_sizes, of_shapes = _standard_uncertainties(comparison, instances, sizes, held)
    for one in (one for one in open_ones if ranges and not one.tied):
        below, above = (fitted_sizes(comparison, end).whole for end in one.ends(instances))
        of_sizes = np.hypot(of_sizes, (above - below) / 2.0)
    told, dof = iter(of_sizes.tolist()), comparison.space.dof
    found = []
    for place, (item, size) in enumerate(zip(instances, sizes.of_each, strict=True)):
        own = {
            p.name: _quantity(p, value, next(told), dof)
            for p, value in zip(item.amplitudes, size.tolist(), strict=True)
        }
        for p in item.effect.shapes:
            open_one = held.get((place, p.name))
            u = of_shapes.get((place, p.name))
            own[p.name] = _held(open_one) if open_one else _quantity(p, item.shape[p.name], u, dof)
        found.append(own)
    for one in (one for one in open_ones if one.tied):
        found[one.place] |= quantities(comparison, instances, one)
    return tuple(found)


def _standard_uncertainties(
    comparison: Comparison,
    instances: Sequence[Instance],
    sizes: Sizes,
    held: Collection[tuple[int, str]],
) -> tuple[Array, dict[tuple[int, str], float]]:
    """Those of the amplitudes, and of the nonlinear parameters that are smooth and not held."""
    smooth = [
        (place, p.name)
        for place, item in enumerate(instances)
        for p in item.effect.shapes
        if not p.discrete
    ]
    free = [one not in held for one in smooth]
    slopes = np.hstack(slopes_of(comparison, instances, sizes))[:, np.flatnonzero(free)]
    told = standard_uncertainties(np.hstack([sizes.linear[:, sizes.shown], slopes]))
    count = np.count_nonzero(sizes.shown)
    uncertainty = np.full(sizes.shown.size, np.nan)
    uncertainty[sizes.shown] = told[:count]
    names = [one for one, is_free in zip(smooth, free, strict=True) if is_free]
    return uncertainty, dict(zip(names, told[count:].tolist(), strict=True))


def _held(one: Untold) -> Quantity:
    """A parameter that the readings do not tell: it lies where it can."""
    widest = max(one.highest - one.value, one.value - one.lowest)
    half = min(NORMAL_FACTOR * one.spread, widest)
    return Quantity(one.value, one.spread, one.parameter.unit, half)


def _quantity(parameter: Parameter, value: float, uncertainty: float | None, dof: int) -> Quantity:
    if uncertainty is None:
        return Quantity(value, None, parameter.unit)
    if np.isnan(uncertainty):
        return Quantity(None, None, parameter.unit)
    half = student_quantile(LEVEL, dof) * uncertainty
    return Quantity(value, uncertainty, parameter.unit, half, float(dof))


def standard_uncertainties(derivatives: Array) -> Array:
    """Standard uncertainties of the unknowns of a least-squares fit with noise of variance 1."""
    units, norms = scaled(derivatives)
    inverse = np.linalg.pinv(units)
    return np.asarray(np.sqrt((inverse**2).sum(axis=1)) / norms)
