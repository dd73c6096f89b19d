"""What a comparison says as a whole: agree, disagree, or no verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from accelcal.numerics.probability import LEVEL, student_quantile, student_survival
from accelcal.plural import are, listed
from accelcal.results.quantity import ErrorSource, Quantity

__all__ = ["ALPHA"]

ALPHA = 0.01
"""Chance of noise below which what is compared disagrees."""

HIDING = 5e-3
"""Noise of a reading [g], or error of a head position [rad], beside which nothing agrees; as large
as that may be what nothing tells."""

HIDING_HEAT = 1.0
"""Error of a temperature [degC] that may be there where nothing tells it."""

NOISE = "the noise of a reading"
"""What explains differences where few readings tell their noise."""

OF_CALIBRATION = "reading of the calibration"
"""Name of the noise of a reading in the worst run of a calibration."""


def verdict_of(p_value: float, hidden_by: str, *, explained: bool = False) -> str:
    """Say what a comparison comes to: ``"agree"``, ``"disagree"`` or ``"no verdict"``.

    `hidden_by` tells why differences may be there unseen, empty where they would be seen;
    `explained`, whether errors that nothing tells may have made all of them.

    Examples
    --------
    >>> verdict_of(1e-5, ""), verdict_of(0.4, ""), verdict_of(0.4, "reading 31 mg")
    ('disagree', 'agree', 'no verdict')
    """
    if p_value < ALPHA:
        return "no verdict" if explained else "disagree"
    return "no verdict" if hidden_by else "agree"


def chance_of(change: Quantity, dof: float = math.inf) -> float:
    """Chance of a change as large where there is none, by Student's distribution.

    Its degrees of freedom are those of the change, `dof` at most, by which the interval of 95 % is
    as wide as it is. It is 1 where the change has no value or no uncertainty.

    Examples
    --------
    >>> round(chance_of(Quantity(1.96e-5, 1e-5, "g", 1.96e-5)), 3)
    0.05
    """
    if change.value is None or not change.expanded_uncertainty:
        return 1.0
    fewest = min(change.dof or math.inf, dof)
    score = abs(change.value) / change.expanded_uncertainty * student_quantile(LEVEL, fewest)
    return 2.0 * student_survival(score, fewest)


def chance_if_known(change: Quantity) -> float:
    """Chance of a change as many of its U from 0, were U that of known errors.

    Where `chance_of` is far larger, few degrees of freedom are why.

    Examples
    --------
    >>> change = Quantity(1e-4, 1e-6, "g", 1.27e-5, dof=1.0)
    >>> round(chance_of(change), 3), chance_if_known(change) < 1e-6
    (0.006, True)
    """
    return chance_of(replace(change, dof=None))


def least_of(chances: Sequence[float]) -> float:
    """Least of several chances, honest for their number (Bonferroni); 1 of none.

    Examples
    --------
    >>> least_of([0.01, 0.8])
    0.02
    """
    return min([1.0, *(len(chances) * chance for chance in chances)])


def hidden_by_errors(sources: Iterable[ErrorSource]) -> str:
    """Say which errors are so large that faults of the readings made them; empty where none is.

    Examples
    --------
    >>> hidden_by_errors([ErrorSource("reading", 3.1e-2, "g", 45.0, "replicates")])
    'errors of this size hide disagreements: reading 31 mg'
    """
    found = [
        f"{own.name} {1e3 * (own.value or 0.0):.3g} m{own.unit}"
        for own in sources
        if own.name in ("reading", OF_CALIBRATION, "head")
        and own.source != "declared"
        and (own.value or 0.0) > HIDING
    ]
    return f"errors of this size hide disagreements: {listed(found)}" if found else ""


def explained_by_errors(names: Sequence[str]) -> str:
    """Say which errors or coefficients may have made all differences; empty where none may.

    Examples
    --------
    >>> told, effect = explained_by_errors(["launch_uncertainty"]).split(", ")
    >>> told
    'launch_uncertainty is not known well enough (declare it in both tests)'
    >>> effect
    'which may explain all differences'
    """
    errors = [name for name in names if name.endswith("_uncertainty")]
    noise = [name for name in names if name == NOISE]
    coefficients = [name for name in names if name not in (*errors, *noise)]
    it = "it" if len(errors) == 1 else "them"
    reasons = {
        f"known well enough (declare {it} in both tests)": errors,
        "known well enough (repeat strokes)": noise,
        "determined by the calibration (measure more positions)": coefficients,
    }
    told = [f"{listed(own)} {are(own)} not {why}" for why, own in reasons.items() if own]
    return f"{', '.join(told)}, which may explain all differences" if told else ""
