"""Runs without a column run: a level of temperature that is met again is another run."""

import io
import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from accelcal.errors import TableError
from accelcal.io.tables import read_table
from accelcal.io.writer import write_table

HEADINGS = "temperature,position,stroke,output"
PLACES = range(1, 10)


def visit(temperature, strokes, bias=0.0, places=PLACES):
    """Rows of one visit, in the order of measuring."""
    return [
        (
            temperature,
            place,
            stroke,
            round(np.cos((place - 1) * np.pi / 4) + bias + stroke / 1e3, 9),
        )
        for stroke in strokes
        for place in (places if stroke % 2 else reversed(places))
    ]


def read(rows, headings=HEADINGS):
    lines = [headings, *(",".join(str(cell) for cell in row) for row in rows)]
    return read_table(io.StringIO("\n".join(lines) + "\n"))


def sizes(record):
    """Readings of each run, in the order of the runs."""
    counts = np.bincount(record.run).tolist()
    return dict(zip(record.run_labels, counts, strict=True))


FIRST, HOT = visit(20, (1, 2)), visit(80, (1, 2))


@pytest.mark.parametrize(
    "again", [visit(20, (3, 4)), visit(20, (1, 2), 1e-4)], ids=["go on", "restart"]
)
def test_a_level_met_again_is_a_run_of_its_own(again):
    record = read(FIRST + HOT + again)
    assert sizes(record) == {"20": 18, "80": 18, "20 (2)": 18}
    assert record.run.tolist() == [0] * 18 + [1] * 18 + [2] * 18
    assert record.notes == ("a temperature was met again (line 38): a new run there, '20 (2)'",)


def test_all_levels_met_again_may_be_those_of_another_accelerometer():
    """Units below each other, told apart by a column Prüfling that is not known, became one."""
    record = read(FIRST + HOT + visit(20, (1, 2), 1e-4) + visit(80, (1, 2), 1e-4))
    (note,) = record.notes
    assert note.endswith("; if that is another accelerometer, name it in a column serial")


def test_strokes_that_count_through_the_whole_test():
    record = read(visit(20, (1, 2)) + visit(80, (3, 4)) + visit(20, (5, 6)))
    assert sizes(record) == {"20": 18, "80": 18, "20 (2)": 18}


def test_wide_table_of_a_level_met_again():
    def wide(rows):
        return [
            (rows[i][0], place, *(r[3] for r in rows if r[1] == place))
            for i, place in enumerate(PLACES)
        ]

    rows = wide(FIRST) + wide(HOT) + wide(visit(20, (1, 2), 1e-4))
    assert sizes(read(rows, "T,J,Y1,Y2")) == {"20": 18, "80": 18, "20 (2)": 18}


def test_a_third_visit():
    record = read(FIRST + HOT + visit(20, (3,)) + visit(80, (3,)) + visit(20, (4,)))
    assert list(sizes(record)) == ["20", "80", "20 (2)", "80 (2)", "20 (3)"]


def test_readings_without_temperature_complete_the_strokes_around_them():
    """Those of all levels made one run, and there were no temperature laws."""
    rows = FIRST + HOT
    for at in (0, 4, 20, 21, len(rows) - 1):
        rows = [("unknown" if i == at else row[0], *row[1:]) for i, row in enumerate(rows)]
    record = read(rows)
    assert sizes(record) == {"20": 18, "80": 18}
    assert np.isnan(record.temperature).sum() == 5
    assert record.notes == (
        "temperature missing in 5 readings, taken to the level of the rows around"
        " (lines 2, 6, 22, 23, 37)",
    )
    one = read([("unknown", *FIRST[0][1:]), *FIRST[1:], *HOT])
    assert one.notes == (
        "temperature missing in 1 reading, taken to the level of the rows around (line 2)",
    )


def test_a_stroke_without_temperature_between_others_is_theirs():
    """It was a run of its own, with coefficients from nine readings and a shift between the two."""
    rows = [("unknown", *row[1:]) if row[2] == 2 else row for row in visit(20, (1, 2, 3))]
    record = read(rows + HOT)
    assert sizes(record) == {"20": 27, "80": 18}
    assert record.notes[0].startswith("temperature missing in 9 readings, taken to the level")
    rows = [("unknown", *row[1:]) if row[2] in (2, 3) else row for row in visit(20, (1, 2, 3, 4))]
    assert sizes(read(rows)) == {"20": 18, "unknown": 18}  # another visit may lie in between


def test_readings_without_temperature_that_come_again_are_a_run_of_their_own():
    unknown = [("unknown", *row[1:]) for row in visit(50, (1, 2), 1e-4)]
    for rows in (FIRST + unknown + HOT, FIRST + HOT + unknown):
        record = read(rows)
        assert sizes(record)["unknown"] == 18
        assert record.notes[0].startswith(
            "temperature missing in 18 readings, taken as a run apart"
        )
    (alone,) = visit(0, (9,), places=(2,))
    record = read([*FIRST[:9], ("unknown", *alone[1:]), *FIRST[9:]])
    assert record.notes[0].startswith("temperature missing in 1 reading, taken as a run apart")
    with pytest.raises(TableError, match="stroke 1 at unknown temperature has output"):
        read([("unknown", *row[1:]) for row in FIRST + visit(20, (1, 2), 1e-4)])


def test_unknown_temperatures_interrupt_no_level():
    unknown = [("unknown", *row[1:]) for row in visit(0, (9,), places=(2, 3))]
    record = read(FIRST[:9] + unknown + FIRST[9:])
    assert sizes(record) == {"20": 18, "unknown": 2}


def test_a_level_just_below_zero_is_called_zero():
    assert list(sizes(read(visit(-0.2, (9,))))) == ["0"]


def test_missing_readings_do_not_hide_a_visit():
    again = [row for row in visit(20, (3, 4)) if row[1] not in (3, 7)]
    assert sizes(read(FIRST + HOT + again))["20 (2)"] == 14


# -- sorted tables ---------------------------------------------------------------------------------

SORTED = FIRST + HOT


@pytest.mark.parametrize("columns", [*itertools.permutations((0, 1, 2))], ids=str)
@pytest.mark.parametrize("falling", [False, True])
def test_a_sorted_table_is_not_split(columns, falling):
    rows = sorted(SORTED, key=lambda row: [row[i] for i in columns], reverse=falling)
    record = read(rows)
    assert sizes(record) == {"20": 18, "80": 18}
    told = [note for note in record.notes if "name each visit in a column run" in note]
    assert len(told) == (columns[0] != 0)


def test_a_level_that_stands_apart_only_once_more_is_said():
    one = [(20, 1, 3, 0.5)]
    record = read(FIRST + HOT + one)
    assert sizes(record) == {"20": 19, "80": 18}
    assert record.notes == (
        "other temperatures stand between the rows of level 20 degC, which were taken as one run;"
        " if it was met again, name each visit in a column run",
    )


def test_rows_written_twice_are_no_visit():
    record = read(FIRST + HOT + FIRST)
    assert sizes(record) == {"20": 18, "80": 18}
    assert len(record.notes) == 1
    assert record.notes[0].startswith("18 repeated readings were left out")


def test_other_mountings_are_other_runs():
    """A unit that is mounted anew is launched anew: discover took such shifts for a bias step."""
    rows = [(*row, side) for side in ("o+", "o-") for row in SORTED]
    expected = {"20 o+": 18, "20 o-": 18, "80 o+": 18, "80 o-": 18}
    record = read(rows, HEADINGS + ",mounting")
    assert sizes(record) == expected
    assert (len(record.tables()), record.notes) == (4, ())
    hot_alone = [row for row in rows if row[0] == 20 or row[-1] == "o+"]
    found = sizes(read(hot_alone, HEADINGS + ",mounting"))
    assert found == {"20 o+": 18, "20 o-": 18, "80": 18}
    named = [(*row, "a") for row in rows if row[0] == 20]
    assert sizes(read(named, HEADINGS + ",mounting,run")) == {"a": 36}


# -- time ------------------------------------------------------------------------------------------


def timed(rows, step=60):
    return [(*row, step * i) for i, row in enumerate(rows)]


@pytest.mark.parametrize("columns", [(0, 4), (1, 0, 4), (2, 0, 4), (4,), (3,)], ids=str)
def test_time_proves_a_visit_in_a_table_sorted_in_any_way(columns):
    rows = timed(FIRST + HOT + visit(20, (3, 4)))
    rows.sort(key=lambda row: [row[i] for i in columns])
    record = read(rows, HEADINGS + ",time")
    assert sizes(record) == {"20": 18, "80": 18, "20 (2)": 18}
    assert (np.diff(record.run[np.argsort(record.time)]) >= 0).all()


def test_time_as_a_date():
    rows = [
        (*row, f"2024-05-31T10:{i // 60:02d}:{i % 60:02d}")
        for i, row in enumerate(FIRST + HOT + visit(20, (2,), 1e-4))
    ]
    assert sizes(read(rows, HEADINGS + ",time")) == {"20": 18, "80": 18, "20 (2)": 9}


@pytest.mark.parametrize("step", [60, 7])
def test_time_that_counts_from_zero_in_each_run(step):
    rows = timed(FIRST) + timed(HOT, step)
    assert sizes(read(rows, HEADINGS + ",time")) == {"20": 18, "80": 18}
    again = timed(visit(20, (3, 4)), 60)
    assert sizes(read(rows + again, HEADINGS + ",time")) == {"20": 18, "80": 18, "20 (2)": 18}


# -- levels ----------------------------------------------------------------------------------------


def test_levels_that_lie_close_together():
    rows = [row for level in (20, 21.5, 23, 24.5) for row in visit(level, (1,))]
    record = read(rows + visit(80, (1,)) + visit(81.2, (2,)))
    assert sizes(record) == {"20": 9, "21.5": 9, "23": 9, "24.5": 9, "80.6": 18}
    assert record.notes == (
        "levels 20, 21.5, 23, 24.5 degC lie close together and were taken as a run each",
    )


def test_levels_that_run_into_one_another():
    rows = [(20 + 0.3 * i, *row[1:]) for i, row in enumerate(visit(0, (1,)))]
    with pytest.raises(TableError) as caught:
        read(rows)
    assert str(caught.value) == (
        "<table>:9: temperature 22.1 joins the level that starts at 20 degC, more than 2 degC away;"
        " tell the runs apart by a column run"
    )
    named = [(*row, "a") for row in rows]
    assert sizes(read(named, HEADINGS + ",run")) == {"a": 9}


def test_a_level_that_is_too_wide_is_told_by_its_own_temperatures():
    """Two runs drift by 2.4 degC: a temperature of one does not join the level of the other."""
    both = [(low + 0.3 * i, *row[1:]) for low in (20, -40) for i, row in enumerate(visit(0, (1,)))]
    with pytest.raises(TableError, match=r"temperature -37\.9 joins the level that starts at -40 "):
        read(both)


# -- any sequence of visits ------------------------------------------------------------------------


@st.composite
def visits(draw):
    """Rows of visits in the order of measuring, and the run of each."""
    levels = draw(st.lists(st.sampled_from([-40, 20, 80]), min_size=1, max_size=6))
    levels = [level for level, _ in itertools.groupby(levels)]
    on = dict.fromkeys(levels, 0)
    rows = []
    for number, level in enumerate(levels):
        first = on[level] + 1 if draw(st.booleans()) else 1
        strokes = range(first, first + draw(st.integers(2, 3)))
        on[level] = strokes[-1]
        scatter = draw(st.sampled_from([0.0, 0.2]))
        rows += [
            (level + scatter * (i % 3), *row[1:], number)
            for i, row in enumerate(visit(level, strokes, 1e-4 * number))
        ]
    return rows


@given(visits())
def test_any_sequence_of_visits(rows):
    record = read([row[:4] for row in rows])
    assert record.run.tolist() == [row[4] for row in rows]


def named(rows, start, label):
    """The rows with a column time and run."""
    return [(*row, start + 60 * n, label) for n, row in enumerate(rows)]


@pytest.mark.parametrize("seed", range(5))
def test_named_runs_are_in_the_order_of_their_times(seed):
    """They were in that of their rows, which may be in any order."""
    rows = named(FIRST, 0, "first") + named(HOT, 9000, "hot") + named(FIRST, 20_000, "last")
    shuffled = np.random.default_rng(seed).permutation(len(rows))
    record = read([rows[place] for place in shuffled], HEADINGS + ",time,run")
    assert record.run_labels == ("first", "hot", "last")
    buffer = io.StringIO()
    write_table(replace(record, run=2 - record.run, run_labels=record.run_labels[::-1]), buffer)
    buffer.seek(0)
    assert read_table(buffer).run_labels == ("last", "hot", "first")


@pytest.mark.parametrize("start", [0, 30, 540])
def test_named_runs_whose_times_begin_anew_are_in_the_order_of_their_rows(start):
    record = read(named(HOT, start, "b") + named(FIRST, 0, "a"), HEADINGS + ",time,run")
    assert record.run_labels == ("b", "a")


def test_numbered_runs_of_a_sorted_table_are_in_the_order_of_their_numbers():
    """Whether a run was heated or cooled followed from the order in which a table was sorted."""
    rows = [
        (*row, run) for run, t in enumerate((20, 80, 20, -40, 20), 1) for row in visit(t, (1, 2))
    ]
    record = read(sorted(rows), HEADINGS + ",run")
    assert record.run_labels == ("1", "2", "3", "4", "5")
    assert [record.temperature[record.run == run][0] for run in range(5)] == [20, 80, 20, -40, 20]
    buffer = io.StringIO()
    write_table(replace(record, run=4 - record.run, run_labels=record.run_labels[::-1]), buffer)
    buffer.seek(0)
    assert read_table(buffer).run_labels == ("5", "4", "3", "2", "1")


@pytest.mark.parametrize("labels", [("80", "20"), ("3", "1"), ("2b", "1b"), ("9" * 20, "1")])
def test_runs_whose_labels_do_not_count_are_in_the_order_of_their_rows(labels):
    rows = [(*row, label) for label in labels for row in FIRST]
    assert read(rows, HEADINGS + ",run").run_labels == labels


def test_another_order_of_the_runs_than_that_of_the_rows_is_told():
    """A table sorted by temperature had its runs in another order, and nothing said so."""
    rows = [(*row, run) for run, at in ((3, 60), (1, 20), (2, -40)) for row in visit(at, (1, 2))]
    told = "the runs are in the order of their {}, not of the rows: {}"
    assert read(rows, HEADINGS + ",run").notes == (told.format("numbers", "1, 2 and 3"),)
    timed = [(*row[:4], "abc"[row[4] - 1], 1000 * row[4] + i) for i, row in enumerate(rows)]
    assert read(timed, HEADINGS + ",run,time").notes == (told.format("times", "a, b and c"),)
    assert read(sorted(rows, key=lambda row: row[4]), HEADINGS + ",run").notes == ()
