"""Equation (4): the error of an acceleration with its band, and what to know before using it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import check_number
from accelcal.arguments.options import check_flag
from accelcal.arrays import Array
from accelcal.compensate.at_temperature import means_of_runs
from accelcal.compensate.propagation import Part, linear_sum, ratio
from accelcal.effects.left_in_use import beyond_in_use, left_in_use, static_in_use
from accelcal.effects.static import how_taken_up
from accelcal.effects.without_sources import without_sources
from accelcal.error_budget.coefficients import Coefficients, Conditions, coefficients_of, conditions
from accelcal.error_budget.components import (
    SLOPES,
    correlated_symbols,
    correlations_of,
    correlations_of_other_axis,
    covariance,
    effect_components,
    random_components,
    systematic_components,
)
from accelcal.error_budget.random_part import FEW_LAUNCHES, NOT_IDENTIFIED, RandomPart, random_part
from accelcal.estimate.uncertainty import FEWEST, combined
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import LOOK_ALIKES
from accelcal.results.error_budget import ErrorBudget, ErrorComponent
from accelcal.results.tables_in_use import tables_in_use
from accelcal.results.usable import (
    gates_that_warn,
    not_determined,
    refuse_misprinted,
    refuse_undetermined_laws,
    refuse_without_uncertainty,
)

__all__ = ["budget"]


def budget(
    calibration: Calibration,
    a_i: ArrayLike,
    *,
    a_p: ArrayLike = 0.0,
    a_o: ArrayLike = 0.0,
    temperature: ArrayLike | None = None,
    time: ArrayLike = 0.0,
    random: RandomPart | None = None,
    temperature_uncertainty: float = 0.0,
    exact: bool = False,
    extrapolate: bool = False,
) -> ErrorBudget:
    """Error of the measured acceleration with its band, equation (4).

    Parameters
    ----------
    calibration : Calibration
        The coefficients with their uncertainties.
    a_i, a_p, a_o : array_like
        Acceleration along input, pendulous and output axis [local g]; all arrays broadcast.
    temperature : array_like, optional
        Temperature; T0 by default [degC].
    time : array_like, default 0
        Time since the start of the launch [s].
    random : RandomPart, optional
        Bounds of the random errors; by default what the calibration knows of them.
    temperature_uncertainty : float, default 0
        Standard uncertainty of the temperature [degC].
    exact : bool, default False
        Take (K1 - K1N)/K1 of (2) in place of beta dT, its first order, which (4) has.
    extrapolate : bool, default False
        Allow temperatures outside the calibrated ones, and mark them.

    Returns
    -------
    ErrorBudget
        Systematic error, bound of (4), and uncertainty by the GUM, with all components.

    Raises
    ------
    InputError
        If the calibration is misprinted, knows no uncertainty, or its laws are not determined, if a
        number is not finite or a time negative, if a temperature lies outside the calibrated ones
        or on a side of T0 without slopes, if accelerations look like gravity in m/s^2, or if one
        acts along an axis whose misalignment was not tested.

    Notes
    -----
    With `exact`, the systematic error is (Y - K1N a_i)/K1: the output Y less K1N a_i, over the
    scale factor at its temperature. That of Y/K1N is larger by the factor K1/K1N.

    Equation (4), with the bias bound (3). The error is that of a reading turned into acceleration
    by K1N alone. In the GUM sum each bound counts by its standard uncertainty, without the factor
    0.5 of (3), and the calibration uncertainty of each coefficient counts as well, with the
    correlations of `accelcal.error_budget.components.covariance`. A second cross axis, which
    shares the errors of the head, is added linearly. Effects of the calibration that depend on
    acceleration and temperature alone (`Effect.static`) are systematic parts, as the model does not
    have them; their sizes count as uncorrelated with the coefficients.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> found = accelcal.budget(calibration, [0.0, 1.0], temperature=80.0)
    >>> found.systematic.round(4).tolist()
    [0.001, 0.0324]
    """
    expect(calibration, Calibration)
    check_number(0.0, temperature_uncertainty=temperature_uncertainty)
    check_flag(exact=exact, extrapolate=extrapolate)
    refuse_misprinted(calibration)
    refuse_undetermined_laws(calibration)
    refuse_without_uncertainty(calibration)
    coefficients = coefficients_of(without_sources(calibration, [LOOK_ALIKES]))
    random = random_part(calibration) if random is None else random
    expect(random, RandomPart)
    points = conditions(coefficients, (a_i, a_p, a_o), temperature, time, extrapolate=extrapolate)
    parts = (
        *systematic_components(
            coefficients, points, temperature_uncertainty=temperature_uncertainty, exact=exact
        ),
        *effect_components(calibration, coefficients, points),
        *random_components(random, points),
    )
    correlated, joint = _correlated(coefficients, points, parts)
    added, standard, factor = _combined(parts, correlated, joint)
    said = weaknesses(calibration, coefficients, random, points, factor * standard, exact=exact)
    return ErrorBudget(
        a_i=points.acceleration.input,
        a_p=points.acceleration.pendulous,
        a_o=points.acceleration.output,
        temperature_degC=points.temperature,
        time_s=points.time,
        extrapolated=points.extrapolated,
        components=parts,
        correlated=correlated & {part.symbol for part in parts},
        systematic=np.sum([part.value for part in parts], axis=0),
        bound=np.sum([part.bound for part in parts], axis=0),
        variance_by_correlation=added,
        standard_uncertainty=standard,
        coverage_factor=factor,
        expanded_uncertainty=factor * standard,
        warnings=tuple(said),
        serial=calibration.serial,
        source=calibration.source,
    )


def _correlated(
    coefficients: Coefficients, points: Conditions, parts: Sequence[ErrorComponent]
) -> tuple[frozenset[str], Part]:
    """Symbols of the coefficients that are correlated, and what these give together."""
    main, other = correlations_of(coefficients), correlations_of_other_axis(coefficients)
    symbols, across = correlated_symbols(main), _symbols_of(coefficients.of_other_axis, parts)
    own = _together(parts, symbols, covariance(main, points, parts))
    beside = _together(parts, across, covariance(other, points, parts))
    return symbols | across, linear_sum(own, beside)


def _symbols_of(axis: Sequence[str], parts: Sequence[ErrorComponent]) -> frozenset[str]:
    """Symbols of an axis, and of its slopes, along which there is acceleration at some point."""
    own = {*axis, *(slope for name, (_, slope) in SLOPES.items() if name in axis)}
    return frozenset(p.symbol for p in parts if p.symbol in own and p.standard_uncertainty.any())


def _together(parts: Sequence[ErrorComponent], symbols: Collection[str], added: Array) -> Part:
    """Variance of what is correlated, with the degrees of freedom of its sources.

    These are `FEWEST` or more, so that less is a rounding where correlation leaves next to nothing.
    """
    chosen = [part for part in parts if part.symbol in symbols]
    joint, over_dof = added
    for part in chosen:
        joint = joint + part.standard_uncertainty**2
        over_dof = over_dof + part.standard_uncertainty**2 / part.dof
    joint = np.maximum(joint, 0.0)  # correlations are rounded
    return Part(joint, np.maximum(ratio(joint, np.maximum(over_dof, 0.0)), FEWEST))


def _combined(
    parts: Sequence[ErrorComponent], correlated: Collection[str], joint: Part
) -> tuple[Array, Array, Array]:
    """Variance added by correlation, standard uncertainty and coverage factor of each point.

    What is correlated counts as one part.
    """
    together = np.array([part.symbol in correlated for part in parts])
    variances = np.array([part.standard_uncertainty**2 for part in parts])
    dof = np.array([part.dof for part in parts])
    told = combined(
        [joint.variance, *variances[~together]], [np.asarray(joint.dof), *dof[~together]]
    )
    return joint.variance - variances[together].sum(axis=0), told.standard, told.factor


_CALIBRATED_WITHIN = 1.001  # a tumble test reaches 1 local g
_RANDOM_NAMES = {
    "launch": "bias from launch to launch (k0L)",
    "drift": "drift (k0D)",
    "fluctuation": "fluctuation (k0F)",
    "hysteresis": "hysteresis (h_T)",
    "threshold": "threshold (p)",
    "scale_factor": "scale factor instability (k1)",
}


def weaknesses(
    calibration: Calibration,
    coefficients: Coefficients,
    random: RandomPart,
    points: Conditions,
    expanded: Array,
    *,
    exact: bool,
) -> Iterator[str]:
    """Say where a budget is extrapolated, incomplete or of first order.

    Parameters
    ----------
    calibration : Calibration
        What was calibrated.
    coefficients : Coefficients
        Its coefficients.
    random : RandomPart
        The bounds.
    points : Conditions
        The points.
    expanded : ndarray, shape (n,)
        Expanded uncertainty [local g].
    exact : bool
        Whether the scale factor was taken beyond the first order of (4).
    """
    yield from gates_that_warn(calibration, calibration.tables)
    yield from beyond_in_use(calibration, calibration.tables, by_laws=True)
    yield from how_taken_up(calibration)
    taken_up = [item.id for item in static_in_use(calibration)]
    yield from left_in_use(calibration, taken_up)
    if points.extrapolated.any():
        yield "temperatures marked * lie outside the calibrated ones; (4) is extrapolated there"
    largest = float(np.abs(points.acceleration).max())
    if largest > _CALIBRATED_WITHIN:
        yield (
            f"accelerations up to {largest:g} g: a tumble test calibrates within 1 g, and (4) is"
            " extrapolated beyond"
        )
    missing = [name for key, name in _RANDOM_NAMES.items() if not getattr(random, key).origin]
    if missing:
        yield f"these random errors are not declared, and taken as 0: {', '.join(missing)}"
    yield from random.warnings
    yield from _drift(random)
    used = tables_in_use(calibration)
    groups = (used.of_main, used.of_second) if used.by_laws else [[t] for t in used.nearest]
    yield from not_determined([group for group in groups if group])
    yield from _several_runs(calibration)
    unknown = [n for n, q in coefficients.at_T0.items() if q.standard_uncertainty is None]
    if unknown:
        yield f"the uncertainty of {', '.join(unknown)} is unknown and left out"
    if not exact:
        yield from _first_order(coefficients, points, expanded)


def _several_runs(calibration: Calibration) -> Iterator[str]:
    """Say whose coefficients they are, where several runs have no laws."""
    for mean in means_of_runs(calibration):
        yield (
            f"no temperature law, so the coefficients of mounting {mean.first.mounting} are the"
            f" mean of {mean.runs}"
        )


def _drift(random: RandomPart) -> Iterator[str]:
    if random.drift.origin == NOT_IDENTIFIED:
        yield (
            "the stability test does not tell the drift (k0D) from none: it counts by the limit of"
            " its interval; a longer test, or more launches, make that smaller"
        )
    if random.drift.origin == FEW_LAUNCHES:
        yield (
            "the drift (k0D) is that of one or two launches, and is taken as alike in all: three"
            " launches or more tell how far they differ"
        )


def _first_order(coefficients: Coefficients, points: Conditions, expanded: Array) -> Iterator[str]:
    change = coefficients.slope("K1", points.rise, "value") * points.rise
    left_out = (change / (1.0 + change) - change) * points.acceleration.input
    worst = int(np.abs(left_out).argmax())
    if abs(left_out[worst]) > expanded[worst]:
        yield (
            "(4) has beta dT, the first order of (K1 - K1N)/K1 in (2), and leaves out"
            f" {1e6 * left_out[worst]:+.0f} ug at a_i = {points.acceleration.input[worst]:g} g,"
            f" dT = {points.rise[worst]:+g} degC; ask for the exact form"
        )
