"""Uncertainties asked for, and whether a stand can have them at all."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

from accelcal.arguments.numbers import check_number
from accelcal.arguments.options import check_choice, mapping_of
from accelcal.errors import InputError
from accelcal.model import COEFFICIENTS, ERROR_TERMS, SLOPES
from accelcal.planning.prediction import AT_T0
from accelcal.results.designs import Forecast, TestDesign
from accelcal.units import scaled, size_of

NAMES = (*COEFFICIENTS, *ERROR_TERMS.values(), *AT_T0, *SLOPES, "delta0")
"""Everything of which an uncertainty can be asked for."""

_KINDS = ("acceleration", "angle", "ratio")


def target_value(text: str) -> float:
    """Read an uncertainty with its unit.

    Parameters
    ----------
    text : str
        As ``"5ppm"``, ``"2ug"``, ``"2e-6"``, ``"0.1ug/degC"``.

    Returns
    -------
    float
        The uncertainty in g, rad or parts of one, per power of g or per degree.

    Raises
    ------
    InputError
        If it is no positive number with such a unit.

    Examples
    --------
    >>> target_value("2 ug/g^2"), target_value("1e-7")
    (2e-06, 1e-07)
    """
    match = re.fullmatch(
        r"\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*([^\s/]*)(?:/(?:g\^?[23]?|degC))?\s*", text
    )
    size = size_of(match[2] or "1", *_KINDS) if match else None
    try:
        value = scaled(match[1], size) if match and size else math.nan
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise InputError(
            f"target {text!r} is no uncertainty; write a number above zero with g, mg, ug, ppm,"
            " rad, mrad, urad, arcsec or none, as in K1=5ppm"
        )
    return value


def checked_targets(targets: Mapping[str, float | str] | None) -> dict[str, float]:
    """Check names and sizes of the uncertainties asked for.

    Parameters
    ----------
    targets : mapping of str to float or str, or None
        Name -> standard uncertainty, a text as `target_value` reads it.

    Returns
    -------
    dict of str to float
        The same as numbers; empty for None.

    Raises
    ------
    InputError
        If a name is unknown or a size is not a positive number.
    """
    asked = mapping_of(targets, "targets", "{'K1': 5e-6}")
    found = {n: target_value(t) if isinstance(t, str) else t for n, t in asked.items()}
    for name, value in found.items():
        check_choice(NAMES, coefficient=name)
        check_number(**{f"target {name}": value})
        if not value > 0.0:
            raise InputError(f"target {name}={value:g}; an uncertainty is a number above zero")
    return found


def refuse_impossible(designs: Sequence[TestDesign], targets: Mapping[str, float]) -> None:
    """Refuse targets that no number of strokes reaches in any of some tests.

    Parameters
    ----------
    designs : sequence of TestDesign
        The tests.
    targets : mapping of str to float
        Name -> standard uncertainty.

    Raises
    ------
    InputError
        If a target is below the floors of all tests, or none of them tells its coefficient.
    """
    for name, limit in targets.items():
        told = [f for d in designs if (f := d.forecast(name)) is not None and not f.stands_for]
        if not told:
            raise InputError(
                f"{name} cannot be told by any of these tests; add positions, temperatures or"
                " mountings"
            )
        best = min(told, key=lambda f: f.floor)
        if best.floor > limit:
            raise InputError(_impossible(name, limit, best))


def _impossible(name: str, limit: float, best: Forecast) -> str:
    """Name the floor, and the source of error that makes most of it."""
    parts = {s: size**2 for s, size in best.budget.items() if s not in ("reading", "resolution")}
    parts["reading"] = best.floor**2 - sum(parts.values())
    source = max(parts, key=parts.__getitem__)
    unit = "" if best.unit == "1" else f" {best.unit}"
    remedy = _REMEDIES.get(source, f"repeat runs or better the {source}")
    return (
        f"target {name}={limit:.3g} cannot be reached with this stand: {best.floor:.3g}{unit} is"
        f" its floor, with a hundred times the strokes, of which {source} makes"
        f" {parts[source] ** 0.5:.3g}; {remedy}"
    )


_REMEDIES = {
    "reading": "add positions or quiet the readings",
    "head": "add positions or better the head",
}
