"""Sums over the contrasts of many positions, against the contrasts worked out one by one."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose
from one_record import estimate_of_record

import accelcal
from accelcal.calibrate.fit import calibrate_many
from accelcal.estimate import head as head_module
from accelcal.estimate.contrasts import LackOfFit
from accelcal.estimate.head import PositionMeans, head_error, lack_of_fit
from accelcal.estimate.many_positions import ManyPositions
from accelcal.estimate.noise import noise_of_stack
from accelcal.estimate.tables import linear_estimator, prepare
from accelcal.estimate.unrepeated import told_apart
from accelcal.simulation import NOISE_FREE

ONE, SEVERAL = (20.0,), (20.0, 80.0, -40.0)


def tables_of(temperatures=ONE, strokes=2, mountings=("o+",), gaps=0.1, seed=1, head=2e-5, std=0.0):
    """Tables of 40 positions of which some readings are missing, in each table others."""
    plan = accelcal.TumblePlan(40, None, strokes, temperatures, mountings)
    noise = accelcal.NoiseComponents(head=head)
    record = accelcal.simulate(plan=plan, noise=noise, seed=seed)
    rng = np.random.default_rng(seed)
    record = record.select(rng.random(len(record)) >= gaps)
    if std:
        record = replace(record, std=std * rng.uniform(0.5, 2.0, len(record)))
    return [prepare(table) for table in record.tables()]


class Found(NamedTuple):
    """Lack of fit with contrasts and without, and the readings that both are made of."""

    dense: LackOfFit
    many: ManyPositions
    dof: float
    seen: np.ndarray  # how the errors of the positions show in the free contrasts of the means
    readings: np.ndarray  # those contrasts


def found_of(tables, monkeypatch):
    outputs = [table.record.output[None] for table in tables]
    k = [linear_estimator(t).coefficients(y) for t, y in zip(tables, outputs, strict=True)]
    noises = noise_of_stack(tables, outputs)
    dense = lack_of_fit(tables, outputs, noises, k)
    seen, readings = [], []
    for table, y, noise, own in zip(tables, outputs, noises, k, strict=True):
        means = PositionMeans.of(table, dense.positions)
        rate = means.rate @ own[0] * means.norms / noise.factor
        seen.append(means.free() * rate)
        readings.append(
            means.free() @ means.of_readings(y - own @ table.design.T)[0] / noise.factor
        )
    monkeypatch.setattr(head_module, "MANY_POSITIONS", 0)
    many = lack_of_fit(tables, outputs, noises, k)
    assert isinstance(many, ManyPositions)
    return Found(dense, many, float(noises[0].dof[0]), np.vstack(seen), np.concatenate(readings))


CASES = [
    {},
    {"std": 5e-6},
    {"strokes": 1, "gaps": 0.0},
    {"temperatures": SEVERAL},
    {"temperatures": SEVERAL, "std": 5e-6, "strokes": 1},
    {"mountings": ("o+", "o-", "p+")},
]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("size", [1e-7, 2e-5, 1e-2])  # that of 1e-2 shows 3000 times the noise
def test_errors_seen_are_the_best_linear_prediction(case, size, monkeypatch):
    found = found_of(tables_of(**case), monkeypatch)
    gain = size**2 * np.linalg.solve(
        np.eye(len(found.seen)) + size**2 * found.seen @ found.seen.T, found.seen
    )
    own = found.many.seen(np.array([size]))
    best = gain.T @ found.readings
    assert_allclose(own.values[0], best, rtol=1e-6, atol=1e-8 * np.abs(best).max())
    influence = np.random.default_rng(2).standard_normal((7, found.many.positions.size))
    by_noise, left = influence @ gain.T, influence - influence @ gain.T @ found.seen
    for a, b in (
        (own.noise(influence[None])[0], by_noise @ by_noise.T),
        (own.missed(influence[None], np.array([size]))[0], size**2 * left @ left.T),
    ):
        assert_allclose(a, b, rtol=1e-6, atol=1e-6 * np.abs(b).max())


@pytest.mark.parametrize("case", CASES)
def test_another_noise_is_another_unit(case, monkeypatch):
    many, unit = found_of(tables_of(**case), monkeypatch).many, 1.7
    noise, head = np.array([[0.7]]), np.array([[1e-10]])
    spread, squares = many.in_units_of(np.array([unit])).deviance(noise, head)
    plain, same = many.deviance(noise * unit**2, head)
    assert_allclose(squares, same, rtol=1e-9)
    assert_allclose(spread, plain - many.number[:, None] * np.log(unit**2), rtol=1e-9)


def test_without_an_error_of_the_head_all_residuals_are_noise(monkeypatch):
    found = found_of(tables_of(strokes=1, gaps=0.0), monkeypatch)
    for lack in (found.dense, found.many):
        told = told_apart(lack, found.dof, 0.0)
        assert_allclose((told.noise, told.noise_dof, told.head), [[1.0], [found.dof], [0.0]])


def test_the_largest_error_counts_with_either_sign(monkeypatch):
    many = found_of(tables_of(), monkeypatch).many
    mirrored = many._replace(shown=-many.shown)
    assert mirrored.largest() == many.largest() == pytest.approx(4e-5, rel=0.5)  # of 2e-5 in 40


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("head", [0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3])
def test_sums_are_those_over_the_contrasts(case, head, monkeypatch):
    found, noise = found_of(tables_of(**case), monkeypatch), 0.7
    variance = noise * np.eye(len(found.seen)) + head**2 * found.seen @ found.seen.T
    at = np.array([[noise]]), np.array([[head**2]])
    spread, squares = found.many.deviance(*at)
    assert spread.item() == pytest.approx(np.linalg.slogdet(variance)[1], rel=1e-9)
    left = np.linalg.solve(variance, found.readings)
    assert squares.item() == pytest.approx(found.readings @ left, rel=1e-7, abs=1e-10)
    told = noise**2 * np.sum(np.linalg.inv(variance) ** 2)
    assert found.many.information(*at).item() == pytest.approx(told, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("case", CASES)
def test_contrasts_are_held_against_what_is_allowed(case, monkeypatch):
    """As each by itself; what shows next to nothing of the head counts by parts."""
    found = found_of(tables_of(**case), monkeypatch)
    for head in (np.array([1e-6]), np.array([1e-4])):
        number, squares = found.many.against(head)
        one, other = found.dense.against(head)
        assert abs(number - one) <= 1
        assert_allclose(squares, other, atol=0.03 * one.item())


@pytest.mark.parametrize("declared", [None, 1e-5])
@pytest.mark.parametrize("head", [0.0, 3e-6, 1e-4])
def test_noise_and_head_are_told_apart_as_by_the_contrasts(declared, head, monkeypatch):
    tables = tables_of(strokes=1, gaps=0.0, head=head)
    dense, many, dof, *_ = found_of(tables, monkeypatch)
    for a, b in zip(told_apart(dense, dof, declared), told_apart(many, dof, declared), strict=True):
        assert_allclose(b, a, rtol=0.013 if declared is None else 1e-7)  # a step of the grid


@pytest.mark.parametrize("case", CASES)
def test_the_head_error_is_nearly_that_of_the_contrasts(case, monkeypatch):
    """The few contrasts that tell of the noise only remain, and hardly change it."""
    dense, many, *_ = found_of(tables_of(**case), monkeypatch)
    one, other = head_error(dense, None), head_error(many, None)
    assert other.uncertainty == pytest.approx(one.uncertainty, rel=0.03)
    assert one.dof - 20 <= other.dof <= one.dof


def test_readings_without_noise(monkeypatch):
    """The head is all that there is, by ten orders of magnitude."""
    monkeypatch.setattr(head_module, "MANY_POSITIONS", 0)
    noise = replace(NOISE_FREE, head=1e-5)
    record = accelcal.simulate(plan=accelcal.TumblePlan(40), noise=noise, seed=1)
    found = estimate_of_record([prepare(t) for t in record.tables()], record.apparatus)
    assert np.isfinite(found.components["head"].covariance).all()
    assert (found.components["reading"].variances >= 0.0).all()


def test_a_stack_is_as_each_record(monkeypatch):
    monkeypatch.setattr(head_module, "MANY_POSITIONS", 0)
    records = [accelcal.simulate(plan=accelcal.TumblePlan(40), seed=seed) for seed in range(3)]
    ((_, stack),) = calibrate_many(records).stacks
    for place, record in enumerate(records):
        one = accelcal.fit(record)
        for a, b in zip(one.tables, stack.one(place).tables, strict=True):
            assert_allclose(b.covariance, a.covariance, rtol=1e-9)
