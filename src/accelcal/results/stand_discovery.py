"""What several units tell of their stand: whose each effect is, the head, what it gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from accelcal.escapes import visible
from accelcal.results.discovery import Discovery
from accelcal.results.documents.checked import Kind, one_of
from accelcal.results.documents.fields import StoredPart, members
from accelcal.results.documents.stored import StoredResult, part_of
from accelcal.results.findings import Change
from accelcal.results.quantity import Quantity
from accelcal.results.tabular import COLUMNS_OF_A_SIZE, TabularResult

if TYPE_CHECKING:
    from os import PathLike

    from accelcal.plot.stand_discovery import StandPlot

__all__ = ["VERDICTS", "HeadPosition", "StandDiscovery", "StandEffect"]

VERDICTS = ("stand", "unit", "undecided")


@dataclass(frozen=True, slots=True)
class StandEffect(StoredPart):
    """An effect that was found over several units.

    Attributes
    ----------
    id, name : str
        Its id and name in the catalogue.
    verdict : {"stand", "unit", "undecided"}
        Whose it is.
    parameters : mapping of str to Quantity
        Its parameters, if all units share them; else none.
    p_value : float
        Chance that noise makes any effect of the catalogue look as needed.
    p_one_value : float
        Chance that units with one size differ as much.
    spread : float
        Upper 95 % limit of the standard deviation from unit to unit, over the size.
    sizes : mapping of str to Quantity
        Size in each unit; its uncertainty is without the errors of the head, which all share.
    found_in : tuple of str
        Units that have it alone.
    indistinguishable : tuple of str
        Ids of effects that explain these readings too.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"verdict": one_of(*VERDICTS)}

    id: str
    name: str
    verdict: str
    parameters: Mapping[str, Quantity]
    p_value: float
    p_one_value: float
    spread: float
    sizes: Mapping[str, Quantity]
    found_in: tuple[str, ...]
    indistinguishable: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class HeadPosition(StoredPart):
    """Error of one head position, as all units together tell it.

    Attributes
    ----------
    angle_deg : float
        Nominal head angle [deg].
    error : Quantity
        True minus nominal [rad]; what looks like coefficients in every unit is as uncertain as
        declared.
    """

    angle_deg: float
    error: Quantity


@dataclass(frozen=True, slots=True)
class StandDiscovery(StoredResult, TabularResult):
    """What was discovered over several units of one stand.

    Attributes
    ----------
    units : tuple of str
        Their serial numbers, or where their readings came from.
    effects : tuple of StandEffect
        Effects, those of the stand first.
    head : tuple of HeadPosition
        Head positions; empty where their uncertainty is not declared, or zero.
    coefficients : mapping of str to tuple of Change
        For each unit its coefficients: `before` with the stand fitted from its own readings,
        `after` with the stand fitted jointly; empty where there is nothing to share.
    common : Discovery
        What was discovered in the mean of the units.
    notes : tuple of str
        What a reader must know.
    doubtful : tuple of str
        Ids of effects of which something else could be the cause, such as another head; the
        notes tell what.
    alpha : float
        False-alarm rate over all units and all that was searched.

    Examples
    --------
    >>> import accelcal
    >>> backlash = [accelcal.effect("backlash").of(2e-5)]
    >>> same = accelcal.NoiseComponents(head=0.0)
    >>> records = [accelcal.simulate(noise=same, effects=backlash, seed=n) for n in (1, 2, 3)]
    >>> accelcal.discover_stand(records)
    <StandDiscovery of 3 units: backlash (stand)>
    """

    SCHEMA: ClassVar[str] = Discovery.SCHEMA
    _SEVERAL: ClassVar[str] = Discovery._SEVERAL
    _WRITER: ClassVar[str] = Discovery._WRITER

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"common": partial(part_of, Discovery)}
    _MISSING: ClassVar[Mapping[str, Any]] = {"notes": (), "alpha": 0.01, "doubtful": ()}

    units: tuple[str, ...]
    effects: tuple[StandEffect, ...]
    head: tuple[HeadPosition, ...]
    coefficients: Mapping[str, tuple[Change, ...]]
    common: Discovery
    notes: tuple[str, ...] = ()
    alpha: float = 0.01
    doubtful: tuple[str, ...] = ()

    def __repr__(self) -> str:
        found = ", ".join(f"{item.id} ({item.verdict})" for item in self.effects)
        return visible(f"<StandDiscovery of {len(self.units)} units: {found or 'nothing'}>")

    @property
    def plot(self) -> StandPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.stand_discovery import StandPlot

        return StandPlot(self)

    def report(self, path: str | PathLike[str]) -> None:
        """Write a page that tells all of it, as HTML, Markdown or PDF.

        Parameters
        ----------
        path : path
            File to write, whole or not at all; it ends in .html, .md or .pdf.

        Raises
        ------
        InputError
            If the form is another, or jinja2, matplotlib or, for a PDF, a browser is missing.
        """
        from accelcal.page.write import write_report

        write_report([self], path)

    def _contents(self) -> dict[str, Any]:
        names = "units alpha effects head coefficients common notes doubtful"
        return members(self, names)

    _COLUMNS: ClassVar[Sequence[str]] = ("serial", "effect", "verdict", *COLUMNS_OF_A_SIZE)

    def rows(self) -> list[dict[str, Any]]:
        """List the size of each effect in each unit, a flat dictionary each."""
        return [
            {
                "serial": unit,
                "effect": effect.id,
                "verdict": effect.verdict,
                **size.to_document(),
                "p_value": effect.p_value,
            }
            for effect in self.effects
            for unit, size in effect.sizes.items()
        ]
