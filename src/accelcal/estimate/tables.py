"""One table Y_JK made ready for the estimators: its design matrix, its head positions, its map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from accelcal.errors import DesignError
from accelcal.estimate.estimability import Estimability, estimability
from accelcal.estimate.solver import LeastSquares
from accelcal.geometry import accelerations
from accelcal.model import COEFFICIENTS, design_matrix
from accelcal.record import TumbleRecord

__all__ = ["PreparedTable", "head_positions", "prepare"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PreparedTable:
    """A table with everything that follows from its angles.

    Attributes
    ----------
    record : TumbleRecord
        The n readings of one run in one mounting.
    design : ndarray, shape (n, 6)
        Design matrix in powers of g.
    angular : ndarray, shape (n, 6)
        Derivative of `design` with respect to the head angle [1/rad].
    head : ndarray of float, shape (n,)
        Head position of each reading: the angle within one turn [deg].
    scatter : ndarray, shape (n,)
        Declared standard uncertainty of each reading, or ones where none is declared.
    scatter_dof : float or None
        Degrees of freedom of the declared scatter; None where none is declared.
    estimability : Estimability
        What the angles determine.
    """

    record: TumbleRecord
    design: Array
    angular: Array
    head: Array
    scatter: Array
    scatter_dof: float | None
    estimability: Estimability

    @property
    def kept_design(self) -> Array:
        """Columns of the coefficients that are estimated, shape (n, p)."""
        return self.design[:, self.estimability.columns]

    def least_squares_map(self) -> Array:
        """Return the weighted least-squares estimator as a matrix, shape (p, n)."""
        return LeastSquares(self.kept_design / self.scatter[:, None]).map / self.scatter


def prepare(
    record: TumbleRecord,
    *,
    delta0: float = 0.0,
    asked: Sequence[str] = COEFFICIENTS,
    strict: bool = False,
) -> PreparedTable:
    """Work out what follows from the angles of one table.

    Parameters
    ----------
    record : TumbleRecord
        Readings of one run in one mounting.
    delta0 : float, default 0
        Fixture angle [rad].
    asked : sequence of str
        Coefficients to estimate.
    strict : bool, default False
        Refuse a design without the rank for all that is asked.

    Returns
    -------
    PreparedTable
        Design, head positions and estimability.

    Raises
    ------
    DesignError
        If the table is too small, or by `strict`.
    """
    mounting = str(record.mounting[0])
    design = design_matrix(accelerations(record.angle, delta0, mounting), mounting)
    found = estimability(design, asked, strict=strict)
    if len(record) < len(found.kept):
        raise DesignError(
            f"{len(record)} readings for {len(found.kept)} coefficients;"
            " measure more positions or ask for fewer coefficients"
        )
    scatter, dof = _declared_scatter(record)
    return PreparedTable(
        record=record,
        design=design,
        angular=_angular_derivative(record.angle, delta0, mounting),
        head=head_positions(record.angle),
        scatter=scatter,
        scatter_dof=dof,
        estimability=found,
    )


def head_positions(angle: Array) -> Array:
    """Head position of an angle: 0 and 360 deg are the same place on the head.

    Parameters
    ----------
    angle : ndarray
        Head angles [deg].

    Returns
    -------
    ndarray
        Angle within one turn, rounded to a micro-degree [deg].

    Examples
    --------
    >>> import numpy as np
    >>> head_positions(np.array([0.0, 360.0, -90.0])).tolist()
    [0.0, 0.0, 270.0]
    """
    return np.mod(np.round(np.mod(angle, 360.0), 6), 360.0)


def _angular_derivative(angle: Array, delta0: float, mounting: str) -> Array:
    """Derivative of the design matrix by the head angle [1/rad], by central differences."""
    step = 1e-4
    ahead = design_matrix(accelerations(angle, delta0 + step, mounting), mounting)
    behind = design_matrix(accelerations(angle, delta0 - step, mounting), mounting)
    return (ahead - behind) / (2.0 * step)


def _declared_scatter(record: TumbleRecord) -> tuple[Array, float | None]:
    """Standard uncertainty of each averaged reading, where the table declares them all."""
    if record.std is None or not np.all(record.std > 0):
        return np.ones(len(record)), None
    if record.count is None or not np.all(record.count >= 2):
        return record.std.copy(), np.inf
    return record.std / np.sqrt(record.count), float((record.count - 1.0).sum())
