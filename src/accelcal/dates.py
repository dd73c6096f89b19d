"""Dates as tables, header lines and certificates write them."""

from __future__ import annotations

import re
from datetime import datetime

_AND_CLOCK = (
    r"(?:,? +(?P<hour>\d{1,2})(?P<rest>:\d\d(?::\d\d)?)(?:(?<=:\d\d:\d\d)[.,:](?P<part>\d+))?)?"
)
_DAY_FIRST = re.compile(rf"(?P<day>\d{{1,2}})\.(?P<month>\d{{1,2}})\.(?P<year>\d{{4}}){_AND_CLOCK}")
_NAMED = re.compile(
    rf"(?P<day>\d{{1,2}})(?:\. ?| |-)(?P<name>[^\W\d]+)\.?[ -](?P<year>\d{{4}}){_AND_CLOCK}"
)
_NAME_FIRST = re.compile(
    rf"(?P<name>[^\W\d]+)\.? (?P<day>\d{{1,2}}),? (?P<year>\d{{4}}){_AND_CLOCK}"
)
_YEAR_FIRST = re.compile(
    rf"(?P<year>\d{{4}})[/年](?P<month>\d{{1,2}})[/月](?P<day>\d{{1,2}})日?{_AND_CLOCK}"
)

_MONTHS = (
    ("jan", "january", "januar"),
    ("feb", "february", "februar"),
    ("mar", "march", "m\xe4r", "mrz", "m\xe4rz"),
    ("apr", "april"),
    ("may", "mai"),
    ("jun", "june", "juni"),
    ("jul", "july", "juli"),
    ("aug", "august"),
    ("sep", "sept", "september"),
    ("oct", "october", "okt", "oktober"),
    ("nov", "november"),
    ("dec", "december", "dez", "dezember"),
)
"""Names of the months, in English and German."""

_NUMBER_OF_MONTH = {name: str(n) for n, names in enumerate(_MONTHS, 1) for name in names}


def date_of(text: str) -> datetime | None:
    """Understand a date, with a clock time or without, and with its zone where the text tells it.

    Such as ``2024-05-31``, ``2024-05-31T14:30:00+02:00``, ``31.05.2024 14:30``, ``2024/05/31
    14:30``, ``31-May-2024``, ``31. Mai 2024``, ``May 31, 2024`` or ``2024年5月31日``. None where it
    is no date, or where the day and the month might be taken for each other, as in ``11/10/2026``.

    Examples
    --------
    >>> str(date_of("31.5.2024 9:30")), date_of("31.2.2024"), str(date_of("31 May 2024"))
    ('2024-05-31 09:30:00', None, '2024-05-31 00:00:00')
    """
    text = text.replace(" UTC", "Z").replace(" GMT", "Z")
    usual = _DAY_FIRST if "." in text[:3] else _YEAR_FIRST
    forms = (usual, _NAMED, _NAME_FIRST)
    written = next(filter(None, (form.fullmatch(text) for form in forms)), None)
    if written:
        part = written.groupdict("")
        month = part.get("month") or _NUMBER_OF_MONTH.get(part["name"].casefold(), "")
        clock = f"{part['hour']:0>2}{part['rest'] or ':00'}{'.' * bool(part['part'])}{part['part']}"
        text = f"{part['year']}-{month:0>2}-{part['day']:0>2}T{clock}"
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        return None
