"""PDF on A4, printed by a browser of the machine."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from accelcal.errors import InputError

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

    Returns
    -------
    bytes
        The PDF.

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
