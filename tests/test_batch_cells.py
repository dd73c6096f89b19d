"""Cells of a frame: the same values, however many parts are put together."""

import gc
import gzip
import weakref

import numpy as np
import pytest

import accelcal
from accelcal.archive import formats
from accelcal.archive.block import fit_records
from accelcal.archive.formats import ROWS, encode, put_together
from accelcal.archive.settings import Settings
from accelcal.archive.stacked_rows import stacked_tables
from accelcal.arrays import Labels
from accelcal.calibrate.fit import calibrate_many


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
    assert found[2] == {}  # failures


@pytest.mark.parametrize("form", [".csv", ".csv.gz"])
@pytest.mark.parametrize("rows", [0, 1, 4, 5, 11])
def test_text_made_in_parts_is_that_of_all_rows(monkeypatch, form, rows):
    numbers = np.arange(rows) / 3.0
    columns = {
        "serial": Labels(np.arange(rows) % 2, ["A", None]),
        "line": Labels.of(list(range(rows))),
        "k0": np.where(numbers == 1.0, np.nan, numbers),
    }
    kinds = {name: ROWS[name] for name in columns}
    whole = encode(columns, kinds, form)
    monkeypatch.setattr(formats, "_ROWS", 5)
    parts = encode(columns, kinds, form)
    assert parts == whole
    text = gzip.decompress(whole) if form == ".csv.gz" else whole
    assert text.count(b"\n") == rows
