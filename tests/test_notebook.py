"""Results in a notebook: well-formed, escaped tables, and one short line as repr."""

import copy
import json
import operator
import pickle
import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

import accelcal
from accelcal.error_budget.budget import budget
from accelcal.escapes import visible
from accelcal.io.stability_record import read_stability
from accelcal.io.toml.specification import read_specification
from accelcal.results.discovery import Discovery
from accelcal.results.findings import Change, Fault, FoundEffect, Gap, Unexplained
from accelcal.results.quantity import ErrorSource, Gate, Quantity
from accelcal.results.stand_discovery import HeadPosition, StandDiscovery, StandEffect
from accelcal.stability.analysis import analyse
from accelcal.verdict.judge import judge

EVIL = "<script>alert(1)</script>"
BOTH_SIDES = accelcal.TumblePlan(mountings=("o+", "o-"))
SIZE = Quantity(5.02e-5, 2e-7, "rad", 4e-7)


@pytest.fixture(scope="module")
def calibration():
    record = replace(accelcal.simulate(seed=1), serial=EVIL)
    return accelcal.fit(record)


@pytest.fixture(scope="module")
def discovery():
    effect = FoundEffect(
        id="backlash",
        name="backlash of the head",
        parameters={"half_width": SIZE},
        p_value=1e-9,
        gap_before=3.4e-5,
        gap_after=4.6e-6,
        heldout_before=3.4e-5,
        heldout_after=None,
        indistinguishable=("other",),
        to_tell_apart="",
    )
    return accelcal.Discovery(
        noise=(ErrorSource("reading", 4e-6, "g", 100.0, "estimated"),),
        before=Gap(3.4e-5, None, 57.0),
        after=Gap(4.6e-6, 4.8e-6, 1.0),
        where=(),
        effects=(effect,),
        unexplained=Unexplained(f"by time {EVIL}", 0.1, 1e-4),
        undetectable=(),
        smallest_detectable=(),
        faults=(Fault("outlier", "outlier", f"reading 7 {EVIL}", {}, 1e-6, (6,)),),
        notes=(EVIL,),
        serial=EVIL,
        readings=54,
    )


@pytest.fixture(scope="module")
def results(calibration, discovery):
    history = accelcal.history(
        [
            accelcal.fit(replace(accelcal.simulate(seed=n), date=f"202{n}-01-01", serial=EVIL))
            for n in range(3)
        ]
    )
    stand = StandDiscovery(
        units=(EVIL, "B"),
        effects=(
            StandEffect(
                "x", EVIL, "unit", {}, 1e-5, 0.5, 0.1, {EVIL: SIZE, "B": SIZE}, (EVIL,), ()
            ),
        ),
        head=(HeadPosition(45.0, SIZE),),
        coefficients={},
        common=discovery,
        notes=(EVIL,),
    )
    record = replace(accelcal.simulate(seed=2), serial=EVIL, notes=(EVIL,))
    triad = accelcal.read_triad("examples/triad.csv")
    stand_of_paper = accelcal.read_stand("examples/paper-stand.toml")
    stability = replace(analyse(read_stability("examples/stability.csv")), serial=EVIL)
    return {
        "Calibration": calibration,
        "Discovery": discovery,
        "Disagreement": accelcal.compare(calibration, record),
        "StandDiscovery": stand,
        "Stability": stability,
        "ErrorBudget": budget(calibration, np.linspace(-1, 1, 30), temperature=[40.0] * 30),
        "Verdict": judge(calibration, read_specification("examples/al15.toml")),
        "Gate": Gate(EVIL, "warn", EVIL),
        "History": history,
        "TumbleRecord": record,
        "Effect": accelcal.effect("backlash"),
        "DesignComparison": accelcal.design(positions=(8,), strokes=(2,), effects=False),
        "HeadCalibration": replace(accelcal.calibrate_head([record]), source=EVIL),
        "TriadCalibration": replace(accelcal.calibrate_triad(triad), source=EVIL),
        "StandBudget": replace(accelcal.stand_budget(stand_of_paper, record), stand=EVIL),
    }


NAMES = (
    *("Calibration", "Discovery", "Disagreement", "StandDiscovery", "Stability", "ErrorBudget"),
    *("Verdict", "Gate", "History", "TumbleRecord", "Effect", "DesignComparison"),
    *("HeadCalibration", "TriadCalibration", "StandBudget"),
)


@pytest.mark.parametrize("name", NAMES)
def test_html_is_well_formed_and_escaped(results, name):
    html = results[name]._repr_html_()
    assert "<script" not in html
    root = ElementTree.fromstring(f"<div>{html}</div>")
    for table in root.iter("table"):
        assert len({len(row) for row in table.iter("tr")}) == 1, "rows differ in length"


@pytest.mark.parametrize("name", sorted(set(NAMES) - {"Gate", "TumbleRecord", "Effect"}))
def test_a_notebook_tells_what_the_text_tells(results, name):
    """The letters are the same, in the same order, but for the blanks of columns."""
    told = "".join(str(results[name]).split())
    shown = ElementTree.fromstring(f"<div>{results[name]._repr_html_()}</div>").itertext()
    assert "".join(visible("".join(shown).replace("\n", "")).split()) == told


@pytest.mark.parametrize(
    ("name", "least"),
    [("Discovery", 2), ("Disagreement", 2), ("History", 2), ("Stability", 4), ("StandBudget", 2)],
)
def test_results_have_tables(results, name, least):
    assert results[name]._repr_html_().count("<table>") >= least


def test_each_table_of_the_text_is_a_table(results):
    root = ElementTree.fromstring(f"<div>{results['Calibration']._repr_html_()}</div>")
    captions = [table.find("caption").text for table in root.iter("table")]
    assert [told.partition(":")[0] for told in captions[:6:2]] == ["Run 1", "Run 2", "Run 3"]
    assert [cell.text for cell in next(root.iter("tr"))][2:5] == ["value", "U (95 %)", "unit"]


@pytest.mark.parametrize(
    ("quantity", "text"),
    [
        (Quantity(1.34997531, 1.18e-5, "mA/g", 2.31e-5), "1.349975 +- 0.000023 mA/g (95 %)"),
        (Quantity(-3.9021e-5, 1.6e-7, "g/degC", 3.1e-7), "-39.02 +- 0.31 ug/degC (95 %)"),
        (Quantity(3.323e-3, None, "g"), "3.323 mg"),
        (Quantity(None, None, "g"), "unknown"),
    ],
)
def test_a_quantity_has_the_digits_of_its_uncertainty(quantity, text):
    assert str(quantity) == text
    assert repr(quantity) == f"<Quantity {text}>"


BIAS = Quantity(3.323e-3, 7.6e-6, "g", 1.5e-5)


@pytest.mark.parametrize(
    ("quantity", "spec", "text"),
    [
        (BIAS, "", "3.323 +- 0.015 mg (95 %)"),
        (BIAS, ".6f", "0.003323 +- 0.000015 g (95 %)"),
        (BIAS, "+.2e", "+3.32e-03 +- 1.50e-05 g (95 %)"),
        (BIAS, ">31.6f", "  0.003323 +- 0.000015 g (95 %)"),
        (BIAS, ".3f", "0.003 +- 1.5e-05 g (95 %)"),
        (BIAS, ".3", "0.00332 +- 1.5e-05 g (95 %)"),
        (BIAS, "<26", "3.323 +- 0.015 mg (95 %)  "),
        (Quantity(9e-6, 2e-6, "1"), ".1e", "9.0e-06 +- 4.0e-06 (95 %)"),
        (Quantity(3.323e-3, None, "g"), ".4f", "0.0033 g"),
        (Quantity(None, None, "g"), ".4f", "unknown"),
        (Quantity(None, None, "g"), ">9", "  unknown"),
    ],
)
def test_a_quantity_can_be_formatted(quantity, spec, text):
    """A format was refused without a word on what to write."""
    assert format(quantity, spec) == text


@pytest.mark.parametrize("spec", [".1%", "d", "n", ".3s"])
def test_a_format_that_is_none_of_a_quantity_is_refused(spec):
    with pytest.raises(ValueError, match=re.escape(f"format {spec!r} is none of a quantity")):
        format(BIAS, spec)


def test_a_quantity_is_no_bare_number():
    """The text is in mg and the value in g."""
    with pytest.raises(
        TypeError, match=r"^3.323 \+- 0.015 mg \(95 %\) is no bare .* \.value, in g"
    ):
        float(BIAS)


def test_parts_of_results_fit_into_a_line(results):
    parts = [*results["Calibration"].tables, *results["DesignComparison"].designs]
    parts = [*results["Discovery"].effects, *results["History"].trends, *parts]
    parts = [results["Calibration"].tables[0].residuals, results["Stability"].allan, *parts]
    parts += [read_specification("examples/al15.toml")]
    parts += [accelcal.read_stand("examples/paper-stand.toml")]
    parts = [accelcal.twin(accelcal.discover(accelcal.simulate(seed=1))), *parts]
    assert [repr(part) for part in parts if len(repr(part)) >= 100] == []
    assert len(repr(results["Calibration"].temperature_model.K1)) < 200
    assert len(repr(results["Calibration"].tables[0].coefficients)) < 400
    assert "<TableCalibration run 1 at 20.00 degC, mounting o+: 54 readings>" in map(repr, parts)
    assert repr(parts[0]) == "<Twin of AL-15: no effect>"
    assert repr(parts[3]) == "<FoundEffect backlash: half_width 50.20 +- 0.40 urad (95 %)>"
    assert repr(parts[-1]) == "<Stand stand of the paper: 14 components>"


def test_a_fault_of_the_readings_is_not_nothing(discovery):
    assert discovery.unexplained is not None
    told = ": fault outlier; backlash, an effect that nothing explains>"
    assert repr(discovery).endswith(told)
    assert repr(replace(discovery, unexplained=None)).endswith(": fault outlier; backlash>")
    alone = replace(discovery, effects=(), unexplained=None)
    assert repr(alone).endswith(": fault outlier; nothing>")


def test_a_single_one_is_told_in_the_singular(results):
    calibration = results["Calibration"]
    assert repr(budget(calibration, 1.0, temperature=20.0)).endswith(": 1 point>")
    sheet = accelcal.Specification("x", accelcal.Limit("bias", "mg", maximum=5.0))
    assert repr(judge(calibration, sheet)) == "<Verdict x: pass, 1 limit>"


@pytest.mark.parametrize("name", NAMES)
def test_repr_is_one_short_line(results, name):
    text = repr(results[name])
    assert text.startswith(f"<{name} ")
    assert text.endswith(">")
    assert len(text.splitlines()) == 1
    assert len(text) < 160


@pytest.mark.parametrize("name", NAMES)
def test_completion_of_names_shows_nothing_of_how_documents_are_read(results, name):
    shown = {own for own in dir(results[name]) if not own.startswith("_")}
    assert {own for own in shown if own.isupper()} <= {"SCHEMA"}
    assert shown.isdisjoint({"part", "parts"})


def test_numbers_have_units_that_are_easily_read(discovery):
    html = discovery._repr_html_()
    assert "half_width = 50.20 +- 0.40 urad (95 %)" in html
    assert "<td>34.0</td><td>4.60</td><td>ug</td>" in html


def test_a_notebook_tells_whether_model_and_readings_agree(discovery):
    before, after = Quantity(2.7e-4, 3.8e-6, "g/g^2", 7.5e-6), Quantity(8e-5, 3e-4, "g/g^2", 6.1e-4)
    found = replace(discovery, p_value=1e-7, coefficients=(Change("K2", before, after),))
    html = found._repr_html_()
    assert "Model and readings disagree (chance of noise 1e-07). What is missing: bac" in html
    assert "<td>270.0</td><td>7.5</td><td>80</td><td>610</td><td>-190</td>" in html
    clean = replace(found, effects=(), unexplained=None, faults=(), p_value=0.5)._repr_html_()
    assert "Model and readings agree (chance of noise 0.50)" in clean
    assert "K2" not in clean


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_writes_units_as_the_text_does(results, name):
    """One view had both µg and ug, °C and degC, χ² and chi^2."""
    assert not set("µ°²χ±") & set(results[name]._repr_html_())


def test_a_long_budget_is_cut_and_says_so(calibration):
    html = budget(calibration, np.linspace(-1, 1, 100))._repr_html_()
    table = html[html.index("<table>") : html.index("</table>")]
    assert table.count("<tr>") == 61
    assert "and 40 rows more; <code>.to_frame()</code> has all" in html


def test_the_verdict_is_a_table(calibration):
    verdict = judge(calibration, read_specification("examples/al15.toml"))
    html = replace(calibration, verdict=verdict)._repr_html_()
    assert "<caption>Verdict against" in html


def test_a_covariance_is_an_array_in_every_result(results):
    calibration = accelcal.fit(accelcal.simulate(plan=BOTH_SIDES, seed=1))
    table, model = calibration.tables[0], calibration.temperature_model
    triad, head = results["TriadCalibration"], results["HeadCalibration"]
    for part, first in (
        (table, table.coefficients["K0"]),
        (model, model.k0.at_T0),
        (calibration.fixture_angle[0], calibration.fixture_angle[0].angle),
        (triad, triad.parameters[triad.covariance_names[0]]),
        (head, head.quantities()[0]),
    ):
        np.linalg.cholesky(part.covariance)  # as a filter takes it
        assert part.covariance[0, 0] == pytest.approx(first.standard_uncertainty**2)
    unknown = replace(table, covariance_names=(), covariance_matrix=())
    assert unknown.covariance.shape == unknown.correlation.shape == (0, 0)


# -- frozen ----------------------------------------------------------------------------------------


def held_by(part):
    if is_dataclass(part):
        return {item.name: getattr(part, item.name) for item in fields(part)}
    if isinstance(part, Mapping):
        return part
    return dict(enumerate(part)) if isinstance(part, tuple) else {}


def writable(part, path=""):
    """Tell what of a result could be changed in place."""
    if type(part) in (dict, list, set) or (isinstance(part, np.ndarray) and part.flags.writeable):
        yield path
    for name, item in held_by(part).items():
        yield from writable(item, f"{path}.{name}")


@pytest.mark.parametrize("name", NAMES)
def test_what_a_result_holds_is_read_only(results, name):
    assert set(writable(results[name])) == set()


def test_numbers_of_a_result_are_not_scaled_in_place():
    a_i = np.linspace(-1, 1, 3)
    found = budget(accelcal.fit(accelcal.simulate(seed=1)), a_i, temperature=20.0)
    with pytest.raises(ValueError, match="read-only"):
        found.systematic *= 1e6
    a_i *= 2.0  # what was given stays the caller's
    assert found.a_i.tolist() == [-1.0, 0.0, 1.0]


def test_a_record_keeps_its_own_readings_and_the_caller_his():
    record = accelcal.simulate(seed=1)
    logged = np.stack([record.output, record.output], axis=1)
    output = record.output.copy()
    for mine in (output, logged[:, 0]):
        found = replace(record, output=mine)
        mine[0] = 99.0
        assert found == record


def test_a_record_keeps_its_own_metadata_and_the_caller_his(tmp_path):
    mine = {"operator": "A. N."}
    record = replace(accelcal.simulate(seed=1), metadata=mine)
    mine["operator"] = "B. O."
    assert record.metadata == {"operator": "A. N."}
    assert record.select(record.run == 0).metadata is record.metadata  # nothing to copy
    accelcal.write_table(record, tmp_path / "a.csv")
    found = accelcal.read_table(tmp_path / "a.csv")
    assert found == record == pickle.loads(pickle.dumps(record))
    with pytest.raises(TypeError, match="stays as it is"):
        found.metadata["operator"] = "B. O."


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("copied", [copy.deepcopy, lambda part: pickle.loads(pickle.dumps(part))])
def test_a_copy_is_as_read_only_as_the_result(results, name, copied):
    assert set(writable(copied(results[name]))) == set()


def test_a_mapping_of_a_result_is_a_dictionary_that_stays():
    table = accelcal.fit(accelcal.simulate(seed=1)).tables[0]
    mapping = table.coefficients
    changes = [
        lambda: mapping.update(K0=1),
        lambda: mapping.__setitem__("K0", 1),
        lambda: mapping.pop("K0"),
        lambda: mapping.setdefault("x", 1),
        lambda: operator.ior(mapping, {"x": 1}),
        lambda: mapping.__delitem__("K0"),
        mapping.clear,
        mapping.popitem,
    ]
    for change in changes:
        with pytest.raises(TypeError, match=r"stays as it is; change a copy"):
            change()
    assert set(mapping) == {"K0", "K1", "K2", "K3", "M", "M_ip"}
    assert copy.deepcopy(mapping) == pickle.loads(pickle.dumps(mapping)) == dict(mapping)
    assert json.loads(json.dumps(table.budget)) == table.budget
    assert pd.DataFrame(table.budget).loc["head", "K1"] == table.budget["K1"]["head"]


def test_a_name_that_a_mapping_lacks_is_told_those_that_there_are():
    """Whoever looks for k0 among the coefficients reads that it is K0 here."""
    mapping = accelcal.fit(accelcal.simulate(seed=1)).tables[0].coefficients
    with pytest.raises(KeyError, match="'k0' is not here; choose from K0, K1, K2, K3, M, M_ip"):
        mapping["k0"]
    assert mapping.get("k0") is None
    assert "k0" not in mapping
    with pytest.raises(KeyError, match="choose from nothing"):
        type(mapping)({})["k0"]


def test_a_search_that_found_nothing_has_a_frame_of_the_same_columns(results):
    found = [item for item in results.values() if isinstance(item, Discovery | StandDiscovery)]
    assert len(found) == 2
    for something in found:
        nothing = replace(something, effects=())
        nothing = replace(nothing, faults=()) if isinstance(nothing, Discovery) else nothing
        assert nothing.to_frame().shape == (0, something.to_frame().shape[1])
        assert list(nothing.to_frame().columns) == list(something.to_frame().columns)
        assert nothing.to_frame().attrs == something.to_frame().attrs
        numbers = something.to_frame().select_dtypes("number").columns
        assert set(nothing.to_frame().select_dtypes("number").columns) >= set(numbers)


def test_accelerations_are_told_with_their_unit():
    """`print` told the number of the samples alone, and a notebook no unit."""
    found = accelcal.apply(accelcal.fit(accelcal.simulate(seed=1)), [1.35] * 30, temperature=20.0)
    title, head, *rows = str(found).splitlines()
    assert title == "MeasuredAcceleration: 30 samples, in local g; expanded uncertainty of 95 %"
    assert head.split() == list(found.to_frame().columns)
    assert len(rows) == 21  # the first ten, the last ten, and dots between
    assert found._repr_html_().startswith(f"<p>{title}</p><table")


# -- frames ----------------------------------------------------------------------------------------


FRAMES = ("Calibration", "Discovery", "Disagreement", "ErrorBudget", "Stability", "History")
FRAMES += ("HeadCalibration", "TriadCalibration", "StandBudget", "DesignComparison", "Verdict")
FRAMES += ("StandDiscovery",)


@pytest.mark.parametrize("name", FRAMES)
def test_frames_have_units(results, name):
    frame = results[name].to_frame()
    assert len(frame)
    units = frame.attrs["units"]
    assert set(units) <= set(frame.columns)
    assert units
    assert all(frame[column].dtype.kind in "fi" for column in units)
    assert {"hours", "floor"} & set(frame.columns) <= set(units)
    assert not {"name", "term", "change"} & set(frame.columns)


def test_a_record_is_a_frame(results):
    record = results["TumbleRecord"]
    frame = record.to_frame()
    assert len(frame) == len(record)
    assert frame.attrs["units"]["output"] == "mA"
    assert frame.attrs["units"]["angle"] == "deg"
    assert frame["output"].to_numpy() == pytest.approx(record.output)
    assert set(frame["run"]) == set(record.run_labels)
    again = accelcal.read_arrays(frame)
    assert again.output == pytest.approx(record.output)
    assert again.run_labels == record.run_labels
    assert (again.mounting == record.mounting).all()


def test_a_part_of_a_record_counts_its_own_runs(results):
    record = results["TumbleRecord"]
    part = record.select(run="2")
    assert repr(part).endswith("54 readings, 1 run, 8 positions>")
    assert [repr(table) for table in record.tables()][1] == repr(part)
    assert len(record.tables()) == 3
    assert part.select(part.stroke == 2, run="2") == record.select(
        (record.run == 1) & (record.stroke == 2)
    )
    for run in ("4", 1):
        with pytest.raises(
            accelcal.InputError, match=r"run '?\d'? is unknown; choose from 1, 2, 3"
        ):
            record.select(run=run)


def test_plot_of_pandas_is_told_the_pictures(results):
    assert not hasattr(results["Calibration"].plot, "__dict__")
    with pytest.raises(accelcal.InputError, match=r"^\.plot\(\) is no picture; choose .*residuals"):
        results["Calibration"].plot(kind="line")
    drawn = ("Discovery", "Disagreement", "Stability", "ErrorBudget", "History", "StandBudget")
    for name in (*drawn, "DesignComparison"):
        with pytest.raises(accelcal.InputError, match=r"choose \.plot\.\w+\(\)"):
            results[name].plot()


# -- equality --------------------------------------------------------------------------------------


def with_arrays(calibration):
    """Make what holds arrays, anew at each call."""
    stand = accelcal.read_stand("examples/paper-stand.toml")
    record = accelcal.simulate(seed=2)
    frames = [pd.DataFrame({"a": [1.0, np.nan]})] * 3
    return {
        "record": record,
        "acceleration": accelcal.accelerations([0.0, 45.0]),
        "estimates": accelcal.estimate_tables(record.output[None, :54], record.angle[:54]),
        "measured": accelcal.apply(calibration, [1.0, np.nan], temperature=20.0),
        "budget": budget(calibration, [0.0, 1.0], temperature=[40.0, 41.0]),
        "stand budget": accelcal.stand_budget(stand, record),
        "stability": read_stability("examples/stability.csv"),
        "triad": accelcal.read_triad("examples/triad.csv"),
        "batch": accelcal.BatchFrames(*(frame.copy() for frame in frames)),
    }


def test_what_holds_arrays_is_equal_by_them(calibration):
    others = with_arrays(calibration)
    for name, one in with_arrays(calibration).items():
        other = others[name]
        assert (one == other, one != other, one in [other]) == (True, False, True), name
        assert pickle.loads(pickle.dumps(one)) == one == copy.deepcopy(one), name
        assert one != "text", name


def test_another_number_makes_it_unequal(calibration):
    things = with_arrays(calibration)
    measured, acceleration = things["measured"], things["acceleration"]
    assert measured != replace(measured, value=measured.value + 1e-9)
    assert acceleration != acceleration._replace(output=np.ones(2))
    assert acceleration != acceleration._replace(output=np.zeros(3))
    assert things["record"] == replace(things["record"], source="elsewhere")
    assert things["triad"] != replace(things["triad"], up=None)
    frames = things["batch"]
    assert frames != frames._replace(laws=frames.laws + 1.0)


def test_launches_are_counted():
    stability = analyse(read_stability("examples/stability.csv"))
    assert f"{len(stability.launches)} launches" in stability._repr_html_()


def test_what_has_a_serial_number_is_named_by_it():
    """Blocks and launches were named by their file, all else by the serial number."""
    stability = replace(read_stability("examples/stability.csv"), serial="A-1")
    triad = replace(accelcal.read_triad("examples/triad.csv"), serial="B-1")
    assert repr(stability).startswith("<StabilityRecord serial A-1: ")
    assert repr(triad).startswith("<TriadRecord serial 'B-1': ")
    assert repr(accelcal.calibrate_triad(triad)).startswith("<TriadCalibration serial B-1: ")


def test_a_launch_is_one_short_line():
    launch = read_stability("examples/stability.csv").launches[0]
    assert repr(launch) == "<Launch 1: 720 samples in 3595 s>"


def test_parts_of_a_calibration_show_values(calibration):
    table, laws = calibration.tables[0], calibration.temperature_model
    for part, told in ((table, "K1"), (laws, "K1 at_T0")):
        assert told in part._repr_html_()
    assert repr(laws) == "<TemperatureModel of k0, K1, delta>"
    assert str(laws).splitlines()[3] == f"K1 at_T0: {laws.K1.at_T0}"


def test_a_batch_shows_its_frames(tmp_path):
    accelcal.write_table(accelcal.simulate(seed=1), tmp_path / "a.csv")
    (tmp_path / "b.csv").write_text("nothing of use")
    found = accelcal.batch(tmp_path)
    found.tables.loc[1, ["gate_drift", "gate_lack_of_fit"]] = "warn"
    assert repr(found) == "<BatchFrames: 3 tables, 9 terms of laws, 1 error>"
    html = found._repr_html_()
    assert html.count("<table") == 3
    for told in (
        "<code>.tables</code>, 3 rows",
        "<th>K1_expanded_uncertainty</th>",
        "<td>drift, lack of fit</td>",  # the texts of all warnings filled the page
        "<th>message</th>",
    ):
        assert told in html  # the columns of numbers were cut out of the middle


# -- as others show it -----------------------------------------------------------------------------


def test_a_text_keeps_its_columns_where_a_notebook_is_exported(results):
    """A page of nbconvert sets ``<pre>`` as the text around it, and ``<code>`` in equal widths."""
    html = results["TriadCalibration"]._repr_html_()
    assert html.startswith("<pre><code>")
    assert html.endswith("</code></pre>")


def test_readings_and_residuals_have_their_units_in_the_headings(calibration):
    launch = accelcal.Launch("1", [0.0, 1.0, 2.0], [0.1, 0.2, 0.1], [20.0, 20.0, 20.0])
    assert "<th>output [mA]</th>" in accelcal.StabilityRecord([launch], unit="mA")._repr_html_()
    block = accelcal.TriadRecord([[0.1, 0.0, 1.0]], [[0.0, 0.0, 1.0]], unit="mA")
    assert "<th>x [mA]</th>" in block._repr_html_()
    html = calibration.tables[0].residuals._repr_html_()
    assert [f"<th>{name}</th>" in html for name in ("angle [deg]", "stroke", "value [g]")] == 3 * [
        True
    ]


def test_random_errors_are_told_in_a_line(calibration):
    found = accelcal.random_part(calibration, hysteresis=3e-4, drift_rate=1e-9)
    assert repr(found) == (
        "<RandomPart: launch 2.01e-05 g, drift 1e-09 g/s, hysteresis 0.0003 g,"
        " scale_factor 1.5e-05 of K1>"
    )
    assert repr(accelcal.RandomPart()) == "<RandomPart: nothing known>"
    with pytest.raises(accelcal.InputError, match="drift_rate is -1; it is 0 or more"):
        accelcal.random_part(calibration, drift_rate=-1)


@pytest.mark.parametrize(
    "work",
    [
        float,
        int,
        abs,
        round,
        operator.neg,
        lambda q: 2 * q,
        lambda q: q / 1.35,
        lambda q: np.float64(2.0) * q,
        lambda q: q - q,
        lambda q: q**2,
        lambda q: q > 1.3,
        lambda q: max(q, q),
    ],
)
def test_a_quantity_says_what_to_calculate_with(calibration, work):
    """Only `float` did; the others said that an operand is not supported."""
    quantity = calibration.tables[0].coefficients["K1"]
    with pytest.raises(TypeError, match=r"is no bare number; take .value, in mA/g, or .standard_"):
        work(quantity)


def test_the_text_names_no_measurement_that_is_not_known(discovery):
    """It ended in "To tell them apart: .", with nothing between."""
    assert "It could as well be: other." in str(discovery)
    assert "To tell them apart" not in str(discovery)


def test_a_caption_broken_to_fit_the_width_is_whole():
    """The first half of it stood above the table as a text of its own."""
    stand = accelcal.read_stand("examples/paper-stand.toml")
    html = accelcal.stand_budget(stand, accelcal.simulate(seed=1))._repr_html_()
    captions = re.findall("<caption>(.*?)</caption>", html)
    assert captions[0].startswith("Uncertainty of each coefficient: u standard")
    assert captions[0].endswith("u^2 by component")
    assert captions[1].startswith("What each component does: its standard uncertainty")


def test_what_is_told_of_jumps_is_no_caption():
    records = [replace(accelcal.simulate(seed=n), date=f"20{10 + n}-06-01") for n in range(4)]
    html = accelcal.history(map(accelcal.fit, records))._repr_html_()
    assert re.findall("<caption>(.*?)</caption>", html) == ["calibrations"] * 2
