"""Options that several commands share, each a decorator that reads as ``@option.text(...)``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial, reduce, wraps
from typing import Any, TypeVar, cast

import click

from accelcal.cli import values
from accelcal.cli.files import PICTURE, REPORT, FileToRead, FileToWrite
from accelcal.errors import InputError

Function = TypeVar("Function", bound=Callable[..., Any])


def data(*, many: bool = False) -> Callable[[Function], Function]:
    """Argument DATA: the name of a table (``-`` is standard input), or with `many` a tuple of them.

    The file is not checked here but by its reader, so that every fault of a file is told in the
    same way.
    """
    if many:
        return click.argument("data", type=FileToRead(), metavar="DATA...", nargs=-1, required=True)
    return click.argument("data", type=FileToRead(), metavar="DATA")


def output(
    what: str,
    *,
    metavar: str = "FILE",
    required: bool = False,
    file: FileToWrite | None = None,
) -> Callable[[Function], Function]:
    """Option ``-o``: the file that receives `what`; the parameter is called ``path``."""
    return click.option(
        "-o",
        "--output",
        "path",
        type=file or FileToWrite(),
        metavar=metavar,
        required=required,
        help=f"Write {what} here.",
    )


def valued(
    kind: Any,
    flag: str,
    metavar: str | None,
    told: str,
    *,
    name: str | None = None,
    **attributes: Any,
) -> Callable[[Function], Function]:
    """Make an option that has a value, of a `kind` that makes it of the text; it is a decorator.

    `metavar` is its unit, symbol or kind of file, as the help shows it, `told` its help, and `name`
    the parameter of the command, where it is not that of the flag; others are those of
    `click.option`.
    """
    names = [flag] if name is None else [flag, name]
    return click.option(*names, type=kind, metavar=metavar, help=told, **attributes)


def flag(flag: str, told: str, *, name: str | None = None) -> Callable[[Function], Function]:
    """Make an option without a value; `told` is its help, `name` its parameter if another one."""
    return valued(None, flag, None, told, name=name, is_flag=True)


def choice(
    flag: str, choices: Sequence[str], told: str, *, name: str | None = None
) -> Callable[[Function], Function]:
    """Make an option that is one of some words; the first of them is the default."""
    kind = click.Choice(choices)
    return valued(kind, flag, None, told, name=name, default=choices[0], show_default=True)


text = partial(valued, values.label)
number = partial(valued, values.number)
acceleration = partial(valued, values.quantity("g", "acceleration"))
angle = partial(valued, values.size(values.quantity("rad", "angle", "acceleration")))
"""An option that is the size of an angle of the head [rad], or acceleration [g] that it makes."""

declared_acceleration = partial(valued, values.size(values.quantity_of_table("g", "acceleration")))
"""The size of an acceleration [g] that is declared of a table."""

declared_angle = partial(
    valued, values.size(values.quantity_of_table("rad", "angle", "acceleration"))
)
"""The size of an angle of the head [rad], or acceleration [g], that is declared of a table."""

ratio = partial(valued, values.size(values.quantity("1", "ratio")))
temperature = partial(valued, values.temperature_of_test)
degrees = partial(valued, values.size(values.quantity("degC", "temperature difference")))
seconds = partial(valued, values.quantity("s", "time"))
hours = partial(valued, values.quantity("h", "time"))
gravity = partial(valued, values.quantity("m/s^2", "gravity"), "--g", "M_S2")
file = partial(valued, FileToRead())
accelerations = partial(valued, values.quantities(values.quantity("g", "acceleration")))
angles = partial(valued, values.quantities(values.quantity("deg", "angle")))
temperatures = partial(valued, values.quantities(values.temperature))
count = partial(valued, click.IntRange(1))
seed = partial(valued, click.IntRange(0), "--seed", "N")
delta0 = partial(valued, values.fixture_angle, "--delta0", "RAD")


def picture(what: str) -> Callable[[Function], Function]:
    """Option ``--plot``: the file that a picture is drawn into; it is called ``picture``."""
    return valued(PICTURE, "--plot", "FILE", f"Draw {what}.", name="picture")


def together(*options: Callable[[Function], Function]) -> Callable[[Function], Function]:
    """Several options as one decorator, in the order of the help."""
    return lambda function: reduce(lambda made, option: option(made), reversed(options), function)


def effects(*users: str) -> Callable[[Function], Function]:
    """Option ``--effects``: effects of the user's own, in the catalogue while the command runs.

    Where `users`, parameters of the command, are named, they are of use with one of these alone.
    """
    declared = file(
        "--effects",
        "FILE.toml",
        "Your own effects, in addition to the catalogue; may be repeated.",
        name="effect_files",
        multiple=True,
    )

    def made(function: Function) -> Function:
        @declared
        @wraps(function)
        def command(*arguments: Any, effect_files: tuple[str, ...], **options: Any) -> Any:
            if not effect_files:
                return function(*arguments, **options)
            from accelcal.effects.catalogue import registered
            from accelcal.io.toml.effects import read_effects

            with registered(*(entry for path in effect_files for entry in read_effects(path))):
                _refuse_unused("--effects", users, options)
                return function(*arguments, **options)

        return cast("Function", command)

    return made


def _refuse_unused(flag: str, users: Sequence[str], options: Mapping[str, Any]) -> None:
    if users and not any(map(options.get, users)):
        params = click.get_current_context().command.params
        needed = " or ".join(param.opts[0] for param in params if param.name in users)
        raise InputError(f"{flag} has no effect without {needed}; give that, or leave it out")


def format(*forms: str) -> Callable[[Function], Function]:
    """Option ``--format``: form of the result on standard output; the first form is the default."""
    return choice("--format", forms, "Form of the result on standard output.", name="form")


reference_temperature = valued(
    values.temperature_of_table,
    "--t0",
    "DEG",
    "Reference temperature T0 [degC].",
    name="reference_temperature",
)

local_gravity = gravity("Local gravity [m/s^2].", name="local_gravity")

fixture_angle = delta0("Fixture angle between head zero and input axis, taken as given [rad].")

specification = file(
    "--spec", "SPEC.toml", "Judge against this data sheet; the exit code is 1 if a limit fails."
)

report = valued(
    REPORT, "--report", "FILE.(html|md|pdf)", "Write a report here as well.", name="page"
)

serial = text("--serial", "TEXT", "Serial number, if CAL.json holds several.")

declared_serial = text(
    "--serial",
    "TEXT",
    "Of tables with several serial numbers use this one; otherwise the tables are of this serial"
    " number, whatever they say.",
)

run = text("--run", "TEXT", "Use the table of this run only.")

mounting = click.option(
    "--mounting",
    type=click.Choice(["o+", "o-", "p+", "p-"]),
    help="Use the tables of this mounting only.",
)


def target(metavar: str, told: str) -> Callable[[Function], Function]:
    """Option ``--target``: uncertainties asked for, each a text by the name of its coefficient."""

    def told_apart(_: Any, __: Any, pairs: tuple[tuple[str, str], ...]) -> dict[str, str]:
        if len(dict(pairs)) < len(pairs):
            raise click.BadParameter("a coefficient has two targets; give one.")
        return dict(pairs)

    return valued(
        values.target, "--target", metavar, told, name="targets", multiple=True, callback=told_apart
    )


def plan(lead: str = "") -> Callable[[Function], Function]:
    """Options of a test that is planned, each told behind the lead."""

    def told(text: str) -> str:
        return lead + text if lead else text[0].upper() + text[1:]

    return together(
        count("--positions", "N", told("positions in a turn [default: 8].")),
        angles("--angles", "DEG,...", told("head angles instead of positions [deg].")),
        count("--strokes", "N", told("strokes in a run [default: 6].")),
        temperatures(
            "--temperatures",
            "DEG,...",
            told("temperatures in their order [default: 20,80,-40 degC]."),
        ),
    )


def _options_of_stand(angle: Any, acceleration: Any) -> Callable[[Function], Function]:
    return together(
        angle(
            "--head-uncertainty",
            "G",
            "Standard uncertainty of one head position [rad, or g: the same number].",
        ),
        acceleration(
            "--launch-uncertainty", "G", "Standard uncertainty of the bias from run to run [g]."
        ),
        ratio(
            "--launch-sf-uncertainty",
            "REL",
            "Relative standard uncertainty of the scale factor from run to run.",
        ),
    )


apparatus = together(
    _options_of_stand(declared_angle, declared_acceleration),
    degrees("--temperature-uncertainty", "DEG", "Standard uncertainty of a temperature [degC]."),
)
"""What is declared of head, launch and temperature, in place of the header lines of a table."""

planned_apparatus = _options_of_stand(angle, acceleration)
"""The same of a test that is planned."""

reading = together(
    reference_temperature,
    local_gravity,
    apparatus,
    valued(values.step_of_output, "--resolution", "U", "Step of the output [output unit]."),
    text("--unit", "UNIT", "Unit of the output, such as mA."),
    count("--positions", "N", "Positions in a turn."),
    text(
        "--serials",
        "TEXT,...",
        "Headings of the columns of several accelerometers that are read side by side.",
    ),
)
"""What is declared of a test, in place of the header lines of its table."""

calibration = together(
    choice(
        "--method",
        ("least-squares", "closed-form", "sign-corrected", "printed"),
        "Estimator; the last three are the closed forms (6) of the paper.",
    ),
    flag("--robust", "Reduce the effect of outliers, found by comparing the strokes."),
    reading,
    fixture_angle,
    text(
        "--coefficients",
        "NAME,...",
        "Coefficients to estimate, the others are taken as zero; a table that cannot separate"
        " them is refused [default: those of K0,K1,K2,K3,M,M_ip that it separates].",
    ),
    flag("--strict", "Refuse a table that cannot separate all six coefficients."),
    choice(
        "--temperature-laws",
        ("tables", "readings"),
        "Fit the temperature laws to the coefficients of the tables or to all readings.",
    ),
    file(
        "--model",
        "MODEL.json",
        "Remove the effects of this discovery; sizes that show are fitted again.",
    ),
    file(
        "--head",
        "HEAD.json|CERT.csv",
        "Correct for the errors of the head, from accelcal head or a certificate.",
    ),
    specification,
)
"""How a calibration is fitted, what is declared, what it is judged against."""
