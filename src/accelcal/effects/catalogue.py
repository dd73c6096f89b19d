"""The ordered catalogue of all effects."""

from __future__ import annotations

from accelcal.effects import readings, shape, stand, temperature, time
from accelcal.effects.effect import Effect
from accelcal.errors import InputError

__all__ = ["catalogue", "effect"]

_ENTRIES = (
    *shape.EFFECTS,
    *temperature.EFFECTS,
    *time.EFFECTS,
    *stand.EFFECTS,
    *readings.EFFECTS,
)
_BY_ID = {entry.id: entry for entry in _ENTRIES}


def catalogue() -> tuple[Effect, ...]:
    """All effects, in the order in which they are searched and listed.

    Returns
    -------
    tuple of Effect
        The entries.

    Examples
    --------
    >>> [entry.id for entry in catalogue() if entry.acts_on == "temperature"]
    ['chamber-drift']
    """
    return _ENTRIES


def effect(name: str) -> Effect:
    """Look up one effect by its id.

    Parameters
    ----------
    name : str
        The id.

    Returns
    -------
    Effect
        The entry.

    Raises
    ------
    InputError
        If there is none; the message lists ids that are spelt alike.

    Examples
    --------
    >>> effect("warm-up").name
    'warm-up of the bias'
    """
    if name not in _BY_ID:
        raise InputError(f"effect {name!r} is not in the catalogue; {_suggestion(name)}")
    return _BY_ID[name]


def _suggestion(name: str) -> str:
    from difflib import get_close_matches

    near = get_close_matches(name.lower(), _BY_ID, n=3, cutoff=0.5)
    near += [known for known in _BY_ID if name and name.lower() in known and known not in near]
    return f"did you mean {' or '.join(near[:3])}?" if near else f"it has {', '.join(_BY_ID)}"
