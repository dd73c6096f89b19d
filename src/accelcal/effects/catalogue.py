"""The ordered catalogue of all effects: the built-in ones, then those that a user registers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

from accelcal.arguments.kinds import expect, kind_of
from accelcal.effects import readings, shape, stand, temperature, time
from accelcal.effects.effect import Effect
from accelcal.errors import InputError

__all__ = [
    "brought_along",
    "catalogue",
    "effect",
    "is_built_in",
    "refuse",
    "register",
    "registered",
    "unregister",
]

_BUILT_IN = (
    *shape.EFFECTS,
    *temperature.EFFECTS,
    *time.EFFECTS,
    *stand.EFFECTS,
    *readings.EFFECTS,
)
_BY_ID = {entry.id: entry for entry in _BUILT_IN}
_BRINGING = Lock()


def catalogue() -> tuple[Effect, ...]:
    """All effects, in the order in which they are searched and listed.

    Returns
    -------
    tuple of Effect
        The entries.

    Examples
    --------
    >>> import accelcal
    >>> [entry.id for entry in accelcal.catalogue() if entry.acts_on == "temperature"]
    ['chamber-drift']
    """
    return tuple(_BY_ID.values())


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
    >>> import accelcal
    >>> accelcal.effect("warm-up").name
    'warm-up of the bias'
    """
    if not isinstance(name, str):
        raise InputError(f"{kind_of(name)} in place of the id of an effect, such as 'backlash'")
    if name not in _BY_ID:
        raise InputError(
            f"effect {name!r} is not in the catalogue; {_suggestion(name)} (one of your own is"
            " registered first: accelcal.register, or --effects with its file)"
        )
    return _BY_ID[name]


def is_built_in(entry: Effect) -> bool:
    """Whether an effect comes with accelcal, and not from a user."""
    return any(entry is item for item in _BUILT_IN)


def register(*effects: Effect) -> None:
    """Add effects to the catalogue, for this process.

    From then on `accelcal.catalogue` has them, `accelcal.effect` finds them, `accelcal.simulate`
    takes them and `accelcal.discover` looks for those that have an amplitude.

    Parameters
    ----------
    *effects : Effect
        Effects of your own. Either all are added, or none.

    Raises
    ------
    InputError
        If an id is in the catalogue already, or an effect is not well formed.

    Notes
    -----
    Another process does not know them. An effect that is sent there takes itself along, if its
    term can be pickled: a function of a module can, a lambda cannot.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.register(
    ...     accelcal.Effect(
    ...         id="cross-axis-modulus",
    ...         name="modulus of the cross axis",
    ...         physics="The cross axis acts alike on both sides.",
    ...         formula="c |a_p|",
    ...         parameters=(accelcal.Parameter("coefficient", "1", "coefficient c"),),
    ...         term=lambda c, coefficient: coefficient * abs(c.cross),
    ...     )
    ... )
    >>> accelcal.catalogue()[-1].id
    'cross-axis-modulus'
    >>> accelcal.unregister("cross-axis-modulus")
    """
    for entry in effects:
        refuse(entry)
    ids = [entry.id for entry in effects]
    twice = next((name for name in ids if ids.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"effect {twice!r} is given twice; each id is that of one effect")
    _BY_ID.update({entry.id: entry for entry in effects})


def unregister(*names: str) -> None:
    """Take effects that were registered out of the catalogue.

    Parameters
    ----------
    *names : str
        Their ids.

    Raises
    ------
    InputError
        If there is none of this id, or it is built in.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import accelcal
    >>> accelcal.register(replace(accelcal.effect("hysteresis"), id="hysteresis-of-mine"))
    >>> accelcal.unregister("hysteresis-of-mine")
    >>> "hysteresis-of-mine" in {entry.id for entry in accelcal.catalogue()}
    False
    """
    for name in names:
        if is_built_in(effect(name)):
            raise InputError(f"effect {name!r} is built in; only registered ones can be taken out")
    for name in names:
        del _BY_ID[name]


@contextmanager
def registered(*effects: Effect) -> Iterator[None]:
    """Register effects for as long as a ``with`` block lasts.

    Parameters
    ----------
    *effects : Effect
        Effects of your own.
    """
    register(*effects)
    try:
        yield
    finally:
        unregister(*(entry.id for entry in effects))


@contextmanager
def brought_along(*effects: Effect) -> Iterator[None]:
    """Have effects of another process in the catalogue for as long as a ``with`` block lasts.

    Parameters
    ----------
    *effects : Effect
        Effects, of which some may be known here; where there are any, one thread goes at a time.
    """
    if not effects:
        yield
        return
    with _BRINGING, registered(*(entry for entry in effects if entry not in catalogue())):
        yield


def refuse(entry: Effect) -> None:
    """Refuse an effect that cannot join the catalogue.

    Parameters
    ----------
    entry : Effect
        The effect.

    Raises
    ------
    InputError
        If its id is in the catalogue already or no id, or its parameters break a rule.
    """
    expect(entry, Effect)
    if not isinstance(entry.id, str) or not re.fullmatch(r"[a-z][a-z0-9-]*", entry.id):
        raise InputError(f"id {entry.id!r} is none; it has small letters, digits and hyphens")
    if entry.id in _BY_ID:
        mine = "choose another, or unregister the first"
        rule = "choose another" if is_built_in(_BY_ID[entry.id]) else mine
        raise InputError(f"id {entry.id!r} is in the catalogue already; {rule}")
    if entry.static and entry.acts_on != "output":
        raise InputError(f"{entry.id}: static, and acts on the {entry.acts_on}; leave static out")
    _refuse_parameters(entry)


def _refuse_parameters(entry: Effect) -> None:
    names = [item.name for item in entry.parameters]
    if not names or len(set(names)) < len(names) or not all(map(str.isidentifier, names)):
        raise InputError(f"{entry.id}: parameters are {names}; there are some, each with its name")
    first, *others = entry.parameters
    if first.default is not None:
        raise InputError(f"{entry.id}: {first.name} has a default; the first parameter has none")
    without = [item.name for item in others if item.default is None]
    if without:
        raise InputError(f"{entry.id}: {without[0]} has no default; all but the first have one")


def _suggestion(name: str) -> str:
    from difflib import get_close_matches

    near = get_close_matches(name.lower(), _BY_ID, n=3, cutoff=0.5)
    near += [known for known in _BY_ID if name and name.lower() in known and known not in near]
    return f"did you mean {' or '.join(near[:3])}?" if near else f"it has {', '.join(_BY_ID)}"
