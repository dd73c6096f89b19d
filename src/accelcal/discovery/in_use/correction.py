"""A record with the effects of a discovery taken out of its readings.

The sizes of the effects are fitted to the record itself, in the space that the base model leaves:
there they are independent of the coefficients that are fitted to what remains, so that their
uncertainty adds to that of the coefficients as one more component. An effect that the record
cannot show keeps the size that the discovery gave it, or stays in the readings, see
`accelcal.discovery.in_use.carrying_over`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import compress
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import orthonormal, scaled
from accelcal.discovery.comparison import Comparison, compared
from accelcal.discovery.dead_zone import (
    OPEN,
    SILENCED,
    has_open_width,
    in_fit,
    left_undecided,
    may_be_wider,
    of_open_width,
)
from accelcal.discovery.in_use.another_record import (
    InPlace,
    in_own_shape,
    in_place,
    said_of_effects,
)
from accelcal.discovery.in_use.carrying_over import LeftIn, Meeting, with_a_place
from accelcal.discovery.instance import (
    Instance,
    all_own_columns,
    amplitude_columns,
    column_of,
    contributions,
    instance_of,
    sizes_of,
)
from accelcal.discovery.large_effects import silent_by, silent_in, straightened, unheard
from accelcal.discovery.parameters import parameters_of
from accelcal.discovery.solution import gaps_along
from accelcal.discovery.untold import fitted_sizes, not_shown, slopes, smooth, untold
from accelcal.discovery.unwritten import (
    in_pauses,
    said_of_temperatures,
    shows_going_on,
    with_temperatures_of_runs,
)
from accelcal.effects.found import disturbances
from accelcal.numerics.covariance import covariance_root
from accelcal.record import TumbleRecord
from accelcal.results.discovery import Discovery
from accelcal.results.findings import FoundEffect
from accelcal.results.quantity import Quantity


class Correction(NamedTuple):
    """A record without the effects, and what is uncertain in them."""

    record: TumbleRecord  # the record with the effects taken out of its n readings
    acting: Array
    """Change of the readings by one standard uncertainty of each of h sizes, (n, h) [output unit].
    """
    dof: int  # degrees of freedom of these uncertainties
    effects: tuple[FoundEffect, ...]
    """Effects that were taken out with their sizes in this record, and the gap before and after
    each."""
    unbounded: tuple[str, ...] = ()  # coefficients of which nothing bounds the error that is left
    as_found: tuple[str, ...] = ()
    """Ids of those effects that the readings do not show: they have the sizes of the discovery."""
    left_in: tuple[LeftIn, ...] = ()
    """Effects that the readings do not show and that are left in them."""
    in_place: tuple[InPlace, ...] = ()
    """What may be there in the place of effects that were taken out."""
    said: tuple[str, ...] = ()  # what else a reader must know of the effects


def correction(
    record: TumbleRecord,
    model: Discovery,
    reference_temperature: float,
    delta0: float,
    *,
    gaps: bool,
) -> Correction:
    """Take the effects of a discovery out of the readings of a record.

    T0 is in degC, the fixture angle in rad. With `gaps`, the gap in this record is told before and
    after each effect, which takes half of the time; without, those of the discovery stand.

    Raises
    ------
    InputError
        If the record is too small to tell its noise, an effect does not fit it, or a run has no
        temperature and others have.
    """
    if not model.effects:
        return _taken_out(Meeting(record, model, reference_temperature, delta0), gaps=gaps)
    whole = with_temperatures_of_runs(record)
    found = _taken_out(Meeting(whole, model, reference_temperature, delta0), gaps=gaps)
    corrected = replace(record, output=found.record.output)
    return found._replace(record=corrected, said=(*found.said, *said_of_temperatures(whole)))


def _taken_out(meeting: Meeting, *, gaps: bool) -> Correction:
    record, model, reference, delta0 = meeting
    effects, said = with_a_place(meeting)
    bare = set(map(in_fit, model.unbounded))
    silenced = SILENCED if model.unexplained and bare.issuperset(SILENCED) else ()
    nothing = Correction(record, np.empty((len(record), 0)), 1, (), silenced, said=said)
    if not effects:
        return nothing
    known = disturbances(effects)
    instances = tuple(map(instance_of, known))
    silent = silent_by(record, reference, delta0, known, own=meeting.of_one_unit)
    comparison = compared(record, reference, delta0, instances, silent=silent)
    if apart := shows_going_on(comparison, instances):
        comparison = compared(record, reference, delta0, instances, silent=silent, apart=True)
    shown = _shown(comparison, instances)
    left = [
        None if own else meeting.left_in(item, comparison.model)
        for item, own in zip(known, shown, strict=True)
    ]
    nothing = nothing._replace(left_in=tuple(item for item in left if item and item.adds.any()))
    is_taken = [item is None for item in left]
    rest, as_found = list(compress(effects, is_taken)), list(compress(instances, is_taken))
    own = in_own_shape(comparison, as_found)
    if own != as_found:
        comparison = compared(record, reference, delta0, tuple(own), silent=silent, apart=apart)
    return _without(meeting, comparison, rest, tuple(own), nothing, gaps=gaps) if rest else nothing


def _without(
    meeting: Meeting,
    comparison: Comparison,
    rest: Sequence[FoundEffect],
    instances: tuple[Instance, ...],
    nothing: Correction,
    *,
    gaps: bool,
) -> Correction:
    """Take out the effects of the discovery that are not left in."""
    record, model = meeting.record, meeting.model
    shown = _shown(comparison, instances)
    fitted = list(compress(instances, shown))
    is_open = may_be_wider(comparison, fitted)
    hanging = tuple(map(in_fit, left_undecided(comparison, fitted, model.effects)))
    if not silent_in(comparison.model.conditions).any():
        straight = straightened(comparison, fitted)
        if straight is not None:
            record, comparison = straight, comparison.anew(straight, instances)
    held = [found for found, is_shown in zip(rest, shown, strict=True) if not is_shown]
    whole, (taken, open_held) = comparison, _held(comparison, fitted, held)
    comparison = comparison.less(taken) if held else comparison
    effects = _with_sizes(comparison, rest, fitted, shown)
    own = list(compress(effects, shown))
    of_size = _of_size(fitted, own)
    added, uncertain = _taken(comparison, own, _by_noise(comparison, of_size, own))
    left_open = _left_open(comparison, of_size)
    others = tuple(in_place(comparison, of_size, added, model, hanging))
    explanations = [of_size, *(other.instances for other in others)]
    paused, said = in_pauses(comparison, explanations, disturbances(held))
    lacking, open_too = unheard(comparison, fitted)
    nominal = comparison.model.nominal
    output = record.output - nominal * (added + taken - lacking)
    acting = nominal * np.hstack([uncertain, open_held, left_open, open_too, paused])
    if gaps:
        effects = _with_gaps(whole, instances, effects)
    if is_open:
        effects = tuple(map(of_open_width, effects))
    named = OPEN if is_open or any(map(has_open_width, effects)) else tuple(dict.fromkeys(hanging))
    return nothing._replace(
        record=replace(record, output=output),
        acting=acting,
        dof=comparison.space.dof,
        effects=effects,
        unbounded=nothing.unbounded or named,
        as_found=tuple(found.id for found in held),
        left_in=_of_rest(comparison, fitted, nothing.left_in),
        in_place=others,
        said=(*nothing.said, *said, *said_of_effects(comparison, others, model, fitted)),
    )


def _with_sizes(
    comparison: Comparison,
    rest: Sequence[FoundEffect],
    fitted: Sequence[Instance],
    shown: Sequence[bool],
) -> tuple[FoundEffect, ...]:
    """Effects with the sizes that the readings show."""
    new = iter(_sizes(comparison, fitted))
    each = zip(rest, shown, strict=True)
    return tuple(
        replace(found, parameters=next(new)) if is_shown else found for found, is_shown in each
    )


def _with_gaps(
    comparison: Comparison, instances: Sequence[Instance], effects: Sequence[FoundEffect]
) -> tuple[FoundEffect, ...]:
    steps = gaps_along(comparison, instances)
    return tuple(
        replace(found, **before.until(after))
        for found, before, after in zip(effects, steps, steps[1:], strict=False)
    )


def _shown(comparison: Comparison, instances: Sequence[Instance]) -> list[bool]:
    """Which effects the readings show beside the base model and those before them."""
    space, c = comparison.space, comparison.model.conditions
    found, taken = [], space.nothing()
    for item in instances:
        own, is_shown = space.shown(column_of(item, c)[:, None], taken)
        found.append(bool(is_shown.all()))
        if found[-1]:
            taken = orthonormal(np.hstack([taken, own]))
    return found


def _held(
    comparison: Comparison, fitted: Sequence[Instance], held: Sequence[FoundEffect]
) -> tuple[Array, Array]:
    """What effects do that have the sizes of the discovery, and what these leave open [g]."""
    c, known = comparison.model.conditions, disturbances(held)
    columns = [np.empty((c.angle.size, 0))]
    for found, item in zip(held, known, strict=True):
        own = [_uncertainty(found.parameters.get(p.name)) for p in item.effect.amplitudes]
        columns.append(amplitude_columns(instance_of(item), c) * np.array(own))
    return contributions(known, c), _beside(comparison, fitted, np.hstack(columns))


def _of_rest(
    comparison: Comparison, fitted: Sequence[Instance], left_in: Sequence[LeftIn]
) -> tuple[LeftIn, ...]:
    """Effects that are left in, less what those that are fitted take up of them."""
    nominal = comparison.model.nominal
    rest = (_beside(comparison, fitted, item.adds[:, None] / nominal)[:, 0] for item in left_in)
    return tuple(item._replace(adds=nominal * own) for item, own in zip(left_in, rest, strict=True))


def _beside(comparison: Comparison, fitted: Sequence[Instance], changes: Array) -> Array:
    """What is left of changes of the readings where effects are fitted to them [g], (n, k)."""
    if not fitted or not changes.size:
        return changes
    sizes, c = fitted_sizes(comparison, fitted), comparison.model.conditions
    columns = all_own_columns(fitted, c)[:, sizes.shown]
    seen = comparison.space.see(changes)
    return changes - columns @ np.linalg.lstsq(sizes.linear[:, sizes.shown], seen, rcond=None)[0]


def _sizes(comparison: Comparison, fitted: Sequence[Instance]) -> list[dict[str, Quantity]]:
    """Estimate the parameters of effects in this record.

    What cannot be below zero, such as a width, and comes out so is zero with the same uncertainty,
    and the others are estimated without it: least squares under that condition.
    """
    if not fitted:
        return []
    free = parameters_of(comparison, fitted)
    bound = [_at_zero(item, found) for item, found in zip(fitted, free, strict=True)]
    if not any(bound):
        return list(free)
    others = [item for item, zero in zip(fitted, bound, strict=True) if not zero]
    again = iter(_sizes(comparison, others))
    return [found | zero if zero else next(again) for found, zero in zip(free, bound, strict=True)]


def _at_zero(item: Instance, found: dict[str, Quantity]) -> dict[str, Quantity]:
    """Amplitudes of an effect at zero, where one is below; none where all are as they may be."""
    below = [p for p in item.amplitudes if (found[p.name].value or 0.0) < p.minimum]
    return {p.name: replace(found[p.name], value=0.0) for p in item.amplitudes} if below else {}


def _of_size(fitted: Sequence[Instance], own: Sequence[FoundEffect]) -> list[Instance]:
    """Effects that are fitted and are not zero."""
    return [
        item
        for item, effect in zip(fitted, own, strict=True)
        if any(effect.parameters[p.name].value for p in item.amplitudes)
    ]


def _by_noise(
    comparison: Comparison, of_size: Sequence[Instance], own: Sequence[FoundEffect]
) -> list[Mapping[str, Quantity]]:
    """Parameters of fitted effects with what noise makes uncertain in them, see `_left_open`."""
    told = {found.id: found.parameters for found in own}
    if held := not_shown(comparison, of_size):
        each = parameters_of(comparison, of_size, ranges=False)
        for one in held:
            del each[one.place][one.parameter.name]
        told |= {item.effect.id: new for item, new in zip(of_size, each, strict=True)}
    return list(told.values())


def _left_open(comparison: Comparison, fitted: Sequence[Instance]) -> Array:
    """Change of the readings by what each parameter that they do not tell leaves open [g]."""
    c = comparison.model.conditions
    found = [np.empty((len(comparison.record), 0))]
    for one in untold(comparison, fitted):
        below, above = (
            all_own_columns(end, c) @ fitted_sizes(comparison, end).whole
            for end in one.ends(fitted)
        )
        found.append((above - below)[:, None] / 2.0)
    return np.hstack(found)


def _taken(
    comparison: Comparison,
    effects: Sequence[FoundEffect],
    by_noise: Sequence[Mapping[str, Quantity]],
) -> tuple[Array, Array]:
    """What effects add to the readings [g], and its changes by what noise makes uncertain in them.

    The parameters that enter nonlinearly are uncertain together with the amplitudes.
    """
    c, known = comparison.model.conditions, disturbances(effects)
    columns, told = [np.empty((c.angle.size, 0))], []
    for item, parameters in zip(known, by_noise, strict=True):
        instance, sizes = instance_of(item), sizes_of(item)
        by_shape = slopes(instance, sizes[np.flatnonzero(instance.mixture)], c)
        columns += [amplitude_columns(instance, c), by_shape]
        own = (*item.effect.amplitudes, *smooth(item.effect))
        told += [_uncertainty(parameters.get(p.name)) for p in own]
    uncertain = np.array(told)
    changing = np.hstack(columns)[:, uncertain > 0.0]
    acting = changing * uncertain[uncertain > 0.0] @ _correlation_root(comparison, changing)
    return contributions(known, c), acting


def _correlation_root(comparison: Comparison, changing: Array) -> Array:
    """Root of the correlation of what is fitted with some columns [g]."""
    units, _ = scaled(comparison.space.see(changing))
    inverse = np.linalg.pinv(units.T @ units)
    scale = np.sqrt(np.diagonal(inverse))
    scale[scale == 0.0] = 1.0
    correlation = inverse / np.outer(scale, scale)
    np.fill_diagonal(correlation, 1.0)
    return covariance_root(correlation)


def _uncertainty(quantity: Quantity | None) -> float:
    return 0.0 if quantity is None else quantity.standard_uncertainty or 0.0
