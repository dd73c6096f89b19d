"""`fit` with a model: U of the coefficients counts what else its effects may be in the readings."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import accelcal
from accelcal.calibrate.fit import calibrate_many
from accelcal.calibrate.options import Options
from accelcal.cli.main import main
from accelcal.effects.without_sources import without_sources
from accelcal.errors import AccelcalWarning
from accelcal.results.covariance import ALTERNATIVES, BY_OTHERS, LOOK_ALIKES, rows_of
from accelcal.simulation import TumblePlan
from accelcal.temperature.laws import with_misalignment

TIMED = TumblePlan(timed=True)
FINE = TumblePlan(positions=24, temperatures=(20.0,))
ASYMMETRY = accelcal.effect("scale-factor-asymmetry")
FOURTH_ORDER = accelcal.effect("fourth-order")
AT_90 = accelcal.effect("position-error").of(1.4e-4, at=90.0)
SLIGHT = accelcal.effect("warm-up").of(4e-5, tau=2000.0)
SAID = "U counts what else the effects may be; "


def simulated(hidden, seed, plan=None):
    return accelcal.simulate(plan=plan or TumblePlan(), effects=[hidden], seed=seed)


def taken_for_another(hidden, named, plan=None):
    """A discovery that names another effect than the hidden one, or another place."""
    for seed in range(9):
        model = accelcal.discover(simulated(hidden, seed, plan))
        if named(*model.effects):
            return model
    raise AssertionError("the discovery is always right")


@pytest.fixture(scope="module")
def not_of_fourth_order():
    hidden = FOURTH_ORDER.of(1.5e-4)
    return hidden, taken_for_another(hidden, lambda found: found.id == ASYMMETRY.id)


@pytest.fixture(scope="module")
def warm_up_named_a_drift():
    return taken_for_another(SLIGHT, lambda found: found.id == "bias-drift", TIMED)


def within(calibration, names):
    true = {"k0": 3.324e-3, "k2": 105e-6, "k3": 87e-6, "delta": 1.15e-3, "delta_ip": 20e-6}
    own = calibration.tables[0].error_model
    return [abs(own[name].value - true[name]) < own[name].expanded_uncertainty for name in names]


def test_k2_is_within_u_where_the_discovery_named_the_wrong_one_of_two(not_of_fourth_order):
    """It was within U in none of them, off by ten times U."""
    hidden, model = not_of_fourth_order
    found = [accelcal.fit(simulated(hidden, seed), model=model) for seed in range(20, 26)]
    assert all(all(within(each, ["k2"])) for each in found)
    for each in found:
        (said,) = (text for text in each.warnings if text.startswith(SAID))
        assert said.removeprefix(SAID).startswith("if it is fourth-order in truth: k2 ")
        assert not any("U does not count what else" in text for text in each.warnings)
        budget = each.tables[0].budget
        assert budget["K2"][LOOK_ALIKES] > 10.0 * budget["K2"]["effects"]
        assert budget["K1"].get(LOOK_ALIKES, 0.0) < 0.1 * budget["K1"]["head"]


def test_all_coefficients_are_within_u_where_another_position_was_named():
    model = taken_for_another(AT_90, lambda found: found.parameters["at"].value != 90.0)
    names = ["k0", "k2", "k3", "delta", "delta_ip"]
    found = [within(accelcal.fit(simulated(AT_90, s), model=model), names) for s in range(20, 26)]
    assert np.mean(found) >= 0.9
    assert np.mean([all(each) for each in found]) >= 0.8


def test_the_bias_and_its_law_are_within_u_where_a_warm_up_was_named_a_drift(
    warm_up_named_a_drift,
):
    model = warm_up_named_a_drift
    found = [accelcal.fit(simulated(SLIGHT, seed, TIMED), model=model) for seed in range(20, 26)]
    assert sum(within(each, ["k0"])[0] for each in found) >= 5
    for each in found:
        at_T0 = each.temperature_model.k0.at_T0
        bias = each.tables[0].error_model["k0"]
        assert at_T0.expanded_uncertainty == pytest.approx(bias.expanded_uncertainty, rel=0.05)
        assert ALTERNATIVES in each.temperature_model.shares


@pytest.mark.parametrize(("width", "first"), [(1.2e-4, -0.9), (3e-4, 0.5)])
def test_what_the_readings_do_not_tell_of_a_look_alike_counts_as_well(width, first):
    """Of the first level of a loop its middle alone did: K0 was off by 100 ug with U of 15."""
    plan = TumblePlan(temperatures=(20.0, 50.0, 80.0, -40.0), timed=True)
    hidden = accelcal.effect("temperature-hysteresis").of(width, first_level=first)
    record = simulated(hidden, 3, plan)
    model = accelcal.discover(record)
    (found,) = model.effects
    assert "temperature-hysteresis" in found.indistinguishable
    (told,) = (note for note in model.otherwise if "temperature-hysteresis in truth" in note)
    assert told.endswith(", at the farthest, as these readings do not tell first_level")
    (bias,) = (each.after for each in model.coefficients if each.coefficient == "K0")
    assert abs(bias.value - 3.324e-3) < bias.expanded_uncertainty
    assert within(accelcal.fit(record, model=model), ["k0"]) == [True]


ONE_RUN = TumblePlan(timed=True, temperatures=(20.0,))
EACH_LEVEL_ONCE = TumblePlan(timed=True, temperatures=(20.0, 50.0, 80.0))
BACK_AGAIN = TumblePlan(timed=True, temperatures=(20.0, 50.0, 80.0, 20.0))
ANY_LONGER = "if it is warm-up with tau = 3.18e+04 s or more in truth: k0 "
NOT_COUNTED = "warm-up with tau of 3.18e+04 s or any longer explains these readings as well as bias"


def bias_of(model):
    return next(each.after for each in model.coefficients if each.coefficient == "K0")


@cache
def u_of_bias(hidden, seed, plan, start=0.0):
    """U of K0 by the discovery and by a fit with it, both with the truth within.

    Beside a drift K0 is the bias at the first reading, `start` away from that in the end.
    """
    record = simulated(hidden, seed, plan)
    model = accelcal.discover(record)
    drifts = [found.id for found in model.effects] == ["bias-drift"]
    true = 3.324e-3 + (start if drifts else 0.0)
    bias = bias_of(model)
    fitted = accelcal.fit(record, model=model)
    own = fitted.tables[0].error_model["k0"]
    for told, said in ((bias, model.notes), (own, fitted.warnings)):
        assert abs(told.value - true) < told.expanded_uncertainty
        assert any(note.startswith(NOT_COUNTED) for note in said) is drifts
    return model, (bias.expanded_uncertainty, own.expanded_uncertainty)


def beside_a_drift(*temperatures):
    """A discovery in a record of a long warm-up and an opposed drift, as two effects."""
    plan = TumblePlan(timed=True, temperatures=temperatures)
    both = [accelcal.effect("warm-up").of(1e-4, tau=1800.0), accelcal.effect("bias-drift").of(6e-5)]
    return accelcal.discover(accelcal.simulate(plan=plan, effects=both, seed=1))


def test_a_drift_that_hides_beside_a_warm_up_is_told():
    """The warm-up alone was named, with a bias 66 ug off and a slope off by 12 U."""
    found = beside_a_drift(20.0, 80.0, -40.0)
    assert [item.id for item in found.effects] == ["warm-up"]
    (said,) = (note for note in found.notes if note.startswith("bias-drift of "))
    assert "with other values of k0, lam1 and lam2; no U counts it: measure longer runs," in said
    again = beside_a_drift(20.0, 80.0, -40.0, 20.0)
    assert {item.id for item in again.effects} == {"warm-up", "bias-drift"}
    assert not any(note.startswith("bias-drift of ") for note in again.notes)


def test_no_drift_is_told_where_another_time_constant_alone_explains_the_readings():
    """One of -0.2 ug/h was, with other values of k0, which the U of k0 counts."""
    plan = TumblePlan(timed=True, temperatures=(20.0, 80.0, -40.0, 20.0))
    hidden = accelcal.effect("warm-up").of(1e-4, tau=3600.0)
    found = accelcal.discover(accelcal.simulate(plan=plan, effects=[hidden], seed=1))
    assert [item.id for item in found.effects] == ["warm-up"]
    assert not any(note.startswith("bias-drift of ") for note in found.notes)


def test_no_drift_hides_beside_a_short_warm_up():
    hidden = accelcal.effect("warm-up").of(1e-4, tau=600.0)
    found = accelcal.discover(simulated(hidden, 1, TIMED))
    assert not any(note.startswith("bias-drift of ") for note in found.notes)


LONG = accelcal.effect("warm-up").of(2e-4, tau=9000.0)
LONGER = accelcal.effect("warm-up").of(2e-4, tau=30_000.0)


@pytest.mark.parametrize(
    ("plan", "hidden", "seed"),
    [
        (ONE_RUN, accelcal.effect("warm-up").of(2e-4, tau=4000.0), 1),
        (ONE_RUN, LONG, 10),
        (EACH_LEVEL_ONCE, LONG, 3),
        (EACH_LEVEL_ONCE, LONGER, 3),
        (BACK_AGAIN, LONG, 3),
        (BACK_AGAIN, LONGER, 3),
    ],
)
def test_the_bias_is_within_u_where_a_warm_up_lasts_longer_than_the_runs(plan, hidden, seed):
    """It was off by up to 20 U: the search of tau ended at the longest run."""
    u_of_bias(hidden, seed, plan, start=2e-4)


def test_u_counts_a_warm_up_that_may_be_any_longer():
    """The readings deny a drift, and tell the time constant too poorly to tell where it ends."""
    model, found = u_of_bias(LONG, 3, BACK_AGAIN, start=2e-4)
    assert [each.id for each in model.effects] == ["warm-up"]
    assert any(note.startswith(ANY_LONGER) for note in model.otherwise)
    assert all(4e-4 < u < 8e-4 for u in found)


def test_a_warm_up_that_ends_in_the_runs_keeps_its_u():
    hidden = accelcal.effect("warm-up").of(2e-4, tau=1000.0)
    for plan in (ONE_RUN, EACH_LEVEL_ONCE):
        model, found = u_of_bias(hidden, 3, plan)
        assert model.otherwise == ()
        assert max(found) < 2e-5


@pytest.mark.parametrize(("plan", "seed"), [(ONE_RUN, 3), (EACH_LEVEL_ONCE, 4), (ONE_RUN, 5)])
def test_a_drift_keeps_its_u_and_a_long_warm_up_is_told(plan, seed):
    model, found = u_of_bias(accelcal.effect("bias-drift").of(2e-4), seed, plan)
    (named,) = model.effects
    assert (named.id, named.indistinguishable) == ("bias-drift", ("warm-up",))
    assert max(found) < 2e-5


def test_nothing_is_told_of_a_drift_where_a_level_is_met_again():
    """A warm-up begins anew in each run, and a drift does not."""
    model = accelcal.discover(simulated(accelcal.effect("bias-drift").of(2e-4), 3, BACK_AGAIN))
    assert not any(note.startswith(NOT_COUNTED) for note in model.notes)


def test_laws_from_the_readings_count_what_those_from_the_tables_count(warm_up_named_a_drift):
    """They counted nothing of the effects: U of k0 was 15 ug in place of 70."""
    record = simulated(SLIGHT, 21, TIMED)
    tables, readings = (
        accelcal.fit(record, model=warm_up_named_a_drift, temperature_laws=laws).temperature_model
        for laws in ("tables", "readings")
    )
    for name in ("at_T0", "above", "below"):
        own, other = getattr(readings.k0, name), getattr(tables.k0, name)
        assert own.expanded_uncertainty == pytest.approx(other.expanded_uncertainty, rel=0.05)
    assert readings.shares.keys() == tables.shares.keys() == {ALTERNATIVES}


def test_what_else_an_effect_may_be_does_not_bend_the_laws_beside_it():
    """They left the tables 38 ug off the law, which the readings follow to 4 ug."""
    plan = TumblePlan(temperatures=(20.0, 50.0, 80.0, 0.0, -20.0, -40.0), strokes=4, timed=True)
    record = simulated(accelcal.effect("bias-temperature-quadratic").of(4e-8), 6, plan)
    found = accelcal.fit(record, model=accelcal.discover(record))
    law = found.temperature_model.k0
    assert law.above.expanded_uncertainty > 1e-6  # the look-alikes make it ten times as large
    for table in found.tables:
        rise = table.temperature_degC - 20.0
        expected = law.at_T0.value + rise * (law.above if rise > 0.0 else law.below).value
        assert table.error_model["k0"].value == pytest.approx(expected, abs=1e-5)


def test_laws_beside_an_effect_have_the_uncertainty_of_those_from_the_readings():
    """U was 0.74 to 0.94 of it: errors of the effect were weighed as if others told its size."""
    plan = TumblePlan(temperatures=(20.0, 50.0, 80.0, 0.0, -20.0, -40.0), strokes=4, timed=True)
    hidden = accelcal.effect("bias-temperature-quadratic").of(4e-8)
    model, record = accelcal.discover(simulated(hidden, 6, plan)), simulated(hidden, 7, plan)
    tables, readings = (
        accelcal.fit(record, model=model, temperature_laws=laws).temperature_model.k0.above
        for laws in ("tables", "readings")
    )
    assert tables.expanded_uncertainty == pytest.approx(readings.expanded_uncertainty, rel=0.01)


def test_the_misalignment_of_the_tables_brings_what_its_covariance_holds_of_others():
    model = accelcal.fit(accelcal.simulate(seed=1)).temperature_model
    one = np.eye(len(model.covariance_names))
    readings, tables = (
        replace(model, shares={LOOK_ALIKES: rows_of(size * one)}) for size in (1.0, 2.0)
    )
    found = with_misalignment(readings, tables)
    share = dict(zip(found.covariance_names, found.share([LOOK_ALIKES]).diagonal(), strict=True))
    assert {name for name, own in share.items() if own == 2.0} == {
        name for name in share if name.startswith("delta ")
    }


@pytest.mark.parametrize("entry", [ASYMMETRY, FOURTH_ORDER], ids=lambda entry: entry.id)
def test_readings_that_tell_which_it_is_leave_the_other_one_out(entry, not_of_fourth_order):
    """24 positions deny that |a| is a^4; a model that names the wrong one is no better for it."""
    _, model = not_of_fourth_order
    hidden = entry.of(3e-4)
    found = accelcal.fit(simulated(hidden, 20, FINE), model=model)
    assert within(found, ["k2"]) == [True]
    counted = LOOK_ALIKES in found.tables[0].budget["K2"]
    assert counted is (entry is FOURTH_ORDER)


def test_its_own_readings_do_not_judge_a_discovery_anew():
    """They chose the effect, as it suits their noise: U of k2 was 25 ug, that of discover 208."""
    hidden, plan = FOURTH_ORDER.of(6e-5), TumblePlan(positions=12)
    record = replace(simulated(hidden, 1, plan), sha256="0" * 64)
    model = accelcal.discover(record)
    assert ASYMMETRY.id in model.effects[0].indistinguishable
    (of_discovery,) = (c.after for c in model.coefficients if c.coefficient == "K2")
    own, others = (
        accelcal.fit(each, model=model).tables[0].error_model["k2"].expanded_uncertainty
        for each in (record, replace(record, sha256="1" * 64))
    )
    assert own == pytest.approx(of_discovery.expanded_uncertainty, rel=0.1)
    assert others < 0.5 * own


def test_what_is_like_no_other_effect_keeps_its_u():
    hidden = accelcal.effect("hysteresis").of(3e-5)
    model = accelcal.discover(simulated(hidden, 1))
    found, plain = (
        accelcal.fit(simulated(hidden, 2), model=model),
        accelcal.fit(accelcal.simulate(seed=2)),
    )
    for own, other in zip(found.tables, plain.tables, strict=True):
        assert not any(set(BY_OTHERS) & set(parts) for parts in own.budget.values())
        assert own.shares == {}
        for name in ("k0", "k2", "k3"):
            assert own.error_model[name].expanded_uncertainty == pytest.approx(
                other.error_model[name].expanded_uncertainty, rel=0.05
            )


def test_use_that_takes_up_the_effect_counts_it_once(not_of_fourth_order):
    hidden, model = not_of_fourth_order
    found = accelcal.fit(simulated(hidden, 20), model=model)
    assert found.tables[0].error_model["k2"].expanded_uncertainty > 4e-4
    at_1_g = accelcal.simulate(effects=[hidden], seed=21, plan=TumblePlan()).output[0]
    for own in ({}, {"run": "1"}):
        with pytest.warns(AccelcalWarning, match="could not tell it from fourth-order"):
            measured = accelcal.apply(found, [at_1_g], 20.0, a_p=0.0, same_launch=True, **own)
        assert abs(measured.value[0] - 1.0) < measured.expanded_uncertainty[0] < 6e-5
    assert accelcal.budget(found, 1.0, temperature=20.0).expanded_uncertainty[0] < 6e-5
    with pytest.warns(AccelcalWarning, match="the coefficients are free of it"):
        k2 = accelcal.coefficients_at(found, 20.0)["k2"]
    assert k2.expanded_uncertainty > 4e-4


def test_what_is_left_has_its_own_degrees_of_freedom(not_of_fourth_order):
    """U of K2 kept the factor of the part that is left out, and was up to a fifth too small."""
    hidden, model = not_of_fourth_order
    plan = TumblePlan(strokes=4, temperatures=(20.0,))
    record = accelcal.simulate(plan=plan, effects=[hidden], seed=1, declare=False)
    alone = replace(model, effects=[replace(e, indistinguishable=()) for e in model.effects])
    calibration, other = (accelcal.fit(record, model=own) for own in (model, alone))
    found, wanted = calibration.tables[0], other.tables[0]
    left = without_sources(calibration, [LOOK_ALIKES]).tables[0]
    assert found.error_model["k2"].dof > 100.0 * wanted.error_model["k2"].dof
    for name, quantity in wanted.error_model.items():
        own = left.error_model[name]
        assert own.dof == pytest.approx(quantity.dof, rel=0.01)
        assert own.expanded_uncertainty == pytest.approx(quantity.expanded_uncertainty, rel=2e-3)


def test_a_comparison_sees_a_change_that_is_smaller_than_what_is_open(not_of_fourth_order):
    """At the same positions it does not matter which of two effects it is."""
    hidden, model = not_of_fourth_order
    found = accelcal.fit(simulated(hidden, 20), model=model)
    changed = replace(accelcal.AL15, k2=505e-6)
    assert accelcal.compare(found, simulated(hidden, 21)).p_value > 0.01
    other = accelcal.simulate(changed, effects=[hidden], seed=21)
    assert accelcal.compare(found, other).p_value < 1e-6


def test_a_comparison_elsewhere_says_that_the_effects_may_be_others(not_of_fourth_order):
    """At other positions it does matter: readings without a change disagreed without a word."""
    hidden, model = not_of_fourth_order
    found = accelcal.fit(simulated(hidden, 20), model=model)
    there = accelcal.compare(found, simulated(hidden, 21, FINE))
    assert there.p_value < 1e-3
    assert any("if they are others that its warnings tell of" in note for note in there.notes)
    plain = accelcal.compare(accelcal.fit(accelcal.simulate(seed=20)), accelcal.simulate(seed=21))
    assert not any("count as they are named" in note for note in plain.notes)


def test_many_tables_have_it_as_one_has(not_of_fourth_order):
    hidden, model = not_of_fourth_order
    plain = accelcal.simulate(seed=22)
    records = [simulated(hidden, 20), plain, simulated(hidden, 21)]
    ((_, stack),) = calibrate_many(records, Options(model=model)).stacks
    column = stack.quantities.error_model.columns()["k2_expanded_uncertainty"]
    for place, record in enumerate(records):
        alone = accelcal.fit(record, model=model)
        own = [table.error_model["k2"].expanded_uncertainty for table in alone.tables]
        assert column.reshape(3, -1)[place].tolist() == pytest.approx(own)


def test_the_document_keeps_it(not_of_fourth_order):
    hidden, model = not_of_fourth_order
    found = accelcal.fit(simulated(hidden, 20), model=model)
    assert set(found.tables[0].shares) == set(found.temperature_model.shares) == {LOOK_ALIKES}
    assert accelcal.Calibration.from_json(found.to_json()) == found
    document = json.loads(found.to_json())
    document["tables"][0]["covariance"]["shares"][LOOK_ALIKES].pop()
    with pytest.raises(accelcal.DocumentError, match="shares"):
        accelcal.Calibration.from_json(json.dumps(document))


def test_an_effect_that_the_unit_does_not_have_is_left_out(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    hidden = accelcal.effect("bias-drift").of(2e-4)
    accelcal.write_table(simulated(hidden, 3, EACH_LEVEL_ONCE), "table.csv")

    def told(*options):
        code = main(["discover", "table.csv", *options])
        return code, " ".join(capsys.readouterr().out.split())

    assert "drift of the bias (or warm-up of the bias)" in told()[1]
    code, part = told("--without", "warm-up")
    assert code == 0
    assert "drift of the bias." in part
    assert "warm-up" not in part
    assert told("--without", "warmup")[0] == 2
