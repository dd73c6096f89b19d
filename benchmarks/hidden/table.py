"""A finished table: what a laboratory would hand over, and beside it what is true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hidden.clock import Session
from hidden.design import Design, Floats, Ints
from hidden.noise import RESOLUTION, SIGMA, Regime
from hidden.visibility import base_directions, noncentrality
from hidden.world import World, observe


@dataclass(frozen=True, eq=False)
class Table:
    """Readings in the order in which they were taken; arrays of shape (n,).

    Attributes
    ----------
    design : Design
        The plan.
    header : mapping of str to str
        Header lines: unit, T0, positions, and the declared uncertainties if any.
    angle : ndarray
        Nominal [deg].
    position, stroke, run : ndarray of int
        From 1.
    temperature : ndarray
        Recorded: the level of the run, or of each reading if the design records it [degC].
    actual_temperature : ndarray or None
        Recorded at each reading, None where the level alone is [degC].
    time : ndarray or None
        Recorded, from the first reading [s].
    output : ndarray
        What the voltmeter showed [mA].
    clean, affected : ndarray
        Free of noise, without and with the hidden effects [mA].
    parts : mapping of str to ndarray
        What each hidden effect alone adds to `clean` [mA].
    sigma : float
        Standard deviation of the noise of a reading [mA].
    scale : float
        True K1 at T0 [mA/g]; ``output / scale`` is in g.
    """

    design: Design
    header: Mapping[str, str]
    angle: Floats
    position: Ints
    stroke: Ints
    run: Ints
    temperature: Floats
    actual_temperature: Floats | None
    time: Floats | None
    output: Floats
    clean: Floats
    affected: Floats
    parts: Mapping[str, Floats]
    sigma: float
    scale: float
    world: World = field(repr=False)
    session: Session = field(repr=False)
    regime: Regime = field(repr=False)

    @property
    def effect(self) -> Floats:
        """What all hidden effects add to the readings [mA]."""
        return self.affected - self.clean

    @property
    def s(self) -> float:
        """The largest effect on a reading over the standard deviation of a reading."""
        return float(np.abs(self.effect).max()) / self.sigma

    def base_directions(self) -> Floats:
        """How readings change with each coefficient of the base model, shape (n, p)."""
        return base_directions(self.world, self.session)

    def covariance(self) -> Floats:
        """Of noise, head and launches as they truly are, shape (n, n) [mA^2]."""
        return self.regime.covariance(self.world, self.session)

    def noncentrality(self, part: str | None = None) -> float:
        """The q of all hidden effects or of one: whitened, behind the base model, its norm."""
        effect = self.effect if part is None else self.parts[part]
        return noncentrality(effect, self.base_directions(), self.covariance())

    def write(self, path: str | Path) -> None:
        """Write the long CSV with its header lines."""
        where = (self.angle, "angle") if self.design.angles else (self.position, "position")
        columns = {"temperature": self.temperature, "run": self.run, where[1]: where[0]}
        columns["stroke"] = self.stroke
        if self.time is not None:
            columns["time"] = self.time
        columns["output"] = self.output
        digits = [
            [f"{value:.12g}" for value in np.asarray(column).tolist()]
            for column in columns.values()
        ]
        lines = [f"# {key}: {value}" for key, value in self.header.items()]
        lines += [",".join(columns), *(",".join(row) for row in zip(*digits, strict=True))]
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def record(
    session: Session,
    clean: World,
    altered: World,
    parts: Mapping[str, Floats],
    regime: Regime,
    rng: np.random.Generator,
) -> Table:
    """Take the readings of an altered world with all that scatters, and write them down."""
    design, plan, read = session.design, session.design.sequence, session.read
    sigma = SIGMA * clean.sensor.scale
    real = regime.disturbed(altered, session, rng)
    real = real.having("readout", resolution=max(real.readout.resolution, RESOLUTION))
    shown = real.chamber.shown(session)[read]
    return Table(
        design=design,
        header=_header(design, regime),
        angle=plan.angle,
        position=plan.position,
        stroke=plan.stroke,
        run=plan.run,
        temperature=shown if design.actual_temperature else plan.level,
        actual_temperature=shown if design.actual_temperature else None,
        time=session.time[read] if design.time else None,
        output=observe(real, session, sigma * regime.scatter(session, rng)),
        clean=observe(clean, session),
        affected=observe(altered, session),
        parts=parts,
        sigma=sigma,
        scale=clean.sensor.scale,
        world=clean,
        session=session,
        regime=regime,
    )


def _header(design: Design, regime: Regime) -> dict[str, str]:
    header = {"unit": "mA", "T0": f"{design.reference:g}", "positions": f"{design.positions}"}
    if not design.declared:
        return header
    header["head_uncertainty"] = f"{regime.head:g}"
    if regime.launch_declared:
        header["launch_uncertainty"] = f"{regime.launch:g}"
        header["launch_sf_uncertainty"] = f"{regime.launch_gain:g}"
    return header | {"temperature_uncertainty": "0", "resolution": f"{RESOLUTION:g}"}
