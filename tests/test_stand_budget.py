"""Budget of a stand: cases by hand, correlation classes, and a simulator that shares no code."""

import math
from pathlib import Path

import numpy as np
import pytest

import accelcal
from accelcal.accelerometer import AL15, Accelerometer, BilinearLaw
from accelcal.errors import DesignError, InputError
from accelcal.estimate.uncertainty import welch_satterthwaite
from accelcal.io.toml.stand import read_stand
from accelcal.numerics.probability import student_quantile
from accelcal.simulation import NOISE_FREE, NoiseComponents, TumblePlan, simulate
from accelcal.specification import Limit, Specification
from accelcal.stand_uncertainty.budget import stand_budget
from accelcal.stand_uncertainty.estimator import estimator_of
from accelcal.stand_uncertainty.kinds import KINDS
from accelcal.stand_uncertainty.readings import CHANNELS, StandConditions, StandError, readings_of
from accelcal.stand_uncertainty.stand import Distribution, Stand, StandComponent, distribution

PAPER = Path(__file__).parents[1] / "examples" / "paper-stand.toml"
IDEAL = Accelerometer(
    BilinearLaw(1.0), BilinearLaw(0.0), BilinearLaw(0.0), k2=0.0, k3=0.0, cross_coupling=0.0
)
U = 1e-6
ONE_LEVEL = {"temperatures": (20.0,)}


def made(accelerometer=AL15, **plan):
    return simulate(accelerometer, TumblePlan(**plan, timed=True), NOISE_FREE, seed=0)


def one(kind, shape="normal", varies=None, u=U, **rest):
    classes = KINDS[kind].varies if varies is None else varies
    return StandComponent("it", kind, Distribution(shape, u), classes, **rest)


def alone(component, accelerometer=AL15, conditions=None, **plan):
    """Budget of a stand that errs in one way."""
    stand = Stand("one", (component,), conditions or StandConditions())
    return stand_budget(stand, made(accelerometer, **plan), accelerometer)


def of(budget, symbol):
    return budget.contribution(symbol)["it"]


def signed(budget, symbol):
    return float(budget.components[0].contributions[budget.index(symbol)])


# -- distributions ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "divisor"),
    [("rectangular", math.sqrt(3)), ("triangular", math.sqrt(6)), ("arcsine", math.sqrt(2))],
)
def test_half_widths_have_their_divisors(shape, divisor):
    assert distribution(shape, half_width=2.0).standard == pytest.approx(2.0 / divisor, rel=1e-15)


def test_a_normal_interval_is_divided_by_its_factor():
    assert distribution("normal", half_width=3.0, factor=3.0).standard == 1.0
    found = distribution("normal", half_width=1.0, coverage=0.95)
    assert found.standard == pytest.approx(1.0 / 1.959964, rel=1e-6)
    few = distribution("normal", half_width=1.0, coverage=0.95, dof=4.0)
    assert few.standard == pytest.approx(1.0 / 2.776445, rel=1e-6)


@pytest.mark.parametrize("shape", ["normal", "rectangular", "triangular", "arcsine"])
def test_draws_have_their_standard_deviation_and_limits(shape):
    found = distribution(shape, standard=2.0).draws(np.random.default_rng(1), (20000, 2, 1))
    assert found.std() == pytest.approx(2.0, rel=0.02)
    limits = {"rectangular": 3**0.5, "triangular": 6**0.5, "arcsine": 2**0.5}
    assert abs(found).max() <= 2.0 * limits.get(shape, 10.0)


def test_an_unknown_phase_keeps_the_amplitude():
    found = distribution("arcsine", half_width=3.0).draws(np.random.default_rng(1), (100, 2, 2))
    assert np.hypot(found[..., 0], found[..., 1]) == pytest.approx(3.0, rel=1e-12)


def test_few_degrees_of_freedom_are_drawn_as_student():
    found = distribution("normal", standard=1.0, dof=5.0).draws(
        np.random.default_rng(1), (100_000, 1, 1)
    )
    ends = np.quantile(found, [0.025, 0.975])
    assert ends == pytest.approx([-2.5706, 2.5706], abs=0.05)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"shape": "gaussian", "standard": 1.0}, "distribution 'gaussian' is unknown"),
        ({"shape": "normal", "standard": -1.0}, "standard is -1.0"),
        ({"shape": "normal", "half_width": math.nan, "factor": 2.0}, "half_width is nan"),
        ({"shape": "normal", "half_width": 1.0}, "needs its coverage"),
        ({"shape": "normal", "half_width": 1.0, "factor": 2.0, "coverage": 0.9}, "needs its cov"),
        ({"shape": "normal", "half_width": 1.0, "factor": 0.0}, "factor is 0.0"),
        ({"shape": "normal", "half_width": 1.0, "coverage": 95.0}, "coverage is 95.0"),
        ({"shape": "normal", "standard": 1.0, "coverage": 0.95}, "go with half_width"),
        ({"shape": "normal", "standard": 1.0, "half_width": 1.0}, "told twice"),
        ({"shape": "normal"}, "told twice or not at all"),
        ({"shape": "rectangular", "half_width": 1.0, "factor": 2.0}, "go with a normal"),
        ({"shape": "normal", "standard": 1.0, "dof": 2.0}, "has no variance"),
    ],
)
def test_a_size_that_means_nothing_is_refused(arguments, told):
    with pytest.raises(InputError, match=told):
        distribution(**arguments)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("uniform", 1.0), "distribution 'uniform' is unknown; choose from normal"),
        (("normal", -1.0), "standard is -1.0"),
        (("normal", math.nan), "standard is nan"),
        (("normal", 1.0, 2.0), "has no variance"),
        (("normal", 1.0, np.array([5.0, 6.0])), "dof is ndarray; it is one finite number"),
    ],
)
def test_a_distribution_that_is_none_is_refused(arguments, told):
    with pytest.raises(InputError, match=told):
        Distribution(*arguments)


# -- by hand ---------------------------------------------------------------------------------------


def terms(positions=8, strokes=1):
    """Design matrix of (1), written down here."""
    turn = np.arange(positions + 1) * 2.0 * np.pi / positions
    a, p = np.cos(np.tile(turn, strokes)), np.sin(np.tile(turn, strokes))
    return np.column_stack([np.ones_like(a), a, a**2, a**3, p, a * p])


@pytest.mark.parametrize("strokes", [1, 6])
def test_pure_noise_gives_the_covariance_of_least_squares(strokes):
    found = alone(one("reading-noise"), IDEAL, strokes=strokes, **ONE_LEVEL)
    design = terms(strokes=strokes)
    expected = U**2 * np.linalg.inv(design.T @ design)
    assert found.covariance[:6, :6] == pytest.approx(expected, rel=1e-7, abs=1e-20)
    if strokes == 1:  # of the theory, for one stroke of 9 readings
        expected = U * np.array([0.61, 1.54, 0.93, 1.86, 0.50, 1.00])
        assert found.standard_uncertainty[:6] == pytest.approx(expected, abs=0.005 * U)


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        (1, {"k0": 1.0, "k2": 1.0, "delta_ip": 1.0}),
        (2, {"k3": math.sqrt(2.0**2 + 0.0)}),
    ],
)
def test_a_harmonic_of_the_head_hides_in_coefficients(order, expected):
    """Sin th is K2 - K0 and cos th is M_ip; sin 2th is 2 K3 - 2 K1."""
    found = alone(one("head-harmonic", "arcsine", order=order), IDEAL, strokes=2, **ONE_LEVEL)
    for symbol, size in expected.items():
        assert of(found, symbol) == pytest.approx(size * U, rel=1e-6)
    if order == 1:
        assert found.components[0].residual < 1e-6
        assert of(found, "K1") < 1e-6 * U
        assert of(found, "delta") < 1e-6 * U
    else:
        assert of(found, "K1") == pytest.approx(2.0 * U, rel=1e-6)
        assert 0.1 < found.components[0].residual < 0.9  # cos 2th is in part seen


def test_a_constant_voltmeter_gain_is_absorbed_in_the_scale_factor_wholly():
    found = alone(one("voltmeter-gain"))
    assert signed(found, "K1") == pytest.approx(1.35 * U, rel=1e-9)
    assert found.components[0].residual < 1e-6
    for symbol in ("k0", "k2", "k3", "delta", "delta_ip", "lam1", "beta1", "gam2"):
        assert of(found, symbol) < 1e-9 * U


def test_a_gain_of_each_range_is_not():
    ranges = StandConditions(load=700.0, ranges=(0.1, 1.0))
    found = alone(one("voltmeter-gain", varies=("range",)), IDEAL_MA, ranges, **ONE_LEVEL)
    assert found.components[0].errors == 2
    assert of(found, "K1") == pytest.approx(1.35 * U, rel=1e-9)  # 0 g stands on the other range


IDEAL_MA = Accelerometer(
    BilinearLaw(1.35), BilinearLaw(0.0), BilinearLaw(0.0), k2=0.0, k3=0.0, cross_coupling=0.0
)


def test_a_fixture_angle_is_the_misalignment_less():
    found = alone(one("fixture-angle"), IDEAL)
    assert signed(found, "delta") == pytest.approx(-U, rel=1e-9)
    assert found.components[0].residual < 1e-6
    assert of(found, "k0") < 1e-9 * U
    assert of(found, "gam1") < 1e-9 * U


def test_two_mountings_free_the_misalignment_from_the_fixture_angle():
    found = alone(one("fixture-angle"), mountings=("o+", "o-"), **ONE_LEVEL)
    assert of(found, "delta_O") < 1e-6 * U
    assert signed(found, "d0_o") == pytest.approx(U, rel=1e-3)
    assert of(found, "delta") == pytest.approx(U, rel=1e-3)


def test_backlash_cancels_in_the_mean_of_strokes_and_not_in_one():
    both, forward = (alone(one("backlash"), IDEAL, strokes=n, **ONE_LEVEL) for n in (2, 1))
    assert of(both, "delta") < 1e-9 * U
    assert both.components[0].residual == pytest.approx(1.0)
    assert of(forward, "delta") == pytest.approx(U, rel=1e-9)
    assert forward.components[0].residual < 1e-6


def test_a_level_acts_in_the_second_order_only():
    found = alone(one("shaft-tilt"), IDEAL)
    assert found.standard_uncertainty.max() < 1e-9 * U
    assert "nothing here" in str(found)
    # a misalignment of 1.15 mrad towards the shaft brings it into the bias
    assert of(alone(one("shaft-tilt")), "k0") == pytest.approx(1.15e-3 * U, rel=2e-3)


def test_a_voltmeter_offset_is_a_current_through_the_load():
    offset = one("voltmeter-offset")
    found = alone(offset, conditions=StandConditions(load=500.0))
    assert signed(found, "K0") == pytest.approx(U / 500.0 * 1e3, rel=1e-9)  # mA
    with pytest.raises(StandError, match="load_resistor_ohm"):
        alone(offset)
    in_volts = Accelerometer(unit="mV")
    assert signed(alone(offset, in_volts), "K0") == pytest.approx(1e3 * U, rel=1e-9)


def test_readings_take_the_range_that_holds_them():
    conditions = StandConditions(load=700.0, ranges=(10.0, 0.1, 1.0))
    readings = readings_of(made(strokes=1, **ONE_LEVEL), AL15, conditions)
    assert readings.range_of_reading.tolist() == [1, 1, 0.1, 1, 1, 1, 0.1, 1, 1]
    with pytest.raises(StandError, match="above the largest range"):
        readings_of(made(), AL15, StandConditions(load=7000.0, ranges=(1.0,)))
    with pytest.raises(StandError, match="voltmeter_ranges_V"):
        alone(one("voltmeter-range"), conditions=StandConditions(load=700.0))


def test_gravity_acts_on_the_scale_factor_per_metre_only():
    found = alone(one("local-gravity"), conditions=StandConditions(local_gravity=9.8106))
    place = found.index("K1 per m/s^2")
    assert found.nominal[place] == pytest.approx(1.35 * (1 + 0.75 * 0) / 9.8106, rel=1e-9)
    expected = np.zeros(place + 1)
    expected[place] = -1.35 / 9.8106 * U
    assert found.components[0].contributions == pytest.approx(expected, rel=1e-9, abs=1e-20)


def test_the_load_follows_the_room():
    conditions = StandConditions(load_coefficient=5e-6)
    found = alone(one("resistor-temperature", u=2.0), conditions=conditions)
    assert of(found, "K1") / 1.35 == pytest.approx(10e-6, rel=1e-6)
    assert of(found, "beta1") * 60.0 == pytest.approx(math.hypot(1.0312, 1.0312) * 10e-6, rel=1e-3)


def test_a_temperature_error_goes_through_the_slopes():
    """K1 at 80 degC shifts by beta1 u, at 20 degC, on the break, by the mean of both slopes."""
    found = alone(one("chamber-temperature", u=0.1))
    beta1, beta2 = 520e-6, 480e-6
    assert of(found, "K1") / 1.35 == pytest.approx(0.05 * (beta1 + beta2), rel=1e-4)
    warm, mean = beta1 * 0.1, 0.05 * (beta1 + beta2) * (1.0 + 60.0 * beta1)
    assert of(found, "beta1") == pytest.approx(math.hypot(warm, mean) / 60.0, rel=1e-3)


def test_a_gradient_of_the_chamber_is_nothing_at_room_temperature():
    found = alone(one("chamber-gradient", u=0.01))
    assert of(found, "K1") < 1e-12
    assert of(found, "beta1") == pytest.approx(520e-6 * 0.01, rel=1e-4)
    assert of(found, "lam1") == pytest.approx(3.9e-5 * 0.01, rel=1e-4)


def test_the_foundation_moves_with_time():
    found = alone(one("foundation-drift", u=U), IDEAL, strokes=1, **ONE_LEVEL)
    # nine readings a minute apart: the mean turns the head, the rest goes elsewhere
    mean = U * 4.0 * 60.0 / 86400.0
    assert of(found, "delta") == pytest.approx(mean, rel=0.01)
    assert 0.01 < found.components[0].residual < 0.1


# -- correlation -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("varies", "errors"),
    [
        ((), 1),
        (("position",), 8),
        (("stroke",), 18),
        (("reading",), 162),
        (("run",), 3),
        (("temperature",), 3),
        (("mounting",), 1),
        (("position", "run"), 24),
    ],
)
def test_classes_count_their_errors(varies, errors):
    assert alone(one("head-position", varies=varies)).components[0].errors == errors


def test_what_is_common_leaves_the_slopes_and_what_is_not_does_not():
    common, apart = (alone(one("launch-bias", varies=v)) for v in ((), ("run",)))
    assert of(common, "k0") == pytest.approx(U, rel=1e-6)
    assert of(apart, "k0") == pytest.approx(U, rel=1e-6)
    assert of(common, "lam1") < 1e-9 * U
    assert of(apart, "lam1") == pytest.approx(math.sqrt(2.0) * U / 60.0, rel=1e-6)


def test_a_slope_goes_through_the_levels_as_that_of_a_fit_does():
    """A level 4 degC below T0, where no slope is measured, counted as one at T0."""
    found = alone(one("launch-bias", varies=("run",)), temperatures=(16.0, 80.0))
    assert of(found, "lam1") == pytest.approx(math.sqrt(2.0) * U / 64.0, rel=1e-6)


def test_strokes_average_what_is_new_in_each():
    sizes = {}
    for varies in (("reading",), ("position",)):
        few, many = (
            alone(one("head-position", varies=varies), strokes=n, **ONE_LEVEL) for n in (2, 8)
        )
        sizes[varies] = of(few, "k3") / of(many, "k3")
        assert few.components[0].averages == (varies == ("reading",))
    assert sizes["reading",] == pytest.approx(2.0, rel=1e-6)
    assert sizes["position",] == pytest.approx(1.0, rel=1e-6)


def test_the_stand_alone_has_its_own_degrees_of_freedom():
    # the launches, which are the accelerometer's, are large and known; the chamber has t of 4
    chamber = StandComponent("c", "chamber-temperature", Distribution("normal", 0.1, 4.0), ("run",))
    launch = StandComponent("l", "launch-bias", Distribution("normal", 1e-3), ("run",), fixed=True)
    sheet = Specification("trial", (Limit("bias_repeatability", "ug", maximum=50.0),))
    test = made(temperatures=(20.0, 20.0))
    found = stand_budget(Stand("two", (chamber, launch)), test, specification=sheet)
    change = 0.1 * 42.0 * math.sqrt(2.0)  # ug; the bias changes by 42 ug/degC at T0 on the average
    told = found.data_sheet[0].expanded_uncertainty
    assert told == pytest.approx(2.776445 * change, rel=1e-3)


def test_levels_that_are_met_twice_tell_the_change():
    found = alone(one("launch-bias"), temperatures=(20.0, 20.0))
    assert of(found, "k0 change") == pytest.approx(math.sqrt(2.0) * U, rel=1e-6)
    assert of(found, "K1 change") < 1e-9 * U
    assert found.index("lam1") is None


# -- combination -----------------------------------------------------------------------------------


def paper(trials=0, **rest):
    return stand_budget(read_stand(PAPER), made(), trials=trials, **rest)


@pytest.fixture(scope="module")
def budget():
    return paper()


def test_variances_add_up(budget):
    squares = np.sum([part.contributions**2 for part in budget.components], axis=0)
    assert budget.standard_uncertainty**2 == pytest.approx(squares, rel=1e-12)
    assert np.diagonal(budget.covariance) == pytest.approx(squares, rel=1e-12)
    assert np.linalg.eigvalsh(budget.covariance).min() > -1e-20
    rows = [r for r in budget.rows() if r["coefficient"] == "K1" and not r["where"]]
    assert sum(row["share"] for row in rows[:-1]) == pytest.approx(1.0)


def test_sensitivities_are_contributions_per_unit(budget):
    part = next(p for p in budget.components if p.name == "load")
    assert part.sensitivities[budget.index("K1")] == pytest.approx(1.35, rel=1e-6)


def test_degrees_of_freedom_follow_welch_and_satterthwaite():
    parts = (
        StandComponent("one", "voltmeter-gain", Distribution("normal", 3e-6, 4.0)),
        StandComponent("two", "resistor-tolerance", Distribution("normal", 4e-6)),
    )
    found = stand_budget(Stand("two", parts), made())
    place = found.index("K1")
    assert found.dof[place] == pytest.approx(5.0**4 / (3.0**4 / 4.0))
    assert found.coverage_factor[place] == pytest.approx(student_quantile(0.95, found.dof[place]))
    assert found.expanded_uncertainty[place] == pytest.approx(
        found.coverage_factor[place] * 5e-6 * 1.35, rel=1e-6
    )
    assert math.isinf(welch_satterthwaite([1.0], [math.inf]))


def test_error_model_is_the_quotient(budget):
    K0, K1, k0 = (budget.index(symbol) for symbol in ("K0", "K1", "k0"))
    assert budget.nominal[k0] == pytest.approx(3.324e-3, rel=1e-9)
    assert budget.nominal[k0] == pytest.approx(budget.nominal[K0] / budget.nominal[K1])
    assert budget.nominal[budget.index("beta2")] == pytest.approx(480e-6, rel=1e-6)


# -- against others --------------------------------------------------------------------------------


def rotation(axis, angle):
    """Rotation matrix about one of the axes 0, 1, 2."""
    found = np.eye(3)
    i, j = [k for k in range(3) if k != axis]
    found[i, i] = found[j, j] = math.cos(angle)
    found[i, j], found[j, i] = -math.sin(angle), math.sin(angle)
    return found


def reading_by_hand(th, level, turn=0.0, tilt=0.0, lean=0.0, clock=0.0, **e):
    """Output of the AL-15 in mounting o+: gravity turned into its axes by matrices."""
    dT = level - 20.0 + e.get("temperature", 0.0)
    psi = math.radians(th) + turn
    # axes of the head (in-plane at psi = 0, in-plane across, shaft); up is tilted to the shaft
    up = rotation(1, tilt).T @ np.array([1.0, 0.0, 0.0])
    in_head = rotation(2, psi) @ np.array([up[0], 0.0, 0.0]) + np.array([0.0, 0.0, up[2]])
    a = rotation(0, clock).T @ rotation(1, lean) @ in_head
    bias = 3.324e-3 + (-3.9e-5 if dT > 0 else -4.5e-5) * dT + e.get("bias", 0.0)
    delta = 1.15e-3 + (1.5e-6 if dT > 0 else 1.2e-6) * dT
    across = a[1] + a[2]
    inside = bias + a[0] + 105e-6 * a[0] ** 2 + 87e-6 * a[0] ** 3 + (delta + 2e-5 * a[0]) * across
    K1 = 1.35 * (1.0 + (520e-6 if dT > 0 else 480e-6) * dT) * (1.0 + e.get("scale", 0.0))
    return K1 * inside * (1.0 + e.get("gain", 0.0)) + e.get("output", 0.0)


def coefficients_by_hand(outputs):
    """Error model at 20 degC, and slopes, from (3 runs, 54 readings)."""
    angle = np.radians([reading[0] for reading in RUN])
    a, p = np.cos(angle), np.sin(angle)
    design = np.column_stack([np.ones_like(a), a, a**2, a**3, p, a * p])
    K = [np.linalg.lstsq(design, y, rcond=None)[0] for y in outputs]
    found = dict(zip(("K0", "K1", "K2", "K3", "M", "M_ip"), K[0], strict=True))
    names = ("k0", "", "k2", "k3", "delta", "delta_ip")
    found |= {n: value / K[0][1] for n, value in zip(names, K[0], strict=True) if n}
    for symbol, place in (("lam", 0), ("gam", 4)):
        at = [k[place] / k[1] for k in K]
        found |= {f"{symbol}1": (at[1] - at[0]) / 60.0, f"{symbol}2": (at[0] - at[2]) / 60.0}
    found["beta1"] = (K[1][1] - K[0][1]) / 60.0 / K[0][1]
    found["beta2"] = (K[0][1] - K[2][1]) / 60.0 / K[0][1]
    return found


TURN = [45.0 * i for i in range(9)]
RUN = [(th, stroke) for stroke in range(1, 7) for th in (TURN if stroke % 2 else TURN[::-1])]
LEVELS = (20.0, 80.0, -40.0)
DAY = 86400.0


def owner_by_hand(name, level, n):
    """What a component of a class shares an error with."""
    return {
        "position": RUN[n][0] % 360.0,
        "temperature": level,
        "run": level,
        "axis": "o",
        "range": range_by_hand(level, n),
        "voltage": voltage_by_hand(level, n),
    }[name]


def voltage_by_hand(level, n):
    """Positions alike up and down have one voltage, and those at 0 g one at all levels."""
    cosine = round(math.cos(math.radians(RUN[n][0])), 3)
    return (cosine, level) if cosine else (cosine,)


def range_by_hand(level, n):
    return 0.1 if abs(reading_by_hand(RUN[n][0], level)) * 0.7 <= 0.1 else 1.0


def acting_by_hand(kind, level, n):
    """Channel, and its change by one unit (one for each phase), of the kinds in the example."""
    seconds = LEVELS.index(level) * (54 * 60.0 + 3600.0) + n * 60.0
    turn = math.radians(RUN[n][0])
    wave = 2.0 * math.pi * seconds / DAY
    return {
        "head-position": ("turn", [1.0]),
        "shaft-tilt": ("tilt", [1.0]),
        "foundation-daily": ("turn", [math.cos(wave), math.sin(wave)]),
        "chamber-temperature": ("temperature", [1.0]),
        "voltmeter-range": ("output", [range_by_hand(level, n) / 0.7]),
        "head-harmonic": ("turn", [math.cos(3.0 * turn), math.sin(3.0 * turn)]),
        "backlash": ("turn", [-1.0 if RUN[n][1] % 2 else 1.0]),
        "fixture-clocking": ("clock", [1.0]),
        "foundation-drift": ("turn", [seconds / DAY]),
        "chamber-gradient": ("temperature", [level - 20.0]),
        "voltmeter-gain": ("gain", [1.0]),
        "voltmeter-offset": ("output", [1.0 / 0.7]),
        "resistor-tolerance": ("gain", [1.0]),
        "resistor-temperature": ("gain", [5e-6]),
        "fixture-angle": ("turn", [1.0]),
        "fixture-tilt": ("lean", [1.0]),
        "launch-bias": ("bias", [1.0]),
        "launch-scale-factor": ("scale", [1.0]),
    }[kind]


def by_finite_differences(part):
    """Standard uncertainty of each coefficient by one component, by the simulator of this file."""
    owners = {}
    for level in LEVELS:
        for n in range(len(RUN)):
            owner = tuple(owner_by_hand(name, level, n) for name in part.varies)
            owners.setdefault(owner, []).append((level, n))
    calm = {(level, n): reading_by_hand(RUN[n][0], level) for level in LEVELS for n in range(54)}
    variance = {}
    step = part.distribution.standard
    for members in owners.values():
        for phase in range(len(acting_by_hand(part.kind, *members[0])[1])):
            sides = []
            for sign in (1.0, -1.0):
                outputs = dict(calm)
                for level, n in members:
                    channel, sizes = acting_by_hand(part.kind, level, n)
                    error = {channel: sign * step * sizes[phase]}
                    outputs[level, n] = reading_by_hand(RUN[n][0], level, **error)
                runs = [np.array([outputs[level, n] for n in range(54)]) for level in LEVELS]
                sides.append(coefficients_by_hand(runs))
            for symbol, value in sides[0].items():
                change = 0.5 * (value - sides[1][symbol])
                variance[symbol] = variance.get(symbol, 0.0) + change**2
    return {symbol: math.sqrt(value) for symbol, value in variance.items()}


def test_the_simulator_of_this_file_agrees_without_errors():
    record = made()
    order = [(level, n) for level in LEVELS for n in range(54)]
    own = [reading_by_hand(RUN[n][0], level) for level, n in order]
    assert record.output == pytest.approx(own, abs=1e-14)


OTHERS = ("backlash", "fixture-clocking", "foundation-drift", "chamber-gradient", "voltmeter-gain")
PARTS = (
    *(
        part
        for part in read_stand(PAPER).components
        if part.kind != "local-gravity" and "reading" not in part.varies
    ),
    *(
        StandComponent(kind, kind, Distribution("normal", 1e-5), KINDS[kind].varies)
        for kind in (*OTHERS, "voltmeter-offset")
    ),
    StandComponent("third harmonic", "head-harmonic", Distribution("arcsine", 1e-5), order=3),
)


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
def test_each_component_agrees_with_finite_differences(part):
    """All but those that are new in each reading, which the covariance of least squares has."""
    stand = Stand("one", (part,), read_stand(PAPER).conditions)
    budget = stand_budget(stand, made())
    expected = by_finite_differences(part)
    floor = max(1e-6 * max(expected.values()), 1e-14)
    for symbol, size in expected.items():
        found = budget.contribution(symbol)[part.name]
        assert found == pytest.approx(size, rel=2e-4, abs=floor), symbol


def test_budget_agrees_with_the_spread_of_simulated_tests():
    """The simulation draws head, launches, temperatures and noise by code of its own."""
    noise = NoiseComponents(reading=5e-6, head=1e-5, launch=8e-6, launch_sf=6e-6, temperature=0.05)
    sizes = {
        "reading-noise": 5e-6,
        "head-position": 1e-5,
        "launch-bias": 8e-6,
        "launch-scale-factor": 6e-6,
        "chamber-temperature": 0.05,
    }
    parts = tuple(
        StandComponent(kind, kind, Distribution("normal", u), KINDS[kind].varies)
        for kind, u in sizes.items()
    )
    budget = stand_budget(Stand("simulated", parts), made())
    estimator = estimator_of(readings_of(made(), AL15, StandConditions()))
    tests = np.array([simulate(noise=noise, seed=seed).output for seed in range(400)])
    known = np.column_stack([tests @ estimator.map.T, np.ones(len(tests))])
    spread = estimator.estimates(known).std(axis=0, ddof=1)
    ratio = spread / budget.standard_uncertainty
    assert np.abs(ratio - 1.0).max() < 4.5 / math.sqrt(2 * 400)


@pytest.mark.parametrize("method", ["least-squares", "closed-form"])
def test_estimator_is_that_of_fit(method):
    """But for the head's errors, which least squares of fit take out as far as they are seen."""
    noise = NOISE_FREE if method == "least-squares" else NoiseComponents()
    record = simulate(noise=noise, seed=3)
    calibration = accelcal.fit(record, method=method)
    estimator = estimator_of(readings_of(record, AL15, StandConditions()), method)
    found = estimator.estimates(np.append(estimator.map @ record.output, 1.0))
    named = {str(c): value for c, value in zip(estimator.named, found, strict=True)}
    table, laws = calibration.tables[0], calibration.temperature_model
    for name, quantity in {**table.coefficients, **table.error_model}.items():
        assert named[name] == pytest.approx(quantity.value, rel=1e-6), name
    expected = (laws.k0.above, laws.K1.below, laws.delta.above)
    for name, quantity in zip(("lam1", "beta2", "gam1"), expected, strict=True):
        assert named[name] == pytest.approx(quantity.value, rel=1e-4), name


@pytest.mark.parametrize("delta0", [0.0, 0.01])
def test_readings_without_errors_are_those_of_the_simulation(delta0):
    record = made(mountings=("o+", "o-", "p+", "p-"), delta0=delta0)
    found = readings_of(record, AL15, StandConditions(), delta0).output({})
    assert found == pytest.approx(record.output, abs=1e-14)


def test_what_the_angles_do_not_determine_is_said():
    found = alone(one("reading-noise"), positions=4, **ONE_LEVEL)
    assert any("do not determine K3, M_ip" in warning for warning in found.warnings)
    assert found.index("K3") is None
    assert found.index("delta_ip") is None


@pytest.mark.parametrize(
    ("kind", "told"),
    [("reading-noise", True), ("chamber-temperature", False), ("chamber-gradient", False)],
)
def test_a_stand_whose_chamber_is_not_described_is_told(kind, told):
    found = alone(one(kind), temperatures=(20.0, 60.0), strokes=2)
    said = "no component of the chamber: temperatures are taken as known"
    assert (said in found.warnings) is told


# -- refusals --------------------------------------------------------------------------------------


def test_what_is_no_test_is_refused():
    with pytest.raises(InputError, match="str in place of a record"):
        stand_budget(read_stand(PAPER), "al15.csv")
    with pytest.raises(DesignError):
        alone(one("head-position"), angles=(90.0, 270.0), **ONE_LEVEL)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (
            lambda: StandComponent("it", "wobble", Distribution("normal", U)),
            "kind 'wobble' is unknown",
        ),
        (lambda: one("backlash", varies=("cycle",)), "varies by 'cycle'"),
        (lambda: one("local-gravity", varies=("run",)), "does not vary"),
        (lambda: one("head-position", u=0.2), "below 0.1 rad, so check the unit"),
        (lambda: one("voltmeter-offset", u=1e4), "below 1000 V"),
        (lambda: one("head-harmonic", order=0), "order is 0"),
        (lambda: Stand("none", ()), "no components"),
        (lambda: Stand("two", (one("backlash"), one("backlash"))), "is there twice"),
        (lambda: Stand("one", (one("backlash"),)).scaled([-1.0]), "factor 1 is -1.0; it is 0"),
        (lambda: Stand("one", (one("backlash"),)).scaled([math.inf]), "factor 1 is inf; it is a"),
        (lambda: Stand("one", (one("backlash"),)).scaled(None), "factor 1 is None; it is a finite"),
        (lambda: Stand("one", (one("backlash"),)).scaled([]), "0 factors for 1 component; give"),
        (lambda: StandConditions(local_gravity=98.0), "nowhere on Earth"),
        (lambda: StandConditions(load=0.0), "load is 0.0"),
        (lambda: StandConditions(room_temperature=math.nan), "room_temperature is nan"),
        (lambda: StandConditions(ranges=(0.0,)), "each lies between"),
        (
            lambda: StandConditions(local_gravity="9.81"),
            "local_gravity is '9.81'; it is a finite number",
        ),
        (lambda: StandConditions(load=[700.0]), "load is list; it is one finite number"),
        (lambda: StandConditions(room_temperature=None), "room_temperature is None"),
        (lambda: StandConditions(ranges=[0.1, "1"]), "range 2 is '1'; it is a finite number"),
    ],
)
def test_a_stand_that_is_none_is_refused(make, told):
    with pytest.raises(InputError, match=told):
        make()


def test_every_channel_has_a_kind():
    assert {kind.channel for kind in KINDS.values()} == set(CHANNELS)
