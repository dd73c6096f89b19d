"""Parts of the JSON document of a calibration, read and checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from accelcal.results.checked import (
    Kind,
    checked,
    list_of,
    mapping_of,
    number,
    text,
    text_or_none,
)
from accelcal.results.mapping import FrozenMapping, frozen
from accelcal.results.quantity import Document
from accelcal.results.table import TableCalibration
from accelcal.results.temperature import TemperatureModel

if TYPE_CHECKING:
    from accelcal.results.verdict import Verdict

__all__ = ["any_object", "effect", "laws", "provenance", "tables", "verdict"]

_PROVENANCE: dict[str, Kind[Any]] = {
    "sha256": text_or_none,
    "metadata": mapping_of(text),
    "declared": mapping_of(number),
    "notes": list_of(text),
    "options": lambda part: any_object(part),  # defined below
}


def tables(document: Any) -> tuple[TableCalibration, ...]:
    """Read the tables of a calibration, one at least."""
    found = list_of(TableCalibration.from_document)(document)
    if not found:
        raise TypeError("is empty, in place of a table or more")
    return found


def laws(document: Document | None) -> TemperatureModel | None:
    """Read the temperature laws; None where there are none."""
    return None if document is None else TemperatureModel.from_document(document)


def any_object(document: Any) -> FrozenMapping[Any]:
    """Take an object of any content."""
    if not isinstance(document, Mapping):
        raise TypeError(f"{document!r:.40} in place of an object")
    return FrozenMapping({name: frozen(part) for name, part in document.items()})


def provenance(document: Any) -> FrozenMapping[Any]:
    """Take what tells of the input, of which any part may be missing."""
    found = any_object(document)
    for name, kind in _PROVENANCE.items():
        checked(document, name, kind, None)
    return found


def effect(document: Any) -> FrozenMapping[Any]:
    """Take an effect, which must be one of a discovery."""
    found = any_object(document)
    from accelcal.results.findings import FoundEffect  # here, as most calibrations have none

    FoundEffect.from_document(document)
    return found


def verdict(document: Document | None) -> Verdict | None:
    """Read the verdict; None where it was not judged."""
    if document is None:
        return None
    from accelcal.results.verdict import Verdict  # here, as most calibrations have none

    return Verdict.from_document(document)
