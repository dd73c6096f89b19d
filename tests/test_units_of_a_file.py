"""Files of several units: which of them a command takes, and in which unit of the output."""

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import accelcal
from accelcal.cli.main import main
from accelcal.effects.catalogue import effect
from accelcal.errors import DocumentError, InputError
from accelcal.io.readings import Readings

HIDDEN = {"A1": effect("backlash").of(2e-5), "B2": effect("hysteresis").of(3e-5)}
SHORT = accelcal.TumblePlan(temperatures=(20.0,))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Tables of two units with an effect each, one table of both, and what discover makes of it."""
    folder = tmp_path_factory.mktemp("units")
    records = []
    for seed, (serial, hidden) in enumerate(HIDDEN.items(), 3):
        unit = replace(accelcal.Accelerometer(), serial=serial)
        records.append(accelcal.simulate(unit, SHORT, effects=[hidden], seed=seed))
        accelcal.write_table(records[-1], folder / f"{serial}.csv")
    rows = [
        f"{serial},{t},{a:g},{k},{y:.7f}"
        for serial, r in zip(HIDDEN, records, strict=True)
        for t, a, k, y in zip(r.temperature, r.angle, r.stroke, r.output, strict=True)
    ]
    head = "# unit: mA\n# head_uncertainty: 6.7e-6\n# launch_uncertainty: 6.7e-6\n"
    text = head + "serial,temperature,angle,stroke,output\n" + "\n".join(rows) + "\n"
    (folder / "both.csv").write_text(text)
    assert main(["discover", str(folder / "both.csv"), "-o", str(folder / "model.json")]) == 0
    return folder


@pytest.fixture
def run(folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)

    def run(*arguments):
        code = main(list(arguments))
        return code, *capsys.readouterr()

    return run


def test_fit_takes_the_model_of_each_unit(run):
    code, out, _ = run("fit", "both.csv", "--model", "model.json", "--format", "json")
    assert code == 0
    found = {c["serial"]: [e["id"] for e in c["effects"]] for c in json.loads(out)["calibrations"]}
    assert found == {"A1": ["backlash"], "B2": ["hysteresis"]}


def test_a_unit_that_the_models_lack_is_refused(run):
    code, _, err = run("fit", "A1.csv", "--serial", "C3", "--model", "model.json")
    assert code == 2
    assert "model.json: serial C3 is asked for, but it holds the discovery of A1, B2" in err


def test_the_only_model_fits_any_unit_and_says_whose_it_is(run, folder):
    item = json.loads((folder / "model.json").read_text())["discoveries"][0]
    (folder / "a1.json").write_text(json.dumps(item))
    said = (
        "the discovery of another unit, serial A1, says which effects are taken out; their sizes"
        " are fitted to these readings"
    )
    code, out, _ = run("fit", "B2.csv", "--model", "a1.json")
    assert code == 0
    assert said in " ".join(out.split())
    assert said not in " ".join(run("fit", "A1.csv", "--model", "a1.json")[1].split())
    # a batch took it out of all units without a word
    assert run("batch", "A1.csv", "B2.csv", "-o", "out.csv", "--model", "a1.json")[0] == 0
    rows = list(csv.DictReader((folder / "out.csv").read_text("utf-8").splitlines()))
    assert {row["serial"] for row in rows if said in row["warnings"]} == {"B2"}


def test_a_batch_takes_one_model(run):
    code, _, err = run("batch", "A1.csv", "-o", "out.csv", "--model", "model.json")
    assert code == 2
    assert "it holds the discoveries of A1, B2, and all tables take one model; save one" in err


def test_simulate_makes_the_twin_of_the_serial(run):
    assert run("simulate", "--model", "model.json", "--serial", "B2", "-o", "twin.csv")[0] == 0
    assert "hysteresis" in accelcal.read_table("twin.csv").metadata["simulated"]
    code, _, err = run("simulate", "--model", "model.json", "-o", "twin.csv")
    assert code == 2
    assert "it holds serials A1, B2; choose one by its serial" in err


def test_a_discovery_is_read_by_its_serial(folder):
    found = accelcal.read_discovery(str(folder / "model.json"), serial="B2")
    assert [entry.id for entry in found.effects] == ["hysteresis"]


def test_a_calibration_is_read_by_its_serial(folder, run):
    assert run("fit", "both.csv", "-o", "both.json")[0] == 0
    path = folder / "both.json"
    assert accelcal.read_calibration(path, serial="B2").serial == "B2"
    with pytest.raises(InputError, match="it holds serials A1, B2; choose one by its serial"):
        accelcal.read_calibration(path)
    with pytest.raises(
        DocumentError, match=r"read one by accelcal.read_calibration\(file, serial\)"
    ):
        accelcal.Calibration.from_json(path)


def test_discover_searches_one_unit_of_a_table(run):
    code, out, _ = run("discover", "both.csv", "--serial", "B2", "--format", "json")
    document = json.loads(out)
    assert (code, document["serial"]) == (0, "B2")
    assert [entry["id"] for entry in document["effects"]] == ["hysteresis"]
    code, _, err = run("discover", "both.csv", "--serial", "C3")
    assert (code, err) == (2, "error: no serial 'C3' in the tables; there is A1, B2\n")


def test_fit_and_check_choose_one_unit_of_a_table(run):
    """The serial number was refused, as if it were that of the whole table."""
    code, out, err = run("fit", "both.csv", "--serial", "B2", "--format", "json")
    assert (code, json.loads(out)["serial"], err) == (0, "B2", "")
    assert run("check", "both.csv", "--serial", "B2")[1].count("\nserial ") == 1
    code, _, err = run("fit", "both.csv", "--serial", "C3")
    assert (code, err) == (2, "error: no serial 'C3' in the tables; there is A1, B2\n")
    code, _, err = run("check", "both.csv", "--serial", "C3")
    assert (code, err) == (2, "both.csv: no serial 'C3' in the tables; there is A1, B2\n")


def test_fit_chooses_one_unit_of_several_tables(run):
    """All of them were taken as tables of it."""
    code, out, err = run("fit", "A1.csv", "both.csv", "--serial", "B2", "--format", "json")
    assert (code, json.loads(out)["source"], err) == (0, "both.csv", "")


def test_compare_takes_each_unit_with_its_calibration(run):
    assert run("fit", "both.csv", "-o", "cal.json")[0] == 0
    code, out, _ = run("compare", "cal.json", "both.csv", "--format", "json")
    assert code == 0
    assert [each["serial"] for each in json.loads(out)["comparisons"]] == ["A1", "B2"]
    code, out, _ = run("compare", "cal.json", "both.csv", "--serial", "B2", "--format", "json")
    assert json.loads(out)["serial"] == "B2"


@pytest.mark.parametrize(("unit", "factor"), [("A", 1e-3), ("uA", 1e3)])
def test_compare_converts_the_unit_of_the_readings(unit, factor):
    first, second = (accelcal.simulate(plan=SHORT, seed=seed) for seed in (1, 2))
    calibration = accelcal.fit(first)
    other = replace(
        second.with_apparatus(resolution=1e-4 * factor), output=second.output * factor, unit=unit
    )
    coarse = second.with_apparatus(resolution=1e-4)
    found, wanted = (accelcal.compare(calibration, record) for record in (other, coarse))
    assert found.p_value == pytest.approx(wanted.p_value, rel=1e-6)
    for one, two in zip(found.runs, wanted.runs, strict=True):
        assert one.bias.value == pytest.approx(two.bias.value, abs=1e-12)
        assert one.bias.standard_uncertainty == pytest.approx(two.bias.standard_uncertainty)
    assert f"readings in {unit} are converted to mA" in found.notes
    assert np.array_equal(other.output, second.output * factor)


def test_a_unit_that_is_not_named_is_said():
    first, second = (accelcal.simulate(plan=SHORT, seed=seed) for seed in (1, 2))
    said = accelcal.compare(accelcal.fit(first), replace(second, unit=None)).notes
    assert "the record names no unit: its readings are taken as mA" in said
    said = accelcal.compare(accelcal.fit(replace(first, unit=None)), second).notes
    assert "the calibration names no unit: it is taken as that of the readings, mA" in said


# -- --unit against the unit of the file -----------------------------------------------------------

STAND = "x,0,1.3,0.01,0\nx,90,0,1.3,0.02\nx,180,0,-0.01,1.3\ny,0,0.01,1.3,0\ny,90,0,0.03,1.3\n"
ASKED = "the table has outputs in 'mA'; they are taken as uA, as asked"
OTHER_FILES = {
    "stability": "time,output\n" + "".join(f"{t},{1.3 + 1e-6 * (t % 7):.6f}\n" for t in range(60)),
    "triad": "shaft,angle,x,y,z\n" + STAND,
    "apply of_A1.json": "temperature,output\n20,1.0\n",
}


@pytest.mark.parametrize("command", OTHER_FILES)
@pytest.mark.parametrize("place", ["header", "heading"])
def test_a_unit_against_that_of_the_file_is_said(run, folder, command, place):
    assert run("fit", "A1.csv", "-o", "of_A1.json")[0] == 0
    text = OTHER_FILES[command]
    if place == "header":
        text = "# unit: mA\n" + text
    else:
        text = text.replace("output", "output [mA]", 1).replace("x,y,z", "x_mA,y_mA,z_mA", 1)
    (folder / "file.csv").write_text(text)
    for unit, times in (("uA", 1), ("mA", 0)):
        code, out, err = run(*command.split(), "file.csv", "--unit", unit)
        assert code == 0
        told = out + err if command != "apply of_A1.json" else err  # its file has it in the header
        assert " ".join(told.split()).count(ASKED) == times


def test_the_work_of_dividing_a_file_grows_as_its_rows_do(monkeypatch):
    units, taken = 50, []
    select = Readings.select
    monkeypatch.setattr(
        Readings, "select", lambda own, chosen: (taken.append(chosen.size), select(own, chosen))[1]
    )
    position = np.tile(np.arange(1, 10), units)
    rows = {
        "serial": np.repeat([f"S{n}" for n in range(units)], 9)[::-1],
        "temperature": 20.0,
        "position": position,
        "stroke": 1,
        "output": np.cos(np.radians(45.0 * position)),
    }
    records = accelcal.read_tables(io.BytesIO(pd.DataFrame(rows).to_csv(index=False).encode()))
    assert [record.serial for record in records] == [f"S{n}" for n in range(units)][::-1]
    assert all(record.position.tolist() == list(range(1, 10)) for record in records)
    assert sum(taken) <= 2 * position.size


@pytest.mark.parametrize("unit", ["gon", "gons", "grads", "gradian", "Gradians"])
def test_angles_in_gon_are_refused_however_they_are_called(unit):
    """Grads and gradians were taken for degrees, with a note."""
    text = f"temperature,angle [{unit}],stroke,output\n20,0,1,1.3\n20,100,1,0.0\n"
    with pytest.raises(accelcal.TableError, match=f"is in {unit}; give it in deg"):
        accelcal.read_table(io.StringIO(text))
