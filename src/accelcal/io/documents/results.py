"""Files of results of any sort, told by their schema."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

from accelcal.errors import InputError
from accelcal.io.documents.of_serial import all_of_serial
from accelcal.io.files.text import read_document
from accelcal.results.calibration import Calibration
from accelcal.results.checked import checked, read_as, schema_of
from accelcal.results.discovery import Discovery
from accelcal.results.json_text import parse_json
from accelcal.results.result import part_of, parts_of
from accelcal.results.stand_discovery import StandDiscovery

_WRITERS = "accelcal fit or accelcal discover"


class ResultFile(NamedTuple):
    """What a file of results holds.

    Attributes
    ----------
    name : str
        Name of the file.
    calibrations : tuple of Calibration
        Its calibrations; empty in a file of discoveries.
    discoveries : tuple of Discovery
        Its discoveries; empty in a file of calibrations.
    stand : StandDiscovery or None
        What the discoveries tell of their stand.
    """

    name: str
    calibrations: tuple[Calibration, ...]
    discoveries: tuple[Discovery, ...]
    stand: StandDiscovery | None

    def of_serial(self, serial: str) -> ResultFile:
        """Keep the results of one serial number; one that has none fits any.

        Returns
        -------
        ResultFile
            Without the stand.

        Raises
        ------
        InputError
            If there is none.
        """
        calibrations = tuple(all_of_serial(self.calibrations, serial))
        discoveries = tuple(all_of_serial(self.discoveries, serial))
        if not (calibrations or discoveries):
            serials = [own.serial for own in self.calibrations or self.discoveries]
            have = ", ".join(map(str, serials))
            raise InputError(f"{self.name}: no serial {serial!r}; it holds {have}")
        return ResultFile(self.name, calibrations, discoveries, None)


def read_results(source: str) -> ResultFile:
    """Read what ``accelcal fit`` or ``accelcal discover`` wrote.

    Parameters
    ----------
    source : str
        Path of a JSON file; ``"-"`` reads standard input.

    Returns
    -------
    ResultFile
        Its results.

    Raises
    ------
    TableError
        If the file cannot be read.
    DocumentError
        If it is none of these files.
    """

    def read(text: str) -> ResultFile:
        return read_as(_results, parse_json(text, writer=_WRITERS), _WRITERS)

    given, found = read_document(source, "result", read)
    return found._replace(name=given.name)


def _results(document: Any) -> ResultFile:
    schema = checked(document, "schema", schema_of(Calibration.SCHEMA, Discovery.SCHEMA))
    if schema == Calibration.SCHEMA:
        return ResultFile("", parts_of(Calibration, document), (), None)
    stand = (
        checked(document, "stand", partial(part_of, StandDiscovery))
        if document.get("stand")
        else None
    )
    return ResultFile("", (), parts_of(Discovery, document), stand)
