"""A dead zone that is wider than it shows, or stands in the place of something else.

In one about as wide as the misalignment, which no column of a small one shows, positions across the
input axis are silent: their readings tell nothing of the misalignment, which all others then tell.
So it is fitted for what it is, with the misalignment in its kinks. With steps of 45 deg it looks
like a_p^3, whatever its width: K1 and K3 take up the rest.

One narrower than the misalignment acts as a_p^3 does. Where the readings tell no more than that it
is one of the two, nothing bounds what is another coefficient with the other.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.base import tilt
from accelcal.discovery.columns import dummies, scaled
from accelcal.discovery.comparison import Comparison, compared
from accelcal.discovery.explanation import Explanation
from accelcal.discovery.instance import Instance, all_own_columns, replaced
from accelcal.discovery.large_effects import ALONG, DEAD_ZONE, across_the_axis, silent_in
from accelcal.discovery.solution import unlike
from accelcal.discovery.unnamed.mistaken import of_position
from accelcal.discovery.unnamed.slow import POSSIBLE
from accelcal.discovery.untold import fitted_sizes, squares_left
from accelcal.effects.catalogue import catalogue
from accelcal.model import symbol_of
from accelcal.numerics.grouping import distinct
from accelcal.results.findings import Change, FoundEffect, Unexplained
from accelcal.results.quantity import Quantity
from accelcal.units import MICRO


def said_of_rivals(
    comparison: Comparison, found: Sequence[Explanation]
) -> Iterator[tuple[str, list[str]]]:
    """Say of which coefficients nothing tells whether a dead zone acts on them, with the effect."""
    best = found[0]
    rivals = {item.effect.id: in_place_of(found, best, item.effect.id) for item in best.instances}
    for name, rival, coefficients in undecided(comparison, best.instances, rivals):
        yield (
            f"{name} is not sure: {rival} explains these readings as well, with other"
            f" values of {', '.join(map(symbol_of, coefficients))}; nothing bounds that, and no U"
            " counts it; to tell: positions 22.5 deg apart, or fine steps of the head about the"
            " two near 0 g",
            [name],
        )


def in_place_of(found: Sequence[Explanation], named: Explanation, name: str) -> tuple[str, ...]:
    """Ids that explain the readings too in place of one effect, the others being the same."""
    rest = named.ids - {name}
    others = [other.ids - rest for other in found if rest <= other.ids]
    return tuple(next(iter(ids)) for ids in others if len(ids) == 1 and name not in ids)


def undecided(
    comparison: Comparison, instances: Sequence[Instance], rivals: Mapping[str, Sequence[str]]
) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Find effects with a rival as good, one of the two being a dead zone.

    They come with the rival and the coefficients that are others with it. The rivals are ids of
    what a discovery found in place of each effect. There are none where no
    coefficients hang on it, nor where some readings are silent, as a dead zone is sure then.
    """
    if silent_in(comparison.model.conditions).any():
        return
    entries = {entry.id: entry for entry in catalogue()}
    for place, item in enumerate(instances):
        for name in rivals.get(item.effect.id, ()):
            entry = entries.get(name)
            if DEAD_ZONE not in (name, item.effect.id) or not entry or len(entry.parameters) != 1:
                continue
            others = replaced(instances, place, Instance(entry, (1.0,), {}))
            apart = unlike(comparison, instances, others)
            if apart and _as_likely(comparison, instances, others, place):
                yield item.effect.id, name, apart


def _as_likely(
    comparison: Comparison, some: Sequence[Instance], others: Sequence[Instance], place: int
) -> bool:
    """Whether others, of which one is in the place of another, explain the readings as well."""
    worse = squares_left(comparison, others) - squares_left(comparison, some)
    (lowest,) = (parameter.minimum for parameter in others[place].amplitudes)
    size = fitted_sizes(comparison, others).of_each[place][0]
    return worse < -2.0 * float(np.log(POSSIBLE)) and bool(size > lowest)


def left_undecided(
    comparison: Comparison, instances: Sequence[Instance], effects: Sequence[FoundEffect]
) -> tuple[str, ...]:
    """Coefficients that hang on whether effects, as a discovery tells them, are a dead zone."""
    rivals = {found.id: found.indistinguishable for found in effects}
    found = undecided(comparison, instances, rivals)
    return tuple(dict.fromkeys(name for *_, coefficients in found for name in coefficients))


def in_fit(name: str) -> str:
    """Name of a coefficient in a calibration, which has one misalignment in each mounting."""
    return "M" if name.partition(" ")[0] in ("M", "M_O", "M_P") else name


OPEN = ("K1", "K3")
"""Coefficients that take up what a dead zone has in width beyond what it silences."""

SILENCED = (*OPEN, "M")
"""Coefficients that are off where a dead zone silences positions and is not taken out.

So are the slopes of the misalignment.
"""

_STEPS = 5
_RANK = 1e-9

_ALIKE = 1e-9
"""Misalignments that are one [rad]."""

_SILENT = (
    "the positions across the input axis are silent, as in a dead zone of {:.4g} ug or any wider"
    " one, of which K1 and k3 take up the rest: nothing bounds that, and no U counts it; to tell:"
    " fine steps of the head about the two positions near 0 g"
)

_TOLD = (
    "the positions across the input axis are silent in it, so that the others alone tell the"
    " misalignment"
)


def said_of_silence(comparison: Comparison, named: Explanation) -> Iterator[tuple[str, list[str]]]:
    """Say where a dead zone of any width explains the readings in place of what is named.

    It is said of effects of the position alone, with their ids: one of them is in doubt, and of a
    dead zone the size.
    """
    if silent_in(comparison.model.conditions).any():
        yield f"{DEAD_ZONE}: {_TOLD}", []
        return
    for name, widest in silenced(comparison, named.instances):
        yield f"{name}: {_SILENT.format(widest * MICRO)}", [name]


def silenced(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[tuple[str, float]]:
    """Find effects of the position alone in whose place a dead zone of any width explains all.

    Beside the id of each, the acceleration that is silent in it at least [g].
    """
    bound = squares_left(comparison, instances) - 2.0 * float(np.log(POSSIBLE))
    static = of_position(comparison, comparison.directions(*instances))
    for place in np.flatnonzero(static).tolist():
        tilted, rest = _fitted(comparison, replaced(instances, place))
        if float(rest @ rest) < bound:
            yield instances[place].effect.id, float(tilted.max())


def may_be_wider(comparison: Comparison, instances: Sequence[Instance]) -> bool:
    """Tell whether a dead zone of any width could as well stand in place of one of some effects.

    They explain the readings, and a dead zone among them may be that one. If so, `OPEN` have no
    bound, as its width has none.
    """
    if not instances or silent_in(comparison.model.conditions).any():
        return False
    return any(True for _ in silenced(comparison, instances))


def silent_first(
    comparison: Comparison, found: Sequence[Explanation], alpha: float
) -> tuple[Explanation, ...]:
    """Let the explanation with a dead zone be the best where one of any width explains as well.

    Of effects that look alike, a dead zone is what makes readings silent; what else is as sure at
    the false-alarm rate alpha, such as a_p^3, takes the misalignment for twice as much.
    """
    if silent_in(comparison.model.conditions).any():
        return tuple(found)
    best = found[0]
    sure = [one for one in found if DEAD_ZONE in one.ids - best.ids and max(one.p_values) < alpha]
    names = {name for name, _ in silenced(comparison, best.instances)} if sure else ()
    first = [one for one in sure if any(one.ids ^ best.ids == {DEAD_ZONE, name} for name in names)]
    return (*first[:1], *(one for one in found if one not in first[:1]))


def of_open_width(effect: FoundEffect) -> FoundEffect:
    """Take the uncertainty from the width of a dead zone that nothing bounds."""
    if effect.id != DEAD_ZONE:
        return effect
    return replace(effect, parameters={name: unbounded(q) for name, q in effect.parameters.items()})


def has_open_width(effect: FoundEffect) -> bool:
    """Tell whether an effect is a dead zone whose width nothing bounds."""
    return effect.id == DEAD_ZONE and any(
        q.value and q.standard_uncertainty is None for q in effect.parameters.values()
    )


def without_bound(changes: Sequence[Change], names: Collection[str]) -> tuple[Change, ...]:
    """Take the uncertainty from some coefficients."""
    return tuple(
        replace(each, after=unbounded(each.after)) if each.coefficient in names else each
        for each in changes
    )


def unbounded(quantity: Quantity) -> Quantity:
    """Take the uncertainty from a value of which nothing bounds the error."""
    return Quantity(quantity.value, None, quantity.unit)


def likeliest_silence(comparison: Comparison, zone: Instance) -> Mask | None:
    """Find the readings that a dead zone silences likeliest, in the runs of least misalignment.

    There are none where any such silence leaves more than there is without one. One at all levels
    is preferred, as one at some of them has the width that it has there besides.
    """
    model, c = comparison.model, comparison.model.conditions
    across = across_the_axis(c)
    if across is None:
        return None
    runs = dummies(c.run)[across]
    tilted = runs.T @ _fitted(comparison, [])[0][across] / np.maximum(runs.sum(axis=0), 1.0)
    margin = 2.0 * float(np.log(POSSIBLE))
    likeliest, least = None, float(comparison.seen @ comparison.seen) + margin
    for level in distinct(tilted[tilted > 0.0].round(9)).tolist()[::-1]:
        silent = across & (dummies(c.run) @ (tilted < level + _ALIKE) > 0.0)
        beside = compared(
            comparison.record,
            model.T0,
            model.delta0,
            noise=comparison.noise,
            silent=silent,
            apart=model.apart,
        )
        left = squares_left(beside, [zone])
        if left < least:
            likeliest, least = silent, left + margin
    return likeliest


def silence_beside(
    comparison: Comparison, instances: Sequence[Instance], p_value: float
) -> Unexplained:
    """Tell of a dead zone of any width beside effects that leave nothing else.

    The p-value is the chance that noise disagrees as much with the model.
    """
    seen, left = comparison.seen, squares_left(comparison, instances)
    tilted, rest = _fitted(comparison, instances)
    share = (left - float(rest @ rest)) / float(seen @ seen)
    return Unexplained(_SILENT.format(float(tilted.max()) * MICRO), max(share, 0.0), p_value)


def _fitted(comparison: Comparison, others: Sequence[Instance]) -> tuple[Array, Array]:
    """Tilt of the positions across the input axis [g], and coordinates of what is left.

    Steps of Gauss and Newton from a misalignment of which silent readings tell nothing.
    """
    model, c = comparison.model, comparison.model.conditions
    columns = all_own_columns(others, c)
    silent = np.abs(c.input) < ALONG
    parameters, sizes = comparison.parameters, np.zeros(columns.shape[1])
    for _ in range(_STEPS):
        lost = np.where(silent, c.input + tilt(model, parameters), 0.0)
        jacobian = model.jacobian(parameters)
        jacobian[np.ix_(silent, model.tilting)] = 0.0
        residual = model.residual(parameters) + c.gain * lost - columns @ sizes
        whole = comparison.space.whiten(np.hstack([jacobian, columns]))
        left = comparison.space.whiten(residual)
        units, norms = scaled(whole)
        step = np.linalg.lstsq(units, left, rcond=_RANK)[0] / norms
        left = left - whole @ step
        parameters = parameters + step[: parameters.size]
        sizes = sizes + step[parameters.size :]
    tilted = np.abs(tilt(model, parameters))
    return np.where(silent, tilted, 0.0), comparison.space.left_of(left)
