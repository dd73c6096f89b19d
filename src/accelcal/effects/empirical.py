"""Empirical terms: a pattern that no entry of the catalogue explains, as an effect of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from accelcal.arrays import Array
from accelcal.effects.catalogue import effect
from accelcal.effects.conditions import SAME_ANGLE, Conditions
from accelcal.effects.effect import Effect
from accelcal.effects.parameter import Parameter
from accelcal.head_angles import angular_distance
from accelcal.results.findings import EMPIRICAL

_AT = "at {:g} deg"


FACTORS: Mapping[str, tuple[Callable[[Conditions], Array], str, str]] = {
    "position": (lambda c: np.ones(c.angle.size), "g", "the same in all strokes and runs"),
    "stroke*position": (lambda c: c.rotation, "g", "opposite on forward and back strokes"),
    "temperature*position": (lambda c: c.excess, "g/degC", "in proportion to T - T0"),
}
"""Factors whose pattern can be carried over to another record: what multiplies it, and its unit."""


@dataclass(frozen=True)
class _Pattern:
    """A value at each head position, times something that depends on the reading."""

    factor: str

    def __call__(self, c: Conditions, **values: float) -> Array:
        total = np.zeros(c.angle.size)
        for name, value in values.items():
            here = angular_distance(c.angle, _angle_of(name)) < SAME_ANGLE
            total += np.where(here, value, 0.0)
        return np.asarray(total * FACTORS[self.factor][0](c))


def empirical(factor: str, angles: Iterable[float]) -> Effect:
    """Make an empirical term of one of `FACTORS`, with an amplitude for each head position [deg].

    Raises
    ------
    KeyError
        If the factor is another one.

    Examples
    --------
    >>> empirical("stroke*position", [0.0, 45.0]).id
    'empirical:stroke*position'
    """
    _, unit, how = FACTORS[factor]
    return Effect(
        id=EMPIRICAL + factor,
        name=f"empirical term by {factor}",
        physics=f"Not known: the readings differ by the head position, {how}.",
        formula="one value for each head position",
        signature="As found in the record; no entry of the catalogue looks like it.",
        to_tell_apart="a cause; until there is one, the term holds for this stand and unit only",
        parameters=tuple(
            Parameter(_AT.format(angle), unit, f"value at {angle:g} deg", default=0.0)
            for angle in angles
        ),
        term=_Pattern(factor),
    )


def effect_of(name: str, parameters: Iterable[str]) -> Effect:
    """Look up an effect of a document by its id: in the catalogue, or empirical.

    Raises
    ------
    InputError
        If there is no such effect.
    """
    factor = name.removeprefix(EMPIRICAL)
    if factor != name and factor in FACTORS:
        return empirical(factor, map(_angle_of, parameters))
    return effect(name)


def _angle_of(parameter: str) -> float:
    return float(parameter.removeprefix("at ").removesuffix(" deg"))
