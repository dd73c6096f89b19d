"""What looks like an effect over these readings, and goes on for longer than they do.

A drift looks like the beginning of a warm-up that lasts much longer than the runs. Beside a drift,
K0 is the bias at the first reading, which either tells alike; beside the warm-up it is what the
bias comes to in the end, which no reading tells.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from accelcal.discovery.comparison import Comparison
from accelcal.discovery.doubts.dead_zone_or_cube import unlike
from accelcal.discovery.explanation import explain_as_well
from accelcal.discovery.instance import Instance, replaced
from accelcal.discovery.untold import scales
from accelcal.effects.effect import Effect
from accelcal.model import symbol_of
from accelcal.plural import listed


def said_of_ends(
    comparison: Comparison, instances: Sequence[Instance], entries: Sequence[Effect]
) -> Iterator[str]:
    """Say which of some effects explain the readings in place of one, however long they go on."""
    named = {item.effect.id for item in instances}
    unnamed = [entry for entry in entries if entry.id not in named]
    for place, item in enumerate(instances):
        for long, end in _at_the_end(comparison, unnamed):
            others = replaced(instances, place, long)
            if not explain_as_well(comparison, others, item):
                continue
            if hanging := unlike(comparison, instances, others):
                yield (
                    f"{long.effect.id} with {end} or any longer explains these readings as well as"
                    f" {item.effect.id}, with other values of {listed(map(symbol_of, hanging))};"
                    " nothing tells how long it lasts, and no U counts it; to tell:"
                    f" {long.effect.to_tell_apart}"
                )


def _at_the_end(
    comparison: Comparison, entries: Sequence[Effect]
) -> Iterator[tuple[Instance, str]]:
    """Effects with a time constant, at the end of the search."""
    for effect in entries:
        for parameter in scales(effect):
            end = float(parameter.searched_at(comparison.model.conditions)[-1])
            told = f"{parameter.name} of {end:.4g} {parameter.unit}"
            yield Instance(effect, (1.0,), {parameter.name: end}), told
