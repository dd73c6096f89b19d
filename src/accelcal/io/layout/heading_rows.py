"""Which rows hold the headings of a table."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, pairwise, product, zip_longest

from accelcal.io.layout.output_headings import (
    are_cycles,
    is_channel,
    is_mean,
    lone_output,
    strokes_of,
    tells_direction,
    way_of,
)
from accelcal.io.words.headings import Heading, name_and_unit, read_heading
from accelcal.io.words.vocabulary import ACROSS, COLUMNS, OUTPUTS, canonical_key, is_unit_of
from accelcal.units import is_output_unit, spellings

_CORE = {"temperature", "position", "angle", "stroke", "output"}

ANGLE_IN_PARTS = ("angle", "minutes", "seconds")
"""Roles of the columns of an angle in degrees, minutes and seconds."""

_PLACES = frozenset({"position", "positions", "angle", "angles"})
"""Roles that tell where the head stood, so that minutes are those of a time."""

OF_READINGS = _PLACES | {"stroke"}
"""Roles of which a table of readings has one."""

_PART = {"deg": "angle", "arcmin": "minutes", "min": "minutes", "arcsec": "seconds", "s": "seconds"}
_SPELLED = {**spellings("time"), **spellings("angle")}
_PART_OF_ANGLE = {own.casefold(): _PART[unit] for own, unit in _SPELLED.items() if unit in _PART}


def are_headings(cells: Sequence[Heading]) -> bool:
    """Tell whether a row holds headings.

    Examples
    --------
    >>> are_headings([read_heading(cell) for cell in ("T", "k", "1", "2")])
    True
    >>> are_headings([read_heading(cell) for cell in ("temperature", "20", "serial", "A-7")])
    False
    """
    told = {cell.role for cell in cells if cell.role}
    roles = told - {"date"}
    numbered = [cell for cell in cells if cell.role in ACROSS]
    is_of_words = all(cell.text[0].isalpha() for cell in numbered)
    if len(numbered) > 2 and is_of_words and "direction" not in told:
        return True  # "Pos. 1, Pos. 2, Pos. 3" alone, all else declared above or missing
    if len(numbered) > 2 and roles == {"angle", "angles"}:
        return True  # "Angle, 0 deg, 90 deg, 180 deg", of a table on its side
    if _is_of_form(cells):
        return False
    roles -= {role for role, name in ACROSS.items() if name in roles and name != "stroke"}
    return len(roles) >= 2 and bool(roles & _CORE) and told != {"output", "unit"}  # of a form


def _is_of_form(cells: Sequence[Heading]) -> bool:
    """Tell whether names and numbers take turns, as keys and their values in a row of a form."""
    number = [cell.role in ACROSS and not cell.text[0].isalpha() for cell in cells]
    name = [cell.role is not None and cell.role not in ACROSS for cell in cells]
    named = {cell.role for cell, is_name in zip(cells, name, strict=True) if is_name}
    if sum(number) == len(named) == 1 and cells[0].text.isdecimal():
        return True  # the number of what is named behind it, as 101, Temp, Temp (Type T)
    return any(number) and not any(a and b for kind in (number, name) for a, b in pairwise(kind))


def over_time(cells: Sequence[Heading]) -> bool:
    """Tell whether a row may hold the headings of a record over time: a time, the lone output.

    Examples
    --------
    >>> over_time([read_heading(cell) for cell in ("Zeit", "Strom in mA")])
    True
    """
    timed = any(cell.role in ("time", "date") for cell in cells)
    return timed and lone_output(cells) is not None


def read_headings(texts: Sequence[str]) -> tuple[Heading, ...]:
    """Understand the headings of a row, of which some mean something beside others alone.

    A date with its time, such as Date/Time, tells nothing beside a date. Degrees and minutes,
    perhaps with seconds, are one angle where nothing else tells the place. An output forward is
    stroke 1, and the one back stroke 2, where nothing else tells strokes or outputs; with a number
    those of a cycle, and beside a column of cycles those of each. A channel of a data logger, such
    as 101 (VDC), is no stroke beside a column of these. Blocks that repeat side by side are read
    each for itself.

    Examples
    --------
    >>> [cell.role for cell in read_headings(["Date", "Time", "DateTime"])]
    ['date', 'time', None]
    >>> [cell.role for cell in read_headings(["Hub", "Grad", "Minuten"])]
    ['stroke', 'angle', 'minutes']
    >>> [cell[2:] for cell in read_headings(["J", "Hin [mA]", "Rück [mA]"])]
    [(None, None), ('mA', 1), ('mA', 2)]
    """
    lead, width = blocks_of_columns(texts)
    if width:  # those of one block are what those of the first are
        first = read_headings(texts[: lead + width])
        again = (first[lead:] * len(texts))[: len(texts) - lead - width]
        return (*first, *again)
    cells = _without_channels(tuple(map(read_heading, texts)))
    return _with_minutes(_with_directions(_dated_once(cells)))


def _without_channels(cells: tuple[Heading, ...]) -> tuple[Heading, ...]:
    roles = {cell.role for cell in cells}
    if "stroke" not in roles or roles.isdisjoint(("position", "angle")):
        return cells
    return tuple(
        Heading(c.text, None) if c.role == "strokes" and is_channel(c.text) else c for c in cells
    )


def _dated_once(cells: tuple[Heading, ...]) -> tuple[Heading, ...]:
    dates = {cell.text: canonical_key(cell.text) for cell in cells if cell.role == "date"}
    if "date" not in dates.values():
        return cells
    return tuple(c if dates.get(c.text, "date") else Heading(c.text, None) for c in cells)


def is_part_of_angle(heading: str) -> bool:
    """Tell whether a heading is a unit alone of which a part of an angle may be told."""
    return heading.casefold() in _PART_OF_ANGLE


def _with_minutes(cells: tuple[Heading, ...]) -> tuple[Heading, ...]:
    if any(cell.role in _PLACES for cell in cells):
        return cells
    parts = tuple(None if c.role else _PART_OF_ANGLE.get(c.text.casefold()) for c in cells)
    for at, size in product(range(len(parts)), (3, 2)):
        if parts[at : at + size] == ANGLE_IN_PARTS[:size]:
            told = map(Heading, [cell.text for cell in cells[at : at + size]], ANGLE_IN_PARTS)
            return (*cells[:at], *told, *cells[at + size :])
    return cells


def _with_directions(cells: tuple[Heading, ...]) -> tuple[Heading, ...]:
    ways = [None if cell.role else way_of(cell.text) for cell in cells]
    strokes = strokes_of([way for way in ways if way])
    if not strokes:
        return cells
    lone = lone_output(cells)  # a mean may be that of the outputs forward and back
    is_other = lone is not None and not (ways[lone[0]] or is_mean(cells[lone[0]]))
    if is_other or any(cell.role in ("stroke", *OUTPUTS) for cell in cells):
        return cells
    pairs = zip(cells, ways, strict=True)
    if {*strokes} == {(0, 1), (0, 2)} and any(are_cycles(cell.text) for cell in cells):
        words = ("", "forward", "back")
        told = ((c, w and Heading(c.text, "directions", w.unit, words[w.stroke])) for c, w in pairs)
    else:
        told = ((c, w and Heading(c.text, "strokes", w.unit, strokes[w[:2]])) for c, w in pairs)
    return tuple(own or cell for cell, own in told)


def joined(rows: Sequence[Sequence[str]]) -> tuple[Heading, ...] | None:
    """Join headings in several rows that tell together what outputs side by side stand for.

    The uppermost row is the first. A cell that is empty may be merged with that before it. None
    where the rows tell something else.

    Examples
    --------
    >>> rows = [row.split(",") for row in (",,cycle 1,,cycle 2", "T,J,forward,back,forward,back")]
    >>> [cell.of for cell in joined(rows)]
    [None, None, 1, 2, 3, 4]
    >>> [cell.text for cell in joined([["", "", "Pos. 1", "Pos. 2"], ["T", "k", "Y [mA]", "mA"]])]
    ['T', 'k', 'Pos. 1 [mA]', 'Pos. 2 [mA]']
    """
    texts: list[str] = []
    above: Sequence[str] = ()
    for column in zip_longest(*rows, fillvalue=""):
        if any(map(_tells_place, column)):
            above = [own or before for own, before in zip_longest(column, above, fillvalue="")]
            text = _of_output(above)
        else:
            text = _of_column(column)
        if text is None:
            return None
        texts.append(text)
    cells = read_headings(texts)
    left = any(cell.role is None and _tells_place(cell.text) for cell in cells)
    of_cycles = any(are_cycles(cell) for cell in chain.from_iterable(rows))
    directed = tells_direction(" ".join(cell.text for cell in cells))
    directed = directed or any(cell.role == "direction" for cell in cells)
    if left or (of_cycles and not directed):
        return None
    return cells if tell_places(cells) and are_headings(cells) else None


def tell_places(cells: Sequence[Heading]) -> bool:
    """Tell whether headings have several outputs, and tell of each what it is of.

    Examples
    --------
    >>> [tell_places([*map(read_heading, own.split(","))]) for own in ("T,J,1,2", "T,J,Y,Y")]
    [True, False]
    """
    outputs = [(cell.role, cell.of) for cell in cells if cell.role in OUTPUTS]
    kinds = {role for role, _ in outputs}
    return len(outputs) == len({*outputs}) > 1 == len(kinds) and "output" not in kinds


def _of_output(column: Sequence[str]) -> str | None:
    """Heading of an output by the cells of its rows; None where they have two units."""
    bare = map(_bare, column)
    pairs = [("", c) if is_output_unit(c) else name_and_unit(c, is_output_unit) for c in bare]
    words = [name for name, _ in pairs if name and read_heading(name).role != "output"]
    units = {unit for _, unit in pairs if unit}
    if len(units) > 1 or any(read_heading(word).role in COLUMNS for word in words):
        return None
    return " ".join([*words, *(f"[{unit}]" for unit in units)])


def _of_column(column: Sequence[str]) -> str | None:
    """Heading of another column, perhaps with its unit; None where its cells are of no heading."""
    named = [own for own in column if read_heading(own).role in COLUMNS]
    if not named:
        return next(filter(None, reversed(column)), "")
    heading = read_heading(named[-1])
    apart = [own for own in named if read_heading(own).role != heading.role and is_apart(own)]
    others = [_bare(own) for own in column if own not in named and not are_cycles(own)]
    units = [own for own in others if is_unit_of(heading.role or "", own)]
    words = "".join(own for own in others if own not in units)
    if apart or any(map(str.isalnum, words)):
        return None  # the rows tell serials, temperatures or something else, or are readings
    return f"{named[-1]} [{units[0]}]" if units and not heading.unit else named[-1]


def is_apart(name: str) -> bool:
    """Tell whether what a row of headings is called is no cycle, direction, stroke or output.

    Examples
    --------
    >>> is_apart("serial"), is_apart("direction"), is_apart("cycle")
    (True, False, False)
    """
    return read_heading(name).role in set(COLUMNS).difference(("direction", "stroke", "output"))


def _tells_place(cell: str) -> bool:
    """Tell whether a cell says which of several outputs is meant: by a number or a direction."""
    counted = any(map(str.isdecimal, cell)) and way_of(f"forward {cell}")
    return bool(read_heading(cell).role in ACROSS or way_of(cell) or counted)


def _bare(cell: str) -> str:
    """A cell without brackets around all of it."""
    bare = cell.strip("[] ()")
    return bare if is_output_unit(bare) or not cell.endswith(("]", ")")) else cell


def blocks_of_columns(texts: Sequence[str]) -> tuple[int, int]:
    """Number of columns before those that repeat side by side, and of these; 0 where none do.

    An empty one between them is included.

    Examples
    --------
    >>> blocks_of_columns(["J", "Y1", "", "J", "Y1"]), blocks_of_columns(["J", "Y1"])
    ((0, 3), (0, 0))
    >>> blocks_of_columns(["T", "J", "Y1", "Y2", "Y1", "Y2"])
    (2, 2)
    """
    if len({*texts}) == len(texts):  # as of nearly all tables
        return 0, 0
    for lead in range(len(texts) - 3):
        own = texts[lead:]
        for width in range(2, len(own) // 2 + 2):
            count = -(-len(own) // width)
            padded = [*own, *[""] * (count * width - len(own))]
            if count > 1 and padded == padded[:width] * count:
                return lead, width
    return 0, 0


def numbers_alone(cells: Sequence[Heading]) -> bool:
    """Tell whether headings number outputs and say nothing else, as a row above others may."""
    return all(cell.role in ACROSS or not cell.text for cell in cells)
