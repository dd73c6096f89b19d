"""Effects so large that the law of small ones does not hold."""

from dataclasses import replace

import numpy as np
import pytest

import accelcal
from accelcal.discovery.comparison import compared
from accelcal.discovery.instance import instance_of
from accelcal.discovery.large_effects import straightened
from accelcal.effects.catalogue import effect
from accelcal.simulation import NoiseComponents, TumblePlan

PLAN = TumblePlan(strokes=8, temperatures=(20.0,))
QUIET = NoiseComponents(head=0.0, temperature=0.0)


def off_by(quantity, truth):
    """Error of a quantity over its expanded uncertainty."""
    return abs(quantity.value - truth) / quantity.expanded_uncertainty


@pytest.mark.parametrize("hidden", ["backlash", "hysteresis"])
@pytest.mark.parametrize(("seed", "size"), [(0, 6e-3), (1, 6e-3), (2, 3e-2)])
def test_a_lag_of_milliradians_leaves_nothing_and_has_its_size(hidden, seed, size):
    """One of 30 mrad was off by 7 U: over the scale factor that the readings seemed to have."""
    record = accelcal.simulate(plan=PLAN, seed=seed, effects=[effect(hidden).of(size)])
    found = accelcal.discover(record)
    assert [item.id for item in found.effects] == [hidden]
    assert found.unexplained is None
    assert found.after.reduced_chi2 < 1.5
    assert found.before.rms > 1e-3  # that of the readings as they are
    told = next(iter(found.effects[0].parameters.values()))
    assert off_by(told, size) < 1.3
    again = accelcal.fit(record, model=found)
    told = next(iter(again.effects[0].parameters.values()))
    assert off_by(told, size) < 1.3
    assert off_by(again.tables[0].coefficients["K1"], 1.35) < 1.3


@pytest.mark.parametrize(
    ("tilt", "half_width"), [(4e-3, 3e-5), (-4e-3, 2e-4), (-1e-2, 3e-5), (2e-2, 2e-4)]
)
def test_a_play_as_wide_as_readings_are_behind_an_extreme_has_its_name(tilt, half_width):
    """A misalignment of some milliradians puts the readings at 0 and 180 deg there."""
    accelerometer = accelcal.Accelerometer(misalignment=accelcal.BilinearLaw(tilt))
    hidden, plan = [effect("hysteresis").of(half_width)], replace(PLAN, strokes=6)
    first, second = (accelcal.simulate(accelerometer, plan, effects=hidden, seed=n) for n in (1, 2))
    found = accelcal.discover(first)
    assert [item.id for item in found.effects] == ["hysteresis"]
    assert found.unexplained is None
    assert off_by(found.effects[0].parameters["half_width"], half_width) < 1.3
    again = accelcal.fit(second, model=found)
    assert off_by(again.effects[0].parameters["half_width"], half_width) < 1.3


@pytest.mark.parametrize(("seed", "half_width"), [(0, 1e-6), (2, 5e-6)])
def test_a_small_play_has_its_name_where_readings_tell_its_exact_law(seed, half_width):
    """0.7 ug behind an extreme, by a usual misalignment, count in readings of 0.3 ug."""
    hidden, noise = [effect("hysteresis").of(half_width)], NoiseComponents(reading=3e-7)
    record = accelcal.simulate(plan=PLAN, noise=noise, effects=hidden, seed=seed)
    found = accelcal.discover(record)
    assert [item.id for item in found.effects] == ["hysteresis"]
    assert found.unexplained is None
    assert off_by(found.effects[0].parameters["half_width"], half_width) < 1.3


def test_small_effects_leave_the_readings_as_they_are():
    known = effect("backlash").of(2e-5)
    comparison = compared(accelcal.simulate(plan=PLAN, seed=1, effects=[known]), 20.0)
    assert straightened(comparison, [instance_of(known)]) is None


def test_readings_that_do_not_settle_stay_as_they_are():
    known = effect("dead-zone").of(2e-3)  # wider than the misalignment
    comparison = compared(accelcal.simulate(plan=PLAN, seed=1, effects=[known]), 20.0)
    assert straightened(comparison, [instance_of(known)]) is None


def test_without_what_is_beyond_them_small_laws_hold_to_the_last_digit():
    """Without noise, and with an angle and an output at once."""
    known = [effect("backlash").of(4e-3), effect("stroke-offset").of(2e-3)]
    silent = NoiseComponents(reading=0.0, head=0.0, launch=0.0, launch_sf=0.0, temperature=0.0)
    plan = replace(PLAN, temperatures=(20.0, 60.0), delta0=0.01, resolution=0.0)
    record = accelcal.simulate(plan=plan, noise=silent, seed=1, effects=known, declare=False)
    noisy = accelcal.simulate(plan=plan, noise=QUIET, seed=1, effects=known)
    noise = compared(noisy, 20.0, 0.01).noise
    comparison = compared(record, 20.0, 0.01, noise=noise)
    straight = straightened(comparison, list(map(instance_of, known)))
    assert straight is not None
    again = compared(straight, 20.0, 0.01, noise=noise)
    directions = again.directions(*map(instance_of, known))
    left = again.seen - directions @ np.linalg.lstsq(directions, again.seen)[0]
    assert np.abs(left).max() < 0.02


@pytest.mark.parametrize("seed", range(2))
def test_a_large_loop_in_which_the_head_begins_at_rest_makes_no_outlier(seed):
    """A decay was taken for it, and what that left of the second reading for an outlier."""
    plan = TumblePlan(strokes=4, temperatures=(20.0,), resolution=0.0)
    known = effect("hysteresis").of(2e-3, approach=0.0)
    found = accelcal.discover(accelcal.simulate(plan=plan, seed=seed, effects=[known]))
    assert found.faults == ()
    assert [item.id for item in found.effects] == ["hysteresis"]
    assert found.effects[0].parameters["half_width"].expanded_uncertainty < 1e-5


@pytest.mark.parametrize("level", [20.0, 50.0])
def test_a_record_in_which_no_effect_shows_is_fitted_with_the_sizes_of_the_model(level):
    """Of no effects nothing was stacked, and at T0 the column is zero: errors of numpy."""
    known = effect("k2-temperature").of(3e-6)
    record = accelcal.simulate(plan=TumblePlan(strokes=4), seed=5, effects=[known])
    found = accelcal.discover(record)
    assert [item.id for item in found.effects] == ["k2-temperature"]
    other = accelcal.simulate(plan=replace(PLAN, temperatures=(level,)), seed=6, effects=[known])
    again, bare = accelcal.fit(other, model=found), accelcal.fit(other)
    assert again.effects[0].parameters == found.effects[0].parameters
    k2, as_it_is = (each.tables[0].coefficients["K2"].value for each in (again, bare))
    slope = found.effects[0].parameters["slope"].value
    assert as_it_is - k2 == pytest.approx(1.35 * slope * (level - 20.0), rel=0.05, abs=1e-12)


@pytest.mark.parametrize("size", [3e-3, 1e-2])
def test_a_new_record_agrees_with_a_calibration_that_has_a_large_lag(size):
    """By the law of small ones, readings were predicted that lag without turning the axis."""
    known = [effect("backlash").of(size)]
    old, new = (accelcal.simulate(plan=PLAN, effects=known, seed=seed) for seed in (1, 2))
    calibration = accelcal.fit(old, model=accelcal.discover(old))
    assert accelcal.compare(calibration, new).p_value > 0.01
