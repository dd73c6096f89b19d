"""Names that no encoding has: a foreign byte of a file name is shown, never a lone surrogate."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import io
import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hidden.clampings import units_on_one_head

import accelcal
from accelcal import TumblePlan
from accelcal.certificate.dcc import certificate
from accelcal.cli.main import main
from accelcal.error_budget.budget import budget
from accelcal.io.stability_record import read_stability
from accelcal.io.toml.laboratory import Laboratory
from accelcal.results.documents.json_text import json_text, parse_json
from accelcal.stability.analysis import analyse

EXAMPLES = Path(__file__).parents[1] / "examples"
NAME = "M\udcfcller\x1b"
SHOWN = r"M\xfcller\x1b"


def renamed(found, date=None):
    named = {"serial": NAME, "source": f"{NAME}.csv"}
    if date is not None:
        named |= {"date": date, "metadata": {NAME: NAME}}
    return dataclasses.replace(found, **named)


def simulated(seed=1, date="2024-05-31"):
    plan = TumblePlan(temperatures=20.0, strokes=4)
    return renamed(accelcal.simulate(plan=plan, seed=seed), date)


@functools.cache
def calibration():
    return accelcal.fit(simulated())


def on_one_head():
    _, (unit,) = units_on_one_head(np.random.default_rng(12), units=1)
    return renamed(accelcal.read_table(io.StringIO(unit.text)))


RESULTS = {
    "calibration": calibration,
    "comparison": lambda: accelcal.compare(calibration(), simulated(2)),
    "discovery": lambda: accelcal.discover(simulated()),
    "stand": lambda: accelcal.discover_stand(
        [simulated(), dataclasses.replace(simulated(2), serial="B")]
    ),
    "head": lambda: accelcal.calibrate_head(on_one_head()),
    "triad": lambda: accelcal.calibrate_triad(renamed(accelcal.read_triad(EXAMPLES / "triad.csv"))),
    "stability": lambda: analyse(renamed(read_stability(EXAMPLES / "stability.csv"))),
    "budget": lambda: budget(calibration(), [0.0, 1.0]),
    "stand budget": lambda: accelcal.stand_budget(
        dataclasses.replace(accelcal.read_stand(EXAMPLES / "paper-stand.toml"), name=NAME),
        simulated(),
    ),
    "history": lambda: accelcal.history(
        [accelcal.fit(simulated(year, date=f"{2000 + year}-05-31")) for year in range(1, 5)]
    ),
}


@functools.cache
def result(kind):
    return RESULTS[kind]()


@pytest.mark.parametrize("kind", RESULTS)
@pytest.mark.parametrize("write", [str, repr])
def test_a_result_can_be_printed(kind, write):
    text = write(result(kind))
    assert text.encode()
    assert all(line.isprintable() for line in text.splitlines())


@pytest.mark.parametrize("kind", RESULTS)
def test_a_document_is_json_for_strict_readers(kind, tmp_path):
    result(kind).to_json(tmp_path / "r.json")
    text = result(kind).to_json()
    assert json.dumps(json.loads(text), ensure_ascii=False).encode()
    assert (tmp_path / "r.json").read_bytes() == text.encode()


@pytest.mark.parametrize("kind", ["calibration", "discovery", "head", "triad"])
def test_a_document_of_such_a_name_is_read_back(kind):
    text = result(kind).to_json()
    again = type(result(kind)).from_json(text)
    assert again.source == "M\\xfcller\x1b.csv" or kind == "discovery"
    assert again.to_json() == text


def test_escapes_in_capitals_are_read():
    assert parse_json(r'["\uDCFF", "\uD83D\uDE00"]') == [r"\xff", "\U0001f600"]


def test_documents_of_before_are_read():
    text = json.dumps({"\udcff": ["\udcfe", 1, "\U0001f600", r"\udcff"]})
    assert parse_json(text) == {r"\xff": [r"\xfe", 1, "\U0001f600", r"\udcff"]}


def test_letters_beyond_two_bytes_stay():
    assert json.loads(json_text({"a": "\U0001f600\udcff", "b": np.float64(0.1)})) == {
        "a": "\U0001f600\\xff",
        "b": 0.1,
    }


def test_a_refusal_is_a_line_that_can_be_printed():
    with pytest.raises(accelcal.InputError) as refused:
        accelcal.history([accelcal.fit(simulated(date="some\nday"))])
    line = str(refused.value)
    assert line.encode()
    assert line.isprintable()
    assert rf"serial {SHOWN}: 1 of 1 tables have no date that can be read" in line


def test_a_certificate_holds_no_control_character():
    text = certificate(calibration(), Laboratory(performed_from="2024-05-31"))
    assert SHOWN in "".join(ElementTree.fromstring(text.encode()).itertext())


@pytest.mark.parametrize("command", ["fit", "check", "discover"])
def test_the_documents_of_commands_are_strict(command, tmp_path, capsys):
    path = tmp_path / "M\udcfcller.csv"
    with contextlib.suppress(UnicodeEncodeError, OSError):
        path.write_bytes((EXAMPLES / "al15.csv").read_bytes())
    if not path.is_file():
        pytest.skip("names are Unicode there")
    assert main([command, str(path), "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["source"].endswith(r"M\xfcller.csv")
    assert json.dumps(document, ensure_ascii=False).encode()
