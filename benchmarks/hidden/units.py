"""Several units on one stand: each has its own sensor and clock, all have the same head."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from hidden.cases import Case
from hidden.catalogue import CATALOGUE
from hidden.chamber import Chamber, recording_chamber
from hidden.clock import Session, session
from hidden.design import Design, Floats
from hidden.noise import REGIMES, SIGMA, Regime
from hidden.recipe import Recipe
from hidden.sensor import al15
from hidden.strangers import stranger
from hidden.table import Table, record
from hidden.world import World


@dataclass(frozen=True)
class OneHead(Regime):
    """A regime on a head whose graduation is drawn already.

    Attributes
    ----------
    graduation : tuple of float
        Error of each position of the turn [rad].
    """

    graduation: tuple[float, ...] = ()

    def disturbed(self, world: World, session: Session, rng: np.random.Generator) -> World:
        """The same laboratory with the errors of this head and of new launches."""
        world = super().disturbed(world, session, rng)
        return world.having("stand", graduation=self.graduation)


@dataclass(frozen=True)
class _Hidden:
    """A recipe with its size."""

    name: str
    recipe: Recipe
    size: float
    s: float


def units_of_one_stand(
    rng: np.random.Generator,
    design: Design,
    regime: str = "iid",
    *,
    hidden_stand: Mapping[str, float] | None = None,
    hidden_unit: Mapping[int, Mapping[str, float]] | None = None,
    n: int = 8,
) -> tuple[tuple[Case, Table], ...]:
    """Measure several units on one stand.

    Parameters
    ----------
    rng : numpy.random.Generator
        Everything random comes from it.
    design : Design
        The plan, the same for all.
    regime : str
        One of `REGIMES`; its head errors are drawn once.
    hidden_stand : mapping of str to float, optional
        Id or stranger and its s, see `hidden.cases.draw`; the same parameters in all units.
    hidden_unit : mapping of int to mapping of str to float, optional
        Number of a unit from 0, and what is hidden in it alone.
    n : int
        Units.

    Returns
    -------
    tuple of (Case, Table)
        For each unit what is hidden in it, that of the stand first, and its table. The truth of the
        head is ``table.regime.graduation``.
    """
    head = _one_head(REGIMES[regime], design, rng)
    chamber = recording_chamber(rng) if design.actual_temperature else Chamber()
    sessions = [session(design, rng) for _ in range(n)]
    worlds = [World(al15(rng), chamber=chamber) for _ in range(n)]
    shared = [
        _sized(name, s, rng, sessions[0], worlds[0]) for name, s in (hidden_stand or {}).items()
    ]
    found = []
    for number, (taken, world) in enumerate(zip(sessions, worlds, strict=True)):
        alone = (hidden_unit or {}).get(number, {})
        own = [_sized(name, s, rng, taken, world) for name, s in alone.items()]
        found.append(_measured([*shared, *own], world, taken, regime, head, rng))
    return tuple(found)


def _one_head(regime: Regime, design: Design, rng: np.random.Generator) -> OneHead:
    graduation = regime.head * rng.standard_normal(design.positions)
    values = {item.name: getattr(regime, item.name) for item in fields(regime)}
    return OneHead(**values, graduation=tuple(graduation.tolist()))


def _sized(name: str, s: float, rng: np.random.Generator, taken: Session, world: World) -> _Hidden:
    recipe = CATALOGUE[name](rng, taken) if name in CATALOGUE else stranger(name, rng, taken)
    sign = -1.0 if rng.random() < 0.5 and recipe.signed else 1.0
    size, _ = recipe.sized(world, taken, s * SIGMA * world.sensor.scale, sign)
    return _Hidden(name, recipe, size, s)


def _measured(
    hidden: Sequence[_Hidden],
    world: World,
    taken: Session,
    regime: str,
    head: OneHead,
    rng: np.random.Generator,
) -> tuple[Case, Table]:
    clean, parts = world, _parts(hidden, world, taken)
    for one in hidden:
        clean = one.recipe.plain(clean, one.size)
    altered = clean
    for one in hidden:
        altered = one.recipe.alter(altered, one.size)
    names = tuple(one.name for one in hidden)
    truth = {one.name: one.recipe.truth(one.size) for one in hidden}
    case = Case(names or "none", names, truth, tuple(one.s for one in hidden), regime)
    return case, record(taken, clean, altered, parts, head, rng)


def _parts(hidden: Sequence[_Hidden], world: World, taken: Session) -> dict[str, Floats]:
    return {one.name: one.recipe.effect(world, taken, one.size) for one in hidden}
