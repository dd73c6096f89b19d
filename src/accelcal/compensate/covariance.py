"""Covariance of what a compensation is made of: parameters at T0 and their slopes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.coefficients import PARAMETERS, SLOPES, Law
from accelcal.model import LAWS
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import Rows, rows_of
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration, quotients_by_coefficients
from accelcal.results.temperature import TemperatureModel

_IN_MODEL = {name: f"{name} at_T0" for name in LAWS} | {
    name: name.replace("_slope_", " ") for name in SLOPES
}
"""Error of the compensation -> its name in the covariance of the temperature laws."""


class _ParameterErrors(NamedTuple):
    """Covariance of `PARAMETERS` and `SLOPES`, shape (12, 12), by itself and over the freedom."""

    covariance: Rows  # NaN where unknown
    # the same with each source of error over its degrees of freedom; 0 where unknown
    over_dof: Rows


def errors_of_table(calibration: Calibration, table: TableCalibration) -> _ParameterErrors:
    """Errors of `PARAMETERS` from those of K0 .. M_ip, by the quotients of (6).

    A misalignment that is free of the fixture angle has its own uncertainty and the correlations of
    the table. `SLOPES`, which are not in it, have no errors.
    """
    if not table.covariance_names:
        unknown = np.full((len(PARAMETERS), len(PARAMETERS)), np.nan)
        return _of_table(unknown, np.zeros_like(unknown))
    jacobian = by_quotients(calibration, table)
    return _of_table(*(jacobian @ told @ jacobian.T for told in (table.covariance, table.over_dof)))


def by_quotients(calibration: Calibration, table: TableCalibration) -> Array:
    """Derivatives of `PARAMETERS` by the p coefficients in the covariance of a table, shape (6, p).

    That of K1 is relative.
    """
    by_K1 = np.equal(table.covariance_names, "K1") / (table.coefficients["K1"].value or np.nan)
    rows = {**quotients_by_coefficients(table), "K1": by_K1}
    jacobian = np.stack([rows[name] for name in PARAMETERS])
    own, free = table.error_model["delta"], calibration.misalignment(table)
    if own.standard_uncertainty and free is not own:
        jacobian[PARAMETERS.index("delta")] *= standard_uncertainty(free) / own.standard_uncertainty
    return jacobian


def _of_table(covariance: Array, over_dof: Array) -> _ParameterErrors:
    return _ParameterErrors(
        *(rows_of(np.pad(own, (0, len(SLOPES)))) for own in (covariance, over_dof))
    )


def errors_of_laws(
    model: TemperatureModel, laws: Mapping[str, Law], common: Mapping[str, Quantity]
) -> _ParameterErrors:
    """Errors of `PARAMETERS` and `SLOPES` from those of the laws of k0, K1 and delta.

    k2, k3 and delta_ip, `common` to all temperatures, have no law. What is not in the covariance of
    the model is uncorrelated.
    """
    names, scale_factor = (*PARAMETERS, *SLOPES), laws["K1"].at_T0
    variance, dof = _each_alone(model, laws, common)
    covariance, over_dof = np.diag(variance), np.diag(np.nan_to_num(variance / dof))
    places = {_IN_MODEL.get(name, name): place for place, name in enumerate(names)}
    known = [i for i, name in enumerate(model.covariance_names) if name in places]
    own = [places[model.covariance_names[i]] for i in known]
    relative = np.array([1.0 / scale_factor if names[i] == "K1" else 1.0 for i in own])
    for whole, told in ((covariance, model.covariance), (over_dof, model.over_dof)):
        whole[np.ix_(own, own)] = told[np.ix_(known, known)] * np.outer(relative, relative)
    return _ParameterErrors(rows_of(covariance), rows_of(over_dof))


def _each_alone(
    model: TemperatureModel, laws: Mapping[str, Law], common: Mapping[str, Quantity]
) -> tuple[Array, Array]:
    """Variance of each of `PARAMETERS` and `SLOPES`, and its degrees of freedom."""
    quantities: dict[str, Quantity | None] = dict(common)
    sigma = {n: standard_uncertainty(q) if q.value is not None else 0.0 for n, q in common.items()}
    for name, law in laws.items():
        of_model, unit = getattr(model, name), abs(law.at_T0) if name == "K1" else 1.0
        quantities[name] = of_model.at_T0
        sigma[name] = standard_uncertainty(of_model.at_T0) / unit
        for side in ("above", "below"):
            quantities[f"{name}_slope_{side}"] = getattr(of_model, side)
            sigma[f"{name}_slope_{side}"] = getattr(law, side).standard_uncertainty
    names = (*PARAMETERS, *SLOPES)
    dof = [(q and q.dof) or math.inf for q in map(quantities.get, names)]
    return np.array([sigma[name] for name in names]) ** 2, np.array(dof)


def standard_uncertainty(quantity: Quantity) -> float:
    """Standard uncertainty of a quantity, NaN where unknown."""
    known = quantity.standard_uncertainty
    return np.nan if known is None else known
