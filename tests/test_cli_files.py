"""The files of the commands: none that is read is written over, and none is written twice."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest

from accelcal.cli.files import FileToRead, FileToWrite
from accelcal.cli.main import main
from accelcal.cli.program import COMMANDS, program

EXAMPLES = Path(__file__).parents[1] / "examples"
FILES = {
    "table.txt": EXAMPLES / "al15.csv",
    "record.txt": EXAMPLES / "stability.csv",
    "sheet.toml": EXAMPLES / "al15.toml",
    "stand.toml": EXAMPLES / "paper-stand.toml",
    "own.toml": EXAMPLES / "effects.toml",
    "lab.toml": EXAMPLES / "laboratory.toml",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("files")
    for name, source in FILES.items():
        (made / name).write_bytes(source.read_bytes())
    assert main(["fit", str(made / "table.txt"), "-o", str(made / "cal.json")]) == 0
    return made


@pytest.fixture
def run(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)

    def command(text):
        before = {path.name: path.read_bytes() for path in folder.iterdir()}
        capsys.readouterr()
        code = main(text.split())
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
        return code, *capsys.readouterr()

    return command


@pytest.mark.parametrize(
    ("command", "written"),
    [
        ("fit table.txt --spec sheet.toml -o sheet.toml", "-o sheet.toml"),
        ("fit table.txt --effects own.toml -o own.toml", "-o own.toml"),
        ("fit table.txt --model cal.json -o cal.json", "-o cal.json"),
        ("fit table.txt --head cal.json -o ./cal.json", "-o ./cal.json"),
        ("fit table.xlsx#AL-15 -o table.xlsx", "-o table.xlsx"),
        ("simulate --model cal.json -o cal.json", "-o cal.json"),
        ("discover table.txt --effects own.toml -o own.toml", "-o own.toml"),
        ("apply cal.json table.txt --effects own.toml -o own.toml", "-o own.toml"),
        ("stability record.txt --scale-factor 1.3 -o record.txt", "-o record.txt"),
        ("stability record.txt --calibration cal.json -o cal.json", "-o cal.json"),
        ("stability record.txt --plot record.txt", "--plot record.txt"),
        ("budget cal.json -o cal.json", "-o cal.json"),
        ("budget cal.json --plot cal.json", "--plot cal.json"),
        ("budget cal.json --stability record.txt -o record.txt", "-o record.txt"),
        ("budget --stand stand.toml -o stand.toml", "-o stand.toml"),
        ("design --effects own.toml -o own.toml", "-o own.toml"),
        ("report cal.json --dcc lab.toml --dcc-data lab.toml", "--dcc lab.toml"),
        ("batch nothing --spec sheet.toml -o sheet.toml", "-o sheet.toml"),
    ],
)
def test_what_is_read_is_not_written_over(run, command, written):
    option = written.split()[0]
    said = f"error: {written} is a file to be read; name another file with {option}\n"
    assert run(command) == (2, "", said)


@pytest.mark.parametrize("command", ["export cal.json", "apply cal.json samples.csv"])
def test_the_table_of_a_calibration_is_not_written_over(tmp_path, monkeypatch, capsys, command):
    """It was lost without a word, as only its calibration was read."""
    monkeypatch.chdir(tmp_path)
    Path("tested.csv").write_bytes(FILES["table.txt"].read_bytes())
    Path("samples.csv").write_text("temperature,output\n20,1.3\n")
    assert main(["fit", "tested.csv", "-o", "cal.json"]) == 0
    capsys.readouterr()
    assert main([*command.split(), "-o", "tested.csv"]) == 2
    assert capsys.readouterr() == (
        "",
        "error: -o tested.csv is the table that the calibration was made from; name another file"
        " with -o\n",
    )
    assert Path("tested.csv").read_bytes() == FILES["table.txt"].read_bytes()
    assert main([*command.split(), "-o", "other.csv"]) == 0


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("fit table.txt -o x.html --report x.html", "--report x.html is that of -o"),
        ("design --positions 8 -o x --sheet ./x", "--sheet ./x is that of -o"),
        ("report cal.json -o x.md --dcc x.md", "--dcc x.md is that of -o"),
        ("history cal.json -o x.png --plot x.png", "--plot x.png is that of -o"),
    ],
)
def test_no_file_is_written_twice(run, command, said):
    assert run(command) == (2, "", f"error: {said}; name another file\n")


@pytest.mark.parametrize(
    "command",
    [
        "fit table.txt {}",
        "discover table.txt {}",
        "head table.txt {}",
        "stability table.txt {} --scale-factor 1.3",
        "history table.txt {}",
        "report table.txt -o x.html --data table.txt --data {}",
        "compare cal.json table.txt --effects table.txt --effects {}",
    ],
)
def test_no_file_is_read_twice(run, command):
    """It counted twice: as a second unit, or as launches of its own."""
    said = "error: table.txt is given twice; name each file once\n"
    assert run(command.format("table.txt")) == (2, "", said)
    said = "error: ./table.txt is the file table.txt; name each file once\n"
    assert run(command.format("./table.txt")) == (2, "", said)


def test_a_file_may_be_read_for_two_things(run):
    assert run("compare cal.json cal.json --format json")[0] == 0


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("fit table.txt --format csv -o x.csv", "x.csv would hold JSON; end its name in .json"),
        ("fit table.txt -o x.json.gz", "x.json.gz would hold JSON; end its name in .json"),
        ("discover table.txt -o x.html", "x.html would hold JSON; end its name in .json"),
        ("stability record.txt -o x.CSV", "x.CSV would hold JSON; end its name in .json"),
        ("simulate -o x.parquet", "x.parquet would hold CSV; end its name in .csv or .gz"),
        ("simulate -o x.xlsx", "x.xlsx would hold CSV; end its name in .csv or .gz"),
        ("fit table.txt -o x.xlsm", "x.xlsm would hold JSON; end its name in .json"),
        ("fit x.xlsx#1 -o x.xlsx#1", "x.xlsx#1 would hold JSON; end its name in .json"),
        (
            "apply cal.json table.txt -o x.json",
            "x.json would hold CSV; end its name in .csv or .gz",
        ),
    ],
)
def test_no_file_has_a_name_that_promises_another_form(run, command, said):
    assert run(command) == (2, "", f"error: -o {said}\n")


@pytest.mark.parametrize(
    ("command", "ends"),
    [
        ("fit nothing.csv --report x.docx", ".html, .md, .pdf"),
        ("discover nothing.csv --report -", ".html, .md, .pdf"),
        ("stability nothing.csv --plot x.gif", ".png, .svg, .pdf"),
        ("history nothing.csv --plot x", ".png, .svg, .pdf"),
        ("budget nothing.json --plot png", ".png, .svg, .pdf"),
        ("design --optimal D --plot x.jpeg", ".png, .svg, .pdf"),
        ("head nothing.csv --plot x.jpg", ".png, .svg, .pdf"),
        ("triad nothing.csv --plot x.jpg", ".png, .svg, .pdf"),
    ],
)
def test_a_name_that_tells_no_form_is_refused_before_the_work(run, command, ends):
    name = command.split()[-1]
    said = f"error: {name}: the name ends in none of {ends}; choose one\n"
    assert run(command) == (2, "", said)


def test_devices_take_several_outputs(run):
    assert run("design --positions 8 --strokes 2 -o /dev/null --sheet /dev/null")[0] == 0


def test_a_name_without_a_known_end_is_taken(folder, capsys):
    assert main(["fit", str(folder / "table.txt"), "-o", str(folder / "cal.2024")]) == 0
    assert (folder / "cal.2024").read_bytes() == (folder / "cal.json").read_bytes()
    (folder / "cal.2024").unlink()
    capsys.readouterr()


@pytest.mark.parametrize("name", COMMANDS)
def test_every_file_of_a_command_is_known_as_one(name):
    """What the help shows as a file is looked at; a batch looks at its archive by itself."""
    command = program.get_command(click.Context(program), name)
    for param in command.params:
        shown = param.metavar or ""
        if re.search(r"^(DATA|RESULTS|FILE)(\.|$)|\.(csv|json|toml|xml|\()", shown):
            known = isinstance(param.type, FileToRead | FileToWrite)
            assert known, (param.name, shown)


@pytest.mark.parametrize(
    "arguments", [["fit", ""], ["apply", "", "a.csv"], ["history", ""]], ids=str
)
def test_an_empty_name_is_shown(capsys, arguments):
    assert main(arguments) == 2
    assert capsys.readouterr().err.startswith("'': no such file; give the path of a ")
