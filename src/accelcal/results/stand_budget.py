"""The budget of a stand: uncertainty of each coefficient by component, linear and Monte Carlo."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from accelcal.arguments.options import check_choice
from accelcal.arrays import Array, EqualByContents, Mask
from accelcal.escapes import visible
from accelcal.numerics.probability import LEVEL
from accelcal.results.covariance import symmetric
from accelcal.results.documents.checked import (
    DamageError,
    Kind,
    checked,
    column,
    flag,
    freedom,
    list_of,
    number,
    number_or_nan,
)
from accelcal.results.documents.fields import (
    Document,
    ReadByFields,
    StoredPart,
    finite_or_none,
    members,
    members_at,
)
from accelcal.results.documents.stored import StoredResult
from accelcal.results.stand_requirements import Requirements, Sufficiency
from accelcal.results.tabular import TabularResult

if TYPE_CHECKING:
    from accelcal.plot.stand_budget import StandBudgetPlot

__all__ = ["BudgetedCoefficient", "MonteCarlo", "StandBudget", "StandShare"]


FELT = 1e-3
"""A component below this share of the standard uncertainty of every coefficient acts on nothing."""


_OF_TOTAL = ("expanded_uncertainty", "dof", "monte_carlo_low", "monte_carlo_high", "linear_agrees")


def _array(value: Any) -> Array:
    return np.array(list_of(number)(value))


@dataclass(frozen=True, slots=True)
class BudgetedCoefficient(StoredPart):
    """What a budget is made for.

    Attributes
    ----------
    symbol : str
        K0 .. M_ip, the error model k0, k2, k3, delta, delta_ip, the slopes lam1, beta1, gam1
        above T0 and lam2, beta2, gam2 below, and delta_O, delta_P, d0 of reversed mountings.
    where : str
        Table that it belongs to; empty for the table nearest to T0, and for slopes.
    unit : str
        Its unit.
    """

    symbol: str
    where: str
    unit: str

    def __str__(self) -> str:
        return f"{self.symbol} ({self.where})" if self.where else self.symbol


@dataclass(frozen=True, slots=True, eq=False)
class StandShare(EqualByContents, ReadByFields):
    """What one component of the stand does.

    Attributes
    ----------
    name, kind : str
        The component.
    standard_uncertainty : float
        Of the component itself, in `unit`.
    unit : str
        rad, rad/day, g, 1, degC or V.
    dof : float
        Degrees of freedom.
    varies : tuple of str
        For what a new error is drawn; empty for one error in the whole test.
    errors : int
        How many independent errors that makes.
    averages : bool
        Whether more strokes average it away.
    fixed : bool
        Whether it is none of the stand's instruments.
    contributions : ndarray, shape (q,)
        Standard uncertainty of each coefficient by this component, with the sign of its effect
        where it is one error.
    residual : float
        Part of its effect on the readings that the residuals show; what is missing from 1 went
        into the coefficients. NaN where it has no effect.
    origin : str
        Where the size comes from.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {
        "dof": freedom,
        "contributions": _array,
        "residual": number_or_nan,
    }

    name: str
    kind: str
    standard_uncertainty: float
    unit: str
    dof: float
    varies: tuple[str, ...]
    errors: int
    averages: bool
    fixed: bool
    contributions: Array
    residual: float
    origin: str

    @property
    def sensitivities(self) -> Array:
        """Change of each coefficient per unit of the component; root sum square of its errors."""
        if self.standard_uncertainty == 0.0:
            return np.zeros_like(self.contributions)
        return self.contributions / self.standard_uncertainty


@dataclass(frozen=True, slots=True, eq=False)
class MonteCarlo(EqualByContents, ReadByFields):
    """Propagation of distributions, JCGM 101; arrays have shape (q,).

    Attributes
    ----------
    trials : int
        Trials that were made.
    seed : int
        Seed of the random numbers.
    stable : bool
        Whether the results are stable to `tolerance`, JCGM 101, 7.9.
    value, standard_uncertainty : ndarray
        Mean and standard deviation of the trials.
    lower, upper : ndarray
        Ends of the probabilistically symmetric 95 % interval.
    numerical : ndarray
        Twice the standard deviation of the less certain end, by the batches of trials.
    tolerance : ndarray
        Numerical tolerance of a standard uncertainty to one significant digit, JCGM 101, 7.9.2.
    agrees : ndarray of bool
        Whether both ends of the linear interval lie within `tolerance` of these, clause 8.
    """

    trials: int
    seed: int
    stable: bool
    value: Array
    standard_uncertainty: Array
    lower: Array
    upper: Array
    numerical: Array
    tolerance: Array
    agrees: Mask

    @classmethod
    def of_budget(cls, document: Document) -> MonteCarlo | None:
        """Read it from the document of its budget, None where that has none."""
        own = checked(document, "monte_carlo", lambda value: value)
        if own is None:
            return None
        tried = partial(column, document, "coefficients", "monte_carlo")
        names = ("value", "standard_uncertainty", "numerical", "tolerance")
        return cls._of_fields(
            own,
            **{name: tried(name) for name in names},
            lower=tried("low"),
            upper=tried("high"),
            agrees=tried("agrees", kind=flag),
        )

    def at(self, place: int) -> dict[str, Any]:
        """Return what it tells of one coefficient, as it stands in the JSON document."""
        return {
            **members_at(self, "value standard_uncertainty", place),
            "low": float(self.lower[place]),
            "high": float(self.upper[place]),
            **members_at(self, "numerical tolerance", place),
            "agrees": bool(self.agrees[place]),
        }


@dataclass(frozen=True, slots=True, eq=False)
class StandBudget(EqualByContents, StoredResult, TabularResult):
    """Uncertainty of q coefficients by the stand; arrays have shape (q,).

    Attributes
    ----------
    stand, source : str
        Name of the stand, and where it is described.
    test : str
        The test, in words.
    coefficients : tuple of BudgetedCoefficient
        What the budget is made for.
    nominal : ndarray
        Estimates without any error.
    components : tuple of StandShare
        The components.
    standard_uncertainty, dof, coverage_factor, expanded_uncertainty : ndarray
        Combined standard uncertainty, effective degrees of freedom (Welch-Satterthwaite),
        Student's factor, and the half width of the 95 % interval.
    covariance : ndarray, shape (q, q)
        Covariance.
    monte_carlo : MonteCarlo or None
        Propagation of distributions, where asked for.
    warnings : tuple of str
        What a reader must know.
    requirements : Requirements or None
        What the instruments must be, where targets were given.
    data_sheet : tuple of Sufficiency
        Limits of a data sheet against the uncertainties, where one was given.

    Examples
    --------
    >>> import accelcal
    >>> gain = accelcal.distribution("rectangular", half_width=30e-6)
    >>> stand = accelcal.Stand(
    ...     "voltmeter alone", [accelcal.StandComponent("gain", "voltmeter-gain", gain)]
    ... )
    >>> found = accelcal.stand_budget(stand, accelcal.simulate(seed=1))
    >>> found.expanded_uncertainty.shape == (len(found.coefficients),)
    True
    """

    SCHEMA: ClassVar[str] = "accelcal/stand-budget/1"
    _WRITER: ClassVar[str] = "accelcal budget"
    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"components": list_of(StandShare._of_fields)}

    stand: str
    source: str
    test: str
    coefficients: tuple[BudgetedCoefficient, ...]
    nominal: Array
    components: tuple[StandShare, ...]
    standard_uncertainty: Array
    dof: Array
    coverage_factor: Array
    expanded_uncertainty: Array
    covariance: Array
    monte_carlo: MonteCarlo | None = None
    warnings: tuple[str, ...] = ()
    requirements: Requirements | None = None
    data_sheet: tuple[Sufficiency, ...] = ()

    def __repr__(self) -> str:
        return visible(
            f"<StandBudget {self.stand}: {len(self.components)} components,"
            f" {len(self.coefficients)} coefficients>"
        )

    @property
    def plot(self) -> StandBudgetPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.stand_budget import StandBudgetPlot

        return StandBudgetPlot(self)

    def index(self, symbol: str) -> int | None:
        """Find a coefficient of the table nearest to T0, or a slope.

        Parameters
        ----------
        symbol : str
            Its symbol, such as ``"k0"`` or ``"lam1"``.

        Returns
        -------
        int or None
            Its place in `coefficients`; None where there is none.
        """
        found = (i for i, c in enumerate(self.coefficients) if c.symbol == symbol)
        return next(found, None)

    def contribution(self, symbol: str) -> Mapping[str, float]:
        """Standard uncertainty of one coefficient by each component.

        Parameters
        ----------
        symbol : str
            Symbol of the coefficient in the table nearest to T0, such as ``"k0"``, or of a slope.

        Returns
        -------
        mapping of str to float
            Name of a component -> what it contributes, in the unit of the coefficient.

        Raises
        ------
        InputError
            If the symbol is not budgeted.
        """
        check_choice(tuple(dict.fromkeys(c.symbol for c in self.coefficients)), symbol=symbol)
        place = self.index(symbol) or 0
        return {part.name: abs(float(part.contributions[place])) for part in self.components}

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "stand source test"),
            "interval_level": LEVEL,
            "coefficients": [self._coefficient(i) for i in range(len(self.coefficients))],
            "components": [self._component(part) for part in self.components],
            "covariance": self.covariance.tolist(),
            "monte_carlo": self.monte_carlo and members(self.monte_carlo, "trials seed stable"),
            **members(self, "requirements data_sheet warnings"),
        }

    def _coefficient(self, i: int) -> dict[str, Any]:
        own = self.coefficients[i]
        return {
            **own.to_document(),
            "value": float(self.nominal[i]),
            **members_at(self, "standard_uncertainty", i),
            "dof": finite_or_none(self.dof[i]),
            **members_at(self, "coverage_factor expanded_uncertainty", i),
            "monte_carlo": self.monte_carlo and self.monte_carlo.at(i),
        }

    def _component(self, part: StandShare) -> dict[str, Any]:
        return {
            **members(part, "name kind standard_uncertainty unit"),
            "dof": finite_or_none(part.dof),
            **members(part, "varies errors averages fixed"),
            "acts": acts(self, part),
            "residual": finite_or_none(part.residual),
            "contributions": part.contributions.tolist(),
            "sensitivities": part.sensitivities.tolist(),
            "origin": part.origin,
        }

    @classmethod
    def _read(cls, document: Document) -> StandBudget:
        found = partial(column, document, "coefficients")
        names = ("standard_uncertainty", "coverage_factor", "expanded_uncertainty")
        whole = cls._of_fields(
            document,
            nominal=found("value"),
            **{name: found(name) for name in names},
            dof=found("dof", kind=freedom),
            covariance=np.array(checked(document, "covariance", symmetric)),
            monte_carlo=MonteCarlo.of_budget(document),
        )
        sizes = {len(whole.covariance), *(part.contributions.size for part in whole.components)}
        if sizes - {whole.nominal.size}:
            raise DamageError("no number for each coefficient", "components")
        return whole

    def rows(self) -> list[dict[str, Any]]:
        """List coefficients by components, a flat dictionary each; totals follow the components."""
        return [row for i in range(len(self.coefficients)) for row in self._rows(i)]

    def _rows(self, i: int) -> Iterator[dict[str, Any]]:
        own, u = self.coefficients[i], float(self.standard_uncertainty[i])
        place = {"coefficient": own.symbol, "where": own.where, "unit": own.unit}
        for part in self.components:
            size = abs(float(part.contributions[i]))
            of_part = {
                "component": part.name,
                "sensitivity": float(part.sensitivities[i]),
                "standard_uncertainty": size,
                "share": (size / u) ** 2 if u > 0.0 else 0.0,
            }
            yield place | of_part | dict.fromkeys(_OF_TOTAL)
        whole = {"component": "total", "sensitivity": None, "standard_uncertainty": u, "share": 1.0}
        trials = self.monte_carlo
        known = [self.expanded_uncertainty[i], self.dof[i]]
        known += [] if trials is None else [trials.lower[i], trials.upper[i], trials.agrees[i]]
        found = dict(zip(_OF_TOTAL, (value.item() for value in known), strict=False))
        yield place | whole | dict.fromkeys(_OF_TOTAL) | found


def acts(budget: StandBudget, part: StandShare) -> bool:
    """Whether a component acts on a coefficient of its budget, beside what the others do."""
    return bool(np.any(np.abs(part.contributions) > FELT * budget.standard_uncertainty))
