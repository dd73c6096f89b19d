"""How a thing is hidden: a change of the laboratory by one size, all else about it drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from hidden.clock import Session
from hidden.design import Floats
from hidden.world import World, observe

START = 1e-6  # any size will do to begin with: nearly all effects are linear in theirs


def _as_it_is(world: World, _size: float) -> World:
    return world


@dataclass(frozen=True)
class Recipe:
    """One hidden thing, but for its size.

    Attributes
    ----------
    alter : callable
        World and size to the world with the thing in it.
    truth : callable
        Size to the true parameters.
    signed : bool
        Whether the size may be negative.
    plain : callable
        World and size to the world without, where the size belongs to both.
    sizes : bool
        Whether there is a size at all.
    half_steps : bool
        Whether the effect is at most half the size [mA] whatever the readings.
    """

    alter: Callable[[World, float], World]
    truth: Callable[[float], Mapping[str, float]]
    signed: bool = True
    plain: Callable[[World, float], World] = _as_it_is
    sizes: bool = True
    half_steps: bool = False

    def effect(self, world: World, session: Session, size: float) -> Floats:
        """Readings with minus readings without, free of noise, shape (n,) [mA]."""
        altered = observe(self.alter(world, size), session)
        return altered - observe(self.plain(world, size), session)

    def sized(
        self, world: World, session: Session, largest: float, sign: float
    ) -> tuple[float, Floats]:
        """Size of a sign, and its effect: `largest` on some reading, on none more [mA]."""
        size = sign * (2 * largest if self.half_steps else START)
        for _ in range(30):
            effect = self.effect(world, session, size)
            reached = float(np.abs(effect).max())
            if self.half_steps or not self.sizes or abs(reached / largest - 1) < 1e-9:
                return size, effect
            if reached < 1e-6 * START:
                raise ValueError("this design has no reading that the effect changes")
            size *= largest / reached
        raise ArithmeticError("no size makes the effect as large as asked")


def lever(room: str, name: str, *, signed: bool = True, **drawn: float) -> Recipe:
    """Give one value of a part of the world a size, and others what was drawn for them."""
    return Recipe(
        alter=lambda world, size: world.having(room, **{name: size}, **drawn),
        truth=lambda size: {name: size, **drawn},
        signed=signed,
    )
