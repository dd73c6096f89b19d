"""Cells in columns."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

__all__ = ["aligned"]


def aligned(rows: Sequence[Sequence[str]], right: Collection[int]) -> Iterator[str]:
    r"""Align cells in columns.

    Parameters
    ----------
    rows : sequence of sequence of str
        The cells, as many in each row.
    right : collection of int
        Columns whose cells stand at the right.

    Yields
    ------
    str
        A line for each row.

    Examples
    --------
    >>> print(*aligned([("bias", "3.3"), ("k", "12")], right={1}), sep="\n")
    bias  3.3
    k      12
    """
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        cells = (
            cell.rjust(width) if i in right else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        yield "  ".join(cells).rstrip()
