"""Errors of all readings of many records, where a solution of the product model stands.

What is recorded about the mean temperature of a run may be felt by the accelerometer or be noise
of the sensor, and taking the one for the other spoils the slopes. So one more unknown of each run
tells which part of these deviations was felt. The reading noise is the scatter of the replicates
without what the felt temperatures explain of it.

Where they do not differ, all runs have one reading noise: weights of few replicates mislead.
Weights that follow the scatter of each run favour the runs that happened to scatter little, and the
intervals must make up for it. With ten degrees of freedom a run, one noise for all makes intervals
that are a twentieth shorter and hold the truth as they should (``benchmarks/coverage.py``, the
regime of two strokes and three temperatures; of single weights with ``--choices``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.noise import ReadingNoise, noise_of_stack
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.trend import FEW
from accelcal.estimate.uneven_noise import differ
from accelcal.model import COEFFICIENTS, MISALIGNMENT, SCALE_FACTOR, WITHOUT_LAWS
from accelcal.numerics.grouping import grouped
from accelcal.reference import bilinear_design
from accelcal.temperature.bilinear import share_of_law, taken_from_the_other_side
from accelcal.temperature.levels import RecordedTemperatures, stacked_temperature_uncertainty
from accelcal.temperature.product.model import Block, HeadErrors, MountingReadings, Point
from accelcal.temperature.weaknesses import Branches, branches_of

_LEAST = 1e-10
"""Least noise over the largest output: beside less, what is known before would round off."""

PRIOR = 0.5
"""Part of the recorded deviations that is felt, before the readings tell, +- as much."""


class ProductFit(NamedTuple):
    """t tables of one mounting in each of R records, with all that is known of their errors."""

    tables: Sequence[PreparedTable]  # the tables of any of the records
    readings: MountingReadings
    # shape (R, n): temperatures of each table, those unknown at their mean [degC]
    temperatures: tuple[Array, ...]
    loop: Branches  # on which branch of a hysteresis they lie
    head: HeadErrors  # what the errors of the head positions do [output unit]
    # shape (R,): shifts from launch to launch [g, relative]
    bias: Array
    scale_factor: Array
    declared: float | None  # declared standard uncertainty of the temperature of a run [degC]
    # shape (R,): step to which the readings of each table are rounded [output unit]
    resolution: tuple[Array, ...]

    def of_records(self, rows: Places) -> ProductFit:
        """Return that of some of the records."""
        return self._replace(
            readings=self.readings.of_records(rows),
            temperatures=tuple(own[rows] for own in self.temperatures),
            head=self.head.of_records(rows),
            bias=self.bias[rows],
            scale_factor=self.scale_factor[rows],
            resolution=tuple(step[rows] for step in self.resolution),
        )

    def of_block(self, block: Block) -> ProductFit:
        """Return that of some of the readings; their tables stay whole."""
        readings = self.readings.of_rows(block.rows)
        return self._replace(readings=readings, head=self.head.of_block(block))


class Solution(NamedTuple):
    """Where the solution stands."""

    # shape (R, 3 p + c): value at T0 and slopes of k0, K1 and delta, then what is common to all
    # temperatures
    parameters: Array
    # shape (R, t): part of the recorded deviations that each table felt, and its standard
    # uncertainty
    felt: Array
    doubt: Array


class Sizes(NamedTuple):
    """Sizes of the errors that all readings of a table tell."""

    # shape (R, n): standard uncertainty of what is new in each reading [output unit], and its
    # degrees of freedom
    noise: Array
    noise_dof: Array
    # shape (R, t): standard uncertainty of the temperatures [degC], and its degrees of freedom
    temperature: Array
    temperature_dof: Array

    def of_rows(self, rows: slice) -> Sizes:
        """Return those of some of the readings."""
        return self._replace(noise=self.noise[:, rows], noise_dof=self.noise_dof[:, rows])


class ReadingErrors(NamedTuple):
    """Errors of the readings."""

    sizes: Sizes  # those of what is new in each reading, and of the temperatures
    head: HeadErrors
    # shape (R, m, n): by source, a column for each independent error but for those of the head
    # [output unit]
    shared: Mapping[str, Array]
    # shape (R, t, n): what the parts that are felt do, in units of what is known of them before
    # [output unit]
    felt: Array


def product_fit(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    temperatures: RecordedTemperatures,
    chosen: Sequence[int],
    rows: Places,
    sides: Sequence[str],
) -> ProductFit:
    """Set up the fit of some records, `rows`, whose levels have one course.

    It has all errors but the noise, which depends on the part of the deviations that was felt.
    """
    own = [tables[i] for i in chosen]
    design = np.concatenate([table.design for table in own])
    table = np.repeat(np.arange(len(own)), [len(t.record) for t in own])
    recorded = tuple(temperatures.readings[i][rows] for i in chosen)
    mean = temperatures.levels[np.ix_(rows, np.array(chosen))]
    loop = branches_of(mean[0], np.argsort([t.run for t in own], kind="stable"))
    names = set().union(*(estimate.names[i] for i in chosen))
    common = design[:, [COEFFICIENTS.index(name) for name in WITHOUT_LAWS if name in names]]
    readings = MountingReadings(
        output=np.concatenate([estimate.outputs[i][rows] for i in chosen], axis=1),
        a_i=design[:, SCALE_FACTOR],
        cross=design[:, MISALIGNMENT],
        # the hysteresis is a part of the bias, +h after heating
        common=np.concatenate([common.T, loop.acting[table].T]),
        rise=mean[:, table] - temperatures.reference[rows, None],
        deviation=np.concatenate(recorded, axis=1) - mean[:, table],
        table=table,
        sides=sides,
    )
    k1 = np.stack([estimate.coefficients[i][rows, SCALE_FACTOR] for i in chosen], axis=1)
    share = share_of_law(k1, bilinear_design(mean - temperatures.reference[rows, None], sides))
    turned = [
        share[:, at, None] * (estimate.coefficients[i][rows] @ own[at].angular.T)
        for at, i in enumerate(chosen)
    ]
    acting = estimate.head.uncertainty[rows, None] * np.concatenate(turned, axis=1)
    return ProductFit(
        tables=own,
        readings=readings,
        temperatures=recorded,
        loop=loop,
        head=HeadErrors(acting, grouped(np.concatenate([t.head for t in own]))),
        bias=estimate.bias_shift.scatter[rows],
        scale_factor=estimate.scale_factor_shift.scatter[rows],
        declared=own[0].record.apparatus.temperature_uncertainty,
        resolution=tuple(estimate.resolution[i][rows] for i in chosen),
    )


def sizes_at(fit: ProductFit, state: Solution, point: Point) -> Sizes:
    """Sizes of the errors where the solution stands."""
    noises = _noises(fit, state, point)
    pairs = zip(noises, fit.tables, strict=True)
    noise = np.concatenate([n.factor[:, None] * table.scatter for n, table in pairs], axis=1)
    noise = np.maximum(noise, _LEAST * np.abs(fit.readings.output).max(axis=1, keepdims=True))
    dof = np.stack([noise.dof for noise in noises], axis=1)[:, fit.readings.table]
    share = unfelt_share(state.felt, state.doubt)
    size, size_dof = stacked_temperature_uncertainty(fit.temperatures, fit.declared, share)
    rise = fit.readings.rise[:, np.unique(fit.readings.table, return_index=True)[1]]
    size = np.hypot(size, taken_from_the_other_side(rise, fit.readings.sides))
    return Sizes(noise, dof, size, size_dof)


def errors_at(fit: ProductFit, state: Solution, point: Point, sizes: Sizes) -> ReadingErrors:
    """Errors of the readings, as they act where the solution stands."""
    of_table = np.eye(len(fit.tables))[:, fit.readings.table]
    K1 = point.scale_factor[:, None] * of_table
    heat = point.by_temperature[:, None] * of_table
    loops = fit.loop.paired.shape[1]
    half_widths = state.parameters[:, state.parameters.shape[1] - loops :]
    return ReadingErrors(
        sizes=sizes,
        head=fit.head,
        shared={
            "launch": _of_size(fit.bias, K1),
            "launch_sf": _of_size(fit.scale_factor, K1) * fit.readings.a_i,
            "temperature": heat * sizes.temperature[..., None],
            "hysteresis": fit.loop.off_the_middle(half_widths).mT @ K1,
        },
        felt=heat * (fit.readings.deviation * PRIOR)[:, None],
    )


def _of_size(size: Array, columns: Array) -> Array:
    """Columns of an error of a size in each record; none where it has none."""
    return columns * size[:, None, None] if size.any() else columns[:, :0]


def unfelt_share(felt: Array, doubt: Array) -> Array:
    """Share of the recorded scatter, as a variance, that the mean of each run keeps, (R, t)."""
    return np.clip(1.0 - felt + 2.0 * doubt, 0.0, 1.0)


def _noises(fit: ProductFit, state: Solution, point: Point) -> list[ReadingNoise]:
    """Reading noise of each table, once the outputs are brought to the mean of their run.

    Its means hold the rounding errors that replicates have in common.
    """
    felt = felt_beside_noise(fit, state.felt)
    if (felt != state.felt).any():
        point = fit.readings.at(felt, state.parameters)
    outputs = fit.readings.output + to_the_mean(fit, state, point)
    noises = noise_of_stack(fit.tables, np.split(outputs, edges_of(fit), axis=1))
    moves = np.stack(
        [own.any(axis=1) for own in np.split(fit.readings.deviation, edges_of(fit), 1)]
    )
    took = moves & (felt == state.felt).T
    bare = [table.scatter_dof is None for table in fit.tables]
    found = pooled_noise([_one_less(n, own) for n, own in zip(noises, took, strict=True)], bare)
    each = zip(found, fit.tables, fit.resolution, strict=True)
    return [noise.with_rounding(table, step) for noise, table, step in each]


def edges_of(fit: ProductFit) -> Places:
    """Where the readings of each table but the first begin."""
    return np.cumsum([len(table.record) for table in fit.tables])[:-1]


def felt_beside_noise(fit: ProductFit, felt: Array) -> Array:
    """Felt parts, all or nothing where a fitted one would take the few replicates for itself."""
    replicates = [len(table.record) - table.at_head.key.size for table in fit.tables]
    return np.where(np.array(replicates) < FEW, np.round(felt), felt)


def to_the_mean(fit: ProductFit, state: Solution, point: Point) -> Array:
    """What brings each output to the mean temperature of its run, shape (R, n)."""
    still = fit.readings.at(np.zeros_like(state.felt), state.parameters)
    return still.model - point.model


def _one_less(noise: ReadingNoise, took: Mask) -> ReadingNoise:
    """Take off the degree of freedom that the felt part took."""
    took = took & (noise.source != "declared") & (noise.dof >= 2.0)
    left = noise.dof - took
    wider = np.sqrt(np.divide(noise.dof, left, out=np.ones_like(left), where=took))
    return noise._replace(factor=noise.factor * wider, dof=left)


# -- one noise for all runs ------------------------------------------------------------------------


_SIGNIFICANT = 0.01
_OF_ALL = "replicates of all tables"


def pooled_noise(noises: Sequence[ReadingNoise], bare: Sequence[bool]) -> list[ReadingNoise]:
    """Pool the noise of the runs of each record unless their replicates differ.

    A run that is not `bare` declares the scatter of its readings, and keeps its noise.

    Examples
    --------
    >>> import numpy as np
    >>> runs = [ReadingNoise.of(np.array([size]), 10.0, "replicates") for size in (1.0, 1.2)]
    >>> pooled = pooled_noise(runs, [True, True])
    >>> [(noise.factor.round(3).tolist(), noise.dof.tolist()) for noise in pooled]
    [([1.105], [20.0]), ([1.105], [20.0])]
    """
    # one record speaks for all: noise that is not declared has the same source in each of them
    own = [n for n, is_bare in zip(noises, bare, strict=True) if is_bare and n.source[0] != _OF_ALL]
    if not own or any(noise.source[0] != "replicates" for noise in own):
        return list(noises)
    pool = next((noise for noise in noises if noise.source[0] == _OF_ALL), None) or _pooled(own)
    differ = _differ(own)
    return [
        _chosen(differ, noise, pool) if is_bare else noise
        for noise, is_bare in zip(noises, bare, strict=True)
    ]


def _chosen(first: Mask, noise: ReadingNoise, other: ReadingNoise) -> ReadingNoise:
    return ReadingNoise(*(np.where(first, a, b) for a, b in zip(noise, other, strict=True)))


def _pooled(noises: Sequence[ReadingNoise]) -> ReadingNoise:
    dof = np.sum([noise.dof for noise in noises], axis=0)
    variance = np.sum([noise.dof * noise.factor**2 for noise in noises], axis=0) / dof
    return ReadingNoise.of(np.sqrt(variance), 0.0, _OF_ALL)._replace(dof=dof)


def _differ(noises: Sequence[ReadingNoise]) -> Mask:
    if len(noises) < 2:
        return np.zeros(1, dtype=np.bool_)
    variance = np.array([noise.factor**2 for noise in noises])
    return differ(variance, np.array([noise.dof for noise in noises]), _SIGNIFICANT)
