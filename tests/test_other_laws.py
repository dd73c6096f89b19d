"""A tilt of the stand is linear in time or daily: both are told where the readings do not tell."""

import re
from functools import cache

import numpy as np
import pytest

import accelcal
from accelcal.discovery.doubts.otherwise import _value
from accelcal.results.findings import Change
from accelcal.results.quantity import Quantity
from accelcal.simulation import TumblePlan

TILT = accelcal.effect("foundation-tilt")
TWO_HOURS = TumblePlan(temperatures=(20.0,), strokes=12, timed=True)
NINE_HOURS = TumblePlan(seconds_per_reading=150.0, timed=True)
MORE_THAN_A_DAY = TumblePlan(seconds_between_runs=12 * 3600.0, timed=True)
AS_WELL = " explains these readings as well; to tell: "


@cache
def discovered(plan, hidden, seed):
    return accelcal.discover(accelcal.simulate(plan=plan, effects=[hidden], seed=seed))


def laws_of(plan, hidden, seed):
    """Law that is named, and those that are told beside it."""
    found = discovered(plan, hidden, seed)
    (tilt,) = found.effects
    assert tilt.id == "foundation-tilt"
    beside = [note.split(AS_WELL)[0] for note in found.notes if AS_WELL in note]
    return "linear" if "rate" in tilt.parameters else "daily", beside


def daily(size, phase):
    return TILT.of(0.0, sine=size * np.cos(phase), cosine=size * np.sin(phase))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("hidden", [TILT.of(2.5e-5), daily(1e-4, 0.0)], ids=["linear", "daily"])
def test_two_hours_of_a_day_are_a_straight_line(hidden, seed):
    named, beside = laws_of(TWO_HOURS, hidden, seed)
    assert named == "linear"
    assert len(beside) == 1
    assert re.search(r"^foundation-tilt with sine = \S+ rad, cosine = \S+ rad$", beside[0])


def test_the_other_law_has_the_size_that_it_would_have():
    hour = 2.0 * np.pi / 24.0
    for seed in range(3):
        _, beside = laws_of(TWO_HOURS, TILT.of(5e-5), seed)
        sine, cosine = (float(size) for size in re.findall(r"= (\S+) rad", beside[0]))
        in_the_middle = hour * (sine * np.cos(hour) - cosine * np.sin(hour))
        assert in_the_middle == pytest.approx(5e-5, rel=0.3)


@pytest.mark.parametrize("seed", range(3))
def test_a_linear_tilt_leaves_the_misalignment_right(seed):
    record = accelcal.simulate(plan=TWO_HOURS, effects=[TILT.of(5e-5)], seed=seed)
    found = discovered(TWO_HOURS, TILT.of(5e-5), seed)
    m = accelcal.fit(record, model=found).tables[0].coefficients["M"]
    truth = accelcal.fit(accelcal.simulate(plan=TWO_HOURS, seed=seed)).tables[0].coefficients["M"]
    assert abs(m.value - truth.value) < m.expanded_uncertainty


@pytest.mark.parametrize(
    ("hidden", "law", "seed"),
    [(TILT.of(5e-5), "linear", 0), (daily(4e-4, 0.7), "daily", 1), (daily(4e-4, 2.3), "daily", 2)],
)
def test_more_than_a_day_tells(hidden, law, seed):
    assert laws_of(MORE_THAN_A_DAY, hidden, seed) == (law, [])


@pytest.mark.parametrize("seed", range(2))
def test_a_bend_within_hours_tells_that_the_tilt_is_not_linear(seed):
    assert laws_of(NINE_HOURS, daily(4e-4, 1.0), seed) == ("daily", [])


def test_what_changes_with_the_law_is_told():
    found = accelcal.discover(
        accelcal.simulate(plan=TumblePlan(timed=True), effects=[TILT.of(3e-5)], seed=0)
    )
    (note,) = (note for note in found.notes if note.startswith("if it is foundation-tilt with "))
    assert re.search(r"rad in truth: delta [\d.]+ urad", note)


ASYMMETRY = accelcal.effect("scale-factor-asymmetry").of(2e-4)


def coefficient(found, name):
    return next(each for each in found.coefficients if each.coefficient == name)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    "hidden", [ASYMMETRY, accelcal.effect("fourth-order").of(1.5e-4)], ids=["|a_i|", "a_i^4"]
)
def test_the_uncertainty_covers_where_the_other_one_of_two_effects_is_the_true_one(hidden, seed):
    """That of K2 counted nothing of it: it lay off by ten times as much."""
    found = discovered(TumblePlan(), hidden, seed)
    (named,) = found.effects
    assert {named.id, *named.indistinguishable} == {"scale-factor-asymmetry", "fourth-order"}
    truth = accelcal.fit(accelcal.simulate(seed=seed)).tables[0].error_model["k2"]
    K2 = coefficient(found, "K2").after
    assert abs(K2.value - truth.value) < K2.expanded_uncertainty
    (note,) = found.otherwise
    other = 1e-6 * float(re.search(r"k2 ([\d.]+) ug", note)[1])
    off = other - K2.value
    assert K2.standard_uncertainty == pytest.approx(abs(off) / np.sqrt(2.0), rel=0.05)
    assert K2.coverage_factor == pytest.approx(1.98, abs=0.02)


def test_a_coefficient_that_hangs_on_no_other_effect_keeps_its_uncertainty():
    found = discovered(TumblePlan(), ASYMMETRY, 1)
    K3 = coefficient(found, "K3")
    assert K3.after.standard_uncertainty == pytest.approx(K3.before.standard_uncertainty, rel=0.05)


def test_a_part_of_an_effect_that_coefficients_take_up_is_counted_in_them():
    """U of k0 and k2 left out the sine of an eccentricity of which the cosine shows: 40 ug."""
    plan = TumblePlan(positions=12, mountings=("o+", "o-"), temperatures=(20.0,))
    hidden = [accelcal.effect("head-eccentricity").of(-4e-5, cosine=4e-5)]
    first, second = (accelcal.simulate(plan=plan, effects=hidden, seed=seed) for seed in (1, 2))
    found = accelcal.discover(first)
    assert [item.id for item in found.effects] == ["head-eccentricity"]
    assert found.effects[0].parameters["sine"].value is None
    after = {change.coefficient: change.after for change in found.coefficients}
    model = accelcal.fit(second, model=found).tables[0].error_model
    assert any("sine as large as cosine" in note for note in found.notes)
    for name, truth in (("K0", 3.324e-3), ("K2", 105e-6)):
        for told in (after[name], model[name.lower()]):
            assert 2e-5 < abs(told.value - truth) < told.expanded_uncertainty < 7e-5


@pytest.mark.parametrize(
    ("value", "U", "told"),
    [(-1e-7, 5e-5, "k0 0 ug"), (3.3242e-3, 4e-7, "k0 3324.20 ug"), (3.3242e-3, None, "k0 3324 ug")],
)
def test_a_coefficient_has_the_digits_of_its_uncertainty(value, U, told):
    """Zero was -0, and 3324 without U 3.32e+03."""
    own = Quantity(value, U and U / 2.0, "g", U)
    assert _value(Change("K0", own, own), Change("K0", own, own)) == told
