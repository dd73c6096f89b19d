"""The parts that results are made of: a quantity, a gate, an error source, residuals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from accelcal.arguments.numbers import check_number
from accelcal.arguments.options import check_written
from accelcal.results.checked import (
    checked,
    freedom_or_none,
    list_of,
    number,
    number_or_none,
    size_or_none,
    text,
    whole,
)
from accelcal.results.damage import DamageError

__all__ = ["ErrorSource", "Gate", "Quantity", "Residuals", "fields_document"]

Document = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Quantity:
    """A value with its uncertainty.

    Attributes
    ----------
    value : float or None
        The estimate; None where the data do not determine it.
    standard_uncertainty : float or None
        Standard uncertainty; None where nothing tells it.
    unit : str
        Unit of value and uncertainties; ``g`` is local g.
    expanded_uncertainty : float or None
        Half width of the 95 % interval.
    dof : float or None
        Effective degrees of freedom of the interval; None where infinite or unknown.

    Raises
    ------
    InputError
        If one is of another kind, no finite number, or a size below 0.

    Examples
    --------
    >>> Quantity(3.323e-3, 7.6e-6, "g", 1.5e-5).coverage_factor
    1.973684210526316
    """

    value: float | None
    standard_uncertainty: float | None
    unit: str
    expanded_uncertainty: float | None = None
    dof: float | None = None

    def __post_init__(self) -> None:
        check_written(unit=self.unit)
        if self.value is not None:
            check_number(value=self.value)
        for name in ("standard_uncertainty", "expanded_uncertainty", "dof"):
            if getattr(self, name) is not None:
                check_number(0.0, **{name: getattr(self, name)})

    @property
    def coverage_factor(self) -> float | None:
        """Expanded over standard uncertainty."""
        if not self.standard_uncertainty or self.expanded_uncertainty is None:
            return None
        return self.expanded_uncertainty / self.standard_uncertainty

    def to_document(self) -> dict[str, Any]:
        """Return the quantity as it stands in the JSON document."""
        return {
            "value": self.value,
            "standard_uncertainty": self.standard_uncertainty,
            "unit": self.unit,
            "expanded_uncertainty": self.expanded_uncertainty,
            "dof": self.dof,
        }

    @classmethod
    def from_document(cls, document: Document) -> Quantity:
        """Read the quantity from its place in a JSON document."""
        return cls(
            value=checked(document, "value", number_or_none),
            standard_uncertainty=checked(document, "standard_uncertainty", size_or_none),
            unit=checked(document, "unit", text),
            expanded_uncertainty=checked(document, "expanded_uncertainty", size_or_none, None),
            dof=checked(document, "dof", freedom_or_none, None),
        )


@dataclass(frozen=True, slots=True)
class Gate:
    """Outcome of one check.

    Attributes
    ----------
    name : str
        What was checked.
    verdict : str
        ``"pass"``, ``"warn"`` or ``"not assessed"``.
    finding : str
        What was found, or why it could not be assessed.
    """

    name: str
    verdict: str
    finding: str

    def __repr__(self) -> str:
        return f"<Gate {self.name}: {self.verdict}>"

    def _repr_html_(self) -> str:
        from accelcal.report.notebook_results import gate_html

        return gate_html(self)

    @classmethod
    def from_document(cls, document: Document) -> Gate:
        """Read the outcome from its place in a JSON document."""
        return cls(*(checked(document, name, text) for name in ("name", "verdict", "finding")))


@dataclass(frozen=True, slots=True)
class ErrorSource:
    """Size of one source of error and how it is known.

    Attributes
    ----------
    name : str
        ``"reading"``, ``"head"``, ``"launch"`` or ``"launch_sf"``.
    value : float or None
        Standard deviation; None where unknown.
    unit : str
        Its unit.
    dof : float or None
        Degrees of freedom; None where infinite or unknown.
    source : str
        ``"declared"``, ``"estimated"``, ``"none"``, or where a reading's noise was taken from.
    """

    name: str
    value: float | None
    unit: str
    dof: float | None
    source: str

    @classmethod
    def from_document(cls, document: Document) -> ErrorSource:
        """Read the source of error from its place in a JSON document."""
        return cls(
            name=checked(document, "name", text),
            value=checked(document, "value", size_or_none),
            unit=checked(document, "unit", text),
            dof=checked(document, "dof", freedom_or_none, None),
            source=checked(document, "source", text),
        )


@dataclass(frozen=True, slots=True)
class Residuals:
    """Reading minus model, reading by reading.

    Attributes
    ----------
    angle_deg : tuple of float
        Head angle [deg].
    stroke : tuple of int
        Stroke.
    value : tuple of float
        Residual over K1 [g].
    """

    angle_deg: tuple[float, ...] = ()
    stroke: tuple[int, ...] = ()
    value: tuple[float, ...] = ()

    @classmethod
    def from_document(cls, document: Document) -> Residuals:
        """Read the residuals from their place in a JSON document."""
        found = cls(
            angle_deg=checked(document, "angle_deg", list_of(number)),
            stroke=checked(document, "stroke", list_of(whole)),
            value=checked(document, "value", list_of(number)),
        )
        if not len(found.angle_deg) == len(found.stroke) == len(found.value):
            raise DamageError("lists of different lengths")
        return found


def fields_document(item: Gate | ErrorSource | Residuals) -> dict[str, Any]:
    """Return the fields of a simple result as they stand in a JSON document.

    Parameters
    ----------
    item : Gate, ErrorSource or Residuals
        A result whose fields are plain values or tuples of them.

    Returns
    -------
    dict
        Field names and values.
    """
    values = {name: getattr(item, name) for name in type(item).__slots__}
    return {key: list(v) if isinstance(v, tuple) else v for key, v in values.items()}
