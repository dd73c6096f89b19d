"""Equation (1), written out reading by reading, and textbook least squares.

Slow and plain on purpose; nothing here comes from accelcal but the container of the readings.
"""

import math

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.record import TumbleRecord

NAMES = ("K0", "K1", "K2", "K3", "M", "M_ip")
AL15 = (4.4874e-3, 1.35, 1.4175e-4, 1.17e-4, 1.5525e-3, 2.7e-5)
"""The paper's accelerometer in mA: k0 3.324 mg, k2 105 ug/g^2, k3 87 ug/g^3, delta 1.15 mrad."""

UNITY = (0.9, -1.3, 0.7, 1.1, -0.6, 0.8)
"""No accelerometer, but all coefficients show their relative error."""


def axes(angle, delta0=0.0, mounting="o+"):
    """Accelerations along the input axis and the cross axis in the rotation plane [g]."""
    theta = math.radians(angle) + delta0
    side = -1.0 if mounting.endswith("-") else 1.0
    return math.cos(theta), side * math.sin(theta)


def rows(angles, delta0=0.0, mounting="o+"):
    """Factors of the six coefficients in each reading."""
    along = [axes(angle, delta0, mounting) for angle in angles]
    return np.array([[1.0, i, i * i, i * i * i, c, i * c] for i, c in along])


def rates(angles, delta0=0.0, mounting="o+"):
    """Derivatives of `rows` by the head angle [1/rad]."""
    side = -1.0 if mounting.endswith("-") else 1.0
    found = []
    for angle in angles:
        i, c = axes(angle, delta0, mounting)
        di, dc = -side * c, side * i
        found.append([0.0, di, 2 * i * di, 3 * i * i * di, dc, di * c + i * dc])
    return np.array(found)


def forward(k, angles, delta0=0.0, mounting="o+"):
    """Outputs by equation (1), each summed exactly and rounded once."""
    table = rows(angles, delta0, mounting)
    return np.array([math.fsum(a * b for a, b in zip(row, k, strict=True)) for row in table])


def turn(positions, strokes=1):
    """Head angles of forward and back strokes through a whole turn, return included [deg]."""
    there = [360.0 * j / positions for j in range(positions + 1)]
    return np.concatenate([there if stroke % 2 == 0 else there[::-1] for stroke in range(strokes)])


def record(angles, output, *, mounting="o+", run=0, temperature=20.0, **more):
    """A record of one run, or of several where `run` and the like are arrays."""
    n = len(angles)
    runs = np.broadcast_to(np.asarray(run, dtype=np.int64), n).copy()
    return TumbleRecord(
        output=np.asarray(output, dtype=float).copy(),
        angle=np.asarray(angles, dtype=float).copy(),
        temperature=np.broadcast_to(np.asarray(temperature, dtype=float), n).copy(),
        stroke=np.ones(n, dtype=np.int64),
        run=runs,
        run_labels=tuple(str(i + 1) for i in range(runs.max() + 1)),
        mounting=np.broadcast_to(np.asarray(mounting), n).copy(),
        position=np.zeros(n, dtype=np.int64),
        **{k: None if v is None else np.array(v, dtype=float) for k, v in more.items()},
    )


def generalised_least_squares(design, y, covariance):
    """Coefficients and their covariance by the inverse of the whole covariance of the readings."""
    whitened = np.linalg.inv(covariance)
    inverse = np.linalg.inv(design.T @ whitened @ design)
    return inverse @ design.T @ whitened @ y, inverse


__all__ = [
    "AL15",
    "NAMES",
    "UNITY",
    "Apparatus",
    "axes",
    "forward",
    "generalised_least_squares",
    "rates",
    "record",
    "rows",
    "turn",
]
