"""A stand: its conditions, and the components of its error with their distributions.

The distributions are those of JCGM 100 section 4.3 and JCGM 101 table 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from accelcal.arguments.kinds import each_of, expect, several
from accelcal.arguments.numbers import check_number, check_number_or_none, check_whole
from accelcal.arguments.options import check_choice, check_flag, check_written
from accelcal.arrays import Array, Places
from accelcal.errors import InputError
from accelcal.escapes import visible
from accelcal.numerics.probability import student_quantile
from accelcal.plural import counted
from accelcal.stand_uncertainty.kinds import ERROR_QUANTITIES, KINDS
from accelcal.stand_uncertainty.readings import CLASSES, StandConditions, StandReadings

__all__ = ["SHAPES", "Distribution", "Stand", "StandComponent", "distribution"]

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


@dataclass(frozen=True, slots=True)
class StandComponent:
    """One error of the stand.

    Attributes
    ----------
    name : str
        Its name in the budget.
    kind : str
        One of `accelcal.stand_uncertainty.kinds.KINDS`.
    distribution : Distribution
        Its distribution [rad, rad/day, local g, 1, degC or V, by its kind].
    varies : tuple of str
        For what a new error is drawn, of `accelcal.stand_uncertainty.readings.CLASSES`; empty for
        one error common to the whole test.
    order : int
        Waves in a turn, of a harmonic of the head.
    fixed : bool
        Whether it is none of the stand's instruments, so that no better one can be bought.
    origin : str
        Where the size comes from.

    Raises
    ------
    InputError
        If there is no such kind, or no such class, or the error is larger than any instrument's.

    Examples
    --------
    >>> import accelcal
    >>> level = accelcal.distribution("rectangular", half_width=4.8e-6)
    >>> accelcal.StandComponent("level", "shaft-tilt", level).varies
    ()
    """

    name: str
    kind: str
    distribution: Distribution
    varies: tuple[str, ...] = ()
    order: int = 1
    fixed: bool = False
    origin: str = ""

    def __post_init__(self) -> None:
        check_written(name=self.name, origin=self.origin)
        check_choice(KINDS, kind=self.kind)
        expect(self.distribution, Distribution)
        check_flag(fixed=self.fixed)
        check_whole(1, order=self.order)
        object.__setattr__(self, "varies", several(self.varies))
        for name in self.varies:
            if not isinstance(name, str) or name not in CLASSES:
                raise InputError(
                    f"varies by {name!r}, which is unknown; there are {', '.join(CLASSES)}, or"
                    ' "never" alone for one error in the whole test'
                )
        quantity = ERROR_QUANTITIES[KINDS[self.kind].quantity]
        if not self.distribution.standard < quantity.largest:
            raise InputError(
                f"standard uncertainty {self.distribution.standard:.3g}; it is below"
                f" {quantity.largest:g} {quantity.unit}, so check the unit"
            )
        if self.kind == "local-gravity" and self.varies:
            raise InputError('local gravity does not vary in a test; write varies = "never"')
        if self.order > _HIGHEST_ORDER:
            raise InputError(f"order is {self.order}; it is from 1 to {_HIGHEST_ORDER}")

    @property
    def averages(self) -> bool:
        """Whether more strokes average it away."""
        return bool({"reading", "stroke"} & set(self.varies))

    def scaled(self, factor: float) -> StandComponent:
        """Make the component smaller or larger.

        Parameters
        ----------
        factor : float
            New standard uncertainty over the present one.

        Returns
        -------
        StandComponent
            The new component.
        """
        size = factor * self.distribution.standard
        return replace(self, distribution=replace(self.distribution, standard=size))


_HIGHEST_ORDER = 360


@dataclass(frozen=True, slots=True)
class Stand:
    """A stand with all that is known of its errors.

    Attributes
    ----------
    name : str
        Its name.
    components : tuple of StandComponent
        Its errors, independent of one another.
    conditions : StandConditions
        What belongs to it without being an error: gravity, load, ranges of the voltmeter.
    source : str
        Where it is described.

    Raises
    ------
    InputError
        If there is no component, or a name occurs twice.

    Examples
    --------
    >>> import accelcal
    >>> gain = accelcal.distribution("rectangular", half_width=30e-6)
    >>> voltmeter = accelcal.StandComponent("gain", "voltmeter-gain", gain)
    >>> accelcal.Stand("voltmeter alone", [voltmeter]).components[0].name
    'gain'
    """

    name: str
    components: tuple[StandComponent, ...]
    conditions: StandConditions = field(default_factory=StandConditions)
    source: str = "<stand>"

    def __post_init__(self) -> None:
        check_written(name=self.name, source=self.source)
        expect(self.conditions, StandConditions)
        object.__setattr__(self, "components", each_of(self.components, StandComponent))
        if not self.components:
            raise InputError("no components; give a table such as [components.head]")
        names = [part.name for part in self.components]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InputError(f"component {twice!r} is there twice; name each once")

    def __repr__(self) -> str:
        return visible(f"<Stand {self.name}: {counted(len(self.components), 'component')}>")

    def scaled(self, factors: Sequence[float]) -> Stand:
        """Make the components smaller or larger.

        Parameters
        ----------
        factors : sequence of float
            A factor for each component.

        Returns
        -------
        Stand
            The new stand.

        Raises
        ------
        InputError
            If a factor is negative or not finite, or they are not as many as the components.
        """
        factors = several(factors)
        check_number(0.0, **{f"factor {i}": size for i, size in enumerate(factors, start=1)})
        if len(factors) != len(self.components):
            counts = counted(len(factors), "factor"), counted(len(self.components), "component")
            raise InputError(f"{counts[0]} for {counts[1]}; give one for each")
        pairs = zip(self.components, factors, strict=True)
        return replace(self, components=tuple(part.scaled(factor) for part, factor in pairs))


@dataclass(frozen=True, slots=True, eq=False)
class Acting:
    """A component on the n readings of a test."""

    component: StandComponent
    channel: str  # what it changes, one of `accelcal.stand_uncertainty.readings.CHANNELS`
    # shape (n, 1) or (n, 2): change of the channel per unit, as of
    # `accelcal.stand_uncertainty.kinds.Kind`
    pattern: Array
    error: Places  # shape (n,): number of the independent error that each reading has
    errors: int  # how many there are


def acting(component: StandComponent, readings: StandReadings) -> Acting:
    """Let a component act on the readings of a test, for the linear budget and Monte Carlo."""
    kind = KINDS[component.kind]
    pattern = kind.pattern(readings, component.order)
    error, errors = readings.groups(component.varies)
    return Acting(component, kind.channel, pattern, error, errors)
