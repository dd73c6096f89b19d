"""Tables of readings in workbooks, for whoever reads tables."""

import csv
import datetime as dt
import hashlib
import io
import re
import sys
import zipfile
from pathlib import Path

import pandas as pd
import pytest

import accelcal
from accelcal.cli.main import main
from accelcal.errors import InputError, TableError
from accelcal.io import tables

pytest.importorskip("python_calamine")
openpyxl = pytest.importorskip("openpyxl")

EXAMPLES = Path(__file__).parents[1] / "examples"
READINGS = ("temperature", "position", "stroke", "output", "run", "mounting", "line")


def typed(text):
    """A cell as a spreadsheet takes what is typed into it."""
    try:
        return float(text)
    except ValueError:
        return text or None


def book_of(path, sheets):
    """Write a workbook of rows of cells."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return Path(path)


def rows_of(name):
    with (EXAMPLES / name).open(newline="") as file:
        return [[typed(cell) for cell in row] for row in csv.reader(file)]


ROWS = rows_of("al15.csv")
AGAIN = [*ROWS[:10], [*ROWS[10][:3], 1.5, *ROWS[10][4:]], *ROWS[11:]]
BARE = [*ROWS[:9], *(row[1:] for row in ROWS[9:])]
NOTES = [["tested by N. N."], ["sensor", "AL-15"]]


@pytest.fixture
def text():
    return accelcal.read_table(EXAMPLES / "al15.csv")


def same_readings(found, expected):
    return all(
        getattr(found, name).tolist() == getattr(expected, name).tolist() for name in READINGS
    )


@pytest.mark.parametrize(
    "name", ["al15.csv", "forms/long.csv", "forms/wide.csv", "forms/angles_two_mountings.csv"]
)
def test_a_sheet_reads_as_the_csv_file_of_its_cells(name, tmp_path):
    found = accelcal.read_table(book_of(tmp_path / "a.xlsx", {"Sheet1": rows_of(name)}))
    expected = accelcal.read_table(EXAMPLES / name)
    assert same_readings(found, expected)
    for told in ("serial", "unit", "reference_temperature", "apparatus", "metadata", "notes"):
        assert getattr(found, told) == getattr(expected, told), told


@pytest.mark.parametrize("form", ["path", "open file", "standard input"])
def test_it_may_come_from_anywhere(text, form, tmp_path, monkeypatch):
    path = book_of(tmp_path / "a.xlsx", {"Sheet1": ROWS})
    content = path.read_bytes()
    source = {"path": path, "open file": io.BytesIO(content), "standard input": "-"}[form]
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))
    found = accelcal.read_table(source)
    assert same_readings(found, text)
    assert found.sha256 == hashlib.sha256(content).hexdigest()


def test_the_one_sheet_with_a_table_is_found_and_the_others_are_told(text, tmp_path):
    path = book_of(tmp_path / "a.xlsx", {"Notes": NOTES, "Test": ROWS, "Empty": []})
    found = accelcal.read_table(path)
    assert same_readings(found, text)
    assert "sheet 'Test' is read; there is no table in 'Notes'" in found.notes


FACTS = [
    ["Serial number", "A-7"],
    ["Date", dt.date(2024, 5, 31)],
    ["Operator", "Mia"],
    ["T0", "20 °C"],
]


def test_a_sheet_without_a_table_tells_the_facts_of_the_test(tmp_path):
    """They were lost: only that it has no table was told."""
    bare = ROWS[9:]
    found = accelcal.read_table(book_of(tmp_path / "no #1.xlsx", {"Info": FACTS, "Test": bare}))
    assert (found.serial, found.date, found.metadata) == ("A-7", "2024-05-31", {"Operator": "Mia"})
    told = "Operator, serial, date and reference_temperature: told by the sheet 'Info'"
    assert told in found.notes
    itself = [["# serial: B-8"], ["# date: 2025-01-01"], *bare]
    found = accelcal.read_table(book_of(tmp_path / "b.xlsx", {"Info": FACTS, "Test": itself}))
    assert (found.serial, found.date, found.metadata["Operator"]) == ("B-8", "2025-01-01", "Mia")


def test_a_serial_beside_several_tables_is_told_where_it_is_not_used(tmp_path):
    """It was lost without a word, and history left the unit out."""
    levels = {f"{t} °C": [ROWS[9][1:], *(r[1:] for r in ROWS if r[0] == t)] for t in (20, 80)}
    found = accelcal.read_table(book_of(tmp_path / "a.xlsx", {"Info": FACTS, **levels}))
    assert found.serial is None
    told = [note for note in found.notes if note.startswith("serial 'A-7' of the sheet 'Info'")]
    assert len(told) == 1
    assert "--serial" in told[0]
    assert "there is no table in 'Info'" in found.notes  # once, not for each sheet
    own = {name: [["# serial: B-8"], *rows] for name, rows in levels.items()}
    found = accelcal.read_table(book_of(tmp_path / "b.xlsx", {"Info": FACTS, **own}))
    assert found.serial == "B-8"
    assert not [note for note in found.notes if "A-7" in note]


@pytest.mark.parametrize(
    ("more", "note"),
    [
        (
            [["date", "2024-06-01"]],
            "facts of the sheet 'Info' were set aside: date is '2024-06-01'",
        ),
        (
            [["Frame", "HP"], ["S/N", "U2"]],
            "sheet 'Info': serials 'A-7, U2' above the headings",
        ),
        ([["Temperature", "20, 80, -40"], ["7", "8"]], "told by the sheet 'Info'"),
    ],
)
def test_facts_in_doubt_refuse_no_table(more, note, tmp_path):
    sheets = {"Info": [["Acceptance test"], *FACTS, *more], "Test": ROWS[9:]}
    assert note in " ".join(accelcal.read_table(book_of(tmp_path / "a.xlsx", sheets)).notes)


@pytest.mark.parametrize(
    ("more", "why"),
    [
        (["T_ref", "room"], "reference_temperature is 'room'; give it as a number"),
        (["Unit", "UUT"], "unit 'UUT' is no output unit; it is one of V"),
        (["Unit", "V"], "units 'V' and 'mA' in one table"),
        (["Positions", "8 x 6"], "positions is '8 x 6'"),
        (["Positions", 6], "position '8' is outside the turn"),
        (["Head uncertainty", "2 arcsec (k=2)"], "with a factor"),
        (["g", "9.81 m/s2 (PTB)"], "local_gravity is given in 'm/s2 (PTB)'"),
    ],
)
def test_a_fact_that_cannot_be_used_is_set_aside(more, why, tmp_path):
    """It refused the workbook, which was read before sheets told facts."""
    table = [[*ROWS[9][:3], "output [mA]", *ROWS[9][4:]], *ROWS[10:]]
    sheets = {"Info": [*FACTS[:3], more, ["Delta0", "see drawing"]], "Test": table}
    found = accelcal.read_table(book_of(tmp_path / "a.xlsx", sheets))
    assert (found.serial, found.unit, found.positions) == ("A-7", "mA", 8)
    notes = [note for note in found.notes if "of the sheet 'Info' is not used: " in note]
    assert any(why in note for note in notes)
    assert any("delta0 is 'see drawing'; give it as a number" in note for note in notes)
    assert "Operator, serial and date: told by the sheet 'Info'" in found.notes  # alone


@pytest.mark.parametrize(
    "rows",
    [
        [["Instrument", "Serial number", "Cal due"], ["3458A", "2823A", "2025-05-01"]],
        [["Instrument", "S/N", "Date"], ["3458A", "2823A", "2024-05-01"]],
        [["Serial", "Result"], ["A-7", "pass"], ["A-8", "pass"]],
    ],
)
def test_a_list_of_instruments_or_units_tells_no_serial(rows, tmp_path):
    """The accelerometer was 'Cal due', 2823A or 'Result'."""
    sheets = {"Test": ROWS[9:], "List": rows, "Info": [["g", "9.81", "m/s^2"]]}
    found = accelcal.read_table(book_of(tmp_path / "a.xlsx", sheets))
    assert (found.serial, found.date, found.apparatus.local_gravity) == (None, None, 9.81)


def test_a_sign_between_name_and_value_is_no_fact(tmp_path):
    info = [["Operator", ":", "Mia"], ["Unit", "=", "mA"]]
    found = accelcal.read_table(book_of(tmp_path / "a.xlsx", {"Info": info, "Test": ROWS[9:]}))
    assert (found.metadata, found.unit) == ({"Operator": "Mia"}, "mA")


def test_a_fault_of_the_table_is_told_where_a_fact_cannot_be_used_either(tmp_path):
    table = [*ROWS[9:14], [20, 1, "x", *ROWS[14][3:]], *ROWS[15:]]
    path = book_of(tmp_path / "a.xlsx", {"Info": [["T0", "room"]], "Test": table})
    with pytest.raises(TableError, match=r"a\.xlsx:6: stroke 'x' is not a number"):
        accelcal.read_table(path)


def test_a_faulty_table_is_read_once_more_without_all_its_facts(tmp_path, monkeypatch):
    """It was read once for each of them before it was refused."""
    times = []
    read = tables._survey
    monkeypatch.setattr(tables, "_survey", lambda *given: times.append(given) or read(*given))
    facts = [*FACTS, ["Unit", "mA"], ["g", 9.81], ["Positions", 8]]
    table = [*ROWS[9:14], [20, 1, "x", *ROWS[14][3:]], *ROWS[15:]]
    with pytest.raises(TableError, match="stroke 'x' is not a number"):
        accelcal.read_table(book_of(tmp_path / "a.xlsx", {"Info": facts, "Test": table}))
    assert len(times) == 2


@pytest.mark.parametrize(
    ("sheet", "rows", "serial"),
    [
        ("DMM", [["Serial number", "MY-4500"], ["Range", "10 V"]], None),
        ("Info", [["Instrument", "Multimeter"], ["Model", "3458A"], ["S/N", "MY-4500"]], None),
        ("Info", [["S/N", "MY-4500"], ["Model", "Keysight 3458A"]], None),
        ("Info", [["Head", "ODG-32"], ["S/N", "17"]], None),
        ("Info", [["S/N", "A-7"], ["Voltmeter", "Keysight 3458A"]], "A-7"),
        ("Info", [["Voltmeter", "3458A"], ["DUT S/N", "A-7"]], "A-7"),
        ("Info", [["Voltmeter", "3458A"], [""], ["S/N", "A-7"]], "A-7"),
        ("Info", [["head_uncertainty", 2e-5], ["serial", "A-7"]], "A-7"),
        ("Info", [["Head uncertainty", "2 arcsec"], ["g", 9.81], ["Serial number", "A-7"]], "A-7"),
        ("Info", [["Customer", "Fluke"], ["Oven temperature", "20 degC"], ["S/N", "A-7"]], "A-7"),
    ],
)
def test_the_serial_of_an_instrument_is_not_that_of_the_accelerometer(
    sheet, rows, serial, tmp_path
):
    found = accelcal.read_table(book_of(tmp_path / "a.xlsx", {sheet: rows, "Test": ROWS[9:]}))
    assert found.serial == serial
    assert any("may be that of an instrument" in note for note in found.notes) == (serial is None)


def test_a_missing_fact_is_none_and_one_that_two_sheets_tell_otherwise_is_not_used(tmp_path):
    """A voltmeter's serial was that of the accelerometer where its sheet came first."""
    sheets = {"Cell": [["Serial", "D-1"], ["Date", "-"]], "UUT": FACTS[:3], "Test": ROWS[9:]}
    found = accelcal.read_table(book_of(tmp_path / "a.xlsx", sheets))
    assert (found.serial, found.date) == (None, "2024-05-31")
    assert any("serial is 'D-1' in" in note and "neither is used" in note for note in found.notes)
    sheets["DMM"] = sheets.pop("Cell")
    assert accelcal.read_table(book_of(tmp_path / "b.xlsx", sheets)).serial == "A-7"


def test_a_sheet_of_facts_beside_several_tables_tells_no_serial(tmp_path):
    """It may be that of the first unit, or of a fixture."""
    units = {name: [[f"# serial: {name}"], *ROWS[9:]] for name in ("A1", "A2")}
    found = accelcal.read_tables(book_of(tmp_path / "a.xlsx", {"Info": FACTS, **units}))
    assert [(each.serial, each.date) for each in found] == [
        ("A1", "2024-05-31"),
        ("A2", "2024-05-31"),
    ]
    rows = [row[:4] for row in ROWS[9:64]]
    runs = {"A-1": rows, "A-2": rows}
    with pytest.raises(TableError, match="the same temperature, position and stroke as in"):
        accelcal.read_table(book_of(tmp_path / "b.xlsx", {"Info": FACTS, **runs}))


def test_sheets_are_accelerometers_each_of_its_own(text, tmp_path):
    path = book_of(
        tmp_path / "a.xlsx",
        {"1st": [["# serial: A1"], *ROWS[1:]], "2nd": [["# serial: A2"], *ROWS[1:]]},
    )
    found = accelcal.read_tables(path)
    assert [(record.serial, record.source) for record in found] == [
        ("A1", f"{path}#1st"),
        ("A2", f"{path}#2nd"),
    ]
    assert all(same_readings(record, text) for record in found)


LEVELS = {"20 degC": (10, 64), "T=80 \u00b0C": (64, 118), "-40 degC again": (118, 172)}


@pytest.mark.parametrize("told", ["column", "header line", "name of the sheet"])
@pytest.mark.parametrize("header", ["all", "first"])
def test_sheets_of_one_unit_are_parts_of_one_table(text, told, header, tmp_path):
    sheets = {}
    for number, (name, (start, end)) in enumerate(LEVELS.items()):
        above = ROWS[:9] if header == "all" or not number else []
        rows = [row[told != "column" :] for row in [ROWS[9], *ROWS[start:end]]]
        level = [[f"# temperature: {ROWS[start][0]:g} \u00b0C"]] if told == "header line" else []
        sheets[name if told == "name of the sheet" else f"Sheet{number}"] = above + level + rows
    path = book_of(tmp_path / "a.xlsx", {"cover": NOTES[:1], **sheets})
    found = accelcal.read_table(path)
    assert found == text
    assert found.source == str(path)
    names = ", ".join(map(repr, sheets))
    assert f"the sheets {names} are read as one table" in found.notes
    note = "temperature -40 degC is told by the name of the sheet '-40 degC again'"
    assert (note in found.notes) == (told == "name of the sheet")


def test_sheets_with_several_units_each_and_with_runs(text, tmp_path):
    sheets = {}
    for number, run in enumerate(["warm", "cold"]):
        rows = [["serial", *ROWS[9][:4]]]
        for serial in ("A1", "A2"):
            rows += [[serial, *row[:3], row[3] + 1e-6 * number] for row in ROWS[10:64]]
        sheets[run] = [[f"# run: {run}"], ["# unit: mA"], [f"# operator: {number}"], *rows]
    found = accelcal.read_tables(book_of(tmp_path / "a.xlsx", sheets))
    assert [record.serial for record in found] == ["A1", "A2"]
    for record in found:
        assert record.run_labels == ("warm", "cold")
        assert record.metadata["operator"] == "0; 1"
        first = record.output[record.run == 0]
        assert first.tolist() == text.output[text.run == 0].tolist()
        assert record.output[record.run == 1] == pytest.approx(first + 1e-6, rel=1e-14)


def both_levels(change=0.0):
    """Two temperatures of one test, of which nothing tells the serial."""
    return [[*ROWS[9][:4]], *([*row[:3], row[3] + change] for row in ROWS[10:118])]


def test_serials_may_be_told_by_the_names_of_sheets(tmp_path):
    sheets = {"SN A-1": both_levels(), "SN A-2": both_levels(1e-6)}
    found = accelcal.read_tables(book_of(tmp_path / "a.xlsx", sheets))
    assert [record.serial for record in found] == ["A-1", "A-2"]
    assert "serial A-2 is told by the name of the sheet 'SN A-2'" in found[1].notes


def test_a_faulty_cell_costs_its_sheet_alone_where_their_names_tell_serials(tmp_path):
    spoilt = both_levels()
    spoilt[5][3] = "OL"
    sheets = {"SN 1": both_levels(), "SN 2": spoilt, "SN 3": both_levels()}
    found = accelcal.batch(book_of(tmp_path / "a.xlsx", sheets))
    assert found.tables["serial"].unique().tolist() == ["1", "3"]
    assert len(found.errors) == 1


def test_sheets_of_the_same_readings_are_not_taken_for_runs_of_one_unit(tmp_path):
    """Three accelerometers were one, met again at each temperature."""
    sheets = {"A-1": both_levels(), "A-2": both_levels(1e-6)}
    path = book_of(tmp_path / "a.xlsx", sheets)
    with pytest.raises(TableError) as refused:
        accelcal.read_tables(path)
    assert str(refused.value) == (
        f"{path}#A-2:1: the same temperature, position and stroke as in {path}#A-1; write a line"
        " '# serial: ...' or '# run: ...' in each sheet, or call it 'SN ...'"
    )


@pytest.mark.parametrize(
    ("names", "serial"),
    [
        (("heating", "cooling"), None),
        (("20 to 80", "20 to 80 (2)"), None),
        (("Run 1", "Run 2"), None),
        (("A-1", "A-2"), "Q-1"),
    ],
)
def test_sheets_of_the_same_readings_are_runs_where_no_name_may_be_a_serial(
    names, serial, tmp_path
):
    sheets = dict(zip(names, (both_levels(), both_levels(1e-6)), strict=True))
    record = accelcal.read_table(
        book_of(tmp_path / "a.xlsx", sheets), overrides={"serial": serial} if serial else None
    )
    assert record.run_labels == ("20", "80", "20 (2)", "80 (2)")
    assert record.serial == serial


def test_what_takes_one_table_asks_for_its_sheet(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    book_of("a.xlsx", {"1st": ROWS, "2nd": ROWS})
    assert main(["stability", "a.xlsx"]) == 2
    assert capsys.readouterr().err == (
        "a.xlsx: several sheets have tables; name one of a.xlsx#1st, a.xlsx#2nd\n"
    )


def test_hidden_sheets_are_read_only_by_their_names(text, tmp_path):
    path = book_of(tmp_path / "a.xlsx", {"Test": ROWS, "Old": ROWS[:-1]})
    book = openpyxl.load_workbook(path)
    book["Old"].sheet_state = "hidden"
    book.save(path)
    assert same_readings(accelcal.read_table(path), text)
    assert len(accelcal.read_table(f"{path}#Old")) == len(text) - 1


def test_a_sheet_is_named_behind_its_file(text, tmp_path):
    path = book_of(tmp_path / "a.xlsx", {"1st #": ROWS, "2nd": ROWS[:-1]})
    found = accelcal.read_table(f"{path}#1st #")
    assert same_readings(found, text)
    assert found.source == f"{path}#1st #"


def test_a_file_whose_name_looks_like_that_of_a_sheet_is_a_file(text, tmp_path):
    path = book_of(tmp_path / "a.xlsx#b", {"Test": ROWS})
    assert same_readings(accelcal.read_table(path), text)


@pytest.mark.parametrize(
    ("sheets", "named", "told"),
    [
        (
            {"20": ROWS, "20 b": AGAIN},
            "",
            "a.xlsx: the sheets '20', '20 b' are not one table: position 1, stroke 1 at 20 degC has"
            " output 1.5, but 1.354758 in line 11; tell them apart by lines '# run: ...' or"
            " '# serial: ...', or name one, as a.xlsx#20",
        ),
        (
            {"20": ROWS, "20 b": [["# T0: 25"], *ROWS[9:]]},
            "",
            "a.xlsx#20 b:1: reference_temperature is '25', but '20.0' in a.xlsx#20; declare",
        ),
        (
            {"A": NOTES, "B": NOTES},
            "",
            "a.xlsx: no table in the sheets 'A', 'B'; name one, as a.xlsx#A",
        ),
        (
            {"A": ROWS[1:], "B": AGAIN[1:]},
            "",
            "a.xlsx: the sheets 'A', 'B' are not one table: position 1, stroke 1 at 20 degC has",
        ),
        (
            {"20": BARE, "60": BARE},
            "",
            "a.xlsx#20:10: no column for temperature among 'position, stroke, output, run, mou",
        ),
        (
            {"A": ROWS, "B": rows_of("forms/wide.csv")},
            "",
            "a.xlsx#B:5: its columns are not those of a.xlsx#A; name one",
        ),
        ({"A": ROWS}, "#B", "a.xlsx: no sheet 'B'; name one of 'A'"),
        ({"A": []}, "", "a.xlsx: the file is empty"),
        (
            {"A": [*ROWS[:20], [20.0, "x", *ROWS[20][2:]]]},
            "",
            "a.xlsx:21: position 'x' is not a number; write its number J",
        ),
    ],
)
def test_what_is_wrong_is_told_in_a_line(sheets, named, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    book_of("a.xlsx", sheets)
    with pytest.raises(TableError, match=f"^{re.escape(told)}"):
        accelcal.read_table(f"a.xlsx{named}")


def test_a_merged_cell_is_the_value_of_each_of_its_rows(tmp_path):
    rows = [["# unit: mA"], ["temperature", "position", "stroke", "output"]]
    for level in (20.0, 60.5):
        for stroke in (1, 2):
            for position in range(1, 10):
                first = (stroke, position) == (1, 1)
                output = 1.3 + 0.01 * position + 1e-4 * stroke + 1e-5 * level
                rows.append([level if first else None, position, stroke, output])
    path = book_of(tmp_path / "a.xlsx", {"Test": rows})
    book = openpyxl.load_workbook(path)
    book["Test"].merge_cells("A3:A20")
    book["Test"].merge_cells("A21:A38")
    book.save(path)
    found = accelcal.read_table(path)
    assert found.temperature.tolist() == [20.0] * 18 + [60.5] * 18
    assert (
        "cells merged over several rows count in each of them, from lines 3, 21 on" in found.notes
    )


def test_cells_of_several_kinds(tmp_path):
    rows = [
        ["# T0: 20"],
        [],
        ["temperature\n[degC]", "date", "time", "position", "stroke", "output\n[mA]", '"note"'],
    ]
    for position in range(1, 10):
        moment = dt.time(9, 30, position)
        output = 1.25 if position == 9 else 2.0**-position
        rows.append([20, dt.date(2026, 5, 31), moment, position, 1, output, '"so\tso"'])
    rows[5][5] = "#N/A"
    shifted = [[None, *row] for row in rows]
    found = accelcal.read_table(book_of(tmp_path / "a.xlsx", {"Test": [[], *shifted]}))
    assert (found.date, found.unit) == ("2026-05-31", "mA")
    assert found.time.tolist() == [0, 1, 3, 4, 5, 6, 7, 8]
    assert found.output.tolist() == [0.5, 0.25, *(2.0**-n for n in range(4, 9)), 1.25]
    assert found.line.tolist() == [5, 6, *range(8, 14)]
    assert "1 missing reading was left out (line 7)" in found.notes


@pytest.mark.parametrize("column", [0, 1, 3])
def test_a_duration_is_no_number(column, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = book_of("a.xlsx", {"Test": ROWS})
    book = openpyxl.load_workbook(path)
    for cell in [*book["Test"].columns][column][10:]:
        cell.number_format = "[h]:mm:ss"
    book.save(path)
    with pytest.raises(TableError, match=r"^a\.xlsx:11: \w+ '\d+:\d\d:\S+' is not a number; write"):
        accelcal.read_table(path)


@pytest.mark.parametrize("heading", ["time", "time [h]"])
def test_durations_of_a_day_are_clock_times(heading, tmp_path):
    rows = [["# unit: mA"], ["# T0: 20"], ["# temperature: 20"]]
    rows += [["position", "stroke", "output", heading]]
    passed = [dt.timedelta(hours=3.25 * n, seconds=n) for n in range(8)]
    rows += [[n + 1, 1, 2.0**-n, passed[n]] for n in range(8)]
    found = accelcal.read_table(book_of(tmp_path / "a.xlsx", {"Test": rows}))
    assert found.time.tolist() == [one.total_seconds() for one in passed]


def test_the_index_that_pandas_writes_is_a_column_without_heading(text, tmp_path):
    text.to_frame()[["temperature", "position", "stroke", "output"]].to_excel(tmp_path / "a.xlsx")
    found = accelcal.read_table(tmp_path / "a.xlsx")
    assert found.output.tolist() == text.output.tolist()
    assert "column 1 without heading is not known and was set aside" in found.notes


@pytest.mark.parametrize("columns", ["BC", "A"])
def test_a_row_of_units_has_headings_merged_over_it(columns, tmp_path):
    degrees = None if "A" in columns else "degC"
    rows = [["temperature", "position", "stroke", "output"], [degrees, None, None, "mA"]]
    rows += [[20, n, 1, 2.0**-n] for n in range(1, 9)]
    path = book_of(tmp_path / "a.xlsx", {"Test": rows})
    book = openpyxl.load_workbook(path)
    for letter in columns:
        book["Test"].merge_cells(f"{letter}1:{letter}2")
    book.save(path)
    found = accelcal.read_table(path)
    assert (len(found), found.unit) == (8, "mA")


@pytest.mark.parametrize("far", [["XFD1048576"], ["A1048576", "XFD1"], ["AD1048576"]])
def test_cells_too_far_from_the_table_are_refused(far, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = book_of("a.xlsx", {"Test": ROWS})
    book = openpyxl.load_workbook(path)
    for cell in far:
        book["Test"][cell] = "x"
    book.save(path)
    columns = 30 if far[0].startswith("AD") else 16384
    told = f"a.xlsx: a sheet of 1048576 rows and {columns} columns is too large; delete the cells"
    with pytest.raises(TableError, match=f"^{told} far from the table"):
        accelcal.read_table(path)


def test_a_far_cell_without_a_value_does_no_harm(text, tmp_path):
    path = book_of(tmp_path / "a.xlsx", {"Test": ROWS})
    book = openpyxl.load_workbook(path)
    book["Test"]["XFD1048576"].number_format = "0.00"
    book.save(path)
    assert same_readings(accelcal.read_table(path), text)


@pytest.mark.parametrize("cut", [4, 100, -1, 1000])
def test_what_is_no_workbook_is_refused(cut, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = book_of("a.xlsx", {"A": ROWS})
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(TableError, match=r"^a\.xlsx: no workbook that can be read \(.+\); save it"):
        accelcal.read_table("a.xlsx")


def test_another_archive_of_zip_is_no_workbook(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("a.csv", "1,2\n")
    with pytest.raises(TableError, match="no workbook that can be read"):
        accelcal.read_table(tmp_path / "a.zip")


def test_without_calamine_the_extra_is_named(tmp_path, monkeypatch):
    path = book_of(tmp_path / "a.xlsx", {"A": ROWS})
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(InputError, match=r"a workbook needs python-calamine; .*accelcal\[excel\]"):
        accelcal.read_table(path)


def test_batch_takes_workbooks_of_a_folder_as_fit_does(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("lab").mkdir()
    book_of("lab/1.xlsx", {"Test": ROWS, "Notes": NOTES})
    Path("lab/2.csv").write_bytes((EXAMPLES / "al15.csv").read_bytes())
    book_of("lab/3.xlsx", {"20": ROWS, "20 b": AGAIN})
    Path("lab/~$1.xlsx").write_bytes(b"open by N. N.")
    found = accelcal.batch("lab")
    tables = found.tables.drop(columns=["source", "sha256", "notes"])
    one, two = (tables[found.tables["source"] == f"lab/{name}"] for name in ("1.xlsx", "2.csv"))
    pd.testing.assert_frame_equal(one, two.set_axis(one.index), rtol=1e-12)
    assert found.errors["source"].tolist() == ["lab/3.xlsx"]
    assert found.errors["message"][0].startswith("lab/3.xlsx: the sheets '20', '20 b' are not")


def test_batch_takes_a_sheet_by_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    book_of("a.xlsx", {"20 degC": ROWS[:60], "warm#2": [*ROWS[:10], *ROWS[64:118]]})
    sheets = ["a.xlsx#20 degC", "a.xlsx#warm#2"]
    found = accelcal.batch([*sheets, sheets[0]])
    assert found.tables["source"].tolist() == sheets
    assert found.tables["temperature_degC"].tolist() == [20.0, 80.0]
    (wrong,) = accelcal.batch(["a.xlsx#cold", sheets[0]]).errors["message"]
    assert wrong == "a.xlsx: no sheet 'cold'; name one of '20 degC', 'warm#2'"


def test_apply_takes_a_sheet_as_the_csv_file_of_its_cells(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    accelcal.fit(accelcal.read_table(EXAMPLES / "al15.csv")).to_json("cal.json")
    rows = [["temperature", "output [mA]"], [20.0, 1.35], [25.5, -0.9], [30.0, 0.004]]
    Path("a.csv").write_text("".join(f"{','.join(map(str, row))}\n" for row in rows))
    book_of("a.xlsx", {"cover": NOTES, "flight 1": rows, "flight 2": rows[:2]})

    def applied(name):
        code = main(["apply", "cal.json", name])
        out, err = capsys.readouterr()
        return code, [line for line in out.splitlines() if line[:1] != "#"], err

    code, expected, _ = applied("a.csv")
    assert (code, len(expected)) == (0, 4)
    assert applied("a.xlsx#flight 1")[:2] == (0, expected)
    assert applied("a.xlsx#flight 2")[1] == expected[:2]
    code, _, err = applied("a.xlsx")
    names = "name one of a.xlsx#flight 1, a.xlsx#flight 2"
    assert (code, err) == (2, f"a.xlsx: several sheets have tables; {names}\n")
    book_of("one.xlsx", {"cover": NOTES, "flight": rows})
    code, found, err = applied("one.xlsx")
    assert (code, found) == (0, expected)
    assert "note: sheet 'flight' is read; there is no table in 'cover'\n" in err


def test_check_and_fit_at_the_shell(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    book_of("a.xlsx", {"Notes": NOTES, "Test": ROWS})
    assert main(["check", "a.xlsx"]) == 0
    shown = capsys.readouterr().out
    assert re.search(r"^form +long$", shown, re.MULTILINE)
    assert re.search(r"^encoding +workbook$", shown, re.MULTILINE)
    assert main(["fit", "a.xlsx#Test", "--format", "json"]) == 0
    assert '"source": "a.xlsx#Test"' in capsys.readouterr().out
