"""Effects that go on between runs, in records that do not tell how long that was."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import contribution
from accelcal.effects.effect import Disturbance
from accelcal.results.beyond_uncertainty import LEFT_OUT
from accelcal.units import HOUR


def said_of_pauses(comparison: Comparison, known: Sequence[Disturbance]) -> Iterator[str]:
    """Say what an hour before the second run would do by effects that are taken out."""
    time, c = comparison.record.time, comparison.model.conditions
    if time is not None and np.isfinite(time).all():
        return
    later = replace(c, time=c.time + HOUR * (c.run > 0))
    for item in known:
        change = np.abs(contribution(item, later) - contribution(item, c)).max()
        if change > 0.0:
            yield (
                f"no times: {item.effect.id} is taken out as if there were no pauses between the"
                f" runs; an hour moves readings by {1e3 * change:.2g} mg, and {LEFT_OUT}; give"
                " the readings a column time"
            )
