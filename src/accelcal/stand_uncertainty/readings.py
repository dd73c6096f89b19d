"""The readings of a tumble test on a stand that errs: exact, with nothing expanded.

What the stand does wrong goes through a few **channels**. At head angle th with fixture angle d0,
in one mounting, all errors of a trial enter ::

    psi = th + d0 + turn                        true angle of the input axis
    up  = (cos tilt cos psi, cos tilt sin psi, sin tilt)    along the axes of the head
    a_i, a_cross, a_shaft                       up, leaned by `lean`, turned by `clock` about IA
    Y = K1(T) (1 + scale) [k0(T) + bias + a_i + k2 a_i^2 + k3 a_i^3 + delta(T) (a_cross + a_shaft)
                           + delta_ip a_i (a_cross + a_shaft)]
    reading = Y (1 + gain) + output

with T the temperature written down plus `temperature`. The misalignment and the cross-coupling
towards the axis along the shaft are taken as large as those towards the axis in the plane.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from accelcal.accelerometer import Accelerometer
from accelcal.apparatus import require_gravity_of_earth
from accelcal.arguments.kinds import several
from accelcal.arguments.numbers import check_number, check_number_or_none
from accelcal.arrays import Array, Numbers, Places
from accelcal.effects.conditions import Conditions, conditions_of
from accelcal.errors import InputError
from accelcal.estimate.at_positions import at_positions
from accelcal.geometry import accelerations, side_of
from accelcal.head_angles import head_positions
from accelcal.record import TumbleRecord
from accelcal.units import conversion_factor

__all__ = ["CHANNELS", "CLASSES", "SAME_VOLTAGE", "StandConditions", "StandReadings"]
__all__ += ["StandError", "readings_of"]


class StandError(InputError):
    """The description of the stand lacks what the test needs."""


CHANNELS = (
    "turn",
    "tilt",
    "lean",
    "clock",
    "temperature",
    "scale",
    "bias",
    "gain",
    "output",
    "gravity",
)
"""Where errors enter: angles [rad], temperature [degC], scale and gain [1], bias [g] ..."""

_CLASS_OF: Mapping[str, Callable[[StandReadings], ArrayLike]] = {
    "position": lambda r: head_positions(r.conditions.angle),
    "stroke": lambda r: r.conditions.stroke + 1e6 * r.conditions.run,
    "reading": lambda r: r.conditions.number,
    "run": lambda r: r.conditions.run,
    "temperature": lambda r: np.round(r.conditions.excess, 6),
    "mounting": lambda r: np.unique(r.record.mounting, return_inverse=True)[1],
    "axis": lambda r: np.unique(r.record.mounting.astype("U1"), return_inverse=True)[1],
    "range": lambda r: np.nan_to_num(r.range_of_reading),
    "voltage": lambda r: _voltages(r),  # defined below
}
"""Class -> a number for each reading, the same where an error is the same."""

CLASSES = tuple(_CLASS_OF)
"""For each different value of these a new error is drawn; a stroke is one of its run.

Readings within `SAME_VOLTAGE` of one another are at one voltage.
"""

_LARGEST = {"room_temperature": 1000.0, "load_coefficient": 0.1}

SAME_VOLTAGE = 0.005
"""Outputs closer than this are one voltage [of the output for 1 g]."""


@dataclass(frozen=True, slots=True)
class StandConditions:
    """What belongs to a stand without being an error.

    Attributes
    ----------
    local_gravity : float or None
        Local gravity [m/s^2].
    room_temperature : float
        Temperature around the chamber [degC].
    load : float or None
        Resistor on which a current is measured [ohm].
    load_coefficient : float
        Its temperature coefficient [1/degC].
    ranges : sequence of float
        Ranges of the voltmeter, of which each reading takes the smallest that holds it; kept as a
        tuple [V].

    Raises
    ------
    InputError
        If a number is not finite, has the wrong sign, or is beyond all that exists.
    """

    local_gravity: float | None = None
    room_temperature: float = 20.0
    load: float | None = None
    load_coefficient: float = 0.0
    ranges: Numbers = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "ranges", several(self.ranges))
        check_number_or_none(local_gravity=self.local_gravity, load=self.load)
        check_number(**{name: getattr(self, name) for name in _LARGEST})
        check_number(**{f"range {n}": size for n, size in enumerate(self.ranges, 1)})
        require_gravity_of_earth(self.local_gravity)
        if self.load is not None and not 1e-6 < self.load < 1e12:
            raise InputError(f"load is {self.load} ohm; it lies between 1e-6 and 1e12")
        for name in ("room_temperature", "load_coefficient"):
            if not abs(getattr(self, name)) < _LARGEST[name]:
                rule = f"its size is below {_LARGEST[name]:g}"
                raise InputError(f"{name} is {getattr(self, name)}; {rule}")
        if not all(1e-9 < size < 1e6 for size in self.ranges):
            raise InputError(f"ranges are {list(self.ranges)} V; each lies between 1e-9 and 1e6")


@dataclass(frozen=True, slots=True, eq=False)
class StandReadings:
    """The n readings of a test, ready to be simulated with any errors; arrays have shape (n,).

    Attributes
    ----------
    record : TumbleRecord
        The test; of its outputs nothing is used.
    accelerometer : Accelerometer
        The true coefficients.
    conditions : Conditions
        Angle, sense of rotation, temperature and time of each reading.
    input, cross : ndarray
        Cosine and sine of the angle of the input axis without errors.
    side : ndarray
        +1, or -1 in a reversed mounting.
    stand : StandConditions
        What belongs to the stand without being an error.
    delta0 : float
        Fixture angle [rad].
    volts : float or None
        Volt for one output unit; None where that is not known.
    range_of_reading : ndarray
        Range of the voltmeter [V]; NaN where none are given.
    """

    record: TumbleRecord
    accelerometer: Accelerometer
    conditions: Conditions
    input: Array
    cross: Array
    side: Array
    stand: StandConditions
    delta0: float
    volts: float | None
    range_of_reading: Array

    @property
    def temperature(self) -> Array:
        """Temperature written down [degC]."""
        return self.conditions.excess + self.accelerometer.reference_temperature

    @property
    def scale_factor(self) -> float:
        """Scale factor at T0 [output unit / g]."""
        return self.accelerometer.scale_factor.at_T0

    @property
    def unit(self) -> str | None:
        """Output unit."""
        return self.accelerometer.unit

    def output(self, errors: Mapping[str, Array]) -> Array:
        """Output of each reading with the errors of each channel.

        Parameters
        ----------
        errors : mapping of str to ndarray
            Channel -> errors, shape (..., n); channels left out have none.

        Returns
        -------
        ndarray, shape (..., n)
            Readings [output unit].
        """
        e = {name: errors.get(name, np.zeros(1)) for name in CHANNELS}
        a_i, across = self._accelerations(e)
        excess = self.conditions.excess + e["temperature"]
        indicated = self.accelerometer.indication(a_i, across, excess) + e["bias"]
        gain = (1.0 + self.accelerometer.scale_factor.change(excess)) * (1.0 + e["scale"])
        return self.scale_factor * gain * indicated * (1.0 + e["gain"]) + e["output"]

    def _accelerations(self, e: Mapping[str, Array]) -> tuple[Array, Array]:
        """Along the input axis, and along both cross axes together, by their equal coefficients."""
        cos, sin = np.cos, np.sin
        level = cos(e["tilt"])
        x = level * (self.input * cos(e["turn"]) - self.cross * sin(e["turn"]))
        y = level * (self.cross * cos(e["turn"]) + self.input * sin(e["turn"]))
        z = sin(e["tilt"])
        a_i = cos(e["lean"]) * x + sin(e["lean"]) * z
        z = cos(e["lean"]) * z - sin(e["lean"]) * x
        in_plane = cos(e["clock"]) * y + sin(e["clock"]) * z
        along_shaft = cos(e["clock"]) * z - sin(e["clock"]) * y
        return a_i, self.side * (in_plane + along_shaft)

    def groups(self, varies: Sequence[str]) -> tuple[Places, int]:
        """Number the independent errors of a component.

        Parameters
        ----------
        varies : sequence of str
            Of `CLASSES`; none for one error in the whole test.

        Returns
        -------
        index : ndarray of int, shape (n,)
            Which error each reading has.
        count : int
            How many there are.
        """
        own = (np.asarray(_CLASS_OF[name](self), dtype=np.float64) for name in varies)
        keys = np.column_stack([np.zeros(len(self.record)), *own])
        different, index = np.unique(keys, axis=0, return_inverse=True)
        return index.reshape(-1), different.shape[0]


def _voltages(readings: StandReadings) -> Array:
    """Number of the voltage at which each reading is, up from the lowest."""
    output = readings.output({}) / readings.scale_factor
    order = np.argsort(output)
    found = np.zeros(output.size)
    found[order[1:]] = np.cumsum(np.abs(np.diff(output[order])) > SAME_VOLTAGE)
    return found


def readings_of(
    record: TumbleRecord,
    accelerometer: Accelerometer,
    conditions: StandConditions,
    delta0: float = 0.0,
) -> StandReadings:
    """Make the readings of a test ready to be simulated.

    Parameters
    ----------
    record : TumbleRecord
        The test.
    accelerometer : Accelerometer
        The true coefficients.
    conditions : StandConditions
        Of the stand.
    delta0 : float, default 0
        Fixture angle [rad].

    Returns
    -------
    StandReadings
        The readings.

    Raises
    ------
    StandError
        If a reading is too large for the voltmeter.

    Examples
    --------
    >>> import accelcal
    >>> record = accelcal.simulate(noise=accelcal.NoiseComponents(0, 0, 0, 0), seed=1)
    >>> found = readings_of(record, accelcal.AL15, StandConditions())
    >>> bool(abs(found.output({}) - record.output).max() < 1e-12)
    True
    """
    record = at_positions(record, delta0)
    plane = accelerations(record.angle, delta0)  # of "o+": the cross axis is the pendulous one
    found = StandReadings(
        record=record,
        accelerometer=accelerometer,
        conditions=conditions_of(record, accelerometer.reference_temperature, delta0),
        input=plane.input,
        cross=plane.pendulous,
        side=np.array(list(map(side_of, record.mounting.tolist()))),
        stand=conditions,
        delta0=delta0,
        volts=_volts(accelerometer.unit, conditions.load),
        range_of_reading=np.full(len(record), np.nan),
    )
    if not conditions.ranges or found.volts is None:
        return found
    volts = np.abs(found.output({})) * found.volts
    return replace(found, range_of_reading=_range(volts, np.sort(conditions.ranges)))


def _volts(unit: str | None, load: float | None) -> float | None:
    """Volt for one output unit: as it is, or by Ohm's law; None where nothing tells."""
    if unit is None:
        return None
    as_volts, as_amperes = conversion_factor(unit, "V"), conversion_factor(unit, "A")
    if as_volts is not None:
        return as_volts
    return None if as_amperes is None or load is None else as_amperes * load


def _range(volts: Array, ranges: Array) -> Array:
    """Smallest range that holds each reading [V]."""
    if volts.max() > ranges[-1]:
        raise StandError(
            f"readings of up to {volts.max():.3g} V, above the largest range of the voltmeter,"
            f" {ranges[-1]:g} V; give all its ranges, or a smaller load"
        )
    return np.asarray(ranges[np.searchsorted(ranges, volts)])
