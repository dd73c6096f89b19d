"""Error budget (4): the formula by hand, its band, its coverage, the command and its picture."""

import csv
import io
import json
import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import accelcal
from accelcal.cli.main import main
from accelcal.error_budget.budget import budget
from accelcal.error_budget.coefficients import coefficients_of
from accelcal.error_budget.random_part import RandomBound, RandomPart, random_part
from accelcal.errors import DocumentError, InputError
from accelcal.geometry import Acceleration
from accelcal.plot.style import picture
from accelcal.results.quantity import Gate, Quantity
from accelcal.results.stability import DRIFTS_DIFFER, AllanDeviation, Estimate, Stability
from accelcal.results.temperature import TemperatureModel
from accelcal.simulation import NoiseComponents, TumblePlan

EXAMPLE = Path(__file__).parents[1] / "examples" / "al15.csv"
QUIET = NoiseComponents(reading=0.0, head=0.0, launch=0.0, launch_sf=0.0)
PAPER_RANDOM = {  # of the paper, 3 sigma; 2e-5 g of drift in 12 h
    "launch": 2e-5,
    "drift_rate": 2e-5 / 43200.0,
    "fluctuation": 2e-5,
    "hysteresis": 3e-4,
    "scale_factor_instability": 15e-6,
    "threshold": 0.0,
}


@pytest.fixture(scope="module")
def exact():
    """Calibration without errors: the coefficients are those of the paper."""
    return accelcal.fit(accelcal.simulate(noise=QUIET, seed=0))


@pytest.fixture(scope="module")
def al15():
    return accelcal.fit(accelcal.read_table(EXAMPLE))


@pytest.fixture
def saved(al15, tmp_path):
    path = tmp_path / "al15.json"
    al15.to_json(path)
    return path


def by_hand(a_i, a_p, rise):
    """The systematic part of (4), with the paper's figures and what the simulation adds to them."""
    lam, beta, gam = (-3.9e-5, 520e-6, 1.5e-6) if rise > 0 else (-4.5e-5, 480e-6, 1.2e-6)
    error = 3.324e-3 + lam * rise + beta * rise * a_i + 105e-6 * a_i**2 + 87e-6 * a_i**3
    return error + (1.15e-3 + gam * rise) * a_p + 20e-6 * a_i * a_p


# -- the formula -----------------------------------------------------------------------------------


@pytest.mark.parametrize("temperature", [-40.0, -7.0, 20.0, 33.0, 80.0])
@pytest.mark.parametrize(("a_i", "a_p"), [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.6, -0.8)])
def test_systematic_part_by_hand(exact, a_i, a_p, temperature):
    found = budget(exact, a_i, a_p=a_p, temperature=temperature)
    expected = by_hand(a_i, a_p, temperature - 20.0)
    assert found.systematic[0] == pytest.approx(expected, abs=2e-8)


def test_paper_at_the_hot_end(exact):
    """520 ppm/degC times 60 degC is 31.2 mg at 1 g, ten times the bias."""
    found = budget(exact, 1.0, temperature=80.0)
    parts = {part.symbol: part.value[0] for part in found.components}
    assert parts["beta"] == pytest.approx(31.2e-3, rel=1e-5)
    assert parts["lam"] == pytest.approx(-2.34e-3, rel=1e-4)
    assert parts["k0"] == pytest.approx(3.324e-3, rel=1e-5)


def test_band_by_hand(exact):
    """0.5 sqrt(k0L^2 + k0D^2 + k0F^2) + h_T + p + k1 |a_i| after 12 h, the paper's figures."""
    random = random_part(exact, **PAPER_RANDOM)
    found = budget(exact, -0.5, time=43200.0, random=random)
    expected = 0.5 * math.sqrt(3) * 2e-5 + 3e-4 + 15e-6 * 0.5
    assert found.bound[0] == pytest.approx(expected, rel=1e-12)


def test_components_add_up_to_the_model(al15):
    random = random_part(al15, **PAPER_RANDOM)
    a_i, a_p = np.array([1.0, 0.3, -0.7]), np.array([0.0, -0.9, 0.7])
    found = budget(al15, a_i, a_p=a_p, time=600.0, random=random)
    coefficients = coefficients_of(al15)
    errors = {n: q.value for n, q in coefficients.at_T0.items() if n != "K1"}
    bias = accelcal.model.bias_bound(600.0, 2e-5, 2e-5 / 43200.0, 2e-5)
    where = Acceleration(a_i, a_p, np.zeros(3))
    systematic = accelcal.model.acceleration_error(errors, where)
    np.testing.assert_allclose(found.systematic, systematic, rtol=1e-12)
    np.testing.assert_allclose(found.bound, bias + 3e-4 + 15e-6 * np.abs(a_i), rtol=1e-12)


def test_exact_form_is_that_of_2(exact):
    found = budget(exact, 1.0, temperature=80.0, exact=True)
    (beta,) = [part.value[0] for part in found.components if part.symbol == "beta"]
    assert beta == pytest.approx((1.0 + 0.0312 - 1.0) / (1.0 + 0.0312), rel=1e-5)


def test_error_is_that_of_the_output_over_the_scale_factor_at_its_temperature(exact):
    now, k0 = 1.35 * (1.0 + 520e-6 * 60.0), 3.324e-3 - 3.9e-5 * 60.0
    output = now * (k0 - 1.0 + 1.05e-4 - 8.7e-5)  # at -1 g, by the coefficients of the paper
    found = budget(exact, -1.0, temperature=80.0, exact=True).systematic[0]
    assert found == pytest.approx((output + 1.35) / now, rel=1e-6)
    assert found * now / 1.35 == pytest.approx(output / 1.35 + 1.0, rel=1e-6)


def test_what_the_first_order_leaves_out_is_told(exact):
    told = " ".join(budget(exact, 1.0, temperature=80.0).warnings)
    assert "-944 ug" in told  # 0.0312 / 1.0312 - 0.0312
    assert "first order" not in " ".join(budget(exact, 1.0, temperature=80.0, exact=True).warnings)
    assert "first order" not in " ".join(budget(exact, 1.0).warnings)


def test_arrays_broadcast_and_agree_with_single_points(al15):
    grid = budget(al15, np.array([[0.0], [1.0]]), temperature=[-40.0, 20.0, 80.0], time=60.0)
    singles = [budget(al15, a, temperature=t, time=60.0) for a in (0, 1) for t in (-40, 20, 80)]
    for name in ("systematic", "bound", "standard_uncertainty", "expanded_uncertainty"):
        expected = [getattr(single, name)[0] for single in singles]
        np.testing.assert_allclose(getattr(grid, name), expected, rtol=1e-13)


# -- the uncertainty -------------------------------------------------------------------------------


def test_standard_uncertainties_of_the_bounds(exact):
    random = random_part(exact, factor=2.7, **PAPER_RANDOM)
    found = budget(exact, 1.0, time=43200.0, random=random, temperature_uncertainty=0.1)
    u = {part.symbol: part.standard_uncertainty[0] for part in found.components}
    assert u["k0L"] == pytest.approx(2e-5 / 2.7)
    assert u["k0F"] == pytest.approx(2e-5 / 2.7)
    assert u["k0D"] == pytest.approx(2e-5 / math.sqrt(3))
    assert u["h_T"] == pytest.approx(3e-4 / 2.7)
    assert u["k1"] == pytest.approx(15e-6 / 2.7)
    assert u["T"] == pytest.approx(0.1 * (520e-6 - 3.9e-5), rel=1e-3), "the larger slope"


def test_uncertainty_of_the_temperature_acts_by_the_slopes(exact):
    found = budget(exact, 1.0, a_p=0.5, temperature=80.0, temperature_uncertainty=0.1)
    (u,) = [part.standard_uncertainty[0] for part in found.components if part.symbol == "T"]
    assert u == pytest.approx(0.1 * (-3.9e-5 + 520e-6 + 0.5 * 1.5e-6), rel=1e-3)


@pytest.mark.parametrize("levels", [1, 3])
def test_calibration_uncertainty_is_that_of_the_covariance(al15, levels):
    """x' C x / K1^2 with the table's covariance is what correlated coefficients give at T0."""
    table = al15.tables[0]
    if levels == 1:
        al15 = replace(al15, tables=(table,), temperature_model=None)
    a, p = 0.8, -0.6
    x = np.array([1.0, a, a**2, a**3, p, a * p])
    assert table.covariance_names == ("K0", "K1", "K2", "K3", "M", "M_ip")
    expected = math.sqrt(x @ table.covariance @ x) / table.coefficients["K1"].value
    found = budget(al15, a, a_p=p, random=RandomPart())
    assert found.standard_uncertainty[0] == pytest.approx(expected, rel=5e-3)


def test_expanded_uncertainty_has_the_factor_of_its_degrees_of_freedom():
    """Without acceleration the error is k0, so that the interval is the one of k0 at T0.

    Nothing is declared: the head is estimated from few residuals.
    """
    calibration = accelcal.fit(accelcal.simulate(seed=4, declare=False))
    found, k0 = budget(calibration, 0.0, random=RandomPart()), calibration.temperature_model.k0
    assert k0.at_T0.coverage_factor > 2.0
    assert found.standard_uncertainty[0] == pytest.approx(k0.at_T0.standard_uncertainty)
    expected = stats.t.ppf(0.975, k0.at_T0.dof)
    assert found.coverage_factor[0] == pytest.approx(expected, rel=1e-3)
    expanded = found.expanded_uncertainty[0]
    assert expanded == pytest.approx(k0.at_T0.expanded_uncertainty, rel=1e-3)


def test_intervals_hold_the_truth():
    """Over many simulated calibrations the calibration's part of U covers: 95 % at T0."""
    runs, points = 120, ((0.0, 20.0), (1.0, 20.0), (1.0, 80.0))
    hits = np.zeros(len(points))
    for seed in range(runs):
        calibration = accelcal.fit(accelcal.simulate(seed=seed))
        estimated = calibration.temperature_model.K1.at_T0.value
        a, temperature = np.array(points).T
        found = budget(calibration, a, temperature=temperature, random=RandomPart(), exact=True)
        scale = 1.35 * (1.0 + 520e-6 * (temperature - 20.0))
        bias = 3.324e-3 - 3.9e-5 * (temperature - 20.0)
        reading = scale * (bias + a + 105e-6 * a**2 + 87e-6 * a**3)
        error = (reading - estimated * a) / scale
        hits += np.abs(error - found.systematic) <= found.expanded_uncertainty
    for count in hits:
        assert stats.binomtest(int(count), runs, 0.95).pvalue > 1e-3


@pytest.mark.parametrize(("temperature", "side"), [(80.0, "above"), (-40.0, "below")])
def test_calibration_uncertainty_away_from_t0(al15, temperature, side):
    """x' C x with the covariance of the laws and of what has no law, written out."""
    model, rise, a, p = al15.temperature_model, temperature - 20.0, 0.8, -0.6
    at_T0 = {"k0": 1.0, "K1": a / model.K1.at_T0.value, "delta": p}
    acting = {f"{law} at_T0": x for law, x in at_T0.items()}
    acting |= {f"k0 {side}": rise, f"K1 {side}": a * rise, f"delta {side}": p * rise}
    acting |= {"k2": a**2, "k3": a**3, "delta_ip": a * p}
    x = np.array([acting.get(name, 0.0) for name in model.covariance_names])
    expected = math.sqrt(x @ np.array(model.covariance_matrix) @ x)
    found = budget(al15, a, a_p=p, temperature=temperature, random=RandomPart())
    assert found.standard_uncertainty[0] == pytest.approx(expected, rel=1e-9)


def test_laws_from_readings_count_as_uncorrelated_with_what_has_no_law():
    """On the safe side: K1 and k3 of one table would cancel."""
    record = accelcal.read_table(EXAMPLE)
    tables, readings = (accelcal.fit(record, temperature_laws=by) for by in ("tables", "readings"))
    u = [budget(c, 1.0, random=RandomPart()).standard_uncertainty[0] for c in (tables, readings)]
    assert u[1] > 1.2 * u[0]


@pytest.mark.filterwarnings("ignore:shift from launch to launch")
@pytest.mark.parametrize("laws", ["tables", "readings"])
def test_u_is_that_of_apply_where_one_degree_of_freedom_tells_the_launches(laws):
    """It was half of it: a quantity alone has one degree of freedom, its covariances had a half."""
    plan = TumblePlan(temperatures=(20.0, 80.0, -40.0, 20.0), strokes=2)
    calibration = accelcal.fit(
        accelcal.simulate(plan=plan, seed=3, declare=False), temperature_laws=laws
    )
    told = budget(calibration, [0.0, 1.0], a_p=[1.0, 0.0], temperature=50.0)
    used = accelcal.apply(calibration, [0.0, 1.35], 50.0, a_p=[1.0, 0.0])
    assert told.expanded_uncertainty == pytest.approx(used.expanded_uncertainty, rel=0.03)


# -- where the random part comes from --------------------------------------------------------------


@pytest.mark.parametrize("laws", ["tables", "readings"])
def test_an_output_of_the_other_sign_has_the_same_budget(laws):
    record = accelcal.simulate(seed=1)
    turned = replace(record, output=-record.output)
    one, other = (
        accelcal.budget(
            accelcal.fit(each, temperature_laws=laws), [-1.0, 0.5], a_p=0.3, temperature=50.0
        )
        for each in (record, turned)
    )
    assert one.expanded_uncertainty == pytest.approx(other.expanded_uncertainty, rel=1e-9)


def test_calibration_tells_launch_and_scale_factor(al15):
    random = random_part(al15)
    assert random.launch == RandomBound(3 * 6.7e-6, 3.0, "calibration, declared")
    assert random.scale_factor == RandomBound(3 * 5e-6, 3.0, "calibration, declared")
    assert random.hysteresis.origin == ""


def test_hysteresis_of_the_calibration_is_either_branch(al15):
    model = replace(al15.temperature_model, hysteresis=Quantity(-2e-4, 1e-5, "g"))
    random = random_part(replace(al15, temperature_model=model))
    assert random.hysteresis == RandomBound(2e-4, 1.0, "calibration")


COMPONENTS = {
    "sigma_L": {"value": 5e-6},
    "k0L": {"value": 2e-5},
    "gamma_D": {"value": -1e-9},
    "sigma_F": {"value": 4e-6},
    "k0F": {"value": 1.2e-5},
    "threshold": {"value": None},
    "hysteresis": {"value": None},
}


def stability_test(components):
    """Result of a stability test of which only the components count."""
    return Stability(
        components={name: Estimate(unit="g", **told) for name, told in components.items()},
        bounds=(),
        launches=(),
        allan=AllanDeviation(),
        noise_terms={},
        gates=(),
        warnings=(),
        unit="g",
        output_unit=None,
        scale_factor=None,
        coverage="t_P = 3",
        window_s=600.0,
    )


def test_stability_goes_before_the_calibration_and_behind_what_is_given(al15):
    random = random_part(al15, stability_test(COMPONENTS), fluctuation=1e-4)
    assert (random.launch.bound, random.launch.origin) == (2e-5, "stability test")
    assert random.launch.standard_uncertainty == pytest.approx(5e-6)
    assert random.drift == RandomBound(1e-9, 1.0, "stability test")
    assert random.fluctuation == RandomBound(1e-4, 3.0, "given")
    assert random.threshold.origin == ""
    assert random.scale_factor.origin == "calibration, declared"


def test_a_stability_result_that_was_saved_serves_as_itself(al15):
    levels = np.random.default_rng(1).normal(0.0, 1e-4, (4, 1))
    noise = np.random.default_rng(2).normal(1.3, 1e-5, (4, 200))
    launches = [
        accelcal.Launch(str(number), np.arange(200.0), output)
        for number, output in enumerate(levels + noise, start=1)
    ]
    record = accelcal.StabilityRecord(tuple(launches), unit="V")
    in_g = accelcal.analyse(record, scale_factor=1.3, window=10.0)
    saved = accelcal.Stability.from_json(in_g.to_json())
    assert random_part(al15, in_g) == random_part(al15, saved)
    assert random_part(al15, in_g).launch.origin == "stability test"
    with pytest.raises(DocumentError, match="is in V in place of g"):
        random_part(al15, accelcal.analyse(record, window=10.0))


def test_what_a_stability_test_warns_of_is_in_the_budget(al15):
    """The budget took the launches of a test that warns, and of another unit, without a word."""
    warm = Gate("temperature", "warn", "the launches begin at 16.0 to 25.0 degC")
    fine = Gate("independent launches", "pass", "p = 0.4")
    few = Gate("independent launches", "not assessed", "needs five launches")
    test = replace(stability_test(COMPONENTS), gates=(warm, warm, fine), serial="B-2")
    said = budget(al15, 1.0, random=random_part(al15, test)).warnings
    assert (
        sum("checks of the stability test warn, temperature: clear" in text for text in said) == 1
    )
    assert f"the stability test is of serial B-2, the calibration of {al15.serial}" in said
    test = replace(test, gates=(fine, few), serial=al15.serial)
    assert not any(
        "stability" in s for s in budget(al15, 1.0, random=random_part(al15, test)).warnings
    )


def measured_launches(sigma, launches):
    """A stability test of so many launches, whose means scatter by sigma."""
    components = {"sigma_L": sigma, "k0L": 3.0 * sigma}
    dof = launches - 1
    found = {name: {"value": value, "dof": dof} for name, value in components.items()}
    return stability_test(found)


def test_few_launches_have_the_factor_of_their_degrees_of_freedom(exact):
    """GUM G.4: a scatter of 6 launches that is all of the uncertainty has Student's factor of 5."""
    found = budget(exact, 0.0, random=random_part(exact, measured_launches(1e-3, 6)))
    assert found.standard_uncertainty[0] == pytest.approx(1e-3, rel=1e-6)
    assert found.coverage_factor[0] == pytest.approx(stats.t.ppf(0.975, 5), rel=1e-3)


@pytest.mark.parametrize("launches", [3, 6])
def test_the_interval_of_a_new_launch_covers(exact, launches):
    generator = np.random.default_rng(launches)
    scatter = generator.normal(0.0, 2e-4, (4000, launches)).std(axis=1, ddof=1)
    randoms = [random_part(exact, measured_launches(size, launches)) for size in scatter[:5]]
    wide = [budget(exact, 0.0, random=random).expanded_uncertainty[0] for random in randoms]
    factor = wide[0] / scatter[0]
    assert wide == pytest.approx(factor * scatter[:5])
    new_launch = generator.normal(0.0, 2e-4, 4000)
    held = np.count_nonzero(np.abs(new_launch) <= factor * scatter)
    assert stats.binomtest(held, 4000, 0.95).pvalue > 1e-3


def test_runs_at_one_level_tell_the_launch_with_their_degrees_of_freedom():
    plan = TumblePlan(temperatures=(20.0, 80.0, -40.0, 20.0, 20.0))
    noise = NoiseComponents(reading=5e-6, head=0.0, launch=1e-4, launch_sf=0.0)
    calibration = accelcal.fit(accelcal.simulate(plan=plan, noise=noise, seed=2, declare=False))
    assert random_part(calibration).launch.dof == 2.0  # three runs at 20 degC
    assert budget(calibration, 0.0).coverage_factor[0] == pytest.approx(4.303, rel=0.02)


def with_drift(**drift):
    return stability_test(COMPONENTS | {"gamma_D": drift})


def test_a_drift_that_the_stability_test_does_not_identify_counts_by_its_limit(al15):
    random = random_part(al15, with_drift(value=None, lower=-1e-9, upper=2e-9))
    found = budget(al15, 0.0, time=3600.0, random=random)
    (drift,) = (part for part in found.components if part.symbol == "k0D")
    assert random.drift.bound == pytest.approx(2e-9)
    assert drift.standard_uncertainty[0] == pytest.approx(2e-9 * 3600.0 / math.sqrt(3.0))
    told = " ".join(found.warnings)
    assert "does not tell the drift (k0D) from none: it counts by the limit" in told
    assert "drift (k0D)," not in told  # something tells it


def test_a_drift_of_one_launch_may_be_as_large_as_its_interval(al15):
    random = random_part(al15, with_drift(value=-1e-9, lower=-3e-9, upper=1e-10, dof=None))
    assert random.drift.bound == 1e-9  # what (4) takes
    assert random.drift.standard_uncertainty == pytest.approx(3e-9, rel=1e-6)
    told = " ".join(budget(al15, 0.0, random=random).warnings)
    assert "taken as alike in all: three launches or more" in told


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0, 3.0, 10.0])
def test_a_drift_of_known_sign_beside_other_errors_is_held(al15, ratio):
    """Taken as rectangular, the interval held the truth in 82 to 84 % at two and three times."""
    drift = random_part(al15, stability_test(COMPONENTS)).drift
    other = drift.bound / ratio
    wide = 1.96 * math.hypot(drift.standard_uncertainty, other)
    held = stats.norm.cdf((wide - drift.bound) / other) - stats.norm.cdf(
        (-wide - drift.bound) / other
    )
    assert held > 0.949


@pytest.mark.parametrize("mean", [0.0, 3.0])
@pytest.mark.parametrize("launches", [3, 5, 10])
def test_the_interval_of_the_drift_of_a_new_launch_covers(al15, launches, mean):
    """Mean slope with the interval of Student's quantile, or the root mean square of slopes."""
    generator, held = np.random.default_rng(launches), 0
    t = stats.t.ppf(0.975, launches - 1)
    for _ in range(400):
        slopes = 1e-9 * generator.normal(mean, 1.0, launches)
        middle, half = slopes.mean(), t * slopes.std(ddof=1) / launches**0.5
        told = {"value": middle, "lower": middle - half, "upper": middle + half}
        if mean == 0.0:
            rms = float((slopes**2).mean() ** 0.5)
            told = {"value": rms, "lower": 0.1 * rms, "upper": 9.0 * rms, "finding": DRIFTS_DIFFER}
        dof = launches - (mean != 0.0)
        drift = random_part(al15, with_drift(dof=dof, **told)).drift
        factor = stats.t.ppf(0.975, drift.dof)
        new_launch = 1e-9 * generator.normal(mean, 1.0)
        held += abs(new_launch) <= factor * drift.standard_uncertainty
    assert stats.binomtest(held, 400, 0.95, alternative="less").pvalue > 1e-3


@pytest.mark.parametrize("dof", [0.0, -1.0, math.nan])
def test_impossible_degrees_of_freedom_are_refused(dof):
    with pytest.raises(InputError, match="degrees of freedom of a bound"):
        RandomBound(1e-5, dof=dof)


@pytest.mark.parametrize("bound", [-1.0, math.nan, math.inf])
def test_impossible_bounds_are_refused(al15, bound):
    with pytest.raises(InputError, match=r"launch is .*; it is (0 or more|a finite number)"):
        random_part(al15, launch=bound)
    with pytest.raises(InputError, match=r"bound of a random error is .*; it is"):
        RandomBound(bound)


def test_missing_random_errors_are_told(al15):
    told = " ".join(budget(al15, 1.0).warnings)
    for name in ("k0D", "k0F", "h_T", "(p)"):
        assert name in told
    assert "k0L" not in told
    assert budget(al15, 1.0, random=random_part(al15, **PAPER_RANDOM)).warnings == ()


# -- two cross axes --------------------------------------------------------------------------------


@pytest.mark.parametrize("temperature", [20.0, 70.0])
def test_both_cross_axes_count_as_in_apply(temperature):
    """One head turns both mountings, so that the errors of delta_O and delta_P are much alike."""
    plan = TumblePlan(temperatures=(20.0, 80.0, -40.0), mountings=("o+", "p+"))
    calibration = accelcal.fit(accelcal.simulate(plan=plan, seed=1))
    across = {"a_p": 0.5, "a_o": 0.6, "temperature": temperature}
    found = budget(calibration, 0.2, **across, random=RandomPart(), exact=True)
    K1 = accelcal.coefficients_at(calibration, temperature)["K1"].value
    output = K1 * (0.2 + found.systematic[0])
    measured = accelcal.apply(calibration, output, **across, same_launch=True)
    u, U = measured.standard_uncertainty, measured.expanded_uncertainty
    assert found.standard_uncertainty[0] == pytest.approx(float(u), rel=0.005)
    assert found.coverage_factor[0] == pytest.approx(float(U / u), rel=0.005)
    one_axis = budget(calibration, 0.2, **{**across, "a_o": 0.0}, random=RandomPart())
    assert found.correlated - one_axis.correlated == {"delta_P", "delta_io", "gam_P"} - (
        {"gam_P"} if temperature == 20.0 else set()
    )


def test_both_misalignments_hold_the_truth():
    """Added in squares, U held it in 89 of 100 tests (300 tests)."""
    plan = TumblePlan(temperatures=(20.0,), mountings=("o+", "p+"), strokes=2)
    noise = accelcal.NoiseComponents(reading=2e-6, head=1e-5, launch=0.0, launch_sf=0.0)
    unit, within, deltas = accelcal.AL15, [], []
    for seed in range(60):
        calibration = accelcal.fit(accelcal.simulate(unit, plan=plan, seed=seed, noise=noise))
        found = budget(calibration, 0.0, a_p=0.7, a_o=0.7, random=RandomPart())
        truth = unit.bias.at_T0 + 0.7 * 2.0 * unit.misalignment.at_T0
        within.append(abs(found.systematic[0] - truth) < found.expanded_uncertainty[0])
        deltas.append([table.error_model["delta"].value for table in calibration.tables])
    assert np.mean(within) > 0.93
    assert np.corrcoef(deltas, rowvar=False)[0, 1] == pytest.approx(0.97, abs=0.02)


@pytest.mark.filterwarnings("ignore:checks of the calibration warn")  # as 0.2 g is much
@pytest.mark.parametrize(("bias", "apart"), [(0.003, 0.002), (0.2, 0.1)])
def test_products_of_coefficients_part_budget_and_apply_in_proportion_to_the_bias(bias, apart):
    unit = accelcal.Accelerometer(bias=accelcal.BilinearLaw(bias, 0.0, 0.0))
    calibration = accelcal.fit(accelcal.simulate(unit, seed=1))
    a_i = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    found = budget(calibration, a_i, temperature=20.0)
    output = calibration.tables[0].coefficients["K1"].value * (a_i + found.systematic)
    applied = accelcal.apply(calibration, output, temperature=20.0)
    off = np.abs(applied.standard_uncertainty / found.standard_uncertainty - 1.0).max()
    assert 0.5 * apart < off < apart


# -- where (4) does not hold -----------------------------------------------------------------------


@pytest.mark.parametrize("temperature", [82.0, -42.0, 200.0])
def test_outside_the_calibrated_temperatures(al15, temperature):
    with pytest.raises(InputError, match="outside the calibrated -40 to 80 degC"):
        budget(al15, 1.0, temperature=[20.0, temperature])
    found = budget(al15, 1.0, temperature=[20.0, temperature], extrapolate=True)
    assert found.extrapolated.tolist() == [False, True]
    assert f"{temperature:g}*" in str(found)
    assert any("extrapolated" in warning for warning in found.warnings)


def test_a_side_of_t0_without_slopes_is_refused():
    record = accelcal.simulate(plan=TumblePlan(temperatures=(20.0, 80.0)), seed=1)
    calibration = accelcal.fit(record)
    assert budget(calibration, 1.0, temperature=50.0).extrapolated.tolist() == [False]
    with pytest.raises(InputError, match="no slopes below T0"):
        budget(calibration, 1.0, temperature=0.0, extrapolate=True)


def test_one_temperature_answers_only_there():
    record = accelcal.simulate(plan=TumblePlan(temperatures=(55.0,)), seed=1)
    calibration = accelcal.fit(record)
    assert calibration.temperature_model is None
    assert budget(calibration, 1.0).temperature_degC.tolist() == [55.0]
    assert budget(calibration, 1.0, temperature=55.5).extrapolated.tolist() == [False]
    with pytest.raises(InputError, match="no slopes below T0 = 55 degC"):
        budget(calibration, 1.0, temperature=20.0)


def test_unknown_temperature(al15):
    tables = (replace(al15.tables[0], temperature_degC=None),)
    blind = replace(al15, tables=tables, temperature_model=None, T0_degC=None)
    found = budget(blind, 1.0)
    assert math.isnan(found.temperature_degC[0])
    assert json.loads(json.dumps(found.to_document()))["points"][0]["temperature_degC"] is None
    with pytest.raises(InputError, match="temperature of the calibration is unknown"):
        budget(blind, 1.0, temperature=20.0)


def test_an_axis_that_was_not_tested_is_refused(al15):
    with pytest.raises(InputError, match="no table in mounting p tells delta_P"):
        budget(al15, 1.0, a_o=0.5)


def test_both_axes_where_both_were_tested():
    plan = TumblePlan(temperatures=(20.0,), mountings=("o+", "p+"))
    calibration = accelcal.fit(accelcal.simulate(plan=plan, noise=QUIET, seed=0))
    found = budget(calibration, 0.0, a_p=0.2, a_o=0.5)
    assert found.systematic[0] == pytest.approx(3.324e-3 + 1.15e-3 * 0.7, abs=2e-8)


def test_beyond_1_g_is_said(al15):
    assert any("10 g" in warning for warning in budget(al15, 10.0).warnings)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"a_i": math.nan}, "a_i has a value that is not finite"),
        ({"a_i": 1.0, "time": -1.0}, "time -1 s"),
        ({"a_i": 1.0, "temperature": math.inf}, "temperature has a value that is not finite"),
        ({"a_i": 1.0, "temperature_uncertainty": -0.1}, "temperature_uncertainty is -0.1"),
    ],
)
def test_impossible_arguments(al15, arguments, told):
    with pytest.raises(InputError, match=told):
        budget(al15, **arguments)


def test_unknown_uncertainties_are_said(al15):
    law = replace(al15.temperature_model.k0, at_T0=Quantity(3e-3, None, "g"))
    model = TemperatureModel(law, al15.temperature_model.K1, al15.temperature_model.delta)
    found = budget(replace(al15, temperature_model=model), 1.0)
    assert any("uncertainty of k0 is unknown" in warning for warning in found.warnings)


def test_a_calibration_without_any_uncertainty_is_refused():
    """The uncertainty of its budget was told as 0."""
    angles = [0, 45, 90, 135, 225, 270]
    rows = [f"20,{a},1,{1.35 * math.cos(math.radians(a)) + 1e-3:.7f}" for a in angles]
    table = "\n".join(["# unit: mA", "temperature,angle,stroke,output", *rows])
    found = accelcal.fit(accelcal.read_table(io.StringIO(table)))
    with pytest.raises(InputError, match="the uncertainty of no coefficient"):
        budget(found, 1.0)


def test_coefficients_that_were_not_determined_are_said():
    record = accelcal.read_table(EXAMPLE.with_name("mems_x_plane_y.csv"))
    found = budget(accelcal.fit(record, coefficients=("K0", "K1", "K2", "M")), 1.0)
    assert any("K3, M_ip were not determined and taken" in said for said in found.warnings)
    assert {"k0", "k2"} < {part.symbol for part in found.components}


def test_what_the_scale_factor_stands_for_is_said():
    plan = accelcal.TumblePlan(positions=4, temperatures=(20.0,))
    found = budget(accelcal.fit(accelcal.simulate(plan=plan, seed=1)), 1.0)
    assert any("K1 stands for K1 + K3" in said for said in found.warnings)


@pytest.mark.parametrize(
    ("levels", "said"),
    [
        ((20.0,), []),
        ((20.0, 20.0), ["the mean of runs 1 and 2"]),
        ((20.0, 80.0), []),
    ],
)
def test_of_several_runs_without_laws_what_is_taken_is_said(levels, said):
    plan = accelcal.TumblePlan(temperatures=levels)
    found = budget(accelcal.fit(accelcal.simulate(plan=plan, seed=1)), 1.0)
    beginning = "no temperature law, so the coefficients of mounting o+ are "
    assert [s.removeprefix(beginning) for s in found.warnings if s.startswith(beginning)] == said


@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
@pytest.mark.parametrize(
    ("mountings", "sign"), [(("o+",), 1), (("o+", "o-"), 1), (("o+", "p+"), 1), (("o+",), -1)]
)
def test_the_mean_of_runs_has_the_uncertainty_that_apply_has(mountings, sign):
    """With a negative K1 it was 1.8 times as large at 1 g, by a sign of its correlations."""
    plan = accelcal.TumblePlan(temperatures=(20.0, 20.0, 20.0), mountings=mountings)
    record = accelcal.simulate(plan=plan, seed=3)
    calibration = accelcal.fit(replace(record, output=sign * record.output))
    angles = np.radians([0.0, 60.0, 90.0, 150.0])
    a_i, a_p = np.cos(angles), np.sin(angles)
    mean = {name: q.value for name, q in accelcal.coefficients_at(calibration, 20.0).items()}
    bracket = mean["k0"] + a_i + mean["k2"] * a_i**2 + mean["k3"] * a_i**3 + mean["delta"] * a_p
    output = mean["K1"] * (bracket + mean["delta_ip"] * a_i * a_p)
    applied = accelcal.apply(calibration, output, a_p=a_p)
    found = budget(calibration, a_i, a_p=a_p)
    assert found.expanded_uncertainty == pytest.approx(applied.expanded_uncertainty, rel=5e-3)


@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
def test_the_runs_of_the_other_axis_count_by_their_mean_as_in_apply():
    plan = accelcal.TumblePlan(temperatures=(20.0, 20.0, 20.0), mountings=("o+", "p+"))
    calibration = accelcal.fit(accelcal.simulate(plan=plan, seed=3))
    found = budget(calibration, 0.0, a_o=1.0)
    (across,) = (part for part in found.components if part.symbol == "delta_P")
    deltas = [table.error_model["delta"].value for table in calibration.tables[3:]]
    assert across.value == pytest.approx(np.mean(deltas), rel=1e-4)
    applied = accelcal.apply(calibration, 1.35 * (3.324e-3 + 1.15e-3), a_o=1.0)
    expected = pytest.approx(applied.expanded_uncertainty, rel=5e-3)
    assert found.expanded_uncertainty[0] == expected
    assert any("mounting p+ are the mean of runs 4, 5 and 6" in said for said in found.warnings)
    assert "Mean of runs 4, 5 and 6 (p+)" in str(calibration)


# -- the command -----------------------------------------------------------------------------------


def run(saved, *arguments):
    return main(["budget", str(saved), *map(str, arguments)])


def test_the_bound_of_4_is_not_called_the_worst_case(saved, capsys):
    run(saved)
    shown = " ".join(capsys.readouterr().out.split())
    assert "worst" not in shown
    assert "before accelcal apply corrects the systematic part" in shown
    assert "with half of the bias bound (3)" in shown
    assert "may be smaller than the 95 % interval" in shown


def test_a_misprinted_calibration_is_refused(tmp_path, capsys):
    with pytest.warns(accelcal.errors.AccelcalWarning, match="misprinted"):
        fit = accelcal.fit(accelcal.simulate(seed=1), method="printed")
    fit.to_json(tmp_path / "cal.json")
    record = tmp_path / "record.csv"
    record.write_text("time,output\n" + "".join(f"{t},1.{t}\n" for t in range(60)), "utf-8")
    for command in (
        ["budget", str(tmp_path / "cal.json")],
        ["stability", str(record), "--calibration", str(tmp_path / "cal.json")],
    ):
        assert main(command) == 2
        assert "method 'printed', which is misprinted" in capsys.readouterr().err


def test_text_has_both_sums(saved, capsys):
    assert run(saved, "--temperature", "80", "--hysteresis", "3e-4", "--launch", "2e-5") == 0
    shown = capsys.readouterr().out
    assert "bound of (4), with the paper's factor 0.5: 32388.1 +- 325.0 ug" in shown
    assert "GUM, variances added, 95 %, k = 1.96: 32390 +- 200 ug" in shown
    assert max(map(len, shown.splitlines()[1:])) <= 100  # the first names the file
    assert shown.isascii()


def test_a_bound_of_nothing_is_not_written_as_zero(exact, tmp_path, capsys):
    """It was "+- 0.0 ug", as if the unit had no random error."""
    exact.to_json(tmp_path / "exact.json")
    assert run(tmp_path / "exact.json", "--acceleration", "0,1") == 0
    shown = capsys.readouterr().out
    assert "+- 0.0" not in shown
    assert "  bound of (4): none, as no random error is given that acts here\n" in shown
    pytest.importorskip("matplotlib")
    _, bounds, _ = budget(exact, [0.0, 1.0]).plot.stack()
    assert [text.get_text() for text in bounds.texts] == [
        "none, as no random error is given that acts here"
    ]


def test_lists_are_combined_to_a_table(saved, capsys):
    lists = "--acceleration", "-1,0,1", "--temperature", "-40,80", "--time", "0,10min,12h"
    assert run(saved, *lists, "--format", "json") == 0
    points = json.loads(capsys.readouterr().out)["points"]
    found = {(p["acceleration"]["a_i"], p["temperature_degC"], p["time_s"]) for p in points}
    assert found == {(a, t, s) for a in (-1, 0, 1) for t in (-40, 80) for s in (0, 600, 43200)}


def test_drift_rate_is_per_hour(saved, capsys):
    drift = "--drift-rate", "1e-5", "--time", "2h", "--launch", "0"
    assert run(saved, *drift, "--format", "json") == 0
    (point,) = json.loads(capsys.readouterr().out)["points"]
    (part,) = [part for part in point["components"] if part["symbol"] == "k0D"]
    assert part["bound"] == pytest.approx(0.5 * 2e-5)


def test_csv_has_a_line_for_each_component(saved, capsys):
    assert run(saved, "--format", "csv") == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    total = rows.pop()
    assert total["component"] == "total"
    assert sum(float(row["value_g"]) for row in rows) == pytest.approx(float(total["value_g"]))
    assert sum(float(row["bound_g"]) for row in rows) == pytest.approx(float(total["bound_g"]))


def test_output_file_is_the_json(saved, tmp_path, capsys):
    path = tmp_path / "budget.json"
    assert run(saved, "-o", path, "--format", "json") == 0
    assert path.read_text("utf-8") == capsys.readouterr().out
    assert json.loads(path.read_text("utf-8"))["schema"] == "accelcal/budget/1"


@pytest.mark.parametrize("options", [{}, {"temperature": 80.0}, {"temperature": [-50.0, 20.0]}])
def test_a_budget_comes_back_from_json(al15, options):
    found = accelcal.budget(al15, [0.0, 1.0], **options, time=600.0, extrapolate=True)
    again = accelcal.ErrorBudget.from_json(found.to_json())
    assert again == found
    assert np.isfinite([part.dof for part in again.components]).any()
    assert str(again) == str(found)


def test_a_budget_whose_temperature_is_unknown_comes_back(al15):
    blind = replace(al15.tables[0], temperature_degC=None)
    one = replace(al15, tables=(blind,), temperature_model=None, T0_degC=None)
    found = accelcal.budget(one, 1.0)
    assert np.isnan(found.temperature_degC).all()
    assert accelcal.ErrorBudget.from_json(found.to_json()) == found


def test_a_damaged_budget_is_refused(al15):
    document = accelcal.budget(al15, [0.0, 1.0]).to_document()
    del document["points"][1]["components"][0]
    with pytest.raises(DocumentError, match="key points: points that do not have the same comp"):
        accelcal.ErrorBudget.from_document(document)


def test_stability_file(saved, tmp_path, capsys):
    path = tmp_path / "stability.json"
    stability_test(COMPONENTS).to_json(path)
    assert run(saved, "--stability", path) == 0
    assert "stability test" in capsys.readouterr().out
    path.write_text("[]", "utf-8")
    assert run(saved, "--stability", path) == 2
    replace(stability_test(COMPONENTS), unit="mA").to_json(path)
    assert run(saved, "--stability", path) == 2
    told = capsys.readouterr().err.splitlines()[-1]
    assert f"{path}: the stability test is in mA in place of g; analyse it with the scale" in told
    assert "--scale-factor" in told


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--temperature", "95"], "outside the calibrated -40 to 80 degC"),
        (["--a-o", "1"], "no table in mounting p"),
        (["--time", "3w"], "3w"),
        (["--time", "h"], "h"),
        (["--launch", "-1"], "launch is -1.0; it is 0 or more"),
        (["--launch", "20"], "bound of a random error is 20; it is at most 1 g, or all of the"),
        (["--drift-rate", "20"], "drift rate is 20 g/h; it is at most 1 g/h: write 20 ug/h as"),
        (["--factor", "0"], "above zero"),
        (["--plot", "budget.gif"], "budget.gif: the name ends in none of .png, .svg, .pdf"),
        (["--serial", "other"], "serial other is asked for"),
    ],
)
def test_faults_are_told_in_a_line(saved, capsys, arguments, told):
    assert run(saved, *arguments) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert told in shown.err.splitlines()[-1]


def test_one_run_of_unlike_ones_is_chosen(saved, capsys):
    """Runs without laws were refused with the remedy to choose one, which no option did."""
    found = accelcal.fit(accelcal.simulate(seed=1), coefficients=("K0", "K1"))
    found.to_json(saved)
    assert run(saved) == 2
    assert "choose one run" in capsys.readouterr().err
    assert run(saved, "--run", "2", "--format", "json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["points"][0]["temperature_degC"] == found.tables[1].temperature_degC
    assert run(saved, "--run", "4") == 2
    assert "no run '4' in the calibration; it has 1, 2, 3" in capsys.readouterr().err


def test_extrapolation_on_request(saved, capsys):
    assert run(saved, "--temperature", "95") == 2
    assert "stay within, or accept it by --extrapolate" in capsys.readouterr().err
    assert run(saved, "--temperature", "95", "--extrapolate") == 0
    assert "(*extrapolated)" in capsys.readouterr().out


def test_table_in_a_notebook(al15):
    frame = budget(al15, [0.0, 1.0]).to_frame()
    totals = frame[frame["component"] == "total"]
    assert totals["a_i"].tolist() == [0.0, 1.0]
    assert totals["expanded_uncertainty_g"].notna().all()


@pytest.mark.parametrize("temperature", [20.0, 80.0])
def test_shares_of_the_table_add_up(al15, temperature):
    """No share is negative: coefficients that cancel have one share together."""
    found = budget(al15, 1.0, temperature=temperature, random=random_part(al15, **PAPER_RANDOM))
    text = str(found)
    assert "these together, with their correlations" in text
    shares = [
        float(line.split(" %")[0].split()[-1]) for line in text.splitlines() if " %  " in line
    ]
    assert min(shares) >= 0.0
    assert sum(shares) == pytest.approx(100.0, abs=0.5)


# -- the picture -----------------------------------------------------------------------------------


def test_each_part_of_the_picture_has_its_unit(al15):
    """The systematic part was 25000 ug high beside bounds of 25 ug."""
    pytest.importorskip("matplotlib")
    found = budget(al15, [0.0, 1.0], temperature=60.0)
    systematic, _, shares = found.plot.stack()
    assert [ax.get_ylabel() for ax in (systematic, shares)] == ["error [mg]", "error [µg]"]
    for ax, factor, total in (
        (systematic, 1e3, found.systematic),
        (shares, 1e6, found.expanded_uncertainty),
    ):
        (diamonds,) = (line for line in ax.lines if line.get_label() == "total")
        np.testing.assert_allclose(diamonds.get_ydata(), factor * total)
        tops = sum(np.array([bar.get_height() for bar in bars]) for bars in ax.containers)
        np.testing.assert_allclose(tops, factor * total)


@pytest.mark.parametrize(("form", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_picture(saved, tmp_path, capsys, form, start):
    pytest.importorskip("matplotlib")
    path = tmp_path / f"budget.{form}"
    assert run(saved, "--acceleration", "-1,0,1", "--plot", path) == 0
    assert path.read_bytes().startswith(start)
    assert capsys.readouterr().err == ""


def test_picture_of_many_points(al15):
    pytest.importorskip("matplotlib")
    axes = budget(al15, np.linspace(-1, 1, 41)).plot.stack()
    assert picture(axes, "svg").startswith(b"<?xml")


def test_without_matplotlib_the_error_says_how_to_install_it(saved, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert run(saved, "--plot", tmp_path / "budget.png") == 2
    assert 'pip install "accelcal[plot]"' in capsys.readouterr().err
    assert not (tmp_path / "budget.png").exists()


def test_the_path_of_a_stability_test_is_none(al15):
    with pytest.raises(InputError, match=r"^str in place of a stability test; make one by accelc"):
        random_part(al15, "stability.json")


def test_a_run_of_unknown_temperature_stands_not_for_the_reference():
    plan = TumblePlan(temperatures=(80.0, 20.0, -40.0))
    record = accelcal.simulate(plan=plan, noise=QUIET, seed=0)
    unknown = np.where(record.run == 0, np.nan, record.temperature)
    found = accelcal.fit(replace(record, temperature=unknown, reference_temperature=20.0))
    with pytest.raises(InputError, match="have no mean; choose one run"):
        budget(found, 0.0)


def test_what_correlation_leaves_has_a_degree_of_freedom_or_more():
    """Two runs of nearly one level: far slopes, which cancel there; it was a factor of 6e7."""
    record = accelcal.simulate(
        plan=accelcal.TumblePlan(temperatures=(80.0, 80.0, -40.0), strokes=3),
        noise=accelcal.NoiseComponents(reading=4e-5, head=1e-5, launch=0.0, launch_sf=0.0),
        seed=2,
    )
    rng = np.random.default_rng(2)
    temperature = record.temperature + rng.normal(0.0, 0.1, len(record))
    record = replace(record, temperature=temperature, reference_temperature=20.0)
    kept = np.isin(np.arange(len(record)), rng.permutation(len(record))[:48])
    found = budget(accelcal.fit(record.select(kept)), [-1.0, 0.0, 1.0], temperature=50.0)
    assert found.coverage_factor.max() < 12.8
    at_level = budget(accelcal.fit(record.select(kept)), [-1.0, 0.0, 1.0], temperature=80.0)
    assert at_level.coverage_factor.max() < 12.8


@pytest.mark.parametrize(
    ("names", "rule"),
    [
        (("K0", "K1"), "the laws need K0, K1 and M at levels"),
        (("K1", "M"), "no bias k0; fit a record that determines K0"),
    ],
)
def test_runs_at_levels_without_laws_say_what_lacks(names, rule):
    """They were to be calibrated at several levels, at which they are."""
    calibration = accelcal.fit(accelcal.simulate(seed=1), coefficients=names)
    with pytest.raises(InputError, match=rule):
        budget(calibration, 0.0)


@pytest.mark.parametrize("factor", [0.1, -0.1, 1000.0])
def test_the_unit_of_the_output_and_its_sign_do_not_count(factor):
    record = accelcal.simulate(seed=1)
    other = replace(record, output=factor * record.output)
    plain, found = (
        budget(accelcal.fit(each), [0.5, 1.0], a_p=0.5, temperature=80.0)
        for each in (record, other)
    )
    np.testing.assert_allclose(found.systematic, plain.systematic, rtol=1e-6)
    np.testing.assert_allclose(found.expanded_uncertainty, plain.expanded_uncertainty, rtol=1e-4)
