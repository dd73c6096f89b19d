"""Results that are documents of JSON, and are read back from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar, overload

from accelcal.arguments.kinds import path_text
from accelcal.errors import InputError
from accelcal.results.documents.checked import DamageError, checked, list_of, read_as, schema_of
from accelcal.results.documents.fields import ReadByFields, document_of
from accelcal.results.documents.json_text import json_text, parse_json, read_json

if TYPE_CHECKING:
    from os import PathLike

__all__ = ["StoredResult", "all_from_json", "all_to_json", "part_of", "parts_of"]

Result = TypeVar("Result", bound="StoredResult")


class StoredResult(ReadByFields):
    """A result that is a document of JSON, and is read back from it."""

    __slots__ = ()

    SCHEMA: ClassVar[str]
    """Type and version of such documents."""

    _WRITER: ClassVar[str]
    """The command that writes such documents, for messages."""

    _REMEDIES: ClassVar[Mapping[str, str]] = MappingProxyType({})
    """Schema of another document -> what to do with one that is given in place of this."""

    _SEVERAL: ClassVar[str] = ""
    """Key of the list in which several stand in one document."""

    def to_document(self) -> dict[str, Any]:
        """Return the result as the document that `to_json` writes, of schema `SCHEMA`."""
        return {"schema": self.SCHEMA, **self._contents()}

    @overload
    def to_json(self, path: None = None) -> str: ...
    @overload
    def to_json(self, path: str | PathLike[str]) -> None: ...
    def to_json(self, path: str | PathLike[str] | None = None) -> str | None:
        """Write the result as JSON.

        Parameters
        ----------
        path : path, optional
            File to write, whole or not at all; without it the text is returned.

        Returns
        -------
        str or None
            The JSON text, in which numbers keep all their digits; None where a file has it.
        """
        text = json_text(self.to_document())
        if path is None:
            return text
        from accelcal.atomic import write_text

        write_text(path_text(path), text)
        return None

    @classmethod
    def from_document(cls, document: Any) -> Self:
        """Read the result from its document.

        Parameters
        ----------
        document : mapping
            What `to_document` returns.

        Returns
        -------
        StoredResult
            Equal to the one that was written.

        Raises
        ------
        DocumentError
            If the document is of another type or version, incomplete or damaged; the message
            names the key.
        """
        return read_as(partial(part_of, cls), document, cls._WRITER)

    @classmethod
    def from_json(cls, source: str | PathLike[str]) -> Self:
        """Read a result from JSON text, or from a file.

        Parameters
        ----------
        source : str or path
            What `to_json` returns, or the path of the file that it wrote.

        Returns
        -------
        StoredResult
            Equal to the one that was written, but for bytes of names that are not UTF-8: they stay
            the escapes that `to_json` wrote.

        Raises
        ------
        DocumentError
            If there is no such file, or its text is not such a document.
        """
        return read_json(source, cls.from_document, writer=cls._WRITER)


def part_of(kind: type[Result], document: Any) -> Result:
    """Read a result from its place in a document.

    Raises
    ------
    DamageError
        If there is something else.
    """
    checked(document, "schema", schema_of(kind.SCHEMA, remedies=kind._REMEDIES))
    _refuse_several(kind._SEVERAL, document)
    try:
        return kind._read(document)
    except DamageError:
        raise
    except InputError as error:  # parts that do not fit each other
        raise DamageError(str(error)) from None


def parts_of(kind: type[Result], document: Any) -> tuple[Result, ...]:
    """Read the results in the list of a document of several, or the one that it is.

    Raises
    ------
    DamageError
        If there is something else.
    """
    if isinstance(document, Mapping) and kind._SEVERAL in document:
        return checked(document, kind._SEVERAL, list_of(partial(part_of, kind), 1))
    return (part_of(kind, document),)


def all_to_json(results: Sequence[StoredResult], **others: StoredResult | None) -> str:
    """Write a result as its document, or several of a kind in one, with others beside them by key.

    Examples
    --------
    >>> import accelcal
    >>> found = [accelcal.fit(accelcal.simulate(seed=seed)) for seed in (1, 2)]
    >>> all_from_json(accelcal.Calibration, all_to_json(found)) == tuple(found)
    True
    """
    documents = [each.to_document() for each in results]
    if len(documents) == 1:
        return json_text(documents[0])
    several = {results[0]._SEVERAL: documents, **document_of(others)}
    return json_text({"schema": documents[0]["schema"], **several})


def all_from_json(kind: type[Result], text: str) -> tuple[Result, ...]:
    """Read the results of a JSON text as `all_to_json` returns it, one or more.

    Raises
    ------
    DocumentError
        If the text is not such a document.
    """
    document = parse_json(text, writer=kind._WRITER)
    return read_as(partial(parts_of, kind), document, kind._WRITER)


_READERS = {
    "calibrations": "accelcal.read_calibration(file, serial)",
    "discoveries": "accelcal.read_discovery(file, serial)",
}


def _refuse_several(key: str, document: Mapping[str, Any]) -> None:
    """Refuse a document of several where one is wanted."""
    listed = document.get(key)
    if isinstance(listed, list):
        named = [part.get("serial") for part in listed if isinstance(part, Mapping)]
        serials = ", ".join(str(serial) for serial in named if serial is not None)
        rule = f"{len(listed)} in a list{serials and f', of {serials},'} in place of one"
        reader = _READERS.get(key)
        other = "save one item of the list as a file of its own"
        raise DamageError(
            rule, key, remedy=f"read one by {reader}, or {other}" if reader else other
        )
