"""One batch at a time writes a file, whatever moment another one begins in."""

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from accelcal.archive.block import Block, Told
from accelcal.archive.journal import Journal, open_journal
from accelcal.archive.lock import alone_in
from accelcal.archive.settings import Settings
from accelcal.errors import InputError

fcntl = pytest.importorskip("fcntl")


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "r.csv.journal"


def has_lock(folder):
    """Whether another process is kept out."""
    code = "import fcntl, sys; fcntl.lockf(open(sys.argv[1], 'wb'), fcntl.LOCK_EX | fcntl.LOCK_NB)"
    command = [sys.executable, "-c", code, str(folder / "lock")]
    return subprocess.run(command, capture_output=True, check=False).returncode == 1


def instead_of_first(monkeypatch, home, name, before):
    """Let something happen just before the first call of a function."""
    function, calls = getattr(home, name), []

    def changed(*arguments, **options):
        calls.append(name)
        if len(calls) == 1:
            before(*arguments)
        return function(*arguments, **options)

    monkeypatch.setattr(home, name, changed)
    return calls


def test_the_folder_goes_where_nothing_is_left(folder):
    with alone_in(folder, "r.csv"):
        assert has_lock(folder)
    assert not folder.exists()
    with alone_in(folder, "r.csv"):
        (folder / "a.block").touch()
    assert {path.name for path in folder.iterdir()} == {"a.block", "lock"}


def test_a_lock_that_ended_before_it_was_had_is_of_no_use(folder, monkeypatch):
    """Between opening and locking the batch that had it ends, and a third one has begun or not."""
    for begun in (False, True):

        def ended(*_, begun=begun):
            shutil.rmtree(folder)
            if begun:
                folder.mkdir()
                (folder / "lock").touch()

        calls = instead_of_first(monkeypatch, fcntl, "lockf", ended)
        with alone_in(folder, "r.csv"):
            assert len(calls) == 2
            assert has_lock(folder)
        monkeypatch.undo()


def test_a_folder_that_went_before_its_lock_was_opened_is_made_again(folder, monkeypatch):
    calls = instead_of_first(monkeypatch, Path, "open", lambda path, *_: path.parent.rmdir())
    with alone_in(folder, "r.csv"):
        assert len(calls) == 2
        assert has_lock(folder)


def test_who_ends_leaves_the_folder_to_who_begins(folder, monkeypatch):
    """Between removing the lock and the folder another batch begins there."""
    instead_of_first(monkeypatch, Path, "rmdir", lambda path: (path / "lock").touch())
    with alone_in(folder, "r.csv"):
        pass
    assert (folder / "lock").exists()


def test_a_lock_that_always_ends_is_given_up(folder, monkeypatch):
    monkeypatch.setattr(fcntl, "lockf", lambda *_: shutil.rmtree(folder))
    with pytest.raises(InputError, match="another accelcal batch is writing it"):
        alone_in(folder, "r.csv").__enter__()
    assert not folder.exists()


def test_a_system_without_such_locks_has_no_lock_file(tmp_path, folder, monkeypatch):
    """A file that is open cannot be removed on all systems."""
    monkeypatch.setitem(sys.modules, "fcntl", None)
    with open_journal(str(tmp_path / "r.csv"), Settings(), "csv", resume=False) as journal:
        with journal.draft("tables"):
            assert os.listdir(folder) == ["draft-tables"]  # noqa: PTH208
        with pytest.raises(InputError, match="another accelcal batch is writing it"):
            alone_in(folder, "r.csv").__enter__()
    assert not folder.exists()


WORKER = """
import os, sys
from pathlib import Path
from accelcal.archive.lock import alone_in
from accelcal.errors import InputError

folder, mark = Path(sys.argv[1]), Path(sys.argv[2])
had = 0
while had < 200:
    try:
        with alone_in(folder, "r.csv"):
            mark.touch(exist_ok=False)
            assert folder.is_dir()
            mark.unlink()
            had += 1
    except InputError:
        pass
"""


def test_processes_that_take_turns_never_meet(tmp_path, folder):
    command = [sys.executable, "-c", WORKER, str(folder), str(tmp_path / "mark")]
    workers = [subprocess.Popen(command, stderr=subprocess.PIPE, text=True) for _ in range(3)]
    assert [worker.communicate()[1] for worker in workers] == [""] * 3
    assert not folder.exists()


@pytest.mark.parametrize(
    ("home", "name", "refusal"),
    [
        (fcntl, "lockf", OSError(errno.ENOLCK, "No locks available")),
        (Path, "mkdir", FileNotFoundError(errno.ENOENT, "No such file or directory")),
    ],
    ids=["a disk without locks", "a folder that takes none, as /proc"],
)
def test_what_the_disk_refuses_is_no_other_batch(tmp_path, monkeypatch, home, name, refusal):
    def refuse(*_):
        raise refusal

    monkeypatch.setattr(home, name, refuse)
    opened = open_journal(str(tmp_path / "r.csv"), Settings(), "csv", resume=False)
    with pytest.raises(InputError, match=rf"cannot be made \({refusal.strerror}\)"), opened:
        pass


def test_blocks_that_tell_something_else_are_not_taken_up(folder, monkeypatch):
    """Those of a journal from before the warnings were counted ended in a traceback."""
    block, settings = Block((), None), Settings()
    now = Journal(folder, settings, "csv").path(block)
    monkeypatch.setattr(Told, "_fields", ("errors", "fitted", "failed", "serials"))
    assert Journal(folder, settings, "csv").path(block) != now
