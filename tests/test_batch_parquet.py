"""Parts of large Parquet files: what is read without the text of its rows is read the same."""

import errno
import os
from dataclasses import fields
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

import accelcal
from accelcal.archive import parts
from accelcal.archive.formats import FrameColumn, arrow_bytes, parquet_frame
from accelcal.archive.sources import find_sources
from accelcal.arrays import Labels
from accelcal.io.files.parquet import as_csv, read_rows, row_ranges
from accelcal.io.ordinary.reader import Content, read_arrow, read_ordinary

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")


def test_texts_that_come_again_are_stored_once(tmp_path):
    kinds = {"name": FrameColumn("name", "text", "", "")}
    parts_of = (["a", "\xe9", "a", None, "", "\udcff", "\\xff"], ["b", "a"])
    encoded = [
        arrow_bytes({"name": Labels(np.arange(len(texts)), list(texts))}, kinds)
        for texts in parts_of
    ]
    for number in range(5):
        with (tmp_path / f"{number}.parquet").open("wb") as file, parquet_frame(kinds, file) as add:
            for part in encoded:
                add(part)
    expected = ["a", "\xe9", "a", None, "", "\\xff", "\\xff", "b", "a"]
    assert pq.read_table(tmp_path / "0.parquet")["name"].to_pylist() == expected
    assert len({path.read_bytes() for path in tmp_path.iterdir()}) == 1  # no stray bytes


def frame(serials=("S1", "S2", "S3"), **columns):
    rng = np.random.default_rng(7)
    size = 18 * len(serials)
    position, stroke = np.tile(np.arange(1, 10), 2 * len(serials)), np.arange(size) // 9 % 2 + 1
    output = 1.35 * np.cos(np.radians(45.0 * (position - 1))) + 1e-5 * rng.normal(size=size)
    found = pd.DataFrame(
        {
            "serial": np.repeat(serials, 18),
            "temperature": np.repeat(20.0 + 0.1 * np.arange(len(serials)), 18),
            "position": position,
            "stroke": stroke,
            "output": output,
        }
    )
    return found.assign(**columns)


def arrow(columns, **types):
    table = pa.Table.from_pandas(columns, preserve_index=False)
    for name, kind in types.items():
        place = table.column_names.index(name)
        table = table.set_column(place, name, table.column(name).cast(kind))
    return table


ORDINARY = {
    "as pandas writes it": arrow(frame()),
    "dictionaries": arrow(frame(), serial=pa.dictionary(pa.int32(), pa.string())),
    "strings": arrow(frame(), serial=pa.string()),
    "serials of digits": arrow(frame(serials=(101, 102, 7))),
    "floats everywhere": arrow(frame(), position=pa.float64(), stroke=pa.float64()),
    "small integers": arrow(frame(), position=pa.int8(), stroke=pa.uint16()),
    "runs, mountings and scatter": arrow(frame(run="a", mounting="p", std=1e-6, count=10)),
    "chunks": pa.concat_tables([arrow(frame(("A", "B"))), arrow(frame(("C", "A1")))]),
    "a slice": arrow(frame()).slice(18, 36),
}


@pytest.mark.parametrize("name", ORDINARY)
def test_columns_are_read_as_their_text_is(name):
    table = ORDINARY[name]
    expected = read_ordinary([Content("a.parquet", as_csv(table, "a.parquet"), 5)], {"unit": "V"})[
        0
    ]
    found = read_arrow("a.parquet", table, 5, {"unit": "V"})
    assert len(found) == len(expected) > 1
    for one, other in zip(found, expected, strict=True):
        for field in fields(one):
            a, b = getattr(one, field.name), getattr(other, field.name)
            assert type(a) is type(b), field.name
            assert np.array_equal(a, b), field.name
            assert getattr(a, "dtype", None) == getattr(b, "dtype", None), field.name


def missing(columns, name):
    return columns.assign(**{name: columns[name].where(columns.index != 20)})


LEFT = {
    "short floats": arrow(frame(), output=pa.float32()),
    "missing number": arrow(missing(frame(), "output")),
    "missing label": arrow(missing(frame(), "serial")),
    "infinite": arrow(frame(output=np.inf)),
    "numbers as text": arrow(frame(), temperature=pa.string()),
    "serials of fractions": arrow(frame(serials=(1.5, 2.5))),
    "a comma in a label": arrow(frame(serials=("S,1", "S2"))),
    "a label in quotes": arrow(frame(serials=('"S1"', "S2"))),
    "an empty label": arrow(frame(serials=("", "S2"))),
    "true and false": arrow(frame(run=True)),
    "bytes": arrow(frame(), serial=pa.binary()),
    "an unknown column": arrow(frame(operator="me")),
    "a comma in a heading": arrow(frame().rename(columns={"stroke": "stroke,run"})),
    "decimals": arrow(frame(), temperature=pa.decimal128(9, 3)),
}


@pytest.mark.parametrize("name", LEFT)
def test_other_columns_are_left_to_the_text(name):
    assert read_arrow("a.parquet", LEFT[name], 0, {}) is None


@pytest.fixture
def path(tmp_path):
    serials = [f"S{n}" for n in (1, 1, 2, 3, 3, 3, 4, 5, 5, 6)]
    pq.write_table(arrow(frame(serials)), tmp_path / "a.parquet", row_group_size=50)
    return str(tmp_path / "a.parquet")


@pytest.mark.parametrize(("start", "end"), [(0, 180), (0, 50), (49, 51), (50, 100), (7, 179)])
def test_rows_across_row_groups(path, start, end):
    found = read_rows(path, start, end).to_pandas().astype({"serial": object})
    expected = pd.read_parquet(path)[start:end].reset_index(drop=True).astype({"serial": object})
    pd.testing.assert_frame_equal(found, expected)


def test_a_file_that_has_changed_is_read_anew(path):
    before = read_rows(path, 0, 20)
    pq.write_table(arrow(frame(("T1", "T2"))), path)
    os.utime(path, ns=(1, 1))
    assert read_rows(path, 0, 20).column("serial")[0].as_py() == "T1"
    assert before.column("serial")[0].as_py() == "S1"


@pytest.mark.parametrize("size", [1, 500, 2000, 2500, 10**6])
def test_ranges_end_where_a_serial_ends(path, size):
    serials = pd.read_parquet(path)["serial"].tolist()
    ranges = list(row_ranges(path, size, 0))
    least = max(size // 50, 1)
    assert [start for start, _ in ranges] == [0, *(end for _, end in ranges[:-1])]
    assert ranges[-1][1] == len(serials)
    changes = [i + 1 for i, (a, b) in enumerate(pairwise(serials)) if a != b] + [len(serials)]
    for start, end in ranges:
        assert end == next((c for c in changes if c >= start + least), len(serials))


@pytest.mark.parametrize(
    ("columns", "in_parts"),
    [
        (frame(), True),
        (frame().rename(columns={"serial": "Seriennummer"}), True),
        (frame().rename(columns={"serial": "S.N"}), True),
        (frame().assign(operator="me"), False),
        (frame().rename(columns={"stroke": "stroke,run"}), False),
    ],
    ids=["serial", "German", "with a point", "an unknown column", "a comma in a heading"],
)
def test_what_is_out_of_the_ordinary_is_read_whole(tmp_path, monkeypatch, columns, in_parts):
    path = tmp_path / "a.parquet"
    pq.write_table(arrow(columns), path)
    (source,) = find_sources([str(path)])
    assert parts.divide(source) == []
    whole = accelcal.batch(path)
    monkeypatch.setattr(parts, "LARGE", 1)
    monkeypatch.setattr(parts, "PART", 500)
    assert (len(parts.divide(source)) > 1) == in_parts
    found = accelcal.batch(path)
    assert found.tables["K1"].tolist() == whole.tables["K1"].tolist()
    assert found.errors["message"].tolist() == whole.errors["message"].tolist()


@pytest.mark.parametrize("text", ["A\nB", "A\rB", "A\r\nB", "A\n"])
@pytest.mark.parametrize(
    "column", ["serial", "note"], ids=["a column that is read", "one that is set aside"]
)
def test_a_cell_of_several_lines_is_refused(tmp_path, text, column):
    columns = frame(note="fine")
    columns.loc[5, column] = text
    columns.to_parquet(tmp_path / "a.parquet")
    (message,) = accelcal.batch(tmp_path).errors["message"]
    said = f"a.parquet:7: {column} {text!r} has a line break; write it in one line"
    assert message == str(tmp_path / said)


def test_the_line_of_such_a_cell_is_that_of_the_file(tmp_path, monkeypatch):
    columns = frame()
    columns.loc[40, "serial"] = "A\nB"
    columns.to_parquet(tmp_path / "a.parquet")
    monkeypatch.setattr(parts, "LARGE", 1)
    monkeypatch.setattr(parts, "PART", 500)
    found = accelcal.batch(tmp_path)
    assert (
        found.errors["message"].str.contains("a.parquet:42: serial 'A\\nB' has", regex=False).any()
    )


def test_a_heading_of_several_lines_is_refused(tmp_path):
    frame(**{"my\nnote": 1}).to_parquet(tmp_path / "a.parquet")
    (message,) = accelcal.batch(tmp_path).errors["message"]
    assert message.endswith(":1: the heading 'my\\nnote' has a line break; write it in one line")


@pytest.mark.parametrize("text", ["Prüfer", "Prüfer, der erste"])
def test_bytes_of_another_encoding_are_refused(tmp_path, text):
    frame(note=text.encode("latin-1")).to_parquet(tmp_path / "a.parquet")
    (message,) = accelcal.batch(tmp_path).errors["message"]
    said = "a.parquet: a text is not UTF-8; write the file again in UTF-8"
    assert message == str(tmp_path / said)
    frame(note=text.encode()).to_parquet(tmp_path / "a.parquet")
    assert len(accelcal.batch(tmp_path).tables) == 3


@pytest.mark.parametrize("system", ["tells the disk", "takes no advice", "has no such call"])
def test_the_disk_begins_to_write_rows_as_they_come(tmp_path, monkeypatch, system):
    for seed in range(3):
        accelcal.write_table(accelcal.simulate(seed=seed), tmp_path / f"{seed}.csv")
    begun = []

    def told(_, start, count, advice):
        assert advice == os.POSIX_FADV_DONTNEED
        begun.append((start, count))
        if system == "takes no advice":
            raise OSError(errno.EINVAL, "Invalid argument")

    if system == "has no such call":
        monkeypatch.delattr(os, "posix_fadvise", raising=False)
    else:
        monkeypatch.setattr(os, "posix_fadvise", told, raising=False)
        monkeypatch.setattr(os, "POSIX_FADV_DONTNEED", 4, raising=False)
    monkeypatch.setattr("accelcal.archive.through.LEAST_FILES", 1)
    accelcal.write_batch(tmp_path, tmp_path / "results.csv")
    size = sum((tmp_path / name).stat().st_size for name in ("results.csv", "results.laws.csv"))
    assert len(pd.read_csv(tmp_path / "results.csv")) == 9
    if system == "has no such call":
        assert not begun
    else:  # each byte once, in several parts
        assert len(begun) == 6
        assert sum(count for _, count in begun) == size
        assert [start for start, _ in begun][:2] == [0, 0]
