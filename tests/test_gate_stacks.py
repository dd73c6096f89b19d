"""Gates of many tables at once against those of each table by itself."""

import itertools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from one_record import noises_of_record

import accelcal
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import linear_estimator, prepare
from accelcal.gates import order, replicates, sizes
from accelcal.gates.plan import Cells, ReplicatePlan, TablePlan, plan_of
from accelcal.gates.record import RecordStack, gates_of_records, gates_of_stack
from accelcal.gates.stack import TableStack, of_one_plan
from accelcal.gates.verdict import SIGNIFICANT, VERDICTS
from accelcal.geometry import accelerations
from accelcal.head_angles import position_angles
from accelcal.model import output
from accelcal.numerics.decimal_steps import common_steps, decimal_steps

TRUTH = {"K0": 4e-3, "K1": 1.3, "K2": 1e-4, "K3": 9e-5, "M_P": 1.2e-3, "M_ip": 2e-5}
NOISE = 6e-6  # output unit


def plan(strokes, positions=8, gaps=0, rng=None):
    """Angle and stroke of each reading, forward and back."""
    j = np.concatenate(
        [np.arange(1, positions + 2)[:: 1 if k % 2 else -1] for k in range(1, strokes + 1)]
    )
    stroke = np.repeat(np.arange(1, strokes + 1), positions + 1)
    kept = np.ones(j.size, dtype=bool)
    if gaps:
        kept[rng.choice(j.size, gaps, replace=False)] = False
    return position_angles(j, positions)[kept], stroke[kept]


class Case(NamedTuple):
    """Outputs of one table, to which a fault is done, its angles, strokes and number."""

    y: np.ndarray
    angle: np.ndarray
    stroke: np.ndarray
    i: int


def swapped(case):
    own = np.flatnonzero(case.stroke == 1)[case.i % 5 : case.i % 5 + 2]
    case.y[own] = case.y[own[::-1]]


def of_stroke(change):
    def fault(case):
        own = case.stroke == 1 + case.i % case.stroke.max()
        case.y[own] = change(case.y[own])

    return fault


def outlier(case):
    case.y[case.i % case.y.size] += (-1.0) ** case.i * 10.0 ** -(3 + case.i % 3)


def drifting(case):
    ramp = np.linspace(0.0, 10.0 ** -(3 + case.i % 3), case.y.size)
    case.y[:] += ramp * (case.y if case.i % 2 else 1.0)


def rounded(case):
    """In steps, but for an arithmetic that makes no two readings alike to the last digit."""
    digits = 1 + case.i % 3
    noise = 5e-5 * np.sin(np.arange(case.y.size) ** 2.0)
    case.y[:] = np.round(case.y, digits) + 10.0**-digits * noise


def open_turn(case):
    case.y[case.angle == 0.0] += 1e-4


def backlash(case):
    case.y[case.stroke % 2 == 0] += 1e-4


def turned(case):
    case.y[:] *= -1.0


FAULTS = (
    None,
    outlier,
    swapped,
    drifting,
    rounded,
    open_turn,
    backlash,
    of_stroke(lambda own: own[::-1].copy()),
    of_stroke(np.negative),
    of_stroke(lambda own: 1000.0 * own),
    of_stroke(lambda own: np.roll(own, 1)),
    turned,
)


def faulty(angle, stroke, times=None, declared=False, count=1):
    """Tables of one plan, each with its noise and, in turn, a fault; some declare a step."""
    rng = np.random.default_rng(len(angle))
    signal = output(TRUTH, accelerations(angle))
    columns = {"angle": angle, "stroke": stroke, "output": signal, "temperature": 0.0 * angle}
    record = accelcal.read_arrays(columns)
    for i, fault in zip(range(count), itertools.cycle(FAULTS)):
        y = signal * (1.0 + 1e-3 * rng.normal()) + NOISE * rng.normal(size=signal.size)
        if fault is not None:
            fault(Case(y, angle, stroke, i))
        one = replace(record, output=y, time=None if times is None else times(i, rng))
        if declared and i % 2:
            one = replace(one, std=np.full(y.size, NOISE * rng.uniform(0.8, 1.2)))
        yield prepare(one.with_apparatus(resolution=(None, 1e-3, 1e-5)[i % 3]))


def gates_of_one(table, coefficients, noise, tables=1):
    stack = TableStack.of([table], [coefficients], [noise])
    return tuple(found.gate(0) for found in gates_of_stack(stack, tables))


def fits_of(tables):
    noises = [noises_of_record([table])[0] for table in tables]
    return [linear_estimator(t).coefficients(t.record.output) for t in tables], noises


def assert_alike(tables, shared=1):
    """Verdict and sentence of each table are those of a stack of one."""
    coefficients, noises = fits_of(tables)
    together = gates_of_stack(TableStack.of(tables, coefficients, noises), shared)
    for i, one in enumerate(zip(tables, coefficients, noises, strict=True)):
        alone = gates_of_stack(TableStack.of(*([part] for part in one)), shared)
        assert [gate.gate(i) for gate in together] == [gate.gate(0) for gate in alone]
    return together


def by_minute(i, rng):
    return None if i % 5 == 0 else 60.0 * np.arange(54) + rng.uniform(0.0, 20.0, 54)


@pytest.mark.parametrize(
    ("strokes", "positions", "gaps"), [(6, 8, 0), (6, 8, 7), (2, 12, 0), (1, 8, 0), (3, 4, 0)]
)
def test_a_stack_is_as_each_table(strokes, positions, gaps):
    angle, stroke = plan(strokes, positions, gaps, np.random.default_rng(1))
    together = assert_alike(list(faulty(angle, stroke, count=24)))
    warned = {gate.name for gate in together if gate.warned()}
    assert {"order of positions", "proportions", "resolution"} <= warned


def found_by(gate):
    return {VERDICTS[code] for code in gate.verdict}


def test_every_gate_warns_of_some_and_passes_others():
    together = assert_alike(list(faulty(*plan(6), count=300)), shared=3)
    assert all(found_by(gate) == {"pass", "warn"} for gate in together)


@pytest.mark.parametrize("declared", [False, True])
def test_tables_may_have_times_and_scatters_of_their_own(declared):
    assert_alike(list(faulty(*plan(6), times=by_minute, declared=declared, count=24)))


def test_equal_times_are_one_plan():
    tables = list(faulty(*plan(6), times=lambda *_: 60.0 * np.arange(54), count=4))
    stack = TableStack.of(tables, *fits_of(tables))
    assert stack.plan.moment.shape == (1, 54)
    assert stack.hours == pytest.approx(53.0 / 60.0)


def gates_of_tables(tables, coefficients, noises):
    """Gates of all tables of a record, those of one plan together."""
    found = {}
    for places in of_one_plan(tables):
        own, k = [tables[i] for i in places], [coefficients[i] for i in places]
        stack = TableStack.of(own, k, [noises[i] for i in places], 0.0)
        gates = gates_of_stack(stack, len(tables))
        found |= {place: tuple(g.gate(i) for g in gates) for i, place in enumerate(places)}
    return [found[place] for place in range(len(tables))]


def test_tables_of_several_plans_are_told_apart():
    plans = [plan(6), plan(2), plan(6), plan(6, 4)]
    tables = [next(faulty(*each)) for each in plans]
    assert of_one_plan(tables) == [[0, 2], [1], [3]]
    coefficients, noises = fits_of(tables)
    found = gates_of_tables(tables, coefficients, noises)
    assert found == [
        gates_of_one(*one, tables=4) for one in zip(tables, coefficients, noises, strict=True)
    ]


def test_a_large_stack_judges_swaps_in_parts(monkeypatch):
    monkeypatch.setattr("accelcal.gates.order._NUMBERS", 100)
    assert_alike(list(faulty(*plan(2), count=40)))


def test_codes_are_verdicts():
    tables = list(faulty(*plan(1), count=3))
    gate = gates_of_stack(TableStack.of(tables, *fits_of(tables)))[1]
    assert [VERDICTS[code] for code in gate.verdict] == ["not assessed"] * 3
    assert {gate.gate(i).verdict for i in range(3)} == {"not assessed"}


def test_unknown_noise_in_some_tables():
    """Of tables whose noise nothing tells, resolution says so where a step shows."""
    tables = list(faulty(*plan(1), count=10))
    coefficients, noises = fits_of(tables)
    noises[::2] = [ReadingNoise(np.nan, 0.0, "none")] * 5
    together = gates_of_stack(TableStack.of(tables, coefficients, noises))
    for i, one in enumerate(zip(tables, coefficients, noises, strict=True)):
        assert tuple(gate.gate(i) for gate in together) == gates_of_one(*one)


# -- records ---------------------------------------------------------------------------------------


def records(count, seed=3):
    """Stack of records of three tables; contrasts of some are fewer."""
    rng = np.random.default_rng(seed)
    contrasts = rng.integers(0, 5, count)
    k = np.array(list(TRUTH.values())) * rng.normal(1.0, 1e-3, (count, 3, 6))
    k[4::10, 2, 4] += 2e-3
    k[1::5, 1] *= 1000.0
    k[2::5, 2, 0] += 0.2
    outputs = [rng.normal(size=(count, 9)).round(7) for _ in range(3)]
    k[3::5, 1], outputs[1][3::5] = k[3::5, 0], outputs[0][3::5]
    return RecordStack(
        contrasts=contrasts,
        squares=contrasts * rng.chisquare(2, count),
        head=10.0 ** rng.uniform(-6.0, -3.0, count),
        head_dof=rng.integers(1, 5, count).astype(float),
        head_source=np.array([("declared", "estimated", "none")[i % 3] for i in range(count)]),
        noise_dof=rng.integers(0, 40, count).astype(float),
        coefficients=k,
        outputs=outputs,
        noise=rng.choice([5e-6, 1e-9, np.nan], (count, 3)),
        alike=[np.array([0, 2])],
        tilt_noise=rng.uniform(0.0, 1e-4, (count, 3)),
        names=lambda _: ["run 1", "run 2", "run 3"],
    )


def test_a_stack_of_records_is_as_each_record():
    stack = records(60)
    together = gates_of_records(stack)
    for i in range(60):
        arrays = [name for name in stack._fields if name not in ("names", "alike")]
        one = {name: getattr(stack, name)[i : i + 1] for name in arrays}
        outputs = [own[i : i + 1] for own in stack.outputs]
        one = RecordStack(**one | {"names": stack.names, "alike": stack.alike, "outputs": outputs})
        for many, single in zip(together, gates_of_records(one), strict=True):
            assert many.gate(i) == single.gate(0)
    assert set().union(*map(found_by, together)) == set(VERDICTS)


# -- screens: what passes most tables at once, against what it stands for --------------------------

SHAPES = [(6, 8, 0), (6, 8, 7), (2, 12, 0), (3, 4, 0), (1, 8, 0)]


def tables_of(strokes, positions, gaps, **more):
    angle, stroke = plan(strokes, positions, gaps, np.random.default_rng(1))
    return list(faulty(angle, stroke, **more))


# -- units -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("near", [1e-3, 0.05, 0.5])
def test_sizes_that_are_alike_are_those_of_no_warning(shape, near):
    """Readings of nearly 10^0.9 times, or a third of, the others, strokes of nearly 1.3 times."""
    table = tables_of(*shape)[0]
    rng = np.random.default_rng(5)
    groups = sizes._groups(plan_of(table, None))
    count, kind = 2000, rng.integers(0, 3, 2000)
    y = table.record.output[:, None] * np.ones(count)
    some = rng.integers(0, len(y), count)
    limits = np.where(kind == 0, 10.0**0.9, 0.3) ** rng.choice([-1.0, 1.0], count)
    at_limit = limits * rng.uniform(1.0 - near, 1.0 + near, count)
    y[some, np.arange(count)] *= np.where(kind < 2, at_limit, 1.0)
    own = np.equal(groups.strokes.cell[:, None], rng.integers(0, shape[0], count)) & (kind == 2)
    y *= np.where(own, 1.3 * rng.uniform(1.0 - near, 1.0 + near, count), 1.0)
    amplitude = groups.amplitudes(y)
    alike = sizes._alike(np.abs(y), amplitude, groups.axes)
    bad = sizes._Sizes.of(y, amplitude, groups).bad
    assert not (alike & bad).any()
    assert alike.mean() > 0.2
    assert not alike.all()


@pytest.mark.parametrize("near", [1e-3, 0.05, 0.5])
def test_axes_that_hardly_tell_are_told_from_those_that_do(near):
    """Readings of 0.3 times those of another axis, one of them a tenth of the others."""
    rng = np.random.default_rng(6)
    axes = [np.arange(7), np.arange(7, 14)]
    size = rng.uniform(1.0 - near, 1.0 + near, (14, 5000))
    size[7:] *= 0.3
    size[7] *= rng.choice([0.1, 1.0], 5000)
    alike = sizes._alike(size, np.ones((1, 5000)), axes)
    wrong = (sizes._decades(size, axes) != 0.0).any(axis=0)
    assert not (alike & wrong).any()
    assert alike.sum() > 2000
    assert wrong.sum() > 200


@pytest.mark.parametrize("positions", [4, 8, 12, 14, 22])
def test_opposite_positions_are_on_one_axis(positions):
    axes = sizes._groups(plan_of(tables_of(1, positions, 0)[0], None)).axes
    assert len(axes) == positions // 2
    assert sum(len(own) for own in axes) == positions + 1


def test_units_of_a_stack_are_judged_as_without_a_screen():
    tables = tables_of(6, 8, 0, count=300)
    stack = TableStack.of(tables, *fits_of(tables))
    groups = sizes._groups(stack.plan)
    whole = sizes._Sizes.of(stack.output, groups.amplitudes(stack.output), groups)
    assert ((sizes.units(stack).verdict == 1) == whole.bad).all()
    assert 0 < whole.bad.sum() < 300


@pytest.mark.parametrize("shape", [*SHAPES, (2, 8, 3)])
def test_orders_of_a_stack_are_judged_as_without_a_screen(monkeypatch, shape):
    tables = tables_of(*shape, count=300)
    stack = TableStack.of(tables, *fits_of(tables))
    clear, found = order._is_clear(stack), order.order_of_positions(stack)
    monkeypatch.setattr(order, "_is_clear", lambda stack: np.zeros(len(stack), dtype=bool))
    unscreened = order.order_of_positions(stack)
    assert [found.gate(i) for i in range(300)] == [unscreened.gate(i) for i in range(300)]
    assert 0 < (found.verdict == 1).sum() < 300
    assert clear.any() == (shape[0] > 3)


# -- steps -----------------------------------------------------------------------------------------


def steps_one_by_one(values):
    """Largest power of ten of which each row is a multiple, digit by digit."""
    for row in values:
        largest = np.abs(row).max()
        possible = [
            10.0**-digits
            for digits in range(-9, 13)
            if 100.0 <= largest * 10.0**digits < 1e12
            and np.abs(row * 10.0**digits - np.round(row * 10.0**digits)).max() < 1e-4
        ]
        yield max(possible, default=0.0)


def coarse(count=3000, n=20):
    """Rows in steps of 1, 2, 5 or 7 of a digit; some of them finer in a few readings, or zero."""
    rng = np.random.default_rng(8)
    digits = rng.integers(-6, 9, (count, 1))
    values = np.round(rng.choice([1, 2, 5, 7], (count, 1)) * rng.integers(-2000, 2000, (count, n)))
    values = values * 10.0**-digits
    finer = rng.random((count, n)) < rng.choice([0.0, 0.05], (count, 1))
    values += np.where(finer, 10.0 ** -(digits + rng.integers(1, 4, (count, 1))), 0.0)
    values[::7, :6] = values[::7, :1]
    values[::50] = 0.0
    return values


def test_steps_of_many_rows_are_those_of_each():
    values = coarse()
    expected = list(steps_one_by_one(values))
    assert decimal_steps(values).tolist() == expected
    assert decimal_steps(values.T.copy().T).tolist() == expected
    assert len(set(expected)) > 14


def test_a_visible_step_is_that_of_all_readings():
    y = coarse().T
    digit = decimal_steps(y.T)
    counts = np.round(y / np.where(digit > 0.0, digit, 1.0)).astype(np.int64)
    expected = np.where(digit > 0.0, digit * np.gcd.reduce(counts - counts[0], axis=0), 0.0)
    assert (common_steps(y, digit) == expected).all()
    assert len(set(np.round(expected / np.where(digit > 0.0, digit, 1.0)).tolist())) > 3


# -- replicates ------------------------------------------------------------------------------------


def minutes(i, rng):
    return 60.0 * np.arange(54) + (rng.uniform(0.0, 20.0, 54) if i else 0.0)


@pytest.mark.parametrize(
    ("shape", "times"), [*((shape, None) for shape in SHAPES), ((6, 8, 0), minutes)]
)
def test_what_directions_add_is_the_difference_of_two_fits(shape, times):
    tables = tables_of(*shape, times=times, count=24)
    stack = TableStack.of(tables, *fits_of(tables))
    together = ReplicatePlan.of(Cells.of(np.round(stack.plan.angle, 6)), stack.plan.columns)
    squares, part = replicates._added_by_directions(stack)
    expected = together.fit(stack.output).squares - stack.apart.squares
    rounding = 1e-9 * stack.apart.squares + 1e3 * stack.smallest**2
    assert (np.abs(squares - expected) <= 1e-9 * expected + rounding).all()
    assert (part == together.dof - stack.plan.apart.dof).all()


# -- plans -----------------------------------------------------------------------------------------


def test_tables_of_one_plan_share_it():
    one, other = tables_of(6, 8, 0, count=2)
    assert plan_of(one, None) is plan_of(other, None)
    by_minute = 60.0 * np.arange(54.0)[None]
    timed = plan_of(one, by_minute)
    assert timed is plan_of(other, by_minute.repeat(2, axis=0))
    assert timed is not plan_of(one, None)
    assert timed.moment.tolist() == by_minute.tolist()


@pytest.mark.parametrize("part", ["angle", "head", "stroke", "design"])
def test_a_plan_is_that_of_its_table(part):
    for shape in SHAPES:
        table = tables_of(*shape)[0]
        record = table.record
        found: TablePlan = plan_of(table, None)
        expected = {"angle": record.angle, "head": table.head, "stroke": record.stroke}
        assert (getattr(found, part) == {**expected, "design": table.kept_design}[part]).all()


def test_rounding_errors_of_readings_that_are_all_alike_are_no_outlier():
    """What a mean over strokes leaves of readings in coarse steps is nothing but rounding."""
    angle, stroke = plan(6)
    truth = output(TRUTH, accelerations(angle))
    bias = np.random.default_rng(0).uniform(-1e-2, 1e-2, (500, 1))
    y = 2e-4 * np.round((truth + bias) / 2e-4)
    columns = {"angle": angle, "stroke": stroke, "temperature": 20.0}
    tables = [prepare(accelcal.read_arrays({**columns, "output": row})) for row in y]
    stack = TableStack.of(tables, *fits_of(tables))
    assert not replicates.outlier(stack, SIGNIFICANT).verdict.any()
