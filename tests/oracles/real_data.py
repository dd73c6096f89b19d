"""Measured data that are not in this repository: the environment names their folder."""

import os
from pathlib import Path

import pytest


def real_file(*parts):
    """Path of a file in the folder ``ACCELCAL_DATA``; without it the test is skipped."""
    folder = os.environ.get("ACCELCAL_DATA")
    if not folder:
        pytest.skip("ACCELCAL_DATA names no folder of real data")
    path = Path(folder, *parts)
    if not path.exists():
        pytest.skip(f"{'/'.join(parts)} is not in ACCELCAL_DATA")
    return path
