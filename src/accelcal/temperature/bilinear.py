"""The bilinear law: a value at T0 and one slope on either side, continuous at T0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.uncertainty import Component, Interval, intervals, propagate
from accelcal.results.quantity import Quantity
from accelcal.results.temperature import BilinearLaw, TemperatureModel

__all__ = [
    "LEAST_RISE",
    "bilinear_design",
    "local_slopes",
    "measured_sides",
    "named_model",
    "quantity",
]

Array = NDArray[np.float64]

LEAST_RISE = 5.0
"""Levels closer to T0 than this tell no slope [degC]."""


def measured_sides(rise: Array) -> tuple[str, ...]:
    """Find the sides of T0 on which a slope can be had.

    Parameters
    ----------
    rise : ndarray
        T - T0 of the levels [degC].

    Returns
    -------
    tuple of str
        ``"above"`` and ``"below"``, as far as measured.

    Examples
    --------
    >>> import numpy as np
    >>> measured_sides(np.array([0.0, 60.0]))
    ('above',)
    """
    measured = {"above": rise.max() > LEAST_RISE, "below": rise.min() < -LEAST_RISE}
    return tuple(side for side, has in measured.items() if has)


def bilinear_design(rise: Array, sides: Sequence[str]) -> Array:
    """Columns of one law: value at T0, then the slopes that were measured.

    Parameters
    ----------
    rise : ndarray, shape (n,)
        T - T0 [degC].
    sides : sequence of str
        See `measured_sides`.

    Returns
    -------
    ndarray, shape (n, 1 + len(sides))
        Design matrix.

    Examples
    --------
    >>> import numpy as np
    >>> bilinear_design(np.array([-60.0, 0.0, 60.0]), ("above", "below")).tolist()
    [[1.0, 0.0, -60.0], [1.0, 0.0, 0.0], [1.0, 60.0, 0.0]]
    """
    parts = {"above": np.maximum(rise, 0.0), "below": np.minimum(rise, 0.0)}
    return np.column_stack([np.ones_like(rise), *(parts[side] for side in sides)])


def local_slopes(rise: Array, sides: Sequence[str]) -> Array:
    """Weights of a law's parameters in its slope at each temperature.

    Parameters
    ----------
    rise : ndarray, shape (n,)
        T - T0 [degC]; at T0 the mean of both slopes counts.
    sides : sequence of str
        See `measured_sides`.

    Returns
    -------
    ndarray, shape (n, 1 + len(sides))
        The slope at each temperature is this matrix times the parameters of the law.
    """
    near = np.abs(rise) < LEAST_RISE
    parts = {
        "above": np.where(near, 0.5, rise > 0.0),
        "below": np.where(near, 0.5, rise < 0.0),
    }
    return np.column_stack([np.zeros_like(rise), *(parts[side] for side in sides)])


def named_model(
    values: Array,
    components: Mapping[str, Component],
    sides: Sequence[str],
    unit: str | None,
    *,
    hysteresis: Quantity | None,
    warnings: tuple[str, ...],
    others: tuple[str, ...] = (),
) -> TemperatureModel:
    """Name the parameters of the three laws and give them their uncertainties.

    Parameters
    ----------
    values : ndarray, shape (3 p,)
        Value at T0 and slopes of k0, of K1 and of delta; the slopes of K1 are absolute.
    components : mapping of str to Component
        Components of their errors and, behind them, of those of `others`.
    sides : sequence of str
        See `measured_sides`.
    unit : str or None
        Output unit.
    hysteresis : Quantity or None
        h_T.
    warnings : tuple of str
        What is missing.
    others : tuple of str
        Names of what follows no law, but is correlated with the laws.

    Returns
    -------
    TemperatureModel
        Laws of k0, K1 and delta, with their covariance; the slopes of K1 are relative.
    """
    count = 1 + len(sides)
    shown_components = propagate(components, _relative_slopes(values, count, len(others)))
    found = intervals(shown_components)[: values.size]
    shown = values.copy()
    shown[count + 1 : 2 * count] /= values[count]
    output = f"{unit or 'output unit'}/g"
    k0, K1, delta = (
        _law(shown[i * count : (i + 1) * count], found[i * count : (i + 1) * count], sides, units)
        for i, units in enumerate((("g", "g/degC"), (output, "1/degC"), ("rad", "rad/degC")))
    )
    covariance = np.asarray(sum(part.covariance for part in shown_components.values()))
    known = bool(np.isfinite(covariance).all())
    names = [f"{law} {part}" for law in ("k0", "K1", "delta") for part in ("at_T0", *sides)]
    return TemperatureModel(
        k0,
        K1,
        delta,
        hysteresis,
        warnings,
        covariance_names=(*names, *others) if known else (),
        covariance_matrix=tuple(map(tuple, covariance.tolist())) if known else (),
    )


def _relative_slopes(values: Array, count: int, others: int) -> Array:
    """Derivative of the laws' parameters when the slopes of K1 are divided by K1 at T0."""
    jacobian = np.eye(values.size + others)
    at_reference = values[count]
    for row in range(count + 1, 2 * count):
        jacobian[row, row] = 1.0 / at_reference
        jacobian[row, count] = -values[row] / at_reference**2
    return jacobian


def _law(
    values: Array, found: Sequence[Interval], sides: Sequence[str], units: tuple[str, str]
) -> BilinearLaw:
    quantities = {
        name: quantity(float(value), interval, units[name != "at_T0"])
        for name, value, interval in zip(("at_T0", *sides), values, found, strict=True)
    }
    return BilinearLaw(*(quantities.get(name) for name in ("at_T0", "above", "below")))


def quantity(value: float, interval: Interval, unit: str) -> Quantity:
    """Join a value and its interval.

    Parameters
    ----------
    value : float
        The value.
    interval : Interval
        Its uncertainty.
    unit : str
        Its unit.

    Returns
    -------
    Quantity
        The value with its uncertainty.
    """
    dof = interval.dof if interval.dof is not None and np.isfinite(interval.dof) else None
    return Quantity(value, interval.standard, unit, interval.expanded, dof)
