"""How long ``accelcal fit`` of a small table takes, against the imports it cannot do without.

Prints the medians of runs that alternate with one another, as wall and processor time, and their
ratios. Bytecode is cached, as it is where a package is installed. Needs a POSIX system; run it with
the Python of the environment that accelcal is installed in::

    python benchmarks/startup.py --runs 21
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import subprocess
import sys
import sysconfig
import time
from importlib.metadata import version
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[1]
FIT = "accelcal fit examples/al15.csv"


def commands() -> dict[str, list[str]]:
    """Name -> the command that is timed."""
    script = Path(sysconfig.get_path("scripts"), "accelcal")
    return {
        FIT: [str(script), "fit", str(ROOT / "examples" / "al15.csv")],
        "import numpy, click": [sys.executable, "-c", "import numpy, click"],
        "import numpy, pandas, click": [sys.executable, "-c", "import numpy, pandas, click"],
    }


def timed(command: list[str]) -> tuple[float, float]:
    """Wall and processor time of one run [s]."""
    cached = {key: text for key, text in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    before, start = processor_time(), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=cached)
    return time.perf_counter() - start, processor_time() - before


def processor_time() -> float:
    """Time that all children have spent on a processor so far [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def measure(runs: int) -> dict[str, tuple[float, float]]:
    """Median wall and processor time of each command, after a run that warms the disk cache."""
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in commands()}
    for run in range(runs + 1):
        for name, command in commands().items():
            taken = timed(command)
            if run:
                times[name].append(taken)
    return {
        name: (median(wall for wall, _ in taken), median(cpu for _, cpu in taken))
        for name, taken in times.items()
    }


def describe_machine() -> str:
    """What the figures depend on."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "pandas", "click"))
    return (
        f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores,"
        f" load {os.getloadavg()[0]:.2f}; Python {platform.python_version()}, {packages}"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=21, help="timed runs of each command")
    parser.add_argument("--smoke", action="store_true", help="one run, to see that it works")
    options = parser.parse_args()
    runs = 1 if options.smoke else options.runs

    print(describe_machine())
    times = measure(runs)
    print(f"{'median of ' + str(runs):<32}{'wall [ms]':>12}{'CPU [ms]':>12}")
    for name, (wall, cpu) in times.items():
        print(f"{name:<32}{wall * 1e3:>12.0f}{cpu * 1e3:>12.0f}")
    fit = times.pop(FIT)
    print(f"\n{'accelcal fit, as a ratio to':<32}{'wall':>12}{'CPU':>12}")
    for name, (wall, cpu) in times.items():
        print(f"{name:<32}{fit[0] / wall:>12.2f}{fit[1] / cpu:>12.2f}")


if __name__ == "__main__":
    main()
