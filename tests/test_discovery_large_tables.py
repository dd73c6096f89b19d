"""Discovery in tables of thousands of readings: nothing grows as their square."""

import tracemalloc
from functools import cache

import numpy as np
import pytest
from dense_covariance import matrix_of, whitening_matrix
from numpy.testing import assert_allclose

import accelcal
from accelcal.discovery.columns import orthonormal
from accelcal.discovery.comparison import compared
from accelcal.discovery.instance import MOST_VALUES, candidates, instances_of
from accelcal.discovery.noise.of_readings import _fourth_powers
from accelcal.discovery.noise.pure_error import pure_error, smooth
from accelcal.discovery.solution import _folds
from accelcal.discovery.space import Covariance, whitener_of
from accelcal.errors import InputError

AT_390 = ("bias-step", 4e-5, {"reading": 390.0})


def simulated(strokes, *effects, temperatures=(20.0, 80.0, -40.0), **options):
    plan = accelcal.TumblePlan(8, None, strokes, temperatures)
    found = [accelcal.effect(name).of(size, **values) for name, size, values in effects]
    return accelcal.simulate(plan=plan, effects=found, **options)


@cache
def discovered_step():
    return accelcal.discover(simulated(30, AT_390, seed=1))


def mixed(rho, size=30.0):
    """Errors of 30 readings in three runs, not in the order of measuring, some not there."""
    rng = np.random.default_rng(0)
    return Covariance(
        noise=rng.uniform(0.5, 2.0, 30),
        rho=rho,
        run=np.repeat([0, 1, 2], 10),
        number=rng.permutation(60)[:30],
        shared=size * rng.normal(size=(30, 4)),
    )


@pytest.mark.parametrize("rho", [-0.3, 0.0, 0.6])
@pytest.mark.parametrize("size", [0.0, 30.0])
def test_whitened_errors_are_independent(rho, size):
    covariance = mixed(rho, size)
    whitener, all_of = whitener_of(covariance), np.eye(30)
    white, back = whitener.whitened(all_of), whitener.unwhitened(all_of)
    assert_allclose(white @ matrix_of(covariance) @ white.T, all_of, atol=1e-9)
    assert_allclose(back @ back.T, matrix_of(covariance), atol=1e-9)
    assert_allclose(white @ back, all_of, atol=1e-11)
    assert_allclose(whitener.transposed(all_of), white.T, atol=1e-13)
    assert_allclose(whitener.whitened(all_of[:, 3]), white[:, 3], atol=1e-13)
    assert_allclose(whitener.unwhitened(all_of[:, 3]), back[:, 3], atol=1e-13)


def test_some_of_the_readings_have_the_covariance_that_they_had():
    covariance, own = mixed(0.6), np.arange(30) % 4 > 0
    assert_allclose(matrix_of(covariance.among(own)), matrix_of(covariance)[np.ix_(own, own)])
    columns = np.ones((30, 1))
    assert_allclose(matrix_of(covariance.with_shared(columns)), matrix_of(covariance) + 1.0)


def test_shared_errors_in_which_the_noise_is_lost_are_refused():
    with pytest.raises(InputError, match="too large beside a noise of the readings"):
        whitener_of(mixed(0.0, 1e12))


@pytest.mark.parametrize("declare", [True, False])
def test_squares_in_the_space_are_those_of_generalised_least_squares(declare):
    look = compared(simulated(6, ("backlash", 2e-5, {}), seed=1, declare=declare), 20.0)
    white = whitening_matrix(look.spread)
    base = white @ look.model.jacobian(look.parameters)
    residual = white @ look.model.residual(look.parameters)
    base /= np.maximum(np.linalg.norm(base, axis=0), 1e-300)
    left = residual - base @ np.linalg.lstsq(base, residual, rcond=1e-9)[0]
    assert look.seen @ look.seen == pytest.approx(left @ left, rel=1e-6)


def test_fourth_powers_of_a_projector_are_summed_over_some_of_many_rows(monkeypatch):
    basis = orthonormal(np.random.default_rng(1).normal(size=(700, 20)))
    whole = ((np.eye(700) - basis @ basis.T) ** 4).sum()
    assert _fourth_powers(basis) == pytest.approx(whole, rel=1e-12)
    monkeypatch.setattr("accelcal.discovery.noise.of_readings._ROWS", 300)
    assert _fourth_powers(basis) == pytest.approx(whole, rel=0.01)


def test_steps_take_what_their_columns_take():
    record = simulated(6, seed=1)
    c = compared(record, 20.0).model.conditions
    weight = np.linspace(1.0, 2.0, len(record))
    view = pure_error(record.output * weight, smooth(c, record.mounting) * weight[:, None])
    own = c.order[c.run[c.order] == 1]
    steps = (c.run == 1)[:, None] & (c.number[:, None] >= c.number[own[1:]])
    assert_allclose(
        view.gains_of_steps(own, weight), view.gains(steps * weight[:, None]), rtol=1e-6
    )


def test_cycles_beyond_ten_are_left_out_several_at_a_time():
    look = compared(simulated(50, temperatures=(20.0,), seed=1), 20.0)
    folds = list(_folds(look, np.random.default_rng(0)))
    assert len(folds) == 10
    assert (np.sum(folds, axis=0) == 1).all()


def test_a_step_among_very_many_readings_is_told_to_the_reading():
    """The first search tries some of its moments, the next one all around the best."""
    record = simulated(30, AT_390, seed=1)
    look = compared(record, 20.0)
    step = accelcal.effect("bias-step")
    found = candidates([step], look.space, look.model.conditions)
    assert MOST_VALUES - 4 < len(found.instances) <= MOST_VALUES < len(record) - 20
    tried = [item.shape["reading"] for item in found.instances]
    assert 390.0 not in tried
    (told,) = discovered_step().effects
    assert told.parameters["reading"].value == 390.0


def test_a_fit_finds_a_step_at_another_place_to_the_reading():
    """It was at the nearest moment of the first search, beside which another one showed."""
    record = simulated(30, ("bias-step", 2e-4, {"reading": 501.0}), seed=2)
    c = compared(record, 20.0).model.conditions
    assert 501.0 not in [
        item.shape["reading"] for item in instances_of(accelcal.effect("bias-step"), c)
    ]
    found = accelcal.fit(record, model=discovered_step())
    assert found.effects[0].parameters["reading"].value == 501.0
    assert not any("show another one" in text for text in found.warnings)


def test_discovery_takes_no_matrix_of_readings_by_readings():
    """At 3240 readings one took 84 MB, and there were ten of them; a draw of noise took 104 MB."""
    record = simulated(120, ("backlash", 2e-5, {}), temperatures=(20.0,), seed=1)
    accelcal.discover(simulated(6, seed=1))  # what is loaded and kept is not counted
    tracemalloc.start()
    try:
        found = accelcal.discover(record)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert [item.id for item in found.effects] == ["backlash"]
    assert peak < 70e6  # 53 MB, and a matrix of all 1080 readings by all is 9 MB
    assert found.readings == 1080
