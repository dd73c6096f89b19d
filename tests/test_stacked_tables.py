"""Many tables at once: the same numbers as one by one, with gaps, weights and outliers."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tumble_oracle import AL15, forward, rows, turn

import accelcal
from accelcal.errors import DesignError, InputError
from accelcal.estimate.robust import pseudo_values
from accelcal.estimate.solver import LeastSquares
from accelcal.estimate.stacked_tables import _BLOCK, estimate_tables
from accelcal.geometry import accelerations
from accelcal.model import design_matrix

ANGLES = turn(8, 6)
SIGMA = 4e-6


def readings(tables, seed=1):
    """Tables of accelerometers that differ, with readings noise."""
    rng = np.random.default_rng(seed)
    truth = AL15 * (1.0 + 0.05 * rng.standard_normal((tables, 6)))
    return truth @ rows(ANGLES).T + SIGMA * rng.standard_normal((tables, ANGLES.size))


def with_gaps(y, share=0.05, seed=2):
    return np.where(np.random.default_rng(seed).random(y.shape) < share, np.nan, y)


def assert_same_numbers(one, other, rounding=0.0):
    within = 1e-12 + rounding / SIGMA
    assert_allclose(one.coefficients, other.coefficients, rtol=1e-14, atol=rounding)
    assert_allclose(one.standard_uncertainties, other.standard_uncertainties, rtol=within)
    assert_allclose(one.residual_rms, other.residual_rms, rtol=within)
    assert_array_equal(one.dof, other.dof)


def joined(parts):
    fields = zip(*(part[1:5] for part in parts), strict=True)
    return parts[0]._replace(
        **dict(zip(parts[0]._fields[1:5], map(np.concatenate, fields), strict=True))
    )


def taken(found, tables):
    return found._replace(**{f: getattr(found, f)[tables] for f in found._fields[1:5]})


# -- a table comes out the same whatever the others are -------------------------------------------


@pytest.mark.parametrize(
    ("gaps", "options"),
    [
        (0.0, {}),
        (0.05, {}),
        (0.002, {}),  # few tables have a gap
        (0.05, {"robust": True}),
        (0.05, {"std": np.linspace(1.0, 2.0, ANGLES.size)}),
    ],
    ids=["whole", "gaps", "few gaps", "robust", "weights"],
)
def test_a_stack_is_the_same_as_its_tables_one_by_one(gaps, options):
    y = with_gaps(readings(400), gaps)
    whole = estimate_tables(y, ANGLES, **options)
    rounding = 1e-15 if "robust" in options else 0.0  # that of the pseudo-values
    alone = joined([estimate_tables(row[None], ANGLES, **options) for row in y])
    assert_same_numbers(whole, alone, rounding)
    order = np.random.default_rng(3).permutation(len(y))
    permuted = estimate_tables(y[order], ANGLES, threads=2, **options)
    assert_same_numbers(permuted, taken(whole, order), rounding)


def test_the_last_digit_of_a_table_is_the_same_in_every_block_of_its_width():
    """Products with other numbers of tables may sum in another order, those of one width not."""
    y = readings(_BLOCK + 700)
    swapped = np.concatenate([y[:_BLOCK][::-1], y[_BLOCK:]])
    one, other = (estimate_tables(values, ANGLES) for values in (y, swapped))
    assert_array_equal(one.coefficients[_BLOCK:], other.coefficients[_BLOCK:])
    assert_array_equal(one.residual_rms[_BLOCK:], other.residual_rms[_BLOCK:])


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize("gaps", [0.0, 0.02])
def test_the_width_of_a_block_does_not_matter(monkeypatch, gaps, robust):
    """Nor do the pieces in which a block is transposed and multiplied."""
    y = with_gaps(readings(3000), gaps)
    wide = estimate_tables(y, ANGLES, robust=robust)
    monkeypatch.setattr("accelcal.estimate.stacked_tables._READINGS", 37 * ANGLES.size)
    narrow = estimate_tables(y, ANGLES, robust=robust)
    assert_same_numbers(narrow, wide, 1e-15 if robust else 0.0)


def test_a_table_of_more_readings_than_a_block_may_have(monkeypatch):
    monkeypatch.setattr("accelcal.estimate.stacked_tables._READINGS", ANGLES.size - 1)
    y = readings(3)
    alone = joined([estimate_tables(row[None], ANGLES) for row in y])
    assert_same_numbers(estimate_tables(y, ANGLES), alone)


@pytest.mark.parametrize("lacking", [1, 600, 1900])
def test_tables_with_gaps_do_not_change_those_without(lacking):
    """Neither few nor most of a block."""
    y = readings(2000)
    spoilt = y.copy()
    spoilt[:lacking, 5] = np.nan
    assert_same_numbers(
        taken(estimate_tables(spoilt, ANGLES), slice(lacking, None)),
        taken(estimate_tables(y, ANGLES), slice(lacking, None)),
    )


@pytest.mark.parametrize("strokes", [1, 5, 6])
@pytest.mark.parametrize("share", [0.0, 0.1])
def test_designs_with_any_number_of_replicates(strokes, share):
    angles = np.append(turn(8, strokes), [45.0, 10.0])
    rng = np.random.default_rng(8)
    y = rng.uniform(0.5, 1.5, (30, 1)) * forward(AL15, angles)
    y = with_gaps(y + SIGMA * rng.standard_normal(y.shape[:1] + angles.shape), share)
    found = estimate_tables(y, angles)
    for row, x, rms in zip(y, found.coefficients, found.residual_rms, strict=True):
        known = ~np.isnan(row)
        oracle, squares, *_ = np.linalg.lstsq(rows(angles)[known], row[known], rcond=None)
        assert_allclose(x, oracle, atol=1e-12)
        assert_allclose(rms, np.sqrt(squares[0] / (known.sum() - 6)), rtol=1e-8)


def test_a_position_without_any_reading():
    y = readings(3)
    y[:, np.mod(ANGLES, 360.0) == 45.0] = np.nan
    found = estimate_tables(y, ANGLES)
    for i, row in enumerate(y):
        x, u = solved_by_lstsq(row, np.ones(row.size))
        assert_allclose(found.coefficients[i], x, atol=1e-12)
        assert_allclose(found.standard_uncertainties[i], u, rtol=1e-8)


@pytest.mark.parametrize("stroke", [0, 3])
def test_the_first_replicate_may_be_the_outlier(stroke):
    """The differences of the replicates are taken from the first."""
    y = readings(1)
    y[0, np.flatnonzero(np.mod(ANGLES, 360.0) == 90.0)[stroke]] += 1e9 * SIGMA
    x, u = solved_by_lstsq(y[0], np.ones(y.shape[1]))
    found = estimate_tables(y, ANGLES)
    assert_allclose(found.coefficients[0], x, rtol=1e-13, atol=2e-12)
    assert_allclose(found.standard_uncertainties[0], u, rtol=1e-9)


def test_weights_may_differ_by_any_factor():
    """A replicate that counts for nothing is far off, wherever it stands."""
    y = readings(4)
    std = np.ones_like(y)
    for table, reading in enumerate((0, 1, 20, 53)):
        y[table, reading] += 0.1
        std[table, reading] = 1e7
    found = estimate_tables(y, ANGLES, std=std)
    left_out = estimate_tables(np.where(std > 1.0, np.nan, y), ANGLES)
    assert_allclose(found.coefficients, left_out.coefficients, atol=1e-13)
    assert_allclose(found.residual_rms, left_out.residual_rms * np.sqrt(47 / 48), rtol=1e-6)


def test_the_one_table_solver_gives_the_numbers_of_the_stack():
    y = readings(300)
    solver = LeastSquares(design_matrix(accelerations(ANGLES)))
    alone = np.array([solver.solve(row) for row in y])
    assert_allclose(estimate_tables(y, ANGLES).coefficients, alone, rtol=1e-14)


# -- oracles ---------------------------------------------------------------------------------------


def solved_by_lstsq(y, weight):
    known = ~np.isnan(y)
    root = np.sqrt(weight[known])
    design = rows(ANGLES)[known] * root[:, None]
    x = np.linalg.lstsq(design, root * y[known], rcond=None)[0]
    residual = root * y[known] - design @ x
    variance = residual @ residual / (known.sum() - 6)
    return x, np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design)))


@pytest.mark.parametrize("gaps", [0.0, 0.05, 0.3])
@pytest.mark.parametrize("weighted", [False, True])
def test_gaps_and_weights_are_those_of_lstsq(gaps, weighted):
    y = with_gaps(readings(200), gaps)
    std = np.random.default_rng(4).uniform(1.0, 30.0, y.shape) if weighted else np.ones(y.shape)
    found = estimate_tables(y, ANGLES, std=std if weighted else None)
    for i, (row, spread) in enumerate(zip(y, std, strict=True)):
        x, u = solved_by_lstsq(row, spread**-2)
        assert_allclose(found.coefficients[i], x, atol=1e-12)
        assert_allclose(found.standard_uncertainties[i], u, rtol=1e-8)


def test_one_weight_for_all_tables_is_that_weight_in_each():
    y, std = readings(50), np.linspace(1.0, 3.0, ANGLES.size)
    common, own = (estimate_tables(y, ANGLES, std=s) for s in (std, np.tile(std, (50, 1))))
    assert_same_numbers(common, own)


def test_the_uncertainties_cover_the_truth():
    y = forward(AL15, ANGLES) + SIGMA * np.random.default_rng(5).standard_normal(
        (4000, ANGLES.size)
    )
    found = estimate_tables(y, ANGLES)
    inside = np.abs(found.coefficients - AL15) < 2.0106 * found.standard_uncertainties  # t, 48 dof
    assert np.all(np.abs(inside.mean(axis=0) - 0.95) < 0.014)  # four standard deviations
    assert found.residual_rms.mean() == pytest.approx(SIGMA, rel=0.01)


def test_an_outlier_is_made_harmless_in_its_table():
    y = readings(60)
    spoilt = y.copy()
    spoilt[7, 20] += 1.0
    clean, safe = (estimate_tables(values, ANGLES, robust=True) for values in (y, spoilt))
    change = np.abs(safe.coefficients - clean.coefficients)
    assert change[7].max() < SIGMA
    assert np.delete(change, 7, axis=0).max() < 1e-14


def test_pseudo_values_of_a_stack_are_those_of_its_tables():
    y = with_gaps(readings(40), 0.05)
    y[3, 10] += 1e-3
    cells = np.mod(ANGLES, 360.0)
    whole = pseudo_values(y, cells)
    for row, expected in zip(y, whole, strict=True):
        known = ~np.isnan(row)
        assert_allclose(pseudo_values(row[known], cells[known]), expected[known], atol=1e-9 * SIGMA)
    assert_array_equal(np.isnan(whole), np.isnan(y))


# -- what cannot be had ----------------------------------------------------------------------------


def test_a_table_with_too_few_readings_is_nan_and_harms_no_other():
    y = readings(3)
    few, exact = y.copy(), y.copy()
    few[1, 5:] = np.nan
    exact[1, [*range(6, 54)]] = np.nan
    found = estimate_tables(few, ANGLES)
    assert np.isnan(found.coefficients[1]).all()
    assert_same_numbers(
        joined([estimate_tables(y[[i]], ANGLES) for i in (0, 2)]),
        taken(found, [0, 2]),
    )
    no_rest = estimate_tables(exact, ANGLES)
    assert no_rest.dof.tolist() == [48, 0, 48]
    assert np.isfinite(no_rest.coefficients[1]).all()
    assert np.isnan(no_rest.standard_uncertainties[1]).all()


def test_readings_at_too_few_angles_are_nan():
    y = readings(1)
    y[0, ~np.isin(np.mod(ANGLES, 360.0), [0.0, 90.0, 180.0, 270.0])] = np.nan
    assert np.isnan(estimate_tables(y, ANGLES).coefficients).all()


@pytest.mark.parametrize("std", [1.0, None], ids=["alike", "own"])
def test_no_choice_of_too_few_angles_passes_for_enough(std):
    """Of 2,000 gaps some leave a small pivot, beside which rounding errors look like a rank."""
    rng = np.random.default_rng(4)
    angles = np.tile(45.0 * np.arange(9) + rng.uniform(-3.0, 3.0, 9), 3)
    y = np.tile(forward(AL15, angles), (2000, 1))
    left = np.arange(9).argsort()[rng.permuted(np.tile(np.arange(9), (2000, 1)), axis=1)] < 5
    many = np.tile(left, 3) & (rng.random(y.shape) < 0.8)
    few = np.hstack([left, np.zeros((2000, 18), dtype=bool)])
    for known in (many, few):
        spread = np.full(angles.size, std) if std else rng.uniform(1.0, 3.0, y.shape)
        found = estimate_tables(np.where(known, y, np.nan), angles, std=spread)
        assert np.isnan(found.coefficients).all()


def test_four_positions_estimate_what_they_can():
    angles = turn(4, 6)
    y = forward(AL15, angles) + SIGMA * np.random.default_rng(6).standard_normal((5, angles.size))
    found = estimate_tables(y, angles)
    assert found.names == ("K0", "K1", "K2", "M")
    assert found.coefficients.shape == (5, 4)
    assert found.stands_for["K1"] == "K1 + K3"


def test_no_tables_are_no_estimates():
    assert estimate_tables(np.empty((0, ANGLES.size)), ANGLES).coefficients.shape == (0, 6)


@pytest.mark.parametrize(
    ("outputs", "options", "message"),
    [
        (np.zeros(54), {}, r"output of shape \(54,\) with angle of shape \(54,\); the output has"),
        (np.zeros((2, 53)), {}, "a row a table and a column for each angle"),
        (np.full((2, 54), np.inf), {}, "an output is infinite; a reading that is missing is NaN"),
        (np.where(np.arange(54) == 7, -np.inf, np.ones((2, 54))), {}, "an output is infinite"),
        (np.zeros((2, 54)), {"std": np.ones(3)}, r"std has shape \(3,\); it is \(54,\) or"),
        (np.zeros((2, 54)), {"std": np.zeros(54)}, "a std is not above zero"),
        (np.zeros((2, 54)), {"std": np.full(54, 1e-160)}, "it lies between 1e-40 and 1e20"),
        (1e300 * readings(2), {}, r"outputs of up to 1\.\d+e\+300; they lie between 1e-20 and"),
        (1e160 * readings(2), {"robust": True}, "give them in another unit"),
        (1e-160 * readings(2), {}, r"outputs of up to 1\.\d+e-160; they lie between 1e-20 and"),
    ],
)
def test_what_does_not_fit_is_refused(outputs, options, message):
    with pytest.raises(InputError, match=message):
        estimate_tables(outputs, ANGLES, **options)


def test_robust_needs_three_strokes():
    with pytest.raises(DesignError, match="no position has three"):
        estimate_tables(np.zeros((2, 8)), turn(8)[:-1], robust=True)


def test_frame():
    frame = accelcal.estimate_tables(readings(4), ANGLES).to_frame()
    assert list(frame.columns[[0, 6, 12, 13]]) == ["K0", "u(K0)", "residual_rms", "dof"]
    assert frame.index.tolist() == [0, 1, 2, 3]


def test_a_frame_may_have_the_index_of_its_outputs():
    outputs = pd.DataFrame(readings(2), index=["b", "a"])
    found = accelcal.estimate_tables(outputs, ANGLES)
    frame = found.to_frame(outputs.index)
    assert frame.index.tolist() == ["b", "a"]
    for other in ("x", ["a"], 5):
        with pytest.raises(InputError, match=r"index is .*; it has a label for each of the 2 tab"):
            found.to_frame(other)
    assert frame.loc["a", "K1"] == found.coefficients[1, found.names.index("K1")]


def test_columns_that_are_the_angles_in_another_order_are_refused():
    """The readings of one angle were taken for those of another, without a word."""
    angles = turn(8, 1)[:-1]
    truth = (AL15 * np.ones((2, 1))) @ rows(angles).T
    outputs = pd.DataFrame(truth, columns=angles)
    turned = outputs[outputs.columns[::-1]]
    told = r"the angles in another order; order them so, or give angle=frame\.columns\.astype"
    std = outputs * 0.0 + 1e-5
    for given, spread in (
        (turned, None),
        (turned.rename(columns=str), None),  # as a CSV file has them
        (outputs, std[std.columns[::-1]]),
    ):
        with pytest.raises(InputError, match=told):
            estimate_tables(given, angles, std=spread)
    with pytest.raises(InputError, match="output and std are Series of different indices"):
        estimate_tables(outputs, angles, std=std[::-1])
    found = estimate_tables(turned, turned.columns)
    assert_allclose(found.coefficients, estimate_tables(outputs, angles).coefficients, atol=1e-12)
    assert repr(found) == "<TableEstimates: 2 tables, K0, K1, K2, K3, M and M_ip>"
