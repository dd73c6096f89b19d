"""Reading noise that differs by position, against the plain formulas."""

from dataclasses import replace

import numpy as np
import pytest

import accelcal

ANGLE = np.tile(np.arange(9) * 45.0, 6)
STROKE = np.repeat(np.arange(1, 7), 9)
SAID = "the strokes scatter more at some positions than at others"


def table(noise, *, strokes=6, runs=1, seed=5, **columns):
    """A test on a head without errors; `noise` is that of each angle [g]."""
    rng = np.random.default_rng(seed)
    angle, stroke = (np.tile(values[: 9 * strokes], runs) for values in (ANGLE, STROKE))
    th = np.radians(angle)
    y = 1.35 * (np.cos(th) + 3e-3 + noise(th) * rng.standard_normal(th.size))
    run = np.repeat(np.arange(runs), 9 * strokes)
    readings = {"angle": angle, "stroke": stroke, "temperature": 20.0, "Y [mA]": y, "run": run}
    errors = ("head_uncertainty", "launch_uncertainty", "launch_sf_uncertainty")
    return accelcal.read_arrays(readings | columns, overrides=dict.fromkeys(errors, 0.0))


def noisy_at_the_ends(th):
    return np.where(np.abs(np.cos(th)) > 0.9, 3e-5, 3e-6)


def says_so(calibration):
    return any(SAID in text for text in calibration.tables[0].warnings)


def test_each_position_counts_with_its_own_noise():
    record = table(noisy_at_the_ends)
    found = accelcal.fit(record).tables[0]
    th = np.radians(record.angle)
    a, p = np.cos(th), np.sin(th)
    rows = np.linalg.pinv(np.column_stack([np.ones_like(a), a, a**2, a**3, p, a * p]))
    parts = []
    for at in range(0, 360, 45):
        own = np.flatnonzero(record.angle % 360 == at)
        variance = record.output[own].var(ddof=1)
        parts.append(((rows[:, own] ** 2).sum(axis=1) * variance, own.size - 1))
    whole = sum(part for part, _ in parts)
    dof = whole**2 / sum(part**2 / number for part, number in parts)
    for i, name in enumerate(("K0", "K1", "K2", "K3", "M", "M_ip")):
        quantity = found.coefficients[name]
        assert quantity.standard_uncertainty == pytest.approx(np.sqrt(whole[i]), rel=1e-6)
        assert quantity.dof == pytest.approx(dof[i], rel=1e-6)


def test_it_is_said():
    assert says_so(accelcal.fit(table(noisy_at_the_ends)))


@pytest.mark.parametrize(
    "record",
    [
        table(lambda th: 5e-6 + 0.0 * th),
        table(lambda th: 0.0 * th),
        table(noisy_at_the_ends, strokes=1),
        table(noisy_at_the_ends, std=1.35 * noisy_at_the_ends(np.radians(ANGLE))),
    ],
    ids=["even", "none", "one stroke", "declared"],
)
def test_other_noise_is_one_for_all(record):
    assert not says_so(accelcal.fit(record))


def test_runs_of_few_strokes_tell_it_together():
    """Each of three runs of two strokes takes the scatter of all, in units of its own noise."""
    record = table(noisy_at_the_ends, strokes=2, runs=3)
    found = accelcal.fit(record).tables[0]
    assert says_so(accelcal.fit(record))
    place = record.angle % 360
    squares = np.zeros((3, 8))
    for run, at in np.ndindex(3, 8):
        own = record.output[(record.run == run) & (place == 45 * at)]
        squares[run, at] = ((own - own.mean()) ** 2).sum()
    size = squares.sum(axis=1) / 10.0
    repeats = 3.0 * np.array([3, *7 * [1]])
    variance = size[0] * (squares / size[:, None]).sum(axis=0) / repeats
    th = np.radians(record.angle[record.run == 0])
    a, p = np.cos(th), np.sin(th)
    rows = np.linalg.pinv(np.column_stack([np.ones_like(a), a, a**2, a**3, p, a * p]))
    at = (place[record.run == 0] // 45).astype(int)
    parts = np.stack([(rows[:, at == j] ** 2).sum(axis=1) * variance[j] for j in range(8)], axis=1)
    inverse = (parts**2 / repeats).sum(axis=1) / parts.sum(axis=1) ** 2 + 1.0 / 10.0
    for i, name in enumerate(("K0", "K1", "K2", "K3", "M", "M_ip")):
        quantity = found.coefficients[name]
        assert quantity.standard_uncertainty == pytest.approx(parts[i].sum() ** 0.5, rel=1e-6)
        assert quantity.dof == pytest.approx(1.0 / inverse[i], rel=1e-6)


@pytest.mark.parametrize("runs", [1, 5])
def test_one_stroke_tells_nothing(runs):
    assert not says_so(accelcal.fit(table(noisy_at_the_ends, strokes=1, runs=runs)))


@pytest.mark.parametrize("strokes", [2, 3])
def test_positions_with_the_same_size_of_a_i_tell_it_together(strokes):
    """Few strokes of one run: 0 with 180 deg, 90 with 270 deg, and the four between them."""
    record = table(noisy_at_the_ends, strokes=strokes)
    calibration = accelcal.fit(record)
    assert says_so(calibration)
    th = np.radians(record.angle)
    a, p = np.cos(th), np.sin(th)
    rows = np.linalg.pinv(np.column_stack([np.ones_like(a), a, a**2, a**3, p, a * p]))
    place, whole, over_dof = record.angle % 360, np.zeros(6), np.zeros(6)
    for together in ((0, 180), (90, 270), (45, 135, 225, 315)):
        groups = [np.flatnonzero(place == at) for at in together]
        squares = sum(((record.output[g] - record.output[g].mean()) ** 2).sum() for g in groups)
        dof = sum(g.size - 1 for g in groups)
        part = (rows[:, np.concatenate(groups)] ** 2).sum(axis=1) * squares / dof
        whole, over_dof = whole + part, over_dof + part**2 / dof
    for i, name in enumerate(("K0", "K1", "K2", "K3", "M", "M_ip")):
        quantity = calibration.tables[0].coefficients[name]
        assert quantity.standard_uncertainty == pytest.approx(whole[i] ** 0.5, rel=1e-6)
        assert quantity.dof == pytest.approx(whole[i] ** 2 / over_dof[i], rel=1e-6)


def test_a_position_that_is_met_once_counts_as_its_mirrors():
    """Two strokes without the reading of the first at 45 deg, and no return at the end."""
    record = table(noisy_at_the_ends, strokes=2)
    keep = np.arange(18) != 1
    once = accelcal.read_arrays(
        {
            "angle": record.angle[keep],
            "stroke": record.stroke[keep],
            "temperature": np.full(17, 20.0),
            "Y [mA]": record.output[keep],
        },
        overrides={"head_uncertainty": 0.0},
    )
    found, whole = accelcal.fit(once), accelcal.fit(record)
    assert says_so(found)
    U, usual = (k.tables[0].coefficients["K3"].expanded_uncertainty for k in (found, whole))
    assert usual < U < 1.5 * usual


def test_even_noise_keeps_its_uncertainty():
    """A weak test takes the readings of two strokes for unlike in one of twenty tables."""
    said = [
        says_so(accelcal.fit(table(lambda th: 5e-6 + 0 * th, strokes=2, seed=k))) for k in range(60)
    ]
    assert np.mean(said) <= 0.05


def test_laws_from_all_readings_count_it_too():
    """Their delta is that of the tables, as no other coefficient tells of it."""
    temperature = np.repeat([20.0, 80.0, -40.0], 54)
    record = table(noisy_at_the_ends, runs=3, temperature=temperature)
    of_tables, of_readings = (
        accelcal.fit(record, temperature_laws=laws, reference_temperature=20.0).temperature_model
        for laws in ("tables", "readings")
    )
    for part in ("at_T0", "above", "below"):
        expected = getattr(of_tables.delta, part).standard_uncertainty
        found = getattr(of_readings.delta, part)
        assert found.standard_uncertainty == pytest.approx(expected, rel=1e-3)
        assert found.dof == pytest.approx(22.0, abs=2.0)  # of the readings at 90 and 270 deg


def test_rounded_readings_do_not_tell_it():
    """A last digit that changed once passed for a noisy position, and K1 had a U of NaN."""
    quiet = accelcal.NoiseComponents(reading=1e-9, head=0.0, launch=0.0, launch_sf=0.0)
    plan = accelcal.TumblePlan(strokes=2, temperatures=(20.0,) * 4)
    record = accelcal.simulate(plan=plan, noise=quiet, seed=1, declare=False)
    counts = np.round(record.output, 3)
    counts[np.flatnonzero((record.angle == 270.0) & (record.run == 2))[0]] += 1e-3
    found = accelcal.fit(replace(record, output=1.1e6 * counts))
    assert not any(SAID in text for table in found.tables for text in table.warnings)
    assert accelcal.Calibration.from_json(found.to_json()) == found


def test_a_step_of_many_units_is_a_step():
    """Readings in uV that come in steps of 1 mV seemed to have steps of 1 uV."""
    plan = accelcal.TumblePlan(resolution=1e-3, temperatures=(20.0,))
    record = accelcal.simulate(plan=plan, seed=1, declare=False)
    counts = np.round(record.output, 3)  # free of what is beyond the digits
    small, large = (accelcal.fit(replace(record, output=f * counts)).tables[0] for f in (1.0, 1e6))
    for name, quantity in small.coefficients.items():
        other = large.coefficients[name].standard_uncertainty
        assert other == pytest.approx(1e6 * quantity.standard_uncertainty, rel=1e-6)
