"""Temperature laws of many records at once against those of each record by itself."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares

import accelcal
from accelcal.calibrate.plan import OnePlan
from accelcal.estimate.joint import estimate_stack
from accelcal.estimate.tables import prepare
from accelcal.gates.record import RecordStack, gates_of_records
from accelcal.reference import bilinear_design
from accelcal.simulation import NoiseComponents, TumblePlan
from accelcal.temperature.bilinear import law_maps
from accelcal.temperature.laws import laws_of_stack
from accelcal.temperature.levels import RecordedTemperatures
from accelcal.temperature.product import fit as steps
from accelcal.temperature.product.errors import errors_at, product_fit, sizes_at
from accelcal.temperature.product.fit import estimator, solved

DECLARED = {"head_uncertainty": 1e-5, "launch_uncertainty": 2e-6}
THREE = (20.0, 80.0, -40.0)
LOOP = (20.0, 50.0, 80.0, 50.0, 20.0, -10.0, -40.0, -10.0, 20.0)
RECORDS = 6
QUIET = NoiseComponents(reading=5e-6, head=1e-5, launch=0.0, launch_sf=0.0)


def record(levels, seed, *, mountings=("o+",), loop=0.0, launch=0.0, scatter=0.0, **declared):
    """A test at some levels [degC]; the bias lies off by `loop` [g] times them after heating."""
    plan = TumblePlan(temperatures=tuple(levels), mountings=mountings, strokes=4)
    one = accelcal.simulate(plan=plan, noise=QUIET, seed=seed, declare=False)
    rng = np.random.default_rng(seed)
    shift = launch * rng.standard_normal(len(one.run_labels))
    runs = np.array([one.temperature[one.run == run][0] for run in range(shift.size)])
    shift += 1e-2 * loop * runs * np.sign(np.diff(runs, prepend=runs[0]))
    return dataclasses.replace(
        one,
        output=one.output + 1.3 * shift[one.run],
        temperature=one.temperature + scatter * rng.standard_normal(len(one)),
    ).with_apparatus(**declared)


def records(levels, **options):
    """Records whose levels lie some hundredths of a degree beside those of the plan."""
    rng = np.random.default_rng(1)
    for seed in range(RECORDS):
        yield record(np.array(levels) + rng.uniform(-0.04, 0.04, len(levels)), seed, **options)


def stacked(made, reference=20.0):
    """Estimate and laws of records of one plan, at once."""
    tables = [prepare(table) for table in made[0].tables()]
    masks = list(made[0].table_masks())
    outputs = [np.array([one.output[mask] for one in made]) for mask in masks]
    readings = [np.array([one.temperature[mask] for one in made]) for mask in masks]
    levels = np.stack([own.mean(axis=1) for own in readings], axis=1)
    temperatures = RecordedTemperatures(readings, levels, np.full(len(made), reference))
    estimate = estimate_stack(tables, outputs, levels, made[0].apparatus)
    assert OnePlan.of(made).can_be_stacked().all()
    laws = laws_of_stack(tables, estimate, temperatures)
    return tables, estimate, laws


def assert_alike(found, expected):
    """Two documents are equal, numbers but for rounding errors."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys()
        for key in expected:
            assert_alike(found[key], expected[key])
    elif isinstance(expected, list):
        assert len(found) == len(expected)
        for pair in zip(found, expected, strict=True):
            assert_alike(*pair)
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=1e-7, abs=1e-25)
    else:
        assert found == expected


CASES = {
    "three levels": (THREE, DECLARED),
    "nothing declared": (THREE, {}),
    "temperature uncertain": (THREE, DECLARED | {"temperature_uncertainty": 0.05}),
    "above only": ((20.0, 80.0), DECLARED),
    "loop": (LOOP, {"head_uncertainty": 1e-5, "loop": 2e-5}),
    "open loop": ((20.0, 50.0, 80.0, 50.0, -10.0, -40.0), DECLARED | {"loop": 2e-5}),
    "curved": ((20.0, 45.0, 80.0, 0.0, -40.0), DECLARED | {"launch": 1e-4}),
    "T0 far outside": ((50.0, 60.0, 80.0), DECLARED),
    "both axes": (THREE, DECLARED | {"mountings": ("o+", "p+")}),
    "one level": ((20.0, 20.0), DECLARED),
    "no level near T0": ((0.0, 40.0), DECLARED),
}


@pytest.mark.parametrize("case", CASES)
def test_laws_of_a_stack_are_those_of_each_record(case):
    levels, options = CASES[case]
    made = list(records(levels, **options))
    tables, _, laws = stacked(made)
    for i, one in enumerate(made):
        expected = accelcal.fit(one, reference_temperature=20.0)
        assert_same_model(laws.main, i, expected.temperature_model)
        assert_same_model(laws.second_axis, i, expected.second_axis_model)
        assert_component(laws, tables, i, expected)


def assert_same_model(laws, i, expected):
    found = None if laws is None else laws.model(i)
    if expected is None:
        assert found is None
    else:
        assert_alike(found.to_document(), expected.to_document())


def assert_component(laws, tables, i, expected):
    """What the temperatures add to the uncertainty of the tables."""
    heat = laws.of_tables
    sigma = np.zeros(6 * len(tables)) if heat is None else np.sqrt(heat.of_records(i).variances)
    for table, own in zip(expected.tables, sigma.reshape(-1, 6).tolist(), strict=True):
        budget = [sources.get("temperature", 0.0) for sources in table.budget.values()]
        assert own == pytest.approx(budget, rel=1e-9)


def test_arrays_of_the_laws_are_those_of_the_models():
    made = list(records(LOOP, loop=3e-5, **DECLARED))
    laws = stacked(made)[-1].main
    for i in range(len(made)):
        for name, quantity in laws.model(i).quantities():
            place = laws.names.index(name)
            assert laws.value[i, place] == quantity.value
            assert laws.standard[i, place] == quantity.standard_uncertainty
            assert laws.expanded[i, place] == quantity.expanded_uncertainty
            assert laws.dof[i, place] == (quantity.dof or math.inf)
    assert np.isfinite(laws.value).all()


@pytest.mark.parametrize("case", ["temperature uncertain", "loop", "open loop", "above only"])
def test_uncertainties_of_a_stack_are_those_of_the_covariance(case):
    """The one is worked out quantity by quantity, the other from all coefficients at once."""
    levels, options = CASES[case]
    laws = stacked(list(records(levels, **options)))[-1].main
    for i in range(RECORDS):
        model = laws.model(i)
        sigma = np.sqrt(np.diagonal(model.covariance_matrix))
        for name, quantity in model.quantities():
            if name != "hysteresis":
                place = model.covariance_names.index(name)
                assert sigma[place] == pytest.approx(quantity.standard_uncertainty, rel=1e-9)


@pytest.mark.parametrize("pairs", [0, 1], ids=["laws alone", "with a half width"])
def test_maps_are_those_of_generalised_least_squares(pairs):
    """(X' C^-1 X)^-1 X' C^-1 written out; without a covariance all tables weigh alike."""
    rng = np.random.default_rng(3)
    law = bilinear_design(np.array([[-60.0, -20.0, 0.0, 30.0, 30.2, 60.0]]), ("above", "below"))
    paired = np.array([[0.0, 0.0, 0.0, 1.0, -1.0, 0.0]]).T[:, :pairs]
    factor = rng.standard_normal((2, 3, 6, 6))
    covariance = factor @ factor.swapaxes(2, 3)
    covariance[1] = np.nan
    found = law_maps(law, paired, covariance)
    whole = np.concatenate([law[0], paired], axis=1)
    for i, X in enumerate((whole, law[0], law[0])):
        weight = np.linalg.inv(covariance[0, i])
        expected = np.linalg.solve(X.T @ weight @ X, X.T @ weight)
        assert_allclose(found[0, i, : X.shape[1]], expected, rtol=1e-8, atol=1e-10)
        assert_allclose(found[1, i, : X.shape[1]], np.linalg.pinv(X), rtol=1e-9, atol=1e-14)
        assert not found[:, i, X.shape[1] :].any()


def test_what_is_not_determined_is_nan():
    laws = stacked(list(records((20.0, 80.0), **DECLARED)))[-1].main
    missing = [name for name, gap in zip(laws.names, np.isnan(laws.value[0]), strict=True) if gap]
    assert missing == ["k0 below", "K1 below", "delta below", "hysteresis"]


def test_records_of_other_courses_are_told_apart():
    courses = (THREE, (-40.0, 80.0, 20.0), (20.0, 24.0, -40.0))
    made = [record(levels, 1, **DECLARED) for levels in courses]
    laws = stacked(made)[-1].main
    assert len(laws.groups) == 3
    for i, one in enumerate(made):
        expected = accelcal.fit(one, reference_temperature=20.0).temperature_model
        assert_alike(laws.model(i).to_document(), expected.to_document())


def test_gaps_of_the_temperatures_are_filled_in():
    made = list(records(THREE, scatter=0.1))
    whole = OnePlan.of(made)
    assert all(own is raw for own, raw in zip(whole.recorded, whole.temperatures, strict=True))
    temperature = made[1].temperature.copy()
    temperature[3] = np.nan
    plan = OnePlan.of([made[0], dataclasses.replace(made[1], temperature=temperature)])
    assert plan.recorded[0][1, 3] == pytest.approx(np.nanmean(plan.temperatures[0][1]))
    (alone,) = plan.of_records(np.array([1])).recorded[0]
    assert_allclose(alone, plan.recorded[0][1], rtol=0.0)


def moving_fit(**declared):
    """The product fit of records whose temperatures scatter, with the laws that it starts from."""
    made = list(records(THREE, scatter=0.1, **declared))
    tables, estimate, laws = stacked(made)
    plan = OnePlan.of(made)
    temperatures = RecordedTemperatures(plan.recorded, plan.levels, np.full(RECORDS, 20.0))
    sides = ("above", "below")
    fit = product_fit(tables, estimate, temperatures, [0, 1, 2], np.arange(RECORDS), sides)
    (group,) = laws.main.groups
    return fit, group.laws.values[laws.main.member]


@pytest.mark.parametrize("declared", [DECLARED, {}], ids=["declared", "nothing declared"])
def test_product_fit_of_a_stack_is_the_least_squares_of_each_record(declared):
    fit, laws = moving_fit(**declared)
    state = solved(fit, laws)
    point = fit.readings.at(state.felt, state.parameters)
    errors = errors_at(fit, state, point, sizes_at(fit, state, point))
    at = errors.head.positions
    positions = at.cell[:, None] == np.arange(at.key.size)
    head = errors.head.acting[..., None] * positions
    shared = np.concatenate([head, *(own.mT for own in errors.shared.values())], axis=2)
    for record in range(RECORDS):
        own = fit.of_records(np.array([record])).readings
        count, tables = state.parameters.shape[1], state.felt.shape[1]
        start = np.concatenate([state.parameters[record], state.felt[record]])
        size = np.maximum(np.abs(start), 1e-6)

        def left(x, record=record, own=own, count=count, tables=tables, size=size):
            parameters, felt, error = np.split(x, [count, count + tables])
            parameters, felt = parameters * size[:count], felt * size[count:]
            model = own.at(felt[None], parameters[None]).model[0] + shared[record] @ error
            return np.concatenate(
                [(own.output[0] - model) / errors.sizes.noise[record], error, (felt - 0.5) / 0.5]
            )

        nothing = np.zeros(shared.shape[2])
        from_here = np.concatenate([1.01 * start / size, nothing])
        least = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-15)
        found = least_squares(left, from_here, jac="3-point", **least)
        unknowns = found.x[: start.size] * size
        covariance = np.linalg.inv(found.jac.T @ found.jac)[: start.size, : start.size]
        uncertainty = np.sqrt(np.diag(covariance)) * size
        off, known = np.abs(unknowns - start) / uncertainty, np.arange(start.size) != count
        assert off[known].max() < 1e-2
        assert off[count] < 0.1  # at T0 itself the laws have a kink: its slope is a convention
        assert_allclose(state.doubt[record, 1:], uncertainty[count + 1 :], rtol=1e-3)


def test_each_record_takes_its_own_steps():
    fit, laws = moving_fit(**DECLARED)
    whole = solved(fit, laws)
    for record in range(RECORDS):
        rows = np.array([record])
        for found, alone in zip(whole, solved(fit.of_records(rows), laws[rows]), strict=True):
            assert_allclose(found[rows], alone, rtol=1e-9, atol=1e-15)


def test_more_steps_of_the_product_fit_would_move_no_reading(monkeypatch):
    fit, laws = moving_fit(**DECLARED)
    found = solved(fit, laws)
    monkeypatch.setattr(steps, "_CONVERGED", 1e-13)
    last = solved(fit, laws)
    before, after = (fit.readings.at(own.felt, own.parameters) for own in (found, last))
    noise = sizes_at(fit, last, after).noise
    assert (np.abs(before.model - after.model) < 1e-4 * noise).all()
    assert_allclose(found.doubt, last.doubt, rtol=1e-3)


def test_map_of_the_product_fit_is_its_derivative():
    fit, laws = moving_fit(**DECLARED)
    state = solved(fit, laws)
    through = estimator(fit, state)[0]
    # the noise stays what it was, as all readings at one position move alike
    change = 1e-7 * np.cos(fit.readings.a_i)
    other = solved(
        fit._replace(readings=fit.readings._replace(output=fit.readings.output + change)), laws
    )
    assert_allclose(other.parameters - state.parameters, through @ change, rtol=2e-3, atol=1e-11)


@pytest.mark.parametrize("options", [DECLARED, {}], ids=["declared", "nothing declared"])
def test_gates_of_a_stack_of_records_are_those_of_each(options):
    made = list(records(THREE, **options))
    tables, estimate, _ = stacked(made)
    labels = [table.run_label for table in tables]
    levels = np.array([THREE])  # of the tables, in all records
    found = gates_of_records(RecordStack.of(estimate, tables, levels, lambda _: labels))
    for i, one in enumerate(made):
        expected = accelcal.fit(one, reference_temperature=20.0)
        assert tuple(gate.gate(i) for gate in found) == expected.gates


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("temperature_laws", "seed"), [("tables", 2), ("readings", 0)])
def test_a_scale_factor_of_nothing_makes_no_slopes(tmp_path, temperature_laws, seed):
    # read as half a turn, the readings have no scale factor; one temperature has moved
    path = tmp_path / "a.csv"
    plan = TumblePlan(strokes=2, temperatures=(20.0, 70.0, -30.0))
    noise = NoiseComponents(reading=5e-6, head=0.0, launch=0.0, launch_sf=0.0)
    accelcal.write_table(accelcal.simulate(plan=plan, noise=noise, seed=seed, declare=False), path)
    text = path.read_text()
    assert "\n20.0,1,1," in text
    for moved in ("20.0", "20.5"):
        path.write_text(text.replace("\n20.0,1,1,", f"\n{moved},1,1,", 1))
        found = accelcal.fit(
            accelcal.read_table(path, overrides={"positions": 16}),
            temperature_laws=temperature_laws,
        )
        assert abs(found.tables[0].coefficients["K0"].value) < 2.0
        law = found.temperature_model.k0.at_T0
        assert abs(law.value) < 5.0 * law.standard_uncertainty
