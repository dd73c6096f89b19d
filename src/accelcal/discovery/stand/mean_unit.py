"""The mean of several units on one stand: what they share stays, the noise of each averages out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arrays import Array
from accelcal.discovery.columns import head_columns
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance, column_of
from accelcal.discovery.silence import silent_in
from accelcal.discovery.solution import Solution, solution
from accelcal.effects.conditions import LEVEL_CHANGE
from accelcal.errors import InputError
from accelcal.plural import listed
from accelcal.record import TumbleRecord


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
