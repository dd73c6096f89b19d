"""Pictures of the budget of a stand, as ``budget.plot``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from accelcal.results.stand_budget import StandBudget

__all__ = ["StandBudgetPlot"]


@dataclass(frozen=True, slots=True)
class StandBudgetPlot:
    """Pictures of the budget of a stand.

    Each method draws into the matplotlib axes that it is given, or makes a figure of its own, and
    returns the axes. `accelcal.plot.style.theme` chooses dark colours.

    Attributes
    ----------
    budget : StandBudget
        The budget.
    """

    budget: StandBudget

    def pareto(self, axes: Any = None) -> Any:
        """Draw what each component does to each coefficient, the largest first.

        Parameters
        ----------
        axes : array-like of Axes, optional
            As many axes as coefficients are drawn: K1, the error model and the slopes.

        Returns
        -------
        ndarray of Axes
            A Pareto chart for each coefficient.
        """
        from accelcal.plot.stand_pareto import stand_pareto

        return stand_pareto(self.budget.to_document(), axes)
