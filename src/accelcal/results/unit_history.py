"""The result of following a unit: drift, scatter and jumps of its bias and scale factor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from accelcal.escapes import visible
from accelcal.numerics.probability import LEVEL
from accelcal.plural import counted
from accelcal.results.documents.checked import (
    Kind,
    checked,
    list_of,
    member,
    number,
    number_or_none,
    one_of,
    text,
)
from accelcal.results.documents.fields import Document, StoredPart, members
from accelcal.results.documents.stored import StoredResult
from accelcal.results.quantity import Quantity
from accelcal.results.tabular import TabularResult

if TYPE_CHECKING:
    from accelcal.plot.history import HistoryPlot

__all__ = ["History", "Jump", "Point", "Trend"]


def _measured(document: Document) -> Quantity:
    checked(document, "unit", one_of("g", "1"))
    return Quantity.from_document(document)


@dataclass(frozen=True, slots=True)
class Point(StoredPart):
    """One calibration in a history.

    Attributes
    ----------
    date : str
        Date, ISO 8601.
    source : str
        Where it came from.
    measured : Quantity
        What was found.
    line : float
        Line with its jumps at that date [unit of `measured`].
    """

    _BESIDE: ClassVar[str] = "measured"
    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"measured": _measured}

    date: str
    source: str
    measured: Quantity
    line: float


@dataclass(frozen=True, slots=True)
class Jump(StoredPart):
    """A jump between two calibrations.

    Attributes
    ----------
    after, before : str
        Dates of the last calibration before it and of the first one behind it.
    size : Quantity
        Step of the line.
    p_value : float
        Chance that a line without it looks so by noise, over all places and quantities searched.
    """

    _BESIDE: ClassVar[str] = "size"

    after: str
    before: str
    size: Quantity
    p_value: float


@dataclass(frozen=True, slots=True)
class Trend(StoredPart):
    """One quantity through the recalibrations.

    Attributes
    ----------
    name, symbol : str
        ``"bias"``, k0, or ``"scale factor"``, K1 over its mean, less 1.
    drift : Quantity
        Slope of the line per year, of 365.25 days, if what scatters is new at each calibration.
    drift_of_a_walk : Quantity or None
        The same if a quarter or more of what scatters, jumps included, stays and adds up as a
        random walk: the interval to use unless the unit is known not to wander; None in documents
        that do not have it.
    scatter : float
        Standard deviation from calibration to calibration beyond the stated uncertainties, as from
        launch to launch [unit of the points].
    scatter_limits : tuple of float
        Ends of its 95 % interval [unit of the points].
    jumps : tuple of Jump
        In the order of their dates.
    no_other_jump : float or None
        Chance that noise alone has a jump as large as the largest that is not believed; None where
        too few calibrations are there to look for one.
    points : tuple of Point
        The calibrations, by date.
    reference : float
        What the points are told from [unit of `reference_unit`]; 0 for the bias.
    reference_unit : str
        Its unit.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"points": list_of(Point.from_document, 1)}
    _MISSING: ClassVar[Mapping[str, Any]] = {"drift_of_a_walk": None}

    name: str
    symbol: str
    drift: Quantity
    drift_of_a_walk: Quantity | None
    scatter: float
    scatter_limits: tuple[float, float]
    jumps: tuple[Jump, ...]
    no_other_jump: float | None
    points: tuple[Point, ...]
    reference: float
    reference_unit: str

    def __repr__(self) -> str:
        drift = self.drift_of_a_walk or self.drift
        return f"<Trend of the {self.name}: {drift}, {counted(len(self.jumps), 'jump')}>"

    def _contents(self) -> dict[str, Any]:
        low, high = self.scatter_limits
        unit = self.points[0].measured.unit
        return {
            **members(self, "name symbol"),
            "reference": {"value": self.reference, "unit": self.reference_unit},
            **members(self, "drift drift_of_a_walk"),
            "scatter": {"value": self.scatter, "low": low, "high": high, "unit": unit},
            **members(self, "jumps"),
            "no_other_jump_p_value": self.no_other_jump,
            **members(self, "points"),
        }

    @classmethod
    def from_document(cls, document: Document) -> Trend:
        """Read the trend from its place in a JSON document."""
        low, high = (checked(document, "scatter", member(end, number)) for end in ("low", "high"))
        return cls._of_fields(
            document,
            scatter=checked(document, "scatter", member("value", number)),
            scatter_limits=(low, high),
            no_other_jump=checked(document, "no_other_jump_p_value", number_or_none),
            reference=checked(document, "reference", member("value", number)),
            reference_unit=checked(document, "reference", member("unit", text)),
        )


@dataclass(frozen=True, slots=True)
class History(StoredResult, TabularResult):
    """A unit through its recalibrations.

    Attributes
    ----------
    serial : str or None
        Serial number.
    mounting : str
        Mounting of the tables that are compared.
    temperature_degC : float or None
        Level at which they are compared; None where temperatures are unknown.
    trends : tuple of Trend
        Bias and scale factor.
    alpha : float
        Chance below which a jump is believed.
    notes : tuple of str
        What was left out, and what a reader must know.
    software : str
        Name and version of what made it.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> years = [replace(calibration, date=f"{year}-06-01") for year in (2021, 2022, 2023)]
    >>> [trend.name for trend in accelcal.history(years).trends]
    ['bias', 'scale factor']
    """

    SCHEMA: ClassVar[str] = "accelcal/history/1"
    _WRITER: ClassVar[str] = "accelcal history"
    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"trends": list_of(Trend.from_document, 1)}

    serial: str | None
    mounting: str
    temperature_degC: float | None
    trends: tuple[Trend, ...]
    alpha: float
    notes: tuple[str, ...] = ()
    software: str = ""

    def __repr__(self) -> str:
        jumps = counted(sum(len(trend.jumps) for trend in self.trends), "jump")
        count = counted(len(self.trends[0].points), "calibration")
        return visible(f"<History serial {self.serial}: {count}, {jumps}>")

    @property
    def plot(self) -> HistoryPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.history import HistoryPlot

        return HistoryPlot(self)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "software serial mounting temperature_degC"),
            "interval_level": LEVEL,
            **members(self, "alpha trends notes"),
        }

    def rows(self) -> list[dict[str, Any]]:
        """List the calibrations of all trends, a flat dictionary each."""
        return [
            {"serial": self.serial, "quantity": trend.name.replace(" ", "_"), **point.to_document()}
            for trend in self.trends
            for point in trend.points
        ]
