"""Nonlinear parameters that the readings do not tell, and what they leave open.

Of a loop whose first level was reached nobody knows how, runs at 20, 80 and 20 degC show the jump
between the equal levels alone: any state of the first one with some width of the loop makes it. A
parameter is untold where the readings tell less of it than that it lies among the values that are
searched. It stays where it is, and all that hangs on it is uncertain by its uniform distribution.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.columns import lengths, orthonormal, without
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance, all_own_columns, own_columns, replaced
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import Effect
from accelcal.effects.parameter import Parameter

_STEP = 1e-4

AS_WELL = 4.0
"""Sum of squares more that a place may leave, two standard deviations of one number."""

_FAR = 6.0
"""Standard uncertainties from which on a parameter is another one."""


class Sizes(NamedTuple):
    """Amplitudes of some effects, fitted together to readings that the base model leaves."""

    whole: Array  # the amplitudes of all effects; as in the mixture where nothing is told, (m,)
    of_each: list[Array]  # those of each effect
    linear: Array  # columns of all of them in the space, (n, m)
    shown: Mask  # which have a value, (m,)


class Untold(NamedTuple):
    """A nonlinear parameter that the readings do not tell."""

    place: int  # index of its effect
    parameter: Parameter
    value: float  # where it stays
    lowest: float  # from where it may lie
    highest: float  # up to where it may lie
    tied: bool
    """Whether coefficients of the model that are estimated make up the amplitude of its effect,
    and so tell it, see `accelcal.discovery.parameters`."""

    @property
    def spread(self) -> float:
        """Its standard uncertainty; that of a time constant is in proportion to it."""
        if self.parameter.minimum > 0.0:
            width = self.value * float(np.log(self.highest / self.lowest))
        else:
            width = self.highest - self.lowest
        return width / float(np.sqrt(12.0))

    def ends(self, instances: Sequence[Instance]) -> tuple[tuple[Instance, ...], ...]:
        """Effects with the parameter a standard uncertainty below and above its value."""
        below, above = (
            self.at(instances, float(np.clip(value, self.lowest, self.highest)))
            for value in (self.value - self.spread, self.value + self.spread)
        )
        return below, above

    def at(self, instances: Sequence[Instance], value: float) -> tuple[Instance, ...]:
        """Effects with another value of the parameter."""
        moved = instances[self.place].at(self.parameter.name, value)
        return replaced(instances, self.place, moved)


def fitted_sizes(comparison: Comparison, instances: Sequence[Instance]) -> Sizes:
    """Fit the amplitudes of some effects; one that the base model takes up has no value."""
    c, space = comparison.model.conditions, comparison.space
    linear, shown = space.shown(all_own_columns(instances, c))
    sizes = np.zeros(shown.size)
    sizes[shown] = np.linalg.lstsq(linear[:, shown], comparison.seen, rcond=None)[0]
    ends = np.cumsum([len(item.amplitudes) for item in instances], dtype=np.intp)
    of_each = np.split(sizes, ends)[:-1]
    for item, own, seen in zip(instances, of_each, np.split(shown, ends)[:-1], strict=True):
        parts = np.array(item.mixture)[np.flatnonzero(item.mixture)]
        most = np.abs(parts * seen).argmax()
        own[~seen] = parts[~seen] * (own[most] / parts[most])
    return Sizes(sizes, of_each, linear, shown)


def squares_left(comparison: Comparison, instances: Sequence[Instance]) -> float:
    """Sum of squares that some effects leave of the readings in the space."""
    sizes = fitted_sizes(comparison, instances)
    left = comparison.seen - sizes.linear @ sizes.whole
    return float(left @ left)


def slopes_of(comparison: Comparison, instances: Sequence[Instance], sizes: Sizes) -> list[Array]:
    """Derivatives in the space by the smooth nonlinear parameters of each effect, (n, k)."""
    c, space = comparison.model.conditions, comparison.space
    return [
        space.see(slopes(item, size, c))
        for item, size in zip(instances, sizes.of_each, strict=True)
    ]


def untold(comparison: Comparison, instances: Sequence[Instance]) -> list[Untold]:
    """Find the nonlinear parameters of some effects that nothing tells."""
    return [one for one in not_shown(comparison, instances) if not one.tied]


def not_shown(comparison: Comparison, instances: Sequence[Instance]) -> list[Untold]:
    """Find the nonlinear parameters of some effects that the readings alone do not tell."""
    if not any(smooth(item.effect) for item in instances):
        return []
    sizes = fitted_sizes(comparison, instances)
    by_shape = np.hstack(slopes_of(comparison, instances, sizes))
    others = sizes.linear[:, sizes.shown]
    found = []
    for column, one in enumerate(_possible(comparison, instances)):
        beside = orthonormal(np.hstack([others, np.delete(by_shape, column, axis=1)]))
        told = float(lengths(without(by_shape[:, [column]], beside))[0])
        if one.spread > 0.0 and (
            told * one.spread < 1.0 or _is_anywhere(comparison, instances, one, told)
        ):
            found.append(one)
    return found


def _is_anywhere(
    comparison: Comparison, instances: Sequence[Instance], one: Untold, told: float
) -> bool:
    """Whether a tied parameter far from its value explains the readings as well.

    A break within a level that moves follows its noise, where any between two levels would do.
    """
    grid = one.parameter.searched_at(comparison.model.conditions) if one.tied else np.empty(0)
    far = grid[np.abs(grid - one.value) * told > _FAR].tolist()
    most = squares_left(comparison, instances) + AS_WELL
    return any(squares_left(comparison, one.at(instances, value)) < most for value in far)


def said_of_untold(instances: Sequence[Instance], one: Untold) -> str:
    """Say that a parameter is not told, and what the uncertainties count."""
    effect, p = instances[one.place].effect, one.parameter
    unit = "" if p.unit == "1" else f" {p.unit}"
    return (
        f"{effect.id}: these readings do not tell {p.name}; it is held at"
        f" {one.value:.3g}{unit}, and U counts all from {one.lowest:.3g} to"
        f" {one.highest:.3g}{unit} as equally likely, in the amplitude and in the coefficients"
        f" that hang on it as well; to tell: {effect.to_tell_apart}"
    )


def _possible(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[Untold]:
    names = set(comparison.model.names)
    for place, item in enumerate(instances):
        tied = bool(item.effect.tie) and item.effect.tie.keys() <= names
        for parameter in smooth(item.effect):
            value = item.shape[parameter.name]
            values = [value, *parameter.searched_at(comparison.model.conditions).tolist()]
            yield Untold(place, parameter, value, min(values), max(values), tied)


def smooth(effect: Effect) -> list[Parameter]:
    """Parameters of an effect that enter nonlinearly and are no places."""
    return [parameter for parameter in effect.shapes if not parameter.discrete]


def scales(effect: Effect) -> list[Parameter]:
    """Parameters as a time constant, which is above zero and has no largest value."""
    return [parameter for parameter in smooth(effect) if parameter.minimum > 0.0]


def slopes(instance: Instance, size: Array, c: Conditions) -> Array:
    """Derivatives of an effect of some size by its smooth parameters [g per unit], (n, k)."""
    found = [np.empty((c.angle.size, 0))]
    for parameter in smooth(instance.effect):
        value = instance.shape[parameter.name]
        step = _STEP * max(abs(value), 1e-3)
        above, below = (
            own_columns(instance.at(parameter.name, at), c) for at in (value + step, value - step)
        )
        found.append(((above - below) @ size / (2.0 * step))[:, None])
    return np.hstack(found)
