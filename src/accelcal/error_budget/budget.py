"""Equation (4): the error of a measured acceleration with its band, split by component."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import check_number
from accelcal.arguments.options import check_flag
from accelcal.arrays import Array
from accelcal.effects.without_sources import without_sources
from accelcal.error_budget.coefficients import coefficients_of
from accelcal.error_budget.components import random_components, systematic_components
from accelcal.error_budget.conditions import conditions
from accelcal.error_budget.correlation import (
    Added,
    correlated_symbols,
    correlations_of,
    covariance,
)
from accelcal.error_budget.effects import effect_components
from accelcal.error_budget.random_part import RandomPart, random_part
from accelcal.error_budget.weaknesses import weaknesses
from accelcal.estimate.uncertainty import combined
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import LOOK_ALIKES
from accelcal.results.error_budget import ErrorBudget, ErrorComponent
from accelcal.results.usable import (
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
    correlations of `accelcal.error_budget.correlation.covariance`. Effects of the calibration that
    depend on acceleration and temperature alone (`Effect.static`) are systematic parts, as the
    model does not have them; their sizes count as uncorrelated with the coefficients.

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
    correlations = correlations_of(coefficients)
    correlated = correlated_symbols(correlations)
    added, standard, factor = _combined(parts, correlated, covariance(correlations, points, parts))
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


def _combined(
    parts: Sequence[ErrorComponent], correlated: Collection[str], added: Added
) -> tuple[Array, Array, Array]:
    """Variance added by correlation, standard uncertainty and coverage factor of each point.

    What is correlated counts as one part, with the degrees of freedom of its sources: 1 or more, so
    that less is a rounding where correlation leaves next to nothing.
    """
    together = np.array([part.symbol in correlated for part in parts])
    variances = np.array([part.standard_uncertainty**2 for part in parts])
    dof = np.array([part.dof for part in parts])
    alone = variances[together].sum(axis=0)
    joint = np.maximum(alone + added.variance, 0.0)  # correlations are rounded
    over_dof = (variances / dof)[together].sum(axis=0) + added.over_dof
    of_joint = np.divide(joint, over_dof, out=np.full_like(joint, np.inf), where=over_dof > 0.0)
    of_joint = np.maximum(of_joint, 1.0)
    told = combined([joint, *variances[~together]], [of_joint, *dof[~together]])
    return joint - alone, told.standard, told.factor
