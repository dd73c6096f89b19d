"""From a path, standard input or an open file to text: compression, encoding, what is no text."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from io import BytesIO
from typing import IO, NamedTuple, TypeVar, cast

from accelcal.arguments.kinds import kind_of
from accelcal.errors import DocumentError, InputError, TableError
from accelcal.io.files.csv_text import is_batch_result
from accelcal.io.files.encodings import encoding_of, errors_of, note_of_encoding

Source = str | os.PathLike[str] | IO[bytes] | IO[str]
"""A path, ``"-"`` for standard input, or an open file."""

Found = TypeVar("Found")

PARQUET = b"PAR1"
"""How a Parquet file begins."""

WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
"""How workbooks begin."""

WORKBOOK_SUFFIXES = (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods")
"""Ends of the names of workbooks."""

_SHEET = re.compile(
    rf"(.+?(?:{'|'.join(map(re.escape, WORKBOOK_SUFFIXES))}))#(.+)", re.IGNORECASE | re.DOTALL
)

_JSON = re.compile(r'\s*(\{\s*(["}]|\Z)|\[\s*(\[\s*[-\d"\[]|\{))')

_FOREIGN = (
    (b"%PDF", "a PDF document"),
    (b"\x89HDF", "an HDF5 or MATLAB file"),
    (b"MATLAB 5.0", "a MATLAB file"),
)


_SMALL = 500_000
"""Bytes that take less long without OpenSSL than it takes to load."""

_ALONE = "_sha256" if sys.version_info < (3, 12) else "_sha2"
"""Module of CPython that has the function alone; other Pythons may lack it."""


class SourceText(NamedTuple):
    """Text of a source."""

    name: str  # name of the file, ``"<stdin>"`` for standard input
    text: str  # the text, every line ended by a line feed
    # how the bytes were read; ``"parquet"`` or ``"workbook"`` where they are no text, and this is
    # that of the rows
    encoding: str
    compressed: bool = False  # whether the bytes came out of gzip
    # SHA-256 of the bytes, in hexadecimal; None where the source gave text
    sha256: str | None = None
    # lines of the file that are left out below the headings, where this is a part of it
    skipped: int = 0
    notes: tuple[str, ...] = ()  # what is to be told of how it was read
    sheet: str = ""  # name of the sheet of a workbook; empty where it is none
    # sheets of the workbook that have no table, and may tell of the test
    beside: tuple[SourceText, ...] = ()


Texts = tuple[SourceText, ...]
"""What a source held that was read before."""


def read_text(source: Source | Texts, what: str = "table") -> SourceText:
    """Read the whole of a source as text.

    Gzip, Parquet and workbooks are told by their first bytes. A path may end in the name of a
    sheet, as in ``"tests.xlsx#AL-15"``. Texts that were read before are given back. `what` is for
    messages. Raises TableError if the source cannot be read, is not text, or is a workbook with
    several tables. Raises InputError if it is a Parquet file or a workbook, and what reads it is
    not installed.
    """
    first, *others = read_texts(source, what)
    if others:
        remedy = f"name one of {', '.join(text.name for text in (first, *others))}"
        raise TableError("several sheets have tables", remedy, source=file_and_sheet(first.name)[0])
    return first


def read_texts(source: Source | Texts, what: str = "table") -> Texts:
    """Read the tables of a source as text: several where a workbook has them in its sheets.

    Raises as `read_text` does.
    """
    if isinstance(source, tuple):
        return source
    name, content = _read(source, what)
    if isinstance(content, str):
        return (SourceText(name, _tidy(content, name), "text"),)
    compressed = content.startswith(b"\x1f\x8b")
    data = _gunzip(content, name) if compressed else content
    refuse_foreign(data, name)
    digest = sha256_of(content)
    return tuple(
        text._replace(text=_tidy(text.text, name), compressed=compressed, sha256=digest)
        for text in _texts(data, name)
    )


def read_document(
    source: Source | Texts, what: str, read: Callable[[str], Found]
) -> tuple[SourceText, Found]:
    """Read a source whose text is a document.

    `read` takes the text, and gives what it holds. Raises TableError if the source cannot be read
    or is not text. Raises DocumentError if `read` refuses it; the message names the source.
    """
    given = read_text(source, what)
    try:
        return given, read(given.text)
    except DocumentError as error:
        raise error.at(given.name) from None


def standard_input() -> IO[bytes]:
    """Give standard input.

    Raises InputError if it is closed.
    """
    if sys.stdin is None:
        raise InputError("standard input is closed; open it, or give the path of a file")
    return cast("IO[bytes]", getattr(sys.stdin, "buffer", sys.stdin))


def sha256_of(data: bytes) -> str:
    """SHA-256 in hexadecimal.

    ``hashlib`` loads OpenSSL, which is faster, but takes longer to load than a table takes to read.

    Examples
    --------
    >>> sha256_of(b"")[:16]
    'e3b0c44298fc1c14'
    """
    if len(data) < _SMALL and "hashlib" not in sys.modules:
        try:
            digest: str = import_module(_ALONE).sha256(data).hexdigest()
        except ImportError:
            pass
        else:
            return digest
    from hashlib import sha256

    return sha256(data).hexdigest()


def unreadable(error: OSError | ValueError, path: str, what: str) -> TableError:
    """Make the error of a file, which was to be a `what`, that cannot be opened or read."""
    if "\n" in path and not os.path.exists(path):  # noqa: PTH110
        remedy = f"give the path of a {what}, or its text as io.StringIO(text)"
        return TableError("text in place of a path", remedy, source="<text>")
    if isinstance(error, FileNotFoundError):
        remedy = f"give the path of a {what}, or - for standard input"
        return TableError("no such file", remedy, source=path)
    if isinstance(error, IsADirectoryError):
        return TableError("is a folder", f"give the path of one {what}", source=path)
    reason = getattr(error, "strerror", None) or str(error)
    return TableError(f"cannot be read ({reason})", "give a file that can be read", source=path)


def named_bytes(content: bytes, name: str) -> BytesIO:
    """Open content in memory like the file that it comes from."""
    file = BytesIO(content)
    file.name = name  # where a file has its name
    return file


def file_and_sheet(name: str) -> tuple[str, str | None]:
    """Take the name of a sheet off that of its workbook.

    There is no sheet where the path names none, or is that of a file as it stands.

    Examples
    --------
    >>> file_and_sheet("tests.xlsx#AL-15")
    ('tests.xlsx', 'AL-15')
    >>> file_and_sheet("tests#2.csv")
    ('tests#2.csv', None)
    """
    named = _SHEET.fullmatch(name) if "#" in name else None  # in a third of the time
    if named is None or os.path.exists(name):  # noqa: PTH110
        return name, None
    return named[1], named[2]


def refuse_foreign(data: bytes, name: str) -> None:
    """Refuse what other programs write that is no text, and say what it is.

    The beginning of the file is enough.
    """
    for mark, kind in _FOREIGN:
        if data.startswith(mark):
            remedy = "export the table as CSV text and give that file"
            raise TableError(f"{kind}, not a text table", remedy, source=name)


def is_document(text: str) -> bool:
    """Tell by its beginning whether a text is JSON, and no table."""
    return bool(_JSON.match(text))


def refuse_document(text: str, name: str) -> None:
    """Refuse JSON or results of a batch where a table belongs, and say what they are.

    The first lines are enough.
    """
    if is_batch_result(text):
        problem = "results of accelcal batch, not a table of readings"
        raise TableError(problem, "leave the file out, and give tables", source=name, line=1)
    if not is_document(text):
        return
    schema = re.search(r'"schema"\s*:\s*"(accelcal/([\w-]{1,40})/\d{1,9})"', text)
    problem, remedy = "JSON, not a table", "export the table as CSV text and give that file"
    if schema and schema[2] == "calibration":
        problem = "a calibration written by accelcal fit, not a table"
        remedy = "give it to accelcal apply, budget or export, and here the table of readings"
    elif schema:
        problem = f"a document {schema[1]!r} of accelcal, not a table"
        remedy = "give the table of readings"
    raise TableError(problem, remedy, source=name, line=1)


def _read(source: Source, what: str) -> tuple[str, bytes | str]:
    if isinstance(source, str) and source == "-":
        source = standard_input()
    if isinstance(source, str | os.PathLike):
        name = os.fspath(source)
        return name, _read_path(file_and_sheet(name)[0], what)
    if not hasattr(source, "read"):
        frames = (
            " (a DataFrame of a tumble test goes to accelcal.read_arrays, columns of a launch to"
            " accelcal.Launch, outputs of a triad to accelcal.TriadRecord)"
        )
        raise InputError(
            f"{kind_of(source)} in place of a {what}; give its path, or an open file"
            f"{frames if hasattr(source, 'columns') else ''}"
        )
    name = getattr(source, "name", "<table>")
    try:
        content = source.read()
    except UnicodeDecodeError:
        remedy = "open the file in binary mode; the reader finds the encoding"
        raise TableError("the text cannot be decoded", remedy, source=str(name)) from None
    return name if isinstance(name, str) else "<stdin>", content


def _read_path(path: str, what: str) -> bytes:
    try:
        with open(path, "rb") as file:  # noqa: PTH123  (pathlib costs start-up time)
            return file.read()
    except (OSError, ValueError) as error:
        raise unreadable(error, path, what) from None


def _gunzip(content: bytes, name: str) -> bytes:
    import gzip
    import zlib

    try:
        return gzip.decompress(content)
    except (OSError, EOFError, zlib.error):
        problem, remedy = "the gzip compression is damaged or cut short", "copy the file again"
        raise TableError(problem, remedy, source=name) from None


def _texts(data: bytes, name: str) -> tuple[SourceText, ...]:
    if data.startswith(WORKBOOKS):
        from accelcal.io.workbook import read_sheets

        return read_sheets(data, name)
    if data.startswith(PARQUET):
        from accelcal.io.files.parquet import as_csv, read_all

        rows = as_csv(read_all(named_bytes(data, name)), name).decode()
        return (SourceText(name, rows, "parquet"),)
    return (_decode(data, name),)


def _decode(data: bytes, name: str) -> SourceText:
    wide = utf16_of(data)
    if not wide:
        with suppress(UnicodeDecodeError):
            return SourceText(name, data.decode("utf-8-sig"), "utf-8")
    encoding = wide or encoding_of(data)
    notes = () if wide else (note_of_encoding(encoding),)
    try:
        return SourceText(name, data.decode(encoding, errors_of(encoding)), encoding, notes=notes)
    except UnicodeDecodeError:
        what, remedy = "UTF-16" if wide else encoding, "export the file again, best as UTF-8"
        raise TableError(f"the {what} text is damaged", remedy, source=name) from None


def utf16_of(data: bytes) -> str:
    """Name of the UTF-16 variety, empty if the bytes are something else."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    start = data[:400]
    zeros = start[0::2].count(0), start[1::2].count(0)
    enough = 0.2 * len(start)  # Latin text has nearly half its bytes zero, every other one
    if max(zeros) <= enough or min(zeros) > 0:
        return ""
    return "utf-16-le" if zeros[1] else "utf-16-be"


def _tidy(text: str, name: str) -> str:
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    text = text.removeprefix("\ufeff").removesuffix("\x1a")  # end of file as DOS wrote it
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        problem = "a zero byte: the file is damaged or not text"
        raise TableError(problem, "export the table again as text", source=name, line=line)
    return text
