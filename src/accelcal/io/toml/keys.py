"""Files in TOML: tables whose keys are known, of their type, and all that are needed."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from accelcal.errors import InputError, TableError, located
from accelcal.io.files.text import SourceText

Found = TypeVar("Found")

_PLAIN: Mapping[Any, str] = {
    str: "a text in quotes",
    float: "a number",
    int: "a whole number",
    bool: "true or false",
}


def read_toml(
    given: SourceText, make: Callable[[dict[str, Any]], Found], tables: str, schema: str
) -> Found:
    """Make what a file in TOML describes.

    `tables` is how its tables are headed, as the remedy names them. Raises TableError if the file
    is not TOML, has another schema, or `make` refuses the document.
    """
    document = toml_document(given, tables)
    written = document.get("schema")
    if written != schema:
        what = "schema is missing" if written is None else f"schema {written!r} is unknown"
        raise TableError(what, f"write schema = {schema!r}", source=given.name)
    return located(make, document, source=given.name)


def toml_document(given: SourceText, tables: str) -> dict[str, Any]:
    """Read a file in TOML.

    Raises TableError if the file is not TOML; the message names the line.
    """
    try:
        return tomllib.loads(given.text)
    except tomllib.TOMLDecodeError as error:
        message, _, place = str(error).partition(" (at line ")
        line = int(place.partition(",")[0]) if place else None
        remedy = f"write key = value lines under {tables}"
        raise TableError(f"not TOML ({message})", remedy, source=given.name, line=line) from None


def check_keys(
    entry: Mapping[str, Any],
    keys: Mapping[str, Any],
    names: Mapping[Any, str],
    *,
    required: tuple[str, ...] = (),
    where: str = "",
) -> None:
    """Refuse a table with a key that is unknown, missing or of the wrong type.

    A type is str, float (any number), int, bool, dict, list or a tuple of types; names tell how a
    message calls others than texts, numbers and flags. The message begins with `where`.

    Examples
    --------
    >>> check_keys({"unit": 5}, {"unit": str}, {str: "a text in quotes"})
    Traceback (most recent call last):
    accelcal.errors.InputError: unit is 5; it is a text in quotes
    """
    for key, value in entry.items():
        if key not in keys:
            raise InputError(f"{where}key {key!r} is unknown; there are {', '.join(keys)}")
        if not is_of_kind(value, keys[key]):
            right = {**_PLAIN, **names}[keys[key]]
            raise InputError(f"{where}{key} is {value!r}; it is {right}")
    for key in required:
        if key not in entry:
            raise InputError(f"{where}key {key!r} is missing; add {key} = ...")


def is_of_kind(value: Any, kind: Any) -> bool:
    """Tell whether a value of TOML is of a type; a bool is no number."""
    if kind in (int, float):
        return isinstance(value, int | kind) and not isinstance(value, bool)
    return isinstance(value, kind)
