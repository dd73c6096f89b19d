"""Reading noise: the part of the errors that is new in each reading."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import compress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.tables import PreparedTable
from accelcal.grouping import grouped
from accelcal.probability import f_survival

__all__ = ["FEW", "ReadingNoise", "reading_noise"]

Array = NDArray[np.float64]

FEW = 3
"""Degrees of freedom below which a scatter of its own says too little."""

_SIGNIFICANT = 0.01


class ReadingNoise(NamedTuple):
    """Standard deviation of one reading of a table.

    Attributes
    ----------
    factor : float
        Standard deviation of a reading over the declared scatter of the table, or the standard
        deviation itself where none is declared [output unit]; NaN where nothing tells it.
    dof : float
        Degrees of freedom.
    source : str
        ``"replicates"``, ``"replicates of all tables"``, ``"declared"``, ``"residuals"``
        or ``"none"``.
    excess : float or None
        Ratio of the scatter of replicates to the declared one, where it is significantly above 1.
    """

    factor: float
    dof: float
    source: str
    excess: float | None = None


class _Scatter(NamedTuple):
    """A sum of squares in units of the declared scatter, with its degrees of freedom."""

    squares: float
    dof: float

    @property
    def variance(self) -> float:
        return self.squares / self.dof

    @classmethod
    def pooled(cls, scatters: Iterable[_Scatter]) -> _Scatter:
        squares, dof = 0.0, 0.0
        for scatter in scatters:
            squares, dof = squares + scatter.squares, dof + scatter.dof
        return cls(squares, dof)


def reading_noise(tables: Sequence[PreparedTable], outputs: Sequence[Array]) -> list[ReadingNoise]:
    """Estimate the reading noise of each table from what its replicates allow.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    outputs : sequence of ndarray
        Readings of each table (pseudo-values where the fit is robust) [output unit].

    Returns
    -------
    list of ReadingNoise
        One a table.

    Notes
    -----
    Pure error is the scatter of the readings at one head position of one table about their mean.
    A table with fewer than three degrees of freedom of it borrows from the others that declare no
    scatter; without any, the residuals of their fits are taken, which then contain the head errors
    as well.
    """
    pure = [_pure_error(table, y) for table, y in zip(tables, outputs, strict=True)]
    bare = [table.scatter_dof is None for table in tables]
    pooled = _Scatter.pooled(compress(pure, bare))
    residual = _Scatter.pooled(compress(map(_residual_scatter, tables, outputs), bare))
    return [
        _choose(table, y, own, pooled, residual)
        for table, y, own in zip(tables, outputs, pure, strict=True)
    ]


def _choose(
    table: PreparedTable, y: Array, own: _Scatter, pooled: _Scatter, residual: _Scatter
) -> ReadingNoise:
    if table.scatter_dof is not None:
        return _declared(own, table.scatter_dof)
    for scatter, source in (
        (own, "replicates"),
        (pooled, "replicates of all tables"),
        (residual, "residuals"),
    ):
        if scatter.dof >= FEW or (source == "residuals" and scatter.dof >= 1):
            # readings that are all alike to the last digit still have a rounding error
            floor = 4.0 * np.finfo(float).eps * float(np.abs(y).max())
            return ReadingNoise(max(scatter.variance**0.5, floor), scatter.dof, source)
    return ReadingNoise(np.nan, 0.0, "none")


def _declared(own: _Scatter, declared_dof: float) -> ReadingNoise:
    """Declared scatter, unless the replicates contradict it."""
    if own.dof >= FEW and f_survival(own.variance, own.dof, declared_dof) < _SIGNIFICANT:
        factor = own.variance**0.5
        return ReadingNoise(factor, own.dof, "replicates", excess=factor)
    return ReadingNoise(1.0, declared_dof, "declared")


def _pure_error(table: PreparedTable, y: Array) -> _Scatter:
    _, cell, _ = grouped(table.head)
    weight = table.scatter**-2
    total = np.bincount(cell, weight)
    mean = np.bincount(cell, weight * y) / total
    squares = float((weight * (y - mean[cell]) ** 2).sum())
    return _Scatter(squares, y.size - total.size)


def _residual_scatter(table: PreparedTable, y: Array) -> _Scatter:
    residual = y - table.kept_design @ table.least_squares.solve(y)
    squares = float(((residual / table.scatter) ** 2).sum())
    return _Scatter(squares, y.size - len(table.estimability.kept))
