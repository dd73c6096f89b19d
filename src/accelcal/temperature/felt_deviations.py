"""Readings of runs whose temperature moves, brought to the mean temperature of their run.

Coefficients of a table are those at one temperature. Where the recorded temperatures move within
the runs and the readings follow them, the slopes of the laws tell what each reading would have been
at the mean: without that, the scatter of its strokes passes for noise, and the first of them for
outliers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask, Places
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.tables import PreparedTable
from accelcal.plural import counted, named
from accelcal.temperature.from_tables import laws_of_records
from accelcal.temperature.levels import (
    AtRest,
    RecordedTemperatures,
    level_stack,
    stacked_temperature_uncertainty,
)
from accelcal.temperature.one_meaning import tables_of_one_mounting, with_one_meaning
from accelcal.temperature.product.errors import (
    ProductFit,
    Solution,
    edges_of,
    felt_beside_noise,
    product_fit,
    to_the_mean,
    unfelt_share,
)
from accelcal.temperature.product.fit import scale_factor_is_told, solved

_FOLLOWS = 0.5
"""Readings follow their temperatures where surely more than this share of the changes is felt."""

_SURE = 3.0
"""Standard uncertainties within which a felt share of 1 is taken for just that."""

_OTHER_SLOPE = 0.2
"""By so much of it, the slope on a side of T0 that was not measured may differ from the other."""

_MUCH = 0.5
"""Span of a run's temperatures that is told [degC]: the AL-15 changes by 130 ppm in half of it."""

_ALONE = 10.0
"""Median deviations from the median beyond which a temperature is none of its run."""

_AT_A_TIME = 20_000
"""Readings: with some dozens of unknowns each, they take a few MB."""


class _Felt(NamedTuple):
    """What tables felt of the recorded changes of their temperature, shape (..., tables)."""

    # share of the changes that was felt and its standard uncertainty; NaN where no law tells it
    share: Array
    doubt: Array
    span: Array  # range of the recorded temperatures [degC]
    away: Array  # most by which one of them is away from their mean [degC]
    beyond: Mask  # whether any lies on a side of T0 where no slope was measured

    @property
    def follows(self) -> Mask:
        """Tables whose readings follow the recorded temperature."""
        return np.asarray((self.share - 2.0 * self.doubt > _FOLLOWS) & (self.span > 0.0))

    @property
    def in_full(self) -> Mask:
        """Tables that may well have felt all of the changes."""
        return np.asarray(np.abs(1.0 - self.share) < _SURE * self.doubt)

    @property
    def in_part(self) -> Mask:
        """Tables that surely felt a part of the changes, and not all."""
        some = (self.share > _SURE * self.doubt) & (self.span > 0.0)
        least = _SURE * self.doubt + np.where(self.beyond, _OTHER_SLOPE, 0.0)
        return np.asarray(some & (1.0 - self.share >= least))

    @property
    def ignored(self) -> Mask:
        """Tables whose readings surely do not follow temperatures that move by much."""
        little = self.share + 2.0 * self.doubt < _FOLLOWS
        return np.asarray(little & ~self.in_part & (self.span > _MUCH))

    @property
    def untold(self) -> Mask:
        """Tables whose temperatures move by much while no law tells what that does."""
        return np.isnan(self.share) & (self.span > _MUCH)

    @property
    def told(self) -> Mask:
        """What there is to say of each table, in the order of these four, shape (R, 4, t)."""
        return np.stack([self.follows, self.in_part, self.ignored, self.untold], axis=1)


def brought_to_rest(
    tables: Sequence[PreparedTable],
    estimate: JointEstimate,
    outputs: Sequence[Array],
    temperatures: RecordedTemperatures,
    run_labels: Callable[[int], Sequence[str]],
) -> AtRest:
    """Bring the readings to the mean temperature of their run, where they follow the recorded one.

    The estimate tells the laws well enough for that. The outputs of each table are of shape (R, n)
    [output unit], and `run_labels` gives those of all tables of a record, by its place. Readings
    stay as they were where temperatures stand, or no law is known.
    """
    span = temperatures.span
    if not (span > 0.0).any():
        return AtRest.of(outputs)
    still = tuple(y.copy() for y in outputs)
    untold = np.full(span.shape, np.nan)
    beyond = np.zeros(span.shape, dtype=np.bool_)
    felt = _Felt(untold, untold.copy(), span, temperatures.away, beyond)
    for chosen, rows, fit, laws in _fits(tables, estimate, temperatures):
        state, these = solved(fit, laws), np.ix_(rows, np.array(chosen))
        own = _Felt(state.felt, state.doubt, span[these], felt.away[these], _beyond(fit))
        for whole, part in zip(felt, own, strict=True):
            whole[these] = part
        changes = np.split(_change(fit, state, own), edges_of(fit), axis=1)
        for table, follows, change in zip(chosen, own.follows.T, changes, strict=True):
            still[table][rows] += np.where(follows[:, None], change, 0.0)
    unfelt = np.where(felt.follows, unfelt_share(felt.share, felt.doubt), 1.0)
    said = [
        tuple(_sentences(record, own, felt, temperatures, run_labels)) if any(map(any, own)) else ()
        for record, own in enumerate(felt.told.tolist())
    ]
    return AtRest(still, unfelt, said)


def _fits(
    tables: Sequence[PreparedTable], estimate: JointEstimate, temperatures: RecordedTemperatures
) -> Iterator[tuple[list[int], Places, ProductFit, Array]]:
    """Records whose laws are known, a few at a time: tables, rows, fit, and laws to start from."""
    chosen = tables_of_one_mounting(tables, estimate)
    if len(chosen) < 2:
        return
    alike = with_one_meaning(tables, estimate)
    declared = tables[0].record.apparatus.temperature_uncertainty
    uncertain = stacked_temperature_uncertainty(temperatures.readings, declared)
    laws = laws_of_records(level_stack(tables, alike, temperatures, uncertain, chosen))
    known = np.all([np.isfinite(estimate.noises[i].factor) for i in chosen], axis=0)
    known &= (temperatures.span > 0.0).any(axis=1)
    K1 = laws.names.index("K1 at_T0")
    known &= scale_factor_is_told(laws.value[:, K1], laws.standard[:, K1])
    few = max(_AT_A_TIME // sum(len(tables[i].record) for i in chosen), 1)
    for place, group in enumerate(laws.groups):
        own = np.flatnonzero(known & (laws.group == place))
        for start in range(0, own.size, few):
            rows = own[start : start + few]
            fit = product_fit(tables, estimate, temperatures, chosen, rows, group.laws.sides)
            yield chosen, rows, fit, group.laws.values[laws.member[rows]]


def _beyond(fit: ProductFit) -> Mask:
    """Tables with readings on a side of T0 where no slope was measured, shape (R, t)."""
    rise = fit.readings.rise + fit.readings.deviation
    sides, beyond = fit.readings.sides, np.zeros(rise.shape, dtype=np.bool_)
    if "above" not in sides:
        beyond |= rise > 0.0
    if "below" not in sides:
        beyond |= rise < 0.0
    return np.stack([own.any(axis=1) for own in np.split(beyond, edges_of(fit), axis=1)], axis=1)


def _change(fit: ProductFit, state: Solution, felt: _Felt) -> Array:
    """What brings each reading to the mean temperature of its run, shape (R, n) [output unit]."""
    # A share that may well be 1 is taken as 1. Were it estimated for each run, it would follow the
    # noise of the readings, and take some of it out.
    share = np.where(felt.in_full, 1.0, felt_beside_noise(fit, felt.share))
    return to_the_mean(fit, state, fit.readings.at(share, state.parameters))


def _sentences(
    record: int,
    told: Sequence[Sequence[bool]],
    felt: _Felt,
    temperatures: RecordedTemperatures,
    run_labels: Callable[[int], Sequence[str]],
) -> Iterator[str]:
    """Say of one record what was done, and what its recorded temperatures leave in doubt."""
    follow, partly, ignored, untold = ([i for i, yes in enumerate(own) if yes] for own in told)
    labels = run_labels(record)
    if follow:
        away = felt.away[record, follow].max()
        yield (
            f"{_runs(labels, follow)}: the temperature moves, by up to {away:.2g} degC from its"
            " mean, and the readings follow; they were brought to the mean temperature of the run"
            " by the slopes of the laws"
        )
    if partly:
        shares = ", ".join(f"{100.0 * felt.share[record, i]:.0f} %" for i in partly)
        yield (
            f"{_runs(labels, partly)}: of the recorded changes of the temperature {shares} were"
            " felt, so others were that nobody recorded: they make readings near 0 and 180 deg"
            " noisier than the others, which few strokes and runs do not tell: then U of k3 may"
            " be too small, those of k0 and delta are too large; mend the sensor or the chamber"
        )
    for place in ignored:
        yield from _mistyped(_runs(labels, [place]), temperatures.readings[place][record])
    if untold:
        yield (
            f"{_runs(labels, untold)}: the recorded temperatures span up to"
            f" {felt.span[record, untold].max():.2g} degC, and no laws in this mounting tell what"
            " that does to the readings, which are taken as they are"
        )


def _mistyped(run: str, temperature: Array) -> Iterator[str]:
    """Say which temperatures are far from the others of their run, and were surely not felt."""
    away = np.abs(temperature - np.median(temperature))
    odd = away > max(_MUCH, _ALONE * float(np.median(away)))
    if odd.any():
        yield (
            f"{run}: {counted(int(odd.sum()), 'temperature')} of {temperature.size} far from the"
            f" others, such as {temperature[away.argmax()]:g} degC, and the readings do not follow:"
            " the mean, which counts for the run, is in doubt; mend what is mistyped"
        )


def _runs(labels: Sequence[str], places: Sequence[int]) -> str:
    return named("run", [labels[i] for i in places])
