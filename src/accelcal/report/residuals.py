"""Residuals by position and stroke, as text."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

from accelcal.report.calibration_rows import residual_grid, residuals_by_angle
from accelcal.report.lines import aligned
from accelcal.results.table import TableCalibration

Residual = float | None

_UNITS = ((1e-6, "ug"), (1e-3, "mg"), (1.0, "g"))
_LONGEST_ROW = 96
_SUMMARY = ("mean", "forward", "back", "lowest", "highest")


def residual_lines(table: TableCalibration) -> Iterator[str]:
    """Write a grid of positions and strokes; where it is too wide, a summary of each."""
    strokes = sorted(set(table.residuals.stroke))
    largest = max((abs(value) for value in table.residuals.value), default=0.0)
    size, unit = next((item for item in _UNITS if largest < 0.99995 * 1e4 * item[0]), _UNITS[-1])
    decimals = _decimals(largest / size)

    def shown(value: Residual) -> str:
        return "" if value is None else f"{round(value / size, decimals) + 0.0:.{decimals}f}"

    heading = ["deg", *(f"k={stroke}" for stroke in strokes), "mean"]
    if len("  ".join(heading)) <= _LONGEST_ROW:  # a grid of many strokes is not even written
        lines = list(_grid(heading, residual_grid(table)[1], shown))
        if max(map(len, lines)) <= _LONGEST_ROW:
            yield f"residuals [{unit}] by head angle and stroke"
            yield from lines
            return
    yield f"residuals [{unit}] by head angle, over {len(strokes)} strokes (the JSON has them all)"
    found = residuals_by_angle(table)
    yield from _by_angle(found, shown)
    yield f"residuals [{unit}] by stroke: mean"
    of_stroke: dict[int, list[float]] = {stroke: [] for stroke in strokes}
    for own in found.values():
        for stroke, value in own.items():
            of_stroke[stroke].append(value)
    yield from _in_lines([f"k={k} {shown(_mean(values))}" for k, values in of_stroke.items()])


def _grid(
    heading: list[str],
    rows: Sequence[tuple[float, Sequence[Residual]]],
    shown: Callable[[Residual], str],
) -> Iterator[str]:
    """All residuals, a line for each head angle."""
    grid = [heading]
    grid += [[f"{angle:g}", *map(shown, [*values, _mean(values)])] for angle, values in rows]
    if len(heading) == 3:  # of a single stroke there is no mean
        grid = [line[:-1] for line in grid]
    return aligned(grid, right=range(len(grid[0])))


def _by_angle(
    found: Mapping[float, Mapping[int, float]], shown: Callable[[Residual], str]
) -> Iterator[str]:
    """Summary of the residuals at each head angle."""
    columns = [["deg", *_SUMMARY]]
    columns += [[f"{angle:g}", *map(shown, _summary(own))] for angle, own in found.items()]
    yield from aligned(columns, right=range(len(columns[0])))


def _decimals(largest: float) -> int:
    """Three digits for the largest residual, and one decimal at most below a thousand."""
    return min(max(1, 2 - math.floor(math.log10(largest))), 6) if 0.0 < largest < 1000.0 else 1


def _mean(values: Sequence[Residual]) -> Residual:
    seen = [value for value in values if value is not None]
    return sum(seen) / len(seen) if seen else None


def _summary(own: Mapping[int, float]) -> list[Residual]:
    one_way = [value for stroke, value in own.items() if stroke % 2 == 1]
    other_way = [value for stroke, value in own.items() if stroke % 2 == 0]
    seen = own.values()
    return [_mean([*seen]), _mean(one_way), _mean(other_way), min(seen), max(seen)]


def _in_lines(items: Sequence[str]) -> Iterator[str]:
    width = max(map(len, items)) + 2
    per_line = _LONGEST_ROW // width
    for start in range(0, len(items), per_line):
        yield "".join(item.ljust(width) for item in items[start : start + per_line]).rstrip()
