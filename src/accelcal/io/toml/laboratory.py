"""Who calibrates, for whom: the administrative part of a certificate, from a TOML file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from typing import Any

from accelcal.arguments.kinds import each_of, expect, several
from accelcal.dates import date_of
from accelcal.errors import InputError
from accelcal.io.files.text import read_text
from accelcal.io.toml.keys import check_keys, read_toml

__all__ = ["NOT_STATED", "PLACES", "Contact", "Laboratory", "read_laboratory"]

SCHEMA = "accelcal/laboratory/1"
NOT_STATED = "not stated"

PLACES = ("laboratory", "laboratoryBranch", "customer", "customerBranch", "other")
"""Where a test may have taken place."""

_CONTACTS = ("laboratory", "customer", "manufacturer")
_DAYS = ("performed_from", "performed_to")


def _day(place: str, value: Any) -> str:
    """A day as ISO 8601 has it, of what TOML or a text has; empty where it is not stated."""
    found = date_of(str(value).strip())
    if found is None and value != "":
        raise InputError(f"{place} is {value!r:.40}; it is a day such as 2026-11-21")
    return found.date().isoformat() if found else ""


def _check_line(place: str, value: Any, *, blank: bool) -> None:
    if not isinstance(value, str) or not value.isprintable() or not (blank or value.strip()):
        raise InputError(f"{place} is {value!r:.40}; it is a text of one line")


def _set_line(holder: Contact | Laboratory, name: str, *, blank: bool = True) -> None:
    """Keep a line without the blanks around it, which the schema of a certificate refuses."""
    value = getattr(holder, name)
    _check_line(name, value, blank=blank)
    object.__setattr__(holder, name, value.strip())


def _check_country(code: str) -> None:
    if code and not (len(code) == 2 and code.isascii() and code.isalpha() and code.isupper()):
        raise InputError(f"country is {code!r}; it is two capital letters, such as DE or CA")


@dataclass(frozen=True, slots=True)
class Contact:
    """A laboratory, customer, manufacturer or person.

    Attributes
    ----------
    name : str
        Its name.
    email, phone, street, post_code, city, country : str
        Where it is found; empty where not stated. The country by two letters, ISO 3166-1.
    role : str
        What a person is responsible for.

    Raises
    ------
    InputError
        If one is no text of one line, the name is blank, or the country no code.
    """

    name: str = NOT_STATED
    email: str = ""
    phone: str = ""
    street: str = ""
    post_code: str = ""
    city: str = ""
    country: str = ""
    role: str = ""

    def __post_init__(self) -> None:
        for name in Contact.__slots__:
            _set_line(self, name, blank=name != "name")
        _check_country(self.country)


@dataclass(frozen=True, slots=True)
class Laboratory:
    """The administrative part of a certificate.

    Attributes
    ----------
    identifier : str
        Unique number of the certificate; empty for one made of the result.
    country : str
        Where it was written, ISO 3166-1; empty where not stated.
    performed_from, performed_to : str
        First and last day of the test, as 2026-11-21; empty where not stated.
    performance_location : str
        One of `PLACES`; ``"other"`` where not stated.
    model : str
        Model of the accelerometer.
    laboratory, customer, manufacturer : Contact
        Who calibrated, for whom, and who made it.
    persons : tuple of Contact
        Who is responsible, the main signer first.
    statements : tuple of str
        What is stated beside the numbers.

    Raises
    ------
    InputError
        If a value breaks a rule.
    """

    identifier: str = ""
    country: str = ""
    performed_from: str = ""
    performed_to: str = ""
    performance_location: str = "other"
    model: str = ""
    laboratory: Contact = Contact()
    customer: Contact = Contact()
    manufacturer: Contact = Contact()
    persons: tuple[Contact, ...] = ()
    statements: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("identifier", "country", "model"):
            _set_line(self, name)
        _check_country(self.country)
        if self.performance_location not in PLACES:
            given = f"performance_location is {self.performance_location!r:.40}"
            raise InputError(f"{given}; it is one of {', '.join(PLACES)}")
        for name in _CONTACTS:
            expect(getattr(self, name), Contact)
        for name in _DAYS:
            object.__setattr__(self, name, _day(name, getattr(self, name)))
        object.__setattr__(self, "persons", each_of(self.persons, Contact))
        object.__setattr__(self, "statements", several(self.statements))
        for statement in self.statements:
            _check_line("a statement", statement, blank=False)


_KEYS = {
    **dict.fromkeys(("identifier", "country", "performance_location", "model"), str),
    **dict.fromkeys(_DAYS, (str, date)),
    **dict.fromkeys(_CONTACTS, dict),
    **dict.fromkeys(("persons", "statements"), list),
}
_CONTACT_KEYS = dict.fromkeys(Contact.__slots__, str)
_TYPE_NAMES = {
    (str, date): "a day such as 2026-11-21",
    dict: "a table such as [customer] or [[persons]]",
    list: "a list, of texts in statements and of tables [[persons]]",
}


def read_laboratory(source: str) -> Laboratory:
    """Read the administrative part of a certificate.

    Parameters
    ----------
    source : str
        Path of a TOML file.

    Returns
    -------
    Laboratory
        What it states.

    Raises
    ------
    TableError
        If the file cannot be read or is not TOML, or a key or a value breaks a rule.
    """
    return read_toml(read_text(source, "laboratory"), _laboratory, "[laboratory]", SCHEMA)


def _laboratory(document: Mapping[str, Any]) -> Laboratory:
    given = {key: value for key, value in document.items() if key != "schema"}
    check_keys(given, _KEYS, _TYPE_NAMES)
    given |= {key: _contact(key, given[key]) for key in _CONTACTS if key in given}
    persons = [_contact("persons", person) for person in given.get("persons", ())]
    return Laboratory(**(given | {"persons": persons}))


def _contact(place: str, entry: Any) -> Contact:
    check_keys({place: entry}, {place: dict}, _TYPE_NAMES)
    check_keys(entry, _CONTACT_KEYS, _TYPE_NAMES, where=f"{place}: ")
    try:
        return Contact(**entry)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
