"""Readings made safe against outliers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from one_record import estimate_of_record
from tumble_oracle import AL15, Apparatus, forward, record, turn

from accelcal.errors import DesignError
from accelcal.estimate import robust
from accelcal.estimate.robust import pseudo_values
from accelcal.estimate.tables import prepare
from accelcal.numerics.probability import student_quantile

SIGMA = 5e-6
ANGLES = turn(8, 6)
PLACES = np.mod(ANGLES, 360.0)


def readings(seed, angles=ANGLES):
    return forward(AL15, angles) + SIGMA * np.random.default_rng(seed).standard_normal(angles.size)


def fitted(y, robust=True, std=None):
    prepared = prepare(record(ANGLES, y, std=std))
    return estimate_of_record([prepared], Apparatus(head_uncertainty=0.0), robust=robust)


# -- outliers --------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [30.0, 1e3, 1e9])
@pytest.mark.parametrize("where", [0, 3, 30, 53])
def test_an_outlier_moves_the_coefficients_by_a_fraction_of_sigma(where, size):
    y = readings(1)
    spoilt = y.copy()
    spoilt[where] += size * SIGMA
    clean, robust, plain = (
        fitted(values, robust=safe).coefficients[0]
        for values, safe in ((y, True), (spoilt, True), (spoilt, False))
    )
    assert np.abs(robust - clean).max() < 0.4 * SIGMA
    assert np.abs(plain - clean).max() > 2.0 * SIGMA


def test_an_outlier_does_not_change_the_stated_noise_much():
    y = readings(2)
    before = fitted(y).noises[0].factor
    y[20] += 1e6 * SIGMA
    assert fitted(y).noises[0].factor == pytest.approx(before, rel=0.2)


def test_an_outlier_in_each_second_position():
    y = readings(3)
    for position in range(1, 8, 2):
        y[np.flatnonzero(45.0 * position == PLACES)[position % 6]] -= 1e4 * SIGMA
    assert_allclose(fitted(y).coefficients[0], AL15, atol=2.5 * SIGMA)


@pytest.mark.parametrize("noise", [0.0, 1e-7])
def test_an_outlier_among_rounded_readings(noise):
    """Where most strokes agree to the last digit there is no scale, and the median is taken."""
    y = np.round(forward(AL15, ANGLES) + noise * np.sign(readings(4)), 5)
    y[10] += 1.0
    assert_allclose(pseudo_values(y, PLACES)[10], np.median(y[PLACES[10] == PLACES]), atol=1e-15)


def test_three_strokes_are_enough():
    angles = turn(8, 3)[:-1]
    y = forward(AL15, angles) + SIGMA * np.random.default_rng(5).standard_normal(angles.size)
    places = np.mod(angles, 360.0)
    spoilt = y.copy()
    spoilt[12] += 1e3 * SIGMA
    moved = pseudo_values(spoilt, places) - pseudo_values(y, places)
    change = [moved[places == p].mean() for p in np.unique(places)]
    assert np.abs(change).max() < 1.2 * SIGMA


def test_two_strokes_are_refused():
    angles = turn(8, 2)[1:-1]
    with pytest.raises(DesignError, match="no position has three readings; measure more strokes"):
        pseudo_values(forward(AL15, angles), angles)


@pytest.mark.parametrize("where", range(1, 8))
def test_an_outlier_of_two_readings_stays_in_the_uncertainty(where):
    """Position 1 alone has more than two; elsewhere the noise tells of what cannot be mended."""
    angles = turn(8, 2)
    y = forward(AL15, angles) + SIGMA * np.random.default_rng(9).standard_normal(angles.size)
    y[where] += 200.0 * SIGMA
    places = np.mod(angles, 360.0)
    assert np.array_equal(pseudo_values(y, places)[places > 0.0], y[places > 0.0])
    prepared = prepare(record(angles, y))
    found = estimate_of_record([prepared], Apparatus(head_uncertainty=0.0), robust=True)
    uncertainty = np.sqrt(np.diagonal(found.components["reading"].covariance))
    assert np.all(np.abs(found.coefficients[0] - AL15) < 2.23 * uncertainty)  # Student, 10 dof


@pytest.mark.parametrize("wrong", [(200.0, 150.0), (200.0, -150.0), (10.0, 20.0)])
@pytest.mark.parametrize("where", range(1, 8))
def test_two_wrong_readings_of_four_stay_in_the_noise(where, wrong):
    """No three agree: their scatter stays, about a centre in the middle."""
    angles = turn(8, 4)
    y = forward(AL15, angles) + SIGMA * np.random.default_rng(9).standard_normal(angles.size)
    places = np.mod(angles, 360.0)
    own = places == 45.0 * where
    y[np.flatnonzero(own)[:2]] += np.array(wrong) * SIGMA
    pseudo = pseudo_values(y, places)
    assert_allclose(pseudo[own] - pseudo[own].mean(), y[own] - y[own].mean(), atol=1e-15)
    assert np.abs(pseudo[own].mean() - np.median(y[own])) < 0.4 * np.ptp(np.sort(y[own])[1:3])
    assert np.ptp((pseudo - y)[~own]) < 5.0 * SIGMA


@pytest.mark.parametrize("strokes", [3, 4, 6])
def test_coverage_with_a_tenth_of_the_readings_wrong(strokes):
    """The intervals of 2000 tables; of two wrong readings bent alike they held 89 % of four."""
    rng = np.random.default_rng(10)
    angles = turn(8, strokes)
    design = np.stack([forward(unit, angles) for unit in np.eye(6)], axis=1)
    y = rng.standard_normal((2000, angles.size))
    y += rng.uniform(-30.0, 30.0, y.shape) * (rng.random(y.shape) < 0.1)
    _, cell = np.unique(np.mod(angles, 360.0), return_inverse=True)
    pseudo = pseudo_values(y, cell)
    means = np.stack([pseudo[:, cell == k].mean(axis=1) for k in range(8)], axis=1)[:, cell]
    dof = angles.size - 8
    noise = np.sqrt(((pseudo - means) ** 2).sum(axis=1) / dof)
    found = np.abs(pseudo @ np.linalg.pinv(design).T)
    width = noise[:, None] * np.sqrt(np.diagonal(np.linalg.inv(design.T @ design)))
    assert 0.935 < np.mean(found < student_quantile(0.95, dof) * width) < 0.965


# -- clean data ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("strokes", "least"), [(3, 0.93), (6, 0.92), (12, 0.92)])
def test_clean_data_lose_little(strokes, least):
    """Efficiency about 95 %, and the pseudo-values scatter by as much as the centres show."""
    rng = np.random.default_rng(6)
    cells = np.repeat(np.arange(8), strokes)
    y = rng.standard_normal((1500, cells.size))
    pseudo = np.array([pseudo_values(row, cells) for row in y]).reshape(1500, 8, strokes)
    centre = pseudo.mean(axis=2)
    variance = strokes * np.mean(centre**2)  # +- 1.3 %, one standard deviation
    assert least < 1.0 / variance < 1.05
    within = ((pseudo - centre[..., None]) ** 2).sum(axis=(1, 2)) / (8 * (strokes - 1))
    assert np.mean(within) == pytest.approx(variance, rel=0.06)


# -- equivariance ----------------------------------------------------------------------------------


@given(st.integers(0, 2**32 - 1), st.floats(1e-6, 1e6), st.floats(-1e3, 1e3))
@settings(max_examples=30, deadline=None)
def test_shift_scale_and_order(seed, scale, shift):
    rng = np.random.default_rng(seed)
    cells = rng.integers(0, 5, 25)
    cells[:3] = 0
    y = rng.standard_t(2, 25)
    plain = pseudo_values(y, cells)
    size = scale * np.abs(y).max() + abs(shift)
    assert_allclose(
        pseudo_values(scale * y + shift, cells), scale * plain + shift, atol=1e-8 * size
    )
    order = rng.permutation(25)
    assert_allclose(pseudo_values(y[order], cells[order]), plain[order], atol=1e-8 * size / scale)
    assert_allclose(pseudo_values(-y, cells), -plain, atol=1e-8 * size / scale)


def test_the_unit_of_the_scatter_does_not_matter():
    rng = np.random.default_rng(7)
    sigma = rng.uniform(1.0, 9.0, 54)
    y = sigma * rng.standard_normal(54)
    one, other = (pseudo_values(y, PLACES, unit * sigma) for unit in (1.0, 1e-6))
    assert_allclose(one, other, rtol=1e-7)


def test_a_reading_declared_bad_is_no_outlier():
    """Readings with a declared std 100 times larger keep their scatter, and little weight."""
    rng = np.random.default_rng(8)
    sigma = np.where(np.arange(54) % 2 == 0, 100.0, 1.0) * SIGMA
    y = forward(AL15, ANGLES) + sigma * rng.standard_normal(54)
    found = fitted(y, std=sigma)
    plain = fitted(y, std=sigma, robust=False)
    assert found.noises[0].source == "declared"
    uncertainty = np.sqrt(np.diagonal(plain.components["reading"].covariance))
    assert np.all(np.abs(found.coefficients[0] - plain.coefficients[0]) < uncertainty)
    assert np.all(np.abs(found.coefficients[0] - AL15) < 4 * uncertainty)
    bad = sigma > SIGMA
    kept = pseudo_values(y, PLACES, sigma)[bad] - forward(AL15, ANGLES)[bad]
    assert np.std(kept) > 50 * SIGMA


@pytest.mark.parametrize("replicates", [66, 67, 300, 1001])
def test_some_pairs_of_many_replicates_tell_the_scale_as_all(replicates, monkeypatch):
    y = np.random.default_rng(1).standard_normal((5, 2 * replicates))
    y[:, ::20] += 50.0
    arguments = y, np.full(y.shape, 2.0), [np.arange(replicates), np.arange(replicates, y.shape[1])]
    some = robust._scale(*arguments)
    monkeypatch.setattr(robust, "_PARTNERS", replicates)
    every = robust._scale(*arguments)
    assert_allclose(some, every, rtol=0.02 if replicates > 66 else 0.0)
    assert robust._pairs(7)[0].size == 21
