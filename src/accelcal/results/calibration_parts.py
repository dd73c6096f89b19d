"""Parts of the JSON document of a calibration, read and checked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from accelcal.frozen_mapping import FrozenMapping
from accelcal.results.documents.checked import (
    DamageError,
    Kind,
    checked,
    finite,
    list_of,
    mapping_of,
    number,
    text,
    text_or_none,
)

if TYPE_CHECKING:
    from accelcal.results.calibration import Calibration
    from accelcal.results.findings import FoundEffect
    from accelcal.results.quantity import Quantity
    from accelcal.results.temperature import TemperatureModel
    from accelcal.results.verdict import Verdict

_PROVENANCE: dict[str, Kind[Any]] = {
    "sha256": text_or_none,
    "metadata": mapping_of(text),
    "declared": mapping_of(number),
    "notes": list_of(text),
    "options": lambda part: any_object(part),  # defined below
}


def any_object(document: Any) -> FrozenMapping[Any]:
    """Take an object of any content that JSON may have."""
    return FrozenMapping(mapping_of(_anything)(document))


def _anything(part: Any) -> Any:
    if isinstance(part, Mapping):
        return any_object(part)
    if isinstance(part, list | tuple):
        return list_of(_anything)(part)
    return finite(part) if isinstance(part, float) else part


def provenance(document: Any) -> FrozenMapping[Any]:
    """Take what tells of the input, of which any part may be missing."""
    found = any_object(document)
    for name, kind in _PROVENANCE.items():
        checked(document, name, kind, None)
    return found


def effect(document: Any) -> FoundEffect:
    """Read an effect."""
    from accelcal.results.findings import FoundEffect  # here, as most calibrations have none

    return FoundEffect.from_document(document)


def verdict(document: Any) -> Verdict:
    """Read the verdict."""
    from accelcal.results.verdict import Verdict  # here, as most calibrations have none

    return Verdict.from_document(document)


def check_units(found: Calibration) -> None:
    """Refuse values in other units than those of the schema: nothing converts them."""
    for unit, quantity, way in _with_units(found):
        if quantity is not None and quantity.value is not None and quantity.unit != unit:
            raise DamageError(f"{quantity.unit!r} in place of {unit!r}", *way, "unit")


def _with_units(found: Calibration) -> Iterator[tuple[str, Quantity | None, tuple[str | int, ...]]]:
    """Quantities with the unit that each must have, and the way to them."""
    from accelcal.model import (  # here, as numpy comes with it
        ERROR_UNITS,
        coefficient_unit,
        law_units,
    )

    for i, table in enumerate(found.tables):
        for name, quantity in table.coefficients.items():
            unit = coefficient_unit(name, found.output_unit)
            yield unit, quantity, ("tables", i, "coefficients", name)
        for name, quantity in table.error_model.items():
            yield ERROR_UNITS[name], quantity, ("tables", i, "error_model", name)
    for name in ("temperature_model", "second_axis_model"):
        if (model := getattr(found, name)) is not None:
            laws = _of_laws(model, law_units(found.output_unit))
            yield from ((unit, part, (name, *way)) for unit, part, way in laws)


def _of_laws(
    model: TemperatureModel, units: Mapping[str, tuple[str, str]]
) -> Iterator[tuple[str, Quantity | None, tuple[str, ...]]]:
    for symbol, (at_T0, slope) in units.items():
        law = model.laws[symbol]
        yield at_T0, law.at_T0, (symbol, "at_T0")
        yield slope, law.above, (symbol, "above")
        yield slope, law.below, (symbol, "below")
    yield "g", model.hysteresis, ("hysteresis",)
