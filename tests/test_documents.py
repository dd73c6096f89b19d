"""Documents that are read back: each damage of each kind is told in one line, by its key."""

from __future__ import annotations

import copy
import dataclasses
import functools
import io
import json
import math
from pathlib import Path

import numpy as np
import pytest
from hidden.clampings import units_on_one_head
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import t

import accelcal
from accelcal import Calibration, Discovery, HeadCalibration, TriadCalibration
from accelcal.cli.main import main
from accelcal.errors import DocumentError
from accelcal.io.toml.specification import read_specification
from accelcal.results.documents.stored import all_to_json
from accelcal.results.quantity import Residuals
from accelcal.results.stand_discovery import StandDiscovery
from accelcal.verdict.judge import judge

EXAMPLES = Path(__file__).parents[1] / "examples"

# -- a document of each kind -----------------------------------------------------------------------


@functools.cache
def units():
    plan = accelcal.TumblePlan(temperatures=(20.0,))
    records = [accelcal.simulate(plan=plan, seed=seed) for seed in (1, 2)]
    return [dataclasses.replace(r, serial=f"S{i}") for i, r in enumerate(records)]


def calibration():
    found = accelcal.fit(accelcal.read_table(EXAMPLES / "al15.csv"))
    sheet = read_specification(EXAMPLES / "al15.toml")
    return dataclasses.replace(found, verdict=judge(found, sheet)).to_json()


def stand():
    found = [accelcal.discover(unit) for unit in units()]
    return all_to_json(found, stand=accelcal.discover_stand(units()))


def head():
    _, (unit,) = units_on_one_head(np.random.default_rng(12), units=1)
    return accelcal.calibrate_head(accelcal.read_table(io.StringIO(unit.text))).to_json()


def stability():
    record = accelcal.read_stability(EXAMPLES / "stability.csv")
    return accelcal.analyse(record, scale_factor=1.3).to_json()


def triad():
    return accelcal.calibrate_triad(accelcal.read_triad(EXAMPLES / "triad.csv")).to_json()


@dataclasses.dataclass(frozen=True)
class Kind:
    """How to make a document, what is to be damaged in it, and the command that reads it."""

    make: object
    schema: str
    missing: tuple
    number: tuple
    writer: str
    command: str
    taken: tuple = ()  # schemas and writers of all kinds that the command takes, if several


KINDS = {
    "calibration": Kind(
        calibration,
        "calibration",
        ("method",),
        ("tables", 0, "residual_rms"),
        "accelcal fit",
        "export doc.json --format yaml",
        (("calibration", "triad"), "accelcal fit or accelcal triad"),
    ),
    "calibrations": Kind(
        lambda: all_to_json(list(map(accelcal.fit, units()))),
        "calibration",
        ("calibrations", 1, "warnings"),
        ("calibrations", 0, "tables", 0, "coefficients", "K1", "value"),
        "accelcal fit",
        "apply doc.json data.csv --serial S1",
        (("calibration", "triad"), "accelcal fit or accelcal triad"),
    ),
    "discovery": Kind(
        lambda: accelcal.discover(units()[0]).to_json(),
        "discovery",
        ("gap", "after"),
        ("gap", "before", "rms"),
        "accelcal discover",
        "fit data.csv --model doc.json",
    ),
    "discoveries and their stand": Kind(
        stand,
        "discovery",
        ("stand", "units"),
        ("stand", "common", "where", 0, "share"),
        "accelcal discover",
        "report doc.json -o out.md",
        (("calibration", "discovery"), "accelcal fit or accelcal discover"),
    ),
    "head": Kind(
        head,
        "head",
        ("origin",),
        ("positions", 3, "error", "value"),
        "accelcal head",
        "fit data.csv --head doc.json",
    ),
    "stability": Kind(
        stability,
        "stability",
        ("components", "k0F", "value"),
        ("launches", 2, "fluctuation", "value"),
        "accelcal stability",
        "budget cal.json --stability doc.json",
    ),
    "triad": Kind(triad, "triad", ("frame",), ("covariance", "matrix", 1, 2), "accelcal triad", ""),
}
READ = {"triad": TriadCalibration}


@functools.cache
def written(name):
    return KINDS[name].make()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    accelcal.write_table(units()[0], tmp_path / "data.csv")
    accelcal.fit(accelcal.simulate(seed=1)).to_json(tmp_path / "cal.json")
    return tmp_path


def told(name, text, folder, capsys):
    """What is said of a document that cannot be read, without the end of the line."""
    (folder / "doc.json").write_text(text, "utf-8")
    if not KINDS[name].command:
        with pytest.raises(DocumentError) as caught:
            READ[name].from_json("doc.json")
        return str(caught.value)
    assert main(KINDS[name].command.split()) == 2
    out, err = capsys.readouterr()
    assert (out, err[-1]) == ("", "\n")
    return err[:-1]


# -- intervals -------------------------------------------------------------------------------------


def warming_up():
    return accelcal.simulate(effects=[accelcal.effect("warm-up").of(1e-4)], seed=3)


def recalibrated(year):
    calibration = accelcal.fit(accelcal.simulate(seed=year))
    return dataclasses.replace(calibration, date=f"{year}-01-01")


def drifts(calibrations):
    """Of a history what it estimates: its points have the intervals that calibrations state."""
    return [trend.drift.to_document() for trend in accelcal.history(calibrations).trends]


WITH_INTERVALS = {
    **{name: KINDS[name].make for name in ("calibration", "head", "triad")},
    "discovery": lambda: accelcal.discover(warming_up()).to_json(),
    "stand": stand,
    "comparison": lambda: accelcal.compare(recalibrated(2001), accelcal.simulate(seed=1)).to_json(),
    "history": lambda: json.dumps(drifts(map(recalibrated, range(2001, 2008)))),
}


def intervals(part):
    """Every quantity of a document that tells an interval and its degrees of freedom."""
    if isinstance(part, dict) and "dof" in part and part.get("expanded_uncertainty"):
        yield part
    inner = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    for one in inner:
        yield from intervals(one)


@pytest.mark.parametrize("name", WITH_INTERVALS)
def test_every_interval_is_one_of_95_percent(name):
    found = list(intervals(json.loads(WITH_INTERVALS[name]())))
    assert len(found) > 1
    for told in found:
        dof = math.inf if told["dof"] is None else told["dof"]
        factor = t.ppf(0.975, dof)
        assert told["expanded_uncertainty"] == pytest.approx(
            factor * told["standard_uncertainty"], rel=1e-4
        )


# -- damages ---------------------------------------------------------------------------------------


def way(keys):
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)[1:]


def changed(document, keys, *value):
    """The document with another value at a path of keys, or without it."""
    document = copy.deepcopy(document)
    *above, last = keys
    part = functools.reduce(lambda part, key: part[key], above, document)
    if value:
        part[last] = value[0]
    else:
        del part[last]
    return json.dumps(document)


def missing(kind, document):
    return changed(document, kind.missing), f"key {way(kind.missing)}: missing"


def no_number(value):
    def damage(kind, document):
        said = f"key {way(kind.number)}: {value!r} in place of a number"
        return changed(document, kind.number, value), said

    return damage


def infinite(kind, document):
    text, said = no_number(math.inf)(kind, document)
    return text.replace("Infinity", "1e999"), said


def another_type(kind, document):
    above = kind.number[:-1]
    return changed(document, above, 7), f"key {way(above)}: 7 in place of a"


def other_schema(kind, document):
    names = kind.taken[0] if kind.taken else (kind.schema,)
    schemas = [f"accelcal/{own}/1" for own in names]
    right = f"one of {', '.join(schemas)}" if len(schemas) > 1 else repr(schemas[0])
    return changed(document, ("schema",), "a/1"), f"key schema: 'a/1' in place of {right}"


def cut(_, document):
    return json.dumps(document)[:-9], "not JSON ("


DAMAGES = {
    "missing": missing,
    "text": no_number("1.5"),
    "null in a list": no_number([None]),
    "NaN": no_number(math.nan),
    "infinite": infinite,
    "another type": another_type,
    "another schema": other_schema,
    "truncated": cut,
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("name", KINDS)
def test_a_damage_is_told_in_one_line_by_its_key(folder, capsys, name, damage):
    kind, document = KINDS[name], json.loads(written(name))
    if name == "calibrations" and damage == "another schema":
        document = document["calibrations"][0]
    text, said = DAMAGES[damage](kind, document)
    line = told(name, text, folder, capsys)
    assert "\n" not in line
    assert line.startswith(f"doc.json: {said}")
    # of what has no schema of theirs, any of the kinds may have been meant
    is_any = kind.taken and damage in ("truncated", "another schema")
    writer = kind.taken[1] if is_any else kind.writer
    assert line.endswith(f"; give a file as {writer} writes it")


@pytest.mark.parametrize("name", KINDS)
def test_a_later_version_is_told(folder, capsys, name):
    document = json.loads(written(name))
    keys = ("calibrations", 0, "schema") if name == "calibrations" else ("schema",)
    later = f"accelcal/{KINDS[name].schema}/2"
    line = told(name, changed(document, keys, later), folder, capsys)
    assert line.startswith(f"doc.json: key {way(keys)}: '{later}' in place of ")
    assert line.endswith("; read it with the version of accelcal that wrote it")


def test_a_document_of_several_units_is_none_of_one(folder, capsys):
    (folder / "several.json").write_text(written("discoveries and their stand"), "utf-8")
    assert main(["fit", "data.csv", "--serial", "S7", "--model", "several.json"]) == 2
    said = "serial S7 is asked for, but it holds the discovery of S0, S1"
    *notes, error = capsys.readouterr().err.splitlines()
    assert notes == ["note: data.csv: the serial is S7, as given, in place of S0 in the table"]
    assert error.startswith(f"error: several.json: {said}")
    with pytest.raises(DocumentError, match="key discoveries: 2 in a list, of S0, S1, in place"):
        Discovery.from_document(json.loads(written("discoveries and their stand")))
    item = json.loads(written("discoveries and their stand"))["discoveries"][1]
    assert Discovery.from_document(item).serial == "S1"
    with pytest.raises(DocumentError, match="key calibrations: 2 in a list, of S0, S1, in place"):
        Calibration.from_document(json.loads(written("calibrations")))


def test_parts_within_parts_without_end(folder, capsys):
    document = json.loads(written("calibration"))
    document["provenance"]["options"] = 7
    deep = '{"a": ' * 100_000 + "1" + "}" * 100_000  # deeper than any Python reads
    text = json.dumps(document).replace('"options": 7', f'"options": {deep}')
    line = told("calibration", text, folder, capsys)
    assert line.endswith(f"; give a file as {KINDS['calibration'].taken[1]} writes it")


# -- any damage ------------------------------------------------------------------------------------

READERS = {
    "calibration": Calibration,
    "discovery": Discovery,
    "head": HeadCalibration,
    "triad": TriadCalibration,
    "discoveries and their stand": StandDiscovery,
}
ODD = [None, True, [], {}, "", "x", [[1]], {"value": 1}, [None], 0, -1, 1, 1e300, 1e-300, math.nan]


def places(part, path=()):
    """Paths to every part of a document."""
    items = part.items() if isinstance(part, dict) else enumerate(part)
    for key, item in items:
        yield (*path, key)
        if isinstance(item, dict | list):
            yield from places(item, (*path, key))


@pytest.mark.parametrize("name", READERS)
@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_any_damage_gives_a_result_or_a_line(name, data):
    document = json.loads(written(name))
    document = document.get("stand", document)
    keys = data.draw(st.sampled_from(list(places(document))))
    odd = data.draw(st.sampled_from([(), *((value,) for value in ODD)]))
    text = changed(document, keys, *odd)
    assert fate(READERS[name], text) in ("read", "told")


def fate(result, text):
    """Whether a text is read, and again when it is written, or refused in a line."""
    try:
        found = result.from_json(text)
    except DocumentError as error:
        said = str(error)
        whole = said.endswith(f"; give a file as {result._WRITER} writes it") and "\n" not in said
        return "told" if whole else said
    return "read" if result.from_json(found.to_json()) == found else "changed"


@pytest.mark.parametrize(
    ("way", "unit", "right"),
    [
        (("tables", 0, "coefficients", "K1"), "uA/g", "mA/g"),
        (("tables", 2, "coefficients", "K2"), "mA/g", "mA/g^2"),
        (("tables", 1, "error_model", "k0"), "mg", "g"),
        (("temperature_model", "k0", "at_T0"), "mg", "g"),
        (("temperature_model", "k0", "below"), "ug/degC", "g/degC"),
        (("temperature_model", "K1", "at_T0"), "V/g", "mA/g"),
        (("temperature_model", "K1", "above"), "ppm/degC", "1/degC"),
        (("temperature_model", "delta", "at_T0"), "mrad", "rad"),
    ],
)
def test_a_value_in_another_unit_is_refused(way, unit, right):
    document = json.loads(calibration())
    functools.reduce(lambda part, key: part[key], way, document)["unit"] = unit
    key = "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in way)[1:]
    said = f"key {key}.unit: '{unit}' in place of '{right}'; give a file as accelcal fit writes it"
    with pytest.raises(DocumentError) as caught:
        Calibration.from_json(json.dumps(document))
    assert str(caught.value) == said


def test_the_unit_of_a_value_that_is_not_there_does_not_matter():
    document = json.loads(calibration())
    law = document["temperature_model"]["delta"]
    law["below"] = None
    law["above"] |= {"value": None, "unit": "?"}
    assert Calibration.from_json(json.dumps(document)).temperature_model.delta.below is None


# -- results that no command reads -----------------------------------------------------------------


def compared():
    found = accelcal.fit(accelcal.simulate(seed=1))
    tilted = [accelcal.effect("fixture-offset").of(1e-4)]
    return accelcal.compare(found, accelcal.simulate(effects=tilted, seed=2))


def followed():
    found = [accelcal.fit(unit) for unit in units() * 4]
    return accelcal.history(
        [dataclasses.replace(f, serial="A", date=f"{2015 + i}-06-01") for i, f in enumerate(found)]
    )


READ_BACK = {
    "comparison": (compared, ("gap", "rms")),
    "history": (followed, ("trends", 1, "scatter", "low")),
    "design": (
        lambda: accelcal.design(positions=[8, 24], strokes=[1], targets={"K1": 9e-6}),
        ("designs", 0, "forecasts", 0, "standard_uncertainty"),
    ),
    "optimal-design": (
        lambda: accelcal.optimal_design("K1", hours=4.0, temperatures=(20.0,)),
        ("comparison", "designs", 1, "hours"),
    ),
}


@functools.cache
def made(name):
    return READ_BACK[name][0]()


@pytest.mark.parametrize("name", READ_BACK)
def test_results_are_read_back(tmp_path, name):
    found, way = made(name), READ_BACK[name][1]
    found.to_json(tmp_path / "found.json")
    again = type(found).from_json(tmp_path / "found.json")
    assert again == found
    assert str(again) == str(found)
    document = json.loads(found.to_json())
    part = functools.reduce(lambda at, key: at[key], way[:-1], document)
    part[way[-1]] = "wide"
    with pytest.raises(DocumentError, match=f"{way[-1]}.* in place of a number"):
        type(found).from_document(document)
    with pytest.raises(DocumentError, match=f"'accelcal/triad/1' in place of 'accelcal/{name}/1'"):
        type(found).from_json(triad())


def test_a_result_keeps_what_it_was_born_with():
    given = [1e-6]
    residuals = Residuals([45.0], [1], given)
    given[0] = 2e-6
    assert residuals == Residuals((45.0,), (1,), (1e-6,))


@pytest.mark.parametrize("name", READ_BACK)
@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_what_is_read_back_can_be_printed(name, data):
    found = made(name)
    document = json.loads(found.to_json())
    keys = data.draw(st.sampled_from(list(places(document))))
    odd = data.draw(st.sampled_from([(), *((value,) for value in ODD)]))
    try:
        again = type(found).from_json(changed(document, keys, *odd))
    except DocumentError:
        return
    assert str(again)
    assert repr(again)


@pytest.mark.parametrize("laws", ["tables", "readings"])
def test_a_calibration_of_readings_without_noise_is_read_back(laws):
    """Of its covariances only rounding was left, not symmetric, and the reader refused them."""
    at = [(t, k, j) for t in (20.0, 80.0, -40.0) for k in range(1, 7) for j in range(9)]
    temperature, stroke, position = np.array(at).T
    angle = 45.0 * position
    columns = {"temperature": temperature, "stroke": stroke, "angle": angle}
    columns["output"] = np.round(1.35 * np.cos(np.radians(angle)) + 0.01, 9)
    declared = {"head_uncertainty": 6.7e-6, "launch_uncertainty": 6.7e-6}
    declared |= {"launch_sf_uncertainty": 5e-6, "temperature_uncertainty": 0.0}
    declared |= {"resolution": 1e-7, "unit": "mA"}
    found = accelcal.fit(accelcal.read_arrays(columns, overrides=declared), temperature_laws=laws)
    assert Calibration.from_json(found.to_json()) == found
