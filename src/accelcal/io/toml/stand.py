"""Stands as TOML."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from accelcal.errors import InputError
from accelcal.io.files.text import Source, read_text
from accelcal.io.toml.keys import check_keys, is_of_kind, read_toml
from accelcal.stand_uncertainty.kinds import KINDS, size_of_unit
from accelcal.stand_uncertainty.readings import StandConditions
from accelcal.stand_uncertainty.stand import Distribution, Stand, StandComponent, distribution

__all__ = ["SCHEMA", "read_stand"]

SCHEMA = "accelcal/stand/1"

_KEYS = {"schema": str, "name": str, "source": str, "conditions": dict, "components": dict}
_CONDITIONS = {
    "gravity_m_per_s2": ("local_gravity", float, 1.0),
    "room_temperature_degC": ("room_temperature", float, 1.0),
    "load_resistor_ohm": ("load", float, 1.0),
    "load_resistor_ppm_per_degC": ("load_coefficient", float, 1e-6),
    "voltmeter_ranges_V": ("ranges", list, 1.0),
}
"""Key -> field of `StandConditions`, its type, and its unit in that of the field."""

_COMPONENT_KEYS = {
    "kind": str,
    "unit": str,
    "distribution": str,
    "standard": float,
    "half_width": float,
    "coverage": float,
    "factor": float,
    "dof": float,
    "varies": (str, list),
    "order": int,
    "fixed": bool,
    "origin": str,
}
_TYPE_NAMES = {
    dict: "a table such as [components.head]",
    list: "a list such as [0.1, 1.0, 10.0]",
    (str, list): 'a text such as "run", or a list of such texts',
}
_SIZES = ("standard", "half_width", "coverage", "factor", "dof")
_NEVER = "never"


def read_stand(source: Source) -> Stand:
    """Read a stand.

    Parameters
    ----------
    source : path, "-" or file object
        A TOML file with the keys schema, name and components and, if you like, source and
        conditions.

    Returns
    -------
    Stand
        The stand, with its components in the order of the file.

    Raises
    ------
    TableError
        If the file cannot be read, is not TOML, or has a key that is unknown, missing or of the
        wrong type, a unit that is none of its quantity, a distribution that there is not, or a
        negative size.

    Examples
    --------
    >>> from io import StringIO
    >>> import accelcal
    >>> text = '''
    ... schema = "accelcal/stand/1"
    ... name = "table top"
    ... [components.level]
    ... kind = "shaft-tilt"
    ... distribution = "rectangular"
    ... half_width = 10
    ... unit = "arcsec"
    ... '''
    >>> accelcal.read_stand(StringIO(text)).components[0].distribution.standard.__round__(7)
    2.8e-05
    """
    given = read_text(source, "stand")
    make = partial(_stand, name=given.name)
    return read_toml(given, make, "[components.NAME]", SCHEMA)


def _stand(document: Mapping[str, Any], name: str) -> Stand:
    check_keys(document, _KEYS, _TYPE_NAMES, required=("name", "components"))
    conditions = _conditions(document.get("conditions", {}))
    gravity, components = conditions.local_gravity, document["components"].items()
    return Stand(
        name=document["name"],
        components=tuple(_component(key, entry, gravity) for key, entry in components),
        conditions=conditions,
        source=document.get("source", name),
    )


def _conditions(entry: Mapping[str, Any]) -> StandConditions:
    kinds = {key: kind for key, (_, kind, _) in _CONDITIONS.items()}
    check_keys(entry, kinds, _TYPE_NAMES, where="conditions: ")
    found: dict[str, Any] = {}
    for key, value in entry.items():
        name, kind, unit = _CONDITIONS[key]
        if kind is list and not all(is_of_kind(item, float) for item in value):
            raise InputError(f"conditions: {key} is {value!r}; it is a list of numbers")
        found[name] = tuple(map(float, value)) if kind is list else unit * value
    return StandConditions(**found)


def _component(name: str, entry: Any, gravity: float | None) -> StandComponent:
    where = f"components.{name}: "
    if not isinstance(entry, dict):
        raise InputError(f"components.{name} is {entry!r}; make it a table [components.{name}]")
    required = ("kind", "unit", "distribution")
    check_keys(entry, _COMPONENT_KEYS, _TYPE_NAMES, required=required, where=where)
    try:
        return _checked_component(name, entry, gravity)
    except InputError as error:
        raise InputError(f"{where}{error}") from None


def _checked_component(
    name: str, entry: Mapping[str, Any], gravity: float | None
) -> StandComponent:
    kind = entry["kind"]
    if kind not in KINDS:
        raise InputError(f"kind {kind!r} is unknown; there are {', '.join(KINDS)}")
    if "order" in entry and kind != "head-harmonic":
        raise InputError("order goes with kind head-harmonic only; leave it out")
    rest = {key: entry[key] for key in ("order", "fixed", "origin") if key in entry}
    varies = _varies(entry["varies"]) if "varies" in entry else KINDS[kind].varies
    return StandComponent(name, kind, _distribution(entry, gravity), varies, **rest)


def _distribution(entry: Mapping[str, Any], gravity: float | None) -> Distribution:
    unit = size_of_unit(entry["unit"], KINDS[entry["kind"]].quantity, gravity)
    sizes = {key: float(entry[key]) for key in _SIZES if key in entry}
    for key in {"standard", "half_width"} & set(sizes):
        sizes[key] *= unit
    return distribution(entry["distribution"], **sizes)


def _varies(given: Any) -> tuple[str, ...]:
    names = [given] if isinstance(given, str) else given
    if not all(isinstance(name, str) for name in names):
        raise InputError(f"varies is {given!r}; it is {_TYPE_NAMES[str, list]}")
    return () if names == [_NEVER] else tuple(dict.fromkeys(names))
