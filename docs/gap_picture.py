"""The picture of the README: a gap that shrinks, and the two effects that closed it.

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
    """Hide two effects in a record, find them, and draw both with the gap."""
    record = accelcal.simulate(effects=HIDDEN, seed=3)
    found = accelcal.discover(record)
    figure, (left, *others) = plt.subplots(1, 3, figsize=(15, 4.2), layout="constrained")
    found.plot.gap(left)
    for disturbance, axes in zip(HIDDEN, others, strict=True):
        found.plot.signature(record, disturbance.effect.id, axes)
    figure.savefig(path, dpi=80)


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("gap.png"))
