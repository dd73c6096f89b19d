"""Decimal marks that may be thousands marks, as German programs write 135.474 for 135474."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import chain

import numpy as np

from accelcal.arrays import Array
from accelcal.io.words.vocabulary import is_missing, with_hyphen

_GROUPED = re.compile(r"[+-]?[1-9][0-9]{0,2}([.,][0-9]{3})?")
"""A number that is grouped, or has nothing to group."""

_BLANKS = re.compile(r"[+-]?[0-9]{1,3}(?:[\s'\u2019][0-9]{3})+(?:\.[0-9]*)?")

_PROVED = re.compile(
    r"(?<![0-9.,])[0-9]{1,3}([.,])[0-9]{3}(?:\1[0-9]{3})*(?:\1[0-9]{3}|(?!\1)[.,][0-9]+)(?![0-9.,])"
)
"""A number with a mark that stands in it twice, or before another one."""

_LONG = len("100.000")
_FEWEST = 3  # grouped numbers; one or two happen to have three decimals

_FEWEST_PROOFS = 2

_OF_WHOLE_NUMBERS = frozenset({"counts", "pulses"})


def thousands_mark(text: str) -> str:
    """Mark of thousands that numbers prove, empty where none does.

    It stands twice in one number or before the other mark, and never behind it. Two numbers are
    needed, as one may be damaged.

    Examples
    --------
    >>> thousands_mark("1.304,998 5 -1.294,756"), thousands_mark("1,304,998 1,2,3 -4,294,756")
    ('.', ',')
    >>> thousands_mark("1.304 -1,294.756 4.7"), thousands_mark("1.304,5 1,304.5 1.304,5")
    ('', '')
    """
    found = _PROVED.findall(text)
    return found[0] if len(found) >= _FEWEST_PROOFS and len({*found}) == 1 else ""


def without_mark(number: str, mark: str) -> str:
    """Take off a mark of thousands where it groups the digits of a number by three.

    Examples
    --------
    >>> without_mark("-1.304,998", "."), without_mark("4.7", ".")
    ('-1304,998', '4.7')
    """
    rest = re.escape(",.".replace(mark, ""))
    form = rf"[-+\u2212\u2013]?[0-9]{{1,3}}(?:{re.escape(mark)}[0-9]{{3}})+(?:{rest}[0-9]*)?"
    return number.replace(mark, "") if re.fullmatch(form, number) else number


def first_in_groups(cells: Iterable[str]) -> int | None:
    """Find a number with a thousands mark among numbers of which some have no mark at all.

    A program that writes three decimals writes them everywhere, and one that leaves zeros out does
    not end with three of them each time. Missing ones do not count. None where the marks are those
    of decimals.

    Examples
    --------
    >>> first_in_groups(["601", "135.474", "96.029", "-94.903"])
    1
    >>> first_in_groups(["1", "1.35", "0.954", "-1.352"])
    """
    grouped = _grouped(cells)
    mixed = len(set(grouped.values())) == 2 and sum(grouped.values()) >= _FEWEST
    return next(place for place, is_grouped in grouped.items() if is_grouped) if mixed else None


def without_blanks(number: str) -> str:
    """Take off blanks and apostrophes that group the digits of a number by three.

    Examples
    --------
    >>> without_blanks("-1 350'204.25"), without_blanks("20 1")
    ('-1350204.25', '20 1')
    """
    return re.sub(r"[\s'\u2019]", "", number) if _BLANKS.fullmatch(number) else number


def notes_of_thousands(
    columns: Sequence[Sequence[str] | Array],
    unit: str | None,
    others: Iterable[Sequence[str] | Array] = (),
) -> tuple[str, ...]:
    """Say where all outputs have three decimals, and their mark may be one of thousands.

    That is where they are in a unit of whole numbers; or where one is 100 or more, and there is no
    unit, or the mark is a comma and nothing in the other columns shows that decimals have one. What
    the engine has read already does not count.
    """
    written = [column for column in columns if not isinstance(column, np.ndarray)]
    cells = [*chain.from_iterable(written)]
    if unit and unit not in _OF_WHOLE_NUMBERS and not any("," in cell for cell in cells[:1]):
        return ()
    grouped = _grouped(cells)
    if not grouped or not all(grouped.values()):
        return ()
    if unit in _OF_WHOLE_NUMBERS:
        why = f"though {unit} are whole numbers"
    elif max(len(cell.strip("+-\u2212\u2013")) for cell in cells) < _LONG:
        return ()
    elif not unit:
        why = "and no unit is told"
    elif "," in cells[min(grouped)] and not any("," in str(c) for c in chain.from_iterable(others)):
        why = "and no other column has a decimal comma"
    else:
        return ()
    return (
        f"all outputs have three decimals, {why}: if the mark in {cells[min(grouped)]} is one of"
        " thousands, all are a thousand times too small; write them without",
    )


def _grouped(cells: Iterable[str]) -> dict[int, bool]:
    """Which numbers are grouped, by place; empty where a mark must be that of decimals."""
    found = {}
    for place, cell in enumerate(cells):
        match = _GROUPED.fullmatch(with_hyphen(cell))
        if match is None and not is_missing(cell):
            return {}
        if match is not None:
            found[place] = match[1] is not None
    return found
