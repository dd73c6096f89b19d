"""What arguments are: of the kind a function takes, one or several, or a path and its end."""

from __future__ import annotations

import math
from collections.abc import Iterable
from numbers import Real
from os import PathLike, fspath
from typing import Any

from accelcal.errors import InputError

_KINDS = {
    "Acceleration": ("accelerations", "make them by accelcal.accelerations(angles)"),
    "Accelerometer": (
        "an accelerometer",
        "make one by accelcal.Accelerometer(...), or take that of accelcal.twin(discovery)",
    ),
    "BilinearLaw": (
        "a law of temperature",
        "make one by accelcal.BilinearLaw(at_T0, above, below)",
    ),
    "Calibration": (
        "a calibration of one accelerometer",
        "make one by accelcal.fit, or by accelcal.read_calibration('file.json')",
    ),
    "Distribution": (
        "a distribution",
        "make one by accelcal.distribution('normal', standard=1e-5)",
    ),
    "Discovery": (
        "a discovery",
        "make one by accelcal.discover(record), or by accelcal.read_discovery('model.json')",
    ),
    "Disturbance": ("an effect with its size", "make one by accelcal.effect('backlash').of(2e-5)"),
    "Effect": (
        "an effect",
        "make one by accelcal.Effect(id=..., ...), or choose one by accelcal.effect('backlash')",
    ),
    "Contact": (
        "a contact",
        "make one by accelcal.io.toml.laboratory.Contact(name='Example Laboratory')",
    ),
    "HeadCalibration": (
        "a head",
        "make one by accelcal.calibrate_head(records), or by accelcal.read_head('head.csv')",
    ),
    "NoiseComponents": ("noise", "make it by accelcal.NoiseComponents(reading=5e-6)"),
    "Launch": (
        "a launch",
        "make one by accelcal.Launch(label, time, output)",
    ),
    "Laboratory": (
        "a laboratory",
        "make one by accelcal.io.toml.laboratory.Laboratory(...), or read one from a TOML file",
    ),
    "Limit": ("a limit", "make one by accelcal.Limit('bias', 'mg', maximum=5)"),
    "Pace": ("a pace", "make one by accelcal.Pace(reading=60)"),
    "Parameter": ("a parameter", "make one by accelcal.Parameter('sine', 'rad', 'meaning')"),
    "RandomBound": (
        "a bound of a random error",
        "make one by accelcal.error_budget.random_part.RandomBound(bound, divisor)",
    ),
    "RandomPart": (
        "the random errors",
        "make them by accelcal.random_part(calibration, launch=2e-5)",
    ),
    "Specification": (
        "a data sheet",
        "read one by accelcal.read_specification('sheet.toml')",
    ),
    "Stability": (
        "a stability test",
        "make one by accelcal.analyse(accelcal.read_stability('record.csv')), or by"
        " accelcal.Stability.from_json('stability.json')",
    ),
    "StabilityRecord": (
        "a stability record",
        "make one by accelcal.read_stability('record.csv'), or by"
        " accelcal.StabilityRecord(launches)",
    ),
    "Stand": ("a stand", "make one by accelcal.read_stand('stand.toml')"),
    "StandConditions": (
        "conditions of a stand",
        "make them by accelcal.stand_uncertainty.readings.StandConditions(local_gravity=9.81)",
    ),
    "StandComponent": (
        "a component of a stand",
        "make one by accelcal.StandComponent(name, kind, distribution)",
    ),
    "TableCalibration": ("a table of a calibration", "give one of calibration.tables"),
    "TriadRecord": (
        "a record of a triad",
        "make one by accelcal.read_triad('file.csv'), or give an array",
    ),
    "TumblePlan": ("a plan", "make one by accelcal.TumblePlan(positions=8)"),
    "TumbleRecord": (
        "a record",
        "make one by accelcal.read_table('file.csv'), or by accelcal.read_arrays(columns) of"
        " arrays or a DataFrame",
    ),
}
"""Name of a class -> what it is, and what makes one."""


def expect(value: object, kind: type) -> None:
    """Refuse what is of another kind, such as the path of a record.

    Examples
    --------
    >>> from accelcal.record import TumbleRecord
    >>> expect(None, TumbleRecord)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: None in place of a record; make one by ...
    """
    if not isinstance(value, kind):
        what, remedy = _KINDS[kind.__name__]
        raise InputError(f"{kind_of(value)} in place of {what}; {remedy}")


def each_of(values: Any, kind: type) -> tuple[Any, ...]:
    """Take several of a kind; a single one counts as a list of one."""
    found = (values,) if isinstance(values, kind) else several(values)
    for value in found:
        expect(value, kind)
    return found


def several(values: Any) -> tuple[Any, ...]:
    """Take several values; a single one, a text or a table of columns counts as one.

    A Series has keys, but is no table.

    Examples
    --------
    >>> several([20.0, 80.0]), several(20.0), several("o+")
    ((20.0, 80.0), (20.0,), ('o+',))
    """
    if hasattr(values, "tolist"):  # an array; the list of one without an axis is its only item
        values = values.tolist()
    one = not isinstance(values, Iterable) or isinstance(values, str | bytes)
    return (values,) if one or hasattr(values, "keys") else tuple(values)


def path_text(value: str | PathLike[str], remedy: str = "give the name of a file") -> str:
    """Take a path as text."""
    if not isinstance(value, str | PathLike):
        raise InputError(f"{kind_of(value)} in place of a path; {remedy}")
    return fspath(value)


def ending_of(path: str | PathLike[str], endings: Iterable[str], remedy: str = "choose one") -> str:
    """Tell the end of the name of a file, capitals or not.

    Examples
    --------
    >>> ending_of("budget.SVG", [".png", ".svg"])
    '.svg'
    """
    endings = tuple(endings)
    name = path_text(path, f"name a file that ends in {', '.join(endings)}")
    for ending in endings:
        if name.casefold().endswith(ending):
            return ending
    told = name or repr(name)
    raise InputError(f"{told}: the name ends in none of {', '.join(endings)}; {remedy}")


def kind_of(value: object) -> str:
    """Name of the kind of a value, as messages have it."""
    return "None" if value is None else type(value).__name__


def as_given(value: object) -> str:
    """A number or text as it is, anything else by its kind, as messages have it."""
    if isinstance(value, str):
        return shown(value)
    if isinstance(value, int) and not is_finite(value):
        return "a whole number beyond all floats"
    return str(value) if isinstance(value, Real) else kind_of(value)


def shown(text: str) -> str:
    """Quote a text for a message, cut to 40 characters."""
    return repr(text if len(text) <= 40 else text[:37] + "...")


def is_finite(value: float) -> bool:
    """Tell whether a number is finite, and no whole number beyond all floats."""
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False
