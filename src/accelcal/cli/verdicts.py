"""Calibrations judged against a data sheet, and the exit code that tells of it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from accelcal.results.calibration import Calibration
    from accelcal.specification import Specification


def judged(
    calibrations: Iterable[Calibration], specification: Specification
) -> tuple[Calibration, ...]:
    """Give calibrations their verdicts."""
    from dataclasses import replace  # here, as the help needs none of it

    from accelcal.verdict.judge import judge

    return tuple(replace(one, verdict=judge(one, specification)) for one in calibrations)


def exit_where_failed(calibrations: Iterable[Calibration]) -> None:
    """End the command with exit code 1 where a calibration fails its data sheet."""
    if any(one.verdict is not None and one.verdict.outcome == "fail" for one in calibrations):
        click.get_current_context().exit(1)
