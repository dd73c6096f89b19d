"""Every form in which a table may be written is read to the same record."""

from __future__ import annotations

import gzip
import io
import json
import re
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import accelcal
from accelcal.arguments.kinds import shown
from accelcal.errors import InputError, TableError
from accelcal.io.description import describe, summary
from accelcal.io.tables import read_table, read_tables, survey
from accelcal.io.values.cells import Column
from accelcal.io.values.times import times
from accelcal.io.words.headings import read_heading

GUIDE = Path(__file__).parents[1] / "docs" / "csv-forms.md"
PAGES = (GUIDE, GUIDE.with_name("csv-words.md"))

ROWS = [
    (temperature, position, stroke, round(1.3 * np.cos(np.pi * (position - 1) / 4) + k0, 6))
    for temperature, k0 in ((20, 0.004), (80, 0.002), (-40, 0.007))
    for stroke in (1, 2)
    for position in range(1, 10)
]
HEADINGS = ("temperature", "position", "stroke", "output")


def long_table(separator=",", decimal=".", headings=HEADINGS, rows=ROWS, end="\n"):
    lines = [headings, *([str(value) for value in row] for row in rows)]
    return end.join(separator.join(line).replace(".", decimal) for line in lines) + end


def wide_table(separator=",", decimal=".", strokes=("Y1", "Y2")):
    cells = {(t, p, k): str(y).replace(".", decimal) for t, p, k, y in ROWS}
    lines = [separator.join(("temperature", "position", *strokes))]
    for temperature in (20, 80, -40):
        for position in range(1, 10):
            outputs = [cells[temperature, position, stroke] for stroke in (1, 2)]
            lines.append(separator.join([str(temperature), str(position), *outputs]))
    return "\n".join(lines) + "\n"


def read(content, **overrides):
    data = content.encode() if isinstance(content, str) else content
    return read_table(io.BytesIO(data), overrides=overrides)


REFERENCE = read(long_table())


def same_readings(record, other):
    names = ("output", "angle", "temperature", "stroke", "run", "position")
    return all(np.array_equal(getattr(record, n), getattr(other, n)) for n in names)


@pytest.mark.parametrize(
    "words", [("forward", "back"), ("F", "B"), ("1", "\u22121"), ("hin", "zurück")]
)
def test_cycles_with_a_direction_are_two_strokes_each(words):
    """They passed for repeated strokes, with the advice to delete one."""
    rows = [(t, p, 1, words[k - 1], y) for t, p, k, y in ROWS]
    record = read(long_table(headings=("T", "J", "k", "Direction", "Y"), rows=rows))
    assert same_readings(record, REFERENCE)
    assert record.notes == (
        "strokes were counted by the column direction, odd ones forward and even ones back,"
        " up to 2",
    )
    named = read(long_table(headings=("T", "J", "Cycle", "Dir", "Y"), rows=rows))
    assert same_readings(named, REFERENCE)
    wide = [f"{t},{p},{words[k - 1]},{y}" for t, p, k, y in ROWS]
    assert same_readings(read("\n".join(["T,J,direction,Y1", *wide])), REFERENCE)


@pytest.mark.parametrize("words", [("CW", "CCW"), ("runter", "rauf"), ("2", "7")])
@pytest.mark.parametrize("heading", ["k", "cycle"])
def test_unknown_words_of_a_direction_are_told_by_the_angles(heading, words):
    """They were refused."""
    done = sorted(ROWS, key=lambda row: (row[0], row[2], row[1] if row[2] == 1 else -row[1]))
    rows = [(t, p, 1, words[k - 1], y) for t, p, k, y in done]
    record = read(long_table(headings=("T", "J", heading, "dir", "Y"), rows=rows))
    assert same_readings(record, read(long_table(rows=done)))
    told = f"direction '{words[0]}' is forward and '{words[1]}' back, as the angles show"
    assert record.notes[0] == told
    by_place = [(t, p, 1, words[k - 1], y) for t, p, k, y in ROWS]
    with pytest.raises(TableError, match=f"'{words[0]}' is neither forward nor back"):
        read(long_table(headings=("T", "J", heading, "dir", "Y"), rows=by_place))


PIVOT = "20;1;1,30;1,31;1,32;1,33\n20;3;0,01;0,02;0,03;0,04\n20;5;-1,30;-1,31;-1,32;-1,33\n"


@pytest.mark.parametrize(
    ("headings", "strokes"),
    [
        (";;Zyklus 1;;Zyklus 2;\nT;J;Hin;Rück;Hin;Rück", [1, 2, 3, 4]),
        (";;forward;;back;\nT;J;1;2;1;2", [1, 3, 2, 4]),
        ("T;J;1;1;2;2\n;;aller [mA];retour [mA];aller [mA];retour [mA]", [1, 2, 3, 4]),
        ("cycle;;1;1;2;2\ndir;;back;forward;back;forward\nT;J;;;;", [2, 1, 4, 3]),
        ("T;J;fwd 1;bwd 1;fwd 2;bwd 2", [1, 2, 3, 4]),
        ("T;J;cycle 1 forward;cycle 1 back;cycle 2 forward;cycle 2 back", [1, 2, 3, 4]),
        ("T;J;forward 1;back 2;forward 3;back 4", [1, 2, 3, 4]),
        ("T;J;stroke 1 forward;stroke 2 back;stroke 3 forward;stroke 4 back", [1, 2, 3, 4]),
        ("T;J;Y1 fwd;Y1 bwd;Y2 fwd;Y2 bwd", [1, 2, 3, 4]),
        ("T;J;Hub 1;Hub 2;Hub 3;Hub 4\n;;hin;rück;hin;rück", [1, 2, 3, 4]),
        (";;cycle 3;;cycle 4;\nT;J;hin;rück;hin;rück", [5, 6, 7, 8]),
        (";;hin;;rück;\nT;J;Zyklus 1 (mA);Zyklus 2 (mA);Zyklus 1 (mA);Zyklus 2 (mA)", [1, 3, 2, 4]),
    ],
)
def test_a_pivot_table_by_cycle_and_direction(headings, strokes):
    """It was refused."""
    below = read(f"DUT;AL-15\n# unit: mA\n{headings}\n{PIVOT}")
    assert (below.unit, below.stroke.tolist()) == ("mA", strokes * 3)  # the unit was lost
    record = read(f"{headings}\n{PIVOT}")
    assert record.stroke.tolist() == strokes * 3
    assert record.output.tolist()[:4] == [1.30, 1.31, 1.32, 1.33]
    assert record.notes == ()


@pytest.mark.parametrize(
    "headings",
    ["T;J;fwd 1;bwd 1;fwd 2", ";;cycle 1;;cycle 2\nT;J;Hin;Rück;Hin", "T;J;1;1;2\n;;Hin;Rück;Hin"],
)
def test_a_pivot_table_may_lack_the_last_stroke_back(headings):
    """It was refused."""
    rows = "20;1;1,30;1,31;1,32\n20;5;-1,30;-1,31;-1,32\n"
    assert read(f"{headings}\n{rows}").stroke.tolist() == [1, 2, 3] * 2
    for odd in ("T;J;fwd 1;bwd 1;bwd 2", "T;J;fwd 1;fwd 2;bwd 2", "T;J;fwd 1;bwd 1;fwd 3"):
        with pytest.raises(TableError):
            read(f"{odd}\n{rows}")


@pytest.mark.parametrize(
    "headings",
    [
        ";cycle 1;;cycle 2;\nposition;Hin;Rück;Hin;Rück",
        "cycle;1;1;2;2\ndirection;Hin;Rück;Hin;Rück\nposition;;;;",
        "position;1;1;2;2\n;Hin;Rück;Hin;Rück",
    ],
)
def test_a_pivot_table_by_position_alone(headings):
    """There were no headings in it."""
    rows = re.sub(r"(?m)^20;", "", PIVOT)
    record = read(f"# temperature: 20\n{headings}\n{rows}")
    assert record.stroke.tolist() == [1, 2, 3, 4] * 3
    assert record.output.tolist()[:4] == [1.30, 1.31, 1.32, 1.33]


@pytest.mark.parametrize(
    "headings", ["T;J;Zyklus;Hin [mA];Rück [mA]", ";;;Hin;Rück\nT;J;cycle;mA;mA"]
)
def test_columns_forward_and_back_beside_one_of_cycles(headings):
    """The cycles were set aside, and the second one refused as a repetition of the first."""
    rows = "20;1;1;1,30;1,31\n20;5;1;-1,30;-1,31\n20;1;2;1,32;1,33\n20;5;2;-1,32;\n"
    record = read(f"{headings}\n{rows}")
    assert record.stroke.tolist() == [1, 2, 1, 2, 3, 4, 3]
    assert (record.output.tolist()[4:], record.unit) == ([1.32, 1.33, -1.32], "mA")
    assert "strokes were counted by the column direction" in record.notes[0]
    with pytest.raises(TableError, match="columns 'dir' and 'Hin' in one table"):
        read("T;J;cycle;dir;Hin;Rück\n20;1;1;f;1,3;1,3\n")


@pytest.mark.parametrize("headings", ["T;J;1;\n;;Hin;Rück", "cycle;;1;1\ndir;;Hin;Rück\nT;J;;"])
def test_a_pivot_table_of_one_cycle(headings):
    """It was refused."""
    record = read(f"{headings}\n20;1;1,30;1,31\n20;5;-1,30;-1,31\n")
    assert (record.stroke.tolist(), record.output.tolist()) == (
        [1, 2] * 2,
        [1.3, 1.31, -1.3, -1.31],
    )


@pytest.mark.parametrize(
    "headings",
    [
        "T;J;forward 1;back 1;forward 2;back 3",
        "T;J;forward 0;back 0;forward 1;back 1",
        ";;1;1;2;2\nT;J;up;down;up;down",
        "T;J;+ 1;- 1;+ 2;- 2",
        "T;J;1 +;2 -;3 +;4 -",
        ";;A-7;;A-8;\nT;J;forward;back;forward;back",
        ";;7;;8;\nT;J;forward;back;forward;back",
        ";;20;;60;\nT;J;forward;back;forward;back",
        "specimen;;1;1;2;2\nT;J;forward;back;forward;back",
        "specimen;;1;2;3;4\nT;J;Y;Y;Y;Y",
        "T;J;Y;;;\nspecimen;;1;2;3;4",
        "cycle;;1;2;3;4\nT;J;Y;Y;Y;Y",
        "T;J;output 20 forward;output 20 back;output 60 forward;output 60 back",
    ],
)
def test_a_pivot_table_by_something_else_is_refused(headings):
    with pytest.raises(TableError):
        read(f"{headings}\n{PIVOT}")


def test_cycles_are_no_strokes_without_a_direction_or_beside_strokes():
    rows = [(t, p, 1, k, y) for t, p, k, y in ROWS]
    beside = read(long_table(headings=("T", "J", "cycle", "k", "Y"), rows=rows))
    assert same_readings(beside, REFERENCE)
    assert beside.notes == ("column 'cycle' is not known and was set aside",)
    with pytest.raises(TableError, match="no column for stroke"):
        read(long_table(headings=("T", "J", "cycle", "Y")))
    heated = [(t, p, k, ("heating", "cooling")[k - 1], y) for t, p, k, y in ROWS]
    with pytest.raises(TableError, match="'heating' is neither forward nor back"):
        read(long_table(headings=("T", "J", "cycle", "direction", "Y"), rows=heated))
    once = [(t, p, k, "forward", y) for t, p, k, y in ROWS]
    forward = read(long_table(headings=("T", "J", "cycle", "direction", "Y"), rows=once))
    assert np.unique(forward.stroke).tolist() == [1, 3]


def test_between_blanks_a_unit_belongs_to_the_heading_before_it():
    """It was a heading of its own, and the rows had too few cells."""
    headings = ("T [degC]", "position", "k", "Y [mA]")
    record = read(long_table("  ", headings=headings))
    assert same_readings(record, REFERENCE)
    assert record.unit == "mA"


@pytest.mark.parametrize(
    "headings",
    [
        ("Température (°C)", "Position", "Passage", "Sortie (mA)"),
        ("Температура, °C", "Положение", "Ход", "Выход, мА"),
        ("Температура [°\N{CYRILLIC CAPITAL LETTER ES}]", "Позиция", "Проход", "Показание [мА]"),
    ],
)
def test_french_and_russian_headings(headings):
    record = read(long_table(";", ",", headings))
    assert same_readings(record, REFERENCE)
    assert (record.unit, record.notes) == ("mA", ())


@pytest.mark.parametrize("separator", ["\t", ";", "|"])
def test_blanks_within_headings_separate_nothing(separator):
    """Between tabs they made two headings of one, which then meant the same."""
    wide = wide_table(separator, strokes=("Stroke 1", "Stroke 2"))
    assert same_readings(read(wide), read(wide_table()))
    headings = ("Temperature T", "Position J", "Stroke k", "Output Y")
    assert same_readings(read(long_table(separator, headings=headings)), REFERENCE)


@pytest.mark.parametrize("above", ["", "Serial  0632\n", "Output unit  mA\n"])
def test_headings_that_only_wide_blanks_separate(above):
    """Split at each blank they are no headings; a line of a unit above them passed for some."""
    headings = "Temp.  Head angle  Cycle No. 1 forward  Cycle No. 1 reverse\n"
    record = read(f"{above}{headings}20  0  1.35  1.36\n20  180  -1.35  -1.36\n")
    assert record.angle.tolist() == [0.0, 0.0, 180.0, 180.0]
    assert record.output.tolist() == [1.35, 1.36, -1.35, -1.36]
    with pytest.raises(TableError, match="no column headings"):
        read(f"{above}{headings}20  0  1.35  1.36\n    180  -1.35  -1.36\n")  # of which column?


OF_POSITIONS = "20,1,1.35,0.95,-1.35\n20,2,1.36,0.96,-1.36\n"


@pytest.mark.parametrize(
    ("own", "unit"),
    [
        *[("T,k", None), ("T,k,,,", None), ("T,k,Y,Y,Y", None)],
        *[("T,k,Y [mA],Y [mA],Y [mA]", "mA"), ("T,k,mA,mA,mA", "mA"), ("T,k,[V],[V],[V]", "V")],
    ],
)
def test_a_row_above_the_headings_may_number_the_positions(own, unit):
    """It passed for the headings, and the row below it for readings."""
    record = read(f",,Position 1,Position 2,Position 5\n{own}\n{OF_POSITIONS}")
    assert same_readings(record, read(f"T,k,J1,J2,J5\n{OF_POSITIONS}"))
    assert (record.unit, record.notes) == (unit, ())


def test_units_above_and_below_that_differ_are_refused():
    """The upper one counted without a word."""
    for own in ("T,k,mA,mA,mA", "T,k,Y [mA],Y [mA],Y [mA]"):
        with pytest.raises(TableError, match=":2: "):
            read(f",,Position 1 [V],Position 2 [V],Position 5 [V]\n{own}\n{OF_POSITIONS}")


def test_a_row_of_units_may_have_the_heading_of_the_strokes():
    """It passed for a unit, as a row with one heading is none."""
    rows = "1,1.35,0.95,-1.35\n2,1.36,0.96,-1.36\n"
    record = read(f"# temperature: 20\n,Position 1,Position 2,Position 5\nk,mA,mA,mA\n{rows}")
    assert same_readings(record, read(f"T,k,J1,J2,J5\n{OF_POSITIONS}"))
    assert (record.unit, record.notes) == ("mA", ())


def test_positions_above_columns_of_cycles_and_directions():
    """The column of cycles was taken for one that needs directions in the headings."""
    top = ",,,Pos. 1,Pos. 3,Pos. 5\nT,cycle,direction,Y [mA],Y [mA],Y [mA]\n"
    record = read(f"{top}20,1,forward,1.3,0.1,-1.3\n20,1,back,1.4,0.2,-1.2\n")
    rows = zip(
        record.position.tolist(), record.stroke.tolist(), record.output.tolist(), strict=True
    )
    assert record.unit == "mA"
    assert sorted(rows) == [
        *((1, 1, 1.3), (1, 2, 1.4), (3, 1, 0.1), (3, 2, 0.2)),
        *((5, 1, -1.3), (5, 2, -1.2)),
    ]


@pytest.mark.parametrize(
    "table", [f"T,k,0 deg,45 deg,180 deg\n{OF_POSITIONS}", "T,J,k,Y\n20,1,1,1.35\n20,5,1,-1.35\n"]
)
def test_positions_above_headings_that_need_them_not_are_set_aside(table):
    record = read(f"Pos. 1,Pos. 2,Pos. 5,Pos. 6\n{table}")
    assert same_readings(record, read(table))
    assert record.notes == ("text above the headings was set aside (line 1)",)


@pytest.mark.parametrize(
    ("heading", "unit", "why"),
    [
        ("Strom [mA]", "mA", "unit"),
        ("Spannung in V", "V", "unit"),
        ("Courant (mA)", "mA", "unit"),
        ("Ток, мА", "mA", "unit"),
        ("I/mA", "mA", "unit"),
        ("Частота, кГц", "kHz", "unit"),
        ("Acceleration m/s²", "m/s^2", "unit"),
        ("Mean", None, "name"),
        ("Mittelwert", None, "name"),
    ],
)
def test_the_only_column_that_can_be_the_output_is(heading, unit, why):
    """These were refused, with the advice to list them as accelerometers."""
    record = read(long_table(";", ",", ("T", "J", "k", heading)))
    assert same_readings(record, REFERENCE)
    assert record.unit == unit
    assert record.notes == (f"column '{heading}' is taken for the outputs, by its {why}",)


@pytest.mark.parametrize(
    "others", ["Strom [mA];Spannung [V]", "Mean;Average", "Kanal 1 [V];Kanal 2", "Notes;Mood"]
)
def test_where_several_columns_can_be_the_output_none_is(others):
    with pytest.raises(TableError, match="no column for output"):
        read(f"T;J;k;{others}\n20;1;1;1,35;1,36\n20;5;1;-1,35;-1,36\n")


def test_an_output_that_is_called_so_comes_before_all_others():
    text = "T;J;k;output;Mean [mA]\n20;1;1;1,35;7\n20;5;1;-1,35;8\n"
    record = read(text)
    assert record.output.tolist() == [1.35, -1.35]
    assert record.notes == ("column 'Mean [mA]' is not known and was set aside",)


@pytest.mark.parametrize(
    "headings",
    [
        ("Температура", "№ положения", "№ хода", "Выходной сигнал, В"),
        ("Temp", "No pos", "Nr Hub", "Messwert / V"),
    ],
)
def test_numbers_before_the_words(headings):
    assert same_readings(read(long_table(";", ",", headings)), REFERENCE)


@pytest.mark.parametrize("mark", ["({})", "（{}）"])
def test_chinese_headings(mark):
    headings = (f"温度{mark.format('℃')}", "位置", "行程", "输出")
    assert same_readings(read(long_table("\t", ".", headings)), REFERENCE)
    record = read("编号,角度,行程,温度,输出,单位\nA-7,0,1,20,1.3,mA\nA-7,180,1,20,-1.3,mA\n")
    assert (record.serial, record.unit) == ("A-7", "mA")


@pytest.mark.parametrize("words", [("Hin", "Rück"), ("forward", "back"), ("Aller", "Retour")])
def test_outputs_forward_and_back_are_strokes(words):
    plain = wide_table(";", ",", strokes=("1", "2"))
    assert same_readings(read(wide_table(";", ",", strokes=words)), read(plain))
    with_units = wide_table(";", ",", strokes=[f"{word} [mA]" for word in reversed(words)])
    record = read(with_units)
    assert (record.unit, record.stroke[0]) == ("mA", 2)


def test_a_heading_of_two_directions_is_one():
    head = "Temperatur;Stellung;Hub;Hin/Rück;Messwert"
    record = read(f"{head}\n20;1;1;hin;1,3\n20;5;1;hin;-1,3\n20;5;1;rück;-1,2\n20;1;1;rück;1,2\n")
    assert record.stroke.tolist() == [1, 1, 2, 2]


def test_words_of_directions_beside_a_stroke_are_no_outputs():
    record = read("T,J,k,I [mA],forward,back\n20,1,1,1.3,x,\n20,5,1,-1.3,,y\n")
    assert (record.output.tolist(), record.stroke.tolist()) == ([1.3, -1.3], [1, 1])


def test_words_of_directions_beside_a_lone_output_are_no_outputs():
    """What stood below them was read for it."""
    record = read("# stroke: 1\nT,J,I [mA],forward,back\n20,1,1.3,1,0\n20,5,-1.3,1,0\n")
    assert (record.output.tolist(), record.stroke.tolist()) == ([1.3, -1.3], [1, 1])


@pytest.mark.parametrize("name", ["R_1", "B 1", "F-1", "f_fwd", "R_B"])
def test_letters_and_numbers_of_something_else_are_no_directions(name):
    """The table was refused, as 100.1 is neither forward nor back."""
    record = read(f"T,J,k,{name},Y\n20,1,1,100.1,1.3\n20,5,1,100.2,-1.3\n")
    assert record.notes == (f"column '{name}' is not known and was set aside",)


def test_a_column_of_many_words_is_none_of_directions():
    rows = [(t, p, k, "NSEW"[p % 4], y) for t, p, k, y in ROWS]
    record = read(long_table(headings=("T", "J", "k", "Dir", "Y"), rows=rows))
    assert same_readings(record, REFERENCE)
    assert record.notes == ("column direction does not tell forward from back and was set aside",)


@pytest.mark.parametrize("ratio", ["SF, mA/g", "SF_mA/g", "SF mA / g", "Drift in V/V"])
def test_a_ratio_is_no_unit_of_outputs(ratio):
    """It was a second column that could be the outputs, and the table was refused."""
    record = read(f"T;J;k;Strom in mA;{ratio}\n20;1;1;1,3;9\n20;5;1;-1,3;9\n")
    assert (record.unit, record.output.tolist()) == ("mA", [1.3, -1.3])


@pytest.mark.parametrize("blank", ["\u00a0", "\u2003"])
def test_blanks_of_other_widths_between_columns(blank):
    assert same_readings(read(long_table(blank)), REFERENCE)


@pytest.mark.parametrize("column", ["forward", "back"])
def test_one_direction_alone_is_no_stroke(column):
    record = read(f"T,J,k,output,{column}\n20,1,1,1.3,x\n20,5,1,-1.3,y\n")
    assert record.notes == (f"column '{column}' is not known and was set aside",)


@pytest.mark.parametrize(
    ("headings", "cells", "angles"),
    [
        ("degrees;minutes", "0;0 22;30 359;59,4", [0.0, 22.5, 359.99]),
        ("Grad;Minuten;Sekunden", "0;0;0 22;30;36 -0;15;", [0.0, 22.51, -0.25]),
        ("deg;min", "0;0 22;30 180;", [0.0, 22.5, 180.0]),
    ],
)
def test_degrees_and_minutes_in_columns_of_their_own(headings, cells, angles):
    """The minutes were set aside."""
    rows = "".join(f"20;1;{own};{y}\n" for own, y in zip(cells.split(), (1, 2, 3), strict=True))
    record = read(f"T;k;{headings};Y\n{rows}")
    assert (record.angle.tolist(), record.notes) == (pytest.approx(angles), ())


def test_minutes_in_a_column_of_their_own_are_below_60():
    with pytest.raises(TableError, match=r":3: minutes '60' is not from 0 to below 60; minutes"):
        read("T,k,deg,minutes,Y\n20,1,0,0,1\n20,1,22,60,2\n")


def test_degrees_beside_minutes_are_whole():
    """Minutes of a time were added to the angle."""
    with pytest.raises(TableError, match=r":2: deg '22.5' has a fraction beside minutes; write wh"):
        read("T,k,deg,min,Y\n20,1,22.5,30,1\n20,1,45,31,2\n")


@pytest.mark.parametrize("place", ["angle", "J"])
def test_degrees_and_minutes_beside_a_place_are_set_aside(place):
    """The minutes were added to the angle, or refused beside another."""
    record = read(f"T,{place},k,deg,min,Y\n20,1,1,0,58,1\n20,5,1,180,59,2\n")
    plain = read(f"T,{place},k,Y\n20,1,1,1\n20,5,1,2\n")
    assert record.angle.tolist() == plain.angle.tolist()
    assert record.notes == tuple(
        f"column '{name}' is not known and was set aside" for name in ("deg", "min")
    )


def test_minutes_beside_an_angle_may_be_a_time():
    record = read("T,k,angle,minutes,Y\n20,1,0,0,1\n20,1,180,30,2\n")
    assert record.angle.tolist() == [0.0, 180.0]
    assert record.notes == ("column 'minutes' is not known and was set aside",)


@pytest.mark.parametrize("words", ["Passage {}", "Ход {}", "Проход_{}"])
def test_strokes_across_in_other_languages(words):
    wide = wide_table(";", ",", strokes=[words.format(k) for k in (1, 2)])
    assert same_readings(read(wide), read(wide_table()))


def test_a_serial_that_the_caller_replaces_is_told():
    """The readings of one unit became those of another one without a word."""
    note = "the serial is B-2, as given, in place of A-1 in the table"
    assert read("# serial: A-1\n" + TEXT, serial="B-2").notes == (note,)
    of_column = [(t, p, k, "A-1", y) for t, p, k, y in ROWS]
    text = long_table(headings=("T", "J", "k", "serial", "Y"), rows=of_column)
    assert read(text, serial="B-2").notes == (note,)
    assert read(text, serial="A-1").notes == read("# serial: A-1\n" + TEXT).notes == ()


def test_serials_that_are_not_used_are_told():
    note = "serials A,B was not used: other columns hold the outputs or the serials"
    assert read(TEXT, serials="A,B").notes == (note,)


def test_commas_within_headings_between_blanks_separate_nothing():
    text = long_table(" ", headings=("temperature", "position", "stroke", "output,mA"))
    record = read(text)
    assert same_readings(record, REFERENCE)
    assert record.unit == "mA"


def test_a_cyrillic_unit_with_a_capital_m_is_not_milli():
    with pytest.raises(InputError, match="unit"):
        read("# unit: М\N{CYRILLIC CAPITAL LETTER A}\n" + TEXT)
    assert read("# unit: мк\N{CYRILLIC CAPITAL LETTER VE}\n" + TEXT).unit == "uV"


def test_strokes_forward_alone_are_the_odd_ones():
    rows = [(20, p, k, "forward", p + k) for k in (1, 2, 3) for p in range(1, 9)]
    record = read(long_table(headings=("T", "J", "k", "direction", "Y"), rows=rows))
    assert np.unique(record.stroke).tolist() == [1, 3, 5]


@pytest.mark.parametrize("words", [("forward", "back"), ("CW", "CCW")])
def test_a_direction_that_tells_what_the_strokes_tell_changes_nothing(words):
    rows = [(t, p, k, words[k - 1], y) for t, p, k, y in ROWS]
    record = read(long_table(headings=("T", "J", "k", "direction", "Y"), rows=rows))
    assert same_readings(record, REFERENCE)
    assert record.notes == ()


def test_the_reference_holds_what_was_written():
    record = REFERENCE
    rows = zip(record.temperature, record.position, record.stroke, record.output, strict=True)
    assert [tuple(row) for row in rows] == ROWS
    assert record.run_labels == ("20", "80", "-40")
    assert record.angle.tolist() == [(position - 1) * 45.0 for position in record.position]
    assert record.line.tolist() == list(range(2, 2 + len(ROWS)))
    assert set(record.mounting) == {"o+"}
    assert record.notes == ()


TEXT = long_table()
SAME = {
    "semicolon": long_table(";"),
    "semicolon and decimal comma": long_table(";", ","),
    "tab": long_table("\t"),
    "bars": long_table("|"),
    "bars and blanks, decimal comma": long_table(" | ", ","),
    "tab and decimal comma": long_table("\t", ","),
    "blanks": long_table("   "),
    "blanks behind commas": long_table(", "),
    "CRLF": long_table(end="\r\n"),
    "CR": long_table(end="\r"),
    "no line feed at the end": TEXT.rstrip("\n"),
    "UTF-8 with BOM": TEXT.encode("utf-8-sig"),
    "UTF-16 with BOM": TEXT.encode("utf-16"),
    "UTF-16 little endian": TEXT.encode("utf-16-le"),
    "UTF-16 big endian": TEXT.encode("utf-16-be"),
    "gzip": gzip.compress(TEXT.encode()),
    "gzip of UTF-16": gzip.compress(TEXT.encode("utf-16")),
    "trailing blank fields": TEXT.replace("\n", "," * 3000 + "\n"),
    "trailing blank fields in rows only": TEXT.replace("\n", ",,\n").replace(",,\n", "\n", 1),
    "blank lines": TEXT.replace("\n", "\n\n,,,\n") + "\n" * 1000,
    "quotes": re.sub(r"[^,\n]+", r'"\g<0>"', TEXT),
    "quotes and decimal comma": re.sub(r"[^;\n]+", r'"\g<0>"', long_table(";", ",")).replace(
        ";", ","
    ),
    "Excel's sep line": "sep=;\n" + long_table(";"),
    "numpy.savetxt headings": "# " + TEXT,
    "capitals": long_table(headings=("TEMPERATURE", "Position", "sTROKE", "OUTPUT")),
    "letters": long_table(headings=("T", "J", "k", "Y")),
    "short words": long_table(headings=("temp", "pos", "k", "value")),
    "units": long_table(headings=("T_degC", "J", "k", "reading")),
    "units in brackets": long_table(headings=("temperature [°C]", "pos", "stroke", "signal")),
    "wide": wide_table(),
    "wide, k1": wide_table(strokes=("k1", "k2")),
    "wide, 1": wide_table(strokes=("1", "2")),
    "wide, stroke 1": wide_table(strokes=("Stroke 1", "Stroke 2")),
    "wide, semicolon and decimal comma": wide_table(";", ","),
    "unicode minus": TEXT.replace("-", "\u2212"),
    "en dash as a minus": TEXT.replace("-", "\u2013"),
    "spaces above": "\n\n" + TEXT,
    "end of file mark": TEXT + "\x1a",
    "headings with a comma": TEXT.replace("temperature", '"temperature, degC"', 1),
}


def by_place(record):
    order = np.lexsort((record.position, record.stroke, record.run))
    values = {field.name: getattr(record, field.name) for field in fields(record)}
    arrays = {name: own[order] for name, own in values.items() if isinstance(own, np.ndarray)}
    return replace(record, **arrays)


@pytest.mark.parametrize("name", SAME)
def test_form(name):
    assert by_place(read(SAME[name])) == by_place(REFERENCE)


def across(headings, of_row, of_column, separator=","):
    """The readings with a row for each `of_row`, and a column for each `of_column`."""
    cells = {(of_row(row), of_column(row)): str(row[3]) for row in ROWS}
    rows = dict.fromkeys(map(of_row, ROWS))
    columns = dict.fromkeys(map(of_column, ROWS))
    lines = [[*map(str, row), *(cells[row, column] for column in columns)] for row in rows]
    return "\n".join(map(separator.join, [headings, *lines])) + "\n"


BY_POSITION = (lambda row: (row[0], row[2])), (lambda row: row[1])
BY_TEMPERATURE = (lambda row: row[1:3]), (lambda row: row[0])


def test_one_stroke_across_needs_no_column_but_the_outputs():
    """All else may be declared; such a row passed for none of headings."""
    text = "# temperature: 20\n# stroke: 1\nPos. 1,Pos. 2,Pos. 3,Pos. 5\n1.3,0.9,0.01,-1.3\n"
    record = read(text)
    assert record.output.tolist() == [1.3, 0.9, 0.01, -1.3]
    assert record.angle.tolist() == [0.0, 45.0, 90.0, 180.0]


def test_the_example_across_has_the_readings_of_the_others():
    folder = GUIDE.parents[1] / "examples" / "forms"
    found = [read_table(folder / f"{name}.csv") for name in ("positions_across", "wide")]
    one, other = map(by_place, found)
    assert one == other


@pytest.mark.parametrize("form", ["{}", "J{}", "Pos. {}", "Y{} [mA]", "position_{}"])
def test_a_column_a_position(form):
    headings = ["temperature", "stroke", *map(form.format, range(1, 10))]
    record = read(across(headings, *BY_POSITION), unit="mA")
    assert by_place(replace(record, unit=None)) == by_place(REFERENCE)
    assert record.line.tolist()[8:10] == [2, 3]


@pytest.mark.parametrize("form", ["{} deg", "{}\u00b0", "{}.0 degrees"])
def test_a_column_an_angle(form):
    headings = ["temperature", "stroke", *map(form.format, range(0, 361, 45))]
    record = read(across(headings, *BY_POSITION))
    assert by_place(replace(record, position=REFERENCE.position)) == by_place(REFERENCE)


@pytest.mark.parametrize("form", ["{} degC", "{}\u00b0C", "T={}", "T = {}\u00b0C [mA]"])
def test_a_column_a_temperature(form):
    """Each is a run, in the order of the columns, though the rows go from one to the next."""
    headings = ["position", "stroke", *map(form.format, (20, 80, "\u221240"))]
    record = read(across(headings, *BY_TEMPERATURE))
    assert record.run_labels == ("20", "80", "-40")
    assert by_place(replace(record, unit=None)) == by_place(REFERENCE)


def test_a_table_of_positions_may_have_one_stroke():
    rows = "# stroke: 1\ntemperature,1,3,5\n20,1.35,0.004,-1.35\n60,1.39,,-1.39\n"
    record = read(rows)
    assert record.position.tolist() == [1, 3, 5, 1, 5]
    assert set(record.stroke.tolist()) == {1}
    assert record.notes == ("1 missing reading was left out (line 4)",)


@pytest.mark.parametrize(
    ("headings", "said"),
    [
        ("temperature,stroke,J1,J11", ":1: position '11' is outside the turn; J runs from 1 to 9"),
        (
            "temperature,stroke,0,1",
            ":1: column '0' is position 0; positions count from 1, and headings of head angles have"
            " a unit, as '0 deg'",
        ),
        ("temperature,stroke,45 deg,45\u00b0", ":1: columns '45 deg' and '45\u00b0' mean the same"),
        ("temperature,stroke,1,45 deg", ":1: columns '45 deg' and '1' in one table; use position"),
        ("position,stroke,20 degC,output", ":1: columns 'output' and '20 degC' in one table"),
        ("stroke,position,20 degC,900 degC", ":1: temperature '900' is no temperature of a test"),
        ("temperature,1,2,3", "add a column position or angle, or a column stroke if these"),
        ("temperature,stroke,1 [mA],2 [V]", ":1: units 'mA' and 'V' in one table"),
    ],
)
def test_columns_that_are_no_table_across(headings, said):
    row = ",".join(["20", "1", "1.3", "0.9", "0.5"][: headings.count(",") + 1])
    with pytest.raises(TableError, match=re.escape(said)):
        read(f"{headings}\n{row}\n")


@pytest.mark.parametrize(
    "text",
    [
        "T,angle [deg],k,Y\n20,-1.5,1,-0.02\n20,0,1,0\n20,1.5,1,0.03\n",
        "T,angle,k,Y\n20,-1.5°,1,-0.02\n20,0°,1,0\n20,1.5°,1,0.03\n",
        "T,angle,k,Y\n20,-1°30',1,-0.02\n20,0°,1,0\n20,1°30',1,0.03\n",
        "T,k,-1.5 deg,0 deg,1.5 deg\n20,1,-0.02,0,0.03\n",
    ],
)
def test_degrees_of_a_tilt_are_no_radians_where_the_unit_is_written(text):
    """They were refused, and the remedy was to write them in degrees."""
    assert read(text).angle.tolist() == [-1.5, 0.0, 1.5]


SIDE_BY_SIDE = "temperature,position,stroke,time,{},{},supply [V]\n"
SIDE_BY_SIDE += "20,1,1,0,1.35,1.36,28\n20,3,1,60,0.001,,28\n20,5,1,120,-1.35,-1.36,28\n"


def test_the_example_of_accelerometers_side_by_side_has_the_readings_of_the_others():
    folder = GUIDE.parents[1] / "examples" / "forms"
    across, below = (
        read_tables(folder / f"{name}.csv") for name in ("serials_across", "several_units")
    )
    names = ("serial", "unit", "apparatus", "reference_temperature")
    arrays = ("temperature", "position", "stroke", "output")
    for one, other in zip(across, below, strict=True):
        assert [getattr(one, name) for name in names] == [getattr(other, name) for name in names]
        for name in arrays:
            assert np.array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize(
    ("headings", "listed"),
    [
        (("A7", "B-2"), "# serials: A7, B-2\n"),
        (("A7 [mA]", "B-2 [mA]"), "# serials: A7; B-2\n"),
        (("A7_mA", "B-2 / mA"), "# Seriennummern: A7,B-2\n"),
        (("S/N A7", "SN B-2"), ""),
        (("serial A7 [mA]", "output S/N B-2 [mA]"), ""),
        (("serial no. A7", "serial number: B-2"), ""),
    ],
)
def test_a_column_an_accelerometer(headings, listed):
    one, other = read_tables(io.StringIO(listed + SIDE_BY_SIDE.format(*headings)))
    assert (one.serial, other.serial) == ("A7", "B-2")
    assert one.output.tolist() == [1.35, 0.001, -1.35]
    assert one.time.tolist() == [0.0, 60.0, 120.0]
    assert other.output.tolist() == [1.36, -1.36]
    assert other.position.tolist() == [1, 5]
    assert one.unit == other.unit == ("mA" if "mA" in headings[0] else None)
    missing = f"1 missing reading was left out (line {3 + bool(listed)})"
    assert (missing in one.notes, missing in other.notes) == (False, True)
    assert any("'supply [V]' is not known" in note for note in one.notes)


def test_other_columns_of_an_accelerometer_are_none():
    headings = "T,J,k,SN_1,SN_1_std,SN_2,SN_2_temp,SN 2 n"
    rows = "20,1,1,1.35,1e-6,1.36,21,9\n20,5,1,-1.35,1e-6,-1.36,21,9\n"
    found = read_tables(io.StringIO(f"{headings}\n{rows}"))
    assert [record.serial for record in found] == ["1", "2"]
    assert sum("was set aside" in note for note in found[0].notes) == 3


def test_numbers_may_be_serials_where_they_are_listed():
    text = SIDE_BY_SIDE.format("1", "2")
    found = read_tables(io.StringIO(text), overrides={"serials": "1,2"})
    assert [record.serial for record in found] == ["1", "2"]
    assert [record.stroke.tolist() for record in found] == [[1, 1, 1], [1, 1]]


def test_the_list_of_a_caller_wins_and_leaves_others_aside():
    text = "# serials: A7, B-2\n" + SIDE_BY_SIDE.format("A7", "B-2")
    (only,) = read_tables(io.StringIO(text), overrides={"serials": "B-2"})
    assert only.serial == "B-2"
    assert any("'A7' is not known" in note for note in only.notes)


def test_a_list_of_serials_beside_a_column_of_them_is_metadata():
    text = "# serials: A7, B-2\nserial,temperature,position,stroke,output\n"
    record = read(text + "A7,20,1,1,1.35\nA7,20,5,1,-1.35\n")
    assert (record.serial, record.metadata["serials"]) == ("A7", "A7, B-2")


def test_a_list_of_serials_above_a_column_for_each_stroke_is_metadata():
    record = read("# serials: A7, B-2\nT,J,Y1,Y2\n20,1,1.35,1.35\n20,5,-1.35,-1.35\n")
    assert record.stroke.tolist() == [1, 2, 1, 2]
    assert record.metadata["serials"] == "A7, B-2"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("# serials: A7\nT,J,k,A7,A7 [mA]", ":2: columns 'A7' and 'A7 [mA]' mean the same"),
        ("T,J,k,SN 7,output", ":1: columns 'output' and 'SN 7' in one table; use serial and"),
        ("T,J,k,SN 7,serial", ":1: columns 'serial' and 'SN 7' in one table"),
        ("T,J,k,SN 7,Y2", ":1: columns 'Y2' and 'SN 7' in one table"),
        ("T,J,k,SN 7,SN 07", ":1: serial '07' is '7' in another row"),
        ("T,J,k,SN 7 [mA],SN 8 [V]", ":1: units 'mA' and 'V' in one table"),
        ("T,k,time,SN 7,SN 8", ":1: no column for position or angle"),
        ("# serial: X\nT,J,k,SN 7,SN 8", ":2: serial '7, 8' in the table, but 'X' declared"),
        ("T,J,k,A7 [mA],B2", "or a line '# serials: A7, B2' if these are accelerometers"),
        ("T,J,k,serial port 2,B2", "no column for output"),
    ],
)
def test_columns_that_are_no_accelerometers_side_by_side(text, said):
    with pytest.raises(TableError, match=re.escape(said)):
        read_tables(io.StringIO(f"{text}\n20,1,1,1.35,1.36\n20,5,1,-1.35,-1.36\n"))


def test_an_accelerometer_without_a_reading_is_told():
    text = "T,J,k,SN 7,SN 8\n20,1,1,1.35,\n20,5,1,-1.35,\n"
    with pytest.raises(TableError, match=r":2: serial '8' has no output that is not missing"):
        read_tables(io.StringIO(text))


@pytest.mark.parametrize(
    "cells",
    [
        ("0", "22°30'", "67°29'59.4\""),
        ("0°", "22°30\u2032", "67°29\u203259.4\u2033"),
        ("0°00'00\"", "22° 30' 00\"", "67° 29' 59.4''"),
        ("0:00", "22:30", "67:29:59.4"),
        ("-0:00:00", "22°30", "67°29'59,4\""),
    ],
)
def test_angles_in_minutes_and_seconds(cells):
    rows = "".join(f"20;{cell};1;{y}\n" for cell, y in zip(cells, "123", strict=True))
    record = read("T;angle;k;Y\n" + rows)
    assert record.angle.tolist() == pytest.approx([0.0, 22.5, 67.49983333333333], abs=1e-9)


def test_angles_in_minutes_with_decimal_commas_and_clampings():
    rows = "20,5;-0°30';90°;1;1,35\n20,5;135°07,5';90°;1;-0,95\n"
    record = read("T;angle;clamping;k;Y\n" + rows)
    assert record.angle.tolist() == [-0.5, 135.125]
    assert record.clamping.tolist() == [90.0, 90.0]


@pytest.mark.parametrize(
    ("cell", "angle"),
    [
        ('45°30"', 45.0 + 30.0 / 3600.0),
        ("45°30''", 45.0 + 30.0 / 3600.0),
        ("45°30\u2033", 45.0 + 30.0 / 3600.0),
        ("45°3'0\"", 45.05),
        ("45°30 15", 45.0 + 30.0 / 60.0 + 15.0 / 3600.0),
        ("45°12.5", 45.0 + 12.5 / 60.0),
    ],
)
def test_seconds_alone_are_no_minutes(cell, angle):
    for first in ("0°", "0°00'"):
        record = read(f"T;angle;k;Y\n20;{first};1;1\n20;{cell};1;0.9\n")
        assert record.angle.tolist() == pytest.approx([0.0, angle], abs=1e-9)


@pytest.mark.parametrize("cell", ["22°60'", "22:10:60", "22°30'75\""])
def test_minutes_are_below_60(cell):
    said = re.escape(f"angle {shown(cell)} has 60 minutes or seconds or more; minutes and seconds")
    with pytest.raises(TableError, match=rf":3: {said}"):
        read(f"T;angle;k;Y\n20;0°;1;1\n20;{cell};1;0.9\n")


@pytest.mark.parametrize("cell", ["22°30'15\"7", "22 30 15", "22:30:15:7", "22°30 s"])
def test_what_is_no_angle_is_told(cell):
    with pytest.raises(TableError, match=r":3: angle .* (is not a number|after cells)"):
        read(f"T;angle;k;Y\n20;0;1;1\n20;{cell};1;0.9\n")


def test_a_temperature_above_the_headings_is_no_heading():
    record = read("temperature; 20 degC\nposition;stroke;output\n1;1;1,35\n2;1;0,95\n")
    assert record.temperature.tolist() == [20.0, 20.0]


def test_thousands_marks_in_quotes_are_no_decimal_commas():
    rows = [(t, p, k, f'"{round(1e6 * y):,}"') for t, p, k, y in ROWS]
    assert read(long_table(rows=rows)).output.tolist() == [round(1e6 * row[3]) for row in ROWS]


def test_wide_keeps_the_order_of_the_file():
    record = read(wide_table())
    assert record.stroke.tolist()[:4] == [1, 2, 1, 2]
    assert record.line.tolist()[:4] == [2, 2, 3, 3]


def test_columns_in_any_order():
    rows = [(row[3], row[0], row[2], row[1]) for row in ROWS]
    assert read(long_table(headings=("Y", "T", "k", "J"), rows=rows)) == REFERENCE


@pytest.mark.parametrize(
    "heading",
    [
        "output [mA]",
        "output (mA)",
        "output_mA",
        "Y_ma",
        "Signal [ mA ]",
        "value mA",
        "Y / mA",
        "Y/mA",
    ],
)
def test_unit_in_a_heading(heading):
    assert read(long_table(headings=(*HEADINGS[:3], heading))).unit == "mA"


@pytest.mark.parametrize(
    ("heading", "notes"),
    [
        ("T [degC]", ()),
        ("T [chamber]", ("column 'T [chamber]' is taken in degC",)),
    ],
)
def test_what_is_no_known_unit_of_a_temperature_is_said(heading, notes):
    assert read(f"{heading},J,k,Y [mA]\n20,1,1,1\n20,5,1,2\n").notes == notes


KELVIN = "temperatures are converted from K to degC, the first from 293.15 K to 20 degC"


@pytest.mark.parametrize("heading", ["T [K]", "temp_K", "Temperature (K)", "t [K]", "Oven [K]"])
def test_temperatures_in_kelvin(heading):
    """They were refused."""
    rows = [(f"{float(t) + 273.15:g}", *others) for t, *others in ROWS]
    record = read(long_table(headings=(heading, *HEADINGS[1:]), rows=rows))
    assert record == REFERENCE
    assert KELVIN in record.notes


@pytest.mark.parametrize("heading", ["T [degF]", "Temperature (°F)", "temp_F", "degF", "Temp F"])
def test_temperatures_in_fahrenheit(heading):
    rows = [(f"{1.8 * float(t) + 32:g}", *others) for t, *others in ROWS]
    record = read(long_table(headings=(heading, *HEADINGS[1:]), rows=rows))
    assert record == REFERENCE
    note = "temperatures are converted from .* to degC, the first from 68 .* to 20 degC"
    assert re.fullmatch(note, record.notes[-1])


@pytest.mark.parametrize(
    "text",
    [
        "T,J,k,Y\n293.15 K,1,1,1\n293.15 K,5,1,-1\n",
        "# temperature: 293.15 K\nJ,k,Y\n1,1,1\n5,1,-1\n",
        "# temperature [K]: 293.15\nJ,k,Y\n1,1,1\n5,1,-1\n",
        "Temperature [K]:;293,15\nJ;k;Y\n1;1;1,0\n5;1;-1,0\n",
        "J,k,293.15 K\n1,1,1\n5,1,-1\n",
        "T,J,k,Y\nK,,,\n293.15,1,1,1\n293.15,5,1,-1\n",
    ],
)
def test_kelvin_in_cells_header_lines_and_headings(text):
    record = read(text)
    assert record.temperature.tolist() == [20.0, 20.0]
    assert KELVIN in record.notes


@pytest.mark.parametrize("unit", ["°F", "F"])
def test_a_pivot_table_in_fahrenheit(unit):
    """It was read in degC; with F alone its temperatures were no headings."""
    record = read(f"temperature [{unit}],,68,140\nJ,k,,\n1,1,1,1.1\n5,1,-1,-1.1\n")
    assert record.temperature.tolist() == [20.0, 20.0, 60.0, 60.0]


def test_reference_temperature_and_uncertainty_in_the_unit_they_are_given_in():
    lines = "# T0: 68 °F\n# temperature_uncertainty: 0.9 °F\n"
    for heading, cell in (("T [K]", "293.15"), ("T [°F]", "68"), ("T [°C]", "20")):
        record = read(f"{lines}{heading},J,k,Y\n{cell},1,1,1\n{cell},5,1,-1\n")
        assert record.reference_temperature == 20.0
        assert record.apparatus.temperature_uncertainty == 0.5


def test_a_letter_behind_a_number_is_no_scale():
    text = "T,J,1 F,1 B\n20,1,1.1,1.2\n20,5,-1.1,-1.2\n"
    with pytest.raises(TableError, match="no column for output"):
        read(text)


def test_unit_in_the_cells():
    rows = [(*row[:3], f"{row[3]} mA") for row in ROWS]
    record = read(long_table(rows=rows))
    assert record.unit == "mA"
    assert record.output.tolist() == REFERENCE.output.tolist()


def test_unit_column():
    rows = [(*row, "volts") for row in ROWS]
    assert read(long_table(headings=(*HEADINGS, "unit"), rows=rows)).unit == "V"


def test_capital_t_is_temperature_and_small_t_time():
    rows = [(*row, second) for second, row in enumerate(ROWS)]
    record = read(long_table(headings=("T", "J", "k", "Y", "t"), rows=rows))
    assert record.temperature.tolist() == REFERENCE.temperature.tolist()
    assert record.time.tolist() == list(range(len(ROWS)))


@pytest.mark.parametrize(
    ("heading", "step", "told"),
    [
        ("time", 60.0 / 86400.0, "162 readings in 0.112 s"),  # the days of a spreadsheet
        ("time", 60.0 / 3600.0, "162 readings in 2.68 s"),
        ("time", 1.0, ""),
        ("time [d]", 60.0 / 86400.0, ""),
    ],
)
def test_times_that_no_head_is_quick_enough_for_are_told(tmp_path, heading, step, told):
    frame = accelcal.simulate(seed=1).to_frame().drop(columns="angle")
    frame[heading] = step * np.arange(len(frame))
    path = tmp_path / "a.csv"
    frame.to_csv(path, index=False)
    notes = [note for note in accelcal.read_table(path).notes if "quickly" in note]
    remedy = "and no head turns so quickly; name the unit of the time in its heading, such as"
    assert notes == ([f"{told}, {remedy} time [d]"] if told else [])
    (of_batch,) = set(accelcal.batch(path).tables["notes"])
    assert of_batch == "".join(notes)


def test_a_batch_refuses_milliseconds_since_1970_too(tmp_path):
    frame = accelcal.simulate(seed=1).to_frame().drop(columns="angle")
    path = tmp_path / "a.csv"
    frame.assign(time=1_717_143_600_000 + 60_000 * np.arange(len(frame))).to_csv(path, index=False)
    found = accelcal.batch(path)
    assert len(found.tables) == 0
    assert "'1717143600000' is no time of a record" in found.errors["message"][0]
    path.write_text(path.read_text().replace(",time", ",time [ms]", 1))
    assert len(accelcal.batch(path).tables) == 3
    assert np.diff(accelcal.read_table(path).time).tolist() == [60.0] * (len(frame) - 1)


@pytest.mark.parametrize(("heading", "factor"), [("time", 1), ("t [min]", 60), ("time_ms", 1e-3)])
def test_time_in_seconds(heading, factor):
    rows = [(*row, second) for second, row in enumerate(ROWS)]
    time = read(long_table(headings=(*HEADINGS, heading), rows=rows)).time
    assert time.tolist() == [second * factor for second in range(len(ROWS))]


@pytest.mark.parametrize("zone", ["", "Z", "+03:00"])
def test_time_as_a_date(zone):
    rows = [
        (*row, f"2024-05-31 23:{i // 60 + 58}:{i % 60:02d}.5{zone}") for i, row in enumerate(ROWS)
    ]
    record = read(long_table(headings=(*HEADINGS, "time"), rows=rows))
    assert record.time.tolist() == list(range(len(ROWS)))
    hour = 20 if zone == "+03:00" else 23
    assert record.metadata["start"] == f"2024-05-31T{hour}:58:00.500000"


def test_header_lines():
    header = """
# serial: AL-15-003
# Unit = milliamps
# g [m/s^2]: 9.8106
# T0: 20 degC
# positions: 8
# head_uncertainty: 2e-5 rad
# launch_uncertainty: 2e-5
# launch_sf_uncertainty: 1.5e-5
# temperature_uncertainty: 0.1
# resolution: 1e-6 mA
# delta0: 0.001
# date: 2009-05-31
# operator: A. Nobody: on duty
# measured after a week of rest
"""
    record = read(header + TEXT)
    stand = record.apparatus
    assert (record.serial, record.unit, record.date) == ("AL-15-003", "mA", "2009-05-31")
    assert record.reference_temperature == 20.0
    assert (stand.local_gravity, stand.head_uncertainty, stand.resolution) == (9.8106, 2e-5, 1e-6)
    assert (stand.launch_uncertainty, stand.launch_sf_uncertainty) == (2e-5, 1.5e-5)
    assert stand.temperature_uncertainty == 0.1
    assert record.metadata == {
        "operator": "A. Nobody: on duty",
        "delta0": "0.001",
        "comment": "measured after a week of rest",
    }


@pytest.mark.parametrize("key", ["T0 [degC]", "T0, degC", "T0 in degC", "T0 / degC"])
def test_a_unit_of_a_header_line_may_stand_behind_its_key(key):
    """Behind `in` or a slash it made the key an unknown one."""
    assert read(f"# {key}: 20\n{TEXT}").reference_temperature == 20.0


@pytest.mark.parametrize("line", ["# run in h: 5", "# stroke / mm: 30"])
def test_what_has_a_unit_is_no_label_or_count(line):
    """All readings would have been one run, of the name 5 h."""
    record = read(f"{line}\n{TEXT}")
    assert record.run_labels == ("20", "80", "-40")
    assert not any("header line" in note for note in record.notes)


FORM = "Position;Stroke 1;Stroke 2\n1;1,301;1,302\n3;0,004;0,004\n5;-1,293;-1,294\n"


@pytest.mark.parametrize(
    "row",
    [
        "Serial;A-7;;Date;31.05.2024",
        "Serial:;A-7;;Date:;31.05.2024",
        "Serial: A-7;;Date: 31.05.2024;",
        "Tumble test;Date:;31.05.2024;Serien-Nr.;;A-7",
    ],
)
def test_cells_beside_each_other_above_a_table_declare_one_by_one(row):
    """The whole row was the serial number, without a word."""
    record = read(f"{row}\nTemperature;20;\n{FORM}")
    assert (record.serial, record.date) == ("A-7", "31.05.2024")


@pytest.mark.parametrize(
    "rows",
    [
        "serial;Operator;date\nA-7;N. N.;31.05.2024",
        "Date;g;Stand;Serial no.\n31.05.2024;9,81;B 2;A-7",
    ],
)
def test_labels_above_a_table_may_have_their_values_in_the_row_below(rows):
    """The label beside a key was its value: the serial was Operator, the date T0."""
    record = read(f"{rows}\nTemperature;20;\n{FORM}")
    assert (record.serial, record.date) == ("A-7", "31.05.2024")


def test_labels_above_a_table_may_have_a_digit():
    """The serial was 'g', and T0 was lost."""
    record = read("T0 [K],Serial,g\n293.15,A-7,9.81\nT [degC],J,k,Y\n20,1,1,1\n20,5,1,-1\n")
    assert (record.serial, record.reference_temperature) == ("A-7", 20.0)
    assert record.apparatus.local_gravity == 9.81


def test_a_word_is_no_date():
    record = read(f"Date;Operator\nTemperature;20;\n{FORM}")
    assert record.date is None
    assert record.notes == ("text above the headings was set aside (line 1)",)


def test_what_a_row_above_a_table_does_not_declare_is_told():
    record = read(f"Serial;A-7;;Operator;N. N.\nTemperature;20;\n{FORM}")
    assert (record.serial, record.metadata) == ("A-7", {})
    assert record.notes == ("text above the headings was set aside (line 1)",)


@pytest.mark.parametrize(
    ("rows", "serial"),
    [
        ("Serial;A-7;Voltmeter;HP;S/N;123", "A-7"),
        ("Multimètre;HP;S/N;123;Accelerometer;AL-15;S/N;A-7", "A-7"),
        ("Thermometer;S/N;5;Netzteil;S/N;6;Date;31.05.2024;S/N;A-7", "A-7"),
        ("Accelerometer;AL-15;S/N;A-7", "A-7"),
        ("Voltmeter;HP;Accelerometer;AL-15;S/N;A-7", "A-7"),
        ("Chamber;7;DUT;AL-15;Serial;A-7", "A-7"),
        ("Messrahmen;Q;S/N;123\nSerial;A-7", "A-7"),
        ("S/N (DMM);123;S/N;A-7", "A-7"),
        ("Accelerometer S/N;A-7;DMM S/N;123", "A-7"),
        ("Seriennummer Netzteil;123;Seriennummer Prüfling;A-7", "A-7"),
        ("Accelerometer;AL-15\nS/N;A-7\nVoltmeter;HP\nS/N;123", "A-7"),
        ("Voltmeter;HP\nS/N;123\nDUT;AL-15\nDate;31.05.2024\nS/N;A-7", "A-7"),
        ("Serial;A-7\nVoltmeter\nSerial;123", "A-7"),
        ("Voltmeter;HP\n;;\nS/N;A-7", "A-7"),
        ("S/N;;Voltmeter;123", None),
        ("S/N;Voltmeter;DMM S/N;123", "Voltmeter"),
        ("S/N;;A-7;Operator;N. N.", "A-7"),
        ("N° de série;A-7", "A-7"),
        ("# Nº de série: A-7", "A-7"),
        ("# Seriennummer, V = mA", None),
        ("Netzteil;X;S/N (DUT);A-7", "A-7"),
        ("Voltmeter S/N: 123", None),
        ("S/N;;DMM S/N;123", None),
        ("Accelerometer S/N: A-7, Voltmeter S/N: 123", "A-7"),
        ("Unit under test;AL-15;S/N;A-7;DMM;HP;S/N;123", "A-7"),
        ("Equipment under test;AL-15;S/N;A-7;DMM;HP;S/N;123", "A-7"),
        ("Instrument under test;AL-15\nS/N;A-7", "A-7"),
        ("Prüfling Typ;AL-15;Seriennr.;A-7;DMM;HP;Seriennr.;1", "A-7"),
        ("Изделие;АК-15;Зав. №;1234\nВольтметр;В7-78;Зав. №;555", "1234"),
        ("# DUT S/N: A-7\n# DMM S/N: 123", "A-7"),
        ("# accelerometer_serial: A-7", "A-7"),
        ("# S/N (DMM): 123\n# S/N (DUT): A-7", "A-7"),
        ("# S/N (DMM),123", None),
    ],
)
def test_a_serial_of_the_accelerometer_is_told_from_those_of_instruments(rows, serial):
    """The voltmeter was calibrated."""
    record = read(f"{rows}\nTemperature;20;\n{FORM}")
    assert record.serial == serial
    assert not any("accelerometer" in note for note in record.notes)


@pytest.mark.parametrize(
    ("rows", "serial", "behind"),
    [
        ("Accelerometer;AL-15;Messrahmen;Q;S/N;123", "123", "Messrahmen Q"),
        ("Accelerometer stand;Q;S/N;123", "123", "Accelerometer stand Q"),
        ("Beschleunigungsnormal;Q;S/N;123", "123", "Beschleunigungsnormal Q"),
        ("Tumble test in chamber 3;;Serial: A-7", "A-7", "Tumble test in chamber 3"),
        ("Accelerometer with logger;S/N;A-7", "A-7", "Accelerometer with logger"),
        ("Operator: J. Coven;S/N: A-7", "A-7", "Operator: J. Coven"),
        ("Rotary table test;;S/N: A-7", "A-7", "Rotary table test"),
        ("Head calibration\nS/N;A-7", "A-7", "Head calibration"),
        ("Oven temperature;20 degC\nS/N;A-7", "A-7", "Oven temperature 20 degC"),
        ("Chamber;20 °C\nS/N;A-7", "A-7", "Chamber 20 °C"),
        ("Oven test of an accelerometer\nS/N;A-7", "A-7", "Oven test of an accelerometer"),
        ("Gerät: QA-2000\nSeriennummer: A-7", "A-7", "Gerät: QA-2000"),
        ("Frame;HP;S/N;123", "123", "Frame HP"),
        ("Frame;HP\nDate;31.05.2024\nS/N;123", "123", "Frame HP"),
        ("Voltmeter S/N;123;S/N;A-7", "A-7", "Voltmeter S/N 123"),
    ],
)
def test_a_serial_that_may_be_of_an_instrument_is_taken_with_a_note(rows, serial, behind):
    record = read(f"{rows}\nTemperature;20;\n{FORM}")
    told = f"serial '{serial}' stands behind '{behind}' (line {1 + rows.count(chr(10))})"
    assert record.serial == serial
    assert f"{told} and is taken for that of the accelerometer" in record.notes


@pytest.mark.parametrize(
    "rows",
    [
        "Voltmeter;HP;S/N;123",
        "Voltmeter: HP 3458A;S/N: 123",
        "Voltmeter;HP;Date;31.05.2024;S/N;123",
        "Klimakammer;S/N;7",
        "Klimakammer;S/N;7;DMM;S/N;7",
        "S/N (DMM);123",
        "Voltmeter\nS/N;123",
        "Voltmeter;HP\nS/N;123",
        "Voltmeter;HP\nDate;31.05.2024\nS/N;123",
        "DUT;AL-15\nVoltmeter;HP\nS/N;123",
        "Model;DMM6500\nSerial Number;123",
        "Instrument:;34465A\nSerial Number:;123",
        "Gerät:;Keithley 2182A\nSeriennummer:;123",
        "Digital multimeter;S/N;123",
    ],
)
def test_a_serial_behind_an_instrument_is_not_that_of_the_accelerometer(rows):
    """It was taken for it: a wrong record where the voltmeter's export has its own alone."""
    record = read(f"{rows}\nTemperature;20;\n{FORM}")
    assert record.serial is None
    assert any("may be that of an instrument and is not used" in note for note in record.notes)


def test_a_serial_that_is_the_first_of_its_row_goes_before_those_that_are_not():
    record = read(f"Operator;N. N.\nSerial;A-7\nDMM;S/N;123\nTemperature;20;\n{FORM}")
    assert record.serial == "A-7"
    assert record.notes == (
        "text above the headings was set aside (lines 1, 3)",
        "serial 'A-7' stands behind 'Operator N. N.' (line 2) and is taken for that of the"
        " accelerometer",
    )


def test_of_several_serials_that_may_be_of_instruments_none_is_taken():
    """The record was refused."""
    record = read(f"Model;Q-7;S/N;A-7\nDVM;K 2002;S/N;123\nTemperature;20;\n{FORM}")
    told = "serials 'A-7, 123' above the headings were set aside"
    assert record.serial is None
    assert f"{told}: nothing tells which is that of the accelerometer" in record.notes
    assert read(f"Model;Q-7\nS/N;A-7\nDVM;K 2002\nS/N;123\nTemperature;20;\n{FORM}").serial is None


def test_two_serials_that_stand_alone_are_refused_with_what_to_call_that_of_an_instrument():
    told = "serial is '123', but 'A-7' in line 1; declare each key once; that of an instrument"
    with pytest.raises(TableError, match=told):
        read(f"Serial;A-7\nSerial;123\nTemperature;20;\n{FORM}")
    assert read(f"Serial;A-7\nDMM S/N;123\nTemperature;20;\n{FORM}").serial == "A-7"


def test_a_column_of_serials_tells_more_than_a_serial_that_may_be_of_an_instrument():
    text = "Voltmeter;HP;S/N;123\nserial;temperature;position;stroke;output\n"
    assert read(f"{text}A-7;20;1;1;1,3\nA-7;20;5;1;-1,3\n").serial == "A-7"


@pytest.mark.parametrize("separator", [",", ";"])
@pytest.mark.parametrize("word", ["Comment", "Bemerkungen", "NOTE", "Remarque", "Примечание"])
def test_a_comment_above_the_headings_goes_on_to_the_end_of_its_row(word, separator):
    """What looks like a declaration in it was one, and refused as no unit."""
    record = read(f"Serial: A-7\n{word}: warm; unit: by eye\n{long_table(separator)}")
    assert (record.serial, record.unit) == ("A-7", None)
    assert record.notes == ("text above the headings was set aside (line 2)",)


@pytest.mark.parametrize("row", ["Bemerkung:;;S/N:;A-7", "Remarks;none;S/N;A-7", "Note;S/N: A-7"])
def test_behind_the_cell_of_a_comment_a_form_goes_on(row):
    """The serial was lost."""
    assert read(f"{row}\nTemperature;20;\n{FORM}").serial == "A-7"


def test_a_key_of_a_form_that_was_not_filled_in_declares_nothing():
    record = read(f"Serial:;;Date:;31.05.2024\nTemperature:;20;\n{FORM}")
    assert (record.serial, record.date) == (None, "31.05.2024")


@pytest.mark.parametrize(
    "row",
    [
        *("Temperature:;20,5", "Temperature;20,5;°C", "Temperature, °C;20,5", "T=20,5 °C"),
        *("Temperature in °C:;20,5", "Temperature / °C;20,5;Resolution;1;uA"),
        "Serial;A-7;;Temperature;20,5 °C",  # it passed for the headings
    ],
)
def test_units_of_cells_above_a_table(row):
    record = read(f"{row}\nUnit;mA;Gravity;9,81;m/s^2\n{FORM}")
    assert record.temperature[0] == 20.5
    assert (record.unit, record.apparatus.local_gravity) == ("mA", 9.81)
    assert record.apparatus.resolution == (0.001 if "Resolution" in row else None)


@pytest.mark.parametrize("row", ["serials,A7,B2", "serials: A7, B2"])
def test_a_list_in_cells_above_a_table(row):
    text = f"{row}\nT,J,k,A7,B2\n20,1,1,1.35,1.31\n20,3,1,0.1,0.2\n20,5,1,-1.35,-1.31\n"
    assert [record.serial for record in read_tables(io.StringIO(text))] == ["A7", "B2"]


def test_units_behind_in():
    head = "Temperatur in °C;Winkel in Grad;Hub;output in mA;sd in uA;n;Zeit in min"
    record = read(f"{head}\n20;0;1;1,3;2;10;0\n20;180;1;-1,3;2;10;1\n")
    assert (record.unit, record.std.tolist(), record.time.tolist()) == ("mA", [2e-3] * 2, [0, 60])


def test_header_lines_as_excel_saves_them():
    header = '"# comment: first, second",,,\n# unit: mA,,,\nserial,A7,,\nTumble test,,,\n'
    record = read(header + TEXT)
    assert (record.serial, record.unit) == ("A7", "mA")
    assert record.metadata == {"comment": "first, second"}
    assert record.notes == ("text above the headings was set aside (line 4)",)


@pytest.mark.parametrize(
    "header",
    ["serial=A7;unit=mA", "# serial: A7; unit: mA", "#unit: mA,serial: A7", "# unit=mA\tserial=A7"],
)
def test_several_declarations_in_a_line(header):
    """The serial was 'A7;unit=mA', and there was no unit."""
    record = read(f"{header}\n{TEXT}")
    assert (record.serial, record.unit, record.metadata, record.notes) == ("A7", "mA", {}, ())


@pytest.mark.parametrize("mark", [";", ",", "\t"])
def test_a_declaration_beside_one_with_another_key_ends_there(mark):
    """The serial was 'A7; operator: X', without a word."""
    record = read(f"# serial: A7{mark} operator: X\n# date: 31.05.2024 14:30; 15:10\n{TEXT}")
    assert (record.serial, record.metadata) == ("A7", {"operator": "X"})
    assert record.date == "31.05.2024 14:30; 15:10"


def test_a_value_with_such_signs_stays_whole():
    header = "# note: warm; unit: by eye\n# serial: A;B\n# operator: N. N., on duty\n"
    record = read(header + TEXT)
    assert (record.serial, record.unit) == ("A;B", None)
    assert record.metadata == {"note": "warm; unit: by eye", "operator": "N. N., on duty"}
    with pytest.raises(TableError, match=r":2: unit is 'V', but 'mA' in line 1"):
        read(f"# unit: mA\n# T0: 20; unit: V\n{TEXT}")


def test_decimal_comma_in_header_lines():
    record = read("# T0: 20,5\n# g: 9,8106\n" + long_table(";", ","))
    assert (record.reference_temperature, record.apparatus.local_gravity) == (20.5, 9.8106)


def test_overrides_win_over_the_header():
    text = "# g: 9.8106\n# serial: A\n# unit: V\n# T0: 25\n" + TEXT
    record = read(text, local_gravity=9.80665, serial="B", unit="mA", reference_temperature=None)
    assert (record.serial, record.unit, record.reference_temperature) == ("B", "mA", 25.0)
    assert record.apparatus.local_gravity == 9.80665


@pytest.mark.parametrize(
    ("header", "heading"),
    [("# unit: V\n", "output"), ("", "output [V]"), ("# unit: pt\n", "output")],
)
def test_a_unit_that_is_overridden_is_said(header, heading):
    written = "pt" if "pt" in header else "V"
    text = header + TEXT.replace("output", heading, 1)
    said = f"the table has outputs in '{written}'; they are taken as mA, as asked"
    assert read(text, unit="mA").notes == (said,)
    assert read(TEXT, unit="mA").notes == ()
    assert read("# unit: milliamp\n" + TEXT, unit="mA").notes == ()


@pytest.mark.parametrize("unit", ["M/S^2", "M/S2", "VOLTS", "KHZ"])
def test_a_unit_in_capitals_where_no_prefix_is_another(unit):
    text = TEXT.replace("output", f"output [{unit}]", 1)
    assert read(text).unit in ("m/s^2", "V", "kHz")


@pytest.mark.parametrize(
    "text",
    [
        "T,J,k,Y [mA],std [V]\n20,1,1,1.3,0.1\n20,3,1,0.0,0.1\n",
        "T,J,Y1 [mA],Y2 [V]\n20,1,1.3,1.2\n20,3,0.0,0.1\n",
        "T,J,k,Y,unit\n20,1,1,1.3,mA\n20,3,1,0.1,V\n",
    ],
)
def test_a_unit_that_is_asked_for_does_not_make_one_of_two(text):
    """All numbers were taken in that unit, some of them wrong by powers of ten."""
    with pytest.raises(
        TableError, match="in one table; give all outputs and their std in one unit"
    ):
        read(text, unit="mA")
    one = text.replace("V", "mA")
    assert read("# unit: V\n" + one, unit="mA").unit == "mA"


@pytest.mark.parametrize(
    ("header", "headings", "asked"),
    [
        ("", "T,J,k,Y [mA],std [uA],n", {}),
        ("# unit: mA\n", "T,J,k,Y,std [uA],n", {}),
        ("", "T,J,k,Y,std [\u00b5A],n", {"unit": "mA"}),
        ("", "T,J,k,Y [mA],std [uA],n", {"unit": "V"}),
        ("# unit: V\n", "T,J,k,Y,std [uA],n", {"unit": "mA"}),
        ("", "T,J,k,Y [A],std [mA],n", {}),
    ],
)
def test_std_in_another_unit_of_the_same_quantity(header, headings, asked):
    record = read(f"{header}{headings}\n20,1,1,1.3,4,10\n20,3,1,0.0,5,10\n", **asked)
    assert record.std.tolist() == [0.004, 0.005]
    assert record.output.tolist() == [1.3, 0.0]


def test_std_alone_names_the_unit_of_both():
    record = read("T,J,k,Y,std [uA]\n20,1,1,1.3,4\n20,3,1,0.0,5\n")
    assert (record.unit, record.std.tolist()) == ("uA", [4.0, 5.0])
    with pytest.raises(TableError, match=r":1: unit 'percent' is no output unit"):
        read("T,J,k,Y [mA],std [percent]\n20,1,1,1.3,4\n20,3,1,0.0,5\n")


def test_an_override_replaces_a_bad_header_line():
    assert read("# g: somewhere\n" + TEXT, local_gravity=9.81).apparatus.local_gravity == 9.81


def test_unknown_override():
    with pytest.raises(InputError, match="'gravity' cannot be declared; write local_gravity"):
        read(TEXT, gravity=9.81)
    with pytest.raises(InputError, match="'mass' cannot be declared; it is one of local_gravity,"):
        read(TEXT, mass=0.1)


def test_header_lines_stand_for_columns():
    rows = [(row[1], row[3]) for row in ROWS[:9]]
    header = "# temperature: 20\n# stroke: 1\n# run: 20\n# mounting: o\n"
    record = read(header + long_table(headings=("position", "output"), rows=rows))
    assert record == read(long_table(rows=ROWS[:9]))


def test_header_line_stands_for_an_empty_column():
    rows = [(*row[1:], "") for row in ROWS[:9]]
    text = "# mounting: p\n" + long_table(headings=(*HEADINGS[1:], "mounting"), rows=rows)
    record = read("# temperature: 20\n" + text)
    assert set(record.mounting) == {"p+"}
    assert record.notes == ("column mounting is empty and was set aside",)


def test_header_line_of_the_stroke_in_a_wide_table():
    record = read("# stroke: 7\n" + wide_table())
    assert set(record.stroke) == {1, 2}
    assert record.notes == ("header line stroke was set aside: the table has such a column",)


def test_a_comment_that_looks_like_headings_stays_a_comment():
    record = read("# position temperature\n# runs: 20,80,-40,k,T\n" + TEXT)
    assert record.metadata == {"comment": "position temperature"}
    assert record.run_labels == ("20", "80", "-40", "k", "T")


def test_temperature_unknown():
    rows = [row[1:] for row in ROWS[:9]]
    record = read("# temperature: unknown\n" + long_table(headings=HEADINGS[1:], rows=rows))
    assert np.isnan(record.temperature).all()
    assert record.run_labels == ("unknown",)


def test_column_wins_over_the_header_line():
    record = read("# temperature: 25\n" + TEXT)
    assert record == REFERENCE
    assert record.notes == ("header line temperature was set aside: the table has such a column",)


def test_recorded_temperatures_scatter_about_a_level():
    rows = [(row[0] + 0.3 * (i % 4), *row[1:]) for i, row in enumerate(ROWS)]
    record = read(long_table(rows=rows))
    assert record.run_labels == ("20", "80", "-40")
    assert record.run.tolist() == REFERENCE.run.tolist()


def test_run_column_tells_visits_apart():
    rows = [(*row, "up") for row in ROWS[:18]] + [
        (*row[:3], row[3] + 1e-3, "down") for row in ROWS[:18]
    ]
    record = read(long_table(headings=(*HEADINGS, "run"), rows=rows))
    assert record.run_labels == ("up", "down")
    assert record.run.tolist() == [0] * 18 + [1] * 18


@pytest.mark.parametrize("heading", ["theta [deg]", "Angle", "position (deg)", "TH_deg"])
def test_angles_instead_of_positions(heading):
    rows = [(t, (j - 1) * 45, k, y) for t, j, k, y in ROWS]
    record = read(long_table(headings=("T", heading, "k", "Y"), rows=rows))
    assert record.angle.tolist() == REFERENCE.angle.tolist()
    assert not record.position.any()


def test_angle_is_used_where_position_is_given_too():
    rows = [(*row, (row[1] - 1) * 45 + 0.01) for row in ROWS]
    rows[3] = (*rows[3][:4], "")
    record = read(long_table(headings=(*HEADINGS, "angle"), rows=rows))
    assert record.angle[2] == 90.01
    assert record.angle[3] == 135.0
    assert record.position.tolist() == REFERENCE.position.tolist()


@pytest.mark.parametrize("off", [-22.0, 22.0, 338.0, -382.0])
def test_angle_may_be_off_its_position_by_half_a_step(off):
    rows = [(*row, (row[1] - 1) * 45 + off) for row in ROWS]
    record = read(long_table(headings=(*HEADINGS, "angle"), rows=rows))
    assert record.angle.tolist() == [row[4] for row in rows]


@pytest.mark.parametrize("off", [-23.0, 23.0, 337.0, 180.0])
def test_angle_further_off_its_position(off):
    rows = [(*row, (row[1] - 1) * 45 + off) for row in ROWS]
    with pytest.raises(TableError, match=r"misses by more than 22.5 deg"):
        read(long_table(headings=(*HEADINGS, "angle"), rows=rows))


def test_twelve_positions():
    rows = [(20, j, 1, 0.1 * j) for j in range(1, 14)]
    record = read("# positions: 12\n" + long_table(rows=rows))
    assert record.angle.tolist() == [30.0 * i for i in range(13)]


def test_a_turn_that_is_never_gone_round_is_noted():
    rows = [(20, j, 1, 0.1 * j) for j in range(1, 10)]
    note = (
        "positions 10 to 13 never occur in a turn of 12; if position 9 is the return to 1, declare"
        " '# positions: 8'"
    )
    assert read("# positions: 12\n" + long_table(rows=rows)).notes == (note,)
    assert read(long_table(rows=rows)).notes == ()
    assert read(long_table(rows=rows[:8])).notes == ()  # without the return
    assert read(long_table(rows=rows[:7:3])).notes == ()  # positions 1, 4, 7


@pytest.mark.parametrize("size", [1.0, 2000.0])
def test_a_number_of_nines_is_a_reading_among_its_like(size):
    rows = [(20, j, 1, 999 if j == 3 else size * j) for j in range(1, 10)]
    if size == 1.0:
        rows[0] = (20, 1, 1, 150.0)
    assert read(long_table(rows=rows)).output[2] == 999.0


@pytest.mark.parametrize(
    ("written", "read_as"), [("o", "o+"), ("P", "p+"), ("p-", "p-"), ("O+", "o+")]
)
def test_mounting(written, read_as):
    rows = [(*row, written) for row in ROWS]
    record = read(long_table(headings=(*HEADINGS, "Mounting"), rows=rows))
    assert set(record.mounting) == {read_as}


def test_averaged_readings():
    rows = [(*row, "" if i == 4 else 1e-6, 100) for i, row in enumerate(ROWS)]
    record = read(long_table(headings=(*HEADINGS, "sd", "samples"), rows=rows))
    assert np.isnan(record.std[4])
    assert set(np.delete(record.std, 4)) == {1e-6}
    assert set(record.count) == {100.0}


@pytest.mark.parametrize("cell", ["", "NA", "NaN", "n/a", "#N/A", "#NV", "-", "---", "null"])
def test_missing_readings_are_counted(cell):
    rows = [(*row[:3], cell) if i in (0, 7) else row for i, row in enumerate(ROWS)]
    record = read(long_table(rows=rows))
    kept = np.ones(len(ROWS), dtype=bool)
    kept[[0, 7]] = False
    assert record == REFERENCE.select(kept)
    assert record.notes == ("2 missing readings were left out (lines 2, 9)",)


def test_missing_readings_of_a_wide_table():
    text = "temperature,position,Y1,Y2\n20,1,1.3,\n20,2\n20,5,-1.3,-1.2\n"
    record = read(text)
    assert record.output.tolist() == [1.3, -1.3, -1.2]
    assert record.notes == (
        "the last outputs count as missing in rows that end early (line 3)",
        "3 missing readings were left out (lines 2, 3)",
    )


def test_a_repeated_reading_is_kept_once():
    record = read(long_table(rows=[*ROWS, ROWS[4]]))
    assert record == REFERENCE
    assert record.notes == (f"1 repeated reading was left out (line {len(ROWS) + 2})",)


def test_unknown_and_empty_columns_are_set_aside():
    rows = [(i, *row, "ok", "") for i, row in enumerate(ROWS)]
    record = read(long_table(headings=("", *HEADINGS, "remark", "serial"), rows=rows))
    assert record == REFERENCE
    assert record.notes == (
        "column 1 without heading is not known and was set aside",
        "column 'remark' is not known and was set aside",
        "column serial is empty and was set aside",
    )


def test_comment_inside_the_table():
    record = read(TEXT.replace("\n80,", "\n# the chamber was heated\n80,", 1))
    assert record == REFERENCE
    assert record.notes == ("1 comment line was set aside (line 20)",)


def test_an_excel_error_is_a_missing_reading_and_no_comment():
    rows = [(row[3], *row[:3]) for row in ROWS]
    rows[1] = ("#N/A", *rows[1][1:])
    record = read(long_table(headings=("Y", "T", "J", "k"), rows=rows))
    assert record.notes == ("1 missing reading was left out (line 3)",)


def test_a_direction_of_the_temperature_is_set_aside_with_a_note():
    rows = [
        f"{t},{j},{k},{word},{j}.5"
        for t, word in ((20, "heating"), (-20, "cooling"))
        for k in (1, 2)
        for j in range(1, 10)
    ]
    (record,) = read_tables(io.StringIO("\n".join(["T,J,k,direction,Y", *rows])))
    assert sorted(set(record.stroke.tolist())) == [1, 2]
    assert "column direction does not tell forward from back and was set aside" in record.notes


def test_headings_in_letters_of_another_encoding_are_told_of_it(tmp_path):
    path = tmp_path / "cyrillic.csv"
    path.write_bytes("Температура;Положение;Ход;Выход\n20;1;1;1,35\n".encode("iso8859-5"))
    with pytest.raises(accelcal.TableError, match="the text is not UTF-8: export it so"):
        accelcal.read_table(path)


def test_latin_1_is_noted():
    record = read("# operator: Müller\n".encode("latin-1") + TEXT.encode())
    assert record.metadata == {"operator": "Müller"}
    assert record.notes == ("the text is not UTF-8 and was read as latin-1",)


@pytest.mark.parametrize(
    "headings", ["№ положения;№ хода;Выходной сигнал, мА", "Положение №;Ход №;Ток, мА"]
)
def test_a_table_of_a_russian_program(tmp_path, headings):
    rows = "".join(f"20;{j};1;{y:.4f}\n" for j, y in enumerate([1.35, 0.96, 0.005, -0.95], 1))
    path = tmp_path / "a.csv"
    text = f"# оператор: Ёлкин\nТемпература, °С;{headings}\n{rows}".replace(".", ",")
    path.write_bytes(text.encode("windows-1251"))
    record = accelcal.read_table(path)
    assert (record.unit, record.output[3]) == ("mA", -0.95)
    assert record.metadata == {"оператор": "Ёлкин"}
    assert record.notes[0] == "the text is not UTF-8 and was read as windows-1251"


@pytest.mark.parametrize(
    ("encoding", "read_as", "headings"),
    [
        ("gbk", "gb18030", "温度（°C）;位置;行程;输出（mA）"),
        ("gb2312", "gb18030", "T;position;stroke;读数 [mA]"),
        ("koi8-r", "koi8-r", "Температура;Положение;Ход;Выход, мА"),
        ("cp866", "cp866", "Температура;Положение;Ход;Выход, мА"),
        ("windows-1252", "windows-1252", "Température;Position;Passage;Sortie [mA]"),
    ],
)
def test_a_table_in_an_older_encoding_is_told_by_its_headings(encoding, read_as, headings):
    """It was refused, as no heading was known."""
    text = f"# note: – {headings}\n{headings}\n20;1;1;1,35\n20;3;1;0,01\n20;5;1;-1,3\n"
    record = read(text.encode(encoding, "replace"))
    assert record.output.tolist() == [1.35, 0.01, -1.3]
    assert (record.unit, record.temperature[0]) == ("mA", 20.0)
    assert headings in record.metadata["note"]
    assert record.notes[0] == f"the text is not UTF-8 and was read as {read_as}"


def test_damaged_letters_of_two_bytes_are_refused():
    """The second byte could be a separator."""
    text = "温度;位置;行程;输出;备注\n" + "20;1;1;1,35;好\n" * 5000
    with pytest.raises(TableError, match="the gb18030 text is damaged; export the file again"):
        read(text.encode("gbk") + b"20;5;1;-1,3;\xb0;\n")


@pytest.mark.parametrize("heading", ["Position n°", "N° Position", "position N°"])
def test_a_position_counted_in_french(heading):
    text = f"Température (°C);{heading};Passage;Courant (mA)\n20;1;1;1,35\n20;5;1;-1,3\n"
    record = read(text.encode("latin-1"))
    assert record.position.tolist() == [1, 5]


def test_several_accelerometers():
    rows = [
        (*row[:3], row[3] + shift, serial)
        for row in ROWS
        for serial, shift in (("B", 0), ("A", 1e-3))
    ]
    text = long_table(headings=(*HEADINGS, "S/N"), rows=rows)
    first, second = read_tables(io.StringIO(text))
    assert (first.serial, second.serial) == ("B", "A")
    assert first.output.tolist() == REFERENCE.output.tolist()
    with pytest.raises(TableError, match="serials 'B, A' in one table; read them by read_tables"):
        read_table(io.StringIO(text))


def test_missing_readings_are_counted_for_each_accelerometer():
    text = "serial,T,J,k,Y\nA,20,1,1,\nA,20,2,1,1\nA,20,3,1,2\nB,20,1,1,3\nB,20,2,1,4\n"
    first, second = read_tables(io.StringIO(text))
    assert first.notes == ("1 missing reading was left out (line 2)",)
    assert second.notes == ()


def test_paths_and_standard_input(tmp_path, monkeypatch):
    path = tmp_path / "table.csv"
    path.write_text(TEXT, encoding="utf-8")
    assert read_table(path) == read_table(str(path)) == REFERENCE
    assert read_table(path).source == str(path)
    monkeypatch.setattr(sys, "stdin", io.StringIO(TEXT))
    assert read_table("-") == REFERENCE


def test_survey_tells_the_form():
    form, _ = survey(io.BytesIO(gzip.compress(wide_table(";", ",").encode("utf-16"))))
    assert (form.form, form.separator, form.decimal) == ("wide", ";", ",")
    assert (form.encoding, form.compressed) == ("utf-16", True)
    assert form.columns["output of stroke 2"] == "Y2"


def test_describe_tells_what_was_understood():
    rows = [(*row, "x") for row in ROWS if row[1] != 4]
    text = "# serial: A7\n# g: 9.8106\n" + long_table(headings=(*HEADINGS, "remark"), rows=rows)
    form, (record,) = survey(io.StringIO(text))
    lines = dict(
        re.split(r"\s{2,}", line, maxsplit=1) for line in describe(record, form).split("\n")
    )
    assert lines["form"] == "long, separator comma, decimal point"
    assert lines["set aside"] == "'remark'"
    assert lines["serial"] == "A7"
    assert lines["run -40"] == "16 readings, -40 degC, mounting o+, 7 positions, strokes 1 to 2"
    assert lines["positions missing"] == "4 of 9"
    assert lines["local_gravity"] == "9.8106 m/s^2"


def test_summary_is_plain():
    form, records = survey(io.StringIO("# temperature: unknown\nJ,Y1\n1,1.0\n5,-1.0\n"))
    document = json.loads(json.dumps(summary(records, form), allow_nan=False))
    assert document["schema"] == "accelcal/check/1"
    assert document["records"][0]["runs"][0]["temperature_degC"] is None


def test_check_command(tmp_path, capsys):
    from accelcal.cli.main import main

    path = tmp_path / "table.csv"
    path.write_text(TEXT, encoding="utf-8")
    assert main(["check", str(path)]) == 0
    assert "run 80    18 readings, 80 degC" in capsys.readouterr().out
    assert main(["check", str(path), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["records"][0]["readings"] == len(ROWS)
    assert main(["check", str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"{tmp_path}: is a folder; give the path of one table\n"


def test_check_declares_what_fit_declares(tmp_path, capsys):
    """A table that needs --positions or --serials could not be checked."""
    from accelcal.cli.main import main

    path = tmp_path / "table.csv"
    rows = [f"20,{j},1,{1.3 - 0.1 * j:.2f},{1.4 - 0.1 * j:.2f}" for j in range(1, 14)]
    path.write_text("temperature,position,stroke,A1,B2\n" + "\n".join(rows) + "\n")
    options = ["--positions", "12", "--serials", "A1,B2", "--unit", "mA", "--g", "9.81"]
    options += ["--head-uncertainty", "2 arcsec", "--t0", "20", "--resolution", "0.01"]
    assert main(["check", str(path)]) == 2
    assert "no column for output" in capsys.readouterr().err
    assert main(["check", str(path), *options, "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)["records"]
    assert [record["serial"] for record in found] == ["A1", "B2"]
    assert (found[0]["positions"], found[0]["output_unit"], found[0]["T0_degC"]) == (12, "mA", 20.0)
    declared = found[0]["apparatus"]
    assert declared["head_uncertainty"] == pytest.approx(9.69627e-6, rel=1e-5)
    assert (declared["local_gravity"], declared["resolution"]) == (9.81, 0.01)
    path.write_text(TEXT, encoding="utf-8")
    assert main(["check", str(path), "--serial", "X7"]) == 0
    assert re.search(r"^serial +X7$", capsys.readouterr().out, re.MULTILINE)


def samples():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    return re.findall(r"```csv\n(.*?)```", text, re.DOTALL)


@pytest.mark.parametrize("sample", samples())
def test_samples_of_the_guide(sample):
    assert all(len(record) >= 2 for record in read_tables(io.StringIO(sample)))


def test_the_guide_lists_every_word():
    from accelcal.io.words.vocabulary import COLUMNS, KEYS, KINDS_OF
    from accelcal.units import spellings

    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    told = {name.casefold() for name in re.findall(r"`([^`]+)`", prose)}
    words = {name for table in (COLUMNS, KEYS) for names in table.values() for name in names}
    kinds = {"scale"}.union(*KINDS_OF.values())
    units = {way for kind in kinds for way in spellings(kind)}
    assert (words | {way.casefold() for way in units}) - told == set()


def test_light_reading_imports_nothing_heavy():
    code = (
        "import io, sys; from accelcal.io.tables import read_table;"
        "read_table(io.StringIO('T,J,k,Y\\n20,1,1,1\\n20,5,1,-1\\n'));"
        "print(*{'pandas', 'scipy', 'gzip', 'tempfile', 'importlib.metadata'} & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == ""


# -- German tables ---------------------------------------------------------------------------------


def test_a_german_table_is_read_as_the_english_one():
    english = "# date: 2024-05-31\n# unit: mA\ntime,temperature,position,stroke,output\n"
    english += "2024-05-31T14:30:00,20.5,1,1,1.35\n2024-06-01T09:05:00,20.5,5,1,-1.34\n"
    german = "# Datum: 2024-05-31\n# Einheit: mA\nZeit;Temperatur;Stellung;Durchlauf;Messwert\n"
    german += "31.05.2024 14:30;20,5;1;1;1,35\n1.6.2024 9:05:00;20,5;5;1;-1,34\n"
    read = [read_table(io.StringIO(text)) for text in (english, german)]
    assert read[0] == read[1]
    assert read[1].time.tolist() == [0.0, 66900.0]


@pytest.mark.parametrize(("heading", "unit"), [("mA", "mA"), ("counts", "counts")])
def test_a_unit_alone_may_head_the_outputs(heading, unit):
    record = read_table(
        io.StringIO(f"T,pos,stroke,{heading},room\n20,1,1,1350,7\n20,5,1,-1300,7\n")
    )
    assert (record.unit, record.output.tolist()) == (unit, [1350.0, -1300.0])
    with pytest.raises(TableError, match="no column for output"):
        read_table(io.StringIO("T,pos,stroke,A,B\n20,1,1,1350,7\n"))


@pytest.mark.parametrize("heading", ["Mean", "Strom", "X [mA]"])
@pytest.mark.parametrize("alone", ["counts", "Hz"])
def test_a_unit_alone_beside_what_can_be_the_output_is_not(heading, alone):
    """The number of the samples was read for their mean."""
    record = read(f"T;J;k;{heading};{alone}\n20;1;1;1,35;10\n20;5;1;-1,34;12\n")
    assert record.output.tolist() == [1.35, -1.34]


def test_a_unit_alone_beside_outputs_forward_and_back_is_not_the_output():
    record = read("T;J;forward;back;counts\n20;1;1,35;1,36;10\n20;5;-1,35;-1,36;12\n")
    assert record.output.tolist() == [1.35, 1.36, -1.35, -1.36]


@pytest.mark.parametrize("word", ["Standardabweichung", "Stabw", "StdAbw", "Std-Abw"])
def test_the_standard_deviation_of_a_german_spreadsheet(word):
    text = (
        f"Temperatur;Stellung;Hub;Mittelwert [mA];{word} [mA]\n20;1;1;1,35;1e-6\n20;5;1;-1,3;2e-6\n"
    )
    assert read_table(io.StringIO(text)).std.tolist() == [1e-6, 2e-6]


@pytest.mark.parametrize("word", ["Wert", "Valeur", "Значение", "value"])
def test_a_value_is_the_output_in_each_language(word):
    record = read_table(io.StringIO(f"T;J;k;{word};Bemerkung\n20;1;1;1,35;\n20;5;1;-1,3;Kontakt\n"))
    assert record.output.tolist() == [1.35, -1.3]


@pytest.mark.parametrize("facts", ["Parameter;Value;Unit", "Größe;Wert;Einheit"])
def test_the_headings_of_a_form_of_facts_are_not_those_of_the_table(facts):
    form = f"{facts}\nTemperatur;20;degC\nSerial;A-7;\n\n"
    record = read_table(io.StringIO(f"{form}Position;Stroke;Output [mA]\n1;1;1,35\n5;1;-1,34\n"))
    assert (record.serial, record.temperature.tolist()) == ("A-7", [20.0, 20.0])


def test_a_wide_german_table():
    text = "Temperatur [°C];Winkel;Durchlauf 1;Durchlauf 2\n20,0;0;1,35;1,36\n20,0;180;-1,3;-1,2\n"
    record = read_table(io.StringIO(text))
    assert sorted(set(record.stroke.tolist())) == [1, 2]
    assert sorted(record.output.tolist()) == [-1.3, -1.2, 1.35, 1.36]


@pytest.mark.parametrize(
    "cell",
    [
        *("31.02.2024 10:00", "31.13.2024", "1.5.24 10:00"),
        *("2024/02/31", "24/05/31 10:00", "13/21/2026 10:00", "11/10/2026", "11/10/26"),
        *("02/31/2026", "11/21/2026 25:00"),
    ],
)
def test_a_day_that_is_none_is_no_date(cell):
    text = f"time,temperature,position,stroke,output\n{cell},20,1,1,1.3\n"
    with pytest.raises(TableError, match=":2: time"):
        read_table(io.StringIO(text))


# -- units below the headings ----------------------------------------------------------------------


@pytest.mark.parametrize(
    "units", ["degC;;;mA", "\xb0C;-;-;[mA]", "[degC];[1];[1];[ma];;", "C;;;milliamps;"]
)
def test_units_in_a_row_of_their_own(units):
    text = TEXT.replace(",", ";").replace("\n", f"\n{units}\n", 1)
    record = read(text)
    assert record == replace(REFERENCE, unit="mA")
    assert record.notes == ("the units stand below the headings (line 2)",)
    assert record.line.tolist() == list(range(3, len(ROWS) + 3))


def test_a_unit_below_the_headings_may_be_in_them_in_other_words():
    """The row was read as one of readings, and refused."""
    text = "T [\xb0C],angle [deg],time [s],stroke,Y [mA]\ndegC,\xb0,sec,,Milliampere\n"
    text += "20,0,0,1,1.3\n20,180,9,1,-1.3\n"
    assert read(text).unit == "mA"
    for odd in ("mK,\xb0,sec,,Milliampere", "degC,\xb0,min,,mA", "degC,\xb0,s,,V"):
        with pytest.raises(TableError, match=":2: "):
            read(text.replace("degC,\xb0,sec,,Milliampere", odd))


def test_units_below_the_headings_of_a_wide_table():
    text = wide_table().replace("\n", "\ndegC,,mA,mA\n", 1)
    assert read(text) == replace(read(wide_table()), unit="mA")


def test_units_below_the_headings_are_those_of_their_columns():
    headings = ("time", "remark", *HEADINGS)
    rows = [(f"10:{i:02}:00", "x", *row) for i, row in enumerate(ROWS)]
    text = long_table(headings=headings, rows=rows).replace("\n", "\nhh:mm:ss,any,degC,,,V\n", 1)
    assert read(text).unit == "V"


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("mK,,,mA", ":1: column 'temperature \\[mK\\]' is in mK; give it in degC"),
        ("degC,,,furlong", ":2: output 'furlong' is not a number"),
        ("degC,,mm,V", ":2: "),
        ("20,,,mA", ":2: "),
    ],
)
def test_a_row_that_is_not_all_units_is_one_of_readings(row, told):
    with pytest.raises(TableError, match=told):
        read(TEXT.replace("\n", f"\n{row}\n", 1))


@pytest.mark.parametrize(("own", "below"), [("Oven [K]", "°F"), ("Oven [degC]", "K")])
def test_a_name_has_no_unit_below_that_contradicts_its_own(own, below):
    """The lower one counted: 293.15 under K and °F was 145 degC."""
    with pytest.raises(TableError, match=r":2: .*'mA' is not a number"):
        read(f"{own},J,k,Y\n{below},,,mA\n293.15,1,1,1\n293.15,5,1,-1\n")


def test_a_unit_above_and_another_below_is_refused():
    text = TEXT.replace("output", "output [V]").replace("\n", "\ndegC,,,mA\n", 1)
    with pytest.raises(TableError, match=r":2: .*'mA' is not a number"):
        read(text)


# -- LabVIEW ---------------------------------------------------------------------------------------

LABVIEW = (
    "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nDate\t2019/03/12\n"
    "Time\t10:22:33,1234567\n***End_of_Header***\t\n\t\nChannels\t2\nSamples\t54\t54\n"
    "Date\t2019/03/12\t2019/03/12\nY_Unit_Label\tdegC\tmA\n***End_of_Header***\t\n"
)


def test_the_channels_of_labview_declare_nothing():
    table = long_table(separator="\t", decimal=",")
    record = read((LABVIEW + table).encode("utf-8-sig"))
    assert record == replace(REFERENCE, date="2019/03/12")
    assert record.count is None
    assert record.notes == ("text above the headings was set aside (lines 1, 2, 3, 5, 6, ...)",)
    marked = read(LABVIEW + "# serial: A\n" + table)
    assert marked.serial == "A"


# -- clock times -----------------------------------------------------------------------------------


def clocked(*cells, headings="time", above=""):
    """A table with cells before each of its rows."""
    rows = [f"{cell},20,{i + 1},1,{1.3 - i}" for i, cell in enumerate(cells)]
    return f"{above}{headings},temperature,position,stroke,output\n" + "\n".join(rows) + "\n"


SHAPES = {
    "2026-11-21": "2026-11-21",
    "21.11.2026": "2026-11-21",
    "2026/11/21": "2026-11-21",
    "2026/1/2": "2026-01-02",
    "20261121": "2026-11-21",
    "11/21/2026": "2026-11-21",
    "21/11/2026": "2026-11-21",
    "11/10/2026": None,
    "21.11.26": None,
    "11/21/26": None,
    "21-11-2026": None,
    "21-Nov-2026": "2026-11-21",
    "21 NOVEMBER 2026": "2026-11-21",
    "1. M\xe4rz 2026": "2026-03-01",
    "1-Mrz-2026": "2026-03-01",
    "31 June 2026": None,
    "1 Moon 2026": None,
    "2026-11-31": None,
}
"""A day as a program writes it -> what it means; None where it is not told or may mean another."""


@pytest.mark.parametrize(("day", "meant"), SHAPES.items())
def test_a_day_beside_a_clock_time_is_understood_or_the_remedy_helps(day, meant):
    cells = [f"{day},9:00:00", f"{day},9:01:00", f"{day},9:02:30"]
    text = clocked(*cells, headings="date,time")
    if meant is None:
        with pytest.raises(TableError) as refused:
            read(text)
        line, _, remedy = str(refused.value).partition("; ")
        assert line.endswith(f":2: date {day!r} is not a date")
        advised = re.fullmatch(r"write it as (\S+) in every row", remedy)[1]
        text, meant = text.replace(day, advised), advised
    record = read(text)
    assert record.time.tolist() == [0.0, 60.0, 150.0]
    assert record.metadata["start"] == f"{meant}T09:00:00.000000"


@pytest.mark.parametrize(
    ("cells", "times"),
    [
        (("5/31/2024 11:59:30 PM", "6/1/2024 12:00:30 AM"), [0.0, 60.0]),
        (("31/05/2024 23:59", "01/06/2024 0:00"), [0.0, 60.0]),
        (("05/31/2024 14:01:00:250", "05/31/2024 14:01:01:000"), [0.0, 0.75]),
    ],
)
def test_a_day_above_twelve_tells_the_order_of_a_column(cells, times):
    """Data loggers write such times; all were refused."""
    record = read(clocked(*cells))
    assert record.time.tolist() == times
    assert record.metadata["start"].startswith("2024-05-31")


def test_days_of_a_column_in_two_orders_are_refused():
    with pytest.raises(TableError, match=":2: time"):
        read(clocked("5/31/2024 10:00", "31/5/2024 10:01"))


@pytest.mark.parametrize("cell", ["2024/05/31 14:30:00", "2024/5/31 14:30"])
def test_a_time_whose_year_stands_first(cell):
    record = read(clocked(cell, "2024-05-31T14:31", "31.05.2024 14:32:30"))
    assert record.time.tolist() == [0.0, 60.0, 150.0]


DATED = ("2024-05-31T23:59:00", "2024-06-01T00:00:30.250", "2024-06-01T14:30:00")
SECONDS = [0.0, 90.25, 52260.0]


TWO_DAYS = "the readings are of 2 days: the test counts as of 2024-05-31"


@pytest.mark.parametrize(
    ("cells", "headings"),
    [
        (("2024-05-31,23:59:00", "2024-06-01,00:00:30.250", "2024-06-01,14:30"), "date,time"),
        (("31.05.2024,23:59", "1.6.2024,0:00:30.25", "01.06.2024,14:30:00"), "Datum,Uhrzeit"),
        (("20240531,11:59 PM", "20240601,12:00:30.25 am", "20240601,2:30 p.m."), "DATE,Time"),
        (("31.05.2024 00:00:00,23:59", "2024-06-01,0:00:30.25", "2024-06-01,14:30"), "date,t"),
    ],
)
def test_a_date_beside_a_clock_time(cells, headings):
    record = read(clocked(*cells, headings=headings))
    assert record == read(clocked(*DATED))
    assert record.time.tolist() == SECONDS
    assert record.metadata["start"] == "2024-05-31T23:59:00.000000"
    assert (record.date, record.notes) == ("2024-05-31", (TWO_DAYS,))


def test_clock_times_with_a_decimal_comma():
    text = clocked("2024-05-31,14:30:00.250", "2024-05-31,14:31:00.500", headings="date,time")
    assert read(text.replace(",", ";").replace(".", ",")).time.tolist() == [0.0, 60.25]


@pytest.mark.parametrize("day", ["2024-05-31", "31.05.2024"])
def test_clock_times_begin_on_the_day_of_the_header_line(day):
    record = read(clocked("23:59:00", "0:00:30.25", "14:30", above=f"# date: {day}\n"))
    assert record.time.tolist() == SECONDS
    assert (record.date, record.metadata["start"]) == (day, "2024-05-31T23:59:00.000000")
    assert record.notes == ("the clock passes midnight: another day begins at line 4",)


@pytest.mark.parametrize("above", ["", "# date: last Friday\n"])
def test_clock_times_without_a_day(above):
    record = read(clocked("23:59:00", "0:00:30.25", "14:30", above=above))
    assert record.time.tolist() == SECONDS
    assert record.metadata == {}


@pytest.mark.parametrize("day", ["", "2024-10-27T"])
def test_a_clock_that_was_put_back_is_told(day):
    """The hour that was read twice counted as it stands, without a word."""
    said = "the time steps back at line 4; if the clock was put back there"
    put_back = [day + clock for clock in ("01:50:00", "02:50:00", "02:10:00", "03:10:00")]
    assert read(clocked(*put_back)).notes[-1].startswith(said)
    in_zones = [f"2024-10-27T0{time}:00" for time in ("2:50:00+02", "2:10:00+01", "3:10:00+01")]
    unordered = [day + clock for clock in ("02:50:00", "02:10:00", "03:10:00", "03:05:00")]
    far_back = [day + clock for clock in ("04:50:00", "02:10:00", "03:10:00")]
    for cells in (in_zones, unordered, far_back):
        assert not any("steps back" in note for note in read(clocked(*cells)).notes)


def test_a_step_back_of_twelve_hours_is_no_midnight():
    record = read(clocked("14:00", "13:59", "2:00", "1:59:59", "14:00", "1:59:59"))
    assert record.time.tolist() == [0.0, -60.0, -43200.0, -43201.0, 0.0, 43199.0]
    assert record.notes[-1] == "the clock passes midnight: another day begins at line 7"


def test_dates_that_are_written_are_not_changed():
    cells = ("2024-05-31,23:59", "2024-05-31,00:01", "2024-05-30,00:01")
    record = read(clocked(*cells, headings="date,time"))
    assert record.time.tolist() == [0.0, -86280.0, -172680.0]
    of_days = "the readings are of 2 days: the test counts as of 2024-05-30"
    assert (record.date, record.notes) == ("2024-05-30", (of_days,))


def test_dates_of_the_readings_are_that_of_the_test():
    """A logger that writes dates for times needs no line with the date; history goes by it."""
    record = read(clocked("2024-05-31T14:30:00Z", "2024-05-31T14:31:00Z"))
    assert (record.date, record.notes) == ("2024-05-31", ())


def test_midnight_is_that_of_each_accelerometer():
    rows = [("A", "22:00"), ("B", "22:01"), ("A", "2:00"), ("B", "2:01"), ("C", "1:00")]
    cells = [",".join(row) for row in rows]
    text = clocked(*cells, headings="serial,time", above="# date: 2024-05-31\n")
    found = {
        r.serial: (r.time.tolist(), r.metadata["start"][:16])
        for r in read_tables(io.StringIO(text))
    }
    assert found == {
        "A": ([0.0, 14400.0], "2024-05-31T22:00"),
        "B": ([0.0, 14400.0], "2024-05-31T22:01"),
        "C": ([0.0], "2024-05-31T01:00"),
    }


def test_one_date_in_all_rows_is_that_of_the_test():
    for headings, cells in (("date,time", ("0", "60")), ("date,time", ("9:00", "9:01"))):
        dated = [f"31.05.2024,{cell}" for cell in cells]
        record = read(clocked(*dated, headings=headings))
        assert (record.date, record.time.tolist(), record.notes) == ("31.05.2024", [0.0, 60.0], ())
    other = read(clocked(*dated, headings=headings, above="# date: 2024-06-30\n"))
    assert other.date == "31.05.2024"
    assert other.notes == ("header line date was set aside: the table has such a column",)
    assert read("date,T,J,Y1\nMay 24,20,1,1.3\nMay 24,20,5,-1.3\n").date == "May 24"
    unknown = read("date,T,J,Y1\nunknown,20,1,1.3\nunknown,20,5,-1.3\n")
    assert unknown.date is None
    assert unknown.notes == (
        "column 'date' has no one date, nor clock times beside it, and was set aside",
    )


def test_an_empty_line_of_a_header_says_nothing():
    assert read(f"# serial: A\n#\n# \n{long_table()}").notes == ()


@pytest.mark.parametrize(
    "cells",
    [
        ("2024-05-31 14:20:05", "2024-05-31 14:21:05.500", "2024-05-31 14:23"),
        ("2024-05-31T14:20:05", "2024-05-31T14:21:05.5", "2024-05-31T14:23:00"),
        ("31.05.2024 14:20:05", "31.05.2024 14:21:05.5", "31.05.2024 14:23"),
    ],
)
def test_a_date_with_a_time_of_day_is_both(cells):
    split = [cell.replace("T", " ").replace(" ", ",") for cell in cells]
    form, (record,) = survey(io.StringIO(clocked(*cells, headings="date")))
    assert record == read(clocked(*split, headings="date,time"))
    assert record.time.tolist() == [0.0, 60.5, 175.0]
    assert (record.date, record.notes) == (cells[0][:10], ())
    assert record.metadata["start"] == "2024-05-31T14:20:05.000000"
    assert (form.columns["time"], form.set_aside) == ("date", ())


def test_a_date_with_a_time_of_day_has_the_day_as_written():
    cells = ("2024-06-01T00:30:00+02:00", "2024-06-01T00:31:00+02:00")
    record = read(clocked(*cells, headings="date"))
    assert (record.date, record.time.tolist()) == ("2024-06-01", [0.0, 60.0])
    assert record.metadata["start"] == "2024-05-31T22:30:00.000000"


@pytest.mark.parametrize(
    ("cells", "date"),
    [
        (("2024-05-31T00:30+02:00", "2024-05-31T00:31+02:00"), "2024-05-31"),
        (("2024-05-31T00:30:00+02:00", "2024-05-30T22:31:00Z"), "2024-05-30"),
        (("2024-05-31 20:30:00-05:00", "2024-05-31 23:31:00-05:00"), "2024-05-31"),
        (("2024-05-30T22:30:00Z", "2024-05-30T22:31:00Z"), "2024-05-30"),
    ],
)
def test_the_date_of_times_in_a_zone_is_that_of_its_place(cells, date):
    """Half past midnight east of Greenwich was of the day before."""
    record = read(clocked(*cells, headings="time"))
    assert record.date == date
    assert record.time.tolist()[0] == 0.0


def test_a_day_in_a_zone_beside_clock_times_is_that_day():
    cells = ("2024-05-31T00:00:00+02:00,0:30", "2024-05-31T00:00:00+02:00,0:31")
    record = read(clocked(*cells, "2024-06-01T00:00:00+02:00,0:32", headings="date,time"))
    assert (record.date, record.metadata["start"][:16]) == ("2024-05-31", "2024-05-31T00:30")
    assert record.time.tolist() == [0.0, 60.0, 86520.0]


def test_dates_with_times_of_day_go_over_midnight():
    record = read(clocked(*DATED, headings="date", above="# date: 2024-05-31\n"))
    assert record.time.tolist() == SECONDS
    assert (record.date, record.notes) == ("2024-05-31", ())
    undeclared = read(clocked(*DATED, headings="date"))
    assert (undeclared.date, undeclared.notes) == ("2024-05-31", (TWO_DAYS,))


def test_the_date_of_times_of_day_wins_over_the_header_line():
    cells = ("2024-05-31 14:20", "2024-05-31 14:21")
    record = read(clocked(*cells, headings="date", above="# date: 2024-06-30\n"))
    assert record.date == "2024-05-31"
    assert record.notes == ("header line date was set aside: the table has such a column",)


@pytest.mark.parametrize(
    "cells",
    [
        ("2024-05-31 00:00:00", "2024-06-01 00:00:00"),  # a mere date, as a DataFrame writes it
        ("2024-05-31T00:00:00+02:00", "2024-06-01T00:00:00+02:00"),
        ("05/11/2024 14:20", "05/11/2024 14:21"),
        ("Friday 14:20", "Friday 14:21"),
    ],
)
def test_dates_that_tell_no_time_of_day_are_set_aside(cells):
    note = "column 'date' has no one date, nor clock times beside it, and was set aside"
    record = read(clocked(*cells, headings="date"))
    assert (record.date, record.time, record.notes) == (None, None, (note,))


def test_a_moment_that_all_readings_share_is_the_date_of_the_test():
    record = read(clocked(*["2024-05-31 14:20:05"] * 2, headings="date"))
    assert (record.date, record.time, record.notes) == ("2024-05-31 14:20:05", None, ())


def test_a_column_of_times_goes_before_times_of_day():
    cells = ("2024-05-31 14:20,0", "2024-05-31 14:25,60")
    assert read(clocked(*cells, headings="date,time")).time.tolist() == [0.0, 60.0]


@pytest.mark.parametrize("cell", ["", "14:21", "05/31/2024 14:21", "nan"])
def test_a_date_and_time_that_is_none_is_refused(cell):
    text = clocked("2024-05-31 14:20", cell, "2024-05-31 14:22", headings="date")
    with pytest.raises(TableError, match=r":3: date.* is not a date and time; write it as 2024"):
        read(text)


@pytest.mark.parametrize(
    ("cell", "told"),
    [
        ("2024-02-29T00:00:30.25", "2024-02-29T00:00:30.250000"),
        ("1999-12-31 23:59:59.999999", "1999-12-31T23:59:59.999999"),
        ("29.02.2024 0:01", "2024-02-29T00:01:00.000000"),
        ("2024-02-29T01:00:00+02:00", "2024-02-28T23:00:00.000000"),
    ],
)
def test_dates_are_those_of_the_calendar(cell, told):
    cells = ["2024-02-28", cell]
    found = times(Column("time", "time", None, cells, np.array([6, 7]), "a.csv"))
    assert found.astype(str).tolist() == ["2024-02-28T00:00:00.000000", told]


@pytest.mark.parametrize("cell", ["2024-02-30 10:00:00", "2024-02-29 24:00:00"])
def test_a_date_like_the_others_that_is_none_is_refused(cell):
    cells = ["2024-02-28 10:00:00", cell]
    with pytest.raises(TableError, match=f"^a.csv:7: time '{cell}' is not a date and time; write"):
        times(Column("time", "time", None, cells, np.array([6, 7]), "a.csv"))


def test_rows_of_strokes_have_no_time_of_their_own():
    rows = ("2024-05-31 14:20,20,1,1.3,1.4", "2024-05-31 14:21,20,5,-1.3,-1.4")
    record = read("date,T,J,Y1,Y2\n" + "\n".join(rows) + "\n")
    assert record.time is None
    assert record.notes[0].startswith("column 'date' has no one date")


def test_a_date_above_the_headings_makes_no_headings():
    record = read("Datum;31.05.2024;Position;Labor 5\nT;J;Y1;Y2\n20;1;1.3;1.31\n20;5;-1.3;-1.31\n")
    assert record.date == "31.05.2024"


def test_several_dates_without_clock_times_are_set_aside():
    note = "column 'date' has no one date, nor clock times beside it, and was set aside"
    cells = ("2024-05-31,0", "2024-06-01,60")
    form, (record,) = survey(io.StringIO(clocked(*cells, headings="date,time")))
    assert (record.date, record.time.tolist(), record.notes) == (None, [0.0, 60.0], (note,))
    assert form.set_aside == ("'date'",)
    above = "# date: 2024-06-30\n"
    assert read(clocked(*cells, headings="date,time", above=above)).date == "2024-06-30"
    empty = read(clocked(",0", ",60", headings="date,time"))
    assert empty.notes == ("column date is empty and was set aside",)


# -- headings as people write them -----------------------------------------------------------------


@pytest.mark.parametrize(
    "headings",
    [
        "Temperature T,Position J,Stroke k,Output Y",
        "TEMP_C,POS_NO,STROKE_NO,OUTPUT_V",
        "T / °C,Pos. No.,Stroke #,Y / mA",
        "Temperatur,Stellung Nr.,Durchgang Nr.,Messwert",
        "temperature,position number,stroke number,output signal [V]",
    ],
)
def test_a_symbol_or_a_number_beside_the_word(headings):
    record = read(headings + "\n20,1,1,1.3\n20,5,1,-1.3\n20,5,2,-1.2\n")
    assert record.position.tolist() == [1, 5, 5]
    assert record.stroke.tolist() == [1, 1, 2]
    assert record.output.tolist() == [1.3, -1.3, -1.2]


@pytest.mark.parametrize("form", ["Y_J{}", "YJ{}", "Y_J{}^T", "Y_{{J{}}}^T", "Y_J{} [mA]", "k={}"])
def test_the_strokes_as_the_paper_has_them(form):
    record = read(f"T,J,{form.format(1)},{form.format(2)}\n20,1,1.3,1.4\n20,5,-1.3,-1.2\n")
    assert record.stroke.tolist() == [1, 2, 1, 2]
    assert record.output.tolist() == [1.3, 1.4, -1.3, -1.2]


@pytest.mark.parametrize("heading", ["Reading No.", "output T", "run time", "position t", "T_ref"])
def test_a_heading_of_two_meanings_has_none(heading):
    assert read_heading(heading).role is None


def test_russian_headings_with_symbols():
    rows = "\n".join(f"20,0;{45 * j};1;{1.35 * np.cos(np.pi * j / 4):.6f}" for j in range(9))
    record = read("Т, °С;θ, град;k;Y, мА\n" + rows.replace(".", ",") + "\n")
    assert (record.unit, record.temperature[0], record.angle[1]) == ("mA", 20.0, 45.0)


@pytest.mark.parametrize(
    "above",
    [
        "Datum;31.05.2024;Messgröße;Strom in mA",
        "Date;Frequency\n31.05.2024;50 Hz",
        "Instrument;Voltage;Date\nHP3458A;10 V;31.05.2024",
        "Date/Time;Chamber;Head;Current (mA)",
    ],
)
def test_notes_of_a_date_and_a_current_above_the_headings_are_none(above):
    """They look like the headings of a record over time."""
    rows = "".join(f"20;{j};1;1,{j}\n" for j in range(1, 6))
    record = read(f"{above}\nT;J;k;Y [mA]\n{rows}")
    assert record.output.tolist() == [1.1, 1.2, 1.3, 1.4, 1.5]


@pytest.mark.parametrize("heading", ["Date/Time", "Zeitstempel"])
@pytest.mark.parametrize("others", ["Datum,Uhrzeit", "Datum"])
def test_a_date_and_time_beside_a_date_is_set_aside(heading, others):
    own = {"Datum": "2024-05-31", "Uhrzeit": "10:00:00", heading: "2024-05-31 10:00:00"}
    headings = [*others.split(","), heading]
    cells = ",".join(own[name] for name in headings)
    rows = "".join(f"{cells},20,{j},1,1.{j}\n" for j in range(1, 6))
    record = read(f"{','.join(headings)},T,J,k,Y\n{rows}")
    assert record.date == "2024-05-31"
    assert f"column {heading!r} is not known and was set aside" in record.notes


@pytest.mark.parametrize(
    "heading", ["Date/Time", "Datum/Uhrzeit", "DateTime", "Zeitstempel", "Дата и время"]
)
def test_a_date_and_time_in_one_column(heading):
    """It was not known and set aside; beside a column of times it still is."""
    rows = [(f"31.05.2024 10:0{j}:00", 20, j, 1, 1.0 + j) for j in range(1, 6)]
    text = "".join(",".join(map(str, row)) + "\n" for row in rows)
    record = read(f"{heading},T,J,k,Y\n{text}")
    assert (record.date, record.time.tolist()) == ("31.05.2024", [60.0 * j for j in range(5)])
    beside = "".join(f"{30 * row[2]},{','.join(map(str, row))}\n" for row in rows)
    record = read(f"Time [s],{heading},T,J,k,Y\n{beside}")
    assert record.time.tolist() == [30.0, 60.0, 90.0, 120.0, 150.0]
    assert any("was set aside" in note for note in record.notes)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("T;J;Y [mA];", ";;1;2"),
        ("Temperatur;Stellung;Ausgang [mA]", "°C;J;Hub 1;Hub 2;;"),
        ("T;J;Y [mA]", ";;k=1 [mA];k=2 [mA]"),
    ],
)
def test_one_heading_over_numbered_outputs(first, second):
    """Merged cells: the table had no column for the stroke."""
    rows = "".join(f"20;{j};1,{j}0;1,{j}5\n" for j in range(1, 6))
    record = read(f"{first}\n{second}\n{rows}")
    assert (record.stroke.tolist(), record.unit) == ([1, 2] * 5, "mA")
    assert sorted(record.output.tolist())[:3] == [1.10, 1.15, 1.20]


def test_readings_below_one_heading_number_nothing():
    """They are whole numbers, too: the row would be lost."""
    with pytest.raises(TableError, match="no column for stroke"):
        read("T;J;Y [mA]\n20;1;1;2\n20;2;3;4\n20;3;5;6\n")


def test_one_heading_over_outputs_in_another_unit_of_temperature():
    found = read("T;J;Y [mA];\n°F;;1;2\n68;1;1,1;1,2\n68;2;1,2;1,3\n")
    assert found == read("T;J;Y [mA];\n°C;;1;2\n20;1;1,1;1,2\n20;2;1,2;1,3\n")


def test_minutes_behind_the_decimal_mark_of_an_angle_are_told():
    """Only the lack of fit warned: the angles were 0.2 deg off."""
    degrees = np.arange(0.0, 382.5, 22.5)
    rows = [(a, 1.35 * np.cos(np.radians(a))) for a in degrees]
    text = "T,angle,k,Y\n" + "".join(f"20,{a // 1:g}.{a % 1 * 60:02g},1,{y:.6f}\n" for a, y in rows)
    note = (
        "angles such as 22.3 deg divide the turn evenly as 22°30': write them so if 30 are minutes"
    )
    assert note in read(text).notes
    decimal = "T,angle,k,Y\n" + "".join(f"20,{a:g},1,{y:.6f}\n" for a, y in rows)
    for right in (decimal, text.replace(".30,", "°30',")):
        assert not any("minutes" in told for told in read(right).notes)


@pytest.mark.parametrize(
    "row",
    [
        "Serial;A-7;Temperature;20,5;Humidity, %;45;Page;1",
        "Serial;A-7;Run;3;Temperature;20,5",
        "Temp. in °C;20,5;;Positions;8;Serial;A-7",
        "Position;1;Temperature;20,5;Serial;A-7",
    ],
)
def test_names_and_numbers_that_take_turns_are_a_row_of_a_form(row):
    """They passed for the headings, and the file was refused."""
    record = read(f"{row}\n{FORM}")
    assert (record.serial, record.temperature[0]) == ("A-7", 20.5)


@pytest.mark.parametrize("sign", [":", "=", "\uff1a"])
@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_colon_in_a_cell_of_its_own_stands_between_key_and_value(mark, sign):
    """It was the value: T0 ':' was refused, and a serial lost."""
    form = f"Serial;{sign};A-7\nT0;{sign};20\nTemperature;{sign};20\n{FORM}"
    record = read(form.replace(";", mark))
    assert (record.serial, record.reference_temperature) == ("A-7", 20.0)


def test_a_colon_of_a_form_is_no_value():
    """The serial number was 'Operator:', without a word."""
    assert read(f"Serial:;;Operator:;N. N.\nTemperature;20\n{FORM}").serial is None


@pytest.mark.parametrize(
    ("row", "date"),
    [
        ("Date: Friday, 31 May 2024,,,", "Friday, 31 May 2024"),
        ("Date: 31.05.2024, 12:30,Serial: A-7", "31.05.2024, 12:30"),
        ("Serial: A-7, Date: 31.05.2024", "31.05.2024"),
        ("Date, 31.05.2024, Serial, A-7", "31.05.2024"),
    ],
)
def test_commas_of_a_value_above_a_table_with_commas(row, date):
    """The date was Friday."""
    assert read(f"{row}\n{long_table()}").date == date


@pytest.mark.parametrize("mark", [",", ";"])
def test_a_decimal_comma_above_a_table_without_one(mark):
    """20,5 was 20 with no other word than that text was set aside."""
    rows = "position,stroke,output\n1,1,1\n3,1,0\n5,1,-1\n".replace(",", mark)
    assert read(f"Temperature: 20,5\n{rows}").temperature[0] == 20.5


@pytest.mark.parametrize(
    "row",
    ['"Head uncertainty: 2"""', '"Serial: A-7","Head uncertainty: 2"""'],
)
def test_quotes_in_quotes_above_a_table_with_other_separators(row):
    record = read(f"{row}\n{long_table(';')}")
    assert record.apparatus.head_uncertainty == pytest.approx(np.radians(2 / 3600))
    assert record.serial == ("A-7" if "Serial" in row else None)


def test_what_stands_behind_a_comma_and_is_no_unit_makes_no_key():
    """The serial number was '- 0012,Time', and the date '30 2024-05-31 12'."""
    record = read(f"Serial,0012,Time: -\nDate,2024-05-31 12:30\n{long_table(';')}")
    assert (record.serial, record.date) == ("0012", "2024-05-31 12:30")


def test_a_key_with_a_unit_behind_a_comma_in_a_cell_of_its_own():
    record = read(f'"Gravity, m/s^2:",,9.81,Serial,A-7\n{long_table()}')
    assert (record.serial, record.apparatus.local_gravity) == ("A-7", 9.81)


@pytest.mark.parametrize(
    ("line", "metadata"),
    [
        ("# serial: A-7; Supply, V: 5; date: 2024-05-31", {"comment": "Supply, V: 5"}),
        ("# serial: A-7; operator: ; date: 2024-05-31", {"operator": ""}),
        ("# serial: A-7, date: 2024-05-31; file: C:\\a.csv", {"file": "C:\\a.csv"}),
        ("# serial: A-7\tset: X (a; b)\tdate: 2024-05-31", {"set": "X (a; b)"}),
    ],
)
def test_declarations_beside_each_other_whatever_stands_between(line, metadata):
    """The rest of the line was a part of the serial number."""
    record = read(f"{line}\n{TEXT}")
    assert (record.serial, record.date, record.metadata) == ("A-7", "2024-05-31", metadata)


def test_a_time_of_day_behind_a_comma_is_no_declaration():
    record = read(f"# date: 31.05.2024, at 12:30\n{TEXT}")
    assert (record.date, record.metadata) == ("31.05.2024, at 12:30", {})


@pytest.mark.parametrize("separator", [",", ";"])
@pytest.mark.parametrize("line", ["# Temperature, °C: {}40", "Temperature, °C: {}40", "T: {}40 °C"])
@pytest.mark.parametrize("minus", ["-", "\u2212", "\u2013"])
def test_a_unit_behind_a_comma_and_any_minus_above_a_table(line, minus, separator):
    table = "position;stroke;output\n1;1;1.3\n3;1;0.0\n5;1;-1.3\n".replace(";", separator)
    assert read(f"{line.format(minus)}\n{table}").temperature[0] == -40.0


@pytest.mark.parametrize("mark", [" ", "\u00a0", "\u202f", "'", "\u2019"])
@pytest.mark.parametrize("decimal", ".,")
def test_blanks_and_apostrophes_between_thousands(mark, decimal):
    cells = [cell.replace(" ", mark).replace(".", decimal) for cell in ("1 350 204.25", "-1 204")]
    record = read(f"T;J;k;Y [uV]\n20;1;1;{cells[0]}\n20;5;1;{cells[1]}\n")
    assert record.output.tolist() == [1350204.25, -1204.0]


def test_a_missing_reading_does_not_hide_thousands_marks():
    """822,572 counts were 822.572, as a cell was NaN."""
    table = "T;J;k;Y [counts]\n20;1;1;822,572\n20;2;1;601,118\n20;3;1;-58\n20;4;1;NaN\n"
    with pytest.raises(TableError, match="one of numbers without decimals or with three"):
        read(f"{table}20;5;1;-822,706\n")


def test_a_unit_in_the_cells_may_be_written_otherwise_in_the_heading():
    table = "T [degC];J;k;Y\n20 °C;1;1;1.35\n20 °C;5;1;-1.34\n"
    assert read(table).temperature.tolist() == [20.0, 20.0]


# -- cells below one another, of which one is missing ----------------------------------------------

COLUMNS_OF_TEXT = """Temp.   Angle   Stroke 1    Stroke 2
20.0    0       1.3547      1.3548
20.0    90      0.0060      0.0061
{row}
20.0    270     0.0029      0.0028
"""


@pytest.mark.parametrize(
    ("row", "strokes"),
    [
        ("20.0    180                 -1.3456", [2]),
        ("20.0    180     -1.3455", [1]),
        ("20.0    180     -1.3455     -1.3456", [1, 2]),
    ],
)
def test_a_reading_stands_in_the_column_of_its_stroke(row, strokes):
    record = accelcal.read_table(io.StringIO(COLUMNS_OF_TEXT.format(row=row)))
    at = record.angle == 180.0
    assert record.stroke[at].tolist() == strokes
    assert record.output[at].tolist() == [-1.3454 - 0.0001 * stroke for stroke in strokes]


def test_a_temperature_that_is_missing_is_no_angle():
    row = "        180     -1.3455     -1.3456"
    with pytest.raises(accelcal.TableError, match=r"4: Temp\. is empty"):
        accelcal.read_table(io.StringIO(COLUMNS_OF_TEXT.format(row=row)))


@pytest.mark.parametrize("encoding", ["utf-8", "windows-1250"])
@pytest.mark.parametrize(
    "headings",
    [
        "# Jednostka: mA\nTemperatura [°C];Pozycja;Przejście;Kierunek;Wartość\n;naprzód;wstecz",
        "# Jednotka: mA\nTeplota [°C];Poloha;Průchod;Směr;Hodnota\n;vpřed;zpět",
        "# Eenheid: mA\nTemperatuur [°C];Positie;Doorgang;Richting;Meetwaarde\n;heen;terug",
    ],
    ids=["Polish", "Czech", "Dutch"],
)
def test_polish_czech_and_dutch_tables(headings, encoding):
    """Their columns were not known, and Excel's windows-1250 was read as another encoding."""
    headings, _, words = headings.rpartition("\n")
    forth, back = words.split(";")[1:]
    text = f"{headings}\n20,1;1;1;{forth};1,30\n20,1;5;1;{forth};-1,29\n20,1;1;2;{back};1,31\n"
    record = read_table(io.BytesIO(text.encode(encoding)))
    assert record.unit == "mA"
    assert record.stroke.tolist() == [1, 1, 2]
    assert record.output.tolist() == [1.3, -1.29, 1.31]
    assert not any("set aside" in note for note in record.notes)
