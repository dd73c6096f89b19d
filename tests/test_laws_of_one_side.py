"""Levels near T0 on the side where no slope is measured."""

import pytest

import accelcal

NOTHING = accelcal.NoiseComponents(reading=2e-6, head=0.0, launch=0.0, launch_sf=0.0)


def laws(temperatures, *, T0=20.0, fitted="readings", seed=1):
    record = accelcal.simulate(
        plan=accelcal.TumblePlan(temperatures=temperatures), noise=NOTHING, seed=seed
    )
    return accelcal.fit(record, reference_temperature=T0, temperature_laws=fitted)


@pytest.mark.parametrize("fitted", ["tables", "readings"])
@pytest.mark.parametrize(
    ("temperatures", "side"), [((24.0, -40.0), "above"), ((16.0, 80.0), "below")]
)
def test_a_level_beyond_t0_counts_the_slope_of_the_other_side_as_doubtful(
    temperatures, side, fitted
):
    """The value at T0 was 40 U off, as a slope of the other side is 8 % off."""
    found = laws(temperatures, fitted=fitted).temperature_model
    truth = accelcal.AL15.scale_factor.at_T0
    at_T0 = found.K1.at_T0
    assert abs(at_T0.value - truth) <= at_T0.expanded_uncertainty
    slope = next(q for q in (found.K1.above, found.K1.below) if q is not None)
    told = truth * abs(slope.value) * 4.0  # all of the slope, over 4 degC
    assert at_T0.expanded_uncertainty == pytest.approx(told, rel=0.1)
    said = [w for w in found.warnings if f"lies {side} T0 = 20 degC, where no slope" in w]
    assert len(said) == 1


@pytest.mark.parametrize("temperatures", [(20.5, -40.0), (23.0, 80.0), (24.0, -40.0, 80.0)])
def test_others_are_as_sure_as_before(temperatures):
    found = laws(temperatures, fitted="tables").temperature_model
    assert found.K1.at_T0.expanded_uncertainty < 2e-5
    assert not any("where no slope" in warning for warning in found.warnings)


def test_at_a_measured_level_nothing_is_taken_over():
    found = laws((24.0, -40.0), T0=24.0, fitted="tables").temperature_model
    assert found.K1.at_T0.expanded_uncertainty < 2e-5
