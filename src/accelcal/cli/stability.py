"""accelcal stability: the random part of the error from records in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import deliver_picture
from accelcal.cli.files import JSON, Command
from accelcal.cli.forms import deliver_result
from accelcal.cli.values import duration, durations, number
from accelcal.errors import InputError

if TYPE_CHECKING:
    from accelcal.results.stability import Stability
    from accelcal.stability.record import StabilityRecord
    from accelcal.stability.scale_factor import ScaleFactor


def probability(text: str) -> float | None:
    """Type of an option: a probability, or 3 for the fixed factor of the paper."""
    value = number(text)
    if value == 3.0:
        return None
    if not 0.0 < value < 1.0:
        raise click.BadParameter(f"{text!r} is neither 3 nor a probability such as 0.9973.")
    return value


@click.command(cls=Command)
@option.data(many=True)
@option.output("the analysis as JSON", metavar="STABILITY.json", file=JSON)
@option.file("--calibration", "CAL.json", "Calibration that gives the scale factor.")
@option.number("--scale-factor", "K1", "Scale factor [output unit per g].")
@option.text("--unit", "UNIT", "Unit of the output.")
@option.valued(
    probability,
    "--probability",
    "P",
    "Factor t_P: 3, or Student's factor for a probability such as 0.99 or 0.9973.",
    default="3",
    show_default=True,
)
@option.valued(
    duration,
    "--window",
    "T",
    "Initial window of each launch whose mean gives sigma_L, such as 600 or 10min [s].",
    default="600",
    show_default=True,
)
@option.valued(
    durations,
    "--times",
    "T,...",
    "Times at which (3) is evaluated, such as 600, 10min or 12h [s].",
    default="600,3600,21600,43200",
    show_default=True,
)
@option.valued(duration, "--average", "S", "First average the samples over S [s].")
@option.valued(duration, "--launch-gap", "S", "A longer pause begins a new launch [s].")
@option.picture("the bias and the Allan deviation (png, svg or pdf)")
@option.format("text", "json", "csv")
def stability(
    data: Sequence[str],
    path: str | None,
    calibration: str | None,
    scale_factor: float | None,
    unit: str | None,
    probability: float | None,
    window: float,
    times: Sequence[float],
    average: float | None,
    launch_gap: float | None,
    picture: str | None,
    form: str,
) -> None:
    """Estimate drift, noise and launch-to-launch bias from DATA.

    A record has the columns time (s, or ISO 8601) and output and, if available, temperature,
    launch, and input (applied acceleration in g). Several files are several launches. Gives the
    launch-to-launch bias sigma_L, the drift gamma_D, the fluctuation sigma_F, the bound (3), and
    the overlapping Allan deviation, all with 95 % intervals.

    \b
    Examples:
      accelcal stability examples/stability.csv
      accelcal stability monday.csv tuesday.csv --calibration cal.json --plot stability.png
      accelcal stability record.csv --scale-factor 1.3 --probability 0.9973
    """
    from accelcal.io.stability_record import read_stability_records
    from accelcal.stability.analysis import analyse
    from accelcal.stability.record import averaged, split_at_gaps

    record = read_stability_records(data, overrides={"unit": unit})
    if launch_gap is not None:
        record = split_at_gaps(record, launch_gap)
    if average is not None:
        record = averaged(record, average)
    if calibration is not None:
        scale_factor, told = _calibrated(calibration, scale_factor, record)
        record = replace(record, notes=(*record.notes, *told))
    result = analyse(
        record, scale_factor=scale_factor, probability=probability, window=window, times=times
    )
    deliver_picture(lambda: _drawn(result, record), picture)
    deliver_result(result, path, form)


def _calibrated(path: str, scale_factor: float | None, record: StabilityRecord) -> ScaleFactor:
    from accelcal.io.documents import read_results
    from accelcal.results.calibration import Calibration
    from accelcal.results.usable import refuse_misprinted
    from accelcal.stability.scale_factor import scale_factor_from

    if scale_factor is not None:
        raise InputError("--calibration and --scale-factor; give one of the two")
    chosen: Calibration = read_results(path, Calibration).choose(record.serial)
    refuse_misprinted(chosen)
    return scale_factor_from(chosen, record)


def _drawn(result: Stability, record: StabilityRecord) -> Any:
    from accelcal.plot.stability import both

    return both(result, record)
