"""The factor of a band that holds along a whole curve, held against what is known of it."""

import numpy as np
import pytest

from accelcal.numerics.probability import path_length, simultaneous_quantile, student_quantile

TRIALS = 40_000
POWERS = np.linspace(-1.0, 1.0, 41)[:, None] ** np.arange(4)


@pytest.mark.parametrize("dof", [3.0, 12.0, np.inf])
def test_a_cubic_stays_within_its_band_in_95_percent(dof):
    rng = np.random.default_rng(1)
    curve = POWERS @ rng.standard_normal((4, 4))
    factor = simultaneous_quantile(0.95, dof, path_length(curve @ curve.T))
    errors = rng.standard_normal((TRIALS, 4)) @ curve.T / np.sqrt((curve**2).sum(axis=1))
    if np.isfinite(dof):
        errors /= np.sqrt(rng.chisquare(dof, (TRIALS, 1)) / dof)
    held = np.mean(np.abs(errors).max(axis=1) <= factor)
    assert 0.945 <= held <= 0.975
    assert factor > 1.1 * student_quantile(0.95, dof)


def test_a_path_without_length_has_the_factor_of_one_point():
    assert simultaneous_quantile(0.95, 7.0, 0.0) == pytest.approx(student_quantile(0.95, 7.0))


def test_points_without_an_error_have_no_place_on_the_path():
    points = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 2.0]])
    assert path_length(points @ points.T) == pytest.approx(np.pi / 2.0)
