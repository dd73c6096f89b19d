"""A comparison of a calibration with a record, told in text."""

from __future__ import annotations

from collections.abc import Iterator

from accelcal.report.findings import chance, headline, noise_line, where_lines
from accelcal.report.lines import aligned, notes, sections, unit_of, wrapped
from accelcal.report.numbers import in_millionths, significant
from accelcal.results.disagreement import Disagreement
from accelcal.results.quantity import Quantity
from accelcal.units import MICRO

_NOT_TOLD = "not told"


def text(found: Disagreement) -> str:
    """Tell a comparison in lines of at most 100 characters."""
    where = where_lines(found.where, found.structure) if found.structure else ()
    return sections(_head(found), _verdict(found), where, _runs(found), notes(found.notes))


def _head(found: Disagreement) -> Iterator[str]:
    unit = unit_of(found.serial, found.source)
    yield from wrapped(f"COMPARISON  {unit}, {found.readings} readings, with {found.calibration}")
    if found.effects:
        yield from wrapped(f"effects in the calibration: {', '.join(found.effects)}")
    yield from wrapped(noise_line(found.noise))
    if found.same_head is not None:
        heads = "one, whose errors are common to" if found.same_head else "one each, of"
        yield f"heads: {heads} calibration and record"


def _verdict(found: Disagreement) -> Iterator[str]:
    told = headline("Simulation and measurement", found.verdict, found.hidden_by)
    yield from wrapped(f"{told} ({chance(found.p_value)})")
    yield (
        f"gap {significant(found.rms * MICRO, 3)} ug rms; chi^2 per reading"
        f" {significant(found.reduced_chi2, 3)}"
    )


def _runs(found: Disagreement) -> Iterator[str]:
    yield "Changes since the calibration, run by run (95 %)"
    yield from aligned(run_rows(found), right={1, 2, 3, 4, 5}, indent="  ")
    if rows := shape_rows(found):
        yield from aligned(rows, right={1, 2, 3}, indent="  ")
    changes = [change for run in found.runs for change in run.changes]
    if found.verdict == "disagree" and not any(change.is_off_zero for change in changes):
        yield "  each interval holds 0, as it leaves the others free; the factors above see more"


def run_rows(found: Disagreement) -> list[tuple[str, ...]]:
    """Tell what has changed in each run, with a heading."""
    rows: list[tuple[str, ...]] = [
        ("run", "degC", "rms/ug", "bias/ug", "scale factor/ppm", "misalignment/urad")
    ]
    rows += [
        (
            name,
            "" if change.temperature_degC is None else f"{change.temperature_degC:.1f}",
            significant(change.rms * MICRO, 3),
            _micro(change.bias),
            _micro(change.scale_factor),
            _micro(change.misalignment),
        )
        for name, change in zip(found.run_names, found.runs, strict=True)
    ]
    return rows


def shape_rows(found: Disagreement) -> list[tuple[str, ...]]:
    """Tell how the shape has changed in each run, with a heading; empty where no run tells it."""
    rows = [
        (name, *map(_micro, (change.k2, change.k3, change.delta_ip)))
        for name, change in zip(found.run_names, found.runs, strict=True)
    ]
    told = any(set(cells) != {_NOT_TOLD} for _, *cells in rows)
    return [("run", "k2/(ug/g^2)", "k3/(ug/g^3)", "delta_ip/(ug/g^2)"), *rows] if told else []


def _micro(quantity: Quantity) -> str:
    return _NOT_TOLD if quantity.value is None else " +- ".join(in_millionths(quantity))
