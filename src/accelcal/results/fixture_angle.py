"""The fixture angle, freed from the misalignment by a reversed mounting.

The axis along the shaft says which terms are told: where OA lies there (``o``), PA is in the plane
of rotation, and the terms are M_O a_p and M_ip a_i a_p; where PA lies there (``p``), they are
M_P a_o and M_io a_i a_o. The paper writes both misalignments with +, IEEE Std 1293 writes
+ delta_o a_p - delta_p a_o: `FixtureAngle.ieee_1293` converts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from accelcal.results.covariance import UNKNOWN, CorrelatedByName, Rows
from accelcal.results.documents.checked import DamageError, checked, list_of, number_or_none
from accelcal.results.documents.fields import Document, StoredPart
from accelcal.results.quantity import Quantity
from accelcal.results.temperature import nearest_level

__all__ = ["FixtureAngle"]

_IEEE_1293 = {"o": ("delta_o", 1.0, "K_ip"), "p": ("delta_p", -1.0, "K_io")}
"""Axis along the shaft -> name and sign of its misalignment, and name of its cross-coupling."""


@dataclass(frozen=True, slots=True)
class FixtureAngle(CorrelatedByName, StoredPart):
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
    couplings : tuple of Quantity
        Cross-coupling M_ip/K1, or M_io/K1 for the axis ``"p"``, at each of these levels, as the
        mean of both sides; empty where the positions do not tell it [g/g^2].
    covariance_names, covariance_matrix
        ``delta0``, ``delta_1`` ... (level by level), ``delta_ip_1`` ... and their covariance, which
        is the array `covariance` as well; empty where it is unknown.
    clamping_deg : float
        Clamping of the fixture on the head; each has an angle of its own [deg].
    """

    _MISSING: ClassVar[Mapping[str, Any]] = {"clamping_deg": 0.0}

    axis: str
    angle: Quantity
    temperatures: tuple[float | None, ...]
    misalignments: tuple[Quantity, ...]
    couplings: tuple[Quantity, ...] = ()
    covariance_names: tuple[str, ...] = ()
    covariance_matrix: Rows = ()
    clamping_deg: float = 0.0

    def ieee_1293(self, temperature: float | None = None) -> dict[str, Quantity]:
        """Return the terms by the names and signs of IEEE Std 1293.

        Parameters
        ----------
        temperature : float, optional
            The level nearest to it is taken; by default the first [degC].

        Returns
        -------
        dict of str to Quantity
            ``delta_o`` and ``K_ip``, or ``delta_p`` and ``K_io``, of the model equation
            A + ... + delta_o a_p - delta_p a_o + K_ip a_i a_p + K_io a_i a_o.

        Examples
        --------
        >>> angle, delta = Quantity(0.0, 1e-6, "rad"), Quantity(1e-3, 1e-6, "rad")
        >>> found = FixtureAngle("p", angle, (20.0,), (delta,))
        >>> found.ieee_1293()["delta_p"].value
        -0.001
        """
        name, sign, coupling = _IEEE_1293[self.axis]
        level = nearest_level(self.temperatures, temperature)
        own = self.misalignments[level]
        found = {name: replace(own, value=None if own.value is None else sign * own.value)}
        return found | ({coupling: self.couplings[level]} if self.couplings else {})

    def nearest(self, temperature: float | None) -> Quantity:
        """Misalignment at the level nearest to a temperature [degC]."""
        return self.misalignments[nearest_level(self.temperatures, temperature)]

    def _contents(self) -> dict[str, Any]:
        levels = zip(self.temperatures, self.misalignments, strict=True)
        return {
            "axis": self.axis,
            **self.angle.to_document(),
            "misalignment": [{"temperature_degC": t, **q.to_document()} for t, q in levels],
            "cross_coupling": [quantity.to_document() for quantity in self.couplings],
            "covariance": self._covariance_document(),
            "clamping_deg": self.clamping_deg,
        }

    @classmethod
    def _read(cls, document: Document) -> FixtureAngle:
        levels = checked(document, "misalignment", list_of(_level, 1))
        temperatures, misalignments = zip(*levels, strict=True)
        none: tuple[Quantity, ...] = ()
        couplings = checked(document, "cross_coupling", list_of(Quantity.from_document), none)
        if couplings and len(couplings) != len(levels):
            raise DamageError("not as many levels as of misalignment", "cross_coupling")
        return cls._of_fields(
            document,
            **cls._covariance_fields(document, UNKNOWN),
            angle=Quantity.from_document(document),
            temperatures=temperatures,
            misalignments=misalignments,
            couplings=couplings,
        )


def _level(document: Document) -> tuple[float | None, Quantity]:
    temperature = checked(document, "temperature_degC", number_or_none)
    return temperature, Quantity.from_document(document)
