"""The sources of error of a calibration, as a result shows them."""

from __future__ import annotations

from collections.abc import Sequence

from accelcal.estimate.head import HeadError
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.numerics.sorting import median
from accelcal.results.mapping import finite_or_none
from accelcal.results.quantity import ErrorSource


def error_sources(
    tables: Sequence[PreparedTable], estimate: JointEstimate, unit: str | None
) -> tuple[ErrorSource, ...]:
    """List the sources of error with their sizes.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        What was found of their errors, of one record alone.
    unit : str or None
        Output unit.

    Returns
    -------
    tuple of ErrorSource
        Reading noise of each table, then head, launch, launch_sf, and a declared temperature.
    """
    readings = [
        ErrorSource(
            "reading",
            finite_or_none(noise.factor * median(table.scatter)),
            unit or "output unit",
            _told_by_itself(noise, estimate.head),
            str(noise.source),
        )
        for table, noise in zip(tables, estimate.noises, strict=True)
    ]
    others = [
        ErrorSource(
            name,
            float(part.uncertainty) if part.source != "none" else None,
            unit_,
            finite_or_none(part.dof),
            part.source,
        )
        for name, part, unit_ in (
            ("head", estimate.head, "rad"),
            ("launch", estimate.bias_shift, "g"),
            ("launch_sf", estimate.scale_factor_shift, "1"),
        )
    ]
    declared = tables[0].record.apparatus.temperature_uncertainty
    heat = [ErrorSource("temperature", declared, "degC", None, "declared")] if declared else []
    return (*readings, *others, *heat)


def _told_by_itself(noise: ReadingNoise, head: HeadError) -> float | None:
    """Degrees of freedom; None with none, and where residuals told noise and head at once.

    Then the noise holds a part of the head's errors, see `accelcal.estimate.unrepeated`.
    """
    together = noise.source == "residuals" and head.source == "estimated"
    return None if together else finite_or_none(noise.dof) or None
