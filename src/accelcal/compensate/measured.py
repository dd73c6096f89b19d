"""Accelerations that were measured: what applying a calibration gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from accelcal.arrays import Array, EqualByContents, Mask
from accelcal.plural import counted

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["MeasuredAcceleration"]


_SHOWN = 20

AT_ONCE = 2**15
"""Samples that are worked on together: so many stay in the cache, and take little memory."""


def columns_of(axes: str) -> tuple[str, ...]:
    """Name the columns of accelerations and uncertainties.

    Examples
    --------
    >>> columns_of("")
    ('acceleration', 'standard_uncertainty', 'expanded_uncertainty')
    >>> columns_of("xyz")[:3]
    ('acceleration_x', 'acceleration_y', 'acceleration_z')
    """
    sizes = ("acceleration", "standard_uncertainty", "expanded_uncertainty")
    return tuple(f"{size}_{axis}" if axis else size for size in sizes for axis in axes or [""])


def in_blocks(
    measure: Callable[[slice], MeasuredAcceleration], shape: tuple[int, ...]
) -> MeasuredAcceleration:
    """Measure samples block by block, each a slice of all in a row, and give them their shape."""
    starts = range(0, max(prod(shape), 1), AT_ONCE)
    blocks = [measure(slice(start, start + AT_ONCE)) for start in starts]
    found: dict[str, Any] = {}
    for name in (item.name for item in fields(MeasuredAcceleration)):
        if name not in ("index", "axes"):
            whole = np.concatenate([getattr(block, name) for block in blocks])
            found[name] = whole.reshape((*shape, *whole.shape[1:]))
    return replace(blocks[0], **found)


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredAcceleration(EqualByContents):
    """Acceleration along the input axis, sample by sample; of a triad along its three axes.

    Attributes
    ----------
    value : ndarray
        Acceleration a_i, NaN where the output or temperature is missing or has no solution; of a
        triad its last axis holds x, y, z [g].
    standard_uncertainty : ndarray
        Its standard uncertainty, NaN where unknown [g].
    expanded_uncertainty : ndarray
        Half width of its 95 % interval, by the degrees of freedom of each part [g].
    within_temperatures : ndarray of bool
        Whether the temperature lies in the calibrated range.
    within_accelerations : ndarray of bool
        Whether the acceleration lies in the range of the test, +-1 g for a whole turn; beyond it
        the nonlinearity is extrapolated. Of a triad: whether its length does.
    index : pandas.Index or None
        Index of the Series that were given; None where there was none.
    axes : str
        ``"xyz"`` of a triad, empty otherwise.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> measured = accelcal.apply(calibration, [1.3547, 0.0], temperature=20.0)
    >>> measured.value.round(4).tolist(), measured.inside.tolist()
    ([1.0, -0.0033], [True, True])
    >>> measured
    <MeasuredAcceleration: 2 samples>
    """

    value: Array
    standard_uncertainty: Array
    expanded_uncertainty: Array
    within_temperatures: Mask
    within_accelerations: Mask
    index: Any = None
    axes: str = ""

    @property
    def inside(self) -> Mask:
        """Whether a sample lies in the calibrated ranges."""
        return self.within_temperatures & self.within_accelerations

    @property
    def outside_temperatures(self) -> Mask:
        """Whether a sample has an acceleration, but another temperature than the calibration."""
        known = np.isfinite(self.value)
        return ~self.within_temperatures & (known.all(axis=-1) if self.axes else known)

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the samples.

        Returns
        -------
        pandas.DataFrame
            A row a sample, by `index`, with the columns that ``accelcal apply`` writes;
            ``frame.attrs["units"]`` maps columns to units.
        """
        import pandas as pd

        sizes = dict(zip(columns_of(self.axes), self.sizes(), strict=True))
        frame = pd.DataFrame({**sizes, "inside": np.ravel(self.inside)})
        frame.attrs["units"] = dict.fromkeys(sizes, "g")
        return frame if self.index is None else frame.set_index(self.index)

    def sizes(self) -> list[Array]:
        """Give the columns of `columns_of`, one value a sample each [g]."""
        told = (self.value, self.standard_uncertainty, self.expanded_uncertainty)
        width = len(self.axes) or 1
        return [column for each in told for column in each.reshape(-1, width).T]

    def by_index_of(self, *given: Any) -> MeasuredAcceleration:
        """Take the index of the first Series among some arguments that has a row for each sample.

        Parameters
        ----------
        *given : object
            The arguments.

        Returns
        -------
        MeasuredAcceleration
            The same samples.
        """
        of_series = (each.index for each in given if hasattr(each, "reset_index"))
        fitting = (index for index in of_series if self.inside.shape == (len(index),))
        return replace(self, index=next(fitting, None))

    def __repr__(self) -> str:
        outside = int(np.sum(~self.inside))
        more = f", {outside} outside the calibrated ranges" if outside else ""
        return f"<MeasuredAcceleration: {counted(self.inside.size, 'sample')}{more}>"

    def __str__(self) -> str:
        return f"{self._title}\n{self.to_frame().to_string(max_rows=_SHOWN)}"

    def _repr_html_(self) -> str:
        return f"<p>{self._title}</p>{self.to_frame().to_html(max_rows=_SHOWN)}"

    @property
    def _title(self) -> str:
        return f"{repr(self)[1:-1]}, in local g; expanded uncertainty of 95 %"
