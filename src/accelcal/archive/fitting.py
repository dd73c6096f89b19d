"""From the records of a block to rows: those of one plan together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.archive.cells import Columns, Labels, columns_of_rows, put_together
from accelcal.archive.columns import LAWS, ROWS, FrameColumn
from accelcal.archive.failures import attempt, one_line
from accelcal.archive.rows import law_rows, table_rows
from accelcal.archive.settings import Settings
from accelcal.archive.stacked_rows import can_be_columns, stacked_laws, stacked_tables
from accelcal.archive.stacked_verdicts import verdicts_of
from accelcal.arrays import Places
from accelcal.calibrate.many import calibrate_many
from accelcal.calibrate.stack import CalibrationStack
from accelcal.record import TumbleRecord


class FittedRecords(NamedTuple):
    """Rows of the records of a block.

    Attributes
    ----------
    tables, laws : mapping of str to Labels or ndarray
        Cells by column, in the order of the records.
    failures : mapping of int to str
        Place of each record that could not be fitted, and the line that tells why.
    failed : int
        Number of records that failed a data sheet.
    """

    tables: Columns
    laws: Columns
    failures: Mapping[int, str]
    failed: int


class _Piece(NamedTuple):
    """Rows of some records, each with the place of its record."""

    tables: Columns
    of_table: Places
    laws: Columns
    of_law: Places
    failed: int = 0


def fit_records(records: Sequence[TumbleRecord], settings: Settings) -> FittedRecords:
    """Fit records, and judge them where there is a data sheet.

    Parameters
    ----------
    records : sequence of TumbleRecord
        The records.
    settings : Settings
        How to fit.

    Returns
    -------
    FittedRecords
        Their rows.
    """
    pieces: list[_Piece] = []
    failures: dict[int, str] = {}
    for places, stack in _stacks(records, settings, range(len(records)), failures):
        bulk = can_be_columns(stack)
        piece = attempt("", _of_stack, stack, places, settings) if bulk else ""
        if isinstance(piece, _Piece):
            pieces.append(piece)
        else:
            pieces += _one_by_one(stack, places, settings, failures)
    return FittedRecords(
        _merged([(piece.tables, piece.of_table) for piece in pieces], ROWS),
        _merged([(piece.laws, piece.of_law) for piece in pieces], LAWS),
        failures,
        sum(piece.failed for piece in pieces),
    )


def _stacks(
    records: Sequence[TumbleRecord],
    settings: Settings,
    places: Sequence[int],
    failures: dict[int, str],
) -> Iterator[tuple[list[int], CalibrationStack]]:
    """Calibrations of the records of each plan; one by one where a bug is in the way."""
    own = [records[i] for i in places]
    if not own:
        return
    many = attempt(own[0].source, calibrate_many, own, settings.options)
    if isinstance(many, str) and len(own) == 1:
        failures[places[0]] = many
    elif isinstance(many, str):
        for place in places:
            yield from _stacks(records, settings, [place], failures)
    else:
        failures |= {places[i]: one_line(error) for i, error in many.failures.items()}
        for rows, stack in many.stacks:
            yield [places[i] for i in rows.tolist()], stack


def _of_stack(stack: CalibrationStack, places: Sequence[int], settings: Settings) -> _Piece:
    count = len(stack.tables)
    tables, (laws, record) = stacked_tables(stack), stacked_laws(stack)
    of_table, of_law = np.repeat(places, count), np.array(places)[record]
    if settings.specification is None:
        return _Piece(tables, of_table, laws, of_law)
    verdicts = verdicts_of(stack, tables, settings.specification)
    judged = {"verdict": verdicts.outcomes, "failed_limits": verdicts.failed_limits}
    record = np.repeat(np.arange(len(stack)), count)
    tables = tables | {name: Labels(record, cells) for name, cells in judged.items()}
    return _Piece(tables, of_table, laws, of_law, verdicts.outcomes.count("fail"))


def _one_by_one(
    stack: CalibrationStack, places: Sequence[int], settings: Settings, failures: dict[int, str]
) -> Iterator[_Piece]:
    for index, place in enumerate(places):
        record = stack.plan.records[index]
        piece = attempt(record.source, _of_one, stack, index, place, settings)
        if isinstance(piece, str):
            failures[place] = piece
        else:
            yield piece


def _of_one(stack: CalibrationStack, index: int, place: int, settings: Settings) -> _Piece:
    record = stack.plan.records[index]
    calibration = settings.judged(stack.one(index))
    tables, laws = list(table_rows(calibration, record)), list(law_rows(calibration, record))
    failed = calibration.verdict is not None and calibration.verdict.outcome == "fail"
    return _Piece(
        columns_of_rows(tables, ROWS),
        np.full(len(tables), place),
        columns_of_rows(laws, LAWS),
        np.full(len(laws), place),
        int(failed),
    )


def _merged(parts: Sequence[tuple[Columns, Places]], kinds: Mapping[str, FrameColumn]) -> Columns:
    """Put rows in the order of their records."""
    if len(parts) == 1:
        return parts[0][0]
    places = np.concatenate([np.zeros(0, dtype=np.intp), *(own for _, own in parts)])
    frames = [columns_of_rows([], kinds), *(columns for columns, _ in parts)]
    return put_together(frames, np.argsort(places, kind="stable"))
