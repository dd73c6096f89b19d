"""Pictures of a triad, as ``triad.plot``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from accelcal.arguments.axes import AXES
from accelcal.arguments.kinds import expect
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.plot.style import Pictures, canvas, entitled, palette, styled
from accelcal.results.triad import TriadCalibration
from accelcal.shown_units import readable
from accelcal.triad.record import TriadRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["TriadPlot"]

_MARKS = "os^"


class TriadPlot(Pictures[TriadCalibration]):
    """Pictures of a triad."""

    __slots__ = ()

    @styled
    def residuals(self, record: TriadRecord, ax: Axes | None = None) -> Axes:
        """Draw what the calibration leaves in each row of its record.

        Parameters
        ----------
        record : TriadRecord
            The record that was calibrated.
        ax : Axes, optional
            Axes to draw into.

        Returns
        -------
        Axes
            Where the attitudes are known, residuals of the channels over their scale factors;
            otherwise the length of the acceleration less 1.

        Raises
        ------
        InputError
            If the record is none, or has other attitudes than the calibration.
        """
        from matplotlib.ticker import MaxNLocator

        left, names = self._left(record)
        factor, unit = readable("g", left)
        ax, colours = canvas(ax, (6.8, 3.8)), palette()
        ax.axhline(0.0, color=colours.muted, lw=0.8)
        rows = np.arange(1, len(left) + 1)
        for column, name, mark, colour in zip(left.T, names, _MARKS, colours.series, strict=False):
            ax.plot(rows, factor * column, mark, ms=4.5, color=colour, label=name)
        ax.set(xlabel="attitude, in the order of the table", ylabel=f"residual [{unit}]")
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        known = len(names) > 1
        entitled(
            ax, "Residuals of the channels" if known else "Length of the acceleration less 1 g"
        )
        return ax

    def _left(self, record: TriadRecord) -> tuple[Array, list[str]]:
        """Residuals [g], a column each, with its name where there are several."""
        expect(record, TriadRecord)
        triad = self.result
        if (record.up is None) != (triad.frame != "block") or len(record.output) < triad.attitudes:
            raise InputError(
                f"{len(record.output)} rows that are not those of the calibration, which has"
                f" {triad.attitudes} attitudes; give the record that was calibrated"
            )
        if record.up is None:
            length = np.linalg.norm(triad.accelerations(record.output), axis=1)
            return (length - 1.0)[:, None], [""]
        scale = np.linalg.norm(triad.sensitivity, axis=1)
        model = triad.bias + record.up @ triad.sensitivity.T
        return (record.output - model) / scale, [f"channel {axis}" for axis in AXES]
