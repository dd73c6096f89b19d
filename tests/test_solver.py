"""The solver core against certified data, 50-digit arithmetic and exact fractions."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
from nist import Dataset, digits
from numpy.testing import assert_allclose
from tumble_oracle import AL15, forward, rows, turn

from accelcal.errors import DesignError
from accelcal.estimate.solver import LeastSquares

EASY = ("Norris", "Pontius", "NoInt1", "NoInt2", "Longley", *(f"Wampler{i}" for i in range(1, 6)))


def needed(name):
    return 7.0 if name == "Filip" else 9.0


# -- NIST StRD -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*EASY, "Filip"])
def test_certified_coefficients(name):
    data = Dataset(name)
    found = LeastSquares(data.design).solve(data.response)
    assert digits(found, data.coefficients) >= needed(name)


@pytest.mark.parametrize("name", [*EASY, "Filip"])
def test_certified_standard_deviations(name):
    data = Dataset(name)
    solver = LeastSquares(data.design)
    residual = data.response - data.design @ solver.solve(data.response)
    variance = residual @ residual / (residual.size - data.design.shape[1])
    found = np.sqrt(variance * (solver.map**2).sum(axis=1))
    assert digits(found, data.deviations) >= needed(name)


def test_the_certified_data_are_read_whole():
    sizes = {name: Dataset(name).design.shape for name in ("Filip", "Longley", "Norris", "NoInt2")}
    assert sizes == {"Filip": (82, 11), "Longley": (16, 7), "Norris": (36, 2), "NoInt2": (3, 1)}


# -- tumble designs in 50 digits -------------------------------------------------------------------


def solved_in_50_digits(design, y, sigma):
    with mpmath.workdps(50):
        system = np.column_stack([design, y])
        weighted = mpmath.matrix(
            [[mpmath.mpf(a) / s for a in row] for row, s in zip(system, sigma, strict=True)]
        )
        solution, _ = mpmath.qr_solve(weighted[:, :-1], weighted[:, weighted.cols - 1])
        return np.array([float(x) for x in solution])


@pytest.mark.parametrize("noise", [0.0, 5e-6, 1e-3])
@pytest.mark.parametrize("positions", [6, 8, 12, 24, 36])
def test_tumble_designs_to_12_digits(positions, noise):
    """Each coefficient by itself, though K1 is 50 000 times M_ip."""
    angles = turn(positions, 2)
    y = forward(AL15, angles) + noise * np.random.default_rng(1).standard_normal(angles.size)
    design = rows(angles)
    found = LeastSquares(design).solve(y)
    assert digits(found, solved_in_50_digits(design, y, np.ones(y.size))) >= 12.0


@pytest.mark.parametrize("positions", [8, 12, 24])
def test_unequal_weights_to_12_digits(positions):
    rng = np.random.default_rng(2)
    angles = turn(positions, 2)
    design = rows(angles)
    sigma = rng.uniform(1e-6, 5e-6, angles.size)
    y = forward(AL15, angles) + sigma * rng.standard_normal(angles.size)
    found = LeastSquares(design, sigma).solve(y)
    assert digits(found, solved_in_50_digits(design, y, sigma)) >= 12.0


@pytest.mark.parametrize("angles", [[0, 30, 77, 111, 190, 260, 333], np.linspace(-20, 20, 30)])
def test_awkward_angles_to_10_digits(angles):
    """Within 40 degrees the condition number is above a thousand."""
    design = rows(angles)[:, :3]
    y = forward(AL15, angles)
    found = LeastSquares(design).solve(y)
    assert digits(found, solved_in_50_digits(design, y, np.ones(y.size))) >= 10.0


# -- exact fractions -------------------------------------------------------------------------------


def solved_in_fractions(design, y, sigma):
    """Weighted normal equations by Gaussian elimination, without any rounding."""
    A = [[Fraction(float(a)) for a in row] for row in design]
    w = [1 / Fraction(float(s)) ** 2 for s in sigma]
    b = [Fraction(float(a)) for a in y]
    p, n = len(A[0]), range(len(A))
    system = [
        [sum(w[r] * A[r][i] * A[r][j] for r in n) for j in range(p)]
        + [sum(w[r] * A[r][i] * b[r] for r in n)]
        for i in range(p)
    ]
    for i in range(p):
        system[i] = [x / system[i][i] for x in system[i]]
        for j in range(p):
            if j != i:
                system[j] = [
                    x - system[j][i] * z for x, z in zip(system[j], system[i], strict=True)
                ]
    return np.array([float(row[-1]) for row in system])


def test_weights_are_those_of_the_normal_equations():
    rng = np.random.default_rng(3)
    design = rng.integers(-5, 6, (12, 4)).astype(float)
    y = rng.integers(-100, 101, 12).astype(float)
    sigma = 2.0 ** rng.integers(-2, 3, 12)
    found = LeastSquares(design, sigma).solve(y)
    assert_allclose(found, solved_in_fractions(design, y, sigma), rtol=1e-14)
    assert not np.allclose(found, LeastSquares(design).solve(y), rtol=1e-3)


def test_the_map_is_the_solution_as_a_matrix():
    rng = np.random.default_rng(4)
    design, sigma = rng.standard_normal((9, 3)), rng.uniform(1, 3, 9)
    solver = LeastSquares(design, sigma)
    assert_allclose(solver.map @ np.eye(9)[2], solver.solve(np.eye(9)[2]), atol=1e-14)
    assert_allclose(solver.map @ design, np.eye(3), atol=1e-14)
    weight = np.diag(sigma**-2)
    plain = np.linalg.inv(design.T @ weight @ design) @ design.T @ weight
    assert_allclose(solver.map, plain, atol=1e-13)


def test_the_basis_spans_the_weighted_columns():
    rng = np.random.default_rng(5)
    design, sigma = rng.standard_normal((9, 3)), rng.uniform(1, 3, 9)
    basis = LeastSquares(design, sigma).basis
    assert_allclose(basis.T @ basis, np.eye(3), atol=1e-14)
    weighted = design / sigma[:, None]
    assert_allclose(basis @ basis.T @ weighted, weighted, atol=1e-14)


def test_units_of_the_columns_do_not_matter():
    data = Dataset("Longley")
    units = 10.0 ** np.arange(-6, 8, 2)
    scaled = LeastSquares(data.design * units).solve(data.response) * units
    assert digits(scaled, data.coefficients) >= 9.0


def test_units_of_g_are_well_conditioned():
    """Condition 8 in units of g, as theory says; m/s^2 is 100 times worse without scaling."""
    assert LeastSquares(rows(turn(8, 6))).condition == pytest.approx(8.0, abs=1.5)
    in_metres = rows(turn(8, 6)) * 9.8106 ** np.array([0, 1, 2, 3, 1, 2])
    assert np.linalg.cond(in_metres) > 500
    assert LeastSquares(in_metres).condition < 12


# -- replicates ------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", ["one after the other", "stroke by stroke", "in no order"])
def test_replicates_are_brought_down_without_loss(order):
    """Exact fractions of readings that differ in their last digits only."""
    rng = np.random.default_rng(6)
    place = np.repeat(np.arange(5), 4) if order == "one after the other" else np.arange(20) % 5
    place = rng.permutation(place) if order == "in no order" else place
    design = rng.integers(-5, 6, (5, 3)).astype(float)[place]
    y = design @ [1.0, 1e-5, 3e-9] + rng.integers(0, 16, 20) * 2.0**-40
    found = LeastSquares(design).solve(y)
    exact = solved_in_fractions(design, y, np.ones(20))
    assert_allclose(found, exact, rtol=1e-14, atol=1e-22)


def test_the_squares_of_replicates_that_nearly_agree():
    design = np.repeat(np.eye(3), 4, axis=0)
    steps = np.array([0.0, 1.0, 2.0, 3.0] * 3)
    found = LeastSquares(design).fit(1.0 + steps * 2.0**-52)
    assert found.squares == pytest.approx(15.0 * 2.0**-104, rel=1e-12)


def test_rows_of_other_weights_are_no_replicates():
    design, y = np.ones((4, 1)), np.array([1.0, 2.0, 3.0, 6.0])
    found = LeastSquares(design, [1.0, 1.0, 2.0, 2.0]).fit(y)
    assert found.coefficients == pytest.approx([(3.0 + 9.0 / 4.0) / 2.5])
    assert found.squares == pytest.approx(((y - 2.1) ** 2 / [1.0, 1.0, 4.0, 4.0]).sum())


def test_a_gap_leaves_an_observation_out():
    rng = np.random.default_rng(7)
    design, y = rng.standard_normal((9, 3)), rng.standard_normal(9)
    gap = np.where(np.arange(9) == 4, np.nan, y)
    found, known = LeastSquares(design).fit(gap), ~np.isnan(gap)
    assert_allclose(found.coefficients, LeastSquares(design[known]).solve(y[known]), rtol=1e-12)
    assert found.readings == 8


# -- refusals --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "matrix",
    [
        [[1.0, 2.0]],
        [[1.0, 2.0], [2.0, 4.0], [3.0, 6.0]],
        [[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]],
        rows(turn(4)),
    ],
    ids=["fewer rows", "proportional", "zero column", "six coefficients on four positions"],
)
def test_dependent_columns_are_refused(matrix):
    with pytest.raises(DesignError, match="linearly dependent"):
        LeastSquares(matrix)
