"""Parts of a JSON document, each checked for what it must be before it is used."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

__all__ = [
    "Covariance",
    "checked",
    "covariance",
    "flag",
    "freedom_or_none",
    "list_of",
    "mapping_of",
    "number",
    "number_or_none",
    "size_or_none",
    "text",
    "text_or_none",
    "whole",
]

Part = TypeVar("Part")
Kind = Callable[[Any], Part]
Covariance = tuple[tuple[str, ...], tuple[tuple[float, ...], ...]]

LARGEST = 1e40
"""Numbers beyond it are none of a calibration; their squares can still be calculated with."""

SMALLEST = 1e-60
"""The same of uncertainties above zero."""

_FEWEST = 0.1
"""Degrees of freedom below it are none."""

_ROUNDING = 1e-6


def checked(document: Mapping[str, Any], key: str, kind: Kind[Part], *default: Part) -> Part:
    """Take a part of a document.

    Parameters
    ----------
    document : mapping
        The document.
    key : str
        Key of the part.
    kind : callable
        One of the functions of this module: gives the part back, or raises a `TypeError`.
    *default : object
        What stands for a key that is not there.

    Returns
    -------
    object
        The part.

    Raises
    ------
    KeyError
        If the key is not there and has no default.
    TypeError
        If the part is something else.

    Examples
    --------
    >>> checked({"dof": 12}, "dof", whole), checked({}, "robust", flag, False)
    (12, False)
    """
    if not isinstance(document, Mapping):
        raise _wrong(document, "an object")
    if key not in document and default:
        return default[0]
    value = document[key]
    try:
        return kind(value)
    except TypeError as error:
        raise TypeError(f"{key} {error}") from None


def text(value: Any) -> str:
    """Take a text."""
    if not isinstance(value, str):
        raise _wrong(value, "a text")
    return value


def text_or_none(value: Any) -> str | None:
    """Take a text or null."""
    return None if value is None else text(value)


def flag(value: Any) -> bool:
    """Take true or false."""
    if not isinstance(value, bool):
        raise _wrong(value, "true or false")
    return value


def number(value: Any) -> float:
    """Take a number of a size to calculate with."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(value, "a number")
    if not abs(value) <= LARGEST:
        raise _wrong(value, f"a number of at most {LARGEST:g}")
    return float(value)


def number_or_none(value: Any) -> float | None:
    """Take a number or null."""
    return None if value is None else number(value)


def size_or_none(value: Any) -> float | None:
    """Take a number from zero, or null."""
    found = number_or_none(value)
    if found is not None and found < 0.0:
        raise _wrong(value, "a number from zero")
    if found is not None and 0.0 < found < SMALLEST:
        raise _wrong(value, f"zero or a number from {SMALLEST:g}")
    return found


def freedom_or_none(value: Any) -> float | None:
    """Take degrees of freedom or null."""
    found = number_or_none(value)
    if found is not None and found < _FEWEST:
        raise _wrong(value, "degrees of freedom")
    return found


def whole(value: Any) -> int:
    """Take a whole number from zero."""
    found = number(value)
    if found < 0.0 or found % 1.0:
        raise _wrong(value, "a whole number from zero")
    return int(found)


def list_of(kind: Kind[Part]) -> Kind[tuple[Part, ...]]:
    """Take a list of parts."""

    def take(value: Any) -> tuple[Part, ...]:
        if not isinstance(value, list | tuple):
            raise _wrong(value, "a list")
        return tuple(map(kind, value))

    return take


def mapping_of(kind: Kind[Part], among: Sequence[str] = ()) -> Kind[dict[str, Part]]:
    """Take an object whose members are parts, with keys `among` those given."""

    def take(value: Any) -> dict[str, Part]:
        if not isinstance(value, Mapping):
            raise _wrong(value, "an object")
        for key in value:
            if among and key not in among:
                raise _wrong(key, f"one of {', '.join(among)}")
        return {key: checked(value, key, kind) for key in value}

    return take


def covariance(value: Any) -> Covariance:
    """Take the names and the matrix of a covariance; both are empty where it is unknown."""
    names = checked(value, "names", list_of(text))
    matrix = checked(value, "matrix", list_of(list_of(number)))
    sizes = {len(row) for row in matrix} | {len(matrix)}
    if sizes != {len(names)} or len(set(names)) < len(names):
        raise TypeError(f"has {len(names)} names and no matrix of that size")
    sigma = [matrix[i][i] ** 0.5 if matrix[i][i] >= 0.0 else -1.0 for i in range(len(matrix))]
    for i, row in enumerate(matrix):
        for j, item in enumerate(row):
            most = sigma[i] * sigma[j]
            if sigma[i] < 0.0 or abs(item) > most * (1.0 + _ROUNDING):
                raise TypeError(f"of {names[i]} and {names[j]} is {item:g}, which no covariance is")
            if abs(item - matrix[j][i]) > most * _ROUNDING:
                raise TypeError(f"of {names[i]} and {names[j]} is not symmetric")
    return names, matrix


def _wrong(value: Any, right: str) -> TypeError:
    shown = repr(value)
    shown = shown if len(shown) <= 40 else shown[:37] + "..."
    return TypeError(f"{shown} in place of {right}")
