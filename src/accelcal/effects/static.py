"""Effects of the accelerometer itself that are functions of acceleration and temperature alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from accelcal.effects.left_in_use import static_in_use
from accelcal.results.calibration import Calibration

if TYPE_CHECKING:
    from accelcal.effects.conditions import Conditions
    from accelcal.effects.effect import Disturbance
    from accelcal.results.quantity import Quantity

__all__ = ["Samples", "StaticEffects", "how_taken_up", "static_effects"]

Array = NDArray[np.float64]

_UNKNOWN = (
    *("angle", "approach", "time", "run_time", "draws"),
    *("per_radian", "per_degree", "per_degree_falling"),
)
"""Conditions of a test that samples in use have not."""

_ALIAS = (
    "the test could not tell it from {}: they differ between the positions of the test, which the"
    " uncertainty does not count"
)

_STEP = 0.01
"""Step of differences by the temperature [degC]."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """What effects depend on beside a_i; arrays of one shape, a value for each sample.

    Attributes
    ----------
    rise : ndarray
        Temperature above that of the coefficients [degC].
    cross : sequence of ndarray
        Acceleration along each cross axis [g].
    bias : ndarray
        k0 [g].
    tilt : ndarray
        Misalignments times accelerations along the cross axes [g].
    linear : ndarray
        Coefficient of a_i, the cross-couplings in it [1].
    second, third : float
        k2 [g/g^2] and k3 [g/g^3].
    scale : ndarray
        Scale factor [output unit / g].
    """

    rise: Array
    cross: Sequence[Array]
    bias: Array
    tilt: Array
    linear: Array
    second: float
    third: float
    scale: Array


@dataclass(frozen=True, slots=True)
class StaticEffects:
    """Effects with their sizes.

    Attributes
    ----------
    disturbances : tuple of Disturbance
        The effects.
    parameters : tuple of mapping of str to Quantity
        The parameters of each.
    reference : float
        Temperature of the coefficients minus that the effects refer to [degC].
    scale : float
        Scale factor at the temperature that the effects refer to [output unit / g].
    """

    disturbances: tuple[Disturbance, ...]
    parameters: tuple[Mapping[str, Quantity], ...]
    reference: float
    scale: float

    def total(self, samples: Samples, a_i: Array) -> Array:
        """Sum of the effects.

        Parameters
        ----------
        samples : Samples
            The samples.
        a_i : ndarray
            Acceleration of each [g].

        Returns
        -------
        ndarray
            Addition to the indication Y / K1 [g].
        """
        c = self._conditions(samples, a_i)
        parts = (_value(item, samples, c) for item in self.disturbances)
        return sum(parts, start=np.zeros(a_i.shape))

    def each(self) -> Iterator[StaticEffects]:
        """Each effect by itself."""
        for item, own in zip(self.disturbances, self.parameters, strict=True):
            yield replace(self, disturbances=(item,), parameters=(own,))

    def parts(self, samples: Samples, a_i: Array) -> Iterator[tuple[Array, float]]:
        """Variance of `total` from each size on its own [g^2], with its degrees of freedom."""
        c = self._conditions(samples, a_i)
        for item, own in zip(self.disturbances, self.parameters, strict=True):
            without = _value(item, samples, c)
            for more, dof in _one_by_one(item, own):
                yield (_value(more, samples, c) - without) ** 2, dof

    def heat_sensitivity(self, samples: Samples, a_i: Array) -> Array:
        """Change of `total` with temperature [g/degC]."""
        warmer, colder = (replace(samples, rise=samples.rise + step) for step in (_STEP, -_STEP))
        return (self.total(warmer, a_i) - self.total(colder, a_i)) / (2.0 * _STEP)

    def _conditions(self, samples: Samples, a_i: Array) -> Conditions:
        """Conditions of the samples; what a static effect has no business with is not a number."""
        from accelcal.effects.conditions import Conditions  # here, as few calibrations need it

        nothing, none = np.full(a_i.shape, np.nan), np.zeros(a_i.shape, dtype=np.int64)
        cubic = ((samples.third * a_i + samples.second) * a_i + samples.linear) * a_i
        return Conditions(
            **dict.fromkeys(_UNKNOWN, nothing),
            number=none,
            stroke=none,
            run=none,
            input=a_i,
            cross=np.zeros(a_i.shape),
            axial=a_i + samples.tilt,
            excess=samples.rise + self.reference,
            indicated=samples.bias + samples.tilt + cubic,
            gain=samples.scale / self.scale,
        )


def _value(item: Disturbance, samples: Samples, c: Conditions) -> Array:
    """Value of a term: what it is without a cross axis, and what each of them changes in it."""
    without = item.effect.term(c, **item.values)
    across = (item.effect.term(replace(c, cross=along), **item.values) for along in samples.cross)
    return np.asarray(sum((value - without for value in across), start=without))


def _one_by_one(
    item: Disturbance, parameters: Mapping[str, Quantity]
) -> Iterator[tuple[Disturbance, float]]:
    """An effect with one of its parameters larger by its standard uncertainty, and the dof."""
    for name, size in parameters.items():
        larger = item.values[name] + (size.standard_uncertainty or 0.0)
        yield replace(item, values={**item.values, name: larger}), size.dof or math.inf


def static_effects(
    calibration: Calibration, K1: float, level: float | None
) -> StaticEffects | None:
    """Find the static effects of a calibration.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    K1 : float
        Scale factor of the coefficients that they go with [output unit / g].
    level : float or None
        Their temperature [degC].

    Returns
    -------
    StaticEffects or None
        None where there are none.

    Raises
    ------
    InputError
        If a parameter of one breaks a rule.
    """
    given = static_in_use(calibration)
    if not given:
        return None
    from accelcal.effects.found import disturbances  # here, as few calibrations need it
    from accelcal.results.findings import FoundEffect

    found = [FoundEffect.from_document(item) for item in given]
    model, T0 = calibration.temperature_model, calibration.T0_degC
    at_T0 = model and model.K1.at_T0 and model.K1.at_T0.value
    return StaticEffects(
        disturbances=disturbances(found),
        parameters=tuple(item.parameters for item in found),
        reference=0.0 if level is None or T0 is None else level - T0,
        scale=at_T0 or K1,
    )


def how_taken_up(calibration: Calibration) -> list[str]:
    """Say how static effects are taken up, and what else could be there in their place.

    Parameters
    ----------
    calibration : Calibration
        The calibration.

    Returns
    -------
    list of str
        A sentence for each.
    """
    said = []
    for item in static_in_use(calibration):
        aliases = " or ".join(map(str, item["indistinguishable"]))
        said.append(
            f"{item['id']}: taken up with the size that the fit found; the calibration does not"
            " tell how that is correlated with the coefficients, so it counts as uncorrelated"
            + (f"; {_ALIAS.format(aliases)}" if aliases else "")
        )
    return said
