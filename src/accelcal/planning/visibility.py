"""Which effects of the catalogue a test would show, by the audit of the discovery."""

from __future__ import annotations

import numpy as np

from accelcal.accelerometer import Accelerometer
from accelcal.discovery.candidates import searched_among
from accelcal.discovery.family import family_of, with_rates
from accelcal.discovery.noise import ReadingNoise
from accelcal.discovery.prospects.aliases import aliases
from accelcal.discovery.prospects.audit import designed, smallest_detectable, undetectable
from accelcal.results.designs import Visibility
from accelcal.simulation import NOISE_FREE, NoiseComponents, TumblePlan, simulate


def visibility(
    plan: TumblePlan, noise: NoiseComponents, accelerometer: Accelerometer, *, declared: bool = True
) -> tuple[Visibility, ...]:
    """Tell for each effect of the catalogue whether a test would show it, and from what size.

    Parameters
    ----------
    plan : TumblePlan
        The test.
    noise : NoiseComponents
        Errors of readings and stand.
    accelerometer : Accelerometer
        What is tested.
    declared : bool, default True
        Whether the errors of the stand will be declared.

    Returns
    -------
    tuple of Visibility
        First the effects that coefficients absorb, then those that can be seen.

    Raises
    ------
    InputError
        If the test has too few replicates for anything to be discovered.

    Examples
    --------
    >>> from accelcal.simulation import AL15
    >>> found = visibility(TumblePlan(), NoiseComponents(), AL15)
    >>> {item.id: item.absorbed_by for item in found}["odd-quadratic"]
    ('K1', 'K3')
    """
    record = simulate(accelerometer, plan, NOISE_FREE, seed=0, declare=False)
    if declared:
        record = record.with_apparatus(**noise.declared())
    reference = accelerometer.reference_temperature
    sigma = ReadingNoise(max(noise.reading, 1e-12), rho=0.0, dof=0, tails=np.inf)
    comparison = designed(record, reference, sigma, plan.delta0)
    family = with_rates(family_of(comparison, searched_among()))
    found, seen = family.candidates, smallest_detectable(family)
    alike = {item.id: item.exact for item in aliases(found)}
    return (
        *(Visibility(item.id, item.absorbed_by, None) for item in undetectable(comparison, found)),
        *(Visibility(size.id, None, size.value, size.unit, alike[size.id]) for size in seen),
    )
