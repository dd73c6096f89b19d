"""A verdict: what was found against each limit of a data sheet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NoReturn

from accelcal.errors import InputError
from accelcal.escapes import visible
from accelcal.plural import counted
from accelcal.results.documents.checked import Kind, checked, list_of, one_of
from accelcal.results.documents.fields import Document, StoredPart, document_of, members
from accelcal.results.tabular import TabularResult

__all__ = ["OUTCOMES", "Judgement", "Verdict"]

OUTCOMES = ("fail", "undecided", "not tested", "pass")
"""Outcomes of a limit, the worst first; that of the whole is the worst of its limits."""


@dataclass(frozen=True, slots=True)
class Judgement(StoredPart):
    """What was found against one limit in one place.

    Attributes
    ----------
    limit, symbol : str
        Name of the limit and symbol of the quantity.
    where : str
        The temperature, the run, or the side of T0.
    outcome : str
        One of `OUTCOMES`.
    unit : str
        Unit of all numbers here, that of the data sheet.
    minimum, maximum : float or None
        The limit.
    value, expanded_uncertainty : float or None
        What was found, and half the width of its 95 % interval; None where unknown.
    probability : float or None
        Probability that the true value keeps the limit; None where the uncertainty is unknown.
    remark : str
        Why it was not tested, or what else must be known.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"outcome": one_of(*OUTCOMES)}

    limit: str
    symbol: str
    where: str
    outcome: str
    unit: str
    minimum: float | None
    maximum: float | None
    value: float | None = None
    expanded_uncertainty: float | None = None
    probability: float | None = None
    remark: str = ""


@dataclass(frozen=True, slots=True)
class Verdict(StoredPart, TabularResult):
    """What was found against a data sheet, limit by limit.

    Attributes
    ----------
    specification, source : str
        Name of the data sheet, and where it was printed.
    rule, rule_statement : str
        Name of the decision rule, and the rule in words.
    judgements : tuple of Judgement
        In the order of the data sheet; a limit has one for each place where it holds.
    notes : tuple of str
        Checks of the calibration that warn, and what it says that its uncertainties do not count:
        what passes by them may be in doubt nevertheless.

    Raises
    ------
    InputError
        If it is asked for its truth, as by ``if verdict:``: a verdict that failed would pass there.

    Examples
    --------
    >>> import accelcal
    >>> limit = accelcal.Limit("bias", "mg", maximum=5.0)
    >>> sheet = accelcal.Specification("AL-15", (limit,))
    >>> verdict = accelcal.judge(accelcal.fit(accelcal.simulate(seed=1)), sheet)
    >>> verdict.outcome, verdict.judgements[0].symbol
    ('pass', 'k0')
    """

    _MISSING: ClassVar[Mapping[str, Any]] = {"notes": ()}

    specification: str
    source: str
    rule: str
    rule_statement: str
    judgements: tuple[Judgement, ...]
    notes: tuple[str, ...] = ()

    @property
    def outcome(self) -> str:
        """The worst outcome of all."""
        return min((j.outcome for j in self.judgements), key=OUTCOMES.index)

    def __bool__(self) -> NoReturn:
        raise InputError(
            "a verdict is neither true nor false, as a limit may be undecided or not tested; ask"
            f" verdict.outcome == 'pass' (it is {self.outcome!r})"
        )

    def __repr__(self) -> str:
        limits = counted(len(self.judgements), "limit")
        return visible(f"<Verdict {self.specification}: {self.outcome}, {limits}>")

    def rows(self) -> list[dict[str, Any]]:
        """List the judgements, a flat dictionary each."""
        return [judgement.to_document() for judgement in self.judgements]

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "specification source rule rule_statement outcome"),
            "limits": document_of(self.judgements),
            "notes": list(self.notes),
        }

    @classmethod
    def _read(cls, document: Document) -> Verdict:
        judgements = checked(document, "limits", list_of(Judgement.from_document, 1))
        return cls._of_fields(document, judgements=judgements)
