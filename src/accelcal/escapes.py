r"""Text that any terminal and any file can take: ``\xff`` for a byte of a file name."""

from __future__ import annotations

import codecs

ESCAPED = "accelcal.escaped"
r"""Name of the error handler, for `str.encode`.

A file name that is not UTF-8 holds each foreign byte as a lone surrogate (PEP 383), which no file
can: it is written as the byte that it is.

>>> "M\udcfcller Ω".encode("ascii", ESCAPED)
b'M\\xfcller \\u03a9'
"""


def encodable(text: str) -> str:
    r"""Replace each foreign byte of a file name by its escape, so that any text can be UTF-8.

    Examples
    --------
    >>> encodable("M\udcfcller Ω")
    'M\\xfcller Ω'
    """
    return text.encode("utf-8", ESCAPED).decode()


def visible(text: str) -> str:
    r"""Replace what is not printable by its escape, so that no name can move the cursor.

    Letters of any script stay as they were typed. Where an encoding lacks one, who writes the text
    escapes it.

    Examples
    --------
    >>> visible("AL-15\x1b[2J µ")
    'AL-15\\x1b[2J µ'
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in encodable(text))


def _escaped(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(_escape, error.object[error.start : error.end])), error.end


def _escape(letter: str) -> str:
    byte = ord(letter) - 0xDC00
    if 0x80 <= byte <= 0xFF:
        return f"\\x{byte:02x}"
    return letter.encode("ascii", "backslashreplace").decode()


codecs.register_error(ESCAPED, _escaped)


def ended(text: str) -> str:
    r"""Add a line feed at the end of a text where there is none.

    Examples
    --------
    >>> ended("1,2"), ended("1,2\n")
    ('1,2\n', '1,2\n')
    """
    return text if text.endswith("\n") else text + "\n"
