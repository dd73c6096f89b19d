"""Noise that is slow, and slow effects that pass for such noise."""

import re
from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest
from rivals.cases import Case
from rivals.trial import truth_of
from scipy.stats import multivariate_normal

import accelcal
from accelcal.discovery.comparison import compared
from accelcal.discovery.doubts.caveats import _wandering
from accelcal.discovery.family import family_of
from accelcal.discovery.search import search
from accelcal.discovery.unnamed.slow import _SIZES, Wandering, _likeliest
from accelcal.effects.catalogue import effect
from accelcal.results.findings import Gap
from accelcal.simulation import NoiseComponents, TumblePlan

look = import_module("accelcal.discovery.look")

ONE_RUN = TumblePlan(temperatures=(20.0,), seconds_per_reading=45.0, timed=True)


def walked(seed, step):
    """A record of three runs with a random walk of the bias [g a reading] in each."""
    record = accelcal.simulate(plan=TumblePlan(timed=True), seed=seed)
    walk = np.random.default_rng(seed).standard_normal((3, len(record) // 3)) * step
    return replace(record, output=record.output + 1.35 * np.cumsum(walk, axis=1).ravel())


NO_HEAD = NoiseComponents(reading=5e-6, head=0.0, launch=1e-5, launch_sf=5e-6)


def added(plan, bias, seed):
    """A record with a bias [g] that goes with the part of its run that has passed."""
    record = accelcal.simulate(plan=plan, noise=NO_HEAD, seed=seed)
    starts = np.array([record.time[record.run == run].min() for run in np.unique(record.run)])
    passed = record.time - starts[record.run]
    return replace(record, output=record.output + 1.35 * bias(passed / passed.max()))


def doubted(found):
    return set(found.doubtful)


def found_in_noise(regime, number):
    """What is found in a clean table of one run."""
    _, record, _ = truth_of(Case("memory", "none", "one", regime, 1.0, number), 77)
    return accelcal.discover(record)


@pytest.mark.parametrize("seed", range(4))
def test_a_warm_up_within_the_only_run_is_no_noise(seed):
    hidden = accelcal.effect("warm-up").of(8e-5, tau=450.0)
    record = accelcal.simulate(plan=ONE_RUN, effects=[hidden], seed=seed)
    found = accelcal.discover(record)
    assert [item.id for item in found.effects] == ["warm-up"]
    amplitude = found.effects[0].parameters["amplitude"]
    assert abs(amplitude.value - 8e-5) < 4.0 * amplitude.standard_uncertainty
    assert found.noise[0].value < 8e-6
    assert found.after.rms < found.before.rms


@pytest.mark.parametrize("seed", [6, 8])
def test_a_bias_that_walks_is_told_beside_the_name_that_it_gets(seed):
    found = accelcal.discover(walked(seed, 1.5e-6))
    names = {item.id for item in found.effects}
    assert "bias-step" in names
    assert names & {"bias-drift", "warm-up"}  # it is neither
    assert doubted(found)


@pytest.mark.parametrize(
    ("regime", "number"),
    [("ar1-weak", 79), ("ar1", 184), ("ar1", 197), ("ar1-strong", 197), ("flicker", 176)]
    + [("walk", number) for number in (11, 53, 169)],
)
def test_noise_with_a_memory_in_one_run_gets_no_name_without_a_doubt(regime, number):
    found = found_in_noise(regime, number)
    assert {item.id for item in found.effects} <= doubted(found)


@pytest.mark.parametrize(
    ("regime", "number"), [("ar1-strong", 59), ("flicker", 10), ("flicker", 197), ("walk", 177)]
)
def test_what_noise_explains_as_well_gets_no_name(regime, number):
    found = found_in_noise(regime, number)
    assert found.effects == ()
    assert found.p_value < found.alpha
    assert any("is not named: a bias that wanders" in note for note in found.notes)
    assert "not accepted: bias-step" in found.unexplained.structure
    assert found.unexplained.p_value == found.p_value
    assert found.after == found.before


@pytest.mark.parametrize(("regime", "number"), [("ar1", 174), ("flicker", 82), ("walk", 184)])
def test_noise_whose_memory_is_not_significant_may_have_one(regime, number):
    found = found_in_noise(regime, number)
    assert found.effects == ()
    assert found.unexplained is None
    assert found.p_value > found.alpha


@pytest.mark.parametrize(("more", "shared"), [(0.0, True), (0.3, False)])
def test_rates_are_shared_where_the_same_memory_is_possible_alone(more, shared):
    """A search once more took the rates of noise that may have another memory."""
    record, effects = accelcal.simulate(seed=1), (effect("bias-step"),)
    comparison = compared(record, 20.0)
    noise, rates = comparison.noise, 1234.0
    noise = noise._replace(possible=tuple(rho + more for rho in noise.possible))
    like = family_of(comparison._replace(noise=noise), effects)._replace(tests=rates)
    asked = look.Question(20.0, 0.0, effects, alpha=0.01, most=1, seed=0, like=like)
    assert (look.look_through(record, asked).family.tests == rates) is shared


def test_a_search_is_not_made_again_where_the_noise_is_the_same_beside_what_was_found(monkeypatch):
    """It was made, and thrown away: half of the time."""
    hidden, searches = [accelcal.effect("stroke-offset").of(2e-5)], []
    monkeypatch.setattr(
        look, "search", lambda family, **asked: searches.append(1) or search(family, **asked)
    )
    record = accelcal.simulate(effects=hidden, seed=1)
    assert [item.id for item in accelcal.discover(record).effects] == ["stroke-offset"]
    assert len(searches) == 1


@pytest.mark.parametrize(("law", "said"), [(np.sqrt, "root|logarithm"), (np.square, "square")])
def test_a_bias_that_settles_by_no_listed_law_gets_no_sure_name(law, said):
    """It was a warm-up, or a drift, as certain."""
    found = accelcal.discover(added(TumblePlan(timed=True), lambda part: 2e-5 * law(part), seed=0))
    assert found.effects
    assert {item.id for item in found.effects} == doubted(found)
    told = f"a bias that goes with the ({said}) of the time in each run explains these readings"
    assert any(re.search(told, note) for note in found.notes)


@pytest.mark.parametrize("seed", [0, 2])
def test_an_oscillation_in_step_with_the_strokes_is_no_sure_backlash(seed):
    """It was backlash or hysteresis, as certain; a backlash of several runs is in step in all."""
    plan = TumblePlan(temperatures=(20.0,), strokes=4, timed=True)

    def in_step(part):
        return 1.5e-5 * np.sin(2.0 * np.pi * 35.0 / 9.0 * part + np.pi / 9.0 * seed)

    found = accelcal.discover(added(plan, in_step, seed))
    (name,) = (item.id for item in found.effects)
    assert name in ("backlash", "hysteresis")
    assert found.doubtful == (name,)
    assert any("it could as well be that the bias oscillates" in note for note in found.notes)
    runs = TumblePlan(temperatures=(20.0, 80.0), strokes=4, timed=True)
    hidden = [accelcal.effect("backlash").of(2e-5)]
    assert accelcal.discover(accelcal.simulate(plan=runs, effects=hidden, seed=seed)).doubtful == ()


@pytest.mark.parametrize(
    "hidden",
    [
        accelcal.effect("bias-step").of(2e-5, reading=80.0),
        accelcal.effect("warm-up").of(6e-5, tau=600.0),
        accelcal.effect("stroke-offset").of(1e-5),
    ],
    ids=lambda hidden: hidden.effect.id,
)
def test_a_step_a_warm_up_and_an_offset_are_not_doubted(hidden):
    for seed in range(2):
        found = accelcal.discover(accelcal.simulate(effects=[hidden], seed=seed))
        assert [item.id for item in found.effects] == [hidden.effect.id]
        assert doubted(found) == set()


def test_the_likelihood_is_that_of_the_normal_distribution():
    rng = np.random.default_rng(4)
    columns, power, rest = rng.standard_normal((9, 4)), 1.0 / np.arange(1.0, 5.0), np.full(9, 2.0)
    log, rms = _likeliest(rest, columns, power)
    logs = [
        multivariate_normal.logpdf(rest, cov=np.eye(9) + s**2 * (columns * power) @ columns.T)
        for s in _SIZES
    ]
    white = multivariate_normal.logpdf(np.zeros(9), cov=np.eye(9))
    assert log == pytest.approx(max(logs) - white)
    assert rms == pytest.approx(_SIZES[int(np.argmax(logs))] * np.sqrt(power.sum()))


# -- steps that are none ---------------------------------------------------------------------------

THREE_RUNS = TumblePlan(temperatures=(20.0,) * 3, timed=True)


@pytest.mark.parametrize("seed", [1, 4])
def test_a_step_where_the_bias_of_one_run_walks_is_not_sure(seed):
    record = accelcal.simulate(plan=THREE_RUNS, seed=seed)
    walk = 4e-6 * np.cumsum(np.random.default_rng(seed).standard_normal(54))
    output = record.output.copy()
    output[record.run == 1] += 1.35 * walk
    found = accelcal.discover(replace(record, output=output))
    assert [item.id for item in found.effects] == ["bias-step"]
    assert found.doubtful == ("bias-step",)


@pytest.mark.parametrize("seed", range(2))
def test_a_step_is_sure(seed):
    hidden = accelcal.effect("bias-step").of(4e-5, reading=80.0)
    found = accelcal.discover(accelcal.simulate(plan=THREE_RUNS, effects=[hidden], seed=seed))
    assert [item.id for item in found.effects] == ["bias-step"]
    assert found.doubtful == ()


@pytest.mark.parametrize(
    ("rho", "after", "widened"), [(0.9, 1.3, True), (0.9, 1.0, False), (0.0, 1.3, False)]
)
def test_what_widens_the_gap_in_slow_noise_is_no_effect(monkeypatch, rho, after, widened):
    """Steps were accepted beside which readings were farther from the model than without."""
    gap = {(): 1.0, ("step",): after}
    monkeypatch.setattr(look, "solution", lambda _, effects: effects)
    monkeypatch.setattr(look, "gap_of", lambda effects, _: Gap(gap[effects], None, 1.0))
    comparison = SimpleNamespace(noise=SimpleNamespace(rho=rho))
    assert look._widens_the_gap(comparison, SimpleNamespace(instances=("step",))) is widened


def test_a_large_wander_is_written_without_an_exponent():
    """It was "1.2e+02 urad"."""
    item = SimpleNamespace(effect=effect("warm-up"))
    (caveat,) = _wandering([Wandering(item, 50.0, "misalignment", 1.234e-4)], named=True)
    assert "noise with a memory, of 120 urad rms in a run" in caveat.text
