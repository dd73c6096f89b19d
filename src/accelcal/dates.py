"""Dates as tables, header lines and certificates write them."""

from __future__ import annotations

import re
from datetime import datetime

__all__ = ["date_of"]

_AND_CLOCK = r"(?: +(?P<hour>\d{1,2})(?P<rest>:\d\d(?::\d\d(?:\.\d+)?)?))?"
_DAY_FIRST = re.compile(rf"(?P<day>\d{{1,2}})\.(?P<month>\d{{1,2}})\.(?P<year>\d{{4}}){_AND_CLOCK}")
_YEAR_FIRST = re.compile(rf"(?P<year>\d{{4}})/(?P<month>\d{{1,2}})/(?P<day>\d{{1,2}}){_AND_CLOCK}")


def date_of(text: str) -> datetime | None:
    """Understand a date, with a clock time or without.

    Parameters
    ----------
    text : str
        Such as ``2024-05-31``, ``2024-05-31T14:30:00+02:00``, ``31.05.2024 14:30`` or
        ``2024/05/31 14:30``.

    Returns
    -------
    datetime or None
        The date, with its zone where the text tells it; None where it is no date, or where the day
        and the month might be taken for each other, as in ``11/10/2026``.

    Examples
    --------
    >>> str(date_of("31.5.2024 9:30")), date_of("31.2.2024")
    ('2024-05-31 09:30:00', None)
    """
    written = (_YEAR_FIRST if "/" in text else _DAY_FIRST).fullmatch(text)
    if written:
        part = written.groupdict("")
        clock = f"{part['hour']:0>2}{part['rest'] or ':00'}"
        text = f"{part['year']}-{part['month']:0>2}-{part['day']:0>2}T{clock}"
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        return None
