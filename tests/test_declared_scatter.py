"""Standard uncertainty of averaged readings from `std` and `n`."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from one_record import estimate_of_record
from scipy.special import digamma, polygamma
from tumble_oracle import AL15, Apparatus, forward, record, turn

from accelcal.estimate.declared_scatter import (
    _bias_of_log,
    _of_samples,
    _variance_of_log,
    declared_scatter,
    is_weighted,
)
from accelcal.estimate.tables import prepare

ANGLES = turn(8, 2)
SIGMA = 5e-6
RISE = np.arange(2.0, 11.0)


def declared(std, count):
    n = np.size(std)
    whole = record(
        turn(n - 1), forward(AL15, turn(n - 1)), std=np.array(std), count=np.array(count)
    )
    return declared_scatter(whole)


def averaged(rng, samples, spread):
    """Table whose readings are means of few samples, of one scatter or of scatters of their own."""
    return averages(rng, ANGLES, samples, rng.uniform(1.0 / spread, spread, ANGLES.size))


def averages(rng, angles, samples, size):
    noise = SIGMA * size[:, None] * rng.standard_normal((angles.size, samples))
    return record(
        angles,
        forward(AL15, angles) + noise.mean(axis=1),
        std=noise.std(axis=1, ddof=1),
        count=np.full(angles.size, float(samples)),
    )


@pytest.mark.parametrize(("samples", "spread"), [(2, 1.0), (3, 1.0), (5, 1.0), (5, 2.0), (10, 2.0)])
def test_deviations_of_few_samples_give_honest_uncertainties(samples, spread):
    rng = np.random.default_rng(11)
    errors, variances = [], []
    for _ in range(300):
        found = estimate_of_record(
            [prepare(averaged(rng, samples, spread))], Apparatus(head_uncertainty=0.0)
        )
        errors.append(found.coefficients[0] - AL15)
        variances.append(np.diagonal(found.components["reading"].covariance))
    ratio = np.mean(variances, axis=0) / np.mean(np.square(errors), axis=0)
    assert np.all((ratio > 0.75) & (ratio < 1.35))  # 1 within 3 sigma; by each alone 0.4 to 0.7


@pytest.mark.parametrize("samples", [3, 5, 10])
def test_noise_that_follows_the_angle_is_that_of_the_position(samples):
    """Each reading by itself, variances were told from 0.57 to 2.7 times as large as they are."""
    rng, angles = np.random.default_rng(12), turn(8, 6)
    size = 1.0 + 4.0 * np.abs(np.cos(np.radians(angles)))
    errors, variances = [], []
    for _ in range(300):
        prepared = prepare(averages(rng, angles, samples, size))
        found = estimate_of_record([prepared], Apparatus(head_uncertainty=0.0))
        errors.append(found.coefficients[0] - AL15)
        variances.append(np.diagonal(found.components["reading"].covariance))
    ratio = np.mean(variances, axis=0) / np.mean(np.square(errors), axis=0)
    assert np.all((ratio > 0.78) & (ratio < 1.65))  # 1 of 300 is taken for correlated noise


def test_deviations_that_scatter_by_chance_are_pooled():
    scatter, dof, doubt = declared([1.0, 2.0, 1.5, 1.2, 1.8, 0.9, 1.4, 1.1, 1.3], np.full(9, 4.0))
    squares = np.square([1.0, 2.0, 1.5, 1.2, 1.8, 0.9, 1.4, 1.1, 1.3])
    assert_allclose(scatter, np.sqrt(squares.mean() / 4.0))
    assert dof == 27.0
    assert not doubt.any()


def test_deviations_of_many_samples_stand():
    std = np.geomspace(1.0, 100.0, 9)
    scatter, _, doubt = declared(std, np.full(9, 1e5))
    assert_allclose(scatter, std / np.sqrt(1e5), rtol=1e-3)
    assert_allclose(doubt, 2e-5, rtol=1e-3)


def test_deviations_of_few_samples_say_nothing_against_those_of_many():
    """Of two samples they scatter from 0.02 to 2 by chance, which all others, alike, do not."""
    std = np.array([1.0, 0.02, 1.01, 0.2, 0.99, 0.7, 1.0, 1.2, 0.995])
    count = np.where(np.arange(9) % 2, 2.0, 1e4)
    scatter, *_ = declared(std, count)
    assert_allclose(scatter * np.sqrt(count), 1.0, rtol=0.1)


def test_deviations_of_few_and_of_many_samples_are_compared_as_chance_has_them():
    """The mean of the logarithm of a variance is smaller where it has few degrees of freedom."""
    angles, count = turn(8, 40), np.where(np.arange(360) // 9 % 2, 2.0, 61.0)
    chance = np.random.default_rng(1).chisquare(count - 1.0) / (count - 1.0)
    size = 1.0 + np.cos(np.radians(angles)) ** 2
    std = size * np.sqrt(chance)
    found = _of_samples(record(angles, forward(AL15, angles), std=std, count=count))
    assert_allclose(found.size * np.sqrt(count), size, rtol=0.1)  # one for all at a position


@pytest.mark.parametrize("few", [2.0, 3.0])
def test_counts_far_apart_give_finite_weights(few):
    for many in (1e6, 1e20):
        scatter, dof, doubt = declared([1.0] + [2.0, 0.5] * 4, np.array([many] + [few] * 8))
        assert np.isfinite([*scatter, dof, *doubt]).all()
        assert (scatter > 0.0).all()
        assert (doubt >= 0.0).all()


@pytest.mark.parametrize(
    ("std", "count", "weighted"),
    [
        (None, None, False),
        (1.0, None, False),
        (RISE, None, True),
        (1.0, 5.0, False),
        (1.0, RISE, True),
    ],
)
def test_what_is_declared_unlike_gives_weights(std, count, weighted):
    given = {"std": std, "count": count}
    own = {name: np.broadcast_to(size, 9) for name, size in given.items() if size is not None}
    assert is_weighted(record(turn(8), forward(AL15, turn(8)), **own)) is weighted


def test_what_is_declared_of_one_sample_stands():
    scatter, dof, _ = declared([1.0] + [2.0] * 4 + [2.2] * 4, np.array([1.0] + [9.0] * 8))
    assert scatter[0] == 1.0
    assert dof == 64.0


@pytest.mark.parametrize("size", [1e-40, 1e20])
def test_extreme_deviations_give_finite_weights(size):
    scatter, *_ = declared([size] + [1.0] * 8, np.full(9, 2.0))
    assert np.all(np.isfinite(scatter) & (scatter > 0.0))


@pytest.mark.parametrize(("dof", "share"), [(1.0, 0.081), (2.0, 0.014), (5.0, 1e-3), (30.0, 1e-5)])
def test_the_logarithm_of_a_scatter_has_the_mean_and_the_variance_of_chi_squared(dof, share):
    assert _variance_of_log(np.array(dof)) == pytest.approx(polygamma(1, dof / 2.0), rel=share)
    bias = np.log(dof / 2.0) - digamma(dof / 2.0)
    assert _bias_of_log(np.array(dof)) == pytest.approx(bias, rel=share)
