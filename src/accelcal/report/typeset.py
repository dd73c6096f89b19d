"""Units, symbols and numbers as they are printed, in place of those of a terminal."""

from __future__ import annotations

import re

_SUBSCRIPTS = str.maketrans("0123456789ipo", "₀₁₂₃₄₅₆₇₈₉ᵢₚₒ")
_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_GREEK = {"lam": "λ", "beta": "β", "gam": "γ", "delta": "δ"}

_PLAIN = (
    ("degC", "°C"),
    ("urad", "µrad"),
    ("+-", "±"),
    ("chi^2", "χ²"),
    ("->", "→"),
    ("<=", "≤"),
    (">=", "≥"),
    ("h_T", "hₜ"),
)
_SYMBOL = re.compile(r"\b(K|k|T|lam|beta|gam|delta)([0-4])([NLDF]?)\b")
_COUPLING = re.compile(r"\b(M|delta|K|a)_(ip|pp|io|oo|[ipo])\b")
_ANGLE = re.compile(r"\b((?:sin|cos)\s*\(?\s*\d*\s*)th\b")
_ALONE = re.compile(r"\b(lam|beta|gam|delta)(?=N?\b)")
_MICRO = re.compile(r"(?<![\w])u(?=[gAV]\b)")
_POWER = re.compile(r"(?<=[\w)])\^([0-9])")
_TIMES_TEN = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?)e([+-]?\d+)\b")
_NEGATIVE = re.compile(r"(?<![\w.)\]-])-(?=\d)")


def typeset(text: str) -> str:
    """Write units, symbols and signs of ASCII with Greek letters, indices and signs of Unicode.

    Examples
    --------
    >>> typeset("k2 = -52 +- 11 ug/g^2 at -40 degC; (K0+K2)/K1; 2e-05 rad; run 2026-11-21; 3 uA")
    'k₂ = −52 ± 11 µg/g² at −40 °C; (K₀+K₂)/K₁; 2·10⁻⁵ rad; run 2026-11-21; 3 µA'
    >>> typeset("lam, beta dT, deltaN"), typeset("beta1; a lamp")
    ('λ, β dT, δN', 'β₁; a lamp')
    """
    text = _TIMES_TEN.sub(_power_of_ten, text)
    for ascii_text, printed in _PLAIN:
        text = text.replace(ascii_text, printed)
    text = _SYMBOL.sub(_symbol, text)
    text = _COUPLING.sub(_symbol, text)
    text = _ANGLE.sub(r"\1θ", text).replace("d th =", "dθ =")
    text = _ALONE.sub(lambda match: _GREEK[match[1]], text)
    text = _MICRO.sub("µ", text)
    text = _POWER.sub(lambda match: match[1].translate(_SUPERSCRIPTS), text)
    return _NEGATIVE.sub("−", text)


def _symbol(match: re.Match[str]) -> str:
    letter, index, *behind = match.groups()
    return "".join([_GREEK.get(letter, letter), index.translate(_SUBSCRIPTS), *behind])


def _power_of_ten(match: re.Match[str]) -> str:
    return f"{match[1]}·10{str(int(match[2])).translate(_SUPERSCRIPTS)}"
