"""What coefficients refer to: the reference temperature T0 and the fixture angle of a record."""

from __future__ import annotations

import numpy as np

from accelcal.arguments import check_number
from accelcal.errors import InputError
from accelcal.geometry import checked_fixture_angle
from accelcal.record import TumbleRecord

__all__ = [
    "declared_fixture_angle",
    "fixture_angle",
    "has_reference_temperature",
    "reference_temperature_of",
]

_USUAL_TEMPERATURE = 20.0


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


def has_reference_temperature(record: TumbleRecord, given: float | None = None) -> bool:
    """Tell whether T0 is given, or declared by the record.

    Parameters
    ----------
    record : TumbleRecord
        The record.
    given : float, optional
        T0 [degC].

    Returns
    -------
    bool
        Whether it is; otherwise `reference_temperature_of` chooses it.
    """
    return given is not None or record.reference_temperature is not None


def reference_temperature_of(record: TumbleRecord, given: float | None = None) -> float | None:
    """Take T0 as given, else as the record declares it, else the level nearest to 20 degC.

    Parameters
    ----------
    record : TumbleRecord
        The record.
    given : float, optional
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
    known = np.isfinite(record.temperature)
    runs = (record.temperature[known & (record.run == i)] for i in range(len(record.run_labels)))
    levels = [float(run.mean()) for run in runs if run.size]
    return min(levels, key=lambda level: abs(level - _USUAL_TEMPERATURE), default=None)
