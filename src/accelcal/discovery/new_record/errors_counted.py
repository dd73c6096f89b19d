"""The errors that a comparison counts with: as declared, else as the calibration knew them.

And what coefficients and slopes may be that the calibration does not determine.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import compress
from types import MappingProxyType

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arrays import Array
from accelcal.compensate.coefficients import PARAMETERS, SLOPES, Compensation
from accelcal.compensate.runs import said_of_runs
from accelcal.discovery.columns import dummies
from accelcal.discovery.new_record.calibration_errors import CalibrationErrors, is_corrected
from accelcal.discovery.new_record.same_clamping import Seen, is_same_file
from accelcal.discovery.new_record.simulated import ERRORS, gravity_ratio
from accelcal.errors import InputError
from accelcal.estimate.error_components import SHIFTED
from accelcal.estimate.uncertainty import share_taken_off
from accelcal.geometry import accelerations
from accelcal.model import design_matrix
from accelcal.numerics.probability import LEVEL, NORMAL_FACTOR, student_quantile
from accelcal.plural import are, listed
from accelcal.recalibrations.comparable import ALIKE, BIAS_PER_DEGREE, SCALE_FACTOR_PER_DEGREE
from accelcal.record import TumbleRecord
from accelcal.results.agreement import NOISE
from accelcal.results.calibration import Calibration
from accelcal.results.quantity import ErrorSource
from accelcal.results.tables_in_use import tables_in_use

HEAT = "temperature_uncertainty"
"""What declares the errors of temperatures, which no readings tell."""

_NAMES = ("head_uncertainty", "launch_uncertainty", "launch_sf_uncertainty", HEAT)
"""What a calibration may know of errors that a record does not declare."""

_NONE: Mapping[str, ErrorSource] = MappingProxyType({})

_LIKE = 0.1
"""Relative change of a scale factor that no accelerometer has; readings [g] that show one."""

_FEW = 10.0
"""Degrees of freedom below which an estimated size may be wrong by half and more."""


def counted(record: TumbleRecord, known: Mapping[str, ErrorSource]) -> Apparatus:
    """Take what the record declares, and where it does not, what the calibration knew.

    An error that it estimated from few degrees of freedom is larger than the estimate by Student's
    factor over the normal one.

    Raises
    ------
    InputError
        If that is larger than any stand has it.
    """
    try:
        return replace(record.apparatus, **{name: size_counted(own) for name, own in known.items()})
    except InputError:
        raise InputError(
            "the calibration found larger errors in its own readings than any stand has, as where"
            " readings are exchanged; mend what its warnings name, and fit again"
        ) from None


def from_calibration(calibration: Calibration, record: TumbleRecord) -> dict[str, ErrorSource]:
    """What the calibration knew of errors that the record does not declare, by their names."""
    known = _sources(calibration)
    if is_corrected(calibration):
        known.pop("head_uncertainty", None)  # what the correction left; the record has the whole
    return {
        name: _with_noise(known[name], calibration)
        for name in _NAMES
        if getattr(record.apparatus, name) is None
        and name in known
        and known[name].value is not None
    }


def _with_noise(source: ErrorSource, calibration: Calibration) -> ErrorSource:
    """An estimated shift from launch to launch, with the noise that was taken off its scatter.

    Without it, that of few runs is zero too often (see `accelcal.estimate.launch`).
    """
    coefficient = SHIFTED.get(source.name)
    if coefficient is None or source.dof is None:
        return source
    by_noise = [
        table.budget.get(coefficient, {}).get("reading", 0.0)
        / (table.coefficients["K1"].value or np.inf)
        for table in calibration.tables
    ]
    whole = (source.value or 0.0) ** 2 + share_taken_off(source.dof) * np.mean(np.square(by_noise))
    return replace(source, value=float(np.sqrt(whole)))


def size_counted(source: ErrorSource) -> float:
    """Size that an error counts with: an estimate of few degrees of freedom may be too small."""
    return (source.value or 0.0) * student_quantile(LEVEL, freedom(source)) / NORMAL_FACTOR


def freedom(source: ErrorSource) -> float:
    """Degrees of freedom of the size of an error, infinite where it is known."""
    return np.inf if source.dof is None else source.dof


def untold(calibration: Calibration, known: Mapping[str, ErrorSource] = _NONE) -> list[str]:
    """Name errors of head, launches and temperatures that nobody declared and no readings tell.

    A head of few degrees of freedom that shows no errors is none that has none; shifts of launches
    that are not seen count with the noise beside them, see `_with_noise` and
    `accelcal.estimate.launch`. What a comparison knows better than the calibration is `known`, from
    `from_calibration`.
    """
    sources = _sources(calibration, known)
    return [name for name in _NAMES if name not in sources or _is_untold(sources[name])]


def heat_of(calibration: Calibration) -> float | None:
    """Standard uncertainty of the temperatures of a calibration [degC], None where not declared."""
    source = _sources(calibration).get(HEAT)
    return source.value if source else None


def too_little_told(
    calibration: Calibration, known: Mapping[str, ErrorSource] = _NONE
) -> tuple[str, ...]:
    """Name errors that few degrees of freedom tell, noise as `NOISE`; `known` as in `untold`."""
    sources = _sources(calibration, known)
    few = {name for name, source in sources.items() if freedom(source) < _FEW}
    told = [name for name in _NAMES if name in few]
    return tuple(told or ([NOISE] if few else []))


def _sources(
    calibration: Calibration, known: Mapping[str, ErrorSource] = _NONE
) -> dict[str, ErrorSource]:
    """What is known of each error, by the name that declares it.

    A calibration has no source of temperatures that were declared to be exact.
    """
    own = {f"{source.name}_uncertainty": source for source in calibration.error_sources}
    if calibration.provenance.get("declared", {}).get(HEAT) == 0.0:
        own[HEAT] = ErrorSource("temperature", 0.0, "degC", None, "declared")
    return {**own, **known}


def _is_untold(source: ErrorSource) -> bool:
    is_zero = source.name == "head" and not source.value
    return source.value is None or (is_zero and freedom(source) < _FEW)


def notes(seen: Seen, record: TumbleRecord) -> Iterator[str]:
    """Say what makes a comparison with a record as it was given less than it seems."""
    calibration = seen.fixtures.calibration
    if None not in (calibration.serial, record.serial) and calibration.serial != record.serial:
        yield f"the calibration is that of {calibration.serial}, the record that of {record.serial}"
    yield from _units(calibration, record)
    if is_same_file(calibration, record):
        yield "the calibration was fitted to this very file: new readings would agree less well"
    if told := said_of_runs(calibration):
        yield f"the {told}"
    if missing := [name for name in _NAMES if getattr(seen.declared, name) is None]:
        yield f"{listed(missing)} {are(missing)} not declared: such errors look like a change"
    if any(table.shares for table in calibration.tables):
        yield (
            "the effects in the calibration count as they are named: if they are others that its"
            " warnings tell of, the readings may disagree though nothing has changed"
        )
    yield from _few_degrees(seen.known)


def coefficient_notes(seen: Seen) -> Iterator[str]:
    """Say where the coefficients of the calibration cannot be those of the record."""
    calibration, found, _ = seen.fixtures
    expected = seen.simulated.simulated
    ratio = float(seen.simulated.reading @ expected / (expected @ expected or 1.0))
    if abs(ratio - 1.0) > _LIKE and np.ptp(expected) > _LIKE:
        yield (
            f"the readings are {ratio:.3g} times what the calibration simulates: mend their unit or"
            " their sign, or give the calibration of this accelerometer"
        )
    if found.undetermined:
        main = tables_in_use(calibration, found.T0_degC).main
        stands = [f"; {name} stands for {what}" for name, what in main.stands_for.items()]
        yield (
            f"{', '.join(found.undetermined)} not determined by the calibration: taken as 0, so"
            " that what they do counts as a disagreement, and as a change of the others"
            f"{''.join(stands)}"
        )
    of_other = found.other.symbols if found.other else ()
    bare = list(compress((*found.symbols, *of_other), seen.errors.unbounded))
    if bare:
        have = "has" if len(bare) == 1 else "have"
        yield f"{listed(bare)} {have} no U in the calibration: what changes in them is not told"


def head_notes(seen: Seen, same: bool | None) -> Iterator[str]:
    """Say what the head leaves open, where both were measured on the `same` or nothing tells."""
    if is_corrected(seen.fixtures.calibration):
        yield (
            "the calibration was corrected by the known errors of its head, the record is not: they"
            " are in the differences; on the same head, compare with a calibration that is not"
            " corrected, which has them as well"
        )
    elif same is None and seen.declared.head_uncertainty and not seen.errors.positions.size:
        yield "the calibration tells no positions of its head, or too many: it counts as another"
    elif same is None and seen.declared.head_uncertainty:
        yield (
            "it is not known whether both were measured on one head, clamped alike: the intervals"
            " are the wider ones of both cases; name the head in a line '# head: NAME' of both"
            " tables, or give same_head=True or same_head=False"
        )


def _units(calibration: Calibration, record: TumbleRecord) -> Iterator[str]:
    """How the units of both come together."""
    own, other = record.unit, calibration.output_unit
    if own is None and other is not None:
        yield f"the record names no unit: its readings are taken as {other}"
    elif own is not None and other is None:
        yield f"the calibration names no unit: it is taken as that of the readings, {own}"
    elif own != other:
        yield f"readings in {own} are converted to {other}"
    here, there = record.apparatus.local_gravity, calibration.g_local_m_s2
    if (here is None) != (there is None):
        silent = "record" if here is None else "calibration"
        yield (
            f"the {silent} declares no local gravity: both are taken as of one place; elsewhere a"
            " difference of g looks like a change of the scale factor"
        )
    elif gravity_ratio(here, there) != 1.0:
        yield f"tested where g = {here} m/s^2, calibrated where g = {there} m/s^2, which is counted"


def _few_degrees(known: Mapping[str, ErrorSource]) -> Iterator[str]:
    """Errors that nobody declared and the calibration told from little."""
    few = [name for name, source in known.items() if source.dof is not None and source.dof < _FEW]
    if larger := [name for name in few if known[name].value]:
        yield (
            f"{listed(larger)} {are(larger)} not declared, and the calibration estimated that from"
            " few degrees of freedom: counted as larger than estimated, and may be larger still"
        )
    if none := [name for name in few if not known[name].value]:
        yield (
            f"{listed(none)} {are(none)} not declared, and the calibration shows none, by few"
            " degrees of freedom: such errors look like a change"
        )


_USUAL = dict(zip(SLOPES, 2 * (BIAS_PER_DEGREE, SCALE_FACTOR_PER_DEGREE, 0.0), strict=True))
"""Standard uncertainty of slopes that nothing tells."""


def with_usual_slopes(errors: CalibrationErrors, found: Compensation) -> CalibrationErrors:
    """The same errors; of a calibration of one level, which tells no slopes, with usual ones."""
    if found.several_levels:
        return errors
    sizes = np.array([_USUAL.get(name, 0.0) for name in ERRORS])
    return errors._replace(
        rest=errors.rest + np.diag(sizes**2), dof=np.where(sizes > 0.0, np.inf, errors.dof)
    )


def by_usual_heat(seen: Seen) -> Array:
    """What errors of temperatures do beside a calibration of one level, by usual slopes.

    There is one of all readings of the calibration, and one of each run of the record, where
    declared; shape (n, k) [g].
    """
    runs = dummies(seen.simulated.conditions.run)
    if seen.fixtures.found.several_levels:
        return np.empty((len(runs), 0))
    of_calibration, own = _heat(seen)
    slopes = BIAS_PER_DEGREE, SCALE_FACTOR_PER_DEGREE
    acting = seen.simulated.by_error[:, [ERRORS.index(name) for name in ("k0", "K1")]] * slopes
    by_run = (acting[:, :, None] * runs[:, None, :]).reshape(len(runs), -1)
    return np.hstack([of_calibration * acting, own * by_run])


def _heat(seen: Seen) -> tuple[float, float]:
    known = heat_of(seen.fixtures.calibration)
    return known or 0.0, seen.declared.temperature_uncertainty or 0.0


def said_of_usual_slopes(seen: Seen) -> list[str]:
    """Say that a record is beside the one level of its calibration, or may be."""
    away, heat = float(np.abs(seen.simulated.conditions.excess).max()), max(_heat(seen))
    if seen.fixtures.found.several_levels or max(away, heat) <= ALIKE:
        return []
    told = (
        f"readings are up to {away:.2g} degC off the calibration, which tells"
        if away > ALIKE
        else f"temperatures have errors of {heat:.2g} degC, and the calibration tells"
    )
    return [
        f"{told} no slopes: U counts what usual ones make of it, {1e6 * BIAS_PER_DEGREE:g} ug/degC"
        f" and {1e6 * SCALE_FACTOR_PER_DEGREE:g} ppm/degC"
    ]


def undetermined(found: Compensation) -> list[int]:
    """Places among `ERRORS` of what a calibration does not determine."""
    symbols = (*found.symbols, *(found.other.symbols if found.other else ()))
    return [place for place, symbol in enumerate(symbols) if symbol in found.undetermined]


def of_undetermined(calibration: Calibration, found: Compensation) -> Array:
    """What each coefficient that is not determined does to `ERRORS`, shape (18, k).

    Those that are determined stand for what they took up of it at the angles of the calibration:
    beside a K3 that is taken as 0, K1 is K1 + K3 in steps of 90 deg.
    """
    lost = undetermined(found)
    acting = np.eye(len(ERRORS))[:, lost]
    angle = tables_in_use(calibration, found.T0_degC).main.residuals.angle_deg
    columns = design_matrix(accelerations(angle))
    told = [place for place in range(len(PARAMETERS)) if place not in lost]
    of_main = columns @ acting[: len(PARAMETERS)]
    acting[told] -= np.linalg.pinv(columns[:, told]) @ of_main
    return acting
