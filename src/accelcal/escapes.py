r"""What an encoding lacks, written as an escape: ``\xff`` for a byte of a file name, ``\u03a9``."""

from __future__ import annotations

import codecs

__all__ = ["ESCAPED"]

ESCAPED = "accelcal.escaped"
r"""Name of the error handler, for `str.encode`.

A file name that is not UTF-8 holds each foreign byte as a lone surrogate (PEP 383), which no file
can: it is written as the byte that it is.

>>> "M\udcfcller Ω".encode("ascii", ESCAPED)
b'M\\xfcller \\u03a9'
"""


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
