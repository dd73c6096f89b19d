"""Records that lack readings, each its own: one stack, and the numbers and texts of each alone."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rows_of_calibrations import assert_rows_are_those_of_fits

import accelcal
from accelcal.calibrate.fit import calibrate_many
from accelcal.calibrate.options import Options
from accelcal.calibrate.plan import plans_of
from accelcal.estimate.solver import LeastSquares, WithGaps


def with_gaps(record, seed, share=0.05):
    return record.taken(np.random.default_rng(seed).random(len(record)) >= share)


def records(number=4, **design):
    plan = accelcal.TumblePlan(**{"strokes": 6} | design)
    return [with_gaps(accelcal.simulate(plan=plan, seed=seed), seed) for seed in range(number)]


WHERE_ROWS_ARE_MISSING = {
    "here and there": lambda _, chance: chance < 0.05,
    "most of them": lambda _, chance: chance < 0.6,
    "a position of one run": lambda record, _: (record.angle == 90.0) & (record.run == 1),
    "a position": lambda record, chance: (record.angle == 135.0) | (chance < 0.05),
    "a stroke of one run": lambda record, _: (record.stroke == 2) & (record.run == 0),
    "a stroke": lambda record, chance: (record.stroke == 3) | (chance < 0.05),
    "all of a run but some": lambda record, chance: (record.run == 2) & (chance < 0.7),
}


@pytest.mark.parametrize("lost", WHERE_ROWS_ARE_MISSING.values(), ids=WHERE_ROWS_ARE_MISSING)
def test_rows_of_files_with_gaps_are_those_of_fits(tmp_path, lost):
    """Each of the first four has gaps of its own, where they are random; the last has none."""
    chance = np.random.default_rng(5).random((4, 1000))
    designs = {"strokes": 6}, {"strokes": 6, "mountings": ("o+", "p+")}
    for number, plan in enumerate([accelcal.TumblePlan(**design) for design in designs]):
        for seed in range(5):
            record = accelcal.simulate(plan=plan, seed=seed)
            if seed < 4:
                record = record.taken(~lost(record, chance[seed, : len(record)]))
            accelcal.write_table(record, tmp_path / f"{number}{seed}.csv")
    found = assert_rows_are_those_of_fits(tmp_path, 10)
    assert found.errors.empty
    assert len(found.tables) == 5 * 9


def test_records_with_gaps_of_their_own_are_one_stack():
    ((places, stack),) = calibrate_many(records()).stacks
    assert places.tolist() == [0, 1, 2, 3]
    assert stack.one(2) == accelcal.fit(records()[2])


@pytest.mark.parametrize(
    ("changed", "options"),
    [
        ({"std": np.linspace(1e-6, 2e-6, 150)}, {}),
        ({"temperature": np.linspace(20.0, 21.0, 150)}, {}),
        ({}, {"robust": True}),
        ({}, {"temperature_laws": "readings"}),
    ],
    ids=["weights", "moving temperatures", "robust", "laws from the readings"],
)
def test_what_gaps_alone_do_not_tell_keeps_records_apart(changed, options):
    own = [replace(record.taken(np.arange(150)), **changed) for record in records(2)]
    found = calibrate_many(own, Options(**options))
    assert [len(stack) for _, stack in found.stacks] == [1, 1]


def slow(record, rng):
    """Noise of a slow filter."""
    noise = rng.normal(0.0, 3e-5, len(record))
    for i in range(1, len(noise)):
        noise[i] += 0.7 * noise[i - 1]
    return record.output + noise


def uneven(record, rng):
    noise = rng.normal(0.0, 5e-5, len(record))
    return record.output + noise * np.sin(np.radians(record.angle))


def rounded(record, _):
    return np.round(record.output, 4)


def drifting(record, rng):
    return record.output + rng.normal(0.0, 2e-4) * np.linspace(0.0, 1.0, len(record))


def copied(record, _):
    output = record.output.copy()
    output[record.stroke == 3] = output[record.stroke == 1]
    return output


def turned(record, _):
    wrong = (record.stroke == 2) & (record.run == 1)
    return np.where(wrong, -record.output, record.output)


def of_another_unit(record, rng):
    output = record.output.copy()
    output[rng.integers(output.size)] *= 10.0
    return output


def cut_off(record, _):
    return np.minimum(record.output, 0.9999 * record.output.max())


WHAT_READINGS_SHOW = [slow, uneven, rounded, drifting, copied, turned, of_another_unit, cut_off]


@pytest.mark.parametrize("shown", WHAT_READINGS_SHOW)
def test_what_readings_show_beside_gaps_is_what_fits_show(tmp_path, shown):
    """Rows and texts of an archive in one stack; the third has times."""
    for seed in range(4):
        record = accelcal.simulate(plan=accelcal.TumblePlan(strokes=6), seed=seed)
        record = replace(record, output=shown(record, np.random.default_rng(seed)))
        if seed == 2:
            record = replace(record, time=60.0 * np.arange(len(record)) ** 1.1)
        accelcal.write_table(with_gaps(record, seed), tmp_path / f"{seed}.csv")
    assert_rows_are_those_of_fits(tmp_path, 4)


def test_solver_with_gaps_is_that_of_the_rows_that_are_there():
    rng = np.random.default_rng(3)
    matrix, y = rng.normal(size=(12, 3)), rng.normal(size=(5, 12))
    there = rng.random((5, 12)) < 0.8
    found = WithGaps.of(matrix, there)
    for own, known, reading in zip(found.map, there, y, strict=True):
        alone = LeastSquares(matrix[known])
        assert_allclose(own[:, known], alone.map, rtol=1e-12, atol=1e-14)
        assert not own[:, ~known].any()
        assert_allclose(own @ reading, alone.solve(reading[known]), rtol=1e-10)
    assert_allclose(found.solve(y), np.einsum("tpn,tn->tp", found.map, y), rtol=1e-10)
    assert_allclose(found.basis.mT @ found.basis, [np.eye(3)] * 5, atol=1e-14)


def test_records_with_few_readings_all_over_a_large_table_stay_apart():
    """Together they would have too many for a stack of any size."""
    plan = accelcal.TumblePlan(positions=100, strokes=24, temperatures=(20.0,))
    whole = accelcal.simulate(plan=plan, seed=0)
    always = (whole.stroke <= 2) | (whole.angle == 0.0)
    chance = np.random.default_rng(0).random((120, len(whole)))
    found = plans_of([whole.taken(always | (own < 0.02)) for own in chance], None, gaps=True)
    assert len(found) == 120


def test_copies_of_which_chance_might_make_some_are_judged_by_the_readings_there_are(tmp_path):
    """The gaps are the same in a run and its copy; steps are nearly as large as the noise."""
    for seed in range(4):
        record = accelcal.simulate(plan=accelcal.TumblePlan(resolution=2.7e-5), seed=seed)
        lost = np.random.default_rng(seed).random(54) < 0.2
        output = record.output.copy()
        output[record.run == 2] = output[record.run == 1]
        record = replace(record, output=output).taken(~np.tile(lost, 3))
        accelcal.write_table(record, tmp_path / f"{seed}.csv")
    found = assert_rows_are_those_of_fits(tmp_path, 4).tables
    assert set(found["gate_agreement_of_tables"]) == {"pass", "warn"}


def test_records_whose_gaps_change_what_they_tell_apart_are_alone(tmp_path):
    """At these angles K3 is nearly a sum of the others; the gaps change their shares in it."""
    plan = accelcal.TumblePlan(angles=(165.0, 195.0, 210.0, 225.0, 315.0, 345.0))
    for seed in range(3):
        record = with_gaps(accelcal.simulate(plan=plan, seed=seed), seed)
        accelcal.write_table(record, tmp_path / f"{seed}.csv")
    found = assert_rows_are_those_of_fits(tmp_path, 3).tables
    assert found["stands_for"].nunique() > 1


def test_level_of_a_run_is_the_mean_of_the_readings_that_a_record_has(tmp_path):
    """Of two mountings, of which one was warmer; T0 is the level of the first run."""
    plan = accelcal.TumblePlan(mountings=("o+", "p+"))
    for seed in range(2):
        record = accelcal.simulate(plan=plan, seed=seed)
        other = record.mounting == "p+"
        run, warmer = record.run - 3 * other, record.temperature + 0.25 * other
        labels = record.run_labels[:3]
        changes = {"run": run, "temperature": warmer, "reference_temperature": None}
        record = replace(record, run_labels=labels, **changes)
        accelcal.write_table(with_gaps(record, seed), tmp_path / f"{seed}.csv")
    found = assert_rows_are_those_of_fits(tmp_path, 2).tables
    assert found["T0_degC"].nunique() == 2
