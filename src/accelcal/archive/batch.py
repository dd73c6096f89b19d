"""A batch: the files found, divided into blocks, worked through, and the results put together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from os import PathLike
from os.path import realpath
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple, Unpack

from accelcal.archive.block import Told, fit_block, fit_to_file, work
from accelcal.archive.formats import (
    ERRORS,
    FORMS,
    LAWS,
    ROWS,
    Columns,
    FrameColumn,
    in_notebook,
    put_together,
    require_form,
    results,
    write_errors,
)
from accelcal.archive.journal import growing_results, open_journal, work_and_keep
from accelcal.archive.settings import Settings
from accelcal.archive.sources import Sources, find_sources, is_url
from accelcal.archive.through import InMemory, Progress, work_through
from accelcal.arguments.kinds import ending_of, path_text, several
from accelcal.arguments.numbers import check_number, check_whole
from accelcal.arguments.options import check_flag, check_function, check_options, check_text
from accelcal.arrays import Labels, equal
from accelcal.calibrate.options import FitOptions, Options
from accelcal.errors import InputError
from accelcal.io.declarations import declared_by_caller
from accelcal.io.files.csv_text import is_batch_result
from accelcal.io.files.overwriting import may_be_replaced
from accelcal.model import COEFFICIENTS
from accelcal.plural import counted
from accelcal.serials import notes_of_alike

if TYPE_CHECKING:
    import pandas as pd

    from accelcal.specification import Specification

__all__ = ["BatchCounts", "BatchFrames", "batch", "write_batch"]

_MOST_JOBS = 1024
"""More processes than that are a slip of the pen."""

_NOTHING_LEFT = "no interrupted batch left anything to resume; all files were fitted"


class BatchCounts(NamedTuple):
    """What became of a batch.

    Attributes
    ----------
    files : int
        Files that were found.
    fitted : int
        Records that were fitted.
    errors : tuple of tuple of str
        Source and message of what could not be read or fitted: folders first.
    failed, warned : int
        Records that failed the data sheet, and whose gates warn.
    notes : tuple of str
        That there was nothing to resume, files of folders that are left out, counted by their
        endings, results of other batches, files of two names, and serial numbers that count as
        several units by their spelling alone.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import accelcal
    >>> with TemporaryDirectory() as folder:
    ...     accelcal.write_table(accelcal.simulate(seed=1), f"{folder}/1.csv")
    ...     accelcal.write_batch(f"{folder}/1.csv", f"{folder}/results.csv")
    BatchCounts(files=1, fitted=1, errors=(), failed=0, warned=0, notes=())
    """

    files: int
    fitted: int
    errors: tuple[tuple[str, str], ...]
    failed: int
    warned: int
    notes: tuple[str, ...] = ()


class BatchFrames(NamedTuple):
    """Results of a batch; the units of a frame's columns are in its ``attrs["units"]``.

    ``tables.attrs["notes"]`` are the notes of `BatchCounts`.

    Attributes
    ----------
    tables : pandas.DataFrame
        A row a serial, run and mounting.
    laws : pandas.DataFrame
        A row a record and term of its temperature laws.
    errors : pandas.DataFrame
        A row for what could not be read or fitted: folders first.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import accelcal
    >>> with TemporaryDirectory() as folder:
    ...     accelcal.write_table(accelcal.simulate(seed=1), f"{folder}/1.csv")
    ...     found = accelcal.batch(folder)
    >>> found.tables["K1"].round(2).tolist(), found.tables.attrs["units"]["K1"]
    ([1.35, 1.39, 1.31], 'output_unit/g')
    """

    tables: pd.DataFrame
    laws: pd.DataFrame
    errors: pd.DataFrame

    def __eq__(self, other: object) -> bool:
        return equal(tuple(self), other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __repr__(self) -> str:
        return f"<BatchFrames: {self._told()}>"

    def _repr_html_(self) -> str:
        parts = [f"<p>Batch: {self._told()}</p>"]
        for name, frame in self._asdict().items():
            if len(frame):
                size = f"{counted(len(frame), 'row')}, {counted(len(frame.columns), 'column')}"
                parts.append(f"<p><code>.{name}</code>, {size}</p>")
                parts.append(in_notebook(frame).to_html(max_rows=10))
        return "".join(parts)

    def _told(self) -> str:
        tables, terms, errors = map(len, self)
        told = (counted(tables, "table"), f"{counted(terms, 'term')} of laws")
        return ", ".join((*told, counted(errors, "error")))


class BatchOptions(FitOptions, total=False):
    """What `batch` takes beside its own arguments."""

    overrides: Mapping[str, Any] | None
    specification: Specification | None


def batch(
    paths: str | PathLike[str] | Iterable[str | PathLike[str]],
    *,
    jobs: int | None = 1,
    dask: str | None = None,
    progress: Progress | None = None,
    **options: Unpack[BatchOptions],
) -> BatchFrames:
    """Fit all tables of an archive.

    Parameters
    ----------
    paths : path or iterable of paths
        Files, folders, globs, or URLs of fsspec.
    jobs : int, default 1
        Number of processes; None takes all processors. With several, a script must guard what it
        does by ``if __name__ == "__main__"``.
    dask : str, optional
        Address of the scheduler of a Dask cluster, or ``"local"``.
    progress : callable, optional
        Is told the number of files, or of parts of large ones, that are done, and that of all,
        which grows where a table proves to be a large one.
    **options
        Arguments of `accelcal.fit`: method, robust, delta0, reference_temperature, coefficients,
        strict, temperature_laws, model and head; `overrides`, as of `accelcal.read_table`; and
        `specification`, a data sheet.

    Returns
    -------
    BatchFrames
        The frames of tables, laws and errors, in the order of the files.

    Raises
    ------
    InputError
        If there is no such file, or an option breaks a rule.
    DesignError
        If a coefficient is unknown, or K1 is not asked for.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import accelcal
    >>> with TemporaryDirectory() as folder:
    ...     for seed in (1, 2):
    ...         accelcal.write_table(accelcal.simulate(seed=seed), f"{folder}/{seed}.csv")
    ...     found = accelcal.batch(folder)
    >>> found.tables[["serial", "run", "gate_drift"]].shape, len(found.errors)
    ((6, 3), 0)
    """
    _check_workers(jobs, dask, progress)
    settings = _settings(batch, **options)
    sources = find_sources(_texts(paths))
    kept = InMemory()
    if jobs == 1 or dask:
        in_memory = partial(fit_block, settings=settings)
        work_through(sources, in_memory, kept, jobs=jobs, dask=dask, tell=progress)
    else:
        with TemporaryDirectory(prefix="accelcal-") as folder:
            to_file = partial(fit_to_file, settings=settings, folder=folder)
            work_through(sources, to_file, kept, jobs=jobs, tell=progress)
    found = kept.results
    counts = _counted(sources, [part.told for part in found])
    tables = _frame([part.tables for part in found], ROWS)
    tables.attrs["notes"] = list(counts.notes)
    laws = _frame([part.laws for part in found], LAWS)
    return BatchFrames(tables, laws, _errors_frame(counts.errors))


def write_batch(
    paths: str | PathLike[str] | Iterable[str | PathLike[str]],
    target: str | PathLike[str],
    *,
    jobs: int | None = 1,
    resume: bool = False,
    dask: str | None = None,
    progress: Progress | None = None,
    **options: Unpack[BatchOptions],
) -> BatchCounts:
    """Fit all tables of an archive and write the results, with a few blocks of files in memory.

    Parameters
    ----------
    paths : path or iterable of paths
        As for `batch`.
    target : path
        File of the rows of the tables, which ends in ``.csv``, ``.csv.gz`` or ``.parquet``; those
        of the laws and of the errors go beside it.
    jobs, dask, progress, **options
        As for `batch`: method, robust, delta0, reference_temperature, coefficients, strict,
        temperature_laws, model, head, overrides and specification too.
    resume : bool, default False
        Go on with what an interrupted batch left.

    Returns
    -------
    BatchCounts
        What became of the files.

    Raises
    ------
    InputError
        If there is no such file, an option breaks a rule, `target` cannot be written, or an
        interrupted batch left its finished part and `resume` is false.
    DesignError
        As by `batch`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import accelcal
    >>> with TemporaryDirectory() as folder:
    ...     accelcal.write_table(accelcal.simulate(seed=1), f"{folder}/1.csv")
    ...     counts = accelcal.write_batch(f"{folder}/1.csv", f"{folder}/results.csv")
    >>> counts.files, counts.failed
    (1, 0)
    """
    target = path_text(target)
    form = ending_of(target, FORMS)
    require_form(form)
    _check_workers(jobs, dask, progress)
    check_flag(resume=resume)
    settings = _settings(write_batch, **options)
    names = results(target)
    sources = _sources(_texts(paths), names)
    with open_journal(target, settings, form, resume=resume) as journal:
        left = journal.remains()
        function = (
            partial(work, settings=settings, form=form)
            if dask
            else partial(work_and_keep, journal=journal)
        )
        with growing_results(journal) as growing:
            work_through(sources, function, growing, jobs=jobs, dask=dask, tell=progress)
        told = growing.told
        if growing.outdated:  # parts of a table with scattered serials were done anew
            with growing_results(journal) as again:
                again.take_all(growing)
            told = again.told
        counts = _counted(sources, told)
        with journal.draft("errors") as file, journal.refusals_told():
            write_errors(counts.errors, file)
        journal.publish({name: names[name] for name in ("errors", "laws", "tables")})
    anew = _notes_of_resuming(left, growing.resumed) if resume else ()
    return counts._replace(notes=(*anew, *counts.notes))


def _notes_of_resuming(left: int, used: int) -> tuple[str, ...]:
    """Say that not all, or nothing, was finished of a batch that goes on with some blocks."""
    if used < left:
        return (
            f"{left - used} of {counted(left, 'block')} that an interrupted batch left were of"
            " other files, options or another version of accelcal, or damaged; their files were"
            " fitted anew",
        )
    return () if left else (_NOTHING_LEFT,)


def _check_workers(jobs: int | None, dask: str | None, progress: Progress | None) -> None:
    if jobs is not None:
        check_whole(1, jobs=jobs)
        check_number(1, _MOST_JOBS, jobs=jobs)
    check_text(dask=dask)
    check_function(progress=progress)


def _settings(
    function: Any,
    /,
    *,
    overrides: Mapping[str, Any] | None = None,
    specification: Specification | None = None,
    coefficients: Sequence[str] = COEFFICIENTS,
    **options: Any,
) -> Settings:
    check_options(function, options, BatchOptions.__annotations__)
    asked = Options(coefficients=several(coefficients), **options)
    settings = Settings(asked, overrides=declared_by_caller(overrides), specification=specification)
    settings.try_out()
    return settings.with_own_effects()


def _texts(paths: str | PathLike[str] | Iterable[str | PathLike[str]]) -> list[str]:
    texts = [path_text(path, "give files, folders or globs") for path in several(paths)]
    if not texts:
        raise InputError("no path is given; give files, folders or globs")
    return texts


def _sources(paths: Sequence[str], names: Mapping[str, str]) -> Sources:
    for path in paths:
        if realpath(path) in map(realpath, names.values()) and not is_url(path):
            raise InputError(f"{path} is a file to be read; name another file for the results")
    for path in names.values():
        if not may_be_replaced(path, is_batch_result):
            raise InputError(
                f"the results would overwrite {path}, which is none of a batch; name another file"
            )
    return find_sources(paths, results=names.values())


def _counted(sources: Sources, told: Sequence[Told]) -> BatchCounts:
    serials = dict.fromkeys(name for own in told for name in own.serials)
    return BatchCounts(
        files=len(sources),
        fitted=sum(own.fitted for own in told),
        errors=(*sources.unreadable, *(error for own in told for error in own.errors)),
        failed=sum(own.failed for own in told),
        warned=sum(own.warned for own in told),
        notes=(*sources.notes, *notes_of_alike(serials)),
    )


# -- frames ----------------------------------------------------------------------------------------

_TYPES = {"text": "object", "number": "float64", "whole": "Int64", "flag": "bool"}


def _frame(parts: Sequence[Columns], kinds: Mapping[str, FrameColumn]) -> pd.DataFrame:
    import pandas as pd

    columns = {
        name: pd.Series(
            cells.cells() if isinstance(cells, Labels) else cells, dtype=_TYPES[kinds[name].kind]
        )
        for name, cells in put_together(parts).items()
    }
    frame = pd.DataFrame(columns)
    frame.attrs["units"] = {name: column.unit for name, column in kinds.items() if column.unit}
    return frame


def _errors_frame(errors: Iterable[tuple[str, str]]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(list(errors), columns=list(ERRORS), dtype="object")
