"""Warnings of the records of a stack: the sentences of a fit, without making each calibration."""

from __future__ import annotations

from collections.abc import Iterator

from accelcal.calibrate.of_record import warnings_of_record
from accelcal.calibrate.stack import CalibrationStack
from accelcal.results.quantity import Quantity
from accelcal.results.temperature import BilinearLaw, TemperatureModel
from accelcal.temperature.from_tables import LawsOfRecords
from accelcal.temperature.of_record import RecordLaws
from accelcal.weaknesses import table_warnings

__all__ = ["warnings_of"]


def warnings_of(stack: CalibrationStack) -> Iterator[tuple[tuple[str, ...], list[tuple[str, ...]]]]:
    """Say what a reader must know, record by record.

    Parameters
    ----------
    stack : CalibrationStack
        Calibrations, none of them alone.

    Yields
    ------
    tuple
        Sentences about the record, and about each of its tables.
    """
    # the sentences need the sources and sizes of the errors, but no matrix of them
    bare = stack.estimate._replace(
        outputs=(), coefficients=(), residuals=(), components={}, alike={}
    )
    options = stack.options
    for index, record in enumerate(stack.plan.records):
        estimate = bare.one(index)
        laws = stack.laws.main
        heat = stack.laws.of_tables if laws is not None and laws.group[index] >= 0 else None
        found = RecordLaws(_scale_factor_law(laws, index), None, heat)
        given = (options.reference_temperature, record.reference_temperature)
        said = warnings_of_record(
            record,
            stack.tables,
            estimate,
            found,
            given == (None, None),
            options.method,
            stack.delta0,
        )
        of_tables = map(table_warnings, stack.tables, estimate.noises)
        yield tuple(said), list(of_tables)


def _scale_factor_law(laws: LawsOfRecords | None, index: int) -> TemperatureModel | None:
    """What the sentences ask of the laws: whether there are any, and that of the scale factor."""
    if laws is None or laws.group[index] == -1:
        return None
    nothing = BilinearLaw(None, None, None)
    place = laws.names.index("K1 at_T0")
    value, standard = laws.value[index].tolist(), laws.standard[index].tolist()
    parts: list[Quantity | None] = [
        Quantity(value[i], _known(standard[i]), "") if value[i] == value[i] else None
        for i in range(place, place + 3)
    ]
    return TemperatureModel(nothing, BilinearLaw(*parts), nothing)


def _known(value: float) -> float | None:
    return value if value == value else None  # NaN is not itself
