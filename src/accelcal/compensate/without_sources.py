"""A calibration without what some sources of error give to it, as its user counts them itself."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from accelcal.compensate.coefficients import PARAMETERS
from accelcal.compensate.covariance import by_quotients
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import rows_of
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration
from accelcal.results.temperature import TemperatureModel


def without_sources(calibration: Calibration, sources: Collection[str]) -> Calibration:
    """Take what some sources give out of the covariances of a calibration.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    sources : collection of str
        Sources among the `shares` of its covariances.

    Returns
    -------
    Calibration
        For a compensation alone: of the uncertainties of its quantities, those of k0, k2, k3 and
        delta_ip follow.
    """
    told = (*calibration.tables, calibration.temperature_model, calibration.second_axis_model)
    if not any(each and not set(sources).isdisjoint(each.shares) for each in told):
        return calibration
    main, second = (
        model and _laws(model, sources)
        for model in (calibration.temperature_model, calibration.second_axis_model)
    )
    tables = tuple(_table(calibration, table, sources) for table in calibration.tables)
    return replace(calibration, tables=tables, temperature_model=main, second_axis_model=second)


def _laws(model: TemperatureModel, sources: Collection[str]) -> TemperatureModel:
    left = model.covariance - model.share(sources)
    return replace(model, covariance_matrix=rows_of(left), shares={})


def _table(
    calibration: Calibration, table: TableCalibration, sources: Collection[str]
) -> TableCalibration:
    share = table.share(sources)
    through = by_quotients(calibration, table) if share.size else np.zeros((len(PARAMETERS), 0))
    variances = dict(zip(PARAMETERS, np.diagonal(through @ share @ through.T), strict=True))
    errors = {
        # by_quotients needs that of delta as it is
        name: quantity if name == "delta" else _less(quantity, float(variances[name]))
        for name, quantity in table.error_model.items()
    }
    left = rows_of(table.covariance - share)
    return replace(table, covariance_matrix=left, error_model=errors, shares={})


def _less(quantity: Quantity, variance: float) -> Quantity:
    """A quantity of which a part of the variance is left out."""
    u, expanded = quantity.standard_uncertainty, quantity.expanded_uncertainty
    if not u or expanded is None:
        return quantity
    part = float(np.sqrt(max(1.0 - variance / u**2, 0.0)))
    return replace(quantity, standard_uncertainty=part * u, expanded_uncertainty=part * expanded)
