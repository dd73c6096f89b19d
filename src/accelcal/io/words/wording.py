"""Pieces of the sentences of messages and notes: lines of a file and their number."""

from __future__ import annotations

from collections.abc import Iterable, Sized

from accelcal.arguments.axes import AXES, axis_named
from accelcal.plural import counted, named


def lines_named(lines: Iterable[int]) -> str:
    """Name lines for a note, at most five of them.

    Examples
    --------
    >>> lines_named([7]), lines_named(range(1, 9))
    ('line 7', 'lines 1, 2, 3, 4, 5, ...')
    """
    numbers = [str(line) for line in dict.fromkeys(lines)]
    more = ["..."] if len(numbers) > 5 else []
    return named("line", numbers[:5] + more)


def were(lines: Sized, what: str) -> str:
    """Count what stands in some lines, before saying what was done to it.

    Examples
    --------
    >>> were([7], "row"), were([7, 8], "row")
    ('1 row was', '2 rows were')
    """
    return f"{counted(len(lines), what)} {'was' if len(lines) == 1 else 'were'}"


def all_outputs(count: int) -> str:
    """Say that all outputs are something.

    Examples
    --------
    >>> all_outputs(1), all_outputs(3)
    ('the only output is', 'all 3 outputs are')
    """
    return "the only output is" if count == 1 else f"all {count} outputs are"


def hint_of_triad(names: Iterable[str]) -> str:
    """Name the command for three accelerometers, where columns are called as theirs.

    Examples
    --------
    >>> hint_of_triad(["ax_g", "ay_g", "az_g"]), hint_of_triad(["T", "J", "Y"])
    ('; three accelerometers in one block go to accelcal triad', '')
    """
    is_triad = {axis_named(name.strip(' "')).axis for name in names} >= {*AXES}
    return "; three accelerometers in one block go to accelcal triad" * is_triad
