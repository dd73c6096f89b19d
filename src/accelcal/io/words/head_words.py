"""The words of the certificate of a head: what its column headings and header keys mean."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

from accelcal.io.words.headings import Heading, name_and_unit
from accelcal.io.words.vocabulary import (
    COLUMNS,
    LONGEST,
    canonical_key,
    is_unit_of,
    names_of,
    plain_name,
)

_NAMES = names_of(
    {
        "angle": """nominal nominal_angle angle_nominal nennwinkel sollwinkel
            номинальный_угол""",
        "error": """error deviation fehler abweichung winkelabweichung teilungsfehler
            teilungsabweichung erreur écart погрешность ошибка отклонение""",
        "correction": "correction korrektur korrektion поправка",
        "uncertainty": """uncertainty measurement_uncertainty std unsicherheit messunsicherheit
            incertitude неопределённость""",
        "standard": """standard_uncertainty standardunsicherheit incertitude_type
            стандартная_неопределённость""",
        "expanded": """expanded_uncertainty u95 erweiterte_unsicherheit
            erweiterte_messunsicherheit incertitude_élargie расширенная_неопределённость""",
        "coverage": """coverage coverage_factor coverage_factor_k erweiterungsfaktor
            erweiterungsfaktor_k facteur_d'élargissement коэффициент_охвата""",
    }
)

STANDARD = _NAMES["standard"]
"""Headings and keys of an uncertainty that is no expanded one, whatever factor is declared."""

EXPANDED = _NAMES["expanded"]
"""Headings of an uncertainty, beside a capital U, that is expanded by a factor."""

HEAD_COLUMNS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "angle": (*COLUMNS["angle"], *COLUMNS["position"], *_NAMES["angle"]),
        "error": _NAMES["error"],
        "correction": _NAMES["correction"],
        "uncertainty": (*_NAMES["uncertainty"], "u", *STANDARD),
    }
)
"""What a column holds -> the headings it may have, in any case, with ``е`` for ``ё`` as well."""

HEAD_KEYS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        **{key: _NAMES[key] for key in ("uncertainty", "standard", "expanded")},
        "coverage": (*_NAMES["coverage"], "stroke"),  # ``k`` is read as a stroke
        "head": ("head",),
        "stand": ("stand",),
    }
)
"""What a header line declares -> the keys it may have, in any case."""

_NUMBER = r"[0-9]+(?:[.,][0-9]+)?"
_COVER = re.compile(
    rf"[,;]?\s*(?:\b[kк]\s*=\s*({_NUMBER})|\b({_NUMBER})[ -]?(?:σ|[Ss]igma)\b"
    rf"|(?:[pP]\s*[=≈]\s*)?{_NUMBER}\s*%|[pP]\s*=\s*0[.,]9[0-9]*)"
)
"""A coverage factor or probability beside an uncertainty, as in ``U (k = 2, 95 %)``, ``U (2σ)``."""

_CAPITAL = re.compile(r"(?:^|[\s_])U$")
"""The sign of an expanded uncertainty, alone or behind its name, as in ``Unsicherheit U``."""

_LEFT_BEHIND = ((re.compile(r"\s*[\[(]\s*[\])]"), ""), (re.compile(r"([\[(])\s*[,;]\s*"), r"\1"))
"""What is left of brackets where these were, and what becomes of it."""


_ROLES = {plain_name(name): role for role, names in HEAD_COLUMNS.items() for name in names}
_UNCERTAINTIES = (*HEAD_COLUMNS["uncertainty"], *EXPANDED)
_ROLES |= {plain_name(name) + sign: "uncertainty" for name in _UNCERTAINTIES for sign in ("", "_u")}
_KEYS = {plain_name(name): key for key, names in HEAD_KEYS.items() for name in names}
_KEYS |= {plain_name(name) + "_u": "expanded" for name in EXPANDED}
_KEYS |= {key: key for key in HEAD_KEYS}


class Cover(NamedTuple):
    """What stands beside an uncertainty of how it is expanded."""

    rest: str  # the text without it
    factors: tuple[float, ...] = ()  # coverage factors
    probability: bool = False  # whether there is a coverage probability


def without_cover(text: str) -> Cover:
    """Take coverage factors and probabilities off a heading or value of an uncertainty.

    Examples
    --------
    >>> without_cover("U (k = 2) [arcsec]"), without_cover('U (95 %), "')  # doctest: +ELLIPSIS
    (Cover(rest='U [arcsec]', factors=(2.0,), ...), Cover(rest='U, "', ..., probability=True))
    >>> without_cover("1,0 arcsec (k=1,96; P=95 %)")
    Cover(rest='1,0 arcsec', factors=(1.96,), probability=True)
    >>> without_cover("U (2σ)").factors
    (2.0,)
    """
    if len(text) > LONGEST:
        return Cover(text.strip())
    found = [match[1] or match[2] for match in _COVER.finditer(text)]
    rest = _COVER.sub("", text)
    for pattern, new in _LEFT_BEHIND:
        rest = pattern.sub(new, rest)
    factors = tuple(float(number.replace(",", ".")) for number in found if number)
    return Cover(rest.strip(), factors, probability=None in found)


def head_heading(text: str) -> Heading:
    """Understand a column heading of a certificate.

    Its role is one of `HEAD_COLUMNS`, or None.

    Examples
    --------
    >>> head_heading("Abweichung [Winkelsekunden]")[1:3], head_heading("error_arcsec")[1:3]
    (('error', 'Winkelsekunden'), ('error', 'arcsec'))
    >>> head_heading("Погрешность, угл. с")[1:3], head_heading("room").role
    (('error', 'угл. с'), None)
    """
    name, unit = _name_and_unit(text)
    return Heading(text, _ROLES.get(plain_name(name)), unit or None)


def _name_and_unit(heading: str) -> tuple[str, str]:
    """Take unit and coverage factor off a heading."""
    bare = without_cover(heading).rest
    is_name = plain_name(bare) in _ROLES
    return (bare, "") if is_name else name_and_unit(bare, partial(is_unit_of, "angle"))


def head_key(key: str) -> str | None:
    """Name of what a header line of a certificate declares.

    It is one of `HEAD_KEYS`, else of `accelcal.io.words.vocabulary.KEYS`, None for an unknown key.
    A bare factor or probability is that of an expanded uncertainty.

    Examples
    --------
    >>> head_key("k"), head_key("Erweiterungsfaktor"), head_key("S/N")
    ('coverage', 'coverage', 'serial')
    >>> head_key("2σ"), head_key("95 %")
    ('expanded', 'expanded')
    """
    cover = without_cover(key)
    bare = (cover.factors or cover.probability) and not cover.rest
    known = canonical_key(key)
    return "expanded" if bare else _KEYS.get(plain_name(known or key), known)


def kind_of_uncertainty(heading: str) -> str:
    """Tell what a heading says of its uncertainty.

    Of `HEAD_KEYS` it is ``"expanded"`` for a capital U, alone or behind its name, and the words in
    `EXPANDED`, ``"standard"`` for those in `STANDARD`, else ``"uncertainty"``.

    Examples
    --------
    >>> [kind_of_uncertainty(f"{name} [arcsec]") for name in ("U", "u", "expanded uncertainty")]
    ['expanded', 'uncertainty', 'expanded']
    >>> kind_of_uncertainty("Standardunsicherheit [arcsec]")
    'standard'
    >>> [kind_of_uncertainty(f"Unsicherheit {sign} [arcsec]") for sign in ("U", "u")]
    ['expanded', 'uncertainty']
    """
    name = _name_and_unit(heading)[0]
    plain = plain_name(name)
    if plain.startswith(tuple(map(plain_name, STANDARD))):
        return "standard"
    if _CAPITAL.search(name) or plain.startswith(tuple(map(plain_name, EXPANDED))):
        return "expanded"
    return "uncertainty"
