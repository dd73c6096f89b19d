"""The triad for navigation code: what an export says, and that C computes what Python does."""

import csv
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from c_compiler import compiled, needs_compiler, printed_by

import accelcal
from accelcal.cli.main import main
from accelcal.export.c_text import c_prefix
from accelcal.export.triad import triad_content, triad_header
from accelcal.io.triad import read_triad

EXAMPLE = Path(__file__).parents[1] / "examples" / "triad.csv"
PROGRAM = """
#include <stdio.h>
#include "triad.h"
int main(void)
{
    double y[3], a[3];
    while (scanf("%lf %lf %lf", &y[0], &y[1], &y[2]) > 0) {
        PREFIX_accelerations(y, a);
        printf("%.17g %.17g %.17g %d\\n", a[0], a[1], a[2], PREFIX_inside(a));
    }
    return COVARIANCE;
}
"""


@pytest.fixture(scope="module", params=["known", "unknown", "no noise"])
def triad(request):
    rng = np.random.default_rng(5)
    up = np.vstack([np.eye(3), -np.eye(3), rng.normal(size=(10, 3))])
    up /= np.linalg.norm(up, axis=1)[:, None]
    up = up[:4] if request.param == "no noise" else up
    output = 0.1 + up @ np.array([[1.3, 0.01, 0.0], [0.02, 1.2, 0.01], [0.0, 0.03, 1.4]]).T
    output += 1e-5 * rng.normal(size=output.shape)
    found = accelcal.calibrate_triad(output, None if request.param == "unknown" else up)
    return dataclasses.replace(found, serial="B 7", output_unit="V")


def from_c(folder, header, prefix, output, covariance="0"):
    """Accelerations and flags by a C program with the header."""
    (folder / "triad.h").write_text(header, "utf-8")
    text = PROGRAM.replace("PREFIX", prefix).replace("COVARIANCE", covariance)
    values = printed_by(compiled(folder, text, "-Wunused-const-variable"), output)
    return values[:, :3], values[:, 3] == 1.0


@needs_compiler
@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
def test_c_agrees_with_python(triad, tmp_path):
    output = np.random.default_rng(1).uniform(-3.0, 3.0, size=(1000, 3))
    header = triad_header(triad_content(triad), triad)
    values, inside = from_c(tmp_path, header, "accelcal_B_7", output)
    python = accelcal.apply(triad, output)
    np.testing.assert_allclose(values, python.value, rtol=0.0, atol=1e-14)
    np.testing.assert_array_equal(inside, python.inside)
    assert 0 < inside.sum() < inside.size


@needs_compiler
def test_c_tells_the_covariance(triad, tmp_path):
    if not triad.covariance_names:
        assert "/* Covariance: unknown. */" in triad_header(triad_content(triad), triad)
        return
    at = triad.covariance_names.index("S_yy")
    right = f"accelcal_B_7_covariance({at}, {at}) == {float(triad.covariance[at, at])!r} ? 0 : 1"
    header = triad_header(triad_content(triad), triad)
    from_c(tmp_path, header, "accelcal_B_7", np.zeros((1, 3)), right)


@needs_compiler
@pytest.mark.parametrize("serial", ["*/ int x; /*", "a\\", "??/", "line\nfeed", "", "// x"])
def test_no_serial_can_break_the_header(triad, tmp_path, serial):
    named = dataclasses.replace(triad, serial=serial, source=serial, output_unit=None)
    header = triad_header(triad_content(named), named)
    from_c(tmp_path, header, c_prefix(serial), np.zeros((1, 3)))


def test_the_content_is_plain_json_with_all_that_is_known(triad):
    content = triad_content(triad)
    json.dumps(content, allow_nan=False)
    told = {row["symbol"]: row for row in content["coefficients"]}
    assert list(told) == list(triad.parameters)
    assert told["S_zx"]["meaning"] == "sensitivity of channel z along axis x"
    assert told["b_y"]["unit"] == "output unit"
    assert told["b_y"]["standard_uncertainty"] == triad.parameters["b_y"].standard_uncertainty
    assert content["covariance"]["symbols"] == list(triad.covariance_names)
    assert content["covariance"]["matrix"] == triad.covariance.tolist()


@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
@pytest.mark.parametrize("name", ["triad.h", "triad.yaml", "triad.csv"])
def test_the_method_writes_what_the_command_writes(triad, tmp_path, name):
    document = tmp_path / "triad.json"
    triad.to_json(document)
    assert main(["export", str(document), "-o", str(tmp_path / name)]) == 0
    triad.export(tmp_path / f"m{name}")
    text = (tmp_path / name).read_text("utf-8")
    assert text == (tmp_path / f"m{name}").read_text("utf-8")
    if name.endswith("csv"):
        lines = [line for line in text.splitlines() if not line.startswith("#")]
        rows = {row["symbol"]: row for row in csv.DictReader(lines)}
        assert float(rows["S_xx"]["value"]) == triad.parameters["S_xx"].value


def test_the_command_warns_and_refuses_what_a_triad_has_not(tmp_path, capsys):
    found = accelcal.calibrate_triad(read_triad(EXAMPLE))
    found.to_json(tmp_path / "triad.json")
    out = ["-o", str(tmp_path / "x.yaml")]
    assert main(["export", str(tmp_path / "triad.json"), *out]) == 0
    assert "warning: the calibration knows one launch" in capsys.readouterr().err
    for option in (["--run", "1"], ["--mounting", "o+"]):
        assert main(["export", str(tmp_path / "triad.json"), *option, *out]) == 2
        err = capsys.readouterr().err
        assert err.startswith(f"error: {option[0]}")
        assert "is given for a triad; leave it out" in err
