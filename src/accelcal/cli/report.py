"""accelcal report: a result as a page, or as a digital calibration certificate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import deliver
from accelcal.cli.files import Command, FileToRead, FileToWrite
from accelcal.cli.verdicts import exit_where_failed, judged
from accelcal.errors import InputError

if TYPE_CHECKING:
    from accelcal.io.documents import ResultFile
    from accelcal.record import TumbleRecord


@click.command(cls=Command)
@click.argument("result", type=FileToRead(), metavar="RESULT.json")
@option.output("the report", metavar="FILE.(html|md|pdf)")
@option.specification
@option.file(
    "--data",
    "DATA",
    "Readings of a discovery, for the pictures of the effects; may be repeated.",
    multiple=True,
)
@option.text("--serial", "TEXT", "Report this serial number only.")
@option.valued(
    FileToWrite("XML", ".xml"),
    "--dcc",
    "FILE.xml",
    "Write a digital calibration certificate here.",
    name="certificate",
)
@option.file(
    "--dcc-data",
    "LAB.toml",
    "Laboratory, customer and persons of the certificate; without it they are not stated.",
    name="laboratory",
)
@option.effects()
def report(
    result: str,
    path: str | None,
    spec: str | None,
    data: Sequence[str],
    serial: str | None,
    certificate: str | None,
    laboratory: str | None,
) -> None:
    """Make a page of the calibration or discovery RESULT.json.

    The page is one file: HTML for screen, phone and paper, Markdown, or a PDF that a browser on
    this machine prints. It needs no network. A calibration can also be written as a digital
    calibration certificate (DCC, XML).

    \b
    Examples:
      accelcal report calibration.json -o calibration.html
      accelcal report calibration.json -o calibration.pdf --spec examples/al15.toml
      accelcal report model.json -o discovery.html --data table.csv
      accelcal report calibration.json --dcc certificate.xml --dcc-data examples/laboratory.toml
    """
    if path is None and certificate is None:
        raise InputError("nothing to write; name a page with -o, or a certificate with --dcc")
    if laboratory is not None and certificate is None:
        raise InputError("--dcc-data tells of a certificate; name its file with --dcc")
    from accelcal.io.documents import read_results
    from accelcal.results.calibration import Calibration
    from accelcal.results.discovery import Discovery

    found = read_results(result, Calibration, Discovery, what="result")
    found = found if serial is None else found.of_serial(serial)
    found = found if spec is None else _judged(found, spec)
    if path is not None:
        _write_page(found, path, data)
    if certificate is not None:
        deliver(_certificate(found, laboratory), certificate)
    exit_where_failed(found.calibrations)


def _judged(found: ResultFile, spec: str) -> ResultFile:
    from accelcal.io.toml.specification import read_specification

    if not found.calibrations:
        raise InputError(f"{found.name}: a discovery has no limits to judge; leave --spec out")
    return found._replace(results=judged(found.calibrations, read_specification(spec)))


def _write_page(found: ResultFile, path: str, data: Sequence[str]) -> None:
    from accelcal.page.write import Result, write_report

    stand = [] if found.stand is None else [found.stand]
    results: list[Result] = [*found.results, *stand]
    write_report(results, path, records=_records(found, data))


def _records(found: ResultFile, data: Sequence[str]) -> list[TumbleRecord | None]:
    """The record of each discovery: of its serial number, or in the order given."""
    if not data:
        return []
    if found.calibrations:
        raise InputError(f"{found.name}: a calibration holds its residuals; leave --data out")
    from accelcal.io.tables import read_tables

    records = [record for source in data for record in read_tables(source)]
    if len(records) != len(found.results):
        raise InputError(
            f"{len(records)} records by --data, but {found.name} holds {len(found.results)}"
            " discoveries; give the tables that were searched, in their order"
        )
    return list(records)


def _certificate(found: ResultFile, laboratory: str | None) -> str:
    from accelcal.certificate.dcc import certificate
    from accelcal.io.toml.laboratory import read_laboratory

    if len(found.calibrations) != 1:
        raise InputError(
            f"{found.name}: a certificate is of one calibration, and it holds"
            f" {len(found.calibrations)}; choose one with --serial, or give that of accelcal fit"
        )
    known = None if laboratory is None else read_laboratory(laboratory)
    return certificate(found.calibrations[0], known)
