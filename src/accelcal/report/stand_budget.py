"""The budget of a stand as text for an engineer."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from accelcal.plural import counted
from accelcal.report.lines import aligned, hanging, sections
from accelcal.report.numbers import significant
from accelcal.results.quantity import Document
from accelcal.shown_units import in_small_unit
from accelcal.units import MICRO

_NAMED = 3  # components of a coefficient that are named; beside Monte Carlo one less
_MANY = 9999.0  # degrees of freedom that are shown as infinite
_WHOLE = 0.01  # an error is wholly taken up where its residuals are less than this part of it
_IN_PART = 0.1  # changes smaller than this share of the largest one [g] are not named
_RELATIVE = ("K1", "K1 per m/s^2")
_OF_ONE_TABLE = ("k0", "K1", "k2", "k3", "delta", "delta_ip")


def stand_budget_text(document: Document) -> str:
    """Tell the uncertainty of the coefficients, what the components do, and requirements."""
    parts = [_heading(document), _coefficients(document), _components(document)]
    if document["requirements"] is not None:
        parts += [_targets(document), _instruments(document)]
    if document["data_sheet"]:
        parts.append(_data_sheet(document))
    return sections(*parts)


def _heading(document: Document) -> Iterator[str]:
    yield f"Budget of the stand: {document['stand']}"
    yield from hanging(f"from {document['source']}")
    yield from hanging(f"Test: {document['test']}")
    for note in document["warnings"]:
        yield from hanging(f"note: {note}")


def shown_unit(coefficient: Document) -> tuple[float, str]:
    """Tell factor and unit of an uncertainty as `in_small_unit` does; ppm for the scale factor.

    Examples
    --------
    >>> shown_unit({"symbol": "K1", "unit": "mA/g", "value": 1.25})
    (800000.0, 'ppm')
    """
    if coefficient["symbol"] in _RELATIVE:
        return 1e6 / abs(coefficient["value"]), "ppm"
    unit = coefficient["unit"]
    if unit.startswith("mA"):
        return MICRO, f"n{unit[1:]}"
    return in_small_unit(unit)


def shares(document: Document, place: int) -> list[tuple[str, float]]:
    """Name the components of one coefficient, the largest first, with their parts of its variance.

    The parts add up to 1; there are none where the uncertainty is 0.
    """
    variance = document["coefficients"][place]["standard_uncertainty"] ** 2
    if variance == 0.0:
        return []
    found = [
        (part["name"], part["contributions"][place] ** 2 / variance)
        for part in document["components"]
    ]
    return sorted(found, key=lambda item: -item[1])


def _coefficients(document: Document) -> Iterator[str]:
    """Table of the coefficients of the table nearest to T0, slopes, and reversed mountings."""
    trials = document["monte_carlo"]
    yield from hanging(
        "Uncertainty of each coefficient: u standard, U expanded (95 %), U without its first"
        " component, % of u^2 by component"
    )
    if trials is not None:
        stable = "" if trials["stable"] else ", not yet stable"
        yield from hanging(
            f"Monte Carlo (JCGM 101): {trials['trials']} trials, seed {trials['seed']}{stable};"
            " low and high: its 95 % interval less the value; linear: whether U agrees with it to"
            " the numerical tolerance (clause 8)"
        )
    heading = ["", "unit", "u", "U", "dof"]
    heading += ["low", "high", "linear"] if trials is not None else []
    heading.append("U less 1st")
    shown = [i for i, item in enumerate(document["coefficients"]) if _is_shown(item)]
    rows = [[*heading, "from"], *(_row(document, place) for place in shown)]
    yield from aligned(rows, right=range(2, len(heading)), indent="  ")
    left = len(document["coefficients"]) - len(shown)
    if left:
        yield f"  (and {counted(left, 'coefficient')} of the other tables, in CSV and JSON)"


def _is_shown(coefficient: Document) -> bool:
    """Whether it is of the table nearest to T0, of two runs, or a change."""
    where, symbol = str(coefficient["where"] or ""), str(coefficient["symbol"])
    return not where or "run" in where.partition(" and ")[2] or symbol.endswith(" change")


def _row(document: Document, place: int) -> list[str]:
    coefficient = document["coefficients"][place]
    factor, unit = shown_unit(coefficient)
    freedom, trial = coefficient["dof"], coefficient["monte_carlo"]
    dof = "inf" if freedom is None or freedom > _MANY else f"{freedom:.0f}"
    u, U = (significant(factor * coefficient[f"{kind}_uncertainty"], 3) for kind in _BOTH)
    named = _NAMED - (trial is not None)
    largest = [item for item in shares(document, place)[:named] if item[1] >= 0.005]
    told = ", ".join(f"{name} {100 * share:.0f}" for name, share in largest)
    rest = max(1.0 - sum(share for _, share in largest[:1]), 0)
    without = coefficient["expanded_uncertainty"] * math.sqrt(rest)
    found: list[str] = [] if trial is None else _trial(coefficient, trial, factor)
    return [coefficient["symbol"], unit, u, U, dof, *found, significant(factor * without, 3), told]


_BOTH = ("standard", "expanded")


def _trial(coefficient: Document, trial: Document, factor: float) -> list[str]:
    ends = [factor * (trial[end] - coefficient["value"]) for end in ("low", "high")]
    shown = [f"{'-' if end < 0 else '+'}{significant(abs(end), 3)}" for end in ends]
    return [*shown, "yes" if trial["agrees"] else "NO"]


def _components(document: Document) -> Iterator[str]:
    yield from hanging(
        "What each component does: its standard uncertainty, its independent errors, the part of"
        " its effect that the residuals show, and what goes into the coefficients of the first"
        " table by one u (k0, k2, k3, delta_ip in ug, delta in urad, K1 in ppm)"
    )
    rows: list[Sequence[str]] = [("", "u", "", "errors", "seen", "goes into")]
    rows += [_component(document, part) for part in document["components"]]
    yield from aligned(rows, right=(1, 3, 4), indent="  ")
    silent = [p["name"] for p in document["components"] if not p["acts"]]
    if silent:
        yield from hanging(f"Below 0.1 % of every u here: {', '.join(silent)}.")
    hidden = [p["name"] for p in document["components"] if p["acts"] and _hidden(p)]
    if hidden:
        yield from hanging(
            f"Systematic and unseen: {', '.join(hidden)}. No residual shows them and no stroke"
            " averages them: each is a bias of the coefficients behind it."
        )


def _hidden(part: Document) -> bool:
    seen = part["residual"]
    return not part["averages"] and (seen is None or seen < _WHOLE)


def _of_instrument(unit: str) -> tuple[float, str]:
    """Factor and unit in which the error of an instrument is told; a voltmeter's in uV."""
    return (MICRO, "uV") if unit == "V" else in_small_unit(unit)


def _component(document: Document, part: Document) -> tuple[str, ...]:
    factor, unit = _of_instrument(part["unit"])
    seen = part["residual"]
    return (
        f"{part['name']}{' (fixed)' if part['fixed'] else ''}",
        significant(factor * part["standard_uncertainty"], 3),
        unit,
        str(part["errors"]),
        "" if seen is None else f"{100 * seen:.0f} %",
        _absorbed(document, part) if part["acts"] else "nothing here",
    )


def _absorbed(document: Document, part: Document) -> str:
    """Coefficients that a component changes most, each with its change."""
    found = []
    for coefficient, change in zip(document["coefficients"], part["contributions"], strict=True):
        if not coefficient["where"] and coefficient["symbol"] in _OF_ONE_TABLE:
            found.append((shown_unit(coefficient)[0] * change, coefficient["symbol"]))
    largest = max((abs(size) for size, _ in found), default=0.0)
    if largest < _NOTHING:
        return _elsewhere(document, part)
    named = [item for item in found if abs(item[0]) >= _IN_PART * largest]
    sign = "+" if part["errors"] == 1 and not part["kind"].endswith(_OF_A_PHASE) else ""
    return ", ".join(f"{name} {size:{sign}.2g}" for size, name in named)


_OF_A_PHASE = ("harmonic", "daily")
_NOTHING = 1e-6  # ug: below it a change is rounding error


def _elsewhere(document: Document, part: Document) -> str:
    """Where a component acts, when it does on no coefficient of the table nearest to T0."""
    found = [
        (abs(change) / coefficient["standard_uncertainty"], coefficient, change)
        for coefficient, change in zip(document["coefficients"], part["contributions"], strict=True)
        if coefficient["standard_uncertainty"] > 0.0 and not coefficient["where"]
    ]
    most = max((ratio for ratio, _, _ in found), default=0.0)
    named = []
    for ratio, coefficient, change in found:
        if ratio > 0.5 * most:
            factor, unit = shown_unit(coefficient)
            named.append(f"{coefficient['symbol']} {abs(factor * change):.2g} {unit}")
    return ", ".join(named)


def _targets(document: Document) -> Iterator[str]:
    yield "Targets of U (95 %), and the floor that perfect instruments leave"
    rows = [("", "unit", "target", "now", "floor", "")]
    for target in document["requirements"]["targets"]:
        own = (c for c in document["coefficients"] if c["symbol"] == target["symbol"])
        factor, unit = shown_unit(next(own))
        sizes = (significant(factor * target[n], 3) for n in ("target", "present", "floor"))
        rows.append((target["symbol"], unit, *sizes, _reached(target)))
    yield from aligned(rows, right=(2, 3, 4), indent="  ")


def _reached(target: Document) -> str:
    if target["reached"]:
        return "reached"
    if target["reachable"]:
        return "to be reached with better instruments"
    return f"out of reach: held up by {', '.join(target['held_up_by']) or 'the fixed components'}"


def _instruments(document: Document) -> Iterator[str]:
    yield "What each instrument must be, as a standard uncertainty (fixed components stay)"
    rows = [("", "", "now", "alone", "equal shares", "all alike", "alone is limited by")]
    for item in document["requirements"]["instruments"]:
        factor, unit = _of_instrument(item["unit"])
        names = ("present", "alone", "equal_shares", "proportional")
        now, alone, *shared = (_size(item[name], factor) for name in names)
        rows.append(
            (
                item["name"],
                unit,
                now,
                alone or "> 100 x",
                *(size or "as now" for size in shared),
                item["limited_by"],
            )
        )
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


def _data_sheet(document: Document) -> Iterator[str]:
    yield "Limits of the data sheet against U of this test; suffices: 4 to 1 or better"
    rows: list[Sequence[str]] = [("", "of", "unit", "limit", "U", "ratio", "")]
    limits = document["data_sheet"]
    for limit in limits:
        U, ratio = limit["expanded_uncertainty"], limit["ratio"]
        rows.append(
            (
                limit["name"],
                limit["symbol"],
                limit["unit"],
                f"{limit['limit']:g}",
                "" if U is None else significant(U, 3),
                "" if ratio is None else significant(ratio, 2),
                limit["verdict"],
            )
        )
    yield from aligned(rows, right=(3, 4, 5), indent="  ")
    for note in dict.fromkeys(limit["note"] for limit in limits if limit["note"]):
        named = ", ".join(limit["name"] for limit in limits if limit["note"] == note)
        yield from hanging(f"  {named}: {note}")
