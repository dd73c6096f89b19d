"""What wanders slowly, as a random walk, where nothing disagrees but it passes for noise.

Noise of the readings may have a memory, of up to half from one to the next. What is slower is none
of theirs. The means of the cycles show it best, so that nothing but what is the same in all strokes
is taken out before.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import coefficient_columns, repeated
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance, columns_of
from accelcal.discovery.unnamed.beside_noise import MOST, Kind, tried
from accelcal.discovery.unnamed.wandering import half_waves, size_in_a_run
from accelcal.results.findings import Unexplained

_MEMORY = (0.0, 0.5)
"""Correlations of neighbouring readings that their noise may have."""

_SIZES = np.geomspace(0.2, 2000.0, 14)
"""Sizes of the wandering that are tried, in standard deviations of a reading."""

_SHARE = 0.2
"""Part of the false-alarm rate that is for something slow."""

_WEIGHTS = {"bias": 1.0, "scale factor": 0.5, "misalignment": 0.5}


def slow(
    comparison: Comparison, instances: Sequence[Instance], alpha: float, seed: int = 0
) -> Unexplained | None:
    """Find a bias, a scale factor or a misalignment that wanders beside some effects.

    There is none where noise with a memory of half often looks like it, at a false-alarm rate
    alpha, or where there are more than 600 degrees of freedom.
    """
    taken = _taken(comparison, instances)
    if taken is None:
        return None
    kinds = _kinds(comparison)
    trial = tried(comparison, taken, list(kinds.values()), _MEMORY, _SHARE, seed)
    best = trial.best(alpha)
    if best is None:
        return None
    what, (kind, _) = list(kinds.items())[best]
    see, white, (which, *_) = trial.likeliest(best)
    columns = kind.columns(0)
    acting = see @ columns
    normal = acting.T @ acting + np.eye(kind.each) / kind.variances[which]
    change = columns @ np.linalg.solve(normal, acting.T @ white)
    lost = comparison.seen - comparison.space.see(change)
    share = 1.0 - float(lost @ lost) / float(comparison.seen @ comparison.seen)
    c = comparison.model.conditions
    acts = c.gain * coefficient_columns(c)[what]
    rms = float(np.sqrt((change @ change) / (acts @ acts)))
    size = size_in_a_run(what, rms)
    told = f"something slow: most like a {what} that wanders, as a random walk, by {size}"
    return Unexplained(told, min(max(share, 0.0), 1.0), float(trial.p_values[best]))


def _taken(comparison: Comparison, instances: Sequence[Instance]) -> Array | None:
    """Columns of what is the same in all strokes, and of some effects; None beside too many."""
    c, model = comparison.model.conditions, comparison.model
    repeats = repeated(c, comparison.record.mounting)
    if comparison.space.size - repeats.shape[1] > MOST:
        return None
    return np.hstack([repeats, model.jacobian(comparison.parameters), columns_of(instances, c)])


def _kinds(comparison: Comparison) -> dict[str, tuple[Kind, float]]:
    """One disturbance of each kind, of all half waves in each run, with its weight."""
    from scipy.sparse import csr_array  # type: ignore[import-untyped]

    c = comparison.model.conditions
    waves, frequency = half_waves(c)

    def acting(column: Array) -> Kind:
        rows = ((c.gain * column)[:, None] * waves / frequency).T
        return Kind(len(rows), csr_array(rows), tuple((_SIZES**2).tolist()), lambda *_: "")

    return {
        what: (acting(column), _WEIGHTS[what]) for what, column in coefficient_columns(c).items()
    }
