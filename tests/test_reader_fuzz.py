"""The reader against tables nobody thought of."""

from __future__ import annotations

import gzip
import io
import re

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from accelcal.errors import TableError
from accelcal.io.engines import BulkEngineGivesUp, columns_by_pandas, columns_by_split
from accelcal.io.files.text import read_text
from accelcal.io.layout.parts import read_layout
from accelcal.io.tables import _read_by, read_table, read_tables
from accelcal.record import TumbleRecord

COUNTED = re.compile(r"(\d+) (?:missing reading|repeated reading|comment line)")

PIECES = [
    *(
        "temperature",
        "T",
        "position",
        "angle",
        "J",
        "stroke",
        "k",
        "output",
        "Y",
        "Y1",
        "1",
        "2",
        "run",
    ),
    *(
        "time",
        "date",
        "t [s]",
        "serial",
        "mounting",
        "std",
        "n",
        "unit",
        "output [mA]",
        "o-",
        "mA",
        "1 mA",
        "A",
    ),
    *(
        ",",
        ",",
        ";",
        "\t",
        " ",
        "\n",
        "\n",
        "\r\n",
        "\r",
        '"',
        "#",
        ":",
        "# g: 9.81\n",
        "# T0: 20\n",
    ),
    *("# positions: 12\n", "# runs: a,b\n", "# temperature: unknown\n", "# stroke: 1\n", "sep=;\n"),
    *(
        "20",
        "-40",
        "80.5",
        "1",
        "3",
        "0",
        "-1",
        "1.5",
        "1,5",
        "1e999",
        "nan",
        "inf",
        "NA",
        "-",
        "1_0",
    ),
    *(
        "2024-05-31",
        "2024-05-31T10:00:00Z",
        "23:59",
        "0:00:30.5",
        "12:01 am",
        "9" * 30,
        "\0",
        "\ufeff",
        "é",
        "\x85",
        "\u2028",
        "\u2212",
    ),
]
CELLS = st.sampled_from(
    [
        *("", "NA", "nan", "#N/A", "-", "x", "#", "# x", "inf", "1e999", "0", "1", "2", "9", "10"),
        *(
            "-1",
            "1.5",
            "1,5",
            "1.5 mA",
            "1_0",
            '"',
            '""',
            "a b",
            "20",
            "80",
            "21.5",
            "1e9",
            "\u0663",
        ),
        *("output", "unknown", "1e3", "0x1", "1d3", "+3", "3.", ".5", " 1 ", "1\t", "True"),
    ]
) | st.text(st.characters(exclude_characters=",\n\r"), max_size=4)


def only_table_errors(data):
    try:
        records = read_tables(io.BytesIO(data))
    except TableError as caught:
        error = caught
    else:
        assert all(isinstance(record, TumbleRecord) for record in records)
        return records
    assert len(str(error).splitlines()) == 1
    assert error.problem
    assert error.remedy
    return ()


@given(st.binary(max_size=200))
@settings(max_examples=300)
def test_any_bytes(data):
    only_table_errors(data)


@given(st.binary(max_size=200))
@settings(max_examples=100)
def test_any_bytes_behind_good_ones(data):
    only_table_errors(b"temperature,position,stroke,output\n20,1,1,1.5\n" + data)
    only_table_errors(b"\x1f\x8b" + data)


@given(
    st.lists(st.sampled_from(PIECES), max_size=60), st.sampled_from(["utf-8", "utf-16", "latin-1"])
)
@settings(max_examples=500)
def test_any_pieces_of_tables(pieces, encoding):
    only_table_errors("".join(pieces).encode(encoding, errors="replace"))


@given(st.lists(st.sampled_from(PIECES), max_size=30))
@settings(max_examples=300)
def test_any_rows_behind_good_headings(pieces):
    head = "T,J,k,Y,t,run,serial,std,mounting,unit\n20,1,1,1.5,0,a,A,0.1,o,mA\n"
    only_table_errors((head + "".join(pieces)).encode())


@st.composite
def records(draw):
    """A record as a long or a wide table can show it, in the order of the file."""
    levels = draw(
        st.lists(st.sampled_from([-40, 20, 23, 80, 81]), min_size=1, max_size=3, unique=True)
    )
    assume(not {80, 81} <= set(levels))
    strokes = draw(st.integers(1, 4))
    positions = draw(st.sampled_from([4, 8, 12]))
    numbers = draw(st.permutations(range(1, positions + 2)))
    rows = [(t, j, k) for t in levels for j in numbers for k in range(1, strokes + 1)]
    n = len(rows)
    seed = draw(st.integers(0, 2**32 - 1))
    scale = draw(st.sampled_from([1e-9, 1.0, 1e5]))
    output = np.random.default_rng(seed).normal(size=n) * scale
    temperature, position, stroke = (np.array(column) for column in zip(*rows, strict=True))
    return TumbleRecord(
        output=output,
        angle=(position - 1) * 360.0 / positions,
        temperature=temperature.astype(float),
        stroke=stroke,
        run=np.array([levels.index(t) for t in temperature]),
        run_labels=tuple(map(str, levels)),
        mounting=np.full(n, "o+"),
        position=position,
        positions=positions,
        serial=draw(st.none() | st.sampled_from(["A7", "Grüße", "1"])),
        unit=draw(st.none() | st.sampled_from(["mA", "counts"])),
    )


@st.composite
def forms(draw):
    separator = draw(st.sampled_from([",", ";", "\t"]))
    return {
        "wide": draw(st.booleans()),
        "separator": separator,
        "decimal": "." if separator == "," else draw(st.sampled_from([".", ","])),
        "encoding": draw(
            st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"])
        ),
        "end": draw(st.sampled_from(["\n", "\r\n", "\r"])),
        "trailing": draw(st.integers(0, 3)),
        "quoted": draw(st.booleans()),
        "order": draw(st.randoms(use_true_random=False)),
        "gzip": draw(st.booleans()),
    }


def cells_of(record, wide):
    rows = list(zip(record.temperature, record.position, record.stroke, record.output, strict=True))
    if not wide:
        return [("temperature", "position", "stroke", "output"), *rows]
    strokes = sorted(set(record.stroke.tolist()))
    places = dict.fromkeys((t, j) for t, j, _, _ in rows)
    outputs = {(t, j, k): y for t, j, k, y in rows}
    lines = [(t, j, *(outputs[t, j, k] for k in strokes)) for t, j in places]
    return [("T", "J", *(f"Y{k}" for k in strokes)), *lines]


def spelt(cell, form):
    text = cell if isinstance(cell, str) else repr(cell.item()).replace(".", form["decimal"])
    return f'"{text}"' if form["quoted"] else text


def render(record, form):
    header = {"positions": record.positions, "serial": record.serial, "unit": record.unit}
    lines = [f"# {key}: {value}" for key, value in header.items() if value is not None]
    columns = list(zip(*cells_of(record, form["wide"]), strict=True))
    if not form["wide"]:
        form["order"].shuffle(columns)
    blank = form["separator"] * form["trailing"]
    lines += [
        form["separator"].join(spelt(cell, form) for cell in row) + blank
        for row in zip(*columns, strict=True)
    ]
    text = form["end"].join(lines) + form["end"]
    data = text.encode(form["encoding"])
    return gzip.compress(data) if form["gzip"] else data


@given(records(), forms())
@settings(max_examples=150)
def test_a_table_in_any_form_reads_back_equal(record, form):
    assert read_table(io.BytesIO(render(record, form))) == record


def results(engine, data):
    text = read_text(io.BytesIO(data))
    found = tuple(_read_by(engine, text, read_layout(text), {})[1])
    return found, [record.notes for record in found]


@given(records(), forms())
@settings(max_examples=50)
def test_both_engines_read_any_form(record, form):
    data = render(record, form)
    try:
        by_pandas = results(columns_by_pandas, data)
    except BulkEngineGivesUp:
        layout = read_layout(read_text(io.BytesIO(data)))
        mark, last = layout.separator, len(layout.headings) - 1
        assert form["quoted"] or any(row.count(mark) != last for row in layout.rows)
        return
    assert by_pandas == results(columns_by_split, data)


@st.composite
def mutated(draw):
    """Rows of a valid long table with cells replaced, rows dropped and rows repeated."""
    rows = [
        [str(t), str(j), str(k), repr(0.1 * j + k + t)]
        for t in (20, 80)
        for k in (1, 2)
        for j in (1, 3, 5)
    ]
    order = draw(st.permutations(range(4)))
    for _ in range(draw(st.integers(0, 4))):
        index = draw(st.integers(0, len(rows) - 1))
        kind = draw(st.sampled_from(["replace", "drop", "repeat"]))
        if kind == "replace":
            rows[index] = list(rows[index])
            rows[index][draw(st.integers(0, 3))] = draw(CELLS)
        elif kind == "drop" and len(rows) > 1:
            del rows[index]
        else:
            rows.insert(draw(st.integers(0, len(rows))), rows[index])
    names = ("temperature", "position", "stroke", "output")
    return [",".join(row[i] for i in order) for row in [names, *rows]]


@given(mutated())
@settings(max_examples=500)
def test_no_row_is_lost_silently(lines):
    found = only_table_errors("\n".join(lines).encode("utf-8", errors="replace"))
    if found:
        noted = sum(
            int(n) for record in found for note in record.notes for n in COUNTED.findall(note)
        )
        assert sum(map(len, found)) + noted == len(lines) - 1


@given(mutated())
@settings(max_examples=100)
def test_both_engines_read_mutated_tables_alike(lines):
    data = "\n".join(lines).encode("utf-8", errors="replace")
    try:
        by_pandas = results(columns_by_pandas, data)
    except (BulkEngineGivesUp, TableError):
        return  # the light engine has the last word
    assert by_pandas == results(columns_by_split, data)
