"""Tests compared before they are made: what each would tell, and in what time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from accelcal.plural import counted
from accelcal.results.documents.checked import Kind, checked, one_of, size
from accelcal.results.documents.fields import StoredPart, members
from accelcal.results.documents.stored import StoredResult
from accelcal.results.tabular import TabularResult

if TYPE_CHECKING:
    from accelcal.plot.designs import DesignPlot

__all__ = ["DesignComparison", "Forecast", "TestDesign", "Visibility"]


BLIND = "no effect can be searched for"
"""How the note of a test begins that shows no effects, and says why."""


@dataclass(frozen=True, slots=True)
class Forecast(StoredPart):
    """What a test will tell of one coefficient.

    Attributes
    ----------
    name : str
        As ``"K1"``, ``"k0"``, ``"lam1"`` or ``"delta0"``; coefficients are over the scale factor.
    mounting : str
        The mounting of its table; empty for a temperature slope.
    unit : str
        Unit of the uncertainties.
    standard_uncertainty : float
        Expected standard uncertainty.
    expanded_uncertainty, dof : float or None
        Expected expanded uncertainty (95 %) with its degrees of freedom; None where nothing would
        tell one of the errors, and where the degrees of freedom are endless.
    floor : float
        Standard uncertainty that a hundred times the strokes would leave, without rounding.
    budget : mapping of str to float
        Part of each source of error in the standard uncertainty; the squares add up.
    stands_for : str or None
        What the estimate really is, where it absorbs a coefficient that cannot be told.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {
        "unit": one_of("1", "g", "g/g^2", "g/g^3", "rad", "1/degC", "g/degC", "rad/degC"),
        "standard_uncertainty": size,
    }

    name: str
    mounting: str
    unit: str
    standard_uncertainty: float
    expanded_uncertainty: float | None
    dof: float | None
    floor: float
    budget: Mapping[str, float]
    stands_for: str | None = None

    @property
    def mostly_from(self) -> str:
        """The source of error with the largest part; empty without any error."""
        return max(self.budget, key=self.budget.__getitem__, default="")


@dataclass(frozen=True, slots=True)
class Visibility(StoredPart):
    """Whether a test would show an effect of the catalogue.

    Attributes
    ----------
    id : str
        Id of the effect.
    absorbed_by : tuple of str or None
        Coefficients that take it up without a residual; None where the test shows it.
    smallest : float or None
        Size from which it is found nine times in ten; None where it is absorbed.
    unit : str
        Unit of this size.
    aliases : tuple of str
        Other effects that this test shows as the same.
    """

    id: str
    absorbed_by: tuple[str, ...] | None
    smallest: float | None
    unit: str = ""
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class TestDesign(StoredPart):
    """A test that could be made.

    Attributes
    ----------
    positions : int or None
        Number of positions in a turn; None where the angles were given.
    angles : tuple of float
        Head angles of a forward stroke [deg].
    strokes, temperatures, mountings
        As of `accelcal.TumblePlan`.
    readings : int
        Number of readings.
    hours : float
        Time that it takes [h].
    forecasts : tuple of Forecast
        What it will tell.
    lost : tuple of str
        Which coefficients it cannot tell apart, a sentence each.
    effects : tuple of Visibility
        Which effects it would show; empty where that was not asked for or cannot be told.
    notes : tuple of str
        What else is to be known.
    choice : int or None
        Which of several lists of as many angles it has, from 1; None where there is one.

    Examples
    --------
    >>> import accelcal
    >>> test = accelcal.design(positions=[8], strokes=[2], effects=False).designs[0]
    >>> test.readings, round(test.forecast("K1").standard_uncertainty * 1e6)  # over K1 [ppm]
    (54, 10)
    """

    __test__ = False  # for pytest this would be a class of tests
    _MISSING: ClassVar[Mapping[str, Any]] = {"choice": None}

    positions: int | None
    angles: tuple[float, ...]
    strokes: int
    temperatures: tuple[float, ...]
    mountings: tuple[str, ...]
    readings: int
    hours: float
    forecasts: tuple[Forecast, ...]
    lost: tuple[str, ...] = ()
    effects: tuple[Visibility, ...] = ()
    notes: tuple[str, ...] = ()
    choice: int | None = None

    def forecast(self, name: str, mounting: str | None = None) -> Forecast | None:
        """Forecast of one coefficient.

        Parameters
        ----------
        name : str
            Its name, as in `DesignComparison.names`.
        mounting : str, optional
            By default the first mounting that has it.

        Returns
        -------
        Forecast or None
            None where the test does not tell it.
        """
        own = (f for f in self.forecasts if f.name == name and mounting in (None, f.mounting))
        return next(own, None)

    @property
    def label(self) -> str:
        """The test in a few characters, as ``"8 x 6"``: positions and strokes."""
        return label(self.positions, self.angles, self.strokes, self.choice)

    @property
    def stops(self) -> str:
        """Its positions as a label names them."""
        return self.label.partition(" x ")[0]

    @property
    def is_blind(self) -> bool:
        """Whether effects were asked for, and the test shows none."""
        return any(note.startswith(BLIND) for note in self.notes)

    def __repr__(self) -> str:
        return f"<TestDesign {self.label}: {self.readings} readings, {self.hours:.4g} h>"


def label(
    positions: int | None, angles: Iterable[float], strokes: int, choice: int | None = None
) -> str:
    """Name a test by its positions in a turn, else by the number of its angles, and its strokes.

    Of several lists of as many angles a choice tells which.
    """
    which = f" ({choice})" if choice else ""
    return f"{positions or f'{len(set(angles))} angles{which}'} x {strokes}"


def _pace(document: Any) -> dict[str, float]:
    return {name: checked(document, name, size) for name in ("reading", "turn", "soak", "mount")}


@dataclass(frozen=True, slots=True)
class DesignComparison(StoredResult, TabularResult):
    """Tests compared before they are made.

    Attributes
    ----------
    designs : tuple of TestDesign
        The tests.
    stand : mapping of str to float
        Standard uncertainty of each source of error.
    declared : bool
        Whether the errors of the stand will be declared to the fit.
    pace : mapping of str to float
        Time of a reading and of a turn [s], of a soak and of a mounting [h].
    targets : mapping of str to float
        Standard uncertainties asked for.
    software : str
        Version of accelcal.
    notes : tuple of str
        Which tests were left out, and why.

    Notes
    -----
    `str` gives a table, `to_json` a document, `rows` and `to_frame` a row for each coefficient of
    each test.

    Examples
    --------
    >>> import accelcal
    >>> compared = accelcal.design(
    ...     positions=[8, 24], strokes=[2], targets={"K1": 9e-6}, effects=False
    ... )
    >>> compared.designs[compared.meeting()[0]].positions
    24
    """

    SCHEMA: ClassVar[str] = "accelcal/design/1"
    _WRITER: ClassVar[str] = "accelcal design"
    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"pace": _pace}
    _MISSING: ClassVar[Mapping[str, Any]] = {"notes": ()}

    designs: tuple[TestDesign, ...]
    stand: Mapping[str, float]
    declared: bool
    pace: Mapping[str, float]
    targets: Mapping[str, float]
    software: str
    notes: tuple[str, ...] = ()

    def front(self, name: str) -> tuple[int, ...]:
        """Tests that no other one beats in both hours and uncertainty of a coefficient.

        Parameters
        ----------
        name : str
            The coefficient.

        Returns
        -------
        tuple of int
            Places among `designs`, the quickest first.
        """
        found: list[int] = []
        best = float("inf")
        for place in sorted(range(len(self.designs)), key=lambda i: self._cost(i, name)):
            u = self._cost(place, name)[1]
            if u < best * (1.0 - 1e-9):
                found.append(place)
                best = u
        return tuple(found)

    def _cost(self, place: int, name: str) -> tuple[float, float]:
        forecast = self.designs[place].forecast(name)
        told = forecast is not None and forecast.stands_for is None
        u = forecast.standard_uncertainty if forecast is not None and told else float("inf")
        return self.designs[place].hours, u

    def meeting(self) -> tuple[int, ...]:
        """Places of the tests that meet all targets, the quickest first."""
        good = [
            place
            for place in range(len(self.designs))
            if all(self._cost(place, name)[1] <= limit for name, limit in self.targets.items())
        ]
        return tuple(sorted(good, key=lambda place: self.designs[place].hours))

    def names(self) -> tuple[str, ...]:
        """Names of all that some test tells, in the order of telling."""
        return tuple(dict.fromkeys(f.name for d in self.designs for f in d.forecasts))

    def units(self) -> dict[str, str]:
        """Return the unit of each of these names."""
        return {f.name: f.unit for d in self.designs for f in d.forecasts}

    @property
    def plot(self) -> DesignPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.designs import DesignPlot

        return DesignPlot(self)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "stand declared pace targets designs"),
            "pareto_front": {name: list(self.front(name)) for name in self.names()},
            "meeting_targets": list(self.meeting()) if self.targets else None,
            "notes": list(self.notes),
            "software": self.software,
        }

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each coefficient of each test."""
        return [row for part in self.rows_by_design() for row in part]

    def rows_by_design(self) -> list[list[dict[str, Any]]]:
        """Return the rows of each test."""
        fronts = {name: self.front(name) for name in self.names()}
        return [list(_rows(design, i, fronts)) for i, design in enumerate(self.designs)]

    def __repr__(self) -> str:
        return f"<DesignComparison of {counted(len(self.designs), 'test')}>"


def _rows(
    design: TestDesign, place: int, fronts: Mapping[str, Sequence[int]]
) -> Iterator[dict[str, Any]]:
    for f in design.forecasts:
        yield {
            **members(design, "positions strokes"),
            "temperatures": " ".join(f"{t:g}" for t in design.temperatures),
            "mountings": " ".join(design.mountings),
            "angles": " ".join(f"{angle:g}" for angle in design.angles),
            **members(design, "readings hours"),
            "coefficient": f.name,
            **members(f, "mounting unit standard_uncertainty expanded_uncertainty dof floor"),
            **members(f, "mostly_from stands_for"),
            "pareto": place in fronts[f.name],
        }
