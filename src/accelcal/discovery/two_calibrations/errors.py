"""The errors of two calibrations together, with what is common to both.

With J_1 and J_2 the derivatives of a quantity by the errors of the old and of the new calibration,
its difference J_2 e_2 - J_1 e_1 has the variance

    u^2 = J_1 R_1 J_1' + J_2 R_2 J_2' + head,

where R_i is the covariance of all errors of a calibration but those by its head. An error of each
head position, of the standard uncertainty s, does B_i to the errors of a calibration. Two heads are
independent, one head is the same in both (GUM, F.1.2.3: what is common to two quantities cancels in
their difference as far as it acts alike on both):

    two heads: s_1^2 J_1 B_1 B_1' J_1' + s_2^2 J_2 B_2 B_2' J_2'
    one head:  s^2 (J_2 B_2 - J_1 B_1) (J_2 B_2 - J_1 B_1)'

A fixture angle of a declared uncertainty adds in the same way: it acts on the misalignment of an
axis that was measured on one side only, with the sign of that side.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.compensate.choice import compensation
from accelcal.compensate.coefficients import Compensation
from accelcal.compensate.propagation import ratio
from accelcal.discovery.new_record.calibration_errors import CalibrationErrors, calibration_errors
from accelcal.discovery.new_record.errors_counted import HEAT, heat_of
from accelcal.discovery.new_record.same_clamping import by_fixture
from accelcal.discovery.new_record.simulated import ERRORS
from accelcal.effects.without_sources import without_sources
from accelcal.errors import InputError
from accelcal.model import CROSS_AXES
from accelcal.numerics.grouping import distinct
from accelcal.recalibrations.comparable import BIAS_PER_DEGREE, SCALE_FACTOR_PER_DEGREE
from accelcal.results.agreement import HIDING, HIDING_HEAT
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import BY_OTHERS
from accelcal.results.findings import FoundEffect
from accelcal.results.quantity import ErrorSource

_SIZE = len(ERRORS)
_PLACES = slice(0, _SIZE), slice(_SIZE, 2 * _SIZE)
_BIAS, _SCALE_FACTOR = ERRORS.index("k0"), ERRORS.index("K1")

_SHIFTED = {"launch_uncertainty": "k0", "launch_sf_uncertainty": "K1"}
"""What shifts from launch to launch; its slopes do by the shifts of other levels."""


_BY_USUAL_SLOPES = np.diag(
    [{"k0": BIAS_PER_DEGREE, "K1": SCALE_FACTOR_PER_DEGREE}.get(name, 0.0) for name in ERRORS]
)
"""What independent changes of bias and scale factor are by a degree, of usual slopes."""


class Side(NamedTuple):
    """One of two calibrations."""

    name: str  # ``"old"`` or ``"new"``
    calibration: Calibration
    found: Compensation  # what it gives, its effects as they are named
    errors: CalibrationErrors  # errors of that
    by_others: Array  # covariance of what may be there in the place of its effects, (18, 18)
    fixture: float | None = None
    """Standard uncertainty of its fixture angle [rad]; None where it is not known."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Ids of the effects that the calibration has."""
        return tuple(effect.id for effect in self.calibration.effects)

    @property
    def error_sources(self) -> tuple[ErrorSource, ...]:
        """What the calibration took as uncertain, the noise of a reading over K1 [g]."""
        scale = abs(self.found.K1.at_T0)
        return tuple(
            replace(own, value=(own.value or 0.0) / scale, unit="g")
            if own.name == "reading"
            else own
            for own in self.calibration.error_sources
        )

    @property
    def measured_effects(self) -> tuple[FoundEffect, ...]:
        """Effects whose sizes its own readings tell, and not those of a discovery alone."""
        told = self.calibration
        return tuple(item for item in told.effects if item.id not in told.effects_as_found)


def side_of(name: str, calibration: Calibration, fixture: float | None = None) -> Side:
    """Take what a calibration gives; `fixture` as in `Side`.

    Raises
    ------
    InputError
        If it does not say which coefficients to use, or has no uncertainties.
    """
    try:
        stated = compensation(calibration, effects=False)
        named = without_sources(calibration, BY_OTHERS)
        found = compensation(named, effects=False)
    except InputError as error:
        raise error.at(f"{name} calibration") from None
    covariance = np.array(found.covariance)
    if not np.diagonal(covariance)[[_BIAS, _SCALE_FACTOR]].all() or np.isnan(covariance).any():
        raise InputError(
            f"the {name} calibration states no uncertainty of some coefficients, so that no"
            " difference can be judged; fit it to readings with repeated strokes"
        )
    by_others = np.zeros((_SIZE, _SIZE))
    size = len(covariance)
    by_others[:size, :size] = np.array(stated.covariance) - covariance
    return Side(name, calibration, found, calibration_errors(named, found), by_others, fixture)


def freed(own: Side, names: Collection[str]) -> Side:
    """The same with errors of these names, as in `Apparatus`, that may be as large as `HIDING`.

    No estimate of few degrees of freedom makes these any larger.
    """
    shifted = {_SHIFTED[name] for name in names if name in _SHIFTED}
    free = np.array([HIDING if name.split("_slope")[0] in shifted else 0.0 for name in ERRORS])
    errors, heat = own.errors, HIDING_HEAT * _by_heat(own.found) * (HEAT in names)
    if "head_uncertainty" in names:
        errors = errors._replace(head=HIDING, head_dof=np.inf)
    by_head = (errors.of_head**2).sum(axis=1)
    over_dof = np.diagonal(errors.rest) / own.errors.freedom + by_head / errors.head_dof
    rest = errors.rest + np.diag(free**2) + heat @ heat.T
    dof = ratio(np.diagonal(rest) + by_head, over_dof)
    return own._replace(errors=errors._replace(rest=rest, dof=dof))


def _by_heat(found: Compensation) -> Array:
    """What an error of the temperature does at T0 and at either end of laws, shape (18, 3) [/degC].

    One at an end turns the slopes on its side. A single level has usual slopes.
    """
    if not found.several_levels:
        return _BY_USUAL_SLOPES
    acting = np.zeros((_SIZE, 3))
    low, high = found.temperatures or (0.0, 0.0)
    level = found.T0_degC or 0.0
    for name, law in (("k0", found.k0), ("K1", found.K1), ("delta", found.cross.delta)):
        acting[ERRORS.index(name), 0] = law.local_slope(np.zeros(1))[0]
        for place, side, span in ((1, "above", high - level), (2, "below", level - low)):
            slope = getattr(law, side).value
            acting[ERRORS.index(f"{name}_slope_{side}"), place] = slope / span if span else 0.0
    return acting


class Errors(NamedTuple):
    """Errors of both calibrations, those of the old one first."""

    covariance: Array  # their covariance, (36, 36)
    over_dof: Array  # the same with each part over its degrees of freedom, (36, 36)

    def beside(self, dof: Array) -> Errors:
        """The same with independent errors of variance 1 behind them, of k degrees of freedom."""
        known, more = len(self.covariance), dof.size
        whole = np.zeros((2, known + more, known + more))
        whole[:, :known, :known] = self
        whole[:, known:, known:] = np.eye(more), np.diag(1.0 / dof)
        return Errors(*whole)


def errors_of_both(
    old: Side,
    new: Side,
    temperature: float | None,
    *,
    same_head: bool,
    factor: Callable[[float], float] = lambda _: 1.0,
) -> Errors:
    """Covariance of the errors of two calibrations that matter in their difference.

    They are compared at a temperature [degC], and those of the head may be common to both. The
    factor gives standard uncertainties over their estimates, by the degrees of freedom of these;
    what is over the degrees of freedom is as estimated.
    """
    covariance, over_dof = np.zeros((2, 2 * _SIZE, 2 * _SIZE))
    for own, other, place in zip((old, new), (new, old), _PLACES, strict=True):
        covariance[place, place] = own.errors.rest_sized(factor) + _off_the_laws(
            own, other, temperature
        )
        over_dof[place, place] = own.errors.rest_over_dof
        if set(own.effects) != set(other.effects):
            covariance[place, place] += own.by_others
    for head, dof in _heads(old, new, same_head=same_head):
        covariance += factor(dof) ** 2 * head @ head.T
        over_dof += head @ head.T / dof
    for fixture in _fixtures(old, new, same_head=same_head):
        covariance += fixture @ fixture.T
    return Errors(covariance, over_dof)


def stated_errors(own: Side) -> Errors:
    """Covariance of the errors of one calibration as it states them, of shape (18, 18)."""
    of_head = own.errors.of_head @ own.errors.of_head.T
    return Errors(
        own.errors.rest + of_head + own.by_others,
        own.errors.rest_over_dof + of_head / own.errors.head_dof,
    )


def _heads(old: Side, new: Side, *, same_head: bool) -> list[tuple[Array, float]]:
    """What independent errors of the heads do, and the degrees of freedom of their size."""
    positions = distinct(np.concatenate([old.errors.positions, new.errors.positions]))
    both = []
    for own, place in zip((old, new), _PLACES, strict=True):
        acting = np.zeros((2 * _SIZE, positions.size))
        acting[place, np.searchsorted(positions, own.errors.positions)] = own.errors.by_head
        both.append(acting)
    known = [(own.errors.head, own.errors.head_dof) for own in (old, new)]
    if same_head:
        size, dof = max(known)
        return [(size * (both[0] + both[1]), dof)]
    return [(size * own, dof) for own, (size, dof) in zip(both, known, strict=True)]


def _fixtures(old: Side, new: Side, *, same_head: bool) -> list[Array]:
    """What independent errors of the fixture angles do: one, where both were clamped alike."""
    acting = [np.zeros((2 * _SIZE, len(CROSS_AXES))) for _ in _PLACES]
    for own, place, side in zip(acting, _PLACES, (old, new), strict=True):
        own[place] = by_fixture(side.calibration, side.found, side.fixture or 0.0)
    return [acting[0] + acting[1]] if same_head else acting


def _off_the_laws(own: Side, other: Side, temperature: float | None) -> Array:
    """What is uncertain where temperature acts, and one calibration does not tell it.

    A calibration of one level counts what usual slopes make of another temperature, and of the
    error of its own. The bias of the laws lies between heating and cooling, that of a single level
    on one side of them.
    """
    found, added = own.found, np.zeros((_SIZE, _SIZE))
    if not other.found.several_levels:
        added[_BIAS, _BIAS] = found.hysteresis**2
    if found.several_levels:
        return added
    known = None not in (temperature, found.T0_degC)
    away = float(temperature or 0.0) - float(found.T0_degC or 0.0) if known else 0.0
    away = float(np.hypot(away, heat_of(own.calibration) or 0.0))
    return np.asarray(added + (away * _BY_USUAL_SLOPES) ** 2)
