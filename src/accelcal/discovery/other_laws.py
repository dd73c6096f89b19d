"""An effect that has several laws or places: which of them explain the readings.

The amplitudes of a tilt, linear in time or daily, are searched in two parts, each as an effect of
its own; over a few hours a part of a day is nearly a straight line, and either may fit the noise a
little better. So may one of several head positions, or a reading beside that of a step.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from accelcal.discovery.candidates import instances_of
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import explain_as_well
from accelcal.discovery.instance import Instance, instance_of, replaced
from accelcal.discovery.parameters import parameters_of
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import Disturbance, Effect


class Alternative(NamedTuple):
    """Effects, one of which is at another place or goes by another law than was named.

    Attributes
    ----------
    effect : Effect
        The one.
    what : str
        Where it is, or the parameters of its other law.
    instances : tuple of Instance
        All of them.
    """

    effect: Effect
    what: str
    instances: tuple[Instance, ...]

    @property
    def name(self) -> str:
        """The one, with what is otherwise."""
        return f"{self.effect.id} with {self.what}"


class Alternatives(NamedTuple):
    """What explains the readings as well as some effects, with one of them otherwise.

    Attributes
    ----------
    places, laws : tuple of Alternative
        Those at another place, and those by another law.
    """

    places: tuple[Alternative, ...]
    laws: tuple[Alternative, ...]


def alternatives(comparison: Comparison, instances: Sequence[Instance]) -> Alternatives:
    """Find other places and other laws of some effects, which explain the readings as well."""
    places, laws = (each(comparison, instances) for each in (_other_places, _other_laws))
    return Alternatives(tuple(places), tuple(laws))


def _other_laws(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[Alternative]:
    for place, others in _instead(comparison, instances, _laws):
        fitted = _fitted(comparison, others, place)
        effect, values = fitted.effect, fitted.values
        own = (p for p in effect.amplitudes if values[p.name])
        what = ", ".join(f"{p.name} = {values[p.name]:.3g} {p.unit}" for p in own)
        yield Alternative(effect, what, replaced(others, place, instance_of(fitted)))


def _other_places(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[Alternative]:
    for place, others in _instead(comparison, instances, places_of):
        yield Alternative(others[place].effect, where_is(others[place]), others)


def where_is(item: Instance) -> str:
    """Tell the place of an effect."""
    told = (p for p in item.effect.shapes if p.discrete)
    each = (f"{p.name} = {item.shape[p.name]:g} {p.unit}".removesuffix(" 1") for p in told)
    return ", ".join(each)


def _instead(
    comparison: Comparison,
    instances: Sequence[Instance],
    others_of: Callable[[Instance, Conditions], Iterator[Instance]],
) -> Iterator[tuple[int, tuple[Instance, ...]]]:
    """Sets with another in place of one that is not needed beside it, and where in the set."""
    for place, item in enumerate(instances):
        for other in others_of(item, comparison.model.conditions):
            others = replaced(instances, place, other)
            if explain_as_well(comparison, others, item):
                yield place, others


def _fitted(comparison: Comparison, instances: Sequence[Instance], place: int) -> Disturbance:
    """One of some effects, of the size that the readings give it."""
    effect = instances[place].effect
    found = parameters_of(comparison, instances)[place]
    sizes = {name: quantity.value or 0.0 for name, quantity in found.items()}
    return Disturbance(effect, dict.fromkeys((p.name for p in effect.amplitudes), 0.0) | sizes)


def _laws(item: Instance, c: Conditions) -> Iterator[Instance]:
    """The effect at the same place, with amplitudes of which it has none."""
    tried = {other.amplitudes: other for other in instances_of(item.effect, c)}
    for amplitudes, other in tried.items():
        if not set(amplitudes) & set(item.amplitudes):
            yield other._replace(shape=item.shape)


def places_of(item: Instance, c: Conditions) -> Iterator[Instance]:
    """The effect at the places where it is not, all else about it the same."""
    places = {p.name for p in item.effect.shapes if p.discrete}
    tried = dict.fromkeys(
        tuple((name, other.shape[name]) for name in sorted(places))
        for other in instances_of(item.effect, c)
    )
    for where in tried:
        moved = item._replace(shape={**item.shape, **dict(where)})
        if moved != item:
            yield moved
