"""The result of a stability test: a frozen analysis to be printed, saved, tabulated and drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, Self

from accelcal.escapes import visible
from accelcal.numerics.probability import LEVEL
from accelcal.plural import counted
from accelcal.results.documents.checked import (
    DamageError,
    Kind,
    checked,
    freedom_or_none,
    integer,
    list_of,
    mapping_of,
    number,
    or_none,
)
from accelcal.results.documents.fields import (
    Document,
    ReadByFields,
    StoredPart,
    document_of,
    members,
)
from accelcal.results.documents.stored import StoredResult
from accelcal.results.quantity import Gate
from accelcal.results.tabular import TabularResult

if TYPE_CHECKING:
    from accelcal.plot.stability import StabilityPlot

__all__ = ["DRIFTS_DIFFER", "AllanDeviation", "BiasBound", "Estimate"]
__all__ += ["LaunchTrend", "Stability"]


DRIFTS_DIFFER = "launches drift differently: root mean square of their slopes"
"""Finding of a drift that has another slope in each launch, and no mean."""


@dataclass(frozen=True, slots=True)
class Estimate(StoredPart):
    """A value with its 95 % interval, or the reason why there is none.

    Attributes
    ----------
    value : float or None
        The estimate; None where the data do not show it.
    unit : str
        Unit of value and limits.
    lower, upper : float or None
        Limits of the 95 % interval. Where `value` is None, they are what the data allow it to be.
    dof : float or None
        Effective degrees of freedom; None where there are none to tell.
    finding : str
        Why a value or limit is missing, or what to know before using it; empty for nothing.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"dof": freedom_or_none}
    _MISSING: ClassVar[Mapping[str, Any]] = {
        **dict.fromkeys(("lower", "upper", "dof")),
        **dict.fromkeys(("unit", "finding"), ""),
    }

    value: float | None
    unit: str
    lower: float | None = None
    upper: float | None = None
    dof: float | None = None
    finding: str = ""

    def times(self, factor: float, unit: str | None = None) -> Estimate:
        """Multiply value and limits by a number above 0."""
        value, lower, upper = (
            None if number is None else factor * number
            for number in (self.value, self.lower, self.upper)
        )
        return Estimate(value, unit or self.unit, lower, upper, self.dof, self.finding)


def _low_and_high(value: Any) -> tuple[float, float]:
    found = list_of(number)(value)
    if len(found) != 2:
        raise DamageError(f"{len(found)} numbers in place of the lowest and the highest")
    return found[0], found[1]


@dataclass(frozen=True, slots=True)
class LaunchTrend(StoredPart):
    """What one launch shows.

    Attributes
    ----------
    label : str
        Name of the launch.
    samples : int
        Number of samples.
    duration_s : float
        Time from first to last sample [s].
    interval_s : float
        Time between samples, their median [s].
    initial_mean : float or None
        Mean over the initial window; None where the launch is shorter.
    level : float
        The trend line at the start of the launch.
    drift : Estimate
        Slope of the trend line.
    fluctuation : Estimate
        Standard deviation about the trend line.
    temperature_degC : tuple of float or None
        Lowest and highest temperature; None where there is none.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"temperature_degC": or_none(_low_and_high)}

    label: str
    samples: int
    duration_s: float
    interval_s: float
    initial_mean: float | None
    level: float
    drift: Estimate
    fluctuation: Estimate
    temperature_degC: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class BiasBound(StoredPart):
    """Bound (3) of the random bias error at one time.

    Attributes
    ----------
    time_s : float
        Time since the start of a launch [s].
    drift : Estimate
        k0D(t) = gamma_D t.
    bound : Estimate
        k0(t) of (3), without its sign.
    """

    time_s: float
    drift: Estimate
    bound: Estimate

    def _contents(self) -> dict[str, Any]:
        return {
            "time_s": self.time_s,
            "k0D": self.drift.to_document(),
            "k0": self.bound.to_document(),
        }

    @classmethod
    def _read(cls, document: Document) -> BiasBound:
        drift, bound = (checked(document, key, Estimate.from_document) for key in ("k0D", "k0"))
        return cls(checked(document, "time_s", number), drift, bound)


@dataclass(frozen=True, slots=True)
class AllanDeviation(ReadByFields, TabularResult):
    """Overlapping Allan deviation, an entry for each averaging time.

    Attributes
    ----------
    tau_s : tuple of float
        Averaging time [s].
    deviation : tuple of float
        Deviation.
    lower, upper : tuple of float
        Limits of the interval at `level`.
    edf : tuple of float
        Equivalent degrees of freedom.
    count : tuple of int
        Number of second differences.
    alpha : tuple of int
        Exponent of the identified noise: 2 and 1 white and flicker noise of the integrated output,
        0 white, -1 flicker, -2 random walk.
    level : float
        Probability of the interval.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"alpha": list_of(integer)}

    tau_s: tuple[float, ...] = ()
    deviation: tuple[float, ...] = ()
    lower: tuple[float, ...] = ()
    upper: tuple[float, ...] = ()
    edf: tuple[float, ...] = ()
    count: tuple[int, ...] = ()
    alpha: tuple[int, ...] = ()
    level: float = 0.95

    def __repr__(self) -> str:
        return f"<AllanDeviation at {counted(len(self.tau_s), 'averaging time')}>"

    __str__ = __repr__

    def rows(self) -> list[dict[str, float]]:
        """List the averaging times, a flat dictionary each."""
        names = [item.name for item in fields(self) if item.name != "level"]
        columns = (getattr(self, name) for name in names)
        return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]

    @classmethod
    def from_document(cls, document: Document) -> AllanDeviation:
        """Read the deviation from its place in a JSON document."""
        points = checked(document, "points", list_of(mapping_of(number)))
        names = [item.name for item in fields(cls) if item.name != "level"]
        columns = {name: [point.get(name) for point in points] for name in names}
        return cls._of_fields(columns, level=checked(document, "level", number))


@dataclass(frozen=True, slots=True)
class Stability(StoredResult, TabularResult):
    """Random part of the error of one accelerometer from one stability test.

    Attributes
    ----------
    components : mapping of str to Estimate
        sigma_L, gamma_D, sigma_F, k0L, k0F of (3), and noise, resolution, threshold, hysteresis.
    bounds : tuple of BiasBound
        k0D(t) and (3) at the times asked for.
    launches : tuple of LaunchTrend
        One a launch.
    allan : AllanDeviation
        Pooled over the launches; empty where it could not be determined.
    noise_terms : mapping of str to Estimate
        Coefficients Q, N, B, K, R of the Allan deviation.
    gates : tuple of Gate
        Checks with their findings.
    warnings : tuple of str
        What a reader must know before using the numbers.
    unit : str
        Unit of all values: ``"g"``, or that of the output where no scale factor is known.
    output_unit : str or None
        Unit of the record.
    scale_factor : float or None
        K1 that turned outputs into g.
    coverage : str
        How the factor t_P was chosen.
    window_s : float
        Initial window of the launch means [s].
    serial : str or None
        Serial number.
    source : str
        Where the record came from.
    software : str
        Name and version of what made the analysis.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> random = np.random.default_rng(1)
    >>> noise = 1e-5 * random.normal(size=(3, 600))
    >>> launches = [accelcal.Launch("cold", np.arange(600.0), output) for output in noise]
    >>> found = accelcal.analyse(accelcal.StabilityRecord(launches, unit="g"))
    >>> round(found.components["sigma_F"].value, 6), found.components["sigma_F"].unit
    (1e-05, 'g')
    >>> accelcal.Stability.from_json(found.to_json()) == found
    True
    """

    SCHEMA: ClassVar[str] = "accelcal/stability/1"
    _WRITER: ClassVar[str] = "accelcal stability"

    components: Mapping[str, Estimate]
    bounds: tuple[BiasBound, ...]
    launches: tuple[LaunchTrend, ...]
    allan: AllanDeviation
    noise_terms: Mapping[str, Estimate]
    gates: tuple[Gate, ...]
    warnings: tuple[str, ...]
    unit: str
    output_unit: str | None
    scale_factor: float | None
    coverage: str
    window_s: float
    serial: str | None = None
    source: str = "<record>"
    software: str = ""

    def __repr__(self) -> str:
        name = f"serial {self.serial}" if self.serial else self.source
        return visible(
            f"<Stability {name}: {counted(len(self.launches), 'launch')}, in {self.unit}>"
        )

    @property
    def plot(self) -> StabilityPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.stability import StabilityPlot

        return StabilityPlot(self)

    def _contents(self) -> dict[str, Any]:
        return {
            **members(
                self, "software source serial output_unit unit scale_factor coverage window_s"
            ),
            "interval_level": LEVEL,
            "components": document_of(self.components),
            "bias_bound": document_of(self.bounds),
            "launches": document_of(self.launches),
            "allan": {"level": self.allan.level, "points": self.allan.rows()},
            **members(self, "noise_terms gates warnings"),
        }

    @classmethod
    def _read(cls, document: Document) -> Self:
        return cls._of_fields(
            document,
            bounds=checked(document, "bias_bound", list_of(BiasBound.from_document)),
            allan=checked(document, "allan", AllanDeviation.from_document),
        )

    def rows(self) -> list[dict[str, Any]]:
        """List components, noise terms and bounds, a flat dictionary each."""
        named: list[tuple[str, float | None, Estimate]] = [
            (name, None, e) for name, e in {**self.components, **self.noise_terms}.items()
        ]
        for bound in self.bounds:
            named += [("k0D", bound.time_s, bound.drift), ("k0", bound.time_s, bound.bound)]
        return [{"quantity": name, "time_s": time, **e.to_document()} for name, time, e in named]
