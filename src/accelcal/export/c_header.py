"""Exports as a C header: the coefficients and the function that applies them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from accelcal.compensate.coefficients import Compensation, Law
from accelcal.compensate.inversion import CLOSE, FARTHEST, MOST_STEPS
from accelcal.compensate.ranges import ACCELERATION_MARGIN, TEMPERATURE_MARGIN
from accelcal.export.c_text import c_comment, c_covariance, c_number, c_prefix, harmless, header_of
from accelcal.export.content import covariance_rows

__all__ = ["to_c_header"]


def to_c_header(content: Mapping[str, Any], found: Compensation) -> str:
    """Write an export as a C header.

    Parameters
    ----------
    content : mapping
        What `accelcal.export.content.export_content` returns.
    found : Compensation
        What `accelcal.compensate.choice.compensation` returns.

    Returns
    -------
    str
        C99 that needs nothing but ``math.h``. It does the operations of
        `accelcal.compensate.inversion` in their order.
    """
    prefix = c_prefix(found.serial)
    axes = found.axes
    parts = {
        "@COMMENT@": c_comment(content, _notes(content)),
        "@DATA@": "\n".join(_data(found, prefix)),
        "@COVARIANCE@": c_covariance(covariance_rows(found), "; those of K1 are relative"),
        "@UNIT@": harmless(found.output_unit or "output unit"),
        "@ARGUMENTS@": "".join(f", double {axis.name}" for axis in axes),
        "@LAWS@": "\n".join(_laws_in_c(found, prefix)),
        "@TILT@": " + ".join(f"{axis.delta_symbol} * {axis.name}" for axis in axes),
        "@COUPLING@": " + ".join(f"@P@_{axis.coupling_symbol} * {axis.name}" for axis in axes),
        "@ACROSS@": "".join(f" || !(fabs({axis.name}) <= @FARTHEST@)" for axis in axes),
        "@WARM@": _WARM if found.temperatures else "    (void)temperature; /* not known */",
        "@FARTHEST@": c_number(FARTHEST),
        "@CLOSE@": c_number(CLOSE),
        "@STEPS@": str(MOST_STEPS),
    }
    return header_of(_TEMPLATE, parts, prefix)


def _notes(content: Mapping[str, Any]) -> Iterator[str]:
    yield content["covariance"]["note"]
    launch = content["new_launch"]
    sizes = ", ".join(
        f"{key} {value}" for key, value in launch.items() if key != "note" and value is not None
    )
    yield f"{launch['note']} {sizes}"


def _data(found: Compensation, prefix: str) -> Iterator[str]:
    values: dict[str, float] = {}
    if found.T0_degC is not None and found.several_levels:
        values["T0"] = found.T0_degC
    for symbol, law in _laws(found):
        values[symbol] = law.at_T0
        if found.several_levels:
            values[f"{symbol}_slope_above"] = law.above.value
            values[f"{symbol}_slope_below"] = law.below.value
    values |= {"k2": found.k2, "k3": found.k3}
    values |= {axis.coupling_symbol: axis.delta_ip for axis in found.axes}
    if found.temperatures is not None:
        values["lowest_temperature"] = found.temperatures[0] - TEMPERATURE_MARGIN
        values["highest_temperature"] = found.temperatures[1] + TEMPERATURE_MARGIN
    values["lowest_acceleration"] = found.accelerations[0] - ACCELERATION_MARGIN
    values["highest_acceleration"] = found.accelerations[1] + ACCELERATION_MARGIN
    for name, value in values.items():
        yield f"static const double {prefix}_{name} = {c_number(value)};"


def _laws(found: Compensation) -> list[tuple[str, Law]]:
    laws = [("k0", found.k0), ("K1", found.K1)]
    return laws + [(axis.delta_symbol, axis.delta) for axis in found.axes]


def _laws_in_c(found: Compensation, prefix: str) -> Iterator[str]:
    """Parameters at the temperature of the sample, by the operations of `compensate`."""
    if found.several_levels:
        yield f"    const double rise = temperature - {prefix}_T0;"
    else:
        yield f"    (void)temperature; /* calibrated at one temperature: see {prefix}_inside */"
    for symbol, _ in _laws(found):
        name = f"{prefix}_{symbol}"
        change = f"(rise > 0.0 ? {name}_slope_above : {name}_slope_below) * rise"
        law = f"{name} * (1.0 + {change})" if symbol == "K1" else f"{name} + {change}"
        yield f"    const double {symbol} = {law if found.several_levels else name};"


_WARM = """\
    if (!(temperature >= @P@_lowest_temperature && temperature <= @P@_highest_temperature))
        return 0;"""

_TEMPLATE = """\
/*
@COMMENT@
 */
@BEGIN@

#include <math.h>

@DATA@

@COVARIANCE@

/* Left side of the cubic in a that is solved, without its constant. */
static inline double @P@_cubic(double a, double linear)
{
    return ((@P@_k3 * a + @P@_k2) * a + linear) * a;
}

/*
 * Acceleration along the input axis [local g] from the output [@UNIT@], the temperature [degC] and
 * the acceleration across [local g]. NAN where no acceleration gives this output. The ranges are
 * not checked: see @P@_inside.
 */
static inline double @P@_acceleration(double output, double temperature@ARGUMENTS@)
{
@LAWS@
    const double linear = 1.0 + @COUPLING@;
    const double tilt = @TILT@;
    const double target = output / K1 - k0 - tilt;
    /* the branch through 0 on which the output rises */
    const double inside = @P@_k2 * @P@_k2 - 3.0 * @P@_k3 * linear;
    const double root = sqrt(fmax(inside, 0.0));
    const double upper = inside >= 0.0 ? (root - @P@_k2) / linear : 0.0;
    const double lower = inside >= 0.0 ? (-root - @P@_k2) / linear : 0.0;
    double high = 1.0 / fmax(upper, 1.0 / @FARTHEST@);
    double low = 1.0 / fmin(lower, -1.0 / @FARTHEST@);
    double a;
    int step;

    if (!(linear > 0.0) || !(@P@_cubic(low, linear) <= target)
        || !(target <= @P@_cubic(high, linear))@ACROSS@)
        return NAN;
    a = fmin(fmax(target / linear, low), high);
    for (step = 0; step < @STEPS@; step++) {
        const double excess = @P@_cubic(a, linear) - target;
        const double slope = (3.0 * @P@_k3 * a + 2.0 * @P@_k2) * a + linear;
        double next = a - excess / slope;
        if (excess <= 0.0)
            low = a;
        if (excess >= 0.0)
            high = a;
        if (!(low <= next && next <= high))
            next = 0.5 * (low + high);
        if (fabs(next - a) <= @CLOSE@ * (1.0 + fabs(a)))
            return next;
        a = next;
    }
    return NAN;
}

/* 1 where temperature [degC] and acceleration [local g] lie in the calibrated ranges, else 0. */
static inline int @P@_inside(double temperature, double acceleration)
{
@WARM@
    return acceleration >= @P@_lowest_acceleration && acceleration <= @P@_highest_acceleration;
}

@END@"""
