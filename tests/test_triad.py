"""Triads: what attitudes known and unknown give back, how sure, and what real blocks show."""

import csv
import io
import json
import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from real_data import real_file

import accelcal
from accelcal.cli.main import main
from accelcal.io.triad import read_triad
from accelcal.results.triad import TriadCalibration
from accelcal.triad.record import TriadRecord, one_an_attitude, up_of_turn
from accelcal.triad.solution import Scatter

EXAMPLE = Path(__file__).parents[1] / "examples" / "triad.csv"
BIAS = np.array([0.02, -0.05, 0.1])
SCALE = np.array([1.3, 0.9, 1.1])
AXES = np.array([[1.0, 0.0, 0.0], [0.02, 1.0, 0.0], [-0.03, 0.014, 1.0]])
AXES /= np.linalg.norm(AXES, axis=1)[:, None]
LOWER = SCALE[:, None] * AXES
FULL = LOWER + 0.01 * np.array([[0.0, 1.0, -1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 0.0]])


def directions(rng, n):
    up = rng.normal(size=(n, 3))
    return up / np.linalg.norm(up, axis=1)[:, None]


def outputs(up, sensitivity, rng=None, noise=0.0):
    """Noise in g, alike in all channels over their scale factors."""
    clean = BIAS + up @ sensitivity.T
    if rng is None:
        return clean
    return clean + noise * np.linalg.norm(sensitivity, axis=1) * rng.normal(size=clean.shape)


def values(calibration):
    return {row["quantity"]: row["value"] for row in calibration.rows()}


def truth_of(sensitivity):
    lengths = np.linalg.norm(sensitivity, axis=1)
    rows = sensitivity / lengths[:, None]
    named = {f"b_{a}": BIAS[i] for i, a in enumerate("xyz")}
    named |= {
        f"S_{a}{b}": sensitivity[i, j] for i, a in enumerate("xyz") for j, b in enumerate("xyz")
    }
    named |= {f"K_{a}": lengths[i] for i, a in enumerate("xyz")}
    pairs = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
    return named | {f"angle_{p}": np.arcsin(rows[i] @ rows[j]) for p, (i, j) in pairs.items()}


def held(found, truth):
    """Which intervals hold the truth, of all that is uncertain."""
    rows = [row for row in found.rows() if row["quantity"] in truth and row["standard_uncertainty"]]
    return [abs(r["value"] - truth[r["quantity"]]) <= r["expanded_uncertainty"] for r in rows]


# -- exact outputs ---------------------------------------------------------------------------------


def test_known_attitudes_give_everything_back():
    up = directions(np.random.default_rng(1), 8)
    found = accelcal.calibrate_triad(outputs(up, FULL), up)
    np.testing.assert_allclose(found.bias, BIAS, atol=1e-13)
    np.testing.assert_allclose(found.sensitivity, FULL, atol=1e-13)
    np.testing.assert_allclose(found.accelerations(outputs(up, FULL)), up, atol=1e-12)


def test_length_alone_gives_all_but_the_rotation_back():
    up = directions(np.random.default_rng(2), 20)
    turned, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    found = accelcal.calibrate_triad(outputs(up, LOWER @ turned))
    np.testing.assert_allclose(found.bias, BIAS, atol=1e-9)
    np.testing.assert_allclose(found.sensitivity, LOWER, atol=1e-9)


def test_frames_agree_on_what_no_frame_changes():
    rng = np.random.default_rng(4)
    output = outputs(directions(rng, 30), FULL, rng, 1e-3)
    x, z = (values(accelcal.calibrate_triad(output, frame=frame)) for frame in "xz")
    for name in ("b_x", "b_y", "b_z", "K_x", "K_y", "K_z", "angle_xy", "angle_xz", "angle_yz"):
        assert x[name] == pytest.approx(z[name], rel=1e-6, abs=1e-9)
    assert x["S_xy"] == z["S_yx"] == 0.0


# -- uncertainty -----------------------------------------------------------------------------------


EQUAL, UNLIKE = (1.0, 1.0, 1.0), (1.0, 1.0, 10.0)


@pytest.mark.parametrize(
    ("n", "known", "noise", "channels"),
    [
        (14, False, 1e-3, EQUAL),
        (30, False, 1e-2, EQUAL),
        (14, False, 1e-4, UNLIKE),
        (30, False, 1e-4, UNLIKE),
        (12, True, 1e-3, EQUAL),
        (12, True, 1e-4, UNLIKE),
    ],
)
def test_intervals_hold_the_truth(n, known, noise, channels):
    """With a single variance those of the noisiest of unlike channels hold it in 81 to 90 %."""
    rng = np.random.default_rng(5)
    sensitivity = FULL if known else LOWER
    truth, inside = truth_of(sensitivity), []
    for _ in range(120):
        up = directions(rng, n)
        found = accelcal.calibrate_triad(
            outputs(up, sensitivity, rng, noise * np.array(channels)), up if known else None
        )
        inside.append(held(found, truth))
    assert 0.93 <= np.mean(inside) <= 0.99
    assert np.mean(inside, axis=0).min() > 0.88  # of 120: 95 % and 4 standard deviations less


def test_one_reading_in_a_direction_has_the_noise_of_the_others():
    """What it alone tells leaves no residual: the mean of the others stands for it."""
    up = np.vstack([up_of_turn("z", np.arange(0.0, 360.0, 45.0)), [0.0, 0.0, 1.0]])
    rng = np.random.default_rng(14)
    inside = []
    for _ in range(300):
        found = accelcal.calibrate_triad(outputs(up, FULL, rng, 1e-3), up).parameters["S_zz"]
        inside.append(abs(found.value - FULL[2, 2]) <= found.expanded_uncertainty)
    assert 0.91 <= np.mean(inside) <= 0.99


def scatter_of(rng, n, k):
    """Of a regression on a random design, with its annihilator M as a matrix."""
    design = rng.normal(size=(n, k))
    basis = np.linalg.svd(design, full_matrices=False)[0]
    shapes = np.vstack([np.ones(n), rng.random((3, n))])
    left = np.eye(n) - basis @ basis.T
    return Scatter(left @ rng.normal(size=n), np.linalg.pinv(design), basis, shapes), left


def test_degrees_of_freedom_are_those_of_the_quadratic_form():
    rng = np.random.default_rng(15)
    for n, k in ((10, 9), (14, 9), (30, 6)):
        scatter, left = scatter_of(rng, n, k)
        gradient = rng.normal(size=k)
        form = left @ np.diag((gradient @ scatter.reach) ** 2 / np.diag(left)) @ left
        expected = []
        for shape in scatter.shapes:
            spread = form @ np.diag(shape)
            expected.append(np.trace(spread) ** 2 / np.trace(spread @ spread))
        assert scatter.degrees(gradient) == pytest.approx(min(expected), rel=1e-6)


def test_variance_of_alike_errors_is_unbiased():
    rng = np.random.default_rng(16)
    scatter, left = scatter_of(rng, 14, 9)
    found = [
        scatter._replace(left=left @ rng.normal(size=14)).covariance().diagonal()
        for _ in range(4000)
    ]
    exact = np.diagonal(scatter.reach @ scatter.reach.T)
    np.testing.assert_allclose(np.mean(found, axis=0), exact, rtol=0.12)


def test_errors_of_attitudes_are_in_the_covariance():
    """An attitude that is off by an angle moves all channels; the residuals tell by how much."""
    rng = np.random.default_rng(6)
    truth, inside = truth_of(FULL), []
    for _ in range(200):
        up = directions(rng, 16)
        off = up + np.cross(rng.normal(scale=2e-3, size=up.shape), up)
        found = accelcal.calibrate_triad(outputs(off, FULL), up)
        inside.append(held(found, truth))
    assert 0.92 <= np.mean(inside) <= 0.975


def test_errors_of_a_head_on_two_shafts_are_in_the_covariance():
    """They act only across the axis that points up: m_yx had intervals that held 88 %."""
    rng = np.random.default_rng(17)
    angles, truth, inside = np.arange(0.0, 360.0, 45.0), truth_of(FULL), []
    names = tuple(f"{shaft} {angle}" for shaft in "zx" for angle in angles)
    up = np.concatenate([up_of_turn(shaft, angles) for shaft in "zx"])
    for _ in range(300):
        off = [up_of_turn(s, angles + rng.normal(scale=0.1, size=8)) for s in "zx"]
        output = outputs(np.concatenate(off), FULL)
        found = accelcal.calibrate_triad(TriadRecord(output, up, attitude=names))
        inside.append(held(found, {name: truth[name] for name in ("S_yx", "S_yz")}))
    assert np.mean(inside, axis=0).min() > 0.92


NEAR = np.diag(SCALE) + 0.005 * np.array([[0.0, 1.0, -1.0], [1.0, 0.0, 0.5], [-1.0, 0.5, 0.0]])
FACES = np.vstack([np.eye(3), -np.eye(3)])
QUARTERS = np.concatenate([up_of_turn(shaft, np.arange(0.0, 360.0, 90.0)) for shaft in "xyz"])
EIGHTHS = np.concatenate([up_of_turn(shaft, np.arange(0.0, 360.0, 45.0)) for shaft in "xyz"])


def turned(rng, up, shafts, size):
    """By a small angle about the shaft or, where there is none, about any axis."""
    turn = rng.normal(scale=size, size=up.shape)
    if shafts:
        turn = np.repeat(np.eye(3), len(up) // 3, axis=0) * turn[:, :1]
    angle = np.linalg.norm(turn, axis=1)[:, None]
    axis = turn / angle
    along = np.sum(axis * up, axis=1)[:, None] * axis
    return up * np.cos(angle) + np.cross(axis, up) * np.sin(angle) + along * (1.0 - np.cos(angle))


@pytest.mark.parametrize(
    ("up", "shafts", "visits", "size", "noise", "widest"),
    [
        (FACES, False, 6, 1e-4, 1e-5, 1.5),
        (FACES, False, 6, 1e-6, 1e-5, 1.4),
        (FACES, False, 4, 1e-3, 1e-5, 2.6),
        (FACES, False, 6, 3e-3, 1e-6, 2.6),
        (QUARTERS, True, 2, 1e-3, 1e-5, 1.9),
        (EIGHTHS, True, 2, 1e-4, 1e-5, 1.5),
    ],
)
def test_scale_factors_rest_on_faces_that_errors_of_attitudes_leave(
    up, shafts, visits, size, noise, widest
):
    """Residuals hold these errors: U of K of faces was 4 to 180 times too wide."""
    rng, found = np.random.default_rng(21), []
    truth, names = truth_of(NEAR), tuple(map(str, range(len(up)))) * visits
    for _ in range(150):
        output = outputs(np.tile(turned(rng, up, shafts, size), (visits, 1)), NEAR, rng, noise)
        record = TriadRecord(output, np.tile(up, (visits, 1)), attitude=names)
        calibration = accelcal.calibrate_triad(record)
        assert "again" not in gate(calibration, "attitudes").finding
        scale = calibration.scale_factors
        found.append([(q.value - truth[name], q.expanded_uncertainty) for name, q in scale.items()])
    off, wide = np.moveaxis(np.array(found), 2, 0)
    assert 0.92 <= np.mean(np.abs(off) <= wide) <= 0.995
    assert (wide.mean(axis=0) < widest * 1.96 * np.sqrt(np.mean(off**2, axis=0))).all()


def test_degrees_of_freedom_are_those_of_errors_that_a_channel_does_not_feel_everywhere():
    """With x up four times of nine, intervals of misalignments held 90 %."""
    up = np.vstack([FACES, FACES[:1], FACES[:2]])
    names, rng = tuple(map(str, range(len(up)))), np.random.default_rng(24)
    output = outputs(turned(rng, up, False, 1e-3), np.diag(SCALE), rng, 1e-5)
    found = accelcal.calibrate_triad(TriadRecord(output, up, attitude=names))
    design = np.column_stack([np.ones(len(up)), up])
    left = np.eye(len(up)) - design @ np.linalg.pinv(design)
    for name, axis in (("m_xy", 0), ("m_yx", 1), ("m_zx", 2)):
        errors = left @ np.diag(1.0 - up[:, axis] ** 2)
        expected = np.trace(errors) ** 2 / np.trace(errors @ errors)
        assert found.misalignments[name].dof == pytest.approx(expected, rel=0.01)


def test_what_one_visit_cannot_tell_is_not_promised():
    """Residuals of six faces may be noise of the channels or errors of the faces."""
    rng, visits = np.random.default_rng(22), []
    for rows in (1, 4):  # rows that follow each other are one visit
        output = outputs(np.repeat(turned(rng, FACES, False, 1e-3), rows, axis=0), FULL, rng, 1e-5)
        found = accelcal.calibrate_triad(output, np.repeat(FACES, rows, axis=0))
        visits.append(found.scale_factors["K_x"])
        assert "go through the attitudes again" in gate(found, "attitudes").finding
    assert all(q.dof == pytest.approx(2.0, rel=0.01) for q in visits)
    assert all(q.expanded_uncertainty > 1e-4 for q in visits)


@pytest.mark.parametrize("known", [True, False])
def test_residuals_are_told_in_g_whatever_the_unit_of_the_outputs(known):
    rng = np.random.default_rng(25)
    up = directions(rng, 30)
    output = outputs(up, FULL, rng, 1e-4)
    one, other = (accelcal.calibrate_triad(k * output, up if known else None) for k in (1.0, 1e3))
    assert other.residual_rms == pytest.approx(one.residual_rms, rel=1e-6)


def test_rounding_that_all_visits_share_counts():
    rng, up = np.random.default_rng(23), np.tile(FACES, (4, 1))
    output = outputs(up, FULL, rng, 1e-9).round(4)
    found = accelcal.calibrate_triad(output, up).parameters["S_xx"]
    assert found.standard_uncertainty >= 0.99 * 1e-4 / np.sqrt(24.0)


def test_rows_of_one_attitude_share_its_error():
    """The head sets an attitude once; the rows that are then read repeat its error."""
    rng = np.random.default_rng(12)
    truth, inside = truth_of(FULL), []
    for _ in range(200):
        up = directions(rng, 16)
        off = np.repeat(up + np.cross(rng.normal(scale=2e-3, size=up.shape), up), 4, axis=0)
        found = accelcal.calibrate_triad(outputs(off, FULL, rng, 2e-4), np.repeat(up, 4, axis=0))
        inside.append(held(found, truth))
    assert (found.attitudes, found.dof) == (16, 12)
    assert found.notes == ("64 rows of 16 attitudes: those of one attitude are averaged",)
    assert 0.92 <= np.mean(inside) <= 0.975


def test_the_serial_is_that_of_the_file_unless_another_is_given():
    text = "# serial: B7\nx,y,z\n1,0,0\n0,1,0\n0,0,1\n"
    records = (read_triad(io.StringIO(text), overrides=o) for o in ({}, {"serial": "C9"}))
    assert [record.serial for record in records] == ["B7", "C9"]


def test_one_direction_on_two_shafts_is_two_attitudes():
    angles = (0, 90, 180, 270, 360)
    rows = [f"{s},{a},{a * (s < 'y')},{a * (s == 'y')},{a % 11}" for s in "xyz" for a in angles]
    record = read_triad(io.StringIO("\n".join(["shaft,angle,x,y,z", *rows])))
    found = accelcal.calibrate_triad(record)
    assert (found.attitudes, found.dof) == (12, 8)
    assert accelcal.calibrate_triad(record.output, record.up).attitudes == 6


def seated(rng, shafts, step, size, visits=1):
    """A block that sits turned on each shaft, by a small angle about each axis."""
    angles = np.arange(0.0, 360.0, step)
    up = np.concatenate([up_of_turn(shaft, angles) for shaft in shafts])
    turn = np.repeat(rng.normal(scale=size, size=(len(shafts), 3)), angles.size, axis=0)
    felt = np.tile(up + np.cross(turn, up), (visits, 1))
    return TriadRecord(
        outputs(felt, NEAR, rng, 1e-5),
        np.tile(up, (visits, 1)),
        attitude=tuple(f"{s} {a:g}" for s in shafts for a in angles) * visits,
        shaft=tuple(s for s in shafts for _ in angles) * visits,
    )


@pytest.mark.parametrize(
    ("shafts", "step", "size", "visits", "widest"),
    [
        ("xyz", 45.0, 0.0, 1, 1.7),
        ("xyz", 45.0, 1e-5, 1, 1.4),
        ("xyz", 45.0, 1e-4, 2, 1.5),
        ("xyz", 90.0, 1e-4, 1, 1.5),
        ("zx", 45.0, 1e-4, 1, 2.2),
    ],
)
def test_misalignments_hold_where_the_block_sits_otherwise_on_each_shaft(
    shafts, step, size, visits, widest
):
    """All attitudes of a shaft share it: intervals held 46 % on three shafts, 9 % on two."""
    rng, found = np.random.default_rng(31), []
    lengths = np.linalg.norm(NEAR, axis=1)
    axes = NEAR / lengths[:, None]
    for _ in range(200):
        calibration = accelcal.calibrate_triad(seated(rng, shafts, step, size, visits))
        told = calibration.misalignments.items()
        off = [q.value - axes["xyz".index(name[2]), "xyz".index(name[3])] for name, q in told]
        found.append((off, [q.expanded_uncertainty for _, q in told]))
    off, wide = np.moveaxis(np.array(found), 1, 0)
    assert 0.93 <= np.mean(np.abs(off) <= wide) <= 0.995
    assert (wide.mean(axis=0) < widest * 1.96 * np.sqrt(np.mean(off**2, axis=0))).all()


def test_a_gate_tells_how_the_block_sits_on_its_shafts():
    rng = np.random.default_rng(32)
    alike, otherwise = (accelcal.calibrate_triad(seated(rng, "xyz", 45.0, x)) for x in (0.0, 3e-4))
    assert gate(alike, "clampings").verdict == "pass"
    told = gate(otherwise, "clampings")
    assert told.verdict == "warn"
    assert 0.15 < float(re.search(r"sits (\S+) mrad", told.finding)[1]) < 0.6
    assert otherwise.scale_factors["K_x"].standard_uncertainty < 1e-5  # a turn leaves it alone
    few = accelcal.calibrate_triad(seated(rng, "xyz", 180.0, 1e-4))
    assert gate(few, "clampings").verdict == "not assessed"
    one = seated(rng, "xyz", 45.0, 1e-4)
    for shaft in (("x",) * 24, tuple(map(str, range(24)))):  # one for all, and one for each
        record = TriadRecord(one.output, one.up, shaft=shaft)
        assert "clampings" not in [g.name for g in accelcal.calibrate_triad(record).gates]


def test_directions_without_shafts_are_told():
    """Nothing told that U leaves out how the block sits: 46 % of the intervals held."""
    given = seated(np.random.default_rng(33), "xyz", 45.0, 1e-4)
    for found in (
        accelcal.calibrate_triad(given.output, given.up),
        accelcal.calibrate_triad(TriadRecord(given.output, given.up)),
    ):
        told = gate(found, "clampings")
        assert told.verdict == "not assessed"
        assert told.finding.startswith("no shafts are named: U counts errors of single attitudes")
    free = accelcal.calibrate_triad(given.output)
    assert "clampings" not in [g.name for g in free.gates]


def test_names_of_clampings_beside_directions_are_read():
    """A column shaft without angle was set aside without a word."""
    rng = np.random.default_rng(34)
    given = seated(rng, "xyz", 45.0, 1e-4)
    names = {"x": "plate 1", "y": "plate 2", "z": "Plate 3"}
    rows = [
        ",".join([names[shaft], *map(repr, [*up.tolist(), *output.tolist()])])
        for shaft, up, output in zip(given.shaft, given.up, given.output, strict=True)
    ]
    text = "\n".join(["shaft,up_x,up_y,up_z,x,y,z", *rows])
    record = read_triad(io.StringIO(text))
    assert record.shaft == ("plate 1",) * 8 + ("plate 2",) * 8 + ("plate 3",) * 8
    found, named = accelcal.calibrate_triad(record), accelcal.calibrate_triad(given)
    assert gate(found, "clampings") == gate(named, "clampings")
    for name, quantity in named.misalignments.items():
        assert found.misalignments[name].expanded_uncertainty == pytest.approx(
            quantity.expanded_uncertainty, rel=1e-9
        )
    with pytest.raises(accelcal.TableError, match=":2: shaft 'n/a' names no shaft; name the shaft"):
        read_triad(io.StringIO(text.replace("plate 1", "n/a", 1)))
    assert read_triad(io.StringIO(re.sub("(?i)plate .", "", text))).shaft is None


def test_shafts_of_a_table_are_read_beside_directions_and_signs():
    record = read_triad(EXAMPLE)
    assert record.shaft == ("z",) * 8 + ("x",) * 8 + ("y",) * 8
    head = "shaft,angle,x,y,z,up_x,up_y,up_z\n"
    rows = [(" +X", 0, 0, 1, 0), ("-x", 0, 0, 1, 0), ("Z", 0, 1, 0, 0)]
    text = head + "".join(
        f"{s},{a},1,{i},3,{x},{y},{z}\n" for i, (s, a, x, y, z) in enumerate(rows)
    )
    record = read_triad(io.StringIO(text))
    assert record.shaft == ("x", "-x", "z")
    assert one_an_attitude(record) is record  # one direction on two clampings is two attitudes
    with pytest.raises(accelcal.InputError, match="1 shafts of 3 attitudes; give one for each"):
        TriadRecord(np.eye(3), shaft=("x",))


def test_noise_does_not_bias_the_fit_as_it_does_the_algebraic_one():
    """With 4 % of noise a quadric through the outputs is off by 0.5 %, the fit by a tenth of it."""
    rng = np.random.default_rng(7)
    fitted, algebraic = [], []
    for _ in range(80):
        output = outputs(directions(rng, 60), np.eye(3), rng, 0.04)
        fitted.append(accelcal.calibrate_triad(output).sensitivity.diagonal().mean())
        algebraic.append(np.mean(radii_of_quadric(output)))
    assert abs(np.mean(fitted) - 1.0) < 1e-3
    assert abs(np.mean(algebraic) - 1.0) > 3e-3


def radii_of_quadric(y):
    x, yy, z = y.T
    design = np.column_stack([x * x, yy * yy, z * z, x * yy, x * z, yy * z, x, yy, z])
    p = np.linalg.lstsq(design, np.ones(len(y)))[0]
    shape = np.array(
        [[p[0], p[3] / 2, p[4] / 2], [p[3] / 2, p[1], p[5] / 2], [p[4] / 2, p[5] / 2, p[2]]]
    )
    centre = -0.5 * np.linalg.solve(shape, p[6:])
    return np.sqrt((1.0 + centre @ shape @ centre) / np.linalg.eigvalsh(shape))


# -- gates and refusals ----------------------------------------------------------------------------


def gate(found, name):
    return next(g for g in found.gates if g.name == name)


def test_a_wrong_attitude_is_told():
    rng = np.random.default_rng(8)
    output = outputs(directions(rng, 30), LOWER, rng, 1e-4)
    assert gate(accelcal.calibrate_triad(output), "largest residual").verdict == "pass"
    output[11] *= 1.01
    found = gate(accelcal.calibrate_triad(output), "largest residual")
    assert found.verdict == "warn"
    assert found.finding.startswith("attitude 12 fits worst:")


def test_errors_of_the_head_alone_are_no_wrong_attitude():
    """Each moves the channels that its shaft and angle choose, and leaves the others alone."""
    rng = np.random.default_rng(13)
    angles = np.arange(0.0, 360.0, 45.0)
    names = tuple(f"{shaft} {angle}" for shaft in "xyz" for angle in angles)
    up = np.concatenate([up_of_turn(shaft, angles) for shaft in "xyz"])
    warned = 0
    for _ in range(200):
        off = [up_of_turn(s, angles + rng.normal(scale=0.01, size=8)) for s in "xyz"]
        output = outputs(np.concatenate(off), FULL, rng, 1e-5)
        found = accelcal.calibrate_triad(TriadRecord(output, up, attitude=names))
        warned += gate(found, "largest residual").verdict == "warn"
    assert warned <= 8  # of 200, at 1 %: the chance of more is 1e-4


@pytest.mark.parametrize(
    ("turned", "told"),
    [
        (np.diag([1.0, -1.0, 1.0]), "channel y answers along -y of the block;"),
        (np.eye(3)[[1, 0, 2]], "channel x answers along y of the block, channel y answers along x"),
    ],
)
def test_channels_turned_or_exchanged_are_told(turned, told):
    up = directions(np.random.default_rng(18), 12)
    found = gate(accelcal.calibrate_triad(outputs(up, turned @ FULL), up), "sensitive axes")
    assert found.verdict == "warn"
    assert found.finding.startswith(told)
    found = gate(accelcal.calibrate_triad(outputs(up, FULL), up), "sensitive axes")
    assert found.verdict == "pass"


@pytest.mark.parametrize("shafts", ["x y z", "-x z"])
def test_angles_counted_the_wrong_way_round_are_told(shafts):
    """The scale factors were 0, and what was wrong was said of the channels."""
    angles = np.arange(0.0, 360.0, 45.0)
    up, names = np.concatenate([up_of_turn(s, angles) for s in shafts.split()]), shafts.split()
    wrong = np.concatenate([up_of_turn(s, -angles) for s in names])
    output = outputs(up, FULL) + 1e-5 * np.random.default_rng(19).standard_normal((len(up), 3))

    def axes_of(known):
        record = TriadRecord(output, known, shaft=tuple(np.repeat(names, 8).tolist()))
        return gate(accelcal.calibrate_triad(record), "sensitive axes")

    assert axes_of(wrong).verdict == "warn"
    assert (
        "only if these are counted the other way round: change their sign" in axes_of(wrong).finding
    )
    assert axes_of(up).verdict == "pass"


@pytest.mark.parametrize(
    ("column", "told"), [(0, "outputs x and z tell one and the same axis"), (None, "output z is")]
)
@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_a_column_twice_or_constant_is_refused(column, told, unit):
    up = directions(np.random.default_rng(19), 12)
    output = unit * outputs(up, FULL)
    assert accelcal.calibrate_triad(output, up).scale_factors
    output[:, 2] = 0.3 if column is None else output[:, column]
    with pytest.raises(accelcal.InputError, match=told):
        accelcal.calibrate_triad(output, up)


def test_samples_that_nobody_averaged_fit_in_memory():
    rng = np.random.default_rng(20)
    up = directions(rng, 60_000)
    found = accelcal.calibrate_triad(outputs(up, FULL, rng, 1e-3), up)
    np.testing.assert_allclose(found.sensitivity, FULL, atol=1e-4)


def test_attitudes_of_one_half_are_spread_badly():
    rng = np.random.default_rng(9)
    up = directions(rng, 40)
    up = up[np.abs(up[:, 1]) < 0.3]
    found = accelcal.calibrate_triad(outputs(up, LOWER, rng, 1e-5))
    assert gate(found, "spread of attitudes").verdict == "warn"


def test_perpendicular_axes_show_no_misalignment():
    rng = np.random.default_rng(10)
    found = accelcal.calibrate_triad(outputs(directions(rng, 30), np.diag(SCALE), rng, 1e-3))
    assert "do not show" in gate(found, "misalignments").finding


def test_as_many_attitudes_as_parameters_leave_no_uncertainty():
    found = accelcal.calibrate_triad(outputs(directions(np.random.default_rng(11), 9), LOWER))
    assert found.parameters["b_x"].standard_uncertainty is None
    assert gate(found, "attitudes").verdict == "warn"
    assert "the noise is unknown" in str(found)


@pytest.mark.parametrize(("more", "verdict"), [(2, "warn"), (3, "pass")])
@pytest.mark.parametrize("known", [True, False])
def test_few_degrees_of_freedom_make_wide_intervals(known, more, verdict):
    rng = np.random.default_rng(11)
    up = directions(rng, (4 if known else 9) + more)
    found = accelcal.calibrate_triad(outputs(up, LOWER, rng, 1e-4), up if known else None)
    said = gate(found, "attitudes")
    assert said.verdict == verdict
    assert said.finding.startswith(f"{len(up)} attitudes leave {more} degrees of freedom")
    assert ("the intervals are wide" in said.finding) is (verdict == "warn")


@pytest.mark.parametrize(
    ("up", "known", "message"),
    [
        (np.eye(3)[[0, 1, 2, 0, 1, 2, 0, 1]], False, "8 attitudes; |a| = g tells 9 parameters"),
        (up_of_turn("z", np.arange(0, 360, 30)), False, "output z hardly changes"),
        (up_of_turn("z", np.arange(0, 360, 30)), True, "do not tell the sensitivity along z"),
        (np.eye(3), True, "3 attitudes; at least 4"),
        (
            np.vstack([np.eye(3), -np.eye(3), np.eye(3), -np.eye(3)]),
            False,
            "12 attitudes do not tell S_yx, .* apart; ",
        ),
    ],
)
def test_what_attitudes_leave_open_is_named(up, known, message):
    with pytest.raises(accelcal.DesignError, match=message.replace("|", r"\|")):
        accelcal.calibrate_triad(outputs(up, np.diag(SCALE)), up if known else None)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([1.0, 2.0],), "has shape"),
        (([[1.0, 2.0, np.nan]],), "not finite"),
        (([[1.0, 2.0, 3.0]], [[0.0, 0.0, 9.81]]), "has length 9.81"),
        (([[1.0, 2.0, 3.0]] * 2, [[0.0, 0.0, 1.0]]), "1 directions for 2 attitudes"),
    ],
)
def test_wrong_arrays_are_refused(arguments, message):
    with pytest.raises(accelcal.InputError, match=message):
        accelcal.calibrate_triad(*arguments)


def test_there_is_no_frame_y():
    with pytest.raises(accelcal.InputError, match="frame 'y'"):
        accelcal.calibrate_triad(np.eye(3), frame="y")


def test_a_frame_beside_known_attitudes_is_refused():
    up = np.vstack([np.eye(3), -np.eye(3)])
    assert accelcal.calibrate_triad(2.0 * up, up).frame == "block"
    with pytest.raises(accelcal.InputError, match="frame is 'x', but the attitudes are known"):
        accelcal.calibrate_triad(2.0 * up, up, frame="x")


# -- files and the command -------------------------------------------------------------------------


def run(capsys, *arguments):
    code = main([str(item) for item in arguments])
    out, err = capsys.readouterr()
    return code, out, err


def test_example_holds_what_it_was_made_of(capsys):
    code, out, _ = run(capsys, "triad", EXAMPLE, "--format", "json")
    found = json.loads(out)
    assert code == 0
    assert found["schema"] == "accelcal/triad/1"
    for name, truth in {"K_x": 1.3124, "K_y": 1.2987, "K_z": 1.3051}.items():
        quantity = found["scale_factors"][name]
        assert abs(quantity["value"] - truth) < 2.0 * quantity["expanded_uncertainty"]
        assert quantity["unit"] == "mA/g"
    assert found["misalignments"]["m_xz"]["value"] == pytest.approx(-3.4e-3, abs=2e-5)


def test_json_comes_back(tmp_path, capsys):
    path = tmp_path / "triad.json"
    assert run(capsys, "triad", EXAMPLE, "-o", path, "--g", "9.8106")[0] == 0
    found = TriadCalibration.from_json(path)
    assert found == TriadCalibration.from_json(found.to_json())
    assert found.g_local_m_s2 == 9.8106
    assert "per m/s^2" in str(found)


def test_the_frame_of_a_record_has_all_attitudes():
    record = read_triad(EXAMPLE)
    frame = record.to_frame()
    assert frame.columns.tolist() == ["x", "y", "z", "up_x", "up_y", "up_z", "attitude", "shaft"]
    assert frame[["up_x", "up_y", "up_z"]].to_numpy() == pytest.approx(record.up)
    assert frame.attrs["units"] == dict.fromkeys("xyz", "mA") | dict.fromkeys(
        frame.columns[3:6], "g"
    )
    assert f"{len(frame)} attitudes, known" in record._repr_html_()
    unknown = accelcal.TriadRecord(record.output, temperature=np.full(len(frame), 20.0))
    assert unknown.to_frame().columns.tolist() == ["x", "y", "z", "temperature"]


def test_csv_of_the_command(capsys):
    rows = list(csv.DictReader(io.StringIO(run(capsys, "triad", EXAMPLE, "--format", "csv")[1])))
    assert [row["quantity"] for row in rows][:4] == ["b_x", "b_y", "b_z", "S_xx"]
    assert len(accelcal.calibrate_triad(read_triad(EXAMPLE)).to_frame()) == len(rows)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("z,90,", "w,90,", ":6: shaft 'w'; write x, y or z"),
        ("z,0,", "z,zero,", "is not a number"),
        ("1.325600", "9999", ":4: x_mA '9999' looks like a marker of a missing reading"),
        ("x_mA", "x_V", "units 'V' and 'mA' in one table"),
        ("x_mA", "x [furlong]", "bad.csv:3: unit 'furlong' is no output unit"),
        ("x_mA", "first", "no column x among"),
        ("angle,", "azimuth,", "column shaft alone"),
        ("x_mA,y_mA", "x_mA,ax_mA", "'x_mA' and 'ax_mA' mean the same"),
        ("g: 9.8106", "g: 19.8", "found nowhere on Earth"),
        ("# g", "# g: 9.81\n# g", "local_gravity is '9.8106', but '9.81' in line 2"),
        ("g: 9.8106", "g: here", ":2: local_gravity is 'here'; give it as a number"),
        ("angle,", "angle [mrad],", "give it in deg"),
    ],
)
def test_bad_files_are_told_in_a_line(tmp_path, capsys, old, new, message):
    text = EXAMPLE.read_text("utf-8")
    path = tmp_path / "bad.csv"
    path.write_text(text.replace(old, new, 1), "utf-8")
    code, out, err = run(capsys, "triad", path)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_directions_beside_shaft_and_angle_have_to_agree():
    """Shaft and angle were set aside without a word."""
    text = io.StringIO(EXAMPLE.read_text("utf-8"))
    rows = [row.split(",") for row in text.read().splitlines() if row[0] in "xyz"]
    up = [up_of_turn(shaft, [float(angle)])[0] for shaft, angle, *_ in rows]
    heads = "shaft,angle,x [mA],y [mA],z [mA],up_x,up_y,up_z"
    both = [[*row, *map(str, direction)] for row, direction in zip(rows, up, strict=True)]
    whole = "\n".join([heads, *map(",".join, both)])
    np.testing.assert_array_equal(read_triad(io.StringIO(whole)).up, up)
    both[2][1] = str(float(both[2][1]) + 45.0)
    with pytest.raises(
        accelcal.TableError, match=r":4: angle '135.0' and shaft are not as up_x, up_y, up_z"
    ):
        read_triad(io.StringIO("\n".join([heads, *map(",".join, both)])))
    with pytest.raises(accelcal.TableError, match="column up_x and up_y alone"):
        read_triad(io.StringIO(whole.replace("up_z", "comment")))
    read_triad(io.StringIO(whole.replace("shaft", "comment")))  # an angle alone contradicts nothing


def test_units_in_the_cells_are_read():
    bare = "x [mA],y [mA],z [mA]\n0.1,0.2,1.0\n0.1,1.0,0.2\n"
    units = "x,y,z\n0.1 mA,0.2 mA,1.0 mA\n0.1 mA,1.0 mA,0.2 mA\n"
    assert read_triad(io.StringIO(units)) == read_triad(io.StringIO(bare))


def test_columns_of_units_and_serials_are_read():
    """They were set aside: outputs in two units, or of two blocks, counted as those of one."""
    text = "x,y,z,unit,serial\n0.1,0.2,1.0,mA,B1\n0.1,1.0,0.2,{},{}\n"
    found = read_triad(io.StringIO(text.format("mA", "B1")))
    assert (found.unit, found.serial) == ("mA", "B1")
    with pytest.raises(accelcal.TableError, match=":3: units 'mA' and 'uA' in one table"):
        read_triad(io.StringIO(text.format("uA", "B1")))
    with pytest.raises(accelcal.TableError, match="serials 'B1, B2' in one record; give a file"):
        read_triad(io.StringIO(text.format("mA", "B2")))
    given = read_triad(io.StringIO(text.format("mA", "B1")), overrides={"serial": "B3"})
    assert (given.serial, len(given.notes)) == ("B3", 1)


def test_angles_in_radians_are_refused_where_no_unit_says_so(tmp_path, capsys):
    head, *rows = [row for row in EXAMPLE.read_text("utf-8").splitlines() if row[0] != "#"]
    cells = [row.split(",") for row in rows]
    turned = [[shaft, f"{math.radians(float(angle)):.6f}", *out] for shaft, angle, *out in cells]
    path = tmp_path / "radians.csv"
    path.write_text("\n".join([head, *map(",".join, turned)]), "utf-8")
    code, out, err = run(capsys, "triad", path)
    assert (code, out) == (2, "")
    assert "look like radians; write their unit" in err
    told = "\n".join([head.replace("angle", "angle [rad]"), *map(",".join, turned)])
    in_degrees = "\n".join([head, *rows])
    found, expected = (read_triad(io.StringIO(text)) for text in (told, in_degrees))
    np.testing.assert_allclose(found.up, expected.up, atol=1e-6)


SCHEMAS = ["calibration", "triad"]


@pytest.mark.parametrize(
    "text", ["{}", "[]", *(f'{{"schema": "accelcal/{name}/1"}}' for name in SCHEMAS)]
)
def test_other_documents_are_refused(text):
    with pytest.raises(accelcal.DocumentError, match="accelcal triad"):
        TriadCalibration.from_json(text)


@pytest.mark.parametrize("damage", ["missing", "null"])
def test_parameters_without_a_value_are_refused(damage, tmp_path, capsys):
    """They ended in a traceback, or in accelerations that are no numbers."""
    up = directions(np.random.default_rng(1), 8)
    document = accelcal.calibrate_triad(outputs(up, FULL), up).to_document()
    if damage == "null":
        document["parameters"]["S_yy"] |= {"value": None}
    else:
        del document["parameters"]["S_yy"]
    (tmp_path / "triad.json").write_text(json.dumps(document), "utf-8")
    (tmp_path / "imu.csv").write_text("x,y,z\n1,0.1,0.1\n", "utf-8")
    code, out, err = run(capsys, "apply", tmp_path / "triad.json", tmp_path / "imu.csv")
    assert (code, out) == (2, "")
    assert "triad.json: key parameters.S_yy" in err


# -- real blocks -----------------------------------------------------------------------------------


OF_24 = [0, 2, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 29, 30, 32, 34, 36, 38, 40, 42, 44, 46, 48]


@pytest.mark.parametrize(
    ("rows", "rms"),
    [(range(49), 0.84e-3), (range(14, 45), 0.81e-3), (OF_24, 0.43e-3)],
    ids=["49", "31", "24"],
)
def test_innalabs_block_of_ctu_prague(rows, rms):
    """Innalabs AHRS M3, 49, 31 and 24 attitudes, |a| = 1 g.

    github.com/mahmood-ul-hasan/IMU-Accelerometer-Calibration (MIT), commit
    82ee66ff5dfa87559b5571b39a8fc77aea7e5029; likely of Rohac, Sipos, Simanek, "Calibration of the
    low-cost triaxial inertial sensors". Nine parameters leave 0.84, 0.81 and 0.43 mg rms, six
    leave 11 mg; the largest misalignment is 0.0523.
    """
    record = read_triad(real_file("ctu_ahrs_m3_positions", "positions49.csv"))
    found = accelcal.calibrate_triad(record.output[list(rows)])
    assert found.residual_rms == pytest.approx(rms, abs=5e-6)
    assert "11." in gate(found, "misalignments").finding
    assert "they show" in gate(found, "misalignments").finding
    assert abs(found.misalignments["m_zx"].value) == pytest.approx(0.0523, abs=2e-3)


def test_xsens_block_of_imu_tk():
    """Xsens MTi, 38 holds by hand, |a| = 9.81744 m/s^2, upper triangular.

    github.com/Kyle-ak/imu_tk (BSD-3), commit 7780270fb9a227c79323199303f23989e689a89d; Tedaldi,
    Pretto, Menegatti, ICRA 2014.
    """
    path = real_file("imu_tk_xsens", "static_means.csv")
    found = accelcal.calibrate_triad(read_triad(path), frame="z")
    np.testing.assert_allclose(found.bias, [33123.9, 33275.2, 32364.5], atol=0.05)
    diagonal = np.diagonal(found.sensitivity) / 9.81744
    np.testing.assert_allclose(diagonal, [414.42, 412.03, 414.62], atol=0.005)
    assert found.residual_rms == pytest.approx(0.10e-3, abs=0.005e-3)


def test_six_poses_of_imucal():
    """Ferraris' method uses differences of opposite poses, as least squares of six poses does.

    github.com/mad-lab-fau/imucal (MIT), commit 8716e4c50bbb7044918b747f38b26cb0a6420910,
    tests/snapshots/example_cal.json, at 9.81 m/s^2. Its bias is the mean of the two poses of the
    channel's own axis, that of least squares the mean of all six.
    """
    published = json.loads(real_file("imucal_ferraris", "example_cal.json").read_text("utf-8"))
    means = poses(real_file("imucal_ferraris", "annotated_session.csv"))
    up = np.vstack([np.eye(3), -np.eye(3)])
    found = accelcal.calibrate_triad(means, up)
    lengths = [found.scale_factors[f"K_{axis}"].value for axis in "xyz"]
    np.testing.assert_allclose(lengths, 9.81 * np.diagonal(published["K_a"]), rtol=1e-12)
    rows = found.sensitivity / np.array(lengths)[:, None]
    np.testing.assert_allclose(rows, published["R_a"], atol=1e-12)
    own = [(means[i, i] + means[i + 3, i]) / 2.0 for i in range(3)]
    np.testing.assert_allclose(own, published["b_a"], rtol=1e-12)
    bias = [found.parameters[f"b_{axis}"] for axis in "xyz"]
    for quantity, theirs in zip(bias, published["b_a"], strict=True):
        assert abs(quantity.value - theirs) < quantity.expanded_uncertainty


def poses(path):
    """Mean outputs of the six poses at rest: +x, +y, +z up, then down."""
    samples = {}
    with path.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            triple = [float(row[f"acc_{axis}"]) for axis in "xyz"]
            samples.setdefault(row["part"], []).append(triple)
    names = [f"{axis}_{way}" for way in "pa" for axis in "xyz"]
    return np.array([np.mean(samples[name], axis=0) for name in names])


# -- the header line g -----------------------------------------------------------------------------


TEXT = EXAMPLE.read_text("utf-8")


def test_gravity_with_a_decimal_comma():
    text = TEXT.replace(",", ";").replace(".", ",")
    assert "# g: 9,8106" in text
    record = read_triad(io.StringIO(text))
    assert record.local_gravity == 9.8106
    assert record.output.tolist() == accelcal.read_triad(io.StringIO(TEXT)).output.tolist()


def test_a_caller_declares_gravity_as_he_does_of_a_table():
    assert read_triad(EXAMPLE, overrides={"local_gravity": 9.81}).local_gravity == 9.81
    assert read_triad(EXAMPLE, overrides={"local_gravity": None}).local_gravity == 9.8106


@pytest.mark.parametrize(
    ("written", "told"),
    [
        ("32.2 ft/s^2", ":2: local_gravity is given in 'ft/s^2'; give it in m/s^2"),
        ("much", ":2: local_gravity is 'much'; give it as a number"),
        ("981", ":2: local gravity 981.0 m/s^2 is found nowhere on Earth; it lies between"),
    ],
)
def test_gravity_of_another_unit_is_refused_with_its_line(written, told):
    text = TEXT.replace("# g: 9.8106", f"# g: {written}")
    with pytest.raises(accelcal.TableError) as caught:
        read_triad(io.StringIO(text))
    assert told in str(caught.value)


@pytest.mark.parametrize("known", [True, False])
def test_the_picture_has_each_residual(known):
    pytest.importorskip("matplotlib")
    record = read_triad(EXAMPLE)
    record = record if known else TriadRecord(record.output)
    found = accelcal.calibrate_triad(record)
    ax = found.plot.residuals(record)
    shown = [line.get_ydata() for line in ax.lines[1:]]
    assert [len(own) for own in shown] == [24] * (3 if known else 1)
    assert "g]" in ax.get_ylabel()
    factor = 1e6
    if known:
        assert len(ax.get_legend().get_texts()) == 3
        assert ax.get_title(loc="left") + ax.get_title() == "Residuals of the channels"
        model = found.bias + record.up @ found.sensitivity.T
        left = (record.output - model) / np.linalg.norm(found.sensitivity, axis=1)
        assert np.allclose(shown, factor * left.T)
    else:
        assert ax.get_legend() is None
        title = ax.get_title(loc="left") + ax.get_title()
        assert title == "Length of the acceleration less 1 g"
        length = np.linalg.norm(found.accelerations(record.output), axis=1)
        assert np.allclose(shown[0], factor * (length - 1.0))


def test_the_command_draws_the_residuals(tmp_path):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "residuals.png"
    assert main(["triad", str(EXAMPLE), "--plot", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_another_record_is_not_drawn():
    pytest.importorskip("matplotlib")
    record = read_triad(EXAMPLE)
    found = accelcal.calibrate_triad(record)
    for other in (TriadRecord(record.output), TriadRecord(record.output[:9], record.up[:9])):
        with pytest.raises(accelcal.InputError, match="give the record that was calibrated"):
            found.plot.residuals(other)


# -- temperatures ----------------------------------------------------------------------------------

UPS = [*np.eye(3).tolist(), *(-np.eye(3)).tolist()]
SIX = "T,up_x,up_y,up_z,x,y,z\n" + "".join(
    "{}," + ",".join(f"{cell:.4f}" for cell in [*up, *(1.3 * np.add(up, 0.01))]) + "\n"
    for up in UPS
)


def of_temperatures(*temperatures, above=""):
    return read_triad(io.StringIO(above + SIX.format(*temperatures)))


def test_a_triad_knows_its_temperature():
    record = of_temperatures(20, 20.1, 20.2, 20.1, 20.2, 20)
    found = accelcal.calibrate_triad(record)
    assert found.temperature_degC == pytest.approx(20.1)
    assert "mg rms; 20.10 degC\n" in str(found)
    assert found.gates[-1].verdict == "pass"
    assert accelcal.TriadCalibration.from_json(found.to_json()) == found
    document = json.loads(found.to_json())
    assert document.pop("temperature_degC") == found.temperature_degC
    assert accelcal.TriadCalibration.from_document(document).temperature_degC is None
    drifting = accelcal.calibrate_triad(of_temperatures(20, 20.5, 21, 21.5, 22, 22.5))
    (gate,) = (gate for gate in drifting.gates if gate.name == "temperature")
    assert (gate.verdict, gate.finding[:15]) == ("warn", "20 to 22.5 degC")
    assert accelcal.calibrate_triad(of_temperatures(*[20] * 5, 25)).temperature_degC is not None
    twice = np.vstack([record.output, record.output]), np.vstack([record.up, record.up])
    both = accelcal.TriadRecord(*twice, temperature=[20.0] * 6 + [22.0] * 5 + [np.nan])
    assert accelcal.calibrate_triad(both).temperature_degC == pytest.approx((5 * 21.0 + 20.0) / 6)


def test_a_temperature_may_stand_above_the_table_or_be_unknown():
    rows = SIX.replace("T,", "").replace("{},", "")
    found = [
        accelcal.calibrate_triad(read_triad(io.StringIO(above + rows))).temperature_degC
        for above in ("# temperature: 21.5 degC\n", "", "# temperature: unknown\n")
    ]
    assert found == [21.5, None, None]
    assert accelcal.calibrate_triad(of_temperatures(*["unknown"] * 6)).temperature_degC is None
    unit_in_key = "# temperature [degC]: unknown\n" + rows
    assert read_triad(io.StringIO(unit_in_key)).temperature is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SIX.format(20, 20, 20, 60, 60, 60), "temperatures from 20 to 60 degC in one calibration"),
        (SIX.format(20, 20, 20, "", 20, 20), ":5: T is empty; write it in every row, 'unknown'"),
        (SIX.format(*[293] * 6), ":2: T '293' is no temperature of a test"),
        (
            SIX.format(*[293] * 6).replace("T,", "T [mK],"),
            ":1: column 'T [mK]' is in mK; give it in degC",
        ),
        ("# temperature: 300 rad\n" + SIX.replace("T,", "").replace("{},", ""), ":1: "),
    ],
)
def test_temperatures_that_cannot_be_used(text, message):
    with pytest.raises(accelcal.InputError, match=re.escape(message)):
        read_triad(io.StringIO(text))
    with pytest.raises(accelcal.InputError, match="temperature has shape"):
        accelcal.TriadRecord(np.eye(3), temperature=[20.0])


@pytest.mark.parametrize("form", ["{}_mA", "{} [mA]", "{}, mA", "{} / mA", "{} in mA"])
def test_units_behind_the_channels(form):
    heads = ";".join(form.format(axis) for axis in "xyz")
    rows = "0,1;0,0;1,0\n0,1;1,0;0,0\n"
    record = read_triad(io.StringIO(f"{heads}\n{rows}"))
    assert (record.unit, record.output[0].tolist()) == ("mA", [0.1, 0.0, 1.0])


def test_frames_of_different_indices_are_refused():
    """Their rows were matched by their places, where groupby had sorted one of them."""
    up = pd.DataFrame(np.vstack([np.eye(3), -np.eye(3)]), columns=list("xyz"), index=list("fbadce"))
    output = 0.01 + 2.0 * up
    assert accelcal.TriadRecord(output, up) == accelcal.TriadRecord(
        output.to_numpy(), up.to_numpy()
    )
    for make in (accelcal.TriadRecord, accelcal.calibrate_triad):
        with pytest.raises(
            accelcal.InputError, match="output and up are Series of different indices"
        ):
            make(output.sort_index(), up)


@pytest.mark.parametrize("names", [["Y_1", "Y_2", "Y_3"], ["y", "p", "r"], [1, 2, 3]])
def test_columns_that_name_no_two_axes_count_by_their_order(names):
    """Three channels Y_1, Y_2, Y_3 were taken for three of the axis y, and refused."""
    up = np.vstack([np.eye(3), -np.eye(3)])
    found = accelcal.calibrate_triad(pd.DataFrame(1.3 * up + 0.01, columns=names), up)
    assert found.bias == pytest.approx(accelcal.calibrate_triad(1.3 * up + 0.01, up).bias)


def test_columns_of_two_axes_of_three_are_refused_by_their_names():
    """It was told that a DataFrame is no record of a triad."""
    frame = pd.DataFrame(np.vstack([np.eye(3), -np.eye(3)]), columns=["x", "y", "y"])
    told = "columns 'x, y, y'; give one for each of x, y and z"
    with pytest.raises(accelcal.InputError, match=told):
        accelcal.calibrate_triad(frame)


@pytest.mark.parametrize("heading", ["x deg", "y_deg", "z in rad", "up x deg"])
def test_an_angle_about_an_axis_is_no_output(heading):
    """It was a second column of the axis, and the table was refused."""
    lines = EXAMPLE.read_text("utf-8").splitlines()
    start = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    rows = [f"{line},{0 if i else heading}" for i, line in enumerate(lines[start:])]
    beside = read_triad(io.StringIO("\n".join([*lines[:start], *rows])))
    np.testing.assert_array_equal(beside.output, read_triad(EXAMPLE).output)
    assert f"columns not used: '{heading}'" in beside.notes


def test_excel_may_tell_the_separator():
    """Its line was taken for the headings, of a triad and of a head."""
    text = EXAMPLE.read_text("utf-8")
    assert (
        read_triad(io.StringIO(f"sep=,\n{text}")).output.tolist()
        == read_triad(EXAMPLE).output.tolist()
    )
    head = "angle,error [arcsec],uncertainty [arcsec]\n0,1,1\n90,-1,1\n"
    assert accelcal.read_head(io.StringIO(f"sep=,\n{head}")).angles_deg == (0.0, 90.0)


def test_columns_that_are_not_known_are_told_in_a_line():
    """Each had a line of its own: six of an exported table of means."""
    found = read_triad(io.StringIO("x,y,z,n,sd_x\n1,0,0,9,0.1\n"))
    assert found.notes == ("columns not used: 'n, sd_x'",)


def test_shafts_and_attitudes_are_taken_from_a_column_of_a_frame():
    frame = pd.DataFrame({"shaft": ["x"] * 4 + ["z"] * 4, "row": range(8)})
    up = np.concatenate([up_of_turn(shaft, np.arange(0.0, 360.0, 90.0)) for shaft in "xz"])
    for names in (frame["shaft"], frame["shaft"].to_numpy(), frame["shaft"].tolist()):
        assert TriadRecord(up, up, shaft=names).shaft == tuple("xxxxzzzz")
    with pytest.raises(accelcal.InputError, match="shaft has 0; it is a tuple of texts"):
        TriadRecord(up, up, shaft=frame["row"])
