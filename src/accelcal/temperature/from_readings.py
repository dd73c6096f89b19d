"""Temperature laws from all readings at once, each at its own temperature.

The whole model is a product, nonlinear in its parameters:

    Y = K1(T) [k0(T) + a_i + k2 a_i^2 + k3 a_i^3 + delta(T) a_p + delta_ip a_i a_p]

with bilinear k0, K1 and delta, and with k2, k3 and delta_ip the same at all temperatures. It is
solved by Gauss-Newton steps of generalised least squares, in which the errors of head, launches
and temperatures stand as unknowns of known size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.head import sensitivity
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.solver import LeastSquares
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.model import COEFFICIENTS
from accelcal.results.temperature import BilinearLaw, TemperatureModel
from accelcal.temperature.bilinear import bilinear_design, local_slopes, named_model
from accelcal.temperature.from_tables import reached_by, tables_of_one_mounting

__all__ = ["laws_from_readings"]

Array = NDArray[np.float64]

_COMMON = ("K2", "K3", "M_ip")  # their quotients by K1 do not depend on temperature
_MOST_STEPS = 20


class _Readings(NamedTuple):
    """All readings of one mounting, stacked: n readings, laws of p parameters.

    `a_i` and `cross` are accelerations, `common` the columns of what does not depend on
    temperature, `law` and `slope` the bilinear design and its derivative at each temperature.
    """

    output: Array
    a_i: Array
    cross: Array
    common: Array
    law: Array
    slope: Array

    def laws(self, parameters: Array) -> tuple[Array, Array, Array, Array]:
        """Split the parameters into those of k0, K1, delta and what is common."""
        p = self.law.shape[1]
        k0, K1, delta, common = np.split(parameters, [p, 2 * p, 3 * p])
        return k0, K1, delta, common

    def model(self, parameters: Array) -> Array:
        """Output at the parameters, shape (n,)."""
        return np.asarray((self.law @ self.laws(parameters)[1]) * self.bracket(parameters))

    def bracket(self, parameters: Array) -> Array:
        """Output over K1, shape (n,)."""
        k0, _, delta, common = self.laws(parameters)
        tilt = (self.law @ delta) * self.cross
        return np.asarray(self.law @ k0 + self.a_i + tilt + self.common @ common)

    def jacobian(self, parameters: Array) -> Array:
        """Derivative of the output by the parameters, shape (n, 3 p + common)."""
        K1 = (self.law @ self.laws(parameters)[1])[:, None]
        by_bias, by_tilt = K1 * self.law, K1 * self.cross[:, None] * self.law
        by_scale = self.bracket(parameters)[:, None] * self.law
        return np.hstack([by_bias, by_scale, by_tilt, K1 * self.common])

    def by_temperature(self, parameters: Array) -> Array:
        """Derivative of the output by the temperature, shape (n,)."""
        k0, K1, delta, _ = self.laws(parameters)
        inside = self.slope @ k0 + (self.slope @ delta) * self.cross
        scale = (self.slope @ K1) * self.bracket(parameters)
        return np.asarray(scale + (self.law @ K1) * inside)


class _Source(NamedTuple):
    """What one source of error does to the readings: a column for each independent error."""

    acting: Array
    dof: float


def laws_from_readings(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    start: TemperatureModel,
    reference: float,
    temperature_uncertainty: float | None = None,
    unit: str | None = None,
) -> TemperatureModel:
    """Fit the temperature laws to all readings.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        Their coefficients, reading noise and head error.
    start : TemperatureModel
        Laws from the tables, to start from; its hysteresis is kept.
    reference : float
        T0 [degC].
    temperature_uncertainty : float, optional
        Standard uncertainty of the temperature of a run [degC].
    unit : str, optional
        Output unit.

    Returns
    -------
    TemperatureModel
        The laws.

    Notes
    -----
    A head error, a shift of a launch and an error of temperature enter as unknowns with a
    pseudo-reading 0, of the size declared or estimated for them. At the solution the estimator is
    linear, and each component of error goes through it.
    """
    chosen = tables_of_one_mounting(tables, estimate)
    if not np.isfinite([estimate.noises[i].factor for i in chosen]).all():
        return start  # nothing tells the noise, so nothing can weigh a reading
    sides = tuple(side for side in ("above", "below") if getattr(start.k0, side) is not None)
    own = [tables[i] for i in chosen]
    outputs = np.concatenate([estimate.outputs[i] for i in chosen])
    readings = _stack(own, outputs, estimate.names[chosen[0]], reference, sides)
    parameters = _starting_values(start, sides, readings.common.shape[1])
    for _ in range(_MOST_STEPS):
        sources = _sources(readings, parameters, tables, estimate, temperature_uncertainty)
        through = _estimator(readings.jacobian(parameters), sources)
        step = through @ (readings.output - readings.model(parameters))
        parameters = parameters + step
        if np.abs(step).max() < 1e-14:
            break
    of_laws = through[: 3 * readings.law.shape[1]]
    components = {name: _component(of_laws, source) for name, source in sources.items()}
    return named_model(
        parameters[: of_laws.shape[0]],
        components,
        sides,
        unit,
        hysteresis=start.hysteresis,
        warnings=start.warnings,
    )


def _stack(
    tables: Sequence[PreparedTable],
    outputs: Array,
    names: Sequence[str],
    reference: float,
    sides: Sequence[str],
) -> _Readings:
    design = np.concatenate([table.design for table in tables])
    rise = np.concatenate([_temperatures(table) for table in tables]) - reference
    common = design[:, [COEFFICIENTS.index(name) for name in _COMMON if name in names]]
    reached = reached_by(tables)
    if reached is not None:  # the hysteresis is a part of the bias, +h after heating
        of_reading = np.repeat(reached, [len(table.record) for table in tables])
        common = np.column_stack([common, of_reading])
    return _Readings(
        output=outputs,
        a_i=design[:, COEFFICIENTS.index("K1")],
        cross=design[:, COEFFICIENTS.index("M")],
        common=common,
        law=bilinear_design(rise, sides),
        slope=local_slopes(rise, sides),
    )


def _temperatures(table: PreparedTable) -> Array:
    """Temperature of each reading, that of the run where it is unknown [degC]."""
    own = table.record.temperature
    return np.where(np.isfinite(own), own, table.record.mean_temperature)


def _starting_values(start: TemperatureModel, sides: Sequence[str], common: int) -> Array:
    """Parameters of the laws from the tables; what is common to all temperatures starts at 0."""
    k0, K1, delta = (_values(law, sides) for law in (start.k0, start.K1, start.delta))
    K1[1:] *= K1[0]
    return np.concatenate([k0, K1, delta, np.zeros(common)])


def _values(law: BilinearLaw, sides: Sequence[str]) -> Array:
    return np.array([getattr(law, name).value for name in ("at_T0", *sides)])


def _sources(
    readings: _Readings,
    parameters: Array,
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    temperature_uncertainty: float | None,
) -> Mapping[str, _Source]:
    """Errors of the readings by source; the first, new in each reading, is diagonal."""
    chosen = tables_of_one_mounting(tables, estimate)
    runs = [int(tables[i].record.run[0]) for i in chosen]
    index = np.searchsorted(sorted({int(t.record.run[0]) for t in tables}), runs)
    of_table = np.repeat(np.eye(len(chosen)), [len(tables[i].record) for i in chosen], axis=0)
    K1 = (readings.law @ readings.laws(parameters)[1])[:, None]
    spread = [estimate.noises[i].factor * tables[i].scatter for i in chosen]
    head = [
        sensitivity(tables[i], estimate.coefficients[i], estimate.head.positions) for i in chosen
    ]
    bias, scale = estimate.bias_shift, estimate.scale_factor_shift
    heat = readings.by_temperature(parameters)[:, None] * (temperature_uncertainty or 0.0)
    return {
        "reading": _Source(
            np.concatenate(spread), float(sum(estimate.noises[i].dof for i in chosen))
        ),
        "head": _Source(estimate.head.uncertainty * np.concatenate(head), estimate.head.dof),
        "launch": _Source(K1 * of_table * bias.of_run[index], float(bias.dof_of_run.min())),
        "launch_sf": _Source(
            K1 * readings.a_i[:, None] * of_table * scale.of_run[index],
            float(scale.dof_of_run.min()),
        ),
        "temperature": _Source(heat * of_table, np.inf),
    }


def _estimator(jacobian: Array, sources: Mapping[str, _Source]) -> Array:
    """Map from residuals to a step of the parameters, generalised least squares."""
    spread = sources["reading"].acting
    errors = np.hstack([source.acting for name, source in sources.items() if name != "reading"])
    errors = errors[:, np.abs(errors).max(axis=0) > 0.0]
    known = np.hstack([np.zeros((errors.shape[1], jacobian.shape[1])), np.eye(errors.shape[1])])
    system = np.vstack([np.hstack([jacobian, errors]) / spread[:, None], known])
    return LeastSquares(system).map[: jacobian.shape[1], : spread.size] / spread


def _component(through: Array, source: _Source) -> Component:
    passed = through * source.acting if source.acting.ndim == 1 else through @ source.acting
    return Component(passed @ passed.T, np.full(through.shape[0], source.dof))
