"""Many tables of one design at once: coefficients, residual scatter and standard uncertainties."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.arguments.kinds import as_given, several
from accelcal.arguments.numbers import check_whole, number_array, refuse_other_order
from accelcal.arguments.options import check_flag
from accelcal.arrays import Array, Ints, equal
from accelcal.errors import InputError
from accelcal.estimate.estimability import estimability
from accelcal.estimate.robust import pseudo_values
from accelcal.estimate.solver import LeastSquares, Solution
from accelcal.geometry import accelerations
from accelcal.head_angles import head_positions
from accelcal.model import COEFFICIENTS, design_matrix
from accelcal.plural import counted, listed

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["TableEstimates", "estimate_tables"]

# Tables at a time. OpenBLAS leaves products of 6 coefficients at 9 positions to one thread up to
# 4854 tables. Above 4096, half its buffer, numpy broadcasts rows without copying them.
_BLOCK = 4800
_ROBUST_BLOCK = 2048  # a robust fit works on all pairs of replicates, so fewer fill the cache
_READINGS = 500_000  # at a time at most, 4 MB


class TableEstimates(NamedTuple):
    """Estimates of T tables.

    Attributes
    ----------
    names : tuple of str
        The p coefficients that are estimated.
    coefficients : ndarray, shape (T, p)
        Their values; NaN in a table whose gaps leave too few readings [output unit / g^n].
    standard_uncertainties : ndarray, shape (T, p)
        Standard uncertainties by the scatter of the residuals alone; NaN where a table has no more
        readings than coefficients [output unit / g^n].
    residual_rms : ndarray, shape (T,)
        Root of the sum of squared residuals over `dof` [output unit; units of `std` where given];
        NaN where `dof` is 0.
    dof : ndarray of int, shape (T,)
        Readings minus coefficients, not below zero.
    stands_for : mapping of str to str
        What a coefficient really tells where the angles do not separate it from one left out.

    Examples
    --------
    >>> import accelcal
    >>> plan = accelcal.TumblePlan(temperatures=(20.0,))
    >>> records = [accelcal.simulate(plan=plan, seed=seed) for seed in (1, 2)]
    >>> found = accelcal.estimate_tables([record.output for record in records], records[0].angle)
    >>> found.names[1], found.coefficients[:, 1].round(3).tolist()
    ('K1', [1.35, 1.35])
    """

    names: tuple[str, ...]
    coefficients: Array
    standard_uncertainties: Array
    residual_rms: Array
    dof: Ints
    stands_for: Mapping[str, str]

    def __eq__(self, other: object) -> bool:
        return equal(tuple(self), other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __repr__(self) -> str:
        return f"<TableEstimates: {counted(len(self.dof), 'table')}, {listed(self.names)}>"

    def to_frame(self, index: Any = None) -> pd.DataFrame:
        """Return a DataFrame of a row a table: ``K0``, ``u(K0)`` ... ``residual_rms``, ``dof``.

        Parameters
        ----------
        index : pandas.Index or array_like of shape (T,), optional
            Index of the rows, such as that of the frame of the outputs; numbers from 0 by default.

        Returns
        -------
        pandas.DataFrame
            The estimates.

        Raises
        ------
        InputError
            If the index has not a label for each table.
        """
        import pandas as pd

        values, errors = self.coefficients.T, self.standard_uncertainties.T
        columns = dict(zip(self.names, values, strict=True))
        columns |= dict(zip([f"u({name})" for name in self.names], errors, strict=True))
        columns |= {"residual_rms": self.residual_rms, "dof": self.dof}
        try:
            return pd.DataFrame(columns).set_axis(range(len(self.dof)) if index is None else index)
        except (TypeError, ValueError):
            rule = f"a label for each of the {len(self.dof)} tables"
            raise InputError(f"index is {as_given(index)}; it has {rule}") from None


def estimate_tables(
    output: ArrayLike,
    angle: ArrayLike,
    *,
    mounting: str = "o+",
    delta0: float = 0.0,
    std: ArrayLike | None = None,
    coefficients: Sequence[str] = COEFFICIENTS,
    robust: bool = False,
    threads: int = 1,
) -> TableEstimates:
    """Estimate the coefficients of many tables of one design, by least squares.

    Parameters
    ----------
    output : array_like, shape (T, n)
        Readings, a row a table; NaN where one is missing [output unit].
    angle : array_like, shape (n,)
        Head angle of each reading [deg].
    mounting : str, default "o+"
        Mounting of all tables, one of `accelcal.geometry.MOUNTINGS`.
    delta0 : float, default 0
        Fixture angle [rad].
    std : array_like, shape (n,) or (T, n), optional
        Standard uncertainty of each reading, or anything proportional to it [output unit].
    coefficients : sequence of str, default all six
        Coefficients to estimate; the others are taken as zero.
    robust : bool, default False
        Make the readings safe against outliers by their replicates first.
    threads : int, default 1
        Threads that share the tables. On two processors two help with gaps and with robust fits,
        not with complete tables (``benchmarks/batch.py``): what is done with these is too short.

    Returns
    -------
    TableEstimates
        Coefficients, standard uncertainties and residual scatter of each table.

    Raises
    ------
    InputError
        If a shape does not fit, the columns of a DataFrame are the angles in another order, the
        frames of `output` and `std` have different indices, a reading is infinite or of a size far
        from any unit, or a `std` is not above zero.
    DesignError
        If the angles do not determine K1; if `robust` and no position has three readings.

    See Also
    --------
    accelcal.fit : One record with all of its errors, which are nested, see Notes.

    Notes
    -----
    Equation (1) fitted to the readings of (5), each table by itself, all by the same products with
    one matrix; tables with gaps or with a `std` of their own by normal equations in an orthonormal
    basis. A table comes out the same whatever the others are, but for the rounding of a number.

    The uncertainties hold what is new in each reading. What all strokes have in common, an error of
    the head above all, they leave out; `accelcal.fit` has it.

    Examples
    --------
    A thousand tables of 9 readings, of which one lacks its last:

    >>> import numpy as np
    >>> import accelcal
    >>> from accelcal.head_angles import turn_angles
    >>> truth = accelcal.output({"K0": 0.004, "K1": 1.3}, accelcal.accelerations(turn_angles()))
    >>> y = truth + 5e-6 * np.random.default_rng(1).standard_normal((1000, 9))
    >>> y[0, 8] = np.nan
    >>> found = accelcal.estimate_tables(y, turn_angles())
    >>> (found.coefficients.mean(axis=0).round(5) + 0.0).tolist()
    [0.004, 1.3, 0.0, 0.0, 0.0, 0.0]
    >>> found.dof[:2].tolist()
    [2, 3]
    """
    check_flag(robust=robust)
    check_whole(1, threads=threads)
    y, degrees = _checked(output, angle)
    _refuse_other_angles("std", std, degrees)
    refuse_other_order({"output": output, "std": std} if hasattr(std, "columns") else {})
    spread = np.ones(degrees.size) if std is None else _checked_std(std, y)
    design = design_matrix(accelerations(degrees, delta0, mounting), mounting)
    kept = estimability(design, several(coefficients))
    solver = LeastSquares(design[:, kept.columns], spread if spread.ndim == 1 else 1.0)
    stack = _Stack(solver, y, spread, head_positions(degrees) if robust else None)
    return TableEstimates(kept.kept, *stack.estimates(threads), kept.stands_for)


class _Stack(NamedTuple):
    """Tables of one design, with what is declared of all readings or of each by itself."""

    solver: LeastSquares
    outputs: Array
    spread: Array
    cells: Array | None

    @property
    def block(self) -> int:
        """Tables at a time."""
        most = _BLOCK if self.cells is None else _ROBUST_BLOCK
        readings: int = self.outputs.shape[1]
        return max(min(most, _READINGS // readings), 1)

    def estimates(self, threads: int) -> tuple[Array, Array, Array, Ints]:
        """Coefficients, their uncertainties, residual rms and dof, in the order of the tables."""
        tables, coefficients = len(self.outputs), self.solver.map.shape[0]
        values, errors = np.empty((2, coefficients, tables))
        found = (values.T, errors.T, np.empty(tables), np.empty(tables, dtype=np.int64))
        threads = min(int(threads), -(-tables // self.block))
        if threads <= 1:
            self._fill(found, 0, tables)
            return found
        from concurrent.futures import ThreadPoolExecutor

        edges = np.linspace(0, tables, threads + 1).astype(int).tolist()
        with ThreadPoolExecutor(threads) as pool:  # products of matrices let other threads run
            list(pool.map(lambda *span: self._fill(found, *span), edges[:-1], edges[1:]))
        return found

    def _fill(self, found: Sequence[NDArray[Any]], start: int, stop: int) -> None:
        for at in range(start, stop, self.block):
            rows = slice(at, min(at + self.block, stop))
            _with_scatter(self._fit(rows), *[whole[rows] for whole in found])

    def _fit(self, rows: slice) -> Solution:
        y = self.outputs[rows]
        spread = self.spread[rows] if self.spread.ndim == 2 else self.spread
        with np.errstate(over="ignore", invalid="ignore"):
            if self.cells is not None:
                y = pseudo_values(y, self.cells, spread)
            weight = None if spread.ndim == 1 else np.where(np.isnan(y), np.inf, spread) ** -2.0
            found = self.solver.fit(y, weight)
        size = np.abs(found.coefficients.T).max(axis=0)
        if not (found.squares.max() < np.inf and size.min() > 1e-20 and size.max() < 1e20):
            _check_sizes(self.outputs[rows])
        return found


def _check_sizes(y: Array) -> None:
    largest = np.fmax.reduce(np.abs(y), axis=1)  # looks at all readings, so only where in doubt
    if np.isinf(largest).any():
        raise InputError("an output is infinite; a reading that is missing is NaN")
    extreme = largest[(largest > 0.0) & ~((largest > 1e-20) & (largest < 1e20))]
    if extreme.size:
        raise InputError(
            f"outputs of up to {extreme[0]:g}; they lie between 1e-20 and 1e20, so give them in"
            " another unit"
        )


def _with_scatter(found: Solution, values: Array, errors: Array, rms: Array, dof: Ints) -> None:
    """Fill in coefficients, their uncertainties by the residuals, residual rms and dof."""
    values[:] = found.coefficients
    np.subtract(found.readings, values.shape[1], out=dof)
    np.divide(found.squares, np.where(dof > 0, dof, np.nan), out=rms)
    np.sqrt(rms, out=rms)
    np.multiply(np.sqrt(found.variances), rms[:, None], out=errors)
    np.maximum(dof, 0, out=dof)


def _checked(output: ArrayLike, angle: ArrayLike) -> tuple[Array, Array]:
    y, degrees = number_array(output, "output"), number_array(angle, "angle")
    if y.ndim != 2 or degrees.shape != y.shape[1:]:
        raise InputError(
            f"output of shape {y.shape} with angle of shape {degrees.shape}; the output has a row"
            " a table and a column for each angle"
        )
    _refuse_other_angles("output", output, degrees)
    return y, degrees


def _refuse_other_angles(name: str, given: Any, degrees: Array) -> None:
    """Refuse a DataFrame whose columns are the angles in another order, as numbers or text."""
    try:
        named = [float(column) for column in getattr(given, "columns", ())]
    except (TypeError, ValueError):  # which are named by something else
        return
    if named != degrees.tolist() and sorted(named) == sorted(degrees.tolist()):
        problem = f"the columns of {name} are the angles in another order"
        raise InputError(f"{problem}; order them so, or give angle=frame.columns.astype(float)")


def _checked_std(std: ArrayLike, y: Array) -> Array:
    spread = number_array(std, "std")
    if spread.shape not in (y.shape, y.shape[1:]):
        raise InputError(f"std has shape {spread.shape}; it is {y.shape[1:]} or {y.shape}")
    known = spread[~np.isnan(y)] if spread.ndim == 2 else spread
    if not ((known > 0.0) & np.isfinite(known)).all():
        raise InputError("a std is not above zero; give that of each reading that is there")
    if not ((known >= 1e-40) & (known <= 1e20)).all():
        raise InputError(
            f"std from {known.min():g} to {known.max():g}; it lies between 1e-40 and 1e20"
        )
    return spread
