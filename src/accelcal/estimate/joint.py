"""All tables of one record estimated together: coefficients, and the components of their errors.

Tables share the head, so their coefficients are correlated; each table keeps its own coefficients.
Records of one plan, with the same angles, strokes, mountings and declarations, are estimated
together: what follows from the plan is worked out once, and all else has an axis of the records.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arrays import Array, Places
from accelcal.estimate.contrasts import LackOfFit
from accelcal.estimate.correlated_noise import Correlation, correlation
from accelcal.estimate.error_components import Errors, influence_of_head
from accelcal.estimate.head import HeadError, head_error, lack_of_fit
from accelcal.estimate.launch import RunShift, reached_by, run_shift
from accelcal.estimate.many_positions import ManyPositions
from accelcal.estimate.noise import ReadingNoise, noise_of_stack
from accelcal.estimate.tables import (
    METHODS,
    LinearEstimator,
    PreparedTable,
    linear_estimator,
    positions_of,
)
from accelcal.estimate.uncertainty import Component
from accelcal.estimate.uneven_noise import UnevenNoise, uneven_noises
from accelcal.estimate.unrepeated import told_apart
from accelcal.model import BIAS, SCALE_FACTOR
from accelcal.numerics.decimal_steps import decimal_steps

if TYPE_CHECKING:
    from accelcal.results.head_calibration import HeadCalibration


class JointEstimate(NamedTuple):
    """Coefficients of all tables with the components of their errors.

    All arrays, those of the parts too, begin with an axis of the records where they are of a stack.

    Attributes
    ----------
    outputs : tuple of ndarray, shape (..., n)
        Readings that were fitted, pseudo-values where the fit is robust; NaN at gaps [output unit].
    names : tuple of tuple of str
        Coefficients that are estimated in each table.
    stands_for : tuple of mapping
        What they really tell in each table, see `LinearEstimator`.
    coefficients : tuple of ndarray, shape (..., 6)
        Coefficients of each table, zero where not estimated [output unit / g^n].
    judged : tuple of ndarray, shape (..., 6)
        Those of plain least squares, from the readings as they are, whatever the method.
    residuals : tuple of ndarray, shape (..., n)
        Reading minus model, for each reading of each table, NaN at gaps [output unit].
    noises : tuple of ReadingNoise
        Reading noise of each table.
    uneven : tuple of UnevenNoise
        Noise of each table by position, which counts where it differs.
    correlation : Correlation
        Correlation of each reading with the next one, which counts where it is significant.
    head : HeadError
        Head error.
    lack_of_fit : LackOfFit or ManyPositions
        Contrasts of the position means.
    bias_shift, scale_factor_shift : RunShift
        Shift from run to run of the bias [g] and of the scale factor (relative).
    steps : tuple of ndarray, shape (...)
        Decimal step in which the readings of each table come, see `decimal_steps` [output unit].
    resolution : tuple of ndarray, shape (...)
        Step to which the readings of each table are rounded: as declared, else `steps`.
    components : mapping of str to Component
        ``reading`` and, where there are such errors, ``head``, ``launch``, ``launch_sf`` and
        ``resolution``: components of the errors of all coefficients of all tables, table after
        table.
    alike : mapping of str to Component
        Estimated ``launch`` and ``launch_sf`` with the shifts of all runs alike, see
        `RunShift.alike`.
    """

    outputs: tuple[Array, ...]
    names: tuple[tuple[str, ...], ...]
    stands_for: tuple[Mapping[str, str], ...]
    coefficients: tuple[Array, ...]
    judged: tuple[Array, ...]
    residuals: tuple[Array, ...]
    noises: tuple[ReadingNoise, ...]
    uneven: tuple[UnevenNoise, ...]
    correlation: Correlation
    head: HeadError
    lack_of_fit: LackOfFit | ManyPositions
    bias_shift: RunShift
    scale_factor_shift: RunShift
    steps: tuple[Array, ...]
    resolution: tuple[Array, ...]
    components: Mapping[str, Component]
    alike: Mapping[str, Component]

    def part(self, table: int) -> slice:
        """Return the place of one table's coefficients among those of all tables."""
        start = sum(map(len, self.names[:table]))
        return slice(start, start + len(self.names[table]))

    def place(self, table: int, name: str) -> int:
        """Return the place of one coefficient of a table among those of all tables."""
        return int(self.part(table).start) + self.names[table].index(name)

    def readings(self, table: int) -> Places:
        """How many readings one table has, shape (...)."""
        return np.asarray((~np.isnan(self.residuals[table])).sum(axis=-1))

    def dof(self, table: int) -> Places:
        """Degrees of freedom of the residuals of one table, shape (...)."""
        return self.readings(table) - len(self.names[table])

    def residual_rms(self, table: int) -> Array:
        """Root of the sum of squares over `dof` of one table, 0 where that is 0, shape (...)."""
        residual, dof = self.residuals[table], self.dof(table)
        if np.isnan(residual).any():
            residual = np.nan_to_num(residual)
        squares = np.einsum("...n,...n->...", residual, residual)
        return np.asarray(np.sqrt(squares / np.where(dof > 0, dof, np.inf)))

    def of_records(self, records: int | slice) -> JointEstimate:
        """Return that of some records of a stack, or of one alone, whose place takes the axis away.

        They are views, as copies of the covariances of many tables take long.

        Examples
        --------
        >>> import accelcal
        >>> from accelcal.calibrate.options import Options
        >>> from accelcal.calibrate.plan import OnePlan
        >>> from accelcal.calibrate.stack import calibration_stack
        >>> plan = OnePlan.of([accelcal.simulate(seed=seed) for seed in (1, 2, 3)])
        >>> whole = calibration_stack(plan, Options()).estimate
        >>> [whole.of_records(one).coefficients[0].shape for one in (slice(1, 3), slice(1, 2), 1)]
        [(2, 6), (1, 6), (6,)]
        """
        return JointEstimate(*(_of_records(part, records) for part in self))


def _of_records(part: Any, records: int | slice) -> Any:
    """Take some records of a part of an estimate, or one alone; names are those of all."""
    if isinstance(part, np.ndarray):
        return part[records]
    if hasattr(part, "of_records"):
        return part.of_records(records)
    if isinstance(part, Mapping):
        return {name: _of_records(own, records) for name, own in part.items()}
    return tuple(_of_records(own, records) for own in part) if isinstance(part, tuple) else part


def estimate_stack(
    tables: Sequence[PreparedTable],
    outputs: Sequence[Array],
    levels: Array,
    apparatus: Apparatus,
    *,
    method: str = METHODS[0],
    robust: bool = False,
    delta0: float = 0.0,
    head: HeadCalibration | None = None,
) -> JointEstimate:
    """Estimate the coefficients of all tables of R records of one plan.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of any of the records: their angles and their declared scatter count, which all
        records have alike.
    outputs : sequence of ndarray, shape (R, n)
        Readings of each table in all records [output unit].
    levels : ndarray, shape (R, tables)
        Mean temperature of each table, NaN where unknown [degC]; in all records the same runs
        share a level, and were reached alike.
    apparatus : Apparatus
        What is declared of the stand.
    method : str, default "least-squares"
        One of `accelcal.estimate.tables.METHODS`.
    robust : bool, default False
        Make the readings safe against outliers first.
    delta0 : float, default 0
        Fixture angle [rad].
    head : HeadCalibration, optional
        Calibration of the head, by which the readings were corrected already: what it leaves
        uncertain takes the place of the declared uncertainty.

    Returns
    -------
    JointEstimate
        Coefficients, residuals and error components of all records.

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
    estimators = [linear_estimator(table, method, delta0) for table in tables]
    readings = [_readings(table, y, robust) for table, y in zip(tables, outputs, strict=True)]
    digits = tuple(map(decimal_steps, outputs))
    declared = apparatus.resolution
    steps = digits if declared is None else tuple(np.full_like(d, declared) for d in digits)
    predict = method == METHODS[0]
    errors = _judge(estimators, readings, steps, apparatus, head, predict=predict)
    coefficients = _coefficients(estimators, readings, errors, method)
    reading = errors.reading()
    bias, scale_factor = _run_shifts(errors, reading, levels, apparatus)
    shifts = {"launch": bias, "launch_sf": scale_factor}
    return JointEstimate(
        outputs=tuple(map(_own, tables, readings)),
        names=tuple(estimator.names for estimator in estimators),
        stands_for=tuple(estimator.stands_for for estimator in estimators),
        coefficients=tuple(coefficients),
        judged=tuple(_by_least_squares(tables, outputs) if robust else errors.fitted),
        residuals=tuple(
            _own(t, y - k @ t.design.T)
            for t, y, k in zip(tables, outputs, coefficients, strict=True)
        ),
        noises=tuple(errors.noises),
        uneven=tuple(errors.uneven),
        correlation=errors.correlation,
        head=errors.of_head,
        lack_of_fit=errors.lack_of_fit,
        bias_shift=bias,
        scale_factor_shift=scale_factor,
        steps=digits,
        resolution=steps,
        components={
            "reading": reading,
            **errors.head(),
            **errors.shifts(shifts),
            **errors.resolution(steps),
        },
        alike=errors.shifts({n: s.alike() for n, s in shifts.items() if s.source == "estimated"}),
    )


def _own(table: PreparedTable, values: Array) -> Array:
    """Values of readings, NaN at gaps."""
    return values if table.scatter.ndim == 1 else np.where(np.isinf(table.scatter), np.nan, values)


def _readings(table: PreparedTable, output: Array, robust: bool) -> Array:
    if not robust:
        return output
    from accelcal.estimate.robust import pseudo_values

    return pseudo_values(output, table.head, table.scatter)


def _coefficients(
    estimators: Sequence[LinearEstimator], readings: Sequence[Array], errors: Errors, method: str
) -> list[Array]:
    """Coefficients of each table, without what the head errors that are seen do to them."""
    whole = errors.fitted
    if method != METHODS[0]:
        whole = [e.coefficients(y) for e, y in zip(estimators, readings, strict=True)]
    # The small term is subtracted here and not from the readings, whose last digits it would round.
    parts = zip(estimators, whole, errors.predicted(), strict=True)
    return [k - estimator.expand(small) for estimator, k, small in parts]


def _by_least_squares(tables: Sequence[PreparedTable], outputs: Sequence[Array]) -> list[Array]:
    pairs = zip(tables, outputs, strict=True)
    return [linear_estimator(table).coefficients(y) for table, y in pairs]


def _judge(
    estimators: Sequence[LinearEstimator],
    readings: Sequence[Array],
    steps: Sequence[Array],
    apparatus: Apparatus,
    known: HeadCalibration | None,
    *,
    predict: bool,
) -> Errors:
    tables = [estimator.table for estimator in estimators]
    coefficients = _by_least_squares(tables, readings)
    noises = noise_of_stack(tables, readings)
    declared, root = apparatus.head_uncertainty, None
    if known is not None:
        positions = positions_of(tables)
        declared, root = known.spread_over(positions)
    of_means = [n.with_rounding(t, step) for n, t, step in zip(noises, tables, steps, strict=True)]
    found = lack_of_fit(tables, readings, of_means, coefficients, root)
    # one record speaks for all: noise that is not declared has the same source in each of them
    sources = {source for noise in noises for source in noise.source[:1].tolist()}
    if found.number.any() and sources == {"residuals"}:
        told = told_apart(found, float(noises[0].dof[0]), declared)
        noises = [n._replace(factor=told.noise * n.factor, dof=told.noise_dof) for n in noises]
        found = found.in_units_of(told.noise)
        head = head_error(found, declared, told_apart=told.head)
    else:
        head = head_error(found, declared, separable=not sources & {"residuals", "none"})
    seen = found.seen(head.uncertainty if predict else np.zeros_like(head.uncertainty))
    uneven = uneven_noises(tables, readings, noises, steps)
    memory = correlation(tables, readings, steps)
    acting = influence_of_head(estimators, coefficients, head.positions, root)
    return Errors(estimators, coefficients, noises, found, head, seen, uneven, memory, acting)


def _run_shifts(
    errors: Errors, reading: Component, levels: Array, apparatus: Apparatus
) -> tuple[RunShift, RunShift]:
    """Shifts of bias [g] and scale factor (relative) from run to run, a table a run."""
    estimators = errors.estimators
    runs = [e.table.run for e in estimators]
    tables = [runs.index(run) for run in sorted(set(runs))]
    at = levels[:, tables]
    k = np.stack([errors.fitted[i] for i in tables], axis=1)
    scale_factor = k[:, :, SCALE_FACTOR].mean(axis=1, keepdims=True)
    starts = np.cumsum([0, *(len(e.names) for e in estimators)])
    variance = reading.variances / scale_factor**2

    def of(name: str) -> Array:
        """Variance by the reading noise, NaN where the coefficient is not estimated."""
        unknown = np.full(len(variance), np.nan)
        names = [(starts[i], estimators[i].names) for i in tables]
        own = [variance[:, s + n.index(name)] if name in n else unknown for s, n in names]
        return np.stack(own, axis=1)

    bias = k[:, :, BIAS] / k[:, :, SCALE_FACTOR]
    relative = k[:, :, SCALE_FACTOR] / scale_factor
    reached = reached_by(at[0])
    return (
        run_shift(apparatus.launch_uncertainty, bias, of("K0"), at, reached),
        run_shift(apparatus.launch_sf_uncertainty, relative, of("K1"), at),
    )
