"""Whether two tests were made on one head, as the lines above their readings name it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

from accelcal.errors import InputError
from accelcal.record import TumbleRecord

HEAD, STAND = "head", "stand"
"""Lines that name what stood under the readings, the one that tells most first."""


def name_in(metadata: Mapping[str, str], key: str) -> str | None:
    """Name in a line above the readings, whose key is in whatever case; None where there is none.

    Examples
    --------
    >>> name_in({"Head": " A "}, "head"), name_in({"head": ""}, "head")
    ('A', None)
    """
    told = (value.strip() for name, value in metadata.items() if name.strip().casefold() == key)
    return next(told, None) or None


def same_head(one: Mapping[str, str | None], other: Mapping[str, str | None]) -> bool | None:
    """Whether two tests name one head, or else one stand; None where that is not told.

    Examples
    --------
    >>> same_head({"head": "A"}, {"head": "a"}), same_head({"stand": "1"}, {"stand": "2"})
    (True, False)
    >>> same_head({"head": "A", "stand": "1"}, {"head": None, "stand": "1"})
    True
    """
    for key in (HEAD, STAND):
        own, their = one.get(key), other.get(key)
        if own and their:
            return own.casefold() == their.casefold()
    return None


def names_of(metadata: Mapping[str, str]) -> dict[str, str | None]:
    """Names of head and stand in the lines above the readings."""
    return {key: name_in(metadata, key) for key in (HEAD, STAND)}


def refuse_other_heads(records: Sequence[TumbleRecord]) -> None:
    """Refuse records of several heads, as the lines above their readings name them.

    Raises
    ------
    InputError
        If two name different heads, or else different stands.
    """
    named = [(names_of(record.metadata), record.source) for record in records]
    for (one, first), (other, second) in combinations(named, 2):
        if same_head(one, other) is False:
            raise InputError(
                f"{second}: of another head than {first}, by the lines above the readings; give"
                " the tables of one head"
            )
