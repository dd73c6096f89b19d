"""The kinds of error that a stand can have: where each acts, in which pattern, in which units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.stand_uncertainty.readings import StandError, StandReadings
from accelcal.units import DAY, UNITS, size_of


class ErrorQuantity(NamedTuple):
    """What the size of an error is."""

    name: str  # what it is called, with its article
    unit: str  # unit in which it is calculated
    largest: float  # standard uncertainty in this unit that no instrument reaches
    kinds: tuple[str, ...]  # what its unit may be a unit of, of `accelcal.units.UNITS`
    # what may stand behind a stroke of its unit, with its size; empty where nothing does
    per: Mapping[str, float] = MappingProxyType({})

    def size(self, unit: str) -> float | None:
        """Size of a unit as written in `unit`; None where it is none of the quantity."""
        numerator, _, behind = unit.partition("/") if self.per else (unit, "", "")
        whole = self.per.get(behind.strip()) if self.per else 1.0
        size = size_of(numerator, *self.kinds) if numerator.strip() else None
        return None if size is None or whole is None else size * whole

    @property
    def units(self) -> str:
        """Units in which it may be written."""
        behind = [f"/{name}" for name in self.per] or [""]
        names = [name for kind in self.kinds for name in UNITS[kind]]
        return ", ".join(name + per for per in behind for name in names)


ERROR_QUANTITIES: Mapping[str, ErrorQuantity] = MappingProxyType(
    {
        # an angle error acts on a horizontal input axis as so many g: 1 rad is 1 g
        "angle": ErrorQuantity("an angle", "rad", 0.1, ("angle", "acceleration")),
        "angle/day": ErrorQuantity(
            "an angle in time", "rad/day", 0.1, ("angle",), {"day": 1.0, "d": 1.0, "h": 24.0}
        ),
        "acceleration": ErrorQuantity("an acceleration", "g", 1.0, ("acceleration",)),
        "ratio": ErrorQuantity("a ratio", "1", 0.5, ("ratio",)),
        "temperature": ErrorQuantity("a temperature", "degC", 100.0, ("temperature difference",)),
        "voltage": ErrorQuantity("a voltage", "V", 1000.0, ("voltage",)),
    }
)
"""Quantity of a `accelcal.stand_uncertainty.kinds.Kind` -> what there is to know of it."""


def size_of_unit(unit: str, quantity: str, gravity: float | None = None) -> float:
    """Size of a unit as written, of one of `ERROR_QUANTITIES`.

    An acceleration may be given in m/s^2 where the local gravity is known [m/s^2].

    Raises
    ------
    InputError
        If it is none of the quantity, or of a gravity and this is not known.

    Examples
    --------
    >>> size_of_unit("ppm", "ratio"), size_of_unit("µrad", "angle")
    (1e-06, 1e-06)
    """
    found = ERROR_QUANTITIES[quantity]
    size = found.size(unit)
    if size is not None:
        return size
    metres = size_of(unit, "gravity") if "acceleration" in found.kinds else None
    if metres is None:
        raise InputError(f"unit {unit!r} is none of {found.name}; use {found.units}")
    if gravity is None:
        raise InputError(
            f"unit {unit!r} needs the local gravity; add gravity_m_per_s2 to [conditions], or use g"
        )
    return metres / gravity


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of error."""

    channel: str  # what it changes, one of `accelcal.stand_uncertainty.readings.CHANNELS`
    quantity: str  # what its size is, one of `accelcal.stand_uncertainty.kinds.ERROR_QUANTITIES`
    varies: tuple[str, ...]  # for what a new error is drawn, where the file does not say
    # from the readings, and the harmonic order, to the change of the channel per unit, of shape
    # (n, 1), or (n, 2) where an unknown phase makes two components
    pattern: Callable[[StandReadings, int], Array]


def _same(r: StandReadings, _: int) -> Array:
    return np.ones((len(r.record), 1))


def _wave(phase: Array) -> Array:
    return np.column_stack([np.cos(phase), np.sin(phase)])


def _volts(r: StandReadings, _: int) -> Array:
    if r.volts is None:
        raise StandError(
            f"the output is in {r.unit or 'no unit'}, and what a volt is in it is not known; add"
            " load_resistor_ohm to [conditions] for a current, or leave the voltmeter's"
            " offset, noise and resolution out"
        )
    return np.full((len(r.record), 1), 1.0 / r.volts)


def _ranges(r: StandReadings, order: int) -> Array:
    if np.isnan(r.range_of_reading).any():
        raise StandError(
            "an error in parts of the range needs the ranges of the voltmeter; add"
            " voltmeter_ranges_V and, for a current, load_resistor_ohm to [conditions]"
        )
    return _volts(r, order) * r.range_of_reading[:, None]


def _scaled(
    factor: Callable[[StandReadings], Array | float],
) -> Callable[[StandReadings, int], Array]:
    return lambda r, order: _same(r, order) * np.reshape(factor(r), (-1, 1))


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        # error of each head position
        "head-position": Kind("turn", "angle", ("position",), _same),
        # error of the head with `order` waves in a turn, of unknown phase: 1 is eccentricity
        "head-harmonic": Kind(
            "turn", "angle", (), lambda r, order: _wave(order * np.radians(r.conditions.angle))
        ),
        # half of the play of the drive: -b forward, +b back
        "backlash": Kind("turn", "angle", (), _scaled(lambda r: -r.conditions.rotation)),
        # angle between head zero and input axis, beyond the given d0; zero of the head against the
        # vertical
        "fixture-angle": Kind("turn", "angle", ("axis",), _same),
        # shaft of the head out of the horizontal: the level
        "shaft-tilt": Kind("tilt", "angle", (), _same),
        # input axis out of the plane of rotation
        "fixture-tilt": Kind("lean", "angle", ("axis",), _same),
        # accelerometer turned about its input axis
        "fixture-clocking": Kind("clock", "angle", ("axis",), _same),
        # tilt of the foundation in the plane of rotation, linear in time
        "foundation-drift": Kind(
            "turn", "angle/day", (), _scaled(lambda r: r.conditions.time / DAY)
        ),
        # tilt of the foundation in the plane of rotation, once a day, of unknown phase
        "foundation-daily": Kind(
            "turn", "angle", (), lambda r, _: _wave(2.0 * np.pi * r.conditions.time / DAY)
        ),
        # temperature of the accelerometer less that written down: sensor, stability, soak
        "chamber-temperature": Kind("temperature", "temperature", ("run",), _same),
        # the same in proportion to the distance from room temperature
        "chamber-gradient": Kind(
            "temperature", "ratio", (), _scaled(lambda r: r.temperature - r.stand.room_temperature)
        ),
        # relative error of the voltmeter
        "voltmeter-gain": Kind("gain", "ratio", (), _same),
        # zero of the voltmeter
        "voltmeter-offset": Kind("output", "voltage", (), _volts),
        # error in parts of the range in use: nonlinearity
        "voltmeter-range": Kind("output", "ratio", ("voltage", "range"), _ranges),
        # noise of a reading
        "voltmeter-noise": Kind("output", "voltage", ("reading",), _volts),
        # rounding: half a step, rectangular
        "voltmeter-resolution": Kind("output", "voltage", ("reading",), _volts),
        # relative error of the load
        "resistor-tolerance": Kind("gain", "ratio", (), _same),
        # change of the room's temperature, which changes the load by its coefficient
        "resistor-temperature": Kind(
            "gain", "temperature", ("run",), _scaled(lambda r: r.stand.load_coefficient)
        ),
        # declared less true local gravity, relative
        "local-gravity": Kind("gravity", "ratio", (), _same),
        # noise of the accelerometer in a reading
        "reading-noise": Kind(
            "output", "acceleration", ("reading",), _scaled(lambda r: r.scale_factor)
        ),
        # bias of the accelerometer from run to run
        "launch-bias": Kind("bias", "acceleration", ("run",), _same),
        # scale factor of the accelerometer from run to run
        "launch-scale-factor": Kind("scale", "ratio", ("run",), _same),
    }
)
"""Name -> kind, in the order of the signal: head, fixture, foundation, chamber, voltmeter ..."""
