"""What else explains the readings, and what the coefficients would be if that were the truth.

An effect may have several laws or places. The amplitudes of a tilt, linear in time or daily, are
searched in two parts, each as an effect of its own; over a few hours a part of a day is nearly a
straight line, and either may fit the noise a little better. So may one of several head positions,
or a reading beside that of a step. And other effects of the catalogue may fit as well.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import compress
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import Explanation, explain_as_well
from accelcal.discovery.instance import (
    Instance,
    amplitude_columns,
    instance_of,
    instances_of,
    replaced,
)
from accelcal.discovery.parameters import parameters_of
from accelcal.discovery.solution import APART, apart, changes, solution
from accelcal.discovery.untold import scales, untold
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import Disturbance, Effect
from accelcal.effects.parameter import Parameter
from accelcal.model import symbol_of
from accelcal.plural import listed
from accelcal.results.discovery import IF_IT_IS, Discovery
from accelcal.results.findings import Change
from accelcal.results.quantity import Quantity
from accelcal.shown_units import SMALL_UNITS
from accelcal.units import MICRO

_MOST_RIVALS = 3

_BENT = 3.0
"""Standard uncertainties from which on a coefficient does not follow a time constant linearly.

If it does, it is 2.6 of them off, as far as the time constant explains the readings as well.
"""

_TOWARDS = 33
"""Time constants from the one that fits best to either end; those between two that fit do so."""


class Alternative(NamedTuple):
    """Effects, one of which is at another place or goes by another law than was named."""

    effect: Effect  # the one
    what: str  # where it is, or the parameters of its other law
    instances: tuple[Instance, ...]  # all of them
    least: float = APART
    """Standard uncertainties from which on a coefficient is another one with them."""

    @property
    def place(self) -> dict[str, float]:
        """Where the one is: its discrete parameters."""
        (item,) = (item for item in self.instances if item.effect is self.effect)
        return {p.name: item.shape[p.name] for p in self.effect.shapes if p.discrete}

    @property
    def name(self) -> str:
        """The one, with what is otherwise."""
        return f"{self.effect.id} with {self.what}"


class Alternatives(NamedTuple):
    """What explains the readings as well as some effects, with one of them otherwise."""

    places: tuple[Alternative, ...]  # with one at another place
    laws: tuple[Alternative, ...]  # with one that goes by another law
    scales: tuple[Alternative, ...]  # with another time constant


def alternatives(comparison: Comparison, instances: Sequence[Instance]) -> Alternatives:
    """Find what else some effects may be otherwise and explain the readings as well."""
    kinds = (_other_places, _other_laws, _other_scales)
    return Alternatives(*(tuple(each(comparison, instances)) for each in kinds))


def _other_laws(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[Alternative]:
    for place, others in _instead(comparison, instances, _laws):
        fitted = _fitted(comparison, others, place)
        effect, values = fitted.effect, fitted.values
        own = (p for p in effect.amplitudes if values[p.name])
        what = ", ".join(f"{p.name} = {values[p.name]:.3g} {p.unit}" for p in own)
        yield Alternative(effect, what, replaced(others, place, instance_of(fitted)))
    c = comparison.model.conditions
    for place, item in enumerate(instances):
        _, shown = comparison.space.shown(amplitude_columns(item, c))
        if not shown.all():  # coefficients take up the others
            parts, names = np.abs(item.mixture), [p.name for p in item.effect.amplitudes]
            what = f"{listed(list(compress(names, ~shown)))} as large as {names[parts.argmax()]}"
            mixture = tuple(np.where(shown, item.mixture, parts.max()).tolist())
            yield Alternative(
                item.effect, what, replaced(instances, place, item._replace(mixture=mixture))
            )


def _other_places(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[Alternative]:
    for place, others in _instead(comparison, instances, places_of):
        yield Alternative(others[place].effect, where_is(others[place]), others)


def _other_scales(
    comparison: Comparison, instances: Sequence[Instance], *, within_runs: bool = False
) -> Iterator[Alternative]:
    """Effects with the shortest and the longest time constant that explain the readings as well."""
    for place, p in _scales_of(instances):
        first, last = p.searched_at(comparison.model.conditions)[[0, -1]].tolist()
        most = min(last, _longest_run(comparison, p)) if within_runs else last
        for end in (first, most):
            farthest = _farthest(comparison, instances, place, p, end)
            if farthest is not None:
                more = " or more" if farthest >= last else ""
                what = f"{p.name} = {farthest:.3g} {p.unit}{more}"
                item = instances[place].at(p.name, farthest)
                yield Alternative(item.effect, what, replaced(instances, place, item), _BENT)


def _scales_of(instances: Sequence[Instance]) -> list[tuple[int, Parameter]]:
    """Time constants of some effects, each with the place of its effect."""
    return [(place, p) for place, item in enumerate(instances) for p in scales(item.effect)]


def _longest_run(comparison: Comparison, p: Parameter) -> float:
    """Longest run, for a time constant; no end for another parameter."""
    return float(comparison.model.conditions.run_time.max()) if p.unit == "s" else np.inf


def _farthest(
    comparison: Comparison, instances: Sequence[Instance], place: int, p: Parameter, end: float
) -> float | None:
    """Value of a parameter nearest to an end with which an effect explains the readings as well."""
    item = instances[place]

    def fails(value: float) -> bool:
        others = replaced(instances, place, item.at(p.name, value))
        return not explain_as_well(comparison, others, item)

    towards = np.geomspace(item.shape[p.name], end, _TOWARDS)[1:].tolist()
    count = bisect_left(towards, True, key=fails)
    return towards[count - 1] if count else None


def where_is(item: Instance) -> str:
    """Tell the place of an effect."""
    told = (p for p in item.effect.shapes if p.discrete)
    each = (f"{p.name} = {item.shape[p.name]:g} {p.unit}".removesuffix(" 1") for p in told)
    return ", ".join(each)


def _instead(
    comparison: Comparison,
    instances: Sequence[Instance],
    others_of: Callable[[Instance, Conditions], Iterator[Instance]],
) -> Iterator[tuple[int, tuple[Instance, ...]]]:
    """Sets with another in place of one that is not needed beside it, and where in the set."""
    for place, item in enumerate(instances):
        for other in others_of(item, comparison.model.conditions):
            others = replaced(instances, place, other)
            if explain_as_well(comparison, others, item):
                yield place, others


def _fitted(comparison: Comparison, instances: Sequence[Instance], place: int) -> Disturbance:
    """One of some effects, of the size that the readings give it."""
    effect = instances[place].effect
    found = parameters_of(comparison, instances)[place]
    sizes = {name: quantity.value or 0.0 for name, quantity in found.items()}
    return Disturbance(effect, dict.fromkeys((p.name for p in effect.amplitudes), 0.0) | sizes)


def _laws(item: Instance, c: Conditions) -> Iterator[Instance]:
    """The effect at the same place, with amplitudes of which it has none."""
    tried = {other.amplitudes: other for other in instances_of(item.effect, c)}
    for amplitudes, other in tried.items():
        if not set(amplitudes) & set(item.amplitudes):
            yield other._replace(shape=item.shape)


def places_of(item: Instance, c: Conditions) -> Iterator[Instance]:
    """The effect at the places where it is not, all else about it the same."""
    places = {p.name for p in item.effect.shapes if p.discrete}
    tried = dict.fromkeys(
        tuple((name, other.shape[name]) for name in sorted(places))
        for other in instances_of(item.effect, c)
    )
    for where in tried:
        moved = item._replace(shape={**item.shape, **dict(where)})
        if moved != item:
            yield moved


class Otherwise(NamedTuple):
    """Effects in place of those named, and the coefficients that are others with them."""

    name: str  # the effects
    instances: tuple[Instance, ...]  # the effects themselves
    pairs: tuple[tuple[Change, Change], ...]
    """Each of these coefficients beside the effects that are named, and beside these."""
    untold: tuple[str, ...]
    """Parameters that the readings do not tell; with other values the coefficients are less far
    off."""

    @property
    def said(self) -> str:
        """What the coefficients are if that is the truth."""
        told = ", ".join(_value(old, new) for old, new in self.pairs)
        if self.untold:
            told += f", at the farthest, as these readings do not tell {listed(self.untold)}"
        return f"{IF_IT_IS}{self.name} in truth: {told}"


def otherwise(
    comparison: Comparison,
    best: Sequence[Instance],
    alternatives: Alternatives,
    rivals: Iterable[tuple[str, tuple[Instance, ...]]],
) -> Iterator[Otherwise]:
    """Find which of what explains the readings as well as some effects has other coefficients.

    Alternatives are the effects at other places or by other laws; rivals are given by name. Of a
    rival that the readings do not tell whole, it is where the coefficients are farthest off.
    """
    if not best:
        return
    bare = solution(comparison)
    named = changes(comparison, bare, solution(comparison, best))
    own = ((o.name, [(o.instances, ())], o.least) for each in alternatives for o in each)
    all_of_rivals = ((name, _wherever(comparison, instances), APART) for name, instances in rivals)
    for name, sets, least in (*own, *all_of_rivals):
        found = []
        for instances, open_ones in sets:
            within = changes(comparison, bare, solution(comparison, instances))
            both = zip(named, within, strict=True)
            if pairs := tuple((old, new) for old, new in both if apart(old, new) > least):
                found.append(Otherwise(name, instances, pairs, open_ones))
        if found:
            yield max(found, key=lambda one: max(apart(*pair) for pair in one.pairs))


def _wherever(
    comparison: Comparison, instances: tuple[Instance, ...]
) -> Iterator[tuple[tuple[Instance, ...], tuple[str, ...]]]:
    """Effects at each place where they explain the readings as well, and what is untold of them.

    They come with the middle and the ends of what is untold, and as far off as it may be within the
    runs: what goes on for longer is told by `said_of_ends`, and nothing bounds it.
    """
    for each in (instances, *(one.instances for one in _other_places(comparison, instances))):
        inside = _within_runs(comparison, each)
        if not inside:
            continue
        far = list(_other_scales(comparison, inside, within_runs=True))
        names = {p.name for other in far for p in scales(other.effect)}
        open_ones = [one for one in untold(comparison, inside) if one.parameter.name not in names]
        told = (*names, *(one.parameter.name for one in open_ones))
        ends = (end for one in open_ones for end in one.ends(inside))
        for own in (inside, *(other.instances for other in far), *ends):
            yield own, told


def _within_runs(comparison: Comparison, instances: tuple[Instance, ...]) -> tuple[Instance, ...]:
    """Effects with no time constant beyond the longest run; none if they do not fit as well so."""
    inside = instances
    for place, p in _scales_of(instances):
        item, most = instances[place], _longest_run(comparison, p)
        if item.shape[p.name] > most:
            inside = replaced(inside, place, item.at(p.name, most))
            if not explain_as_well(comparison, inside, item):
                return ()
    return inside


def rivals_of(found: Sequence[Explanation]) -> Iterator[tuple[str, tuple[Instance, ...]]]:
    """Name the explanations behind the first one."""
    for rival in found[1 : 1 + _MOST_RIVALS]:
        yield name_of(rival.ids), rival.instances


def name_of(ids: Iterable[str]) -> str:
    """Name effects together."""
    return " + ".join(sorted(ids))


def _value(best: Change, change: Change) -> str:
    value = (change.after.value or 0.0) * MICRO
    if change.coefficient == "K1":  # of which no more than the change is told
        more = value - (best.after.value or 0.0) * MICRO
        return f"K1 {abs(more):.3g} ppm {'higher' if more > 0.0 else 'lower'}"
    U = (change.after.expanded_uncertainty or 0.0) * MICRO
    digits = f"z.{max(1 - math.floor(math.log10(U)), 0)}f" if U else ".4g"
    return f"{symbol_of(change.coefficient)} {value:{digits}} {SMALL_UNITS[change.after.unit]}"


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
