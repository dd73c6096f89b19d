"""Tests compared before they are made: uncertainties, hours, what is hidden, what is impossible."""

import csv
import dataclasses
import io
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

import accelcal
from accelcal.errors import DesignError, InputError
from accelcal.model import SLOPES
from accelcal.planning.compare import POSITIONS, design_of
from accelcal.planning.pace import Pace, hours_of, strokes_within
from accelcal.planning.prediction import AT_T0, figures, forecasts, visibility
from accelcal.planning.targets import target_value
from accelcal.simulation import AL15, NoiseComponents, TumblePlan, simulate

COEFFICIENTS = ("K0", "K1", "K2", "K3", "M", "M_ip")
PURE_NOISE = NoiseComponents(5e-6, 0.0, 0.0, 0.0, 0.0)
ONE_STROKE = {"K0": 0.61, "K1": 1.54, "K2": 0.93, "K3": 1.86, "M": 0.50, "M_ip": 1.00}
"""Uncertainty over the noise of a reading: one stroke of 9 readings on 8 positions."""


STAND = NoiseComponents()


def sizes(plan, noise=STAND, **options):
    """Standard uncertainties by name, in the first mounting."""
    found = forecasts(plan, noise, AL15, **options)
    return {f.name: f.standard_uncertainty for f in reversed(found)}


def compared(**options):
    return accelcal.design(effects=False, **options)


# -- uncertainties ---------------------------------------------------------------------------------


def test_one_stroke_of_pure_noise_is_what_theory_says():
    plan = TumblePlan(strokes=1, temperatures=(20.0,))
    found = sizes(plan, PURE_NOISE)
    assert {k: round(found[k] / 5e-6, 2) for k in COEFFICIENTS} == pytest.approx(
        ONE_STROKE, abs=0.0051
    )


def test_strokes_average_noise_but_not_the_head():
    noise, head = PURE_NOISE, NoiseComponents(1e-9, 2e-5, 0.0, 0.0, 0.0)
    few, many = (TumblePlan(strokes=n, temperatures=(20.0,)) for n in (2, 8))
    for kind, ratio in ((noise, 2.0), (head, 1.0)):
        one, other = (sizes(plan, kind) for plan in (few, many))
        found = [one[name] / other[name] for name in COEFFICIENTS]
        assert found == pytest.approx([ratio] * len(COEFFICIENTS), rel=1e-3)


def test_more_positions_average_the_head():
    head = NoiseComponents(1e-6, 2e-5, 0.0, 0.0, 0.0)
    eight, thirty_two = (sizes(TumblePlan(positions=n), head) for n in (8, 32))
    assert eight["K0"] / thirty_two["K0"] == pytest.approx(2.0, rel=0.02)


def test_launches_rule_the_slopes_of_the_bias():
    noise = NoiseComponents(1e-9, 0.0, 2e-5, 0.0, 0.0)
    assert sizes(TumblePlan(), noise)["lam1"] == pytest.approx(
        math.sqrt(2.0) * 2e-5 / 60.0, rel=1e-3
    )


def test_repeated_launches_make_the_bias_at_t0_surer():
    noise = NoiseComponents(1e-6, 0.0, 2e-5, 0.0, 0.0)
    once, thrice = (
        sizes(TumblePlan(strokes=2, temperatures=(*(20.0,) * n, 80.0, -40.0)), noise)
        for n in (1, 3)
    )
    assert once["k0 at T0"] / thrice["k0 at T0"] == pytest.approx(3.0**0.5, rel=0.01)
    assert once["K0"] == pytest.approx(thrice["K0"], rel=1e-3)


def test_parts_add_up_and_name_the_largest():
    for f in forecasts(TumblePlan(), NoiseComponents(temperature=0.05), AL15):
        whole = math.hypot(*f.budget.values())
        assert whole == pytest.approx(f.standard_uncertainty, rel=1e-9)
        assert f.budget[f.mostly_from] == max(f.budget.values())
        assert f.floor <= f.standard_uncertainty * (1.0 + 1e-9)


def test_parts_are_those_of_the_fit():
    noise = NoiseComponents(temperature=0.05)
    record = simulate(noise=noise, seed=3)
    table = accelcal.fit(record).tables[0]
    found = {f.name: f for f in reversed(forecasts(TumblePlan(), noise, AL15))}
    for source, size in table.budget["K1"].items():
        # the reading noise of the fit is estimated from 45 degrees of freedom
        near = 0.3 if source == "reading" else 0.05
        assert found["K1"].budget[source] * 1.35 == pytest.approx(size, rel=near)


def test_predictions_are_the_scatter_of_simulated_tests():
    plan = TumblePlan(strokes=2)
    noise = NoiseComponents(temperature=0.02)
    values = []
    for seed in range(150):
        found = figures(accelcal.fit(simulate(plan=plan, noise=noise, seed=seed)))
        values.append(
            [f.value / (1.35 if n.startswith("K1") else 1.0) for (n, _), f in found.items()]
        )
    scatter = np.std(values, axis=0, ddof=1)
    foreseen = [f.standard_uncertainty for f in forecasts(plan, noise, AL15)]
    # a standard deviation of 150 is uncertain by 5.8 %; none of 20 is off by 25 % once in 1000
    np.testing.assert_allclose(scatter, foreseen, rtol=0.25)


def test_resolution_counts():
    coarse = TumblePlan(temperatures=(20.0,), resolution=5e-5)
    found = {f.name: f for f in forecasts(coarse, NoiseComponents(), AL15)}
    assert found["K2"].mostly_from == "resolution"


def test_a_level_alone_foresees_the_error_of_the_temperature_by_the_nominal_slopes():
    noise = NoiseComponents(temperature=0.1)
    found = {f.name: f for f in forecasts(TumblePlan(temperatures=(20.0,)), noise, AL15)}
    assert found["K1"].budget["temperature"] == pytest.approx(0.1 * 500e-6, rel=1e-3)
    (told,) = compared(positions=[8], strokes=[2], temperatures=[(20.0,)], noise=noise).designs
    assert any("no slopes" in note for note in told.notes)


def test_degrees_of_freedom_of_an_estimated_head():
    plan = TumblePlan(temperatures=(20.0,))
    declared, estimated = (
        {f.name: f for f in forecasts(plan, NoiseComponents(), AL15, declared=d)}
        for d in (True, False)
    )
    assert declared["K2"].expanded_uncertainty < 2.05 * declared["K2"].standard_uncertainty
    assert 2.0 < estimated["K2"].dof < 4.0
    assert estimated["K2"].expanded_uncertainty > 3.0 * estimated["K2"].standard_uncertainty
    assert estimated["K0"].expanded_uncertainty is None  # nothing tells the launches


# -- what cannot be had ----------------------------------------------------------------------------


def test_four_positions_lose_what_theory_says():
    found = design_of(TumblePlan(positions=4), NoiseComponents(), Pace())
    assert found.forecast("K3") is None
    assert found.forecast("M_ip") is None
    assert found.forecast("K1").stands_for == "K1 + K3"
    assert found.lost[0].startswith("K3 cannot be told apart from K1")


def test_a_sum_is_on_no_front_and_meets_no_target():
    found = compared(positions=[4, 8], strokes=[6], targets={"K1": 9e-6})
    assert found.designs[0].forecast("K1").standard_uncertainty < 9e-6
    assert found.front("K1") == (1,)
    assert found.meeting() == (1,)
    assert compared(positions=[4, 8], strokes=[6], targets={"K1": "9 ppm"}) == found


def test_effects_that_positions_show():
    hidden = {
        n: {
            v.id
            for v in visibility(TumblePlan(positions=n), NoiseComponents(), AL15)
            if v.absorbed_by
        }
        for n in (8, 12)
    }
    assert hidden[8] - hidden[12] == {"odd-quadratic"}
    assert "head-eccentricity" in hidden[12]
    eight = {v.id: v for v in visibility(TumblePlan(), NoiseComponents(), AL15)}
    assert eight["fourth-order"].aliases == ("scale-factor-asymmetry",)
    assert eight["fourth-order"].smallest == pytest.approx(6.8e-5, rel=0.1)


def test_without_replicates_a_note_says_that_nothing_can_be_found():
    (found,) = accelcal.design(positions=[8], strokes=[2]).designs
    assert found.effects == ()
    assert "no effect can be searched for" in found.notes[0]
    assert found.is_blind


def test_a_note_that_speaks_of_no_effect_is_not_one_of_a_blind_test():
    compared = accelcal.design(positions=[8], strokes=[2])
    note = "a soak of an hour has no effect here"
    (test,) = compared.designs
    told = dataclasses.replace(test, notes=(note,))
    assert not told.is_blind
    text = str(dataclasses.replace(compared, designs=(told,)))
    assert f"note: {note}" in text
    assert "for want of replicates" not in text
    assert "for want of replicates" in str(compared)


# -- hours -----------------------------------------------------------------------------------------


def test_hours_count_every_action():
    plan = TumblePlan(strokes=2, temperatures=(20.0, 80.0), mountings=("o+", "p+"))
    only = {"reading": 1e-3, "turn": 0.0, "soak": 0.0, "mount": 0.0}
    actions = {"turn": 4 * 17 / 3600.0, "soak": 4, "mount": 2}
    for name, hours in actions.items():
        assert hours_of(plan, Pace(**{**only, name: 1.0})) == pytest.approx(hours, rel=2e-3)
    assert hours_of(plan, Pace(3600.0, 0.0, 0.0, 0.0)) == plan.readings == 72


def test_a_second_reading_at_an_angle_takes_no_turn():
    one, two = (TumblePlan(angles=a, strokes=1) for a in ((0.0, 90.0), (0.0, 0.0, 90.0, 90.0)))
    turning = Pace(1e-3, 3600.0, 0.0, 0.0)
    assert hours_of(one, turning) == pytest.approx(hours_of(two, turning), abs=1e-4)


@pytest.mark.parametrize("hours", [8.5, 10.0, 12.0, 30.0])
def test_strokes_fill_the_hours(hours):
    plan, pace = TumblePlan(), Pace()
    most = strokes_within(plan, pace, hours)
    assert most % 2 == 0
    assert hours_of(replace(plan, strokes=most), pace) <= hours
    assert hours_of(replace(plan, strokes=most + 2), pace) > hours


def test_the_hours_of_a_test_allow_it():
    """Rounding takes no cycle of strokes away."""
    pace = Pace(reading=50.0, turn=20.0, soak=1.1, mount=0.7)
    plans = [TumblePlan(strokes=n) for n in range(2, 60, 2)]
    found = [strokes_within(plan, pace, hours_of(plan, pace)) for plan in plans]
    assert found == [plan.strokes for plan in plans]


def test_hours_leave_longer_tests_out():
    found = compared(hours=9.0)
    assert {d.positions for d in found.designs} < set(POSITIONS)
    assert max(d.hours for d in found.designs) <= 9.0


# -- targets and bad input -------------------------------------------------------------------------


def test_the_quickest_test_that_meets_the_targets_comes_first():
    found = compared(positions=[6, 8, 12, 24], targets={"K1": 9e-6, "M": 3e-6})
    first = found.designs[found.meeting()[0]]
    assert first.hours == min(
        d.hours
        for d in found.designs
        if d.forecast("K1").standard_uncertainty <= 9e-6
        and d.forecast("M").standard_uncertainty <= 3e-6
    )
    assert f"Book {first.label}" in str(found)
    assert "the quickest of these with u(K1) <= 9.00 ppm, u(M) <= 3.00 urad" in str(found)


@pytest.mark.parametrize("strokes", [2, 4])
def test_a_test_to_book_of_one_cycle_is_said_to_be_too_short_to_discover_effects(strokes):
    found = compared(positions=[24], strokes=[strokes], targets={"K1": 9e-6})
    assert ("ppm; discover needs two cycles" in str(found)) is (strokes == 2)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (
            {"targets": {"K0": 4e-6}},
            "launch makes 6.7; repeat runs, or make this error smaller",
        ),
        ({"targets": {"K2": 1e-6}}, "head makes"),
        (
            {"targets": {"K1": 1e-6}},
            "target K1=1ppm cannot be reached with this stand: 8.37 ppm is",
        ),
        ({"targets": {"K7": 1e-6}}, "coefficient 'K7' is unknown; choose from K0"),
        ({"targets": {"K1": 0.0}}, "an uncertainty is a number above zero"),
        ({"targets": {"delta0": 1e-6}}, "delta0 cannot be told by any of these tests"),
        ({"hours": 5.0}, "soaks and mountings alone take 7 h"),
        ({"hours": 7.2}, "fits into 7.2 h; allow 8.4 h or more, or fewer positions"),
        ({"positions": []}, "no test to compare"),
        ({"positions": [8], "strokes": [10**4]}, "at most 50000 are foreseen"),
        ({"noise": NoiseComponents(reading=0.0)}, "noise of a reading is 0"),
        ({"targets": {"gam1": 1e-9}}, "of which reading makes"),
        ({"resolution": -1.0}, "resolution is -1.0; it is 0 or more"),
        ({"mountings": [("q",)]}, "mounting 'q' is unknown"),
    ],
)
def test_bad_questions_have_one_clear_line(options, told):
    with pytest.raises(InputError) as error:
        compared(**{"positions": [8], **options})
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_a_test_that_does_not_determine_the_scale_factor_is_refused():
    with pytest.raises(DesignError, match="do not determine the scale factor K1"):
        compared(positions=[], angles=[(80.0, 280.0)], strokes=[2])


@pytest.mark.parametrize("name", ["reading", "turn", "soak", "mount"])
def test_negative_times_are_refused(name):
    with pytest.raises(InputError, match=f"time of a {name} is -1"):
        Pace(**{name: -1.0})


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("K1", "5ppm", 5e-6),
        ("K1", "0.001 %", 1e-5),
        ("K2", "2 ug/g^2", 2e-6),
        ("k3", "2 ug/g3", 2e-6),
        ("k0", "0.1mg", 1e-4),
        ("K0", "2 \u00b5g", 2e-6),
        ("M", "1arcsec", 4.848e-6),
        ("delta0", "5 Bogensekunden", 5 * 4.848e-6),
        ("M_ip", "3e-6", 3e-6),
        ("lam1", "0.1ug/degC", 1e-7),
        ("beta2", "1 ppm/degC", 1e-6),
        ("beta1", "1 ppm/K", 1e-6),
        ("lam1", "0.1 ug/°C", 1e-7),
        ("K2", "1 ug/g²", 1e-6),
        ("gam1", "0.1urad/degC", 1e-7),
        ("k0 at T0", "2ug", 2e-6),
    ],
)
def test_targets_have_units(name, text, value):
    assert target_value(name, text) == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize("text", ["", "ppm", "-1ppm", "5 furlong", "1e999", "nan", "0", "1.2.3"])
def test_what_is_no_uncertainty_is_refused(text):
    with pytest.raises(InputError, match="K1 is relative; write a number above zero with %, ppm"):
        target_value("K1", text)


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("M", "1%", "M is in rad; write a number above zero with rad, mrad"),
        ("delta", "2ug", "delta is in rad; write"),
        ("k0", "5ppm", "k0 is in g; write a number above zero with g, mg, ug, ng or none"),
        ("K2", "5urad", r"K2 is in g/g\^2; write .* as in K2=2ug/g\^2"),
        ("K2", "5ug/degC", r"K2 is in g/g\^2"),
        ("K1", "1arcsec", "K1 is relative; write"),
        ("lam1", "2ug/g^2", "lam1 is in g/degC; write .* as in lam1=2ug/degC"),
        ("beta1", "1ug/degC", "beta1 is in 1/degC; write"),
        ("delta0", "1 %", "delta0 is in rad; write"),
        ("K7", "1ppm", "coefficient 'K7' is unknown"),
    ],
)
def test_a_target_in_a_unit_of_something_else_is_refused(name, text, told):
    """M=1% was taken for 0.01 rad."""
    with pytest.raises(InputError, match=told):
        target_value(name, text)
    with pytest.raises(InputError, match=told):
        compared(positions=[8], targets={name: text})


# -- results ---------------------------------------------------------------------------------------


def test_fronts_are_not_beaten():
    found = compared(positions=[6, 8, 12], strokes=[2, 6])
    front = found.front("K2")
    hours = [found.designs[i].hours for i in front]
    values = [found.designs[i].forecast("K2").standard_uncertainty for i in front]
    assert hours == sorted(hours)
    assert values == sorted(values, reverse=True)
    for i, design in enumerate(found.designs):
        if i not in front:
            u = design.forecast("K2").standard_uncertainty
            assert any(h <= design.hours and v <= u for h, v in zip(hours, values, strict=True))


def test_document_rows_and_frame_agree():
    found = compared(positions=[8], strokes=[2, 6])
    document = json.loads(found.to_json())
    assert document["schema"] == "accelcal/design/1"
    rows = found.rows()
    assert len(rows) == sum(len(d["forecasts"]) for d in document["designs"])
    assert list(found.to_frame().columns) == list(rows[0])
    names = {row["coefficient"] for row in rows}
    assert names == {*COEFFICIENTS, *SLOPES, *AT_T0, "k0", "k2", "k3", "delta", "delta_ip"}


def test_rows_tell_the_angles_of_tests_that_have_no_number_of_positions():
    """Rows of two lists of angles were told apart by nothing."""
    angles = [[0, 45, 90, 180, 270], [0, 60, 90, 180, 270]]
    options = {"strokes": (2,), "temperatures": (20.0,), "effects": False}
    frame = accelcal.design(positions=(), angles=angles, **options).to_frame()
    assert frame["angles"].unique().tolist() == ["0 45 90 180 270", "0 60 90 180 270"]
    assert frame["positions"].dtype == "float64"
    assert frame["angles"].dtype == frame["stands_for"].dtype  # of which no cell has a text


def test_lists_of_as_many_angles_have_names_of_their_own():
    """Both were '5 angles x 2', and what cannot be told apart was told of the last one alone."""
    angles = [[0, 90, 180, 270], [0, 45, 180, 270], [0, 90, 180]]
    options = {"temperatures": (20.0,), "effects": False}
    found = accelcal.design(positions=[4], angles=angles, strokes=(2,), **options)
    names = ["4 x 2", "4 angles (1) x 2", "4 angles (2) x 2", "3 angles x 2"]
    assert [test.label for test in found.designs] == names
    assert "4 angles (2): 0, 45, 180, 270 deg\n" in str(found)
    assert re.findall(r"^  (4 angles.*):$", str(found), re.M) == ["4 angles (1)", "4 angles (2)"]
    assert accelcal.DesignComparison.from_json(found.to_json()) == found
    few = accelcal.design(positions=[], angles=angles, strokes=(2,), hours=3.15, **options)
    assert [test.label for test in few.designs] == ["3 angles x 2"]
    assert re.findall(r"4 angles \(\d\) x 2", few.notes[0]) == names[1:3]


def test_reversal_frees_the_fixture_angle():
    (found,) = compared(positions=[8], strokes=[2], mountings=[("o+", "o-")]).designs
    assert found.forecast("delta0").mounting == "o"
    assert found.forecast("M", "o-") is not None


def test_text_answers_with_one_table_a_kind():
    text = str(accelcal.design(positions=[4, 8], strokes=[6]))
    assert "K1 stands for K1 + K3" in text
    assert "8 x 6" in text
    assert "odd-quadratic" in text
    undeclared = str(compared(positions=[8], strokes=[6], declare=False))
    assert "Expanded uncertainty U (95 %)" in undeclared


@pytest.mark.parametrize("few", [{"positions": [2, 3]}, {"positions": [], "angles": [(0, 90)]}])
def test_few_positions_have_a_table_too(few):
    text = str(compared(strokes=[2], **few))
    assert "cannot be told apart" in text or "leaves no trace" in text


def test_csv_of_rows_is_readable():
    rows = compared(positions=[8], strokes=[2]).rows()
    text = io.StringIO()
    writer = csv.DictWriter(text, rows[0])
    writer.writeheader()
    writer.writerows(rows)
    assert len(text.getvalue().splitlines()) == len(rows) + 1


def test_tests_that_take_too_long_are_named():
    """They were left out without a word, as if there were no others."""
    found = accelcal.design(positions=[4, 8, 12], hours=8.0, effects=False)
    assert [one.label for one in found.designs] == ["4 x 2"]
    told = ("left out, as it takes more than 8 h: 8 x 2 (8.325 h), 12 x 2 (8.925 h)",)
    assert found.notes == told
    assert f"note: {told[0]}" in " ".join(str(found).split())
    assert accelcal.DesignComparison.from_json(found.to_json()) == found
    assert accelcal.design(positions=[4], hours=8.0, effects=False).notes == ()


def test_of_several_runs_it_is_told_which_one_the_coefficients_are_of():
    told = "K0 to M_ip are those of one run in each mounting, the nearest to T0"
    for levels in ((20.0,), (20.0, 80.0)):
        text = str(
            accelcal.design(positions=(8,), strokes=(2,), temperatures=levels, effects=False)
        )
        assert (told in text) == (len(levels) > 1)
