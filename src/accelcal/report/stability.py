"""A stability test as text for a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from accelcal.plural import counted
from accelcal.report.lines import aligned, hanging, sections, unit_of
from accelcal.report.numbers import significant
from accelcal.results.stability import Estimate, Stability
from accelcal.shown_units import plain, readable, time_unit
from accelcal.stability.noise_terms import TERMS
from accelcal.units import HOUR

_NAMES = {
    "sigma_L": "bias, launch to launch",
    "k0L": "  bound t_P sigma_L",
    "gamma_D": "drift in a launch",
    "sigma_F": "fluctuation about the drift",
    "k0F": "  bound t_P sigma_F",
    "noise": "noise, sample to sample",
    "resolution": "step of the output",
    "threshold": "threshold",
    "hysteresis": "hysteresis",
}
_ALPHA = {2: "white of integral", 1: "flicker of integral", 0: "white", -1: "flicker"}
_ALPHA |= {-2: "random walk"}
_LAUNCH_HEADING = "", "lasts", "samples", "mean", "drift", "from", "to", "fluct.", "unit", "degC"
_SHOWN_LAUNCHES = 20

_BOUND = "k0(t) = 0.5 sqrt(k0L^2 + (gamma_D t)^2 + k0F^2)"
_HEADING = ("", "", "value", "from", "to", "unit", "dof")
"""Of a row of estimates; the finding stands behind it."""


def text(result: Stability) -> str:
    """Write a stability test as lines of at most 100 characters."""
    bounds = [_row(_time(b.time_s), "k0(t)", b.bound) for b in result.bounds]
    terms = [_row(TERMS[name].name, name, e) for name, e in result.noise_terms.items()]
    parts = [
        _heading(result),
        _table("Random bias", _components(result)),
        _table(f"Bound of the random bias (3), +- {_BOUND}", bounds),
        _launches(result),
    ]
    if result.allan.tau_s:
        parts += [_allan(result), _table("Noise terms of the Allan deviation", terms)]
    return sections(*parts, _open(result))


def _heading(result: Stability) -> Iterator[str]:
    samples = sum(launch.samples for launch in result.launches)
    yield f"Stability of {unit_of(result.serial, result.source)}"
    unit = f"in {result.unit}"
    if result.scale_factor is not None:
        unit = f"in g (local), scale factor {result.scale_factor:.7g} {result.output_unit or '?'}/g"
    yield f"{counted(len(result.launches), 'launch')}, {samples} samples; {unit}"
    yield f"{result.coverage}; intervals are of 95 %"


def _components(result: Stability) -> list[tuple[str, ...]]:
    """Tell the components of the random bias, a row of `_HEADING` and a finding each."""
    rows = [_row(_NAMES[name], name, e) for name, e in result.components.items()]
    # the finding of sigma_L and sigma_F holds for their bounds, and is told once
    return [(*row[:-1], "" if row[1] in ("k0L", "k0F") else row[-1]) for row in rows]


def _launches(result: Stability) -> Iterator[str]:
    yield f"Launches; mean over the first {_time(result.window_s)}, from the mean of all"
    means = [launch.initial_mean for launch in result.launches if launch.initial_mean is not None]
    centre = math.fsum(means) / len(means) if means else 0.0
    rows: list[Sequence[str]] = [_LAUNCH_HEADING]
    factor, unit = _readable(result.unit, [e.fluctuation.value for e in result.launches])
    for launch in result.launches[:_SHOWN_LAUNCHES]:
        mean = None if launch.initial_mean is None else factor * (launch.initial_mean - centre)
        drift = launch.drift.times(HOUR * factor)
        low_high = launch.temperature_degC
        rows.append(
            (
                launch.label,
                _time(launch.duration_s),
                str(launch.samples),
                *map(_short, (mean, drift.value, drift.lower, drift.upper)),
                _short(factor * (launch.fluctuation.value or 0.0)),
                f"{unit}, {unit}/h",
                f"{low_high[0]:.2f} .. {low_high[1]:.2f}" if low_high else "-",
            )
        )
    yield from aligned(rows, right={1, 2, 3, 4, 5, 6, 7}, indent="  ")
    if len(result.launches) > _SHOWN_LAUNCHES:
        yield f"  and {len(result.launches) - _SHOWN_LAUNCHES} more"


def _allan(result: Stability) -> Iterator[str]:
    allan = result.allan
    factor, unit = _readable(result.unit, allan.deviation)
    yield f"Overlapping Allan deviation [{unit}]"
    rows: list[Sequence[str]] = [("tau", "deviation", "from", "to", "edf", "noise")]
    for row in allan.rows():
        numbers = (row["deviation"], row["lower"], row["upper"])
        cells = [_short(factor * number) for number in numbers]
        rows.append((_time(row["tau_s"]), *cells, f"{row['edf']:.0f}", _ALPHA[int(row["alpha"])]))
    yield from aligned(rows, right={0, 1, 2, 3, 4}, indent="  ")


_VERDICTS = {"warn": "WARNING", "pass": "passed", "not assessed": "not assessed"}


def _open(result: Stability) -> Iterator[str]:
    sentences = [
        f"{told}: {gate.name}: {gate.finding}"
        for verdict, told in _VERDICTS.items()
        for gate in result.gates
        if gate.verdict == verdict
    ]
    sentences += result.warnings
    if sentences:
        yield "What to know"
    for sentence in sentences:
        yield from hanging(f"- {sentence}", indent="  ")


def _row(name: str, symbol: str, estimate: Estimate) -> tuple[str, ...]:
    if estimate.unit.endswith("/s") and "sqrt" not in estimate.unit:
        estimate = estimate.times(HOUR, estimate.unit[:-1] + "h")
    numbers = (estimate.value, estimate.lower, estimate.upper)
    factor, unit = _readable(estimate.unit, numbers)
    value, lower, upper = (None if x is None else factor * x for x in numbers)
    dof = "" if estimate.dof is None else f"{float(f'{estimate.dof:.3g}'):g}"
    seen = value is not None or lower is not None or upper is not None
    return (
        name,
        symbol,
        _short(value),
        _short(lower),
        _short(upper),
        unit if seen else "",
        dof,
        estimate.finding,
    )


def _table(title: str, rows: Sequence[tuple[str, ...]]) -> Iterator[str]:
    """Rows of estimates, and below them the findings."""
    yield title
    yield from aligned([_HEADING, *(row[:-1] for row in rows)], right={2, 3, 4, 6}, indent="  ")
    for row in rows:
        if row[-1]:
            yield from hanging(f"{row[0].strip()}: {row[-1]}", indent="  ")


def _readable(unit: str, numbers: Iterable[float | None]) -> tuple[float, str]:
    """Factor and unit that make numbers readable, as those of the pictures."""
    factor, shown = readable(unit, [math.nan if x is None else x for x in numbers])
    return factor, plain(shown)


def _short(number: float | None) -> str:
    return "-" if number is None else significant(number)


def _time(seconds: float) -> str:
    size, unit = time_unit(seconds)
    return f"{seconds / size:.3g} {unit}"
