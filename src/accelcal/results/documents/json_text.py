"""JSON text of results: one way to write it, and one to read it."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from accelcal.arguments.kinds import path_text
from accelcal.errors import DocumentError
from accelcal.escapes import encodable
from accelcal.results.documents.checked import DamageError

if TYPE_CHECKING:
    from os import PathLike

__all__ = ["json_text", "parse_json", "read_json"]

Result = TypeVar("Result")

_SURROGATES = ("\\ud", "\\uD")
"""How the escape of a surrogate begins in JSON, here and elsewhere; a pair of them is a letter."""


def json_text(document: Mapping[str, Any]) -> str:
    r"""Write a document as JSON.

    A byte of a file name that is not UTF-8 is written as its escape, such as ``\xff``: the lone
    surrogate by which Python has it is no JSON for strict readers (RFC 8259, section 8.2).

    Parameters
    ----------
    document : mapping
        The document.

    Returns
    -------
    str
        The JSON text; numbers keep all their digits.

    Raises
    ------
    ValueError
        If a number is not finite.

    Examples
    --------
    >>> json_text({"value": 0.1})
    '{\n "value": 0.1\n}\n'
    """
    import json  # here, as a report on the terminal does without

    text = json.dumps(document, indent=1, allow_nan=False, default=_plain) + "\n"
    if _SURROGATES[0] in text:
        text = json.dumps(_encodable(document), indent=1, default=_plain) + "\n"
    return text


def _plain(value: Any) -> Any:
    """A number of NumPy, which an argument may be, as one of Python."""
    return value.item()


def _encodable(part: Any) -> Any:
    """A part of a document, each text without lone surrogates."""
    if isinstance(part, str):
        return encodable(part)
    if isinstance(part, Mapping):
        return {_encodable(key): _encodable(item) for key, item in part.items()}
    if isinstance(part, list | tuple):
        return [_encodable(item) for item in part]
    return part


def read_json(
    source: str | PathLike[str], read: Callable[[Any], Result], *, writer: str = "accelcal fit"
) -> Result:
    """Read JSON text, or that of a file.

    Parameters
    ----------
    source : str or path
        JSON text, or the path of a file that holds it.
    read : callable
        Takes the document, and gives what it holds.
    writer : str, default "accelcal fit"
        The command that writes such documents, for the message.

    Returns
    -------
    object
        What the document holds.

    Raises
    ------
    DocumentError
        If there is no such file, the text is not JSON, or `read` refuses it.

    Examples
    --------
    >>> read_json('{"value": 0.1}', dict)
    {'value': 0.1}
    """
    if isinstance(source, str) and not _may_be_path(source):
        return read(parse_json(source, writer=writer))
    name = path_text(source, f"give the path of a file written by {writer}, or its text")
    try:
        with open(name, encoding="utf-8-sig") as file:  # noqa: PTH123  (as in io.files.text)
            text = file.read()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "no text"
        damage = DamageError(f"not JSON, and no file that can be read ({reason})")
        raise damage.told(writer).at(name) from None
    try:
        return read(parse_json(text, writer=writer))
    except DocumentError as error:
        raise error.at(name) from None


def _may_be_path(text: str) -> bool:
    """Whether a text is a name, and not a document, which is an object, nor what is left of one."""
    return re.match(r"[\s{\[\d\"]|$", text) is None and "\n" not in text


def parse_json(text: str, *, writer: str = "accelcal fit") -> Any:
    """Parse JSON text, or say that it is none.

    Parameters
    ----------
    text : str
        JSON text.
    writer : str, default "accelcal fit"
        The command that writes such documents, for the message.

    Returns
    -------
    object
        The document.

    Raises
    ------
    DocumentError
        If the text is not JSON.
    """
    import json

    try:
        document = json.loads(text)  # NaN is refused by the key that it stands under
    except (ValueError, RecursionError) as error:
        raise DamageError(f"not JSON ({error})").told(writer) from None
    return _encodable(document) if any(start in text for start in _SURROGATES) else document
