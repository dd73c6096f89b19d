"""From a calibration to its compensation: tables, laws, covariance, and what has to be assumed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal, get_args

from accelcal.arguments.kinds import expect
from accelcal.arguments.options import check_choice
from accelcal.compensate.assumptions import (
    one_sided,
    same_at_all_temperatures,
    unknown_launch,
    unknown_level,
    without_covariance,
)
from accelcal.compensate.by_levels import level_compensation
from accelcal.compensate.coefficients import (
    Compensation,
    CrossAxis,
    Launch,
    Law,
)
from accelcal.compensate.of_table import (
    by_table,
    cross_name,
    errors_of_laws,
    lost_symbols,
    of_test,
    with_other,
)
from accelcal.compensate.runs import are_alike, by_runs, said_of_runs
from accelcal.effects.left_in_use import beyond_in_use, left_in_use
from accelcal.effects.static import how_taken_up, static_effects
from accelcal.effects.without_sources import without_sources
from accelcal.errors import InputError
from accelcal.estimate.uncertainty import counted
from accelcal.results.calibration import Calibration
from accelcal.results.covariance import LOOK_ALIKES, rows_of
from accelcal.results.table import TableCalibration, known_temperatures
from accelcal.results.tables_in_use import tables_in_use
from accelcal.results.temperature import TemperatureModel
from accelcal.results.usable import (
    gates_that_warn,
    not_determined,
    refuse_misprinted,
    refuse_undetermined_laws,
    tables_of_run,
)

__all__ = ["BY", "compensation"]

By = Literal["laws", "levels"]

BY: tuple[By, ...] = get_args(By)
"""How coefficients depend on temperature; the first is the default."""

_UNLIKE = (
    "they are of several levels or of both sides of an axis, or tell different coefficients, and"
    " have no mean; choose one run or mounting, or fit it by itself; the laws need K0, K1 and M at"
    " levels more than 5 degC apart and from T0"
)
_COMMON = ("k2", "k3", "delta_ip")
"""Parameters without a temperature law."""


def compensation(
    calibration: Calibration,
    run: str | int | None = None,
    *,
    by: str = BY[0],
    same_launch: bool = False,
    effects: bool = True,
) -> Compensation:
    """Choose what a calibration gives to its users.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    run : str or int, optional
        Use the table of this run only; by default the temperature laws, or without laws the mean of
        all runs, see `accelcal.compensate.runs`.
    by : {"laws", "levels"}, default "laws"
        How the coefficients depend on temperature: by the laws, or on straight lines between the
        levels, see `accelcal.compensate.levels`.
    same_launch : bool, default False
        Leave the shift to the next launch out.
    effects : bool, default True
        Take up the static effects of the calibration, and count by them what may be in their place;
        otherwise the assumptions tell of them too.

    Returns
    -------
    Compensation
        Coefficients at any temperature.

    Raises
    ------
    InputError
        If the calibration does not say which coefficients to use, or has none that are usable.

    Notes
    -----
    With temperature laws, k0, K1 and delta follow them; k2, k3 and delta_ip are each of the table
    nearest to T0 that tells it, see `accelcal.results.tables_in_use`. The covariance is that of the
    laws with them. Where both sides of an axis were measured, delta is free of the fixture angle.

    Examples
    --------
    >>> import accelcal
    >>> found = compensation(accelcal.fit(accelcal.simulate(seed=1)))
    >>> found.temperatures, found.assumptions
    ((-40.0, 80.0), ())
    """
    expect(calibration, Calibration)
    check_choice(BY, by=by)
    refuse_misprinted(calibration)
    if effects:
        calibration = without_sources(calibration, [LOOK_ALIKES])
    tables = tables_of_run(calibration, run)
    model = calibration.temperature_model
    by_laws = model is not None and run is None and by == "laws"
    found: Compensation
    if by == "levels":
        _refuse_run(run)
        found = level_compensation(calibration, tables)
    elif model is not None and run is None:
        refuse_undetermined_laws(calibration)
        found = _from_laws(calibration, model)
    else:
        found = _from_tables(calibration, tables)
    beyond = beyond_in_use(calibration, tables, by_laws=by_laws)
    launch = Launch() if same_launch else _next_launch(calibration)
    new_launch = [] if same_launch else unknown_launch(calibration)
    said = (*gates_that_warn(calibration, tables), *beyond, *found.assumptions, *new_launch)
    found = replace(found, launch=launch, assumptions=said)
    return _with_effects(calibration, found, taken_up=effects)


def _refuse_run(run: str | int | None) -> None:
    if run is not None:
        raise InputError(
            "run=... and by='levels' are both given: the table of one run has one level; leave one"
            " out"
        )


def _with_effects(calibration: Calibration, found: Compensation, *, taken_up: bool) -> Compensation:
    """Take up what is a function of acceleration and temperature, and say what is left."""
    own = static_effects(calibration, found.K1.at_T0, found.T0_degC) if taken_up else None
    names = [item.effect.id for item in own.disturbances] if own else []
    said = [*(how_taken_up(calibration) if own else []), *left_in_use(calibration, names)]
    return replace(found, effects=own, assumptions=(*found.assumptions, *said))


def _next_launch(calibration: Calibration) -> Launch:
    known = {source.name: source for source in calibration.error_sources if source.value}
    bias, scale_factor = known.get("launch"), known.get("launch_sf")
    return Launch(
        bias=(bias and bias.value) or 0.0,
        scale_factor=(scale_factor and scale_factor.value) or 0.0,
        bias_dof=float(counted((bias and bias.dof) or math.inf)),
        scale_factor_dof=float(counted((scale_factor and scale_factor.dof) or math.inf)),
    )


def _from_tables(calibration: Calibration, tables: Sequence[TableCalibration]) -> Compensation:
    """One table, or the mean of those that are alike; of each cross axis."""
    groups = runs_in_use(calibration, tables)
    main = groups[0][0]
    found, *others = (by_runs(calibration, own) for own in groups)
    for other in others:
        found = with_other(found, other)
    said = (*unknown_level(main.temperature_degC), *not_determined(groups))
    return replace(
        found,
        undetermined=lost_symbols(groups),
        notes=(f"the {said_of_runs(calibration)}",) if max(map(len, groups)) > 1 else (),
        assumptions=(*said, *without_covariance(main)),
    )


def runs_in_use(
    calibration: Calibration, tables: Sequence[TableCalibration]
) -> list[list[TableCalibration]]:
    """Group the tables that count without laws by the cross axis, the main one first.

    Raises
    ------
    InputError
        If those of an axis are of several levels, or of both sides where no fixture angle tells
        them apart, or tell different coefficients.
    """
    main, second = calibration.mountings_of_laws
    tables = sorted(tables, key=lambda t: (t.mounting != main, t.mounting != second))
    tables, by_axis = _one_side(calibration, tables), dict[str, list[TableCalibration]]()
    for table in tables:
        by_axis.setdefault(cross_name(table.mounting), []).append(table)
    groups = list(by_axis.values())
    if not all(map(are_alike, groups)):
        names = ", ".join(f"{table.run} ({table.mounting})" for table in tables)
        raise InputError(f"{len(tables)} tables and no temperature law, runs {names}; {_UNLIKE}")
    return groups


def _from_laws(calibration: Calibration, model: TemperatureModel) -> Compensation:
    """The laws, and those of the other cross axis, or its table nearest in temperature."""
    used = tables_in_use(calibration)
    levels = known_temperatures(used.of_main)
    if calibration.T0_degC is None or not levels:
        raise InputError(
            "the temperature laws have no T0 or no levels; fit the record anew, with temperatures"
        )
    main, near = used.main, used.second
    found = _by_laws(calibration, model, main, {name: used.telling(name) for name in _COMMON})
    groups, said = [used.of_main], []
    if near is not None:
        groups.append(used.of_second)
        second = calibration.second_axis_model
        if second is None or second.delta.at_T0 is None:
            other = by_table(calibration, near)
        else:
            common = {name: used.telling(name, second=True) for name in _COMMON}
            other = _by_laws(calibration, second, near, common)
        found = with_other(found, other)
        said = same_at_all_temperatures(other.cross, near)
    return replace(
        found,
        temperatures=(min(levels), max(levels)),
        undetermined=lost_symbols(groups),
        assumptions=(
            *one_sided(model),
            *not_determined(groups),
            *said,
            *without_covariance(main),
        ),
    )


def _by_laws(
    calibration: Calibration,
    model: TemperatureModel,
    table: TableCalibration,
    common: Mapping[str, TableCalibration],
) -> Compensation:
    """What the laws of one axis tell, and for `_COMMON` a table each."""
    laws = {name: Law.of(law, name) for name, law in model.laws.items()}
    alone = {name: own.error_model[name] for name, own in common.items()}
    values = {name: quantity.value or 0.0 for name, quantity in alone.items()}
    return Compensation(
        k0=laws["k0"],
        K1=laws["K1"],
        k2=values["k2"],
        k3=values["k3"],
        cross=CrossAxis(cross_name(table.mounting), laws["delta"], values["delta_ip"]),
        errors=tuple(map(rows_of, errors_of_laws(model, laws, alone))),
        T0_degC=calibration.T0_degC,
        temperatures=None,
        hysteresis=0.0 if model.hysteresis is None else abs(model.hysteresis.value or 0.0),
        **of_test(calibration, table),
    )


def _one_side(
    calibration: Calibration, tables: Sequence[TableCalibration]
) -> Sequence[TableCalibration]:
    """Of both sides of one axis the first: the misalignment is that of both."""
    reversed_axes = {found.axis for found in calibration.fixture_angle}
    first: dict[str, str] = {}
    for table in tables:
        first.setdefault(table.mounting[:1], table.mounting)
    return [
        table
        for table in tables
        if table.mounting == first[table.mounting[:1]] or table.mounting[:1] not in reversed_axes
    ]
