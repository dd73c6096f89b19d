"""Verdicts of many records at once are those of each by itself."""

import io
import re
from collections import Counter
from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

import accelcal
from accelcal.archive import block
from accelcal.archive.stacked_rows import stacked_tables, verdicts_of
from accelcal.calibrate.fit import calibrate_many
from accelcal.calibrate.options import Options
from accelcal.cli.main import main
from accelcal.io.toml.specification import read_specification
from accelcal.specification import PLACES, QUANTITIES, RULES, Limit, Specification
from accelcal.verdict.judge import judge

AL15 = read_specification(Path(__file__).parents[1] / "examples" / "al15.toml")

PLANS = (
    accelcal.TumblePlan(temperatures=(20.0, 80.0, -40.0), strokes=2),
    accelcal.TumblePlan(temperatures=(20.0, 60.0, 20.0, -20.0, 20.0), strokes=2),
    accelcal.TumblePlan(temperatures=(50.0, 90.0), strokes=2),
    accelcal.TumblePlan(temperatures=(10.0, 40.0), strokes=2),
    accelcal.TumblePlan(temperatures=(20.3, 21.1, 23.5), strokes=1),
    accelcal.TumblePlan(temperatures=(20.0,), positions=4, strokes=2),
    accelcal.TumblePlan(temperatures=(20.0,), mountings=("o+", "p+"), strokes=2),
    accelcal.TumblePlan(mountings=("o+", "o-"), strokes=2),
    accelcal.TumblePlan(mountings=("o+", "p+"), strokes=2),
    accelcal.TumblePlan(temperatures=(0.0, 60.0, -40.0), mountings=("o+", "p+"), strokes=2),
)
UNITS = {"acceleration": "ug", "angle": "urad", "ratio": "ppm", "output": "mA"}
SIZES = {"bias": 3300.0, "scale_factor": 1.36, "misalignment": 1150.0, "third_order": 10.0}
SIZES |= {"scale_factor_temperature_sensitivity": 500.0, "second_order": 30.0}


def written(record, changes=()):
    """A table in which nothing is declared, with changes of some lines."""
    bare = record.with_apparatus(
        head_uncertainty=None,
        launch_uncertainty=None,
        launch_sf_uncertainty=None,
        temperature_uncertainty=None,
    )
    file = io.StringIO()
    accelcal.write_table(bare, file)
    text = file.getvalue()
    for old, new in changes:
        text = re.sub(old, new, text, flags=re.MULTILINE)
    return text


def texts():
    for index, plan in enumerate(PLANS):
        for seed in range(2):
            yield written(accelcal.simulate(seed=10 * index + seed, plan=plan))
    for seed in (1, 2):
        yield written(accelcal.simulate(seed=seed, plan=PLANS[0]), [("^# unit.*\n", "")])
        alone = accelcal.simulate(seed=seed, plan=PLANS[6])
        yield written(alone, [("^# T0.*\n", ""), (r"^20\.0(?=,)", "unknown")])


@pytest.fixture(scope="module")
def records():
    return [accelcal.read_table(io.StringIO(text)) for text in texts()]


def limits(name):
    """Limits of all kinds on a quantity, about what is found."""
    quantity, size = QUANTITIES[name], SIZES.get(name, 40.0)
    if quantity.kind == "temperature":
        return [Limit(name, "degC", -20.0, 60.0)]
    unit = UNITS[quantity.kind] + (f"/{quantity.per}" if quantity.per else "")
    return [
        Limit(name, unit, *bounds, at=place)
        for place in PLACES
        for bounds in ((None, size), (size, None), (0.999 * size, 1.001 * size), (-size, size))
    ]


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"robust": True},
        {"method": "closed-form"},
        {"method": "printed"},
        {"coefficients": ("K0", "K1", "M")},
        {"delta0": 0.001},
        {"temperature_laws": "readings"},
    ],
    ids=str,
)
@pytest.mark.filterwarnings("ignore::accelcal.errors.AccelcalWarning")
def test_verdicts_of_many_are_those_of_each(records, options):
    seen = Counter()
    for _, stack in calibrate_many(records, Options(**options)).stacks:
        tables = stacked_tables(stack)
        each = [stack.one(index) for index in range(len(stack))]
        asked = [(name, limit) for name in QUANTITIES for limit in limits(name)]
        sheets = [
            Specification(name, (limit,), rule=rule)
            for (name, limit), rule in zip(asked, cycle(RULES), strict=False)
            if stack.plan.records[0].unit in ("mA", None)
        ]
        for sheet in [*sheets, AL15]:
            expected = [judge(calibration, sheet) for calibration in each]
            found = verdicts_of(stack, tables, sheet)
            assert found["verdict"] == [verdict.outcome for verdict in expected]
            assert found["failed_limits"] == [failed(verdict) for verdict in expected]
            seen.update(found["verdict"])
    assert min(seen[outcome] for outcome in ("fail", "undecided", "not tested", "pass")) > 20


def failed(verdict):
    return " | ".join(dict.fromkeys(j.limit for j in verdict.judgements if j.outcome == "fail"))


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("judged")
    for number, text in enumerate(texts()):
        (folder / f"t{number:02d}.csv").write_text(text)
    return folder


def test_a_batch_judges_as_a_fit_does(archive):
    found = accelcal.batch(archive, specification=AL15).tables
    told = found.drop_duplicates("source").set_index("source")
    for path in sorted(archive.glob("*.csv")):
        verdict = judge(accelcal.fit(accelcal.read_table(path)), AL15)
        row = told.loc[str(path)]
        assert (row["verdict"], row["failed_limits"]) == (verdict.outcome, failed(verdict))


def test_a_data_sheet_takes_no_record_by_itself(archive, monkeypatch):
    monkeypatch.setattr(block, "_one_by_one", lambda *_: pytest.fail("one by one"))
    assert len(accelcal.batch(archive, specification=AL15).errors) == 0


def test_failures_are_counted(archive, tmp_path):
    sheet = Specification(
        "none passes", (Limit("misalignment", "urad", maximum=1.0, at=PLACES[1]),)
    )
    counts = accelcal.write_batch(archive, tmp_path / "r.csv", specification=sheet)
    assert counts.failed == counts.fitted == len(list(archive.glob("*.csv")))


def test_a_limit_in_another_unit_costs_no_calibration(archive):
    sheet = Specification("volts", (Limit("scale_factor", "V/g", 1.0, 2.0),))
    files = sorted(archive.glob("*.csv"))[:3]
    found = accelcal.batch(files, specification=sheet)
    assert len(found.errors) == 0
    assert found.tables["source"].nunique() == 3
    assert set(found.tables["verdict"]) == {"not tested"}


def test_how_many_fail_is_told_of_one_as_of_several(tmp_path, capsys):
    """Of one the sentence was "1 fail the data sheet"."""
    examples = Path(__file__).parents[1] / "examples"
    read = ["batch", str(examples / "al15.csv"), "--spec", str(examples / "al15.toml")]
    assert main([*read, "-o", str(tmp_path / "r.csv")]) == 1
    assert capsys.readouterr().err == "1 calibration from 1 file; 1 beyond the data sheet\n"


def test_a_batch_counts_the_calibrations_whose_gates_warn(tmp_path, capsys):
    """It ended as if all were well, where a test had a reading beyond doubt wrong."""
    clean = accelcal.simulate(seed=1)
    faulty = replace(clean, output=clean.output + 1e-3 * (np.arange(len(clean)) == 60))
    for name, record in (("a", clean), ("b", faulty)):
        accelcal.write_table(record, tmp_path / f"{name}.csv")
    tables = [str(tmp_path / "a.csv"), str(tmp_path / "b.csv")]
    assert main(["batch", *tables, "-o", str(tmp_path / "r.csv")]) == 0
    told = "2 calibrations from 2 files; gates warn in 1, see the column warnings\n"
    assert capsys.readouterr().err == told
