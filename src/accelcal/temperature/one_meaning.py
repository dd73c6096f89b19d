"""Tables of one mounting in which K0, K1 and M mean the same: those that temperature laws are of.

At few positions a coefficient absorbs another one, as K1 absorbs K3 at four of them. Where other
tables of the mounting tell that one by itself, its error term takes it off again, as k2, k3 and
delta_ip are the same at all temperatures in the paper's model.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Iterator, Mapping, Sequence

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.reversal import Linearised, adjusted
from accelcal.estimate.tables import PreparedTable
from accelcal.model import COEFFICIENTS, ERROR_TERMS, LAW_COEFFICIENTS
from accelcal.plural import listed, named


def telling_laws(estimate: JointEstimate) -> list[bool]:
    """Which tables determined all of `LAW_COEFFICIENTS`."""
    return [set(LAW_COEFFICIENTS) <= set(names) for names in estimate.names]


def tables_of_one_mounting(
    tables: Sequence[PreparedTable], estimate: JointEstimate, axis: str = ""
) -> list[int]:
    """Choose tables that mean the same by K0, K1 and M: one mounting, the same things absorbed.

    Of several such sets it is the one with most tables. What `with_one_meaning` takes off the
    coefficients does not count. With an axis, ``"o"`` or ``"p"``, only mountings count that have it
    along the shaft.
    """
    found: dict[tuple[object, ...], list[int]] = {}
    told, meanings = telling_laws(estimate), _meanings(tables, estimate)
    for index, (table, own) in enumerate(zip(tables, meanings, strict=True)):
        if told[index] and table.mounting.startswith(axis):
            meaning = (own.get(name) for name in LAW_COEFFICIENTS)
            found.setdefault((table.mounting, *meaning), []).append(index)
    return max(found.values(), key=len, default=[])


def with_one_meaning(tables: Sequence[PreparedTable], estimate: JointEstimate) -> JointEstimate:
    """Take off K0, K1 and M what they absorb, where other tables of the mounting tell it.

    With these coefficients their error components change. It is the same object where nothing can
    be taken off.

    Notes
    -----
    A table tells K1 (1 + sum s k) where K1 absorbs the shares s of other coefficients, whose error
    terms k = K/K1 are the means over the tables that tell them by themselves; and K0 + K1 sum s k,
    with the shares of K0, M likewise.
    """
    alone: dict[tuple[int, str], Linearised] = {}
    for index, tellers in _to_mend(tables, estimate):
        absorbed = _absorbed(tables[index], estimate, tellers)
        for name in (name for name in LAW_COEFFICIENTS if name in estimate.stands_for[index]):
            alone[index, name] = _alone(estimate, index, name, absorbed)
    if not alone:
        return estimate
    changes = [new - Linearised.of(estimate, *of) for of, new in alone.items()]
    found = adjusted(estimate, list(alone), Linearised.of_tables(changes))
    return found._replace(stands_for=_meanings(tables, estimate))


def _alone(
    estimate: JointEstimate, table: int, name: str, absorbed: Mapping[str, Linearised]
) -> Linearised:
    """A coefficient without the error terms that it and K1 absorb, each with its share."""
    told = Linearised.of(estimate, table, "K1")
    scale_factor = told / absorbed["K1"].plus(1.0) if "K1" in absorbed else told
    if name == "K1":
        return scale_factor
    return Linearised.of(estimate, table, name) - scale_factor * absorbed[name]


def _absorbed(
    table: PreparedTable, estimate: JointEstimate, tellers: Mapping[str, Sequence[int]]
) -> dict[str, Linearised]:
    """Sums of the error terms that coefficients absorb, each with its share."""
    found: dict[str, Linearised] = {}
    for lost, own in tellers.items():
        told = ((Linearised.of(estimate, i, name) for name in (lost, "K1")) for i in own)
        term = functools.reduce(operator.add, (a / k1 for a, k1 in told)).times(1.0 / len(own))
        for name, share in table.estimability.shares[lost].items():
            part = term.times(share)
            found[name] = found[name] + part if name in found else part
    return found


def said_of_meanings(tables: Sequence[PreparedTable], estimate: JointEstimate) -> Iterator[str]:
    """Say what the laws take off coefficients that absorb others, and which runs they leave out."""
    meanings, chosen = _meanings(tables, estimate), tables_of_one_mounting(tables, estimate)
    if not chosen:
        return
    mended = [i for i in chosen if estimate.stands_for[i] != meanings[i]]
    if mended:
        yield _taken_off(tables, estimate, mended)
    for index, table in enumerate(tables):
        alike = table.mounting == tables[chosen[0]].mounting and index not in chosen
        for name in LAW_COEFFICIENTS if alike else ():
            own, theirs = (meanings[i].get(name, name) for i in (index, chosen[0]))
            if name in estimate.names[index] and own != theirs:
                yield (
                    f"the temperature laws leave out run {table.run_label}, whose {name} stands for"
                    f" {own} and not for {theirs}; measure the same positions at every temperature"
                )
                break


def _taken_off(
    tables: Sequence[PreparedTable], estimate: JointEstimate, mended: Sequence[int]
) -> str:
    tellers = dict(_to_mend(tables, estimate))
    terms = [ERROR_TERMS[lost] for lost in COEFFICIENTS if any(lost in tellers[i] for i in mended)]
    by = [table for i in mended for own in tellers[i].values() for table in own]
    meanings = dict.fromkeys(
        f"{name} stands for {what}" for i in mended for name, what in estimate.stands_for[i].items()
    )
    return (
        f"{_runs(tables, mended)}: {', '.join(meanings)}; for the temperature laws, what"
        f" {_runs(tables, sorted(by))} told of {listed(terms)} is taken off, as the same at"
        " all temperatures"
    )


def _runs(tables: Sequence[PreparedTable], places: Sequence[int]) -> str:
    return named("run", dict.fromkeys(tables[i].run_label for i in places))


def _meanings(
    tables: Sequence[PreparedTable], estimate: JointEstimate
) -> tuple[Mapping[str, str], ...]:
    """What the coefficients of each table stand for, once all is taken off that can be."""
    found = list(estimate.stands_for)
    for index, _ in _to_mend(tables, estimate):
        own = found[index].items()
        found[index] = {n: what for n, what in own if n not in LAW_COEFFICIENTS}
    return tuple(found)


def _to_mend(
    tables: Sequence[PreparedTable], estimate: JointEstimate
) -> Iterator[tuple[int, dict[str, list[int]]]]:
    """Tables that can be mended: what is taken off, and the tables that tell each of it."""
    for index, (table, told) in enumerate(zip(tables, telling_laws(estimate), strict=True)):
        own = set(estimate.stands_for[index]) & set(LAW_COEFFICIENTS)
        if not own or not told:
            continue
        shares = table.estimability.shares
        lost = [name for name, by in shares.items() if own & set(by)]
        tellers = {name: _telling(tables, estimate, table.mounting, name) for name in lost}
        if tellers and all(tellers.values()):
            yield index, tellers


def _telling(
    tables: Sequence[PreparedTable], estimate: JointEstimate, mounting: str, name: str
) -> list[int]:
    """Tables of a mounting that tell a coefficient and K1, each by itself."""
    return [
        i
        for i, table in enumerate(tables)
        if table.mounting == mounting
        and {name, "K1"} <= set(estimate.names[i])
        and not {name, "K1"} & set(estimate.stands_for[i])
    ]
