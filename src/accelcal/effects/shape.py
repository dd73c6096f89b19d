"""Effects on the shape of the conversion function: terms that (1) does not have."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import Effect
from accelcal.effects.parameter import Parameter

_FINER = "positions 22.5 or 30 deg apart instead of 45 deg (more strokes, if they are so already)"
_OTHER_MOUNTING = "the other cross axis in the rotation plane"


def _dead_zone(c: Conditions, threshold: float) -> Array:
    return -np.clip(c.axial, -threshold, threshold)


EFFECTS = (
    Effect(
        id="scale-factor-asymmetry",
        name="scale factor asymmetry",
        physics="The scale factor for positive inputs differs from that for negative ones.",
        formula="c |a_i|",
        signature="On 45 deg positions cos 4th, the same as a_i^4; the rest goes into k0 and k2.",
        to_tell_apart=_FINER,
        static=True,
        parameters=(
            Parameter("coefficient", "1", "half the relative difference of the two scale factors"),
        ),
        term=lambda c, coefficient: coefficient * np.abs(c.input),
    ),
    Effect(
        id="fourth-order",
        name="fourth-order nonlinearity",
        physics="The conversion function bends with the fourth power of the input.",
        formula="k4 a_i^4",
        signature="On 45 deg positions cos 4th, the same as |a_i|; the rest goes into k0 and k2.",
        to_tell_apart=_FINER,
        static=True,
        parameters=(Parameter("coefficient", "g/g^4", "k4 = K4 / K1"),),
        term=lambda c, coefficient: coefficient * c.input**4,
    ),
    Effect(
        id="odd-quadratic",
        name="odd quadratic nonlinearity",
        physics="The conversion function bends with the square of the input, with its sign.",
        formula="c a_i |a_i|",
        signature="None on 45 deg positions: K1 and k3 absorb it.",
        to_tell_apart="16 positions in a turn or more, averaged over many strokes",
        static=True,
        parameters=(Parameter("coefficient", "g/g^2", "coefficient of a_i |a_i|"),),
        term=lambda c, coefficient: coefficient * c.input * np.abs(c.input),
    ),
    Effect(
        id="cross-axis-cubic",
        name="cubic cross-axis sensitivity",
        physics="The output follows the cube of the acceleration along the cross axis.",
        formula="c a_p^3",
        signature="On 45 deg positions sin 3th; the rest goes into delta.",
        to_tell_apart=f"{_FINER}, or {_OTHER_MOUNTING}",
        static=True,
        parameters=(Parameter("coefficient", "g/g^3", "coefficient of a_p^3"),),
        term=lambda c, coefficient: coefficient * c.cross**3,
    ),
    Effect(
        id="cross-axis-quadratic",
        name="quadratic cross-axis sensitivity",
        physics="The output follows the square of the acceleration along the cross axis.",
        formula="c a_p^2",
        signature="None in any turn about one axis, as a_p^2 = 1 - a_i^2: k0 and k2 absorb it.",
        to_tell_apart=_OTHER_MOUNTING,
        static=True,
        parameters=(Parameter("coefficient", "g/g^2", "k_pp, coefficient of a_p^2"),),
        term=lambda c, coefficient: coefficient * c.cross**2,
    ),
    Effect(
        id="dead-zone",
        name="dead zone",
        physics="Below a threshold nothing answers; beyond it the output is shifted towards zero.",
        formula="-a where |a| < w, else -w sign(a), with a = a_i + delta a_p",
        signature="The two positions near 0 g stand out: sin 3th, or k0 and k2, by their signs;"
        " K1 and k3 absorb the rest.",
        to_tell_apart="fine steps of the head about the two positions near 0 g",
        static=True,
        parameters=(Parameter("threshold", "g", "the threshold w", minimum=0.0, small=1e-6),),
        term=_dead_zone,
    ),
)
