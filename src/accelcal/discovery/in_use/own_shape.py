"""Nonlinear parameters of known effects in another record: those that its readings tell.

The time constant or the break is the one that fits them best, as of an effect that is found in
them. That of the discovery is kept where they neither tell nor deny it. An effect at one place, as
a step, is moved where it explains them at another one and not at its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.candidates import left_out_around
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.doubts.otherwise import places_of, where_is
from accelcal.discovery.explanation import explain_as_well
from accelcal.discovery.instance import Instance, columns_of, instance_of, replaced
from accelcal.discovery.spans import lengths, orthonormal, squares_in, without
from accelcal.discovery.tied import settled
from accelcal.discovery.untold import fitted_sizes, not_shown, slopes_of, smooth
from accelcal.effects.found import disturbances
from accelcal.effects.parameter import Parameter
from accelcal.numerics.probability import student_quantile
from accelcal.results.beyond_uncertainty import LESS_CERTAIN
from accelcal.results.findings import FoundEffect

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


def said_of_places(
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


def said_of_denied(comparison: Comparison, fitted: Sequence[Instance]) -> Iterator[str]:
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

    grid = _grid(comparison, parameter, start.shape[name])
    best = int(np.argmin([loss(value) for value in grid.tolist()]))
    ends = grid[max(best - 1, 0)], grid[min(best + 1, grid.size - 1)]
    if ends[0] < ends[1]:
        found = minimize_scalar(loss, bounds=ends, method="bounded", options={"xatol": 1e-4})
        if found.fun < loss(float(grid[best])):
            return start.at(name, float(found.x))
    return start.at(name, float(grid[best]))


def _grid(comparison: Comparison, parameter: Parameter, found: float) -> Array:
    """Values to begin with: those that a search of these readings tries, and the one found."""
    return np.unique([*parameter.searched_at(comparison.model.conditions).tolist(), found])
