"""Gate on the step of the readings, which passes for head error where the noise is below it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.verdict import acceleration, not_assessed, warn_if
from accelcal.grouping import decimal_step, median
from accelcal.results.quantity import Gate

__all__ = ["resolution"]

Array = NDArray[np.float64]

_HARMLESS = 1e-6  # g, well below the noise of any reading
_HIDING = 0.5  # noise over step below which rounding is no longer random
_NO_SCATTER = 1e-6  # noise over step that only rounding errors of the arithmetic make
_ALIKE = 1.5  # visible over declared step above which the two contradict each other


def resolution(table: PreparedTable, noise: ReadingNoise, scale: float) -> Gate:
    """Look for a step of the readings that the noise is too small to average out.

    Parameters
    ----------
    table : PreparedTable
        The table.
    noise : ReadingNoise
        Its reading noise.
    scale : float
        Scale factor [output unit / g].

    Returns
    -------
    Gate
        A warning where such a step is visible and not declared.

    Notes
    -----
    Below half a step of noise all strokes round a position in the same way. The error then shows
    in the means of the positions, as an error of the head does.
    """
    step = _visible_step(table.record.output)
    declared = table.record.apparatus.resolution
    if step < _HARMLESS * scale:
        return warn_if("resolution", False, "no step of the readings that matters")
    size = f"{step:.6g} {table.record.unit or 'output units'} ({acceleration(step / scale)})"
    if declared is not None and step < _ALIKE * declared:
        return warn_if("resolution", False, f"the declared step covers that of {size}")
    if not np.isfinite(noise.factor):
        return not_assessed("resolution", f"steps of {size}, and nothing tells the reading noise")
    scatter = noise.factor * median(table.scatter)
    alike = scatter < _NO_SCATTER * step
    steps = f"steps of {size}, scatter of {'0' if alike else acceleration(scatter / scale)}"
    if scatter >= _HIDING * step:
        return warn_if("resolution", False, steps)
    remedy = f"rounding passes for head error; declare '# resolution: {step:.6g}'"
    return warn_if("resolution", True, f"{steps}: {remedy}, or read more digits")


def _visible_step(output: Array) -> float:
    """The largest step of which all readings are multiples but for a constant; 0 for none."""
    digit = decimal_step(output)
    if digit == 0.0:
        return 0.0
    counts = np.round(output / digit).astype(np.int64)
    return digit * float(np.gcd.reduce(counts - counts[0]))
