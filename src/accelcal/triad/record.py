"""What a test of a triad leaves behind: three outputs for each attitude in which it stood still."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from html import escape
from itertools import chain, product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from accelcal.apparatus import Apparatus
from accelcal.arguments.axes import AXES, by_axis
from accelcal.arguments.kinds import several
from accelcal.arguments.numbers import refuse_other_order
from accelcal.arguments.options import check_text, check_texts, check_written
from accelcal.arguments.temperatures import temperature_array
from accelcal.arrays import Array, EqualByContents, Ints
from accelcal.errors import InputError
from accelcal.frozen_mapping import freeze
from accelcal.head_angles import SAME_POSITION
from accelcal.numerics.grouping import places_of_equals
from accelcal.units import headed_by_units

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["SPREAD", "TriadRecord", "one_an_attitude", "up_of_turn"]

SPREAD = 5.0
"""Temperatures further apart were not meant as one: they would pass for errors [degC]."""

_AROUND = tuple(product((-1, 0, 1), repeat=3))
_LARGEST = 1e30
_UNIT_LENGTH = 1e-3
"""A direction longer or shorter than 1 by more was not meant as one."""


@dataclass(frozen=True, slots=True, eq=False)
class TriadRecord(EqualByContents):
    """Mean outputs of a triad, one entry an attitude.

    Attributes
    ----------
    output : ndarray of float, shape (n, 3)
        Outputs of the channels x, y, z [output unit].
    up : ndarray of float, shape (n, 3), or None
        Acceleration along the axes of the block, which points up in every attitude [local g];
        None where the attitudes are not known.
    line : ndarray of int, shape (n,), or None
        Line of the source that holds the attitude.
    attitude : sequence of str or None
        Name of the attitude of each row, in place of its direction up: rows of one attitude have
        its error in common, and two attitudes may have one direction.
    temperature : ndarray of float, shape (n,), or None
        Temperature in each attitude, NaN where it is not known [degC].
    unit : str or None
        Output unit.
    local_gravity : float or None
        Local gravity [m/s^2].
    serial : str or None
        Serial number of the triad.
    source : str
        Where the record came from.
    notes : tuple of str
        What the reader set aside, one sentence each.
    shaft : sequence of str or None
        Name of the shaft about which the block was turned to each row: it was clamped anew on each,
        and sits a little turned in all attitudes of one.

    Raises
    ------
    InputError
        If the arrays have other shapes, hold a value that is not finite, a direction is not of
        length 1, temperatures are more than `SPREAD` apart, the gravity is not that of a place on
        Earth, or frames of pandas have different indices.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.TriadRecord([[0.1, 0.0, 1.0], [0.1, 1.0, 0.0]])
    <TriadRecord '<table>': 2 attitudes, not known>
    """

    output: Array
    up: Array | None = None
    line: Ints | None = None
    attitude: tuple[str, ...] | None = None
    temperature: Array | None = None
    unit: str | None = None
    local_gravity: float | None = None
    serial: str | None = None
    source: str = "<table>"
    notes: tuple[str, ...] = ()
    shaft: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        Apparatus(local_gravity=self.local_gravity)  # refuses what is found nowhere on Earth
        check_text(unit=self.unit, serial=self.serial)
        check_written(source=self.source)
        check_texts(notes=self.notes)
        given = ("output", "up", "temperature", "attitude", "shaft")
        refuse_other_order({name: getattr(self, name) for name in given})
        for name in ("output", "up"):
            if name == "output" or self.up is not None:
                object.__setattr__(self, name, _rows(getattr(self, name), name))
        if self.temperature is not None:
            own = _temperatures(self.temperature, len(self.output))
            object.__setattr__(self, "temperature", own)
        for name in ("attitude", "shaft"):
            if (own := getattr(self, name)) is not None:
                object.__setattr__(self, name, _names(own, name, len(self.output)))
        freeze(self)
        if self.up is not None:
            _check_directions(self.up, len(self.output))

    def __repr__(self) -> str:
        name = f"serial {self.serial!r}" if self.serial else repr(self.source)
        known = "not known" if self.up is None else "known"
        return f"<TriadRecord {name}: {len(self.output)} attitudes, {known}>"

    def _repr_html_(self) -> str:
        table = headed_by_units(self.to_frame()).to_html(max_rows=20)
        return f"<p>{escape(repr(self)[1:-1])}</p>{table}"

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the attitudes, a line each.

        Returns
        -------
        pandas.DataFrame
            The outputs ``x``, ``y``, ``z``; the directions ``up_x``, ``up_y``, ``up_z``, and
            attitude, shaft and temperature, where they are known. ``frame.attrs["units"]`` maps
            columns to units.

        Examples
        --------
        >>> import accelcal
        >>> record = accelcal.TriadRecord([[0.1, 0.0, 1.0], [0.1, 1.0, 0.0]], unit="mA")
        >>> record.to_frame()["z"].tolist(), record.to_frame().attrs["units"]["z"]
        ([1.0, 0.0], 'mA')
        """
        import pandas as pd

        columns = dict(zip(AXES, self.output.T, strict=True))
        units = {**dict.fromkeys(AXES, self.unit), "temperature": "degC"}
        if self.up is not None:
            directions = [f"up_{axis}" for axis in AXES]
            columns |= dict(zip(directions, self.up.T, strict=True))
            units |= dict.fromkeys(directions, "g")
        told = {name: getattr(self, name) for name in ("attitude", "shaft", "temperature")}
        frame = pd.DataFrame(columns | {name: v for name, v in told.items() if v is not None})
        frame.attrs["units"] = {
            name: unit for name, unit in units.items() if unit and name in frame
        }
        return frame


def one_an_attitude(record: TriadRecord) -> TriadRecord:
    """Average the rows of each attitude, where attitudes are known.

    Parameters
    ----------
    record : TriadRecord
        The rows.

    Returns
    -------
    TriadRecord
        A row for each attitude, in the order in which they were first taken.

    Notes
    -----
    The error of an attitude, which the head set once, is the same in all its rows. Counted as
    independent, they would promise too much. Where attitudes have no names, directions within
    `accelcal.head_angles.SAME_POSITION` of the first of an attitude are of the same one.

    Examples
    --------
    >>> turned = up_of_turn("z", [0.0, 90.0, 0.0])
    >>> one_an_attitude(TriadRecord([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [3.0, 0.0, 0.0]], turned))
    <TriadRecord '<table>': 2 attitudes, known>
    """
    if record.up is None:
        return record
    rows = places_of_equals(names_of(record))
    if len(rows) == len(record.up):
        return record
    first = [members[0] for members in rows]
    note = f"{len(record.up)} rows of {len(rows)} attitudes: those of one attitude are averaged"
    return replace(
        record,
        output=np.array([record.output[members].mean(axis=0) for members in rows]),
        up=np.array([_direction(record.up[members]) for members in rows]),
        line=None if record.line is None else record.line[first],
        attitude=None,
        shaft=None if record.shaft is None else tuple(record.shaft[row] for row in first),
        temperature=_averaged(record.temperature, rows),
        notes=(*record.notes, note),
    )


def names_of(record: TriadRecord) -> Sequence[Hashable]:
    """Name the attitude of each row: as given, or by where up is, on each shaft alone."""
    if record.attitude is not None or record.up is None:
        return record.attitude or ()
    places = places_of(record.up)
    return places if record.shaft is None else list(zip(places, record.shaft, strict=True))


def places_of(up: Array) -> list[int]:
    """Number the directions of rows, shape (n, 3), each by the first one which is so near.

    Those within `accelcal.head_angles.SAME_POSITION` share a number.

    Examples
    --------
    >>> places_of(np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1e-5, 0.0]]))
    [0, 1, 0]
    """
    reach = math.radians(SAME_POSITION)
    directions = up / np.linalg.norm(up, axis=1)[:, None]
    leaders: list[list[float]] = []
    of_cells: dict[tuple[int, ...], list[int]] = {}
    found = []
    cells = np.floor(directions / reach).astype(np.int64).tolist()
    for (x, y, z), row in zip(cells, directions.tolist(), strict=True):
        around = (of_cells.get((x + i, y + j, z + k), ()) for i, j, k in _AROUND)
        near = [n for n in chain.from_iterable(around) if math.dist(leaders[n], row) <= reach]
        found.append(min(near, default=len(leaders)))
        if not near:
            of_cells.setdefault((x, y, z), []).append(len(leaders))
            leaders.append(row)
    return found


def _direction(up: Array) -> Array:
    """Middle of directions close to each other; the first to the last digit where all are it."""
    return np.asarray(up[0] + (up - up[0]).mean(axis=0))


def _names(given: Sequence[str], name: str, attitudes: int) -> tuple[str, ...]:
    names = several(given)
    check_texts(**{name: names})
    if len(names) != attitudes:
        raise InputError(f"{len(names)} {name}s of {attitudes} attitudes; give one for each")
    return names


def _check_directions(up: Array, size: int) -> None:
    if len(up) != size:
        raise InputError(f"{len(up)} directions for {size} attitudes; give one for each")
    length = np.linalg.norm(up, axis=1)
    if (np.abs(length - 1.0) > _UNIT_LENGTH).any():
        wrong = int(np.argmax(np.abs(length - 1.0)))
        raise InputError(
            f"the direction of attitude {wrong + 1} has length {length[wrong]:.6g}; give the"
            " acceleration in local g, of length 1"
        )


def _averaged(temperature: Array | None, rows: Iterable[list[int]]) -> Array | None:
    """Mean of the known temperatures of each attitude."""
    if temperature is None:
        return None
    known = [temperature[own][~np.isnan(temperature[own])] for own in rows]
    return np.array([own.mean() if own.size else np.nan for own in known])


def _temperatures(values: ArrayLike, size: int) -> Array:
    found = temperature_array(values).copy()
    if found.shape != (size,):
        raise InputError(
            f"temperature has shape {found.shape}; give one for each of {size} attitudes"
        )
    known = found[~np.isnan(found)]
    if known.size and np.ptp(known) > SPREAD:
        raise InputError(
            f"temperatures from {known.min():g} to {known.max():g} degC in one calibration of a"
            " triad; give each temperature a table of its own"
        )
    return found


def _rows(values: ArrayLike, name: str) -> Array:
    rows = by_axis(values, name).copy()
    if rows.ndim != 2 or rows.shape[1] != 3 or not rows.size:
        raise InputError(f"{name} has shape {rows.shape}; give a row of three for each attitude")
    if not (np.isfinite(rows) & (np.abs(rows) < _LARGEST)).all():
        raise InputError(f"{name} holds a value that is not finite or too large; leave it out")
    return rows


def up_of_turn(shaft: str, angle: ArrayLike) -> Array:
    """Acceleration along the axes of a block that is turned about one of its own axes.

    Parameters
    ----------
    shaft : str
        Axis of the block along the horizontal shaft: ``"x"``, ``"y"`` or ``"z"``, with ``-`` in
        front where it points the other way.
    angle : array_like, shape (n,)
        Angle of the head [deg].

    Returns
    -------
    ndarray, shape (n, 3)
        Acceleration [local g]. At 0 the next axis points up (y after x, z after y, x after z), at
        90 deg the one after it; on the shaft turned round, the one after it points down.

    Raises
    ------
    InputError
        If there is no such axis.

    Examples
    --------
    >>> up_of_turn("z", [0.0, 90.0]).round(3).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    name = shaft.strip().casefold().lstrip("+-")
    if name not in AXES or len(name) != 1:
        raise InputError(f"shaft {shaft!r}; write x, y or z, or -x, -y, -z for the shaft reversed")
    sign = -1.0 if shaft.strip().startswith("-") else 1.0
    theta = np.deg2rad(np.asarray(angle, dtype=np.float64))
    first = (AXES.index(name) + 1) % 3
    up = np.zeros((theta.size, 3))
    up[:, first] = np.cos(theta)
    up[:, (first + 1) % 3] = sign * np.sin(theta)
    return up
