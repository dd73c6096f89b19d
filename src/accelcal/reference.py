"""What coefficients refer to: the reference temperature T0 and the fixture angle of a record."""

from __future__ import annotations

import numpy as np

from accelcal.arguments.numbers import check_number
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

    Parameters
    ----------
    record : TumbleRecord
        The record.
    given : float, optional
        Fixture angle [rad].

    Returns
    -------
    float
        The fixture angle [rad].

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
    """Return the fixture angle as it is written in the record, which may be no number.

    Parameters
    ----------
    record : TumbleRecord
        The record.

    Returns
    -------
    str
        What stands there; ``"0"`` where there is nothing.
    """
    return record.metadata.get("delta0", "0")


def has_reference_temperature(record: TumbleRecord, given: float | None) -> bool:
    """Tell whether T0 is given, or declared by the record.

    Parameters
    ----------
    record : TumbleRecord
        The record.
    given : float or None
        T0 [degC].

    Returns
    -------
    bool
        Whether it is; otherwise `reference_temperature_of` chooses it.
    """
    return given is not None or record.reference_temperature is not None


def reference_temperature_of(record: TumbleRecord, given: float | None) -> float | None:
    """Take T0 as given, else as the record declares it, else the level nearest to 20 degC.

    Parameters
    ----------
    record : TumbleRecord
        The record.
    given : float or None
        T0 [degC].

    Returns
    -------
    float or None
        T0; None where no temperature is known [degC].
    """
    if given is not None:
        check_number(T0=given)
        return given
    if record.reference_temperature is not None:
        return record.reference_temperature
    runs = range(len(record.run_labels))
    levels = [level_of(record.temperature[None, record.run == run])[0] for run in runs]
    usual = float(usual_reference(np.array(levels)))
    return None if np.isnan(usual) else usual


def usual_reference(levels: Array) -> Array:
    """Take the level nearest to 20 degC.

    Parameters
    ----------
    levels : ndarray, shape (..., m)
        Levels of m runs, NaN where unknown [degC].

    Returns
    -------
    ndarray, shape (...)
        The first of the nearest; NaN where none is known [degC].

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
    """Mean of the temperatures of readings, as far as they are known.

    Parameters
    ----------
    temperatures : ndarray, shape (R, n)
        Temperatures of n readings in each of R records, NaN where unknown [degC].

    Returns
    -------
    ndarray, shape (R,)
        The level; NaN where nothing is known [degC].
    """
    known = np.isfinite(temperatures)
    if known.all():
        return np.asarray(temperatures.mean(axis=1))
    number = known.sum(axis=1)
    total = np.where(known, temperatures, 0.0).sum(axis=1)
    return np.where(number > 0, total / np.maximum(number, 1), np.nan)
