"""Parameters of effects that are found, estimated together, with their uncertainties.

Some nonlinear ones are told by coefficients of the model, where the readings alone do not. Levels
at 20, 50 and 80 degC show by how much the upper line of the bias lies off where the lower one
leads, and not at which temperature between 20 and 50 degC it breaks. As it breaks once, the change
of its slope there is that between the two lines, and they meet at the break.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import compress, pairwise
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import lengths, scaled
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance
from accelcal.discovery.solution import Solution, by_reading, solution
from accelcal.discovery.untold import (
    AS_WELL,
    Untold,
    fitted_sizes,
    not_shown,
    said_of_untold,
    slopes_of,
    smooth,
)
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
    places = [(n, p.name) for n, item in enumerate(instances) for p in smooth(item.effect)]
    free = [place not in held for place in places]
    slopes = np.hstack(slopes_of(comparison, instances, sizes))[:, np.flatnonzero(free)]
    uncertain = standard_uncertainties(np.hstack([sizes.linear[:, sizes.shown], slopes]))
    of_sizes, count = np.full(sizes.shown.size, np.nan), np.count_nonzero(sizes.shown)
    of_sizes[sizes.shown] = uncertain[:count]
    of_shapes = dict(zip(compress(places, free), uncertain[count:].tolist(), strict=True))
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


_BEYOND = 3.0
"""Standard uncertainties by which an amplitude that is tied may be off."""

_FOLLOWING = "both follow from the slopes, as of a law with no other break"
_OTHER_LAW = "no law with one break has the slopes of these, and so both have no U"
_ANYWHERE = (
    "a break anywhere between two levels would have the slopes of these, and so both have no U"
)
"""How a tied parameter and its amplitude are told."""

_NEAR = 1e-3
"""Part of the range next to zero, where the effect of a tied parameter vanishes."""


class _Tied(NamedTuple):
    """An amplitude, and what it is more than the coefficients make it."""

    comparison: Comparison
    fit: Solution
    weights: Array  # of the parameters of the fit in the two, (2, p)

    @property
    def holds(self) -> bool:
        """Whether the amplitude is no more and no less than the coefficients make it."""
        return bool(abs(self.values[1]) < _BEYOND * np.linalg.norm(self.varied[1]))

    @property
    def values(self) -> Array:
        """The two, shape (2,)."""
        return np.asarray(self.weights @ self.fit.parameters)

    @property
    def varied(self) -> Array:
        """What they vary by with each reading, in units of its noise, shape (2, n)."""
        return np.asarray(self.weights @ by_reading(self.comparison, self.fit))

    @classmethod
    def of(
        cls, comparison: Comparison, instances: Sequence[Instance], one: Untold, value: float
    ) -> _Tied:
        """Fit the model with a value of the parameter, and take the two from its parameters."""
        item = instances[one.place]
        fit = solution(comparison, one.at(instances, value))
        names = list(fit.model.names)
        weights = np.zeros((2, len(names)))
        weights[:, names.index(item.effect.id)] = item.mixture[0]
        for name, weight in item.effect.tie.items():
            weights[1, names.index(name)] -= weight
        return cls(comparison, fit, weights)


def settled(comparison: Comparison, instances: Sequence[Instance]) -> list[Instance]:
    """Move parameters that readings do not tell to where the amplitude is what the tie makes it.

    That may be so but for noise. One stays where it is if it is so nowhere among the values with
    which the effects explain the readings as well.
    """
    found = list(instances)
    has_ties = any(item.effect.tie for item in instances)
    for one in not_shown(comparison, instances) if has_ties else ():
        if one.tied:
            found[one.place] = _settled(comparison, found, one)
    return found


def said_of_not_shown(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[str]:
    """Say which parameters follow from coefficients, and which nothing tells."""
    for one in not_shown(comparison, instances):
        if not one.tied:
            yield said_of_untold(instances, one)
            continue
        effect, how = instances[one.place].effect, _estimate(comparison, instances, one).how
        names = f"{one.parameter.name} from {effect.amplitudes[0].name}"
        yield (
            f"{effect.id}: these readings alone do not tell {names}; {how}; to tell:"
            f" {effect.to_tell_apart}"
        )


def quantities(
    comparison: Comparison, instances: Sequence[Instance], one: Untold
) -> dict[str, Quantity]:
    """Estimate a tied parameter and its amplitude from the coefficients.

    They have no uncertainty where the tie does not hold, or holds wherever the parameter is.
    """
    told = _estimate(comparison, instances, one)
    value, shape = instances[one.place].amplitudes[0], one.parameter
    if told.varied is None:
        return {
            value.name: Quantity(told.amplitude, None, value.unit),
            shape.name: Quantity(one.value, None, shape.unit),
        }
    dof = float(comparison.space.dof)
    factor = student_quantile(LEVEL, dof)
    both = zip((value, shape), (told.amplitude, one.value), lengths(told.varied.T), strict=True)
    return {
        p.name: Quantity(float(x), float(u), p.unit, factor * float(u), dof) for p, x, u in both
    }


class _Estimate(NamedTuple):
    """An amplitude with its tied parameter, what both vary by, (2, n), and how they are told."""

    amplitude: float
    varied: Array | None
    how: str


def _estimate(comparison: Comparison, instances: Sequence[Instance], one: Untold) -> _Estimate:
    """Find what the tie tells of a parameter and its amplitude.

    Notes
    -----
    Where the excess e of the amplitude is zero, the parameter s varies with the readings by
    -de / (de/ds), and the amplitude a by da - (da/ds) de / (de/ds). The tie tells no s where it
    holds as well much farther off than that: beyond the last level but one any break does.
    """
    at = partial(_Tied.of, comparison, instances, one)
    tie = at(one.value)
    amplitude = float(tie.values[0])
    if not tie.holds:
        return _Estimate(amplitude, None, _OTHER_LAW)
    step = _NEAR * one.spread
    of_amplitude, of_excess = (at(one.value + step).values - at(one.value - step).values) / (
        2.0 * step
    )
    varied = np.array([[1.0, -of_amplitude / of_excess], [0.0, 1.0 / of_excess]]) @ tie.varied
    reach = 2.0 * _BEYOND * float(np.linalg.norm(varied[1]))
    far = [value for value in _searched(comparison, one) if abs(value - one.value) > reach]
    most = tie.fit.chi2 + AS_WELL
    if not reach < one.spread or any(each.fit.chi2 < most and each.holds for each in map(at, far)):
        return _Estimate(amplitude, None, _ANYWHERE)
    return _Estimate(amplitude, varied, _FOLLOWING)


def _settled(comparison: Comparison, instances: Sequence[Instance], one: Untold) -> Instance:
    from scipy.optimize import brentq  # type: ignore[import-untyped]

    tie = partial(_Tied.of, comparison, instances, one)
    item, name = instances[one.place], one.parameter.name
    most = tie(one.value).fit.chi2 + AS_WELL
    tried = [(value, tie(value)) for value in _searched(comparison, one)]
    for (low, at_low), (high, at_high) in pairwise(tried):
        as_well = max(at_low.fit.chi2, at_high.fit.chi2) < most
        if low * high > 0.0 and as_well and at_low.values[1] * at_high.values[1] < 0.0:
            return item.at(name, float(brentq(lambda value: tie(value).values[1], low, high)))
    held = [(abs(at.values[1]), value) for value, at in tried if at.fit.chi2 < most and at.holds]
    return item.at(name, min(held)[1]) if held else item


def _searched(comparison: Comparison, one: Untold) -> list[float]:
    """Values that are searched, with two close to zero in place of it."""
    near = _NEAR * one.spread
    grid = one.parameter.searched_at(comparison.model.conditions).tolist()
    values = np.unique([*grid, one.value, -near, near])
    return [value for value in values.tolist() if abs(value) >= near]
