"""Strokes that scatter more than the declared std: all alike, or in proportion to it."""

import numpy as np
import pytest
from tumble_oracle import AL15, forward, record, turn

import accelcal
from accelcal.calibrate.fit import calibrate_many
from accelcal.estimate.declared_scatter import declared_scatter, with_even_scatter

ANGLES = turn(8, 6)
HEAD, STROKE = ANGLES % 360.0, np.repeat(np.arange(6) + 1, 9)
NEAR_ZERO = 1.0 + 4.0 * np.abs(np.cos(np.radians(ANGLES)))
KNOWN = {"head_uncertainty": 0.0, "launch_uncertainty": 0.0, "launch_sf_uncertainty": 0.0}


def table(rng, std, even, times=1.0, count=10_000.0):
    """Readings that scatter by `even` in all of them and by `times` what their samples tell."""
    own = times * std / np.sqrt(count) * rng.standard_normal(ANGLES.size)
    noise = 1.35 * (even * rng.standard_normal(ANGLES.size) + own)
    whole = record(
        ANGLES,
        forward(AL15, ANGLES) + noise,
        std=1.35 * std,
        count=np.full(ANGLES.size, count),
    )
    return whole.with_apparatus(**KNOWN)


def held(rng, std, **scatter):
    """How often the intervals of each coefficient hold the truth."""
    hits = []
    for _ in range(100):
        found = accelcal.fit(table(rng, std, **scatter)).tables[0].coefficients
        pairs = zip(found.values(), AL15, strict=True)
        hits.append([abs(q.value - truth) <= q.expanded_uncertainty for q, truth in pairs])
    return np.mean(hits, axis=0)


def test_a_scatter_that_is_alike_gives_readings_like_weights():
    """K0 held in 67 %, M in 72 % where weights went by the deviations of the samples."""
    rng = np.random.default_rng(1)
    assert held(rng, 6e-6 * NEAR_ZERO, even=5e-6).min() > 0.86


def test_a_scatter_in_proportion_keeps_the_weights():
    rng = np.random.default_rng(2)
    std = 6e-6 * NEAR_ZERO
    assert held(rng, std, even=0.0, times=10.0).min() > 0.88
    found = declared_scatter(table(rng, std, even=0.0, times=10.0)).size
    assert np.ptp(np.log(found)) > 1.2  # log 5 as declared


def test_strokes_that_bear_the_deviations_out_change_nothing():
    rng = np.random.default_rng(3)
    kept = 0
    for _ in range(50):
        own = table(rng, 6e-6 * NEAR_ZERO, even=0.0)
        kept += np.allclose(declared_scatter(own).size, own.std / 100.0, rtol=0.05)
    assert kept >= 47


def test_the_mean_square_stays_and_with_it_what_the_report_says():
    rng = np.random.default_rng(4)
    size = rng.uniform(1.0, 5.0, ANGLES.size)
    found = with_even_scatter(size, np.inf, 50.0 * rng.standard_normal(ANGLES.size), HEAD, STROKE)
    assert np.ptp(found) < np.ptp(size)
    assert np.mean(found**2) == pytest.approx(np.mean(size**2))
    text = str(accelcal.fit(table(rng, 6e-6 * NEAR_ZERO, even=5e-6)))
    assert "times more than the declared std" in text


def test_units_do_not_matter():
    rng = np.random.default_rng(5)
    size, output = rng.uniform(1.0, 5.0, ANGLES.size), 50.0 * rng.standard_normal(ANGLES.size)
    found = with_even_scatter(size, 1e5, output, HEAD, STROKE)
    other = with_even_scatter(1e-6 * size, 1e5, 1e-6 * output, HEAD, STROKE)
    assert other == pytest.approx(1e-6 * found)


def test_checks_and_discovery_take_the_scatter_as_it_is():
    """The outlier gate warned of 74 % of clean tables, and discovery named an effect in 7 %."""
    rng = np.random.default_rng(6)
    records = [table(rng, 6e-6 * NEAR_ZERO, even=5e-6) for _ in range(20)]
    warned = [
        gate.name
        for own in records
        for gate in accelcal.fit(own).tables[0].gates
        if gate.verdict == "warn"
    ]
    assert len(warned) <= 4
    assert not any(accelcal.discover(own).effects for own in records[:5])


def test_records_of_one_plan_have_weights_of_their_own():
    rng = np.random.default_rng(7)
    std = 6e-6 * NEAR_ZERO
    records = [table(rng, std, even=even) for even in (5e-6, 0.0, 2e-7)]
    found = calibrate_many(records)
    assert not found.failures
    for places, stack in found.stacks:
        for row, place in enumerate(places.tolist()):
            assert stack.one(row).to_json() == accelcal.fit(records[place]).to_json()
