"""The light engine and the one on pandas give the same records and the same errors."""

from __future__ import annotations

import io

import pytest

from accelcal.errors import TableError
from accelcal.io import engines, tables
from accelcal.io.engines import BulkEngineGivesUp, columns_by_pandas, columns_by_split
from accelcal.io.files.text import read_text
from accelcal.io.layout.parts import read_layout
from accelcal.io.tables import read_tables

HEADINGS = "temperature,position,stroke,output,run,mounting,time,std\n"
ROWS = [
    f"{20 + i % 3 / 10},{i % 9 + 1},{i // 9 + 1},{1.3 - i / 7!r},level {i // 27},o-,{i * 60}.5,1e-6"
    for i in range(54)
]
LONG = HEADINGS + "\n".join(ROWS) + "\n"
WIDE = "T,J,Y1,Y2\n20,1,1.1,1.2\n20,2,NA,0.7\n20,3,,\n20,4,-1,-1.5\n"
DATED = "serial,T,J,k,Y,time\nA,20,1,1,1,2024-05-31\nB,20,1,1,2,2024-06-01\nA,20,2,1,3,2024-06-02\n"

READ_BY_BOTH = {
    "long": LONG,
    "semicolon, decimal comma": LONG.replace(",", ";").replace(".", ","),
    "tab": LONG.replace(",", "\t"),
    "blanks behind commas": LONG.replace(",", ", "),
    "blank lines": LONG.replace("\n", "\n\n,,\n"),
    "wide": WIDE,
    "dates and serials": DATED,
    "dates and clock times": "date,time,T,J,k,Y\n1.6.2024,9:30,20,1,1,1\n2.6.2024,0:01,20,5,1,-1\n",
    "clock times": "time,T,J,k,Y\n23:59,20,1,1,1\n00:01,20,5,1,-1\n",
    "missing readings": LONG.replace(ROWS[3], "20,4,1,NA,level 0,o-,1,"),
    "repeated": LONG + ROWS[5] + "\n",
    "unknown column": LONG.replace(",std", ",remark"),
    "header": "# temperature: 25\n# std: 0.1\n# positions: 12\n" + LONG,
    "digits": LONG.replace("1.3", "1.29999999999999982236431605997495353221893310546875"),
}
READ_BY_LIGHT = {
    "wide, short rows": WIDE.replace(",,", ""),
    "trailing blank fields": LONG.replace("\n", ",,,,\n"),
    "quotes": LONG.replace("level 0", '"level 0"'),
    "blanks": LONG.replace("level ", "").replace(",", " "),
    "unicode minus": LONG.replace("-", "\u2212"),
    "unit in cells": "T,J,Y1,Y2\n20,1,1.1 mA,1.2 mA\n20,5,,-1 mA\n",
    "unknown temperature": LONG.replace("20.1", "unknown"),
}
REFUSED = {
    "text": LONG.replace("1e-6", "small", 1),
    "infinite": LONG + "20,1,9,inf,a,o,1,1\n",
    "overflow": LONG + "20,1,9,1e999,a,o,1,1\n",
    "underscore": LONG + "20,1,9,1_0,a,o,1,1\n",
    "position": LONG + "20,10,9,1,a,o,1,1\n",
    "stroke": LONG + "20,1,0,1,a,o,1,1\n",
    "half a stroke": LONG + "20,1,1.5,1,a,o,1,1\n",
    "temperature": LONG + ",1,9,1,a,o,1,1\n",
    "position missing": LONG + "20,,9,1,a,o,1,1\n",
    "fields": LONG + "20,1,9,1,a,o,1,1,1\n",
    "short": LONG + "20,1,9\n",
    "twice": LONG + "20,6,1,9.75,level 0,o-,1,1\n",
    "decimal marks": LONG.replace(",", ";") + "20;1;9;1,5;a;o;1;1\n",
    "thousands": LONG.replace(",", ";") + "20;1;9;1,234.5;a;o;1;1\n",
    "mounting": LONG + "20,1,9,1,a,x,1,1\n",
    "run": LONG + "20,1,9,1,,o,1,1\n",
    "time": LONG + "20,1,9,1,a,o,,1\n",
    "std": LONG + "20,1,9,1,a,o,1,-1\n",
}


def by_engine(engine, text):
    source = read_text(io.StringIO(text))
    form, records = tables._read_by(engine, source, read_layout(source), {})
    records = tuple(records)
    return form, records, [record.notes for record in records], [list(r.line) for r in records]


@pytest.mark.parametrize("name", READ_BY_BOTH)
def test_both_engines_read_the_same(name):
    text = READ_BY_BOTH[name]
    assert by_engine(columns_by_pandas, text) == by_engine(columns_by_split, text)


@pytest.mark.parametrize("name", READ_BY_LIGHT)
def test_what_only_the_light_engine_reads(name, monkeypatch):
    text = READ_BY_LIGHT[name]
    with pytest.raises((BulkEngineGivesUp, TableError)):
        by_engine(columns_by_pandas, text)
    expected = read_tables(io.StringIO(text))
    monkeypatch.setattr(engines, "BULK_CHARACTERS", 0)
    assert read_tables(io.StringIO(text)) == expected


@pytest.mark.parametrize("name", REFUSED)
def test_both_engines_refuse_with_the_same_line(name, monkeypatch):
    with pytest.raises(TableError) as light:
        read_tables(io.StringIO(REFUSED[name]))
    monkeypatch.setattr(engines, "BULK_CHARACTERS", 0)
    with pytest.raises(TableError) as bulk:
        read_tables(io.StringIO(REFUSED[name]))
    assert str(bulk.value) == str(light.value)
    with pytest.raises((BulkEngineGivesUp, TableError)):
        by_engine(columns_by_pandas, REFUSED[name])


def test_a_large_table_is_read_by_pandas(monkeypatch):
    used = []

    def engine(*arguments):
        used.append(arguments)
        return columns_by_pandas(*arguments)

    monkeypatch.setattr(engines, "columns_by_pandas", engine)
    wide = "\n".join(f"20,{i % 9 + 1},{i // 9 + 1},{2 * i}.{'0' * 60}" for i in range(40000))
    (record,) = read_tables(io.StringIO("T,J,k,Y\n" + wide))
    assert len(record) == 40000
    assert len(used) == 1


@pytest.mark.parametrize("name", ["twice", "one output", "levels", "runs"])
def test_an_error_of_readings_that_are_understood_needs_no_light_engine(name, monkeypatch):
    """A stream of raw samples, ten million rows of one reading, was split once more to say so."""
    text = {
        "twice": REFUSED["twice"],
        "one output": "T,J,k,Y\n20,1,1,1\n20,5,1,1\n",
        "levels": "T,J,k,Y\n20,1,1,1\n20.9,5,1,2\n21.8,5,2,3\n22.7,1,2,2\n",
        "runs": "# runs: a\n" + LONG,
    }[name]
    with pytest.raises(TableError) as light:
        read_tables(io.StringIO(text))
    monkeypatch.setattr(engines, "BULK_CHARACTERS", 0)
    monkeypatch.setattr(engines, "columns_by_split", None)
    with pytest.raises(TableError) as bulk:
        read_tables(io.StringIO(text))
    assert str(bulk.value) == str(light.value)
