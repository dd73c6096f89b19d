"""Mappings, and documents of them, that nobody edits in place."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

Value = TypeVar("Value", covariant=True)


class FrozenMapping(Mapping[str, Value]):
    """A read-only copy of a mapping; unlike `types.MappingProxyType` it can be pickled and copied.

    Parameters
    ----------
    items : mapping
        Names and values.

    Examples
    --------
    >>> FrozenMapping({"K1": 1.35})
    {'K1': 1.35}
    >>> FrozenMapping({"K1": 1.35}) == {"K1": 1.35}
    True
    """

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[str, Value]) -> None:
        self._items = dict(items)

    def __getitem__(self, name: str) -> Value:
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(frozenset(self._items.items()))

    def __repr__(self) -> str:
        return repr(self._items)


def frozen(part: Any) -> Any:
    """Freeze a part of a JSON document.

    Parameters
    ----------
    part : object
        Mappings, lists, texts, numbers, None, nested in any way.

    Returns
    -------
    object
        The same of `FrozenMapping` and tuples, which can be compared and hashed.

    Examples
    --------
    >>> frozen({"id": "warm-up", "like": ["bias-drift"]})
    {'id': 'warm-up', 'like': ('bias-drift',)}
    """
    if isinstance(part, Mapping):
        return FrozenMapping({name: frozen(item) for name, item in part.items()})
    return tuple(map(frozen, part)) if isinstance(part, list | tuple) else part


def document_of(part: Any) -> Any:
    """Turn a part of a result into a part of a JSON document.

    Parameters
    ----------
    part : object
        What `frozen` returns, or what has a method ``to_document``, in mappings and tuples.

    Returns
    -------
    object
        The same of dictionaries and lists.

    Examples
    --------
    >>> document_of(frozen([{"id": "warm-up"}]))
    [{'id': 'warm-up'}]
    """
    if part is None or isinstance(part, str | float | int):
        return part
    if isinstance(part, list | tuple):
        return list(map(document_of, part))
    if isinstance(part, Mapping):
        return {name: document_of(item) for name, item in part.items()}
    return part.to_document() if hasattr(part, "to_document") else part


def finite_or_none(value: float) -> float | None:
    """Turn what JSON has no number for into None.

    Parameters
    ----------
    value : float
        A number, infinite or NaN.

    Returns
    -------
    float or None
        The number, if it is finite.
    """
    return float(value) if math.isfinite(value) else None
