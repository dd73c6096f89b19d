"""Files of results, of the kinds that their schemas tell; one is chosen by its serial number."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from accelcal.compensate.triad import refuse_for_triad
from accelcal.errors import DocumentError, InputError
from accelcal.io.files.text import Source, Texts, is_document, read_document, read_texts
from accelcal.io.of_serial import all_of_serial, one_of_serial
from accelcal.plural import listed
from accelcal.results.calibration import Calibration
from accelcal.results.discovery import Discovery
from accelcal.results.documents.checked import checked, read_as, schema_of
from accelcal.results.documents.json_text import parse_json
from accelcal.results.documents.stored import StoredResult, part_of, parts_of
from accelcal.results.stand_discovery import StandDiscovery
from accelcal.results.triad import TriadCalibration

if TYPE_CHECKING:
    from accelcal.record import TumbleRecord

__all__ = ["read_calibration", "read_discovery"]


class ResultFile(NamedTuple):
    """A file of results."""

    name: str
    sha256: str  # SHA-256 of its bytes, in hexadecimal
    results: tuple[Any, ...]  # what it holds, all of one kind
    stand: StandDiscovery | None = None  # what its discoveries tell of their stand

    @property
    def calibrations(self) -> tuple[Calibration, ...]:
        """Its results where they are calibrations, else nothing."""
        return tuple(own for own in self.results if isinstance(own, Calibration))

    def choose(self, serial: str | None = None, mounting: str | None = None) -> Any:
        """Choose the result of a serial number; one that has none fits any.

        Without a serial number the file must hold one result. Of a calibration, the tables of a
        mounting alone are kept where one is asked for. Raises InputError if there is none, or
        several, or no table of this mounting.
        """
        is_discovery = isinstance(self.results[0], Discovery)
        what = "discovery" if is_discovery else "calibration"
        chosen = one_of_serial(self.results, serial, self.name, what)
        if isinstance(chosen, TriadCalibration):
            refuse_for_triad(mounting=mounting)
        return chosen if mounting is None else chosen.of_mounting(mounting)

    def model_of(self, serial: str | None) -> Any:
        """Choose the only result, whatever its serial number, or of several that of this one.

        The effects of one unit may be those of its type or stand.
        """
        return self.results[0] if len(self.results) == 1 else self.choose(serial)

    def only(self) -> Any:
        """Return the only result, for those who take one model for many units.

        Raises InputError if there are several.
        """
        if len(self.results) > 1:
            have = ", ".join(str(found.serial) for found in self.results)
            raise InputError(
                f"{self.name}: it holds the discoveries of {have}, and all tables take one model;"
                " save one item of the list as a file of its own"
            )
        return self.results[0]

    def of_serial(self, serial: str) -> ResultFile:
        """Keep the results of one serial number, or of none, without the stand.

        Raises InputError if there is none.
        """
        kept = tuple(all_of_serial(self.results, serial))
        if not kept:
            have = ", ".join(str(own.serial) for own in self.results)
            raise InputError(f"{self.name}: no serial {serial!r}; it holds {have}")
        return self._replace(results=kept, stand=None)


def read_results(
    source: Source | Texts, *kinds: type[StoredResult], what: str = "calibration"
) -> ResultFile:
    """Read a file of results of one of some kinds; `what` it is to be, for messages.

    Raises TableError if the file cannot be read. Raises DocumentError if it is no file of such
    results.
    """
    read, (results, stand) = read_document(source, what, partial(_results, kinds=kinds))
    return ResultFile(read.name, read.sha256 or "", results, stand)


def _results(
    text: str, kinds: tuple[type[StoredResult], ...]
) -> tuple[tuple[Any, ...], StandDiscovery | None]:
    """Results of a JSON text, and what discoveries tell of their stand."""
    writers = " or ".join(own._WRITER for own in kinds)
    document = parse_json(text, writer=writers)
    kind = read_as(partial(_kind_of, kinds=kinds), document, writers)
    results = read_as(partial(parts_of, kind), document, kind._WRITER)
    stand = None
    if kind is Discovery and document.get("stand"):
        of_stand = partial(checked, key="stand", kind=partial(part_of, StandDiscovery))
        stand = read_as(of_stand, document, kind._WRITER)
    return results, stand


def _kind_of(document: Any, kinds: tuple[type[StoredResult], ...]) -> type[StoredResult]:
    """Which of some kinds a document is; a list of several may leave it to their own schemas."""
    by_schema = {own.SCHEMA: own for own in kinds}
    given = document if isinstance(document, dict) else {}
    listed = [own.SCHEMA for own in kinds if own._SEVERAL in given]
    right = schema_of(*by_schema, remedies=kinds[0]._REMEDIES)
    return by_schema[checked(document, "schema", right, *listed[:1])]


def read_calibration(source: Source, serial: str | None = None) -> Calibration | TriadCalibration:
    """Read the file of a calibration, of one accelerometer or of a triad.

    Parameters
    ----------
    source : path, "-" or file object
        A JSON file; ``"-"`` reads standard input.
    serial : str, optional
        Serial number, where the file holds several calibrations.

    Returns
    -------
    Calibration or TriadCalibration
        What the file holds. `accelcal.Calibration.from_json` reads that of one accelerometer alone.

    Raises
    ------
    TableError
        If the file cannot be read.
    DocumentError
        If it is no file of a calibration.
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
    found: Calibration | TriadCalibration = read_results(
        source, Calibration, TriadCalibration
    ).choose(serial)
    return found


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
    found: Discovery = read_results(source, Discovery, what="model").model_of(serial)
    return found


def read_models(source: str) -> ResultFile:
    """Read a file of discoveries whose effects are to be used.

    Raises as `read_results` does, and InputError if an effect is not in the catalogue, or breaks
    its rules.
    """
    from accelcal.effects.found import disturbances

    file = read_results(source, Discovery, what="model")
    try:
        for found in file.results:
            disturbances(found.effects)
    except InputError as error:
        raise error.at(source) from None
    return file


def read_known(source: str | Texts) -> tuple[Calibration, ...]:
    """Read calibrations, or those that discoveries hold: none of a unit that allowed none.

    Raises as `read_results` does, and DocumentError if all are discoveries without calibrations.
    """
    file = read_results(source, Calibration, Discovery)
    known = (own.calibration if isinstance(own, Discovery) else own for own in file.results)
    found = tuple(calibration for calibration in known if calibration is not None)
    if not found:
        raise DocumentError(
            "a discovery without its calibration; write it again by accelcal discover, or"
            " use it by accelcal fit --model, and give what this writes"
        ).at(file.name)
    return found


def read_later(
    source: str, overrides: Mapping[str, object]
) -> tuple[TumbleRecord | Calibration, ...]:
    """Read what a calibration is compared with: a table of readings, or another calibration.

    Overrides are declarations of a table, as of `accelcal.read_tables`; None is not declared.
    Raises TableError or DocumentError if the file cannot be read or used, and InputError if
    something is declared of a calibration.
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
    return read_known(texts)
