"""Keys of a TOML table: known, of their type, and all that are needed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from accelcal.errors import InputError

__all__ = ["check_keys", "is_of_kind"]


def check_keys(
    entry: Mapping[str, Any],
    keys: Mapping[str, Any],
    names: Mapping[Any, str],
    *,
    required: tuple[str, ...] = (),
    where: str = "",
) -> None:
    """Refuse a table with a key that is unknown, missing or of the wrong type.

    Parameters
    ----------
    entry : mapping
        The table.
    keys : mapping
        Key -> its type: str, float (any number), int, bool, dict, list or a tuple of types.
    names : mapping
        Type -> how a message calls it.
    required : tuple of str
        Keys that must be there.
    where : str
        What the message begins with.

    Raises
    ------
    InputError
        If a key breaks a rule.

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
            raise InputError(f"{where}{key} is {value!r}; it is {names[keys[key]]}")
    for key in required:
        if key not in entry:
            raise InputError(f"{where}key {key!r} is missing; add {key} = ...")


def is_of_kind(value: Any, kind: Any) -> bool:
    """Tell whether a value of TOML is of a type; a bool is no number.

    Parameters
    ----------
    value : object
        The value.
    kind : type or tuple of type
        See `check_keys`.

    Returns
    -------
    bool
        True for one of it.
    """
    if kind in (int, float):
        return isinstance(value, int | kind) and not isinstance(value, bool)
    return isinstance(value, kind)
