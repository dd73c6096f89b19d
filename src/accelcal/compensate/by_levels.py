"""From a calibration to coefficients level by level: its tables, drawn together at each level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.assumptions import same_at_all_temperatures, without_covariance
from accelcal.compensate.coefficients import PARAMETERS, Compensation
from accelcal.compensate.covariance import by_quotients, errors_of_table
from accelcal.compensate.levels import Errors, LevelCompensation, LevelTable
from accelcal.compensate.of_table import by_table, lost_symbols, values_of, with_other
from accelcal.errors import InputError
from accelcal.estimate.launch import SAME_LEVEL, same_levels
from accelcal.model import LAWS
from accelcal.reference import LEAST_RISE
from accelcal.results.calibration import Calibration
from accelcal.results.fixture_angle import FixtureAngle
from accelcal.results.table import TableCalibration, nearest_table
from accelcal.results.temperature import TemperatureLaw, nearest_level
from accelcal.results.usable import not_determined

_LAUNCHES = ("launch", "launch_sf")
_BIAS, _DELTA = PARAMETERS.index("k0"), PARAMETERS.index("delta")
_SIZE = len(PARAMETERS)
_ROUNDING = 1e-9


class LevelRun(NamedTuple):
    """One table, or the mean of several: coefficients, and their errors as `Errors` has them.

    Attributes
    ----------
    temperature : float
        Its temperature [degC].
    values : ndarray, shape (6,)
        `PARAMETERS`.
    common, own : ndarray, shape (2, 6, 6)
        Their errors as those of a level.
    heat : ndarray, shape (6,)
        What the standard uncertainty of the temperature does to the coefficients.
    """

    temperature: float
    values: Array
    common: Array
    own: Array
    heat: Array


def level_compensation(
    calibration: Calibration, tables: Sequence[TableCalibration]
) -> LevelCompensation:
    """Take the coefficients level by level.

    Raises
    ------
    InputError
        If there are not two levels, a temperature is not known, or the tables of the levels do not
        tell the same coefficients.

    Notes
    -----
    The tables are those of the mounting of most tables, and for the other cross axis those of the
    mounting of most tables there. Tables of one level are averaged; the weight of each is that of
    its variances, on the average of the coefficients. How far they scatter about their mean is in
    the covariance, as the next one may lie where any of them did, but for what the errors of their
    temperatures make of it: these are new in each run, as shifts from launch to launch are, and are
    no property of the accelerometer. So is the hysteresis
    of the bias, where it is known and wider; at a level with one run, which is on one branch only,
    a second time.
    """
    main = [t for t in tables if t.mounting == calibration.main_mounting]
    table = _level_table(calibration, main)
    near = nearest_table(main, calibration.T0_degC)
    found, groups, said = by_table(calibration, near), [main], list[str]()
    others = [t for t in tables if t.mounting == calibration.second_mounting]
    other_table, (low, high) = None, _reach(calibration, table)
    if others:
        groups.append(others)
        second = nearest_table(others, calibration.T0_degC)
        found = with_other(found, by_table(calibration, second))
        other_table = _level_table(calibration, others, least=1)
        if other_table.rise.size == 1:
            assert found.other is not None
            said = same_at_all_temperatures(found.other, second)
        else:
            ends = _reach(calibration, other_table)
            low, high = max(low, ends[0]), min(high, ends[1])
    if low >= high:
        raise InputError(
            "by='levels': the two mountings have no range of temperatures together; choose one"
            " by mounting"
        )
    own = {item.name: getattr(found, item.name) for item in fields(Compensation)} | {
        "T0_degC": _reference(calibration),
        "temperatures": (low, high),
        "undetermined": lost_symbols(groups),
        "assumptions": (
            *not_determined(groups),
            *said,
            *_between(table),
            *without_covariance(near),
        ),
    }
    return LevelCompensation(**own, table=table, other_table=other_table)


def _reference(calibration: Calibration) -> float:
    """T0, or where there is none the first temperature [degC]."""
    first = calibration.tables[0].temperature_degC or 0.0
    return first if calibration.T0_degC is None else calibration.T0_degC


def _reach(calibration: Calibration, table: LevelTable) -> tuple[float, float]:
    """Lowest and highest level [degC]."""
    low, high = table.rise[[0, -1]] + _reference(calibration)
    return float(low), float(high)


def _between(table: LevelTable) -> list[str]:
    """Say what straight lines between the levels do not know, with its size."""
    if table.rise.size == 2:
        return [
            "by levels: two levels tell no curvature between them, so U does not count it; a third"
            " level would show it"
        ]
    low, high = table.rise[:-1], table.rise[1:]
    worst = np.where((low < 0.0) & (high > 0.0), 0.0, 0.5 * (low + high))
    missed = [table.departures(i, worst[i : i + 1])[:, 0] for i in range(worst.size)]
    square = np.max([(each**2).sum(axis=0) for each in missed], axis=0)
    bias, scale = np.sqrt(square[:2]) / (1.0, abs(table.values[:, 1]).min())
    off_bias, off_scale = (f"{float(f'{size * 1e6:.2g}'):g}" for size in (bias, scale))
    return [
        "by levels: nothing was measured between the levels; curves through neighbouring levels are"
        f" off the straight lines by up to {off_bias} ug in k0 and {off_scale} ppm in K1, which U"
        " counts as a standard uncertainty; it does not count what bends between two levels alone"
        + ("; three levels tell no more than a parabola" if table.rise.size == 3 else "")
    ]


# -- levels ----------------------------------------------------------------------------------------


def _level_table(
    calibration: Calibration, tables: Sequence[TableCalibration], least: int = 2
) -> LevelTable:
    """Draw the tables of one mounting together, level by level."""
    _refuse_different(tables)
    runs = [level_run(calibration, table, tables) for table in tables]
    places = same_levels(np.array([run.temperature for run in runs]))
    if len(places) < least:
        raise InputError(
            f"by='levels' needs levels more than {SAME_LEVEL:g} degC apart, and the calibration has"
            f" one, {runs[0].temperature:g} degC; leave it out, or calibrate at a second level"
        )
    groups = [[runs[i] for i in level] for level in places]
    levels = [mean_run(group) for group in groups]
    rise = np.array([level.temperature for level in levels]) - _reference(calibration)
    values = np.array([level.values for level in levels])
    slopes = _slopes(rise, values)
    model = calibration.temperature_model
    loop = (model.hysteresis.value if model and model.hysteresis else 0.0) or 0.0
    common, own = (np.array([getattr(x, name) for x in levels]) for name in ("common", "own"))
    common[:, 0] += [_spread(runs, slope, loop) for runs, slope in zip(groups, slopes, strict=True)]
    return LevelTable(rise, values, Errors(*common.swapaxes(0, 1)), Errors(*own.swapaxes(0, 1)))


def _refuse_different(tables: Sequence[TableCalibration]) -> None:
    """Refuse tables without a temperature, or of which one tells other coefficients."""
    first = tables[0]
    for table in tables:
        if table.temperature_degC is None:
            raise InputError(
                f"by='levels' needs the temperature of every table, and that of run {table.run} is"
                " not known; give the temperatures with the readings"
            )
        told = [{n: t.meaning(n) for n, q in t.coefficients.items() if q.value is not None}
                for t in (first, table)]  # fmt: skip
        if told[0] != told[1]:
            names = [n for n in first.coefficients if told[0].get(n) != told[1].get(n)]
            raise InputError(
                f"by='levels': {', '.join(names)} of run {table.run} at {table.temperature_degC:g}"
                f" degC do not mean the same as of run {first.run}; measure the same positions at"
                " each level, or compensate by the laws"
            )


def level_run(
    calibration: Calibration, table: TableCalibration, tables: Sequence[TableCalibration]
) -> LevelRun:
    """Coefficients of a table, and their errors with those of K1 in its unit."""
    values = values_of(calibration, table)
    unit = np.ones(_SIZE)
    unit[PARAMETERS.index("K1")] = values["K1"]
    whole = np.array(errors_of_table(calibration, table))[:, :_SIZE, :_SIZE]
    launches, heat = _of_launches(calibration, table, tables), _of_temperature(calibration, table)
    own, in_whole = launches
    if not _is_part(own[0] + np.outer(heat, heat), whole[0]):
        heat = np.zeros_like(heat)
    if not _is_part(own[0], whole[0]):
        own, in_whole = np.zeros_like(launches)
    of_heat = _with_freedom(np.outer(heat, heat), _freedom(calibration, "temperature"))
    own, in_whole = own + of_heat, in_whole + of_heat
    moved, wider = _free_of_the_angle(calibration, table, tables)
    unit_of_errors = unit.copy()
    unit_of_errors[_DELTA] *= wider
    values["delta"] += moved
    both = np.outer(unit_of_errors, unit_of_errors)
    return LevelRun(
        table.temperature_degC or 0.0,
        np.array([values[name] for name in PARAMETERS]),
        (whole - in_whole) * both,
        own * both,
        heat * unit_of_errors,
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
        found += np.stack([_with_freedom(part, own) for own in (freedom, without)])
    return found


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
    if abs((there.temperature_degC or 0.0) - (table.temperature_degC or 0.0)) < SAME_LEVEL:
        return 0.0, 1.0
    sizes = [q.standard_uncertainty or 0.0 for q in (free, own, other)]
    wider = sum(sizes) / sizes[0] if sizes[0] else 1.0
    return (own.value or 0.0) - (other.value or 0.0), wider


def _nearest(found: FixtureAngle, table: TableCalibration) -> float | None:
    """Level of a fixture angle that is nearest to a table."""
    return found.temperatures[nearest_level(found.temperatures, table.temperature_degC)]


def _weights(runs: Sequence[LevelRun]) -> Array:
    """Weights of the runs of a level, by their variances on the average of the coefficients.

    What is new in each run is of one size: that of a run is estimated from the others, by which one
    that lies apart would have the most weight.
    """
    new = np.mean([run.own[0] for run in runs], axis=0)
    variances = np.array([np.diagonal(run.common[0] + new) for run in runs])
    mean = variances.mean(axis=0)
    known = np.isfinite(mean) & (mean > 0.0)
    if not known.any():
        return np.full(len(runs), 1.0 / len(runs))
    weights = 1.0 / np.mean(variances[:, known] / mean[known], axis=1)
    return np.asarray(weights / weights.sum())


def mean_run(runs: Sequence[LevelRun]) -> LevelRun:
    """Mean of the runs of a level, with what the errors of each leave in it."""
    weights = _weights(runs).tolist()

    def total(name: str, power: int) -> Any:
        return sum(w**power * getattr(r, name) for w, r in zip(weights, runs, strict=True))

    return LevelRun(**{name: total(name, 2 if name == "own" else 1) for name in LevelRun._fields})


def _slopes(rise: Array, values: Array) -> Array:
    """Change with temperature at each level, the mean of both sides."""
    if rise.size == 1:
        return np.zeros_like(values)
    slopes = np.diff(values, axis=0) / np.diff(rise)[:, None]
    return np.asarray(0.5 * (np.vstack([slopes[:1], slopes]) + np.vstack([slopes, slopes[-1:]])))


def _spread(runs: Sequence[LevelRun], slope: Array, loop: float) -> Array:
    """Covariance of where the next run of a level may lie about the mean of those there are."""
    mean, weights = mean_run(runs), _weights(runs)
    off = np.array(
        [r.values - mean.values - slope * (r.temperature - mean.temperature) for r in runs]
    )
    spread = (off.T * weights) @ off
    heat = np.array([r.heat for r in runs])
    if heat.any():
        spread = _beyond((heat.T * (weights * (1.0 - weights))) @ heat, spread, mean)
    spread[_BIAS, _BIAS] += max(loop**2 - spread[_BIAS, _BIAS], 0.0)
    spread[_BIAS, _BIAS] += loop**2 if len(runs) == 1 else 0.0
    return np.asarray(spread)


def _beyond(expected: Array, spread: Array, mean: LevelRun) -> Array:
    """Covariance by which a scatter is more than expected, in the directions in which it is."""
    sigma = np.sqrt(np.diagonal((mean.common + mean.own)[0]))
    unit = np.where(sigma > 0.0, sigma, 1.0)
    sizes, directions = np.linalg.eigh((spread - expected) / np.outer(unit, unit))
    more = (directions * np.maximum(sizes, 0.0)) @ directions.T
    return np.asarray(more * np.outer(unit, unit))
