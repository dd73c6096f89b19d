"""Layouts around the readings: blocks, pages, merged cells, summaries and remarks."""

import io

import pytest

import accelcal
from accelcal.errors import TableError


def read(text):
    return accelcal.read_table(io.StringIO(text))


TWO_TEMPERATURES = [
    (20, 1, 1.35, 1.36),
    (20, 5, -1.33, -1.34),
    (60, 1, 1.45, 1.46),
    (60, 5, -1.43, -1.44),
]


def has_them_all(text, *notes):
    """Whether a table has the readings above, and tells the notes."""
    record = read(text)
    rows = zip(record.temperature, record.position, record.stroke, record.output, strict=True)
    expected = {(t, j, k, y) for t, j, *own in TWO_TEMPERATURES for k, y in enumerate(own, 1)}
    return {tuple(row) for row in rows} == expected and set(notes) <= set(record.notes)


def lines_of(rows):
    return [",".join(map(str, row)) for row in rows]


@pytest.mark.parametrize("gap", [",", ",,"])
@pytest.mark.parametrize("units", [[], ["degC,-,mA,mA"]])
def test_blocks_side_by_side(gap, units):
    rows = lines_of(TWO_TEMPERATURES)
    pairs = [(own, own) for own in ["T,J,Y1,Y2", *units]] + list(
        zip(rows[:2], rows[2:], strict=True)
    )
    text = "\n".join(gap.join(pair) for pair in pairs)
    assert has_them_all(text, "2 blocks side by side are read as one table")


def test_blocks_side_by_side_that_nothing_tells_apart_are_refused():
    rows = [f"{row},,{row}" for row in ("T,J,Y1,Y2", *lines_of(TWO_TEMPERATURES))]
    with pytest.raises(TableError, match="columns 'T' and 'T' mean the same"):
        read("\n".join(rows))


@pytest.mark.parametrize("units", [[], ["degC,-,mA,mA"]])
def test_headings_that_stand_again_on_each_page(units):
    rows, head = lines_of(TWO_TEMPERATURES), ["T,J,Y1,Y2", *units]
    note = f"{len(head)} row{'s were' if units else ' was'} of headings again, and left out"
    record = read("\n".join([*head, *rows[:2], "", *head, *rows[2:]]))
    assert has_them_all("\n".join([*head, *rows[:2], "", *head, *rows[2:]]))
    assert any(own.startswith(note) for own in record.notes)


def test_cells_that_were_merged_count_for_the_rows_below():
    rows = [
        (20, 1, 1.35, 1.36),
        ("", 5, -1.33, -1.34),
        ("", 3, 0.1, 0.2),
        (60, 1, 1.45, 1.46),
        ("", 5, -1.43, -1.44),
    ]
    record = read("\n".join(["T,J,Y1,Y2", *lines_of(rows)]))
    assert record.temperature.tolist() == [20.0] * 6 + [60.0] * 4
    assert "empty cells of 'T' count as the one above them" in record.notes


@pytest.mark.parametrize(
    "below",
    ["Mean,,1.5,1.5", ",Std. dev.,1.5,1.5", ",,,\nMittelwert:,,1.5,1.5", "СКО,,1,1\nСреднее,,1,1"],
)
def test_rows_of_summaries_are_set_aside(below):
    assert has_them_all("\n".join(["T,J,Y1,Y2", *lines_of(TWO_TEMPERATURES), below]))
    middle = lines_of(TWO_TEMPERATURES)
    assert has_them_all("\n".join(["T,J,Y1,Y2", *middle[:2], below, *middle[2:]]))


def test_several_rows_of_summaries_are_told_in_the_plural():
    rows = [*lines_of(TWO_TEMPERATURES), "СКО,,1,1", "Среднее,,1,1"]
    lines = f"(lines {len(rows)}, {len(rows) + 1})"
    assert has_them_all("\n".join(["T,J,Y1,Y2", *rows]), f"2 summaries were set aside {lines}")


@pytest.mark.parametrize("below", ["End of test", "geprüft: Müller", "* warm", "\nTotal: 4,,,"])
def test_remarks_below_a_table_are_set_aside(below):
    text = "\n".join(["T,J,Y1,Y2", *lines_of(TWO_TEMPERATURES), below])
    line = text.count("\n") + 1
    assert has_them_all(text, f"1 remark was set aside (line {line})")


@pytest.mark.parametrize("below", ["20", "AL-1", "60,3,x y"])
def test_a_last_row_that_may_be_cut_short_is_no_remark(below):
    with pytest.raises(TableError):
        read("\n".join(["T,J,Y1,Y2", *lines_of(TWO_TEMPERATURES), below]))


@pytest.mark.parametrize("below", ["Positions: 12", "Serial: A-7", "Unit: V"])
def test_a_declaration_below_a_table_is_no_remark(below):
    """Twelve positions counted as eight."""
    with pytest.raises(TableError, match=f"header line '{below}' inside the table; write it above"):
        read("\n".join(["T,J,Y1,Y2", *lines_of(TWO_TEMPERATURES), below]))


@pytest.mark.parametrize("name", ["run", "serial"])
@pytest.mark.parametrize("labels", [("AB", "QA"), ("max", "min")])
def test_words_between_blanks_before_readings_are_no_remark_or_summary(name, labels):
    """All rows but one were set aside."""
    rows = [f"{own} {row}" for own in labels for row in lines_of(TWO_TEMPERATURES[:2])]
    found = accelcal.read_tables(
        io.StringIO("\n".join([f"{name},T,J,Y1,Y2", *rows]).replace(",", " "))
    )
    assert sum(map(len, found)) == 8
    assert {label for own in found for label in (own.serial, *own.run_labels)} >= {*labels}


@pytest.mark.parametrize("units", ["°C,,mA,mA", "# form 7\n[degC],[-],[mA],[mA]"])
def test_a_row_of_units_may_stand_above_the_headings(units):
    text = "\n".join([units, "T,J,Y1,Y2", *lines_of(TWO_TEMPERATURES)])
    line = units.count("\n") + 1
    assert has_them_all(text, f"the units stand above the headings (line {line})")
    assert read(text).unit == "mA"


def test_columns_between_blanks_may_touch_in_some_rows():
    rows = [" ".join(f"{cell:>5}" for cell in row) for row in TWO_TEMPERATURES]
    assert "20     5 -1.33 -1.34" in rows[1]
    assert has_them_all("\n".join(["    T     J    Y1    Y2", *rows]))


def test_headings_between_blanks_may_have_tabs_too():
    rows = [row.replace(",", " \t", 1).replace(",", " ") for row in lines_of(TWO_TEMPERATURES)]
    assert has_them_all("\n".join(["T J\tY1 Y2", *rows]))


@pytest.mark.parametrize("heading", ["Stroke No. {}", "Hub Nr. {}", "Ход № {}"])
def test_strokes_may_be_numbered_by_no(heading):
    head = ",".join(["T,J", *(heading.format(k) for k in (1, 2))])
    assert has_them_all("\n".join([head, *lines_of(TWO_TEMPERATURES)]))


@pytest.mark.parametrize("heading", ["Cycle No. 1 {}", "Zyklus Nr. 1 {}"])
def test_cycles_may_be_numbered_by_no(heading):
    head = ",".join(["T,J", *(heading.format(way) for way in ("forward", "back"))])
    assert has_them_all("\n".join([head, *lines_of(TWO_TEMPERATURES)]))


def test_a_key_of_two_words_in_cells_is_no_row_of_headings():
    text = "\n".join(["Output unit\tmA", "T,J,Y1,Y2".replace(",", "\t")])
    rows = "\n".join(row.replace(",", "\t") for row in lines_of(TWO_TEMPERATURES))
    assert read(f"{text}\n{rows}").unit == "mA"


@pytest.mark.parametrize(
    ("row", "serial"),
    [
        ("S/N;;HP 34401A;123", None),
        ("S/N;;AL-15;;A. Nobody", "AL-15"),
        ("S/N;;AL-15;;Date:;31.05.2024", "AL-15"),
        ("S/N;AL-15;Rev. B", "AL-15"),
    ],
)
def test_a_pair_of_cells_behind_an_empty_one_is_of_something_else(row, serial):
    rows = "\n".join(["T,J,Y1,Y2", *lines_of(TWO_TEMPERATURES)]).replace(",", ";")
    assert read(f"{row}\n{rows}").serial == serial


def test_two_blanks_separate_cells_that_have_one():
    table = "Serial No.  0737\nTemp. [°C]  Pos.  Stroke 1  Stroke 2\n"
    for temperature, *others in TWO_TEMPERATURES:
        table += "   ".join([f"{temperature} °C", *map(str, others)]) + "\n"
    assert has_them_all(table)
    assert read(table).serial == "0737"


def test_one_blank_separates_cells_where_two_do_not_everywhere():
    rows = "\n".join(
        row.replace(",", "  ", 2).replace(",", " ") for row in lines_of(TWO_TEMPERATURES)
    )
    assert has_them_all(f"T  J  Y1  Y2\n{rows}")


ON_ITS_SIDE = "{};{};{};{}\nStroke 1;1,35;0,01;-1,34\nStroke 2;1,36;0,02;-1,33\n"


@pytest.mark.parametrize(
    "headings", [("J", 1, 3, 5), ("Angle", 0, 90, 180), ("Winkel", "0°", "90°", "180°")]
)
def test_a_table_on_its_side_whose_rows_are_called_strokes(headings):
    record = read("# temperature: 20\n" + ON_ITS_SIDE.format(*headings))
    assert record.angle.tolist() == [0.0, 90.0, 180.0] * 2
    assert record.stroke.tolist() == [1, 1, 1, 2, 2, 2]
    assert record.output.tolist() == [1.35, 0.01, -1.34, 1.36, 0.02, -1.33]


def test_a_table_on_its_side_below_angles_with_their_unit():
    record = read("# temperature: 20\nAngle;0°;90°;180°\n1;1,35;0,01;-1,34\n")
    assert (record.angle.tolist(), record.stroke.tolist()) == ([0.0, 90.0, 180.0], [1, 1, 1])


@pytest.mark.parametrize("rows", [1, 2])
def test_numbered_strokes_that_differ_as_positions_do_are_refused(rows):
    """Outputs of positions 1 to 5 were strokes 1 to 5 of position 1."""
    table = ["J;1;2;3;4;5", "1;1,35;0,95;0,01;-0,95;-1,34", "2;1,36;0,96;0,01;-0,95;-1,34"]
    with pytest.raises(TableError, match="columns '1, 2, 3, 4, 5' differ as positions do"):
        read("\n".join(["# temperature: 20", *table[: 1 + rows]]))


@pytest.mark.parametrize(
    "rows", ["1,1.35,1.351,1.352", "3,0.0123,0.0124,0.0121", "1,1.35,1.36,1.37\n3,0.1,0.11,0.12"]
)
def test_numbered_strokes_of_few_positions_are_read(rows):
    assert len(read(f"# temperature: 20\nJ,1,2,3\n{rows}\n")) % 3 == 0


def test_between_blanks_a_row_has_as_many_cells_as_headings():
    """Of ``Stroke No. 1`` three headings were made, and all outputs were one column too far."""
    table = "T Stroke No. 1[mA] 3[mA] Humidity\n20 1 1.35 0.01 45.2\n20 2 1.35 0.01 45.2\n"
    with pytest.raises(TableError, match="5 fields between blanks under 6 column headings"):
        read(table)


def test_thousands_marks_are_told_from_all_columns_together():
    """812,737 counts at position 1 were 812.737, as each column had one number."""
    table = "# temperature: 20\nk;J1;J2;J3;J4\n1;812,737;406,186;-372;-812,9"
    with pytest.raises(TableError, match="'812,737' is one of numbers without decimals or with"):
        read(f"{table}22\n")


@pytest.mark.parametrize(("first", "noted"), [("812,737", True), ("8,127", False)])
def test_a_note_tells_of_marks_that_may_be_of_thousands_where_no_unit_is_told(first, noted):
    record = read(
        f"# temperature: 20\nk;J1;J2;J3\n1;{first};1,186;-7,372\n2;{first};1,187;-7,371\n"
    )
    assert any("and no unit is told: if the mark" in note for note in record.notes) == noted


@pytest.mark.parametrize("gap", [",", ",,"])
def test_a_temperature_above_each_block_counts_for_its_rows(gap):
    rows = [row.partition(",")[2] for row in lines_of(TWO_TEMPERATURES)]
    pairs = [("J,Y1,Y2",) * 2, *zip(rows[:2], rows[2:], strict=True)]
    text = "\n".join([f"20 °C,,{gap}60 °C", *map(gap.join, pairs)])
    assert has_them_all(text, "2 blocks side by side are read as one table")
    assert not any("set aside" in note for note in read(text).notes)


def test_a_serial_above_each_block_counts_for_its_rows():
    text = "# temperature: 20\nSN A-1,,SN A-2,\nJ,Y1,J,Y1\n1,1.35,1,1.36\n5,-1.35,5,-1.37\n"
    found = accelcal.read_tables(io.StringIO(text))
    assert [(own.serial, own.output.tolist()) for own in found] == [
        ("A-1", [1.35, -1.35]),
        ("A-2", [1.36, -1.37]),
    ]


def test_runs_may_be_called_like_summaries():
    rows = ["max,60,1,1,1.36", "max,60,5,1,-1.35", "min,-40,1,1,1.31", "min,-40,5,1,-1.3"]
    assert len(read("\n".join(["run,T,J,k,Y", *rows]))) == 4


def test_a_row_that_is_cut_short_behind_a_serial_of_two_words_is_no_remark():
    with pytest.raises(TableError, match="1 field, but"):
        read("serial,T,J,k,Y\nAL 15,20,1,1,1.35\nAL 15,20,5,1,-1.35\nAL 15\n")


def test_a_summary_may_have_marks_of_missing_values():
    assert has_them_all("\n".join(["T,J,Y1,Y2", *lines_of(TWO_TEMPERATURES), "Mean,-,1.5,1.5"]))
    table = "No.,T,J,Y1\n1,20,1,1.35\n2,20,5,-1.35\nMean,-,0.1,0.2\n"
    assert len(read(table)) == 2


@pytest.mark.parametrize("mark", [",", ";", "\t", "|"])
def test_blank_fields_behind_a_header_line_are_no_part_of_its_value(mark):
    rows = "\n".join(["T,J,Y1,Y2", *lines_of(TWO_TEMPERATURES)]).replace(",", mark)
    assert read(f"# serial: A-7{mark * 5}\n{mark * 5}\n{rows}").serial == "A-7"


def test_numbered_positions_that_differ_as_strokes_do_are_refused():
    """A heading over the numbers of the columns was taken for that of the rows."""
    rows = [f"{j},{1.3 - 0.3 * j:g},{1.301 - 0.3 * j:g}" for j in range(1, 6)]
    text = "\n".join(["# temperature: 20", "Stroke,{0}1,{0}2", *rows])
    with pytest.raises(TableError, match="columns '1, 2' differ as strokes do, and rows as posi"):
        read(text.format(""))
    assert len(read(text.format("J"))) == 10
