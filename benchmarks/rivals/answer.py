"""What a method says about a table."""

from __future__ import annotations

from typing import NamedTuple

from accelcal.discovery.instance import Instance


class Answer(NamedTuple):
    """The same for every method.

    Attributes
    ----------
    names : tuple of str
        Ids of physical effects, the strongest first.
    sets : tuple of frozenset of str
        For each of them, all ids that it may be as well, its own included.
    unknown : bool
        Whether there is something that the catalogue does not explain.
    faults : tuple of str
        Ids of faults of the readings.
    undetectable : frozenset of str or None
        Ids that this test cannot show; None for a method that does not tell.
    instances : tuple of Instance
        Columns that were chosen, of a method that has no prediction of its own.
    doubted : frozenset of str
        Names that noise alone could be the cause of, of a method that tells.
    gap : tuple of float, or None
        Held-out rms before and after [g], of a method that tells.
    """

    names: tuple[str, ...]
    sets: tuple[frozenset[str], ...]
    unknown: bool = False
    faults: tuple[str, ...] = ()
    undetectable: frozenset[str] | None = None
    instances: tuple[Instance, ...] = ()
    doubted: frozenset[str] = frozenset()
    gap: tuple[float, float] | None = None


def chosen(instances: list[Instance]) -> Answer:
    """Answer of a method that chooses columns, the strongest first."""
    names = tuple(dict.fromkeys(item.effect.id for item in instances))
    return Answer(names, tuple(frozenset([name]) for name in names), instances=tuple(instances))
