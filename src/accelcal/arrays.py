"""Arrays by what they hold, what stands for arrays of texts, and arrays that stay as they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Generic, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Places = NDArray[np.intp]
Ints = NDArray[np.int64]
"""Places index other arrays; Ints count and name."""

Numbers = Sequence[float] | NDArray[Any]
"""Some numbers as a user gives them; an array is no Sequence to a type checker."""

T = TypeVar("T")


@dataclass(frozen=True, eq=False, slots=True)
class Labels(Generic[T]):
    """Cells that are no numbers, most of which come again.

    Examples
    --------
    >>> labels = Labels(np.array([0, 0, 1]), ["o+", None])
    >>> len(labels), labels[1], labels.cells()
    (3, 'o+', ['o+', 'o+', None])
    """

    code: Places  # place of each cell among the values
    values: list[T]  # what the cells hold

    @classmethod
    def of(cls, cells: Sequence[T]) -> Self:
        """Find the values of cells."""
        values = list(dict.fromkeys(cells))
        if len(values) == len(cells):
            return cls(np.arange(len(cells)), values)
        places = {value: place for place, value in enumerate(values)}
        return cls(np.fromiter(map(places.__getitem__, cells), np.intp, len(cells)), values)

    @classmethod
    def everywhere(cls, value: T, number: int) -> Self:
        """The same in all cells."""
        return cls(np.zeros(number, dtype=np.intp), [value])

    @classmethod
    def joined(cls, parts: Sequence[Labels[T]]) -> Self:
        """Cells of several parts behind each other."""
        starts = np.cumsum([0, *(len(part.values) for part in parts)])
        codes = [part.code + start for part, start in zip(parts, starts.tolist(), strict=False)]
        return cls(np.concatenate(codes), [value for part in parts for value in part.values])

    def __len__(self) -> int:
        return len(self.code)

    def __getitem__(self, place: int) -> T:
        return self.values[int(self.code[place])]

    def taken(self, places: Places | slice) -> Labels[T]:
        """Those of some cells."""
        return Labels(self.code[places], self.values)

    def cells(self) -> list[T]:
        """List the cells."""
        return [self.values[i] for i in self.code.tolist()]


def kept(array: NDArray[Any]) -> NDArray[Any]:
    """Keep an array as it is, whatever becomes of the one that was given.

    Returns
    -------
    ndarray
        A copy that cannot be written to, or the array itself where it is one.

    Examples
    --------
    >>> given = np.zeros(2)
    >>> own = kept(given)
    >>> given[0] = 1.0
    >>> own.tolist(), kept(own) is own
    ([0.0, 0.0], True)
    """
    if array.flags.owndata and not array.flags.writeable:
        return array
    own = array.copy()
    own.setflags(write=False)
    return own
