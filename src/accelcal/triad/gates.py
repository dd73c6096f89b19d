"""Checks that warn before anyone believes the calibration of a triad."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from accelcal.arguments.axes import AXES
from accelcal.errors import DesignError
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.numerics.left_out import ratios_by_the_others
from accelcal.numerics.probability import f_survival, student_quantile, written_p_value
from accelcal.plural import degrees_of_freedom
from accelcal.results.quantity import Gate
from accelcal.triad.record import TriadRecord
from accelcal.triad.solution import Solution
from accelcal.triad.unknown import from_unknown_attitudes

_WORST_CONDITION = 10.0
"""Attitudes spread evenly over the sphere have 3 to 4, and 1.7 where they are known."""

_FEW_DOF = 3
_GO_AGAIN = (
    "; what is left may be errors of attitudes, which scale factors from faces do not feel: go"
    " through the attitudes again, and the scatter of the visits tells the noise"
)
_UNTOLD = (
    "no shafts are named: U counts errors of single attitudes, not how the block sits in a clamping"
    " that several share; name that of each attitude (shaft)"
)
_MIRRORED = (
    "the outputs fit the angles only if these are counted the other way round: change their sign,"
    " or name the shafts -x, -y, -z for x, y, z; on shaft x the axis z points up at 90 deg"
)
_MUCH_LESS = 0.1
"""Part of the residuals that attitudes leave which are the right ones, beyond any doubt."""

_FALSE_ALARM = 0.01
_SURE = 1e-4
"""Chance below which turns of the block are no errors of a head, which all shafts may share."""


def gates_of(record: TriadRecord, found: Solution, frame: str) -> tuple[Gate, ...]:
    """Judge a calibration by its own data.

    By the number of attitudes, their spread, the largest residual, the sensitive axes: where they
    point, or whether their misalignments show; and the temperatures, where they are known.
    """
    gates = [_number(record, found), _spread(found), _outlier(record, found)]
    axes = _misalignment(record, found, frame) if record.up is None else [_axes(record, found)]
    return (*gates, *axes, *_clampings(record, found), *_temperature(record))


def _clampings(record: TriadRecord, found: Solution) -> Iterator[Gate]:
    """Tell whether the block sits alike on all shafts."""
    name, shafts, seats = "clampings", len(set(record.shaft or ())), found.seats
    if record.up is None or shafts in (1, len(record.output)) or seats is None:
        return
    if not shafts:
        yield Gate(name, "not assessed", _UNTOLD)
        return
    if seats.chance is None:
        told = f"on {shafts} shafts: too few attitudes tell whether the block sits alike on all"
        advice = "U does not count how it sits; add attitudes on each"
        yield Gate(name, "not assessed", f"{told}; {advice}")
        return
    told = f"on {shafts} shafts the block sits {1e3 * seats.size:.2g} mrad rms otherwise about each"
    told += f" axis, which U counts ({written_p_value(seats.chance)})"
    if seats.chance >= _SURE:
        yield Gate(name, "pass", f"{told}: no more than what is left")
    else:
        yield Gate(
            name, "warn", f"{told}: clamp it against stops; a head with large errors may look so"
        )


def _temperature(record: TriadRecord) -> Iterator[Gate]:
    """Tell whether the attitudes were taken at one temperature."""
    given = record.temperature
    known = given[~np.isnan(given)] if given is not None else np.zeros(0)
    if not known.size:
        return
    low, high = float(known.min()), float(known.max())
    told = f"{low:g} degC" if low == high else f"{low:g} to {high:g} degC"
    if high - low <= SAME_LEVEL:
        yield Gate("temperature", "pass", told)
        return
    advice = "what moves with temperature is in the residuals, and in the parameters"
    yield Gate("temperature", "warn", f"{told}: {advice}")


def _number(record: TriadRecord, found: Solution) -> Gate:
    told = f"{len(record.output)} attitudes leave {degrees_of_freedom(found.dof)}"
    if not found.dof:
        return Gate("attitudes", "warn", f"{told}: the noise is unknown; add attitudes")
    few = found.dof < _FEW_DOF
    told += ": the intervals are wide; add attitudes" if few else ""
    told += _GO_AGAIN if found.noise_untold else ""
    return Gate("attitudes", "warn" if few else "pass", told)


def _spread(found: Solution) -> Gate:
    told = f"condition number {found.design.condition:.1f}"
    if found.design.condition <= _WORST_CONDITION:
        return Gate("spread of attitudes", "pass", told)
    worst = f"worst told: {', '.join(found.design.weakness)}"
    even = "3 to 4" if found.scatter else "1.7"
    advice = f"{told}, {worst}; attitudes spread over all directions have {even}"
    return Gate("spread of attitudes", "warn", advice)


def _outlier(record: TriadRecord, found: Solution) -> Gate:
    """Largest residual with the attitude left out, by Student's t over all of them.

    An error of a known attitude moves two channels at most, and which ones it does hangs on the
    attitude: the root sum of squares over the channels is alike in all of them.
    """
    residual = np.linalg.norm(found.residual.reshape(len(record.output), -1), axis=1)
    if found.dof < 2:
        return Gate("largest residual", "not assessed", "too few degrees of freedom")
    freedom = np.maximum(1.0 - found.leverage, 1e-9)
    t = ratios_by_the_others(residual, freedom, found.dof, 1e-300)
    limit = student_quantile(1.0 - _FALSE_ALARM / t.size, found.dof - 1)
    row = int(np.argmax(t))
    place = "" if record.line is None else f" (line {record.line[row]})"
    size = 1e3 * residual[row]
    told = (
        f"attitude {row + 1}{place} fits worst: {size:.3g} mg, t = {t[row]:.1f}, limit {limit:.1f}"
    )
    return Gate("largest residual", "warn" if t[row] > limit else "pass", told)


def _axes(record: TriadRecord, found: Solution) -> Gate:
    """Tell channels that are turned round, or in the column of another; angles the wrong way."""
    if _is_mirrored(record, found):
        return Gate("sensitive axes", "warn", _MIRRORED)
    odd = []
    for i, row in enumerate(found.sensitivity):
        j = int(np.argmax(np.abs(row)))
        if row[i] < np.abs(row[j]):
            sign = "-" if row[j] < 0.0 else ""
            odd.append(f"channel {AXES[i]} answers along {sign}{AXES[j]} of the block")
    if not odd:
        return Gate("sensitive axes", "pass", "each channel answers along its own axis")
    return Gate("sensitive axes", "warn", f"{', '.join(odd)}; check signs, columns and attitudes")


def _is_mirrored(record: TriadRecord, found: Solution) -> bool:
    """Tell whether the outputs fit the angles of all shafts counted the other way round."""
    shafts = [name.strip().casefold().lstrip("+-") for name in record.shaft or ()]
    if record.up is None or not shafts or not {*shafts} <= {*AXES}:
        return False
    matrix = np.column_stack([np.ones(len(shafts)), record.up])
    after_next = [1 + (AXES.index(shaft) + 2) % 3 for shaft in shafts]
    matrix[range(len(shafts)), after_next] *= -1.0
    left = record.output - matrix @ np.linalg.lstsq(matrix, record.output)[0]
    own = found.residual * np.linalg.norm(found.sensitivity, axis=1)
    return bool(np.linalg.norm(left) < _MUCH_LESS * np.linalg.norm(own))


def _misalignment(record: TriadRecord, found: Solution, frame: str) -> Iterator[Gate]:
    """Compare with sensitive axes that are perpendicular."""
    if not found.dof:
        return
    try:
        without = from_unknown_attitudes(record.output, frame, aligned=True)
    except DesignError:
        return
    left = float(found.residual @ found.residual) / found.dof
    gain = float(without.residual @ without.residual - found.residual @ found.residual) / 3.0
    chance = f_survival(gain / left, 3.0, float(found.dof)) if gain > 0.0 < left else 1.0
    p = written_p_value(chance)
    told = (
        f"residual {1e3 * found.rms:.3g} mg rms, {1e3 * without.rms:.3g} mg with perpendicular"
        f" axes: they {'show' if chance < _FALSE_ALARM else 'do not show'} ({p})"
    )
    yield Gate("misalignments", "pass", told)
