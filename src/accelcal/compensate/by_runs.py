"""From a calibration to its compensation where several runs at one level tell the coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from accelcal.compensate.coefficients import PARAMETERS, SLOPES, Compensation, Law
from accelcal.compensate.of_table import by_table, meanings_of
from accelcal.compensate.runs import level_run, mean_run
from accelcal.estimate.launch import same_levels
from accelcal.plural import listed
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import rows_of
from accelcal.results.table import TableCalibration, nearest_table


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
    covariance, over_dof = (
        rows_of(np.pad(own * np.outer(relative, relative), (0, len(SLOPES))))
        for own in mean.common + mean.own
    )
    k0, K1, k2, k3, delta, delta_ip = mean.values.tolist()
    level = None if near.T0_degC is None else mean.temperature
    return replace(
        near,
        k0=Law(k0),
        K1=Law(K1),
        k2=k2,
        k3=k3,
        cross=replace(near.cross, delta=Law(delta), delta_ip=delta_ip),
        covariance=covariance,
        over_dof=over_dof,
        T0_degC=level,
        temperatures=None if level is None else (level, level),
    )
