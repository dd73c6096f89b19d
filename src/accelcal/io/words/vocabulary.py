"""The words of a table: what its column headings and header keys mean."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from types import MappingProxyType
from typing import NamedTuple

from accelcal.io.words.directions import BACK, FORWARD
from accelcal.io.words.signs import with_hyphen
from accelcal.units import AS_WRITTEN, UNITS, degrees_in, is_output_unit, spellings

COLUMNS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "temperature": (
            *("temperature", "temp", "temperatur", "température", "temperatura"),
            *("температура", "т", "温度"),
        ),
        "position": (
            *("position", "pos", "j", "stellung", "posición", "posição", "posizione"),
            *("положение", "положения", "позиция", "位置"),
        ),
        "angle": (
            *("angle", "theta", "th", "θ", "head_angle", "winkel", "ángulo", "ângulo", "angolo"),
            *("угол", "角度"),
        ),
        "stroke": (
            *("stroke", "k", "hub", "durchlauf", "durchgang", "passage"),
            *("pasada", "passagem", "passata", "passaggio", "corsa"),
            *("ход", "хода", "проход", "прохода", "行程"),
        ),
        "direction": (
            *("direction", "dir", "richtung", "sens", "sentido", "direzione", "направление"),
            "方向",
        ),
        "output": (
            *("output", "y", "value", "reading", "signal", "ausgang", "messwert", "wert"),
            *("salida", "lectura", "saída", "leitura", "uscita", "lettura", "valor", "valore"),
            *("sortie", "valeur", "выход", "выходной_сигнал", "показание", "значение"),
            *("输出", "读数"),
        ),
        "run": ("run", "lauf"),
        "time": (
            *("time", "timestamp", "zeit", "uhrzeit", "temps", "heure", "время", "时间"),
            *("tiempo", "tempo", "hora", "ora"),
        ),
        "date": (
            *("date", "datum", "дата", "date_time", "datetime", "datum_uhrzeit", "zeitstempel"),
            *("horodatage", "fecha", "fecha_hora", "data_hora", "data_ora"),
            *("дата_время", "дата_и_время", "日期"),
        ),
        "serial": (
            *("serial", "sn", "s_n", "serial_number", "serial_no", "seriennummer"),
            *("serialnumber", "serial_nr", "ser_no", "seriennr", "serien_nr", "sernr", "ser_nr"),
            *("numéro_de_série", "n°_de_série", "nº_de_série"),
            *("número_de_serie", "número_de_série", "n°_serie", "nº_serie", "numero_di_serie"),
            *("заводской_номер", "зав_№", "编号", "序列号"),
        ),
        "mounting": ("mounting",),
        "clamping": ("clamping",),
        "std": (
            *("std", "sd", "sigma", "stdev", "stddev", "std_dev", "standard_deviation"),
            *("sdev", "standardabweichung", "stabw", "stdabw", "std_abw", "écart_type"),
            *("desviación_estándar", "desvio_padrão", "deviazione_standard", "ско", "标准差"),
        ),
        "count": ("count", "n", "samples"),
        "unit": (
            *("unit", "units", "einheit", "unité", "unidad", "unidade", "unità", "единица", "单位"),
        ),
        "lot": ("lot", "los", "charge", "партия"),
    }
)
"""What a column holds -> the headings it may have, in any case; a lone T and t are told by case."""

LABELS = frozenset({"run", "serial", "mounting", "direction", "lot"})
"""Columns whose cells are names, even where they look like numbers."""

KEYS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "serial": COLUMNS["serial"],
        "unit": (*COLUMNS["unit"], "output_unit"),
        "local_gravity": (
            *("g", "g_local", "local_gravity", "gravity", "fallbeschleunigung"),
            *("örtliche_fallbeschleunigung", "ortsschwere", "pesanteur", "pesanteur_locale"),
            *("ускорение_свободного_падения", "ускорение_силы_тяжести"),
        ),
        "reference_temperature": (
            *("t0", "t_0", "tref", "t_ref", "reference_temperature", "bezugstemperatur"),
            *("referenztemperatur", "température_de_référence", "опорная_температура"),
        ),
        "positions": ("positions", "stellungen"),
        "head_uncertainty": (
            *("head_uncertainty", "kopfunsicherheit", "unsicherheit_des_kopfes"),
            *("incertitude_de_la_tête", "неопределенность_головки"),
        ),
        "launch_uncertainty": ("launch_uncertainty",),
        "launch_sf_uncertainty": ("launch_sf_uncertainty",),
        "temperature_uncertainty": (
            *("temperature_uncertainty", "temperaturunsicherheit", "unsicherheit_der_temperatur"),
            *("incertitude_de_la_température", "неопределенность_температуры"),
        ),
        "resolution": ("resolution", "auflösung", "résolution", "разрешение"),
        "delta0": ("delta0",),
        "date": ("date", "datum", "дата"),
        "runs": ("runs",),
        "serials": ("serials", "seriennummern"),
        "temperature": COLUMNS["temperature"],
        "stroke": COLUMNS["stroke"],
        "run": COLUMNS["run"],
        "mounting": COLUMNS["mounting"],
        "clamping": COLUMNS["clamping"],
        "std": COLUMNS["std"],
        "count": COLUMNS["count"],
    }
)
"""What a header line declares -> the keys it may have, in any case."""

TIME_UNITS: Mapping[str, float] = MappingProxyType(
    {spelling.casefold(): UNITS["time"][name] for spelling, name in spellings("time").items()}
)
"""Unit of a time column -> seconds."""

_ANGLES = ("deg", *(own for own, name in spellings("angle").items() if name in ("deg", "rad")))

UNITS_OF: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "temperature": tuple(spellings("temperature")),
        "angle": _ANGLES,
        "clamping": _ANGLES,
        "time": tuple(TIME_UNITS),
    }
)
"""Units that a column may be given in, in any case, the first being the one to recommend."""

KINDS_OF: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "temperature": ("temperature",),
        "local_gravity": ("gravity",),
        "reference_temperature": ("temperature",),
        "temperature_uncertainty": ("temperature difference",),
        "head_uncertainty": ("angle", "acceleration"),
        "launch_uncertainty": ("acceleration",),
        "launch_sf_uncertainty": ("ratio",),
        "delta0": ("angle",),
    }
)
"""Key of a header line -> the kinds of unit, of `accelcal.units.UNITS`, that its number may have.

The number without a unit is in the first one of the first kind.
"""

LONGEST = 100
"""Characters of a heading or key that may have a meaning."""

_WRONG_ANGLES = (
    *(spelling for spelling, name in spellings("angle").items() if name not in ("deg", "rad")),
    *("gon", "gons", "grads", "gradian", "gradians", "mdeg", "turn", "turns", "rev", "mil"),
)
_WRONG_UNITS = {
    "temperature": ("K", "mK", "Kelvin", "F", "°F", "degF", "Fahrenheit"),
    "angle": _WRONG_ANGLES,
    "clamping": _WRONG_ANGLES,
}
_ROLES = {name: role for role, names in COLUMNS.items() for name in names}
_CANONICAL_KEYS = {name: key for key, names in KEYS.items() for name in names}
_BRACKET = re.compile(r"(.*?)\s*[\[(（]\s*([^\])）]*?)\s*[\])）]")
_BEFORE_UNIT = re.compile(r"\s*[/,]\s*|\s(?:in|en|в)\s+|((?:[_ ](?:in|en|в))?[_ ])")
"""What stands between a name and its unit; a blank alone in the group."""
_NUMBER_BEHIND = r"(?:(?:no|nr|№|n°)_)?([0-9]{1,6})"
_STROKES = (
    re.compile(rf"(?:y|output|reading|{'|'.join(COLUMNS['stroke'])})?[_=]?{_NUMBER_BEHIND}"),
    re.compile(r"y_?\{?j,?([0-9]{1,6})\}?(?:\^\{?t\}?)?"),  # Y_JK^T, as the paper has it
)
_POSITIONS = re.compile(rf"(?:p|lage|{'|'.join(COLUMNS['position'])})_?{_NUMBER_BEHIND}")
_SERIAL = re.compile(  # and a label with a digit, which a serial port does not have
    r"(?:(?:output|y)[ _])?(?:s/?n|serial(?:[ _](?:no|nr|number))?)(?:[ _.:#]+|(?=[0-9]))"
    r"([^\s,;]*[0-9][^\s,;]*)",
    re.IGNORECASE,
)
_MEASURED = re.compile(r"(T *= *)?([-\u2212\u2013]?[0-9]+(?:[.,][0-9]+)?) *(.*)")
_CORNERS = (("position", "stroke"), ("angle", "stroke"), ("stroke", "position"))
_COUNTED = re.compile(r"(?:no|nr|№|n°)_(?P<behind>.+)|(?P<before>.+)_(?:no|nr|№|n°|number|#)")


ACROSS: Mapping[str, str] = MappingProxyType(
    {
        "strokes": "stroke",
        "directions": "direction",
        "positions": "position",
        "angles": "angle",
        "temperatures": "temperature",
        "serials": "serial",
    }
)
"""Role of the columns of outputs of a wide table -> the column that their headings stand for."""

OUTPUTS = ("output", *ACROSS)
"""Roles of columns of outputs, be the table long or wide."""


class Heading(NamedTuple):
    """Meaning of a column heading.

    Attributes
    ----------
    text : str
        As written.
    role : str or None
        One of `COLUMNS`, one of `ACROSS` for an output of a wide table, None if unknown.
    unit : str or None
        Unit given in the heading, as written.
    of : float, str or None
        Stroke, direction, position, angle [deg], temperature [degC] or serial of an output of a
        wide table.
    """

    text: str
    role: str | None
    unit: str | None = None
    of: float | str | None = None


def read_heading(text: str) -> Heading:
    """Understand a column heading.

    Examples
    --------
    >>> read_heading("Output_mA")[1:3], read_heading("T")[1], read_heading("t [s]")[1]
    (('output', 'mA'), 'temperature', 'time')
    >>> read_heading("Y3")[3], read_heading("45 deg")[1:], read_heading("position (deg)").role
    (3, ('angles', None, 45.0), 'angle')
    >>> read_heading("S/N A-0123 [mA]")[1:]
    ('serials', 'mA', 'A-0123')
    """
    text = " ".join(text.split())
    if len(text) > LONGEST:
        return Heading(text, None)
    name, unit = split_unit(text)
    known = _known(text, name, unit or None)
    if name != text or known.role not in (None, "serials"):
        return known
    behind = (_known(text, *pair) for pair in _with_units_behind(text))
    return next((own for own in behind if own.role and is_unit_of(own.role, own.unit or "")), known)


def is_unit_of(role: str, unit: str) -> bool:
    """Tell whether a text is a unit, right or wrong, of what a column holds.

    Examples
    --------
    >>> is_unit_of("temperature", "K"), is_unit_of("stroke", "mA")
    (True, False)
    """
    if role in ("std", *OUTPUTS):
        return is_output_unit(unit) or is_output_unit(unit.casefold())
    return has_unit(role, unit) or unit.casefold() in _folded_units(_WRONG_UNITS.get(role, ()))


def has_unit(quantity: str, unit: str) -> bool:
    """Tell whether a column of a quantity, one of `UNITS_OF`, may be given in a unit.

    Examples
    --------
    >>> has_unit("temperature", "DEGC"), has_unit("temperature", "K")
    (True, False)
    """
    units = UNITS_OF.get(quantity, ())
    return unit in units or unit.casefold() in _folded_units(units)


@cache
def _folded_units(units: tuple[str, ...]) -> frozenset[str]:
    return frozenset(unit.casefold() for unit in units if unit not in AS_WRITTEN)


def canonical_key(text: str) -> str | None:
    """Name of what a header key declares, None for an unknown key.

    Examples
    --------
    >>> canonical_key("T0"), canonical_key("g"), canonical_key("operator")
    ('reference_temperature', 'local_gravity', None)
    """
    return "temperature" if text == "T" else _CANONICAL_KEYS.get(plain_name(text))


def split_unit(key: str) -> tuple[str, str]:
    """Split a header key such as ``T0 [degC]`` into its name and unit.

    The unit is empty where there is none.

    Examples
    --------
    >>> split_unit("T0 [degC]"), split_unit("date")
    (('T0', 'degC'), ('date', ''))
    """
    match = _BRACKET.fullmatch(key) if len(key) <= LONGEST else None
    return (match[1], match[2]) if match else (key, "")


def name_and_unit(
    text: str, is_unit: Callable[[str], bool], *, behind_blanks: bool = True
) -> tuple[str, str]:
    """Split a name from its unit, in brackets or behind a comma, a slash, ``in`` or a blank.

    `is_unit` is not asked of one in brackets. The unit is empty where there is none; it stands
    behind a blank or ``_`` alone only where `behind_blanks` says so.

    Examples
    --------
    >>> from accelcal.units import is_output_unit
    >>> [name_and_unit(f"Strom{unit}", is_output_unit) for unit in (" in mA", "_A", ", K", "[K]")]
    [('Strom', 'mA'), ('Strom', 'A'), ('Strom, K', ''), ('Strom', 'K')]
    """
    name, unit = split_unit(text.strip())
    behind = [] if unit else _with_units_behind(name, behind_blanks)
    return next((pair for pair in behind if is_unit(pair[1])), (name.strip(), unit))


def _with_units_behind(text: str, behind_blanks: bool = True) -> Iterator[tuple[str, str]]:
    """Ways to split a text into a name and what may be its unit, the longest unit first."""
    for mark in _BEFORE_UNIT.finditer(text[:LONGEST]):
        name, unit = text[: mark.start()], text[mark.end() :]
        if name and unit and (behind_blanks or mark[1] is None):
            yield name, unit


def _known(text: str, name: str, unit: str | None) -> Heading:
    folded = plain_name(name)
    if folded == "t":
        return Heading(text, _temperature_or_time(name, unit), unit)
    role = _role(folded)
    if role and not (role == "lot" and unit):  # an electric charge has a unit
        in_degrees = role == "position" and unit and has_unit("angle", unit)
        return Heading(text, "angle" if in_degrees else role, unit)
    if name.strip("-+") != name:  # of a direction, or a number that counts nothing
        return _measured(text, name, unit)
    for role, forms in (("strokes", _STROKES), ("positions", (_POSITIONS,))):
        if found := next(filter(None, (form.fullmatch(folded) for form in forms)), None):
            return Heading(text, role, unit, int(found[1]))
    found = _SERIAL.fullmatch(name)
    if found and found[1].rpartition("_")[2].casefold() not in _ROLES:  # as sn_1_std has it
        return Heading(text, "serials", unit, found[1])
    return _measured(text, name, unit)


def _measured(text: str, name: str, unit: str | None) -> Heading:
    """Meaning of a heading such as ``45 deg``, ``20 degC`` or ``T=20``."""
    found = _MEASURED.fullmatch(name.strip())
    own = found[3].strip() if found else ""
    is_temperature = has_unit("temperature", own) or bool(found and found[1] and not own)
    if not found or not (is_temperature or (has_unit("angle", own) and not found[1])):
        return Heading(text, None)
    number = float(with_hyphen(found[2].replace(",", "."))) * degrees_in(own)
    return Heading(text, "temperatures" if is_temperature else "angles", unit, number)


def _role(folded: str) -> str | None:
    """Role of a name, alone, beside its symbol as ``position_j``, or counted as ``stroke_no``.

    A number of readings counts them; it is not what was read.
    """
    counted = _COUNTED.fullmatch(folded)
    name = (counted["behind"] or counted["before"]) if counted else ""
    if _ROLES.get(name) in ("position", "stroke", "run"):
        folded = name
    if "\\" in folded:  # what rows and columns stand for, as the corner of a matrix tells it
        rows, _, columns = (_ROLES.get(part.strip("_")) for part in folded.partition("\\"))
        return rows if (rows, columns) in _CORNERS else None
    if folded in _ROLES:
        return _ROLES[folded]
    if _are_directions({*folded.split("_")}):
        return "direction"
    first, *others = folded.split("_")
    role = _ROLES.get(first)
    symbols = {"t"} if role in ("temperature", "time") else set()
    return role if all(_ROLES.get(word) == role or word in symbols for word in others) else None


def _are_directions(words: set[str]) -> bool:
    """Whether words are of both directions, as in Hin/Rück; R_1 is of something else."""
    return words <= FORWARD | BACK and all(
        any(map(str.isalpha, words & way)) for way in (FORWARD, BACK)
    )


def _temperature_or_time(name: str, unit: str | None) -> str:
    told = (role for role in ("time", "temperature") if unit and is_unit_of(role, unit))
    return next(told, "temperature" if name == "T" else "time")


def plain_name(name: str) -> str:
    """Name in small letters, its words joined by ``_``, with ``е`` for ``ё`` and a plain quote."""
    joined = re.sub(r"[\s\-./]+", "_", name.strip()).strip("_")
    return joined.casefold().replace("ё", "е").replace("’", "'")
