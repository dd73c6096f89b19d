"""Coefficients at a temperature between the levels of a calibration."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from accelcal.arguments.options import check_flag
from accelcal.arguments.temperatures import check_temperature
from accelcal.arrays import Array
from accelcal.compensate.assumptions import warn_of
from accelcal.compensate.choice import By, compensation
from accelcal.compensate.coefficients import PARAMETERS, Compensation, symbol_of
from accelcal.compensate.levels import LevelCompensation
from accelcal.compensate.of_table import lost_symbols
from accelcal.compensate.propagation import interval_of_parts, propagated
from accelcal.compensate.ranges import CALIBRATE_THERE, outside_temperatures, within_temperatures
from accelcal.compensate.runs import are_alike, by_runs
from accelcal.errors import InputError
from accelcal.frozen_mapping import FrozenMapping
from accelcal.model import ERROR_UNITS
from accelcal.plural import listed
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import Correlated, Rows, rows_of
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration
from accelcal.results.tabular import frame_of

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["CoefficientsAt", "coefficients_at"]


class CoefficientsAt(Correlated, FrozenMapping[Quantity]):
    """Coefficients at a temperature: a mapping of their symbols to quantities.

    Attributes
    ----------
    covariance_names, covariance_matrix
        Symbols of those whose uncertainty is known and their covariance, which is the array
        `covariance` as well, in the units of the quantities.
    over_dof_matrix
        The same with each source of error over its degrees of freedom, which is the array
        `over_dof` as well.

    Examples
    --------
    The uncertainty of the output at 1 g, K1 (k0 + 1 g + k2 + k3) without the cross axis:

    >>> import numpy as np
    >>> import accelcal
    >>> found = accelcal.coefficients_at(accelcal.fit(accelcal.simulate(seed=1)), 35.0)
    >>> found.covariance_names
    ('k0', 'K1', 'k2', 'k3', 'delta', 'delta_ip')
    >>> a = 1.0 + sum(found[name].value for name in ("k0", "k2", "k3"))
    >>> K1 = found["K1"].value
    >>> jacobian = np.array([K1, a, K1, K1, 0.0, 0.0])
    >>> f"{np.sqrt(jacobian @ found.covariance @ jacobian) / K1:.1e} g"
    '6.9e-06 g'
    """

    __slots__ = ("covariance_matrix", "covariance_names", "over_dof_matrix")

    def __init__(
        self,
        quantities: Mapping[str, Quantity],
        names: tuple[str, ...],
        covariance: Rows,
        over_dof: Rows,
    ) -> None:
        super().__init__(quantities)
        self.covariance_names = names
        self.covariance_matrix, self.over_dof_matrix = covariance, over_dof

    @property
    def over_dof(self) -> Array:
        """The covariance, each source of error over its degrees of freedom, shape (n, n)."""
        return np.array(self.over_dof_matrix, dtype=np.float64).reshape(self.covariance.shape)

    def copy(self) -> Self:
        """Return the coefficients with their covariance: they stay as they are.

        One to be changed is ``dict(coefficients)``.
        """
        return self

    def __str__(self) -> str:
        return "\n".join(f"{name}: {quantity}" for name, quantity in self.items())

    def _repr_html_(self) -> str:
        import pandas as pd

        columns = {"coefficient": list(self), "value (95 %)": list(map(str, self.values()))}
        return str(pd.DataFrame(columns).to_html(index=False))

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the coefficients.

        Returns
        -------
        pandas.DataFrame
            A row a coefficient; ``frame.attrs["units"]`` maps the columns of numbers to ``"unit"``,
            the column of their units.
        """
        return frame_of([{"coefficient": name, **own.to_document()} for name, own in self.items()])

    def __reduce__(self) -> tuple[Any, ...]:
        matrices = self.covariance_matrix, self.over_dof_matrix
        return type(self), (dict(self), self.covariance_names, *matrices)


def coefficients_at(
    calibration: Calibration,
    temperature: float,
    *,
    run: str | int | None = None,
    by: By = "laws",
    extrapolate: bool = False,
) -> CoefficientsAt:
    """Coefficients at a temperature, by the laws of a calibration or between its levels.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    temperature : float
        Temperature, one at a time [degC].
    run : str or int, optional
        Use the table of this run only.
    by : {"laws", "levels"}, default "laws"
        How the coefficients depend on temperature: by the laws, or all on straight lines between
        the levels of the calibration.
    extrapolate : bool, default False
        Accept a temperature outside the calibrated range, with a warning.

    Returns
    -------
    CoefficientsAt
        ``"k0"`` [g], ``"K1"`` [output unit / g], ``"k2"`` [g/g^2], ``"k3"`` [g/g^3], ``"delta"``
        [rad] and ``"delta_ip"`` [g/g^2], of the mounting of the laws (of another axis give
        ``calibration.of_mounting("p+")``); without a value where the
        calibration does not determine it, and without an uncertainty outside the only level of a
        run, or of a calibration without laws. `covariance` has the covariance of them.

    Raises
    ------
    InputError
        If the temperature is none of a test or more than 1 degC outside the calibrated range, or
        the calibration is not usable, as where it has several levels and no laws: choose a run.

    Warns
    -----
    AccelcalWarning
        About every coefficient that was not determined, and what is assumed in its place.

    Notes
    -----
    Bias, scale factor and misalignment follow the laws of (4); k2, k3 and delta_ip have none, each
    is that of the table nearest to T0 that tells it. With J the derivatives by the values at T0 and
    by the slopes of the side of the temperature, and C their covariance, the covariance is J C J'.
    It is that of the laws: the shift to the next launch and the hysteresis, which `accelcal.apply`
    counts, are not in it. By levels the hysteresis is, see
    `accelcal.compensate.levels.LevelTable`. Several runs at one level without laws count by their
    mean.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> found = accelcal.coefficients_at(calibration, 35.0)
    >>> round(found["K1"].value, 3), found["K1"].unit
    (1.361, 'mA/g')
    """
    check_flag(extrapolate=extrapolate)
    check_temperature(temperature=temperature)
    found = compensation(calibration, run, by=by, same_launch=True, effects=False)
    warn_of(found.assumptions)
    within = within_temperatures(found.temperatures, temperature)
    if not within:
        problem = outside_temperatures(found.temperatures, temperature)
        if not extrapolate:
            raise InputError(f"{problem}; {CALIBRATE_THERE}")
        warn_of([problem])
    rise = 0.0 if found.T0_degC is None else temperature - found.T0_degC
    is_known = bool(within) or (calibration.temperature_model is not None and run is None)
    told = _between_levels(found, rise) if by == "levels" else _by_laws(found, rise, is_known)
    return _coefficients(calibration, found, rise, told)


class MeanOfRuns(NamedTuple):
    """Coefficients of several runs at one level."""

    # which they are, such as ``"runs 1 and 2"``, in the second mounting ``"runs 3 and 4 (p+)"``
    runs: str
    first: TableCalibration  # table of the first of them
    temperature: float | None  # their mean temperature [degC]; None where unknown
    coefficients: CoefficientsAt  # those that `accelcal.coefficients_at` gives there


def means_of_runs(calibration: Calibration) -> list[MeanOfRuns]:
    """Mean of the runs in the main and in the second mounting, where there is one."""
    mountings = filter(None, calibration.mountings_of_laws)
    found = (mean_of_runs(calibration, mounting) for mounting in mountings)
    return [mean for mean in found if mean is not None]


def mean_of_runs(calibration: Calibration, mounting: str | None = None) -> MeanOfRuns | None:
    """Mean of the runs of a calibration without laws; None where they are not all of one level.

    They are those of one mounting, the main one by default.
    """
    main = calibration.main_mounting
    tables = [t for t in calibration.tables if t.mounting == (mounting or main)]
    has_K1 = all(table.coefficients["K1"].value for table in tables)
    if calibration.temperature_model or len(tables) < 2 or not (has_K1 and are_alike(tables)):
        return None
    found = replace(by_runs(calibration, tables), undetermined=lost_symbols([tables]))
    mean = _coefficients(calibration, found, 0.0, _by_laws(found, 0.0, is_known=True))
    side = "" if tables[0].mounting == main else f" ({mounting})"
    runs = f"runs {listed(table.run for table in tables)}{side}"
    return MeanOfRuns(runs, tables[0], found.T0_degC, mean)


class _Propagation(NamedTuple):
    """Derivatives of `PARAMETERS` by what errors are of, and these, shape (2, n, n)."""

    jacobian: Array
    errors: Array


def _coefficients(
    calibration: Calibration, found: Compensation, rise: float, told: _Propagation
) -> CoefficientsAt:
    """Coefficients at T - T0, and the covariance of those that have an uncertainty."""
    values = np.array(found.parameters(np.asarray(rise))[0], dtype=np.float64)
    units = {**ERROR_UNITS, "K1": calibration.tables[0].coefficients["K1"].unit}
    quantities = {
        name: Quantity(None, None, units[name])
        if symbol_of(name, found.cross.name) in found.undetermined
        else _quantity(value, row, told.errors, units[name])
        for name, value, row in zip(PARAMETERS, values.tolist(), told.jacobian, strict=True)
    }
    names = [name for name, found in quantities.items() if found.standard_uncertainty is not None]
    jacobian = told.jacobian[[PARAMETERS.index(name) for name in names]]
    errors = jacobian @ np.nan_to_num(told.errors) @ jacobian.T  # NaN is in nothing with a name
    return CoefficientsAt(quantities, tuple(names), *map(rows_of, errors))


def _between_levels(found: Compensation, rise: float) -> _Propagation:
    """Errors on the straight lines between levels."""
    assert isinstance(found, LevelCompensation)
    return _Propagation(np.eye(len(PARAMETERS)), found.table.errors_at(rise))


def _by_laws(found: Compensation, rise: float, is_known: bool) -> _Propagation:
    """Errors by the laws or of a table, which are not known at all temperatures."""
    errors = np.array(found.errors)
    errors[0] += 0.0 if is_known else np.nan
    return _Propagation(found.derivatives(rise), errors)


def _quantity(value: float, row: Array, errors: Array, unit: str) -> Quantity:
    """One of them with its uncertainty, by the covariance of what it is made of."""
    told = interval_of_parts([propagated(errors, list(row))])
    standard, expanded, dof = (float(each) for each in (told.standard, told.expanded, told.dof))
    if math.isnan(standard):
        return Quantity(value, None, unit)
    return Quantity(value, standard, unit, expanded, None if math.isinf(dof) else dof)
