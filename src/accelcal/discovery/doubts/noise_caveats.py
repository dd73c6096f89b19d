"""What a reader must know of the noise, in which a disturbance may hide."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from accelcal.discovery.comparison import Comparison
from accelcal.discovery.doubts.caveats import Caveat
from accelcal.discovery.instance import Instance
from accelcal.discovery.noise.pure_error import TOO_LOUD, LoudRun
from accelcal.plural import are, listed

_UNEVEN = 1.2
"""Ratio of the noise of two readings that is told."""

_SLOW = 0.5
"""Correlation of neighbours from which the verdict tells it."""

_LOUD, _CHANCE = 4.0, 1e-3
"""Scatter of a run over that of the others from which the verdict tells it, and the chance of it
below which it is one."""

_BEYOND_STD = 3.0
"""Noise over the declared one from which the verdict tells it."""


def noise_caveats(
    comparison: Comparison, instances: tuple[Instance, ...], loud: LoudRun | None
) -> Iterator[Caveat]:
    """Tell what a reader must know of the noise, beside some effects, and of its loudest run."""
    yield from _of_memory(comparison)
    yield from _of_runs(comparison, instances, loud)
    yield from _of_std(comparison)
    if comparison.noise.heavy:
        yield Caveat("the noise has heavier tails than a normal one, and is judged accordingly")


def _of_memory(comparison: Comparison) -> Iterator[Caveat]:
    rho = comparison.noise.rho
    if comparison.noise.remembers:
        slow = ": a slow disturbance that no entry of the catalogue describes looks like it"
        yield Caveat(
            f"neighbouring readings are correlated ({rho:+.2f}), which counts as noise with a"
            f" memory{slow if rho > 0.0 else ''}",
            reservation=f"neighbouring readings are correlated by {rho:+.2f}, as a slow disturbance"
            " makes them"
            if rho >= _SLOW
            else "",
        )


def _of_runs(
    comparison: Comparison, instances: tuple[Instance, ...], loud: LoudRun | None
) -> Iterator[Caveat]:
    """Readings that are weighted, and a run that scatters much more than the others."""
    relative = comparison.noise.relative
    ratio = 1.0 if relative is None else float(relative.max() / relative.min())
    if ratio >= _UNEVEN:
        by = "the scatter of their run" if comparison.record.std is None else "their std"
        yield Caveat(
            f"the readings are weighted by {by}, the largest of which is {ratio:.2g} times the"
            " smallest"
        )
    if loud is None or loud.ratio < _LOUD or loud.p_value >= _CHANCE:
        return
    label = comparison.record.run_labels[loud.run]
    told = f"run {label} scatters {loud.ratio:.2g} times as much as the others"
    unsure = [item.effect.id for item in instances] if loud.ratio >= TOO_LOUD else []
    not_sure = f"{listed(unsure)} {are(unsure)} not sure: " if unsure else ""
    yield Caveat(
        f"{not_sure}{told}, by noise or by what acts in it for a time; look at its readings, or"
        " repeat it",
        unsure,
        reservation=told,
    )


def _of_std(comparison: Comparison) -> Iterator[Caveat]:
    """Readings that scatter by far more than their samples do."""
    std, count = comparison.record.std, comparison.record.count
    if std is None or not np.all(std > 0.0):
        return
    squares = std**2 / (1.0 if count is None else np.maximum(count, 1.0))
    declared = float(np.sqrt(np.mean(squares))) / abs(comparison.model.nominal)
    ratio = comparison.noise.sigma / declared
    if ratio >= _BEYOND_STD:
        told = f"the readings scatter {ratio:.2g} times more than their std says"
        yield Caveat(
            f"{told}: something acts between them that is not in the samples of one reading",
            reservation=told,
        )
