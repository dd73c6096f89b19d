"""Uncertainties asked for, and whether a stand can have them at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from accelcal.arguments.numbers import check_number
from accelcal.arguments.options import check_choice, mapping_of
from accelcal.errors import InputError
from accelcal.model import COEFFICIENTS, ERROR_TERMS, ERROR_UNITS, SLOPES, law_units
from accelcal.planning.prediction import AT_T0
from accelcal.results.designs import Forecast, TestDesign
from accelcal.shown_units import in_small_unit
from accelcal.targets import target_size

NAMES = (*COEFFICIENTS, *ERROR_TERMS.values(), *AT_T0, *SLOPES, "delta0")
"""Everything of which an uncertainty can be asked for."""


def target_value(name: str, text: str) -> float:
    """Read an uncertainty of one of `NAMES` with its unit, such as ``"5ppm"`` or ``"0.1ug/degC"``.

    It is in g, rad or parts of one, per power of g or per degree.

    Raises
    ------
    InputError
        If there is no such name, it is no positive number with a unit of that, or a number so large
        that its unit was forgotten.

    Examples
    --------
    >>> target_value("K2", "2 ug/g^2"), target_value("K1", "1e-7")
    (2e-06, 1e-07)
    >>> target_value("K1", "1 ug")
    Traceback (most recent call last):
    accelcal.errors.InputError: target K1='1 ug', and K1 is relative; write a number above zero \
with %, ppm, ppb or none, as in K1=5ppm
    """
    check_choice(NAMES, coefficient=name)
    return target_size(name, text, _unit_of(name))


def _unit_of(name: str) -> str:
    """Unit of an uncertainty; that of K1 is a part of it, and other coefficients are over K1."""
    if name in SLOPES:
        return law_units()[SLOPES[name][0]][1]
    if name in AT_T0:
        return AT_T0[name][1]
    units = {**ERROR_UNITS, "K1": "1", "delta0": "rad"}
    return units[ERROR_TERMS.get(name, name)]


def checked_targets(targets: Mapping[str, float | str] | None) -> dict[str, float]:
    """Check names and sizes of the uncertainties asked for, and give them as numbers.

    A text is one that `target_value` reads; there are none for None.

    Raises
    ------
    InputError
        If a name is unknown or a size is not a positive number.
    """
    asked = mapping_of(targets, "targets", "{'K1': 5e-6}")
    for name in asked:
        check_choice(NAMES, coefficient=name)
    found = {n: target_value(n, t) if isinstance(t, str) else t for n, t in asked.items()}
    for name, value in found.items():
        check_number(**{f"target {name}": value})
        if not value > 0.0:
            raise InputError(f"target {name}={value:g}; an uncertainty is a number above zero")
    return found


def refuse_impossible(designs: Sequence[TestDesign], targets: Mapping[str, float]) -> None:
    """Refuse targets that no number of strokes reaches in any of some tests.

    Raises
    ------
    InputError
        If a target is below the floors of all tests, or none of them tells its coefficient.
    """
    for name, limit in targets.items():
        told = [f for d in designs if (f := d.forecast(name)) is not None and not f.stands_for]
        if not told:
            raise InputError(
                f"{name} cannot be told by any of these tests; add positions, temperatures,"
                " mountings or hours"
            )
        best = min(told, key=lambda f: f.floor)
        if best.floor > limit:
            raise InputError(_impossible(name, limit, best))


def _impossible(name: str, limit: float, best: Forecast) -> str:
    """Name the floor, and the source of error that makes most of it."""
    parts = {s: size**2 for s, size in best.budget.items() if s not in ("reading", "resolution")}
    parts["reading"] = best.floor**2 - sum(parts.values())
    source = max(parts, key=parts.__getitem__)
    factor, unit = in_small_unit(best.unit)
    remedy = _REMEDIES.get(source, "repeat runs, or make this error smaller")
    return (
        f"target {name}={factor * limit:.3g}{unit} cannot be reached with this stand:"
        f" {factor * best.floor:.3g} {unit} is its floor, with a hundred times the strokes, of"
        f" which {source} makes {factor * parts[source] ** 0.5:.3g}; {remedy}"
    )


_REMEDIES = {
    "reading": "add positions, or make the readings less noisy",
    "head": "add positions, or take a better head",
}
