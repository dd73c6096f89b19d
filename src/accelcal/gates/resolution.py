"""Gate on the digits of the readings: too coarse for the noise, or alike where they cannot be."""

from __future__ import annotations

import numpy as np

from accelcal.gates.copies import copied_strokes, copy_said
from accelcal.gates.range_ends import range_ends
from accelcal.gates.stack import TableStack
from accelcal.gates.verdict import GateStack, acceleration, gate_stack
from accelcal.numerics.decimal_steps import common_steps

_HARMLESS = 1e-6  # g, well below the noise of any reading
_HIDING = 0.5  # noise over step below which rounding is no longer random
_NO_SCATTER = 1e-6  # noise over step that only rounding errors of the arithmetic make
_ALIKE = 1.5  # visible over declared step above which the two contradict each other


def resolution(stack: TableStack) -> GateStack:
    """Look for a step that the noise is too small to average out, copies, and ends of a range.

    Parameters
    ----------
    stack : TableStack
        The tables.

    Returns
    -------
    GateStack
        A warning where such a step is visible and not declared, where a stroke has the readings of
        another one to the last digit of a fine step, or several readings the largest output or the
        least.

    Notes
    -----
    Below half a step of noise all strokes round a position in the same way. The error then shows
    in the means of the positions, as an error of the head does.
    """
    step, noise = common_steps(stack.output, stack.digit), stack.noise * stack.scatter
    harmless = step < _HARMLESS * stack.scale
    covered = step < _ALIKE * stack.step
    untold = ~(harmless | covered | np.isfinite(stack.noise))
    bad = ~(harmless | covered | untold | (noise >= _HIDING * step))
    copies, ends = copied_strokes(stack), range_ends(stack, step)
    bad[[*copies, *ends]] = True

    def said(index: int) -> str:
        if index in copies:
            return copy_said(*(f"stroke {stroke}" for stroke in copies[index]))
        if index in ends:
            return ends[index].said(stack.table.record.unit or "output units")
        if harmless[index]:
            return "no step of the readings that matters"
        own, scale, scatter = (float(a[index]) for a in (step, stack.scale, noise))
        unit = stack.table.record.unit or "output units"
        size = f"{own:.6g} {unit} ({acceleration(own / scale)})"
        if covered[index]:
            return f"the declared step covers that of {size}"
        if untold[index]:
            return f"steps of {size}, and the reading noise is unknown"
        seen = "0" if scatter < _NO_SCATTER * own else acceleration(scatter / scale)
        steps = f"steps of {size}, scatter of {seen}"
        remedy = f"rounding passes for head error; declare '# resolution: {own:.6g}'"
        return f"{steps}: {remedy}, or read more digits" if bad[index] else steps

    return gate_stack("resolution", bad, said, [(untold, "")])
