"""Plausible mistakes of a notebook: each refused in a line that says what makes the right thing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import accelcal
from accelcal import (
    InputError,
    Limit,
    Quantity,
    Specification,
    StabilityRecord,
    TriadRecord,
    TumblePlan,
)

PATH = "examples/al15.csv"
RECORD = accelcal.simulate(plan=TumblePlan(temperatures=20.0, strokes=2), seed=1)
SECOND = accelcal.simulate(plan=TumblePlan(temperatures=20.0, strokes=2), seed=2)
CALIBRATION = accelcal.fit(RECORD)
FRAME = RECORD.to_frame()
DATA_SHEET = Specification("AL-15", (Limit("bias", "mg", maximum=5.0),))
STABILITY = accelcal.analyse(accelcal.read_stability("examples/stability.csv"))
TURN = accelcal.accelerations([0, 45])

WRONG = {
    "a path": PATH,
    "a Path": Path(PATH),
    "None": None,
    "a number": 3.5,
    "a list": [1, 2],
    "a mapping": {"K1": 1.3},
    "a frame": FRAME,
    "a record": RECORD,
    "a calibration": CALIBRATION,
    "records": [RECORD, RECORD],
}

FUNCTIONS = {
    "accelerations": (accelcal.accelerations, {"a number", "a list"}),
    "analyse": (accelcal.analyse, set()),
    "apply": (accelcal.apply, {"a calibration"}, [1.0]),
    "coefficients_at": (accelcal.coefficients_at, {"a calibration"}, 20.0),
    "batch": (accelcal.batch, {"a path", "a Path"}),
    "budget": (accelcal.budget, {"a calibration"}, 0.0),
    "calibrate_head": (accelcal.calibrate_head, {"a record", "records"}),
    "calibrate_triad": (accelcal.calibrate_triad, set()),
    "compare": (accelcal.compare, {"a calibration"}, RECORD),
    "compare_calibrations": (accelcal.compare_calibrations, {"a calibration"}, CALIBRATION),
    "design": (accelcal.design, set()),
    "design_matrix": (accelcal.design_matrix, set()),
    "discover": (accelcal.discover, {"a record"}),
    "discover_stand": (accelcal.discover_stand, {"records"}),
    "distribution": (accelcal.distribution, set()),
    "effect": (accelcal.effect, set()),
    "estimate_tables": (accelcal.estimate_tables, set(), [0, 45, 90]),
    "fit": (accelcal.fit, {"a record"}),
    "fleet_history": (accelcal.fleet_history, set()),
    "history": (accelcal.history, set()),
    "judge": (accelcal.judge, {"a calibration"}, DATA_SHEET),
    "output": (accelcal.output, {"a mapping"}, TURN),
    "position_angles": (accelcal.position_angles, {"a list"}),
    "random_part": (accelcal.random_part, {"a calibration"}),
    "read_arrays": (accelcal.read_arrays, {"a frame"}),
    "read_calibration": (accelcal.read_calibration, set()),
    "read_discovery": (accelcal.read_discovery, set()),
    "read_effects": (accelcal.read_effects, set()),
    "read_head": (accelcal.read_head, set()),
    "read_specification": (accelcal.read_specification, set()),
    "read_stability": (accelcal.read_stability, set()),
    "read_stand": (accelcal.read_stand, set()),
    "read_table": (accelcal.read_table, {"a path", "a Path"}),
    "read_tables": (accelcal.read_tables, {"a path", "a Path"}),
    "read_triad": (accelcal.read_triad, set()),
    "register": (accelcal.register, set()),
    "simulate": (accelcal.simulate, set()),
    "stand_budget": (accelcal.stand_budget, set(), RECORD),
    "twin": (accelcal.twin, set()),
    "unregister": (accelcal.unregister, set()),
    "write_batch": (accelcal.write_batch, {"a path", "a Path"}, "results.csv"),
    "write_table": (accelcal.write_table, {"a record"}, "table.csv"),
    "Calibration.from_json": (accelcal.Calibration.from_json, set()),
}
"""Function -> itself, what it takes of `WRONG`, and its other arguments."""

WITHOUT = {"catalogue", "optimal_design"}
"""Functions whose first argument is nothing of that kind."""


def refusal_of(function, *arguments, **options):
    with pytest.raises(accelcal.AccelcalError) as caught:
        function(*arguments, **options)
    text = str(caught.value)
    assert "\n" not in text
    return text


def given_to(function, value, *rest):
    """Only keywords are taken by the design, the first of which is the positions."""
    if function is accelcal.design:
        return function(positions=value, temperatures="x", effects=False)
    return function(value, *rest)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_is_something_else_is_refused_in_a_line(name):
    function, taken, *rest = FUNCTIONS[name]
    for kind in WRONG.keys() - taken:
        refusal_of(given_to, function, WRONG[kind], *rest)


def test_every_public_function_is_tried():
    public = {name for name in accelcal.__all__ if name[0].islower()}
    assert {name for name in FUNCTIONS if "." not in name} | WITHOUT == public


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: accelcal.fit(PATH), "str in place of a record; make one by accelcal.read_table"),
        (lambda: accelcal.fit(None), "None in place of a record"),
        (lambda: accelcal.twin(CALIBRATION), "Calibration in place of a discovery; make one by"),
        (lambda: accelcal.fit(RECORD, model=CALIBRATION), "Calibration in place of a discovery"),
        (lambda: accelcal.compare(RECORD, CALIBRATION), "TumbleRecord in place of a calibration"),
        (lambda: accelcal.stand_budget("s.toml", RECORD), "str in place of a stand; make one by"),
        (lambda: accelcal.compare(CALIBRATION, RECORD, same_head="no"), "same_head is 'no'; it is"),
        (lambda: accelcal.history("results.csv"), "str in place of calibrations; give those of"),
        (lambda: accelcal.calibrate_triad("x.csv"), "str in place of a record of a triad; make"),
        (lambda: accelcal.calibrate_head(FRAME), "DataFrame in place of a record; make one by"),
        (lambda: accelcal.design_matrix([0, 45]), "list in place of accelerations; make them by"),
        (lambda: accelcal.output(CALIBRATION, TURN), "Calibration in place of coefficients; give"),
        (lambda: accelcal.read_table(FRAME), "DataFrame in place of a table; give its path"),
        (
            lambda: accelcal.read_table(FRAME),
            "a DataFrame of a tumble test goes to accelcal.read_arr",
        ),
        (lambda: accelcal.write_table(RECORD, None), "None in place of a path; give the name"),
        (lambda: accelcal.effect(None), "None in place of the id of an effect, such as 'backlash'"),
        (
            lambda: accelcal.simulate(effects=[accelcal.effect("backlash")]),
            "Effect in place of an effect with its size; make one by accelcal.effect",
        ),
        (
            lambda: accelcal.accelerations([0.0], mounting=CALIBRATION),
            "mounting 'Calibration of serial AL-15, <simulat...' is unknown; it is one of o+,",
        ),
        (lambda: accelcal.apply(CALIBRATION, "x.csv"), "output is 'x.csv'; it is a number or an"),
        (lambda: accelcal.apply(CALIBRATION, [1, 2], a_p=[1, 2, 3]), "shapes (2,), (), (3,); give"),
        (lambda: accelcal.discover(RECORD, alpha="x"), "alpha is 'x'; it is a finite number"),
        (lambda: accelcal.discover(RECORD, max_effects=1.5), "max_effects is 1.5; it is a whole"),
        (lambda: accelcal.fit(RECORD, delta0="x"), "delta0 is 'x'; it is a finite number"),
        (
            lambda: accelcal.fit(RECORD, reference_temperature="20"),
            "reference_temperature is '20'; it is a finite",
        ),
        (lambda: accelcal.position_angles([1, np.nan]), "position nan is outside the turn"),
        (lambda: accelcal.design(hours="10"), "hours is '10'; it is a finite number"),
        (lambda: accelcal.design(targets=["K1"]), "list in place of targets; give a mapping"),
        (lambda: accelcal.optimal_design("K2", hours=9, seed=1.5), "seed is 1.5; it is a whole"),
        (lambda: accelcal.Accelerometer(bias=3e-3), "float in place of a law of temperature"),
        (lambda: accelcal.distribution("normal", standard="x"), "standard is 'x'; it is a finite"),
        (lambda: accelcal.distribution("normal", standard=1.0, dof="x"), "dof is 'x'; it is a"),
        (
            lambda: accelcal.distribution("normal", half_width=1.0, coverage="95 %"),
            "coverage is '95 %'; it is a finite number",
        ),
        (
            lambda: accelcal.distribution("normal", half_width=1.0, factor=0.0),
            "factor is 0.0; it is above 0",
        ),
        (lambda: accelcal.Apparatus(head_uncertainty="x"), "head_uncertainty is 'x'; it is a"),
        (lambda: Limit("bias", "mg", maximum="5"), "bias: maximum is '5'; it is a finite number"),
        (lambda: Limit("bias", 5, maximum=5), "unit is 5; it is a text, in quotes"),
        (lambda: Specification(None, DATA_SHEET.limits), "name is None; it is a text, in quotes"),
        (lambda: accelcal.Disturbance("hysteresis", {}), "str in place of an effect; make one by"),
        (
            lambda: accelcal.Disturbance(accelcal.effect("hysteresis"), {"half_with": 2e-5}),
            "hysteresis has no parameter 'half_with'; it has half_width",
        ),
        (
            lambda: accelcal.Disturbance(accelcal.effect("hysteresis"), {}),
            "hysteresis: half_width is missing; it is needed [g]",
        ),
        (
            lambda: accelcal.random_part(CALIBRATION, STABILITY),
            "the stability test is in mA in place of g; analyse it with the scale factor",
        ),
    ],
)
def test_the_line_says_what_makes_the_right_thing(call, told):
    assert told in refusal_of(call)


@pytest.mark.parametrize("name", ["output_uncertainty", "temperature_uncertainty"])
@pytest.mark.parametrize("value", [-1.0, np.nan, "x", None])
def test_an_uncertainty_that_is_none(name, value):
    assert f"{name} is " in refusal_of(accelcal.apply, CALIBRATION, [1.0], **{name: value})


def test_a_seed_of_a_frame_is_that_of_the_whole_number():
    record = accelcal.simulate(seed=1)
    assert accelcal.simulate(seed=1.0) == record
    assert accelcal.discover(record, seed=1.0) == accelcal.discover(record, seed=1)
    stand = accelcal.read_stand("examples/paper-stand.toml")
    found = [accelcal.stand_budget(stand, RECORD, trials=n, seed=n) for n in (2000, 2000.0)]
    assert found[0] == found[1]


def test_a_number_of_a_frame_counts_threads_processes_and_effects():
    outputs, angles = np.tile(RECORD.output[:9], (20_000, 1)), RECORD.angle[:9]
    alone = accelcal.estimate_tables(outputs, angles)
    assert accelcal.estimate_tables(outputs, angles, threads=2.0) == alone
    assert accelcal.batch([PATH], jobs=2.0) == accelcal.batch([PATH])
    hidden = accelcal.simulate(effects=[accelcal.effect("hysteresis").of(2e-5)], seed=3)
    found = [accelcal.discover(hidden, max_effects=most) for most in (2, 2.0)]
    assert found[0] == found[1]


# -- plans -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("plan", "told"),
    [
        ({"positions": 1}, "positions is 1; it is a whole number, 2 or more"),
        ({"positions": 2.5}, "positions is 2.5; it is a whole number, 2 or more"),
        ({"positions": "8"}, "positions is '8'; it is a whole number, 2 or more"),
        ({"positions": 1e9}, "a test of 18000000018 readings; at most 1000000"),
        ({"strokes": 0}, "strokes is 0; it is a whole number, 1 or more"),
        ({"strokes": 1e9}, "a test of 27000000000 readings; at most 1000000"),
        ({"temperatures": (20.0,) * 30_000}, "a test of 1620000 readings; at most 1000000"),
        ({"temperatures": []}, "temperatures is empty; a test has one or more"),
        ({"temperatures": [1e300]}, "temperature 1 is 1e+300; a temperature of a test is from"),
        ({"angles": ["x"]}, "angle 1 is 'x'; it is a finite number"),
        ({"mountings": "o"}, "mounting 'o' is unknown"),
        ({"resolution": 1e-300}, "resolution is 1e-300; it is 1e-30 or more"),
        ({"resolution": -1}, "resolution is -1; it is 0 or more"),
    ],
)
def test_a_plan_that_is_none(plan, told):
    assert told in refusal_of(TumblePlan, **plan)


def test_a_plan_takes_lists_arrays_and_single_values():
    plan = TumblePlan(angles=np.arange(0, 360, 60), temperatures=20.0, mountings="o+", strokes=2.0)
    assert plan == TumblePlan(
        angles=(0, 60, 120, 180, 240, 300), temperatures=(20.0,), mountings=("o+",), strokes=2
    )
    assert len(accelcal.simulate(plan=plan, seed=1)) == plan.readings == 12


def test_a_design_takes_a_flat_list_as_one_choice():
    flat = accelcal.design(
        positions=8, strokes=2, temperatures=[20, 80], mountings="o+", effects=False
    )
    nested = accelcal.design(
        positions=[8], strokes=[2], temperatures=[[20, 80]], mountings=[["o+"]], effects=False
    )
    assert flat.to_document() == nested.to_document()


# -- what is taken ---------------------------------------------------------------------------------


def test_one_record_is_a_list_of_one():
    alone = accelcal.calibrate_head(RECORD)
    assert alone.to_document() == accelcal.calibrate_head([RECORD]).to_document()


def test_one_coefficient_is_a_list_of_one():
    alone = accelcal.fit(RECORD, coefficients="K1")
    assert alone.to_document() == accelcal.fit(RECORD, coefficients=["K1"]).to_document()


def test_a_frame_of_three_columns_is_a_triad():
    rows = np.random.default_rng(1).normal(size=(30, 3))
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    of_frame = accelcal.calibrate_triad(pd.DataFrame(rows, columns=["x", "y", "z"]))
    assert of_frame.to_document() == accelcal.calibrate_triad(rows).to_document()


def test_the_refusal_of_a_value_is_an_input_error():
    with pytest.raises(InputError):
        accelcal.simulate(seed="a")


def test_a_masked_reading_is_missing():
    angles = 45.0 * np.arange(9)
    outputs = np.array([1.3 * np.cos(np.deg2rad(angles)) + 0.004])
    masked = np.ma.masked_array(outputs, mask=[[True, *[False] * 8]])
    masked.data[0, 0] = 99.0
    found = accelcal.estimate_tables(masked, angles)
    assert found.dof.tolist() == [2]
    assert found.coefficients[0, 1] == pytest.approx(1.3)


def test_complex_readings_are_refused():
    with pytest.raises(InputError, match="output is list; it is a number or an array of numbers"):
        accelcal.estimate_tables([[1j] * 9], 45.0 * np.arange(9))


# -- parts of results, made by hand ----------------------------------------------------------------

LAUNCH = accelcal.Launch("1", [0.0, 1.0, 2.0], [0.1, 0.2, 0.1])
ROWS = np.eye(3)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Quantity("1.35", 1e-6, "g"), "value is '1.35'; it is a finite number"),
        (lambda: Quantity(np.nan, None, "g"), "value is nan; it is a finite number"),
        (lambda: Quantity(1.0, -1e-6, "g"), "standard_uncertainty is -1e-06; it is 0 or more"),
        (lambda: Quantity(1.0, None, "g", np.inf), "expanded_uncertainty is inf; it is a finite"),
        (lambda: Quantity(1.0, None, "g", None, -1), "dof is -1; it is 0 or more"),
        (lambda: Quantity(1.0, 1e-6, None), "unit is None; it is a text, in quotes"),
        (lambda: TriadRecord(ROWS, notes="one"), "notes is 'one'; it is a tuple of texts"),
        (lambda: TriadRecord(ROWS, notes=(1,)), "notes has 1; it is a tuple of texts"),
        (lambda: StabilityRecord(LAUNCH, notes=None), "notes is None; it is a tuple of texts"),
    ],
)
def test_a_part_that_is_none_is_refused(make, told):
    with pytest.raises(InputError) as caught:
        make()
    assert str(caught.value).startswith(told)


# -- methods of results ----------------------------------------------------------------------------

HEAD = accelcal.calibrate_head([RECORD])
TRIAD = accelcal.calibrate_triad(accelcal.read_triad("examples/triad.csv"))


@pytest.mark.parametrize("value", [None, "x", {}, object(), Path("x")])
def test_a_method_refuses_what_is_no_number(value):
    assert "graduations is " in refusal_of(HEAD.at, value)
    assert "graduations is " in refusal_of(HEAD.spread_over, value)
    assert "output is " in refusal_of(TRIAD.accelerations, value)


def test_a_head_takes_a_list_or_one_position_and_not_what_is_none():
    errors, covariance = HEAD.at([0.0, 45.0])
    assert (errors.shape, covariance.shape) == ((2,), (2, 2))
    assert HEAD.at(45)[0] == errors[1]
    assert "head position nan deg is not among" in refusal_of(HEAD.at, [np.nan])


def test_a_calibration_tells_the_misalignment_of_its_tables():
    told = refusal_of(CALIBRATION.misalignment, 20.0)
    assert told == "float in place of a table of a calibration; give one of calibration.tables"


def test_a_budget_names_its_coefficients():
    budget = accelcal.stand_budget(accelcal.read_stand("examples/paper-stand.toml"), RECORD)
    assert "symbol 'K9' is unknown; choose from " in refusal_of(budget.contribution, "K9")
    assert set(budget.contribution("K1")) == {part.name for part in budget.components}


def test_an_array_without_an_axis_is_its_only_item():
    assert TumblePlan(temperatures=np.array(20.0)).temperatures == (20.0,)
    assert accelcal.fit(RECORD, coefficients=np.array("K1")).tables[0].covariance_names == ("K1",)
    with pytest.raises(InputError, match="float in place of a record"):
        accelcal.calibrate_head(np.array(1.0))


@pytest.mark.parametrize(
    "call",
    [
        lambda: accelcal.fit(RECORD, reference_temperature=293.15),
        lambda: accelcal.discover(RECORD, reference_temperature=293.15),
        lambda: accelcal.discover_stand([RECORD, SECOND], reference_temperature=293.15),
        lambda: accelcal.Accelerometer(reference_temperature=293.15),
        lambda: replace(RECORD, reference_temperature=293.15),
        lambda: accelcal.read_arrays(
            RECORD.to_frame(), overrides={"reference_temperature": 293.15}
        ),
        lambda: TumblePlan(temperatures=[293.15]),
    ],
)
def test_a_temperature_in_kelvin_is_refused(call):
    """`discover` named temperature effects that the readings do not have."""
    with pytest.raises(InputError, match=r"is 293\.15; a temperature of a test is from -200"):
        call()


def test_a_record_in_kelvin_is_refused():
    with pytest.raises(InputError, match=r"temperature 293\.15 is no temperature of a test, from"):
        TriadRecord(np.eye(3), np.eye(3), temperature=[293.15] * 3)
    with pytest.raises(InputError, match=r"launch 2: temperature 293\.15 is no temperature of a"):
        accelcal.Launch("2", [0.0, 1.0, 2.0], [1.0] * 3, temperature=[293.15] * 3)
    with pytest.raises(InputError, match=r"temperature 293\.15 in a record; it is from -200"):
        replace(RECORD, temperature=RECORD.temperature + 273.15)


@pytest.mark.parametrize(
    "call",
    [
        lambda: accelcal.accelerations([0.0], delta0=45.0),
        lambda: accelcal.estimate_tables(np.ones((2, 9)), np.arange(9) * 45.0, delta0=45.0),
    ],
)
def test_a_fixture_angle_in_degrees_is_refused(call):
    with pytest.raises(InputError, match="45 rad is above pi/4; give it in rad, 45 deg are"):
        call()


def test_a_level_or_t0_of_a_unit_is_a_number():
    for make in (
        lambda: TumblePlan(temperatures=[None]),
        lambda: accelcal.Accelerometer(reference_temperature=None),
    ):
        with pytest.raises(InputError, match=r"temperature(| 1) is None; it is a finite number"):
            make()


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: accelcal.apply(CALIBRATION, [1.3, "1.2"]), "output has '1.2'; it is a number or"),
        (
            lambda: accelcal.apply(CALIBRATION, pd.Series([1.3, "n/a"])),
            "output has 'n/a'; it is a number or",
        ),
        (
            lambda: accelcal.budget(CALIBRATION, np.array([None, "up"])),
            "a_i has 'up'; it is a number or",
        ),
        (lambda: accelcal.apply(CALIBRATION, [True]), "output has True; it is a number or an"),
        (
            lambda: accelcal.apply(CALIBRATION, [[1.3], [1j]]),
            "output is list; it is a number or an",
        ),
        (lambda: Limit("k0", "mg", maximum=5), "limit 'k0' is unknown; write bias"),
        (
            lambda: accelcal.read_arrays(FRAME, overrides={"T0": 20.0}),
            "'T0' cannot be declared; write reference_temperature",
        ),
        (
            lambda: accelcal.read_triad("examples/triad.csv", overrides={"g": 9.81}),
            "'g' cannot be declared; write local_gravity",
        ),
        (
            lambda: accelcal.design(hours=8, targets={"K3": 5e-6}),
            "K3 cannot be told by any of these tests; add positions, temperatures, mountings or",
        ),
    ],
)
def test_the_line_tells_the_name_or_cell_that_is_meant(call, told):
    with pytest.raises(InputError) as refused:
        call()
    assert told in str(refused.value)


def test_accelerations_across_are_told_by_name():
    """The third and fourth number of a call are no names of axes; `budget` takes none there."""
    with pytest.raises(TypeError, match="takes from 2 to 3 positional arguments"):
        accelcal.apply(CALIBRATION, [1.3], 20.0, 0.1)
