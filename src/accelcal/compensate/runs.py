"""One run with its errors, and what several of one level tell together, as their mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.coefficients import PARAMETERS, SLOPES, Compensation, Law
from accelcal.compensate.of_table import (
    by_quotients,
    by_table,
    errors_of_table,
    estimator_of,
    meanings_of,
    values_of,
)
from accelcal.errors import InputError
from accelcal.estimate.launch import SAME_LEVEL, same_levels
from accelcal.estimate.uncertainty import counted
from accelcal.model import LAWS
from accelcal.plural import listed
from accelcal.reference import LEAST_RISE
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import rows_of
from accelcal.results.fixture_angle import FixtureAngle
from accelcal.results.table import TableCalibration, nearest_table
from accelcal.results.temperature import TemperatureLaw, nearest_level

_LAUNCHES = ("launch", "launch_sf")
_DELTA = PARAMETERS.index("delta")
_SIZE = len(PARAMETERS)
_ROUNDING = 1e-9


class LevelRun(NamedTuple):
    """One table, or the mean of several: coefficients, and errors as `LevelTable` has them."""

    temperature: float  # [degC]
    values: Array  # shape (6,): `PARAMETERS`
    # shape (2, 6, 6): their errors as those of a level: common to all runs; of launches and of
    # temperatures, and of the readings, which are new in each
    common: Array
    shift: Array
    noise: Array
    # shape (6,): what the standard uncertainty of the temperature does to the coefficients
    heat: Array
    readings: float  # number of them

    @property
    def own(self) -> Array:
        """Errors that are new in each run."""
        return np.asarray(self.shift + self.noise)


def level_run(
    calibration: Calibration, table: TableCalibration, tables: Sequence[TableCalibration]
) -> LevelRun:
    """Coefficients of a table, and their errors with those of K1 in its unit."""
    values = values_of(calibration, table)
    unit = np.ones(_SIZE)
    unit[PARAMETERS.index("K1")] = values["K1"]
    whole = errors_of_table(calibration, table)[:, :_SIZE, :_SIZE]
    heat, noise = _of_temperature(calibration, table), _of_readings(calibration, table)
    of_heat = _with_freedom(np.outer(heat, heat), _freedom(calibration, "temperature"))
    own, in_whole = np.zeros((3, *whole.shape)), np.zeros_like(whole)
    launches = _of_launches(calibration, table, tables)
    parts = np.stack([launches, [of_heat, of_heat], [noise, noise]])
    for place, (part, part_of_whole) in enumerate(parts):
        if _is_part(own.sum(axis=0)[0] + part[0], whole[0]):
            own[place], in_whole = part, in_whole + part_of_whole
    moved, wider = _free_of_the_angle(calibration, table, tables)
    unit_of_errors = unit.copy()
    unit_of_errors[_DELTA] *= wider
    values["delta"] += moved
    both = np.outer(unit_of_errors, unit_of_errors)
    return LevelRun(
        table.temperature_degC or 0.0,
        np.array([values[name] for name in PARAMETERS]),
        (whole - in_whole) * both,
        (own[0] + own[1]) * both,
        own[2] * both,
        heat * unit_of_errors * bool(own[1].any()),
        table.readings,
    )


def _with_freedom(covariance: Array, freedom: float) -> Array:
    """A covariance, and it over its degrees of freedom."""
    return np.stack([covariance, covariance / freedom])


def _is_part(own: Array, whole: Array) -> bool:
    """Whether a covariance is a part of another, and the rest is one as well."""
    rest = np.nan_to_num(_scaled(whole - own, whole))
    return bool(np.linalg.eigvalsh(rest).min() >= -_ROUNDING)


def _freedom(calibration: Calibration, name: str) -> float:
    """Degrees of freedom of a source of error, the fewest where runs have their own."""
    return min(
        (s.dof or np.inf for s in calibration.error_sources if s.name == name), default=np.inf
    )


def _of_temperature(calibration: Calibration, table: TableCalibration) -> Array:
    """What the error of the temperature of a run does to `PARAMETERS`, by the laws."""
    size = table.budget.get("K1", {}).get("temperature", 0.0)
    model, rise = calibration.temperature_model, _rise(calibration, table)
    found = np.zeros(_SIZE)
    if not size or model is None or rise is None:
        return found
    slopes = np.array([_slope(law, rise) for law in model.laws.values()])
    scale_factor, at_T0 = table.coefficients["K1"].value, model.K1.at_T0 and model.K1.at_T0.value
    if slopes[1] and scale_factor and at_T0:
        found[[PARAMETERS.index(name) for name in LAWS]] = slopes * abs(size / slopes[1] / at_T0)
        found[PARAMETERS.index("K1")] *= at_T0 / scale_factor  # which is relative here
    if table.mounting != calibration.main_mounting:  # the laws tell its misalignment nothing
        found[_DELTA] = 0.0
    return found


def _rise(calibration: Calibration, table: TableCalibration) -> float | None:
    if table.temperature_degC is None or calibration.T0_degC is None:
        return None
    return table.temperature_degC - calibration.T0_degC


def _slope(law: TemperatureLaw, rise: float) -> float:
    """Slope of a law at a level; the mean of both sides at T0, as the budget of a table has it."""
    sides = ((law.above, rise > -LEAST_RISE), (law.below, rise < LEAST_RISE))
    known = [side.value for side, counts in sides if counts and side and side.value is not None]
    return float(np.mean(known)) if known else 0.0


def _of_launches(
    calibration: Calibration, table: TableCalibration, tables: Sequence[TableCalibration]
) -> Array:
    """Errors of `PARAMETERS` by shifts from launch to launch, which are new in each run.

    They are returned twice, shape (2, 2, 6, 6): over the degrees of freedom of all repeats, which
    the mean of runs is independent of, and as the table has them, where its own run does not count.
    """
    found = np.zeros((2, 2, _SIZE, _SIZE))
    if not table.covariance_names:
        return found
    jacobian, repeated = by_quotients(calibration, table), _is_repeated(table, tables)
    for source in _LAUNCHES:
        size = [table.budget.get(n, {}).get(source, 0.0) for n in table.covariance_names]
        part, freedom = (jacobian * np.square(size)) @ jacobian.T, _freedom(calibration, source)
        without = freedom - 1.0 if repeated and freedom > 1.0 else freedom
        found += np.stack([_with_freedom(part, float(counted(own))) for own in (freedom, without)])
    return found


def _of_readings(calibration: Calibration, table: TableCalibration) -> Array:
    """Errors of `PARAMETERS` by the noise of the own readings of a table, all of one size.

    The smallest variance that the budget has for a coefficient tells the size: what is more came
    through the errors of the head that all tables show together.
    """
    names = table.covariance_names
    if not names or not table.residuals.angle_deg:
        return np.zeros((2, _SIZE, _SIZE))
    try:
        found = estimator_of(calibration, table)
    except InputError:  # of a document whose readings no fit has seen
        return np.zeros((2, _SIZE, _SIZE))
    size = np.array([table.budget.get(name, {}).get("reading", 0.0) for name in names])
    by_reading = found.map[[found.names.index(name) for name in names]]
    unscaled = by_reading @ by_reading.T
    noise = (size**2 / np.diagonal(unscaled)).min()
    jacobian = by_quotients(calibration, table)
    return _with_freedom(
        jacobian @ (noise * unscaled) @ jacobian.T, _freedom(calibration, "reading")
    )


def _is_repeated(table: TableCalibration, tables: Sequence[TableCalibration]) -> bool:
    """Whether another run met the level of a table."""
    at = np.array([np.nan if t.temperature_degC is None else t.temperature_degC for t in tables])
    return any(level.size > 1 and tables.index(table) in level for level in same_levels(at))


def _scaled(matrix: Array, covariance: Array) -> Array:
    """Matrix in units of the standard deviations of a covariance."""
    sigma = np.sqrt(np.diagonal(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(matrix / np.outer(sigma, sigma))


def _free_of_the_angle(
    calibration: Calibration, table: TableCalibration, tables: Sequence[TableCalibration]
) -> tuple[float, float]:
    """Correct the misalignment where both sides were measured at other levels only.

    What it changes from the nearest of these levels to this one is that of the effective
    misalignment. Returned are the change, and the factor of its uncertainty, which is that of the
    three added up.
    """
    found = [item for item in calibration.fixture_angle if item.axis == table.mounting[0]]
    if not found:
        return 0.0, 1.0
    free, level = found[0].nearest(table.temperature_degC), _nearest(found[0], table)
    there = nearest_table(tables, level)
    own, other = table.error_model["delta"], there.error_model["delta"]
    if abs((there.temperature_degC or 0.0) - (table.temperature_degC or 0.0)) <= SAME_LEVEL:
        return 0.0, 1.0
    sizes = [q.standard_uncertainty or 0.0 for q in (free, own, other)]
    wider = sum(sizes) / sizes[0] if sizes[0] else 1.0
    return (own.value or 0.0) - (other.value or 0.0), wider


def _nearest(found: FixtureAngle, table: TableCalibration) -> float | None:
    """Level of a fixture angle that is nearest to a table."""
    return found.temperatures[nearest_level(found.temperatures, table.temperature_degC)]


def weights_of(runs: Sequence[LevelRun]) -> Array:
    """Weights of the runs of a level, by their variances on the average of the coefficients.

    Noise and shifts are of one size. With those that each run has its estimate of, the one whose
    readings happened to scatter least, or that lies apart from the others, would have most weight.
    """
    shift = np.mean([run.shift[0] for run in runs], axis=0)
    noise = np.mean([run.noise[0] * run.readings for run in runs], axis=0)
    errors = [run.common[0] + shift + noise / run.readings for run in runs]
    variances = np.array([np.diagonal(each) for each in errors])
    mean = variances.mean(axis=0)
    known = np.isfinite(mean) & (mean > 0.0)
    if not known.any():
        return np.full(len(runs), 1.0 / len(runs))
    weights = 1.0 / np.mean(variances[:, known] / mean[known], axis=1)
    return np.asarray(weights / weights.sum())


def mean_run(runs: Sequence[LevelRun]) -> LevelRun:
    """Mean of the runs of a level, with what the errors of each leave in it."""
    weights = weights_of(runs).tolist()

    def total(name: str, power: int) -> Any:
        return sum(w**power * getattr(r, name) for w, r in zip(weights, runs, strict=True))

    powers = dict.fromkeys(LevelRun._fields, 1) | {"shift": 2, "noise": 2}
    return LevelRun(**{name: total(name, power) for name, power in powers.items()})


def are_alike(tables: Sequence[TableCalibration]) -> bool:
    """Tell whether tables are of one mounting and one level, and tell the same coefficients."""
    levels = [table.temperature_degC for table in tables]
    known = [level for level in levels if level is not None]
    one_level = not known or (len(known) == len(levels) and len(same_levels(np.array(known))) == 1)
    one_mounting = len({table.mounting for table in tables}) == 1
    told = list(map(meanings_of, tables))
    return one_mounting and one_level and all(own == told[0] for own in told)


def said_of_runs(calibration: Calibration) -> str:
    """Say that several runs count by their mean; empty where they do not."""
    tables, mountings = calibration.tables, calibration.mountings_of_laws
    groups = [[table.run for table in tables if table.mounting == own] for own in mountings]
    several = [listed(runs) for runs in groups if len(runs) > 1]
    if calibration.temperature_model is not None or not several:
        return ""
    told = " and by that of ".join(several)
    return f"calibration counts by the mean of its runs {told}, which are at one level"


def by_runs(calibration: Calibration, tables: Sequence[TableCalibration]) -> Compensation:
    """What several runs tell, as their mean, at its temperature.

    Notes
    -----
    The weight of a run is that of its variances, as in
    `accelcal.compensate.by_levels.level_compensation`. Noise of the readings, shifts from launch to
    launch and errors of the temperature are new in each run; all other errors count as common to
    the runs.
    """
    if len(tables) == 1:
        return by_table(calibration, tables[0])
    mean = mean_run([level_run(calibration, table, tables) for table in tables])
    near = by_table(calibration, nearest_table(tables, mean.temperature))
    relative = np.where(np.equal(PARAMETERS, "K1"), 1.0 / mean.values[1], 1.0)
    errors = (mean.common + mean.own) * np.outer(relative, relative)
    k0, K1, k2, k3, delta, delta_ip = mean.values.tolist()
    level = None if near.T0_degC is None else mean.temperature
    return replace(
        near,
        k0=Law(k0),
        K1=Law(K1),
        k2=k2,
        k3=k3,
        cross=replace(near.cross, delta=Law(delta), delta_ip=delta_ip),
        errors=tuple(rows_of(np.pad(own, (0, len(SLOPES)))) for own in errors),
        T0_degC=level,
        temperatures=None if level is None else (level, level),
    )
