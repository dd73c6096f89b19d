"""Batches: what goes in, what comes out, in which order, and that nothing is lost."""

import gzip
import io
import os
import random
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rows_of_calibrations import assert_rows_are_those_of_fits, warnings

import accelcal
from accelcal.archive import block, journal, parts, through, workers
from accelcal.archive.formats import LAWS, ROWS
from accelcal.archive.sources import find_sources
from accelcal.cli.main import main
from accelcal.errors import InputError
from accelcal.io.engines import exact_numbers
from accelcal.results.tabular import gate_column

ROOT = Path(__file__).parents[1]
PLAN = accelcal.TumblePlan(temperatures=(20.0,), strokes=2)
NOTHING = "note: no interrupted batch left anything to resume; all files were fitted"

read_csv = partial(pd.read_csv, **exact_numbers())


def write_archive(folder, count, plan=PLAN):
    folder.mkdir(parents=True, exist_ok=True)
    for seed in range(count):
        accelcal.write_table(
            accelcal.simulate(seed=seed + 1, plan=plan), folder / f"t{seed:03d}.csv"
        )
    return folder


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """Twelve good files in two folders, and one that is none."""
    folder = tmp_path_factory.mktemp("archive")
    write_archive(folder / "2024", 6)
    write_archive(folder / "2023", 6, accelcal.TumblePlan())
    (folder / "2024" / "t002x.csv").write_text("temperature,position\n20,1\n")
    (folder / "2024" / "readme.md").write_text("not a table")
    return folder


@pytest.fixture
def small_blocks(monkeypatch):
    monkeypatch.setattr(through, "LEAST_FILES", 2)


def content(path):
    """Bytes of all results of a batch."""
    stem = path.name.split(".")[0]
    return {p.name: p.read_bytes() for p in path.parent.glob(f"{stem}.*") if p.is_file()}


# -- rows ------------------------------------------------------------------------------------------


def test_rows_are_those_of_fit(archive):
    found = accelcal.batch([archive / "2023"])
    assert list(found.tables) == list(ROWS)
    assert list(found.laws) == list(LAWS)
    rows = iter(found.tables.to_dict("records"))
    for path in sorted((archive / "2023").glob("*.csv")):
        calibration = accelcal.fit(accelcal.read_table(path))
        for table in calibration.tables:
            row = next(rows)
            assert (row["source"], row["run"], row["mounting"]) == (str(path), table.run, "o+")
            for name, quantity in (*table.coefficients.items(), *table.error_model.items()):
                assert row[name] == pytest.approx(quantity.value, rel=1e-9, abs=1e-16)
                for part in ("standard_uncertainty", "expanded_uncertainty", "dof"):
                    expected = pytest.approx(getattr(quantity, part), rel=1e-9)
                    assert row[f"{name}_{part}"] == expected
            for gate in (*table.gates, *calibration.gates):
                assert row[gate_column(gate.name)] == gate.verdict
            assert (row["readings"], row["dof"]) == (table.readings, table.dof)
            assert row["residual_rms"] == pytest.approx(table.residual_rms, rel=1e-9)
            assert row["warnings"] == " | ".join(warnings(table, calibration))
            assert row["software"] == calibration.software
    assert next(rows, None) is None


def test_a_gate_that_warns_says_why(tmp_path):
    """The columns of the gates said "warn", and nothing what was found."""
    plan = accelcal.TumblePlan(temperatures=(20.0, 60.0))
    hidden = [accelcal.effect("warm-up").of(2e-4, tau=900.0), accelcal.effect("backlash").of(3e-5)]
    record = accelcal.simulate(plan=plan, effects=hidden, seed=1)
    accelcal.write_table(record, tmp_path / "disturbed.csv")
    accelcal.write_table(accelcal.simulate(plan=plan, seed=3), tmp_path / "quiet.csv")
    rows = accelcal.batch(tmp_path).tables
    for _, row in rows.iterrows():
        warned = [name for name in ROWS if name.startswith("gate_") and row[name] == "warn"]
        said = [part for part in row["warnings"].split(" | ") if part.startswith("gate ")]
        assert [gate_column(part[5:].split(": ")[0]) for part in said] == warned
        assert bool(said) == ("disturbed" in row["source"])
    assert "gate drift: from start to end of the run the bias moves by" in rows["warnings"][0]


def test_laws_are_those_of_fit(archive):
    laws = accelcal.batch([archive / "2023" / "t000.csv"]).laws
    model = accelcal.fit(accelcal.read_table(archive / "2023" / "t000.csv")).temperature_model
    for row, (term, quantity) in zip(laws.to_dict("records"), model.quantities(), strict=True):
        assert (row["coefficient"], row["unit"]) == (term, quantity.unit)
        for name in ("value", "standard_uncertainty", "expanded_uncertainty", "dof"):
            assert row[name] == pytest.approx(getattr(quantity, name), rel=1e-9)


def test_hysteresis_is_among_the_laws(tmp_path):
    plan = accelcal.TumblePlan(temperatures=(20.0, 60.0, 20.0, -20.0, 20.0))
    write_archive(tmp_path, 1, plan)
    assert "hysteresis" in set(accelcal.batch(tmp_path).laws["coefficient"])


def test_frames_know_their_units(archive):
    found = accelcal.batch(archive / "2024" / "t000.csv")
    assert found.tables.attrs["units"]["k0"] == "g"
    assert found.tables.attrs["units"]["K2_standard_uncertainty"] == "output_unit/g^2"
    assert found.laws.attrs["units"]["value"] == "unit"


def test_the_lot_of_a_unit_is_a_column(tmp_path):
    """It was lost: only the serial number told lots apart."""
    for name, line in (("a", "# lot: 7\n"), ("b", "# Партия: 7-Б\n"), ("c", "")):
        accelcal.write_table(accelcal.simulate(plan=PLAN, seed=1), tmp_path / f"{name}.csv")
        text = (tmp_path / f"{name}.csv").read_text("utf-8")
        (tmp_path / f"{name}.csv").write_text(line + text, "utf-8")
    tables = accelcal.batch(tmp_path).tables
    assert tables["lot"].drop_duplicates().tolist() == ["7", "7-Б", None]


def test_lots_of_units_stand_in_a_column_too(tmp_path):
    """They were set aside: results told the lot of a header line alone."""
    units = []
    for serial, lots in (("A", "007"), ("B", None), ("C", ["7", "8"])):
        accelcal.write_table(accelcal.simulate(plan=PLAN, seed=1), tmp_path / "one.csv")
        own = pd.read_csv(tmp_path / "one.csv", comment="#").assign(serial=serial)
        own["lot"] = np.resize(lots, len(own)) if isinstance(lots, list) else lots
        units.append(own)
    pd.concat(units).to_csv(tmp_path / "one.csv", index=False)
    found = accelcal.batch(tmp_path).tables.drop_duplicates("serial")
    assert found["lot"].tolist() == ["007", None, None]
    assert ["several for one unit, '7, 8'" in note for note in found["notes"]] == [0, 0, 1]
    units[0].to_csv(tmp_path / "one.csv", index=False)
    record = accelcal.read_table(tmp_path / "one.csv", overrides={"metadata": {"Los": "9"}})
    assert dict(record.metadata) == {"Los": "9"}
    assert "the lot is 9, as declared, in place of 007 in the column" in record.notes
    assert accelcal.read_table(tmp_path / "one.csv").metadata["lot"] == "007"
    units[0].rename(columns={"lot": "charge [pC]"}).to_csv(tmp_path / "one.csv", index=False)
    assert "lot" not in accelcal.read_table(tmp_path / "one.csv").metadata


def test_columns_are_explained():
    text = (ROOT / "docs" / "archives.md").read_text("utf-8")
    for name in (*ROWS, *LAWS):
        base = name.removesuffix("_dof").removesuffix("_standard_uncertainty")
        base = base.removesuffix("_expanded_uncertainty")
        assert f"`{base}`" in text, name


def test_a_data_sheet_is_judged(archive):
    from accelcal.io.toml.specification import read_specification

    sheet = read_specification(ROOT / "examples" / "al15.toml")
    rows = accelcal.batch(archive / "2023", specification=sheet).tables
    assert set(rows["verdict"]) <= {"pass", "fail", "undecided", "not tested"}


# -- what goes in ----------------------------------------------------------------------------------


def test_folders_files_and_globs(archive, monkeypatch):
    monkeypatch.chdir(archive)
    of_folder = [source.path for source in find_sources(["."])]
    assert of_folder == sorted(of_folder)
    assert len(of_folder) == 13
    of_glob = [source.path for source in find_sources(["20*/t00[01].csv"])]
    assert of_glob == ["2023/t000.csv", "2023/t001.csv", "2024/t000.csv", "2024/t001.csv"]
    both = find_sources(["2024/t001.csv", "2024"])
    assert [source.path for source in both][:2] == ["2024/t001.csv", "2024/t000.csv"]
    assert len(both) == 7


def test_compressed_and_other_forms(tmp_path):
    record = accelcal.simulate(seed=1, plan=PLAN)
    accelcal.write_table(record, tmp_path / "a.csv.gz")
    text = io.StringIO()
    accelcal.write_table(record, text)
    (tmp_path / "b.txt").write_text(text.getvalue().replace(",", "\t").replace(".", ","))
    (tmp_path / ".hidden.csv").write_text("no table")
    found = accelcal.batch(tmp_path)
    assert found.errors.empty
    assert found.tables["K1"].nunique() == 1
    assert len(found.tables) == 2


def test_urls_are_read_by_fsspec(archive):
    fsspec = pytest.importorskip("fsspec")
    store = fsspec.filesystem("memory")
    for path in (archive / "2024").glob("*.csv"):
        store.pipe_file(f"/lab/2024/{path.name}", path.read_bytes())
    here, there = accelcal.batch(archive / "2024"), accelcal.batch("memory://lab/2024")
    assert there.tables["source"][0] == "memory:///lab/2024/t000.csv"
    ours = ["source", "line"]
    pd.testing.assert_frame_equal(here.tables.drop(columns=ours), there.tables.drop(columns=ours))
    assert there.errors["message"][0].startswith("memory:///lab/2024/t002x.csv:1: no column for")
    assert len(accelcal.batch("memory://lab/2024/t00[01].csv").tables) == 2
    with pytest.raises(InputError, match="no such file or folder"):
        accelcal.batch("memory://lab/2020")


def test_an_error_is_the_line_of_fit(archive, run_cli):
    bad = str(archive / "2024" / "t002x.csv")
    errors = accelcal.batch(archive / "2024").errors
    assert list(errors["source"]) == [bad]
    assert run_cli("fit", bad).stderr.strip() == errors["message"][0]


def test_one_serial_that_cannot_be_fitted_costs_no_other(tmp_path):
    lines = ["serial,temperature,angle,stroke,output"]
    lines += [f"A,20,{45 * j},1,{np.cos(j)}" for j in range(8)]
    lines += ["B,20,90,1,0.1", "B,20,90,2,0.2"]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    found = accelcal.batch(tmp_path)
    assert list(found.tables["serial"]) == ["A"]
    assert found.errors["message"][0].startswith(f"{tmp_path}/a.csv:10: ")


# -- what comes out --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run_cli():
    def run(*arguments, **options):
        command = [sys.executable, "-m", "accelcal", *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, check=False, **options)

    return run


def test_the_command(archive, run_cli, tmp_path):
    done = run_cli("batch", archive, "-o", tmp_path / "r.csv")
    assert (done.returncode, done.stdout) == (1, "")
    said, left_out = done.stderr.splitlines()
    assert said == f"12 calibrations from 13 files; 1 error, see {tmp_path}/r.errors.csv"
    assert left_out.startswith("note: files with other endings are left out of folders: 1 *.md;")
    names = {"r.csv", "r.laws.csv", "r.errors.csv"}
    assert {path.name for path in tmp_path.iterdir()} == names
    assert run_cli("batch", archive / "2023", "-o", tmp_path / "s.csv").returncode == 0
    assert pd.read_csv(tmp_path / "s.errors.csv").empty


@pytest.mark.parametrize("name", ["r.csv", "r.csv.gz", "r.parquet"])
@pytest.mark.usefixtures("small_blocks")
def test_forms_hold_the_same(archive, tmp_path, name):
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    accelcal.write_batch(archive, tmp_path / name)
    read = pd.read_parquet if name.endswith("parquet") else read_csv
    for part, frame in zip(("", ".laws"), accelcal.batch(archive), strict=False):
        written = read(tmp_path / name.replace("r.", f"r{part}."))
        for column in frame:
            if pd.api.types.is_numeric_dtype(frame[column]):
                assert np.array_equal(
                    written[column].to_numpy(float), frame[column].to_numpy(float), equal_nan=True
                )
            else:
                one, other = (
                    own[column].where(own[column].notna(), "") for own in (written, frame)
                )
                assert list(map(str, one)) == list(map(str, other))


@pytest.mark.parametrize("name", ["r.csv", "r.csv.gz", "r.parquet"])
@pytest.mark.usefixtures("small_blocks")
def test_jobs_change_no_byte(archive, tmp_path, name):
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    for jobs in (1, 3):
        (tmp_path / str(jobs)).mkdir()
        accelcal.write_batch(archive, tmp_path / str(jobs) / name, jobs=jobs)
    assert content(tmp_path / "1" / name) == content(tmp_path / "3" / name)


def test_results_are_not_read_again(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_archive(tmp_path / "a", 3)
    for _ in range(2):
        assert main(["batch", "a", "-o", "a/r.csv"]) == 0
    assert len(pd.read_csv(tmp_path / "a" / "r.csv")) == 3
    assert main(["batch", "a", "-o", "other.csv"]) == 0
    assert "note: results of other batches are left out: a/r.csv, " in capsys.readouterr().err
    assert main(["batch", "a", "a/r.csv", "-o", "other.csv"]) == 1
    (told,) = pd.read_csv(tmp_path / "other.errors.csv")["message"]
    assert "results of accelcal batch, not a table of readings" in told


def test_no_bar_in_a_pipe(archive, run_cli, tmp_path):
    done = run_cli("batch", archive / "2023", "-o", tmp_path / "r.csv")
    assert done.stderr == "6 calibrations from 6 files\n"


# -- first use -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nofolder", "-o", "x.csv"], "error: nofolder: no such file or folder; give files,"),
        (["empty", "-o", "x.csv"], "error: empty: no table in it; batch takes *.csv, *.csv.gz,"),
        (["none*.csv", "-o", "x.csv"], "error: none*.csv: no table in it; batch takes"),
        (["-", "-o", "x.csv"], "error: - is standard input, which accelcal fit reads; batch"),
        (["a", "-o", "x.xlsx"], "error: x.xlsx: the name ends in none of .csv, .csv.gz, .par"),
        (["a", "-o", "no/x.csv"], "error: no/x.csv: its folder does not exist; create it or"),
        (["a", "-o", "s3://no/x.csv"], "error: s3://no/x.csv is a URL; name a file on this"),
        (["a/t000.csv", "-o", "a/t000.csv"], "error: a/t000.csv is a file to be read; name"),
        (["a", "-o", "x.csv", "--coefficients", "K9"], "error: "),
        (["a", "-o", "x.csv", "--head-uncertainty", "-1"], "error: invalid value for '--head-unc"),
        (["a", "-o", "x.csv", "--unit", "furlong"], "error: unit 'furlong' is no output unit; it"),
        (["bad", "-o", "x.csv"], "error: none of 1 file can be used, see x.errors.csv; first: bad"),
    ],
)
def test_wrong_use_is_one_line(tmp_path, monkeypatch, capsys, arguments, said):
    monkeypatch.chdir(tmp_path)
    write_archive(tmp_path / "a", 1)
    (tmp_path / "empty").mkdir()
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "a.csv").write_text("nothing")
    assert main(["batch", *arguments]) == 2
    told = capsys.readouterr().err
    assert told.startswith(said)
    assert told.count("\n") == 1
    assert not (tmp_path / "x.csv.journal").exists()


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (IndexError("index 3 is out"), "a bug in accelcal (IndexError: index 3 is out); please"),
        (MemoryError(), "memory is full; close other programs"),
    ],
)
def test_what_happens_to_one_file_ends_no_batch(archive, monkeypatch, error, told):
    def calibrate_many(*_):
        raise error

    monkeypatch.setattr(block, "calibrate_many", calibrate_many)
    found = accelcal.batch(archive / "2024" / "t000.csv")
    assert f"t000.csv: {told}" in found.errors["message"][0]


# -- interruptions ---------------------------------------------------------------------------------


def in_a_fork(function):
    """Call a function in a copy of this process; return its process id."""
    process = os.fork()
    if process:
        return process
    try:
        function()
    finally:
        os._exit(0)


def ended(process):
    return os.waitpid(process, os.WNOHANG)[0] == process


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize("name", ["r.csv", "r.parquet"])
@pytest.mark.usefixtures("small_blocks")
def test_a_hundred_kills_lose_nothing(tmp_path, name):
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    folder = write_archive(tmp_path / "a", 10)
    (folder / "t0035.csv").write_text("temperature,position\n")
    (tmp_path / "calm").mkdir()
    began = time.perf_counter()
    accelcal.write_batch(folder, tmp_path / "calm" / name)
    life = time.perf_counter() - began
    chance = random.Random(7)
    kills = 0
    while kills < 50:
        process = in_a_fork(lambda: accelcal.write_batch(folder, tmp_path / name, resume=True))
        time.sleep(chance.uniform(0.0, 0.8 * life))
        if ended(process):
            life *= 0.9  # it was not so long
            assert content(tmp_path / name) == content(tmp_path / "calm" / name)
            for path in tmp_path.glob("r.*"):
                path.unlink()
            continue
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        kills += 1
    accelcal.write_batch(folder, tmp_path / name, resume=True)
    assert content(tmp_path / name) == content(tmp_path / "calm" / name)
    assert {path.name for path in tmp_path.iterdir()} == {"a", "calm", *content(tmp_path / name)}


def listen():
    """Let SIGINT do what it does in a terminal."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def interrupt(folder, output, kind=signal.SIGKILL, *arguments):
    """Start a batch and end it after its first block; return what it said."""
    command = [sys.executable, "-m", "accelcal", "batch", folder, "-o", output, *arguments]
    process = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=listen,  # a run in the background has SIGINT ignored, and hands that on
    )
    journal = output.with_name(output.name + ".journal")
    while not any(journal.glob("*.block")):
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.005)
    process.send_signal(kind)
    return process.communicate()[1], process.returncode


@pytest.fixture(scope="module")
def long_archive(tmp_path_factory):
    return write_archive(tmp_path_factory.mktemp("long"), 120)


def test_an_interrupted_batch_is_not_taken_for_a_new_one(long_archive, tmp_path, run_cli):
    interrupt(long_archive, tmp_path / "r.csv", signal.SIGKILL, "--jobs", "1")
    refused = run_cli("batch", long_archive, "-o", tmp_path / "r.csv")
    assert refused.returncode == 2
    assert "an interrupted batch left its finished part in r.csv.journal; add" in refused.stderr
    assert run_cli("batch", long_archive, "-o", tmp_path / "r.csv", "--resume").returncode == 0
    accelcal.write_batch(long_archive, tmp_path / "s.csv")
    assert (tmp_path / "r.csv").read_bytes() == (tmp_path / "s.csv").read_bytes()


def test_ctrl_c_says_how_to_go_on(long_archive, tmp_path):
    said, code = interrupt(long_archive, tmp_path / "r.csv", signal.SIGINT, "--jobs", "2")
    assert code == 130
    assert said.strip() == (
        f"interrupted; what is finished is kept beside {tmp_path}/r.csv: go on with --resume"
    )


@pytest.mark.skipif(sys.platform == "win32", reason="groups of processes")
def test_ctrl_c_leaves_a_batch_in_the_background_alone(long_archive, tmp_path):
    command = [sys.executable, "-m", "accelcal", "batch", long_archive, "-o", tmp_path / "r.csv"]
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # as a script starts it by &
    try:
        process = subprocess.Popen([*map(str, command), "--jobs", "2"], start_new_session=True)
    finally:
        signal.signal(signal.SIGINT, before)
    while process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)
        time.sleep(0.002)
    assert process.returncode == 0


@pytest.mark.skipif(sys.platform != "linux", reason="needs fork")
def test_a_worker_killed_when_all_is_done_leaves_nobody_waiting():
    script = """
import os, signal, time
from accelcal.archive.workers import completed, workers

for victim in (0, 1, 0, 1, 0, 1):
    with workers(2, None) as (pool, count):
        tasks = [pool.submit(os.getpid) for _ in range(40)]
        pids = sorted({task.result() for task in tasks})
        os.kill(pids[min(victim, len(pids) - 1)], signal.SIGKILL)
print("ended")
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout == "ended\n", done.stderr


def test_a_pool_that_broke_while_it_took_a_task_is_told(monkeypatch):
    monkeypatch.setattr(workers, "_SECONDS", 0.01)

    class Broken(Executor):
        tasks = 0

        def submit(self, *_):
            self.tasks += 1
            if self.tasks > 3:
                raise BrokenProcessPool
            return Future()

    with pytest.raises(InputError, match="a worker was killed, most often for want of memory"):
        list(workers.completed(Broken(), abs, [1, 2], 1))


def test_tasks_are_looked_for_while_others_are_done():
    begun, found = [], []

    class Slow(Executor):
        def submit(self, function, task):
            begun.append((task, len(found)))
            future = Future()
            if len(begun) > 1:  # the first ends when there is nothing more to be found
                future.set_result(function(task))
            else:
                self.first = future
            return future

    executor = Slow()

    def tasks():
        for number in range(10):
            found.append(number)
            yield number
        executor.first.set_result(0)

    done = dict(workers.completed(executor, abs, tasks(), 1))
    assert done == {number: number for number in range(10)}
    assert begun[:3] == [(0, 1), (1, 2), (2, 3)]  # each is begun as soon as it is found
    assert [task for task, _ in begun] == list(range(10))


@pytest.mark.parametrize("times", [1, 2])
def test_ctrl_c_waits_while_a_lock_may_be_held_but_a_second_one_does_not(times):
    begun, done = [], []

    class Busy(Executor):
        def submit(self, _, task):
            begun.append(task)
            for _ in range(times if len(begun) == 1 else 0):
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(0.001)  # here the handler has been called
            done.append(task)
            return Future()

    heard = signal.default_int_handler  # a run in the background has SIGINT ignored
    before = signal.signal(signal.SIGINT, heard)
    try:
        with pytest.raises(KeyboardInterrupt):
            list(workers.completed(Busy(), abs, [1, 2, 3], 1))
        assert signal.getsignal(signal.SIGINT) is heard
    finally:
        signal.signal(signal.SIGINT, before)
    assert (begun, done) == (([1, 2], [1, 2]) if times == 1 else ([1], []))


@pytest.mark.parametrize("jobs", [1, 2])
def test_progress_counts_files_and_parts_of_large_ones(archive, tmp_path, monkeypatch, jobs):
    large = many_serials(tmp_path / "large.csv", [f"S{n:02d}" for n in range(20)])
    monkeypatch.setattr(parts, "LARGE", 6000)
    monkeypatch.setattr(parts, "PART", 3000)
    monkeypatch.setattr(through, "LEAST_FILES", 2)
    told = []
    accelcal.batch([archive, large], jobs=jobs, progress=lambda *counts: told.append(counts))
    files = len(list(archive.rglob("*.csv"))) + 1
    done, total = zip(*told, strict=True)
    assert done[0] == 0
    assert total[0] >= files
    assert list(done) == sorted(done)
    assert list(total) == sorted(total)
    assert done[-1] == total[-1] > files + 1


@pytest.mark.parametrize("least", [2, 25], ids=["several blocks", "one block"])
def test_readers_of_results_get_plain_text_and_units(archive, tmp_path, monkeypatch, least):
    monkeypatch.setattr(through, "LEAST_FILES", least)
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    accelcal.write_batch(archive, tmp_path / "r.parquet")
    accelcal.write_batch(archive, tmp_path / "r.csv")
    found = pq.read_table(tmp_path / "r.parquet")
    types = {"text": pa.string(), "number": pa.float64(), "whole": pa.int64(), "flag": pa.bool_()}
    assert found.schema.types == [types[column.kind] for column in ROWS.values()]
    units = {
        field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in found.schema
    }
    assert units == {column.name: column.unit for column in ROWS.values()}
    as_text = read_csv(tmp_path / "r.csv", dtype={"run": str, "date": str})
    for name in ("source", "run", "date", "line", "K1", "verdict", "robust"):
        cells = [None if cell != cell else cell for cell in as_text[name].tolist()]
        assert found[name].to_pylist() == cells


@pytest.mark.usefixtures("small_blocks")
def test_rows_do_not_travel_between_processes(archive, tmp_path, monkeypatch):
    from accelcal.archive.journal import GrowingResults

    came = []
    keep = GrowingResults.keep
    monkeypatch.setattr(
        GrowingResults, "keep", lambda self, block, out: (came.append(out), keep(self, block, out))
    )
    accelcal.write_batch(archive, tmp_path / "r.csv", jobs=2)
    assert len(came) > 1
    assert set(came) == {None}


@pytest.mark.usefixtures("small_blocks")
def test_frames_in_memory_come_as_files(archive, monkeypatch):
    from accelcal.archive import through

    came = []
    take = through.from_file
    monkeypatch.setattr(through, "from_file", lambda path: (came.append(path), take(path))[1])
    found, alone = accelcal.batch(archive, jobs=2), accelcal.batch(archive)
    assert len(came) > 1
    assert max(map(len, came)) < 500
    assert not any(Path(name).exists() for name in came)
    for one, other in zip(found, alone, strict=True):
        pd.testing.assert_frame_equal(one, other)


@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of files")
@pytest.mark.parametrize(
    ("jobs", "limit"),
    [("1", 10_000), ("2", 10_000), ("2", 100_000)],
    ids=["in a block", "in a block of a worker", "in the results"],
)
def test_a_full_disk_is_told_in_one_line(long_archive, tmp_path, run_cli, jobs, limit):
    import resource

    command = ["batch", str(long_archive), "-o", str(tmp_path / "r.csv"), "--jobs", jobs]
    done = subprocess.run(
        [sys.executable, "-m", "accelcal", *command],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    said = "r.csv.journal: the results cannot be written: File too large; make room, and go on with"
    assert said in done.stderr
    assert done.stderr.count("\n") == 1
    assert run_cli(*command, "--resume").returncode == 0


@pytest.mark.usefixtures("small_blocks")
def test_resume_takes_nothing_of_other_files_or_options(tmp_path):
    folder, output = write_archive(tmp_path / "a", 6), tmp_path / "r.csv"

    def stop_at(count):
        def progress(done, _):
            if done >= count:
                raise KeyboardInterrupt

        return progress

    def begin(**options):
        with pytest.raises(KeyboardInterrupt):
            accelcal.write_batch(folder, output, resume=True, progress=stop_at(4), **options)

    begin()
    accelcal.write_table(accelcal.simulate(seed=99, plan=PLAN), folder / "t001.csv")
    (note,) = accelcal.write_batch(folder, output, resume=True).notes
    assert note.startswith("1 of 2 blocks that an interrupted batch left were of other files")
    assert (read_csv(output)["K1"] == accelcal.batch(folder).tables["K1"]).all()
    begin(robust=True)
    counts = accelcal.write_batch(folder, output, resume=True)
    assert not pd.read_csv(output)["robust"].any()
    assert counts.notes == (
        "2 of 2 blocks that an interrupted batch left were of other files, options or another"
        " version of accelcal, or damaged; their files were fitted anew",
    )
    begin()
    assert accelcal.write_batch(folder, output, resume=True).notes == ()


def test_resume_tells_that_there_is_nothing_to_resume(archive, tmp_path, run_cli):
    command = ["batch", archive / "2024" / "t001.csv", "-o", tmp_path / "r.csv"]
    for options, notes in (([], []), (["--resume"], [NOTHING]), (["--resume"], [NOTHING])):
        done = run_cli(*command, *options)
        assert (done.returncode, done.stderr.splitlines()[1:]) == (0, notes)


def test_results_are_on_the_disk_before_they_take_their_names(archive, tmp_path, monkeypatch):
    fsync, brought = os.fsync, {}

    def bring(file):
        brought[os.fstat(file).st_ino] = sorted(tmp_path.glob("r.*"))
        fsync(file)

    monkeypatch.setattr(os, "fsync", bring)
    accelcal.write_batch(archive / "2024", tmp_path / "r.parquet")
    found = sorted(tmp_path.glob("r.*"))
    assert {path.stat().st_ino for path in found} == brought.keys()
    assert set(map(tuple, brought.values())) == {(tmp_path / "r.parquet.journal",)}


@pytest.mark.usefixtures("small_parts")
@pytest.mark.parametrize("repeated", [False, True])
def test_resume_of_a_large_table_of_which_all_is_finished(tmp_path, monkeypatch, repeated):
    serials = [f"S{n:02d}" for n in range(20)]
    serials[15] = "S03" if repeated else "S15"
    path, output = many_serials(tmp_path / "a.csv", serials), tmp_path / "r.csv"

    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(journal.Journal, "publish", stop)
        with pytest.raises(KeyboardInterrupt):
            accelcal.write_batch(path, output)
    counts = accelcal.write_batch(path, output, resume=True)
    assert (counts.fitted, len(counts.errors)) == ((18, 2) if repeated else (20, 0))
    accelcal.write_batch(path, tmp_path / "s.csv")
    for name, written in content(tmp_path / "s.csv").items():
        assert (tmp_path / name.replace("s.", "r.", 1)).read_bytes() == written


def test_two_at_once_are_refused(tmp_path, long_archive, run_cli):
    output = tmp_path / "r.csv"
    command = [sys.executable, "-m", "accelcal", "batch", long_archive, "-o", output]
    process = subprocess.Popen([*map(str, command), "--jobs", "1"], stderr=subprocess.DEVNULL)
    while not (tmp_path / "r.csv.journal" / "lock").exists():
        time.sleep(0.005)
    time.sleep(0.05)
    process.send_signal(signal.SIGSTOP)
    done = run_cli("batch", long_archive, "-o", output, "--resume")
    process.kill()
    process.wait()
    assert done.returncode == 2
    assert "another accelcal batch is writing it" in done.stderr


@pytest.mark.usefixtures("small_blocks")
def test_gzip_is_one_stream(archive, tmp_path):
    accelcal.write_batch(archive, tmp_path / "r.csv.gz")
    accelcal.write_batch(archive, tmp_path / "s.csv")
    assert gzip.decompress((tmp_path / "r.csv.gz").read_bytes()) == (
        (tmp_path / "s.csv").read_bytes()
    )


# -- large tables ----------------------------------------------------------------------------------


def many_serials(path, serials, header="# unit: mA\n"):
    """Write a table of many accelerometers, 18 readings each."""
    lines = [header + "serial,temperature,position,stroke,output"]
    for number, serial in enumerate(serials):
        record = accelcal.simulate(seed=number + 1, plan=PLAN)
        readings = zip(record.position, record.stroke, record.output, strict=True)
        lines += [f"{serial},20.0,{j},{k},{float(y)!r}" for j, k, y in readings]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def small_parts(monkeypatch):
    monkeypatch.setattr(parts, "LARGE", 3000)
    monkeypatch.setattr(parts, "PART", 1500)


def same_frames(a, b, *but):
    for one, other in zip(a, b, strict=True):
        aside = [name for name in but if name in one]
        pd.testing.assert_frame_equal(one.drop(columns=aside), other.drop(columns=aside))


def in_parts(monkeypatch, path, **options):
    with monkeypatch.context() as patched:
        patched.setattr(parts, "LARGE", 3000)
        patched.setattr(parts, "PART", 1500)
        assert len(parts.divide(*find_sources([str(path)]))) > 3
        return accelcal.batch(path, **options)


@pytest.mark.parametrize("odd", [False, True])
def test_parts_of_a_large_table_are_the_whole(tmp_path, monkeypatch, odd):
    path = many_serials(tmp_path / "a.csv", [f"S{n:02d}" for n in range(20)])
    if odd:  # a gap, a stroke 0 and a comment: the general reader has the rows of these serials
        lines = path.read_text().split("\n")
        lines[30] = ",".join([*lines[30].split(",")[:4], ""])
        lines[100] += "\n# pause"
        path.write_text("\n".join(lines))
    found = in_parts(monkeypatch, path)
    assert len(found.tables) == 20
    same_frames(found, accelcal.batch(path), "sha256", "notes")


def test_a_table_that_is_read_whole_is_fitted_in_parts(tmp_path, monkeypatch):
    path = many_serials(tmp_path / "a.csv", [f"S{n:02d}" for n in range(20)])
    expected = accelcal.batch(path)
    fitted = []
    calibrate = block.calibrate_many

    def noted(records, options):
        fitted.append(sum(map(len, records)))
        return calibrate(records, options)

    monkeypatch.setattr(block, "calibrate_many", noted)
    monkeypatch.setattr(block, "_AT_A_TIME", 60)
    found = accelcal.batch(path)
    assert max(fitted) <= 60
    assert len(fitted) > 5
    same_frames(found, expected)


def test_a_wrong_row_of_a_large_table_costs_one_serial(tmp_path, monkeypatch):
    path = many_serials(tmp_path / "a.csv", [f"S{n:02d}" for n in range(20)])
    lines = path.read_text().split("\n")
    lines[100] = lines[100].replace(",20.0,", ",warm,")
    path.write_text("\n".join(lines))
    found = in_parts(monkeypatch, path)
    assert len(found.tables) == 19
    told = "temperature 'warm' is not a number; write a number, or 'unknown' where it is not known"
    assert found.errors["message"].tolist() == [f"{path}:101: {told}"]


def test_parts_of_a_large_table_with_a_byte_order_mark(tmp_path, monkeypatch):
    path = many_serials(tmp_path / "a.csv", [f"S{n:02d}" for n in range(20)])
    lines = path.read_text().split("\n")
    lines[30] = ",".join([*lines[30].split(",")[:4], ""])
    path.write_text("\n".join(lines), "utf-8-sig")
    found = in_parts(monkeypatch, path)
    assert found.errors.empty
    same_frames(found, accelcal.batch(path), "sha256", "notes")


@pytest.mark.parametrize(
    ("after", "told"),
    [("\n# T0: 30", "102: header line 'T0: 30' inside the table"), ("\0", "101: a zero byte: the")],
)
def test_faults_in_a_part_are_told_with_their_line(tmp_path, monkeypatch, after, told):
    path = many_serials(tmp_path / "a.csv", [f"S{n:02d}" for n in range(20)])
    lines = path.read_text().split("\n")
    lines[100] += after
    path.write_text("\n".join(lines))
    (message,) = in_parts(monkeypatch, path).errors["message"]
    assert message.startswith(f"{path}:{told}")


def test_comments_in_a_part_are_told_with_their_line(tmp_path, monkeypatch):
    path = many_serials(tmp_path / "a.csv", [f"S{n:02d}" for n in range(20)])
    lines = path.read_text().split("\n")
    lines[100] += "\n# pause"
    path.write_text("\n".join(lines))
    notes = in_parts(monkeypatch, path).tables["notes"]
    assert "1 comment line was set aside (line 102)" in notes.tolist()


def test_a_serial_in_several_places_of_a_large_table_is_refused(tmp_path, monkeypatch):
    serials = [f"S{n:02d}" for n in range(20)]
    serials[15] = "S03"
    path = many_serials(tmp_path / "a.csv", serials)
    found = in_parts(monkeypatch, path)
    rows = path.read_text().split("\n")
    lines = [i + 1 for i in range(2, len(rows)) if rows[i].startswith("S03,")]
    assert [message.split(": ")[0] for message in found.errors["message"]] == [
        f"{path}:{lines[0]}",
        f"{path}:{next(b for a, b in pairwise(lines) if b - a > 1)}",
    ]
    assert found.errors["message"].str.contains("sort the rows by serial").all()
    assert set(found.tables["serial"]) == set(serials) - {"S03"}


def test_parquet_is_read_as_csv_is(tmp_path, monkeypatch):
    pytest.importorskip("pyarrow")
    path = many_serials(tmp_path / "a.csv", [f"S{n:02d}" for n in range(20)], header="")
    frame = pd.read_csv(path)
    frame.to_parquet(tmp_path / "a.parquet", row_group_size=50)
    expected = accelcal.batch(path)
    but = ("source", "line", "sha256")
    same_frames(accelcal.batch(tmp_path / "a.parquet"), expected, *but)
    same_frames(in_parts(monkeypatch, tmp_path / "a.parquet"), expected, *but)


def test_a_bug_of_the_quick_reader_costs_no_file(tmp_path, monkeypatch):
    for seed in range(3):
        accelcal.write_table(accelcal.simulate(seed=seed, plan=PLAN), tmp_path / f"{seed}.csv")
    expected = accelcal.batch(tmp_path)

    def broken(*_):
        raise IndexError

    monkeypatch.setattr(parts, "read_ordinary", broken)
    same_frames(accelcal.batch(tmp_path), expected)
    assert len(expected.tables) >= 3


@pytest.mark.usefixtures("small_parts")
def test_parts_by_several_jobs(tmp_path):
    path = many_serials(tmp_path / "a.csv", [f"S{n:02d}" for n in range(20)])
    for jobs in (1, 3):
        accelcal.write_batch(path, tmp_path / f"r{jobs}.csv", jobs=jobs)
    assert (tmp_path / "r1.csv").read_bytes() == (tmp_path / "r3.csv").read_bytes()


# -- rows from arrays ------------------------------------------------------------------------------

PLANS = (
    accelcal.TumblePlan(),
    accelcal.TumblePlan(temperatures=(20.0, 60.0, 20.0, -20.0, 20.0)),
    accelcal.TumblePlan(temperatures=(50.0, 90.0)),
    accelcal.TumblePlan(temperatures=(10.0, 40.0)),
    accelcal.TumblePlan(temperatures=(21.0, 23.5), strokes=1),
    accelcal.TumblePlan(temperatures=(20.0,), positions=4),
    accelcal.TumblePlan(mountings=("o+", "p+")),
    accelcal.TumblePlan(mountings=("o+", "o-")),
    accelcal.TumblePlan(mountings=("p+", "o+", "o-"), temperatures=(20.0, 60.0, 20.0), strokes=2),
)


@pytest.fixture(scope="module")
def files_of_plans(tmp_path_factory):
    """Two tables of each plan, which declare nothing."""
    folder = tmp_path_factory.mktemp("plans")
    for index, plan in enumerate(2 * PLANS):
        record = accelcal.simulate(seed=index, plan=plan).with_apparatus(
            head_uncertainty=None,
            launch_uncertainty=None,
            launch_sf_uncertainty=None,
            temperature_uncertainty=None,
        )
        accelcal.write_table(record, folder / f"{index:02d}.csv")
    return folder


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"robust": True},
        {"method": "closed-form"},
        {"method": "sign-corrected"},
        {"coefficients": ("K0", "K1", "K2", "M")},
        {"overrides": {"reference_temperature": 25.0, "temperature_uncertainty": 0.1}},
        {"overrides": {"head_uncertainty": 1e-5, "launch_uncertainty": 1e-5}},
        {"temperature_laws": "readings"},
        {"delta0": 0.001},
    ],
    ids=str,
)
def test_rows_are_those_of_calibrations(files_of_plans, options):
    found = assert_rows_are_those_of_fits(files_of_plans, 2 * len(PLANS), **options)
    assert len(found.tables) > 30


def test_a_record_that_fails_costs_no_other(tmp_path, monkeypatch):
    def stacked_tables(stack):
        if any(record.serial == "bad" for record in stack.plan.records):
            raise IndexError("index 3 is out of bounds")
        return tables_of(stack)

    tables_of = block.stacked_tables
    for index, serial in enumerate(("a", "bad", "c")):
        record = accelcal.simulate(seed=index, plan=PLANS[0])
        accelcal.write_table(replace(record, serial=serial), tmp_path / f"{index}.csv")
    monkeypatch.setattr(block, "stacked_tables", stacked_tables)
    found = accelcal.batch(tmp_path)
    assert (
        list(found.tables["serial"].unique()) == list(found.laws["serial"].unique()) == ["a", "c"]
    )
    assert found.errors["message"].tolist() == [
        f"{tmp_path / '1.csv'}: a bug in accelcal (IndexError: index 3 is out of bounds); please"
        " report it with this file"
    ]


@pytest.mark.parametrize("guarded", [True, False])
def test_a_script_beside_threads_needs_a_guard(tmp_path, guarded):
    """Processes are spawned then, and each reads the script."""
    write_archive(tmp_path / "in", 3)
    begin = "if __name__ == '__main__':" if guarded else "if True:"
    script = tmp_path / "script.py"
    script.write_text(
        "import threading\nimport accelcal\nfrom accelcal.archive import through\n"
        "through.LEAST_FILES = 1\n"
        f"{begin}\n"
        "    threading.Thread(target=threading.Event().wait, daemon=True).start()\n"
        "    print(len(accelcal.batch('in', jobs=2).tables))\n"
    )
    done = subprocess.run(
        [sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    if guarded:
        assert (done.returncode, done.stdout, done.stderr) == (0, "3\n", "")
    else:
        assert done.returncode == 1
        # Python may tell behind it what the processes have left
        (told,) = re.findall(r"^accelcal\.errors\.InputError: (.*)$", done.stderr, re.MULTILINE)
        assert "if __name__ == '__main__':, which" in told
