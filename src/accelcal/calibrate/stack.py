"""Records of one plan calibrated together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from accelcal.calibrate.head import at_true_angles
from accelcal.calibrate.known_effects import corrections, effects_component
from accelcal.calibrate.of_record import calibration_of_record, table_names
from accelcal.calibrate.options import TEMPERATURE_LAWS, Options
from accelcal.calibrate.plan import OnePlan
from accelcal.calibrate.weaknesses import Fitted, Warned, warnings_of
from accelcal.estimate.estimability import check_names
from accelcal.estimate.joint import JointStack, estimate_stack
from accelcal.estimate.tables import PreparedTable, prepare
from accelcal.estimate.uncertainty import Component
from accelcal.gates.record import RecordStack, gates_of_records
from accelcal.gates.stack import TableStack, of_one_plan
from accelcal.gates.table import gates_of_stack
from accelcal.gates.verdict import GateStack
from accelcal.grouping import median
from accelcal.record import TumbleRecord, naming
from accelcal.reference import fixture_angle, has_reference_temperature
from accelcal.results.calibration import Calibration
from accelcal.temperature.of_record import RecordLaws, StackLaws, laws_of_stack

if TYPE_CHECKING:
    from accelcal.discovery.correction import Correction

__all__ = ["CalibrationStack", "calibration_stack"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CalibrationStack:
    """Calibrations of R records of one plan.

    Attributes
    ----------
    plan : OnePlan
        The records with their readings.
    tables : sequence of PreparedTable
        The tables of the first record; of the others only the readings differ.
    estimate : JointStack
        Coefficients of all tables of all records, and the components of their errors.
    options : Options
        What was asked.
    delta0 : float
        Fixture angle that was taken as given [rad].
    known : tuple of Correction
        Effects that were taken out of each record; none without a model.
    given : OnePlan
        The records before that.
    """

    plan: OnePlan
    tables: Sequence[PreparedTable]
    estimate: JointStack
    options: Options
    delta0: float
    known: tuple[Correction, ...]
    given: OnePlan

    def __len__(self) -> int:
        return len(self.plan.records)

    def one(self, record: int) -> Calibration:
        """Return the calibration of one record.

        Parameters
        ----------
        record : int
            Its place in the stack.

        Returns
        -------
        Calibration
            As `accelcal.fit` gives it.
        """
        own = self.plan.records[record]
        parts = own.tables() if record else (table.record for table in self.tables)
        tables = [t._replace(record=r) for t, r in zip(self.tables, parts, strict=True)]
        gates = [tuple(g.gate(start + record) for g in found) for found, start in self.gates]
        estimate = self.estimate.one(record)
        known, laws = self._correction_of(record), self.laws_of(record)
        return calibration_of_record(own, tables, estimate, gates, self.options, known, laws)

    def _correction_of(self, record: int) -> Correction | None:
        """Effects that were taken out of one record, with the gaps before and after each."""
        if len(self.known) < 2:
            return next(iter(self.known), None)
        return corrections(self.given.of_records(np.array([record])), self.options, self.delta0)[0]

    def laws_of(self, record: int) -> RecordLaws | None:
        """Return the laws of one record; None where they take steps of their own.

        Parameters
        ----------
        record : int
            Its place in the stack.

        Returns
        -------
        RecordLaws or None
            The laws from its tables.
        """
        if self.is_alone or self.options.temperature_laws != TEMPERATURE_LAWS[0]:
            return None
        main, second = (
            laws.model(record) if laws is not None else None
            for laws in (self.laws.main, self.laws.second_axis)
        )
        known = main is not None and main.K1.at_T0 is not None
        heat = self.laws.of_tables
        return RecordLaws(main, second, heat.of(record) if heat is not None and known else None)

    @cached_property
    def is_alone(self) -> bool:
        """Whether the stack is of one record that no other can be stacked with."""
        return len(self) == 1 and not self.plan.can_be_stacked().all()

    @cached_property
    def references(self) -> Array:
        """T0 of each record, shape (R,); NaN where no temperature is known [degC]."""
        return self.plan.references(self.options.reference_temperature)

    @cached_property
    def laws(self) -> StackLaws:
        """Temperature laws of all records from their tables, unless the stack `is_alone`."""
        if self.options.method == "printed":  # laws of misprinted coefficients are no laws
            return StackLaws(None, None, None)
        temperatures = self.plan.temperatures
        return laws_of_stack(self.tables, self.estimate, temperatures, self.references)

    @cached_property
    def components(self) -> Mapping[str, Component]:
        """Components of the errors with those of the temperatures, unless the stack `is_alone`."""
        heat, own = self.laws.of_tables, self.estimate.components
        return own if heat is None else {**own, "temperature": heat}

    @property
    def warnings(self) -> Warned:
        """What a reader must know of each record and table, unless the stack `is_alone`."""
        options, records = self.options, self.plan.records
        given = options.reference_temperature
        return warnings_of(
            Fitted(
                tables=self.tables,
                estimate=self.estimate,
                slopes=self.laws.slopes(len(self)),
                is_chosen=np.array([not has_reference_temperature(r, given) for r in records]),
                method=options.method,
                delta0=self.delta0,
                told_of_head=np.array([options.leaves_out(r) for r in records]),
            )
        )

    @cached_property
    def record_gates(self) -> tuple[GateStack, ...]:
        """Gates on what the tables of a record say together, unless the stack `is_alone`."""
        return gates_of_records(RecordStack.of(self.estimate, table_names(self.tables)))

    @cached_property
    def gates(self) -> list[tuple[Sequence[GateStack], int]]:
        """Gates of each table, and where the records begin in them."""
        found: dict[int, tuple[Sequence[GateStack], int]] = {}
        for places in of_one_plan(self.tables):
            gates = gates_of_stack(self._table_stack(places), len(self.tables))
            found |= {table: (gates, i * len(self)) for i, table in enumerate(places)}
        return [found[table] for table in range(len(self.tables))]

    def _table_stack(self, places: Sequence[int]) -> TableStack:
        """Tables of one plan in all records, table after table."""
        noises = [self.estimate.noises[t] for t in places]
        scatter = [median(self.tables[t].scatter) for t in places]
        step = self.plan.records[0].apparatus.resolution
        rows = len(self) * len(places)
        plan, count = self.plan, len(self)  # not self: its gates hold what tells the lines
        return TableStack(
            table=self.tables[places[0]],
            output=np.ascontiguousarray(np.concatenate([self.plan.outputs[t] for t in places]).T),
            coefficients=np.concatenate([self.estimate.judged[t] for t in places]),
            noise=np.concatenate([noise.factor for noise in noises]),
            noise_dof=np.concatenate([noise.dof for noise in noises]),
            declared=np.concatenate([noise.source == "declared" for noise in noises]),
            scatter=np.repeat(scatter, len(self)),
            step=np.full(rows, np.nan if step is None else step),
            time=self.plan.times(places),
            line=lambda index: plan.line(places[index // count], index % count),
            delta0=self.delta0,
        )


def calibration_stack(plan: OnePlan, options: Options) -> CalibrationStack:
    """Calibrate records of one plan.

    Parameters
    ----------
    plan : OnePlan
        The records; one that told of a known head is alone, as its head is that of the others.
    options : Options
        What is asked.

    Returns
    -------
    CalibrationStack
        Their calibrations.

    Raises
    ------
    InputError
        If the method is unknown, or the readings are none of an accelerometer.
    DesignError
        If the angles do not allow what is asked.
    """
    record = plan.records[0]
    delta0 = fixture_angle(record, options.delta0)
    head = options.head_for(record)
    if head is not None:
        plan = at_true_angles(plan, head, _prepared(record, delta0, options), delta0)
        record = plan.records[0]
    given, known = plan, corrections(plan, options, delta0)
    plan = OnePlan.of([item.record for item in known]) if known else plan
    tables = _prepared(plan.records[0], delta0, options)
    with naming(record):
        estimate = estimate_stack(
            tables,
            plan.outputs,
            plan.levels,
            record.apparatus,
            method=options.method,
            robust=options.robust,
            delta0=delta0,
            head=head,
        )
    if known:
        of_effects = effects_component(tables, known, options.method, delta0)
        estimate = estimate._replace(components={**estimate.components, "effects": of_effects})
    return CalibrationStack(plan, tables, estimate, options, delta0, known, given)


def _prepared(record: TumbleRecord, delta0: float, options: Options) -> list[PreparedTable]:
    check_names(options.coefficients)  # no table is at fault
    found = []
    for table in record.tables():
        with naming(table):
            asked, strict = options.coefficients, options.strict
            found.append(prepare(table, delta0=delta0, asked=asked, strict=strict))
    return found
