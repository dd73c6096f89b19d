"""The paper reproduced: each of its figures lies in the interval that accelcal finds."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "examples" / "al15" / "paper.py"


def test_every_figure_of_the_paper_is_held(tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("allantools")
    done = subprocess.run(
        [sys.executable, SCRIPT, tmp_path], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    rows = re.findall(r"^(\S.*?) +[-\d.]+ +[-\d.]+ +[-\d.]+ \.\. ", done.stdout, re.MULTILINE)
    assert len(rows) == 13
    assert "outside" not in done.stdout
    for name in ("figure3.png", "figure4.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
