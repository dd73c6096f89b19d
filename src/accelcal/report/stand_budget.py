"""The budget of a stand as text for an engineer."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from accelcal.plural import counted
from accelcal.report.lines import aligned, hanging, sections
from accelcal.report.numbers import significant
from accelcal.results.stand_budget import (
    BudgetedCoefficient,
    MonteCarlo,
    StandBudget,
    StandShare,
    acts,
)
from accelcal.results.stand_requirements import Requirements, Sufficiency, TargetReached
from accelcal.shown_units import in_small_unit
from accelcal.units import MICRO

_NAMED = 3  # components of a coefficient that are named; beside Monte Carlo one less
_MANY = 9999.0  # degrees of freedom that are shown as infinite
_WHOLE = 0.01  # an error is wholly taken up where its residuals are less than this part of it
_IN_PART = 0.1  # changes smaller than this share of the largest one [g] are not named
_RELATIVE = ("K1", "K1 per m/s^2")
_OF_ONE_TABLE = ("k0", "K1", "k2", "k3", "delta", "delta_ip")


def text(budget: StandBudget) -> str:
    """Tell the uncertainty of the coefficients, what the components do, and requirements."""
    parts = [_heading(budget), _coefficients(budget), _components(budget)]
    if budget.requirements is not None:
        parts += [_targets(budget, budget.requirements), _instruments(budget.requirements)]
    if budget.data_sheet:
        parts.append(_data_sheet(budget.data_sheet))
    return sections(*parts)


def _heading(budget: StandBudget) -> Iterator[str]:
    yield f"Budget of the stand: {budget.stand}"
    yield from hanging(f"from {budget.source}")
    yield from hanging(f"Test: {budget.test}")
    for note in budget.warnings:
        yield from hanging(f"note: {note}")


def shown_unit(budget: StandBudget, place: int) -> tuple[float, str]:
    """Tell factor and unit of an uncertainty as `in_small_unit` does; ppm for the scale factor."""
    coefficient = budget.coefficients[place]
    if coefficient.symbol in _RELATIVE:
        return 1e6 / abs(budget.nominal[place]), "ppm"
    unit = coefficient.unit
    if unit.startswith("mA"):
        return MICRO, f"n{unit[1:]}"
    return in_small_unit(unit)


def shares(budget: StandBudget, place: int) -> list[tuple[str, float]]:
    """Name the components of one coefficient, the largest first, with their parts of its variance.

    The parts add up to 1; there are none where the uncertainty is 0.
    """
    variance = budget.standard_uncertainty[place] ** 2
    if variance == 0.0:
        return []
    found = [(part.name, part.contributions[place] ** 2 / variance) for part in budget.components]
    return sorted(found, key=lambda item: -item[1])


def _coefficients(budget: StandBudget) -> Iterator[str]:
    """Table of the coefficients of the table nearest to T0, slopes, and reversed mountings."""
    trials = budget.monte_carlo
    yield from hanging(
        "Uncertainty of each coefficient: u standard, U expanded (95 %), U without its first"
        " component, % of u^2 by component"
    )
    if trials is not None:
        stable = "" if trials.stable else ", not yet stable"
        yield from hanging(
            f"Monte Carlo (JCGM 101): {trials.trials} trials, seed {trials.seed}{stable};"
            " low and high: its 95 % interval less the value; linear: whether U agrees with it to"
            " the numerical tolerance (clause 8)"
        )
    heading = ["", "unit", "u", "U", "dof"]
    heading += ["low", "high", "linear"] if trials is not None else []
    heading.append("U less 1st")
    shown = [i for i, item in enumerate(budget.coefficients) if _is_shown(item)]
    rows = [[*heading, "from"], *(_row(budget, place) for place in shown)]
    yield from aligned(rows, right=range(2, len(heading)), indent="  ")
    left = len(budget.coefficients) - len(shown)
    if left:
        yield f"  (and {counted(left, 'coefficient')} of the other tables, in CSV and JSON)"


def _is_shown(coefficient: BudgetedCoefficient) -> bool:
    """Whether it is of the table nearest to T0, of two runs, or a change."""
    where = coefficient.where
    of_two_runs = "run" in where.partition(" and ")[2]
    return not where or of_two_runs or coefficient.symbol.endswith(" change")


def _row(budget: StandBudget, place: int) -> list[str]:
    factor, unit = shown_unit(budget, place)
    expanded, trials = budget.expanded_uncertainty[place], budget.monte_carlo
    dof = "inf" if budget.dof[place] > _MANY else f"{budget.dof[place]:.0f}"
    sizes = (budget.standard_uncertainty[place], expanded)
    u, U = (significant(factor * size, 3) for size in sizes)
    named = _NAMED - (trials is not None)
    largest = [item for item in shares(budget, place)[:named] if item[1] >= 0.005]
    told = ", ".join(f"{name} {100 * share:.0f}" for name, share in largest)
    rest = max(1.0 - sum(share for _, share in largest[:1]), 0)
    without = significant(factor * expanded * math.sqrt(rest), 3)
    found = [] if trials is None else _trials(trials, place, budget.nominal[place], factor)
    return [budget.coefficients[place].symbol, unit, u, U, dof, *found, without, told]


def _trials(trials: MonteCarlo, place: int, value: float, factor: float) -> list[str]:
    ends = [factor * (end[place] - value) for end in (trials.lower, trials.upper)]
    shown = [f"{'-' if end < 0 else '+'}{significant(abs(end), 3)}" for end in ends]
    return [*shown, "yes" if trials.agrees[place] else "NO"]


def _components(budget: StandBudget) -> Iterator[str]:
    yield from hanging(
        "What each component does: its standard uncertainty, its independent errors, the part of"
        " its effect that the residuals show, and what goes into the coefficients of the first"
        " table by one u (k0, k2, k3, delta_ip in ug, delta in urad, K1 in ppm)"
    )
    rows: list[Sequence[str]] = [("", "u", "", "errors", "seen", "goes into")]
    rows += [_component(budget, part) for part in budget.components]
    yield from aligned(rows, right=(1, 3, 4), indent="  ")
    silent = [part.name for part in budget.components if not acts(budget, part)]
    if silent:
        yield from hanging(f"Below 0.1 % of every u here: {', '.join(silent)}.")
    hidden = [part.name for part in budget.components if acts(budget, part) and _hidden(part)]
    if hidden:
        yield from hanging(
            f"Systematic and unseen: {', '.join(hidden)}. No residual shows them and no stroke"
            " averages them: each is a bias of the coefficients behind it."
        )


def _hidden(part: StandShare) -> bool:
    return not part.averages and not part.residual >= _WHOLE  # also where it is NaN


def _of_instrument(unit: str) -> tuple[float, str]:
    """Factor and unit in which the error of an instrument is told; a voltmeter's in uV."""
    return (MICRO, "uV") if unit == "V" else in_small_unit(unit)


def _component(budget: StandBudget, part: StandShare) -> tuple[str, ...]:
    factor, unit = _of_instrument(part.unit)
    return (
        f"{part.name}{' (fixed)' if part.fixed else ''}",
        significant(factor * part.standard_uncertainty, 3),
        unit,
        str(part.errors),
        "" if math.isnan(part.residual) else f"{100 * part.residual:.0f} %",
        _absorbed(budget, part) if acts(budget, part) else "nothing here",
    )


def _absorbed(budget: StandBudget, part: StandShare) -> str:
    """Coefficients that a component changes most, each with its change."""
    found = []
    for i, (own, change) in enumerate(zip(budget.coefficients, part.contributions, strict=True)):
        if not own.where and own.symbol in _OF_ONE_TABLE:
            found.append((shown_unit(budget, i)[0] * change, own.symbol))
    largest = max((abs(size) for size, _ in found), default=0.0)
    if largest < _NOTHING:
        return _elsewhere(budget, part)
    named = [item for item in found if abs(item[0]) >= _IN_PART * largest]
    sign = "+" if part.errors == 1 and not part.kind.endswith(_OF_A_PHASE) else ""
    return ", ".join(f"{name} {size:{sign}.2g}" for size, name in named)


_OF_A_PHASE = ("harmonic", "daily")
_NOTHING = 1e-6  # ug: below it a change is rounding error


def _elsewhere(budget: StandBudget, part: StandShare) -> str:
    """Where a component acts, when it does on no coefficient of the table nearest to T0."""
    changes = np.abs(part.contributions)
    ratios = {
        i: changes[i] / u
        for i, u in enumerate(budget.standard_uncertainty)
        if u > 0.0 and not budget.coefficients[i].where
    }
    named = []
    for i in (i for i, ratio in ratios.items() if ratio > 0.5 * max(ratios.values())):
        factor, unit = shown_unit(budget, i)
        named.append(f"{budget.coefficients[i].symbol} {factor * changes[i]:.2g} {unit}")
    return ", ".join(named)


def _targets(budget: StandBudget, requirements: Requirements) -> Iterator[str]:
    yield "Targets of U (95 %), and the floor that perfect instruments leave"
    rows: list[Sequence[str]] = [("", "unit", "target", "now", "floor", "")]
    for target in requirements.targets:
        factor, unit = shown_unit(budget, budget.index(target.symbol) or 0)
        own = (target.target, target.present, target.floor)
        sizes = (significant(factor * size, 3) for size in own)
        rows.append((target.symbol, unit, *sizes, _reached(target)))
    yield from aligned(rows, right=(2, 3, 4), indent="  ")


def _reached(target: TargetReached) -> str:
    if target.reached:
        return "reached"
    if target.reachable:
        return "to be reached with better instruments"
    return f"out of reach: held up by {', '.join(target.held_up_by) or 'the fixed components'}"


def _instruments(requirements: Requirements) -> Iterator[str]:
    yield "What each instrument must be, as a standard uncertainty (fixed components stay)"
    heading = ("", "", "now", "alone", "equal shares", "all alike", "alone is limited by")
    rows: list[Sequence[str]] = [heading]
    for item in requirements.instruments:
        factor, unit = _of_instrument(item.unit)
        own = (item.present, item.alone, item.equal_shares, item.proportional)
        now, alone, *shared = (_size(size, factor) for size in own)
        told = (now, alone or "> 100 x", *(size or "as now" for size in shared))
        rows.append((item.name, unit, *told, item.limited_by))
    yield from aligned(rows, right=range(2, 6), indent="  ")
    yield from hanging(
        "alone: largest with all others as they are, 0 where not even a perfect one would do;"
        " equal shares and all alike: two allocations that keep all targets within reach. A half"
        " width goes with its standard uncertainty."
    )


def _size(value: float | None, factor: float) -> str:
    if value is None:
        return ""
    return "0" if value == 0.0 else significant(factor * value, 3)


def _data_sheet(limits: Sequence[Sufficiency]) -> Iterator[str]:
    yield "Limits of the data sheet against U of this test; suffices: 4 to 1 or better"
    rows: list[Sequence[str]] = [("", "of", "unit", "limit", "U", "ratio", "")]
    for limit in limits:
        U, ratio = limit.expanded_uncertainty, limit.ratio
        told_U = "" if U is None else significant(U, 3)
        told_ratio = "" if ratio is None else significant(ratio, 2)
        numbers = (f"{limit.limit:g}", told_U, told_ratio)
        rows.append((limit.name, limit.symbol, limit.unit, *numbers, limit.verdict))
    yield from aligned(rows, right=(3, 4, 5), indent="  ")
    for note in dict.fromkeys(limit.note for limit in limits if limit.note):
        named = ", ".join(limit.name for limit in limits if limit.note == note)
        yield from hanging(f"  {named}: {note}")
