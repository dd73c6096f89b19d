"""Errors of the readings: noise from replicates, and what is declared of head, launch, chamber.

The noise is judged by pure error: by what differs between readings of one position in one run,
reached in the same sense, after the mean of each cycle and a drift. It is never taken from the
residuals of a model, which may lack an effect.
"""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from accelcal.apparatus import SOURCE_UNITS, Apparatus
from accelcal.arrays import Array, Ints
from accelcal.discovery.columns import (
    cycle_of,
    dummies,
    following,
    head_columns,
    orthonormal,
    without,
)
from accelcal.discovery.space import Covariance
from accelcal.effects.conditions import Conditions
from accelcal.errors import InputError
from accelcal.estimate.declared_scatter import declared_scatter
from accelcal.estimate.noise import ALIKE, LEAST_NOISE
from accelcal.numerics.grouping import cells, distinct
from accelcal.numerics.lag_sums import neighbours, polynomial
from accelcal.plural import degrees_of_freedom
from accelcal.record import TumbleRecord
from accelcal.results.quantity import ErrorSource

FEWEST_REPLICATES = 8
"""Degrees of freedom of pure error below which nothing can be discovered."""

_OF_STEP = 1e-2
"""Part of a step of the readings below which replicates are alike, as below `LEAST_NOISE`."""

_MOST_NUMBERS = 2**26
"""Above it the columns of all that repeats take half a gigabyte, and there are several."""

_RHOS = np.linspace(-0.3, 0.9, 121)
_POSSIBLE = np.array([NormalDist().inv_cdf((k + 0.5) / 6) for k in range(6)])
"""Standard deviations from what is seen to correlations that are possible, each as likely."""

_CORRELATED = 2.6
"""Standard deviations of a correlation of neighbours from which on it is told."""

_LAGS = 40

_ROWS, _TOGETHER = 2000, 250
"""Rows of a projector that are enough to sum over all, and how many are worked out at a time."""

_TAILS = ((1.0, 5.0), (0.4, 9.0))
"""Excess kurtosis, and the Student distribution whose tails count from there on."""

_BEYOND_CHANCE = 2.5
"""Excess kurtosis over its standard deviation in normal noise from which on the tails are told."""


class ReadingNoise(NamedTuple):
    """Noise of the readings."""

    sigma: float  # standard deviation of one reading [g]
    rho: float
    """Correlation of one reading with the next in the order of measuring, 0 where it is not
    significant."""
    dof: int  # degrees of freedom of the pure error
    tails: float
    """Degrees of freedom of the Student distribution that has its tails; infinite if normal."""
    relative: Array | None = None
    """Standard deviation of each reading over sigma, as their std tell it, and the scatter of
    their runs; None where alike, (n,)."""
    possible: tuple[float, ...] = ()
    """Correlations that the replicates leave possible, each as likely; empty where it is known."""
    heavy: bool = False
    """Whether the tails are heavier than those of a normal one beyond chance; `tails` leans to the
    safe side before."""

    @property
    def remembers(self) -> bool:
        """Whether neighbours are correlated beyond chance; `rho` leans to the safe side before."""
        size = abs(self.rho)
        least = min((rho * np.sign(self.rho) for rho in self.possible), default=-np.inf)
        return bool(size > 0.0 and size * _POSSIBLE[-1] > _CORRELATED * (size - least))


def refuse_too_many(record: TumbleRecord) -> None:
    """Refuse readings of which each is held against too much that repeats."""
    readings, cycles = len(record), cycle_of(record.stroke)
    turns = cells(record.run, record.mounting, np.round(record.angle, 6), record.stroke % 2)
    repeating = int(turns.max()) + int(cells(record.run, cycles).max()) + 2
    if readings * repeating > _MOST_NUMBERS:
        raise InputError(
            f"{readings} readings, each of which is held against {repeating} positions and cycles"
            f" of runs: that takes matrices of {8e-9 * readings * repeating:.1f} GB; give those of"
            " some strokes or runs"
        )


def reading_noise(
    c: Conditions,
    residual: Array,
    all_that_repeats: Array,
    step: float,
    relative: Array | None = None,
) -> ReadingNoise:
    """Estimate the noise of the readings from their replicates.

    The residuals, shape (n,) [g], are those of some model that is the same for replicates, all that
    repeats, shape (n, k), is that of `accelcal.discovery.columns.saturated`, and the relative noise
    of the readings, shape (n,), that of `relative_noise` and `with_noise_of_runs`. Their step is in
    g.

    Raises
    ------
    InputError
        If there are too few replicates, or all are alike.

    Notes
    -----
    The correlation is that of an AR(1) process within each run for which the lag-1 sum of products
    of the pure error has its expectation; the pure error of independent readings is not
    independent, and its expectation says by how much. With the scatter of that sum in independent
    readings, it also tells which correlations are possible.
    """
    basis = orthonormal(in_units_of(relative, all_that_repeats))
    dof = residual.size - basis.shape[1]
    if dof < FEWEST_REPLICATES:
        moved = following(c).shape[1] > 0
        raise InputError(
            f"{residual.size} readings leave {degrees_of_freedom(max(dof, 0))} for their noise;"
            f" to discover an effect takes {FEWEST_REPLICATES} or more: measure"
            f" {'three' if moved else 'two'} or more cycles of a forward and a back stroke in each"
            f" run{', as the recorded temperature moves, or hold it' if moved else ''}"
        )
    basis = basis[c.order]
    error = without(in_units_of(relative, residual)[c.order], basis)
    rho, variance, possible = _autocorrelation(error, basis, c.run[c.order])
    if not np.sqrt(variance) > max(LEAST_NOISE, _OF_STEP * step):
        raise InputError(ALIKE)
    excess, by_chance = _excess_kurtosis(error, basis, variance)
    heavy = excess > _BEYOND_CHANCE * by_chance
    sigma = float(np.sqrt(variance))
    tails = next((freedom for least, freedom in _TAILS if excess > least), np.inf)
    return ReadingNoise(sigma, rho, dof, tails, relative, possible, heavy)


def _excess_kurtosis(error: Array, basis: Array, variance: float) -> tuple[float, float]:
    """Excess kurtosis of the noise, of which the pure error is a mixture, and what chance makes.

    The fourth Hermite polynomials of normal numbers with the correlations P have the covariances
    24 P^4, element by element; their sum of those is the standard deviation in normal noise.
    """
    free = 1.0 - (basis**2).sum(axis=1)
    fourth = float((error**4).sum() - 3.0 * ((free * variance) ** 2).sum())
    powers = _fourth_powers(basis)
    return fourth / (powers * variance**2), math.sqrt(24.0 / powers)


def _fourth_powers(basis: Array) -> float:
    """Sum of the fourth powers of what projects beside an orthonormal basis, by some of its rows.

    They are all rows up to `_ROWS`, and every so many beyond.
    """
    every = -(-len(basis) // _ROWS)
    total = 0.0
    for start in range(0, len(basis), every * _TOGETHER):
        rows = np.arange(start, min(start + every * _TOGETHER, len(basis)), every)
        projector = -basis[rows] @ basis.T
        projector[np.arange(rows.size), rows] += 1.0
        total += float(((projector**2) ** 2).sum())
    return total * len(basis) / -(-len(basis) // every)


def _autocorrelation(
    error: Array, basis: Array, run: Ints
) -> tuple[float, float, tuple[float, ...]]:
    """Correlation of neighbours, the variance, and which correlations are possible.

    The first two have their expectations matched, see `accelcal.numerics.lag_sums.neighbours`.
    """
    found = neighbours(basis, run, _LAGS)
    squares = polynomial(found.squares, _RHOS)
    expected = polynomial(found.products, _RHOS) / squares
    products = float((error[1:] * error[:-1])[run[1:] == run[:-1]].sum())
    observed = products / (float(error @ error) or np.inf)
    dof, none = found.squares[0], int(np.argmin(np.abs(_RHOS)))
    scatter = np.sqrt(found.of_ratio(expected[none]))
    possible = np.interp(observed + scatter * _POSSIBLE, expected, _RHOS)
    best = int(np.argmin(np.abs(expected - observed)))
    if abs(_RHOS[best]) < 2.0 / np.sqrt(dof):
        best = none
    rho = float(np.round(_RHOS[best], 6))
    return rho, float(error @ error / squares[best]), tuple(possible.tolist())


def sources(
    noise: ReadingNoise,
    counted: Apparatus,
    record: TumbleRecord,
    *,
    free: bool = False,
    unrepeated: str = "calibration",
) -> tuple[ErrorSource, ...]:
    """Tell the errors of the readings with where they come from.

    Of the errors that count, the record declares some and the calibration knew others. Launches
    that do not count are `free` in each run where they are so, whatever is declared. The noise is
    that of replicates, or of what is `unrepeated`.
    """
    repeated = noise.dof >= FEWEST_REPLICATES
    dof, origin = (float(noise.dof), "replicates") if repeated else (None, unrepeated)
    found = [ErrorSource("reading", noise.sigma, "g", dof, origin)]
    for name, unit in SOURCE_UNITS.items():
        own, size = (getattr(of, f"{name}_uncertainty") for of in (record.apparatus, counted))
        if size is not None:
            origin = "calibration" if own is None else "declared"
        else:
            origin = "free in each run" if free and name.startswith("launch") else "none"
        found.append(ErrorSource(name, own if size is None else size, unit, None, origin))
    return tuple(found)


def covariance(
    c: Conditions, noise: ReadingNoise, declared: Apparatus, step: float = 0.0
) -> Covariance:
    """Covariance of the errors of n readings.

    What is not declared of head, launch and temperature counts as zero. Where the step of the
    readings [g] is coarser than their noise, a rounding error repeats in readings of one angle in a
    run.
    """
    rounding = step / np.sqrt(12.0) if step > noise.sigma else 0.0
    sizes = [(getattr(declared, name), columns) for name, columns in acting(c).items()]
    sizes.append((rounding, dummies(c.run, np.round(c.angle, 6))))
    return Covariance(
        noise=noise.sigma * (np.ones(c.run.size) if noise.relative is None else noise.relative),
        rho=noise.rho,
        run=c.run,
        number=c.number,
        shared=np.hstack([np.empty((c.run.size, 0)), *(size * own for size, own in sizes if size)]),
    )


def memory(c: Conditions, rho: float, relative: Array | None = None) -> Array:
    """Covariance of readings of an AR(1) process in each run, of such relative noise, (n, n)."""
    powers = rho ** np.arange(c.number.size)
    correlation = np.zeros((c.number.size, c.number.size))
    for run in distinct(c.run).tolist():
        own = np.flatnonzero(c.run == run)
        correlation[own[:, None], own] = powers[np.abs(c.number[own, None] - c.number[own])]
    return correlation if relative is None else correlation * np.outer(relative, relative)


def acting(c: Conditions) -> dict[str, Array]:
    """What errors of head, launches and chamber do to n readings, by their names in `Apparatus`.

    There is a column for each of k errors of one size, shape (n, k) [g per unit].
    """
    runs = dummies(c.run)
    return {
        "head_uncertainty": head_columns(c),
        "launch_uncertainty": c.gain[:, None] * runs,
        "launch_sf_uncertainty": (c.gain * c.indicated)[:, None] * runs,
        "temperature_uncertainty": (c.gain * c.per_degree)[:, None] * runs,
    }


_ALIKE = 1e-9


def relative_noise(record: TumbleRecord) -> Array | None:
    """Standard deviation of each reading by its std and n, over the root mean square of all.

    It is None where not all readings have a std, or all are alike. Those of few samples are drawn
    together where they differ by chance, see `accelcal.estimate.declared_scatter`.
    """
    if record.std is None:
        return None
    size = np.empty(len(record))
    for mask in record.table_masks():
        found = declared_scatter(record.select(mask))
        if found.dof is None:
            return None
        size[mask] = found.size
    relative = size / np.sqrt(np.mean(size**2))
    return relative if np.ptp(relative) > _ALIKE else None


def in_units_of(relative: Array | None, values: Array) -> Array:
    """Values of readings, shape (n,) or (n, k), over the noise of each; as they are without it."""
    if relative is None:
        return values
    return np.asarray(values / (relative if values.ndim == 1 else relative[:, None]))
