"""Files of discoveries."""

from __future__ import annotations

from accelcal.errors import InputError
from accelcal.io.text import Source, read_document
from accelcal.results.discovery import Discovery
from accelcal.results.json_text import parse_json

__all__ = ["read_discovery", "read_model"]


def read_discovery(source: Source) -> Discovery:
    """Read the file of a discovery.

    Parameters
    ----------
    source : path, "-" or file object
        A JSON file; ``"-"`` reads standard input.

    Returns
    -------
    Discovery
        The discovery.

    Raises
    ------
    TableError
        If the file cannot be read.
    DocumentError
        If it is no file of a discovery.
    """

    def read(text: str) -> Discovery:
        return Discovery.from_document(parse_json(text, writer=Discovery.WRITER))

    return read_document(source, "model", read)[1]


def read_model(source: str) -> Discovery:
    """Read the file of a discovery whose effects are to be used.

    Parameters
    ----------
    source : str
        Path of a JSON file; ``"-"`` reads standard input.

    Returns
    -------
    Discovery
        The discovery.

    Raises
    ------
    TableError
        If the file cannot be read.
    InputError
        If it is no file of a discovery, or an effect is not in the catalogue, or breaks its rules.
    """
    from accelcal.discovery.known import disturbances

    found = read_discovery(source)
    try:
        disturbances(found.effects)
    except InputError as error:
        raise error.at(source) from None
    return found
