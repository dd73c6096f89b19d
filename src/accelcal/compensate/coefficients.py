"""What a calibration gives to those who use the accelerometer: coefficients at any temperature."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.inversion import FARTHEST
from accelcal.compensate.propagation import Part, linear_sum, propagated
from accelcal.effects.static import Samples, StaticEffects
from accelcal.errors import InputError
from accelcal.model import CROSS_AXES, LAWS
from accelcal.results.covariance import Rows
from accelcal.results.quantity import Quantity
from accelcal.results.temperature import TemperatureLaw

__all__ = [
    "OF_ONE_AXIS",
    "PARAMETERS",
    "SLOPES",
    "Compensation",
    "CrossAxis",
    "Launch",
    "Law",
    "OtherAxis",
    "Slope",
    "symbol_of",
]

PARAMETERS = ("k0", "K1", "k2", "k3", "delta", "delta_ip")
"""Parameters at T0, first in the order of the covariance; that of K1 is relative."""

SLOPES = tuple(f"{name}_slope_{side}" for side in ("above", "below") for name in LAWS)
"""Their slopes, behind them in the covariance; those of K1 are relative."""

OF_ONE_AXIS = ("delta", "delta_ip", "delta_slope_above", "delta_slope_below")
"""Those of one cross axis, in the order of its covariance."""


def symbol_of(name: str, cross_axis: str) -> str:
    """Symbol in the error model (2) of one of `PARAMETERS` and `SLOPES`.

    Examples
    --------
    >>> symbol_of("delta_slope_above", "a_p"), symbol_of("delta_ip", "a_o"), symbol_of("k0", "a_o")
    ('delta_O_slope_above', 'delta_io', 'k0')
    """
    (own,) = (axis for axis in CROSS_AXES.values() if axis.acceleration == cross_axis)
    return own.coupling if name == "delta_ip" else name.replace("delta", own.misalignment)


@dataclass(frozen=True, slots=True)
class Slope:
    """Change of a parameter with temperature on one side of T0.

    Attributes
    ----------
    value : float
        The slope [per degC].
    standard_uncertainty : float
        Its standard uncertainty [per degC].
    determined : bool
        False where it was not measured, but taken from somewhere else.
    """

    value: float = 0.0
    standard_uncertainty: float = 0.0
    determined: bool = False

    @classmethod
    def of(cls, found: Quantity | None, other: Quantity | None) -> Slope:
        """Slope that was found; where there is none that of the other side, +- all of it."""
        if found is not None and found.value is not None:
            u = found.standard_uncertainty
            return cls(found.value, math.nan if u is None else u, determined=True)
        borrowed = 0.0 if other is None else other.value or 0.0
        return cls(borrowed, abs(borrowed))


@dataclass(frozen=True, slots=True)
class Law:
    """A parameter at T0 with its slopes above and below.

    Attributes
    ----------
    at_T0 : float
        Value at T0.
    above, below : Slope
        Slopes; those of K1 are relative.
    """

    at_T0: float
    above: Slope = Slope()
    below: Slope = Slope()

    @classmethod
    def of(cls, law: TemperatureLaw, name: str) -> Law:
        """Take the law of a parameter in plain numbers.

        Raises
        ------
        InputError
            If it has no value at T0.
        """
        if law.at_T0 is None or law.at_T0.value is None:
            raise InputError(f"the temperature law of {name} has no value at T0; choose one run")
        above, below = Slope.of(law.above, law.below), Slope.of(law.below, law.above)
        return cls(law.at_T0.value, above, below)

    def change(self, rise: Array) -> Array:
        """Slope times T - T0, in the unit of the slopes times degC."""
        return np.where(rise > 0.0, self.above.value, self.below.value) * rise

    def local_slope(self, rise: Array) -> Array:
        """Slope at each temperature; at T0 the mean of both."""
        both = 0.5 * (self.above.value + self.below.value)
        return np.where(rise > 0.0, self.above.value, np.where(rise < 0.0, self.below.value, both))


@dataclass(frozen=True, slots=True)
class CrossAxis:
    """What acceleration along one cross axis does to the output.

    Attributes
    ----------
    name : str
        ``"a_p"`` or ``"a_o"``.
    delta : Law
        Misalignment, added as + delta a as in the paper [rad].
    delta_ip : float
        Cross-coupling with the input axis [g/g^2].
    """

    name: str
    delta: Law
    delta_ip: float

    @property
    def delta_symbol(self) -> str:
        """Symbol of the misalignment in the error model (2)."""
        return symbol_of("delta", self.name)

    @property
    def coupling_symbol(self) -> str:
        """Symbol of the cross-coupling in the error model (2)."""
        return symbol_of("delta_ip", self.name)


class KnownErrors:
    """Errors of some parameters: their covariance, by itself and over the degrees of freedom."""

    __slots__ = ()

    errors: tuple[Rows, ...]

    @property
    def covariance(self) -> Rows:
        """The first of the errors."""
        return self.errors[0]

    @property
    def dof(self) -> Array:
        """Degrees of freedom of each, as one counts beside other errors: a half is one alone.

        Infinite where it was declared, or is exact or unknown.
        """
        variance, over_dof = np.diagonal(np.array(self.errors), axis1=1, axis2=2)
        endless = np.full(variance.size, np.inf)
        return np.asarray(np.divide(variance, over_dof, out=endless, where=over_dof > 0.0))


@dataclass(frozen=True, slots=True)
class OtherAxis(KnownErrors, CrossAxis):
    """The other cross axis, which tables in another mounting tell.

    Attributes
    ----------
    errors : tuple of tuple of tuple of float
        Covariance of `OF_ONE_AXIS`, and with each source of error over its degrees of freedom.
    """

    errors: tuple[Rows, ...]

    @property
    def symbols(self) -> tuple[str, ...]:
        """Symbols of what the covariance is of."""
        return tuple(symbol_of(name, self.name) for name in OF_ONE_AXIS)


@dataclass(frozen=True, slots=True)
class Launch:
    """Shift of an accelerometer from the launches of its calibration to the next one.

    Attributes
    ----------
    bias : float
        Standard uncertainty of the shift of the bias [g].
    scale_factor : float
        Standard uncertainty of the relative shift of the scale factor.
    bias_dof, scale_factor_dof : float
        Degrees of freedom of each, as they count beside other errors: a half is one alone; infinite
        where it was declared.
    """

    bias: float = 0.0
    scale_factor: float = 0.0
    bias_dof: float = math.inf
    scale_factor_dof: float = math.inf


@dataclass(frozen=True, slots=True)
class Compensation(KnownErrors):
    """Coefficients at any temperature, with what is known of their errors.

    Attributes
    ----------
    k0, K1 : Law
        Bias [g] and scale factor [output unit / g]; the slopes of K1 are relative [1/degC].
    k2, k3 : float
        Nonlinearity [g/g^2], [g/g^3].
    cross : CrossAxis
        The cross axis that the tables turned.
    errors : tuple of tuple of tuple of float
        Covariance of `PARAMETERS` and `SLOPES`, and with each source of error over its degrees of
        freedom, see `accelcal.results.covariance`; delta and delta_ip are those of `cross`. NaN
        in the first where unknown, the square of the slope itself where it was taken from the other
        side of T0.
    T0_degC : float or None
        Reference temperature [degC]; None where no temperature is known.
    temperatures : tuple of float, or None
        Lowest and highest temperature of the tables [degC].
    accelerations : tuple of float
        Lowest and highest a_i of the positions [g].
    other : OtherAxis or None
        The other cross axis, where tables in another mounting turned it.
    launch : Launch
        Shift to the next launch; zero where it is not known, or left out.
    hysteresis : float
        h_T: the bias is on either side of its law by as much [g].
    output_unit : str or None
        Unit of the output.
    local_gravity : float or None
        Gravity where the accelerometer was calibrated [m/s^2].
    serial : str or None
        Serial number.
    undetermined : tuple of str
        Symbols of the parameters that were not determined; their values are 0.
    assumptions : tuple of str
        What was not determined, and what is assumed in its place.
    notes : tuple of str
        What is to be known of the coefficients, and nothing to be warned of.
    effects : StaticEffects or None
        What the accelerometer adds to the model; None where nothing is known of it.
    """

    k0: Law
    K1: Law
    k2: float
    k3: float
    cross: CrossAxis
    errors: tuple[Rows, ...]
    T0_degC: float | None
    temperatures: tuple[float, float] | None
    accelerations: tuple[float, float] = (-1.0, 1.0)
    other: OtherAxis | None = None
    launch: Launch = Launch()
    hysteresis: float = 0.0
    output_unit: str | None = None
    local_gravity: float | None = None
    serial: str | None = None
    undetermined: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    effects: StaticEffects | None = None

    @property
    def several_levels(self) -> bool:
        """Whether the coefficients depend on temperature."""
        return self.temperatures is not None and self.temperatures[0] < self.temperatures[1]

    @property
    def symbols(self) -> tuple[str, ...]:
        """Symbols of the parameters and slopes in the order of the covariance."""
        return tuple(symbol_of(name, self.cross.name) for name in (*PARAMETERS, *SLOPES))

    @property
    def axes(self) -> tuple[CrossAxis, ...]:
        """The cross axes that were calibrated."""
        return (self.cross,) if self.other is None else (self.cross, self.other)

    def parameters(self, rise: Array) -> list[tuple[Any, ...]]:
        """`PARAMETERS` at T - T0, with those of each cross axis in its turn."""
        k0 = self.k0.at_T0 + self.k0.change(rise)
        K1 = self.K1.at_T0 * (1.0 + self.K1.change(rise))
        return [
            (k0, K1, self.k2, self.k3, axis.delta.at_T0 + axis.delta.change(rise), axis.delta_ip)
            for axis in self.axes
        ]

    def derivatives(self, rise: float) -> Array:
        """Derivatives of the first of `parameters` by what the covariance is of, shape (6, 12)."""
        names = (*PARAMETERS, *SLOPES)
        found = np.eye(len(PARAMETERS), len(names))
        for name in LAWS:
            row, scale = found[PARAMETERS.index(name)], 1.0
            if name == "K1":  # whose errors and slopes are relative
                scale = self.K1.at_T0
                row[PARAMETERS.index(name)] = scale * (
                    1.0 + float(self.K1.change(np.asarray(rise)))
                )
            row[names.index(f"{name}_slope_above")] = scale * max(rise, 0.0)
            row[names.index(f"{name}_slope_below")] = scale * min(rise, 0.0)
        return found

    def samples(self, rise: Array, cross: Sequence[Array]) -> Samples:
        """Coefficients of samples at T - T0, with accelerations along the cross axes."""
        tilt, linear, parameters = np.zeros(()), np.ones(()), self.parameters(rise)
        for (*_, delta, delta_ip), along in zip(parameters, cross, strict=True):
            tilt = tilt + delta * along
            # NaN beyond what any solution is looked for
            linear = linear + delta_ip * np.where(np.abs(along) <= FARTHEST, along, np.nan)
        k0, K1, k2, k3, *_ = parameters[0]
        return Samples(rise, cross, k0, tilt, linear, k2, k3, K1)

    def error(self, samples: Samples, a_i: Array, bracket: Array) -> Part:
        """Variance of the bracket of the model from the coefficients [g^2]."""
        rise, along = samples.rise, samples.cross[0]
        relative = bracket / (1.0 + self.K1.change(rise))
        by_bias = np.ones_like(a_i)
        rows = [by_bias, bracket, a_i**2, a_i**3, along, a_i * along]
        for one_side in (np.maximum(rise, 0.0), np.minimum(rise, 0.0)):
            rows += [by_bias * one_side, relative * one_side, along * one_side]
        main = propagated(self.errors, rows)
        if self.other is None:
            return main
        along = samples.cross[1]
        rows = [along, a_i * along, np.maximum(rise, 0.0) * along, np.minimum(rise, 0.0) * along]
        return linear_sum(main, propagated(self.other.errors, rows))

    def heat_sensitivity(self, samples: Samples, a_i: Array, bracket: Array) -> Array:
        """Change of the bracket of the model with temperature [g/degC]."""
        rise, tilt = samples.rise, np.zeros(())
        scale = self.K1.local_slope(rise) / (1.0 + self.K1.change(rise))
        for axis, along in zip(self.axes, samples.cross, strict=True):
            tilt = tilt + axis.delta.local_slope(rise) * along
        of_effects = self.effects.heat_sensitivity(samples, a_i) if self.effects else 0.0
        return np.asarray(self.k0.local_slope(rise) + scale * bracket + tilt + of_effects)
