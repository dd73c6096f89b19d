"""The model that is taken for granted, and the same with effects added to it.

With dT = T - T0, a reading over the scale factor at T0 is a product,

    Y / K1N = [1 + beta(dT) + s_run] [k0(dT) + b_run + a_i + k2 a_i^2 + k3 a_i^3 + delta(dT) a_p
              + delta_ip a_i a_p + effects]

with bilinear beta, k0 and delta. The shifts s_run and b_run from launch to launch are free where
their size is not declared; else they are errors, see `accelcal.discovery.noise.of_readings`.
Where runs are apart, both are free, and so is delta in each table.
Everything is linear within either bracket, so the model is two matrices.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from itertools import compress
from typing import Any

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.discovery.columns import dummies, moves, scaled
from accelcal.effects.conditions import LEVEL_CHANGE, Conditions, conditions_of
from accelcal.errors import InputError
from accelcal.geometry import accelerations
from accelcal.model import SEEN_IN_MOUNTING
from accelcal.numerics.grouping import distinct
from accelcal.plural import named
from accelcal.record import TumbleRecord

SIDES = ("above T0", "below T0")
"""Sides of a bilinear law, as they stand behind a blank in the names of slopes."""

_AS_IT_MOVES = " as the temperature moves"
"""End of the names of slopes that take up how one level moves."""

_STEPS = 5
"""Most steps of Gauss and Newton."""

_RANK = 1e-9
"""Singular values below this share of the largest are rounding errors."""


@dataclass(frozen=True, slots=True, eq=False)
class BaseModel:
    """Columns of the two brackets for n readings."""

    nominal: float
    """K1N, the scale factor at T0 as a first fit of the model has it [output unit / g]."""
    reading: Array  # readings over `nominal`, (n,) [g]
    gain: Array  # columns of the first bracket, (n, p)
    inside: Array  # columns of the second bracket, (n, q)
    names: tuple[str, ...]  # coefficient that each of the p + q columns belongs to
    conditions: Conditions  # of the readings, as the fitted model has them
    T0: float  # reference temperature [degC]
    delta0: float  # fixture angle [rad]
    apart: bool = False  # whether bias, scale factor and misalignment are free in each run

    def split(self, parameters: Array) -> tuple[Array, Array]:
        """Both brackets at the parameters, each of shape (n,)."""
        p = self.gain.shape[1]
        gain = 1.0 + self.gain @ parameters[:p]
        return gain, self.conditions.input + self.inside @ parameters[p:]

    def jacobian(self, parameters: Array) -> Array:
        """Derivative of the model by its parameters, shape (n, p + q)."""
        gain, inside = self.split(parameters)
        return np.hstack([inside[:, None] * self.gain, gain[:, None] * self.inside])

    def residual(self, parameters: Array) -> Array:
        """Reading minus model [g], shape (n,)."""
        gain, inside = self.split(parameters)
        return self.reading - gain * inside

    @property
    def tilting(self) -> Mask:
        """Which parameters are those of the misalignment, shape (p + q,)."""
        return np.array([name.startswith("M") and "_i" not in name for name in self.names])

    @property
    def moving(self) -> Mask:
        """Which parameters take up how one level moves, and are not told, shape (p + q,)."""
        return np.array([name.endswith(_AS_IT_MOVES) for name in self.names])

    def extended(self, columns: Array, names: tuple[str, ...]) -> BaseModel:
        """Add columns [g] to the second bracket."""
        return replace(self, inside=np.hstack([self.inside, columns]), names=(*self.names, *names))


def base_model(
    record: TumbleRecord,
    reference_temperature: float,
    delta0: float = 0.0,
    silent: Mask | None = None,
    *,
    apart: bool = False,
) -> BaseModel:
    """Set up the base model of a record, T0 in degC and the fixture angle in rad.

    Its conditions are those of an accelerometer that has the fitted coefficients. Readings that are
    silent, shape (n,), have the bias alone, as if nothing accelerated it. Runs may be apart, as
    after pauses in which something slow goes on.

    Raises
    ------
    InputError
        If the readings do not follow the input axis at all.
    """
    ideal = conditions_of(record, reference_temperature, delta0)
    if silent is not None:
        ideal = _silenced(ideal, silent)
    centred = ideal.input - ideal.input.mean()
    nominal = float(centred @ record.output / (centred @ centred or np.inf))
    if not abs(nominal) > 1e-3 * np.abs(record.output - record.output.mean()).max():
        raise InputError(
            f"{_of_some_runs(record, ideal.input)}the readings do not follow the angle of the head;"
            " discovery needs a tumble test of an accelerometer"
        )
    gain, inside, names = _brackets(record, ideal, apart=apart)
    first = BaseModel(
        nominal=nominal,
        reading=record.output / nominal,
        gain=gain,
        inside=inside,
        names=names,
        conditions=ideal,
        T0=reference_temperature,
        delta0=delta0,
        apart=apart,
    )
    # what readings beside silent ones lack is no part of the scale factor
    lacking = None if silent is None else np.sign(ideal.input)
    model = over_scale_factor(first, lacking)
    parameters = solve(_beside(model, lacking))[: len(model.names)]
    return replace(model, conditions=_fitted_conditions(model, parameters, record))


def _silenced(c: Conditions, silent: Mask) -> Conditions:
    """Conditions in which some readings are without acceleration."""
    names = ("input", "cross", "axial", "indicated", "per_radian")
    heard: Any = {name: np.where(silent, 0.0, getattr(c, name)) for name in names}
    return replace(c, **heard)


def turned(model: BaseModel, record: TumbleRecord, angle: Array) -> BaseModel:
    """The model of the same readings where the head has turned by so much more [rad].

    Its conditions have the accelerations of an accelerometer without misalignment.
    """
    degrees = record.angle + np.degrees(angle)
    sensed = accelerations(degrees, model.delta0, record.mounting)
    c = replace(
        model.conditions,
        angle=degrees,
        input=sensed.input,
        cross=sensed.cross,
        axial=sensed.input,
    )
    gain, inside, _ = _brackets(record, c, apart=model.apart)
    return replace(model, gain=gain, inside=inside, conditions=c)


def _brackets(
    record: TumbleRecord, c: Conditions, *, apart: bool
) -> tuple[Array, Array, tuple[str, ...]]:
    """Columns of the two brackets under some conditions, and the coefficients they belong to."""
    law, names = _law(c)
    runs, declared = dummies(c.run), record.apparatus
    gain, of_gain = [law], [f"K1{name}" for name in names]
    inside, of_inside = [law], [f"K0{name}" for name in names]
    if apart or declared.launch_sf_uncertainty is None:
        gain, of_gain = [*gain, runs], of_gain + ["K1"] * runs.shape[1]
    if apart or declared.launch_uncertainty is None:
        inside, of_inside = [*inside, runs], of_inside + ["K0"] * runs.shape[1]
    inside += [c.input[:, None] ** 2, c.input[:, None] ** 3]
    of_inside += ["K2", "K3"]
    for axis, (tilt, coupling) in _axes(record).items():
        own = np.char.startswith(record.mounting, axis)
        cross = np.where(own, c.cross, 0.0)[:, None]
        tables = dummies(c.run, record.mounting)
        tables = cross * tables[:, tables[own].any(axis=0) & apart]
        inside += [cross * law, tables, cross * c.input[:, None]]
        of_inside += [*(f"{tilt}{name}" for name in names), *[tilt] * tables.shape[1], coupling]
    return np.hstack(gain), np.hstack(inside), (*of_gain, *of_inside)


def _of_some_runs(record: TumbleRecord, a_i: Array) -> str:
    """Begin to say of which runs, where it is not all."""
    runs = distinct(record.run).tolist()
    still = [not _follows(a_i[record.run == run], record.output[record.run == run]) for run in runs]
    if all(still) or not any(still):
        return ""
    return f"{named('run', [record.run_labels[run] for run in compress(runs, still)])}: "


def _follows(a_i: Array, output: Array) -> bool:
    """Whether the outputs of a run are more a line over a_i than anything else."""
    x, y = a_i - a_i.mean(), output - output.mean()
    return bool((x @ y) ** 2 > 0.5 * (x @ x) * (y @ y))


def _beside(model: BaseModel, column: Array | None) -> BaseModel:
    return model if column is None else model.extended(column[:, None], ("beside",))


def over_scale_factor(model: BaseModel, beside: Array | None = None) -> BaseModel:
    """Divide the readings by the scale factor at T0, beside which its slopes are told.

    The slope of all readings over a_i, which the model starts from, is that at the mean level.
    What the readings have beside it, shape (n,), the scale factor does not take up.
    """
    gain = 1.0 + float(solve(without_shifts(_beside(model, beside)))[0])
    return replace(model, nominal=model.nominal * gain, reading=model.reading / gain)


def without_shifts(model: BaseModel, sides: Collection[str] | None = None) -> BaseModel:
    """Leave the free shifts of the runs out, which could take the part of the laws.

    With `sides`, ``"above T0"`` or ``"below T0"``, slopes on other sides are left out as well.
    """
    names, p = model.names, model.gain.shape[1]
    given = {"", *(SIDES if sides is None else sides)}
    of_laws = [
        i
        for i, name in enumerate(names)
        if name not in names[:i] and name.partition(" ")[2] in given
    ]
    return replace(
        model,
        gain=model.gain[:, [i for i in of_laws if i < p]],
        inside=model.inside[:, [i - p for i in of_laws if i >= p]],
        names=tuple(names[i] for i in of_laws),
    )


def solve(model: BaseModel, whiten: Callable[[Array], Array] | None = None) -> Array:
    """Fit the parameters, shape (p + q,), by Gauss-Newton steps of generalised least squares.

    What whitens readings or columns, shape (n,) or (n, k), makes the errors of the readings
    independent and alike. Of parameters that the readings do not determine, it is the smallest set.
    """
    parameters = np.zeros(len(model.names))
    for _ in range(_STEPS):
        jacobian, residual = model.jacobian(parameters), model.residual(parameters)
        if whiten is not None:
            jacobian, residual = whiten(jacobian), whiten(residual)
        units, norms = scaled(jacobian)
        step = np.linalg.lstsq(units, residual, rcond=_RANK)[0] / norms
        parameters = parameters + step
        if np.abs(step).max() < 1e-13:
            break
    return parameters


def _axes(record: TumbleRecord) -> dict[str, tuple[str, str]]:
    """Symbols of misalignment and cross-coupling, by the axis along the shaft."""
    axes = sorted({str(mounting)[0] for mounting in record.mounting})
    if len(axes) == 1:
        return {axes[0]: ("M", "M_ip")}
    return {axis: (SEEN_IN_MOUNTING[axis][-2], SEEN_IN_MOUNTING[axis][-1]) for axis in axes}


def _law(c: Conditions) -> tuple[Array, list[str]]:
    """Columns of a bilinear law; of a side without a level of its own, no slope is told."""
    columns, names = [np.ones(c.excess.size)], [""]
    for side, name in (
        (np.maximum(c.excess, 0.0), f" {SIDES[0]}"),
        (np.minimum(c.excess, 0.0), f" {SIDES[1]}"),
    ):
        if np.ptp(side) >= LEVEL_CHANGE:
            columns.append(side)
            names.append(name)
        elif moves(side, c):  # one level alone tells none, but moves as recorded
            columns.append(side - side.mean() if side.all() else side)
            names.append(f"{name}{_AS_IT_MOVES}")
    return np.stack(columns, axis=1), names


def _fitted_conditions(model: BaseModel, parameters: Array, record: TumbleRecord) -> Conditions:
    """Conditions with what the fitted model says the accelerometer indicates and how it changes."""
    c = model.conditions
    gain, inside = model.split(parameters)
    laws = without_shifts(model)
    slopes = solve(laws)
    return replace(
        c,
        axial=_axial(model, parameters, record),
        indicated=inside,
        gain=gain,
        per_degree=_per_degree(laws, slopes, c.excess >= 0.0),
        per_degree_falling=_per_degree(laws, slopes, c.excess > 0.0),
    )


def _axial(model: BaseModel, parameters: Array, record: TumbleRecord) -> Array:
    """Acceleration along the true input axis [g], shape (n,).

    Both sides of a mounting tell the fixture angle, which then may be another than the given one.
    """
    c, sides = model.conditions, set(record.mounting.tolist())
    if len({side[0] for side in sides}) == len(sides):
        return c.input + tilt(model, parameters)
    freed = model.extended(c.per_radian[:, None], ("fixture",))
    found = solve(freed)
    return np.asarray(c.input + tilt(freed, found) + found[-1] * c.per_radian)


def tilt(model: BaseModel, parameters: Array) -> Array:
    """Part of the cross-axis acceleration that lies along the true input axis [g]."""
    own = model.tilting
    return np.asarray(model.inside[:, own[model.gain.shape[1] :]] @ parameters[own])


def _per_degree(model: BaseModel, parameters: Array, above: Mask) -> Array:
    """Change of the second bracket with the temperature, by the side of T0 [g/degC].

    A side without a level of its own is taken to have the slopes of the other one.
    """
    c = model.conditions
    sides = [side for side in SIDES if f"K0 {side}" in model.names]
    above = above if len(sides) > 1 else np.full(above.size, SIDES[0] in sides)
    gain, inside = model.split(parameters)
    acts = {"K0": np.ones_like(c.input), "K1": inside / gain}
    acts |= dict.fromkeys(("M", "M_O", "M_P"), c.cross)
    slope = np.zeros(c.input.size)
    for name, value in zip(model.names, parameters.tolist(), strict=True):
        for side, here in ((f" {SIDES[0]}", above), (f" {SIDES[1]}", ~above)):
            if name.endswith(side):
                slope += np.where(here, value * acts[name.removesuffix(side)], 0.0)
    return slope
