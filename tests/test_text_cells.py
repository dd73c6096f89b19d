"""Cells of plain text by numpy: the numbers are those of ``float``, to the last bit."""

from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from accelcal.io.text_cells import labels_of, numbers_of, split_cells


def column(cells):
    return split_cells("".join(f"{cell}\n" for cell in cells).encode(), 1)[0]


def assert_read_as_float(cells):
    assert numbers_of(column(cells)).tobytes() == np.array(list(map(float, cells))).tobytes()


@pytest.mark.parametrize(
    "cells",
    [
        ["0", "-0", "0.0", "-0.0", "-0.00", "007", "00.70"],
        ["5.", ".5", "-.5", "-5.", "1e5", "-1.5E-7", "+3", "1.25e+02"],
        ["20.0", "20", "-40.25", "60.125", "1"],
        ["9007199254740991", "9007199254740992", "9007199254740993", "18014398509481985"],
        ["999999999999999999", "1000000000000000000", "0000000000000000000001"],
        ["0.000000000000000000001", "0.00066845123456789012", "9" * 21, "9" * 30],
        ["1.3623574", "-9.1234567890123456", "nan", "inf"],
    ],
)
def test_numbers(cells):
    found, expected = numbers_of(column(cells)), np.array(list(map(float, cells)))
    assert np.array_equal(found, expected, equal_nan=True)
    assert np.array_equal(np.signbit(found), np.signbit(expected))


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=50))
def test_numbers_with_all_digits(values):
    assert_read_as_float(list(map(repr, values)))


@given(st.lists(st.tuples(st.floats(-1e3, 1e3), st.integers(0, 20)), min_size=1, max_size=50))
def test_numbers_of_several_formats(values):
    assert_read_as_float([f"{value:.{places}f}" for value, places in values])


@given(st.lists(st.floats(0.001, 1e3), min_size=1, max_size=50), st.integers(12, 19))
def test_numbers_close_to_the_middle_between_two(values, places):
    middle = [(Decimal(x) + Decimal(float(np.nextafter(x, 1e9)))) / 2 for x in values]
    assert_read_as_float([f"{round(x, places):f}" for x in middle])


@given(st.lists(st.text("0123456789.-+eE", min_size=1, max_size=24), min_size=1, max_size=4))
def test_any_text_is_read_as_float_or_refused(cells):
    try:
        expected = np.array(list(map(float, cells)))
    except ValueError:
        with pytest.raises(ValueError, match=r".+"):
            numbers_of(column(cells))
    else:
        assert numbers_of(column(cells)).tobytes() == expected.tobytes()


@pytest.mark.parametrize("cell", ["", "-", ".", "1.2.3", "--1", "1-2", "1_000", "e5", "1e", "x"])
def test_no_numbers(cell):
    with pytest.raises(ValueError, match=r".+"):
        numbers_of(column(["1.5", cell, "2.5"]))


@given(
    st.lists(
        st.sampled_from(["", "A", "B", "AB", "BB", "serial-0000001", "serial-1000001", 99 * "C"])
    )
)
def test_labels(cells):
    codes, labels = labels_of(column([*cells, "A"]))
    assert [labels[code] for code in codes] == [*cells, "A"]
    assert labels == list(dict.fromkeys([*cells, "A"]))


@pytest.mark.parametrize(
    "text", [b"1,2\n3\n", b"1\n2,3\n", b"1,2,3\n4\n", b"1,2\n3,4,5,6\n", b"\n"]
)
def test_rows_of_other_lengths(text):
    with pytest.raises(ValueError, match="another number of cells"):
        split_cells(text, 2)
