"""A new record against what a calibration simulates."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.apparatus import Apparatus
from accelcal.compensate.choice import compensation
from accelcal.compensate.coefficients import Compensation
from accelcal.discovery.calibration_errors import CalibrationErrors, calibration_errors
from accelcal.discovery.errors_counted import counted, head_notes, notes, sources
from accelcal.discovery.factors import blocks
from accelcal.discovery.noise import (
    ReadingNoise,
    covariance,
    reading_noise,
    refuse_too_many,
    saturated,
)
from accelcal.discovery.one_head import head_difference, is_same_head, is_turned_over
from accelcal.discovery.repeatability import KnownNoise, known_noise, worse_than_known
from accelcal.discovery.simulated import SHAFT, Simulated, simulated_readings
from accelcal.discovery.space import Space, space_of, whitener_of
from accelcal.discovery.suited import suited
from accelcal.discovery.where import pattern, shares, structure
from accelcal.errors import AccelcalWarning, InputError
from accelcal.estimate.tables import head_positions
from accelcal.numerics.decimal_steps import decimal_step
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.numerics.sorting import distinct
from accelcal.record import TumbleRecord, naming
from accelcal.results.calibration import Calibration
from accelcal.results.disagreement import Disagreement, RunChange
from accelcal.results.findings import Share
from accelcal.results.quantity import Quantity
from accelcal.version import __version__

__all__ = ["compare", "residuals_of"]

Array = NDArray[np.float64]

_SIGNIFICANT = 0.01


class _Seen(NamedTuple):
    """A record beside what its calibration simulates, with all that is uncertain in both."""

    record: TumbleRecord
    simulated: Simulated
    noise: ReadingNoise
    dof: float
    declared: Apparatus
    errors: CalibrationErrors
    step: float


class _Judged(NamedTuple):
    """What disagrees, by what was taken as uncertain."""

    where: tuple[Share, ...]
    reduced_chi2: float
    structure: str
    runs: tuple[RunChange, ...]

    @property
    def p_value(self) -> float:
        return min(share.p_value for share in self.where)


def compare(
    calibration: Calibration, record: TumbleRecord, *, same_head: bool | None = None
) -> Disagreement:
    """Show where a calibration and a record disagree.

    Parameters
    ----------
    calibration : Calibration
        The calibration, with the effects that it has.
    record : TumbleRecord
        Readings, of the same accelerometer.
    same_head : bool, optional
        Whether both were measured on one head, with the fixture clamped alike. By default the lines
        ``# head: NAME`` of both tell it, or ``# stand: NAME``.

    Returns
    -------
    Disagreement
        Shares of the factors, what has changed in each run, and what it looks like.

    Raises
    ------
    InputError
        If the record is in a unit of another quantity, outside the calibrated temperatures, in a
        mounting that was not calibrated, no record at all, or one of more than 8000 readings.

    Warns
    -----
    AccelcalWarning
        Where the readings scatter so much more than those of the calibration that it hides
        disagreements.

    Notes
    -----
    Nothing is fitted to the record. What may differ without disagreeing is the noise of its
    readings (from replicates, else as the calibration has it, with its degrees of freedom), head,
    launch and temperature errors as declared, and the uncertainty of the calibration. Where few
    degrees of freedom tell that, it counts as larger by its coverage factor over the normal one.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> found = accelcal.compare(calibration, accelcal.simulate(seed=2))
    >>> found.p_value > 0.01
    True
    """
    found = compensation(calibration, effects=False)
    converted = suited(found, record)
    with naming(record):
        refuse_too_many(record)
    simulated = simulated_readings(calibration, found, converted)
    known = known_noise(calibration, found.K1.at_T0)
    noise = _noise(known, found, converted, simulated)
    worse = worse_than_known(noise, known)
    if worse:
        warnings.warn(f"{record.source}: {worse}", AccelcalWarning, stacklevel=2)
    dof = float(noise.dof) or (known.dof if known else np.inf)
    declared, errors = counted(calibration, record), calibration_errors(calibration, found)
    step = _step(found, converted)
    seen = _Seen(converted, simulated, noise, dof, declared, errors, step)
    same = is_same_head(calibration, record, errors, same_head)
    judged = _whatever_the_head(seen, same, is_turned_over(calibration, record))
    return Disagreement(
        rms=float(np.sqrt(np.mean(simulated.residual**2))),
        reduced_chi2=judged.reduced_chi2,
        p_value=judged.p_value,
        where=judged.where,
        structure=judged.structure,
        runs=judged.runs,
        noise=sources(noise, declared, record),
        same_head=same,
        effects=tuple(str(effect["id"]) for effect in calibration.effects),
        notes=(
            *filter(None, [worse]),
            *notes(calibration, record, declared),
            *head_notes(calibration, record, declared, same),
        ),
        serial=record.serial,
        readings=len(record),
        source=record.source,
        calibration=calibration.source,
        software=f"accelcal {__version__}",
    )


def residuals_of(calibration: Calibration, record: TumbleRecord) -> Array:
    """Reading minus what a calibration simulates, over K1 at T0.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    record : TumbleRecord
        Readings of the same accelerometer.

    Returns
    -------
    ndarray, shape (n,)
        The residuals [g].

    Raises
    ------
    InputError
        If the record does not suit the calibration, see `compare`.
    """
    found = compensation(calibration, effects=False)
    return simulated_readings(calibration, found, suited(found, record)).residual


def _noise(
    known: KnownNoise | None, found: Compensation, record: TumbleRecord, simulated: Simulated
) -> ReadingNoise:
    """Noise of the readings from replicates, else as the calibration had it."""
    c = simulated.conditions
    try:
        within = saturated(c, record.mounting)
        return reading_noise(c, simulated.residual, within, _step(found, record))
    except InputError:
        if known is None:
            raise
        return ReadingNoise(known.sigma, 0.0, 0, np.inf)


def _step(found: Compensation, record: TumbleRecord) -> float:
    """Step of the readings, as declared or as their digits show it [g]."""
    step = max(record.apparatus.resolution or 0.0, decimal_step(record.output))
    return step / abs(found.K1.at_T0)


def _whatever_the_head(seen: _Seen, same: bool | None, turned_over: bool) -> _Judged:
    """Judge by one head, or by two; where nothing tells which, by what is more uncertain.

    On the same side of an axis two heads always leave more uncertain than one.
    """
    if same is not None or not turned_over or not seen.errors.positions.size:
        return _judged(seen, bool(same))
    one, two = _judged(seen, same=True), _judged(seen, same=False)
    nearer = max(one, two, key=lambda judged: judged.p_value)
    runs = tuple(map(_wider, one.runs, two.runs))
    return nearer._replace(runs=runs)


def _wider(one: RunChange, two: RunChange) -> RunChange:
    """Changes of a run with the wider interval of each."""
    names = ("bias", "scale_factor", "misalignment")
    pairs = {name: (getattr(one, name), getattr(two, name)) for name in names}
    wider = {n: max(pair, key=lambda q: q.expanded_uncertainty) for n, pair in pairs.items()}
    return replace(one, **wider)


def _judged(seen: _Seen, same: bool) -> _Judged:
    """Judge with the head of the calibration under the record, or with another one."""
    c, errors, by_error = seen.simulated.conditions, seen.errors, seen.simulated.by_error
    of_calibration = by_error @ errors.covariance(seen.dof, head=not same) @ by_error.T
    space = _space(seen, of_calibration, same)
    coordinates = space.see(seen.simulated.residual)
    factors = blocks(space, c, first="run")
    where = shares(space, coordinates, factors, seen.dof)
    worst = max(range(len(where)), key=lambda i: (where[i].p_value < _SIGNIFICANT, where[i].share))
    told, factor = "", factors[worst]
    if where[worst].p_value < _SIGNIFICANT:
        shape = pattern(space, coordinates, factor)
        told = structure(c, seen.record.run_labels, factor.factor, shape)
    known_by_few = of_calibration + seen.noise.sigma**2 * np.eye(len(seen.record))
    return _Judged(
        where=where,
        reduced_chi2=float(coordinates @ coordinates) / coordinates.size,
        structure=told,
        runs=tuple(_runs(seen, space, known_by_few)),
    )


def _space(seen: _Seen, of_calibration: Array, same: bool) -> Space:
    record, noise, c = seen.record, seen.noise, seen.simulated.conditions
    own = replace(seen.declared, head_uncertainty=None) if same else seen.declared
    spread = covariance(c, noise, own, head_positions(record.angle), seen.step)
    if same:
        left = head_difference(seen.errors, seen.simulated, record)
        size = (seen.declared.head_uncertainty or 0.0) / noise.sigma
        spread = spread + size**2 * left @ left.T
    whitener = whitener_of(spread + of_calibration / noise.sigma**2, noise.sigma)
    # Noise without degrees of freedom is taken as known. All that is left then counts as repeating,
    # and no replicates are set apart to estimate the noise anew.
    repeating = saturated(c, record.mounting) if noise.dof else np.eye(len(record))
    return space_of(whitener, np.empty((len(record), 0)), repeating)


def _runs(seen: _Seen, space: Space, judged: Array) -> Iterator[RunChange]:
    """Bias, scale factor and misalignment of each run beside those of the calibration.

    Each cross axis has a misalignment of its own. `judged` is that part of the covariance which is
    known with some degrees of freedom only.
    """
    record, c, residual = seen.record, seen.simulated.conditions, seen.simulated.residual
    columns = c.gain[:, None] * np.stack([np.ones_like(c.input), c.indicated, c.cross], axis=1)
    root = np.linalg.inv(space.whitener)  # of the covariance
    for label, own in _runs_and_axes(record):
        whole, here = root[own] @ root[own].T, np.ix_(own, own)
        whitener = np.linalg.inv(np.linalg.cholesky(whole))
        weights = np.linalg.pinv(whitener @ columns[own]) @ whitener
        bias, scale_factor, misalignment = (
            _quantity(float(w @ residual[own]), w @ whole @ w, w @ judged[here] @ w, seen.dof, unit)
            for w, unit in zip(weights, ("g", "1", "rad"), strict=True)
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


def _runs_and_axes(record: TumbleRecord) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Readings of each run and cross axis."""
    for index, label in enumerate(record.run_labels):
        for axis in SHAFT:
            own = (record.run == index) & np.char.startswith(record.mounting, axis)
            if own.any():
                yield label, own


def _quantity(value: float, variance: float, judged: float, dof: float, unit: str) -> Quantity:
    """Quantity of whose variance a part is known with some degrees of freedom only."""
    effective = dof * variance / judged
    u = variance**0.5
    finite = None if np.isinf(effective) else effective
    return Quantity(value, u, unit, student_quantile(LEVEL, effective) * u, finite)
