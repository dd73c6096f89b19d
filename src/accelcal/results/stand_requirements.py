"""What a stand's instruments must be, and whether it suffices for a data sheet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from accelcal.results.documents.fields import StoredPart, members

__all__ = ["InstrumentRequirement", "Requirements", "Sufficiency", "TargetReached"]


@dataclass(frozen=True, slots=True)
class TargetReached(StoredPart):
    """A target and what the stand does about it; uncertainties are expanded, 95 %.

    Attributes
    ----------
    symbol, unit : str
        The coefficient.
    target : float
        Largest allowed expanded uncertainty.
    present : float
        That of the stand as it is.
    floor : float
        That with perfect instruments: what the fixed components leave.
    held_up_by : tuple of str
        The fixed components, the largest first, where the floor is above the target.
    """

    symbol: str
    unit: str
    target: float
    present: float
    floor: float
    held_up_by: tuple[str, ...]

    @property
    def reached(self) -> bool:
        """Whether the stand reaches it as it is."""
        return self.present <= self.target

    @property
    def reachable(self) -> bool:
        """Whether better instruments can reach it."""
        return self.floor < self.target

    def _contents(self) -> dict[str, Any]:
        return members(self, "symbol unit target present floor reached reachable held_up_by")


@dataclass(frozen=True, slots=True)
class InstrumentRequirement(StoredPart):
    """What one instrument must be, as a standard uncertainty.

    Attributes
    ----------
    name, unit : str
        The component.
    present : float
        Its standard uncertainty now.
    alone : float or None
        The largest with all others as they are; 0 where not even a perfect one would do, None
        where it is above a hundred times the present one, which is not extrapolated to.
    equal_shares : float or None
        In the allocation that gives each component that acts on a target the same share of its
        variance; None where it acts on no target and may stay as it is.
    proportional : float or None
        In the allocation that changes them all by one factor; None as above.
    limited_by : str
        The target that limits `alone`; empty where none does.
    """

    name: str
    unit: str
    present: float
    alone: float | None
    equal_shares: float | None
    proportional: float | None
    limited_by: str


@dataclass(frozen=True, slots=True)
class Requirements(StoredPart):
    """The inverse question: from targets to instruments.

    Attributes
    ----------
    targets : tuple of TargetReached
        The targets.
    instruments : tuple of InstrumentRequirement
        The components that are not fixed. The allocations keep all targets that are reachable.
    """

    targets: tuple[TargetReached, ...]
    instruments: tuple[InstrumentRequirement, ...]


@dataclass(frozen=True, slots=True)
class Sufficiency(StoredPart):
    """A limit of a data sheet against the expanded uncertainty of what it limits.

    Attributes
    ----------
    name, symbol, unit : str
        The limit, what it limits, and the unit of both numbers.
    limit : float
        Half the width of the tolerance.
    expanded_uncertainty : float or None
        Of the stand, 95 %; None where this test does not tell the quantity.
    note : str
        What to know about it.
    """

    name: str
    symbol: str
    unit: str
    limit: float
    expanded_uncertainty: float | None
    note: str = ""

    @property
    def ratio(self) -> float | None:
        """Tolerance over uncertainty; None where unknown or without uncertainty."""
        return self.limit / self.expanded_uncertainty if self.expanded_uncertainty else None

    @property
    def verdict(self) -> str:
        """``"suffices"`` from 4 to 1, ``"guard band"`` from 1 to 1, else ``"does not suffice"``."""
        if self.expanded_uncertainty is None:
            return "not told by this test"
        if self.expanded_uncertainty * _GOOD_RATIO <= self.limit:
            return "suffices"
        return "guard band" if self.expanded_uncertainty < self.limit else "does not suffice"

    def _contents(self) -> dict[str, Any]:
        return members(self, "name symbol unit limit expanded_uncertainty ratio verdict note")


_GOOD_RATIO = 4.0
"""Tolerance over uncertainty that is usually asked of a test (ANSI/NCSL Z540.3, 5.3 b)."""
