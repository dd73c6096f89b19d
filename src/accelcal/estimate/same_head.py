"""What tests tell of their head above the readings: whether it is one, and its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING

from accelcal.arguments.options import check_flag
from accelcal.dates import date_of
from accelcal.errors import InputError
from accelcal.record import TumbleRecord

if TYPE_CHECKING:
    from accelcal.results.head_calibration import HeadCalibration

HEAD, STAND = "head", "stand"
"""Lines that name what stood under the readings, the one that tells most first."""


def name_in(metadata: Mapping[str, str], key: str) -> str | None:
    """Name in a line above the readings, whose key is in whatever case; None where there is none.

    A date is no name: ``Stand: 12.03.2024`` is German for the state of that day.

    Examples
    --------
    >>> name_in({"Head": " A "}, "head"), name_in({"head": ""}, "head")
    ('A', None)
    >>> name_in({"Stand": "12.03.2024"}, "stand"), name_in({"Stand": "20240312"}, "stand")
    (None, '20240312')
    """
    told = (value.strip() for name, value in metadata.items() if name.strip().casefold() == key)
    name = next(told, "")
    return name if name.isdigit() or (name and date_of(name) is None) else None


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


def is_same_head(
    one: Mapping[str, str], other: Mapping[str, str], told: bool | None, *, one_file: bool
) -> bool | None:
    """Whether two tests are of one head: as told, or by the lines above the readings of both.

    Of one file it is one head, where these do not tell it.

    Raises
    ------
    InputError
        If `told` is neither True, False nor None.
    """
    if told is not None:
        check_flag(same_head=told)
        return told
    named = same_head(names_of(one), names_of(other))
    return True if named is None and one_file else named


def names_of(metadata: Mapping[str, str]) -> dict[str, str | None]:
    """Names of head and stand in the lines above the readings."""
    return {key: name_in(metadata, key) for key in (HEAD, STAND)}


def names_of_one_head(records: Sequence[TumbleRecord]) -> dict[str, str | None]:
    """Names of the head and its stand, as ``head_name`` and ``stand_name`` of a result.

    They are those that all records have which name one.

    Raises
    ------
    InputError
        If two name different heads, or else different stands.
    """
    named: dict[tuple[str | None, ...], tuple[dict[str, str | None], str]] = {}
    for record in records:
        names = names_of(record.metadata)
        named.setdefault(tuple(names.values()), (names, record.source))
    for (one, first), (other, second) in combinations(named.values(), 2):
        if same_head(one, other) is False:
            raise InputError(
                f"{second}: of another head than {first}, by the lines above the readings; give"
                " the tables of one head, or name it in all by '# head: NAME'"
            )
    return {f"{k}_name": _one_of([own[k] for own, _ in named.values()]) for k in (HEAD, STAND)}


def _one_of(names: Sequence[str | None]) -> str | None:
    told = {name.casefold(): name for name in names if name}
    return next(iter(told.values())) if len(told) == 1 else None


def declared_uncertainty(records: Sequence[TumbleRecord]) -> float:
    """Standard uncertainty that all records declare of a head position [rad].

    Raises
    ------
    InputError
        If there is no record, none is declared, or several are.
    """
    if not records:
        raise InputError("no record; give the tables of one unit in several clampings, or of units")
    found = {record.apparatus.head_uncertainty for record in records}
    if len(found) > 1 or not next(iter(found)):
        known = [f"{u:g} rad" for u in sorted(u for u in found if u is not None)]
        shown = ", elsewhere ".join([*known, *(["not declared"] if None in found else [])])
        raise InputError(
            f"{records[0].source}: head_uncertainty is {shown}; what no reading tells of the head"
            " stays as uncertain as declared: declare one above 0, by"
            " record.with_apparatus(head_uncertainty=...)"
        )
    return float(found.pop() or 0.0)


def refuse_head_of_others(head: HeadCalibration, records: Sequence[TumbleRecord]) -> None:
    """Refuse records of another head than the one that is known.

    Raises
    ------
    InputError
        If the lines above the readings of one name another head, or else another stand.
    """
    known = {HEAD: head.head_name, STAND: head.stand_name}
    for record in records:
        told = names_of(record.metadata)
        if same_head(known, told) is False:
            key = HEAD if known[HEAD] and told[HEAD] else STAND
            raise InputError(
                f"{record.source}: measured on {key} {told[key]}, but the errors from {head.source}"
                f" are those of {key} {known[key]}; give the calibration of the head of this test"
            )
