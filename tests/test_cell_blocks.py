"""Plain cells of many tables: the numbers are those of ``float``, to the last bit."""

from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from accelcal.io.engines import BulkEngineGivesUp
from accelcal.io.ordinary.cell_blocks import parse_cells

with_engines = pytest.mark.parametrize("engine", ["pyarrow", "pandas"])


def parsed(cells, engine):
    text = "".join(f"{cell},a\n" for cell in cells)
    return parse_cells(text.encode(), ["output", "run"], {"run"}, engine).numbers["output"]


def assert_read_as_float(cells, engine):
    assert parsed(cells, engine).tobytes() == np.array(list(map(float, cells))).tobytes()


@with_engines
@pytest.mark.parametrize(
    "cells",
    [
        ["0", "-0", "0.0", "-0.0", "-0.00", "007", "00.70"],
        ["5.", ".5", "-.5", "-5.", "1e5", "-1.5E-7", "1.25e+02"],
        ["20.0", "20", "-40.25", "60.125", "1"],
        ["9007199254740991", "9007199254740992", "9007199254740993", "18014398509481985"],
        ["999999999999999999", "1000000000000000000", "0000000000000000000001"],
        ["0.000000000000000000001", "0.00066845123456789012", "9" * 21, "9" * 30],
        ["1.3623574", "-9.1234567890123456", "inf", "4.9e-324", "1e-400"],
    ],
)
def test_numbers(engine, cells):
    assert_read_as_float(cells, engine)


@with_engines
def test_positions_and_strokes_of_any_number_of_digits(engine):
    """Where all have one digit, pyarrow gives the text, of which the digits are taken."""
    for cells in (["1", "9"], ["10", "16"], ["1", "16"], ["007", "010"]):
        text = "".join(f"{cell},{cell}\n" for cell in cells).encode()
        found = parse_cells(text, ["position", "stroke"], set(), engine).numbers
        assert found["position"].tolist() == found["stroke"].tolist() == list(map(float, cells))
    for cell in ("x", "-", ".", " "):
        with pytest.raises(BulkEngineGivesUp):
            parse_cells(f"1,1\n{cell},1\n".encode(), ["position", "stroke"], set(), engine)


@with_engines
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=50))
def test_numbers_with_all_digits(engine, values):
    assert_read_as_float(list(map(repr, values)), engine)


@with_engines
@given(st.lists(st.floats(0.001, 1e3), min_size=1, max_size=50), st.integers(12, 19))
def test_numbers_close_to_the_middle_between_two(engine, values, places):
    middle = [(Decimal(x) + Decimal(float(np.nextafter(x, 1e9)))) / 2 for x in values]
    assert_read_as_float([f"{round(x, places):f}" for x in middle], engine)


@with_engines
@given(st.lists(st.text("0123456789.-+eE", max_size=24), min_size=1, max_size=4))
def test_any_text_is_read_as_float_or_refused(engine, cells):
    try:
        found = parsed(cells, engine)
    except BulkEngineGivesUp:
        return
    assert found.tobytes() == np.array(list(map(float, cells))).tobytes()


@with_engines
@pytest.mark.parametrize(
    "cell",
    ["", "-", ".", "1.2.3", "--1", "1-2", "1_000", "e5", "1e", "x", "0x10", "na", "NA", "none"],
)
def test_no_numbers(engine, cell):
    with pytest.raises(BulkEngineGivesUp):
        parsed(["1.5", cell, "2.5"], engine)


@with_engines
@given(
    st.lists(
        st.sampled_from(["", "A", "B", "AB", "nan", "NA", "1", "1.0", "serial-1", 99 * "C"]),
        min_size=1,
    )
)
def test_labels(engine, cells):
    text = "".join(f"{cell},1\n" for cell in cells)
    found = parse_cells(text.encode(), ["run", "output"], {"run"}, engine)
    assert [found.labels["run"][code] for code in found.codes["run"]] == cells
    assert found.labels["run"] == list(dict.fromkeys(cells))


@with_engines
@pytest.mark.parametrize(
    "text",
    [b"1,2\n3\n", b"1\n2,3\n", b"1,2,3\n4\n", b"1,2\n3,4,5,6\n", b"\n", b"1,2\n\n3,4\n"],
)
@pytest.mark.parametrize("labels", [set(), {"run"}])
def test_rows_of_other_lengths(engine, text, labels):
    with pytest.raises(BulkEngineGivesUp):
        parse_cells(text, ["output", "run"], labels, engine)
