"""Archives as they are: links to nowhere, pipes, rubbish, readings where the results would go."""

import errno
import inspect
import multiprocessing
import os
import shutil
import sys
import time
from contextlib import contextmanager
from dataclasses import replace
from itertools import cycle
from operator import add
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

import accelcal
from accelcal.archive import block, journal, parts, through
from accelcal.archive.block import Block
from accelcal.archive.journal import Journal
from accelcal.archive.settings import Settings
from accelcal.archive.sources import find_sources
from accelcal.cli.main import main
from accelcal.errors import AccelcalError, InputError

EXAMPLE = Path(__file__).parents[1] / "examples" / "al15.csv"


@pytest.fixture
def archive(tmp_path):
    folder = tmp_path / "archive"
    folder.mkdir()
    for name in ("a.csv", "b.csv"):
        shutil.copy(EXAMPLE, folder / name)
    return folder


def table(**columns):
    """Rows of the example for a Parquet file."""
    rows = pd.read_csv(EXAMPLE, comment="#").rename(columns={"output": "output [mA]"})
    return rows.assign(**columns)


# -- files that are none ---------------------------------------------------------------------------


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs links and pipes")
@pytest.mark.parametrize("pattern", ["", "*", "*.csv"])
def test_a_lost_file_costs_no_other(archive, pattern):
    (archive / "loop.csv").symlink_to("loop.csv")
    (archive / "nowhere.csv").symlink_to("gone.csv")
    os.mkfifo(archive / "pipe.csv")  # from which nothing ever comes
    found = accelcal.batch(archive / pattern)
    assert found.tables["source"].nunique() == 2
    assert [Path(source).name for source in found.errors["source"]] == ["loop.csv", "nowhere.csv"]
    assert found.errors["message"].str.startswith(str(archive)).all()


LEFT_OUT = (
    "files with other endings are left out of folders: 2 *.lvm, 1 without any and 1 *.zip; give"
    " those that are tables by name or glob"
)


def test_files_with_other_endings_are_counted(archive, tmp_path, capsys):
    """They were lost without a word."""
    names = ("a.lvm", "b.LVM", "tests.csv.zip", "README", ".hidden.dat", "r.csv.journal/1.block")
    for name in names:
        (archive / "below" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(EXAMPLE, archive / "below" / name)
    assert accelcal.batch([archive, archive / "below/.."]).tables.attrs["notes"] == [LEFT_OUT]
    assert main(["batch", str(archive), "-o", str(tmp_path / "results.csv")]) == 0
    assert f"note: {LEFT_OUT}" in capsys.readouterr().err
    given = accelcal.batch(archive / "below/*.lvm").tables
    assert given["source"].nunique() == 1
    assert given.attrs["notes"] == []
    beside = accelcal.batch([archive, archive / "below/*.lvm", archive / "below/b.LVM"]).tables
    assert beside.attrs["notes"] == [LEFT_OUT.replace("2 *.lvm, ", "")]


@pytest.mark.parametrize("target", ["old.csv", "old.csv.gz", "old.parquet"])
def test_results_of_another_batch_are_left_out_of_a_folder(archive, target):
    """Each was told as a file with errors, so that a second batch ended with code 1."""
    accelcal.write_batch(archive, archive / target)
    shutil.copy(EXAMPLE, archive / "mine.errors.csv")
    for pattern in ("", "*"):
        found = accelcal.batch(archive / pattern)
        (note,) = found.tables.attrs["notes"]
        assert note.startswith("results of other batches are left out: ")
        assert note.count("old.") == 3
        assert found.errors.empty
        assert "mine.errors.csv" in map(os.path.basename, found.tables["source"])


def test_a_file_of_two_names_counts_once(archive):
    """Its rows came twice; fit refuses it."""
    names = sorted(path.name for path in archive.glob("*.csv"))
    (archive / "z.csv").symlink_to(names[0])
    for paths in (archive, [archive / names[0], archive / "z.csv", archive / names[1]]):
        found = accelcal.batch(paths).tables
        assert found["source"].nunique() == len(names)
        (note,) = found.attrs["notes"]
        assert (
            note == f"files of two names count once: {archive / 'z.csv'} (as {archive / names[0]})"
        )


def test_a_link_before_its_file_does_not_take_its_place(archive):
    """The rows had the name of the link, and lost that of the file."""
    before = accelcal.batch(archive).tables["source"].unique()
    (archive / "0.csv").symlink_to(Path(before[0]).name)
    found = accelcal.batch(archive).tables
    assert list(found["source"].unique()) == list(before)
    note = f"files of two names count once: {archive / '0.csv'} (as {before[0]})"
    assert found.attrs["notes"] == [note]


def test_a_folder_of_other_endings_alone_says_how_to_give_them(tmp_path):
    (tmp_path / "a.lvm").write_bytes(EXAMPLE.read_bytes())
    told = r"no table in it; files with other endings .*: 1 \*\.lvm; give .* by name or glob"
    with pytest.raises(InputError, match=told):
        accelcal.batch(tmp_path)


def test_objects_with_other_endings_are_counted():
    fsspec = pytest.importorskip("fsspec")
    for name in ("a.csv", "b.dat"):
        fsspec.filesystem("memory").pipe_file(f"/others/{name}", EXAMPLE.read_bytes())
    (note,) = accelcal.batch("memory://others").tables.attrs["notes"]
    assert "left out of folders: 1 *.dat;" in note
    given = accelcal.batch(["memory://others", "memory://others/*.dat"]).tables
    assert given.attrs["notes"] == []


@pytest.mark.parametrize("pattern", ["", "/*", "/**", "/**/*.csv"])
def test_folders_of_a_store_are_read_as_those_of_a_disk(tmp_path, pattern):
    """What is hidden was read, and of a glob the folders were told as files that cannot be read."""
    store = pytest.importorskip("fsspec").filesystem("memory")
    for name in ("a.csv", "2024/b.csv", "2024/.c.csv", ".d/e.csv", "r.csv.journal/f.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(EXAMPLE, tmp_path / name)
        store.pipe_file(f"/alike/{name}", EXAMPLE.read_bytes())
    here, there = (accelcal.batch(f"{at}{pattern}") for at in (tmp_path, "memory://alike"))
    read = {name.removeprefix("memory:///alike/") for name in there.tables["source"]}
    assert read == {Path(name).relative_to(tmp_path).as_posix() for name in here.tables["source"]}
    assert read == {"a.csv", "2024/b.csv"}
    assert there.errors.empty


@pytest.fixture
def locked(archive, monkeypatch):
    """An archive with two folders that may not be read, not even by an administrator."""
    scandir = os.scandir

    def refusing(path):
        if Path(path).name.startswith("locked"):
            raise PermissionError(errno.EACCES, "Permission denied", path)
        return scandir(path)

    for name in ("locked-2", "locked-1"):
        (archive / "below" / name).mkdir(parents=True)
        shutil.copy(EXAMPLE, archive / "below" / name / "a.csv")
    monkeypatch.setattr(os, "scandir", refusing)
    return archive


UNREADABLE = (
    "the folder cannot be read (Permission denied); ask for the permission, or name what can be"
    " read"
)


@pytest.mark.parametrize("pattern", ["", "*"])
def test_a_folder_that_cannot_be_read_costs_no_other(locked, pattern):
    found = accelcal.batch(locked / pattern)
    assert found.tables["source"].nunique() == 2
    names = [str(locked / "below" / name) for name in ("locked-1", "locked-2")]
    assert found.errors["source"].tolist() == names
    assert found.errors["message"].tolist() == [f"{name}: {UNREADABLE}" for name in names]


def test_a_folder_that_cannot_be_read_is_told_whenever_the_batch_runs(
    locked, tmp_path, capsys, monkeypatch
):
    (locked / "bad.csv").write_text("no table")
    output = tmp_path / "r.csv"

    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Journal, "publish", stop)
        assert main(["batch", str(locked), "-o", str(output)]) == 130
    assert main(["batch", str(locked), "-o", str(output), "--resume"]) == 1
    said = capsys.readouterr().err.splitlines()[-1]
    assert said == "2 calibrations from 3 files; 3 errors, see " + str(tmp_path / "r.errors.csv")
    told = pd.read_csv(tmp_path / "r.errors.csv")
    assert [Path(name).name for name in told["source"]] == ["locked-1", "locked-2", "bad.csv"]
    assert told["message"][0] == f"{locked / 'below' / 'locked-1'}: {UNREADABLE}"


@pytest.mark.parametrize("name", ["below", "below/locked-1"])
def test_a_path_that_holds_nothing_to_be_read_is_refused(locked, name):
    with pytest.raises(InputError, match=r"locked-1: the folder cannot be read \(Permission deni"):
        accelcal.batch([locked, locked / name])


def test_an_empty_folder_is_not_told_by_another_that_cannot_be_read(locked, tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"empty: no table in it; batch takes"):
        accelcal.batch([locked, tmp_path / "empty"])


def test_folders_may_be_deep(tmp_path):
    depth, before = 200, sys.getrecursionlimit()
    inside = tmp_path.joinpath(*["d"] * depth)
    inside.mkdir(parents=True)
    shutil.copy(EXAMPLE, inside / "a.csv")
    sys.setrecursionlimit(len(inspect.stack()) + depth // 2)
    try:
        (found,) = find_sources([str(tmp_path)])
    finally:
        sys.setrecursionlimit(before)
    assert found.path == str(inside / "a.csv")


@pytest.mark.skipif(sys.platform == "win32", reason="has no such pipes")
def test_a_pipe_is_no_file_of_an_archive(archive):
    os.mkfifo(archive / "pipe")
    with pytest.raises(InputError, match="pipe is a pipe or device, which accelcal fit reads; ba"):
        accelcal.batch(archive / "pipe")
    assert accelcal.batch(archive).tables["source"].nunique() == 2


def test_large_rubbish_costs_no_other(archive, monkeypatch):
    monkeypatch.setattr(parts, "LARGE", 4000)
    (archive / "rubbish.parquet").write_bytes(bytes(range(256)) * 20)
    found = accelcal.batch(archive)
    assert found.tables["source"].nunique() == 2
    (message,) = found.errors["message"]
    assert message.startswith(f"{archive / 'rubbish.parquet'}:1: a zero byte: the file is damaged")


def test_a_file_that_vanishes_costs_no_other(archive, monkeypatch):
    monkeypatch.setattr(parts, "LARGE", 4000)
    listed = parts.ordinary_head

    def vanishing(data):
        (archive / "b.csv").unlink(missing_ok=True)
        return listed(data)

    monkeypatch.setattr(parts, "ordinary_head", vanishing)
    found = accelcal.batch(archive)
    assert found.tables["source"].unique().tolist() == [str(archive / "a.csv")]
    assert found.errors["message"].str.startswith(str(archive / "b.csv")).tolist() == [True]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"jobs": 0}, "jobs is 0; it is a whole number, 1 or more"),
        ({"jobs": "2"}, "jobs is '2'; it is a whole number, 1 or more"),
        ({"paths": []}, "no path is given; give files, folders or globs"),
        ({"coefficients": ["K9"]}, "coefficient 'K9' is unknown; choose from K0, K1"),
        ({"coefficients": ["K0"]}, "K1 is not among the coefficients asked for"),
    ],
)
def test_wrong_arguments_are_told_before_any_file(archive, tmp_path, wrong, said):
    arguments = {"paths": archive, **wrong}
    with pytest.raises(AccelcalError, match=f"^{said}"):
        accelcal.batch(**arguments)
    with pytest.raises(AccelcalError, match=f"^{said}"):
        accelcal.write_batch(target=tmp_path / "r.csv", **arguments)
    assert [path.name for path in tmp_path.iterdir()] == ["archive"]


# -- Parquet with any text -------------------------------------------------------------------------


@pytest.mark.parametrize("serial", ["A,1", 'A"1', "'A'", "A;1"])
def test_serials_of_parquet_may_hold_any_sign(archive, serial):
    pytest.importorskip("pyarrow")
    table(serial=serial).to_parquet(archive / "c.parquet")
    found = accelcal.batch(archive)
    assert found.errors.empty
    assert found.tables["serial"].tolist()[6:] == [serial] * 3
    assert found.tables["K1"].tolist()[6:] == pytest.approx(found.tables["K1"].tolist()[:3])


def test_a_comma_in_a_heading_of_parquet_moves_no_column(archive):
    pytest.importorskip("pyarrow")
    rows = table()
    rows.insert(0, "who, when", "me")
    rows.to_parquet(archive / "c.parquet")
    found = accelcal.batch(archive)
    assert found.tables["K1"].tolist()[6:] == pytest.approx(found.tables["K1"].tolist()[:3])


def test_lists_in_parquet_are_refused(archive):
    pytest.importorskip("pyarrow")
    rows = table()
    rows["raw"] = [[1, 2]] * len(rows)
    rows.to_parquet(archive / "c.parquet")
    (message,) = accelcal.batch(archive).errors["message"]
    assert message.startswith(f"{archive / 'c.parquet'}: column 'raw' holds list<")
    assert message.endswith("leave it out, or give one value a row")


@pytest.mark.parametrize("form", ["csv", "parquet"])
@pytest.mark.parametrize("last", [True, False])
def test_quotes_in_parts_of_a_large_table(tmp_path, monkeypatch, form, last):
    pytest.importorskip("pyarrow")
    path = tmp_path / f"large.{form}"
    units = [table(serial=f"A,{n}") for n in range(6)]
    rows = pd.concat(units).astype({"run": str})
    rows["run"] = "20, " + rows["run"]
    rows = rows if last else rows[["serial", *rows.columns[:-1]]]
    rows.to_csv(path, index=False) if form == "csv" else rows.to_parquet(path, index=False)
    whole = accelcal.batch(path)
    monkeypatch.setattr(parts, "LARGE", 1)
    monkeypatch.setattr(parts, "PART", 9000)
    found = accelcal.batch(path)
    assert found.errors.empty
    assert found.tables[["serial", "run", "line"]].equals(whole.tables[["serial", "run", "line"]])
    assert found.tables["K1"].tolist() == pytest.approx(whole.tables["K1"].tolist())


@pytest.mark.parametrize(
    "ends", [["\r"], ["\r", "\n"], ["\n", "\r", "\r\n"], ["\r\n"], ["\n"] * 40 + ["\r"]]
)
def test_lines_of_a_large_table_are_those_of_an_editor(tmp_path, monkeypatch, ends):
    rows = pd.concat([table(serial=f"A{n}") for n in range(6)], ignore_index=True).astype(object)
    rows.loc[600, "temperature"] = "20x"
    lines = rows.to_csv(index=False).splitlines()
    path = tmp_path / "large.csv"
    path.write_text("".join(map(add, lines, cycle(ends))), newline="")
    assert len(path.read_text().splitlines()) == len(lines)  # universal newlines, as editors count
    monkeypatch.setattr(parts, "LARGE", 1)
    monkeypatch.setattr(parts, "PART", 9000)
    (message,) = accelcal.batch(path).errors["message"]
    assert message.startswith(f"{path}:602: temperature '20x' is not a number")


def named(folder, name):
    """Path of a name of bytes in a folder."""
    return Path(os.fsdecode(os.fsencode(folder) + b"/" + name))


@pytest.fixture
def foreign(tmp_path):
    """A folder with a table, and one that is none, whose names are not UTF-8."""
    if sys.platform in ("win32", "darwin"):
        pytest.skip("names are Unicode there")
    folder = tmp_path / "archive"
    folder.mkdir()
    shutil.copy(EXAMPLE, named(folder, b"M\xfcller.csv"))
    named(folder, b"bad\xff.csv").write_text("rubbish\n")
    return folder


@pytest.mark.parametrize("form", ["csv", "csv.gz", "parquet"])
def test_names_that_are_not_utf_8_are_shown_by_their_bytes(foreign, tmp_path, form, capsys):
    if form == "parquet":
        pytest.importorskip("pyarrow")
    output = tmp_path / f"r.{form}"
    assert main(["batch", str(foreign), "-o", str(output)]) == 1
    read = pd.read_parquet if form == "parquet" else pd.read_csv
    assert set(read(output)["source"]) == {str(foreign / r"M\xfcller.csv")}
    (error,) = pd.read_csv(tmp_path / "r.errors.csv").to_dict("records")
    assert error["source"] == str(foreign / r"bad\xff.csv")
    assert error["message"].startswith(error["source"] + ":1: no column headings")
    capsys.readouterr()
    assert main(["fit", str(named(foreign, b"bad\xff.csv"))]) == 2
    assert capsys.readouterr().err == error["message"] + "\n"


def test_a_frame_has_the_names_that_open_the_files(foreign):
    found = accelcal.batch(foreign)
    paths = [*found.tables["source"], *found.errors["source"]]
    assert all(Path(path).is_file() for path in paths)


def test_a_calibration_of_such_a_name_can_be_applied(foreign, tmp_path, capsys):
    path, calibration = named(foreign, b"M\xfcller.csv"), named(tmp_path, b"cal\xff.json")
    assert main(["fit", str(path), "-o", str(calibration)]) == 0
    assert accelcal.Calibration.from_json(calibration).source == str(foreign / r"M\xfcller.csv")
    samples = tmp_path / "s.csv"
    samples.write_text("temperature,output\n20,1.3\n")
    capsys.readouterr()
    assert main(["apply", str(calibration), str(samples)]) == 0
    assert r"cal\xff.json" in capsys.readouterr().out


# -- where the results go --------------------------------------------------------------------------


@pytest.mark.parametrize("pattern", ["", "*.csv"])
@pytest.mark.parametrize("name", ["b.csv", "c.laws.csv", "c.errors.csv"])
def test_readings_are_not_overwritten(archive, name, pattern):
    path = archive / name
    shutil.copy(EXAMPLE, path)
    output = archive / name.replace(".laws", "").replace(".errors", "")
    with pytest.raises(InputError, match=r"the results would overwrite .*; name another file"):
        accelcal.write_batch(archive / pattern, output)
    assert path.read_bytes() == EXAMPLE.read_bytes()


def test_readings_of_another_place_are_not_overwritten(archive, tmp_path):
    """A table that is not of the archive was lost without a word."""
    shutil.copy(EXAMPLE, tmp_path / "readings.csv")
    with pytest.raises(InputError, match=r"readings.csv, which is none of a batch; name another"):
        accelcal.write_batch(archive, tmp_path / "readings.csv")
    assert (tmp_path / "readings.csv").read_bytes() == EXAMPLE.read_bytes()


@pytest.mark.parametrize("name", ["r.csv", "r.csv.gz", "r.parquet"])
def test_results_are_overwritten(archive, name):
    pytest.importorskip("pyarrow")
    (archive / name).touch()
    accelcal.write_batch(archive, archive / name)
    first = (archive / name).read_bytes()
    counts = accelcal.write_batch(archive, archive / name)
    assert counts.files == 2
    assert (archive / name).read_bytes() == first


def test_results_behind_a_link(archive, tmp_path):
    (archive / "r.csv").symlink_to(tmp_path / "far.csv")
    for _ in range(2):
        assert accelcal.write_batch(archive, archive / "r.csv").files == 2
    assert len(pd.read_csv(tmp_path / "far.csv")) == 6


@pytest.mark.parametrize("name", ["r.csv", "r.laws.csv", "r.errors.csv"])
def test_what_cannot_be_written_is_told_before_the_work(archive, tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(InputError, match=f"{name} is a folder; name a file in it"):
        accelcal.write_batch(archive, tmp_path / "r.csv")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["archive", name]


@pytest.mark.skipif(os.name != "posix", reason="needs permissions of the group")
def test_an_existing_result_keeps_its_permissions(archive, tmp_path):
    path = tmp_path / "r.csv"
    path.touch()
    path.chmod(0o640)
    accelcal.write_batch(archive, path)
    assert path.stat().st_mode & 0o777 == 0o640


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes")
def test_a_pipe_is_not_replaced(archive, tmp_path):
    os.mkfifo(tmp_path / "r.csv")
    with pytest.raises(InputError, match=r"r\.csv is a device or a pipe; name a file"):
        accelcal.write_batch(archive, tmp_path / "r.csv")
    assert (tmp_path / "r.csv").is_fifo()


def test_names_that_cannot_be_made(archive, tmp_path):
    (tmp_path / "r.csv.journal").touch()
    for name in ("r.csv", f"{'y' * 250}.csv"):
        with pytest.raises(InputError, match=r"cannot be made .*; remove what is in the way, or"):
            accelcal.write_batch(archive, tmp_path / name)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full disk")
@pytest.mark.parametrize("form", ["csv", "csv.gz", "parquet"])
@pytest.mark.parametrize("name", ["tables", "laws", "errors"])
def test_a_full_disk_is_told_whatever_it_refuses(archive, tmp_path, monkeypatch, form, name):
    pytest.importorskip("pyarrow")

    def full(self, draft):
        return Path("/dev/full") if draft == name else self.folder / f"draft-{draft}"

    monkeypatch.setattr(Journal, "_draft", full)
    with pytest.raises(InputError, match="No space left on device; make room, and go on with"):
        accelcal.write_batch(archive, tmp_path / f"r.{form}")


@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of the size of files")
@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_a_disk_that_refuses_the_end_of_the_results_as_well(archive, tmp_path, monkeypatch, form):
    resource = pytest.importorskip("resource")
    pytest.importorskip("pyarrow")
    monkeypatch.setattr(through, "LEAST_FILES", 1)
    in_memory = {}

    def keep(self, block, outcome):
        if in_memory:
            raise InputError("no room for a block")
        in_memory[self.path(block)] = outcome

    monkeypatch.setattr(Journal, "keep", keep)
    monkeypatch.setattr(Journal, "finished", lambda _, path: in_memory[path])
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        with pytest.raises(InputError, match=r"no room for a block|File too large; make room, and"):
            accelcal.write_batch(archive, tmp_path / f"r.{form}")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@pytest.mark.parametrize("done", [0, 1])
def test_a_disk_that_is_full_in_a_block_is_told_and_gone_on_with(
    archive, tmp_path, monkeypatch, done
):
    monkeypatch.setattr(through, "LEAST_FILES", 1)
    output = tmp_path / "r.csv"
    room = iter([True] * done)
    replacing = journal.replacing

    @contextmanager
    def full(target, **options):
        with replacing(target, **options) as file:
            yield file
            if not next(room, False):
                raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(journal, "replacing", full)
        with pytest.raises(InputError, match="No space left on device; make room, and go on with"):
            accelcal.write_batch(archive, output)
    left = list(tmp_path.glob("r.csv.journal/*"))
    assert [path.suffix for path in left if path.suffix] == [".block"] * done
    assert accelcal.write_batch(archive, output, resume=True).fitted == 2
    accelcal.write_batch(archive, tmp_path / "whole.csv")
    assert output.read_bytes() == (tmp_path / "whole.csv").read_bytes()


def test_rows_that_cannot_be_handed_over_are_told(archive, monkeypatch):
    def full(**_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(block, "NamedTemporaryFile", full)
    files = Block(tuple(find_sources([str(archive)])))
    with pytest.raises(InputError, match=r"^tmp: finished .* No space left on device"):
        block.fit_to_file(files, Settings(), "tmp")


def test_results_on_another_file_system(archive, tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "replace", _elsewhere(Path.replace))
    accelcal.write_batch(archive, tmp_path / "r.csv")
    assert len(pd.read_csv(tmp_path / "r.laws.csv")) == 18
    assert not (tmp_path / "r.csv.journal").exists()


def _elsewhere(replace):
    def refusing(self, target):
        if self.name.startswith("draft-"):
            raise OSError(18, "Invalid cross-device link")
        return replace(self, target)

    return refusing


@pytest.mark.parametrize(
    "damaged",
    [
        lambda _: b"",
        lambda content: content[:20],
        lambda content: content[:-1],
        lambda content: content[:-1000] + bytes(1000),
        lambda content: content.replace(b'"fitted": ', b'"fitted": 1', 1),
    ],
    ids=["lost", "begun", "cut", "zeros", "head"],
)
def test_a_damaged_block_is_fitted_anew(archive, tmp_path, monkeypatch, damaged):
    monkeypatch.setattr(through, "LEAST_FILES", 1)

    def stop(done, _):
        if done:
            raise KeyboardInterrupt

    calm = accelcal.write_batch(archive, tmp_path / "calm.csv")
    with pytest.raises(KeyboardInterrupt):
        accelcal.write_batch(archive, tmp_path / "r.csv", progress=stop)
    (block,) = (tmp_path / "r.csv.journal").glob("*.block")
    block.write_bytes(damaged(block.read_bytes()))
    resumed = accelcal.write_batch(archive, tmp_path / "r.csv", resume=True)
    assert resumed._replace(notes=resumed.notes[1:]) == calm
    assert "1 of 1 block that" in resumed.notes[0]
    assert "or damaged; their files were fitted anew" in resumed.notes[0]
    assert (tmp_path / "r.csv").read_bytes() == (tmp_path / "calm.csv").read_bytes()


# -- other threads and processes -------------------------------------------------------------------


def test_results_are_written_by_one_thread_at_a_time(archive, tmp_path):
    output = tmp_path / "r.csv"

    def begin_again(*_):
        with pytest.raises(InputError, match=r"r.csv: another accelcal batch is writing it; wait"):
            accelcal.write_batch(archive, output)

    assert accelcal.write_batch(archive, output, progress=begin_again).fitted == 2
    assert accelcal.write_batch(archive, output).fitted == 2


def test_a_batch_ends_no_process_but_its_own(archive, monkeypatch):
    monkeypatch.setattr(through, "LEAST_FILES", 1)
    others = []

    def start_another(*_):
        others.append(multiprocessing.get_context("spawn").Process(target=time.sleep, args=(600,)))
        others[-1].start()

    accelcal.batch(archive, jobs=2, progress=start_another)
    try:
        others[0].join(0.5)
        assert all(other.is_alive() for other in others)
    finally:
        for other in others:
            other.kill()
            other.join()


def test_a_worker_of_a_pool_is_told_to_work_alone(archive, monkeypatch):
    monkeypatch.setattr(through, "LEAST_FILES", 1)
    monkeypatch.setattr(multiprocessing, "current_process", lambda: SimpleNamespace(daemon=True))
    with pytest.raises(InputError, match="jobs is 2 in a worker of a pool, which has none; give"):
        accelcal.batch(archive, jobs=2)


# -- serial numbers that look alike ----------------------------------------------------------------

ALIKE = "serials 'AL-15', 'al-15' count as 2 units; if they are one, write them in one way"


@pytest.fixture
def alike(tmp_path, monkeypatch):
    """One unit in two files, whose headers write its serial number in two ways."""
    monkeypatch.chdir(tmp_path)
    Path("two").mkdir()
    plan = accelcal.TumblePlan(temperatures=(20.0,), strokes=2)
    for seed, serial in enumerate(("AL-15", "al-15", "AL-16")):
        record = replace(accelcal.simulate(seed=seed, plan=plan), serial=serial)
        accelcal.write_table(record, f"two/{seed}.csv")


@pytest.mark.usefixtures("alike")
@pytest.mark.parametrize("size", [1, 25])
def test_files_whose_serials_differ_in_case_alone_are_told_by_batch(capsys, monkeypatch, size):
    """They were two units without a word, as their files knew nothing of each other."""
    monkeypatch.setattr(through, "LEAST_FILES", size)
    assert accelcal.batch("two").tables.attrs["notes"] == [ALIKE]
    assert accelcal.batch("two/0.csv").tables.attrs["notes"] == []
    assert main(["batch", "two", "-o", "results.csv", "--jobs", "1"]) == 0
    assert capsys.readouterr().err == f"3 calibrations from 3 files\nnote: {ALIKE}\n"


@pytest.mark.usefixtures("alike")
def test_a_resumed_batch_tells_of_serials_of_finished_blocks(monkeypatch):
    monkeypatch.setattr(through, "LEAST_FILES", 1)
    with monkeypatch.context() as broken:
        broken.setattr(Journal, "publish", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            accelcal.write_batch("two", "results.csv")
    assert accelcal.write_batch("two", "results.csv", resume=True).notes == (ALIKE,)


@pytest.mark.usefixtures("alike")
@pytest.mark.parametrize("command", ["fit", "discover", "head"])
def test_serials_of_several_files_that_differ_in_case_alone_are_told(capsys, command):
    main([command, "two/0.csv", "two/1.csv", "two/2.csv"])
    assert capsys.readouterr().err.count(f"note: {ALIKE}\n") == 1
