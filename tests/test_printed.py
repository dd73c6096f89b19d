"""The closed forms as linear maps, in numbers; what they return in symbols is in test_errata."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal

from accelcal.errors import InputError
from accelcal.geometry import accelerations
from accelcal.head_angles import turn_angles
from accelcal.model import COEFFICIENTS, POWERS, design_matrix
from accelcal.printed import (
    CLOSED_FORMS,
    ERRATA,
    corrected_estimates,
    documented_bias,
    estimator_matrix,
    printed_estimates,
    printed_outputs,
    sign_corrected_estimates,
)

ROOT2 = 2**0.5
MEANS = arrays(np.float64, 9, elements=st.floats(-10, 10))
# theory: what each form returns at d0 = 0 in units of g, as rows over K0 K1 K2 K3 M M_ip
STATED_BIAS = {
    "printed": [
        [1, 0, 0, 0, 0, 0],
        [0, 0, 0, 0.25, 0, 0],
        [0, 0, 1, 0, 0, 0],
        [2 * ROOT2, 0, ROOT2, -0.5, 0, ROOT2],
        [0, 0, 0, 0, -1, 0],
        [0, 0, 0, 0, 0, 1],
    ],
    "sign-corrected": [
        [1, 0, 0, 0, 0, 0],
        [0, 1, 0, 0.75, 0, 0],
        [0, 0, 1, 0, 0, 0],
        [np.nan] * 6,
        [0, 0, 0, 0, 1, 0],
        [0, 0, 0, 0, 0, 1],
    ],
    "closed-form": np.eye(6).tolist(),
}


def estimates(form: str, means: np.ndarray, delta0: float) -> dict[str, np.ndarray]:
    fixed = {"delta0": delta0} if form == "printed" else {}
    return CLOSED_FORMS[form](means, **fixed)


@pytest.mark.parametrize("form", CLOSED_FORMS)
def test_documented_bias_is_the_stated_one(form: str) -> None:
    assert_allclose(documented_bias(form), STATED_BIAS[form], rtol=0, atol=4e-15)


@pytest.mark.parametrize("form", CLOSED_FORMS)
@pytest.mark.parametrize("delta0", [0.0, -0.02])
@given(means=MEANS)
def test_the_matrix_is_the_closed_form(form: str, delta0: float, means: np.ndarray) -> None:
    found = estimates(form, means, delta0)
    expected = [found.get(name, np.nan) for name in COEFFICIENTS]
    assert_allclose(estimator_matrix(form, delta0) @ means, expected, rtol=1e-12, atol=1e-12)


def test_only_k3_of_the_sign_corrected_form_is_missing() -> None:
    missing = {
        (form, name)
        for form in CLOSED_FORMS
        for name, row in zip(COEFFICIENTS, estimator_matrix(form), strict=True)
        if np.isnan(row).any()
    }
    assert missing == {("sign-corrected", "K3")}
    assert np.isnan(estimator_matrix("sign-corrected")[3]).all()


def test_delta0_moves_only_the_printed_m_ip() -> None:
    change = estimator_matrix("printed", 0.01) - estimator_matrix("printed")
    assert_array_equal(np.flatnonzero(change.any(axis=1)), [COEFFICIENTS.index("M_ip")])
    assert_allclose(change[5], 2 * 0.01 * estimator_matrix("printed")[2], atol=1e-17)
    for form in ("sign-corrected", "closed-form"):
        assert_array_equal(estimator_matrix(form, 0.01), estimator_matrix(form))


@pytest.mark.parametrize("form", CLOSED_FORMS)
def test_stacked_tables_give_stacked_estimates(form: str) -> None:
    tables = np.random.default_rng(1).normal(size=(2, 3, 9))
    found = CLOSED_FORMS[form](tables)
    assert list(found) == [name for name in COEFFICIENTS if name in found]
    for name, values in found.items():
        assert values.shape == (2, 3)
        assert values[1, 2] == CLOSED_FORMS[form](tables[1, 2])[name]


@pytest.mark.parametrize("form", CLOSED_FORMS)
def test_a_missing_position_spoils_only_what_needs_it(form: str) -> None:
    means = printed_outputs({"K0": 0.1, "K1": 1.3})
    means[2] = np.nan
    found = CLOSED_FORMS[form](means)
    spoilt = {name for name, value in found.items() if np.isnan(value)}
    also = {"M_ip"} if form == "printed" else set()  # through 2 K2 g d0
    assert spoilt == {"K0", "K2", "M"} | also


@given(k=arrays(np.float64, 6, elements=st.floats(-2, 2)), g=st.floats(0.5, 20))
def test_corrected_estimates_return_the_truth_in_any_unit_of_acceleration(
    k: np.ndarray, g: float
) -> None:
    means = design_matrix(accelerations(turn_angles())) @ k
    found = corrected_estimates(means, g)
    in_g = [found[name] * g ** POWERS[name] for name in COEFFICIENTS]
    assert_allclose(in_g, k, rtol=0, atol=1e-13)


def test_without_a_fixture_angle_the_printed_outputs_are_exact_in_units_of_g() -> None:
    k = dict(zip(COEFFICIENTS, (0.3, 1.2, -0.4, 0.7, 0.05, 0.9), strict=True))
    expected = design_matrix(accelerations(turn_angles())) @ list(k.values())
    assert_allclose(printed_outputs(k), expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", COEFFICIENTS)
def test_printed_minus_exact_shrinks_as_the_order_of_its_first_misprint(name: str) -> None:
    first_wrong_order = {"K0": None, "K1": 2, "K2": 3, "K3": 2, "M": 1, "M_ip": 1}[name]

    def largest(delta0: float) -> float:
        exact = design_matrix(accelerations(turn_angles(), delta0))[:, COEFFICIENTS.index(name)]
        return float(np.abs(printed_outputs({name: 1.0}, delta0) - exact).max())

    if first_wrong_order is None:
        assert largest(0.1) == 0.0
    else:
        order = np.log2(largest(0.02) / largest(0.01))
        assert order == pytest.approx(first_wrong_order, abs=0.05)


def test_printed_outputs_broadcast_over_coefficients_and_angles() -> None:
    k1 = np.array([[1.2], [1.5]])
    delta0 = np.array([0.0, 1e-3, 2e-3])
    grid = printed_outputs({"K1": k1, "M": 0.001}, delta0)
    assert grid.shape == (2, 3, 9)
    assert_array_equal(grid[1, 2], printed_outputs({"K1": 1.5, "M": 0.001}, 2e-3))


def test_one_stroke_noise_is_that_of_the_theory() -> None:
    noise = np.linalg.norm(estimator_matrix("closed-form"), axis=1)
    # K0 and M from two readings, K1 and K3 as least squares has them
    assert_allclose(noise[[0, 1, 3, 4]], [0.5**0.5, 1.54, 1.87, 0.5**0.5], atol=5e-3)


@pytest.mark.parametrize(
    "estimate", [printed_estimates, sign_corrected_estimates, corrected_estimates]
)
@pytest.mark.parametrize("shape", [(8,), (9, 2), ()])
def test_means_that_are_not_nine_are_refused(estimate: object, shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match=r"shape \(.*\); the last axis holds Y1 to Y9"):
        estimate(np.zeros(shape))


def test_unknown_names_are_refused() -> None:
    with pytest.raises(InputError, match=r"'K4' is not a coefficient of \(5\): K0, K1"):
        printed_outputs({"K4": 1.0})
    for function in (estimator_matrix, documented_bias):
        with pytest.raises(InputError, match="'closed' is unknown; it is printed or sign-corr"):
            function("closed")


def test_errata_are_frozen_and_complete() -> None:
    with pytest.raises(AttributeError):
        ERRATA[0].printed = "right"
    for erratum in ERRATA:
        texts = (erratum.printed, erratum.exact, erratum.consequence, erratum.remedy)
        assert all(texts)
        assert all(text.count("$") % 2 == 0 and "|" not in text for text in texts)
