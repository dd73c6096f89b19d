"""Outcomes as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from statistics import median

import numpy as np
from hidden.noise import REGIMES

from rivals.answer import Answer
from rivals.cases import SIZES
from rivals.methods import METHODS, is_installed
from rivals.trial import Outcome

CERTAIN = 6.0
"""Noncentrality from which the class is to be right."""

BINS = ((0.0, 3.0), (3.0, 6.0), (6.0, 12.0), (12.0, np.inf))
REPEATED = 1e-9

Rows = Sequence[Outcome]


def share(count: int, total: int) -> str:
    """Count of a total and its percentage."""
    return f"{count}/{total} {100.0 * count / total:.1f} %" if total else "-"


def limited(count: int, total: int) -> str:
    """The same with 95 % limits (Clopper and Pearson)."""
    from scipy.stats import beta

    if not total:
        return "-"
    low = beta.ppf(0.025, count, total - count + 1) if count else 0.0
    high = beta.ppf(0.975, count + 1, total - count) if count < total else 1.0
    return f"{share(count, total)} ({100 * low:.1f}..{100 * high:.1f})"


def _lines(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield "| " + " | ".join(head) + " |"
    yield "| " + " | ".join("---" for _ in head) + " |"
    yield from ("| " + " | ".join(row) + " |" for row in rows)
    yield ""


def _of(rows: Rows, method: str) -> list[Outcome]:
    return [row for row in rows if row.method == method]


def _asked(rows: Rows) -> tuple[str, ...]:
    """Methods with an outcome or without their package, in order."""
    return tuple(m for m in METHODS if _of(rows, m) or not is_installed(m))


def _by_method(
    rows: Rows, head: Sequence[str], cells: Callable[[list[Outcome]], list[str]]
) -> Iterator[str]:
    """A line for each method, with the seconds it took."""
    lines = []
    for method in _asked(rows):
        own = _of(rows, method)
        if own:
            lines.append([method, *cells(own), f"{np.mean([r.seconds for r in own]):.2f}"])
        else:
            lines.append([method, "not installed", *[""] * len(head)])
    return _lines(["method", *head, "s a table"], lines)


def _count(rows: Rows, true: Callable[[Outcome], bool]) -> tuple[int, int]:
    return sum(map(true, rows)), len(rows)


def _verdicts(rows: Rows) -> str:
    """Right, wrong, unknown and nothing in percent."""
    if not rows:
        return "-"
    counts = [_count(rows, lambda r, v=v: r.verdict == v)[0] for v in VERDICTS]
    return " / ".join(f"{100.0 * count / len(rows):.1f}" for count in counts)


VERDICTS = ("right", "wrong", "unknown", "nothing")


def clean(rows: Rows) -> Iterator[str]:
    """Clean tables that get a name."""
    yield "## Clean tables"
    yield ""
    for regime in _regimes(rows):
        for design in dict.fromkeys(row.case.design for row in rows):
            own = [r for r in rows if (r.case.regime, r.case.design) == (regime, design)]
            yield f"{regime}, {design}: {len({r.case.number for r in own})} tables"
            yield ""
            yield from _by_method(own, ("physical name", "any name", "unknown"), _named)
    yield "All clean tables of a regime:"
    yield ""
    head = ["regime", *_asked(rows)]
    yield from _lines(head, ([r, *_of_regime(rows, r)] for r in _regimes(rows)))


def _regimes(rows: Rows) -> list[str]:
    found = {row.case.regime for row in rows}
    return [regime for regime in REGIMES if regime in found]


def _of_regime(rows: Rows, regime: str) -> Iterator[str]:
    for method in _asked(rows):
        own = [row for row in _of(rows, method) if row.case.regime == regime]
        yield limited(*_count(own, lambda r: bool(r.answer.names)))


def _named(rows: Rows) -> list[str]:
    return [
        limited(*_count(rows, lambda r: bool(r.answer.names))),
        share(*_count(rows, lambda r: bool(r.answer.names or r.answer.faults))),
        share(*_count(rows, lambda r: r.answer.unknown)),
    ]


def one(rows: Rows) -> Iterator[str]:
    """One hidden effect, by its size, its noncentrality and its id."""
    for regime in _regimes(rows):
        own = [row for row in rows if row.case.regime == regime]
        yield f"## One hidden effect, noise {regime}"
        yield ""
        yield f"Class of the strongest name: {', '.join(VERDICTS)} [%], by s"
        yield ""
        yield from _by_method(own, [f"s = {s:g}" for s in SIZES], _by_size)
        yield "The same by q"
        yield ""
        yield from _by_method(own, [_bin(*limits) for limits in BINS], _by_q)
        yield "Class right where q is 6 or more; more names than effects; truth in the set"
        yield ""
        head = ("class right, q >= 6", "more names", "truth in the set, of those named")
        yield from _by_method(own, head, _sets)
        yield "By id at s = 4"
        yield ""
        yield from _by_id([row for row in own if row.case.s == 4.0])


def _by_size(rows: Rows) -> list[str]:
    return [_verdicts([row for row in rows if row.case.s == s]) for s in SIZES]


def _bin(low: float, high: float) -> str:
    return f"q {low:g} to {high:g}" if np.isfinite(high) else f"q >= {low:g}"


def _by_q(rows: Rows) -> list[str]:
    found = [[row for row in rows if low <= row.q < high] for low, high in BINS]
    return [f"{_verdicts(own)} ({len(own)})" for own in found]


def _sets(rows: Rows) -> list[str]:
    certain = [row for row in rows if row.q >= CERTAIN]
    named = [row for row in rows if row.answer.names]
    return [
        limited(*_count(certain, lambda r: r.verdict == "right")),
        share(*_count(rows, lambda r: len(r.answer.names) > 1)),
        limited(*_count(named, lambda r: r.in_sets)),
    ]


def _by_id(rows: Rows) -> Iterator[str]:
    kinds = dict.fromkeys(row.hidden[0] for row in rows)
    asked = _asked(rows)
    lines = []
    for kind in kinds:
        own = [row for row in rows if row.hidden[0] == kind]
        q = sorted({row.q for row in own})
        cells = [_verdicts(_of(own, method)) for method in asked]
        lines.append([kind, f"{len(_of(own, own[0].method))}", f"{median(q):.1f}", *cells])
    return _lines(["hidden", "tables", "median q", *asked], lines)


def several(rows: Rows) -> Iterator[str]:
    """Pairs and triples, each exactly."""
    yield "## Several hidden effects, all named and none more"
    yield ""
    sorts = list(dict.fromkeys((row.case.kind, row.case.s) for row in rows))
    head = [f"{kind}, s = {s:g}" for kind, s in sorts]

    def cells(own: list[Outcome]) -> list[str]:
        these = [[r for r in own if (r.case.kind, r.case.s) == sort] for sort in sorts]
        return [limited(*_count(each, lambda r: r.exact)) for each in these]

    yield from _by_method(rows, head, cells)


def of_position(rows: Rows) -> Iterator[str]:
    """Patterns of the position alone that the catalogue does not have."""
    yield from outside(rows, "## Outside the catalogue, of the position alone, q from 12 to 24")


def outside(rows: Rows, title: str = "## Outside the catalogue, q from 12 to 24") -> Iterator[str]:
    """Effects that the catalogue does not have."""
    strange = [row for row in rows if row.outside]
    yield title
    yield ""
    alike = len({row.case for row in rows if not row.outside})
    yield f"Left out, as an effect of the catalogue is of the same class: {alike}"
    yield ""
    head = ("name given as certain", "name in doubt", "unknown recognised", "nothing")
    yield from _by_method(strange, head, _strange)
    asked = _asked(strange)
    lines = []
    for kind in dict.fromkeys(row.hidden[0] for row in strange):
        own = [row for row in strange if row.hidden[0] == kind]
        cells = [share(*_count(_of(own, m), lambda r: _is_certain(r.answer))) for m in asked]
        lines.append([kind, *cells])
    yield "Name given as certain, by what is hidden"
    yield ""
    yield from _lines(["hidden", *asked], lines)


def _is_certain(said: Answer) -> bool:
    """Whether something is named without a doubt."""
    return not said.unknown and not set(said.names) <= said.doubted


def _is_in_doubt(said: Answer) -> bool:
    return bool(said.names) and not said.unknown and not _is_certain(said)


def _strange(rows: Rows) -> list[str]:
    return [
        limited(*_count(rows, lambda r: _is_certain(r.answer))),
        share(*_count(rows, lambda r: _is_in_doubt(r.answer))),
        share(*_count(rows, lambda r: r.answer.unknown)),
        share(*_count(rows, lambda r: not r.answer.names and not r.answer.unknown)),
    ]


def invisible(rows: Rows) -> Iterator[str]:
    """Effects that the base model absorbs."""
    yield "## Invisible effects, s = 8"
    yield ""
    yield from _by_method(rows, ("named", "any name", "listed as undetectable"), _unseen)


def _unseen(rows: Rows) -> list[str]:
    tells = [row for row in rows if row.answer.undetectable is not None]
    return [
        limited(*_count(rows, lambda r: r.hidden[0] in r.answer.names)),
        share(*_count(rows, lambda r: bool(r.answer.names))),
        share(*_count(tells, lambda r: r.hidden[0] in (r.answer.undetectable or ()))),
    ]


def held_out(rows: Rows) -> Iterator[str]:
    """How much of the gap is closed on readings that were not fitted."""
    yield "## Held-out gap closed, s = 4, q >= 6"
    yield ""
    large = [row for row in rows if row.q >= CERTAIN]
    yield from _by_method(large, ("median closed", "tables", "gap made worse"), _closing)


def _closing(rows: Rows) -> list[str]:
    closed = [row.closed for row in rows if np.isfinite(row.closed)]
    middle = f"{100.0 * median(closed):.1f} %" if closed else "-"
    worse = _count(rows, lambda r: bool(r.answer.names) and r.closed < -REPEATED)
    return [middle, f"{len(closed)}", share(*worse)]


def faults(rows: Rows) -> Iterator[str]:
    """Faults of the readings."""
    yield "## Faults of the readings"
    yield ""
    for kind, s in dict.fromkeys((row.case.kind, row.case.s) for row in rows):
        own = [row for row in rows if (row.case.kind, row.case.s) == (kind, s)]
        yield f"{kind}, s = {s:g}"
        yield ""
        yield from _by_method(own, ("fault found", "physical name", "unknown"), _faulty)


def _faulty(rows: Rows) -> list[str]:
    return [
        share(*_count(rows, lambda r: r.hidden[0] in r.answer.faults)),
        share(*_count(rows, lambda r: bool(r.answer.names))),
        share(*_count(rows, lambda r: r.answer.unknown)),
    ]


def memory(rows: Rows) -> Iterator[str]:
    """One run, in noise with a memory."""
    clean = [row for row in rows if not row.hidden]
    yield "## One run, clean, noise with a memory"
    yield ""
    for regime in _regimes(clean):
        yield f"{regime}:"
        yield ""
        head = ("physical name", "without a word of doubt", "unknown")
        yield from _by_method([r for r in clean if r.case.regime == regime], head, _believed)
    for regime, s in dict.fromkeys((r.case.regime, r.case.s) for r in rows if r.hidden):
        own = [r for r in rows if r.hidden and (r.case.regime, r.case.s) == (regime, s)]
        yield f"## One run, one hidden effect, noise {regime}, s = {s:g}"
        yield ""
        head = (", ".join(VERDICTS), "right, with a word of doubt", "wrong, without")
        yield from _by_method(own, head, _doubted)


def _is_believed(row: Outcome) -> bool:
    return not set(row.answer.names) <= row.answer.doubted


def _believed(rows: Rows) -> list[str]:
    return [
        limited(*_count(rows, lambda r: bool(r.answer.names))),
        limited(*_count(rows, _is_believed)),
        share(*_count(rows, lambda r: r.answer.unknown)),
    ]


def _doubted(rows: Rows) -> list[str]:
    doubted = [r.right and r.answer.names[0] in r.answer.doubted for r in rows]
    of = list(zip(rows, doubted, strict=True))
    return [
        _verdicts(rows),
        share(sum(r.verdict == "right" and doubt for r, doubt in of), len(rows)),
        share(sum(r.verdict == "wrong" and not doubt for r, doubt in of), len(rows)),
    ]


REPORTS: dict[str, Callable[[Rows], Iterator[str]]] = {
    "clean": clean,
    "one": one,
    "several": several,
    "outside": outside,
    "positions": of_position,
    "invisible": invisible,
    "held-out": held_out,
    "faults": faults,
    "memory": memory,
}
