"""The picture of the README: a gap that shrinks, and an effect that closed it.

``python docs/gap_picture.py [FILE]`` writes it, by default to ``docs/gap.png``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt

import accelcal
from accelcal.effects.catalogue import effect

HIDDEN = (effect("hysteresis").of(2e-5), effect("scale-factor-asymmetry").of(2e-4))


def write(path: Path) -> None:
    """Hide two effects in a record, find them, and draw the gap and the first of them."""
    record = accelcal.simulate(effects=HIDDEN, seed=3)
    found = accelcal.discover(record)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    found.plot.gap(left)
    found.plot.signature(record, HIDDEN[0].effect.id, right)
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("gap.png"))
