"""What stays in one thread: products of matrices, by their size or while a search goes on."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import accelcal
from accelcal.discovery import discover
from accelcal.discovery.new_record import judgement
from accelcal.discovery.stand import discover as discover_of_a_stand
from accelcal.numerics import one_thread
from accelcal.numerics.one_thread import in_one_thread, multiply


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


def blas_threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_searches_and_a_comparison_work_in_one_thread(monkeypatch):
    seen = []

    def watched(function):
        return lambda *given: (seen.append(blas_threads()), function(*given))[1]

    monkeypatch.setattr(discover, "look_through", watched(discover.look_through))
    monkeypatch.setattr(judgement, "_judged", watched(judgement._judged))
    monkeypatch.setattr(discover_of_a_stand, "_units", watched(discover_of_a_stand._units))
    record, other = (accelcal.simulate(seed=seed) for seed in (1, 2))
    with threadpool_limits(limits=2, user_api="blas"):
        before = blas_threads()
        accelcal.discover(record)
        accelcal.compare(accelcal.fit(record), record)
        assert len(seen) >= 2
        accelcal.discover_stand([record, other])
        assert blas_threads() == before
    assert len(seen) >= 4
    assert all(threads == {1} for threads in seen)


def test_searches_that_overlap_keep_one_thread_until_the_last_ends():
    first, second = in_one_thread(), in_one_thread()
    with threadpool_limits(limits=2, user_api="blas"):
        before = blas_threads()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert blas_threads() == {1}
        second.__exit__(None, None, None)
        assert blas_threads() == before
