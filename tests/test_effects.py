"""The catalogue: its entries, their size and shape at points computed by hand, their columns."""

import copy
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from accelcal.discovery.base import base_model
from accelcal.discovery.comparison import compared
from accelcal.discovery.instance import Instance, candidates, column_of
from accelcal.effects.catalogue import catalogue, effect
from accelcal.effects.conditions import conditions_of
from accelcal.effects.effect import Effect
from accelcal.errors import InputError
from accelcal.simulation import NOISE_FREE, Accelerometer, BilinearLaw, TumblePlan, simulate

IDS = [
    "scale-factor-asymmetry",
    "fourth-order",
    "odd-quadratic",
    "cross-axis-cubic",
    "cross-axis-quadratic",
    "dead-zone",
    "k2-temperature",
    "k3-temperature",
    "bias-temperature-quadratic",
    "scale-factor-temperature-quadratic",
    "break-shift",
    "temperature-hysteresis",
    "chamber-drift",
    "bias-drift",
    "scale-factor-drift",
    "warm-up",
    "bias-step",
    "stroke-offset",
    "hysteresis",
    "foundation-tilt",
    "backlash",
    "fixture-offset",
    "head-eccentricity",
    "position-error",
    "outlier",
    "swapped-positions",
    "quantization",
    "vibration-noise",
]
"""All ids that the list of effects fixes."""

IDEAL = Accelerometer(BilinearLaw(1.0), BilinearLaw(0.0), BilinearLaw(0.0), 0.0, 0.0, 0.0)
WARM = replace(IDEAL, scale_factor=BilinearLaw(2.0, 1e-3, 2e-3), bias=BilinearLaw(0.01, 1e-4, 3e-4))
HALF = math.sqrt(0.5)


def change(name, value, *, unit=IDEAL, plan=None, seed=1, **others):
    """Change of the noise-free readings by one effect, run x stroke x reading of the stroke."""
    plan = plan or TumblePlan(strokes=2)
    disturbed = simulate(unit, plan, NOISE_FREE, [effect(name).of(value, **others)], seed=seed)
    difference = disturbed.output - simulate(unit, plan, NOISE_FREE).output
    return difference.reshape(len(disturbed.run_labels), plan.strokes, -1)


# -- the entries -----------------------------------------------------------------------------------


def test_all_effects_are_there_once():
    assert [entry.id for entry in catalogue()] == IDS


@pytest.mark.parametrize("entry", catalogue(), ids=lambda entry: entry.id)
def test_entry_is_complete(entry):
    texts = (entry.name, entry.physics, entry.formula, entry.signature, entry.to_tell_apart)
    assert all(texts)
    assert entry.physics.endswith(".")
    assert effect(entry.id) is entry
    first, *others = entry.parameters
    assert first.default is None
    assert all(item.default is not None and item.unit and item.meaning for item in others)
    assert not any(item.linear and item.search for item in entry.parameters)


@pytest.mark.parametrize(
    ("wrong", "near"),
    [
        ("warmup", "did you mean warm-up?"),
        ("dead_zone", "did you mean dead-zone?"),
        ("drift", "bias-drift"),
        ("zzz", "it has scale-factor-asymmetry, fourth-order"),
    ],
)
def test_unknown_effect_lists_near_names(wrong, near):
    with pytest.raises(InputError) as caught:
        effect(wrong)
    assert repr(wrong) in str(caught.value)
    assert near in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_first_parameter_has_a_name_too():
    """By its name it was a `TypeError` that `value` is missing."""
    assert effect("warm-up").of(amplitude=1e-4, tau=900) == effect("warm-up").of(1e-4, tau=900)
    with pytest.raises(InputError, match=r"amplitude is given twice, as 0\.0001 and 0\.0002"):
        effect("warm-up").of(1e-4, amplitude=2e-4)


@pytest.mark.parametrize(
    ("name", "value", "others", "message"),
    [
        ("warm-up", 1e-4, {"ta": 3}, "warm-up has no parameter 'ta'; it has amplitude, tau"),
        ("warm-up", None, {"tau": 900}, r"warm-up: amplitude is missing; it is needed \[g\]"),
        ("warm-up", 1e-4, {"tau": 0}, "warm-up: tau is 0; it is 0.001 or more"),
        ("warm-up", math.nan, {}, "warm-up: amplitude is nan; it is a finite number"),
        ("dead-zone", -1e-6, {}, "dead-zone: threshold is -1e-06; it is 0 or more"),
    ],
)
def test_bad_values_are_refused(name, value, others, message):
    with pytest.raises(InputError, match=message):
        effect(name).of(value, **others)


@pytest.mark.parametrize(
    ("name", "others"),
    [
        ("position-error", {"at": 50.0}),
        ("outlier", {"reading": 2.5}),
        ("outlier", {"reading": 55}),
        ("bias-step", {"reading": 1}),
        ("swapped-positions", {"apart": 54}),
    ],
)
def test_values_outside_the_plan_are_refused(name, others):
    with pytest.raises(InputError, match=next(iter(others)) if name != "position-error" else "50"):
        change(name, 3.0, **others)


@pytest.mark.parametrize("name", [name for name in IDS if name != "swapped-positions"])
def test_no_amplitude_leaves_the_readings_bit_identical(name):
    value, others = (25.0, {"slope_change": 0.0}) if name == "break-shift" else (0.0, {})
    none = effect(name).of(value, **others)
    assert np.array_equal(simulate(effects=[none], seed=11).output, simulate(seed=11).output)


# -- shape -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "stroke"),
    [  # at 0, 45, ... 360 deg
        ("scale-factor-asymmetry", [1, HALF, 0, HALF, 1, HALF, 0, HALF, 1]),
        ("fourth-order", [1, 1 / 4, 0, 1 / 4, 1, 1 / 4, 0, 1 / 4, 1]),
        ("odd-quadratic", [1, 1 / 2, 0, -1 / 2, -1, -1 / 2, 0, 1 / 2, 1]),
        ("cross-axis-quadratic", [0, 1 / 2, 1, 1 / 2, 0, 1 / 2, 1, 1 / 2, 0]),
        ("dead-zone", [-1, -1, 0, 1, 1, 1, 0, -1, -1]),
        (
            "cross-axis-cubic",
            [0, HALF / 2, 1, HALF / 2, 0, -HALF / 2, -1, -HALF / 2, 0],
        ),
    ],
)
def test_shape_effects(name, stroke):
    size = 3e-4
    for forward, back in change(name, size):
        np.testing.assert_allclose(forward, size * np.array(stroke), atol=1e-15)
        np.testing.assert_allclose(back, forward[::-1], atol=1e-15)


def test_cross_axis_changes_sign_with_the_side():
    plan = TumblePlan(strokes=1, temperatures=(20.0,), mountings=("o+", "o-"))
    right, left = change("cross-axis-cubic", 1e-4, plan=plan)
    np.testing.assert_allclose(left, -right, atol=1e-15)


def test_dead_zone_swallows_inputs_below_its_threshold():
    plan = TumblePlan(angles=(89.9, 90.1, 60.0), strokes=1, temperatures=(20.0,))
    record = simulate(IDEAL, plan, NOISE_FREE, [effect("dead-zone").of(0.01)])
    np.testing.assert_allclose(record.output, [0.0, 0.0, 0.49], atol=1e-15)


# -- temperature; the default levels are 20, 80, -40 degC at T0 = 20 degC --------------------------


@pytest.mark.parametrize(
    ("name", "at_0_deg", "at_180_deg"),
    [
        ("k2-temperature", [0, 60, -60], [0, 60, -60]),
        ("k3-temperature", [0, 60, -60], [0, -60, 60]),
        ("bias-temperature-quadratic", [0, 3600, 3600], [0, 3600, 3600]),
        ("scale-factor-temperature-quadratic", [0, 3600, 3600], [0, -3600, -3600]),
        ("temperature-hysteresis", [0, 1, -1], [0, 1, -1]),
    ],
)
def test_temperature_effects(name, at_0_deg, at_180_deg):
    size = 1e-7
    by_run = change(name, size)
    np.testing.assert_allclose(by_run[:, 0, 0], size * np.array(at_0_deg), atol=1e-15)
    np.testing.assert_allclose(by_run[:, 1, 4], size * np.array(at_180_deg), atol=1e-15)


def test_quadratic_scale_factor_is_that_of_its_law():
    """Y = K1N (1 + beta dT + c dT^2) (k0 + a_i), with the k0 of the temperature."""
    c = 1e-6
    by_run = change("scale-factor-temperature-quadratic", c, unit=WARM)
    bias = np.array([0.01, 0.01 + 60e-4, 0.01 - 180e-4])
    expected = 2.0 * c * np.array([0, 3600, 3600]) * (1 + bias)
    np.testing.assert_allclose(by_run[:, 0, 0], expected, atol=1e-15)


@pytest.mark.parametrize("shift", [15.0, -15.0])
def test_break_shift_moves_the_break(shift):
    unit = replace(IDEAL, bias=BilinearLaw(0.01, above=1e-4, below=3e-4))
    levels = (20.0, 80.0, 40.0, 25.0, 15.0, 0.0, -40.0)
    plan = TumblePlan(angles=(90.0,), strokes=1, temperatures=levels)
    moved = effect("break-shift").of(shift, slope_change=1e-4 - 3e-4)
    output = simulate(unit, plan, NOISE_FREE, [moved]).output

    def law(dT):
        """Two straight lines that meet at the shifted break, and 0.01 at T0."""
        at_break = 0.01 + (3e-4 if shift > 0 else 1e-4) * shift
        return at_break + (1e-4 if dT > shift else 3e-4) * (dT - shift)

    np.testing.assert_allclose(output, [law(level - 20.0) for level in levels], atol=1e-15)


def test_break_shift_default_is_the_break_of_the_al15():
    assert effect("break-shift").of(10.0).values["slope_change"] == pytest.approx(-3.9e-5 + 4.5e-5)


def test_temperature_hysteresis_knows_the_way_to_a_level():
    plan = TumblePlan(strokes=1, temperatures=(20.0, 80.0, 79.0, 20.0, -40.0, 20.0))
    by_run = change("temperature-hysteresis", 1e-4, plan=plan)[:, 0, 0]
    np.testing.assert_allclose(by_run, [0, 1e-4, 1e-4, -1e-4, -1e-4, 1e-4], atol=1e-15)


def test_chamber_drift_acts_through_the_laws_of_the_accelerometer():
    """One degC/h; the last of 18 readings a minute apart is 17/60 degC warmer."""
    by_run = change("chamber-drift", 1.0, unit=WARM)
    warmer = 17 / 60
    hot = 2.0 * (1 + 1e-3 * (60 + warmer)) * (0.01 + 1e-4 * (60 + warmer) + 1)
    nominal = 2.0 * (1 + 1e-3 * 60) * (0.01 + 1e-4 * 60 + 1)
    assert by_run[1, 1, -1] == pytest.approx(hot - nominal, abs=1e-15)
    assert by_run[:, 0, 0].tolist() == [0.0, 0.0, 0.0]


# -- time and history; readings are 60 s apart, runs start 18 min + 1 h after one another ----------


def test_drifts():
    start = (18 * 60 + 3600) / 3600  # h
    bias = change("bias-drift", 1e-5)
    np.testing.assert_allclose(bias[:, 0, 0], 1e-5 * start * np.arange(3), atol=1e-15)
    assert bias[0, 1, -1] == pytest.approx(1e-5 * 17 / 60, abs=1e-15)
    scale = change("scale-factor-drift", 1e-5, unit=replace(IDEAL, bias=BilinearLaw(0.5)))
    assert scale[1, 0, 0] == pytest.approx(1e-5 * start * 1.5, abs=1e-15)
    assert scale[1, 0, 4] == pytest.approx(1e-5 * (start + 4 / 60) * -0.5, abs=1e-15)


def test_warm_up_starts_afresh_in_each_run():
    by_run = change("warm-up", 1e-4, tau=300.0)
    np.testing.assert_allclose(by_run[:, 0, 0], 1e-4, atol=1e-15)
    np.testing.assert_allclose(by_run[:, 0, 5], 1e-4 / math.e, atol=1e-15)


def test_bias_step():
    np.testing.assert_allclose(
        change("bias-step", 1e-4, reading=20).ravel(),
        np.where(np.arange(54) < 19, 0, 1e-4),
        atol=1e-15,
    )
    assert np.count_nonzero(np.abs(change("bias-step", 1e-4)) > 1e-5) == 27


def test_stroke_offset_is_forward_minus_back():
    for forward, back in change("stroke-offset", 1e-4):
        np.testing.assert_allclose(forward, 0.5e-4, atol=1e-15)
        np.testing.assert_allclose(back, -0.5e-4, atol=1e-15)


def test_hysteresis_lags_by_the_last_change_of_the_input():
    for forward, back in change("hysteresis", 1e-4):
        # falling a_i leaves the output high; at 360 deg the back stroke repeats the last position
        np.testing.assert_allclose(forward, 1e-4 * np.array([-1, 1, 1, 1, 1, -1, -1, -1, -1]))
        np.testing.assert_allclose(back, 1e-4 * np.array([-1, 1, 1, 1, 1, -1, -1, -1, -1]))


@pytest.mark.parametrize("tilt", [0.0, 1e-3])
def test_hysteresis_of_a_run_with_two_positions_passes_the_extremes_between_them(tilt):
    """Readings at 90 and 270 deg alone tell no cosine: their wave was that of the tilt."""
    plan = TumblePlan(temperatures=(20.0, 20.0))
    whole = simulate(plan=plan, seed=1)
    across = np.isin(whole.angle % 360.0, (90.0, 270.0))
    record = whole.select((whole.run == 0) | across)
    c = conditions_of(record, 20.0)
    c = replace(c, axial=c.axial + tilt * np.sin(np.radians(c.angle)))
    lag = effect("hysteresis").columns(c, approach=1.0)[:, 0]
    own = np.isin(record.angle % 360.0, (90.0, 270.0))
    np.testing.assert_allclose(lag[own & (record.run == 1)], lag[own & (record.run == 0)])


def test_hysteresis_starts_afresh_in_each_run():
    """Each run comes to 60 deg from 45 deg before it, whatever the position that ended the last."""
    plan = TumblePlan(angles=(60.0, 120.0), strokes=1)
    np.testing.assert_allclose(change("hysteresis", 1e-4, plan=plan), 1e-4)


@pytest.mark.parametrize(
    ("delta0", "half_width", "most"),
    [(0.0, 1e-5, 1e-6), (0.0, 4e-5, 1e-6), (0.0, 1e-3, 1e-9), (0.02, 1e-5, 1e-9)],
)
def test_the_column_of_a_hysteresis_is_that_of_usual_widths(delta0, half_width, most):
    """Beside the misalignment a falls by less than 1 ug from its extremes, and no more is off.

    The column was that of a play of 10 ug: 2.5 ug of 40 were left, and no name was found.
    """
    c = base_model(simulate(plan=TumblePlan(delta0=delta0), noise=NOISE_FREE), 20.0).conditions
    column = effect("hysteresis").columns(c)[:, 0]
    lag = effect("hysteresis").of(half_width).change(c)
    np.testing.assert_allclose(half_width * column, lag, rtol=0, atol=most)


def test_hysteresis_begins_as_the_head_comes_to_the_first_position():
    forward, at_rest, back = (
        change("hysteresis", 1e-4, approach=approach) for approach in (1.0, 0.0, -1.0)
    )
    np.testing.assert_array_equal(back, forward)  # a_i rises to 0 deg from either side
    np.testing.assert_allclose(at_rest[:, 0, 0], 0.0, atol=1e-15)
    np.testing.assert_allclose(forward[:, 0, 0], -1e-4)
    np.testing.assert_array_equal(at_rest[:, 1:], forward[:, 1:])
    np.testing.assert_array_equal(at_rest[:, 0, 1:], forward[:, 0, 1:])


def test_only_what_tells_ways_to_the_first_position_apart_is_tried():
    (approach,) = effect("hysteresis").shapes
    record = simulate(noise=NOISE_FREE)
    of_the_turn = conditions_of(record, 20.0)
    assert approach.search(of_the_turn).tolist() == [0.0, 1.0]
    from_45_deg = conditions_of(record.select(record.position > 1), 20.0)
    assert approach.search(from_45_deg).tolist() == [-1.0, 0.0, 1.0]


def test_an_approach_is_one_of_three():
    for wrong in (0.5, 2.0):
        with pytest.raises(InputError, match=r"approach is .*; "):
            change("hysteresis", 1e-4, approach=wrong)


def test_hysteresis_turns_where_the_head_passes_the_extremes():
    """0 and 180 deg lie between the positions: a_i is the same before and behind them."""
    plan = TumblePlan(angles=(22.5, 157.5, 202.5, 337.5, 382.5), strokes=2)
    for forward, back in change("hysteresis", 1e-4, plan=plan):
        np.testing.assert_allclose(forward, 1e-4 * np.array([1, 1, -1, -1, 1]))
        np.testing.assert_allclose(back, 1e-4 * np.array([1, 1, 1, -1, -1]))


def test_hysteresis_of_a_reading_is_the_same_whichever_others_are_missing():
    record = simulate(IDEAL, TumblePlan(strokes=6), NOISE_FREE)
    whole = effect("hysteresis").of(1e-4).change(conditions_of(record, 20.0))
    rng = np.random.default_rng(4)
    for _ in range(20):
        kept = rng.random(len(record)) > 0.3
        rest = effect("hysteresis").of(1e-4).change(conditions_of(record.select(kept), 20.0))
        np.testing.assert_allclose(rest, whole[kept], atol=1e-15)


def test_play_follows_only_beyond_its_width():
    plan = TumblePlan(angles=(0.0, 5.0, 60.0), strokes=1, temperatures=(20.0,))
    lag = change("hysteresis", 0.01, plan=plan)[0, 0]
    at_rest = 1.0 - 0.01  # after coming up to 0 deg
    np.testing.assert_allclose(lag, [-0.01, at_rest - math.cos(math.radians(5)), 0.01], atol=1e-15)


def test_foundation_tilt_turns_the_vertical():
    rate = change("foundation-tilt", 1e-5)[1]
    t = (18 * 60 + 3600 + 2 * 60) / 3600  # h, second run, third reading, at 90 deg
    assert rate[0, 2] == pytest.approx(-math.sin(1e-5 * t), abs=1e-15)
    daily = change("foundation-tilt", 0.0, sine=1e-5, cosine=2e-5)[1]
    angle = 1e-5 * math.sin(2 * math.pi * t / 24) + 2e-5 * math.cos(2 * math.pi * t / 24)
    assert daily[0, 2] == pytest.approx(-math.sin(angle), abs=1e-15)


# -- the stand -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "others", "turned"),
    [
        ("fixture-offset", {}, lambda _th, _sense: 1),
        ("backlash", {}, lambda _th, sense: -sense),
        ("head-eccentricity", {}, lambda th, _sense: math.sin(th)),
        ("head-eccentricity", {"cosine": 1e-3}, lambda th, _sense: math.sin(th) + math.cos(th)),
        ("position-error", {"at": 135}, lambda th, _sense: math.isclose(th, math.radians(135))),
        ("position-error", {"at": 360}, lambda th, _sense: th in (0, 2 * math.pi)),
    ],
)
def test_stand_effects_turn_the_head(name, others, turned):
    size = 1e-3
    by_stroke = change(name, size, **others)[0]
    for sense, stroke in ((1, by_stroke[0]), (-1, by_stroke[1][::-1])):
        for degrees, found in zip(range(0, 361, 45), stroke, strict=True):
            th = math.radians(degrees)
            expected = math.cos(th + size * turned(th, sense)) - math.cos(th)
            assert found == pytest.approx(expected, abs=1e-15)


def test_fixture_offset_is_delta0():
    plan = TumblePlan(mountings=("o+", "p-"))
    turned = simulate(plan=plan, noise=NOISE_FREE, effects=[effect("fixture-offset").of(1e-3)])
    given = simulate(plan=replace(plan, delta0=1e-3), noise=NOISE_FREE)
    np.testing.assert_allclose(turned.output, given.output, atol=1e-15)


# -- the readings ----------------------------------------------------------------------------------


def test_outlier_is_in_one_reading():
    found = change("outlier", 1e-3, reading=30, unit=WARM).ravel()
    assert np.flatnonzero(np.abs(found) > 1e-12).tolist() == [29]
    assert found[29] == pytest.approx(2e-3)  # K1 at T0 is 2
    drawn = {int(np.argmax(change("outlier", 1e-3, seed=seed))) for seed in range(8)}
    assert len(drawn) > 4


def test_swapped_positions():
    plan = TumblePlan()
    base = simulate(plan=plan, seed=2).output
    swapped = effect("swapped-positions")
    found = simulate(plan=plan, effects=[swapped.of(12, apart=3)], seed=2).output
    expected = base.copy()
    expected[[11, 14]] = expected[[14, 11]]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)


def test_quantization():
    record = simulate(effects=[effect("quantization").of(1e-3)], seed=2)
    steps = record.output / (1e-3 * 1.35)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert np.abs(record.output - simulate(seed=2).output).max() <= 0.5e-3 * 1.35


def test_vibration_noise_grows_with_the_cross_axis():
    plan = TumblePlan(strokes=200, temperatures=(20.0,))
    noise = change("vibration-noise", 1e-4, plan=plan)[0]
    noise[1::2] = noise[1::2, ::-1]
    assert np.abs(noise[:, [0, 4, 8]]).max() < 1e-15
    # standard deviation of 200 readings: within 5 standard errors, 1 / sqrt(2 * 200) each
    np.testing.assert_allclose(noise[:, 2].std(), 1e-4, rtol=5 / 20)
    np.testing.assert_allclose(noise[:, 3].std(), HALF * 1e-4, rtol=5 / 20)


# -- columns ---------------------------------------------------------------------------------------

LINEAR = [entry for entry in catalogue() if entry.amplitudes]


@pytest.mark.parametrize("entry", LINEAR, ids=lambda entry: entry.id)
def test_columns_are_the_derivatives_of_the_simulation(entry):
    unit = replace(IDEAL, bias=BilinearLaw(0.0, 1e-4, 1e-4))
    plan = TumblePlan(strokes=2, mountings=("o+", "p-"))
    base = simulate(unit, replace(plan, timed=True), NOISE_FREE)
    conditions = conditions_of(base, 20.0)
    known = {"indicated": base.output, "per_degree": np.full(len(base), 1e-4)}
    conditions = replace(conditions, **known)
    tried = {item.name: item.search(conditions) for item in entry.shapes}
    shape = {name: float(values[min(2, values.size - 1)]) for name, values in tried.items()}
    columns = entry.columns(conditions, **shape)
    assert columns.shape == (len(base), len(entry.amplitudes))
    assert np.abs(columns).max() > 0
    step = 1e-7
    for item, column in zip(entry.amplitudes, columns.T, strict=True):
        others = dict.fromkeys((name.name for name in entry.amplitudes), 0.0) | shape
        values = others | {item.name: step}
        first = values.pop(entry.parameters[0].name)
        found = simulate(unit, plan, NOISE_FREE, [entry.of(first, **values)]).output - base.output
        scale = max(1.0, np.abs(column).max())
        np.testing.assert_allclose(found / step, column, rtol=0, atol=2e-6 * scale)


ALLOWED = {entry.id: 1e-6 for entry in LINEAR}
"""Part by which a column may miss the simulation."""
ALLOWED |= {entry.id: 5e-3 for entry in LINEAR if entry.acts_on == "angle"}  # delta is left out
# these two do not come through the gain, which makes up for a K1 that is not quite that at T0
ALLOWED |= {"scale-factor-temperature-quadratic": 2e-3, "outlier": 2e-3}


@pytest.mark.parametrize("levels", [(20.0,), (20.0, 80.0, -40.0)], ids=len)
@pytest.mark.parametrize("entry", LINEAR, ids=lambda entry: entry.id)
def test_columns_of_discovery_are_the_derivatives_of_the_simulation(entry, levels):
    """At the conditions that are fitted to the readings of an AL-15, with all it has."""
    if entry.id == "chamber-drift" and len(levels) == 1:
        pytest.skip("one level does not tell what a temperature does")
    plan = TumblePlan(strokes=4, temperatures=levels, resolution=0.0, timed=True)
    base = simulate(plan=plan, noise=NOISE_FREE)
    model = base_model(base, 20.0)
    shape = {item.name: item.search(model.conditions) for item in entry.shapes}
    shape = {name: float(values[values.size // 2]) for name, values in shape.items()}
    # a fault of a reading does not come through the scale factor of its temperature
    gain = model.conditions.gain if entry.acts_on == "readings" else 1.0
    for number, item in enumerate(entry.amplitudes):
        mixture = tuple(np.eye(len(entry.amplitudes))[number])
        column = column_of(Instance(entry, mixture, shape), model.conditions) / gain
        # a play is not linear until it is wider than what a falls by beside its extremes
        narrow = 1e-7 / (np.abs(column).max() or 1.0)
        step = item.small_at(model.conditions) if entry.id == "hysteresis" else narrow
        none = {name.name: 0.0 for name in entry.amplitudes}
        values = none | shape | {item.name: step}
        given = entry.of(values.pop(entry.parameters[0].name), **values)
        found = simulate(plan=plan, noise=NOISE_FREE, effects=[given]).output - base.output
        np.testing.assert_allclose(
            found / model.nominal, column * step, rtol=0, atol=1e-7 * ALLOWED[entry.id]
        )


@pytest.mark.parametrize("entry", LINEAR, ids=lambda entry: entry.id)
def test_columns_follow_the_readings_into_another_order(entry):
    record = simulate(plan=TumblePlan(strokes=3), seed=1)
    shuffled = np.random.default_rng(1).permutation(len(record))
    mixed = replace(
        record,
        **{
            name: getattr(record, name)[shuffled]
            for name in (
                "output",
                "angle",
                "temperature",
                "stroke",
                "run",
                "mounting",
                "position",
            )
        },
    )
    plain, moved = (conditions_of(item, 20.0) for item in (record, mixed))
    assert plain.number.tolist() == list(range(1, len(record) + 1))
    shape = {item.name: float(item.search(plain)[1]) for item in entry.shapes}
    np.testing.assert_array_equal(
        entry.columns(moved, **shape), entry.columns(plain, **shape)[shuffled]
    )


@pytest.mark.parametrize("entry", catalogue(), ids=lambda entry: entry.id)
def test_search_covers_values_that_the_term_takes(entry):
    conditions = conditions_of(simulate(seed=1), 20.0)
    for item in entry.shapes:
        values = item.search(conditions)
        assert values.size >= (2 if item.name == "approach" else 5)
        assert (np.diff(values) > 0).all()
        for value in values[[0, -1]]:
            others = {name.name: 1.0 for name in entry.parameters}
            column = entry.term(conditions, **(others | {item.name: item.checked(value)}))
            assert np.isfinite(column).all()


@pytest.mark.parametrize("seconds", [5.0, 60.0, 600.0])
def test_warm_up_is_searched_from_half_an_interval_to_ten_whole_runs(seconds):
    plan = TumblePlan(strokes=6, seconds_per_reading=seconds, timed=True)
    conditions = conditions_of(simulate(plan=plan, seed=1), 20.0)
    (tau,) = effect("warm-up").shapes
    values = tau.search(conditions)
    assert values[[0, -1]] == pytest.approx([seconds / 2, 530 * seconds])
    assert (values[1:] / values[:-1]).max() < 2.0


@pytest.mark.parametrize(
    ("name", "levels", "draw"),
    [
        ("warm-up", (20, 80, -40), lambda u: 30.0 * 70.0**u),
        ("break-shift", (20, 80, 50, -10, -40), lambda u: -60.0 + 120.0 * u),
        ("break-shift", (20, 25, 80, 15, -40), lambda u: -60.0 + 120.0 * u),
        ("break-shift", (20, 22.5, 25, 30, 80, 17, 10, -40), lambda u: -60.0 + 120.0 * u),
    ],
)
def test_a_value_off_the_grid_is_nearly_one_of_the_grid(name, levels, draw):
    """What is searched first leaves less than 0.5 % of an effect, so that none is passed over."""
    plan = TumblePlan(strokes=4, temperatures=levels, timed=True)
    seen = compared(simulate(plan=plan, seed=1), 20.0, 0.0)
    conditions, entry = seen.model.conditions, effect(name)
    tried = candidates([entry], seen.space, conditions).directions
    for place in np.random.default_rng(1).uniform(size=40):
        shape = {entry.shapes[0].name: draw(float(place))}
        true = seen.directions(Instance(entry, (1.0,), shape))
        assert np.abs(tried.T @ true).max() > 0.995


def test_no_break_is_searched_where_there_is_one_level():
    plan = TumblePlan(temperatures=(50.0,))
    seen = compared(simulate(plan=plan, seed=1), 20.0, 0.0)
    found = candidates(
        [effect("break-shift"), effect("chamber-drift")], seen.space, seen.model.conditions
    )
    assert [entry.id for entry in found.hidden] == ["break-shift", "chamber-drift"]


def test_effects_without_amplitude_have_no_columns():
    conditions = conditions_of(simulate(seed=1), 20.0)
    without = [entry for entry in catalogue() if not entry.amplitudes]
    assert [entry.id for entry in without] == IDS[-3:]
    assert all(entry.columns(conditions).shape == (len(conditions.angle), 0) for entry in without)


def test_unknown_temperature_counts_as_the_reference():
    record = simulate(plan=TumblePlan(temperatures=(20.0,)), seed=1)
    unknown = replace(record, temperature=np.full(len(record), np.nan))
    assert not conditions_of(unknown, 20.0).excess.any()


# -- pickles ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("entry", catalogue(), ids=IDS)
def test_an_entry_of_the_catalogue_pickles_by_its_id(entry):
    assert pickle.loads(pickle.dumps(entry)) is entry
    assert copy.deepcopy(entry) is entry


def test_a_disturbance_pickles():
    given = effect("warm-up").of(1e-4, tau=900)
    assert pickle.loads(pickle.dumps(given)) == given


def test_an_effect_of_the_user_pickles_with_its_module_level_term():
    own = replace(effect("warm-up"), id="own", parameters=(), term=math.sin)
    again = pickle.loads(pickle.dumps(own))
    assert isinstance(again, Effect)
    assert again == own
    assert again is not own


def test_times_in_days_are_refused_where_effects_follow_them():
    """discover spoke of a time constant that nobody had given."""
    record = simulate(plan=TumblePlan(timed=True), seed=1)
    in_days = replace(record, time=record.time / 86400.0)
    with pytest.raises(InputError, match=r"162 readings in 0\.\d+ s, .* time \[d\]"):
        conditions_of(in_days, 20.0)
