"""Files of effects: effects of a user's own, in TOML."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple, cast

from accelcal.effects.catalogue import refuse
from accelcal.effects.effect import ActsOn, Effect
from accelcal.effects.formula import STATIC, Formula
from accelcal.effects.parameter import Parameter
from accelcal.errors import InputError, TableError, located
from accelcal.io.files.text import Source, SourceText, read_text
from accelcal.io.toml.keys import check_keys, toml_document

__all__ = ["read_effects"]

_NEEDED = ("id", "name", "physics", "formula")
_TEXTS = (*_NEEDED, "unit", "acts_on", "signature", "to_tell_apart")
_KEYS = {**dict.fromkeys(_TEXTS, str), "static": bool}
_ACTS_ON = {"output": ("", "g"), "angle": ("th", "rad"), "temperature": ("T", "degC")}
"""What an effect adds to -> its symbol, and its unit."""

_HEADING = r"^[ \t]*\[\[[ \t]*effect[ \t]*\]\]"


def read_effects(source: Source) -> tuple[Effect, ...]:
    """Read effects that are linear in one coefficient.

    Parameters
    ----------
    source : path, "-" or file object
        A TOML file with an ``[[effect]]`` for each: the texts id, name, physics and formula, see
        `accelcal.effects.formula`, and, if you like, unit (of the coefficient, by default "g"),
        acts_on ("output", "angle" or "temperature"), signature, to_tell_apart and static (true
        where it is the accelerometer's own, so that `accelcal.apply` takes it up).

    Returns
    -------
    tuple of Effect
        The effects in the order of the file; `accelcal.register` adds them to the catalogue.

    Raises
    ------
    TableError
        If the file cannot be read or is not TOML; if a key is unknown, missing or of another kind;
        if a formula has anything but what it may have; if an id is in the catalogue already.

    Examples
    --------
    >>> from io import StringIO
    >>> import accelcal
    >>> text = '''
    ... [[effect]]
    ... id = "cross-axis-modulus"
    ... name = "modulus of the cross axis"
    ... physics = "The cross axis acts alike on both sides."
    ... formula = "abs(a_p)"
    ... '''
    >>> accelcal.read_effects(StringIO(text))[0].formula
    'c (abs(a_p))'
    """
    given = read_text(source, "file of effects")
    entries = _entries(given)
    found = tuple(_effect(entry, _Place(given, number)) for number, entry in enumerate(entries))
    ids = [entry.id for entry in found]
    for number, name in enumerate(ids):
        if name in ids[:number]:
            raise _Place(given, number).error(f"id {name!r} is there twice; choose another", "id")
    return found


class _Place(NamedTuple):
    """An effect of a file, by its number from 0."""

    given: SourceText
    number: int

    def error(self, message: str, key: str = "") -> TableError:
        problem, _, remedy = message.partition("; ")
        return TableError(problem, remedy, source=self.given.name, line=self.line(key))

    def located(self, check: Callable[..., object], *arguments: object, key: str = "") -> None:
        """Call what refuses the value of a key."""
        located(check, *arguments, source=self.given.name, line=self.line(key))

    def line(self, key: str = "") -> int | None:
        """Line of a key, else of the heading; None where there is no heading."""
        text = self.given.text
        headings = [match.start() for match in re.finditer(_HEADING, text, re.MULTILINE)]
        if self.number >= len(headings):
            return None
        start, end, *_ = [*headings[self.number :], len(text)]
        written = re.search(rf"^[ \t]*{re.escape(key)}[ \t]*=", text[start:end], re.MULTILINE)
        return text.count("\n", 0, start + (written.start() if written else 0)) + 1


def _entries(given: SourceText) -> list[Mapping[str, Any]]:
    document = toml_document(given, "[[effect]]")
    entries = document.pop("effect", None)
    if not (isinstance(entries, list) and entries and all(isinstance(e, dict) for e in entries)):
        problem, remedy = "no [[effect]]", "begin each effect with a line [[effect]]"
        raise TableError(problem, remedy, source=given.name)
    if document:
        problem, remedy = f"key {next(iter(document))!r} is unknown", "there is [[effect]] only"
        raise TableError(problem, remedy, source=given.name)
    return entries


def _effect(entry: Mapping[str, Any], place: _Place) -> Effect:
    _check_keys(entry, place)
    place.located(Formula, entry["formula"], key="formula")
    acts_on = entry.get("acts_on", "output")
    if acts_on not in _ACTS_ON:
        known = ", ".join(_ACTS_ON)
        raise place.error(f"acts_on is {acts_on!r}; it is one of {known}", "acts_on")
    made = _made(**{k: " ".join(v.split()) if k in _TEXTS else v for k, v in entry.items()})
    place.located(_check_static, made, key="static")
    place.located(refuse, made, key="id")
    return made


def _check_keys(entry: Mapping[str, Any], place: _Place) -> None:
    for key, value in entry.items():
        place.located(check_keys, {key: value}, _KEYS, {}, key=key)
        if key in _TEXTS and not value.strip():
            raise place.error(f"{key} is {value!r}; it is a text in quotes", key)
    place.located(partial(check_keys, required=_NEEDED), entry, _KEYS, {})


def _check_static(made: Effect) -> None:
    """Refuse as static what depends on more than is known in use."""
    other = sorted(cast("Formula", made.term).symbols - STATIC)
    if made.static and other:
        has = f"static is true, but the formula has {', '.join(other)}"
        raise InputError(f"{has}; a static effect has a_i, a_p and dT, so leave static out")


def _made(formula: str, unit: str = "", acts_on: str = "output", **texts: Any) -> Effect:
    told = f"c ({formula})"
    meaning = f"coefficient c of {told.removeprefix('c ')}"
    return Effect(
        formula=told if acts_on == "output" else f"{_ACTS_ON[acts_on][0]} + {told}",
        parameters=(Parameter("coefficient", unit or _ACTS_ON[acts_on][1], meaning),),
        term=Formula(formula),
        acts_on=cast("ActsOn", acts_on),
        **texts,
    )
