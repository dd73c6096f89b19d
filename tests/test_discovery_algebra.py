"""What discovery works out without large matrices, beside the same with them."""

from dataclasses import replace

import numpy as np
import pytest
from dense_covariance import matrix_of
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import f

import accelcal
from accelcal.discovery.columns import cycle_of, first_largest, orthonormal, saturated
from accelcal.discovery.comparison import compared
from accelcal.discovery.explanation import chance_beside
from accelcal.discovery.family import family_of, judge
from accelcal.discovery.instance import column_of, instance_of
from accelcal.discovery.noise.of_readings import _RHOS, _autocorrelation, memory, reading_noise
from accelcal.discovery.solution import _folds, held_out_rms


def with_memory(rho, **options):
    """A record whose noise is a process of first order in each run, larger than all else."""
    record = accelcal.simulate(plan=accelcal.TumblePlan(**options), seed=5)
    draws = np.random.default_rng(2).normal(0.0, 3e-5, len(record))
    noise = np.zeros(len(record))
    for i, run in enumerate(record.run):
        noise[i] = draws[i] + (rho * noise[i - 1] if i and record.run[i - 1] == run else 0.0)
    return replace(record, output=record.output + noise)


@pytest.mark.parametrize("rho", [0.0, 0.6])
@pytest.mark.parametrize("ids", [(), ("backlash",), ("backlash", "fourth-order")])
def test_readings_left_out_are_predicted_as_by_a_fit_without_them(rho, ids):
    look = compared(with_memory(rho, strokes=4), 20.0)
    assert (look.noise.rho > 0.3) == (rho > 0.3)
    c, model = look.model.conditions, look.model
    effects = [instance_of(accelcal.effect(name).of(1e-5)) for name in ids]
    columns = [model.jacobian(look.parameters), *(column_of(item, c) for item in effects)]
    columns, residual = np.column_stack(columns), model.residual(look.parameters)
    missed = []
    for out in _folds(look, np.random.default_rng(0)):
        factor = cho_factor(matrix_of(look.spread)[np.ix_(~out, ~out)])
        normal = columns[~out].T @ cho_solve(factor, columns[~out])
        solved = np.linalg.solve(normal, columns[~out].T @ cho_solve(factor, residual[~out]))
        missed.append(residual[out] - columns[out] @ solved)
    expected = np.sqrt(np.mean(np.concatenate(missed) ** 2))
    assert len(missed) == 2
    assert held_out_rms(look, [effects])[0] == pytest.approx(expected, rel=1e-6)


def test_a_factor_is_judged_by_its_span_whichever_columns_span_it():
    """Rounding turns these where singular values are alike, otherwise on each processor."""
    plan = accelcal.TumblePlan(temperatures=(20.0, 50.0, 80.0, 50.0, 20.0))
    look = compared(accelcal.simulate(plan=plan, seed=1), 20.0)
    family, rng = family_of(look, [accelcal.effect("backlash")]), np.random.default_rng(0)
    turned = [
        block._replace(basis=block.basis @ np.linalg.qr(rng.normal(size=(k, k)))[0])
        for block in family.blocks
        for k in block.basis.shape[1:]
    ]
    chances = [judge(one).blocks for one in (family, family._replace(blocks=tuple(turned)))]
    assert chances[1] == pytest.approx(chances[0], rel=1e-6)


def test_chance_of_columns_beside_others_is_that_of_the_larger_of_two_fits():
    """The noise is that beside both, as a bend that is not noise would hide itself in it."""
    look = compared(accelcal.simulate(seed=1), 20.0)
    draws = look.space.left_of(np.random.default_rng(4).normal(size=(look.seen.size, 3)))
    strong = 5.0 * look.seen / np.linalg.norm(look.seen)
    for columns in (draws[:, 1:], np.column_stack([draws[:, 1], strong])):
        fits = (draws[:, :1], np.column_stack([draws[:, 0], columns]))
        left = [look.seen - own @ np.linalg.pinv(own) @ look.seen for own in fits]
        repeats = look.space.systematic
        pure = left[1] - repeats @ (repeats.T @ left[1])
        gained = float(left[0] @ left[0] - left[1] @ left[1]) / 2.0
        expected = f.sf(gained / (pure @ pure / look.space.dof), 2, look.space.dof)
        beside = orthonormal(draws[:, :1])
        assert chance_beside(look, columns, beside) == pytest.approx(max(expected, 1e-300))
    assert chance_beside(look, draws[:, :1], orthonormal(draws)) == 1.0


@pytest.mark.parametrize("rho", [-0.4, 0.0, 0.7])
def test_memory_is_a_power_of_the_distance_within_a_run(rho):
    record = accelcal.simulate(plan=accelcal.TumblePlan(strokes=4), seed=1)
    c = compared(record, 20.0).model.conditions
    order = np.random.default_rng(1).permutation(len(record))
    c = replace(c, run=c.run[order], number=c.number[order])
    relative = np.linspace(1.0, 2.0, len(record))
    found = memory(c, rho, relative)
    for i in range(0, len(record), 7):
        for j in range(len(record)):
            apart = abs(int(c.number[i]) - int(c.number[j]))
            expected = rho**apart if c.run[i] == c.run[j] else 0.0
            assert found[i, j] == pytest.approx(expected * relative[i] * relative[j])


def test_correlation_is_that_of_the_pure_error():
    """The lag-1 sum of the pure error has its expectation, a trace of dense matrices here."""
    record = with_memory(0.6, strokes=8)
    c = compared(record, 20.0).model.conditions
    basis = orthonormal(saturated(c, record.mounting))[c.order]
    run = c.run[c.order]
    left = np.eye(run.size) - basis @ basis.T
    error = left @ record.output[c.order]
    rho, variance, _ = _autocorrelation(error, basis, run)
    near = np.diag(0.5 * (run[1:] == run[:-1]), 1)
    near = near + near.T

    def expected(rho):
        process = memory(replace(c, run=run, number=np.arange(run.size)), rho)
        process *= np.abs(np.subtract.outer(range(run.size), range(run.size))) < 40
        return np.trace(left @ near @ left @ process) / np.trace(left @ process)

    observed = error @ near @ error / (error @ error)
    step = _RHOS[1] - _RHOS[0]
    assert abs(expected(rho) - observed) <= abs(expected(rho + step) - observed)
    assert abs(expected(rho) - observed) <= abs(expected(rho - step) - observed)
    process = memory(replace(c, run=run, number=np.arange(run.size)), rho)
    assert variance == pytest.approx(error @ error / np.trace(left @ process), rel=1e-4)
    assert reading_noise(c, record.output, saturated(c, record.mounting), 0.0).rho == rho


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.6, 0.8])
def test_a_correlation_is_among_those_that_are_possible(rho):
    """A twelfth of the tables have it above all of them, few readings of one run hardly more."""
    record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0,)), seed=1)
    c = compared(record, 20.0).model.conditions
    basis = orthonormal(saturated(c, record.mounting))[c.order]
    root = np.linalg.cholesky(memory(replace(c, number=np.arange(c.run.size)), rho))
    draws = np.random.default_rng(3).standard_normal((600, c.run.size)) @ root.T
    errors = draws - draws @ basis @ basis.T
    possible = np.array([_autocorrelation(error, basis, c.run)[2] for error in errors])
    assert possible.shape == (600, 6)
    assert 0.05 < np.mean(possible[:, -1] < rho) < 0.16
    assert np.mean(possible[:, 0] > rho) < 0.12


def test_effects_that_readings_cannot_tell_apart_come_in_the_order_of_the_catalogue():
    """Rounding, which depends on the processor, does not choose the name."""
    for seed in range(2):
        for name, size in (("fourth-order", 9e-5), ("scale-factor-asymmetry", 1.2e-4)):
            record = accelcal.simulate(effects=[accelcal.effect(name).of(size)], seed=seed)
            found = accelcal.discover(record).effects
            assert [one.id for one in found] == ["scale-factor-asymmetry"]
            assert "fourth-order" in found[0].indistinguishable


def test_the_first_of_what_is_alike_but_for_rounding():
    assert first_largest(np.array([1.0, 2.0, 2.0 + 1e-12, 1.5])) == 1
    assert first_largest(np.array([1.0, 2.0, 2.0 + 1e-6, 1.5])) == 2
    assert first_largest(np.zeros(3)) == 0


def test_what_grows_with_the_temperature_is_no_pattern_of_the_position_alone():
    """The scale factor of the levels differs, and the columns of the factors with it."""
    hidden = accelcal.effect("k2-temperature").of(2e-6)
    found = accelcal.discover(accelcal.simulate(effects=[hidden], seed=1))
    share = {each.factor: each.share for each in found.where}
    assert share["temperature*position"] > 0.9
    assert share["position"] < 0.02


def test_cycles_of_a_long_run_are_told_apart_by_stretches():
    stroke = np.arange(1, 97)
    assert np.array_equal(cycle_of(stroke), np.repeat(np.arange(24), 4))
    assert np.array_equal(cycle_of(stroke[:48]), np.repeat(np.arange(24), 2))
    assert cycle_of(stroke[:50]).max() == 23


def test_what_readings_are_held_against_does_not_grow_with_a_run():
    """Cycles of their own made the work grow by the third power, and memory by the second."""
    wide = {
        saturated(comparison.model.conditions, comparison.record.mounting).shape[1]
        for comparison in (
            compared(accelcal.simulate(plan=accelcal.TumblePlan(strokes=strokes), seed=1), 20.0)
            for strokes in (48, 96)
        )
    }
    assert len(wide) == 1


def test_a_basis_is_found_where_the_quick_way_of_lapack_does_not_converge(monkeypatch):
    """A record of 2160 readings ended in an error of LAPACK when it was compared."""

    def fails(_):
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    columns = np.column_stack([np.eye(5)[:, :3], np.eye(5)[:, 1:3].sum(axis=1)])
    monkeypatch.setattr(np.linalg, "eigh", fails)
    basis = orthonormal(columns)
    np.testing.assert_allclose(basis @ basis.T, np.diag([1.0, 1.0, 1.0, 0.0, 0.0]), atol=1e-12)
