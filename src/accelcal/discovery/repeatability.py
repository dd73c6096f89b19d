"""Whether readings repeat as well as those of the calibration that they are compared with."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.discovery.noise import ReadingNoise
from accelcal.gates.verdict import acceleration
from accelcal.numerics.probability import f_survival
from accelcal.results.calibration import Calibration

_WORSE = 3.0
"""Noise over that of the calibration from which it may hide a disagreement."""

_CHANCE = 1e-6
"""Chance of the same noise below which it is another."""


class KnownNoise(NamedTuple):
    """Noise of a reading of the calibration.

    Attributes
    ----------
    sigma : float
        Standard deviation [g].
    dof : float
        Degrees of freedom; infinite where it was declared.
    """

    sigma: float
    dof: float


def known_noise(calibration: Calibration, scale_factor: float) -> KnownNoise | None:
    """Root mean square of a reading's noise over the tables of a calibration; None without any.

    The scale factor is K1 at T0 [output unit / g].
    """
    found = [s for s in calibration.error_sources if s.name == "reading" and s.value]
    if not found:
        return None
    sigma = np.sqrt(np.mean([(source.value or 0.0) ** 2 for source in found]))
    dof = sum(np.inf if source.dof is None else source.dof for source in found)
    return KnownNoise(float(sigma) / abs(scale_factor), float(dof))


def worse_than_known(noise: ReadingNoise, known: KnownNoise | None) -> str:
    """Say that readings scatter far more than those of the calibration; empty where they do not."""
    if known is None or not noise.dof or noise.sigma < _WORSE * known.sigma:
        return ""
    if f_survival((noise.sigma / known.sigma) ** 2, noise.dof, known.dof) > _CHANCE:
        return ""
    return (
        f"the readings scatter by {acceleration(noise.sigma)}, those of the calibration by"
        f" {acceleration(known.sigma)}: such noise hides disagreements; look for an outlier or a"
        " coarse step by accelcal fit, and mend it"
    )
