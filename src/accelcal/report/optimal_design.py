"""The best angles for a test, as text."""

from __future__ import annotations

from collections.abc import Iterator

from accelcal.model import COEFFICIENTS
from accelcal.report.designs import scaled, stand_line
from accelcal.report.lines import aligned, sections
from accelcal.results.optimal_design import OptimalDesign

_SAME = 1.005
_TWO_CYCLES = 4
_PER_LINE = 10


def text(found: OptimalDesign) -> str:
    """Tell the best angles, their uncertainties beside equally spaced tests, and the gain."""
    command = f"accelcal simulate {_options(found)} -o test.csv"
    told = [*_gains(found), *_targets(found), *_cautions(found)]
    return sections(_head(found), _stops(found), _table(found), told, [command])


def _head(found: OptimalDesign) -> Iterator[str]:
    best = found.best
    what = {"D": "all coefficients at once (D)", "A": "all coefficients by their targets (A)"}
    yield f"Best angles for {what.get(found.criterion, found.criterion)}"
    yield stand_line(found.comparison.stand, declared=found.comparison.declared)
    levels = ", ".join(f"{t:g}" for t in best.temperatures)
    yield (
        f"{len(found.stops())} positions, {best.strokes} strokes at {levels} degC, mounting"
        f" {', '.join(best.mountings)}: {best.readings} readings, {best.hours:.1f} h"
    )


def _stops(found: OptimalDesign) -> Iterator[str]:
    repeated = "; x2 means two readings at that angle in a stroke"
    yield "Head angles [deg]" + (repeated if any(n > 1 for _, n in found.stops()) else "")
    stops = [f"{angle:g}" + (f" x{n}" if n > 1 else "") for angle, n in found.stops()]
    for start in range(0, len(stops), _PER_LINE):
        yield "  " + "  ".join(stop.rjust(9) for stop in stops[start : start + _PER_LINE])


def _table(found: OptimalDesign) -> Iterator[str]:
    yield "Standard uncertainty, beside that of equally spaced tests in the same hours"
    head = ["test", "positions x strokes", "readings", "hours", *COEFFICIENTS]
    rows = [head]
    for name, design in zip(found.losses, found.designs, strict=True):
        sizes = [design.forecast(each) for each in COEFFICIENTS]
        cells = [scaled(f.standard_uncertainty, f.unit) if f else "-" for f in sizes]
        rows.append([name, design.label, str(design.readings), f"{design.hours:.1f}", *cells])
    yield from aligned(rows, right=set(range(2, len(head))), indent="  ")


def _gains(found: OptimalDesign) -> Iterator[str]:
    whole = {"D": "on the whole (D)", "A": "on the whole (A)"}
    where = whole.get(found.criterion, f"in {found.criterion}")
    for name in list(found.losses)[1:]:
        gain = found.gain(name)
        if gain < 1.0 / _SAME:
            more = 100.0 * (1.0 / gain - 1.0)
            yield f"{name}: {more:.1f} % more certain {where}; book that one"
        elif gain < _SAME:
            yield f"{name}: as good {where}; book that one, which is simpler"
        else:
            yield f"{name}: {100.0 * (gain - 1.0):.1f} % less certain {where}"


def _targets(found: OptimalDesign) -> Iterator[str]:
    for name, limit in found.comparison.targets.items():
        forecast = found.best.forecast(name)
        if forecast is None:
            continue
        size = forecast.standard_uncertainty
        met = "is met" if size <= limit else "is not met in these hours"
        yield (
            f"target {name} {scaled(limit, forecast.unit)}: {met},"
            f" {scaled(size, forecast.unit)}, mostly from {forecast.mostly_from}"
        )


def _cautions(found: OptimalDesign) -> Iterator[str]:
    yield (
        f"Positions are {found.spacing_deg:g} deg apart or more. Head errors count as independent"
        " from position to position;"
    )
    yield "a harmonic of the head is not, and no choice of angles averages it."
    if found.best.strokes < _TWO_CYCLES:
        yield "Effects that the model lacks can be seen only with two cycles (4 strokes) or more."


def _options(found: OptimalDesign) -> str:
    best = found.best
    angles = ",".join(f"{angle:g}" for angle in best.angles)
    levels = ",".join(f"{t:g}" for t in best.temperatures)
    return (
        f"--angles {angles} --strokes {best.strokes} --temperatures {levels}"
        f" --mounting {','.join(best.mountings)}"
    )
