"""Temperature laws from all readings at once, each at its own temperature.

The whole model is a product, nonlinear in its parameters:

    Y = K1(T) [k0(T) + a_i + k2 a_i^2 + k3 a_i^3 + delta(T) a_p + delta_ip a_i a_p]

with bilinear k0, K1 and delta, and with k2, k3 and delta_ip the same at all temperatures. It is
solved by Gauss-Newton steps of generalised least squares, in which the errors of head, launches
and temperatures stand as unknowns of known size.

What is recorded about the mean temperature of a run may be felt by the accelerometer or be noise
of the sensor, and taking the one for the other spoils the slopes. So one more unknown of each run
tells which part of these deviations was felt.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.noise import FEW, ReadingNoise, reading_noise
from accelcal.estimate.solver import LeastSquares
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.grouping import distinct
from accelcal.model import COEFFICIENTS
from accelcal.results.temperature import BilinearLaw, TemperatureModel
from accelcal.temperature.apart_from_head import apart_from_head
from accelcal.temperature.bilinear import named_model
from accelcal.temperature.from_tables import tables_of_one_mounting
from accelcal.temperature.hysteresis import Branches, branches
from accelcal.temperature.pooled_noise import pooled_noise
from accelcal.temperature.product_model import Point, Readings
from accelcal.temperature.run_temperatures import (
    recorded_temperatures,
    run_temperature_uncertainty,
)

__all__ = ["FeltDeviation", "felt_deviations", "laws_from_readings"]

Array = NDArray[np.float64]

_COMMON = ("K2", "K3", "M_ip")  # their quotients by K1 do not depend on temperature
_MOST_STEPS = 30
_CONVERGED = 1e-6  # of the noise of a reading
_SURE = 3.0
_FELT = 0.5
"""Part of the recorded deviations that is felt, before the readings tell, +- as much."""


class _State(NamedTuple):
    """Where the solution stands.

    `felt` is the part of the recorded deviations that each run felt, `doubt` its standard
    uncertainty.
    """

    parameters: Array
    felt: Array
    doubt: Array


class _Source(NamedTuple):
    """What one source of error does to the readings: a column for each independent error.

    The degrees of freedom are those of all columns, or of each row where it acts on the diagonal.
    """

    acting: Array
    dof: Array | float


class _Problem(NamedTuple):
    """The R tables of one mounting with all that is known of their errors."""

    tables: Sequence[PreparedTable]
    indices: Sequence[int]
    runs: NDArray[np.intp]
    readings: Readings
    loop: Branches
    estimate: JointEstimate
    temperature_uncertainty: float | None


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
    pseudo-reading 0, of the size declared or estimated for them; the part of the temperature's
    scatter that a run felt enters with a pseudo-reading 0.5 +- 0.5. At the solution the estimator
    is linear, and each component of error goes through it. The reading noise is the scatter of
    the replicates without what the felt temperatures explain of it.
    """
    chosen = tables_of_one_mounting(tables, estimate)
    if not np.isfinite([estimate.noises[i].factor for i in chosen]).all():
        return start  # nothing tells the noise, so nothing can weigh a reading
    sides = _sides(start)
    problem = _problem(tables, estimate, chosen, reference, sides, temperature_uncertainty)
    state, sources, through = _solved(problem, start)
    of_laws = through[: 3 * (1 + len(sides))]
    return named_model(
        state.parameters[: of_laws.shape[0]],
        {name: _component(of_laws, source) for name, source in sources.items()},
        sides,
        unit,
        hysteresis=start.hysteresis,
        warnings=(*start.warnings, *_unfelt(problem, state)),
    )


class FeltDeviation(NamedTuple):
    """What one table felt of the deviations from its mean temperature that were recorded.

    Attributes
    ----------
    table : int
        Its place among the tables.
    part, doubt : float
        Part that was felt, and its standard uncertainty.
    unfelt : float
        Share of the scatter, as a variance, that the mean of the run keeps.
    to_the_mean : ndarray, shape (n,)
        What brings each reading to the mean temperature [output unit].
    """

    table: int
    part: float
    doubt: float
    unfelt: float
    to_the_mean: Array


def felt_deviations(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    start: TemperatureModel,
    reference: float,
    temperature_uncertainty: float | None = None,
) -> list[FeltDeviation]:
    """Ask all readings which part of the recorded deviations of temperature was felt.

    Parameters
    ----------
    tables, estimate, start, reference, temperature_uncertainty
        See `laws_from_readings`.

    Returns
    -------
    list of FeltDeviation
        One for each table of the mounting with most of them; none where the noise is unknown.
    """
    chosen = tables_of_one_mounting(tables, estimate)
    if not np.isfinite([estimate.noises[i].factor for i in chosen]).all():
        return []
    problem = _problem(tables, estimate, chosen, reference, _sides(start), temperature_uncertainty)
    state = _solved(problem, start)[0]
    # what may be felt in full counts as that: a part of its own would take out noise as well
    in_full = np.abs(1.0 - state.felt) < _SURE * state.doubt
    felt = np.where(in_full, 1.0, _felt_beside_noise(problem, state))
    change = _to_the_mean(problem, state, problem.readings.at(felt))
    edges = np.cumsum([len(table.record) for table in problem.tables])[:-1]
    numbers = state.felt.tolist(), state.doubt.tolist(), _unfelt_share(state).tolist()
    return [
        FeltDeviation(*found)
        for found in zip(chosen, *numbers, np.split(change, edges), strict=True)
    ]


def _sides(start: TemperatureModel) -> tuple[str, ...]:
    return tuple(side for side in ("above", "below") if getattr(start.k0, side) is not None)


def _problem(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    chosen: Sequence[int],
    reference: float,
    sides: Sequence[str],
    temperature_uncertainty: float | None,
) -> _Problem:
    own = [tables[i] for i in chosen]
    outputs = np.concatenate([estimate.outputs[i] for i in chosen])
    loop = branches(own)
    runs = [table.run for table in own]
    return _Problem(
        tables=own,
        indices=chosen,
        runs=np.searchsorted(sorted({t.run for t in tables}), runs),
        readings=_stack(own, outputs, loop, estimate.names[chosen[0]], reference, sides),
        loop=loop,
        estimate=estimate,
        temperature_uncertainty=temperature_uncertainty,
    )


def _stack(
    tables: Sequence[PreparedTable],
    outputs: Array,
    loop: Branches,
    names: Sequence[str],
    reference: float,
    sides: Sequence[str],
) -> Readings:
    design = np.concatenate([table.design for table in tables])
    temperature = np.concatenate([recorded_temperatures(table) for table in tables])
    of_table = _by_table(tables)
    mean = of_table @ [table.record.mean_temperature for table in tables]
    common = design[:, [COEFFICIENTS.index(name) for name in _COMMON if name in names]]
    return Readings(
        output=outputs,
        a_i=design[:, COEFFICIENTS.index("K1")],
        cross=design[:, COEFFICIENTS.index("M")],
        # the hysteresis is a part of the bias, +h after heating
        common=np.column_stack([common, of_table @ loop.paired]),
        rise=mean - reference,
        deviation=(temperature - mean)[:, None] * of_table,
        sides=sides,
    )


def _by_table(tables: Sequence[PreparedTable]) -> Array:
    """Ones where a reading belongs to a table, shape (n, R)."""
    return np.repeat(np.eye(len(tables)), [len(table.record) for table in tables], axis=0)


def _solved(
    problem: _Problem, start: TemperatureModel
) -> tuple[_State, Mapping[str, _Source], Array]:
    """Gauss-Newton: the solution, the errors of the readings there, and the estimator."""
    readings = problem.readings
    part = np.full(len(problem.tables), _FELT)
    state = _State(_starting_values(start, readings), part, part)
    for _ in range(_MOST_STEPS):
        point = readings.at(state.felt)
        sources = _sources(problem, state, point)
        solution, doubt = _estimator(point.jacobian(state.parameters), sources)
        left = readings.output - point.model(state.parameters)
        left = left + sources["felt"].acting @ (state.felt / _FELT - 1.0)
        step, felt = np.split(solution @ left, [state.parameters.size])
        before = state
        state = _State(before.parameters + step, _FELT * (1.0 + felt), _FELT * doubt)
        moved = point.jacobian(before.parameters) @ step
        moved = moved + sources["felt"].acting @ (state.felt - before.felt) / _FELT
        if (np.abs(moved) < _CONVERGED * sources["reading"].acting).all():
            break
    return state, sources, solution[: state.parameters.size]


def _starting_values(start: TemperatureModel, readings: Readings) -> Array:
    """Parameters of the laws from the tables; what is common to all temperatures starts at 0."""
    k0, K1, delta = (_values(law, readings.sides) for law in (start.k0, start.K1, start.delta))
    K1[1:] *= K1[0]
    return np.concatenate([k0, K1, delta, np.zeros(readings.common.shape[1])])


def _values(law: BilinearLaw, sides: Sequence[str]) -> Array:
    return np.array([getattr(law, name).value for name in ("at_T0", *sides)])


def _sources(problem: _Problem, state: _State, point: Point) -> dict[str, _Source]:
    """Errors of the readings by source; the first, new in each reading, is diagonal."""
    tables, estimate = problem.tables, problem.estimate
    of_table = _by_table(tables)
    noises = pooled_noise(_noises(problem, state, point), [t.scatter_dof is None for t in tables])
    spread = [noise.factor * table.scatter for noise, table in zip(noises, tables, strict=True)]
    # repeated, as `of_table` would take its zeros times the infinite ones of a declared noise
    dof_of_noise = np.repeat([noise.dof for noise in noises], [len(t.record) for t in tables])
    head = [
        table.of_head(estimate.coefficients[i], estimate.head.positions)
        for table, i in zip(tables, problem.indices, strict=True)
    ]
    bias, scale = estimate.bias_shift, estimate.scale_factor_shift
    K1 = point.scale_factor(state.parameters)[:, None] * of_table
    heat = point.by_temperature(state.parameters)[:, None]
    uncertain, dof = run_temperature_uncertainty(
        tables, problem.temperature_uncertainty, _unfelt_share(state)
    )
    half_widths = state.parameters[state.parameters.size - problem.loop.paired.shape[1] :]
    return {
        "reading": _Source(np.concatenate(spread), dof_of_noise),
        "head": _Source(estimate.head.uncertainty * np.concatenate(head), estimate.head.dof),
        "launch": _Source(K1 * bias.scatter, bias.dof),
        "launch_sf": _Source(K1 * problem.readings.a_i[:, None] * scale.scatter, scale.dof),
        "temperature": _Source(heat * of_table * uncertain, float(dof.min())),
        "hysteresis": _Source(K1 @ problem.loop.off_the_middle(half_widths), np.inf),
        "felt": _Source(heat * problem.readings.deviation * _FELT, np.inf),
    }


def _unfelt_share(state: _State) -> Array:
    """Share of the recorded scatter that the mean of each run keeps, as it was not felt."""
    return np.clip(1.0 - state.felt + 2.0 * state.doubt, 0.0, 1.0)


def _noises(problem: _Problem, state: _State, point: Point) -> list[ReadingNoise]:
    """Reading noise of each table, once the outputs are brought to the mean of their run."""
    felt = _felt_beside_noise(problem, state)
    if (felt != state.felt).any():
        point = problem.readings.at(felt)
    outputs = problem.readings.output + _to_the_mean(problem, state, point)
    edges = np.cumsum([len(table.record) for table in problem.tables])[:-1]
    noises = reading_noise(problem.tables, np.split(outputs, edges))
    took = np.any(problem.readings.deviation, axis=0) & (felt == state.felt)
    return [_one_less(n) if one else n for n, one in zip(noises, took.tolist(), strict=True)]


def _felt_beside_noise(problem: _Problem, state: _State) -> Array:
    """Felt parts, all or nothing where a fitted one would take the few replicates for itself."""
    replicates = [len(table.record) - distinct(table.head).size for table in problem.tables]
    return np.where(np.array(replicates) < FEW, np.round(state.felt), state.felt)


def _to_the_mean(problem: _Problem, state: _State, point: Point) -> Array:
    """What brings each output to the mean temperature of its run, shape (n,)."""
    still = problem.readings.at(np.zeros(state.felt.size))
    return still.model(state.parameters) - point.model(state.parameters)


def _one_less(noise: ReadingNoise) -> ReadingNoise:
    """Take off the degree of freedom that the felt part took."""
    if noise.source == "declared" or noise.dof < 2.0:
        return noise
    left = noise.dof - 1.0
    return noise._replace(factor=noise.factor * (noise.dof / left) ** 0.5, dof=left)


def _estimator(jacobian: Array, sources: Mapping[str, _Source]) -> tuple[Array, Array]:
    """Generalised least squares: the map from residuals to a step of the parameters.

    Last it has the felt parts in units of their prior; their uncertainty stands beside it.
    """
    spread, felt = sources["reading"].acting, sources["felt"].acting
    apart = apart_from_head(sources["head"].acting / spread[:, None])
    alone = ("reading", "felt", "head")
    errors = np.hstack([own.acting for name, own in sources.items() if name not in alone])
    errors = np.hstack([errors[:, np.abs(errors).max(axis=0) > 0.0], felt])
    known = np.hstack([np.zeros((errors.shape[1], jacobian.shape[1])), np.eye(errors.shape[1])])
    system = np.vstack([apart(np.hstack([jacobian, errors]) / spread[:, None]), known])
    solution = LeastSquares(system).map
    of_felt = solution[solution.shape[0] - felt.shape[1] :]
    wanted = np.vstack([solution[: jacobian.shape[1]], of_felt])[:, : spread.size]
    return apart(wanted.T).T / spread, np.sqrt((of_felt**2).sum(axis=1))


def _component(through: Array, source: _Source) -> Component:
    if source.acting.ndim == 1:
        passed = through * source.acting
        shares = passed**2 / (passed**2).sum(axis=1, keepdims=True)
        with np.errstate(divide="ignore"):  # a declared noise has no end of degrees of freedom
            dof = 1.0 / (shares @ (1.0 / np.asarray(source.dof)))
        return Component(passed @ passed.T, dof)
    passed = through @ source.acting
    return Component(passed @ passed.T, np.full(through.shape[0], source.dof))


def _unfelt(problem: _Problem, state: _State) -> Iterator[str]:
    """Say where most of the recorded scatter is that of the sensor."""
    unfelt = state.felt + 2.0 * state.doubt < _FELT
    own = [table for table, found in zip(problem.tables, unfelt, strict=True) if found]
    if own:
        names = ", ".join(t.run_label for t in own)
        scatter = max(recorded_temperatures(table).std(ddof=1) for table in own)
        yield (
            f"run{'s' if len(own) > 1 else ''} {names}: the readings do not follow the recorded"
            f" temperatures, which scatter by {scatter:.2g} degC; taken as noise of the sensor, and"
            " the mean of a run as its temperature"
        )
