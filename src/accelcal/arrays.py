"""Arrays by what they hold, labels that come again, arrays that stay, and when two are equal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Generic, Self, TypeVar

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


class EqualByContents:
    """A dataclass that holds arrays; it is equal to another one whose contents are the same."""

    __slots__ = ()

    _NOT_COMPARED: ClassVar[frozenset[str]] = frozenset()
    """Fields that do not count."""

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        names = (item.name for item in fields(self))  # type: ignore[arg-type]
        counted = [name for name in names if name not in self._NOT_COMPARED]
        return all(equal(getattr(self, name), getattr(other, name)) for name in counted)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are born as the original was: checked, and with arrays that stay."""
        return type(self), tuple(getattr(self, item.name) for item in fields(self))  # type: ignore[arg-type]


def equal(one: Any, other: Any) -> bool:
    """Tell whether two things are the same, NaN in place of NaN.

    Examples
    --------
    >>> equal((np.array([1.0, np.nan]), "g"), (np.array([1.0, np.nan]), "g"))
    True
    >>> equal(np.ones(2), np.ones(3))
    False
    """
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(equal, one, other))
    if hasattr(one, "equals") and type(one) is type(other):
        return bool(one.equals(other))
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        numbers = one.dtype.kind == other.dtype.kind == "f"
        return bool(np.array_equal(one, other, equal_nan=numbers))
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return False
    return bool(one == other or (one != one and other != other))  # NaN is not itself
