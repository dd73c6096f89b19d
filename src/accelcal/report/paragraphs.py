"""Sentences as paragraphs of a report, no wider than a terminal of a hundred columns."""

from __future__ import annotations

from textwrap import wrap

__all__ = ["WIDTH", "hanging", "wrapped"]

WIDTH = 100
"""Characters of the longest line."""


def hanging(sentence: str, indent: str = "") -> list[str]:
    """Fill lines, those after the first two characters deeper.

    Parameters
    ----------
    sentence : str
        What to say.
    indent : str, optional
        What stands before the first line.

    Returns
    -------
    list of str
        The lines.

    Examples
    --------
    >>> [len(line) for line in hanging("drift " * 30)], hanging("drift " * 30)[1][:9]
    ([95, 85], '  drift d')
    """
    return wrap(sentence, WIDTH, initial_indent=indent, subsequent_indent=indent + "  ")


def wrapped(sentence: str, lead: str = "") -> list[str]:
    """Fill lines, those after the first as deep as the words behind the lead.

    Parameters
    ----------
    sentence : str
        What to say.
    lead : str, optional
        What stands before the first line, such as ``"  - "``.

    Returns
    -------
    list of str
        The lines.
    """
    return wrap(sentence, WIDTH, initial_indent=lead, subsequent_indent=" " * len(lead))
