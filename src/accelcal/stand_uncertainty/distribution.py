"""Distributions of the errors of a stand, JCGM 100 section 4.3 and JCGM 101 table 1."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from accelcal.arguments.numbers import check_number, check_number_or_none
from accelcal.arguments.options import check_choice
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.numerics.probability import student_quantile

__all__ = ["SHAPES", "Distribution", "distribution"]

SHAPES = ("normal", "rectangular", "triangular", "arcsine")
"""Names of the distributions; arcsine is the U-shaped one."""

_DIVISORS = {"rectangular": math.sqrt(3.0), "triangular": math.sqrt(6.0), "arcsine": math.sqrt(2.0)}
"""Half width over standard deviation, where the half width is a limit."""

_FEWEST = 3.0
"""Degrees of freedom with which Student's t has a variance."""


@dataclass(frozen=True, slots=True)
class Distribution:
    """Distribution of an error around zero.

    Attributes
    ----------
    shape : str
        One of `SHAPES`.
    standard : float
        Standard uncertainty.
    dof : float
        Degrees of freedom of the standard uncertainty; infinite where it is taken as known.

    Raises
    ------
    InputError
        If the shape is unknown, `standard` is negative or not finite, or `dof` is below 3.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.distribution("normal", half_width=2e-5, factor=2.0)
    Distribution(shape='normal', standard=1e-05, dof=inf)
    """

    shape: str
    standard: float
    dof: float = math.inf

    def __post_init__(self) -> None:
        check_choice(SHAPES, distribution=self.shape)
        check_number(0.0, standard=self.standard)
        _check_freedom(self.dof)

    def draws(self, random: np.random.Generator, shape: tuple[int, int, int]) -> Array:
        """Draw errors: trials, groups, and the components of one error (sine and cosine).

        Parameters
        ----------
        random : numpy.random.Generator
            Where the random numbers come from.
        shape : tuple of int
            Trials, independent errors in a trial, components of each error (1 or 2).

        Returns
        -------
        ndarray, shape `shape`
            The errors.

        Notes
        -----
        JCGM 101, 6.4: with few degrees of freedom a normal error becomes Student's t, all
        errors of a trial sharing the unknown standard deviation. An arcsine error in two
        components is an amplitude at a phase of which nothing is known.
        """
        limit = self.standard * _DIVISORS.get(self.shape, 1.0)
        if self.shape == "rectangular":
            return random.uniform(-1.0, 1.0, shape) * limit
        if self.shape == "triangular":
            return (random.random(shape) - random.random(shape)) * limit
        if self.shape == "arcsine":
            phase = random.uniform(0.0, 2.0 * np.pi, (*shape[:2], 1))
            return np.cos(phase - 0.5 * np.pi * np.arange(shape[2])) * limit
        return random.standard_normal(shape) * self._spread(random, shape[0])

    def _spread(self, random: np.random.Generator, trials: int) -> Array:
        """Standard deviation in each trial, shape (trials, 1, 1)."""
        if math.isinf(self.dof):
            return np.full((1, 1, 1), self.standard)
        squares = random.chisquare(self.dof, (trials, 1, 1))
        return self.standard * np.sqrt(self.dof / squares)


def distribution(
    shape: str,
    *,
    standard: float | None = None,
    half_width: float | None = None,
    coverage: float | None = None,
    factor: float | None = None,
    dof: float = math.inf,
) -> Distribution:
    """Make a distribution of what a certificate or a data sheet gives.

    Parameters
    ----------
    shape : str
        One of `SHAPES`.
    standard : float, optional
        Standard uncertainty.
    half_width : float, optional
        Half width: the limit of a bounded distribution, or of the interval of a normal one.
    coverage : float, optional
        Probability of the interval of a normal distribution.
    factor : float, optional
        Coverage factor of that interval, in place of its probability.
    dof : float, default inf
        Degrees of freedom of the standard uncertainty; of a normal distribution only.

    Returns
    -------
    Distribution
        The distribution.

    Raises
    ------
    InputError
        If the shape is unknown, a number is negative or not finite, or the size is told twice, not
        at all, or without the coverage that it needs.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.distribution("rectangular", half_width=3.0).standard.__round__(4)
    1.7321
    >>> accelcal.distribution("normal", half_width=2e-5, factor=2.0).standard
    1e-05
    """
    check_choice(SHAPES, distribution=shape)
    check_number_or_none(0.0, standard=standard, half_width=half_width, factor=factor)
    _check_freedom(dof)
    if (standard is None) == (half_width is None):
        raise InputError("the size is told twice or not at all; give standard or half_width")
    if shape != "normal" and (coverage is not None or factor is not None or not math.isinf(dof)):
        raise InputError(
            f"coverage, factor and dof go with a normal distribution, not with a {shape} one;"
            " leave them out"
        )
    if standard is not None:
        if coverage is not None or factor is not None:
            raise InputError("coverage and factor go with half_width; leave them out with standard")
        return Distribution(shape, standard, dof)
    assert half_width is not None
    divisor = _DIVISORS.get(shape) or _normal_factor(coverage, factor, dof)
    return Distribution(shape, half_width / divisor, dof)


def _check_freedom(dof: float) -> None:
    if not isinstance(dof, float) or dof != math.inf:
        check_number(dof=dof)
    if not dof >= _FEWEST:
        raise InputError(f"dof is {dof}; with fewer than {_FEWEST:g} the error has no variance")


def _normal_factor(coverage: float | None, factor: float | None, dof: float) -> float:
    if (coverage is None) == (factor is None):
        raise InputError(
            "half_width of a normal distribution needs its coverage; give coverage = 0.95 or"
            " factor = 2"
        )
    if coverage is not None:
        check_number(coverage=coverage)
        if not 0.0 < coverage < 1.0:
            raise InputError(f"coverage is {coverage}; it lies between 0 and 1")
        return student_quantile(coverage, dof)
    assert factor is not None
    if factor == 0.0:
        raise InputError(f"factor is {factor}; it is above 0, such as 2 for 95 %")
    return factor
