"""Reading of a triad's attitudes: three outputs a row and, where it is known, which way was up."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from accelcal.arguments.axes import AXES, axis_named
from accelcal.arrays import Array
from accelcal.errors import TableError, located
from accelcal.head_angles import nominal_angles
from accelcal.io.declarations import (
    declared_by_caller,
    declared_number,
    declared_temperature,
    serial_of_file,
)
from accelcal.io.files.text import Source, read_text
from accelcal.io.layout.output_columns import unit_of_outputs, units_written
from accelcal.io.small_table import SmallTable, small_table
from accelcal.io.values.cells import Column, complete_numbers
from accelcal.io.values.markers import notes_of_scale, refuse_markers, temperatures_of
from accelcal.io.values.places import in_degrees
from accelcal.io.words.headings import Heading, name_and_unit, read_heading
from accelcal.io.words.vocabulary import has_unit, is_missing, is_unit_of
from accelcal.plural import listed
from accelcal.triad.record import TriadRecord, up_of_turn
from accelcal.units import is_output_unit

__all__ = ["read_triad", "triad_heading"]

_REMEDY = "name the columns x, y, z and, for known attitudes, up_x, up_y, up_z or shaft, angle"
_OF_THE_ROW = ("temperature", "serial", "unit")
"""Columns that tell no attitude."""
_LEAST_COSINE = np.cos(np.pi / 8.0)
"""Of the angle between directions that are written as up and by shaft and angle: 22.5 deg."""


def read_triad(
    source: Source, *, overrides: Mapping[str, str | float | None] | None = None
) -> TriadRecord:
    r"""Read the attitudes of a triad.

    Parameters
    ----------
    source : path, "-" or file object
        A table with a row for each attitude: the outputs in columns ``x``, ``y``, ``z`` (also
        ``ax``, ``acc_x``, ``mean_x``, ``output_x``), a unit behind them as in ``ax_mg``. Where
        attitudes are known, either ``up_x``, ``up_y``, ``up_z``, the acceleration along the axes
        of the block [g], or ``shaft`` (``x``, ``-z`` ...), the axis of the block along the shaft,
        and ``angle`` of the head [deg]; where both are there, the first count and the others have
        to agree within 22.5 deg. Beside directions a ``shaft`` alone is any name of a clamping.
    overrides : mapping of str to str or float, optional
        ``unit``, ``serial`` and ``local_gravity`` [m/s^2] that win over the header; None leaves
        the header's.

    Returns
    -------
    TriadRecord
        The attitudes.

    Raises
    ------
    TableError
        If the table is unusable; the message names the line and the remedy.
    InputError
        If `overrides` are no declarations of it.

    Examples
    --------
    >>> import io
    >>> import accelcal
    >>> accelcal.read_triad(io.StringIO("ax_V,ay_V,az_V\n0.1,0.0,1.0\n0.1,1.0,0.0\n")).unit
    'V'
    """
    table = small_table(read_text(source), triad_heading, tuple(AXES), _REMEDY)
    given = declared_by_caller(overrides, ("unit", "serial", "local_gravity"))
    column = table.columns.get("serial")
    serial, of_serial = serial_of_file(table.layout, column, given.get("serial"))
    channels = [table.columns[axis].without_unit(partial(is_unit_of, "output")) for axis in AXES]
    written = units_written(table.layout, channels, table.columns.get("unit"))
    unit, of_unit = unit_of_outputs(written, given.get("unit"), table.layout.source)
    output = np.column_stack([complete_numbers(column) for column in channels])
    refuse_markers(channels, output)
    scale = notes_of_scale(table.columns.get("temperature"))
    return located(
        lambda: TriadRecord(
            output=output,
            up=_up(table),
            line=channels[0].lines,
            attitude=_attitude(table),
            shaft=_shaft(table),
            temperature=_temperature(table),
            unit=unit,
            local_gravity=given["local_gravity"] if "local_gravity" in given else _gravity(table),
            serial=serial,
            source=table.layout.source,
            notes=(*table.layout.notes, *of_unit, *of_serial, *scale),
        ),
        source=table.layout.source,
    )


def triad_heading(text: str) -> Heading:
    """Understand a column heading of a triad.

    Examples
    --------
    >>> triad_heading("acc_x [mA]")[1:3], triad_heading("up_z")[1], triad_heading("T").role
    (('x', 'mA'), 'up_z', 'temperature')
    """
    name, unit = name_and_unit(text, partial(is_unit_of, "angle"))
    if name.casefold() in ("shaft", "angle"):
        return Heading(text, name.casefold(), unit or None)
    name, unit = name_and_unit(text, is_output_unit)
    axis, behind, is_up = axis_named(name)
    if axis and not behind:
        return Heading(text, f"up_{axis}" if is_up else axis, unit or None)
    known = read_heading(text)
    return known if known.role in _OF_THE_ROW else Heading(text, None)


def _up(table: SmallTable) -> Array | None:
    there = set(table.columns)
    written = [f"up_{axis}" for axis in AXES]
    told = [names for names in (written, ["shaft", "angle"]) if there >= {*names}]
    half = sorted(there - {*AXES, *_OF_THE_ROW}.union(*told))
    if half and written not in told:
        problem = f"column {listed(half)} alone, which tells no attitude"
        raise table.layout.refuse(problem, _REMEDY)
    if not told:
        return None
    if told == [["shaft", "angle"]]:
        return _turned(table.columns["shaft"], table.columns["angle"])
    up = np.column_stack([complete_numbers(table.columns[name]) for name in written])
    if len(told) > 1:
        turned = _turned(table.columns["shaft"], table.columns["angle"])
        agree = (up * turned).sum(axis=1) > _LEAST_COSINE * np.linalg.norm(up, axis=1)
        problem = "{} and shaft are not as up_x, up_y, up_z"
        table.columns["angle"].check(agree, problem, "correct one, or keep one of both")
    return up


def _temperature(table: SmallTable) -> Array | None:
    """Temperature of each attitude, by a column or the header line."""
    column = table.columns.get("temperature")
    if column is not None:
        return temperatures_of(column)
    value = declared_temperature(table.layout, table.columns["x"].decimal)
    return None if value is None else np.full(len(table.columns["x"].lines), value)


def _attitude(table: SmallTable) -> tuple[str, ...] | None:
    """Names of the attitudes by shaft and angle: two of them may have one direction up."""
    there = set(table.columns)
    if {"up_x", "up_y", "up_z"} <= there or not {"shaft", "angle"} <= there:
        return None
    shafts = _shaft(table) or ()
    angles = nominal_angles(complete_numbers(table.columns["angle"])) % 360.0
    return tuple(f"{shaft} {angle:g}" for shaft, angle in zip(shafts, angles, strict=True))


def _shaft(table: SmallTable) -> tuple[str, ...] | None:
    """Shafts about which the block was turned; one turned round is another clamping."""
    column = table.columns.get("shaft")
    if column is None:
        return None
    shafts = tuple(str(cell).strip().casefold().lstrip("+") for cell in column.cells)
    told = np.array([not is_missing(shaft) for shaft in shafts])
    if not told.any():
        return None
    remedy = "name the shaft, or the clamping, of each attitude"
    column.check(told, "{} names no shaft", remedy)
    return shafts


def _turned(shaft: Column, angle: Column) -> Array:
    if angle.unit and not has_unit("angle", angle.unit):
        problem = f"angle in {angle.unit}"
        raise TableError(problem, "give it in deg", source=angle.source, line=int(angle.lines[0]))
    degrees, rows = in_degrees(angle, complete_numbers(angle)), []
    for index, value in enumerate(degrees):
        name, line = str(shaft.cells[index]), int(shaft.lines[index])
        rows.append(located(up_of_turn, name, [value], source=shaft.source, line=line)[0])
    return np.array(rows)


def _gravity(table: SmallTable) -> float | None:
    written = table.layout.declared.get("local_gravity")
    if written is None or not written.value:
        return None
    return declared_number("local_gravity", written, table.columns["x"].decimal)
