"""The inverse question: what must each instrument be for given target uncertainties.

And whether the stand suffices for a data sheet: each limit against the uncertainty of its quantity.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from types import MappingProxyType

import numpy as np

from accelcal.arguments.kinds import as_given
from accelcal.arguments.options import mapping_of
from accelcal.arrays import Array, Mask
from accelcal.errors import InputError
from accelcal.estimate.uncertainty import welch_satterthwaite
from accelcal.numerics.probability import LEVEL, NORMAL_FACTOR, student_quantile
from accelcal.results.stand_budget import StandBudget
from accelcal.results.stand_requirements import (
    InstrumentRequirement,
    Requirements,
    Sufficiency,
    TargetReached,
)
from accelcal.specification import PLACES, QUANTITIES, Limit, Specification
from accelcal.targets import target_size

_FARTHEST = 100.0
"""Times the present size to which a linear budget is extrapolated."""
_COUNTS = 0.01
"""Share of a standard uncertainty from which on a component has a part in an allocation."""


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """Targets [unit of the coefficient] and contributions of all components to their coefficients.

    `contributions` has shape (m, t), `targets` (t,), `adjustable` (m,).
    """

    contributions: Array
    dof: Array
    adjustable: Mask
    targets: Array

    def expanded(self, factors: Array) -> Array:
        """Expanded uncertainties with the components changed by factors, shape (t,)."""
        own = self.contributions * factors[:, None]
        dof = welch_satterthwaite(own**2, self.dof)
        k = np.array([student_quantile(LEVEL, float(value)) for value in dof])
        return np.asarray(k * np.linalg.norm(own, axis=0))

    def largest(self, factors: Callable[[float], Array], among: Mask) -> float:
        """Largest step s at which the targets hold with the factors of s; 0 for none."""

        def holds(step: float) -> bool:
            return bool((self.expanded(factors(step)) <= self.targets)[among].all())

        if holds(_FARTHEST):
            return _FARTHEST
        low, high = 0.0, _FARTHEST
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if holds(middle) else (low, middle)
        return low if holds(low) else 0.0


def requirements(budget: StandBudget, targets: Mapping[str, float | str]) -> Requirements:
    """Tell what each instrument must be for some target uncertainties.

    Targets are the largest expanded uncertainties (95 %) by symbol: a number in the unit of the
    coefficient, or a text such as ``"10 ug"``; K1 takes ``"5 ppm"`` as well. Their floors and the
    requirements on the instruments are told.

    Raises
    ------
    InputError
        If a symbol is not budgeted, a target is not above zero or its unit is another.

    Notes
    -----
    The budget is linear in the components, so their standard uncertainties are scaled; the
    coverage factor follows.
    """
    targets = mapping_of(targets, "targets", "{'K1': '5 ppm'}")
    if not targets:
        raise InputError("no targets; give one such as K1=5ppm")
    places = [_place(budget, symbol) for symbol in targets]
    problem = _Problem(
        contributions=np.array([part.contributions[places] for part in budget.components]),
        dof=np.array([part.dof for part in budget.components]),
        adjustable=np.array([not part.fixed for part in budget.components]),
        targets=np.array([_target(budget, *item) for item in targets.items()]),
    )
    perfect = np.where(problem.adjustable, 0.0, 1.0)
    floors = problem.expanded(perfect)
    told = tuple(
        _told(budget, problem, place, t, float(floors[t])) for t, place in enumerate(places)
    )
    among = np.array([target.reachable for target in told])
    return Requirements(told, tuple(_instruments(budget, problem, tuple(targets), among)))


def _place(budget: StandBudget, symbol: str) -> int:
    place = budget.index(symbol)
    if place is None:
        known = dict.fromkeys(own.symbol for own in budget.coefficients)
        raise InputError(f"target {symbol!r} is not budgeted; there are {', '.join(known)}")
    return place


def _target(budget: StandBudget, symbol: str, given: float | str) -> float:
    place = _place(budget, symbol)
    if isinstance(given, str):
        nominal = float(budget.nominal[place]) if symbol in ("K1", "K1 per m/s^2") else None
        return target_size(symbol, given, budget.coefficients[place].unit, nominal)
    if not isinstance(given, Real) or not 0.0 < given < np.inf:
        raise InputError(f"target {symbol} is {as_given(given)}; it is a finite number above zero")
    return float(given)


def _told(
    budget: StandBudget, problem: _Problem, place: int, t: int, floor: float
) -> TargetReached:
    own, target = budget.coefficients[place], float(problem.targets[t])
    sizes = np.abs(problem.contributions[:, t])
    acting = ~problem.adjustable & (sizes > 0.1 * target)
    held = [i for i in np.argsort(-sizes) if acting[i]] if floor >= target else []
    return TargetReached(
        symbol=own.symbol,
        unit=own.unit,
        target=target,
        present=float(budget.expanded_uncertainty[place]),
        floor=floor,
        held_up_by=tuple(budget.components[i].name for i in held),
    )


def _instruments(
    budget: StandBudget, problem: _Problem, symbols: Sequence[str], among: Mask
) -> list[InstrumentRequirement]:
    felt = np.abs(problem.contributions) > _COUNTS * np.linalg.norm(problem.contributions, axis=0)
    acting = problem.adjustable & (felt & among).any(axis=1)
    equal = _scaled(problem, _equal_shares(problem, felt, among), acting, among)
    alike = _scaled(problem, np.ones(acting.size), acting, among)
    found = []
    for i, part in enumerate(budget.components):
        if part.fixed:
            continue
        size = part.standard_uncertainty
        alone, limit = _alone(problem, i, symbols)
        found.append(
            InstrumentRequirement(
                name=part.name,
                unit=part.unit,
                present=size,
                alone=None if alone == _FARTHEST else alone * size,
                equal_shares=float(equal[i]) * size if acting[i] else None,
                proportional=float(alike[i]) * size if acting[i] else None,
                limited_by=limit,
            )
        )
    return found


def _alone(problem: _Problem, i: int, symbols: Sequence[str]) -> tuple[float, str]:
    """Largest factor of one component, and the target that limits it."""

    def factors(step: float) -> Array:
        changed = np.ones(problem.adjustable.size)
        changed[i] = step
        return changed

    each = [problem.largest(factors, np.arange(len(symbols)) == t) for t, _ in enumerate(symbols)]
    worst = int(np.argmin(each))
    return each[worst], "" if each[worst] == _FARTHEST else symbols[worst]


def _equal_shares(problem: _Problem, felt: Mask, among: Mask) -> Array:
    """Factors that give each component the same share of what the fixed ones leave of a target."""
    sizes = np.abs(problem.contributions)
    fixed = (sizes[~problem.adjustable] ** 2).sum(axis=0)
    sharing = felt & problem.adjustable[:, None]
    left = np.maximum((problem.targets / NORMAL_FACTOR) ** 2 - fixed, 0.0)
    share = np.sqrt(left / np.maximum(sharing.sum(axis=0), 1))
    factors = np.divide(share, sizes, out=np.full(sizes.shape, np.inf), where=sharing)
    found = factors[:, among].min(axis=1, initial=np.inf)
    return np.asarray(np.where(np.isfinite(found), found, 1.0))


def _scaled(problem: _Problem, factors: Array, acting: Mask, among: Mask) -> Array:
    """Change the factors of all that act by one, so that the targets just hold."""
    if not acting.any():
        return factors
    step = problem.largest(lambda s: np.where(acting, s * factors, 1.0), among)
    return np.asarray(np.where(acting, step * factors, 1.0))


# -- limits of a data sheet ------------------------------------------------------------------------


_SYMBOLS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "bias_temperature_sensitivity": ("lam1", "lam2"),
        "scale_factor_temperature_sensitivity": ("beta1", "beta2"),
        "misalignment_temperature_sensitivity": ("gam1", "gam2"),
        "bias_repeatability": ("k0 change",),
        "scale_factor_stability": ("K1 change",),
    }
)
"""Limits whose quantity has other symbols in a budget."""

_CHANGES = ("k0 change", "K1 change")


def sufficiency(
    budget: StandBudget, specification: Specification, output_unit: str | None
) -> tuple[Sufficiency, ...]:
    """Hold the limits of a data sheet against the uncertainties by the stand.

    There is one for each limit on a quantity with a value; a range of temperatures has none.

    Raises
    ------
    InputError
        If a limit on the scale factor is in another output unit.

    Notes
    -----
    Limits on a change from run to run count the stand alone, without the fixed components: the
    change of the accelerometer is what is looked for.
    """
    limits = (limit for limit in specification.limits if limit.name != "operating_temperatures")
    return tuple(_sufficient(budget, limit, output_unit) for limit in limits)


def _sufficient(budget: StandBudget, limit: Limit, output_unit: str | None) -> Sufficiency:
    symbols = _SYMBOLS.get(limit.name, (QUANTITIES[limit.name].symbol,))
    everywhere = limit.at == PLACES[1]
    found = {
        symbol: _expanded(budget, i)
        for i, symbol in _places(budget, symbols, everywhere=everywhere)
    }
    symbol = max(found, key=lambda name: found[name], default="/".join(symbols))
    factor = limit.factor(output_unit)
    return Sufficiency(
        name=limit.name,
        symbol=symbol,
        unit=limit.unit,
        limit=_half_width(limit),
        expanded_uncertainty=found[symbol] / factor if found else None,
        note=_note(limit.name, told=bool(found)),
    )


def _places(
    budget: StandBudget, symbols: tuple[str, ...], *, everywhere: bool
) -> Iterator[tuple[int, str]]:
    for i, own in enumerate(budget.coefficients):
        if own.symbol in symbols and (everywhere or not own.where or own.symbol in _CHANGES):
            yield i, str(own) if own.symbol not in _CHANGES else own.symbol


def _expanded(budget: StandBudget, place: int) -> float:
    if budget.coefficients[place].symbol not in _CHANGES:
        return float(budget.expanded_uncertainty[place])
    of_stand = [part for part in budget.components if not part.fixed]
    own = np.array([part.contributions[place] for part in of_stand])
    dof = welch_satterthwaite(own**2, [part.dof for part in of_stand])
    return student_quantile(LEVEL, float(dof)) * float(np.linalg.norm(own))


def _half_width(limit: Limit) -> float:
    given = [bound for bound in (limit.minimum, limit.maximum) if bound is not None]
    return given[0] if len(given) == 1 else 0.5 * (given[1] - given[0])


def _note(name: str, *, told: bool) -> str:
    if name in ("bias_repeatability", "scale_factor_stability"):
        return "change from run to run by the stand alone" if told else "needs a level met twice"
    return "" if told else "not a coefficient of this tumble test"
