"""Files of calibrations: one accelerometer chosen by its serial number."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from accelcal.io.documents.of_serial import one_of_serial
from accelcal.io.text import read_document
from accelcal.results.calibration import Calibration
from accelcal.results.result import all_from_json


class CalibrationFile(NamedTuple):
    """A file of calibrations.

    Attributes
    ----------
    name : str
        Name of the file.
    sha256 : str
        SHA-256 of its bytes, in hexadecimal.
    calibrations : tuple of Calibration
        What it holds.
    """

    name: str
    sha256: str
    calibrations: tuple[Calibration, ...]

    def choose(self, serial: str | None = None, mounting: str | None = None) -> Calibration:
        """Choose one calibration.

        Parameters
        ----------
        serial : str, optional
            Serial number; without it the file must hold one calibration.
        mounting : str, optional
            One of `accelcal.geometry.MOUNTINGS`, whose tables alone are kept.

        Returns
        -------
        Calibration
            The calibration of this serial number; one that has none fits any.

        Raises
        ------
        InputError
            If there is none, or several, or no table of this mounting.
        """
        chosen = one_of_serial(self.calibrations, serial, self.name, "calibration")
        return chosen if mounting is None else chosen.of_mounting(mounting)


def read_calibrations(source: str) -> CalibrationFile:
    """Read a file of calibrations.

    Parameters
    ----------
    source : str
        Path of a JSON file; ``"-"`` reads standard input.

    Returns
    -------
    CalibrationFile
        All calibrations in it.

    Raises
    ------
    TableError
        If the file cannot be read.
    DocumentError
        If it is no file of calibrations.
    """
    of_text = partial(all_from_json, Calibration)
    read, calibrations = read_document(source, "calibration", of_text)
    return CalibrationFile(read.name, read.sha256 or "", calibrations)
