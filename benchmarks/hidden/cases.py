"""Draw a case: hide something of an asked size, at random, and measure the table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hidden.catalogue import CATALOGUE, DATA_FAULTS, has_a_subject
from hidden.chamber import Chamber, recording_chamber
from hidden.clock import Session, session
from hidden.design import DESIGNS, Design, Floats
from hidden.noise import REGIMES, SIGMA
from hidden.recipe import Recipe
from hidden.sensor import al15
from hidden.strangers import STRANGERS, is_outside, stranger
from hidden.table import Table, record
from hidden.visibility import are_distinct, base_directions, orthonormal
from hidden.world import World

Kind = str | tuple[str, ...]
SEVERAL = {"pair": 2, "triple": 3}
SEEN, ALIKE = 0.2, 0.9
"""Of several effects each leaves this fraction at least; its cosine with the others is below."""


@dataclass(frozen=True)
class Case:
    """What was hidden.

    Attributes
    ----------
    kind : str or tuple of str
        What was asked for.
    hidden : tuple of str
        Ids of the catalogue and names of strangers; empty for a clean table.
    truth : mapping of str to mapping of str to float
        True parameters of each, by the names in `Sensor`, `Stand`, `Chamber` and `Readout`.
    s : tuple of float
        Largest effect of each alone on a reading over the standard deviation of a reading, as
        asked. Half the step for a quantization; without a meaning for swapped positions.
    regime : str
        Of the noise.
    """

    kind: Kind
    hidden: tuple[str, ...]
    truth: Mapping[str, Mapping[str, float]]
    s: tuple[float, ...]
    regime: str


@dataclass(frozen=True)
class _Hidden:
    """A recipe with its size, and what it does to the readings alone [mA]."""

    recipe: Recipe
    size: float
    effect: Floats


def kinds(design: Design) -> tuple[str, ...]:
    """Ids and names that change readings of a design; its base model may still absorb them."""
    ids = [name for name in CATALOGUE if has_a_subject(name, design)]
    return (*ids, *(name for name in STRANGERS if is_outside(name, design)))


def draw(
    kind: Kind,
    rng: np.random.Generator,
    design: Design = DESIGNS["three"],
    regime: str = "iid",
    s: float | tuple[float, ...] = 4.0,
) -> tuple[Case, Table]:
    """Hide something in a table.

    Parameters
    ----------
    kind : str or tuple of str
        ``"none"``; an id of the catalogue; a name of a stranger; several of both in a tuple;
        ``"pair"`` or ``"triple"`` of catalogued effects that the design can tell apart;
        ``"stranger"`` for any.
    rng : numpy.random.Generator
        Everything random comes from it. It is used alike for every `s`, so that tables of one seed
        and of several sizes differ by the size alone (pairs and triples included).
    design : Design
        The plan and what the table tells.
    regime : str
        One of `REGIMES`.
    s : float or tuple of float
        Size of each hidden effect: the largest on a reading over the standard deviation of a
        reading.

    Returns
    -------
    Case
        What was hidden.
    Table
        The table.

    Raises
    ------
    ValueError
        If the design has no reading that the effect changes.
    """
    taken = session(design, rng)
    chamber = recording_chamber(rng) if design.actual_temperature else Chamber()
    world = World(al15(rng), chamber=chamber)
    names, hidden = _hide(kind, rng, taken, world, s)
    clean = altered = world
    for one in hidden:
        clean = one.recipe.plain(clean, one.size)
    altered = clean
    for one in hidden:
        altered = one.recipe.alter(altered, one.size)
    parts = {name: one.effect for name, one in zip(names, hidden, strict=True)}
    truth = {name: one.recipe.truth(one.size) for name, one in zip(names, hidden, strict=True)}
    case = Case(kind, names, truth, _each(s, len(names)), regime)
    return case, record(taken, clean, altered, parts, REGIMES[regime], rng)


def _hide(
    kind: Kind,
    rng: np.random.Generator,
    taken: Session,
    world: World,
    s: float | tuple[float, ...],
) -> tuple[tuple[str, ...], list[_Hidden]]:
    """Names and hidden effects; of several, those that the design can tell apart."""
    if kind not in SEVERAL:
        names = _names(kind, rng, taken.design)
        return names, _sized(names, rng, taken, world, _each(s, len(names)))
    base = orthonormal(base_directions(world, taken))
    pool = [name for name in kinds(taken.design) if name not in (*DATA_FAULTS, *STRANGERS)]
    for _ in range(1000):
        names = tuple(rng.choice(pool, SEVERAL[kind], replace=False).tolist())
        hidden = _sized(names, rng, taken, world, _each(s, len(names)))
        if are_distinct([one.effect for one in hidden], base, seen=SEEN, alike=ALIKE):
            return names, hidden
    raise ValueError("this design tells too few effects apart")


def _names(kind: Kind, rng: np.random.Generator, design: Design) -> tuple[str, ...]:
    if kind == "none":
        return ()
    if kind == "stranger":
        return (str(rng.choice([name for name in STRANGERS if is_outside(name, design)])),)
    return (kind,) if isinstance(kind, str) else kind


def _sized(
    names: tuple[str, ...],
    rng: np.random.Generator,
    taken: Session,
    world: World,
    sizes: tuple[float, ...],
) -> list[_Hidden]:
    hidden = []
    for name, s in zip(names, sizes, strict=True):
        recipe = CATALOGUE[name](rng, taken) if name in CATALOGUE else stranger(name, rng, taken)
        sign = -1.0 if rng.random() < 0.5 and recipe.signed else 1.0
        largest = s * SIGMA * world.sensor.scale
        hidden.append(_Hidden(recipe, *recipe.sized(world, taken, largest, sign)))
    return hidden


def _each(s: float | tuple[float, ...], count: int) -> tuple[float, ...]:
    return s if isinstance(s, tuple) else (float(s),) * count
