"""accelcal fit: from tables of readings to calibrations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import click

from accelcal.cli.deliver import deliver, refuse_stdin_twice, refuse_to_overwrite
from accelcal.cli.options import (
    apparatus_options,
    data_argument,
    effects_option,
    fixture_angle_option,
    format_option,
    number,
    output_option,
    reference_temperature_option,
)

if TYPE_CHECKING:
    from accelcal.record import TumbleRecord
    from accelcal.results.calibration import Calibration
    from accelcal.results.discovery import Discovery

__all__ = ["fit"]


@click.command()
@data_argument(many=True)
@output_option("the calibration as JSON", metavar="CAL.json")
@click.option(
    "--method",
    type=click.Choice(["least-squares", "closed-form", "sign-corrected", "printed"]),
    default="least-squares",
    show_default=True,
    help="Estimator; the last three are the closed forms (6).",
)
@click.option("--robust", is_flag=True, help="Guard against outliers by comparing the strokes.")
@reference_temperature_option
@click.option("--g", "local_gravity", type=number, metavar="M_S2", help="Local gravity [m/s^2].")
@fixture_angle_option
@apparatus_options
@click.option(
    "--temperature-uncertainty",
    type=number,
    metavar="DEG",
    help="Standard uncertainty of a temperature [degC].",
)
@click.option("--resolution", type=number, metavar="U", help="Step of the output [output unit].")
@click.option("--unit", metavar="UNIT", help="Unit of the output, such as mA.")
@click.option("--serial", metavar="TEXT", help="Serial number of the accelerometer.")
@click.option("--positions", type=click.IntRange(1), metavar="N", help="Positions in a turn.")
@click.option(
    "--coefficients",
    default="K0,K1,K2,K3,M,M_ip",
    show_default=True,
    help="Coefficients to estimate; the others are taken as zero.",
)
@click.option("--strict", is_flag=True, help="Refuse a table that cannot tell all of them apart.")
@click.option(
    "--temperature-laws",
    type=click.Choice(["tables", "readings"]),
    default="tables",
    show_default=True,
    help="Fit the temperature laws to the coefficients of the tables or to all readings.",
)
@click.option(
    "--model",
    metavar="MODEL.json",
    help="Take out the effects of this discovery; their sizes are fitted anew.",
)
@effects_option
@click.option(
    "--spec",
    metavar="SPEC.toml",
    help="Judge against this data sheet; the exit code is 1 where a limit fails.",
)
@format_option("text", "json", "csv")
def fit(
    data: Sequence[str],
    path: str | None,
    method: str,
    robust: bool,
    delta0: float | None,
    coefficients: str,
    strict: bool,
    temperature_laws: str,
    model: str | None,
    spec: str | None,
    form: str,
    **declared: Any,
) -> None:
    """Calibrate from the tables DATA.

    Each table gives bias, scale factor, nonlinearity and misalignment with their uncertainties,
    the residuals by position and stroke, and the checks that warn before a number is believed.
    Options win over the header lines of the table. "-" reads standard input.

    \b
    Examples:
      accelcal fit table.csv
      accelcal fit table.csv --head-uncertainty 1e-5 -o calibration.json
      accelcal fit 2024/*.csv --format csv
      accelcal fit table.csv --spec examples/al15.toml
    """  # noqa: D301  (the \b is click's mark of a paragraph that is not filled)
    refuse_stdin_twice(data)
    refuse_to_overwrite(data, path)
    from accelcal.calibrate import fit as calibrate
    from accelcal.io.tables import read_tables

    known = None if model is None else _model(model)
    calibrations = [
        calibrate(
            record,
            method=method,
            robust=robust,
            delta0=delta0,
            coefficients=[name.strip() for name in coefficients.split(",")],
            strict=strict,
            temperature_laws=temperature_laws,
            model=known,
        )
        for source in data
        for record in _noted(read_tables(source, overrides=declared))
    ]
    if spec is not None:
        calibrations = _judged(calibrations, spec)
    if path is not None:
        deliver(_json(calibrations), path)
    if path != "-":
        deliver(_shown(calibrations, form))
    if any(c.verdict is not None and c.verdict.outcome == "fail" for c in calibrations):
        click.get_current_context().exit(1)


def _noted(records: Iterable[TumbleRecord]) -> Iterator[TumbleRecord]:
    """Tell what the reader set aside or assumed."""
    for record in records:
        for note in record.notes:
            click.echo(f"note: {record.source}: {note}", err=True)
        yield record


def _model(path: str) -> Discovery:
    from accelcal.io.discoveries import read_model

    return read_model(path)


def _judged(calibrations: Sequence[Calibration], spec: str) -> list[Calibration]:
    from dataclasses import replace

    from accelcal.io.specification import read_specification
    from accelcal.verdict import judge

    specification = read_specification(spec)
    return [replace(found, verdict=judge(found, specification)) for found in calibrations]


def _shown(calibrations: Sequence[Calibration], form: str) -> str:
    if form == "json":
        return _json(calibrations)
    if form == "csv":
        verdicts = [str(found.verdict) for found in calibrations if found.verdict]
        click.echo("\n\n".join(verdicts), err=True, nl=bool(verdicts))
        return _csv(calibrations)
    return ("\n\n" + "=" * 100 + "\n\n").join(map(str, calibrations))


def _json(calibrations: Sequence[Calibration]) -> str:
    from accelcal.results.documents import calibrations_to_json

    return calibrations_to_json(calibrations)


def _csv(calibrations: Sequence[Calibration]) -> str:
    import csv
    import io

    rows = [
        {"source": calibration.source, **row}
        for calibration in calibrations
        for row in calibration.rows()
    ]
    text = io.StringIO()
    writer = csv.DictWriter(text, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
