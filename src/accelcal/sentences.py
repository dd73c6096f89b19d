"""Sentences that some of many records need: the condition over all of them and the text together.

A sentence is written only where it is due, and once for all records that have the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.arrays import Mask


class Sentence(NamedTuple):
    """A sentence, and which of R records need it.

    Attributes
    ----------
    where : ndarray of bool, shape (R,), or bool
        Whether a record needs it; a bool counts for all.
    text : str or callable
        The sentence, without a full stop; a function of its numbers where it has some.
    numbers : sequence of ndarray, shape (R,)
        The numbers of each record.
    """

    where: Mask | bool
    text: str | Callable[..., str]
    numbers: Sequence[NDArray[Any]] = ()

    def of(self, records: int) -> list[str]:
        """Write the sentence for each record, empty where it is not due."""
        due = np.broadcast_to(self.where, records)
        if isinstance(self.text, str):
            return [self.text if is_due else "" for is_due in due.tolist()]
        said = np.full(records, "", dtype=object)
        said[due] = list(map(cache(self.text), *(own[due].tolist() for own in self.numbers)))
        found: list[str] = said.tolist()
        return found


def first_of(sentences: Iterable[Sentence]) -> Iterator[Sentence]:
    """Leave each record the first of the sentences that it needs.

    Parameters
    ----------
    sentences : iterable of Sentence
        Sentences of which one is enough.

    Yields
    ------
    Sentence
        Each where no other one comes before it.

    Examples
    --------
    >>> large, small = Sentence(np.array([True, False]), "large"), Sentence(True, "small")
    >>> of_each(first_of([large, small]), 2)
    [('large',), ('small',)]
    """
    before = np.zeros((), dtype=np.bool_)
    for one in sentences:
        yield one._replace(where=one.where & ~before)
        before = before | one.where


def of_each(sentences: Iterable[Sentence], records: int) -> list[tuple[str, ...]]:
    """Give each record the sentences that it needs.

    Parameters
    ----------
    sentences : iterable of Sentence
        The sentences.
    records : int
        Number R of records.

    Returns
    -------
    list of tuple of str
        The sentences of each record, in their order.

    Examples
    --------
    >>> size = np.array([1.0, 30.0])
    >>> large = Sentence(size > 9.0, lambda number: f"{number:g} is large", [size])
    >>> said = large, Sentence(True, "mind it")
    >>> of_each(said, 2)
    [('mind it',), ('30 is large', 'mind it')]
    """
    columns = [sentence.of(records) for sentence in sentences if np.any(sentence.where)]
    if not columns:
        return [()] * records
    return list(map(cache(lambda *row: tuple(filter(None, row))), *columns))
