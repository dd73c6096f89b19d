"""What the effects of a discovery are in another record: their shapes, and what may be in place.

A time constant or a break is the one that fits its readings best, as of an effect that is found in
them. That of the discovery is kept where they neither tell nor deny it. An effect at one place, as
a step, is moved where it explains them at another one and not at its own.

The discovery named one of several effects that its readings cannot tell apart. Those of another
record judge them anew: what explains these as well has a size of its own here, and what they deny
is not counted. Its own readings chose the effect that suits their noise best, and so they deny the
others too easily: there the discovery has judged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import all_largest, lengths, orthonormal, squares_in, without
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.dead_zone import in_fit
from accelcal.discovery.doubts.as_well import said_of_ends
from accelcal.discovery.doubts.otherwise import (
    alternatives,
    name_of,
    otherwise,
    places_of,
    where_is,
)
from accelcal.discovery.explanation import explain_as_well, is_needed
from accelcal.discovery.in_use.carrying_over import of_one_file
from accelcal.discovery.instance import (
    Instance,
    columns_of,
    instance_of,
    instances_of,
    left_out_around,
    own_columns,
    replaced,
)
from accelcal.discovery.large_effects import is_possible
from accelcal.discovery.parameters import settled
from accelcal.discovery.untold import fitted_sizes, not_shown, slopes_of, smooth
from accelcal.discovery.unwritten import by_pauses
from accelcal.effects.catalogue import catalogue
from accelcal.effects.effect import Effect
from accelcal.effects.found import disturbances
from accelcal.effects.left_in_use import is_counted_in_use
from accelcal.effects.parameter import Parameter
from accelcal.numerics.probability import student_quantile
from accelcal.results.beyond_uncertainty import LESS_CERTAIN, NOT_COUNTED
from accelcal.results.discovery import IF_IT_IS, Discovery
from accelcal.results.findings import FoundEffect


class InPlace(NamedTuple):
    """Effects that may be there in the place of those that are taken out of n readings."""

    said: str  # the coefficients if they are
    adds: Array
    """What they add to the readings more than those that are taken out, (n,) [output unit]."""
    in_use: bool  # whether use counts them as well, where it takes up the effects
    instances: tuple[Instance, ...]  # these effects


def in_place(
    comparison: Comparison,
    fitted: Sequence[Instance],
    taken: Array,
    model: Discovery,
    unbounded: Sequence[str],
) -> Iterator[InPlace]:
    """Find what explains the readings of a record as well as the effects taken out of it.

    Those that are fitted to the n readings add what is `taken`, shape (n,) [g]. There is one for
    each of what else they may be, with other coefficients than those that are `unbounded`, in which
    nothing can be counted.
    """
    c, rivals = comparison.model.conditions, list(_rivals(comparison, fitted, model))
    in_use = {name for name, _, is_counted in rivals if is_counted}
    own = alternatives(comparison, fitted)
    for other in otherwise(comparison, fitted, own, [rival[:2] for rival in rivals]):
        sizes = fitted_sizes(comparison, other.instances).of_each
        sized = list(zip(other.instances, sizes, strict=True))
        hanging = {in_fit(new.coefficient) for _, new in other.pairs}
        if all(map(is_possible, *zip(*sized, strict=True))) and not hanging <= set(unbounded):
            adds = sum(own_columns(item, c) @ size for item, size in sized) - taken
            adds *= comparison.model.nominal
            yield InPlace(other.said, adds, other.name in in_use, other.instances)


def said_of_effects(
    comparison: Comparison,
    others: Sequence[InPlace],
    model: Discovery,
    fitted: Sequence[Instance],
) -> Iterator[str]:
    """Tell what else the effects may be, what was not searched for, and what the readings deny."""
    if others:
        told = "; ".join(other.said for other in others)
        yield f"U counts what else the effects may be; {told}"
    if left := "; ".join(_not_judged(model, fitted)):
        possible = "what else the discovery found possible; by its own readings,"
        yield f"{NOT_COUNTED} {possible} {left}"
    yield from said_of_ends(comparison, fitted, catalogue())
    yield from _said_of_denied(comparison, fitted)
    yield from _said_of_places(comparison, fitted, model.effects)


def _not_judged(model: Discovery, fitted: Sequence[Instance]) -> list[str]:
    """Notes on what else a discovery found possible that is not looked for in these readings."""
    ids = [item.effect.id for item in fitted]
    names = [name for own in ids for name, _ in _named_in_place(model, own)]
    judged = tuple(f"{IF_IT_IS}{name} in truth" for name in names)
    judged += tuple(f"{IF_IT_IS}{own} with " for own in ids)
    return [note for note in model.otherwise if not note.startswith(judged)]


def _named_in_place(model: Discovery, name: str) -> Iterator[tuple[str, Effect]]:
    """Effects that may be there in the place of one, and the names of all together with each."""
    entries = {entry.id: entry for entry in catalogue()}
    whole = {found.id: found for found in model.effects}
    for other in whole[name].indistinguishable:
        if other in entries:
            yield name_of({*whole, other} - {name}), entries[other]


def _rivals(
    comparison: Comparison, fitted: Sequence[Instance], model: Discovery
) -> Iterator[tuple[str, tuple[Instance, ...], bool]]:
    """Effects with another one in the place of one, and whether use counts that as well."""
    record = comparison.record
    is_judged = record.serial == model.serial and of_one_file(record, model)
    for place, item in enumerate(fitted):
        for name, effect in _named_in_place(model, item.effect.id):
            others = _with(comparison, fitted, place, effect)
            if others and (is_judged or not _is_denied(comparison, item, others)):
                yield name, others, is_counted_in_use(item.effect, effect)


def _is_denied(comparison: Comparison, item: Instance, others: Sequence[Instance]) -> bool:
    """Whether an effect is needed beside others and what pauses between runs may do to them."""
    by_times = comparison.space.see(by_pauses(comparison, others))
    beside = orthonormal(np.hstack([comparison.span(others), by_times]))
    return is_needed(comparison, item, beside)


def _with(
    comparison: Comparison, fitted: Sequence[Instance], place: int, effect: Effect
) -> tuple[Instance, ...]:
    """Effects with another one in the place of one, wherever it fits best; none if it is hidden.

    Of several that fit alike, it is the one in the middle.
    """
    c, beside = comparison.model.conditions, comparison.span(replaced(fitted, place))
    best = _best(comparison, list(instances_of(effect, c)), beside)
    near = [item for one in best for item in left_out_around(one, c)]
    best = _best(comparison, near, beside) or best
    if not best:
        return ()
    others = replaced(fitted, place, best[len(best) // 2])
    for parameter in smooth(effect) if len(best) == 1 else ():
        others = replaced(others, place, moved(comparison, others, place, parameter))
    return tuple(settled(comparison, others))


def _best(comparison: Comparison, tried: Sequence[Instance], beside: Array) -> list[Instance]:
    """Those of some instances that fit best beside some directions, and alike but for rounding."""
    own, shown = comparison.space.shown(columns_of(tried, comparison.model.conditions), beside)
    length = np.where(shown, lengths(own), np.inf)
    seen = np.abs(comparison.seen @ own) / length
    best = [tried[i] for i in all_largest(seen).tolist() if seen[i]]
    return [item for item in best if item.mixture == best[0].mixture]


_SURE = 0.999
"""Part of all records with the parameter that was found which do not deny it."""


def in_own_shape(comparison: Comparison, fitted: Sequence[Instance]) -> list[Instance]:
    """Move the nonlinear parameters that the readings tell or deny to where they fit best."""
    found = list(fitted)
    denied = list(_denied(comparison, fitted))
    open_ones = [(one.place, one.parameter) for one in not_shown(comparison, fitted)]
    for place, item in enumerate(fitted):
        for parameter in smooth(item.effect):
            if (place, parameter) in denied or (place, parameter) not in open_ones:
                found[place] = moved(comparison, found, place, parameter)
    for place, item in enumerate(found):
        if other := _elsewhere(comparison, found, place):
            there = replaced(found, place, other)
            if explain_as_well(comparison, there, item):
                found = list(there)
    return settled(comparison, found)


def _elsewhere(comparison: Comparison, fitted: Sequence[Instance], place: int) -> Instance | None:
    """Find the place where the readings show an effect as well, beside all that are fitted."""
    c = comparison.model.conditions
    others = list(places_of(fitted[place], c))
    if not others:
        return None
    beside = comparison.span(fitted)
    left = without(comparison.seen, beside)
    limit = student_quantile(1.0 - (1.0 - _SURE) / len(others), comparison.space.dof)

    def best(tried: Sequence[Instance]) -> tuple[float, Instance]:
        own = without(comparison.space.see(columns_of(tried, c)), beside)
        beyond = np.abs(left @ own) - limit * lengths(own)
        return float(beyond.max()), tried[int(np.argmax(beyond))]

    beyond, found = best(others)
    if beyond > 0.0 and (near := left_out_around(found, c)):
        _, found = best(near)
    return found if beyond > 0.0 else None


def _said_of_places(
    comparison: Comparison, fitted: Sequence[Instance], effects: Sequence[FoundEffect]
) -> Iterator[str]:
    """Say which effects the readings show at other places than those of the discovery."""
    found = {known.effect.id: instance_of(known) for known in disturbances(effects)}
    for place, item in enumerate(fitted):
        here, there = where_is(item), where_is(found[item.effect.id])
        if here != there:
            yield (
                f"{item.effect.id}: these readings show it with {here}, and not with {there} as"
                " those of the discovery; it is taken out where they show it"
            )
        if other := _elsewhere(comparison, fitted, place):
            yield (
                f"{item.effect.id}: these readings show another one with {where_is(other)}, which"
                f" is not taken out, so that the coefficients are {LESS_CERTAIN}; discover the"
                " effects in these readings"
            )


def _said_of_denied(comparison: Comparison, fitted: Sequence[Instance]) -> Iterator[str]:
    """Say which nonlinear parameters the readings deny wherever they are."""
    for place, p in _denied(comparison, fitted):
        item = fitted[place]
        unit = "" if p.unit == "1" else f" {p.unit}"
        yield (
            f"{item.effect.id}: these readings do not agree with {p.name} ="
            f" {item.shape[p.name]:.3g}{unit}, so that the coefficients are {LESS_CERTAIN};"
            " discover the effects in these readings"
        )


def _denied(comparison: Comparison, fitted: Sequence[Instance]) -> Iterator[tuple[int, Parameter]]:
    """Smooth nonlinear parameters, each with the place of its effect, whose change is due."""
    if not any(item.effect.shapes for item in fitted):
        return
    sizes = fitted_sizes(comparison, fitted)
    linear = orthonormal(sizes.linear[:, sizes.shown])
    left = without(comparison.seen, linear)
    limit = student_quantile(_SURE, comparison.space.dof)
    for place, slopes in enumerate(slopes_of(comparison, fitted, sizes)):
        own, shapes = without(slopes, linear), smooth(fitted[place].effect)
        for p, column, length in zip(shapes, own.T, lengths(own), strict=True):
            if abs(column @ left) > limit * length > 0.0:
                yield place, p


def moved(
    comparison: Comparison, instances: Sequence[Instance], place: int, parameter: Parameter
) -> Instance:
    """An effect with one parameter where the squares of all effects together are largest."""
    from scipy.optimize import minimize_scalar  # type: ignore[import-untyped]

    name, start = parameter.name, instances[place]

    def loss(value: float) -> float:
        sizes = fitted_sizes(comparison, replaced(instances, place, start.at(name, value)))
        return -squares_in(orthonormal(sizes.linear[:, sizes.shown]), comparison.seen)

    searched = parameter.searched_at(comparison.model.conditions).tolist()
    grid = np.unique([*searched, start.shape[name]])
    best = int(np.argmin([loss(value) for value in grid.tolist()]))
    ends = grid[max(best - 1, 0)], grid[min(best + 1, grid.size - 1)]
    if ends[0] < ends[1]:
        found = minimize_scalar(loss, bounds=ends, method="bounded", options={"xatol": 1e-4})
        if found.fun < loss(float(grid[best])):
            return start.at(name, float(found.x))
    return start.at(name, float(grid[best]))
