"""Pictures that stand within a page: SVG for light and dark paper, the same bytes each time."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache, partial
from io import StringIO
from textwrap import fill
from typing import Any

from accelcal.errors import not_installed
from accelcal.page.blocks import Figure
from accelcal.plot.style import theme as themed

_SCREEN_FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif"
_STATIC: dict[str, None] = dict.fromkeys(("Date", "Creator", "Format", "Type"))
_FONT = re.compile(r"'DejaVu Sans'(?:, [^;\"]+?)?(?=[;\"])")
_NOT_IN_A_PAGE = re.compile(
    r"<\?xml.*?\?>\s*|<!DOCTYPE.*?>\s*|<metadata>.*?</metadata>\s*|<style.*?</style>\s*", re.DOTALL
)


def picture(
    name: str,
    draw: Callable[[Any], Any],
    told: tuple[str, str],
    size: tuple[float, float] = (3.8, 2.9),
    *,
    polar: bool = False,
) -> Figure:
    """Prepare one picture; as `pictures`, but for what is told of it alone."""
    (found,) = pictures(name, draw, [told], size, polar=polar)
    return found


def pictures(
    name: str,
    draw: Callable[[Any], Any],
    told: Sequence[tuple[str, str]],
    size: tuple[float, float],
    *,
    polar: bool = False,
    rows: int = 1,
) -> list[Figure]:
    """Prepare pictures, each drawn for light or for dark paper when a page asks for it.

    The name is one that no other picture of the page has; each picture is `told` by its caption and
    alternative text. The size is width and height [inch]: the letters have 8 to 10 pt, so 4 is
    narrow enough for a phone. `draw` draws into the axes that it is given: those of the picture, or
    a list of them for several, of which each picture has some rows, the upper ones of all first.
    Drawing raises an `InputError` where matplotlib is not installed.
    """

    @cache
    def drawn(theme: str) -> list[str]:
        return _drawn(f"{name}-{theme}", theme, draw, (rows, len(told)), size, polar=polar)

    wide = size[0] > _NARROW
    return [Figure(*words, partial(_at, place, drawn), wide) for place, words in enumerate(told)]


def _at(place: int, drawn: Callable[[str], list[str]], theme: str) -> str:
    return drawn(theme)[place]


def _drawn(
    name: str,
    theme: str,
    draw: Callable[[Any], Any],
    shape: tuple[int, int],
    size: tuple[float, float],
    *,
    polar: bool,
) -> list[str]:
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure as Canvas
    except ImportError:
        raise not_installed("a report", "matplotlib", "report") from None

    with themed(theme, transparent=True), rc_context(_FOR_A_PAGE):
        rows, count = shape
        canvases = [Canvas(figsize=size, layout="constrained") for _ in range(count)]
        axes = [
            canvas.add_subplot(rows, 1, row + 1, polar=polar)
            for row in range(rows)
            for canvas in canvases
        ]
        draw(axes[0] if len(axes) == 1 else axes)
        for canvas in canvases:
            _leave_room(canvas)
        return [_svg(canvas, f"{name}-{i}") for i, canvas in enumerate(canvases)]


def _leave_room(canvas: Any) -> None:
    """Leave the title to the caption, and put the legend below, as on a phone there is no more."""
    for axes in canvas.axes:
        axes.set_xlabel(fill(axes.get_xlabel(), _LONGEST_LABEL))
        for place in ("left", "center", "right"):
            axes.set_title("", loc=place)
        legend = axes.get_legend()
        if legend is not None:
            words = [text.get_text() for text in legend.get_texts()]
            drawn = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
            shown = zip(words, legend.legend_handles, strict=True)
            handles = [drawn.get(word, handle) for word, handle in shown]
            legend.remove()
            abreast = 2 if sum(sorted(map(len, words))[-2:]) <= _LONGEST_LABEL else 1
            canvas.legend(handles, words, loc="outside lower center", ncols=abreast)


_NARROW = 5.0
"""Width up to which a picture shares a line with another [inch]."""

_LONGEST_LABEL = 42
"""Letters that a narrow picture holds side by side."""

_DOTS = 200
"""Pixels an inch, of what is drawn in pixels."""

_FOR_A_PAGE: Any = {"svg.fonttype": "none", "svg.hashsalt": "accelcal"}
"""Text stays text, and ids do not change from run to run."""


def _svg(canvas: Any, name: str) -> str:
    data = StringIO()
    canvas.savefig(data, format="svg", dpi=_DOTS, metadata=_STATIC)
    text = _NOT_IN_A_PAGE.sub("", data.getvalue())
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'(url\(|href=")#', rf"\1#{name}-", text)
    return _FONT.sub(_SCREEN_FONT, text).strip()
