"""Coefficients and error models of the tables of a record with their uncertainties, in a stack."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.estimate.uncertainty import Component, Intervals, combined, interval_stack, quantities
from accelcal.model import COEFFICIENTS, ERROR_TERMS, ERROR_UNITS, coefficient_unit
from accelcal.results.quantity import Quantity


class QuantityStack(NamedTuple):
    """Quantities of the t tables of each of R records.

    Attributes
    ----------
    units : mapping of str to str
        Name of each of the m quantities and its unit.
    value : ndarray, shape (R, t, m)
        Estimates; NaN where the data do not determine one.
    standard, expanded : ndarray, shape (R, t, m)
        Standard uncertainty and half width of the 95 % interval; NaN where nothing tells them.
    dof : ndarray, shape (R, t, m)
        Effective degrees of freedom; infinite where known, NaN where nothing tells them.
    """

    units: Mapping[str, str]
    value: Array
    standard: Array
    expanded: Array
    dof: Array

    def one(self, record: int, table: int) -> dict[str, Quantity]:
        """Return the quantities of one table of one record."""
        parts = (field[record, table] for field in self[1:])
        return dict(zip(self.units, quantities(self.units.values(), *parts), strict=True))

    def without_uncertainty(self, records: Mask, names: Collection[str]) -> QuantityStack:
        """Take the uncertainties of some quantities from some of the R records."""
        own = records[:, None, None] & np.array([name in names for name in self.units])
        told = (np.where(own, np.nan, part) for part in (self.standard, self.expanded, self.dof))
        return QuantityStack(self.units, self.value, *told)

    def columns(self) -> dict[str, Array]:
        """Return columns of values, standard and expanded uncertainties, and dof, shape (R * t,).

        Table after table of a record, and record after record.
        """
        finite = np.where(np.isinf(self.dof), np.nan, self.dof)
        parts = {
            "": self.value,
            "_standard_uncertainty": self.standard,
            "_expanded_uncertainty": self.expanded,
            "_dof": finite,
        }
        return {
            name + suffix: part[:, :, i].ravel()
            for i, name in enumerate(self.units)
            for suffix, part in parts.items()
        }


class TableQuantities(NamedTuple):
    """What is known of the tables of R records."""

    coefficients: QuantityStack  # K0, K1, K2, K3, M, M_ip
    error_model: QuantityStack  # k0, k2, k3, delta, delta_ip: quotients by K1, last line of (6)

    def unbounded(self, records: Mask, names: Collection[str]) -> TableQuantities:
        """Take the uncertainties of coefficients from some records where nothing bounds an error.

        Their quotients by K1 have none either; in those of the others it is small.
        """
        quotients = [ERROR_TERMS[name] for name in names if name in ERROR_TERMS]
        return TableQuantities(
            self.coefficients.without_uncertainty(records, names),
            self.error_model.without_uncertainty(records, quotients),
        )


def table_quantities(
    names: Sequence[Sequence[str]],
    values: Sequence[Array],
    components: Mapping[str, Component],
    unit: str | None,
) -> TableQuantities:
    """Coefficients and error models of all tables in all records, with their uncertainties.

    Those estimated are named for each of t tables, P in all; the values of each table, shape (R,
    6), are zero where not estimated [output unit / g^n]; components of the errors of those
    estimated are of shape (R, P, P), table after table. Those of the quotients are by the law of
    propagation.
    """
    whole = [(table, name) for table, own in enumerate(names) for name in own]
    k = np.stack(values, axis=1)[:, *_columns(whole, COEFFICIENTS)]
    units = {name: coefficient_unit(name, unit) for name in COEFFICIENTS}
    own = [i for i, (_, name) in enumerate(whole) if name in ERROR_TERMS]
    scale_factors = {table: i for i, (table, name) in enumerate(whole) if name == "K1"}
    k1 = [scale_factors[whole[i][0]] for i in own]
    errors = [(table, ERROR_TERMS[name]) for table, name in (whole[i] for i in own)]
    quotients = k[:, own] / k[:, k1]
    parts = components.values()
    variances = [_of_quotients(part.covariance, quotients, own, k1) for part in parts]
    known = combined(
        [variance / k[:, k1] ** 2 for variance in variances],
        [np.minimum(part.dof[:, own], part.dof[:, k1]) for part in parts],
    )
    return TableQuantities(
        _stack(units, len(names), whole, k, interval_stack(components)),
        _stack(ERROR_UNITS, len(names), errors, quotients, known),
    )


def _of_quotients(
    covariance: Array, quotients: Array, own: Sequence[int], k1: Sequence[int]
) -> Array:
    """Variances of K / K1 times the square of K1, by the law of propagation, shape (R, m)."""
    of_own, with_k1, of_k1 = (covariance[:, i, j] for i, j in ((own, own), (own, k1), (k1, k1)))
    return np.asarray(of_own + quotients * (quotients * of_k1 - 2.0 * with_k1))


def _stack(
    units: Mapping[str, str],
    tables: int,
    places: Sequence[tuple[int, str]],
    values: Array,
    known: Intervals,
) -> QuantityStack:
    """Put what was estimated at its table and name, NaN elsewhere."""

    def placed(part: Array) -> Array:
        whole = np.full((len(part), tables, len(units)), np.nan)
        whole[:, *_columns(places, list(units))] = part
        return whole

    parts = (values, known.standard, known.expanded, known.dof)
    return QuantityStack(units, *map(placed, parts))


def _columns(
    places: Sequence[tuple[int, str]], names: Sequence[str]
) -> tuple[list[int], list[int]]:
    """Table and place among the names of each quantity."""
    return [table for table, _ in places], [names.index(name) for _, name in places]
