"""Effects as documents tell them: with the sizes that were found, ready to be used again."""

from __future__ import annotations

from accelcal.effects.effect import Disturbance
from accelcal.effects.empirical import effect_of
from accelcal.results.findings import FoundEffect

__all__ = ["disturbance_of"]


def disturbance_of(found: FoundEffect) -> Disturbance:
    """Give an effect of the catalogue, or an empirical one, the size that was found.

    Parameters
    ----------
    found : FoundEffect
        Effect of a discovery.

    Returns
    -------
    Disturbance
        The effect with all its parameters.

    Raises
    ------
    InputError
        If the effect is not in the catalogue, or a parameter breaks a rule.
    """
    entry = effect_of(found.id, found.parameters)
    values = {name: quantity.value or 0.0 for name, quantity in found.parameters.items()}
    first = values.pop(entry.parameters[0].name, 0.0)
    return entry.of(first, **values)
