"""Parameters of effects."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from accelcal.arguments.numbers import check_number, check_number_or_none
from accelcal.arguments.options import check_flag, check_function, check_written
from accelcal.arrays import Array
from accelcal.effects.conditions import Conditions
from accelcal.errors import InputError

__all__ = ["Parameter"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of an effect.

    Attributes
    ----------
    name, unit, meaning : str
        Its name, its unit ("1" for a ratio or a number), and what it is.
    default : float or None
        Value where none is given; None where one must be.
    minimum : float
        Smallest value allowed.
    linear : bool
        True for an amplitude: the change of the readings is proportional to it.
    small : float or callable
        Size at which the column of an amplitude is taken, or `Conditions` -> that size. Other than
        1 only where the term is proportional to the amplitude near that size alone.
    search : callable or None
        For a parameter that enters nonlinearly: `Conditions` -> the values to try, rising.
    discrete : bool
        True where nothing lies between the values of `search`.
    sizes : callable or None
        For a first amplitude of which the column of one small size is not that of all:
        `Conditions` -> sizes near which it is tried.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.Parameter("tau", "s", "time constant", 600.0, minimum=1.0, linear=False).default
    600.0
    """

    name: str
    unit: str
    meaning: str
    default: float | None = None
    minimum: float = -math.inf
    linear: bool = True
    small: float | Callable[[Conditions], float] = 1.0
    search: Callable[[Conditions], Array] | None = None
    discrete: bool = False
    sizes: Callable[[Conditions], Array] | None = None

    def __post_init__(self) -> None:
        check_written(name=self.name, unit=self.unit, meaning=self.meaning)
        check_flag(linear=self.linear, discrete=self.discrete)
        check_function(search=self.search, sizes=self.sizes)
        if not isinstance(self.minimum, float) or self.minimum != -math.inf:
            check_number(minimum=self.minimum)
        if not callable(self.small):
            check_number(small=self.small)
            if not self.small > 0.0:
                raise InputError(f"small is {self.small}; it is above 0 [{self.unit}]")
        check_number_or_none(self.minimum, default=self.default)

    def small_at(self, conditions: Conditions) -> float:
        """Size at which the column of an amplitude is taken.

        Parameters
        ----------
        conditions : Conditions
            Of the readings.

        Returns
        -------
        float
            The size [its unit].
        """
        return self.small(conditions) if callable(self.small) else self.small

    def searched_at(self, conditions: Conditions) -> Array:
        """Values to try of a parameter that enters nonlinearly.

        Parameters
        ----------
        conditions : Conditions
            Of the readings.

        Returns
        -------
        ndarray, shape (v,)
            The values, rising; none of an amplitude [its unit].
        """
        return np.empty(0) if self.search is None else self.search(conditions)

    def checked(self, value: float) -> float:
        """Give the value back if it obeys the rules of the parameter.

        Parameters
        ----------
        value : float
            A value of the parameter [its unit].

        Returns
        -------
        float
            The same value.

        Raises
        ------
        InputError
            If it is not finite or below the minimum.
        """
        if type(value) is float and math.isfinite(value) and value >= self.minimum:
            return value  # a search asks this some ten thousand times
        try:
            check_number(self.minimum, **{self.name: value})
        except InputError as error:
            raise InputError(f"{error} [{self.unit}]") from None
        return float(value)

    def own_default(self) -> float:
        """Give the value that it has where none is given.

        Returns
        -------
        float
            `default` [its unit].

        Raises
        ------
        InputError
            If there is none.
        """
        if self.default is None:
            raise InputError(f"{self.name} is missing; it is needed [{self.unit}]")
        return self.default
