"""Records from arrays: equal to those of the file, by the same rules."""

import io
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pandas as pd
import pytest

import accelcal
from accelcal.errors import TableError


def simulated(**plan):
    return accelcal.simulate(plan=accelcal.TumblePlan(**plan), seed=7)


def columns_of(record):
    names = ("temperature", "position", "stroke", "output", "mounting", "time")
    columns = {name: getattr(record, name) for name in names}
    return columns | {"run": np.array(record.run_labels)[record.run]}


@pytest.mark.parametrize("form", [dict, pd.DataFrame])
def test_arrays_give_the_record_of_the_file(form):
    record = simulated()
    declared = {
        name: value
        for name in record.apparatus.__slots__
        if (value := getattr(record.apparatus, name)) is not None
    }
    declared |= {"reference_temperature": record.reference_temperature}
    declared |= {"unit": record.unit, "serial": record.serial}
    found = accelcal.read_arrays(form(columns_of(record)), overrides=declared)
    for name in ("output", "angle", "temperature", "stroke", "run", "position", "time"):
        assert np.array_equal(getattr(found, name), getattr(record, name)), name
    assert found.run_labels == record.run_labels
    assert found.apparatus == record.apparatus
    assert found.source == "<arrays>"
    ours, theirs = accelcal.fit(found), accelcal.fit(record)
    assert [t.coefficients for t in ours.tables] == [t.coefficients for t in theirs.tables]


def test_single_values_stand_for_all_readings():
    columns = {"J": [1, 3, 5, 7], "k": 1, "T [degC]": 20.0, "Y [mA]": [1.354, 0.006, -1.346, 0.003]}
    found = accelcal.read_arrays(columns)
    assert found.stroke.tolist() == [1, 1, 1, 1]
    assert found.temperature.tolist() == [20.0] * 4
    assert found.unit == "mA"


def test_a_wide_frame_with_gaps_is_read():
    frame = pd.DataFrame({"position": [1, 5], "Y1": [1.3, -1.2], "Y2": [None, -1.3]})
    found = accelcal.read_arrays(frame.assign(temperature=20), overrides={"unit": "V"})
    assert found.output.tolist() == [1.3, -1.2, -1.3]
    assert "1 missing reading" in " ".join(found.notes)


def test_a_masked_output_is_missing():
    record = simulated(temperatures=20.0)
    output = np.ma.array(record.output, mask=np.arange(len(record)) == 5, copy=True)
    output.data[5] = 1.0
    found = accelcal.read_arrays({**columns_of(record), "output": output})
    assert found.output.tolist() == np.delete(record.output, 5).tolist()


def test_an_index_with_names_holds_columns():
    frame = pd.DataFrame(columns_of(simulated(temperatures=20.0)))
    plain = accelcal.read_arrays(frame)
    assert accelcal.read_arrays(frame.set_index(["temperature", "position"])) == plain
    assert accelcal.read_arrays(frame.set_index("position", drop=False)) == plain
    wide = frame.pivot_table("output", ["temperature", "position"], "stroke")
    found = accelcal.read_arrays(wide)
    assert sorted(found.output) == sorted(plain.output)


def test_series_of_different_order_are_not_set_side_by_side():
    frame = pd.DataFrame(columns_of(simulated(temperatures=20.0)))
    columns = dict(frame.items()) | {"output": frame["output"].sort_values()}
    with pytest.raises(accelcal.InputError, match="and output are Series of different ind"):
        accelcal.read_arrays(columns)
    assert accelcal.read_arrays(pd.DataFrame(columns)) == accelcal.read_arrays(frame)


def test_units_of_a_frame_are_those_of_its_columns():
    record = accelcal.simulate(seed=1)
    found = accelcal.read_arrays(record.to_frame())
    assert found.unit == record.unit == "mA"
    assert accelcal.fit(found).tables[0].coefficients["K1"].unit == "mA/g"
    frame = record.to_frame().rename(columns={"output": "Y [V]"})
    frame.attrs["units"]["Y [V]"] = "mA"
    assert accelcal.read_arrays(frame).unit == "V"
    frame = accelcal.simulate(seed=1).to_frame()
    frame.attrs["units"]["temperature"] = "K"
    with pytest.raises(accelcal.TableError, match="they are in K, by their heading or cells"):
        accelcal.read_arrays(frame)
    unitless = replace(record, unit=None).to_frame()
    assert "output" not in unitless.attrs["units"]
    assert accelcal.read_arrays(unitless).unit is None


@pytest.mark.parametrize("known", [0, 3])
def test_a_frame_of_a_record_of_angles_is_taken_back(known):
    """Numbers of positions that nobody gave stood as 0 in it, and were refused."""
    record = accelcal.simulate(seed=1)
    number = np.where(np.arange(len(record)) < known, record.position, 0)
    angles = replace(record, position=number)
    assert accelcal.read_arrays(angles.to_frame()) == angles


@pytest.mark.parametrize("as_column", [pd.Index, pd.array])
def test_columns_of_pandas_without_an_index(as_column):
    frame = pd.DataFrame(columns_of(simulated(temperatures=20.0)))
    columns = dict(frame.items()) | {"position": as_column(frame["position"])}
    assert accelcal.read_arrays(columns) == accelcal.read_arrays(frame)


def test_two_columns_of_one_name_are_refused():
    frame = pd.DataFrame(columns_of(simulated(temperatures=20.0)))
    twice = pd.concat([frame, frame[["output"]] + 1.0], axis=1)
    with pytest.raises(accelcal.TableError, match="'output' and 'output' mean the same"):
        accelcal.read_arrays(twice)


@pytest.mark.parametrize("zone", ["", "Z"])
def test_dates_become_seconds(zone):
    time = pd.to_datetime([f"2024-05-31T14:30:00.0{zone}", f"2024-05-31T14:31:00.5{zone}"])
    frame = pd.DataFrame({"position": [1, 5], "stroke": 1, "temperature": 20, "time": time})
    found = accelcal.read_arrays(frame.assign(output=[1.3, -1.3]))
    assert found.time.tolist() == [0.0, 60.5]
    assert found.metadata["start"].startswith("2024-05-31T14:30:00")


def test_digits_and_odd_texts_are_kept():
    columns = {"position": [1, 5], "stroke": 1, "temperature": 20.0}
    columns |= {"output": [1 / 3, -1e-17], "run": ['a, "b"\n; c', "d"]}
    found = accelcal.read_arrays(columns)
    assert found.output.tolist() == [1 / 3, -1e-17]
    assert found.run_labels == ('a, "b" ; c', "d")


GOOD = {"position": [1, 5], "stroke": 1, "temperature": 20.0, "output": [1.3, -1.3]}


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ([1.0, 2.0], "list in place of columns; give a mapping"),
        ("table.csv", "str in place of columns"),
        (
            type("DataFrame", (), {"to_pandas": None})(),  # as of polars
            "DataFrame in place of columns; give its .to_pandas\\(\\), a mapping",
        ),
        (GOOD | {"output": [1.0, 2.0, 3.0]}, r"different shapes, position \(2,\).*shape \(n,\)"),
        (GOOD | {"output": [[1.0], [2.0]]}, r"output \(2, 1\)"),
        ({}, "headings|empty|readings"),
        (GOOD | {"output": []}, "different shapes"),
        ({name: [] for name in GOOD}, "no readings"),
        ({"position": [1], "output": [1.3]}, "no column for temperature"),
        (GOOD | {"stroke": [1, 0]}, "<arrays>:3: stroke '0' is not a whole number"),
        (GOOD | {"output": ["1.3", "open"]}, "<arrays>:3: output 'open' is not a number"),
        (GOOD | {"temperature": 293.15}, "<arrays>:2: .*write temperatures in degC"),
        (GOOD | {"output": [1.3, np.inf]}, "<arrays>:3: .*infinite"),
    ],
)
def test_what_a_table_may_not_hold_arrays_may_not_hold(columns, said):
    with pytest.raises(accelcal.InputError, match=said) as caught:
        accelcal.read_arrays(columns)
    assert "\n" not in str(caught.value)


def test_large_arrays_are_read_in_bulk():
    n = 60_000
    angle = np.linspace(0.0, 360.0, n)
    output = np.cos(np.radians(angle)) + 1e-9 * np.arange(n)
    columns = {"angle": angle, "stroke": 1, "temperature": 20.0, "output": output}
    found = accelcal.read_arrays(columns)
    assert np.array_equal(found.output, output)


@pytest.mark.parametrize("thing", ["al15.csv", pd.DataFrame(GOOD), None, [1.0]])
def test_fit_tells_how_to_make_a_record(thing):
    with pytest.raises(accelcal.InputError, match=r"accelcal\.read_table.*accelcal\.read_arrays"):
        accelcal.fit(thing)


# -- declarations of a frame -----------------------------------------------------------------------


@pytest.mark.parametrize("plan", [{}, {"positions": 12, "delta0": 1e-3, "timed": True}])
def test_a_frame_declares_what_its_record_did(plan):
    record = accelcal.simulate(plan=accelcal.TumblePlan(**plan), seed=1)
    frame = record.to_frame()
    assert accelcal.read_arrays(frame) == record
    assert accelcal.read_arrays(frame.drop(columns="angle")) == record
    assert json.loads(json.dumps(frame.attrs)) == frame.attrs  # as a file of Parquet keeps it
    second = accelcal.read_arrays(frame[frame["run"] == "2"])
    assert second.apparatus == record.apparatus
    assert len(second.tables()) == 1


def test_columns_and_caller_win_over_what_a_frame_declares():
    record = accelcal.simulate(seed=1)
    frame = record.to_frame().assign(serial="B")
    given = {"launch_uncertainty": 1e-4, "reference_temperature": 0.0, "serial": None}
    found = accelcal.read_arrays(frame, overrides=given)
    assert found.serial == "B"
    assert found.reference_temperature == 0.0
    assert found.apparatus == replace(record.apparatus, launch_uncertainty=1e-4)


def test_two_units_in_a_frame_are_refused_whatever_it_declares():
    one = accelcal.simulate(seed=1).to_frame()
    both = pd.concat([one.assign(serial="A"), one.assign(serial="B")])
    assert both.attrs["declared"]["serial"] == "AL-15"
    with pytest.raises(accelcal.TableError, match="A, B"):
        accelcal.read_arrays(both)


def test_samples_are_averaged_as_the_guide_has_it(tmp_path, monkeypatch):
    record = simulated()
    sampled = pd.concat([record.to_frame()] * 4, ignore_index=True)
    sampled["output"] += np.repeat([-2e-6, 0.0, 0.0, 2e-6], len(record))
    in_order = np.arange(len(sampled)).reshape(4, -1).T.ravel()
    text = sampled.iloc[in_order].to_csv(index=False)
    with pytest.raises(accelcal.TableError, match="average the samples of a reading"):
        accelcal.read_table(io.StringIO(text))
    monkeypatch.chdir(tmp_path)
    Path("samples.csv").write_text(f"# unit: mA\n{text}", "utf-8")
    guide = (Path(__file__).parents[1] / "docs" / "csv-forms.md").read_text("utf-8")
    (code,) = re.findall(
        r"^```python\n([^`]*samples\.csv.*?)^```$", guide, re.DOTALL | re.MULTILINE
    )
    names = {"accelcal": accelcal}
    exec(code, names)
    found = names["record"]
    np.testing.assert_allclose(found.output, record.output, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(found.position, record.position)
    np.testing.assert_array_equal(found.run, record.run)
    np.testing.assert_allclose(found.std, np.std([-2e-6, 0.0, 0.0, 2e-6], ddof=1), rtol=1e-6)
    assert set(found.count) == {4.0}
    assert accelcal.fit(found).tables[0].coefficients["K1"].value is not None


@pytest.mark.parametrize("kind", [np.int64, np.float64, "Float64", object, str])
def test_a_label_is_the_same_whatever_its_type(kind):
    frame = simulated().to_frame().assign(run=np.arange(162) // 54 + 1, serial=15)
    found = accelcal.read_arrays(frame.astype({"run": kind, "serial": kind}))
    assert (found.serial, found.run_labels) == ("15", ("1", "2", "3"))


@pytest.mark.parametrize("missing", [None, np.nan, pd.NA])
def test_a_missing_label_is_refused(missing):
    frame = simulated().to_frame().astype({"run": object})
    frame.loc[3, "run"] = missing
    with pytest.raises(accelcal.TableError, match="<arrays>:5: run is empty"):
        accelcal.read_arrays(frame)


@pytest.mark.parametrize(
    ("taker", "name"),
    [
        (accelcal.TumblePlan, "angles"),
        (accelcal.TumblePlan, "temperatures"),
        (accelcal.design, "angles"),
        (accelcal.design, "temperatures"),
        (accelcal.optimal_design, "temperatures"),
        (accelcal.analyse, "times"),
    ],
)
def test_type_checkers_are_told_that_an_array_is_taken(taker, name):
    declared = get_type_hints(taker)[name]
    assert "numpy.ndarray" in str(declared) or "NDArray" in str(declared)  # as numpy has it


@pytest.mark.parametrize(("name", "value"), [("temperature", 20), ("stroke", 1)])
def test_what_one_value_would_tell_is_asked_for_as_such(name, value):
    columns = {"output": [1.3, 0.0, -1.3], "angle": [0, 90, 180], "temperature": 20, "stroke": 1}
    del columns[name]
    with pytest.raises(accelcal.TableError) as caught:
        accelcal.read_arrays(columns)
    remedy = f"add a column {name} or one value for all readings, {{'{name}': {value}}}"
    assert str(caught.value).endswith(remedy)
    assert len(accelcal.read_arrays({**columns, name: value})) == 3


def test_what_a_frame_declares_may_be_given_again():
    """Of the declarations of a record, the date and the metadata were refused."""
    given = {"date": "2024-05-31", "metadata": {"operator": "A. Meyer"}}
    record = accelcal.read_table("examples/al15.csv", overrides=given)
    assert record.date == "2024-05-31"
    assert record.metadata["operator"] == "A. Meyer"
    frame = record.to_frame()
    declared = frame.attrs.pop("declared")
    assert accelcal.read_arrays(frame, overrides=declared) == record


@pytest.mark.parametrize("given", [{"date": 20240531}, {"metadata": "A. Meyer"}])
def test_declarations_of_another_kind_are_refused(given):
    with pytest.raises(accelcal.InputError, match=next(iter(given))):
        accelcal.read_table("examples/al15.csv", overrides=given)


def test_the_remedy_for_a_frame_of_several_accelerometers_works():
    """It named read_tables, which takes no frame."""
    parts = [accelcal.simulate(seed=seed).to_frame().assign(serial=f"A{seed}") for seed in (1, 2)]
    frame = pd.concat(parts, ignore_index=True)
    with pytest.raises(
        TableError, match=r"give one at a time, as each of frame.groupby\('serial'\)"
    ):
        accelcal.read_arrays(frame)
    records = [accelcal.read_arrays(part) for _, part in frame.groupby("serial")]
    assert [record.serial for record in records] == ["A1", "A2"]


@pytest.mark.parametrize("text", ["U4", "S4", object])
def test_an_array_with_fields_is_read_by_their_names(text):
    """It was refused, and bytes would have been texts as b'A-7'."""
    names = ("temperature", "position", "stroke", "Y [mA]", "serial")
    rows = [(20.0, j, 1, y, "A-7") for j, y in ((1, 1.35), (3, np.nan), (5, -1.3))]
    array = np.array(rows, dtype=list(zip(names, (float, int, int, float, text), strict=True)))
    record = accelcal.read_arrays(array)
    assert (record.serial, record.unit, record.output.tolist()) == ("A-7", "mA", [1.35, -1.3])
    assert record.notes == ("1 missing reading was left out (line 3)",)
    for other in (array.view(np.recarray), np.ma.array(array)):
        assert accelcal.read_arrays(other).output.tolist() == [1.35, -1.3]
    with pytest.raises(accelcal.InputError, match="columns of different shapes"):
        accelcal.read_arrays(array.reshape(3, 1))


def test_a_pivot_table_by_cycle_and_direction():
    """Names of several levels were texts with brackets, and no headings."""
    frame = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=20.0, strokes=4)).to_frame()
    frame["cycle"] = (frame["stroke"] + 1) // 2
    frame["direction"] = np.where(frame["stroke"] % 2, "forward", "back")
    long = accelcal.read_arrays(frame[["temperature", "position", "stroke", "output"]])
    for levels in (["cycle", "direction"], ["direction", "cycle"]):
        wide = frame.pivot(index=["temperature", "position"], columns=levels, values="output")
        of_text = accelcal.read_table(io.StringIO(wide.to_csv()))
        for record in (
            accelcal.read_arrays(wide),
            accelcal.read_arrays(wide.reset_index()),
            of_text,
        ):
            found = zip(record.position, record.stroke, record.output, strict=True)
            assert sorted(found) == sorted(
                zip(long.position, long.stroke, long.output, strict=True)
            )


@pytest.mark.parametrize("level", ["serial", "temperature"])
def test_a_pivot_table_by_serial_or_temperature_and_direction_is_refused(level):
    """Accelerometers 1 and 2 were cycles of one, without a word."""
    frame = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=20.0, strokes=2)).to_frame()
    frame["direction"] = np.where(frame["stroke"] % 2, "forward", "back")
    both = pd.concat(frame.assign(**{level: own}) for own in ("1", "2"))
    index = [own for own in ("temperature", "position") if own != level]
    wide = both.pivot(index=index, columns=[level, "direction"], values="output")
    with pytest.raises(accelcal.InputError):
        accelcal.read_arrays(wide)
    with pytest.raises(accelcal.InputError):
        accelcal.read_table(io.StringIO(f"# temperature: 20\n{wide.to_csv()}"))


@pytest.mark.parametrize("fill", [None, -9999.0])
def test_what_is_masked_is_missing_whatever_would_fill_it(fill):
    """Of an array with fields it was 1e20."""
    rows = [(20.0, 1, 1, 1.35), (20.0, 3, 1, 0.0), (20.0, 5, 1, -1.3)]
    names = ("temperature", "position", "stroke", "output")
    array = np.array(rows, dtype=list(zip(names, (float, int, int, float), strict=True)))
    masked = np.ma.array(array, mask=[(False, False, False, own == 1) for own in range(3)])
    column = np.ma.array(array["output"], mask=[0, 1, 0], fill_value=fill)
    for given in (masked, {**{name: array[name] for name in names}, "output": column}):
        assert accelcal.read_arrays(given).output.tolist() == [1.35, -1.3]


def test_texts_of_bytes_that_are_not_utf_8_stay_apart():
    """A serial of two, Ä-7 and Ö-7, was one."""
    frame = {"temperature": 20.0, "position": np.array([1, 5]), "stroke": 1, "output": [1.3, -1.3]}
    with pytest.raises(accelcal.InputError, match="in one table; give one at a time"):
        accelcal.read_arrays({**frame, "serial": np.array([b"\xc4-7", b"\xd6-7"])})
