"""Coefficients at a temperature between the levels of a calibration."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

import accelcal
from accelcal.error_budget.budget import budget
from accelcal.numerics.probability import student_quantile
from accelcal.stand_uncertainty.budget import accelerometer_of

NAMES = ("k0", "K1", "delta")
ALL = ("k0", "K1", "k2", "k3", "delta", "delta_ip")


@pytest.fixture(scope="module")
def calibration():
    return accelcal.fit(accelcal.simulate(seed=1))


def by_hand(calibration, name, temperature):
    """Value and standard uncertainty from the laws of the document alone."""
    model = calibration.temperature_model
    law, rise = getattr(model, name), temperature - calibration.T0_degC
    side = "above" if rise > 0.0 else "below"
    at_T0, slope = law.at_T0.value, getattr(law, side).value
    pair = [model.covariance_names.index(f"{name} {part}") for part in ("at_T0", side)]
    covariance = np.array(model.covariance_matrix)[np.ix_(pair, pair)]
    if name == "K1":
        value, jacobian = at_T0 * (1.0 + slope * rise), np.array([1.0 + slope * rise, at_T0 * rise])
    else:
        value, jacobian = at_T0 + slope * rise, np.array([1.0, rise])
    return value, np.sqrt(jacobian @ covariance @ jacobian)


@pytest.mark.parametrize("laws", ["tables", "readings"])
@pytest.mark.parametrize("temperature", [-40.5, -10.0, 35.0, 80.0])
def test_values_and_uncertainties_follow_from_the_laws(laws, temperature):
    calibration = accelcal.fit(accelcal.simulate(seed=1), temperature_laws=laws)
    found = accelcal.coefficients_at(calibration, temperature)
    for name in NAMES:
        told = (found[name].value, found[name].standard_uncertainty)
        assert told == pytest.approx(by_hand(calibration, name, temperature), rel=1e-9)


def test_three_levels_give_back_their_tables(calibration):
    for table in calibration.tables:
        found = accelcal.coefficients_at(calibration, table.temperature_degC)
        own = {**table.error_model, "K1": table.coefficients["K1"]}
        for name in NAMES:
            assert found[name].unit == own[name].unit
            assert found[name].value == pytest.approx(own[name].value, rel=1e-9)
            assert found[name].expanded_uncertainty == pytest.approx(
                own[name].expanded_uncertainty, rel=0.02
            )


@pytest.mark.filterwarnings("ignore:checks of the calibration warn")  # some do by chance
def test_intervals_hold_the_truth_between_the_levels():
    """Of 100 units times 3 coefficients 95 % are 285; 270 and 297 are four standard deviations."""
    held, law = 0, accelcal.AL15.scale_factor
    truth = {
        "k0": accelcal.AL15.bias.at_T0 + 15.0 * accelcal.AL15.bias.above,
        "K1": law.at_T0 * (1.0 + 15.0 * law.above),
        "delta": accelcal.AL15.misalignment.at_T0 + 15.0 * accelcal.AL15.misalignment.above,
    }
    for seed in range(100):
        found = accelcal.coefficients_at(accelcal.fit(accelcal.simulate(seed=seed)), 35.0)
        held += sum(
            abs(found[name].value - truth[name]) <= found[name].expanded_uncertainty
            for name in NAMES
        )
    assert 270 <= held <= 297


def test_outside_is_refused(calibration):
    with pytest.raises(accelcal.InputError, match=r"90 degC is more than 1 degC outside"):
        accelcal.coefficients_at(calibration, 90.0)
    with pytest.warns(accelcal.AccelcalWarning, match="outside"):
        found = accelcal.coefficients_at(calibration, 90.0, extrapolate=True)
    assert found["K1"].value == pytest.approx(by_hand(calibration, "K1", 90.0)[0])


@pytest.mark.parametrize("bad", ["35", None, float("nan"), [35.0]])
def test_a_temperature_is_a_number(calibration, bad):
    with pytest.raises(accelcal.InputError, match="temperature"):
        accelcal.coefficients_at(calibration, bad)


def test_one_level_is_good_there_only():
    record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0,)), seed=1)
    calibration = accelcal.fit(record)
    found = accelcal.coefficients_at(calibration, 20.5)
    assert found["K1"].value == calibration.tables[0].coefficients["K1"].value
    with pytest.raises(accelcal.InputError, match="20 degC only"):
        accelcal.coefficients_at(calibration, 35.0)
    with pytest.warns(accelcal.AccelcalWarning, match="20 degC only"):
        far = accelcal.coefficients_at(calibration, 35.0, extrapolate=True)
    assert far["K1"].value == found["K1"].value
    assert [far[name].standard_uncertainty for name in ALL] == [None] * 6  # no slope is known
    assert (far.covariance_names, far.covariance.shape) == ((), (0, 0))


def test_noise_of_one_degree_of_freedom_leaves_the_mean_of_runs_one():
    """Half of it was taken off the whole: Student's factor came to 1.96."""
    angle = np.concatenate([np.arange(7), np.arange(6)]) * 360.0 / 7.0
    known = ("head_uncertainty", "launch_uncertainty", "launch_sf_uncertainty")
    columns = {
        "temperature": np.full(13, 20.0),
        "run": np.repeat(["1", "2"], [7, 6]),
        "angle": angle,
        "stroke": np.ones(13, dtype=int),
        "output": np.cos(np.radians(angle)) + np.random.default_rng(1).normal(0.0, 5e-6, 13),
    }
    calibration = accelcal.fit(accelcal.read_arrays(columns, overrides=dict.fromkeys(known, 0.0)))
    assert accelcal.coefficients_at(calibration, 20.0)["k0"].dof == pytest.approx(1.0)


def test_several_runs_at_one_level_count_by_their_mean():
    plan = accelcal.TumblePlan(temperatures=(20.0, 20.0, 20.0))
    calibration = accelcal.fit(accelcal.simulate(plan=plan, seed=2))
    mean = accelcal.coefficients_at(calibration, 20.0)  # without a warning
    biases = [table.error_model["k0"] for table in calibration.tables]
    assert mean["k0"].value == pytest.approx(np.mean([k0.value for k0 in biases]), rel=1e-3)
    assert mean["k0"].standard_uncertainty < 0.8 * min(k0.standard_uncertainty for k0 in biases)
    for table in calibration.tables:
        found = accelcal.coefficients_at(calibration, 20.0, run=table.run)
        assert found["K1"].value == table.coefficients["K1"].value
        assert found["k0"].value == table.error_model["k0"].value


@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
def test_the_mean_of_runs_has_the_freedom_of_all_repeats():
    """Of four it had one degree of freedom in place of three, and the one apart most weight."""
    record = accelcal.simulate(
        plan=accelcal.TumblePlan(temperatures=4 * (20.0,)), seed=2, declare=False
    )
    apart = 1e-3 * record.output.max() * (record.run == 3)
    calibration = accelcal.fit(replace(record, output=record.output + apart))
    biases = np.array([table.error_model["k0"].value for table in calibration.tables])
    mean = accelcal.coefficients_at(calibration, 20.0)["k0"]
    assert mean.dof == pytest.approx(3.0, rel=0.02)
    assert mean.expanded_uncertainty == pytest.approx(
        mean.standard_uncertainty * student_quantile(0.95, mean.dof), rel=1e-6
    )
    assert mean.standard_uncertainty == pytest.approx(biases.std(ddof=1) / 2.0, rel=0.05)
    assert mean.value == pytest.approx(biases.mean(), rel=5e-3)


@pytest.mark.parametrize("temperatures", [(20.0, 24.0), (20.0, 21.0, 22.01)])
def test_runs_without_laws_at_two_levels_have_no_mean(temperatures):
    """Apply refused them, and the budget and the twin took the run nearest to T0."""
    record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=temperatures), seed=2)
    calibration = accelcal.fit(record)
    assert "Mean of runs" not in str(calibration)
    for of in (
        lambda: accelcal.coefficients_at(calibration, 20.0),
        lambda: accelcal.apply(calibration, 1.3, 20.0),
        lambda: budget(calibration, 1.0),
        lambda: accelerometer_of(calibration),
    ):
        with pytest.raises(accelcal.InputError, match="have no mean; choose one run or"):
            of()


@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
def test_both_sides_without_a_fixture_angle_have_no_mean_and_a_mounting_helps():
    """They are of one level and tell the same, so that nothing of what was said was so."""
    plan = accelcal.TumblePlan(temperatures=(20.0,), mountings=("o+", "o-"))
    record = accelcal.simulate(plan=plan, seed=2)
    calibration = accelcal.fit(record, coefficients=("K0", "K1", "K2", "K3"))
    with pytest.raises(accelcal.InputError, match=r"both sides of an axis.* run or mounting"):
        accelcal.coefficients_at(calibration, 20.0)
    (table,) = calibration.of_mounting("o-").tables
    found = accelcal.coefficients_at(calibration.of_mounting("o-"), 20.0)
    assert found["K1"].value == table.coefficients["K1"].value


def test_the_noise_of_each_run_averages_out_in_their_mean():
    """It counted as common to the runs: U of a mean of four was that of one."""
    noise = accelcal.NoiseComponents(reading=5e-5, head=0.0, launch=0.0, launch_sf=0.0)
    plan = accelcal.TumblePlan(temperatures=4 * (20.0,), strokes=2)
    record = accelcal.simulate(plan=plan, noise=noise, seed=2)
    stand = accelcal.Apparatus(head_uncertainty=0, launch_uncertainty=0, launch_sf_uncertainty=0)
    calibration = accelcal.fit(replace(record, apparatus=stand))
    mean, runs = accelcal.coefficients_at(calibration, 20.0), calibration.tables
    for name in ("k0", "k2", "k3", "delta", "delta_ip"):
        each = np.array([table.error_model[name].standard_uncertainty for table in runs])
        expected = pytest.approx(np.sqrt((each**2).sum()) / 4.0, rel=1e-3)
        assert mean[name].standard_uncertainty == expected


@pytest.mark.filterwarnings("ignore::accelcal.AccelcalWarning")
@pytest.mark.parametrize("clamped", [(0.0, 0.0), (0.0, 90.0)])
def test_runs_of_several_clampings_are_named_where_their_mean_counts_the_head_as_common(clamped):
    record = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0, 20.0)), seed=1)
    record = replace(record, clamping=np.take(clamped, record.run))
    told = " ".join(accelcal.fit(record).warnings)
    assert ("clamped at 0 and 90 deg on the head" in told) is (clamped == (0.0, 90.0))


def test_the_mean_of_runs_in_both_mountings_is_that_of_one_side():
    plan = accelcal.TumblePlan(temperatures=(20.0, 20.0), mountings=("o+", "o-"))
    calibration = accelcal.fit(accelcal.simulate(plan=plan, seed=2))
    mean = accelcal.coefficients_at(calibration, 20.0)
    own = [table.error_model["k0"].value for table in calibration.tables[:2]]
    assert mean["k0"].value == pytest.approx(np.mean(own), rel=1e-3)
    free = calibration.fixture_angle[0].misalignments[0]
    assert mean["delta"].value == pytest.approx(free.value, rel=1e-6)


def test_a_run_of_several_levels_has_no_slopes(calibration):
    with pytest.raises(accelcal.InputError, match="for 80 degC only"):
        accelcal.coefficients_at(calibration, 70.0, run=2)
    with pytest.warns(accelcal.AccelcalWarning, match="80 degC only"):
        far = accelcal.coefficients_at(calibration, 70.0, run=2, extrapolate=True)
    assert [far[name].standard_uncertainty for name in NAMES] == [None] * 3


@pytest.mark.filterwarnings("ignore:checks of the calibration warn")  # as K3 is left out
@pytest.mark.parametrize("mounting", ["o+", "p+"])
@pytest.mark.parametrize(("fitted", "lost"), [(("K0", "K1"), "delta"), (("K1", "M"), "k0")])
def test_what_was_not_determined_has_no_value(mounting, fitted, lost):
    plan = accelcal.TumblePlan(temperatures=(20.0,), mountings=(mounting,))
    calibration = accelcal.fit(accelcal.simulate(plan=plan, seed=1), coefficients=fitted)
    with pytest.warns(accelcal.AccelcalWarning, match="not determined"):
        found = accelcal.coefficients_at(calibration, 20.0)
    assert [name for name in NAMES if found[name].value is None] == [lost]
    assert found[lost].standard_uncertainty is None
    fitted = [name for name in ALL if found[name].value is not None]
    assert list(found.covariance_names) == fitted
    assert found.covariance.shape == (2, 2)


def test_an_uncertainty_that_is_unknown_spoils_only_what_depends_on_it(calibration):
    """Without the slopes' uncertainties k0 has that of its law at T0, and none elsewhere."""
    model = calibration.temperature_model
    above = replace(model.k0.above, standard_uncertainty=None, expanded_uncertainty=None, dof=None)
    laws = replace(model, k0=replace(model.k0, above=above), covariance_names=())
    holed = replace(calibration, temperature_model=replace(laws, covariance_matrix=()))
    told = model.k0.at_T0.standard_uncertainty
    at_T0 = accelcal.coefficients_at(holed, calibration.T0_degC)["k0"]
    assert at_T0.standard_uncertainty == pytest.approx(told, rel=1e-9)
    assert accelcal.coefficients_at(holed, 35.0)["k0"].standard_uncertainty is None
    assert accelcal.coefficients_at(holed, 35.0)["K1"].standard_uncertainty is not None
    measured = accelcal.apply(holed, [1.35, 1.36], temperature=[calibration.T0_degC, 35.0])
    assert np.isnan(measured.standard_uncertainty).tolist() == [False, True]


def test_unit_of_a_table_without_one():
    record = replace(accelcal.simulate(seed=1), unit=None)
    calibration = accelcal.fit(record)
    unit = calibration.tables[0].coefficients["K1"].unit
    assert accelcal.coefficients_at(calibration, 35.0)["K1"].unit == unit


def test_effects_that_were_taken_out_are_told():
    hidden = [accelcal.effect("k2-temperature").of(3e-6)]
    record = accelcal.simulate(effects=hidden, seed=1)
    calibration = accelcal.fit(record, model=accelcal.discover(record))
    with pytest.warns(accelcal.AccelcalWarning, match="k2-temperature|temperature dependence"):
        accelcal.coefficients_at(calibration, 35.0)


def test_result_is_pickled_and_copied(calibration):
    """Its own method made a plain dictionary, without the covariance."""
    found = accelcal.coefficients_at(calibration, 35.0)
    pickled = pickle.loads(pickle.dumps(found))
    for other in (pickled, copy.deepcopy(found), copy.copy(found), found.copy()):
        assert isinstance(other, accelcal.CoefficientsAt)
        assert other == found
        assert other.covariance_names == found.covariance_names
        assert other.covariance_matrix == found.covariance_matrix
    with pytest.raises(TypeError, match="stays as it is"):
        found["k0"] = found["K1"]
    assert type(dict(found)) is type(found | {}) is dict


def test_of_a_run_it_gives_all_coefficients_of_the_table(calibration):
    for table in calibration.tables:
        found = accelcal.coefficients_at(calibration, table.temperature_degC, run=table.run)
        assert tuple(found) == found.covariance_names == ALL
        for name in ALL:
            own = table.quantities[name]
            assert found[name].value == own.value
            assert found[name].unit == own.unit
            assert found[name].standard_uncertainty == pytest.approx(own.standard_uncertainty)


@pytest.mark.parametrize("laws", ["tables", "readings"])
@pytest.mark.parametrize("temperature", [-10.0, 20.0, 35.0])
def test_covariance_carries_the_uncertainty_of_a_measured_acceleration(laws, temperature):
    """Through the derivatives of (2), without the cross axis, as `apply` has it on its own."""
    calibration = accelcal.fit(accelcal.simulate(seed=1), temperature_laws=laws)
    found = accelcal.coefficients_at(calibration, temperature)
    own = [quantity.standard_uncertainty for quantity in found.values()]
    assert np.sqrt(np.diagonal(found.covariance)) == pytest.approx(own, rel=1e-12)
    k0, K1, k2, k3 = (found[name].value for name in ALL[:4])
    for a in (-0.7, 0.3, 1.0):
        seen = k0 + a + k2 * a**2 + k3 * a**3
        slope = 1.0 + 2.0 * k2 * a + 3.0 * k3 * a**2
        jacobian = np.array([1.0, seen / K1, a**2, a**3, 0.0, 0.0]) / slope
        measured = accelcal.apply(calibration, K1 * seen, temperature, same_launch=True)
        assert measured.value == pytest.approx(a, rel=1e-12)
        u = np.sqrt(jacobian @ found.covariance @ jacobian)
        assert measured.standard_uncertainty == pytest.approx(u, rel=1e-9)


def test_a_table_of_them(calibration):
    found = accelcal.coefficients_at(calibration, 35.0)
    frame = found.to_frame().set_index("coefficient")
    assert list(frame.index) == list(found)
    assert frame.loc["K1", ["value", "unit"]].tolist() == [found["K1"].value, "mA/g"]
    assert frame.attrs["units"]["expanded_uncertainty"] == "unit"
    assert str(found).split("\n")[1] == f"K1: {found['K1']}"
    html = found._repr_html_()
    assert f"<td>K1</td>\n      <td>{found['K1']}</td>" in html
