"""Units of one stand: their mean, and what they tell jointly of effects and of the head.

In the mean what they share stays, the noise of each averages out. Jointly estimated, the readings
of unit u, after its own effects and its base model have taken their part, are

    z_u = S_u s + noise,    s = (sizes of the effects, errors of the head positions),

with the same s in all units. So each unit adds S_u^T S_u to what is known of s, the declared
uncertainty of the head is the start, and the matrices have the size of s. What the others tell of
s is, for one unit, a correction with a covariance: nothing else is needed to fit it jointly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arrays import Array
from accelcal.discovery.columns import head_columns, without
from accelcal.discovery.comparison import Comparison, with_errors
from accelcal.discovery.instance import Instance, column_of, columns_of
from accelcal.discovery.large_effects import silent_in
from accelcal.discovery.solution import Solution, changes, solution
from accelcal.effects.conditions import LEVEL_CHANGE
from accelcal.errors import InputError
from accelcal.numerics.covariance import covariance_root, posterior
from accelcal.plural import listed
from accelcal.record import TumbleRecord
from accelcal.results.findings import Change


class Unit(NamedTuple):
    """One of several units on a stand."""

    comparison: Comparison  # its n readings and the base model; the head is not in the covariance
    head: Array
    """Change of the readings with the angle of each of the J head positions, (n, J) [g/rad]."""
    own: tuple[Instance, ...] = ()  # effects that it has alone

    @classmethod
    def of(cls, comparison: Comparison, own: tuple[Instance, ...] = ()) -> Unit:
        """Set up a unit with effects of its own."""
        return cls(comparison, head_columns(comparison.model.conditions), own)


def amplitudes(instances: Sequence[Instance]) -> tuple[Instance, ...]:
    """Split effects of several amplitudes, which may be mixed otherwise in another unit."""
    return tuple(
        item._replace(mixture=tuple(float(k == place) for k in range(len(item.mixture))))
        for item in instances
        for place in np.flatnonzero(item.mixture).tolist()
    )


def check_one_plan(records: Sequence[TumbleRecord]) -> None:
    """Refuse one record, or other angles, strokes, runs, mountings or levels than the first has."""
    if len(records) < 2:
        raise InputError("one record; what belongs to the stand shows over two or more units")
    first = records[0]
    for other in records[1:]:
        name = _difference(first, other)
        if name:
            raise InputError(
                f"{other.source}: other {name} than in {first.source}; units of one stand are"
                " compared reading by reading, in the same plan and order"
            )


def _difference(first: TumbleRecord, other: TumbleRecord) -> str:
    """What two plans differ in; empty if nothing."""
    if len(first) != len(other):
        return "number of readings"
    pairs = {
        "angles": (np.round(first.angle, 6), np.round(other.angle, 6)),
        "strokes": (first.stroke, other.stroke),
        "runs": (first.run, other.run),
        "mountings": (first.mounting, other.mounting),
    }
    found = [name for name, (one, two) in pairs.items() if not np.array_equal(one, two)]
    apart = np.abs(np.nan_to_num(first.temperature - other.temperature))
    return found[0] if found else "temperatures" if apart.max() >= LEVEL_CHANGE else ""


def on_one_stand(records: Sequence[TumbleRecord]) -> tuple[TumbleRecord, ...]:
    """Declare of all units what is declared of each: a launch that one leaves open is so for all.

    Raises
    ------
    InputError
        If they declare different heads.
    """
    heads = {record.apparatus.head_uncertainty for record in records}
    if len(heads) > 1:
        shown = listed(sorted("none" if h is None else f"{h:g}" for h in heads))
        raise InputError(
            f"head_uncertainty is {shown} in units of one stand; it is one number: give all"
            " record.with_apparatus(head_uncertainty=...)"
        )
    names = ("launch_uncertainty", "launch_sf_uncertainty")
    everything = [[getattr(record.apparatus, name) for record in records] for name in names]
    free = {n: None for n, values in zip(names, everything, strict=True) if None in values}
    return tuple(record.with_apparatus(**free) for record in records)


def mean_unit(
    units: Sequence[Unit], shared: Sequence[Instance], head_uncertainty: float | None
) -> TumbleRecord:
    """Average what is left of the units, on top of the mean of their base models.

    Readings are over the scale factor [g], declared with what the mean leaves of each launch, and
    with the uncertainty of the head [rad], which does not average out. Shared effects are fitted
    beside those of single units, but stay in.

    Notes
    -----
    The mean of the readings will not do: with laws that differ from unit to unit, the mean of the
    products of scale factor and bias is no product, and looks like an effect of dT^2.
    """
    weights = np.array([1.0 / unit.comparison.noise.sigma**2 for unit in units])
    weights /= weights.sum()
    models = [unit.comparison.model for unit in units]
    model = min(models, key=lambda one: np.count_nonzero(silent_in(one.conditions)))
    fits = [solution(unit.comparison, amplitudes([*shared, *unit.own])) for unit in units]
    # those beside the effects: what these silence hangs on the misalignment
    laws = [~own.moving for own in models]
    parameters = np.zeros(len(model.names))
    parameters[~model.moving] = _mean(
        weights,
        [fit.parameters[: own.size][own] for fit, own in zip(fits, laws, strict=True)],
    )
    base = model.reading - model.residual(parameters)
    records = [unit.comparison.record for unit in units]
    times = [record.time for record in records if record.time is not None]
    return replace(
        records[0],
        output=base + _mean(weights, list(map(partial(_without_own, shared), units, fits))),
        temperature=_mean(weights, [record.temperature for record in records]),
        time=_mean(weights, times) if len(times) == len(records) else None,
        std=None,
        count=None,
        line=None,
        serial=None,
        unit="g",
        apparatus=_apparatus(weights, [record.apparatus for record in records], head_uncertainty),
        source=f"mean of {len(records)} units",
    )


def _mean(weights: Array, values: Sequence[Array]) -> Array:
    return np.asarray(weights @ np.stack(values))


def _without_own(shared: Sequence[Instance], unit: Unit, fit: Solution) -> Array:
    """Reading minus base model minus effects that the unit has alone [g]."""
    c = unit.comparison.model.conditions
    kept, residual = amplitudes(shared), fit.residual
    first = unit.comparison.parameters.size
    for item, size in zip(kept, fit.parameters[first:].tolist(), strict=False):
        residual = residual + size * column_of(item, c)
    return residual


def _apparatus(
    weights: Array, declared: Sequence[Apparatus], head_uncertainty: float | None
) -> Apparatus:
    """What is declared of the mean: errors of single units are independent."""

    def averaged(name: str) -> float | None:
        values = [getattr(item, name) for item in declared]
        return None if None in values else float(np.sqrt(weights**2 @ np.square(values)))

    return Apparatus(
        local_gravity=declared[0].local_gravity,
        head_uncertainty=head_uncertainty,
        launch_uncertainty=averaged("launch_uncertainty"),
        launch_sf_uncertainty=averaged("launch_sf_uncertainty"),
        temperature_uncertainty=averaged("temperature_uncertainty"),
    )


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
        own = unit.comparison.span(amplitudes(unit.own))
        shown = without(unit.comparison.space.see(columns), own)
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
    found = []
    for unit in units:
        own = unit.comparison
        by_head = own.space.see(unit.head @ told.value[-positions:])
        found.append(unit._replace(comparison=own._replace(seen=own.seen - by_head)))
    return tuple(found)


def beside_the_others(unit: Unit, columns: Array, told: Knowledge) -> Comparison:
    """Compare a unit again, with what is told of its stand taken out of its readings.

    The columns, shape (n, k), are `shared_columns`. The uncertainty of what is told is in the
    covariance.
    """
    old = unit.comparison
    sizes = np.sqrt(np.maximum(np.diagonal(told.covariance), _NOTHING))
    uncertain = columns @ covariance_root(told.covariance, sizes)
    spread = old.spread.with_shared(uncertain)
    possible = tuple(each.with_shared(uncertain) for each in old.possible)
    model = replace(old.model, reading=old.model.reading - columns @ told.value)
    return with_errors(old.record, model, old.noise, spread, possible)


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
