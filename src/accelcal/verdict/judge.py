"""Verdict of a calibration against a data sheet: pass, fail, undecided, or not tested.

The rule is that of `accelcal.verdict.conformity`; here its outcomes get their numbers and words.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from accelcal.arguments.kinds import expect
from accelcal.arrays import Array
from accelcal.model import COEFFICIENT_OF
from accelcal.numerics.probability import LEVEL, dof_of_student_quantile, student_survival
from accelcal.results.beyond_uncertainty import OF_USE, beyond_uncertainty
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.table import TableCalibration, known_temperatures
from accelcal.results.usable import gates_that_warn
from accelcal.results.verdict import OUTCOMES, Judgement, Verdict
from accelcal.shown_units import in_small_unit
from accelcal.specification import RULES, Limit, Specification
from accelcal.verdict.conformity import (
    ANOTHER_TEST,
    SECOND_AXIS,
    Conformity,
    Found,
    Measured,
    Place,
    conformity,
    in_unit,
    is_comparable,
)

__all__ = ["judge"]


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
        If what is given is no calibration or no data sheet.

    Notes
    -----
    With the expanded uncertainty U (95 %) and the guard band w = r U of the rule, a value x passes
    where all of x - w .. x + w keeps the limit, fails where none of it does, and is undecided
    otherwise. A scale factor in the unit of another output is not tested. Where U is unknown, a
    value beyond its limit fails and one within stays undecided,
    except by simple acceptance. The probability of conformity is that of JCGM 106:2012 with
    Student's distribution about x and no prior knowledge.

    Examples
    --------
    >>> import accelcal
    >>> limit = accelcal.Limit("scale_factor_temperature_sensitivity", "ppm/degC", maximum=500.0)
    >>> sheet = accelcal.Specification("AL-15", (limit,))
    >>> verdict = accelcal.judge(accelcal.fit(accelcal.simulate(seed=1)), sheet)
    >>> [(j.symbol, j.outcome) for j in verdict.judgements], verdict.outcome
    ([('beta1', 'fail'), ('beta2', 'pass')], 'fail')
    """
    expect(calibration, Calibration)
    expect(specification, Specification)
    found = conformity(specification, _measured(calibration))
    return Verdict(
        specification=specification.name,
        source=specification.source,
        rule=specification.rule,
        rule_statement=RULES[specification.rule].statement,
        judgements=tuple(_judgement(each, calibration) for each in found),
        notes=(
            *gates_that_warn(calibration, calibration.tables),
            *beyond_uncertainty(calibration, calibration.tables, by_laws=True, also=OF_USE),
        ),
    )


# -- what the calibration says ---------------------------------------------------------------------


def _measured(calibration: Calibration) -> Measured:
    levels = [table.temperature_degC for table in calibration.tables]
    return Measured(
        output_unit=calibration.output_unit,
        mountings=[table.mounting for table in calibration.tables],
        temperatures=_numbers(levels)[None],
        reference=_numbers([calibration.T0_degC]),
        quantity=partial(_found, calibration),
    )


def _found(calibration: Calibration, symbol: str, place: int | str) -> Found:
    quantity = _quantity(calibration, symbol, place)
    told = (quantity.value, quantity.expanded_uncertainty) if quantity else (None, None)
    return Found(*(_numbers([number]) for number in told))


def _numbers(values: list[float | None]) -> Array:
    return np.array(values, dtype=np.float64)  # None becomes NaN


def _quantity(calibration: Calibration, symbol: str, place: Place) -> Quantity | None:
    if isinstance(place, int):
        return _in_table(calibration, symbol, calibration.tables[place])
    if place is None:
        return None
    is_second, term = place.startswith(SECOND_AXIS), place.removeprefix(SECOND_AXIS)
    model = calibration.second_axis_model if is_second else calibration.temperature_model
    if model is None:
        return None
    law, _, part = term.partition(" ")
    found: Quantity | None = getattr(getattr(model, law), part) if part else getattr(model, law)
    return found


def _in_table(calibration: Calibration, symbol: str, table: TableCalibration) -> Quantity:
    quantity = table.quantities[symbol]
    if symbol == "delta" and quantity.value is not None:
        return calibration.misalignment(table)  # free of the fixture angle where it is known
    return quantity


# -- in numbers and words --------------------------------------------------------------------------


def _judgement(found: Conformity, calibration: Calibration) -> Judgement:
    limit, outcome = found.limit, OUTCOMES[int(found.outcome[0])]
    quantity = _quantity(calibration, found.symbol, found.place)
    judged = partial(
        Judgement,
        limit=limit.name,
        symbol=found.symbol,
        where=", ".join(filter(None, [limit.condition, _where(found, calibration)])),
        outcome=outcome,
        unit=limit.unit,
        minimum=limit.minimum,
        maximum=limit.maximum,
    )
    if outcome == "not tested":
        return judged(remark=_why_not_tested(found, calibration))
    if quantity is None:
        return judged()
    factor = limit.factor(calibration.output_unit)
    value, standard, expanded = _converted(quantity, factor)
    return judged(
        value=value,
        expanded_uncertainty=expanded,
        probability=_probability(limit, value, standard, expanded, quantity.dof),
        remark=_remark(found, calibration, expanded),
    )


def _converted(quantity: Quantity, factor: float) -> tuple[float, float | None, float | None]:
    parts = (quantity.value, quantity.standard_uncertainty, quantity.expanded_uncertainty)
    value, *rest = in_unit(_numbers(list(parts)), factor).tolist()
    standard, expanded = (None if math.isnan(part) else part for part in rest)
    return value, standard, expanded


def _where(found: Conformity, calibration: Calibration) -> str:
    if isinstance(found.place, int):
        table = calibration.tables[found.place]
        level = table.temperature_degC
        where = f"run {table.run}, {table.mounting}"
        return where if level is None else f"{where}, {level:.2f} degC"
    if found.symbol == "T":
        return _tested_range(calibration)
    if found.place is None:
        return "" if found.symbol in ANOTHER_TEST else "at T0"
    return ", ".join(filter(None, [_whose(found, calibration), _side(found.place, calibration)]))


def _whose(found: Conformity, calibration: Calibration) -> str:
    """Mounting of a law, where both axes along the shaft have one of this quantity."""
    second = calibration.second_mounting
    if second is None or not str(found.place).removeprefix(SECOND_AXIS).startswith("delta "):
        return ""
    return second if str(found.place).startswith(SECOND_AXIS) else calibration.main_mounting


def _side(place: str, calibration: Calibration) -> str:
    side = place.removeprefix(SECOND_AXIS).partition(" ")[2]
    return f"at T0 = {calibration.T0_degC:g} degC" if side == "at_T0" else side and f"{side} T0"


def _tested_range(calibration: Calibration) -> str:
    levels = known_temperatures(calibration.tables)
    if not levels:
        return ""
    ends = dict.fromkeys(f"{round(end, 2):g}" for end in (min(levels), max(levels)))
    return f"tested {' to '.join(ends)} degC"


def _why_not_tested(found: Conformity, calibration: Calibration) -> str:
    if found.symbol in ANOTHER_TEST:
        return _of_another_test(found.symbol, calibration)
    if found.symbol == "T":
        known = bool(_tested_range(calibration))
        return "the test did not cover the range" if known else "the temperatures are unknown"
    if found.place is None:
        return "the test has no table at T0"
    if not is_comparable(found.limit, calibration.output_unit):
        own = calibration.output_unit
        return f"the readings are in {own}" if own else "the record names no output unit"
    return _why_missing(found.place)


def _why_missing(place: int | str) -> str:
    if isinstance(place, int):
        return "this record does not determine it"
    if place == "hysteresis":
        return "no level was reached both by heating and by cooling"
    side = place.rpartition(" ")[2]
    return (
        "the test has no law of this axis"
        if side == "at_T0"
        else f"the test has no slope {side} T0"
    )


def _of_another_test(symbol: str, calibration: Calibration) -> str:
    test, near = ANOTHER_TEST[symbol]
    remark = f"a tumble test cannot show it; {test}"
    for source in calibration.error_sources:
        if source.name == near and source.source == "estimated" and source.value is not None:
            factor, unit = in_small_unit(source.unit)
            size = f"{factor * source.value:.2g} {unit}"
            remark += f" (from run to run it scattered by {size}, thermal cycles included)"
    return remark


def _remark(found: Conformity, calibration: Calibration, expanded: float | None) -> str:
    remarks = []
    if isinstance(found.place, int):
        absorbed = calibration.tables[found.place].stands_for.get(COEFFICIENT_OF[found.symbol])
        remarks = [f"the numerator is {absorbed}"] if absorbed else []
    if expanded is None:
        remarks.append("its uncertainty is unknown")
    return "; ".join(remarks)


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
    dof = known_dof or dof_of_student_quantile(LEVEL, expanded / standard)
    return sum(
        _above((low - value) / standard, dof) - _above((high - value) / standard, dof)
        for low, high in limit.intervals
    )


def _above(deviation: float, dof: float) -> float:
    if math.isinf(deviation):
        return 0.0 if deviation > 0.0 else 1.0
    return student_survival(deviation, dof)
