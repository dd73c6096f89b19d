"""Rows whose cells two blanks or more separate, as in columns of a text."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

_CELL = re.compile(r"[^ ]+(?: [^ ]+)*")


def with_tabs(lines: Sequence[str], size: int) -> Iterator[str]:
    r"""Put tabs between the cells of rows that two blanks or more separate.

    A row of fewer cells has them in the columns of the others.

    Examples
    --------
    >>> list(with_tabs(["0   1.35  1.36", "45        0.96"], 3))
    ['0\t1.35\t1.36', '45\t\t0.96']
    """
    found = [list(_CELL.finditer(line)) for line in lines]
    whole = [[cell.span() for cell in cells] for cells in found if len(cells) == size]
    columns = [
        (min(start for start, _ in own), max(end for _, end in own))
        for own in zip(*whole, strict=True)
    ]
    for cells in found:
        row = [""] * len(cells)
        for place, cell in zip(_places(cells, columns), cells, strict=True):
            row += [""] * (place + 1 - len(row))
            row[place] = cell.group()
        yield "\t".join(row)


def _places(cells: Sequence[re.Match[str]], columns: Sequence[tuple[int, int]]) -> Sequence[int]:
    """Columns in which cells stand: the first ones, where there are as many or nothing tells."""
    over = [
        place
        for cell in cells
        for place, (start, end) in enumerate(columns)
        if cell.start() < end and start < cell.end()
    ]
    told = len(over) == len(set(over)) == len(cells) < len(columns)
    return over if told else range(len(cells))
