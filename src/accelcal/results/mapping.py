"""Parts of results that nobody edits in place, and documents of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from accelcal.frozen_mapping import FrozenMapping

_PLAIN = frozenset({str, float, int, bool, type(None)})
"""Of these a list of residuals consists: one look at each instead of a call."""


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
    if type(part) in _PLAIN:
        return part
    if isinstance(part, Mapping):
        return FrozenMapping({name: frozen(item) for name, item in part.items()})
    if hasattr(part, "setflags"):
        part = part.view()
        part.setflags(write=False)
    if not isinstance(part, list | tuple):
        return part
    return tuple(part) if _PLAIN.issuperset(map(type, part)) else tuple(map(frozen, part))


def document_of(part: Any) -> Any:
    """Turn a part of a result into a part of a JSON document.

    It is what `frozen` returns, or what has a method ``to_document``, in mappings and tuples.

    Examples
    --------
    >>> document_of(frozen([{"id": "warm-up"}]))
    [{'id': 'warm-up'}]
    """
    if part is None or isinstance(part, str | float | int):
        return part
    if isinstance(part, list | tuple):
        return list(part) if _PLAIN.issuperset(map(type, part)) else list(map(document_of, part))
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
