"""The best angles: against all choices of small cases, against equal spacing, and as a sheet."""

import csv
import io
import re
from dataclasses import replace
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np
import pytest

import accelcal
from accelcal.errors import InputError
from accelcal.model import COEFFICIENTS
from accelcal.planning.compare import design_of
from accelcal.planning.exchange import (
    Budget,
    covariances,
    criterion_of,
    exchange,
    losses,
    polish,
    seen_from,
)
from accelcal.planning.pace import Pace
from accelcal.planning.prediction import forecasts
from accelcal.planning.sheet import COLUMNS, sheet
from accelcal.simulation import AL15, NoiseComponents, TumblePlan, simulate

STAND = NoiseComponents()
SHIFTS = np.array([STAND.launch**2, STAND.launch_sf**2, 0.0, 0.0, 0.0, 0.0])
SCALES = {"K0": 7e-6, "K1": 9e-6, "K2": 4e-6, "K3": 8e-6, "M": 3e-6, "M_ip": 5e-6}


def angles_of(degrees, noise=STAND, strokes=2, tables=1):
    return seen_from(
        np.asarray(degrees, dtype=float), noise, AL15, strokes=strokes, tables=tables, shifts=SHIFTS
    )


# -- one covariance --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "plan",
    [
        TumblePlan(),
        TumblePlan(positions=12, strokes=2, temperatures=(20.0,)),
        TumblePlan(angles=(0, 0, 0, 50, 90, 100, 100, 180, 200, 270, 300), temperatures=(20.0,)),
        TumblePlan(positions=16, strokes=2, mountings=("o+", "p+", "o-")),
    ],
)
def test_the_criterion_is_the_covariance_of_the_fit(plan):
    stops = np.array(plan.angles or np.arange(plan.positions + 1) * 360.0 / plan.positions)
    degrees, counts = np.unique(stops % 360.0, return_counts=True)
    tables = len(plan.temperatures) * len(plan.mountings)
    found = covariances(
        angles_of(degrees, strokes=plan.strokes, tables=tables), counts.astype(float)
    )
    foreseen = {f.name: f.standard_uncertainty for f in reversed(forecasts(plan, STAND, AL15))}
    mine = dict(zip(COEFFICIENTS, np.sqrt(np.diagonal(found)), strict=True))
    assert mine == pytest.approx({k: foreseen[k] for k in COEFFICIENTS}, rel=1e-3)


def test_a_second_reading_at_an_angle_is_worth_less_than_another_angle():
    head = NoiseComponents(1e-6, 2e-5, 0.0, 0.0, 0.0)
    eight = np.arange(8) * 45.0
    twice = covariances(angles_of(eight, head), np.full(8, 2.0))
    sixteen = covariances(angles_of(np.arange(16) * 22.5, head), np.ones(16))
    assert sixteen[2, 2] < 0.6 * twice[2, 2]


def test_the_step_of_the_readings_counts_as_noise():
    """Errors that are even between -1/2 and 1/2 of a step have the variance step^2 / 12."""
    degrees, counts, step = np.arange(8) * 45.0, np.ones(8), 2e-4
    exact = NoiseComponents(0.0, 0.0, 0.0, 0.0, 0.0)
    noisy = replace(exact, reading=step / np.sqrt(12.0))
    stepped = seen_from(degrees, exact, AL15, strokes=2, tables=1, shifts=SHIFTS, resolution=step)
    found = covariances(stepped, counts)
    assert found == pytest.approx(covariances(angles_of(degrees, noisy), counts), rel=1e-6)


# -- against brute force ---------------------------------------------------------------------------


def best_of_all(angles, criterion, readings):
    """Smallest loss of all ways to deal readings out to the angles."""
    places = np.array(list(combinations_with_replacement(range(angles.degrees.size), readings)))
    counts = np.zeros((len(places), angles.degrees.size))
    np.add.at(counts, (np.arange(len(places))[:, None], places), 1.0)
    return float(losses(criterion, covariances(angles, counts)).min())


@pytest.mark.parametrize("name", ["D", "A", "K1", "M_ip"])
@pytest.mark.parametrize(
    ("noise", "readings"), [(STAND, 8), (NoiseComponents(5e-5, 1e-6, 1e-6, 1e-6), 9)]
)
def test_exchanges_find_the_best_of_all_choices(name, noise, readings):
    angles = angles_of(np.arange(9) * 40.0, noise)
    criterion = criterion_of(name, SCALES)
    budget = Budget(reading=60.0, turn=0.0, stroke=60.0 * readings, spacing=10.0)
    found = []
    for seed in range(4):
        start = np.zeros(9, dtype=np.int64)
        start[np.random.default_rng(seed).permutation(9)[:6]] = 1
        counts, loss = exchange(angles, criterion, budget, start)
        assert counts.sum() == readings
        found.append(loss)
    assert min(found) == pytest.approx(best_of_all(angles, criterion, readings), rel=1e-9)


def test_turns_make_repetitions_worth_while():
    angles = angles_of(np.arange(24) * 15.0, NoiseComponents(5e-5, 1e-6, 0.0, 0.0))
    start = np.zeros(24, dtype=np.int64)
    start[[0, 3, 6, 9, 12, 15, 18]] = 1
    positions = {}
    for turn in (0.0, 600.0):
        budget = Budget(60.0, turn, 60.0 * 24 + turn * 8, 15.0)
        counts, _ = exchange(angles, criterion_of("D", SCALES), budget, start)
        assert budget.left(counts) >= 0.0
        positions[turn] = np.count_nonzero(counts), counts.sum()
    assert positions[600.0][0] <= positions[0.0][0]
    assert positions[600.0][1] > positions[600.0][0]


def test_polish_keeps_the_distance_and_does_not_lose():
    degrees = np.arange(8) * 45.0 + 3.0
    criterion = criterion_of("K3", SCALES)
    counts = np.ones(8, dtype=np.int64)
    before = float(losses(criterion, covariances(angles_of(degrees), counts.astype(float))))
    budget = Budget(60.0, 30.0, 1e4, 20.0)
    moved, loss = polish(degrees, counts, criterion, budget, angles_of)
    assert loss < before
    assert np.diff(np.sort(moved)).min() >= 20.0 - 1e-6


# -- the whole -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def for_k2():
    return accelcal.optimal_design("K2", hours=8.2)


def test_the_best_angles_are_never_worse_than_equal_ones_repeated(for_k2):
    assert for_k2.gain("equally spaced, repeated at its stops") >= 1.0 - 1e-9
    assert for_k2.gain("equally spaced") > 1.1
    with pytest.raises(InputError, match="rival 'equal' is unknown; choose from optimal, "):
        for_k2.gain("equal")


def test_they_keep_hours_and_distance(for_k2):
    assert for_k2.best.hours <= 8.2
    stops = np.array([angle for angle, _ in for_k2.stops()])
    gaps = np.diff(np.append(np.sort(stops), stops.min() + 360.0))
    assert gaps.min() >= for_k2.spacing_deg - 1e-6


def test_the_gain_is_that_of_the_predictions(for_k2):
    best, rival = (d.forecast("K2").standard_uncertainty for d in for_k2.designs[:2])
    assert rival / best == pytest.approx(for_k2.gain(list(for_k2.losses)[1]), rel=1e-3)


def test_the_same_seed_gives_the_same_angles(for_k2):
    assert accelcal.optimal_design("K2", hours=8.2).stops() == for_k2.stops()


def test_head_limited_hours_gain_little_by_angles():
    head = NoiseComponents(1e-6, 2e-5, 1e-6, 1e-6)
    found = accelcal.optimal_design("D", hours=8.3, noise=head)
    assert 1.0 <= found.gain("equally spaced, repeated at its stops") < 1.05


def test_text_tells_the_gain_and_how_to_simulate(for_k2):
    text = str(for_k2)
    assert re.search(r"^equally spaced: [0-9.]+ % less certain in K2$", text, re.MULTILINE)
    assert "accelcal simulate --angles" in text
    assert for_k2.to_document()["gains"]["equally spaced"] == for_k2.gain("equally spaced")
    assert {row["test"] for row in for_k2.rows()} == set(for_k2.losses)
    assert len(for_k2.to_frame()) == len(for_k2.rows())


@pytest.mark.parametrize(
    ("criterion", "options", "told"),
    [
        ("E", {"hours": 12.0}, "criterion 'E' is unknown; choose from D, A, K0"),
        ("D", {"hours": 7.0}, "soaks and mountings alone take 7 h"),
        ("D", {"hours": 7.3}, "positions that six coefficients need"),
        ("D", {"hours": 1e6}, "give fewer hours or more strokes"),
        ("D", {"hours": 12.0, "spacing": 90.0}, "spacing is 90; it is from 1 to 60 deg"),
        ("A", {"hours": 9.0, "targets": {"lam1": 1e-7}}, "A needs a target for one or more of K0"),
        ("A", {"hours": 8.0, "targets": {"K1": 1e-6}}, "cannot be reached with this stand"),
    ],
)
def test_bad_questions_have_one_clear_line(criterion, options, told):
    with pytest.raises(InputError) as error:
        accelcal.optimal_design(criterion, **options)
    assert told in str(error.value)
    assert "\n" not in str(error.value)


# -- the sheet -------------------------------------------------------------------------------------


def filled(text, record):
    """The sheet with the outputs of a record in its last column."""
    comments = [line for line in text.splitlines() if line.startswith("#")]
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
    assert len(rows) == len(record) + 1
    for row, y in zip(rows[1:], record.output, strict=True):
        row[-1] = repr(float(y))
    return "\n".join([*comments, *(",".join(row) for row in rows)]) + "\n"


def test_a_sheet_filled_in_is_a_table(for_k2):
    best = for_k2.best
    plan = TumblePlan(angles=best.angles, strokes=best.strokes, temperatures=best.temperatures)
    record = simulate(plan=plan, seed=1)
    read = accelcal.read_table(io.StringIO(filled(sheet(best, STAND), record)))
    assert read.notes == ()
    for name in ("output", "angle", "temperature", "stroke", "run", "mounting"):
        np.testing.assert_array_equal(getattr(read, name), getattr(record, name))
    assert read.apparatus.head_uncertainty == STAND.head
    assert set(for_k2.best.angles) == set(read.angle.tolist())
    own = accelcal.fit(read).tables[1].coefficients["K2"]
    foreseen = best.forecast("K2").standard_uncertainty * 1.35
    assert own.standard_uncertainty == pytest.approx(foreseen, rel=0.2)


def test_a_sheet_sorted_otherwise_tells_that_its_order_is_not_used(for_k2):
    """It was passed over by its heading alone, whatever its cells."""
    best = for_k2.best
    plan = TumblePlan(angles=best.angles, strokes=best.strokes, temperatures=best.temperatures)
    lines = filled(sheet(best, STAND), simulate(plan=plan, seed=1)).splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("order"))
    some = [*lines[: start + 3], *lines[start + 4 :]]
    assert accelcal.read_table(io.StringIO("\n".join(some))).notes == ()
    lines[start + 1 : start + 3] = reversed(lines[start + 1 : start + 3])
    (note,) = accelcal.read_table(io.StringIO("\n".join(lines))).notes
    assert note == "column 'order' is not known and was set aside"


def test_a_sheet_declares_what_the_forecast_assumed():
    """T0 = 20 between the levels, and errors that are known to be none."""
    plan = TumblePlan(positions=8, strokes=10, temperatures=(-40.0, 0.0, 40.0, 80.0))
    quiet = accelcal.NoiseComponents(head=0.0, launch=0.0, launch_sf=0.0)
    found = design_of(plan, quiet, Pace())
    read = accelcal.read_table(
        io.StringIO(filled(sheet(found, quiet), simulate(plan=plan, noise=quiet, seed=1)))
    )
    assert read.reference_temperature == 20.0
    calibration = accelcal.fit(read)
    assert calibration.T0_degC == 20.0
    bias = calibration.temperature_model.k0
    for name, slope in (("lam1", bias.above), ("lam2", bias.below)):
        foreseen = found.forecast(name).standard_uncertainty
        assert slope.standard_uncertainty == pytest.approx(foreseen, rel=0.25)
    for name in ("K0", "K1", "M"):
        own = calibration.tables[0].coefficients[name].standard_uncertainty
        foreseen = found.forecast(name).standard_uncertainty * 1.35
        assert own == pytest.approx(foreseen, rel=0.25)


def test_a_sheet_asks_for_the_step_of_the_readings():
    found = design_of(TumblePlan(positions=6, strokes=2, temperatures=(20.0,)), STAND, Pace())
    (told,) = (line for line in sheet(found, resolution=2e-4).splitlines() if "step" in line)
    assert "declare the step of the readings, 0.0002 g in the unit of the output" in told
    assert "step" not in sheet(found)


def test_a_sheet_tells_the_order_and_the_way():
    found = design_of(TumblePlan(positions=6, strokes=2, temperatures=(20.0,)), STAND, Pace())
    rows = list(csv.reader(sheet(found).splitlines()[2:]))
    assert tuple(rows[0]) == COLUMNS
    assert [row[0] for row in rows[1:]] == [str(n) for n in range(1, 15)]
    assert [row[5] for row in rows[1:]] == ["forward"] * 7 + ["back"] * 7
    assert [float(row[6]) for row in rows[1:8]] == [0.0, 60.0, 120.0, 180.0, 240.0, 300.0, 360.0]
    assert [float(row[6]) for row in rows[8:]] == [360.0, 300.0, 240.0, 180.0, 120.0, 60.0, 0.0]


def test_the_example_plan_is_a_sheet_to_be_filled_in():
    example = Path(__file__).parents[1] / "examples" / "design_plan.csv"
    told, *_ = lines = example.read_text("utf-8").splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert told.startswith(f"# plan: {len(rows)} readings")
    assert tuple(rows[0]) == COLUMNS
    assert {row["output"] for row in rows} == {""}
    plan = TumblePlan(
        angles=tuple(float(row["angle"]) for row in rows[: len(rows) // 6]),
        strokes=2,
        temperatures=(-40.0, 20.0, 80.0),
    )
    form = simulate(plan=plan, seed=0)
    assert [int(row["stroke"]) for row in rows] == form.stroke.tolist()
    assert [float(row["angle"]) for row in rows] == form.angle.tolist()


def test_simulated_repetitions_can_be_read(tmp_path):
    plan = TumblePlan(angles=(0.0, 0.0, 0.0, 90.0, 180.0, 270.0, 270.0), strokes=2)
    record = simulate(plan=plan, seed=1)
    assert record.stroke[:14].tolist() == [1, 3, 5, 1, 1, 1, 3, 2, 4, 2, 2, 2, 4, 6]
    accelcal.write_table(record, tmp_path / "t.csv")
    assert accelcal.read_table(tmp_path / "t.csv") == record
