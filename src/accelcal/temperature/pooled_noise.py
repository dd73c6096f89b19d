"""One reading noise for all runs, where they do not differ: weights of few replicates mislead.

Weights that follow the scatter of each run favour the runs that happened to scatter little, and the
intervals must make up for it. With ten degrees of freedom a run, one noise for all makes intervals
that are a twentieth shorter and hold the truth as they should (``benchmarks/coverage.py``, the
regime of two strokes and three temperatures; of single weights with ``--choices``).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from accelcal.arrays import Mask
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.uneven_noise import differ

_SIGNIFICANT = 0.01
_OF_ALL = "replicates of all tables"


def pooled_noise(noises: Sequence[ReadingNoise], bare: Sequence[bool]) -> list[ReadingNoise]:
    """Pool the noise of the runs of each record unless their replicates differ.

    Parameters
    ----------
    noises : sequence of ReadingNoise
        Noise of each run of R records.
    bare : sequence of bool
        Whether the run declares no scatter of its readings; one that does keeps its noise.

    Returns
    -------
    list of ReadingNoise
        Noise of each run; equal where pooled.

    Examples
    --------
    >>> import numpy as np
    >>> runs = [ReadingNoise.of(np.array([size]), 10.0, "replicates") for size in (1.0, 1.2)]
    >>> pooled = pooled_noise(runs, [True, True])
    >>> [(noise.factor.round(3).tolist(), noise.dof.tolist()) for noise in pooled]
    [([1.105], [20.0]), ([1.105], [20.0])]
    """
    # one record speaks for all: noise that is not declared has the same source in each of them
    own = [n for n, is_bare in zip(noises, bare, strict=True) if is_bare and n.source[0] != _OF_ALL]
    if not own or any(noise.source[0] != "replicates" for noise in own):
        return list(noises)
    pool = next((noise for noise in noises if noise.source[0] == _OF_ALL), None) or _pooled(own)
    differ = _differ(own)
    return [
        _chosen(differ, noise, pool) if is_bare else noise
        for noise, is_bare in zip(noises, bare, strict=True)
    ]


def _chosen(first: Mask, noise: ReadingNoise, other: ReadingNoise) -> ReadingNoise:
    return ReadingNoise(*(np.where(first, a, b) for a, b in zip(noise, other, strict=True)))


def _pooled(noises: Sequence[ReadingNoise]) -> ReadingNoise:
    dof = np.sum([noise.dof for noise in noises], axis=0)
    variance = np.sum([noise.dof * noise.factor**2 for noise in noises], axis=0) / dof
    return ReadingNoise.of(np.sqrt(variance), 0.0, _OF_ALL)._replace(dof=dof)


def _differ(noises: Sequence[ReadingNoise]) -> Mask:
    if len(noises) < 2:
        return np.zeros(1, dtype=np.bool_)
    variance = np.array([noise.factor**2 for noise in noises])
    return differ(variance, np.array([noise.dof for noise in noises]), _SIGNIFICANT)
