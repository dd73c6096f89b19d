"""The README keeps its word: its lines are the ones that run, its links lead somewhere."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from accelcal.cli.program import COMMANDS

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")


def marked(name):
    """Lines of the fenced block behind the comment that marks it for .ci/run."""
    block = re.search(
        rf"^<!-- ci: {name} -->\n```\w+\n(.*?)^```$", README, re.DOTALL | re.MULTILINE
    )
    assert block, f"README.md has no block marked {name}"
    return block[1].splitlines()


@pytest.mark.parametrize("name", ["fit", "test"])
def test_a_set_up_is_one_line(name):
    (line,) = marked(name)
    assert line.startswith("python3 -m venv .venv && ")


def test_the_fit_of_the_set_up_is_a_command_line_that_works():
    (line,) = marked("fit")
    program, *arguments = line.rpartition("&& ")[2].split()
    assert program == ".venv/bin/accelcal"
    done = subprocess.run(
        [sys.executable, "-m", "accelcal", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "K1" in done.stdout


def test_the_library_example_runs(tmp_path, monkeypatch, capsys):
    code = marked("library")
    assert len([line for line in code if line]) == 4
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    exec("\n".join(code), {})
    assert "K1" in capsys.readouterr().out
    assert [path.name for path in tmp_path.glob("*.json")] == ["al15.json"]


def test_links_lead_somewhere():
    links = re.findall(r"\]\((?!https?:)([^)#]+)", README)
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_the_table_of_commands_is_complete():
    told = re.findall(r"^\| `accelcal (\w+)", README, re.MULTILINE)
    assert sorted(told) == sorted(COMMANDS)


def test_the_extras_are_told():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    told = re.findall(r"^\| `(\w+)` \|", README, re.MULTILINE)
    assert sorted(told) == sorted(project["optional-dependencies"])


def test_every_page_of_prose_is_linked():
    """A page that is made of directives is empty where it is not built, and is not linked."""
    pages = {path.name: path.read_text("utf-8") for path in (ROOT / "docs").glob("*.md")}
    made = ("{eval-rst}", "{command-help}", "{include}")
    prose = {name for name, text in pages.items() if not any(word in text for word in made)}
    prose.remove("index.md")
    assert set(re.findall(r"\(docs/([\w-]+\.md)\)", README)) == prose
