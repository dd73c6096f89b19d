"""What two calibrations have in common, what cannot be compared, and what is left open.

They must be of one unit, one quantity and one temperature.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping

from accelcal.compensate.assumptions import unknown_shifts
from accelcal.compensate.of_table import cross_name
from accelcal.compensate.ranges import TEMPERATURE_MARGIN, outside_temperatures, within_temperatures
from accelcal.compensate.runs import said_of_runs
from accelcal.discovery.new_record.calibration_errors import is_corrected
from accelcal.discovery.new_record.errors_counted import heat_of
from accelcal.discovery.new_record.same_clamping import said_of_fixture
from accelcal.discovery.new_record.simulated import hiding, is_freed
from accelcal.discovery.two_calibrations.coefficients import (
    Coefficient,
    Name,
    effect_key,
    parameter_of,
)
from accelcal.discovery.two_calibrations.errors import Side
from accelcal.effects.left_in_use import of_the_test
from accelcal.errors import InputError
from accelcal.estimate.same_head import is_same_head
from accelcal.estimate.trend import FEW
from accelcal.model import COEFFICIENT_OF, SLOPES
from accelcal.plural import are, listed
from accelcal.recalibrations.comparable import ALIKE
from accelcal.results.calibration import Calibration
from accelcal.results.tables_in_use import tables_in_use
from accelcal.serials import serials_alike
from accelcal.units import conversion_factor

_NOT_TOLD = "not determined"
_ELSEWHERE = " elsewhere a difference of g looks like a change of K1"


def tells_its_head(own: Side) -> bool:
    """Whether a calibration tells what each position of its head did to it, apart from its noise.

    Of one stroke noise and head are told together, and what is left without the head is too little.
    """
    noises = own.calibration.reading_noises
    is_sure = all(noise.dof is None or noise.dof >= FEW for noise in noises)
    return is_sure and bool(own.errors.positions.size)


def is_one_head(old: Side, new: Side, told: bool | None) -> bool | None:
    """Tell whether both were measured on one head, see `accelcal.estimate.same_head.is_same_head`.

    None where nothing tells it, or where it would not help: one of them does not tell its
    positions.
    """
    one, other = (own.calibration.provenance.get("metadata", {}) for own in (old, new))
    same = is_same_head(one, other, told, one_file=are_of_one_file(old, new))
    return None if same and not (tells_its_head(old) and tells_its_head(new)) else same


def heads_tried(old: Side, new: Side, same: bool | None) -> list[bool]:
    """List whether one head is assumed: both ways where nothing tells, and it matters."""
    if same is None and tells_its_head(old) and tells_its_head(new):
        return [True, False]
    return [bool(same)]


def are_of_one_file(old: Side, new: Side) -> bool:
    """Tell whether both were fitted to the same readings."""
    one, other = (own.calibration.provenance.get("sha256") for own in (old, new))
    return bool(one) and one == other


def left_out(
    old: Side, new: Side, one: Mapping[Name, Coefficient], other: Mapping[Name, Coefficient]
) -> dict[Name, str]:
    """Say why coefficients that one calibration or both determine are not compared."""
    found: dict[Name, str] = {}
    apart = abs((old.found.T0_degC or 0.0) - (new.found.T0_degC or 0.0))
    for name in dict.fromkeys([*one, *other]):
        symbol, axis = name
        missing = [own.name for own, told in ((old, one), (new, other)) if name not in told]
        if missing:
            found[name] = f"{_NOT_TOLD} by the {missing[0]} calibration"
        elif symbol in SLOPES and apart > ALIKE:
            found[name] = "slopes above and below another T0"
        elif symbol == "delta" and axis and _angles_differ(old, new, axis):
            found[name] = (
                "of the other side of the mounting, or free of the fixture angle in one only: the"
                " fixture angle is in the difference"
            )
        elif (meanings := [_meaning(own, *name) for own in (old, new)])[0] != meanings[1]:
            found[name] = f"it is {meanings[0]} in the old calibration, {meanings[1]} in the new"
    return found


def _angles_differ(old: Side, new: Side, axis: str) -> bool:
    """Whether the fixture angle is not in the misalignments of both in the same way."""
    if old.fixture is not None:
        return False
    freed = [is_freed(own.calibration, axis) for own in (old, new)]
    if any(freed):
        return not all(freed)
    one, other = ({t.mounting for t in own.calibration.tables} for own in (old, new))
    return not {m for m in one & other if cross_name(m) == axis}


def _meaning(own: Side, symbol: str, axis: str | None) -> str:
    """What a coefficient really is at the angles of a calibration."""
    name = parameter_of(symbol)
    used = tables_in_use(own.calibration, own.found.T0_degC)
    table = used.nearest[axis not in (None, own.found.cross.name)]
    return table.meaning(name) if name in COEFFICIENT_OF else name


def notes(
    old: Side, new: Side, same: bool | None, temperature: float | None, lost: Mapping[Name, str]
) -> Iterator[str]:
    """Say what makes a comparison less than it seems, a sentence each."""
    if are_of_one_file(old, new):
        yield "both calibrations are of the same readings: new ones would agree less well"
    for own in (old, new):
        if told := hiding(own.error_sources):
            yield f"{own.name} calibration: {told}"
    yield from _not_compared(lost)
    yield from _of_head(old, new, same)
    yield from _of_fixture(old, new, same, lost)
    yield from _of_gravity(old, new, same)
    yield from _of_unit(old, new)
    yield from _of_temperature(old, new, temperature)
    for own in (old, new):
        if told := said_of_runs(own.calibration):
            yield f"the {own.name} {told}"
    yield from _of_effects(old, new, same)
    yield from _of_launches(old, new)


def _not_compared(lost: Mapping[Name, str]) -> Iterator[str]:
    for reason in dict.fromkeys(lost.values()):
        names = [symbol for (symbol, _), own in lost.items() if own == reason]
        yield f"not compared: {listed(dict.fromkeys(names))}, {reason}"
    zero = [name for name in ("k2", "k3") if lost.get((name, None), "").startswith(_NOT_TOLD)]
    if zero:
        yield (
            f"the change of the indicated acceleration takes {listed(zero)} as 0 where not"
            " determined, so that what it does counts as a change"
        )


def _of_head(old: Side, new: Side, same: bool | None) -> Iterator[str]:
    corrected = [own.name for own in (old, new) if is_corrected(own.calibration)]
    untold = [own.name for own in (old, new) if not tells_its_head(own)]
    if corrected:
        yield (
            f"{_whose(corrected)} {are(corrected)} corrected by the known errors of a head: what is"
            " left of them counts as that of two heads"
        )
    elif same is not False and untold:
        yield (
            f"the {listed(untold)} calibration does not tell the positions of its head, or not its"
            " noise apart from them (repeat strokes): the errors of the head count as those of two"
        )
    elif same is None:
        yield (
            "it is not known whether both were measured on one head, clamped alike: U and the"
            " chances are the larger ones of both cases; name the head in a line '# head: NAME' of"
            " both tables, or give same_head=True or same_head=False"
        )


def _whose(names: Collection[str]) -> str:
    return "both calibrations" if len(names) == 2 else f"the {listed(names)} calibration"


def _of_fixture(old: Side, new: Side, same: bool | None, lost: Mapping[Name, str]) -> Iterator[str]:
    axes = {axis.name for axis in old.found.axes} & {axis.name for axis in new.found.axes}
    bare = [
        axis for axis in axes if ("delta", axis) not in lost and not is_freed(old.calibration, axis)
    ]
    if old.fixture is not None:
        yield said_of_fixture(old.fixture)
    elif bare and not same:
        yield (
            "delta contains the fixture angle of each test, which U does not count: of two fixtures"
            " or clampings their difference is in it; give its standard uncertainty by"
            " fixture_uncertainty=..., or measure both sides of the mounting, which tell it"
        )


def _of_gravity(old: Side, new: Side, same: bool | None) -> Iterator[str]:
    here, there = (own.calibration.g_local_m_s2 for own in (old, new))
    if here is None and there is None:
        if not same:
            yield (
                "neither calibration declares its local gravity: both are taken as of one place;"
                f"{_ELSEWHERE}; write '# g: 9.8106' above the readings"
            )
    elif here is None or there is None:
        yield (
            f"the {'old' if here is None else 'new'} calibration declares no local gravity: both"
            f" are taken as of one place;{_ELSEWHERE}"
        )
    elif here != there:
        yield f"calibrated where g = {here} m/s^2 and {there} m/s^2: all is told in the former g"


def _of_unit(old: Side, new: Side) -> Iterator[str]:
    unit, other = old.found.output_unit, new.found.output_unit
    if (unit is None) != (other is None):
        yield (
            f"the {'old' if unit is None else 'new'} calibration names no output unit: both are"
            f" taken as of {unit or other}"
        )
    elif unit != other:
        yield f"the new calibration is converted from {other} to {unit}"


def _of_temperature(old: Side, new: Side, temperature: float | None) -> Iterator[str]:
    if temperature is None or None in (old.found.T0_degC, new.found.T0_degC):
        yield "a temperature is unknown: the calibrations are compared as if at one"
        return
    for own in (old, new):
        away = abs(temperature - (own.found.T0_degC or 0.0))
        heat = heat_of(own.calibration) or 0.0
        if not own.found.several_levels and max(away, heat) > ALIKE:
            off = (
                f"is {away:.2g} degC off this temperature"
                if away > ALIKE
                else (f"has temperatures with errors of {heat:.2g} degC")
            )
            yield (
                f"the {own.name} calibration {off} and tells no slopes: U counts what usual ones"
                " make of it"
            )


def _of_effects(old: Side, new: Side, same: bool | None) -> Iterator[str]:
    if set(old.effects) != set(new.effects):
        told = [f"the {own.name} one has {listed(own.effects) or 'none'}" for own in (old, new)]
        yield (
            f"effects of the calibrations differ: {', '.join(told)}; coefficients that an effect"
            " looks like mean something else without it; give both one model by fit --model"
        )
    elif old.by_others.any() or new.by_others.any():
        yield (
            "the effects count as they are named, in both calibrations alike: if they are others,"
            " their sizes may differ at other angles though nothing has changed"
        )
    keys = {effect_key(item) for item in new.measured_effects}
    both = {item.id for item in old.measured_effects if effect_key(item) in keys}
    as_found = {*old.calibration.effects_as_found, *new.calibration.effects_as_found}
    shared = {*old.effects} & {*new.effects} - both
    for names, reason in (
        (shared & as_found, "one has them from its discovery, as its readings do not show them"),
        (shared - as_found, "what is stated of them without an uncertainty differs"),
    ):
        if names:
            yield f"sizes of {listed(sorted(names))} are not compared: {reason}"
    of_test = of_the_test(sorted(both))
    if of_test and not same:
        yield (
            f"of the stand and not of the accelerometer: {listed(of_test)}; two stands may have"
            " other sizes"
        )


def _of_launches(old: Side, new: Side) -> Iterator[str]:
    untold = {own.name: unknown_shifts(own.calibration) for own in (old, new)}
    for shifts in dict.fromkeys(listed(found) for found in untold.values() if found):
        names = [name for name, found in untold.items() if listed(found) == shifts]
        yield (
            f"shifts of {shifts} from launch to launch are not known of {_whose(names)}: they look"
            " like a change"
        )
    if names := [own.name for own in (old, new) if heat_of(own.calibration) is None]:
        yield (
            f"errors of the temperature are not declared of {_whose(names)}: they look like a"
            " change; give their temperature_uncertainty to accelcal fit"
        )


def refuse_two_units(old: Calibration, new: Calibration) -> None:
    """Refuse calibrations of two accelerometers.

    Raises
    ------
    InputError
        If both name their serial number, and differ in more than its spelling.
    """
    names = {own.serial for own in (old, new) if own.serial}
    if len(names) == 2 and not serials_alike(names):
        raise InputError(
            f"the old calibration is that of {old.serial}, the new one that of {new.serial}; give"
            " two of one accelerometer"
        )


def factor_of_unit(old: Side, new: Side) -> float:
    """Output unit of the new calibration in that of the old one; 1 where one names none.

    Raises
    ------
    InputError
        If they are of two quantities.
    """
    unit, other = old.found.output_unit, new.found.output_unit
    if unit is None or other is None:
        return 1.0
    factor = conversion_factor(other, unit)
    if factor is None:
        raise InputError(
            f"the old calibration is of an output in {unit}, the new one in {other}; give two of"
            " one output"
        )
    return factor


def common_temperature(old: Side, new: Side, asked: float | None) -> float | None:
    """Choose where to compare: as asked, else at T0 of the old one or next to it [degC].

    It is None where one calibration knows none.

    Raises
    ------
    InputError
        If one of them is not good there, or there is none for which both are.
    """
    ranges = [(own.name, own.found.temperatures) for own in (old, new)]
    known = [own for _, own in ranges if own is not None]
    if asked is not None:
        for name, own in ranges:
            if own is not None and not within_temperatures(own, asked):
                problem = outside_temperatures(own, asked)
                raise InputError(f"{name} calibration: {problem}; compare where both are good")
        return asked
    if len(known) < 2:
        return None
    low, high = max(own[0] for own in known), min(own[1] for own in known)
    if low - high > 2.0 * TEMPERATURE_MARGIN:
        told = [f"the {name} one is for {_levels(*own)}" for name, own in ranges if own]
        raise InputError(
            f"no temperature at which both calibrations are good: {' and '.join(told)}; calibrate"
            " at a common level"
        )
    if low > high:
        return 0.5 * (low + high)
    return min(max(old.found.T0_degC or 0.0, low), high)


def _levels(low: float, high: float) -> str:
    return f"{low:.4g} degC" if math.isclose(low, high) else f"{low:.4g} to {high:.4g} degC"
