"""The result of following many units: which of them drift, jumped or are due."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from accelcal.escapes import visible
from accelcal.numerics.probability import LEVEL
from accelcal.plural import counted
from accelcal.results.documents.fields import StoredPart, members
from accelcal.results.documents.stored import StoredResult
from accelcal.results.quantity import Quantity
from accelcal.results.tabular import TabularResult, frame_of
from accelcal.results.unit_history import Jump

if TYPE_CHECKING:
    import pandas as pd

    from accelcal.plot.fleet_history import FleetHistoryPlot

__all__ = ["DOUBT", "FleetHistory", "UnitOfFleet", "UnitTrend"]


DOUBT = "?"
"""What stands behind a finding that noise alone makes in one unit or more of such a fleet."""

_CHANCES = ("jump_p_value", "jumps_by_chance", "drift_p_value", "drifts_by_chance")


@dataclass(frozen=True, slots=True)
class UnitTrend(StoredPart):
    """Drift and jumps of one quantity of a unit.

    Attributes
    ----------
    symbol : str
        ``"k0"``, or ``"K1"`` over its mean, less 1.
    drift, drift_of_a_walk : Quantity
        As of `accelcal.results.unit_history.Trend`.
    jumps : tuple of Jump
        In the order of their dates.
    """

    symbol: str
    drift: Quantity
    drift_of_a_walk: Quantity
    jumps: tuple[Jump, ...]


@dataclass(frozen=True, slots=True)
class UnitOfFleet(StoredPart):
    """One unit among many.

    Attributes
    ----------
    serial : str
        Serial number.
    calibrations : int
        Calibrations that are compared; of a unit that cannot be judged, all dates and all tests
        without a date.
    first, last : str or None
        Dates of its first and last calibration, compared or not, ISO 8601; None where none can be
        read.
    attention : tuple of str
        Why it needs attention: ``"jump"``, ``"drift"``, ``"remark"``, ``"due"``; the first two with
        `DOUBT` behind them where noise alone makes as much in one unit or more of the fleet.
    mounting : str or None
        Mounting that is followed; None where the unit cannot be judged.
    temperature_degC : float or None
        Level at which they are compared; None where it is unknown, or the unit cannot be judged.
    trends : tuple of UnitTrend
        Bias and scale factor; empty where the unit cannot be judged.
    jump_p_value, drift_p_value : float or None
        Chance that noise alone makes so large a jump or drift in this unit, of either quantity;
        None where none can be searched for.
    jumps_by_chance, drifts_by_chance : float or None
        Number of units in which noise alone makes as much, if none of the fleet jumps or drifts:
        the p-value times the number of units that were searched.
    remarks : tuple of str
        Calibrations that stand apart, wandering, jumps that may be bends or are not named, faults
        of readings.
    notes : tuple of str
        All else that its history tells, or why it cannot be judged.
    """

    serial: str
    calibrations: int
    first: str | None
    last: str | None
    attention: tuple[str, ...] = ()
    mounting: str | None = None
    temperature_degC: float | None = None
    trends: tuple[UnitTrend, ...] = ()
    jump_p_value: float | None = None
    drift_p_value: float | None = None
    jumps_by_chance: float | None = None
    drifts_by_chance: float | None = None
    remarks: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def row(self) -> dict[str, Any]:
        """List what is known of it, under names that all units have."""
        found = {trend.symbol: trend for trend in self.trends}
        return {
            "serial": self.serial,
            "attention": " | ".join(self.attention),
            **members(self, "calibrations first last mounting temperature_degC"),
            **{
                name: value
                for symbol in ("k0", "K1")
                for name, value in _cells(symbol, found.get(symbol))
            },
            **{name: getattr(self, name) for name in _CHANCES},
            "notes": " | ".join((*self.remarks, *self.notes)),
        }


def _cells(symbol: str, trend: UnitTrend | None) -> Iterator[tuple[str, Any]]:
    for name in ("drift", "drift_of_a_walk"):
        drift = getattr(trend, name) if trend else Quantity(None, None, "", None)
        yield f"{symbol}_{name}", drift.value
        yield f"{symbol}_{name}_expanded_uncertainty", drift.expanded_uncertainty
    jumps = trend.jumps if trend else ()
    yield f"{symbol}_jumps", len(jumps) if trend else None
    yield f"{symbol}_last_jump_before", jumps[-1].before if jumps else None
    yield f"{symbol}_last_jump", jumps[-1].size.value if jumps else None


@dataclass(frozen=True, slots=True)
class FleetHistory(StoredResult, TabularResult):
    """Many units through their recalibrations, those that need attention first.

    Attributes
    ----------
    units : tuple of UnitOfFleet
        The units: first those with a jump or drift that noise hardly makes in such a fleet, then
        those with other findings, those that are due, the oldest dates first, all others, and
        those that cannot be judged.
    alpha : float
        Chance below which a jump of a unit is believed.
    due_before : str or None
        Units whose last calibration is before this date are due, or of an unknown date.
    searched : int
        Units with enough calibrations to search for jumps.
    jumps_by_chance, drifts_by_chance : float
        In how many units noise alone has a jump named, and at most a drift beyond its U.
    notes : tuple of str
        What a reader must know of the fleet.
    software : str
        Name and version of what made it.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import accelcal
    >>> tests = [replace(accelcal.simulate(seed=n), date=f"202{n}-06-01") for n in (1, 2, 3)]
    >>> years = list(map(accelcal.fit, tests))
    >>> other = replace(years[0], serial="AL-16")
    >>> fleet = accelcal.fleet_history([*years, other], due_before="2022-01-01")
    >>> [(unit.serial, unit.attention) for unit in fleet.units]
    [('AL-16', ('due',)), ('AL-15', ())]
    """

    SCHEMA: ClassVar[str] = "accelcal/fleet-history/1"
    _WRITER: ClassVar[str] = "accelcal history"

    units: tuple[UnitOfFleet, ...]
    alpha: float
    due_before: str | None
    searched: int
    jumps_by_chance: float
    drifts_by_chance: float
    notes: tuple[str, ...] = ()
    software: str = ""

    def __repr__(self) -> str:
        count = sum(bool(unit.attention) for unit in self.units)
        told = counted(len(self.units), "unit")
        return visible(f"<FleetHistory: {told}, {count} with something to look at>")

    @property
    def plot(self) -> FleetHistoryPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.fleet_history import FleetHistoryPlot

        return FleetHistoryPlot(self)

    @property
    def judged(self) -> int:
        """Number of units with enough calibrations for a drift."""
        return sum(bool(unit.trends) for unit in self.units)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "software alpha due_before searched"),
            "interval_level": LEVEL,
            **members(self, "jumps_by_chance drifts_by_chance units notes"),
        }

    def rows(self) -> list[dict[str, Any]]:
        """List the units, a flat dictionary each."""
        return [unit.row() for unit in self.units]

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the units, a line each; ``frame.attrs["units"]`` maps columns to units."""
        units = {
            f"{symbol}_{name}{size}": f"{unit}{per}"
            for symbol, unit in (("k0", "g"), ("K1", "1"))
            for name, per in (("drift", "/year"), ("drift_of_a_walk", "/year"), ("last_jump", ""))
            for size in ("", "_expanded_uncertainty")
            if name != "last_jump" or not size
        }
        units |= dict.fromkeys(_CHANCES, "1")
        return frame_of(self.rows(), **units)
