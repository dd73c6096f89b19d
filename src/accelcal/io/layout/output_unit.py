"""The unit of the outputs of a file: as header line, headings and cells write it, or as asked."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from accelcal.arguments.kinds import shown
from accelcal.errors import TableError, located
from accelcal.io.layout.parts import Layout
from accelcal.io.values.cells import Column
from accelcal.io.words.vocabulary import is_missing
from accelcal.units import canonical_unit, conversion_factor, is_output_unit, output_unit


class Written(NamedTuple):
    """A unit as written."""

    unit: str
    line: int
    in_header: bool = False  # whether a header line has it, which an option replaces
    source: str = ""  # the file or sheet; empty where it is that of the table


_SEVERAL = "units {!r} and {!r} in one table; give all outputs and their std in one unit"


def unit_of_outputs(
    written: Iterable[Written], given: str | None, source: str, several: str = _SEVERAL
) -> tuple[str | None, tuple[str, ...]]:
    """Tell the one unit of the outputs.

    That of the caller wins over the one unit of the file, and a note says so. `several` is what is
    said of two units that are not the same, problem and remedy. Raises TableError if a unit of the
    file is no output unit, or there are several. Raises InputError if the given one is none.
    """
    if given:
        unit, written = output_unit(given), list(written)
        of_table = [(canonical_unit(own.unit), own.line) for own in written if not own.in_header]
        _require_one(of_table, source, several)
        return unit, notes_of_unit(unit, (own.unit for own in written))
    found = [
        (located(output_unit, own.unit, source=own.source or source, line=own.line), own.line)
        for own in written
    ]
    _require_one(found, source, several)
    return found[0][0] if found else None, ()


def _require_one(found: Sequence[tuple[str, int]], source: str, several: str) -> None:
    for unit, line in found:
        if unit != found[0][0]:
            raise _two_units(found[0][0], unit, line, source, several)


def _two_units(one: str, other: str, line: int, source: str, several: str) -> TableError:
    problem, _, remedy = several.format(one, other).partition("; ")
    return TableError(problem, remedy, source=source, line=line)


def units_written(
    layout: Layout, outputs: Iterable[Column], rows: Column | None = None
) -> Iterator[Written]:
    """List the units that a table writes in the header line, with its outputs and in its rows.

    `rows` is a column of units.
    """
    header = layout.declared.get("unit")
    if header and header.value:
        yield Written(header.value, header.line, in_header=True, source=header.source)
    yield from units_of_columns(layout, outputs)
    if rows is not None:
        yield from _units_of_rows(rows)


def _units_of_rows(column: Column) -> Iterator[Written]:
    """List the units that a column of units has, each where it first stands."""
    first: dict[str, int] = {}
    for cell, line in zip(column.cells, column.lines.tolist(), strict=True):
        first.setdefault(str(cell), line)
    for unit, line in first.items():
        if names_unit(unit):
            yield Written(unit, line)


def names_unit(cell: str) -> bool:
    """Tell whether a cell of a column of units has one, right or wrong."""
    return not is_missing(cell) or is_output_unit(cell)


def units_of_columns(layout: Layout, columns: Iterable[Column]) -> Iterator[Written]:
    """List the units in the headings or cells of some columns."""
    for column in columns:
        if column.unit:
            in_heading = column.unit in column.heading
            line = layout.headings_line if in_heading else int(column.lines[0])
            yield Written(column.unit, line)


def factor_of_std(
    std: Sequence[Written], outputs: Sequence[Written], given: str | None, source: str
) -> float:
    """Factor from the unit of a column std to that of the outputs.

    The unit `given` is the one that the caller asks for. Raises TableError if the unit is none of
    outputs, or that of another quantity.
    """
    beside = [own.unit for own in outputs if not (own.in_header and given)]
    wanted = next(iter(beside), given)
    if not std or not wanted:
        return 1.0
    unit = located(output_unit, std[0].unit, source=source, line=std[0].line)
    factor = conversion_factor(unit, wanted)
    if factor is None:
        raise _two_units(canonical_unit(wanted), unit, std[0].line, source, _SEVERAL)
    return factor


def notes_of_unit(unit: str, written: Iterable[str]) -> tuple[str, ...]:
    """Say where a table has another unit than the one that is asked for.

    The first that differs is told. The unit that is asked for is in its canonical form.
    """
    for own in written:
        if canonical_unit(own) != unit:
            return (f"the table has outputs in {shown(own)}; they are taken as {unit}, as asked",)
    return ()
