"""Parts of the JSON document of a calibration, read and checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from accelcal.results.checked import (
    Kind,
    checked,
    finite,
    list_of,
    mapping_of,
    number,
    text,
    text_or_none,
)
from accelcal.results.mapping import FrozenMapping

if TYPE_CHECKING:
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


def effect(document: Any) -> FrozenMapping[Any]:
    """Take an effect, which must be one of a discovery."""
    found = any_object(document)
    from accelcal.results.findings import FoundEffect  # here, as most calibrations have none

    FoundEffect.from_document(document)
    return found


def verdict(document: Any) -> Verdict:
    """Read the verdict."""
    from accelcal.results.verdict import Verdict  # here, as most calibrations have none

    return Verdict.from_document(document)
