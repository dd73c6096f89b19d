"""Readings of a real MEMS accelerometer and the figures that another program published for it.

imucal (github.com/mad-lab-fau/imucal, MIT licence, commit 8716e4c50bbb7044918b747f38b26cb0a6420910)
calibrates the three axes from six poses by Ferraris' method. Its regression snapshot
tests/snapshots/example_cal.json holds, at g = 9.81 m/s^2, the figures below. K_a is the length of
the row of sensitivities of an axis; b_a is the mean of the two poses in which that axis is
vertical, which is K0 + K2 in (1).
"""

import itertools
import math
import textwrap
from pathlib import Path

import pytest

import accelcal
from accelcal.cli.main import main

EXAMPLES = Path(__file__).parents[1] / "examples"
PLANES = ("y", "z")
K_A = 208.54567263762615  # counts per m/s^2
R_A = (0.9999125214309234, 0.007122056140390757, -0.011145662922687352)
B_A = -6.018868019671572  # counts
G = 9.81


def fitted(plane):
    return accelcal.fit(accelcal.read_table(EXAMPLES / f"mems_x_plane_{plane}.csv"))


@pytest.fixture(scope="module")
def planes():
    return {plane: fitted(plane) for plane in PLANES}


def coefficient(calibration, name):
    return calibration.tables[0].coefficients[name].value


def test_scale_factor_is_the_published_one(planes):
    along = coefficient(planes["y"], "K1")
    across = [coefficient(planes[plane], "M") for plane in PLANES]
    assert math.hypot(along, *across) / G == pytest.approx(K_A, rel=1e-14)


def test_direction_of_the_axis_is_the_published_one(planes):
    """The rows of R_a are the sensitivities over their length; the signs are those of the poses."""
    along = coefficient(planes["y"], "K1")
    assert along / (G * K_A) == pytest.approx(R_A[0], rel=1e-14)
    for plane, expected in zip(PLANES, R_A[1:], strict=True):
        found = coefficient(planes[plane], "M") / (G * K_A)
        assert abs(found) == pytest.approx(abs(expected), rel=1e-12)


@pytest.mark.parametrize("plane", PLANES)
def test_bias_is_the_published_one(planes, plane):
    """Both planes hold the same two vertical poses of the axis."""
    found = coefficient(planes[plane], "K0") + coefficient(planes[plane], "K2")
    assert found == pytest.approx(B_A, rel=1e-13)


def test_the_lines_of_the_readme_print_the_published_figures(monkeypatch, capsys):
    monkeypatch.chdir(EXAMPLES.parent)
    text = (EXAMPLES / "README.md").read_text("utf-8").split("from the two fits:\n\n")[1]
    lines = itertools.takewhile(lambda line: line.startswith("        "), text.splitlines())
    exec(textwrap.dedent("\n".join(lines)), {})
    printed = [float(number) for number in capsys.readouterr().out.split()]
    assert printed == pytest.approx([K_A, B_A], rel=1e-13)


def test_both_planes_see_the_same_axis(planes):
    y, z = (coefficient(planes[plane], "K1") for plane in PLANES)
    assert y == pytest.approx(z, rel=1e-14)


@pytest.mark.parametrize("plane", PLANES)
def test_uncertainty_is_that_of_the_two_vertical_poses(planes, plane):
    """K1 is half the difference of two means of 1028 and 1061 samples with the std of the file.

    Deviations of so many samples are drawn to each other by less than a thousandth.
    """
    up, down = 6.8977936478481539 / math.sqrt(1028), 6.4791038329147836 / math.sqrt(1061)
    found = planes[plane].tables[0].coefficients["K1"].standard_uncertainty
    assert found == pytest.approx(math.hypot(up, down) / 2.0, rel=1e-3)


@pytest.mark.parametrize("plane", PLANES)
def test_report_says_what_four_positions_cannot_tell(capsys, plane):
    assert main(["fit", str(EXAMPLES / f"mems_x_plane_{plane}.csv")]) == 0
    text = capsys.readouterr().out
    assert "K1 stands for K1 + K3" in text
    assert "M_ip leaves no trace at these angles and is not estimated" in text
    assert text.count("not determined") == 2
    assert "counts/g" in text
    assert "temperature unknown" in text
    assert "counts per m/s^2" in text


@pytest.mark.parametrize("plane", PLANES)
def test_strict_refuses_four_positions(capsys, plane):
    path = EXAMPLES / f"mems_x_plane_{plane}.csv"
    assert main(["fit", "--strict", str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert str(path) in err
    assert "K1 stands for K1 + K3" in err
