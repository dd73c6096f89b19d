"""Mappings, and parts of a dataclass, that stay as they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, NoReturn, TypeVar

Value = TypeVar("Value")

PLAIN = frozenset({str, float, int, bool, type(None)})
"""Of these a list of residuals consists: one look at each instead of a call."""


class FrozenMapping(dict[str, Value]):
    """A dictionary that stays as it is; pandas and json take it for what it is.

    Unlike `types.MappingProxyType` it can be pickled, copied and hashed.

    Raises
    ------
    TypeError
        If it is to be changed.
    KeyError
        If it has no such name; the message has those that there are.

    Examples
    --------
    >>> FrozenMapping({"K1": 1.35})
    {'K1': 1.35}
    >>> FrozenMapping({"K1": 1.35}) == {"K1": 1.35}
    True
    """

    __slots__ = ()

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("this mapping stays as it is; change a copy, dict(mapping)")

    __setitem__: Callable[..., NoReturn] = _refuse
    __delitem__: Callable[..., NoReturn] = _refuse
    __ior__: Callable[..., NoReturn] = _refuse
    clear: Callable[..., NoReturn] = _refuse
    pop: Callable[..., NoReturn] = _refuse
    popitem: Callable[..., NoReturn] = _refuse
    setdefault: Callable[..., NoReturn] = _refuse
    update: Callable[..., NoReturn] = _refuse

    def __missing__(self, name: object) -> NoReturn:
        names = ", ".join(map(str, self)) or "nothing"
        raise KeyError(f"{name!r} is not here; choose from {names}")

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self),)


def kept_mapping(mapping: Mapping[str, Value]) -> FrozenMapping[Value]:
    """Keep a mapping as it is, whatever becomes of the one that was given.

    Returns
    -------
    FrozenMapping
        A copy, or the mapping itself where it is one.

    Examples
    --------
    >>> given = {"operator": "A. N."}
    >>> own = kept_mapping(given)
    >>> given["operator"] = "B. O."
    >>> own, kept_mapping(own) is own
    ({'operator': 'A. N.'}, True)
    """
    return mapping if isinstance(mapping, FrozenMapping) else FrozenMapping(mapping)


def freeze(result: Any) -> None:
    """Make what a frozen dataclass holds read-only, when it is born."""
    for item in fields(result):
        object.__setattr__(result, item.name, frozen(getattr(result, item.name)))


def frozen(part: Any) -> Any:
    """Freeze mappings, lists and arrays of a result, or of a JSON document, nested in any way.

    They become `FrozenMapping`, tuples and views of arrays that cannot be written to.

    Examples
    --------
    >>> frozen({"id": "warm-up", "like": ["bias-drift"]})
    {'id': 'warm-up', 'like': ('bias-drift',)}
    """
    if type(part) in PLAIN:
        return part
    if isinstance(part, Mapping):
        return FrozenMapping({name: frozen(item) for name, item in part.items()})
    if hasattr(part, "setflags"):
        part = part.view()
        part.setflags(write=False)
    if not isinstance(part, list | tuple):
        return part
    return tuple(part) if PLAIN.issuperset(map(type, part)) else tuple(map(frozen, part))
