"""The errors of a head, from its own calibration by re-clampings or units, or a certificate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.numbers import number_array
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.escapes import visible
from accelcal.frozen_mapping import freeze
from accelcal.head_angles import angular_distance
from accelcal.numerics.covariance import covariance_root, posterior
from accelcal.numerics.probability import NORMAL_FACTOR
from accelcal.results.covariance import Correlated, Rows, rows_of
from accelcal.results.documents.checked import (
    Kind,
    checked,
    list_of,
    mapping_of,
    number,
    number_or_none,
    size_or_none,
)
from accelcal.results.documents.fields import Document, StoredPart, document_of, members
from accelcal.results.documents.stored import StoredResult
from accelcal.results.findings import Change
from accelcal.results.quantity import Gate, Quantity
from accelcal.results.tabular import TabularResult

if TYPE_CHECKING:
    from accelcal.plot.head import HeadPlot

__all__ = ["HeadCalibration", "HeadHarmonic", "UnitOnHead"]


LEFT_OVER = "what is left"
"""Gate on the residuals of the readings that told of the head."""

_ROUNDED = 1e-9  # part of the largest entry by which one of a document may be off


@dataclass(frozen=True, slots=True)
class HeadHarmonic(StoredPart):
    """A pattern of the errors over the positions.

    Attributes
    ----------
    name : str
        ``"mean"``, ``"cos 1"``, ``"sin 1"`` ... of the graduation.
    amplitude : Quantity
        Its amplitude [rad].
    told : float
        One minus the variance that is left over the declared one: 1 where the readings tell it,
        0 where it is as uncertain as declared.
    absorbed_by : str
        Coefficients that it looks like on one clamping; empty where it leaves residuals.
    """

    name: str
    amplitude: Quantity
    told: float
    absorbed_by: str = ""


@dataclass(frozen=True, slots=True)
class UnitOnHead(StoredPart):
    """What one record tells of the head, and what it gains.

    Attributes
    ----------
    name : str
        Serial number; source where it has none, or several records have it.
    sha256 : str or None
        SHA-256 of its table, by which a fit knows it again.
    information : tuple of tuple of float, shape (J, J)
        Information on the errors of the positions [1/rad^2].
    pull : tuple of float, shape (J,)
        Information times estimate [1/rad].
    coefficients : mapping of str to Change
        k2, k3 and delta_ip (of each axis), fitted with this record alone and with all.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {
        "information": list_of(list_of(number)),
        "coefficients": mapping_of(Change.from_document),
    }

    name: str
    sha256: str | None
    information: Rows
    pull: tuple[float, ...]
    coefficients: Mapping[str, Change]


def _is_covariance(matrix: Array) -> bool:
    """Tell whether a matrix is symmetric and has no eigenvalue below zero, but for rounding."""
    if not np.isfinite(matrix).all():
        return False
    rounding = _ROUNDED * float(np.abs(matrix).max(initial=0.0)) + np.finfo(np.float64).tiny
    if (np.abs(matrix - matrix.T) > rounding).any():
        return False
    return bool(np.linalg.eigvalsh(matrix).min() >= -len(matrix) * rounding)


@dataclass(frozen=True, slots=True)
class HeadCalibration(Correlated, StoredResult, TabularResult):
    """Errors of the positions of a head, true minus nominal, with their covariance.

    Attributes
    ----------
    angles_deg : tuple of float
        Graduations of the head, from 0 to 360 [deg].
    errors : tuple of float
        Error of each [rad].
    covariance_matrix : tuple of tuple of float
        Covariance of the errors, which is the array `covariance` as well [rad^2].
    origin : str
        ``"self-calibration"`` or ``"certificate"``.
    declared_uncertainty_rad : float or None
        Standard uncertainty of a position before any reading [rad]; None for a certificate.
    harmonics : tuple of HeadHarmonic
        The same errors as harmonics, with what cannot be told of them.
    units : tuple of UnitOnHead
        Records that told them.
    gates : tuple of Gate
        Checks with their findings.
    source : str
        File or files.
    software : str
        Name and version of what made it.
    head_name, stand_name : str or None
        Names of the head and of its stand; None where they are not told.

    Examples
    --------
    >>> import accelcal
    >>> head = accelcal.calibrate_head([accelcal.simulate(seed=seed) for seed in (1, 2)])
    >>> calibration = accelcal.fit(accelcal.simulate(seed=3), head=head)
    >>> head.angles_deg[:3], head.origin
    ((0.0, 45.0, 90.0), 'self-calibration')
    """

    SCHEMA: ClassVar[str] = "accelcal/head/1"
    _WRITER: ClassVar[str] = "accelcal head"
    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"declared_uncertainty_rad": size_or_none}
    _MISSING: ClassVar[Mapping[str, Any]] = dict.fromkeys(("head_name", "stand_name"))

    angles_deg: tuple[float, ...]
    errors: tuple[float, ...]
    covariance_matrix: Rows
    origin: str
    declared_uncertainty_rad: float | None = None
    harmonics: tuple[HeadHarmonic, ...] = ()
    units: tuple[UnitOnHead, ...] = ()
    gates: tuple[Gate, ...] = ()
    source: str = "<head>"
    software: str = ""
    head_name: str | None = None
    stand_name: str | None = None

    def __post_init__(self) -> None:
        freeze(self)
        n, rows = len(self.angles_deg), self.covariance_matrix
        if not n or {len(self.errors), len(rows), *map(len, rows)} != {n}:
            raise InputError(f"a head of {n} positions with other numbers of errors or variances")
        matrix = self.covariance
        if list(self.angles_deg) != sorted({angle % 360.0 for angle in self.angles_deg}):
            raise InputError("positions of a head are different angles from 0 to 360, in order")
        sizes = [{len(u.pull), len(u.information), *map(len, u.information)} for u in self.units]
        if any(size != {n} for size in sizes):
            raise InputError("a unit tells of another number of positions than the head has")
        if self.declared_uncertainty_rad is not None and not self.declared_uncertainty_rad > 0.0:
            raise InputError("the declared uncertainty of a head is above 0 rad")
        if not _is_covariance(matrix):
            raise InputError("the covariance of a head is none; it is symmetric and not negative")

    def __repr__(self) -> str:
        what = f"{len(self.errors)} positions, {self.origin}"
        return visible(f"<HeadCalibration {self.source}: {what}>")

    @property
    def uncertainty(self) -> float:
        """Root mean square of the standard uncertainties of the positions [rad]."""
        return float(np.sqrt(np.mean(np.diagonal(self.covariance))))

    @property
    def is_disturbed(self) -> bool:
        """Whether noise and head do not explain the readings that told the errors."""
        return any(gate.name == LEFT_OVER and gate.verdict == "warn" for gate in self.gates)

    @property
    def plot(self) -> HeadPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.head import HeadPlot

        return HeadPlot(self)

    def quantities(self) -> tuple[Quantity, ...]:
        """Errors with their uncertainties, position by position."""
        sizes = np.sqrt(np.diagonal(self.covariance)).tolist()
        return tuple(
            Quantity(e, u, "rad", NORMAL_FACTOR * u)
            for e, u in zip(self.errors, sizes, strict=True)
        )

    def rows(self) -> list[dict[str, Any]]:
        """List the errors of the positions, a flat dictionary each."""
        found = zip(self.angles_deg, self.quantities(), strict=True)
        return [{"angle_deg": angle, **error.to_document()} for angle, error in found]

    def without(self, sha256: str | None) -> HeadCalibration:
        """Return what the other records tell, so that no reading is used twice.

        Parameters
        ----------
        sha256 : str or None
            SHA-256 of the table to be left out.

        Returns
        -------
        HeadCalibration
            The same object where the table told nothing of the head.
        """
        rest = tuple(unit for unit in self.units if unit.sha256 != sha256)
        if sha256 is None or len(rest) == len(self.units) or self.declared_uncertainty_rad is None:
            return self
        n = len(self.errors)
        information = np.eye(n) / self.declared_uncertainty_rad**2
        pull = np.zeros(n)
        for unit in rest:
            information = information + np.array(unit.information)
            pull = pull + np.array(unit.pull)
        errors, covariance = posterior(information, pull)
        return replace(
            self,
            errors=tuple(errors.tolist()),
            covariance_matrix=rows_of(covariance),
            harmonics=(),
            units=rest,
        )

    def at(self, graduations: ArrayLike) -> tuple[Array, Array]:
        """Errors at some graduations, with their covariance.

        Parameters
        ----------
        graduations : array_like, shape (J,)
            Positions from 0 to 360 [deg].

        Returns
        -------
        errors : ndarray, shape (J,)
            Errors [rad].
        covariance : ndarray, shape (J, J)
            Their covariance [rad^2].

        Raises
        ------
        InputError
            If one is no position of this head: nothing tells what lies between two.
        """
        known, asked = np.array(self.angles_deg), number_array(graduations, "graduations").ravel()
        away = angular_distance(asked[:, None], known)
        place = np.argmin(away, axis=1)
        missed = ~(away[np.arange(len(place)), place] <= 1e-5)
        if missed.any():
            raise InputError(
                f"head position {asked[missed][0]:g} deg is not among the {len(known)} of"
                f" {self.source}; calibrate the head at the positions of the test"
            )
        return np.array(self.errors)[place], self.covariance[np.ix_(place, place)]

    def spread_over(self, graduations: ArrayLike) -> tuple[float, Array]:
        """Uncertainty of some positions as one size and a shape.

        Parameters
        ----------
        graduations : ndarray, shape (J,)
            Positions [deg].

        Returns
        -------
        size : float
            Root mean square of their standard uncertainties [rad].
        root : ndarray, shape (J, J)
            L of the covariance size^2 L L^T.
        """
        _, matrix = self.at(graduations)
        size = float(np.sqrt(np.mean(np.diagonal(matrix))))
        return size, covariance_root(matrix / size**2 if size else matrix)

    def _contents(self) -> dict[str, Any]:
        positions = zip(self.angles_deg, self.quantities(), strict=True)
        return {
            **members(self, "software origin source head_name stand_name declared_uncertainty_rad"),
            "positions": [{"angle_deg": a, "error": q.to_document()} for a, q in positions],
            "covariance": document_of(self.covariance_matrix),
            **members(self, "harmonics units gates"),
        }

    @classmethod
    def _read(cls, document: Document) -> HeadCalibration:
        positions = checked(document, "positions", list_of(_position))
        return cls._of_fields(
            document,
            angles_deg=tuple(angle for angle, _ in positions),
            errors=tuple(error for _, error in positions),
            covariance_matrix=checked(document, "covariance", list_of(list_of(number))),
        )


def _position(document: Document) -> tuple[float, float]:
    error = checked(document, "error", Quantity.from_document)
    return checked(document, "angle_deg", number), number(number_or_none(error.value) or 0.0)
