"""One unit chosen by its serial number, among records or among the results of a file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Protocol, TypeVar

from accelcal.errors import InputError
from accelcal.io.declarations import notes_of_serial
from accelcal.plural import listed
from accelcal.record import TumbleRecord
from accelcal.serials import bare_serial


class _OfUnit(Protocol):
    @property
    def serial(self) -> str | None: ...


Item = TypeVar("Item", bound=_OfUnit)
Other = TypeVar("Other", bound=_OfUnit)


def one_of_serial(results: Sequence[Item], serial: str | None, name: str, what: str) -> Item:
    """Choose one result of a file.

    One that has no serial number fits any; without the serial number there must be one. `what` is
    such as ``"calibration"``, for messages. Raises InputError if there is none, or several.
    """
    chosen = all_of_serial(results, serial)
    if len(chosen) == 1:
        return chosen[0]
    have = ", ".join(str(found.serial) for found in chosen or results)
    if not chosen:
        problem = f"{name}: serial {serial} is asked for, but it holds the {what} of {have}"
        raise InputError(f"{problem}; give the {what} of this accelerometer")
    if len({found.serial for found in chosen}) == 1:
        problem = f"{name}: it holds {len(chosen)} results of serial {chosen[0].serial}"
        raise InputError(f"{problem}; save one item of the list as a file of its own")
    raise InputError(f"{name}: it holds serials {have}; choose one by its serial")


def all_of_serial(items: Iterable[Item], serial: str | None) -> list[Item]:
    """Keep what is of one serial number, or has none; all where no serial number is asked for."""
    return [item for item in items if serial is None or item.serial in (serial, None)]


def records_of_serial(records: Sequence[Item], serial: str | None) -> list[Item]:
    """Keep the records of one serial number, as of `all_of_serial`.

    Raises InputError if there is none.
    """
    kept = all_of_serial(records, serial)
    if not kept:
        have = ", ".join(dict.fromkeys(str(record.serial) for record in records))
        raise InputError(f"no serial {serial!r} in the tables; there is {have}")
    return kept


def records_called(records: Sequence[TumbleRecord], serial: str | None) -> list[TumbleRecord]:
    """Choose the records of a serial number, or give it to all where their tables tell one or none.

    Raises InputError if the tables tell several, but not this one.
    """
    told = {record.serial for record in records} - {None}
    if serial is None or len(told) > 1:
        return records_of_serial(records, serial)
    notes = [(*own.notes, *notes_of_serial(serial, own.serial)) for own in records]
    pairs = zip(records, notes, strict=True)
    return [replace(own, serial=serial, notes=told) for own, told in pairs]


def pairs_of_units(
    known: Sequence[Item], later: Sequence[Other], serial: str | None
) -> tuple[list[tuple[Item, Other]], list[str]]:
    """Pair the results of two files that are of one unit.

    The pairs are in the order of the second file; with them come the serial numbers without a
    partner. Serial numbers that differ by their spelling alone are one; a result that has none fits
    any. Raises InputError if there is no pair, or a result is in several.
    """
    one, other = _bare_of_serial(known, serial), _bare_of_serial(later, serial)
    pairs = [
        (own, item)
        for item, name in other
        for own, its_name in one
        if not (name and its_name) or name == its_name
    ]
    first, second = (listed(_names(own)) or "no serial" for own in (known, later))
    have = f"the first file holds {first}, the second {second}"
    if not pairs and serial is not None:
        raise InputError(f"no serial {serial!r} in both files: {have}; give one that both hold")
    if not pairs:
        raise InputError(f"no unit in both files: {have}; give two files of one accelerometer")
    times = Counter(id(result) for pair in pairs for result in pair)
    if max(times.values()) > 1:
        remedy = "choose one by serial=..., or save one of one serial as a file of its own"
        raise InputError(f"several results may be of one unit: {have}; {remedy}")
    return pairs, _names(own for own, _ in (*one, *other) if id(own) not in times)


def _bare_of_serial(results: Iterable[Item], serial: str | None) -> list[tuple[Item, str | None]]:
    """Results of one serial number, however it is spelled, each with what is left of its own."""
    named = [(own, bare_serial(own.serial) if own.serial else None) for own in results]
    asked = None if serial is None else bare_serial(serial)
    return [(own, name) for own, name in named if asked is None or name in (asked, None)]


def _names(results: Iterable[_OfUnit]) -> list[str]:
    return [own.serial for own in results if own.serial]
