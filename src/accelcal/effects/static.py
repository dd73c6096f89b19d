"""Effects of the accelerometer itself that are functions of acceleration and temperature alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from accelcal.arrays import Array
from accelcal.effects.left_in_use import is_counted_in_use, static_in_use
from accelcal.geometry import accelerations
from accelcal.results.calibration import Calibration

if TYPE_CHECKING:
    from accelcal.effects.conditions import Conditions
    from accelcal.effects.effect import Disturbance, Effect
    from accelcal.results.findings import FoundEffect
    from accelcal.results.quantity import Quantity

_UNKNOWN = (
    *("angle", "heating", "time", "run_time", "draws"),
    *("per_radian", "per_degree", "per_degree_falling"),
)
"""Conditions of a test that samples in use have not."""

_ALIAS = (
    "the test could not tell it from {}; between the positions of the test they differ, and the"
    " uncertainty counts all as equally likely"
)
_OTHER_ALIAS = "the test could not tell it from {} either, which the uncertainty does not count"

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
    second, third : ndarray or float
        k2 [g/g^2] and k3 [g/g^3].
    scale : ndarray
        Scale factor [output unit / g].
    """

    rise: Array
    cross: Sequence[Array]
    bias: Array
    tilt: Array
    linear: Array
    second: Array | float
    third: Array | float
    scale: Array


@dataclass(frozen=True, slots=True, eq=False)
class LookAlike:
    """What may be there in the place of an effect.

    Attributes
    ----------
    entry : Effect
        The effect that the test could not tell from it.
    sizes : ndarray
        Its amplitudes.
    change : ndarray, shape (12,)
        What the coefficients would be more, see `_of_model`.
    """

    entry: Effect
    sizes: Array
    change: Array

    def value(self, samples: Samples, c: Conditions) -> Array:
        """Addition to the indication, with what the coefficients would be more [g]."""
        units = zip(self.sizes, _units(self.entry, c), strict=True)
        own = sum(amount * _value(unit, samples, c) / small for amount, (unit, small) in units)
        return np.asarray(own + _of_model(samples, c.input) @ self.change)


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
    look_alikes : tuple of tuple of LookAlike
        For each effect, those that may be there in its place.
    """

    disturbances: tuple[Disturbance, ...]
    parameters: tuple[Mapping[str, Quantity], ...]
    reference: float
    scale: float
    look_alikes: tuple[tuple[LookAlike, ...], ...]

    def total(self, samples: Samples, a_i: Array) -> Array:
        """Sum of the effects at accelerations a_i: addition to the indication Y / K1 [g]."""
        c = self._conditions(samples, a_i)
        parts = (_value(item, samples, c) for item in self.disturbances)
        return sum(parts, start=np.zeros(a_i.shape))

    def each(self) -> Iterator[StaticEffects]:
        """Each effect by itself."""
        for item, own, alike in self._together():
            yield replace(self, disturbances=(item,), parameters=(own,), look_alikes=(alike,))

    def parts(self, samples: Samples, a_i: Array) -> Iterator[tuple[Array, float]]:
        """Variance of `total` [g^2] with its degrees of freedom, for each of `changes`."""
        return ((change**2, dof) for change, dof in self.changes(samples, a_i))

    def changes(self, samples: Samples, a_i: Array) -> Iterator[tuple[Array, float]]:
        """Change of `total` [g] by independent errors of one standard uncertainty, and the dof.

        One for each size on its own, and one for each that may be there in the place of an effect:
        with m look-alikes the mean square of m + 1 differences, that of the effect itself zero.
        """
        c = self._conditions(samples, a_i)
        for item, own, alike in self._together():
            without = _value(item, samples, c)
            for more, dof in _one_by_one(item, own):
                yield _value(more, samples, c) - without, dof
            for other in alike:
                yield (other.value(samples, c) - without) / math.sqrt(len(alike) + 1), math.inf

    def _together(
        self,
    ) -> Iterator[tuple[Disturbance, Mapping[str, Quantity], tuple[LookAlike, ...]]]:
        return zip(self.disturbances, self.parameters, self.look_alikes, strict=True)

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
    """Find the static effects of a calibration, None where there are none.

    The scale factor [output unit / g] and the level [degC] are those of the coefficients that they
    go with.

    Raises
    ------
    InputError
        If a parameter of one breaks a rule.
    """
    found = static_in_use(calibration)
    if not found:
        return None
    from accelcal.effects.found import disturbances  # here, as few calibrations need it

    model, T0 = calibration.temperature_model, calibration.T0_degC
    at_T0 = model and model.K1.at_T0 and model.K1.at_T0.value
    effects = StaticEffects(
        disturbances=disturbances(found),
        parameters=tuple(item.parameters for item in found),
        reference=0.0 if level is None or T0 is None else level - T0,
        scale=at_T0 or K1,
        look_alikes=((),) * len(found),
    )
    tested = _tested(calibration, level, K1)
    if tested is None:
        return effects
    c = effects._conditions(*tested)
    alike = (
        _look_alikes(own, _counted(item), tested[0], c)
        for own, item in zip(effects.disturbances, found, strict=True)
    )
    return replace(effects, look_alikes=tuple(alike))


def _counted(item: FoundEffect) -> list[Effect]:
    """Look-alikes of a static effect that use counts."""
    from accelcal.effects.catalogue import catalogue, effect

    own = effect(item.id)
    entries = (entry for entry in catalogue() if entry.id in item.indistinguishable)
    return [entry for entry in entries if is_counted_in_use(own, entry)]


def _tested(
    calibration: Calibration, level: float | None, K1: float
) -> tuple[Samples, Array] | None:
    """Positions and temperatures of the test, in the mounting of most tables."""
    main = calibration.main_mounting
    tables = [t for t in calibration.tables if t.mounting == main and t.residuals.angle_deg]
    if calibration.temperature_model is None:
        tables = [t for t in tables if t.temperature_degC == level][:1]
    if not tables:
        return None
    angles = np.concatenate([np.array(t.residuals.angle_deg) for t in tables])
    rise = [(t.temperature_degC or 0.0) - (level or 0.0) for t in tables]
    acted = accelerations(angles, calibration.delta0_rad, main)
    along = acted.pendulous if main[0] == "o" else acted.output
    k0, k2, k3, delta, delta_ip = (
        tables[0].error_model[name].value or 0.0 for name in ("k0", "k2", "k3", "delta", "delta_ip")
    )
    times = [len(t.residuals.angle_deg) for t in tables]
    same = np.full(angles.size, 1.0)
    samples = Samples(
        rise=np.repeat(rise, times),
        cross=[along],
        bias=k0 * same,
        tilt=delta * along,
        linear=1.0 + delta_ip * along,
        second=k2,
        third=k3,
        scale=K1 * same,
    )
    return samples, acted.input


def _look_alikes(
    item: Disturbance, others: Sequence[Effect], samples: Samples, c: Conditions
) -> tuple[LookAlike, ...]:
    """Give each look-alike the size, and the change of the coefficients, that fits the test."""
    wanted, of_model = _value(item, samples, c), _of_model(samples, c.input)
    alike = []
    for entry in others:
        columns = [_value(unit, samples, c) / size for unit, size in _units(entry, c)]
        design = np.column_stack([*columns, of_model])
        fitted = np.asarray(np.linalg.lstsq(design, wanted, rcond=None)[0], dtype=np.float64)
        alike.append(LookAlike(entry, fitted[: len(columns)], fitted[len(columns) :]))
    return tuple(alike)


def _units(entry: Effect, c: Conditions) -> Iterator[tuple[Disturbance, float]]:
    """An effect with one of its amplitudes small, and that size."""
    from accelcal.effects.effect import Disturbance

    for item in entry.amplitudes:
        none = {other.name: 0.0 for other in entry.amplitudes}
        size = item.small_at(c)
        yield Disturbance(entry, {**none, item.name: size}), size


def _of_model(samples: Samples, a_i: Array) -> Array:
    """Columns of (1) in brackets with its temperature laws, shape (..., 12)."""
    along = samples.cross[0] if samples.cross else np.zeros(a_i.shape)
    with_laws = [np.ones(a_i.shape), a_i, along]
    sides = (np.maximum(samples.rise, 0.0), np.minimum(samples.rise, 0.0))
    slopes = [column * side for side in sides for column in with_laws]
    return np.stack([*with_laws, a_i**2, a_i**3, a_i * along, *slopes], axis=-1)


def how_taken_up(calibration: Calibration) -> list[str]:
    """Say how static effects are taken up, and what else could be there in their place."""
    said = []
    for item in static_in_use(calibration):
        counted = [entry.id for entry in _counted(item)]
        others = [name for name in item.indistinguishable if name not in counted]
        alike = ((_ALIAS, counted), (_OTHER_ALIAS, others))
        said.append(
            f"{item.id}: taken up with the size that the fit found; the calibration does not"
            " tell how that is correlated with the coefficients, so it counts as uncorrelated"
            + "".join(f"; {text.format(' or '.join(ids))}" for text, ids in alike if ids)
        )
    return said
