"""Noise of a new record, by its replicates or the calibration, and whether these agree."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.compensate.coefficients import Compensation
from accelcal.discovery.columns import saturated
from accelcal.discovery.new_record.simulated import Simulated
from accelcal.discovery.noise.of_readings import ReadingNoise, reading_noise, relative_noise
from accelcal.errors import InputError
from accelcal.estimate.pure_error import FEW
from accelcal.gates.verdict import acceleration
from accelcal.numerics.decimal_steps import decimal_step
from accelcal.numerics.probability import f_survival
from accelcal.record import TumbleRecord
from accelcal.results.agreement import OF_CALIBRATION, hidden_by_errors
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import ErrorSource
from accelcal.results.table import TableCalibration

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


def rounded(step: float) -> str:
    """Say that the step of the readings makes their noise [g]."""
    return (
        f"the readings are rounded to {acceleration(step)}, by more than they scatter: the error of"
        " rounding counts as the noise of each"
    )


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
    return RecordNoise(ReadingNoise(whole, 0.0, 0, np.inf), np.inf, "rounding", rounded(step))


def step_of(found: Compensation, record: TumbleRecord) -> float:
    """Step of the readings, as declared or as their digits show it [g]."""
    step = max(record.apparatus.resolution or 0.0, decimal_step(record.output))
    return step / abs(found.K1.at_T0)
