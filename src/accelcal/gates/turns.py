"""What would put a table in proportion: another number of positions, or two exchanged ones."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from accelcal.arrays import Array
from accelcal.estimate.tables import PreparedTable
from accelcal.model import BIAS, MISALIGNMENT, SCALE_FACTOR
from accelcal.numerics.sorting import distinct

LARGEST_RATIOS = {"K0": 0.2, "K2": 0.1, "K3": 0.1, "M": 0.1, "M_ip": 0.1}
"""Largest part of K1 that a coefficient of any accelerometer has [1 / g^(n - 1)]."""

LARGEST_RESIDUAL = 0.02
"""Largest rms residual of any accelerometer [g]."""

_FEWEST = 4  # positions in a turn: fewer leave no residual
_TRIED = range(6, 41)  # numbers of angles of which each two are tried; four may be negated so
_WHOLE = 1e-6  # by which the number of a position may miss a whole one


def other_positions(table: PreparedTable, output: Array, delta0: float) -> tuple[str, str] | None:
    """Find other positions with which readings are in proportion, and hardly leave a residual.

    The readings, shape (n,) [output unit], are those at the angles of the table, with a fixture
    angle [rad]. What is wrong is told, and which positions fit; None where none do.
    """
    positions = _fitting_turn(table, output, delta0)
    if positions is not None:
        said = f"the readings fit {positions} positions in a turn: declare '# positions:"
        return "number of positions", f"{said} {positions}'"
    exchange = _fitting_exchange(table, output, delta0)
    if exchange is None:
        return None
    said = "the readings fit with those at {:g} and {:g} deg exchanged in all strokes"
    return "positions exchanged", said.format(*exchange)


def _fitting_turn(table: PreparedTable, output: Array, delta0: float) -> int | None:
    """Another number of positions in a turn, which go once around.

    They do so with the return to the first one or without. None where none fits, or the angles are
    none of numbered positions.
    """
    positions = table.record.positions
    number = table.record.angle * positions / 360.0  # from 0
    if np.abs(number - np.round(number)).max() > _WHOLE:
        return None
    last = int(np.round(number.max()))
    others = [n for n in (last + 1, last) if n >= _FEWEST and n != positions]
    fits = (n for n in others if _in_proportion(table, output, number * 360.0 / n, delta0))
    return next(fits, None)


def _fitting_exchange(
    table: PreparedTable, output: Array, delta0: float
) -> tuple[float, float] | None:
    """The only two angles [deg] whose exchange in all strokes fits."""
    angle = table.record.angle
    angles = distinct(angle)
    if angles.size not in _TRIED:
        return None
    fits = []
    for first, second in combinations(angles.tolist(), 2):
        other = np.where(angle == first, second, np.where(angle == second, first, angle))
        if _in_proportion(table, output, other, delta0):
            fits.append((first, second))
    return fits[0] if len(fits) == 1 else None


def _in_proportion(table: PreparedTable, output: Array, angle: Array, delta0: float) -> bool:
    """Tell whether K0, K1 and M, which four angles tell apart, fit readings at angles [deg]."""
    design = table.design_at(angle, delta0)[:, [BIAS, SCALE_FACTOR, MISALIGNMENT]]
    k0, k1, m = found = np.linalg.lstsq(design, output)[0]
    rms = np.sqrt(((output - design @ found) ** 2).mean())
    sizes = (k0, LARGEST_RATIOS["K0"]), (m, LARGEST_RATIOS["M"]), (rms, LARGEST_RESIDUAL)
    return all(bool(abs(size) <= k1 * largest) for size, largest in sizes)
