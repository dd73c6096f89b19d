"""A dead zone about as wide as the misalignment, which no column of a small one shows.

Positions across the input axis are silent in it: their readings tell nothing of the misalignment,
which all others then tell. So it is fitted for what it is, with the misalignment in its kinks.
With steps of 45 deg it looks like a_p^3, whatever its width: K1 and K3 take up the rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import CONTRADICTION, Explanation
from accelcal.discovery.family import Family, agrees, chance
from accelcal.discovery.instance import Instance, own_columns
from accelcal.discovery.silence import ALONG, DEAD_ZONE, silent_in
from accelcal.discovery.spans import lengths
from accelcal.discovery.unnamed.any_pattern import of_position
from accelcal.discovery.unnamed.wandering import POSSIBLE
from accelcal.discovery.untold import fitted_sizes
from accelcal.results.discovery import Discovery
from accelcal.results.findings import Change, FoundEffect, Unexplained
from accelcal.results.quantity import Quantity
from accelcal.units import MICRO

OPEN = ("K1", "K3")
"""Coefficients that take up what a dead zone has in width beyond what it silences."""

_STEPS = 5
_RANK = 1e-9

_WIDTHS = (0.5, 0.7, 0.85, 1.0, 1.2)
"""Thresholds that are tried, over the misalignment of each level."""

_SILENT = (
    "the positions across the input axis are silent, as in a dead zone of {:.4g} ug or any wider"
    " one, of which K1 and K3 take up the rest: nothing bounds that, and no U counts it; to tell:"
    " fine steps of the head about the two positions near 0 g"
)

_TOLD = (
    "the positions across the input axis are silent in it, so that the others alone tell the"
    " misalignment"
)


def said_of_silence(
    comparison: Comparison, found: Sequence[Explanation]
) -> Iterator[tuple[str, list[str]]]:
    """Say where a dead zone of any width explains the readings in place of what is named.

    It is said of effects of the position alone, with their ids: one of them is in doubt, and of a
    dead zone the size.
    """
    if found and silent_in(comparison.model.conditions).any():
        yield f"{DEAD_ZONE}: {_TOLD}", []
        return
    for name, tilt in silenced(comparison, found[0].instances) if found else ():
        yield f"{name}: {_SILENT.format(tilt * MICRO)}", [name]


def silenced(comparison: Comparison, instances: Sequence[Instance]) -> Iterator[tuple[str, float]]:
    """Find effects of the position alone in whose place a dead zone of any width explains all.

    Beside the id of each, the acceleration that is silent in it at least [g].
    """
    sizes = fitted_sizes(comparison, instances)
    left = comparison.seen - sizes.linear @ sizes.whole
    bound = float(left @ left) - 2.0 * float(np.log(POSSIBLE))
    static = of_position(comparison, comparison.directions(*instances))
    for place in np.flatnonzero(static).tolist():
        tilt, rest = _fitted(comparison, [*instances[:place], *instances[place + 1 :]], np.inf)
        if float(rest @ rest) < bound:
            yield instances[place].effect.id, float(tilt.max())


def may_be_wider(comparison: Comparison, instances: Sequence[Instance]) -> bool:
    """Tell whether a dead zone of any width could as well stand in place of one of some effects.

    Parameters
    ----------
    comparison : Comparison
        The readings.
    instances : sequence of Instance
        The effects, which explain them; a dead zone among them may be that one.

    Returns
    -------
    bool
        Then `OPEN` have no bound, as its width has none.
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
    if not found or silent_in(comparison.model.conditions).any():
        return tuple(found)
    best = found[0]
    sure = [one for one in found if DEAD_ZONE in one.ids - best.ids and max(one.p_values) < alpha]
    names = {name for name, _ in silenced(comparison, best.instances)} if sure else ()
    first = [one for one in sure if any(one.ids ^ best.ids == {DEAD_ZONE, name} for name in names)]
    return (*first[:1], *(one for one in found if one not in first[:1]))


def with_open_width(
    found: Discovery, comparison: Comparison, instances: Sequence[Instance]
) -> Discovery:
    """Take the uncertainty from K1 and K3, where they take up whatever a dead zone is wider.

    So from its width, where it is named; nothing bounds that.
    """
    if not may_be_wider(comparison, instances):
        return found
    coefficients = tuple(map(of_open_coefficient, found.coefficients))
    return replace(
        found, coefficients=coefficients, effects=tuple(map(of_open_width, found.effects))
    )


def of_open_coefficient(change: Change) -> Change:
    """Take the uncertainty from K1 and K3 beside a dead zone whose width nothing bounds."""
    return replace(change, after=unbounded(change.after)) if change.coefficient in OPEN else change


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


def unbounded(quantity: Quantity) -> Quantity:
    """Take the uncertainty from a value of which nothing bounds the error."""
    return Quantity(quantity.value, None, quantity.unit)


def wide_dead_zone(family: Family, alpha: float, p_value: float) -> Unexplained | None:
    """Find a dead zone as wide as the misalignment that leaves nothing but noise, if any does.

    The p-value is the chance that noise disagrees as much as what it explains.
    """
    comparison, space = family.comparison, family.space
    tilt, silent = _fitted(comparison, [], np.inf)
    levels = np.unique(np.round(tilt[tilt > 0.0], 9))
    widths = [float(level * width) for level in levels for width in _WIDTHS]
    tried = [(np.inf, silent), *((own, _fitted(comparison, [], own)[1]) for own in widths)]
    threshold, rest = min(tried, key=lambda one: float(one[1] @ one[1]))
    left, total = float(rest @ rest), float(comparison.seen @ comparison.seen)
    gained = float(chance(np.array((total - left) / space.variance(rest)), space.dof))
    beside = family._replace(comparison=comparison._replace(seen=rest))
    if gained * len(tried) * family.tests >= alpha or not agrees(
        beside, space.nothing(), CONTRADICTION * alpha
    ):
        return None
    told = _SILENT.format(float(tilt.max()) * MICRO)
    if float(silent @ silent) > left - 2.0 * float(np.log(POSSIBLE)):
        told = (
            f"a dead zone of about {threshold * MICRO:.3g} ug, as wide as the misalignment at some"
            " temperatures, leaves only noise"
        )
    return Unexplained(told, 1.0 - left / total, p_value)


def _fitted(
    comparison: Comparison, others: Sequence[Instance], threshold: float
) -> tuple[Array, Array]:
    """Tilt of the positions across the input axis [g], and coordinates of what is left.

    Steps of Gauss and Newton from a misalignment of which silent readings tell nothing.
    """
    model, c = comparison.model, comparison.model.conditions
    columns = np.hstack([np.zeros((len(c.input), 1)), *(own_columns(item, c) for item in others)])
    own = np.array([name.startswith("M") and "_i" not in name for name in model.names])
    across, tilting = np.abs(c.input) < ALONG, model.inside[:, own[model.gain.shape[1] :]]
    parameters, sizes = comparison.parameters, np.zeros(columns.shape[1])
    silent = across
    for _ in range(_STEPS):
        axial = c.input + tilting @ parameters[own]
        silent = across & (np.abs(axial) < threshold) if np.isfinite(threshold) else across
        width = threshold if np.isfinite(threshold) else 0.0
        lost = np.where(silent, axial, np.sign(axial) * width)
        jacobian = model.jacobian(parameters)
        jacobian[np.ix_(silent, own)] = 0.0
        residual = model.residual(parameters) + c.gain * lost - columns @ sizes
        whole = comparison.space.whiten(np.hstack([jacobian, columns]))
        left = comparison.space.whiten(residual)
        norms = np.where(lengths(whole) > 0.0, lengths(whole), 1.0)
        step = np.linalg.lstsq(whole / norms, left, rcond=_RANK)[0] / norms
        left = left - whole @ step
        parameters = parameters + step[: parameters.size]
        sizes = sizes + step[parameters.size :]
    tilt = np.abs(tilting @ parameters[own])
    return np.where(across, tilt, 0.0), comparison.space.left_of(left)
