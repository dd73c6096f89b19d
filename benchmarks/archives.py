"""What a batch over thousands of files costs, beside the floors and what people do today.

Run ``python benchmarks/archives.py`` (minutes) or with ``--smoke`` (seconds). All figures of one
run are medians of alternating runs over the same files, which lie in the page cache. Ratios count;
the times are those of the machine at hand.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from itertools import count as count_from
from pathlib import Path
from statistics import median

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
import pandas as pd
import pyarrow as pa
from pyarrow import csv

import accelcal
from accelcal.archive.block import Block, fit_block
from accelcal.archive.parts import read_files
from accelcal.archive.settings import Settings
from accelcal.archive.sources import find_sources
from accelcal.io.ordinary import reader as ordinary

JOBS = 2
BLOCK = 500
STEPS = 3  # of growth, each of ten times as much
POSITION = np.tile(np.arange(1, 10), 18)
STROKE = np.tile(np.repeat(np.arange(1, 7), 9), 3)
TEMPERATURE = np.repeat([20.0, 60.0, -40.0], 54)
HEADINGS = "temperature,position,stroke,output"


def outputs(rng: np.random.Generator, temperature: np.ndarray) -> np.ndarray:
    """Readings of one accelerometer [mA]."""
    angle = np.radians(45.0 * (POSITION - 1))
    rise = temperature - 20.0
    scale = rng.normal(1.35, 0.02) * (1.0 + 5e-4 * rise)
    bias = rng.normal(3e-3, 1e-3) - 4e-5 * rise
    a, b = np.cos(angle), np.sin(angle)
    output = scale * (bias + a + 1e-4 * a**2 + 9e-5 * a**3 + 1.1e-3 * b + 2e-5 * a * b)
    return output + rng.normal(0.0, 7e-6, output.size)


def rows(rng: np.random.Generator, first: str = "", scatter: float = 0.0) -> list[str]:
    """Lines of the 162 readings of one accelerometer."""
    temperature = TEMPERATURE
    if scatter:  # recorded, and felt
        temperature = np.round(TEMPERATURE + rng.normal(0.0, scatter, TEMPERATURE.size), 2)
    start = [f"{first}{t},{j},{k}," for t, j, k in zip(temperature, POSITION, STROKE, strict=True)]
    return [f"{s}{y:.7f}" for s, y in zip(start, outputs(rng, temperature).tolist(), strict=True)]


def write_files(folder: Path, count: int, scatter: float = 0.0, missing: float = 0.0) -> Path:
    """Write files of one accelerometer each, of which a share of the rows is missing."""
    folder.mkdir()
    rng = np.random.default_rng(1)
    for number in range(count):
        head = f"# serial: S{number:05d}\n# unit: mA\n# T0: 20\n# date: 2024-05-31\n{HEADINGS}\n"
        lines = rows(rng, scatter=scatter)
        if missing:
            lines = [line for line in lines if rng.random() >= missing]
        text = "\n".join(lines)
        (folder / f"{number:05d}.csv").write_text(f"{head}{text}\n")
    return folder


def write_serials(path: Path, count: int) -> Path:
    """Write one file of many accelerometers."""
    rng = np.random.default_rng(2)
    with path.open("w") as file:
        file.write(f"# unit: mA\nserial,{HEADINGS}\n")
        for number in range(count):
            file.write("\n".join(rows(rng, f"S{number:06d},")) + "\n")
    return path


# -- what is timed ---------------------------------------------------------------------------------


def contents(paths: Sequence[Path]) -> list[bytes]:
    found = []
    for path in paths:
        with open(path, "rb", buffering=0) as file:  # noqa: PTH123
            found.append(file.read())
    return found


def bytes_by_both_cores(paths: Sequence[Path]) -> None:
    parts = [paths[i : i + BLOCK] for i in range(0, len(paths), BLOCK)]
    with ThreadPoolExecutor(JOBS) as pool:
        list(pool.map(contents, parts))


def read_and_parse(paths: Sequence[Path]) -> None:
    """Floor: the bytes of 500 files at a time through pyarrow, in one thread."""
    for start in range(0, len(paths), BLOCK):
        bodies = [
            data[data.index(b"output\n") + 7 :] for data in contents(paths[start : start + BLOCK])
        ]
        csv.read_csv(
            pa.BufferReader(b"".join(bodies)),
            csv.ReadOptions(use_threads=False, column_names=HEADINGS.split(",")),
            convert_options=csv.ConvertOptions(
                column_types=dict.fromkeys(HEADINGS.split(","), pa.float64())
            ),
        )


def blocks(folder: Path) -> Iterator[Block]:
    sources = list(find_sources([str(folder)]))
    for start in range(0, len(sources), BLOCK):
        yield Block(tuple(sources[start : start + BLOCK]))


def reader_alone(folder: Path) -> None:
    for block in blocks(folder):
        list(read_files(block.files, {}))


def read_and_fit(folder: Path) -> None:
    for block in blocks(folder):
        fit_block(block, Settings())


def without_pyarrow(function: Callable[[], object]) -> None:
    """Read by pandas; workers are forked and inherit it."""
    engine = ordinary.read_engine
    ordinary.read_engine = lambda _: "pandas"
    try:
        function()
    finally:
        ordinary.read_engine = engine


def pandas_and_lmfit(paths: Sequence[Path]) -> None:
    import lmfit

    names = ("K0", "K1", "K2", "K3", "M", "Mip")
    model = lmfit.Model(
        lambda a, b, K0, K1, K2, K3, M, Mip: (
            K0 + K1 * a + K2 * a**2 + K3 * a**3 + M * b + Mip * a * b
        ),
        independent_vars=["a", "b"],
    )
    for path in paths:
        table = pd.read_csv(path, comment="#")
        for _, run in table.groupby("temperature"):
            angle = np.radians(45.0 * (run["position"].to_numpy() - 1))
            start = model.make_params(**dict.fromkeys(names, 0.1))
            model.fit(run["output"].to_numpy(), start, a=np.cos(angle), b=np.sin(angle))


# -- sections --------------------------------------------------------------------------------------


def timed(functions: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Medians of alternating runs [s]."""
    spent: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(repeats):
        for name, function in functions.items():
            began = time.perf_counter()
            function()
            spent[name].append(time.perf_counter() - began)
    return {name: median(values) for name, values in spent.items()}


def show(title: str, rows: Sequence[tuple[str, ...]]) -> None:
    print(f"\n## {title}\n")
    for number, row in enumerate(rows):
        print("| " + " | ".join(row) + " |")
        if number == 0:
            print("| --- " * len(row) + "|")
    sys.stdout.flush()


def files(folder: Path, work: Path, count: int, few: int, repeats: int) -> None:
    """Many files of 162 readings."""
    paths = sorted(folder.glob("*.csv"))

    number = count_from(1)

    def batch(form: str, jobs: int = JOBS) -> Callable[[], object]:
        return lambda: accelcal.write_batch(folder, work / f"r{next(number)}.{form}", jobs=jobs)

    spent = timed(
        {
            "bytes, both cores": lambda: bytes_by_both_cores(paths),
            "read and parse by pyarrow, one thread": lambda: read_and_parse(paths),
            "reader of batch, one process": lambda: reader_alone(folder),
            "reader and fit, one process": lambda: read_and_fit(folder),
            "batch to Parquet, one process": batch("parquet", 1),
            "batch to Parquet": batch("parquet"),
            "batch to CSV": batch("csv"),
            "batch to Parquet without pyarrow in reading": lambda: without_pyarrow(
                batch("parquet")
            ),
        },
        repeats,
    )
    per_file = {name: 1e6 * seconds / count for name, seconds in spent.items()}
    lmfit = float("nan")  # not installed
    if find_spec("lmfit"):
        lmfit = timed({"lmfit": lambda: pandas_and_lmfit(paths[:few])}, 1)["lmfit"]
    per_file["pandas and lmfit, one process"] = 1e6 * lmfit / few
    floors = {
        "of pyarrow's parse": per_file["read and parse by pyarrow, one thread"],
        "of the reader alone": per_file["reader of batch, one process"],
        "of the bytes": per_file["bytes, both cores"],
    }
    table = [("what", "us a file", "times lmfit", *floors)]
    for name, cost in per_file.items():
        times = per_file["pandas and lmfit, one process"] / cost
        shares = [f"{100 * floor / cost:.0f} %" for floor in floors.values()]
        told = f"{times:.0f}" if np.isfinite(times) else "not installed"
        table.append((name, f"{cost:.0f}", told, *shares))
    show(f"{count} files of 162 readings, {JOBS} processes where not said otherwise", table)
    lmfit = per_file["pandas and lmfit, one process"]
    folder = write_files(work / "moving", max(count // 10, 20), scatter=0.05)
    title = "files whose temperatures move by 0.05 degC from reading to reading"
    slower(title, folder, work, repeats, lmfit)
    folder = write_files(work / "gaps", max(count // 10, 20), missing=0.05)
    slower("files of which 5 % of the rows are missing", folder, work, repeats, lmfit)


def slower(title: str, folder: Path, work: Path, repeats: int, lmfit: float) -> None:
    """Files that take longer, as each has something of its own that the others do not share."""

    def batch(jobs: int) -> Callable[[], object]:
        return lambda: accelcal.write_batch(
            folder, work / f"{folder.name}{jobs}.parquet", jobs=jobs
        )

    names = ("batch to Parquet, one process", "batch to Parquet")
    spent = timed(dict(zip(names, map(batch, (1, JOBS)), strict=True)), repeats)
    table, count = [("what", "us a file", "times lmfit")], sum(1 for _ in folder.iterdir())
    for name, seconds in spent.items():
        cost = 1e6 * seconds / count
        table.append((name, f"{cost:.0f}", f"{lmfit / cost:.0f}" if np.isfinite(lmfit) else ""))
    show(f"{count} {title}", table)


def growth(folder: Path, work: Path, repeats: int, steps: int) -> None:
    """Ten times the files, which are the same under more names, and ten times the readings."""
    names = [10**step for step in range(1, steps)]
    files = [folder, *(with_names(folder, work / f"names{n}", n) for n in names)]
    few = sorted(folder.glob("*.csv"))[::100]
    readings = [with_more_strokes(few, work / f"strokes{n}", n) for n in (1, *names, 10**steps)]
    count = sum(1 for _ in folder.glob("*.csv"))
    grown(f"Ten times the files, from {count} of 162 readings", files, work, repeats)
    grown(f"Ten times the readings, from 162 in {len(few)} files", readings, work, repeats)


def grown(title: str, folders: Sequence[Path], work: Path, repeats: int) -> None:
    """What each folder costs, and the ratio to the one before."""
    to_parquet(folders[0], work)  # loads what it needs
    spent = timed(
        {str(folder): lambda folder=folder: to_parquet(folder, work) for folder in folders}, repeats
    )
    lines = [("times", "s", "ratio to the row above", "peak in one process, MiB")]
    before = float("nan")
    for step, folder in enumerate(folders):
        seconds = spent[str(folder)]
        ratio = f"{seconds / before:.1f}" if step else ""
        lines.append((f"{10**step}", f"{seconds:.2f}", ratio, f"{peak(folder, work):.0f}"))
        before = seconds
    show(title, lines)


def to_parquet(folder: Path, work: Path) -> None:
    accelcal.write_batch(folder, work / "growth.parquet", jobs=JOBS)


def with_names(folder: Path, target: Path, names: int) -> Path:
    """A folder in which each file has several names."""
    target.mkdir()
    for path in folder.glob("*.csv"):
        for number in range(names):
            os.link(path, target / f"{path.stem}-{number}.csv")
    return target


def with_more_strokes(paths: Sequence[Path], target: Path, turns: int) -> Path:
    """A folder of files with the readings of each run several times, whose strokes count on."""
    target.mkdir()
    for path in paths:
        text = path.read_text()
        end = text.index(HEADINGS) + len(HEADINGS) + 1
        head, lines = text[:end], text[end:].splitlines()
        per_run = len(lines) // 3
        found = []
        for run in range(0, len(lines), per_run):
            for turn in range(turns):
                for line in lines[run : run + per_run]:
                    temperature, position, stroke, output = line.split(",")
                    found.append(f"{temperature},{position},{int(stroke) + 6 * turn},{output}")
        (target / path.name).write_text(head + "\n".join(found) + "\n")
    return target


def peak(path: Path, work: Path) -> float:
    """Largest memory of a batch in one process [MiB]; Linux only."""
    script = (
        "import sys, accelcal\n"
        "accelcal.write_batch(sys.argv[1], sys.argv[2])\n"
        "status = open('/proc/self/status').read()\n"
        "print(int(status.split('VmHWM:')[1].split()[0]) / 1024)\n"
    )
    arguments = [sys.executable, "-c", script, str(path), str(work / "p.parquet")]
    return float(subprocess.run(arguments, capture_output=True, text=True, check=True).stdout)


def one_large_file(work: Path, count: int, repeats: int) -> None:
    """One file of many serials, and a tenth of it."""
    large = write_serials(work / "large.csv", count)
    small = write_serials(work / "small.csv", count // 10)
    table = pd.read_csv(large, comment="#")
    table.to_parquet(work / "large.parquet", row_group_size=200_000)

    def reader() -> None:
        with csv.open_csv(large, csv.ReadOptions(use_threads=False, skip_rows=1)) as stream:
            for _ in stream:
                pass

    def batch(name: str) -> Callable[[], object]:
        return lambda: accelcal.write_batch(work / name, work / "s.parquet", jobs=JOBS)

    names = ("pyarrow reads the CSV, one thread", "batch of the CSV", "batch of the Parquet")
    spent = timed(
        dict(zip(names, (reader, batch("large.csv"), batch("large.parquet")), strict=True)), repeats
    )
    lines = [("what", "s", "rate to the reader alone", "peak in one process")]
    peaks = [
        "",
        f"{peak(large, work):.0f} MiB",
        f"{peak(work / 'large.parquet', work):.0f} MiB",
    ]
    for name, most in zip(names, peaks, strict=True):
        lines.append(
            (name, f"{spent[name]:.2f}", f"{100 * spent[names[0]] / spent[name]:.0f} %", most)
        )
    lines.append(("batch of a tenth of the CSV", "", "", f"{peak(small, work):.0f} MiB"))
    show(
        f"One file of {count} serials, {162 * count} rows, {large.stat().st_size / 1e6:.0f} MB",
        lines,
    )


def cluster(folder: Path, work: Path, repeats: int, *, processes: bool) -> None:
    """Processes and a Dask cluster that stands, of processes or, in a smoke, of threads."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=JOBS, threads_per_worker=1, dashboard_address=None, processes=processes
    ) as standing:
        address = standing.scheduler_address
        accelcal.write_batch(f"{folder}/00*.csv", work / "w.parquet", dask=address)  # imports
        spent = timed(
            {
                "processes": lambda: accelcal.write_batch(folder, work / "a.parquet", jobs=JOBS),
                "Dask": lambda: accelcal.write_batch(folder, work / "b.parquet", dask=address),
            },
            repeats,
        )
    same = (work / "a.parquet").read_bytes() == (work / "b.parquet").read_bytes()
    share = f"{100 * spent['processes'] / spent['Dask']:.0f} %"
    lines = [("workers", "s", "throughput"), ("processes", f"{spent['processes']:.2f}", "100 %")]
    lines.append(("Dask", f"{spent['Dask']:.2f}", share))
    show(f"A cluster of {JOBS} workers; the same bytes: {'yes' if same else 'NO'}", lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=10_000)
    parser.add_argument("--serials", type=int, default=100_000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--smoke", action="store_true", help="60 files, 100 serials, once")
    parser.add_argument("--only", choices=["files", "growth", "large", "dask"], action="append")
    options = parser.parse_args()
    if options.smoke:
        options.files, options.serials, options.repeats = 60, 100, 1
    wanted = options.only or ["files", "growth", "large", "dask"]
    with tempfile.TemporaryDirectory() as name:
        work, repeats = Path(name), options.repeats
        folder = work / "archive"
        if wanted != ["large"]:
            write_files(folder, options.files)
        if "files" in wanted:
            few = max(options.files // 50, 5)
            files(folder, work, options.files, few, repeats)
        if "growth" in wanted:
            growth(folder, work, repeats, 1 if options.smoke else STEPS)
        if "large" in wanted:
            one_large_file(work, options.serials, repeats)
        if "dask" in wanted:
            cluster(folder, work, repeats, processes=not options.smoke)


if __name__ == "__main__":
    main()
