"""The sheet of a test for the laboratory: what to read in which order, to be filled in."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

from accelcal.accelerometer import AL15
from accelcal.results.designs import TestDesign
from accelcal.simulation import NOISE_FREE, NoiseComponents, TumblePlan, simulate

__all__ = ["COLUMNS", "sheet"]

COLUMNS = ("order", "mounting", "run", "temperature", "stroke", "direction", "angle", "output")
"""Columns of a sheet; the last one is empty."""


_TAKEN_AS_ZERO = "temperature_uncertainty"
"""Where it is not declared: what is declared of it as 0 would not be asked for again."""


def sheet(
    design: TestDesign,
    noise: NoiseComponents | None = None,
    *,
    resolution: float = 0.0,
    reference_temperature: float = AL15.reference_temperature,
) -> str:
    """Write the sheet of a test.

    Parameters
    ----------
    design : TestDesign
        The test.
    noise : NoiseComponents, optional
        Errors of the stand, to be declared in header lines; by default none.
    resolution : float, default 0
        Step of the readings, which is to be declared in the unit of the output [g].
    reference_temperature : float, default 20
        T0 of the forecast [degC].

    Returns
    -------
    str
        CSV with a row for each reading in the order of measuring. With the outputs filled in, it is
        a table that `accelcal.read_table` reads. A second reading at a stop has the number of a
        later stroke in the same direction, as a table has one reading an angle and stroke.
    """
    text = io.StringIO()
    text.write(
        f"# plan: {design.readings} readings in {design.hours:.2f} h; fill in the column output"
    )
    if resolution:
        step = f"{resolution:g} g in the unit of the output"
        text.write(f", and declare the step of the readings, {step}, in a line '# resolution:'")
    text.write("\n")
    text.write(f"# T0: {reference_temperature:g}\n")
    for name, size in (noise.declared() if noise else {}).items():
        if size or name != _TAKEN_AS_ZERO:
            text.write(f"# {name}: {size!r}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows((number, *row, "") for number, row in enumerate(_rows(design), 1))
    return text.getvalue()


def _rows(design: TestDesign) -> Iterator[tuple[str, str, str, int, str, str]]:
    plan = TumblePlan(
        angles=design.angles,
        strokes=design.strokes,
        temperatures=design.temperatures,
        mountings=design.mountings,
    )
    form = simulate(plan=plan, noise=NOISE_FREE, seed=0, declare=False)
    columns = (form.mounting, form.run, form.temperature, form.stroke, form.angle)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    for side, run, level, stroke, angle in rows:
        direction = "forward" if stroke % 2 else "back"
        yield side, form.run_labels[run], f"{level:g}", stroke, direction, repr(angle)
