"""What the C headers of an accelerometer and of a triad are written with."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any
from zlib import crc32

_OF_THEIR_OWN = ("coefficients", "covariance", "new_launch")


def c_prefix(serial: str | None) -> str:
    """Prefix of all names in the header of an instrument.

    Examples
    --------
    >>> c_prefix("AL-15"), c_prefix(None)
    ('accelcal_AL_15', 'accelcal')
    """
    name = re.sub(r"[^0-9A-Za-z]+", "_", serial or "").strip("_")
    return f"accelcal_{name}" if name else "accelcal"


def header_of(template: str, parts: Mapping[str, str], prefix: str) -> str:
    """Write a header of a prefix, marked ``@P@``, between the guards ``@BEGIN@`` and ``@END@``.

    Parts come in the place of their marks in their order: one may hold later marks. Serials that
    differ in signs alone have one prefix, and so have two calibrations of a unit; the guard holds a
    checksum, so that the second of two such headers is no silent nothing.
    """
    guards = {"@BEGIN@": _BEGIN, "@END@": _END, "@GUARD@": f"{prefix.upper()}_H"}
    for mark, part in {**guards, **parts, "@P@": prefix}.items():
        template = template.replace(mark, part)
    return template.replace("@STAMP@", f"{crc32(template.encode()):#010x}u")


_BEGIN = """\
#ifndef @GUARD@
#define @GUARD@ @STAMP@"""

_END = """\
#elif @GUARD@ != @STAMP@
#error "two calibrations have the names @P@_...: include one of them alone in a source file"
#endif
"""


def c_comment(content: Mapping[str, Any], notes: Iterable[str]) -> str:
    """Write everything that is known, in lines that cannot end the comment."""
    return "\n".join(f" * {line}".rstrip() for line in _comment(content, notes))


def _comment(content: Mapping[str, Any], notes: Iterable[str]) -> Iterator[str]:
    from textwrap import wrap

    for key, value in content.items():
        if key not in _OF_THEIR_OWN and value not in (None, []):
            text = value if isinstance(value, str) else json.dumps(value)
            yield from wrap(harmless(f"{key}: {text}"), 96, subsequent_indent="    ")
    yield ""
    yield "symbol, value, standard and expanded (95 %) uncertainty, unit, meaning (null: not known)"
    for row in content["coefficients"]:
        cells = ("null" if item is None else str(item) for item in row.values())
        yield harmless("  " + ", ".join(cells))
    yield ""
    for text in notes:
        yield from wrap(harmless(text), 96, subsequent_indent="    ")


def harmless(text: str) -> str:
    """Text that neither ends nor opens a comment, nor holds a trigraph or control character."""
    plain = "".join(c if c.isprintable() else " " for c in text).replace("\\", "/")
    return plain.replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")


def c_covariance(rows: Sequence[tuple[str, Sequence[float]]], about: str = "") -> str:
    """Write a covariance, its rows with their symbols, as a function with the prefix ``@P@``.

    A table that nobody uses would make the compiler complain.
    """
    size = len(rows)
    lines = [
        "/*",
        f" * Covariance of the errors numbered below{about}; NAN: unknown.",
        *(f" * {number}: {symbol}" for number, (symbol, _) in enumerate(rows)),
        " */",
        "static inline double @P@_covariance(int row, int column)",
        "{",
        f"    static const double covariance[{size}][{size}] = {c_matrix(row for _, row in rows)};",
        "    return covariance[row][column];",
        "}",
    ]
    return "\n".join(lines)


def c_matrix(rows: Iterable[Sequence[float]]) -> str:
    """Write the rows of a matrix as an initializer."""
    return "{\n" + ",\n".join(f"        {{{', '.join(map(c_number, row))}}}" for row in rows) + "}"


def c_number(value: float) -> str:
    """Write a number with all its digits, as a double."""
    if math.isnan(value):
        return "NAN"
    text = f"{value:.17g}"
    return text if set(text) & set(".e") else text + ".0"
