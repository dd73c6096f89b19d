"""The methods by name, ours first."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import accelcal
from accelcal.record import TumbleRecord
from accelcal.results.discovery import Discovery
from rivals.answer import Answer, chosen
from rivals.dictionary import Dictionary, dictionary_of, distinct, thinned
from rivals.packages import frols, lasso_cv, stlsq
from rivals.stepwise import stepwise

OURS = "accelcal discover"


Choice = Callable[[Dictionary], list[int]]

RIVALS: dict[str, tuple[str, Callable[[Dictionary], Dictionary], Choice]] = {
    "EBIC stepwise": ("", distinct, lambda given: stepwise(given, extended=True)),
    "BIC stepwise": ("", lambda full: full, lambda given: stepwise(given, extended=False)),
    "LassoCV": ("sklearn", thinned, lasso_cv),
    "FROLS with BIC": ("sysidentpy", thinned, frols),
    "STLSQ": ("pysindy", thinned, stlsq),
}
"""Name -> the package it needs, what it takes of the dictionary, and what it chooses."""

METHODS = (OURS, *RIVALS)

_ENGINE = import_module("accelcal.discovery.look")
_simulated = _ENGINE.with_rates
_shared: dict[object, Any] = {}


def is_installed(method: str) -> bool:
    """Whether the package of a method is there."""
    package = RIVALS[method][0] if method in RIVALS else ""
    return not package or find_spec(package) is not None


def answer(method: str, record: TumbleRecord) -> Answer:
    """Ask a method about a record."""
    if method == OURS:
        return _ours(accelcal.discover(record))
    _, takes, chooses = RIVALS[method]
    given = takes(dictionary_of(record))
    return chosen([given.instances[place] for place in chooses(given)])


def share_the_null(*, shared: bool = True) -> None:
    """Simulate the noise anew for the next table of a design only, not for those after it.

    The false-alarm rates depend on the design, on the declared sizes, and on the kind of noise;
    tables that agree in these share them, of the memory it may have in finer steps than a stand.
    """
    _shared.clear()
    _ENGINE.with_rates = _with_rates if shared else _simulated


def _with_rates(family: Any, seed: int) -> Any:
    key = family.null, round(max(family.comparison.noise.possible, default=0.0), 1)
    if key not in _shared:
        _shared[key] = _simulated(family, seed)
    return family.with_rates_of(_shared[key])


def _ours(found: Discovery) -> Answer:
    before, after = found.before.heldout_rms, found.after.heldout_rms
    return Answer(
        names=tuple(item.id for item in found.effects),
        sets=tuple(frozenset([item.id, *item.indistinguishable]) for item in found.effects),
        unknown=found.unexplained is not None,
        faults=tuple(fault.id for fault in found.faults),
        undetectable=frozenset(item.id for item in found.undetectable),
        doubted=frozenset(found.doubtful),
        gap=None if before is None or after is None else (before, after),
    )
