"""Effects of the stand: errors of the head angle."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.effects.conditions import SAME_ANGLE, Conditions
from accelcal.effects.effect import Effect
from accelcal.effects.parameter import Parameter
from accelcal.errors import InputError
from accelcal.head_angles import angular_distance, head_positions

_LEAST = 0.05
"""Part of the largest change by the angle from which on a position shows its error."""


def _position_error(c: Conditions, error: float, at: float) -> Array:
    here = angular_distance(c.angle, at) < SAME_ANGLE
    if not here.any():
        angles = ", ".join(f"{angle:g}" for angle in _positions(c))
        raise InputError(f"position-error: no reading at {at:g} deg; there are some at {angles}")
    return np.where(here, error, 0.0)


def _positions(c: Conditions) -> Array:
    """Distinct head angles in a turn [deg]."""
    return np.unique(head_positions(c.angle))


def _where_it_acts(c: Conditions) -> Array:
    """Those at which a small error acts; next to 0 and 180 deg only a large one would [deg]."""
    acts = np.abs(c.per_radian)
    return np.unique(head_positions(c.angle[acts >= _LEAST * acts.max()]))


EFFECTS = (
    Effect(
        id="backlash",
        name="backlash of the head",
        physics="The shaft lags behind the head by a fixed angle, by the sense of rotation.",
        formula="d th = -b forward, +b back",
        signature="Forward minus back goes with sin th: its ratio at 45 and 90 deg is 0.71.",
        to_tell_apart="positions between 0 and 45 deg in both senses, where hysteresis keeps its"
        " size, or the angle of the shaft measured by an optical polygon",
        acts_on="angle",
        parameters=(Parameter("lag", "rad", "angle b, half of the play of the drive"),),
        term=lambda c, lag: -lag * c.rotation,
    ),
    Effect(
        id="fixture-offset",
        name="offset of the fixture",
        physics="The angle between head zero and input axis is not the given one.",
        formula="d th = e",
        signature="None in one mounting: the misalignment delta absorbs it.",
        to_tell_apart="the reversed mounting: delta changes its sign, the offset does not",
        acts_on="angle",
        parameters=(Parameter("angle", "rad", "true minus given fixture angle"),),
        term=lambda c, angle: np.full(c.angle.size, angle),
    ),
    Effect(
        id="head-eccentricity",
        name="eccentricity of the head",
        physics="The circle of the head sits off its axis, so that the angle errs once a turn.",
        formula="d th = s sin th + c cos th = e sin(th + phi)",
        signature="None in one clamping: k0 (by -s) and k2 (by s) absorb s, delta_ip absorbs c.",
        to_tell_apart="the unit clamped at another head angle, or the certificate of the head",
        acts_on="angle",
        parameters=(
            Parameter("sine", "rad", "part s = e cos(phi)"),
            Parameter("cosine", "rad", "part c = e sin(phi)", 0.0),
        ),
        term=lambda c, sine, cosine: (
            sine * np.sin(np.radians(c.angle)) + cosine * np.cos(np.radians(c.angle))
        ),
    ),
    Effect(
        id="position-error",
        name="error of one head position",
        physics="One head position stands at a wrong angle, the same in all strokes and runs.",
        formula="d th = e at one head position",
        signature="One position lies off by -e sin th in all strokes and runs; none at 0 and"
        " 180 deg.",
        to_tell_apart="the unit clamped at another head angle: the error stays with the head",
        acts_on="angle",
        parameters=(
            Parameter("error", "rad", "angle error e"),
            Parameter(
                "at",
                "deg",
                "nominal head angle of the position",
                default=45.0,
                linear=False,
                search=_where_it_acts,
                discrete=True,
            ),
        ),
        term=_position_error,
    ),
)
