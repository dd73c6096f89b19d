"""accelcal discover: name the effect that the model lacks."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from accelcal.cli import options as option
from accelcal.cli.deliver import remark_alike
from accelcal.cli.files import JSON, Command
from accelcal.cli.forms import deliver_forms, one_below_the_other
from accelcal.errors import AccelcalWarning, InputError

if TYPE_CHECKING:
    from accelcal.effects.effect import Effect
    from accelcal.record import TumbleRecord
    from accelcal.results.discovery import Discovery
    from accelcal.results.stand_discovery import StandDiscovery


@click.command(cls=Command)
@option.data(many=True)
@option.output("the discovery, with the extended model, as JSON", metavar="MODEL.json", file=JSON)
@option.effects()
@click.option(
    "--without",
    metavar="ID",
    multiple=True,
    help="Leave this effect out, as you know that the unit does not have it; may be repeated.",
)
@option.number(
    "--alpha",
    "P",
    "False-alarm rate over the whole catalogue below which an effect is named.",
    default=0.01,
    show_default=True,
)
@click.option(
    "--max-effects",
    type=click.IntRange(1, 5),
    default=3,
    show_default=True,
    help="Largest number of effects at once.",
)
@option.reference_temperature
@option.fixture_angle
@option.apparatus
@option.flag("--empirical", "Add a term for a pattern by head position that no effect explains.")
@option.seed("Seed of the simulated noise.", default=0, show_default=True)
@option.text("--serial", "TEXT", "Search this unit only, if the tables hold several.")
@option.report
@option.format("text", "json")
def discover(
    data: Sequence[str],
    path: str | None,
    without: Sequence[str],
    alpha: float,
    max_effects: int,
    delta0: float | None,
    empirical: bool,
    seed: int,
    serial: str | None,
    page: str | None,
    form: str,
    **declared: float | str | None,
) -> None:
    """Find and name the effects that the model lacks in DATA.

    Finds where model and readings disagree and searches the catalogue of effects. For each effect
    found: its size, the gap before and after, what else it could be, and what it changes in the
    coefficients. Also what this test cannot show. Readings need replicates: at least two cycles of
    a forward and a back stroke.

    Tables of several units with one plan count as measured on one stand: the result then tells
    effects of the stand from those of a unit, and what a joint estimate gains.

    \b
    Examples:
      accelcal discover table.csv
      accelcal discover unit1.csv unit2.csv unit3.csv
      accelcal discover table.csv --head-uncertainty 1e-5 -o model.json
      accelcal discover table.csv --effects mine.toml
      accelcal discover table.csv --without dead-zone
    """
    from accelcal.discovery.discover import discover as search
    from accelcal.io.of_serial import records_of_serial
    from accelcal.io.tables import read_tables
    from accelcal.results.documents.stored import all_to_json

    given = [record for source in data for record in read_tables(source, overrides=declared)]
    records = records_of_serial(given, serial)
    remark_alike(records)
    asked: dict[str, Any] = {"alpha": alpha, "max_effects": max_effects}
    asked |= {"delta0": delta0, "seed": seed, "effects": _searched(without)}
    with click.progressbar(
        records, label="searching", file=sys.stderr, hidden=not sys.stderr.isatty()
    ) as shown:
        found = [search(record, empirical=empirical, **asked) for record in shown]
    if path is not None or form == "json":  # the text and the page have no use for it
        found = list(map(_extended, found, records))
    stand, why_not = _stand(records, asked) if len(records) > 1 else (None, "")
    if page is not None:
        from accelcal.page.write import write_report

        write_report([*found, *filter(None, [stand])], page, records=records)
    told = [*map(str, found), *([str(stand or why_not)] if len(records) > 1 else [])]
    forms = {
        "text": lambda: one_below_the_other(told),
        "json": lambda: all_to_json(found, stand=stand),
    }
    deliver_forms(forms, path, form)


def _searched(without: Sequence[str]) -> list[Effect] | None:
    """Effects to look for; None for all."""
    from accelcal.effects.catalogue import catalogue, effect

    left_out = {effect(name).id for name in without}
    return [entry for entry in catalogue() if entry.id not in left_out] if left_out else None


def _extended(found: Discovery, record: TumbleRecord) -> Discovery:
    """Add the calibration with the effects, for `accelcal compare`; what it warns of, fit tells."""
    from accelcal.calibrate.fit import fit

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccelcalWarning)
            return replace(found, calibration=fit(record, model=found, delta0=found.delta0_rad))
    except InputError:
        return found


def _stand(
    records: Sequence[TumbleRecord], asked: dict[str, Any]
) -> tuple[StandDiscovery | None, str]:
    """What the units tell of their stand, or why they tell nothing."""
    from accelcal.discovery.stand.discover import discover_stand

    try:
        return discover_stand(records, **asked), ""
    except InputError as error:
        return None, f"STAND  not looked at: {error}"
