"""A verdict as text for an engineer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from accelcal.report.lines import aligned, hanging, visible_lines
from accelcal.report.numbers import matching_digits
from accelcal.results.verdict import Judgement, Verdict

_HEADING = ("", "", "value", "+- U", "limit", "")


def text(verdict: Verdict) -> str:
    """Write a line for each limit and place, the remarks, and the decision rule.

    Examples
    --------
    >>> from accelcal.results.verdict import Judgement, Verdict
    >>> found = Judgement("bias", "k0", "at T0", "pass", "mg", None, 5.0, 3.3, 0.1, 1.0)
    >>> print(text(Verdict("AL-15", "", "guard band", "w = U", (found,))))
    Verdict against AL-15: PASS (1 pass)
                value  +- U  limit
      PASS  k0   3.30  0.10  |x| <= 5 mg  bias, at T0
      decision rule: w = U
    """
    return visible_lines(verdict_lines(verdict))


def verdict_lines(verdict: Verdict) -> Iterator[str]:
    """Tell a verdict in lines of a report."""
    limits = verdict.judgements
    counts = Counter(limit.outcome for limit in limits)
    told = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
    yield from hanging(
        f"Verdict against {verdict.specification}: {verdict.outcome.upper()} ({told})"
    )
    rows = [_HEADING, *map(limit_row, limits)]
    yield from aligned(rows, right={2, 3}, indent="  ")
    for limit in limits:
        if said := remark(limit):
            yield from hanging(f"{limit.symbol}: {said}", indent="  ")
    for note in verdict.notes:
        yield from hanging(f"note: {note}", indent="  ")
    yield from hanging(f"decision rule: {verdict.rule_statement}", indent="  ")


def limit_row(limit: Judgement) -> tuple[str, ...]:
    """Tell outcome, symbol, value, half width of its interval, limit, and name with the place."""
    outcome = limit.outcome
    return (
        outcome.upper() if outcome in ("pass", "fail") else outcome,
        limit.symbol,
        *_found(limit),
        f"{_range(limit)} {limit.unit}",
        _name(limit),
    )


def _name(limit: Judgement) -> str:
    """Name of the limit and where it was tested; of a slope, the symbol tells the side of T0."""
    name, where = limit.limit.replace("_", " "), limit.where
    if name.endswith("sensitivity"):
        where = where.rpartition(", ")[0]
    return f"{name}, {where}" if where else name


def _found(limit: Judgement) -> tuple[str, str]:
    if limit.value is None:
        return "", ""
    return matching_digits(limit.value, limit.expanded_uncertainty)


def _range(limit: Judgement) -> str:
    low, high = limit.minimum, limit.maximum
    if low is None:
        return f"|x| <= {high:g}"
    return f"|x| >= {low:g}" if high is None else f"{low:g} to {high:g}"


def remark(limit: Judgement) -> str:
    """Tell why a limit was not tested, or how near it is."""
    probability = limit.probability
    if limit.outcome != "undecided" or probability is None:
        return limit.remark
    chance = f"it keeps the limit with a probability of {_percent(probability)}"
    return "; ".join(part for part in (chance, limit.remark) if part)


def _percent(probability: float) -> str:
    if not 0.001 <= probability <= 0.999:
        return "below 0.1 %" if probability < 0.001 else "above 99.9 %"
    return f"{100.0 * probability:.1f} %"
