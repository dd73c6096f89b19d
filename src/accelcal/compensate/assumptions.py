"""What a compensation has to assume, because a calibration does not tell it; a sentence each."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from accelcal.compensate.coefficients import CrossAxis
from accelcal.errors import AccelcalWarning
from accelcal.plural import listed
from accelcal.results.calibration import Calibration
from accelcal.results.table import TableCalibration
from accelcal.results.temperature import TemperatureModel

_SHIFTS = {"launch": "bias", "launch_sf": "scale factor"}
"""Error source -> what it shifts from launch to launch."""


def warn_of(sentences: Iterable[str]) -> None:
    """Warn of each, at the line that calls the function that calls this."""
    for sentence in sentences:
        warnings.warn(sentence, AccelcalWarning, stacklevel=3)


def one_sided(model: TemperatureModel) -> list[str]:
    """Say on which side of T0 no slopes were determined."""
    sides = [side for side in ("above", "below") if getattr(model.k0, side) is None]
    if len(sides) != 1:
        return ["no slopes were determined: the coefficients are those at T0"] if sides else []
    (missing,) = sides
    measured = "below" if missing == "above" else "above"
    return [f"no slopes {missing} T0 were determined: those {measured} are taken, +- all of them"]


def same_at_all_temperatures(axis: CrossAxis, table: TableCalibration) -> list[str]:
    """Say that a second axis without slopes is taken as it was in the table of one level."""
    if axis.delta.above.determined or axis.delta.below.determined:
        return []
    level = table.temperature_degC
    where = "one level" if level is None else f"{level:g} degC"
    return [
        f"{axis.delta_symbol}, by which {axis.name} acts, was measured at {where} only, and is"
        " taken to be the same at all temperatures"
    ]


def unknown_level(level: float | None) -> list[str]:
    """Say that temperatures cannot be checked, where the level of a table is None."""
    if level is not None:
        return []
    return ["the temperature of the calibration is unknown: that of the samples is not checked"]


def unknown_shifts(calibration: Calibration) -> list[str]:
    """Name what shifts from launch to launch by an amount that nothing tells."""
    known = {source.name for source in calibration.error_sources if source.value is not None}
    return [what for name, what in _SHIFTS.items() if name not in known]


def unknown_launch(calibration: Calibration) -> list[str]:
    """Say which shift to the next launch nothing tells."""
    missing = unknown_shifts(calibration)
    if not missing:
        return []
    return [
        f"the shifts of {listed(missing)} from launch to launch are neither declared nor"
        " measured: the uncertainty of a new launch does not count them; declare them with the"
        " readings, or repeat a level"
    ]


def without_covariance(table: TableCalibration) -> list[str]:
    """Say that there is no uncertainty, and why, where a table has no covariance."""
    if table.covariance_names:
        return []
    known = {name: q for name, q in table.coefficients.items() if q.value is not None}
    bare = [name for name, quantity in known.items() if quantity.standard_uncertainty is None]
    if len(bare) == len(known):
        why = "nothing tells the noise of the calibration (repeat strokes, or give std and n)"
    elif bare:
        verb = "has" if len(bare) == 1 else "have"
        why = f"{listed(bare)} {verb} no uncertainty, as nothing bounds the error"
    else:
        why = "the calibration has no covariance"
    return [f"{why}: accelerations come without uncertainty"]
