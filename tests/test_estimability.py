"""What a design can tell apart, against exact arithmetic."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from tumble_oracle import NAMES, forward, record, rows, turn

from accelcal.errors import DesignError
from accelcal.estimate.estimability import estimability
from accelcal.estimate.tables import linear_estimator, prepare


def exact_design(positions):
    """Equation (1) at equally spaced angles, in exact numbers."""
    found = []
    for j in range(positions):
        theta = 2 * sp.pi * sp.Rational(j, positions)
        i, c = sp.cos(theta), sp.sin(theta)
        found.append([sp.Integer(1), i, i**2, i**3, c, i * c])
    return sp.Matrix(found).applyfunc(sp.nsimplify)


# -- four positions, in exact arithmetic -----------------------------------------------------------


def test_four_positions_tell_k0_from_k2():
    """Only K1 with K3 is confused, and M_ip leaves nothing: rank 4 of 6."""
    design = exact_design(4)
    columns = dict(zip(NAMES, (design.col(i) for i in range(6)), strict=True))
    assert design.rank() == 4
    assert sp.Matrix.hstack(columns["K0"], columns["K2"]).rank() == 2
    assert sp.Matrix.hstack(*(columns[name] for name in ("K0", "K1", "K2", "M"))).rank() == 4
    assert columns["K1"] == columns["K3"]
    assert columns["M_ip"] == sp.zeros(4, 1)


def test_four_positions_as_accelcal_tells_it():
    found = estimability(rows(turn(4)))
    assert found.kept == ("K0", "K1", "K2", "M")
    assert found.absorbed_by == {"K3": ("K1",), "M_ip": ()}
    assert found.stands_for == {"K1": "K1 + K3"}
    assert found.sentences() == (
        "K3 cannot be told apart from K1 at these angles: K1 stands for K1 + K3",
        "M_ip leaves no trace at these angles and is not estimated",
    )


def test_a_coefficient_that_three_take_up():
    (told, *_) = estimability(rows(np.array([0.0, 45.0, 90.0]))).sentences()
    assert told.startswith("K2 cannot be told apart from K0, K1 and M at these angles")


@pytest.mark.parametrize("positions", [2, 3, 4, 5, 6, 8, 12])
def test_as_many_are_kept_as_the_exact_rank(positions):
    found = estimability(rows(turn(positions)))
    exact = exact_design(positions)
    rank = int(exact.evalf(60).rank(iszerofunc=lambda x: abs(x) < 1e-40))
    assert len(found.kept) == rank
    kept = exact[:, found.columns].evalf(60)
    assert kept.rank(iszerofunc=lambda x: abs(x) < 1e-40) == rank


# -- what a kept coefficient stands for ------------------------------------------------------------

RANK_DEFICIENT = {
    "2 positions": turn(2),
    "3 positions": turn(3),
    "4 positions": turn(4),
    "4 positions, turned": turn(4) + 45.0,
    "5 positions": turn(5),
    "half the readings gone": [0.0, 45.0, 90.0, 180.0],
    "three angles": [10.0, 100.0, 222.0],
}


@pytest.mark.parametrize("angles", RANK_DEFICIENT.values(), ids=RANK_DEFICIENT)
def test_stands_for_is_what_the_fit_returns(angles):
    """Data of one lost coefficient alone show which estimates it goes into, and how much."""
    table = prepare(record(angles, forward((0.1, 1.3, 0, 0, 0, 0), angles)))
    found = table.estimability
    assert found.absorbed_by
    for lost, keepers in found.absorbed_by.items():
        unit = [float(name == lost) for name in NAMES]
        estimate = linear_estimator(table).coefficients(forward(unit, angles))
        went = {name: k for name, k in zip(NAMES, estimate, strict=True) if abs(k) > 1e-3}
        assert tuple(went) == keepers
        for name, share in went.items():
            size = "" if abs(share) == pytest.approx(1.0, abs=5e-4) else f"{abs(share):.3g} "
            assert f"{'+' if share > 0 else '-'} {size}{lost}" in found.stands_for[name]


@given(st.lists(st.floats(-360, 720), min_size=3, max_size=20))
@settings(max_examples=60, deadline=None)
def test_arbitrary_angles_are_sorted_out(angles):
    """Whatever is kept is well determined, whatever is lost is made of what is kept."""
    design = rows(angles)
    assume(np.ptp(design[:, 1]) > 0.3)
    found = estimability(design)
    kept = design[:, found.columns]
    assert set(found.kept) | set(found.absorbed_by) == set(NAMES)
    assert np.linalg.matrix_rank(kept) == len(found.kept)
    for name in found.absorbed_by:
        column = design[:, NAMES.index(name)]
        rest = column - kept @ np.linalg.lstsq(kept, column, rcond=None)[0]
        assert np.sqrt(np.mean(rest**2)) <= 0.0101


# -- asked for less --------------------------------------------------------------------------------


def test_only_what_is_asked_is_kept():
    found = estimability(rows(turn(8)), asked=("M", "K1", "K0"))
    assert found.kept == ("K0", "K1", "M")
    assert not found.absorbed_by
    assert found.sentences() == ("taken as 0, as it was not asked for: K2, K3, M_ip",)
    assert not estimability(rows(turn(8))).sentences()


def test_four_positions_keep_k3_where_k1_is_not_in_its_way():
    found = estimability(rows(turn(4)), asked=("K0", "K1", "K3"))
    assert found.kept == ("K0", "K1")


# -- refusals --------------------------------------------------------------------------------------


def test_strict_refuses_and_says_what_to_do():
    with pytest.raises(DesignError, match=r"K3 cannot be told apart from K1 .*; M_ip .*add posit"):
        estimability(rows(turn(4)), strict=True)
    assert estimability(rows(turn(8)), strict=True).kept == NAMES


@pytest.mark.parametrize("angles", [[0.0], [90.0, 270.0], [180.0] * 9, [60.0, -60.0, 300.0], [90]])
def test_one_acceleration_is_no_tumble_test(angles):
    with pytest.raises(DesignError, match="two or more angles"):
        estimability(rows(angles))


def test_unknown_and_missing_names():
    with pytest.raises(DesignError, match="'K7' is unknown; choose from K0, K1"):
        estimability(rows(turn(8)), asked=("K1", "K7"))
    with pytest.raises(DesignError, match="K1 is not among"):
        estimability(rows(turn(8)), asked=("K0", "M"))


def test_a_rounding_error_of_the_angle_determines_nothing():
    """On 4 positions M_ip acts by sin(2 th) / 2: what an angle is off by is no signal."""
    angles = turn(4) + np.array([0.0, 1e-4, -1e-4, 2e-4, 0.0])
    assert estimability(rows(angles)).kept == ("K0", "K1", "K2", "M")
    assert estimability(rows(turn(4), delta0=1e-3)).kept == ("K0", "K1", "K2", "M")


def test_weights_do_not_change_what_is_kept():
    sigma = np.geomspace(1e-7, 1e-5, 9)
    table = prepare(record(turn(8), forward((0, 1.3, 0, 0, 0, 0), turn(8)), std=sigma))
    assert table.estimability.kept == NAMES
    assert_allclose(table.scatter, sigma)
