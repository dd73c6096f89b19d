"""Both sides of an axis: the fixture angle apart from the misalignment, and what uses it."""

import dataclasses

import numpy as np
import pytest

import accelcal
from accelcal.compensate.choice import compensation
from accelcal.error_budget.budget import budget
from accelcal.export.content import export_content
from accelcal.specification import Limit, Specification
from accelcal.verdict.judge import judge

DELTA0, DELTA = 1e-3, 1.15e-3  # the misalignment of the simulation at 20 degC
BOTH = ("o+", "o-")
QUIET = accelcal.NoiseComponents(reading=0.0, head=0.0, launch=0.0, launch_sf=0.0)


def record(seed=1, **changes):
    """Readings with a fixture angle that the fit is not told."""
    plan = accelcal.TumblePlan(**{"mountings": BOTH, "delta0": DELTA0, **changes})
    noise = QUIET if seed is None else accelcal.NoiseComponents()
    found = accelcal.simulate(plan=plan, noise=noise, seed=seed or 0)
    return dataclasses.replace(found, metadata={})


@pytest.fixture(scope="module")
def reversed_fit():
    return accelcal.fit(record())


def test_exact_readings_give_both_angles_back():
    """To first order in delta0: 0.75 k3 delta0 of 0.065 urad is left."""
    (found,) = accelcal.fit(record(seed=None)).fixture_angle
    assert found.angle.value == pytest.approx(DELTA0, abs=1e-7)
    misalignments = dict(zip(found.temperatures, found.misalignments, strict=True))
    assert misalignments[20.0].value == pytest.approx(DELTA, abs=2e-9)


def test_an_angle_of_degrees_is_no_tangent():
    """By tangents in place of angles it was 14 urad too large at 2 deg, with U of 5 urad."""
    (found,) = accelcal.fit(record(seed=None, delta0=0.035)).fixture_angle
    assert found.angle.value == pytest.approx(0.035, abs=3e-6)
    free = dict(zip(found.temperatures, found.misalignments, strict=True))[20.0]
    assert free.value == pytest.approx(DELTA, abs=1e-7)
    law = accelcal.fit(record(seed=None, delta0=0.035)).temperature_model.delta.at_T0
    assert law.value == pytest.approx(free.value, abs=1e-9)


def test_tables_stay_effective_and_laws_are_free(reversed_fit):
    plus, minus = (
        next(t for t in reversed_fit.tables if t.mounting == side and t.temperature_degC == 20.0)
        for side in BOTH
    )
    assert plus.error_model["delta"].value == pytest.approx(DELTA - DELTA0, abs=1e-4)
    assert minus.error_model["delta"].value == pytest.approx(DELTA + DELTA0, abs=1e-4)
    mean = (plus.error_model["delta"].value + minus.error_model["delta"].value) / 2.0
    assert reversed_fit.temperature_model.delta.at_T0.value == pytest.approx(mean, abs=1e-6)


def test_an_angle_taken_as_given_counts(reversed_fit):
    (given,) = accelcal.fit(record(), delta0=4e-4).fixture_angle
    (free,) = reversed_fit.fixture_angle
    assert given.angle.value == pytest.approx(free.angle.value, abs=1e-7)
    assert given.misalignments[0].value == pytest.approx(free.misalignments[0].value, abs=1e-7)


def test_the_head_leaves_the_misalignment_and_stays_in_the_angle(reversed_fit):
    (found,) = reversed_fit.fixture_angle
    of_a_side = reversed_fit.tables[0].error_model["delta"].standard_uncertainty
    assert found.misalignments[0].standard_uncertainty < 0.5 * of_a_side
    assert found.angle.standard_uncertainty == pytest.approx(of_a_side, rel=0.3)


@pytest.mark.parametrize("temperature_laws", ["tables", "readings"])
def test_errors_are_as_large_as_told(temperature_laws):
    """Root mean square of error over standard uncertainty, of 40 records."""
    scores = []
    for seed in range(40):
        fit = accelcal.fit(record(seed=seed + 1), temperature_laws=temperature_laws)
        angle, delta = fit.fixture_angle[0].angle, fit.temperature_model.delta.at_T0
        scores.append(
            (
                (angle.value - DELTA0) / angle.standard_uncertainty,
                (delta.value - DELTA) / delta.standard_uncertainty,
            )
        )
    size = np.sqrt(np.mean(np.square(scores), axis=0))
    assert (size > 0.7).all()
    assert (size < 1.35).all()


def test_one_side_tells_no_angle():
    assert accelcal.fit(record(mountings=("o+",))).fixture_angle == ()
    assert accelcal.fit(record(mountings=("o+", "p-"))).fixture_angle == ()


def test_document_keeps_the_angle(reversed_fit):
    assert accelcal.Calibration.from_json(reversed_fit.to_json()) == reversed_fit
    (part,) = reversed_fit.to_document()["fixture_angle"]
    assert (part["axis"], part["unit"], len(part["misalignment"])) == ("o", "rad", 3)
    assert "Fixture angle apart from the misalignment, mountings o+ and o-" in str(reversed_fit)


def test_all_who_use_a_calibration_use_the_free_misalignment(reversed_fit):
    free = reversed_fit.temperature_model.delta.at_T0.value
    assert free == pytest.approx(DELTA, abs=1e-5)
    assert compensation(reversed_fit).cross.delta.at_T0 == free
    parts = {p.symbol: p for p in budget(reversed_fit, 0.0, a_p=1.0).components}
    assert parts["delta_O"].value[0] == free
    rows = {row["symbol"]: row["value"] for row in export_content(reversed_fit)["coefficients"]}
    assert rows["delta_O"] == free


def test_the_verdict_judges_the_free_misalignment(reversed_fit):
    """2150 urad of the side - are the fixture's; the misalignment of 1150 urad passes."""
    limits = Specification("mounting", (Limit("misalignment", "urad", maximum=2000.0),))
    assert judge(reversed_fit, limits).outcome == "pass"


def test_one_level_is_split_as_well():
    fit = accelcal.fit(record(temperatures=(20.0,)))
    (found,) = fit.fixture_angle
    assert compensation(fit).cross.delta.at_T0 == found.misalignments[0].value
    u = np.sqrt(compensation(fit).covariance[4][4])
    assert u == pytest.approx(found.misalignments[0].standard_uncertainty)
    parts = {p.symbol: p for p in budget(fit, 0.0, a_p=1.0).components}
    assert parts["delta_O"].value[0] == found.misalignments[0].value


@pytest.mark.parametrize("step", [0.5, 1.0])
def test_both_sides_met_a_level_that_is_one_to_the_launches(step):
    """A step of just 1 degC was one level to the launches, and two to the fixture angle."""
    found = record(temperatures=(20.0,))
    warmer = found.temperature + step * (found.mounting == "o-")
    (angle,) = accelcal.fit(dataclasses.replace(found, temperature=warmer)).fixture_angle
    assert angle.temperatures == (20.0 + step / 2.0,)


def test_slopes_of_the_second_axis_are_used():
    fit = accelcal.fit(record(seed=None, mountings=("o+", "p+"), delta0=0.0))
    found = compensation(fit)
    assert found.other.delta.above.determined
    assert not any("same at all temperatures" in text for text in found.assumptions)
    laws = fit.second_axis_model.delta
    at_80 = next(t for t in fit.tables if t.mounting == "p+" and t.temperature_degC == 80.0)
    assert found.other.delta.at_T0 + 60.0 * found.other.delta.above.value == pytest.approx(
        at_80.error_model["delta"].value, abs=1e-9
    )
    parts = {p.symbol: p for p in budget(fit, 0.0, a_o=1.0, temperature=80.0).components}
    assert parts["gam_P"].value[0] == pytest.approx(60.0 * laws.above.value)


def test_a_second_axis_of_one_level_says_what_is_assumed():
    whole = record(mountings=("o+", "p+"))
    kept = (whole.mounting == "o+") | (np.abs(whole.temperature - 20.0) < 1.0)
    found = compensation(accelcal.fit(whole.select(kept)))
    assert (
        "delta_P, by which a_o acts, was measured at 20 degC only, and is taken to be the same at"
        " all temperatures"
    ) in found.assumptions


# -- four mountings, and clampings -----------------------------------------------------------------


@pytest.fixture(scope="module")
def four():
    return accelcal.fit(record(mountings=("o+", "o-", "p+", "p-"), temperatures=(20.0,)))


def test_four_mountings_tell_both_misalignments_and_couplings(four):
    o, p = four.fixture_angle
    assert (o.axis, p.axis) == ("o", "p")
    for found in (o, p):
        assert abs(found.angle.value - DELTA0) < 2.0 * found.angle.expanded_uncertainty
        assert abs(found.misalignments[0].value - DELTA) < 2e-6
        sides = [t.error_model["delta_ip"] for t in four.tables if t.mounting[0] == found.axis]
        mean = sum(side.value for side in sides) / 2.0
        assert found.couplings[0].value == pytest.approx(mean, abs=1e-7)
        assert found.couplings[0].standard_uncertainty < sides[0].standard_uncertainty
        assert found.couplings[0].unit == "g/g^2"


def test_the_covariance_holds_the_uncertainties(four):
    for found in four.fixture_angle:
        assert found.covariance_names == ("delta0", "delta_1", "delta_ip_1")
        told = (found.angle, *found.misalignments, *found.couplings)
        sizes = [quantity.standard_uncertainty for quantity in told]
        np.testing.assert_allclose(np.sqrt(np.diagonal(found.covariance)), sizes, rtol=1e-9)


def test_coupling_is_free_of_the_fixture_angle():
    """On one side -2 k2 delta0 is in delta_ip."""
    exact = record(seed=None, delta0=0.02, temperatures=(20.0,))
    fit = accelcal.fit(exact)
    plain = accelcal.fit(record(seed=None, delta0=0.0, temperatures=(20.0,)))
    (found,), (free,) = fit.fixture_angle, plain.fixture_angle
    one_side = fit.tables[0].error_model["delta_ip"].value
    k2 = plain.tables[0].error_model["k2"].value
    assert one_side - free.couplings[0].value == pytest.approx(-2.0 * k2 * 0.02, rel=0.1)
    assert found.couplings[0].value == pytest.approx(free.couplings[0].value, abs=2e-7)


def test_ieee_1293_turns_the_sign_of_one_misalignment(four):
    o, p = four.fixture_angle
    assert set(o.ieee_1293()) == {"delta_o", "K_ip"}
    assert o.ieee_1293(20.0)["delta_o"].value == o.misalignments[0].value
    assert set(p.ieee_1293()) == {"delta_p", "K_io"}
    assert p.ieee_1293()["delta_p"].value == -p.misalignments[0].value
    assert p.ieee_1293()["K_io"] == p.couplings[0]


def test_all_comes_back_from_json_and_is_printed(four):
    again = accelcal.Calibration.from_json(four.to_json())
    assert again.fixture_angle == four.fixture_angle
    assert "cross-coupling" in str(four)
    assert "delta_io" in str(four)


def test_an_old_document_has_no_couplings(four):
    document = four.fixture_angle[0].to_document()
    for key in ("cross_coupling", "covariance", "clamping_deg"):
        del document[key]
    found = type(four.fixture_angle[0]).from_document(document)
    assert found.couplings == ()
    assert set(found.ieee_1293()) == {"delta_o"}


def test_each_clamping_has_a_fixture_angle_of_its_own():
    """Two visits, the fixture askew by other angles on other graduations."""
    first = record(seed=1, temperatures=(20.0,))
    second = record(seed=2, temperatures=(20.0,), delta0=-2e-3)
    n = len(first)
    both = dataclasses.replace(
        first,
        **{
            name: np.concatenate([getattr(first, name), getattr(second, name)])
            for name in ("output", "angle", "temperature", "stroke", "mounting", "position")
        },
        time=None,
        line=None,
        run=np.concatenate([first.run, second.run + len(first.run_labels)]),
        run_labels=tuple(f"run {i}" for i in range(2 * len(first.run_labels))),
        clamping=np.repeat([0.0, 90.0], n),
    )
    found = accelcal.fit(both).fixture_angle
    assert [item.clamping_deg for item in found] == [0.0, 90.0]
    for item, truth in zip(found, (DELTA0, -2e-3), strict=True):
        assert abs(item.angle.value - truth) < 2.0 * item.angle.expanded_uncertainty


@pytest.mark.parametrize("asked", [("K0", "K1", "M"), ("K0", "K1", "M", "M_ip")])
def test_couplings_are_told_where_they_were_estimated(asked):
    plan = accelcal.TumblePlan(temperatures=(20.0,), mountings=("o+", "o-"))
    (found,) = accelcal.fit(accelcal.simulate(plan=plan, seed=1), coefficients=asked).fixture_angle
    assert ("delta_ip_1" in found.covariance_names) is ("M_ip" in asked)
