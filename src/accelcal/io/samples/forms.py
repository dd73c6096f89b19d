"""Forms of a stream of samples: that of one accelerometer, or of several, and that of a triad."""

from __future__ import annotations

from typing import NamedTuple

from accelcal.arguments.axes import AXES
from accelcal.io.layout.separators import Recognise
from accelcal.io.triad import triad_heading
from accelcal.io.words.headings import Heading, read_heading, split_unit

ACROSS_AXES = ("a_p", "a_o")
"""Accelerations across the input axis of one accelerometer."""


class StreamForm(NamedTuple):
    """What the columns of a stream are."""

    recognise: Recognise
    outputs: tuple[str, ...]  # roles of the columns of outputs
    remedy: str  # what the headings should be

    @property
    def roles(self) -> tuple[str, ...]:
        """Roles of the columns that are used, or refused."""
        return (*self.outputs, "temperature", "time", *ACROSS_AXES, "serial", "unit")


def _of_accelerometer(text: str) -> Heading:
    name, unit = split_unit(text.strip())
    known = read_heading(text)
    role = name.casefold() if name.casefold() in ACROSS_AXES else known.role
    used = role if role in (*ONE_ACCELEROMETER.roles, "serials") else None
    return Heading(text, used, known.unit or unit or None, known.of if used == "serials" else None)


def _of_triad(text: str) -> Heading:
    own, known = triad_heading(text), read_heading(text)
    if own.role in (*TRIAD.outputs, "temperature"):
        return own
    return known if known.role in ("time", "serial", "unit") else Heading(text, None)


ONE_ACCELEROMETER = StreamForm(
    _of_accelerometer,
    ("output",),
    "name the columns in the first row: output, and temperature where it is known",
)

TRIAD = StreamForm(
    _of_triad,
    tuple(AXES),
    "name the columns of the channels in the first row: x, y, z, as the calibration has them",
)
