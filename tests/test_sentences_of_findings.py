"""Sentences of discover and compare, against records of known truth."""

import numpy as np
import pytest

import accelcal
from accelcal.discovery.doubts.caveats import _wandering
from accelcal.discovery.factors import structure
from accelcal.discovery.instance import Instance
from accelcal.discovery.unnamed.slow import Wandering, size_in_a_run
from accelcal.effects.conditions import conditions_of
from accelcal.report.discovery import change_row
from accelcal.results.findings import Change
from accelcal.results.quantity import Quantity
from accelcal.simulation import TumblePlan, simulate

ONE_LEVEL = TumblePlan(temperatures=(20.0,))


def pattern_of(factor, shape):
    record = simulate(seed=1)
    c = conditions_of(record, 20.0)
    return structure(c, record.run_labels, factor, shape(np.radians(c.angle)))


def test_what_is_alike_at_all_angles_is_no_harmonic():
    """At positions 45 deg apart a bias was told as cos 8th."""
    assert "as cos 8th" not in pattern_of("position", np.ones_like)
    assert ", alike at all angles;" in pattern_of("position", np.ones_like)
    assert ", as cos 4th;" in pattern_of("position", lambda th: np.cos(4.0 * th))


@pytest.mark.parametrize(
    ("factor", "place"),
    [
        ("position", "at 90 deg"),
        ("stroke*position", "at 90 deg, forward"),
        ("run*position", "at 90 deg, run 1"),
        ("run*time", "at 90 deg, forward stroke 1, run 1"),
    ],
)
def test_a_pattern_is_largest_where_its_factor_tells(factor, place):
    """What is the same in all strokes and runs was largest in stroke 1 of run 3."""
    assert pattern_of(factor, np.sin).endswith(place)


def test_where_they_disagree_is_told_where_they_do():
    known, same = (simulate(plan=ONE_LEVEL, seed=seed) for seed in (1, 2))
    other = simulate(plan=ONE_LEVEL, effects=[accelcal.effect("backlash").of(1e-4)], seed=2)
    calibration = accelcal.fit(known)
    assert "Where they disagree" not in str(accelcal.compare(calibration, same))
    assert "Where they disagree" in str(accelcal.compare(calibration, other))


def test_one_level_tells_nothing_of_a_drift_of_the_chamber():
    """It was said to leave no trace there, where it drifts bias and scale factor."""
    said = " ".join(str(accelcal.discover(simulate(plan=ONE_LEVEL, seed=1))).split())
    assert "no trace" not in said
    (untold,) = said.split("nothing tells of ")[1:]
    assert "chamber-drift" in untold.partition(" fixture-offset")[0]


@pytest.mark.parametrize("seed", range(40, 46))
def test_head_errors_that_a_calibration_does_not_show_are_not_counted_as_larger(seed):
    plan = TumblePlan(temperatures=(20.0,), strokes=8)
    calibration = accelcal.fit(simulate(plan=plan, seed=seed, declare=False))
    (head,) = (source for source in calibration.error_sources if source.name == "head")
    notes = accelcal.compare(calibration, simulate(plan=plan, seed=9, declare=False)).notes
    (said,) = (note for note in notes if "head_uncertainty" in note)
    assert ("counted as larger" in said) is bool(head.value)
    assert ("shows none" in said) is (not head.value)


def test_what_may_wander_in_place_of_several_effects_is_told_once():
    ids = ("bias-drift", "warm-up", "bias-step")
    walks = [
        Wandering(Instance(accelcal.effect(name), (1.0,), {}), 0.0, "bias", rms)
        for name, rms in zip(ids, (1.3e-5, 8e-6, 8e-6), strict=True)
    ]
    (told,) = _wandering(walks, named=True)
    assert told.text.startswith("bias-drift, warm-up and bias-step are not sure: a bias that")
    assert "of 13 ug rms in a run" in told.text
    assert tuple(told.doubted) == ids
    (alone,) = _wandering(walks[:1], named=False)
    assert alone.text.startswith("bias-drift is not named:")
    assert alone.doubted == []


def test_what_wanders_by_more_than_anything_does_is_told_as_absurd():
    """A misalignment that wanders by 3500 urad in a run was told like any other."""
    assert size_in_a_run("misalignment", 3.5e-3).startswith("3500 urad rms in a run (absurdly much")
    assert size_in_a_run("misalignment", 4e-5) == "40 urad rms in a run"


def test_a_change_has_the_digits_of_its_coefficient():
    """Beside 520.0 ppm/degC stood a change of 0.003041 ppm/degC."""
    before, after = Quantity(5.2e-4, None, "1/degC"), Quantity(5.2e-4 + 3.041e-9, None, "1/degC")
    row = change_row(Change("K1 above T0", before, after))
    assert row == ("beta1", "520.0", "unknown", "520.0", "unknown", "0.0", "ppm/degC")


def test_a_change_tells_how_uncertain_its_coefficient_is_before_and_after():
    """K2 "270 -> 80 ug/g^2" had no U, which is 7.5 before, and 610 as it may be another effect."""
    before = Quantity(2.7e-4, 3.8e-6, "g/g^2", 7.5e-6)
    after = Quantity(8e-5, 3.1e-4, "g/g^2", 6.1e-4)
    row = change_row(Change("K2", before, after))
    assert row == ("k2", "270.0", "7.5", "80", "610", "-190", "ug/g^2")


def test_all_that_effects_may_be_is_one_sentence_of_a_fit():
    """Of an error of a head position up to four sentences began alike."""
    hidden = [accelcal.effect("position-error").of(1.4e-4, at=45.0)]
    record = simulate(effects=hidden, seed=0)
    said = accelcal.fit(record, model=accelcal.discover(record)).warnings
    (told,) = (text for text in said if text.startswith("U counts what else the effects may be"))
    assert told.count("; if it is ") > 1


def test_where_no_further_readings_tell_effects_apart_the_sentence_has_no_menu(monkeypatch):
    from accelcal.discovery import discover

    monkeypatch.setattr(discover, "proposals", lambda *_: ())
    bent = [accelcal.effect("scale-factor-asymmetry").of(5e-4)]
    found = accelcal.discover(simulate(effects=bent, seed=1))
    assert found.effects[0].indistinguishable
    assert found.next_measurement == "none of the further readings that were tried tells them apart"
