"""One table Y_JK made ready for the estimators: its design matrix, its head positions, its map."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.errors import DesignError, InputError
from accelcal.estimate.declared_scatter import declared_scatter
from accelcal.estimate.estimability import Estimability, estimability, tells_alike
from accelcal.estimate.solver import LeastSquares, WithGaps
from accelcal.geometry import Acceleration, accelerations
from accelcal.head_angles import head_positions
from accelcal.model import COEFFICIENTS, design_matrix
from accelcal.numerics.grouping import Grouped, grouped
from accelcal.numerics.sorting import distinct, median
from accelcal.record import TumbleRecord


class PreparedTable(NamedTuple):
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
    at_head : Grouped
        The readings by head position.
    scatter : ndarray, shape (n,) or (R, n)
        Declared standard uncertainty of each reading, or ones where none is declared; of R records
        with gaps of their own infinite where one has no reading.
    scatter_dof : float or None
        Degrees of freedom of the declared scatter; None where none is declared.
    scatter_doubt : ndarray, shape (n,)
        Variance of the logarithm of its square, of each reading.
    estimability : Estimability
        What the angles determine.
    least_squares : LeastSquares or WithGaps
        Weighted least squares for the coefficients that are estimated.
    """

    record: TumbleRecord
    design: Array
    angular: Array
    head: Array
    at_head: Grouped
    scatter: Array
    scatter_dof: float | None
    scatter_doubt: Array
    estimability: Estimability
    least_squares: LeastSquares | WithGaps

    @property
    def mounting(self) -> str:
        """Mounting, one of `accelcal.geometry.MOUNTINGS`."""
        return str(self.record.mounting[0])

    @property
    def axis(self) -> str:
        """Axis along the shaft, ``"o"`` or ``"p"``."""
        return self.mounting[0]

    @property
    def run(self) -> int:
        """Index of the run in its record."""
        return int(self.record.run[0])

    @property
    def run_label(self) -> str:
        """Name of the run."""
        return self.record.run_labels[self.run]

    @property
    def readings(self) -> Any:
        """How many there are, or ndarray of how many each record has, shape (R,)."""
        return np.isfinite(self.scatter).sum(axis=-1)

    @property
    def usual_scatter(self) -> float:
        """Median declared scatter of a reading, 1 where none is declared."""
        return median(self.scatter[np.isfinite(self.scatter)])

    def with_gaps(self, there: Mask) -> PreparedTable:
        """Return the table of R records that have some of its readings only, shape (R, n).

        Raises
        ------
        DesignError
            If these determine other coefficients, or others stand for them, than all together.
        """
        found = self.estimability
        if not tells_alike(self.design, (*found.kept, *found.shares)):
            raise DesignError("which readings there are decides what they tell apart")
        solver = WithGaps.of(self.kept_design, there)
        return self._replace(scatter=np.where(there, self.scatter, np.inf), least_squares=solver)

    def design_at(self, angle: Array, delta0: float) -> Array:
        """Design at other angles, as many or more, in the mounting of the table [deg, rad]."""
        return design_matrix(accelerations(angle, delta0, self.mounting), self.mounting)

    @property
    def kept_design(self) -> Array:
        """Columns of the coefficients that are estimated, shape (n, p)."""
        return self.design[:, self.estimability.columns]


def positions_of(tables: Sequence[PreparedTable]) -> Array:
    """Different head positions of some tables, sorted, shape (J,) [deg]."""
    return distinct(np.concatenate([table.at_head.key for table in tables]))


def prepare(
    record: TumbleRecord,
    *,
    delta0: float = 0.0,
    asked: Sequence[str] = COEFFICIENTS,
    strict: bool = False,
) -> PreparedTable:
    """Work out what follows from the angles of one table, with a fixture angle [rad].

    It is for the coefficients asked for; `strict` refuses a design without the rank for all of
    them.

    Raises
    ------
    InputError
        If all outputs are equal.
    DesignError
        If the angles do not determine K1, or by `strict`.
    """
    if len(record) == 1:
        run = record.run_labels[int(record.run[0])]
        raise InputError(
            f"one reading only in run {run}; a tumble test has readings at two or more angles"
        )
    if not is_usable(record.output):
        raise InputError(_unusable(record.output))
    _check_scatter(record)
    scatter, dof, doubt = declared_scatter(record)
    known = _from_angles(
        record.angle.tobytes(),
        str(record.mounting[0]),
        scatter.tobytes(),
        delta0,
        tuple(asked),
        strict,
    )
    if record.clamping is not None:
        head = head_positions(record.graduation)
        known = known | {"head": head, "at_head": grouped(head)}
    return PreparedTable(
        record=record, scatter=scatter, scatter_dof=dof, scatter_doubt=doubt, **known
    )


@lru_cache(maxsize=8)  # the tables of a record, and records one after the other, have the same
def _from_angles(
    angles: bytes, mounting: str, spread: bytes, delta0: float, asked: Sequence[str], strict: bool
) -> dict[str, Any]:
    """What follows from the angles and the scatter, as `PreparedTable` has it."""
    at = grouped(np.frombuffer(angles))
    rows = _at_angles(at.key.tobytes(), mounting, delta0)
    design, angular, head = (each[at.cell] for each in rows)
    found = estimability(design, asked, strict=strict)
    at_head = grouped(head)
    for shared in (design, angular, head, *at_head):
        shared.setflags(write=False)
    solver = LeastSquares(design[:, found.columns], np.frombuffer(spread))
    return {
        "design": design,
        "angular": angular,
        "head": head,
        "at_head": at_head,
        "estimability": found,
        "least_squares": solver,
    }


@lru_cache(maxsize=8)  # tables with other readings missing still have the same angles
def _at_angles(angles: bytes, mounting: str, delta0: float) -> tuple[Array, Array, Array]:
    """Rows of the design and of its derivative at some angles, and the head positions."""
    angle = np.frombuffer(angles)
    return (
        design_matrix(accelerations(angle, delta0, mounting), mounting),
        angular_derivative(angle, delta0, mounting),
        head_positions(angle),
    )


def is_usable(output: Array) -> Mask:
    """Tell readings, shape (..., n), that can be those of an accelerometer, shape (...).

    False where all are alike, or of a size whose squares cannot be calculated with.
    """
    largest = np.abs(output).max(axis=-1)
    return np.asarray((np.ptp(output, axis=-1) > 0.0) & (largest > 1e-20) & (largest < 1e20))


def _unusable(output: Array) -> str:
    if np.ptp(output) == 0.0:
        return (
            f"all {output.size} outputs are {output[0]:g}; the output of a tumble test"
            " changes with the angle, so give the readings of the accelerometer"
        )
    return (
        f"outputs of up to {np.abs(output).max():g}; they lie between 1e-20 and 1e20, so give them"
        " in another unit"
    )


def angular_derivative(angle: Array, delta0: float, mounting: str) -> Array:
    """Derivative of the design matrix by the head angle [1/rad], shape (n, 6), by a complex step.

    The angles are in deg, the fixture angle in rad.
    """
    step = 1e-30
    here = accelerations(angle, delta0, mounting)
    rates = accelerations(angle + 90.0, delta0, mounting)  # derivatives of cosine and sine
    aside: Any = (a + 1j * step * rate for a, rate in zip(here, rates, strict=True))
    return design_matrix(Acceleration(*aside), mounting).imag / step


def _check_scatter(record: TumbleRecord) -> None:
    """Refuse deviations and numbers of samples whose squares cannot be calculated with."""
    for name, values in (("std", record.std), ("count", record.count)):
        known = values[values > 0.0] if values is not None else np.ones(1)
        strange = known[(known < 1e-40) | (known > 1e20)]
        if strange.size:
            raise InputError(f"{name} of {strange[0]:g}; it lies between 1e-40 and 1e20")
