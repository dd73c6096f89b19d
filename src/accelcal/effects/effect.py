"""What an entry of the catalogue is: an effect, and an effect of a given size."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from inspect import signature
from typing import Literal, get_args

import numpy as np

from accelcal.arguments.kinds import each_of, expect
from accelcal.arguments.options import (
    check_choice,
    check_flag,
    check_function,
    check_written,
    mapping_of,
)
from accelcal.arrays import Array
from accelcal.effects.conditions import Conditions
from accelcal.effects.parameter import Parameter
from accelcal.errors import InputError
from accelcal.escapes import visible
from accelcal.frozen_mapping import FrozenMapping, kept_mapping

__all__ = ["ActsOn", "Disturbance", "Effect"]

ActsOn = Literal["angle", "temperature", "output", "readings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """An effect of the catalogue.

    One of your own takes an id, name, physics, formula, parameters and term; the rest has defaults.
    `accelcal.register` adds it to the catalogue.

    Attributes
    ----------
    id : str
        Fixed identifier: small letters, digits and hyphens.
    name : str
        What people call it.
    physics : str
        What happens, in a sentence.
    formula : str
        The term, in the symbols of the paper.
    parameters : tuple of Parameter
        The first one has no default: it is the value of the effect.
    term : callable
        ``term(conditions, **values)`` -> addition to what the effect acts on, shape (n,). The
        conditions have arrays such as `input` (a_i), `cross` (a_p), `angle`, `excess` (T - T0),
        `stroke` and `time`; `accelcal.effects.conditions.Conditions` lists all.
    acts_on : {"angle", "temperature", "output", "readings"}, default "output"
        What the term adds to: the true head angle [rad], the true temperature [degC], the
        indication Y / K1 [g], or the reading after noise [g].
    signature : str
        What it looks like in the residuals.
    to_tell_apart : str
        The measurement that separates it from what looks alike.
    bend : callable, optional
        ``bend(conditions)`` -> shape (n,) or (n, k): what bends the law of the term [g]. Where the
        readings need it beside the term, the law is another one, and the name is not given.
    tie : mapping of str to float, optional
        Coefficients of the model, such as ``"K0 above T0"``, whose sum with these weights is the
        amplitude; for effects of one amplitude. Where the readings alone do not tell a nonlinear
        parameter, it is where this holds.
    static : bool, default False
        True where the term is of the accelerometer itself and depends on nothing but `input`,
        `cross`, `axial`, `excess`, `indicated` and `gain`: then `accelcal.apply` takes it up.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> accelcal.Effect(
    ...     id="third-harmonic",
    ...     name="third harmonic of the head",
    ...     physics="The circle of the head errs three times a turn.",
    ...     formula="d th = c cos 3th",
    ...     parameters=(accelcal.Parameter("cosine", "rad", "coefficient c"),),
    ...     term=lambda c, cosine: cosine * np.cos(3 * np.radians(c.angle)),
    ...     acts_on="angle",
    ... ).of(2e-5).values
    {'cosine': 2e-05}
    """

    id: str
    name: str
    physics: str
    formula: str
    parameters: tuple[Parameter, ...]
    term: Callable[..., Array]
    acts_on: ActsOn = "output"
    signature: str = "Residuals that follow the formula."
    to_tell_apart: str = "readings where their formulas differ"
    bend: Callable[[Conditions], Array] | None = None
    tie: Mapping[str, float] = FrozenMapping()
    static: bool = False

    def __post_init__(self) -> None:
        check_flag(static=self.static)
        check_written(id=self.id, name=self.name, physics=self.physics, formula=self.formula)
        check_written(signature=self.signature, to_tell_apart=self.to_tell_apart)
        object.__setattr__(self, "parameters", each_of(self.parameters, Parameter))
        check_choice(get_args(ActsOn), acts_on=self.acts_on)
        tie = mapping_of(self.tie, "tie", "{'K0 above T0': 1.0}")
        object.__setattr__(self, "tie", kept_mapping(tie))
        check_function(term=self.term, bend=self.bend)
        if self.term is None:
            raise InputError("term is None; give a function of the conditions and the parameters")
        _check_call(self.id, "term", self.term, [item.name for item in self.parameters])
        _check_call(self.id, "bend", self.bend, [])

    def __reduce__(self) -> tuple[Callable[..., Effect], tuple[object, ...]]:
        """Pickle an entry that every process has by its id, as its term may be a lambda."""
        from accelcal.effects import catalogue  # here, as the catalogue is made of effects

        if catalogue.is_built_in(self):
            return catalogue.effect, (self.id,)
        return partial(Effect, **{name: getattr(self, name) for name in self.__slots__}), ()

    def __repr__(self) -> str:
        return visible(f"<Effect {self.id}: {self.name}>")

    def _repr_html_(self) -> str:
        from accelcal.report.notebook import effect_html

        return effect_html(self)

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """Parameters that the readings are proportional to, one column each."""
        return tuple(item for item in self.parameters if item.linear)

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        """Parameters that enter nonlinearly and have values to try."""
        return tuple(item for item in self.parameters if item.search is not None)

    def of(self, value: float | None = None, **others: float) -> Disturbance:
        """Give the effect a size.

        Parameters
        ----------
        value : float, optional
            Value of the first parameter, which may stand by its name as well [its unit].
        **others : float
            Other parameters by name; those left out have their defaults.

        Returns
        -------
        Disturbance
            The effect with its values.

        Raises
        ------
        InputError
            If a parameter is unknown, is given twice or breaks a rule.

        Examples
        --------
        >>> import accelcal
        >>> accelcal.effect("warm-up").of(1e-4, tau=900).values
        {'amplitude': 0.0001, 'tau': 900.0}
        """
        name = self.parameters[0].name
        if value is not None and name in others:
            raise InputError(f"{name} is given twice, as {value:g} and {others[name]:g}; give one")
        first = {} if value is None else {name: value}
        return Disturbance(self, {**first, **others})

    def columns(
        self, conditions: Conditions, near: float | None = None, /, **shape: float
    ) -> Array:
        """Change of the readings per unit of each amplitude, for small amplitudes.

        Parameters
        ----------
        conditions : Conditions
            Of n readings.
        near : float, optional
            Size of the first amplitude, in place of a small one [its unit].
        **shape : float
            Parameters that enter nonlinearly, by name.

        Returns
        -------
        ndarray, shape (n, m)
            One column for each of the m `amplitudes` [g per unit]; m is 0 for an effect that
            has none.

        Raises
        ------
        InputError
            If a parameter is unknown or breaks a rule, or the term has no value for a reading.

        Notes
        -----
        An effect on the angle comes in through dY/dth, one on the temperature through dY/dT.
        `Conditions` of a record have dY/dth of a_i alone: it is exactly zero where a_i is extreme,
        so that nobody looks for an error of the angle there, and leaves out delta a_p and the
        nonlinearity, some thousandths of the column.
        """
        amplitudes = self.amplitudes
        if not amplitudes:
            return np.empty((conditions.angle.size, 0))
        sizes = {item.name: item.small_at(conditions) for item in amplitudes}
        if near is not None:
            sizes[amplitudes[0].name] = near
        values = self._complete({**dict.fromkeys(sizes, 0.0), **shape})
        found = np.array(
            [
                self.addition(conditions, {**values, name: size}) / size
                for name, size in sizes.items()
            ]
        )
        if self.acts_on == "angle":
            found *= conditions.per_radian
        elif self.acts_on == "temperature":
            found *= conditions.per_degree
        return found.T

    def addition(self, conditions: Conditions, values: Mapping[str, float]) -> Array:
        """Value of the term for each reading.

        Parameters
        ----------
        conditions : Conditions
            Of n readings.
        values : mapping of str to float
            All parameters.

        Returns
        -------
        ndarray, shape (n,)
            In rad, degC or g, by `acts_on`.

        Raises
        ------
        InputError
            If the term has no value for a reading, or not one value for each.
        """
        added = np.asarray(self.term(conditions, **values), dtype=np.float64)
        if added.shape != conditions.angle.shape:
            raise InputError(
                f"{self.id}: the term has shape {added.shape}; it has one value for each of the"
                f" {conditions.angle.size} readings"
            )
        if not np.isfinite(added).all():
            first = int(np.argmin(np.isfinite(added)))
            raise InputError(
                f"{self.id}: the term is {added[first]} at {conditions.angle[first]:g} deg; it has"
                " a finite value for each reading"
            )
        return added

    def _complete(self, given: Mapping[str, float]) -> dict[str, float]:
        known = {item.name: item for item in self.parameters}
        unknown = [name for name in given if name not in known]
        if unknown:
            raise InputError(
                f"{self.id} has no parameter {unknown[0]!r}; it has {', '.join(known)}"
            )
        try:
            return {
                name: item.checked(given[name]) if name in given else item.own_default()
                for name, item in known.items()
            }
        except InputError as error:
            raise InputError(f"{self.id}: {error}") from None


def _check_call(
    effect: str, name: str, function: Callable[..., Array] | None, parameters: list[str]
) -> None:
    """Refuse a function that cannot be called with the conditions and the parameters by name."""
    if function is None:
        return
    try:
        told = signature(function)
    except ValueError:  # some functions written in C do not tell
        return
    try:
        told.bind(None, **dict.fromkeys(parameters))
    except TypeError as error:
        wanted = ", ".join(["conditions", *parameters])
        raise InputError(
            f"{effect}: {name}{told} has {error}; it is called as {name}({wanted}), the parameters"
            " by their names"
        ) from None


@dataclass(frozen=True, slots=True)
class Disturbance:
    """An effect of a given size, from `Effect.of`.

    Attributes
    ----------
    effect : Effect
        The effect.
    values : mapping of str to float
        All its parameters; those left out have their defaults.

    Raises
    ------
    InputError
        If it is no effect, or a parameter is unknown, missing or breaks a rule.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.effect("hysteresis").of(2e-5).values
    {'half_width': 2e-05, 'approach': 1.0}
    """

    effect: Effect
    values: Mapping[str, float]

    def __post_init__(self) -> None:
        expect(self.effect, Effect)
        given = mapping_of(self.values, "values", "{'half_width': 2e-5}")
        object.__setattr__(self, "values", FrozenMapping(self.effect._complete(given)))

    def __str__(self) -> str:
        """As ``--effect`` takes it: ``ID=VALUE,NAME=VALUE``."""
        first, *others = self.values.items()
        return ",".join([f"{self.effect.id}={first[1]!r}", *(f"{k}={v!r}" for k, v in others)])

    def change(self, conditions: Conditions) -> Array:
        """Addition to what the effect acts on, exact at any size.

        Parameters
        ----------
        conditions : Conditions
            Of n readings.

        Returns
        -------
        ndarray, shape (n,)
            In rad, degC or g, by ``effect.acts_on``.
        """
        return self.effect.addition(conditions, self.values)
