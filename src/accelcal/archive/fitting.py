"""From the records of a block to rows: those of one plan together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.archive.columns import LAWS, ROWS, Columns, FrameColumn, no_rows, put_together
from accelcal.archive.failures import attempt, one_line
from accelcal.archive.settings import Settings
from accelcal.archive.stacked_rows import how_many_warn, stacked_laws, stacked_tables, verdicts_of
from accelcal.arrays import Labels, Places
from accelcal.calibrate.fit import calibrate_many
from accelcal.calibrate.stack import CalibrationStack
from accelcal.record import TumbleRecord

_AT_A_TIME = 2**19
"""Readings that are fitted together: a block of small files, but a part of a large table."""


class FittedRecords(NamedTuple):
    """Rows of the records of a block, in the order of the records."""

    tables: Columns
    laws: Columns
    failures: Mapping[int, str]  # place of a record that was not fitted -> the line that tells why
    failed: int  # records that failed a data sheet
    warned: int  # records whose gates warn


class _Piece(NamedTuple):
    """Rows of some records, each with the place of its record."""

    tables: Columns
    of_table: Places
    laws: Columns
    of_law: Places
    warned: int
    failed: int = 0


def fit_records(records: Sequence[TumbleRecord], settings: Settings) -> FittedRecords:
    """Fit records, and judge them where there is a data sheet."""
    failures: dict[int, str] = {}
    pieces = [
        piece
        for places in _parts(records)
        for piece in _pieces(records, places, settings, failures)
    ]
    return FittedRecords(
        _merged([(piece.tables, piece.of_table) for piece in pieces], ROWS),
        _merged([(piece.laws, piece.of_law) for piece in pieces], LAWS),
        failures,
        sum(piece.failed for piece in pieces),
        sum(piece.warned for piece in pieces),
    )


def _parts(records: Sequence[TumbleRecord]) -> Iterator[range]:
    """Places of records that follow each other and have few enough readings."""
    start = readings = 0
    for place, record in enumerate(records):
        if place > start and readings + len(record) > _AT_A_TIME:
            yield range(start, place)
            start, readings = place, 0
        readings += len(record)
    yield range(start, len(records))


def _pieces(
    records: Sequence[TumbleRecord],
    places: Sequence[int],
    settings: Settings,
    failures: dict[int, str],
) -> Iterator[_Piece]:
    """Rows of some of the records, those of one plan together."""
    own = [records[i] for i in places]
    if not own:
        return
    many = attempt(own[0].source, calibrate_many, own, settings.options)
    if isinstance(many, str):
        yield from _one_by_one(records, places, settings, failures, many)
        return
    failures |= {places[i]: one_line(error) for i, error in many.failures.items()}
    for rows, stack in many.stacks:
        some = [places[i] for i in rows.tolist()]
        piece = attempt(records[some[0]].source, _of_stack, stack, some, settings)
        if isinstance(piece, _Piece):
            yield piece
        else:
            yield from _one_by_one(records, some, settings, failures, piece)


def _one_by_one(
    records: Sequence[TumbleRecord],
    places: Sequence[int],
    settings: Settings,
    failures: dict[int, str],
    told: str,
) -> Iterator[_Piece]:
    """Rows of records of which one, or a bug, is in the way of all; of one it is told."""
    if len(places) == 1:
        failures[places[0]] = told
        return
    for place in places:
        yield from _pieces(records, [place], settings, failures)


def _of_stack(stack: CalibrationStack, places: Sequence[int], settings: Settings) -> _Piece:
    count = len(stack.tables)
    tables, (laws, record) = stacked_tables(stack), stacked_laws(stack)
    of_table, of_law = np.repeat(places, count), np.array(places)[record]
    warned = how_many_warn(stack)
    if settings.specification is None:
        return _Piece(tables, of_table, laws, of_law, warned)
    judged = verdicts_of(stack, tables, settings.specification)
    record = np.repeat(np.arange(len(stack)), count)
    tables = tables | {name: Labels(record, cells) for name, cells in judged.items()}
    return _Piece(tables, of_table, laws, of_law, warned, judged["verdict"].count("fail"))


def _merged(parts: Sequence[tuple[Columns, Places]], kinds: Mapping[str, FrameColumn]) -> Columns:
    """Put rows in the order of their records."""
    if not parts:
        return no_rows(kinds)
    if len(parts) == 1:
        return parts[0][0]
    places = np.concatenate([own for _, own in parts])
    return put_together([columns for columns, _ in parts], np.argsort(places, kind="stable"))
