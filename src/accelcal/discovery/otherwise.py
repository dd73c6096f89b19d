"""What the coefficients would be if others were the true effects, of those that fit as well."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.dead_zone_or_cube import APART, apart
from accelcal.discovery.explanation import Explanation
from accelcal.discovery.instance import Instance
from accelcal.discovery.other_laws import Alternatives
from accelcal.discovery.solution import changes, solution
from accelcal.results.discovery import IF_IT_IS, Discovery
from accelcal.results.findings import Change
from accelcal.results.quantity import Quantity
from accelcal.units import MICRO

_MOST_RIVALS = 3

_TOLD = {
    "g": "ug",
    "1": "ppm",
    "rad": "urad",
    "g/g^2": "ug/g^2",
    "g/g^3": "ug/g^3",
    "g/degC": "ug/degC",
    "1/degC": "ppm/degC",
    "rad/degC": "urad/degC",
}


class Otherwise(NamedTuple):
    """Effects in place of those named, and the coefficients that are others with them.

    Attributes
    ----------
    name : str
        The effects.
    instances : tuple of Instance
        The effects themselves.
    pairs : tuple of pairs of Change
        Each of these coefficients beside the effects that are named, and beside these.
    """

    name: str
    instances: tuple[Instance, ...]
    pairs: tuple[tuple[Change, Change], ...]


def otherwise(
    comparison: Comparison,
    best: Sequence[Instance],
    alternatives: Alternatives,
    rivals: Iterable[tuple[str, tuple[Instance, ...]]],
) -> Iterator[Otherwise]:
    """Find which of what explains the readings as well as some effects has other coefficients.

    Alternatives are the effects at other places or by other laws; rivals are given by name.
    """
    if not best:
        return
    bare = solution(comparison)
    named = changes(comparison, bare, solution(comparison, best))
    own = ((other.name, other.instances) for each in alternatives for other in each)
    for name, instances in (*own, *rivals):
        within = changes(comparison, bare, solution(comparison, instances))
        both = zip(named, within, strict=True)
        if pairs := tuple((old, new) for old, new in both if apart(old, new) > APART):
            yield Otherwise(name, instances, pairs)


def rivals_of(found: Sequence[Explanation]) -> Iterator[tuple[str, tuple[Instance, ...]]]:
    """Name the explanations behind the first one."""
    for rival in found[1 : 1 + _MOST_RIVALS]:
        yield name_of(rival.ids), rival.instances


def name_of(ids: Iterable[str]) -> str:
    """Name effects together."""
    return " + ".join(sorted(ids))


def said_of_others(others: Sequence[Otherwise]) -> Iterator[str]:
    """Tell the coefficients where another explanation is the true one."""
    for other in others:
        told = ", ".join(_value(old, new) for old, new in other.pairs)
        yield f"{IF_IT_IS}{other.name} in truth: {told}"


def _value(best: Change, change: Change) -> str:
    value = (change.after.value or 0.0) * MICRO
    if change.coefficient == "K1":  # of which no more than the change is told
        more = value - (best.after.value or 0.0) * MICRO
        return f"K1 {abs(more):.3g} ppm {'higher' if more > 0.0 else 'lower'}"
    return f"{change.coefficient} {value:.4g} {_TOLD[change.after.unit]}"


def with_others_counted(found: Discovery, others: Sequence[Otherwise]) -> Discovery:
    """Count in U of the coefficients what they are beside the other effects, see `as_likely`."""
    farthest: dict[str, float] = {}
    for old, new in (pair for other in others for pair in other.pairs):
        off = abs((new.after.value or 0.0) - (old.after.value or 0.0))
        farthest[old.coefficient] = max(off, farthest.get(old.coefficient, 0.0))
    told = (
        replace(each, after=_wider(each.after, farthest.get(each.coefficient, 0.0)))
        for each in found.coefficients
    )
    return replace(found, coefficients=tuple(told))


def as_likely(off: Array) -> Array:
    """Variance of what may as well be off by so much in one of several cases, shape (..., m).

    Notes
    -----
    The value that is farthest off counts as likely as the one that is told: the mean square of the
    two differences from the latter, of which one is zero.
    """
    return np.asarray((off**2).max(axis=-1) / 2.0)


def _wider(quantity: Quantity, off: float) -> Quantity:
    """A quantity that may as well be off by so much."""
    u, expanded = quantity.standard_uncertainty, quantity.expanded_uncertainty
    if not off or not u or expanded is None:
        return quantity
    wider = float(np.hypot(u, np.sqrt(as_likely(np.array([off])))))
    return replace(quantity, standard_uncertainty=wider, expanded_uncertainty=expanded * wider / u)
