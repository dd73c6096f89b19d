"""The column that alone can hold the outputs, where no heading says which does."""

from __future__ import annotations

import re
from collections.abc import Sequence

from accelcal.io.layout.directions import way_of
from accelcal.io.words.headings import Heading, name_and_unit, split_unit
from accelcal.io.words.vocabulary import COLUMNS, OUTPUTS, has_unit, plain_name
from accelcal.units import is_output_unit

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
    unknown = [i for i in unknown if not is_supply(headings[i].text) and not _is_std(headings[i])]
    units = {i: unit for i in unknown if (unit := _unit_of(headings[i]))}
    channels = [i for i in unknown if is_channel(headings[i].text) and not _is_warmth(headings[i])]
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


def _is_warmth(heading: Heading) -> bool:
    return has_unit("temperature", split_unit(heading.text)[1])


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
