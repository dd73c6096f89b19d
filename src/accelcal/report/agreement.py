"""The verdict of a comparison, in words."""

from __future__ import annotations

_WORDS = {"agree": "agree", "disagree": "DISAGREE"}


def headline(compared: str, verdict: str, hidden_by: str) -> str:
    """Tell a verdict.

    Examples
    --------
    >>> headline("The coefficients", "disagree", "")
    'The coefficients DISAGREE'
    >>> headline("The coefficients", "no verdict", "errors of this size hide disagreements")
    'No verdict: errors of this size hide disagreements'
    """
    return f"{compared} {_WORDS[verdict]}" if verdict in _WORDS else f"No verdict: {hidden_by}"
