"""The error (4) of a measured acceleration, split by component."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from accelcal.arrays import Array, EqualByContents, Mask
from accelcal.escapes import visible
from accelcal.numerics.probability import LEVEL
from accelcal.plural import counted
from accelcal.results.documents.checked import (
    DamageError,
    Kind,
    checked,
    column,
    flag,
    freedom,
    list_of,
    member,
    number,
    number_or_nan,
    size,
)
from accelcal.results.documents.fields import (
    Document,
    ReadByFields,
    finite_or_none,
    members,
    members_at,
)
from accelcal.results.documents.stored import StoredResult
from accelcal.results.tabular import TabularResult, frame_of

if TYPE_CHECKING:
    import pandas as pd

    from accelcal.plot.error_budget import ErrorBudgetPlot

__all__ = ["ErrorBudget", "ErrorComponent"]


_AXES = ("a_i", "a_p", "a_o")
_OF_A_POINT = (
    *("systematic", "bound", "variance_by_correlation", "standard_uncertainty"),
    *("coverage_factor", "expanded_uncertainty"),
)
_OF_A_PART = ("value", "bound", "standard_uncertainty")


@dataclass(frozen=True, slots=True, eq=False)
class ErrorComponent(EqualByContents, ReadByFields):
    """One component of the error at n points.

    Attributes
    ----------
    name, symbol : str
        What it is; the symbol names it in the document and the picture.
    value : ndarray, shape (n,)
        Systematic part [local g].
    bound : ndarray, shape (n,)
        What stands behind +- in (4), never negative; a component of (3) has its share [local g].
    standard_uncertainty : ndarray, shape (n,)
        Standard uncertainty [local g].
    dof : ndarray, shape (n,)
        Degrees of freedom of the standard uncertainty, as they count beside other errors: of
        launches a half is one alone; infinite where it is declared.
    origin : str
        Where the bound or the uncertainty comes from.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {
        "value": number,
        "bound": size,
        "standard_uncertainty": size,
        "dof": freedom,
    }  # at one point

    name: str
    symbol: str
    value: Array
    bound: Array
    standard_uncertainty: Array
    dof: Array
    origin: str


@dataclass(frozen=True, slots=True, eq=False)
class ErrorBudget(EqualByContents, StoredResult, TabularResult):
    """Error of the measured acceleration with its band, at n points.

    Attributes
    ----------
    a_i, a_p, a_o : ndarray, shape (n,)
        Acceleration along input, pendulous and output axis [local g].
    temperature_degC : ndarray, shape (n,)
        Temperature; NaN where neither it nor T0 is known.
    time_s : ndarray, shape (n,)
        Time since the start of the launch [s].
    extrapolated : ndarray of bool, shape (n,)
        Whether the temperature lies outside the calibrated ones.
    components : tuple of ErrorComponent
        The parts of the error.
    systematic : ndarray, shape (n,)
        Sum of the systematic parts [local g].
    bound : ndarray, shape (n,)
        What stands behind +- in (4), added linearly as the paper does, with its factor 0.5 in (3),
        which may make it smaller than the 95 % interval [local g].
    correlated : frozenset of str
        Symbols of the components that are correlated with one another.
    variance_by_correlation : ndarray, shape (n,)
        What their correlations add to the combined variance [g^2].
    standard_uncertainty, coverage_factor, expanded_uncertainty : ndarray, shape (n,)
        Combined standard uncertainty by the GUM, Student's factor, and the half width of the 95 %
        interval [local g].
    warnings : tuple of str
        What a reader must know before using the numbers.
    serial : str or None
        Serial number of the accelerometer.
    source : str
        Where the readings of the calibration came from.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> found = accelcal.budget(calibration, [0.0, 1.0], temperature=80.0)
    >>> found.expanded_uncertainty.shape, [part.symbol for part in found.components[:3]]
    ((2,), ['k0', 'K1', 'k2'])
    """

    SCHEMA: ClassVar[str] = "accelcal/budget/1"
    _WRITER: ClassVar[str] = "accelcal budget"

    a_i: Array
    a_p: Array
    a_o: Array
    temperature_degC: Array
    time_s: Array
    extrapolated: Mask
    components: tuple[ErrorComponent, ...]
    systematic: Array
    bound: Array
    correlated: frozenset[str]
    variance_by_correlation: Array
    standard_uncertainty: Array
    coverage_factor: Array
    expanded_uncertainty: Array
    warnings: tuple[str, ...] = ()
    serial: str | None = None
    source: str = "<table>"

    def __repr__(self) -> str:
        points = counted(self.a_i.size, "point")
        return visible(f"<ErrorBudget {self.serial or self.source}: {points}>")

    @property
    def plot(self) -> ErrorBudgetPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.error_budget import ErrorBudgetPlot

        return ErrorBudgetPlot(self)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "serial source"),
            "acceleration_unit": "g_local",
            "interval_level": LEVEL,
            "points": [self._point(i) for i in range(self.a_i.size)],
            "warnings": list(self.warnings),
        }

    def _point(self, index: int) -> dict[str, Any]:
        return {
            "acceleration": members_at(self, " ".join(_AXES), index),
            "temperature_degC": finite_or_none(self.temperature_degC[index]),
            **members_at(self, "time_s", index),
            "extrapolated": bool(self.extrapolated[index]),
            **members_at(self, " ".join(_OF_A_POINT), index),
            "unit": "g",
            "components": [
                {
                    **members(part, "name symbol"),
                    **members_at(part, " ".join(_OF_A_PART), index),
                    "dof": finite_or_none(part.dof[index]),
                    "correlated": part.symbol in self.correlated,
                    "origin": part.origin,
                }
                for part in self.components
            ],
        }

    @classmethod
    def _read(cls, document: Document) -> ErrorBudget:
        points = partial(column, document, "points")
        parts = checked(document, "points", list_of(member("components", list_of(_part)), 1))
        if len({tuple(part.symbol for part, _ in own) for own in parts}) > 1:
            raise DamageError("points that do not have the same components", "points")
        return cls._of_fields(
            document,
            **{axis: points("acceleration", axis) for axis in _AXES},
            **{name: points(name) for name in ("time_s", *_OF_A_POINT)},
            temperature_degC=points("temperature_degC", kind=number_or_nan),
            extrapolated=points("extrapolated", kind=flag),
            components=tuple(
                _at_all([part for part, _ in own]) for own in zip(*parts, strict=True)
            ),
            correlated=frozenset(part.symbol for part, correlated in parts[0] if correlated),
        )

    def rows(self) -> list[dict[str, Any]]:
        """List the totals and components of all points, a flat dictionary each."""
        return [
            {
                **point["acceleration"],
                **{key: point[key] for key in ("temperature_degC", "time_s", "extrapolated")},
                "component": part["symbol"],
                **{f"{size}_g": part.get(size) for size in (*_OF_A_PART, "expanded_uncertainty")},
            }
            for point in self.to_document()["points"]
            for part in (
                *point["components"],
                {**point, "symbol": "total", "value": point["systematic"]},
            )
        ]

    def to_frame(self) -> pd.DataFrame:
        """Tabulate totals and components, a line each with the columns of `rows`."""
        return frame_of(self.rows(), a_i="g", a_p="g", a_o="g")


def _part(document: Document) -> tuple[ErrorComponent, bool]:
    return ErrorComponent._of_fields(document), checked(document, "correlated", flag)


def _at_all(points: Sequence[ErrorComponent]) -> ErrorComponent:
    """A component at all points, of what it is at each."""
    arrays: dict[str, Any] = {
        name: np.array([getattr(point, name) for point in points]) for name in (*_OF_A_PART, "dof")
    }
    return replace(points[0], **arrays)
