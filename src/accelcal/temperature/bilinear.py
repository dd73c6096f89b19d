"""The bilinear law: a value at T0 and one slope on either side, continuous at T0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.estimate.uncertainty import (
    Component,
    Intervals,
    covariance_fields,
    interval_stack,
    propagate,
)
from accelcal.model import LAWS, law_units
from accelcal.reference import LEAST_RISE
from accelcal.results.quantity import Quantity
from accelcal.results.temperature import TemperatureLaw, TemperatureModel

_SAME = 1e-9  # degC, the rounding errors of a mean

_ALL_OF_A_SLOPE = 0.5
"""Standard uncertainty of a slope that is taken from the other side, +- all of it, over itself."""


def tell_a_law(rise: Array, sides: Sequence[str]) -> Mask:
    """Tell which records have levels that determine a law, once they span a slope, shape (R,).

    Two slopes and a value need three different levels of the n, by their rise of shape (R, n).

    Examples
    --------
    >>> import numpy as np
    >>> tell_a_law(np.array([[-60.0, 0.0, 60.0], [-60.0, 60.0, 60.0]]), ("above", "below")).tolist()
    [True, False]
    """
    apart = np.diff(np.sort(rise, axis=1), axis=1) > _SAME
    return np.asarray(apart.sum(axis=1) >= len(sides))


def taken_from_the_other_side(rise: Array, sides: Sequence[str]) -> Array:
    """Temperature by which levels count as uncertain, as no slope was measured there [degC].

    Levels less than `LEAST_RISE` from T0 tell no slope. If those further away are on its other side
    only, the line goes straight on to them, though the law may break at T0. What that may do is
    that of an error of their temperature, with this standard uncertainty: 0 up to `SAME_LEVEL`.

    Examples
    --------
    >>> import numpy as np
    >>> taken_from_the_other_side(np.array([-60.0, 0.2, 4.0]), ("below",)).tolist()
    [0.0, 0.0, 2.0]
    """
    beyond = {"above": -rise, "below": rise}[sides[0]] if len(sides) == 1 else 0.0 * rise
    return np.where(beyond > SAME_LEVEL, _ALL_OF_A_SLOPE * beyond, 0.0)


def share_of_law(read: Array, design: Array) -> Array:
    """K1 of the law that weighs all levels alike over K1 as read, at each level, shape (R, n).

    An error of a head position is the same share of K1 at all levels. As a share of what was read
    it would explain a part of every misfit, and lead the law of quiet readings away [1]_. The
    columns of the law, see `accelcal.reference.bilinear_design`, are of shape (R, n, p), or
    (1, n, p) where they are alike.

    References
    ----------
    .. [1] G. D'Agostini, "On the use of the covariance matrix to fit correlated data", Nuclear
       Instruments and Methods A 346 (1994) 306-311.

    Examples
    --------
    >>> import numpy as np
    >>> share_of_law(np.array([[1.25, 0.75]]), np.ones((1, 2, 1))).round(3).tolist()
    [[0.8, 1.333]]
    """
    basis = np.linalg.qr(design)[0]
    law = basis @ (basis.mT @ read[:, :, None])
    return np.asarray(law[:, :, 0] / read)


def local_slopes(rise: Array, sides: Sequence[str], axis: int = -1) -> Array:
    """Weights of a law's parameters in its slope at each temperature, shape (..., n, 1 + sides).

    At T0 the mean of both slopes counts, if there are two. The axis is as for `bilinear_design`.
    """
    if len(sides) == 1:
        return np.stack([np.zeros_like(rise), np.ones_like(rise)], axis=axis)
    near = np.abs(rise) < LEAST_RISE
    parts = {"above": np.where(near, 0.5, rise > 0.0), "below": np.where(near, 0.5, rise < 0.0)}
    return np.stack([np.zeros_like(rise), *(parts[side] for side in sides)], axis=axis)


class LawStack(NamedTuple):
    """Laws of k0, K1 and delta of R records in which the same sides of T0 were measured."""

    sides: tuple[str, ...]  # see `accelcal.reference.measured_sides`
    # shape (R, 3 p): value at T0 and slopes of k0 [g], of K1 [output unit / g] and of delta [rad];
    # the slopes of K1 are relative
    values: Array
    intervals: Intervals  # uncertainties of the values

    @property
    def names(self) -> list[str]:
        """Names of the values, as in ``"k0 above"``."""
        return [f"{law} {part}" for law in LAWS for part in ("at_T0", *self.sides)]

    def model(
        self,
        index: int,
        unit: str | None,
        components: Mapping[str, Component],
        *,
        others: tuple[str, ...] = (),
        hysteresis: Quantity | None,
        warnings: tuple[str, ...],
    ) -> TemperatureModel:
        """Give the laws of one record their names and units.

        `components` are those of the values and of `others`, which follow no law.
        """
        own = self.intervals.of_record(index)
        units = [
            u for at, slope in law_units(unit).values() for u in (at, *(slope,) * len(self.sides))
        ]
        found = dict(zip(self.names, own.around(self.values[index], units), strict=True))
        k0, K1, delta = (
            TemperatureLaw(*(found.get(f"{law} {part}") for part in ("at_T0", "above", "below")))
            for law in LAWS
        )
        return TemperatureModel(
            k0,
            K1,
            delta,
            hysteresis,
            warnings,
            **covariance_fields((*self.names, *others), components),
        )


def named_model(
    values: Array,
    components: Mapping[str, Component],
    sides: Sequence[str],
    unit: str | None,
    *,
    hysteresis: Quantity | None,
    warnings: tuple[str, ...],
) -> TemperatureModel:
    """Name the parameters of the three laws of one record and give them their uncertainties.

    The values, shape (3 p,), are the value at T0 and the slopes of k0, of K1 and of delta, with
    components of their errors; the slopes of K1 are absolute here, and relative in the model.
    """
    of_scale_factor = slice(1 + len(sides), 2 * (1 + len(sides)))
    relative, jacobian = values.copy(), np.eye(values.size)
    relative[of_scale_factor], own = relative_slopes(values[of_scale_factor])
    jacobian[of_scale_factor, of_scale_factor] = own
    shown = propagate(components, jacobian)
    intervals = Intervals(*(part[None] for part in interval_stack(shown)))
    laws = LawStack(tuple(sides), relative[None], intervals)
    return laws.model(0, unit, shown, hysteresis=hysteresis, warnings=warnings)


def relative_slopes(law: Array) -> tuple[Array, Array]:
    """Divide the slopes of a law, shape (..., p), by its value at T0, which stays what it is.

    With the law come its derivatives by what was given, shape (..., p, p).

    Examples
    --------
    >>> import numpy as np
    >>> relative_slopes(np.array([2.0, 6.0]))[0].tolist()
    [2.0, 3.0]
    """
    at_reference = law[..., :1]
    relative = law / at_reference
    jacobian = np.eye(law.shape[-1]) / at_reference[..., None]
    jacobian[..., 1:, 0] = -relative[..., 1:] / at_reference
    relative[..., 0], jacobian[..., 0, 0] = law[..., 0], 1.0
    return relative, jacobian
