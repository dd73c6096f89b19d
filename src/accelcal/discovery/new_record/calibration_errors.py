"""Errors of a calibration: what the head did to it, position by position, and all the rest.

A new record on the same head has the same errors of the positions. What they did to the calibration
they do to the record again, so that most of it is not a difference. To know how much, the errors of
the coefficients are split: with A the change of the coefficients by the error of each position and
u the standard uncertainty of one, C = u^2 A A' + rest.

Least squares of a table gives A = X+ Z, Z what the errors of the positions do to the readings and
X+ the estimator. It takes out what the lack of fit shows of the head, by best linear prediction:
with Q the projector off the model and s the noise of a reading, what is missed of the errors is
(1 + u^2/s^2 sum Z'QZ)^-1 times them, the sum over all tables.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.compensate.coefficients import OF_ONE_AXIS, PARAMETERS, SLOPES, Compensation
from accelcal.compensate.of_table import cross_name, estimator_of
from accelcal.discovery.new_record.simulated import (
    ERRORS,
    Simulated,
    freed_angle,
    is_freed,
    known_noise,
    simulated_readings,
)
from accelcal.errors import InputError
from accelcal.estimate.tables import METHODS, LinearEstimator
from accelcal.estimate.uncertainty import counted
from accelcal.model import COEFFICIENTS
from accelcal.numerics.covariance import covariance_root
from accelcal.numerics.grouping import distinct
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.calibration import Calibration
from accelcal.results.table import TableCalibration
from accelcal.results.tables_in_use import nearest_of_mountings, tables_in_use

_DELTA, _OTHER, _DELTA0 = (ERRORS.index(name) for name in ("delta", "other delta", "delta0"))
_MAIN = [*range(len(PARAMETERS))]
_ACROSS = [*_MAIN[:_DELTA], _OTHER, _OTHER + 1]
"""Places of the parameters of a table in either cross axis."""

_MOST_POSITIONS = 1000
"""Head positions above which what each did is not worked out, in matrices of their squares."""

_UNBOUNDED = np.array([1e-4 if "slope" in name else 1.0 for name in ERRORS])
"""Variances of what nothing bounds [1, g^2 or rad^2], of slopes as much over 100 degC: were they
larger, the noise of the readings would be lost in their rounding."""

_ROUNDING = 1e-12
"""Part of the largest eigenvalue below which one is a rounding error."""

_NOT_TOLD = np.empty(0), np.zeros((len(ERRORS), 0))


class CalibrationErrors(NamedTuple):
    """Errors of a calibration, over `ERRORS`."""

    rest: Array  # covariance of all but those by the head, (18, 18)
    dof: Array  # degrees of freedom of each error, that by the head among it, (18,)
    by_head: Array  # what the error of each head position does to them, (18, J) [per rad]
    positions: Array  # the head positions, (J,) [deg]
    head: float  # standard uncertainty of a position as the calibration had it [rad]
    head_dof: float  # degrees of freedom of that
    hysteresis: float  # the bias is on either side of its law by as much [g]

    @property
    def unbounded(self) -> Mask:
        """Which errors nothing bounds, shape (18,)."""
        return np.diagonal(self.rest) > 0.5 * _UNBOUNDED

    @property
    def of_head(self) -> Array:
        """What a standard uncertainty of each head position did to the errors, shape (18, J)."""
        return self.head * self.by_head

    @property
    def freedom(self) -> Array:
        """Degrees of freedom of `rest`: those of the whole are the mean over its shares."""
        of_head = (self.of_head**2).sum(axis=1)
        variance = np.diagonal(self.rest) + of_head
        share = of_head / np.where(variance > 0.0, variance, 1.0)
        left = 1.0 / self.dof - share / counted(self.head_dof)
        return np.asarray(1.0 / np.clip(left / np.maximum(1.0 - share, 1e-6), 1e-9, 1.0))

    @property
    def rest_over_dof(self) -> Array:
        """`rest` over its degrees of freedom, of two errors over their geometric mean."""
        root = np.sqrt(1.0 / self.freedom)
        return np.asarray(self.rest * np.outer(root, root))

    def rest_sized(self, factor: Callable[[float], float]) -> Array:
        """`rest`, were the standard uncertainties other than estimated, see `sized`."""
        factors = np.array([factor(own) for own in self.freedom.tolist()])
        return np.asarray(self.rest * np.outer(factors, factors))

    def larger(self, dof: float, *, head: bool) -> Array:
        """Covariance, shape (18, 18), in which what few degrees of freedom tell counts as larger.

        It is used with Student's distribution of `dof`. With `head`, the errors by the head count,
        as of another head than that of the record.
        """
        known = student_quantile(LEVEL, dof)
        return self.sized(lambda own: max(student_quantile(LEVEL, own) / known, 1.0), head=head)

    def sized(self, factor: Callable[[float], float], *, head: bool) -> Array:
        """Covariance, shape (18, 18), were the standard uncertainties other than estimated.

        `factor` gives the size of one over its estimate, of the degrees of freedom of that; `head`
        as in `larger`.
        """
        found = self.rest_sized(factor)
        found[0, 0] += self.hysteresis**2
        if head:
            found += factor(self.head_dof) ** 2 * self.of_head @ self.of_head.T
        return found


def is_corrected(calibration: Calibration) -> bool:
    """Tell whether the known errors of the head were taken out of the readings (``fit --head``)."""
    return calibration.provenance.get("options", {}).get("head") is not None


def calibration_errors(calibration: Calibration, found: Compensation) -> CalibrationErrors:
    """Split the errors of a calibration into those by the head and the rest.

    They are of no head position, where the calibration does not tell its readings, or was corrected
    by the known errors of its head.
    """
    positions, by_head = _by_head(calibration, found)
    head = next((s for s in calibration.error_sources if s.name == "head" and s.value), None)
    size = (head.value or 0.0) if head and positions.size else 0.0
    whole, dof = _stated(calibration, found)
    return CalibrationErrors(
        rest=_without(whole, size * by_head),
        dof=dof,
        by_head=by_head,
        positions=positions,
        head=size,
        head_dof=(head.dof or np.inf) if head else np.inf,
        hysteresis=found.hysteresis,
    )


def _stated(calibration: Calibration, found: Compensation) -> tuple[Array, Array]:
    """Covariance over `ERRORS` as the calibration states it, and its degrees of freedom.

    What nothing bounds may be anything. The covariance of one cross axis and the other, of which
    the head makes the most, is taken as zero.
    """
    covariance, dof = np.zeros(2 * (len(ERRORS),)), np.full(len(ERRORS), np.inf)
    for start, told in ((0, found), (_OTHER, found.other)):
        if told is not None:
            block = slice(start, start + len(told.covariance))
            own = np.nan_to_num(np.array(told.covariance))
            unknown = np.isnan(np.diagonal(told.covariance))
            own[unknown, unknown] = _each_alone(calibration, found, start)[unknown]
            covariance[block, block], dof[block] = own, told.dof
    for place, axis in enumerate(found.axes, _DELTA0):
        angle = freed_angle(calibration, axis.name)
        covariance[place, place] = (angle.standard_uncertainty or 0.0) ** 2
        dof[place] = angle.dof or np.inf
    return covariance, dof


def _each_alone(calibration: Calibration, found: Compensation, start: int) -> Array:
    """Variances of the parameters of an axis and its slopes as the tables in use state each."""
    used = tables_in_use(calibration, found.T0_degC)
    second = cross_name(used.main.mounting) != found.axes[int(start > 0)].name
    table = used.nearest[second]
    K1 = table.coefficients["K1"]
    stated = {name: used.telling(name, second=second).error_model[name] for name in PARAMETERS[2:]}
    stated |= {"k0": table.error_model["k0"], "delta": calibration.misalignment(table), "K1": K1}
    unit = {"K1": K1.value or 1.0}
    sizes = {name: quantity.standard_uncertainty for name, quantity in stated.items()}
    variance = {n: (u / unit.get(n, 1.0)) ** 2 for n, u in sizes.items() if u is not None}
    names = OF_ONE_AXIS if start else (*PARAMETERS, *SLOPES)
    return np.array([variance.get(*each) for each in zip(names, _UNBOUNDED[start:], strict=False)])


def _without(whole: Array, by_head: Array) -> Array:
    """What is left of a covariance without that of the head, which is no larger than it."""
    of_head = by_head @ by_head.T
    apart = np.zeros(len(ERRORS), dtype=np.intp)  # blocks between which nothing is stated
    apart[_OTHER:], apart[_DELTA0:] = 1, (2, 3)
    left = whole - np.where(np.equal.outer(apart, apart), of_head, 0.0)
    sizes = np.sqrt(np.maximum(np.diagonal(whole), 0.0))
    root = covariance_root(left, np.where(sizes > 0.0, sizes, 1.0))
    return np.asarray(root @ root.T)


class _Table(NamedTuple):
    """A table of a calibration: what its errors and those of the head do to its n readings."""

    calibrated: TableCalibration
    estimator: LinearEstimator
    simulated: Simulated

    @property
    def told(self) -> list[int]:
        """Places of the coefficients that it tells among all six."""
        return [COEFFICIENTS.index(name) for name in self.estimator.names]

    def absorbed(self, positions: Array) -> Array:
        """What the error of each position does to the coefficients told, shape (p, J) [g/rad]."""
        acting = self.simulated.per_radian[:, None] * self.estimator.map.T
        return self._at(positions, acting).T

    def shown(self, positions: Array) -> Array:
        """Z'QZ of the errors of the positions, shape (J, J) [g^2/rad^2]."""
        acting = self.simulated.per_radian[:, None]
        across = self._at(positions, acting * self.estimator.table.design[:, self.told])
        squares = self._at(positions, acting**2)[:, 0]
        return np.asarray(np.diag(squares) - across @ self.absorbed(positions))

    def _at(self, positions: Array, columns: Array) -> Array:
        """Sums of columns, shape (n, k), over the readings of each position, shape (J, k)."""
        at_head = self.estimator.table.at_head
        found = np.zeros((positions.size, columns.shape[1]))
        found[np.searchsorted(positions, at_head.key)] = at_head.sums(columns)
        return found


def _by_head(calibration: Calibration, found: Compensation) -> tuple[Array, Array]:
    """Head positions, and what the error of each does to `ERRORS`."""
    told = all(table.residuals.angle_deg for table in calibration.tables)
    if not told or is_corrected(calibration):  # no readings, or the head did not act on them
        return _NOT_TOLD
    try:
        tables = list(_tables(calibration, found))
    except InputError:  # of a document whose readings no fit has seen
        return _NOT_TOLD
    positions = distinct(np.concatenate([table.estimator.table.at_head.key for table in tables]))
    if positions.size > _MOST_POSITIONS:
        return _NOT_TOLD
    by_head = np.zeros((len(ERRORS), positions.size))
    for place, axis in enumerate(found.axes):
        own = [table for table in tables if cross_name(table.calibrated.mounting) == axis.name]
        near = nearest_of_mountings([table.calibrated for table in own], found.T0_degC)
        places = {id(table.calibrated): table for table in own}
        sides = {side: places[id(table)] for side, table in near.items()}
        influence = {side: _influence(table, positions) for side, table in sides.items()}
        freed = is_freed(calibration, axis.name)
        _tell(by_head, place, list(influence.values()), list(sides), freed=freed)
    return positions, by_head @ _missed(calibration, found, tables, positions)


def _tables(calibration: Calibration, found: Compensation) -> Iterator[_Table]:
    bare = replace(calibration, effects=())  # of a step, a table has no place that it knows
    for table in calibration.tables:
        estimator = estimator_of(calibration, table)
        simulated = simulated_readings(bare, found, estimator.table.record)
        yield _Table(table, estimator, simulated)


def _tell(
    by_head: Array, axis: int, of_sides: Sequence[Array], sides: Sequence[str], *, freed: bool
) -> None:
    """Write what the head does to the parameters of an axis into the rows of `ERRORS`.

    The temperature laws have it from all of their tables alike, which leaves their slopes alone.
    Both sides of an axis tell the misalignment by their mean, and the fixture angle by half of
    their difference, - minus +, see `accelcal.estimate.reversal`.
    """
    delta = _DELTA if axis == 0 else _OTHER
    by_head[[delta, delta + 1]] = of_sides[0][_DELTA:]
    if axis == 0:
        by_head[:_DELTA] = of_sides[0][:_DELTA]
    if freed and len(sides) == 2:
        minus, plus = (of_sides[sides.index(side)][_DELTA] for side in sorted(sides, reverse=True))
        by_head[delta] = (plus + minus) / 2.0
        by_head[_DELTA0 + axis] = (minus - plus) / 2.0


def places_of(by_error: Array) -> list[int]:
    """Places of the parameters among `ERRORS`, for readings in one cross axis of `by_error`."""
    return _ACROSS if by_error[:, _OTHER].any() else _MAIN


def _influence(table: _Table, positions: Array) -> Array:
    """What the error of each position does to the parameters of a table, shape (6, J)."""
    simulated = table.simulated.by_error
    places = np.array(places_of(simulated))[table.told]
    whole = np.zeros((len(PARAMETERS), positions.size))
    design = table.estimator.table.design[:, table.told]
    whole[table.told] = np.linalg.pinv(simulated[:, places]) @ design @ table.absorbed(positions)
    return whole


def _missed(
    calibration: Calibration, found: Compensation, tables: Sequence[_Table], positions: Array
) -> Array:
    """What the prediction by the lack of fit leaves of the errors of the head, shape (J, J)."""
    noise = known_noise(calibration, found.K1.at_T0)
    head = next((s.value for s in calibration.error_sources if s.name == "head"), None)
    if calibration.method != METHODS[0] or noise is None or not noise.sigma or not head:
        return np.eye(positions.size)
    shown, patterns = np.linalg.eigh(sum(table.shown(positions) for table in tables))
    shown = np.where(shown > _ROUNDING * shown[-1], shown, 0.0)
    return np.asarray(patterns / (1.0 + (head / noise.sigma) ** 2 * shown) @ patterns.T)
