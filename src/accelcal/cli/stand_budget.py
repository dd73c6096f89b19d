"""accelcal budget --stand: the uncertainty of each coefficient by the errors of the stand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from accelcal.cli import options as option
from accelcal.cli.values import number, words
from accelcal.errors import InputError

if TYPE_CHECKING:
    from accelcal.accelerometer import Accelerometer
    from accelcal.record import TumbleRecord
    from accelcal.results.calibration import Calibration
    from accelcal.results.stand_budget import StandBudget

_PLAN = ("positions", "angles", "strokes", "temperatures", "mountings", "delta0")
_OWN = {"test", *_PLAN, "monte_carlo", "seed", "targets", "spec"}
"""Parameters that only a budget of the stand has."""
_SHARED = {"stand", "calibration", "path", "picture", "serial", "run", "mounting", "form"}
_ADAPTIVE = "adaptive"


def _trials(text: str) -> int | None:
    """Type of an option: a number of trials, or None for as many as it takes."""
    if text == _ADAPTIVE:
        return None
    value = number(text)
    if value != int(value) or value < 0:
        raise click.BadParameter(f"{text!r}; write a whole number, or {_ADAPTIVE}.")
    return int(value)


stand_options = option.together(
    option.file(
        "--stand",
        "STAND.toml",
        "Budget of this stand instead: uncertainty of each coefficient due to its errors.",
    ),
    option.file("--test", "DATA.csv", "With --stand: the test is that of this table."),
    option.plan("With --stand: "),
    option.valued(
        words,
        "--mountings",
        "SIDE,...",
        "With --stand: mountings o+, o-, p+, p- in their order [default: o+].",
    ),
    option.delta0("With --stand: fixture angle [default: 0 rad]."),
    option.valued(
        _trials,
        "--monte-carlo",
        "N",
        "With --stand: Monte Carlo with this number of trials, or `adaptive`.",
        default="0",
    ),
    option.seed("With --stand: seed of the Monte Carlo trials."),
    option.target(
        "NAME=SIZE",
        "With --stand: wanted expanded uncertainty, such as K1=5ppm or k0=10ug; gives what"
        " each instrument must be. May be repeated.",
    ),
    option.file(
        "--spec",
        "SPEC.toml",
        "With --stand: is the stand good enough for the limits of this data sheet?",
    ),
)
"""Of a budget of the stand."""


def asked_for_stand(context: click.Context) -> bool:
    """Tell whether the budget of a stand is asked for; refuse options that do not go with it.

    Raises
    ------
    InputError
        If options of the two budgets are mixed, neither a calibration nor a stand is given, a seed
        without trials, or a unit or mounting without a calibration to choose it from.
    """
    given = {
        name
        for name in context.params
        if context.get_parameter_source(name) is not ParameterSource.DEFAULT
    }
    flags = {item.name: item.opts[0] for item in context.command.params}
    asked = "stand" in given
    wrong = given - _SHARED - _OWN if asked else given & _OWN
    if wrong:
        flag = min(str(flags[name]) for name in wrong)
        raise InputError(
            f"{flag} tells of the error of an acceleration; leave it out with --stand"
            if asked
            else f"{flag} tells of a stand; add --stand STAND.toml"
        )
    if asked and "calibration" not in given and (chosen := given & {"serial", "run", "mounting"}):
        raise InputError(
            f"--{min(chosen)} chooses from CAL.json, and none is given; the test is described by"
            " --mountings and the other options of its plan"
        )
    if "seed" in given and context.params["monte_carlo"] == 0:
        raise InputError("--seed is that of Monte Carlo trials; add --monte-carlo N")
    if not asked and "calibration" not in given:
        raise InputError("neither CAL.json nor --stand STAND.toml; give one of them")
    return asked


def budget_of_stand(calibration: Calibration | None, options: Mapping[str, Any]) -> StandBudget:
    """Make the budget of a stand as the options ask for it.

    Without a calibration it is that of the AL-15.

    Raises
    ------
    InputError
        If the budget cannot be made.
    """
    from accelcal.accelerometer import AL15
    from accelcal.io.toml.specification import read_specification
    from accelcal.io.toml.stand import read_stand
    from accelcal.stand_uncertainty.budget import accelerometer_of, stand_budget
    from accelcal.stand_uncertainty.readings import StandError

    accelerometer = AL15 if calibration is None else accelerometer_of(calibration)
    stand = read_stand(options["stand"])
    specification = read_specification(options["spec"]) if options["spec"] else None
    try:
        return stand_budget(
            stand,
            _test(accelerometer, options),
            accelerometer,
            trials=options["monte_carlo"],
            seed=options["seed"],
            targets=options["targets"] or None,
            specification=specification,
        )
    except StandError as error:
        raise error.at(options["stand"]) from None


def _test(accelerometer: Accelerometer, options: Mapping[str, Any]) -> TumbleRecord:
    """The test: a table, or one that is planned."""
    given = {name: options[name] for name in _PLAN if options[name] is not None}
    if {"positions", "angles"} <= given.keys():
        raise InputError("--positions and --angles; give one of the two")
    if options["test"] is None:
        from accelcal.simulation import NOISE_FREE, TumblePlan, simulate

        return simulate(accelerometer, TumblePlan(**given, timed=True), NOISE_FREE, seed=0)
    if given:
        raise InputError(f"--test and --{min(given)} both tell the test; leave one of them out")
    from accelcal.io.tables import read_table

    return read_table(options["test"])
