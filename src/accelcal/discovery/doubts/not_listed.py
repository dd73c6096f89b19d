"""What no catalogue lists, and explains the readings as well as a named effect does.

A bias that goes with the root of the time, or its square, looks like a drift or a warm-up, another
k2 of one run like one that goes with the temperature.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import coefficient_columns
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import is_needed
from accelcal.discovery.instance import Instance, replaced
from accelcal.discovery.spans import orthonormal, squares_in
from accelcal.numerics.sorting import distinct

_LAWS: Mapping[str, Callable[[Array], Array]] = MappingProxyType(
    {"root": np.sqrt, "square": np.square}
)
"""Laws by which something slow goes with the part of the time that has passed."""


class NotListed(NamedTuple):
    """A pattern: what it is, what would tell, and the change of the readings, shape (n,)."""

    what: str
    remedy: str
    column: Array


def not_listed(
    comparison: Comparison, instances: Sequence[Instance]
) -> Iterator[tuple[str, NotListed]]:
    """Find what explains the readings best in place of each effect that is not due beside it.

    Yields the id of the effect and the pattern.
    """
    patterns = [*_of_time(comparison), *_of_one_run(comparison)]
    seen = comparison.space.see(np.stack([one.column for one in patterns], axis=1))
    for place, item in enumerate(instances):
        others = comparison.span(replaced(instances, place))
        beside = [orthonormal(np.hstack([others, column[:, None]])) for column in seen.T]
        squares = [squares_in(basis, comparison.seen) for basis in beside]
        best = int(np.argmax(squares))
        if not is_needed(comparison, item, beside[best]):
            yield item.effect.id, patterns[best]


def _of_time(comparison: Comparison) -> Iterator[NotListed]:
    """A coefficient that goes with the time of the record, or of each run, by some law."""
    c = comparison.model.conditions
    times = {"the record": c.time, "each run": c.run_time}
    if np.ptp(c.run) == 0:
        del times["each run"]
    for what, acts in coefficient_columns(c).items():
        for where, time in times.items():
            part = time / (time.max() or 1.0)
            for name, law in _LAWS.items():
                said = f"a {what} that goes with the {name} of the time in {where}"
                yield NotListed(said, "a longer record tells", c.gain * acts * law(part))


def _of_one_run(comparison: Comparison) -> Iterator[NotListed]:
    """A k2 or k3 that is another in one of several runs."""
    c, labels = comparison.model.conditions, comparison.record.run_labels
    remedy = "repeat that run at its temperature"
    runs = distinct(c.run).tolist()
    for run in runs if len(runs) > 1 else ():
        for power in (2, 3):
            column = np.where(c.run == run, c.gain * c.input**power, 0.0)
            yield NotListed(f"another k{power} of run {labels[run]} alone", remedy, column)
