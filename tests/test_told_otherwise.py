"""One and the same test told otherwise, in another unit or order of rows, has the same result."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import accelcal
from accelcal import NoiseComponents, TumblePlan

RELATIVE = ("k0", "k2", "k3", "delta", "delta_ip")


def in_unit(record, factor):
    """The record with readings in a unit so many times smaller."""
    step = record.apparatus.resolution
    scaled = replace(record, output=record.output * factor)
    return scaled.with_apparatus(resolution=step and step * factor)


def in_order(record, order):
    """The record with its rows in another order."""
    names = ("output", "angle", "temperature", "stroke", "run", "mounting", "position", "time")
    given = {name: getattr(record, name) for name in names}
    return replace(
        record, **{name: rows[order] for name, rows in given.items() if rows is not None}
    )


def per_g(calibration):
    """Values and U that no unit of the output is in."""
    for table in calibration.tables:
        scale_factor = table.quantities["K1"].value
        for name in ("K1", *RELATIVE):
            found, unit = table.quantities[name], scale_factor if name == "K1" else 1.0
            yield tuple((x or 0.0) / unit for x in (found.value, found.expanded_uncertainty))


def gates(calibration):
    return [(gate.name, gate.verdict) for table in calibration.tables for gate in table.gates]


def assert_same(one, other):
    assert_allclose(list(per_g(other)), list(per_g(one)), rtol=1e-6, atol=1e-12)
    assert gates(other) == gates(one)


def plain():
    return accelcal.simulate(seed=4)


def coarse():
    """Steps of 1e-5, which are 10,000 in a unit 1e9 times smaller."""
    return accelcal.simulate(plan=TumblePlan(resolution=1e-5), seed=5)


def one_noisy_run():
    """Readings rounded to a declared step that hides their noise, but in one run."""
    record = accelcal.simulate(
        plan=TumblePlan(strokes=3, temperatures=(20.0, 30.0, 40.0)),
        noise=NoiseComponents(reading=1e-8, head=0.0, launch=0.0, launch_sf=0.0),
        seed=6,
    )
    noisy = 5e-4 * np.random.default_rng(1).standard_normal(len(record))
    y = np.round(record.output + np.where(record.run == 2, noisy, 0.0), 3)
    return replace(record, output=y).with_apparatus(resolution=1e-3)


@pytest.mark.parametrize("record", [plain, coarse, one_noisy_run])
@pytest.mark.parametrize("factor", [1e-6, 1e-3, 1e3, 1e9])
def test_the_unit_of_the_output_does_not_matter(record, factor):
    test = record()
    assert_same(accelcal.fit(test), accelcal.fit(in_unit(test, factor)))


@pytest.mark.parametrize("factor", [1e-6, 1e3])
def test_a_misfit_of_the_law_of_the_scale_factor_is_told_in_any_unit(factor):
    plan = TumblePlan(temperatures=(20.0, 0.0, -20.0, 40.0, 60.0))
    noise = NoiseComponents(reading=1e-8, head=1e-7, launch=0.0, launch_sf=0.0)
    curved = accelcal.effect("scale-factor-temperature-quadratic").of(1e-9)
    record = accelcal.simulate(plan=plan, noise=noise, effects=[curved], seed=8, declare=True)
    one, other = (accelcal.fit(test) for test in (record, in_unit(record, factor)))
    assert any("scale factor does not follow" in line for line in one.temperature_model.warnings)
    assert other.temperature_model.warnings == one.temperature_model.warnings


def turns_of_few():
    """Seven readings at five angles; mirrored, a stroke leaves the coefficients undetermined."""
    angle = [90.0, 270.0, 315.0, 270.0, 180.0, 45.0, 0.0]
    y = [0.008907, 0.007321, 0.933353, 0.006533, -1.303206, 0.935900, 1.319390]
    columns = {"output": y, "angle": angle, "temperature": 20.0, "stroke": [1, 1, 1, 2, 2, 2, 2]}
    return accelcal.read_arrays(columns)


def four_positions():
    """A stroke whose ends agree to the last digit but one."""
    y = [1.352662 + 4e-9, 0.002392, -1.343695, 0.006292, 1.352662]
    columns = {"output": y, "angle": [0.0, 90.0, 180.0, 270.0, 360.0], "temperature": 17.0}
    return accelcal.read_arrays({**columns, "stroke": 1})


@pytest.mark.parametrize("record", [plain, turns_of_few, four_positions])
def test_the_order_of_the_rows_does_not_matter(record):
    test = record()
    one = accelcal.fit(test)
    for seed in range(20):
        order = np.random.default_rng(seed).permutation(len(test))
        assert_same(one, accelcal.fit(in_order(test, order)))


@cache
def lagging():
    """A record with a small backlash, and what is found in it."""
    hidden = accelcal.effect("backlash").of(3e-6)
    record = accelcal.simulate(effects=[hidden], seed=4, declare=True)
    return record, accelcal.discover(record)


@pytest.mark.parametrize("timed", [False, True])
def test_the_order_of_the_rows_does_not_matter_to_a_search(timed):
    test, one = lagging()
    if timed:  # to the whole minute, as by a clock on the wall
        test = replace(test, time=np.floor(25.0 * np.arange(len(test)) / 60.0) * 60.0)
        one = accelcal.discover(test)
    order = np.random.default_rng(1).permutation(len(test))
    other = accelcal.discover(in_order(test, order))
    assert str(other) == str(one)
    assert (other.p_value, other.after) == (one.p_value, one.after)
    assert other.smallest_detectable == one.smallest_detectable


def test_the_unit_of_the_output_does_not_matter_to_a_search():
    test, one = lagging()
    other = accelcal.discover(in_unit(test, 1e3))
    assert str(other) == str(one)
    assert other.p_value == pytest.approx(one.p_value, rel=1e-6)


def test_units_of_a_stand_may_each_be_told_in_an_order_of_their_own():
    hidden = accelcal.effect("backlash").of(2e-5)
    plan = TumblePlan(temperatures=(20.0,))
    units = [accelcal.simulate(plan=plan, effects=[hidden], seed=seed) for seed in (1, 2, 3)]
    turned = [in_order(unit, np.arange(len(unit))[::-1]) for unit in units[1:]]
    one, other = map(accelcal.discover_stand, (units, [units[0], *turned]))
    assert str(other) == str(one)
