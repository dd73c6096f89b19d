"""What an error of the temperature does to the coefficients of a table, which are stated at one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.model import COEFFICIENTS, LAWS
from accelcal.numerics.grouping import grouped
from accelcal.reference import LEAST_RISE
from accelcal.temperature.from_tables import LawsOfRecords
from accelcal.temperature.one_meaning import tables_of_one_mounting

_K0, _K1, _M = (COEFFICIENTS.index(name) for name in ("K0", "K1", "M"))


class Slopes(NamedTuple):
    """Scale factor at T0 and the slopes of the laws of R records; NaN where not determined.

    Attributes
    ----------
    has_laws : ndarray of bool, shape (R,)
        Whether a record has laws at all; its levels may determine nothing of them.
    K1, K1_uncertainty : ndarray, shape (R,)
        Scale factor at T0 and its standard uncertainty [output unit / g].
    above, below : ndarray, shape (R, 3)
        Slopes of k0 [g/degC], of K1 [1/degC] and of delta [rad/degC].
    """

    has_laws: Mask
    K1: Array
    K1_uncertainty: Array
    above: Array
    below: Array

    @classmethod
    def of(cls, laws: LawsOfRecords) -> Slopes:
        """Take those of many records."""

        def columns(part: str) -> list[int]:
            return [laws.names.index(f"{law} {part}") for law in LAWS]

        K1 = columns("at_T0")[1]
        slopes = (laws.value[:, columns(side)] for side in ("above", "below"))
        return cls(laws.has_laws, laws.value[:, K1], laws.standard[:, K1], *slopes)

    @classmethod
    def without_laws(cls, records: int) -> Slopes:
        """Slopes of records that have none."""
        unknown = np.full((records, len(LAWS)), np.nan)
        nothing = np.zeros(records, dtype=np.bool_)
        return cls(nothing, unknown[:, 0], unknown[:, 0], unknown, unknown)

    def steepest_of_scale_factor(self) -> Array:
        """Largest relative slope of K1, shape (R,); 0 where there is none [1/degC]."""
        above, below = np.abs(self.above[:, 1]), np.abs(self.below[:, 1])
        return np.asarray(np.fmax(np.fmax(above, below), 0.0))

    def at(self, rise: Array) -> Array:
        """Slopes at a rise, (R,), shape (R, 3); near T0, where the sign counts, of both sides."""
        above, below = np.isfinite(self.above), np.isfinite(self.below)
        above, below = above & (rise > -LEAST_RISE)[:, None], below & (rise < LEAST_RISE)[:, None]
        whole = np.where(above, self.above, 0.0) + np.where(below, self.below, 0.0)
        return np.asarray(whole / np.maximum(above.astype(int) + below, 1))


def stacked_temperature_component(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    slopes: Slopes,
    rise: Array,
    uncertain: tuple[Array, Array],
) -> Component | None:
    """Find the component of error of all coefficients that the temperatures of the runs give.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of any of R records of one plan.
    estimate : JointEstimate
        Their coefficients.
    slopes : Slopes
        The slopes of the laws.
    rise : ndarray, shape (R, tables)
        T - T0 of each table [degC].
    uncertain : tuple of ndarray, shape (R, tables)
        Standard uncertainty of the temperatures [degC], and the degrees of freedom.

    Returns
    -------
    Component or None
        Component of the coefficients, table after table; zero in records without slopes. None
        where all temperatures are exact.

    Notes
    -----
    A coefficient K = K1 k changes by (K1'/K1) K + K1 k' a degree; k' is known for the bias and,
    in the mounting of the laws, for the misalignment. All coefficients of a run have the same
    error of temperature. The laws do not take this component: they weigh it at the slopes of
    their own.
    """
    if not uncertain[0].any():
        return None
    runs, column, _ = grouped(np.array([table.run for table in tables]))
    of_laws = set(tables_of_one_mounting(tables, estimate))
    sizes = [len(names) for names in estimate.names]
    through = np.zeros((len(rise), sum(sizes), runs.size))
    for i, edge in enumerate(np.cumsum([0, *sizes])[:-1].tolist()):
        rate = _rate(slopes, rise[:, i], estimate.coefficients[i], with_misalignment=i in of_laws)
        kept = [COEFFICIENTS.index(name) for name in estimate.names[i]]
        own = np.nan_to_num(uncertain[0][:, i, None] * rate[:, kept])
        through[:, edge : edge + sizes[i], column[i]] = own
    return Component(through @ through.mT, np.repeat(uncertain[1], sizes, axis=1))


def _rate(slopes: Slopes, rise: Array, k: Array, *, with_misalignment: bool) -> Array:
    """Change of the coefficients of one table by the temperature, shape (R, 6)."""
    by_bias, by_scale, by_tilt = slopes.at(rise).T
    scale_factor = k[:, _K1]
    rate = (slopes.K1 * by_scale / scale_factor)[:, None] * k
    rate[:, _K0] += scale_factor * by_bias
    if with_misalignment:
        rate[:, _M] += scale_factor * by_tilt
    return np.where(np.isfinite(slopes.K1)[:, None], rate, 0.0)
