"""Temperature laws from all readings of a record at once, each at its own temperature."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointStack
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.results.temperature import BilinearLaw, TemperatureModel
from accelcal.temperature.bilinear import named_model
from accelcal.temperature.from_tables import tables_of_one_mounting
from accelcal.temperature.product_fit import (
    Errors,
    ProductFit,
    Solution,
    estimator,
    product_fit,
    solved,
)

__all__ = ["laws_from_readings"]

Array = NDArray[np.float64]

_UNFELT = 0.5


class _Source(NamedTuple):
    """What one source of error does to the readings: a column for each independent error.

    The degrees of freedom are those of all columns, or of each row where it acts on the diagonal.
    """

    acting: Array
    dof: Array | float


def laws_from_readings(
    tables: Sequence[PreparedTable],
    estimate: JointStack,
    record: int,
    start: TemperatureModel,
    temperatures: Sequence[Array],
    levels: Array,
    reference: Array,
) -> TemperatureModel:
    """Fit the temperature laws of one record of a stack to all of its readings.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of any of R records of one plan.
    estimate : JointStack
        Their coefficients, reading noise and head error.
    record : int
        Place of the record.
    start : TemperatureModel
        Its laws from the tables, to start from; the hysteresis is kept.
    temperatures : sequence of ndarray, shape (R, n)
        Temperatures of the readings of each table, those unknown at their mean [degC].
    levels : ndarray, shape (R, tables)
        Mean temperature of each table [degC].
    reference : ndarray, shape (R,)
        T0 [degC].

    Returns
    -------
    TemperatureModel
        The laws.

    Notes
    -----
    A head error, a shift of a launch and an error of temperature enter as unknowns with a
    pseudo-reading 0, of the size declared or estimated for them; the part of the temperature's
    scatter that a run felt enters with a pseudo-reading 0.5 +- 0.5. At the solution the estimator
    is linear, and each component of error goes through it. The reading noise is the scatter of
    the replicates without what the felt temperatures explain of it.
    """
    chosen = tables_of_one_mounting(tables, estimate)
    if not np.isfinite([estimate.noises[i].factor[record] for i in chosen]).all():
        return start  # nothing tells the noise, so nothing can weigh a reading
    sides = [side for side in ("above", "below") if getattr(start.k0, side) is not None]
    rows = np.array([record])
    fit = product_fit(tables, estimate, chosen, rows, temperatures, levels, reference, sides)
    laws = np.concatenate([_values(law, sides) for law in (start.k0, start.K1, start.delta)])
    state = solved(fit, laws[None])
    through, errors = estimator(fit, state)
    count = laws.size
    return named_model(
        state.parameters[0, :count],
        {
            name: _component(through[0, :count], source)
            for name, source in _sources(estimate, errors, record).items()
        },
        sides,
        tables[0].record.unit,
        hysteresis=start.hysteresis,
        warnings=(*start.warnings, *_unfelt(fit, state)),
    )


def _values(law: BilinearLaw, sides: Sequence[str]) -> Array:
    return np.array([getattr(law, name).value for name in ("at_T0", *sides)])


def _sources(estimate: JointStack, errors: Errors, record: int) -> Mapping[str, _Source]:
    """Errors of the readings of a record by source; the first is diagonal."""
    dof = {
        "head": float(estimate.head.one(record).dof),
        "launch": estimate.bias_shift.dof,
        "launch_sf": estimate.scale_factor_shift.dof,
        "temperature": float(errors.temperature_dof.min()),
        "hysteresis": np.inf,
    }
    return {
        "reading": _Source(errors.noise[0], errors.noise_dof[0]),
        **{name: _Source(acting[0], dof[name]) for name, acting in errors.shared.items()},
        "felt": _Source(errors.felt[0], np.inf),
    }


def _component(through: Array, source: _Source) -> Component:
    if source.acting.ndim == 1:
        passed = through * source.acting
        shares = passed**2 / (passed**2).sum(axis=1, keepdims=True)
        with np.errstate(divide="ignore"):  # a declared noise has no end of degrees of freedom
            dof = 1.0 / (shares @ (1.0 / np.asarray(source.dof)))
        return Component(passed @ passed.T, dof)
    passed = through @ source.acting
    return Component(passed @ passed.T, np.full(through.shape[0], source.dof))


def _unfelt(fit: ProductFit, state: Solution) -> Iterator[str]:
    """Say where most of the recorded scatter is that of the sensor."""
    unfelt = (state.felt + 2.0 * state.doubt < _UNFELT)[0].tolist()
    pairs = zip(fit.tables, fit.temperatures, unfelt, strict=True)
    own = [(table.run_label, recorded[0]) for table, recorded, found in pairs if found]
    if own:
        names = ", ".join(name for name, _ in own)
        scatter = max(recorded.std(ddof=1) for _, recorded in own)
        yield (
            f"run{'s' if len(own) > 1 else ''} {names}: the readings do not follow the recorded"
            f" temperatures, which scatter by {scatter:.2g} degC; taken as noise of the sensor, and"
            " the mean of a run as its temperature"
        )
