"""Parts that reports of findings share: noise, factors, chances, verdicts, what checks found."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from accelcal.numerics.probability import LEAST_CHANCE, written_p_value
from accelcal.plural import degrees_of_freedom
from accelcal.report.lines import aligned, hanging, wrapped
from accelcal.report.numbers import significant
from accelcal.results.findings import Share
from accelcal.results.quantity import ErrorSource, Gate
from accelcal.shown_units import in_small_unit

_SHOWN_P = 0.05
_NAMES = {"launch_sf": "launch scale factor"}
_UNTOLD = {"none": "not declared"}


def noise_line(sources: Sequence[ErrorSource]) -> str:
    """Tell the noise of the readings and what else is uncertain."""
    return "noise: " + "; ".join(map(_source, sources))


def _source(source: ErrorSource) -> str:
    name = _NAMES.get(source.name, source.name)
    if source.value is None:
        return f"{name} {_UNTOLD.get(source.source, source.source)}"
    factor, unit = in_small_unit(source.unit)
    dof = f", {degrees_of_freedom(source.dof)}" if source.dof is not None else ""
    value = significant(source.value * factor, 2) if source.value else "0"
    return f"{name} {value} {unit} ({source.source}{dof})"


def factor_rows(where: Sequence[Share]) -> list[tuple[str, str, str]]:
    """Tell factor, share and chance of noise, with a heading."""
    rows = [("factor", "share", "chance of noise")]
    for factor, share, p in parts_of_disagreement(where):
        rows.append((factor, f"{100.0 * share:.1f} %", "" if p is None else probability(p)))
    return rows


def where_lines(where: Sequence[Share], structure: str) -> Iterator[str]:
    """Tell which factors disagree, and the pattern where there is one."""
    yield "Where they disagree"
    yield from aligned(factor_rows(where), right={1}, indent="  ")
    if structure:
        yield from wrapped(f"pattern: {structure}", "  ")


def parts_of_disagreement(where: Sequence[Share]) -> list[tuple[str, float, float | None]]:
    """List factor, share and chance of noise: the significant ones, all others, repeatability."""
    named = [share for share in where if share.p_value < _SHOWN_P]
    rest = sum(share.share for share in where if share.p_value >= _SHOWN_P)
    repeatability = max(1.0 - sum(share.share for share in where), 0.0)  # rounded below zero
    return [
        *((one.factor, one.share, one.p_value) for one in sorted(named, key=lambda s: -s.share)),
        ("other factors, no more than noise", rest, None),
        ("repeatability", repeatability, None),
    ]


def gate_lines(gates: Iterable[Gate]) -> Iterator[str]:
    """Tell what each check found.

    Examples
    --------
    >>> list(gate_lines([Gate("clampings", "pass", "two"), Gate("outlier", "warn", "row 3")]))
    ['- pass: clampings: two', '- WARNING: outlier: row 3']
    """
    for gate in gates:
        verdict = "WARNING" if gate.verdict == "warn" else gate.verdict
        yield from hanging(f"- {verdict}: {gate.name}: {gate.finding}")


def chance(p: float) -> str:
    """Tell a p-value."""
    return f"chance of noise {probability(p)}"


def probability(p: float) -> str:
    """Write a p-value with the digits that it is worth."""
    return f"{p:.2f}" if p >= 0.1 else f"{p:.1g}" if p > LEAST_CHANCE else f"below {LEAST_CHANCE:g}"


def p_value(p: float) -> str:
    """Write a p-value beside a number, for pictures and notebooks, as 0.001 at least."""
    return written_p_value(p, 1e-3)


_WORDS = {"agree": "agree", "disagree": "DISAGREE"}


def headline(compared: str, verdict: str, hidden_by: str) -> str:
    """Tell a verdict.

    Examples
    --------
    >>> headline("The coefficients", "disagree", "")
    'The coefficients DISAGREE'
    >>> headline("The coefficients", "no verdict", "errors of this size hide disagreements")
    'No verdict: errors of this size hide disagreements'
    """
    return f"{compared} {_WORDS[verdict]}" if verdict in _WORDS else f"No verdict: {hidden_by}"
