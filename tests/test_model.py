"""Equations (1) to (4) against exact fractions, sympy and their own definitions."""

from __future__ import annotations

import re
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from accelcal.errors import InputError
from accelcal.geometry import MOUNTINGS, Acceleration, accelerations
from accelcal.head_angles import turn_angles
from accelcal.model import (
    COEFFICIENTS,
    POWERS,
    SEEN_IN_MOUNTING,
    acceleration_error,
    bias_bound,
    design_matrix,
    output,
)
from accelcal.results.quantity import Quantity

TERMS = ("K0", "K1", "K2", "K3", "M_O", "M_P", "M_ip", "M_io")
ERRORS = ("k0", "k1", "k2", "k3", "delta_O", "delta_P", "delta_ip", "delta_io")
VALUES = st.lists(st.floats(-2, 2), min_size=8, max_size=8)
NONZERO = st.floats(0.1, 10)


def at(a_i: float, a_p: float = 0.0, a_o: float = 0.0) -> Acceleration:
    return Acceleration(np.array([a_i]), np.array([a_p]), np.array([a_o]))


def exact_terms(a_i: Fraction, a_p: Fraction, a_o: Fraction) -> dict[str, Fraction]:
    """Give what each coefficient of (1) multiplies, with M_io in its place beside M_ip."""
    powers = (a_i**0, a_i, a_i**2, a_i**3)
    return dict(zip(TERMS, (*powers, a_p, a_o, a_i * a_p, a_i * a_o), strict=True))


# The output, which is equation one


@given(VALUES, st.tuples(*[st.floats(-1, 1)] * 3))
def test_output_against_exact_fractions(values: list[float], axes: tuple[float, ...]) -> None:
    terms = exact_terms(*map(Fraction, axes))
    exact = sum(Fraction(k) * term for k, term in zip(values, terms.values(), strict=True))
    found = output(dict(zip(TERMS, values, strict=True)), at(*axes))
    assert found[0] == pytest.approx(float(exact), rel=0, abs=2e-14)


@pytest.mark.parametrize("name", TERMS)
def test_each_coefficient_multiplies_its_own_term(name: str) -> None:
    axes = (Fraction(3, 4), Fraction(1, 2), Fraction(-1, 8))  # all powers are exact in binary
    assert output({name: 1.0}, at(*map(float, axes)))[0] == float(exact_terms(*axes)[name])


@given(VALUES, VALUES, st.floats(-3, 3))
def test_output_is_linear_in_the_coefficients(a: list[float], b: list[float], c: float) -> None:
    where = accelerations(np.arange(0.0, 360.0, 30.0), 0.01, "p-")
    mixed = {name: x + c * y for name, x, y in zip(TERMS, a, b, strict=True)}
    apart = output(dict(zip(TERMS, a, strict=True)), where) + c * output(
        dict(zip(TERMS, b, strict=True)), where
    )
    assert_allclose(output(mixed, where), apart, rtol=0, atol=1e-13)


def test_output_broadcasts_the_axes() -> None:
    where = Acceleration(np.zeros((3, 1)), np.ones(4), np.array(0.5))
    found = output({"K0": 1.0, "M_O": 2.0, "M_P": 4.0}, where)
    assert_array_equal(found, np.full((3, 4), 5.0))


def test_shapes_that_do_not_broadcast_are_refused() -> None:
    turn = accelerations([0, 90, 180])
    for values in ({"K1": [1.3, 1.4]}, {"K0": [0.1, 0.2], "K1": [1.0, 1.1, 1.2]}):
        with pytest.raises(InputError, match=r"shapes \(3,\), \(2,\)"):
            output(values, turn)


def test_without_coefficients_the_output_is_zero_everywhere() -> None:
    assert_array_equal(output({}, accelerations(turn_angles())), np.zeros(9))


@pytest.mark.parametrize("name", ["M", "K4", "k0", ""])
def test_a_coefficient_that_is_not_in_1_is_refused(name: str) -> None:
    with pytest.raises(InputError) as caught:
        output({"K0": 1.0, name: 1.0}, at(1.0))
    assert str(caught.value) == (
        f"coefficient {name!r} is not in (1); it has K0, K1, K2, K3, M_O, M_P, M_ip, M_io"
        " (M and M_ip of a calibration are M_O and M_ip of a mounting o, M_P and M_io of a"
        " mounting p)"
    )


def test_quantities_of_a_calibration_are_no_numbers() -> None:
    with pytest.raises(InputError, match="K1 is Quantity; it is a number or an array"):
        output({"K1": Quantity(1.35, 1e-5, "mA/g")}, at(1.0))  # type: ignore[dict-item]


# Design matrix


def symbolic_design(angles: list[int], side: int, delta0: sp.Expr) -> np.ndarray:
    """Take the derivatives of (1) by its coefficients, with sympy's sine and cosine."""
    symbols = K0, K1, K2, K3, M, M_ip = sp.symbols("K0 K1 K2 K3 M M_ip")
    rows = []
    for angle in angles:
        a_i = sp.cos(sp.pi * angle / 180 + delta0)
        a_p = side * sp.sin(sp.pi * angle / 180 + delta0)
        y = K0 + K1 * a_i + K2 * a_i**2 + K3 * a_i**3 + M * a_p + M_ip * a_i * a_p
        rows.append([float(sp.diff(y, k).evalf(30)) for k in symbols])
    return np.array(rows)


@pytest.mark.parametrize("mounting", MOUNTINGS)
@pytest.mark.parametrize("delta0", [sp.Integer(0), sp.Rational(1, 100)])
def test_design_against_sympy(mounting: str, delta0: sp.Expr) -> None:
    angles = [*range(0, 361, 45), 7, 100, -30]
    exact = symbolic_design(angles, 1 if mounting.endswith("+") else -1, delta0)
    found = design_matrix(accelerations(angles, float(delta0), mounting), mounting)
    assert found.shape == (len(angles), len(COEFFICIENTS))
    assert_allclose(found, exact, rtol=0, atol=5e-16)


@pytest.mark.parametrize("axis", SEEN_IN_MOUNTING)
def test_the_reversed_mounting_turns_m_and_m_ip_only(axis: str) -> None:
    angles = np.arange(0.0, 360.0, 15.0)
    plus, minus = (
        design_matrix(accelerations(angles, 0.02, mounting), mounting)
        for mounting in (axis + "+", axis + "-")
    )
    assert_array_equal(minus, plus * [1, 1, 1, 1, -1, -1])


def test_both_axes_give_the_same_matrix() -> None:
    angles = turn_angles(24)
    by_axis = [design_matrix(accelerations(angles, 0.01, m), m) for m in ("o+", "p+")]
    assert_array_equal(*by_axis)


@pytest.mark.parametrize(("positions", "rank"), [(4, 4), (6, 6), (8, 6), (12, 6)])
def test_rank_of_the_usual_tests(positions: int, rank: int) -> None:
    matrix = design_matrix(accelerations(turn_angles(positions)))
    assert np.linalg.matrix_rank(matrix) == rank


def test_reversal_separates_the_fixture_angle_from_the_misalignment() -> None:
    """To first order Y3 - Y7 is 2 (M - K1 d0) in one mounting and 2 (-M - K1 d0) in the other."""
    k = {"K1": 1.3, "M_O": 2e-3}
    delta0 = 1e-3
    plus, minus = (
        output(k, accelerations([90.0, 270.0], delta0, mounting)) for mounting in ("o+", "o-")
    )
    half = np.array([(plus[0] - plus[1]) / 2, (minus[0] - minus[1]) / 2])
    assert (half[0] - half[1]) / 2 == pytest.approx(k["M_O"], rel=1e-6)
    assert -(half[0] + half[1]) / 2 == pytest.approx(k["K1"] * delta0, rel=1e-6)


def test_a_seen_coefficient_is_a_term_of_1() -> None:
    where = at(0.75, 0.5, -0.125)
    for axis, names in SEEN_IN_MOUNTING.items():
        expected = [output({name: 1.0}, where)[0] for name in names]
        assert design_matrix(where, axis + "+")[0].tolist() == expected


@pytest.mark.parametrize("mounting", ["x", "", "+o", "o"])
def test_a_design_for_an_unknown_mounting_is_refused(mounting: str) -> None:
    with pytest.raises(InputError, match=rf"^mounting '{re.escape(mounting)}' is unknown; .* p-$"):
        design_matrix(at(1.0), mounting)


def test_powers_tell_how_a_term_grows_with_gravity() -> None:
    once = design_matrix(at(0.6, 0.8))
    double = design_matrix(at(1.2, 1.6))
    assert_allclose(double / once, [[2.0 ** POWERS[name] for name in COEFFICIENTS]], rtol=1e-15)


# Error model, equation (2)


@given(VALUES, NONZERO, NONZERO, st.tuples(*[st.floats(-1, 1)] * 3))
def test_2_is_the_output_less_the_ideal_one_over_k1(
    values: list[float], k1: float, nominal: float, axes: tuple[float, ...]
) -> None:
    k = dict(zip(TERMS, values, strict=True)) | {"K1": k1}
    where = at(*axes)
    by_definition = (output(k, where) - nominal * where.input) / k1
    errors = {error: k[name] / k1 for name, error in zip(TERMS, ERRORS, strict=True)}
    errors["k1"] = (k1 - nominal) / k1
    assert_allclose(acceleration_error(errors, where), by_definition, rtol=1e-12, atol=1e-12)


def test_an_unknown_error_coefficient_is_refused() -> None:
    with pytest.raises(InputError, match="'k4' is not in"):
        acceleration_error({"k4": 1.0}, at(1.0))


# Random bias, equation (3)


@given(*[st.floats(0, 1e-3, allow_subnormal=False)] * 3, st.floats(-100, 100))
def test_bias_bound_against_mpmath(
    launch: float, rate: float, fluctuation: float, time: float
) -> None:
    with mpmath.workdps(40):
        parts = (launch, mpmath.mpf(rate) * time, fluctuation)
        exact = float(mpmath.sqrt(sum(mpmath.mpf(part) ** 2 for part in parts)) / 2)
    assert bias_bound(time, launch, rate, fluctuation) == pytest.approx(
        exact, rel=1e-14, abs=1e-150
    )


def test_bias_bound_of_a_pythagorean_box() -> None:
    assert bias_bound(4.0, 3.0, 1.0, 12.0) == 6.5
    assert_array_equal(bias_bound([0.0, -4.0], 0.0, 2.0, 0.0), [0.0, 4.0])


def test_bias_bound_of_the_paper() -> None:
    """Three components of 2e-5 g each: AL-15, figure 4."""
    assert bias_bound(12.0, 2e-5, 2e-5 / 12.0, 2e-5) == pytest.approx(3**0.5 * 1e-5, rel=1e-15)
