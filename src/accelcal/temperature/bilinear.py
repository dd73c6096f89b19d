"""The bilinear law, continuous at T0, and the generalised least squares that fit it."""

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
from accelcal.numerics.probability import f_survival
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


_ALMOST_NOTHING = 1e-12  # added to a diagonal of ones, so that the matrix stays definite


def law_maps(law: Array, pairs: Array, covariance: Array) -> Array:
    """Find the maps from n tables to the laws of k0, K1 and delta, and to the half widths of k0.

    The columns of one law, shape (R, n, p) or (1, n, p), are those of
    `accelcal.reference.bilinear_design`; those of the half widths, (n, L), are of
    `accelcal.temperature.weaknesses.Branches`. The covariance of the tables in each quantity, of
    shape (R, 3, n, n), is NaN where unknown. The maps, (R, 3, p + L, n), are zero for half widths
    of K1 and delta; axes of R and of 3 have the length 1 where they are alike.

    Notes
    -----
    Each law is solved by itself: the correlations between them are weak, and their uncertainties
    may differ by many powers of ten.
    """
    design = law[:, None]
    if not pairs.shape[1]:
        return _generalised(design, covariance)
    of_bias = _generalised(with_columns(design, pairs), covariance[:, :1])
    others = _generalised(design, covariance[:, 1:])
    maps = np.zeros((len(covariance), 3, *of_bias.shape[2:]))
    maps[:, :1] = of_bias
    maps[:, 1:, : law.shape[2]] = others
    return maps


def with_columns(law: Array, more: Array) -> Array:
    """Columns of laws, shape (..., n, p), and behind them more of all laws, shape (n, L)."""
    wide = np.broadcast_to(more, (*law.shape[:-1], more.shape[1]))
    return np.concatenate([law, wide], axis=-1)


def _generalised(design: Array, covariance: Array) -> Array:
    """Generalised least-squares maps, (..., parameters, n); plain where the weights are unknown.

    As many tables as parameters leave nothing to weigh.
    """
    size, count = design.shape[-2:]
    if size == count:
        return np.asarray(np.linalg.inv(design))
    variance = np.linalg.diagonal(covariance)
    known = np.asarray(np.isfinite(covariance).all(axis=(-2, -1)) & (variance > 0.0).all(axis=-1))
    sigma = np.sqrt(np.where(known[..., None], variance, 1.0))
    among = covariance / (sigma[..., None] * sigma[..., None, :])
    least = np.where(known, _ALMOST_NOTHING, 1.0)[..., None, None] * np.eye(size)
    root = np.linalg.cholesky(np.where(known[..., None, None], among, 0.0) + least)
    inverse = np.linalg.inv(root)
    whitened = inverse @ (design / sigma[..., None])
    norms = np.sqrt((whitened**2).sum(axis=-2, keepdims=True))  # as slopes are tiny
    basis, triangle = np.linalg.qr(whitened / norms)
    solved = np.linalg.solve(triangle, basis.mT) / norms.mT
    return np.asarray(solved @ inverse / sigma[..., None, :])


def misfit(left: Array, covariance: Array) -> Array:
    """Chi-squared of what is left, shape (R, n), in its covariance, shape (R, n, n): shape (R,).

    The covariance may be singular; where it is unknown, so is chi-squared, NaN.
    """
    known = np.asarray(np.isfinite(covariance).all(axis=(1, 2)))
    inverse = np.linalg.pinv(np.where(known[:, None, None], covariance, 0.0), hermitian=True)
    squares = (left[:, None] @ inverse @ left[..., None])[:, 0, 0]
    return np.where(known, squares, np.nan)


def contrasts_of(design: Array) -> Array:
    """Orthonormal combinations of n values that a law leaves at zero, shape (..., n - p, n).

    The columns of the law, shape (..., n, p), are of full rank.
    """
    basis = np.linalg.svd(design)[0]
    return np.asarray(basis[..., design.shape[-1] :].mT)


def chance_of_misfit(values: Array, components: Mapping[str, Component], contrasts: Array) -> Array:
    """Probability that contrasts which are zero come out as large, shape (R,).

    The values are estimates of R records, shape (R, n), with the components of their errors; the
    contrasts, shape (..., m, n), are alike in all records or not. It is NaN where an error is
    unknown.

    Notes
    -----
    Fisher's F with m and as many degrees of freedom as the components have in the harmonic mean,
    weighted by their shares in the expected sum of squares. A chi-squared test would take
    variances as known that the same few replicates tell.

    Examples
    --------
    >>> import numpy as np
    >>> launch = Component(np.eye(3)[None], np.full((1, 3), 2.0))
    >>> line = contrasts_of(np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]))
    >>> float(chance_of_misfit(np.array([[0.0, 6.0, 0.0]]), {"launch": launch}, line)[0].round(4))
    0.0392
    """
    seen = propagate(components, contrasts)
    covariance = np.asarray(sum(part.covariance for part in seen.values()))
    count = contrasts.shape[-2]
    squares = misfit(np.einsum("...mn,...n->...m", contrasts, values), covariance)
    inverse = np.linalg.pinv(np.nan_to_num(covariance), hermitian=True)
    over_dof = np.zeros(squares.shape)
    for part in seen.values():
        share = np.einsum("...ij,...ji->...", inverse, part.covariance) / count
        over_dof = over_dof + share / part.dof.min(axis=-1)
    dof = np.divide(1.0, over_dof, out=np.full(squares.shape, np.inf), where=over_dof > 0.0)
    dof = np.maximum(dof, 1.0)
    return f_survival(np.asarray(squares / count), float(count), dof)
