"""The parts of a discovery: gaps, shares, effects, faults, what cannot be seen, what changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from accelcal.results.checked import (
    checked,
    list_of,
    mapping_of,
    number,
    number_or_none,
    text,
    whole,
)
from accelcal.results.quantity import Document, Quantity

__all__ = [
    "Change",
    "Detectable",
    "Fault",
    "FoundEffect",
    "Gap",
    "Share",
    "Undetectable",
    "Unexplained",
    "plain",
]


@dataclass(frozen=True, slots=True)
class Gap:
    """How far model and readings are apart.

    Attributes
    ----------
    rms : float
        Of reading minus model [g].
    heldout_rms : float or None
        The same of readings that were not fitted; None where too few are left to fit.
    reduced_chi2 : float
        Sum of squares in the measure of the noise over its degrees of freedom.
    """

    rms: float
    heldout_rms: float | None
    reduced_chi2: float

    @classmethod
    def from_document(cls, document: Document) -> Gap:
        """Read the gap from its place in a JSON document."""
        return cls(
            checked(document, "rms", number),
            checked(document, "heldout_rms", number_or_none),
            checked(document, "reduced_chi2", number),
        )


@dataclass(frozen=True, slots=True)
class Share:
    """What one factor of the test has of the disagreement.

    Attributes
    ----------
    factor : str
        ``"position"``, ``"stroke"``, ..., or several with ``"*"``.
    share : float
        Part of the sum of squares, in the measure of the noise; that of all factors and of the
        repeatability is 1.
    p_value : float
        Chance that noise alone has as large a share, over all factors (Holm).
    """

    factor: str
    share: float
    p_value: float

    @classmethod
    def from_document(cls, document: Document) -> Share:
        """Read the share from its place in a JSON document."""
        return cls(
            checked(document, "factor", text),
            checked(document, "share", number),
            checked(document, "p_value", number),
        )


@dataclass(frozen=True, slots=True)
class FoundEffect:
    """An effect that was found.

    Attributes
    ----------
    id, name : str
        Its id and name in the catalogue.
    parameters : mapping of str to Quantity
        Its parameters with their uncertainties.
    p_value : float
        Chance that noise makes any effect of the catalogue look as needed.
    gap_before, gap_after : float
        Rms of reading minus model without and with the effect [g].
    heldout_before, heldout_after : float or None
        The same of readings that were not fitted [g].
    indistinguishable : tuple of str
        Ids of effects that explain these readings too.
    to_tell_apart : str
        Measurement that would tell them apart; empty where there are none.
    """

    id: str
    name: str
    parameters: Mapping[str, Quantity]
    p_value: float
    gap_before: float
    gap_after: float
    heldout_before: float | None
    heldout_after: float | None
    indistinguishable: tuple[str, ...]
    to_tell_apart: str

    def to_document(self) -> dict[str, Any]:
        """Return the effect as it stands in the JSON document."""
        parameters = {name: value.to_document() for name, value in self.parameters.items()}
        return {**plain(self), "parameters": parameters}

    @classmethod
    def from_document(cls, document: Document) -> FoundEffect:
        """Read the effect from its place in a JSON document."""
        return cls(
            id=checked(document, "id", text),
            name=checked(document, "name", text),
            parameters=checked(document, "parameters", mapping_of(Quantity.from_document)),
            p_value=checked(document, "p_value", number),
            gap_before=checked(document, "gap_before", number),
            gap_after=checked(document, "gap_after", number),
            heldout_before=checked(document, "heldout_before", number_or_none),
            heldout_after=checked(document, "heldout_after", number_or_none),
            indistinguishable=checked(document, "indistinguishable", list_of(text)),
            to_tell_apart=checked(document, "to_tell_apart", text),
        )


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault of the readings, found before any physics.

    Attributes
    ----------
    id : str
        Its id in the catalogue, or ``"order"``.
    finding : str
        What was found, where, and what to do.
    parameters : mapping of str to Quantity
        Its parameters.
    p_value : float
        Chance that noise alone looks like it.
    readings : tuple of int
        Places of the readings in the record, from 0.
    """

    id: str
    finding: str
    parameters: Mapping[str, Quantity]
    p_value: float
    readings: tuple[int, ...]

    def to_document(self) -> dict[str, Any]:
        """Return the fault as it stands in the JSON document."""
        parameters = {name: value.to_document() for name, value in self.parameters.items()}
        return {**plain(self), "parameters": parameters}

    @classmethod
    def from_document(cls, document: Document) -> Fault:
        """Read the fault from its place in a JSON document."""
        return cls(
            id=checked(document, "id", text),
            finding=checked(document, "finding", text),
            parameters=checked(document, "parameters", mapping_of(Quantity.from_document)),
            p_value=checked(document, "p_value", number),
            readings=checked(document, "readings", list_of(whole)),
        )


@dataclass(frozen=True, slots=True)
class Unexplained:
    """A disagreement that no effect of the catalogue explains.

    Attributes
    ----------
    structure : str
        What it looks like.
    share : float
        Its part of the sum of squares.
    p_value : float
        Chance that noise alone disagrees as much.
    """

    structure: str
    share: float
    p_value: float

    @classmethod
    def from_document(cls, document: Document) -> Unexplained:
        """Read it from its place in a JSON document."""
        return cls(
            checked(document, "structure", text),
            checked(document, "share", number),
            checked(document, "p_value", number),
        )


@dataclass(frozen=True, slots=True)
class Undetectable:
    """An effect that this test cannot show.

    Attributes
    ----------
    id : str
        Its id.
    absorbed_by : tuple of str
        Coefficients that would take it up.
    """

    id: str
    absorbed_by: tuple[str, ...]

    @classmethod
    def from_document(cls, document: Document) -> Undetectable:
        """Read it from its place in a JSON document."""
        return cls(checked(document, "id", text), checked(document, "absorbed_by", list_of(text)))


@dataclass(frozen=True, slots=True)
class Detectable:
    """The smallest size of an effect that this test would show.

    Attributes
    ----------
    id : str
        Its id.
    value : float
        Size that is found nine times in ten.
    unit : str
        Its unit.
    """

    id: str
    value: float
    unit: str

    @classmethod
    def from_document(cls, document: Document) -> Detectable:
        """Read it from its place in a JSON document."""
        return cls(
            checked(document, "id", text),
            checked(document, "value", number),
            checked(document, "unit", text),
        )


@dataclass(frozen=True, slots=True)
class Change:
    """A coefficient of the model without and with what was found.

    Attributes
    ----------
    coefficient : str
        Its symbol.
    before, after : Quantity
        Its value over K1 of the fit without the effects.
    """

    coefficient: str
    before: Quantity
    after: Quantity

    def to_document(self) -> dict[str, Any]:
        """Return the change as it stands in the JSON document."""
        return {
            "coefficient": self.coefficient,
            "before": self.before.to_document(),
            "after": self.after.to_document(),
        }

    @classmethod
    def from_document(cls, document: Document) -> Change:
        """Read the change from its place in a JSON document."""
        return cls(
            checked(document, "coefficient", text),
            checked(document, "before", Quantity.from_document),
            checked(document, "after", Quantity.from_document),
        )


def plain(item: Any) -> dict[str, Any]:
    """Return the fields of a part as they stand in the JSON document."""
    values = {field.name: getattr(item, field.name) for field in fields(item)}
    return {key: list(v) if isinstance(v, tuple) else v for key, v in values.items()}
