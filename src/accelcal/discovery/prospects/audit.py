"""What a test can show, told by its design and its noise before any reading is looked at.

And which effects it shows as one and the same, or nearly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from itertools import groupby
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.base import BaseModel
from accelcal.discovery.columns import lengths, orthonormal, scaled, without
from accelcal.discovery.comparison import Comparison, compared
from accelcal.discovery.family import Family
from accelcal.discovery.instance import Candidates, columns_of, instances_of
from accelcal.discovery.noise.of_readings import FEWEST_REPLICATES, ReadingNoise
from accelcal.effects.effect import Effect
from accelcal.errors import InputError
from accelcal.numerics.grouping import median
from accelcal.numerics.probability import f_quantile
from accelcal.plural import degrees_of_freedom
from accelcal.record import TumbleRecord
from accelcal.results.findings import Detectable, Undetectable

POWER = 0.9

_CARRIED = 0.05
"""Part of an effect for which no coefficient is listed."""


def undetectable(comparison: Comparison, found: Candidates) -> tuple[Undetectable, ...]:
    """List the effects that the base model absorbs, with the coefficients that do."""
    carriers = carriers_in(comparison.model, comparison.parameters)
    return tuple(Undetectable(effect.id, carriers(effect)) for effect in found.hidden)


def designed(
    record: TumbleRecord, reference_temperature: float, noise: ReadingNoise, delta0: float = 0.0
) -> Comparison:
    """Compare a test that is only planned with the base model.

    It is what `accelcal.discovery.comparison.compared` makes of readings, with the noise given. The
    record has simulated readings, with or without noise in them.

    Raises
    ------
    InputError
        If the test has too few replicates for anything to be discovered, or too many readings.
    """
    found = compared(record, reference_temperature, delta0, noise=noise)
    dof = found.space.dof
    if dof < FEWEST_REPLICATES:
        raise InputError(
            f"{len(record)} readings leave {degrees_of_freedom(dof)} for their noise; to"
            f" discover an effect takes {FEWEST_REPLICATES} or more: plan two or more cycles of a"
            " forward and a back stroke in each run"
        )
    return found._replace(noise=noise._replace(dof=dof))


def carriers_in(model: BaseModel, parameters: Array) -> Callable[[Effect], tuple[str, ...]]:
    """Find the fewest coefficients of a model that carry an effect, sorted.

    There are none where the test does not bring the effect about at all.

    Notes
    -----
    Coefficients are dropped in turns, as long as the others carry all but a twentieth of the effect
    [g]. It is a matter of the design: a coefficient that the noise hides carries all the same.

    Examples
    --------
    >>> from accelcal.discovery.base import base_model, solve
    >>> from accelcal.effects.catalogue import effect
    >>> from accelcal.simulation import simulate
    >>> model = base_model(simulate(seed=1), 20.0)
    >>> carriers_in(model, solve(model))(effect("odd-quadratic"))
    ('K1', 'K3')
    """
    c = model.conditions
    base, _ = scaled(model.jacobian(parameters))
    span = orthonormal(base)
    places = span.T @ base

    @cache  # the first that are dropped are the same for most effects
    def basis(names: frozenset[str]) -> Array:
        return orthonormal(places[:, [name in names for name in model.names]])

    def found(effect: Effect) -> tuple[str, ...]:
        columns, _ = scaled(columns_of(instances_of(effect, c), c))
        wanted, kept = span.T @ columns, frozenset(model.names)

        while kept:
            lost: dict[str, float] = {}
            for name in sorted(kept):
                left = lengths(without(wanted, basis(kept - {name}))).max()
                lost[name] = round(float(left), 6)  # ties not by rounding errors
                if not lost[name]:
                    break
            least = min(lost, key=lost.__getitem__)
            if lost[least] > _CARRIED:
                break
            kept -= {least}
        return tuple(sorted(kept))

    return found


def smallest_detectable(family: Family, alpha: float = 0.01) -> tuple[Detectable, ...]:
    """Find the smallest size at which each effect is found nine times in ten.

    It is the median over the grid of its nonlinear parameters, at a false-alarm rate alpha over the
    whole family.

    Notes
    -----
    F of the effect with 1 and the degrees of freedom of the pure error is noncentral by the square
    of its length; it is found where F exceeds its quantile at alpha over all tries of the family.
    """
    from scipy.special import ncfdtrinc  # type: ignore[import-untyped]

    found, dof = family.candidates, family.space.dof
    sizes = []
    for number, (effect, tries) in enumerate(zip(found.effects, family.tries, strict=True)):
        own = found.of(number)
        units = np.array([item.amplitudes[0].unit for item in found.instances[own]])
        length = found.length[own][units == units[0]]  # sizes of other units are not compared
        limit = f_quantile(alpha / (tries * family.tests), 1.0, dof)
        needed = float(np.sqrt(ncfdtrinc(1, dof, 1.0 - POWER, limit))) / length
        sizes.append(Detectable(effect.id, median(needed), str(units[0])))
    return tuple(sizes)


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
