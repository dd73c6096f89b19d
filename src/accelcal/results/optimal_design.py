"""The best angles for a test, beside equally spaced tests of the same hours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from accelcal.arguments.options import check_choice
from accelcal.results.designs import DesignComparison, TestDesign
from accelcal.results.documents.checked import DamageError, Kind, mapping_of, size
from accelcal.results.documents.fields import Document, members
from accelcal.results.documents.stored import StoredResult, part_of
from accelcal.results.tabular import TabularResult

if TYPE_CHECKING:
    from accelcal.plot.designs import DesignPlot

__all__ = ["OptimalDesign"]


@dataclass(frozen=True, slots=True)
class OptimalDesign(StoredResult, TabularResult):
    """The best test for some hours.

    Attributes
    ----------
    criterion : str
        ``"D"``, ``"A"`` or a coefficient.
    comparison : DesignComparison
        The best test, then equally spaced ones.
    losses : mapping of str to float
        Name of each of them -> what was minimised, in proportion to standard uncertainties.
    spacing_deg : float
        Least distance of two positions [deg].
    seed : int
        Of the search.

    Examples
    --------
    >>> import accelcal
    >>> best = accelcal.optimal_design("K1", hours=4.0, temperatures=(20.0,))
    >>> best.best.hours <= 4.0
    True
    """

    SCHEMA: ClassVar[str] = "accelcal/optimal-design/1"
    _WRITER: ClassVar[str] = "accelcal design"
    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {
        "comparison": partial(part_of, DesignComparison),
        "losses": mapping_of(size),
    }

    criterion: str
    comparison: DesignComparison
    losses: Mapping[str, float]
    spacing_deg: float
    seed: int

    @property
    def designs(self) -> tuple[TestDesign, ...]:
        """The best test, then its rivals, in the order of `losses`."""
        return self.comparison.designs

    @property
    def best(self) -> TestDesign:
        """The best test."""
        return self.designs[0]

    def stops(self) -> tuple[tuple[float, int], ...]:
        """Angles of the best test [deg], and readings at each of them in a stroke."""
        angles = self.best.angles
        return tuple((angle, angles.count(angle)) for angle in dict.fromkeys(angles))

    def gain(self, rival: str) -> float:
        """Standard uncertainty of a rival over that of the best test, by the criterion.

        Parameters
        ----------
        rival : str
            A name among `losses`.

        Returns
        -------
        float
            1.1 where the rival is 10 % less certain.

        Raises
        ------
        InputError
            If there is no such rival.
        """
        check_choice(self.losses, rival=rival)
        return self.losses[rival] / self.losses["optimal"]

    @property
    def plot(self) -> DesignPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.designs import DesignPlot

        return DesignPlot(self)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "criterion spacing_deg seed"),
            "stops": [{"angle_deg": a, "readings": n} for a, n in self.stops()],
            "losses": dict(self.losses),
            "gains": {name: self.gain(name) for name in list(self.losses)[1:]},
            "comparison": self.comparison.to_document(),
        }

    @classmethod
    def _read(cls, document: Document) -> OptimalDesign:
        found = cls._of_fields(document)
        whole = len(found.losses) == len(found.designs) and "optimal" in found.losses
        if not whole or not all(found.losses.values()):
            raise DamageError("no loss above zero of each test", "losses")
        return found

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each coefficient of each test."""
        parts = zip(self.losses, self.comparison.rows_by_design(), strict=True)
        return [{"test": name, **row} for name, part in parts for row in part]

    def __repr__(self) -> str:
        return f"<OptimalDesign {self.criterion}: {len(self.stops())} angles, {self.best!r}>"
