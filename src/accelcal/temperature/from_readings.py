"""Temperature laws from all readings of a record at once, each at its own temperature."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component, counted
from accelcal.plural import named
from accelcal.results.temperature import TemperatureModel
from accelcal.temperature.bilinear import named_model
from accelcal.temperature.levels import RecordedTemperatures
from accelcal.temperature.one_meaning import tables_of_one_mounting
from accelcal.temperature.product.errors import (
    ProductFit,
    ReadingErrors,
    Solution,
    edges_of,
    product_fit,
)
from accelcal.temperature.product.fit import estimator, scale_factor_is_told, solved

_UNFELT = 0.5
"""Most of a recorded scatter is the sensor's where surely less than this share of it is felt."""

_TOLD = ("value", "standard_uncertainty")


def laws_from_readings(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    temperatures: RecordedTemperatures,
    record: int,
    start: TemperatureModel,
    of_effects: Callable[[Array, Sequence[int]], Mapping[str, Component]],
) -> TemperatureModel:
    """Fit the temperature laws of one record of a stack to all of its readings.

    Its laws from the tables are where the steps start; their hysteresis is kept. `of_effects`
    passes the errors of effects that were taken out of the readings through an estimator, shape
    (P, n), of the n readings of the tables at some places.

    Notes
    -----
    A head error, a shift of a launch and an error of temperature enter as unknowns with a
    pseudo-reading 0, of the size declared or estimated for them; the part of the temperature's
    scatter that a run felt enters with a pseudo-reading 0.5 +- 0.5. At the solution the estimator
    is linear, and each component of error goes through it. The reading noise is the scatter of
    the replicates without what the felt temperatures explain of it, and with the rounding errors
    that the means of the positions still hold.
    """
    chosen = tables_of_one_mounting(tables, estimate)
    if not np.isfinite([estimate.noises[i].factor[record] for i in chosen]).all():
        return start  # nothing tells the noise, so nothing can weigh a reading
    if not scale_factor_is_told(*(getattr(start.K1.at_T0, name) for name in _TOLD)):
        return start
    sides = [side for side in ("above", "below") if getattr(start.k0, side) is not None]
    rows = np.array([record])
    fit = product_fit(tables, estimate, temperatures, chosen, rows, sides)
    parts = [getattr(law, part) for law in start.laws.values() for part in ("at_T0", *sides)]
    laws = np.array([part.value for part in parts])
    state = solved(fit, laws[None])
    through, errors = estimator(fit, state)
    count, of_record = laws.size, estimate.of_records(slice(record, record + 1))
    return named_model(
        state.parameters[0, :count],
        {
            "reading": _of_noise(through[0, :count], errors, fit, of_record, chosen),
            **_components(through[0, :count], errors, estimate, record),
            **of_effects(through[0, :count], chosen),
        },
        sides,
        tables[0].record.unit,
        hysteresis=start.hysteresis,
        warnings=(*start.warnings, *_unfelt(fit, state)),
    )


def _components(
    through: Array, errors: ReadingErrors, estimate: JointEstimate, record: int
) -> Mapping[str, Component]:
    """Pass the errors of the readings of one record through the estimator."""
    dof = {
        "launch": estimate.bias_shift.dof,
        "launch_sf": estimate.scale_factor_shift.dof,
        "temperature": float(errors.sizes.temperature_dof.min()),
        "hysteresis": np.inf,
    }
    head = errors.head.sums(through[None])[0]
    return {
        "head": _component(head, float(estimate.head.of_records(record).dof)),
        **{name: _component(through @ own[0].T, dof[name]) for name, own in errors.shared.items()},
        "felt": _component(through @ errors.felt[0].T, np.inf),
    }


def _of_noise(
    through: Array,
    errors: ReadingErrors,
    fit: ProductFit,
    estimate: JointEstimate,
    chosen: Sequence[int],
) -> Component:
    """Noise of the readings of one record; by position, or correlated, where that of a table is."""
    whole, over_dof = np.zeros((len(through), len(through))), np.zeros(len(through))
    readings = np.split(np.arange(through.shape[1]), edges_of(fit))
    correlation, sizes = estimate.correlation, errors.sizes
    with np.errstate(divide="ignore"):  # a declared noise has no end of degrees of freedom
        for table, i, rows in zip(fit.tables, chosen, readings, strict=True):
            passed = through[:, rows] * sizes.noise[0, rows]
            covariance = (passed @ passed.T)[None]
            dof = covariance[0].diagonal() / (passed**2 @ (1.0 / sizes.noise_dof[0, rows]))[None]
            if estimate.uneven[i].differs[0]:
                part = through[:, rows].T
                by_place = table.at_head.products(part, part)
                covariance, dof = estimate.uneven[i].noise(by_place)
            if correlation.counts[0]:
                unit = estimate.noises[i]._replace(factor=np.ones(1))
                covariance, dof = correlation.beside(table, passed, unit, covariance, dof)
            whole += covariance[0]
            over_dof += covariance[0].diagonal() / dof[0]
        return Component(whole, whole.diagonal() / over_dof)


def _component(passed: Array, dof: float) -> Component:
    return Component(passed @ passed.T, np.full(len(passed), counted(dof)))


def _unfelt(fit: ProductFit, state: Solution) -> Iterator[str]:
    """Say where most of the recorded scatter is that of the sensor."""
    unfelt = (state.felt + 2.0 * state.doubt < _UNFELT)[0].tolist()
    pairs = zip(fit.tables, fit.temperatures, unfelt, strict=True)
    own = [(table.run_label, recorded[0]) for table, recorded, found in pairs if found]
    if own:
        scatter = max(recorded.std(ddof=1) for _, recorded in own)
        yield (
            f"{named('run', [name for name, _ in own])}: the readings do not follow the recorded"
            f" temperatures, which scatter by {scatter:.2g} degC; taken as noise of the sensor, and"
            " the mean of a run as its temperature"
        )
