"""From a calibration to coefficients level by level: its tables, drawn together at each level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.assumptions import same_at_all_temperatures, without_covariance
from accelcal.compensate.coefficients import PARAMETERS, Compensation
from accelcal.compensate.levels import LevelCompensation, LevelTable
from accelcal.compensate.of_table import by_table, lost_symbols, meanings_of, with_other
from accelcal.compensate.runs import LevelRun, level_run, mean_run, weights_of
from accelcal.errors import InputError
from accelcal.estimate.launch import SAME_LEVEL, same_levels
from accelcal.results.calibration import Calibration
from accelcal.results.table import TableCalibration, nearest_table
from accelcal.results.usable import not_determined

_BIAS = PARAMETERS.index("k0")


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
    return LevelTable(rise, values, common.swapaxes(0, 1), own.swapaxes(0, 1))


def _refuse_different(tables: Sequence[TableCalibration]) -> None:
    """Refuse tables without a temperature, or of which one tells other coefficients."""
    first = tables[0]
    for table in tables:
        if table.temperature_degC is None:
            raise InputError(
                f"by='levels' needs the temperature of every table, and that of run {table.run} is"
                " not known; give the temperatures with the readings"
            )
        told, own = meanings_of(first), meanings_of(table)
        if told != own:
            names = [n for n in first.coefficients if told.get(n) != own.get(n)]
            raise InputError(
                f"by='levels': {', '.join(names)} of run {table.run} at {table.temperature_degC:g}"
                f" degC do not mean the same as of run {first.run}; measure the same positions at"
                " each level, or compensate by the laws"
            )


def _slopes(rise: Array, values: Array) -> Array:
    """Change with temperature at each level, the mean of both sides."""
    if rise.size == 1:
        return np.zeros_like(values)
    slopes = np.diff(values, axis=0) / np.diff(rise)[:, None]
    return np.asarray(0.5 * (np.vstack([slopes[:1], slopes]) + np.vstack([slopes, slopes[-1:]])))


def _spread(runs: Sequence[LevelRun], slope: Array, loop: float) -> Array:
    """Covariance of where the next run of a level may lie about the mean of those there are."""
    mean, weights = mean_run(runs), weights_of(runs)
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
