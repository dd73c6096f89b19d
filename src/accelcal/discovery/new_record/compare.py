"""A new record against what a calibration simulates, and whether they suit each other."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import check_number_or_none
from accelcal.arrays import Array, Ints
from accelcal.compensate.choice import compensation
from accelcal.compensate.coefficients import Compensation
from accelcal.compensate.ranges import outside_temperatures, within_temperatures
from accelcal.discovery.new_record.calibration_errors import calibration_errors
from accelcal.discovery.new_record.changes import notes_of_positions
from accelcal.discovery.new_record.errors_counted import (
    coefficient_notes,
    counted,
    from_calibration,
    head_notes,
    notes,
    said_of_usual_slopes,
    with_usual_slopes,
)
from accelcal.discovery.new_record.judgement import judge
from accelcal.discovery.new_record.same_clamping import Fixtures, Seen, is_one_head
from accelcal.discovery.new_record.simulated import (
    hiding,
    known_noise,
    loud_runs,
    record_noise,
    simulated_readings,
    step_of,
    worse_than_known,
)
from accelcal.discovery.noise.of_readings import refuse_too_many, sources
from accelcal.discovery.unwritten import refuse_several_clampings, simulated_in_pauses
from accelcal.effects.conditions import LEVEL_CHANGE
from accelcal.effects.without_sources import without_sources
from accelcal.errors import AccelcalWarning, InputError
from accelcal.estimate.at_positions import at_positions
from accelcal.numerics.grouping import grouped
from accelcal.record import TumbleRecord, naming
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import BY_OTHERS
from accelcal.results.disagreement import Disagreement
from accelcal.units import conversion_factor
from accelcal.version import SOFTWARE

__all__ = ["compare", "residuals_of"]


def compare(
    calibration: Calibration,
    record: TumbleRecord,
    *,
    same_head: bool | None = None,
    fixture_uncertainty: float | None = None,
) -> Disagreement:
    """Show where a calibration and a record disagree.

    Parameters
    ----------
    calibration : Calibration
        The calibration, with the effects that it has.
    record : TumbleRecord
        Readings, of the same accelerometer.
    same_head : bool, optional
        Whether both were measured on one head, with the fixture clamped alike. By default the lines
        ``# head: NAME`` of both tell it, or ``# stand: NAME``.
    fixture_uncertainty : float, optional
        Standard uncertainty of the fixture angle of each test [rad]. By default it is not counted,
        and another angle is a change of the misalignment.

    Returns
    -------
    Disagreement
        Shares of the factors, what has changed in each run, and what it looks like.

    Raises
    ------
    InputError
        If the record is in a unit of another quantity, outside the calibrated temperatures or
        without any, in a mounting that was not calibrated, no record at all, or one of too many
        readings, positions and cycles; if an option is none.

    Warns
    -----
    AccelcalWarning
        Where the readings scatter, or the head seems wrong, by so much that it hides
        disagreements.

    Notes
    -----
    The verdict needs no fit to the record. What may differ without disagreeing is the noise of its
    readings (from replicates, else as the calibration has it, with its degrees of freedom), head,
    launch and temperature errors as declared, and the uncertainty of the calibration. Where few
    degrees of freedom tell that, it counts as larger by its coverage factor over the normal one.

    The changes of a run are fitted at once, as far as its positions tell them apart. The verdict
    takes bias, scale factor and misalignment also as if the shape had not changed.

    Where both declare the local gravity, the readings are compared at theirs, in the local g of the
    calibration.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> found = accelcal.compare(calibration, accelcal.simulate(seed=2))
    >>> found.p_value > 0.01
    True
    """
    expect(calibration, Calibration)
    check_number_or_none(0.0, fixture_uncertainty=fixture_uncertainty)
    found = compensation(without_sources(calibration, BY_OTHERS), effects=False)
    converted = suited(found, record)
    with naming(record):
        refuse_too_many(record)
    simulated = simulated_readings(calibration, found, converted)
    known = known_noise(calibration, found.K1.at_T0)
    step = step_of(found, converted)
    noise, dof, source, said_of_noise = record_noise(calibration, known, converted, simulated, step)
    own = from_calibration(calibration, record)
    declared = counted(record, own)
    errors = with_usual_slopes(calibration_errors(calibration, found), found)
    counting = sources(noise, declared, record, unrepeated=source) + loud_runs(calibration, found)
    if worse := worse_than_known(noise, known) or hiding(counting):
        warnings.warn(f"{record.source}: {worse}", AccelcalWarning, stacklevel=2)
    paused, said = simulated_in_pauses(converted, simulated.conditions, calibration.effects)
    fixtures = Fixtures(calibration, found, fixture_uncertainty)
    seen = Seen(converted, simulated, noise, dof, declared, own, errors, step, paused, fixtures)
    same = is_one_head(calibration, record, errors, same_head)
    return Disagreement(
        rms=float(np.sqrt(np.mean(simulated.residual**2))),
        **judge(seen, same).told(),
        noise=counting,
        same_head=same,
        effects=tuple(effect.id for effect in calibration.effects),
        notes=(
            *filter(None, [worse, said_of_noise]),
            *(*coefficient_notes(seen), *notes(seen, record)),
            *(*said, *said_of_usual_slopes(seen), *head_notes(seen, same)),
            *(*fixtures.notes(record), *notes_of_positions(seen)),
        ),
        serial=record.serial,
        readings=len(record),
        source=record.source,
        calibration=calibration.source,
        software=SOFTWARE,
    )


def residuals_of(calibration: Calibration, record: TumbleRecord) -> Array:
    """Reading minus what a calibration simulates, over K1 at T0.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    record : TumbleRecord
        Readings of the same accelerometer.

    Returns
    -------
    ndarray, shape (n,)
        The residuals [g].

    Raises
    ------
    InputError
        If the record does not suit the calibration, see `compare`.
    """
    found = compensation(calibration, effects=False)
    return simulated_readings(calibration, found, suited(found, record)).residual


_LARGEST = 1e6
"""Reading of a tumble test above which it is none [g]."""


def suited(found: Compensation, record: TumbleRecord) -> TumbleRecord:
    """Give a record at its positions, in the unit of the calibration that it is compared with.

    Where one of both names no unit, the readings are taken as they are.

    Raises
    ------
    InputError
        If it is no record, in a unit of another quantity, of several clampings, far off any reading
        in g, or outside the calibrated temperatures, or without temperatures where the calibration
        depends on them.
    """
    expect(record, TumbleRecord)
    refuse_several_clampings(record)
    converted = record if found.output_unit is None else _in_unit(record, found.output_unit)
    largest = float(np.abs(converted.output).max() / abs(found.K1.at_T0))
    if largest > _LARGEST:
        raise InputError(
            f"{record.source}: readings of up to {largest:.3g} g by this calibration; give readings"
            " of its accelerometer, in the unit of the calibration"
        )
    _refuse_other_temperatures(found, converted)
    return at_positions(converted)


def _in_unit(record: TumbleRecord, unit: str) -> TumbleRecord:
    """Readings, their deviations and their resolution in another unit of the same quantity."""
    factor = 1.0 if record.unit is None else conversion_factor(record.unit, unit)
    if factor is None:
        raise InputError(
            f"{record.source}: readings in {record.unit}, but the calibration is in {unit}; give"
            " readings in its unit"
        )
    step = record.apparatus.resolution
    return replace(
        record.with_apparatus(resolution=None if step is None else step * factor),
        output=record.output * factor,
        std=None if record.std is None else record.std * factor,
        unit=unit,
    )


def _refuse_other_temperatures(found: Compensation, record: TumbleRecord) -> None:
    if found.temperatures is None:
        return
    is_known = np.isfinite(record.temperature)
    known, run = record.temperature[is_known], record.run[is_known]
    if found.several_levels and known.size < len(record):
        raise InputError(
            f"{record.source}: {len(record) - known.size} readings without temperature, on which"
            " the calibration depends; give their temperature"
        )
    outside = _outside(found.temperatures, known, run)
    if outside.size:
        problem = outside_temperatures(found.temperatures, float(outside[0]))
        raise InputError(
            f"{record.source}: {problem}; compare there, or calibrate at this temperature"
        )


def _outside(temperatures: tuple[float, float], known: Array, run: Ints) -> Array:
    """Levels of runs beyond the temperatures of a calibration, and readings far beyond [degC].

    The temperatures of the calibration are means of runs, too, whose readings may move.
    """
    of_runs = grouped(run)
    level = (np.bincount(of_runs.cell, weights=known) / of_runs.members)[of_runs.cell]
    moved = np.clip(known - level, -LEVEL_CHANGE, LEVEL_CHANGE)
    is_level_within = within_temperatures(temperatures, level)
    is_within = is_level_within & within_temperatures(temperatures, known - moved)
    return np.where(is_level_within, known, level)[~is_within]
