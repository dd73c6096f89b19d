"""From the record of a tumble test to a calibration, and from many records, plan by plan."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from accelcal.arguments.kinds import expect, several
from accelcal.arrays import Places
from accelcal.calibrate.options import Options
from accelcal.calibrate.plan import OnePlan, plans_of
from accelcal.calibrate.stack import CalibrationStack, calibration_stack
from accelcal.errors import InputError
from accelcal.estimate.at_positions import at_positions
from accelcal.logs import tell
from accelcal.model import COEFFICIENTS
from accelcal.record import TumbleRecord
from accelcal.results.calibration import Calibration

if TYPE_CHECKING:
    from accelcal.calibrate.options import LawsOf
    from accelcal.estimate.tables import Method
    from accelcal.results.discovery import Discovery
    from accelcal.results.head_calibration import HeadCalibration

__all__ = ["fit"]


def fit(
    record: TumbleRecord,
    *,
    method: Method = "least-squares",
    robust: bool = False,
    delta0: float | None = None,
    reference_temperature: float | None = None,
    coefficients: Sequence[str] = COEFFICIENTS,
    strict: bool = False,
    temperature_laws: LawsOf = "tables",
    model: Discovery | None = None,
    head: HeadCalibration | None = None,
) -> Calibration:
    """Calibrate an accelerometer from the record of its tumble test.

    Parameters
    ----------
    record : TumbleRecord
        All readings of one accelerometer.
    method : str, default "least-squares"
        ``"least-squares"``; the closed forms ``"closed-form"``, ``"sign-corrected"``,
        ``"printed"``.
    robust : bool, default False
        Make the readings safe against outliers by their replicates first; it takes three readings
        at a position to tell which is wrong, and fewer stay as they are.
    delta0 : float, optional
        Fixture angle between head zero and input axis, taken as given [rad]; by default that of
        the record's metadata, else 0.
    reference_temperature : float, optional
        T0; by default that of the record, else the level nearest to 20 degC [degC].
    coefficients : sequence of str, default all six
        Coefficients to estimate; the others are taken as zero.
    strict : bool, default False
        Refuse a design that does not determine all coefficients asked for.
    temperature_laws : str, default "tables"
        Fit the temperature laws to the coefficients of the ``"tables"``, or to all ``"readings"``,
        each at its own temperature.
    model : Discovery, optional
        Effects to take out of the readings first; their sizes are fitted anew.
    head : HeadCalibration, optional
        Calibration or certificate of the head: the readings are corrected to the true angles, and
        what it leaves uncertain takes the place of the declared uncertainty of the head. What the
        record itself told of the head is left out.

    Returns
    -------
    Calibration
        A table of coefficients for each run and mounting, with uncertainties and gates.

    Raises
    ------
    InputError
        If `record` is no record, the method is unknown, an argument is not finite, or the record
        names another head than `head`.
    DesignError
        If the angles do not allow what is asked.

    Warns
    -----
    AccelcalWarning
        With ``method="printed"``, which is misprinted.

    Notes
    -----
    Equations (1), (2) and (6). Each table has coefficients of its own; the errors of the head are
    common to all of them.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> calibration.tables[0].error_model["k0"].unit
    'g'
    """
    expect(record, TumbleRecord)
    options = Options(
        method=method,
        robust=robust,
        delta0=delta0,
        reference_temperature=reference_temperature,
        coefficients=several(coefficients),
        strict=strict,
        temperature_laws=temperature_laws,
        model=model,
        head=head,
    )
    options.check()
    options.warn(stacklevel=2)
    tell("fitting %r: %d tables by %s", record.source, sum(1 for _ in record.table_masks()), method)
    return calibration_stack(OnePlan.of([at_positions(record, delta0)]), options).one(0)


# -- many records ----------------------------------------------------------------------------------


class Many(NamedTuple):
    """Calibrations of many records."""

    stacks: tuple[tuple[Places, CalibrationStack], ...]  # places of those of a plan
    failures: Mapping[int, InputError]  # place of each that could not be calibrated -> why


def calibrate_many(records: Sequence[TumbleRecord], options: Options | None = None) -> Many:
    """Calibrate many records, those of one plan together.

    `CalibrationStack.one` gives what `accelcal.fit` gives.

    Raises
    ------
    InputError
        If what is asked is asked of no record.

    Notes
    -----
    Alone are, beside those of `plans_of`, records that told of the head that is given: what they
    told is left out, so that each has a head of its own. The sizes of the effects of a model are
    found record by record; the records without them are calibrated together.

    Examples
    --------
    >>> import accelcal
    >>> found = calibrate_many([accelcal.simulate(seed=seed) for seed in range(3)])
    >>> [(places.tolist(), len(stack)) for places, stack in found.stacks]
    [([0, 1, 2], 3)]
    """
    asked = Options() if options is None else options
    asked.check()
    stacks: list[tuple[Places, CalibrationStack]] = []
    failures: dict[int, InputError] = {}
    for places, plan in plans_of(records, asked.delta0, gaps=asked.takes_gaps):
        for rows, part in _parts(plan, asked):
            for found in _attempts(places[rows], part, asked):
                if isinstance(found[1], InputError):
                    failures[int(found[0][0])] = found[1]
                else:
                    stacks.append((found[0], found[1]))
    return Many(tuple(stacks), failures)


def _parts(plan: OnePlan, options: Options) -> Iterator[tuple[Places, OnePlan]]:
    """Records that can be calibrated together, and each by itself that told of the head."""
    apart = options.left_out(plan.records)
    if not apart.any():
        yield np.arange(apart.size), plan
        return
    for rows in (*np.flatnonzero(apart)[:, None], np.flatnonzero(~apart)):
        if rows.size:
            yield rows, plan.of_records(rows)


def _attempts(
    places: Places, plan: OnePlan, options: Options
) -> Iterator[tuple[Places, CalibrationStack | InputError]]:
    """Calibrate records of a plan together, or each by itself where that fails."""
    try:
        yield places, calibration_stack(plan, options)
    except InputError as error:
        if len(places) == 1:
            yield places, error
            return
        for row in range(len(places)):
            yield from _attempts(places[[row]], plan.of_records(np.array([row])), options)
