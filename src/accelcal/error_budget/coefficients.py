"""The coefficients of (4) from a calibration: values at T0, slopes, and how they correlate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.at_temperature import (
    CoefficientsAt,
    MeanOfRuns,
    means_of_runs,
)
from accelcal.compensate.choice import runs_in_use
from accelcal.errors import InputError
from accelcal.model import CROSS_AXES
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration, known_temperatures
from accelcal.results.tables_in_use import tables_in_use
from accelcal.results.temperature import TemperatureLaw, TemperatureModel


@dataclass(frozen=True, slots=True, eq=False)
class Coefficients:
    """Coefficients of (4).

    Attributes
    ----------
    at_T0 : mapping of str to Quantity
        k0 [g], K1 [output unit / g], k2, k3, and of the axes that were tested delta_O, delta_P
        [rad], delta_ip, delta_io [g/g^2].
    slopes : mapping of str to TemperatureLaw
        Slopes of k0 [g/degC], K1 [1/degC] and of delta_O, delta_P [rad/degC], the axis of the laws
        first.
    mounting : str
        The main mounting, which the laws or `alone` are of.
    alone : TableCalibration or CoefficientsAt
        What tells them at T0 without laws: the table nearest to it, or the mean of several runs.
    reference : float or None
        T0, or the temperature of the only level [degC].
    range : tuple of float, or None
        Lowest and highest temperature of the calibration [degC]; None where unknown.
    model, second : TemperatureModel or None
        The laws of `slopes` with their covariance, and those of the other axis.
    """

    at_T0: Mapping[str, Quantity]
    slopes: Mapping[str, TemperatureLaw]
    mounting: str
    alone: TableCalibration | CoefficientsAt
    reference: float | None
    range: tuple[float, float] | None
    model: TemperatureModel | None
    second: TemperatureModel | None = None

    @property
    def of_other_axis(self) -> tuple[str, ...]:
        """Symbols of the misalignment and the cross-coupling that the main table does not tell."""
        (own,) = (a for letter, a in CROSS_AXES.items() if letter != self.mounting[0])
        return own.misalignment, own.coupling

    def slope(self, name: str, rise: Array, part: str) -> Array:
        """Slope of a coefficient at each T - T0, or an uncertainty of it; 0 where there is none.

        Parameters
        ----------
        name : str
            Name in `slopes`.
        rise : ndarray
            T - T0 [degC].
        part : str
            ``"value"``, ``"standard_uncertainty"`` or ``"dof"``.

        Returns
        -------
        ndarray
            The slope above T0 for a positive rise, that below for a negative one.
        """
        law = self.slopes.get(name)
        above, below = (None, None) if law is None else (law.above, law.below)
        return np.where(rise > 0.0, _part(above, part), _part(below, part))


def _part(quantity: Quantity | None, part: str) -> float:
    value = getattr(quantity, part) if quantity is not None else None
    return (np.inf if part == "dof" else 0.0) if value is None else float(value)


def coefficients_of(calibration: Calibration) -> Coefficients:
    """Gather the coefficients of (4).

    Returns
    -------
    Coefficients
        k0, K1 and the misalignments from the temperature laws, where there are any; everything else
        from the tables of `accelcal.results.tables_in_use`, or without laws from the mean of the
        runs of each mounting at one level. Misalignments are free of the fixture angle, where both
        sides of the axis were measured.

    Raises
    ------
    InputError
        If the bias is not determined, or runs without laws have no mean.

    Examples
    --------
    >>> import accelcal
    >>> found = coefficients_of(accelcal.fit(accelcal.simulate(seed=1)))
    >>> sorted(found.at_T0), found.range
    (['K1', 'delta_O', 'delta_ip', 'k0', 'k2', 'k3'], (-40.0, 80.0))
    """
    used = tables_in_use(calibration)
    main, law_axis = used.main, used.main.mounting[0]
    found = {"k0": main.error_model["k0"], "K1": main.coefficients["K1"]}
    found |= {name: used.telling(name).error_model[name] for name in ("k2", "k3")}
    for table in used.nearest:
        axis, teller = (
            CROSS_AXES[table.mounting[0]],
            used.telling("delta_ip", second=table is not main),
        )
        found[axis.misalignment] = calibration.misalignment(table)
        found[axis.coupling] = teller.error_model["delta_ip"]
    means = {own.first.mounting: own for own in means_of_runs(calibration)}
    for mounting, own in means.items():
        found |= _of_mean(own, is_main=mounting == main.mounting)
    mean = means.get(main.mounting)
    model, delta = calibration.temperature_model, CROSS_AXES[law_axis].misalignment
    laws = {} if model is None else {"k0": model.k0, "K1": model.K1, delta: model.delta}
    second = calibration.second_axis_model
    if second is not None and model is not None and second.delta.at_T0 is not None:
        laws[CROSS_AXES["p" if law_axis == "o" else "o"].misalignment] = second.delta
    found |= {name: law.at_T0 for name, law in laws.items() if law.at_T0 is not None}
    if found["k0"].value is None:
        raise InputError("the calibration has no bias k0; fit a record that determines K0")
    if model is None:
        runs_in_use(calibration, calibration.tables)
    levels = known_temperatures(calibration.tables)
    return Coefficients(
        at_T0={name: q for name, q in found.items() if q.value is not None},
        slopes=laws,
        mounting=main.mounting,
        alone=main if mean is None else mean.coefficients,
        reference=_reference(calibration, main, mean),
        range=(min(levels), max(levels)) if levels else None,
        model=model,
        second=second,
    )


def _of_mean(mean: MeanOfRuns, *, is_main: bool) -> dict[str, Quantity]:
    """Coefficients of a mean of runs, in the second mounting those of its axis alone."""
    axis = CROSS_AXES[mean.first.mounting[0]]
    of_axis = {"delta": axis.misalignment, "delta_ip": axis.coupling}
    told = mean.coefficients.items()
    return {of_axis.get(name, name): q for name, q in told if is_main or name in of_axis}


def _reference(
    calibration: Calibration, main: TableCalibration, mean: MeanOfRuns | None
) -> float | None:
    """T0, or where there are no laws the temperature of what tells the coefficients [degC]."""
    if calibration.temperature_model is not None:
        return calibration.T0_degC
    return main.temperature_degC if mean is None else mean.temperature
