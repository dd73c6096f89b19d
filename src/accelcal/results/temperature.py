"""Temperature laws of a calibration, bilinear in T - T0, its levels, the hysteresis of the bias."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

from accelcal.results.covariance import NO_COVARIANCE, UNKNOWN, CorrelatedBySource, Rows
from accelcal.results.documents.fields import Document, StoredPart, members
from accelcal.results.quantity import Quantity

_LAWS = {"K0": "k0", "K1": "K1", "M": "delta"}


@dataclass(frozen=True, slots=True)
class TemperatureLaw(StoredPart):
    """A quantity at T0 and its slopes above and below, continuous at T0.

    Attributes
    ----------
    at_T0 : Quantity or None
        The quantity at T0; None where not determined.
    above, below : Quantity or None
        Slope for T > T0 and for T < T0 [per degC]; None where not determined.
    """

    at_T0: Quantity | None
    above: Quantity | None
    below: Quantity | None


@dataclass(frozen=True, slots=True)
class TemperatureModel(CorrelatedBySource, StoredPart):
    """Temperature laws of bias, scale factor and misalignment.

    Attributes
    ----------
    k0 : TemperatureLaw
        Bias k0 [g] and slopes lam1, lam2 [g/degC].
    K1 : TemperatureLaw
        Scale factor [output unit / g] and relative slopes beta1, beta2 [1/degC].
    delta : TemperatureLaw
        Misalignment [rad] and slopes gam1, gam2 [rad/degC].
    hysteresis : Quantity or None
        h_T: half the bias after heating less the bias after cooling, at the levels reached both
        ways [g]; None without any.
    warnings : tuple of str
        What is missing, and why.
    covariance_names, covariance_matrix
        Names such as ``"k0 above"`` of what is determined, and its covariance; an empty matrix
        where unknown. Laws from the tables have k2, k3 and delta_ip of the table nearest to T0
        among them.
    over_dof_matrix : tuple of tuple of float
        The same with each source of error over its degrees of freedom, see
        `accelcal.results.covariance`; empty where it was not kept.
    shares : mapping of str to tuple of tuple of float
        What sources that use may count by itself give to the covariance.
    """

    _MISSING: ClassVar[Mapping[str, Any]] = {"hysteresis": None, "warnings": ()}

    k0: TemperatureLaw
    K1: TemperatureLaw
    delta: TemperatureLaw
    hysteresis: Quantity | None = None
    warnings: tuple[str, ...] = ()
    covariance_names: tuple[str, ...] = ()
    covariance_matrix: Rows = ()
    over_dof_matrix: Rows = ()
    shares: Mapping[str, Rows] = field(default_factory=dict)

    @property
    def laws(self) -> dict[str, TemperatureLaw]:
        """The laws by their symbols."""
        return {"k0": self.k0, "K1": self.K1, "delta": self.delta}

    def __repr__(self) -> str:
        known = [name for name, law in self.laws.items() if law.at_T0 is not None]
        return f"<TemperatureModel of {', '.join(known) or 'nothing'}>"

    def __str__(self) -> str:
        return "\n".join(f"{name}: {quantity}" for name, quantity in self.quantities())

    def _repr_html_(self) -> str:
        from accelcal.report.notebook import in_notebook

        return in_notebook(self)

    def without_bound(self, names: Collection[str]) -> TemperatureModel:
        """Take the uncertainty from the laws of those of K0, K1 and M of which nothing bounds it.

        Slopes of the bias and relative ones of the scale factor keep theirs.
        """
        own = {law: getattr(self, law) for name, law in _LAWS.items() if name in names}
        if not own:
            return self
        laws = {name: replace(law, at_T0=_bare(law.at_T0)) for name, law in own.items()}
        if "delta" in laws:
            parts = (self.delta.at_T0, self.delta.above, self.delta.below)
            laws["delta"] = TemperatureLaw(*map(_bare, parts))
        return replace(self, **laws, **NO_COVARIANCE)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "k0 K1 delta hysteresis warnings"),
            "covariance": self._covariance_document(),
        }

    def quantities(self) -> Iterator[tuple[str, Quantity]]:
        """Name what is determined, as in ``"k0 above"``, and give its quantity."""
        for name, law in self.laws.items():
            for part in ("at_T0", "above", "below"):
                quantity = getattr(law, part)
                if quantity is not None:
                    yield f"{name} {part}", quantity
        if self.hysteresis is not None:
            yield "hysteresis", self.hysteresis

    def _dof_of(self, name: str) -> float:
        """Those of a quantity of the laws; what follows none has the fewest of them."""
        known = {own: quantity.dof or math.inf for own, quantity in self.quantities()}
        return known.get(name, min(known.values(), default=math.inf))

    @classmethod
    def _read(cls, document: Document) -> TemperatureModel:
        return cls._of_fields(document, **cls._covariance_fields(document, UNKNOWN))


def _bare(quantity: Quantity | None) -> Quantity | None:
    return quantity and Quantity(quantity.value, None, quantity.unit)


def nearest_level(levels: Sequence[float | None], temperature: float | None) -> int:
    """Find the place of the level nearest to a temperature; each may be unknown, None [degC].

    It is the first of the nearest, those within 1e-6 degC alike; a level that is unknown is farther
    than all others.

    Examples
    --------
    >>> nearest_level([None, 80.0, 22.0], 20.0), nearest_level([None, None], 20.0)
    (2, 0)
    """

    def away(place: int) -> float:
        level = levels[place]
        if level is None or temperature is None:
            return math.inf
        return round(abs(level - temperature), 6)

    return min(range(len(levels)), key=away)
