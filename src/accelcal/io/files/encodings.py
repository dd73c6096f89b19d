"""Encodings of text that is not UTF-8: told by the words that it has in one of them alone."""

from __future__ import annotations

import re
from functools import cache

from accelcal.io.words.vocabulary import BACK, COLUMNS, FORWARD, KEYS
from accelcal.units import OUTPUT_UNITS, UNITS, spellings

ONE_BYTE = ("latin-1", "windows-1252", "windows-1250", "windows-1251", "koi8-r", "cp866")
"""Encodings of one byte a letter; each takes nearly any bytes."""

ENCODINGS = (*ONE_BYTE, "gb18030", "cp932")
"""What a text that is not UTF-8 may be in. GB18030 has the letters of GBK and GB2312, and CP932
those of Shift JIS."""

_START = 1 << 16
"""Bytes in which headings and header lines stand."""
_CYRILLIC = re.compile(rb"[\xc0-\xff\xa8\xb8]{4}")
"""Four letters of windows-1251; in Latin-1 they are four with accents, and no word has these."""
_OF_WINDOWS = re.compile(rb"[\x80-\x9f]")
"""What Latin-1 has no letters or signs for."""
_BETWEEN = re.compile(r"[\s_,，;|:=/\-.\[\]()（）\"'#]+")


def encoding_of(data: bytes) -> str:
    r"""Tell the encoding of a text that is not UTF-8.

    It is the one of `ENCODINGS` in which the text has the most known words of letters beyond ASCII.
    Where several have, it is windows-1251 if there are words in Cyrillic letters, else one of the
    first two.

    Examples
    --------
    >>> encoding_of("Prüfgerät; Größe".encode("latin-1"))
    'latin-1'
    >>> encoding_of("Оператор".encode("windows-1251"))
    'windows-1251'
    >>> [encoding_of("Температура, °С".encode(name)) for name in ("koi8-r", "windows-1251")]
    ['koi8-r', 'windows-1251']
    >>> encoding_of("温度,位置,输出\n".encode("gbk"))
    'gb18030'
    >>> encoding_of("温度,位置,出力\n".encode("shift_jis"))
    'cp932'
    """
    start = data[: data.rfind(b"\n", 0, _START) + 1] or data[:_START]  # letters may be of two bytes
    counts = [_known_words(start, encoding) for encoding in ENCODINGS]
    if counts.count(max(counts)) == 1:
        return ENCODINGS[counts.index(max(counts))]
    if _CYRILLIC.search(data):
        return "windows-1251"
    return "windows-1252" if _OF_WINDOWS.search(data) else "latin-1"


def errors_of(encoding: str) -> str:
    """What to do with bytes that are no letters: of two bytes one could be that of a separator."""
    return "replace" if encoding in ONE_BYTE else "strict"


def note_of_encoding(encoding: str) -> str:
    """Tell in which encoding a text was read."""
    return f"the text is not UTF-8 and was read as {encoding}"


def _known_words(start: bytes, encoding: str) -> int:
    """Known words of letters beyond ASCII that a text has in an encoding."""
    try:
        text = start.decode(encoding, errors_of(encoding))
    except UnicodeDecodeError:
        return 0
    return sum(word in _words() for word in _BETWEEN.split(text.casefold()))


@cache
def _words() -> frozenset[str]:
    """Words of headings, header lines and units, of two letters or more, one beyond ASCII."""
    names = [name for own in (*COLUMNS.values(), *KEYS.values()) for name in own]
    units = [way for kind in (*UNITS, "scale") for way in spellings(kind)]
    units += [way for own in OUTPUT_UNITS.values() for way in own]
    every = " ".join([*names, *units, *FORWARD, *BACK]).casefold()
    return frozenset(w for w in _BETWEEN.split(every) if len(w) > 1 and not w.isascii())
