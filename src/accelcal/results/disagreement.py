"""The result of a comparison: how far a calibration and a new record are apart, and where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from accelcal.escapes import visible
from accelcal.model import ERROR_UNITS
from accelcal.numerics.probability import written_p_value
from accelcal.results.agreement import explained_by_errors, hidden_by_errors, verdict_of
from accelcal.results.documents.checked import Kind, checked, member, number
from accelcal.results.documents.fields import Document, StoredPart, members
from accelcal.results.documents.stored import StoredResult
from accelcal.results.findings import Share
from accelcal.results.quantity import ErrorSource, Quantity, sources_by_name
from accelcal.results.tabular import TabularResult

if TYPE_CHECKING:
    from accelcal.plot.disagreement import DisagreementPlot

__all__ = ["SCHEMA", "Disagreement", "RunChange"]

SCHEMA = "accelcal/comparison/1"

QUANTITIES = ("bias", "scale_factor", "misalignment", "k2", "k3", "delta_ip")
"""What may change in a run, by its name in `RunChange`."""


@dataclass(frozen=True, slots=True)
class RunChange(StoredPart):
    """What has changed in one run since the calibration.

    Attributes
    ----------
    run : str
        Its label.
    temperature_degC : float or None
        Its temperature.
    rms : float
        Of reading minus simulation [g].
    bias, scale_factor, misalignment : Quantity
        Change of k0 [g], of K1 (relative) and of delta [rad]; without a value where the positions
        of the run do not tell it from the others.
    mounting : str
        Mounting; both sides of one axis where the run has both, as in ``"o+, o-"``.
    k2, k3, delta_ip : Quantity
        Change of k2 [g/g^2], of k3 [g/g^3] and of delta_ip [g/g^2]. In documents that do not have
        it there is no value, and what changed in them is in the others.
    """

    _MISSING: ClassVar[Mapping[str, Any]] = {
        name: Quantity(None, None, ERROR_UNITS[name]) for name in ("k2", "k3", "delta_ip")
    }

    run: str
    temperature_degC: float | None
    rms: float
    bias: Quantity
    scale_factor: Quantity
    misalignment: Quantity
    mounting: str
    k2: Quantity
    k3: Quantity
    delta_ip: Quantity

    @property
    def changes(self) -> tuple[Quantity, ...]:
        """Change of each of `QUANTITIES`."""
        return tuple(getattr(self, name) for name in QUANTITIES)


@dataclass(frozen=True, slots=True)
class Disagreement(StoredResult, TabularResult):
    """A record against what its calibration simulates.

    Attributes
    ----------
    rms : float
        Of reading minus simulation [g].
    reduced_chi2 : float
        Sum of squares in the measure of all that is uncertain, over the number of readings.
    p_value : float
        Chance that what is known to be uncertain makes any factor disagree, or anything in a run
        change, as much.
    where : tuple of Share
        Factors of the disagreement.
    structure : str
        What its largest significant part looks like; empty where there is none.
    runs : tuple of RunChange
        What has changed in each run.
    noise : tuple of ErrorSource
        What was taken as uncertain.
    same_head : bool or None
        Whether calibration and record were measured on one head, whose errors are common to both;
        None where nothing tells it.
    effects : tuple of str
        Ids of the effects that the calibration has.
    notes : tuple of str
        What a reader must know.
    explained_by : tuple of str
        Errors that nobody declared and the calibration does not tell, or from few degrees of
        freedom, as ``"launch_uncertainty"``, and coefficients that it does not determine, that may
        have made all differences; empty where they may not, or none is seen.
    serial : str or None
        Serial number.
    readings : int
        Number of readings.
    source, calibration, software : str
        Where the readings and the calibration came from, and what compared them.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> moved = [accelcal.effect("fixture-offset").of(1e-4)]
    >>> found = accelcal.compare(calibration, accelcal.simulate(effects=moved, seed=2))
    >>> found.verdict
    'disagree'
    """

    SCHEMA: ClassVar[str] = SCHEMA
    _WRITER: ClassVar[str] = "accelcal compare"
    _SEVERAL: ClassVar[str] = "comparisons"
    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"noise": sources_by_name}
    _MISSING: ClassVar[Mapping[str, Any]] = {"explained_by": ()}

    rms: float
    reduced_chi2: float
    p_value: float
    where: tuple[Share, ...]
    structure: str
    runs: tuple[RunChange, ...]
    noise: tuple[ErrorSource, ...]
    same_head: bool | None = None
    effects: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    explained_by: tuple[str, ...] = ()
    serial: str | None = None
    readings: int = 0
    source: str = "<table>"
    calibration: str = "<calibration>"
    software: str = ""

    def __repr__(self) -> str:
        worst = max(self.where, key=lambda share: share.share, default=None)
        told = f", mostly by {worst.factor}" if worst and self.structure else ""
        name = self.serial or self.source
        chance = written_p_value(self.p_value)
        return visible(f"<Disagreement {name}: {self.verdict}, {chance}{told}>")

    @property
    def verdict(self) -> str:
        """What it comes to: ``"agree"``, ``"disagree"`` or ``"no verdict"``."""
        return verdict_of(self.p_value, self.hidden_by, explained=bool(self.explained_by))

    @property
    def hidden_by(self) -> str:
        """Why there is no verdict: errors that may have made all, or hide disagreements."""
        return explained_by_errors(self.explained_by) or hidden_by_errors(self.noise)

    @property
    def run_names(self) -> list[str]:
        """Name of each of `runs`, with its mounting where there are several."""
        several = len({change.mounting for change in self.runs}) > 1
        return [f"{each.run}, {each.mounting}" if several else each.run for each in self.runs]

    @property
    def plot(self) -> DisagreementPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.disagreement import DisagreementPlot

        return DisagreementPlot(self)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "software source calibration serial readings"),
            "noise": {source.name: source.to_document() for source in self.noise},
            "same_head": self.same_head,
            "gap": members(self, "rms reduced_chi2"),
            **members(self, "verdict p_value explained_by where structure runs effects notes"),
        }

    @classmethod
    def _read(cls, document: Document) -> Disagreement:
        told = ("rms", "reduced_chi2")
        gap = {name: checked(document, "gap", member(name, number)) for name in told}
        return cls._of_fields(document, **gap)

    def rows(self) -> list[dict[str, Any]]:
        """List what has changed in each run, a flat dictionary each."""
        return [
            {
                "serial": self.serial,
                "run": change.run,
                "mounting": change.mounting,
                "temperature_degC": change.temperature_degC,
                "quantity": name,
                **quantity.to_document(),
            }
            for change in self.runs
            for name, quantity in zip(QUANTITIES, change.changes, strict=True)
        ]
