"""Fragments of HTML: tables and lists, without scripts and styles of their own."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from accelcal.escapes import visible
from accelcal.plural import counted

_MOST_ROWS = 60


def safe(text: str) -> str:
    r"""Write any text so that a browser shows it as it is.

    Examples
    --------
    >>> safe("<script>\x1b")
    '&lt;script&gt;\\x1b'
    """
    return escape(visible(text))


def result(title: str, facts: Iterable[str], *parts: str, notes: Iterable[str] = ()) -> str:
    """Write a result: its title in bold, facts beside it, parts of HTML, and a list of notes.

    Facts and notes that are empty are left out; each note stands once.
    """
    told = "".join(f", {safe(fact)}" for fact in facts if fact)
    heading = f"<p><b>{safe(title)}</b>{told}</p>"
    return "".join([heading, *parts, items(map(safe, filter(None, notes)))])


def table(caption: str, headings: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Write a table; one without rows is left out."""
    body = "".join(_line("td", row) for row in rows)
    if not body:
        return ""
    return f"<table><caption>{safe(caption)}</caption>{_line('th', headings)}{body}</table>"


def long_table(caption: str, headings: Iterable[str], rows: Sequence[Iterable[str]]) -> str:
    """Write a table as `table`, and of many rows the first ones with the number of the others."""
    more = len(rows) - _MOST_ROWS
    told = f"<p>and {counted(more, 'row')} more; <code>.to_frame()</code> has all</p>"
    return table(caption, headings, rows[:_MOST_ROWS]) + told * (more > 0)


def items(found: Iterable[str]) -> str:
    """Write a list of what is HTML already, each item once; an empty one is left out."""
    lines = "".join(f"<li>{item}</li>" for item in dict.fromkeys(found))
    return f"<ul>{lines}</ul>" if lines else ""


def preformatted(text: str) -> str:
    r"""Write a text that is set in columns, line by line.

    As ``<code>`` it keeps its columns in pages of nbconvert too, which set a bare ``<pre>`` in the
    letters of the text.

    Examples
    --------
    >>> preformatted("K1  1.35\nk0  <1")
    '<pre><code>K1  1.35\nk0  &lt;1</code></pre>'
    """
    lines = "\n".join(map(safe, text.split("\n")))
    return f"<pre><code>{lines}</code></pre>"


def _line(tag: str, cells: Iterable[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{safe(cell)}</{tag}>' for cell in cells)}</tr>"
