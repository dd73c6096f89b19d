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
from accelcal.compensate.coefficients import Compensation, Law
from accelcal.discovery.errors_counted import counted, notes, sources
from accelcal.discovery.factors import blocks
from accelcal.discovery.known import contribution, disturbances
from accelcal.discovery.noise import (
    ReadingNoise,
    covariance,
    reading_noise,
    refuse_too_many,
    saturated,
)
from accelcal.discovery.repeatability import KnownNoise, known_noise, worse_than_known
from accelcal.discovery.space import Space, space_of, whitener_of
from accelcal.discovery.suited import suited
from accelcal.discovery.where import pattern, shares, structure
from accelcal.effects.conditions import Conditions, conditions_of
from accelcal.errors import AccelcalWarning, InputError
from accelcal.estimate.tables import head_positions
from accelcal.numerics.decimal_steps import decimal_step
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.record import TumbleRecord, naming
from accelcal.reference import fixture_angle
from accelcal.results.calibration import Calibration
from accelcal.results.disagreement import Disagreement, RunChange
from accelcal.results.findings import FoundEffect
from accelcal.results.quantity import Quantity
from accelcal.version import __version__

__all__ = ["compare", "residuals_of"]

Array = NDArray[np.float64]

_SIGNIFICANT = 0.01


class _Simulated(NamedTuple):
    """What a calibration says about a record: conditions, reading and simulation over K1 [g].

    Beside them the change by each coefficient, and by the standard uncertainty of a fixture angle.
    """

    conditions: Conditions
    reading: Array
    simulated: Array
    by_coefficient: Array
    by_fixture: Array

    @property
    def residual(self) -> Array:
        return self.reading - self.simulated


def compare(calibration: Calibration, record: TumbleRecord) -> Disagreement:
    """Show where a calibration and a record disagree.

    Parameters
    ----------
    calibration : Calibration
        The calibration, with the effects that it has.
    record : TumbleRecord
        Readings, of the same accelerometer.

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
    given, record = record, suited(found, record)
    with naming(record):
        refuse_too_many(record)
    simulated = _simulated(calibration, found, record)
    declared = counted(calibration, record)
    known = known_noise(calibration, found.K1.at_T0)
    noise = _noise(known, found, record, simulated)
    dof = float(noise.dof) or (known.dof if known else np.inf)
    worse = worse_than_known(noise, known)
    if worse:
        warnings.warn(f"{record.source}: {worse}", AccelcalWarning, stacklevel=2)
    of_calibration = _of_calibration(found, simulated, dof)
    of_noise = noise.sigma**2 * np.eye(len(record))
    space = _space(record, simulated, noise, declared, found, of_calibration)
    c, seen = simulated.conditions, space.see(simulated.residual)
    factors = blocks(space, c, first="run")
    where = shares(space, seen, factors, dof)
    worst = max(range(len(where)), key=lambda i: (where[i].p_value < _SIGNIFICANT, where[i].share))
    shape = pattern(space, seen, factors[worst])
    return Disagreement(
        rms=float(np.sqrt(np.mean(simulated.residual**2))),
        reduced_chi2=float(seen @ seen) / seen.size,
        p_value=min(share.p_value for share in where),
        where=where,
        structure=(
            structure(c, record.run_labels, factors[worst].factor, shape)
            if where[worst].p_value < _SIGNIFICANT
            else ""
        ),
        runs=tuple(_runs(record, simulated, space, of_calibration + of_noise, dof)),
        noise=sources(noise, declared, record),
        effects=tuple(str(effect["id"]) for effect in calibration.effects),
        notes=(*filter(None, [worse]), *notes(calibration, given, declared)),
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
    return _simulated(calibration, found, suited(found, record)).residual


def _simulated(calibration: Calibration, found: Compensation, record: TumbleRecord) -> _Simulated:
    freed = _freed(calibration, record)
    delta0 = fixture_angle(record, freed.value or None)
    reference = 0.0 if found.T0 is None else found.T0
    c = conditions_of(record, reference, delta0)
    rise, a_i, a_p = c.excess, c.input, c.cross
    tilt, coupling = _cross(found, record)
    gain = 1.0 + found.K1.change(rise)
    delta = _at(tilt, record, rise)
    inside = (
        _at(dict.fromkeys(tilt, found.k0), record, rise)
        + a_i
        + found.k2 * a_i**2
        + found.k3 * a_i**3
        + delta * a_p
        + coupling * a_i * a_p
    )
    heat = found.k0.local_slope(rise) + found.K1.local_slope(rise) * inside / gain
    full = replace(c, axial=a_i + delta * a_p, indicated=inside, gain=gain)
    full = replace(full, per_degree=heat, per_degree_falling=heat)
    effects = tuple(FoundEffect.from_document(effect) for effect in calibration.effects)
    added = [contribution(item, full) for item in disturbances(effects)]
    terms = (np.ones_like(a_i), inside, a_i**2, a_i**3, a_p, a_i * a_p)
    return _Simulated(
        conditions=full,
        reading=record.output / found.K1.at_T0,
        simulated=np.sum([gain * inside, *added], axis=0),
        by_coefficient=gain[:, None] * np.stack(terms, axis=1),
        by_fixture=gain * c.per_radian * (freed.standard_uncertainty or 0.0),
    )


def _freed(calibration: Calibration, record: TumbleRecord) -> Quantity:
    """Fixture angle that both sides of an axis told apart, else the one taken as given."""
    axes = {str(mounting)[0] for mounting in record.mounting}
    taken = Quantity(calibration.delta0_rad, 0.0, "rad")
    return next((f.angle for f in calibration.fixture_angle if f.axis in axes), taken)


def _cross(found: Compensation, record: TumbleRecord) -> tuple[dict[str, Law], Array]:
    """Law of the misalignment by axis along the shaft, and cross-coupling of each reading."""
    axes = {axis.name: axis for axis in found.axes}
    shaft = {"o": "a_p", "p": "a_o"}
    along = np.array([str(mounting)[0] for mounting in record.mounting])
    missing = [axis for axis in sorted(set(along)) if shaft[axis] not in axes]
    if missing:
        raise InputError(
            f"{record.source}: mounting {missing[0]}, which the calibration has not; compare a"
            f" record in mounting {' or '.join(a for a, name in shaft.items() if name in axes)}"
        )
    coupling = np.array([axes[shaft[axis]].delta_ip for axis in along])
    return {axis: axes[shaft[axis]].delta for axis in sorted(set(along))}, coupling


def _at(laws: dict[str, Law], record: TumbleRecord, rise: Array) -> Array:
    """Value of a law at each reading, by the axis along the shaft."""
    value = np.zeros(rise.size)
    for axis, law in laws.items():
        here = np.char.startswith(record.mounting, axis)
        value = np.where(here, law.at_T0 + law.change(rise), value)
    return value


def _noise(
    known: KnownNoise | None, found: Compensation, record: TumbleRecord, simulated: _Simulated
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


def _space(
    record: TumbleRecord,
    simulated: _Simulated,
    noise: ReadingNoise,
    declared: Apparatus,
    found: Compensation,
    of_calibration: Array,
) -> Space:
    c = simulated.conditions
    head = head_positions(record.angle)
    spread = covariance(c, noise, declared, head, _step(found, record))
    spread = spread + of_calibration / noise.sigma**2
    whitener = whitener_of(spread, noise.sigma)
    # Noise without degrees of freedom is taken as known. All that is left then counts as repeating,
    # and no replicates are set apart to estimate the noise anew.
    repeating = saturated(c, record.mounting) if noise.dof else np.eye(len(record))
    return space_of(whitener, np.empty((len(record), 0)), repeating)


def _step(found: Compensation, record: TumbleRecord) -> float:
    """Step of the readings, as declared or as their digits show it [g]."""
    step = max(record.apparatus.resolution or 0.0, decimal_step(record.output))
    return step / abs(found.K1.at_T0)


def _of_calibration(found: Compensation, simulated: _Simulated, dof: float) -> Array:
    """Covariance that the errors of the calibration give to the readings (n, n) [g^2].

    The tests refer to Student's distribution with the degrees of freedom of the noise; what the
    calibration tells with fewer ones counts as larger.
    """
    rise, gain = simulated.conditions.excess, simulated.conditions.gain
    at_T0 = simulated.by_coefficient
    of_slopes = np.stack([at_T0[:, 0], at_T0[:, 1] / gain, at_T0[:, 4]], axis=1)  # k0, K1, delta
    sides = (rise.clip(min=0.0), rise.clip(max=0.0))
    acting = np.hstack([at_T0, *(of_slopes * side[:, None] for side in sides)])
    factors = np.array([student_quantile(LEVEL, known) for known in found.freedom] or 1.0)
    larger = np.maximum(factors / student_quantile(LEVEL, dof), 1.0)
    known = np.nan_to_num(np.array(found.covariance)) * np.outer(larger, larger)
    known[0, 0] += found.hysteresis**2  # the bias is on either side of its law
    of_fixture = np.outer(simulated.by_fixture, simulated.by_fixture)
    return np.asarray(acting @ known @ acting.T + of_fixture)


def _runs(
    record: TumbleRecord, simulated: _Simulated, space: Space, judged: Array, dof: float
) -> Iterator[RunChange]:
    """Bias, scale factor and misalignment of each run beside those of the calibration.

    `judged` is that part of the covariance which is known with some degrees of freedom only.
    """
    c, residual = simulated.conditions, simulated.residual
    axes = c.gain[:, None] * np.stack([np.ones_like(c.input), c.indicated, c.cross], axis=1)
    root = np.linalg.inv(space.whitener)  # of the covariance
    for index, label in enumerate(record.run_labels):
        own = c.run == index
        if not own.any():
            continue
        whole, here = root[own] @ root[own].T, np.ix_(own, own)
        whitener = np.linalg.inv(np.linalg.cholesky(whole))
        weights = np.linalg.pinv(whitener @ axes[own]) @ whitener
        told = [
            _quantity(float(w @ residual[own]), w @ whole @ w, w @ judged[here] @ w, dof, unit)
            for w, unit in zip(weights, ("g", "1", "rad"), strict=True)
        ]
        level = record.select(own).mean_temperature
        rms = float(np.sqrt(np.mean(residual[own] ** 2)))
        yield RunChange(label, level if np.isfinite(level) else None, rms, *told)


def _quantity(value: float, variance: float, judged: float, dof: float, unit: str) -> Quantity:
    """Quantity of whose variance a part is known with some degrees of freedom only."""
    effective = dof * variance / judged
    u = variance**0.5
    finite = None if np.isinf(effective) else effective
    return Quantity(value, u, unit, student_quantile(LEVEL, effective) * u, finite)
