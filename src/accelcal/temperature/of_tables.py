"""What an error of the temperature does to the coefficients of a table, which are stated at one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate, JointStack
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.grouping import grouped
from accelcal.model import COEFFICIENTS
from accelcal.results.temperature import TemperatureModel
from accelcal.temperature.bilinear import LEAST_RISE
from accelcal.temperature.from_tables import LawsOfRecords, tables_of_one_mounting
from accelcal.temperature.levels import stack_of_one
from accelcal.temperature.run_temperatures import run_temperature_uncertainty

__all__ = [
    "Slopes",
    "stacked_temperature_component",
    "temperature_component",
    "without_slopes",
]

Array = NDArray[np.float64]

_LAWS = ("k0", "K1", "delta")
_K0, _K1, _M = (COEFFICIENTS.index(name) for name in ("K0", "K1", "M"))


class Slopes(NamedTuple):
    """Scale factor at T0 and the slopes of the laws of R records; NaN where not determined.

    Attributes
    ----------
    K1 : ndarray, shape (R,)
        Scale factor at T0 [output unit / g].
    above, below : ndarray, shape (R, 3)
        Slopes of k0 [g/degC], of K1 [1/degC] and of delta [rad/degC].
    """

    K1: Array
    above: Array
    below: Array

    @classmethod
    def of(cls, laws: LawsOfRecords) -> Slopes:
        """Take those of many records."""

        def columns(part: str) -> Array:
            return laws.value[:, [laws.names.index(f"{law} {part}") for law in _LAWS]]

        return cls(columns("at_T0")[:, 1], columns("above"), columns("below"))

    @classmethod
    def of_one(cls, model: TemperatureModel) -> Slopes:
        """Take those of one record."""
        known = {name: quantity.value for name, quantity in model.quantities()}

        def row(part: str) -> Array:
            each = [known.get(f"{law} {part}") for law in _LAWS]
            return np.array([[np.nan if value is None else value for value in each]])

        return cls(row("at_T0")[:, 1], row("above"), row("below"))

    def at(self, rise: Array) -> Array:
        """Slopes at a rise, (R,), shape (R, 3); near T0, where the sign counts, of both sides."""
        above, below = np.isfinite(self.above), np.isfinite(self.below)
        above, below = above & (rise > -LEAST_RISE)[:, None], below & (rise < LEAST_RISE)[:, None]
        whole = np.where(above, self.above, 0.0) + np.where(below, self.below, 0.0)
        return np.asarray(whole / np.maximum(above.astype(int) + below, 1))


def temperature_component(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    laws: TemperatureModel | None,
    reference: float | None,
    unfelt: Array,
) -> Component | None:
    """Find the component of error of all coefficients that the temperatures of the runs give.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        Their coefficients.
    laws : TemperatureModel or None
        The laws, for their slopes.
    reference : float or None
        T0 [degC].
    unfelt : ndarray, shape (tables,)
        Share of the recorded scatter of the temperatures that was not felt.

    Returns
    -------
    Component or None
        See `stacked_temperature_component`; None without slopes.
    """
    if laws is None or reference is None or laws.K1.at_T0 is None:
        return None
    declared = tables[0].record.apparatus.temperature_uncertainty
    uncertain, dof = run_temperature_uncertainty(tables, declared, unfelt)
    rise = np.array([[table.record.mean_temperature - reference for table in tables]])
    stack, slopes = stack_of_one(estimate), Slopes.of_one(laws)
    return stacked_temperature_component(
        tables, stack, slopes, rise, (uncertain[None], dof[None])
    ).of(0)


def stacked_temperature_component(
    tables: Sequence[PreparedTable],
    estimate: JointStack,
    slopes: Slopes,
    rise: Array,
    uncertain: tuple[Array, Array],
) -> Component:
    """Find the component of error of all coefficients that the temperatures of the runs give.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of any of R records of one plan.
    estimate : JointStack
        Their coefficients.
    slopes : Slopes
        The slopes of the laws.
    rise : ndarray, shape (R, tables)
        T - T0 of each table [degC].
    uncertain : tuple of ndarray, shape (R, tables)
        Standard uncertainty of the temperatures [degC], and the degrees of freedom.

    Returns
    -------
    Component
        Component of the coefficients, table after table; zero in records without slopes.

    Notes
    -----
    A coefficient K = K1 k changes by (K1'/K1) K + K1 k' a degree; k' is known for the bias and,
    in the mounting of the laws, for the misalignment. All coefficients of a run have the same
    error of temperature. The laws do not take this component: they weigh it at the slopes of
    their own.
    """
    runs, column, _ = grouped(np.array([table.record.run[0] for table in tables]))
    of_laws = set(tables_of_one_mounting(tables, estimate))
    sizes = [len(names) for names in estimate.names]
    through = np.zeros((len(rise), sum(sizes), runs.size))
    for i, edge in enumerate(np.cumsum([0, *sizes])[:-1].tolist()):
        rate = _rate(slopes, rise[:, i], estimate.coefficients[i], with_misalignment=i in of_laws)
        kept = [COEFFICIENTS.index(name) for name in estimate.names[i]]
        own = np.nan_to_num(uncertain[0][:, i, None] * rate[:, kept])
        through[:, edge : edge + sizes[i], column[i]] = own
    return Component(through @ through.swapaxes(1, 2), np.repeat(uncertain[1], sizes, axis=1))


def _rate(slopes: Slopes, rise: Array, k: Array, *, with_misalignment: bool) -> Array:
    """Change of the coefficients of one table by the temperature, shape (R, 6)."""
    by_bias, by_scale, by_tilt = slopes.at(rise).T
    scale_factor = k[:, _K1]
    rate = (slopes.K1 * by_scale / scale_factor)[:, None] * k
    rate[:, _K0] += scale_factor * by_bias
    if with_misalignment:
        rate[:, _M] += scale_factor * by_tilt
    return np.where(np.isfinite(slopes.K1)[:, None], rate, 0.0)


def without_slopes(declared: float | None, component: Component | None) -> Iterator[str]:
    """Say that a declared error of temperature is in no interval, as nothing tells the slopes.

    Parameters
    ----------
    declared : float or None
        Declared standard uncertainty of the temperature of a run [degC].
    component : Component or None
        What it does to the tables.

    Yields
    ------
    str
        A sentence.
    """
    if declared and component is None:
        yield (
            f"temperature_uncertainty of {declared:g} degC is not in U of the coefficients: no"
            " levels tell their slopes; they are those at the temperature that the run really had"
        )
