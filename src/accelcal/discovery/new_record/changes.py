"""What has changed in each run since a calibration, with intervals.

All that the positions of a run tell apart is fitted at once: a change of k2 alone would look like
one of the bias.

The differences of a run are fitted with the weights of generalised least squares, in whose
covariance what few degrees of freedom tell counts as larger. The interval of a change has each part
of its variance as it is told, and Student's factor for the mean of their degrees of freedom,
harmonic and weighted by their shares, as `accelcal.estimate.uncertainty` has it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.new_record.calibration_errors import places_of
from accelcal.discovery.new_record.same_clamping import Seen
from accelcal.discovery.space import Covariance, Whitener, whitener_of
from accelcal.estimate.at_positions import said_of_positions
from accelcal.estimate.estimability import told_apart
from accelcal.model import COEFFICIENTS, CROSS_AXES, ERROR_UNITS
from accelcal.numerics.grouping import distinct
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.record import TumbleRecord
from accelcal.results.disagreement import QUANTITIES, RunChange
from accelcal.results.quantity import Quantity

_RANK = 1e-9
"""Singular value, over the largest one, below which readings do not tell a combination."""

_TOLD = 1e-6
"""A change is told where less than this part of it may be that of another one."""

_NAMES: Mapping[str, tuple[str, str]] = {
    "K0": ("bias", "g"),
    "K1": ("scale_factor", "1"),
    "M": ("misalignment", "rad"),
    "K2": ("k2", ERROR_UNITS["k2"]),
    "K3": ("k3", ERROR_UNITS["k3"]),
    "M_ip": ("delta_ip", ERROR_UNITS["delta_ip"]),
}
"""Coefficient of (1) -> name and unit of its change."""

_ALWAYS = "K0", "K1", "M"
"""What is told apart from each other or not at all; they take up others that are not told."""


class Uncertain(NamedTuple):
    """What makes the differences of n readings and their simulation uncertain."""

    spread: Covariance
    """Their covariance, in which what few degrees of freedom tell counts as larger."""
    larger: Array  # covariance of the errors of the calibration as it is in `spread`, (18, 18)
    by_head: Array
    """What the errors of the head positions of the record do, of the size that they have in
    `spread`, (n, k) [g]."""
    head_factor: float  # this size over the estimate of it
    head_dof: float  # degrees of freedom of that
    one_head: bool  # whether what they did to the calibration is in `by_head`
    lost: list[int]  # places among the errors of what the calibration does not determine
    columns: Array
    """What a change of each error does to the readings [g per unit]; one that is `lost` without
    what the calibration took up of it, (n, 18)."""


class Changed(NamedTuple):
    """What has changed in a run."""

    told: RunChange  # changes that are fitted at once
    seen: Mapping[str, Quantity]
    """The same, of bias, scale factor and misalignment as if the shape had not changed, by which
    they are seen better; without those that nothing tells."""


def changes(seen: Seen, known: Uncertain) -> Iterator[Changed]:
    """Fit the coefficients of each run beside those of the calibration.

    There are two of a run with readings in both cross axes, of which each has a misalignment.
    """
    for label, own in _runs_and_axes(seen.record):
        run = _run(seen, known, own)
        level = seen.record.select(own).mean_temperature
        together, of_three = _fitted(run, run.told), _fitted(run, _ALWAYS)
        told = RunChange(
            run=label,
            temperature_degC=level if np.isfinite(level) else None,
            rms=float(np.sqrt(np.mean(seen.simulated.residual[own] ** 2))),
            mounting=", ".join(distinct(seen.record.mounting[own]).tolist()),
            **together,
        )
        pairs = [*together.items(), *of_three.items()]
        yield Changed(told, {name: change for name, change in pairs if change.value is not None})


def notes_of_positions(seen: Seen) -> Iterator[str]:
    """Say how positions were taken, and which coefficients those of a run do not tell apart."""
    yield from said_of_positions(seen.record)
    said: dict[str, None] = {}
    for _, own in _runs_and_axes(seen.record):
        columns = seen.simulated.by_error[own]
        said |= dict.fromkeys(told_apart(columns[:, places_of(columns)]).sentences())
    yield from (f"changes in this record: {sentence}" for sentence in said)


class _Run(NamedTuple):
    """The n readings of a record, those of a run and axis among them."""

    seen: Seen
    known: Uncertain
    own: Mask
    places: list[int]  # of the coefficients among the errors
    columns: Array  # of the coefficients, (n, 6)
    whitener: Whitener
    whitened: Array  # columns of the own readings

    @property
    def told(self) -> list[str]:
        """Coefficients to fit: those of `_ALWAYS`, and others that the positions tell apart."""
        apart = told_apart(self.columns[self.own]).kept
        return [name for name in COEFFICIENTS if name in (*_ALWAYS, *apart)]


def _run(seen: Seen, known: Uncertain, own: Mask) -> _Run:
    places, whitener = places_of(known.columns[own]), whitener_of(known.spread.among(own))
    columns = known.columns[:, places]
    return _Run(seen, known, own, places, columns, whitener, whitener.whitened(columns[own]))


def _fitted(run: _Run, names: Sequence[str]) -> dict[str, Quantity]:
    """Change of each coefficient, some of them fitted; without a value where nothing tells it."""
    found = {name: Quantity(None, None, unit) for name, unit in _NAMES.values()}
    kept = [COEFFICIENTS.index(name) for name in names]
    inverse = np.asarray(np.linalg.pinv(run.whitened[:, kept], rcond=_RANK))
    weights = np.zeros((len(kept), len(run.own)))
    weights[:, run.own] = run.whitener.transposed(inverse.T).T
    told = np.abs(weights @ run.columns[:, kept] - np.eye(len(kept))).max(axis=1) < _TOLD
    variances = (inverse**2).sum(axis=1)
    for place, w, variance, is_told in zip(kept, weights, variances, told, strict=True):
        if is_told and run.places[place] not in run.known.lost:
            name, unit = _NAMES[COEFFICIENTS[place]]
            found[name] = _quantity(run, w, variance, unit)
    return found


def _runs_and_axes(record: TumbleRecord) -> Iterator[tuple[str, Mask]]:
    """Readings of each run and cross axis."""
    for index, label in enumerate(record.run_labels):
        for axis in CROSS_AXES:
            own = (record.run == index) & np.char.startswith(record.mounting, axis)
            if own.any():
                yield label, own


def _quantity(run: _Run, w: Array, whole: float, unit: str) -> Quantity:
    """Change of weights w of the readings.

    It has no value where an error of the calibration is in it that nothing bounds.
    """
    seen, known, errors, v = run.seen, run.known, run.seen.errors, run.seen.simulated.by_error.T @ w
    if np.any(np.abs(v[errors.unbounded]) > _TOLD):
        return Quantity(None, None, unit)
    noise = seen.noise.sigma**2 * (w @ w)
    counted = ((w @ known.by_head) ** 2).sum()
    head = counted / known.head_factor**2
    of_head = 0.0 if known.one_head else ((v @ errors.of_head) ** 2).sum()
    rest = v @ errors.rest @ v + (errors.hysteresis * v[0]) ** 2
    too_large = counted - head + v @ known.larger @ v - of_head - rest
    variance = whole - too_large
    shares = v**2 * np.diagonal(errors.rest)
    mean = (shares / errors.freedom).sum() / (shares.sum() or 1.0)
    over_dof = noise / seen.dof + head / known.head_dof + of_head / errors.head_dof + rest * mean
    dof = float(variance / over_dof) if over_dof > 0.0 else np.inf
    u = float(variance**0.5)
    expanded = student_quantile(LEVEL, dof) * u
    value = float(w @ seen.simulated.residual)
    return Quantity(value, u, unit, expanded, None if np.isinf(dof) else dof)


def wider(one: RunChange, two: RunChange) -> RunChange:
    """Take the wider interval of each change of a run, by what may be uncertain in it."""
    pairs = zip(QUANTITIES, one.changes, two.changes, strict=True)
    found: dict[str, Any] = {
        name: max(pair, key=lambda q: q.expanded_uncertainty or 0.0) for name, *pair in pairs
    }
    return replace(one, **found)
