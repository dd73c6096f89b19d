"""accelcal simulate: the readings of a tumble test, simulated."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import deliver
from accelcal.cli.files import Command, SimulatedTable
from accelcal.cli.values import setting, step_of_output, words
from accelcal.errors import InputError

if TYPE_CHECKING:
    from accelcal.discovery.in_use.twin import Twin
    from accelcal.effects.effect import Effect
    from accelcal.record import TumbleRecord

Settings = list[tuple[str, float]]


def settings(text: str) -> Settings:
    """Type of an option: names and their numbers, as in ``warm-up=1e-4,tau=900``."""
    return [setting(item) for item in text.split(",")]


@click.command(cls=Command)
@option.output("the table", metavar="DATA.csv", file=SimulatedTable())
@option.valued(
    settings,
    "--effect",
    "ID=VALUE[,NAME=VALUE...]",
    "An effect that the model does not have; may be repeated.",
    name="effects",
    multiple=True,
)
@option.effects("effects", "list_effects", "model")
@option.flag("--list-effects", "List the effects with their units, and stop.")
@option.seed("Seed of the random errors.")
@option.plan()
@click.option(
    "--mountings",
    "--mounting",
    type=words,
    metavar="SIDE,...",
    help="Mountings o+, o-, p+ or p-, each at all temperatures [default: o+].",
    multiple=True,
)
@option.delta0("Fixture angle [default: 0 rad].")
@option.acceleration("--reading-noise", "G", "Noise of a reading [default: 5e-6 g].")
@option.angle("--head-error", "RAD", "Error of a head position [default: 6.7e-6 rad].")
@option.acceleration(
    "--launch-shift", "G", "Shift of the bias from run to run [default: 6.7e-6 g]."
)
@option.ratio(
    "--launch-sf-shift",
    "REL",
    "Relative shift of the scale factor from run to run [default: 5e-6].",
)
@option.degrees(
    "--temperature-error",
    "DEG",
    "True minus recorded temperature, from run to run [default: 0 degC].",
)
@option.valued(
    step_of_output,
    "--resolution",
    "MA",
    "Step of the output, 0 for none [default: 1e-7 mA].",
    default="1e-7",
)
@option.flag("--times", "Write a column of times.", name="timed")
@option.flag("--undeclared", "Do not declare the uncertainties in the header.")
@option.gravity("Local gravity to declare [m/s^2].", name="local_gravity")
@option.text(
    "--serial",
    "TEXT",
    "Serial number [default: AL-15]; selects the unit if MODEL.json holds several.",
)
@option.file(
    "--model", "MODEL.json", "Simulate the accelerometer, noise and effects of this discovery."
)
def simulate(path: str | None, list_effects: bool, **options: Any) -> None:
    """Simulate a tumble test, of the AL-15 of the paper by default.

    Each reading is computed from the true head angle and temperature, with random errors that are
    given as standard deviations. A stroke ends with the return to its first position. Without -o
    the table goes to standard output. A file that is no simulated table is not overwritten.

    \b
    Examples:
      accelcal simulate --seed 15 -o al15.csv
      accelcal simulate --effect backlash=2e-5 --effect warm-up=1e-4,tau=900 --seed 1
      accelcal simulate --positions 12 --strokes 2 --temperatures 20
      accelcal simulate --effects mine.toml --effect my-id=1e-5
    """
    if list_effects:
        from accelcal.effects.catalogue import catalogue

        deliver("\n".join(map(_described, catalogue())), path)
        return
    from accelcal.io.writer import write_table

    record = _simulated(options)
    if path not in (None, "-"):
        write_table(record, path)
        return
    import io

    text = io.StringIO()
    write_table(record, text)
    deliver(text.getvalue())


_NOISE = {
    "reading_noise": "reading",
    "head_error": "head",
    "launch_shift": "launch",
    "launch_sf_shift": "launch_sf",
    "temperature_error": "temperature",
}
"""Option -> field of `NoiseComponents`."""


def _simulated(options: dict[str, Any]) -> TumbleRecord:
    from dataclasses import fields, replace

    from accelcal.effects.catalogue import effect
    from accelcal.simulation import TumblePlan
    from accelcal.simulation import simulate as run

    accelerometer, noise, effects = _simulated_model(options.pop("model"), options["serial"])
    options["mountings"] = tuple(side for sides in options["mountings"] for side in sides)
    given = {name: value for name, value in options.items() if value not in (None, ())}
    if {"positions", "angles"} <= given.keys():
        raise InputError("--positions and --angles; give one of the two")
    if "serial" in given:
        accelerometer = replace(accelerometer, serial=given["serial"])
    given["resolution"] = _resolution(given["resolution"], accelerometer.unit)
    planned = [item.name for item in fields(TumblePlan) if item.name in given]
    return run(
        accelerometer,
        TumblePlan(**{name: given[name] for name in planned}),
        replace(noise, **{_NOISE[name]: given[name] for name in _NOISE if name in given}),
        [
            *effects,
            *(effect(name).of(value, **dict(rest)) for (name, value), *rest in options["effects"]),
        ],
        seed=given.get("seed"),
        declare=not given["undeclared"],
    )


def _resolution(step: float | str, unit: str | None) -> float:
    """Step in the unit of the outputs."""
    if not isinstance(step, str):
        return step
    from accelcal.io.values.cells import number_and_unit
    from accelcal.units import conversion_factor, scaled

    number, own = number_and_unit(step, ".")
    factor = conversion_factor(own, unit or "")
    if factor is None:
        outputs = f"outputs are in {unit}" if unit else "the unit of the outputs is not known"
        raise InputError(f"--resolution {step!r}: {outputs}; give it in that unit")
    return scaled(number, factor)


def _simulated_model(path: str | None, serial: str | None) -> Twin:
    """Accelerometer, noise and effects: those of a discovery, or of the AL-15."""
    from accelcal.discovery.in_use.twin import Twin, twin

    if path is None:
        from accelcal.simulation import AL15, NoiseComponents

        return Twin(AL15, NoiseComponents(), ())
    from accelcal.io.documents import read_models

    return twin(read_models(path).model_of(serial))


def _described(entry: Effect) -> str:
    first, *others = entry.parameters
    more = "".join(f",{item.name}={item.default:g} [{item.unit}]" for item in others)
    meanings = "; ".join(f"{item.name}: {item.meaning}" for item in entry.parameters)
    return (
        f"{entry.id}={first.name.upper()} [{first.unit}]{more}\n"
        f"    {entry.physics}\n    {meanings}."
    )
