"""Files of discoveries: one chosen by its serial number."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from accelcal.errors import InputError
from accelcal.io.documents.of_serial import one_of_serial
from accelcal.io.files.text import Source, read_document
from accelcal.results.discovery import Discovery
from accelcal.results.result import all_from_json

__all__ = ["DiscoveryFile", "read_discovery", "read_models"]


class DiscoveryFile(NamedTuple):
    """A file of discoveries.

    Attributes
    ----------
    name : str
        Name of the file.
    discoveries : tuple of Discovery
        What it holds.
    """

    name: str
    discoveries: tuple[Discovery, ...]

    def choose(self, serial: str | None = None) -> Discovery:
        """Choose one discovery.

        Parameters
        ----------
        serial : str, optional
            Serial number; without it the file must hold one discovery.

        Returns
        -------
        Discovery
            The only one, whatever its serial number, as the effects of one unit may be those of its
            type or stand; of several that of this serial number.

        Raises
        ------
        InputError
            If several are there, and none or more than one of this serial number.
        """
        if len(self.discoveries) == 1:
            return self.discoveries[0]
        return one_of_serial(self.discoveries, serial, self.name, "discovery")

    def only(self) -> Discovery:
        """Return the only discovery, for those who take one for many units.

        Raises
        ------
        InputError
            If there are several.
        """
        if len(self.discoveries) > 1:
            have = ", ".join(str(found.serial) for found in self.discoveries)
            raise InputError(
                f"{self.name}: it holds the discoveries of {have}, and all tables take one model;"
                " save one item of the list as a file of its own"
            )
        return self.discoveries[0]


def read_discovery(source: Source, serial: str | None = None) -> Discovery:
    """Read the file of a discovery.

    Parameters
    ----------
    source : path, "-" or file object
        A JSON file; ``"-"`` reads standard input.
    serial : str, optional
        Serial number, where the file holds several discoveries.

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
    InputError
        If it holds several, and not one of this serial number.

    Examples
    --------
    >>> import io
    >>> import accelcal
    >>> found = accelcal.discover(accelcal.simulate(seed=1))
    >>> accelcal.read_discovery(io.StringIO(found.to_json())) == found
    True
    """
    return _read(source).choose(serial)


def read_models(source: str) -> DiscoveryFile:
    """Read a file of discoveries whose effects are to be used.

    Parameters
    ----------
    source : str
        Path of a JSON file; ``"-"`` reads standard input.

    Returns
    -------
    DiscoveryFile
        All discoveries in it.

    Raises
    ------
    TableError
        If the file cannot be read.
    InputError
        If it is no file of a discovery, or an effect is not in the catalogue, or breaks its rules.
    """
    from accelcal.effects.found import disturbances

    file = _read(source)
    try:
        for found in file.discoveries:
            disturbances(found.effects)
    except InputError as error:
        raise error.at(source) from None
    return file


def _read(source: Source) -> DiscoveryFile:
    read, discoveries = read_document(source, "model", partial(all_from_json, Discovery))
    return DiscoveryFile(read.name, discoveries)
