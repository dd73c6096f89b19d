"""Data sheets as TOML."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from accelcal.errors import InputError
from accelcal.io.files.text import Source, read_text
from accelcal.io.toml.keys import check_keys, read_toml
from accelcal.specification import Limit, Specification

__all__ = ["SCHEMA", "read_specification"]

SCHEMA = "accelcal/specification/1"

_KEYS = {"schema": str, "name": str, "source": str, "rule": str, "limits": dict}
_LIMIT_KEYS = {"unit": str, "minimum": float, "maximum": float, "at": str, "condition": str}
_TYPE_NAMES = {dict: "a table such as [limits.bias]"}


def read_specification(source: Source) -> Specification:
    """Read a data sheet.

    Parameters
    ----------
    source : path, "-" or file object
        A TOML file with the keys schema, name, limits and, if you like, source and rule.

    Returns
    -------
    Specification
        The limits in the order of the file.

    Raises
    ------
    TableError
        If the file cannot be read, is not TOML, or has a key that is unknown, missing or of the
        wrong type, or a unit that is none of its quantity.

    Examples
    --------
    >>> from io import StringIO
    >>> import accelcal
    >>> text = '''
    ... schema = "accelcal/specification/1"
    ... name = "AL-15"
    ... [limits.bias]
    ... maximum = 5.0
    ... unit = "mg"
    ... '''
    >>> accelcal.read_specification(StringIO(text)).limits
    (Limit(name='bias', unit='mg', minimum=None, maximum=5.0, at='T0', condition=''),)
    """
    return read_toml(read_text(source, "data sheet"), _specification, "[limits.NAME]", SCHEMA)


def _specification(document: Mapping[str, Any]) -> Specification:
    check_keys(document, _KEYS, _TYPE_NAMES, required=("name", "limits"))
    limits = tuple(_limit(name, entry) for name, entry in document["limits"].items())
    rest = {key: document[key] for key in ("source", "rule") if key in document}
    return Specification(document["name"], limits, **rest)


def _limit(name: str, entry: Any) -> Limit:
    if not isinstance(entry, dict):
        raise InputError(f"limits.{name} is {entry!r}; make it a table [limits.{name}]")
    check_keys(entry, _LIMIT_KEYS, _TYPE_NAMES, required=("unit",), where=f"limits.{name}: ")
    return Limit(name, **entry)
