"""Time constants that may be longer than all runs: what the readings do not tell then.

Of a warm-up that has not ended, the readings tell how it begins; what the bias comes to in the end,
which is K0 beside it, they do not. A drift looks like the beginning of one: beside it, K0 is the
bias at the first reading. The search ends at the longest run, and so does what U counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from accelcal.discovery.comparison import Comparison
from accelcal.discovery.doubts.dead_zone_or_cube import unlike
from accelcal.discovery.explanation import explain_as_well
from accelcal.discovery.instance import Instance, replaced
from accelcal.discovery.untold import smooth
from accelcal.effects.catalogue import catalogue
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import Effect
from accelcal.effects.parameter import Parameter
from accelcal.plural import listed

_BEYOND = 10.0
"""Times the end of the search, where an effect is all but the beginning of itself."""

_AT_END = 0.95
"""Share of the end of the search from which a parameter would go on if the search did."""


class OpenEnd(NamedTuple):
    """A parameter of an effect that may lie anywhere beyond the end of the search.

    Attributes
    ----------
    effect : Effect
        The effect.
    parameter : Parameter
        The parameter.
    end : float
        Where the search ends [its unit].
    coefficients : tuple of str
        Those that hang on it.
    """

    effect: Effect
    parameter: Parameter
    end: float
    coefficients: tuple[str, ...]


def said_of_ends(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[str]:
    """Say which effects, or what looks like them, may go on beyond the search."""
    for one in _at_ends(comparison, instances):
        names = listed((*one.coefficients, *(p.name for p in one.effect.parameters)))
        yield (
            f"{_beyond(one)} explains these readings as well: nothing bounds {names}, which may be"
            f" far outside their U; to tell: {one.effect.to_tell_apart}"
        )
    for item, one in _look_alikes(comparison, instances):
        yield (
            f"{_beyond(one)} explains these readings as well as {item.effect.id}, with other values"
            f" of {listed(one.coefficients)}; nothing tells how long it lasts, and no U counts it;"
            f" to tell: {one.effect.to_tell_apart}"
        )


def _at_ends(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[OpenEnd]:
    """Parameters that come out at the end of the search."""
    for place, item in enumerate(instances):
        for parameter, end in _scales(item.effect, comparison.model.conditions):
            if item.shape[parameter.name] >= _AT_END * end:
                beyond = replaced(instances, place, item.at(parameter.name, _BEYOND * end))
                hanging = unlike(comparison, instances, beyond)
                yield OpenEnd(item.effect, parameter, end, hanging)


def _look_alikes(
    comparison: Comparison, instances: Sequence[Instance]
) -> Iterator[tuple[Instance, OpenEnd]]:
    """Effects, and others far beyond the search that explain the readings in place of each."""
    named = {item.effect.id for item in instances}
    for place, item in enumerate(instances):
        for effect in (entry for entry in catalogue() if entry.id not in named):
            for parameter, end in _scales(effect, comparison.model.conditions):
                long = Instance(effect, (1.0,), {parameter.name: _BEYOND * end})
                others = replaced(instances, place, long)
                if not explain_as_well(comparison, others, item):
                    continue
                if hanging := unlike(comparison, instances, others):
                    yield item, OpenEnd(effect, parameter, end, hanging)


def _scales(effect: Effect, c: Conditions) -> Iterator[tuple[Parameter, float]]:
    """Parameters of an effect that are scales, as time constants, with the end of the search.

    A scale is positive, and has no largest value.
    """
    for parameter in smooth(effect):
        if parameter.minimum > 0.0 and parameter.search is not None:
            yield parameter, float(parameter.search(c).max())


def _beyond(one: OpenEnd) -> str:
    end = f"{one.end:.4g} {one.parameter.unit}"
    return f"{one.effect.id} with {one.parameter.name} of {end} or any longer"
