"""accelcal budget: the error (4) of a measured acceleration, split by component."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import deliver_picture
from accelcal.cli.files import JSON, Command, FileToRead
from accelcal.cli.forms import deliver_result
from accelcal.cli.stand_budget import asked_for_stand, budget_of_stand, stand_options
from accelcal.cli.values import durations
from accelcal.errors import DocumentError, InputError
from accelcal.units import HOUR

if TYPE_CHECKING:
    from accelcal.error_budget.random_part import RandomPart
    from accelcal.results.calibration import Calibration
    from accelcal.results.error_budget import ErrorBudget
    from accelcal.results.stability import Stability
    from accelcal.results.stand_budget import StandBudget


@click.command(cls=Command)
@click.argument("calibration", type=FileToRead(), metavar="CAL.json", required=False)
@option.output("the budget as JSON", metavar="BUDGET.json", file=JSON)
@option.accelerations(
    "--acceleration",
    "G,...",
    "Accelerations a_i along the input axis [local g].",
    default="1",
    show_default=True,
)
@option.acceleration("--a-p", "G", "Along the pendulous axis [local g].", default="0")
@option.acceleration("--a-o", "G", "Along the output axis [local g].", default="0")
@option.temperatures("--temperature", "DEG,...", "Temperatures [degC; default: T0].")
@option.valued(
    durations,
    "--time",
    "T,...",
    "Times since the start of the launch, such as 600, 10min or 12h [s].",
    default="0",
    show_default=True,
)
@option.file("--stability", "STABILITY.json", "Result of accelcal stability.")
@option.acceleration("--launch", "G", "Launch-to-launch bias k0L [g].")
@option.number("--drift-rate", "G_PER_H", "Drift gamma_D [g/h].")
@option.acceleration("--fluctuation", "G", "Fluctuation k0F [g].")
@option.acceleration("--hysteresis", "G", "Hysteresis h_T [g].")
@option.acceleration("--threshold", "G", "Threshold p [g].")
@option.ratio("--scale-factor-instability", "REL", "Instability k1 of the scale factor, relative.")
@option.number(
    "--factor",
    "T_P",
    "Number of standard deviations that k0L, k0F, h_T and k1 stand for.",
    default=3.0,
    show_default=True,
)
@option.degrees(
    "--temperature-uncertainty",
    "DEG",
    "Standard uncertainty of the temperature [degC].",
    default="0",
)
@option.flag("--exact", "Use (K1 - K1N)/K1 of (2), not its first order.")
@option.flag("--extrapolate", "Allow temperatures outside the calibrated range.")
@stand_options
@option.serial
@option.run
@option.mounting
@option.picture("the budget (png, svg or pdf)")
@option.format("text", "json", "csv")
def budget(
    calibration: str | None,
    path: str | None,
    picture: str | None,
    serial: str | None,
    run: str | None,
    mounting: str | None,
    form: str,
    **options: Any,
) -> None:
    """Give the error budget of accelerations, or of a test stand.

    With the calibration CAL.json it gives the systematic error and its band, component by
    component, in two ways: the bound of (4), which adds the bounds linearly, with the factor 0.5 of
    (3) as in the paper; and the expanded uncertainty of the GUM (95 %), which adds variances and
    includes the uncertainty of the calibration. All accelerations, temperatures and times are
    combined with each other. The random errors are those of the options, else of STABILITY.json,
    else of the calibration.

    With --stand STAND.toml it gives the uncertainty of each coefficient due to each error of the
    stand, for the accelerometer of CAL.json or the AL-15, in the test that the options describe.

    \b
    Examples:
      accelcal budget cal.json --acceleration 0,1 --temperature -40,20,80
      accelcal budget cal.json --temperature 80 --time 12h --launch 2e-5 --fluctuation 2e-5
      accelcal budget cal.json --acceleration -1,0,1 --hysteresis 3e-4 --plot budget.png
      accelcal budget --stand examples/paper-stand.toml --monte-carlo adaptive --seed 1
      accelcal budget --stand stand.toml cal.json --positions 12 --target K1=20ppm
    """
    of_stand = asked_for_stand(click.get_current_context())
    chosen = _calibration(calibration, serial, run, mounting) if calibration else None
    if of_stand:
        found: ErrorBudget | StandBudget = budget_of_stand(chosen, options)
    else:
        assert chosen is not None
        found = _budget(chosen, _random(chosen, options), options)
    deliver_picture(lambda: _drawn(found), picture)
    deliver_result(found, path, form)


def _calibration(
    path: str, serial: str | None, run: str | None, mounting: str | None
) -> Calibration:
    from accelcal.io.documents import read_results
    from accelcal.results.calibration import Calibration

    found: Calibration = read_results(path, Calibration).choose(serial, mounting)
    return found if run is None else found.of_run(run)


def _random(calibration: Calibration, options: dict[str, Any]) -> RandomPart:
    from accelcal.error_budget.random_part import random_part

    per_hour = options["drift_rate"]
    names = "factor launch fluctuation hysteresis threshold scale_factor_instability"
    try:
        return random_part(
            calibration,
            _stability(options["stability"]),
            drift_rate=None if per_hour is None else per_hour / HOUR,
            **{name: options[name] for name in names.split()},
        )
    except DocumentError as error:
        raise error.at(options["stability"]) from None


def _stability(path: str | None) -> Stability | None:
    if path is None:
        return None
    from accelcal.io.files.text import read_text
    from accelcal.results.documents.stored import all_from_json
    from accelcal.results.stability import Stability

    (found,) = all_from_json(Stability, read_text(path, "stability test").text)
    return found


def _budget(calibration: Calibration, random: RandomPart, options: dict[str, Any]) -> ErrorBudget:
    from itertools import product

    import numpy as np

    from accelcal.error_budget.budget import budget as budget_of

    lists: Sequence[Sequence[float | None]] = (
        options["time"],
        options["temperature"] or (None,),
        options["acceleration"],
    )
    time, temperature, a_i = zip(*product(*lists), strict=True)
    names = "a_p a_o temperature_uncertainty exact extrapolate"
    with np.errstate(over="ignore", invalid="ignore"):
        found = budget_of(
            calibration,
            a_i,
            temperature=temperature if options["temperature"] else None,
            time=time,
            random=random,
            **{name: options[name] for name in names.split()},
        )
    if not np.isfinite([found.systematic, found.expanded_uncertainty]).all():
        raise InputError("the error is too large to be a number; check calibration and options")
    return found


def _drawn(found: ErrorBudget | StandBudget) -> Any:
    from accelcal.results.stand_budget import StandBudget

    return found.plot.pareto() if isinstance(found, StandBudget) else found.plot.stack()
