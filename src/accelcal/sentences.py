"""Sentences that some of many records need: the condition over all of them and the text together.

A sentence is written only where it is due, and once for all records that have the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Labels, Mask

Told = Labels[tuple[str, ...]]
"""Sentences of each of R records, those that records have in common once."""


class Sentence(NamedTuple):
    """A sentence, and which of R records need it; a bool counts for all.

    It has no full stop, and is a function of its numbers where it has some, shape (R,) each.
    """

    where: Mask | bool
    text: str | Callable[..., str]
    numbers: Sequence[NDArray[Any]] = ()

    def of(self, records: int) -> Told:
        """Write the sentence for each record that needs it."""
        due = np.broadcast_to(self.where, records)
        if isinstance(self.text, str):
            if due.all():
                return Labels.everywhere((self.text,), records)
            return Labels(due.astype(np.intp), [(), (self.text,)])
        numbers = list(zip(*(own[due].tolist() for own in self.numbers), strict=True))
        places = {own: place for place, own in enumerate(dict.fromkeys(numbers), start=1)}
        code = np.zeros(records, dtype=np.intp)
        code[due] = [places[own] for own in numbers]
        return Labels(code, [(), *((self.text(*own),) for own in places)])


def first_of(sentences: Iterable[Sentence]) -> Iterator[Sentence]:
    """Leave each record the first of the sentences that it needs.

    Examples
    --------
    >>> large, small = Sentence(np.array([True, False]), "large"), Sentence(True, "small")
    >>> of_each(first_of([large, small]), 2).cells()
    [('large',), ('small',)]
    """
    before = np.zeros((), dtype=np.bool_)
    for one in sentences:
        yield one._replace(where=one.where & ~before)
        before = before | one.where


def of_each(sentences: Iterable[Sentence], records: int) -> Told:
    """Give each record the sentences that it needs.

    Examples
    --------
    >>> size = np.array([1.0, 30.0])
    >>> large = Sentence(size > 9.0, lambda number: f"{number:g} is large", [size])
    >>> said = large, Sentence(True, "mind it")
    >>> of_each(said, 2).cells()
    [('mind it',), ('30 is large', 'mind it')]
    """
    due = (sentence.of(records) for sentence in sentences if np.any(sentence.where))
    return reduce(both, due, Labels.everywhere((), records))


def both(told: Told, other: Told) -> Told:
    """Put other sentences of each record behind those that it has.

    Examples
    --------
    >>> large = Labels(np.array([1, 0]), [(), ("30 is large",)])
    >>> both(large, Labels.everywhere(("mind it",), 2)).cells()
    [('30 is large', 'mind it'), ('mind it',)]
    """
    number = len(other.values)
    if number == 1:
        return Labels(told.code, [own + other.values[0] for own in told.values])
    met, code = np.unique(told.code * number + other.code, return_inverse=True)
    pairs = (divmod(one, number) for one in met.tolist())
    return Labels(code, [told.values[own] + other.values[behind] for own, behind in pairs])
