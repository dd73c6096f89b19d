"""What a calibration says about the readings of a record, how its errors act on them, and noise.

The noise is that of the replicates of the record, or of the calibration; the two may not agree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Mask
from accelcal.compensate.coefficients import (
    OF_ONE_AXIS,
    PARAMETERS,
    SLOPES,
    Compensation,
    CrossAxis,
)
from accelcal.compensate.of_table import cross_name
from accelcal.discovery.columns import saturated
from accelcal.discovery.instance import contribution
from accelcal.discovery.noise.of_readings import ReadingNoise, reading_noise, relative_noise
from accelcal.effects.conditions import Conditions, conditions_of
from accelcal.effects.found import disturbances, total
from accelcal.errors import InputError
from accelcal.estimate.trend import FEW
from accelcal.gates.verdict import acceleration
from accelcal.model import CROSS_AXES
from accelcal.numerics.decimal_steps import decimal_step
from accelcal.numerics.probability import f_survival
from accelcal.record import TumbleRecord
from accelcal.reference import fixture_angle
from accelcal.results.agreement import OF_CALIBRATION, hidden_by_errors
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import ErrorSource, Quantity
from accelcal.results.table import TableCalibration

ERRORS = (
    *(*PARAMETERS, *SLOPES),
    *(f"other {name}" for name in OF_ONE_AXIS),
    *("delta0", "other delta0"),
)
"""What of a calibration may be wrong: its parameters and slopes, those of the misalignment of the
other cross axis, and the fixture angle of either."""


class Simulated(NamedTuple):
    """What a calibration says about n readings."""

    conditions: Conditions  # of the readings, as the calibration has them
    reading: Array  # readings over K1 at T0, (n,) [g]
    simulated: Array  # simulation over K1 at T0, (n,) [g]
    by_error: Array  # change of the simulation by each of `ERRORS`, (n, 18) [g per unit]

    @property
    def residual(self) -> Array:
        """Reading minus simulation [g]."""
        return self.reading - self.simulated

    @property
    def per_radian(self) -> Array:
        """Change of each reading by an error of the head [g/rad]."""
        return self.conditions.gain * self.conditions.per_radian


def is_freed(calibration: Calibration, axis: str) -> bool:
    """Whether both sides of an axis tell its misalignment without the fixture angle."""
    return axis in {cross_name(told.axis) for told in calibration.fixture_angle}


def freed_angle(calibration: Calibration, axis: str) -> Quantity:
    """Fixture angle that both sides of a cross axis told apart, else the one taken as given."""
    taken = Quantity(calibration.delta0_rad, 0.0, "rad")
    return next((f.angle for f in calibration.fixture_angle if cross_name(f.axis) == axis), taken)


def simulated_readings(
    calibration: Calibration, found: Compensation, record: TumbleRecord
) -> Simulated:
    """Simulate the readings of a record in the output unit of a calibration.

    Raises
    ------
    InputError
        If a mounting was not calibrated.
    """
    along, effects = _along(found, record), disturbances(calibration.effects)
    full = now = _full(calibration, found, record, along)
    lag = total("angle", effects, full)
    if lag.any():
        read = replace(record, angle=record.angle + np.degrees(lag))
        now = _full(calibration, found, read, along)
    others = (item for item in effects if item.effect.acts_on not in ("angle", "output"))
    added = [contribution(item, full) for item in others]
    inside = now.indicated + total("output", effects, now)
    return Simulated(
        conditions=full,
        reading=record.output / found.K1.at_T0,
        simulated=np.sum([now.gain * inside, *added], axis=0),
        by_error=_by_error(full, along == found.cross.name),
    )


def _full(
    calibration: Calibration, found: Compensation, record: TumbleRecord, along: NDArray[np.str_]
) -> Conditions:
    """Conditions with what the calibration says is indicated, and how it changes."""
    c = _conditions(calibration, found, record, along)
    rise, a_i, a_p = c.excess, c.input, c.cross
    gain = 1.0 + found.K1.change(rise)
    bias = found.k0.at_T0 + found.k0.change(rise)
    delta = _of_axis(along, found, lambda axis: axis.delta.at_T0 + axis.delta.change(rise))
    coupling = _of_axis(along, found, lambda axis: np.full(rise.size, axis.delta_ip))
    inside = bias + a_i + found.k2 * a_i**2 + found.k3 * a_i**3 + delta * a_p + coupling * a_i * a_p
    tilt = _of_axis(along, found, lambda axis: axis.delta.local_slope(rise))
    heat = found.k0.local_slope(rise) + found.K1.local_slope(rise) * inside / gain + tilt * a_p
    full = replace(c, axial=a_i + delta * a_p, indicated=inside, gain=gain)
    return replace(full, per_degree=heat, per_degree_falling=heat)


def _along(found: Compensation, record: TumbleRecord) -> NDArray[np.str_]:
    """Cross axis of each reading."""
    known = [axis.name for axis in found.axes]
    along = np.array([cross_name(str(mounting)) for mounting in record.mounting])
    missing = [a for a in CROSS_AXES if cross_name(a) in along and cross_name(a) not in known]
    if missing:
        raise InputError(
            f"{record.source}: mounting {missing[0]}, which the calibration has not; compare a"
            f" record in mounting {' or '.join(a for a in CROSS_AXES if cross_name(a) in known)}"
        )
    return along


def _conditions(
    calibration: Calibration, found: Compensation, record: TumbleRecord, along: NDArray[np.str_]
) -> Conditions:
    """Conditions of the readings, those in either cross axis with its own fixture angle.

    Accelerations are in the local g of the calibration.
    """
    both = []
    for axis in found.axes:
        delta0 = fixture_angle(record, freed_angle(calibration, axis.name).value or None)
        both.append(conditions_of(record, 0.0 if found.T0_degC is None else found.T0_degC, delta0))
    main, other = both[0], both[-1]
    of_angle = ("input", "cross", "axial", "indicated", "per_radian")
    is_main = along == found.cross.name
    g = gravity_ratio(record.apparatus.local_gravity, calibration.g_local_m_s2)
    told: Any = {n: g * np.where(is_main, getattr(main, n), getattr(other, n)) for n in of_angle}
    return replace(main, **told)


def gravity_ratio(here: float | None, there: float | None) -> float:
    """Local gravity here over that there; 1 where one is not declared."""
    return here / there if here and there else 1.0


def _of_axis(
    along: NDArray[np.str_], found: Compensation, told: Callable[[CrossAxis], Array]
) -> Array:
    """What each reading has of its own cross axis."""
    return np.asarray(np.sum([np.where(along == a.name, told(a), 0.0) for a in found.axes], axis=0))


def _by_error(c: Conditions, is_main: Mask) -> Array:
    """Derivatives by `ERRORS`, shape (n, 18); those of the slopes are on one side of T0 each."""
    gain, a_i, a_p = c.gain, c.input, c.cross
    main, other = np.where(is_main, gain, 0.0), np.where(is_main, 0.0, gain)
    at_T0 = [gain, gain * c.indicated, gain * a_i**2, gain * a_i**3, main * a_p, main * a_i * a_p]
    above, below = c.excess.clip(min=0.0), c.excess.clip(max=0.0)
    slopes = [
        column * side for side in (above, below) for column in (gain, c.indicated, main * a_p)
    ]
    of_other = [other * a_p, other * a_i * a_p, other * a_p * above, other * a_p * below]
    of_fixture = [main * c.per_radian, other * c.per_radian]
    return np.stack([*at_T0, *slopes, *of_other, *of_fixture], axis=1)


_WORSE = 3.0
"""Noise over that of the calibration from which it may hide a disagreement."""

_CHANCE = 1e-6
"""Chance of the same noise below which it is another."""

_OF_ONE_TABLE = ("replicates", "declared")
"""What tells the noise of a table by itself; all else tells it of several tables together."""


class KnownNoise(NamedTuple):
    """Noise of a reading of the calibration."""

    sigma: float  # standard deviation [g]
    dof: float  # degrees of freedom; infinite where it was declared


def known_noise(calibration: Calibration, scale_factor: float) -> KnownNoise | None:
    """Root mean square of a reading's noise over the tables of a calibration; None without any.

    The scale factor is K1 at T0 [output unit / g]. Where residuals told noise and head error at
    once, or the noise with one or two degrees of freedom, all of them count.
    """
    known_head = not _is_told_with_the_head(calibration)
    pairs = zip(calibration.reading_noises, calibration.tables, strict=False)
    sources = [
        noise
        if known_head and (noise.dof is None or noise.dof >= FEW)
        else _of_residuals(noise, table)
        for noise, table in pairs
    ]
    found = [s for s in sources if s.value]
    if not found:
        return None
    sigma = np.sqrt(np.mean([(source.value or 0.0) ** 2 for source in found]))
    return KnownNoise(float(sigma) / abs(scale_factor), _degrees(found))


def _is_told_with_the_head(calibration: Calibration) -> bool:
    """Whether residuals told noise and head error at once."""
    by = {(source.name, source.source) for source in calibration.error_sources}
    return {("reading", "residuals"), ("head", "estimated")} <= by


def _of_residuals(noise: ErrorSource, table: TableCalibration) -> ErrorSource:
    """Noise of a table as large as its residuals, where it came from them."""
    if noise.source != "residuals":
        return noise
    return replace(noise, value=table.residual_rms, dof=float(table.dof))


def _degrees(found: Sequence[ErrorSource]) -> float:
    """Degrees of freedom of all tables; what they told together counts once."""
    freedom = [(s.source, np.inf if s.dof is None else s.dof) for s in found]
    own = sum(dof for source, dof in freedom if source in _OF_ONE_TABLE)
    together = max((dof for source, dof in freedom if source not in _OF_ONE_TABLE), default=0.0)
    return float(own + together)


def taken_from_calibration(calibration: Calibration, noise: ReadingNoise) -> str:
    """Say that the noise is not that of the record."""
    all_of_it = (
        ", all of its residuals, as one stroke tells noise and head error together"
        if _is_told_with_the_head(calibration)
        else ""
    )
    return (
        "the record has too few replicates to tell its noise, which is taken from the calibration:"
        f" {acceleration(noise.sigma)}{all_of_it}; a noisier stand counts as a disagreement, and"
        " four strokes tell it"
    )


def worse_than_known(noise: ReadingNoise, known: KnownNoise | None) -> str:
    """Say that readings scatter far more than those of the calibration; empty where they do not."""
    if known is None or not noise.dof or noise.sigma < _WORSE * known.sigma:
        return ""
    if f_survival((noise.sigma / known.sigma) ** 2, noise.dof, known.dof) > _CHANCE:
        return ""
    return (
        f"the readings scatter by {acceleration(noise.sigma)}, those of the calibration by"
        f" {acceleration(known.sigma)}: such noise hides disagreements; look for an outlier or a"
        " coarse step by accelcal fit, and for a warm-up or another effect by accelcal discover"
    )


def loud_runs(calibration: Calibration, found: Compensation) -> tuple[ErrorSource, ...]:
    """Noise of a reading in the worst run of a calibration [g], where it hides disagreements."""
    worst = max(calibration.reading_noises, key=lambda own: own.value or 0.0, default=None)
    if worst is None:
        return ()
    size = (worst.value or 0.0) / abs(found.K1.at_T0)
    told = replace(worst, name=OF_CALIBRATION, value=size, unit="g")
    return (told,) if hidden_by_errors([told]) else ()


def hiding(sources: Iterable[ErrorSource]) -> str:
    """Say what to do about errors that hide disagreements; empty where none does."""
    found = hidden_by_errors(sources)
    if not found:
        return ""
    return (
        f"{found}; look for exchanged readings and outliers by accelcal discover, in those of the"
        " calibration as well, and mend them"
    )


_COARSE = 2.5
"""Step of the readings over their noise above which their replicates do not tell it."""


class RecordNoise(NamedTuple):
    """Noise of the readings, its degrees of freedom, and what it is from if not from replicates."""

    reading: ReadingNoise
    dof: float
    source: str = "calibration"
    said: str = ""


def record_noise(
    calibration: Calibration,
    known: KnownNoise | None,
    record: TumbleRecord,
    simulated: Simulated,
    step: float,
) -> RecordNoise:
    """Noise of the readings from replicates, else as the calibration had it.

    Of readings that are rounded by far more, replicates are alike at most positions and a step
    apart at some. Their scatter tells of none of these, and the error of rounding is known.
    """
    c = simulated.conditions
    try:
        within = saturated(c, record.mounting)
        noise = reading_noise(c, simulated.residual, within, step, relative_noise(record))
        found = RecordNoise(noise, float(noise.dof))
    except InputError:
        if known is None:
            raise
        noise = ReadingNoise(known.sigma, 0.0, 0, np.inf)
        found = RecordNoise(noise, known.dof, said=taken_from_calibration(calibration, noise))
    if step <= _COARSE * noise.sigma:
        return found
    whole = float(np.hypot(noise.sigma, step / np.sqrt(12.0)))
    said = (
        f"the readings are rounded to {acceleration(step)}, by more than they scatter: the error of"
        " rounding counts as the noise of each"
    )
    return RecordNoise(ReadingNoise(whole, 0.0, 0, np.inf), np.inf, "rounding", said)


def step_of(found: Compensation, record: TumbleRecord) -> float:
    """Step of the readings, as declared or as their digits show it [g]."""
    step = max(record.apparatus.resolution or 0.0, decimal_step(record.output))
    return step / abs(found.K1.at_T0)
