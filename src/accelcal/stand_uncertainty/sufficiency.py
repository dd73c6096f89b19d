"""Whether a stand suffices for a data sheet: each limit against the uncertainty of its quantity."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np

from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.stand_budget import StandBudget
from accelcal.results.stand_requirements import Sufficiency
from accelcal.specification import PLACES, QUANTITIES, Limit, Specification
from accelcal.stand_uncertainty.linear import effective_dof

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

    Returns
    -------
    tuple of Sufficiency
        One for each limit on a quantity with a value; a range of temperatures has none.

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
    own = [part.contributions[place : place + 1] for part in of_stand]
    if not own:
        return 0.0
    dof = effective_dof(own, [part.dof for part in of_stand])
    return student_quantile(LEVEL, float(dof[0])) * float(np.linalg.norm(own))


def _half_width(limit: Limit) -> float:
    given = [bound for bound in (limit.minimum, limit.maximum) if bound is not None]
    return given[0] if len(given) == 1 else 0.5 * (given[1] - given[0])


def _note(name: str, *, told: bool) -> str:
    if name in ("bias_repeatability", "scale_factor_stability"):
        return "change from run to run by the stand alone" if told else "needs a level met twice"
    return "" if told else "not a coefficient of this tumble test"
