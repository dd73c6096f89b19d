"""What the header lines and the caller declare of a test."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arguments.kinds import shown
from accelcal.arguments.options import check_text, mapping_of
from accelcal.arguments.temperatures import check_temperature, outside_tests
from accelcal.errors import InputError, TableError, located
from accelcal.geometry import checked_fixture_angle
from accelcal.head_angles import checked_positions
from accelcal.io.layout.header_lines import Declared
from accelcal.io.layout.parts import Layout
from accelcal.io.layout.separators import split_line
from accelcal.io.values.cells import Column, labels, number_and_unit
from accelcal.io.words.vocabulary import KEYS, KINDS_OF, canonical_key, has_unit, is_missing
from accelcal.units import (
    SCALES,
    UNITS,
    celsius,
    conversion_factor,
    output_unit,
    scale_of,
    scaled,
    size_of,
)

Overrides = Mapping[str, object]
"""What a caller declares."""

APPARATUS = tuple(item.name for item in fields(Apparatus))
OVERRIDES = (*APPARATUS, "reference_temperature", "positions", "unit", "serial", "serials")
OVERRIDES += ("date", "metadata")
"""What a caller may declare instead of the header."""

_QUANTITIES = (*APPARATUS, "reference_temperature")

_ON_SCALE = "temperature"
"""Kind of what is converted with the zero of its scale."""
_DECIMAL_COMMA = re.compile(r"\d,\d")
_FACTOR = re.compile(r"\bk\s*=|sigma\b|σ|\b9[59][0-9.,]*\s*%", re.IGNORECASE)


class Declarations(NamedTuple):
    """What is declared of a test."""

    record: Mapping[str, Any]  # fields of a `TumbleRecord` but for its readings and metadata
    runs: tuple[str, ...]  # names of all runs in their order, empty where they are not declared
    metadata: Mapping[str, str]


def declarations(
    layout: Layout, decimal: str, unit: str | None, overrides: Overrides, scale: str | None = None
) -> Declarations:
    """Read the header lines.

    Overrides, as of `declared_by_caller`, win over the header; a quantity may be a text with its
    unit, as ``"2 arcsec"``. The unit is that of the outputs in the table, and the scale the unit of
    its temperatures, where it is written. Raises TableError if a header line has a value that
    breaks a rule. Raises InputError if `overrides` does.
    """
    given, texts = _checked(overrides, layout.source)
    declared = {key: text for key, text in layout.declared.items() if key not in given} | texts
    values: dict[str, Any] = {key: text.value or None for key, text in declared.items()}
    for key in (*APPARATUS, "reference_temperature", "delta0"):
        if key in declared:
            _refuse_other_scale(key, declared[key], decimal, scale)
            gravity = given.get("local_gravity", values.get("local_gravity"))
            mark = "." if key in texts else decimal
            values[key] = declared_number(key, declared[key], mark, unit, gravity)
    values["positions"] = _positions(declared.get("positions"))
    values["unit"] = unit
    values |= given
    plain = ("reference_temperature", "positions", "unit", "serial", "date")
    record = {name: values.get(name) for name in plain}
    record["apparatus"] = Apparatus(**{key: values[key] for key in APPARATUS if key in values})
    return Declarations(
        record=record,
        runs=tuple(split_line(declared["runs"].value, ",")) if "runs" in declared else (),
        metadata={
            key: repr(values[key]) if key == "delta0" else text.value
            for key, text in declared.items()
            if key in ("delta0", "serials") or key not in KEYS
        }
        | {str(key): str(value) for key, value in given.get("metadata", {}).items()},
    )


def declared_by_caller(overrides: Any, names: Sequence[str] = OVERRIDES) -> dict[str, Any]:
    """Take the declarations of a caller.

    Those that are None are left out. Raises InputError if it is something else or has other names,
    as those that only header lines may have, the serial, unit or date is no text, or the metadata
    no mapping.
    """
    given = mapping_of(overrides, "overrides", "{'serial': 'AL-15'}")
    check_text(**{name: given.get(name) for name in ("serial", "unit", "serials", "date")})
    mapping_of(given.get("metadata"), "metadata", "{'operator': 'A. Meyer'}")
    for name, value in given.items():
        if value is not None and name not in names:
            meant = canonical_key(str(name))
            known = f"write {meant}" if meant in names else f"it is one of {', '.join(names)}"
            raise InputError(f"{name!r} cannot be declared; {known}")
    return {name: value for name, value in given.items() if value is not None}


def notes_of_serial(given: str | None, written: str | None) -> tuple[str, ...]:
    """Say that the serial of a caller takes the place of another one in the table."""
    if None in (given, written) or given == written:
        return ()
    return (f"the serial is {given}, as given, in place of {written} in the table",)


def serial_of_file(
    layout: Layout, column: Column | None, given: str | None
) -> tuple[str | None, tuple[str, ...]]:
    """Tell the one serial number of a file.

    That of the caller takes the place of that of the file, and a note says so. Raises TableError if
    the file has several, or a cell of the column is empty.
    """
    found = _lines_of_serials(layout, column)
    if len(found) > 1:
        problem = f"serials {shown(', '.join(found))} in one record"
        line = [*found.values()][1]
        raise TableError(problem, "give a file for each", source=layout.source, line=line)
    written = next(iter(found), None)
    return given or written, notes_of_serial(given, written)


def _lines_of_serials(layout: Layout, column: Column | None) -> dict[str, int]:
    """Line of each serial number where it first stands."""
    header = layout.declared.get("serial")
    found = {header.value: header.line} if header and header.value else {}
    if column and any(column.cells):
        index, names = labels(column)
        first = np.unique(index, return_index=True)[1]
        found = dict(zip(names, column.lines[first].tolist(), strict=True)) | found
    return dict(sorted(found.items(), key=lambda own: own[1]))


def _checked(overrides: Overrides, source: str) -> tuple[dict[str, Any], dict[str, Declared]]:
    """Values of the caller, and texts that are read as header lines are."""
    given: dict[str, Any] = dict(overrides)
    texts = {key: given.pop(key) for key in _QUANTITIES if _has_unit(given.get(key))}
    if "unit" in given:
        given["unit"] = output_unit(given["unit"])
    if "positions" in given:
        given["positions"] = checked_positions(given["positions"])
    if "reference_temperature" in given:
        check_temperature(reference_temperature=given["reference_temperature"])
    return given, {key: Declared(text, 0, source) for key, text in texts.items()}


def _has_unit(value: Any) -> bool:
    return isinstance(value, str) and number_and_unit(value, ".")[1] != ""


def declared_number(
    key: str,
    declared: Declared,
    decimal: str,
    output_unit: str | None = None,
    gravity: float | None = None,
) -> float:
    """Take the number of a header line.

    It is in g, rad, degC, m/s^2 or parts of one; a resolution is converted to the unit of the
    outputs. By the local gravity [m/s^2] an acceleration may be given in m/s^2. Raises TableError
    if it is no number, in a unit of something else, or out of its range.
    """
    if _FACTOR.search(declared.value):
        problem = f"{key} is {shown(declared.value)}, with a factor"
        raise declared.refuse(problem, "give the standard uncertainty alone, that of k = 1")
    number, unit = number_and_unit(declared.value, decimal)
    size = _size(key, declared, unit, output_unit, gravity) if unit else 1.0
    written = f"{key} is {shown(declared.value)}"
    try:
        value = scaled(number, size)
    except ValueError:
        point = ", with a decimal point" if _DECIMAL_COMMA.search(declared.value) else ""
        raise declared.refuse(written, f"give it as a number{point}") from None
    if not np.isfinite(value):
        raise declared.refuse(f"{key} is {value}", "it is a finite number")
    if unit and _ON_SCALE in KINDS_OF.get(key, ()):
        value = float(celsius(value, unit))
    if key in APPARATUS:
        _check_apparatus(key, value, declared, written if unit else "")
    if key == "reference_temperature" and outside_tests(value):
        problem, remedy = f"{key} is {value:g}", "it is a temperature of the test in degC"
        raise declared.refuse(problem, remedy)
    if key == "delta0":
        located(checked_fixture_angle, value, source=declared.source, line=declared.line)
    return value


def _refuse_other_scale(key: str, declared: Declared, decimal: str, scale: str | None) -> None:
    """Refuse a temperature without a unit where those of the table have another than degC.

    And one in another where they have none.
    """
    own = number_and_unit(declared.value, decimal)[1]
    written = f"{key} is {shown(declared.value)}"
    if not own and _differs(key, scale):
        problem = f"{written} without a unit, in a table in {scale}"
        raise declared.refuse(problem, f"write its unit behind it, {scale} or degC")
    if scale is None and _differs(key, own):
        problem = f"{written}, and the temperatures of the table have no unit"
        theirs = f"write theirs, as in T [{own}] or T [degC]"
        raise declared.refuse(problem, f"{theirs}, or give this one in degC")


def _differs(key: str, unit: str | None) -> bool:
    """Whether what is declared has another number in a unit of temperatures than in degC."""
    kinds = KINDS_OF.get(key, ())
    if scale_of(unit) == "degC":
        return False
    differs = "temperature difference" in kinds and size_of(unit or "", *kinds) != 1.0
    return differs or _ON_SCALE in kinds


def declared_temperature(layout: Layout, decimal: str) -> float | None:
    """Temperature that a header line declares for all rows, None where it is not known [degC].

    Raises as `declared_number` does.
    """
    written = layout.declared.get("temperature")
    if written is None or is_missing(written.value.removesuffix("degC").strip()):
        return None
    return declared_number("temperature", written, decimal)


def _check_apparatus(key: str, value: float, declared: Declared, written: str) -> None:
    """Refuse what no apparatus has; in another unit, as it is written."""
    try:
        Apparatus(**{key: value})
    except InputError as error:
        problem, _, remedy = str(error).partition("; ")
        raise declared.refuse(written or problem, remedy) from None


def _size(
    key: str, declared: Declared, unit: str, output_unit: str | None, gravity: float | None
) -> float:
    """Size of the unit of a header line in that of the number to be stored."""
    kinds = KINDS_OF.get(key, ())
    size = 1.0 if _ON_SCALE in kinds and has_unit("temperature", unit) else size_of(unit, *kinds)
    if not kinds and output_unit:
        size = conversion_factor(unit, output_unit)
    if size is None and "acceleration" in kinds and (metres := size_of(unit, "gravity")):
        if gravity is None:
            problem = f"{key} is given in {shown(unit)} without the local gravity"
            raise declared.refuse(problem, "give it in g, or declare '# g: ...', in m/s^2")
        size = metres / gravity
    if size is None:
        names = (name for kind in kinds for name in (SCALES if kind == _ON_SCALE else UNITS[kind]))
        undeclared = "the output unit, or declare that unit, as in '# unit: mA'"
        right = ", ".join(names) or output_unit or undeclared
        raise declared.refuse(f"{key} is given in {shown(unit)}", f"give it in {right}")
    return size


def _positions(declared: Declared | None) -> int:
    if declared is None:
        return 8
    if not re.fullmatch(r"[1-9][0-9]{0,5}", declared.value):
        problem = f"positions is {shown(declared.value)}"
        remedy = "it is the number of positions in a full turn, such as 8"
        raise declared.refuse(problem, remedy)
    return int(declared.value)
