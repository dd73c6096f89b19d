"""Readings of runs whose temperature moves, brought to the mean temperature of their run.

Coefficients of a table are those at one temperature. Where the recorded temperatures move within
the runs and the readings follow them, the slopes of the laws tell what each reading would have been
at the mean: without that, the scatter of its strokes passes for noise, and the first of them for
outliers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.tables import PreparedTable
from accelcal.temperature.from_tables import laws_from_tables
from accelcal.temperature.run_temperatures import recorded_temperatures

__all__ = ["AtRest", "brought_to_rest"]

Array = NDArray[np.float64]

_FOLLOWS = 0.5
_MUCH = 0.5  # degC; 0.25 degC off the mean is 130 ppm of the scale factor of the AL-15


class AtRest(NamedTuple):
    """Tables at the mean temperatures of their runs.

    Attributes
    ----------
    tables : sequence of PreparedTable
        The tables; those that moved with other outputs than before.
    unfelt : ndarray, shape (tables,)
        Share of the recorded scatter, as a variance, that the accelerometer did not feel.
    said : tuple of str
        What was done, and which tables move still.
    """

    tables: Sequence[PreparedTable]
    unfelt: Array
    said: tuple[str, ...] = ()

    @classmethod
    def of(cls, tables: Sequence[PreparedTable]) -> AtRest:
        """Leave the tables as they are."""
        return cls(tables, np.ones(len(tables)))


def brought_to_rest(
    tables: Sequence[PreparedTable], estimate: JointEstimate, reference: float | None
) -> AtRest:
    """Bring the readings to the mean temperature of their run, where they follow the recorded one.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        Their coefficients, which tell the laws well enough.
    reference : float or None
        T0 [degC].

    Returns
    -------
    AtRest
        The tables; as they were where temperatures stand, or no law is known.
    """
    as_they_are = AtRest.of(tables)
    moved = np.array([np.ptp(recorded_temperatures(table)) for table in tables])
    if not moved.any():
        return as_they_are
    record = tables[0].record
    declared = record.apparatus.temperature_uncertainty
    laws = laws_from_tables(tables, estimate, reference, declared, record.unit)
    if laws is None or laws.k0.at_T0 is None or reference is None:
        return as_they_are._replace(said=_left_moving(tables, moved))
    from accelcal.temperature.from_readings import felt_deviations

    found, unfelt, unknown = list(tables), as_they_are.unfelt, moved.copy()
    for felt in felt_deviations(tables, estimate, laws, reference, declared):
        unknown[felt.table] = 0.0
        if moved[felt.table] and felt.part - 2.0 * felt.doubt > _FOLLOWS:
            record = found[felt.table].record
            still = replace(record, output=record.output + felt.to_the_mean)
            found[felt.table] = found[felt.table]._replace(record=still)
            unfelt[felt.table] = felt.unfelt
    return AtRest(found, unfelt, _what_was_done(tables, found) + _left_moving(tables, unknown))


def _what_was_done(
    before: Sequence[PreparedTable], after: Sequence[PreparedTable]
) -> tuple[str, ...]:
    changed = [old for old, new in zip(before, after, strict=True) if old is not new]
    if not changed:
        return ()
    away = max(
        float(np.abs(recorded_temperatures(t) - t.record.mean_temperature).max()) for t in changed
    )
    return (
        f"{_runs(changed)}: the temperature moves, by up to {away:.2g}"
        " degC from its mean, and the readings follow; they were brought to the mean temperature"
        " of the run by the slopes of the laws",
    )


def _left_moving(tables: Sequence[PreparedTable], moved: Array) -> tuple[str, ...]:
    """Say which temperatures move by much while no law tells what that does to the readings."""
    left = [table for table, span in zip(tables, moved, strict=True) if span > _MUCH]
    if not left:
        return ()
    return (
        f"{_runs(left)}: the recorded temperatures span up to {moved.max():.2g} degC, and no laws"
        " in this mounting tell what that does to the readings, which are taken as they are",
    )


def _runs(tables: Sequence[PreparedTable]) -> str:
    names = ", ".join(table.run_label for table in tables)
    return f"run{'s' if len(tables) > 1 else ''} {names}"
