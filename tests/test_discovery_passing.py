"""Disturbances that come and go, which pass for noise with a memory or with heavy tails."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import accelcal
from accelcal.discovery import look
from accelcal.discovery.comparison import compared
from accelcal.discovery.family import Judgement
from accelcal.discovery.noise.of_readings import memory
from accelcal.discovery.search import Findings
from accelcal.discovery.unnamed import beside_noise, passing, slow
from accelcal.simulation import NoiseComponents, TumblePlan

TIMED = TumblePlan(timed=True)
NOISE = 5e-6  # g, of a reading


def disturbed(bias, *, seed=1, plan=TIMED):
    """A record with noise of 5 ug, to which a bias [g] is added in mA."""
    record = accelcal.simulate(plan=plan, noise=NoiseComponents(reading=NOISE, head=0.0), seed=seed)
    return replace(record, output=record.output + 1.35 * bias(record))


def nothing(record):
    return np.zeros(len(record))


def to_and_fro(period, size):
    return lambda record: size * np.sin(2.0 * np.pi * record.time / period + 1.0)


def for_a_time(first, last, size):
    """A shift of the readings from one to the other in the order of measuring."""

    def bias(record):
        place = np.argsort(np.argsort(record.time))
        return size * ((place >= first) & (place < last))

    return bias


def in_a_stroke(run, stroke, size):
    def bias(record):
        own = (record.run == run) & (record.stroke == stroke)
        return own * size * np.random.default_rng(5).standard_normal(len(record))

    return bias


@pytest.mark.parametrize("minutes", [8.0, 13.0, 25.0])
def test_an_oscillation_is_told_with_its_period(minutes):
    found = accelcal.discover(disturbed(to_and_fro(60.0 * minutes, 2.0 * NOISE)))
    assert found.effects == ()
    told = found.unexplained
    period = re.match(r"the bias oscillates, period ([\d.]+) min; .* ug rms", told.structure)
    assert float(period[1]) == pytest.approx(minutes, rel=0.12)
    assert told.p_value == found.p_value < 0.01
    assert 0.0 < told.share < 1.0
    assert "no known effect explains it" in str(found)
    assert "the bias oscillates" in " ".join(str(found).split())


@pytest.mark.parametrize(("size", "tau"), [(60e-6, 300.0), (-60e-6, 1200.0), (200e-6, 1200.0)])
def test_a_warm_up_of_one_run_is_told_as_one(size, tau):
    """It was something slow as a walk, by the time in all runs, or a step and a warm-up of all."""

    def decay(record):
        later = record.time - record.time[record.run == 1].min()
        return np.where(record.run == 1, size * np.exp(-later / tau), 0.0)

    found = accelcal.discover(disturbed(decay))
    assert found.effects == ()
    told = re.match(
        r"the bias settles in run 2 alone, from (\S+) ug at its start with a time constant of about"
        r" (\S+) min",
        found.unexplained.structure,
    )
    assert float(told[1]) == pytest.approx(1e6 * size, rel=0.2)
    assert float(told[2]) == pytest.approx(tau / 60.0, rel=0.5)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_drift_of_one_run_is_told_as_one(seed):
    """It settled with a time constant as long as those that were tried, or was by the time."""

    def drift(record):
        later = record.time - record.time[record.run == 1].min()
        return np.where(record.run == 1, 50e-6 * later / 3600.0, 0.0)

    found = accelcal.discover(disturbed(drift, seed=seed))
    assert found.effects == ()
    told = re.match(r"the bias drifts in run 2 alone, by (\S+) ug/h", found.unexplained.structure)
    assert float(told[1]) == pytest.approx(50.0, rel=0.1)


def test_a_run_that_alone_does_not_warm_up_settles_beside_a_warm_up():
    """It was told as the one that settles, the wrong way, and no word on the other runs."""

    def cold(record):
        later = record.time - np.array([record.time[record.run == r].min() for r in record.run])
        return np.where(record.run == 1, 0.0, 60e-6 * np.exp(-later / 900.0))

    told = accelcal.discover(disturbed(cold, seed=2)).unexplained.structure
    assert re.match(r"beside (.+ and )?warm-up: the bias settles in run 2 alone, from -", told)


@pytest.mark.parametrize(("first", "last"), [(60, 68), (116, 130)])
def test_a_shift_for_a_time_is_told_with_its_place_and_size(first, last):
    found = accelcal.discover(disturbed(for_a_time(first, last, 4.0 * NOISE), seed=3))
    assert found.effects == ()
    told = re.match(
        r"the bias is shifted for a time, by \+([\d.]+) ug in (\d+) readings of run (\d),",
        found.unexplained.structure,
    )
    assert float(told[1]) == pytest.approx(4e6 * NOISE, rel=0.35)
    assert int(told[2]) == pytest.approx(last - first, abs=0.5 * (last - first))
    assert int(told[3]) == 1 + first // 54


def test_a_shift_for_a_time_is_no_step():
    record = disturbed(for_a_time(64, 76, 4.0 * NOISE))
    with_a_step = accelcal.discover(record, effects=[accelcal.effect("bias-step")])
    assert with_a_step.effects == ()
    assert with_a_step.unexplained.structure.startswith("the bias is shifted for a time, by +")
    step = [accelcal.effect("bias-step").of(4.0 * NOISE, reading=75)]
    found = accelcal.discover(accelcal.simulate(plan=TIMED, effects=step, seed=1))
    assert [item.id for item in found.effects] == ["bias-step"]


@pytest.mark.parametrize(("stroke", "seed"), [(2, 0), (5, 1)])
def test_a_scale_factor_shifted_in_one_stroke_is_told_as_that(stroke, seed):
    record = accelcal.simulate(plan=TIMED, seed=seed)
    own = (record.run == 1) & (record.stroke == stroke)
    shifted = replace(record, output=record.output * np.where(own, 1.0003, 1.0))
    told = accelcal.discover(shifted).unexplained.structure
    found = re.match(
        r"the scale factor is shifted for a time, by \+([\d.]+) ppm in (\d+) readings of run 2,"
        rf" from (0|360) deg of stroke {stroke} to (0|360) deg of stroke {stroke}(;|$)",
        told,
    )
    assert found, told
    assert float(found[1]) == pytest.approx(300.0, rel=0.05)


def test_a_noisy_stroke_is_told():
    found = accelcal.discover(disturbed(in_a_stroke(1, 4, 8.0 * NOISE)))
    assert found.effects == ()
    told = re.fullmatch(
        r"the noise of stroke 4 in run 2 is about (\d+) times that of the other readings",
        found.unexplained.structure,
    )
    assert int(told[1]) in (6, 9)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_noise_with_a_memory_alone_is_no_disturbance(rho, seed):
    record = disturbed(nothing, seed=seed)
    c = compared(record, 20.0).model.conditions
    draws = np.random.default_rng(seed).standard_normal(len(record))
    noise = 4.0 * NOISE * np.linalg.cholesky(memory(c, rho)) @ draws
    found = accelcal.discover(replace(record, output=record.output + 1.35 * noise))
    told = found.unexplained.structure if found.unexplained else ""
    assert not re.search("oscillates|for a time|the noise of", told)


def test_chances_of_noise_are_uniform():
    """Gains of noise drawn anew are as often among the largest of noise as they should be."""
    ranks = []
    for seed in range(40):
        record = disturbed(nothing, seed=seed, plan=TumblePlan(temperatures=(20.0,)))
        found = passing.passing(compared(record, 20.0), (), 1.0, seed)
        ranks.append(1.0 if found is None else found.p_value)
    assert 0.0 <= np.mean(np.array(ranks) < 0.3) < 0.5
    assert np.mean(np.array(ranks) < 0.01) < 0.1


def beside(name, size, bias, **values):
    """What is found in a record with an effect of the catalogue, and a bias that it has not."""
    hidden = [accelcal.effect(name).of(size, **values)]
    noise = NoiseComponents(reading=NOISE, head=0.0)
    record = accelcal.simulate(plan=TIMED, noise=noise, effects=hidden, seed=1)
    return accelcal.discover(replace(record, output=record.output + 1.35 * bias(record)))


def test_a_disturbance_is_told_beside_an_effect():
    found = beside("hysteresis", 4e-5, to_and_fro(780.0, 2.0 * NOISE))
    assert [item.id for item in found.effects] == ["hysteresis"]
    assert found.unexplained.structure.startswith("the bias oscillates, period 13.2 min")
    text = " ".join(str(found).split())
    missing = "hysteresis of the sensor, and something that no known effect explains."
    assert f"What is missing: {missing}" in text
    assert "pattern: the bias oscillates" in text
    assert repr(found).endswith("hysteresis, an effect that nothing explains>")
    assert found.has_more
    alone = beside("hysteresis", 4e-5, nothing)
    assert alone.unexplained is None
    assert not alone.has_more


@pytest.mark.parametrize(
    ("what", "unit", "by", "wave"),
    [("scale factor", "ppm", 9.0, np.cos), ("misalignment", "urad", 12.0, np.sin)],
)
def test_a_shift_of_scale_factor_or_misalignment_is_told(what, unit, by, wave):
    """It passed for noise, or for a drift of the chamber or a tilt of the foundation."""

    def shifted(record):
        own = for_a_time(66, 81, by * NOISE)(record)
        return own * wave(np.radians(record.angle))

    found = accelcal.discover(disturbed(shifted))
    assert found.effects == ()
    told = re.match(
        rf"the {what} is shifted for a time, by \+([\d.]+) {unit} in (\d+) readings of run 2,",
        found.unexplained.structure,
    )
    assert float(told[1]) == pytest.approx(1e6 * by * NOISE, rel=0.35)


def slipped(by, *, first, last, seed, temperatures):
    """A record of 36 readings a run, the misalignment of which is another in some readings."""
    plan = TumblePlan(temperatures=temperatures, strokes=4, timed=True)

    def bias(record):
        return for_a_time(first, last, by)(record) * np.sin(np.radians(record.angle))

    return disturbed(bias, seed=seed, plan=plan)


@pytest.mark.parametrize(
    ("first", "last", "end", "seed"),
    [(82, 108, "run", 1), (82, 108, "run", 2), (46, 108, "record", 2), (46, 108, "record", 3)],
)
def test_a_slip_is_a_step_and_no_tilt(first, last, end, seed):
    """It passed for a tilt of the foundation."""
    runs = (20.0, 20.0, 20.0)
    record = slipped(10.0 * NOISE, first=first, last=last, seed=seed, temperatures=runs)
    found = accelcal.discover(record)
    assert found.effects == ()
    told = re.match(
        rf"the misalignment steps by \+([\d.]+) urad at 360 deg of stroke 1 in run"
        rf" {1 + first // 36}, to the end of the {end}",
        found.unexplained.structure,
    )
    assert float(told[1]) == pytest.approx(1e7 * NOISE, rel=0.1)


def test_what_the_model_takes_up_is_no_step():
    """A misalignment that steps at 45 deg of the first stroke is one of the whole run."""
    plan = TumblePlan(temperatures=(20.0, 80.0, -40.0))
    hidden = [accelcal.effect("dead-zone").of(3e-3), accelcal.effect("hysteresis").of(3e-5)]
    record = accelcal.simulate(plan=plan, effects=hidden, seed=4)
    others = [entry for entry in accelcal.catalogue() if entry.id != "dead-zone"]
    found = accelcal.discover(record, effects=others)
    assert "the misalignment steps" not in found.unexplained.structure  # it was by 1.6e16 urad
    left_open = set(accelcal.fit(record, model=found).warnings) - set(accelcal.fit(record).warnings)
    assert left_open == {"U does not count what the discovery found and no known effect explains"}


def test_a_tilt_beside_runs_turned_back_is_not_sure():
    """A slip within the first run turns all later ones, as if they were mounted anew."""
    runs = (20.0, 20.0, 20.0)
    record = slipped(40.0 * NOISE, first=33, last=108, seed=1, temperatures=runs)
    found = accelcal.discover(record)
    assert [fault.name for fault in found.faults][:2] == ["mounted anew", "mounted anew"]
    assert [item.id for item in found.effects] == ["foundation-tilt"]
    assert found.doubtful == ("foundation-tilt",)
    assert "a head that slips within a run looks like both" in " ".join(found.notes)


@pytest.mark.parametrize("timed", [False, True])
def test_a_pause_of_a_drift_is_no_temperature_hysteresis(timed):
    """Without times nobody knows how long the drift went on between the runs."""
    plan = TumblePlan(temperatures=(20.0, 80.0, 20.0), strokes=4, timed=timed)
    drift = [accelcal.effect("bias-drift").of(3e-4)]
    found = accelcal.discover(accelcal.simulate(plan=plan, effects=drift, seed=1))
    assert "bias-drift" in {item.id for item in found.effects}
    assert "temperature-hysteresis" not in {item.id for item in found.effects}
    assert found.doubtful == ()


@pytest.mark.parametrize("hidden", ["bias-drift", "scale-factor-drift"])
def test_a_drift_goes_on_in_pauses_that_nobody_wrote_down(hidden):
    """It was told three times too large, beside a drift of the chamber or a step that were none."""
    plan = TumblePlan(temperatures=(20.0, 80.0, 20.0, -40.0, 20.0), timed=True)
    record = accelcal.simulate(plan=plan, seed=1)
    hours = record.time / 3600.0 + 2.0 * record.run
    acting = np.cos(np.radians(record.angle)) if hidden == "scale-factor-drift" else 1.0
    drifting = replace(record, output=record.output + 1.35 * 2e-5 * hours * acting, time=None)
    found = accelcal.discover(drifting)
    assert [item.id for item in found.effects] == [hidden]
    rate = found.effects[0].parameters["rate"]
    assert abs(rate.value - 2e-5) < 1.5 * rate.expanded_uncertainty
    assert "pauses of any length between runs" in " ".join(found.notes)
    assert "not declared" not in " ".join(found.notes)
    sources = {source.name: (source.value, source.source) for source in found.noise}
    assert sources["launch"] == (record.apparatus.launch_uncertainty, "free in each run")
    assert sources["launch_sf"] == (record.apparatus.launch_sf_uncertainty, "free in each run")
    assert sources["head"][1] == "declared"


@pytest.mark.parametrize(("levels", "told"), [((20.0,), False), ((20.0, 80.0), True)])
def test_of_one_run_nothing_is_said_that_takes_several(levels, told):
    record = accelcal.simulate(plan=TumblePlan(temperatures=levels), seed=3, declare=False)
    said = " ".join(accelcal.discover(record).notes)
    assert "one reading a minute" in said
    assert ("no pause between runs" in said) is told
    assert ("launch_uncertainty and launch_sf_uncertainty are not declared" in said) is told


@pytest.mark.parametrize(
    ("hidden", "told"),
    [(("warm-up", 1e-4), False), (("chamber-drift", 0.3), False), (("bias-drift", 1e-4), True)],
)
def test_pauses_are_told_where_they_matter_to_what_was_found(hidden, told):
    """They are nothing to what begins anew in each run, beside which they were told."""
    name, size = hidden
    effects = [accelcal.effect(name).of(size)]
    found = accelcal.discover(accelcal.simulate(effects=effects, seed=1))
    assert [item.id for item in found.effects] == [name]
    assert ("between runs" in " ".join(found.notes)) is told


def test_a_period_at_the_end_of_the_search_may_be_longer():
    """An oscillation of 40 min was told as one of 35.3 min, which is 1.5 of them in a run."""
    found = accelcal.discover(disturbed(to_and_fro(2400.0, 6.0 * NOISE)))
    assert found.unexplained.structure.startswith("the bias oscillates, period 35.3 min or more;")


def test_a_drift_that_goes_on_in_pauses_is_not_told_as_two_where_one_anew_fits_as_well():
    """A rate of 267 ppm/h was told, and beside it a drift of the chamber and a warm-up."""
    plan = TumblePlan(temperatures=(20.0, 80.0, 20.0, -40.0, 20.0), strokes=4)
    unit, drift = replace(accelcal.AL15, serial="A1"), accelcal.effect("scale-factor-drift")
    found = accelcal.discover(accelcal.simulate(unit, plan, effects=[drift.of(1e-4)], seed=1))
    (only,) = found.effects
    assert only.id == "scale-factor-drift"
    assert only.indistinguishable == ("chamber-drift",)
    rate = only.parameters["rate"]
    assert abs(rate.value - 1e-4) < 1.5 * rate.expanded_uncertainty


@pytest.mark.parametrize(("size", "doubtful"), [(1.5e-5, ("k2-temperature",)), (0.0, ())])
def test_another_k2_of_one_run_is_no_sure_law_of_the_temperature(size, doubtful):
    """It was named as certain, though no other run was at the level of the one."""
    law = accelcal.effect("k2-temperature").of(0.0 if size else 3e-7)
    record = accelcal.simulate(effects=[law], seed=1)
    alone = size * (record.run == 1) * np.cos(np.radians(record.angle)) ** 2
    found = accelcal.discover(replace(record, output=record.output + 1.35 * alone))
    assert [item.id for item in found.effects] == ["k2-temperature"]
    assert found.doubtful == doubtful
    assert ("another k2 of run 2 alone" in " ".join(found.notes)) == bool(doubtful)


TILTED = TumblePlan(
    temperatures=(20.0, 80.0, 20.0, -40.0, 20.0), strokes=4, seconds_between_runs=4 * 3600.0
)


@pytest.mark.parametrize("declare", [True, False])
def test_a_tilt_goes_on_in_pauses_that_nobody_wrote_down(declare):
    """No known effect explained it."""
    tilt = accelcal.effect("foundation-tilt").of(1e-4)
    record = accelcal.simulate(plan=TILTED, effects=[tilt], seed=1, declare=declare)
    found = accelcal.discover(record.with_apparatus(head_uncertainty=6.7e-6))
    assert [item.id for item in found.effects] == ["foundation-tilt"]
    assert found.doubtful == ()
    rate = found.effects[0].parameters["rate"]
    assert abs(rate.value - 1e-4) < rate.expanded_uncertainty < 1e-5
    assert "scale factor and misalignment are free in each run" in " ".join(found.notes)


def test_a_tilt_in_pauses_that_nobody_wrote_down_is_no_mounting():
    """Runs are turned by any amount after such pauses, and were turned back as mounted anew."""
    tilt = accelcal.effect("foundation-tilt").of(2e-5)
    found = accelcal.discover(accelcal.simulate(plan=TILTED, effects=[tilt], seed=3))
    assert found.faults == ()
    assert [item.id for item in found.effects] == ["foundation-tilt"]


@pytest.mark.parametrize("declared", [True, False])
def test_runs_that_are_alike_are_not_searched_apart(monkeypatch, declared):
    """Tables without times took one search more."""

    def unknown(record):
        forward = (record.stroke % 2) * (record.run == 2)
        return 9e-5 * forward * np.cos(np.radians(3.0 * record.angle))

    record = disturbed(unknown, plan=TumblePlan())
    if not declared:
        record = record.with_apparatus(launch_uncertainty=None, launch_sf_uncertainty=None)
    judged, asked = look._judged, []
    monkeypatch.setattr(look, "_judged", lambda *given: asked.append(given) or judged(*given))
    assert accelcal.discover(record).effects == ()
    assert len(asked) == 1


@pytest.mark.parametrize("seed", [2, 4])
def test_a_disturbed_run_is_no_noisy_one(seed):
    """Nothing was missing, as its scatter counted as noise of this run.

    Seed 4 told +96 urad in stroke 3, which is the same in the pure error, but explains a tenth as
    much of the readings.
    """
    runs = (20.0, 80.0, -40.0)
    record = slipped(20.0 * NOISE, first=82, last=108, seed=seed, temperatures=runs)
    told = accelcal.discover(record).unexplained.structure
    assert re.match(
        r"the misalignment is shifted for a time, by -(1\d\d|96) urad in 9 readings", told
    )


@pytest.mark.parametrize("seed", [1, 2])
def test_of_two_strokes_that_nothing_tells_apart_the_first_is_told(seed):
    """Both are forward, and the model explains them as well: rounding chose the other of seed 2."""
    record = accelcal.simulate(plan=TumblePlan(strokes=4), seed=seed)
    slip = 2e-4 * np.sin(np.radians(record.angle)) * (record.run == 0) * (record.stroke == 3)
    record = replace(record, output=record.output + 1.3 * slip).select(record.stroke % 2 == 1)
    told = accelcal.discover(record).unexplained.structure
    assert re.match(r"the misalignment is shifted .* from 0 deg of stroke 1 to 360 deg of", told)


@pytest.mark.parametrize("seed", range(3))
def test_a_noisy_run_is_not_disturbed(seed):
    def louder(record):
        noise = np.random.default_rng(seed).standard_normal(len(record))
        return 4.0 * NOISE * noise * (record.run == 1)

    assert accelcal.discover(disturbed(louder, seed=seed)).unexplained is None


def test_too_many_readings_are_not_searched(monkeypatch):
    monkeypatch.setattr(passing, "MOST", 20)
    monkeypatch.setattr(slow, "MOST", 20)
    found = accelcal.discover(disturbed(to_and_fro(780.0, 2.0 * NOISE)))
    assert found.unexplained is None
    assert "neighbouring readings are correlated" in " ".join(found.notes)


@pytest.mark.parametrize(("back", "slow"), [(-0.8, False), (0.8, True)])
def test_a_slow_disturbance_looks_like_neighbours_that_go_together(back, slow):
    def correlated(record):
        noise = 3.0 * NOISE * np.random.default_rng(1).standard_normal(len(record))
        place = np.argsort(record.time)
        noise[place[1:]] += back * noise[place[:-1]]
        return noise

    notes = accelcal.discover(disturbed(correlated)).notes
    (note,) = (note for note in notes if note.startswith("neighbouring readings are correlated"))
    assert ("slow disturbance" in note) is slow


@pytest.mark.parametrize(("positions", "strokes"), [(3, 6), (4, 4), (8, 4)])
def test_small_tests_are_searched(positions, strokes):
    plan = TumblePlan(temperatures=(20.0, 60.0), positions=positions, strokes=strokes, timed=True)
    found = accelcal.discover(accelcal.simulate(plan=plan, seed=2))
    assert found.unexplained is None


@pytest.mark.parametrize("of_run", [0.0, 3600.0])
def test_one_time_for_a_whole_run_tells_no_oscillation(of_run):
    record = disturbed(in_a_stroke(1, 4, 8.0 * NOISE))
    found = accelcal.discover(replace(record, time=of_run * record.run))
    assert found.unexplained.structure.startswith("the noise of stroke")


def walking(size):
    """A bias that goes a random step from each reading to the next."""

    def bias(record):
        steps = np.random.default_rng(7).standard_normal(len(record))
        return size * np.cumsum(steps)

    return bias


@pytest.mark.parametrize("seed", range(2))
def test_a_bias_that_walks_is_something_slow_and_no_noise_with_a_memory(seed):
    found = accelcal.discover(disturbed(walking(NOISE), seed=seed))
    assert not {item.id for item in found.effects} - set(found.doubtful)
    assert found.unexplained is not None


def test_something_slow_is_told_by_what_wanders_and_by_how_much():
    walk = walking(2.0 * NOISE)(record := disturbed(nothing))
    told = slow.slow(compared(disturbed(lambda _: walk), 20.0), (), 0.01)
    found = re.fullmatch(
        r"something slow: most like a bias that wanders, as a random walk, by ([\d.]+) ug rms in a"
        r" run",
        told.structure,
    )
    of_runs = [walk[record.run == run] for run in range(3)]
    rms = np.sqrt(np.mean([np.var(own) for own in of_runs]))
    assert float(found[1]) == pytest.approx(1e6 * rms, rel=0.2)
    assert 0.0 < told.share < 1.0


@pytest.mark.parametrize("rho", [0.0, 0.5])
def test_noise_with_a_memory_of_half_is_nothing_slow(rho):
    told = []
    for seed in range(25):
        record = disturbed(nothing, seed=seed, plan=TumblePlan(temperatures=(20.0, 60.0)))
        c = compared(record, 20.0).model.conditions
        draws = np.random.default_rng(seed).standard_normal(len(record))
        noise = 4.0 * NOISE * np.linalg.cholesky(memory(c, rho)) @ draws
        noisy = replace(record, output=record.output + 1.35 * noise)
        told.append(slow.slow(compared(noisy, 20.0), (), 0.01, seed))
    assert sum(each is not None for each in told) <= 1


def test_a_disagreement_without_a_name_takes_half_the_rate():
    def findings(p_value):
        return Findings(Judgement(p_value, np.ones(1), np.ones(1)), (), None)

    assert findings(0.004).chance_without_name == 0.008
    assert findings(0.7).chance_without_name == 1.0


def test_the_page_tells_how_many_draws_judge_and_the_least_chance_of_something_slow():
    """It told 999 where there are up to twice as many."""
    most = sum(draws for draws, _ in beside_noise._DRAWS)
    page = (Path(__file__).parents[1] / "docs" / "discovery.md").read_text()
    assert f"judged by up to {most} simulated draws" in " ".join(page.split())
    assert f"never a chance below {1.0 / (1 + most) / slow._SHARE:g}" in " ".join(page.split())


def test_a_shift_that_leaves_most_of_what_nothing_explains_is_not_told():
    """A hysteresis that grows with the temperature is in all strokes, not in one of them."""

    def loop(record):
        grows = 1.0 + (record.temperature - 20.0) / 60.0
        turn = np.sin(np.radians(record.angle))
        sense = np.where(record.stroke % 2 == 1, 1.0, -1.0)
        return -6.0 * NOISE * grows * sense * np.sign(turn) * (np.abs(turn) > 0.1)

    found = accelcal.discover(disturbed(loop))
    assert found.effects == ()
    assert "for a time" not in found.unexplained.structure


@pytest.mark.parametrize("seed", [3, 5])
def test_effects_that_take_back_each_other_are_not_sure(seed):
    """A bias that curves in each run was named a warm-up with a drift against it, both sure."""

    def curved(record):
        starts = np.array([record.time[record.run == run].min() for run in range(3)])
        return 1e-4 * ((record.time - starts[record.run]) / 3600.0) ** 2

    found = accelcal.discover(disturbed(curved, seed=seed))
    assert {item.id for item in found.effects} == set(found.doubtful) == {"bias-drift", "warm-up"}
    (note,) = (note for note in found.notes if "mostly take back each other" in note)
    assert note.startswith("bias-drift and warm-up are not sure")


@pytest.mark.parametrize("seed", [0, 5])
def test_a_bias_that_oscillates_once_in_a_turn_is_no_backlash(seed):
    """It was named backlash, as certain, beside a drift of the scale factor or the chamber."""
    plan = TumblePlan(positions=16, strokes=6, temperatures=(20.0, 60.0, -20.0), timed=True)
    record = accelcal.simulate(plan=plan, seed=seed, declare=True)
    turn = 16.0 * np.median(np.diff(record.time))
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi)
    air = 1.35 * 2e-5 * np.sin(2.0 * np.pi * record.time / turn + phase)
    found = accelcal.discover(replace(record, output=record.output + air))
    assert found.effects == ()
    assert found.unexplained.structure.startswith("the bias oscillates, period 15.5 min")
