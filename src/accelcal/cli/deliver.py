"""Where a result goes, whole or not at all, and in which words its messages name arguments."""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TextIO

import click

from accelcal.errors import InputError
from accelcal.escapes import ended, visible

if TYPE_CHECKING:
    from accelcal.record import TumbleRecord

_WORDS = re.compile(r"\b(PASS|FAIL|WARNING|JUMP|undecided|not tested)\b")
_COLOURS = {"PASS": "green", "FAIL": "red", "JUMP": "red"}


def deliver(text: str, path: str | None = None, *, words: bool = False) -> None:
    """Write a result, as UTF-8 to a file, or to standard output, which ``"-"`` is too.

    A line feed is added at its end where there is none. In `words` for people, options are named,
    and verdicts and warnings have colours on a terminal.

    Raises
    ------
    InputError
        If the file or standard output cannot be written.
    """
    if path is None or path == "-":
        text = ended(text)
        _print(_coloured(by_options(text)) if words else text)
        return
    from accelcal.atomic import write_text

    write_text(path, text)


def deliver_picture(draw: Callable[[], Any], path: str | None) -> None:
    """Draw a picture into a file, where one is asked for.

    The ending of the file names the form.

    Raises
    ------
    InputError
        If the form is another, matplotlib is not installed, or the file cannot be written.
    """
    if path is None:
        return
    from accelcal.atomic import write_atomically
    from accelcal.plot.style import form_of, picture

    form = form_of(path)
    write_atomically(path, picture(draw(), form))


def remark(text: str) -> None:
    """Write a line to standard error, whatever names stand in it."""
    say(visible(by_options(text)))


def remark_alike(records: Sequence[TumbleRecord]) -> None:
    """Tell serial numbers of several files that are two by their spelling alone.

    Those of one file have such a note of their own.
    """
    from accelcal.serials import notes_of_alike

    told = {note for record in records for note in record.notes}
    for note in notes_of_alike(dict.fromkeys(r.serial for r in records if r.serial)):
        if note not in told:
            remark(f"note: {note}")


def say(text: str, *, color: bool | None = None) -> None:
    """Write a line to standard error, as far as it takes one: the exit code says the rest.

    Raises
    ------
    BrokenPipeError
        If its reader left.
    """
    try:
        click.echo(text, file=sys.stderr, color=color)
    except BrokenPipeError:
        raise
    except OSError:  # a full disk
        discard(sys.stderr)


@contextmanager
def standard_output() -> Iterator[TextIO]:
    """Open standard output, where results go.

    Raises
    ------
    InputError
        If it is closed, or cannot be written. An OSError of the block is taken for that.
    """
    if sys.stdout is None:
        raise InputError("standard output is closed; open it, or name a file with -o")
    try:
        yield sys.stdout
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        discard(sys.stdout)
        raise InputError(
            f"standard output cannot be written: {error.strerror}; name a file with -o"
        ) from error


def discard(stream: TextIO) -> None:
    """Let the interpreter flush into nothing what a standard stream does not take."""
    with suppress(io.UnsupportedOperation):  # it is no file
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _coloured(text: str) -> str:
    """Verdicts and warnings in colour; click takes it out again where it goes to no terminal."""

    def styled(word: re.Match[str]) -> str:
        return click.style(word[0], fg=_COLOURS.get(word[0], "yellow"), bold=True)

    return _WORDS.sub(styled, text)


def _print(text: str) -> None:
    with standard_output() as stream:
        click.echo(text, file=stream, nl=False)  # else click takes ASCII for UTF-8


_ARGUMENT = re.compile(r"(?:\brecord\.with_apparatus\()?\b([a-z]\w*)=(True|False|\.{3}|'[^']*')\)?")


def by_options(text: str, command: click.Command | None = None) -> str:
    """Name the options of a command where a message of the library names arguments.

    The library writes an argument as Python has it: ``resume=True``, ``dask='local'``, or
    ``local_gravity=...`` where the reader has a value of his own to give. The options are those of
    the command that runs, unless another is given. What is no argument of it stays as it is.

    Examples
    --------
    >>> import click
    >>> resume = click.Option(["--resume/--anew"])
    >>> head = click.Option(["--head-uncertainty"], metavar="G")
    >>> command = click.Command("example", params=[resume, head])
    >>> by_options("go on with resume=True, or anew with resume=False", command)
    'go on with --resume, or anew with --anew'
    >>> by_options("declare it by record.with_apparatus(head_uncertainty=...)", command)
    'declare it by --head-uncertainty G'
    """
    context = click.get_current_context(silent=True)
    command = command or (context.command if context else None)
    if command is None:
        return text
    options = {each.name: each for each in command.params if isinstance(each, click.Option)}

    def as_option(found: re.Match[str]) -> str:
        name, value = found.groups()
        return _as_option(options[name], value) if name in options else found[0]

    return _ARGUMENT.sub(as_option, text)


def _as_option(option: click.Option, value: str) -> str:
    if value == "False":
        return option.secondary_opts[0]
    given = {"True": "", "...": option.metavar or ""}.get(value, value.strip("'"))
    return f"{option.opts[0]} {given}".rstrip()
