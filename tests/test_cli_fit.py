"""accelcal fit, as it is typed: what comes out where, and what is refused in one line."""

import csv
import gzip
import io
import json
import math
import random

import pytest

import accelcal
from accelcal import Calibration
from accelcal.cli.main import main
from accelcal.results.documents.stored import all_from_json


def table(positions=8, strokes=3, serials=("",), header="", separator=",", decimal=".", seed=5):
    """Text of a long table; a column of serials where they have names."""
    rng = random.Random(seed)
    columns = ["position", "stroke", "temperature", "output"] + ["serial"] * any(serials)
    lines = [f"# positions: {positions}\n{header}".rstrip(), separator.join(columns)]
    for number, serial in enumerate(serials):
        for k in range(1, strokes + 1):
            for j in range(1, positions + 2):
                th = 2.0 * math.pi * (j - 1) / positions
                y = 1.35 + number
                y *= 3.3e-3 + math.cos(th) + 1e-3 * math.sin(th) + rng.gauss(0.0, 5e-6)
                cells = [str(j), str(k), "20", f"{y:.7f}".replace(".", decimal)]
                lines.append(separator.join(cells + [serial] * any(serials)))
    return "\n".join(lines) + "\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "eight.csv").write_text(table())
    (tmp_path / "four.csv").write_text(table(positions=4, seed=6))
    (tmp_path / "two.csv").write_text(table(serials=("AL-1", "AL-2")))
    return tmp_path


@pytest.fixture
def run(folder, capsys):  # noqa: ARG001 - the files stand there
    def run_fit(*arguments):
        code = main(["fit", *map(str, arguments)])
        out, err = capsys.readouterr()
        return code, out, err

    return run_fit


@pytest.fixture
def fitted(run):
    def json_of(*arguments):
        code, out, err = run(*arguments, "--format", "json")
        assert (code, err) == (0, "")
        return json.loads(out)

    return json_of


def value(document, name="K1", table=0):
    part = document["tables"][table]
    return {**part["coefficients"], **part["error_model"]}[name]["value"]


# -- forms of the result ---------------------------------------------------------------------------


def test_text_is_the_calibration_as_text(run):
    code, out, err = run("eight.csv")
    assert (code, err) == (0, "")
    assert out == f"{accelcal.fit(accelcal.read_table('eight.csv'))}\n"


def test_json_alone_on_stdout(run):
    code, out, err = run("eight.csv", "--format", "json")
    assert (code, err) == (0, "")
    expected = accelcal.fit(accelcal.read_table("eight.csv"))
    assert accelcal.Calibration.from_json(out) == expected


def test_csv_has_a_row_for_each_coefficient(run):
    code, out, err = run("eight.csv", "four.csv", "--format", "csv")
    assert (code, err) == (0, "")
    rows = list(csv.DictReader(io.StringIO(out)))
    assert [row["source"] for row in rows] == ["eight.csv"] * 11 + ["four.csv"] * 11
    first = accelcal.fit(accelcal.read_table("eight.csv")).tables[0].coefficients["K0"]
    assert float(rows[0]["value"]) == first.value
    assert float(rows[0]["standard_uncertainty"]) == first.standard_uncertainty
    assert {row["coefficient"]: row["value"] for row in rows[11:]}["K3"] == ""
    assert {row["coefficient"]: row["stands_for"] for row in rows[11:]}["K1"] == "K1 + K3"


def test_an_empty_serial_is_refused(run):
    """Of an empty variable of a script; it took the serial number off the table."""
    code, out, err = run("two.csv", "--serial", "")
    assert (code, out) == (2, "")
    assert err.startswith("error: invalid value for '--serial': it is empty; write it, or leave")


def test_csv_quotes_a_serial_with_commas(run, folder):
    (folder / "odd.csv").write_text(table(header='# serial: a,"b"'))
    rows = list(csv.DictReader(io.StringIO(run("odd.csv", "--format", "csv")[1])))
    assert {row["serial"] for row in rows} == {'a,"b"'}


# -- several tables --------------------------------------------------------------------------------


def test_several_files_are_one_document(fitted):
    document = fitted("eight.csv", "four.csv")
    assert set(document) == {"schema", "calibrations"}
    assert [part["source"] for part in document["calibrations"]] == ["eight.csv", "four.csv"]
    assert [part["schema"] for part in document["calibrations"]] == ["accelcal/calibration/1"] * 2


def test_several_serials_are_one_document(fitted):
    parts = fitted("two.csv")["calibrations"]
    assert [part["serial"] for part in parts] == ["AL-1", "AL-2"]
    assert [value(part) for part in parts] == pytest.approx([1.35, 2.35], abs=1e-4)


def test_several_in_text_are_set_apart(run):
    out = run("two.csv", "four.csv")[1]
    assert out.count("Calibration of") == 3
    assert out.count("=" * 100) == 2


def test_one_bad_file_of_several_stops_all(run):
    code, out, err = run("eight.csv", "nosuch.csv", "-o", "cal.json")
    assert (code, out) == (2, "")
    assert err == "nosuch.csv: no such file; give the path of a table, or - for standard input\n"


# -- standard input, and tables as they come -------------------------------------------------------


def standard_input(monkeypatch, content):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content)))


def test_dash_reads_standard_input(fitted, monkeypatch):
    standard_input(monkeypatch, table().encode())
    assert fitted("-")["tables"] == fitted("eight.csv")["tables"]


def test_german_spreadsheet(fitted, folder):
    """Semicolons, decimal commas, a byte order mark and carriage returns."""
    text = table(separator=";", decimal=",").replace("\n", "\r\n")
    (folder / "excel.csv").write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert fitted("excel.csv")["tables"] == fitted("eight.csv")["tables"]


def test_utf16_and_gzip(fitted, folder):
    (folder / "export.csv.gz").write_bytes(gzip.compress(table(separator="\t").encode("utf-16")))
    assert fitted("export.csv.gz")["tables"] == fitted("eight.csv")["tables"]


# -- the file of -o --------------------------------------------------------------------------------


def test_output_holds_the_calibration_and_text_is_shown(run, folder):
    code, out, err = run("eight.csv", "-o", "cal.json")
    assert (code, err) == (0, "")
    assert out.startswith("Calibration of eight.csv\n")
    saved = (folder / "cal.json").read_text("utf-8")
    assert all_from_json(Calibration, saved) == (accelcal.fit(accelcal.read_table("eight.csv")),)


def test_output_of_several(run, folder):
    assert run("two.csv", "-o", "cal.json")[0] == 0
    saved = all_from_json(Calibration, (folder / "cal.json").read_text("utf-8"))
    assert [part.serial for part in saved] == ["AL-1", "AL-2"]


def test_output_dash_is_json_alone(run):
    code, out, _ = run("eight.csv", "-o", "-")
    assert code == 0
    assert json.loads(out)["source"] == "eight.csv"


def test_failed_fit_leaves_the_old_file(run, folder):
    (folder / "cal.json").write_text("old")
    (folder / "bad.csv").write_text(table().replace("1.35", "volts", 1))
    assert run("eight.csv", "bad.csv", "-o", "cal.json")[:2] == (2, "")
    assert (folder / "cal.json").read_text() == "old"
    assert {item.name for item in folder.iterdir() if item.suffix == ".json"} == {"cal.json"}


def test_failed_writing_prints_nothing_and_leaves_nothing(run, folder):
    before = sorted(item.name for item in folder.iterdir())
    code, out, err = run("eight.csv", "-o", "nosuch/cal.json")
    assert (code, out) == (2, "")
    assert one_line(err).startswith("error: nosuch/cal.json cannot be written")
    assert sorted(item.name for item in folder.iterdir()) == before


@pytest.mark.parametrize("path", ["eight.csv", "./eight.csv"])
def test_a_table_is_not_overwritten(run, folder, path):
    code, out, err = run("eight.csv", "-o", path)
    assert (code, out) == (2, "")
    assert "is a file to be read" in one_line(err)
    assert (folder / "eight.csv").read_text() == table()


# -- options ---------------------------------------------------------------------------------------


def test_options_reach_the_result(fitted):
    document = fitted(
        *("eight.csv", "--t0", "25", "--g", "9.8106", "--delta0", "-2e-4"),
        *("--head-uncertainty", "1e-5", "--launch-uncertainty", "2e-5"),
        *("--launch-sf-uncertainty", "1e-5"),
    )
    assert document["T0_degC"] == 25.0
    assert document["g_local_m_s2"] == 9.8106
    assert document["delta0_rad"] == -2e-4
    sources = {part["name"]: (part["value"], part["source"]) for part in document["error_sources"]}
    assert sources["head"] == (1e-5, "declared")
    assert sources["launch"] == (2e-5, "declared")
    assert sources["launch_sf"] == (1e-5, "declared")


def test_options_win_over_the_header(fitted, folder):
    header = "# T0: 22\n# g: 9.80\n# head_uncertainty: 1e-6"
    (folder / "declared.csv").write_text(table(header=header))
    assert fitted("declared.csv")["T0_degC"] == 22.0
    changed = fitted("declared.csv", "--t0", "21", "--g", "9.82", "--head-uncertainty", "3e-5")
    assert (changed["T0_degC"], changed["g_local_m_s2"]) == (21.0, 9.82)
    assert next(s["value"] for s in changed["error_sources"] if s["name"] == "head") == 3e-5


def test_head_uncertainty_widens_the_intervals(fitted):
    narrow, wide = (fitted("eight.csv", "--head-uncertainty", u) for u in ("1e-6", "1e-4"))
    sigma = [d["tables"][0]["error_model"]["delta"]["standard_uncertainty"] for d in (narrow, wide)]
    assert sigma[1] > 10 * sigma[0]


def test_delta0_turns_the_misalignment(fitted):
    straight, turned = fitted("eight.csv"), fitted("eight.csv", "--delta0", "1e-3")
    assert value(turned, "delta") - value(straight, "delta") == pytest.approx(1e-3, rel=1e-2)


@pytest.mark.parametrize("method", ["least-squares", "closed-form", "sign-corrected"])
def test_methods(fitted, method):
    document = fitted("eight.csv", "--method", method)
    assert document["method"] == method
    assert value(document, "k0") == pytest.approx(3.3e-3, abs=2e-5)


def test_printed_method_warns_in_one_line(run):
    code, out, err = run("eight.csv", "--method", "printed", "--format", "json")
    assert code == 0
    assert one_line(err).startswith("warning: method 'printed'")
    document = json.loads(out)
    assert document["method"] == "printed"
    assert abs(value(document)) < 1e-3, "nothing of K1 is left"
    assert any("NOT A CALIBRATION" in sentence for sentence in document["warnings"])


def test_coefficients(fitted):
    document = fitted("eight.csv", "--coefficients", "K1, K0,M")
    estimates = document["tables"][0]["coefficients"]
    assert [name for name, part in estimates.items() if part["value"] is not None] == [
        "K0",
        "K1",
        "M",
    ]
    assert document["tables"][0]["dof"] == 27 - 3


def test_robust(run, fitted, folder):
    lines = table().splitlines()
    lines[12] = lines[12].rsplit(",", 1)[0] + ",0.5"
    (folder / "hit.csv").write_text("\n".join(lines) + "\n")
    assert "WARNING: run 20, outlier: stroke 2" in run("hit.csv")[1]
    assert abs(value(fitted("hit.csv"), "k0") - 3.3e-3) > 1e-3
    document = fitted("hit.csv", "--robust")
    assert document["robust"] is True
    assert value(document, "k0") == pytest.approx(3.3e-3, abs=3e-5)


def test_positions_are_those_of_the_option(fitted, folder):
    (folder / "bare.csv").write_text(table(positions=12).partition("\n")[2])
    assert value(fitted("bare.csv", "--positions", "12"), "k0") == pytest.approx(3.3e-3, abs=2e-5)


# -- refused ---------------------------------------------------------------------------------------


def one_line(err):
    assert err.endswith("\n")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    return err


HEADINGS = "position,stroke,temperature,output\n"
BAD = {
    "empty": ("", "bad.csv: "),
    "heading only": (HEADINGS, "bad.csv"),
    "no column": ("position,stroke,output\n1,1,1\n", "bad.csv:1: no column for temperature"),
    "text": (HEADINGS + "1,1,20,1.3\n3,1,20,abc\n", "bad.csv:3: "),
    "infinite": (HEADINGS + "1,1,20,1.3\n3,1,20,inf\n", "bad.csv:3: "),
    "position": (HEADINGS + "1,1,20,1.3\n12,1,20,1\n", "bad.csv:3: position '12'"),
    "stroke": (HEADINGS + "1,0,20,1.3\n3,1,20,1\n", "bad.csv:2: stroke '0'"),
    "twice": (HEADINGS + "1,1,20,1.3\n1,1,20,1.4\n", "bad.csv:3: "),
    "equal": (HEADINGS + "1,1,20,1.3\n3,1,20,1.3\n", "bad.csv:2: all 2 outputs are 1.3"),
    "one place": (
        HEADINGS + "1,1,20,1.3\n1,2,20,1.4\n",
        "bad.csv:2: the readings do not determine",
    ),
    "one reading": (HEADINGS + "1,1,20,1.3\n", "bad.csv:2: one reading only in run 20; "),
    "std": (
        "temperature,position,stroke,output,std\n20,1,1,1,1e-300\n20,5,1,2,1e-300\n",
        "bad.csv:2: std of 1e-300; it lies between 1e-40 and 1e20",
    ),
    "binary": ("\x00\x01\x02PNG", "bad.csv"),
}


@pytest.mark.parametrize("fault", BAD)
def test_bad_table_is_one_line(run, folder, fault):
    text, beginning = BAD[fault]
    (folder / "bad.csv").write_text(text)
    code, out, err = run("bad.csv")
    assert (code, out) == (2, "")
    assert one_line(err).startswith(beginning)
    assert "; " in err


def test_folder_is_no_table(run, folder):
    code, out, err = run(folder)
    assert (code, out) == (2, "")
    assert "is a folder" in one_line(err)


@pytest.mark.parametrize(("asked", "told"), [("K0,K1,K2", False), ("K0,K1,M", True)])
def test_the_misalignment_is_spoken_of_where_it_is_estimated(run, asked, told):
    code, out, _ = run("eight.csv", "--coefficients", asked)
    assert code == 0
    for said in ("delta is the effective misalignment", "only the signs of delta"):
        assert (said in " ".join(out.split())) is told


def test_strict_names_file_coefficient_and_remedy(run):
    code, out, err = run("four.csv", "--strict")
    assert (code, out) == (2, "")
    assert one_line(err).startswith("four.csv:3: K3 cannot be told apart from K1")
    assert "M_ip leaves no trace" in err
    assert err.endswith("; add positions or ask for fewer coefficients\n")
    assert run("four.csv", "--strict", "--coefficients", "K0,K1,K2,M")[0] == 0
    assert run("eight.csv", "--strict")[0] == 0


def test_coefficients_that_are_asked_for_are_told_or_refused(run):
    """They were dropped with a note and exit code 0."""
    code, out, err = run("four.csv", "--coefficients", "K0,K1,K3")
    assert (code, out) == (2, "")
    assert one_line(err).startswith("four.csv:3: K3 cannot be told apart from K1")
    assert run("four.csv", "--coefficients", "K0,K1,K2,M")[0] == 0
    assert run("four.csv")[0] == 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ["--coefficients", "K0,K1,K4"],
            "error: coefficient 'K4' is unknown; choose from K0, K1",
        ),
        (["--coefficients", "K0"], "K1 is not among the coefficients asked for"),
        (["--coefficients", ""], "'--coefficients': it is empty; write it, or leave the option"),
        (["--serials", ""], "'--serials': it is empty"),
        (["--spec", ""], "'--spec': it is empty"),
        (["-o", " "], "'-o' / '--output': it is empty"),
        (["--effects", " "], "'--effects': it is empty"),
        (["--g", "12"], "local gravity 12.0 m/s^2 is found nowhere on Earth"),
        (["--head-uncertainty", "-1"], "'--head-uncertainty': '-1' is below 0; it is 0 or more"),
        (["--launch-uncertainty", "-1ug"], "'-1ug' is below 0"),
        (["--positions", "3"], "is outside the turn"),
    ],
)
def test_bad_option_is_one_line(run, options, said):
    code, out, err = run("eight.csv", *options)
    assert (code, out) == (2, "")
    assert said in one_line(err)


@pytest.mark.parametrize(
    "options",
    [
        ["--t0", "nan"],
        ["--t0", "500"],
        ["--delta0", "x"],
        ["--method", "magic"],
        ["--format", "xml"],
        ["--magic"],
    ],
)
def test_bad_usage_is_2(run, options):
    code, out, err = run("eight.csv", *options)
    assert (code, out) == (2, "")
    assert one_line(err).endswith("; see accelcal fit --help\n")


def test_closed_form_of_twelve_positions_is_refused(run, folder):
    (folder / "twelve.csv").write_text(table(positions=12))
    code, out, err = run("twelve.csv", "--method", "closed-form")
    assert (code, out) == (2, "")
    assert one_line(err).startswith("twelve.csv:3: a reading at 30 deg")


def test_help_lists_the_examples_line_by_line(run):
    code, out, _ = run("--help")
    assert code == 0
    assert "\n    accelcal fit table.csv\n" in out
    assert "\\b" not in out


# -- data sheet ------------------------------------------------------------------------------------


LIMITS = """
schema = "accelcal/specification/1"
name = "AL"
source = "this test"
rule = "guard band"

[limits.bias]
maximum = {limit}
unit = "mg"
"""


def test_a_failed_limit_is_1_and_the_result_is_there(run, folder):
    (folder / "strict.toml").write_text(LIMITS.format(limit=1.0))
    (folder / "lax.toml").write_text(LIMITS.format(limit=5.0))
    for name, expected in (("strict.toml", 1), ("lax.toml", 0)):
        code, out, err = run("eight.csv", "--spec", name, "--format", "json")
        assert (code, err) == (expected, "")
        assert value(json.loads(out), "k0") == pytest.approx(3.3e-3, abs=1e-5)


def test_missing_data_sheet_is_one_line(run):
    code, out, err = run("eight.csv", "--spec", "nosuch.toml")
    assert (code, out) == (2, "")
    assert "nosuch.toml" in one_line(err)


def test_files_of_one_unit_at_several_temperatures_are_told_of(run, folder):
    for name, degrees in (("cold", "-40"), ("warm", "60")):
        text = table(header="# serial: AL-7\n").replace(",20,", f",{degrees},")
        (folder / f"{name}.csv").write_text(text)
    code, out, err = run("cold.csv", "warm.csv")
    assert code == 0
    assert "note: AL-7 is in 2 files, each calibrated alone; temperature laws need its" in err
    assert out.count("Calibration of") == 2
    for alone in (("cold.csv",), ("eight.csv", "four.csv"), ("cold.csv", "cold.csv")):
        assert "calibrated alone" not in run(*alone)[2]
