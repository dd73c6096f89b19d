"""Results as a notebook shows them: their text, in which tables are those of HTML."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

from accelcal.escapes import visible
from accelcal.plural import counted
from accelcal.report.lines import WIDTH, Row, aligned

if TYPE_CHECKING:
    from accelcal.effects.effect import Effect
    from accelcal.record import TumbleRecord

_MOST_ROWS = 60


def in_notebook(found: object) -> str:
    """Write a result as its text, with the tables where that keeps them."""
    text = str(found)
    return html_of(getattr(text, "lines", text.split("\n")))


def html_of(lines: Iterable[str]) -> str:
    r"""Write lines as they stand, and rows of tables among them as tables, under the line before.

    A text is ``<code>``, which keeps its columns in pages of nbconvert too: they set a bare
    ``<pre>`` in the letters of the text.

    Examples
    --------
    >>> html_of(["K1  1.35", "<script>\x1b", ""])
    '<pre><code>K1  1.35\n&lt;script&gt;\\x1b</code></pre>'
    >>> html_of(["run 1", *aligned([("value",), ("1.35",)], right={0})])
    '<table><caption>run 1</caption><tr><th>value</th></tr><tr><td>1.35</td></tr></table>'
    """
    parts: list[str] = []
    text: list[str] = []
    for block in _blocks(lines):
        if isinstance(block[0], Row):
            caption = _caption(text)
            parts += [_text(text), _table(caption, block)]
            text = []
        else:
            text += block
    return "".join([*parts, _text(text)])


def record_html(record: TumbleRecord) -> str:
    """Write what a record holds, a row for each run and mounting."""
    unit = f" [{record.unit}]" if record.unit else ""
    headings = ("run", "mounting", "temperature", "readings", "strokes", "angles", f"output{unit}")
    title = f"Readings of {record.serial or record.source}, {counted(len(record), 'reading')}"
    title += f", {record.date}" if record.date else ""
    rows = [headings, *map(_table_row, record.tables())]
    return html_of([title, *aligned(rows, right=()), *record.notes])


def effect_html(effect: Effect) -> str:
    """Write what an effect of the catalogue is."""
    about = ("physics", "formula", "signature", "to_tell_apart", "acts_on")
    rows = [(name.replace("_", " "), getattr(effect, name)) for name in about]
    parameters = [(p.name, p.unit, p.meaning) for p in effect.parameters]
    return html_of(
        [
            f"{effect.name} [{effect.id}]",
            *aligned(rows, right=(), headed=False),
            "parameters",
            *aligned([("name", "unit", "meaning"), *parameters], right=()),
        ]
    )


# -- parts -----------------------------------------------------------------------------------------


def _blocks(lines: Iterable[str]) -> list[list[str]]:
    """Lines without a break between text and table, or table and table."""
    blocks: list[list[str]] = []
    for line in lines:
        starts = not blocks or isinstance(line, Row) is not isinstance(blocks[-1][0], Row)
        if starts or (isinstance(line, Row) and line.is_heading):
            blocks.append([])
        blocks[-1].append(line)
    return blocks


def _caption(text: list[str]) -> str:
    """Take the line before a table from the text, whole where it was broken to fit the width."""
    start = max(len(text) - 1, 0)
    while (
        start
        and text[start]
        and len(f"{text[start - 1]} {text[start].strip().partition(' ')[0]}") > WIDTH
    ):
        start -= 1
        if _depth(text[start]) < _depth(text[start + 1]):
            break
    else:  # no line above is one that this one continues
        start = max(len(text) - 1, 0)
    told = " ".join(line.strip() for line in text[start:])
    del text[start:]
    return told


def _depth(line: str) -> int:
    return len(line) - len(line.lstrip())


def _text(lines: Sequence[str]) -> str:
    text = "\n".join(map(_safe, lines)).strip("\n")
    return f"<pre><code>{text}</code></pre>" if text else ""


def _table(caption: str, lines: Sequence[str]) -> str:
    """Write a table, and of many rows the first ones with the number of the others."""
    rows = [line for line in lines if isinstance(line, Row)]
    more = len(rows) - _MOST_ROWS - 1
    told = f"<p>and {counted(more, 'row')} more; <code>.to_frame()</code> has all</p>"
    above = f"<caption>{_safe(caption)}</caption>" if caption else ""
    body = "".join(map(_row, rows[: _MOST_ROWS + 1]))
    return f"<table>{above}{body}</table>{told * (more > 0)}"


def _row(row: Row) -> str:
    tag = "th" if row.is_heading else "td"
    return f"<tr>{''.join(f'<{tag}>{_safe(cell.strip())}</{tag}>' for cell in row.cells)}</tr>"


def _safe(text: str) -> str:
    """Write any text so that a browser shows it as it is."""
    return escape(visible(text))


def _table_row(part: TumbleRecord) -> tuple[str, ...]:
    temperature = part.mean_temperature
    return (
        part.run_labels[int(part.run[0])],
        str(part.mounting[0]),
        "" if temperature != temperature else f"{temperature:.2f} degC",  # NaN differs from itself
        *map(str, (len(part), len({*part.stroke.tolist()}), part.head_angles.size)),
        f"{part.output.min():.6g} … {part.output.max():.6g}",
    )
