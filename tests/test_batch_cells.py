"""Cells of a frame: the same values, however many parts are put together."""

import gc
import weakref

import numpy as np

import accelcal
from accelcal.archive.columns import put_together
from accelcal.archive.fitting import fit_records
from accelcal.archive.settings import Settings
from accelcal.archive.stacked_rows import stacked_tables
from accelcal.arrays import Labels
from accelcal.calibrate.many import calibrate_many


def listed(columns):
    return {
        name: cells.cells() if isinstance(cells, Labels) else cells.tolist()
        for name, cells in columns.items()
    }


def test_many_stacks_make_one_frame():
    plan = accelcal.TumblePlan(temperatures=(20.0,), strokes=2)
    records = [accelcal.simulate(seed=seed, plan=plan) for seed in range(2)]
    ((_, stack),) = calibrate_many(records).stacks
    part = stacked_tables(stack)
    found = listed(put_together([part] * 100))
    for name, cells in listed(part).items():
        np.testing.assert_array_equal(found[name], cells * 100, err_msg=name)


def test_rows_come_in_any_order():
    parts = [
        {"run": Labels.of(["20", None]), "K1": np.array([1.0, 2.0])},
        {"run": Labels.of(["20", "80"]), "K1": np.array([3.0, np.nan])},
    ]
    found = put_together(parts, np.array([3, 0, 1]))
    assert found["run"].cells() == ["80", "20", None]
    np.testing.assert_array_equal(found["K1"], [np.nan, 1.0, 2.0])


def test_readings_go_as_soon_as_their_rows_are_there():
    """Arrays hardly ever bring the collector of cycles in, so that one would keep whole blocks."""
    records = [accelcal.simulate(seed=seed) for seed in range(3)]
    readings = [weakref.ref(record.output) for record in records]
    gc.disable()
    try:
        found = fit_records(records, Settings())
        del records
        assert [reading() for reading in readings] == [None] * 3
    finally:
        gc.enable()
    assert found.failures == {}
