"""The result of a discovery: where model and readings disagree, which effect, what it changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from accelcal.escapes import visible
from accelcal.results.calibration import Calibration
from accelcal.results.documents.checked import Kind, checked, or_none
from accelcal.results.documents.fields import Document, document_of, members
from accelcal.results.documents.stored import StoredResult, part_of
from accelcal.results.findings import (
    EMPIRICAL,
    Change,
    Detectable,
    Fault,
    FoundEffect,
    Gap,
    Share,
    Undetectable,
    Unexplained,
)
from accelcal.results.quantity import ErrorSource, sources_by_name
from accelcal.results.tabular import COLUMNS_OF_A_SIZE, TabularResult

if TYPE_CHECKING:
    from os import PathLike

    from accelcal.plot.discovery import DiscoveryPlot

__all__ = ["Discovery"]


IF_IT_IS = "if it is "
"""How a note begins that gives the coefficients for another explanation."""


def _gaps(document: Document) -> tuple[Gap, Gap]:
    before, after = (checked(document, name, Gap.from_document) for name in ("before", "after"))
    return before, after


@dataclass(frozen=True, slots=True)
class Discovery(StoredResult, TabularResult):
    """What was discovered in one record.

    Attributes
    ----------
    noise : tuple of ErrorSource
        Reading noise, head, launch and temperature, as they were taken.
    before, after : Gap
        Gap between model and readings without and with the effects.
    where : tuple of Share
        Factors of the disagreement.
    effects : tuple of FoundEffect
        Effects in the order found, which a model takes to other readings.
    unexplained : Unexplained or None
        What is left that no effect explains.
    undetectable : tuple of Undetectable
        Effects that this test cannot show.
    smallest_detectable : tuple of Detectable
        Sizes that it would show.
    faults : tuple of Fault
        Faults of the readings, which stay with them.
    coefficients : tuple of Change
        Coefficients of the model without and with the effects, over `scale_factor`.
    scale_factor : float
        K1 at T0 of the fit that the search started from [output unit / g].
    output_unit : str or None
        Unit of the output.
    next_measurement : str
        What to measure next; empty where nothing is open.
    notes : tuple of str
        What a reader must know.
    doubtful : tuple of str
        Ids of the effects of which something outside the catalogue could be the cause as well; the
        notes tell what.
    reservations : tuple of str
        What in the noise could be a disturbance, which the verdict adds where nothing shows.
    p_value : float
        Chance that noise alone disagrees as much with the model, over all that was searched.
    alpha : float
        False-alarm rate below which an effect is named.
    serial : str or None
        Serial number.
    T0_degC : float
        Reference temperature.
    delta0_rad : float
        Fixture angle.
    readings : int
        Number of readings.
    source, software : str
        Where the readings came from, and what looked at them.
    sha256 : str or None
        SHA-256 of the bytes of the source, in hexadecimal; None where not recorded.
    head_name, stand_name : str or None
        Names of the head and of the stand, by the lines ``# head: NAME`` and ``# stand: NAME``.
    calibration : Calibration or None
        Calibration from the same readings with these effects, which ``accelcal compare`` takes;
        None unless ``accelcal discover`` added it.

    Examples
    --------
    >>> import accelcal
    >>> hidden = [accelcal.effect("hysteresis").of(2e-5)]
    >>> found = accelcal.discover(accelcal.simulate(effects=hidden, seed=1))
    >>> found.effects[0].id, round(found.effects[0].parameters["half_width"].value, 5)
    ('hysteresis', 2e-05)
    >>> found.after.rms < found.before.rms
    True
    """

    SCHEMA: ClassVar[str] = "accelcal/discovery/1"
    _SEVERAL: ClassVar[str] = "discoveries"
    _WRITER: ClassVar[str] = "accelcal discover"

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {
        "noise": sources_by_name,
        "calibration": or_none(partial(part_of, Calibration)),
    }
    _MISSING: ClassVar[Mapping[str, Any]] = {
        **dict.fromkeys(("faults", "coefficients", "notes", "doubtful", "reservations"), ()),
        **dict.fromkeys(("output_unit", "serial", "sha256", "calibration")),
        **dict.fromkeys(("head_name", "stand_name")),
        **{"source": "<document>", "software": "", "next_measurement": "", "readings": 0},
        **{"scale_factor": 1.0, "p_value": 1.0, "alpha": 0.01, "T0_degC": 20.0, "delta0_rad": 0.0},
    }

    noise: tuple[ErrorSource, ...]
    before: Gap
    after: Gap
    where: tuple[Share, ...]
    effects: tuple[FoundEffect, ...]
    unexplained: Unexplained | None
    undetectable: tuple[Undetectable, ...]
    smallest_detectable: tuple[Detectable, ...]
    faults: tuple[Fault, ...] = ()
    coefficients: tuple[Change, ...] = ()
    scale_factor: float = 1.0
    output_unit: str | None = None
    next_measurement: str = ""
    notes: tuple[str, ...] = ()
    doubtful: tuple[str, ...] = ()
    reservations: tuple[str, ...] = ()
    p_value: float = 1.0
    alpha: float = 0.01
    serial: str | None = None
    T0_degC: float = 20.0
    delta0_rad: float = 0.0
    readings: int = 0
    source: str = "<table>"
    software: str = ""
    sha256: str | None = None
    head_name: str | None = None
    stand_name: str | None = None
    calibration: Calibration | None = None

    def __repr__(self) -> str:
        name = f"serial {self.serial}" if self.serial else self.source
        found = ", ".join(effect.id for effect in self.effects)
        open_end = "an effect that nothing explains" if self.unexplained else "nothing"
        found += f", {open_end}" * self.has_more
        faults = ", ".join(f"fault {fault.id}" for fault in self.faults)
        return visible(f"<Discovery {name}: {faults}{'; ' * bool(faults)}{found or open_end}>")

    @property
    def has_more(self) -> bool:
        """Whether the unexplained is left beside effects, none of which is a term for it."""
        known = [not effect.id.startswith(EMPIRICAL) for effect in self.effects]
        return self.unexplained is not None and bool(known) and all(known)

    @property
    def named(self) -> tuple[FoundEffect, ...]:
        """All entries of the catalogue that were found: faults of the readings, then `effects`.

        The gap of a fault is that of the readings as given, and of those with all faults mended.
        """
        mended = self.mended
        faults = (
            FoundEffect(
                id=fault.id,
                name=fault.name,
                parameters=fault.parameters,
                p_value=fault.p_value,
                gap_before=self.before.rms,
                gap_after=mended[0],
                heldout_before=self.before.heldout_rms,
                heldout_after=mended[1],
                indistinguishable=(),
                to_tell_apart="",
            )
            for fault in self.faults
            if fault.is_entry
        )
        return (*faults, *self.effects)

    @property
    def otherwise(self) -> tuple[str, ...]:
        """Those of `notes` that give the coefficients for what else the effects could be."""
        return tuple(note for note in self.notes if note.startswith(IF_IT_IS))

    @property
    def unbounded(self) -> tuple[str, ...]:
        """Coefficients that are found but have no uncertainty, as nothing bounds their error."""
        return tuple(
            change.coefficient
            for change in self.coefficients
            if change.after.value is not None and change.after.standard_uncertainty is None
        )

    @property
    def doubts(self) -> tuple[str, ...]:
        """Those of `notes` that name an effect which is `doubtful`."""
        return tuple(note for note in self.notes if any(name in note for name in self.doubtful))

    @property
    def changes_gap(self) -> bool:
        """Whether what was found, effects or faults of the readings, makes the gap another one."""
        return self.before != self.after

    @property
    def mended(self) -> tuple[float, float | None]:
        """Gap of all readings, and of those left out, with faults mended and no effect [g]."""
        if self.effects:
            return self.effects[0].gap_before, self.effects[0].heldout_before
        return self.after.rms, self.after.heldout_rms

    @property
    def plot(self) -> DiscoveryPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.discovery import DiscoveryPlot

        return DiscoveryPlot(self)

    def report(self, path: str | PathLike[str], record: Any = None) -> None:
        """Write a page that tells all of it, as HTML, Markdown or PDF.

        Parameters
        ----------
        path : path
            File to write, whole or not at all; it ends in .html, .md or .pdf.
        record : TumbleRecord, optional
            Its readings, over which the signatures of the effects are drawn.

        Raises
        ------
        InputError
            If the form is another, or jinja2, matplotlib or, for a PDF, a browser is missing.
        """
        from accelcal.page.write import write_report

        write_report([self], path, records=[record])

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "software source sha256 serial head_name stand_name"),
            **members(self, "T0_degC delta0_rad readings"),
            **members(self, "alpha p_value"),
            "noise": {source.name: source.to_document() for source in self.noise},
            "faults": document_of(self.faults),
            "gap": members(self, "before after"),
            "where": document_of(self.where),
            "effects": document_of(self.named),
            **members(self, "unexplained undetectable smallest_detectable scale_factor"),
            **members(
                self, "output_unit coefficients next_measurement notes doubtful reservations"
            ),
            **members(self, "calibration"),
        }

    @classmethod
    def _read(cls, document: Document) -> Discovery:
        before, after = checked(document, "gap", _gaps)
        found = cls._of_fields(document, before=before, after=after)
        of_readings = {fault.id for fault in found.faults}
        effects = tuple(effect for effect in found.effects if effect.id not in of_readings)
        return replace(found, effects=effects)

    _COLUMNS: ClassVar[Sequence[str]] = (
        "serial",
        "effect",
        "parameter",
        *COLUMNS_OF_A_SIZE,
        "gap_before_g",
        "gap_after_g",
    )

    def rows(self) -> list[dict[str, Any]]:
        """List the parameters of all that was named, a flat dictionary each."""
        return [
            {
                "serial": self.serial,
                "effect": effect.id,
                "parameter": name,
                **quantity.to_document(),
                "p_value": effect.p_value,
                "gap_before_g": effect.gap_before,
                "gap_after_g": effect.gap_after,
            }
            for effect in self.named
            for name, quantity in effect.parameters.items()
        ]
