"""What a base model leaves of an effect, by differences of readings and not by formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hidden.clock import Session
from hidden.design import Floats
from hidden.world import World, observe

LAWS = ("gain", "bias", "delta")
PLAIN = (("scale", 1e-3), ("k2", 1e-3), ("k3", 1e-3), ("cross", 1e-3))


def base_directions(world: World, session: Session) -> Floats:
    """How readings change with each coefficient of the base model, shape (n, p).

    The coefficients are K1, k0, k2, k3, delta, delta_ip at T0 and the slopes of the laws of K1, k0
    and delta on both sides. The model is linear in each, so the differences are exact.
    """
    sensor = world.sensor
    changes = [
        {name: getattr(sensor, name) + sign * step} for name, step in PLAIN for sign in (1, -1)
    ]
    for law in LAWS:
        for slope, step in (("at", 1e-3), ("above", 1e-5), ("below", 1e-5)):
            old = getattr(sensor, law)
            changes += [
                {law: replace(old, **{slope: getattr(old, slope) + sign * step})}
                for sign in (1, -1)
            ]
    seen = np.array([observe(world.having("sensor", **change), session) for change in changes])
    return (seen[::2] - seen[1::2]).T


def orthonormal(columns: Floats) -> Floats:
    """Orthonormal basis of what some columns span."""
    length = np.linalg.norm(columns, axis=0)
    left, values, _ = np.linalg.svd(columns[:, length > 0] / length[length > 0], False)
    return left[:, values > 1e-8 * values[0]]


def remainder(effect: Floats, base: Floats) -> Floats:
    """What is left of effects (n,) or (n, k) when an orthonormal base (n, p) is taken out."""
    return effect - base @ (base.T @ effect)


def noncentrality(effect: Floats, directions: Floats, covariance: Floats) -> float:
    """q: norm of the remainder of an effect in whitened coordinates."""
    white = whitened(np.column_stack([directions, effect]), covariance)
    left = remainder(white[:, -1], orthonormal(white[:, :-1]))
    return float(np.linalg.norm(left))


def whitened(columns: Floats, covariance: Floats) -> Floats:
    """Columns in coordinates in which the noise has unit covariance, shape (n, k)."""
    variances = np.diag(covariance)
    if np.count_nonzero(covariance) == len(variances):
        return columns / np.sqrt(variances)[:, None]
    return np.linalg.solve(np.linalg.cholesky(covariance), columns)


def are_distinct(effects: list[Floats], base: Floats, *, seen: float, alike: float) -> bool:
    """Whether each effect leaves a fraction `seen`, with a cosine below `alike` to the others."""
    whole = np.column_stack(effects)
    left = remainder(whole, base)
    lengths = np.linalg.norm(left, axis=0)
    if (lengths < seen * np.linalg.norm(whole, axis=0)).any():
        return False
    cosines = (left / lengths).T @ (left / lengths)
    # the diagonal of the inverse is 1 / sin^2 of the angle to the span of all others
    inverse = np.linalg.inv(cosines + 1e-12 * np.eye(len(effects)))
    return bool(np.diag(inverse).max() * (1 - alike**2) < 1.0)
