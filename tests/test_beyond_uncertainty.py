"""What a report says that U does not count is said wherever its numbers are used."""

import warnings
from dataclasses import replace

import pytest

import accelcal
from accelcal.results.beyond_uncertainty import beyond_uncertainty
from accelcal.simulation import TumblePlan

BREAKS_ELSEWHERE = (
    "does not follow its bilinear law: a curvature, another break, or an undeclared shift from run"
    " to run; its values and slopes are less certain than U says"
)
UNKNOWN_HEAD = "head error neither declared nor visible at these angles: the intervals leave it out"


def of_a_break_at_20_degc(seed=4):
    """A calibration about T0 = 0 of a unit whose laws break at 20 degC."""
    record = accelcal.simulate(plan=TumblePlan(temperatures=(0.0, 40.0, 80.0, -40.0)), seed=seed)
    return accelcal.fit(record, reference_temperature=0.0)


def of_an_unknown_head(positions=6):
    plan = TumblePlan(positions=positions, temperatures=(20.0,))
    record = accelcal.simulate(plan=plan, seed=1).with_apparatus(head_uncertainty=None)
    return accelcal.fit(record)


CASES = [(of_a_break_at_20_degc, BREAKS_ELSEWHERE), (of_an_unknown_head, UNKNOWN_HEAD)]


@pytest.fixture(params=CASES, ids=["law", "head"])
def case(request):
    fitted, said = request.param
    calibration = fitted()
    return accelcal.Calibration.from_json(calibration.to_json()), said


def told(function):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        function()
    return [str(each.message) for each in caught]


def is_said(texts, said):
    return any(said in " ".join(text.split()) for text in texts)


def test_apply_warns(case):
    calibration, said = case
    assert is_said(told(lambda: accelcal.apply(calibration, [1.35], 20.0, a_p=0.0)), said)


def test_coefficients_warn(case):
    calibration, said = case
    assert is_said(told(lambda: accelcal.coefficients_at(calibration, 20.0)), said)


def test_a_budget_says_it(case):
    calibration, said = case
    found = accelcal.budget(calibration, 1.0, temperature=20.0)
    assert is_said(found.warnings, said)
    assert is_said([str(found)], said)


@pytest.mark.parametrize("form", ["h", "yaml", "csv"])
def test_an_export_warns_and_holds_it(case, form, tmp_path):
    calibration, said = case
    path = tmp_path / f"unit.{form}"
    assert is_said(told(lambda: calibration.export(path)), said)
    if form == "h":
        lines = [line.strip(" */") for line in path.read_text("utf-8").splitlines()]
        assert is_said([" ".join(lines)], said)


def test_a_verdict_says_it(case):
    calibration, said = case
    limit = accelcal.Limit("bias", "mg", maximum=5.0)
    verdict = accelcal.judge(calibration, accelcal.Specification("AL-15", (limit,)))
    assert is_said(verdict.notes, said)
    assert is_said([str(verdict)], f"note: {verdict.notes[-1]}")
    assert is_said([verdict._repr_html_()], said)
    judged = accelcal.Calibration.from_json(replace(calibration, verdict=verdict).to_json())
    assert judged.verdict == verdict


def test_laws_that_are_not_used_say_nothing():
    calibration = of_a_break_at_20_degc()
    run = calibration.tables[0].run
    assert told(lambda: accelcal.apply(calibration, [1.35], 0.0, a_p=0.0, run=run)) == []
    assert beyond_uncertainty(calibration, calibration.tables, by_laws=False) == []


def test_what_u_counts_is_said_in_the_report_alone():
    calibration = accelcal.fit(accelcal.simulate(seed=1))
    assert calibration.warnings
    assert beyond_uncertainty(calibration, calibration.tables, by_laws=True) == []


def test_what_else_an_effect_may_be_is_in_u_and_not_said_where_its_numbers_are_used():
    """Of an error of a head position another one explains the readings as well."""
    hidden = [accelcal.effect("position-error").of(1.4e-4, at=45.0)]
    record = accelcal.simulate(effects=hidden, seed=0)
    calibration = accelcal.fit(record, model=accelcal.discover(record))
    assert is_said(calibration.warnings, "U counts what else the effects may be")
    said = told(lambda: accelcal.coefficients_at(calibration, 20.0))
    assert not is_said(said, "what else")


def test_a_verdict_says_which_checks_warn_and_what_is_in_no_interval():
    curved = [accelcal.effect("fourth-order").of(3e-4)]
    record = accelcal.simulate(effects=curved, seed=1)
    limit = accelcal.Limit("bias", "mg", maximum=5.0)
    sheet = accelcal.Specification("AL-15", (limit,))
    verdict = accelcal.judge(accelcal.fit(record), sheet)
    assert is_said(verdict.notes, "checks of the calibration warn, lack of fit")
    alone = accelcal.simulate(plan=TumblePlan(temperatures=(20.0,)), seed=1)
    undeclared = alone.with_apparatus(launch_uncertainty=None, launch_sf_uncertainty=None)
    notes = accelcal.judge(accelcal.fit(undeclared), sheet).notes
    assert is_said(notes, "includes no shift from launch to launch")
