"""accelcal fit: from tables of readings to calibrations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import remark, remark_alike, say
from accelcal.cli.files import JSON, Command
from accelcal.cli.fit_arguments import fit_arguments
from accelcal.cli.forms import csv_of, deliver_forms, one_below_the_other
from accelcal.cli.verdicts import exit_where_failed, judged

if TYPE_CHECKING:
    from accelcal.record import TumbleRecord
    from accelcal.results.calibration import Calibration


@click.command(cls=Command)
@option.data(many=True)
@option.output("the calibration as JSON", metavar="CAL.json", file=JSON)
@option.calibration
@option.declared_serial
@option.effects("model")
@option.report
@option.format("text", "json", "csv")
def fit(
    data: Sequence[str],
    path: str | None,
    page: str | None,
    form: str,
    **options: Any,
) -> None:
    """Calibrate from the tables DATA.

    For each table: bias, scale factor, nonlinearity and misalignment with their uncertainties,
    residuals by position and stroke, and the gates, which are checks for faults of the readings.
    Options override the header lines of a table. "-" reads standard input. If MODEL.json holds
    several units, each table uses the one with its serial number.

    \b
    Examples:
      accelcal fit table.csv
      accelcal fit table.csv --head-uncertainty 1e-5 -o calibration.json
      accelcal fit 2024/*.csv --format csv
      accelcal fit table.csv --spec examples/al15.toml
    """
    from accelcal.calibrate.fit import fit as calibrate
    from accelcal.io.of_serial import records_called
    from accelcal.io.tables import read_tables
    from accelcal.results.documents.stored import all_to_json

    asked, serial = fit_arguments(options), options.pop("serial")
    given = [record for source in data for record in read_tables(source, overrides=options)]
    records = records_called(given, serial)
    _tell_notes(records)
    remark_alike(records)
    calibrations = tuple(
        calibrate(
            record, model=asked.models and asked.models.model_of(record.serial), **asked.of_all
        )
        for record in records
    )
    for serial, files in _apart(calibrations):
        remark(
            f"note: {serial} is in {files} files, each calibrated alone; temperature laws need its"
            " runs in one table, told apart by a column run"
        )
    if asked.specification is not None:
        calibrations = judged(calibrations, asked.specification)
    if page is not None:
        from accelcal.page.write import write_report

        write_report(calibrations, page)
    forms = {
        "text": lambda: one_below_the_other(map(str, calibrations)),
        "json": lambda: all_to_json(calibrations),
        "csv": lambda: _csv(calibrations),
    }
    deliver_forms(forms, path, form)
    exit_where_failed(calibrations)


def _apart(calibrations: Sequence[Calibration]) -> Iterator[tuple[str, int]]:
    """Units without temperature laws, whose levels are in files of their own, and how many."""
    from accelcal.reference import LEAST_RISE

    of_unit: dict[str, list[Calibration]] = {}
    for each in calibrations:
        if each.serial and each.temperature_model is None:
            of_unit.setdefault(each.serial, []).append(each)
    for serial, own in of_unit.items():
        files = len({each.source for each in own})
        found = [t.temperature_degC for each in own for t in each.tables]
        held = [level for level in found if level is not None]
        if files > 1 and held and max(held) - min(held) > LEAST_RISE:
            yield serial, files


def _tell_notes(records: Iterable[TumbleRecord]) -> None:
    """Tell what the reader set aside or assumed."""
    for record in records:
        for note in record.notes:
            remark(f"note: {record.source}: {note}")


def _csv(calibrations: Sequence[Calibration]) -> str:
    """Rows of all tables; the verdicts, which have no column, go to standard error."""
    verdicts = [str(found.verdict) for found in calibrations if found.verdict is not None]
    if verdicts:
        say("\n\n".join(verdicts))
    rows = [{"source": found.source, **row} for found in calibrations for row in found.rows()]
    return csv_of(rows)
