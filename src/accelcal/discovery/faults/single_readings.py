"""Outliers and exchanged readings as faults, and the record without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.faults.fault import SMALLEST, entry_fault, of_run
from accelcal.discovery.faults.suspects import Suspect, Views, suspects, views_of
from accelcal.effects.conditions import LEVEL_CHANGE, Conditions
from accelcal.gates.verdict import acceleration, reading_name
from accelcal.numerics.probability import written_p_value
from accelcal.record import TumbleRecord
from accelcal.results.findings import Fault
from accelcal.results.quantity import Quantity


def nominal_scale(record: TumbleRecord, c: Conditions, kept: Mask | None = None) -> float:
    """Slope of the readings next to the reference temperature against the input [output unit / g].

    It is half the range of the readings where there is no slope, 1 where there is no range. The
    readings that are `kept`, shape (n,), are used.
    """
    away = np.abs(c.excess)
    own = away <= away.min() + LEVEL_CHANGE
    own &= True if kept is None else kept
    x = c.input[own] - c.input[own].mean() if own.any() else np.zeros(0)
    slope = float(x @ record.output[own] / ((x @ x) or np.inf))
    return slope or float(np.ptp(record.output)) / 2.0 or 1.0


def single_readings(
    record: TumbleRecord, c: Conditions, nominal: float, weight: Array, least: float, alpha: float
) -> tuple[tuple[Fault, ...], TumbleRecord]:
    """Find outliers and exchanged readings, with a scale factor [output unit / g].

    The weight, shape (n,), is the relative inverse standard deviation of each reading's noise,
    which is no smaller than `least` [g]. Faults are exchanges, then outliers. In the record,
    exchanged readings are exchanged back and outliers set aside; its notes name readings that are
    kept though only heavy tails of the noise explain them.
    """
    views = views_of(record.output / nominal, c, record.mounting, weight, least)
    steps, after, doubtful = suspects(views, alpha)
    exchanges = [step for step in steps if step.is_exchange]
    found = [_exchange(record, c, step) for step in exchanges]
    for step in exchanges:
        record = _exchanged(record, list(step.readings))
    outliers = [step for step in steps if step.is_outlier]
    kept = np.ones(len(record), dtype=np.bool_)
    kept[[step.readings[0] for step in outliers]] = False
    ratio = nominal / nominal_scale(record, c, kept)  # now without the faults
    for step, (e, u) in zip(outliers, _errors(views, after, steps), strict=True):
        found.append(_outlier(record, c, step, e * ratio, u * abs(ratio)))
    notes = [_doubt(record, step) for step in doubtful]
    return tuple(found), replace(record.select(kept), notes=(*record.notes, *notes))


def _exchanged(record: TumbleRecord, pair: list[int]) -> TumbleRecord:
    """Put two readings into each other's place, with what is known of their scatter."""
    changed = {}
    for name in ("output", "std", "count"):
        values = getattr(record, name)
        if values is not None:
            values = values.copy()
            values[pair] = values[pair[::-1]]
            changed[name] = values
    return replace(record, **changed)


def _errors(views: Views, after: Views, steps: list[Suspect]) -> list[tuple[float, float]]:
    """Error of each outlier and its standard uncertainty [g], all estimated together."""
    wrong = [step.readings[0] for step in steps if step.is_outlier]
    for step in steps:
        views = views if step.is_outlier else views.after(step)
    weight = views.weight[wrong]
    view, rest = views.pooled, after.pooled
    inverse = np.linalg.pinv(view.among(wrong), hermitian=True)
    values = inverse @ view.residual[wrong] / weight
    sigma = np.sqrt(max(rest.squares / max(rest.dof, 1.0), views.least**2))
    spread = sigma * np.sqrt(np.diagonal(inverse)) / weight
    return list(zip(values.tolist(), spread.tolist(), strict=True))


def _where(record: TumbleRecord, reading: int) -> str:
    return of_run(record, reading) + reading_name(record, reading, record.line)


def _doubt(record: TumbleRecord, step: Suspect) -> str:
    if_normal, p = written_p_value(step.if_normal), written_p_value(step.p_value)
    return (
        f"{_where(record, step.readings[0])} is {step.deviation:.1f} standard deviations off its"
        f" replicates: an outlier if the noise is normal ({if_normal}), but with"
        f" tails as heavy as the other readings allow it may be none ({p}); it"
        " is kept: look it up, or repeat it"
    )


def _outlier(
    record: TumbleRecord, c: Conditions, step: Suspect, size: float, uncertainty: float
) -> Fault:
    (reading,), chance = step.readings, step.p_value
    return entry_fault(
        "outlier",
        f"{_where(record, reading)} is {acceleration(size)} off its replicates (standard"
        f" uncertainty {acceleration(uncertainty)}, {written_p_value(chance)}): set aside as an"
        " outlier; repeat the reading",
        {
            "error": Quantity(size, uncertainty, "g"),
            "reading": Quantity(float(c.number[reading]), 0.0, "1"),
        },
        chance,
        [reading],
    )


def _exchange(record: TumbleRecord, c: Conditions, step: Suspect) -> Fault:
    chance = max(step.p_value, SMALLEST)
    first, second = sorted(step.readings, key=lambda reading: int(c.number[reading]))
    apart = float(c.number[second] - c.number[first])
    other = reading_name(record, second, record.line)
    return entry_fault(
        "swapped-positions",
        f"{_where(record, first)} and {other} are written at each other's place"
        f" ({written_p_value(chance)}): exchanged back; check the protocol",
        {
            "reading": Quantity(float(c.number[first]), 0.0, "1"),
            "apart": Quantity(apart, 0.0, "1"),
        },
        chance,
        [first, second],
    )
