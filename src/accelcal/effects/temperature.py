"""Effects of temperature beyond the bilinear laws of the bias and of the scale factor."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.effects.conditions import LEVEL_CHANGE, Conditions
from accelcal.effects.effect import Effect
from accelcal.effects.parameter import Parameter
from accelcal.units import HOUR

_MORE_LEVELS = "two or more temperatures on either side of T0 (one more, if there are two already)"


def _kink(excess: Array, shift: float) -> Array:
    return np.maximum(excess - shift, 0.0) - max(-shift, 0.0)


def _break_shift(c: Conditions, shift: float, slope_change: float) -> Array:
    return slope_change * (_kink(c.excess, shift) - _kink(c.excess, 0.0))


def _between_levels(c: Conditions) -> Array:
    """Shifts of the break that leave a level of the test on either side, T0 where there is one."""
    lowest, highest = c.excess.min(), c.excess.max()
    if highest - lowest < LEVEL_CHANGE:
        return np.zeros(1)
    return np.linspace(lowest, highest, 23)[1:-1]


def _loop(c: Conditions, amplitude: float, first_level: float) -> Array:
    return amplitude * np.where(c.heating == 0.0, first_level, c.heating)


def _states(c: Conditions) -> Array:
    """From as after cooling to as after heating; nothing to try where no level is left."""
    return np.linspace(-1.0, 1.0, 5) if c.heating.any() else np.zeros(1)


EFFECTS = (
    Effect(
        id="k2-temperature",
        name="temperature dependence of k2",
        physics="The second-order nonlinearity changes with temperature.",
        formula="c dT a_i^2",
        signature="k2 of the runs rises or falls with their temperature.",
        to_tell_apart="more temperatures, or k2 of each run from more strokes",
        static=True,
        parameters=(Parameter("slope", "g/g^2/degC", "change of k2 with temperature"),),
        term=lambda c, slope: slope * c.excess * c.input**2,
    ),
    Effect(
        id="k3-temperature",
        name="temperature dependence of k3",
        physics="The third-order nonlinearity changes with temperature.",
        formula="c dT a_i^3",
        signature="k3 of the runs rises or falls with their temperature.",
        to_tell_apart="more temperatures, or k3 of each run from more strokes",
        static=True,
        parameters=(Parameter("slope", "g/g^3/degC", "change of k3 with temperature"),),
        term=lambda c, slope: slope * c.excess * c.input**3,
    ),
    Effect(
        id="bias-temperature-quadratic",
        name="quadratic temperature law of the bias",
        physics="The bias bends with temperature on top of its bilinear law.",
        formula="c dT^2",
        signature="k0 of the runs lies off the two straight lines; none with T0 and one level on"
        " either side.",
        to_tell_apart=_MORE_LEVELS,
        static=True,
        parameters=(Parameter("coefficient", "g/degC^2", "coefficient of dT^2 in k0"),),
        term=lambda c, coefficient: coefficient * c.excess**2,
    ),
    Effect(
        id="scale-factor-temperature-quadratic",
        name="quadratic temperature law of the scale factor",
        physics="The scale factor bends with temperature on top of its bilinear law.",
        formula="K1 = K1N (1 + beta dT + c dT^2)",
        signature="K1 of the runs lies off the two straight lines; none with T0 and one level on"
        " either side.",
        to_tell_apart=_MORE_LEVELS,
        static=True,
        parameters=(Parameter("coefficient", "1/degC^2", "coefficient of dT^2 in K1 / K1N"),),
        term=lambda c, coefficient: coefficient * c.excess**2 * c.indicated / c.gain,
    ),
    Effect(
        id="break-shift",
        name="shifted break of the bias law",
        physics="The bilinear law of the bias breaks at a temperature other than T0.",
        formula="(lam1 - lam2) [max(dT - s, 0) - max(dT, 0) - max(-s, 0)]",
        signature="k0 of the runs between T0 and the break lies off the line; none with T0 and one"
        " level on either side.",
        to_tell_apart=f"{_MORE_LEVELS}, some near T0",
        tie={"K0 above T0": 1.0, "K0 below T0": -1.0},
        static=True,
        parameters=(
            Parameter("shift", "degC", "break minus T0, s", linear=False, search=_between_levels),
            Parameter(
                "slope_change",
                "g/degC",
                "slope above minus slope below the break; it moves the break and adds no second"
                " one where it is that of the accelerometer, as the default is for the AL-15",
                default=6e-6,
            ),
        ),
        term=_break_shift,
    ),
    Effect(
        id="temperature-hysteresis",
        name="temperature hysteresis of the bias",
        physics="The bias differs between levels reached by heating and by cooling.",
        formula="+h after heating, -h after cooling, something between at the first level",
        signature="k0 of the same temperature differs by 2 h with the way to it; none where T0 and"
        " one level on either side are met once each.",
        to_tell_apart="a level met both by heating and by cooling",
        parameters=(
            Parameter("amplitude", "g", "half the width h of the loop"),
            Parameter(
                "first_level",
                "1",
                "bias at the first level, which no record tells the way to, over h: from -1, as"
                " after cooling, to +1",
                default=0.0,
                linear=False,
                search=_states,
            ),
        ),
        term=_loop,
    ),
    Effect(
        id="chamber-drift",
        name="drift of the chamber",
        physics="The temperature moves within a run while the table says that it is constant.",
        formula="T + r t, t from the start of the run",
        signature="k0 and K1 drift together in each run, in the ratio of their temperature slopes.",
        to_tell_apart="the actual temperature of each reading; without it, a drift of the bias"
        " looks the same",
        acts_on="temperature",
        parameters=(Parameter("rate", "degC/h", "change of temperature with time"),),
        term=lambda c, rate: rate * c.run_time / HOUR,
        bend=lambda c: (c.run_time / HOUR) ** 2 * c.per_degree,
    ),
)
