"""Oracles, `hidden` and `rivals` are imported by name; Hypothesis is set for tests and for fuzzing.

The tests draw the same examples each time, so that a change alone can turn them red. To look for
new ones: ``HYPOTHESIS_PROFILE=fuzz pytest``, which draws ten times as many, at random.
"""

import os
import sys
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path

import pytest
from hypothesis import settings

# side by side, tests have a processor each; numpy is not loaded yet
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")

sys.path.insert(0, str(Path(__file__).parent / "oracles"))

# of the benchmarks these packages alone: others there have names of modules elsewhere
for name in ("hidden", "rivals"):
    found = PathFinder.find_spec(name, [str(Path(__file__).parents[1] / "benchmarks")])
    sys.modules[name] = module_from_spec(found)

# on a busy machine an example may take any time, and tests never assert times
settings.register_profile("accelcal", deadline=None, derandomize=True)
settings.register_profile("fuzz", deadline=None, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "accelcal"))


@pytest.fixture(autouse=True)
def no_figure_stays_open():
    """Close what a test has drawn: pyplot keeps it, and warns of too much of it elsewhere."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")
