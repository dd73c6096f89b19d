"""Simulation of a tumble test, reading by reading, from the product model of (1) and (4).

With dT = T - T0, at the true head angle and the true temperature, a reading is

    Y = K1(T) [k0(T) + a_i + k2 a_i^2 + k3 a_i^3 + delta(T) a_p + delta_ip a_i a_p]

with its noise, rounded to the step of the voltmeter. The bias k0, the scale factor K1 and the
misalignment delta follow bilinear laws with a break at T0. Nothing is expanded in small angles.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import count
from zlib import crc32

import numpy as np

from accelcal.accelerometer import AL15, Accelerometer, BilinearLaw
from accelcal.apparatus import Apparatus
from accelcal.arguments.kinds import each_of, expect, several
from accelcal.arguments.numbers import check_number, check_whole
from accelcal.arguments.options import check_flag
from accelcal.arguments.temperatures import check_temperature
from accelcal.arrays import Array, Ints, Numbers
from accelcal.effects.conditions import SECONDS_PER_READING, Conditions, conditions_of
from accelcal.effects.effect import ActsOn, Disturbance
from accelcal.errors import InputError
from accelcal.geometry import accelerations, checked_fixture_angle
from accelcal.head_angles import head_positions, turn_angles
from accelcal.record import TumbleRecord

__all__ = ["AL15", "NOISE_FREE", "Accelerometer", "BilinearLaw", "NoiseComponents"]
__all__ += ["TumblePlan", "simulate"]

_LARGEST = 1e12
"""No number of a test is larger."""

_SMALLEST_STEP = 1e-30
_MOST_READINGS = 1_000_000


@dataclass(frozen=True, slots=True)
class NoiseComponents:
    """Standard deviations of the random errors of a tumble test.

    Attributes
    ----------
    reading : float
        Noise, new in each reading [g at T0].
    head : float
        Angle error of a head position, the same in all strokes, runs and mountings [rad].
    launch : float
        Shift of the bias, new in each run [g].
    launch_sf : float
        Relative shift of the scale factor, new in each run [1].
    temperature : float
        True minus recorded temperature, new in each run [degC].

    Raises
    ------
    InputError
        If one is negative or not finite.

    Notes
    -----
    The paper gives its random errors as bounds at 3 sigma, and the defaults are a third of them.
    Head: "not more than 2e-5 g", which we read like the others, hence 6.7 urad (as a rectangular
    distribution it would be 11.5 urad). Launch: k0L = 2e-5 g; of the scale factor, k1 = 15 ppm.
    The chamber's 0.1 degC alone would move K1 by 50 ppm, so the 15 ppm already hold what of it is
    new in each run, and the default temperature error is 0. The reading noise is **set by us**.

    Examples
    --------
    >>> import accelcal
    >>> record = accelcal.simulate(noise=accelcal.NoiseComponents(head=2e-5), seed=1)
    >>> record.apparatus.head_uncertainty
    2e-05
    """

    reading: float = 5e-6
    head: float = 6.7e-6
    launch: float = 6.7e-6
    launch_sf: float = 5e-6
    temperature: float = 0.0

    def __post_init__(self) -> None:
        check_number(0.0, _LARGEST, **asdict(self))

    def declared(self) -> dict[str, float]:
        """Tell the errors of the stand as a record declares them.

        Returns
        -------
        dict of str to float
            For `accelcal.TumbleRecord.with_apparatus`.

        Examples
        --------
        >>> import accelcal
        >>> accelcal.NoiseComponents(launch=1e-5).declared()["launch_uncertainty"]
        1e-05
        """
        stand = ("head", "launch", "launch_sf", "temperature")
        return {f"{name}_uncertainty": getattr(self, name) for name in stand}


NOISE_FREE = NoiseComponents(0.0, 0.0, 0.0, 0.0, 0.0)
"""No random error at all."""


@dataclass(frozen=True, slots=True)
class TumblePlan:
    """How the test is made.

    Attributes
    ----------
    positions : int
        Number of positions in a turn; a stroke ends with the return to the first one.
    angles : sequence of float, optional
        Head angles of a forward stroke, instead of numbered positions [deg].
    strokes : int
        Strokes in a run; odd ones run forward, even ones back.
    temperatures : sequence of float
        Levels, in the order in which they are visited [degC]. All sequences are kept as tuples.
    mountings : sequence of str
        Each one of `accelcal.geometry.MOUNTINGS`, taken through all temperatures in turn.
    delta0 : float
        Fixture angle [rad].
    resolution : float
        Step of the output, 0 for none [output unit].
    seconds_per_reading, seconds_between_runs : float
        Time from one reading to the next, and added between runs [s].
    timed : bool
        True to write down the times.
    local_gravity : float, optional
        Declared local gravity [m/s^2].

    Raises
    ------
    InputError
        If a value breaks a rule.

    Examples
    --------
    >>> import accelcal
    >>> plan = accelcal.TumblePlan(positions=12, strokes=2, temperatures=(20.0,))
    >>> accelcal.simulate(plan=plan, seed=1)
    <TumbleRecord serial 'AL-15': 26 readings, 1 run, 12 positions>
    """

    positions: int = 8
    angles: Numbers | None = None
    strokes: int = 6
    temperatures: Numbers = (20.0, 80.0, -40.0)
    mountings: Sequence[str] = ("o+",)
    delta0: float = 0.0
    resolution: float = 0.0
    seconds_per_reading: float = SECONDS_PER_READING
    seconds_between_runs: float = 3600.0
    timed: bool = False
    local_gravity: float | None = None

    def __post_init__(self) -> None:
        self._complete()
        check_number(-_LARGEST, _LARGEST, **_numbered("angle", self.angles or ()))
        check_temperature(**_numbered("temperature", self.temperatures))
        checked_fixture_angle(self.delta0)
        check_number(0.0, _LARGEST, resolution=self.resolution)
        check_number(_SMALLEST_STEP, resolution=self.resolution or 1.0)
        check_number(0.0, _LARGEST, seconds_between_runs=self.seconds_between_runs)
        check_number(1e-9, _LARGEST, seconds_per_reading=self.seconds_per_reading)
        check_flag(timed=self.timed)
        Apparatus(local_gravity=self.local_gravity)  # refuses what is found nowhere on Earth
        accelerations(0.0, mounting=self.mountings)  # refuses an unknown mounting
        if self.readings > _MOST_READINGS:
            raise InputError(
                f"a test of {self.readings} readings; at most {_MOST_READINGS} are made, so"
                " give fewer positions, strokes, temperatures or mountings"
            )

    def _complete(self) -> None:
        """Take lists and single values as tuples, and whole numbers as such."""
        check_whole(2, positions=self.positions)
        check_whole(1, strokes=self.strokes)
        for name in ("positions", "strokes"):
            object.__setattr__(self, name, int(getattr(self, name)))
        for name in ("angles", "temperatures", "mountings"):
            given = getattr(self, name)
            found = None if given is None and name == "angles" else several(given)
            if found == ():
                raise InputError(f"{name} is empty; a test has one or more")
            object.__setattr__(self, name, found)

    @property
    def stops(self) -> Array:
        """Head angles of a forward stroke in their order, repeats and the return included [deg]."""
        return turn_angles(self.positions) if self.angles is None else np.array(self.angles, float)

    @property
    def readings(self) -> int:
        """Number of readings of the whole test."""
        stops = self.positions + 1 if self.angles is None else len(self.angles)
        return stops * self.strokes * len(self.temperatures) * len(self.mountings)


def _numbered(name: str, values: Numbers) -> dict[str, float]:
    """Values by the names that messages give them, as in ``angle 3``."""
    return {f"{name} {number}": value for number, value in enumerate(values, 1)}


def simulate(
    accelerometer: Accelerometer = AL15,
    plan: TumblePlan = TumblePlan(),
    noise: NoiseComponents = NoiseComponents(),
    effects: Iterable[Disturbance] = (),
    *,
    seed: int | None = None,
    declare: bool = True,
) -> TumbleRecord:
    """Simulate the readings of a tumble test.

    Parameters
    ----------
    accelerometer : Accelerometer, default `AL15`
        The true coefficients.
    plan : TumblePlan, optional
        How the test is made.
    noise : NoiseComponents, optional
        The random errors.
    effects : iterable of Disturbance, optional
        Effects that the model does not have, from ``effect(id).of(value)``. Faults of the
        readings act one after the other.
    seed : int, optional
        Seed of the random errors. Each component and each effect draws from a stream of its own,
        so that leaving one out does not change the others. Without a seed, one is made up.
    declare : bool, default True
        Declare the noise components and the fixture angle, as a laboratory does.

    Returns
    -------
    TumbleRecord
        The readings in the order of measuring; the metadata tell the seed and the effects.

    Raises
    ------
    InputError
        If an effect does not fit the plan, or an argument is none.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.simulate(effects=[accelcal.effect("backlash").of(2e-5)], seed=15)
    <TumbleRecord serial 'AL-15': 162 readings, 3 runs, 8 positions>
    """
    if seed is None:
        seed = int(np.random.default_rng().integers(2**32))
    check_whole(0, seed=seed)
    check_flag(declare=declare)
    expect(accelerometer, Accelerometer)
    expect(plan, TumblePlan)
    expect(noise, NoiseComponents)
    run = _Simulation(accelerometer, plan, noise, each_of(effects, Disturbance), int(seed))
    blank = _blank(accelerometer, plan)
    record = replace(
        blank,
        output=_rounded(run.output(run.true_conditions(blank)), plan.resolution),
        time=blank.time if plan.timed else None,
        metadata={"simulated": ", ".join([f"seed {run.seed}", *map(str, run.effects)])},
    )
    return run.declared_in(record) if declare else record


@dataclass(frozen=True, slots=True)
class _Simulation:
    """What goes into the readings."""

    accelerometer: Accelerometer
    plan: TumblePlan
    noise: NoiseComponents
    effects: tuple[Disturbance, ...]
    seed: int

    def true_conditions(self, blank: TumbleRecord) -> Conditions:
        """Conditions at the true head angles and temperatures, with the true indication."""
        c = conditions_of(blank, self.accelerometer.reference_temperature, self.plan.delta0)
        _, head_position = np.unique(head_positions(c.angle), return_inverse=True)
        turned = self.errors("head", head_position) + self.total("angle", c)
        angle = c.angle + np.degrees(turned)
        excess = c.excess + self.errors("temperature", c.run) + self.total("temperature", c)
        sensed = accelerations(angle, self.plan.delta0, blank.mounting)
        a_i, a_p = sensed.input, sensed.cross
        misalignment = self.accelerometer.misalignment
        return replace(
            c,
            angle=angle,
            input=a_i,
            cross=a_p,
            axial=a_i + (misalignment.at_T0 + misalignment.change(excess)) * a_p,
            excess=excess,
            gain=1.0 + self.accelerometer.scale_factor.change(excess),
            indicated=self.accelerometer.indication(a_i, a_p, excess),
        )

    def output(self, c: Conditions) -> Array:
        """Output with its noise and its faults [output unit]."""
        nominal = self.accelerometer.scale_factor.at_T0
        scale_factor = nominal * c.gain * (1.0 + self.errors("launch_sf", c.run))
        bias = self.errors("launch", c.run) + self.total("output", c)
        output = scale_factor * (c.indicated + bias)
        output += nominal * self.errors("reading", c.number - 1)
        for index, item in enumerate(self.effects):
            if item.effect.acts_on == "readings":
                output += nominal * self.change(index, replace(c, indicated=output / nominal))
        return output

    def declared_in(self, record: TumbleRecord) -> TumbleRecord:
        """Add what a laboratory would declare of the test."""
        fixture = {"delta0": repr(self.plan.delta0)} if self.plan.delta0 else {}
        step = self.plan.resolution or None
        declared = record.with_apparatus(resolution=step, **self.noise.declared())
        return replace(declared, metadata={**record.metadata, **fixture})

    def errors(self, component: str, owner: Ints) -> Array:
        """Errors of a noise component, the same for all readings of one owner (0, 1, ...)."""
        sigma: float = getattr(self.noise, component)
        return sigma * self.draws(component, int(owner.max()) + 1)[owner]

    def total(self, acts_on: ActsOn, c: Conditions) -> Array:
        """Sum of the effects that act on one thing."""
        acting = [i for i, item in enumerate(self.effects) if item.effect.acts_on == acts_on]
        return sum((self.change(i, c) for i in acting), start=np.zeros(c.angle.size))

    def change(self, index: int, c: Conditions) -> Array:
        """Change by one of the effects, with random numbers of its own."""
        names = [item.effect.id for item in self.effects]
        repeat = names[:index].count(names[index])
        draws = self.draws(names[index], c.angle.size, repeat)
        return self.effects[index].change(replace(c, draws=draws))

    def draws(self, name: str, size: int, repeat: int = 0) -> Array:
        """Standard normal numbers from a stream of this name only."""
        stream = np.random.SeedSequence(self.seed, spawn_key=(crc32(name.encode()), repeat))
        return np.random.default_rng(stream).standard_normal(size)


def _blank(accelerometer: Accelerometer, plan: TumblePlan) -> TumbleRecord:
    """Form of the readings, in the order of measuring, with nothing written in it."""
    angles = plan.stops
    numbers = np.arange(1, angles.size + 1) * (plan.angles is None)  # 0: the angle was given
    forward = np.arange(angles.size)
    strokes = np.tile(np.concatenate([forward, forward[::-1]]), (plan.strokes + 1) // 2)
    in_run = strokes[: plan.strokes * angles.size]
    visits = [(side, level) for side in plan.mountings for level in plan.temperatures]
    run = np.repeat(np.arange(len(visits)), in_run.size)
    place = np.tile(in_run, len(visits))
    waited = run * plan.seconds_between_runs
    stroke = np.repeat(np.arange(plan.strokes), angles.size) + _repeats(angles, plan.strokes)
    return TumbleRecord(
        output=np.zeros(run.size),
        angle=angles[place],
        temperature=np.array([level for _, level in visits], dtype=np.float64)[run],
        stroke=np.tile(stroke, len(visits)) + 1,
        run=run,
        run_labels=tuple(str(index + 1) for index in range(len(visits))),
        mounting=np.array([side for side, _ in visits])[run],
        position=numbers[place],
        time=np.arange(run.size) * plan.seconds_per_reading + waited,
        serial=accelerometer.serial,
        unit=accelerometer.unit,
        positions=plan.positions,
        reference_temperature=accelerometer.reference_temperature,
        apparatus=Apparatus(local_gravity=plan.local_gravity),
        source="<simulated>",
    )


def _repeats(angles: Array, strokes: int) -> Ints:
    """What to add to the stroke of each reading of a run.

    A table tells readings apart by stroke and angle. So a second reading at a stop counts as one of
    a later stroke in the same sense of rotation.
    """
    earlier: list[int] = []
    for side in (angles, angles[::-1]):
        met: defaultdict[float, count[int]] = defaultdict(count)
        earlier += [next(met[angle]) for angle in side.tolist()]
    later = np.tile(np.array(earlier), (strokes + 1) // 2)[: strokes * angles.size]
    return later * (strokes + strokes % 2)


def _rounded(output: Array, step: float) -> Array:
    """Multiples of the step, without the dust of binary fractions."""
    if step == 0.0:
        return output
    return np.round(step * np.round(output / step), 6 - math.floor(math.log10(step)))
