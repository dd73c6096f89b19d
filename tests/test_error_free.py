"""Sums and products with their errors are exact."""

from fractions import Fraction

import numpy as np
import pytest

from accelcal.estimate.replicates import two_product, two_sum


@pytest.mark.parametrize(
    ("function", "exact"),
    [(two_sum, lambda a, b: a + b), (two_product, lambda a, b: a * b)],
    ids=["sum", "product"],
)
def test_nothing_is_lost(function, exact):
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((2, 2000)) * 10.0 ** rng.integers(-20, 20, (2, 2000))
    rounded, error = function(a, b)
    columns = (map(Fraction, values.tolist()) for values in (a, b, rounded, error))
    for one, other, near, missing in zip(*columns, strict=True):
        assert near + missing == exact(one, other)
    assert np.count_nonzero(error) > 1000
