"""Each benchmark runs, and prints the figures that it is there for."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


def run(name, *arguments):
    done = subprocess.run(
        [sys.executable, BENCHMARKS / name, *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_coverage():
    printed = run("coverage.py", "--smoke", "--only", "head 2e-5 declared", "--jobs", "1")
    coverage = re.search(r"M_ip\n([ .\d]+)\n", printed)[1].split()
    assert len(coverage) == 6
    # of 60 intervals at 95 %, fewer than 47 hold the truth once in a million tries
    assert all(100.0 * 47 / 60 <= float(figure) <= 100.0 for figure in coverage)


def test_startup():
    printed = run("startup.py", "--smoke")
    assert re.search(r"import numpy, click +\d+\.\d\d +\d+\.\d\d", printed)


def test_apply():
    printed = run("apply.py", "--smoke")
    assert re.search(r"1000 samples.*\nwall \d+\.\d+ s, CPU \d+\.\d+ s, peak \d+ MiB", printed)


def test_stability_coverage():
    printed = run("stability_coverage.py", "--smoke")
    assert len(re.findall(r"^.{24}(?: +[01]\.\d{3}){3}$", printed, re.MULTILINE)) == 10


def test_gates():
    printed = run("gates.py", "--smoke", "--jobs", "1")
    clean = re.findall(r"^    (\w[\w ]*\w) +([\d.]+)$", printed, re.MULTILINE)
    found = re.findall(
        r"^  (\w.*\w) +([\d.]+) +([\d.]+)  (drift|closure|outlier)", printed, re.MULTILINE
    )
    assert {"drift", "resolution", "any gate"} <= {name for name, _ in clean}
    # of 60 tables at 1 %, more than 6 alarm once in a million tries
    assert all(float(rate) <= 100.0 * 6 / 20 for name, rate in clean if name != "any gate")
    rates = {fault: float(rate) for fault, rate, _, _ in found}
    assert rates["warm-up 1e-4 g, 900 s"] == rates["one reading 40 ug off"] == 100.0


@pytest.mark.parametrize("path", sorted(BENCHMARKS.glob("*.py")), ids=lambda path: path.name)
def test_each_benchmark_is_known_here(path):
    runnable = "__main__" in path.read_text("utf-8")
    assert not runnable or f'"{path.name}"' in Path(__file__).read_text("utf-8")
