"""Encodings of one byte a letter, which text that is not UTF-8 has."""

from __future__ import annotations

import re

ONE_BYTE = ("latin-1", "windows-1251")
"""These; each takes nearly any bytes."""

_CYRILLIC = re.compile(rb"[\xc0-\xff\xa8\xb8]{4}")
"""Four letters of windows-1251; in Latin-1 they are four with accents, and no word has these."""


def one_byte_encoding(data: bytes) -> str:
    """Tell the encoding of a text by its letters.

    Parameters
    ----------
    data : bytes
        The text, or the start of it.

    Returns
    -------
    str
        One of `ONE_BYTE`: the second where there are words in Cyrillic letters.

    Examples
    --------
    >>> one_byte_encoding("Prüfgerät; Größe".encode("latin-1"))
    'latin-1'
    >>> one_byte_encoding("Температура, °С".encode("windows-1251"))
    'windows-1251'
    """
    return ONE_BYTE[_CYRILLIC.search(data) is not None]
