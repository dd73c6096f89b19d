"""A unit through its recalibrations: drift per year, scatter beyond what is stated, jumps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import compress
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from accelcal.arguments.numbers import check_number, check_number_or_none
from accelcal.arguments.options import check_text
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.numerics.probability import LEVEL, NORMAL_FACTOR
from accelcal.plural import listed
from accelcal.recalibrations.comparable import (
    BIAS_PER_DEGREE,
    SCALE_FACTOR_PER_DEGREE,
    Comparable,
    comparable,
)
from accelcal.recalibrations.entries import Entry, Frames, day, entries_of
from accelcal.recalibrations.jumps import (
    FEWEST,
    SMALLEST_CHANCE,
    Search,
    bend_of,
    jumps_like_bends,
    line_with_steps,
    search_jumps,
)
from accelcal.recalibrations.regression import (
    Fit,
    chance_of_neighbours,
    farthest,
    fit_line,
    line_of_a_walk,
)
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.unit_history import History, Jump, Point, Trend
from accelcal.shown_units import three_digits
from accelcal.version import SOFTWARE

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["history"]

QUANTITIES = 2
"""Bias and scale factor: a chance of either is twice that of one."""

_FAULTS = frozenset({"order of positions", "proportions", "units", "agreement of tables"})
"""Gates that no good record makes warn: what warns is a fault of the readings."""

_OF_THE_UNIT = frozenset({"proportions"})
"""The ones that warn of the unit itself where they warn of all: it has a large offset, say."""

_ALIKE = 0.02
"""Chance of neighbours as much alike by independent scatter, below which a note says it."""


def history(
    calibrations: Frames | pd.DataFrame | Iterable[Calibration | Entry],
    serial: str | None = None,
    *,
    mounting: str | None = None,
    temperature: float | None = None,
    alpha: float = 0.01,
) -> History:
    """Follow a unit through its recalibrations.

    Parameters
    ----------
    calibrations : BatchFrames, DataFrame or iterable of Calibration or Entry
        What `accelcal.batch` returns or its frame of tables, what `accelcal.fit` returns, or what
        `accelcal.recalibrations.entries.entries_of` takes from these.
    serial : str, optional
        Serial number; not needed where there is one unit.
    mounting : str, optional
        One of `accelcal.geometry.MOUNTINGS`; that of most tables without it.
    temperature : float, optional
        Level at which calibrations are compared [degC]; the one that most dates have without it.
    alpha : float, default 0.01
        Chance of a false alarm, over all that is searched, below which a jump is believed.

    Returns
    -------
    History
        Drift of bias and scale factor with 95 % intervals, their scatter, and their jumps.

    Raises
    ------
    InputError
        If there is no such unit, mounting or level, less than three dates, or alpha is no chance.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import accelcal
    >>> records = [
    ...     replace(accelcal.simulate(seed=n), date=f"20{10 + n}-06-01") for n in range(6)
    ... ]
    >>> found = accelcal.history(map(accelcal.fit, records))
    >>> found
    <History serial AL-15: 6 calibrations, 0 jumps>
    """
    check_options(serial, mounting, temperature, alpha)
    return judged_history(entries_of(calibrations), serial, mounting, temperature, alpha).history


def check_options(
    serial: str | None, mounting: str | None, temperature: float | None, alpha: float
) -> None:
    """Demand options of `history` that keep their rules."""
    check_number(alpha=alpha)
    check_text(serial=serial, mounting=mounting)
    check_number_or_none(temperature=temperature)
    if not SMALLEST_CHANCE <= alpha < 1.0:
        raise InputError(
            f"alpha is {alpha:g}; it is a chance from {SMALLEST_CHANCE:g} to 1, such as 0.01"
        )


class Judged(NamedTuple):
    """A history, and those of its notes that tell what was found in values and readings."""

    history: History
    remarks: tuple[str, ...]


def judged_history(
    entries: Sequence[Entry],
    serial: str | None,
    mounting: str | None,
    temperature: float | None,
    alpha: float,
) -> Judged:
    """Follow a unit, with options that are checked; raises an InputError as `history` does."""
    chosen = comparable(entries, serial, mounting, temperature)
    followed = (_bias(chosen), _scale_factor(chosen))
    trends, told = zip(*(_trend(each, chosen, alpha) for each in followed), strict=True)
    remarks, warned = (*told[0], *told[1], *_redated(chosen)), _warned(chosen)
    count, few = len(chosen.entries), "calibrations are too few to look for jumps and bends"
    history = History(
        serial=chosen.entries[0].serial,
        mounting=chosen.entries[0].mounting,
        temperature_degC=chosen.temperature,
        trends=trends,
        alpha=alpha,
        notes=(
            *chosen.notes,
            *remarks,
            *[f"{count} {few}, which needs {FEWEST}"] * (count < FEWEST),
            *warned,
        ),
        software=SOFTWARE,
    )
    return Judged(history, (*remarks, *warned) if _is_faulty(chosen) else remarks)


def _redated(chosen: Comparable) -> Iterator[str]:
    """Ask for calibrations whose values are the same in all digits, which noise does not leave."""
    alike: dict[tuple[str, ...], list[str]] = {}
    for entry in chosen.entries:
        values = (*entry.bias[:2], *entry.scale_factor[:2])
        alike.setdefault(tuple(f"{value:.10g}" for value in values), []).append(day(entry.date))
    for days in alike.values():
        if len(days) > 1:
            yield (
                f"the calibrations of {listed(days)} have the same values in all digits: one test"
                " under several dates? compare their files, and leave out the copies"
            )


def _warned(chosen: Comparable) -> tuple[str, ...]:
    found = [f"{day(e.date)} ({', '.join(e.warned)})" for e in chosen.entries if e.warned]
    return (f"checks of a calibration warn: {listed(found)}",) if found else ()


def _is_faulty(chosen: Comparable) -> bool:
    """Whether gates warn of faults of the readings, and not of what is so in all calibrations."""
    faults = [_FAULTS.intersection(entry.warned) for entry in chosen.entries]
    return bool(frozenset.union(*faults) - (_OF_THE_UNIT & frozenset.intersection(*faults)))


class _Followed(NamedTuple):
    """A quantity in n calibrations.

    `measured`, shape (n, 3), has its values with their standard and expanded uncertainties in the
    columns; the values count from `reference`, and NaN stands where no interval is stated. A usual
    temperature slope is `per_degree`.
    """

    name: str
    symbol: str
    unit: str
    measured: Array
    reference: float
    reference_unit: str
    per_degree: float

    def by_heat(self, columns: Array, rise: Array) -> Array:
        """What temperatures that nobody corrects do to the coefficients of a line, by this slope.

        All calibrations have the same slope, so that it does not average out.
        """
        return np.asarray(np.linalg.lstsq(columns, self.per_degree * rise, rcond=None)[0])

    def last_beyond_heat(self, columns: Array, rise: Array) -> tuple[float, bool]:
        """Last coefficient of a line, and whether it is more than what temperatures may make."""
        size = float(np.linalg.lstsq(columns, self.measured[:, 0], rcond=None)[0][-1])
        return size, abs(size) > NORMAL_FACTOR * abs(float(self.by_heat(columns, rise)[-1]))

    def searched(self, time: Array, rise: Array, alpha: float) -> tuple[Search, tuple[int, ...]]:
        """Jumps that no temperature makes, and the places of those that one may make."""
        values, uncertainty, _ = self.measured.T
        search = search_jumps(time, values, uncertainty, alpha)
        columns = line_with_steps(time, search.places)
        sizes = np.linalg.lstsq(columns, values, rcond=None)[0][2:]
        beyond = np.abs(sizes) > NORMAL_FACTOR * np.abs(self.by_heat(columns, rise)[2:])
        named = search._replace(
            places=tuple(compress(search.places, beyond)),
            p_values=tuple(compress(search.p_values, beyond)),
            rest=search.rest if beyond.all() else None,  # the largest is one that is not named
        )
        return named, tuple(compress(search.places, ~beyond))


def _bias(chosen: Comparable) -> _Followed:
    measured = np.array([entry.bias for entry in chosen.entries], dtype=float)
    return _Followed("bias", "k0", "g", measured, 0.0, "g", BIAS_PER_DEGREE)


def _scale_factor(chosen: Comparable) -> _Followed:
    """The scale factor, relative to its weighted mean."""
    measured = np.array([entry.scale_factor for entry in chosen.entries], dtype=float)
    reference = float(np.average(measured[:, 0], weights=measured[:, 1] ** -2.0))
    relative = measured / abs(reference)
    relative[:, 0] = measured[:, 0] / reference - 1.0
    unit = f"{chosen.entries[0].unit}/g"
    return _Followed("scale factor", "K1", "1", relative, reference, unit, SCALE_FACTOR_PER_DEGREE)


def _trend(followed: _Followed, chosen: Comparable, alpha: float) -> tuple[Trend, tuple[str, ...]]:
    """Follow one quantity: its line, its scatter, and its jumps, and say which are not named."""
    values, uncertainty, told = followed.measured.T
    expanded = np.where(np.isnan(told), NORMAL_FACTOR * uncertainty, told)
    time, unit = np.array(chosen.years), followed.unit
    search, heated = followed.searched(time, chosen.rise, alpha / QUANTITIES)
    columns = line_with_steps(time, search.places)
    heat = np.abs(followed.by_heat(columns, chosen.rise))
    fit = replace(fit_line(columns, values, uncertainty), shared=heat)
    line = columns @ fit.coefficients
    points = tuple(
        Point(day(entry.date), entry.source, Quantity(v, u, unit, wide), middle)
        for entry, v, u, wide, middle in zip(
            chosen.entries,
            *(part.tolist() for part in (values, uncertainty, expanded, line)),
            strict=True,
        )
    )
    sigma = np.hypot(uncertainty, fit.scatter)
    of_a_walk = _of_a_walk(fit, time, values, sigma**2)
    trend = Trend(
        name=followed.name,
        symbol=followed.symbol,
        drift=_told(fit, 1, f"{unit}/year"),
        drift_of_a_walk=_told(of_a_walk, 1, f"{unit}/year"),
        scatter=fit.scatter,
        scatter_limits=fit.scatter_limits,
        jumps=_jumps(search, fit, chosen, unit),
        no_other_jump=None if search.rest is None else min(1.0, QUANTITIES * search.rest),
        points=points,
        reference=followed.reference,
        reference_unit=followed.reference_unit,
    )
    walks = _wandering(followed.name, chance_of_neighbours(columns, values, sigma))
    apart = _apart(followed, chosen, columns, alpha / QUANTITIES)
    bent = _bent(followed, chosen, search.places, alpha / QUANTITIES)
    return trend, (*_heated(followed.name, chosen, heated), *bent, *apart, *walks)


def _of_a_walk(fit: Fit, time: Array, values: Array, variance: Array) -> Fit:
    """The line if the values walk, of which jumps are then a part; no surer than without a walk."""
    columns = line_with_steps(time, ())
    line, uncertainty = line_of_a_walk(time, columns, values, variance)
    return replace(
        fit,
        coefficients=line,
        uncertainties=np.maximum(uncertainty, fit.uncertainties[: line.size]),
        shared=fit.shared[: line.size],
    )


def _wandering(name: str, chance: float) -> Iterator[str]:
    """Say that what scatters is not new at each calibration, where neighbours show it."""
    if chance < _ALIKE:
        yield (
            f"the {name} wanders: neighbouring calibrations are more alike than independent scatter"
            f" leaves them (chance {chance:.1g}); drift and jumps are less certain than U says"
        )


def _apart(followed: _Followed, chosen: Comparable, columns: Array, alpha: float) -> Iterator[str]:
    """Tell of a calibration that stands apart from all others, if no temperature makes it so."""
    values, uncertainty, _ = followed.measured.T
    place, chance = farthest(columns, values, uncertainty)
    alone = np.column_stack([columns, np.arange(values.size) == place])
    size, beyond = followed.last_beyond_heat(alone, chosen.rise)
    if chance < alpha and beyond:
        told = f"{three_digits(1e6 * size)} {'ug' if followed.unit == 'g' else 'ppm'}"
        after = ", or a jump that no second one confirms; calibrate again"
        yield (
            f"the {followed.name} of {day(chosen.entries[place].date)} is {told} from what all"
            f" others say (chance {QUANTITIES * chance:.1g}): a bad calibration"
            + after * (place == values.size - 1)
            + ", or a jump after it" * (place == 0)
        )


def _bent(
    followed: _Followed, chosen: Comparable, places: tuple[int, ...], alpha: float
) -> Iterator[str]:
    """Say where a line bends, as of a unit that ages or settles, or which jumps may be a bend."""
    values, uncertainty, _ = followed.measured.T
    bends = jumps_like_bends(np.array(chosen.years), values, uncertainty, places)
    if not bends:
        yield from _changing(followed, chosen, places, alpha)
    for place in bends:
        after, before = (day(chosen.entries[i].date) for i in (place - 1, place))
        yield (
            f"a line that bends, as of a unit that settles, fits the {followed.name} better than"
            f" its jump between {after} and {before}: the drift is then not the same in all years"
        )


def _changing(
    followed: _Followed, chosen: Comparable, places: tuple[int, ...], alpha: float
) -> Iterator[str]:
    """Say that the drift changes, from the first date or a jump on, if no temperature makes it."""
    values, uncertainty, _ = followed.measured.T
    bend = bend_of(np.array(chosen.years), values, uncertainty, places)
    if bend and bend.chance < alpha and followed.last_beyond_heat(bend.columns, chosen.rise)[1]:
        jump = f" after its jump before {day(chosen.entries[bend.start].date)}" * (bend.start > 0)
        yield (
            f"the drift of the {followed.name} {'slows' if bend.slows else 'grows'}{jump} (chance"
            f" {QUANTITIES * bend.chance:.1g}): its figure per year is that of all these years"
            " together, and does not hold for those to come"
        )


def _heated(name: str, chosen: Comparable, places: tuple[int, ...]) -> Iterator[str]:
    """Say which jumps are not named, as temperatures differ there too."""
    for place in places:
        after, before = (day(chosen.entries[i].date) for i in (place - 1, place))
        yield (
            f"a jump of the {name} between {after} and {before} is not named: the temperatures"
            " differ there, which may make it; calibrate at one temperature"
        )


def _jumps(search: Search, fit: Fit, chosen: Comparable, unit: str) -> tuple[Jump, ...]:
    found = [
        Jump(
            after=day(chosen.entries[place - 1].date),
            before=day(chosen.entries[place].date),
            size=_told(fit, 2 + number, unit, searched=search.gaps),
            p_value=min(1.0, QUANTITIES * chance),
        )
        for number, (place, chance) in enumerate(zip(search.places, search.p_values, strict=True))
    ]
    return tuple(sorted(found, key=lambda jump: jump.after))


def _told(fit: Fit, place: int, unit: str, searched: int = 1) -> Quantity:
    """A coefficient of the fit with its 95 % interval, of as many as were searched for it.

    The largest of several jumps is rather too large, and its scatter too small: its interval is
    that of a level that those of all gaps hold at once (Bonferroni).
    """
    standard, expanded = fit.interval(place, 1.0 - (1.0 - LEVEL) / searched)
    value = float(fit.coefficients[place])
    return Quantity(value, standard, unit, expanded, float(fit.dof))
