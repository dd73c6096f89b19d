"""From the outputs of a triad to accelerations along its axes, with their uncertainties."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.axes import AXES
from accelcal.arguments.numbers import check_number
from accelcal.arguments.temperatures import temperature_array
from accelcal.arrays import Array
from accelcal.compensate.measured import MeasuredAcceleration, in_blocks
from accelcal.compensate.propagation import Part, interval_of_parts
from accelcal.compensate.ranges import within_accelerations, within_temperatures
from accelcal.errors import InputError
from accelcal.results.triad import TriadCalibration
from accelcal.results.usable import gates_that_warn

__all__ = ["apply_triad", "assumptions_of_triad", "notes_of_triad", "refuse_for_triad"]

_NOISE_UNKNOWN = (
    "the attitudes of the calibration left nothing to tell its noise: the uncertainty of the"
    " accelerations is unknown"
)
_ONE_LAUNCH = (
    "the calibration knows one launch: what shifts from launch to launch is not in the uncertainty"
)
_ONE_STATE = (
    "the calibration knows one launch and no temperature: what shifts from launch to launch or with"
    " temperature is not in the uncertainty"
)
_REASON = "its calibration has one run, which does not tell it"


def refuse_for_triad(**given: Any) -> None:
    """Refuse what only the calibration of one accelerometer knows.

    Parameters
    ----------
    **given : object
        Arguments by name; None where not given.

    Raises
    ------
    InputError
        If one is given.

    Examples
    --------
    >>> try:
    ...     refuse_for_triad(run="2")
    ... except InputError as error:
    ...     print(str(error)[:45])
    run=... is given for a triad; leave it out: i
    """
    for name, value in given.items():
        if value is not None:
            raise InputError(f"{name}=... is given for a triad; leave it out: {_REASON}")


def assumptions_of_triad(triad: TriadCalibration, *, same_launch: bool = False) -> tuple[str, ...]:
    """List what a user of a triad's calibration has to be warned of."""
    unknown = [] if triad.covariance_names else [_NOISE_UNKNOWN]
    state = _ONE_STATE if triad.temperature_degC is None else _ONE_LAUNCH
    return (*gates_that_warn(triad), *unknown, *([] if same_launch else [state]))


def notes_of_triad(triad: TriadCalibration) -> list[str]:
    """Say what a user of a triad's numbers has to know and that no attitude contradicts.

    Parameters
    ----------
    triad : TriadCalibration
        The calibration.

    Returns
    -------
    list of str
        What U leaves out and what would tell it, where its clampings could not be assessed.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> up = np.vstack([np.eye(3), -np.eye(3)] * 2)
    >>> noise = 1e-4 * np.random.default_rng(1).normal(size=up.shape)
    >>> for note in notes_of_triad(accelcal.calibrate_triad(0.01 + 2.0 * up + noise, up)):
    ...     print(note)
    clampings of the calibration not assessed: no shafts are named: U counts errors of single\
 attitudes, not how the block sits in a clamping that several share; name that of each attitude\
 (shaft)
    """
    untold = (g for g in triad.gates if (g.name, g.verdict) == ("clampings", "not assessed"))
    return [f"{gate.name} of the calibration not assessed: {gate.finding}" for gate in untold]


def apply_triad(
    triad: TriadCalibration,
    output: ArrayLike,
    temperature: ArrayLike | None = None,
    *,
    output_uncertainty: float = 0.0,
) -> MeasuredAcceleration:
    """Turn outputs of a triad into accelerations along the axes of its frame.

    Parameters
    ----------
    triad : TriadCalibration
        The calibration.
    output : array_like, shape (..., 3)
        Outputs of the channels x, y, z [output unit of the calibration]; columns of a DataFrame
        that are named so count by their names.
    temperature : array_like, optional
        Temperatures of the samples, or one for all, which tell where the calibration is good; one
        that is missing leaves the sample without acceleration [degC].
    output_uncertainty : float, default 0
        Standard uncertainty of an output, its noise included [output unit].

    Returns
    -------
    MeasuredAcceleration
        Accelerations and uncertainties, shape (..., 3).

    Raises
    ------
    InputError
        If the outputs are no numbers or not three a sample, or temperatures are given and that of
        the calibration is not known.

    Notes
    -----
    a = T (y - b) with T the inverse of S, so a parameter of channel i acts by
    da/db_i = -T_i and da/dS_ij = -T_i a_j, T_i being column i of T. With the covariance of all
    parameters the variance of each component is a quadratic form in (1, a). The degrees of freedom
    are the fewest of the parameters'.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> up = np.vstack([np.eye(3), -np.eye(3)])
    >>> noise = 1e-4 * np.random.default_rng(1).normal(size=up.shape)
    >>> triad = accelcal.calibrate_triad(0.01 + 2.0 * up + noise, up)
    >>> apply_triad(triad, [2.01, 1.01, 0.01]).value[:2].round(3).tolist()
    [1.0, 0.5]
    """
    check_number(0.0, output_uncertainty=output_uncertainty)
    value = triad.accelerations(output)
    warmth = _temperatures(triad, temperature, value.shape[:-1])
    if warmth is not None:
        value = np.where(np.isnan(warmth)[..., None], np.nan, value)
    rows, warm = value.reshape(-1, 3), None if warmth is None else warmth.reshape(-1)
    return in_blocks(
        lambda own: _measured(
            triad, rows[own], None if warm is None else warm[own], output_uncertainty
        ),
        value.shape[:-1],
    )


def _measured(
    triad: TriadCalibration, value: Array, warmth: Array | None, output_uncertainty: float
) -> MeasuredAcceleration:
    """Accelerations of a block, shape (n, 3), with their uncertainties."""
    inverse = np.asarray(np.linalg.inv(triad.sensitivity), dtype=np.float64)
    noise = np.full_like(value, output_uncertainty**2) * np.sum(inverse**2, axis=1)
    told = interval_of_parts([_of_parameters(triad, inverse, value), Part(noise, math.inf)])
    known = np.isfinite(value).all(axis=-1, keepdims=True)
    length = np.linalg.norm(value, axis=-1)
    calibrated = None if warmth is None else triad.temperatures
    return MeasuredAcceleration(
        value=value,
        standard_uncertainty=np.where(known, told.standard, np.nan),
        expanded_uncertainty=np.where(known, told.expanded, np.nan),
        within_temperatures=within_temperatures(calibrated, length if warmth is None else warmth),
        within_accelerations=within_accelerations((0.0, 1.0), length),
        axes=AXES,
    )


def _temperatures(
    triad: TriadCalibration, temperature: ArrayLike | None, shape: tuple[int, ...]
) -> Array | None:
    """Temperature of each sample, None where it is not given."""
    if triad.temperature_degC is None:
        refuse_for_triad(temperature=temperature)
    if temperature is None:
        return None
    given = temperature_array(temperature)
    try:
        return np.broadcast_to(given, shape)
    except ValueError:
        raise InputError(
            f"temperature has shape {given.shape}, the samples {shape}; give one for each, or one"
            " for all"
        ) from None


def _of_parameters(triad: TriadCalibration, inverse: Array, value: Array) -> Part:
    """Variance of each component from the parameters [g^2]."""
    with_bias = np.concatenate([np.ones_like(value[..., :1]), value], axis=-1)
    channels = _by_channel(triad)
    forms = np.einsum("mi,mj,iajb->mab", inverse, inverse, channels)
    variance = np.einsum("...a,mab,...b->...m", with_bias, forms, with_bias)
    dof = [q.dof for q in triad.parameters.values() if q.standard_uncertainty and q.dof]
    return Part(np.maximum(variance, 0.0), float(min(dof, default=math.inf)))


def _by_channel(triad: TriadCalibration) -> Array:
    """Covariance of (b_i, S_ix, S_iy, S_iz) with those of j, shape (3, 4, 3, 4)."""
    names = [f"{what}_{i}{j}" for i in AXES for what, j in (("b", ""), *(("S", j) for j in AXES))]
    if not triad.covariance_names:
        return np.full((3, 4, 3, 4), np.nan)
    whole, own = np.zeros((12, 12)), [names.index(name) for name in triad.covariance_names]
    whole[np.ix_(own, own)] = triad.covariance
    return whole.reshape(3, 4, 3, 4)
