"""What a test can show is known before it is made; what to measure next, after it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from dense_covariance import whitening_matrix
from scipy import stats

import accelcal
from accelcal.apparatus import Apparatus
from accelcal.discovery.base import base_model, solve
from accelcal.discovery.comparison import compared
from accelcal.discovery.family import family_of, judge, with_rates
from accelcal.discovery.instance import column_of, instances_of
from accelcal.discovery.noise.of_readings import ReadingNoise, covariance
from accelcal.discovery.prospects.audit import (
    aliases,
    carriers_in,
    designed,
    smallest_detectable,
    undetectable,
)
from accelcal.discovery.prospects.further_readings import blank, joined, menu
from accelcal.discovery.prospects.next_measurement import outlooks, proposals
from accelcal.discovery.search import search
from accelcal.effects.catalogue import catalogue, effect
from accelcal.errors import InputError
from accelcal.simulation import NOISE_FREE, NoiseComponents, TumblePlan, simulate

T0 = 20.0
SIGMA = 5e-6
NOISE = ReadingNoise(sigma=SIGMA, rho=0.0, dof=100, tails=np.inf)
SEARCHED = [item for item in catalogue() if item.acts_on != "readings" and item.amplitudes]
DECLARED = Apparatus(head_uncertainty=6.7e-6, launch_uncertainty=6.7e-6, launch_sf_uncertainty=5e-6)
USUAL = TumblePlan(timed=True)
ONE_RUN = TumblePlan(temperatures=(T0,), strokes=8, timed=True)
LOOP = (20.0, 50.0, 80.0, 50.0, 20.0, -10.0, -40.0, -10.0)
QUIET_HEAD = NoiseComponents(reading=SIGMA, head=0.0)


@cache
def design(plan=USUAL, apparatus=DECLARED):
    """Comparison, candidates and family of a test without a reading."""
    record = replace(simulate(plan=plan, noise=NOISE_FREE, seed=0), apparatus=apparatus)
    comparison = designed(record, T0, NOISE)
    return comparison, *_family(comparison)


def _family(comparison):
    family = with_rates(family_of(comparison, SEARCHED))
    return family.candidates, family


def found_in(record):
    """Comparison and findings of a record."""
    comparison = compared(record, T0)
    _, family = _family(comparison)
    return comparison, search(family)


def names_of(findings):
    return [sorted(explanation.ids) for explanation in findings.explanations]


def whole_q(record, wanted, others, delta0=0.0):
    """Noncentrality the long way: all readings of a record, all its covariance at once."""
    model = base_model(record, T0, delta0)
    c = model.conditions
    spread = covariance(c, NOISE, record.apparatus)
    whitener = whitening_matrix(spread)
    base = whitener @ np.hstack([model.jacobian(solve(model)), others(c)])
    base /= np.maximum(np.linalg.norm(base, axis=0), 1e-300)
    column = whitener @ wanted(c)
    return float(np.linalg.norm(column - base @ np.linalg.lstsq(base, column, rcond=1e-9)[0]))


# -- what cannot be seen ---------------------------------------------------------------------------


THREE_LEVELS = {
    "odd-quadratic": ("K1", "K3"),
    "cross-axis-quadratic": ("K0", "K2"),
    "bias-temperature-quadratic": ("K0 above T0", "K0 below T0"),
    "scale-factor-temperature-quadratic": ("K1 above T0", "K1 below T0"),
    "break-shift": ("K0 above T0", "K0 below T0"),
    "temperature-hysteresis": ("K0", "K0 above T0", "K0 below T0"),
    "fixture-offset": ("M",),
    "head-eccentricity": ("K0", "K2", "M_ip"),
}


def hidden_in(plan=USUAL, apparatus=DECLARED):
    comparison, found, _ = design(plan, apparatus)
    return {item.id: item.absorbed_by for item in undetectable(comparison, found)}


def test_what_eight_positions_and_three_levels_cannot_show():
    assert hidden_in() == THREE_LEVELS


def test_declared_uncertainties_do_not_change_what_absorbs():
    assert hidden_in(apparatus=replace(DECLARED, launch_uncertainty=1e-4)) == THREE_LEVELS


def test_shifts_that_are_free_in_each_run_absorb_what_goes_with_the_run():
    hidden = hidden_in(TumblePlan(temperatures=LOOP), Apparatus())
    assert hidden["temperature-hysteresis"] == ("K0",)
    assert hidden["scale-factor-temperature-quadratic"] == ("K1",)


def test_more_positions_and_levels_show_more():
    assert "odd-quadratic" not in hidden_in(TumblePlan(positions=16, temperatures=(T0,)))
    hidden = hidden_in(TumblePlan(temperatures=LOOP, timed=True))
    assert set(THREE_LEVELS) - set(hidden) == {
        name for name in THREE_LEVELS if "temperature" in name or name == "break-shift"
    }


def test_an_effect_that_is_not_brought_about_is_absorbed_by_nothing():
    assert hidden_in(ONE_RUN)["k2-temperature"] == ()


@pytest.mark.parametrize("name", THREE_LEVELS)
def test_the_coefficients_carry_the_effect_and_none_is_superfluous(name):
    comparison, _, _ = design()
    model = comparison.model
    jacobian = model.jacobian(comparison.parameters)
    instances = list(instances_of(effect(name), model.conditions))
    columns = np.stack([column_of(item, model.conditions) for item in instances], axis=1)
    carriers = carriers_in(model, comparison.parameters)(effect(name))

    def left(names):
        own = jacobian[:, [n in names for n in model.names]]
        rest = columns - own @ np.linalg.lstsq(own, columns, rcond=None)[0]
        return (np.linalg.norm(rest, axis=0) / np.linalg.norm(columns, axis=0)).max()

    assert left(carriers) < 0.05
    assert all(left(set(carriers) - {one}) > 0.05 for one in carriers)


# -- how small an effect can be --------------------------------------------------------------------


def sizes(apparatus=DECLARED):
    return {size.id: size for size in smallest_detectable(design(apparatus=apparatus)[2])}


@pytest.mark.parametrize("name", ["k2-temperature", "backlash", "fourth-order"])
def test_the_smallest_size_is_found_nine_times_in_ten(name):
    comparison, found, family = design()
    place = [item.id for item in found.effects].index(name)
    unit = found.directions[:, list(found.owner).index(place)]
    length = found.length[list(found.owner).index(place)]
    rng = np.random.default_rng(3)
    noise = comparison.space.left_of(rng.standard_normal((len(comparison.record), 300)))
    seen = unit * length * sizes()[name].value + noise.T
    others = [family._replace(comparison=comparison._replace(seen=one)) for one in seen]
    p = np.array([judge(other).effects[place] for other in others]) * family.tests
    low, high = stats.binom.ppf([0.001, 0.999], 300, 0.9) / 300
    assert low <= (p < 0.01).mean() <= high


def test_an_undeclared_head_makes_the_test_look_better_than_it_is():
    assert sizes()["fourth-order"].value > 3.0 * sizes(Apparatus())["fourth-order"].value


def test_sizes_have_the_unit_of_what_they_are_the_size_of():
    found = sizes()
    assert found["warm-up"].unit == "g"
    assert found["foundation-tilt"].unit == "rad/h"  # and not the rad of its daily part


# -- what looks alike ------------------------------------------------------------------------------


def exact_class(found, name):
    return {name}.union(*(item.exact for item in aliases(found) if item.id == name))


def test_one_direction_is_one_class():
    _, found, _ = design()
    assert exact_class(found, "fourth-order") == {"scale-factor-asymmetry", "fourth-order"}
    assert exact_class(found, "cross-axis-cubic") == {"cross-axis-cubic", "dead-zone"}
    assert exact_class(found, "stroke-offset") == {"stroke-offset"}


def test_more_positions_break_the_class():
    _, found, _ = design(TumblePlan(positions=16, temperatures=(T0,)))
    assert exact_class(found, "fourth-order") == {"fourth-order"}


def test_near_ones_come_with_their_cosine():
    table = {item.id: item for item in aliases(design()[1])}
    assert dict(table["backlash"].near)["hysteresis"] == pytest.approx(0.986, abs=0.002)
    assert dict(table["hysteresis"].near)["backlash"] == dict(table["backlash"].near)["hysteresis"]
    assert table["warm-up"].exact == ("bias-drift",)
    assert table["fourth-order"].exact == ("scale-factor-asymmetry",)


def test_effects_with_opposite_signs_are_not_alike():
    _, found, _ = design()
    ids = [item.id for item in found.effects]
    one, other = (list(found.owner).index(ids.index(n)) for n in ("dead-zone", "hysteresis"))
    directions = found.directions.copy()
    directions[:, other] = -directions[:, one]
    opposite = found._replace(directions=directions)
    assert exact_class(opposite, "hysteresis") == {"cross-axis-cubic", "hysteresis"}


def test_phases_of_one_effect_are_one_span():
    plan = TumblePlan(temperatures=LOOP, timed=True)
    comparison, found, _ = design(plan)
    tilt = next(i for i in found.instances if i.effect.id == "foundation-tilt" and not i.mixture[0])
    odd = tilt._replace(mixture=(0.0, np.cos(0.13), np.sin(0.13)))  # half-way between two phases
    unit = comparison.directions(odd)[:, 0]
    place = list(found.owner).index([e.id for e in found.effects].index("backlash"))
    directions = found.directions.copy()
    directions[:, place] = unit
    twin = found._replace(directions=directions)
    assert "foundation-tilt" in exact_class(twin, "backlash")


# -- a test without readings -----------------------------------------------------------------------


def test_the_audit_is_that_of_the_design_and_not_of_the_readings():
    one, two = (
        designed(simulate(seed=seed, effects=[effect("backlash").of(3e-5)]), T0, NOISE)
        for seed in (1, 2)
    )
    (found, first), (other, second) = _family(one), _family(two)
    assert undetectable(one, found) == undetectable(two, other)
    for a, b in zip(smallest_detectable(first), smallest_detectable(second), strict=True):
        assert a.value == pytest.approx(b.value, rel=0.01)


def test_a_design_with_the_noise_of_a_record_is_that_record():
    record = simulate(seed=3)
    real = compared(record, T0)
    planned = designed(record, T0, real.noise)
    one, other = (look.space.whiten(np.eye(len(record))) for look in (planned, real))
    assert np.allclose(one, other)
    assert planned.seen @ planned.seen == pytest.approx(real.seen @ real.seen)
    assert planned.noise.dof == planned.space.dof


def test_a_design_without_replicates_is_refused():
    record = simulate(plan=TumblePlan(strokes=2, temperatures=(T0,)), seed=0)
    with pytest.raises(InputError, match="plan two or more cycles"):
        designed(record, T0, NOISE)


def test_a_test_that_can_show_nothing_has_an_audit():
    comparison, _, _ = design()
    family = with_rates(family_of(comparison, [effect("fixture-offset")]))
    found = family.candidates
    assert [item.id for item in undetectable(comparison, found)] == ["fixture-offset"]
    assert (smallest_detectable(family), aliases(found)) == ((), ())


# -- the menu --------------------------------------------------------------------------------------


def on_menu(record):
    return {block.id: block for block in menu(record, T0)}


def test_positions_lie_between_the_old_ones():
    assert "22.5 deg" in on_menu(simulate(seed=0))["offset-positions"].action
    twelve = on_menu(simulate(plan=TumblePlan(positions=12), seed=0))["offset-positions"]
    assert twelve.plan.angles[:3] == (15.0, 45.0, 75.0)


def test_finer_positions_hold_the_old_ones():
    plan = on_menu(simulate(seed=0))["finer-positions"].plan
    assert plan.angles == tuple(np.arange(0.0, 361.0, 22.5))


def test_levels_are_met_in_both_senses():
    record = simulate(seed=0)
    block = on_menu(record)["other-sense"]
    assert block.plan.temperatures == (20.0, 80.0, 20.0)  # from -40 degC, where the record ends
    whole = joined(record, blank(block, record))
    model = base_model(whole, T0)
    senses = {sense for sense in model.conditions.heating[model.conditions.excess == 0.0] if sense}
    assert senses == {1.0, -1.0}


def test_one_level_cannot_be_met_in_two_senses():
    assert "other-sense" not in on_menu(simulate(plan=ONE_RUN, seed=0))


def test_mountings_turn_about_one_axis_each():
    found = on_menu(simulate(plan=TumblePlan(mountings=("p-",)), seed=0))
    assert found["reversed-mounting"].plan.mountings == ("p+",)
    assert found["other-axis"].plan.mountings == ("o-",)


def test_unknown_temperatures_stay_at_t0():
    record = simulate(plan=ONE_RUN, seed=0)
    unknown = replace(record, temperature=np.full(len(record), np.nan))
    assert on_menu(unknown)["offset-positions"].plan.temperatures == (T0,)


# -- joining ---------------------------------------------------------------------------------------


def test_joined_records_follow_one_another():
    first, second = (simulate(plan=ONE_RUN, seed=seed) for seed in (1, 2))
    whole = joined(first, second)
    assert len(whole) == len(first) + len(second)
    assert whole.run_labels == ("1", "2")
    assert np.array_equal(whole.output[whole.run == 1], second.output)
    assert whole.time[whole.run == 1].min() == first.time.max() + 60.0 + 3600.0
    assert whole.position.tolist() == [*first.position, *second.position]
    assert joined(whole, first).run_labels == ("1", "2", "3")


def test_without_one_clock_there_is_none():
    first, second = (simulate(plan=ONE_RUN, seed=seed) for seed in (1, 2))
    assert joined(first, replace(second, time=None)).time is None


def test_positions_of_another_numbering_become_angles():
    first = simulate(plan=ONE_RUN, seed=1)
    other = simulate(plan=replace(ONE_RUN, positions=12), seed=1)
    assert not joined(first, other).position[len(first) :].any()


# -- what to measure next --------------------------------------------------------------------------


@cache
def asymmetric(size=20.0, temperatures=LOOP, seed=11):
    """A record with |a_i| of some standard deviations, and what is found in it."""
    plan = TumblePlan(temperatures=temperatures, timed=True)
    hidden = [effect("scale-factor-asymmetry").of(size * SIGMA)]
    record = simulate(plan=plan, noise=QUIET_HEAD, effects=hidden, seed=seed)
    return record, *found_in(record)


@cache
def asymmetric_proposals(**case):
    record, comparison, findings = asymmetric(**case)
    best, *rivals = [explanation.instances for explanation in findings.explanations]
    foreseen = outlooks(record, comparison.noise, T0)
    return proposals(comparison, foreseen, best, rivals)


@pytest.mark.parametrize(
    ("case", "proposed", "fewest"),
    [
        ({}, "offset-positions", 18),
        ({"size": 8.0, "temperatures": (20.0, 80.0, -40.0)}, "finer-positions", 100),
    ],
)
def test_the_proposed_measurement_leaves_one_name(case, proposed, fewest):
    record, _, findings = asymmetric(**case)
    assert sorted(names_of(findings)) == [["fourth-order"], ["scale-factor-asymmetry"]]
    best = asymmetric_proposals(**case)[0]
    assert best.block.id == proposed
    assert best.readings >= fewest
    hidden = [effect("scale-factor-asymmetry").of(case.get("size", 20.0) * SIGMA)]
    plan = replace(best.block.plan, temperatures=best.block.plan.temperatures * best.blocks)
    new = simulate(plan=plan, noise=QUIET_HEAD, effects=hidden, seed=100)
    assert len(new) == best.readings
    assert names_of(found_in(joined(record, new))[1]) == [["scale-factor-asymmetry"]]


def test_the_proposal_is_told_in_a_line():
    best = asymmetric_proposals()[0]
    pair = " from ".join(name for (name,) in names_of(asymmetric()[2]))
    times = f"{best.blocks} times " if best.blocks > 1 else ""
    assert best.text == (
        f"measure {times}2 strokes at 20 degC at positions 22.5 deg apart from the old ones:"
        f" {best.readings} readings tell {pair}"
    )


def test_the_ranking_is_by_time_and_without_the_useless():
    ranked = asymmetric_proposals()
    hours = [item.hours for item in ranked]
    assert hours == sorted(hours)
    useless = {"same-test", "longer-run", "re-clocked", "reversed-mounting"}
    assert not useless & {item.block.id for item in ranked}


def test_without_times_the_fewest_readings_win():
    record, _, _ = asymmetric()
    timeless = replace(record, time=None)
    comparison, findings = found_in(timeless)
    best, *rivals = [explanation.instances for explanation in findings.explanations]
    ranked = proposals(comparison, outlooks(timeless, comparison.noise, T0), best, rivals)
    readings = [item.readings for item in ranked]
    assert readings == sorted(readings)
    assert all(item.hours is None for item in ranked)


def test_proposals_repeat_to_the_last_digit():
    first = asymmetric_proposals()
    asymmetric_proposals.cache_clear()
    assert first == asymmetric_proposals()


@pytest.mark.parametrize("number", [1, 3])
@pytest.mark.parametrize("name", ["offset-positions", "30-deg-positions", "other-sense"])
def test_separation_is_the_noncentrality_of_all_readings_together(name, number):
    """Head errors shared by old and new readings, shifts of each new run: the long way."""
    record = simulate(seed=4).with_apparatus(
        head_uncertainty=2e-6, launch_uncertainty=9e-6, launch_sf_uncertainty=7e-6
    )
    outlook = next(o for o in outlooks(record, NOISE, T0) if o.block.id == name)
    one, two = (
        next(instances_of(effect(e), outlook.conditions))
        for e in ("scale-factor-asymmetry", "fourth-order")
    )
    c = outlook.conditions
    left = outlook.beside(column_of(two, c)[:, None], 1e-4 * column_of(one, c)[:, None])
    whole = record
    for seed in range(number):
        whole = joined(whole, simulate(plan=outlook.block.plan, seed=seed, declare=False))
    q = whole_q(whole, lambda c: 1e-4 * column_of(one, c), lambda c: column_of(two, c)[:, None])
    assert left.lengths(number)[0] == pytest.approx(q, rel=1e-3, abs=1e-3)


def test_a_shift_that_is_free_in_each_run_is_free_in_the_new_one():
    record = replace(simulate(seed=4), apparatus=Apparatus(head_uncertainty=2e-6))
    outlook = next(o for o in outlooks(record, NOISE, T0) if o.block.id == "other-sense")
    column = column_of(
        next(instances_of(effect("backlash"), outlook.conditions)), outlook.conditions
    )
    left = outlook.beside(np.empty((column.size, 0)), column[:, None])
    whole = joined(record, simulate(plan=outlook.block.plan, seed=1, declare=False))
    q = whole_q(
        whole,
        lambda c: column_of(next(instances_of(effect("backlash"), c)), c),
        lambda c: np.empty((c.angle.size, 0)),
    )
    assert left.lengths(1)[0] == pytest.approx(q, rel=1e-3)


def test_a_slope_that_rounding_alone_would_tell_is_none():
    # the mean temperature of several units is T0 but for the last digit: new readings at -20 degC
    # were foreseen at 1e27 g, and the search ended there
    record = simulate(plan=TumblePlan(temperatures=(20.0, 60.0)), seed=4)
    record = replace(record, temperature=record.temperature * (1.0 - 2e-16))
    assert record.temperature.min() < T0
    for outlook in outlooks(record, NOISE, T0):
        gain = outlook.conditions.gain
        assert gain.min() > 0.999  # no slope below T0
        assert gain.max() < 1.0 + 520e-6 * 60.0 + 1e-3


def test_a_rival_with_a_time_constant_is_fitted_with_any():
    """Warm-up of one time constant beside warm-up of nearly the same leaves next to nothing."""
    record = simulate(plan=TumblePlan(timed=True), seed=4)
    comparison = compared(record, T0)
    c = comparison.model.conditions
    warm = next(i for i in instances_of(effect("warm-up"), c) if i.shape["tau"] > 300.0)
    near = warm._replace(shape={"tau": warm.shape["tau"] * 1.03})
    foreseen = outlooks(record, comparison.noise, T0)
    seen = comparison.space.see(20.0 * SIGMA * column_of(warm, c))
    assert not proposals(comparison._replace(seen=seen), foreseen, [warm], [[near]])


def test_a_fixture_angle_and_another_t0_are_kept():
    plan = TumblePlan(delta0=0.002, timed=True)
    record = replace(simulate(plan=plan, seed=1), reference_temperature=25.0, serial=None)
    assert len(outlooks(record, NOISE, 25.0, 0.002)) == len(menu(record, 25.0))


def test_the_public_record_is_untouched():
    record = accelcal.simulate(seed=1)
    before = record.output.copy()
    outlooks(record, NOISE, T0)
    assert np.array_equal(record.output, before)


def test_a_chance_that_a_double_cannot_hold_beside_one_is_no_fault():
    """With heavy tails the family amounts to more tests than 1 / epsilon, and discover failed."""
    family = design()[2]
    usual, rare = (smallest_detectable(own) for own in (family, family._replace(tests=1e20)))
    for one, other in zip(usual, rare, strict=True):
        assert 1.5 * one.value < other.value < 5.0 * one.value


def test_the_part_of_an_eccentricity_that_the_coefficients_take_up_has_no_value():
    """It was 0 +- 1e15 urad, and K0 and K2 became as uncertain as that."""
    plan = TumblePlan(temperatures=(T0,), mountings=("o+", "o-"), strokes=4)
    hidden = effect("head-eccentricity").of(3e-4, cosine=-2e-4)
    quiet = NoiseComponents(reading=2e-6, head=1e-6, launch=0.0, launch_sf=0.0)
    record = simulate(plan=plan, noise=quiet, effects=[hidden], seed=5)
    found = accelcal.discover(record)
    (eccentricity,) = found.effects
    told = eccentricity.parameters
    assert (told["sine"].value, told["sine"].standard_uncertainty) == (None, None)
    assert told["cosine"].value == pytest.approx(-2e-4, abs=told["cosine"].expanded_uncertainty)
    assert told["cosine"].expanded_uncertainty < 5e-6
    assert "sine = unknown, as the coefficients take it up" in str(found)
    again = accelcal.Discovery.from_json(found.to_json())
    assert again.effects == found.effects
    for table in accelcal.fit(record, model=again).tables:
        U = {name: one.expanded_uncertainty for name, one in table.coefficients.items()}
        assert 2e-4 < min(U.pop("K0"), U.pop("K2")) < 5e-4  # as of a sine as large as the cosine
        assert max(U.values()) < 1e-5


# -- names that any pattern of few positions would get ---------------------------------------------

QUIET_STAND = NoiseComponents(reading=5e-6, head=2e-6, launch=1e-5, launch_sf=5e-6)


def patterned(positions, pattern=None, effects=(), seed=0, temperatures=(T0, 60.0)):
    """A record to which a pattern of the head angle [rad] is added [g]."""
    plan = TumblePlan(positions=positions, strokes=4, temperatures=temperatures)
    record = simulate(plan=plan, noise=QUIET_STAND, effects=effects, seed=seed)
    added = 0.0 if pattern is None else 1.35 * pattern(np.radians(record.angle))
    return replace(record, output=record.output + added)


def sixth(th):
    return 2e-5 * np.cos(6.0 * th)


def of_ranges(th):
    return 2.5e-5 * (np.abs(np.cos(th)) > 0.5)


@pytest.mark.parametrize(("positions", "pattern"), [(12, sixth), (16, of_ranges)])
def test_sets_of_effects_that_any_even_pattern_would_get_are_not_sure(positions, pattern):
    """cos 6 th took K2 from 123 to -494 ug/g^2, under names that were certain."""
    found = accelcal.discover(patterned(positions, pattern))
    assert {item.id for item in found.effects} == {"fourth-order", "scale-factor-asymmetry"}
    assert set(found.doubtful) == {"fourth-order", "scale-factor-asymmetry"}
    (said,) = (note for note in found.notes if "patterns of their kind" in note)
    assert "measure at positions between these" in said


def test_more_positions_show_that_it_is_something_else():
    found = accelcal.discover(patterned(24, sixth))
    assert (found.effects, found.unexplained is None) == ((), False)


@pytest.mark.parametrize("positions", [8, 10])
def test_one_effect_that_any_even_pattern_would_get_is_not_sure(positions):
    """A voltmeter with two ranges had a name that was certain."""
    found = accelcal.discover(patterned(positions, of_ranges))
    assert [item.id for item in found.effects] == ["scale-factor-asymmetry"]
    assert found.doubtful == ("scale-factor-asymmetry",)
    assert any("not sure: these positions show" in note for note in found.notes)


def by_chance(seed):
    by_angle = np.random.default_rng(seed).standard_normal(12)

    def pattern(th):
        return 1.5e-5 * by_angle[np.round(np.degrees(th) / 30.0).astype(int) % 12]

    return pattern


def test_patterns_of_chance_are_hardly_named_as_certain_at_few_positions():
    found = [accelcal.discover(patterned(12, by_chance(seed))) for seed in range(6)]
    doubted = [one for one in found if {item.id for item in one.effects} <= set(one.doubtful)]
    assert len(doubted) >= 5


@pytest.mark.parametrize(
    ("positions", "effects"),
    [
        (16, [effect("scale-factor-asymmetry").of(3e-4)]),
        (24, [effect("fourth-order").of(2e-4)]),
        (16, [effect("scale-factor-asymmetry").of(4e-4), effect("cross-axis-cubic").of(2e-4)]),
    ],
    ids=["asymmetry", "fourth order", "asymmetry and cubic"],
)
def test_what_the_catalogue_has_stays_sure(positions, effects):
    found = accelcal.discover(patterned(positions, effects=effects))
    assert {item.id for item in found.effects} == {item.effect.id for item in effects}
    assert found.doubtful == ()


def step_of_gain(th):
    """The voltmeter's upper range, from 0.2 g on, is steeper."""
    a = np.cos(th)
    return 8e-4 * np.sign(a) * np.maximum(np.abs(a) - 0.2, 0.0)


def fold(th):
    """The output bends alike on both sides, from 0.2 g on."""
    return 2e-4 * np.maximum(np.abs(np.cos(th)) - 0.2, 0.0)


@pytest.mark.parametrize(
    ("pattern", "name", "what"),
    [
        (step_of_gain, "odd-quadratic", "with another slope"),
        (fold, "fourth-order", "whose output bends the same way on both sides"),
    ],
)
def test_an_effect_that_a_voltmeter_of_two_ranges_explains_as_well_is_not_sure(pattern, name, what):
    """On 16 positions, where two and three patterns of their kind show, they were certain."""
    found = accelcal.discover(patterned(16, pattern))
    assert [item.id for item in found.effects] == [name]
    assert found.doubtful == (name,)
    assert any(f"a voltmeter {what} beyond " in note for note in found.notes)


@pytest.mark.parametrize(
    ("power", "size", "term"),
    [(5, 3e-5, "|a_p|^5 sign a_p"), (2, 6e-5, "|a_p|^2 sign a_p")],
    ids=["fifth", "second"],
)
def test_a_cube_that_another_power_explains_better_is_not_sure(power, size, term):
    """On 16 positions every such power was a cube, for certain."""

    def odd_power(th):
        return size * np.abs(np.sin(th)) ** power * np.sign(np.sin(th))

    odd = patterned(16, odd_power, temperatures=(T0, 80.0, -40.0))
    found = accelcal.discover(odd)
    assert [item.id for item in found.effects] == ["cross-axis-cubic"]
    assert found.doubtful == ("cross-axis-cubic",)
    assert any(f"a term {term} explains these readings as well" in note for note in found.notes)


@pytest.mark.parametrize("positions", [24, 36])
def test_an_output_that_saturates_is_no_sure_odd_quadratic(positions):
    """As tanh(4 a_i) it was one for certain, as a power does not explain it better."""
    found = accelcal.discover(patterned(positions, lambda th: 16e-5 * np.tanh(4.0 * np.cos(th))))
    assert found.doubtful == ("odd-quadratic",)
    assert any("an output that saturates, as tanh(a_i / 0." in note for note in found.notes)


def test_an_effect_that_shows_what_no_pattern_of_its_kind_has_is_sure():
    """A dead zone mostly goes with the sign of sin th, of which kind 12 positions show two."""
    plan = TumblePlan(positions=12, temperatures=(T0,), timed=True)
    found = accelcal.discover(simulate(plan=plan, effects=[effect("dead-zone").of(1e-4)], seed=1))
    assert [item.id for item in found.effects] == ["dead-zone"]
    assert found.doubtful == ()


def test_a_settling_by_a_logarithm_is_no_sure_warm_up():
    record = simulate(plan=TumblePlan(timed=True), seed=1)
    start = np.array([record.time[record.run == run].min() for run in (0, 1, 2)])
    settling = 2e-5 * np.log1p((record.time - start[record.run]) / 100.0)
    settled = replace(record, output=record.output + 1.35 * settling)
    found = accelcal.discover(settled)
    assert [item.id for item in found.effects] == ["warm-up"]
    assert found.doubtful == ("warm-up",)
    assert any("with the logarithm of the time in each run" in note for note in found.notes)


# -- names that the test itself could make ---------------------------------------------------------


def test_a_backlash_that_runs_ahead_is_not_sure():
    found = accelcal.discover(simulate(effects=[effect("backlash").of(-3e-5)], seed=1))
    assert [item.id for item in found.effects] == ["backlash"]
    assert found.doubtful == ("backlash",)
    assert found.notes[0].startswith("backlash is not sure: its lag is below zero")
    lagging = accelcal.discover(simulate(effects=[effect("backlash").of(3e-5)], seed=1))
    assert lagging.doubtful == ()


def test_what_rests_on_a_doubtful_effect_is_not_sure_either():
    """The hysteresis beside it was sure, though each takes back what the other does."""
    both = [effect("hysteresis").of(8e-5), effect("backlash").of(-1e-4)]
    found = accelcal.discover(simulate(effects=both, seed=1))
    assert set(found.doubtful) == {"hysteresis", "backlash"}
    apart = [effect("k2-temperature").of(2e-6), effect("backlash").of(-3e-5)]
    found = accelcal.discover(simulate(effects=apart, seed=1))
    assert {item.id for item in found.effects} == {item.effect.id for item in apart}
    assert found.doubtful == ("backlash",)


def test_a_warm_up_of_the_first_readings_alone_is_not_sure():
    """A hysteresis whose first reading is not reached forward brought one along, as certain."""
    record = simulate(effects=[effect("hysteresis").of(3e-5)], plan=TumblePlan(timed=True), seed=1)
    first = np.diff(record.run, prepend=-1) > 0
    other = replace(record, output=record.output + np.where(first, 1.35 * 6e-5, 0.0))
    found = accelcal.discover(other)
    assert "hysteresis" in {item.id for item in found.effects}
    assert found.doubtful == ("warm-up",)
    warm = simulate(effects=[effect("warm-up").of(1e-4, tau=600.0)], plan=USUAL, seed=1)
    assert "warm-up" not in accelcal.discover(warm).doubtful


def test_levels_on_offer_are_temperatures_of_a_test():
    hot = replace(accelcal.simulate(seed=1), temperature=np.full(162, 240.0))
    offered = [block.action for block in menu(hot, 240.0) if block.id == "more-levels"]
    assert offered == ["2 strokes at 200, 220, 250 degC, two more levels on either side of T0"]
