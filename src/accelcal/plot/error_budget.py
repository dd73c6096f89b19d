"""Pictures of an error budget, as ``budget.plot``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from accelcal.results.error_budget import ErrorBudget

__all__ = ["ErrorBudgetPlot"]


@dataclass(frozen=True, slots=True)
class ErrorBudgetPlot:
    """Pictures of an error budget.

    Each method draws into the matplotlib axes that it is given, or makes a figure of its own, and
    returns the axes. `accelcal.plot.style.theme` chooses dark colours.

    Attributes
    ----------
    budget : ErrorBudget
        The budget.
    """

    budget: ErrorBudget

    def stack(self, axes: Any = None) -> Any:
        """Draw the components on top of one another, a bar a point.

        Parameters
        ----------
        axes : array-like of Axes, optional
            Three axes to draw into.

        Returns
        -------
        ndarray of Axes, shape (3,)
            Systematic parts, bounds of (4), and shares of the expanded uncertainty.
        """
        from accelcal.plot.budget_stack import budget_stack

        return budget_stack(self.budget.to_document(), axes)
