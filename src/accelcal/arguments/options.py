"""Options of a call, checked: flags, names to choose from, texts, functions and mappings."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any

import numpy as np

from accelcal.arguments.kinds import as_given, kind_of
from accelcal.errors import InputError


def check_flag(**values: bool) -> None:
    """Refuse flags that are neither true nor false, such as ``"no"``, which counts as true.

    Examples
    --------
    >>> check_flag(robust="no")
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: robust is 'no'; it is True or False
    """
    for name, value in values.items():
        if not isinstance(value, bool | np.bool_):
            raise InputError(f"{name} is {as_given(value)}; it is True or False")


def check_choice(choices: Collection[str], /, **values: str) -> None:
    """Refuse what is none of some names.

    Examples
    --------
    >>> check_choice(("tables", "readings"), temperature_laws="all")
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: temperature_laws 'all' is unknown; choose from tables, readings
    """
    for name, value in values.items():
        if not isinstance(value, str) or value not in choices:
            raise InputError(
                f"{name} {as_given(value)} is unknown; choose from {', '.join(choices)}"
            )


def check_text(**values: str | None) -> None:
    """Refuse what is neither text nor None.

    Examples
    --------
    >>> check_text(serial=15)
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: serial is 15; it is a text, in quotes
    """
    check_written(**{name: value for name, value in values.items() if value is not None})


def check_written(**values: str) -> None:
    """Refuse what is no text."""
    for name, value in values.items():
        if not isinstance(value, str):
            raise InputError(f"{name} is {as_given(value)}; it is a text, in quotes")


def check_texts(**values: tuple[str, ...]) -> None:
    """Refuse what is no tuple of texts.

    Examples
    --------
    >>> check_texts(notes="read as latin-1")
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: notes is 'read as latin-1'; it is a tuple of texts
    """
    for name, value in values.items():
        if not isinstance(value, tuple):
            raise InputError(f"{name} is {as_given(value)}; it is a tuple of texts")
        for text in value:
            if not isinstance(text, str):
                raise InputError(f"{name} has {as_given(text)}; it is a tuple of texts")


def check_function(**values: Callable[..., object] | None) -> None:
    """Refuse what is neither a function nor None."""
    for name, value in values.items():
        if value is not None and not callable(value):
            raise InputError(f"{name} is {as_given(value)}; it is a function, or None")


def check_options(function: Any, options: Iterable[str], handed_on: Iterable[str]) -> None:
    """Refuse unknown options as Python does, where a function hands them on.

    `handed_on` are those that it takes beside its own.

    Raises
    ------
    TypeError
        If one is unknown; the message has the names that are near, or all.

    Examples
    --------
    >>> from accelcal import batch
    >>> check_options(batch, ["robbust"], ("robust", "strict"))
    Traceback (most recent call last):
    ...
    TypeError: batch() got an unexpected keyword argument 'robbust'. Did you mean 'robust'?
    """
    known = (*function.__kwdefaults__, *handed_on)
    for name in options:
        if name not in known:
            from difflib import get_close_matches

            near = get_close_matches(name, known, n=1)
            remedy = f"Did you mean {near[0]!r}?" if near else f"It takes {', '.join(known)}."
            what = f"{function.__name__}() got an unexpected keyword argument {name!r}"
            raise TypeError(f"{what}. {remedy}")


def mapping_of(value: Any, name: str, example: str) -> Mapping[str, Any]:
    """Take values by their names.

    Examples
    --------
    >>> mapping_of(5, "targets", "{'K1': 5e-6}")
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: int in place of targets; give a mapping such as {'K1': 5e-6}
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise InputError(f"{kind_of(value)} in place of {name}; give a mapping such as {example}")
    return value
