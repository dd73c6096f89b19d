"""The model with effects in it, solved: the coefficients beside them, and the gap to the readings.

The gap is that of the readings that were fitted, and of those that the others predict.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import compress
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.base import BaseModel, solve
from accelcal.discovery.columns import cycle, lengths, scaled
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import Instance, columns_of
from accelcal.discovery.space import whitener_of
from accelcal.discovery.untold import Untold, not_shown, slopes, smooth
from accelcal.numerics.grouping import cells, grouped
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.findings import Change, Gap
from accelcal.results.quantity import Quantity

APART = 2.0
"""Standard uncertainties from which on a coefficient is another one."""

_DETERMINED = 1e-6
_RANK = 1e-9
_NO_TRACE = 1e-12
"""Length of a column over the longest, below which it is rounding."""

_WIDE = 30.0
"""Standard uncertainty of a free shift, over that which the readings of its run alone give it."""

_UNITS: Mapping[str, str] = {
    "K0": "g",
    "K1": "1",
    "K2": "g/g^2",
    "K3": "g/g^3",
    **dict.fromkeys(("M", "M_O", "M_P"), "rad"),
    **dict.fromkeys(("M_ip", "M_io"), "g/g^2"),
}


class Solution(NamedTuple):
    """The model with some effects, fitted to a record."""

    model: BaseModel  # the model with a column for each effect
    parameters: Array  # its parameters, (p,)
    residual: Array  # reading minus model, (n,) [g]
    chi2: float  # sum of squares of the residuals in the measure of the noise
    dof: int  # degrees of freedom of that
    instances: tuple[Instance, ...] = ()  # the effects


def solution(comparison: Comparison, instances: Sequence[Instance] = ()) -> Solution:
    """Fit the base model with some effects by generalised least squares."""
    c = comparison.model.conditions
    # an effect stands in the second bracket, which the gain multiplies
    inside = columns_of(instances, c) / c.gain[:, None]
    model = comparison.model.extended(inside, tuple(item.effect.id for item in instances))
    parameters = solve(model, comparison.space.whiten)
    residual = model.residual(parameters)
    chi2 = float((comparison.space.whiten(residual) ** 2).sum())
    dof = comparison.space.size - len(instances)
    return Solution(model, parameters, residual, chi2, dof, tuple(instances))


def changes(comparison: Comparison, before: Solution, after: Solution) -> tuple[Change, ...]:
    """Tell what effects change in the coefficients of the model, over K1 at T0.

    They are without uncertainty where the free shifts of the runs could as well take their part.
    """
    one, two = _coefficients(comparison, before), _coefficients(comparison, after)
    return tuple(Change(name, one[name], two[name]) for name in one if name in two)


def unlike(
    comparison: Comparison, some: Sequence[Instance], others: Sequence[Instance]
) -> tuple[str, ...]:
    """Coefficients that are not the same beside some effects and beside others.

    The slopes of the scale factor go with it, and are the same over it.
    """
    bare = solution(comparison)
    one, two = (changes(comparison, bare, solution(comparison, own)) for own in (some, others))
    pairs = zip(one, two, strict=True)
    unlike = [old.coefficient for old, new in pairs if apart(old, new) > APART]
    return tuple(name for name in unlike if not name.startswith("K1 "))


def apart(one: Change, other: Change) -> float:
    """Tell by how many standard uncertainties a coefficient is another one beside other effects."""
    uncertainty = one.after.standard_uncertainty
    if not uncertainty or one.after.value is None or other.after.value is None:
        return 0.0
    return abs(one.after.value - other.after.value) / uncertainty


def by_reading(comparison: Comparison, fit: Solution) -> Array:
    """Change of each parameter with each reading in units of its noise, shape (p, n)."""
    jacobian = comparison.space.whiten(fit.model.jacobian(fit.parameters))
    norms = _norms(jacobian)
    return np.asarray(np.linalg.pinv(jacobian / norms, rcond=_RANK) / norms[:, None])


def _coefficients(comparison: Comparison, fit: Solution) -> dict[str, Quantity]:
    open_ones = not_shown(comparison, fit.instances)
    own, by_shape = fit.model.jacobian(fit.parameters), _by_shapes(comparison, fit, open_ones)
    jacobian = comparison.space.whiten(np.hstack([own, by_shape]))
    parameters = np.concatenate([fit.parameters, np.zeros(by_shape.shape[1])])
    norms, rows = _norms(jacobian), len(jacobian)
    whole = np.vstack([jacobian / norms, _against_shifts(comparison.model, norms)])
    inverse = np.linalg.pinv(whole, rcond=_RANK)
    smallest = inverse[:, :rows] @ (jacobian @ parameters) / norms
    left_open = _left_open(comparison, fit, [one for one in open_ones if not one.tied])
    factor, dof = student_quantile(LEVEL, comparison.space.dof), float(comparison.space.dof)
    found = {}
    for name, weights in _functionals(comparison.model).items():
        functional = np.concatenate([weights, np.zeros(parameters.size - weights.size)])
        if np.isinf(norms[functional != 0.0]).any():
            continue  # no reading tells of it
        scaled = functional / norms
        through = scaled @ inverse
        missed = np.abs(through @ whole - scaled).max() > _DETERMINED * np.abs(scaled).max()
        by_readings, by_shifts = (float(part @ part) for part in np.split(through, [rows]))
        if missed or by_shifts > by_readings:
            found[name] = Quantity(float(functional @ smallest), None, _unit(name))
            continue
        by_untold = functional[: fit.parameters.size] @ left_open
        u = float(np.sqrt(by_readings + (by_untold**2).sum()))
        value = float(functional @ parameters)
        found[name] = Quantity(value, u, _unit(name), factor * u, dof)
    return found


def _by_shapes(comparison: Comparison, fit: Solution, open_ones: Sequence[Untold]) -> Array:
    """Change of the readings by each nonlinear parameter of the effects that they tell [g]."""
    c, found = comparison.model.conditions, [np.empty((len(comparison.record), 0))]
    held = {(one.place, one.parameter.name) for one in open_ones}
    sizes = fit.parameters[fit.parameters.size - len(fit.instances) :].tolist()
    for place, (item, size) in enumerate(zip(fit.instances, sizes, strict=True)):
        mixture = size * np.array(item.mixture)[np.flatnonzero(item.mixture)]
        told = [(place, p.name) not in held for p in smooth(item.effect)]
        found.append(slopes(item, mixture, c)[:, np.flatnonzero(told)])
    return np.hstack(found)


def _left_open(comparison: Comparison, fit: Solution, untold: Sequence[Untold]) -> Array:
    """What one standard uncertainty of each parameter that is not told does to all others."""
    found = [np.empty((fit.parameters.size, 0))]
    for one in untold:
        below, above = (solution(comparison, end).parameters for end in one.ends(fit.instances))
        found.append((above - below)[:, None] / 2.0)
    return np.hstack(found)


def _norms(jacobian: Array) -> Array:
    """Lengths of the columns; infinite for one that is zero but for rounding, which none tells."""
    norms = lengths(jacobian)
    return np.where(norms > _NO_TRACE * norms.max(), norms, np.inf)


def _against_shifts(model: BaseModel, norms: Array) -> Array:
    """Rows that hold the free shifts of the runs near zero, where the readings leave them open."""
    names = list(model.names)
    shifts = [i for i, name in enumerate(names) if name in names[:i] and np.isfinite(norms[i])]
    return np.asarray(np.eye(norms.size)[shifts] / _WIDE)


def _functionals(model: BaseModel) -> dict[str, Array]:
    """Weights of the parameters in each coefficient: the law and the mean over the runs."""
    names = list(model.names)
    found = {}
    for name in dict.fromkeys(compress(names, ~model.moving)):
        places = [i for i, other in enumerate(names) if other == name]
        weights = np.zeros(len(names))
        weights[places[0]] = 1.0
        if len(places) > 1:
            weights[places[1:]] = 1.0 / len(places[1:])
        found[name] = weights
    return found


def _unit(name: str) -> str:
    symbol, _, side = name.partition(" ")
    unit = _UNITS[symbol]
    return {"1": "1/degC"}.get(unit, f"{unit}/degC") if side else unit


_FOLDS = 10


def gap_of(fit: Solution, held_out: float | None) -> Gap:
    """Gap that a fit leaves, with that of readings left out."""
    return Gap(float(np.sqrt(np.mean(fit.residual**2))), held_out, fit.chi2 / fit.dof)


def gaps_along(comparison: Comparison, instances: Sequence[Instance], seed: int = 0) -> list[Gap]:
    """Gap without effects, with the first one, the first two, to all, see `held_out_rms`."""
    sets = [instances[:k] for k in range(len(instances) + 1)]
    held = held_out_rms(comparison, sets, seed)
    return [gap_of(solution(comparison, own), out) for own, out in zip(sets, held, strict=True)]


def held_out_rms(
    comparison: Comparison, sets: Sequence[Sequence[Instance]], seed: int = 0
) -> list[float | None]:
    """Rms of reading minus prediction, each reading predicted from other cycles [g].

    There is one for each set of effects in the model, whose sizes are fitted anew and nonlinear
    parameters kept; None where there is one cycle only. The seed is that of the cycle that is left
    out at each run, position and sense of rotation.
    """
    c = comparison.model.conditions
    jacobian = comparison.model.jacobian(comparison.parameters)
    models = [np.hstack([jacobian, columns_of(effects, c)]) for effects in sets]
    residual = comparison.residual
    models = [np.column_stack([scaled(own)[0], residual]) for own in models]
    squares, readings = np.zeros(len(sets)), 0
    for out in _folds(comparison, np.random.default_rng(seed)):
        others = whitener_of(comparison.spread.among(~out))
        for place, own in enumerate(models):
            known = others.whitened(own[~out])
            solved = np.linalg.lstsq(known[:, :-1], known[:, -1], rcond=_RANK)[0]
            missed = own[out, -1] - own[out, :-1] @ solved
            squares[place] += float(missed @ missed)
        readings += int(out.sum())
    return [float(np.sqrt(total / readings)) if readings else None for total in squares]


def _folds(comparison: Comparison, rng: np.random.Generator) -> Iterator[Mask]:
    """Readings left out in turn: in each cell another cycle, as a shuffled order has it.

    Of more than `_FOLDS` cycles, several are left out at a time.
    """
    c = comparison.model.conditions
    cycles = grouped(cycle(c))[0]
    if cycles.size < 2:
        return
    cell = cells(c.run, np.round(c.angle, 6), c.rotation)
    shift = rng.integers(cycles.size, size=int(cell.max()) + 1)
    turn = (np.searchsorted(cycles, cycle(c)) + shift[cell]) % cycles.size
    turn %= _FOLDS
    for fold in range(min(cycles.size, _FOLDS)):
        if (turn == fold).any() and (turn != fold).any():
            yield turn == fold
