"""What calibrations say against the limits of a data sheet: the rule by which each is judged.

A limit passes where the interval value +- w lies within it, fails where that interval lies outside,
and is undecided where the interval straddles it; w is the guard band of the decision rule. Where
the uncertainty is unknown, a value beyond its limit fails and one within stays undecided, except by
simple acceptance. What a tumble test does not tell is "not tested", and never passes. The rule
takes many calibrations of one plan as it takes one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Ints, Mask
from accelcal.errors import InputError
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.model import LAWS
from accelcal.results.verdict import OUTCOMES
from accelcal.specification import PLACES, QUANTITIES, RULES, Limit, Specification

Place = int | str | None
"""Where a quantity is found: a table by its index, a term of the laws by its name, or nowhere."""

ANOTHER_TEST = MappingProxyType(
    {  # symbol -> what tests it, and the error source of the calibration that comes near it
        "k0L": ("it takes repeated launches, see accelcal stability", "launch"),
        "k0D": ("it takes a record over the time of a launch, see accelcal stability", None),
        "k0F": ("it takes a record over the time of a launch, see accelcal stability", None),
        "p": ("it takes inputs of the size of the threshold", None),
        "k1": ("it takes calibrations repeated over its time", "launch_sf"),
    }
)
"""Symbols of what no tumble test tells."""

_LAWS = {law: law for law in LAWS} | {symbol: law for law, symbol in LAWS.items()}
_OF_AN_AXIS = frozenset({"delta", "gam", "delta_ip"})  # the cross axis in the plane has its own

SECOND_AXIS = "second axis "
"""Before a term of the laws: of the other axis along the shaft, which has a misalignment too."""

_FAIL, _UNDECIDED, _NOT_TESTED, _PASS = map(
    OUTCOMES.index, ("fail", "undecided", "not tested", "pass")
)

_TENS = np.array([10.0**decimals for decimals in range(23)])  # those that a double holds exactly


class Found(NamedTuple):
    """A quantity in R calibrations.

    Attributes
    ----------
    value : ndarray, shape (R,)
        What was found; NaN where nothing was.
    expanded : ndarray, shape (R,)
        Its expanded uncertainty (95 %); NaN where unknown.
    """

    value: Array
    expanded: Array


class Measured(NamedTuple):
    """What limits ask of R calibrations by one plan.

    Attributes
    ----------
    output_unit : str or None
        Output unit.
    mountings : sequence of str
        Mounting of each table.
    temperatures : ndarray, shape (R, tables)
        Temperature of each table; NaN where unknown [degC].
    reference : ndarray, shape (R,)
        T0; NaN where unknown [degC].
    quantity : callable
        Symbol and place -> what was found there, such as ``("K1", 0)`` and ``("k0", "k0 at_T0")``.
    """

    output_unit: str | None
    mountings: Sequence[str]
    temperatures: Array
    reference: Array
    quantity: Callable[[str, int | str], Found]


class Conformity(NamedTuple):
    """How R calibrations stand to a limit in one place.

    Attributes
    ----------
    limit : Limit
        The limit.
    symbol : str
        Symbol of the quantity.
    place : int, str or None
        Where it was looked for.
    holds : ndarray of bool, shape (R,)
        Which of the calibrations are judged in this place.
    outcome : ndarray of int, shape (R,)
        Places in `OUTCOMES`.
    """

    limit: Limit
    symbol: str
    place: Place
    holds: Mask
    outcome: Ints


def conformity(specification: Specification, measured: Measured) -> Iterator[Conformity]:
    """Judge calibrations by all limits of a data sheet.

    Yields
    ------
    Conformity
        In the order of the limits; one for each place where any calibration is judged.
    """
    guard_band = RULES[specification.rule].guard_band
    for limit in specification.limits:
        for symbol, place, holds in _places(limit, measured):
            if holds.any():
                outcome = _outcome(limit, symbol, place, measured, guard_band)
                yield Conformity(limit, symbol, place, holds, outcome)


# -- where a limit holds ---------------------------------------------------------------------------


def _places(limit: Limit, measured: Measured) -> Iterator[tuple[str, Place, Mask]]:
    """Symbol and place of all that a limit is about, and the calibrations where it is."""
    symbol, per = QUANTITIES[limit.name].symbol, QUANTITIES[limit.name].per
    everywhere = np.ones(measured.reference.shape, dtype=np.bool_)
    if symbol in ANOTHER_TEST or symbol == "T":
        yield symbol, None, everywhere
    elif symbol == "h_T":
        yield symbol, "hysteresis", everywhere
    elif per == "degC":
        for law in _laws(symbol, measured.mountings):
            yield f"{symbol}1", f"{law} above", everywhere
            yield f"{symbol}2", f"{law} below", everywhere
    elif limit.at == PLACES[0]:
        yield from _at_reference(symbol, measured)
    else:
        yield from ((symbol, table, everywhere) for table in range(len(measured.mountings)))


def _at_reference(symbol: str, measured: Measured) -> Iterator[tuple[str, Place, Mask]]:
    """The law where it is that of all tables at T0, else these tables, else a table alone."""
    at = np.abs(measured.temperatures - measured.reference[:, None]) <= SAME_LEVEL
    of_law = np.zeros(measured.reference.shape, dtype=np.bool_)
    if symbol in _LAWS:
        known = ~np.isnan(measured.quantity(symbol, f"{_LAWS[symbol]} at_T0").value)
        of_law = known & (_mountings_at(at, measured.mountings) < 2)
        for law in _laws(symbol, measured.mountings):
            yield symbol, f"{law} at_T0", of_law
    at |= at.shape[1] == 1
    for table in range(at.shape[1]):
        yield symbol, table, at[:, table] & ~of_law
    own = np.array([m[0] if symbol in _OF_AN_AXIS else "" for m in measured.mountings])
    met = np.all([at[:, own == axis].any(axis=1) for axis in set(own)], axis=0)
    yield symbol, None, ~met & ~of_law


def _laws(symbol: str, mountings: Sequence[str]) -> list[str]:
    """Law of a symbol, and that of the second axis where it is another quantity there."""
    has_two = symbol in _OF_AN_AXIS and len({mounting[0] for mounting in mountings}) > 1
    return [_LAWS[symbol], SECOND_AXIS + _LAWS[symbol]] if has_two else [_LAWS[symbol]]


def _mountings_at(at: Mask, mountings: Sequence[str]) -> Ints:
    """Number of mountings among some tables, shape (R,)."""
    own = np.array(mountings)
    among = [at[:, own == mounting].any(axis=1) for mounting in set(mountings)]
    return np.asarray(np.sum(among, axis=0))


# -- what that means -------------------------------------------------------------------------------


def _outcome(
    limit: Limit, symbol: str, place: Place, measured: Measured, guard_band: float
) -> Ints:
    if symbol == "T":
        return _operating_temperatures(limit, measured.temperatures)
    if place is None or not is_comparable(limit, measured.output_unit):
        return np.full(measured.reference.shape, _NOT_TESTED)
    factor = limit.factor(measured.output_unit)
    value, expanded = (in_unit(part, factor) for part in measured.quantity(symbol, place))
    return _decided(limit, value, expanded, guard_band)


def is_comparable(limit: Limit, output_unit: str | None) -> bool:
    """Tell whether a limit is in a unit that readings can be turned into.

    Returns
    -------
    bool
        False for a scale factor of another kind of output.

    Examples
    --------
    >>> from accelcal import Limit
    >>> limit = Limit("scale_factor", "mA/g", maximum=1.5)
    >>> [is_comparable(limit, unit) for unit in ("uA", "V", None)]
    [True, False, False]
    """
    if QUANTITIES[limit.name].kind != "output":
        return True
    try:
        limit.factor(output_unit)
    except InputError:
        return False
    return output_unit is not None


def in_unit(values: Array, factor: float) -> Array:
    """Convert values to the unit of a limit.

    Parameters
    ----------
    values : ndarray
        Values in the unit of a calibration; NaN where unknown.
    factor : float
        Of `Limit.factor`.

    Returns
    -------
    ndarray
        The same in the unit of the limit, by 12 digits from 1e-11 to 1e12, so that 500e-6 is
        500 ppm and not a little more.

    Examples
    --------
    >>> in_unit(np.array([500e-6, 1.0 / 3.0]), 1e-6).tolist()
    [500.0, 333333.333333]
    """
    found = np.asarray(values / factor)
    size = np.abs(found)
    decimals = 11.0 - np.floor(np.log10(np.where(size > 0.0, size, 1.0)))
    usual = (decimals >= 0.0) & (decimals < _TENS.size)
    tens = _TENS[np.where(usual, decimals, 0.0).astype(np.intp)]
    return np.where(usual, np.rint(found * tens) / tens, found)


def _decided(limit: Limit, value: Array, expanded: Array, guard_band: float) -> Ints:
    unknown = np.isnan(expanded)
    is_sure = ~unknown | (guard_band == 0.0)
    width = guard_band * np.where(unknown, 0.0, expanded)
    low, high = value - width, value + width
    kept = np.where(limit.kept_by(low, high) & is_sure, _PASS, _UNDECIDED)
    decided = np.where(limit.broken_by(low, high), _FAIL, kept)
    return np.where(np.isnan(value), _NOT_TESTED, decided)


def _operating_temperatures(limit: Limit, temperatures: Array) -> Ints:
    """Pass where the test went to both ends; the accelerometer is tested no further than that."""
    assert limit.minimum is not None
    assert limit.maximum is not None
    to_low = (temperatures <= limit.minimum + SAME_LEVEL).any(axis=1)
    to_high = (temperatures >= limit.maximum - SAME_LEVEL).any(axis=1)
    return np.where(to_low & to_high, _PASS, _NOT_TESTED)
