"""A mapping that nobody edits in place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TypeVar

__all__ = ["FrozenMapping"]

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
