"""accelcal batch: an archive of tables to one frame of calibrations."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import remark
from accelcal.cli.files import Command
from accelcal.cli.fit_arguments import fit_arguments
from accelcal.errors import InputError
from accelcal.plural import counted

if TYPE_CHECKING:
    from accelcal.archive.batch import BatchCounts


@click.command(cls=Command)
@click.argument("paths", metavar="PATH...", nargs=-1, required=True)
@option.output("the rows of all tables", metavar="RESULTS.(csv|csv.gz|parquet)", required=True)
@option.count("--jobs", "N", "Number of processes [default: all processors].")
@option.flag("--resume", "Continue an interrupted batch.")
@option.text(
    "--dask",
    "ADDRESS",
    "Work on the Dask cluster of this scheduler; 'local' starts one of --jobs processes.",
)
@option.calibration
@option.effects("model")
def batch(
    paths: Sequence[str],
    path: str,
    jobs: int | None,
    resume: bool,
    dask: str | None,
    **options: Any,
) -> None:
    """Calibrate from all tables of an archive into one table.

    PATH is a file, a folder with all its subfolders, a glob, or a URL such as s3://bucket/2024.
    RESULTS gets one row for each serial, run and mounting; RESULTS.laws the temperature laws;
    RESULTS.errors.csv one row for each file or serial that cannot be used; the exit code is then 1.
    The order of the rows does not depend on --jobs.

    \b
    Examples:
      accelcal batch archive/ -o results.parquet
      accelcal batch '20*/*.csv' -o results.csv --robust --spec examples/al15.toml
      accelcal batch 2024/ -o results.csv --head head.json --model model.json
      accelcal batch archive/ -o results.csv --resume
      accelcal batch s3://bucket/tests -o results.parquet --dask tcp://scheduler:8786
    """
    from accelcal.archive.batch import write_batch

    asked = fit_arguments(options)
    with _progress() as progress, _interruptible(path):
        counts = write_batch(
            paths,
            path,
            jobs=jobs,
            resume=resume,
            dask=dask,
            progress=progress,
            specification=asked.specification,
            overrides=options,
            model=asked.models and asked.models.only(),
            **asked.of_all,
        )
    _tell(counts, path)


def _tell(counts: BatchCounts, path: str) -> None:
    """Say what became of the files, and end with the exit code that tells the same."""
    from accelcal.archive.formats import results

    where = results(path)["errors"]
    if not counts.fitted:
        first = counts.errors[0][1]
        files = counted(counts.files, "file")
        raise InputError(f"none of {files} can be used, see {where}; first: {first}")
    said = f"{counted(counts.fitted, 'calibration')} from {counted(counts.files, 'file')}"
    if counts.errors:
        said += f"; {counted(len(counts.errors), 'error')}, see {where}"
    if counts.failed:
        said += f"; {counts.failed} beyond the data sheet"
    if counts.warned:
        said += f"; gates warn in {counts.warned}, see the column warnings"
    remark(said)
    for note in counts.notes:
        remark(f"note: {note}")
    if counts.errors or counts.failed:
        click.get_current_context().exit(1)


@contextmanager
def _interruptible(path: str) -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        click.echo(
            f"\ninterrupted; what is finished is kept beside {path}: go on with --resume",
            file=sys.stderr,
            nl=False,
        )
        raise


@contextmanager
def _progress() -> Iterator[Callable[[int, int], None] | None]:
    """Bar with rate and time left, on a terminal only."""
    if not sys.stderr.isatty():
        yield None
        return
    with click.progressbar(
        length=0, file=sys.stderr, show_pos=True, item_show_func=lambda rate: rate
    ) as bar:
        began = time.monotonic()
        before = -1  # files of an earlier run, which tell nothing of the rate; -1: not yet known

        def tell(done: int, total: int) -> None:
            nonlocal before
            before = done if before < 0 else before
            bar.length = total
            bar.render_progress()
            rate = (done - before) / max(time.monotonic() - began, 1e-3)
            bar.update(done - bar.pos, f"{rate:.0f} files/s" if done > before else "")

        yield tell
