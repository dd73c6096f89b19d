"""Heads: files of ``accelcal head``, and certificates as tables of angle and error."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.errors import TableError, located
from accelcal.estimate.same_head import HEAD, STAND, names_of
from accelcal.head_angles import head_positions
from accelcal.io.files.text import Source, read_document
from accelcal.io.layout.header_lines import Declared
from accelcal.io.small_table import SmallTable, small_table
from accelcal.io.values.cells import Column, complete_numbers, number_and_unit
from accelcal.io.words.head_words import (
    Cover,
    head_heading,
    head_key,
    kind_of_uncertainty,
    without_cover,
)
from accelcal.io.words.vocabulary import is_unit_of
from accelcal.plural import listed
from accelcal.results.covariance import rows_of
from accelcal.results.head_calibration import HeadCalibration
from accelcal.units import UNITS, scaled, size_of

__all__ = ["read_head"]

_REMEDY = "name the columns angle and error, and give units, as in error [arcsec]"
_HOW_SURE = "add a column uncertainty [arcsec], or a line '# uncertainty: 0.5 arcsec'"
_NO_ZERO = (
    "write the standard uncertainty; 0 is that of an error 0 at 0 deg, where the others are"
    " relative to it"
)
_HOW_FAR = "say by which factor, as in '# coverage: 2'"
_LARGEST = 0.1
"""Errors beyond it are none of a head [rad]."""
_LARGEST_FACTOR = 20.0
"""Coverage factors beyond it are probabilities in percent."""


def read_head(source: Source) -> HeadCalibration:
    r"""Read the calibration of a head.

    Parameters
    ----------
    source : path, "-" or file object
        A file of ``accelcal head``, or a certificate: a table with the columns ``angle`` [deg],
        ``error`` (true minus nominal) and ``uncertainty`` (standard), the last two in arcsec,
        arcmin, urad, mrad, rad or deg by their headings, which may be German, French or Russian.
        A line ``# uncertainty: 0.5 arcsec`` stands for the column, and ``# coverage: 2`` or
        ``# k: 2``, or ``U (k=2)`` in the heading, says that it is expanded by that factor. A
        coverage probability tells no factor. Lines ``# head: NAME`` and ``# stand: NAME``
        name the head and its stand.

    Returns
    -------
    HeadCalibration
        The head. The errors of a certificate are taken as independent of each other.

    Raises
    ------
    DocumentError
        If it is JSON of something else.
    TableError
        If the certificate is unusable; the message names the line and the remedy.

    Examples
    --------
    >>> import io
    >>> import accelcal
    >>> text = "# uncertainty: 0.5 arcsec\nangle,error [arcsec]\n0,1\n90,-1\n"
    >>> [round(1e6 * error, 2) for error in accelcal.read_head(io.StringIO(text)).errors]
    [4.85, -4.85]
    """
    given, stored = read_document(source, "head", _stored)
    if stored is not None:
        return stored
    table = small_table(given, head_heading, ("angle",), _REMEDY, head_key)
    return located(_certificate, table, source=table.layout.source)


def _stored(text: str) -> HeadCalibration | None:
    return HeadCalibration.from_json(text) if text.lstrip().startswith("{") else None


def _certificate(table: SmallTable) -> HeadCalibration:
    there = [role for role in ("error", "correction") if role in table.columns]
    if len(there) != 1:
        raise table.layout.refuse("no column error, or correction beside it", _REMEDY)
    column = table.columns["angle"]
    angle = complete_numbers(column) * (_factor(column, "deg") * 180.0 / np.pi)
    sign = 1.0 if there[0] == "error" else -1.0
    column = _bare(table.columns[there[0]])
    error = sign * complete_numbers(column) * _factor(column)
    column.check(np.abs(error) < _LARGEST, "{} is no error of a head", "check its unit")
    place, order, of_row = np.unique(head_positions(angle), return_index=True, return_inverse=True)
    is_same = np.abs(error - error[order][of_row]) <= 1e-12
    column.check(is_same, "{} of a position that has another error above", "keep one")
    variance = _uncertainty(table, (head_positions(angle) == 0.0) & (error == 0.0))[order] ** 2
    names = names_of({key: line.value for key, line in table.layout.declared.items()})
    return HeadCalibration(
        angles_deg=tuple(place.tolist()),
        errors=tuple(error[order].tolist()),
        covariance_matrix=rows_of(np.diag(variance)),
        origin="certificate",
        source=table.layout.source,
        head_name=names[HEAD],
        stand_name=names[STAND],
    )


def _bare(column: Column) -> Column:
    """Without the unit of an angle that every cell carries."""
    return column.without_unit(partial(is_unit_of, "angle"))


def _factor(column: Column, default: str | None = None) -> float:
    """Radians of a unit of a column."""
    unit = column.unit or default
    size = size_of(unit, "angle") if unit else None
    if size is None:
        what = f"is in {unit}" if unit else "has no unit"
        problem = f"column {column.heading} {what}"
        raise TableError(problem, f"give it in {', '.join(UNITS['angle'])}", source=column.source)
    return size


def _uncertainty(table: SmallTable, is_zero: Mask) -> Array:
    """Standard uncertainty of each position, which only the zero of a certificate lacks [rad]."""
    declared, size = table.layout.declared, is_zero.size
    kind = next((key for key in ("standard", "expanded", "uncertainty") if key in declared), None)
    if "uncertainty" in table.columns:
        column = _bare(table.columns["uncertainty"])
        values = _of_column(column, table, is_zero)
        if kind and not np.allclose(values, _of_line(kind, declared, size), rtol=1e-6, atol=0.0):
            problem = f"uncertainty {declared[kind].value!r} is not that of column {column.heading}"
            raise declared[kind].refuse(problem, "keep one of both")
        return values
    if not kind:
        raise table.layout.refuse("the uncertainty of the errors is not given", _HOW_SURE)
    return _of_line(kind, declared, size)


def _of_column(column: Column, table: SmallTable, is_zero: Mask) -> Array:
    kind = kind_of_uncertainty(column.heading)
    beside = without_cover(column.heading)
    what, declared = f"column {column.heading}", table.layout.declared
    cover = _cover(kind, what, beside, declared, table.layout.refuse)
    values = complete_numbers(column) * _factor(column)
    column.check((values > 0.0) | (is_zero & (values == 0.0)), "{} is not above 0", _NO_ZERO)
    return values / cover


def _of_line(kind: str, declared: Mapping[str, Declared], size: int) -> Array:
    written = declared[kind]
    beside = without_cover(written.value)
    cover = _cover(kind, "the uncertainty", beside, declared, written.refuse)
    unit = size_of(number_and_unit(beside.rest, ",")[1], "angle")
    if unit is None:
        raise written.refuse(f"uncertainty {written.value!r} has no unit of an angle", _HOW_SURE)
    return np.full(size, _positive(kind, written._replace(value=beside.rest), unit) / cover)


def _cover(
    kind: str,
    what: str,
    beside: Cover,
    declared: Mapping[str, Declared],
    refuse: Callable[[str, str], TableError],
) -> float:
    """Factor that an uncertainty is expanded by, as it stands beside it or in a line of its own."""
    line = _factor_of_line(declared["coverage"]) if "coverage" in declared else None
    if kind == "standard":
        line = 1.0
    if len(set(beside.factors)) > 1:
        both = listed(f"{factor:g}" for factor in beside.factors)
        raise refuse(f"{what} has the coverage factors {both}", "write one of them")
    factor = next(iter(beside.factors), None)
    if factor is not None and not factor == (line or factor) > 0.0:
        other = "a standard uncertainty has none" if kind == "standard" else f"not {line or 1:g}"
        raise refuse(f"{what} has the coverage factor {factor:g}, and {other}", "write one of them")
    if line is None and factor is None and (kind == "expanded" or beside.probability):
        raise refuse(f"{what} is expanded", _HOW_FAR)
    return line or factor or 1.0


def _factor_of_line(written: Declared) -> float:
    """Coverage factor of a line, behind which its probability may stand."""
    beside = without_cover(written.value)
    number, unit = number_and_unit(beside.rest or written.value, ",")
    if len(set(beside.factors)) == 1 and not beside.rest:  # "k = 2" or "2 sigma"
        number, unit = f"{beside.factors[0]!r}", ""
    factor = _positive("coverage", written._replace(value=number))
    if unit or not 1.0 <= factor <= _LARGEST_FACTOR:
        problem = f"coverage {written.value!r} is no factor from 1 to {_LARGEST_FACTOR:g}"
        raise written.refuse(problem, "write the factor, as 2, not the probability")
    return factor


def _positive(key: str, written: Declared, unit: float = 1.0) -> float:
    """Number of a header line, times the size of its unit."""
    try:
        found = scaled(number_and_unit(written.value, ",")[0], unit)
    except ValueError:
        found = float("nan")
    if not 0.0 < found < np.inf:
        raise written.refuse(f"{key} is {written.value!r}", "write a number above 0")
    return found
