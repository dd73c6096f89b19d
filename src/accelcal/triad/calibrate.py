"""Calibration of a triad from its attitudes, known or not."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.axes import AXES, by_axis
from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import refuse_other_order
from accelcal.arguments.options import check_choice
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.covariance import Covariance, rows_of
from accelcal.results.quantity import Quantity
from accelcal.results.triad import NAMES, TriadCalibration
from accelcal.triad.gates import gates_of
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
