"""What somebody tries on the first day: wrong files, wrong units, options that must be told."""

import csv
import io
import json
import math
from pathlib import Path

import pytest

import accelcal
from accelcal.cli.main import main
from accelcal.cli.values import duration


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main(["simulate", "--seed", "1", "-o", "table.csv"])
    main(["fit", "table.csv", "-o", "cal.json"])
    return tmp_path


@pytest.fixture
def run(folder, capsys):  # noqa: ARG001  (it makes the files)
    def run_on(*arguments):
        capsys.readouterr()
        code = main(list(arguments))
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run_on


def said(err):
    return err.splitlines()[-1]


# -- files that are something else -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "command"),
    [
        (
            "shaft,angle,x_mA,y_mA,z_mA\nx,0,1.3,0,0\n",
            "three accelerometers in one block go to accelcal triad",
        ),
        (
            "part,acc_x,acc_y,acc_z\na,-2052,-28,-73\n",
            "three accelerometers in one block go to accelcal triad",
        ),
        ("time,output,temperature\n0,1.3,20\n", "a record over time goes to accelcal stability"),
        (
            "Datum;Strom [mA]\n2024-05-31 10:00;1,3\n",
            "a record over time goes to accelcal stability",
        ),
    ],
)
def test_a_table_of_another_command_names_it(run, folder, text, command):
    (folder / "other.csv").write_text(text)
    assert said(run("fit", "other.csv")[2]).endswith(f"; {command}")


def test_an_option_without_its_value_names_the_help_of_its_command(run):
    _, _, err = run("fit", "table.csv", "-o")
    assert err == "error: option '-o' requires an argument; see accelcal fit --help\n"


@pytest.mark.parametrize("command", ["apply", "budget", "export"])
def test_a_calibration_that_is_not_there(run, command):
    code, _, err = run(
        command,
        "nofile.json",
        *(["table.csv"] if command == "apply" else []),
        *(["--format", "c"] if command == "export" else []),
    )
    remedy = "give the path of a calibration, or - for standard input"
    assert (code, err) == (2, f"nofile.json: no such file; {remedy}\n")


@pytest.mark.parametrize(
    "arguments",
    [
        ["fit", "cal.json"],
        ["check", "cal.json"],
        ["stability", "cal.json"],
        ["apply", "cal.json", "cal.json"],
    ],
    ids=" ".join,
)
def test_a_calibration_in_place_of_a_table(run, arguments):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith(
        "cal.json:1: a calibration written by accelcal fit, not a table; give it to"
    )


@pytest.mark.parametrize("name", ["r.csv", "r.laws.csv", "r.errors.csv", "r.csv.gz", "r.parquet"])
def test_results_of_a_batch_in_place_of_a_table(run, name):
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    run("batch", "table.csv", "-o", name.replace(".laws", "").replace(".errors", ""))
    rule = "results of accelcal batch, not a table of readings"
    for command in (["fit"], ["check"], ["discover"], ["stability"], ["triad"]):
        code, out, err = run(*command, name)
        assert (code, out) == (2, "")
        assert err == f"{name}:1: {rule}; leave the file out, and give tables\n"


def test_results_of_a_batch_that_a_spreadsheet_saved(run, folder):
    run("batch", "table.csv", "-o", "r.csv")
    text = (folder / "r.csv").read_text().translate({ord("."): ",", ord(","): ";"})
    (folder / "saved.csv").write_text("\ufeff" + text, encoding="utf-8")
    code, _, err = run("fit", "saved.csv")
    assert code == 2
    assert "saved.csv:1: results of accelcal batch" in err


def test_results_of_a_batch_are_no_samples(run):
    run("batch", "table.csv", "-o", "r.csv")
    code, _, err = run("apply", "cal.json", "r.csv")
    assert (code, err[:40]) == (2, "r.csv:1: results of accelcal batch, not ")


def test_a_document_with_a_dash_in_its_name_is_told(run, folder):
    (folder / "plan.json").write_text('{"schema": "accelcal/optimal-design/1", "seed": 0}')
    _, _, err = run("apply", "cal.json", "plan.json")
    assert err.startswith("plan.json:1: a document 'accelcal/optimal-design/1' of accelcal")


def test_toml_is_not_taken_for_json(run, folder):
    (folder / "mine.toml").write_text("[[effect]]\nid = 'a'\n")
    _, _, err = run("apply", "cal.json", "mine.toml")
    assert "no column output" in err


@pytest.mark.parametrize(
    "command",
    ["fit - -", "stability - -", "apply - -", "fit - --head -", "report - --data - -o r.html"],
)
def test_standard_input_is_read_once(run, command):
    code, _, err = run(*command.split())
    assert (code, said(err)) == (
        2,
        "error: - is given twice; standard input can be read once, so name it once",
    )


@pytest.mark.parametrize("text", ["", "# unit: mA\n"])
def test_an_empty_record_is_told_its_own_columns(run, folder, text):
    (folder / "empty.csv").write_text(text)
    err = run("stability", "empty.csv")[2]
    assert "; name the columns time and output, and, where there are such, temperature" in err


# -- options ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [["fit", "table.csv"], ["simulate"]], ids=" ".join)
def test_a_fixture_angle_in_degrees_is_told(run, command):
    code, _, err = run(*command, "--delta0", "10")
    assert code == 2
    assert "above pi/4; give it in rad, 10 deg are 0.174533 rad" in err
    assert run(*command, "--delta0", "0.001")[0] == 0


def test_an_option_without_effect_is_refused(run):
    """The accelerations were in g all the same, and the effects in nothing."""
    code, out, err = run("apply", "cal.json", "table.csv", "--g", "9.81")
    assert (code, out) == (2, "")
    assert "--g M_S2 is given for accelerations in g; leave it out, or ask for m/s^2" in said(err)
    mine = Path(__file__).parent.parent / "examples" / "effects.toml"
    for command in (["fit", "table.csv"], ["simulate"]):
        code, out, err = run(*command, "--effects", str(mine))
        assert (code, out) == (2, "")
        assert "--effects has no effect without --" in said(err)


def test_a_gravity_that_is_nowhere_gives_no_accelerations(run):
    for gravity in ("3", "0", "-9.81", "9.75"):  # the last was taken, though the rule says no
        code, out, err = run("apply", "cal.json", "table.csv", "--in", "m/s^2", "--g", gravity)
        assert (code, out) == (2, "")
        assert "m/s^2 is found nowhere on Earth; it lies between 9.76 and 9.84" in said(err)


def test_the_schema_of_another_file_is_told_before_its_keys(run, folder):
    (folder / "lab.toml").write_text('schema = "accelcal/laboratory/1"\nidentifier = "7"\n')
    _, _, err = run("fit", "table.csv", "--spec", "lab.toml")
    schemas = "schema 'accelcal/laboratory/1' is unknown; write schema = 'accelcal/specification/1'"
    assert err == f"lab.toml: {schemas}\n"


@pytest.mark.parametrize(
    "command",
    [
        ("fit", "table.csv", "--output", ""),
        ("check", "table.csv", "--unit", ""),
        ("design", "--optimal", ""),
        ("discover", "table.csv", "--effects", ""),
        ("compare", "cal.json", "table.csv", "--serial", "  "),
    ],
)
def test_an_empty_option_is_named(run, command):
    """Some were taken as not given."""
    code, out, err = run(*command)
    assert (code, out) == (2, "")
    assert f"'{command[-2]}': it is empty; write it, or leave the option out" in said(err)


def test_blanks_around_a_text_do_not_count(run):
    assert run("compare", "cal.json", "table.csv", "--serial", " AL-15 ")[0] == 0
    code, out, _ = run("check", "table.csv", "--unit", " mA ")
    assert (code, out) == run("check", "table.csv", "--unit", "mA")[:2]


def test_an_empty_name_is_shown(run):
    code, _, err = run("fit", "")
    assert (code, said(err).startswith("'': no such file")) == (2, True)


def test_positions_and_angles_contradict_each_other(run):
    code, _, err = run("simulate", "--positions", "8", "--angles", "0,90")
    assert (code, err) == (2, "error: --positions and --angles; give one of the two\n")


def test_check_tells_the_unit_of_what_is_declared(run):
    code, out, _ = run("check", "table.csv", "--launch-sf-uncertainty", "5ppm")
    assert code == 0
    assert "launch_sf_uncertainty 5e-06 of K1" in " ".join(out.split())


def test_options_say_what_header_lines_say(run, folder):
    declared = {
        "temperature_uncertainty": 0.2,
        "resolution": 2e-6,
        "unit": "V",
        "serial": "B7",
        "launch_uncertainty": 3e-5,
        "launch_sf_uncertainty": 2e-5,
        "head_uncertainty": 1e-5,
    }
    table = (folder / "table.csv").read_text()
    lines = [f"# {key}: {value}" for key, value in declared.items()]
    body = [line for line in table.splitlines() if line.split(":")[0].strip("# ") not in declared]
    (folder / "header.csv").write_text("\n".join(lines + body) + "\n")
    options = [(f"--{key.replace('_', '-')}", str(value)) for key, value in declared.items()]
    by_options = json.loads(run("fit", "table.csv", *sum(options, ()), "--format", "json")[1])
    by_header = json.loads(run("fit", "header.csv", "--format", "json")[1])
    own = dict.fromkeys(("source", "provenance"))
    assert by_options | own == by_header | own
    assert (by_options["serial"], by_options["output_unit"]) == ("B7", "V")


def test_an_unknown_unit_of_an_option(run):
    code, _, err = run("fit", "table.csv", "--unit", "furlong")
    assert code == 2
    assert said(err).startswith("error: unit 'furlong' is no output unit; it is one of V, mV,")


@pytest.mark.parametrize(
    ("text", "seconds"), [("600", 600), ("1e3s", 1000), ("10 min", 600), ("12h", 43200)]
)
def test_durations(text, seconds):
    assert duration(text) == seconds


@pytest.mark.parametrize(
    "arguments",
    [
        ["budget", "cal.json", "--time"],
        ["stability", "table.csv", "--times"],
        ["stability", "table.csv", "--window"],
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("text", ["5weeks", "h", "", "1e99h"])
def test_durations_that_are_none(run, arguments, text):
    code, _, err = run(*arguments, text)
    assert code == 2
    assert (
        "is no time; write it as 600, 600s, 10min or 12h;" in err
        or "is not a finite" in err
        or "too large" in err
    )


@pytest.mark.parametrize(
    "arguments",
    [
        ["--acceleration", "1e300"],
        ["--temperature", "1e300", "--extrapolate"],
        ["--time", "1e300"],
        ["--drift-rate", "1e300"],
    ],
    ids=" ".join,
)
def test_numbers_too_large_to_calculate_with(run, arguments):
    code, _, err = run("budget", "cal.json", *arguments)
    assert code == 2
    assert "'1e300' is too large; nothing here exceeds 1e+12;" in err


RECORDS = {
    "outputs": (lambda i: (i, 1e300 + i * 1e298), "output '1e+300' is too large;"),
    "one output": (lambda i: (i, 1e300 if i == 0 else i), "output '1e+300' looks like a marker"),
    "small outputs": (lambda i: (i, 1e-300 * (2 + i)), "output '2e-300' is too small, as all"),
    "times": (
        lambda i: (1e298 * (i + 1), i),
        "time '1e+298' is no time of a record; write seconds, or name the unit of the time",
    ),
    "milliseconds since 1970": (
        lambda i: (1_700_000_000_000 + 5000 * i, i),
        "time '1700000000000' is no time of a record; write seconds, or name the unit",
    ),
    "days": (
        lambda i: (45000.0 + 5.0 * i / 86400.0, i),
        "time '45000.0' may count days, as a spreadsheet does with dates; name the column",
    ),
    "short times": (lambda i: (1e-300 * i, i), "time does not increase in launch '1';"),
}


@pytest.mark.parametrize("name", RECORDS)
def test_records_too_large_to_calculate_with(run, folder, name):
    row, problem = RECORDS[name]
    lines = [",".join(map(repr, row(i))) for i in range(20)]
    (folder / "record.csv").write_text("\n".join(["time,output", *lines]) + "\n")
    code, out, err = run("stability", "record.csv")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.partition(": ")[2].startswith(problem)


def test_one_output_only(run, folder):
    (folder / "record.csv").write_text("time,output\n0,1.5\n")
    assert "record.csv:2: the only output is 1.5; check" in run("stability", "record.csv")[2]


def test_a_scale_factor_too_small(run):
    code, _, err = run("stability", "table.csv", "--scale-factor", "1e-300")
    assert code == 2
    assert "'1e-300' is too small; write 0, or 1e-30 or more;" in err


# -- several mountings -----------------------------------------------------------------------------


@pytest.fixture
def both(run, folder):
    """One level in two mountings, and its calibration."""
    assert (
        run(
            "simulate",
            "--mounting",
            "o+,o-",
            "--temperatures",
            "20",
            "--seed",
            "1",
            "-o",
            "both.csv",
        )[0]
        == 0
    )
    assert run("fit", "both.csv", "-o", "both.json")[0] == 0
    (folder / "data.csv").write_text("output [mA]\n1.25\n")
    return accelcal.Calibration.from_json((folder / "both.json").read_text())


def test_mountings_by_commas_or_one_by_one(run, both, folder):
    assert [table.mounting for table in both.tables] == ["o+", "o-"]
    run(
        "simulate",
        "--mounting",
        "o+",
        "--mounting",
        "o-",
        "--temperatures",
        "20",
        "--seed",
        "1",
        "-o",
        "two.csv",
    )
    assert (folder / "two.csv").read_bytes() == (folder / "both.csv").read_bytes()


@pytest.mark.filterwarnings("ignore:checks of the calibration warn")  # one does by chance
@pytest.mark.parametrize("mounting", ["o+", "o-"])
def test_a_mounting_is_chosen(run, both, mounting):
    assert run("apply", "both.json", "data.csv")[0] == 0  # both sides together
    code, out, _ = run("apply", "both.json", "data.csv", "--mounting", mounting)
    assert code == 0
    (table,) = both.of_mounting(mounting).tables
    found = accelcal.apply(both.of_mounting(mounting), [1.25])
    assert table.mounting == mounting
    assert float(out.splitlines()[-1].split(",")[0]) == pytest.approx(found.value[0], rel=1e-14)
    for command in (["budget", "both.json"], ["export", "both.json", "--format", "c"]):
        assert run(*command, "--mounting", mounting)[0] == 0


@pytest.mark.usefixtures("both")
def test_a_mounting_that_was_not_tested(run):
    code, _, err = run("budget", "both.json", "--mounting", "p+")
    assert (code, said(err)) == (2, "error: no table of mounting 'p+'; the calibration has o+, o-")


def test_laws_stay_with_their_mounting():
    plan = accelcal.TumblePlan(mountings=("o+", "o-"), temperatures=(20.0, 80.0, -40.0))
    whole = accelcal.fit(accelcal.simulate(plan=plan, seed=1))
    assert whole.of_mounting("o+").temperature_model == whole.temperature_model is not None
    assert whole.of_mounting("o-").temperature_model is None


def test_noises_stay_with_their_tables():
    """The tables left had the noises of the first ones, and compare failed."""
    plan = accelcal.TumblePlan(mountings=("o+", "o-"), temperatures=(20.0, 80.0))
    whole = accelcal.fit(accelcal.simulate(plan=plan, seed=1))
    assert whole.reading_noises == tuple(s for s in whole.error_sources if s.name == "reading")
    kept = whole.of_mounting("o-")
    assert kept.reading_noises == tuple(
        noise
        for table, noise in zip(whole.tables, whole.reading_noises, strict=True)
        if table.mounting == "o-"
    )
    assert accelcal.Calibration.from_json(kept.to_json()) == kept
    plan = accelcal.TumblePlan(temperatures=(20.0, 80.0))
    found = accelcal.compare(whole.of_mounting("o+"), accelcal.simulate(plan=plan, seed=2))
    assert found.p_value > 0.01


def test_a_level_met_again_is_said(run, folder):
    rows = [
        f"{level},{place},{stroke},{1.3 * math.cos(place * math.pi / 4) + 1e-6 * index % 7e-6}"
        for index, (level, strokes) in enumerate([(20, (1, 2)), (80, (1, 2)), (20, (3, 4))])
        for stroke in strokes
        for place in range(1, 10)
    ]
    (folder / "again.csv").write_text("\n".join(["T,J,k,Y", *rows]) + "\n")
    code, out, err = run("fit", "again.csv", "--format", "json")
    assert code == 0
    assert err == (
        "note: again.csv: a temperature was met again (line 38): a new run there, '20 (2)'\n"
    )
    assert [table["run"] for table in json.loads(out)["tables"]] == ["20", "80", "20 (2)"]


# -- results ---------------------------------------------------------------------------------------


def test_csv_holds_the_temperature_laws(run):
    rows = list(csv.DictReader(io.StringIO(run("fit", "table.csv", "--format", "csv")[1])))
    laws = {row["coefficient"]: row for row in rows if not row["run"]}
    document = json.loads(run("fit", "table.csv", "--format", "json")[1])
    slope = document["temperature_model"]["k0"]["below"]
    assert float(laws["k0 below"]["value"]) == slope["value"]
    assert laws["k0 below"]["unit"] == "g/degC"
    assert len(laws) == 9


def test_apply_fails_before_it_prints(run, folder):
    (folder / "data.csv").write_text("output [mA],temperature\nx,20\n")
    code, out, err = run("apply", "cal.json", "data.csv")
    assert (code, out) == (2, "")
    assert said(err).startswith("data.csv:2: output [mA] 'x' is not a number")


@pytest.mark.parametrize(
    "text",
    [
        "sep=;\n# unit: mA;;\noutput;temperature;;\n1,25;20;;\n",
        "# unit: mA,,\noutput,temperature,,\n1.25,20,,\n",
        "output [mA];temperature\n1,25;20\n",
        '"# unit: mA"\noutput,temperature\n1.25,20\n',
        "# unit: mA\noutput,temperature,,\n1.25,20\n",
    ],
)
def test_streams_as_programs_write_them(run, folder, text):
    (folder / "data.csv").write_text(text)
    code, out, err = run("apply", "cal.json", "data.csv")
    assert (code, "names no unit" in err) == (0, False)
    assert float(out.splitlines()[-1].split(",")[0]) == pytest.approx(0.9218, abs=1e-3)
