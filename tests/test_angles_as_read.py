"""Angles as an encoder reads them: one position has one angle of the head, and one error of it."""

import dataclasses
import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import accelcal
from accelcal.calibrate.fit import calibrate_many
from accelcal.calibrate.options import Options
from accelcal.estimate.at_positions import at_positions, said_of_positions
from accelcal.geometry import accelerations
from accelcal.head_angles import SAME_POSITION, counted_on, head_positions, nominal_angles
from accelcal.model import design_matrix

TRUE = np.array([4.5e-3, 1.35, 1.4e-4, 1.2e-4, 1.55e-3, 2.7e-5])
JITTER = 1e-3  # deg


def as_read(seed=1, *, head=0.0, noise=6e-6, jitter=JITTER, strokes=6, declared=None):
    """Six strokes over eight positions, read by an encoder that tells where the head stopped."""
    rng = np.random.default_rng(seed)
    angle, stroke, output = [], [], []
    errors = rng.normal(scale=head, size=8) if head else np.zeros(8)
    for k in range(1, strokes + 1):
        for place in range(9) if k % 2 else range(8, -1, -1):
            read = 45.0 * place + (rng.normal(scale=jitter) if jitter else 0.0)
            there = np.array([read + np.rad2deg(errors[place % 8])])
            row = design_matrix(accelerations(there, 0.0, "o+"), "o+")[0]
            angle.append(read)
            stroke.append(k)
            output.append(row @ TRUE + rng.normal(scale=noise))
    columns = {"angle": angle, "stroke": stroke, "output": output}
    overrides = {"unit": "mA", "reference_temperature": 20.0, "head_uncertainty": declared}
    frame = {name: np.array(values) for name, values in columns.items()}
    return accelcal.read_arrays(
        frame | {"temperature": np.full(len(angle), 20.0)}, overrides=overrides
    )


def test_positions_get_their_share_of_the_turn():
    read = np.array([0.0012, 51.4276, 51.4301, 102.857, 154.2857, 205.71, 257.14, 308.57, 359.9991])
    assert nominal_angles(read) == pytest.approx(np.array([0, 1, 1, 2, 3, 4, 5, 6, 7]) * 360.0 / 7)


def test_other_positions_get_round_angles():
    read = np.array([-0.001, 0.001, 30.0012, 29.9996, 90.0, 180.0012, 719.9996])
    assert nominal_angles(read).tolist() == [0.0, 0.0, 30.0, 30.0, 90.0, 180.0, 720.0]


@pytest.mark.parametrize(
    "angle",
    [
        np.arange(9) * 45.0,
        np.array([0.0123, 45.0123, 90.0123, 360.0123]),
        np.linspace(0.0, 359.99, 20_000),
        np.array([10.0]),
        np.array([5.0, 5.0]),
    ],
)
def test_angles_that_are_exact_or_tell_no_positions_stay(angle):
    assert nominal_angles(angle) is angle


@given(st.lists(st.floats(-720.0, 720.0), min_size=1, max_size=40))
def test_no_angle_moves_far_and_none_meets_another_position(angles):
    given_ones = np.array(angles)
    found = nominal_angles(given_ones)
    assert np.abs(found - given_ones).max() <= 2.6 * SAME_POSITION
    nominal, read = head_positions(found), np.sort(np.mod(given_ones, 360.0))
    apart = np.count_nonzero(np.diff(read, append=read[0] + 360.0) > SAME_POSITION)
    assert np.unique(nominal).size >= apart


def test_readings_are_those_at_the_positions():
    exact = as_read(noise=0.0, jitter=0.0)
    found = at_positions(as_read(noise=0.0))
    assert found.angle.tolist() == exact.angle.tolist()
    assert found.output == pytest.approx(exact.output, abs=1e-11)
    assert len(said_of_positions(found)) == 1
    assert at_positions(found) is found


def test_readings_far_beside_their_position_lose_nothing():
    exact = as_read(noise=0.0, jitter=0.0)
    found = at_positions(as_read(noise=0.0, jitter=0.01))
    assert found.output == pytest.approx(exact.output, abs=1e-11)


@pytest.mark.parametrize("declared", [None, 2e-5])
def test_uncertainties_are_those_of_exact_angles(declared):
    """Head errors average over positions, not over readings: U used to be several times less."""
    exact, read = (
        accelcal.fit(as_read(seed=3, head=2e-5, jitter=jitter, declared=declared)).tables[0]
        for jitter in (0.0, JITTER)
    )
    for name, quantity in exact.coefficients.items():
        found = read.coefficients[name]
        if declared is not None:
            assert found.standard_uncertainty == pytest.approx(
                quantity.standard_uncertainty, rel=0.05
            )
        assert found.standard_uncertainty > 3e-6  # of 7 with the errors of 54 positions


def test_intervals_hold_the_truth():
    hits = []
    for seed in range(60):
        table = accelcal.fit(as_read(seed=seed, head=2e-5, declared=2e-5)).tables[0]
        hits.append(
            [
                abs(quantity.value - true) <= quantity.expanded_uncertainty
                for quantity, true in zip(table.coefficients.values(), TRUE, strict=True)
            ]
        )
    assert np.mean(hits) > 0.9  # 0.5 to 0.7 before


def test_the_report_tells_of_it_and_the_checks_are_made():
    calibration = accelcal.fit(as_read())
    assert "angles as read lie up to 0.00" in str(calibration)
    verdicts = {gate.name: gate.verdict for gate in calibration.tables[0].gates}
    for name in ("closure", "outlier", "forward against back"):
        assert verdicts[name] == "pass"


@pytest.mark.parametrize("start", [0.0, 90.0, 315.0])
def test_an_encoder_that_begins_anew_after_a_turn_tells_start_and_return(start):
    """359.9994 at the start passed for the return: two readings of a stroke were in one place."""
    record = as_read(seed=7)
    record = dataclasses.replace(record, angle=record.angle + start)
    within = dataclasses.replace(record, angle=np.mod(record.angle, 360.0))
    assert (within.angle != record.angle).any()
    found, exact = accelcal.fit(within).tables[0], accelcal.fit(record).tables[0]
    np.testing.assert_array_equal(found.residuals.angle_deg, exact.residuals.angle_deg)
    assert found.residuals.value == pytest.approx(exact.residuals.value, abs=1e-12)
    assert found.gates == exact.gates


def test_a_stroke_that_lacks_readings_is_counted_as_the_others_of_its_table():
    record = as_read(seed=7)
    whole = np.ones(len(record), dtype=bool)
    whole[[7, 8, 9, 18, 40, 41]] = False
    record = dataclasses.replace(record, angle=record.angle + 90.0).select(whole)
    within = dataclasses.replace(record, angle=np.mod(record.angle, 360.0))
    found, exact = (accelcal.fit(own).tables[0].residuals for own in (within, record))
    np.testing.assert_array_equal(found.angle_deg, exact.angle_deg)


@pytest.mark.parametrize(
    "angle",
    [
        np.array([0.0, 45.0, 90.0, 0.0, 315.0]),  # to and fro
        np.array([0.0, 0.0, 90.0, 180.0]),
        np.array([0.0, 180.0, 360.0]),  # either way
        np.array([90.0, 180.0, 270.0, 360.0, 450.0]),
        np.array([360.0]),
        np.array([90.0, 0.0]),
    ],
)
def test_readings_that_go_no_turn_round_stay(angle):
    assert counted_on(angle) is angle or counted_on(angle).tolist() == angle.tolist()


def test_the_closed_form_takes_them():
    found = accelcal.fit(as_read(), method="closed-form").tables[0].coefficients["K1"]
    assert found.value == pytest.approx(TRUE[1], abs=3e-5)


def test_an_angle_that_is_only_near_the_others_tells_no_coefficient():
    """Four positions do not tell K3 from K1, however they stop beside them."""
    record = as_read(seed=2)
    four = record.select(np.isin(np.round(record.angle) % 90.0, (0.0, 90.0)))
    assert accelcal.fit(four).tables[0].coefficients["K3"].value is None


def test_discovery_and_comparison_work_on_them():
    found = accelcal.discover(as_read(seed=4))
    assert not found.effects
    assert any(note.startswith("angles as read") for note in found.notes)
    compared = accelcal.compare(accelcal.fit(as_read(seed=4, declared=0.0)), as_read(seed=5))
    assert compared.p_value > 0.01
    assert any(note.startswith("angles as read") for note in compared.notes)


def test_a_certificate_of_the_head_is_for_its_positions():
    text = "angle [deg],error [urad],u [urad]\n" + "".join(
        f"{45 * place},{10 * place},2\n" for place in range(8)
    )
    head = accelcal.read_head(io.StringIO(text))
    found = accelcal.fit(as_read(), head=head)
    assert found.tables[0].coefficients["K1"].standard_uncertainty > 0.0


def test_many_records_get_what_each_gets_alone():
    records = [as_read(seed=seed) for seed in (1, 2)] + [accelcal.simulate(seed=3)]
    found = calibrate_many(records, Options())
    assert not found.failures
    for places, stack in found.stacks:
        for row, place in enumerate(places.tolist()):
            alone = accelcal.fit(records[place])
            for found_one, table in zip(stack.one(row).tables, alone.tables, strict=True):
                for name, quantity in table.coefficients.items():
                    other = found_one.coefficients[name]
                    assert other.value == pytest.approx(quantity.value, rel=1e-9)
                    assert other.standard_uncertainty == pytest.approx(
                        quantity.standard_uncertainty, rel=1e-9
                    )


def test_visits_of_a_level_are_told_by_repeated_positions():
    record = as_read(strokes=2)
    rows = []
    for visit, temperature in enumerate((20, 50, 20)):
        rows += [
            f"{temperature},{a + 3e-4 * visit:.4f},{k},{y + 1e-5 * visit:.7f}"
            for a, k, y in zip(record.angle, record.stroke, record.output, strict=True)
        ]
    text = "# unit: mA\ntemperature,angle,stroke,output\n" + "\n".join(rows) + "\n"
    assert len(accelcal.read_table(io.StringIO(text)).run_labels) == 3


def test_a_triad_counts_attitudes():
    rng = np.random.default_rng(1)
    rows = []
    for shaft in "xyz":
        for place in range(8):
            for _ in range(3):
                angle = 45.0 * place + rng.normal(scale=0.002)
                up = np.zeros(3)
                first = "xyz".index(shaft) + 1
                up[first % 3], up[(first + 1) % 3] = (
                    np.cos(np.deg2rad(angle)),
                    np.sin(np.deg2rad(angle)),
                )
                output = up + rng.normal(scale=1e-5, size=3)
                rows.append((shaft, angle, *output, *up))
    names = ["shaft", "angle", "x", "y", "z", "up_x", "up_y", "up_z"]
    for columns in (names[:5], [*names[2:]]):
        picked = [names.index(name) for name in columns]
        lines = [",".join(f"{row[i]}" for i in picked) for row in rows]
        text = ",".join(columns) + "\n" + "\n".join(lines) + "\n"
        found = accelcal.calibrate_triad(accelcal.read_triad(io.StringIO(text)))
        assert found.attitudes == (24 if "shaft" in columns else 18)  # six are seen by two shafts
        assert found.misalignments["m_xy"].value == pytest.approx(0.0, abs=3e-5)


def test_nothing_of_a_record_is_lost():
    record = as_read()
    found = at_positions(record)
    assert dataclasses.replace(found, angle=record.angle, output=record.output, notes=()) == record
