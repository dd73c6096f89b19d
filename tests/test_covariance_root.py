"""Root of a covariance: against matrices of which the root, or the spectrum, is known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from accelcal.numerics.covariance import covariance_root


@pytest.mark.parametrize("rank", [1, 3, 5])
def test_the_square_of_the_root_is_the_covariance(rank):
    known = np.random.default_rng(rank).normal(size=(5, rank))
    root = covariance_root(known @ known.T)
    assert_allclose(root @ root.T, known @ known.T, atol=1e-14 * np.trace(known @ known.T))


def test_what_is_small_in_its_unit_keeps_its_digits():
    """Beside a quantity of size 1 the covariance of one of 1e-12 is below all rounding errors."""
    sizes = np.array([1.0, 1e-12, 1e-6])
    correlation = np.array([[1.0, 0.9, -0.2], [0.9, 1.0, 0.1], [-0.2, 0.1, 1.0]])
    covariance = correlation * np.outer(sizes, sizes)
    root = covariance_root(covariance, sizes)
    assert_allclose(root @ root.T, covariance, rtol=1e-12)


def test_what_is_below_zero_counts_as_nothing():
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    root = covariance_root(turn @ np.diag([2.0, 1.0, -0.5]) @ turn.T)
    assert_allclose(root @ root.T, turn @ np.diag([2.0, 1.0, 0.0]) @ turn.T, atol=1e-14)
