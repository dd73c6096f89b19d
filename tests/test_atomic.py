"""Files are written whole or not at all."""

import os
import stat
import sys
from pathlib import Path

import pytest

from accelcal.atomic import write_atomically
from accelcal.errors import InputError

posix_only = pytest.mark.skipif(sys.platform == "win32", reason="a matter of POSIX file systems")


def test_writes_a_new_file(tmp_path):
    write_atomically(tmp_path / "a.json", b"{}")
    assert (tmp_path / "a.json").read_bytes() == b"{}"
    assert [file.name for file in tmp_path.iterdir()] == ["a.json"]


def test_takes_a_text_as_path(tmp_path):
    write_atomically(str(tmp_path / "a.json"), b"{}")
    assert (tmp_path / "a.json").read_bytes() == b"{}"


@posix_only
def test_a_new_file_has_the_permissions_of_the_umask(tmp_path):
    write_atomically(tmp_path / "a.json", b"{}")
    (tmp_path / "plain").touch()
    assert (tmp_path / "a.json").stat().st_mode == (tmp_path / "plain").stat().st_mode


@posix_only
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o755])
def test_an_existing_file_keeps_its_permissions(tmp_path, mode):
    path = tmp_path / "a.json"
    path.write_bytes(b"old")
    path.chmod(mode)
    write_atomically(path, b"new")
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(path.stat().st_mode) == mode


@posix_only
def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real.json").write_bytes(b"old")
    (tmp_path / "link.json").symlink_to("real.json")
    write_atomically(tmp_path / "link.json", b"new")
    assert (tmp_path / "link.json").is_symlink()
    assert (tmp_path / "real.json").read_bytes() == b"new"


@pytest.mark.skipif(not Path("/dev/fd").exists(), reason="needs the names of open files")
def test_a_pipe_that_is_open_is_written_through():
    reader, writer = os.pipe()
    try:
        write_atomically(f"/dev/fd/{writer}", b"1,2")
        assert os.read(reader, 9) == b"1,2"
    finally:
        os.close(reader)
        os.close(writer)


@posix_only
def test_a_link_to_itself_is_replaced(tmp_path):
    path = tmp_path / "a.json"
    path.symlink_to(path)
    write_atomically(path, b"{}")
    assert path.read_bytes() == b"{}"


@posix_only
def test_a_device_is_written_through():
    before = Path(os.devnull).stat()
    write_atomically(os.devnull, b"lost")
    assert stat.S_ISCHR(Path(os.devnull).stat().st_mode)
    assert Path(os.devnull).stat().st_ino == before.st_ino


@pytest.mark.parametrize("failing", ["fsync", "replace"])
def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, failing):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os if failing == "fsync" else Path, failing, fail)
    (tmp_path / "a.json").write_bytes(b"old")
    with pytest.raises(
        InputError, match=r"a\.json cannot be written: No space left on device; make room"
    ):
        write_atomically(tmp_path / "a.json", b"new")
    assert (tmp_path / "a.json").read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["a.json"]


def test_an_interrupt_leaves_no_temporary_file(tmp_path, monkeypatch):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "a.json", b"new")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(InputError, match="its folder does not exist; create the folder"):
        write_atomically(tmp_path / "nowhere" / "a.json", b"{}")


def test_a_file_is_no_folder(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="its folder does not exist"):
        write_atomically(tmp_path / "file" / "a.json", b"{}")


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(InputError, match="is a folder; name a file in it"):
        write_atomically(tmp_path, b"{}")


def test_an_impossible_name_is_refused_in_one_line(tmp_path):
    with pytest.raises(InputError, match="cannot be written") as caught:
        write_atomically(tmp_path / ("x" * 5000), b"{}")
    assert "\n" not in str(caught.value)


def test_a_write_protected_file_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write to any file
    (tmp_path / "a.json").write_bytes(b"old")
    with pytest.raises(InputError, match="the file or its folder is not writable"):
        write_atomically(tmp_path / "a.json", b"new")
    assert (tmp_path / "a.json").read_bytes() == b"old"


def test_a_closed_folder_is_named(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)  # root may write to any folder
    with pytest.raises(InputError, match="the file or its folder is not writable"):
        write_atomically(tmp_path / "a.json", b"{}")
