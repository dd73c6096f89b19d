"""Pages as HTML and Markdown, by the templates of this room, and as PDF, printed by a browser."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from accelcal.errors import InputError, not_installed
from accelcal.escapes import visible
from accelcal.page.blocks import Page

if TYPE_CHECKING:
    from jinja2 import Environment

_SPECIAL = re.compile(r"([\\`*_\[\]<>|$&~])")
_BLANK_LINES = re.compile(r"\n{3,}")


def html(page: Page, *, on_paper: bool = False) -> str:
    """Write a page as HTML, whole in itself: without scripts, it needs no other file.

    On paper it has no dark pictures, and nothing is folded away.

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
    """Write a page as the Markdown of GitHub, with the tables behind the pictures in place of them.

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


_NAMES = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"),
    "microsoft-edge",
)
_QUIET = (
    *("--headless", "--disable-gpu", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--no-pdf-header-footer"),
)
_LONGEST = 120  # s, for a browser that hangs


def browser() -> str | None:
    """Find a browser that prints: that of ``ACCELCAL_BROWSER``, else Chromium, Chrome or Edge."""
    names = [os.environ.get("ACCELCAL_BROWSER", ""), *_NAMES]
    return next(filter(None, map(shutil.which, filter(None, names))), None)


def pdf(document: str) -> bytes:
    """Print a page of HTML on A4.

    Raises
    ------
    InputError
        If there is no browser, or it does not print.
    """
    program = browser()
    if program is None:
        raise InputError(
            "a PDF is printed by Chromium, Chrome or Edge, and none was found; install one, name it"
            " by ACCELCAL_BROWSER, or write .html and print that"
        )
    with TemporaryDirectory(prefix="accelcal-", ignore_cleanup_errors=True) as folder:
        return _printed(program, document, Path(folder))


def _printed(program: str, document: str, folder: Path) -> bytes:
    page, paper = folder / "report.html", folder / "report.pdf"
    page.write_text(document, encoding="utf-8")
    rooted = ["--no-sandbox"] if getattr(os, "geteuid", lambda: 1)() == 0 else []
    command = [program, *_QUIET, *rooted, f"--user-data-dir={folder / 'profile'}"]
    command += [f"--print-to-pdf={paper}", page.as_uri()]
    try:
        done = subprocess.run(command, capture_output=True, timeout=_LONGEST, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise InputError(
            f"{program} does not print ({error}); write .html and print that"
        ) from None
    if done.returncode != 0 or not paper.exists():
        raise InputError(f"{program} printed nothing; write .html and print that")
    return paper.read_bytes()
