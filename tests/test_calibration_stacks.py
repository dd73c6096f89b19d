"""Records of one plan calibrated together: the same numbers as one by one."""

import io
from dataclasses import replace

import numpy as np
import pytest
from calibration_columns import columns_of, columns_of_one
from numpy.testing import assert_allclose

import accelcal
from accelcal.apparatus import Apparatus
from accelcal.calibrate import plan
from accelcal.calibrate.fit import calibrate_many
from accelcal.calibrate.options import Options
from accelcal.errors import InputError
from accelcal.estimate.reversal import misalignment_stack

PLANS = {
    "three temperatures": {},
    "one temperature, one stroke": {"temperatures": (20.0,), "strokes": 1},
    "two strokes on 12": {"temperatures": (20.0, 60.0), "strokes": 2, "positions": 12},
    "one stroke on 24": {"temperatures": (20.0,), "strokes": 1, "positions": 24},
    "levels met again": {"temperatures": (20.0, 80.0, 20.0, -40.0, 20.0), "strokes": 2},
    "four positions": {"positions": 4, "strokes": 3},
    "both axes": {"mountings": ("o+", "p+"), "strokes": 3},
    "coarse": {"resolution": 1e-5},
}
DECLARED = Apparatus(
    head_uncertainty=2e-5, launch_uncertainty=1e-5, temperature_uncertainty=0.1, resolution=1e-6
)


def records(number=4, apparatus=None, **design):
    found = [
        accelcal.simulate(plan=accelcal.TumblePlan(**design), seed=seed) for seed in range(number)
    ]
    return found if apparatus is None else [replace(r, apparatus=apparatus) for r in found]


def assert_same(one, other):
    assert list(one) == list(other)
    for name, column in one.items():
        if column.dtype.kind == "U":
            assert column.tolist() == other[name].tolist(), name
        else:
            scale = np.nanmax(np.abs(column), initial=1e-300)
            rtol = 1e-8 if name.endswith("_dof") else 1e-9  # a shift may be a small difference
            assert_allclose(column, other[name], rtol=rtol, atol=1e-14 * scale, err_msg=name)


def of_record(columns, place):
    return {name: values[columns["record"] == place] for name, values in columns.items()}


def assert_stack_is_its_records(given, options=None, **arguments):
    found = calibrate_many(given, options)
    assert not found.failures
    assert sorted(np.concatenate([places for places, _ in found.stacks])) == list(range(len(given)))
    for places, stack in found.stacks:
        whole = columns_of(stack)
        for row, place in enumerate(places.tolist()):
            calibration = accelcal.fit(given[place], **arguments)
            expected = columns_of_one(calibration)
            own = of_record(whole, row) | {"record": expected["record"]}
            assert_same({name: own[name] for name in expected}, expected)
            assert stack.one(row).to_document().keys() == calibration.to_document().keys()
            if stack.options.temperature_laws == "tables":
                assert_same_warnings(stack.warnings, row, calibration)
    return found


def assert_same_warnings(found, row, calibration):
    assert found.of_record[row] == calibration.warnings
    assert [own[row] for own in found.of_tables] == [t.warnings for t in calibration.tables]


@pytest.mark.parametrize("declared", [None, DECLARED], ids=["nothing declared", "declared"])
@pytest.mark.parametrize("design", PLANS.values(), ids=PLANS)
def test_a_stack_is_its_records(design, declared):
    found = assert_stack_is_its_records(records(apparatus=declared, **design))
    assert [len(stack) for _, stack in found.stacks] == [4]


@pytest.mark.parametrize(
    "arguments",
    [
        {"robust": True},
        {"method": "closed-form"},
        {"coefficients": ("K0", "K1", "M")},
        {"delta0": 1e-3},
        {"reference_temperature": 30.0},
        {"temperature_laws": "readings"},
        {"method": "sign-corrected"},
    ],
    ids=lambda a: "-".join(a),
)
def test_options_are_those_of_fit(arguments):
    assert_stack_is_its_records(records(2), Options(**arguments), **arguments)


@pytest.mark.filterwarnings("ignore:method 'printed'")
def test_the_misprinted_method_has_no_laws():
    found = assert_stack_is_its_records(records(2), Options(method="printed"), method="printed")
    assert found.stacks[0][1].laws.main is None


# -- what belongs together -------------------------------------------------------------------------


def plans(given):
    return [places.tolist() for places, _ in calibrate_many(given).stacks]


def test_records_of_one_plan_are_found_among_others():
    eight, twelve = records(3), records(2, positions=12, strokes=2)
    assert plans([eight[0], twelve[0], eight[1], eight[2], twelve[1]]) == [[0, 2, 3], [1, 4]]


def test_what_makes_another_plan():
    (record,) = records(1)
    n = len(record)
    others = [
        replace(record, apparatus=DECLARED),
        replace(record, unit="V"),
        replace(record, metadata={"delta0": "0.001"}),
        replace(record, std=np.full(n, 1e-6)),
        record.select(np.arange(n) != 7),
    ]
    assert plans([record, *others, record]) == [[0, 6], [1], [2], [3], [4], [5]]


def test_equal_arrays_make_a_plan_whether_or_not_they_are_the_same():
    (record,) = records(1)
    equal = replace(record, angle=record.angle.copy(), stroke=record.stroke.copy())
    turned = replace(record, angle=record.angle + 1e-9)
    assert plans([record, equal, turned, record, equal]) == [[0, 1, 3, 4], [2]]


def test_records_that_miss_the_same_readings_are_of_one_plan():
    """Those that miss others are not, as other readings tell other coefficients less well."""
    given = records(4)
    missing = [
        own.taken(np.arange(len(own)) != place)
        for own, place in zip(given, (3, 40, 3, 3), strict=True)
    ]
    assert plans(missing) == [[0, 2, 3], [1]]


def test_many_records_of_a_plan_come_in_parts(monkeypatch):
    monkeypatch.setattr(plan, "_AT_A_TIME", 2)
    given = records(5)
    assert plans(given) == [[0, 1], [2, 3], [4]]
    assert_stack_is_its_records(given)


def at_levels(record, *levels):
    return replace(record, temperature=np.array(levels)[record.run])


def test_runs_that_share_a_level_are_of_the_plan():
    (record,) = records(1)
    cases = [(20.0, 80.0, -40.0), (20.2, 79.0, -41.0), (20.0, 80.0, 20.3), (80.0, 20.0, -40.0)]
    given = [at_levels(record, *levels) for levels in cases]
    unknown = replace(record, temperature=np.full(len(record), np.nan))
    assert plans([*given, unknown, unknown]) == [[0, 1], [2], [3], [4, 5]]
    assert_stack_is_its_records([*given, unknown, unknown])


def moving(record, seed, scatter=0.05, slope=5e-4):
    """The temperatures scatter within the runs, and the scale factor follows."""
    deviation = scatter * np.random.default_rng(seed).standard_normal(len(record))
    felt = record.output * (1.0 + slope * deviation)
    return replace(record, temperature=record.temperature + deviation, output=felt)


def test_temperatures_that_move_need_no_fit_of_their_own():
    still = records(6, DECLARED)
    given = [moving(r, i) if i % 2 else r for i, r in enumerate(still)]
    (record,) = records(1, DECLARED)
    some = np.where(np.arange(len(record)) == 5, np.nan, record.temperature)
    drift = record.temperature + np.linspace(0.0, 1.0, len(record))
    given += [replace(record, temperature=own) for own in (some, drift)]
    assert plans(given) == [list(range(8))]
    ((_, stack),) = assert_stack_is_its_records(given).stacks
    told = ["brought to the mean" in " ".join(said) for said in stack.warnings.of_record]
    assert told == [False, True] * 3 + [False, False]


@pytest.mark.parametrize("law", [5e-4, 0.0], ids=["followed", "ignored"])
def test_runs_whose_temperature_moves_are_named_as_in_their_record(law):
    given = [moving(r, i, scatter=1.0, slope=law) for i, r in enumerate(records(2, DECLARED))]
    given[1] = replace(given[1], run_labels=("cold", "warm", "hot"))
    options = Options(temperature_laws="readings")
    ((_, stack),) = assert_stack_is_its_records(given, options, temperature_laws="readings").stacks
    found = stack.one(1)
    said = " ".join((*found.warnings, *found.temperature_model.warnings))
    assert "runs cold, warm, hot: the " in said
    assert "runs 1, 2, 3" not in said


@pytest.mark.parametrize(
    "arguments",
    [{"robust": True}, {"method": "closed-form"}, {"temperature_laws": "readings"}],
    ids=lambda a: "-".join(a),
)
def test_options_are_those_of_fit_where_temperatures_move(arguments):
    given = [moving(r, i) for i, r in enumerate(records(3))]
    assert_stack_is_its_records(given, Options(**arguments), **arguments)


def test_moving_temperatures_of_both_sides_and_a_loop():
    levels = (20.0, 60.0, 20.0, -40.0, 20.0)
    for design in ({"mountings": ("o+", "o-"), "strokes": 2}, {"temperatures": levels}):
        given = [moving(r, i) for i, r in enumerate(records(3, DECLARED, **design))]
        assert_stack_is_its_records(given)


BOTH_SIDES = {
    "one level": {"temperatures": (20.0,), "mountings": ("o+", "o-")},
    "three levels": {"mountings": ("o+", "o-")},
    "both axes": {"temperatures": (20.0, 60.0), "mountings": ("o+", "o-", "p+", "p-")},
    "one side of the other axis": {"temperatures": (20.0, 60.0), "mountings": ("o+", "o-", "p+")},
    "levels met again": {"temperatures": (20.0, 60.0, 20.0), "mountings": ("p+", "p-")},
}


@pytest.mark.parametrize("declared", [None, DECLARED], ids=["nothing declared", "declared"])
@pytest.mark.parametrize("design", BOTH_SIDES.values(), ids=BOTH_SIDES)
def test_both_sides_of_an_axis_free_the_laws_of_its_fixture_angle(design, declared):
    given = records(3, declared, strokes=2, **design)
    ((_, stack),) = assert_stack_is_its_records(given).stacks
    for row, record in enumerate(given):
        expected = accelcal.fit(record)
        assert expected.fixture_angle
        assert_numbers_agree(stack.one(row).to_document(), expected.to_document())


def test_misalignments_free_of_the_fixture_angle_are_those_of_each():
    design = {"mountings": ("o+", "o-", "p+"), "strokes": 2, "temperatures": (20.0, 60.0)}
    given = records(3, **design)
    one_side = given[0].run != 3  # at 60 degC
    labels = ("1", "2", "3", "5", "6")
    given += [
        replace(part, run=part.run - (part.run > 3), run_labels=labels)
        for part in (record.select(one_side) for record in given)
    ]
    given += [replace(r, temperature=np.full(len(r), np.nan)) for r in given[:2]]
    for places, stack in calibrate_many(given).stacks:
        value, expanded = misalignment_stack(stack.tables, stack.estimate, stack.plan.levels)
        for row, place in enumerate(places.tolist()):
            calibration = accelcal.fit(given[place])
            for i, table in enumerate(calibration.tables):
                found = calibration.misalignment(table)
                if table.mounting[0] == "p":
                    assert np.isnan([value[row, i], expanded[row, i]]).all()
                else:
                    assert value[row, i] == pytest.approx(found.value, rel=1e-9)
                    assert expanded[row, i] == pytest.approx(found.expanded_uncertainty, rel=1e-9)


def test_runs_more_than_one_degree_apart_are_of_another_plan():
    (record,) = records(1, mountings=("o+", "o-"), temperatures=(20.0, 60.0), strokes=1)
    given = [at_levels(record, 20.0, s, 20.0, s) for s in (20.5, 21.0, 21.5, 20.75)]
    assert plans(given) == [[0, 1, 3], [2]]
    assert_stack_is_its_records(given)


def on_a_head(size=8):
    errors = np.linspace(-2e-5, 3e-5, size)
    rows = "\n".join(f"{360.0 * i / size},{error}" for i, error in enumerate(errors.tolist()))
    return accelcal.read_head(io.StringIO(f"# uncertainty: 2e-6 rad\nangle,error [rad]\n{rows}\n"))


@pytest.fixture(scope="module")
def with_backlash():
    """Records with an effect, and a discovery that found it."""
    effects = [accelcal.effect("backlash").of(3e-5)]
    plan = accelcal.TumblePlan(temperatures=(20.0, 60.0), strokes=4)
    found = [accelcal.simulate(plan=plan, effects=effects, seed=seed) for seed in range(3)]
    return found, accelcal.discover(found[0])


def test_a_model_without_effects_changes_nothing():
    given = records(2, temperatures=(20.0,), strokes=6)
    model = replace(accelcal.discover(given[0]), effects=())
    assert_stack_is_its_records(given, Options(model=model), model=model)


@pytest.mark.parametrize("head", [None, on_a_head()], ids=["", "on a known head"])
@pytest.mark.parametrize("laws", ["tables", "readings"])
def test_a_model_is_taken_out_of_each_record(with_backlash, laws, head):
    given, model = with_backlash
    assert [found.id for found in model.effects] == ["backlash"]
    asked = {"model": model, "head": head, "temperature_laws": laws}
    ((_, stack),) = assert_stack_is_its_records(given, Options(**asked), **asked).stacks
    for row, record in enumerate(given):
        expected = accelcal.fit(record, **asked)
        found = stack.one(row)
        assert_numbers_agree(found.to_document(), expected.to_document())
        # backlash cancels in the coefficients of closed strokes; what it leaves are residuals
        without = accelcal.fit(record, **asked | {"model": None})
        assert scatter_of(found) < 0.4 * scatter_of(without)


def scatter_of(calibration):
    return np.std(calibration.to_document()["tables"][0]["residuals"]["value"])


def assert_numbers_agree(one, other):
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for name in one:
            assert_numbers_agree(one[name], other[name])
    elif isinstance(one, list):
        for a, b in zip(one, other, strict=True):
            assert_numbers_agree(a, b)
    elif isinstance(one, float):
        assert one == pytest.approx(other, rel=1e-8, abs=1e-15)
    else:
        assert one == other


@pytest.mark.parametrize("design", [PLANS[name] for name in ("four positions", "both axes")])
def test_records_on_a_known_head_stay_together(design):
    head = on_a_head()
    given = records(**design)
    found = assert_stack_is_its_records(given, Options(head=head), head=head)
    assert [len(stack) for _, stack in found.stacks] == [4]
    plain = accelcal.fit(given[0]).tables[0].coefficients["K0"].value
    assert found.stacks[0][1].one(0).tables[0].coefficients["K0"].value != plain


def test_what_told_of_the_head_is_left_out_of_that_record_alone():
    given = [replace(r, sha256=f"{i:064d}") for i, r in enumerate(records(4, DECLARED, strokes=2))]
    head = accelcal.calibrate_head(given[1:3])
    found = assert_stack_is_its_records(given, Options(head=head), head=head)
    assert sorted(places.tolist() for places, _ in found.stacks) == [[0, 3], [1], [2]]


def test_a_position_that_the_head_lacks_costs_its_records_only():
    head, eight, twelve = on_a_head(), records(2), records(2, positions=12)
    found = calibrate_many([eight[0], twelve[0], eight[1], twelve[1]], Options(head=head))
    assert [places.tolist() for places, _ in found.stacks] == [[0, 2]]
    assert set(found.failures) == {1, 3}
    assert "head position 30 deg is not among the 8" in str(found.failures[1])


def test_times_of_some_records():
    timed = records(2, timed=True)
    given = [timed[0], replace(timed[1], time=None), *records(1)]
    assert_stack_is_its_records(given)


def test_declared_scatter_that_all_have():
    given = [replace(r, std=np.full(len(r), 2e-5), count=np.full(len(r), 50.0)) for r in records(3)]
    scattered = replace(given[1], output=given[1].output + 3e-5 * (-1.0) ** given[1].stroke)
    assert_stack_is_its_records([given[0], scattered, given[2]])


def test_each_record_has_the_warnings_it_needs():
    """Of one plan, the first shows a head error above the noise, the last has no T0."""
    plain = [replace(r, reference_temperature=20.0) for r in records(2, Apparatus(), strokes=6)]
    given = [*plain, replace(plain[1], reference_temperature=None)]
    found = assert_stack_is_its_records(given).stacks[0][1].warnings.of_record
    assert ["T0 was not given" in " ".join(said) for said in found] == [False, False, True]
    assert ["cannot tell the two apart" in " ".join(said) for said in found] == [False, True, True]


# -- what fails ------------------------------------------------------------------------------------


def test_a_record_that_fails_harms_no_other():
    given = records(3)
    spoilt = replace(given[1], output=np.ones(len(given[1])), source="spoilt.csv")
    found = calibrate_many([given[0], spoilt, given[2]])
    assert [places.tolist() for places, _ in found.stacks] == [[0, 2]]
    assert list(found.failures) == [1]
    with pytest.raises(InputError) as raised:
        accelcal.fit(spoilt)
    assert str(found.failures[1]) == str(raised.value)


def test_a_fixture_angle_that_is_none_harms_no_other():
    given = records(2)
    for name in ("a.csv", "b.csv"):
        given.insert(1, replace(given[0], source=name, metadata={"delta0": "steep"}))
    found = calibrate_many(given)
    assert [places.tolist() for places, _ in found.stacks] == [[0, 3]]
    said = "delta0 is 'steep'; it is a number in rad, as in 0.001"
    assert [str(found.failures[i]) for i in (1, 2)] == [f"b.csv: {said}", f"a.csv: {said}"]


def test_records_whose_plan_fails_fail_each_for_itself():
    given = [replace(r, source=f"{i}.csv") for i, r in enumerate(records(2, positions=12))]
    found = calibrate_many(given, Options(method="closed-form"))
    assert not found.stacks
    assert [str(error).split(":")[0] for error in found.failures.values()] == ["0.csv", "1.csv"]


def test_what_is_asked_of_no_record_is_refused_at_once():
    with pytest.raises(InputError, match="temperature_laws 'nosuch' is unknown; choose from"):
        calibrate_many([], Options(temperature_laws="nosuch"))


def test_no_records():
    assert calibrate_many([]).stacks == ()
