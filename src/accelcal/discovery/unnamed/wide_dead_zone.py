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
from accelcal.discovery.instance import Instance, column_of
from accelcal.discovery.silence import ALONG, DEAD_ZONE, silent_in
from accelcal.discovery.spans import lengths, orthonormal, without
from accelcal.discovery.unnamed.any_pattern import of_position
from accelcal.discovery.unnamed.wandering import POSSIBLE
from accelcal.results.discovery import Discovery
from accelcal.results.findings import Unexplained
from accelcal.results.quantity import Quantity
from accelcal.units import MICRO

_TAKE_UP = ("K1", "K3")
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
    family: Family, found: Sequence[Explanation]
) -> Iterator[tuple[str, list[str]]]:
    """Say where a dead zone of any width explains the readings in place of what is named.

    It is said of effects of the position alone, with their ids: one of them is in doubt, and of a
    dead zone the size.
    """
    if found and silent_in(family.comparison.model.conditions).any():
        yield f"{DEAD_ZONE}: {_TOLD}", []
        return
    for name, tilt in silenced(family, found[0]) if found else ():
        yield f"{name}: {_SILENT.format(tilt * MICRO)}", [name]


def silenced(family: Family, named: Explanation) -> Iterator[tuple[str, float]]:
    """Find effects of the position alone in whose place a dead zone of any width explains all.

    Beside the id of each, the acceleration that is silent in it at least [g].
    """
    instances = list(named.instances)
    left = without(family.comparison.seen, orthonormal(named.directions))
    bound = float(left @ left) - 2.0 * float(np.log(POSSIBLE))
    for place in np.flatnonzero(of_position(family, named)).tolist():
        others = instances[:place] + instances[place + 1 :]
        tilt, rest = _fitted(family.comparison, others, np.inf)
        if float(rest @ rest) < bound:
            yield instances[place].effect.id, float(tilt.max())


def with_open_width(found: Discovery, family: Family, named: Explanation) -> Discovery:
    """Take the uncertainty from the width of a dead zone that may as well be wider.

    So from K1 and K3, which take up whatever it is wider: nothing bounds that.
    """
    if DEAD_ZONE not in named.ids or silent_in(family.comparison.model.conditions).any():
        return found
    if DEAD_ZONE not in (name for name, _ in silenced(family, named)):
        return found
    coefficients = (
        replace(change, after=_open(change.after)) if change.coefficient in _TAKE_UP else change
        for change in found.coefficients
    )
    effects = (
        replace(effect, parameters={name: _open(q) for name, q in effect.parameters.items()})
        if effect.id == DEAD_ZONE
        else effect
        for effect in found.effects
    )
    return replace(found, coefficients=tuple(coefficients), effects=tuple(effects))


def _open(quantity: Quantity) -> Quantity:
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
    columns = np.stack([np.zeros(len(c.input)), *(column_of(i, c) for i in others)], axis=1)
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
