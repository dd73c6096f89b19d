"""The files that a command reads and writes: none is written that is read, and none named twice."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

import click

from accelcal.errors import InputError

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

_FORMS = (
    *(".csv", ".tsv", ".gz", ".parquet"),
    *(".json", ".yaml", ".toml", ".xml", ".html", ".md", ".pdf"),
)
"""Ends of names by which other programs take a file for what it is, besides those of workbooks."""


class _FileName(click.types.StringParamType):
    """The name of a file as it is written; whoever opens the file words what is wrong with it."""

    def shell_complete(
        self,
        ctx: click.Context,  # noqa: ARG002
        param: click.Parameter,  # noqa: ARG002
        incomplete: str,
    ) -> list[CompletionItem]:
        """Leave it to the shell, which completes names of files."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(incomplete, type="file")]


class FileToRead(_FileName):
    """Type of an argument or option: a file that the command reads."""


class FileToWrite(_FileName):
    """Type of an option: a file that the command writes.

    The form is what is in the file, whatever its name, such as ``"JSON"``; None where the name
    decides. Names end so as to promise this form; those that promise another one are refused.
    """

    def __init__(self, form: str | None = None, *ends: str) -> None:
        self.form, self.ends = form, ends

    def check(self, option: str, path: str) -> None:
        """Refuse a name that promises another form than the file will have."""
        from accelcal.io.files.text import WORKBOOK_SUFFIXES, file_and_sheet

        end = os.path.splitext(file_and_sheet(path)[0])[1].lower()  # noqa: PTH122  (start-up)
        if self.form and end in (*_FORMS, *WORKBOOK_SUFFIXES) and end not in self.ends:
            promised = " or ".join(self.ends)
            raise InputError(f"{option} {path} would hold {self.form}; end its name in {promised}")


class FileOfManyForms(FileToWrite):
    """Type of an option: a file whose name decides the form.

    The room is the module that writes it; its `form_of` refuses other names.
    """

    def __init__(self, room: str) -> None:
        super().__init__()
        self._room = room

    def check(self, option: str, path: str) -> None:  # noqa: ARG002
        """Refuse a name that tells no form."""
        import_module(self._room).form_of(path)


class SimulatedTable(FileToWrite):
    """Type of an option: a table that is simulated, and replaces none but such a table."""

    def __init__(self) -> None:
        super().__init__("CSV", ".csv", ".gz")

    def check(self, option: str, path: str) -> None:
        """Refuse a name of another form, and to write over anything else."""
        from accelcal.io.files.overwriting import is_simulated, may_be_replaced

        super().check(option, path)
        if not may_be_replaced(path, is_simulated):
            raise InputError(
                f"{option} {path} would overwrite what is no simulated table; name another file"
                f" with {option}"
            )


CSV = FileToWrite("CSV", ".csv", ".gz")
JSON = FileToWrite("JSON", ".json")
PICTURE = FileOfManyForms("accelcal.plot.style")
REPORT = FileOfManyForms("accelcal.page.write")


class Command(click.Command):
    """A command that refuses, before any work, empty options and what cannot be right about files.

    It reads standard input once, and does not write over what it reads or has written.
    """

    def invoke(self, ctx: click.Context) -> Any:
        """Look at the options and the names of the files, and run the command."""
        self._refuse_empty(ctx)
        given = [*self._files(ctx, FileToRead)]
        _refuse_twice(given)
        read = [path for _, path in given]
        written = list(self._files(ctx, FileToWrite))
        if written:
            places = [_place(path) for path in read if path != "-"]
            _refuse_to_overwrite(places, [(param.opts[0], path) for param, path in written])
        for param, path in written:
            cast("FileToWrite", param.type).check(param.opts[0], path)
        return super().invoke(ctx)

    def _refuse_empty(self, ctx: click.Context) -> None:
        """Refuse an option without text, as of an empty variable of a script."""
        options = (param for param in self.params if isinstance(param, click.Option))
        for param in options:
            given = ctx.params.get(param.name or "")
            texts = given if isinstance(given, tuple) else (given,)
            if any(isinstance(text, str) and not text.strip() for text in texts):
                raise click.BadParameter(
                    "it is empty; write it, or leave the option out.", ctx, param
                )

    def _files(self, ctx: click.Context, kind: type) -> Iterator[tuple[click.Parameter, str]]:
        for param in self.params:
            given = ctx.params.get(param.name or "")
            if isinstance(param.type, kind) and given is not None:
                paths = [given] if isinstance(given, str) else given
                yield from ((param, path) for path in paths)


def refuse_source(source: str, path: str | None) -> None:
    """Refuse to write over the table that a calibration was made from."""
    if path is not None and os.path.isfile(path) and _place(source) == os.path.realpath(path):  # noqa: PTH113
        raise InputError(
            f"-o {path} is the table that the calibration was made from; name another file with -o"
        )


def _refuse_twice(read: Sequence[tuple[click.Parameter, str]]) -> None:
    """Refuse one of many files again, and standard input anywhere: all of it is read once."""
    seen: dict[object, str] = {}
    for param, path in read:
        if path == "-" and "-" in seen:
            raise InputError("- is given twice; standard input can be read once, so name it once")
        key = "-" if path == "-" else (param.name, *_place_and_sheet(path))
        if key in seen:
            what = "is given twice" if path == seen[key] else f"is the file {seen[key]}"
            raise InputError(f"{path} {what}; name each file once")
        seen[key] = path


def _refuse_to_overwrite(read: Sequence[str], written: Sequence[tuple[str, str]]) -> None:
    places: dict[str, str] = {}
    for option, path in written:
        place = os.path.realpath(path)
        if path == "-" or (os.path.exists(place) and not os.path.isfile(place)):  # noqa: PTH110, PTH113
            continue  # standard output, a device or a pipe holds nothing to be lost
        if place in read:
            raise InputError(
                f"{option} {path} is a file to be read; name another file with {option}"
            )
        if place in places:
            raise InputError(f"{option} {path} is that of {places[place]}; name another file")
        places[place] = option


def _place(path: str) -> str:
    """Where the file of a table is; that of a sheet is its workbook."""
    return _place_and_sheet(path)[0]


def _place_and_sheet(path: str) -> tuple[str, str | None]:
    from accelcal.io.files.text import file_and_sheet

    file, sheet = file_and_sheet(path)
    return os.path.realpath(file), sheet
