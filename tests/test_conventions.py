"""Conventions of the ecosystem: colour, log, completion, wheel, citation."""

import hashlib
import logging
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import yaml

import accelcal
from accelcal.cli.program import COMMANDS

ROOT = Path(__file__).parents[1]
ESCAPE = "\x1b["


def accelcal_process(*arguments, **environment):
    clean = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR")}
    return subprocess.run(
        [sys.executable, "-m", "accelcal", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env=clean | environment,
        check=False,
    )


# -- colour ----------------------------------------------------------------------------------------

JUDGED = ("fit", "examples/al15.csv", "--spec", "examples/al15.toml")


def test_no_colour_in_a_pipe():
    assert ESCAPE not in accelcal_process(*JUDGED).stdout


def test_verdicts_are_coloured_where_colour_is_wanted():
    coloured = accelcal_process(*JUDGED, FORCE_COLOR="1").stdout
    plain = accelcal_process(*JUDGED).stdout
    assert "\x1b[32m\x1b[1mPASS\x1b[0m" in coloured
    assert re.sub(r"\x1b\[[\d;]*m", "", coloured) == plain


def test_warnings_of_a_head_are_coloured():
    coloured = accelcal_process("head", "examples/al15.csv", FORCE_COLOR="1").stdout
    assert "\x1b[33m\x1b[1mWARNING\x1b[0m" in coloured


def test_no_color_wins():
    done = accelcal_process(*JUDGED, FORCE_COLOR="1", NO_COLOR="1")
    assert ESCAPE not in done.stdout


@pytest.mark.parametrize("form", ["json", "csv"])
def test_documents_have_no_colour(form):
    done = accelcal_process(*JUDGED, "--format", form, FORCE_COLOR="1")
    assert ESCAPE not in done.stdout


# -- log -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("told", [{"ACCELCAL_LOG": "1"}, {}], ids=["environment", "option"])
def test_the_log_is_shown_where_it_is_asked_for(told):
    option = [] if told else ["-v"]
    done = accelcal_process("fit", "examples/al15.csv", *option, **told)
    assert re.search(r"^\d\d:\d\d:\d\d read 'examples/al15.csv', serial 'AL-15'", done.stderr, re.M)
    assert "fitting 'examples/al15.csv': 3 tables by least-squares" in done.stderr
    assert done.stdout == accelcal_process("fit", "examples/al15.csv").stdout


def test_nothing_is_logged_unasked():
    assert "fitting" not in accelcal_process("fit", "examples/al15.csv").stderr


def test_a_fit_does_not_import_logging():
    code = "import sys; from accelcal.cli.main import main; main(['fit', 'examples/al15.csv'])"
    code += "; print('logging' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "False"


def test_the_library_logs_by_the_standard_module(caplog):
    with caplog.at_level(logging.INFO, logger="accelcal"):
        accelcal.fit(accelcal.simulate(seed=1))
    assert "3 tables by least-squares" in caplog.text
    assert any(isinstance(h, logging.NullHandler) for h in logging.getLogger("accelcal").handlers)


# -- shell -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_scripts(shell):
    done = accelcal_process(_ACCELCAL_COMPLETE=f"{shell}_source")
    assert done.returncode == 0 or shell == "bash"  # bash must be there, and new enough
    assert "_ACCELCAL_COMPLETE" in done.stdout or "bash" in done.stderr.casefold()


def test_completion_of_commands_and_options():
    found = accelcal_process(
        _ACCELCAL_COMPLETE="zsh_complete", COMP_WORDS="accelcal ", COMP_CWORD="1"
    )
    assert set(COMMANDS) <= set(found.stdout.splitlines())
    found = accelcal_process(
        _ACCELCAL_COMPLETE="zsh_complete", COMP_WORDS="accelcal fit --met", COMP_CWORD="2"
    )
    assert "--method" in found.stdout


@pytest.mark.parametrize("words", ["fit ex", "fit table.csv -o ex", "apply cal.json ex"])
def test_the_shell_completes_names_of_files(words):
    line = f"accelcal {words}"
    found = accelcal_process(
        _ACCELCAL_COMPLETE="bash_complete", COMP_WORDS=line, COMP_CWORD=str(line.count(" "))
    )
    assert found.stdout.split() == ["file,ex"]


def test_the_page_tells_how_to_complete():
    page = (ROOT / "docs" / "commands.md").read_text("utf-8")
    assert "_ACCELCAL_COMPLETE=bash_source accelcal" in page


# -- papers ----------------------------------------------------------------------------------------


def test_the_citation_is_valid():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= set(cited)
    assert cited["cff-version"] == "1.2.0"
    assert cited["type"] == "software"
    assert all({"name"} <= set(a) or {"family-names"} <= set(a) for a in cited["authors"])
    license_text = (ROOT / "LICENSE").read_text("utf-8")
    assert license_text.startswith(f"{cited['license']} License")


def built_wheel(folder):
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-index"),
            *("--no-build-isolation", "--wheel-dir", folder, ROOT),
        ],
        env=os.environ | {"SOURCE_DATE_EPOCH": "1700000000", "PIP_DISABLE_PIP_VERSION_CHECK": "1"},
        check=True,
    )
    return next(Path(folder).glob("accelcal-*.whl"))


def test_wheels_are_built_reproducibly(tmp_path):
    pytest.importorskip("hatchling")
    pytest.importorskip("pip")
    one, other = (built_wheel(tmp_path / name) for name in ("one", "other"))
    sums = {hashlib.sha256(path.read_bytes()).hexdigest() for path in (one, other)}
    assert len(sums) == 1
    names = set(zipfile.ZipFile(one).namelist())
    assert "accelcal/py.typed" in names
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert not any(name.startswith(("tests/", "benchmarks/")) for name in names)
    modules = {p.relative_to(ROOT / "src").as_posix() for p in (ROOT / "src").rglob("*.py")}
    assert modules <= names
