"""The calibration of a triad applied: accelerations along three axes, with their uncertainty."""

import csv
import tracemalloc
import warnings
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t as student

import accelcal
from accelcal.cli.main import main
from accelcal.errors import AccelcalWarning, InputError

BIAS = np.array([0.01, -0.02, 0.03])
SENSITIVITY = np.array([[1.3, 0.002, -0.001], [0.003, 1.25, 0.002], [-0.002, 0.001, 1.35]])
AXES = "xyz"


def directions(rng, n):
    up = rng.normal(size=(n, 3))
    return up / np.linalg.norm(up, axis=1)[:, None]


def outputs(up):
    return BIAS + up @ SENSITIVITY.T


def calibrated(seed=1, attitudes=12, noise=(1e-5, 1e-5, 1e-5), **fields):
    rng = np.random.default_rng(seed)
    up = directions(rng, attitudes)
    found = accelcal.calibrate_triad(outputs(up) + noise * rng.normal(size=up.shape), up)
    return replace(found, output_unit="mA", g_local_m_s2=9.81, serial="B7", **fields)


def applied(triad, output, **options):
    return accelcal.apply(triad, output, same_launch=True, **options)


def test_accelerations_are_those_of_the_calibration():
    triad, up = calibrated(), directions(np.random.default_rng(2), 50)
    found = applied(triad, outputs(up))
    assert np.array_equal(found.value, triad.accelerations(outputs(up)))
    assert found.value == pytest.approx(up, abs=5e-5)
    assert found.inside.all()
    assert repr(found) == "<MeasuredAcceleration: 50 samples>"


def test_uncertainty_is_the_covariance_carried_through_derivatives():
    triad = calibrated()
    output = outputs(np.array([[0.3, -0.5, 2.0]]))
    names = triad.covariance_names
    rows = []
    for name in names:
        step = 1e-7
        ends = [
            replace(
                triad,
                parameters={
                    **triad.parameters,
                    name: replace(
                        triad.parameters[name], value=triad.parameters[name].value + sign * step
                    ),
                },
            ).accelerations(output)[0]
            for sign in (1, -1)
        ]
        rows.append((ends[0] - ends[1]) / (2 * step))
    jacobian = np.array(rows).T
    expected = np.sqrt(np.diag(jacobian @ triad.covariance @ jacobian.T))
    found = applied(triad, output)
    assert found.standard_uncertainty[0] == pytest.approx(expected, rel=1e-6)
    factor = found.expanded_uncertainty / found.standard_uncertainty
    fewest = min(parameter.dof for parameter in triad.parameters.values())
    assert 6.0 < fewest < 8.0  # 12 attitudes, where errors of them are not felt in all alike
    assert factor == pytest.approx(np.full((1, 3), student.ppf(0.975, fewest)), rel=1e-6)
    assert not found.inside.any()


def test_the_uncertainty_of_an_output_is_added():
    triad, output = calibrated(), outputs(np.eye(3))
    plain, noisy = applied(triad, output), applied(triad, output, output_uncertainty=1e-3)
    added = noisy.standard_uncertainty**2 - plain.standard_uncertainty**2
    inverse = np.linalg.inv(triad.sensitivity)
    assert added == pytest.approx(np.tile(1e-6 * np.sum(inverse**2, axis=1), (3, 1)), rel=1e-9)


@pytest.mark.parametrize(
    ("attitudes", "known", "least"), [(8, True, 0.93), (12, False, 0.95), (24, True, 0.93)]
)
def test_intervals_hold_the_acceleration(attitudes, known, least):
    lower = np.tril(SENSITIVITY)  # which is S in the frame of unknown attitudes
    rng = np.random.default_rng(attitudes)
    points = directions(rng, 20)
    held = []
    for _ in range(150):
        up = directions(rng, attitudes)
        output = BIAS + up @ lower.T + 1e-4 * np.array([1.0, 3.0, 5.0]) * rng.normal(size=up.shape)
        triad = accelcal.calibrate_triad(output, up if known else None)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccelcalWarning)  # a gate in a few of them
            found = applied(triad, BIAS + points @ lower.T)
        held.append(np.abs(found.value - points) <= found.expanded_uncertainty)
    assert least <= np.mean(held) <= 0.997


def test_long_arrays_come_out_as_their_parts_do_and_take_little_memory():
    triad = calibrated()
    output = outputs(directions(np.random.default_rng(2), 200_000))
    parts = [applied(triad, output[at : at + 70_000]) for at in range(0, 200_000, 70_000)]
    tracemalloc.start()
    try:
        whole = applied(triad, output)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert np.array_equal(whole.value, np.concatenate([each.value for each in parts]))
    expanded = np.concatenate([each.expanded_uncertainty for each in parts])
    assert np.array_equal(whole.expanded_uncertainty, expanded)
    assert peak < 2.5 * sum(each.nbytes for each in (whole.value, expanded, expanded))


def test_a_frame_of_outputs_keeps_its_index():
    triad, up = calibrated(), directions(np.random.default_rng(3), 4)
    frame = pd.DataFrame(outputs(up), columns=list(AXES), index=[0.0, 0.1, 0.2, 0.3])
    frame.loc[0.2, "y"] = np.nan
    table = applied(triad, frame).to_frame()
    assert table.index.tolist() == frame.index.tolist()
    assert table.columns[:3].tolist() == [f"acceleration_{axis}" for axis in AXES]
    assert table.iloc[2, :9].isna().all()
    assert table["inside"].tolist() == [True, True, False, True]
    assert set(table.attrs["units"].values()) == {"g"}


@pytest.mark.parametrize("form", ["{}", "acc_{}", "a{} [mA]", "{}_mA", "UP_{}"])
def test_columns_of_a_frame_count_by_their_names(form):
    """Those in the order z, y, x were taken for x, y, z, without a word."""
    up = directions(np.random.default_rng(4), 9)
    named = pd.DataFrame(outputs(up), columns=[form.format(axis) for axis in AXES])
    other = named.iloc[:, [2, 0, 1]].assign(temperature=20.0)
    triad = accelcal.calibrate_triad(outputs(up), up)
    assert applied(triad, other).value == pytest.approx(applied(triad, named.to_numpy()).value)
    assert triad.accelerations(other) == pytest.approx(triad.accelerations(named.to_numpy()))
    assert accelcal.calibrate_triad(other, up) == triad
    assert accelcal.TriadRecord(other, up) == accelcal.TriadRecord(named.to_numpy(), up)


def test_the_columns_x_y_z_count_where_others_have_axes_too():
    up = directions(np.random.default_rng(4), 9)
    record = accelcal.TriadRecord(outputs(up), up)
    triad = accelcal.calibrate_triad(record)
    assert applied(triad, record.to_frame()).value == pytest.approx(up, abs=1e-9)


def test_columns_without_axes_count_in_their_order_and_half_named_ones_are_refused():
    triad, given = calibrated(), outputs(np.eye(3))
    plain = applied(triad, given).value
    assert applied(triad, pd.DataFrame(given, columns=list("abc"))).value == pytest.approx(plain)
    with pytest.raises(InputError, match="columns 'x, b, z'; give one for each of x, y and z"):
        applied(triad, pd.DataFrame(given, columns=["x", "b", "z"]))


def test_what_is_of_one_accelerometer_is_refused():
    triad, output = calibrated(), outputs(np.eye(3))
    for name, value in {"temperature": 20.0, "a_p": 0.0, "run": "1", "extrapolate": True}.items():
        with pytest.raises(InputError, match=f"^{name}=... is given for a triad; leave it out"):
            applied(triad, output, **{name: value})
    with pytest.raises(InputError, match="the last axis holds x, y, z"):
        applied(triad, output[:, :2])


def test_what_the_calibration_does_not_know_is_told():
    triad = calibrated()
    with pytest.warns(AccelcalWarning, match="one launch and no temperature"):
        accelcal.apply(triad, outputs(np.eye(3)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        applied(triad, outputs(np.eye(3)))
    up = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0]])
    bare = accelcal.calibrate_triad(outputs(up), up)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = applied(bare, outputs(np.eye(3)))
    assert [str(each.message)[:40] for each in told] == [
        "checks of the calibration warn, attitude",
        "the attitudes of the calibration left no",
    ]
    assert found.value == pytest.approx(np.eye(3), abs=1e-9)
    assert np.isnan(found.standard_uncertainty).all()
    assert np.isnan(found.expanded_uncertainty).all()


def test_the_file_of_a_triad_is_read_as_that_of_one_accelerometer(tmp_path):
    triad = calibrated()
    triad.to_json(tmp_path / "triad.json")
    assert accelcal.read_calibration(tmp_path / "triad.json") == triad
    assert accelcal.read_calibration(tmp_path / "triad.json", serial="B7") == triad
    with pytest.raises(InputError, match="serial C is asked for"):
        accelcal.read_calibration(tmp_path / "triad.json", serial="C")


def test_a_calibration_with_a_temperature_holds_there_alone():
    triad, output = calibrated(temperature_degC=20.0), outputs(np.eye(3))
    found = applied(triad, output, temperature=[19.5, 20.0, np.nan])
    assert found.inside.tolist() == [True, True, False]
    assert np.array_equal(found.value[:2], triad.accelerations(output)[:2])
    assert np.isnan(found.value[2]).all()
    with pytest.raises(
        InputError, match=r"temperature 60 degC is more than 1 degC outside .*; cal"
    ):
        applied(triad, output, temperature=[20.0, 60.0, 20.0], extrapolate=False)
    with pytest.warns(AccelcalWarning, match="for 20 degC only, in 1 sample$"):
        found = applied(triad, output, temperature=[20.0, 60.0, 20.0], extrapolate=True)
    assert found.inside.tolist() == [True, False, True]
    with pytest.raises(InputError, match=r"293.15 is no temperature of a test"):
        applied(triad, output, temperature=293.15, extrapolate=True)
    with pytest.raises(InputError, match="temperature has shape"):
        applied(triad, output, temperature=[20.0, 20.0])
    with pytest.warns(AccelcalWarning, match="the calibration knows one launch: what shifts"):
        accelcal.apply(triad, output, temperature=20.0)


# -- the command -----------------------------------------------------------------------------------


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run_on(text, *options, triad=None):
        (triad or calibrated()).to_json("triad.json")
        (tmp_path / "data.csv").write_text(text, "utf-8")
        code = main(["apply", "triad.json", "data.csv", "-o", "out.csv", *options])
        out = tmp_path / "out.csv"
        lines = out.read_text("utf-8").splitlines() if out.exists() else []
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        return code, rows, capsys.readouterr().err

    return run_on


STREAM = "time,T,ax_mA,ay_mA,az_mA\n0.0,20,1.31,-0.017,0.028\n0.1,20,0.0,2.48,0.03\n"


def test_a_stream_gets_the_values_of_the_library(run):
    code, rows, err = run(STREAM, "--same-launch", "--output-uncertainty", "1e-4")
    output = [[1.31, -0.017, 0.028], [0.0, 2.48, 0.03]]
    found = applied(calibrated(), output, output_uncertainty=1e-4)
    expected = found.to_frame()
    assert code == 0
    assert [row["time"] for row in rows] == ["0.0", "0.1"]
    for name in expected.columns:
        digits = 1e-14 if name.startswith("acc") else 5e-3
        told = [float(row[name]) for row in rows]
        assert told == pytest.approx(expected[name].astype(float).tolist(), rel=digits)
    assert [row["inside"] for row in rows] == ["1", "0"]
    assert "note: column temperature is set aside: that of the calibration is unknown" in err
    assert "warning: 1 of 2 samples are longer than the tested 1 g" in err


def test_units_and_headings_of_a_stream(run):
    plain = run(STREAM, "--same-launch")[1]
    below = "Zeit;x;y;z\ns;uA;uA;uA\n0,0;1310;-17;28\n0,1;0;2480;30\n"
    code, rows, err = run(below, "--same-launch")
    assert code == 0
    assert "outputs in uA are converted to mA" in err
    for one, other in zip(plain, rows, strict=True):
        assert float(one["acceleration_x"]) == pytest.approx(float(other["acceleration_x"]))
    metres = run(STREAM, "--same-launch", "--in", "m/s^2")[1]
    assert float(metres[0]["acceleration_x"]) == pytest.approx(
        9.81 * float(plain[0]["acceleration_x"])
    )
    assert run("# unit: mA\nx,y,z\n1.31,-0.017,0.028\n", "--same-launch")[1][0] == {
        name: cell for name, cell in plain[0].items() if name != "time"
    }


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("time,x,y\n0,1,1\n", (), "data.csv:1: no column z among"),
        (STREAM.replace("ay_mA", "ay_V"), (), "data.csv:1: units 'mA' and 'V' in one table"),
        (STREAM.replace("mA", "V"), (), "outputs in V, but the calibration is for mA"),
        ("# serial: C9\n" + STREAM, (), "serial C9 is asked for, but it holds the calibration of"),
        (STREAM, ("--run", "1"), "is given for a triad; leave it out"),
        (STREAM, ("--temperature", "20"), "is given for a triad; leave it out"),
        (STREAM, ("--extrapolate",), "--extrapolate is given for a triad; leave it out"),
        (STREAM.replace("2.48", "2.4x"), (), "data.csv:3: "),
    ],
)
def test_a_stream_that_does_not_fit_is_refused_in_a_line(run, text, options, message):
    code, rows, err = run(text, "--same-launch", *options)
    assert (code, rows) == (2, [])
    errors = [line for line in err.splitlines() if not line.startswith("note: ")]
    assert len(errors) == 1
    assert message in errors[0]


def test_temperatures_of_a_stream(run):
    triad = calibrated(temperature_degC=20.4)
    code, rows, err = run(STREAM, "--same-launch", triad=triad)
    assert (code, len(rows)) == (0, 2)
    assert "temperature" not in err
    hot = STREAM.replace("0.1,20,", "0.1,65,")
    code, rows, err = run(hot, "--same-launch", triad=triad)
    assert code == 2
    assert "\ndata.csv:3: temperature 65 degC is more than 1 degC outside" in err
    code, rows, err = run(hot, "--same-launch", "--extrapolate", triad=triad)
    assert (code, [row["inside"] for row in rows]) == (0, ["1", "0"])
    assert "warning: 1 of 2 samples are outside the calibrated temperatures" in err
    code, _, err = run(STREAM, "--temperature", "80", triad=triad)
    assert (code, "80 degC is more than 1 degC outside" in err) == (2, True)
    without = STREAM.replace("T,", "other,")
    assert "the calibration holds at 20.4 degC" in run(without, triad=triad)[2]
    assert run("# temperature: 20\n" + without, triad=triad)[2].count("temperature") == 0


def test_an_axis_of_a_triad_does_not_pass_for_the_output_of_one_accelerometer(run):
    """The column y was taken for the output Y, and x and z left aside without a word."""
    found = accelcal.fit(accelcal.simulate(seed=1))
    code, _, err = run("x,y,z,temperature\n1.3,0.1,0.2,20\n", triad=found)
    assert code == 2
    assert "data.csv:1: columns x, y and z of a triad; name the column of this" in err


def test_rows_of_other_order_are_refused():
    frame = pd.DataFrame(outputs(np.eye(3)), columns=list(AXES), index=[3, 4, 5])
    warm = pd.Series([20.0, 20.0, 20.0], index=[5, 4, 3])
    triad = calibrated(temperature_degC=20.0)
    with pytest.raises(InputError, match="output and temperature are Series of different indices"):
        applied(triad, frame, temperature=warm)
    assert applied(triad, frame, temperature=warm[::-1]).value.shape == (3, 3)


def test_the_file_says_once_that_the_clampings_are_not_in_u(tmp_path, monkeypatch, capsys):
    """Only the calibration told it, and who had the accelerations took U for all there is."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(5)
    up = np.vstack([np.eye(3), -np.eye(3)] * 2)
    given = outputs(up) + 1e-5 * rng.normal(size=up.shape)
    (tmp_path / "imu.csv").write_text("# unit: mA\nx,y,z\n0.01,1.23,0.03\n")
    named = accelcal.TriadRecord(given, up, shaft=tuple("xyzxyz" * 2))
    said = "clampings of the calibration not assessed: no shafts are named: U counts errors of"
    for record, times in ((accelcal.TriadRecord(given, up), 1), (named, 0)):
        found = replace(accelcal.calibrate_triad(record), output_unit="mA")
        found.to_json("triad.json")
        assert main(["apply", "triad.json", "imu.csv", "-o", "out.csv"]) == 0
        lines = (tmp_path / "out.csv").read_text().splitlines()
        assert sum(line.startswith(f"# note: {said}") for line in lines) == times
        for name in ("t.h", "t.yaml", "t.csv"):
            assert main(["export", "triad.json", "-o", name]) == 0
            written = (tmp_path / name).read_text().replace("\n *    ", "")
            assert written.count(said) == times, name
    with warnings.catch_warnings(record=True) as caught:  # no warning at each call
        warnings.simplefilter("always")
        applied(accelcal.calibrate_triad(given, up), [0.01, 1.23, 0.03])
    assert not [each for each in caught if "clampings" in str(each.message)]
    capsys.readouterr()
