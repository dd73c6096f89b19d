"""A calibration tells where its readings came from and what was asked."""

import hashlib
import io
import sys
from pathlib import Path

import pytest

import accelcal
from accelcal.io.files import text

EXAMPLE = Path(__file__).parents[1] / "examples" / "al15.csv"


def test_the_file_and_the_options_are_recorded():
    found = accelcal.fit(accelcal.read_table(EXAMPLE), coefficients=("K1", "K0")).provenance
    assert found["sha256"] == hashlib.sha256(EXAMPLE.read_bytes()).hexdigest()
    assert found["metadata"] == {"simulated": "seed 15"}
    assert found["declared"]["head_uncertainty"] == 6.7e-6
    assert found["options"]["coefficients"] == ("K0", "K1")
    assert found["options"]["temperature_laws"] == "tables"


def test_an_option_that_wins_over_the_header_is_what_was_declared():
    record = accelcal.read_table(EXAMPLE, overrides={"head_uncertainty": 1e-5})
    assert accelcal.fit(record).provenance["declared"]["head_uncertainty"] == 1e-5


def test_text_has_no_digest():
    record = accelcal.read_table(io.StringIO(EXAMPLE.read_text("utf-8")))
    assert accelcal.fit(record).provenance["sha256"] is None


def test_a_document_without_provenance_is_read():
    calibration = accelcal.fit(accelcal.read_table(EXAMPLE))
    document = calibration.to_document()
    del document["provenance"]
    assert accelcal.Calibration.from_document(document).provenance == {}
    assert accelcal.Calibration.from_document(calibration.to_document()) == calibration


def test_a_discovery_names_its_file():
    found = accelcal.discover(accelcal.read_table(EXAMPLE))
    assert found.sha256 == hashlib.sha256(EXAMPLE.read_bytes()).hexdigest()
    assert accelcal.Discovery.from_document(found.to_document()) == found


# -- digest ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [0, 1, 9000, 600_000])
@pytest.mark.parametrize("loaded", [True, False])
@pytest.mark.parametrize("alone", [text._ALONE, "no_such_module"])
def test_the_digest_is_that_of_hashlib(monkeypatch, size, loaded, alone):
    data = bytes(range(256)) * (size // 256) + b"x" * (size % 256)
    expected = hashlib.sha256(data).hexdigest()
    monkeypatch.setattr(text, "_ALONE", alone)
    if not loaded:
        monkeypatch.delitem(sys.modules, "hashlib")
    assert text.sha256_of(data) == expected
