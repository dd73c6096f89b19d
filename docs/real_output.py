"""Output of the commands that the pages show, made by the commands themselves.

A block of the language ``console`` behind the comment ``<!-- run -->`` holds commands and what they
print; behind ``<!-- run: 20 lines -->`` the first lines, behind ``<!-- run: from Verdict -->``
all from the first line that starts so. ``python docs/real_output.py PAGE...`` tells which blocks
are out of date, and with ``--write`` puts them right. The blocks of a page are run one after the
other in one folder, which holds ``examples``; a command may go on in lines that a backslash ends.
``$ echo $?`` shows the exit code of the last one.
"""

from __future__ import annotations

import argparse
import io
import math
import os
import re
import shlex
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple
from unittest import mock

from accelcal.cli.main import main as accelcal_command

ROOT = Path(__file__).parents[1]

_BLOCK = re.compile(r"(<!-- run(?:: (.*?))? -->\n```console\n)(.*?)(```\n)", re.DOTALL)
_COMMAND = re.compile(r"^\$ ((?:.*\\\n)*.*)\n", re.MULTILINE)
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_LAST_DIGITS = 2.0
"""Units of the last digit by which another processor may print another number."""


class Shown(NamedTuple):
    """A command, and the output that a page shows."""

    command: str
    output: str


def shown(block: str) -> list[Shown]:
    r"""Split a block into its commands.

    Examples
    --------
    >>> shown("$ accelcal --version\naccelcal 0.1.0\n$ accelcal check a.csv\n")
    [Shown(command='accelcal --version', output='accelcal 0.1.0\n'),
    Shown(command='accelcal check a.csv', output='')]
    """
    parts = _COMMAND.split(block)[1:]
    return [Shown(*pair) for pair in zip(parts[::2], parts[1::2], strict=True)]


def output_of(command: str, folder: Path) -> tuple[str, int]:
    """Run a command of accelcal in a folder: all that it prints, and its exit code.

    It runs in this process, as on no terminal: 80 columns, and no colours.
    """
    name, *arguments = shlex.split(command.replace("\\\n", " "))
    if name != "accelcal":
        raise SystemExit(f"{command!r} is no command of accelcal; a page runs no others")
    printed = io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True)
    no_terminal = mock.patch.dict(os.environ, COLUMNS="80")
    with chdir(folder), no_terminal, redirect_stdout(printed), redirect_stderr(printed):
        code = accelcal_command(arguments)
    printed.seek(0)
    return printed.read(), code


def regenerated(page: str) -> str:
    """Give a page the output that its commands print now."""
    if not _BLOCK.search(page):
        return page
    with tempfile.TemporaryDirectory() as name:
        shutil.copytree(ROOT / "examples", Path(name) / "examples")
        return _BLOCK.sub(
            lambda found: found[1] + _rerun(found[3], found[2], Path(name)) + found[4], page
        )


def _rerun(block: str, part: str | None, folder: Path) -> str:
    parts, code = [], 0
    for command, _ in shown(block):
        if command == "echo $?":
            output = f"{code}\n"
        else:
            output, code = output_of(command, folder)
            output = _cut(output, part or "")
        parts.append(f"$ {command}\n{output.rstrip()}\n" if output.strip() else f"$ {command}\n")
    return "".join(parts)


def _cut(output: str, part: str) -> str:
    """The part of an output that a page shows, with an ellipsis for the rest."""
    lines = output.splitlines(keepends=True)
    if part.endswith(" lines"):
        count = int(part.removesuffix(" lines"))
        return "".join(lines[:count]) + ("...\n" if len(lines) > count else "")
    if part.startswith("from "):
        starts = [i for i, line in enumerate(lines) if line.startswith(part.removeprefix("from "))]
        if not starts:
            raise SystemExit(f"no line of the output starts as in {part!r}")
        return ("...\n" if starts[0] else "") + "".join(lines[starts[0] :])
    return output


def differences(old: str, new: str) -> Iterator[str]:
    """Lines of two pages that differ by more than the last digits of numbers."""
    before, after = old.splitlines(), new.splitlines()
    if len(before) != len(after):
        yield f"{len(before)} lines, now {len(after)}"
    for a, b in zip(before, after, strict=False):
        if not alike(a, b):
            yield f"{a!r}, now {b!r}"


def alike(a: str, b: str) -> bool:
    """Whether two lines say the same but for the last digits of their numbers.

    Examples
    --------
    >>> alike("K1 = 1.34601 mA/g", "K1 = 1.34602 mA/g"), alike("p = 0.3", "p = 0.9")
    (True, False)
    """
    if _NUMBER.sub("#", a).split() != _NUMBER.sub("#", b).split():
        return False
    pairs = zip(_NUMBER.findall(a), _NUMBER.findall(b), strict=True)
    return all(x == y or _close(x, y) for x, y in pairs)


def _close(x: str, y: str) -> bool:
    return math.isclose(float(x), float(y), rel_tol=1e-9, abs_tol=_LAST_DIGITS * _last_digit(x))


def _last_digit(number: str) -> float:
    digits, _, power = number.lower().partition("e")
    behind = len(digits.partition(".")[2])
    return 10.0 ** (int(power or 0) - behind) if "." in digits or power else 0.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Tell what is out of date, or put it right."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("pages", nargs="+", type=Path)
    parser.add_argument("--write", action="store_true", help="put the pages right")
    options = parser.parse_args(arguments)
    wrong = 0
    for path in options.pages:
        page = path.read_text("utf-8")
        new = regenerated(page)
        for line in differences(page, new):
            wrong += 1
            print(f"{path}: {line}")
        if options.write and new != page:
            path.write_text(new, "utf-8")
    return int(wrong > 0 and not options.write)


if __name__ == "__main__":
    sys.exit(main())
