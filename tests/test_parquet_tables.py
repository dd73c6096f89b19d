"""Tables of readings in Parquet files, for whoever reads tables."""

import gzip
import hashlib
import io
import sys

import pandas as pd
import pytest

import accelcal
from accelcal.cli.main import main

pytest.importorskip("pyarrow")

OF_FILE = ["source", "sha256", "line", "notes"]


@pytest.fixture
def rows():
    record = accelcal.simulate(seed=3)
    names = ("temperature", "position", "stroke", "output", "run", "mounting")
    return pd.DataFrame({"serial": "A-1", **{name: getattr(record, name) for name in names}})


@pytest.fixture
def path(rows, tmp_path):
    rows.rename(columns={"output": "output [mA]"}).to_parquet(tmp_path / "a.parquet")
    return tmp_path / "a.parquet"


@pytest.mark.parametrize("form", ["path", "open file", "gzip", "standard input"])
def test_a_table_of_readings_may_be_parquet(rows, path, form, monkeypatch):
    content = path.read_bytes()
    source = {
        "path": path,
        "open file": io.BytesIO(content),
        "gzip": io.BytesIO(gzip.compress(content)),
        "standard input": "-",
    }[form]
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))
    record = accelcal.read_table(source)
    assert (record.serial, record.unit) == ("A-1", "mA")
    for name in ("temperature", "position", "stroke", "output"):
        assert getattr(record, name).tolist() == rows[name].tolist()


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_durations_are_seconds(rows, tmp_path, unit):
    """Those of 54 s in nanoseconds were 54e9 s."""
    since = pd.to_timedelta(0.5 * rows.index, unit="s").astype(f"timedelta64[{unit}]")
    table = rows.rename(columns={"output": "output [mA]"})
    table.assign(time=since).to_parquet(tmp_path / "t.parquet")
    expected = since.to_numpy() / pd.Timedelta(1, "s")
    assert accelcal.read_table(tmp_path / "t.parquet").time.tolist() == expected.tolist()
    in_memory = accelcal.read_arrays(table.assign(time=since))
    assert in_memory.time.tolist() == expected.tolist()
    days = accelcal.read_arrays(table.assign(time=3600 * since))
    assert days.time.tolist() == (3600 * expected).tolist()
    table.assign(**{"time [ms]": since}).to_parquet(tmp_path / "t.parquet")
    with pytest.raises(
        accelcal.TableError, match=r"holds duration.*write numbers, or leave the un"
    ):
        accelcal.read_table(tmp_path / "t.parquet")


def test_its_digest_is_that_of_the_file_whoever_reads_it(path):
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert accelcal.read_table(path).sha256 == digest
    assert set(accelcal.batch(path).tables["sha256"]) == {digest}


def test_fit_and_batch_read_it_alike(path, rows, tmp_path):
    rows.to_csv(tmp_path / "a.csv", index=False)
    calibration = accelcal.fit(accelcal.read_table(path))
    found = accelcal.batch(path).tables
    assert found["K1"].tolist() == [table.coefficients["K1"].value for table in calibration.tables]
    text = accelcal.batch(tmp_path / "a.csv", overrides={"unit": "mA"}).tables
    pd.testing.assert_frame_equal(found.drop(columns=OF_FILE), text.drop(columns=OF_FILE))


def test_check_says_what_it_is(path, capsys):
    assert main(["check", str(path)]) == 0
    facts = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["form", "long"] in facts
    assert ["encoding", "parquet"] in facts


@pytest.mark.parametrize("damaged", [slice(900), slice(0, None, 2)], ids=["cut short", "rubbish"])
def test_a_damaged_file_is_one_line(path, capsys, damaged):
    path.write_bytes(b"PAR1" + path.read_bytes()[4:][damaged])
    assert main(["fit", str(path)]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith(f"{path}: no Parquet file (")
    assert said.endswith("; give one, or CSV")


def test_without_pyarrow_the_remedy_is_told(path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(accelcal.InputError, match="Parquet needs pyarrow; install it with"):
        accelcal.read_table(path)


@pytest.mark.parametrize(
    "arguments",
    [["fit", "{}"], ["history", "{}"], ["batch", "{}", "-o", "r.parquet"]],
    ids=["fit", "history", "batch"],
)
def test_without_pyarrow_the_same_is_told_everywhere(path, monkeypatch, capsys, arguments):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    assert main([argument.format(path) for argument in arguments]) == 2
    remedy = 'Parquet needs pyarrow; install it with: pip install "accelcal[parquet]"\n'
    assert capsys.readouterr().err.endswith(remedy)


def test_samples_may_be_parquet(path, rows, tmp_path):
    calibration = tmp_path / "c.json"
    accelcal.fit(accelcal.read_table(path)).to_json(calibration)
    assert main(["apply", str(calibration), str(path), "-o", str(tmp_path / "o.csv")]) == 0
    found = pd.read_csv(tmp_path / "o.csv", comment="#")
    assert len(found) == len(rows)
    assert found["acceleration"].between(-1.01, 1.01).all()
