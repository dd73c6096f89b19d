"""From the records of a block to calibrations: those of one plan together."""

from __future__ import annotations

from collections.abc import Sequence

from accelcal.archive.failures import attempt
from accelcal.archive.settings import Settings
from accelcal.calibrate.plan import OnePlan, plans_of
from accelcal.calibrate.stack import calibration_stack
from accelcal.record import TumbleRecord
from accelcal.results.calibration import Calibration

__all__ = ["calibrate_records"]


def calibrate_records(
    records: Sequence[TumbleRecord], settings: Settings
) -> list[Calibration | str]:
    """Fit records, and judge them where there is a data sheet.

    Parameters
    ----------
    records : sequence of TumbleRecord
        The records.
    settings : Settings
        How to fit.

    Returns
    -------
    list of Calibration or str
        For each record its calibration, or the line that tells why there is none.
    """
    found: list[Calibration | str] = [""] * len(records)
    for places in _together(records, settings):
        own = _calibrated([records[i] for i in places], settings)
        for place, calibration in zip(places, own, strict=True):
            found[place] = calibration
    return found


def _together(records: Sequence[TumbleRecord], settings: Settings) -> list[list[int]]:
    """Places of the records that can be fitted together."""
    alone = [[i] for i in range(len(records))]
    if settings.model is not None:  # effects are fitted anew to each
        return alone
    plans = attempt("", plans_of, records, settings.delta0)
    return alone if isinstance(plans, str) else [places.tolist() for places, _ in plans]


def _calibrated(records: Sequence[TumbleRecord], settings: Settings) -> list[Calibration | str]:
    """Calibrations of records of one plan; one by one where not all of them can be fitted."""
    source = records[0].source
    stack = attempt(source, lambda: calibration_stack(OnePlan.of(records), settings.options()))
    if isinstance(stack, str):
        if len(records) == 1:
            return [stack]
        return [_calibrated([record], settings)[0] for record in records]
    return [
        attempt(record.source, lambda i=i: settings.judged(stack.one(i)))
        for i, record in enumerate(records)
    ]
