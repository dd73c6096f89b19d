"""All readings of many records fitted by the product model, each reading at its own temperature.

The whole model is a product, nonlinear in its parameters:

    Y = K1(T) [k0(T) + a_i + k2 a_i^2 + k3 a_i^3 + delta(T) a_p + delta_ip a_i a_p]

with bilinear k0, K1 and delta, and with k2, k3 and delta_ip the same at all temperatures. It is
solved by Gauss-Newton steps of generalised least squares, in which the errors of head, launches
and temperatures stand as unknowns of known size, and the parts of the recorded deviations of
temperature that the runs felt.

The unknowns of a record are some dozens. They are solved by their normal equations, whose matrices
are products, with the columns brought to one size. The errors have pseudo-readings, and the next
step mends what the last one rounded.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Mask
from accelcal.errors import DesignError
from accelcal.temperature.product.errors import (
    PRIOR,
    ProductFit,
    ReadingErrors,
    Sizes,
    Solution,
    errors_at,
    sizes_at,
)
from accelcal.temperature.product.model import Block, HeadErrors, Point, times

_MOST_STEPS = 30
_SURE = 3.0  # standard uncertainties by which a scale factor must differ from zero
_CONVERGED = 1e-6  # of the noise of a reading; less than that would the next step move it
_AT_A_TIME = 8192  # readings; with some dozens of columns each, they take 2 MB


def solved(fit: ProductFit, laws: Array) -> Solution:
    """Find the parameters, and the parts of the deviations of temperature that were felt.

    The steps start from laws, shape (R, 3 p), with the slopes of K1 relative. A record comes out
    the same whatever the others are.
    """
    state, moved = _start(fit, laws), np.zeros(len(laws))
    left, blocks = np.arange(len(laws)), fit.head.blocks(_AT_A_TIME)
    for _ in range(_MOST_STEPS):
        part, before = fit.of_records(left), Solution(*(values[left] for values in state))
        after, now = _step(part, before, blocks)
        for whole, new in zip(state, after, strict=True):
            whole[left] = new
        shorter = np.divide(now, moved[left], out=np.ones_like(now), where=moved[left] > now)
        moved[left] = now
        left = left[now * shorter >= _CONVERGED]  # where the next step would still move something
        if not left.size:
            break
    return state


def scale_factor_is_told(value: ArrayLike, uncertainty: ArrayLike) -> Mask:
    """Tell whether a scale factor is not 0: slopes relative to 0 lead the steps anywhere.

    K1 at T0 and its standard uncertainty are of shape (R,); an uncertainty of NaN, which is
    unknown, counts as small.

    Examples
    --------
    >>> scale_factor_is_told([1.35, 1e-4, 1.35], [1e-5, 1e-4, float("nan")]).tolist()
    [True, False, True]
    """
    return ~np.asarray(np.abs(value) < _SURE * np.asarray(uncertainty, dtype=np.float64))


def _start(fit: ProductFit, laws: Array) -> Solution:
    """What is common to all temperatures starts at 0; the deviations, as if felt in full."""
    common = np.zeros((len(laws), len(fit.readings.common)))
    p = laws.shape[1] // 3
    parameters = np.concatenate([laws, common], axis=1)
    parameters[:, p + 1 : 2 * p] *= laws[:, p, None]
    in_full = np.ones((len(laws), len(fit.tables)))
    return Solution(parameters, in_full, np.zeros_like(in_full))


def _step(fit: ProductFit, state: Solution, blocks: Sequence[Block]) -> tuple[Solution, Array]:
    """One step, and the most by which it moved a reading of each record, in units of the noise."""
    point = fit.readings.at(state.felt, state.parameters)
    sizes = sizes_at(fit, state, point)

    def of(block: Block) -> _Columns:
        own = point.of_rows(block.rows), sizes.of_rows(block.rows)
        return _Columns.of(fit.of_block(block), state, *own)

    columns = of if len(blocks) > 1 else _kept(of(blocks[0]))
    step, felt, doubt = _System.of(fit.head, blocks, columns).solve()
    found = Solution(state.parameters + step, PRIOR * (1.0 + felt), PRIOR * doubt)
    felt = (found.felt - state.felt) / PRIOR
    return found, np.max([columns(block).moved(step, felt) for block in blocks], axis=0)


class _Columns(NamedTuple):
    """Columns over the noise: of parameters, shared errors, felt parts, and what is left."""

    values: Array  # shape (R, k + 1, n): the columns
    parameters: int  # how many of them are of parameters
    errors: ReadingErrors

    @classmethod
    def of(cls, fit: ProductFit, state: Solution, point: Point, sizes: Sizes) -> _Columns:
        errors = errors_at(fit, state, point, sizes)
        jacobian = point.jacobian
        away = fit.readings.output - point.model
        away += times(state.felt / PRIOR - 1.0, errors.felt)
        parts = [jacobian, *errors.shared.values(), errors.felt, away[:, None]]
        values = np.concatenate(parts, axis=1)
        values /= errors.sizes.noise[:, None]
        return cls(values, jacobian.shape[1], errors)

    @property
    def head(self) -> HeadErrors:
        """Errors of the head over the noise."""
        return self.errors.head.over(self.errors.sizes.noise)

    @property
    def felt(self) -> int:
        """Number of felt parts."""
        return int(self.errors.felt.shape[1])

    def moved(self, step: Array, felt: Array) -> Array:
        """Tell by how much a step of the parameters and of the felt parts moved a reading."""
        moved = times(step, self.values[:, : self.parameters])
        moved += times(felt, self.values[:, -1 - self.felt : -1])
        return np.asarray(np.abs(moved).max(axis=1))


_ColumnsOf = Callable[[Block], _Columns]


def _kept(columns: _Columns) -> _ColumnsOf:
    """Give the columns of the only block."""
    return lambda _: columns


class _System(NamedTuple):
    """Normal equations of the columns, those of parameters of size one, and what is left."""

    normal: Array
    right: Array
    size: Array
    felt: int

    @classmethod
    def of(cls, head: HeadErrors, blocks: Sequence[Block], columns: _ColumnsOf) -> _System:
        products, first = _products(head, blocks, columns), columns(blocks[0])
        count, unknowns = first.parameters, products.shape[1] - 1
        size = np.sqrt(np.linalg.diagonal(products)[:, :count])
        products[:, :count] /= size[..., None]
        products[:, :, :count] /= size[:, None]
        prior = np.arange(count, unknowns)
        products[:, prior, prior] += 1.0
        return cls(products[:, :-1, :-1], products[:, :-1, -1], size, first.felt)

    def solve(self) -> tuple[Array, Array, Array]:
        """Step of the parameters and of the felt parts, and the uncertainty of these."""
        felt = self.felt
        right = np.zeros((*self.right.shape, 1 + felt))
        right[..., 0] = self.right
        right[:, -felt:, 1:] = np.eye(felt)
        found = self._solved(right)
        of_felt = found[:, -felt:]
        variance = np.linalg.diagonal(of_felt[..., 1:])
        doubt = np.sqrt(np.clip(variance, 0.0, 1.0))  # 1 before the fit
        return found[:, : self.size.shape[1], 0] / self.size, of_felt[..., 0], doubt

    def map(self, columns: _Columns) -> Array:
        """The step of the parameters as a matrix, shape (R, 3 p + c, n)."""
        errors, count = columns.errors, columns.parameters
        free = errors.head.apart(columns.values[:, :-1], errors.sizes.noise)
        free[:, :count] /= self.size[..., None]
        found = self._solved(free)[:, :count]
        found /= self.size[..., None]
        rows = errors.head.apart(found, errors.sizes.noise)
        return np.asarray(rows / errors.sizes.noise[:, None])

    def _solved(self, right: Array) -> Array:
        try:
            return np.asarray(np.linalg.solve(self.normal, right))
        except np.linalg.LinAlgError:
            raise DesignError(
                "the readings do not determine the temperature laws; measure at more temperatures"
            ) from None


def _products(head: HeadErrors, blocks: Sequence[Block], columns: _ColumnsOf) -> Array:
    """Products of the columns, with the errors of the head taken for noise as well."""
    records, width = head.acting.shape[0], columns(blocks[0]).values.shape[1]
    sums = np.zeros((records, width, head.positions.key.size))
    squares = np.zeros((records, 1, head.positions.key.size))
    for block in blocks:
        own = columns(block)
        sums[..., block.positions.key] += own.head.sums(own.values)
        squares[..., block.positions.key] += own.head.squares
    common = head.common(sums, squares)
    products = np.zeros((records, width, width))
    for block in blocks:
        own = columns(block)
        free = own.head.freed(own.values, common[..., block.positions.key])
        products += free @ free.mT
    return products


def estimator(fit: ProductFit, state: Solution) -> tuple[Array, ReadingErrors]:
    """Linearise the fit at its solution, and tell the errors of the readings there.

    The map, shape (R, 3 p + c, n), takes changes of the readings to those of the parameters.
    """
    point = fit.readings.at(state.felt, state.parameters)
    columns = _Columns.of(fit, state, point, sizes_at(fit, state, point))
    whole = fit.head.blocks(fit.head.positions.cell.size)
    return _System.of(fit.head, whole, _kept(columns)).map(columns), columns.errors
