"""Products of matrices so small at a time that OpenBLAS leaves them to one thread."""

import numpy as np
import pytest

from accelcal.numerics import one_thread
from accelcal.numerics.one_thread import multiply


@pytest.mark.parametrize("stack", [(), (3,)])
@pytest.mark.parametrize("columns", [0, 1, 4, 5, 23])
def test_a_product_of_many_columns_is_made_in_parts(monkeypatch, stack, columns):
    monkeypatch.setattr(one_thread, "_ALONE", 24)
    rng = np.random.default_rng(0)
    matrix, values = rng.normal(size=(2, 3)), rng.normal(size=(*stack, 3, columns))
    found, given = multiply(matrix, values), np.empty((*stack, 2, columns))
    assert found == pytest.approx(matrix @ values, rel=1e-12)
    assert multiply(matrix, values, out=given) is given
    assert np.array_equal(given, found)


def test_a_matrix_larger_than_one_thread_takes_goes_column_by_column(monkeypatch):
    monkeypatch.setattr(one_thread, "_ALONE", 1)
    assert multiply(np.eye(3), np.eye(3)).tolist() == np.eye(3).tolist()
