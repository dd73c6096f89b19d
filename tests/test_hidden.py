"""The generator of hidden tables makes readings as the physics of each effect says."""

import ast
import csv
import math
import sys
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hidden.cases import draw, kinds
from hidden.catalogue import CATALOGUE, DATA_FAULTS
from hidden.clock import session
from hidden.design import DESIGNS, Design
from hidden.memory import play
from hidden.noise import REGIMES, RESOLUTION, SIGMA
from hidden.sensor import Law, Sensor
from hidden.strangers import STRANGERS, is_outside
from hidden.visibility import noncentrality

from accelcal.effects.catalogue import catalogue

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"

IDS = tuple(entry.id for entry in catalogue())


@cache
def hidden(kind, design="three", regime="iid", s=4.0, seed=1):
    return draw(kind, np.random.default_rng(seed), DESIGNS[design], regime, s)


def effect_in_g(kind, design="three", **options):
    """Case, table and effect, which is free of the gain's change with temperature [g]."""
    case, table = hidden(kind, design, **options)
    gain = table.world.sensor.gain(table.session.level - 20.0)[table.session.read]
    return case.truth[kind], table, table.effect / table.scale / gain


def forward_minus_back(table, effect, angle):
    at = table.angle == angle
    return effect[at & (table.stroke % 2 == 1)].mean() - effect[at & (table.stroke % 2 == 0)].mean()


# -- independence ----------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted((BENCHMARKS / "hidden").glob("*.py")), ids=lambda p: p.name)
def test_shares_no_code(path):
    rooms = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            rooms |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            rooms.add(node.module.split(".")[0])
    assert rooms <= {"numpy", "hidden"} | sys.stdlib_module_names
    assert "importlib" not in rooms


def test_every_catalogued_id_can_be_hidden():
    assert sorted(CATALOGUE) == sorted(IDS)
    assert len(STRANGERS) >= 8
    assert not set(STRANGERS) & set(IDS)


# -- the plan --------------------------------------------------------------------------------------


def test_sequence_is_that_of_the_paper():
    plan = DESIGNS["three"].sequence
    assert plan.position[:18].tolist() == [*range(1, 10), *range(9, 0, -1)]
    assert plan.stroke[:27].tolist() == [1] * 9 + [2] * 9 + [3] * 9
    assert plan.angle[8] == 360.0
    assert [plan.level[run * 54] for run in range(3)] == [20.0, 80.0, -40.0]
    assert len(plan.run) == 162
    assert len(DESIGNS["loop"].sequence.run) == 432
    assert len(DESIGNS["twenty-four"].sequence.run) == 450


def test_designs_differ_in_what_is_asked():
    designs = DESIGNS.values()
    assert {design.positions for design in designs} == {8, 12, 24}
    assert {1, 3, 5, 8, 10} == {len(design.temperatures) for design in designs}
    for fact in ("time", "declared", "actual_temperature", "angles"):
        assert {getattr(design, fact) for design in designs} == {True, False}


def test_clock_goes_on_and_soaks_between_runs():
    _, table = hidden("none")
    gaps = np.diff(table.time)
    assert table.time[0] == 0.0
    assert (gaps > 15.0).all()
    assert np.flatnonzero(gaps > 4000.0).tolist() == [53, 107]


# -- a clean table ---------------------------------------------------------------------------------


def by_hand(table, row):
    sensor, warmer = table.world.sensor, table.temperature[row] - 20.0
    slope = "above" if warmer > 0 else "below"
    k0, gain, delta = (
        law.at + getattr(law, slope) * warmer for law in (sensor.bias, sensor.gain, sensor.delta)
    )
    a, p = (part(math.radians(table.angle[row])) for part in (math.cos, math.sin))
    answer = k0 + a + sensor.k2 * a**2 + sensor.k3 * a**3 + delta * p + sensor.cross * a * p
    return sensor.scale * gain * answer


@pytest.mark.parametrize("design", DESIGNS)
def test_clean_table_is_the_formula_by_hand(design):
    _, table = hidden("none", design)
    expected = [by_hand(table, row) for row in range(len(table.output))]
    np.testing.assert_allclose(table.clean, expected, rtol=1e-12)
    np.testing.assert_array_equal(table.affected, table.clean)
    assert np.abs(table.output - expected).max() < 5 * table.sigma


def test_coefficients_are_about_those_of_al15():
    sensors = [hidden("none", "one", seed=seed)[1].world.sensor for seed in range(60)]
    assert abs(np.mean([sensor.k2 for sensor in sensors]) - 105e-6) < 15e-6
    assert abs(np.mean([abs(sensor.bias.at) for sensor in sensors]) - 3.3e-3) < 5e-4
    assert abs(np.mean([sensor.gain.above for sensor in sensors]) - 520e-6) < 60e-6
    assert all(1.25 <= sensor.scale <= 1.35 for sensor in sensors)


# -- memory ----------------------------------------------------------------------------------------


def test_play_remembers():
    path = play(np.array([0.5, 1.5, 3.0, 2.5, 1.0, 0.0, 1.9]), 1.0, 0.0)
    assert path.tolist() == [0.0, 0.5, 2.0, 2.0, 2.0, 1.0, 1.0]


def test_hysteresis_is_the_same_wherever_the_axis_turns():
    truth, table, effect = effect_in_g("hysteresis")
    at_45, at_90, at_270 = (forward_minus_back(table, effect, angle) for angle in (45, 90, 270))
    assert at_45 / at_90 == pytest.approx(1.0, abs=1e-6)
    assert at_270 == pytest.approx(-at_90, rel=1e-6)
    assert at_90 == pytest.approx(2 * truth["slack"], rel=1e-6)  # falls forwards: stays above
    assert forward_minus_back(table, effect, 0.0) == pytest.approx(0.0, abs=1e-12)


def test_backlash_goes_by_the_sine():
    truth, table, effect = effect_in_g("backlash")
    at_45, at_90 = (forward_minus_back(table, effect, angle) for angle in (45, 90))
    assert at_45 / at_90 == pytest.approx(math.sqrt(0.5), abs=3e-3)  # but for the misalignment
    assert at_90 == pytest.approx(truth["backlash"], rel=1e-3)  # the head is behind: a_i above
    assert effect[table.angle == 180.0] == pytest.approx(0.0, abs=1e-7)


def test_each_run_is_approached_forwards():
    truth, table, _ = effect_in_g("backlash")
    world = table.world.having("stand", **truth)
    behind = (table.session.angle - world.stand.angle(table.session))[table.session.read]
    # on the way back the worm first takes up its slack: the turning point is still as it was
    forward = (table.stroke % 2 == 1) | (table.position == 9)
    again = (table.stroke > 1) & (table.stroke % 2 == 1) & (table.position == 1)
    expected = np.where(forward & ~again, 0.5, -0.5) * truth["backlash"]
    np.testing.assert_allclose(behind, expected, atol=1e-12)


def test_temperature_hysteresis_knows_from_where_a_level_was_reached():
    truth, table, effect = effect_in_g("temperature-hysteresis", "loop")
    of_run = [effect[table.run == run] / truth["thermal_lag"] for run in range(1, 9)]
    start = truth["thermal_start"]
    for effects, expected in zip(of_run, [start, 1, 1, -1, -1, -1, -1, 1], strict=True):
        assert effects == pytest.approx(expected, abs=1e-6)


# -- shape -----------------------------------------------------------------------------------------


def test_asymmetry_is_a_ratio_of_scale_factors():
    truth, table, effect = effect_in_g("scale-factor-asymmetry", "twelve")
    along = np.cos(np.deg2rad(table.angle))
    up, down = along > 0.1, along < -0.1
    assert effect[up] / along[up] == pytest.approx(truth["asymmetry"] / 2, rel=1e-4)
    assert effect[down] / along[down] == pytest.approx(-truth["asymmetry"] / 2, rel=1e-4)


@pytest.mark.parametrize(
    ("kind", "shares"),  # at 0, 30, 90, 180, 270 deg
    [
        ("fourth-order", (1, 9 / 16, 0, 1, 0)),
        ("odd-quadratic", (1, 3 / 4, 0, -1, 0)),
        ("cross-axis-cubic", (0, 1 / 8, 1, 0, -1)),
        ("cross-axis-quadratic", (0, 1 / 4, 1, 0, 1)),
    ],
)
def test_shape(kind, shares):
    truth, table, effect = effect_in_g(kind, "twelve")
    (size,) = truth.values()
    for angle, share in zip((0, 30, 90, 180, 270), shares, strict=True):
        assert effect[table.angle == angle] / size == pytest.approx(share, abs=1e-6)


def test_dead_zone_holds_small_forces_and_shortens_others():
    taken = session(Design(temperatures=(20.0,)), np.random.default_rng(1))
    sensor = Sensor(1.3, Law(1.0), Law(0.0), Law(0.0), dead_zone=1e-3)
    force = np.resize([0.0, 5e-4, -9e-4, 2e-3, -2e-3, 1.0], len(taken.angle))
    current = sensor.current(taken, np.arccos(force), np.full_like(force, 20.0))
    expected = np.resize([0.0, 0.0, 0.0, 1.3e-3, -1.3e-3, 1.3 * 0.999], len(force))
    np.testing.assert_allclose(current, expected, atol=1e-15)


def test_dead_zone_of_a_misaligned_unit_shows_at_zero_g():
    truth, table, effect = effect_in_g("dead-zone")
    lean = np.sign(table.world.sensor.delta.at)
    assert effect[table.angle == 90] == pytest.approx(-lean * truth["dead_zone"], rel=1e-6)
    assert effect[table.angle == 270] == pytest.approx(lean * truth["dead_zone"], rel=1e-6)
    assert effect[table.angle == 0] == pytest.approx(-truth["dead_zone"], rel=1e-6)


# -- temperature -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "power"),
    [
        ("k2-temperature", 1),
        ("k3-temperature", 1),
        ("bias-temperature-quadratic", 2),
    ],
)
def test_grows_with_temperature(kind, power):
    truth, table, effect = effect_in_g(kind, "loop")
    (size,) = truth.values()
    at = table.angle == 0
    assert effect[at] == pytest.approx(size * (table.temperature[at] - 20.0) ** power, abs=1e-10)


def test_quadratic_gain_multiplies_the_output():
    case, table = hidden("scale-factor-temperature-quadratic", "loop")
    warmer = table.temperature - 20.0
    gain = table.world.sensor.gain(table.session.level - 20.0)[table.session.read]
    size = case.truth["scale-factor-temperature-quadratic"]["square"]
    np.testing.assert_allclose(
        table.effect, table.clean / gain * size * warmer**2, rtol=1e-7, atol=1e-14
    )


def test_break_shift_moves_the_bend_and_no_slope():
    for seed in range(6):
        truth, table, effect = effect_in_g("break-shift", "ten", seed=seed)
        bend, warmer = truth["bend"], table.temperature - 20.0
        beyond = np.clip(warmer, min(bend, 0.0), max(bend, 0.0))
        expected = math.copysign(truth["contrast"], truth["contrast"] * bend) * beyond
        assert effect == pytest.approx(expected, abs=1e-10)
        assert effect[warmer == 0.0] == pytest.approx(0.0, abs=1e-12)


def test_chamber_drift_is_not_recorded_and_starts_with_the_run():
    truth, table, effect = effect_in_g("chamber-drift")
    first = table.run != np.concatenate([[0], table.run[:-1]])
    assert effect[first] == pytest.approx(0.0, abs=1e-12)
    assert set(table.temperature) == {20.0, 80.0, -40.0}
    in_run = table.session.in_run[table.session.read]
    sensor, warm = table.world.sensor, table.run == 2
    angle = np.deg2rad(table.angle)
    per_degree = sensor.bias.above + sensor.delta.above * np.sin(angle)
    per_degree = per_degree + sensor.gain.above * np.cos(angle)
    shown = (effect / truth["drift"] / np.maximum(in_run, 1.0))[warm & ~first]
    assert shown == pytest.approx(per_degree[warm & ~first], rel=0.1, abs=3e-6)


def test_recorded_temperatures_follow_the_chamber_but_not_the_drift():
    _, table = hidden("chamber-drift", "loop-actual")
    level = table.design.sequence.level
    np.testing.assert_array_equal(table.temperature, table.actual_temperature)
    assert 0.01 < np.abs(table.temperature - level).max() < 2.0
    np.testing.assert_array_equal(table.temperature, hidden("none", "loop-actual")[1].temperature)


# -- time and history ------------------------------------------------------------------------------


def test_drifts_go_by_the_clock():
    truth, table, effect = effect_in_g("bias-drift", "loop")
    np.testing.assert_allclose(effect, truth["bias_rate"] * table.time, atol=1e-11)
    case, table = hidden("scale-factor-drift", "loop")
    rate = case.truth["scale-factor-drift"]["gain_rate"]
    np.testing.assert_allclose(table.effect, table.clean * rate * table.time, atol=1e-11)


def test_warm_up_dies_away_from_the_start_of_each_run():
    truth, table, effect = effect_in_g("warm-up")
    for run in (1, 2, 3):
        at = table.run == run
        since = table.time[at] - table.time[at][0]
        expected = truth["warm_up"] * np.exp(-since / truth["warm_up_time"])
        np.testing.assert_allclose(effect[at], expected, atol=1e-11)


def test_bias_step_is_one_jump():
    truth, table, effect = effect_in_g("bias-step")
    after = table.time >= truth["step_time"]
    assert effect[after] == pytest.approx(truth["step"], rel=1e-6)
    assert effect[~after] == pytest.approx(0.0, abs=1e-12)
    run = table.run[np.flatnonzero(after)[0]]
    assert set(after[table.run == run]) == {True, False}, "inside a run"


def test_stroke_offset_is_the_same_at_all_positions():
    truth, table, effect = effect_in_g("stroke-offset")
    expected = np.where(table.stroke % 2 == 1, 0.5, -0.5) * truth["stroke_offset"]
    np.testing.assert_allclose(effect, expected, atol=1e-11)


@pytest.mark.parametrize("seed", range(6))
def test_foundation_tilt_turns_the_vertical(seed):
    truth, table, effect = effect_in_g("foundation-tilt", "loop", seed=seed)
    if "tilt_rate" in truth:
        tilt = truth["tilt_rate"] * table.time
    else:
        day = 2 * np.pi * table.time / 86400.0 + truth["tilt_phase"]
        tilt = truth["tilt_daily"] * (np.sin(day) - np.sin(truth["tilt_phase"]))
    np.testing.assert_allclose(effect, np.sin(np.deg2rad(table.angle)) * tilt, atol=1e-7)


# -- the stand -------------------------------------------------------------------------------------


def test_fixture_and_eccentricity_are_angles():
    truth, table, effect = effect_in_g("fixture-offset")
    across = np.sin(np.deg2rad(table.angle))
    np.testing.assert_allclose(effect, -across * truth["fixture"], atol=1e-7)
    truth, table, effect = effect_in_g("head-eccentricity", "twelve")
    angle = np.deg2rad(table.angle)
    error = truth["eccentricity"] * np.sin(angle + truth["eccentricity_phase"])
    np.testing.assert_allclose(effect, -np.sin(angle) * error, atol=1e-7)


def test_position_error_is_at_one_position_in_all_strokes():
    truth, table, effect = effect_in_g("position-error")
    at = table.position == truth["wrong_position"]
    across = np.sin(np.deg2rad(table.angle[at]))
    np.testing.assert_allclose(effect[at], -across * truth["wrong_by"], atol=1e-7)
    assert (effect[~at] == 0.0).all()


def test_first_position_and_the_return_share_their_mark():
    _, table = hidden("none", "one")
    world = table.world.having("stand", wrong_position=1, wrong_by=1e-3)
    off = world.stand.angle(table.session) - table.session.angle
    moved = np.abs(off[table.session.read]) > 5e-4
    np.testing.assert_array_equal(moved, np.isin(table.position, (1, 9)))


# -- readings --------------------------------------------------------------------------------------


def test_outlier_is_one_reading():
    case, table = hidden("outlier")
    (row,) = np.flatnonzero(table.effect)
    assert row == case.truth["outlier"]["outlier_at"]
    assert table.effect[row] == pytest.approx(case.truth["outlier"]["outlier"])


def test_swapped_readings_stand_in_each_others_place():
    case, table = hidden("swapped-positions")
    first, second = case.truth["swapped-positions"].values()
    assert np.flatnonzero(table.effect).tolist() == sorted((first, second))
    assert table.affected[first] == table.clean[second]
    assert (table.run[first], table.stroke[first]) == (table.run[second], table.stroke[second])


def test_quantized_outputs_are_steps():
    case, table = hidden("quantization")
    step = case.truth["quantization"]["resolution"]
    steps = table.output / step
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    assert step == pytest.approx(8 * table.sigma)
    assert float(table.header["resolution"]) == RESOLUTION


def test_vibration_acts_where_the_angle_counts():
    truth, table, effect = effect_in_g("vibration-noise")
    aside = np.isin(table.angle, (90.0, 270.0))
    level = np.isin(table.angle, (0.0, 180.0, 360.0))
    assert 0.7 < effect[aside].std() / truth["shaking"] < 1.4
    assert np.abs(effect[level]).max() < 0.01 * truth["shaking"]


# -- sizes -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("design", ["three", "loop-actual", "one", "twelve"])
def test_size_is_what_was_asked(design):
    for kind in set(kinds(DESIGNS[design])) - {"swapped-positions", "quantization"}:
        case, table = hidden(kind, design, s=2.3, seed=5)
        assert case.hidden == (kind,)
        assert table.s == pytest.approx(2.3, rel=1e-6)
        assert table.sigma == SIGMA * table.world.sensor.scale


def test_sizes_of_one_seed_differ_by_the_size_alone():
    for kind in ("warm-up", "pair"):
        small, large = (hidden(kind, "loop", "all", s=s, seed=3) for s in (1.0, 8.0))
        assert small[0].hidden == large[0].hidden
        noise = [table.output - table.affected for _, table in (small, large)]
        np.testing.assert_allclose(noise[0], noise[1], atol=2 * RESOLUTION)
        np.testing.assert_allclose(8 * small[1].effect, large[1].effect, atol=1e-3 * 4e-5)


def test_signs_are_drawn_where_there_are_two():
    drawn = [
        hidden("fourth-order", "one", seed=seed)[0].truth["fourth-order"] for seed in range(20)
    ]
    assert {math.copysign(1, truth["fourth"]) for truth in drawn} == {1.0, -1.0}
    drawn = [hidden("backlash", "one", seed=seed)[0].truth["backlash"] for seed in range(20)]
    assert all(truth["backlash"] > 0 for truth in drawn)


@pytest.mark.parametrize("kind", [kind for kind in IDS if kind not in kinds(DESIGNS["one"])])
def test_effect_without_a_subject_is_refused(kind):
    with pytest.raises(ValueError, match="this design has no"):
        hidden(kind, "one")


# -- several and strangers -------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "count"), [("pair", 2), ("triple", 3)])
@pytest.mark.parametrize("design", ["three", "loop", "one", "twelve"])
def test_several_are_distinct_and_add_up(kind, count, design):
    for seed in range(3):
        case, table = hidden(kind, design, seed=seed)
        assert len(set(case.hidden)) == count
        assert not set(case.hidden) & {*DATA_FAULTS, *STRANGERS}
        for name in case.hidden:
            assert np.abs(table.parts[name]).max() == pytest.approx(4 * table.sigma, rel=1e-6)
            assert table.noncentrality(name) > 1.0
        together = sum(table.parts.values())
        # a drifting chamber also turns back the memory of the temperature a little
        np.testing.assert_allclose(table.effect, together, atol=0.15 * table.sigma)


def test_named_effects_of_different_sizes():
    both = ("backlash", "one-run-k2")
    case, table = hidden(both, s=(8.0, 2.0))
    assert case.hidden == both
    assert np.abs(table.parts["backlash"]).max() == pytest.approx(8 * table.sigma)
    assert np.abs(table.parts["one-run-k2"]).max() == pytest.approx(2 * table.sigma)


def test_strangers_of_a_design_are_drawn():
    design = DESIGNS["one"]
    names = {hidden("stranger", "one", seed=seed)[0].hidden[0] for seed in range(80)}
    assert names == {name for name in STRANGERS if is_outside(name, design)}
    assert "direction-sin5" not in names


def test_strangers_have_their_patterns():
    _, table, effect = effect_in_g("direction-cos3")
    assert forward_minus_back(table, effect, 45) == pytest.approx(
        -forward_minus_back(table, effect, 0) * math.sqrt(0.5), rel=1e-6
    )
    truth, table, effect = effect_in_g("position-cycle")
    at = (table.position - 1) % 8 == truth["position"] - 1
    expected = truth["size"] * ((table.stroke[at] + 1) // 2) / 3
    np.testing.assert_allclose(effect[at], expected, atol=1e-11)
    assert (effect[~at] == 0).all()
    truth, table, effect = effect_in_g("bad-stroke-noise")
    bad = (table.run == truth["run"]) & (table.stroke == truth["stroke"])
    assert (effect[~bad] == 0).all()
    assert len(set(effect[bad])) == 9
    truth, table, effect = effect_in_g("root-time-bias")
    np.testing.assert_allclose(effect**2, effect[-1] ** 2 * table.time / table.time[-1], atol=1e-15)
    _, _, effect = effect_in_g("alternating-bias")
    assert all(a == pytest.approx(-b, rel=1e-6) for a, b in pairwise(effect))


# -- what a base model leaves ----------------------------------------------------------------------

ABSORBED = ("odd-quadratic", "cross-axis-quadratic", "fixture-offset", "head-eccentricity")
ON_THREE_LEVELS = (
    "bias-temperature-quadratic",
    "scale-factor-temperature-quadratic",
    "break-shift",
    "temperature-hysteresis",
)


@pytest.mark.parametrize("kind", [*ABSORBED, *ON_THREE_LEVELS])
def test_what_eight_positions_at_three_levels_cannot_show(kind):
    assert hidden(kind)[1].noncentrality() < 0.02


@pytest.mark.parametrize("kind", [kind for kind in IDS if kind not in ABSORBED])
def test_what_eight_positions_in_a_loop_show(kind):
    assert hidden(kind, "loop")[1].noncentrality() > 3.0


def test_noncentrality_of_an_effect_that_nothing_absorbs():
    assert hidden("stroke-offset", "one")[1].noncentrality() == pytest.approx(4 * math.sqrt(54))


def test_declared_head_errors_hide_a_shape():
    free, with_head = (hidden("fourth-order", regime=r)[1] for r in ("iid", "head"))
    assert with_head.noncentrality() < 0.1 * free.noncentrality()


# -- noise -----------------------------------------------------------------------------------------


def noises(regime, design="one", count=400):
    tables = [
        draw("none", np.random.default_rng(seed), DESIGNS[design], regime)[1]
        for seed in range(count)
    ]
    return tables[0], np.array([(table.output - table.clean) / table.scale for table in tables])


@pytest.mark.parametrize("regime", REGIMES)
def test_noise_has_its_covariance(regime):
    table, noise = noises(regime)
    expected = table.covariance() / table.scale**2
    # standard error of a variance: 1/sqrt(200) of it, more where the tails are long
    np.testing.assert_allclose(noise.var(axis=0).mean(), np.diag(expected).mean(), rtol=0.08)
    ahead = (noise[:, 1:] * noise[:, :-1]).mean()
    assert ahead == pytest.approx(np.diag(expected, 1).mean(), abs=0.05 * expected.max())
    size = np.sqrt(np.diag(expected))
    assert np.abs(np.cov(noise.T) - expected)[np.triu_indices(54)].max() < 0.5 * size.max() ** 2


def test_a_walk_begins_anew_with_each_run():
    taken = session(DESIGNS["three"], np.random.default_rng(1))
    rng = np.random.default_rng(2)
    noise = np.array([REGIMES["walk"].scatter(taken, rng) for _ in range(2000)])
    # white noise of 1, and steps of 0.3
    variance = np.tile(1.0 + 0.09 * np.arange(1, 55), 3)
    np.testing.assert_allclose(noise.var(axis=0), variance, rtol=0.15)
    assert np.corrcoef(noise.T)[53, 54] == pytest.approx(0.0, abs=0.1)


def test_memory_of_the_noise_ends_with_the_run():
    taken = session(DESIGNS["three"], np.random.default_rng(1))
    rng = np.random.default_rng(2)
    noise = np.array([REGIMES["ar1"].scatter(taken, rng) for _ in range(1000)])
    together = np.corrcoef(noise.T)
    assert together[52, 53] == pytest.approx(0.5, abs=0.12)
    assert together[53, 54] == pytest.approx(0.0, abs=0.12)


def test_head_errors_repeat_in_all_strokes_and_runs():
    _, table = hidden("none", "three", "head")
    off = np.deg2rad(table.angle)
    noise = (table.output - table.clean) / table.scale
    means = [noise[(table.run == run) & (table.angle == 90)].mean() for run in (1, 2, 3)]
    assert np.ptp(means) < 4 * SIGMA
    graduation = REGIMES["head"].disturbed(table.world, table.session, np.random.default_rng(1))
    assert len(graduation.stand.graduation) == len(set(off)) - 1


def test_launches_shift_whole_runs():
    _, table = hidden("none", "loop", "launch")
    noise = (table.output - table.clean) / table.scale
    means = np.array([noise[table.run == run].mean() for run in range(1, 9)])
    assert means.std() > 4e-6
    assert np.std([noise[table.run == run].std() for run in range(1, 9)]) < 2e-6


def test_student_noise_has_long_tails():
    _, normal = noises("iid")
    _, long = noises("t5")
    assert (np.abs(normal) > 4.5 * SIGMA).mean() < 2e-4
    assert (np.abs(long) > 4.5 * SIGMA).mean() > 1e-3


@pytest.mark.parametrize(
    ("regime", "head", "launch"),
    [
        ("iid", "0", "0"),
        ("head", "2e-05", "0"),
        ("head-1-sigma", "5e-06", "0"),
        ("launch", "0", "1e-05"),
        ("launch-undeclared", "0", None),
        ("all", "2e-05", "1e-05"),
    ],
)
def test_header_declares_what_scatters(regime, head, launch):
    header = hidden("none", "three", regime)[1].header
    assert header["head_uncertainty"] == head
    assert header.get("launch_uncertainty") == launch
    assert ("launch_sf_uncertainty" in header) is (launch is not None)


def test_bare_header_declares_nothing():
    assert set(hidden("none", "three-bare", "all")[1].header) == {"unit", "T0", "positions"}


# -- files and seeds -------------------------------------------------------------------------------


@pytest.mark.parametrize("design", DESIGNS)
def test_csv_is_the_table(design, tmp_path):
    _, table = hidden("backlash", design, "all")
    table.write(tmp_path / "table.csv")
    lines = (tmp_path / "table.csv").read_text("utf-8").splitlines()
    head = [line for line in lines if line.startswith("# ")]
    assert dict(line[2:].split(": ") for line in head) == dict(table.header)
    rows = list(csv.DictReader(lines[len(head) :]))
    where = "angle" if table.design.angles else "position"
    expected = ["temperature", "run", where, "stroke"]
    assert list(rows[0]) == [*expected, *(["time"] if table.design.time else []), "output"]
    for name in rows[0]:
        written = [float(row[name]) for row in rows]
        np.testing.assert_allclose(written, getattr(table, name), rtol=1e-11)


def test_whitening_by_variances_is_that_by_the_whole_covariance():
    _, table = hidden("backlash", "one", "iid")
    _, coupled = hidden("backlash", "one", "ar1")
    almost = table.covariance() + 1e-12 * coupled.covariance()
    q = noncentrality(table.effect, table.base_directions(), almost)
    assert q == pytest.approx(table.noncentrality(), rel=1e-6)


@pytest.mark.parametrize("kind", ["none", "vibration-noise", "triple", "stranger"])
def test_same_seed_same_table(kind):
    (one, first), (two, second) = (
        draw(kind, np.random.default_rng(7), DESIGNS["loop"], "all") for _ in range(2)
    )
    assert one == two
    np.testing.assert_array_equal(first.output, second.output)
    np.testing.assert_array_equal(first.time, second.time)
    other = draw(kind, np.random.default_rng(8), DESIGNS["loop"], "all")[1]
    assert not np.array_equal(first.output, other.output)


def test_a_design_of_ones_own():
    design = replace(DESIGNS["three"], positions=16, temperatures=(25.0, -5.0), cycles=2)
    _, table = draw("backlash", np.random.default_rng(1), design)
    assert len(table.output) == 2 * 4 * 17
