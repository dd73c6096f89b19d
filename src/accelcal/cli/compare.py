"""accelcal compare: where a calibration and a record, or another calibration, disagree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import click

from accelcal.cli.files import Command, FileToRead
from accelcal.cli.forms import deliver_forms
from accelcal.cli.options import (
    apparatus_options,
    data_argument,
    effects_option,
    format_option,
    temperature_option,
    text_option,
)
from accelcal.errors import InputError
from accelcal.plural import listed

if TYPE_CHECKING:
    from accelcal.io.documents.calibrations import CalibrationFile
    from accelcal.results.calibration_comparison import CalibrationComparison
    from accelcal.results.disagreement import Disagreement


@click.command(cls=Command)
@click.argument("calibration", type=FileToRead(), metavar="CAL.json")
@data_argument()
@text_option("--serial", "TEXT", "Compare this unit only, if a file holds several.")
@click.option(
    "--same-head/--other-head",
    "same_head",
    default=None,
    help="Whether both were measured on the same head and clamping [default: as their header"
    " lines '# head: NAME' say].",
)
@temperature_option(
    "--temperature", "DEG", "Temperature at which to compare two calibrations [degC; default: T0]."
)
@effects_option
@apparatus_options
@format_option("text", "json")
def compare(
    calibration: str,
    data: str,
    serial: str | None,
    same_head: bool | None,
    temperature: float | None,
    form: str,
    **declared: float | str | None,
) -> None:
    """Show where the readings of DATA disagree with CAL.json.

    Nothing is fitted: the calibration, with its effects, predicts each reading. Differences that
    noise, head, launches and the uncertainty of the calibration do not explain are shown by
    position, stroke, cycle, time, temperature and run. A MODEL.json of accelcal discover holds the
    calibration with the effects that it found, and may stand in place of CAL.json.

    DATA may also be a later calibration, NEW.json: each coefficient is then compared by E_n, all of
    them together, and what they indicate.

    \b
    Examples:
      accelcal fit table.csv -o calibration.json
      accelcal compare calibration.json next-year.csv
      accelcal compare calibration.json next-year.json
    """
    from accelcal.io.documents.calibrations import is_document, read_calibrations_or_models
    from accelcal.results.result import all_to_json

    known = read_calibrations_or_models(calibration)
    found: Sequence[CalibrationComparison] | Sequence[Disagreement]
    if is_document(data):
        _refuse_declared(declared)
        later = read_calibrations_or_models(data)
        found = _with_calibrations(known, later, serial, same_head, temperature)
    else:
        if temperature is not None:
            raise InputError("--temperature is for two calibrations; readings have their own")
        found = _with_readings(known, data, serial, same_head, declared)
    forms = {
        "text": lambda: "\n\n".join(map(str, found)),
        "json": lambda: all_to_json(found),
    }
    deliver_forms(forms, None, form)


def _refuse_declared(declared: Mapping[str, float | str | None]) -> None:
    """Refuse what is declared of readings, where none are given."""
    given = [f"--{name.replace('_', '-')}" for name, own in declared.items() if own is not None]
    if given:
        raise InputError(
            f"{listed(given)}: it tells of readings, and calibrations have their own; give it to"
            " accelcal fit"
        )


def _with_calibrations(
    known: CalibrationFile,
    later: CalibrationFile,
    serial: str | None,
    same_head: bool | None,
    temperature: float | None,
) -> list[CalibrationComparison]:
    """Compare the calibrations of a second file with those of the first."""
    from accelcal.discovery.two_calibrations.compare import compare_calibrations

    chosen = [later.choose(serial)] if serial else later.calibrations
    return [
        compare_calibrations(
            known.choose((serial or new.serial) if known.calibrations[1:] else None),
            new,
            same_head=same_head,
            temperature=temperature,
        )
        for new in chosen
    ]


def _with_readings(
    known: CalibrationFile,
    data: str,
    serial: str | None,
    same_head: bool | None,
    declared: Mapping[str, float | str | None],
) -> list[Disagreement]:
    """Compare the records of a table with the calibrations."""
    from accelcal.discovery.new_record.compare import compare as simulate_and_compare
    from accelcal.io.documents.of_serial import records_of_serial
    from accelcal.io.tables import read_tables

    return [
        simulate_and_compare(known.choose(serial or record.serial), record, same_head=same_head)
        for record in records_of_serial(read_tables(data, overrides=declared), serial)
    ]
