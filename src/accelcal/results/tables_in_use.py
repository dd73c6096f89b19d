"""Which tables of a calibration tell its coefficients at a temperature, beside its laws or alone.

One mounting tells them: the one that the temperature laws are made from, and without laws that of
most tables. A mounting of the other axis along the shaft adds what it alone turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from accelcal.results.calibration import Calibration
from accelcal.results.table import TableCalibration, nearest_table, tells_laws


@dataclass(frozen=True, slots=True)
class TablesInUse:
    """Tables that tell the coefficients at a temperature."""

    of_main: tuple[TableCalibration, ...]  # those of the main mounting, one or more
    # those of the second mounting, along the other axis; empty where there is none
    of_second: tuple[TableCalibration, ...]
    temperature: float | None  # what is asked for; None where unknown [degC]
    by_laws: bool  # whether temperature laws tell k0, K1 and delta

    @property
    def main(self) -> TableCalibration:
        """Table of the main mounting that is nearest to the temperature."""
        return nearest_table(self.of_main, self.temperature)

    @property
    def second(self) -> TableCalibration | None:
        """Table of the second mounting that is nearest to the temperature; None without any."""
        return nearest_table(self.of_second, self.temperature) if self.of_second else None

    @property
    def nearest(self) -> tuple[TableCalibration, ...]:
        """Table of each of both mountings, the main one first."""
        return (self.main,) if self.second is None else (self.main, self.second)

    def telling(self, name: str, *, second: bool = False) -> TableCalibration:
        """Choose the table that gives a term without a law: k2, k3 or delta_ip.

        With laws it is the nearest that determined it, as in the covariance of the laws; without
        laws the nearest of all, which tells all coefficients. There must be a second mounting where
        it is asked for.
        """
        tables = self.of_second if second else self.of_main
        told = [t for t in tables if self.by_laws and t.error_model[name].value is not None]
        return nearest_table(told or tables, self.temperature)


def tables_in_use(calibration: Calibration, temperature: float | None = None) -> TablesInUse:
    """Choose the tables that tell the coefficients of a calibration at a temperature, or at T0.

    Beside temperature laws they are those that the laws are made from. An unknown temperature of a
    table is farther than any other.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> tables_in_use(calibration).main.run, tables_in_use(calibration, 70.0).main.run
    ('1', '2')
    """
    model, mountings = calibration.temperature_model, calibration.mountings_of_laws
    main, second = (tuple(t for t in calibration.tables if t.mounting == m) for m in mountings)
    by_laws = model is not None and model.K1.at_T0 is not None
    return TablesInUse(
        of_main=_of_laws(main) if by_laws else main,
        of_second=_of_laws(second) if by_laws else second,
        temperature=calibration.T0_degC if temperature is None else temperature,
        by_laws=by_laws,
    )


def _of_laws(tables: tuple[TableCalibration, ...]) -> tuple[TableCalibration, ...]:
    return tuple(filter(tells_laws, tables)) or tables


def nearest_of_mountings(
    tables: Sequence[TableCalibration], temperature: float | None
) -> dict[str, TableCalibration]:
    """Choose the table nearest to a temperature in each mounting, that of most tables first."""
    mountings = [table.mounting for table in tables]
    found = sorted(dict.fromkeys(mountings), key=mountings.count, reverse=True)
    return {
        own: nearest_table([table for table in tables if table.mounting == own], temperature)
        for own in found
    }
