"""Calibrations as others may write them, and damaged ones: a result or a line."""

import copy
import io
import json
import warnings
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import accelcal
from accelcal.cli.main import main

CONTRACT = (
    *("schema", "method", "acceleration_unit", "g_local_m_s2", "output_unit", "serial", "T0_degC"),
    *("tables", "temperature_model", "effects", "warnings"),
)
OF_A_TABLE = (
    *("run", "temperature_degC", "readings", "dof", "residual_rms", "coefficients", "error_model"),
    *("covariance", "warnings"),
)
LEAF = ("value", "standard_uncertainty", "unit")

COMMANDS = (
    ["apply", "cal.json", "data.csv", "-o", "out.csv", "--extrapolate"],
    ["compare", "cal.json", "table.csv"],
    ["budget", "cal.json", "--acceleration=-1,0,1", "--time", "600,12h"],
    [
        "budget",
        "cal.json",
        "--temperature",
        "20",
        "--exact",
        "--format",
        "json",
        "--extrapolate",
    ],
    ["export", "cal.json", "--format", "c", "-o", "out.h"],
    ["report", "cal.json", "-o", "out.md"],
    ["export", "cal.json", "--format", "yaml", "-o", "out.yaml"],
    ["stability", "record.csv", "--calibration", "cal.json"],
)


@pytest.fixture(scope="module")
def document():
    return json.loads(accelcal.fit(accelcal.simulate(seed=1)).to_json())


@pytest.fixture(scope="module")
def one_level():
    plan = accelcal.TumblePlan(temperatures=(20.0,))
    return json.loads(accelcal.fit(accelcal.simulate(plan=plan, seed=1)).to_json())


@pytest.fixture(scope="module")
def table():
    plan = accelcal.TumblePlan(temperatures=(20.0,), strokes=4)
    text = io.StringIO()
    accelcal.write_table(accelcal.simulate(plan=plan, seed=2), text)
    return text.getvalue()


@pytest.fixture
def folder(tmp_path, monkeypatch, table):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.csv").write_text(table)
    (tmp_path / "data.csv").write_text("output [mA],temperature\n1.25,20\n-1,35\n")
    samples = "".join(f"{i},{1.3 + (i * 7 % 11) * 1e-6}\n" for i in range(40))
    (tmp_path / "record.csv").write_text("time,output_mA\n" + samples)
    return tmp_path


def pick(document, keys):
    return {key: document[key] for key in keys}


def leaves(part):
    """The same with nothing in a leaf but what the contract names."""
    if isinstance(part, dict) and set(part) >= set(LEAF):
        return pick(part, LEAF)
    if isinstance(part, dict):
        return {key: leaves(item) for key, item in part.items()}
    return part


def by_contract(document):
    """A document with the keys of the contract and no other."""
    model = leaves(document["temperature_model"])
    tables = [leaves(pick(table, OF_A_TABLE)) for table in document["tables"]]
    laws = model and pick(model, ("k0", "K1", "delta", "hysteresis"))
    return pick(document, CONTRACT) | {"tables": tables, "temperature_model": laws}


def run(command, capsys):
    """Exit code and standard error; a warning of numpy is an error here."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        code = main(command)
    return code, capsys.readouterr().err


def save(folder, document):
    (folder / "cal.json").write_text(json.dumps(document))


# -- by the contract -------------------------------------------------------------------------------


@pytest.mark.parametrize("levels", ["document", "one_level"])
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: " ".join(command[:4]))
def test_a_document_by_the_contract_is_used(folder, capsys, request, levels, command):
    save(folder, by_contract(request.getfixturevalue(levels)))
    code, err = run(command, capsys)
    assert (code, "error:" in err) == (0, False)


def test_a_list_of_several_needs_no_schema_beside_theirs(folder, document):
    save(folder, {"calibrations": [by_contract(document)]})
    assert accelcal.read_calibration("cal.json").serial == document["serial"]


def test_a_document_by_the_contract_has_defaults(folder, document):
    save(folder, by_contract(document))
    found = accelcal.read_calibration("cal.json")
    whole = accelcal.Calibration.from_document(document)
    assert found.tables[0].covariance_matrix == whole.tables[0].covariance_matrix
    assert (found.tables[0].mounting, found.delta0_rad, found.robust) == ("o+", 0.0, False)
    assert found.tables[0].residuals.value == ()
    assert "Run 1: 20.00 degC, mounting o+, 54 readings" in str(found)


def test_a_coefficient_that_is_left_out_was_not_determined(folder, document):
    cut = by_contract(document)
    del cut["tables"][0]["coefficients"]["K3"]
    del cut["tables"][0]["error_model"]["k3"]
    cut["tables"][0]["covariance"] = {"names": [], "matrix": []}
    save(folder, cut)
    found = accelcal.read_calibration("cal.json")
    assert found.tables[0].coefficients["K3"].value is None


# -- damaged ---------------------------------------------------------------------------------------


def at(path, value):
    """Set what stands at a path of keys."""

    def damage(document):
        *way, last = path
        for key in way:
            document = document[key]
        document[last] = value

    return damage


TABLE = ("tables", 0)
DAMAGED = {
    "no tables": (at(("tables",), []), "tables: [] in place of a list of 1 or more"),
    "covariance of one": (
        at((*TABLE, "covariance", "matrix"), [[1]]),
        "tables[0].covariance: 6 names, and no matrix of that size",
    ),
    "covariance of others": (
        at((*TABLE, "covariance"), {"names": ["K0"], "matrix": [[1]]}),
        "tables[0].covariance: K0 in place of K1 and others of coefficients",
    ),
    "negative variance": (
        at((*TABLE, "covariance", "matrix", 0, 0), -1),
        "tables[0].covariance.matrix[0][0]: -1 in place of a covariance",
    ),
    "temperature": (
        at((*TABLE, "temperature_degC"), "x"),
        "tables[0].temperature_degC: 'x' in place of a number",
    ),
    "no scale factor": (
        at((*TABLE, "coefficients", "K1", "value"), 0),
        "tables[0].coefficients.K1: 0.0 in place of a scale factor",
    ),
    "huge": (
        at((*TABLE, "error_model", "k0", "value"), 1e300),
        "tables[0].error_model.k0.value: 1e+300 in place of a number of at most 1e+40",
    ),
    "mounting": (
        at((*TABLE, "mounting"), "q"),
        "tables[0].mounting: 'q' in place of one of o+, o-, p+, p-",
    ),
    "serial": (at(("serial",), 7), "serial: 7 in place of a text"),
    "T0": (
        at(("T0_degC",), None),
        "T0_degC: None in place of the temperature that the laws refer to",
    ),
    "laws": (at(("temperature_model",), 3), "temperature_model: 3 in place of an object"),
}


@pytest.mark.parametrize("name", DAMAGED)
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: " ".join(command[:4]))
def test_damaged_calibrations(folder, capsys, document, name, command):
    damaged = copy.deepcopy(document)
    damage, said = DAMAGED[name]
    damage(damaged)
    save(folder, damaged)
    code, err = run(command, capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert err == f"cal.json: key {said}; give a file as accelcal fit writes it\n"


def test_nan_is_no_number_of_json(folder, capsys, document):
    save(folder, document | {"T0_degC": float("nan")})
    code, err = run(COMMANDS[0], capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert err.startswith("cal.json: key T0_degC: nan in place of a number; give a file as")


def places(part, path=()):
    """Paths to every part of a document."""
    items = part.items() if isinstance(part, dict) else enumerate(part)
    for key, item in items:
        yield (*path, key)
        if isinstance(item, dict | list):
            yield from places(item, (*path, key))


ODD = st.sampled_from(
    [
        *(
            None,
            True,
            [],
            {},
            "",
            "x",
            "K1",
            "1.5",
            "\ud800",
            "\x00\n",
            [[1]],
            {"value": 1},
            [None],
        ),
        *(0, -1, 1, 7, 1e300, -1e300, 1e99, -1e99, 1e-99, 1e-300, 5e-324, 10**400, float("nan")),
        *(float("inf"), 0.5, 20.0, 1e6, -273.15),
    ]
)


@st.composite
def damages(draw, paths):
    number = draw(st.integers(1, 3))
    return [(draw(st.sampled_from(paths)), draw(st.just(...) | ODD)) for _ in range(number)]


def damaged_by(document, wounds):
    document = copy.deepcopy(document)
    for (*way, last), value in wounds:
        part = document
        try:
            for key in way:
                part = part[key]
            if value is ...:
                del part[last]
            else:
                part[last] = copy.deepcopy(value)  # a later wound may cut into this one
        except (KeyError, IndexError, TypeError):
            continue  # another wound has taken it away
    return document


@pytest.mark.parametrize("levels", ["document", "one_level"])
@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    max_examples=150,
)
@given(data=st.data())
def test_any_damage_gives_a_result_or_a_line(folder, capsys, request, levels, data):
    whole = request.getfixturevalue(levels)
    rare = [path for path in places(whole) if "residuals" not in path]
    wounded = damaged_by(whole, data.draw(damages(rare)))
    (folder / "cal.json").write_text(json.dumps(wounded), "utf-8")
    code, err = run(data.draw(st.sampled_from(COMMANDS)), capsys)
    assert code in (0, 2), err
    assert "Traceback" not in err
    if code == 2:
        assert err.splitlines()[-1].startswith(("cal.json:", "error: ", "data.csv"))


def test_an_effect_that_is_not_in_the_catalogue_is_one_of_the_model(folder, capsys):
    found = {"id": "backlush", "name": "?", "parameters": {}, "p_value": 0.0}
    gaps = ("gap_before", "gap_after", "heldout_before", "heldout_after")
    document = accelcal.discover(accelcal.simulate(seed=1)).to_document()
    document["effects"] = [found | dict.fromkeys(gaps, 0.0) | {"indistinguishable": []}]
    document["effects"][0]["to_tell_apart"] = ""
    (folder / "model.json").write_text(json.dumps(document), "utf-8")
    code, err = run(["fit", "--model", "model.json", "data.csv"], capsys)
    assert code == 2
    assert err.startswith("model.json: effect 'backlush' is not in the catalogue"), err


@pytest.mark.parametrize(
    ("command", "begins"),
    [
        (["apply"], "model.json: key schema: 'accelcal/discovery/1' in place of"),
        (["compare"], "model.json: a discovery without its calibration; write it again by"),
    ],
)
def test_a_discovery_in_place_of_a_calibration_is_told_its_use(command, begins, folder, capsys):
    accelcal.discover(accelcal.simulate(seed=1)).to_json(folder / "model.json")
    code, err = run([*command, "model.json", "data.csv"], capsys)
    assert code == 2
    assert err.startswith(begins)
    assert err.rstrip().endswith("use it by accelcal fit --model, and give what this writes")


@pytest.mark.usefixtures("folder")
def test_discover_fits_no_calibration_where_nobody_reads_it(capsys, monkeypatch):
    accelcal.write_table(accelcal.simulate(seed=1), "first.csv")
    asked = []
    monkeypatch.setattr("accelcal.calibrate.fit.fit", lambda *_, **__: asked.append(1))
    assert run(["discover", "first.csv"], capsys)[0] == 0
    assert asked == []
    assert run(["discover", "first.csv", "-o", "model.json"], capsys)[0] == 0
    assert asked == [1]
    assert run(["discover", "first.csv", "--format", "json"], capsys)[0] == 0
    assert asked == [1, 1]


def test_compare_takes_the_model_that_discover_writes(folder, capsys):
    """It was refused, and a fit with the model was needed first."""
    hidden = [accelcal.effect("hysteresis").of(5e-5)]
    for name, seed in (("first.csv", 1), ("second.csv", 2)):
        accelcal.write_table(accelcal.simulate(effects=hidden, seed=seed), folder / name)
    assert run(["discover", "first.csv", "-o", "model.json"], capsys)[0] == 0
    assert run(["fit", "first.csv", "--model", "model.json", "-o", "cal.json"], capsys)[0] == 0
    model = accelcal.read_discovery(folder / "model.json")
    assert model.calibration == accelcal.read_calibration(folder / "cal.json")
    found = []
    for known in ("cal.json", "model.json"):
        assert main(["compare", known, "second.csv", "--format", "json"]) == 0
        found.append(json.loads(capsys.readouterr().out))
    assert found[0] == found[1]
    assert found[1]["effects"] == ["hysteresis"]
    assert found[1]["p_value"] > 0.01


@pytest.mark.usefixtures("folder")
def test_compare_takes_of_several_models_that_of_the_serial_number(capsys):
    tables = [f"{serial}.csv" for serial in "AB"]
    for seed, name in zip("12", tables, strict=True):
        assert run(["simulate", "--serial", name[0], "--seed", seed, "-o", name], capsys)[0] == 0
    assert run(["discover", *tables, "-o", "models.json"], capsys)[0] == 0
    assert main(["compare", "models.json", "B.csv", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["calibration"] == "B.csv"
    models = json.loads(Path("models.json").read_text("utf-8"))
    models["discoveries"][0]["calibration"] = None
    Path("models.json").write_text(json.dumps(models), "utf-8")
    assert main(["compare", "models.json", "B.csv"]) == 0
    assert "with B.csv" in capsys.readouterr().out
    code, err = run(["compare", "models.json", "A.csv"], capsys)
    assert code == 2
    assert "no unit in both files: the first file holds B, the second A" in err


def test_a_path_in_place_of_a_calibration_is_refused():
    with pytest.raises(
        accelcal.InputError, match="str in place of a calibration of one accelerometer; make"
    ):
        accelcal.apply("cal.json", [1.0])


def test_a_record_in_place_of_several_is_refused():
    with pytest.raises(accelcal.InputError, match="one record; what belongs to the stand"):
        accelcal.discover_stand(accelcal.simulate(seed=1))
