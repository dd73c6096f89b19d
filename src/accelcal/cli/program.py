"""The command group: the list of the commands, each imported when it is asked for."""

from __future__ import annotations

from importlib import import_module

import click

from accelcal.version import __version__

COMMANDS = (
    "fit",
    "check",
    "simulate",
    "compare",
    "discover",
    "apply",
    "export",
    "stability",
    "budget",
    "report",
    "design",
    "batch",
    "triad",
    "head",
    "history",
)
"""Commands in the order of the help; NAME is the function NAME of the module accelcal.cli.NAME."""


def show_log() -> None:
    """Show on standard error what the library logs."""
    import logging

    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
    logger = logging.getLogger("accelcal")
    logger.handlers = [handler]
    logger.setLevel(logging.INFO)


def _if_asked(_context: click.Context, _option: click.Parameter, value: bool) -> None:
    if value:
        show_log()


_VERBOSE = click.Option(
    ["-v", "--verbose"],
    is_flag=True,
    expose_value=False,
    callback=_if_asked,
    envvar="ACCELCAL_LOG",
    help="Log on standard error what is done; so does the environment variable ACCELCAL_LOG=1.",
)
"""An option of every command."""


class LazyGroup(click.Group):
    """A group of the commands in `COMMANDS`, none of them imported beforehand."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        """Names of all commands, in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Import one command; None for a name that is no command."""
        if cmd_name not in COMMANDS:
            return None
        command = getattr(import_module(f"accelcal.cli.{cmd_name}"), cmd_name)
        assert isinstance(command, click.Command)
        if _VERBOSE not in command.params:
            command.params.append(_VERBOSE)
        return command


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, message="%(prog)s %(version)s")
def program() -> None:
    """Calibrate navigation accelerometers from tumble tests in the gravity field.

    Results go to standard output, everything else to standard error.

    Exit codes: 0 done; 1 done, but a verdict failed or a batch has errors; 2 input or options
    cannot be used.
    """
