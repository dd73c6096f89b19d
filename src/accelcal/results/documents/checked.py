"""Parts of a JSON document, each checked before it is used; what is wrong is worded here alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from accelcal.errors import DocumentError

if TYPE_CHECKING:
    from accelcal.arrays import Array


class DamageError(DocumentError):
    """A part of a document is not what it must be.

    The rule says what stands there, and what belongs there; the keys of objects and places in lists
    are the way to the part. The remedy is by default a file of the command that writes such
    documents.

    Examples
    --------
    >>> str(DamageError("'x' in place of a number", "tables", 0, "dof"))
    "key tables[0].dof: 'x' in place of a number"
    """

    def __init__(self, rule: str, *keys: str | int, remedy: str = "") -> None:
        self.rule = rule
        self.keys = keys
        self.remedy = remedy
        super().__init__(f"key {_way(keys)}: {rule}" if keys else rule)

    def within(self, key: str | int) -> DamageError:
        """Return the damage as one of the part that holds this one under a key."""
        return DamageError(self.rule, key, *self.keys, remedy=self.remedy)

    def told(self, writer: str) -> DocumentError:
        """Return the error of the whole document, which a command should have written."""
        return DocumentError(f"{self}; {self.remedy or f'give a file as {writer} writes it'}")


def read_as(kind: Callable[[Any], Part], document: Any, writer: str) -> Part:
    """Read a document that a command, the writer, should have written.

    Raises
    ------
    DocumentError
        If it is damaged, or another document: where `kind` raises `DamageError`.
    """
    try:
        return kind(document)
    except DamageError as damage:
        raise damage.told(writer) from None
    except RecursionError:
        raise DamageError("parts within parts without end").told(writer) from None


def _way(keys: tuple[str | int, ...]) -> str:
    steps = [
        f".{key}" if isinstance(key, str) and key.isidentifier() else f"[{repr(key)[:40]}]"
        for key in keys
    ]
    return "".join(steps).removeprefix(".")


Part = TypeVar("Part")
Kind = Callable[[Any], Part]

LARGEST = 1e40
"""Numbers beyond it are none of a calibration; their squares can still be calculated with."""

SMALLEST = 1e-60
"""The same of uncertainties above zero."""

_FEWEST = 0.1
"""Degrees of freedom below it are none."""


def checked(document: Mapping[str, Any], key: str, kind: Kind[Part], *default: Part) -> Part:
    """Take a part of a document, of a kind that a function of this module takes, or its default.

    Raises
    ------
    DamageError
        If the key is not there and has no default, or the part is something else.

    Examples
    --------
    >>> checked({"dof": 12}, "dof", whole), checked({}, "robust", flag, False)
    (12, False)
    """
    if not isinstance(document, Mapping):
        raise _wrong(document, "an object")
    if key not in document:
        if default:
            return default[0]
        raise DamageError("missing", key)
    try:
        return kind(document[key])
    except DamageError as damage:
        raise damage.within(key) from None


def text(value: Any) -> str:
    """Take a text."""
    if not isinstance(value, str):
        raise _wrong(value, "a text")
    return value


def flag(value: Any) -> bool:
    """Take true or false."""
    if not isinstance(value, bool):
        raise _wrong(value, "true or false")
    return value


def finite(value: float) -> float:
    """Take a number that JSON may have: neither NaN nor infinite."""
    if isinstance(value, float) and not math.isfinite(value):
        raise _wrong(value, "a number")
    return value


def number(value: Any) -> float:
    """Take a number of a size to calculate with."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(value, "a number")
    if not abs(finite(value)) <= LARGEST:
        raise _wrong(value, f"a number of at most {LARGEST:g}")
    return float(value)


def or_none(kind: Kind[Part]) -> Kind[Part | None]:
    """Take a part or null."""
    return lambda value: None if value is None else kind(value)


def member(key: str, kind: Kind[Part], *default: Part) -> Kind[Part]:
    """Take what stands under a key of an object, as `checked`."""
    return lambda value: checked(value, key, kind, *default)


text_or_none: Kind[str | None] = or_none(text)
"""Take a text or null."""

number_or_none: Kind[float | None] = or_none(number)
"""Take a number or null."""


def size(value: Any) -> float:
    """Take a number from zero."""
    found = number(value)
    if found < 0.0:
        raise _wrong(value, "a number from zero")
    if 0.0 < found < SMALLEST:
        raise _wrong(value, f"zero or a number from {SMALLEST:g}")
    return found


size_or_none: Kind[float | None] = or_none(size)
"""Take a number from zero, or null."""


def freedom_or_none(value: Any) -> float | None:
    """Take degrees of freedom or null."""
    found = number_or_none(value)
    if found is not None and found < _FEWEST:
        raise _wrong(value, "degrees of freedom")
    return found


def number_or_nan(value: Any) -> float:
    """Take a number; null stands for NaN."""
    found = number_or_none(value)
    return math.nan if found is None else found


def freedom(value: Any) -> float:
    """Take degrees of freedom, however many; null stands for such as do not end."""
    if isinstance(value, float) and finite(value) > LARGEST:
        return value
    found = freedom_or_none(value)
    return math.inf if found is None else found


def integer(value: Any) -> int:
    """Take a whole number, which may be negative."""
    found = number(value)
    if found % 1.0:
        raise _wrong(value, "a whole number")
    return int(found)


def whole(value: Any) -> int:
    """Take a whole number from zero."""
    found = number(value)
    if found < 0.0 or found % 1.0:
        raise _wrong(value, "a whole number from zero")
    return int(found)


def one_of(*names: str) -> Kind[str]:
    """Take one of some texts."""

    def take(value: Any) -> str:
        if value not in names:
            raise _wrong(value, f"one of {', '.join(names)}" if names[1:] else repr(*names))
        return str(value)

    return take


def schema_of(*right: str, remedies: Mapping[str, str] = MappingProxyType({})) -> Kind[str]:
    """Take a schema; `remedies` tell what to do with documents of others."""

    def take(value: Any) -> str:
        try:
            return one_of(*right)(value)
        except DamageError as damage:
            name = str(value)
            later = name.rpartition("/")[0] in {own.rpartition("/")[0] for own in right}
            remedy = "read it with the version of accelcal that wrote it" if later else ""
            raise DamageError(damage.rule, remedy=remedies.get(name, remedy)) from None

    return take


def list_of(kind: Kind[Part], least: int = 0) -> Kind[tuple[Part, ...]]:
    """Take a list of parts, of `least` ones or more."""

    def take(value: Any) -> tuple[Part, ...]:
        if not isinstance(value, list | tuple) or len(value) < least:
            raise _wrong(value, f"a list of {least} or more" if least else "a list")
        taken: list[Part] = []
        try:
            for item in value:
                taken.append(kind(item))  # noqa: PERF401  (its length tells which is damaged)
        except DamageError as damage:
            raise damage.within(len(taken)) from None
        return tuple(taken)

    return take


def column(document: Mapping[str, Any], *keys: str, kind: Kind[Any] = number) -> Array:
    """Take the array of what stands under all keys but the first of each item of a list.

    Examples
    --------
    >>> column({"points": [{"a": {"x": 1.0}}, {"a": {"x": 2.0}}]}, "points", "a", "x").tolist()
    [1.0, 2.0]
    """
    import numpy as np  # here, as some results are read without it

    for key in reversed(keys[1:]):
        kind = member(key, kind)
    return np.array(checked(document, keys[0], list_of(kind)))


def mapping_of(kind: Kind[Part], among: Sequence[str] = ()) -> Kind[dict[str, Part]]:
    """Take an object whose members are parts, with keys `among` those given."""

    def take(value: Any) -> dict[str, Part]:
        if not isinstance(value, Mapping):
            raise _wrong(value, "an object")
        for key in value if among else ():
            one_of(*among)(key)
        return {key: checked(value, key, kind) for key in value}

    return take


def _wrong(value: Any, right: str) -> DamageError:
    shown = repr(value)
    shown = shown if len(shown) <= 40 else shown[:37] + "..."
    return DamageError(f"{shown} in place of {right}")
