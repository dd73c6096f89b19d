"""What each calibration says of a unit, from the frame of a batch or from calibrations."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from accelcal.arguments.kinds import kind_of, several
from accelcal.dates import date_of
from accelcal.errors import InputError
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import Quantity
from accelcal.results.tabular import gate_of_column
from accelcal.units import YEAR

if TYPE_CHECKING:
    import pandas as pd

_NEEDED = (
    *("serial", "mounting", "date"),
    *("k0", "k0_standard_uncertainty", "K1", "K1_standard_uncertainty"),
)


class Frames(Protocol):
    """What `accelcal.batch` returns."""

    @property
    def tables(self) -> pd.DataFrame:
        """Its frame of tables."""


NO_UNIT = "output unit"
"""What stands for the output unit where none is given."""

Numbers = tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class Entry:
    """One table of one calibration."""

    serial: str | None  # serial number of the unit
    # where the readings came from, and the mounting
    source: str
    mounting: str
    date: str | None  # date of the test, as written
    temperature: float | None  # temperature of the table [degC]
    # k0 [g] and K1 [output unit / g], each with its standard uncertainty and the half width of its
    # 95 % interval; None where unknown
    bias: Numbers
    scale_factor: Numbers
    unit: str  # of the output
    warned: tuple[str, ...] = ()  # gates that warn of the test
    gravity: float | None = None  # local gravity, where declared [m/s^2]
    sha256: str | None = None  # SHA-256 of the file with the readings, where known
    run: str | None = None  # name of the run, where known

    @property
    def test(self) -> tuple[str, ...]:
        """What all tables of one test have in common, those of a copy of its file as well."""
        sheet = self.source.rpartition("#")[2] if "#" in self.source else ""
        readings = (self.sha256, sheet) if self.sha256 else (self.source,)
        return (*readings, self.date or "")

    @property
    def is_complete(self) -> bool:
        """Whether values and uncertainties are known."""
        sizes = (*self.bias[:2], *self.scale_factor[:2])
        return None not in sizes and self.bias[1] != 0.0 and self.scale_factor[1] != 0.0


def entries_of(
    calibrations: Frames | pd.DataFrame | Iterable[Calibration | Entry],
) -> list[Entry]:
    """List the tables of some calibrations, a batch, or a frame, also of polars or pyarrow.

    Raises
    ------
    InputError
        If a column of the frame is missing.
    """
    for frame in (calibrations, getattr(calibrations, "tables", None)):
        if hasattr(frame, "columns"):
            return _of_frame(frame)
    found: list[Entry] = []
    for each in several(calibrations):
        if isinstance(each, Entry):
            found.append(each)
        elif isinstance(each, Calibration):
            found += _of_calibration(each)
        else:
            raise InputError(
                f"{kind_of(each)} in place of calibrations; give those of accelcal.fit,"
                " accelcal.batch(paths), or pandas.read_csv of what accelcal batch -o wrote"
            )
    return found


def day(date: str | None) -> str:
    """Tell the day of a date that `year` can read, where the test was.

    Of a month or a year it is the first.

    Examples
    --------
    >>> day("2024-05-31T00:30+02:00"), day("2024-05")
    ('2024-05-31', '2024-05-01')
    """
    found = _read(date)
    return "" if found is None else found.date().isoformat()


def names_day(date: str | None) -> bool:
    """Whether a date names a day, and not a month or year alone.

    Examples
    --------
    >>> names_day("31.5.2024"), names_day("2024-05"), names_day("2024")
    (True, False, False)
    """
    return date_of((date or "").strip()) is not None


def year(date: str | None) -> float | None:
    """Tell a date as years of 365.25 days since 1970; None where it cannot be read.

    It is as `accelcal.dates.date_of` has it, or a month or year such as 2024-05.

    Examples
    --------
    >>> year("1971-01-01T06:00"), year("yesterday")
    (1.0, None)
    """
    found = _read(date)
    if found is None:
        return None
    found = found if found.tzinfo else found.replace(tzinfo=UTC)
    return float(found.timestamp()) / YEAR


def _read(date: str | None) -> datetime | None:
    text = (date or "").strip()
    return date_of(text) or date_of(f"{text}-01") or date_of(f"{text}-01-01")


def _of_calibration(calibration: Calibration) -> list[Entry]:
    return [
        Entry(
            serial=calibration.serial,
            source=calibration.source,
            mounting=table.mounting,
            date=calibration.date,
            temperature=table.temperature_degC,
            bias=_of_quantity(table.error_model["k0"]),
            scale_factor=_of_quantity(table.coefficients["K1"]),
            unit=calibration.output_unit or NO_UNIT,
            warned=tuple(
                gate.name for gate in (*table.gates, *calibration.gates) if gate.verdict == "warn"
            ),
            gravity=calibration.g_local_m_s2,
            sha256=calibration.provenance.get("sha256"),
            run=table.run,
        )
        for table in calibration.tables
    ]


def _of_frame(frame: Any) -> list[Entry]:
    table = frame.to_pandas() if hasattr(frame, "to_pandas") else frame  # of polars, of Arrow
    missing = [name for name in _NEEDED if name not in table.columns]
    if missing:
        raise InputError(
            f"no column {missing[0]!r} in the frame; give what accelcal batch -o RESULTS.csv wrote"
        )
    return [_of_row(row) for row in table.to_dict("records")]


def _of_row(row: dict[str, Any]) -> Entry:
    def numbers(name: str) -> Numbers:
        parts = ("", "_standard_uncertainty", "_expanded_uncertainty")
        return _numbers(*(row.get(name + part) for part in parts))

    return Entry(
        serial=_text(row["serial"]),
        source=_text(row.get("source")) or "<frame>",
        mounting=_text(row["mounting"]) or "o+",
        date=_text(row["date"]),
        temperature=_numbers(row.get("temperature_degC"))[0],
        bias=numbers("k0"),
        scale_factor=numbers("K1"),
        unit=_text(row.get("output_unit")) or NO_UNIT,
        warned=tuple(
            gate
            for name, verdict in row.items()
            if verdict == "warn" and (gate := gate_of_column(str(name)))
        ),
        gravity=_numbers(row.get("g_local_m_s2"))[0],
        sha256=_text(row.get("sha256")),
        run=_text(row.get("run")),
    )


def _of_quantity(found: Quantity) -> Numbers:
    return _numbers(found.value, found.standard_uncertainty, found.expanded_uncertainty)


def _numbers(*given: Any) -> Numbers:
    def finite(item: Any) -> float | None:
        try:
            number = float(item)
        except (TypeError, ValueError):
            return None
        return number if np.isfinite(number) else None

    return tuple(map(finite, given))


def _text(cell: Any) -> str | None:
    """A cell as text; a serial number or year that was read as a number has no decimals."""
    if cell is None or cell != cell:  # NaN alone differs from itself
        return None
    if isinstance(cell, float) and cell.is_integer():
        return str(int(cell))
    return str(cell).strip() or None
