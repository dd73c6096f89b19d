"""The result of comparing two calibrations: how far apart they are, and whether that is noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from accelcal.escapes import visible
from accelcal.numerics.probability import written_p_value
from accelcal.plural import listed
from accelcal.results.agreement import (
    chance_of,
    explained_by_errors,
    hidden_by_errors,
    least_of,
    verdict_of,
)
from accelcal.results.documents.fields import StoredPart, members
from accelcal.results.documents.stored import StoredResult
from accelcal.results.quantity import ErrorSource, Quantity
from accelcal.results.tabular import TabularResult

if TYPE_CHECKING:
    from accelcal.plot.calibration_comparison import CalibrationComparisonPlot

__all__ = [
    "SCHEMA",
    "CalibrationComparison",
    "CoefficientChange",
    "ComparedCalibration",
    "IndicatedChange",
    "JointTest",
]

SCHEMA = "accelcal/calibration-comparison/1"


@dataclass(frozen=True, slots=True)
class ComparedCalibration(StoredPart):
    """One of two calibrations.

    Attributes
    ----------
    source : str
        Where its readings came from.
    date : str or None
        Date of its test.
    effects : tuple of str
        Ids of the effects that it has.
    error_sources : tuple of ErrorSource
        What it took as uncertain; the noise of a reading is over K1 [g]. None in documents that do
        not have it.
    """

    _MISSING: ClassVar[Mapping[str, Any]] = {"error_sources": ()}

    source: str
    date: str | None
    effects: tuple[str, ...]
    error_sources: tuple[ErrorSource, ...] = ()


@dataclass(frozen=True, slots=True)
class CoefficientChange(StoredPart):
    """One coefficient in both calibrations, or the size of an effect of both.

    Attributes
    ----------
    coefficient : str
        Its symbol as in a calibration, slopes of the laws by theirs, as in ``"lam1"``; of an effect
        the name of its parameter.
    cross_axis : str or None
        ``"a_p"`` or ``"a_o"``, where it is of one cross axis.
    old, new : Quantity
        What each calibration states, in the unit and the local g of the old one.
    difference : Quantity
        New less old, with the errors of both.
    effect : str or None
        Id of the effect, where it is the size of one.
    """

    coefficient: str
    cross_axis: str | None
    old: Quantity
    new: Quantity
    difference: Quantity
    effect: str | None = None

    @property
    def normalised_error(self) -> float | None:
        """E_n, the difference over its expanded uncertainty; None where that is zero."""
        value, half = self.difference.value, self.difference.expanded_uncertainty
        return value / half if half and value is not None else None

    @property
    def agrees(self) -> bool:
        """Whether E_n is 1 at most, or nothing differs."""
        return abs(self.difference.value or 0.0) <= (self.difference.expanded_uncertainty or 0.0)

    @property
    def p_value(self) -> float:
        """Chance of such a difference where nothing has changed, by itself."""
        return chance_of(self.difference)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "effect coefficient cross_axis old new difference"),
            "E_n": self.normalised_error,
            "agrees": self.agrees,
        }


@dataclass(frozen=True, slots=True)
class JointTest(StoredPart):
    """All coefficients at once, with their correlations.

    Attributes
    ----------
    chi2 : float
        Sum of squares of the differences in the measure of their covariance.
    coefficients : int
        Number of independent differences.
    p_value : float
        Chance of such differences where nothing has changed, whatever few degrees of freedom leave
        open of their covariance.
    """

    chi2: float
    coefficients: int
    p_value: float


@dataclass(frozen=True, slots=True)
class IndicatedChange(StoredPart):
    """Change of what is indicated at one acceleration.

    Attributes
    ----------
    a_i : float
        Acceleration along the input axis, without any across it [g].
    difference : Quantity
        Output by the new calibration less that by the old one, over K1 of the old one [g].
    band : float
        Half width of the 95 % band that holds at all accelerations at once [g].
    """

    a_i: float
    difference: Quantity
    band: float

    @property
    def agrees(self) -> bool:
        """Whether the band holds no change."""
        return abs(self.difference.value or 0.0) <= self.band


@dataclass(frozen=True, slots=True)
class CalibrationComparison(StoredResult, TabularResult):
    """Two calibrations of one accelerometer, coefficient by coefficient.

    Attributes
    ----------
    old, new : ComparedCalibration
        The two.
    temperature_degC : float or None
        Where they are compared; None where temperatures are unknown.
    same_head : bool or None
        Whether both were measured on one head, whose errors are common to both; None where nothing
        tells it.
    coefficients : tuple of CoefficientChange
        What both determine, the sizes of effects behind the coefficients.
    joint : JointTest
        Test of all coefficients.
    indicated : tuple of IndicatedChange
        Change of the indicated acceleration over the range that both tested.
    notes : tuple of str
        What a reader must know.
    explained_by : tuple of str
        Errors that nobody declared and the calibrations do not tell, or from few degrees of
        freedom, as ``"launch_uncertainty"``, that may have made all differences; empty where they
        may not, or none is seen.
    serial : str or None
        Serial number.
    software : str
        What compared them.

    Examples
    --------
    >>> import accelcal
    >>> old, new = (accelcal.fit(accelcal.simulate(seed=seed)) for seed in (1, 2))
    >>> found = accelcal.compare_calibrations(old, new, same_head=False)
    >>> found.verdict, found["k0"].agrees
    ('agree', True)
    """

    SCHEMA: ClassVar[str] = SCHEMA
    _WRITER: ClassVar[str] = "accelcal compare"
    _SEVERAL: ClassVar[str] = "comparisons"
    _MISSING: ClassVar[Mapping[str, Any]] = {"explained_by": ()}

    old: ComparedCalibration
    new: ComparedCalibration
    temperature_degC: float | None
    same_head: bool | None
    coefficients: tuple[CoefficientChange, ...]
    joint: JointTest
    indicated: tuple[IndicatedChange, ...]
    notes: tuple[str, ...] = ()
    explained_by: tuple[str, ...] = ()
    serial: str | None = None
    software: str = ""

    def __repr__(self) -> str:
        name = self.serial or self.new.source
        chance = written_p_value(self.p_value)
        return visible(f"<CalibrationComparison {name}: {self.verdict}, {chance}>")

    def __getitem__(self, coefficient: str) -> CoefficientChange:
        """Change of a coefficient or parameter, of the first cross axis or effect that has it.

        Raises
        ------
        KeyError
            If it is not compared.
        """
        for change in self.coefficients:
            if change.coefficient == coefficient:
                return change
        raise KeyError(coefficient)

    @property
    def sizes(self) -> tuple[CoefficientChange, ...]:
        """Those of `coefficients` that are sizes of effects."""
        return tuple(own for own in self.coefficients if own.effect)

    @property
    def p_value(self) -> float:
        """Chance of such differences where nothing has changed.

        The least of the joint test and of each size of an effect, times their number (Bonferroni).
        """
        return least_of([self.joint.p_value, *(own.p_value for own in self.sizes)])

    @property
    def verdict(self) -> str:
        """What it comes to: ``"agree"``, ``"disagree"`` or ``"no verdict"``."""
        return verdict_of(self.p_value, self.hidden_by, explained=bool(self.explained_by))

    @property
    def hidden_by(self) -> str:
        """Why there is no verdict: errors that may have made all, or differences unseen."""
        return (
            explained_by_errors(self.explained_by)
            or hidden_by_errors((*self.old.error_sources, *self.new.error_sources))
            or self._effects_of_one
        )

    @property
    def _effects_of_one(self) -> str:
        """Say which effects only one calibration has: the size of none is compared."""
        told = [
            f"the {name} calibration alone has {listed(alone)}"
            for name, own, other in (("old", self.old, self.new), ("new", self.new, self.old))
            if (alone := [effect for effect in own.effects if effect not in other.effects])
        ]
        return ", ".join(told)

    @property
    def agrees(self) -> bool:
        """Whether the verdict is ``"agree"``."""
        return self.verdict == "agree"

    @property
    def largest(self) -> IndicatedChange:
        """The largest change of the indicated acceleration over the range, by its size."""
        return max(self.indicated, key=lambda change: abs(change.difference.value or 0.0))

    @property
    def at_most(self) -> float:
        """Size that the change exceeds nowhere in the range, with 95 % [g]."""
        return max(abs(own.difference.value or 0.0) + own.band for own in self.indicated)

    @property
    def plot(self) -> CalibrationComparisonPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.calibration_comparison import CalibrationComparisonPlot

        return CalibrationComparisonPlot(self)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(
                self, "software serial old new temperature_degC same_head verdict agrees p_value"
            ),
            **members(self, "joint explained_by coefficients largest at_most indicated notes"),
        }

    def rows(self) -> list[dict[str, Any]]:
        """List the coefficients, a flat dictionary each; ``value`` is the difference."""
        return [
            {
                "serial": self.serial,
                "effect": change.effect,
                "coefficient": change.coefficient,
                "cross_axis": change.cross_axis,
                "temperature_degC": self.temperature_degC,
                "old": change.old.value,
                "new": change.new.value,
                **change.difference.to_document(),
                "E_n": change.normalised_error,
                "agrees": change.agrees,
            }
            for change in self.coefficients
        ]
