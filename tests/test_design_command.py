"""The command: its forms, its picture, its sheet, and what it refuses."""

import itertools
import json
from pathlib import Path

import pytest

import accelcal
from accelcal.cli.main import main

QUICK = ["design", "--positions", "8", "--strokes", "2", "--no-effects"]


def ran(capsys, *arguments):
    code = main([*map(str, arguments)])
    out, err = capsys.readouterr()
    return code, out, err


def test_text_json_and_csv(capsys):
    code, text, err = ran(capsys, *QUICK)
    assert (code, err) == (0, "")
    assert "8 x 2" in text
    document = json.loads(ran(capsys, *QUICK, "--format", "json")[1])
    assert document["designs"][0]["strokes"] == 2
    lines = ran(capsys, *QUICK, "--format", "csv")[1].splitlines()
    assert lines[0].startswith("positions,strokes,temperatures")


def test_document_and_sheet_are_written(capsys, tmp_path):
    document, plan = tmp_path / "d.json", tmp_path / "plan.csv"
    code, _, _ = ran(capsys, *QUICK, "-o", document, "--sheet", plan)
    assert code == 0
    assert json.loads(document.read_text("utf-8"))["pace"]["soak"] == 2.0
    text = plan.read_text("utf-8")
    assert text.startswith("# plan: 54 readings")
    assert "# head_uncertainty: 6.7e-06" in text


def test_undeclared_errors_are_not_in_the_sheet(capsys, tmp_path):
    plan = tmp_path / "plan.csv"
    ran(capsys, *QUICK, "--undeclared", "--sheet", plan)
    assert "uncertainty" not in plan.read_text("utf-8")


@pytest.mark.parametrize("form", ["png", "svg"])
def test_picture(capsys, tmp_path, form):
    pytest.importorskip("matplotlib")
    path = tmp_path / f"d.{form}"
    code, _, err = ran(capsys, *QUICK, "--target", "K1=12ppm", "--plot", path)
    assert (code, err) == (0, "")
    assert path.stat().st_size > 10_000


def test_ticks_of_a_picture_say_whole_values():
    pytest.importorskip("matplotlib")
    found = accelcal.design(positions=[8, 12], temperatures=[(20.0, 80.0, -40.0)], effects=False)
    axes = found.plot.hours()
    axes[0].figure.canvas.draw()
    assert {ax.yaxis.get_offset_text().get_text() for ax in axes} == {""}


def test_tests_that_are_as_good_look_as_good():
    """No axis spans less than a tenth of its values, and its unit is written as in a report."""
    pytest.importorskip("matplotlib")
    found = accelcal.design(positions=[8, 12], temperatures=[(20.0, 80.0, -40.0)], effects=False)
    axes = found.plot.hours()
    for ax in axes:
        low, high = ax.get_ylim()
        assert (high - low) / (high + low) >= 0.049
        assert all(low < y < high for line in ax.lines for y in line.get_ydata())
    assert axes[4].get_ylabel() == "u [µrad]"


def test_names_of_tests_are_apart_and_within_their_panel():
    pytest.importorskip("matplotlib")
    found = accelcal.optimal_design("K2", hours=12.0)
    for ax in found.plot.hours():
        ax.figure.canvas.draw()
        boxes = [text.get_window_extent() for text in ax.texts]
        assert len(boxes) > 2
        pairs = itertools.combinations(boxes, 2)
        assert not any(one.overlaps(other) for one, other in pairs)
        assert all(ax.bbox.x0 <= box.x0 and box.x1 <= ax.bbox.x1 for box in boxes)


@pytest.mark.parametrize(("strokes", "others"), [(range(2, 20), False), (range(2, 30), True)])
def test_kinds_of_tests_look_different_and_stand_in_the_legend(strokes, others):
    """Beyond eight kinds colours came again, and the legend told the first of the two."""
    pytest.importorskip("matplotlib")
    found = accelcal.design(
        positions=[8], strokes=strokes, temperatures=[(20.0,)], hours=None, effects=False
    )
    panel, *_ = found.plot.hours()
    (legend,) = panel.figure.legends
    shown = {
        text.get_text(): line
        for text, line in zip(legend.texts, legend.legend_handles, strict=True)
    }
    kinds = [f"{count} strokes at 20 °C, o+" for count in strokes]
    assert [*shown][:-1] == ([*kinds[:24], "other tests"] if others else kinds)
    looks = [(line.get_marker(), line.get_color()) for line in shown.values()]
    assert len(set(looks)) == len(looks)
    points = [line for line in panel.lines if line.get_linestyle() == "None"]
    told = [(line.get_marker(), line.get_markeredgecolor()) for line in points]
    assert told == [looks[min(i, 24)] for i in range(len(strokes))]


def test_labels_of_many_tests_are_apart():
    pytest.importorskip("matplotlib")
    found = accelcal.design(
        positions=[8, 12, 16, 24, 36],
        strokes=[2, 4, 6, 8],
        temperatures=[(20.0, 80.0)],
        effects=False,
    )
    for ax in found.plot.hours():
        ax.figure.canvas.draw()
        boxes = [text.get_window_extent() for text in ax.texts]
        assert len(boxes) > 3
        pairs = itertools.combinations(boxes, 2)
        assert not any(one.overlaps(other) for one, other in pairs)


def test_options_reach_the_stand_and_the_pace(capsys):
    stand = ["--noise", "1e-5", "--head-uncertainty", "2e-5", "--launch-uncertainty", "0"]
    pace = ["--reading-time", "10", "--turn-time", "20", "--soak-time", "1", "--mount-time", "0"]
    document = json.loads(ran(capsys, *QUICK, *stand, *pace, "--format", "json")[1])
    assert document["stand"]["reading"] == 1e-5
    assert document["stand"]["launch"] == 0.0
    assert document["pace"] == {"reading": 10.0, "turn": 20.0, "soak": 1.0, "mount": 0.0}


def test_optimal(capsys, tmp_path):
    plan = tmp_path / "plan.csv"
    code, text, err = ran(capsys, "design", "--optimal", "K1", "--hours", "8", "--sheet", plan)
    assert (code, err) == (0, "")
    assert text.startswith("Best angles for K1")
    assert "not found" not in text
    assert plan.read_text("utf-8").count("\n") > 30


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([*QUICK, "--target", "K1"], "not of the form NAME=SIZE, such as K1=5ppm"),
        ([*QUICK, "--target", "K9=1ppm"], "coefficient 'K9' is unknown"),
        ([*QUICK, "--target", "K1=4ppm"], "cannot be reached with this stand"),
        ([*QUICK, "--target", "K1=5"], "K1='5' has no unit, and K1 is relative: it is too large"),
        ([*QUICK, "--target", "lam1=0.3"], "write the unit, as in lam1=2ug/degC"),
        ([*QUICK, "--target", "K1=5 furlongs"], "K1 is relative; write a number above zero"),
        ([*QUICK, "--target", "K1=9ppm", "--target", "K1=8ppm"], "has two targets"),
        ([*QUICK, "--reading-time", "-3"], "time of a reading is -3"),
        ([*QUICK, "--noise", "-1"], "reading is -1"),
        ([*QUICK, "--cycles", "2"], "give one of them"),
        ([*QUICK, "--hours", "3"], "soaks and mountings alone take 7 h"),
        (["design", "--positions", "7.5"], "write whole numbers above zero"),
        ([*QUICK, "--seed", "3"], "--seed is for --optimal"),
        ([*QUICK, "--spacing", "3"], "--spacing is for --optimal"),
        (["design", "--optimal", "D"], "--optimal needs --hours"),
        (["design", "--optimal", "D", "--hours", "9", "--positions", "8"], "leave one out"),
        (["design", "--optimal", "D", "--hours", "9", "--strokes", "2,4"], "one choice"),
        (["design", "--optimal", "Q", "--hours", "9"], "criterion 'Q' is unknown"),
        (
            ["design", "--positions", "6", "--no-effects", "--sheet", "x.csv"],
            "--sheet is for one test",
        ),
        (
            [*QUICK, "--plot", "x.gif"],
            "x.gif: the name ends in none of .png, .svg, .pdf",
        ),
    ],
)
def test_bad_input_is_one_line(capsys, arguments, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = ran(capsys, *arguments)
    assert code == 2
    assert out == ""
    assert told in err
    assert "Traceback" not in err
    assert list(Path().iterdir()) == []


def test_sizes_of_effects_have_units_that_are_easily_read(capsys):
    """The drift of a chamber was in 1e-6 degC/h."""
    assert main(["design", "--positions", "8", "--strokes", "6"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    [chamber] = [row for row in rows if row[:1] == ["chamber-drift"]]
    [fourth] = [row for row in rows if row[:1] == ["fourth-order"]]
    assert (float(chamber[1]) < 0.1, chamber[-1], fourth[-1]) == (True, "degC/h", "ug/g^4")
