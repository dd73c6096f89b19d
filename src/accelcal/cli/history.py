"""accelcal history: a unit through its recalibrations."""

from __future__ import annotations

from collections.abc import Sequence

import click

from accelcal.cli.deliver import deliver_picture
from accelcal.cli.files import JSON, Command, FileToRead
from accelcal.cli.forms import deliver_result
from accelcal.cli.options import (
    format_option,
    mounting_option,
    number_option,
    output_option,
    picture_option,
    temperature_option,
    text_option,
)


@click.command(cls=Command)
@click.argument("results", type=FileToRead(), metavar="RESULTS...", nargs=-1, required=True)
@output_option("the history as JSON", metavar="HISTORY.json", file=JSON)
@text_option("--serial", "TEXT", "Unit to follow; not needed if there is only one.")
@mounting_option
@temperature_option(
    "--temperature", "DEG", "Temperature at which to compare [degC; default: that of most dates]."
)
@number_option(
    "--alpha",
    "P",
    "A jump is named if its p-value is below this.",
    default="0.01",
    show_default=True,
)
@picture_option("the history (png, svg or pdf)")
@format_option("text", "json", "csv")
def history(
    results: Sequence[str],
    path: str | None,
    serial: str | None,
    mounting: str | None,
    temperature: float | None,
    alpha: float,
    picture: str | None,
    form: str,
) -> None:
    """Follow a unit through its recalibrations RESULTS.

    RESULTS are tables of accelcal batch (CSV or Parquet), documents of accelcal fit (JSON), or
    both. Gives the drift of bias and scale factor per year, with 95 % intervals that include the
    scatter from one calibration to the next, and jumps with their dates.

    \b
    Examples:
      accelcal history results.csv --serial AL-15
      accelcal history 2019.json 2021.json 2023.json --plot history.png
    """
    from accelcal.io.documents.recalibrations import read_entries
    from accelcal.recalibrations.history import history_of

    found = history_of(
        read_entries(results), serial, mounting=mounting, temperature=temperature, alpha=alpha
    )
    deliver_picture(lambda: found.plot.trends(), picture)
    deliver_result(found, path, form)
