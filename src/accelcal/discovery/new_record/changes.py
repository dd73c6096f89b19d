"""What has changed in each run since a calibration, with intervals.

The differences of a run are fitted with the weights of generalised least squares, in whose
covariance what few degrees of freedom tell counts as larger. The interval of a change has each part
of its variance as it is told, and Student's factor for the mean of their degrees of freedom,
harmonic and weighted by their shares, as `accelcal.estimate.uncertainty` has it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.new_record.calibration_errors import CalibrationErrors
from accelcal.discovery.new_record.simulated import Simulated
from accelcal.discovery.noise.covariance import Covariance, whitener_of
from accelcal.model import CROSS_AXES
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.numerics.sorting import distinct
from accelcal.record import TumbleRecord
from accelcal.results.disagreement import RunChange
from accelcal.results.quantity import Quantity

_RANK = 1e-9
"""Singular value, over the largest one, below which readings do not tell a combination."""

_TOLD = 1e-6
"""A change is told where less than this part of it may be that of another one."""


class Uncertain(NamedTuple):
    """What makes the differences of n readings and their simulation uncertain.

    Attributes
    ----------
    spread : Covariance
        Their covariance, in which what few degrees of freedom tell counts as larger.
    sigma, dof : float
        Noise of a reading [g], and its degrees of freedom.
    errors : CalibrationErrors
        Errors of the calibration.
    larger : ndarray, shape (18, 18)
        Their covariance as it is in `spread`.
    by_head : ndarray, shape (n, k)
        What the errors of the head positions of the record do, of the size that they have in
        `spread` [g].
    head_factor, head_dof : float
        This size over the estimate of it, and the degrees of freedom of that.
    one_head : bool
        Whether what they did to the calibration is in `by_head`.
    """

    spread: Covariance
    sigma: float
    dof: float
    errors: CalibrationErrors
    larger: Array
    by_head: Array
    head_factor: float
    head_dof: float
    one_head: bool


def changes(record: TumbleRecord, simulated: Simulated, known: Uncertain) -> Iterator[RunChange]:
    """Fit bias, scale factor and misalignment of each run beside those of the calibration.

    There are two of a run with readings in both cross axes, of which each has a misalignment.
    """
    c, residual = simulated.conditions, simulated.residual
    columns = c.gain[:, None] * np.stack([np.ones_like(c.input), c.indicated, c.cross], axis=1)
    for label, own in _runs_and_axes(record):
        weights, variances, told = _weights(columns, known.spread, own)
        bias, scale_factor, misalignment = (
            _quantity(float(w @ residual), variance, w, simulated.by_error.T @ w, known, unit)
            if is_told
            else Quantity(None, None, unit)
            for w, variance, unit, is_told in zip(
                weights, variances, ("g", "1", "rad"), told, strict=True
            )
        )
        level = record.select(own).mean_temperature
        yield RunChange(
            run=label,
            temperature_degC=level if np.isfinite(level) else None,
            rms=float(np.sqrt(np.mean(residual[own] ** 2))),
            bias=bias,
            scale_factor=scale_factor,
            misalignment=misalignment,
            mounting=", ".join(distinct(record.mounting[own]).tolist()),
        )


def _weights(columns: Array, spread: Covariance, own: Mask) -> tuple[Array, Array, Mask]:
    """Weights of the readings in each change of a run, (3, n), its variance and if it is told."""
    whitener = whitener_of(spread.among(own))
    inverse = np.asarray(np.linalg.pinv(whitener.whitened(columns[own]), rcond=_RANK))
    weights = np.zeros((columns.shape[1], columns.shape[0]))
    weights[:, own] = whitener.transposed(inverse.T).T
    told = np.abs(weights @ columns - np.eye(columns.shape[1])).max(axis=1) < _TOLD
    return weights, (inverse**2).sum(axis=1), np.asarray(told)


def _runs_and_axes(record: TumbleRecord) -> Iterator[tuple[str, Mask]]:
    """Readings of each run and cross axis."""
    for index, label in enumerate(record.run_labels):
        for axis in CROSS_AXES:
            own = (record.run == index) & np.char.startswith(record.mounting, axis)
            if own.any():
                yield label, own


def _quantity(
    value: float, whole: float, w: Array, v: Array, known: Uncertain, unit: str
) -> Quantity:
    """Quantity of the weights w of the readings, and v of the errors of the calibration.

    It has no value where an error is among these that nothing bounds.
    """
    errors = known.errors
    if np.any(np.abs(v[errors.unbounded]) > _TOLD):
        return Quantity(None, None, unit)
    noise = known.sigma**2 * (w @ w)
    counted = ((w @ known.by_head) ** 2).sum()
    head = counted / known.head_factor**2
    of_head = 0.0 if known.one_head else ((v @ errors.of_head) ** 2).sum()
    rest = v @ errors.rest @ v + (errors.hysteresis * v[0]) ** 2
    too_large = counted - head + v @ known.larger @ v - of_head - rest
    variance = whole - too_large
    shares = v**2 * np.diagonal(errors.rest)
    mean = (shares / errors.freedom).sum() / (shares.sum() or 1.0)
    over_dof = noise / known.dof + head / known.head_dof + of_head / errors.head_dof + rest * mean
    dof = float(variance / over_dof) if over_dof > 0.0 else np.inf
    u = float(variance**0.5)
    expanded = student_quantile(LEVEL, dof) * u
    return Quantity(value, u, unit, expanded, None if np.isinf(dof) else dof)


def wider(one: RunChange, two: RunChange) -> RunChange:
    """Take the wider interval of each change of a run, by what may be uncertain in it."""
    names = ("bias", "scale_factor", "misalignment")
    pairs = {name: (getattr(one, name), getattr(two, name)) for name in names}
    found = {n: max(pair, key=lambda q: q.expanded_uncertainty or 0.0) for n, pair in pairs.items()}
    return replace(one, **found)
