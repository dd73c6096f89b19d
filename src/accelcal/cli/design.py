"""accelcal design: tests compared before anyone books the stand, and the best one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import deliver, deliver_picture
from accelcal.cli.files import JSON, Command, FileToWrite
from accelcal.cli.forms import deliver_result
from accelcal.cli.values import number, words
from accelcal.errors import InputError

if TYPE_CHECKING:
    from accelcal.planning.pace import Pace
    from accelcal.simulation import NoiseComponents


def whole_numbers(text: str) -> tuple[int, ...]:
    """Type of an option: whole numbers above zero separated by commas, as in ``6,8,12``."""
    found = tuple(number(item) for item in text.split(","))
    if any(value < 1.0 or value != int(value) for value in found):
        raise click.BadParameter(f"{text!r}: write whole numbers above zero, as 6,8,12.")
    return tuple(map(int, found))


@click.command(cls=Command)
@option.output("the document (JSON)", metavar="DESIGN.json", file=JSON)
@option.valued(
    whole_numbers,
    "--positions",
    "N,...",
    "Equally spaced positions in a turn [default: 4,6,8,12,16,24,36; none with --angles].",
)
@option.angles(
    "--angles", "DEG,...", "Your own head angles of a stroke [deg]; may be repeated.", multiple=True
)
@option.valued(whole_numbers, "--strokes", "N,...", "Strokes in a run [default: 2,6].")
@option.valued(whole_numbers, "--cycles", "N,...", "Strokes in cycles, forward and back.")
@option.temperatures(
    "--temperatures",
    "DEG,...",
    "Temperatures in their order [default: -40,20,80 degC]; may be repeated.",
    multiple=True,
)
@option.valued(
    words,
    "--mountings",
    "SIDE,...",
    "Mountings o+, o-, p+ or p- in their order [default: o+]; may be repeated.",
    multiple=True,
)
@option.seconds("--reading-time", "S", "Time of a reading [default: 60 s].")
@option.seconds("--turn-time", "S", "Time between positions [default: 30 s].")
@option.hours("--soak-time", "H", "Time to reach a temperature [default: 2 h].")
@option.hours("--mount-time", "H", "Time to mount the unit [default: 1 h].")
@option.acceleration("--noise", "G", "Noise of a reading [default: 5e-6 g].")
@option.planned_apparatus
@option.degrees(
    "--temperature-uncertainty",
    "DEG",
    "Standard uncertainty of the temperature of a run [default: 0 degC].",
)
@option.acceleration("--resolution", "G", "Step of the readings [default: 0 g].", default="0")
@option.flag("--undeclared", "The errors of the stand will not be declared to the fit.")
@option.hours("--hours", "H", "Longest duration; strokes fill it [h].")
@option.target("NAME=U", "Wanted standard uncertainty, such as K1=5ppm; may be repeated.")
@option.text(
    "--optimal", "WHAT", "Find the best angles within --hours: D, A, or one coefficient such as K1."
)
@option.number(
    "--spacing", "DEG", "Smallest distance of two positions for --optimal [default: 15 deg]."
)
@option.seed("Seed of --optimal [default: 0].")
@option.valued(
    FileToWrite("CSV", ".csv"),
    "--sheet",
    "PLAN.csv",
    "Write the test plan as a sheet to fill in at the laboratory.",
)
@option.flag("--no-effects", "Do not examine the effects of the catalogue.")
@option.effects()
@option.picture("uncertainty by hours (png, svg or pdf)")
@option.format("text", "json", "csv")
def design(
    path: str | None, form: str, picture: str | None, sheet: str | None, **options: Any
) -> None:
    """Compare test plans, or find the best angles, for a tumble test.

    All choices of positions, strokes, temperatures and mountings are combined. For each test the
    result has the expected standard uncertainty of every coefficient and temperature slope, the
    hours, what cannot be separated, and which effects would be visible.

    \b
    Examples:
      accelcal design
      accelcal design --positions 6,8,12,24 --hours 12 --target K1=9ppm --plot design.png
      accelcal design --positions 8 --strokes 6 --mountings o+ --mountings o+,o-
      accelcal design --optimal D --hours 12 --sheet plan.csv
    """
    given = _arguments(options)
    for name in ("seed", "spacing"):
        if options[name] is not None and not options["optimal"]:
            raise InputError(f"--{name} is for --optimal, which finds angles; leave it out")
    found = _optimum(options, given) if options["optimal"] else _comparison(given)
    if sheet is not None:
        _write_sheet(found, given, sheet)
    deliver_picture(lambda: found.plot.hours(), picture)
    deliver_result(found, path, form)


def _arguments(options: dict[str, Any]) -> dict[str, Any]:
    strokes = options["strokes"] or tuple(2 * n for n in options["cycles"] or ())
    if options["strokes"] and options["cycles"]:
        raise InputError("--strokes and --cycles say the same; give one of them")
    given = {
        "noise": _noise(options),
        "pace": _pace(options),
        "strokes": strokes,
        "resolution": options["resolution"],
        "hours": options["hours"],
        "targets": options["targets"],
        "declare": not options["undeclared"],
        "effects": not options["no_effects"],
    }
    named = ("positions", "angles", "temperatures", "mountings")
    given |= {name: options[name] for name in named if options[name]}
    if options["angles"] and not options["positions"]:
        given["positions"] = ()
    return given


def _noise(options: dict[str, Any]) -> NoiseComponents:
    from accelcal.simulation import NoiseComponents

    fields = {"reading": "noise"} | {
        name: f"{name}_uncertainty" for name in ("head", "launch", "launch_sf", "temperature")
    }
    given = {field: options[option] for field, option in fields.items()}
    return NoiseComponents(**{field: size for field, size in given.items() if size is not None})


def _pace(options: dict[str, Any]) -> Pace:
    from accelcal.planning.pace import Pace

    given = {name: options[f"{name}_time"] for name in ("reading", "turn", "soak", "mount")}
    return Pace(**{name: value for name, value in given.items() if value is not None})


def _comparison(given: dict[str, Any]) -> Any:
    from accelcal.planning.compare import design as compare

    return compare(**given)


def _optimum(options: dict[str, Any], given: dict[str, Any]) -> Any:
    from accelcal.planning.optimum import optimal_design

    for name in ("positions", "angles"):
        if options[name]:
            raise InputError(f"--{name} beside --optimal, which finds the angles; leave one out")
    for name in ("strokes", "temperatures", "mountings"):
        if len(given.get(name, ())) > 1:
            raise InputError(
                f"--optimal is for one choice of {name}; give --{name} once, one choice"
            )
        if given.get(name):
            given[name] = given[name][0]
    if options["hours"] is None:
        raise InputError("--optimal needs --hours, the time that the test may take")
    if options["spacing"] is not None:
        given["spacing"] = options["spacing"]
    given["effects"] = False  # the text has no room for them: give its angles to `design` instead
    chosen = {name: value for name, value in given.items() if name != "strokes" or value}
    return optimal_design(options["optimal"], seed=options["seed"] or 0, **chosen)


def _write_sheet(found: Any, given: dict[str, Any], path: str) -> None:
    from accelcal.planning.sheet import sheet

    if len(found.designs) != 1 and not hasattr(found, "best"):
        raise InputError(
            f"--sheet is for one test, and these are {len(found.designs)}; give one choice of"
            " positions and strokes, or --optimal"
        )
    chosen = found.best if hasattr(found, "best") else found.designs[0]
    noise = given["noise"] if given["declare"] else None
    deliver(sheet(chosen, noise, resolution=given["resolution"]), path)
