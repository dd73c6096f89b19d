"""Gate on the digits of the readings: too coarse, finer than declared, or copies of others."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.gates.plan import TablePlan, once_a_plan
from accelcal.gates.stack import TableStack
from accelcal.gates.verdict import GateStack, acceleration, gate_stack
from accelcal.numerics.decimal_steps import common_steps, decimal_step
from accelcal.numerics.grouping import grouped

NO_CHANCE = 1e-6
"""Chance of readings that agree to the last digit, below which it is none."""

_IRRATIONAL = 2.0**0.5  # so many times a decimal number is none that another one makes up for


def are_copies(output: Array, noise: float) -> bool:
    """Tell whether others that agree with some readings in all digits are a copy of them.

    That is where the chance of it is below 1e-6, by the noise of a reading; not where that is NaN,
    as nothing tells it [output unit].

    Notes
    -----
    The difference of two readings has the density 1 / (2 sqrt(pi) noise) at zero, which is taken
    over a step of the readings.

    Examples
    --------
    >>> import numpy as np
    >>> are_copies(np.array([1.3501, 0.9546, 0.0046]), noise=2e-4)
    False
    >>> are_copies(np.array([1.350123, 0.954610, 0.004623]), noise=2e-4)
    True
    """
    smallest = np.spacing(np.abs(output).max())
    digit = np.array([decimal_step(output)])
    step = float(common_steps(output[:, None], digit)[0])
    return chance_of_agreement(step, noise, smallest) ** output.size < NO_CHANCE


def chance_of_agreement(step: float, noise: float, smallest: float) -> float:
    """Chance that two readings of the same agree to the last digit.

    It is the density of their difference at zero, 1 / (2 sqrt(pi) noise), over a step of the
    readings. The noise is NaN where nothing tells it; the smallest is the distance of neighbouring
    floating point numbers of their size [output unit].

    Examples
    --------
    >>> round(chance_of_agreement(1e-6, 1e-5, 1e-16), 4)
    0.0282
    """
    density = 1.0 / (2.0 * np.sqrt(np.pi) * np.fmax(noise, smallest))
    return float(min(max(step, 4.0 * smallest) * density, 1.0))


def copied_strokes(stack: TableStack) -> dict[int, tuple[int, int]]:
    """Find the tables with strokes that are the copy of another one at the same angles.

    Each is told with the first two of them.
    """
    noise, found = stack.noise * stack.scatter, {}
    for strokes in _strokes_alike(stack.plan):
        for table in _look_alike(stack.output[strokes[:, :2]]):
            output = stack.output[strokes, table]
            pair = _equal(output)
            if pair and are_copies(output[pair[0]], float(noise[table])):
                found[table] = tuple(stack.plan.stroke[strokes[list(pair), 0]].tolist())
    return found


def may_be_copied(stack: TableStack) -> Mask:
    """Tables with gaps in which two strokes are equal wherever both have a reading, shape (T,)."""
    found, plan = np.zeros(len(stack), dtype=np.bool_), stack.plan
    angles = grouped(plan.angle)
    whole = np.full((plan.strokes.key.size, angles.key.size, len(stack)), np.nan)
    there = stack.known(np.ones(stack.output.shape)) > 0.0
    whole[plan.strokes.cell, angles.cell] = np.where(there, stack.output, np.nan)
    for one, other in combinations(whole, 2):
        differs = ((one < other) | (one > other)).any(axis=0)
        found |= (one == other).any(axis=0) & ~differs
    return found


def _look_alike(beginnings: Array) -> list[int]:
    """Tables in which two strokes begin alike, from their first readings, (strokes, 2, T)."""
    mixed = np.sort(beginnings[:, 0] + _IRRATIONAL * beginnings[:, -1], axis=0)
    alike: list[int] = np.flatnonzero((mixed[1:] == mixed[:-1]).any(axis=0)).tolist()
    return alike


def copy_said(first: str, second: str) -> str:
    """Say what is a copy of what, and the remedy."""
    return f"{second} has the readings of {first} to the last digit: give it its own"


def _equal(output: Array) -> tuple[int, int] | None:
    """The first two rows that are equal; None where all differ."""
    known: dict[bytes, int] = {}
    for row, own in enumerate(output):
        before = known.setdefault(own.tobytes(), row)
        if before != row:
            return before, row
    return None


@once_a_plan
def _strokes_alike(plan: TablePlan) -> list[Places]:
    """Readings of the strokes at the same angles, by angle, shape (strokes, angles)."""
    by_angle: dict[bytes, list[Places]] = {}
    for own in plan.strokes.parts:
        ordered = own[np.argsort(plan.angle[own], kind="stable")]
        by_angle.setdefault(plan.angle[ordered].tobytes(), []).append(ordered)
    return [np.stack(strokes) for strokes in by_angle.values() if len(strokes) > 1]


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
