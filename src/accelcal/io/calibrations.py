"""Files of calibrations: one accelerometer chosen by its serial number."""

from __future__ import annotations

from typing import NamedTuple

from accelcal.errors import InputError
from accelcal.io.text import read_document
from accelcal.results.calibration import Calibration
from accelcal.results.documents import calibrations_from_json

__all__ = ["CalibrationFile", "read_calibrations"]


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
        chosen = self._of_serial(serial)
        return chosen if mounting is None else chosen.of_mounting(mounting)

    def _of_serial(self, serial: str | None) -> Calibration:
        chosen = [c for c in self.calibrations if serial in (None, c.serial) or c.serial is None]
        if len(chosen) == 1:
            return chosen[0]
        have = ", ".join(str(c.serial) for c in self.calibrations)
        if not chosen:
            raise InputError(
                f"{self.name}: serial {serial} is asked for, but it calibrates {have};"
                " give the calibration of this accelerometer"
            )
        raise InputError(f"{self.name}: it holds serials {have}; choose one by its serial")


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
    read, calibrations = read_document(source, "calibration", calibrations_from_json)
    return CalibrationFile(read.name, read.sha256 or "", calibrations)
