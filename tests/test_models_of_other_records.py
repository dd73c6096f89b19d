"""A discovery used on another record: what it does not show there has no size from elsewhere."""

import csv
import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import accelcal
from accelcal.cli.program import program
from accelcal.errors import AccelcalWarning
from accelcal.results.beyond_uncertainty import LEFT_OUT, LESS_CERTAIN
from accelcal.simulation import TumblePlan

FIVE = TumblePlan(temperatures=(20.0, 80.0, 50.0, -40.0, 20.0))
FINE = TumblePlan(positions=24, temperatures=(20.0,))
AT_80 = TumblePlan(temperatures=(80.0,))


def simulated(plan, *effects, serial="A1", seed=1):
    return accelcal.simulate(
        replace(accelcal.AL15, serial=serial),
        plan,
        effects=[accelcal.effect(name).of(value) for name, value in effects],
        seed=seed,
    )


@cache
def searched(plan, *effects, seed=1):
    """What a discovery finds in a record, whatever that is."""
    return accelcal.discover(simulated(plan, *effects, seed=seed))


def discovered(plan, *effects):
    model = searched(plan, *effects)
    assert [found.id for found in model.effects] == [name for name, _ in effects]
    return model


def coefficients(calibration):
    return [table.error_model for table in calibration.tables]


def said_of(calibration, *words):
    return [text for text in calibration.warnings if all(word in text for word in words)]


HIDDEN_BY = {
    "bias-temperature-quadratic": (FIVE, 3e-7, AT_80, "1105 ug to k0"),
    "scale-factor-temperature-quadratic": (FIVE, 3e-7, AT_80, "1094 ppm to K1"),
    "k2-temperature": (FIVE, 1e-5, AT_80, "601 ug/g^2 to k2"),
    "scale-factor-asymmetry": (
        TumblePlan(positions=16),
        2e-3,
        TumblePlan(positions=4, temperatures=(20.0,)),
        "1992 ug/g^2 to k2",
    ),
    "dead-zone": (
        FINE,
        3e-3,
        TumblePlan(positions=4, temperatures=(20.0,)),
        "ppm to K1 and -300",
    ),
    "temperature-hysteresis": (FIVE, 2e-4, TumblePlan(), "202 ug to k0"),
}


@pytest.mark.parametrize("name", HIDDEN_BY)
def test_what_a_record_does_not_show_stays_in_it_if_it_was_found_in_another_unit(name):
    """The size in the other unit was taken out: K0, K1, k2 and delta were off by many times U."""
    plan, size, other, adds = HIDDEN_BY[name]
    model = discovered(plan, (name, size))
    record = simulated(other, serial="B2", seed=4)
    found = accelcal.fit(record, model=model, reference_temperature=20.0)
    plain = accelcal.fit(record, reference_temperature=20.0)
    assert coefficients(found) == coefficients(plain)
    assert found.effects == ()
    assert f"{name} is not taken out: " in said_of(found, LEFT_OUT, "serial A1", adds)[0]
    assert not said_of(found, "fitted to these readings")


def test_the_report_does_not_tell_it_among_what_was_taken_out(tmp_path):
    model = discovered(FIVE, ("bias-temperature-quadratic", 3e-7))
    found = accelcal.fit(simulated(AT_80, serial="B2"), model=model, reference_temperature=20.0)
    said = "bias-temperature-quadratic is not taken out"
    assert said in " ".join(str(found).split())
    assert "Effects taken out" not in str(found)
    found.report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text("utf-8")
    assert said in page
    assert "Effects taken out" not in page
    document = json.loads(found.to_json())
    assert document["effects"] == document["effects_as_found"] == []
    assert any(said in text for text in document["warnings"])


def test_in_the_same_unit_it_has_the_size_that_was_found_and_the_report_says_so(tmp_path):
    model = discovered(FIVE, ("bias-temperature-quadratic", 3e-7))
    same = simulated(AT_80, ("bias-temperature-quadratic", 3e-7), seed=4)
    found = accelcal.fit(same, model=model, reference_temperature=20.0)
    plain = accelcal.fit(simulated(AT_80, seed=4), reference_temperature=20.0)
    k0, true = (each.tables[0].error_model["k0"] for each in (found, plain))
    assert abs(k0.value - true.value) < k0.expanded_uncertainty
    assert found.effects_as_found == ("bias-temperature-quadratic",)
    assert said_of(found, "these readings do not show bias-temperature-quadratic: taken out with")
    assert "ug/degC^2, as the discovery found; gap" in " ".join(str(found).split())
    found.report(tmp_path / "page.md")
    assert "as the discovery found" in (tmp_path / "page.md").read_text("utf-8")
    assert accelcal.Calibration.from_json(found.to_json()) == found


def test_a_law_about_another_t0_is_none_of_this_record():
    """Of the same unit too: k0 was off by 893 ug with U of 116."""
    model = discovered(FIVE, ("bias-temperature-quadratic", 3e-7))
    record = simulated(AT_80, ("bias-temperature-quadratic", 3e-7), seed=4)
    for given in (0.0, 80.0):  # about 80 degC it does nothing at that level
        found = accelcal.fit(record, model=model, reference_temperature=given)
        plain = accelcal.fit(record, reference_temperature=given)
        assert coefficients(found) == coefficients(plain)
        said = said_of(found, "it was found as a law about T0 = 20 degC", "1105 ug to k0")
        assert said[0].endswith("calibrate with T0 = 20 degC")


@pytest.mark.parametrize("of_model", [True, False])
def test_without_a_serial_number_nothing_tells_that_it_is_the_same_unit(of_model):
    model = discovered(FIVE, ("bias-temperature-quadratic", 3e-7))
    record = simulated(AT_80, seed=4)
    if of_model:
        model = replace(model, serial=None)
    else:
        record = replace(record, serial=None)
    found = accelcal.fit(record, model=model, reference_temperature=20.0)
    assert coefficients(found) == coefficients(accelcal.fit(record, reference_temperature=20.0))
    assert said_of(found, "may be of another unit", "name the serial numbers of both")


def test_the_same_file_is_the_same_unit(tmp_path):
    path = tmp_path / "test.csv"
    accelcal.write_table(simulated(FIVE, ("bias-temperature-quadratic", 3e-7)), path)
    record = replace(accelcal.read_table(path), serial=None)
    model = accelcal.discover(record)
    assert accelcal.fit(record, model=model).effects[0].id == "bias-temperature-quadratic"


def test_an_effect_of_the_stand_is_the_same_in_all_units():
    """A head position was taken out of the readings of the same unit and of others alike."""
    model = discovered(FINE, ("position-error", 2e-4))
    model = replace(
        model,
        effects=(
            replace(
                model.effects[0],
                id="fixture-offset",
                parameters={"angle": model.effects[0].parameters["error"]},
            ),
        ),
    )
    record = simulated(TumblePlan(temperatures=(20.0,)), serial="B2", seed=4)
    found, plain = accelcal.fit(record, model=model), accelcal.fit(record)
    assert found.effects_as_found == ("fixture-offset",)
    angle = model.effects[0].parameters["angle"].value
    change = [each.tables[0].error_model["delta"].value for each in (found, plain)]
    assert change[0] - change[1] == pytest.approx(angle, rel=1e-2)
    assert said_of(found, "do not show fixture-offset", "holds on the same stand, clamped alike")
    # found beside another fixture angle it would count twice
    turned = accelcal.fit(record, model=model, delta0=angle)
    assert turned.effects == ()
    assert said_of(turned, "it was found with delta0 = 0 rad", "calibrate with delta0 = 0 rad")


@cache
def on_a_head(*lines):
    """A head position found in a record with such header lines."""
    hidden = accelcal.effect("position-error").of(2e-4, at=90.0)
    record = accelcal.simulate(plan=FINE, effects=[hidden], seed=1)
    return accelcal.discover(replace(record, metadata=dict(lines)))


@pytest.mark.parametrize(
    ("lines", "taken"),
    [
        (({"head": "A"}, {"Head": " a"}), True),
        (({"head": "A"}, {"head": "B"}), False),
        (({"stand": "1"}, {"stand": "2"}), False),
        (({"head": "A", "stand": "1"}, {"head": "A", "stand": "2"}), True),
        (({"head": "A"}, {}), None),
    ],
)
def test_an_effect_of_the_head_is_left_in_on_another_head(lines, taken):
    """It was taken out of any, with the size that it had on the other one."""
    theirs, ours = lines
    hidden = accelcal.effect("position-error").of(2e-4, at=90.0)
    model = on_a_head(*theirs.items())
    assert accelcal.Discovery.from_json(model.to_json()) == model
    four = TumblePlan(positions=4, temperatures=(20.0,))
    record = replace(accelcal.simulate(plan=four, effects=[hidden], seed=4), metadata=ours)
    found = accelcal.fit(record, model=model)
    assert found.effects_as_found == (("position-error",) if taken is not False else ())
    if taken is False:
        name = next(iter(theirs.values()))
        assert said_of(found, f"was found on another head or stand, {name}", LEFT_OUT)
    else:
        to_tell = said_of(found, "name the head in a line '# head: NAME' of both")
        assert bool(to_tell) is (taken is None)


def test_a_dead_zone_of_another_unit_silences_no_readings():
    """Of a unit without any, delta was off by 111 urad with U of 3."""
    model = discovered(FINE, ("dead-zone", 3e-3))
    record = simulated(FINE, serial="B2", seed=4)
    found, plain = accelcal.fit(record, model=model), accelcal.fit(record)
    for own, true in zip(coefficients(found), coefficients(plain), strict=True):
        assert abs(own["delta"].value - true["delta"].value) < own["delta"].expanded_uncertainty


@pytest.mark.parametrize("tau", [200.0, 630.0, 3000.0])
@pytest.mark.parametrize("serial", ["A1", "B2"])
def test_a_time_constant_that_the_readings_tell_is_found_anew(serial, tau):
    """One within three standard uncertainties was kept: U held the truth in 32 to 50 %."""
    model = discovered(TumblePlan(), ("warm-up", 2e-4))
    unit = replace(accelcal.AL15, serial=serial)
    slow = [accelcal.effect("warm-up").of(2e-4, tau=tau)]
    record = accelcal.simulate(unit, TumblePlan(), effects=slow, seed=4)
    found = accelcal.fit(record, model=model)
    true = accelcal.fit(accelcal.simulate(unit, TumblePlan(), seed=4))
    size = found.effects[0].parameters["tau"]
    assert abs(size.value - tau) < size.expanded_uncertainty < 0.2 * tau
    for own, without in zip(coefficients(found), coefficients(true), strict=True):
        assert abs(own["k0"].value - without["k0"].value) < own["k0"].expanded_uncertainty
    assert not said_of(found, "do not agree with tau")


def test_a_time_constant_that_the_readings_do_not_tell_is_that_of_the_discovery():
    model = discovered(TumblePlan(), ("warm-up", 2e-4))
    held = accelcal.fit(simulated(TumblePlan(), seed=4), model=model)
    assert held.effects[0].parameters["tau"].value == model.effects[0].parameters["tau"].value


def test_a_break_that_the_readings_deny_is_found_anew():
    """That of the other unit was kept: the bias above T0 was off by many times U."""
    levels = (-40.0, -20.0, 0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 80.0)
    many, entry = TumblePlan(temperatures=levels, strokes=4), accelcal.effect("break-shift")
    made = [entry.of(shift, slope_change=6e-5) for shift in (15.0, 34.0)]
    model = accelcal.discover(accelcal.simulate(plan=many, effects=made[:1], seed=1))
    unit = replace(accelcal.AL15, serial="B2")
    record = accelcal.simulate(unit, many, effects=made[1:], seed=4)
    found = accelcal.fit(record, model=model)
    true = accelcal.fit(accelcal.simulate(unit, many, seed=4))
    shift = found.effects[0].parameters["shift"]
    assert abs(shift.value - 34.0) < shift.expanded_uncertainty < 2.0
    for own, plain in zip(coefficients(found), coefficients(true), strict=True):
        assert abs(own["k0"].value - plain["k0"].value) < own["k0"].expanded_uncertainty


@pytest.mark.parametrize(
    ("name", "said"),
    [("position-error", "no reading at 45 deg"), ("bias-step", "from 2 to 54")],
)
def test_what_has_no_place_in_a_record_is_not_taken_out_of_it(name, said):
    """Such a record was refused."""
    model = discovered(TumblePlan(), (name, 4e-4))
    record = simulated(TumblePlan(positions=8, temperatures=(20.0,)), serial="B2", seed=4)
    if name == "position-error":
        record = simulated(TumblePlan(positions=6, temperatures=(20.0,)), serial="B2", seed=4)
    found = accelcal.fit(record, model=model)
    assert coefficients(found) == coefficients(accelcal.fit(record))
    assert said_of(found, f"nothing is taken out of these readings for {name}", said)


def test_a_batch_takes_it_out_of_the_unit_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    hidden = ("bias-temperature-quadratic", 3e-7)
    discovered(FIVE, hidden).to_json("model.json")
    for serial in ("A1", "B2"):
        record = simulated(AT_80, hidden, serial=serial, seed=4)
        accelcal.write_table(record, f"{serial}.csv")
    asked = ["batch", "A1.csv", "B2.csv", "-o", "out.csv", "--model", "model.json", "--t0", "20"]
    assert CliRunner().invoke(program, asked).exit_code == 0
    with Path("out.csv").open(encoding="utf-8") as file:
        rows = {row["serial"]: row for row in csv.DictReader(file)}
    one, other = (
        next(float(value) for key, value in rows[s].items() if key.startswith("k0")) for s in rows
    )
    assert abs(abs(other - one) - 1.105e-3) < 2e-5
    assert "is not taken out" not in rows["A1"]["warnings"]
    assert "is not taken out" in rows["B2"]["warnings"]


PAUSED = "may go on between the runs, and nothing tells how long"


def untimed(plan, *effects, seed):
    return replace(simulated(plan, *effects, seed=seed), time=None)


@pytest.mark.parametrize("hours", [2.0, 20.0])
@pytest.mark.parametrize(
    ("name", "size", "moved"),
    [
        ("bias-drift", 1e-3, "k0"),
        ("bias-drift", 2e-5, "k0"),
        ("scale-factor-drift", 2e-5, "K1"),
        ("foundation-tilt", 3e-5, "delta"),
    ],
)
def test_u_counts_what_goes_on_in_pauses_nobody_knows_of(name, size, moved, hours):
    """k0 of the second run was off by 1 mg, with U of 15 ug."""
    plan = TumblePlan(timed=True, seconds_between_runs=3600.0 * hours)
    model = searched(replace(plan, seconds_between_runs=7200.0), (name, size))
    assert model.effects
    found = accelcal.fit(untimed(plan, (name, size), seed=4), model=model)
    plain = accelcal.fit(simulated(plan, seed=4))
    assert said_of(found, "no times:", PAUSED)
    for own, true in zip(found.tables, plain.tables, strict=True):
        value, exact = own.quantities[moved], true.quantities[moved]
        assert abs(value.value - exact.value) < value.expanded_uncertainty
        assert own.error_model["k3"].expanded_uncertainty == pytest.approx(
            true.error_model["k3"].expanded_uncertainty, rel=0.1
        )


@pytest.mark.parametrize("name", ["bias-drift", "scale-factor-drift", "foundation-tilt"])
def test_where_readings_deny_that_there_were_no_pauses_the_runs_tell_the_rate(name):
    """It was 140 to 179 ppm/h at U of 4, and each run had a drift that it had not."""
    plan = TumblePlan(temperatures=(20.0, 80.0, 20.0, -40.0, 20.0), strokes=4)
    made = (name, 1e-4)
    model = searched(plan, made, seed=2)
    record = simulated(plan, made, seed=5)
    found = accelcal.fit(record, model=model)
    rate = found.effects[0].parameters["rate"]
    assert abs(rate.value - 1e-4) < rate.expanded_uncertainty < 1e-5
    assert all(gate.verdict == "pass" for table in found.tables for gate in table.gates)
    assert said_of(found, "no times:", PAUSED)


@pytest.mark.parametrize("name", ["bias-drift", "scale-factor-drift"])
def test_a_comparison_counts_what_goes_on_in_pauses_nobody_knows_of(name):
    """Nothing had changed, and simulation and measurement disagreed in 24 of 25 such pairs."""
    plan = TumblePlan(temperatures=(20.0, 80.0, 20.0, -40.0, 20.0), strokes=4)
    made = (name, 1e-4)
    calibration = accelcal.fit(simulated(plan, made, seed=5), model=searched(plan, made, seed=2))
    same = accelcal.compare(calibration, simulated(plan, made, seed=6))
    assert same.p_value > 0.01
    assert any(f"no times: {name} may go on between the runs" in note for note in same.notes)
    other = simulated(plan, made, ("hysteresis", 1e-5), seed=6)
    assert accelcal.compare(calibration, other).p_value < 1e-6


def test_with_times_or_in_one_run_no_pause_is_counted():
    drift = ("bias-drift", 1e-3)
    model = discovered(TumblePlan(), drift)
    plan = TumblePlan(timed=True)
    timed = accelcal.fit(simulated(plan, drift, seed=4), model=model)
    plain = accelcal.fit(simulated(plan, seed=4))
    for own, true in zip(coefficients(timed), coefficients(plain), strict=True):
        assert abs(own["k0"].value - true["k0"].value) < own["k0"].expanded_uncertainty < 2e-5
    one_run = simulated(TumblePlan(temperatures=(20.0,)), drift)
    assert not said_of(timed, PAUSED)
    assert not said_of(accelcal.fit(one_run, model=model), PAUSED)


def test_who_uses_the_calibration_is_told_too():
    model = discovered(TumblePlan(positions=16), ("scale-factor-asymmetry", 2e-3))
    four = TumblePlan(positions=4, temperatures=(20.0,))
    found = accelcal.fit(simulated(four, serial="B2", seed=4), model=model)
    with pytest.warns(AccelcalWarning) as caught:
        accelcal.apply(found, [1.35], 20.0, a_p=0.0)
    assert any("scale-factor-asymmetry is not taken out" in str(each.message) for each in caught)


def test_of_two_effects_that_a_coarser_test_cannot_tell_apart_one_has_the_size_that_was_found():
    """In the same unit: both were fitted, with sizes of 500, and U of k2 was 64 g/g^2."""
    both = ("scale-factor-asymmetry", 2e-3), ("fourth-order", 1e-3)
    model = discovered(FINE, *both)
    record, plain = (simulated(TumblePlan(), *hidden, seed=4) for hidden in (both, ()))
    found, true = accelcal.fit(record, model=model), accelcal.fit(plain)
    assert found.effects_as_found == ("fourth-order",)
    size = found.effects[0].parameters["coefficient"]
    assert abs(size.value - 2e-3) < 1e-4
    for own, without in zip(coefficients(found), coefficients(true), strict=True):
        for name in ("k0", "k2"):
            assert abs(own[name].value - without[name].value) < own[name].expanded_uncertainty
        assert own["k2"].expanded_uncertainty < 1e-4


def test_of_two_effects_that_look_alike_in_another_unit_one_is_fitted_and_the_other_told():
    """Both were fitted, with sizes of 500, and U of k0 was 260 g."""
    both = ("scale-factor-asymmetry", 2e-3), ("fourth-order", 1e-3)
    model = discovered(FINE, *both)
    record = simulated(TumblePlan(), *both, serial="B2", seed=4)
    found, true = accelcal.fit(record, model=model), accelcal.fit(simulated(TumblePlan(), seed=4))
    assert [effect.id for effect in found.effects] == ["scale-factor-asymmetry"]
    assert found.effects_as_found == ()
    (said,) = said_of(found, "fourth-order is not taken out", "found in another unit", LEFT_OUT)
    adds = 1e-6 * float(re.search(r"adds (\d+) ug/g\^2 to k2", said)[1])
    for own, without in zip(coefficients(found), coefficients(true), strict=True):
        assert abs(own["k0"].value - without["k0"].value) < own["k0"].expanded_uncertainty < 2e-5
        assert own["k2"].value == pytest.approx(without["k2"].value + adds, abs=1e-4)


def test_readings_without_temperature_count_as_at_the_mean_of_their_run():
    """They counted as at T0: a gap of milli-g, of which the effects and U took up a part."""
    record = simulated(TumblePlan(), ("backlash", 3e-5))
    model = searched(TumblePlan(), ("backlash", 3e-5))
    temperature = record.temperature.copy()
    temperature[np.flatnonzero(record.run == 1)[[3, 17, 30]]] = np.nan
    holed = accelcal.fit(replace(record, temperature=temperature), model=model)
    whole = accelcal.fit(record, model=model)
    assert holed.effects[0].gap_after == pytest.approx(whole.effects[0].gap_after, rel=1e-6)
    for own, exact in zip(coefficients(holed), coefficients(whole), strict=True):
        assert own["k2"].value == pytest.approx(exact["k2"].value, abs=1e-9)
        assert own["k2"].expanded_uncertainty == pytest.approx(exact["k2"].expanded_uncertainty)
    assert said_of(holed, "3 readings without temperature count as at the mean of their run")
    temperature = np.where(np.arange(len(record)) == 70, np.nan, record.temperature)
    one = accelcal.fit(replace(record, temperature=temperature), model=model)
    assert said_of(one, "1 reading without temperature counts as at the mean of its run")


def test_a_run_without_temperature_beside_others_is_refused():
    record = simulated(TumblePlan(), ("backlash", 3e-5))
    model = searched(TumblePlan(), ("backlash", 3e-5))
    unknown = np.where(record.run == 2, np.nan, record.temperature)
    with pytest.raises(accelcal.InputError, match="run 3 has no temperature, and others have"):
        accelcal.fit(replace(record, temperature=unknown), model=model)


def test_what_else_an_effect_may_be_is_said_only_where_it_was_taken_out():
    """U was said not to count it, where nothing had been taken out of the readings."""
    model = discovered(FIVE, ("bias-temperature-quadratic", 3e-7))
    assert model.otherwise
    same, other = (accelcal.fit(simulated(AT_80, serial=s), model=model) for s in ("A1", "B2"))
    assert said_of(same, "what else the discovery found possible")
    assert not other.effects
    assert not said_of(other, "what else the discovery found possible")


STEP = accelcal.effect("bias-step")


def with_steps(*steps, seed):
    return accelcal.simulate(effects=[STEP.of(v, reading=at) for v, at in steps], seed=seed)


@cache
def stepped(size):
    return accelcal.discover(with_steps((size, 70), seed=0))


@pytest.mark.parametrize("there", [35, 72, 130])
@pytest.mark.parametrize("size", [4e-4, 1e-4])
def test_a_step_is_taken_out_where_the_readings_show_it(size, there):
    """It was sought where the discovery had it, and k0 was off by half of the step."""
    found = accelcal.fit(with_steps((size, there), seed=20), model=stepped(size))
    plain = accelcal.fit(accelcal.simulate(seed=20))
    (step,) = found.effects
    assert step.parameters["reading"].value == there
    assert step.parameters["step"].value == pytest.approx(size, rel=0.1)
    for own, without in zip(coefficients(found), coefficients(plain), strict=True):
        k0, true = own["k0"], without["k0"]
        assert abs(k0.value - true.value) < 5e-6
        assert k0.expanded_uncertainty == pytest.approx(true.expanded_uncertainty, rel=0.1)
    assert said_of(
        found, f"these readings show it with reading = {there}, and not with reading = 70"
    )


def test_a_second_step_is_told():
    found = accelcal.fit(with_steps((2e-4, 70), (2e-4, 130), seed=20), model=stepped(2e-4))
    assert found.effects[0].parameters["reading"].value == 70
    assert said_of(found, "these readings show another one with reading = 130", LESS_CERTAIN)


def test_a_step_that_is_not_there_is_zero_and_moves_nowhere():
    for seed in range(20, 23):
        found = accelcal.fit(accelcal.simulate(seed=seed), model=stepped(2e-4))
        assert abs(found.effects[0].parameters["step"].value) < 1e-5
        assert not said_of(found, "bias-step: these readings")


@pytest.mark.parametrize(("seed", "tau"), [(1, 900.0), (2, 900.0), (2, 1200.0)])
def test_u_of_k0_counts_that_the_time_constant_is_uncertain(seed, tau):
    """By least squares of all at once, written down anew; it was half of that."""
    noise = accelcal.NoiseComponents(head=0.0, launch=0.0, launch_sf=0.0)
    hidden = accelcal.effect("warm-up").of(1e-4, tau=tau)
    plan = TumblePlan(temperatures=(20.0,))
    record = accelcal.simulate(effects=[hidden], noise=noise, plan=plan, seed=seed)
    model = accelcal.discover(record)
    found = model.effects[0].parameters
    th, t = np.deg2rad(record.angle), 60.0 * np.arange(len(record))
    c, s, decay = np.cos(th), np.sin(th), np.exp(-t / found["tau"].value)
    slope = found["amplitude"].value * t / found["tau"].value ** 2 * decay
    columns = np.stack([c**0, c, c**2, c**3, s, s * c, decay, slope], axis=1)
    u = model.noise[0].value * np.linalg.norm(np.linalg.pinv(columns, rcond=1e-13)[0])
    k0 = accelcal.fit(record, model=model).tables[0].error_model["k0"]
    of_search = next(c.after for c in model.coefficients if c.coefficient == "K0")
    assert k0.standard_uncertainty == pytest.approx(u, rel=0.05)
    assert of_search.standard_uncertainty > 0.95 * u  # which counts what else it may be, too


@pytest.fixture(scope="module")
def warm_or_drifting():
    warm = accelcal.effect("warm-up").of(4e-5, tau=3000.0)
    model = accelcal.discover(accelcal.simulate(effects=[warm], seed=1))
    assert model.effects[0].indistinguishable == ("bias-drift",)
    return model


@pytest.mark.parametrize("hours", [0.0, 4.0, 20.0])
def test_a_drift_that_may_be_there_in_its_place_may_go_on_in_pauses_too(hours, warm_or_drifting):
    """Judged as if there were none, it was denied by pauses: k0 off by 400 ug at U of 16."""
    levels = (20.0, 80.0, 20.0, -40.0, 20.0)
    plan = TumblePlan(temperatures=levels, timed=True, seconds_between_runs=3600.0 * hours)
    record = untimed(plan, ("bias-drift", -2e-5), seed=4)
    found = accelcal.fit(record, model=warm_or_drifting)
    plain = accelcal.fit(untimed(plan, seed=4))
    assert said_of(found, "no times: bias-drift", PAUSED)
    assert said_of(found, "if it is bias-drift in truth")
    for own, true in zip(coefficients(found), coefficients(plain), strict=True):
        assert abs(own["k0"].value - true["k0"].value) < own["k0"].expanded_uncertainty


def test_u_is_the_same_whatever_the_rounding_where_places_fit_alike():
    """A break of the law anywhere between two levels: U of k0 was 25 to 920 ug by rounding."""
    levels = (20.0, 50.0, 80.0, -10.0, -40.0)
    plan = TumblePlan(positions=16, strokes=4, temperatures=levels)
    record = simulated(plan, ("temperature-hysteresis", 6e-5), serial="AL-15", seed=151)
    model = accelcal.discover(record)
    assert model.effects[0].indistinguishable == ("break-shift",)
    found = accelcal.fit(record, model=model)
    for seed in range(3):
        error = 1e-15 * np.random.default_rng(seed).normal(size=len(record))
        again = accelcal.fit(replace(record, output=record.output * (1.0 + error)), model=model)
        for own, other in zip(coefficients(found), coefficients(again), strict=True):
            u = other["k0"].expanded_uncertainty
            assert own["k0"].expanded_uncertainty == pytest.approx(u, rel=1e-6)
