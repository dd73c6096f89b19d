"""An error budget as text for an engineer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from accelcal.report.lines import aligned, hanging, sections, unit_of
from accelcal.report.numbers import matching_digits, significant
from accelcal.results.quantity import Document
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


def budget_text(document: Document) -> str:
    """Write the totals of all points, and the components of each, or of the worst of many."""
    points = document["points"]
    split = points
    if len(points) > _IN_FULL:
        split = [max(points, key=lambda p: abs(p["systematic"]) + p["expanded_uncertainty"])]
    totals = _totals(points) if len(points) > 1 else ()
    return sections(_heading(document), totals, *map(_split, split))


def _heading(document: Document) -> Iterator[str]:
    unit = unit_of(document["serial"], document["source"])
    yield f"Error of the measured acceleration by (4): {unit}"
    yield "Errors in ug (1e-6 local g), before accelcal apply corrects the systematic part"
    for note in (_ABOUT_THE_BOUND, *document["warnings"]):
        yield from hanging(f"note: {note}", indent="  ")


def place(point: Document) -> str:
    """Name a point by its acceleration, temperature and time; what is zero or unknown is left out.

    Examples
    --------
    >>> acceleration = {"a_i": 1.0, "a_p": 0.0, "a_o": 0.0}
    >>> place({"acceleration": acceleration, "temperature_degC": 80.0, "time_s": 0.0})
    'a_i = 1 g, 80 degC'
    """
    across = {n: a for n, a in point["acceleration"].items() if n == "a_i" or a}
    parts = [f"{axis} = {a:g} g" for axis, a in across.items()]
    if point["temperature_degC"] is not None:
        parts.append(f"{point['temperature_degC']:g} degC")
    if point["time_s"]:
        parts.append(f"{point['time_s']:g} s")
    return ", ".join(parts)


def _totals(points: Sequence[Document]) -> Iterator[str]:
    heading = ("a_i", "a_p", "a_o", "degC", "s", "error", "bound of (4)", "U (95 %)")
    rows = [heading, *map(_total, points)]
    yield from aligned(rows, right=range(len(heading)), indent="  ")


def _total(point: Document) -> tuple[str, ...]:
    temperature = point["temperature_degC"]
    mark = "*" if point["extrapolated"] else ""
    return (
        *(f"{a:g}" for a in point["acceleration"].values()),
        "" if temperature is None else f"{temperature:g}{mark}",
        f"{point['time_s']:g}",
        _micro(point["systematic"]),
        f"+- {_micro(point['bound'])}" if point["bound"] else "none",
        f"+- {significant(MICRO * point['expanded_uncertainty'], 2)}",
    )


def _split(point: Document) -> Iterator[str]:
    mark = " (*extrapolated)" if point["extrapolated"] else ""
    yield f"At {place(point)}{mark}"
    variance = point["standard_uncertainty"] ** 2
    sizes = ("value", "bound", "standard_uncertainty")
    counting = [part for part in point["components"] if any(part[size] for size in sizes)]
    together, alone = (
        [part for part in counting if part["correlated"] is correlated]
        for correlated in (True, False)
    )
    rows: list[tuple[str, ...]] = [("", "", "error", "+- (4)", "u", "of u^2", "from")]
    rows += [(*_component(part)[:5], "", part["origin"]) for part in together]
    if together:
        rows.append(_jointly(point, variance))
    rows += [_component(part, variance) for part in alone]
    rows.append(_sum(point))
    yield from aligned(rows, right={2, 3, 4, 5}, indent="  ")
    yield from _bands(point)


def joint_variance(point: Document) -> float:
    """Variance of all coefficients that are correlated with one another [g^2]."""
    parts = (part for part in point["components"] if part["correlated"])
    alone = sum(part["standard_uncertainty"] ** 2 for part in parts)
    return float(max(alone + point["variance_by_correlation"], 0.0))


def _jointly(point: Document, variance: float) -> tuple[str, ...]:
    """Correlated errors cancel in part, so only together they have a share."""
    joint = joint_variance(point)
    u = significant(MICRO * joint**0.5, 2)
    return (TOGETHER, "", "", "", u, _percent(joint, variance), "calibration")


def _component(part: Document, variance: float = 0.0) -> tuple[str, ...]:
    return (
        part["name"],
        part["symbol"],
        _micro(part["value"]) if part["value"] else "",
        _micro(part["bound"]) if part["bound"] else "",
        significant(MICRO * part["standard_uncertainty"], 2),
        _percent(part["standard_uncertainty"] ** 2, variance),
        part["origin"],
    )


def _sum(point: Document) -> tuple[str, ...]:
    return (
        "total",
        "",
        _micro(point["systematic"]),
        _micro(point["bound"]) if point["bound"] else "",
        significant(MICRO * point["standard_uncertainty"], 2),
        "100 %" if point["standard_uncertainty"] else "",
        "",
    )


def _bands(point: Document) -> Iterator[str]:
    error, U = point["systematic"], point["expanded_uncertainty"]
    told, half = matching_digits(error, U, MICRO) if U else (_micro(error), "0")
    if point["bound"]:
        bound = f"{_micro(error)} +- {_micro(point['bound'])} ug"
        yield f"  bound of (4), with the paper's factor 0.5: {bound}"
    else:
        yield f"  bound of (4): none, as {NO_RANDOM_ERROR}"
    yield (f"  GUM, variances added, 95 %, k = {point['coverage_factor']:.2f}: {told} +- {half} ug")


def _percent(part: float, whole: float) -> str:
    return f"{100.0 * part / whole:.1f} %" if whole > 0.0 else ""


def _micro(value: float) -> str:
    return f"{MICRO * value:.1f}"
