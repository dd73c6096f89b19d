"""The oracles of the tests can be imported by name; examples of Hypothesis have no deadline."""

import sys
from pathlib import Path

from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent / "oracles"))

# on a busy machine an example may take any time, and tests never assert times
settings.register_profile("accelcal", deadline=None)
settings.load_profile("accelcal")
