"""Student and Fisher against scipy, and against 30-digit integrals where scipy loses digits."""

import math
from itertools import product

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from accelcal.errors import InputError
from accelcal.numerics.probability import (
    dof_of_student_quantile,
    f_exceeds,
    f_quantile,
    f_survival,
    student_quantile,
    student_survival,
)

DOF = (0.1, 0.5, 1.0, 2.0, 3.0, 7.5, 30.0, 100.0, 1e4, 1e6, 1e7, math.inf)


def close(value):
    return pytest.approx(value, rel=1e-10, abs=0.0)


def all_of(function, *columns):
    """What a function of numbers gives for each row of some columns."""
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return np.array([function(*row) for row in rows])


# -- Student ---------------------------------------------------------------------------------------


def test_survival_is_that_of_scipy():
    t, dof = np.array([*product([1e-3, 0.3, 1.0, 1.7, 1.8, 2.0, 5.0, 12.0, 30.0], DOF)]).T
    assert all_of(student_survival, t, dof) == close(stats.t.sf(t, dof))
    assert all_of(student_survival, -t, dof) == close(stats.t.cdf(t, dof))


@pytest.mark.parametrize("t", [1e-12, 1e-9, 1e-5, 1e3, 1e8, 1e100])
def test_survival_near_and_far(t):
    """One degree of freedom is Cauchy's distribution, two have a closed form."""
    with mpmath.workdps(250):
        x = mpmath.mpf(t)
        assert student_survival(t, 1) == close(float(mpmath.atan(1 / x) / mpmath.pi))
        assert student_survival(t, 2) == close(float((1 - x / mpmath.sqrt(2 + x * x)) / 2))


@pytest.mark.parametrize("dof", [1e7, 1e9, 1e12])
@pytest.mark.parametrize("t", [0.01, 1.0, 6.0])
def test_survival_of_many_degrees_of_freedom(t, dof):
    with mpmath.workdps(30):
        n = mpmath.mpf(dof)
        front = mpmath.exp(mpmath.loggamma((n + 1) / 2) - mpmath.loggamma(n / 2))
        front /= mpmath.sqrt(n * mpmath.pi)
        steps = [mpmath.mpf(t) + i for i in range(20)]
        tail = front * mpmath.quad(lambda u: (1 + u * u / n) ** (-(n + 1) / 2), steps)
        assert student_survival(t, dof) == close(float(tail))


def test_survival_at_the_ends():
    assert student_survival(0.0, 3.0) == 0.5
    assert student_survival(math.inf, 3.0) == 0.0
    assert student_survival(-math.inf, 3.0) == 1.0
    assert student_survival(1e200, 3.0) == 0.0


def test_quantile_is_that_of_scipy():
    level, dof = np.array([*product([0.1, 0.5, 0.683, 0.9, 0.95, 0.99, 0.9973, 1 - 1e-9], DOF)]).T
    assert all_of(student_quantile, level, dof) == close(stats.t.isf(0.5 * (1.0 - level), dof))


@given(st.floats(0.01, 0.9999), st.floats(0.3, 1e8))
def test_quantile_and_survival_are_inverse(level, dof):
    t = student_quantile(level, dof)
    assert 2.0 * student_survival(t, dof) == pytest.approx(1.0 - level, rel=1e-11)


@given(st.floats(0.2, 1e4), st.sampled_from([0.5, 0.95, 0.9973]))
def test_degrees_of_freedom_of_a_quantile(dof, level):
    assert dof_of_student_quantile(level, student_quantile(level, dof)) == pytest.approx(
        dof, rel=1e-9
    )


@pytest.mark.parametrize("factor", [1.0, 1.9599, student_quantile(0.95, math.inf)])
def test_a_normal_factor_has_infinite_degrees_of_freedom(factor):
    assert dof_of_student_quantile(0.95, factor) == math.inf


@pytest.mark.parametrize("level", [0.0, 1.0, 95.0, -0.1, math.nan])
def test_level_outside_its_range(level):
    with pytest.raises(InputError, match="between 0 and 1"):
        student_quantile(level, 5.0)


@pytest.mark.parametrize("dof", [0.0, -1.0, math.nan])
def test_no_degrees_of_freedom(dof):
    with pytest.raises(InputError, match="more than 0"):
        student_quantile(0.95, dof)


# -- Fisher ----------------------------------------------------------------------------------------


def test_f_survival_is_that_of_scipy():
    ratios, dofs = [1e-6, 0.01, 0.5, 0.999, 1.0, 1.7, 4.0, 1e3], [0.5, 1.0, 2.0]
    rows = np.array([*product(ratios, [*dofs, 6.0, 50.0, 1e4], [*dofs, 46.0, 1e3, 1e6])]).T
    expected = pytest.approx(stats.f.sf(*rows), rel=1e-10, abs=1e-300)
    assert all_of(f_survival, *rows) == expected


def test_f_survival_of_a_known_variance_is_chi_square():
    ratio, dof1 = np.array([*product([0.01, 0.9, 1.0, 2.0, 10.0], [1.0, 2.0, 6.0, 50.0])]).T
    found = all_of(f_survival, ratio, dof1, np.full_like(ratio, math.inf))
    assert found == close(stats.chi2.sf(dof1 * ratio, dof1))


@given(st.floats(0.05, 20), st.floats(0.5, 1e4), st.floats(0.5, 1e4))
def test_f_survival_of_the_inverse_ratio(ratio, dof1, dof2):
    both = f_survival(ratio, dof1, dof2) + f_survival(1.0 / ratio, dof2, dof1)
    assert both == pytest.approx(1.0, abs=1e-12)


@given(st.floats(0.0, 30.0), st.floats(0.5, 1e6))
def test_f_with_one_degree_is_student_squared(t, dof):
    two_sided = 2.0 * student_survival(t, dof)
    assert f_survival(t * t, 1.0, dof) == pytest.approx(two_sided, rel=1e-10, abs=1e-300)


def test_f_survival_at_the_ends():
    assert [f_survival(ratio, 2, 5) for ratio in (-1.0, 0.0, math.inf)] == [1.0, 1.0, 0.0]
    assert np.all(np.diff([f_survival(r, 3, 7) for r in np.linspace(0, 9, 50)]) < 0)


@pytest.mark.parametrize("size", [3, 300])
@pytest.mark.parametrize("dof1", [0.5, 1.0, 6.0, 50.0])
def test_f_survival_of_arrays_is_that_of_numbers(dof1, size):
    rng = np.random.default_rng(7)
    ratio = 10.0 ** rng.uniform(-8.0, 8.0, size)
    dof2 = rng.choice([0.5, 1.0, 7.5, 33.0, 1e4, 1e7, math.inf], size)
    found = f_survival(ratio, dof1, dof2)
    each = [f_survival(r, dof1, d) for r, d in zip(ratio.tolist(), dof2.tolist(), strict=True)]
    assert found.tolist() == pytest.approx(each, rel=1e-11, abs=1e-300)


@pytest.mark.parametrize("size", [1, 100])
def test_f_survival_of_arrays_at_the_ends(size):
    ratio = np.repeat([-1.0, 0.0, math.inf, math.nan, 4.0], size)
    found = f_survival(ratio, 2, 46).reshape(5, size)[:, 0]
    assert found[:4].tolist() == pytest.approx([1.0, 1.0, 0.0, math.nan], nan_ok=True)
    assert found[4] == close(f_survival(4.0, 2, 46))


def test_f_quantile_is_that_of_scipy():
    levels, dofs = [0.5, 0.01, 0.01 / 3.0, 1e-8], [1.0, 3.0, 9.0, 40.0]
    rows = np.array([*product(levels, dofs, [1.0, 3.0, 32.0, 1e6])]).T
    assert all_of(f_quantile, *rows) == pytest.approx(stats.f.isf(*rows), rel=1e-7)  # loses digits
    level, dof1 = np.array([*product(levels, dofs)]).T
    infinite = np.full_like(level, math.inf)
    expected = pytest.approx(stats.chi2.isf(level, dof1) / dof1, rel=1e-7)
    assert all_of(f_quantile, level, dof1, infinite) == expected
    rows = np.hstack([rows, [level, dof1, infinite]])
    assert all_of(f_survival, all_of(f_quantile, *rows), *rows[1:]) == close(rows[0])


@pytest.mark.parametrize("apart", [1e-9, 1e-3, 0.5])
@pytest.mark.parametrize("shape", ["one test", "tests of rows", "a test of each"])
def test_exceeding_is_as_by_each_probability(shape, apart):
    """Thousands of ratios around the limits."""
    rng = np.random.default_rng(7)
    rows, count = 3, 2000
    size = {"one test": (1, 1), "tests of rows": (rows, 1), "a test of each": (rows, count)}[shape]
    level, dof1 = rng.choice([0.01, 0.003], size), rng.integers(1, 9, size).astype(float)
    dof2 = 30.0 + rng.integers(0, 3, size)
    limits = np.vectorize(f_quantile)(level, dof1, dof2)
    ratio = limits * rng.uniform(1.0 - apart, 1.0 + apart, (rows, count))
    found = f_exceeds(level, ratio, dof1, dof2)
    assert (found == (f_survival(ratio, dof1, dof2) < level)).all()
    assert 0.3 < found.mean() < 0.7


def test_exceeding_of_no_number_and_of_infinity():
    ratio = np.array([math.nan, math.inf, *[0.0] * 30])
    for some in (ratio, ratio[:3]):
        assert f_exceeds(0.01, some, 2.0, 5.0).tolist()[:3] == [False, True, False]


@pytest.mark.parametrize("dof", [1e14, 1e16, 1e17, 1e18, 1e300])
def test_students_tail_of_endless_freedom_is_the_normal_one(dof):
    """That of 0.001 was 0.07: beside dof as large 1 is lost."""
    for t in (0.0, 1e-9, 1e-3, 0.5, 2.5, 6.0):
        assert student_survival(t, dof) == pytest.approx(student_survival(t, math.inf), rel=1e-9)
