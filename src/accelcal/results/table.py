"""Calibration of one table: one run in one mounting."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from accelcal.escapes import visible
from accelcal.geometry import MOUNTINGS
from accelcal.results.covariance import CorrelatedBySource, Rows, correlation_of
from accelcal.results.documents.checked import DamageError, Kind, checked, mapping_of, one_of
from accelcal.results.documents.fields import Document, StoredPart, members
from accelcal.results.quantity import Gate, Quantity, Residuals
from accelcal.results.temperature import nearest_level

if TYPE_CHECKING:
    from accelcal.arrays import Array

__all__ = ["TableCalibration", "known_temperatures", "mountings_of_laws", "nearest_table"]
__all__ += ["quotients_by_coefficients", "tells_laws"]

_SMALLEST = 1e-20
"""Scale factors below it are none [output unit / g]."""


@dataclass(frozen=True, slots=True)
class TableCalibration(CorrelatedBySource, StoredPart):
    """Calibration of one table: one run in one mounting.

    Attributes
    ----------
    run, mounting : str
        Which table it is.
    temperature_degC : float or None
        Mean temperature; None where unknown.
    readings : int
        Number of readings.
    dof : int
        Readings minus coefficients.
    residual_rms : float
        Root of the sum of squared residuals over `dof` [output unit]; 0 where `dof` is 0.
    coefficients : mapping of str to Quantity
        K0, K1, K2, K3, M, M_ip [output unit / g^n].
    error_model : mapping of str to Quantity
        k0, k2, k3, delta, delta_ip.
    covariance_names, covariance_matrix
        Names of the estimated coefficients and their covariance; an empty matrix where unknown.
    budget : mapping of str to mapping of str to float
        For each coefficient the standard uncertainty from each source of error.
    stands_for : mapping of str to str
        What a coefficient really estimates where the angles cannot tell it from another.
    residuals : Residuals
        Reading minus model.
    gates : tuple of Gate
        Checks of this table.
    warnings : tuple of str
        What a reader must know before using the numbers.
    over_dof_matrix : tuple of tuple of float
        The covariance with each source of error over its degrees of freedom, see
        `accelcal.results.covariance`; empty where it was not kept.
    shares : mapping of str to tuple of tuple of float
        What sources that use may count by itself give to the covariance.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"mounting": one_of(*MOUNTINGS)}
    _MISSING: ClassVar[Mapping[str, Any]] = {
        **{"mounting": MOUNTINGS[0], "budget": {}, "stands_for": {}},
        **{"residuals": Residuals(), "gates": ()},
    }

    run: str
    mounting: str
    temperature_degC: float | None
    readings: int
    dof: int
    residual_rms: float
    coefficients: Mapping[str, Quantity]
    error_model: Mapping[str, Quantity]
    covariance_names: tuple[str, ...]
    covariance_matrix: Rows
    budget: Mapping[str, Mapping[str, float]]
    stands_for: Mapping[str, str]
    residuals: Residuals
    gates: tuple[Gate, ...] = ()
    warnings: tuple[str, ...] = ()
    over_dof_matrix: Rows = ()
    shares: Mapping[str, Rows] = field(default_factory=dict)

    @property
    def quantities(self) -> dict[str, Quantity]:
        """All of `coefficients` and `error_model`."""
        return {**self.coefficients, **self.error_model}

    def _dof_of(self, name: str) -> float:
        return self.coefficients[name].dof or math.inf

    @property
    def correlation(self) -> Array:
        """Correlation of the coefficients `covariance_names`, shape (p, p); NaN where exact."""
        return correlation_of(self.covariance)

    def __repr__(self) -> str:
        level = "" if self.temperature_degC is None else f" at {self.temperature_degC:.2f} degC"
        what = f"run {self.run}{level}, mounting {self.mounting}: {self.readings} readings"
        return visible(f"<TableCalibration {what}>")

    def _repr_html_(self) -> str:
        from accelcal.report.calibration import table_lines
        from accelcal.report.notebook import html_of

        return html_of(table_lines(self, None))

    def meaning(self, name: str) -> str:
        """Say what a coefficient really estimates at these angles.

        Parameters
        ----------
        name : str
            One of `coefficients` or `error_model`.

        Returns
        -------
        str
            The coefficient itself, or what it cannot be told apart from as well.
        """
        from accelcal.model import COEFFICIENT_OF, ERROR_UNITS  # here, as numpy comes with it

        absorbed = self.stands_for.get(COEFFICIENT_OF.get(name, name))
        if absorbed is None:
            return name
        return f"({absorbed})/K1" if name in ERROR_UNITS else absorbed

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "run mounting temperature_degC readings dof residual_rms"),
            **members(self, "coefficients error_model"),
            "covariance": self._covariance_document(),
            **members(self, "budget stands_for residuals gates warnings"),
        }

    @classmethod
    def _read(cls, document: Document) -> TableCalibration:
        from accelcal.model import COEFFICIENTS, ERROR_TERMS  # here, as numpy comes with it

        return cls._of_fields(
            document,
            **cls._covariance_fields(document),
            coefficients=checked(document, "coefficients", _all_of(COEFFICIENTS)),
            error_model=checked(document, "error_model", _all_of(ERROR_TERMS.values())),
        )._usable()

    def _usable(self) -> TableCalibration:
        """Demand a scale factor, whose quotients make the error model, and its covariance."""
        scale_factor = self.coefficients["K1"].value
        if scale_factor is None or abs(scale_factor) < _SMALLEST:
            raise DamageError(f"{scale_factor} in place of a scale factor", "coefficients", "K1")
        known = [name for name, quantity in self.coefficients.items() if quantity.value is not None]
        if self.covariance_names and not {"K1"} <= set(self.covariance_names) <= set(known):
            names = ", ".join(self.covariance_names)
            raise DamageError(f"{names} in place of K1 and others of coefficients", "covariance")
        return self


def nearest_table(
    tables: Sequence[TableCalibration], temperature: float | None
) -> TableCalibration:
    """Choose the table nearest to a temperature.

    Parameters
    ----------
    tables : sequence of TableCalibration
        One or more.
    temperature : float or None
        Temperature, such as T0; None where unknown [degC].

    Returns
    -------
    TableCalibration
        The first of the nearest, by `nearest_level`.
    """
    return tables[nearest_level([t.temperature_degC for t in tables], temperature)]


def known_temperatures(tables: Sequence[TableCalibration]) -> list[float]:
    """List the temperatures of some tables, without those that are unknown.

    Parameters
    ----------
    tables : sequence of TableCalibration
        The tables.

    Returns
    -------
    list of float
        Mean temperatures in the order of the tables [degC].
    """
    return [t.temperature_degC for t in tables if t.temperature_degC is not None]


def quotients_by_coefficients(table: TableCalibration) -> dict[str, Array]:
    """Differentiate the error model of a table, which has quotients by K1.

    Parameters
    ----------
    table : TableCalibration
        A table with a covariance.

    Returns
    -------
    dict of str to ndarray, shape (p,)
        For k0, k2, k3, delta and delta_ip the derivatives by the coefficients of
        `covariance_names`; 0 for what is not determined.
    """
    import numpy as np

    from accelcal.model import COEFFICIENT_OF  # here, as numpy comes with it

    names = table.covariance_names
    unit = dict(zip(names, np.eye(len(names)), strict=True))
    scale_factor = table.coefficients["K1"].value or np.nan
    return {
        name: (unit.get(COEFFICIENT_OF[name], 0.0) - (quantity.value or 0.0) * unit["K1"])
        / scale_factor
        for name, quantity in table.error_model.items()
    }


def _all_of(names: Iterable[str]) -> Kind[dict[str, Quantity]]:
    """Take all quantities in their order; one that is left out was not determined."""
    own = tuple(names)

    def take(value: Any) -> dict[str, Quantity]:
        found = mapping_of(Quantity.from_document, own)(value)
        return {name: found.get(name, Quantity(None, None, "")) for name in own}

    return take


def tells_laws(table: TableCalibration) -> bool:
    """Whether a table determined K0, K1 and M, so that temperature laws may be made from it."""
    found = map(table.coefficients.get, ("K0", "K1", "M"))  # a document may have some of them only
    return all(quantity is not None and quantity.value is not None for quantity in found)


def mountings_of_laws(
    mountings: Sequence[str], told: Sequence[bool] = ()
) -> tuple[str, str | None]:
    """Tell the mountings that the temperature laws of a calibration are made from.

    Parameters
    ----------
    mountings : sequence of str
        Mounting of each table.
    told : sequence of bool, optional
        Which tables determined K0, K1 and M; by default all.

    Returns
    -------
    main : str
        The one of most tables that did, the first of several; of most tables where none did.
    second : str or None
        The same of the other axis along the shaft; None where no table has it.

    Examples
    --------
    >>> mountings_of_laws(["o+", "o-", "o-", "p+"]), mountings_of_laws(["p+"])
    (('o-', 'p+'), ('p+', None))
    >>> mountings_of_laws(["o+", "o+", "p+"], [False, False, True])
    ('p+', 'o+')
    """
    able = [mounting for mounting, own in zip(mountings, told, strict=False) if own]
    main = _most_of(able or mountings)
    able, others = ([own for own in some if own[0] != main[0]] for some in (able, mountings))
    return main, _most_of(able or others) if others else None


def _most_of(mountings: Sequence[str]) -> str:
    return max(mountings, key=mountings.count)
