"""A batch of tables of many accelerometers, some of which have faulty rows."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import accelcal
from accelcal.archive import journal, parts
from accelcal.errors import TableError

PLAN = accelcal.TumblePlan(temperatures=(20.0,), positions=8, strokes=2)
SERIALS = [f"S{n:02d}" for n in range(12)]
HEADINGS = "serial,temperature,position,stroke,output"


def rows_of(serial, seed):
    record = accelcal.simulate(seed=seed, plan=PLAN)
    readings = zip(record.position, record.stroke, record.output.tolist(), strict=True)
    return [f"{serial},20.0,{j},{k},{y!r}" for j, k, y in readings]


def write(path, rows, head=f"# unit: mA\n{HEADINGS}"):
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def good_rows():
    return [row for seed, serial in enumerate(SERIALS) for row in rows_of(serial, seed)]


def spoilt(rows, place, **cells):
    """The rows, with other cells in one of them."""
    names = HEADINGS.split(",")
    old = dict(zip(names, rows[place].split(","), strict=True))
    return [*rows[:place], ",".join((old | cells).values()), *rows[place + 1 :]]


def frames_alike(found, expected, *but):
    for one, other in zip(found, expected, strict=True):
        aside = [name for name in ("line", "sha256", *but) if name in one]
        pd.testing.assert_frame_equal(one.drop(columns=aside), other.drop(columns=aside))


FAULTS = {
    "text": {"output": "OL"},
    "infinite": {"output": "inf"},
    "marker": {"output": "9999"},
    "position": {"position": "99"},
    "stroke": {"stroke": "0"},
    "kelvin": {"temperature": "293.15"},
    "decimal comma": {"output": "1,3"},
}


@pytest.mark.parametrize("cells", FAULTS.values(), ids=FAULTS)
@pytest.mark.parametrize("mixed", [False, True], ids=["sorted", "in any order"])
def test_a_faulty_cell_costs_its_serial_alone(tmp_path, cells, mixed):
    rows = good_rows()
    if mixed:
        rows = [rows[i] for i in np.random.default_rng(1).permutation(len(rows))]
    path, place = tmp_path / "a.csv", 40
    serial = rows[place].split(",")[0]
    left = [row for row in rows if not row.startswith(serial)]
    expected = accelcal.batch(write(path, left))
    found = accelcal.batch(write(path, spoilt(rows, place, **cells)))
    assert set(expected.tables["serial"]) == set(SERIALS) - {serial}
    frames_alike(found[:2], expected[:2])
    with pytest.raises(TableError) as refused:
        accelcal.read_tables(path)
    assert found.errors.to_numpy().tolist() == [[str(path), str(refused.value)]]
    assert str(refused.value).startswith(f"{path}:{place + 3}: ")


def test_each_faulty_serial_is_told_with_its_own_line(tmp_path):
    rows = spoilt(spoilt(good_rows(), 150, output="OL"), 20, position="0")
    rows[-1] = rows[-1].rsplit(",", 2)[0]  # cut short
    path = write(tmp_path / "a.csv", rows)
    found = accelcal.batch(path)
    assert [message.split(": ")[0] for message in found.errors["message"]] == [
        f"{path}:{line}" for line in (23, 153, len(rows) + 2)
    ]
    assert found.tables["serial"].nunique() == len(SERIALS) - 3


@pytest.mark.parametrize("cells", FAULTS.values(), ids=FAULTS)
def test_a_large_table_follows_the_same_rule(tmp_path, monkeypatch, cells):
    path = write(tmp_path / "a.csv", spoilt(good_rows(), 40, **cells))
    whole = accelcal.batch(path)
    monkeypatch.setattr(parts, "LARGE", 3000)
    monkeypatch.setattr(parts, "PART", 1500)
    found = accelcal.batch(path)
    assert found.errors.equals(whole.errors)
    assert found.tables[["serial", "K1"]].equals(whole.tables[["serial", "K1"]])


@pytest.mark.parametrize("form", ["csv.gz", "parquet"])
def test_other_forms_of_the_table(tmp_path, form):
    pytest.importorskip("pyarrow")
    frame = pd.DataFrame([row.split(",") for row in good_rows()], columns=HEADINGS.split(","))
    frame.loc[40, "output"] = "OL"
    path = tmp_path / f"a.{form}"
    frame.to_parquet(path) if form == "parquet" else frame.to_csv(path, index=False)
    found = accelcal.batch(path)
    assert found.tables["serial"].nunique() == len(SERIALS) - 1
    assert found.errors["message"].str.startswith(f"{path}:42: output 'OL' is not").tolist() == [
        True
    ]


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("place", [40, 47, 48])
def test_a_row_without_a_serial_is_a_fault_of_its_own(tmp_path, monkeypatch, large, place):
    rows = good_rows()
    expected = accelcal.batch(write(tmp_path / "a.csv", rows[:place] + rows[place + 1 :]))
    if large:
        monkeypatch.setattr(parts, "LARGE", 3000)
        monkeypatch.setattr(parts, "PART", 1500)
    found = accelcal.batch(write(tmp_path / "a.csv", spoilt(rows, place, serial="")))
    assert len(found.tables) == len(SERIALS)
    frames_alike(found[:2], expected[:2], "notes")
    told = f"{tmp_path / 'a.csv'}:{place + 3}: serial is empty; write the serial in every row"
    assert found.errors["message"].tolist() == [told]
    note = f"1 row was left out (line {place + 3}) whose serial is empty"
    assert note in found.tables["notes"].tolist()


def test_rows_without_a_serial_are_counted_in_the_error_and_in_every_record(tmp_path):
    rows = good_rows()
    for place in (3, 40, 41):
        rows = spoilt(rows, place, serial="")
    found = accelcal.batch(write(tmp_path / "a.csv", rows))
    (told,) = found.errors["message"]
    assert told.startswith(f"{tmp_path / 'a.csv'}:6: serial is empty in 3 rows (lines 6, 43, 44);")
    note = "3 rows were left out (lines 6, 43, 44) whose serial is empty"
    assert found.tables["notes"].tolist() == [note] * len(SERIALS)


def semicolons(rows):
    return [*rows[:60], *(row.replace(",", ";") for row in rows[60:])]


def with_a_decimal_comma():
    """Rows of serials 1 to 8; of one reading the cells to its right are those of serial 5."""
    rows = []
    for serial in range(1, 9):
        for row in rows_of(str(serial), serial):
            _, temperature, position, stroke, output = row.split(",")
            rows.append(",".join([output, position, temperature, str(serial), stroke]))
    rows[40] = rows[40].replace(",20.0,", ",20,5,")
    return rows


STRUCTURE = {
    "a column is missing": ([row.rsplit(",", 1)[0] for row in good_rows()], HEADINGS[:-7]),
    "mixed delimiters": (semicolons(good_rows()), HEADINGS),
    "most with others": ([row.replace(",", ";") for row in good_rows()], HEADINGS),
    "no rows": ([], HEADINGS),
    "serials in every second row": (
        [row[3 * (n % 2) :] for n, row in enumerate(good_rows())],
        HEADINGS,
    ),
    "one serial in two ways": (
        spoilt([row.replace("S0", "").replace("S", "") for row in good_rows()], 40, serial="02.0"),
        HEADINGS,
    ),
    "cells may be shifted": (
        with_a_decimal_comma(),
        "output,position,temperature,serial,stroke",
    ),
    "units differ": (
        [row + " mA" if "S05" in row else row + " V" for row in good_rows()],
        HEADINGS,
    ),
    "a header line inside": ([*good_rows(), "# T0: 30"], HEADINGS),
    "serial is declared as well": (good_rows(), f"# serial: X\n{HEADINGS}"),
}


@pytest.mark.parametrize(("rows", "head"), STRUCTURE.values(), ids=STRUCTURE)
def test_faults_of_the_whole_table_are_one_error(tmp_path, rows, head):
    path = write(tmp_path / "a.csv", rows, head)
    found = accelcal.batch(path)
    with pytest.raises(TableError) as refused:
        accelcal.read_tables(path)
    assert found.tables.empty
    assert found.errors["message"].tolist() == [str(refused.value)]


def book_of(path, sheets, declared=""):
    """A workbook of a sheet for each list of rows, perhaps with a serial above them."""
    pytest.importorskip("openpyxl")
    with pd.ExcelWriter(path) as book:
        for name, rows in sheets.items():
            cells = [row.split(",") for row in [HEADINGS, *rows]]
            if declared:
                cells = [
                    [f"# serial: {declared.format(name)}", "", "", ""],
                    *(own[1:] for own in cells),
                ]
            frame = pd.DataFrame(cells)
            frame.to_excel(book, sheet_name=name, index=False, header=False)
    return path


ROWS_OF = {serial: rows_of(serial, seed) for seed, serial in enumerate(SERIALS)}
TWO_EACH = {
    f"{a} {b}": ROWS_OF[a] + ROWS_OF[b] for a, b in zip(SERIALS[::2], SERIALS[1::2], strict=True)
}


@pytest.mark.parametrize("declared", ["", "{}"], ids=["column", "header line"])
def test_a_faulty_sheet_costs_its_accelerometer_alone(tmp_path, declared):
    path = tmp_path / "a.xlsx"
    left = {name: rows for name, rows in ROWS_OF.items() if name != "S03"}
    expected = accelcal.batch(book_of(path, left, declared))
    spoilt_one = {"S03": spoilt(ROWS_OF["S03"], 5, output="OL")}
    found = accelcal.batch(book_of(path, ROWS_OF | spoilt_one, declared))
    assert found.tables["serial"].tolist() == [*left]
    frames_alike(found[:2], expected[:2])
    with pytest.raises(TableError) as refused:
        accelcal.read_tables(path)
    assert found.errors["message"].tolist() == [str(refused.value)]
    assert str(refused.value).startswith(f"{path}#S03:{7 + bool(declared)}: output 'OL' is not a")


def test_a_faulty_cell_costs_its_serial_alone_among_those_of_its_sheet(tmp_path):
    spoilt_one = {"S04 S05": spoilt(TWO_EACH["S04 S05"], 3, position="0")}
    found = accelcal.batch(book_of(tmp_path / "a.xlsx", TWO_EACH | spoilt_one))
    assert found.tables["serial"].tolist() == [name for name in SERIALS if name != "S04"]
    assert found.errors["message"].str.contains("#S04 S05:5: position").tolist() == [True]


def test_a_fault_costs_all_sheets_where_all_are_of_one_unit(tmp_path):
    sheets = {"1": ROWS_OF["S00"], "2": spoilt(ROWS_OF["S01"], 3, output="OL")}
    found = accelcal.batch(book_of(tmp_path / "a.xlsx", sheets, "A"))
    assert found.tables.empty
    assert found.errors["message"].str.contains("#2:").tolist() == [True]


def warmed(rows):
    return [row.replace(",20.0,", ",60.0,") for row in rows]


def test_a_faulty_cell_costs_its_serial_alone_where_units_are_in_several_sheets(tmp_path):
    first = [row for serial in SERIALS[:3] for row in ROWS_OF[serial]]
    second = ROWS_OF["S01"] + ROWS_OF["S02"]
    left = {"1": [r for r in first if "S01" not in r], "2": warmed(ROWS_OF["S02"])}
    expected = accelcal.batch(book_of(tmp_path / "a.xlsx", left))
    sheets = {"1": first, "2": warmed(spoilt(second, 3, output="OL"))}
    found = accelcal.batch(book_of(tmp_path / "a.xlsx", sheets))
    frames_alike(found[:2], expected[:2])
    assert found.tables["serial"].tolist() == ["S00", "S02", "S02"]
    assert found.errors["message"].str.contains("#2:5: output 'OL'").tolist() == [True]


def test_all_serials_faulty_is_one_error(tmp_path):
    rows = good_rows()[:32]
    path = write(tmp_path / "a.csv", spoilt(spoilt(rows, 3, output="OL"), 20, output="OL"))
    (message,) = accelcal.batch(path).errors["message"]
    assert message.startswith(f"{path}:6: output 'OL' is not a number")


def test_a_serial_given_by_the_caller_names_no_other_one(tmp_path):
    rows = good_rows()[:32]
    path = write(tmp_path / "a.csv", spoilt(rows, 3, output="OL"))
    found = accelcal.batch(path, overrides={"serial": "X"})
    assert (len(found.tables), len(found.errors)) == (0, 1)


def test_the_command(tmp_path):
    path = write(tmp_path / "a.csv", spoilt(good_rows(), 40, output="OL"))
    command = [sys.executable, "-m", "accelcal"]
    batch = [*command, "batch", path, "-o", tmp_path / "r.csv"]
    done = subprocess.run(batch, capture_output=True, text=True, check=False)
    errors = tmp_path / "r.errors.csv"
    assert done.returncode == 1
    assert done.stderr == f"11 calibrations from 1 file; 1 error, see {errors}\n"
    fit = subprocess.run([*command, "fit", path], capture_output=True, text=True, check=False)
    assert (fit.returncode, fit.stdout) == (2, "")
    assert pd.read_csv(errors)["message"].tolist() == [fit.stderr.strip()]


def test_processes_and_resumption_write_the_same_bytes(tmp_path, monkeypatch):
    for name in "abc":
        write(tmp_path / f"{name}.csv", spoilt(good_rows(), 16 * ord(name) % 192, output="OL"))
    paths = sorted(tmp_path.glob("*.csv"))

    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(journal.Journal, "publish", stop)
        with pytest.raises(KeyboardInterrupt):
            accelcal.write_batch(paths, tmp_path / "r1.csv")
    accelcal.write_batch(paths, tmp_path / "r1.csv", resume=True)
    accelcal.write_batch(paths, tmp_path / "r2.csv", jobs=2)
    for name in ("", ".laws", ".errors"):
        one, other = (tmp_path / f"r{n}{name}.csv" for n in (1, 2))
        assert one.read_bytes() == other.read_bytes()
    assert len(pd.read_csv(tmp_path / "r1.errors.csv")) == len(paths)
