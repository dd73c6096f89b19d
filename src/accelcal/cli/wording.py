"""What the library says of its arguments, as the user of a command reads it: by their options."""

from __future__ import annotations

import re

import click

_ARGUMENT = re.compile(r"(?:\brecord\.with_apparatus\()?\b([a-z]\w*)=(True|False|\.{3}|'[^']*')\)?")


def by_options(text: str, command: click.Command | None = None) -> str:
    """Name the options of a command where a message of the library names arguments.

    The library writes an argument as Python has it: ``resume=True``, ``dask='local'``, or
    ``gravity=...`` where the reader has a value of his own to give.

    Parameters
    ----------
    text : str
        The message.
    command : click.Command, optional
        Whose options they are; the command that runs by default.

    Returns
    -------
    str
        The message; what is no argument of the command stays as it is.

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
