"""The pages keep their word: outputs are those of the commands, links lead somewhere."""

import doctest
import json
import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

import accelcal
from accelcal.cli.program import COMMANDS

ROOT = Path(__file__).parents[1]
REFERENCE = (ROOT / "docs" / "reference.md").read_text("utf-8")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def module(path):
    spec = spec_from_file_location(path.stem, path)
    loaded = module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


real_output = module(ROOT / "docs" / "real_output.py")

SHOWING = [page for page in PAGES if "<!-- run" in page.read_text("utf-8")]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_shows_its_output(command):
    text = (ROOT / "docs" / "commands.md").read_text("utf-8")
    (own,) = re.findall(rf"^## {command}\n(.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE)
    assert f"\n$ accelcal {command} " in own


def test_some_pages_show_output():
    assert {"start.md", "commands.md"} <= {page.name for page in SHOWING}


@pytest.mark.parametrize("page", SHOWING, ids=lambda page: page.name)
def test_output_is_that_of_the_commands(page):
    text = page.read_text("utf-8")
    assert list(real_output.differences(text, real_output.regenerated(text))) == []


def test_another_output_is_seen():
    page = "<!-- run -->\n```console\n$ accelcal --version\naccelcal, version none\n```\n"
    assert list(real_output.differences(page, real_output.regenerated(page)))


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ("K1 1.34601 mA/g", "K1 1.34602 mA/g", True),
        ("K1 1.34601 mA/g", "K1 1.34651 mA/g", False),
        ("54 readings", "55 readings", False),
        ("p = 1e-15", "p = 3e-15", True),
        ("p = 0.3", "p = 0.9", False),
        ("gates passed", "gates failed", False),
        ("a  b", "a b", True),
    ],
)
def test_numbers_may_differ_in_their_last_digit(old, new, same):
    assert real_output.alike(old, new) is same


def test_links_of_pages_lead_somewhere():
    for page in PAGES:
        text = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)
        for target in re.findall(r"\]\((?!https?:)([^)\s]+)\)", text):
            name, _, place = target.partition("#")
            other = (page.parent / name) if name else page
            brought = ROOT / "examples" / name  # notebooks, when the pages are built
            assert other.exists() or brought.exists(), (page, target)
            assert not place or place in anchors(other), (page, target)


def test_no_sentence_of_a_page_was_cut_off():
    """A blank at the end of a line is what a cut leaves."""
    lines = [(page.name, line) for page in PAGES for line in page.read_text("utf-8").splitlines()]
    assert [(page, line) for page, line in lines if line.endswith(" ")] == []


def anchors(page):
    """What headings are called, as MyST and GitHub make it."""
    text = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)
    for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        plain = re.sub(r"[`*]|\]\([^)]*\)|\[", "", heading).lower()
        yield re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")


def code_of(page):
    blocks = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
    return "\n".join(blocks.findall(page.read_text("utf-8")))


@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
@pytest.mark.parametrize("name", ["apply.md", "documents.md", "levels.md", "theory.md"])
def test_examples_of_pages_give_what_they_show(name):
    page = ROOT / "docs" / name
    example = doctest.DocTestParser().get_doctest(code_of(page), {}, name, str(page), 0)
    assert example.examples
    assert doctest.DocTestRunner().run(example).failed == 0


def test_all_pages_with_examples_are_tested():
    """Those of the errata have a test of their own."""
    with_examples = {page.name for page in PAGES if ">>>" in code_of(page)}
    assert with_examples == {"apply.md", "documents.md", "errata.md", "levels.md", "theory.md"}


WITH_NAMES_OF_THEIR_OWN = {"accelcal.plot.style"}  # it needs matplotlib
WITHOUT_ERRATA = [page for page in PAGES if page.name != "errata.md"]  # which opens up the inside


def test_pages_need_public_names_only():
    for page in WITHOUT_ERRATA:
        imported = set(re.findall(r"from (accelcal[.\w]*) import", code_of(page)))
        assert imported - WITH_NAMES_OF_THEIR_OWN <= {"accelcal"}, page
        used = set(re.findall(r"(?<!from )\baccelcal\.(\w+)", code_of(page)))
        assert used <= set(accelcal.__all__), page


def test_pages_import_what_they_use():
    for page in PAGES:
        code = code_of(page)
        for name, line in {"accelcal": "import accelcal", "np": "import numpy as np"}.items():
            first = re.search(rf"(?<!from )(?<![\w.]){name}\.\w", code)
            assert first is None or line in code[: first.start()], (page, line)


def test_every_public_name_is_in_the_reference():
    """By the name that is imported, where it is no value."""
    pages = "".join(page.read_text("utf-8") for page in (ROOT / "docs" / "reference").glob("*.md"))
    listed = re.findall(r"auto(?:function|class|exception):: accelcal\.(\w+)\n", pages)
    values = {"AL15", "__version__"}
    assert sorted(listed) == sorted(set(accelcal.__all__) - values)


def test_the_functions_behind_the_commands_are_public():
    (table,) = re.findall(r"^\| command .*?(?=\n\n)", REFERENCE, re.DOTALL | re.MULTILINE)
    rows = [line.strip("| ").split(" | ") for line in table.splitlines()[2:]]
    assert {re.findall(r"\w+", command)[0] for command, _ in rows} <= set(COMMANDS)
    named = {name for _, functions in rows for name in re.findall(r"`(\w+)`", functions)}
    assert named - {"report", "export", "certificate"} <= set(accelcal.__all__)


def keys_told(heading):
    """Keys in the first column of the table below a heading of the page of documents."""
    text = (ROOT / "docs" / "documents.md").read_text("utf-8")
    own = re.split(r"^#+ ", text.split(f"# {heading}\n")[1], maxsplit=1, flags=re.MULTILINE)[0]
    cells = [line.split(" | ")[0] for line in own.splitlines() if line.startswith("| `")]
    return {key for cell in cells for key in re.findall(r"`(\w+)`", cell)}


def test_the_page_of_documents_has_all_keys():
    hidden = [accelcal.effect("outlier").of(1e-3, reading=17)]
    record = accelcal.simulate(effects=hidden, seed=3)
    calibration = accelcal.fit(record).to_document()
    discovery = accelcal.discover(record).to_document()
    (table, *_), (effect, *_) = calibration["tables"], discovery["effects"]
    told = {
        "A quantity": table["coefficients"]["K1"],
        "A calibration": calibration,
        "Each of `tables`": table,
        "`temperature_model`": calibration["temperature_model"],
        "A discovery": discovery,
        "Each of `effects`": effect,
    }
    assert {heading: keys_told(heading) for heading in told} == {
        heading: set(document) for heading, document in told.items()
    }


effect_pages = module(ROOT / "docs" / "effect_pages.py")


def test_the_list_of_effects_is_that_of_the_catalogue():
    told = (ROOT / "docs" / "effects.md").read_text("utf-8")
    assert effect_pages.with_catalogue(told) == told, "run python docs/effect_pages.py"
    assert told.count("\n### `") == len(accelcal.catalogue())


def test_every_effect_has_a_page(tmp_path):
    some = [accelcal.effect(name) for name in ("scale-factor-asymmetry", "warm-up", "outlier")]
    effect_pages.write_pages(some, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *("outlier.md", "scale-factor-asymmetry.md", "scale-factor-asymmetry.svg"),
        *("warm-up.md", "warm-up.svg"),
    ]
    for effect in accelcal.catalogue():
        assert effect_pages.page(effect).startswith(f"# `{effect.id}`: {effect.name}\n")


def test_pages_of_effects_know_the_designs():
    page = effect_pages.page(accelcal.effect("scale-factor-asymmetry"))
    assert "| 4 | no, absorbed by k2 | | |" in page
    assert "| 8 | yes | [fourth-order](fourth-order.md) |  |" in page
    assert "| 12 | yes |  |  |" in page
    page = effect_pages.page(accelcal.effect("odd-quadratic"))
    assert "| 8 | no, absorbed by K1, k3 | | |" in page
    assert "| 24 | yes |" in page


def test_the_picture_of_the_readme_can_be_made(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setenv("MPLBACKEND", "Agg")
    module(ROOT / "docs" / "gap_picture.py").write(tmp_path / "gap.png")
    assert (tmp_path / "gap.png").read_bytes().startswith(b"\x89PNG")


NOTEBOOKS = ROOT / "examples" / "notebooks"


def cells_of(notebook):
    cells = json.loads(notebook.read_text("utf-8"))["cells"]
    return "\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code")


@pytest.mark.parametrize("notebook", sorted(NOTEBOOKS.glob("*.ipynb")), ids=lambda path: path.stem)
def test_notebooks_need_public_names_only(notebook):
    assert set(re.findall(r"from (accelcal[.\w]*) import", cells_of(notebook))) <= {"accelcal"}
    used = set(re.findall(r"\baccelcal\.(\w+)", cells_of(notebook)))
    assert used
    assert used <= set(accelcal.__all__)


def run_notebook(name):
    """Run the cells of a notebook; return their code and the names that they leave."""
    pytest.importorskip("matplotlib").use("agg")
    pyplot = pytest.importorskip("matplotlib.pyplot")
    code = cells_of(NOTEBOOKS / f"{name}.ipynb")
    left = {}
    exec(compile(code, f"{name}.ipynb", "exec"), left)
    pyplot.close("all")
    return code, left


def test_notebook_of_the_hidden_effect_keeps_its_word():
    _, left = run_notebook("hidden_effect")
    assert [e.id for e in left["found"].effects] == ["hysteresis"]
    warned = [[g.name for g in t.gates if g.verdict == "warn"] for t in left["calibration"].tables]
    assert warned == 3 * [["forward against back"]]
    compare = accelcal.compare
    assert compare(left["calibration"], left["second"]).p_value < 1e-9
    assert compare(left["better"], left["second"]).p_value > 0.05
    without, having = (left[n].tables[0].error_model["k3"] for n in ("calibration", "better"))
    assert abs(without.value - 87e-6) > without.expanded_uncertainty
    assert abs(having.value - 87e-6) < having.expanded_uncertainty


def test_notebook_of_the_real_accelerometer_keeps_its_word():
    _, left = run_notebook("real")
    one, other = (left[n].tables[0].coefficients for n in ("calibration", "other"))
    assert one["K1"].value == pytest.approx(other["K1"].value, rel=1e-12)
    lower = one["K0"].value - other["K0"].value
    assert (round(lower), round(1e3 * lower / one["K1"].value)) == (6, 3)


def test_tour_has_what_it_announces():
    code, left = run_notebook("tour")
    assert "calibration.plot." in code
    assert "accelcal.judge(" in code
    assert left["measured"].inside.all()


def test_notebook_of_the_paper_keeps_its_word():
    _, left = run_notebook("paper")
    assert abs(left["k0"].value - 3.324e-3) < left["k0"].expanded_uncertainty
    assert abs(left["beta"].value - 520e-6) < left["beta"].expanded_uncertainty


def test_notebook_of_the_archive_loses_no_file():
    _, left = run_notebook("archive")
    assert left["frames"].tables["serial"].nunique() + len(left["frames"].errors) == 200
    assert "U107" in set(left["warned"]["serial"])
