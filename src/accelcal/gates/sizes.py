"""Gates on sizes: coefficients out of all proportion, and readings in another unit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.tables import PreparedTable
from accelcal.gates.replicates import place
from accelcal.gates.verdict import acceleration, times, warn_if
from accelcal.grouping import distinct
from accelcal.model import COEFFICIENTS
from accelcal.results.quantity import Gate

__all__ = ["proportions", "units", "wrong_sign"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_LARGEST = {"K0": 0.2, "K2": 0.1, "K3": 0.1, "M": 0.1, "M_ip": 0.1}  # over K1
_LARGEST_RESIDUAL = 0.02  # rms [g]
_TELLING = 0.3  # readings below this share of the largest tell nothing about the unit
_OTHER_SIZE = 1.3  # ratio of two strokes, or of two scale factors, above any temperature effect
_NEAR_DECADE = 0.1  # of a power of ten, in decimal digits: a bias makes opposite readings differ
_MOST_TOLD = 3


def proportions(table: PreparedTable, coefficients: Array) -> Gate:
    """Compare the error coefficients and residuals with what any accelerometer has.

    Parameters
    ----------
    table : PreparedTable
        The table.
    coefficients : ndarray, shape (6,)
        Its coefficients, zero where not estimated [output unit / g^n].

    Returns
    -------
    Gate
        A warning where the scale factor is not positive, or another coefficient or the rms
        residual is too large a part of it.
    """
    scale_factor = float(coefficients[COEFFICIENTS.index("K1")])
    if scale_factor <= 0.0:
        return warn_if("proportions", True, wrong_sign(scale_factor))
    ratios = dict(zip(COEFFICIENTS, (coefficients / scale_factor).tolist(), strict=True))
    odd = [
        f"{name}/K1 = {ratios[name]:.3g} is above {limit:g} in size"
        for name, limit in _LARGEST.items()
        if abs(ratios[name]) > limit
    ]
    residual = table.record.output - table.design @ coefficients
    rms = float(np.sqrt((residual**2).mean())) / scale_factor
    if rms > _LARGEST_RESIDUAL:
        odd.append(f"the readings are {acceleration(rms)} (rms) away from the model")
    elif abs(ratios["M"]) > _LARGEST["M"]:
        turn = np.degrees(np.arctan2(-ratios["M"], 1.0))
        odd.append(f"as if all positions were shifted by {turn:.1f} deg")
    return warn_if(
        "proportions", bool(odd), ", ".join(odd) or "all coefficients in proportion to K1"
    )


def wrong_sign(scale_factor: float) -> str:
    """Say what a scale factor that is not positive means.

    Parameters
    ----------
    scale_factor : float
        K1 [output unit / g].

    Returns
    -------
    str
        The finding.
    """
    return (
        f"K1 = {scale_factor:.6g} is not positive: the sign of the output is turned, or the"
        " positions are shifted by half a turn"
    )


def units(table: PreparedTable) -> Gate:
    """Look for strokes and readings that another unit or range has made larger or smaller.

    Parameters
    ----------
    table : PreparedTable
        The table.

    Returns
    -------
    Gate
        A warning where some readings of a stroke differ by a power of ten from those at the same
        and the opposite head position, or where whole strokes are of another size.

    Notes
    -----
    The size of a stroke is the amplitude of a sine through it, which no wrong order changes.
    """
    record = table.record
    power = _decades(record.output, np.mod(table.head, 180.0))
    wrong = np.flatnonzero(power != 0.0)
    whole = all((power[record.stroke == k] != 0.0).mean() > 0.5 for k in record.stroke[wrong])
    if wrong.size == 0 or whole or (wrong.size == 1 and power[wrong[0]] < 0.0):
        return _size_of_strokes(table)
    more = f" and {wrong.size - 1} more" if wrong.size > 1 else ""
    ratio = times(10.0 ** float(power[wrong[0]]))
    return warn_if(
        "units",
        True,
        f"{place(record, int(wrong[0]))}{more}: about {ratio} times the readings at the same and"
        " the opposite angle, another unit or range",
    )


def _decades(output: Array, axis: Array) -> Array:
    """Powers of ten by which readings differ from the others on the same axis of the head."""
    size = np.abs(output)
    usual = np.empty_like(size)
    for own in (axis == value for value in distinct(axis)):
        usual[own] = _middle(size[own])
    telling = (usual > _TELLING * usual.max()) & (size > 0.0)
    decades = np.log10(np.where(telling, size, 1.0) / np.where(telling, usual, 1.0))
    power = np.round(decades)
    return np.where(np.abs(decades - power) < _NEAR_DECADE, power, 0.0)


def _middle(values: Array) -> float:
    """Lower median: one of the values itself, so that two groups are not mixed."""
    return float(np.sort(values)[(values.size - 1) // 2])


def _size_of_strokes(table: PreparedTable) -> Gate:
    strokes = distinct(table.record.stroke)
    sizes = np.array([_amplitude(table, table.record.stroke == stroke) for stroke in strokes])
    known = np.isfinite(sizes)
    ratio = sizes / _middle(sizes[known]) if known.any() else sizes
    other = known & (np.abs(np.log(np.where(known, ratio, 1.0))) > np.log(_OTHER_SIZE))
    if not other.any():
        return warn_if("units", False, "all strokes of one size")
    found = [
        f"stroke {k} is {times(float(r))} times"
        for k, r in zip(strokes[other], ratio[other], strict=True)
    ]
    said = "the other stroke" if strokes.size == 2 else "the other strokes"
    more = f" (and {len(found) - _MOST_TOLD} more)" if len(found) > _MOST_TOLD else ""
    listed = ", ".join(found[:_MOST_TOLD])
    return warn_if("units", True, f"{listed} as large as {said}{more}: another unit or range")


def _amplitude(table: PreparedTable, own: Mask) -> float:
    """Amplitude of a sine through the readings of a stroke; NaN where they are too few."""
    angle = np.radians(table.head[own])
    if distinct(table.head[own]).size < 3:
        return float("nan")
    matrix = np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])
    _, cosine, sine = np.linalg.lstsq(matrix, table.record.output[own], rcond=None)[0]
    return float(np.hypot(cosine, sine))
