"""One style for all pictures: fonts, axes, light and dark, and how a picture is written."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import wraps
from io import BytesIO
from threading import RLock
from typing import TYPE_CHECKING, Any, Generic, NoReturn, ParamSpec, TypeVar

import numpy as np

from accelcal.arguments.kinds import ending_of, kind_of
from accelcal.arguments.options import check_choice, check_flag
from accelcal.errors import InputError, not_installed
from accelcal.plot.ticks import FONT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "FORMS",
    "Pictures",
    "blank",
    "canvas",
    "canvases",
    "dressed",
    "entitled",
    "form_of",
    "own_panels",
    "palette",
    "picture",
    "styled",
    "theme",
]

P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours of a theme by what they are for."""

    name: str  # ``"light"`` or ``"dark"``
    # text and axes, what stands back, grid lines, and the ground
    ink: str
    muted: str
    grid: str
    paper: str
    series: tuple[str, ...]  # eight colours of data, the same hues in the same order in all themes
    middle: str  # middle of the scale of heat maps, which the first two of the series end


LIGHT = Palette(
    name="light",
    ink="#1b1f24",
    muted="#6b7178",
    grid="#e4e6e9",
    paper="#ffffff",
    series=(
        *("#0072b2", "#d55e00", "#009e73", "#cc79a7"),
        *("#e69f00", "#56b4e9", "#8c6d1f", "#5b4b9a"),
    ),
    middle="#f7f7f7",
)

DARK = Palette(
    name="dark",
    ink="#e8eaed",
    muted="#9aa0a6",
    grid="#3a3f45",
    paper="#15181c",
    series=(
        *("#56b4e9", "#ff8a4c", "#2ec4a0", "#e39bc4"),
        *("#f0c24b", "#a8d8f7", "#c9a85a", "#a99be0"),
    ),
    middle="#262b31",
)


FORMS = ("png", "svg", "pdf")
"""Forms of a picture; the name of its file ends in one of them."""

SMALL = 8.0
"""Smallest font [pt]."""

_SETTINGS = RLock()
"""Who draws: the settings of matplotlib are those of all threads."""

_UNDATED: dict[str, dict[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
_DOTS_PER_INCH = 150


_THEMES = {"light": LIGHT, "dark": DARK}
_current: ContextVar[Palette | None] = ContextVar("palette", default=None)


def palette() -> Palette:
    """Return the colours in force: those of the `theme` around the call, else the light ones."""
    return _current.get() or LIGHT


@contextmanager
def theme(name: str = "light", *, transparent: bool = False) -> Iterator[Palette]:
    """Draw everything inside in one theme.

    Parameters
    ----------
    name : {"light", "dark"}
        Which one.
    transparent : bool, default False
        Whether the ground shows what is behind the picture, as on a page.

    Yields
    ------
    Palette
        Its colours.

    Raises
    ------
    InputError
        If there is no such theme, or matplotlib is not installed.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> with theme("dark", transparent=True):
    ...     data = picture(calibration.plot.residuals(), "svg")
    >>> data[:5]
    b'<?xml'
    """
    check_choice(_THEMES, theme=name)
    check_flag(transparent=transparent)
    chosen = _THEMES[name]
    with _SETTINGS, _matplotlib().rc_context(_settings(chosen, transparent)):
        token = _current.set(chosen)
        try:
            yield chosen
        finally:
            _current.reset(token)


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Let a function draw in the theme around it, or in the light one."""

    @wraps(draw)
    def drawn(*arguments: P.args, **named: P.kwargs) -> R:
        if _current.get() is not None:
            return draw(*arguments, **named)
        with theme():
            return draw(*arguments, **named)

    return drawn


def canvas(ax: Axes | None, size: tuple[float, float] = (6.4, 3.8), *, polar: bool = False) -> Axes:
    """Take the axes given, or make a figure of its own, of a width and height [inch], for one.

    It goes round where `polar`. The axes come back dressed.

    Raises
    ------
    InputError
        If the axes given are not polar, but must be.
    """
    if ax is None:
        ax = _figure(size).add_subplot(polar=polar)
    _refuse_no_axes(ax)
    if polar and ax.name != "polar":
        raise InputError("this picture goes round; give it axes of projection='polar'")
    return dressed(ax)


def canvases(axes: Any, rows: int, columns: int, size: tuple[float, float]) -> Any:
    """Take the axes given, or make a figure of its own for `rows` times `columns`.

    A figure that is made has a width and height [inch]. The axes come back dressed, shape
    (rows * columns,), row by row.

    Raises
    ------
    InputError
        If another number of axes is given.
    """
    if axes is None:
        axes = _figure(size).subplots(rows, columns)
    flat = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
    if flat.size != rows * columns:
        raise InputError(f"{flat.size} axes given; this picture fills {rows * columns}")
    for ax in flat:
        _refuse_no_axes(ax)
        dressed(ax)
    return flat


def own_panels(count: int, across: int, size: tuple[float, float], around: float) -> Any:
    """Make a figure of its own for some panels, shape (count,), row by row, `across` side by side.

    A panel has a width and height [inch]; a title and a legend take a height of `around` [inch].
    """
    down = -(-count // across)
    axes = canvases(None, down, across, (size[0] * across, size[1] * down + around))
    for spare in axes[count:]:
        spare.remove()
    return axes[:count]


def _refuse_no_axes(ax: object) -> None:
    if not hasattr(ax, "tick_params"):
        raise InputError(f"{kind_of(ax)} in place of axes; give those of matplotlib, or none")


def dressed(ax: Axes) -> Axes:
    """Give axes the colours in force, which ticks made later keep too, and return them."""
    colours = palette()
    ax.tick_params(colors=colours.ink, labelsize=SMALL, color=colours.muted)
    ax.set_axisbelow(True)
    ax.grid(visible=True, color=colours.grid, lw=0.6)
    return ax


def entitled(ax: Axes, title: str, columns: int = 3) -> Axes:
    """Give axes a title, and between it and the data a legend of what has a label.

    The legend, of so many columns, hides no data there. The same axes come back.
    """
    labelled = len(ax.get_legend_handles_labels()[0])
    rows = -(-labelled // columns)
    ax.set_title(title, pad=8.0 + 16.0 * rows)
    if labelled:
        place = {"bbox_to_anchor": (-0.01, 1.0), "borderaxespad": 0.2}
        ax.legend(loc="lower left", ncols=columns, **place)
    return ax


def blank(ax: Axes, why: str) -> Axes:
    """Leave axes empty, and say why."""
    ax.set(xticks=[], yticks=[])
    ax.text(0.5, 0.5, why, ha="center", transform=ax.transAxes)
    return ax


def picture(axes: Any, form: str) -> bytes:
    """Write the figure of some axes as a picture.

    Parameters
    ----------
    axes : Axes or array of Axes
        What a plot function returns.
    form : str
        One of `FORMS`.

    Returns
    -------
    bytes
        The picture; the same axes make the same bytes.

    Raises
    ------
    InputError
        If the form is another.
    """
    check_choice(FORMS, form=form)
    figure = np.ravel(np.asarray(axes, dtype=object))[0].figure
    data = BytesIO()
    with _SETTINGS, _matplotlib().rc_context({"svg.hashsalt": "accelcal"}):
        figure.savefig(data, format=form, dpi=_DOTS_PER_INCH, metadata=_UNDATED.get(form))
    return data.getvalue()


def form_of(path: str) -> str:
    """Tell the form of a picture from the ending of its file.

    Parameters
    ----------
    path : str
        The file.

    Returns
    -------
    str
        One of `FORMS`.

    Raises
    ------
    InputError
        If it is none of them.

    Examples
    --------
    >>> form_of("budget.SVG")
    'svg'
    """
    return ending_of(path, [f".{form}" for form in FORMS]).removeprefix(".")


def _figure(size: tuple[float, float]) -> Figure:
    """A figure of its own; of pyplot where that is in use, so that a notebook shows it."""
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        made: Figure = pyplot.figure(figsize=size, layout="constrained")
        return made
    from matplotlib.figure import Figure

    return Figure(figsize=size, layout="constrained")


def _matplotlib() -> Any:
    try:
        import matplotlib.figure
    except ImportError:
        raise not_installed("a picture", "matplotlib", "plot") from None
    if "ipykernel" in sys.modules and "matplotlib.pyplot" not in sys.modules:
        import matplotlib.pyplot as plt

        # a notebook shows figures of a backend that was loaded outside of any settings
        plt.switch_backend(matplotlib.get_backend())
    return matplotlib


def _settings(colours: Palette, transparent: bool) -> dict[str, Any]:
    from cycler import cycler

    ground = "none" if transparent else colours.paper
    inked = "text.color axes.labelcolor axes.titlecolor xtick.labelcolor ytick.labelcolor"
    return {
        **dict.fromkeys(inked.split(), colours.ink),
        **dict.fromkeys(("axes.edgecolor", "xtick.color", "ytick.color"), colours.muted),
        **dict.fromkeys(("axes.spines.top", "axes.spines.right", "legend.frameon"), False),
        **dict.fromkeys(("figure.facecolor", "savefig.facecolor", "axes.facecolor"), ground),
        **dict.fromkeys(("font.size", "axes.labelsize"), 9.0),
        **dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), SMALL),
        **dict.fromkeys(("axes.titlesize", "figure.titlesize"), 10.0),
        **dict.fromkeys(("axes.titleweight", "figure.titleweight"), "bold"),
        "font.family": FONT,
        "axes.titlelocation": "left",
        "axes.prop_cycle": cycler(color=colours.series),
        "axes.linewidth": 0.8,
        "grid.color": colours.grid,
        "lines.linewidth": 1.4,
        "lines.markersize": 4.5,
        "errorbar.capsize": 2.0,
        "hatch.linewidth": 0.5,
        "figure.dpi": 110.0,
    }


@dataclass(frozen=True, slots=True)
class Pictures(Generic[R]):
    """Pictures of a result, a method each.

    Each method draws into the matplotlib axes that it is given, or makes a figure of its own, and
    returns the axes; ``ax.figure`` is the figure. `accelcal.plot.style.theme` chooses dark colours.

    Attributes
    ----------
    result : object
        The result.
    """

    result: R

    def __call__(self, *_: Any, **__: Any) -> NoReturn:
        """Say which pictures there are, where one is asked for as pandas has it.

        Raises
        ------
        InputError
            Always.
        """
        mine = {name for name, value in vars(type(self)).items() if callable(value)}
        names = ", ".join(f".plot.{name}()" for name in sorted(mine) if not name.startswith("_"))
        raise InputError(f".plot() is no picture; choose {names}")
