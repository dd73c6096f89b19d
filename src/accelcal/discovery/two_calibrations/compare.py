"""Two calibrations of one accelerometer: coefficient by coefficient, together, and in use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import check_number_or_none
from accelcal.arrays import Array
from accelcal.compensate.propagation import interval_of_parts, propagated
from accelcal.discovery.new_record.errors_counted import too_little_told, untold
from accelcal.discovery.new_record.judgement import sizes_left_open
from accelcal.discovery.new_record.simulated import gravity_ratio
from accelcal.discovery.two_calibrations.coefficients import (
    Coefficient,
    Name,
    common_range,
    in_units_of,
    indication,
    of_output,
    size_changes,
    told_coefficients,
)
from accelcal.discovery.two_calibrations.errors import (
    Errors,
    Side,
    errors_of_both,
    freed,
    side_of,
    stated_errors,
)
from accelcal.discovery.two_calibrations.notes import (
    common_temperature,
    factor_of_unit,
    heads_tried,
    is_one_head,
    left_out,
    notes,
    refuse_two_units,
)
from accelcal.errors import InputError
from accelcal.estimate.uncertainty import quantities
from accelcal.numerics.one_thread import in_one_thread
from accelcal.numerics.probability import (
    LEVEL,
    NORMAL_FACTOR,
    f_survival,
    path_length,
    simultaneous_quantile,
    student_quantile,
)
from accelcal.results.agreement import ALPHA, chance_if_known, least_of
from accelcal.results.calibration import Calibration
from accelcal.results.calibration_comparison import (
    CalibrationComparison,
    CoefficientChange,
    ComparedCalibration,
    IndicatedChange,
    JointTest,
)
from accelcal.results.quantity import Quantity
from accelcal.version import SOFTWARE

__all__ = ["compare_calibrations"]

_RANK = 1e-9
"""Variance of a direction, over the largest of the correlations, below which it is rounding."""

Factor = Callable[[float], float]


def joint_test(differences: Array, covariance: Callable[[Factor], Array]) -> JointTest:
    """Test whether differences, shape (p,), are those that their covariance leaves.

    The covariance, shape (p, p), is a function of a factor that gives the size of an error over its
    estimate, by the degrees of freedom of the estimate. The sum of squares is with the sizes as
    estimated; the chance is the mean over all sizes that few degrees of freedom leave open, as in
    `accelcal.discovery.new_record.judgement`.
    """
    whitener = _whitener(covariance(lambda _: 1.0))
    p, seen = len(whitener), whitener @ differences
    if p == 0:
        return JointTest(0.0, 0, 1.0)
    chance = 0.0
    for weight, factor in sizes_left_open():
        sized = whitener @ covariance(factor) @ whitener.T
        squares = float(seen @ np.linalg.solve(sized, seen))
        chance += weight * f_survival(squares / p, p, np.inf)
    return JointTest(float(seen @ seen), p, min(chance, 1.0))


def _as_counted(dof: float) -> float:
    """Size of an error over its estimate with which it counts for U."""
    return student_quantile(LEVEL, dof) / NORMAL_FACTOR


def _whitener(covariance: Array) -> Array:
    """Independent combinations of quantities, each with the variance 1."""
    sizes = np.sqrt(np.diagonal(covariance))
    scale = np.where(sizes > 0.0, sizes, 1.0)
    variances, directions = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = variances > _RANK * max(variances.max(), 1.0)
    return np.asarray((directions[:, kept] / np.sqrt(variances[kept])).T / scale)


class _Pair(NamedTuple):
    """What both calibrations tell, in one unit and one local g."""

    sides: tuple[Side, Side]  # the old and the new one
    old: Mapping[Name, Coefficient]  # coefficients of the old one
    new: Mapping[Name, Coefficient]  # coefficients of the new one

    @property
    def differences(self) -> Array:
        """New less old, shape (p,)."""
        return np.array([self.new[name].value - own.value for name, own in self.old.items()])

    @property
    def by_errors(self) -> Array:
        """Their derivatives by the errors of both, shape (p, 36)."""
        pairs = [(own.by_error, self.new[name].by_error) for name, own in self.old.items()]
        return np.array([np.concatenate([-old, new]) for old, new in pairs])


@in_one_thread()
def compare_calibrations(
    old: Calibration,
    new: Calibration,
    *,
    same_head: bool | None = None,
    temperature: float | None = None,
    fixture_uncertainty: float | None = None,
) -> CalibrationComparison:
    """Show where two calibrations of one accelerometer differ, and whether that is noise.

    Parameters
    ----------
    old, new : Calibration
        The calibrations, with the effects that they have.
    same_head : bool, optional
        Whether both were measured on one head, with the fixture clamped alike. By default the lines
        ``# head: NAME`` of both tell it, or ``# stand: NAME``.
    temperature : float, optional
        Where to compare [degC]; by default T0 of the old one, or what is next to it of the
        temperatures for which both are good.
    fixture_uncertainty : float, optional
        Standard uncertainty of the fixture angle of each test [rad]. By default it is not counted,
        and misalignments that have the angle in another way are not compared.

    Returns
    -------
    CalibrationComparison
        Each coefficient with E_n, a joint test of all, and the change of the indicated
        acceleration.

    Raises
    ------
    InputError
        If they are of two units or two outputs, have no temperature or acceleration in common, do
        not say which coefficients to use or state no uncertainties; if an option is none.

    Notes
    -----
    E_n = (x_2 - x_1) / U(x_2 - x_1) of ISO/IEC 17043:2023, annex B, agrees from -1 to 1. For two
    independent calibrations U^2 is U_1^2 + U_2^2. U is Student's factor of 95 % times the standard
    uncertainty, for the degrees of freedom of all parts of it. Errors of one head cancel as far as
    they do the same to both, see `accelcal.discovery.two_calibrations.errors`. Where nothing tells
    whether there was one head, the wider interval and the larger chance count.

    The joint test is chi^2 = d' C^-1 d of all differences d. Its chance is the mean over all sizes
    of errors that few degrees of freedom leave open, as of `accelcal.compare`. Sizes of effects
    that both have are tested each for itself, as a calibration does not tell how they correlate
    with its coefficients.

    Examples
    --------
    >>> import accelcal
    >>> old = accelcal.fit(accelcal.simulate(seed=1))
    >>> moved = accelcal.simulate(effects=[accelcal.effect("fixture-offset").of(1e-4)], seed=2)
    >>> found = accelcal.compare_calibrations(old, accelcal.fit(moved), same_head=False)
    >>> found.agrees, found["delta"].agrees, found["K1"].agrees
    (False, False, True)
    """
    expect(old, Calibration)
    expect(new, Calibration)
    check_number_or_none(temperature=temperature)
    refuse_two_units(old, new)
    check_number_or_none(0.0, fixture_uncertainty=fixture_uncertainty)
    one, other = side_of("old", old, fixture_uncertainty), side_of("new", new, fixture_uncertainty)
    same = is_one_head(one, other, same_head)
    factor, level = factor_of_unit(one, other), common_temperature(one, other, temperature)
    gravity = gravity_ratio(new.g_local_m_s2, old.g_local_m_s2)
    known = told_coefficients(one.found, level)
    told = in_units_of(told_coefficients(other.found, level), factor, gravity)
    lost = left_out(one, other, known, told)
    kept = [name for name in known if name not in lost]
    if not kept:
        raise InputError("the calibrations determine no coefficient that means the same in both")
    pair = _Pair((one, other), *({name: own[name] for name in kept} for own in (known, told)))
    tried = heads_tried(one, other, same)
    errors = [errors_of_both(one, other, level, same_head=head) for head in tried]
    sizes = tuple(size_changes(one, other, gravity))
    whole, joint = _Pair((one, other), known, told), _joint(pair, level, tried)
    return CalibrationComparison(
        old=_told(one),
        new=_told(other),
        temperature_degC=level,
        same_head=same,
        coefficients=(
            *_changes(pair, errors),
            *sizes,
        ),
        joint=joint,
        indicated=tuple(_indicated(whole, errors, level, gravity)),
        explained_by=_explained_by(pair, level, tried, joint, sizes),
        notes=tuple(notes(one, other, same, level, lost)),
        serial=new.serial or old.serial,
        software=SOFTWARE,
    )


def _told(own: Side) -> ComparedCalibration:
    return ComparedCalibration(
        own.calibration.source, own.calibration.date, own.effects, own.error_sources
    )


def _changes(pair: _Pair, errors: Sequence[Errors]) -> Iterator[CoefficientChange]:
    """Each coefficient in both, with the wider interval of its difference.

    Those in the output unit follow from those of the errors.
    """
    if ("K1", None) in pair.old:
        unit = pair.sides[0].found.output_unit or "output unit"
        pair = _Pair(pair.sides, *({**own, **of_output(own, unit)} for own in (pair.old, pair.new)))
    units = [own.unit for own in pair.old.values()]
    stated = [
        _quantities(
            [told[n].value for n in pair.old], [told[n].by_error for n in pair.old], e, units
        )
        for told, e in zip((pair.old, pair.new), map(stated_errors, pair.sides), strict=True)
    ]
    each = (_quantities(pair.differences, pair.by_errors, own, units) for own in errors)
    rows = zip(pair.old, *stated, _widest(each), strict=True)
    for (symbol, axis), old, new, difference in rows:
        yield CoefficientChange(symbol, axis, old, new, difference)


def _quantities(
    values: ArrayLike, by_errors: ArrayLike, errors: Errors, units: Sequence[str]
) -> list[Quantity]:
    """Values that depend on errors, with their intervals."""
    told = interval_of_parts([propagated(errors, list(np.array(by_errors).T))])
    return quantities(units, np.asarray(values), told.standard, told.expanded, told.dof)


def _widest(found: Iterable[list[Quantity]]) -> list[Quantity]:
    """Of each quantity the one with the wider interval."""
    return [
        max(own, key=lambda q: q.expanded_uncertainty or 0.0) for own in zip(*found, strict=True)
    ]


def _joint(
    pair: _Pair,
    temperature: float | None,
    heads: Sequence[bool],
    known: Factor | None = None,
) -> JointTest:
    """Test all differences at once, by the larger chance of one head and of two if both `heads`.

    Errors may be `known` to have other sizes than their estimates.
    """
    by_errors = pair.by_errors

    def covariance(same_head: bool, factor: Factor) -> Array:
        own = known or factor
        errors = errors_of_both(*pair.sides, temperature, same_head=same_head, factor=own)
        return np.asarray(by_errors @ errors.covariance @ by_errors.T)

    tests = [joint_test(pair.differences, partial(covariance, head)) for head in heads]
    return max(tests, key=lambda test: test.p_value)


def _explained_by(
    pair: _Pair,
    temperature: float | None,
    heads: Sequence[bool],
    joint: JointTest,
    sizes: Sequence[CoefficientChange],
) -> tuple[str, ...]:
    """Errors that nothing tells, or too little, where they may have made all differences.

    Those that nothing tells explain what does not disagree if they may be `HIDING`; those of few
    degrees of freedom what would disagree, were they known to be as large as they count for U.
    """
    both = [own.calibration for own in pair.sides]
    chances = [size.p_value for size in sizes]
    if least_of([joint.p_value, *chances]) < ALPHA:
        names = [tuple(untold(own)) for own in both]
        one, other = map(freed, pair.sides, names)
        free = _joint(pair._replace(sides=(one, other)), temperature, heads)
        explains = least_of([free.p_value, *chances]) >= ALPHA
    else:
        names = [too_little_told(own) for own in both]
        known = _joint(pair, temperature, heads, _as_counted)
        if_known = (chance_if_known(size.difference) for size in sizes)
        explains = least_of([known.p_value, *if_known]) < ALPHA
    return tuple(dict.fromkeys(chain(*names))) if explains else ()


def _indicated(
    pair: _Pair, errors: Sequence[Errors], temperature: float | None, gravity: float
) -> list[IndicatedChange]:
    """Change of what is indicated, over K1 of the old calibration."""
    one, other = pair.sides
    a_i, scale = common_range(one, other), pair.old["K1", None].value
    old = indication(one, pair.old, a_i, temperature, 1.0)
    new = indication(other, pair.new, a_i, temperature, gravity)
    each = (-old.by_error, new.by_error, old.by_effect, new.by_effect)
    by_errors, values = np.hstack(each) / scale, (new.output - old.output) / scale
    whole = [own.beside(np.append(old.effect_dof, new.effect_dof)) for own in errors]
    units = ["g"] * a_i.size
    found = _widest(_quantities(values, by_errors, own, units) for own in whole)
    length = max(path_length(by_errors @ own.covariance @ by_errors.T) for own in whole)
    factors = [simultaneous_quantile(LEVEL, own.dof or np.inf, length) for own in found]
    return [  # with the half width of the band that holds everywhere
        IndicatedChange(a, own, factor * (own.standard_uncertainty or 0.0))
        for a, own, factor in zip(a_i.tolist(), found, factors, strict=True)
    ]
