"""All tables of one record estimated together: coefficients, and the components of their errors.

Tables share the head, so their coefficients are correlated; each table keeps its own coefficients.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.estimate.head import HeadError, LackOfFit, head_error, lack_of_fit, sensitivity
from accelcal.estimate.launch import RunShift, reached_by, run_shift
from accelcal.estimate.linear import METHODS, LinearEstimator, linear_estimator
from accelcal.estimate.noise import ReadingNoise, reading_noise
from accelcal.estimate.rounding import rounding
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.estimate.unrepeated import told_apart
from accelcal.grouping import decimal_step, distinct, grouped
from accelcal.model import COEFFICIENTS
from accelcal.record import Apparatus

__all__ = ["JointEstimate", "estimate_jointly"]

Array = NDArray[np.float64]

_BIAS = COEFFICIENTS.index("K0")
_SCALE_FACTOR = COEFFICIENTS.index("K1")


class JointEstimate(NamedTuple):
    """Coefficients of all tables with the components of their errors.

    Attributes
    ----------
    outputs : tuple of ndarray
        Readings that were fitted: pseudo-values where the fit is robust [output unit].
    names : tuple of tuple of str
        Coefficients that are estimated in each table.
    stands_for : tuple of mapping
        What they really tell in each table, see `LinearEstimator`.
    coefficients : tuple of ndarray, shape (6,)
        Coefficients of each table, zero where not estimated [output unit / g^n].
    residuals : tuple of ndarray
        Reading minus model, for each reading of each table [output unit].
    noises : tuple of ReadingNoise
        Reading noise of each table.
    head : HeadError
        Head error and what is seen of it.
    lack_of_fit : LackOfFit
        Contrasts of the position means.
    bias_shift, scale_factor_shift : RunShift
        Shift from run to run of the bias [g] and of the scale factor (relative).
    components : mapping of str to Component
        ``reading``, ``head``, ``launch``, ``launch_sf`` and ``resolution``: components of the
        errors of all coefficients of all tables, table after table.
    alike : mapping of str to Component
        ``launch`` and ``launch_sf`` with the shifts of all runs alike, see `RunShift.alike`.
    """

    outputs: tuple[Array, ...]
    names: tuple[tuple[str, ...], ...]
    stands_for: tuple[Mapping[str, str], ...]
    coefficients: tuple[Array, ...]
    residuals: tuple[Array, ...]
    noises: tuple[ReadingNoise, ...]
    head: HeadError
    lack_of_fit: LackOfFit
    bias_shift: RunShift
    scale_factor_shift: RunShift
    components: Mapping[str, Component]
    alike: Mapping[str, Component]

    def part(self, table: int) -> slice:
        """Return the place of one table's coefficients among those of all tables."""
        start = sum(len(names) for names in self.names[:table])
        return slice(start, start + len(self.names[table]))


class _Errors(NamedTuple):
    """What the least-squares fit says about the errors of the readings."""

    coefficients: list[Array]
    noises: list[ReadingNoise]
    lack_of_fit: LackOfFit
    head: HeadError
    acting: list[Array]


def estimate_jointly(
    tables: Sequence[PreparedTable],
    apparatus: Apparatus,
    *,
    method: str = METHODS[0],
    robust: bool = False,
    delta0: float = 0.0,
) -> JointEstimate:
    """Estimate the coefficients of all tables of one record.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables.
    apparatus : Apparatus
        What is declared of the stand.
    method : str, default "least-squares"
        One of `accelcal.estimate.linear.METHODS`.
    robust : bool, default False
        Make the readings safe against outliers first.
    delta0 : float, default 0
        Fixture angle [rad].

    Returns
    -------
    JointEstimate
        Coefficients, residuals and error components.

    Raises
    ------
    InputError
        If the method is unknown.
    DesignError
        If a closed form meets a table that is not an 8-position test.

    Notes
    -----
    Whatever the method, noise and head error are judged by the least-squares fit. Least squares
    then takes what the lack of fit shows of the head's errors out of the readings, which makes it
    generalised least squares; the closed forms take the readings as they are.
    """
    outputs = [_readings(table, robust) for table in tables]
    estimators = [linear_estimator(table, method, delta0) for table in tables]
    errors = _judge_errors(tables, outputs, apparatus, predict=method == METHODS[0])
    coefficients = [
        # two terms, because taking the small one off the readings would round them
        estimator.coefficients(y) - estimator.expand(estimator.map @ acting @ errors.head.predicted)
        for estimator, y, acting in zip(estimators, outputs, errors.acting, strict=True)
    ]
    reading = _reading_component(estimators, errors)
    bias, scale_factor = _run_shifts(estimators, errors, reading, apparatus)
    return JointEstimate(
        outputs=tuple(outputs),
        names=tuple(estimator.names for estimator in estimators),
        stands_for=tuple(estimator.stands_for for estimator in estimators),
        coefficients=tuple(coefficients),
        residuals=tuple(
            t.record.output - t.design @ k for t, k in zip(tables, coefficients, strict=True)
        ),
        noises=tuple(errors.noises),
        head=errors.head,
        lack_of_fit=errors.lack_of_fit,
        bias_shift=bias,
        scale_factor_shift=scale_factor,
        components={
            "reading": reading,
            "head": _head_component(estimators, errors),
            "launch": _shift_component(estimators, errors, "K0", bias),
            "launch_sf": _shift_component(estimators, errors, "K1", scale_factor),
            "resolution": _resolution_component(estimators, errors, apparatus.resolution),
        },
        alike={
            "launch": _shift_component(estimators, errors, "K0", bias.alike()),
            "launch_sf": _shift_component(estimators, errors, "K1", scale_factor.alike()),
        },
    )


def _readings(table: PreparedTable, robust: bool) -> Array:
    if not robust:
        return table.record.output
    from accelcal.estimate.robust import pseudo_values

    return pseudo_values(table.record.output, table.head, table.scatter)


def _judge_errors(
    tables: Sequence[PreparedTable], outputs: list[Array], apparatus: Apparatus, *, predict: bool
) -> _Errors:
    coefficients = [
        linear_estimator(table).coefficients(y) for table, y in zip(tables, outputs, strict=True)
    ]
    noises = reading_noise(tables, outputs)
    found = lack_of_fit(tables, outputs, noises, coefficients)
    declared = apparatus.head_uncertainty
    if found.contrasts.size and all(noise.source == "residuals" for noise in noises):
        told = told_apart(found, noises[0].dof, declared)
        noises = [
            noise._replace(factor=told.noise * noise.factor, dof=told.noise_dof) for noise in noises
        ]
        found = found.in_units_of(told.noise)
        head = head_error(found, declared, told_apart=told.head)
    else:
        separable = all(noise.source not in ("residuals", "none") for noise in noises)
        head = head_error(found, declared, separable=separable)
    return _Errors(
        coefficients=coefficients,
        noises=noises,
        lack_of_fit=found,
        head=head if predict else head.without_prediction(),
        acting=[
            sensitivity(table, k, found.positions)
            for table, k in zip(tables, coefficients, strict=True)
        ],
    )


def _influence(estimators: Sequence[LinearEstimator], errors: _Errors) -> Array:
    """Matrix that brings the head's errors into all coefficients, shape (sum of p, J)."""
    return np.concatenate(
        [e.map @ acting for e, acting in zip(estimators, errors.acting, strict=True)]
    )


def _reading_component(estimators: Sequence[LinearEstimator], errors: _Errors) -> Component:
    spreads = [
        e.map * (noise.factor * e.table.scatter)
        for e, noise in zip(estimators, errors.noises, strict=True)
    ]
    through_head = _influence(estimators, errors) @ errors.head.from_noise
    return Component(
        _block_diagonal([spread @ spread.T for spread in spreads]) + through_head @ through_head.T,
        _per_coefficient(estimators, [noise.dof for noise in errors.noises]),
    )


def _head_component(estimators: Sequence[LinearEstimator], errors: _Errors) -> Component:
    missed = errors.head.uncertainty * _influence(estimators, errors) @ errors.head.unseen
    return Component(missed @ missed.T, np.full(missed.shape[0], errors.head.dof))


def _shift_component(
    estimators: Sequence[LinearEstimator], errors: _Errors, name: str, shift: RunShift
) -> Component:
    """Shift of one coefficient from run to run, common to the mountings of a run."""
    runs, index, _ = grouped(np.array([e.table.record.run[0] for e in estimators]))
    by_run = np.concatenate(
        [
            k[_SCALE_FACTOR] * np.outer(e.unit(name), shift.of_run * (np.arange(runs.size) == i))
            for e, k, i in zip(estimators, errors.coefficients, index, strict=True)
        ]
    )
    return Component(by_run @ by_run.T, _per_coefficient(estimators, shift.dof_of_run[index]))


def _resolution_component(
    estimators: Sequence[LinearEstimator], errors: _Errors, step: float | None
) -> Component:
    """Rounding errors that the reading noise does not hold."""
    blocks = []
    for estimator, noise in zip(estimators, errors.noises, strict=True):
        table = estimator.table
        q = decimal_step(table.record.output) if step is None else step
        size = float(noise.factor * table.scatter.min())
        left = rounding(size, q, seen=noise.source != "declared")
        same_position = distinct(table.head)[:, None] == table.head
        common = left.common * estimator.map @ same_position.T
        own = left.own * estimator.map
        blocks.append(common @ common.T + own @ own.T)
    return Component(_block_diagonal(blocks), np.full(sum(b.shape[0] for b in blocks), np.inf))


def _run_shifts(
    estimators: Sequence[LinearEstimator],
    errors: _Errors,
    reading: Component,
    apparatus: Apparatus,
) -> tuple[RunShift, RunShift]:
    """Shifts of bias [g] and scale factor (relative) from run to run, a table a run."""
    runs = [int(e.table.record.run[0]) for e in estimators]
    tables = [runs.index(run) for run in sorted(set(runs))]
    levels = [estimators[i].table.record.mean_temperature for i in tables]
    k = np.array(errors.coefficients)[tables]
    scale_factor = k[:, _SCALE_FACTOR].mean()
    starts = np.cumsum([0, *(len(e.names) for e in estimators)])

    def of(name: str) -> Array:
        """Variance by the reading noise, NaN where the coefficient is not estimated."""
        variance = np.diagonal(reading.covariance) / scale_factor**2
        names = [(starts[i], estimators[i].names) for i in tables]
        return np.array([variance[s + n.index(name)] if name in n else np.nan for s, n in names])

    bias = k[:, _BIAS] / k[:, _SCALE_FACTOR]
    return (
        run_shift(apparatus.launch_uncertainty, bias, of("K0"), levels, reached_by(levels)),
        run_shift(
            apparatus.launch_sf_uncertainty, k[:, _SCALE_FACTOR] / scale_factor, of("K1"), levels
        ),
    )


def _per_coefficient(estimators: Sequence[LinearEstimator], values: ArrayLike) -> Array:
    """Repeat a value of each table for each of its coefficients."""
    return np.repeat(np.asarray(values, dtype=np.float64), [len(e.names) for e in estimators])


def _block_diagonal(blocks: Sequence[Array]) -> Array:
    edges = np.cumsum([0, *(block.shape[0] for block in blocks)])
    whole = np.zeros((edges[-1], edges[-1]))
    for start, stop, block in zip(edges[:-1], edges[1:], blocks, strict=True):
        whole[start:stop, start:stop] = block
    return whole
