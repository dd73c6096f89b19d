"""Calibration of a triad from its attitudes, known or not, and the checks that warn of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.axes import AXES, by_axis
from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import refuse_other_order
from accelcal.arguments.options import check_choice
from accelcal.arrays import Array
from accelcal.errors import DesignError, InputError
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.numerics.covariance import ratios_by_the_others
from accelcal.numerics.probability import LEVEL, f_survival, student_quantile, written_p_value
from accelcal.plural import degrees_of_freedom
from accelcal.results.covariance import Covariance, rows_of
from accelcal.results.quantity import Gate, Quantity
from accelcal.results.triad import NAMES, TriadCalibration
from accelcal.triad.known import Visits, from_known_attitudes
from accelcal.triad.record import TriadRecord, one_an_attitude
from accelcal.triad.solution import Solution
from accelcal.triad.unknown import FRAMES, from_unknown_attitudes
from accelcal.version import SOFTWARE

__all__ = ["calibrate_triad"]

_PAIRS = ((0, 1), (0, 2), (1, 2))
_CROSS = tuple((i, j) for i in range(3) for j in range(3) if i != j)


def calibrate_triad(
    output: ArrayLike | TriadRecord, up: ArrayLike | None = None, *, frame: str | None = None
) -> TriadCalibration:
    """Calibrate three accelerometers in one block.

    Parameters
    ----------
    output : array_like, shape (n, 3), or TriadRecord
        Mean outputs of the channels x, y, z in each attitude [output unit]; columns of a DataFrame
        that are named so count by their names.
    up : array_like, shape (n, 3), optional
        Acceleration along the axes of the block, which points up [local g]. Without it the only
        truth is that its length is 1. For a block clamped anew in between give a record that names
        the shaft of each attitude, or U does not count how it sits.
    frame : {"x", "z"}, optional
        Frame of a triad whose attitudes are unknown, where S is known but for a rotation:
        ``"x"``, the default, lies with its axis x along the sensitive axis of channel x and has
        that of y in its plane xy; ``"z"`` lies with its axis z along that of z and has that of y
        in yz. Known attitudes are those of the axes of the block.

    Returns
    -------
    TriadCalibration
        Bias, sensitivity, scale factors, misalignments and angles, with covariance and gates.

    Raises
    ------
    InputError
        If the arrays have other shapes, `up` comes with a record, or, with known attitudes, a frame
        is given, an output never changes or two outputs are one, or frames of pandas have different
        indices.
    DesignError
        If the attitudes are too few or too alike; the message names what they leave open.

    Notes
    -----
    `accelcal.triad.known` and `accelcal.triad.unknown` tell the estimators. Intervals are of
    95 %, by Student's t. Where attitudes are known, the rows of one attitude are averaged.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> rng = np.random.default_rng(1)
    >>> up = rng.normal(size=(30, 3))
    >>> up /= np.linalg.norm(up, axis=1)[:, None]
    >>> output = 0.01 + 2.0 * up + rng.normal(scale=1e-3, size=up.shape)
    >>> accelcal.calibrate_triad(output).scale_factors["K_x"].value.__round__(2)
    2.0
    """
    if frame is not None:
        check_choice(FRAMES, frame=frame)
    if isinstance(output, TriadRecord):
        if up is not None:
            raise InputError("directions beside a record; put them into the record")
        return _calibrated(output, frame)
    try:
        readings = by_axis(output, "output")
    except InputError:
        if not hasattr(output, "columns"):
            expect(output, TriadRecord)
        raise
    refuse_other_order({"output": output, "up": up})
    return _calibrated(TriadRecord(readings, None if up is None else by_axis(up, "up")), frame)


def _calibrated(given: TriadRecord, chosen: str | None) -> TriadCalibration:
    record = one_an_attitude(given)
    if record.up is None:
        frame = chosen or FRAMES[0]
        found = from_unknown_attitudes(record.output, frame)
    elif chosen is None:
        frame = "block"
        found = from_known_attitudes(record.output, record.up, Visits.of(given), record.shaft)
    else:
        raise InputError(
            f"frame is {chosen!r}, but the attitudes are known, and so are the axes of the block;"
            " leave the frame out"
        )
    unit = record.unit or "output unit"
    names, matrix = _covariance(found)
    per_g = f"{unit}/g"
    return TriadCalibration(
        frame=frame,
        parameters=_quantities(found, _parameters, [unit] * 3 + [per_g] * 9),
        scale_factors=_quantities(found, _scale_factors, [per_g] * 3),
        misalignments=_quantities(found, _misalignments, ["rad"] * 6),
        axis_angles=_quantities(found, _axis_angles, ["rad"] * 3),
        covariance_names=names,
        covariance_matrix=matrix,
        attitudes=len(record.output),
        dof=found.dof,
        residual_rms=found.rms,
        gates=gates_of(record, found, frame),
        temperature_degC=_mean(record.temperature),
        g_local_m_s2=record.local_gravity,
        output_unit=record.unit,
        serial=record.serial,
        source=record.source,
        notes=record.notes,
        software=SOFTWARE,
    )


def _mean(temperature: Array | None) -> float | None:
    """Mean of the known temperatures."""
    if temperature is None or np.isnan(temperature).all():
        return None
    return float(np.nanmean(temperature))


def _parameters(theta: Array) -> Mapping[str, Array]:
    return dict(zip(NAMES, theta, strict=True))


def _directions(theta: Array) -> tuple[Array, Array]:
    """Lengths and directions of the rows of S."""
    sensitivity = theta[3:].reshape(3, 3)
    lengths = np.sqrt(np.sum(sensitivity**2, axis=1))
    return lengths, sensitivity / lengths[:, None]


def _scale_factors(theta: Array) -> Mapping[str, Array]:
    return {f"K_{axis}": k for axis, k in zip(AXES, _directions(theta)[0], strict=True)}


def _misalignments(theta: Array) -> Mapping[str, Array]:
    rows = _directions(theta)[1]
    return {f"m_{AXES[i]}{AXES[j]}": rows[i, j] for i, j in _CROSS}


def _axis_angles(theta: Array) -> Mapping[str, Array]:
    rows = _directions(theta)[1]
    return {AXES[i] + AXES[j]: np.arcsin(rows[i] @ rows[j]) for i, j in _PAIRS}


def _quantities(
    found: Solution, function: Callable[[Array], Mapping[str, Array]], units: list[str]
) -> dict[str, Quantity]:
    """Functions of the parameters with their uncertainty, to first order."""
    theta = np.concatenate([found.bias, found.sensitivity.ravel()])
    gradients = _gradients(found, function, theta)
    return {
        name: _quantity(float(value), unit, found, gradient)
        for (name, value), unit, gradient in zip(
            function(theta).items(), units, gradients, strict=True
        )
    }


def _gradients(
    found: Solution, function: Callable[[Array], Mapping[str, Array]], theta: Array
) -> Array:
    """By a step in the complex plane, which loses no digits."""
    tiny = 1e-100
    by_parameter = [
        np.array(list(function(theta + 1j * tiny * (np.arange(12) == i)).values())).imag / tiny
        for i in found.free
    ]
    return np.array(by_parameter).T


def _quantity(value: float, unit: str, found: Solution, gradient: Array) -> Quantity:
    if found.covariance is None:
        return Quantity(value, None, unit)
    standard = float(np.sqrt(np.maximum(gradient @ found.covariance @ gradient, 0.0)))
    if not standard:
        return Quantity(value, 0.0, unit, 0.0)
    dof = found.degrees(gradient)
    return Quantity(value, standard, unit, student_quantile(LEVEL, dof) * standard, dof)


def _covariance(found: Solution) -> Covariance:
    if found.covariance is None:
        return (), ()
    return tuple(NAMES[i] for i in found.free), rows_of(found.covariance)


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
