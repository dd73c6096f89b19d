"""What a comparison says of chance, held against Student's distribution and against simulation."""

from __future__ import annotations

import numpy as np
import pytest

import accelcal
from accelcal.discovery.factors import Block
from accelcal.discovery.space import space_of
from accelcal.discovery.where import shares
from accelcal.simulation import NoiseComponents, TumblePlan, simulate

SHORT = TumblePlan(strokes=1, temperatures=(20.0,))
QUIET = NoiseComponents(reading=5e-6, head=0.0, launch=0.0, launch_sf=0.0)
T_3 = 3.182446  # Student's factor of 3 degrees of freedom, two-sided 95 % (tables)
T_10 = 2.228139


def short(seed: int, plan: TumblePlan = SHORT) -> accelcal.TumbleRecord:
    return simulate(plan=plan, noise=QUIET, seed=seed)


@pytest.mark.parametrize(("strokes", "factor"), [(1, T_3), (2, T_10)])
def test_noise_that_only_the_calibration_tells_has_its_degrees_of_freedom(strokes, factor):
    # 9 readings less 6 coefficients; 18 readings less 8 positions, none of them repeated enough
    plan = TumblePlan(strokes=strokes, temperatures=(20.0,))
    calibration = accelcal.fit(short(1, plan))
    (run,) = accelcal.compare(calibration, short(2)).runs
    for change in (run.bias, run.scale_factor, run.misalignment):
        assert change.coverage_factor == pytest.approx(factor, rel=1e-6)


def test_chance_and_intervals_of_short_records_are_what_they_claim_to_be():
    # before, of records of one stroke 32 % had p below 0.05, and 83 to 87 % of intervals held
    held, p_values = [], []
    for seed in range(150):
        found = accelcal.compare(accelcal.fit(short(seed)), short(seed + 10_000))
        p_values.append(found.p_value)
        (run,) = found.runs
        changes = (run.bias, run.scale_factor, run.misalignment)
        held.append([abs(q.value) <= q.expanded_uncertainty for q in changes])
    assert np.mean(np.array(p_values) < 0.05) < 0.10  # 2.8 standard errors above 0.05
    assert np.mean(np.array(p_values) < 0.01) < 0.034
    assert np.mean(held, axis=0).min() > 0.90


def test_shares_of_noise_known_with_few_degrees_of_freedom_follow_fisher():
    # one direction of 2 standard deviations; P(|t_4| > 2) = 0.1161, P(|z| > 2) = 0.0455 (tables)
    space = space_of(np.eye(3), np.empty((3, 0)), np.eye(3))
    block = Block("position", np.eye(3)[:, :1])
    seen = np.array([2.0, 0.0, 0.0])
    (few,) = shares(space, seen, [block], 4.0)
    (known,) = shares(space, seen, [block])
    assert few.p_value == pytest.approx(0.116117, abs=1e-6)
    assert known.p_value == pytest.approx(0.045500, abs=1e-5)


def test_what_a_calibration_tells_from_few_readings_counts_as_larger():
    # a calibration of 3 degrees of freedom beside a long record: the uncertainty of the change is
    # that of the calibration, and its interval has Student's factor of 3
    calibration = accelcal.fit(short(1))
    long = simulate(plan=TumblePlan(strokes=40, temperatures=(20.0,)), noise=QUIET, seed=2)
    (run,) = accelcal.compare(calibration, long).runs
    own = calibration.tables[0].error_model["delta"]
    assert own.coverage_factor == pytest.approx(T_3, rel=1e-6)
    assert run.misalignment.expanded_uncertainty == pytest.approx(
        own.expanded_uncertainty, rel=0.05
    )
