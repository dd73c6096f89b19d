"""Cells of plain text by numpy: a column at once, character by character from the end.

A number without an exponent is a whole number over a power of ten. Where the whole number has 53
bits or fewer, as has the power, their quotient is what ``float`` makes of the text; else it is
taken in twice the bits. The rest is left to ``float`` itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Array, Ints, Mask
from accelcal.numerics.error_free import two_product

_MINUS, _ZERO, _COMMA, _END = b"-0,\n"
_POINT = (ord(".") - _ZERO) % 256  # what a point is where a digit is expected

_LONGEST = 22
"""Characters of a number up to which its power of ten is one of 53 bits."""

_MOST_DIGITS = 18
"""Places of a whole number of 63 bits; in front of them there may be zeros."""

_LONGEST_LABEL = 64

_TENS = np.array([float(10**places) for places in range(_LONGEST)])


class TextCells(NamedTuple):
    """Cells of a text.

    Attributes
    ----------
    text : bytes
        The text.
    characters : ndarray of uint8
        Its characters.
    start, end : ndarray of int
        Place of the first character of each cell, and the one behind the last.
    """

    text: bytes
    characters: NDArray[np.uint8]
    start: Ints
    end: Ints

    def some(self, places: Ints | slice) -> TextCells:
        """Return some of the cells."""
        return self._replace(start=self.start[places], end=self.end[places])

    def as_bytes(self) -> list[bytes]:
        """Return the cells themselves."""
        bounds = zip(self.start.tolist(), self.end.tolist(), strict=True)
        return [self.text[start:end] for start, end in bounds]


def split_cells(text: bytes, width: int) -> list[TextCells]:
    r"""Divide rows by their commas.

    Parameters
    ----------
    text : bytes
        Rows of cells separated by commas, each ended by a line feed.
    width : int
        Number of cells of a row.

    Returns
    -------
    list of TextCells
        The columns.

    Raises
    ------
    ValueError
        If a row has another number of cells.

    Examples
    --------
    >>> [column.as_bytes() for column in split_cells(b"1,22\n3,4\n", 2)]
    [[b'1', b'3'], [b'22', b'4']]
    """
    characters = np.frombuffer(text, dtype=np.uint8)
    end = np.flatnonzero((characters == _COMMA) | (characters == _END))
    is_last = np.arange(width) == width - 1
    if end.size % width or ((characters[end] == _END).reshape(-1, width) != is_last).any():
        raise ValueError("a row has another number of cells")
    start = np.concatenate([[0], end[:-1] + 1])
    columns = zip(start.reshape(-1, width).T.copy(), end.reshape(-1, width).T.copy(), strict=True)
    return [TextCells(text, characters, *bounds) for bounds in columns]


def labels_of(cells: TextCells) -> tuple[Ints, list[str]]:
    r"""Number cells, in the order in which they are met first.

    Parameters
    ----------
    cells : TextCells
        Cells of ASCII, of which many are as the one before.

    Returns
    -------
    codes : ndarray of int
        Number of each cell.
    labels : list of str
        The cells by their numbers.

    Examples
    --------
    >>> codes, labels = labels_of(split_cells(b"b\nb\na\nb\n", 1)[0])
    >>> codes.tolist(), labels
    ([0, 0, 1, 0], ['b', 'a'])
    """
    first = np.concatenate([[0], np.flatnonzero(_differ_from_last(cells)) + 1])
    stretches = cells.some(first).as_bytes()
    number = {cell: place for place, cell in enumerate(dict.fromkeys(stretches))}
    codes = np.array([number[cell] for cell in stretches], dtype=np.int64)
    return np.repeat(codes, np.diff(first, append=cells.end.size)), [c.decode() for c in number]


def _differ_from_last(cells: TextCells) -> Mask:
    """Mask of the cells from the second on that are not as the one before."""
    size = cells.end - cells.start
    differ = np.asarray(size[1:] != size[:-1])
    if size.max() > _LONGEST_LABEL:
        return np.ones_like(differ)  # so each is read as text, which is quicker for long labels
    for place in range(1, int(size.max()) + 1):
        character = cells.characters[cells.end - place]
        differ |= (character[1:] != character[:-1]) & (size[1:] >= place)
    return differ


def numbers_of(cells: TextCells) -> Array:
    r"""Read numbers.

    Parameters
    ----------
    cells : TextCells
        Cells of digits, points, signs and letters.

    Returns
    -------
    ndarray of float
        Their numbers, those of ``float`` to the last bit.

    Raises
    ------
    ValueError
        If a cell is no number.

    Examples
    --------
    >>> numbers_of(split_cells(b"-1.25\n1e3\n", 1)[0]).tolist()
    [-1.25, 1000.0]
    """
    minus = cells.characters[cells.start] == _MINUS
    whole, places, good = _whole_numbers(cells, cells.end - cells.start - minus)
    numbers, sure = _quotients(whole, _TENS[places])
    numbers *= 1.0 - 2.0 * minus
    odd = np.flatnonzero(~(good & sure))
    if odd.size:
        numbers[odd] = [_number(cell) for cell in cells.some(odd).as_bytes()]
    return numbers


def _whole_numbers(cells: TextCells, size: Ints) -> tuple[Ints, Ints, Mask]:
    """Numbers without their points, their decimal places, and which cells are such numbers."""
    whole, fraction, places = np.zeros((3, size.size), dtype=np.int64)
    good = (size > 0) & (size <= _LONGEST)
    shortest, at = int(size.min()), cells.end - 1
    for place in range(min(int(size.max()), _LONGEST)):
        digit = cells.characters[at] - np.uint8(_ZERO)
        if place >= shortest:
            digit *= size > place  # a product, as assigning by a mask takes longer
        point = digit == _POINT
        if point.any():
            good &= ~point | ((places == 0) & (place > 0))
            places += point * np.int64(place)
            fraction += point * whole
            digit *= ~point
        good &= digit < (10 if place < _MOST_DIGITS else 1)
        if place < _MOST_DIGITS:
            whole += digit * np.int64(10**place)
        at -= 1
    whole = np.where(places > 0, (whole - fraction) // 10 + fraction, whole)  # without its point
    good &= places < _LONGEST
    return whole * good, places * good, good


def _quotients(whole: Ints, power: Array) -> tuple[Array, Mask]:
    """Whole numbers over powers of ten, rounded once; and which of them certainly are."""
    near = whole.astype(np.float64)
    value = near / power
    if whole.max() <= 2**53:
        return value, np.ones(value.size, dtype=np.bool_)
    rest = (whole - near.astype(np.int64)) - _excess(value, power, near)
    further = rest / power
    above, below = value + further * (1.0 + 1e-9), value + further * (1.0 - 1e-9)
    return above, above == below


def _excess(value: Array, power: Array, near: Array) -> Array:
    """Product of two numbers less another that is close to it, rounded once."""
    product, error = two_product(value, power)
    return (product - near) + error


def _number(cell: bytes) -> float:
    if b"_" in cell:
        raise ValueError("1_000 is a number of Python's, but of no table")
    return float(cell)
