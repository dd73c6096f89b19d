"""Options of the public functions: each that is wrong is refused in a line that names it."""

import dataclasses
import inspect
import io
import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import accelcal
from accelcal import Effect, InputError, Parameter, TumblePlan
from accelcal.calibrate.options import FitOptions, Options
from accelcal.certificate.dcc import certificate
from accelcal.error_budget.budget import budget
from accelcal.error_budget.random_part import RandomBound, RandomPart, random_part
from accelcal.page.write import report_page
from accelcal.plot.style import theme
from accelcal.stability.analysis import analyse
from accelcal.stability.record import Launch, StabilityRecord, averaged, split_at_gaps

EXAMPLES = Path(__file__).parents[1] / "examples"
ANGLES = 45.0 * np.arange(9)
RECORD, OTHER = (
    accelcal.simulate(plan=TumblePlan(temperatures=20.0, strokes=2), seed=seed) for seed in (1, 2)
)
CALIBRATION = accelcal.fit(RECORD)
STAND = accelcal.read_stand(EXAMPLES / "paper-stand.toml")
TABLE = EXAMPLES / "al15.csv"
LAUNCH = Launch("1", [0.0, 1.0, 2.0, 3.0], [0.1, 0.2, 0.1, 0.3])
STABILITY = StabilityRecord((LAUNCH,))
SINE = {"name": "sine", "unit": "rad", "meaning": "of the head"}
WAVE = {
    "id": "x-wave",
    "name": "wave",
    "physics": "It waves.",
    "formula": "s sin th",
    "parameters": (Parameter(**SINE),),
    "term": lambda c, sine: sine * np.sin(np.radians(c.angle)),
}
TRIAD = "x,y,z\n1,0,0\n0,1,0\n0,0,1\n"


def same(value):
    """Make the same again, with some of its attributes changed."""
    return lambda **asked: dataclasses.replace(value, **asked)


CALLS = {
    "Effect": lambda **asked: Effect(**WAVE | asked),
    "Launch": same(LAUNCH),
    "Parameter": lambda **asked: Parameter(**SINE | asked),
    "RandomBound": RandomBound,
    "RandomPart": RandomPart,
    "StabilityRecord": same(STABILITY),
    "Stand": same(STAND),
    "StandComponent": same(STAND.components[0]),
    "TriadRecord": lambda **asked: accelcal.TriadRecord(**{"output": np.eye(3)} | asked),
    "TumbleRecord": same(RECORD),
    "analyse": lambda **asked: analyse(**{"record": STABILITY} | asked),
    "averaged": lambda **asked: averaged(**{"record": STABILITY, "seconds": 1.0} | asked),
    "budget": lambda **asked: budget(**{"calibration": CALIBRATION, "a_i": 1.0} | asked),
    "certificate": lambda **asked: certificate(**{"calibration": CALIBRATION} | asked),
    "of_mounting": lambda **asked: CALIBRATION.of_mounting(**asked),
    "random_part": lambda **asked: random_part(**{"calibration": CALIBRATION} | asked),
    "report_page": lambda **asked: report_page(**{"results": [CALIBRATION]} | asked),
    "residuals": lambda **asked: CALIBRATION.plot.residuals(**asked),
    "split_at_gaps": lambda **asked: split_at_gaps(**{"record": STABILITY, "gap": 9.0} | asked),
    "theme": lambda **asked: theme(**{"name": "dark"} | asked).__enter__(),
    "Accelerometer": accelcal.Accelerometer,
    "Apparatus": accelcal.Apparatus,
    "NoiseComponents": accelcal.NoiseComponents,
    "Pace": accelcal.Pace,
    "TumblePlan": TumblePlan,
    "accelerations": lambda **asked: accelcal.accelerations([0.0, 45.0], **asked),
    "apply": lambda **asked: accelcal.apply(CALIBRATION, [1.0], **asked),
    "batch": lambda **asked: accelcal.batch(TABLE, **asked),
    "calibrate_triad": lambda **asked: accelcal.calibrate_triad(np.eye(3), **asked),
    "design": lambda **asked: accelcal.design(**{"positions": [8], "strokes": [2], **asked}),
    "discover": lambda **asked: accelcal.discover(RECORD, **asked),
    "discover_stand": lambda **asked: accelcal.discover_stand([RECORD, OTHER], **asked),
    "estimate_tables": lambda **asked: accelcal.estimate_tables([ANGLES], ANGLES, **asked),
    "fit": lambda **asked: accelcal.fit(RECORD, **asked),
    "fleet_history": lambda **asked: accelcal.fleet_history([CALIBRATION], **asked),
    "history": lambda **asked: accelcal.history([CALIBRATION], **asked),
    "optimal_design": lambda **asked: accelcal.optimal_design(
        **{"criterion": "D", "hours": 9.0, **asked}
    ),
    "read_arrays": lambda **asked: accelcal.read_arrays(RECORD.to_frame(), **asked),
    "read_table": lambda **asked: accelcal.read_table(TABLE, **asked),
    "read_tables": lambda **asked: accelcal.read_tables(TABLE, **asked),
    "read_triad": lambda **asked: accelcal.read_triad(io.StringIO(TRIAD), **asked),
    "select": RECORD.select,
    "simulate": accelcal.simulate,
    "stand_budget": lambda **asked: accelcal.stand_budget(STAND, RECORD, **asked),
    "to_json": lambda **asked: CALIBRATION.to_json(**asked),
    "write_batch": lambda **asked: accelcal.write_batch(TABLE, "nosuch/r.csv", **asked),
}

FLAGS = {
    "Parameter": ("linear", "discrete"),
    "StandComponent": ("fixed",),
    "budget": ("exact", "extrapolate"),
    "theme": ("transparent",),
    "TumblePlan": ("timed",),
    "apply": ("extrapolate", "same_launch"),
    "batch": ("robust", "strict"),
    "design": ("declare", "effects"),
    "discover": ("empirical",),
    "estimate_tables": ("robust",),
    "fit": ("robust", "strict"),
    "optimal_design": ("declare", "effects"),
    "simulate": ("declare",),
    "write_batch": ("robust", "strict", "resume"),
}

NO_FLAGS = ["no", 1, 0.0, None, [True], np.array([True, False]), pd.NA]

OF_FIT = {
    "method": ["magic", 5, None, np.array(["least-squares"] * 2), pd.NA],
    "temperature_laws": ["both", None, ["tables"], pd.NA],
    "delta0": ["0", [1e-3], 10**400, pd.NA],
    "reference_temperature": ["20", np.nan, 10**400, {}],
    "coefficients": ["K9", None, 5, [["K1"]], pd.NA],
    "model": ["model.json", 5],
    "head": ["head.csv", 5],
}
OF_BATCH = {
    **OF_FIT,
    "specification": ["sheet.toml", 5],
    "overrides": [5, "serial", ["serial"], np.array([1, 2]), pd.NA],
    "jobs": ["2", 0, 1.5, 10**6, 10**400, [2], np.array([1, 2]), pd.NA],
    "dask": [5, ["local"], np.array(["local"] * 2), pd.NA],
    "progress": [5, "bar", [print], np.array([1, 2])],
}
OVERRIDES = [
    *OF_BATCH["overrides"],
    {"nosuch": 1},
    {"serial": 5},
    {"serial": ["a"]},
    {"unit": 5},
    {"unit": np.array(["V", "A"])},
]
OF_TABLES = {
    "overrides": [
        *OVERRIDES,
        {"positions": "8"},
        {"positions": 7.5},
        {"positions": [8]},
        {"reference_temperature": "20"},
        {"reference_temperature": np.nan},
        {"reference_temperature": [20.0]},
        {"reference_temperature": 293.15},
        {"resolution": True},
    ]
}
OF_DESIGN = {
    "mountings": [["q"], [["o+", ["p+"]]], pd.NA],
    "temperatures": [None, ["20"], 10**400],
    "targets": [5, [1], np.array([1, 2]), {"K7": 1e-6}, {"K1": "5 m"}, pd.NA],
    "hours": ["8", np.nan, 10**400, [8]],
    "resolution": ["0", -1, None],
}
OF_DISCOVERY = {
    "effects": [
        *("backlash", 5, ["backlash"], np.array([1.0, 2.0]), pd.NA),
        *([], [accelcal.effect("outlier")]),
    ],
    "seed": ["1", -1, 1.5, None, [1], pd.NA],
    "alpha": ["0.01", 2.0, 10**400],
    "max_effects": [0, 2.5, "3"],
    "reference_temperature": ["20", [20.0]],
    "delta0": ["0", 3.0],
}

NO_TEXTS = [5, ["a"], np.array(["a", "b"]), pd.NA]
NO_NUMBERS = ["1", np.nan, 10**400, [1.0], True, pd.NA]
NO_ARRAYS = ["1", "x", {}, True, [True], [1j], object()]
NO_OBJECTS = ["a.csv", 5, [1], pd.NA]

WRONG = {
    "Effect": {
        **{key: [None, *NO_TEXTS] for key in ("id", "name", "physics", "formula", "signature")},
        "parameters": ["sine", None, ["sine"], 5],
        "term": [None, "sine", 5],
        "bend": ["sine", 5],
    },
    "Launch": {
        "label": [None, *NO_TEXTS],
        "time": [None, *NO_ARRAYS, [0.0, 1.0], [0.0, 2.0, 1.0, 3.0]],
        "output": [None, *NO_ARRAYS, [0.1, 0.2], [np.nan] * 4],
        "temperature": [*NO_ARRAYS, 20.0, [20.0]],
        "input": [*NO_ARRAYS, [0.0], [np.nan] * 4],
    },
    "Parameter": {
        **{key: [None, *NO_TEXTS] for key in ("name", "unit", "meaning")},
        "default": [*NO_NUMBERS, np.inf],
        "minimum": [None, *NO_NUMBERS],
        "small": [None, 0.0, -1.0, *NO_NUMBERS],
        "search": ["rising", [1.0]],
    },
    "RandomBound": {
        "bound": [None, -1.0, *NO_NUMBERS],
        "divisor": [None, 0.0, -1.0, *NO_NUMBERS],
        "origin": [None, *NO_TEXTS],
    },
    "RandomPart": {"drift": [None, 1e-6, *NO_OBJECTS]},
    "StabilityRecord": {
        "launches": [(), *NO_OBJECTS],
        "unit": NO_TEXTS,
        "serial": NO_TEXTS,
        "source": [None, *NO_TEXTS],
    },
    "Stand": {"name": [None, *NO_TEXTS], "components": [(), *NO_OBJECTS], "conditions": NO_OBJECTS},
    "StandComponent": {
        "name": [None, *NO_TEXTS],
        "kind": ["nosuch", None, ["shaft-tilt"], pd.NA],
        "distribution": [1e-5, *NO_OBJECTS],
        "varies": ["nosuch", None, 5, pd.NA],
        "order": [0, 361, 1.5, "1", None],
    },
    "TriadRecord": {
        "output": [None, *NO_ARRAYS, [1.0, 2.0]],
        "unit": NO_TEXTS,
        "serial": NO_TEXTS,
        "source": [None, *NO_TEXTS],
    },
    "TumbleRecord": {
        **dict.fromkeys(("serial", "unit", "date"), NO_TEXTS),
        "source": [None, *NO_TEXTS],
        "output": [None, "1", [1.0], np.array(["1"] * len(RECORD))],
        "temperature": [None, 20.0, np.array(["20"] * len(RECORD))],
        "stroke": [None, 1, np.ones(len(RECORD))],
        "mounting": [None, "o+", np.zeros(len(RECORD))],
        "time": ["1", [1.0], 5.0],
        "run_labels": [None, "20", ["20"], (20,)],
        "notes": [None, "note", [5], (5,)],
        "positions": [None, "8", 7.5, 1, [8]],
        "reference_temperature": ["20", np.nan, np.inf, [20.0]],
        "apparatus": [None, {}, 1e-5],
        "metadata": [None, "operator", 5, ["a"]],
    },
    "analyse": {
        "record": NO_OBJECTS,
        "scale_factor": [0.0, *NO_NUMBERS],
        "probability": [0.0, 1.0, *NO_NUMBERS],
        "window": [None, 0.0, *NO_NUMBERS],
        "times": [None, "600", [-1.0], ["600"], [np.nan]],
    },
    "averaged": {"record": NO_OBJECTS, "seconds": [None, 0.0, *NO_NUMBERS]},
    "budget": {
        "calibration": NO_OBJECTS,
        "a_i": [None, [], *NO_ARRAYS, np.nan],
        "a_p": [None, *NO_ARRAYS, np.inf],
        "temperature": [*NO_ARRAYS, np.nan, [20.0, 20.0, np.nan]],
        "time": [None, *NO_ARRAYS, -1.0],
        "random": NO_OBJECTS,
        "temperature_uncertainty": [None, -1.0, *NO_NUMBERS],
    },
    "certificate": {"calibration": NO_OBJECTS, "known": NO_OBJECTS},
    "of_mounting": {"mounting": [None, "q", *NO_TEXTS]},
    "random_part": {
        "calibration": NO_OBJECTS,
        "factor": [None, -1.0, *NO_NUMBERS],
        "launch": [-1.0, *NO_NUMBERS],
    },
    "report_page": {"results": [(), None, *NO_OBJECTS], "records": [*NO_OBJECTS, [RECORD] * 2]},
    "residuals": {"ax": NO_OBJECTS},
    "split_at_gaps": {"record": NO_OBJECTS, "gap": [None, 0.0, *NO_NUMBERS]},
    "theme": {"name": ["blue", None, ["dark"]]},
    "Accelerometer": {"unit": [5, ["V"]], "serial": [15, ["AL-15"]], "k2": ["0", 10**400]},
    "Apparatus": {"resolution": [True, "5"], "head_uncertainty": ["1e-5", [1e-5]]},
    "NoiseComponents": {"reading": [-1.0, "5e-6", 10**400, None]},
    "Pace": {"reading": [0.0, "60", 10**400], "soak": [None, -1.0]},
    "TumblePlan": {
        "positions": [1, 8.5, "8"],
        "angles": [["0"], 10**400, []],
        "temperatures": [None, [None], "20"],
        "mountings": ["q", [["o+", ["p+"]]], pd.NA, None],
        "delta0": ["0", 10**400],
        "local_gravity": ["9.81", 5.0, np.nan, [9.81], True],
    },
    "accelerations": {"mounting": ["q", ["o+"] * 3, [["o+", ["p+"]]], pd.NA], "delta0": ["0"]},
    "apply": {
        "temperature": ["warm", 10**400],
        "output_uncertainty": ["1e-6", -1.0, None],
        "run": ["nosuch", 99],
    },
    "batch": OF_BATCH,
    "calibrate_triad": {"frame": ["y", 5, ["x"]], "up": ["z", 10**400]},
    "design": {**OF_DESIGN, "positions": ["8", [1], b"8"], "strokes": [[0], ["6"]]},
    "discover": OF_DISCOVERY,
    "discover_stand": OF_DISCOVERY,
    "estimate_tables": {
        "mounting": ["q", ["o+", "p+"], [["o+", ["p+"]]], pd.NA],
        "threads": ["2", 0, 1.5, None, np.array([1, 2]), pd.NA],
        "std": ["1", -1.0, 10**400],
        "delta0": ["0"],
    },
    "fit": OF_FIT,
    "fleet_history": {
        "mounting": [5, ""],
        "temperature": ["20", np.nan, [20.0]],
        "alpha": ["1", 2],
        "due_before": [5, "soon", pd.NA],
    },
    "history": {
        "serial": [5, np.array(["a", "b"]), pd.NA],
        "mounting": [5, ""],
        "temperature": ["20", np.nan, [20.0]],
        "alpha": ["1", 2],
    },
    "optimal_design": {**OF_DESIGN, "criterion": ["E", 5, None, pd.NA], "spacing": ["15", 0.5]},
    "read_arrays": OF_TABLES,
    "read_table": OF_TABLES,
    "read_tables": OF_TABLES,
    "read_triad": {"overrides": [*OVERRIDES, {"local_gravity": "9.81"}, {"local_gravity": 5.0}]},
    "select": {"mask": [None, "no", [True], [0, 1], np.arange(len(RECORD)), np.array([True])]},
    "simulate": {
        "seed": ["a", -1, 1.5],
        "effects": ["backlash", 5, [None]],
        "plan": [8, {"positions": 8}],
        "noise": [1e-6],
    },
    "stand_budget": {
        "trials": ["many", 7, 1.5, np.array([1, 2])],
        "seed": ["a", -1, [1]],
        "targets": [5, "K1", {}, {"K1": None}, {"K1": -1.0}, np.array([1, 2])],
        "specification": ["sheet.toml", 5],
        "method": ["magic", ["least-squares"], pd.NA],
    },
    "to_json": {"path": [5, ["r.json"], b"r.json"]},
    "write_batch": OF_BATCH,
}

NAMES = {
    "a_i": "a_i|point",
    "ax": "axes",
    "calibration": "a calibration",
    "components": "component",
    "conditions": "conditions of a stand",
    "delta0": "delta0|fixture angle",
    "distribution": "a distribution",
    "divisor": "factor of a bound|factor .* of a bound",
    "drift": "a bound of a random error",
    "factor": "factor",
    "gap": "gap",
    "head": "a head",
    "name": "name|theme",
    "input": "input",
    "known": "a laboratory",
    "launch": "launch|a bound of a random error",
    "launches": "a launch|without launches",
    "local_gravity": "local.gravity",
    "model": "a discovery",
    "output": "output",
    "overrides": "overrides|declared|serial|unit|positions|reference|resolution|gravity",
    "parameters": "a parameter",
    "plan": "a plan",
    "probability": "probability",
    "random": "the random errors",
    "record": "a stability record",
    "records": "a record|records",
    "reference_temperature": "T0|reference_temperature",
    "results": "to report",
    "scale_factor": "scale.factor",
    "seconds": "seconds|averaging",
    "specification": "data sheet",
    "targets": "target|coefficient",
    "up": "up|direction|unit vector",
}
"""Argument -> how a message names it, where it is not by the first letters of the argument."""


def refusal(function, argument, value):
    with pytest.raises(InputError) as refused:
        CALLS[function](**{argument: value})
    (line,) = str(refused.value).splitlines()
    return line


@pytest.mark.parametrize("function", WRONG)
def test_what_is_wrong_is_named_in_a_line(function):
    for argument, values in WRONG[function].items():
        named = re.compile(NAMES.get(argument, argument.removesuffix("s")))
        lines = [refusal(function, argument, value) for value in values]
        assert [line for line in lines if not named.search(line)] == []


@pytest.mark.parametrize("function", FLAGS)
def test_a_flag_is_true_or_false(function):
    for flag in FLAGS[function]:
        right = re.compile(rf"{flag} is .*; it is True or False")
        lines = [refusal(function, flag, value) for value in NO_FLAGS]
        assert [line for line in lines if not right.fullmatch(line)] == []


def test_an_unknown_option_is_refused_as_python_does():
    for call in CALLS.values():
        with pytest.raises(TypeError, match="got an unexpected keyword argument 'nons") as refused:
            call(nonsense=1)
        (line,) = str(refused.value).splitlines()
        assert "Options" not in line


@pytest.mark.parametrize(
    ("function", "option", "told"),
    [
        ("batch", "robbust", "Did you mean 'robust'?"),
        ("write_batch", "resumee", "Did you mean 'resume'?"),
        ("batch", "resume", "It takes jobs, dask, progress, method, "),
        ("batch", "T0", "It takes jobs, dask, progress, method, "),
    ],
)
def test_an_unknown_option_of_a_batch_is_told_what_is_near(function, option, told):
    expected = f"{function}() got an unexpected keyword argument {option!r}. {told}"
    with pytest.raises(TypeError, match=re.escape(expected)):
        CALLS[function](**{option: 1})


def test_options_of_a_fit_are_the_same_wherever_they_are_listed():
    """`fit`, `Options` and `FitOptions` each list them, as types of Python cannot be derived."""
    own = [
        p for p in inspect.signature(accelcal.fit).parameters.values() if p.kind == p.KEYWORD_ONLY
    ]
    assert {option.name: option.default for option in own} == Options()._asdict()
    handed_on = {name: type_.__forward_arg__ for name, type_ in FitOptions.__annotations__.items()}
    assert handed_on == {option.name: option.annotation for option in own}
    kept = {name: type_.__forward_arg__ for name, type_ in Options.__annotations__.items()}
    assert kept == handed_on | {"coefficients": "tuple[str, ...]"}


@pytest.mark.parametrize(
    ("function", "argument"),
    [
        (accelcal.fit, "method"),
        (accelcal.fit, "temperature_laws"),
        (accelcal.stand_budget, "method"),
        (accelcal.apply, "by"),
        (accelcal.coefficients_at, "by"),
    ],
)
def test_an_editor_is_told_the_choices(function, argument):
    """A hint of plain text offers nothing and takes every misspelling."""
    assert inspect.signature(function).parameters[argument].annotation in {"Method", "LawsOf", "By"}


def test_scalars_of_numpy_are_as_good_as_those_of_python():
    ours = {"robust": True, "strict": False, "reference_temperature": 20, "delta0": 2.0**-10}
    theirs = {
        "robust": np.True_,
        "strict": np.False_,
        "reference_temperature": np.int64(20),
        "delta0": np.float32(2.0**-10),
    }
    record = accelcal.simulate(plan=TumblePlan(temperatures=20.0), seed=1, declare=np.True_)
    found, expected = (accelcal.fit(record, **asked).to_json() for asked in (theirs, ours))
    assert json.loads(found) == json.loads(expected)


def test_mountings_of_a_frame_are_taken():
    sides = pd.Series(["o+", "p-"])
    assert accelcal.accelerations(90.0, mounting=sides).output.tolist() == [0.0, -1.0]


def test_one_idea_has_one_name():
    functions = (accelcal.simulate, accelcal.design, accelcal.optimal_design)
    assert all("declare" in inspect.signature(function).parameters for function in functions)
