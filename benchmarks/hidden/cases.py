"""Draw a case: hide something of an asked size, at random, and measure the table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hidden.design import DESIGNS, Design
from hidden.table import Table


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
        True parameters of each.
    s : float
        Largest effect of each alone on a reading over the standard deviation of a reading.
    regime : str
        Of the noise.
    """

    kind: str | tuple[str, ...]
    hidden: tuple[str, ...]
    truth: Mapping[str, Mapping[str, float]]
    s: float
    regime: str


def draw(
    kind: str | tuple[str, ...],
    rng: np.random.Generator,
    design: Design = DESIGNS["three"],
    regime: str = "iid",
    s: float = 4.0,
) -> tuple[Case, Table]:
    """Hide something in a table."""
    raise NotImplementedError
