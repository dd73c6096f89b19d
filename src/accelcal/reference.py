"""What coefficients refer to: the reference temperature T0 and the fixture angle of a record.

The laws of temperature are bilinear about T0: a value there and one slope on either side.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from accelcal.arguments.temperatures import check_temperature
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.geometry import checked_fixture_angle
from accelcal.record import TumbleRecord

USUAL_TEMPERATURE = 20.0
"""Normal temperature of a laboratory: what a test refers to where nothing is declared [degC]."""

LEAST_RISE = 5.0
"""Levels closer to T0 than this tell no slope [degC]."""


def fixture_angle(record: TumbleRecord, given: float | None = None) -> float:
    """Take the fixture angle as given, else as the record declares it, else 0.

    Raises
    ------
    InputError
        If what the record declares is no number, or the angle is none of a fixture.
    """
    declared = declared_fixture_angle(record)
    try:
        found = float(declared.replace(",", ".")) if given is None else given
    except ValueError:
        raise InputError(
            f"{record.source}: delta0 is {declared!r}; it is a number in rad, as in 0.001"
        ) from None
    return checked_fixture_angle(found)


def declared_fixture_angle(record: TumbleRecord) -> str:
    """Return the fixture angle as it is written in the record, or ``"0"``; it may be no number."""
    return record.metadata.get("delta0", "0")


def reference_temperature_of(record: TumbleRecord, given: float | None) -> float | None:
    """Take T0 as given, else as the record declares it, else the level nearest to 20 degC.

    None where no temperature is known [degC].
    """
    if given is not None:
        check_temperature(reference_temperature=given)
        return given
    if record.reference_temperature is not None:
        return record.reference_temperature
    runs = range(len(record.run_labels))
    levels = [level_of(record.temperature[None, record.run == run])[0] for run in runs]
    usual = float(usual_reference(np.array(levels)))
    return None if np.isnan(usual) else usual


def usual_reference(levels: Array) -> Array:
    """Take the level nearest to 20 degC, the first of the nearest, shape (...).

    The levels are of m runs, shape (..., m), NaN where unknown; so is it where none is known
    [degC].

    Examples
    --------
    >>> import numpy as np
    >>> usual_reference(np.array([[60.0, 21.0], [np.nan, -40.0]])).tolist()
    [21.0, -40.0]
    """
    away = np.where(np.isnan(levels), np.inf, np.abs(levels - USUAL_TEMPERATURE))
    nearest = away.argmin(axis=-1)[..., None]
    return np.asarray(np.take_along_axis(levels, nearest, axis=-1)[..., 0])


def level_of(temperatures: Array) -> Array:
    """Mean of the temperatures, shape (R, n), as far as they are known, shape (R,) [degC].

    NaN where nothing is known.
    """
    known = np.isfinite(temperatures)
    if known.all():
        return np.asarray(temperatures.mean(axis=1))
    number = known.sum(axis=1)
    total = np.where(known, temperatures, 0.0).sum(axis=1)
    return np.where(number > 0, total / np.maximum(number, 1), np.nan)


def measured_sides(rise: Array) -> tuple[str, ...]:
    """Find the sides of T0 on which a slope can be had, by T - T0 of the levels [degC].

    They are ``"above"`` and ``"below"``, as far as measured.

    Examples
    --------
    >>> import numpy as np
    >>> measured_sides(np.array([0.0, 60.0]))
    ('above',)
    """
    measured = {
        "above": rise.max(initial=0.0) > LEAST_RISE,
        "below": rise.min(initial=0.0) < -LEAST_RISE,
    }
    return tuple(side for side, has in measured.items() if has)


def bilinear_design(rise: Array, sides: Sequence[str], axis: int = -1) -> Array:
    """Columns of one law: value at T0, then the slopes that were measured, on `measured_sides`.

    With one slope the line goes straight on through T0: levels and readings less than `LEAST_RISE`
    on its other side, such as those of a run at T0 whose temperature scatters, change by it too.
    The rise T - T0, shape (..., n) [degC], makes a matrix of shape (..., n, 1 + len(sides)); the
    axis -2 puts the columns one below another.

    Examples
    --------
    >>> import numpy as np
    >>> bilinear_design(np.array([-60.0, 0.0, 60.0]), ("above", "below")).tolist()
    [[1.0, 0.0, -60.0], [1.0, 0.0, 0.0], [1.0, 60.0, 0.0]]
    >>> bilinear_design(np.array([-0.2, 60.0]), ("above",)).tolist()
    [[1.0, -0.2], [1.0, 60.0]]
    """
    if len(sides) == 1:
        return np.stack([np.ones_like(rise), rise], axis=axis)
    parts = {"above": np.maximum(rise, 0.0), "below": np.minimum(rise, 0.0)}
    return np.stack([np.ones_like(rise), *(parts[side] for side in sides)], axis=axis)
