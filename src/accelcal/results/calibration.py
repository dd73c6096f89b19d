"""The result of a fit: a frozen calibration to be printed, saved, read back and tabulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import TYPE_CHECKING, Any, ClassVar

from accelcal.arguments.kinds import expect
from accelcal.arguments.options import check_written
from accelcal.errors import InputError
from accelcal.escapes import visible
from accelcal.frozen_mapping import FrozenMapping
from accelcal.plural import counted
from accelcal.results import calibration_parts as parts
from accelcal.results.documents.checked import DamageError, Kind, checked, list_of, one_of, or_none
from accelcal.results.documents.fields import Document, members
from accelcal.results.documents.stored import StoredResult
from accelcal.results.fixture_angle import FixtureAngle
from accelcal.results.quantity import ErrorSource, Gate, Quantity
from accelcal.results.table import TableCalibration, mountings_of_laws, tells_laws
from accelcal.results.tabular import TabularResult
from accelcal.results.temperature import TemperatureModel

if TYPE_CHECKING:
    from os import PathLike

    from accelcal.plot.calibration import CalibrationPlot
    from accelcal.results.findings import FoundEffect
    from accelcal.results.verdict import Verdict

__all__ = ["Calibration"]

_NOISE = "reading"
"""Name of the noise of the readings among the sources of error, one for each table."""


@dataclass(frozen=True, slots=True)
class Calibration(StoredResult, TabularResult):
    """Calibration of one accelerometer from one record.

    Attributes
    ----------
    method : str
        The estimator.
    output_unit : str or None
        Unit of the output.
    tables : tuple of TableCalibration
        One a run and mounting.
    serial : str or None
        Serial number.
    g_local_m_s2 : float or None
        Local gravity [m/s^2]; None where not given.
    T0_degC : float or None
        Reference temperature.
    delta0_rad : float
        Fixture angle that the fit took as given.
    robust : bool
        Whether the readings were made safe against outliers.
    source : str
        Where the readings came from.
    date : str or None
        Date of the test.
    error_sources : tuple of ErrorSource
        Size of each source of error and how it is known.
    gates : tuple of Gate
        Checks of the record as a whole.
    warnings : tuple of str
        What a reader must know before using the numbers.
    software : str
        Name and version of what made the calibration.
    temperature_model : TemperatureModel or None
        Temperature laws; None where there is one level only.
    second_axis_model : TemperatureModel or None
        The same of the other axis along the shaft, from its tables; None where it was not measured
        at several levels.
    fixture_angle : tuple of FixtureAngle
        The angle of each axis of which both sides were measured, apart from the misalignment. The
        tables hold the effective misalignment, the temperature laws what is free of the angle.
    verdict : Verdict or None
        What was found against a data sheet; None where it was not judged.
    effects : tuple of FoundEffect
        Effects of a discovery that were taken out of the readings, with their sizes in this record.
    effects_as_found : tuple of str
        Ids of those that the readings do not show, which have the sizes that the discovery found.
    provenance : mapping
        SHA-256 of the input, its metadata, what was declared and asked; empty where unknown.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> accelcal.Calibration.from_json(calibration.to_json()) == calibration
    True
    """

    SCHEMA: ClassVar[str] = "accelcal/calibration/1"
    _SEVERAL: ClassVar[str] = "calibrations"
    _WRITER: ClassVar[str] = "accelcal fit"
    _REMEDIES: ClassVar[Mapping[str, str]] = {
        "accelcal/discovery/1": "use it by accelcal fit --model, and give what this writes",
        "accelcal/triad/1": "this is the calibration of a triad; give that of one accelerometer",
    }

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {
        "tables": list_of(TableCalibration.from_document, 1),
        "effects": list_of(parts.effect),
        "verdict": or_none(parts.verdict),
        "provenance": parts.provenance,
    }
    _MISSING: ClassVar[Mapping[str, Any]] = {
        **dict.fromkeys(("error_sources", "gates", "fixture_angle"), ()),
        **dict.fromkeys(("effects", "effects_as_found"), ()),
        **dict.fromkeys(("date", "second_axis_model", "verdict")),
        **{"source": "<document>", "software": "", "delta0_rad": 0.0, "robust": False},
        "provenance": FrozenMapping({}),
    }

    method: str
    output_unit: str | None
    tables: tuple[TableCalibration, ...]
    serial: str | None = None
    g_local_m_s2: float | None = None
    T0_degC: float | None = None
    delta0_rad: float = 0.0
    robust: bool = False
    source: str = "<table>"
    date: str | None = None
    error_sources: tuple[ErrorSource, ...] = ()
    gates: tuple[Gate, ...] = ()
    warnings: tuple[str, ...] = ()
    software: str = ""
    temperature_model: TemperatureModel | None = None
    second_axis_model: TemperatureModel | None = None
    fixture_angle: tuple[FixtureAngle, ...] = ()
    verdict: Verdict | None = None
    effects: tuple[FoundEffect, ...] = ()
    effects_as_found: tuple[str, ...] = ()
    provenance: FrozenMapping[Any] = FrozenMapping({})  # noqa: RUF009  (it is frozen)

    def __repr__(self) -> str:
        name = f"serial {self.serial}" if self.serial else self.source
        return visible(f"<Calibration {name}: {self.method}, {counted(len(self.tables), 'table')}>")

    @property
    def plot(self) -> CalibrationPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.calibration import CalibrationPlot

        return CalibrationPlot(self)

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

    def export(
        self, path: str | PathLike[str], *, form: str | None = None, run: str | int | None = None
    ) -> None:
        """Write the coefficients for navigation code, as a C header, YAML or CSV.

        Parameters
        ----------
        path : path
            File to write, whole or not at all.
        form : {"c", "yaml", "csv"}, optional
            The form; by default that of the file's extension: .h, .hpp, .yaml, .yml or .csv.
        run : str or int, optional
            Export the table of this run only.

        Raises
        ------
        InputError
            If the form is another, the calibration does not say which coefficients to use, or it
            has effects without which they do not give the acceleration.

        Warns
        -----
        AccelcalWarning
            About every coefficient that was not determined, and what is assumed in its place.
        """
        from accelcal.export.write import write_export

        write_export(self, path, form=form, run=run)

    def certificate(
        self, path: str | PathLike[str], laboratory: str | PathLike[str] | None = None
    ) -> None:
        """Write a digital calibration certificate (DCC) of the PTB.

        Parameters
        ----------
        path : path
            File to write, XML, whole or not at all.
        laboratory : path, optional
            TOML file of laboratory, customer and persons, such as ``examples/laboratory.toml``;
            without it they are not stated.

        Raises
        ------
        InputError
            If no day of the test is known, or the file of the laboratory breaks a rule.
        TableError
            If that file cannot be read.
        """
        from accelcal.certificate.dcc import write_certificate

        write_certificate(self, path, laboratory)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(self, "software method robust"),
            "acceleration_unit": "g_local",
            **members(self, "g_local_m_s2 output_unit serial date source T0_degC delta0_rad"),
            **members(self, "error_sources tables temperature_model second_axis_model"),
            **members(
                self, "fixture_angle effects effects_as_found gates warnings verdict provenance"
            ),
        }

    @classmethod
    def _read(cls, document: Document) -> Calibration:
        checked(document, "acceleration_unit", one_of("g_local"))
        found = cls._of_fields(document)
        if (found.temperature_model or found.second_axis_model) and found.T0_degC is None:
            raise DamageError("None in place of the temperature that the laws refer to", "T0_degC")
        parts.check_units(found)
        return found

    def of_mounting(self, mounting: str) -> Calibration:
        """Keep the tables of one mounting.

        Parameters
        ----------
        mounting : str
            One of `accelcal.geometry.MOUNTINGS`.

        Returns
        -------
        Calibration
            With the temperature laws, where they were made from this mounting: that of most tables.

        Raises
        ------
        InputError
            If there is no such table.
        """
        check_written(mounting=mounting)
        found = self._keeping([table.mounting == mounting for table in self.tables])
        if not found.tables:
            have = dict.fromkeys(table.mounting for table in self.tables)
            raise InputError(
                f"no table of mounting {mounting!r}; the calibration has {', '.join(have)}"
            )
        return replace(found, temperature_model=self._models().get(mounting))

    def of_run(self, run: str | int) -> Calibration:
        """Keep the tables of one run.

        Parameters
        ----------
        run : str or int
            Label of the run.

        Returns
        -------
        Calibration
            Without temperature laws, as they are made from several runs.

        Raises
        ------
        InputError
            If there is no such run.

        Examples
        --------
        >>> import accelcal
        >>> len(accelcal.fit(accelcal.simulate(seed=1)).of_run(2).tables)
        1
        """
        found = self._keeping([table.run == str(run) for table in self.tables])
        if not found.tables:
            have = ", ".join(dict.fromkeys(table.run for table in self.tables))
            raise InputError(f"no run {run!r} in the calibration; it has {have or 'none'}")
        return found

    def _keeping(self, kept: Sequence[bool]) -> Calibration:
        """Tables with the noise of their readings, without laws."""
        noises = compress(self.reading_noises, kept)
        others = (source for source in self.error_sources if source.name != _NOISE)
        return replace(
            self,
            tables=tuple(compress(self.tables, kept)),
            error_sources=(*noises, *others),
            temperature_model=None,
            second_axis_model=None,
        )

    @property
    def reading_noises(self) -> tuple[ErrorSource, ...]:
        """Noise of the readings of each table; empty where it is not told for each of them."""
        found = tuple(source for source in self.error_sources if source.name == _NOISE)
        return found if len(found) == len(self.tables) else ()

    @property
    def main_mounting(self) -> str:
        """Mounting of most tables with K0, K1 and M: `temperature_model` is made from these."""
        return self.mountings_of_laws[0]

    @property
    def second_mounting(self) -> str | None:
        """Mounting that `second_axis_model` is made from; None where one axis was measured."""
        return self.mountings_of_laws[1]

    @property
    def mountings_of_laws(self) -> tuple[str, str | None]:
        """Main and second mounting."""
        mountings = [table.mounting for table in self.tables]
        return mountings_of_laws(mountings, [tells_laws(table) for table in self.tables])

    def _models(self) -> dict[str, TemperatureModel | None]:
        """Temperature laws by the mounting that they are made from."""
        second = self.second_mounting
        found = {} if second is None else {second: self.second_axis_model}
        return {self.main_mounting: self.temperature_model, **found}

    def misalignment(self, table: TableCalibration) -> Quantity:
        """Misalignment at the level of a table, free of the fixture angle where that is known.

        Parameters
        ----------
        table : TableCalibration
            One of `tables`.

        Returns
        -------
        Quantity
            Its effective misalignment, where its axis was measured on one side only [rad].

        Raises
        ------
        InputError
            If it is something else.
        """
        expect(table, TableCalibration)
        for found in self.fixture_angle:
            if found.axis == table.mounting[0]:
                return found.nearest(table.temperature_degC)
        return table.error_model["delta"]

    def rows(self) -> list[dict[str, Any]]:
        """List all coefficients and temperature laws, a flat dictionary each.

        Returns
        -------
        list of dict
            Keys serial, run, mounting, temperature_degC, coefficient, value,
            standard_uncertainty, unit, expanded_uncertainty, dof, stands_for. The laws, of the
            second axis as well, are named as in ``"k0 above"`` and belong to no run.
        """
        of_tables = [
            self._row(name, quantity, table)
            for table in self.tables
            for name, quantity in table.quantities.items()
        ]
        return of_tables + [
            self._row(name, quantity, mounting)
            for mounting, laws in self._models().items()
            for name, quantity in (laws.quantities() if laws else ())
        ]

    def _row(self, name: str, quantity: Quantity, where: TableCalibration | str) -> dict[str, Any]:
        table = None if isinstance(where, str) else where
        return {
            "serial": self.serial,
            "run": table.run if table else None,
            "mounting": table.mounting if table else where,
            "temperature_degC": table.temperature_degC if table else self.T0_degC,
            "coefficient": name,
            **quantity.to_document(),
            "stands_for": table.meaning(name) if table else name,
        }
