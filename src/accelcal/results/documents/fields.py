"""Fields of results in documents: how they are written, and by their types, how they are read."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Self

from accelcal.frozen_mapping import PLAIN, freeze
from accelcal.results.documents.checked import (
    Kind,
    checked,
    flag,
    list_of,
    mapping_of,
    number,
    or_none,
    text,
    whole,
)

Document = Mapping[str, Any]
"""A JSON document, or a part of it that has names."""

_PLAIN: Mapping[str, Kind[Any]] = {"str": text, "bool": flag, "int": whole, "float": number}
_COMPOSED = (
    (re.compile(r"(.+) \| None"), or_none),
    (re.compile(r"tuple\[(.+), \.\.\.\]"), list_of),
    (re.compile(r"Mapping\[str, (.+)\]"), mapping_of),
)


@dataclass(frozen=True, slots=True)
class ReadByFields:
    """What is read from a document that has its fields under their names; nobody edits it."""

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = MappingProxyType({})
    """Field -> what it must be, where its type does not tell all of it."""

    _MISSING: ClassVar[Mapping[str, Any]] = MappingProxyType({})
    """Field -> what it is where a document has no such key."""

    _BESIDE: ClassVar[str] = ""
    """Field whose own fields stand in the document beside the others, and not under its name."""

    def __post_init__(self) -> None:
        freeze(self)

    @classmethod
    def _of_fields(cls, document: Document, **known: Any) -> Self:
        """Read all fields but those that are known already."""
        for item in fields(cls):
            if item.name not in known:
                kind = cls._KINDS.get(item.name) or _kind(str(item.type), cls.__module__)
                if item.name == cls._BESIDE:
                    known[item.name] = kind(document)
                    continue
                default = (cls._MISSING[item.name],) if item.name in cls._MISSING else ()
                known[item.name] = checked(document, item.name, kind, *default)
        return cls(**known)

    @classmethod
    def _read(cls, document: Document) -> Self:
        """Read all of it; a DamageError says which part is missing or something else."""
        return cls._of_fields(document)

    def _contents(self) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for item in fields(self):
            part = document_of(getattr(self, item.name))
            found |= part if item.name == self._BESIDE else {item.name: part}
        return found


@dataclass(frozen=True, slots=True)
class StoredPart(ReadByFields):
    """A part of a result that stands in a JSON document under the names of its fields."""

    def to_document(self) -> dict[str, Any]:
        """Return the part as it stands in the JSON document."""
        return self._contents()

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> Self:
        """Read the part from its place in a JSON document.

        Raises
        ------
        DamageError
            If a field is missing or something else.
        """
        return cls._read(document)


@cache
def _kind(written: str, module: str) -> Kind[Any]:
    """What stands in a document for a type, by its text in a module."""
    for pattern, composed in _COMPOSED:
        if match := pattern.fullmatch(written):
            return composed(_kind(match[1], module))
    if written in _PLAIN:
        return _PLAIN[written]
    kind: Kind[Any] = getattr(sys.modules[module], written).from_document
    return kind


def document_of(part: Any) -> Any:
    """Turn a part of a result into a part of a JSON document.

    It is what `accelcal.frozen_mapping.frozen` returns, or what has a method ``to_document``, in
    mappings and tuples.

    Examples
    --------
    >>> document_of(({"id": "warm-up"},))
    [{'id': 'warm-up'}]
    """
    if part is None or isinstance(part, str | float | int):
        return part
    if isinstance(part, list | tuple):
        return list(part) if PLAIN.issuperset(map(type, part)) else list(map(document_of, part))
    if isinstance(part, Mapping):
        return {name: document_of(item) for name, item in part.items()}
    return part.to_document() if hasattr(part, "to_document") else part


def members(result: Any, names: str) -> dict[str, Any]:
    """Turn fields or properties of a result, named with blanks between them, into members of JSON.

    Examples
    --------
    >>> members(3 + 4j, "real imag")
    {'real': 3.0, 'imag': 4.0}
    """
    return {name: document_of(getattr(result, name)) for name in names.split()}


def members_at(result: Any, names: str, place: int) -> dict[str, float]:
    """Turn the numbers at one place of some arrays of a result into members of a JSON document."""
    return {name: float(getattr(result, name)[place]) for name in names.split()}


def finite_or_none(value: float) -> float | None:
    """Turn what JSON has no number for into None."""
    return float(value) if math.isfinite(value) else None
