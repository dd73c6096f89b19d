"""Contrasts that several tables show of the head, against singular values of all of them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import accelcal
from accelcal.estimate.head import PositionMeans, lack_of_fit
from accelcal.estimate.noise import noise_of_stack
from accelcal.estimate.tables import prepare

IN_PROPORTION = 1.35 * np.array([0.003, 1.0, 1e-4, 9e-5, 1e-3, 2e-5])
TURNED = 1.35 * np.array([0.003, 0.8, 1e-4, 9e-5, 0.6, 2e-5])


@pytest.fixture(scope="module")
def tables():
    plan = accelcal.TumblePlan(8, None, 4, (20.0, 80.0, -40.0))
    return [prepare(table) for table in accelcal.simulate(plan=plan, seed=1).tables()]


def shown(tables, outputs, noises, coefficients, record):
    """How the errors of the positions show in all contrasts of one record, and these."""
    seen, told = [], []
    for table, y, noise, k in zip(tables, outputs, noises, coefficients, strict=True):
        means = PositionMeans.of(table, np.arange(0.0, 360.0, 45.0))
        free, factor = means.free(), noise.factor[record]
        seen.append(free * (means.rate @ k[record] * means.norms / factor))
        left = y[record] - table.design @ k[record]
        told.append(free @ means.of_readings(left[None])[0] / factor)
    return np.vstack(seen), np.concatenate(told)


@pytest.mark.parametrize("kinds", [(0,), (1,), (0, 1, 0)])
def test_contrasts_hold_all_that_shows_the_head(tables, kinds):
    rng = np.random.default_rng(3)
    outputs = [
        np.stack([table.design @ IN_PROPORTION] * len(kinds))
        + rng.normal(0.0, 1e-5, (len(kinds), len(table.record)))
        for table in tables
    ]
    noises = noise_of_stack(tables, outputs)
    turned = [np.array([(IN_PROPORTION, TURNED)[kind] for kind in kinds])] + 2 * [
        np.array([IN_PROPORTION] * len(kinds))
    ]
    found = lack_of_fit(tables, outputs, noises, turned)
    assert (found.number == [(2, 4)[kind] for kind in kinds]).all()
    for record in range(len(kinds)):
        seen, told = shown(tables, outputs, noises, turned, record)
        own = found.of_records(record)
        singular = np.linalg.svd(seen)[1]
        number = int(own.number)
        assert_allclose(np.sort(own.strengths)[::-1][:number], singular[:number], rtol=1e-9)
        assert (singular[number:] < 1e-4 * singular[0]).all()
        towards = own.directions @ (own.strengths * own.contrasts)
        assert_allclose(towards, seen.T @ told, atol=1e-9 * np.abs(seen.T @ told).max())


def test_a_record_is_the_same_among_others(tables):
    rng = np.random.default_rng(4)
    outputs = [table.design @ IN_PROPORTION + rng.normal(0.0, 1e-5, (3, 36)) for table in tables]
    noises = noise_of_stack(tables, outputs)
    k = [np.array([IN_PROPORTION, own, IN_PROPORTION]) for own in (TURNED, *2 * [IN_PROPORTION])]
    found = lack_of_fit(tables, outputs, noises, k)
    for record in range(3):
        own = slice(record, record + 1)
        alone = lack_of_fit(
            tables,
            [y[own] for y in outputs],
            [n.of_records(own) for n in noises],
            [x[own] for x in k],
        )
        part = found.of_records(own)
        shown = alone.strengths.shape[1]
        assert_allclose(part.strengths[:, :shown], alone.strengths, rtol=1e-12)
        assert_allclose(np.abs(part.contrasts[:, :shown]), np.abs(alone.contrasts), rtol=1e-9)
