"""accelcal check: what the reader understands of a table."""

from __future__ import annotations

from typing import Any

import click

from accelcal.cli import options as option
from accelcal.cli.files import Command
from accelcal.cli.forms import deliver_forms, json_of


@click.command(cls=Command)
@option.data()
@option.reading
@option.declared_serial
@option.format("text", "json")
def check(data: str, form: str, **declared: Any) -> None:
    """Show how the table DATA was understood.

    Shows form, encoding and columns, runs and temperatures, missing positions, what is declared,
    and what was set aside. Nothing is calculated. Options override the header lines, as those of
    fit do.

    \b
    Examples:
      accelcal check table.csv
      accelcal check table.csv --unit mA --positions 12
    """
    from accelcal.io.description import describe, summary
    from accelcal.io.tables import survey
    from accelcal.report.lines import visible_lines

    written, records = survey(data, overrides=declared)
    told = "\n\n".join(describe(record, written) for record in records)
    forms = {
        "text": lambda: visible_lines(told.split("\n")),
        "json": lambda: json_of(summary(records, written)),
    }
    deliver_forms(forms, None, form)
