"""What accelcal writes it reads back equal."""

from __future__ import annotations

import gzip
import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from accelcal.apparatus import Apparatus
from accelcal.errors import InputError
from accelcal.io.tables import read_table, read_tables
from accelcal.io.values.markers import are_markers
from accelcal.io.writer import write_table
from accelcal.record import TumbleRecord


def record_of(outputs, **changes):
    n = len(outputs)
    index = np.arange(n)
    values = {
        "output": np.array(outputs, dtype=float),
        "angle": index % 9 * 45.0,
        "temperature": np.full(n, 20.0),
        "stroke": index // 9 + 1,
        "run": np.zeros(n, dtype=np.int64),
        "run_labels": ("20",),
        "mounting": np.full(n, "o+"),
        "position": index % 9 + 1,
    }
    return TumbleRecord(**{**values, **changes})


FULL = record_of(
    [1.3, 0.1 + 0.2, -1e-17, 5e-324],
    angle=np.array([0.0, 45.01, 30.0, 720.5]),
    position=np.array([1, 2, 0, 0]),
    temperature=np.array([20.0, np.nan, -40.1, 80.0]),
    run=np.array([1, 0, 1, 0]),
    run_labels=("heating, slow", 'say "20"', "never run"),
    mounting=np.array(["o+", "o-", "p+", "p-"]),
    time=np.array([0.0, 0.1, -5.0, 1e9]),
    std=np.array([1e-6, np.nan, 0.0, 1.0]),
    count=np.array([10.0, np.nan, 1.0, 1e6]),
    serial="AL 15/003",
    unit="mA",
    reference_temperature=20.5,
    apparatus=Apparatus(9.8106, 2e-5, 2e-5, 1.5e-5, 0.1, 1e-6),
    date="2009-05-31 10:00",
    metadata={"operator": "A: B, C; D", "delta0": "0.001", "start": "2009-05-31T10:00:00"},
)


def written(records):
    file = io.StringIO()
    write_table(records, file)
    return file.getvalue()


def test_everything_reads_back_equal():
    assert read_table(io.StringIO(written(FULL))) == FULL


def test_writing_twice_gives_the_same_text():
    text = written(FULL)
    assert written(read_table(io.StringIO(text))) == text


def test_one_run_of_several():
    tables = list(FULL.tables())
    assert len(tables) == 4
    for table in tables:
        assert read_table(io.StringIO(written(table))) == table


def test_other_numbers_of_positions():
    record = record_of([1.0, 2.0, 3.0], angle=np.arange(3) * 30.0, positions=12)
    text = written(record)
    assert "angle" not in text
    assert read_table(io.StringIO(text)) == record


def test_files(tmp_path):
    for name in ("plain.csv", "packed.csv.gz"):
        path = tmp_path / name
        write_table(FULL, path)
        first = path.read_bytes()
        write_table(FULL, str(path))
        assert path.read_bytes() == first
        assert read_table(path) == FULL
    assert gzip.decompress(first).decode("utf-8") == written(FULL)
    assert first[4:8] == bytes(4)  # the time stamp of gzip, RFC 1952


@pytest.mark.parametrize("key", ["sensor (k=2; 95 %)", "sample #", "rig [a, b]", "sep"])
def test_a_key_that_reads_back_is_written(key):
    record = replace(FULL, metadata={key: "x"})
    assert read_table(io.StringIO(written(record))).metadata == {key: "x"}


def test_several_accelerometers():
    records = (replace(FULL, serial="A"), replace(FULL, serial="B", output=FULL.output * 2))
    assert read_tables(io.StringIO(written(records))) == records


@pytest.mark.parametrize(
    ("records", "message"),
    [
        ([], "no record to write"),
        ([FULL, FULL], "each needs its own"),
        ([FULL, replace(FULL, serial=None)], "each needs its own"),
        ([FULL, replace(FULL, serial="B", unit="V")], "has unit 'V'"),
        ([FULL, replace(FULL, serial="B", time=None)], "different columns"),
        ([FULL, replace(FULL, serial="B", run_labels=("x", "y", "z"))], "different runs"),
        (replace(FULL, metadata={"a": "b\nc"}), "does not fit into a header line"),
        (replace(FULL, metadata={"a:b": "c"}), "does not fit into a header line"),
        (replace(FULL, metadata={"a (b": "2): c"}), "does not fit into a header line"),
        (
            replace(FULL, time=FULL.time + 1.7e12),
            r"a time of 1.701e\+12 s; give times from the start",
        ),
        (replace(FULL, metadata={"": "c"}), "does not fit into a header line"),
        (replace(FULL, metadata={"serial": "c"}), "does not fit into a header line"),
        (replace(FULL, serial="a,"), "does not fit into a header line"),
        (replace(FULL, run_labels=("", "b", "c")), "does not fit into a cell"),
    ],
)
def test_what_does_not_fit_is_refused(records, message):
    file = io.StringIO()
    with pytest.raises(InputError, match=message):
        write_table(records, file)
    assert file.getvalue() == ""


NUMBER = st.floats(allow_nan=False, allow_infinity=False).filter(lambda y: not are_markers(y))
LABEL = st.text(
    st.characters(codec="utf-8", exclude_categories=("Cc", "Z", "Cs")), min_size=1, max_size=8
)


@given(
    st.lists(NUMBER, min_size=2, max_size=20, unique=True),
    st.lists(LABEL, min_size=1, max_size=3, unique=True),
    st.none() | LABEL,
    st.data(),
)
def test_any_record_reads_back_equal(outputs, labels, serial, data):
    n = len(outputs)
    column = st.lists(NUMBER.map(abs), min_size=n, max_size=n).map(np.array)
    run = data.draw(st.lists(st.integers(0, len(labels) - 1), min_size=n, max_size=n))
    record = record_of(
        outputs,
        run=np.array(run),
        run_labels=tuple(labels),
        serial=serial,
        time=data.draw(st.none() | column),
        std=data.draw(st.none() | column),
    )
    try:
        text = written(record)
    except InputError:
        return  # refused, not distorted
    assert read_table(io.StringIO(text)) == record


def test_a_file_of_bytes_is_refused():
    with pytest.raises(InputError, match="takes bytes; open it for text, or give its path"):
        write_table(FULL, io.BytesIO())
