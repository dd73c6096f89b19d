"""Records of thousands of positions or strokes: no more memory than in proportion to them."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

import accelcal
from accelcal.calibrate.fit import calibrate_many
from accelcal.calibrate.options import Options
from accelcal.discovery.noise import of_readings
from accelcal.discovery.noise.of_readings import refuse_too_many
from accelcal.errors import InputError


def simulated(
    positions=8, strokes=1, temperatures=(20.0,), mountings=("o+",), declare=True, seed=1
):
    plan = accelcal.TumblePlan(positions, None, strokes, temperatures, mountings)
    return accelcal.simulate(plan=plan, seed=seed, declare=declare)


def peak_of(record, **options):
    """Calibration, and the largest memory that it took [bytes]."""
    accelcal.fit(simulated())  # what is loaded and kept at the first fit is not counted
    tracemalloc.start()
    try:
        found = accelcal.fit(record, **options)
        return found, tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("record", "largest"),
    [
        (simulated(2500), 40e6),
        (simulated(2500, declare=False), 40e6),
        (simulated(1500, 1, (20.0, 80.0, -40.0)), 60e6),
        (simulated(1500, 1, mountings=("o+", "o-", "p+")), 60e6),
        (simulated(1500, 3), 60e6),
    ],
    ids=["one stroke", "nothing declared", "temperatures", "mountings", "strokes"],
)
def test_many_positions_take_little_memory(record, largest):
    """A matrix of all positions by all would take 50 MB, and there were a dozen."""
    found, peak = peak_of(record)
    assert peak < largest
    assert found.tables[0].coefficients["K1"].value == pytest.approx(1.35, rel=1e-3)


def test_many_strokes_take_little_memory():
    """A matrix of all strokes by all would take 72 MB."""
    record = simulated(strokes=3000)
    found, peak = peak_of(record)
    assert peak < 60e6
    assert found.tables[0].gates


def test_many_runs_take_no_more_than_the_errors_that_they_share():
    """Covariances of 300 runs are 26 MB a source, of which the laws turned all at a time."""
    _, peak = peak_of(simulated(strokes=1, temperatures=(20.0, 80.0, -40.0) * 100))
    assert peak < 145e6


def test_a_robust_fit_takes_little_memory():
    """All pairs of 3000 strokes would take 600 MB, and a matrix of readings by positions 50 MB."""
    for record in (simulated(strokes=3000), simulated(1500, 3)):
        _, peak = peak_of(record, robust=True)
        assert peak < 60e6


@pytest.mark.parametrize("fault", ["swapped", "sign"])
def test_faults_among_many_strokes_take_little_memory(fault):
    """The faults are found, and the search for them keeps no more."""
    record = simulated(strokes=1000)
    own = np.flatnonzero(record.stroke == 17)
    output = record.output.copy()
    if fault == "swapped":
        output[own[[2, 4]]] = output[own[[4, 2]]]
    else:
        output[own] *= -1.0
    found, peak = peak_of(replace(record, output=output))
    said = {gate.name: gate.finding for gate in found.tables[0].gates}["order of positions"]
    assert ("swapped" if fault == "swapped" else "stroke 17 of the other sign") in said
    assert peak < 60e6


def test_long_records_are_fitted_together_as_each_by_itself():
    records = [simulated(strokes=120, seed=seed) for seed in range(3)]
    ((rows, stack),) = calibrate_many(records, Options()).stacks
    for place in rows.tolist():
        one, alone = stack.one(place).tables[0], accelcal.fit(records[place]).tables[0]
        for name, value in alone.coefficients.items():
            found = one.coefficients[name]
            assert found.value == pytest.approx(value.value, rel=1e-9)
            assert found.standard_uncertainty == pytest.approx(value.standard_uncertainty, rel=1e-6)
        assert one.gates == alone.gates


def test_intervals_of_many_positions_hold_the_truth():
    """With the head error declared, and with it estimated."""
    plan = accelcal.TumblePlan(160, None, 2, (20.0,))
    for declare in (True, False):
        away = []
        for seed in range(30):
            record = accelcal.simulate(plan=plan, seed=seed, declare=declare)
            table = accelcal.fit(record).tables[0]
            k2 = table.error_model["k2"]
            away.append((k2.value - accelcal.AL15.k2) / k2.standard_uncertainty)
        assert 0.6 < np.sqrt(np.mean(np.square(away))) < 1.4


def with_measured_angles(strokes):
    """A calibration in which no reading has the angle of another."""
    record = simulated(strokes=strokes)
    angle = record.angle + np.random.default_rng(1).normal(0.0, 1e-4, len(record))
    return accelcal.fit(replace(record, angle=angle, position=np.zeros_like(record.position)))


def test_the_text_of_measured_angles_takes_little_memory():
    """A grid of 300 strokes by 2700 different angles, most of it empty, took 22 MB."""
    calibration = with_measured_angles(300)
    tracemalloc.start()
    try:
        text = str(calibration)
        assert tracemalloc.get_traced_memory()[1] < 10e6
    finally:
        tracemalloc.stop()
    assert "over 300 strokes" in text


def test_the_page_of_many_readings_is_small(tmp_path):
    """A drawing for each reading would take 6 MB; the points are pixels."""

    def page_of(record):
        accelcal.fit(record).report(tmp_path / "page.html")
        return (tmp_path / "page.html").read_text(encoding="utf-8")

    usual = page_of(simulated(strokes=6)).count("data:image/png")
    for record, largest in ((simulated(strokes=1000), 1.5e6), (simulated(3000), 3e6)):
        page = page_of(record)
        assert len(page) < largest
        assert page.count("data:image/png") > usual


def test_the_page_of_measured_angles_has_no_empty_rows(tmp_path):
    """All angles by all strokes took 16 MB, and the picture a row for each angle."""
    calibration = with_measured_angles(200)
    calibration.report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert len(page) < 6e6
    assert calibration.plot.residual_map().collections[0].get_array().shape == (9, 200)


def test_too_many_readings_to_hold_against_each_other_are_refused(monkeypatch):
    """By their number, not by a failure to find the memory."""
    record = simulated(strokes=60)
    calibration = accelcal.fit(simulated())
    monkeypatch.setattr(of_readings, "_MOST_NUMBERS", 20_000)
    for search in (accelcal.discover, lambda record: accelcal.compare(calibration, record)):
        with pytest.raises(InputError, match=r"540 readings, .* 42 positions and cycles of runs"):
            search(record)


def test_cycles_of_a_long_test_are_not_held_against_each_other():
    """Of 6,000 strokes each cycle had a column of its own: they were refused."""
    refuse_too_many(simulated(strokes=6000))


@pytest.mark.parametrize("moving", [False, True])
def test_laws_from_the_readings_of_many_positions_take_little_memory(moving):
    """An unknown for each position beside all readings would take 160 MB."""
    record = simulated(600, 1, (20.0, 80.0, -40.0))
    if moving:
        wavering = 0.05 * np.random.default_rng(1).standard_normal(len(record))
        record = replace(record, temperature=record.temperature + wavering)
    found, peak = peak_of(record, temperature_laws="readings")
    assert peak < 60e6
    assert found.temperature_model.k0.above.value == pytest.approx(-3.9e-5, rel=0.05)
