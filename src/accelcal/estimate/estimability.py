"""Which coefficients the positions of a test can tell apart, computed from its design matrix."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import DesignError
from accelcal.model import COEFFICIENTS
from accelcal.plural import listed

# The order in which coefficients are kept where not all can be had: what a user needs first.
_PRIORITY = ("K1", "K0", "M", "K2", "M_ip", "K3")

# A column of which less than this is left behind the others, as an rms over the readings, cannot be
# told apart in practice: its coefficient would be a hundred times less certain than a mean.
_LEAST_REMAINDER = 0.01

_CLEAR = 10.0  # times as much is left whatever the rows, of which one may come a hundred times
_NO_REMAINDER = 1e-9  # of rounding


class Estimability(NamedTuple):
    """What a design determines."""

    kept: tuple[str, ...]  # coefficients that are estimated, in the order of `COEFFICIENTS`
    shares: Mapping[str, Mapping[str, float]]  # lost one -> share that a kept one absorbs

    @property
    def stands_for(self) -> Mapping[str, str]:
        """What a kept coefficient really estimates where it absorbs a lost one: ``"K1 + K3"``."""
        return _stands_for(self.shares)

    @property
    def absorbed_by(self) -> Mapping[str, tuple[str, ...]]:
        """Each lost coefficient and the kept ones that absorb it; empty where it has no trace."""
        return {
            name: tuple(keeper for keeper in COEFFICIENTS if keeper in self.shares[name])
            for name in COEFFICIENTS
            if name in self.shares
        }

    @property
    def columns(self) -> list[int]:
        """Columns of the kept coefficients in the design matrix."""
        return [COEFFICIENTS.index(name) for name in self.kept]

    def sentences(self) -> tuple[str, ...]:
        """Say what cannot be told apart, a sentence a lost coefficient, and what is taken as 0."""
        lost = tuple(self._sentence(lost, by) for lost, by in self.absorbed_by.items())
        left_out = [name for name in COEFFICIENTS if name not in (*self.kept, *self.absorbed_by)]
        if not left_out:
            return lost
        return (*lost, f"taken as 0, as it was not asked for: {', '.join(left_out)}")

    def _sentence(self, lost: str, by: tuple[str, ...]) -> str:
        if not by:
            return f"{lost} leaves no trace at these angles and is not estimated"
        meaning = ", ".join(f"{name} stands for {self.stands_for[name]}" for name in by)
        return f"{lost} cannot be told apart from {listed(by)} at these angles: {meaning}"


def estimability(
    design: Array, asked: Sequence[str] = COEFFICIENTS, *, strict: bool = False
) -> Estimability:
    """Find the coefficients that a design matrix, shape (n, 6), determines of those asked for.

    The others are taken as zero; `strict` refuses a design that does not determine all that is
    asked.

    Raises
    ------
    DesignError
        If K1 cannot be determined or told apart from K0; if a name is unknown; if `strict` and
        something is lost.

    Examples
    --------
    >>> from accelcal.geometry import accelerations
    >>> from accelcal.head_angles import turn_angles
    >>> from accelcal.model import design_matrix
    >>> found = estimability(design_matrix(accelerations(turn_angles(4))))
    >>> found.kept
    ('K0', 'K1', 'K2', 'M')
    >>> found.stands_for["K1"]
    'K1 + K3'
    """
    check_names(asked)
    found = told_apart(design, asked)
    if "K1" not in found.kept or "K1" in found.absorbed_by.get("K0", ()):
        raise DesignError(
            "the readings do not determine the scale factor K1; a tumble test needs readings at"
            " two or more angles where the input axis senses different accelerations"
        )
    if strict and found.absorbed_by:
        raise DesignError(
            "; ".join(found.sentences()) + "; add positions or ask for fewer coefficients"
        )
    return found


def told_apart(design: Array, asked: Sequence[str] = COEFFICIENTS) -> Estimability:
    """Find what a design matrix, shape (n, 6), determines, be it K1 or not.

    Examples
    --------
    >>> told_apart(np.ones((1, 6))).kept
    ('K1',)
    """
    kept, shares = _sort_out(design, [name for name in _PRIORITY if name in asked])
    return Estimability(tuple(name for name in COEFFICIENTS if name in kept), shares)


def check_names(asked: Sequence[str]) -> None:
    """Refuse what is no coefficient, and a fit without K1, by a `DesignError`."""
    for name in asked:
        if not isinstance(name, str) or name not in COEFFICIENTS:
            raise DesignError(
                f"coefficient {name!r} is unknown; choose from {', '.join(COEFFICIENTS)}"
            )
    if "K1" not in asked:
        raise DesignError("K1 is not among the coefficients asked for; a fit needs it")


def tells_alike(design: Array, asked: Sequence[str]) -> bool:
    """Tell whether a design, shape (n, 6), determines the same however often it has each row.

    That is where all that is asked of its rows is clearly told apart, or not at all.

    Examples
    --------
    >>> from accelcal.geometry import accelerations
    >>> from accelcal.model import design_matrix
    >>> turns = [0.0, 90.0, 180.0, 270.0], [165.0, 195.0, 210.0, 225.0, 315.0, 345.0]
    >>> [tells_alike(design_matrix(accelerations(angle)), COEFFICIENTS) for angle in turns]
    [True, False]
    """
    left = _remainders(np.unique(design, axis=0), [name for name in _PRIORITY if name in asked])
    return all(size < _NO_REMAINDER or size > _CLEAR * _LEAST_REMAINDER for size in left.values())


def _sort_out(
    design: Array, candidates: Sequence[str]
) -> tuple[list[str], dict[str, dict[str, float]]]:
    """Keep each candidate that adds a direction; express the others by those kept."""
    left = _remainders(design, candidates)
    kept = [name for name, size in left.items() if size > _LEAST_REMAINDER]
    return kept, {name: _shares(design, kept, name) for name in left if name not in kept}


def _remainders(design: Array, candidates: Sequence[str]) -> dict[str, float]:
    """What each candidate leaves behind those before it that are kept, as an rms."""
    found: dict[str, float] = {}
    basis = np.zeros((len(candidates), len(design)))
    for row, name in zip(basis, candidates, strict=True):
        column = design[:, COEFFICIENTS.index(name)]
        rest = column - (basis @ column) @ basis
        size = math.sqrt(rest @ rest)
        found[name] = size / math.sqrt(column.size)
        if found[name] > _LEAST_REMAINDER:
            row[:] = rest / size
    return found


def _shares(design: Array, kept: Sequence[str], lost: str) -> dict[str, float]:
    matrix = design[:, [COEFFICIENTS.index(name) for name in kept]]
    column = design[:, COEFFICIENTS.index(lost)]
    shares = np.linalg.lstsq(matrix, column, rcond=None)[0]
    return {
        name: float(share) for name, share in zip(kept, shares, strict=True) if abs(share) > 1e-3
    }


def _stands_for(absorbed: Mapping[str, Mapping[str, float]]) -> dict[str, str]:
    parts: dict[str, list[str]] = {}
    for lost in (name for name in COEFFICIENTS if name in absorbed):
        for name, share in absorbed[lost].items():
            parts.setdefault(name, [name]).append(signed(share, lost))
    return {name: " ".join(parts[name]) for name in COEFFICIENTS if name in parts}


def signed(share: float, name: str) -> str:
    """Write a share of a coefficient as a term of a sum, with its sign.

    Examples
    --------
    >>> signed(-0.75, "K3"), signed(1.0, "K1")
    ('- 0.75 K3', '+ K1')
    """
    sign = "+" if share > 0 else "-"
    size = "" if abs(abs(share) - 1.0) < 5e-4 else f"{abs(share):.3g} "
    return f"{sign} {size}{name}"
