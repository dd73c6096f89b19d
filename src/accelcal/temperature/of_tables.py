"""What an error of the temperature does to the coefficients of a table, which are stated at one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.grouping import grouped
from accelcal.model import COEFFICIENTS
from accelcal.results.temperature import BilinearLaw, TemperatureModel
from accelcal.temperature.bilinear import LEAST_RISE
from accelcal.temperature.from_tables import tables_of_one_mounting
from accelcal.temperature.run_temperatures import run_temperature_uncertainty

__all__ = ["temperature_component", "without_slopes"]

Array = NDArray[np.float64]

_K0, _K1, _M = (COEFFICIENTS.index(name) for name in ("K0", "K1", "M"))


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
        Component of the coefficients, table after table; None without slopes.

    Notes
    -----
    A coefficient K = K1 k changes by (K1'/K1) K + K1 k' a degree; k' is known for the bias and,
    in the mounting of the laws, for the misalignment. All coefficients of a run have the same
    error of temperature. The laws do not take this component: they weigh it at the slopes of
    their own.
    """
    if laws is None or reference is None or laws.K1.at_T0 is None:
        return None
    declared = tables[0].record.apparatus.temperature_uncertainty
    uncertain, dof = run_temperature_uncertainty(tables, declared, unfelt)
    runs, column, _ = grouped(np.array([table.record.run[0] for table in tables]))
    of_laws = set(tables_of_one_mounting(tables, estimate))
    acting = []
    for i, table in enumerate(tables):
        rise = table.record.mean_temperature - reference
        rate = _rate(laws, rise, estimate.coefficients[i], with_misalignment=i in of_laws)
        own = uncertain[i] * rate[[COEFFICIENTS.index(name) for name in estimate.names[i]]]
        acting.append(np.outer(np.nan_to_num(own), np.arange(runs.size) == column[i]))
    through = np.concatenate(acting)
    sizes = [len(names) for names in estimate.names]
    return Component(through @ through.T, np.repeat(dof, sizes))


def _rate(laws: TemperatureModel, rise: float, k: Array, *, with_misalignment: bool) -> Array:
    """Change of the coefficients of one table by the temperature, shape (6,)."""
    at_reference = laws.K1.at_T0
    if at_reference is None or at_reference.value is None:
        return np.zeros(k.size)
    rate = at_reference.value * _slope(laws.K1, rise) * k / k[_K1]
    rate[_K0] += k[_K1] * _slope(laws.k0, rise)
    if with_misalignment:
        rate[_M] += k[_K1] * _slope(laws.delta, rise)
    return np.asarray(rate)


def _slope(law: BilinearLaw, rise: float) -> float:
    """Slope at a temperature; near T0, where the sign of the error matters, that of both sides."""
    known = [(s.value, side * rise) for s, side in ((law.above, 1.0), (law.below, -1.0)) if s]
    near = [value or 0.0 for value, beyond in known if beyond > -LEAST_RISE]
    return sum(near) / len(near) if near else 0.0


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
