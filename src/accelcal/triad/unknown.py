"""Attitudes unknown: all that is known is |a| = 1 g, so the outputs lie on an ellipsoid.

y = b + S a with any a of length 1. A rotation of a leaves the outputs as they are, so S is known
but for a rotation, and a frame must be agreed: in ``"x"`` the sensitive axis of channel x is the
axis x, and that of channel y lies in the plane xy (S is lower triangular); in ``"z"`` that of z is
the axis z, and that of y lies in the plane yz (S is upper triangular).

The fit is by maximum likelihood with the attitudes among the unknowns: each a is the one that
brings the ellipsoid nearest to the outputs, and the parameters make the sum of squares of the
distances least. The algebraic fit of a quadric, which is linear, is biased by the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import DesignError
from accelcal.results.triad import NAMES
from accelcal.triad.solution import Scatter, Solution, design_of

FRAMES = ("x", "z")

_STEPS = 100
_DONE = 1e-10  # relative gain, or step, that is the last
_ROUNDING = 1e-12
_FLATTEST = 0.05  # range of a channel over the largest range, below which it was hardly turned
_REMEDY = (
    "turn the block so that up takes all directions in it, also halfway between two of its axes,"
    " and give mean outputs at rest"
)


class _Distance(NamedTuple):
    """Signed distance of each output from the ellipsoid [g], and its derivatives."""

    value: Array
    jacobian: Array

    @property
    def cost(self) -> float:
        return float(self.value @ self.value)


def from_unknown_attitudes(output: Array, frame: str, *, aligned: bool = False) -> Solution:
    """Calibrate a triad whose attitudes are not known, by outputs of shape (n, 3) [output unit].

    The frame is that in which the sensitivity is told. Nine parameters are found, or six with the
    sensitive axes `aligned`, taken as perpendicular: three scale factors are left of S.

    Raises
    ------
    DesignError
        If there are too few attitudes, or they leave a parameter open.

    Notes
    -----
    The channels count alike, once each is divided by its scale factor; the intervals are to hold
    where noise is alike in all of them, and where it is that of one channel alone. The mean of
    |a + noise| is 1 + s^2 g, with s the noise of a channel in g: S is divided by it.
    """
    free = _free(frame, aligned)
    if len(output) < len(free):
        raise DesignError(
            f"{len(output)} attitudes; |a| = g tells {len(free)} parameters by {len(free)} of them"
            " or more"
        )
    middle, half = _range(output)
    parameters = _start((output - middle) / half)
    weight = np.ones(3)
    for _ in range(3):  # the weights of the channels follow from the scale factors that are found
        parameters = _fitted((output - middle) / half, parameters, free, weight)
        weight = 1.0 / np.linalg.norm(_sensitivity(parameters), axis=1)
    return _solution(output, middle, half, parameters, free)


def _free(frame: str, aligned: bool) -> tuple[int, ...]:
    kept = np.eye(3) if aligned else np.tri(3) if frame == "x" else np.tri(3).T
    return (0, 1, 2, *(3 + np.flatnonzero(kept)).tolist())


def _range(output: Array) -> tuple[Array, Array]:
    low, high = output.min(axis=0), output.max(axis=0)
    half = (high - low) / 2.0
    flat = np.flatnonzero(half <= _FLATTEST * half.max())
    if flat.size:
        name = "xyz"[int(flat[0])]
        raise DesignError(f"output {name} hardly changes over the attitudes; {_REMEDY}")
    return (low + high) / 2.0, half


def _start(u: Array) -> Array:
    """Parameters of the sphere through the outputs: |u|^2 = 2 b.u + r^2 - |b|^2."""
    design = np.column_stack([2.0 * u, np.ones(len(u))])
    found, *_ = np.linalg.lstsq(design, np.sum(u**2, axis=1))
    radius = np.sqrt(max(found[3] + found[:3] @ found[:3], 0.1))
    return np.concatenate([found[:3], radius * np.eye(3).ravel()])


def _sensitivity(parameters: Array) -> Array:
    return parameters[3:].reshape(3, 3)


def _fitted(u: Array, start: Array, free: Sequence[int], weight: Array) -> Array:
    """Gauss-Newton with the damping of Levenberg and Marquardt."""
    chosen = list(free)
    parameters, here, damping = start, _distance(u, start, weight), 1e-3
    for _ in range(_STEPS):
        jacobian = here.jacobian[:, chosen]
        normal, slope = jacobian.T @ jacobian, jacobian.T @ here.value
        step = np.linalg.lstsq(normal + damping * np.diag(np.diagonal(normal)), slope)[0]
        trial = parameters.copy()
        trial[chosen] -= step
        there = _distance(u, trial, weight)
        if there.cost <= here.cost:
            gain = here.cost - there.cost
            parameters, here, damping = trial, there, damping / 10.0
            if gain <= _DONE * here.cost or np.abs(step).max() < _DONE:
                break
        elif damping > 1e8:
            break
        else:
            damping *= 10.0
    return parameters


def _distance(u: Array, parameters: Array, weight: Array) -> _Distance:
    """Distance in coordinates where every channel is multiplied by its weight."""
    shape = weight[:, None] * _sensitivity(parameters)
    off = (u - parameters[:3]) * weight
    attitude = _nearest(off, shape)
    normal = attitude @ np.linalg.pinv(shape)  # normal to |S^-1 y| = 1 at S a
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    value = np.sum(normal * (off - attitude @ shape.T), axis=1)
    by_bias = -normal * weight
    by_shape = by_bias[:, :, None] * attitude[:, None, :]
    return _Distance(value, np.hstack([by_bias, by_shape.reshape(len(u), 9)]))


def _nearest(off: Array, shape: Array) -> Array:
    """Attitudes a of length 1 that bring `shape` a nearest to the outputs, by Newton's method.

    (S^T S + m) a = S^T y with the multiplier m that makes |a| = 1; 1/|a| is nearly linear in m.
    """
    squares, axes = np.linalg.eigh(shape.T @ shape)
    pull = off @ shape @ axes
    m = np.maximum(np.linalg.norm(pull, axis=1) - squares[-1], 1e-9 - squares[0])
    for _ in range(12):
        a = pull / (squares + m[:, None])
        length = np.maximum(np.linalg.norm(a, axis=1), 1e-12)
        if np.abs(length - 1.0).max() < _ROUNDING:
            break
        slope = np.sum(a**2 / (squares + m[:, None]), axis=1) / length**3
        m = np.maximum(m + (1.0 - 1.0 / length) / np.maximum(slope, 1e-12), 1e-9 - squares[0])
    return np.asarray((a / length[:, None]) @ axes.T)


def _solution(
    output: Array, middle: Array, half: Array, parameters: Array, free: tuple[int, ...]
) -> Solution:
    bias = middle + half * parameters[:3]
    sensitivity = half[:, None] * _sensitivity(parameters)
    scale = np.linalg.norm(sensitivity, axis=1)
    found = _distance(output, np.concatenate([bias, sensitivity.ravel()]), 1.0 / scale)
    unit = np.concatenate([scale, np.repeat(scale, 3)])[list(free)]  # 1 g in each channel
    names = tuple(NAMES[i] for i in free)
    design = design_of(found.jacobian[:, list(free)] * unit, names, _REMEDY)
    scatter = Scatter(
        left=found.value,
        reach=unit[:, None] * design.inverse,
        basis=design.basis,
        shapes=np.vstack([np.ones(len(output)), found.jacobian[:, :3].T ** 2]),
    )
    sensitivity = sensitivity / (1.0 + found.cost / max(scatter.dof, 1))
    return Solution(
        bias=bias,
        sensitivity=sensitivity,
        free=free,
        covariance=scatter.covariance(),
        residual=np.linalg.norm(np.linalg.solve(sensitivity, (output - bias).T), axis=0) - 1.0,
        design=design,
        scatter=scatter,
    )
