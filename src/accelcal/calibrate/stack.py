"""Records of one plan calibrated together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from accelcal.arrays import Array
from accelcal.calibrate.known_effects import corrections, effects_components, to_coefficients
from accelcal.calibrate.of_record import TableQuantities, calibration_of_record, table_quantities
from accelcal.calibrate.options import TEMPERATURE_LAWS, Options
from accelcal.calibrate.plan import OnePlan
from accelcal.calibrate.weaknesses import Warned, warnings_of
from accelcal.estimate.estimability import check_names
from accelcal.estimate.joint import JointEstimate, estimate_stack
from accelcal.estimate.tables import PreparedTable, prepare
from accelcal.estimate.uncertainty import Component
from accelcal.gates.record import RecordStack, gates_of_records, gates_of_stack
from accelcal.gates.stack import TableStack, of_one_plan
from accelcal.gates.verdict import GateStack
from accelcal.record import TumbleRecord, naming
from accelcal.reference import fixture_angle
from accelcal.results.calibration import Calibration
from accelcal.results.temperature import TemperatureModel
from accelcal.temperature.laws import StackLaws, laws_of_stack, with_misalignment
from accelcal.temperature.levels import AtRest, RecordedTemperatures

if TYPE_CHECKING:
    from accelcal.discovery.in_use.correction import Correction

_MISPRINTED = "printed"
"""The method whose coefficients are misprinted: no temperature law is fitted to them."""


@dataclass(frozen=True)
class CalibrationStack:
    """Calibrations of R records of one plan.

    Attributes
    ----------
    plan : OnePlan
        The records with their readings.
    tables : sequence of PreparedTable
        The tables of the first record; of the others only the readings differ.
    estimate : JointEstimate
        Coefficients of all tables of all records, and the components of their errors.
    options : Options
        What was asked.
    delta0 : float
        Fixture angle that was taken as given [rad].
    known : tuple of Correction
        Effects that were taken out of each record; none without a model.
    given : OnePlan
        The records before that.
    at_rest : AtRest
        Readings of runs whose temperature moved, brought to its mean; they are those of `plan`.
    moving : tuple of ndarray, shape (R, n)
        Readings before that, as they are fitted.
    """

    plan: OnePlan
    tables: Sequence[PreparedTable]
    estimate: JointEstimate
    options: Options
    delta0: float
    known: tuple[Correction, ...]
    given: OnePlan
    at_rest: AtRest
    moving: tuple[Array, ...]

    def __len__(self) -> int:
        return len(self.plan.records)

    def one(self, record: int) -> Calibration:
        """Return the calibration of one record."""
        if self.plan.there is not None:
            alone = self.plan.of_records(np.array([record]))
            return calibration_stack(alone, self.options).one(0)
        return calibration_of_record(self, record)

    def tables_of(self, record: int) -> list[PreparedTable]:
        """Tables of one record, with the readings that are fitted."""
        own = self.plan.records[record]
        parts = own.tables() if record else [table.record for table in self.tables]
        if self.at_rest.said[record]:
            outputs = [y[record] for y in self.plan.outputs]
            parts = [replace(r, output=y) for r, y in zip(parts, outputs, strict=True)]
        return [t._replace(record=r) for t, r in zip(self.tables, parts, strict=True)]

    def correction_of(self, record: int) -> Correction | None:
        """Effects that were taken out of one record, with the gaps before and after each."""
        if len(self.known) < 2:
            return next(iter(self.known), None)
        return corrections(self.given.of_records(np.array([record])), self.options, self.delta0)[0]

    def laws_of(self, record: int) -> tuple[TemperatureModel | None, TemperatureModel | None]:
        """Return the laws of one record, of its main and of its second axis.

        They are from its tables, those of the main axis from its readings where these are asked
        for; None where there is one level only.
        """
        main, second = (
            laws.model(record) if laws is not None else None
            for laws in (self.laws.main, self.laws.second_axis)
        )
        if main is not None and main.K1.at_T0 is not None and self._laws_of_readings:
            main = self._from_readings(record, main)
        names = self.unbounded[record]
        return main and main.without_bound(names), second and second.without_bound(names)

    def _from_readings(self, record: int, laws: TemperatureModel) -> TemperatureModel:
        from accelcal.temperature.from_readings import laws_from_readings

        moving = self.estimate._replace(outputs=self.moving)
        tables = self.tables_of(record)
        of_effects = partial(self._of_effects, record)
        found = laws_from_readings(tables, moving, self.temperatures, record, laws, of_effects)
        return with_misalignment(found, laws) if self.laws.is_free else found

    def _of_effects(
        self, record: int, through: Array, chosen: Sequence[int]
    ) -> Mapping[str, Component]:
        """Pass the errors of the effects in the readings of some tables through an estimator."""
        if not self.known:
            return {}
        rows = np.concatenate([np.flatnonzero(self.plan.masks[i]) for i in chosen])
        found = effects_components([self.known[record]], lambda changes: through @ changes[:, rows])
        return {name: Component(own.covariance[0], own.dof[0]) for name, own in found.items()}

    @property
    def _laws_of_readings(self) -> bool:
        return self.options.temperature_laws != TEMPERATURE_LAWS[0]

    @cached_property
    def references(self) -> Array:
        """T0 of each record, shape (R,); NaN where no temperature is known [degC]."""
        return self.plan.references(self.options.reference_temperature)

    @property
    def temperatures(self) -> RecordedTemperatures:
        """Temperatures of all records."""
        return RecordedTemperatures(self.plan.recorded, self.plan.levels, self.references)

    @cached_property
    def laws(self) -> StackLaws:
        """Temperature laws of all records from their tables."""
        if self.options.method == _MISPRINTED:
            return StackLaws(None, None, None)
        return laws_of_stack(self.tables, self.estimate, self.temperatures, self.at_rest.unfelt)

    @cached_property
    def told_laws(self) -> StackLaws:
        """Laws as `laws_of` tells them, from the readings where these are asked for."""
        laws, is_open = self.laws, any(self.unbounded)
        if not (is_open or self._laws_of_readings):
            return laws
        main, second = zip(*map(self.laws_of, range(len(self))), strict=True)
        return laws._replace(
            main=laws.main and laws.main.told_by(main),
            second_axis=laws.second_axis and laws.second_axis.told_by(second),
        )

    @cached_property
    def stated(self) -> JointEstimate:
        """The estimate with what errors of the temperature do to the coefficients."""
        heat, components = self.laws.of_tables, self.estimate.components
        own = {} if heat is None else {"temperature": heat}
        return self.estimate._replace(components={**components, **own})

    @cached_property
    def quantities(self) -> TableQuantities:
        """Coefficients and error models of all tables with their uncertainties."""
        known, unit = self.stated, self.plan.records[0].unit
        found = table_quantities(known.names, known.coefficients, known.components, unit)
        for names in set(self.unbounded) - {()}:
            records = np.array([own == names for own in self.unbounded])
            found = found.unbounded(records, names)
        return found

    @cached_property
    def unbounded(self) -> Sequence[tuple[str, ...]]:
        """Coefficients of each record of which nothing bounds the error that effects leave."""
        return [item.unbounded for item in self.known] or [()] * len(self)

    @cached_property
    def warnings(self) -> Warned:
        """What a reader must know of each record and table."""
        return warnings_of(self)

    @cached_property
    def record_gates(self) -> tuple[GateStack, ...]:
        """Gates on what the tables of a record say together."""
        plan = self.plan
        stack = RecordStack.of(self.estimate, self.tables, plan.levels, plan.run_labels)
        return gates_of_records(stack)

    @cached_property
    def gates(self) -> list[list[GateStack]]:
        """Gates of each table, in all records."""
        found: dict[int, list[GateStack]] = {}
        for places in of_one_plan(self.tables):
            gates = gates_of_stack(self._table_stack(places), len(self.tables))
            for start, table in enumerate(places):
                own = start * len(self), (start + 1) * len(self)
                found[table] = [gate.part(*own) for gate in gates]
        return [found[table] for table in range(len(self.tables))]

    def _table_stack(self, places: Sequence[int]) -> TableStack:
        """Tables of one plan in all records, table after table."""
        noises = [self.estimate.noises[t] for t in places]
        scatter = [self.tables[t].usual_scatter for t in places]
        # `line` below must not hold self: self keeps its gates, and they keep `line`. Such a circle
        # would stay in memory until the garbage collector comes.
        plan, count = self.plan, len(self)
        step = plan.records[0].apparatus.resolution
        gaps = plan.there
        return TableStack(
            table=self.tables[places[0]],
            output=np.ascontiguousarray(np.concatenate([plan.outputs[t] for t in places]).T),
            coefficients=np.concatenate([self.estimate.judged[t] for t in places]),
            noise=np.concatenate([noise.factor for noise in noises]),
            noise_dof=np.concatenate([noise.dof for noise in noises]),
            declared=np.concatenate([noise.source == "declared" for noise in noises]),
            scatter=np.repeat(scatter, count),
            digit=np.concatenate([self.estimate.steps[t] for t in places]),
            step=np.full(count * len(places), np.nan if step is None else step),
            time=plan.times(places),
            there=None if gaps is None else np.concatenate([gaps[t] for t in places]),
            alone=None if gaps is None else self._alone(places),
            line=lambda index: plan.line(places[index // count], index % count),
            delta0=self.delta0,
        )

    def _alone(self, places: Sequence[int]) -> Callable[[int], TableStack]:
        """What gives the stack of one table in one record, of tables with gaps."""
        # neither does this hold self
        estimate, records, count = self.estimate, self.plan.records, len(self)
        delta0, options = self.delta0, self.options

        @cache
        def prepared(row: int) -> list[PreparedTable]:
            return _prepared(records[row], delta0, options)

        def stack(index: int) -> TableStack:
            t, row = places[index // count], index % count
            noise = estimate.noises[t].of_records(row)
            return TableStack.of([prepared(row)[t]], [estimate.judged[t][row]], [noise], delta0)

        return stack


def calibration_stack(plan: OnePlan, options: Options) -> CalibrationStack:
    """Calibrate records of one plan.

    One that told of a known head is alone, as its head is that of the others.

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
        plan = plan.at_true_angles(head, _prepared(record, delta0, options), delta0)
    given, known = plan, corrections(plan, options, delta0)
    plan = OnePlan.of([item.record for item in known]) if known else plan
    tables = _prepared(plan.shared, delta0, options)
    if plan.there is not None:
        tables = list(map(PreparedTable.with_gaps, tables, plan.there))
    estimate = _estimate(plan, tables, options, delta0, known)
    at_rest, moving = _at_rest(plan, tables, estimate, options), estimate.outputs
    if any(at_rest.said):
        plan = plan._replace(outputs=at_rest.outputs)
        estimate = _estimate(plan, tables, options, delta0, known)
    return CalibrationStack(plan, tables, estimate, options, delta0, known, given, at_rest, moving)


def _estimate(
    plan: OnePlan,
    tables: Sequence[PreparedTable],
    options: Options,
    delta0: float,
    known: Sequence[Correction],
) -> JointEstimate:
    record = plan.records[0]
    with naming(record):
        estimate = estimate_stack(
            tables,
            plan.outputs,
            plan.levels,
            record.apparatus,
            method=options.method,
            robust=options.robust,
            delta0=delta0,
            head=options.head_for(record),
        )
    if not known:
        return estimate
    passed = to_coefficients(tables, plan.masks, options.method, delta0)
    of_effects = effects_components(known, passed)
    return estimate._replace(components={**estimate.components, **of_effects})


def _at_rest(
    plan: OnePlan, tables: Sequence[PreparedTable], estimate: JointEstimate, options: Options
) -> AtRest:
    if options.method == _MISPRINTED or not plan.moves():
        return AtRest.of(plan.outputs)
    from accelcal.temperature.felt_deviations import brought_to_rest

    reference = plan.references(options.reference_temperature)
    temperatures = RecordedTemperatures(plan.recorded, plan.levels, reference)
    return brought_to_rest(tables, estimate, plan.outputs, temperatures, plan.run_labels)


def _prepared(record: TumbleRecord, delta0: float, options: Options) -> list[PreparedTable]:
    check_names(options.coefficients)  # first, as no table is to be named for a wrong one
    found = []
    for table in record.tables():
        with naming(table):
            asked, strict = options.coefficients, options.strict
            found.append(prepare(table, delta0=delta0, asked=asked, strict=strict))
    return found
