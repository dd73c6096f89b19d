"""Bound (3) of the random bias error, with its interval."""

from __future__ import annotations

from accelcal.model import bias_bound
from accelcal.numerics.probability import student_quantile
from accelcal.results.stability import BiasBound, Estimate

FACTOR = 3.0
"""t_P of the paper, where no probability is asked for."""


def coverage_factor(probability: float | None, dof: float | None) -> float:
    """Factor t_P of (3), for a two-sided probability; None takes the fixed factor 3.

    The degrees of freedom are those of the standard deviation; None for very many.

    Examples
    --------
    >>> coverage_factor(None, 5), round(coverage_factor(0.9973, 5), 2)
    (3.0, 5.51)
    """
    if probability is None:
        return FACTOR
    return student_quantile(probability, float("inf") if dof is None else dof)


def random_bias(time: float, launch: Estimate, drift: Estimate, fluctuation: Estimate) -> BiasBound:
    """Bound (3) at one time after the start of a launch: k0D(t) and k0(t).

    Notes
    -----
    A component without value counts as zero in the value of (3), and by what the data allow it to
    be in the upper limit. The limits of the sum of squares are combined by the method of variance
    estimates recovery: the distances of the limits from the values, squared, add.

    Examples
    --------
    >>> known = Estimate(2e-5, "g", 1e-5, 4e-5)
    >>> bound = random_bias(0.0, known, Estimate(0.0, "g/s", 0.0, 0.0), known).bound
    >>> round(bound.value, 7), round(bound.lower, 7), round(bound.upper, 7)
    (1.41e-05, 9.7e-06, 2.5e-05)
    """
    unit = launch.unit
    drifted = _size(drift).times(time, unit) if time else Estimate(0.0, unit, 0.0, 0.0)
    parts = (launch, drifted, fluctuation)
    sizes = [estimate.value or 0.0 for estimate in (launch, drift, fluctuation)]
    value = float(bias_bound(time, sizes[0], abs(sizes[1]), sizes[2]))
    squares = [((e.value or 0.0) ** 2, _square(e.lower), _square(e.upper)) for e in parts]
    total = 4.0 * value**2
    low = sum((s - (s if lo is None else min(lo, s))) ** 2 for s, lo, _ in squares) ** 0.5
    high = sum(((s if up is None else up) - s) ** 2 for s, _, up in squares) ** 0.5
    missing = [n for n, e in zip(("k0L", "k0D", "k0F"), parts, strict=True) if e.value is None]
    open_ended = any(e.upper is None for e in parts)
    return BiasBound(
        time,
        drifted,
        Estimate(
            value if len(missing) < 3 else None,
            unit,
            0.5 * max(total - low, 0.0) ** 0.5,
            None if open_ended else 0.5 * (total + high) ** 0.5,
            finding=f"without {', '.join(missing)}" if missing else "",
        ),
    )


def _size(drift: Estimate) -> Estimate:
    """Absolute value of a slope with its limits."""
    if drift.lower is None or drift.upper is None:
        return drift
    ends = sorted((abs(drift.lower), abs(drift.upper)))
    low = 0.0 if drift.lower <= 0.0 <= drift.upper else ends[0]
    value = None if drift.value is None else abs(drift.value)
    return Estimate(value, drift.unit, low, ends[1], drift.dof, drift.finding)


def _square(limit: float | None) -> float | None:
    return None if limit is None else limit**2
