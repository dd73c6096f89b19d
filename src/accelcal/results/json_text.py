"""JSON text of results: one way to write it, and one to read it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from accelcal.errors import DocumentError

if TYPE_CHECKING:
    from os import PathLike

__all__ = ["json_text", "parse_json"]


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


def parse_json(text: str) -> Any:
    """Parse JSON text, or say that it is none.

    Parameters
    ----------
    text : str
        JSON text.

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
        raise DocumentError(f"not JSON ({error}); give a file written by accelcal fit") from None


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is not a number of JSON")
