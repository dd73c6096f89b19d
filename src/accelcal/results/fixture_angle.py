"""The fixture angle, freed from the misalignment by a reversed mounting."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from accelcal.results.checked import checked, list_of, number_or_none, text
from accelcal.results.quantity import Document, Quantity

__all__ = ["FixtureAngle"]


@dataclass(frozen=True, slots=True)
class FixtureAngle:
    """Fixture angle and misalignment of one axis, told apart by both of its sides.

    Attributes
    ----------
    axis : str
        Axis along the shaft, ``"o"`` or ``"p"``.
    angle : Quantity
        Angle between the zero of the head and the input axis, delta0 [rad].
    temperatures : tuple of float or None
        Levels at which both sides were measured [degC].
    misalignments : tuple of Quantity
        Misalignment M/K1 at each of these levels, free of the fixture angle [rad].
    """

    axis: str
    angle: Quantity
    temperatures: tuple[float | None, ...]
    misalignments: tuple[Quantity, ...]

    def nearest(self, temperature: float | None) -> Quantity:
        """Misalignment at the level nearest to a temperature [degC]."""

        def distance(level: float | None) -> float:
            return 0.0 if None in (level, temperature) else abs(level - temperature)  # type: ignore[operator]

        places = range(len(self.temperatures))
        return self.misalignments[min(places, key=lambda i: distance(self.temperatures[i]))]

    def to_document(self) -> dict[str, Any]:
        """Return the angle as it stands in the JSON document."""
        levels = zip(self.temperatures, self.misalignments, strict=True)
        return {
            "axis": self.axis,
            **self.angle.to_document(),
            "misalignment": [{"temperature_degC": t, **q.to_document()} for t, q in levels],
        }

    @classmethod
    def from_document(cls, document: Document) -> FixtureAngle:
        """Read the angle from its place in a JSON document."""
        levels = checked(document, "misalignment", list_of(_level))
        if not levels:
            raise TypeError("misalignment is empty, in place of a level or more")
        temperatures, misalignments = zip(*levels, strict=True)
        axis = checked(document, "axis", text)
        return cls(axis, Quantity.from_document(document), temperatures, misalignments)


def _level(document: Document) -> tuple[float | None, Quantity]:
    temperature = checked(document, "temperature_degC", number_or_none)
    return temperature, Quantity.from_document(document)
