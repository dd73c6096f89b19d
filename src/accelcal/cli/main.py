"""The entry point: runs a command and turns what went wrong into a line and an exit code."""

from __future__ import annotations

import atexit
import gc
import io
import os
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TextIO

import click

from accelcal.cli.deliver import by_options, discard, say
from accelcal.cli.program import program
from accelcal.errors import MEMORY_FULL, AccelcalError, AccelcalWarning
from accelcal.escapes import ESCAPED

DONE = 0
UNUSABLE_INPUT = 2
BUG = 70  # EX_SOFTWARE of sysexits.h; a bug is no verdict, so it is not 1
INTERRUPTED = 130  # 128 + SIGINT, as shells report it
READER_LEFT = 141  # 128 + SIGPIPE, as shells report it

BUG_NOTICE = (
    "This is a bug in accelcal. Please report it to its issue tracker, with the lines above,"
    " the command and, if you may share it, the file."
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, by default with the arguments of the process, and return the exit code.

    It is 0 if done; 1 if done, but a verdict failed; 2 with unusable input or options.
    """
    _start_quickly()
    _prepare_streams()
    try:
        with _warnings_in_one_line():
            return _run(sys.argv[1:] if arguments is None else arguments)
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
    except click.ClickException as error:
        _tell("error", _in_a_line(error))
    except AccelcalError as error:
        _tell("error", error, prefix=getattr(error, "source", None) is None)
    except BrokenPipeError:
        discard(sys.stdout)
        return READER_LEFT
    except (OSError, MemoryError) as error:
        discard(sys.stdout)
        _tell("error", MEMORY_FULL if isinstance(error, MemoryError) else error)
    except KeyboardInterrupt:
        say("")  # the prompt of the shell starts below the ^C
        return INTERRUPTED
    except Exception as error:
        _report_bug(error)
        return BUG
    return UNUSABLE_INPUT


def _start_quickly() -> None:
    """Leave out what a short command does not need (benchmarks/startup.py shows the effect)."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the matrices are small: no threads
    gc.set_threshold(100_000, 50, 50)  # imports make much and throw away little
    atexit.register(gc.freeze)  # nobody searches for garbage at the end


def _run(arguments: Sequence[str]) -> int:
    if "_ACCELCAL_COMPLETE" in os.environ:
        program.main(prog_name="accelcal")  # shell completion is click's own, and exits
    try:
        with program.make_context("accelcal", list(arguments), color=_colour()) as context:
            _invoke(context)
    except click.exceptions.Exit as end:
        return end.exit_code
    return DONE


def _invoke(context: click.Context) -> None:
    try:
        program.invoke(context)
    except click.UsageError as error:
        command = program.get_command(context, context.invoked_subcommand or "")
        if command and error.ctx is None:  # click's parser does not tell its context
            error.ctx = click.Context(command, context, context.invoked_subcommand)
        raise
    except AccelcalError as error:
        command = program.get_command(context, context.invoked_subcommand or "")
        error.args = (by_options(str(error), command), *error.args[1:])
        raise


def _colour() -> bool | None:
    """Colour as click has it: False is never, True is always, None is on a terminal only."""
    if os.environ.get("NO_COLOR"):
        return False
    return True if os.environ.get("FORCE_COLOR") else None


def _prepare_streams() -> None:
    """Print what an encoding lacks as its escape, and nothing on a standard error that is closed.

    click would print that on standard output, among the results.
    """
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: PTH123, SIM115  (as long as the process)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=ESCAPED)


def _tell(kind: str, message: object, *, prefix: bool = True) -> None:
    """Write one line to standard error; FILE:LINE of a table stays in front, where editors look."""
    from accelcal.escapes import visible

    label = click.style(f"{kind}: ", fg={"error": "red", "warning": "yellow"}[kind], bold=True)
    line = visible(" ".join(str(message).splitlines()))
    say(f"{label}{line}" if prefix else line, color=_colour())


def _in_a_line(error: click.ClickException) -> str:
    """What click says of the command line, and where to read what would be right."""
    message = " ".join(error.format_message().split()).removesuffix(".")
    if not isinstance(error, click.UsageError):
        return message
    command = error.ctx.command_path if error.ctx else "accelcal COMMAND"
    message = re.sub(r"\. \(?Did you mean (.*\?)\)?$", r" (did you mean \1)", message)
    message = re.sub(r"a valid integer( range)?$", "a whole number", message)
    return f"{message[:1].lower()}{message[1:]}; see {command} --help"


def _report_bug(error: Exception) -> None:
    import traceback

    error.add_note(BUG_NOTICE)
    traceback.print_exception(error)


@contextmanager
def _warnings_in_one_line() -> Iterator[None]:
    with warnings.catch_warnings():
        show_other = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if issubclass(category, AccelcalWarning):
                _tell("warning", by_options(str(message)))
            else:
                show_other(message, category, filename, lineno, file, line)

        warnings.showwarning = show
        warnings.simplefilter("always", AccelcalWarning)
        yield
