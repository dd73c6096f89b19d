"""Pages as HTML and Markdown, by the templates of this room."""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from accelcal.errors import not_installed
from accelcal.escapes import visible
from accelcal.page.blocks import Page

if TYPE_CHECKING:
    from jinja2 import Environment

_SPECIAL = re.compile(r"([\\`*_\[\]<>|])")
_BLANK_LINES = re.compile(r"\n{3,}")


def html(page: Page, *, on_paper: bool = False) -> str:
    """Write a page as HTML, whole in itself.

    Parameters
    ----------
    page : Page
        The page.
    on_paper : bool, default False
        Whether it is to be printed at once: without dark pictures, and nothing folded away.

    Returns
    -------
    str
        A document without scripts that needs no other file.

    Raises
    ------
    InputError
        If jinja2 is not installed.
    """
    environment = _environment(_visible)
    from markupsafe import Markup  # comes with jinja2

    style = Markup(_template("style.css"))
    template = environment.get_template("page.html.j2")
    return template.render(page=page, style=style, on_paper=on_paper).strip() + "\n"


def markdown(page: Page) -> str:
    """Write a page as Markdown, with the tables behind the pictures in place of them.

    Returns
    -------
    str
        The same content in the Markdown of GitHub.

    Raises
    ------
    InputError
        If jinja2 is not installed.
    """
    text = _environment(_plain).get_template("page.md.j2").render(page=page)
    return _BLANK_LINES.sub("\n\n", text).strip() + "\n"


def _environment(finalize: Callable[[Any], Any]) -> Environment:
    try:
        from jinja2 import Environment, FunctionLoader, StrictUndefined
    except ImportError:
        raise not_installed("a report", "jinja2", "report") from None
    return Environment(
        loader=FunctionLoader(_template),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
        finalize=finalize,
    )


def _template(name: str) -> str:
    return files("accelcal.page").joinpath("templates", name).read_text("utf-8")


def _visible(value: Any) -> Any:
    """Text without control characters; what is HTML already passes."""
    return visible(value) if type(value) is str else value


def _plain(value: Any) -> Any:
    """Text in which no character means anything to Markdown."""
    if type(value) is not str:
        return value
    from markupsafe import Markup  # comes with jinja2

    return Markup(_SPECIAL.sub(r"\\\1", visible(value)))
