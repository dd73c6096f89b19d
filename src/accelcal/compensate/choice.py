"""From a calibration to its compensation: tables, laws, covariance, and what has to be assumed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from accelcal.compensate.coefficients import (
    PARAMETERS,
    Compensation,
    CrossAxis,
    FarLevel,
    Law,
    Slope,
)
from accelcal.errors import InputError
from accelcal.geometry import accelerations
from accelcal.model import ERROR_TERMS
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration
from accelcal.results.temperature import BilinearLaw, TemperatureModel

__all__ = ["compensation"]

Array = NDArray[np.float64]
Rows = tuple[tuple[float, ...], ...]

_CROSS_AXES = {"o": "a_p", "p": "a_o"}
"""Axis along the shaft -> acceleration along the cross axis in the plane of rotation."""

_OF_LAWS = ("K0", "K1", "M")


def compensation(calibration: Calibration, run: str | None = None) -> Compensation:
    """Choose what a calibration gives to its users.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    run : str, optional
        Use the table of this run only; by default the temperature laws, or the only table.

    Returns
    -------
    Compensation
        Coefficients at any temperature.

    Raises
    ------
    InputError
        If the calibration does not say which coefficients to use, or has none that are usable.

    Notes
    -----
    With temperature laws, k0, K1 and delta follow them; k2, k3 and delta_ip are means over the
    tables, weighted by 1/u^2. The error of the head is common to the tables, so the mean is given
    the weighted mean of their uncertainties and no smaller one. The covariance has the
    correlations of the table nearest to T0.

    Examples
    --------
    >>> import accelcal
    >>> found = compensation(accelcal.fit(accelcal.simulate(seed=1)))
    >>> found.temperatures, found.assumptions
    ((-40.0, 80.0), ())
    """
    if calibration.method == "printed":
        raise InputError(
            "the calibration is by method 'printed', which is misprinted; fit by least-squares"
        )
    tables = [table for table in calibration.tables if run is None or table.run == run]
    if not tables:
        runs = ", ".join(dict.fromkeys(table.run for table in calibration.tables))
        raise InputError(f"no run {run!r} in the calibration; it has {runs or 'none'}")
    model = calibration.temperature_model
    if model is not None and run is None:
        return _from_laws(calibration, model, tables)
    return _from_tables(calibration, tables)


def _from_tables(calibration: Calibration, tables: Sequence[TableCalibration]) -> Compensation:
    """One table, or one of each cross axis."""
    axes = [_cross_name(table) for table in tables]
    if len(set(axes)) < len(axes):
        names = ", ".join(f"{table.run} ({table.mounting})" for table in tables)
        raise InputError(
            f"{len(tables)} tables and no temperature law, runs {names}; choose by run or mounting"
        )
    main = tables[0]
    level = main.temperature_degC
    values = _values(main)
    other = _other_axis(tables[1:], main)
    return Compensation(
        k0=Law(values["k0"]),
        K1=Law(values["K1"]),
        k2=values["k2"],
        k3=values["k3"],
        cross=CrossAxis(_cross_name(main), Law(values["delta"]), values["delta_ip"]),
        covariance=_rows(_covariance(main)),
        T0=level,
        temperatures=None if level is None else (level, level),
        accelerations=_tested(main, calibration.delta0_rad),
        other=other[0] if other else None,
        other_covariance=other[1] if other else (),
        output_unit=calibration.output_unit,
        local_gravity=calibration.g_local_m_s2,
        serial=calibration.serial,
        undetermined=tuple(symbol for table in tables for symbol in _lost_symbols([table])),
        assumptions=(
            *_unknown_level(level),
            *_undetermined([[table] for table in tables]),
            *_uncertain(main),
        ),
    )


def _from_laws(
    calibration: Calibration, model: TemperatureModel, tables: Sequence[TableCalibration]
) -> Compensation:
    T0 = calibration.T0_degC
    chosen = _of_main_mounting(tables)
    if T0 is None or not chosen:
        raise InputError("the temperature laws have no T0 or no tables; fit the record anew")
    levels = [t.temperature_degC for t in chosen if t.temperature_degC is not None]
    main = min(chosen, key=lambda t: abs((t.temperature_degC or 0.0) - T0))
    common = {name: _mean(chosen, name) for name in ("k2", "k3", "delta_ip")}
    others = [t for t in tables if _cross_name(t) != _cross_name(main)]
    ratio = _ratio_of_uncertainties(main, model, common)
    groups = [chosen, *([table] for table in others)]
    other = _other_axis(others, main)
    return Compensation(
        k0=_law(model.k0, "k0"),
        K1=_law(model.K1, "K1"),
        k2=common["k2"][0],
        k3=common["k3"][0],
        cross=CrossAxis(_cross_name(main), _law(model.delta, "delta"), common["delta_ip"][0]),
        covariance=_rows(_covariance_at(main, ratio, model.hysteresis)),
        T0=T0,
        temperatures=(min(levels), max(levels)),
        above=_far_level(chosen, T0, 1.0, ratio, model)
        if model.k0.above and max(levels) > T0
        else None,
        below=_far_level(chosen, T0, -1.0, ratio, model)
        if model.k0.below and min(levels) < T0
        else None,
        accelerations=_tested(main, calibration.delta0_rad),
        other=other[0] if other else None,
        other_covariance=other[1] if other else (),
        output_unit=calibration.output_unit,
        local_gravity=calibration.g_local_m_s2,
        serial=calibration.serial,
        undetermined=tuple(s for group in groups for s in _lost_symbols(group)),
        assumptions=(
            *_one_sided(model),
            *_undetermined(groups),
            *([f"{other[0].name} acts alike at all temperatures"] if other else []),
            *_uncertain(main),
        ),
    )


def _cross_name(table: TableCalibration) -> str:
    return _CROSS_AXES[table.mounting[:1]]


def _of_main_mounting(tables: Sequence[TableCalibration]) -> list[TableCalibration]:
    """Tables of the mounting that the laws are made from: the one that met most levels."""
    by_mounting: dict[str, list[TableCalibration]] = {}
    for table in tables:
        if all(table.coefficients[name].value is not None for name in _OF_LAWS):
            by_mounting.setdefault(table.mounting, []).append(table)
    return max(by_mounting.values(), key=len, default=[])


# -- values ----------------------------------------------------------------------------------------


def _values(table: TableCalibration) -> dict[str, float]:
    """`PARAMETERS` of a table, 0 where not determined (which `_undetermined` tells)."""
    scale_factor = table.coefficients["K1"].value
    if not scale_factor:
        raise InputError(f"run {table.run} has no scale factor K1; fit it with K1 among them")
    errors = {name: quantity.value or 0.0 for name, quantity in table.error_model.items()}
    return {**errors, "K1": scale_factor}


def _mean(tables: Sequence[TableCalibration], name: str) -> tuple[float, float]:
    """Mean of a parameter over the tables that determined it, and its standard uncertainty."""
    known = [t.error_model[name] for t in tables if t.error_model[name].value is not None]
    if not known:
        return 0.0, 0.0
    values = np.array([quantity.value for quantity in known])
    uncertainties = np.array([_uncertainty(quantity) for quantity in known])
    weighable = bool(np.all(uncertainties > 0.0))
    weights = uncertainties**-2 if weighable else np.ones_like(values)
    weights /= weights.sum()
    return float(weights @ values), float(weights @ uncertainties)


def _uncertainty(quantity: Quantity) -> float:
    known = quantity.standard_uncertainty
    return np.nan if known is None else known


def _law(law: BilinearLaw, name: str) -> Law:
    """Law in plain numbers; a slope that is missing is that of the other side, +- all of it."""
    if law.at_T0 is None or law.at_T0.value is None:
        raise InputError(f"the temperature law of {name} has no value at T0; choose one run")
    above, below = _slope(law.above), _slope(law.below)
    return Law(law.at_T0.value, above or _borrowed(below), below or _borrowed(above))


def _slope(slope: Quantity | None) -> Slope | None:
    if slope is None or slope.value is None:
        return None
    return Slope(slope.value, _uncertainty(slope), determined=True)


def _borrowed(slope: Slope | None) -> Slope:
    return Slope() if slope is None else Slope(slope.value, abs(slope.value))


def _other_axis(
    tables: Sequence[TableCalibration], main: TableCalibration
) -> tuple[CrossAxis, Rows] | None:
    """The other cross axis from the table nearest in temperature, with its covariance."""
    if not tables:
        return None
    level = main.temperature_degC or 0.0
    table = min(tables, key=lambda t: abs((t.temperature_degC or 0.0) - level))
    values = _values(table)
    axis = CrossAxis(_cross_name(table), Law(values["delta"]), values["delta_ip"])
    return axis, _rows(_covariance(table)[4:, 4:])


def _tested(table: TableCalibration, delta0: float) -> tuple[float, float]:
    """Lowest and highest a_i of the positions [g]."""
    if not table.residuals.angle_deg:
        return (-1.0, 1.0)
    a_i = accelerations(table.residuals.angle_deg, delta0).input
    return float(a_i.min()), float(a_i.max())


# -- covariance ------------------------------------------------------------------------------------


def _covariance(table: TableCalibration) -> Array:
    """Covariance of `PARAMETERS` from that of K0 .. M_ip, by the quotients of (6)."""
    names = table.covariance_names
    if not names:
        return np.full((len(PARAMETERS), len(PARAMETERS)), np.nan)
    values = _values(table)
    scale_factor = values["K1"]
    jacobian = np.zeros((len(PARAMETERS), len(names)))
    for column, name in enumerate(names):
        jacobian[PARAMETERS.index(ERROR_TERMS.get(name, name)), column] = 1.0 / scale_factor
    for name in ERROR_TERMS.values():
        jacobian[PARAMETERS.index(name), names.index("K1")] -= values[name] / scale_factor
    return np.asarray(jacobian @ table.covariance @ jacobian.T)


def _ratio_of_uncertainties(
    main: TableCalibration, model: TemperatureModel, common: Mapping[str, tuple[float, float]]
) -> Array:
    """Standard uncertainties of laws and means at T0 over those of the table there."""
    sigma = np.sqrt(np.diagonal(_covariance(main)))
    wanted = np.array([_uncertainty_at_reference(name, model, common) for name in PARAMETERS])
    return np.asarray(np.divide(wanted, sigma, out=np.zeros_like(sigma), where=sigma != 0.0))


def _covariance_at(table: TableCalibration, ratio: Array, hysteresis: Quantity | None) -> Array:
    """Covariance with the correlations of a table, its uncertainties multiplied by the ratio."""
    with np.errstate(over="ignore"):
        covariance = np.asarray(_covariance(table) * np.outer(ratio, ratio))
    if np.isinf(covariance).any():
        raise InputError(
            "the temperature laws are too uncertain for their table; fit the record anew"
        )
    if hysteresis is not None and hysteresis.value is not None:
        covariance[0, 0] += hysteresis.value**2  # the bias is on either side of its law
    return covariance


def _far_level(
    tables: Sequence[TableCalibration],
    T0: float,
    side: float,
    ratio: Array,
    model: TemperatureModel,
) -> FarLevel:
    """The farthest level on one side; what raises the uncertainty of a law at T0 acts there too."""
    far = max(tables, key=lambda t: side * ((t.temperature_degC or 0.0) - T0))
    covariance = _covariance_at(far, np.maximum(ratio, 1.0), model.hysteresis)
    return FarLevel(far.temperature_degC or 0.0, _rows(covariance))


def _uncertainty_at_reference(
    name: str, model: TemperatureModel, common: Mapping[str, tuple[float, float]]
) -> float:
    if name in common:
        return common[name][1]
    at_T0 = {"k0": model.k0, "K1": model.K1, "delta": model.delta}[name].at_T0
    assert at_T0 is not None  # _law has seen to it
    assert at_T0.value is not None
    return _uncertainty(at_T0) / (abs(at_T0.value) if name == "K1" else 1.0)


def _rows(matrix: Array) -> Rows:
    return tuple(tuple(row) for row in matrix.tolist())


# -- assumptions -----------------------------------------------------------------------------------


def _undetermined(groups: Sequence[Sequence[TableCalibration]]) -> list[str]:
    """Say what no table of a group determines, and what then stands for what."""
    said = []
    for group in groups:
        lost = _lost(group)
        stands = [f"{name} stands for {what}" for name, what in group[0].stands_for.items()]
        if lost:
            verb = "was" if len(lost) == 1 else "were"
            what = f"{', '.join(lost)} {verb} not determined and taken as 0"
            said.append("; ".join([what, *stands]))
    return list(dict.fromkeys(said))


def _lost(tables: Sequence[TableCalibration]) -> list[str]:
    """Coefficients of (1) that no table determines."""
    names = tables[0].coefficients
    return [n for n in names if all(t.coefficients[n].value is None for t in tables)]


def _lost_symbols(tables: Sequence[TableCalibration]) -> list[str]:
    """Symbols of (2) that no table determines."""
    axis = CrossAxis(_cross_name(tables[0]), Law(0.0), 0.0)
    special = {"delta": axis.delta_symbol, "delta_ip": axis.coupling_symbol}
    symbols = (ERROR_TERMS[name] for name in _lost(tables))
    return [special.get(symbol, symbol) for symbol in symbols]


def _one_sided(model: TemperatureModel) -> list[str]:
    sides = [side for side in ("above", "below") if getattr(model.k0, side) is None]
    if len(sides) != 1:
        return ["no slopes were determined: the coefficients are those at T0"] if sides else []
    (missing,) = sides
    measured = "below" if missing == "above" else "above"
    return [f"no slopes {missing} T0 were determined: those {measured} are taken, +- all of them"]


def _unknown_level(level: float | None) -> list[str]:
    if level is not None:
        return []
    return ["the temperature of the calibration is unknown: that of the samples is not checked"]


def _uncertain(table: TableCalibration) -> list[str]:
    if table.covariance_names:
        return []
    return ["the calibration has no covariance: accelerations come without uncertainty"]
