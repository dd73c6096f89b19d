"""Tables as the programs and instruments of laboratories export them."""

import io
import re

import pytest

import accelcal
from accelcal.dates import date_of
from accelcal.errors import TableError
from accelcal.io import engines
from accelcal.io.ordinary.reader import Content, read_ordinary
from accelcal.io.tables import survey

LONG = [(20, 1, 1, 1.35), (20, 5, 1, -1.33), (20, 5, 2, -1.34), (20, 1, 2, 1.36)]
WIDE = {20: [(1, 1.35, 1.36), (5, -1.33, -1.34)], 60: [(1, 1.45, 1.46), (5, -1.43, -1.44)]}
TWO = {(t, j, k, y) for t, rows in WIDE.items() for j, *own in rows for k, y in enumerate(own, 1)}


def read(text):
    return accelcal.read_table(io.StringIO(text))


def readings(record):
    columns = (record.temperature, record.position, record.stroke, record.output)
    return {tuple(row) for row in zip(*columns, strict=True)}


def long_table(*above, form="{},{},{},{}", factor=1):
    return "\n".join([*above, *(form.format(*own[:3], own[3] * factor) for own in LONG)]) + "\n"


def block(rows):
    return "".join(f"{j},{one},{two}\n" for j, one, two in rows)


@pytest.mark.parametrize(
    ("axis", "index"), [("stroke", "temperature,position"), ("position", "temperature,stroke")]
)
@pytest.mark.parametrize("top", ["", ",,output,output\n"])
def test_a_pivot_table_of_pandas_names_its_index_below_the_numbers(axis, index, top):
    """Its rows were taken for strokes, and a row of readings was told to be missing."""
    own = {(20.0, j, k, float(f"{j}.{k}{k}")) for j in (1, 2) for k in (1, 2)}
    rows = {"stroke": [("1.11", "1.22"), ("2.11", "2.22")]}
    rows["position"] = [*zip(*rows["stroke"], strict=True)]
    body = "".join(f"20,{n},{a},{b}\n" for n, (a, b) in enumerate(rows[axis], 1))
    assert readings(read(f"{top}{axis},,1,2\n{index},,\n{body}")) == own


def test_a_pivot_table_of_one_index():
    own = "# temperature: 20\n,output,output\nstroke,1,2\nposition,,\n" + block(WIDE[20])
    assert readings(read(own)) == {row for row in TWO if row[0] == 20}


@pytest.mark.parametrize(
    ("what", "levels", "first"),
    [
        ("temperature", "20,60", "temperature 20"),
        ("Temp [K]", "293.15,333.15", "Temp [K] 293.15"),
        ("T [°F]", "68.0,140.0", "T [°F] 68.0"),
        ("T", '"20,0","60,0"', "T 20,0"),
    ],
)
def test_a_pivot_table_by_temperature(what, levels, first):
    """Numbers with decimals were no headings."""
    body = "1,1,1.35,1.45\n5,1,-1.33,-1.43\n"
    form, (own,) = survey(io.StringIO(f"{what},,{levels}\nposition,stroke,,\n{body}"))
    assert readings(own) == {row for row in TWO if row[2] == 1}
    assert first in form.columns.values()


def test_a_pivot_table_by_angles_of_half_degrees():
    body = "".join(f"{t},1,1.35,1.21\n" for t in (20, 60))
    own = read(f"angle,,0,22.5\nT,stroke,,\n{body}")
    assert own.angle.tolist() == [0.0, 22.5] * 2


@pytest.mark.parametrize(
    "labels",
    [
        ("20 °C", "60 °C"),
        ("T = 20 °C", "T = 60 °C"),
        ("Temperature:,20", "Temperature:,60"),
        ("# serial: A-7\n# temperature: 20", "# temperature: 60"),
    ],
)
@pytest.mark.parametrize("below", ["", "\n", "Mean,0.01,0.01\nStd,0.02,0.03\n\n"])
def test_a_block_for_each_temperature(labels, below):
    """They were refused, as the headings stand again."""
    pairs = zip(labels, WIDE.values(), strict=True)
    record = read("".join(f"{own}\nJ,Y1,Y2\n{block(rows)}{below}" for own, rows in pairs))
    assert readings(record) == TWO
    assert "the 2 blocks below each other are read as one table" in record.notes


def test_a_block_for_each_serial_has_the_lines_of_the_file():
    pairs = zip("AB", WIDE.items(), strict=True)
    text = "".join(f"S/N;{a}\nT;{t}\nJ,Y1,Y2\n{block(rows)}\n" for a, (t, rows) in pairs)
    records = accelcal.read_tables(io.StringIO(text.replace(",", ";")))
    told = [(own.serial, own.temperature[0], own.line.tolist()) for own in records]
    assert told == [("A", 20.0, [4, 4, 5, 5]), ("B", 60.0, [10, 10, 11, 11])]


def test_a_serial_of_a_later_block_alone_is_not_that_of_the_first():
    text = f"J,Y1,Y2\n{block(WIDE[20])}\n"
    with pytest.raises(TableError, match="inside the table"):
        read(f"# temperature: 20\n{text}# temperature: 60\n# serial: B\n{text}")


@pytest.mark.parametrize(
    "above",
    [
        ["Temperature,Angle,Stroke,Output", "°C,deg,,mA", "run 1,encoder,,HP3458A"],
        [
            "Temperature,Angle,Stroke,Output",
            "°C,deg,,mA",
            "DT_DOUBLE,DT_DOUBLE,DT_DOUBLE,DT_DOUBLE",
        ],
        ["Temperature [°C],Angle,Stroke,Output [mA]", "----------,-----,------,-------"],
    ],
)
def test_rows_of_words_or_dashes_below_the_headings(above):
    """They were refused: the word was no number."""
    record = read(long_table(*above, form="{0},{1}0,{2},{3}"))
    assert (record.unit, record.angle.tolist()) == ("mA", [10.0, 50.0, 50.0, 10.0])
    assert f"text below the headings was set aside (line {len(above)})" in record.notes


@pytest.mark.parametrize("row", ["F,-,-,furlong", 'A,"B'])
def test_rows_below_the_headings_that_may_be_units_or_readings_are_refused(row):
    with pytest.raises(TableError):
        read(long_table("T,J,k,Y", row))


@pytest.mark.parametrize(
    ("headings", "unit", "factor"),
    [
        ("Time (s),CH2 (degC),Position,Stroke,CH1 (mA)", "mA", 1),
        ("Scan,102 <Temp> (C),Pos,Stroke,101 <Iout> (ADC)", "A", 1e-3),
        ("Scan,Oven °C,Pos,Stroke,Volt DC", None, 1),
        ("Scan,Chan 102 (C),Pos,Stroke,Chan 101 (VDC)", "V", 1),
    ],
)
def test_columns_of_a_data_logger(headings, unit, factor):
    record = read(long_table(headings, form="0,{},{},{},{:g}", factor=factor))
    assert record.unit == (unit or "V")
    assert record.temperature.tolist() == [20.0] * 4
    assert any("is taken for the temperature, by its unit" in note for note in record.notes)


@pytest.mark.parametrize(
    "headings",
    ["Oven [°C],Room [°C],J,k,Y", "Remark C,Room,J,k,Y", "a,CH2 (C),J,k,ADC", "C [F],a,J,k,Y"],
)
def test_columns_that_may_be_something_else_are_not_taken(headings):
    with pytest.raises(TableError, match="no column for"):
        read(long_table(headings, form="20,{},{},{},{}"))


@pytest.mark.parametrize("heading", ["Oven [F]", "Oven in F", "Oven_F"])
def test_a_lone_column_in_f_is_named_in_the_remedy(heading):
    """It was where the unit is in brackets alone."""
    remedy = re.escape(f"call column '{heading}' 'temperature [degF]' if it is one")
    with pytest.raises(TableError, match=remedy):
        read(long_table(f"{heading},J,k,Y", form="68,{1},{2},{3}"))


def test_the_lone_angle():
    record = read(long_table("T;Kopfwinkel in °;Hub;Strom (mA)", form="{0};{1}0;{2};{3}"))
    assert record.angle.tolist() == [10.0, 50.0, 50.0, 10.0]
    assert "column 'Kopfwinkel in °' is taken for the angle, by its unit" in record.notes


def test_the_list_of_channels_above_a_table_is_no_row_of_headings():
    """The headings were told to have two columns of temperature."""
    above = ["Channel,Name,Function", "101,Temp,Temp (Type T)", "", "Temp (C),Pos,Stroke,Y"]
    assert readings(read(long_table(*above))) == set(LONG)


def test_a_row_of_empty_quotes_above_the_headings_is_nothing():
    assert readings(read('"";""\n' + long_table("T;J;k;Y", form="{};{};{};{}"))) == set(LONG)


def test_a_summary_and_a_remark_alone_are_refused():
    """It was an error of Python."""
    with pytest.raises(TableError):
        read("T,J,k,Y\nMean\nChecked by: N. N.\n")


def test_outputs_of_a_temperature_may_stand_first():
    own = read("20 °C,position,stroke\n1.35,1,1\n-1.33,5,1\n")
    assert readings(own) == {(20, 1, 1, 1.35), (20, 5, 1, -1.33)}


@pytest.mark.parametrize("row", ["102;Temp;Temp (Type T);;C", "Parameter;Value;Unit;Remark"])
def test_words_of_a_form_that_declare_nothing(row):
    """Temperatures of 'C Type T' and the unit 'Remark' were refused."""
    above = ["Protocol", row, "T0;25;degC;reference", "T;J;k;Y"]
    record = read(long_table(*above, form="{};{};{};{}"))
    assert (readings(record), record.reference_temperature) == (set(LONG), 25.0)


def test_the_mean_beside_the_least_and_the_most():
    headings = "T,J,k,Mean [mA],Std [mA],Min [mA],Max [mA]"
    record = read(long_table(headings, form="{0},{1},{2},{3},1e-6,0,9"))
    assert readings(record) == set(LONG)


def test_means_beside_outputs_forward_and_back():
    """The mean was taken for the output, and the strokes were missing."""
    rows = "".join(f"20;{j};{a};{b};0\n" for j, a, b in WIDE[20])
    assert readings(read("T;J;Hin 1;Rück 1;Mittelwert\n" + rows)) == set(LONG)


@pytest.mark.parametrize(
    "headings",
    [
        "Temperatura (°C);Posición;Pasada;Corriente (mA)",
        "Temperatura (°C);Posição;Passagem;Saída (mA)",
        "Temperatura (°C);Posizione;Corsa;Uscita (mA)",
    ],
)
def test_spanish_portuguese_and_italian_headings(headings, tmp_path):
    path = tmp_path / "own.csv"
    text = long_table(headings, form="{};{};{};{}").replace(".", ",")
    path.write_bytes(text.encode("cp1252"))
    assert readings(accelcal.read_table(path)) == set(LONG)


def test_the_corner_of_a_matrix():
    own = "# temperature: 20\nJ\\K,1,2\n" + block(WIDE[20])
    assert readings(read(own)) == set(LONG)


def test_german_keys_declare_and_other_uncertainties_are_told():
    """They were kept as metadata, and T0 was another one."""
    keys = ["# Bezugstemperatur: 25 °C", '# Unsicherheit des Kopfes: 2"', "# Auflösung: 0,1"]
    text = long_table(*keys, "# Messunsicherheit: 3", "T;J;k;Y", form="{};{};{};{}")
    record = read(text.replace(".", ","))
    assert record.reference_temperature == 25.0
    assert record.apparatus.head_uncertainty == pytest.approx(9.7e-6, rel=0.01)
    assert any("'Messunsicherheit' declares nothing" in note for note in record.notes)


def test_the_overload_of_the_3458a_is_refused():
    with pytest.raises(TableError, match="looks like a marker"):
        read(long_table("T,J,k,Y") + "20,3,1,1.000000000E+38\n")


def test_a_sheet_of_results_is_no_table_of_readings(tmp_path):
    """The workbook was refused, as K0 is stroke 0."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [["T", "J", "k", "Y"], *LONG]:
        book.active.append(row)
    summary = book.create_sheet("Summary")
    summary.append(["T", "K0", "K1"])
    summary.append([20, 0.01, 1.3])
    book.save(tmp_path / "own.xlsx")
    assert readings(accelcal.read_table(tmp_path / "own.xlsx")) == set(LONG)


@pytest.mark.parametrize("label", ["serial", "run", "mounting"])
def test_a_label_in_a_row_of_its_own_holds_for_the_rows_below(label):
    """It was set aside as text, and a mounting p- became o+ without a word of it."""
    record = read(long_table(f"{label},T,J,k,Y", "p-,,,,", form=",{},{},{},{}"))
    told = {"serial": record.serial, "run": record.run_labels[0], "mounting": record.mounting[0]}
    assert (told[label], readings(record)) == ("p-", set(LONG))


@pytest.mark.parametrize(
    "row", ["T=20,A=90,k=1,Y=0.1", "(20),(90),(1),(0.1)", "degC,radians [rad],,mA x 1000"]
)
def test_readings_and_units_written_otherwise_are_no_text_below_the_headings(row):
    """A first reading was set aside as text; a unit in brackets beside its name, too."""
    with pytest.raises(TableError, match="is not a number"):
        read(long_table("T,angle,k,Y", row))


def test_lines_above_the_first_block_hold_for_all():
    """The second unit lost its unit, and 12 positions became 8."""
    pairs = zip("AB", WIDE.items(), strict=True)
    blocks = "".join(f"S/N;{a}\nT;{t}\nJ;Y1;Y2\n{block(rows)}\n" for a, (t, rows) in pairs)
    text = f"# unit: mA\nPositions;12\n{blocks}".replace(",", ";")
    told = [
        (own.serial, own.unit, own.positions) for own in accelcal.read_tables(io.StringIO(text))
    ]
    assert told == [("A", "mA", 12), ("B", "mA", 12)]
    other = text.replace("S/N;B", "S/N;B\nUnit;V").replace("Positions;12", "")
    assert [own.unit for own in accelcal.read_tables(io.StringIO(other))] == ["mA", "V"]


def test_headings_twice_above_the_readings_are_one_table():
    """It was told to be empty."""
    assert readings(read(long_table("# serial: A-7", "T,J,k,Y", "T,J,k,Y"))) == set(LONG)


def test_a_block_of_another_temperature_has_the_positions_of_the_file():
    rows = "".join(f"# temperature: {t}\nJ,Y1,Y2\n{block(own)}13,1,1\n" for t, own in WIDE.items())
    assert read("# positions: 12\n" + rows).angle.max() == 360.0


@pytest.mark.parametrize("row", ["Head uncertainty (gon);2", "T0 (Fahrenheit);68", "T0;68;°F"])
def test_a_number_in_a_foreign_unit_is_refused_in_rows_of_a_form(row):
    """It was set aside as text."""
    with pytest.raises(TableError, match=r"is given in|temperatures of the table have no unit"):
        read(long_table(row, "T;J;k;Y", form="{};{};{};{}"))


def test_the_unit_of_the_output_in_a_row_of_a_form():
    """It was taken for the headings of a form, and the unit was lost."""
    assert read(long_table("Output;Unit;mA", "T;J;k;Y", form="{};{};{};{}")).unit == "mA"


def test_a_first_column_may_be_called_1():
    """It was taken for the number of a channel, and the table refused."""
    assert readings(read("1,temperature,position\n1.35,20,1\n-1.33,20,5\n")) == {
        (20, 1, 1, 1.35),
        (20, 5, 1, -1.33),
    }


@pytest.mark.parametrize(
    "headings",
    ["Supply VDC,I [mA]", "Supply [VDC],Current", "CH1 (mA),Mean", "Supply (VDC),CH1 (A)"],
)
def test_a_supply_or_a_channel_is_no_output_beside_what_is(headings):
    """The supply was taken for the output, or the table refused."""
    record = read(long_table(f"T,J,k,{headings}", form="{},{},{},28,{}"))
    assert readings(record) == set(LONG)


def test_minutes_behind_a_lone_angle_are_not_set_aside():
    """Degrees were read, and their minutes set aside with a note."""
    with pytest.raises(TableError, match="no column for position or angle"):
        read(long_table("T,Table (deg),min,k,Y", form="{},{}0,30,{},{}"))


def test_a_date_that_is_none_is_told_as_it_is_written():
    with pytest.raises(TableError, match="'00/31/2024' is no date that can be read"):
        read(long_table("T,J,k,Y,time", form="{},{},{},{},00/31/2024"))


@pytest.mark.parametrize(
    "headings",
    [
        "Supply [V],Current",
        "Versorgung [V],Strom",
        "Heater [mA],Current",
        "Supply current [mA],I [A]",
    ],
)
def test_a_supply_with_a_unit_is_no_output_beside_a_current(headings):
    """The supply was taken for the output, by its unit, and the current was set aside."""
    assert readings(read(long_table(f"T,J,k,{headings}", form="{},{},{},28,{}"))) == set(LONG)


@pytest.mark.parametrize("headings", ["Supply [V],AL15", "Vcc [V],AL15", "Box [V],Current"])
def test_what_may_be_a_supply_is_not_taken_for_the_output(headings):
    with pytest.raises(TableError, match="no column for output"):
        read(long_table(f"T,J,k,{headings}", form="{},{},{},28,{}"))


def counted(heading, output):
    rows = (f"20,{j % 8 + 1},{j // 8 + 1},{output(j)},{j + 1}\n" for j in range(16))
    return f"T,J,k,Y,{heading}\n" + "".join(rows)


def test_row_numbers_are_no_outputs_nor_numbers_of_samples():
    """They were read as the outputs, or as the n of a mean."""
    with pytest.raises(TableError, match=r":2: Reading '1' and those below count the rows; call"):
        read(counted("Reading", lambda j: f"{j}.5").replace("Y", "Y [mA] old"))
    record = read(counted("n", lambda j: f"{j}.5"))
    assert record.count is None
    assert record.notes == ("column 'n' counts the rows and was set aside",)


@pytest.mark.parametrize("cell", ["-9.9e15", "1354758"])
def test_an_output_far_from_all_others_is_told(cell):
    """It went into the fit without a word; it is told, as readings of any size may be written."""
    record = read(f"T,J,k,Y\n20,1,1,1.3547\n20,5,1,-1.33\n20,3,1,{cell}\n")
    told = f"output {float(cell):g} (line 4) is more than 10,000 times all others: is it a reading?"
    assert record.notes == (told,)


@pytest.mark.parametrize("label", ["60 °C", "T = 60 °C", "warm"])
def test_a_text_alone_in_a_row_is_no_missing_reading(label):
    """The rows below it were read as those of the temperature above."""
    text = f"# temperature: 20\nJ,Y1,Y2\n{block(WIDE[20])}{label}\n3,0.01,0.01\n7,0.02,0.02\n"
    with pytest.raises(TableError, match=rf":5: J '{label}' is not a number, and its row has"):
        read(text)


PI = "3.14159265"


@pytest.mark.parametrize(
    "table",
    [
        f"T,angle [rad],k,Y\n20,0,1,1.35\n20,{PI},1,-1.33\n20,{PI},2,-1.34\n20,0,2,1.36\n",
        f"T,theta,k,Y\ndegC,rad,,\n20,0,1,1.35\n20,{PI},1,-1.33\n20,{PI},2,-1.34\n20,0,2,1.36\n",
        f"T,angle,Y1,Y2\n20,0 rad,1.35,1.36\n20,{PI} rad,-1.33,-1.34\n",
        f"T,k,0 rad,{PI} radians\n20,1,1.35,-1.33\n20,2,1.36,-1.34\n",
    ],
)
def test_angles_in_radians_are_read_where_their_unit_is_told(table):
    """They were refused."""
    record = read(table)
    angles = record.angle.round(6).tolist()
    told = {*zip(angles, record.stroke.tolist(), record.output.tolist(), strict=True)}
    assert told == {((j - 1) * 45.0, k, y) for _, j, k, y in LONG}


@pytest.mark.parametrize("angle", ["45 deg", "45°"])
def test_degrees_under_a_heading_in_radians_are_refused(angle):
    with pytest.raises(TableError, match="under a heading in rad; use one unit in a column"):
        read(f"T,angle [rad],k,Y\n20,{angle},1,1.35\n20,90 deg,1,0.1\n")


@pytest.mark.parametrize(
    "line",
    [
        "# Auflösung: 24 Bit",
        "# Resolution: 6.5 digits",
        "Resolution;24;bit",
        "Auflösung: 6½ Stellen",
    ],
)
def test_a_resolution_of_a_voltmeter_is_passed_over(line):
    """It was refused, or in three cells taken for a step of 24 mA."""
    record = read(f"{line}\nT;J;k;Y [mA]\n20;1;1;1.3\n20;5;1;-1.3\n")
    assert record.apparatus.resolution is None
    assert "is no step of the output and was set aside" in record.notes[0]


@pytest.mark.parametrize("cell", ["#N/D", "#Н/Д", "-nan(ind)", "1.#QNAN", "—", r"\N"])
def test_other_marks_of_a_missing_reading(cell):
    assert len(read(f"T,J,k,Y\n20,1,1,1.3\n20,5,1,-1.3\n20,3,1,{cell}\n")) == 2


@pytest.mark.parametrize("time", ["05/06/2024 02:30:00 PM", "06-05-2024 14:30", "06.05.24 14:30"])
def test_a_date_that_may_be_two_is_told_as_such(time):
    """It was told to be no number."""
    told = (
        "is no date that can be read; write it as 2024-05-31T14:30:00, where nobody takes the day"
    )
    with pytest.raises(TableError, match=f":2: t '{time}' {told}"):
        read(f"T,J,k,Y,t\n20,1,1,1.3,{time}\n20,5,1,-1.3,{time}\n")


@pytest.mark.parametrize("word", ["MW", "Ø", "Uncertainty", "Ecart-type", "平均值"])
def test_a_summary_of_any_name_below_the_readings(word):
    """Only those of a list were known."""
    record = read(long_table("T,J,k,Y") + f"{word},,,0.01\n")
    assert readings(record) == set(LONG)
    assert record.notes == ("1 summary was set aside (line 6)",)


@pytest.mark.parametrize("row", ["MW,1,3,0.01", "MW", "NA,,,0.01", "warm,,1,0.02"])
def test_what_may_be_a_reading_is_no_summary(row):
    with pytest.raises(TableError, match=":6: "):
        read(long_table("T,J,k,Y") + f"{row}\n")


IN_G = {1: "+1g", 5: "-1 g"}


@pytest.mark.parametrize("name", [IN_G.get, {1: "up", 5: "down"}.get])
def test_names_of_positions_beside_angles_are_set_aside(name):
    """They were refused, as numbers were expected."""
    rows = "".join(f"20,{name(j)},{45 * (j - 1)},{k},{y}\n" for _, j, k, y in LONG)
    record = read("T,position,angle,k,Y\n" + rows)
    assert record.angle.tolist() == [0.0, 180.0, 180.0, 0.0]
    assert record.notes == (
        "column 'position' names positions beside their angles and was set aside",
    )
    told = "position '.1 ?g' is no number of a position; write a column angle: .1 g is 0 deg, -1 g"
    with pytest.raises(TableError, match=told if name == IN_G.get else "position 'up' is not a"):
        read("T,position,k,Y\n" + "".join(f"20,{name(j)},{k},{y}\n" for _, j, k, y in LONG))


@pytest.mark.parametrize(
    "form", ["{},Pos. {},k{},{}", "{},P{},Hub {},{}", "{},J{},stroke no. {},{}"]
)
def test_numbers_of_positions_and_strokes_behind_their_words(form):
    """They were refused."""
    assert readings(read(long_table("T,J,k,Y", form=form))) == set(LONG)


@pytest.mark.parametrize(
    "written",
    [
        *("May 31, 2024 14:30:00", "31.05.2024, 14:30:00", "2024年05月31日 14:30:00"),
        *("31.05.2024 14:30:00:000", "2024-05-31 14:30:00 UTC", "Mai 31 2024 14:30"),
        *("31.05.2024 14:30:00.0000000", "2024/05/31 14:30:00.000000000"),  # .NET, pandas
    ],
)
def test_dates_of_other_programs(written):
    """They were refused."""
    assert str(date_of(written).replace(tzinfo=None)) == "2024-05-31 14:30:00"
    later = written.replace("14:30", "15:30")
    record = read(f"T;J;k;Y;t\n20;1;1;1.3;{written}\n20;5;1;-1.3;{later}\n")
    assert record.time.tolist() == [0.0, 3600.0]


@pytest.mark.parametrize(
    "form",
    [
        *("31.05.2024 {}", "2024/05/31 {}", "31-May-2024 {}", "2024-05-31 {}"),
        *("May 31 2024 {}", "31.05.2024, {}", "Oct 31, 2024, {}", "05/31/2024 {}"),
    ],
)
@pytest.mark.parametrize("heading", ["t", "date"])
def test_a_time_may_have_seven_decimals(form, heading):
    """Those of .NET and of databases were refused; of May 31 2024 the date was May."""
    times = [form.format(f"14:{minute}:00.5000000") for minute in (30, 31)]
    record = read(f"T;J;k;Y;{heading}\n20;1;1;1.3;{times[0]}\n20;5;1;-1.3;{times[1]}\n")
    assert record.time.tolist() == [0.0, 60.0]
    assert str(date_of(record.date).date())[5:] in ("05-31", "10-31")


LARGE = [(T, j, k, 1000 * y + 4) for T, j, k, y in LONG]


@pytest.mark.parametrize(
    ("form", "of"),
    [
        ("{};{};{};{:,.3f}", {",": ".", ".": ","}),
        ('"{}","{}","{}","{:,.3f}"', {}),
        ("{}\t{}\t{}\t{:,.3f}", {}),
    ],
)
def test_thousands_marks_that_numbers_prove_are_read(form, of):
    """They were refused, though 1.304,998 can be read in one way alone."""
    head = "T,J,k,Y".replace(",", "\t" if "\t" in form else ";" if ";" in form else ",")
    rows = "\n".join(form.format(*row).translate(str.maketrans(of)) for row in LARGE)
    assert readings(read(f"{head}\n{rows}\n20{head[1]}3{head[1]}1{head[1]}4\n")) == {
        *LARGE,
        (20, 3, 1, 4),
    }


def test_whole_numbers_of_millions_prove_their_thousands_marks():
    """Of 4.700 below them the point was taken for that of decimals, or all were refused."""
    record = read("T;J;k;Y\n20;1;1;1.304.998\n20;5;1;-1.295.059\n20;3;1;4.700\n")
    assert record.output.tolist() == [1304998, -1295059, 4700]


def test_one_number_alone_proves_no_thousands_mark():
    with pytest.raises(TableError, match=r"Y '1\.304,998' does not fit the decimal mark"):
        read("T;J;k;Y\n20;1;1;1.304,998\n20;5;1;-995.059\n20;3;1;4.700\n")


SPLIT = "20,1,1,1,304998\n20,5,1,-1,295059\n20,3,1,0,004700\n"


@pytest.mark.parametrize("heading", ["std", "n", "remark"])
def test_decimals_below_a_heading_of_their_own_are_refused(heading, monkeypatch):
    """The outputs were read as 1, -1 and 0."""
    table = f"T,J,k,Y,{heading}\n{SPLIT}"
    told = (
        ":1: '1,304998' below two headings looks like a number with a decimal comma; separate the"
    )
    for least in (engines.BULK_CHARACTERS, 0):
        monkeypatch.setattr(engines, "BULK_CHARACTERS", least)
        with pytest.raises(TableError, match=told):
            read(table)
    assert read_ordinary([Content("a.csv", table.encode())], {}, "pandas") == [None]
    whole = read(table.replace("304998", "100").replace("295059", "100").replace("004700", "100"))
    assert whole.output.tolist() == [1, -1, 0]


@pytest.mark.parametrize(
    ("form", "behind"),
    [("{},{},{},{},{}", 1013), ("{},{},{},{},{}", 998.5), ('"{}","{}","{}","{}","{}"', 304)],
)
def test_whole_outputs_beside_a_column_of_one_size_are_two_columns(form, behind):
    """They were refused as numbers with a decimal comma."""
    cells = [(20, j, 1, round(600 * y) - j, behind + j) for j, y in enumerate((1, 0, -1, 0.2), 1)]
    rows = "".join(form.format(*row) + "\n" for row in cells)
    assert read(f"T,J,k,Y,pressure\n{rows}").output.tolist() == [599, -2, -603, 116]


@pytest.mark.parametrize("remark", ["Pause", "=====", "-40 °C"])
def test_a_text_alone_is_a_remark_where_each_row_tells_its_temperature(remark):
    """It was refused, as one that tells of the rows below."""
    head, *rows = long_table("T,J,k,Y").splitlines()
    between = "\n".join([head, *rows[:2], f"{remark},,,", *rows[2:]])
    assert readings(read(between + "\n")) == set(LONG)


def test_a_supply_is_no_accelerometer():
    with pytest.raises(TableError, match="a line '# serials: AL15' if these are accelerometers"):
        read("T,J,k,Vcc [V],AL15\n20,1,1,5,1.3\n20,5,1,5,-1.3\n")


def test_rows_that_all_end_early_are_refused():
    """Below a heading too many the outputs were read one column to the left."""
    told = ":1: no row has more than 4 fields, but 5 have headings; leave empty fields"
    with pytest.raises(TableError, match=told):
        read("T,k,,0 deg,180 deg\n20,1,1.35,-1.33\n20,2,1.36,-1.34\n")
    assert len(read("T,k,0 deg,180 deg\n20,1,1.35,\n20,2,1.36\n")) == 2


@pytest.mark.parametrize(
    "above",
    [",20 °C,,60 °C,\nJ,Y1,Y2,Y1,Y2\n", ",20 °C,,,60 °C,\nJ,Y1,Y2,J,Y1,Y2\n"],
)
def test_temperatures_over_blocks_that_share_their_positions(above):
    """The columns of the blocks were told to mean the same."""
    side = [[j, *own] for j, *own in WIDE[20]], [own for _, *own in WIDE[60]]
    if above.count("J") == 2:
        side = side[0], [[j, *own] for j, *own in WIDE[60]]
    rows = "".join(",".join(map(str, one + other)) + "\n" for one, other in zip(*side, strict=True))
    assert readings(read(above + rows)) == TWO


def test_temperatures_over_blocks_have_the_decimal_mark_of_the_table():
    """It was made a point, which did not fit the outputs."""
    above = ";20,0 °C;;60,0 °C;\nJ;Y1;Y2;Y1;Y2\n"
    sides = zip(WIDE[20], WIDE[60], strict=True)
    rows = [";".join(map(str, (*one, *other[1:]))).replace(".", ",") for one, other in sides]
    assert readings(read(above + "\n".join(rows))) == TWO


@pytest.mark.parametrize("mark", [" ", "\t", ","])
def test_row_names_of_r_have_no_heading(mark):
    """The rows were told to have a field too many."""
    rows = [(f'"{n}"', *row) for n, row in enumerate(LONG, 1)]
    text = "\n".join(mark.join(map(str, row)) for row in [('"T"', '"J"', '"k"', '"Y"'), *rows])
    assert readings(read(text + "\n")) == set(LONG)
    with pytest.raises(TableError, match=r"5 fields"):
        read(text.replace('"2"', "2") + "\n")
    with pytest.raises(TableError, match=r":2: 5 fields"):  # no names, as 20 stands in each row
        read("T,J,k,Y\n" + "\n".join(f'"{T}","{j}","{k}","{y}","ok"' for T, j, k, y in LONG))
    quoted = "\n".join(f'"{T}","{j}","{k}","{y}",' for T, j, k, y in LONG)  # no name, but no end
    assert readings(read(f"T,J,k,Y,\n{quoted}\n")) == set(LONG)


def test_rows_of_several_outputs_that_end_early_are_told():
    """A row that had lost a cell within was read one output to the left without a word."""
    record = read("T,J,Y1,Y2\n20,1,1.35,1.36\n20,5,-1.34\n")
    told = "the last outputs count as missing in rows that end early (line 3)"
    assert record.notes == (told, "1 missing reading was left out (line 3)")
    assert len(read("T,J,Y1,Y2\n20,1,1.35,1.36\n20,5,-1.34,\n").notes) == 1


TURN = [(j, k, f"{1.35 - 0.3 * j - 0.001 * k:g}") for k in (1, 2) for j in range(1, 10)]


@pytest.mark.parametrize(
    ("first", "others", "told"),
    [
        ("26.0", "20.0", "temperature 26 degC (line 2)"),
        ("2.1", "20.{}", "temperature 2.1 degC (line 2)"),
        ("200", "20.{}", "temperature 200 degC (line 2)"),
        ("20.1", "20.0", None),
        ("20.0625", "20", None),
        ("20.5", "20.0", None),
        ("23.0", "20.{}", None),
    ],
)
def test_a_temperature_with_a_wrong_digit_is_told(first, others, told):
    """It moved the mean of its run, and no gate of the fit sees it."""
    rows = [f"{others.format(j)},{j},{k},{y},1" for j, k, y in TURN]
    rows[0] = rows[0].replace(rows[0].split(",")[0], first, 1)
    notes = read("\n".join(["T,J,k,Y,run", *rows])).notes
    assert [note.partition(" is far from all others of run 1")[0] for note in notes] == (
        [told] if told else []
    )


def test_a_step_of_a_thermometer_in_fahrenheit_is_no_wrong_digit():
    """The next tenth of a degF was told, as 20.05555556 degC has other decimals than 20."""
    rows = [f"{'68.1' if j == 4 else '68.0'},{j},{k},{y},1" for j, k, y in TURN[:9]]
    notes = read("\n".join(["T [degF],J,k,Y,run", *rows])).notes
    assert not any("far from all others" in note for note in notes)


def test_a_wrong_temperature_of_a_row_of_strokes_is_told_once():
    rows = [
        f"{29 if j == 4 else 20},{j},{1.35 - 0.3 * j:g},{1.36 - 0.3 * j:g},1" for j in range(1, 10)
    ]
    (note,) = read("\n".join(["T,J,Y1,Y2,run", *rows])).notes
    assert note.startswith("temperature 29 degC (line 5) is far from all others of run 1, 20 to 20")


@pytest.mark.parametrize(
    ("at", "wrong", "told"),
    [
        (5, "3000", "from line 7 to line 8"),
        (5, "30", "from line 6 to line 7"),
        (0, "900", "from line 2 to line 3"),
        (17, "1", "from line 18 to line 19"),
        (5, "350", None),
    ],
)
def test_a_time_out_of_the_order_of_all_others_is_told(at, wrong, told):
    times = [str(60 * i) for i in range(len(TURN))]
    times[at] = wrong
    rows = [f"{t},20,{j},{k},{y}" for t, (j, k, y) in zip(times, TURN, strict=True)]
    notes = read("\n".join(["t [s],T,J,k,Y", *rows])).notes
    assert notes == ((f"the time steps back once, {told}: is it right in both?",) if told else ())


def test_times_that_begin_anew_in_a_run_are_in_order():
    rows = [
        f"{60 * i},{t},{row[0]},{row[1]},{row[2]}" for t in (20, 60) for i, row in enumerate(TURN)
    ]
    assert not any("steps back" in own for own in read("\n".join(["t [s],T,J,k,Y", *rows])).notes)


PAIRS = [(j, WIDE[20][i][1:], WIDE[60][i][1:]) for i, j in enumerate((1, 5))]


@pytest.mark.parametrize(
    "above",
    [
        "Temperature [°C],20,,60,\nPosition,Stroke 1,Stroke 2,Stroke 1,Stroke 2\n",
        "T [K],293.15,293.15,333.15,333.15\nJ,Y1,Y2,Y1,Y2\n",
        "Position,20 °C,,60 °C,\n,Stroke 1,Stroke 2,Stroke 1,Stroke 2\n",
        "Position,20 °C,,60 °C,\n,Fwd,Rev,Fwd,Rev\n",
        "Temperature,20,20,60,60\nPosition,Fwd,Rev,Fwd,Rev\n",
    ],
)
def test_temperatures_over_strokes_as_a_spreadsheet_merges_them(above):
    """They were refused, as the columns of the strokes are called alike."""
    rows = "".join(",".join(map(str, (j, *one, *other))) + "\n" for j, one, other in PAIRS)
    assert readings(read(above + rows)) == TWO


def test_strokes_called_alike_below_nothing_are_refused():
    with pytest.raises(TableError, match="'Fwd' and 'Fwd' mean the same"):
        read("T,J,Fwd,Rev,Fwd,Rev\n20,1,1.35,1.36,1.35,1.36\n")


@pytest.mark.parametrize(
    "headings",
    [
        "Temperature_degC_,Position,Stroke,Output_mA_",  # of MATLAB
        "Temperature__C_,J,k,Current_mA_",
        "102 (C),J,k,101 (mA)",  # of a Keysight 34970A
        "temp_C,J,k,voltage_mA,voltage_std_mA",
        "Температура,Номер положения,Номер прохода,Выходной ток [мА]",
        "Température,Numéro de position,N° de passage,Courant [mA]",
        "温度[℃],位置,行程,出力[mA]",
        "温度(℃),ポジション,ストローク,電流(mA)",
    ],
)
def test_headings_of_other_programs_and_countries(headings):
    own = read(long_table(headings, form="{},{},{},{}" + ",1e-5" * (headings.count(",") - 3)))
    assert readings(own) == {*LONG}


def test_a_channel_beside_no_stroke_is_a_stroke():
    with pytest.raises(TableError, match="no column for position or angle"):
        read("T,101 (mA),102 (mA)\n20,1.35,1.36\n")


def test_japanese_text_of_a_spreadsheet(tmp_path):
    path = tmp_path / "a.csv"
    cells = "".join(f"20,{j},{'往' if k == 1 else '復'},{y}\n" for _, j, k, y in LONG)
    path.write_text(f"# 往復\n# stroke: 1\n温度,位置,往復,出力\n{cells}", encoding="shift_jis")
    record = accelcal.read_table(path)
    assert readings(record) == {*LONG}
    assert "the text is not UTF-8 and was read as cp932" in record.notes


def test_a_table_on_its_side_with_angles_beside_position():
    text = "# temperature: 20\nPosition;0°;180°\nHub 1;1,35;-1,33\nHub 2;1,36;-1,34\n"
    assert {row[2:] for row in readings(read(text))} == {row[2:] for row in LONG}


def turned(heading, words, above=(), below="{},{},{},{}"):
    """A table of one stroke with each of two words, over nine positions."""
    turn = [
        (n, word) for word, way in zip(words, (1, -1), strict=True) for n in range(1, 10)[::way]
    ]
    rows = [below.format(20, 45 * (n - 1), word, n + 0.5) for n, word in turn]
    return "\n".join([*above, f"T,angle,{heading},Y", *rows]) + "\n"


@pytest.mark.parametrize("heading", ["Stroke", "Direction", "Drehrichtung"])
@pytest.mark.parametrize("words", [("CW", "CCW"), ("forward", "back"), ("rechts", "links")])
def test_words_of_directions_alone_tell_one_stroke_each(heading, words):
    """They were no numbers of strokes, or a column stroke was missing."""
    record = read(turned(heading, words))
    assert record.stroke.tolist() == [1] * 9 + [2] * 9


@pytest.mark.parametrize("words", [("CW", "x"), ("hot", "cold")])
def test_words_whose_direction_nothing_tells_are_refused(words):
    rows = "".join(f"20,{45 * n},{word},{n}.5\n" for n in range(9) for word in words)
    with pytest.raises(TableError, match="is neither forward nor back"):
        read(f"T,angle,Stroke,Y\n{rows}")


def test_comments_of_matlab_are_header_lines():
    """The serial number and the unit were set aside as text."""
    record = read(long_table("% serial: A-7", "% unit: mA", "%% by hand", "T,J,k,Y"))
    assert (record.serial, record.unit, readings(record)) == ("A-7", "mA", set(LONG))
    assert readings(read(long_table("% T,J,k,Y"))) == set(LONG)
    assert readings(read(long_table("T,J,k,Y") + "% the end\n")) == set(LONG)
    assert readings(read(long_table("RH,T,J,k,Y", "%,degC,,,mA", form="40,{},{},{},{}"))) == set(
        LONG
    )


def test_wide_commas_separate_columns():
    """There were no headings."""
    assert readings(read(long_table("温度，位置，行程，输出", form="{}，{}，{}，{}"))) == set(LONG)
    assert readings(read(long_table("温度（°C），位置，行程，输出"))) == set(LONG)
    text = long_table("温度，位置，行程，输出", form="{}，{}，{}，{}")
    assert readings(accelcal.read_table(io.BytesIO(text.encode("gbk")))) == set(LONG)


@pytest.mark.parametrize(
    "headings",
    [
        "Temperature_degC,Pos,StrokeNo,Output_mA",
        "Temp,PositionNumber,Stroke,Vout",
        "T,Position,Course,Sortie",
        "T,J,k,DMM1 (A DC)",
        "T,J,k,Y [Impulse]",
        "T,Lage,Hub,Y",
    ],
)
def test_headings_as_programs_write_them(headings):
    assert readings(read(long_table(headings))) == set(LONG)


def test_what_was_measured_goes_before_what_was_set():
    """Neither was taken, as two columns have the unit."""
    record = read(
        long_table(
            "T set [°C],T meas [°C],Angle set [deg],Angle actual [deg],k,Y",
            form="21,{0},7,{1},{2},{3}",
        )
    )
    assert (record.temperature.tolist(), record.angle.tolist()) == ([20.0] * 4, [1, 5, 5, 1])


@pytest.mark.parametrize("humidity", ["%", "%RH", "% RH"])
@pytest.mark.parametrize("mark", [";", "\t", "  "])
@pytest.mark.parametrize("heading", ["RH", "%RH"])
def test_units_that_begin_with_percent_are_no_comment(heading, mark, humidity):
    """They were set aside as one of MATLAB, and the unit of the outputs with them."""
    humidity = humidity if mark != "  " else humidity.replace(" ", "")
    rows = [f"{heading},T,J,k,Y", "", f"{humidity},K,-,-,mA"]
    rows += [f"40,{273.15 + T},{J},{k},{Y}" for T, J, k, Y in sorted(LONG)]
    record = read("\n".join(rows).replace(",", mark) + "\n")
    assert record.unit == "mA"
    assert record.temperature.tolist() == pytest.approx([T for T, *_ in sorted(LONG)])
