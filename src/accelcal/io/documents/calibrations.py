"""Files of calibrations: one accelerometer chosen by its serial number."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from accelcal.compensate.triad import refuse_for_triad
from accelcal.errors import DocumentError, InputError
from accelcal.io.documents.of_serial import one_of_serial
from accelcal.io.files.text import Source, Texts, is_document, read_document, read_texts
from accelcal.plural import listed
from accelcal.results.calibration import Calibration
from accelcal.results.checked import read_as
from accelcal.results.discovery import Discovery
from accelcal.results.json_text import parse_json
from accelcal.results.result import StoredResult, all_from_json, parts_of
from accelcal.results.triad import TriadCalibration

if TYPE_CHECKING:
    from accelcal.record import TumbleRecord

__all__ = ["read_calibration"]


class TriadFile(NamedTuple):
    """A file with the calibration of a triad.

    Attributes
    ----------
    name : str
        Name of the file.
    sha256 : str
        SHA-256 of its bytes, in hexadecimal.
    triad : TriadCalibration
        What it holds.
    """

    name: str
    sha256: str
    triad: TriadCalibration

    def choose(self, serial: str | None = None, mounting: str | None = None) -> TriadCalibration:
        """Take it, unless it is of another serial number, or a mounting is asked for."""
        refuse_for_triad(mounting=mounting)
        return one_of_serial([self.triad], serial, self.name, "calibration")


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


def read_calibration(source: Source, serial: str | None = None) -> Calibration:
    """Read the file of a calibration.

    Parameters
    ----------
    source : path, "-" or file object
        A JSON file; ``"-"`` reads standard input.
    serial : str, optional
        Serial number, where the file holds several calibrations.

    Returns
    -------
    Calibration
        The calibration.

    Raises
    ------
    TableError
        If the file cannot be read.
    DocumentError
        If it is no file of a calibration; one of a triad is read by
        `accelcal.TriadCalibration.from_json`.
    InputError
        If it holds several, and not one of this serial number.

    Examples
    --------
    >>> import io
    >>> import accelcal
    >>> found = accelcal.fit(accelcal.simulate(seed=1))
    >>> accelcal.read_calibration(io.StringIO(found.to_json())) == found
    True
    """
    return read_calibrations(source).choose(serial)


def read_calibrations(source: Source) -> CalibrationFile:
    """Read a file of calibrations.

    Parameters
    ----------
    source : path, "-" or file object
        A JSON file; ``"-"`` reads standard input.

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


def read_calibrations_or_models(source: str | Texts) -> CalibrationFile:
    """Read a file of calibrations, or of discoveries that hold them.

    Parameters
    ----------
    source : str
        Path of a JSON file; ``"-"`` reads standard input.

    Returns
    -------
    CalibrationFile
        All calibrations in it; there is none of a unit whose readings did not allow one.

    Raises
    ------
    TableError
        If the file cannot be read.
    DocumentError
        If it is none of these files, or of discoveries that all are without calibrations.
    """
    read, calibrations = read_document(source, "calibration", _of_fits_or_models)
    return CalibrationFile(read.name, read.sha256 or "", calibrations)


def read_records_or_calibrations(
    source: str, overrides: Mapping[str, object]
) -> tuple[TumbleRecord | Calibration, ...]:
    """Read what a calibration is compared with: a table of readings, or another calibration.

    Parameters
    ----------
    source : str
        Path of a file; ``"-"`` reads standard input.
    overrides : mapping of str to object
        Declarations of a table, as of `accelcal.read_tables`; None is not declared.

    Returns
    -------
    tuple of TumbleRecord or of Calibration
        What the file holds, as its contents tell.

    Raises
    ------
    TableError
        If the file cannot be read, or the table is unusable.
    DocumentError
        If it is a document of something else.
    InputError
        If something is declared of a calibration.
    """
    from accelcal.io.tables import read_tables  # here, as few calibrations need it

    texts = read_texts(source, "table or calibration")
    if not is_document(texts[0].text):
        return read_tables(texts, overrides=overrides)
    given = [f"{name}=..." for name, own in overrides.items() if own is not None]
    if given:
        raise InputError(
            f"{listed(given)}: it tells of readings, and calibrations have their own; give it to"
            " accelcal fit"
        )
    return read_calibrations_or_models(texts).calibrations


def _of_fits_or_models(text: str) -> tuple[Calibration, ...]:
    results = _results(text, Discovery)
    known = (own.calibration if isinstance(own, Discovery) else own for own in results)
    found = tuple(calibration for calibration in known if calibration is not None)
    if not found:
        raise DocumentError(
            "a discovery without its calibration; write it again by accelcal discover, or"
            " use it by accelcal fit --model, and give what this writes"
        )
    return found


def read_calibrations_or_triad(source: str) -> CalibrationFile | TriadFile:
    """Read a file of calibrations, of accelerometers or of a triad.

    Parameters
    ----------
    source : str
        Path of a JSON file; ``"-"`` reads standard input.

    Returns
    -------
    CalibrationFile or TriadFile
        What it holds.

    Raises
    ------
    TableError
        If the file cannot be read.
    DocumentError
        If it is none of these files.
    """
    of_text = partial(_results, other=TriadCalibration)
    read, found = read_document(source, "calibration", of_text)
    if isinstance(found[0], TriadCalibration):
        return TriadFile(read.name, read.sha256 or "", found[0])
    return CalibrationFile(read.name, read.sha256 or "", found)


def _results(text: str, other: type[StoredResult]) -> tuple[Any, ...]:
    """Calibrations of a JSON text, or results of another kind where their schema is there."""
    document = parse_json(text, writer=f"{Calibration._WRITER} or {other._WRITER}")
    schema = document.get("schema") if isinstance(document, dict) else None
    is_other = schema == other.SCHEMA
    if schema == TriadCalibration.SCHEMA and not is_other:
        raise DocumentError("the calibration of a triad; give that of one accelerometer")
    kind = other if is_other else Calibration
    return read_as(partial(parts_of, kind), document, kind._WRITER)
