"""Effects of the accelerometer itself, taken up where outputs become accelerations."""

import dataclasses

import numpy as np
import pytest

import accelcal
from accelcal.compensate.choice import compensation
from accelcal.compensate.inversion import invert, invert_with
from accelcal.effects.effect import Effect
from accelcal.effects.parameter import Parameter
from accelcal.error_budget.budget import budget
from accelcal.errors import AccelcalWarning, InputError
from accelcal.export.content import export_content
from accelcal.geometry import accelerations
from accelcal.results.findings import FoundEffect
from accelcal.results.quantity import Quantity
from accelcal.simulation import NOISE_FREE

SIZES = {
    "scale-factor-asymmetry": 2e-4,
    "fourth-order": 1e-4,
    "odd-quadratic": -1e-4,
    "cross-axis-cubic": 1e-4,
    "cross-axis-quadratic": 1e-4,
    "dead-zone": 5e-5,
    "k2-temperature": 1e-6,
    "k3-temperature": -1e-6,
    "bias-temperature-quadratic": 4e-8,
    "scale-factor-temperature-quadratic": 1e-7,
    "break-shift": 15.0,
}
EVERYWHERE = tuple(np.linspace(3.0, 357.0, 24))


def with_effects(calibration, *sized, uncertainty=0.0, aliases=()):
    """The calibration as a fit with a model writes it."""
    found = []
    for item in sized:
        first = item.effect.parameters[0].name
        sigma = dict.fromkeys(item.values, None) | {first: uncertainty}
        parameters = {
            p.name: Quantity(item.values[p.name], sigma[p.name], p.unit)
            for p in item.effect.parameters
        }
        about = (item.effect.id, item.effect.name, parameters, 0.0, 0.0, 0.0, None, None)
        found.append(FoundEffect(*about, tuple(aliases), ""))
    return dataclasses.replace(calibration, effects=tuple(found))


def in_use(*effects, temperature=20.0, mounting="o+"):
    """Outputs without noise, and what truly acted."""
    plan = accelcal.TumblePlan(
        angles=EVERYWHERE, strokes=1, temperatures=(temperature,), mountings=(mounting,)
    )
    record = accelcal.simulate(plan=plan, noise=NOISE_FREE, effects=effects, seed=1)
    return record.output, accelerations(record.angle, mounting=mounting)


@pytest.fixture(scope="module")
def exact():
    fit = accelcal.fit(accelcal.simulate(noise=NOISE_FREE, seed=1), temperature_laws="readings")
    tables = [dataclasses.replace(table, gates=()) for table in fit.tables]  # they warn of the step
    return dataclasses.replace(fit, tables=tuple(tables))


def test_each_static_effect_of_the_catalogue_is_tried_here():
    assert {entry.id for entry in accelcal.catalogue() if entry.static} == set(SIZES)


@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
@pytest.mark.parametrize("temperature", [20.0, 55.0, -30.0])
@pytest.mark.parametrize(("name", "size"), SIZES.items())
def test_an_effect_that_the_simulation_added_is_taken_off(exact, name, size, temperature):
    effect = accelcal.effect(name).of(size)
    output, acted = in_use(effect, temperature=temperature)
    fit = with_effects(exact, effect)
    measured = accelcal.apply(fit, output, temperature, a_p=acted.pendulous)
    plain = accelcal.apply(exact, output, temperature, a_p=acted.pendulous)
    error = np.abs(plain.value - acted.input).max()
    assert np.abs(measured.value - acted.input).max() < 1e-8
    if "temperature" in name:
        assert error > 1e-5 or temperature == 20.0
    elif name != "break-shift":
        assert error > 2e-5


@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
@pytest.mark.parametrize("name", ["k2-temperature", "scale-factor-temperature-quadratic"])
def test_the_table_of_a_run_keeps_the_temperature_that_effects_refer_to(exact, name):
    effect = accelcal.effect(name).of(SIZES[name])
    output, acted = in_use(effect, temperature=80.0)
    measured = accelcal.apply(with_effects(exact, effect), output, 80.0, a_p=acted.pendulous, run=2)
    assert np.abs(measured.value - acted.input).max() < 1e-8


@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
def test_several_effects_add_up(exact):
    effects = [accelcal.effect(name).of(SIZES[name]) for name in ("fourth-order", "dead-zone")]
    output, acted = in_use(*effects)
    with pytest.warns(AccelcalWarning, match="dead-zone: taken up"):
        measured = accelcal.apply(with_effects(exact, *effects), output, 20.0, a_p=acted.pendulous)
    assert np.abs(measured.value - acted.input).max() < 1e-7


@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
def test_each_cross_axis_has_the_effect():
    plan = accelcal.TumblePlan(temperatures=(20.0,), mountings=("o+", "p+"))
    exact = accelcal.fit(accelcal.simulate(plan=plan, noise=NOISE_FREE, seed=1))
    effect = accelcal.effect("cross-axis-cubic").of(1e-4)
    fit = with_effects(exact, effect)
    for mounting in plan.mountings:
        output, acted = in_use(effect, mounting=mounting)
        measured = accelcal.apply(fit, output, 20.0, a_p=acted.pendulous, a_o=acted.output)
        assert np.abs(measured.value - acted.input).max() < 1e-8


# -- uncertainty -----------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
def test_the_uncertainty_of_the_size_is_added_in_squares():
    fit = accelcal.fit(accelcal.simulate(seed=1))
    effect = accelcal.effect("scale-factor-asymmetry").of(2e-4)
    output = [1.35, 0.6, 0.0, -1.35]
    sure, unsure = (
        accelcal.apply(with_effects(fit, effect, uncertainty=u), output, 20.0) for u in (0.0, 3e-5)
    )
    added = np.sqrt(unsure.standard_uncertainty**2 - sure.standard_uncertainty**2)
    assert added == pytest.approx(3e-5 * np.abs(sure.value), rel=1e-3, abs=1e-6)


@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
def test_an_error_of_the_temperature_acts_through_the_effects(exact):
    effect = accelcal.effect("bias-temperature-quadratic").of(4e-6)
    fit, told = with_effects(exact, effect), {"temperature_uncertainty": 0.01, "same_launch": True}
    u = accelcal.apply(fit, 1.35, 70.0, **told).standard_uncertainty
    warm, cold = (accelcal.apply(fit, 1.35, T).value for T in (70.01, 69.99))
    assert u == pytest.approx(abs(warm - cold) / 2.0, rel=1e-3)


@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
@pytest.mark.parametrize("a_p", [0.0, 1.0])
def test_an_output_in_a_dead_zone_stands_for_all_of_it(exact, a_p):
    """The zone lies about zero of the true input axis, which the misalignment tilts."""
    width, sigma = 5e-4, 1e-5
    fit = with_effects(exact, accelcal.effect("dead-zone").of(width))
    K0, K1, M = (exact.tables[0].coefficients[name].value for name in ("K0", "K1", "M"))
    told = {"same_launch": True, "output_uncertainty": K1 * sigma}
    inside, beyond = (
        accelcal.apply(fit, K0 + K1 * a, 20.0, a_p=a_p, **told) for a in (0.0, 4.0 * sigma)
    )
    middle = -M / K1 * a_p
    assert abs(M / K1) > 2.0 * width
    assert inside.value == pytest.approx(middle, abs=1e-7)
    assert inside.standard_uncertainty == pytest.approx(sigma + width / 1.96, rel=1e-3)
    assert beyond.value == pytest.approx(middle + width + 4.0 * sigma, abs=1e-7)
    assert beyond.standard_uncertainty == pytest.approx(sigma, rel=1e-3)


@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
def test_without_covariance_there_is_an_acceleration_all_the_same(exact):
    table = dataclasses.replace(exact.tables[0], covariance_names=(), covariance_matrix=())
    bare = dataclasses.replace(exact, tables=(table,), temperature_model=None)
    fit = with_effects(bare, accelcal.effect("fourth-order").of(1e-4))
    output, acted = in_use(accelcal.effect("fourth-order").of(1e-4))
    with pytest.warns(AccelcalWarning, match="no covariance"):
        measured = accelcal.apply(fit, output, 20.0, a_p=acted.pendulous)
    assert np.isnan(measured.standard_uncertainty).all()
    assert np.abs(measured.value - acted.input).max() < 1e-8


def fourth_order_less_asymmetry(a_i, a_p):
    """Difference of what 8 positions do not tell apart: |a_i| is there (1) with some a_i^4."""

    def shapes(a_i, a_p):
        model = [np.ones_like(a_i), a_i, a_i**2, a_i**3, a_p, a_i * a_p]
        return np.stack([*model, a_i**4], axis=1), np.abs(a_i)

    eighth = np.radians(45.0 * np.arange(8))
    columns, asymmetry = shapes(np.cos(eighth), np.sin(eighth))
    alike = np.linalg.lstsq(columns, asymmetry, rcond=None)[0]
    columns, asymmetry = shapes(a_i, a_p)
    return columns @ alike - asymmetry


@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
@pytest.mark.parametrize("temperature", [20.0, 55.0])
def test_what_may_be_there_in_its_place_counts_between_the_positions(exact, temperature):
    """Either is the truth at even chance: half the square of their difference."""
    effect = accelcal.effect("scale-factor-asymmetry").of(2e-4)
    output, acted = in_use(effect, temperature=temperature)
    alone, alike = (
        accelcal.apply(
            with_effects(exact, effect, aliases=names),
            *(output, temperature),
            a_p=acted.pendulous,
            same_launch=True,
        )
        for names in ((), ("fourth-order",))
    )
    difference = 2e-4 * fourth_order_less_asymmetry(acted.input, acted.pendulous)
    assert np.abs(difference).max() > 2e-5
    added = np.sqrt(alike.standard_uncertainty**2 - alone.standard_uncertainty**2)
    assert added == pytest.approx(np.abs(difference) / np.sqrt(2.0), rel=0.02, abs=1e-7)
    assert alike.value == pytest.approx(alone.value, abs=1e-7)


@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
def test_what_may_be_there_in_its_place_counts_in_the_error_budget(exact):
    effect = accelcal.effect("scale-factor-asymmetry").of(2e-4)
    fit = with_effects(exact, effect, aliases=("fourth-order",))
    angle = np.radians([0.0, 22.5, 45.0, 75.0, 90.0])
    a_i, a_p = np.cos(angle), np.sin(angle)
    (part,) = (p for p in budget(fit, a_i, a_p=a_p).components if p.symbol == effect.effect.id)
    expected = np.abs(2e-4 * fourth_order_less_asymmetry(a_i, a_p)) / np.sqrt(2.0)
    assert part.standard_uncertainty == pytest.approx(expected, rel=0.01, abs=1e-9)
    assert expected[3] > 1e-5


def test_a_look_alike_of_the_stand_is_told_and_not_counted(exact):
    effect = accelcal.effect("fourth-order").of(1e-4)
    (told,) = compensation(with_effects(exact, effect, aliases=("head-eccentricity",))).assumptions
    assert told.endswith(
        "tell it from head-eccentricity either, which the uncertainty does not count"
    )


def test_discovered_fitted_and_applied():
    effect = accelcal.effect("scale-factor-asymmetry").of(187e-6)
    record = accelcal.simulate(effects=[effect], seed=3)
    fit = accelcal.fit(record, model=accelcal.discover(record))
    output, acted = in_use(effect)
    with pytest.warns(AccelcalWarning, match=r"not tell it from fourth-order; between"):
        measured = accelcal.apply(fit, output, 20.0, a_p=acted.pendulous, same_launch=True)
    plain = accelcal.apply(
        dataclasses.replace(fit, effects=()), output, 20.0, a_p=acted.pendulous, same_launch=True
    )
    assert np.abs(plain.value - acted.input).max() > 1.5e-4
    error = np.abs(measured.value - acted.input)
    assert error.max() < 4e-5
    assert (error < 2.5 * measured.standard_uncertainty).all()


# -- in the error budget ---------------------------------------------------------------------------


@pytest.mark.parametrize("temperature", [20.0, 55.0])
@pytest.mark.parametrize(("name", "size"), SIZES.items())
def test_the_error_budget_counts_an_effect_that_was_simulated(exact, name, size, temperature):
    """What the effect changes in Y over K1 at T0, to the first order that (4) has."""
    effect = accelcal.effect(name).of(size)
    (shown, acted), (plain, _) = (
        in_use(*effects, temperature=temperature) for effects in ([effect], [])
    )
    K1 = exact.temperature_model.K1.at_T0.value
    point = {"a_i": acted.input, "a_p": acted.pendulous, "temperature": temperature}
    told = budget(with_effects(exact, effect), **point)
    changed = told.systematic - budget(exact, **point).systematic
    assert changed == pytest.approx((shown - plain) / K1, rel=0.03, abs=2e-7)
    (part,) = (part for part in told.components if part.symbol == name)
    assert part.value == pytest.approx(changed, abs=1e-15)


def test_the_error_budget_counts_the_uncertainty_of_the_size(exact):
    effect = accelcal.effect("scale-factor-asymmetry").of(2e-4)
    told = budget(with_effects(exact, effect, uncertainty=3e-5), [-1.0, 0.0, 0.5])
    (part,) = (part for part in told.components if part.symbol == "scale-factor-asymmetry")
    assert part.standard_uncertainty == pytest.approx([3e-5, 0.0, 1.5e-5], abs=1e-15)
    assert any(text.startswith("scale-factor-asymmetry: taken up") for text in told.warnings)


# -- what is said, and what is left ----------------------------------------------------------------


def test_what_has_a_memory_or_is_not_known_is_left_and_told(exact):
    effects = [accelcal.effect(name).of(1e-4) for name in ("fourth-order", "warm-up", "backlash")]
    told = compensation(with_effects(exact, *effects)).assumptions
    assert [text.split(":")[0] for text in told] == ["fourth-order", "warm-up"]
    assert "taken up" in told[0]
    assert "neither the accelerations" in told[1]


def test_exports_cannot_hold_static_effects_and_refuse_them(exact):
    fit = with_effects(exact, accelcal.effect("fourth-order").of(1e-4))
    with pytest.raises(InputError, match="fourth-order: the coefficients are free of it"):
        export_content(fit)
    others = with_effects(exact, accelcal.effect("warm-up").of(1e-4))
    (told,) = export_content(others)["assumptions"]
    assert told.startswith("warm-up: the fit took it out")


def modulus(**fields):
    return Effect(
        **{
            "id": "cross-modulus",
            "name": "modulus of the cross axis",
            "physics": "The cross axis acts alike on both sides.",
            "formula": "c |a_p|",
            "parameters": (Parameter("coefficient", "1", "coefficient c"),),
            "term": lambda c, coefficient: coefficient * np.abs(c.cross),
            **fields,
        }
    )


@pytest.mark.parametrize("static", [True, False])
def test_an_effect_of_a_user_is_taken_up_where_it_is_static(exact, static):
    accelcal.register(modulus(static=static))
    try:
        effect = accelcal.effect("cross-modulus").of(1e-4)
        output, acted = in_use(effect)
        with pytest.warns(AccelcalWarning, match="taken up" if static else "took it out"):
            measured = accelcal.apply(
                with_effects(exact, effect), output, 20.0, a_p=acted.pendulous
            )
    finally:
        accelcal.unregister("cross-modulus")
    assert (np.abs(measured.value - acted.input).max() < 1e-8) == static


def test_what_acts_on_the_angle_is_not_static():
    with pytest.raises(InputError, match="static, and acts on the angle"):
        accelcal.register(modulus(static=True, acts_on="angle"))


# -- the inverse -----------------------------------------------------------------------------------


@pytest.mark.parametrize("k4", [1e-4, -1e-4])
def test_far_solutions_are_found(k4):
    def effect(a):
        return k4 * a**4

    a = np.array([-11.0, -8.0, 0.0, 5.0, 11.0])
    target = a + 1e-5 * a**2 + effect(a)
    assert invert_with(effect, target, 1.0, 1e-5, 0.0) == pytest.approx(a, abs=1e-7)


def test_what_has_no_solution_is_not_a_number():
    found = invert_with(lambda a: -1e-4 * a**4, np.array([12.0, np.nan, np.inf]), 1.0, 0.0, 0.0)
    assert np.isnan(found).all()  # at most 10.2 at 13.6 g


def test_no_effect_changes_nothing():
    target = np.linspace(-1.5, 1.5, 31)
    found = invert_with(np.zeros_like, target, 1.001, 1e-4, -1e-5)
    assert found == pytest.approx(invert(target, 1.001, 1e-4, -1e-5), abs=1e-12)


def test_the_edges_of_a_dead_zone_are_found():
    """Within it the right side stands nearly still, and at its edges it has a kink."""
    tilt, width = 1.15e-3, 5e-5
    steps = np.linspace(-1e-6, 1e-6, 1001)
    zone = np.concatenate([steps - width, 50.0 * steps, steps + width]) - tilt

    def effect(a):
        return -np.clip(a + tilt, -width, width)

    def forward(a):
        return 1.00002 * a + 1.05e-4 * a**2 + 1e-4 * a**3 + effect(a)

    found = invert_with(effect, forward(zone), 1.00002, 1.05e-4, 1e-4)
    assert np.abs(forward(found) - forward(zone)).max() < 1e-9
