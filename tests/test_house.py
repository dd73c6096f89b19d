"""The house in order: who imports whom, how long things are, what starts up, what is told."""

import ast
import builtins
import doctest
import inspect
import re
import subprocess
import sys
import tomllib
from collections import Counter
from functools import cache
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path

import click
import pytest

import accelcal
from accelcal.cli.program import COMMANDS, program
from accelcal.geometry import MOUNTINGS
from accelcal.stand_uncertainty.readings import StandConditions

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "accelcal"
MODULES = sorted(SOURCE.rglob("*.py"))
PACKAGES = sorted(SOURCE.glob("*/**/__init__.py"))
ROOMS = sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))
LIBRARY = [path for path in MODULES if path.relative_to(SOURCE).parts[0] != "cli"]

FLOORS = (
    {"__init__", "__main__"},
    {"cli"},
    {"page", "certificate"},
    {"plot"},
    {"report", "export"},
    {"archive"},
    {"io"},
    {"planning"},
    {"calibrate"},
    {"discovery"},
    {
        "gates",
        "temperature",
        "simulation",
        "verdict",
        "stability",
        "error_budget",
        "stand_uncertainty",
        "triad",
        "recalibrations",
    },
    {"compensate"},
    {"estimate", "effects"},
    {"printed"},
    {"reference"},
    {"record", "results", "specification", "accelerometer"},
    {"model"},
    {"geometry", "head_angles", "apparatus", "pace", "serials", "targets", "shown_units"},
    {"units", "numerics", "atomic", "sentences", "arguments", "dates"},
    {"errors", "version", "logs", "plural", "arrays", "frozen_mapping"},
    {"escapes"},
)
"""The rooms, top floor first. Imports point downwards, and never to a room of the same floor."""

SHOWN = {(room, "report") for room in ("results", "record", "effects")}
SHOWN |= {("results", room) for room in ("plot", "page", "export", "certificate")}
"""A result shows itself: it may reach these rooms from below, inside a function only."""

FLOOR_OF = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}

LONGEST_MODULE = 400
LONGEST_FUNCTION = 40

HEAVY = {"numpy", "numpy.ma", "pandas", "scipy", "matplotlib", "importlib.metadata"}


def name_of(path):
    return path.relative_to(ROOT).as_posix()


@cache
def text_of(path):
    return path.read_text(encoding="utf-8")


@cache
def tree_of(path):
    return ast.parse(text_of(path))


def room_of(module):
    """The room of ``accelcal.io.files.text`` is io, that of ``accelcal`` itself ``__init__``."""
    return [*module.split("."), "__init__"][1]


def imported_modules(nodes):
    """Modules of accelcal that are imported by some nodes of a syntax tree."""
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if room_is_ours(alias.name))
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports name the whole path"
            if node.module == "accelcal":
                yield from (f"accelcal.{alias.name}" for alias in node.names)
            elif room_is_ours(node.module):
                yield node.module


def room_is_ours(module):
    return module.split(".")[0] == "accelcal"


def functions_of(path):
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def wrong_in(paths, rule):
    """What a rule finds wrong, by the names of the modules where it finds something."""
    found = {name_of(path): list(rule(path)) for path in paths}
    return {name: wrong for name, wrong in found.items() if wrong}


def lines_of_body(function):
    """Lines behind the signature and the docstring, which are as long as there is to tell."""
    statements = function.body[1:] if ast.get_docstring(function) else function.body
    return statements[-1].end_lineno - statements[0].lineno + 1 if statements else 0


# -- rooms -----------------------------------------------------------------------------------------


def upward(path):
    """Modules that a module imports and that are not below it."""
    room = path.relative_to(SOURCE).parts[0].removesuffix(".py")
    tree = tree_of(path)
    at_the_top = set(imported_modules(tree.body))
    for module in imported_modules(ast.walk(tree)):
        other = room_of(module)
        allowed = other == room or FLOOR_OF[other] > FLOOR_OF[room]
        if module not in at_the_top:
            allowed |= (room, other) in SHOWN
        if not allowed:
            yield module


def test_imports_point_downwards():
    rooms = {path.relative_to(SOURCE).parts[0].removesuffix(".py") for path in MODULES}
    assert rooms == {*FLOOR_OF}
    assert wrong_in(MODULES, upward) == {}


@pytest.mark.parametrize("room", ROOMS)
def test_no_way_leads_out_of_a_part_of_a_room_and_back(room):
    """The parts of a room are its modules and its packages, each package as a whole."""
    ways = {}
    for path in sorted((SOURCE / room).rglob("*.py")):
        part = path.relative_to(SOURCE / room).parts[0].removesuffix(".py")
        modules = [module.split(".") for module in imported_modules(tree_of(path).body)]
        used = {names[2] for names in modules if names[1] == room and len(names) > 2}
        ways.setdefault(part, set()).update(used - {part})
    TopologicalSorter(ways).prepare()  # CycleError: parts that import each other


def test_the_page_on_the_structure_has_the_floors():
    page = (ROOT / "docs" / "structure.md").read_text("utf-8")
    rows = [line.split(" | ")[0] for line in page.splitlines() if line.startswith("| `")]
    assert [set(re.findall(r"`(\w+)`", rooms)) for rooms in rows] == list(FLOORS)


def test_the_page_on_the_structure_names_what_there_is():
    page = (ROOT / "docs" / "structure.md").read_text("utf-8")
    rooms = "|".join(set.union(*FLOORS))
    named = re.findall(rf"`((?:{rooms})\.\w+)(?:\.(\w+))?`", page)
    assert len(named) > 15
    for module, name in named:
        home = import_module(f"accelcal.{module}")
        assert not name or hasattr(home, name)


@pytest.mark.parametrize("path", PACKAGES, ids=name_of)
def test_packages_hold_only_a_docstring_that_names_modules_that_there_are(path):
    tree = tree_of(path)
    assert len(tree.body) == 1
    have = {item.stem for item in path.parent.iterdir()}
    named = re.findall(r"(?<!`)`([a-z]\w*)(?:\.\w+)*`(?!`)", ast.get_docstring(tree))
    assert set(named) - have <= {"accelcal"}


def test_library_does_not_import_click():
    imported = re.compile(r"^\s*(?:import|from) click\b", re.MULTILINE)
    assert wrong_in(LIBRARY, lambda path: imported.findall(text_of(path))) == {}


SHARED_BY_THREADS = {
    *("catch_warnings", "simplefilter", "filterwarnings"),
    *("redirect_stdout", "redirect_stderr", "chdir", "setlocale", "seterr", "set_option"),
}


def test_library_changes_nothing_that_threads_share():
    """What such a thing puts back in the end is what another thread has just changed."""

    def changed(path):
        nodes = list(ast.walk(tree_of(path)))
        used = {node.id for node in nodes if isinstance(node, ast.Name)}
        used |= {node.attr for node in nodes if isinstance(node, ast.Attribute)}
        return used & SHARED_BY_THREADS

    assert wrong_in(LIBRARY, changed) == {}


def test_no_attic():
    attic = {"util", "utils", "helper", "helpers", "misc", "common", "tools", "stuff", "shared"}
    attic |= {"old", "new", "backup", "temp", "tmp", "legacy", "deprecated", "v2"}
    words = {name_of(path): set(re.split(r"[_/]", path.stem)) for path in MODULES}
    assert {path: found & attic for path, found in words.items() if found & attic} == {}


# -- lengths ---------------------------------------------------------------------------------------


def test_modules_are_short():
    lengths = {name_of(path): len(text_of(path).splitlines()) for path in MODULES}
    assert {name: n for name, n in lengths.items() if n > LONGEST_MODULE} == {}


def test_functions_are_short():
    def long(path):
        return [f.name for f in functions_of(path) if lines_of_body(f) > LONGEST_FUNCTION]

    assert wrong_in(MODULES, long) == {}


# -- public names ----------------------------------------------------------------------------------


HOMES = {
    name: getattr(accelcal, name).__module__ for name in accelcal.__all__ if name != "__version__"
}
"""Public name -> the module where it lives."""


def test_public_names_resolve():
    homes = {name: import_module(home) for name, home in HOMES.items()}
    assert [n for n, home in homes.items() if getattr(accelcal, n) is not getattr(home, n)] == []
    assert [n for n, home in homes.items() if n not in home.__all__] == []


def test_names_are_listed_where_they_are_public_or_in_the_reference():
    pages = "".join(page.read_text("utf-8") for page in (ROOT / "docs").rglob("*.md"))
    shown = {*re.findall(r"automodule:: ([\w.]+)", pages), *HOMES.values()}
    paths = {path for path in MODULES if path.stem != "__init__"}
    dotted = {
        path: ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts) for path in paths
    }
    listing = {dotted[path] for path in paths if "\n__all__ = " in path.read_text("utf-8")}
    assert listing == shown - {"accelcal"}


def public_functions():
    """Public functions, and the methods of public classes, by their names."""
    for name in HOMES:
        value = getattr(accelcal, name)
        if inspect.isfunction(value):
            yield name, value
        for own, method in vars(value).items() if inspect.isclass(value) else ():
            if inspect.isfunction(method) and not own.startswith("_"):
                yield f"{name}.{own}", method


SYNONYMS = {
    "outputs": "output",
    "angle_deg": "angle",
    "gravity": "local_gravity",
    "at_reference": "at_T0",
    "file": "target, path or source",
}
"""Name that no parameter has -> the one for the same."""


def test_one_idea_has_one_name():
    called = dict(public_functions())
    own = {name: getattr(accelcal, name) for name in HOMES}
    kinds = {name: kind for name, kind in own.items() if inspect.isclass(kind)}
    called |= {name: kind for name, kind in kinds.items() if hasattr(kind, "__match_args__")}
    called["StandConditions"] = StandConditions
    found = {n: {*inspect.signature(each).parameters} & {*SYNONYMS} for n, each in called.items()}
    assert {name: names for name, names in found.items() if names} == {}
    assert "output" not in inspect.signature(accelcal.write_batch).parameters
    assert inspect.signature(accelcal.design_matrix).parameters["mounting"].default in MOUNTINGS


def untold(function):
    """Parameters that the docstring of a function says nothing of."""
    told = inspect.getdoc(function).partition("Parameters\n---")[2].partition("\nReturns\n")[0]
    asked = [name for name in inspect.signature(function).parameters if name != "self"]
    return [name for name in asked if not re.search(rf"\b{name}\b", told)]


def test_public_functions_tell_their_parameters():
    found = {name: untold(function) for name, function in public_functions()}
    assert len(found) > 100
    assert {name: missing for name, missing in found.items() if missing} == {}


def test_public_names_have_an_example():
    found = {name: getattr(accelcal, name) for name in HOMES}
    bare = {name for name, value in found.items() if ">>> " not in (inspect.getdoc(value) or "")}
    assert bare == set()


def examples_of(kind):
    """Examples of a class and of its methods, or of a function, each as one text."""
    parts = [kind, *vars(kind).values()] if inspect.isclass(kind) else [kind]
    told = [inspect.unwrap(getattr(part, "__func__", part)).__doc__ or "" for part in parts]
    parse = doctest.DocTestParser().get_examples
    return ["".join(example.source for example in parse(text)) for text in told if text]


def unknown_names(source):
    """Names that an example uses and that neither it nor Python has."""
    nodes = list(ast.walk(ast.parse(source)))
    known = set(dir(builtins))
    for part in nodes:
        if isinstance(part, ast.alias):
            known.add((part.asname or part.name).split(".")[0])
        if isinstance(part, ast.ExceptHandler):
            known.add(part.name)
        if isinstance(part, ast.arg):
            known.add(part.arg)
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store):
            known.add(part.id)
    return {part.id for part in nodes if isinstance(part, ast.Name)} - known


def test_examples_of_public_names_run_where_they_are_pasted():
    """They import what they use: who reads `help` has the names of no module but Python's."""
    called = {name: kind for name in HOMES if callable(kind := getattr(accelcal, name))}
    unknown = {n: set().union(*map(unknown_names, examples_of(k))) for n, k in called.items()}
    assert {name: names for name, names in unknown.items() if names} == {}


def test_no_public_name_is_a_module():
    """A module would take the place of the name when somebody imports it."""
    assert {path.stem for path in SOURCE.glob("*.py")}.isdisjoint(accelcal.__all__)
    assert {path.name for path in SOURCE.iterdir()}.isdisjoint(accelcal.__all__)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nosuch"):
        accelcal.nosuch  # noqa: B018


# -- start-up --------------------------------------------------------------------------------------


def loaded_by(code, *arguments):
    """Heavy modules that a fresh interpreter has loaded after some code, and had not before."""
    script = f"import sys; before = set(sys.modules)\n{code}\nprint(set(sys.modules) - before)"
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return ast.literal_eval(done.stdout.splitlines()[-1])


RUN = "from accelcal.cli.main import main; assert main(sys.argv[1:]) == 0"


def test_import_is_light():
    assert loaded_by("import accelcal") & (HEAVY | {"click"}) == set()


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["fit", "--help"]], ids=" ".join)
def test_help_is_light(arguments):
    assert loaded_by(RUN, *arguments) & (HEAVY | {"pathlib", "click.shell_completion"}) == set()


@pytest.mark.parametrize(
    "table", ["al15.csv", "forms/wide.csv", "forms/positions_across.csv", "forms/decimal_comma.csv"]
)
def test_fit_is_light(table, tmp_path):
    loaded = loaded_by(RUN, "fit", f"examples/{table}", "-o", str(tmp_path / "cal.json"))
    assert "numpy" in loaded
    assert loaded & (HEAVY - {"numpy"}) == set()
    assert "_hashlib" not in loaded  # OpenSSL
    of_others = {"accelcal.results.findings", "accelcal.results.head_calibration"}
    assert loaded & of_others == set()  # what other commands find


# -- commands --------------------------------------------------------------------------------------


@pytest.fixture(params=COMMANDS)
def command(request):
    return program.get_command(click.Context(program), request.param)


def test_command_has_its_name_and_help(command):
    assert command.name in COMMANDS
    assert command.get_short_help_str()
    for option in command.params:
        if isinstance(option, click.Option):
            assert option.help, f"{command.name} {option.opts[0]} has no help"


def test_command_is_documented(command):
    pages = (ROOT / "docs" / "commands.md").read_text("utf-8")
    assert f"```{{command-help}} {command.name}\n" in pages
    assert f"`accelcal {command.name} " in (ROOT / "README.md").read_text("utf-8")


def test_every_command_file_is_a_command():
    shared = {
        "__init__",
        "deliver",
        "files",
        "fit_arguments",
        "forms",
        "main",
        "options",
        "program",
        "stand_budget",
        "values",
        "verdicts",
    }
    assert {path.stem for path in (SOURCE / "cli").glob("*.py")} - shared == set(COMMANDS)


# -- papers ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def test_citation_has_the_version():
    text = (ROOT / "CITATION.cff").read_text("utf-8")
    assert re.findall(r"^version: (.+)$", text, re.MULTILINE) == [accelcal.__version__]


def test_changelog_starts_with_the_version():
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    assert re.findall(r"^## (\S+)", text, re.MULTILINE)[0] == accelcal.__version__


def test_version_has_one_source(project):
    assert project["dynamic"] == ["version"]
    written = [name_of(p) for p in MODULES if accelcal.__version__ in p.read_text("utf-8")]
    assert written == ["src/accelcal/version.py"]


def test_classifiers_are_sane(project):
    classifiers = project["classifiers"]
    assert max(Counter(classifiers).values()) == 1
    assert classifiers == sorted(classifiers)
    versions = [item.split(" :: ")[-1] for item in classifiers if re.search(r":: 3\.\d+$", item)]
    assert project["requires-python"] == f">={versions[0]}"
    assert ("Typing :: Typed" in classifiers) == (SOURCE / "py.typed").exists()
    assert not any(item.startswith("License ::") for item in classifiers), "SPDX has taken over"


def files_of_the_project():
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    names = listed.stdout.split("\0") if listed.returncode == 0 else [name_of(p) for p in MODULES]
    return [ROOT / name for name in names if name and (ROOT / name).is_file()]


OF_A_MACHINE = re.compile(
    "|".join(
        [rf"(?<![\w.])/{folder}/" for folder in ("work", "root", "home", "tmp", "opt")]
        + [rf"{word}\b" for word in ("python" + "hosted", "index" + "-url")]
    )
)


def test_nothing_names_a_machine():
    found = {
        name_of(path): match[0]
        for path in files_of_the_project()
        if (match := OF_A_MACHINE.search(path.read_text("utf-8", errors="replace")))
    }
    assert found == {}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("see /{}/main/x.py".format("work"), True),
        ("https://files.python{}.org/".format("hosted"), True),
        ("--index{} https://mirror".format("-url"), True),
        ("docs/work/plan.md", False),
    ],
)
def test_names_of_a_machine_are_found(text, found):
    assert bool(OF_A_MACHINE.search(text)) is found
