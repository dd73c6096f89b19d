"""One contract for all estimators: estimate(forward(k)) is k, whatever the test looked like.

The data come from equation (1) as written out in `tumble_oracle`, not from accelcal.
"""

import re
from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from one_record import estimate_of_record
from tumble_oracle import AL15, NAMES, UNITY, Apparatus, forward, rates, record, rows, turn

from accelcal.errors import DesignError, InputError
from accelcal.estimate.estimability import estimability
from accelcal.estimate.tables import METHODS, linear_estimator, prepare
from accelcal.geometry import MOUNTINGS
from accelcal.head_angles import head_positions
from accelcal.printed import CLOSED_FORMS, documented_bias

DECLARED = {
    "nothing declared": Apparatus(),
    "head declared": Apparatus(head_uncertainty=1e-5),
    "all declared": Apparatus(
        head_uncertainty=2e-5, launch_uncertainty=2e-5, launch_sf_uncertainty=1e-5, resolution=1e-6
    ),
}


def without(angles, *indices):
    return np.delete(angles, indices)


EIGHT = {
    "one stroke": turn(8),
    "six strokes": turn(8, 6),
    "return not read": without(turn(8), 8),
    "start not read": without(turn(8), 0),
    "readings missing": without(turn(8, 3), 0, 4, 5, 11, 13, 20, 26),
    "one reading a position": without(turn(8, 2), *range(1, 17, 2), 9),
}
"""Designs that the closed forms can take too."""

DESIGNS = EIGHT | {
    "6 positions": turn(6, 2),
    "12 positions": turn(12, 6),
    "24 positions": turn(24, 2),
    "36 positions": turn(36),
    "no order, no step": [3.0, 311.7, -50.0, 98.6, 205.0, 77.0, 160.0, 402.0],
    "repeated angles": np.repeat([5.0, 61.0, 120.0, 190.0, 233.0, 301.0], [1, 4, 2, 1, 3, 2]),
}


def estimate(angles, output, *, method="least-squares", apparatus=None, delta0=0.0, **more):
    prepared = prepare(record(angles, output, **more), delta0=delta0)
    return estimate_of_record([prepared], apparatus or Apparatus(), method=method, delta0=delta0)


def assert_exact(found, k):
    """To 1e-12 of the largest coefficient: the readings are rounded to that size."""
    assert_allclose(found, k, rtol=1e-12, atol=1e-13 * np.abs(k).max())


# -- the contract ----------------------------------------------------------------------------------


@pytest.mark.parametrize("angles", DESIGNS.values(), ids=DESIGNS)
def test_least_squares_returns_the_truth(angles):
    for k, mounting, apparatus in product((AL15, UNITY), MOUNTINGS, DECLARED.values()):
        y = forward(k, angles, 0.0, mounting)
        found = estimate(angles, y, mounting=mounting, apparatus=apparatus)
        assert found.names == (NAMES,)
        assert_exact(found.coefficients[0], k)
        assert np.abs(found.residuals[0]).max() < 1e-14


@pytest.mark.parametrize("angles", EIGHT.values(), ids=EIGHT)
def test_closed_forms_return_the_truth_to_their_documented_bias(angles):
    for k, mounting, method in product((AL15, UNITY), MOUNTINGS, CLOSED_FORMS):
        y = forward(k, angles, 0.0, mounting)
        found = estimate(angles, y, method=method, mounting=mounting)
        expected = documented_bias(method) @ seen_from_plus(k, mounting)
        given = np.isfinite(expected)
        assert found.names == (tuple(np.array(NAMES)[given]),)
        assert_exact(
            seen_from_plus(found.coefficients[0], mounting)[given], np.nan_to_num(expected)[given]
        )
        assert_array_equal(found.coefficients[0][~given], 0.0)


def seen_from_plus(k, mounting):
    """Coefficients as the side + of the mounting shows them."""
    sign = -1.0 if mounting.endswith("-") else 1.0
    return np.asarray(k) * [1, 1, 1, 1, sign, sign]


@pytest.mark.parametrize("k", [AL15, UNITY], ids=["AL-15", "unity"])
def test_the_corrected_closed_form_is_exact(k):
    assert_exact(
        estimate(turn(8, 6), forward(k, turn(8, 6)), method="closed-form").coefficients[0], k
    )


@given(
    angles=st.lists(st.floats(-720, 720), min_size=6, max_size=40),
    delta0=st.floats(-0.5, 0.5),
    mounting=st.sampled_from(MOUNTINGS),
    head=st.sampled_from([None, 0.0, 1e-5, 1e-2]),
)
@settings(max_examples=80, deadline=None)
def test_arbitrary_angles(angles, delta0, mounting, head):
    """Coefficients that the angles do not determine are zero in the truth as in the fit."""
    design = rows(angles, delta0, mounting)
    assume(np.ptp(design[:, 1]) > 0.3)
    kept = estimability(design).columns
    truth = np.zeros(6)
    truth[kept] = np.array(UNITY)[kept]
    y = forward(truth, angles, delta0, mounting)
    assume(np.ptp(y) > 0.0)
    apparatus = Apparatus(head_uncertainty=head)
    found = estimate(angles, y, delta0=delta0, mounting=mounting, apparatus=apparatus)
    condition = np.linalg.cond(design[:, kept])
    assert_allclose(found.coefficients[0], truth, rtol=1e-12, atol=1e-14 * condition)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scale", [1e-9, 1e-6, 1e6, 1e12], ids="{:g}".format)
def test_outputs_of_any_size(scale, method):
    """Counts in millions or a few microamperes: the same digits."""
    angles = turn(8, 6)
    rng = np.random.default_rng(7)
    y = forward(AL15, angles) + 5e-6 * rng.standard_normal(angles.size)
    apparatus = DECLARED["head declared"]
    small = estimate(angles, y, method=method, apparatus=apparatus)
    large = estimate(angles, scale * y, method=method, apparatus=apparatus)
    assert_exact(large.coefficients[0] / scale, small.coefficients[0])
    for name, component in small.components.items():
        scaled = large.components[name].covariance / scale**2
        assert_allclose(scaled, component.covariance, rtol=1e-6, atol=1e-24)
        assert_allclose(large.components[name].dof, component.dof)


@pytest.mark.parametrize("method", METHODS)
def test_robust_leaves_clean_data_alone(method):
    angles = turn(8, 6)
    y = forward(AL15, angles)
    prepared = prepare(record(angles, y))
    plain = estimate_of_record([prepared], Apparatus(), method=method)
    robust = estimate_of_record([prepared], Apparatus(), method=method, robust=True)
    assert_exact(robust.coefficients[0], plain.coefficients[0])


def test_the_order_of_the_readings_does_not_matter():
    angles = turn(12, 3)
    rng = np.random.default_rng(8)
    y = forward(AL15, angles) + 5e-6 * rng.standard_normal(angles.size)
    shuffled = rng.permutation(angles.size)
    plain, other = (estimate(angles[i], y[i]) for i in (np.arange(angles.size), shuffled))
    assert_exact(other.coefficients[0], plain.coefficients[0])
    assert other.head.uncertainty == pytest.approx(plain.head.uncertainty, rel=1e-9)


def test_several_runs_and_mountings_keep_their_own_coefficients():
    angles = turn(8, 2)
    truths = [np.array(AL15) * (1 + 0.1 * i) for i in range(4)]
    where = [(0, "o+"), (0, "o-"), (1, "o+"), (2, "p-")]
    parts = [forward(k, angles, 0.0, m) for k, (_, m) in zip(truths, where, strict=True)]
    whole = record(
        np.tile(angles, 4),
        np.concatenate(parts),
        run=np.repeat([run for run, _ in where], angles.size),
        mounting=np.repeat([mounting for _, mounting in where], angles.size),
    )
    found = estimate_of_record([prepare(t) for t in whole.tables()], DECLARED["all declared"])
    for k, truth in zip(found.coefficients, truths, strict=True):
        assert_exact(k, truth)
    assert [found.part(i) for i in range(4)] == [slice(6 * i, 6 * i + 6) for i in range(4)]


# -- delta0 ----------------------------------------------------------------------------------------


def test_delta0_left_out_turns_into_misalignment():
    """First order: M becomes M - K1 delta0 with side +, M + K1 delta0 with side -."""
    delta0 = 1e-6
    for mounting, sign in (("o+", -1.0), ("o-", 1.0)):
        y = forward(AL15, turn(8, 2), delta0, mounting)
        found = estimate(turn(8, 2), y, mounting=mounting).coefficients[0]
        assert found[4] == pytest.approx(AL15[4] + sign * AL15[1] * delta0, abs=1e-9)


def test_the_printed_form_takes_delta0_into_m_ip():
    angles, delta0 = turn(8), 1e-3
    y = forward(UNITY, angles)
    found = estimate(angles, y, method="printed", delta0=delta0).coefficients[0]
    assert found[5] == pytest.approx(UNITY[5] + 2 * UNITY[2] * delta0, rel=1e-12)


@pytest.mark.parametrize("method", ["closed-form", "sign-corrected"])
def test_closed_forms_refuse_delta0(method):
    with pytest.raises(DesignError, match=r"delta0 is 0\.001 rad .* use least-squares"):
        estimate(turn(8), forward(AL15, turn(8)), method=method, delta0=1e-3)


# -- fewer coefficients ----------------------------------------------------------------------------


def test_four_positions_fit_what_they_can():
    angles = turn(4, 6)
    found = estimate(angles, forward(AL15, angles))
    assert found.names == (("K0", "K1", "K2", "M"),)
    assert found.stands_for[0] == {"K1": "K1 + K3"}
    K0, K1, K2, K3, M, _ = AL15
    assert_exact(found.coefficients[0], [K0, K1 + K3, K2, 0.0, M, 0.0])
    with pytest.raises(DesignError, match="K3 cannot be told apart from K1"):
        prepare(record(angles, forward(AL15, angles)), strict=True)


def test_only_the_coefficients_asked_for():
    k = (0.1, 1.3, 0.0, 0.0, 0.02, 0.0)
    prepared = prepare(record(turn(8), forward(k, turn(8))), asked=("K0", "K1", "M"))
    found = estimate_of_record([prepared], Apparatus())
    assert found.names == (("K0", "K1", "M"),)
    assert_exact(found.coefficients[0], k)


def test_without_k0_there_is_no_bias_shift():
    k = (0.0, 1.3, 0.0, 0.0, 0.02, 0.0)
    angles = np.tile(turn(8, 2), 2)
    whole = record(angles, forward(k, angles), run=np.repeat([0, 1], 18))
    prepared = [prepare(t, asked=("K1", "M")) for t in whole.tables()]
    found = estimate_of_record(prepared, Apparatus())
    assert found.bias_shift.source == "none"
    assert found.scale_factor_shift.source == "estimated"
    assert_exact(found.coefficients[1], k)


@pytest.mark.parametrize("method", CLOSED_FORMS)
def test_a_closed_form_has_no_choice_of_coefficients(method):
    prepared = prepare(record(turn(8), forward(AL15, turn(8))), asked=("K0", "K1"))
    with pytest.raises(
        InputError,
        match=f"K2, K3, M, M_ip cannot be told or was not asked for, but method {method!r}",
    ):
        linear_estimator(prepared, method)


# -- refusals --------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", CLOSED_FORMS)
@pytest.mark.parametrize(
    ("angles", "problem"),
    [
        (turn(12), "a reading at 30 deg"),
        (np.append(turn(8), 10.0), "a reading at 10 deg"),
        (without(turn(8), 2), "no reading at position J = 3;"),
        (without(turn(8, 2), 0, 8, 9, 17), "no reading at position J = 1, 9;"),
    ],
    ids=["12 positions", "extra", "3 missing", "1 and 9 missing"],
)
def test_closed_forms_need_the_eight_positions(angles, problem, method):
    with pytest.raises(DesignError, match=problem):
        estimate(angles, forward(AL15, angles), method=method)


@pytest.mark.parametrize("value", [0.0, 1.3, -1e6])
def test_outputs_all_equal(value):
    with pytest.raises(InputError, match=re.escape(f"all 9 outputs are {value:g};")):
        prepare(record(turn(8), np.full(9, value)))


def test_unknown_method():
    with pytest.raises(InputError, match="'magic' is unknown; choose from least-squares, closed"):
        estimate(turn(8), forward(AL15, turn(8)), method="magic")


# -- what follows from the angles ------------------------------------------------------------------


@pytest.mark.parametrize("mounting", MOUNTINGS)
@pytest.mark.parametrize("delta0", [0.0, 0.3])
def test_derivative_by_the_head_angle(delta0, mounting):
    angles = np.array([0.0, 31.0, 90.0, 222.0, 315.0, 700.0])
    y = forward(UNITY, angles, delta0, mounting)
    prepared = prepare(record(angles, y, mounting=mounting), delta0=delta0)
    assert_allclose(prepared.design, rows(angles, delta0, mounting), atol=1e-14)
    assert_allclose(prepared.angular, rates(angles, delta0, mounting), atol=1e-14)


def test_places_on_the_head():
    angles = [0.0, 360.0, 720.0, -45.0, 315.0, 359.9999999, 45.00000004, 359.999]
    expected = [0.0, 0.0, 0.0, 315.0, 315.0, 0.0, 45.0, 359.999]
    assert_array_equal(head_positions(np.array(angles)), expected)


@pytest.mark.parametrize(
    ("declared", "scatter", "dof"),
    [
        ({}, 1.0, None),
        ({"std": 3.0}, 3.0, np.inf),
        ({"std": 3.0, "count": 9.0}, 1.0, 72.0),
        ({"std": 3.0, "count": 1.0}, 3.0, np.inf),
        ({"std": 3.0, "count": np.nan}, 3.0, np.inf),
        ({"std": 0.0}, 1.0, None),
        ({"std": np.nan, "count": 9.0}, 1.0, None),
    ],
    ids=str,
)
def test_declared_scatter(declared, scatter, dof):
    columns = {name: np.full(9, value) for name, value in declared.items()}
    prepared = prepare(record(turn(8), forward(AL15, turn(8)), **columns))
    assert_allclose(prepared.scatter, scatter)
    assert prepared.scatter_dof == dof


def test_one_reading_of_one_sample_does_not_undo_the_means_of_the_others():
    count = np.array([100.0] * 8 + [1.0])
    prepared = prepare(record(turn(8), forward(AL15, turn(8)), std=np.full(9, 2.0), count=count))
    assert_allclose(prepared.scatter, [0.2] * 8 + [2.0])
    assert prepared.scatter_dof == 8 * 99.0
