"""The random part of (4): what stands there behind +-, with the distribution of each bound."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

from accelcal.arguments.kinds import expect
from accelcal.arguments.numbers import check_number, check_number_or_none
from accelcal.arguments.options import check_texts, check_written
from accelcal.errors import DocumentError, InputError
from accelcal.results.calibration import Calibration
from accelcal.results.stability import DRIFTS_DIFFER, Estimate, Stability
from accelcal.units import HOUR

__all__ = [
    "NOT_IDENTIFIED",
    "USUAL_FACTOR",
    "RandomBound",
    "RandomPart",
    "random_part",
]

USUAL_FACTOR = 3.0
"""t_P of (3) where none is given: the paper takes it from 2.7 to 3."""

NOT_IDENTIFIED = "stability test, limit of what it does not identify"
"""Origin of a drift that a stability test cannot tell from none, and that may be as large."""

FEW_LAUNCHES = "stability test, launches taken as alike"
"""Origin of a drift that one or two launches tell, and not how they differ."""

_RECTANGULAR = math.sqrt(3.0)  # GUM 4.3.7
_OF_KNOWN_SIGN = 1.0  # an error that nothing corrects, and that is as large as it is each time
_TWO_POINTS = 1.0  # either of two values, half the distance each: the standard deviation

_UNITS = {"launch": "g", "drift": "g/s", "fluctuation": "g", "hysteresis": "g", "threshold": "g"}
_UNITS |= {"scale_factor": "of K1"}


@dataclass(frozen=True, slots=True)
class RandomBound:
    """A bound behind +- in (4).

    Attributes
    ----------
    bound : float
        Its size, never negative.
    divisor : float
        Bound over standard uncertainty: t_P for a multiple of a standard deviation, sqrt(3) for a
        rectangular distribution, 1 for two values at equal chance.
    origin : str
        Where the bound comes from; empty where it is not known, and taken as zero.
    dof : float
        Degrees of freedom of the standard uncertainty; infinite where it is declared or given.

    Raises
    ------
    InputError
        If the bound is negative, not finite or above 1, or divisor or dof are not above zero.
    """

    bound: float = 0.0
    divisor: float = USUAL_FACTOR
    origin: str = ""
    dof: float = math.inf

    def __post_init__(self) -> None:
        check_number(0.0, **{"bound of a random error": self.bound})
        if self.bound > 1.0:
            raise InputError(
                f"bound of a random error is {self.bound:g}; it is at most 1 g, or all of the scale"
                " factor: write 20 ug as 2e-5"
            )
        check_number(**{"factor of a bound": self.divisor})
        if not self.divisor > 0.0:
            raise InputError(f"factor {self.divisor} of a bound; it is above zero, usually 3")
        check_written(origin=self.origin)
        if self.dof != math.inf:
            check_number(**{"degrees of freedom of a bound": self.dof})
        if not self.dof > 0.0:
            raise InputError(f"{self.dof} degrees of freedom of a bound; there are more than 0")

    @property
    def standard_uncertainty(self) -> float:
        """Bound over divisor."""
        return self.bound / self.divisor


@dataclass(frozen=True, slots=True)
class RandomPart:
    """The bounds of the random errors in (3) and (4).

    Attributes
    ----------
    launch : RandomBound
        Bias from launch to launch, k0L [g].
    drift : RandomBound
        Rate of the bias drift in a launch, gamma_D [g/s].
    fluctuation : RandomBound
        Bias about the drift line, k0F [g].
    hysteresis : RandomBound
        Hysteresis of the bias, mainly that of temperature, h_T [g].
    threshold : RandomBound
        Threshold p [g].
    scale_factor : RandomBound
        Relative instability of the scale factor, k1 [1].
    warnings : tuple of str
        What a stability test that was used warns of.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> random = accelcal.random_part(calibration, hysteresis=3e-4)
    >>> random.hysteresis.bound, random.hysteresis.divisor, random.threshold.origin
    (0.0003, 3.0, '')
    """

    launch: RandomBound = RandomBound()
    drift: RandomBound = RandomBound(divisor=_RECTANGULAR)
    fluctuation: RandomBound = RandomBound()
    hysteresis: RandomBound = RandomBound()
    threshold: RandomBound = RandomBound(divisor=_RECTANGULAR)
    scale_factor: RandomBound = RandomBound()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_texts(warnings=self.warnings)
        for item in fields(self):
            if item.name != "warnings":
                expect(getattr(self, item.name), RandomBound)

    def __repr__(self) -> str:
        known = {name: getattr(self, name) for name in _UNITS if getattr(self, name).origin}
        told = [f"{name} {found.bound:.3g} {_UNITS[name]}" for name, found in known.items()]
        return f"<RandomPart: {', '.join(told) or 'nothing known'}>"


def random_part(
    calibration: Calibration,
    stability: Stability | None = None,
    *,
    factor: float = USUAL_FACTOR,
    launch: float | None = None,
    drift_rate: float | None = None,
    fluctuation: float | None = None,
    hysteresis: float | None = None,
    threshold: float | None = None,
    scale_factor_instability: float | None = None,
) -> RandomPart:
    """Collect the random part: what is given, else from a stability test, else the calibration.

    Parameters
    ----------
    calibration : Calibration
        Tells launch-to-launch errors and the temperature hysteresis, as far as it knows them.
    stability : Stability, optional
        Stability test in g, as `accelcal.analyse` gives it with a scale factor.
    factor : float, default 3
        t_P: launch, fluctuation, hysteresis and scale factor are given as t_P standard deviations.
    launch, fluctuation, hysteresis, threshold : float, optional
        Bounds k0L, k0F, h_T, p [g].
    drift_rate : float, optional
        gamma_D [g/s].
    scale_factor_instability : float, optional
        Bound k1 [1].

    Returns
    -------
    RandomPart
        Each bound with its divisor and origin.

    Raises
    ------
    InputError
        If a bound is negative, not finite or above 1, or the drift rate above 1 g/h.
    DocumentError
        If `stability` is not in g.

    Notes
    -----
    A drift rate as given and a threshold are bounds of a rectangular distribution. The drift rate
    of a stability test may be as large as the interval of its mean slope lets that of a new launch
    be. Where the test tells its sign, all of that is a standard uncertainty: as rectangular it
    would hold the truth in 84 % only, where it is twice the other errors. Where launches drift
    differently, its root mean square is a standard deviation. The hysteresis
    of a calibration is half the difference of two branches: the bias is on the one or the other.

    Examples
    --------
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> found = accelcal.random_part(calibration, fluctuation=2e-5)
    >>> found.launch.origin, found.fluctuation.origin, found.drift.origin
    ('calibration, declared', 'given', '')
    """
    expect(calibration, Calibration)
    check_number(0.0, factor=factor)
    check_number_or_none(0.0, launch=launch, drift_rate=drift_rate, fluctuation=fluctuation)
    if drift_rate is not None and drift_rate > 1.0 / HOUR:
        raise InputError(
            f"drift rate is {HOUR * drift_rate:g} g/h; it is at most 1 g/h: write 20 ug/h as 2e-5"
            f" g/h, or {2e-5 / HOUR:.3g} g/s"
        )
    check_number_or_none(0.0, hysteresis=hysteresis, threshold=threshold)
    check_number_or_none(0.0, scale_factor_instability=scale_factor_instability)
    given = {
        "launch": (launch, factor),
        "drift": (drift_rate, _RECTANGULAR),
        "fluctuation": (fluctuation, factor),
        "hysteresis": (hysteresis, factor),
        "threshold": (threshold, _RECTANGULAR),
        "scale_factor": (scale_factor_instability, factor),
    }
    measured = {} if stability is None else _from_stability(stability)
    found = {
        n: RandomBound(b, divisor, "given") for n, (b, divisor) in given.items() if b is not None
    }
    said = () if stability is None else tuple(_doubts(stability, calibration))
    bounds = _from_calibration(calibration, factor) | measured | found
    return RandomPart(**bounds, warnings=said)


def _doubts(stability: Stability, calibration: Calibration) -> Iterator[str]:
    """Say what a stability test warns of, to who does not see its report."""
    names = dict.fromkeys(gate.name for gate in stability.gates if gate.verdict == "warn")
    if names:
        yield (
            f"checks of the stability test warn, {', '.join(names)}: clear that up before its"
            " numbers are used, its report tells more"
        )
    tested, calibrated = stability.serial, calibration.serial
    if tested and calibrated and tested != calibrated:
        yield f"the stability test is of serial {tested}, the calibration of {calibrated}"


def _from_calibration(calibration: Calibration, factor: float) -> dict[str, RandomBound]:
    names = {"launch": "launch", "launch_sf": "scale_factor"}
    found = {
        names[source.name]: RandomBound(
            factor * source.value, factor, f"calibration, {source.source}", source.dof or math.inf
        )
        for source in calibration.error_sources
        if source.name in names and source.value is not None
    }
    model = calibration.temperature_model
    if model is not None and model.hysteresis is not None and model.hysteresis.value is not None:
        size = abs(model.hysteresis.value)
        found["hysteresis"] = RandomBound(size, _TWO_POINTS, "calibration")
    return found


def _from_stability(stability: Stability) -> dict[str, RandomBound]:
    expect(stability, Stability)
    if stability.unit != "g":
        remedy = (
            "analyse it with the scale factor: --calibration or --scale-factor of accelcal"
            " stability, scale_factor of accelcal.analyse"
        )
        raise DocumentError(f"the stability test is in {stability.unit} in place of g; {remedy}")
    known = stability.components
    sizes = {name: component.value for name, component in known.items() if component.value}
    found = {
        name: RandomBound(
            sizes[bound],
            sizes[bound] / sizes[sigma],
            "stability test",
            known[sigma].dof or math.inf,
        )
        for name, bound, sigma in (("launch", "k0L", "sigma_L"), ("fluctuation", "k0F", "sigma_F"))
        if bound in sizes and sigma in sizes
    }
    step = known.get("threshold")
    if step is not None and step.value is not None:
        found["threshold"] = RandomBound(step.value, _RECTANGULAR, "stability test")
    drift = known.get("gamma_D")
    return found if drift is None else found | _drift(drift)


def _drift(found: Estimate) -> dict[str, RandomBound]:
    """Bound of the drift in a launch to come, from the mean slope of those tested."""
    if found.lower is None or found.upper is None:
        size = found.value and abs(found.value)
        return {"drift": RandomBound(size, _OF_KNOWN_SIGN, "stability test")} if size else {}
    if found.value is not None and found.finding == DRIFTS_DIFFER:
        scatter = RandomBound(abs(found.value), 1.0, "stability test", found.dof or math.inf)
        return {"drift": scatter}
    limit = _largest_drift(found.lower, found.upper, found.dof)
    if found.value:  # its sign is known, and nothing corrects it: all of it counts
        divisor = abs(found.value) / limit
        origin = FEW_LAUNCHES if found.dof is None else "stability test"
        return {"drift": RandomBound(abs(found.value), divisor, origin)}
    return {"drift": RandomBound(limit, _RECTANGULAR, NOT_IDENTIFIED)}


def _largest_drift(lower: float, upper: float, dof: float | None) -> float:
    """Largest drift of a launch by the interval of the mean slope.

    With dof + 1 slopes of standard deviation s about it, the half width of that interval is
    t s / sqrt(dof + 1), and that of the slope of a new launch t s sqrt(1 + 1 / (dof + 1)).
    """
    wider = 1.0 if dof is None else math.sqrt(dof + 2.0)
    return abs(0.5 * (lower + upper)) + 0.5 * wider * (upper - lower)
