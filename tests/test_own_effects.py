"""Effects of a user's own: registered, read from a file, simulated and found again."""

import json
import pickle
import re
import shutil
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

import accelcal
from accelcal.cli.main import main
from accelcal.effects.catalogue import registered
from accelcal.effects.conditions import conditions_of
from accelcal.effects.formula import FUNCTIONS, SYMBOLS, Formula
from accelcal.errors import InputError, TableError
from accelcal.simulation import NOISE_FREE

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / "effects.toml"
PAGE = (ROOT / "docs" / "effects.md").read_text("utf-8")
BUILT_IN = accelcal.catalogue()


def lens(c, width):
    """A hysteresis that the catalogue has not: its width falls with the square of sin th."""
    return -width * c.rotation * c.cross * np.abs(c.cross)


def own(**changes):
    entry = {
        "id": "lens",
        "name": "lens hysteresis",
        "physics": "The loop is a lens.",
        "formula": "-w r a_p |a_p|",
        "parameters": (accelcal.Parameter("width", "g", "width w"),),
        "term": lens,
    }
    return accelcal.Effect(**(entry | changes))


@pytest.fixture(autouse=True)
def clean():
    yield
    assert accelcal.catalogue() == BUILT_IN


# -- making ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"term": lambda width, c: width * c.input},
            r"lens: term\(width, c\) has multiple values for argument 'width';"
            r" it is called as term\(conditions, width\)",
        ),
        ({"term": lambda c, w: w * c.input}, r"missing a required argument: 'w'"),
        ({"term": lambda c: c.input}, r"unexpected keyword argument 'width'"),
        ({"bend": lambda: 1.0}, r"lens: bend\(\) has too many positional arguments"),
    ],
)
def test_a_function_that_does_not_take_its_parameters_is_told_at_once(changes, message):
    with pytest.raises(InputError, match=message):
        own(**changes)


def test_a_function_that_takes_any_parameter_is_taken():
    lean = own(term=lambda c, **values: values["width"] * c.input)
    assert accelcal.simulate(effects=[lean.of(1e-4)], seed=1).output.size == 162


def test_a_size_that_was_checked_stays():
    given = {"width": 1e-4}
    disturbance = accelcal.Disturbance(own(), given)
    given["width"] = -1.0
    assert disturbance.values == {"width": 1e-4}
    with pytest.raises(TypeError, match="stays as it is; change a copy"):
        disturbance.values["width"] = -1.0
    assert {disturbance, own().of(1e-4)} == {disturbance}
    assert pickle.loads(pickle.dumps(disturbance)) == disturbance


# -- registering -----------------------------------------------------------------------------------


def test_a_registered_effect_is_in_the_catalogue_until_it_is_taken_out():
    accelcal.register(own())
    assert [entry.id for entry in accelcal.catalogue()] == [*(e.id for e in BUILT_IN), "lens"]
    assert accelcal.effect("lens") == own()
    accelcal.unregister("lens")
    with pytest.raises(InputError, match="'lens' is not in the catalogue"):
        accelcal.effect("lens")


def test_a_registered_effect_is_simulated_and_found():
    with registered(own()):
        record = accelcal.simulate(effects=[accelcal.effect("lens").of(5e-5)], seed=1)
        found = accelcal.discover(record)
        told = str(found)
    assert [item.id for item in found.effects] == ["lens"]
    width = found.effects[0].parameters["width"]
    assert abs(width.value - 5e-5) < 4 * width.standard_uncertainty
    assert "The loop is a lens." in told
    assert {item.id for item in accelcal.discover(record).effects} & {"lens"} == set()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"id": "warm-up"}, "id 'warm-up' is in the catalogue already; choose another"),
        ({"id": "My effect"}, "id 'My effect' is none; it has small letters"),
        ({"acts_on": "head"}, "acts_on 'head' is unknown; choose from angle, temperature"),
        ({"parameters": ()}, "lens: parameters are []; there are some"),
        (
            {"parameters": (accelcal.Parameter("w", "g", "w", 1.0),)},
            "lens: w has a default; the first parameter has none",
        ),
        (
            {"parameters": (accelcal.Parameter("w", "g", "w"), accelcal.Parameter("v", "g", "v"))},
            "lens: v has no default; all but the first have one",
        ),
    ],
)
def test_what_cannot_join_is_refused(changes, message):
    with pytest.raises(InputError) as caught:
        accelcal.register(own(id="first"), own(term=lambda c, **_: c.input, **changes))
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("acts_on", ["Output", None, ["output"]])
def test_what_an_effect_acts_on_is_checked_without_the_catalogue(acts_on):
    """Nothing would be simulated of an effect on something unknown, and no word said."""
    with pytest.raises(InputError, match=r"^acts_on .* is unknown; choose from angle, temp"):
        own(acts_on=acts_on)


def test_an_id_is_registered_once():
    with pytest.raises(InputError, match="'lens' is given twice"):
        accelcal.register(own(), own())
    with registered(own()), pytest.raises(InputError, match="already; choose another, or unreg"):
        accelcal.register(own())


def test_what_is_no_effect_is_refused():
    with pytest.raises(InputError, match="int in place of an effect; make one by"):
        accelcal.register(5)


def test_a_built_in_effect_stays():
    with pytest.raises(InputError, match="'warm-up' is built in"):
        accelcal.unregister("warm-up")


def test_a_registered_effect_pickles_with_its_term():
    with registered(own()):
        packed = pickle.dumps(accelcal.effect("lens").of(1e-5))
    again = pickle.loads(packed)  # as a process does that has not registered it
    assert again.effect == own()
    assert again.values == {"width": 1e-5}


@pytest.mark.parametrize(
    ("term", "message"),
    [
        (lambda _, width: width, r"lens: the term has shape \(\); it has one value for each of"),
        (lambda c, width: width / c.time, r"lens: the term is inf at -?\S+ deg; it has a finite"),
    ],
)
def test_a_term_without_a_value_for_each_reading_is_told(term, message):
    with np.errstate(divide="ignore"), pytest.raises(InputError, match=message):
        accelcal.simulate(effects=[own(term=term).of(1.0)], seed=1)


def test_a_term_that_asks_for_what_is_not_there_is_told_what_there_is():
    term = own(term=lambda c, width: width * c.a_i)
    told = "conditions have no 'a_i'; they have number, angle, input, cross, axial, excess, "
    with pytest.raises(AttributeError, match=told):
        accelcal.simulate(effects=[term.of(1e-5)], seed=1)


def test_a_term_cannot_change_what_the_others_are_told():
    def careless(c, width):
        level = c.input
        level -= level.mean()
        return width * level

    with pytest.raises(ValueError, match="read-only"):
        accelcal.simulate(effects=[own(term=careless).of(1e-5)], seed=1)


def test_an_effect_that_is_not_registered_is_told_by_its_name(tmp_path):
    """It may be searched all the same, and a file of a discovery may tell of it."""
    record = accelcal.simulate(effects=[own().of(5e-5)], seed=1)
    found = accelcal.discover(record, effects=[own()])
    again = accelcal.Discovery.from_json(found.to_json())
    for each in (found, again):
        assert "Lens hysteresis  [lens], chance of noise" in str(each)
        told = " ".join(str(each).split())
        assert "of your own that is not registered here. accelcal.register, or --effects" in told
    found.report(tmp_path / "found.md")
    assert "not registered here" in (tmp_path / "found.md").read_text("utf-8")
    with registered(own()):
        assert "The loop is a lens." in str(again)
        assert "not registered" not in str(again)


# -- formulas --------------------------------------------------------------------------------------

CONDITIONS = conditions_of(accelcal.simulate(accelcal.AL15, noise=NOISE_FREE, seed=1), 20.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a_i * abs(a_i)", lambda c: c.input * np.abs(c.input)),
        ("-a_p^2 + 1", lambda c: 1 - c.cross**2),
        ("2 ** 3 * r", lambda c: 8 * c.rotation),
        ("sin(3*th) - cos(theta)", lambda c: np.sin(3 * th(c)) - np.cos(th(c))),
        ("max(dT - 10, 0) + min(dT, -10)", lambda c: shifted(c.excess)),
        ("exp(-t_run / 600)", lambda c: np.exp(-c.run_time / 600)),
        ("sqrt(t) * sign(a_i) * h", lambda c: np.sqrt(c.time) * np.sign(c.input) * c.heating),
        ("a_i\n  + pi", lambda c: c.input + np.pi),
        ("2", lambda c: np.full(c.angle.size, 2.0)),
    ],
)
def test_formulas_are_those_of_numpy(text, expected):
    found = Formula(text)(CONDITIONS, coefficient=3.0)
    np.testing.assert_allclose(found, 3.0 * expected(CONDITIONS), rtol=1e-14, atol=1e-14)


def th(c):
    return np.radians(c.angle)


def shifted(dT):
    return np.maximum(dT - 10, 0) + np.minimum(dT, -10)


HOSTILE = [
    "__import__('os').system('touch harm')",
    "().__class__.__bases__[0].__subclasses__()",
    "a_i.__class__",
    "open('x')",
    "eval('1')",
    "[a_i for a_i in (1, 2)]",
    "(lambda: 1)()",
    "f'{a_i}'",
    "'text'",
    "1j",
    "1e999",
    "True",
    "None",
    "a_i if a_p else 1",
    "a_i > 0",
    "a_i and a_p",
    "(x := 1)",
    "abs",
    "abs(a_i, a_p)",
    "max(a_i)",
    "abs(*a_i)",
    "abs(x=a_i)",
    "a_i(1)",
    "K1 * a_i",
    "a_i | a_p",
    "~1",
    "9" * 400,
    "(" * 250 + "1" + ")" * 250,
    "-" * 298 + "1 +",
    "a_i +",
    "a_i; a_p",
    "",
    "\0",
]


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_anything_else_is_refused_in_one_line(text):
    with pytest.raises(InputError) as caught:
        Formula(text)
    message = str(caught.value)
    assert message.startswith("formula ")
    assert "; " in message
    assert "\n" not in message


def test_a_formula_as_deep_as_it_may_be_is_evaluated():
    assert Formula("-" * 298 + "1")(CONDITIONS)[0] == 1.0


def test_a_tower_of_powers_costs_nothing():
    assert not np.isfinite(Formula("9^9^9^9^9")(CONDITIONS)).any()


def test_a_formula_without_a_value_is_told_where_it_is_used():
    entry = accelcal.read_effects(StringIO(toml(formula='"sqrt(a_i)"')))[0]
    with pytest.raises(InputError, match="mine: the term is nan at 135 deg"):
        accelcal.simulate(effects=[entry.of(1e-5)], seed=1)


# -- files -----------------------------------------------------------------------------------------


def toml(**values):
    entry = {"id": '"mine"', "name": '"n"', "physics": '"p."', "formula": '"a_i^5"'} | values
    lines = [f"{key} = {value}" for key, value in entry.items() if value is not None]
    return "\n".join(["# effects", "[[effect]]", *lines, ""])


def test_an_effect_of_a_file_has_what_the_file_says():
    text = toml(unit='"rad"', acts_on='"angle"', signature='"s."', to_tell_apart='"x"')
    (entry,) = accelcal.read_effects(StringIO(text))
    assert (entry.id, entry.name, entry.physics) == ("mine", "n", "p.")
    assert (entry.acts_on, entry.signature, entry.to_tell_apart) == ("angle", "s.", "x")
    assert [(item.name, item.unit) for item in entry.parameters] == [("coefficient", "rad")]
    assert pickle.loads(pickle.dumps(entry)) == entry


def test_texts_may_run_over_lines():
    (entry,) = accelcal.read_effects(
        StringIO(
            toml(
                physics="""'''One,
      two.'''""",
                formula="""'''
      a_i
      + a_p'''""",
            )
        )
    )
    assert (entry.physics, entry.formula) == ("One, two.", "c (a_i + a_p)")


@pytest.mark.parametrize(
    ("acts_on", "unit"), [("output", "g"), ("angle", "rad"), ("temperature", "degC")]
)
def test_the_unit_is_that_of_what_an_effect_adds_to(acts_on, unit):
    (entry,) = accelcal.read_effects(StringIO(toml(acts_on=f'"{acts_on}"')))
    assert entry.parameters[0].unit == unit


SECOND = toml() + toml(id='"other"', formula='"a_i +"')


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", None, "no [[effect]]; begin each effect"),
        ("effect = 3", None, "no [[effect]]"),
        ("effect = [3]", None, "no [[effect]]"),
        (toml() + "[other]\n", None, "key 'other' is unknown"),
        (toml(id="mine"), 3, "not TOML"),
        (toml(id="3"), 3, "id is 3; it is a text in quotes"),
        (toml(id='"warm-up"'), 3, "id 'warm-up' is in the catalogue already; choose another"),
        (toml(id='"a=b"'), 3, "id 'a=b' is none"),
        (toml(physics=None), 2, "key 'physics' is missing; add physics = ..."),
        (toml(formula='"abs(a_x)"'), 6, "formula has 'a_x'; it takes numbers, a_i"),
        (toml(acts_on='"readings"'), 7, "acts_on is 'readings'; it is one of output, angle"),
        (toml(term='"x"'), 7, "key 'term' is unknown; there are id, name"),
        (toml(static='"yes"'), 7, "static is 'yes'; it is true or false"),
        (
            toml(formula='"r * sin(theta) * t"', static="true"),
            7,
            "static is true, but the formula has r, t, th; a static effect has a_i, a_p and dT",
        ),
        (toml(acts_on='"angle"', static="true"), 3, "mine: static, and acts on the angle; leave"),
        (SECOND, 12, "formula 'a_i +' is none"),
        (toml() + toml(), 9, "id 'mine' is there twice; choose another"),
        ('effect = [{id = "mine"}]', None, "key 'name' is missing"),
    ],
)
def test_a_fault_of_a_file_is_told_with_its_line(text, line, message, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(TableError) as caught:
        accelcal.read_effects(path)
    place = str(path) if line is None else f"{path}:{line}"
    assert str(caught.value).startswith(f"{place}: {message}")
    assert "\n" not in str(caught.value)


def test_the_example_is_read():
    ids = [entry.id for entry in accelcal.read_effects(EXAMPLE)]
    assert ids == ["head-third-harmonic", "rayleigh-hysteresis", "daily-bias"]


def test_the_example_tells_what_its_head_looks_like():
    """On 45 deg positions sin th sin 3th is cos 2th and cos 4th: a part of K2 and one of a_i^4."""
    entry = accelcal.read_effects(EXAMPLE)[0]
    c = CONDITIONS
    terms = np.stack([np.ones(c.angle.size), c.input**2, c.input**4], axis=1)
    column = entry.columns(c)[:, 0]
    left = column - terms @ np.linalg.lstsq(terms, column)[0]
    np.testing.assert_allclose(left, 0.0, atol=1e-14)


# -- commands --------------------------------------------------------------------------------------


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copy(EXAMPLE, "copy.toml")

    def run_on(line):
        capsys.readouterr()
        files = {"MINE": str(EXAMPLE), "COPY": "copy.toml"}
        code = main([files.get(word, word) for word in line.split()])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run_on


def test_the_way_of_an_effect_from_a_file_through_the_commands(run):
    """Named, added, refitted; compared and simulated with the model, all with the same file."""
    simulated = "simulate --effects MINE --effect rayleigh-hysteresis=3e-5 --seed 3 -o d.csv"
    assert run(simulated) == (0, "", "")
    code, out, _ = run("discover d.csv --effects MINE -o model.json --format json")
    assert code == 0
    assert [item["id"] for item in json.loads(out)["effects"]] == ["rayleigh-hysteresis"]
    assert run("fit d.csv --model model.json --effects MINE -o cal.json")[0] == 0
    code, out, _ = run("compare cal.json d.csv --effects MINE")
    assert code == 0
    assert "Simulation and measurement agree" in out
    assert run("simulate --model model.json --effects MINE --seed 4 -o again.csv")[0] == 0
    assert "rayleigh-hysteresis=" in Path("again.csv").read_text()
    code, _, err = run("simulate --model model.json")
    assert code == 2
    assert "'rayleigh-hysteresis' is not in the catalogue" in err
    assert "--effects" in err


FIFTH = toml(id='"fifth"', formula='"abs(a_i)^5 * (1 + 0 * dT * a_p * pi)"', static="true")
TRUE = np.cos(np.radians(np.arange(10.0, 360.0, 20.0)))  # no angle of the test


def test_a_static_effect_of_a_file_is_taken_up_by_apply(run):
    """The outputs are those of (1) at T0 with the effect: what comes back is what went in."""
    Path("mine.toml").write_text(FIFTH)
    (fifth,) = accelcal.read_effects("mine.toml")
    with registered(fifth):
        plan = accelcal.TumblePlan(positions=36, temperatures=20.0)
        record = accelcal.simulate(plan=plan, effects=[fifth.of(3e-4)], seed=1)
        found = accelcal.discover(record, effects=[fifth])
        assert [item.id for item in found.effects] == ["fifth"]
        accelcal.fit(record, model=found).to_json("cal.json")
    unit, across = accelcal.AL15, np.sqrt(1.0 - TRUE**2) * np.repeat([1.0, -1.0], 9)
    indicated = 3.324e-3 + TRUE + 105e-6 * TRUE**2 + 87e-6 * TRUE**3 + 3e-4 * np.abs(TRUE) ** 5
    indicated += 1.15e-3 * across + 20e-6 * TRUE * across
    assert (unit.bias.at_T0, unit.k2, unit.k3) == (3.324e-3, 105e-6, 87e-6)
    rows = zip(1.35 * indicated, across, strict=True)
    stream = "output,a_p,a_o\n" + "".join(f"{y:.12f},{a:.12f},0\n" for y, a in rows)
    Path("flight.csv").write_text(stream)

    def errors(options):
        code, out, err = run(f"apply cal.json flight.csv {options}")
        lines = [line for line in out.splitlines() if not line.startswith("#")]
        found = np.array([float(line.split(",")[0]) for line in lines[1:]])
        assert code == 0
        return np.abs(found - TRUE).max(), err

    with_it, told = errors("--effects mine.toml")
    assert "fifth: taken up with the size that the fit found" in told
    assert with_it < 60e-6  # of a head, launches and readings with errors
    without, told = errors("")
    assert "fifth: the fit took it out of the readings" in told
    assert "so the coefficients are free of it; in use the accelerometer has it," in told
    assert without > 200e-6


def test_the_list_of_effects_has_those_of_a_file(run):
    code, out, _ = run("simulate --effects MINE --list-effects")
    assert code == 0
    assert out.startswith("scale-factor-asymmetry=")
    assert "\ndaily-bias=COEFFICIENT [g]\n" in out


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("simulate --effects nosuch.toml", "nosuch.toml: no such file; give the path"),
        ("simulate --effects MINE --effects COPY", "error: effect 'head-third-harmonic' is given"),
        ("simulate --effects MINE --positions x", "error: invalid value for '--positions'"),
        ("simulate --effect rayleigh-hysteresis=1", "error: effect 'rayleigh-hysteresis' is not"),
        ("discover nosuch.csv --effects MINE", "nosuch.csv: no such file"),
    ],
)
def test_a_fault_of_a_command_leaves_the_catalogue_alone(run, line, message):
    code, out, err = run(line)
    assert (code, out) == (2, "")
    assert err.startswith(message)


# -- the page --------------------------------------------------------------------------------------


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)


def test_the_script_of_the_page_runs(capsys):
    (code,) = blocks("python")
    exec(code, {})
    accelcal.unregister("power-hysteresis")
    assert "What is missing: hysteresis of a power." in " ".join(capsys.readouterr().out.split())


def test_the_commands_of_the_page_run(run):
    (file,), (lines,) = blocks("toml"), blocks("console")
    Path("mine.toml").write_text(file)
    for line in lines.splitlines():
        program, *arguments = line.removeprefix("$ ").split()
        assert program == "accelcal"
        code, out, err = run(" ".join(arguments))
        assert (code, err) == (0, "")
    assert "Simulation and measurement agree" in out


def test_the_page_tells_all_that_a_formula_takes():
    rows = "".join(line for line in PAGE.splitlines() if line.startswith("| `"))
    words = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`]+)`", rows))))
    assert words >= {*SYMBOLS, *FUNCTIONS}
