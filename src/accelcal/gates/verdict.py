"""The verdict of a gate on many tables, and sizes as a gate words them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Ints, Mask, Places
from accelcal.record import TumbleRecord
from accelcal.results.quantity import Gate
from accelcal.shown_units import ACCELERATIONS, ANGLES, by_size, three_digits

SIGNIFICANT = 0.01
"""False-alarm rate of a gate that is a statistical test."""

VERDICTS = ("pass", "warn", "not assessed")
"""Verdicts of a gate; their places here are the codes in a `GateStack`."""

_WARN, _NOT_ASSESSED = VERDICTS.index("warn"), VERDICTS.index("not assessed")


class GateStack(NamedTuple):
    """Verdict of one gate on each of T tables or records."""

    name: str  # what was checked
    verdict: Places  # places in `VERDICTS`, shape (T,)
    finding: Callable[[int], str]  # gives the sentence of one table

    def gate(self, index: int) -> Gate:
        """Return the outcome for one table, with its sentence."""
        return Gate(self.name, VERDICTS[self.verdict[index]], self.finding(index))

    def part(self, start: int, end: int) -> GateStack:
        """Return the verdicts from one place to another."""
        return GateStack(self.name, self.verdict[start:end], lambda i: self.finding(start + i))

    def warned(self) -> list[int]:
        """Return the places where the gate warns."""
        found: list[int] = np.flatnonzero(self.verdict == _WARN).tolist()
        return found

    def warning(self, index: int) -> str:
        """Return the sentence of one table with the name of the gate, for a list of warnings."""
        return f"gate {self.name}: {self.finding(index)}"


def gate_stack(
    name: str, bad: Mask, said: Callable[[int], str], missing: Sequence[tuple[ArrayLike, str]] = ()
) -> GateStack:
    """Warn where it is bad, shape (T,), or pass, or say why a gate could not look.

    What was found in a table is `said` by its place. For some tables the gate could not look (a
    mask, or a bool for all), and why: the first reason counts, and an empty one is told by `said`.

    Examples
    --------
    >>> import numpy as np
    >>> size = np.array([2.0, 30.0])
    >>> found = gate_stack("closure", size > 9.0, lambda i: f"{size[i]:g} ug")
    >>> found.gate(0).verdict, found.gate(1).verdict, found.gate(1).finding
    ('pass', 'warn', '30 ug')
    """
    verdict = np.where(bad, _WARN, 0)
    for where, _ in missing:
        np.copyto(verdict, _NOT_ASSESSED, where=np.asarray(where))

    def finding(index: int) -> str:
        for where, reason in missing:
            cells = np.asarray(where)
            if cells.item() if cells.size == 1 else cells[index]:  # one for all, or one a table
                return reason or said(index)
        return said(index)

    return GateStack(name, verdict, finding)


def acceleration(value: float) -> str:
    """Write an acceleration in ug, mg or g, whichever is short.

    Examples
    --------
    >>> acceleration(-2.147e-5), acceleration(0.7777), acceleration(9.3)
    ('-21.5 ug', '778 mg', '9.3 g')
    """
    return _short(value, ACCELERATIONS)


def angle(value: float) -> str:
    """Write an angle in urad, mrad or degrees, whichever is short.

    Examples
    --------
    >>> angle(2.1e-5), angle(0.0123), angle(0.5)
    ('21 urad', '12.3 mrad', '28.6 deg')
    """
    return _short(value, ANGLES)


def _short(value: float, units: Sequence[tuple[float, str]]) -> str:
    size, unit = by_size(abs(value), units, 0.9995)
    return f"{three_digits(value / size)} {unit}"


def times(ratio: float) -> str:
    """Write a ratio as so many times.

    Examples
    --------
    >>> times(38812.0), times(2.04), times(0.001003)
    ('39000', '2', '0.001')
    """
    return f"{float(f'{ratio:.2g}'):.12g}"


def reading_name(record: TumbleRecord, index: int, line: Ints | None) -> str:
    """Say which reading it is."""
    told = "" if line is None else f" (line {line[index]})"
    return f"stroke {record.stroke[index]} at {record.angle[index]:g} deg{told}"
