"""What several units tell of their stand: effects and head positions, estimated jointly.

The readings of unit u, after its own effects and its base model have taken their part, are

    z_u = S_u s + noise,    s = (sizes of the effects, errors of the head positions),

with the same s in all units. So each unit adds S_u^T S_u to what is known of s, the declared
uncertainty of the head is the start, and the matrices have the size of s. What the others tell of
s is, for one unit, a correction with a covariance: nothing else is needed to fit it jointly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.base import solve
from accelcal.discovery.columns import saturated
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance, column_of, columns_of
from accelcal.discovery.noise.covariance import whitener_of
from accelcal.discovery.solution import changes, solution
from accelcal.discovery.space import space_of
from accelcal.discovery.spans import orthonormal, without
from accelcal.discovery.stand.mean_unit import Unit, amplitudes
from accelcal.numerics.covariance import covariance_root, posterior
from accelcal.results.findings import Change

_LEAST = 1e-7
"""Information below it, over that of each alone, is rounding."""

_NOTHING = 1e-300
"""Variance of what is known exactly: no number is divided by 0."""


class Knowledge(NamedTuple):
    """What is known of sizes and head positions."""

    value: Array  # estimate, (k,)
    covariance: Array  # its covariance, (k, k)


def shared_columns(unit: Unit, shared: Sequence[Instance], head: float) -> Array:
    """Change of the readings with the sizes and, if its uncertainty is above 0, with the head."""
    c = unit.comparison.model.conditions
    columns = columns_of(amplitudes(shared), c)
    return np.hstack([columns, unit.head]) if head else columns


def _own_part(unit: Unit) -> Array:
    """Orthonormal basis of the effects that a unit has alone, in its space."""
    c, space = unit.comparison.model.conditions, unit.comparison.space
    columns = [space.see(column_of(item, c))[:, None] for item in amplitudes(unit.own)]
    return orthonormal(np.hstack([space.nothing(), *columns]))


def known(units: Sequence[Unit], shared: Sequence[Instance], head: float, size: int) -> Knowledge:
    """Estimate the shared part from some units and the declared uncertainty of the head [rad].

    There are the sizes of all amplitudes, which are free, then the errors of the head positions
    [rad], together `size`. Of the errors that look like coefficients in every unit, nothing but the
    declaration is known.
    """
    sizes = len(amplitudes(shared))
    declared = np.zeros(size)
    declared[sizes:] = 1.0 / head**2 if head else 0.0
    information, pull = np.diag(declared), np.zeros(size)
    for unit in units:
        columns = shared_columns(unit, shared, head)
        shown = without(unit.comparison.space.see(columns), _own_part(unit))
        information = information + shown.T @ shown
        pull = pull + shown.T @ unit.comparison.seen
    return Knowledge(*posterior(information, pull, _LEAST))


def of_another_head(told: Knowledge, positions: int, head: float) -> Knowledge:
    """Forget the head positions, as for a unit on a head of its own, as good as declared [rad].

    They are at the end of what other units told. Of them nothing but the declaration is left.
    """
    sizes = told.value.size - positions
    covariance = head**2 * np.eye(told.value.size)
    covariance[:sizes, :sizes] = told.covariance[:sizes, :sizes]
    return Knowledge(np.append(told.value[:sizes], np.zeros(positions)), covariance)


def without_head(
    units: Sequence[Unit], shared: Sequence[Instance], head: float
) -> tuple[Unit, ...]:
    """Take the errors of the head positions out of units, as all of them together tell it.

    All of them lack the same angles then, beside the effects that all may have.
    """
    if not head:
        return tuple(units)
    positions = units[0].head.shape[1]
    told = known(units, shared, head, len(amplitudes(shared)) + positions)
    errors = told.value[-positions:]
    return tuple(
        unit._replace(comparison=_less(unit.comparison, unit.head @ errors)) for unit in units
    )


def _less(comparison: Comparison, part: Array) -> Comparison:
    return comparison._replace(seen=comparison.seen - comparison.space.see(part))


def beside_the_others(unit: Unit, columns: Array, told: Knowledge) -> Comparison:
    """Compare a unit again, with what is told of its stand taken out of its readings.

    The columns, shape (n, k), are `shared_columns`. The uncertainty of what is told is in the
    covariance.
    """
    old = unit.comparison
    sizes = np.sqrt(np.maximum(np.diagonal(told.covariance), _NOTHING))
    uncertain = columns @ covariance_root(told.covariance, sizes)
    spread = old.spread.with_shared(uncertain)
    whitener = whitener_of(spread)
    model = replace(old.model, reading=old.model.reading - columns @ told.value)
    parameters = solve(model, whitener.whitened)
    space = space_of(
        whitener, model.jacobian(parameters), saturated(model.conditions, old.record.mounting)
    )
    return old._replace(
        model=model,
        parameters=parameters,
        space=space,
        seen=space.see(model.residual(parameters)),
        spread=spread,
        possible=tuple(each.with_shared(uncertain) for each in old.possible),
    )


def coefficients(
    units: Sequence[Unit], shared: Sequence[Instance], head: float
) -> tuple[tuple[Change, ...], ...]:
    """Fit the coefficients of each unit, with the stand from its own readings and from all."""
    found = []
    for number, unit in enumerate(units):
        bare, columns = (shared_columns(unit, some, head) for some in ((), shared))
        others = [*units[:number], *units[number + 1 :]]
        alone = beside_the_others(unit, bare, known((), (), head, bare.shape[1]))
        joint = beside_the_others(unit, columns, known(others, shared, head, columns.shape[1]))
        own = amplitudes(unit.own)
        before = changes(alone, solution(alone), solution(alone, [*amplitudes(shared), *own]))
        after = changes(joint, solution(joint), solution(joint, own))
        found.append(
            tuple(
                Change(one.coefficient, one.after, two.after)
                for one, two in zip(before, after, strict=True)
            )
        )
    return tuple(found)
