"""The command, its reader, its text and its picture."""

import io
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from accelcal.cli.main import main
from accelcal.errors import InputError, TableError
from accelcal.io.stability_record import read_stability, read_stability_records
from accelcal.plot.stability import both
from accelcal.plot.style import picture
from accelcal.stability.analysis import analyse

ROOT = Path(__file__).parents[1]
EXAMPLE = str(ROOT / "examples" / "stability.csv")


def read(text):
    return read_stability(io.StringIO(text))


def rows(*cells):
    return "".join(f"{cell}\n" for cell in cells)


def test_the_example_is_made_by_its_script():
    done = subprocess.run(
        [sys.executable, ROOT / "examples" / "stability.py"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout == Path(EXAMPLE).read_text("utf-8")


def test_small_numbers_are_told_in_the_unit_of_the_picture():
    """They were 0.00000585 mA beside a picture in nA, and 4.29e+03 degrees of freedom."""
    text = str(analyse(read_stability(EXAMPLE)))
    assert "sigma_L      5.85  3.65  14.3  nA       5\n" in text
    assert "sigma_F      6.55  6.42  6.70  nA    4290\n" in text
    assert "Overlapping Allan deviation [nA]\n" in text


def test_the_example_gives_back_what_it_was_made_with():
    result = analyse(read_stability(EXAMPLE), scale_factor=1.3)
    truth = {"sigma_L": 6.7e-6, "gamma_D": 5e-6 / 3600.0, "sigma_F": 5e-6, "noise": 5e-6}
    for name, value in truth.items():
        assert result.components[name].lower < value < result.components[name].upper
    white = result.noise_terms["N"]
    assert white.lower < 5e-6 * 5**0.5 < white.upper
    assert [name for name, t in result.noise_terms.items() if t.value is not None] == ["N"]


# -- reader ----------------------------------------------------------------------------------------


def test_columns_units_and_header():
    record = read("# serial: A7\n# unit: mA\ntime [min];y;T;Launch\n"
                  "0;1,5;20,1;x\n1;1,6;20,2;x\n2;1,4;20,3;x\n"
                  "0;1,1;20;y\n1;1,2;20;y\n3;1,0;20;y\n")  # fmt: skip
    assert (record.serial, record.unit) == ("A7", "mA")
    assert [launch.label for launch in record.launches] == ["x", "y"]
    assert record.launches[0].time.tolist() == [0.0, 60.0, 120.0]
    assert record.launches[0].temperature.tolist() == [20.1, 20.2, 20.3]
    assert record.launches[1].output.tolist() == [1.1, 1.2, 1.0]


def test_the_column_of_units_counts():
    """It was set aside without a word."""
    assert read("time,output,unit\n0,1,µA\n1,2,\n2,3,uA\n").unit == "uA"


def test_columns_that_are_not_used_are_told():
    """They were left out without a word, a second output among them."""
    found = read("time,output [mA],output 2 [mA],std\n0,1,5,1\n1,2,6,1\n2,3,7,1\n")
    assert found.notes == ("columns not used: 'output 2 [mA], std'",)


def test_a_serial_that_is_given_hides_no_second_accelerometer():
    """Samples of both counted as those of the one that was given; an empty column was refused."""
    text = "time,output,serial\n0,1,a\n1,2,b\n2,3,a\n"
    with pytest.raises(TableError, match="serials 'a, b' in one record"):
        read_stability(io.StringIO(text), overrides={"serial": "a"})
    found = read_stability(io.StringIO(text.replace("b", "a")), overrides={"serial": "c"})
    assert found.serial == "c"
    assert found.notes == ("the serial is c, as given, in place of a in the table",)
    assert read("time,output,serial\n0,1,\n1,2,\n2,3,\n").serial is None


def test_several_serials_are_refused_where_the_second_begins():
    with pytest.raises(TableError, match=":4: serials 'a, b' in one record; give a file for each"):
        read("time,output,serial\n0,1,a\n1,2,a\n2,3,b\n")
    with pytest.raises(TableError, match=":3: serials 'b, a' in one record"):
        read("# serial: b\ntime,output,serial\n0,1,a\n1,2,a\n2,3,a\n")


@pytest.mark.parametrize(
    ("headings", "times"),
    [
        ("Datum/Uhrzeit;Strom [mA]", [f"31.05.2024 10:00:0{i}" for i in range(3)]),
        ("timestamp [ms];Current (mA)", ["0", "1000", "2000"]),
        ("Время, мин;Ток, мА", ["0", "1", "2"]),
        ("Дата и время;Ток, мА", [f"2024-05-31 10:00:0{i}" for i in range(3)]),
    ],
)
def test_a_time_and_the_lone_output_are_headings(headings, times):
    """They were no headings without a third that was known; Russian units of time were none."""
    rows = "".join(f"{time};1,3{i}\n" for i, time in enumerate(times))
    record = read(f"{headings}\n{rows}")
    second = 60.0 if "мин" in headings else 1.0
    assert record.launches[0].time.tolist() == [0.0, second, 2.0 * second]
    assert (record.launches[0].output.tolist(), record.unit) == ([1.30, 1.31, 1.32], "mA")


@pytest.mark.parametrize("headings", ["Date;Output;Unit", "Datum;Messwert;Einheit"])
def test_dates_and_outputs_with_their_units_are_headings(headings):
    """They passed for those of a form of facts."""
    rows = "".join(f"2024-05-31 10:00:0{i};1,3{i};mA\n" for i in range(3))
    record = read(f"{headings}\n{rows}")
    assert (record.launches[0].output.tolist(), record.unit) == ([1.30, 1.31, 1.32], "mA")


@pytest.mark.parametrize(
    ("above", "headings"),
    [
        ("Date;2024-05-31;Supply;Voltage", "t [s];Y [mA]"),
        ("Date;Frequency [Hz]\n2024-05-31;50", "t [s];Y [mA]"),
        ("Date;Frequency [Hz]\n2024-05-31;50", "Zeit;Strom in mA"),
    ],
)
def test_notes_of_a_date_and_a_current_above_the_headings_are_none(above, headings):
    record = read(f"{above}\n{headings}\n0;1,30\n1;1,31\n2;1,32\n")
    assert (record.launches[0].output.tolist(), record.unit) == ([1.30, 1.31, 1.32], "mA")


def test_the_lone_output_is_taken():
    record = read("time,Strom in mA,T\n0,1,20\n1,2,20\n2,3,21\n")
    assert (record.unit, record.launches[0].output.tolist()) == ("mA", [1.0, 2.0, 3.0])
    assert "column 'Strom in mA' is taken for the outputs, by its unit" in record.notes


def test_dates_become_seconds():
    record = read("time,output_V\n2024-05-31T23:59:59,1\n2024-06-01T00:00:00.5,2\n"
                  "2024-06-01T00:00:02+00:00,3\n")  # fmt: skip
    assert record.launches[0].time.tolist() == [0.0, 1.5, 3.0]
    assert record.unit == "V"


@pytest.mark.parametrize(
    "text",
    [
        "date,time,output\n31.05.2024,23:59:59,1\n1.6.2024,0:00:00.5,2\n1.6.2024,0:00:02,3\n",
        "time,output\n23:59:59,1\n0:00:00.5,2\n0:00:02,3\n",
    ],
)
def test_clock_times_become_seconds(text):
    assert read(text).launches[0].time.tolist() == [0.0, 1.5, 3.0]


@pytest.mark.parametrize(
    ("heading", "seconds"),
    [
        *(("time", 1.0), ("time [s since start]", 1.0), ("time [ms]", 1e-3), ("t [µs]", 1e-6)),
        *(("time (minutes)", 60.0), ("time [hours]", 3600.0), ("time_d", 86400.0)),
    ],
)
def test_times_are_in_the_unit_of_their_heading(heading, seconds):
    launch = read(f"{heading},output\n0,1\n1,2\n3,1\n").launches[0]
    assert launch.time.tolist() == [0.0, seconds, 3.0 * seconds]


@pytest.mark.parametrize(
    ("heading", "size"),
    [
        *(("input", 1.0), ("input [g]", 1.0), ("input [mg]", 1e-3), ("input_ug", 1e-6)),
        *(("Input (µg)", 1e-6), ("acceleration applied [mg]", 1e-3)),
    ],
)
def test_applied_accelerations_are_in_the_unit_of_their_heading(heading, size):
    launch = read(f"time,output,{heading}\n0,1,0\n1,2,5\n2,1,0\n").launches[0]
    assert launch.input.tolist() == [0.0, 5.0 * size, 0.0]


def test_missing_outputs_are_left_out_and_told():
    record = read("time,output\n0,1\n1,\n2,2\n3,nan\n4,3\n")
    assert record.launches[0].time.tolist() == [0.0, 2.0, 4.0]
    assert any("missing output" in note for note in record.notes)


def test_a_large_record_is_read_by_pandas_to_the_same_numbers():
    values = np.random.default_rng(1).normal(size=70_000).round(9)
    text = "time,output,temperature\n" + rows(*(f"{i},{v!r},20.00000000" for i, v in
                                                enumerate(values.tolist())))  # fmt: skip
    assert len(text) > 2_000_000
    np.testing.assert_array_equal(read(text).launches[0].output, values)


def test_a_place_that_stays_is_no_tumble_test():
    """A record at rest, by the program of the stand, was refused for its headings."""
    record = read("time,position,stroke,output\n0,3,1,1\n1,3,1,2\n2,3,1,1\n")
    assert record.launches[0].output.tolist() == [1.0, 2.0, 1.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,temperature\n0,20\n", "no column output"),
        ("temperature,output\n20,1\n", "no column time"),
        ("time,t,output\n0,0,1\n", "'time' and 't' mean the same"),
        ("time,angle,stroke,output\n0,0,1,1\n1,45,1,2\n2,90,1,0\n", "give it to accelcal fit"),
        ("time,output\n0,1\n1,2\n", "at least 3"),
        ("time,output\n0,1\n1,2\n1,3\n", ":4: time does not increase"),
        ("time,output\n0,1\n1,1\n2,1\n", "all 3 outputs are 1"),
        ("time,output\n0,\n1,\n", "all outputs are missing"),
        ("time,output\n0,1\n1,x\n2,1\n", ":3: output 'x' is not a number"),
        ("time,output\n0,1\n,2\n2,1\n", ":3: time is missing"),
        ("time,output,serial\n0,1,a\n1,2,b\n2,3,a\n", "give a file for each"),
        (
            "# unit: V\ntime,output_mA\n0,1\n1,2\n2,3\n",
            "'V' and 'mA' in one table; give all outputs",
        ),
        ("time,output,unit\n0,1,mA\n1,2,mA\n2,3,uA\n", ":4: units 'mA' and 'uA' in one table"),
        ("time,output,unit\n0,1,mA\n1,2,furlong\n2,3,mA\n", ":3: unit 'furlong' is no output unit"),
        ("time,output,input\n0,1,0\n1,2,\n2,3,0\n", ":3: input is missing"),
        ("time [weeks],output\n0,1\n1,2\n2,1\n", "is in weeks; write the unit of the time"),
        ("time,output,input [m/s^2]\n0,1,0\n1,2,1\n2,3,0\n", "in m/s^2; give it in g, mg or ug"),
        ("time,output\n0,1\n1,-9999\n2,3\n", ":3: output '-9999' looks like a marker of a missing"),
        ("time,output,temperature\n0,1,293\n1,2,293\n2,3,293\n", "is no temperature of a test"),
        ("time,output,temperature [mK]\n0,1,293\n1,2,293\n2,3,293\n", "in mK; give it in degC"),
    ],
)
def test_a_bad_record_is_refused_in_one_line(text, message):
    with pytest.raises(TableError) as caught:
        read(text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_several_files_are_several_launches(tmp_path):
    for name, unit in (("monday", "mA"), ("tuesday", "mA"), ("volts", "V")):
        (tmp_path / f"{name}.csv").write_text(f"time,output_{unit}\n0,1\n1,2\n2,1\n3,2\n4,1\n")
    paths = [tmp_path / "monday.csv", tmp_path / "tuesday.csv"]
    record = read_stability_records(paths)
    assert [launch.label for launch in record.launches] == ["monday", "tuesday"]
    with pytest.raises(InputError, match="unit V and mA in one test"):
        read_stability_records([*paths, tmp_path / "volts.csv"])


def test_the_samples_of_two_files_that_are_copies_are_refused(tmp_path):
    """Launches that count twice make the interval of sigma_L too narrow."""
    copy = tmp_path / "copy.csv"
    copy.write_bytes(Path(EXAMPLE).read_bytes())
    told = "copy.csv: the samples of launch '1' are those of .*stability.csv; give each file once"
    with pytest.raises(InputError, match=told):
        read_stability_records([EXAMPLE, copy])
    with pytest.raises(InputError, match="the samples of launch '1' are those of"):
        read_stability_records([EXAMPLE, EXAMPLE])


def test_a_launch_of_one_sample_has_one(capsys):
    assert "launch 1.1: 1 sample; a launch has" in run(capsys, EXAMPLE, "--launch-gap", "1")[2]


# -- command ---------------------------------------------------------------------------------------


def run(capsys, *arguments):
    code = main(["stability", *arguments])
    caught = capsys.readouterr()
    return code, caught.out, caught.err


def test_the_text_tells_value_interval_unit_and_reason(capsys):
    code, out, err = run(capsys, EXAMPLE, "--scale-factor", "1.3")
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 100
    assert out.isascii()
    for part in ("sigma_L", "ug/h", "not determined", "not identified", "extrapolated", "5.51"):
        assert part in out


def test_json_is_one_document(capsys, tmp_path):
    path = tmp_path / "result.json"
    code, out, err = run(capsys, EXAMPLE, "--format", "json", "-o", str(path))
    assert (code, err) == (0, "")
    assert json.loads(out) == json.loads(path.read_text("utf-8"))
    assert json.loads(out)["unit"] == "mA"


def test_csv_has_a_line_for_each_quantity(capsys):
    code, out, _ = run(capsys, EXAMPLE, "--format", "csv", "--times", "60")
    assert code == 0
    assert out.startswith("quantity,time_s,value,unit,lower,upper,dof,finding\nsigma_L,")
    assert "\nk0,60.0," in out


def test_the_calibration_gives_g(capsys, tmp_path):
    path = str(tmp_path / "cal.json")
    assert main(["fit", str(ROOT / "examples" / "al15.csv"), "-o", path]) == 0
    capsys.readouterr()
    code, out, _ = run(capsys, EXAMPLE, "--calibration", path)
    assert code == 0
    assert "in g (local), scale factor 1.34" in out


@pytest.mark.parametrize(
    "arguments",
    [
        ["nosuch.csv"],
        [EXAMPLE, "--probability", "2"],
        [EXAMPLE, "--scale-factor", "0"],
        [EXAMPLE, "--calibration", "nosuch.json"],
        [EXAMPLE, "--calibration", EXAMPLE],
        [EXAMPLE, "--average", "1e9"],
        [EXAMPLE, "--launch-gap", "0"],
        [EXAMPLE, "--plot", "picture.gif"],
        [EXAMPLE, "--unit", "V", "--calibration", EXAMPLE, "--scale-factor", "1"],
    ],
    ids=lambda arguments: " ".join(Path(argument).name for argument in arguments),
)
def test_bad_input_exits_with_2(capsys, arguments):
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (2, "")
    assert "Traceback" not in err


@pytest.mark.parametrize(("form", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_the_picture_is_drawn(capsys, tmp_path, form, start):
    path = tmp_path / f"picture.{form}"
    code, _, err = run(capsys, EXAMPLE, "--scale-factor", "1.3", "--plot", str(path))
    assert (code, err) == (0, "")
    assert path.read_bytes().startswith(start)
    if form == "svg":
        assert path.stat().st_size > 20_000


def test_a_picture_without_allan_deviation(tmp_path):
    path = tmp_path / "short.csv"
    path.write_text("time,output\n0,1\n1,2\n2,1\n3,2\n")
    with pytest.raises(InputError, match="at least 5"):
        analyse(read_stability(path))
    path.write_text("time,output\n" + rows(*(f"{i},{i % 3}" for i in range(5))))
    record = read_stability(path)
    assert picture(both(analyse(record), record), "png").startswith(b"\x89PNG")


@pytest.mark.parametrize("missing", ["allantools", "matplotlib.figure"])
def test_without_an_extra_the_rest_works(capsys, monkeypatch, tmp_path, missing):
    monkeypatch.setitem(sys.modules, missing, None)
    if missing == "allantools":
        code, out, _ = run(capsys, EXAMPLE)
        assert code == 0
        assert "needs allantools" in out.replace("\n    ", " ")
    else:
        code, _, err = run(capsys, EXAMPLE, "--plot", str(tmp_path / "p.png"))
        assert code == 2
        assert "accelcal[plot]" in err
