"""The reading of ordinary tables: what it takes, the general reader reads equal."""

import gzip
import io
from dataclasses import fields

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import accelcal
from accelcal.archive.sources import read_bytes
from accelcal.errors import InputError
from accelcal.io.ordinary import reader as ordinary
from accelcal.io.ordinary.reader import Content, read_ordinary
from accelcal.io.tables import read_tables

ENGINES = ("pyarrow", "pandas")

HEADER = """\
# serial: AL-15
# unit: mA
# T0: 20
# head_uncertainty: 1e-5
# date: 2024-05-31
# lab: two
"""
HEADINGS = "temperature,position,stroke,output,run\n"


def rows(runs=("a", "b"), temperatures=(20.0, 60.0), seed=1):
    rng = np.random.default_rng(seed)
    for run, temperature in zip(runs, temperatures, strict=True):
        for stroke in (1, 2):
            for position in range(1, 10):
                y = 1.35 * np.cos(np.radians(45.0 * (position - 1))) + 1e-5 * rng.normal()
                yield temperature, position, stroke, float(y), run


def table(header=HEADER, headings=HEADINGS, cells=None):
    lines = [",".join(map(str, row)) for row in cells or rows()]
    return header + headings + "\n".join(lines) + "\n"


def general(content, overrides=None):
    source = io.BytesIO(content)
    source.name = "a.csv"
    return read_tables(source, overrides=overrides)


def assert_same(records, others):
    assert len(records) == len(others)
    for one, other in zip(records, others, strict=True):
        for field in fields(one):
            a, b = getattr(one, field.name), getattr(other, field.name)
            assert type(a) is type(b), field.name
            if isinstance(a, np.ndarray):
                assert (a.dtype, a.shape) == (b.dtype, b.shape), field.name
                assert np.array_equal(a, b), field.name
                assert not a.flags.writeable
            else:
                assert a == b, field.name


def taken(text, engine, overrides=None):
    """Whether the reading of ordinary tables takes a table; if so, as the general reader does."""
    content = text if isinstance(text, bytes) else text.encode()
    records = read_ordinary([Content("a.csv", content)], overrides or {}, engine)[0]
    if records is not None:
        assert_same(records, general(content, overrides))
    return records is not None


WITHOUT_RUN = "temperature,position,stroke,output\n"
ORDINARY = {
    "as written": table(),
    "CRLF": table().replace("\n", "\r\n"),
    "byte order mark": "\ufeff" + table(),
    "no header": table(header=""),
    "no last line feed": table().rstrip("\n"),
    "levels in place of runs": table(headings=WITHOUT_RUN, cells=[r[:4] for r in rows()]),
    "one level": table(headings=WITHOUT_RUN, cells=[r[:4] for r in rows(("a",), (19.6,))]),
    "other headings": table(headings="T [degC],J,k,Y [mA],run\n"),
    "angles": table(
        headings="temperature,angle,stroke,output,run\n",
        cells=[(t, 45.0 * (j - 1), k, y, r) for t, j, k, y, r in rows()],
    ),
    "angles and positions": table(
        headings="temperature,angle,position,stroke,output,run\n",
        cells=[(t, 45.01 * (j - 1), j, k, y, r) for t, j, k, y, r in rows()],
    ),
    "twelve positions": table(
        header="# positions: 12\n# unit: V\n",
        cells=[(20.0, j, k, float(np.cos(j)), "a") for k in (1, 2) for j in range(1, 14)],
    ),
    "times, scatter, mountings": table(
        headings="time [min],temperature,position,stroke,output,std,n,run,mounting\n",
        cells=[
            (0.5 * i, t, j, k, y, 1e-6, 10, r, "o" if r == "a" else "P-")
            for i, (t, j, k, y, r) in enumerate(rows())
        ],
    ),
    "times without runs": table(
        headings="time,temperature,position,stroke,output\n",
        cells=[(i, *row[:4]) for i, row in enumerate(rows())],
    ),
    "many serials": table(
        header="# unit: mA\n",
        headings="serial," + HEADINGS,
        cells=[(s, *row) for s in ("S1", "S2", "S3") for row in rows(seed=len(s))],
    ),
    "measured temperatures": table(
        cells=[(round(t + 0.1 * (5 * j % 7), 1), j, *row) for t, j, *row in rows()]
    ),
    "exponents": table(cells=[(t, j, k, f"{y:+.9e}"[y > 0 :], r) for t, j, k, y, r in rows()]),
    "known delta0": table(header=HEADER + "# delta0: 0.001\n# g: 9.81\n"),
    "gzip": gzip.compress(table().encode()),
}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ORDINARY)
def test_ordinary_tables_are_taken(name, engine):
    assert taken(ORDINARY[name], engine)


TURN_OF_16 = np.arange(0.0, 382.5, 22.5).tolist()

ODD = {
    "decimal comma": table().replace(",", ";").replace(".", ","),
    "semicolons": table().replace(",", ";"),
    "a gap": table(cells=[(t, j, k, "" if (j, k) == (3, 1) else y, r) for t, j, k, y, r in rows()]),
    "a word for missing": "\n".join(
        line.rsplit(",", 2)[0] + ",-,a" if line.startswith("20.0,3,1,") else line
        for line in table().split("\n")
    ),
    "an unknown column": table(
        headings=HEADINGS.strip() + ",operator\n", cells=[(*r, "me") for r in rows()]
    ),
    "row numbers for n": table(
        headings="temperature,position,stroke,output,n\n",
        cells=[(*row[:4], n) for n, row in enumerate(rows(), 1)],
    ),
    "a resolution of a voltmeter": table(HEADER + "# resolution: 24 bit\n"),
    "a temperature far from all others": table().replace("60.0,1,1,", "68.0,1,1,", 1),
    "an output far from all others": table().replace(",1.35", ",1.35e9", 1),
    "radians": table(
        headings="temperature,angle [rad],stroke,output,run\n",
        cells=[(t, f"{(j - 1) * np.pi / 4:.6f}", *row) for t, j, *row in rows()],
    ),
    "wide": "temperature,position,Y1,Y2\n20,1,1.3,1.31\n20,5,-1.29,-1.28\n",
    "a comment inside": table().replace("60.0,1,1,", "# now hot\n60.0,1,1,", 1),
    "a blank line inside": table().replace("60.0,1,1,", "\n60.0,1,1,", 1),
    "quotes": table().replace(",a\n", ',"a"\n'),
    "ISO 8601 times": table(
        headings="time,temperature,position,stroke,output\n",
        cells=[(f"2024-05-31T10:{i:02d}:00", *r[:4]) for i, r in enumerate(rows())],
    ),
    "clock times": table(
        headings="time,temperature,position,stroke,output\n",
        cells=[(f"10:{i:02d}", *r[:4]) for i, r in enumerate(rows())],
    ),
    "dates": table(
        headings="date,temperature,position,stroke,output\n",
        cells=[("2024-05-31", *r[:4]) for r in rows()],
    ),
    "a reading twice": table(cells=[*rows(), list(rows())[-1]]),
    "declared runs": table(header="# runs: b,a\n"),
    "two declarations in a line": table(header="# serial: A7; unit: mA\n"),
    "a constant": table(header="# mounting: p\n"),
    "units that differ": table(headings="temperature,position,stroke,output [V],run\n"),
    "latin-1": table(header="# lab: Z\u00fcrich\n").encode("latin-1"),
    "UTF-16": table().encode("utf-16"),
    "a level met again": table(
        headings=WITHOUT_RUN,
        cells=[r[:4] for r in rows(("a", "b", "c"), (20.0, 60.0, 20.0))],
    ),
    "numbered runs in another order": table(cells=rows(("2", "1"))),
    "a serial that comes back": table(
        header="",
        headings="serial," + HEADINGS,
        cells=[(s, *row) for s, row in zip("ABA" * 12, rows(), strict=True)],
    ),
    "minutes of angles behind the point": table(
        headings="temperature,angle,stroke,output\n",
        cells=[(20.0, a - a % 1 * 0.4, k, 1.3 - a / 150) for k in (1, 2) for a in TURN_OF_16],
    ),
    "a key that is nearly one": table(header="# head_uncertanty: 1e-5\n"),
    "a short turn": table(cells=[r for r in rows() if r[1] < 8]),
}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ODD)
def test_tables_out_of_the_ordinary_are_left(name, engine):
    assert not taken(ODD[name], engine)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("unit", "std", "asked", "ordinary"),
    [
        (" [mA]", " [mA]", {}, True),
        (" [mA]", " [uA]", {}, False),
        ("", " [uA]", {"unit": "mA"}, False),
        ("", " [milliamps]", {"unit": "mA"}, True),
        ("", " [uA]", {}, True),
    ],
)
def test_a_std_in_another_unit_is_left(unit, std, asked, ordinary, engine):
    headings = f"temperature,position,stroke,output{unit},std{std},n\n"
    text = table(headings=headings, cells=[(*r[:4], 1e-3, 10) for r in rows()], header="")
    assert taken(text, engine, asked) == ordinary


WRONG = {
    "stroke 0": table().replace("20.0,3,1,", "20.0,3,0,", 1),
    "stroke below 0": table().replace("20.0,3,1,", "20.0,3,-9999,", 1),
    "stroke beyond all integers": table().replace("20.0,3,1,", "20.0,3,1e300,", 1),
    "position outside": table().replace("20.0,3,1,", "20.0,12,1,", 1),
    "half a position": table().replace("20.0,3,1,", "20.0,3.5,1,", 1),
    "a clash": table().replace("20.0,3,1,", "20.0,2,1,", 1),
    "infinite": table().replace("20.0,3,1,", "1e999,3,1,", 1),
    "kelvin": table().replace("20.0,", "293.15,"),
    "a marker": table(
        cells=[(t, j, k, -9999.0 if (j, k) == (3, 1) else y, r) for t, j, k, y, r in rows()]
    ),
    "a run in two ways": table(cells=rows(runs=("1", "1.0"))),
    "a serial in two ways": table(
        header="# unit: mA\n",
        headings="temperature,position,stroke,output,serial\n",
        cells=rows(runs=("1.0", "1")),
    ),
    "equal outputs": table(cells=[(t, j, k, 1.5, r) for t, j, k, _, r in rows()]),
    "underscores": table().replace("20.0,3,1,", "2_0.0,3,1,", 1),
    "radians": table(
        headings="temperature,angle,stroke,output,run\n",
        cells=[(t, 0.785398 * (j - 1), k, y, r) for t, j, k, y, r in rows()],
    ),
    "unknown mounting": table(headings=HEADINGS.replace("run", "mounting")),
    "negative scatter": table(
        headings="temperature,position,stroke,output,std\n",
        cells=[(t, j, k, y, -1e-6) for t, j, k, y, _ in rows()],
    ),
    "wide levels": table(
        headings=WITHOUT_RUN,
        cells=[(20.0 + 0.1 * i, *r[1:4]) for i, r in enumerate(rows())],
    ),
    "a wide level of one run": table(
        headings=WITHOUT_RUN,
        cells=[(20.0 + 0.2 * i, *r[1:4]) for i, r in enumerate(rows("a", (20.0,)))],
    ),
    "bad header": table(header="# T0: warm\n"),
    "truncated": table()[:-9],
    "two tables": table() + table(),
    "empty": "",
    "damaged gzip": gzip.compress(table().encode())[:-20],
}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", WRONG)
def test_wrong_tables_are_left(name, engine):
    assert not taken(WRONG[name], engine)


@pytest.mark.parametrize("engine", ENGINES)
def test_only_the_odd_ones_among_many_are_left(engine):
    texts = [*ORDINARY.values(), *ODD.values(), *WRONG.values()]
    rng = np.random.default_rng(5)
    order = rng.permutation(len(texts))
    contents = [t if isinstance(t, bytes) else t.encode() for t in texts]
    found = read_ordinary([Content("a.csv", contents[i]) for i in order], {}, engine)
    for i, records in zip(order, found, strict=True):
        assert (records is not None) == (i < len(ORDINARY))
        if records is not None:
            assert_same(records, general(contents[i]))


def cells_like(seed=1, **changes):
    """Rows of temperature, position, stroke and output as in `rows`, some of them changed."""
    changed = {"hotter": 0.0, "last": 9, "swap": False, "at": None, **changes}
    cells = [[t + changed["hotter"], j, k, y] for t, j, k, y, _ in rows(seed=seed)]
    cells = [row for row in cells if row[1] <= changed["last"]]
    if changed["swap"]:
        cells[3], cells[4] = cells[4], cells[3]
    if changed["at"] is not None:
        row, column, value = changed["at"]
        cells[row][column] = value
    return cells


NEIGHBOURS = {
    "of the plan": {},
    "hotter": {"hotter": 0.25},
    "another level": {"hotter": 3.0},
    "shorter": {"last": 8},
    "in another order": {"swap": True},
    "another place": {"at": (2, 1, 7)},
    "a marker": {"at": (5, 3, -9999.0)},
    "infinite": {"at": (5, 3, "1e999")},
    "infinitely hot": {"at": (5, 0, "1e999")},
    "no number": {"at": (5, 3, "1.2.3")},
    "no stroke": {"at": (7, 2, "")},
    "half a stroke": {"at": (7, 2, 1.5)},
    "stroke 10": {"at": (7, 2, 10)},
}
TAKEN = {"of the plan", "hotter", "another level", "shorter", "in another order", "stroke 10"}
_SOME = st.lists(st.sampled_from(sorted(NEIGHBOURS)), min_size=1, max_size=9)


@pytest.mark.parametrize("engine", ENGINES)
@settings(max_examples=60, deadline=None)
@given(names=_SOME)
def test_neighbours_change_nothing(engine, names):
    cells = [cells_like(seed=i, **NEIGHBOURS[name]) for i, name in enumerate(names)]
    texts = [table(headings=WITHOUT_RUN, cells=own) for own in cells]
    contents = [Content("a.csv", text.encode()) for text in texts]
    together = read_ordinary(contents, {}, engine)
    for name, content, records in zip(names, contents, together, strict=True):
        assert (records is not None) == (name in TAKEN)
        if records is not None:
            assert_same(records, general(content.data))


@pytest.mark.parametrize("engine", ENGINES)
@settings(max_examples=30, deadline=None)
@given(names=_SOME)
def test_neighbours_in_one_table_change_nothing(engine, names):
    cells = [
        (f"S{i}", *row)
        for i, name in enumerate(names)
        for row in cells_like(seed=i, **NEIGHBOURS[name])
    ]
    text = table(header="# unit: mA\n", headings="serial," + WITHOUT_RUN, cells=cells)
    records = read_ordinary([Content("a.csv", text.encode())], {}, engine)[0]
    if records is not None:
        assert_same(records, general(text.encode()))
    assert (records is not None) == TAKEN.issuperset(names)


@pytest.mark.parametrize("engine", ENGINES)
def test_records_of_one_plan_share_its_arrays(engine):
    texts = [
        table(headings=WITHOUT_RUN, cells=cells_like(seed=seed, hotter=hotter))
        for seed, hotter in ((1, 0.0), (2, 0.0), (3, 0.25))
    ]
    contents = [Content("a.csv", text.encode()) for text in texts]
    one, same, hotter = (own[0] for own in read_ordinary(contents, {}, engine))
    for name in ("angle", "stroke", "position", "run", "mounting"):
        assert getattr(one, name) is getattr(same, name) is getattr(hotter, name)
    assert one.temperature is same.temperature
    assert hotter.temperature[0] == 20.25


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["no number", "no stroke"])
def test_an_odd_table_costs_its_neighbours_one_more_parse(monkeypatch, engine, name):
    parsed = []
    parse = ordinary.parse_cells
    monkeypatch.setattr(ordinary, "parse_cells", lambda *a: (parsed.append(a), parse(*a))[1])
    cells = [cells_like(seed=i, **NEIGHBOURS[name if i == 3 else "of the plan"]) for i in range(8)]
    texts = [table(headings=WITHOUT_RUN, cells=own) for own in cells]
    found = read_ordinary([Content("a.csv", text.encode()) for text in texts], {}, engine)
    assert [records is None for records in found] == [i == 3 for i in range(8)]
    assert len(parsed) == 2


@pytest.mark.parametrize("engine", ENGINES)
def test_minus_zero_is_another_temperature(engine):
    cells = [list(row) for row in rows(temperatures=(0.0, 60.0))]
    plus = table(cells=cells)
    minus = table(cells=[["-0.0" if row[0] == 0.0 else row[0], *row[1:]] for row in cells])
    contents = [Content("a.csv", text.encode()) for text in (plus, minus)]
    signs = [np.signbit(own[0].temperature[0]) for own in read_ordinary(contents, {}, engine)]
    assert signs == [False, True]


@pytest.mark.parametrize("size", [-1, 0, 5, 100_000, 200_000, 300_000])
def test_files_are_read_whole_whatever_their_size_was(tmp_path, size):
    path = tmp_path / "a.csv"
    path.write_bytes(bytes(range(200)) * 1000)
    assert read_bytes(str(path), size) == path.read_bytes()


@pytest.mark.parametrize("engine", ENGINES)
def test_what_the_caller_declares_wins(engine):
    given = {
        "unit": "V",
        "serial": "B7",
        "positions": 8,
        "head_uncertainty": 2e-5,
        "resolution": None,
    }
    assert taken(ORDINARY["as written"], engine, given)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("unit", ["mA", "V"])
@pytest.mark.parametrize("header", ["", "# unit: milliamp\n", "# unit: pt\n"])
@pytest.mark.parametrize("heading", ["output", "output [V],std [V]", "std [mA],output [mA]"])
def test_a_unit_that_is_overridden_is_said(engine, unit, header, heading):
    cells = ["1.3,0.9", "0.9,1.3"] if "std" in heading else ["1.3", "0.9"]
    rows = "".join(f"20,{j},1,{cell}\n" for j, cell in zip((1, 4), cells, strict=True))
    text = f"{header}temperature,position,stroke,{heading}\n{rows}"
    assert taken(text, engine, {"unit": unit})


def test_a_simulated_record_passes_through():
    text = io.StringIO()
    record = accelcal.simulate(seed=4)
    accelcal.write_table(record, text)
    assert read_ordinary([Content("a.csv", text.getvalue().encode())], {})[0] == (record,)


PIECES = st.sampled_from(
    [
        *("\n", "\r", "\t", ",", ";", "#", "# ", ":", " ", '"', "\u00b0", "\ufeff"),
        *("0", "1", "9", "20", "-9999", "-", "+", ".", "e", "_", "nan", "inf", "1e999"),
        *("a", "o-", "run", "T", "# T0: 20\n", "# comment: x\n", "# serial: 5\n", "# a: b \n"),
        *("# sep: ;\n", "# a:\u00a0b\n", "1,1,1,1,1\n"),
    ]
)


@pytest.mark.parametrize("engine", ENGINES)
@settings(max_examples=150, deadline=None)
@given(
    base=st.sampled_from([text for text in ORDINARY.values() if isinstance(text, str)]),
    edits=st.lists(
        st.tuples(st.floats(0.0, 1.0), st.integers(0, 12), PIECES), min_size=1, max_size=3
    ),
    early=st.booleans(),
)
def test_what_is_taken_is_read_equal(engine, base, edits, early):
    for place, length, piece in edits:
        span = min(len(base), 200) if early else len(base)
        at = int(place * span)
        base = base[:at] + piece + base[at + length :]
    content = base.encode()
    records = read_ordinary([Content("a.csv", content)], {}, engine)[0]
    try:
        expected = general(content)
    except InputError:
        assert records is None
        return
    if records is not None:
        assert_same(records, expected)


@pytest.mark.parametrize("engine", ["pyarrow", "pandas"])
def test_serials_of_a_table_that_differ_in_case_alone_are_told(tmp_path, engine, monkeypatch):
    """They were two units without a word."""
    rows = accelcal.simulate(plan=accelcal.TumblePlan(temperatures=(20.0,)), seed=1).to_frame()
    columns = rows[["temperature", "position", "stroke", "output"]]
    both = pd.concat([columns.assign(serial=serial) for serial in ("AL-15", "al-15")])
    both.to_csv(tmp_path / "a.csv", index=False)
    told = "serials 'AL-15', 'al-15' count as 2 units; if they are one, write them in one way"
    assert all(told in record.notes for record in accelcal.read_tables(tmp_path / "a.csv"))
    monkeypatch.setattr("accelcal.io.ordinary.cell_blocks.read_engine", lambda _=None: engine)
    assert accelcal.batch(tmp_path).tables["notes"].str.contains(told).all()
