"""What explains the readings as well as a named effect, and no test of the catalogue finds.

A bias that goes with the root of the time, or its square, looks like a drift or a warm-up, another
k2 of one run like one that goes with the temperature, a voltmeter whose ranges differ, or another
power of the acceleration, like a term of the shape.

And what an effect of the catalogue looks like that goes on for longer than the readings: a drift
is the beginning of a warm-up. Beside a drift, K0 is the bias at the first reading; beside the
warm-up what it comes to in the end, which no reading tells. And a drift beside a warm-up, which
makes it look shorter or longer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import compress, product
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import coefficient_columns, moves, orthonormal, squares_in
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.explanation import explain_as_well, is_needed
from accelcal.discovery.instance import Instance, replaced
from accelcal.discovery.large_effects import silent_in
from accelcal.discovery.solution import unlike
from accelcal.discovery.untold import fitted_sizes, scales
from accelcal.effects.effect import Effect
from accelcal.model import symbol_of
from accelcal.numerics.grouping import distinct
from accelcal.plural import listed
from accelcal.units import MICRO

_LAWS: Mapping[str, Callable[[Array], Array]] = {
    "root": np.sqrt,
    "square": np.square,
    "logarithm": lambda part: np.log1p(_EARLY * part),
}
"""Laws by which something slow goes with the part of the time that has passed."""

_POWERS: Mapping[str, Sequence[tuple[int, str]]] = {
    "a_i": ((3, "even"), (4, "odd"), (5, "even"), (5, "odd"), (6, "even")),
    "a_p": ((1, "even"), (2, "odd"), (3, "even"), (4, "odd"), (5, "even"), (5, "odd")),
}
"""Powers that are no mixture of those of the model and of the catalogue."""

_SATURATIONS = (0.2, 0.3, 0.4)
"""Accelerations from which on an output may saturate [g]; later it does as a fifth power."""

_BETTER = 1.0 + 1e-9
"""Times as many squares that one pattern takes up as another, which are no rounding."""

_BETWEEN = "measure at positions between these"

_OTHER_SCALES = (1.5, 1.0 / 1.5)
"""Time constants over that of a named effect, beside which a drift is looked for."""

_EARLY = 30.0
"""Time that has passed over that after which a logarithm begins."""


class NotListed(NamedTuple):
    """A pattern: what it is, what would tell, and the change of the readings, shape (n,)."""

    what: str
    remedy: str
    column: Array


def not_listed(
    comparison: Comparison, instances: Sequence[Instance]
) -> Iterator[tuple[str, NotListed]]:
    """Find what explains the readings best in place of each effect that is not due beside it.

    And another power of the acceleration that explains them better. Few positions hardly tell it
    from one of the catalogue, which would hardly ever be sure beside all that explain them as well.
    Yields the id of the effect and the pattern.
    """
    kinds = (_of_time, _of_one_run, _of_ranges)
    as_well = _shown(comparison, [pattern for kind in kinds for pattern in kind(comparison)])
    powers = _shown(comparison, list(_of_powers(comparison)))
    named = squares_in(comparison.span(instances), comparison.seen)
    for place, item in enumerate(instances):
        others = comparison.span(replaced(instances, place))
        pattern, beside, _ = _best(comparison, others, as_well)
        if not is_needed(comparison, item, beside):
            yield item.effect.id, pattern
        elif powers:
            pattern, _, squares = _best(comparison, others, powers)
            if squares > _BETTER * named:
                yield item.effect.id, pattern


def _shown(comparison: Comparison, patterns: Sequence[NotListed]) -> list[tuple[NotListed, Array]]:
    """Those of some patterns that show, with their columns in the space."""
    columns = np.stack([one.column for one in patterns], axis=1)
    seen, shown = comparison.space.shown(columns)
    return list(compress(zip(patterns, seen.T, strict=True), shown))


def _best(
    comparison: Comparison, others: Array, patterns: Sequence[tuple[NotListed, Array]]
) -> tuple[NotListed, Array, float]:
    """The pattern that takes up most beside others, the basis of both and what they take up."""
    found = []
    for pattern, column in patterns:
        basis = orthonormal(np.hstack([others, column[:, None]]))
        found.append((pattern, basis, squares_in(basis, comparison.seen)))
    return max(found, key=lambda one: one[-1])


def _of_time(comparison: Comparison) -> Iterator[NotListed]:
    """A coefficient that goes with the time of the record, or of each run, by some law."""
    c = comparison.model.conditions
    times = {"the record": c.time, "each run": c.run_time}
    if np.ptp(c.run) == 0:
        del times["each run"]
    for what, acts in coefficient_columns(c).items():
        for where, time in times.items():
            part = time / (time.max() or 1.0)
            for name, law in _LAWS.items():
                said = f"a {what} that goes with the {name} of the time in {where}"
                yield NotListed(said, "a longer record tells", c.gain * acts * law(part))


def _of_one_run(comparison: Comparison) -> Iterator[NotListed]:
    """A k2, k3 or slope with the temperature that is another in one of several runs."""
    c, labels = comparison.model.conditions, comparison.record.run_labels
    remedy = "repeat that run at its temperature"
    runs = distinct(c.run).tolist()
    for run in runs if len(runs) > 1 else ():
        own = c.run == run
        others = {f"k{power}": c.input**power for power in (2, 3)}
        away = c.excess - c.excess[own].mean()
        if moves(np.where(own, away, 0.0), c):
            others["slope of the bias with the temperature"] = away
            others["slope of the scale factor with the temperature"] = away * c.input
        for what, column in others.items():
            said = f"another {what} of run {labels[run]} alone"
            yield NotListed(said, remedy, np.where(own, c.gain * column, 0.0))


def _of_ranges(comparison: Comparison) -> Iterator[NotListed]:
    """A voltmeter whose upper range, from between two positions on, has another zero or slope.

    There is none beside silent readings, which a dead zone alone makes.
    """
    c = comparison.model.conditions
    if silent_in(c).any():
        return
    size, sign = np.abs(c.input), np.sign(c.input)
    levels = distinct(size.round(6))
    for first, limit in enumerate((0.5 * (levels[1:] + levels[:-1])).tolist()):
        beyond = np.maximum(size - limit, 0.0)
        one, *others = (np.sign(beyond) * side for side in (1.0, sign, sign > 0.0, sign < 0.0))
        zeros = [one, *others] if first else [one, *others[1:]]  # else it is a dead zone
        slopes = [size * jump for jump in others] if first else []  # else it is an asymmetry
        slopes += [beyond * jump for jump in others]
        fold = "whose output bends the same way on both sides"
        told = (("with another zero", zeros), ("with another slope", slopes), (fold, [beyond]))
        for what, columns in told:
            said = f"a voltmeter {what} beyond {limit:.2g} g"
            for column in columns:
                yield NotListed(said, _BETWEEN, c.gain * column)


def _of_powers(comparison: Comparison) -> Iterator[NotListed]:
    """A power of an acceleration that neither the model nor the catalogue has, or a saturation."""
    c = comparison.model.conditions
    for name, along in (("a_i", c.input), ("a_p", c.cross)):
        size, odd = np.abs(along), np.sign(along)
        for power, sign in _POWERS[name]:
            term = f"|{name}|^{power}" + (f" sign {name}" if sign == "odd" else "")
            column = size**power * (odd if sign == "odd" else 1.0)
            yield NotListed(f"a term {term}", _BETWEEN, c.gain * column)
    for limit in _SATURATIONS:
        what = f"an output that saturates, as tanh(a_i / {limit:g} g),"
        yield NotListed(what, _BETWEEN, c.gain * np.tanh(c.input / limit))


def said_of_ends(
    comparison: Comparison, instances: Sequence[Instance], entries: Sequence[Effect]
) -> Iterator[str]:
    """Say which of some effects explain the readings in place of one, however long they go on.

    And where a drift does so beside one.
    """
    named = {item.effect.id for item in instances}
    unnamed = [entry for entry in entries if entry.id not in named]
    for place, item in enumerate(instances):
        for long, end in _at_the_end(comparison, unnamed):
            others = replaced(instances, place, long)
            if not explain_as_well(comparison, others, item):
                continue
            if hanging := unlike(comparison, instances, others):
                yield (
                    f"{long.effect.id} with {end} or any longer explains these readings as well as"
                    f" {item.effect.id}, with other values of {listed(map(symbol_of, hanging))};"
                    " nothing tells how long it lasts, and no U counts it; to tell:"
                    f" {long.effect.to_tell_apart}"
                )
    yield from _of_drifts(comparison, instances, entries)


def _of_drifts(
    comparison: Comparison, instances: Sequence[Instance], entries: Sequence[Effect]
) -> Iterator[str]:
    """Say beside which effects with a time constant, of another length then, a drift would hide."""
    named = {item.effect.id for item in instances}
    drift = [Instance(e, (1.0,), {}) for e in entries if e.id == "bias-drift" and e.id not in named]
    for place, item in enumerate(instances if drift else ()):
        for p, times in product(scales(item.effect), _OTHER_SCALES):
            other = item.at(p.name, times * item.shape[p.name])
            alone = replaced(instances, place, other)
            others = (*alone, *drift)
            if not explain_as_well(comparison, others, item):
                continue
            counted = explain_as_well(comparison, alone, item)  # U counts other time constants
            if hanging := unlike(comparison, alone if counted else instances, others):
                rate = fitted_sizes(comparison, others).of_each[-1][0] * MICRO
                yield (
                    f"bias-drift of {rate:.2g} ug/h may hide beside {item.effect.id}, with other"
                    f" values of {listed(map(symbol_of, hanging))}; no U counts it: measure longer"
                    " runs, or the first level once more at the end"
                )
                break


def _at_the_end(
    comparison: Comparison, entries: Sequence[Effect]
) -> Iterator[tuple[Instance, str]]:
    """Effects with a time constant, at the end of the search."""
    for effect in entries:
        for parameter in scales(effect):
            end = float(parameter.searched_at(comparison.model.conditions)[-1])
            told = f"{parameter.name} of {end:.4g} {parameter.unit}"
            yield Instance(effect, (1.0,), {parameter.name: end}), told
