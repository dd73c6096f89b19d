"""Headings of outputs: directions of strokes, and the column that alone can hold the outputs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from accelcal.io.words.headings import Heading, name_and_unit, read_heading, split_unit
from accelcal.io.words.vocabulary import (
    BACK,
    COLUMNS,
    CYCLES,
    FORWARD,
    OUTPUTS,
    has_unit,
    plain_name,
)
from accelcal.units import is_output_unit

_WORDS = re.compile(r"[^\W\d_]+|[0-9]{1,6}")
_COUNTERS = ("no", "nr")
"""Words before a number that say nothing else."""
_STROKES = {**dict.fromkeys(FORWARD, 1), **dict.fromkeys(BACK, 2)}
"""Word of a direction -> the stroke that it is, of two."""
_DIRECTIONS = frozenset(word for word in _STROKES if word.isalpha() and len(word) > 1)


def are_cycles(heading: str) -> bool:
    """Whether a heading says that its column counts cycles of two strokes."""
    return heading.casefold() in CYCLES


class Way(NamedTuple):
    """Direction of an output, 1 forward and 2 back, and the number beside it, 0 without."""

    number: int
    stroke: int
    unit: str | None
    counted: bool  # beside a word that tells what the number counts


def strokes_of(ways: Sequence[Way]) -> dict[tuple[int, int], int]:
    """Stroke of each number and direction: one of two, of its cycle, or that of the number.

    Numbers without a word count from 1; others may be temperatures or serials.
    """
    pairs = {way[:2] for way in ways}
    numbers = {number for number, _ in pairs}
    if len(pairs) < len(ways) or (0 in numbers and len(numbers) > 1):
        return {}
    if max(numbers, default=0) > len(numbers) and not all(way.counted for way in ways):
        return {}
    left = {(number, way) for number in numbers for way in (1, 2)} - pairs
    if not left or (len(numbers) > 1 and left == {(max(numbers), 2)}):
        return {(number, way): max(2 * number - 2, 0) + way for number, way in pairs}
    are_strokes = all(number and number % 2 == way % 2 for number, way in pairs)
    return {(number, way): number for number, way in pairs} if are_strokes else {}


def tells_direction(text: str) -> bool:
    """Tell whether a text has the word of a direction."""
    return not _DIRECTIONS.isdisjoint(_WORDS.findall(text.casefold()))


def way_of(text: str) -> Way | None:
    """Direction that a heading of outputs tells, if it tells one."""
    if not tells_direction(text):
        return None
    name, unit = name_and_unit(text, is_output_unit)
    words = [word for word in _WORDS.findall(name.casefold()) if word not in _COUNTERS]
    told = [_STROKES[word] for word in words if word in _DIRECTIONS]
    numbers = [int(word) for word in words if word.isdecimal()]
    if len(told) != 1 or len(numbers) > 1 or len(words) > len(told + numbers) + 1:
        return None
    beside = {word for word in words if word not in _DIRECTIONS and not word.isdecimal()}
    roles = {read_heading(word).role for word in beside.difference(CYCLES)}
    if not roles <= {"stroke", "output"}:
        return None
    counted = "stroke" in roles or not beside.isdisjoint(CYCLES)
    return Way(next(iter(numbers), 0), told[0], unit or None, counted)


_MEANS = frozenset(
    {"mean", "average", "avg", "ave", "mittelwert", "moyenne", "media", "média", "среднее", "平均"}
    | {"średnia", "průměr", "gemiddelde"}
)
"""What a mean is called, of samples or of all strokes."""

_MEASURED = _MEANS | {
    *("current", "voltage", "frequency", "strom", "spannung", "frequenz"),
    *("vout", "iout", "uout", "fout", "v_out", "i_out", "u_out", "f_out"),
    *("courant", "tension", "fréquence", "ток", "напряжение", "частота"),
    *("prąd", "napięcie", "proud", "napětí", "stroom", "spanning"),
    *("電流", "電圧", "周波数"),
    *("corriente", "tensión", "frecuencia", "corrente", "tensão", "tensione"),
}
"""What is measured, or how: of one such column without a unit the readings are."""

_CHANNEL = re.compile(
    r"(?:dmm|ch|chan|channel|kanal|canal|canale|voie|канал)[ _.]*[0-9]+|[0-9]+ *<.*>|[1-9][0-9]{2}",
    re.IGNORECASE,
)
"""A channel of a data logger, which is no serial number."""


_SUPPLIES = re.compile(
    r"suppl(?:y|ies)|excit|heater|batter|\b[uv](?:cc|dd|bat)\b|versorg|speise|speisung|heiz"
    r"|batterie|aliment|chauff|питани|нагрев|riscald|calent|zasil|grzał|grzej|napáj|ohřev"
    r"|voeding|verwarm",
    re.IGNORECASE,
)
"""What a column is called whose voltage or current is no output."""


def lone_output(headings: Sequence[Heading]) -> tuple[int, Heading] | None:
    """Find the column that can only be the outputs.

    That alone of the unknown ones has a unit of outputs behind its name, or else is called a
    current, a voltage, a frequency or a mean, or else is a unit, where none is a direction. There
    is none where a heading says which it is, or several may be, as one with a unit beside one that
    is called a current. A supply is none of them.

    Examples
    --------
    >>> from accelcal.io.words.headings import read_heading
    >>> lone_output([read_heading(text) for text in ("Zeit", "Strom in mA")])[1].unit
    'mA'
    """
    if any(heading.role in OUTPUTS for heading in headings):
        return None
    unknown = [i for i, own in enumerate(headings) if own.role is None]
    unknown = [i for i in unknown if not (is_supply(headings[i].text) or _is_std(headings[i]))]
    units = {i: unit for i in unknown if (unit := _unit_of(headings[i]))}
    warm = [i for i in unknown if has_unit("temperature", split_unit(headings[i].text)[1])]
    channels = [i for i in unknown if is_channel(headings[i].text) and i not in warm]
    by_name = [i for i in unknown if headings[i].text.strip().casefold() in _MEASURED]
    others = channels if by_name or len(channels) > 1 else []
    plain = [i for i in units if i not in others and not units[i].upper().endswith("DC")]
    by_unit = plain or [i for i in units if not by_name and i not in others]  # VDC of the supply
    behind_name = [i for i in by_unit if name_and_unit(headings[i].text, is_output_unit)[1]]
    means = [i for i in behind_name if is_mean(headings[i])]
    if len(means) == 1 and len({units[i] for i in behind_name}) == 1:
        behind_name = means  # of samples, beside the least and the most of them
    if behind_name and not units.keys() >= {*by_name}:
        return None
    found = behind_name or by_name or by_unit  # counts beside a mean may be those of its samples
    if len(found) != 1 or (found is by_unit and any(way_of(headings[i].text) for i in unknown)):
        return None
    return found[0], Heading(headings[found[0]].text, "output", units.get(found[0]))


def is_supply(text: str) -> bool:
    """Tell whether a heading is that of a supply, a heater or a battery.

    Examples
    --------
    >>> is_supply("Vcc [V]"), is_supply("I [mA]")
    (True, False)
    """
    return _SUPPLIES.search(text) is not None


def _is_std(heading: Heading) -> bool:
    """Whether a word of a name is one for a standard deviation, as in voltage_std_V."""
    return not {*COLUMNS["std"]}.isdisjoint(plain_name(heading.text).split("_"))


def is_channel(text: str) -> bool:
    """Tell whether a heading is that of a channel of a data logger; a number alone has its unit.

    Examples
    --------
    >>> [is_channel(text) for text in ("CH1", "101 <Iout> (VDC)", "101 (C)", "101")]
    [True, True, True, False]
    """
    name, unit = split_unit(text)
    return bool(_CHANNEL.fullmatch(name.strip())) and (bool(unit) or not name.isdecimal())


def is_mean(heading: Heading) -> bool:
    """Tell whether a heading calls its column a mean, perhaps with a unit of outputs."""
    return name_and_unit(heading.text, is_output_unit)[0].strip().casefold() in _MEANS


def _unit_of(heading: Heading) -> str | None:
    """Unit behind a name without a digit, which that of one accelerometer of several may have.

    Of a ratio, as in ``SF mA/g``, it is none; ``V/V`` alone is V in V. A unit may stand alone, but
    for a lone letter, as ``A``, which may be a name.
    """
    name, unit = name_and_unit(heading.text, is_output_unit)
    if not unit and len(name) > 1:
        unit = name
    of_channel = _CHANNEL.fullmatch(name.strip())
    unit = "A DC" if of_channel and unit == "ADC" else unit  # which may be counts elsewhere
    has_digit = any(map(str.isdecimal, name)) and not of_channel
    is_ratio = heading.text[len(name) :].lstrip().startswith("/") and _unit_of(Heading(name, None))
    return unit if is_output_unit(unit) and not (has_digit or is_ratio) else None
