"""Faults of the readings: what happens between the accelerometer and the table."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import Effect
from accelcal.effects.parameter import Parameter
from accelcal.errors import InputError


def _outlier(c: Conditions, error: float, reading: float) -> Array:
    return np.where(c.number == _chosen(c, reading, c.number.size), error, 0.0)


def _swapped(c: Conditions, reading: float, apart: float) -> Array:
    if not 1 <= apart < c.number.size or apart % 1:
        raise InputError(
            f"swapped-positions: apart is {apart:g}; it is a whole number from 1 to"
            f" {c.number.size - 1}"
        )
    first = _chosen(c, reading, c.number.size - int(apart))
    pair = c.order[[first - 1, first - 1 + int(apart)]]
    change = np.zeros(c.number.size)
    change[pair] = c.indicated[pair[::-1]] - c.indicated[pair]
    return change


def _chosen(c: Conditions, reading: float, last: int) -> int:
    """Number of the reading meant: as given, or drawn where 0 is given."""
    if not 0 <= reading <= last or reading % 1:
        raise InputError(
            f"reading is {reading:g}; it is a whole number from 1 to {last}, or 0 for one drawn at"
            " random"
        )
    return int(reading) or int(np.argmax(c.draws[c.order][:last])) + 1


def _quantization(c: Conditions, step: float) -> Array:
    if step == 0.0:
        return np.zeros(c.number.size)
    return step * np.round(c.indicated / step) - c.indicated


def _reading(meaning: str, default: float | None, behind: int = 0) -> Parameter:
    """A reading by its number, with some more readings behind it."""
    return Parameter(
        "reading",
        "1",
        f"{meaning}, in the order of measuring; 0 draws one",
        default=default,
        minimum=0.0,
        linear=False,
        search=lambda c: np.arange(1.0, c.number.size + 1.0 - behind, dtype=np.float64),
        discrete=True,
    )


EFFECTS = (
    Effect(
        id="outlier",
        name="outlier",
        physics="One reading is wrong.",
        formula="e in one reading",
        signature="One residual stands out, and none of its replicates does.",
        to_tell_apart="the reading repeated",
        acts_on="readings",
        parameters=(
            Parameter("error", "g", "error e of the reading"),
            _reading("number of the reading", 0.0),
        ),
        term=_outlier,
    ),
    Effect(
        id="swapped-positions",
        name="swapped positions",
        physics="Two readings are written at each other's place.",
        formula="two readings exchanged",
        signature="Two residuals stand out, equal and opposite, by the difference of positions.",
        to_tell_apart="the original protocol, or the stroke repeated",
        acts_on="readings",
        parameters=(
            _reading("number of the first reading", None, behind=1),
            Parameter(
                "apart",
                "1",
                "how many readings later the second one was taken",
                default=1.0,
                minimum=1.0,
                linear=False,
                search=lambda c: np.arange(1.0, c.number.size, dtype=np.float64),
                discrete=True,
            ),
        ),
        term=_swapped,
    ),
    Effect(
        id="quantization",
        name="visible step of the voltmeter",
        physics="The readings are rounded to a step that is not small against their noise.",
        formula="q round(Y / q)",
        signature="The readings are multiples of one number.",
        to_tell_apart="a finer range, or more digits written down",
        acts_on="readings",
        parameters=(
            Parameter("step", "g", "the step q, over K1 at T0", minimum=0.0, linear=False),
        ),
        term=_quantization,
    ),
    Effect(
        id="vibration-noise",
        name="noise from vibration of the angle",
        physics="The head shakes, so that readings are noisier where the angle matters more.",
        formula="noise of standard deviation s |a_p|",
        signature="The scatter of replicates grows with |sin th|.",
        to_tell_apart="a record at rest at 90 deg, with the stand quiet and disturbed",
        acts_on="readings",
        parameters=(
            Parameter("sigma", "g", "standard deviation s at |a_p| = 1", minimum=0.0, linear=False),
        ),
        term=lambda c, sigma: sigma * np.abs(c.cross) * c.draws,
    ),
)
