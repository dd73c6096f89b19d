"""A calibration without what some sources of error give to it, as its user counts them itself."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import rows_of
from accelcal.results.documents.fields import finite_or_none
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration, quotients_by_coefficients
from accelcal.results.temperature import TemperatureLaw, TemperatureModel


def without_sources(calibration: Calibration, sources: Collection[str]) -> Calibration:
    """Take what some sources of its `shares` give out of the uncertainties of a calibration.

    Those of its tables and laws are smaller then. Fixture angles keep theirs, and so do the
    misalignments that they are told apart from.
    """
    told = (*calibration.tables, calibration.temperature_model, calibration.second_axis_model)
    if not any(each and not set(sources).isdisjoint(each.shares) for each in told):
        return calibration
    main, second = (
        model and _laws(model, sources)
        for model in (calibration.temperature_model, calibration.second_axis_model)
    )
    kept = ("delta",) if calibration.fixture_angle else ()
    tables = tuple(_table(table, sources, kept) for table in calibration.tables)
    return replace(calibration, tables=tables, temperature_model=main, second_axis_model=second)


def _laws(model: TemperatureModel, sources: Collection[str]) -> TemperatureModel:
    share = model.share(sources)
    less = dict(zip(model.covariance_names, np.diagonal(share).tolist(), strict=True))

    def law(name: str, found: TemperatureLaw) -> TemperatureLaw:
        parts = {part: getattr(found, part) for part in ("at_T0", "above", "below")}
        return TemperatureLaw(
            **{part: q and _less(q, less.get(f"{name} {part}", 0.0)) for part, q in parts.items()}
        )

    left = rows_of(model.covariance - share)
    k0, K1, delta = (law(name, found) for name, found in model.laws.items())
    return replace(model, k0=k0, K1=K1, delta=delta, covariance_matrix=left, shares={})


def _table(
    table: TableCalibration, sources: Collection[str], kept: Collection[str]
) -> TableCalibration:
    if not table.covariance_names:
        return table
    share = table.share(sources)
    own, errors = dict(table.coefficients), dict(table.error_model)
    for name, variance in zip(table.covariance_names, np.diagonal(share).tolist(), strict=True):
        own[name] = _less(own[name], variance)
    for name, row in quotients_by_coefficients(table).items():
        if name not in kept:
            errors[name] = _less(errors[name], float(row @ share @ row))
    return replace(
        table,
        coefficients=own,
        error_model=errors,
        covariance_matrix=rows_of(table.covariance - share),
        shares={},
    )


def _less(quantity: Quantity, variance: float) -> Quantity:
    """A quantity of which a part of the variance is left out, one of infinite freedom."""
    u = quantity.standard_uncertainty
    if not u or not variance or quantity.expanded_uncertainty is None:
        return quantity
    part = max(1.0 - variance / u**2, 0.0)
    dof, standard = part * (quantity.dof or np.inf), float(np.sqrt(part)) * u
    expanded = student_quantile(LEVEL, dof) * standard if part else 0.0
    return replace(
        quantity,
        standard_uncertainty=standard,
        expanded_uncertainty=expanded,
        dof=finite_or_none(dof) or None,
    )
