"""Effects as documents tell them: with the sizes that were found, ready to be used again."""

from __future__ import annotations

from collections.abc import Iterable

from accelcal.effects.effect import Disturbance
from accelcal.effects.empirical import effect_of
from accelcal.results.findings import FoundEffect


def disturbances(found: Iterable[FoundEffect]) -> tuple[Disturbance, ...]:
    """Give effects of the catalogue, or empirical ones, the sizes that were found.

    Parameters
    ----------
    found : iterable of FoundEffect
        Effects of a discovery.

    Returns
    -------
    tuple of Disturbance
        The effects with all their parameters.

    Raises
    ------
    InputError
        If an effect is not in the catalogue, or a parameter breaks a rule.
    """
    return tuple(map(_disturbance, found))


def _disturbance(found: FoundEffect) -> Disturbance:
    entry = effect_of(found.id, found.parameters)
    values = {name: quantity.value or 0.0 for name, quantity in found.parameters.items()}
    first = values.pop(entry.parameters[0].name, 0.0)
    return entry.of(first, **values)
