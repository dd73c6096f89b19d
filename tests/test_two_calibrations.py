"""Two calibrations of one unit: what both share, how often noise differs, what is refused."""

import io
import itertools
import json
import re
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import accelcal
from accelcal.cli.main import main
from accelcal.discovery.two_calibrations.errors import errors_of_both, side_of
from accelcal.simulation import NoiseComponents, TumblePlan, simulate

U, S, K1 = 2e-5, 5e-6, 1.35  # rad, of a head position; g, of a reading; mA/g
NOISE = NoiseComponents(reading=S, head=U, launch=0.0, launch_sf=0.0)
QUIET = replace(NOISE, head=0.0)
TURNS = np.deg2rad(np.append(np.arange(8) * 45.0, 360.0))
MODEL = ("k0", "K1", "k2", "k3", "delta", "delta_ip")


def measured(seed, errors=None, temperatures=(20.0,), **others):
    """A test, of which the head has given errors at its eight positions."""
    plan = TumblePlan(temperatures=temperatures, **others)
    record = simulate(plan=plan, noise=NOISE if errors is None else QUIET, seed=seed)
    if errors is None:
        return record
    there = np.deg2rad(record.angle) + errors[(record.position - 1) % 8]
    change = K1 * (np.cos(there) - np.cos(np.deg2rad(record.angle)))
    moved = replace(record, output=record.output + change)
    return moved.with_apparatus(head_uncertainty=U)


def calibrated(seed, errors=None, **others):
    return accelcal.fit(measured(seed, errors, **others))


def changed(record, *, scale=1.0, offset=0.0, **others):
    """The record of a unit whose scale factor and bias [g] have changed."""
    return replace(record, output=scale * record.output + K1 * offset, **others)


OLD, NEW = calibrated(1), calibrated(2)
LAWS = accelcal.fit(accelcal.simulate(seed=1))
compare = accelcal.compare_calibrations


def said(found, *parts):
    return any(all(part in note for part in parts) for note in found.notes)


# -- what is common to both ------------------------------------------------------------------------


def oracle(one_head, strokes=6):
    """Standard uncertainties of the differences of K0 .. M_ip over K1, by matrices alone."""
    c, s = np.cos(TURNS), np.sin(TURNS)
    X = np.stack([c**0, c, c**2, c**3, s, c * s], axis=1)
    Z = np.zeros((9, 8))
    Z[np.arange(9), np.arange(9) % 8] = -s
    V = U**2 * Z @ Z.T + S**2 / strokes * np.eye(9)
    estimator = np.linalg.inv(X.T @ np.linalg.inv(V) @ X) @ X.T @ np.linalg.inv(V)
    whole = 2.0 * S**2 / strokes * estimator @ estimator.T
    if not one_head:
        whole += 2.0 * U**2 * (estimator @ Z) @ (estimator @ Z).T
    return np.sqrt(np.diagonal(whole))


@pytest.mark.parametrize("one_head", [True, False])
def test_uncertainty_of_a_difference_is_that_of_the_matrices(one_head):
    found = compare(OLD, NEW, same_head=one_head)
    sizes = np.array([found[name].difference.standard_uncertainty for name in MODEL])
    sizes[1] /= K1
    # the noise that replicates tell is that of 46 degrees of freedom in each, 10 % off and less
    np.testing.assert_allclose(sizes, oracle(one_head), rtol=0.1)


def test_of_two_heads_e_n_is_that_of_the_proficiency_tests():
    found = compare(LAWS, accelcal.fit(accelcal.simulate(seed=2)), same_head=False)
    for name in MODEL:
        own = found[name]
        stated = np.hypot(own.old.expanded_uncertainty, own.new.expanded_uncertainty)
        expected = (own.new.value - own.old.value) / stated
        assert own.normalised_error == pytest.approx(expected, rel=0.03)


def test_both_columns_state_what_each_calibration_states():
    found = compare(OLD, NEW)
    for own, calibration in (("old", OLD), ("new", NEW)):
        table = calibration.tables[0]
        for change in found.coefficients:
            stated, quantity = getattr(change, own), table.quantities[change.coefficient]
            assert stated.value == pytest.approx(quantity.value, rel=1e-12)
            assert stated.unit == quantity.unit
            assert stated.expanded_uncertainty == pytest.approx(
                quantity.expanded_uncertainty, rel=1e-3
            )


def test_where_nothing_tells_the_head_the_larger_of_both_counts():
    one, two, untold = (compare(OLD, NEW, same_head=same) for same in (True, False, None))
    assert untold.same_head is None
    assert said(untold, "not known whether both were measured on one head")
    for name in MODEL:
        widths = [c[name].difference.expanded_uncertainty for c in (one, two, untold)]
        assert widths[2] == max(widths[:2])
    assert untold.joint.p_value == max(one.joint.p_value, two.joint.p_value)


def test_lines_of_both_tables_tell_the_head():
    def on(name, seed):
        return accelcal.fit(replace(measured(seed), metadata={"head": name}))

    assert compare(on("A", 1), on("a", 2)).same_head is True
    assert compare(on("A", 1), on("B", 2)).same_head is False


def test_noise_of_one_stroke_is_not_told_from_the_head_which_counts_as_two():
    short = calibrated(3, strokes=1)
    found = compare(OLD, short, same_head=True)
    assert found.same_head is None
    assert said(found, "new calibration does not tell the positions", "repeat strokes")
    apart = compare(OLD, short, same_head=False)
    assert found.coefficients == apart.coefficients


def test_a_calibration_beside_itself_has_no_difference():
    found = compare(OLD, OLD)
    assert found.agrees
    assert all(own.agrees for own in found.coefficients)
    assert found.largest.difference.value == 0.0


# -- how often noise looks like a change, and how often a change is seen ---------------------------

TRIALS = 50


@pytest.fixture(scope="module", params=[True, False], ids=["one head", "two heads"])
def unchanged(request):
    """Comparisons of a unit that has not changed, on one head and on two."""
    found = []
    for seed in range(1000, 1000 + TRIALS):
        rng = np.random.default_rng(seed)
        first, second = U * rng.standard_normal((2, 8))
        old = calibrated(2 * seed, first)
        new = calibrated(2 * seed + 1, first if request.param else second)
        found.append(compare(old, new, same_head=request.param))
    return found


def test_of_an_unchanged_unit_e_n_is_above_1_in_5_percent(unchanged):
    apart = np.array([[not found[name].agrees for name in MODEL] for found in unchanged])
    # coefficients of one trial are correlated: as many as two of six tell something of their own
    assert apart.mean() <= 0.05 + 2.0 * np.sqrt(0.05 * 0.95 / (2 * TRIALS))
    assert apart.mean() > 0.01


def test_of_an_unchanged_unit_the_joint_test_alarms_in_1_percent(unchanged):
    chances = np.array([found.joint.p_value for found in unchanged])
    assert np.mean(chances < 0.05) <= 0.05 + 2.0 * np.sqrt(0.05 * 0.95 / TRIALS)
    assert np.mean([not found.agrees for found in unchanged]) <= 0.03


def test_of_an_unchanged_unit_the_indicated_acceleration_changes_in_5_percent(unchanged):
    at_ends = [(found.indicated[0], found.indicated[-1]) for found in unchanged]
    beyond = [abs(p.difference.value) > p.difference.expanded_uncertainty
              for both in at_ends for p in both]  # fmt: skip
    assert np.mean(beyond) <= 0.05 + 2.0 * np.sqrt(0.05 * 0.95 / (2 * TRIALS))


def test_of_an_unchanged_unit_the_band_leaves_out_zero_anywhere_in_5_percent(unchanged):
    """The largest of 41 points is beyond its own U two to three times as often."""
    apart = np.mean([not all(own.agrees for own in found.indicated) for found in unchanged])
    alone = np.mean([abs(found.largest.difference.value)
                     > found.largest.difference.expanded_uncertainty
                     for found in unchanged])  # fmt: skip
    assert apart <= 0.05 + 2.0 * np.sqrt(0.05 * 0.95 / TRIALS)
    assert alone > apart


def test_nowhere_beyond_is_the_farthest_edge_of_the_band():
    found = compare(OLD, NEW)
    assert found.at_most == max(abs(p.difference.value) + p.band for p in found.indicated)
    told = " ".join(str(found).split())
    assert f"nowhere beyond {1e6 * found.at_most:.0f} ug (95 %, for the whole range" in told
    assert "largest 0" in str(compare(OLD, OLD))


def test_one_verdict_stands_in_a_report_whatever_lies_outside_an_interval_of_95_percent():
    """ "The coefficients agree" stood beside a change in use that disagreed."""
    found = compare(OLD, NEW)
    assert not all(point.agrees for point in found.indicated)
    assert found.verdict == "agree"
    assert str(found).upper().count("AGREE") == 1
    moved = compare(OLD, accelcal.fit(changed(measured(2), offset=1e-4)))
    assert moved.verdict == "disagree"
    assert str(moved).upper().count("AGREE") == 1
    assert "(*): 1 of 6 coefficients" in str(moved)


def test_a_bias_is_seen_as_often_as_its_size_says():
    """One of 1.96 + 1.64 standard uncertainties has |E_n| > 1 in 95 %."""
    size = (1.96 + 1.64) * oracle(one_head=True)[0]
    errors = U * np.random.default_rng(5).standard_normal(8)
    old = calibrated(1, errors)
    seen = []
    for seed in range(2, 22):
        new = accelcal.fit(changed(measured(seed, errors), offset=2.0 * size))
        seen.append(compare(old, new, same_head=True))
    assert np.mean([not found["k0"].agrees for found in seen]) >= 0.95
    assert np.mean([not found.agrees for found in seen]) >= 0.9
    assert all(found["k0"].difference.value == pytest.approx(2.0 * size, rel=0.8) for found in seen)


def test_one_head_sees_a_misalignment_that_two_heads_hide():
    errors = U * np.random.default_rng(5).standard_normal(8)
    old, record = calibrated(1, errors), measured(2, errors)
    turned = replace(record, output=record.output + K1 * 1.2e-5 * np.sin(np.deg2rad(record.angle)))
    new = accelcal.fit(turned)
    assert not compare(old, new, same_head=True)["delta"].agrees
    assert not compare(old, new, same_head=True).agrees
    assert compare(old, new, same_head=False).agrees


# -- what it means in use --------------------------------------------------------------------------


def test_the_change_of_the_indicated_acceleration_is_that_of_the_outputs():
    new = accelcal.fit(changed(measured(1), scale=1.0 + 1e-4, offset=2e-4))
    found = compare(OLD, new, same_head=True)
    for point in found.indicated:
        a_i = point.a_i
        expected = 2e-4 + 1e-4 * (a_i + 3.3e-3)  # what the same readings are more, over K1
        assert point.difference.value == pytest.approx(expected, abs=2e-7)
    assert [found.indicated[0].a_i, found.indicated[-1].a_i] == pytest.approx([-1.0, 1.0])
    assert found.largest.a_i == pytest.approx(1.0)
    assert not found.agrees


# -- temperature -----------------------------------------------------------------------------------


def test_laws_are_compared_at_the_level_of_the_other():
    new = calibrated(3, temperatures=(60.0,))
    found = compare(LAWS, new)
    assert found.temperature_degC == pytest.approx(60.0)
    assert found["K1"].agrees
    assert found["k0"].agrees
    assert found["K1"].old.value == pytest.approx(
        accelcal.coefficients_at(LAWS, found.temperature_degC)["K1"].value
    )
    assert "lam1" not in {own.coefficient for own in found.coefficients}
    assert said(found, "not compared: lam1", "not determined by the new calibration")


def test_of_two_laws_slopes_are_compared_and_the_temperature_is_that_asked_for():
    other = accelcal.fit(accelcal.simulate(seed=4))
    found = compare(LAWS, other, temperature=55.0)
    assert found.temperature_degC == 55.0
    assert {"lam1", "beta2", "gam1"} <= {own.coefficient for own in found.coefficients}
    assert found["K1"].new.value == pytest.approx(accelcal.coefficients_at(other, 55.0)["K1"].value)
    assert compare(LAWS, other).temperature_degC == LAWS.T0_degC


def test_levels_that_do_not_overlap_are_refused_in_one_line():
    with pytest.raises(accelcal.InputError, match="no temperature at which both") as refused:
        compare(OLD, calibrated(3, temperatures=(60.0,)))
    assert "the old one is for 20 degC" in str(refused.value)
    with pytest.raises(accelcal.InputError, match="new calibration: temperature 60 degC is more"):
        compare(LAWS, NEW, temperature=60.0)


def test_ranges_that_do_not_overlap_are_refused_in_one_line():
    """The change was told from 0.5 to -0.5 g, which neither had tested."""
    up, down = (
        accelcal.fit(measured(1, angles=angles), coefficients=("K0", "K1", "M"))
        for angles in ((0.0, 60.0, 300.0, 315.0), (180.0, 120.0, 240.0, 135.0))
    )
    with pytest.raises(accelcal.InputError, match=r"0.5 to 1 g, the new one for -1 to -0.5 g; cal"):
        compare(up, down)


def test_single_levels_a_degree_apart_count_what_usual_slopes_make_of_it():
    near = compare(OLD, calibrated(3, temperatures=(21.0,)), same_head=True)
    assert near.temperature_degC == pytest.approx(20.5)
    assert said(near, "usual ones")
    same = compare(OLD, calibrated(3), same_head=True)
    widths = [found["K1"].difference.standard_uncertainty / K1 for found in (near, same)]
    assert widths[0] == pytest.approx(np.hypot(widths[1], np.sqrt(2.0) * 0.5 * 500e-6), rel=1e-2)


def test_of_several_runs_at_one_level_the_mean_counts():
    loud = replace(NOISE, launch=5e-5)

    def of_runs(seed, runs):
        record = simulate(plan=TumblePlan(temperatures=(20.0,) * runs), noise=loud, seed=seed)
        return accelcal.fit(record)

    one, three, other = of_runs(1, 1), of_runs(2, 3), of_runs(3, 3)
    found = compare(three, other, same_head=False)
    bias = [np.mean([own.error_model["k0"].value for own in c.tables]) for c in (three, other)]
    assert found["k0"].difference.value == pytest.approx(bias[1] - bias[0], abs=1e-6)
    rest = oracle(one_head=False)[0]
    for pair, launches in (((three, other), 2.0 / 3.0), ((one, three), 4.0 / 3.0)):
        size = compare(*pair, same_head=False)["k0"].difference.standard_uncertainty
        assert size == pytest.approx(np.hypot(rest, np.sqrt(launches) * 5e-5), rel=0.03)
    assert said(found, "new calibration counts by the mean of its runs 1, 2 and 3")
    assert not said(compare(OLD, NEW), "mean of its runs")
    assert np.isfinite(found.at_most)
    axes = [calibrated(seed, temperatures=(20.0, 20.0), mountings=("o+", "p+")) for seed in (4, 5)]
    assert [own.cross_axis for own in compare(*axes).coefficients].count("a_o") == 4


def test_runs_that_do_not_tell_the_same_are_refused_still():
    other = replace(calibrated(2, positions=4).tables[0], run="2")
    mixed = replace(OLD, tables=(*OLD.tables, other))
    with pytest.raises(accelcal.InputError, match=r"runs 1 \(o\+\), 2 \(o\+\); .* no mean"):
        compare(mixed, NEW)


def test_the_hysteresis_of_laws_counts_beside_a_single_level_alone():
    def bias(other, hysteresis):
        laws = side_of("old", LAWS)
        laws = laws._replace(found=replace(laws.found, hysteresis=hysteresis))
        return errors_of_both(laws, side_of("new", other), 20.0, same_head=True).covariance[0, 0]

    more = bias(NEW, 3e-5) - bias(NEW, 0.0)
    assert more == pytest.approx(9e-10)
    assert bias(LAWS, 3e-5) == bias(LAWS, 0.0)


# -- units, gravity, mountings, models -------------------------------------------------------------


def test_two_units_are_refused_unless_their_serials_differ_by_spelling_alone():
    with pytest.raises(accelcal.InputError, match="of AL-15, the new one that of AL-16"):
        compare(OLD, replace(NEW, serial="AL-16"))
    assert compare(OLD, replace(NEW, serial="al-15")).agrees


def test_an_output_unit_is_converted_and_another_quantity_is_refused():
    record = measured(2)
    apparatus = replace(record.apparatus, resolution=None)
    in_amperes = accelcal.fit(replace(record, output=1e-3 * record.output, unit="A",
                                      apparatus=apparatus))  # fmt: skip
    found = compare(OLD, in_amperes)
    assert said(found, "converted from A to mA")
    assert found["K1"].new.unit == found["K1"].old.unit == "mA/g"
    assert found["K1"].agrees
    assert found["K2"].agrees
    with pytest.raises(accelcal.InputError, match="output in mA, the new one in mV"):
        compare(OLD, accelcal.fit(replace(record, unit="mV")))


def test_local_g_of_both_places_is_counted():
    here, there = 9.78, 9.83

    def at(gravity, seed, strength):
        # the same unit where g is larger: all readings but the bias are more
        record = measured(seed)
        own = K1 * 3.324e-3
        moved = replace(record, output=own + strength * (record.output - own))
        return accelcal.fit(moved.with_apparatus(local_gravity=gravity))

    found = compare(at(here, 1, 1.0), at(there, 2, there / here))
    assert found["K1"].agrees
    assert found["k0"].agrees
    assert said(found, "g = 9.78 m/s^2 and 9.83 m/s^2")
    assert not compare(at(here, 1, 1.0), at(None, 2, there / here))["K1"].agrees


def test_of_the_other_side_the_misalignment_is_not_compared():
    found = compare(OLD, calibrated(3, mountings=("o-",)))
    assert "delta" not in {own.coefficient for own in found.coefficients}
    assert said(found, "not compared: delta", "other side")
    assert found["K1"].agrees


def test_the_uncertainty_of_the_fixture_angle_counts_in_the_misalignment_alone():
    u, names = 5e-5, ("k0", "K1", "delta_ip")

    def variances(other, same_head):
        known = [compare(OLD, other, same_head=same_head, fixture_uncertainty=size)
                 for size in (0.0, u)]  # fmt: skip
        for name in names:
            assert known[0][name].difference == known[1][name].difference
        return [found["delta"].difference.standard_uncertainty ** 2 for found in known]

    turned = calibrated(3, mountings=("o-",))
    for other, same_head, share in (
        (NEW, False, 2.0),  # two clampings
        (NEW, True, 0.0),  # one, which cancels
        (turned, False, 2.0),
        (turned, True, 4.0),  # one, which has the other sign on the other side
        (calibrated(4, mountings=("o+", "o-")), False, 1.0),  # both sides tell one of them
    ):
        less, more = variances(other, same_head)
        assert more - less == pytest.approx(share * u**2, rel=1e-6, abs=1e-20)
    both, one = calibrated(5, mountings=("o+", "p+")), calibrated(6, mountings=("p+",))
    clamped_alike = [compare(both, one, same_head=True, fixture_uncertainty=size)["delta"]
                     for size in (0.0, u)]  # fmt: skip
    sizes = [own.difference.standard_uncertainty for own in clamped_alike]
    assert sizes[1] == pytest.approx(sizes[0], rel=1e-9)
    found = compare(OLD, turned, fixture_uncertainty=u)
    assert said(found, "the fixture angle of each test counts", "50 urad")
    assert not said(found, "delta contains the fixture angle")
    with pytest.raises(accelcal.InputError, match="fixture_uncertainty"):
        compare(OLD, NEW, fixture_uncertainty=-1.0)


def test_of_both_axes_only_the_common_one_is_compared():
    both = calibrated(3, mountings=("o+", "p+"))
    found = compare(both, calibrated(4, mountings=("p+",)))
    assert [own.cross_axis for own in found.coefficients if own.coefficient == "delta"] == ["a_o"]
    assert said(found, "not compared: delta", "not determined by the new calibration")
    assert found["delta"].agrees


def test_coefficients_that_one_has_not_are_named():
    few = accelcal.fit(measured(3), coefficients=["K0", "K1", "K2", "M"])
    found = compare(OLD, few)
    assert {own.coefficient for own in found.coefficients} == {"k0", "K1", "k2", "delta",
                                                              "K0", "K2", "M"}  # fmt: skip
    assert said(found, "not compared: k3 and delta_ip, not determined by the new calibration")
    assert said(found, "the indicated acceleration takes k3 as 0")
    assert not said(compare(OLD, NEW), "as 0")


def test_what_stands_for_something_else_is_not_compared():
    four = calibrated(3, positions=4)
    found = compare(OLD, four)
    assert said(found, "not compared", "in the old calibration", "in the new")
    assert "K1" not in {own.coefficient for own in found.coefficients}


def test_a_calibration_without_uncertainties_is_refused():
    bare = tuple(
        replace(t, covariance_names=(), covariance_matrix=(), over_dof_matrix=())
        for t in NEW.tables
    )
    with pytest.raises(accelcal.InputError, match="new calibration states no uncertainty"):
        compare(OLD, replace(NEW, tables=bare))


def test_effects_of_one_calibration_alone_are_told():
    asymmetry = [accelcal.effect("scale-factor-asymmetry").of(3e-4)]
    plan = TumblePlan(temperatures=(20.0,), positions=16)
    one, other = (simulate(plan=plan, noise=NOISE, effects=asymmetry, seed=seed) for seed in (1, 2))
    model = accelcal.discover(one)
    with_effect = [accelcal.fit(record, model=model) for record in (one, other)]
    alike = compare(*with_effect)
    assert alike.agrees
    assert not said(alike, "effects of the calibrations differ")
    apart = compare(with_effect[0], accelcal.fit(other))
    assert said(apart, "effects of the calibrations differ", "scale-factor-asymmetry")
    # the effect is in what is indicated by the one, and in the coefficients of the other
    assert abs(apart.largest.difference.value) < 1.5e-4
    assert apart.old.effects == ("scale-factor-asymmetry",)


@cache
def carrying(seed, name, size, **others):
    """A calibration with an effect of a size."""
    plan = TumblePlan(temperatures=(20.0,), positions=16)
    effects = [accelcal.effect(name).of(size, **others)]
    record = simulate(plan=plan, noise=NOISE, effects=effects, seed=seed)
    return accelcal.fit(record, model=accelcal.discover(record))


def test_an_effect_of_another_size_disagrees_by_its_own_e_n():
    """An asymmetry that doubles is 200 ug at 1 g, and leaves the coefficients as they are."""
    name = "scale-factor-asymmetry"
    old, new = carrying(1, name, 4e-4), carrying(2, name, 8e-4)
    found = compare(old, new, same_head=False)
    (size,) = found.sizes
    stated = [own.effects[0].parameters["coefficient"] for own in (old, new)]
    half = np.hypot(*(own.expanded_uncertainty for own in stated))
    assert (size.effect, size.coefficient) == (name, "coefficient")
    assert size.normalised_error == pytest.approx((stated[1].value - stated[0].value) / half, 1e-3)
    assert found.joint.p_value > 0.01
    assert found.p_value == pytest.approx(2.0 * size.p_value)
    assert not found.agrees
    assert not found.largest.agrees
    assert "The coefficients and sizes of effects DISAGREE" in str(found)
    (row,) = (line for line in str(found).splitlines() if line.startswith(f"  {name}"))
    assert row.endswith("*")
    assert "The coefficients agree" in str(compare(OLD, NEW))
    assert name in [label.get_text() for label in found.plot.coefficients().get_yticklabels()][-1]
    assert accelcal.CalibrationComparison.from_json(found.to_json()) == found


@pytest.mark.parametrize(("scale", "verdict"), [(1.0005, "no verdict"), (1.006, "disagree")])
def test_temperatures_that_nobody_declared_explain_no_more_than_their_degrees_make(scale, verdict):
    """Their errors counted as if as few degrees told them as the launches: 0.6 % was explained."""
    plan = TumblePlan(temperatures=(20.0, 20.0, 20.0))
    old, new = (accelcal.simulate(plan=plan, seed=n, declare=False) for n in (1, 2))
    found = compare(accelcal.fit(old), accelcal.fit(changed(new, scale=scale)))
    assert found.verdict == verdict
    assert found.explained_by == ("temperature_uncertainty",) * (verdict == "no verdict")


def test_an_effect_of_one_calibration_alone_leaves_no_verdict():
    """Its size was in no test, and the coefficients were said to agree."""
    plain = accelcal.fit(accelcal.simulate(plan=TumblePlan(temperatures=(20.0,), positions=16)))
    bent = carrying(1, "scale-factor-asymmetry", 4e-4)
    for pair, told in (((plain, bent), "new"), ((bent, plain), "old")):
        found = compare(*pair, same_head=False)
        assert found.p_value > 0.01
        assert found.verdict == "no verdict"
        assert not found.agrees
        reason = f"No verdict: the {told} calibration alone has scale-factor-asymmetry"
        assert reason in str(found)
        assert "fit --model" in " ".join(found.notes)
    assert compare(bent, carrying(2, "scale-factor-asymmetry", 4e-4)).agrees


def test_effects_of_two_stands_are_told_and_those_of_two_places_are_not_compared():
    lag = [carrying(seed, "backlash", 2e-4) for seed in (1, 2)]
    assert said(compare(*lag, same_head=False), "of the stand", "backlash")
    assert not said(compare(*lag, same_head=True), "of the stand")
    places = enumerate((45.0, 45.0, 90.0))
    old, new, elsewhere = (carrying(i, "position-error", 3e-4, at=at) for i, at in places)
    assert [own.coefficient for own in compare(old, new).sizes] == ["error"]
    assert compare(old, elsewhere).sizes == ()
    assert said(compare(old, elsewhere), "sizes of position-error are not compared")


def test_a_size_that_the_readings_do_not_tell_is_not_compared():
    old, new = (carrying(seed, "hysteresis", 3e-4) for seed in (1, 2))
    found = compare(old, replace(new, effects_as_found=("hysteresis",)))
    assert found.sizes == ()
    assert found.p_value == found.joint.p_value
    assert said(found, "sizes of hysteresis are not compared", "from its discovery")


def test_a_size_is_told_in_the_g_of_the_old_calibration():
    old, new = (carrying(seed, "hysteresis", 3e-4) for seed in (1, 2))
    found = compare(replace(old, g_local_m_s2=9.8), replace(new, g_local_m_s2=9.75))
    stated = new.effects[0].parameters["half_width"].value
    assert found["half_width"].new.value == pytest.approx(stated * 9.75 / 9.8)


def with_lines(seed, **declared):
    return accelcal.fit(measured(seed).with_apparatus(**declared))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (OLD, replace(NEW, output_unit=None), "new calibration names no output unit"),
        (OLD, replace(NEW, g_local_m_s2=9.81), "old calibration declares no local gravity"),
        (OLD, NEW, "neither calibration declares its local gravity"),
        (OLD, NEW, "delta contains the fixture angle"),
        (OLD, OLD, "both calibrations are of the same readings"),
        (OLD, with_lines(3, launch_uncertainty=None), "are not known of the new calibration"),
        (LAWS, accelcal.fit(accelcal.simulate(seed=2), reference_temperature=30.0), "another T0"),
    ],
)
def test_what_is_left_open_is_told(old, new, told):
    if old is new:
        old = new = replace(OLD, provenance={**OLD.provenance, "sha256": "0" * 64})
    assert said(compare(old, new), told)


def test_what_is_left_open_of_both_is_told_once():
    bare = [with_lines(seed, launch_uncertainty=None) for seed in (3, 4)]
    (note,) = (note for note in compare(*bare).notes if "launch to launch" in note)
    assert "not known of both calibrations" in note


@pytest.mark.parametrize(("unit", "factor"), [("mA", 1.0), ("A", 1e-3)])
def test_a_report_of_two_axes_with_laws_is_no_wider_than_others(unit, factor):
    """That in A was, by K1 of 0.00135 A/g with all of its zeros."""
    both = TumblePlan(mountings=("o+", "p+"))
    old, new = (simulate(plan=both, seed=seed) for seed in (1, 2))
    pair = [
        replace(r, output=factor * r.output, unit=unit) for r in (old, changed(new, offset=1e-2))
    ]
    told = str(compare(*map(accelcal.fit, pair)))
    assert "misalignment below T0, a_o" in told
    assert max(map(len, told.splitlines())) <= 100


def test_what_a_coefficient_stands_for_is_told_by_the_mounting_that_gives_it():
    """The nearest table of all mountings was asked."""
    both = simulate(plan=TumblePlan(mountings=("o+", "p+")), seed=1)
    is_main = both.mounting == "o+"
    few = replace(both, temperature=both.temperature + np.where(is_main, 0.01, 0.0))
    few = few.select(is_main | (few.position % 2 == 1))  # where K1 of p+ stands for K1 + K3
    old, new = (accelcal.fit(own, reference_temperature=20.0) for own in (both, few))
    assert {table.meaning("K1") for table in new.tables} == {"K1", "K1 + K3"}
    found = compare(old, new, same_head=True)
    assert found["K1"].agrees


def test_what_one_head_and_one_place_have_in_common_is_not_told_as_open():
    assert compare(OLD, NEW, same_head=True).notes == ()


def test_an_unknown_temperature_is_told_and_counts_as_the_same():
    record = measured(3)
    unknown = accelcal.fit(replace(record, temperature=np.full(len(record), np.nan)))
    for asked in (None, 20.0):
        found = compare(OLD, unknown, temperature=asked)
        assert found["K1"].agrees
        assert said(found, "a temperature is unknown")
        assert not said(found, "off this temperature")


# -- the result and the command --------------------------------------------------------------------


def test_a_chance_too_small_to_write_is_no_zero():
    """It was told as p = 0."""
    moved = compare(OLD, accelcal.fit(simulate(accelcal.Accelerometer(k2=5e-3), seed=2)))
    assert moved.p_value == 0.0
    assert "disagree, p < 1e-15>" in repr(moved)


def test_a_comparison_comes_back_from_its_document_and_is_a_table():
    found = compare(OLD, NEW)
    assert accelcal.CalibrationComparison.from_json(found.to_json()) == found
    frame = found.to_frame()
    assert frame.loc[frame["coefficient"] == "K1", "E_n"].item() == found["K1"].normalised_error
    with pytest.raises(KeyError):
        found["K9"]


def test_a_document_without_the_errors_of_both_is_read():
    document = json.loads(compare(OLD, NEW).to_json())
    for side in ("old", "new"):
        del document[side]["error_sources"]
    found = accelcal.CalibrationComparison.from_json(json.dumps(document))
    assert (found.old.error_sources, found.verdict) == ((), "agree")


def test_the_report_names_slopes_as_its_notes_do_and_has_no_negative_zero():
    found = compare(LAWS, accelcal.fit(accelcal.simulate(seed=4)))
    none = replace(found["lam1"].difference, value=-1e-12)
    changed = [replace(own, difference=none) if own.coefficient == "lam1" else own
               for own in found.coefficients]  # fmt: skip
    (row,) = (line for line in str(replace(found, coefficients=tuple(changed))).splitlines()
              if "bias above T0" in line)  # fmt: skip
    assert "lam1" in row
    assert row.endswith(" 0.00")


def test_a_row_is_rounded_to_the_place_of_its_uncertainty():
    """Old and new had places of their own, as in 1.20 and 1.192 beside a U of 0.21."""
    found = compare(*(accelcal.fit(accelcal.simulate(seed=n)) for n in (1, 2)))
    lines = str(found).split("\n\n")[2].splitlines()[1:]
    for line in lines:
        *values, half = re.split(r"  +", line.strip())[2:6]
        assert {len(own.partition(".")[2]) for own in values} == {len(half.partition(".")[2])}


def test_pictures_show_e_n_and_the_change_in_use():
    found = compare(OLD, NEW)
    drawn = found.plot.coefficients()
    assert drawn.get_xscale() == "linear"
    assert drawn.get_title(loc="left").endswith(": agree")
    points = drawn.lines[1:]
    assert sorted(x for line in points for x in line.get_xdata()) == sorted(
        found[name].normalised_error for name in MODEL
    )
    far = compare(OLD, accelcal.fit(changed(measured(2), offset=-1e-1))).plot.coefficients()
    assert far.get_xscale() == "symlog"
    far.figure.canvas.draw()
    labels = [text.get_window_extent() for text in far.get_xticklabels() if text.get_text()]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(labels, 2))
    told = [text.get_text() for text in far.get_legend().get_texts()]
    assert told == ["within U: $|E_n| \\leq 1$", "beyond U: $|E_n| > 1$"]
    assert "logarithmic" in far.get_xlabel()
    line = found.plot.indicated().lines[0]
    np.testing.assert_allclose(
        line.get_ydata(), [1e6 * point.difference.value for point in found.indicated]
    )


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    OLD.to_json("old.json")
    NEW.to_json("new.json")
    return tmp_path


def test_the_command_takes_a_calibration_in_place_of_readings(folder, capsys):
    assert main(["compare", "old.json", "new.json"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("TWO CALIBRATIONS  serial AL-15, at 20 degC")
    assert "--same-head or --other-head" in " ".join(text.split())
    assert main(["compare", "old.json", "new.json", "--other-head", "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "accelcal/calibration-comparison/1"
    expected = compare(OLD, NEW, same_head=False)
    assert document["joint"]["p_value"] == expected.joint.p_value
    assert document["coefficients"][1]["E_n"] == expected.coefficients[1].normalised_error
    # its contents tell what it is, whatever its name
    (folder / "new.json").rename("new.txt")
    assert main(["compare", "old.json", "new.txt"]) == 0


def test_the_command_pairs_the_units_of_two_files(folder, capsys):
    several = [replace(own, serial=serial) for serial in ("A", "B") for own in (NEW,)]
    text = json.dumps(
        {"schema": OLD.SCHEMA, "calibrations": [own.to_document() for own in several]}
    )
    for name in ("old.json", "new.json"):
        (folder / name).write_text(text, encoding="utf-8")
    assert main(["compare", "old.json", "new.json", "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)["comparisons"]
    assert [own["serial"] for own in found] == ["A", "B"]
    assert main(["compare", "old.json", "new.json", "--serial", "B", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["serial"] == "B"
    replace(NEW, serial=None).to_json("new.json")
    assert main(["compare", "old.json", "new.json", "--serial", "B", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["serial"] == "B"


def stored(name, **serials):
    """A file of several calibrations."""
    several = [replace(own, serial=serial).to_document() for serial, own in serials.items()]
    Path(name).write_text(json.dumps({"schema": OLD.SCHEMA, "calibrations": several}), "utf-8")


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("turned", [False, True])
def test_one_unit_beside_several_is_paired_with_its_own(capsys, turned):
    stored("several.json", A=OLD, B=NEW)
    replace(NEW, serial="b").to_json("one.json")
    files = ("one.json", "several.json") if turned else ("several.json", "one.json")
    assert main(["compare", *files, "--format", "json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["serial"].upper() == "B"
    assert "not compared, in one of the files alone: A" in told.err
    assert main(["compare", *files, "--serial", "b", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(told.out)


@pytest.mark.usefixtures("folder")
def test_units_that_cannot_be_paired_are_refused_in_a_line_that_says_what_to_do(capsys):
    stored("several.json", A=OLD, B=NEW)
    replace(NEW, serial=None).to_json("unnamed.json")
    assert main(["compare", "several.json", "unnamed.json"]) == 2
    told = capsys.readouterr().err
    assert "holds A and B, the second no serial; choose one by --serial TEXT" in told
    assert main(["compare", "several.json", "unnamed.json", "--serial", "A"]) == 0
    assert capsys.readouterr().out.startswith("TWO CALIBRATIONS  serial A,")
    triad = {"schema": accelcal.TriadCalibration.SCHEMA}
    Path("triad.json").write_text(json.dumps(triad), "utf-8")
    assert main(["compare", "several.json", "triad.json"]) == 2
    assert "calibration of a triad; give that of one accelerometer" in capsys.readouterr().err
    replace(NEW, serial="C").to_json("other.json")
    assert main(["compare", "several.json", "other.json"]) == 2
    assert (
        "no unit in both files: the first file holds A and B, the second C"
        in capsys.readouterr().err
    )
    assert main(["compare", "several.json", "several.json", "--serial", "C"]) == 2
    assert "the second A and B; give one that both hold" in capsys.readouterr().err


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("name", ["new.json", "table.csv"])
def test_standard_input_is_a_calibration_or_a_table_by_its_contents(capsys, monkeypatch, name):
    accelcal.write_table(measured(2), "table.csv")
    assert main(["compare", "old.json", name, "--format", "json"]) == 0
    expected = json.loads(capsys.readouterr().out)
    given = io.TextIOWrapper(io.BytesIO(Path(name).read_bytes()))
    monkeypatch.setattr(sys, "stdin", given)
    assert main(["compare", "old.json", "-", "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["schema"] == expected["schema"]
    assert found["p_value"] == expected["p_value"]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--head-uncertainty", "1e-5"], "--head-uncertainty G: it tells of readings"),
        (["--temperature", "70"], "old calibration: temperature 70 degC"),
    ],
)
def test_options_that_do_not_belong_to_calibrations_are_refused(capsys, options, told):
    assert main(["compare", "old.json", "new.json", *options]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.usefixtures("folder")
def test_a_temperature_does_not_belong_to_readings(capsys):
    accelcal.write_table(measured(3), "table.csv")
    assert main(["compare", "old.json", "table.csv", "--temperature", "20"]) == 2
    assert "--temperature DEG: for two calibrations" in capsys.readouterr().err
