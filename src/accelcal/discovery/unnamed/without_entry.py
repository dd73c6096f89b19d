"""What no entry of the catalogue says, and is told as what it does."""

from __future__ import annotations

from accelcal.discovery.family import Family
from accelcal.discovery.unnamed.drift_anew import drift_anew
from accelcal.discovery.unnamed.wide_dead_zone import wide_dead_zone
from accelcal.results.findings import Unexplained


def without_entry(family: Family, alpha: float, p_value: float) -> Unexplained | None:
    """Find what explains all, of a disagreement that noise has with a chance of the p-value."""
    return drift_anew(family, alpha) or wide_dead_zone(family, alpha, p_value)
