"""From the record of a stability test to the components of (3) and the Allan deviation."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arguments.kinds import expect, several
from accelcal.arguments.numbers import check_number, check_number_or_none
from accelcal.arrays import Numbers
from accelcal.errors import InputError
from accelcal.estimate.launch import SAME_LEVEL
from accelcal.numerics.probability import LEVEL, student_quantile, written_p_value
from accelcal.plural import counted, degrees_of_freedom
from accelcal.results.quantity import Gate
from accelcal.results.stability import (
    DRIFTS_DIFFER,
    AllanDeviation,
    Estimate,
    LaunchTrend,
    Stability,
)
from accelcal.stability.allan import even_series, overlapping_allan, was_off
from accelcal.stability.components import (
    coverage_factor,
    deviation,
    hysteresis,
    lag1_correlation,
    random_bias,
    threshold,
)
from accelcal.stability.noise_terms import noise_terms
from accelcal.stability.record import Launch, StabilityRecord
from accelcal.stability.trend import Trend, fit_trend
from accelcal.version import SOFTWARE

__all__ = ["analyse"]

WINDOW = 600.0
"""Initial window of a launch, whose means make sigma_L; 10 min as in the paper [s]."""

TIMES = (600.0, 3600.0, 21600.0, 43200.0)
"""Times at which (3) is evaluated; the paper speaks of 10 min and 12 h [s]."""

_REPLICATED = 3
"""Launches from which on their slopes tell the interval of gamma_D by themselves."""

_ALPHA = 0.05

_FEWEST = 3
"""Samples of known temperature from which on a launch tells whether its output follows it."""


class _Setting(NamedTuple):
    unit: str
    window: float
    probability: float | None


def analyse(
    record: StabilityRecord,
    *,
    scale_factor: float | None = None,
    probability: float | None = None,
    window: float = WINDOW,
    times: Numbers = TIMES,
) -> Stability:
    """Analyse a stability test.

    Parameters
    ----------
    record : StabilityRecord
        One launch or several.
    scale_factor : float, optional
        K1 that turns outputs into g [output unit / g]; without it, results are in output units.
    probability : float, optional
        Two-sided probability of Student's factor t_P; without it, t_P is 3 as in the paper.
    window : float, default 600
        Initial window of each launch for sigma_L [s].
    times : sequence of float
        Times after the start of a launch at which (3) is evaluated [s].

    Returns
    -------
    Stability
        Components of (3) with intervals, bounds, Allan deviation and noise terms.

    Raises
    ------
    InputError
        If a setting breaks a rule or a launch is too short.

    Notes
    -----
    k0(t) = 0.5 sqrt(k0L^2 + k0D(t)^2 + k0F^2), k0L = t_P sigma_L, k0D = gamma_D t,
    k0F = t_P sigma_F (3).

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> random = np.random.default_rng(1)
    >>> launch = accelcal.Launch("1", np.arange(900.0), random.normal(size=900))
    >>> result = accelcal.analyse(accelcal.StabilityRecord((launch,)))
    >>> round(result.components["sigma_F"].value, 1), result.components["sigma_L"].finding
    (1.0, 'not determined: 1 launch; repeat the launch')
    """
    expect(record, StabilityRecord)
    times = several(times)
    _check(scale_factor, probability, window, times)
    unit = "g" if scale_factor else (record.unit or "output units")
    setting = _Setting(unit, window, probability)
    launches = [
        replace(each, output=each.output / (scale_factor or 1.0)) for each in record.launches
    ]
    resting = [launch for launch in launches if launch.is_at_rest]
    stepped = [launch for launch in launches if not launch.is_at_rest]
    trends = [fit_trend(launch) for launch in resting]
    shown = tuple(_shown(*pair, setting) for pair in zip(resting, trends, strict=True))
    means = [launch.initial_mean for launch in shown if launch.initial_mean is not None]
    components = _components(resting, trends, means, setting)
    components["threshold"] = threshold(stepped, unit)
    components["hysteresis"] = hysteresis(stepped, unit)
    allan, sampling = _allan(resting)
    said = _warnings(setting, components["sigma_L"], stepped, times, shown)
    bias = [components[name] for name in ("k0L", "gamma_D", "k0F")]
    return Stability(
        components=components,
        bounds=tuple(random_bias(float(time), *bias) for time in times),
        launches=shown,
        allan=allan,
        noise_terms=noise_terms(allan, unit),
        gates=(*_gates(resting, means, components), *_levels_gate(resting, window)),
        warnings=(*record.notes, *sampling, *said),
        unit=unit,
        output_unit=record.unit,
        scale_factor=scale_factor,
        coverage="t_P = 3" if probability is None else f"Student's factor for {probability:g}",
        window_s=window,
        serial=record.serial,
        source=record.source,
        software=SOFTWARE,
    )


def _check(
    scale_factor: float | None, probability: float | None, window: float, times: Numbers
) -> None:
    check_number_or_none(scale_factor=scale_factor, probability=probability)
    check_number(window=window)
    if scale_factor == 0.0:
        raise InputError(f"scale factor {scale_factor}; it is a finite number other than 0")
    if probability is not None and not 0.0 < probability < 1.0:
        raise InputError(f"probability {probability:g}; it lies between 0 and 1, such as 0.9973")
    if not window > 0.0:
        raise InputError(f"window {window:g} s; the initial window is longer than 0 s")
    for time in times:
        check_number(0.0, **{"time of (3)": time})


def _shown(launch: Launch, trend: Trend, setting: _Setting) -> LaunchTrend:
    drift = Estimate(trend.slope, setting.unit + "/s", trend.lower, trend.upper)
    long_enough = launch.duration + launch.interval >= setting.window * (1.0 - 1e-9)
    inside = launch.time - launch.time[0] < setting.window
    degrees = launch.temperature
    known = degrees[np.isfinite(degrees)] if degrees is not None else np.zeros(0)
    return LaunchTrend(
        label=launch.label,
        samples=int(launch.output.size),
        duration_s=launch.duration,
        interval_s=launch.interval,
        initial_mean=float(launch.output[inside].mean()) if long_enough else None,
        level=trend.start,
        drift=drift,
        fluctuation=deviation(trend.sum_of_squares, trend.dof, setting.unit, trend.effective_dof),
        temperature_degC=(float(known.min()), float(known.max())) if known.size else None,
    )


# -- components of (3) -----------------------------------------------------------------------------


def _components(
    launches: list[Launch], trends: list[Trend], means: list[float], setting: _Setting
) -> dict[str, Estimate]:
    sigma_l = _launch_spread(means, setting)
    sigma_f = _fluctuation(trends, setting.unit)
    return {
        "sigma_L": sigma_l,
        "k0L": sigma_l.times(coverage_factor(setting.probability, sigma_l.dof)),
        "gamma_D": _drift(trends, setting.unit),
        "sigma_F": sigma_f,
        "k0F": sigma_f.times(coverage_factor(setting.probability, sigma_f.dof)),
        "noise": _noise(launches, setting.unit),
        "resolution": _resolution(launches, setting.unit),
    }


def _launch_spread(means: list[float], setting: _Setting) -> Estimate:
    """sigma_L from the launch means over the initial window."""
    if len(means) < 2:
        what = "repeat the launch" if means else f"none lasts {setting.window:g} s"
        return Estimate(
            None, setting.unit, finding=f"not determined: {counted(len(means), 'launch')}; {what}"
        )
    dof = len(means) - 1
    spread = deviation(dof * float(np.var(means, ddof=1)), dof, setting.unit, dof)
    lag = lag1_correlation(means)
    if lag and lag.p_value < _ALPHA:
        finding = "launches are not independent: no honest interval"
        return replace(spread, lower=None, upper=None, finding=finding)
    return spread


def _drift(trends: list[Trend], unit: str) -> Estimate:
    """gamma_D: mean slope of the launches; no value where its interval holds zero."""
    if not trends:
        return Estimate(None, unit + "/s", finding="not determined: no launch at rest")
    slopes = np.array([trend.slope for trend in trends])
    mean, dof = float(slopes.mean()), None
    if slopes.size >= _REPLICATED:
        dof = slopes.size - 1
        half = student_quantile(LEVEL, dof) * float(slopes.std(ddof=1)) / slopes.size**0.5
        lower, upper = mean - half, mean + half
    else:
        below = sum((t.slope - t.lower) ** 2 for t in trends) ** 0.5 / slopes.size
        above = sum((t.upper - t.slope) ** 2 for t in trends) ** 0.5 / slopes.size
        lower, upper = mean - below, mean + above
    if lower <= 0.0 <= upper and _some_drift(trends):
        found = deviation(float(slopes @ slopes), slopes.size, unit + "/s", slopes.size)
        return replace(found, finding=DRIFTS_DIFFER)
    if lower <= 0.0 <= upper:
        finding = "not identified: the interval holds zero"
        return Estimate(None, unit + "/s", lower, upper, dof, finding)
    return Estimate(mean, unit + "/s", lower, upper, dof)


def _some_drift(trends: list[Trend]) -> bool:
    """Whether more launches than chance allows have a slope of their own."""
    from scipy.special import bdtrc  # type: ignore[import-untyped]

    size = len(trends)
    found = sum(not trend.lower <= 0.0 <= trend.upper for trend in trends)
    return size > 1 and bool(bdtrc(found - 1, size, 1.0 - LEVEL) < _ALPHA)


def _fluctuation(trends: list[Trend], unit: str) -> Estimate:
    """sigma_F: what is left about the trend lines of all launches."""
    if not trends:
        return Estimate(None, unit, finding="not determined: no launch at rest")
    squares = sum(trend.sum_of_squares for trend in trends)
    effective = sum(trend.effective_dof for trend in trends)
    return deviation(squares, sum(trend.dof for trend in trends), unit, effective)


def _noise(launches: list[Launch], unit: str) -> Estimate:
    """Standard deviation from sample to sample, which slow changes leave alone."""
    if not launches:
        return Estimate(None, unit, finding="not determined: no launch at rest")
    steps = np.concatenate([np.diff(launch.output) for launch in launches])
    # differences of neighbours share a sample: two thirds of the degrees of freedom remain
    return deviation(0.5 * float(steps @ steps), steps.size, unit, max(steps.size / 1.5, 1.0))


def _resolution(launches: list[Launch], unit: str) -> Estimate:
    """Step of the output, where the record shows one."""
    outputs = np.concatenate([launch.output for launch in launches]) if launches else np.zeros(0)
    steps = np.diff(np.unique(outputs))
    steps = steps[steps > 1e-9 * np.abs(outputs).max(initial=0.0)]
    step = float(steps.min()) if steps.size else 0.0
    multiples = steps / step if step else steps
    if not steps.size or np.abs(multiples - np.round(multiples)).max() > 0.05:
        return Estimate(None, unit, finding="not determined: the outputs show no common step")
    return Estimate(float(np.sum(steps) / np.sum(np.round(multiples))), unit)


# -- Allan deviation, gates and warnings -----------------------------------------------------------


def _allan(launches: list[Launch]) -> tuple[AllanDeviation, tuple[str, ...]]:
    if not launches:
        return AllanDeviation(), ("Allan deviation: not determined, no launch is at rest",)
    series = even_series(launches)
    try:
        result = overlapping_allan(series.pieces, series.interval, level=LEVEL)
    except InputError as error:
        return AllanDeviation(), (f"Allan deviation: not determined, {error}",)
    return result, tuple(f"Allan deviation: {note}" for note in series.notes)


def _gates(
    launches: list[Launch], means: list[float], components: dict[str, Estimate]
) -> Iterator[Gate]:
    lag = lag1_correlation(means)
    if lag is None:
        finding = (
            f"{counted(len(means), 'launch')} with a mean; at least 5 different means are needed"
        )
        yield Gate("independent launches", "not assessed", finding)
    else:
        p = written_p_value(lag.p_value)
        finding = f"lag-1 correlation of the launch means {lag.value:+.2f}, {p}"
        yield Gate("independent launches", "warn" if lag.p_value < _ALPHA else "pass", finding)
    yield from _temperature_gate(launches)
    yield from (Gate("pauses", "warn", said) for said in map(was_off, launches) if said)
    step, noise = components["resolution"].value, components["noise"].value
    if step and noise is not None and noise < 0.5 * step:
        finding = f"the output moves in steps of {step:.3g}, its noise is {noise:.3g} only"
        yield Gate("resolution", "warn", finding + "; the noise figures are those of the step")


def _temperature_gate(launches: list[Launch]) -> Iterator[Gate]:
    """Warn where output and temperature move together in a launch."""
    for launch in launches:
        if launch.temperature is None:
            continue
        known = np.isfinite(launch.temperature)
        degrees, output = launch.temperature[known], launch.output[known]
        if known.sum() < _FEWEST or np.ptp(degrees) == 0.0 or np.ptp(output) == 0.0:
            continue
        r = float(np.corrcoef(degrees, output)[0, 1])
        if abs(r) > 0.7:
            finding = (
                f"launch {launch.label}: output and temperature correlate ({r:+.2f}) over "
                f"{np.ptp(degrees):.2g} degC; drift and fluctuation may be temperature"
            )
            yield Gate("temperature", "warn", finding)


def _levels_gate(launches: list[Launch], window: float) -> Iterator[Gate]:
    """Warn where the initial windows of the launches are of different temperatures."""
    windows = [
        launch.temperature[launch.time - launch.time[0] < window]
        for launch in launches
        if launch.temperature is not None
    ]
    levels = [float(np.nanmean(each)) for each in windows if np.isfinite(each).any()]
    low, high = min(levels, default=0.0), max(levels, default=0.0)
    if high - low > SAME_LEVEL:
        finding = f"the launches begin at {low:.1f} to {high:.1f} degC; sigma_L may be temperature"
        yield Gate("launch temperatures", "warn", finding)


def _warnings(
    setting: _Setting,
    spread: Estimate,
    stepped: list[Launch],
    times: Numbers,
    launches: tuple[LaunchTrend, ...],
) -> Iterator[str]:
    if setting.unit != "g":
        yield f"no scale factor: results are in {setting.unit}, not in g"
    if setting.probability is None and spread.dof is not None:
        factor = student_quantile(0.9973, spread.dof)
        yield (
            f"t_P = 3 as in the paper; Student's factor for P = 0.9973 and the "
            f"{degrees_of_freedom(spread.dof)} of sigma_L is {factor:.2f}, by probability=..."
        )
    if stepped:
        names = ", ".join(launch.label for launch in stepped)
        yield f"launch {names}: the input moves; used for threshold and hysteresis only"
    short = [launch.label for launch in launches if launch.initial_mean is None]
    if short and len(launches) > 1:
        yield f"launch {', '.join(short)}: shorter than {setting.window:g} s, not in sigma_L"
    longest = max((launch.duration_s for launch in launches), default=math.inf)
    if any(time > 1.01 * longest for time in times):
        yield f"(3) beyond {longest:.4g} s, the longest launch, is extrapolated"
