"""How good a choice of angles is: the covariance that the fit will have, by angle and repetition.

A reading at an angle has noise of its own, and the error of the head at this angle, which all
readings there share in all strokes and levels. So a second reading at one angle is worth less than
one at another angle, but saves a turn. With w the variance of a position's mean, the coefficients
of one of R tables on one head have the covariance

    C = (X' W^-1 X)^-1 + (1 - 1/R) s^2 (X' N X)^-1 + shifts,

W of the means over all R tables (noise and head), N the readings in a table: what the tables have
in common is weighted by noise and head, what differs between them by the noise alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from accelcal.accelerometer import Accelerometer
from accelcal.arguments.options import check_choice
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.estimate.tables import angular_derivative
from accelcal.geometry import accelerations
from accelcal.model import COEFFICIENTS, design_matrix
from accelcal.simulation import NoiseComponents

CRITERIA = ("D", "A", *COEFFICIENTS)
"""What a choice of angles may be best for."""

_ENDLESS = 1e60


class Angles(NamedTuple):
    """Angles of a head with what a reading at each of them is worth."""

    degrees: Array  # head angles [deg], shape (a,)
    rows: Array  # of the design matrix, shape (a, 6)
    head: Array  # variance of the head error in a reading [g^2], shape (a,)
    noise: float  # variance of the noise of a reading, over the strokes [g^2]
    tables: int  # that share the head
    shifts: Array  # variances that come whatever the angles are: launch and temperature, shape (6,)


class Criterion(NamedTuple):
    """What is to be small."""

    name: str  # one of `CRITERIA`
    weights: Array  # of the variances, for A and a single coefficient, shape (6,)


def criterion_of(name: str, scales: Mapping[str, float]) -> Criterion:
    """Make one of `CRITERIA`, for A with the uncertainty of each coefficient that counts as one.

    Coefficients without one do not count in A.

    Raises
    ------
    InputError
        If the name is unknown, or A has nothing to weigh.
    """
    check_choice(CRITERIA, criterion=name)
    if name == "A" and not set(scales) & set(COEFFICIENTS):
        raise InputError(f"A needs a target for one or more of {', '.join(COEFFICIENTS)}")
    if name in COEFFICIENTS:
        scales = {name: 1.0}
    sizes = np.array([scales.get(k, np.inf) for k in COEFFICIENTS])
    return Criterion(name, sizes**-2 / np.isfinite(sizes).sum())


def seen_from(
    degrees: Array,
    noise: NoiseComponents,
    accelerometer: Accelerometer,
    *,
    strokes: int,
    tables: int,
    shifts: Array,
    mounting: str = "o+",
    resolution: float = 0.0,
) -> Angles:
    """Work out what a reading at each angle [deg], in so many strokes and tables, is worth.

    Launch and temperature shift the coefficients by variances of shape (6,). The step of the
    readings counts as noise [g].
    """
    slope = angular_derivative(degrees, 0.0, mounting) @ _nominal(accelerometer)
    variance = max(noise.reading, 1e-12) ** 2 + resolution**2 / 12.0
    return Angles(
        degrees=degrees,
        rows=design_matrix(accelerations(degrees, 0.0, mounting), mounting),
        head=np.asarray((noise.head * slope) ** 2),
        noise=variance / strokes,
        tables=tables,
        shifts=shifts,
    )


def _nominal(accelerometer: Accelerometer) -> Array:
    """Coefficients over K1, in the order of `COEFFICIENTS`."""
    bias, misalignment = accelerometer.bias.at_T0, accelerometer.misalignment.at_T0
    others = accelerometer.k2, accelerometer.k3, misalignment, accelerometer.cross_coupling
    return np.array([bias, 1.0, *others])


def covariances(angles: Angles, counts: Array) -> Array:
    """Covariance of the coefficients over K1, shape (..., 6, 6), for choices of repetitions.

    There are counts, shape (..., a), of readings at each angle in a stroke. It is infinite where
    the coefficients are not determined.
    """
    taken = counts > 0
    per_mean = angles.noise / (np.where(taken, counts, 1) * angles.tables)
    common = np.where(taken, 1.0 / (angles.head + per_mean), 0.0)
    whole = _inverses(_information(angles.rows, common))
    if angles.tables > 1:
        share = 1.0 - 1.0 / angles.tables
        whole = whole + share * _inverses(_information(angles.rows, counts / angles.noise))
    return np.asarray(whole + np.diag(angles.shifts))


def _information(rows: Array, weights: Array) -> Array:
    pairs = (rows[:, :, None] * rows[:, None, :]).reshape(rows.shape[0], -1)
    size = rows.shape[1]
    return (np.asarray(weights) @ pairs).reshape(*weights.shape[:-1], size, size)


def _inverses(information: Array) -> Array:
    """Inverses of matrices, infinite for those that have none."""
    scale = np.sqrt(np.linalg.diagonal(information))
    scale = np.where(scale > 0.0, scale, 1.0)
    scaled = information / (scale[..., :, None] * scale[..., None, :])
    good = np.linalg.det(scaled) > 1e-12
    safe = np.where(good[..., None, None], scaled, np.eye(scaled.shape[-1]))
    found = np.linalg.inv(safe) / (scale[..., :, None] * scale[..., None, :])
    return np.asarray(np.where(good[..., None, None], found, _ENDLESS * np.eye(scaled.shape[-1])))


def losses(criterion: Criterion, covariance: Array) -> Array:
    """What is to be small, as a standard uncertainty, of covariances of shape (..., 6, 6).

    For D it is the sixth root of the root of the determinant, for A the root mean square of the
    uncertainties over their scales, else the uncertainty of the coefficient.
    """
    if criterion.name == "D":
        sign, logarithm = np.linalg.slogdet(covariance)
        return np.asarray(np.where(sign > 0, np.exp(logarithm / (2 * len(COEFFICIENTS))), np.inf))
    variances = np.linalg.diagonal(covariance)
    return np.asarray(np.sqrt(variances @ criterion.weights))
