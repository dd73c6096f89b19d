"""The parts of a discovery: gaps, shares, effects, faults, what cannot be seen, what changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from accelcal.escapes import visible
from accelcal.results.documents.fields import StoredPart
from accelcal.results.quantity import Quantity

__all__ = [
    "Change",
    "Detectable",
    "Fault",
    "FoundEffect",
    "Gap",
    "Share",
    "Undetectable",
    "Unexplained",
]


WRONG_ORDER = "order"
"""Id of a fault that is no entry of the catalogue."""

EMPIRICAL = "empirical:"
"""How the ids of terms begin that stand for a pattern without a cause."""


@dataclass(frozen=True, slots=True)
class Gap(StoredPart):
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

    def until(self, after: Gap) -> dict[str, Any]:
        """Both gaps, as a `FoundEffect` has those without and with it."""
        return {
            "gap_before": self.rms,
            "gap_after": after.rms,
            "heldout_before": self.heldout_rms,
            "heldout_after": after.heldout_rms,
        }


@dataclass(frozen=True, slots=True)
class Share(StoredPart):
    """What one factor of the test has of the disagreement.

    Attributes
    ----------
    factor : str
        ``"position"``, ``"stroke"``, ``"cycle"``, ``"time"``, ``"temperature"``,
        ``"heating/cooling"``, ``"run"``, or several with ``"*"``.
    share : float
        Part of the sum of squares, in the measure of the noise; that of all factors and of the
        repeatability is 1.
    p_value : float
        Chance that noise alone has as large a share, over all factors (Holm).
    """

    factor: str
    share: float
    p_value: float


@dataclass(frozen=True, slots=True)
class FoundEffect(StoredPart):
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
    elsewhere : tuple of mapping of str to float
        Other places at which the effect explains these readings too, as the head angle ``at`` of
        a position.
    """

    _MISSING: ClassVar[Mapping[str, Any]] = {"elsewhere": ()}

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
    elsewhere: tuple[Mapping[str, float], ...] = ()

    def __repr__(self) -> str:
        sizes = ", ".join(f"{name} {quantity}" for name, quantity in self.parameters.items())
        return visible(f"<FoundEffect {self.id}: {sizes}>")


@dataclass(frozen=True, slots=True)
class Fault(StoredPart):
    """A fault of the readings, found before any physics.

    Attributes
    ----------
    id, name : str
        Its id and name in the catalogue; ``"order"``, which has no entry, for strokes or tables in
        a wrong order or with a wrong sign.
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
    name: str
    finding: str
    parameters: Mapping[str, Quantity]
    p_value: float
    readings: tuple[int, ...]

    @property
    def is_entry(self) -> bool:
        """Whether the catalogue of effects has an entry for it."""
        return self.id != WRONG_ORDER


@dataclass(frozen=True, slots=True)
class Unexplained(StoredPart):
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


@dataclass(frozen=True, slots=True)
class Undetectable(StoredPart):
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


@dataclass(frozen=True, slots=True)
class Detectable(StoredPart):
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


@dataclass(frozen=True, slots=True)
class Change(StoredPart):
    """A coefficient of the model without and with what was found.

    Attributes
    ----------
    coefficient : str
        Its symbol.
    before, after : Quantity
        Its value over K1 of the fit without the effects. The uncertainty of the latter counts what
        it is beside other effects that explain the readings as well.
    """

    coefficient: str
    before: Quantity
    after: Quantity
