"""Fields of results in documents: the type of a field tells how it is read."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Self

from accelcal.results.checked import (
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
from accelcal.results.mapping import document_of, freeze

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
    def _of_fields(cls, document: Mapping[str, Any], **known: Any) -> Self:
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
    def _read(cls, document: Mapping[str, Any]) -> Self:
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
