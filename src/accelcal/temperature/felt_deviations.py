"""Readings of runs whose temperature moves, brought to the mean temperature of their run.

Coefficients of a table are those at one temperature. Where the recorded temperatures move within
the runs and the readings follow them, the slopes of the laws tell what each reading would have been
at the mean: without that, the scatter of its strokes passes for noise, and the first of them for
outliers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.tables import PreparedTable
from accelcal.plural import counted, plural
from accelcal.temperature.at_rest import AtRest
from accelcal.temperature.from_tables import (
    LawsOfRecords,
    laws_of_records,
    tables_of_one_mounting,
)
from accelcal.temperature.levels import level_stack
from accelcal.temperature.product_errors import (
    ProductFit,
    Solution,
    felt_beside_noise,
    product_fit,
    to_the_mean,
    unfelt_share,
)
from accelcal.temperature.product_fit import scale_factor_is_told, solved
from accelcal.temperature.recorded import RecordedTemperatures
from accelcal.temperature.run_temperatures import stacked_temperature_uncertainty

_FOLLOWS = 0.5
"""Readings follow their temperatures where surely more than this share of the changes is felt."""

_SURE = 3.0
"""Standard uncertainties within which a felt share of 1 is taken for just that."""

_MUCH = 0.5
"""Span of a run's temperatures that is told [degC]: the AL-15 changes by 130 ppm in half of it."""

_ALONE = 10.0
"""Median deviations from the median beyond which a temperature is none of its run."""

_AT_A_TIME = 20_000
"""Readings: with some dozens of unknowns each, they take a few MB."""


class _Moving(NamedTuple):
    """R records of one plan whose temperatures move within the runs."""

    tables: Sequence[PreparedTable]
    estimate: JointEstimate
    temperatures: RecordedTemperatures
    span: Array


def brought_to_rest(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    outputs: Sequence[Array],
    temperatures: RecordedTemperatures,
) -> AtRest:
    """Bring the readings to the mean temperature of their run, where they follow the recorded one.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of any of R records of one plan.
    estimate : JointEstimate
        Their coefficients, which tell the laws well enough.
    outputs : sequence of ndarray, shape (R, n)
        Readings of each table [output unit].
    temperatures : RecordedTemperatures
        Those of the records.

    Returns
    -------
    AtRest
        The readings; as they were where temperatures stand, or no law is known.
    """
    span = temperatures.span
    at_rest = AtRest.of(outputs)
    if not (span > 0.0).any():
        return at_rest
    moving = _Moving(tables, estimate, temperatures, span)
    at_rest = at_rest._replace(outputs=tuple(y.copy() for y in outputs))
    changed, unknown = np.zeros(span.shape, dtype=np.bool_), np.nan_to_num(span)
    felt, ignored = np.ones(span.shape), np.zeros(span.shape, dtype=np.bool_)
    for chosen, rows, fit, laws in _fits(moving):
        state, these = solved(fit, laws), np.ix_(rows, np.array(chosen))
        unknown[these] = 0.0
        follows = (state.felt - 2.0 * state.doubt > _FOLLOWS) & (span[these] > 0.0)
        changed[these] = follows
        partly = (state.felt > _SURE * state.doubt) & ~_in_full(state) & (span[these] > 0.0)
        felt[these] = np.where(partly, state.felt, 1.0)
        ignored[these] = (state.felt + 2.0 * state.doubt < _FOLLOWS) & ~partly
        at_rest.unfelt[these] = np.where(follows, unfelt_share(state), 1.0)
        follow = np.repeat(follows, [len(tables[i].record) for i in chosen], axis=1)
        change = np.where(follow, _change(fit, state), 0.0)
        edges = np.cumsum([len(tables[i].record) for i in chosen])[:-1]
        for table, own in zip(chosen, np.split(change, edges, axis=1), strict=True):
            at_rest.outputs[table][rows] += own
    said = [
        (
            *_what_was_done(moving, record, changed[record]),
            *_felt_in_part(tables, felt[record]),
            *_mistyped(moving, record, ignored[record] & (span[record] > _MUCH)),
            *_left_moving(tables, unknown[record]),
        )
        for record in range(len(span))
    ]
    return at_rest._replace(said=said)


def _fits(moving: _Moving) -> Iterator[tuple[list[int], Places, ProductFit, Array]]:
    """Records whose laws are known, a few at a time: tables, rows, fit, and laws to start from."""
    estimate = moving.estimate
    chosen = tables_of_one_mounting(moving.tables, estimate)
    if len(chosen) < 2:
        return
    laws = _first_laws(moving, chosen)
    known = np.all([np.isfinite(estimate.noises[i].factor) for i in chosen], axis=0)
    known &= (moving.span > 0.0).any(axis=1)
    K1 = laws.names.index("K1 at_T0")
    known &= scale_factor_is_told(laws.value[:, K1], laws.standard[:, K1])
    few = max(_AT_A_TIME // sum(len(moving.tables[i].record) for i in chosen), 1)
    for place, group in enumerate(laws.groups):
        own = np.flatnonzero(known & (laws.group == place))
        for start in range(0, own.size, few):
            rows = own[start : start + few]
            sides = group.laws.sides
            fit = product_fit(moving.tables, estimate, moving.temperatures, chosen, rows, sides)
            yield chosen, rows, fit, group.laws.values[laws.member[rows]]


def _first_laws(moving: _Moving, chosen: Sequence[int]) -> LawsOfRecords:
    declared = moving.tables[0].record.apparatus.temperature_uncertainty
    uncertain = stacked_temperature_uncertainty(moving.temperatures.readings, declared)
    return laws_of_records(
        level_stack(moving.tables, moving.estimate, moving.temperatures, uncertain, chosen)
    )


def _change(fit: ProductFit, state: Solution) -> Array:
    """What brings each reading to the mean temperature of its run, shape (R, n) [output unit]."""
    # A share that may well be 1 is taken as 1. Were it estimated for each run, it would follow the
    # noise of the readings, and take some of it out.
    felt = np.where(_in_full(state), 1.0, felt_beside_noise(fit, state.felt))
    return to_the_mean(fit, state, fit.readings.at(felt))


def _in_full(state: Solution) -> Mask:
    return np.asarray(np.abs(1.0 - state.felt) < _SURE * state.doubt)


def _what_was_done(moving: _Moving, record: int, changed: Mask) -> tuple[str, ...]:
    places = np.flatnonzero(changed).tolist()
    if not places:
        return ()
    readings, levels = moving.temperatures.readings, moving.temperatures.levels
    away = max(float(np.abs(readings[i][record] - levels[record, i]).max()) for i in places)
    return (
        f"{_runs([moving.tables[i] for i in places])}: the temperature moves, by up to {away:.2g}"
        " degC from its mean, and the readings follow; they were brought to the mean temperature"
        " of the run by the slopes of the laws",
    )


def _felt_in_part(tables: Sequence[PreparedTable], felt: Array) -> tuple[str, ...]:
    """Say where temperatures that nobody recorded make noise that differs by position."""
    partly = np.flatnonzero(felt < 1.0).tolist()
    if not partly:
        return ()
    shares = ", ".join(f"{100.0 * felt[i]:.0f} %" for i in partly)
    return (
        f"{_runs([tables[i] for i in partly])}: of the recorded changes of the temperature {shares}"
        " were felt, so others were that nobody recorded: they make readings near 0 and 180 deg"
        " noisier than the others, which the tables take for noise of all alike; U of K3 may be"
        " too small, those of K0 and M are too large; mend the sensor or the chamber",
    )


def _mistyped(moving: _Moving, record: int, ignored: Mask) -> Iterator[str]:
    """Say which temperatures are far from the others of their run, and were surely not felt."""
    for place in np.flatnonzero(ignored).tolist():
        own = moving.temperatures.readings[place][record]
        away = np.abs(own - np.median(own))
        odd = away > max(_MUCH, _ALONE * float(np.median(away)))
        if odd.any():
            yield (
                f"{_runs([moving.tables[place]])}: {counted(int(odd.sum()), 'temperature')} of"
                f" {own.size} far from the others, such as {own[away.argmax()]:g} degC, and the"
                " readings do not follow: the mean, which counts for the run, is in doubt; mend"
                " what is mistyped"
            )


def _left_moving(tables: Sequence[PreparedTable], unknown: Array) -> tuple[str, ...]:
    """Say which temperatures move by much while no law tells what that does to the readings."""
    left = [tables[i] for i in np.flatnonzero(unknown > _MUCH).tolist()]
    if not left:
        return ()
    return (
        f"{_runs(left)}: the recorded temperatures span up to {unknown.max():.2g} degC, and no laws"
        " in this mounting tell what that does to the readings, which are taken as they are",
    )


def _runs(tables: Sequence[PreparedTable]) -> str:
    names = ", ".join(table.run_label for table in tables)
    return f"{plural('run', len(tables))} {names}"
