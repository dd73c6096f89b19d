"""A new record against what a calibration simulates."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import check_number_or_none
from accelcal.arrays import Array
from accelcal.compensate.choice import compensation
from accelcal.compensate.coefficients import Compensation
from accelcal.discovery.columns import head_columns, saturated
from accelcal.discovery.factors import blocks
from accelcal.discovery.new_record.calibration_errors import CalibrationErrors, calibration_errors
from accelcal.discovery.new_record.chances import Estimated, chances
from accelcal.discovery.new_record.changes import Uncertain, changes, wider
from accelcal.discovery.new_record.errors_counted import (
    coefficient_notes,
    counted,
    freedom,
    from_calibration,
    head_notes,
    notes,
    size_counted,
    untold,
)
from accelcal.discovery.new_record.fixture import Fixtures
from accelcal.discovery.new_record.one_head import head_difference, is_one_head, is_turned_over
from accelcal.discovery.new_record.record_noise import record_noise, step_of
from accelcal.discovery.new_record.repeatability import (
    hiding,
    known_noise,
    loud_runs,
    worse_than_known,
)
from accelcal.discovery.new_record.simulated import Simulated, simulated_readings
from accelcal.discovery.new_record.suited import suited
from accelcal.discovery.new_record.undetermined import of_undetermined
from accelcal.discovery.noise.covariance import Covariance, whitener_of
from accelcal.discovery.noise.of_readings import (
    ReadingNoise,
    acting,
    covariance,
    refuse_too_many,
    sources,
)
from accelcal.discovery.space import Space, space_of
from accelcal.discovery.untimed import simulated_in_pauses
from accelcal.discovery.where import by_factor, pattern, shares, structure
from accelcal.effects.without_sources import without_sources
from accelcal.errors import AccelcalWarning
from accelcal.estimate.at_positions import said_of_positions
from accelcal.numerics.covariance_root import covariance_root
from accelcal.numerics.one_thread import in_one_thread
from accelcal.numerics.probability import LEVEL, NORMAL_FACTOR, student_quantile
from accelcal.record import TumbleRecord, naming
from accelcal.results.agreement import ALPHA, HIDING, chance_of, least_of
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import BY_OTHERS
from accelcal.results.disagreement import Disagreement, RunChange
from accelcal.results.findings import Share
from accelcal.results.quantity import ErrorSource
from accelcal.version import SOFTWARE

__all__ = ["compare", "residuals_of"]

_LEVEL = 0.5 * ALPHA
"""Chance below which a factor disagrees: it is one of two tests, see `_chance_of_runs`."""


class _Seen(NamedTuple):
    """A record beside what its calibration simulates, with all that is uncertain in both."""

    record: TumbleRecord
    simulated: Simulated
    noise: ReadingNoise
    dof: float
    declared: Apparatus
    known: dict[str, ErrorSource]
    errors: CalibrationErrors
    step: float
    paused: Array
    fixtures: Fixtures


class _Judged(NamedTuple):
    """What disagrees, by what was taken as uncertain."""

    where: tuple[Share, ...]
    reduced_chi2: float
    structure: str
    runs: tuple[RunChange, ...]
    p_value: float
    explained_by: tuple[str, ...] = ()


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
    Nothing is fitted to the record. What may differ without disagreeing is the noise of its
    readings (from replicates, else as the calibration has it, with its degrees of freedom), head,
    launch and temperature errors as declared, and the uncertainty of the calibration. Where few
    degrees of freedom tell that, it counts as larger by its coverage factor over the normal one.

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
    found = _found(without_sources(calibration, BY_OTHERS))
    converted = suited(found, record)
    with naming(record):
        refuse_too_many(record)
    simulated = simulated_readings(calibration, found, converted)
    known = known_noise(calibration, found.K1.at_T0)
    step = step_of(found, converted)
    noise, dof, source, said_of_noise = record_noise(calibration, known, converted, simulated, step)
    own = from_calibration(calibration, record)
    declared, errors = counted(record, own), calibration_errors(calibration, found)
    counting = sources(noise, declared, record, unrepeated=source) + loud_runs(calibration, found)
    if worse := worse_than_known(noise, known) or hiding(counting):
        warnings.warn(f"{record.source}: {worse}", AccelcalWarning, stacklevel=2)
    paused, said = simulated_in_pauses(converted, simulated.conditions, calibration.effects)
    fixtures = Fixtures(calibration, found, fixture_uncertainty)
    seen = _Seen(converted, simulated, noise, dof, declared, own, errors, step, paused, fixtures)
    same = is_one_head(calibration, record, errors, same_head)
    judged = _whatever_is_untold(seen, same)
    return Disagreement(
        rms=float(np.sqrt(np.mean(simulated.residual**2))),
        **judged._asdict(),
        noise=counting,
        same_head=same,
        effects=tuple(effect.id for effect in calibration.effects),
        notes=(
            *filter(None, [worse, said_of_noise]),
            *coefficient_notes(found, simulated, errors.unbounded),
            *notes(calibration, record, declared, own),
            *(*said, *said_of_positions(converted)),
            *head_notes(calibration, declared, same, bool(errors.positions.size)),
            *fixtures.notes(record),
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
    found = _found(calibration)
    return simulated_readings(calibration, found, suited(found, record)).residual


def _found(calibration: Calibration) -> Compensation:
    return compensation(calibration, effects=False)


def _whatever_is_untold(seen: _Seen, same: bool | None) -> _Judged:
    """Judge, and say whether errors that nothing tells explain all if they may be `HIDING`."""
    calibration, found, _ = seen.fixtures
    names = untold(calibration, seen.known)
    judged = _whatever_the_head(seen, same)
    if judged.p_value >= ALPHA or not (names or found.undetermined):
        return judged
    lost = HIDING * of_undetermined(calibration, found)
    free = seen._replace(
        errors=seen.errors._replace(rest=seen.errors.rest + lost @ lost.T),
        declared=replace(seen.declared, **dict.fromkeys(names, HIDING)),
        known={name: own for name, own in seen.known.items() if name not in names},
    )
    explained = _whatever_the_head(free, same).p_value >= ALPHA
    return judged._replace(explained_by=(*names, *found.undetermined)) if explained else judged


@in_one_thread()
def _whatever_the_head(seen: _Seen, same: bool | None) -> _Judged:
    """Judge by one head, or by two; where nothing tells which, by what is more uncertain.

    On the same side of an axis two heads always leave more uncertain than one.
    """
    turned_over = is_turned_over(seen.fixtures.calibration, seen.record)
    if same is not None or not turned_over or not seen.errors.positions.size:
        return _judged(seen, bool(same))
    one, two = _judged(seen, same=True), _judged(seen, same=False)
    nearer = max(one, two, key=lambda judged: judged.p_value)
    runs = tuple(map(wider, one.runs, two.runs))
    return nearer._replace(runs=runs)


def _judged(seen: _Seen, same: bool) -> _Judged:
    """Judge with the head of the calibration under the record, or with another one."""
    c, by_error = seen.simulated.conditions, seen.simulated.by_error
    larger, by_head = seen.errors.larger(seen.dof, head=not same), _by_head(seen, same)
    sizes = np.sqrt(np.diagonal(larger))
    of_calibration = by_error @ covariance_root(larger, np.where(sizes > 0.0, sizes, 1.0))
    by_fixture = seen.fixtures.difference(by_error, same=same)
    spread = _spread(seen).with_shared(np.hstack([of_calibration, by_head, by_fixture]))
    space = _space(seen, spread)
    coordinates = space.see(seen.simulated.residual)
    factors = blocks(space, c, first="run")
    single = chances(space, coordinates, factors, seen.dof, _estimated(seen, same, larger))
    where = shares(coordinates, factors, single)
    worst = max(range(len(where)), key=lambda i: (where[i].p_value < _LEVEL, where[i].share))
    told, block = "", factors[worst]
    if where[worst].p_value < _LEVEL:
        shape = pattern(space, coordinates, block)
        told = structure(c, seen.record.run_labels, block.factor, shape)
    factor, dof = _head_as_counted(seen)
    known = Uncertain(
        spread=spread,
        sigma=seen.noise.sigma,
        dof=seen.dof,
        errors=seen.errors,
        larger=larger,
        by_head=by_head,
        head_factor=factor,
        head_dof=dof,
        one_head=same,
    )
    by_factors, runs = by_factor(where), tuple(changes(seen.record, seen.simulated, known))
    return _Judged(
        where=by_factors,
        reduced_chi2=float(coordinates @ coordinates) / coordinates.size,
        structure=told,
        runs=runs,
        p_value=least_of([min(own.p_value for own in by_factors), _chance_of_runs(seen, runs)]),
    )


def _chance_of_runs(seen: _Seen, runs: Sequence[RunChange]) -> float:
    """Chance of any change in a run.

    A factor has many directions. Where few degrees of freedom tell the launches, a change in one
    of them is seen by itself only. Its own degrees of freedom are those of 95 %; farther out, the
    fewest count.
    """
    launches = (own for name, own in seen.known.items() if name != "head_uncertainty")
    fewest = min(map(freedom, launches), default=np.inf)
    return least_of([chance_of(own, fewest) for run in runs for own in run.changes])


def _estimated(seen: _Seen, same: bool, larger: Array) -> Estimated:
    """Errors whose sizes the calibration tells: its own, those of the head and of launches."""
    c, by_error = seen.simulated.conditions, seen.simulated.by_error
    columns = acting(c)
    if same:
        columns["head_uncertainty"] = head_difference(seen.errors, seen.simulated, seen.record)
    others = [(columns[name], source) for name, source in seen.known.items()]

    def covariance(of_calibration: Array, size: Callable[[ErrorSource], float]) -> Array:
        sizes = [np.full(own.shape[1], size(source)) for own, source in others]
        whole = np.diag(np.concatenate([np.zeros(len(of_calibration)), *sizes]) ** 2)
        whole[: len(of_calibration), : len(of_calibration)] = of_calibration
        return whole

    return Estimated(
        acting=np.hstack([by_error, *(own for own, _ in others)]),
        counted=covariance(larger, size_counted),
        sized=lambda factor: covariance(
            seen.errors.sized(factor, head=not same),
            lambda source: (source.value or 0.0) * factor(freedom(source)),
        ),
    )


def _by_head(seen: _Seen, same: bool) -> Array:
    """What the errors of the head do to the differences, of the size that they count with [g]."""
    size = seen.declared.head_uncertainty or 0.0
    if same:
        return size * head_difference(seen.errors, seen.simulated, seen.record)
    return size * head_columns(seen.simulated.conditions)


def _head_as_counted(seen: _Seen) -> tuple[float, float]:
    """Size of the head's errors over its estimate, and the degrees of freedom of that."""
    if seen.record.apparatus.head_uncertainty is not None:
        return 1.0, np.inf
    dof = seen.errors.head_dof
    return student_quantile(LEVEL, dof) / NORMAL_FACTOR, dof


def _spread(seen: _Seen) -> Covariance:
    """Covariance of all errors but those of the head and of the calibration's coefficients."""
    others = replace(seen.declared, head_uncertainty=None)
    own = covariance(seen.simulated.conditions, seen.noise, others, seen.step)
    return own.with_shared(seen.paused)


def _space(seen: _Seen, spread: Covariance) -> Space:
    record, noise, c = seen.record, seen.noise, seen.simulated.conditions
    # Noise without degrees of freedom is taken as known. All that is left then counts as repeating,
    # and no replicates are set apart to estimate the noise anew.
    repeating = saturated(c, record.mounting) if noise.dof else np.eye(len(record))
    return space_of(whitener_of(spread), np.empty((len(record), 0)), repeating)
