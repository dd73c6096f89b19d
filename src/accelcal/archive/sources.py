"""Which files a batch reads, in one fixed order: files, folders, globs, URLs, not its results."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any, NamedTuple, TypeVar

from accelcal.archive import formats
from accelcal.archive.failures import reason
from accelcal.errors import InputError, not_installed
from accelcal.io.files.csv_text import is_batch_result
from accelcal.io.files.overwriting import begins_as
from accelcal.io.files.text import WORKBOOK_SUFFIXES, file_and_sheet
from accelcal.plural import listed

SUFFIXES = (".csv", ".csv.gz", ".txt", ".tsv", ".parquet", *WORKBOOK_SUFFIXES)
"""Ends of the names of the files that are taken from a folder."""

Item = TypeVar("Item")

_SUFFIXES_TOLD = ", ".join(f"*{suffix}" for suffix in SUFFIXES)
_MAGIC = frozenset("*?[")
_HIDDEN = (".", "~$")  # the second is beside a workbook as long as it is open
_JOURNALS = tuple(f"{form}.journal" for form in formats.FORMS)  # of this batch and others
_ERRORS = ".errors.csv"
_READ = os.O_RDONLY | getattr(os, "O_BINARY", 0)  # Windows has a mode for text


class SourceFile(NamedTuple):
    """A file to read, and what tells that it has not changed."""

    path: str  # or URL, as the results name it
    size: int  # bytes; -1 where unknown
    stamp: str  # time of the last change, or a checksum where the store has one


@dataclass(slots=True)
class Aside:
    """What is not read of the folders."""

    # folders that cannot be read -> the line that tells why
    unreadable: dict[str, str] = field(default_factory=dict)
    # files that end in none of `SUFFIXES`, by their whole paths or URLs
    others: set[str] = field(default_factory=set)
    links: set[str] = field(default_factory=set)  # to files
    results: set[str] = field(default_factory=set)  # of other batches
    again: dict[str, str] = field(default_factory=dict)  # second names of files -> the first ones

    def take(self, other: Aside) -> None:
        """Add what another path has aside."""
        self.unreadable.update(other.unreadable)
        self.others.update(other.others)
        self.links.update(other.links)
        self.results.update(other.results)

    def notes(self) -> Iterator[str]:
        """Tell of results, of files of two names, and how many others there are, by their ends."""
        if self.results:
            yield f"results of other batches are left out: {listed(sorted(self.results))}"
        if self.again:
            told = listed(f"{name} (as {first})" for name, first in self.again.items())
            yield f"files of two names count once: {told}"
        if not self.others:
            return
        ends = Counter(os.path.splitext(path.lower())[1] for path in self.others)  # noqa: PTH122
        most_first = sorted(ends.items(), key=lambda item: (-item[1], item[0]))
        told = listed(
            f"{number} {f'*{end}' if end else 'without any'}" for end, number in most_first
        )
        yield (
            f"files with other endings are left out of folders: {told}; give those that are tables"
            " by name or glob"
        )


class Sources:
    """Files of a batch; each is measured when its turn comes, so that work need not wait for all.

    They are found as paths, or as what a store has told of them.
    """

    def __init__(self, found: Collection[str | SourceFile], aside: Aside) -> None:
        self._found = found
        self.unreadable = tuple(sorted(aside.unreadable.items()))
        self.notes = tuple(aside.notes())

    def __len__(self) -> int:
        """Number of the files."""
        return len(self._found)

    def __iter__(self) -> Iterator[SourceFile]:
        """Measure them in their order."""
        return (_measured(item) if isinstance(item, str) else item for item in self._found)


def find_sources(paths: Sequence[str], results: Collection[str] = ()) -> Sources:
    """Find the files of a batch.

    The paths are files, sheets such as ``a.xlsx#60 degC``, folders with all that is below them,
    globs such as ``2024/**/*.csv``, and URLs of fsspec such as ``s3://bucket/folder``. The results
    are left out where a folder or glob holds them; those of other batches too, with a note.

    Files are in the order of the paths, those of a folder or glob by name; one that is met again,
    by a link too, is there once. Folders below that cannot be read are told of apart. Raises
    InputError if one of the paths is nothing, holds no table, or cannot be read.
    """
    aside = Aside()
    found: list[str | SourceFile] = []
    for path in paths:
        own = Aside()
        found += _of_url(path, own) if is_url(path) else _of_path(path, results, own)
        aside.take(own)
    if len(paths) > 1 or aside.links or not os.path.isdir(paths[0]):  # noqa: PTH112
        found = _once(found, aside)  # one folder without links holds no file twice
    return Sources(found, aside)


def _once(found: Sequence[str | SourceFile], aside: Aside) -> list[str | SourceFile]:
    real_folder = cache(os.path.realpath)  # that of each file takes as long as to read it
    links = {*filter(_is_link, found)}
    first: dict[str, str | SourceFile] = {}
    for item in sorted(found, key=links.__contains__):  # a file goes before the links to it
        if isinstance(item, SourceFile):
            first.setdefault(item.path, item)
            aside.others.discard(item.path)  # named beside the folder
            continue
        if aside.others:
            aside.others.discard(os.path.abspath(item))  # noqa: PTH100
        folder, name = os.path.split(item)
        real = os.path.realpath(item) if item in links else os.path.join(real_folder(folder), name)  # noqa: PTH118
        before = str(first.setdefault(real, item))
        if before != item and os.path.abspath(before) != os.path.abspath(item):  # noqa: PTH100
            aside.again[os.path.normpath(item)] = before
    kept = {*first.values()}
    return list(dict.fromkeys(item for item in found if item in kept))


def _is_link(item: str | SourceFile) -> bool:
    return isinstance(item, str) and os.path.islink(item)  # noqa: PTH114


def is_url(path: str) -> bool:
    """Tell whether a path is a URL, as in ``s3://bucket/a.csv``."""
    return "://" in path


def read_bytes(path: str, size: int = 0) -> bytes:
    """Read a file or the object of a URL whole, at once if it still has the size that is known.

    Raises OSError if it cannot be read.
    """
    if is_url(path):
        system, name = _file_system(path)
        stored: bytes = system.cat_file(name)
        return stored
    file = os.open(path, _READ)  # half the time of open, which counts in thousands of small files
    try:
        content = os.read(file, max(size, 0) + 1)  # a byte more shows that there is none
        if len(content) == size:
            return content
        return b"".join([content, *iter(partial(os.read, file, 2**16), b"")])
    finally:
        os.close(file)


def _measured(path: str) -> SourceFile:
    """The file of a path; one that is lost is told of when it is read."""
    try:
        status = os.stat(file_and_sheet(path)[0])  # noqa: PTH116
    except OSError:  # a link to nowhere or to itself, or gone meanwhile
        return SourceFile(path, -1, "")
    return SourceFile(path, status.st_size, str(status.st_mtime_ns))


def _of_path(path: str, results: Collection[str], aside: Aside) -> list[str]:
    if path == "-":
        raise InputError("- is standard input, which accelcal fit reads; batch takes files")
    if os.path.isdir(path):  # noqa: PTH112
        return _some(sorted(_without(results, _in_folder(path, aside), aside)), path, aside)
    if os.path.isfile(file_and_sheet(path)[0]):  # noqa: PTH113
        return [path]
    if os.path.exists(path):  # noqa: PTH110
        raise InputError(f"{path} is a pipe or device, which accelcal fit reads; batch takes files")
    if _MAGIC.isdisjoint(path):
        raise InputError(f"{path}: no such file or folder; give files, folders or globs")
    return _some(list(_without(results, _in_glob(path, aside), aside)), path, aside)


def _without(results: Collection[str], found: Iterable[str], aside: Aside) -> Iterator[str]:
    """Leave out the results, and those of other batches, which have their list of errors beside."""
    found = list(found)
    lists = (path.removesuffix(_ERRORS) for path in found if path.endswith(_ERRORS))
    forms = (stem + form for stem in lists for form in formats.FORMS)
    others = {name for path in forms for name in formats.results(path).values()}
    names = tuple(os.path.basename(path) for path in results)  # noqa: PTH119
    real = {os.path.realpath(path) for path in results}
    for path in found:
        if path.endswith(names) and os.path.realpath(path) in real:
            continue
        if path in others and begins_as(path, is_batch_result):
            aside.results.add(os.path.normpath(path))
        else:
            yield path


def _in_folder(folder: str, aside: Aside) -> Iterator[str]:
    """Tables below a folder; what is hidden stays so."""
    folders = [folder]
    while folders:
        inside = folders.pop()
        try:
            with os.scandir(inside) as entries:
                for entry in entries:
                    if _is_passed_over(entry.name):
                        continue
                    if entry.is_dir(follow_symlinks=False):
                        folders.append(entry.path)
                    elif not _is_file(entry, aside):
                        continue
                    elif entry.name.lower().endswith(SUFFIXES):
                        yield entry.path
                    else:
                        aside.others.add(os.path.abspath(entry.path))  # noqa: PTH100
        except OSError as error:
            aside.unreadable[inside] = (
                f"{inside}: the folder cannot be read ({error.strerror}); ask for the permission,"
                " or name what can be read"
            )


def _is_passed_over(name: str) -> bool:
    return name.startswith(_HIDDEN) or name.endswith(_JOURNALS)


def _in_glob(pattern: str, aside: Aside) -> Iterator[str]:
    import glob

    for path in sorted(glob.glob(pattern, recursive=True)):  # noqa: PTH207  (keeps ./ as given)
        if any(part.endswith(_JOURNALS) for part in path.split(os.sep)):  # noqa: PTH206
            continue
        if os.path.isdir(path):  # noqa: PTH112
            yield from sorted(_in_folder(path, aside))
        elif _leads_to_file(path):
            yield path


def _is_file(entry: os.DirEntry[str], aside: Aside) -> bool:
    if entry.is_file(follow_symlinks=False):
        return True
    if not (entry.is_symlink() and _leads_to_file(entry.path)):
        return False
    aside.links.add(entry.path)
    return True


def _leads_to_file(path: str) -> bool:
    """Tell a file from a pipe, which would wait for ever; a lost one is told of when it is read."""
    return os.path.isfile(path) or not os.path.exists(path)  # noqa: PTH110, PTH113


def _some(found: list[Item], path: str, aside: Aside) -> list[Item]:
    if not found:
        others = (*aside.notes(), f"batch takes {_SUFFIXES_TOLD}")
        nothing = f"{path}: no table in it; {others[0]}"
        raise InputError(min(aside.unreadable.values(), default=nothing))
    return found


# -- URLs ------------------------------------------------------------------------------------------

_STAMPS = ("ETag", "etag", "md5", "checksum", "mtime", "LastModified", "last_modified", "created")


def _of_url(url: str, aside: Aside) -> list[SourceFile]:
    system, name = _file_system(url)
    try:
        known = _in_store(system, name, aside)
    except FileNotFoundError:
        raise InputError(f"{url}: no such file or folder; give files, folders or globs") from None
    except Exception as error:  # each file system fails in its own way
        raise InputError(f"{url} cannot be listed: {reason(error)}; check the address") from None
    return _some([_of_store(system, path, known[path]) for path in sorted(known)], url, aside)


def _in_store(system: Any, name: str, aside: Aside) -> dict[str, Any]:
    """Tables of a name, as of a path: of a glob those below its folders as well."""
    if _MAGIC.isdisjoint(name):
        return _tables(system, name, aside) if system.isdir(name) else {name: system.info(name)}
    plain = name[: min(map(name.index, _MAGIC.intersection(name)))].rpartition("/")[0]
    tables: dict[str, Any] = {}
    for path, info in _shown(plain, system.glob(name, detail=True)).items():
        folder = info.get("type") == "directory"
        tables |= _tables(system, path, aside) if folder else {path: info}
    return tables


def _tables(system: Any, folder: str, aside: Aside) -> dict[str, Any]:
    known = _shown(folder, system.find(folder, detail=True))
    tables = {path: info for path, info in known.items() if path.lower().endswith(SUFFIXES)}
    aside.others.update(map(system.unstrip_protocol, known.keys() - tables.keys()))
    return tables


def _shown(folder: str, found: dict[str, Any]) -> dict[str, Any]:
    """What no name below a folder hides."""
    return {
        path: info
        for path, info in found.items()
        if not any(map(_is_passed_over, path.removeprefix(folder).split("/")))
    }


def _of_store(system: Any, path: str, info: dict[str, Any]) -> SourceFile:
    stamp = next((str(info[key]) for key in _STAMPS if info.get(key)), "")
    size = info.get("size")
    return SourceFile(system.unstrip_protocol(path), -1 if size is None else int(size), stamp)


def _file_system(url: str) -> tuple[Any, str]:
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise not_installed(url, "fsspec", "remote") from None
    try:
        system, name = url_to_fs(url)
    except (ImportError, ValueError) as error:
        remedy = "install what its store needs, such as s3fs, or give files"
        raise InputError(f"{url} cannot be opened: {reason(error)}; {remedy}") from None
    return system, name
