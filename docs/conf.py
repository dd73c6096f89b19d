"""Configuration of Sphinx, the directive that shows the help of a command, pages of effects."""

import shutil
import sys
from pathlib import Path

import click
from docutils import nodes
from docutils.parsers.rst import Directive
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

from accelcal import __version__
from accelcal.cli.program import program

sys.path.insert(0, str(Path(__file__).parent))
from effect_pages import write_pages

project = "accelcal"
author = "The accelcal authors"
copyright = author
release = version = __version__

extensions = ["sphinx.ext.autodoc", "mathml", "myst_nb", "numpydoc"]
exclude_patterns = ["_build"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3

nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_execution_show_tb = True

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True  # AL15 by its name
autodoc_typehints = "none"  # the docstrings have the types
numpydoc_show_class_members = False

html_math_renderer = "mathml"
html_theme = "furo"
html_title = f"accelcal {release}"
html_static_path = ["static"]
html_css_files = ["pages.css"]


class CommandHelp(Directive):
    """The help of a command, as the command prints it: what the pages say is what runs."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Insert the help as a literal block."""
        name = self.arguments[0]
        settings = {"terminal_width": 100, **program.context_settings}
        group = click.Context(program, info_name="accelcal", **settings)
        command = program.get_command(group, name)
        if command is None:
            raise self.error(f"there is no command {name!r}")
        context = click.Context(command, group, name)
        text = command.get_help(context)
        return [nodes.literal_block(text, text, language="text")]


def skip_fields(*event: object) -> bool | None:
    """Skip the fields of named tuples: their class tells them, they themselves only a number."""
    told = getattr(event[3], "__doc__", None) or ""
    return True if told.startswith("Alias for field") else None


def setup(app: Sphinx) -> None:
    """Register the directive and tables as plain text, bring pages of effects and notebooks."""
    app.connect("autodoc-skip-member", skip_fields)
    app.add_directive("command-help", CommandHelp)
    app.add_lexer("csv", TextLexer)
    write_pages()
    here = Path(__file__).parent
    shutil.rmtree(here / "notebooks", ignore_errors=True)
    shutil.copytree(here.parent / "examples" / "notebooks", here / "notebooks")
