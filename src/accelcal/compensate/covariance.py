"""Covariance of what a compensation is made of: parameters at T0 and their slopes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.coefficients import PARAMETERS, SLOPES, Law
from accelcal.model import ERROR_TERMS, LAWS
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration
from accelcal.results.temperature import TemperatureModel

_IN_MODEL = {name: f"{name} at_T0" for name in LAWS} | {
    name: name.replace("_slope_", " ") for name in SLOPES
}
"""Error of the compensation -> its name in the covariance of the temperature laws."""


def covariance_of_table(calibration: Calibration, table: TableCalibration) -> Array:
    """Covariance of `PARAMETERS` from that of K0 .. M_ip, by the quotients of (6).

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    table : TableCalibration
        One of its tables.

    Returns
    -------
    ndarray, shape (6, 6)
        NaN where unknown. A misalignment that is free of the fixture angle has its own uncertainty
        and the correlations of the table.
    """
    names = table.covariance_names
    if not names:
        return np.full((len(PARAMETERS), len(PARAMETERS)), np.nan)
    values = {name: quantity.value or 0.0 for name, quantity in table.error_model.items()}
    scale_factor = table.coefficients["K1"].value or np.nan
    jacobian = np.zeros((len(PARAMETERS), len(names)))
    for column, name in enumerate(names):
        jacobian[PARAMETERS.index(ERROR_TERMS.get(name, name)), column] = 1.0 / scale_factor
    for name in ERROR_TERMS.values():
        jacobian[PARAMETERS.index(name), names.index("K1")] -= values[name] / scale_factor
    own, free = table.error_model["delta"], calibration.misalignment(table)
    if own.standard_uncertainty and free is not own:
        jacobian[PARAMETERS.index("delta")] *= standard_uncertainty(free) / own.standard_uncertainty
    return np.asarray(jacobian @ table.covariance @ jacobian.T)


def covariance_of_laws(
    model: TemperatureModel, laws: Mapping[str, Law], common: Mapping[str, Quantity]
) -> Array:
    """Covariance of `PARAMETERS` and `SLOPES`.

    Parameters
    ----------
    model : TemperatureModel
        The laws with their covariance.
    laws : mapping of str to Law
        What is used of them: k0, K1 and delta.
    common : mapping of str to Quantity
        k2, k3 and delta_ip, which have no law.

    Returns
    -------
    ndarray, shape (12, 12)
        NaN where unknown. What is not in the covariance of the model is uncorrelated.
    """
    scale_factor = laws["K1"].at_T0
    sigma = {
        name: standard_uncertainty(q) if q.value is not None else 0.0 for name, q in common.items()
    }
    for name, law in laws.items():
        at_T0 = getattr(model, name).at_T0
        sigma |= {name: standard_uncertainty(at_T0) / (abs(scale_factor) if name == "K1" else 1.0)}
        sigma |= {f"{name}_slope_above": law.above.standard_uncertainty}
        sigma |= {f"{name}_slope_below": law.below.standard_uncertainty}
    names = (*PARAMETERS, *SLOPES)
    covariance = np.diag([sigma[name] for name in names]) ** 2
    places = {_IN_MODEL.get(name, name): place for place, name in enumerate(names)}
    known = [i for i, name in enumerate(model.covariance_names) if name in places]
    own = [places[model.covariance_names[i]] for i in known]
    relative = [1.0 / scale_factor if names[i] == "K1" else 1.0 for i in own]
    told = model.covariance[np.ix_(known, known)]
    covariance[np.ix_(own, own)] = told * np.outer(relative, relative)
    return covariance


def freedom_of_table(calibration: Calibration, table: TableCalibration) -> tuple[float, ...]:
    """Degrees of freedom of `PARAMETERS` from a table; those of `SLOPES`, not in it, are infinite.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    table : TableCalibration
        One of its tables.

    Returns
    -------
    tuple of float, length 12
        The degrees of freedom.
    """
    known = {**table.error_model, "K1": table.coefficients["K1"]}
    return _freedom({**known, "delta": calibration.misalignment(table)})


def freedom_of_laws(model: TemperatureModel, common: Mapping[str, Quantity]) -> tuple[float, ...]:
    """Degrees of freedom of `PARAMETERS` and `SLOPES`.

    Parameters
    ----------
    model : TemperatureModel
        The laws.
    common : mapping of str to Quantity
        k2, k3 and delta_ip, which have no law.

    Returns
    -------
    tuple of float, length 12
        The degrees of freedom.
    """
    known: dict[str, Quantity | None] = dict(common)
    for name in LAWS:
        law = getattr(model, name)
        known |= {name: law.at_T0, f"{name}_slope_above": law.above}
        known |= {f"{name}_slope_below": law.below}
    return _freedom(known)


def _freedom(known: Mapping[str, Quantity | None]) -> tuple[float, ...]:
    """Degrees of freedom in the order of the covariance; infinite where a quantity has none."""
    quantities = (known.get(name) for name in (*PARAMETERS, *SLOPES))
    return tuple((q and q.dof) or math.inf for q in quantities)


def standard_uncertainty(quantity: Quantity) -> float:
    """Standard uncertainty of a quantity, NaN where unknown."""
    known = quantity.standard_uncertainty
    return np.nan if known is None else known
