"""A calibration as a digital calibration certificate (DCC) of the PTB, version 3.3.0."""

from __future__ import annotations

from os import PathLike

from accelcal.arguments.kinds import expect, path_text
from accelcal.atomic import write_text
from accelcal.certificate.administrative import administrative_data
from accelcal.certificate.results import measurement_results
from accelcal.certificate.xml import dcc, written
from accelcal.io.toml.laboratory import Laboratory, read_laboratory
from accelcal.results.calibration import Calibration

__all__ = ["VERSION", "certificate", "write_certificate"]

VERSION = "3.3.0"
"""Version of the schema ``dcc.xsd``; it takes version 2.2.1 of the D-SI."""


def certificate(calibration: Calibration, known: Laboratory | None = None) -> str:
    """Write a certificate.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    known : Laboratory, optional
        Laboratory, customer and persons; without it they are ``not stated``.

    Returns
    -------
    str
        XML; the same calibration gives the same text.

    Raises
    ------
    InputError
        If no day of the test is known, which a certificate must state.

    Notes
    -----
    Values that have a unit of g need the local gravity to be in units of the SI. Without it, and
    for units that the SI does not know, they stand as text.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> certificate(calibration, Laboratory(performed_from="2026-11-21"))[:38]
    '<?xml version="1.0" encoding="UTF-8"?>'
    """
    expect(calibration, Calibration)
    known = Laboratory() if known is None else known
    expect(known, Laboratory)
    root = dcc(
        "digitalCalibrationCertificate",
        administrative_data(calibration, known),
        measurement_results(calibration),
        schemaVersion=VERSION,
    )
    return written(root, VERSION)


def write_certificate(
    calibration: Calibration,
    path: str | PathLike[str],
    laboratory: str | PathLike[str] | None,
) -> None:
    """Write a certificate to a file.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    path : path
        File to write, whole or not at all.
    laboratory : path or None
        TOML file of laboratory, customer and persons.

    Raises
    ------
    InputError
        If no day of the test is known, or the file of the laboratory breaks a rule.
    TableError
        If that file cannot be read.
    """
    known = None if laboratory is None else read_laboratory(path_text(laboratory))
    write_text(path_text(path), certificate(calibration, known))
