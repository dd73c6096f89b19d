"""One table given to every method, and what came of it."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from hidden.table import Table

import accelcal
from accelcal.discovery.base import base_model
from accelcal.discovery.comparison import compared
from accelcal.discovery.solution import held_out_rms
from accelcal.record import TumbleRecord
from accelcal.reference import reference_temperature_of
from rivals.answer import Answer
from rivals.cases import DRAWN, Case
from rivals.methods import OURS, answer, share_the_null
from rivals.truth import Truth

LARGE = (12.0, 24.0)
"""Noncentralities of effects outside the catalogue."""


class Outcome(NamedTuple):
    """What a method made of a table.

    Attributes
    ----------
    case : Case
        The table.
    hidden : tuple of str
        What is hidden.
    q : float
        Noncentrality of all that is hidden.
    method : str
        Who was asked.
    answer : Answer
        What it said.
    right : tuple of bool
        For each name, whether it is right.
    exact : bool
        One right name for each hidden effect, none more.
    in_sets : bool
        Whether each hidden effect is in the set of some name.
    outside : bool
        Whether the catalogue has nothing of the class of what is hidden.
    closed : float
        Part of the held-out gap that is closed; NaN where it was not asked for.
    seconds : float
        Taken by the method.
    """

    case: Case
    hidden: tuple[str, ...]
    q: float
    method: str
    answer: Answer
    right: tuple[bool, ...]
    exact: bool
    in_sets: bool
    outside: bool
    closed: float
    seconds: float

    @property
    def verdict(self) -> str:
        """What the strongest name is: right, wrong, or else unknown or nothing."""
        if self.right:
            return "right" if self.right[0] else "wrong"
        return "unknown" if self.answer.unknown else "nothing"


def tried(cases: Sequence[Case], methods: Sequence[str], seed: int) -> list[Outcome]:
    """Give tables of one design and regime to all methods."""
    share_the_null()
    return [outcome for case in cases for outcome in _tried(case, methods, seed)]


def seconds_alone(case: Case, seed: int) -> float:
    """Time of our method where no null simulation is there to share."""
    share_the_null(shared=False)
    record = _record(case.draw(seed)[1])
    start = time.perf_counter()
    answer(OURS, record)
    return time.perf_counter() - start


def truth_of(case: Case, seed: int) -> tuple[Truth, TumbleRecord, Table]:
    """Draw a table: what is right about it, its record, and the table."""
    table = case.draw(seed, _size(case, seed))[1]
    record = _record(table)
    reference = reference_temperature_of(record, None)
    return Truth(table, base_model(record, reference or 0.0).conditions), record, table


def _tried(case: Case, methods: Sequence[str], seed: int) -> list[Outcome]:
    truth, record, table = truth_of(case, seed)
    found = []
    for method in methods:
        start = time.perf_counter()
        said = answer(method, record)
        seconds = time.perf_counter() - start
        found.append(
            Outcome(
                case=case,
                hidden=tuple(truth.parts),
                q=table.noncentrality() if truth.parts else 0.0,
                method=method,
                answer=said._replace(instances=()),
                right=tuple(truth.is_right_of_any(name) for name in said.names),
                exact=truth.are_right(said.names),
                in_sets=all(any(part in s for s in said.sets) for part in truth.parts),
                outside=case.section in ("outside", "positions") and truth.is_outside(),
                closed=_closed(said, record, table) if case.section == "held-out" else np.nan,
                seconds=seconds,
            )
        )
    return found


def _size(case: Case, seed: int) -> float:
    """As asked, or such that the noncentrality is large."""
    if case.s != DRAWN:
        return case.s
    per_unit = case.draw(seed, 4.0)[1].noncentrality() / 4.0
    return float(np.random.default_rng([seed, case.number]).uniform(*LARGE) / per_unit)


def _record(table: Table) -> TumbleRecord:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        table.write(path)
        record = accelcal.read_table(path)
    if not np.allclose(record.output, table.output):
        raise RuntimeError("the record has another order than the table")
    return record


def _closed(said: Answer, record: TumbleRecord, table: Table) -> float:
    """Part of the held-out mean square beyond that of the table without its effect."""
    reference = reference_temperature_of(record, None)
    whole = compared(record, reference or 0.0)
    clean = compared(replace(record, output=record.output - table.effect), reference or 0.0)
    (floor,) = held_out_rms(clean, [()])
    before, after = said.gap or held_out_rms(whole, [(), said.instances])
    if floor is None or before is None or after is None:
        return np.nan
    return (before**2 - after**2) / (before**2 - floor**2)
