"""Gates of many tables at once against those of each table by itself."""

import itertools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

import accelcal
from accelcal.estimate.linear import linear_estimator
from accelcal.estimate.noise import ReadingNoise, reading_noise
from accelcal.estimate.tables import prepare
from accelcal.gates.record import RecordStack, gates_of_records
from accelcal.gates.stack import TableStack, of_one_plan
from accelcal.gates.table import gates_of_stack, gates_of_tables, table_gates
from accelcal.gates.verdict import VERDICTS
from accelcal.geometry import accelerations, position_angles
from accelcal.model import output

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
            one = replace(one, std=np.full(y.size, NOISE) * rng.uniform(0.8, 1.2, y.size))
        yield prepare(one.with_apparatus(resolution=(None, 1e-3, 1e-5)[i % 3]))


def fits_of(tables):
    noises = [reading_noise([table], [table.record.output])[0] for table in tables]
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
    warned = {gate.name for gate in together if "warn" in gate.verdicts}
    assert {"order of positions", "proportions", "resolution"} <= warned


def test_every_gate_warns_of_some_and_passes_others():
    together = assert_alike(list(faulty(*plan(6), count=300)), shared=3)
    assert {gate.name: set(gate.verdicts) for gate in together} == {
        gate.name: {"pass", "warn"} for gate in together
    }


@pytest.mark.parametrize("declared", [False, True])
def test_tables_may_have_times_and_scatters_of_their_own(declared):
    assert_alike(list(faulty(*plan(6), times=by_minute, declared=declared, count=24)))


def test_equal_times_are_one_plan():
    tables = list(faulty(*plan(6), times=lambda *_: 60.0 * np.arange(54), count=4))
    stack = TableStack.of(tables, *fits_of(tables))
    assert stack.moment.shape == (1, 54)
    assert stack.hours == pytest.approx(53.0 / 60.0)


def test_tables_of_several_plans_are_told_apart():
    plans = [plan(6), plan(2), plan(6), plan(6, 4)]
    tables = [next(faulty(*each)) for each in plans]
    assert of_one_plan(tables) == [[0, 2], [1], [3]]
    coefficients, noises = fits_of(tables)
    found = gates_of_tables(tables, coefficients, noises)
    assert found == [
        table_gates(*one, tables=4) for one in zip(tables, coefficients, noises, strict=True)
    ]


def test_a_large_stack_judges_swaps_in_parts(monkeypatch):
    monkeypatch.setattr("accelcal.gates.swaps._NUMBERS", 100)
    assert_alike(list(faulty(*plan(2), count=40)))


def test_codes_are_verdicts():
    tables = list(faulty(*plan(1), count=3))
    gate = gates_of_stack(TableStack.of(tables, *fits_of(tables)))[1]
    assert gate.verdict.dtype == np.int8
    assert [VERDICTS[code] for code in gate.verdict] == gate.verdicts == ["not assessed"] * 3


def test_unknown_noise_in_some_tables():
    """Of tables whose noise nothing tells, resolution says so where a step shows."""
    tables = list(faulty(*plan(1), count=10))
    coefficients, noises = fits_of(tables)
    noises[::2] = [ReadingNoise(np.nan, 0.0, "none")] * 5
    together = gates_of_stack(TableStack.of(tables, coefficients, noises))
    for i, one in enumerate(zip(tables, coefficients, noises, strict=True)):
        assert tuple(gate.gate(i) for gate in together) == table_gates(*one)


# -- records ---------------------------------------------------------------------------------------


def records(count, seed=3):
    """Stack of records of three tables; contrasts of some are fewer."""
    rng = np.random.default_rng(seed)
    contrasts, strengths = 3.0 * rng.normal(size=(count, 4)), rng.uniform(1e4, 1e5, (count, 4))
    strengths[::4, 2:] = 0.0
    strengths[3::7] = 0.0
    k = np.array(list(TRUTH.values())) * rng.normal(1.0, 1e-3, (count, 3, 6))
    k[1::5, 1] *= 1000.0
    k[2::5, 2, 0] += 0.2
    return RecordStack(
        contrasts=contrasts,
        strengths=strengths,
        head=10.0 ** rng.uniform(-6.0, -3.0, count),
        head_dof=rng.integers(1, 5, count).astype(float),
        head_source=np.array([("declared", "estimated", "none")[i % 3] for i in range(count)]),
        noise_dof=rng.integers(0, 40, count).astype(float),
        coefficients=k,
        names=["run 1", "run 2", "run 3"],
    )


def test_a_stack_of_records_is_as_each_record():
    stack = records(60)
    together = gates_of_records(stack)
    for i in range(60):
        shown = stack.strengths[i] > 0.0
        one = {name: getattr(stack, name)[i : i + 1] for name in stack._fields}
        one |= {name: one[name][:, shown] for name in ("contrasts", "strengths")}
        one = RecordStack(**one | {"names": stack.names})
        for many, single in zip(together, gates_of_records(one), strict=True):
            assert many.gate(i) == single.gate(0)
    assert {name for gate in together for name in gate.verdicts} == set(VERDICTS)
