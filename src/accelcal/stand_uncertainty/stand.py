"""A stand: its conditions, the components of its error, and how these act on a test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from accelcal.arguments.kinds import each_of, expect, several
from accelcal.arguments.numbers import check_number, check_whole
from accelcal.arguments.options import check_choice, check_flag, check_written
from accelcal.arrays import Array, Places
from accelcal.errors import InputError
from accelcal.escapes import visible
from accelcal.plural import counted
from accelcal.stand_uncertainty.distribution import Distribution
from accelcal.stand_uncertainty.kinds import ERROR_QUANTITIES, KINDS
from accelcal.stand_uncertainty.readings import CLASSES, StandConditions, StandReadings

__all__ = ["Stand", "StandComponent"]


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
