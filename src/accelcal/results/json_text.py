"""JSON text of results: one way to write it, and one to read it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from accelcal.arguments import path_text
from accelcal.errors import DocumentError

if TYPE_CHECKING:
    from os import PathLike

__all__ = ["document_in", "json_text", "parse_json"]


def json_text(document: Mapping[str, Any], path: str | PathLike[str] | None = None) -> str:
    r"""Write a document as JSON.

    Parameters
    ----------
    document : mapping
        The document.
    path : path, optional
        File to write, whole or not at all; without it the text is only returned.

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

    text = json.dumps(document, indent=1, allow_nan=False) + "\n"
    if path is not None:
        from accelcal.atomic import write_atomically

        write_atomically(path, text.encode())
    return text


def document_in(source: str | PathLike[str], *, writer: str = "accelcal fit") -> Any:
    """Parse JSON text, or that of a file.

    Parameters
    ----------
    source : str or path
        JSON text, or the path of a file that holds it.
    writer : str, default "accelcal fit"
        The command that writes such documents, for the message.

    Returns
    -------
    object
        The document.

    Raises
    ------
    DocumentError
        If there is no such file, or the text is not JSON.

    Examples
    --------
    >>> document_in('{"value": 0.1}')
    {'value': 0.1}
    """
    if isinstance(source, str) and not _may_be_path(source):
        return parse_json(source, writer=writer)
    name = path_text(source, f"give the path of a file written by {writer}, or its text")
    try:
        with open(name, encoding="utf-8-sig") as file:  # noqa: PTH123  (as in io.text)
            text = file.read()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "no text"
        raise DocumentError(
            f"{name}: not JSON, and no file that can be read ({reason}); give a file written by"
            f" {writer}, or its text"
        ) from None
    try:
        return parse_json(text, writer=writer)
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
        return json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise DocumentError(f"not JSON ({error}); give a file written by {writer}") from None


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is not a number of JSON")
