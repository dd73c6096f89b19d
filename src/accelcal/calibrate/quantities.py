"""Coefficients and error model of one table with their uncertainties, in all records of a stack."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.uncertainty import Component, Intervals, interval_stack, propagate
from accelcal.model import COEFFICIENTS, ERROR_TERMS, POWERS
from accelcal.results.quantity import Quantity

__all__ = ["QuantityStack", "coefficient_stack", "error_model_stack"]

Array = NDArray[np.float64]

_ERROR_UNITS = {"k0": "g", "k2": "g/g^2", "k3": "g/g^3", "delta": "rad", "delta_ip": "g/g^2"}
_SCALE_FACTOR = COEFFICIENTS.index("K1")


class QuantityStack(NamedTuple):
    """Quantities of R records.

    Attributes
    ----------
    units : mapping of str to str
        Name of each of the m quantities and its unit.
    value : ndarray, shape (R, m)
        Estimates; NaN where the data do not determine one.
    standard, expanded : ndarray, shape (R, m)
        Standard uncertainty and half width of the 95 % interval; NaN where nothing tells them.
    dof : ndarray, shape (R, m)
        Effective degrees of freedom; infinite where known, NaN where nothing tells them.
    """

    units: Mapping[str, str]
    value: Array
    standard: Array
    expanded: Array
    dof: Array

    def one(self, record: int) -> dict[str, Quantity]:
        """Return the quantities of one record."""
        rows = zip(*(field[record].tolist() for field in self[1:]), strict=True)
        return {
            name: Quantity(_known(value), _known(standard), unit, _known(expanded), _finite(dof))
            for (name, unit), (value, standard, expanded, dof) in zip(
                self.units.items(), rows, strict=True
            )
        }

    def columns(self) -> dict[str, Array]:
        """Return a column for each value, standard and expanded uncertainty, and dof."""
        found: dict[str, Array] = {}
        for i, name in enumerate(self.units):
            found[name] = self.value[:, i]
            found[f"{name}_standard_uncertainty"] = self.standard[:, i]
            found[f"{name}_expanded_uncertainty"] = self.expanded[:, i]
            found[f"{name}_dof"] = np.where(np.isinf(self.dof[:, i]), np.nan, self.dof[:, i])
        return found


def coefficient_stack(
    names: tuple[str, ...], values: Array, own: Mapping[str, Component], unit: str | None
) -> QuantityStack:
    """Coefficients of one table in all records.

    Parameters
    ----------
    names : tuple of str
        The p coefficients that are estimated.
    values : ndarray, shape (R, 6)
        All coefficients, zero where not estimated [output unit / g^n].
    own : mapping of str to Component
        Components of the errors of those estimated, shape (R, p, p).
    unit : str or None
        Output unit.

    Returns
    -------
    QuantityStack
        K0, K1, K2, K3, M, M_ip.
    """
    units = {name: _coefficient_unit(unit, POWERS[name]) for name in COEFFICIENTS}
    places = [COEFFICIENTS.index(name) for name in names]
    return _stack(units, places, values[:, places], interval_stack(own))


def error_model_stack(
    names: tuple[str, ...], values: Array, own: Mapping[str, Component]
) -> QuantityStack:
    """Error model of one table in all records, with the uncertainty by the law of propagation.

    Parameters
    ----------
    names, values, own
        As of `coefficient_stack`.

    Returns
    -------
    QuantityStack
        k0, k2, k3, delta, delta_ip: quotients by K1, last line of (6).
    """
    places = [COEFFICIENTS.index(name) for name in names]
    scale_factor = values[:, _SCALE_FACTOR, None]
    quotients = values[:, places] / scale_factor
    jacobian = np.eye(len(names)) / scale_factor[..., None]
    jacobian[:, :, names.index("K1")] -= quotients / scale_factor
    known = interval_stack(propagate(own, jacobian))
    kept = [i for i, name in enumerate(names) if name in ERROR_TERMS]
    order = list(ERROR_TERMS)
    return _stack(
        {error: _ERROR_UNITS[error] for error in ERROR_TERMS.values()},
        [order.index(names[i]) for i in kept],
        quotients[:, kept],
        Intervals(*(field[:, kept] for field in known)),
    )


def _stack(
    units: Mapping[str, str], places: list[int], values: Array, known: Intervals
) -> QuantityStack:
    """Put what was estimated at its places among all, NaN elsewhere."""

    def placed(part: Array) -> Array:
        whole = np.full((len(part), len(units)), np.nan)
        whole[:, places] = part
        return whole

    parts = (values, known.standard, known.expanded, known.dof)
    return QuantityStack(units, *map(placed, parts))


def _coefficient_unit(unit: str | None, power: int) -> str:
    suffix = {0: "", 1: "/g"}.get(power, f"/g^{power}")
    return f"{unit or 'output unit'}{suffix}"


def _known(value: float) -> float | None:
    return value if value == value else None  # NaN is not itself


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
