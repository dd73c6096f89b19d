"""Which tables each section looks at."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import product
from typing import NamedTuple
from zlib import crc32

import numpy as np
from hidden import cases, table
from hidden.cases import kinds
from hidden.catalogue import CATALOGUE, DATA_FAULTS
from hidden.design import DESIGNS
from hidden.noise import REGIMES, SLOW
from hidden.strangers import OF_POSITION, STRANGERS

LOOKED_AT = ("three", "loop", "twelve")
CLEAN = (*LOOKED_AT, "twenty-four")
PATTERNED = ("twelve", "twelve-loop", "twenty-four")
SIZES = (0.5, 1.0, 2.0, 4.0, 8.0)
DRAWN = 0.0
"""Size of a case that is chosen for the noncentrality."""

INVISIBLE = 0.1
"""Noncentrality at the largest size below which an effect is invisible by design."""


class Case(NamedTuple):
    """A table to be drawn."""

    section: str
    kind: str
    design: str
    regime: str
    s: float
    number: int

    def draw(self, seed: int, s: float | None = None) -> tuple[cases.Case, table.Table]:
        """Draw the table; all sizes and regimes of a number have the same hidden effect."""
        rng = np.random.default_rng([seed, crc32(self.kind.encode()), self.number])
        size = self.s if s is None else s
        return cases.draw(self.kind, rng, DESIGNS[self.design], self.regime, s=size)


@lru_cache
def visible(design: str) -> tuple[str, ...]:
    """Physical effects that a design can show at some size."""
    return tuple(name for name in _physical(design) if not _is_invisible(name, design))


@lru_cache
def invisible(design: str) -> tuple[str, ...]:
    """Physical effects that the base model absorbs."""
    return tuple(name for name in _physical(design) if _is_invisible(name, design))


def _physical(design: str) -> list[str]:
    names = kinds(DESIGNS[design])
    return [name for name in names if name in CATALOGUE and name not in DATA_FAULTS]


def _is_invisible(name: str, design: str) -> bool:
    drawn = Case("", name, design, "iid", SIZES[-1], 0).draw(0)[1]
    return drawn.noncentrality() < INVISIBLE


def clean(tables: int) -> Iterator[Case]:
    for design, regime in product(CLEAN, (name for name in REGIMES if name not in SLOW)):
        yield from (Case("clean", "none", design, regime, 1.0, i) for i in range(tables))


def one(tables: int) -> Iterator[Case]:
    for regime, s in product(("iid", "all"), SIZES):
        yield from _spread("one", visible, regime, s, tables)


def several(tables: int) -> Iterator[Case]:
    for kind, sizes in (("pair", (2.0, 4.0, 8.0)), ("triple", (4.0, 8.0))):
        for s in sizes:
            yield from _spread("several", lambda _, kind=kind: (kind,), "iid", s, tables)


def outside(tables: int) -> Iterator[Case]:
    yield from _spread("outside", _strangers, "iid", DRAWN, tables)


def of_position(tables: int) -> Iterator[Case]:
    """Patterns of the position alone, on tests that show more than three of them."""
    names = tuple(OF_POSITION)
    for turn in range(tables):
        design = PATTERNED[turn % len(PATTERNED)]
        number = turn // len(PATTERNED)
        name = names[number % len(names)]
        yield Case("positions", name, design, "iid", DRAWN, number // len(names))


def unseen(tables: int) -> Iterator[Case]:
    yield from _spread("invisible", invisible, "iid", SIZES[-1], tables)


def held_out(tables: int) -> Iterator[Case]:
    yield from _spread("held-out", visible, "iid", 4.0, tables)


def faults(tables: int) -> Iterator[Case]:
    for s in (4.0, 8.0):
        yield from _spread("faults", lambda _: DATA_FAULTS, "iid", s, tables)
    yield from _spread("faults", lambda _: ("outlier",), "iid", 12.0, tables // len(DATA_FAULTS))


def memory(tables: int) -> Iterator[Case]:
    """One run, clean in noise with and without a memory, and half as many with an effect."""
    for regime, s in product(("iid", "ar1"), (6.0, 30.0)):
        kinds = visible("one")
        for turn in range(tables // 2):
            yield Case("memory", kinds[turn % len(kinds)], "one", regime, s, turn // len(kinds))
    for regime in ("iid", "ar1-weak", "ar1", "ar1-strong", "flicker", "walk"):
        yield from (Case("memory", "none", "one", regime, 1.0, i) for i in range(tables))


def _strangers(design: str) -> tuple[str, ...]:
    return tuple(name for name in kinds(DESIGNS[design]) if name in STRANGERS)


def _spread(
    section: str, names: Callable[[str], tuple[str, ...]], regime: str, s: float, tables: int
) -> Iterator[Case]:
    """Spread tables over designs and, within each, over kinds."""
    for place, design in enumerate(LOOKED_AT):
        own = np.random.default_rng(0).permutation(names(design)).tolist()
        for turn in range(place, tables, len(LOOKED_AT)):
            number = turn // len(LOOKED_AT)
            yield Case(section, own[number % len(own)], design, regime, s, number)


SECTIONS: dict[str, Callable[[int], Iterator[Case]]] = {
    "clean": clean,
    "one": one,
    "several": several,
    "outside": outside,
    "positions": of_position,
    "invisible": unseen,
    "held-out": held_out,
    "faults": faults,
    "memory": memory,
}
