"""A tilt of the stand is linear in time or daily: both are told where the readings do not tell."""

import re

import numpy as np
import pytest

import accelcal
from accelcal.simulation import TumblePlan

TILT = accelcal.effect("foundation-tilt")
TWO_HOURS = TumblePlan(temperatures=(20.0,), strokes=12, timed=True)
NINE_HOURS = TumblePlan(seconds_per_reading=150.0, timed=True)
MORE_THAN_A_DAY = TumblePlan(seconds_between_runs=12 * 3600.0, timed=True)
AS_WELL = " explains these readings as well; to tell: "


def laws_of(plan, hidden, seed):
    """Law that is named, and those that are told beside it."""
    found = accelcal.discover(accelcal.simulate(plan=plan, effects=[hidden], seed=seed))
    (tilt,) = found.effects
    assert tilt.id == "foundation-tilt"
    beside = [note.split(AS_WELL)[0] for note in found.notes if AS_WELL in note]
    return "linear" if "rate" in tilt.parameters else "daily", beside


def daily(size, phase):
    return TILT.of(0.0, sine=size * np.cos(phase), cosine=size * np.sin(phase))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("hidden", [TILT.of(2.5e-5), daily(1e-4, 0.0)], ids=["linear", "daily"])
def test_two_hours_of_a_day_are_a_straight_line(hidden, seed):
    named, beside = laws_of(TWO_HOURS, hidden, seed)
    assert len(beside) == 1
    assert beside[0].startswith("foundation-tilt with ")
    assert ("rate = " in beside[0]) == (named == "daily")
    assert ("sine = " in beside[0]) == (named == "linear")


def test_the_other_law_has_the_size_that_it_would_have():
    rates = [
        float(re.search(r"rate = (\S+) rad/h", beside[0]).group(1))
        for named, beside in (laws_of(TWO_HOURS, TILT.of(5e-5), seed) for seed in range(6))
        if named == "daily"
    ]
    assert len(rates) > 1
    assert np.abs(np.array(rates) / 5e-5 - 1.0).max() < 0.3


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("hidden", "law"),
    [(TILT.of(5e-5), "linear"), (daily(4e-4, 0.7), "daily"), (daily(4e-4, 2.3), "daily")],
)
def test_more_than_a_day_tells(hidden, law, seed):
    assert laws_of(MORE_THAN_A_DAY, hidden, seed) == (law, [])


@pytest.mark.parametrize("seed", range(3))
def test_a_bend_within_hours_tells_that_the_tilt_is_not_linear(seed):
    assert laws_of(NINE_HOURS, daily(4e-4, 1.0), seed) == ("daily", [])


def test_what_changes_with_the_law_is_told():
    found = accelcal.discover(
        accelcal.simulate(plan=TumblePlan(timed=True), effects=[TILT.of(3e-5)], seed=0)
    )
    (note,) = (note for note in found.notes if note.startswith("if it is foundation-tilt with "))
    assert re.search(r"rad in truth: M \d+ urad", note)
