"""An error budget as text for an engineer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from accelcal.arrays import Array
from accelcal.report.lines import aligned, hanging, sections, unit_of
from accelcal.report.numbers import matching_digits, significant
from accelcal.results.error_budget import ErrorBudget, ErrorComponent
from accelcal.units import MICRO

TOGETHER = "these together, with their correlations"
"""What stands for the coefficients that are correlated with one another."""

NO_RANDOM_ERROR = "no random error is given that acts here"
"""Why a bound is zero."""

_ABOUT_THE_BOUND = (
    "the bound of (4) adds linearly, but with half of the bias bound (3), as the paper does, and"
    " nothing of the calibration's uncertainty: it may be smaller than the 95 % interval, which"
    " counts all in full"
)

_IN_FULL = 4  # points; of more, only the worst is split by component


def text(budget: ErrorBudget) -> str:
    """Write the totals of all points, and the components of each, or of the worst of many."""
    points = range(budget.a_i.size)
    split: Sequence[int] = points
    if len(points) > _IN_FULL:
        split = [int(np.argmax(np.abs(budget.systematic) + budget.expanded_uncertainty))]
    totals = _totals(budget) if len(points) > 1 else ()
    return sections(_heading(budget), totals, *(_split(budget, i) for i in split))


def _heading(budget: ErrorBudget) -> Iterator[str]:
    unit = unit_of(budget.serial, budget.source)
    yield f"Error of the measured acceleration by (4): {unit}"
    yield "Errors in ug (1e-6 local g), before accelcal apply corrects the systematic part"
    for note in (_ABOUT_THE_BOUND, *budget.warnings):
        yield from hanging(f"note: {note}", indent="  ")


def place(budget: ErrorBudget, i: int) -> str:
    """Name a point by its acceleration, temperature and time; what is zero or unknown is left out.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> place(accelcal.budget(calibration, [0.0, 1.0], temperature=80.0), 1)
    'a_i = 1 g, 80 degC'
    """
    across = {"a_i": budget.a_i[i], "a_p": budget.a_p[i], "a_o": budget.a_o[i]}
    parts = [f"{axis} = {a:g} g" for axis, a in across.items() if axis == "a_i" or a]
    if not np.isnan(budget.temperature_degC[i]):
        parts.append(f"{budget.temperature_degC[i]:g} degC")
    if budget.time_s[i]:
        parts.append(f"{budget.time_s[i]:g} s")
    return ", ".join(parts)


def _totals(budget: ErrorBudget) -> Iterator[str]:
    heading = ("a_i", "a_p", "a_o", "degC", "s", "error", "bound of (4)", "U (95 %)")
    rows = [heading, *(_total(budget, i) for i in range(budget.a_i.size))]
    yield from aligned(rows, right=range(len(heading)), indent="  ")


def _total(budget: ErrorBudget, i: int) -> tuple[str, ...]:
    temperature = budget.temperature_degC[i]
    mark = "*" if budget.extrapolated[i] else ""
    return (
        *(f"{a[i]:g}" for a in (budget.a_i, budget.a_p, budget.a_o)),
        "" if np.isnan(temperature) else f"{temperature:g}{mark}",
        f"{budget.time_s[i]:g}",
        _micro(budget.systematic[i]),
        f"+- {_micro(budget.bound[i])}" if budget.bound[i] else "none",
        f"+- {significant(MICRO * budget.expanded_uncertainty[i], 2)}",
    )


def _split(budget: ErrorBudget, i: int) -> Iterator[str]:
    mark = " (*extrapolated)" if budget.extrapolated[i] else ""
    yield f"At {place(budget, i)}{mark}"
    variance = budget.standard_uncertainty[i] ** 2
    counting = [
        p for p in budget.components if p.value[i] or p.bound[i] or p.standard_uncertainty[i]
    ]
    together, alone = (
        [part for part in counting if (part.symbol in budget.correlated) is correlated]
        for correlated in (True, False)
    )
    rows: list[tuple[str, ...]] = [("", "", "error", "+- (4)", "u", "of u^2", "from")]
    rows += [(*_component(part, i)[:5], "", part.origin) for part in together]
    if together:
        rows.append(_jointly(joint_variance(budget)[i], variance))
    rows += [_component(part, i, variance) for part in alone]
    rows.append(_sum(budget, i))
    yield from aligned(rows, right={2, 3, 4, 5}, indent="  ")
    yield from _bands(budget, i)


def joint_variance(budget: ErrorBudget) -> Array:
    """Variance of all coefficients that are correlated with one another, at each point [g^2]."""
    own = [p.standard_uncertainty for p in budget.components if p.symbol in budget.correlated]
    alone = sum((u**2 for u in own), start=np.zeros(budget.a_i.size))
    return np.maximum(alone + budget.variance_by_correlation, 0.0)


def _jointly(joint: float, variance: float) -> tuple[str, ...]:
    """Correlated errors cancel in part, so only together they have a share."""
    u = significant(MICRO * joint**0.5, 2)
    return (TOGETHER, "", "", "", u, _percent(joint, variance), "calibration")


def _component(part: ErrorComponent, i: int, variance: float = 0.0) -> tuple[str, ...]:
    return (
        part.name,
        part.symbol,
        _micro(part.value[i]) if part.value[i] else "",
        _micro(part.bound[i]) if part.bound[i] else "",
        significant(MICRO * part.standard_uncertainty[i], 2),
        _percent(part.standard_uncertainty[i] ** 2, variance),
        part.origin,
    )


def _sum(budget: ErrorBudget, i: int) -> tuple[str, ...]:
    return (
        "total",
        "",
        _micro(budget.systematic[i]),
        _micro(budget.bound[i]) if budget.bound[i] else "",
        significant(MICRO * budget.standard_uncertainty[i], 2),
        "100 %" if budget.standard_uncertainty[i] else "",
        "",
    )


def _bands(budget: ErrorBudget, i: int) -> Iterator[str]:
    error, U = budget.systematic[i], budget.expanded_uncertainty[i]
    told, half = matching_digits(error, U, MICRO) if U else (_micro(error), "0")
    if budget.bound[i]:
        bound = f"{_micro(error)} +- {_micro(budget.bound[i])} ug"
        yield f"  bound of (4), with the paper's factor 0.5: {bound}"
    else:
        yield f"  bound of (4): none, as {NO_RANDOM_ERROR}"
    yield (
        f"  GUM, variances added, 95 %, k = {budget.coverage_factor[i]:.2f}: {told} +- {half} ug"
    )


def _percent(part: float, whole: float) -> str:
    return f"{100.0 * part / whole:.1f} %" if whole > 0.0 else ""


def _micro(value: float) -> str:
    return f"{MICRO * value:.1f}"
