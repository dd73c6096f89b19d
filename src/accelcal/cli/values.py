"""Types of options and arguments: from the text that is typed to its value."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import TypeVar

import click

from accelcal.errors import InputError
from accelcal.io.words.vocabulary import has_unit
from accelcal.units import (
    OUTPUT_UNITS,
    SCALES,
    UNITS,
    celsius,
    is_output_unit,
    scale_of,
    scaled,
    size_of,
)

Value = TypeVar("Value")

_WITH_UNIT = re.compile(r"([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([^0-9\s,].*)?")
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(\s*[^0-9\s,][^,]*)?")
_BELOW_ZERO = re.compile(r"-[0.]*[1-9]")
_LARGEST = 1e12
_SMALLEST = 1e-30


def number(text: str) -> float:
    """Type of an option: a finite number (click's own float lets nan and inf pass)."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        comma = "; write a decimal point" if _DECIMAL_COMMA.fullmatch(text) else ""
        raise click.BadParameter(f"{text!r} is not a finite number{comma}.")
    if abs(value) > _LARGEST:
        raise click.BadParameter(f"{text!r} is too large; nothing here exceeds {_LARGEST:g}.")
    if 0.0 < abs(value) < _SMALLEST:
        raise click.BadParameter(f"{text!r} is too small; write 0, or {_SMALLEST:g} or more.")
    return value


def words(text: str) -> tuple[str, ...]:
    """Type of an option: words separated by commas, as in ``o+,o-``."""
    return tuple(item.strip() for item in text.split(","))


def label(text: str) -> str:
    """Type of an option: a text, without blanks around it."""
    return text.strip()


def durations(text: str) -> tuple[float, ...]:
    """Type of an option: durations separated by commas, as in ``600,10min,12h``; in seconds."""
    return tuple(duration(item.strip()) for item in text.split(","))


def duration(text: str) -> float:
    """Type of an option: a duration such as ``600``, ``600s``, ``10min`` or ``12h``; in seconds."""
    match = _WITH_UNIT.fullmatch(text)
    if not match or not size_of(match[2] or "s", "time"):
        raise click.BadParameter(f"{text!r} is no time; write it as 600, 600s, 10min or 12h.")
    return quantity("s", "time")(text)


def _number_and_unit(text: str) -> tuple[str, str]:
    """Split a number and its unit, as they are written; without a unit it is the whole text."""
    match = _WITH_UNIT.fullmatch(text.strip())
    return (match[1], match[2]) if match and match[2] else (text.strip(), "")


def quantity(unit: str, *kinds: str) -> Callable[[str], float]:
    """Make the type of an option that is a number, perhaps with a unit as in ``2 arcsec``.

    The unit is that of the value, and of a number that has none; the kinds are of
    `accelcal.units.UNITS`.
    """

    def converted(text: str) -> float:
        value, own = _number_and_unit(text)
        if not own:
            return number(value)
        size, whole = size_of(own, *kinds), size_of(unit, *kinds)
        if size is None or whole is None:
            if "acceleration" in kinds and size_of(own, "gravity"):
                raise click.BadParameter(
                    f"{text!r} is no multiple of the local gravity, which is not known here; give"
                    " it in g."
                )
            known = ", ".join(name for kind in kinds for name in UNITS[kind])
            raise click.BadParameter(f"{text!r} has another unit; it is one of {known}.")
        number(value)
        return number(repr(scaled(value, size / whole)))

    return converted


def quantities(one: Callable[[str], float]) -> Callable[[str], tuple[float, ...]]:
    """Make the type of an option that is a list, as in ``20,80,-40`` or ``0 mg,500 mg``.

    `one` is the type of each. Each number has a unit, or none has: of ``1,500 mg`` nobody knows
    what the 1 is in.
    """

    def converted(text: str) -> tuple[float, ...]:
        items = [item.strip() for item in text.split(",")]
        found = tuple(map(one, items))
        if len({bool(_number_and_unit(item)[1]) for item in items}) > 1:
            raise click.BadParameter(f"{text!r} has a unit here and none there; write it at each.")
        return found

    return converted


def quantity_of_table(unit: str, *kinds: str) -> Callable[[str], float | str]:
    """Make the type of an option that is declared of a table, as `quantity` does.

    An acceleration may be in m/s^2 as well: it stays a text, as the table tells the local gravity.
    """
    in_unit = quantity(unit, *kinds)

    def converted(text: str) -> float | str:
        value, own = _number_and_unit(text)
        if own and "acceleration" in kinds and size_of(own, "gravity"):
            number(value)
            return text.strip()
        return in_unit(text)

    return converted


def size(kind: Callable[[str], Value]) -> Callable[[str], Value]:
    """Make a type of an option out of another: the same, but nothing below zero."""

    def not_negative(text: str) -> Value:
        value = kind(text)
        if _BELOW_ZERO.match(text.strip()):
            raise click.BadParameter(f"{text!r} is below 0; it is 0 or more.")
        return value

    return not_negative


@size
def step_of_output(text: str) -> float | str:
    """Type of an option: a step of the outputs; with a unit a text, as each table tells its own."""
    value, own = _number_and_unit(text)
    if not own:
        return number(value)
    if not is_output_unit(own):
        known = ", ".join(OUTPUT_UNITS)
        raise click.BadParameter(f"{text!r} is in no output unit; it is one of {known}.")
    number(value)
    return text.strip()


def fixture_angle(text: str) -> float:
    """Type of an option: a fixture angle [rad], perhaps with its unit."""
    from accelcal.geometry import checked_fixture_angle

    try:
        return checked_fixture_angle(quantity("rad", "angle")(text))
    except InputError as error:
        raise click.BadParameter(f"{error}.") from None


def temperature(text: str) -> float:
    """Type of an option: a temperature [degC], perhaps in one of `accelcal.units.SCALES`."""
    value, own = _number_and_unit(text)
    if not own:
        return number(value)
    if not has_unit("temperature", own):
        raise click.BadParameter(f"{text!r} has another unit; it is one of {', '.join(SCALES)}.")
    return float(celsius(number(value), own))


def temperature_of_test(text: str) -> float:
    """Type of an option: a temperature of a test [degC], perhaps in its unit."""
    from accelcal.arguments.temperatures import NO_TEMPERATURE, outside_tests

    value = temperature(text)
    if outside_tests(value):
        raise click.BadParameter(f"{text!r} {NO_TEMPERATURE}.")
    return value


def temperature_of_table(text: str) -> float | str:
    """Type of an option: the same, declared of a table, whose temperatures must tell their scale.

    In K or degF it stays a text, as only the table tells whether it has one.
    """
    value = temperature_of_test(text)
    return value if scale_of(_number_and_unit(text)[1]) == "degC" else text.strip()


def setting(text: str) -> tuple[str, float]:
    """Type of an option: a name and its number, as in ``K4=2e-5``."""
    name, value = named(text, "NAME=NUMBER")
    return name, number(value)


def target(text: str) -> tuple[str, str]:
    """Type of an option: a coefficient and the uncertainty asked of it, as in ``K1=5ppm``."""
    return named(text, "NAME=SIZE, such as K1=5ppm")


def named(text: str, form: str) -> tuple[str, str]:
    """Split an option such as ``K1=5ppm`` into name and value; an error tells its form."""
    name, _, value = map(str.strip, text.partition("="))
    if not (name and value):
        raise click.BadParameter(f"{text!r} is not of the form {form}.")
    return name, value
