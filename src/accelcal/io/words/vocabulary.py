"""The words and signs of a table: what its column headings, header keys and cells mean."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

from accelcal.units import AS_WRITTEN, UNITS, is_output_unit, spellings


def names_of(words: Mapping[str, str]) -> Mapping[str, tuple[str, ...]]:
    """Take the names of things apart, between which blanks stand."""
    return MappingProxyType({what: tuple(names.split()) for what, names in words.items()})


COLUMNS = names_of(
    {
        "temperature": """temperature temp temperatur température temperatura температура т 温度
            teplota temperatuur""",
        "position": """position pos j stellung lage posición posição posizione положение
            положения позиция 位置 ポジション pozycja położenie poloha pozice positie""",
        "angle": "angle theta th θ head_angle winkel ángulo ângulo angolo угол 角度 kąt úhel hoek",
        "stroke": """stroke k hub durchlauf durchgang passage course pasada passagem passata
            passaggio corsa ход хода проход прохода 行程 ストローク skok przebieg przejście
            zdvih průchod slag doorgang""",
        "direction": """direction dir richtung drehrichtung sens sentido direzione направление
            方向 往復 kierunek směr richting""",
        "output": """output y value reading signal ausgang messwert wert salida lectura saída
            leitura uscita lettura valor valore sortie valeur выход выходной_сигнал показание
            значение 输出 读数 wyjście odczyt wartość sygnał výstup hodnota čtení signál uitgang
            meetwaarde waarde aflezing 出力 測定値 読み値""",
        "run": "run lauf",
        "time": """time timestamp zeit uhrzeit temps heure время 时间 tiempo tempo hora ora czas
            godzina čas tijd tijdstip 時刻 時間""",
        "date": """date datum дата date_time datetime datum_uhrzeit zeitstempel horodatage fecha
            fecha_hora data_hora data_ora дата_время дата_и_время 日期 data_i_godzina
            datum_a_čas datum_tijd 日付 日時 測定日""",
        "serial": """serial sn s_n serial_number serial_no seriennummer serialnumber serial_nr
            ser_no seriennr serien_nr sernr ser_nr numéro_de_série n°_de_série nº_de_série
            número_de_serie número_de_série n°_serie nº_serie numero_di_serie заводской_номер
            зав_№ 编号 序列号 numer_seryjny nr_seryjny sériové_číslo výrobní_číslo serienummer
            serienr シリアル番号 製造番号""",
        "mounting": "mounting",
        "clamping": "clamping",
        "std": """std sd sigma stdev stddev std_dev standard_deviation sdev standardabweichung
            stabw stdabw std_abw écart_type desviación_estándar desvio_padrão
            deviazione_standard ско 标准差 odchylenie_standardowe směrodatná_odchylka
            standaardafwijking 標準偏差""",
        "count": "count n samples",
        "unit": """unit units einheit unité unidad unidade unità единица 单位 jednostka jednotka
            eenheid 単位""",
        "lot": "lot los charge партия",
    }
)
"""What a column holds -> the headings it may have, in any case; a lone T and t are told by case."""

_IN_CELLS = names_of(
    {
        "forward": """forward forwards fwd fw f + +1 1 vorwärts vor hin aller ida andata прямой
            прямо 正向 往 往路 naprzód tam vpřed vooruit heen""",
        "back": """back backward backwards bwd bw b return reverse rev r - -1 rückwärts rück zurück
            retour vuelta volta ritorno обратный обратно 反向 wstecz powrót vzad zpět achteruit
            terug 復 復路""",
        "missing": r"""- -- --- ? na n/a n.a. nan null none unknown missing k.a. — – \n
            #n/a #nv #n/d #н/д #n/d! #n/b nan(ind) -nan(ind) 1.#ind -1.#ind 1.#qnan
            -1.#qnan""",
        "cycle": "cycle zyklus ciclo цикл 循环 cykl cyklus cyclus",
    }
)
FORWARD, BACK = frozenset(_IN_CELLS["forward"]), frozenset(_IN_CELLS["back"])
"""What a direction may be called, in lower case."""

CYCLES = frozenset(_IN_CELLS["cycle"])
"""What a stroke forward and the one back together may be called, in lower case."""

MISSING = frozenset(["", *_IN_CELLS["missing"]])
"""Cells that stand for a missing value, in lower case."""

LABELS = frozenset({"run", "serial", "mounting", "direction", "lot"})
"""Columns whose cells are names, even where they look like numbers."""

_OWN_KEYS = names_of(
    {
        "local_gravity": """g g_local local_gravity gravity fallbeschleunigung
            örtliche_fallbeschleunigung ortsschwere pesanteur pesanteur_locale
            ускорение_свободного_падения ускорение_силы_тяжести przyspieszenie_ziemskie
            tíhové_zrychlení valversnelling""",
        "reference_temperature": """t0 t_0 tref t_ref reference_temperature bezugstemperatur
            referenztemperatur température_de_référence опорная_температура
            temperatura_odniesienia referenční_teplota referentietemperatuur""",
        "positions": "positions stellungen",
        "head_uncertainty": """head_uncertainty kopfunsicherheit unsicherheit_des_kopfes
            incertitude_de_la_tête неопределенность_головки""",
        "launch_uncertainty": "launch_uncertainty",
        "launch_sf_uncertainty": "launch_sf_uncertainty",
        "temperature_uncertainty": """temperature_uncertainty temperaturunsicherheit
            unsicherheit_der_temperatur incertitude_de_la_température
            неопределенность_температуры niepewność_temperatury nejistota_teploty
            temperatuuronzekerheid""",
        "resolution": "resolution auflösung résolution разрешение rozdzielczość rozlišení",
        "delta0": "delta0",
        "date": "date datum дата",
        "runs": "runs",
        "serials": "serials seriennummern",
    }
)
_OF_COLUMNS = ("serial", "temperature", "stroke", "run", "mounting", "clamping", "std", "count")
KEYS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "unit": (*COLUMNS["unit"], "output_unit"),
        **_OWN_KEYS,
        **{name: COLUMNS[name] for name in _OF_COLUMNS},
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
        "temperature": tuple(spellings("scale")),
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
    "temperature": ("mK", "°R", "Rankine"),
    "angle": _WRONG_ANGLES,
    "clamping": _WRONG_ANGLES,
}
_CANONICAL_KEYS = {name: key for key, names in KEYS.items() for name in names}

_ACROSS = ("stroke", "direction", "position", "angle", "temperature", "serial")
ACROSS: Mapping[str, str] = MappingProxyType({f"{name}s": name for name in _ACROSS})
"""Role of the columns of outputs of a wide table -> the column that their headings stand for."""

OUTPUTS = ("output", *ACROSS)
"""Roles of columns of outputs, be the table long or wide."""


def is_unit_of(role: str, unit: str) -> bool:
    """Tell whether a text is a unit, right or wrong, of what a column holds.

    Examples
    --------
    >>> is_unit_of("temperature", "mK"), is_unit_of("stroke", "mA")
    (True, False)
    """
    if role in ("std", *OUTPUTS):
        return is_output_unit(unit) or is_output_unit(unit.casefold())
    return has_unit(role, unit) or unit.casefold() in _folded_units(_WRONG_UNITS.get(role, ()))


def has_unit(quantity: str, unit: str) -> bool:
    """Tell whether a column of a quantity, one of `UNITS_OF`, may be given in a unit.

    Examples
    --------
    >>> has_unit("temperature", "DEGC"), has_unit("temperature", "mK")
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


def plain_name(name: str) -> str:
    """Name in small letters, its words joined by ``_``, with ``е`` for ``ё`` and a plain quote."""
    joined = re.sub(r"[\s\-./]+", "_", name.strip()).strip("_")
    return joined.casefold().replace("ё", "е").replace("’", "'")


# -- cells -----------------------------------------------------------------------------------------


def is_missing(cell: str) -> bool:
    """Tell whether a cell stands for a missing value."""
    return cell.casefold() in MISSING


def with_hyphen(text: str) -> str:
    """Write the minus sign as programs do, where a text has that of typesetting, or a dash.

    Examples
    --------
    >>> with_hyphen("\N{MINUS SIGN}40"), with_hyphen("\N{EN DASH}40")
    ('-40', '-40')
    """
    return text.replace("\N{MINUS SIGN}", "-").replace("\N{EN DASH}", "-")


def begins_number(cell: str) -> bool:
    """Tell whether a cell begins as a number does."""
    return cell.lstrip("+-\N{MINUS SIGN}\N{EN DASH}.,")[:1].isdecimal()


def mounting_written(name: str) -> str:
    """Tell which of `accelcal.geometry.MOUNTINGS` a name in a table means, if it is one.

    Examples
    --------
    >>> mounting_written("O"), mounting_written("P-")
    ('o+', 'p-')
    """
    name = with_hyphen(name.casefold())
    return name + "+" if name in ("o", "p") else name
