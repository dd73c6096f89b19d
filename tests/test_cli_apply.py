"""accelcal apply: streams in, streams out, and everything that may be wrong with them."""

import csv
import gzip
import io
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import accelcal
from accelcal.cli.main import main
from accelcal.errors import TableError
from accelcal.io.files import parquet as parquet_module
from accelcal.io.samples import reader as samples_module
from accelcal.io.samples.reader import open_samples

HEAD = "# serial: AL-15\n# unit: mA\n"


@pytest.fixture(scope="module")
def calibration():
    return accelcal.fit(accelcal.simulate(seed=1))


@pytest.fixture(scope="module")
def one_level():
    return accelcal.fit(accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0,)), seed=1))


@pytest.fixture
def folder(tmp_path, monkeypatch, calibration):
    monkeypatch.chdir(tmp_path)
    calibration.to_json("cal.json")
    return tmp_path


@pytest.fixture
def run(folder, capsys):
    """Run apply on a text; returns exit code, rows of the result and lines of standard error."""

    def run_on(text, *options, cal="cal.json"):
        (folder / "data.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
        code = main(["apply", cal, "data.csv", "-o", "out.csv", *options])
        out = folder / "out.csv"
        rows = rows_of(out.read_text()) if out.exists() else None
        return code, rows, capsys.readouterr().err

    return run_on


def test_several_declarations_in_a_line(run):
    """The unit was lost, and 1.35 V passed for 1.35 mA."""
    code, _, err = run("# serial: AL-15; unit: V\noutput,temperature\n1.35,20\n")
    assert code == 2
    assert "V" in err


@pytest.mark.parametrize("line", ["# Temperature, °C: 60", "# Temperature in degC: 60"])
def test_a_header_line_with_a_unit_behind_its_key(run, line):
    """The temperature was not read."""
    plain = run("# serial: AL-15\n# unit: mA\n# temperature: 60\noutput\n1.3\n")
    assert run(f"# serial: AL-15\n# unit: mA\n{line}\noutput\n1.3\n") == plain
    assert plain[0] == 0


@pytest.mark.parametrize("start", ["", '"time",', '"","time",'])
def test_headings_in_quotes(run, start):
    """The first heading kept a quote: R's output was no column, and a time went missing."""
    cells = '"1","1",'[: 4 * start.count(",")]
    code, found, err = run(f'{start}"output [mA]","temperature"\n{cells}1.3,20\n')
    plain = run(f"{start}output [mA],temperature\n{cells}1.3,20\n".replace('"', ""))
    assert (code, found) == plain[:2] == (0, found)
    assert "not used" not in err
    assert run('"output,temperature"\n1.3,20\n')[1] == run("output,temperature\n1.3,20\n")[1]


def test_a_lone_heading_with_its_unit(run):
    """The unit was a second heading, and the rows had a field too few."""
    code, rows, error = run("I [mA]\n1.35\n0.2\n", "--temperature", "20")
    assert (code, len(rows)) == (0, 2)
    assert "column 'I [mA]' is taken for the outputs, by its unit" in error


def test_a_blank_heading_between_tabs(run):
    """It was cut off, and the rows had a field too many."""
    plain = run("output\ttemperature\n1.3\t20\n1.2\t\n")[1]
    assert run("\toutput\ttemperature\n0\t1.3\t20\n1\t1.2\t\n")[:2] == (0, plain)


@pytest.mark.parametrize("time", ["31.05.2024 10:00:00", "10:00:00.125"])
def test_points_of_dates_are_no_decimal_marks(run, time):
    """Decimal commas beside them were refused."""
    head = "Zeit;Temperatur [°C];Strom [mA]\n"
    code, rows, _ = run(f"{head}{time};21,5;1,30\n")
    plain = run(f"{head}0;21.5;1.30\n")[1]
    assert code == 0
    assert [row["acceleration"] for row in rows] == [row["acceleration"] for row in plain]


def test_commas_of_texts_are_no_decimal_marks(run):
    plain = run("output;temperature\n1.3;20\n")[1]
    assert run("output;temperature;remark\n1.3;20;a, b, c, d\n")[1] == plain


def test_units_in_the_cells(run):
    """They were no numbers."""
    plain = run(HEAD + "temperature,output\n20,1.3\n,0.5\n")
    told = run(HEAD + "temperature,output\n20 degC,1.3 mA\n,0.5 mA\n")
    assert told == plain
    assert told[0] == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("T,output\n20,NA\n20,1.3 mA", ":4: output '1.3 mA' has a unit, and its heading has none;"),
        ("T,output [uA]\n20,1.3 mA", "under a heading in uA; use one unit"),
        ("T,output [mA]\n20 K,1.3 mA", "has a unit, and its heading has none; write it in"),
        ("T,output [mA]\n20,1.3 mA\n20,1.3", "'1.3' after cells in mA; use one unit"),
    ],
)
def test_units_in_the_cells_that_contradict_are_refused(run, text, message):
    code, rows, err = run("# serial: AL-15\n" + text + "\n")
    assert (code, rows) == (2, None)
    assert message in err


def test_units_in_the_cells_that_the_option_names(run):
    """They were refused, as the heading has none; the option did not count."""
    plain = run("# serial: AL-15\ntemperature,output\n20,1.3\n20,0.5\n", "--unit", "mA")
    told = run("# serial: AL-15\ntemperature,output\n20,1.3 mA\n20,0.5 mA\n", "--unit", "mA")
    assert told == plain
    assert told[0] == 0


@pytest.mark.parametrize(("heading", "cell"), [("uA", "µA"), ("мкА", "мкА"), ("µA", "uA")])
def test_units_in_the_cells_in_another_spelling(run, heading, cell):
    """They were refused, although the heading has the same unit."""
    text = "# serial: AL-15\ntemperature,output [{}]\n20,1300{}\n"
    assert run(text.format(heading, " " + cell)) == run(text.format(heading, ""))


@pytest.mark.parametrize("block", [samples_module.BLOCK, 40], ids=["light", "bulk"])
def test_the_column_of_units_counts(run, monkeypatch, block):
    """It was set aside: outputs in uA passed for mA, 1000 times as large."""
    monkeypatch.setattr(samples_module, "BLOCK", block)
    text = "# serial: AL-15\noutput,temperature,{}\n{}{}" + "1300,20,µA\n900,21,uA\n" * 5
    code, rows, err = run(text.format("unit", "", ""))
    assert (code, len(rows)) == (0, 10)
    assert err.startswith("note: outputs in uA are converted to mA\n")
    assert float(rows[0]["acceleration"]) == pytest.approx(0.9595, abs=1e-4)
    first = "# a remark\n1300,20,\n"  # its unit stands further down
    assert run(text.format("Einheit", first, ""))[1][1:] == rows
    code, _, err = run(text.format("unit", "", "1.3,20,V\n"))
    assert (code, err) == (2, "error: data.csv: outputs in V, but the calibration is for mA; give"
                              " the outputs in its unit\n")  # fmt: skip
    code, _, err = run(text.format("unit", "", "") + "1.3,20,mA\n")
    assert (code, err.splitlines()[-1]) == (
        2,
        "data.csv:13: unit 'mA' after samples in uA; write all outputs in one unit, or samples that"
        " differ into a file of their own",
    )


def test_a_column_of_units_and_another_declaration(run):
    text = "temperature,output{},unit\n20,1.3,mA\n20,0.5,mA\n"
    code, _, err = run("# serial: AL-15\n" + text.format(" [uA]"))
    sentence = "units 'uA' and 'mA' in one table; give all outputs and their std in one unit"
    assert (code, err) == (2, f"data.csv:3: {sentence}\n")
    code, rows, err = run("# serial: AL-15\n" + text.format(""), "--unit", "A")
    assert (code, float(rows[0]["acceleration"]) > 100.0) == (0, True)
    assert "the table has outputs in 'mA'; they are taken as A, as asked" in err
    empty = run("# serial: AL-15\n" + text.format("").replace("mA", ""))
    assert empty[0] == 0
    assert "the stream names no unit; outputs are taken as mA" in empty[2]


@pytest.mark.parametrize("line", ["# unit: V", "# serial: B-2;;", '"# temperature: 60"'])
def test_header_lines_between_the_samples_are_refused(run, line):
    """Of files set one below the other the samples counted in the unit of the first."""
    text = HEAD + "# temperature: 20\noutput\n1.3\n{}\n1.3\n"
    code, rows, err = run(text.format(line))
    assert (code, rows) == (2, None)
    assert "data.csv:6: header line '" in err
    for harmless in ("# unit: mA", "# a pause: 3 min", "# date: 2024-05-31"):
        assert run(text.format(harmless))[0] == 0


def test_header_lines_between_the_samples_are_void_where_a_column_tells_it(run):
    text = HEAD + "temperature,output\n20,1.3\n{}30,1.3\n"
    assert run(text.format("# temperature: 60\n")) == run(text.format(""))


def test_header_lines_between_the_samples_may_say_the_same_in_another_spelling(run):
    """They were refused as others: 20.0 after 20, mA where the heading has it."""
    text = "# temperature: 20\noutput [mA]\n1.3\n# temperature: 20.0 degC\n# unit: mA\n1.3\n"
    assert run(text)[0] == 0


def test_units_below_the_headings(run):
    """`accelcal fit` took them, and apply refused them as no numbers."""
    text = "Zeit;Temperatur;Ausgang;a_p\ns;°C;mA;g\n0,0;20,0;1,35471;0\n0,1;20,0;1,35472;0\n"
    code, rows, err = run(HEAD.replace("# unit: mA\n", "") + text)
    assert (code, len(rows)) == (0, 2)
    assert "note: the units stand below the headings (line 3)" in err
    plain = run(HEAD + "time,temperature,output,a_p\n0,20,1.35471,0\n0.1,20,1.35472,0\n")[1]
    assert [row["acceleration"] for row in rows] == [row["acceleration"] for row in plain]
    code, _, err = run("output,temperature,a_p\nV,degC\n1.35,20,0\n")
    assert code == 2
    assert "outputs in V, but the calibration is for mA" in err
    assert run("output,temperature\nmA,degC\n")[2].count("no samples") == 1


def parquet(frame, folder):
    pytest.importorskip("pyarrow")
    frame.to_parquet(folder / "data.parquet")
    return (folder / "data.parquet").read_bytes()


FLIGHT = {"time": ["0.0", "0.1, later", None], "T": [20.0, 21.0, 22.0], "Y [mA]": [1.3, 0.1, None]}


@pytest.mark.parametrize("way", ["plain", "gzip", "standard input", "parts"])
def test_a_stream_may_be_parquet(run, folder, monkeypatch, way):
    content = parquet(pd.DataFrame(FLIGHT), folder)
    plain = run('time,T,Y [mA]\n0.0,20,1.3\n"0.1, later",21,0.1\n,22,\n')[1]
    if way == "parts":
        monkeypatch.setattr(parquet_module, "_ROWS", 2)
    if way == "standard input":
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(Unseekable(content)))
        assert main(["apply", "cal.json", "-", "-o", "piped.csv"]) == 0
        assert rows_of(Path("piped.csv").read_text("utf-8")) == plain
    else:
        assert run(gzip.compress(content) if way == "gzip" else content)[:2] == (0, plain)


class Unseekable(io.BytesIO):
    def seekable(self):
        return False


def test_a_parquet_stream_that_cannot_be_used(run, folder, monkeypatch):
    content = parquet(pd.DataFrame(FLIGHT), folder)
    code, _, err = run(content[:-20])
    assert (code, err.count("\n")) == (2, 1)
    assert err.startswith("data.csv: no Parquet file")
    assert (
        "data.csv:1: no column output among 'a, b'"
        in run(parquet(pd.DataFrame({"a": [1], "b": [2]}), folder))[2]
    )
    several = parquet(pd.DataFrame({"output": [[1.0, 2.0]], "T": [20.0]}), folder)
    assert "data.csv: column 'output' holds list" in run(several)[2]
    assert "column headings but no samples" in run(parquet(pd.DataFrame(FLIGHT)[:0], folder))[2]
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert "Parquet needs pyarrow" in run(content)[2]


BELOW_EACH_OTHER = (
    "time,serial,temperature,output\n0,AL-15,20,1.35471\n0,B2,20,1.2\n1,AL-15,20,0.0\n1,,20,1.1\n"
)


@pytest.mark.parametrize("block", [samples_module.BLOCK, 8], ids=["light", "bulk"])
def test_samples_of_accelerometers_below_each_other(run, folder, calibration, monkeypatch, block):
    alone = run(HEAD + "time,temperature,output\n0,20,1.35471\n1,20,0.0\n")[1]
    monkeypatch.setattr(samples_module, "BLOCK", block)
    code, rows, err = run("# unit: mA\n" + BELOW_EACH_OTHER)
    assert (code, rows) == (0, alone)
    assert "warning: 2 samples of other serials, 'B2, ', are set aside" in err
    replace(calibration, serial=None).to_json(folder / "nameless.json")
    code, _, err = run(BELOW_EACH_OTHER, cal="nameless.json")
    assert code == 2
    assert err.startswith("data.csv:1: a column serial; choose one by its serial")
    code, rows, _ = run(BELOW_EACH_OTHER, "--serial", "B2", cal="nameless.json")
    assert (code, [row["time"] for row in rows]) == (0, ["0"])


SIDE_BY_SIDE = "time,temperature,S/N AL-15 [mA],S/N B2 [mA]\n0,20,1.35471,1.2\n1,20,0.0,1.2\n"


def test_outputs_of_accelerometers_side_by_side(run, folder, calibration):
    code, rows, err = run(SIDE_BY_SIDE)
    assert code == 0
    assert "note: outputs of 'B2' are set aside" in err
    alone = run(HEAD + "time,temperature,output\n0,20,1.35471\n1,20,0.0\n")[1]
    assert rows == alone
    listed = SIDE_BY_SIDE.replace("S/N ", "").replace(" [mA]", "")
    assert run("# unit: mA\n# serials: B2, AL-15\n" + listed)[1] == alone
    assert run(listed)[0] == 2
    nameless = folder / "nameless.json"
    replace(calibration, serial=None).to_json(nameless)
    assert run(SIDE_BY_SIDE, "--serial", "AL-15", cal="nameless.json")[1] == alone
    assert run(SIDE_BY_SIDE, "--serial", "B2", cal="nameless.json")[1] != alone


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (SIDE_BY_SIDE, ["--serial", "B2"], "serial B2 is asked for, but it holds"),
        (SIDE_BY_SIDE.replace("AL-15", "C3"), [], ":1: outputs of C3, B2, none of AL-15; choose"),
        (SIDE_BY_SIDE.replace("B2", "AL-15"), [], ":1: two columns of one serial"),
        (SIDE_BY_SIDE.replace("15 [mA]", "15 [V]"), [], "outputs in V, but the calibration is"),
        ("# unit: V\n" + SIDE_BY_SIDE, [], ":2: units 'mA' and 'V' in one table"),
        ("# serials: AL-15, C3\ntime,AL-15\n0,1.2\n", [], ":2: no column 'C3', which serials has"),
    ],
)
def test_an_accelerometer_that_does_not_stand_there(run, text, options, message):
    code, rows, err = run(text, *options)
    assert (code, rows) == (2, None)
    assert message in err
    assert len(err.strip().splitlines()) == 1


def test_a_nameless_calibration_needs_to_be_told_which_accelerometer(run, folder, calibration):
    replace(calibration, serial=None).to_json(folder / "nameless.json")
    code, _, err = run(SIDE_BY_SIDE, cal="nameless.json")
    assert code == 2
    assert ":1: outputs of AL-15, B2; choose one" in err


def rows_of(text):
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


def values(rows, column="acceleration"):
    return [float(row[column]) for row in rows]


# -- what comes out --------------------------------------------------------------------------------


def test_agrees_with_the_library(run, calibration):
    text = HEAD + "time,output,temperature,a_p\n0.0,1.3547,20,0\n0.1,-1.3,-30.5,0.25\n"
    code, rows, _ = run(text)
    expected = accelcal.apply(calibration, [1.3547, -1.3], [20.0, -30.5], a_p=[0.0, 0.25])
    assert code == 0
    assert values(rows) == pytest.approx(expected.value.tolist(), rel=0, abs=1e-14)
    assert values(rows, "standard_uncertainty") == pytest.approx(
        expected.standard_uncertainty, rel=5e-3
    )
    assert values(rows, "expanded_uncertainty") == pytest.approx(
        expected.expanded_uncertainty, rel=5e-3
    )
    assert [row["time"] for row in rows] == ["0.0", "0.1"]
    assert [row["inside"] for row in rows] == ["1", "1"]


def test_header_says_where_the_result_comes_from(run, folder):
    run(HEAD + "output,temperature\n1,20\n")
    text = (folder / "out.csv").read_text()
    assert "# serial: AL-15\n# acceleration_unit: g_local\n# calibration: cal.json, SHA-256" in text
    digest = accelcal_sha(folder / "cal.json")
    assert digest in text


def test_header_says_what_the_uncertainty_leaves_out(run, folder):
    """Whoever had the file alone took U for all there is: warnings went to the terminal only."""
    found = accelcal.fit(accelcal.simulate(plan=accelcal.TumblePlan(positions=4), seed=1))
    (folder / "cal.json").write_text(found.to_json(), "utf-8")
    run(HEAD + "output,temperature\n1,20\n")
    told = [line for line in (folder / "out.csv").read_text("utf-8").split("\n") if line[:1] == "#"]
    assert told[5].startswith("# note: no column a_p: it is taken as 0, an error of 1.15 mg")
    assert told[6:] == [
        "# warning: K3, M_ip were not determined and taken as 0; K1 stands for K1 + K3"
    ]


def test_no_name_breaks_the_header(run, folder):
    """A line feed in a serial number, which JSON may hold, began a row of its own."""
    found = accelcal.fit(accelcal.simulate(replace(accelcal.AL15, serial="A\nB"), seed=1))
    (folder / "cal.json").write_text(found.to_json(), "utf-8")
    run("output,temperature\n1,20\n")
    text = (folder / "out.csv").read_text("utf-8")
    assert text.startswith("# serial: A\\nB\n# acceleration_unit")


def accelcal_sha(path):
    import hashlib

    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_metres_per_second_squared_by_the_gravity_of_the_calibration(run):
    text = HEAD + "output,temperature\n1,20\n-1,30\n"
    in_g = values(run(text)[1])
    code, rows, _ = run(text, "--in", "m/s^2", "--g", "9.8106", "--same-launch")
    assert code == 0
    assert values(rows) == pytest.approx([9.8106 * a for a in in_g], rel=1e-14)
    assert values(rows, "standard_uncertainty")[0] == pytest.approx(8.2e-6 * 9.81, rel=0.2)


def test_the_next_launch_counts_unless_it_is_the_same(run, calibration):
    text = HEAD + "output,temperature\n0,20\n"
    new, same = (
        values(run(text, *option)[1], "standard_uncertainty")[0]
        for option in ((), ("--same-launch",))
    )
    (launch,) = [s.value for s in calibration.error_sources if s.name == "launch"]
    assert new**2 - same**2 == pytest.approx(launch**2, rel=0.1)


def test_laws_that_are_not_determined_are_refused(tmp_path, capsys):
    plan = accelcal.TumblePlan(temperatures=(-40.0, 80.0))
    fit = accelcal.fit(accelcal.simulate(plan=plan, seed=1), reference_temperature=20.0)
    fit.to_json(tmp_path / "cal.json")
    (tmp_path / "data.csv").write_text("output,temperature\n1,20\n", encoding="utf-8")
    for command in (
        ["apply", "cal.json", "data.csv", "-o", "out.csv"],
        ["export", "cal.json", "-o", "cal.h"],
        ["budget", "cal.json"],
    ):
        paths = [str(tmp_path / a) if "." in a else a for a in command]
        assert main(paths) == 2
        err = capsys.readouterr().err
        assert err.count("\n") == 1
        assert "no coefficients at T0 = 20 degC: its laws have a level on each side of it" in err
        assert "fit with T0 at one of the levels" in err


def test_metres_per_second_squared_need_gravity(run):
    code, rows, err = run(HEAD + "output,temperature\n1,20\n", "--in", "m/s^2")
    assert (code, rows) == (2, None)
    assert "needs the gravity of the place of calibration" in err


def test_missing_samples_stay_in_their_place(run):
    text = HEAD + "output,temperature\n1,20\n,20\nnan,20\n1,\n1,20\n"
    code, rows, err = run(text)
    assert code == 0
    assert np.isnan(values(rows)).tolist() == [False, True, True, True, False]
    assert "warning: 3 of 5 samples have a value missing" in err


def test_samples_beyond_the_test_are_flagged_and_counted(run):
    code, rows, err = run(HEAD + "output,temperature\n1,20\n27,20\n1e9,20\n")
    assert code == 0
    assert [row["inside"] for row in rows] == ["1", "0", "0"]
    assert values(rows)[1] == pytest.approx(19.4, abs=0.2)
    assert np.isnan(values(rows)[2])
    assert "warning: 1 of 3 samples have an output that no acceleration gives" in err
    assert "warning: 1 of 3 samples are outside the tested -1 to 1 g" in err


@pytest.mark.parametrize("row", ["1e300,20,0", "-1e300,20,0", "1,20,1e300"])
def test_what_no_accelerometer_gives_is_marked_without_a_word_of_numpy(run, row):
    code, rows, err = run(HEAD + f"output,temperature,a_p\n1,20,0\n{row}\n", "--extrapolate")
    assert code == 0
    assert np.isnan(values(rows)).tolist() == [False, True]
    assert np.isnan(values(rows, "standard_uncertainty")).tolist() == [False, True]
    assert [row["inside"] for row in rows] == ["1", "0"]
    assert err.splitlines() == [
        "warning: 1 of 2 samples have an output that no acceleration gives, and get none"
    ]


def test_uncertainty_of_output_and_temperature(run):
    text = HEAD + "output,temperature\n0,20\n"
    quiet = values(run(text)[1], "standard_uncertainty")[0]
    noisy = values(run(text, "--output-uncertainty", "1.35e-4")[1], "standard_uncertainty")[0]
    assert noisy == pytest.approx(np.hypot(quiet, 1e-4), rel=0.01)


# -- temperature -----------------------------------------------------------------------------------


def test_temperature_is_needed(run):
    code, rows, err = run(HEAD + "output\n1\n")
    assert (code, rows) == (2, None)
    assert "data.csv: no column temperature, but the calibration depends on it; give --temp" in err


@pytest.mark.parametrize(
    ("head", "options"), [("", ["--temperature", "35"]), ("# temperature: 35 degC\n", [])]
)
def test_one_temperature_for_all(run, calibration, head, options):
    code, rows, _ = run(HEAD + head + "output\n1\n1.1\n", *options)
    assert code == 0
    assert values(rows) == pytest.approx(
        accelcal.apply(calibration, [1.0, 1.1], 35.0).value, rel=0, abs=1e-14
    )


@pytest.mark.parametrize("temperature", ["293.15", "-9999", "1e300"])
def test_kelvin_and_markers_are_refused_even_where_one_may_extrapolate(run, temperature):
    text = HEAD + f"output,temperature\n1,20\n1,{temperature}\n"
    code, rows, err = run(text, "--extrapolate")
    assert (code, rows) == (2, None)
    assert f"data.csv:5: temperature {float(temperature):g} is no temperature of a test" in err


def test_other_temperatures_name_their_line(run):
    text = HEAD + "output,temperature\n1,20\n\n1,95\n"
    code, rows, err = run(text)
    assert (code, rows) == (2, None)
    assert err.splitlines()[-1].startswith("data.csv:6: temperature 95 degC is more than 1 degC")
    code, rows, err = run(text, "--extrapolate")
    assert code == 0
    assert [row["inside"] for row in rows] == ["1", "0"]
    assert "1 of 2 samples are outside the calibrated temperatures" in err


def test_one_level_without_temperature(run, one_level):
    one_level.to_json("one.json")
    code, rows, err = run(HEAD + "output\n1\n", cal="one.json")
    assert code == 0
    assert rows[0]["inside"] == "1"
    assert "note: no temperature is given; the calibration holds at 20 degC" in err
    code, _, err = run(HEAD + "output,temperature\n1,35\n", cal="one.json")
    assert code == 2
    assert "20 degC only" in err


# -- units and serials -----------------------------------------------------------------------------


@pytest.mark.parametrize("heading", ["output [mV]", "output (counts)", "output_V"])
def test_another_quantity_is_refused(run, heading):
    code, rows, err = run(f"{heading},temperature\n1,20\n")
    assert (code, rows) == (2, None)
    assert "but the calibration is for mA; give the outputs in its unit" in err


def test_another_prefix_is_converted(run):
    in_mA = values(run("output [mA],temperature\n1.25,20\n")[1])
    code, rows, err = run("# unit: uA\noutput,temperature\n1250,20\n")
    assert code == 0
    assert values(rows) == pytest.approx(in_mA, rel=1e-15)
    assert "note: outputs in uA are converted to mA" in err


@pytest.mark.parametrize(
    ("unit", "marker", "told"),
    [("mA", "-9999", 1), ("uA", "999999", 1), ("mA", "-9998", 0), ("uA", "999.99", 0)],
)
def test_markers_of_missing_outputs_are_told(run, unit, marker, told):
    code, rows, err = run(f"output [{unit}],temperature,a_p\n1,20,0\n{marker},20,0\n")
    assert (code, len(rows)) == (0, 2)
    assert err.count("1 of 2 samples have an output that looks like a marker") == told


def test_no_unit_is_said(run):
    assert (
        "note: the stream names no unit; outputs are taken as mA"
        in run("output,temperature\n1,20\n")[2]
    )


def test_two_units_are_refused(run):
    code, _, err = run("# unit: mA\noutput [V],temperature\n1,20\n")
    assert code == 2
    assert "data.csv:2: units 'V' and 'mA' in one table" in err


def test_the_unit_that_is_given_wins_over_a_header_line(run):
    """A header line in mA above a heading in uA was refused, whatever the option said."""
    rows = "output [uA],temperature\n1300,20\n"
    code, found, err = run("# unit: mA\n" + rows, "--unit", "uA")
    assert (code, found) == run(rows)[:2]
    assert "note: the table has outputs in 'mA'; they are taken as uA, as asked" in err


def test_two_units_in_header_lines_are_refused(run):
    code, _, err = run("# unit: mA\n# unit: V\noutput,temperature\n1,20\n")
    assert code == 2
    assert "data.csv:2: unit is 'V', but 'mA' in line 1; declare each key once" in err


@pytest.mark.parametrize("line", ["temperature: 20 °C", "T [degC]: 20", "Temp: 20.0"])
def test_the_temperature_of_all_samples_is_declared_as_in_tables(run, calibration, line):
    code, rows, _ = run(f"{HEAD}# {line}\noutput\n1.25\n")
    assert code == 0
    assert values(rows) == pytest.approx(accelcal.apply(calibration, [1.25], 20.0).value, rel=1e-14)


@pytest.mark.parametrize("rows", [1, 40_000])
def test_temperatures_of_samples_in_another_unit_are_converted(run, rows):
    """They were refused."""
    plain = run(f"{HEAD}temperature,output\n" + "20,1.25\n" * rows)
    for heading, cell in (("T [K]", "293.15"), ("temp_F", "68")):
        found = run(f"{HEAD}{heading},output\n" + f"{cell},1.25\n" * rows)
        assert found[:2] == plain[:2]
        assert "note: temperatures are converted from " in found[2]
    assert (
        run(f"{HEAD}# temperature: 293.15 K\noutput\n1.25\n")[:2]
        == run(f"{HEAD}# temperature: 20\noutput\n1.25\n")[:2]
    )


def test_cross_axis_in_metres_per_second_squared(run, calibration):
    code, rows, _ = run(HEAD + "output,temperature,a_p [m/s^2]\n1,20,9.81\n", "--g", "9.81")
    assert code == 0
    assert values(rows) == pytest.approx(
        accelcal.apply(calibration, [1.0], 20.0, a_p=1.0).value, rel=0, abs=1e-14
    )


@pytest.mark.parametrize("unit", ["m/s2", "m/s²", "m/s**2"])
def test_all_spellings_of_metres_per_second_squared_are_alike(run, unit):
    one, other = (
        run(HEAD + f"output,temperature,a_p [{u}]\n1,20,9.81\n", "--g", "9.81")[1]
        for u in ("m/s^2", unit)
    )
    assert values(one) == values(other)


@pytest.mark.parametrize(
    ("unit", "size"), [("mg", 1e-3), ("ug", 1e-6), ("µg", 1e-6), ("g_local", 1.0)]
)
def test_a_cross_axis_in_parts_of_g(run, calibration, unit, size):
    expected = accelcal.apply(calibration, [1.0], 20.0, a_p=0.5).value
    below = f"output,temperature,a_p\nmA,degC,{unit}\n1,20,{0.5 / size}\n"
    for text in (f"output,temperature,a_p [{unit}]\n1,20,{0.5 / size}\n", below):
        code, rows, _ = run(HEAD.replace("# unit: mA\n", "") + text)
        assert code == 0
        assert values(rows) == pytest.approx(expected, rel=0, abs=1e-14)


def test_the_lone_output_is_taken(run):
    plain = run(HEAD + "output,temperature,a_p\n1.25,20,0\n")[1]
    code, rows, err = run("Current [mA],temperature,a_p,supply\n1.25,20,0,28\n")
    assert (code, values(rows)) == (0, values(plain))
    assert "note: column 'Current [mA]' is taken for the outputs, by its unit" in err
    code, rows, _ = run("Current [mA],temperature,a_p,supply [V]\n1.25,20,0,28\n")
    assert (code, values(rows)) == (0, values(plain))
    code, _, err = run("Current [mA],temperature,a_p,box [V]\n1.25,20,0,28\n")
    assert code == 2
    assert "no column output among" in err


@pytest.mark.parametrize("unit", ["ft/s^2", "gal", "MG"])
def test_a_cross_axis_in_another_unit_is_refused(run, unit):
    code, _, err = run(HEAD + f"output,temperature,a_p [{unit}]\n1,20,500\n")
    assert code == 2
    assert f"a_p in {unit}; give it in g, mg, ug or m/s^2" in err


def test_cross_axis_that_is_not_calibrated_is_set_aside(run):
    _, _, err = run(HEAD + "output,temperature,a_o\n1,20,0.5\n")
    assert "note: column a_o is set aside" in err
    assert "note: no column a_p: it is taken as 0, an error of 1.15 mg for each g" in err


def test_another_accelerometer_is_refused(run):
    code, rows, err = run("# serial: AL-16\n# unit: mA\noutput,temperature\n1,20\n")
    assert (code, rows) == (2, None)
    assert "serial AL-16 is asked for, but it holds the calibration of AL-15" in err


def test_the_serial_chooses_among_several(run, folder):
    document = json.loads((folder / "cal.json").read_text())
    several = {"schema": document["schema"], "calibrations": [document, document | {"serial": "B"}]}
    (folder / "two.json").write_text(json.dumps(several))
    text = "# unit: mA\noutput,temperature\n1,20\n"
    assert run(text, cal="two.json")[0] == 2
    assert run("# serial: B\n" + text, cal="two.json")[0] == 0
    code, _, err = run(text, "--serial", "C", cal="two.json")
    assert code == 2
    assert "serial C is asked for, but it holds the calibration of AL-15, B" in err


def test_a_file_that_is_no_calibration_is_named(run, folder):
    (folder / "bad.json").write_text("{}")
    code, _, err = run(HEAD + "output,temperature\n1,20\n", cal="bad.json")
    assert code == 2
    assert "bad.json: key schema: missing" in err


# -- forms of the stream ---------------------------------------------------------------------------

PLAIN = "# unit: mA\ntime,output,temperature\n0.0,1.25,20.5\n0.1,-1.25,21\n"

FORMS = {
    "decimal comma": PLAIN.replace(",", ";").replace(".", ","),
    "tabs": PLAIN.replace(",", "\t"),
    "blanks": PLAIN.replace(",", "  "),
    "carriage returns": PLAIN.replace("\n", "\r\n"),
    "byte order mark": b"\xef\xbb\xbf" + PLAIN.encode(),
    "UTF-16": PLAIN.encode("utf-16"),
    "gzip": gzip.compress(PLAIN.encode()),
    "latin-1": PLAIN.replace("temperature", "T [°C]").encode("latin-1"),
    "windows-1251": PLAIN.replace("temperature", "Температура, °С")
    .replace(",", ";")
    .replace("Температура;", "Температура,")
    .replace(".", ",")
    .encode("windows-1251"),
    "gbk": PLAIN.replace("temperature", "温度").replace("output", "输出").encode("gbk"),
    "trailing separators": PLAIN.replace("\n0", "\n0").replace("5\n", "5,,\n"),
    "numpy.savetxt": "# unit: mA\n# time,output,temperature\n0.0,1.25,20.5\n0.1,-1.25,21\n",
    "comments": PLAIN.replace("\n0.1", "\n# a remark\n\n0.1"),
    "no last line feed": PLAIN.rstrip("\n"),
    "other columns": "remark,Y [mA],T\nx,1.25,20.5\ny,-1.25,21\n",
    "quotes": PLAIN.replace("0.0,1.25", '0.0,"1.25"'),
    "quotes and decimal comma": (
        '# unit: mA\ntime,output,temperature\n"0,0","1,25","20,5"\n"0,1","-1,25",21\n'
    ),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("block", [samples_module.BLOCK, 16], ids=["light", "bulk"])
def test_forms(run, calibration, monkeypatch, form, block):
    monkeypatch.setattr(samples_module, "BLOCK", block)
    code, rows, _ = run(FORMS[form])
    expected = accelcal.apply(calibration, [1.25, -1.25], [20.5, 21.0])
    assert code == 0
    assert values(rows) == pytest.approx(expected.value, rel=0, abs=1e-14)


BAD = {
    "no such file": (None, "data.csv: no such file"),
    "empty": ("", "data.csv: no samples"),
    "headings only": ("output,temperature\n", "data.csv: column headings but no samples"),
    "no output": ("time,temperature\n0,20\n", "data.csv:1: no column output among"),
    "no headings": ("1.25,20\n1.25,20\n", "data.csv:1: no column output among '1.25, 20'"),
    "twice": ("output,Y,temperature\n1,1,20\n", "data.csv:1: columns 'output' and 'Y' mean"),
    "serials": (
        "serial,output,temperature\nA,1,20\n",
        "data.csv: no sample of serial AL-15, but of A",
    ),
    "mK": (
        "output,temperature [mK]\n1,293\n",
        "data.csv:1: column 'temperature [mK]' is in mK; give it in degC",
    ),
    "text": ("output,temperature\n1,20\n1.2x,20\n", "data.csv:3: output '1.2x' is not a number"),
    "infinite": ("output,temperature\n1,20\ninf,20\n", "data.csv:3: output 'inf' is infinite"),
    "cut short": (
        "output,temperature\n1,20\n1\n",
        "data.csv:3: 1 field, but temperature is field 2",
    ),
    "too long": (
        "output,temperature\n1,20\n1,2,20\n",
        "data.csv:3: 3 fields under 2 column headings",
    ),
    "damaged": (gzip.compress(PLAIN.encode())[:-12], "data.csv: the gzip compression is cut"),
}


@pytest.mark.parametrize("case", BAD)
@pytest.mark.parametrize("block", [samples_module.BLOCK, 8], ids=["light", "bulk"])
def test_bad_streams_leave_nothing_behind(folder, capsys, monkeypatch, case, block):
    monkeypatch.setattr(samples_module, "BLOCK", block)
    text, message = BAD[case]
    if text is not None:
        (folder / "data.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    before = sorted(folder.iterdir())
    assert main(["apply", "cal.json", "data.csv", "-o", "out.csv"]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith(message)
    assert sorted(folder.iterdir()) == before


def test_a_folder_is_no_stream(folder, capsys):
    (folder / "data").mkdir()
    assert main(["apply", "cal.json", "data"]) == 2
    assert capsys.readouterr().err == "data: is a folder; give the path of one file\n"


def test_a_failed_run_keeps_the_former_result(run, folder):
    run(HEAD + "output,temperature\n1,20\n")
    former = (folder / "out.csv").read_text()
    assert run(HEAD + "output,temperature\n1,20\nx,20\n")[0] == 2
    assert (folder / "out.csv").read_text() == former


cells = st.one_of(
    st.floats(-1.3, 1.3).map(repr), st.sampled_from(["", "nan", "-", "1e-3", " 1.0 ", "+1", "x1"])
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(rows=st.lists(st.tuples(cells, cells), min_size=1, max_size=12), block=st.integers(4, 80))
def test_block_size_and_engine_do_not_matter(tmp_path, rows, block):
    """Any blocks, by any engine: the same numbers on the same lines, or the same refusal."""
    path = tmp_path / "data.csv"
    path.write_text("output;a_p\n" + "".join(f"{a};{b}\n" for a, b in rows))

    def read():
        try:
            with open_samples(str(path)) as reader:
                blocks = list(reader.blocks())
        except TableError:
            return "refused"
        names = ("output", "a_p")
        columns = [np.concatenate([b.values[name] for b in blocks]) for name in names]
        return [*columns, np.concatenate([b.lines for b in blocks])]

    whole = read()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(samples_module, "BLOCK", block)
        np.testing.assert_equal(read(), whole)


# -- streams of the shell --------------------------------------------------------------------------


def accelcal_process(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "accelcal", *arguments], capture_output=True, check=False, **options
    )


@pytest.mark.skipif(not Path("/dev/fd").exists(), reason="needs the names of open files")
def test_a_pipe_with_a_name(folder):
    reader, writer = os.pipe()
    os.write(writer, (HEAD + "output,temperature\n1,20\n").encode())
    os.close(writer)
    names = ("cal.json", f"/dev/fd/{reader}", "-o", "pipe.csv")
    done = accelcal_process("apply", *names, cwd=folder, pass_fds=[reader])
    os.close(reader)
    assert done.returncode == 0
    assert values(rows_of((folder / "pipe.csv").read_text())) == pytest.approx([0.737], abs=1e-3)


@pytest.mark.parametrize("packed", [False, True])
def test_standard_input_and_output(folder, packed):
    data = (HEAD + "output,temperature\n1,20\n").encode()
    done = accelcal_process(
        "apply", "cal.json", "-", cwd=folder, input=gzip.compress(data) if packed else data
    )
    assert done.returncode == 0
    assert values(rows_of(done.stdout.decode())) == pytest.approx([0.737], abs=1e-3)
    assert "# data: <stdin>" in done.stdout.decode()


@pytest.mark.parametrize(
    ("heading", "options", "told"),
    [
        ("a_p [m/s^2]", ["--g", "9.8106"], False),
        ("a_p [g]", [], True),
    ],
)
def test_a_cross_acceleration_that_looks_like_metres_is_told(folder, heading, options, told):
    """9.8 taken for g is an error of 8.8 times the misalignment, about 10 mg."""
    (folder / "data.csv").write_text(HEAD + f"output,temperature,{heading}\n1,20,9.8\n1,20,0\n")
    done = accelcal_process("apply", "cal.json", "data.csv", *options, cwd=folder)
    assert done.returncode == 0
    remark = b"warning: 1 of 2 samples have more than 2 g across the input axis"
    assert done.stderr.startswith(remark) == told
    assert bool(done.stderr) == told


def test_gravity_in_metres_under_a_heading_without_unit_is_refused(run):
    code, rows, err = run(HEAD + "output,temperature,a_p\n1,20,9.8\n1,20,0\n")
    assert (code, rows) == (2, None)
    assert "data.csv: a_p is 9.8 g, which looks like gravity in m/s^2" in err


def test_no_progress_off_the_terminal(folder):
    (folder / "data.csv").write_text(HEAD + "output,temperature,a_p\n1,20,0\n")
    done = accelcal_process("apply", "cal.json", "data.csv", "-o", "out.csv", cwd=folder)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


def test_progress_on_a_terminal(folder, monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    (folder / "data.csv").write_text(HEAD + "output,temperature,a_p\n1,20,0\n")
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    assert main(["apply", "cal.json", "data.csv", "-o", "out.csv"]) == 0
    assert "100%" in terminal.getvalue()


def test_gzip_output_is_reproducible(folder):
    (folder / "data.csv").write_text(HEAD + "output,temperature\n1,20\n")
    for name in ("a.csv.gz", "b.csv.gz"):
        assert main(["apply", "cal.json", "data.csv", "-o", name]) == 0
    assert (folder / "a.csv.gz").read_bytes() == (folder / "b.csv.gz").read_bytes()
    assert len(rows_of(gzip.decompress((folder / "a.csv.gz").read_bytes()).decode())) == 1


def test_small_streams_need_no_pandas(folder):
    (folder / "data.csv").write_text(HEAD + "output,temperature\n1,20\n")
    script = (
        "import sys; from accelcal.cli.main import main;"
        "assert main(['apply', 'cal.json', 'data.csv', '-o', 'out.csv']) == 0;"
        "assert 'numpy' in sys.modules;"
        "assert not {'pandas', 'scipy', 'gzip'} & set(sys.modules), set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=folder, check=False)
    assert done.returncode == 0
