"""One table Y_JK made ready for the estimators: its design matrix, its head positions, its map.

An estimator is linear: the coefficients are a matrix times the readings. Each closed form works on
the mean over the strokes present at each of the nine positions of the 8-position test, so it is
such a matrix too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from accelcal.arguments.options import check_choice
from accelcal.arrays import Array, Mask
from accelcal.errors import DesignError, InputError
from accelcal.estimate.declared_scatter import declared_scatter
from accelcal.estimate.estimability import Estimability, estimability, signed, tells_alike
from accelcal.estimate.solver import LeastSquares, WithGaps
from accelcal.geometry import Acceleration, accelerations, side_of
from accelcal.head_angles import head_positions, turn_angles
from accelcal.model import COEFFICIENTS, design_matrix
from accelcal.numerics.grouping import Grouped, distinct, grouped, median
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


Method = Literal["least-squares", "closed-form", "sign-corrected", "printed"]

METHODS: tuple[Method, ...] = get_args(Method)
"""Names of the estimators; the first is the default."""


class LinearEstimator(NamedTuple):
    """Coefficients of one table as a linear map of its readings."""

    table: PreparedTable  # of n readings
    names: tuple[str, ...]  # the p coefficients that are estimated
    map: Array  # the estimator, shape (p, n), or (R, p, n) of R records with gaps of their own
    solve: Callable[[Array], Array]  # the same, of readings (..., n), with less rounding error
    stands_for: Mapping[str, str]  # what an estimate tells, where it is not the coefficient alone

    def coefficients(self, output: Array) -> Array:
        """Coefficients, shape (..., 6), of readings, shape (..., n); zero where not estimated."""
        return self.expand(self.solve(output))

    def expand(self, values: Array) -> Array:
        """Put the values of the p estimated coefficients among all six, the others zero."""
        full = np.zeros((*values.shape[:-1], len(COEFFICIENTS)))
        full[..., [COEFFICIENTS.index(name) for name in self.names]] = values
        return full


def linear_estimator(
    table: PreparedTable, method: str = METHODS[0], delta0: float = 0.0
) -> LinearEstimator:
    """Make the estimator of a table by one of `METHODS`; the printed one has a fixture angle [rad].

    Raises
    ------
    InputError
        If the method is unknown, or a closed form is asked for some of the coefficients only.
    DesignError
        If a closed form meets a table that is not an 8-position test.
    """
    check_choice(METHODS, method=method)
    if method == METHODS[0]:
        found, solver = table.estimability, table.least_squares
        return LinearEstimator(table, found.kept, solver.map, solver.solve, found.stands_for)
    lost = [name for name in COEFFICIENTS if name not in table.estimability.kept]
    if lost:
        raise InputError(
            f"{', '.join(lost)} cannot be told or was not asked for, but method {method!r} has a"
            " fixed set of coefficients; use least-squares"
        )
    matrix = _closed_form_map(table, method, delta0)
    given = [bool(np.isfinite(row).all()) for row in matrix]
    names = tuple(name for name, has in zip(COEFFICIENTS, given, strict=True) if has)
    rows = matrix[given]
    return LinearEstimator(table, names, rows, lambda y: y @ rows.T, _closed_form_meaning(method))


# -- the three closed forms ------------------------------------------------------------------------


def _closed_form_map(table: PreparedTable, method: str, delta0: float) -> Array:
    """Matrix of a closed form, one of `accelcal.printed.CLOSED_FORMS`, on n readings, shape (6, n).

    A row is NaN for a coefficient that the form does not estimate. The printed form alone has a
    place for the fixture angle [rad].

    Raises
    ------
    DesignError
        If the readings are not at the eight positions 0, 45 .. 315 deg, or `delta0` is not zero
        with a form that is exact only there.

    Notes
    -----
    Equation (6) uses Y1 and Y9. Where the return J = 9 was not read, Y1 stands for it.
    """
    if delta0 != 0.0 and method != "printed":
        raise DesignError(
            f"delta0 is {delta0} rad with method {method!r}; the closed form holds at"
            " delta0 = 0 only, so use least-squares"
        )
    from accelcal.printed import estimator_matrix

    means = _position_means(table.record.angle)
    sign = np.repeat([1.0, side_of(table.mounting)], [4, 2])  # of M and M_ip
    return np.asarray(estimator_matrix(method, delta0) @ means * sign[:, None])


def _closed_form_meaning(method: str) -> dict[str, str]:
    """Say what the estimates of a closed form stand for, where it is not what they are named.

    By coefficient it is the combination that noise-free data at delta0 = 0 return.

    Examples
    --------
    >>> _closed_form_meaning("sign-corrected")
    {'K1': 'K1 + 0.75 K3'}
    """
    from accelcal.printed import documented_bias

    rows = zip(COEFFICIENTS, documented_bias(method), np.eye(6), strict=True)
    return {
        name: _combination(row)
        for name, row, itself in rows
        if np.isfinite(row).all() and np.abs(row - itself).max() > 1e-9
    }


def _combination(shares: Array) -> str:
    terms = [
        signed(float(share), name)
        for name, share in zip(COEFFICIENTS, shares, strict=True)
        if abs(share) > 1e-9
    ]
    return " ".join(terms).removeprefix("+ ")


def _position_means(angle: Array) -> Array:
    """Matrix that takes the mean over the strokes present at each of J = 1..9, shape (9, n)."""
    at = np.abs(angle - turn_angles(8)[:, None]) < 1e-6
    if not at.any(axis=0).all():
        stray = float(angle[~at.any(axis=0)][0])
        raise DesignError(
            f"a reading at {stray:g} deg; the closed forms need the eight positions 0, 45 .. 360"
            " deg, so use least-squares"
        )
    at[8] = at[8] if at[8].any() else at[0]
    at[0] = at[0] if at[0].any() else at[8]
    missing = [str(j + 1) for j in range(9) if not at[j].any()]
    if missing:
        raise DesignError(
            f"no reading at position J = {', '.join(missing)}; the closed forms need all eight"
            " positions, so use least-squares"
        )
    return np.asarray(at / at.sum(axis=1, keepdims=True), dtype=np.float64)
