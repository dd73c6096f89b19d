"""Files of results: documents of the kinds that their schemas tell, and frames of a batch."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from accelcal.compensate.triad import refuse_for_triad
from accelcal.errors import DocumentError, InputError
from accelcal.io.declarations import Overrides
from accelcal.io.engines import exact_numbers
from accelcal.io.files.text import Source, Texts, is_document, read_document, read_text, read_texts
from accelcal.io.of_serial import all_of_serial, one_of_serial
from accelcal.plural import listed
from accelcal.recalibrations.entries import Entry, entries_of
from accelcal.results.calibration import Calibration
from accelcal.results.discovery import Discovery
from accelcal.results.documents.checked import checked, read_as, schema_of
from accelcal.results.documents.json_text import parse_json
from accelcal.results.documents.stored import StoredResult, all_from_json, part_of, parts_of
from accelcal.results.stand_discovery import StandDiscovery
from accelcal.results.triad import TriadCalibration

if TYPE_CHECKING:
    import pandas as pd

    from accelcal.record import TumbleRecord

__all__ = ["read_calibration", "read_discovery"]

_DECIMAL_COMMA = re.compile(r'[;\t]"?-?\d+,\d+(?:[eE][+-]?\d+)?"?(?:[;\t]|$)', re.MULTILINE)
"""A number as a German spreadsheet writes it."""


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
            problem = f"it holds the discoveries of {have}, and all tables take one model"
            remedy = "save one item of the list as a file of its own"
            raise InputError(f"{self.name}: {problem}; {remedy}")
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
    file = read_results(source, Calibration, TriadCalibration)
    found: Calibration | TriadCalibration = file.choose(serial)
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


def read_later(source: str, overrides: Overrides) -> tuple[TumbleRecord | Calibration, ...]:
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
        problem = f"{listed(given)}: it tells of readings, and calibrations have their own"
        raise InputError(f"{problem}; give it to accelcal fit")
    return read_known(texts)


# -- what a unit was through the years -------------------------------------------------------------


def read_entries(paths: Sequence[str]) -> list[Entry]:
    """Read what some files say of units.

    They are frames of ``accelcal batch`` (CSV or Parquet) or documents of ``accelcal fit`` (JSON),
    and an entry is of one table. Raises InputError if a file cannot be read, or is neither of the
    two.
    """
    return [entry for path in paths for entry in _read(path)]


def _read(path: str) -> list[Entry]:
    name, text, *_ = read_text(path, "result")
    read = partial(all_from_json, Calibration) if is_document(text) else _frame
    try:
        return entries_of(read(text))
    except InputError as error:
        raise error.at(name) from None


def _frame(text: str) -> pd.DataFrame:
    from io import StringIO

    import pandas as pd

    headings = text.partition("\n")[0]
    separator = max(",;\t", key=headings.count)
    _refuse_cut(text, separator)
    options: Any = {
        "sep": separator,
        "decimal": "," if separator != "," and _DECIMAL_COMMA.search(text) else ".",
        "dtype": {"serial": str, "date": str, "run": str, "source": str, "sha256": str},
        "keep_default_na": False,  # only what is empty is missing: a serial may be NA
        "na_values": [""],
        "low_memory": False,  # in parts, a column of texts and empty cells would have two types
        **exact_numbers(),
    }
    try:
        frame: pd.DataFrame = pd.read_csv(StringIO(text), **options)
    except ValueError:  # that of the parser is one too
        remedy = "give what accelcal batch -o RESULTS.csv wrote, or fit the table first"
        raise InputError(f"not a frame of results; {remedy}") from None
    return frame


def _refuse_cut(text: str, separator: str) -> None:
    """Refuse a last row that ends too soon: of its last number some digits may be lost."""
    bare = text.strip("\n")
    ends = [bare.rpartition("\n")[2], bare.partition("\n")[0]]
    there, wanted = (len(next(csv.reader([row], delimiter=separator), ())) for row in ends)
    if there < wanted:
        problem = f"the last row has {there} of {wanted} fields: the file was cut off"
        raise InputError(f"{problem}; copy it again")
