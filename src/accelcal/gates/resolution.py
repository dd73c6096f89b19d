"""Gate on the digits of the readings: too coarse, finer than declared, or alike by no chance."""

from __future__ import annotations

import math

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.gates.copies import (
    NO_CHANCE,
    chance_of_agreement,
    copied_strokes,
    copy_said,
    may_be_copied,
)
from accelcal.gates.stack import TableStack
from accelcal.gates.verdict import GateStack, acceleration, gate_stack
from accelcal.numerics.decimal_steps import common_steps, decimal_step

_HARMLESS = 1e-6  # g, well below the noise of any reading
_HIDING = 0.5  # noise over step below which rounding is no longer random
_NO_SCATTER = 1e-6  # noise over step that only rounding errors of the arithmetic make
_ALIKE = 1.5  # visible over declared step above which the two contradict each other
_FINER = 20.0  # declared step over that of the digits above which the two may be unlike
_OFF = 0.1  # declared steps by which a reading is off the multiples of the step
_MANY = 0.1  # share of such readings that contradicts the declaration
_FEWEST = 4  # readings that are equal at the end of a range
_CUT = 5.0  # noise that is left of equal readings at both ends where these are cut off
_FINE = 0.2  # chance that two agree: coarser ones leave readings of less noise equal as well


def resolution(stack: TableStack) -> GateStack:
    """Look for a step that the noise is too small to average out, copies, and ends of a range.

    It warns where such a step is visible and not declared, where a stroke has the readings of
    another one to the last digit of a fine step, several readings the largest output or the least,
    or the readings have digits that the declared step would have rounded away.

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
    faults: dict[int, str] = {}
    if stack.there is None:
        faults = _faults(stack, step, noise)
        bad[[*faults]] = True
    else:
        bad |= _may_be_faulty(stack, noise)

    def said(index: int) -> str:
        if index in faults:
            return faults[index]
        if harmless[index]:
            return "no step of the readings that matters"
        own, scale, scatter = (float(a[index]) for a in (step, stack.scale, noise))
        size = _size_of_step(stack, index, own)
        if covered[index]:
            return f"the declared step covers that of {size}"
        if untold[index]:
            return f"steps of {size}, and the reading noise is unknown"
        seen = "0" if scatter < _NO_SCATTER * own else acceleration(scatter / scale)
        steps = f"steps of {size}, scatter of {seen}"
        remedy = f"rounding passes for head error; declare '# resolution: {own:.6g}'"
        return f"{steps}: {remedy}, or read more digits" if bad[index] else steps

    return gate_stack("resolution", bad, said, [(untold, "")])


def _faults(stack: TableStack, step: Array, noise: Array) -> dict[int, str]:
    """Tables with other faults than a coarse step, and what is said of each."""
    finer = {
        index: _finer_said(stack, index) for index in np.flatnonzero(_finer(stack, noise)).tolist()
    }
    copies = {
        index: copy_said(*(f"stroke {stroke}" for stroke in strokes))
        for index, strokes in copied_strokes(stack).items()
    }
    return {**finer, **_range_ends(stack, step), **copies}


def _may_be_faulty(stack: TableStack, noise: Array) -> Mask:
    """Tables with gaps that may have such faults, as no other one has, shape (T,)."""
    equal = (stack.output == end(axis=0) for end in (stack.output.max, stack.output.min))
    many = [own.sum(axis=0) >= _FEWEST for own in equal]
    return np.asarray(many[0] | many[1] | _counts_coarser(stack, noise) | may_be_copied(stack))


def _counts_coarser(stack: TableStack, noise: Array) -> Mask:
    """Tables whose declared step counts, and is much coarser than their digits."""
    coarser: Mask = (stack.digit > 0.0) & (stack.step > _FINER * stack.digit)
    return coarser & (noise < _HIDING * stack.step) & (stack.step > _HARMLESS * stack.scale)


def _finer(stack: TableStack, noise: Array) -> Mask:
    """Tables whose declared step counts, although it cannot be that of their readings.

    The multiples of the step may have an offset, such as a carrier that was subtracted. Readings
    that were corrected, as for a temperature that moved, have no digits to go by.
    """
    finer = _counts_coarser(stack, noise)
    phase = np.exp(2j * np.pi * stack.output[:, finer] / stack.step[finer])
    off = np.abs(np.angle(phase * phase.mean(axis=0).conj())) / (2.0 * np.pi)
    finer[finer] = (off > _OFF).mean(axis=0) > _MANY
    return finer


def _finer_said(stack: TableStack, index: int) -> str:
    size = _size_of_step(stack, index, float(stack.step[index]))
    counted, digit = f"U counts the rounding of the declared step of {size}", stack.digit[index]
    return f"{counted}, but the readings have steps of {digit:.6g}: check it and its unit"


def _size_of_step(stack: TableStack, index: int, step: float) -> str:
    return f"{step:.6g} {_unit(stack)} ({acceleration(step / float(stack.scale[index]))})"


def _unit(stack: TableStack) -> str:
    return stack.table.record.unit or "output units"


def _range_ends(stack: TableStack, step: Array) -> dict[int, str]:
    """Tables of which several readings have the largest output, or the least, and how many.

    The steps of their readings, shape (T,), are 0 where there is none.
    """
    unit, high, low = _unit(stack), stack.output.max(axis=0), stack.output.min(axis=0)
    found: dict[int, str] = {}
    for word, end, other in (("largest", high, low), ("least", low, high)):
        equal = stack.output == end
        number = equal.sum(axis=0)
        for table in np.flatnonzero(number >= _FEWEST).tolist():
            far = stack.output[:, table] == other[table]
            if _is_no_chance(stack, table, equal[:, table], far, float(step[table])):
                said = (
                    f"{number[table]} readings have the {word} output, {end[table]:.9g} {unit}, to"
                    " the last digit: the range seems to end there; use a wider one"
                )
                found.setdefault(table, said)
    return found


def _is_no_chance(stack: TableStack, table: int, equal: Mask, far: Mask, step: float) -> bool:
    """Tell whether equal readings of a table are so by more than chance.

    Of others m agree with one by the m-th power of the chance that two do, for each choice of m
    among those at the positions of the equal ones. The noise is that at the other end, as it may
    be smaller at the ends than between them; the step is no finer than the digits of readings of
    this size, as numbers of so many digits have coarser ones where they are larger. Where the other
    end has no noise, but the same size, and far more is left of the equal ones, both are cut off.
    The digits of the equal ones alone would not tell it: a range often ends at a round number.
    """
    head, output = stack.plan.head, stack.output[:, table]
    noise, there = float(stack.noise[table] * stack.scatter[table]), output[head == head[far][0]]
    smallest = float(np.spacing(np.abs(output).max()))
    left = abs(float(stack.residual[equal, table].mean()))
    is_cut = np.ptp(output[equal | far]) - 2.0 * np.abs(output).max() >= -step - smallest
    is_cut = is_cut and np.ptp(there) == 0.0 and left > step + _CUT * noise
    if there.size > 1 and not is_cut:
        noise = min(noise, float(np.std(there, ddof=1)))
    decade = 10.0 ** np.floor(np.log10(max(float(np.abs(output[equal][0])), smallest)))
    size = np.abs(output)
    below = output[(size < decade) & (size >= decade / 10.0)]  # ten times finer, not more
    coarsest = 10.0 * decimal_step(below) if below.size else np.inf
    written = max(step, min(decimal_step(output[size >= decade]), coarsest))
    share = chance_of_agreement(written, noise, smallest)
    others, near = int(equal.sum()) - 1, int(np.isin(head, head[equal]).sum())
    return share < _FINE and math.comb(near - 1, others) * share**others < NO_CHANCE
