"""All readings of many records fitted by the product model, each reading at its own temperature.

The whole model is a product, nonlinear in its parameters:

    Y = K1(T) [k0(T) + a_i + k2 a_i^2 + k3 a_i^3 + delta(T) a_p + delta_ip a_i a_p]

with bilinear k0, K1 and delta, and with k2, k3 and delta_ip the same at all temperatures. It is
solved by Gauss-Newton steps of generalised least squares, in which the errors of head, launches
and temperatures stand as unknowns of known size, and the parts of the recorded deviations of
temperature that the runs felt.

The unknowns of a record are some dozens. They are solved by their normal equations, whose matrices
are products, with the columns brought to one size. The errors have pseudo-readings, and the next
step mends what the last one rounded.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arrays import Array, Mask
from accelcal.errors import DesignError
from accelcal.temperature.product_errors import PRIOR, Errors, ProductFit, Solution, errors_at
from accelcal.temperature.product_model import times

_MOST_STEPS = 30
_SURE = 3.0  # standard uncertainties by which a scale factor must differ from zero
_CONVERGED = 1e-6  # of the noise of a reading


def solved(fit: ProductFit, laws: Array) -> Solution:
    """Find the parameters, and the parts of the deviations of temperature that were felt.

    Parameters
    ----------
    fit : ProductFit
        R records.
    laws : ndarray, shape (R, 3 p)
        Laws to start from, with the slopes of K1 relative.

    Returns
    -------
    Solution
        A record comes out the same whatever the others are.
    """
    state = _start(fit, laws)
    left = np.arange(len(laws))
    for _ in range(_MOST_STEPS):
        part, before = fit.of_records(left), Solution(*(values[left] for values in state))
        after, still = _step(part, before)
        for whole, new in zip(state, after, strict=True):
            whole[left] = new
        left = left[~still]
        if not left.size:
            break
    return state


def scale_factor_is_told(value: ArrayLike, uncertainty: ArrayLike) -> Mask:
    """Tell whether a scale factor is not 0: slopes relative to 0 lead the steps anywhere.

    Parameters
    ----------
    value, uncertainty : array_like, shape (R,)
        K1 at T0, and its standard uncertainty; NaN where unknown [output unit / g].

    Returns
    -------
    ndarray of bool, shape (R,)
        True where it is, as far as known.

    Examples
    --------
    >>> scale_factor_is_told([1.35, 1e-4, 1.35], [1e-5, 1e-4, float("nan")]).tolist()
    [True, False, True]
    """
    return ~np.asarray(np.abs(value) < _SURE * np.asarray(uncertainty, dtype=np.float64))


def _start(fit: ProductFit, laws: Array) -> Solution:
    """What is common to all temperatures starts at 0."""
    common = np.zeros((len(laws), fit.readings.common.shape[1]))
    p = laws.shape[1] // 3
    parameters = np.concatenate([laws, common], axis=1)
    parameters[:, p + 1 : 2 * p] *= laws[:, p, None]
    part = np.full((len(laws), len(fit.tables)), PRIOR)
    return Solution(parameters, part, part.copy())


def _step(fit: ProductFit, state: Solution) -> tuple[Solution, Mask]:
    """One step, and the records that it hardly moved."""
    point = fit.readings.at(state.felt)
    errors, jacobian = errors_at(fit, state, point), point.jacobian(state.parameters)
    system = _System.of(jacobian, errors)
    away = fit.readings.output - point.model(state.parameters)
    away += times(errors.felt, state.felt / PRIOR - 1.0)
    step, felt, doubt = system.solve(away)
    found = Solution(state.parameters + step, PRIOR * (1.0 + felt), PRIOR * doubt)
    moved = times(jacobian, step) + times(errors.felt, (found.felt - state.felt) / PRIOR)
    return found, np.asarray((np.abs(moved) < _CONVERGED * errors.noise).all(axis=1))


class _System(NamedTuple):
    """Columns of parameters, shared errors and felt parts over the noise, and what solves them."""

    columns: Array
    normal: Array
    size: Array
    errors: Errors

    @classmethod
    def of(cls, jacobian: Array, errors: Errors) -> _System:
        columns = np.concatenate([jacobian, *errors.shared.values(), errors.felt], axis=2)
        columns = errors.apart(columns)
        count = jacobian.shape[2]
        size = np.sqrt(np.einsum("rnp,rnp->rp", columns[..., :count], columns[..., :count]))
        columns[..., :count] /= size[:, None]
        normal = columns.mT @ columns
        prior = np.arange(count, columns.shape[2])
        normal[:, prior, prior] += 1.0
        return cls(columns, normal, size, errors)

    def solve(self, away: Array) -> tuple[Array, Array, Array]:
        """Step of the parameters and of the felt parts, and the uncertainty of these."""
        felt = self.errors.felt.shape[2]
        right = np.zeros((*self.normal.shape[:2], 1 + felt))
        right[..., :1] = self.columns.mT @ self.errors.apart(away[..., None])
        right[:, -felt:, 1:] = np.eye(felt)
        found = self._solved(right)
        of_felt = found[:, -felt:]
        variance = np.linalg.diagonal(of_felt[..., 1:])
        doubt = np.sqrt(np.clip(variance, 0.0, 1.0))  # 1 before the fit
        return found[:, : self.size.shape[1], 0] / self.size, of_felt[..., 0], doubt

    def map(self) -> Array:
        """The step of the parameters as a matrix, shape (R, 3 p + c, n)."""
        found = self._solved(self.columns.mT)[:, : self.size.shape[1]]
        found /= self.size[..., None]
        rows = self.errors.head.apart(found.mT, self.errors.noise)
        return np.asarray((rows / self.errors.noise[..., None]).mT)

    def _solved(self, right: Array) -> Array:
        try:
            return np.asarray(np.linalg.solve(self.normal, right))
        except np.linalg.LinAlgError:
            raise DesignError(
                "the readings do not determine the temperature laws; measure at more temperatures"
            ) from None


def estimator(fit: ProductFit, state: Solution) -> tuple[Array, Errors]:
    """Linearise the fit at its solution.

    Parameters
    ----------
    fit : ProductFit
        R records.
    state : Solution
        Their solution.

    Returns
    -------
    map : ndarray, shape (R, 3 p + c, n)
        Takes changes of the readings to those of the parameters.
    errors : Errors
        Errors of the readings there.
    """
    point = fit.readings.at(state.felt)
    errors = errors_at(fit, state, point)
    return _System.of(point.jacobian(state.parameters), errors).map(), errors
