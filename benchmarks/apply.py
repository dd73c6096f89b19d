"""How long ``accelcal apply`` of a long stream takes, and how much memory.

Writes a stream of samples, applies a calibration to it in a process of its own, and prints wall and
processor time and the peak of the memory. Needs a POSIX system::

    python benchmarks/apply.py --samples 10000000
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import accelcal

CHUNK = 100_000


def write_stream(path: Path, samples: int) -> None:
    """Time, output and temperature of a slow ride between -20 and 60 degC."""
    rng = np.random.default_rng(1)
    with path.open("w", encoding="utf-8") as file:
        file.write("# unit: mA\ntime,output,temperature\n")
        for start in range(0, samples, CHUNK):
            index = start + np.arange(min(CHUNK, samples - start))
            temperature = 20.0 + 40.0 * np.sin(1e-5 * index)
            output = 1.35 * (rng.uniform(-0.95, 0.95, index.size) + 0.003)
            rows = zip((1e-3 * index).tolist(), output.tolist(), temperature.tolist(), strict=True)
            file.write("".join(map("%.3f,%.7f,%.2f\n".__mod__, rows)))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=10_000_000)
    parser.add_argument("--smoke", action="store_true", help="few samples, to see that it works")
    options = parser.parse_args()
    samples = 1000 if options.smoke else options.samples
    with TemporaryDirectory() as folder:
        calibration, data = Path(folder, "calibration.json"), Path(folder, "data.csv")
        accelcal.fit(accelcal.simulate(seed=1)).to_json(calibration)
        write_stream(data, samples)
        size = data.stat().st_size
        result = ["-o", str(Path(folder, "out.csv"))]
        command = [sys.executable, "-m", "accelcal", "apply", str(calibration), str(data), *result]
        start = time.perf_counter()
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
        wall = time.perf_counter() - start
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    peak = used.ru_maxrss / (1024.0**2 if sys.platform == "darwin" else 1024.0)
    print(f"{samples} samples, {size / 1e6:.1f} MB; load {os.getloadavg()[0]:.2f}")
    print(f"wall {wall:.2f} s, CPU {used.ru_utime + used.ru_stime:.2f} s, peak {peak:.0f} MiB")


if __name__ == "__main__":
    main()
