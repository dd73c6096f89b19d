"""Reading noise, head error, launch shift and resolution: what is taken from where."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from one_record import estimate_of_record, noises_of_record
from scipy.optimize import minimize_scalar
from tumble_oracle import AL15, Apparatus, forward, rates, record, rows, turn

from accelcal.estimate.contrasts import LackOfFit
from accelcal.estimate.head import head_error
from accelcal.estimate.launch import run_shift
from accelcal.estimate.noise import rounding
from accelcal.estimate.tables import prepare
from accelcal.estimate.uncertainty import interval_stack

SIGMA = 5e-6


def noisy(angles, seed, head=0.0, mounting="o+"):
    """Readings with noise and, the same at each visit of a position, an error of the head."""
    rng = np.random.default_rng(seed)
    places = {p: rng.standard_normal() for p in np.round(np.mod(angles, 360.0), 6)}
    error = head * np.array([places[p] for p in np.round(np.mod(angles, 360.0), 6)])
    y = forward(AL15, angles + np.degrees(error), 0.0, mounting)
    return y + SIGMA * rng.standard_normal(len(angles))


def noises(*records):
    tables = [prepare(r) for r in records]
    return noises_of_record(tables)


# -- reading noise ---------------------------------------------------------------------------------


def test_replicates_tell_the_noise():
    """Pure error: the scatter within each position; 0 and 360 deg are one position."""
    angles = turn(8, 6)
    y = noisy(angles, 1, head=1e-4)
    places = np.mod(angles, 360.0)
    squares = sum(((y[places == p] - y[places == p].mean()) ** 2).sum() for p in set(places))
    (noise,) = noises(record(angles, y))
    assert noise.dof == 54 - 8
    assert noise.factor == pytest.approx(math.sqrt(squares / 46), rel=1e-9)
    assert noise.source == "replicates"
    assert math.isnan(noise.excess)


def test_a_table_without_replicates_borrows():
    poor, rich = turn(8), turn(8, 4)
    found = noises(record(poor, noisy(poor, 2)), record(rich, noisy(rich, 3)))
    assert [n.source for n in found] == ["replicates of all tables", "replicates"]
    assert found[0].dof == 1 + 28
    assert found[0].factor == pytest.approx(found[1].factor, rel=0.1)


def test_a_table_with_declared_std_lends_nothing():
    """Its scatter is a ratio to the declared std, and not in the unit of the output."""
    poor, rich = turn(8), turn(8, 4)
    declared = record(rich, noisy(rich, 3), std=np.full(rich.size, SIGMA))
    alone = noises(record(poor, noisy(poor, 2)))[0]
    beside = noises(record(poor, noisy(poor, 2)), declared)[0]
    assert (beside.factor, beside.dof, beside.source) == (alone.factor, alone.dof, "residuals")


def test_without_replicates_the_residuals_are_taken():
    angles = turn(12)[:-1]
    y = noisy(angles, 4)
    rest = y - rows(angles) @ np.linalg.lstsq(rows(angles), y, rcond=None)[0]
    (noise,) = noises(record(angles, y))
    assert (noise.source, noise.dof) == ("residuals", 6)
    assert noise.factor == pytest.approx(math.sqrt(rest @ rest / 6), rel=1e-6)


def test_a_saturated_design_has_no_noise_and_no_uncertainty():
    angles = turn(6)[:-1]
    found = estimate_of_record([prepare(record(angles, noisy(angles, 5)))], Apparatus())
    assert found.noises[0].source == "none"
    assert math.isnan(found.noises[0].factor)
    assert found.noises[0].dof == 0
    assert found.head.source == "none"
    assert np.isnan(found.components["reading"].covariance).all()


def test_readings_that_are_all_alike_still_have_rounding_errors():
    angles = turn(8, 6)
    (noise,) = noises(record(angles, forward(AL15, angles)))
    assert noise.factor == pytest.approx(4 * 2.0**-52 * max(forward(AL15, angles)), rel=1e-6)


@pytest.mark.parametrize(
    ("actual", "source", "excess"), [(1.0, "declared", None), (3.0, "replicates", 3.0)]
)
def test_declared_std_holds_unless_the_strokes_contradict(actual, source, excess):
    angles = turn(8, 6)
    y = forward(AL15, angles) + actual * SIGMA * np.random.default_rng(6).standard_normal(54)
    for count in (None, np.full(54, 16.0)):
        std = np.full(54, SIGMA * (1.0 if count is None else 4.0))
        (noise,) = noises(record(angles, y, std=std, count=count))
        assert noise.source == source
        assert noise.dof == (46 if excess else math.inf if count is None else 54 * 15)
        assert noise.factor == pytest.approx(excess or 1.0, rel=0.25 if excess else 0.0)
        assert_array_equal(noise.excess, noise.factor if excess else math.nan)


def test_strokes_better_than_declared_do_not_shrink_the_noise():
    angles = turn(8, 6)
    y = forward(AL15, angles) + 0.1 * SIGMA * np.random.default_rng(7).standard_normal(54)
    (noise,) = noises(record(angles, y, std=np.full(54, SIGMA)))
    assert (noise.source, noise.factor) == ("declared", 1.0)
    assert noise.shortfall == pytest.approx(10.0, rel=0.25)


@pytest.mark.parametrize("actual", [0.0, 0.8, 1.0])
def test_strokes_as_declared_or_alike_to_the_last_digit_fall_short_of_nothing(actual):
    angles = turn(8, 6)
    for seed in range(50):
        y = forward(AL15, angles) + actual * SIGMA * np.random.default_rng(seed).standard_normal(54)
        (noise,) = noises(record(angles, y, std=np.full(54, SIGMA)))
        assert math.isnan(noise.shortfall)


def test_declared_std_is_rarely_contradicted_by_chance():
    angles = turn(8, 3)
    std = np.full(angles.size, SIGMA)
    found = [noises(record(angles, noisy(angles, seed), std=std))[0] for seed in range(400)]
    assert 0 < sum(n.source == "replicates" for n in found) < 14  # 1 % of 400, plus 5 sigma


# -- head ------------------------------------------------------------------------------------------


def fitted(positions=8, strokes=6, runs=1, head=2e-5, seed=8, declared=None, std=None):
    angles = turn(positions, strokes)
    y = np.concatenate([noisy(angles, seed, head) for _ in range(runs)])
    y += SIGMA * np.random.default_rng(seed + 1).standard_normal(y.size)
    whole = record(
        np.tile(angles, runs),
        y,
        run=np.repeat(range(runs), angles.size),
        temperature=np.repeat(20.0 + 30.0 * np.arange(runs), angles.size),
        std=None if std is None else np.full(y.size, std),
    )
    apparatus = Apparatus(head_uncertainty=declared)
    return whole, estimate_of_record([prepare(t) for t in whole.tables()], apparatus)


@pytest.mark.parametrize(
    ("positions", "dof"), [(8, 2), (9, 3), (12, 6), (16, 10), (24, 18), (36, 30)]
)
@pytest.mark.parametrize("runs", [1, 3])
def test_degrees_of_freedom_of_an_estimated_head(positions, runs, dof):
    """Positions minus six coefficients, however many tables: they share the head."""
    _, found = fitted(positions, runs=runs)
    assert found.head.source == "estimated"
    assert found.head.dof == dof
    assert np.all(found.components["head"].dof == dof)


def test_six_positions_show_nothing_of_the_head():
    _, found = fitted(6)
    assert found.head.source == "none"
    assert found.head.uncertainty == 0.0
    assert "head" not in found.components


def restricted_likelihood(whole, coefficients, sigma, share):
    """Minus twice the log-likelihood of what six coefficients a table leave, by the head error.

    From the covariance of all readings and the projection on what is left, not from contrasts.
    """
    tables = list(whole.tables())
    places = np.unique(np.mod(whole.angle, 360.0))
    acting, left, readings = [], [], []
    for table, k in zip(tables, coefficients, strict=True):
        at = (np.mod(table.angle, 360.0)[:, None] == places).astype(float)
        acting.append((rates(table.angle) @ k)[:, None] * at)
        q, _ = np.linalg.qr(rows(table.angle), mode="complete")
        left.append(q[:, 6:])
        readings.append(table.output)
    n = sum(block.shape[0] for block in left)
    projector = np.zeros((n, sum(block.shape[1] for block in left)))
    row = column = 0
    for block in left:
        projector[row : row + block.shape[0], column : column + block.shape[1]] = block
        row, column = row + block.shape[0], column + block.shape[1]
    seen = projector.T @ np.concatenate(acting)
    rest = projector.T @ np.concatenate(readings)
    lambdas, vectors = np.linalg.eigh(seen @ seen.T)
    shown = lambdas > 1e-10 * lambdas.max()
    z = vectors[:, shown].T @ rest

    def score(u):
        variance = share * sigma**2 + u**2 * lambdas[shown]
        return float((np.log(variance) + z**2 / variance).sum())

    return score


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("positions", "runs"), [(8, 1), (8, 3), (12, 2)])
def test_the_head_estimate_is_the_most_likely(positions, runs, seed):
    """Part of the noise variance is taken off; a brute-force scan finds no better head error."""
    sigma = math.sqrt(2.0) * SIGMA
    whole, found = fitted(positions, 6, runs, head=8e-6, seed=seed, std=sigma)
    share = (positions - 6) / positions
    score = restricted_likelihood(whole, found.coefficients, sigma, share)
    scan = [score(u) for u in np.geomspace(1e-8, 1e-3, 2000)]
    assert score(found.head.uncertainty) <= min(scan) + 1e-3
    around = found.head.uncertainty * np.array([0.8, 1.25])
    if found.head.uncertainty > 1e-6:
        best = minimize_scalar(score, bounds=around, method="bounded", options={"xatol": 1e-12})
        assert found.head.uncertainty == pytest.approx(best.x, rel=0.006)


def test_the_head_is_searched_far_enough():
    """A weak contrast with a large lack of fit asks for a head error far outside the noise."""
    contrasts = np.array([1.0, 1000.0])
    extreme = LackOfFit(
        positions=np.zeros(2),
        contrasts=contrasts,
        strengths=np.array([1.0, 0.051]),
        directions=np.eye(2),
    )
    u = np.geomspace(1.0, 1e6, 100_000)[:, None]
    variance = 2 / 8 + (u * extreme.strengths) ** 2
    best = u[np.argmin((np.log(variance) + contrasts**2 / variance).sum(axis=1)), 0]
    assert head_error(extreme, None).uncertainty == pytest.approx(best, rel=0.006)


@pytest.mark.parametrize(("contrast", "size"), [(0.3, 0.6), (3.0, 6.0), (0.0, 0.0)])
def test_of_the_noise_nothing_is_taken_off_one_contrast(contrast, size):
    """Below 0.38 of the noise it showed no head: U held 91 to 95 % on 7 positions."""
    alone = LackOfFit(np.zeros(1), np.array([contrast]), np.array([0.5]), np.eye(1))
    assert head_error(alone, None).uncertainty == pytest.approx(size, rel=0.006)


def test_a_large_head_error_is_found_to_its_size():
    sizes = [fitted(12, head=1e-3, seed=seed)[1].head.uncertainty for seed in range(40)]
    assert np.sqrt(np.mean(np.square(sizes))) == pytest.approx(1e-3, rel=0.2)


def test_a_perfect_head_is_found_perfect():
    sizes = [fitted(12, head=0.0, seed=seed)[1].head.uncertainty for seed in range(40)]
    assert np.median(sizes) < SIGMA


def test_a_declared_head_is_believed():
    _, found = fitted(declared=7e-5)
    assert found.head.uncertainty == 7e-5
    assert found.head.source == "declared"
    assert np.isinf(found.components["head"].dof).all()


def test_the_errors_of_a_bad_head_are_seen():
    """With a head much worse than the noise, 24 positions show most of their own errors."""
    angles = turn(24, 4)
    error = 1e-4 * np.random.default_rng(10).standard_normal(24)
    at = np.round(np.mod(angles, 360.0) / 15.0).astype(int)
    y = forward(AL15, angles + np.degrees(error[at]))
    y = y + 1e-8 * np.random.default_rng(11).standard_normal(y.size)
    apparatus = Apparatus(head_uncertainty=1e-4)
    found = estimate_of_record([prepare(record(angles, y))], apparatus)
    acting = np.diag(rates(np.arange(24) * 15.0) @ AL15)
    visible = np.eye(24) - rows(np.arange(24) * 15.0) @ np.linalg.pinv(rows(np.arange(24) * 15.0))
    seen = found.lack_of_fit.seen(np.array(found.head.uncertainty)).values
    assert_allclose(visible @ acting @ seen, visible @ acting @ error, atol=2e-7)


# -- one stroke: noise and head from the same residuals --------------------------------------------


def one_stroke(positions, head, seed, declared=None, closed=True, runs=1):
    """Coefficients apart, everything that a single stroke leaves: the fit, z and its two shapes."""
    angles = turn(positions) if closed else turn(positions)[:-1]
    y = np.concatenate([noisy(angles, (seed, run), 0.0) for run in range(runs)])
    y = y + np.tile(noisy(angles, (seed, 99), head) - noisy(angles, (seed, 99)), runs)
    whole = record(np.tile(angles, runs), y, run=np.repeat(range(runs), angles.size))
    tables = [prepare(t) for t in whole.tables()]
    found = estimate_of_record(tables, Apparatus(head_uncertainty=declared))
    place = np.round(np.mod(angles, 360.0), 6)
    same = (place[:, None] == np.unique(place)).astype(float)
    slope = rates(angles) @ np.mean(found.coefficients, axis=0)
    acting = np.tile(slope[:, None] * same, (runs, 1))
    left = np.linalg.svd(rows(angles))[0][:, 6:]
    left = np.kron(np.eye(runs), left)
    return found, left.T @ y, left.T @ acting @ acting.T @ left


def minus_log_likelihood(z, shape, s, u):
    covariance = s**2 * np.eye(z.size) + u**2 * shape
    return np.linalg.slogdet(covariance)[1] + z @ np.linalg.solve(covariance, z)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    ("positions", "runs", "closed"),
    [(8, 1, True), (8, 2, True), (8, 3, False), (12, 1, True), (24, 1, True)],
)
def test_one_stroke_tells_noise_from_head(positions, runs, closed, seed):
    """The most likely head error; the noise with a third of its variance taken off."""
    found, z, shape = one_stroke(positions, 1e-5, seed, closed=closed, runs=runs)
    assert {noise.source for noise in found.noises} == {"residuals"}
    assert (found.head.source, found.head.dof) == ("estimated", positions - 6)
    assert {noise.dof for noise in found.noises} == {z.size}

    def score(log_s, u):
        return minus_log_likelihood(z, shape, math.exp(log_s), u)

    def profile(u):
        return minimize_scalar(lambda log_s: score(log_s, u), bounds=(-18, -8), method="bounded")

    u = found.head.uncertainty
    scan = [profile(other).fun for other in np.concatenate([[0.0], np.geomspace(1e-7, 1e-4, 60)])]
    assert profile(u).fun <= min(scan) + 2e-3
    ratio = (u / math.exp(profile(u).x)) ** 2
    noise = z @ np.linalg.solve(np.eye(z.size) + ratio / 3.0 * shape, z) / z.size
    assert found.noises[0].factor == pytest.approx(math.sqrt(noise), rel=0.01)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("positions", "closed"), [(8, True), (12, True), (24, True)])
def test_one_stroke_beside_a_declared_head(positions, closed, seed):
    """The residuals hold the head error too; what is left of them is noise."""
    head = 1e-5
    found, z, shape = one_stroke(positions, head, seed, declared=head, closed=closed)
    scan = np.geomspace(1e-7, 1e-4, 3000)
    s = scan[np.argmin([minus_log_likelihood(z, shape, s, head) for s in scan])]
    own = s**2 * np.linalg.inv(s**2 * np.eye(z.size) + head**2 * shape)
    assert found.head.uncertainty == head
    assert found.noises[0].factor == pytest.approx(s, rel=0.01)
    assert found.noises[0].dof == pytest.approx(np.trace(own @ own), rel=0.03)


def test_a_perfect_head_leaves_the_residuals_to_the_noise():
    found, z, _ = one_stroke(12, 0.0, 1, declared=0.0)
    assert found.noises[0].dof == pytest.approx(7.0)
    assert found.noises[0].factor == pytest.approx(math.sqrt(z @ z / 7), rel=1e-6)


def test_noise_that_a_declared_head_hides_is_not_made_small():
    """Without a return all residuals pass for noise, rather than none of them."""
    found, z, _ = one_stroke(8, 1e-5, 2, declared=1e-3, closed=False)
    assert found.noises[0].dof == 2.0
    assert found.noises[0].factor == pytest.approx(math.sqrt(z @ z / 2), rel=1e-6)


def test_six_positions_and_the_return_show_the_noise_only():
    found, z, _ = one_stroke(6, 2e-5, 3)
    assert (found.head.source, found.noises[0].dof) == ("none", 1)
    assert found.noises[0].factor == pytest.approx(abs(z[0]), rel=1e-6)


def test_intervals_of_one_stroke_hold_the_truth():
    """White noise made of the residuals holds K0 in 87 % here; the aim is 95."""
    held = 0
    for seed in range(400):
        found, _, _ = one_stroke(12, 2e-5, seed)
        expanded = interval_stack(found.components).expanded[0]
        held += abs(found.coefficients[0][0] - AL15[0]) <= expanded
    assert held / 400 > 0.91


# -- launch ----------------------------------------------------------------------------------------


def test_runs_that_miss_their_level_do_not_pass_for_shifts():
    """500 ppm/degC times 0.3 degC is 150 ppm, thirty times what a launch does."""
    levels = np.array([20.0, 80.0, 79.7, -40.0, -39.8, 20.3, 20.1])
    values = 1.0 + 500e-6 * (levels - 20.0)
    assert run_shift(None, values, np.zeros(7), levels).uncertainty < 1e-12


def test_shift_from_repeated_levels():
    """Standard deviation about the mean of each level, pooled."""
    values = np.array([1.0, 3.0, 10.0, 10.0, 13.0, 99.0])
    levels = [20.0, 20.0, 80.0, 80.0, 80.0, -40.0]
    found = run_shift(None, values, np.zeros(6), levels)
    assert (found.source, found.dof) == ("estimated", 3.0)
    assert found.uncertainty == pytest.approx(math.sqrt((2.0 + 6.0) / 3.0))


def test_each_run_has_its_shift_from_the_others():
    values = np.array([0.0, 0.0, 9.0, 5.0])
    found = run_shift(None, values, np.zeros(4), [20.0, 20.0, 20.0, 80.0])
    assert_allclose(found.of_run, [math.sqrt(40.5), math.sqrt(40.5), 0.0, math.sqrt(27.0)])
    assert_allclose(found.dof_of_run, [1.0, 1.0, 1.0, 2.0])


def test_little_of_the_noise_is_taken_off_a_shift_of_few_degrees_of_freedom_and_nothing_of_one():
    alone = run_shift(None, np.array([1.0, 3.0]), np.ones(2), [20.0, 20.0])
    assert alone.uncertainty == pytest.approx(math.sqrt(2.0))
    of_two = run_shift(None, np.array([1.0, 2.0, 3.0]), np.ones(3), [20.0] * 3)
    assert of_two.uncertainty == pytest.approx(math.sqrt(1.0 - 0.25))
    assert run_shift(None, np.zeros(3), np.ones(3), [20.0] * 3).uncertainty == 0.0


@pytest.mark.parametrize(
    ("levels", "variances"),
    [([20.0, 80.0], [0, 0]), ([math.nan] * 2, [0, 0]), ([20.0, 20.0], [0, math.nan])],
    ids=["no level twice", "temperature unknown", "noise unknown"],
)
def test_no_shift_to_be_seen(levels, variances):
    found = run_shift(None, np.array([1.0, 2.0]), np.array(variances, dtype=float), levels)
    assert (found.source, found.uncertainty, found.dof) == ("none", 0.0, math.inf)


def test_declared_shift():
    found = run_shift(3e-5, np.array([1.0, 2.0]), np.zeros(2), [20.0, 20.0])
    assert (found.source, found.uncertainty, found.dof) == ("declared", 3e-5, math.inf)
    assert_allclose(found.of_run, 3e-5)


def two_mountings_a_run(biases, shift=None):
    angles = turn(8, 3)
    parts, runs, mountings = [], [], []
    for run, bias in enumerate(biases):
        for mounting in ("o+", "p+"):
            k = np.array(AL15)
            k[0] = AL15[1] * bias
            parts.append(forward(k, angles, 0.0, mounting))
            runs += [run] * angles.size
            mountings += [mounting] * angles.size
    whole = record(np.tile(angles, len(parts)), np.concatenate(parts), run=runs, mounting=mountings)
    apparatus = Apparatus(launch_uncertainty=shift, head_uncertainty=0.0)
    return estimate_of_record([prepare(t) for t in whole.tables()], apparatus)


def test_two_mountings_of_a_run_count_once():
    found = two_mountings_a_run([1e-3, 1.2e-3, 1.1e-3])
    assert found.bias_shift.dof == 2
    assert found.bias_shift.uncertainty == pytest.approx(1e-4, rel=1e-6)


def test_a_launch_shift_is_common_to_the_mountings_of_a_run():
    found = two_mountings_a_run([1e-3, 1e-3], shift=2e-5)
    covariance = found.components["launch"].covariance
    bias = [6 * i for i in range(4)]
    same_run = np.kron(np.eye(2), np.ones((2, 2)))
    assert_allclose(covariance[np.ix_(bias, bias)], (2e-5 * AL15[1]) ** 2 * same_run, rtol=1e-9)
    covariance = np.delete(np.delete(covariance, bias, 0), bias, 1)
    assert not covariance.any()


# -- resolution ------------------------------------------------------------------------------------


def test_a_coarse_voltmeter_adds_its_rounding():
    """Alike in all strokes, so that strokes do not average it out; below the noise it is noise."""
    angles = turn(8, 6)
    step = 1e-3
    y = np.round(forward(AL15, angles) / step) * step
    prepared = [prepare(record(angles, y))]
    coarse = estimate_of_record(prepared, Apparatus(resolution=step)).components["resolution"]
    places = turn(8)[:-1]
    # least squares of 54 readings: position 1 has twice the weight
    weight = np.array([12.0] + [6.0] * 7)
    design = rows(places)
    inverse = np.linalg.inv(design.T @ (weight[:, None] * design)) @ (weight[:, None] * design).T
    assert_allclose(coarse.covariance, step**2 / 12 * inverse @ inverse.T, rtol=1e-9, atol=1e-18)
    assert np.isinf(coarse.dof).all()
    seen = estimate_of_record(prepared, Apparatus()).components["resolution"]
    assert_allclose(seen.covariance, coarse.covariance)  # the step shows in the digits
    y = noisy(angles, 12)
    hidden = estimate_of_record([prepare(record(angles, y))], Apparatus(resolution=SIGMA / 2.0))
    assert "resolution" not in hidden.components


def test_declared_noise_does_not_hold_the_rounding():
    """Below the noise rounding is new in each reading, and a declared std knows nothing of it."""
    angles = turn(8, 6)
    y = noisy(angles, 12)
    whole = record(angles, y, std=np.full(y.size, SIGMA))
    found = estimate_of_record([prepare(whole)], Apparatus(resolution=SIGMA, head_uncertainty=0.0))
    inverse = np.linalg.pinv(rows(angles))
    expected = SIGMA**2 / 12 * inverse @ inverse.T
    assert_allclose(found.components["resolution"].covariance, expected, rtol=1e-6, atol=1e-18)


def test_residuals_that_came_out_small_do_not_hide_the_rounding():
    """One stroke: a return is rounded like the start, so the closure knows nothing of it."""
    angles = turn(8)
    held = 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        k = np.array(AL15) + rng.uniform(-1e-2, 1e-2, 6)
        y = forward(k, angles) + 1e-6 * rng.standard_normal(9)
        y = np.round(y / 1e-5) * 1e-5
        apparatus = Apparatus(resolution=1e-5, head_uncertainty=0.0)
        found = estimate_of_record([prepare(record(angles, y))], apparatus)
        expanded = interval_stack(found.components).expanded[2]
        held += abs(found.coefficients[0][2] - k[2]) <= expanded
    assert held / 300 > 0.92  # 88 % without


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3])
def test_rounding_errors_that_strokes_share_pass_for_no_errors_of_the_head(noise):
    """The means of the positions scatter by them: by one per contrast, not by hundreds."""
    angles, step, squares = turn(8, 6), 1e-3, []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        y = forward(np.array(AL15) + rng.uniform(-1e-2, 1e-2, 6), angles)
        y = step * np.round((y + noise * step * rng.standard_normal(y.size)) / step)
        prepared = [prepare(record(angles, y))]
        found = estimate_of_record(prepared, Apparatus(resolution=step, head_uncertainty=0.0))
        number, own = found.lack_of_fit.against(np.zeros(1))
        squares.append(float(own[0]) / number)
    assert 0.5 < np.mean(squares) < 1.2


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0])
def test_rounding_against_readings(noise):
    """Many strokes at many places within a step: mean error and scatter, by brute force."""
    places = np.linspace(0.0, 1.0, 400, endpoint=False) + 1.0 / 800.0
    draws = noise * np.random.default_rng(14).standard_normal((4000, 1))
    readings = np.round(places + draws)
    common = np.mean((readings.mean(axis=0) - places - draws.mean()) ** 2)
    scatter = math.sqrt(readings.var(axis=0).mean())
    assert rounding(7.0 * noise, 7.0, seen=False).common == pytest.approx(
        7.0 * math.sqrt(common), abs=0.07
    )
    assert rounding(scatter, 1.0, seen=True).common == pytest.approx(math.sqrt(common), abs=0.01)
    assert rounding(scatter, 1.0, seen=True).own == 0.0


def test_less_of_the_rounding_is_common_the_larger_the_scatter():
    common = [rounding(s, 1.0, seen=True).common for s in np.linspace(0.0, 2.0, 200)]
    assert np.all(np.diff(common) <= 0.0)
    assert common[0] == pytest.approx(12**-0.5)
    assert common[-1] < 1e-12
    assert rounding(math.nan, 1.0, seen=True).common == pytest.approx(12**-0.5)
    assert rounding(1.0, 0.0, seen=False) == (0.0, 0.0)
