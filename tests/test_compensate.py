"""From outputs back to accelerations: the inverse, its uncertainty, its ranges and refusals."""

import dataclasses

import mpmath
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import accelcal
from accelcal.compensate.apply import compensate
from accelcal.compensate.choice import compensation
from accelcal.compensate.coefficients import Compensation, CrossAxis, Launch, Law, OtherAxis, Slope
from accelcal.compensate.inversion import FARTHEST, invert, rising_branch
from accelcal.error_budget.budget import budget
from accelcal.errors import AccelcalWarning, InputError
from accelcal.export.content import export_content
from accelcal.results.covariance import rows_of
from accelcal.units import conversion_factor

NOTHING = tuple((0.0,) * 12 for _ in range(12))


def forward(found, a_i, temperature, a_p=0.0, a_o=0.0):
    """Output of the product model, written out term by term as an oracle."""
    dT = temperature - found.T0_degC
    slope = {
        name: law.above.value if dT > 0 else law.below.value
        for name, law in (("k0", found.k0), ("K1", found.K1), ("delta", found.cross.delta))
    }
    k0 = found.k0.at_T0 + slope["k0"] * dT
    K1 = found.K1.at_T0 * (1 + slope["K1"] * dT)
    delta = found.cross.delta.at_T0 + slope["delta"] * dT
    across = {"a_p": a_p, "a_o": a_o}[found.cross.name]
    total = k0 + a_i + found.k2 * a_i**2 + found.k3 * a_i**3
    total += delta * across + found.cross.delta_ip * a_i * across
    if found.other is not None:
        across = {"a_p": a_p, "a_o": a_o}[found.other.name]
        total += found.other.delta.at_T0 * across + found.other.delta_ip * a_i * across
    return K1 * total


def slopes(size):
    return st.builds(Slope, st.floats(-size, size), st.just(0.0), st.just(True))


def laws(at_T0, size):
    return st.builds(Law, at_T0, slopes(size), slopes(size))


compensations = st.builds(
    Compensation,
    k0=laws(st.floats(-0.05, 0.05), 1e-4),
    K1=laws(st.floats(0.5, 3e5) | st.floats(-3.0, -0.5), 1e-3),
    k2=st.floats(-1e-3, 1e-3),
    k3=st.floats(-1e-4, 1e-4),
    cross=st.builds(
        CrossAxis, st.sampled_from(["a_p", "a_o"]), laws(st.floats(-0.01, 0.01), 1e-5),
        st.floats(-1e-3, 1e-3),
    ),
    errors=st.just((NOTHING, NOTHING)),
    T0_degC=st.floats(-10.0, 40.0),
    temperatures=st.just((-60.0, 100.0)),
)  # fmt: skip

TYPICAL = Compensation(
    k0=Law(0.0033, Slope(-4e-5), Slope(-4.5e-5)),
    K1=Law(1.35, Slope(5.2e-4), Slope(4.8e-4)),
    k2=1e-4,
    k3=8e-5,
    cross=CrossAxis("a_p", Law(1.15e-3, Slope(1.5e-6), Slope(1.2e-6)), 2e-5),
    errors=(NOTHING, NOTHING),
    T0_degC=20.0,
    temperatures=(-40.0, 80.0),
)


@pytest.fixture(scope="module")
def calibration():
    return accelcal.fit(accelcal.simulate(seed=1))


@pytest.fixture(scope="module")
def one_level():
    return accelcal.fit(accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0,)), seed=1))


# -- the inverse -----------------------------------------------------------------------------------


@given(
    compensations,
    st.lists(st.floats(-20.0, 20.0), min_size=1, max_size=5),
    st.floats(-60.0, 100.0),
    st.floats(-20.0, 20.0),
)
def test_inverse_of_forward(found, a_i, temperature, across):
    output = [forward(found, a, temperature, across, across) for a in a_i]
    measured = compensate(found, output, temperature, **{found.cross.name: across})
    assert measured.value == pytest.approx(a_i, rel=0, abs=1e-12)


def test_inverse_of_forward_with_both_cross_axes():
    found = dataclasses.replace(
        TYPICAL, other=OtherAxis("a_o", Law(-7e-4), 3e-5, (((0.0,) * 4,) * 4,) * 2)
    )
    a_i = np.linspace(-20.0, 20.0, 41)
    output = [forward(found, a, 35.0, 2.0, -3.0) for a in a_i]
    measured = compensate(found, output, 35.0, 2.0, -3.0)
    assert measured.value == pytest.approx(a_i, rel=0, abs=1e-12)


@settings(deadline=None)
@given(st.floats(-50.0, 50.0), st.floats(0.5, 1.5), st.floats(-0.3, 0.3), st.floats(-0.05, 0.05))
def test_strong_nonlinearity_against_all_roots(target, linear, second, third):
    """The only root of high precision that lies on the rising branch, or none."""
    low, high = rising_branch(linear, second, third)
    with mpmath.workdps(40):
        powers = [mpmath.mpf(x) for x in (third, second, linear, -target)]
        while abs(powers[0]) < 1e-12:  # too far away to matter
            powers.pop(0)
        roots = mpmath.polyroots(powers, maxsteps=500, extraprec=500)
        real = [float(z.real) for z in roots if abs(z.imag) < 1e-15 * (1 + abs(z))]
    edge = 1e-6 * (1.0 + abs(high) + abs(low))  # where two roots meet they are poorly determined
    if any(abs(root - end) < edge for root in real for end in (low, high)):
        return
    on_branch = [root for root in real if low < root < high]
    found = invert([target], linear, second, third)
    assert found == pytest.approx(on_branch or [np.nan], rel=1e-9, abs=1e-12, nan_ok=True)


@given(st.lists(st.floats(-1e5, 1e5), min_size=1, max_size=20), st.floats(-1e-3, 1e-3))
def test_a_sample_does_not_depend_on_the_others(targets, third):
    together = invert(targets, 1.0, 1e-4, third)
    alone = [float(invert([target], 1.0, 1e-4, third)[0]) for target in targets]
    np.testing.assert_array_equal(together, alone)


def test_what_no_acceleration_gives_has_no_solution():
    falling = invert([9.0, 11.0], 1.0, 0.0, -1 / 300)  # at most 20/3 at 10 g
    assert np.isnan(falling).all()
    assert np.isnan(invert([0.5], -1.0, 0.0, 0.0)).all()
    assert np.isnan(invert([2 * FARTHEST, np.nan, np.inf], 1.0, 0.0, 0.0)).all()


def test_the_branch_ends_where_the_output_stops_rising():
    low, high = rising_branch(1.0, 0.01, 0.0)
    assert (float(low), float(high)) == (-50.0, FARTHEST)


def test_without_nonlinearity_one_division_does():
    assert invert([0.5, -20.0], 1.0, 0.0, 0.0).tolist() == [0.5, -20.0]


# -- uncertainty -----------------------------------------------------------------------------------


def test_uncertainty_against_monte_carlo(one_level):
    """Coefficients of (1) drawn from their covariance, each draw inverted."""
    table = one_level.tables[0]
    outputs = np.array([1.35, 0.0, -1.0, 6.7])
    measured = accelcal.apply(one_level, outputs, 20.0, a_p=0.5, same_launch=True)
    mean = [table.coefficients[name].value for name in table.covariance_names]
    rng = np.random.default_rng(7)
    draws = rng.multivariate_normal(mean, table.covariance, size=4000)
    values = []
    for K0, K1, K2, K3, M, M_ip in draws:
        a_i = outputs / K1
        for _ in range(20):  # fixed-point iteration, an inverse of another kind
            a_i = (outputs - K0 - K2 * a_i**2 - K3 * a_i**3 - M * 0.5) / (K1 + M_ip * 0.5)
        values.append(a_i)
    assert measured.standard_uncertainty == pytest.approx(np.std(values, axis=0), rel=0.06)


@pytest.mark.filterwarnings("ignore:checks of the calibration warn")  # some do by chance
def test_uncertainty_is_that_of_many_tests():
    """At the levels and between them, in the launches of the calibration itself."""
    truth = compensation(accelcal.fit(accelcal.simulate(seed=0)))
    a_i, temperature = np.array([1.0, 0.3, -1.0, 1.0, -0.7, 0.5]), [20, 20, 80, -40, 50, -10]
    output = [forward(truth, a, T) for a, T in zip(a_i, temperature, strict=True)]
    fits = [accelcal.fit(accelcal.simulate(seed=seed)) for seed in range(1000, 1050)]
    results = [accelcal.apply(fit, output, temperature, same_launch=True) for fit in fits]
    scatter = np.std([result.value for result in results], axis=0, ddof=1)
    stated = np.mean([result.standard_uncertainty for result in results], axis=0)
    assert (scatter < 1.3 * stated).all()  # 50 tests tell a scatter to 10 %
    assert (stated < 1.5 * scatter).all()


@pytest.mark.parametrize("temperature_laws", ["tables", "readings"])
@pytest.mark.parametrize("temperature", [-40.0, -10.0, 20.0, 50.0, 80.0])
def test_uncertainty_agrees_with_the_budget(temperature, temperature_laws):
    """The budget has it of the reading over K1N: they differ by the change of K1, 3 % at most."""
    fit = accelcal.fit(accelcal.simulate(seed=4), temperature_laws=temperature_laws)
    found = compensation(fit)
    a_i = np.array([-1.0, 0.0, 0.4, 1.0])
    measured = accelcal.apply(fit, forward(found, a_i, temperature, 0.3), temperature, a_p=0.3)
    told = budget(fit, a_i, a_p=0.3, temperature=temperature).standard_uncertainty
    assert measured.standard_uncertainty == pytest.approx(told, rel=0.035)


def test_the_next_launch_is_added_in_squares():
    shifted = dataclasses.replace(TYPICAL, launch=Launch(1e-5, 2e-5))
    u = compensate(shifted, [0.0, 13.5], 20.0).standard_uncertainty
    assert u == pytest.approx([1e-5, np.hypot(1e-5, 2e-4)], rel=0.03)


def test_the_next_launch_is_that_of_the_calibration(calibration):
    sizes = {source.name: source.value for source in calibration.error_sources}
    launch = compensation(calibration).launch
    assert (launch.bias, launch.scale_factor) == (sizes["launch"], sizes["launch_sf"])
    assert compensation(calibration, same_launch=True).launch == Launch()
    wide, narrow = (
        float(accelcal.apply(calibration, 0.0, 20.0, same_launch=same).standard_uncertainty)
        for same in (False, True)
    )
    assert wide**2 - narrow**2 == pytest.approx(sizes["launch"] ** 2, rel=1e-3)


def test_noise_of_output_and_temperature_is_added_in_squares():
    quiet = compensate(TYPICAL, [1.35], 50.0)
    noisy = compensate(TYPICAL, [1.35], 50.0, output_uncertainty=1.35e-5)
    hot = compensate(TYPICAL, [1.35], 50.0, temperature_uncertainty=0.1)
    assert quiet.standard_uncertainty == pytest.approx([0.0])
    assert noisy.standard_uncertainty == pytest.approx([1e-5 / (1 + 5.2e-4 * 30)], rel=1e-3)
    shifted = compensate(TYPICAL, [1.35], 50.1).value - compensate(TYPICAL, [1.35], 50.0).value
    assert hot.standard_uncertainty == pytest.approx(np.abs(shifted), rel=1e-3)


def test_hysteresis_widens_the_bias(calibration):
    model = dataclasses.replace(
        calibration.temperature_model,
        hysteresis=accelcal.Quantity(1e-4, 1e-6, "g"),
    )
    wider = dataclasses.replace(calibration, temperature_model=model)
    u = accelcal.apply(wider, [0.0], 20.0).standard_uncertainty
    assert u == pytest.approx([1e-4], rel=0.02)


def test_the_expanded_uncertainty_has_the_factor_of_its_degrees_of_freedom():
    """1/dof is the mean of those of the parts, weighted by their shares of the variance."""
    of_bias, of_launch = 3e-6, 4e-6
    known = np.zeros((12, 12))
    known[0, 0] = of_bias**2
    told = {"errors": (rows_of(known), rows_of(known / 7.0))}
    found = dataclasses.replace(TYPICAL, **told)
    alone = compensate(found, [0.0, 1.35], 20.0)
    assert alone.expanded_uncertainty / alone.standard_uncertainty == pytest.approx(
        stats.t.ppf(0.975, 7.0), rel=1e-9
    )
    shifted = dataclasses.replace(found, launch=Launch(of_launch, 0.0, bias_dof=2.0))
    both = compensate(shifted, [0.0], 20.0)
    assert both.standard_uncertainty == pytest.approx([5e-6], rel=1e-3)
    dof = 1.0 / (0.36 / 7.0 + 0.64 / 2.0)
    factor = both.expanded_uncertainty / both.standard_uncertainty
    assert factor == pytest.approx(stats.t.ppf(0.975, dof), rel=1e-3)
    sure = compensate(dataclasses.replace(found, errors=(found.covariance, NOTHING)), [0.0], 20.0)
    assert sure.expanded_uncertainty == pytest.approx(1.959964 * sure.standard_uncertainty)


def test_an_error_that_two_coefficients_share_has_its_own_degrees_of_freedom():
    """At 1 g the errors of bias and scale factor by the head cancel, and noise of few is left."""
    of_head, of_noise = np.zeros((12, 12)), np.zeros((12, 12))
    of_head[:2, :2] = 1e-12 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    of_noise[0, 0] = 1e-14
    told = {"errors": (rows_of(of_head + of_noise), rows_of(of_noise / 3.0))}
    found = dataclasses.replace(TYPICAL, **told)
    a_i = np.array([0.0, 1.0 - 3.2e-3])  # bias and scale factor act alike at an output of 1 g
    measured = compensate(found, forward(found, a_i, 20.0, 0.0), 20.0)
    factor = measured.expanded_uncertainty / measured.standard_uncertainty
    share = of_noise[0, 0] / (of_noise + of_head)[0, 0]
    assert factor[0] == pytest.approx(stats.t.ppf(0.975, 3.0 / share), rel=1e-3)
    assert factor[1] == pytest.approx(stats.t.ppf(0.975, 3.0), rel=1e-2)


@pytest.mark.parametrize("strokes", [1, 2])
def test_the_interval_holds_at_each_angle_after_few_strokes(strokes):
    """One stroke leaves three degrees of freedom, which are all there is where the head cancels."""
    units, random, angle = 250, np.random.default_rng(7), np.radians(np.arange(0.0, 181.0, 45.0))
    order = np.arange(9)
    place = np.concatenate([order[:: (-1) ** k] for k in range(strokes)])
    known = {"unit": "mA", "head_uncertainty": 1e-5}
    held = np.zeros(angle.size)
    for _ in range(units):
        true = np.radians(45.0 * place) + random.normal(0.0, 1e-5, 8)[place % 8]
        output = forward(TYPICAL, np.cos(true), 20.0, np.sin(true))
        columns = {
            "temperature": np.full(place.size, 20.0),
            "position": place + 1,
            "stroke": np.repeat(np.arange(strokes) + 1, 9),
            "output": output + random.normal(0.0, 7e-6, place.size),
        }
        fit = accelcal.fit(accelcal.read_arrays(columns, overrides=known))
        shown = forward(TYPICAL, np.cos(angle), 20.0, np.sin(angle))
        found = compensate(compensation(fit, same_launch=True), shown, 20.0, np.sin(angle))
        held += np.abs(found.value - np.cos(angle)) <= found.expanded_uncertainty
    assert (np.abs(held / units - 0.95) < 4.0 * (0.95 * 0.05 / units) ** 0.5).all()


def test_the_second_axis_adds_linearly_with_its_degrees_of_freedom():
    one, other = np.zeros((12, 12)), np.zeros((4, 4))
    one[0, 0], other[0, 0] = 1e-12, 9e-12
    found = dataclasses.replace(
        TYPICAL,
        errors=(rows_of(one), NOTHING),
        other=OtherAxis("a_o", Law(0.0), 0.0, (rows_of(other), rows_of(other / 2.0))),
    )
    told = compensate(found, [0.0], 20.0, a_o=1.0)
    assert told.standard_uncertainty == pytest.approx([4e-6], rel=1e-3)
    factor = stats.t.ppf(0.975, 2.0 / 0.75)
    assert told.expanded_uncertainty == pytest.approx([factor * 4e-6], rel=2e-3)


def test_the_expanded_uncertainty_holds_a_new_launch_that_few_launches_tell():
    """Launches estimated from n: bias and its scatter by the textbook, each n its own coverage."""
    random, units, sigma = np.random.default_rng(5), 2000, 1e-5
    for n in (2, 3, 6):
        launches = random.normal(0.0, sigma, (units, n))
        held = 0
        for own, bias in zip(launches, random.normal(0.0, sigma, units), strict=True):
            s, known = own.std(ddof=1), np.zeros((12, 12))
            known[0, 0] = s**2 / n
            found = dataclasses.replace(
                TYPICAL,
                k0=Law(own.mean()),
                errors=(rows_of(known), rows_of(known / (n - 1.0))),
                launch=Launch(s, 0.0, bias_dof=n - 1.0),
            )
            told = compensate(found, [1.35 * bias], 20.0)
            held += abs(told.value[0]) <= told.expanded_uncertainty[0]
        assert abs(held / units - 0.95) < 4.0 * (0.95 * 0.05 / units) ** 0.5


@pytest.mark.parametrize(
    ("levels", "degrees", "count"),
    [((20.0, 80.0, -40.0) * 2, "3 degrees", 3.0), ((20.0, 80.0, -40.0, 20.0), "1 degree", 0.5)],
)
def test_the_expanded_uncertainty_is_that_of_the_budget(levels, degrees, count):
    """One degree of freedom of the next launch counted as one in both, and U held 89 to 91 %."""
    record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=levels), seed=4)
    fit = accelcal.fit(dataclasses.replace(record, apparatus=accelcal.Apparatus()))
    found, a_i = compensation(fit), np.array([-1.0, 0.0, 0.4, 1.0])
    assert found.launch.bias_dof == found.launch.scale_factor_dof == count
    new_launch = next(part for part in budget(fit, a_i).components if part.symbol == "k0L")
    assert (new_launch.dof == count).all()
    with pytest.warns(accelcal.AccelcalWarning, match=f"launch estimated with {degrees} of freed"):
        measured = accelcal.apply(fit, forward(found, a_i, 20.0, 0.3), 20.0, a_p=0.3)
    told = budget(fit, a_i, a_p=0.3).expanded_uncertainty
    assert measured.expanded_uncertainty == pytest.approx(told, rel=0.01)


def test_the_factor_is_that_of_the_budget_after_one_stroke():
    """Noise of three degrees of freedom beside a declared head, in shares that differ by angle."""
    plan = accelcal.TumblePlan(temperatures=(20.0,), strokes=1)
    known = accelcal.Apparatus(head_uncertainty=1e-5, launch_uncertainty=1e-6)
    known = dataclasses.replace(known, launch_sf_uncertainty=1e-6)
    fit = accelcal.fit(dataclasses.replace(accelcal.simulate(plan=plan, seed=4), apparatus=known))
    found, angle = compensation(fit), np.radians(np.arange(0.0, 360.0, 30.0))
    shown = forward(found, np.cos(angle), 20.0, np.sin(angle))
    measured = compensate(found, shown, 20.0, np.sin(angle))
    told = budget(fit, np.cos(angle), a_p=np.sin(angle))
    factor = measured.expanded_uncertainty / measured.standard_uncertainty
    assert np.ptp(factor) > 0.2
    assert told.coverage_factor == pytest.approx(factor, rel=0.01)


def test_a_launch_that_nothing_tells_is_said(one_level):
    bare = dataclasses.replace(one_level, error_sources=())
    (said,) = compensation(bare).assumptions
    assert said.startswith(
        "the shifts of bias and scale factor from launch to launch are neither declared nor"
    )
    assert compensation(bare, same_launch=True).assumptions == ()


def test_without_covariance_the_uncertainty_is_not_a_number(one_level):
    table = dataclasses.replace(one_level.tables[0], covariance_names=(), covariance_matrix=())
    bare = dataclasses.replace(one_level, tables=(table,))
    with pytest.warns(AccelcalWarning, match="no covariance"):
        measured = accelcal.apply(bare, [1.35], 20.0)
    assert np.isnan(measured.standard_uncertainty).all()
    assert np.isnan(measured.expanded_uncertainty).all()
    assert measured.value == pytest.approx([0.9965], abs=1e-3)


def test_readings_that_tell_no_noise_leave_no_uncertainty():
    angles = (0.0, 60.0, 120.0, 180.0, 240.0, 300.0)
    plan = accelcal.TumblePlan(angles=angles, temperatures=20.0, strokes=1)
    bare = accelcal.fit(accelcal.simulate(plan=plan, seed=1))
    with pytest.warns(AccelcalWarning, match=r"nothing tells the noise .*repeat strokes"):
        measured = accelcal.apply(bare, [1.35], 20.0)
    assert np.isnan(measured.standard_uncertainty).all()


# -- temperature -----------------------------------------------------------------------------------


@pytest.mark.parametrize("index", range(3))
def test_laws_agree_with_the_table_of_each_level(calibration, index):
    table = calibration.tables[index]
    output = np.array([1.3, 0.0, -1.2])
    by_table = accelcal.apply(calibration, output, table.temperature_degC, run=table.run)
    by_laws = accelcal.apply(calibration, output, table.temperature_degC)
    assert by_laws.value == pytest.approx(by_table.value, abs=1e-5)


def test_temperature_is_needed_with_laws(calibration):
    with pytest.raises(InputError, match="give the temperature"):
        accelcal.apply(calibration, [1.0])


def test_other_temperatures_are_refused_or_flagged(calibration):
    with pytest.raises(InputError, match=r"95 degC is more than 1 degC outside .* -40 to 80 degC"):
        accelcal.apply(calibration, [1.0, 1.0], [20.0, 95.0])
    with pytest.warns(AccelcalWarning, match="in 1 sample$"):
        measured = accelcal.apply(calibration, [1.0, 1.0], [20.0, 95.0], extrapolate=True)
    assert measured.inside.tolist() == [True, False]


@pytest.mark.parametrize(
    "ask",
    [
        lambda c: accelcal.apply(c, 1.3, 293.15, extrapolate=True),
        lambda c: accelcal.apply(c, [1.3, 1.3], [20.0, -9999.0], extrapolate=True),
        lambda c: accelcal.coefficients_at(c, 293.15, extrapolate=True),
        lambda c: accelcal.budget(c, 1.0, temperature=[20.0, 293.15], extrapolate=True),
    ],
)
def test_kelvin_is_refused_even_where_one_may_extrapolate(calibration, ask):
    with pytest.raises(InputError, match=r"(293\.15|-9999).* temperature of a test.* to 250 degC"):
        ask(calibration)


@pytest.mark.parametrize(
    "ask",
    [
        lambda c: accelcal.apply(c, 1.3, 20.0, a_p=9.81),
        lambda c: accelcal.apply(c, [1.3, 1.3], 20.0, a_p=[0.0, 9.81]),
        lambda c: accelcal.budget(c, [-9.81, 0.0, 9.81]),
        lambda c: accelcal.budget(c, 0.0, a_p=9.81),
    ],
)
def test_gravity_in_metres_is_not_taken_for_g(calibration, ask):
    with pytest.raises(InputError, match=r"a_[ip] is -?9.81 g, which looks like gravity in m/s\^2"):
        ask(calibration)


def test_more_across_than_any_test_is_told(calibration):
    with pytest.warns(AccelcalWarning, match="^a_p is beyond 2 g in 1 sample, more than any test"):
        accelcal.apply(calibration, [1.3, 1.3], 20.0, a_p=[0.5, 6.2])


def test_series_keep_their_index(calibration):
    output = pd.Series([1.35, 0.0, -1.35], index=[10, 20, 30])
    temperature = pd.Series([20.0, 40.0, 60.0], index=[10, 20, 30])
    measured = accelcal.apply(calibration, output, temperature)
    by_position = accelcal.apply(calibration, output.to_numpy(), temperature.to_numpy())
    assert measured.value.tolist() == by_position.value.tolist()
    frame = measured.to_frame()
    assert frame.index.tolist() == [10, 20, 30]
    assert frame["acceleration"].tolist() == measured.value.tolist()
    assert frame.attrs["units"]["acceleration"] == "g"
    assert "<td>True</td>" in measured._repr_html_()
    of_temperature = accelcal.apply(calibration, 1.35, temperature).to_frame()
    assert of_temperature.index.tolist() == [10, 20, 30]
    grid = accelcal.apply(calibration, [[1.35], [0.0]], temperature)
    assert len(grid.to_frame()) == 6


@pytest.mark.parametrize("index", [[30, 20, 10], [0, 1, 2], [10, 20, 40]])
def test_series_of_another_index_are_not_taken_by_position(calibration, index):
    output = pd.Series([1.35, 0.0, -1.35], index=[10, 20, 30])
    other = pd.Series([20.0, 40.0, 60.0], index=index)
    with pytest.raises(InputError, match="output and temperature are Series of different indices"):
        accelcal.apply(calibration, output, other)
    with pytest.raises(InputError, match="a_i and temperature are Series of different indices"):
        budget(calibration, output, temperature=other)


def test_a_frame_is_no_column(calibration):
    frame = pd.DataFrame({"output": [1.35, 0.0], "temperature": [20.0, 40.0]})
    with pytest.raises(InputError, match=r"output is a DataFrame; give one .* frame\['output'\]"):
        accelcal.apply(calibration, frame[["output"]], frame["temperature"])


def test_one_level_holds_within_a_degree(one_level):
    assert accelcal.apply(one_level, 1.0, 20.9).inside
    with pytest.raises(InputError, match="20 degC only; calibrate there, or accept it by extra"):
        accelcal.apply(one_level, 1.0, 21.1)


def test_one_level_needs_no_temperature(one_level):
    assert accelcal.apply(one_level, 1.0).inside


@pytest.mark.parametrize(
    ("effects", "left"),
    [
        ({"backlash": 3e-5}, None),
        ({"backlash": 3e-5, "warm-up": 2e-4}, "warm-up: the fit took it out"),
    ],
)
def test_effects_of_the_accelerometer_that_the_fit_took_out_are_told(effects, left):
    hidden = [accelcal.effect(name).of(size) for name, size in effects.items()]
    record = accelcal.simulate(effects=hidden, seed=3)
    fit = accelcal.fit(record, model=accelcal.discover(record))
    assert {effect.id for effect in fit.effects} == set(effects)
    said = [text for text in compensation(fit).assumptions if "took" in text]
    assert [text.startswith(left) for text in said] == [True] * (left is not None)
    assert [text for text in budget(fit, 1.0).warnings if "took" in text] == said
    (warned,) = compensation(accelcal.fit(record)).assumptions
    assert warned.startswith("checks of the calibration warn")


def test_gates_that_warn_are_told_to_who_uses_the_numbers():
    record = accelcal.simulate(effects=[accelcal.effect("hysteresis").of(5e-5)], seed=3)
    fit = accelcal.fit(record)
    (warned,) = compensation(fit).assumptions
    assert warned.startswith("checks of the calibration warn, forward against back (3 tables)")
    assert warned in budget(fit, 1.0).warnings
    assert export_content(fit)["assumptions"] == [warned]
    with pytest.warns(AccelcalWarning, match="checks of the calibration warn"):
        accelcal.apply(fit, 1.0, 20.0)
    alone = compensation(fit, run=1).assumptions[0]
    assert alone.startswith("checks of the calibration warn, forward against back (1 table)")


def test_a_missing_side_borrows_the_other_and_says_so():
    plan = accelcal.TumblePlan(temperatures=(20.0, 80.0))
    fit = accelcal.fit(accelcal.simulate(plan=plan, seed=2))
    found = compensation(fit)
    assert "no slopes below T0 were determined" in found.assumptions[0]
    assert found.k0.below.value == found.k0.above.value
    assert found.k0.below.standard_uncertainty == abs(found.k0.below.value)
    assert not found.k0.below.determined
    with pytest.warns(AccelcalWarning):
        measured = accelcal.apply(fit, [1.0, 1.0], [19.5, 20.5])
    below, above = measured.standard_uncertainty
    assert below > above


def test_tested_accelerations_are_flagged(calibration):
    measured = accelcal.apply(calibration, [1.35, 2.7, np.nan], 20.0)
    assert measured.within_accelerations.tolist() == [True, False, False]
    assert np.isfinite(measured.value).tolist() == [True, True, False]


# -- what was not determined -----------------------------------------------------------------------


def test_four_positions_say_what_is_assumed():
    plan = accelcal.TumblePlan(positions=4, temperatures=(20.0,))
    fit = accelcal.fit(accelcal.simulate(plan=plan, seed=1))
    with pytest.warns(AccelcalWarning, match=r"K3, M_ip were not .* as 0; K1 stands for K1 \+ K3"):
        measured = accelcal.apply(fit, [1.3547], 20.0)
    assert measured.value == pytest.approx([1.0], abs=1e-4)
    assert compensation(fit).undetermined == ("k3", "delta_ip")


def test_both_mountings_tell_both_cross_axes():
    plan = accelcal.TumblePlan(temperatures=(20.0,), mountings=("o+", "p+"))
    fit = accelcal.fit(accelcal.simulate(plan=plan, seed=3))
    found = compensation(fit)
    assert [axis.name for axis in found.axes] == ["a_p", "a_o"]
    delta = fit.tables[1].error_model["delta"].value
    with_a_o, without = (accelcal.apply(fit, 1.3, a_o=a).value for a in (1.0, 0.0))
    assert without - with_a_o == pytest.approx(delta, abs=1e-4)
    assert (
        accelcal.apply(fit, 1.3, a_o=1.0).standard_uncertainty
        > accelcal.apply(fit, 1.3).standard_uncertainty
    )


def test_a_cross_axis_that_was_not_calibrated_is_refused(calibration):
    with pytest.raises(InputError, match="a_o is given, but the calibration tells only what a_p"):
        accelcal.apply(calibration, [1.0], 20.0, a_o=0.1)


def test_several_tables_without_law_need_a_choice(calibration):
    bare = dataclasses.replace(calibration, temperature_model=None)
    with pytest.raises(InputError, match="3 tables and no temperature law"):
        accelcal.apply(bare, [1.0], 20.0)
    assert accelcal.apply(bare, [1.0], 20.0, run="1").inside
    with pytest.raises(InputError, match="no run '9'"):
        accelcal.apply(bare, [1.0], 20.0, run="9")


def test_the_printed_method_is_no_calibration():
    with pytest.warns(AccelcalWarning, match="misprinted"):
        fit = accelcal.fit(accelcal.simulate(seed=1), method="printed")
    with pytest.raises(InputError, match="misprinted"):
        accelcal.apply(fit, [1.0], 20.0)


# -- units -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "wanted", "factor"),
    [
        ("mA", "mA", 1.0),
        ("µA", "mA", 1e-3),
        ("V", "mV", 1e3),
        ("MHz", "Hz", 1e6),
        ("mA", "mV", None),
        ("counts", "pulses", None),
        ("furlong", "V", None),
    ],
)
def test_conversion_factor(given, wanted, factor):
    assert conversion_factor(given, wanted) == factor


def test_a_run_is_a_label_or_its_number(calibration):
    by_label, by_number = (accelcal.apply(calibration, [1.0], 20.0, run=r) for r in ("1", 1))
    assert by_label.value == by_number.value


def test_one_sample_gives_arrays_throughout():
    calibration = accelcal.fit(accelcal.simulate(seed=1))
    measured = accelcal.apply(calibration, 1.35, 20.0)
    for name in accelcal.MeasuredAcceleration.__slots__[:5]:
        found = getattr(measured, name)
        assert isinstance(found, np.ndarray), name
        assert found.shape == ()


def test_samples_of_several_blocks_are_as_those_of_one(calibration, monkeypatch):
    found, rng = compensation(calibration), np.random.default_rng(1)
    output, temperature = rng.uniform(-1.4, 1.4, (3, 50)), rng.uniform(-45.0, 85.0, 50)
    given = {"output_uncertainty": 1e-6, "temperature_uncertainty": 0.1}
    whole = compensate(found, output, temperature, 0.1 * output, **given)
    monkeypatch.setattr("accelcal.compensate.measured.AT_ONCE", 7)
    again = compensate(found, output, temperature, 0.1 * output, **given)
    assert again == whole
    assert again.value.shape == again.within_accelerations.shape == (3, 50)
    assert compensate(found, 1.35, 20.0, 0.0).value.shape == ()
    assert compensate(found, [], [], []).value.shape == (0,)
