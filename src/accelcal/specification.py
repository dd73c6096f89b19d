"""A data sheet: limits on what a calibration finds, each in the unit in which it was printed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from accelcal.arguments.kinds import each_of
from accelcal.arguments.numbers import check_number
from accelcal.arguments.options import check_choice, check_written
from accelcal.arrays import Array, Mask
from accelcal.errors import InputError
from accelcal.escapes import visible
from accelcal.plural import counted
from accelcal.targets import is_denominator
from accelcal.units import UNITS, canonical_unit, conversion_factor, is_output_unit, size_of

__all__ = [
    "PLACES",
    "QUANTITIES",
    "RULES",
    "DecisionRule",
    "Limit",
    "LimitedQuantity",
    "Specification",
]


@dataclass(frozen=True, slots=True)
class LimitedQuantity:
    """A quantity that a data sheet limits.

    Attributes
    ----------
    symbol : str
        The paper's symbol.
    kind : str
        What its numerator is: ``"acceleration"``, ``"angle"``, ``"ratio"``, ``"output"`` or
        ``"temperature"``.
    per : str
        What it is divided by: empty, ``"g"``, ``"g^2"``, ``"g^3"`` or ``"degC"``.
    """

    symbol: str
    kind: str
    per: str = ""


QUANTITIES: Mapping[str, LimitedQuantity] = MappingProxyType(
    {
        "bias": LimitedQuantity("k0", "acceleration"),
        "scale_factor": LimitedQuantity("K1", "output", "g"),
        "second_order": LimitedQuantity("k2", "acceleration", "g^2"),
        "third_order": LimitedQuantity("k3", "acceleration", "g^3"),
        "misalignment": LimitedQuantity("delta", "angle"),
        "cross_coupling": LimitedQuantity("delta_ip", "acceleration", "g^2"),
        "bias_temperature_sensitivity": LimitedQuantity("lam", "acceleration", "degC"),
        "scale_factor_temperature_sensitivity": LimitedQuantity("beta", "ratio", "degC"),
        "misalignment_temperature_sensitivity": LimitedQuantity("gam", "angle", "degC"),
        "bias_temperature_hysteresis": LimitedQuantity("h_T", "acceleration"),
        "bias_repeatability": LimitedQuantity("k0L", "acceleration"),
        "bias_drift": LimitedQuantity("k0D", "acceleration"),
        "bias_fluctuation": LimitedQuantity("k0F", "acceleration"),
        "threshold": LimitedQuantity("p", "acceleration"),
        "scale_factor_stability": LimitedQuantity("k1", "ratio"),
        "operating_temperatures": LimitedQuantity("T", "temperature"),
    }
)
"""Name of a limit -> the quantity that it limits."""

PLACES = ("T0", "every temperature")
"""Where a limit holds: at the reference temperature, or at each level of the test."""


@dataclass(frozen=True, slots=True)
class DecisionRule:
    """How the uncertainty enters a verdict.

    Attributes
    ----------
    guard_band : float
        Width of the guard band, as a multiple of the expanded uncertainty U (95 %).
    statement : str
        The rule in words, with the document that has it.
    """

    guard_band: float
    statement: str


RULES: Mapping[str, DecisionRule] = MappingProxyType(
    {
        "guard band": DecisionRule(
            1.0,
            "guard band w = U (95 %), ILAC-G8:09/2019: pass or fail only"
            " where the whole interval value +- U lies on one side of the limit",
        ),
        "ISO 14253-1:2017": DecisionRule(
            0.83,
            "guard band w = 0.83 U, ISO 14253-1:2017 as quoted for U = 2 u: pass or fail only where"
            " its probability is at least 94.8 %",  # 0.83 of Student's factor, 1.96 or more
        ),
        "simple acceptance": DecisionRule(
            0.0,
            "simple acceptance, w = 0, ILAC-G8:09/2019: the value alone decides, at a risk of up"
            " to 50 % where it lies at the limit",
        ),
    }
)
"""Name of a decision rule -> the rule."""


@dataclass(frozen=True, slots=True)
class Limit:
    """One line of a data sheet.

    Attributes
    ----------
    name : str
        One of `QUANTITIES`.
    unit : str
        Unit of `minimum` and `maximum`.
    minimum, maximum : float or None
        With both, the value itself lies between them; one alone limits the size of the value,
        whatever its sign.
    at : str
        One of `PLACES`; it tells nothing where the quantity is itself one of temperature.
    condition : str
        Condition of the data sheet that goes with the limit, such as ``"in 6 h"``; only printed.

    Raises
    ------
    InputError
        If there is no such quantity or place, no limit, or a unit of something else.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> value = np.array([0.0, 5.1, -5.1])
    >>> accelcal.Limit("bias", "mg", maximum=5.0).kept_by(value, value).tolist()
    [True, False, False]
    """

    name: str
    unit: str
    minimum: float | None = None
    maximum: float | None = None
    at: str = PLACES[0]
    condition: str = ""

    def __post_init__(self) -> None:
        check_written(name=self.name, unit=self.unit, at=self.at, condition=self.condition)
        if self.name not in QUANTITIES:
            meant = [name for name, limited in QUANTITIES.items() if limited.symbol == self.name]
            known = f"write {meant[0]}" if meant else f"there are {', '.join(QUANTITIES)}"
            raise InputError(f"limit {self.name!r} is unknown; {known}")
        self.factor()
        if self.at not in PLACES:
            raise InputError(f"{self.name}: at is {self.at!r}; it is one of {', '.join(PLACES)}")
        self._check_bounds()

    def _check_bounds(self) -> None:
        ends = (("minimum", self.minimum), ("maximum", self.maximum))
        bounds = {f"{self.name}: {end}": bound for end, bound in ends if bound is not None}
        check_number(**bounds)
        given = list(bounds.values())
        if not given:
            raise InputError(f"{self.name}: no limit; give minimum, maximum or both")
        if given != sorted(given):
            raise InputError(
                f"{self.name}: minimum {self.minimum} lies above maximum {self.maximum};"
                " exchange them"
            )
        if len(given) == 1 and self.name == "operating_temperatures":
            raise InputError(f"{self.name}: one end only; give minimum and maximum")
        if len(given) == 1 and given[0] < 0.0:
            raise InputError(
                f"{self.name}: {given[0]} alone is a limit on the size of the value, which is"
                " never negative; give minimum and maximum for a range"
            )

    def factor(self, output_unit: str | None = None) -> float:
        """Factor from the unit of the limit to that of a calibration.

        Parameters
        ----------
        output_unit : str, optional
            Output unit of the calibration; needed for the scale factor only.

        Returns
        -------
        float
            Value in g, rad, 1, degC or output unit, each with its divisor, per value in `unit`.

        Raises
        ------
        InputError
            If the unit is not one of the quantity.

        Examples
        --------
        >>> import accelcal
        >>> accelcal.Limit("bias_temperature_sensitivity", "ug/degC", maximum=60.0).factor()
        1e-06
        >>> accelcal.Limit("scale_factor", "uA/g", maximum=1500.0).factor("mA")
        0.001
        """
        quantity = QUANTITIES[self.name]
        numerator, _, per = self.unit.rpartition("/") if quantity.per else (self.unit, "", "")
        if not is_denominator(per, quantity.per):
            raise self._wrong_unit()
        if quantity.kind == "output":
            return self._output_factor(canonical_unit(numerator), output_unit)
        size = size_of(numerator, quantity.kind)
        if size is None:
            raise self._wrong_unit()
        return size

    def _output_factor(self, numerator: str, output_unit: str | None) -> float:
        if not is_output_unit(numerator):
            raise self._wrong_unit()
        factor = 1.0 if output_unit is None else conversion_factor(numerator, output_unit)
        if factor is None:
            raise InputError(
                f"{self.name}: unit {self.unit!r} does not fit a calibration in {output_unit};"
                f" give the limit in {output_unit}/g"
            )
        return factor

    def _wrong_unit(self) -> InputError:
        quantity = QUANTITIES[self.name]
        known = UNITS.get(quantity.kind, {"mA": 1.0, "mV": 1.0, "V": 1.0, "counts": 1.0})
        per = f"/{quantity.per}" if quantity.per else ""
        return InputError(
            f"{self.name}: unit {self.unit!r} is none of this quantity; it has"
            f" {', '.join(f'{numerator}{per}' for numerator in known)}"
        )

    @property
    def intervals(self) -> tuple[tuple[float, float], ...]:
        """Where the value may lie, in `unit`; the size above a minimum makes two intervals."""
        if self.minimum is not None and self.maximum is not None:
            return ((self.minimum, self.maximum),)
        if self.maximum is not None:
            return ((-self.maximum, self.maximum),)
        assert self.minimum is not None
        return ((-math.inf, -self.minimum), (self.minimum, math.inf))

    def kept_by(self, low: Array, high: Array) -> Mask:
        """Tell where all from one value to another keeps the limit.

        Parameters
        ----------
        low, high : ndarray
            Ends of intervals, in the unit of the limit; NaN where unknown.

        Returns
        -------
        ndarray of bool
            False where an end is NaN.
        """
        within = [(least <= low) & (high <= most) for least, most in self.intervals]
        return np.asarray(np.any(within, axis=0))

    def broken_by(self, low: Array, high: Array) -> Mask:
        """Tell where nothing from one value to another keeps the limit.

        Parameters
        ----------
        low, high : ndarray
            Ends of intervals, in the unit of the limit; NaN where unknown.

        Returns
        -------
        ndarray of bool
            False where an end is NaN.
        """
        beside = [(high < least) | (low > most) for least, most in self.intervals]
        return np.asarray(np.all(beside, axis=0))


@dataclass(frozen=True, slots=True)
class Specification:
    """A data sheet.

    Attributes
    ----------
    name : str
        What it is the data sheet of.
    limits : tuple of Limit
        The limits, in their order.
    source : str
        Where it was printed.
    rule : str
        Name of the decision rule, of `RULES`.

    Raises
    ------
    InputError
        If there is no limit, or no such rule.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.Specification("AL-15", (accelcal.Limit("bias", "mg", maximum=5.0),)).rule
    'guard band'
    """

    name: str
    limits: tuple[Limit, ...]
    source: str = ""
    rule: str = "guard band"

    def __post_init__(self) -> None:
        check_written(name=self.name, source=self.source)
        check_choice(RULES, rule=self.rule)
        object.__setattr__(self, "limits", each_of(self.limits, Limit))
        if not self.limits:
            raise InputError("no limits; give a table such as [limits.bias]")

    def __repr__(self) -> str:
        return visible(f"<Specification {self.name}: {counted(len(self.limits), 'limit')}>")
