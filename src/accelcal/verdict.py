"""Verdict of a calibration against a data sheet: pass, fail, undecided, or not tested.

A limit passes where the interval value +- w lies within it, fails where that interval lies outside,
and is undecided where the interval straddles it; w is the guard band of the decision rule. What a
tumble test does not tell is "not tested", and never passes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import overload

from accelcal.estimate.launch import SAME_LEVEL
from accelcal.model import ERROR_TERMS
from accelcal.probability import dof_of_student_quantile, student_survival
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration
from accelcal.results.verdict import Judgement, Verdict
from accelcal.specification import QUANTITIES, RULES, Limit, Specification, conversion_factor

__all__ = ["judge"]

_LEVEL = 0.95  # of the expanded uncertainty

_COEFFICIENTS = MappingProxyType(
    {error: name for name, error in ERROR_TERMS.items()} | {"K1": "K1"}
)
_LAWS = MappingProxyType(
    {"k0": "k0", "lam": "k0", "K1": "K1", "beta": "K1"} | {"delta": "delta", "gam": "delta"}
)
_ANOTHER_TEST = MappingProxyType(
    {  # symbol -> what tests it, and the error source of the calibration that comes near it
        "k0L": ("repeated launches, see accelcal stability", "launch"),
        "k0D": ("a record over the time of a launch, see accelcal stability", None),
        "k0F": ("a record over the time of a launch, see accelcal stability", None),
        "p": ("inputs of the size of the threshold", None),
        "k1": ("calibrations repeated over its time", "launch_sf"),
    }
)


@dataclass(frozen=True, slots=True)
class _Finding:
    """A quantity of the calibration in one place; no quantity where it was not tested."""

    symbol: str
    where: str
    quantity: Quantity | None
    remark: str = ""


def judge(calibration: Calibration, specification: Specification) -> Verdict:
    """Judge a calibration against a data sheet.

    Parameters
    ----------
    calibration : Calibration
        What was found.
    specification : Specification
        The limits and the decision rule.

    Returns
    -------
    Verdict
        A judgement for each limit and each place where it holds.

    Raises
    ------
    InputError
        If the unit of the scale factor does not fit the output of the calibration.

    Notes
    -----
    With the expanded uncertainty U (95 %) and the guard band w = r U of the rule, a value x passes
    where all of x - w .. x + w keeps the limit, fails where none of it does, and is undecided
    otherwise. Where U is unknown, a value beyond its limit fails and one within stays undecided,
    except by simple acceptance. The probability of conformity is that of JCGM 106:2012 with
    Student's distribution about x and no prior knowledge.

    Examples
    --------
    >>> import accelcal
    >>> from accelcal.specification import Limit, Specification
    >>> limit = Limit("scale_factor_temperature_sensitivity", "ppm/degC", maximum=500.0)
    >>> verdict = judge(accelcal.fit(accelcal.simulate(seed=1)), Specification("AL-15", (limit,)))
    >>> [(j.symbol, j.outcome) for j in verdict.judgements], verdict.outcome
    ([('beta1', 'fail'), ('beta2', 'pass')], 'fail')
    """
    rule = RULES[specification.rule]
    return Verdict(
        specification=specification.name,
        source=specification.source,
        rule=specification.rule,
        rule_statement=rule.statement,
        judgements=tuple(
            judgement
            for limit in specification.limits
            for judgement in _judgements(limit, calibration, rule.guard_band)
        ),
    )


def _judgements(limit: Limit, calibration: Calibration, guard_band: float) -> Iterable[Judgement]:
    if limit.name == "operating_temperatures":
        return [_operating_temperatures(limit, calibration)]
    return [
        _judgement(limit, finding, guard_band, calibration.output_unit)
        for finding in _findings(limit, calibration)
    ]


def _operating_temperatures(limit: Limit, calibration: Calibration) -> Judgement:
    """Pass where the test went to both ends; the accelerometer is tested no further than that."""
    assert limit.minimum is not None
    assert limit.maximum is not None
    levels = [t.temperature_degC for t in calibration.tables if t.temperature_degC is not None]
    if not levels:
        return _not_tested(limit, _Finding("T", "", None, "the temperatures are unknown"))
    low, high = min(levels), max(levels)
    tested = f"tested {round(low, 2):g} to {round(high, 2):g} degC"
    if low > limit.minimum + SAME_LEVEL or high < limit.maximum - SAME_LEVEL:
        return _not_tested(limit, _Finding("T", tested, None, "the test did not cover the range"))
    return Judgement(limit.name, "T", tested, "pass", limit.unit, limit.minimum, limit.maximum)


# -- what the calibration says ---------------------------------------------------------------------


def _findings(limit: Limit, calibration: Calibration) -> Iterable[_Finding]:
    symbol, per = QUANTITIES[limit.name].symbol, QUANTITIES[limit.name].per
    if symbol in _ANOTHER_TEST:
        return [_of_another_test(symbol, calibration)]
    if symbol == "h_T":
        return [_hysteresis(calibration)]
    if per == "degC":
        return [_slope(symbol, side, calibration) for side in ("above", "below")]
    if limit.at == "T0":
        return _at_reference(symbol, calibration)
    return [_in_table(symbol, table, calibration) for table in calibration.tables]


def _of_another_test(symbol: str, calibration: Calibration) -> _Finding:
    test, near = _ANOTHER_TEST[symbol]
    remark = f"a tumble test does not tell it; {test}"
    for source in calibration.error_sources:
        if source.name == near and source.source == "estimated" and source.value is not None:
            size = f"{1e6 * source.value:.2g} {'ppm' if source.unit == '1' else 'ug'}"
            remark += f" (from run to run it scattered by {size}, thermal cycles included)"
    return _Finding(symbol, "", None, remark)


def _hysteresis(calibration: Calibration) -> _Finding:
    model = calibration.temperature_model
    if model is None or model.hysteresis is None:
        return _Finding("h_T", "", None, "no level was reached both by heating and by cooling")
    return _Finding("h_T", "", model.hysteresis)


def _slope(symbol: str, side: str, calibration: Calibration) -> _Finding:
    name, where = f"{symbol}{1 if side == 'above' else 2}", f"{side} T0"
    model = calibration.temperature_model
    law = getattr(model, _LAWS[symbol]) if model is not None else None
    quantity = getattr(law, side) if law is not None else None
    missing = "" if quantity is not None else f"the test has no slope {side} T0"
    return _Finding(name, where, quantity, missing)


def _at_reference(symbol: str, calibration: Calibration) -> list[_Finding]:
    model, reference = calibration.temperature_model, calibration.T0_degC
    tables = [t for t in calibration.tables if _is_at(t, reference)]
    if model is not None and symbol in _LAWS and len({t.mounting for t in tables}) < 2:
        quantity = getattr(model, _LAWS[symbol]).at_T0
        if quantity is not None:
            return [_Finding(symbol, f"at T0 = {reference:g} degC", quantity)]
    if not tables and len(calibration.tables) == 1:
        tables = list(calibration.tables)
    if not tables:
        return [_Finding(symbol, "at T0", None, "the test has no table at T0")]
    return [_in_table(symbol, table, calibration) for table in tables]


def _is_at(table: TableCalibration, reference: float | None) -> bool:
    if reference is None or table.temperature_degC is None:
        return False
    return abs(table.temperature_degC - reference) <= SAME_LEVEL


def _in_table(symbol: str, table: TableCalibration, calibration: Calibration) -> _Finding:
    known = table.temperature_degC is not None
    where = f"run {table.run}, {table.mounting}"
    where += f", {table.temperature_degC:.2f} degC" if known else ""
    quantity = (table.coefficients if symbol == "K1" else table.error_model)[symbol]
    if symbol == "delta" and quantity.value is not None:
        quantity = calibration.misalignment(table)  # free of the fixture angle where it is known
    absorbed = table.stands_for.get(_COEFFICIENTS[symbol])
    if quantity.value is None:
        return _Finding(symbol, where, None, "this record does not determine it")
    return _Finding(symbol, where, quantity, f"the numerator is {absorbed}" if absorbed else "")


# -- what that means -------------------------------------------------------------------------------


def _judgement(
    limit: Limit, finding: _Finding, guard_band: float, output_unit: str | None
) -> Judgement:
    quantity = finding.quantity
    if quantity is None or quantity.value is None:
        return _not_tested(limit, finding)
    if limit.name == "scale_factor" and output_unit is None:
        unknown = replace(finding, remark="the record names no output unit")
        return _not_tested(limit, unknown)
    factor = conversion_factor(limit.unit, limit.name, output_unit)
    value = _in_unit(quantity.value, factor)
    expanded = _in_unit(quantity.expanded_uncertainty, factor)
    standard = _in_unit(quantity.standard_uncertainty, factor)
    return Judgement(
        limit=limit.name,
        symbol=finding.symbol,
        where=_where(limit, finding),
        outcome=_outcome(limit, value, expanded, guard_band),
        unit=limit.unit,
        minimum=limit.minimum,
        maximum=limit.maximum,
        value=value,
        expanded_uncertainty=expanded,
        probability=_probability(limit, value, standard, expanded, quantity.dof),
        remark=_remark(finding, expanded),
    )


def _where(limit: Limit, finding: _Finding) -> str:
    return ", ".join(part for part in (limit.condition, finding.where) if part)


def _not_tested(limit: Limit, finding: _Finding) -> Judgement:
    return Judgement(
        limit=limit.name,
        symbol=finding.symbol,
        where=_where(limit, finding),
        outcome="not tested",
        unit=limit.unit,
        minimum=limit.minimum,
        maximum=limit.maximum,
        remark=finding.remark or "this calibration does not determine it",
    )


@overload
def _in_unit(value: float, factor: float) -> float: ...
@overload
def _in_unit(value: float | None, factor: float) -> float | None: ...
def _in_unit(value: float | None, factor: float) -> float | None:
    """Convert; 12 digits, so that 500e-6 is 500 ppm and not a little more."""
    return None if value is None else float(f"{value / factor:.12g}")


def _outcome(limit: Limit, value: float, expanded: float | None, guard_band: float) -> str:
    if expanded is None and guard_band > 0.0:
        return "undecided" if all(limit.within(value)) else "fail"
    width = guard_band * (expanded or 0.0)
    low, high = value - width, value + width
    if any(least <= low and high <= most for least, most in limit.intervals):
        return "pass"
    if all(high < least or low > most for least, most in limit.intervals):
        return "fail"
    return "undecided"


def _remark(finding: _Finding, expanded: float | None) -> str:
    unknown = "" if expanded is not None else "its uncertainty is unknown"
    return "; ".join(part for part in (finding.remark, unknown) if part)


def _probability(
    limit: Limit,
    value: float,
    standard: float | None,
    expanded: float | None,
    known_dof: float | None,
) -> float | None:
    """Probability that the true value keeps the limit, JCGM 106:2012, 7.2 to 7.4."""
    if not standard or expanded is None:
        return None
    dof = known_dof or dof_of_student_quantile(_LEVEL, expanded / standard)
    return sum(
        _above((low - value) / standard, dof) - _above((high - value) / standard, dof)
        for low, high in limit.intervals
    )


def _above(deviation: float, dof: float) -> float:
    if math.isinf(deviation):
        return 0.0 if deviation > 0.0 else 1.0
    return student_survival(deviation, dof)
