"""accelcal compare: where a calibration and a record, or another calibration, disagree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import remark
from accelcal.cli.files import Command, FileToRead
from accelcal.cli.forms import deliver_forms
from accelcal.errors import InputError
from accelcal.plural import listed

if TYPE_CHECKING:
    from accelcal.record import TumbleRecord
    from accelcal.results.calibration import Calibration
    from accelcal.results.calibration_comparison import CalibrationComparison
    from accelcal.results.disagreement import Disagreement


@click.command(cls=Command)
@click.argument("calibration", type=FileToRead(), metavar="CAL.json")
@option.data()
@option.text("--serial", "TEXT", "Compare this unit only, if a file holds several.")
@click.option(
    "--same-head/--other-head",
    "same_head",
    default=None,
    help="Whether both were measured on the same head and clamping [default: as their header"
    " lines '# head: NAME' say].",
)
@option.temperature(
    "--temperature", "DEG", "Temperature at which to compare two calibrations [degC; default: T0]."
)
@option.angle(
    "--fixture-uncertainty",
    "RAD",
    "Standard uncertainty of the fixture angle of each of both tests [rad; default: it is not"
    " counted].",
)
@option.effects()
@option.apparatus
@option.format("text", "json")
def compare(
    calibration: str,
    data: str,
    serial: str | None,
    same_head: bool | None,
    temperature: float | None,
    fixture_uncertainty: float | None,
    form: str,
    **declared: float | str | None,
) -> None:
    """Show where the readings of DATA disagree with CAL.json.

    Nothing is fitted: the calibration, with its effects, predicts each reading. Differences that
    noise, head, launches and the uncertainty of the calibration do not explain are shown by
    position, stroke, cycle, time, temperature and run. A MODEL.json of accelcal discover holds the
    calibration with the effects that it found, and may stand in place of CAL.json.

    DATA may also be a later calibration, NEW.json: each coefficient and each size of an effect is
    then compared by E_n, all of them together, and what they indicate.

    \b
    Examples:
      accelcal fit table.csv -o calibration.json
      accelcal compare calibration.json next-year.csv
      accelcal compare calibration.json next-year.json
    """
    from accelcal.io.documents import read_known, read_later
    from accelcal.io.of_serial import pairs_of_units
    from accelcal.results.documents.stored import all_to_json

    known, later = read_known(calibration), read_later(data, declared)
    pairs, alone = pairs_of_units(known, later, serial)
    if alone:
        remark(f"note: not compared, in one of the files alone: {listed(alone)}")
    common: dict[str, Any] = {"same_head": same_head, "fixture_uncertainty": fixture_uncertainty}
    found = [_compared(*pair, temperature, common) for pair in pairs]
    forms = {
        "text": lambda: "\n\n".join(map(str, found)),
        "json": lambda: all_to_json(found),
    }
    deliver_forms(forms, None, form)


def _compared(
    known: Calibration,
    later: Calibration | TumbleRecord,
    temperature: float | None,
    common: dict[str, Any],
) -> CalibrationComparison | Disagreement:
    """Compare what a second file has of a unit with its calibration."""
    from accelcal.results.calibration import Calibration

    if isinstance(later, Calibration):
        from accelcal.discovery.two_calibrations.compare import compare_calibrations

        return compare_calibrations(known, later, temperature=temperature, **common)
    from accelcal.discovery.new_record.compare import compare as compare_readings

    if temperature is not None:
        raise InputError("temperature=...: for two calibrations; readings have their own")
    return compare_readings(known, later, **common)
