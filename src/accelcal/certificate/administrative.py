"""The administrative part of a certificate: who, what, when, for whom."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from accelcal.certificate.xml import dcc, named, rich
from accelcal.dates import date_of
from accelcal.effects.left_in_use import left_in_use
from accelcal.errors import InputError
from accelcal.io.toml.laboratory import NOT_STATED, Contact, Laboratory
from accelcal.report.calibration_rows import alarms, without_uncertainty
from accelcal.results.calibration import Calibration
from accelcal.version import __version__

_NO_COUNTRY = "ZZ"
"""Of a place that is not stated; ISO 3166-1 leaves it to users."""

_ISSUER = "calibrationLaboratory"
_MODEL = "pendulous accelerometer"


def administrative_data(calibration: Calibration, known: Laboratory) -> Element:
    """Make the administrative part.

    It says ``not stated`` where nothing is.

    Raises
    ------
    InputError
        If no day of the test is known, which a certificate must state.
    """
    return dcc(
        "administrativeData",
        dcc("dccSoftware", software(calibration)),
        _core_data(calibration, known),
        dcc("items", _item(calibration, known)),
        dcc(_ISSUER, _contact("contact", known.laboratory, located=True)),
        dcc("respPersons", *map(_person, known.persons or (Contact(),))),
        _contact("customer", known.customer, located=True),
        dcc(
            "statements", *map(_statement, _statements(calibration, known)), *_verdict(calibration)
        ),
    )


def software(calibration: Calibration) -> Element:
    """Name what made the calibration."""
    release = calibration.software.removeprefix("accelcal ").strip() or __version__
    return dcc("software", named("accelcal"), dcc("release", f"v{release}"))


def _core_data(calibration: Calibration, known: Laboratory) -> Element:
    first, last = _days(calibration, known)
    return dcc(
        "coreData",
        dcc("countryCodeISO3166_1", known.country or known.laboratory.country or _NO_COUNTRY),
        dcc("usedLangCodeISO639_1", "en"),
        dcc("mandatoryLangCodeISO639_1", "en"),
        dcc("uniqueIdentifier", known.identifier or _identifier(calibration)),
        dcc("beginPerformanceDate", first),
        dcc("endPerformanceDate", last),
        dcc("performanceLocation", known.performance_location),
    )


def _days(calibration: Calibration, known: Laboratory) -> tuple[str, str]:
    found = date_of(calibration.date or "")
    tested = found.date().isoformat() if found else ""
    first = known.performed_from or tested
    last = known.performed_to or first
    if not first or last < first:
        raise InputError(
            f"a certificate states the days of the test, and here they are"
            f" {f'{first} to {last}' if first else NOT_STATED}; write # date: 2026-11-21 into the"
            " table, or performed_from and performed_to into the file of the laboratory"
        )
    if tested and not first <= tested <= last:
        raise InputError(
            f"the table is of {tested}, which is not within the days of the file of the laboratory,"
            f" {first} to {last}; mend performed_from and performed_to, or the date of the table"
        )
    return first, last


def _identifier(calibration: Calibration) -> str:
    """A number that the same result always has."""
    from hashlib import sha256

    return f"accelcal-{sha256(calibration.to_json().encode()).hexdigest()[:32]}"


def _item(calibration: Calibration, known: Laboratory) -> Element:
    serial = (calibration.serial or "").strip()
    issuer = "manufacturer" if serial else "other"
    value = dcc("value", serial or NOT_STATED)
    identification = dcc("identification", dcc("issuer", issuer), value)
    return dcc(
        "item",
        named(_MODEL),
        _contact("manufacturer", known.manufacturer),
        _stated("model", known.model),
        dcc("identifications", identification),
    )


def _person(person: Contact) -> Element:
    return dcc(
        "respPerson",
        _contact("person", person),
        _stated("role", person.role),
        dcc("mainSigner", "true") if person.role == "main signer" else None,
    )


def _contact(tag: str, contact: Contact, *, located: bool = False) -> Element:
    """A contact; that of a laboratory or customer has a place in any case."""
    parts = (
        _stated("city", contact.city),
        _stated("countryCode", contact.country),
        _stated("postCode", contact.post_code),
        _stated("street", contact.street),
    )
    place = [part for part in parts if part is not None]
    if located and not place:
        place = [rich("further", NOT_STATED)]
    return dcc(
        tag,
        named(contact.name),
        _stated("eMail", contact.email),
        _stated("phone", contact.phone),
        dcc("location", *place) if place else None,
    )


def _stated(tag: str, text: str) -> Element | None:
    return dcc(tag, text) if text else None


def _statement(text: str, *more: Element) -> Element:
    return dcc("statement", rich("declaration", text), *more)


def _verdict(calibration: Calibration) -> list[Element]:
    """The verdict in words, and for programs where the limits are decided."""
    verdict = calibration.verdict
    if verdict is None:
        return []
    text = f"Verdict against {verdict.specification}: {verdict.outcome}. {verdict.rule_statement}"
    decided = verdict.outcome in ("pass", "fail")
    return [_statement(text, *([dcc("conformity", verdict.outcome)] if decided else []))]


def _gravity(local: float | None) -> list[str]:
    if local is None:
        return []
    return [
        f"Values with a power of m/s^2 in their unit are converted by the local gravity {local!r}"
        " m/s^2. Its uncertainty is not in theirs: its relative standard uncertainty, times that"
        " power, adds in squares to their relative one."
    ]


def _statements(calibration: Calibration, known: Laboratory) -> list[str]:
    return [
        *known.statements,
        "Coefficients are those of equation (1) of the tumble test, by powers of the acceleration.",
        "The expanded uncertainty is the half width of the interval that is meant to hold the true"
        " value with a probability of 95 %.",
        *_gravity(calibration.g_local_m_s2),
        *left_in_use(calibration),
        *_of_the_test(calibration),
    ]


def _of_the_test(calibration: Calibration) -> list[str]:
    """What the report of the calibration tells beside its numbers."""
    laws = calibration.temperature_model
    return [
        *without_uncertainty(calibration),
        *(
            f"A check of the test warns. {alarm[0].upper()}{alarm[1:]}"
            for alarm in alarms(calibration)
        ),
        *calibration.warnings,
        *(
            f"Run {t.run}, mounting {t.mounting}: {said}"
            for t in calibration.tables
            for said in t.warnings
        ),
        *(laws.warnings if laws else ()),
    ]
