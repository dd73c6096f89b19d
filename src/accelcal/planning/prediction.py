"""What a test will tell: uncertainties as `accelcal.fit` gives them, and which effects show.

The readings are simulated without errors and the errors declared, so that there is no second
opinion on uncertainty: what is foreseen is what the fit itself says.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, replace
from typing import NamedTuple

import numpy as np

from accelcal.accelerometer import Accelerometer
from accelcal.calibrate.fit import fit
from accelcal.discovery.family import family_of, with_rates
from accelcal.discovery.instance import searched_among
from accelcal.discovery.noise.of_readings import ReadingNoise
from accelcal.discovery.prospects.audit import aliases, designed, smallest_detectable, undetectable
from accelcal.estimate.estimability import estimability
from accelcal.estimate.uncertainty import counted
from accelcal.geometry import accelerations
from accelcal.model import ERROR_TERMS, ERROR_UNITS, SLOPES, design_matrix
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.calibration import Calibration
from accelcal.results.designs import Forecast, Visibility
from accelcal.results.table import TableCalibration
from accelcal.results.tables_in_use import nearest_of_mountings
from accelcal.results.temperature import TemperatureModel
from accelcal.simulation import NOISE_FREE, NoiseComponents, TumblePlan, simulate

AT_T0 = {"k0 at T0": ("k0", "g"), "K1 at T0": ("K1", "1"), "delta at T0": ("delta", "rad")}
"""Name of a value at T0, from the runs at all levels -> law and unit."""

_UNITS = {"K1": "1"} | {name: ERROR_UNITS[error] for name, error in ERROR_TERMS.items()}
_NO_NOISE = 1e-12  # g; in place of zero, which is no standard deviation of a reading
_STEP = 1e-3  # relative, by which the variance of a source is raised to find its share
_QUIET = 0.1  # noise that a hundred times the strokes leave, over the noise


class Figure(NamedTuple):
    """One figure that a calibration tells."""

    value: float  # in its unit
    variance: float  # square of its standard uncertainty
    unit: str
    stands_for: str | None = None  # what it really is, where it absorbs something


Key = tuple[str, str]  # name and mounting


class _Test(NamedTuple):
    """A test that is only planned."""

    plan: TumblePlan
    noise: NoiseComponents
    accelerometer: Accelerometer

    def foreseen(self) -> dict[Key, Figure]:
        """What the fit tells of readings without errors that declare those they might have."""
        exact = replace(self.plan, resolution=0.0)
        record = simulate(self.accelerometer, exact, NOISE_FREE, seed=0, declare=False)
        noise = max(self.noise.reading, _NO_NOISE)
        one = self.accelerometer.scale_factor.at_T0 * noise
        record = replace(record, std=np.full(len(record), one)).with_apparatus(
            resolution=self.plan.resolution, **self.noise.declared()
        )
        return figures(fit(record, delta0=self.plan.delta0))

    def variances(self) -> dict[Key, float]:
        """Variance of each figure."""
        return {key: figure.variance for key, figure in self.foreseen().items()}

    def with_noise(self, **sizes: float) -> _Test:
        """Return the test without rounding, and with other errors."""
        bare = replace(self.plan, resolution=0.0)
        return self._replace(plan=bare, noise=replace(self.noise, **sizes))


def forecasts(
    plan: TumblePlan, noise: NoiseComponents, accelerometer: Accelerometer, *, declared: bool = True
) -> tuple[Forecast, ...]:
    """Foresee the uncertainty of all that a test tells, with such errors of readings and stand.

    These are coefficients (over K1), terms of the error model, temperature slopes and fixture
    angles; the coefficients of the accelerometer hardly matter. The errors of the stand will be
    `declared` to the fit or not; the reading noise it takes from the replicates either way.

    Raises
    ------
    DesignError
        If the test does not determine the scale factor.

    Notes
    -----
    Where the weights of the fit are the best ones, a variance is stationary in them; so its growth
    with the variance of one source of error is the share of this source.
    """
    test = _Test(plan, noise, accelerometer)
    foreseen = test.foreseen()
    unseen, shares = _unseen(test, foreseen), _shares(test, foreseen)
    if unseen:
        shares["temperature"] = unseen
    quiet = test.with_noise(reading=_QUIET * noise.reading).variances()
    dof = _degrees_of_freedom(test, declared=declared)
    return tuple(
        _forecast(
            key,
            found._replace(variance=found.variance + unseen.get(key, 0.0)),
            {source: part[key] for source, part in shares.items()},
            quiet[key] + unseen.get(key, 0.0),
            dof,
        )
        for key, found in foreseen.items()
    )


def _shares(test: _Test, foreseen: Mapping[Key, Figure]) -> dict[str, dict[Key, float]]:
    """Share of each source of error in each variance; rounding has what the others leave."""
    exact = test.plan.resolution == 0.0
    base = {k: f.variance for k, f in foreseen.items()} if exact else test.with_noise().variances()
    shares = {}
    for source, size in asdict(test.noise).items():
        if size > 0.0:
            grown = test.with_noise(**{source: size * (1.0 + _STEP) ** 0.5}).variances()
            shares[source] = {key: max(grown[key] - base[key], 0.0) / _STEP for key in base}
    rounded = {key: max(f.variance - base[key], 0.0) for key, f in foreseen.items()}
    return {**shares, "resolution": rounded}


def _unseen(test: _Test, foreseen: Iterable[Key]) -> dict[Key, float]:
    """Variances by the temperature that the fit cannot state, as the levels tell no slopes."""
    plan, size = test.plan, test.noise.temperature
    if size == 0.0 or any(name in SLOPES for name, _ in foreseen):
        return {}
    above, below = (
        test._replace(
            plan=replace(plan, temperatures=tuple(t + by for t in plan.temperatures))
        ).foreseen()
        for by in (0.5, -0.5)
    )
    nominal = {("K1", side): above["K1", side].value for side in plan.mountings}
    return {
        key: (size * (above[key].value - below[key].value) / nominal.get(key, 1.0)) ** 2
        for key in above
    }


def _forecast(
    key: Key,
    found: Figure,
    shares: Mapping[str, float],
    floor: float,
    dof: Mapping[str, float | None],
) -> Forecast:
    scale = found.variance / sum(shares.values()) if found.variance > 0.0 else 0.0
    parts = {source: scale * share for source, share in shares.items() if share > 0.0}
    effective = _effective(parts, dof)
    expanded = None
    if effective is not None:
        expanded = student_quantile(LEVEL, effective) * found.variance**0.5
    return Forecast(
        name=key[0],
        mounting=key[1],
        unit=found.unit,
        standard_uncertainty=found.variance**0.5,
        expanded_uncertainty=expanded,
        dof=None if effective is None or np.isinf(effective) else effective,
        floor=floor**0.5,
        budget={source: part**0.5 for source, part in parts.items()},
        stands_for=found.stands_for,
    )


def _effective(parts: Mapping[str, float], dof: Mapping[str, float | None]) -> float | None:
    """Effective degrees of freedom as the fit counts them; None where nothing tells a source.

    Examples
    --------
    >>> _effective({"head": 1e-9, "noise": 1.0}, {"head": None, "noise": 5.0})
    5.000000005
    >>> _effective({"head": 1.0, "noise": 1.0}, {"head": None, "noise": 5.0})
    >>> _effective({"head": 3.0, "noise": 1.0}, {"noise": 1.0})
    4.0
    >>> _effective({"head": 1.0, "noise": 3.0}, {"head": 1.0})
    2.0
    """
    whole, inverse = sum(parts.values()), 0.0
    for source, part in parts.items():
        own = dof.get(source, np.inf)
        if own is None:
            if part > 1e-4 * whole:
                return None
            continue
        inverse += part / whole / (own if source == "noise" else float(counted(own)))
    return max(1.0 / inverse, 1.0) if inverse > 1e-6 else np.inf


def figures(calibration: Calibration) -> dict[Key, Figure]:
    """Everything that a calibration tells, over the scale factor, by name and mounting.

    Coefficients and terms of the error model are those of the first table nearest to T0 in each
    mounting, the one of most tables first.

    Examples
    --------
    >>> from accelcal.simulation import simulate
    >>> round(figures(fit(simulate(seed=1)))["K2", "o+"].value, 4)
    0.0001
    """
    found: dict[Key, Figure] = {}
    for table in nearest_of_mountings(calibration.tables, calibration.T0_degC).values():
        found |= _of_table(table)
    for laws in (calibration.temperature_model, calibration.second_axis_model):
        second = any((name, "") in found for name in SLOPES)
        found |= dict(_of_laws(laws, "other axis" if second else ""))
    for angle in calibration.fixture_angle:
        variance = (angle.angle.standard_uncertainty or 0.0) ** 2
        found["delta0", angle.axis] = Figure(angle.angle.value or 0.0, variance, "rad")
    return found


def _of_table(table: TableCalibration) -> dict[Key, Figure]:
    scale_factor = table.coefficients["K1"].value or 1.0
    found: dict[Key, Figure] = {}
    for name, quantity in table.coefficients.items():
        if quantity.value is not None:
            variance = ((quantity.standard_uncertainty or 0.0) / scale_factor) ** 2
            meaning = table.stands_for.get(name)
            value = quantity.value / scale_factor if name != "K1" else quantity.value
            found[name, table.mounting] = Figure(value, variance, _UNITS[name], meaning)
    for name, error in ERROR_TERMS.items():
        quantity = table.error_model[error]
        if quantity.value is not None:
            variance = (quantity.standard_uncertainty or 0.0) ** 2
            meaning = table.stands_for.get(name)
            found[error, table.mounting] = Figure(quantity.value, variance, quantity.unit, meaning)
    return found


def _of_laws(laws: TemperatureModel | None, mounting: str) -> Iterator[tuple[Key, Figure]]:
    for name, (law, unit) in AT_T0.items():
        value = None if laws is None else getattr(laws, law).at_T0
        if value is not None and value.value:
            scale = value.value if law == "K1" else 1.0
            variance = ((value.standard_uncertainty or 0.0) / scale) ** 2
            yield (name, mounting), Figure(value.value, variance, unit)
    for name, (law, side) in SLOPES.items():
        slope = None if laws is None else getattr(getattr(laws, law), side)
        if slope is not None and slope.value is not None:
            variance = (slope.standard_uncertainty or 0.0) ** 2
            yield (name, mounting), Figure(slope.value, variance, slope.unit)


def _degrees_of_freedom(test: _Test, *, declared: bool) -> dict[str, float | None]:
    """Degrees of freedom of each source: what the fit finds in one simulated table."""
    loud = replace(test.noise, reading=max(test.noise.reading, _NO_NOISE))
    record = simulate(test.accelerometer, test.plan, loud, seed=0, declare=declared)
    found: dict[str, float | None] = {} if declared else {"temperature": None}
    for source in fit(record, delta0=test.plan.delta0).error_sources:
        endless = np.inf if source.source in ("declared", "estimated") else None
        found.setdefault(source.name, endless if source.dof is None else source.dof)
    return found


def lost_coefficients(plan: TumblePlan) -> tuple[str, ...]:
    """Say which coefficients a test cannot tell apart, and what the others stand for.

    Examples
    --------
    >>> lost_coefficients(TumblePlan(positions=4))[0]
    'K3 cannot be told apart from K1 at these angles: K1 stands for K1 + K3'
    """
    mounting = plan.mountings[0]
    stops = accelerations(plan.stops, plan.delta0, mounting)
    return estimability(design_matrix(stops, mounting)).sentences()


def visibility(
    plan: TumblePlan, noise: NoiseComponents, accelerometer: Accelerometer, *, declared: bool = True
) -> tuple[Visibility, ...]:
    """Tell for each effect of the catalogue whether a test would show it, and from what size.

    First come the effects that coefficients absorb, then those that can be seen. The errors of the
    stand will be `declared` or not.

    Raises
    ------
    InputError
        If the test has too few replicates for anything to be discovered.

    Examples
    --------
    >>> from accelcal.simulation import AL15
    >>> found = visibility(TumblePlan(), NoiseComponents(), AL15)
    >>> {item.id: item.absorbed_by for item in found}["odd-quadratic"]
    ('K1', 'K3')
    """
    record = simulate(accelerometer, plan, NOISE_FREE, seed=0, declare=False)
    if declared:
        record = record.with_apparatus(**noise.declared())
    reference = accelerometer.reference_temperature
    sigma = ReadingNoise(max(noise.reading, 1e-12), rho=0.0, dof=0, tails=np.inf)
    comparison = designed(record, reference, sigma, plan.delta0)
    family = with_rates(family_of(comparison, searched_among()))
    found, seen = family.candidates, smallest_detectable(family)
    alike = {item.id: item.exact for item in aliases(found)}
    return (
        *(Visibility(item.id, item.absorbed_by, None) for item in undetectable(comparison, found)),
        *(Visibility(size.id, None, size.value, size.unit, alike[size.id]) for size in seen),
    )
