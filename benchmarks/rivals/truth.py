"""What is right: the name of a hidden effect, or one that its table cannot tell apart.

A class is judged on the table itself, in coordinates that are white under the covariance of the
generator and behind its base model, which are no code of accelcal. A name is of the class of
a hidden effect if some value of its parameters has a cosine above 0.999 with it.
"""

from __future__ import annotations

from itertools import permutations

import numpy as np
from hidden.table import Table
from hidden.visibility import orthonormal, remainder

from accelcal.discovery.instance import instances_of
from accelcal.effects.catalogue import effect
from accelcal.effects.conditions import Conditions
from rivals.dictionary import PHYSICAL, SAME, Floats


class Truth:
    """What is hidden in a table, in its white coordinates."""

    def __init__(self, table: Table, conditions: Conditions) -> None:
        self._whitener = np.linalg.inv(np.linalg.cholesky(table.covariance()))
        self._base = orthonormal(self._whitener @ table.base_directions())
        self._conditions = conditions
        self._known: dict[tuple[str, str], float] = {}
        self.parts = {name: self._seen(part) for name, part in table.parts.items()}

    def _seen(self, columns: Floats) -> Floats:
        return remainder(self._whitener @ columns, self._base)

    def cosine(self, name: str, part: str) -> float:
        """Largest cosine of an effect of the catalogue with one that is hidden."""
        if (name, part) not in self._known:
            self._known[name, part] = self._cosine(name, part)
        return self._known[name, part]

    def _cosine(self, name: str, part: str) -> float:
        entry, c, hidden = effect(name), self._conditions, self.parts[part]
        shapes = sorted({tuple(item.shape.items()) for item in instances_of(entry, c)})
        columns = [c.gain[:, None] * entry.columns(c, **dict(shape)) for shape in shapes]
        spans = np.split(self._seen(np.hstack(columns)), len(shapes), axis=1)
        best = max(_along(hidden, span) for span in spans)
        return best / float(np.linalg.norm(hidden))

    def is_right(self, name: str, part: str) -> bool:
        """Whether a name is that of a hidden effect or of its class."""
        return name == part or self.cosine(name, part) > SAME

    def is_right_of_any(self, name: str) -> bool:
        """Whether a name is right for something that is hidden."""
        return any(self.is_right(name, part) for part in self.parts)

    def are_right(self, names: tuple[str, ...]) -> bool:
        """Whether there is one right name for each hidden effect, and none more."""
        if len(names) != len(self.parts):
            return False
        return any(
            all(self.is_right(name, part) for name, part in zip(names, order, strict=True))
            for order in permutations(self.parts)
        )

    def is_outside(self) -> bool:
        """Whether no effect of the catalogue is of the class of anything hidden."""
        return not any(self.cosine(e.id, part) > SAME for e in PHYSICAL for part in self.parts)


def _along(vector: Floats, span: Floats) -> float:
    """Length of the part of a vector that lies in the span of some columns."""
    if span.shape[1] > 1:
        return float(np.linalg.norm(orthonormal(span).T @ vector))
    length = float(np.linalg.norm(span))
    return abs(float(span[:, 0] @ vector)) / length if length > 0.0 else 0.0
