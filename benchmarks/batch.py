"""How fast stacked tables are estimated, against loops of the usual packages and against memory.

Prints medians of runs that alternate with one another, and their ratios. Rivals are timed on a few
hundred of the tables, as time a table, and leave readings out only where some are missing. Memory
is touched beforehand. How time grows is seen on so many tables that the half millisecond, in which
the design is prepared, does not count. Needs the packages of the extra ``benchmarks``; set the
number of threads of the linear algebra to one::

    OPENBLAS_NUM_THREADS=1 python benchmarks/batch.py --runs 11

Tried and left, as it is slower or gains next to nothing:

- products with the whole design in the layout of the readings, which take longer than transposing
  them and their means, and do not serve tables with gaps;
- smaller blocks, as each operation takes a microsecond to begin with, and larger ones, which do
  not stay in the cache; two threads, which for complete tables lose in blocks of any size;
- transposing by a product, together with the subtraction of the reference, or without reading the
  memory in order beforehand; telling gaps by a dot product instead of the maximum, which copies
  readings whose columns lie together;
- the sums of replicates by a product with ones, and those of their squares by one with the
  precisions; the two parts of the design in one product.
"""

from __future__ import annotations

import argparse
import os
import platform
import time
import tracemalloc
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from statistics import median

import numpy as np

from accelcal import accelerations, design_matrix, estimate_tables
from accelcal.head_angles import turn_angles

ANGLES = np.concatenate([turn_angles(8), turn_angles(8)[::-1]] * 3)
DESIGN = design_matrix(accelerations(ANGLES))
SIGMA = 4e-6
FEW = 300
"""Tables that the rivals are timed on."""


def tables(count: int, missing: float = 0.0, seed: int = 1) -> np.ndarray:
    """Readings of tables of 54 readings, each of its own accelerometer."""
    rng = np.random.default_rng(seed)
    truth = np.array([0.004, 1.3, 1.4e-4, 1.1e-4, 1.5e-3, 3e-5])
    y = (truth * (1.0 + 0.05 * rng.standard_normal((count, 6)))) @ DESIGN.T
    y += SIGMA * rng.standard_normal(y.shape)
    if missing:
        y[rng.random(y.shape) < missing] = np.nan
    return y


# -- rivals: one table at a time, coefficients with standard uncertainties -------------------------


def by_lstsq(y: np.ndarray) -> None:
    """numpy.linalg.lstsq: coefficients and squares only."""
    gaps = bool(np.isnan(y).any())
    for row in y:
        known = ~np.isnan(row) if gaps else slice(None)
        np.linalg.lstsq(DESIGN[known], row[known], rcond=None)


def by_statsmodels(y: np.ndarray) -> None:
    """Ordinary least squares of statsmodels."""
    import statsmodels.api as sm

    for row in y:
        found = sm.OLS(row, DESIGN, missing="drop").fit()
        _ = found.params, found.bse, found.mse_resid


def by_robust_statsmodels(y: np.ndarray) -> None:
    """Robust linear model of statsmodels with Huber's function, 10 iterations."""
    import statsmodels.api as sm

    for row in y:
        found = sm.RLM(row, DESIGN, M=sm.robust.norms.HuberT()).fit(maxiter=10, tol=0.0)
        _ = found.params, found.bse


def by_lmfit(y: np.ndarray) -> None:
    """Minimiser of lmfit on the residuals of equation (1)."""
    import lmfit

    for row in y:
        parameters = lmfit.Parameters()
        for i in range(6):
            parameters.add(f"k{i}", value=float(i == 1))
        lmfit.minimize(
            lambda p, row=row: row - DESIGN @ np.array([p[f"k{i}"].value for i in range(6)]),
            parameters,
        )


# -- measuring -------------------------------------------------------------------------------------


def medians(jobs: Mapping[str, tuple[Callable[[], object], int]], runs: int) -> dict[str, float]:
    """Median time a table of each job [s], of runs in turn after one that warms up."""
    times: dict[str, list[float]] = {name: [] for name in jobs}
    for run in range(runs + 1):
        for name, (job, count) in jobs.items():
            start = time.perf_counter()
            job()
            if run:
                times[name].append((time.perf_counter() - start) / count)
    return {name: median(taken) for name, taken in times.items()}


def show(title: str, times: Mapping[str, float], ours: str) -> None:
    """Print times a table and ratios to ours."""
    print(f"\n{title:<44}{'a table [us]':>14}{'ratio':>12}")
    for name, taken in times.items():
        print(f"{name:<44}{taken * 1e6:>14.3f}{taken / times[ours]:>12.3g}")


def compare(count: int, threads: int, runs: int) -> None:
    """Complete tables, tables with gaps and robust fits against their rivals."""
    ours, alone = f"accelcal, {threads} threads", "accelcal, 1 thread"
    whole, gaps = tables(count), tables(count, 0.05)
    few, few_gaps = whole[:FEW].copy(), gaps[:FEW].copy()

    def mine(y: np.ndarray, share: int, **options: bool) -> dict[str, tuple]:
        part = y[:share]
        return {
            ours: (lambda: estimate_tables(part, ANGLES, threads=threads, **options), share),
            alone: (lambda: estimate_tables(part, ANGLES, threads=1, **options), share),
        }

    jobs = mine(whole, count) | {
        "numpy.linalg.lstsq": (lambda: by_lstsq(few), FEW),
        "statsmodels OLS": (lambda: by_statsmodels(few), FEW),
        "lmfit": (lambda: by_lmfit(few[:30]), 30),
        "reading the memory, 1 thread": (whole.sum, count),
    }
    show("complete tables of 54 readings", medians(jobs, runs), alone)
    jobs = mine(gaps, count) | {
        "numpy.linalg.lstsq": (lambda: by_lstsq(few_gaps), FEW),
        "statsmodels OLS": (lambda: by_statsmodels(few_gaps), FEW),
    }
    show("5 % of the readings missing", medians(jobs, runs), alone)
    jobs = mine(whole, max(count // 10, 1), robust=True) | {
        "statsmodels RLM, 10 iterations": (lambda: by_robust_statsmodels(few[:100]), 100)
    }
    show("robust, until the centres have settled", medians(jobs, runs), alone)


def growth(count: int, runs: int) -> None:
    """Time and memory beside the readings and results of ten times as many tables, one thread."""
    many = tables(count)
    few = many[: count // 10]
    jobs = {
        "a tenth": (lambda: estimate_tables(few, ANGLES), 1),
        "whole": (lambda: estimate_tables(many, ANGLES), 1),
    }
    times = medians(jobs, runs)
    print(f"\n{count} tables for {count // 10}: time x {times['whole'] / times['a tenth']:.2f}")
    for name, y in (("a tenth", few), ("whole", many)):
        print(f"peak memory beside readings and results, {name}: {worked_in(y) / 1e6:.2f} MB")


def worked_in(y: np.ndarray) -> int:
    """Peak memory beside readings and results [bytes], in a thread that has none from before."""
    tracemalloc.start()
    with ThreadPoolExecutor(1) as pool:
        found = pool.submit(estimate_tables, y, ANGLES).result()
    peak = tracemalloc.get_traced_memory()[1] - sum(a.nbytes for a in found[1:5])
    tracemalloc.stop()
    return peak


def machine() -> str:
    """What the figures depend on."""
    packages = ", ".join(f"{n} {version(n)}" for n in ("numpy", "statsmodels", "lmfit"))
    return (
        f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores,"
        f" load {os.getloadavg()[0]:.2f}; Python {platform.python_version()}, {packages}"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tables", type=int, default=200_000, help="tables of 54 readings")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="threads of accelcal")
    parser.add_argument("--runs", type=int, default=7, help="timed runs of each job")
    parser.add_argument("--smoke", action="store_true", help="few tables, to see that it works")
    options = parser.parse_args()
    count, runs = (3000, 1) if options.smoke else (options.tables, options.runs)

    print(machine())
    compare(count, options.threads, runs)
    growth(3 * count, runs)


if __name__ == "__main__":
    main()
