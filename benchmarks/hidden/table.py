"""A finished table: what a laboratory would hand over, and beside it what is true."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from hidden.design import Design, Floats, Ints


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
        Recorded: the level of the run, or the actual one if the design records it [degC].
    actual_temperature : ndarray or None
        Recorded at each reading, None where the level alone is [degC].
    time : ndarray or None
        Recorded, from the first reading [s].
    output : ndarray
        What the voltmeter showed [mA].
    clean, affected : ndarray
        Free of noise, without and with the hidden effects [mA].
    parts : mapping of str to ndarray
        Each hidden effect alone, free of noise, minus `clean` [mA].
    sigma : float
        Standard deviation of the noise of a reading [mA].
    scale : float
        True K1 at T0 [mA/g]; ``output / scale`` is in g.
    covariance : ndarray, shape (n, n)
        True covariance of the noise, head and launches among it [mA^2].
    tangent : ndarray, shape (n, p)
        Change of `clean` by each coefficient of the base model, laws among them.
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

    @property
    def s(self) -> float:
        """The largest effect on a reading over the standard deviation of a reading."""
        raise NotImplementedError

    def noncentrality(self) -> float:
        """q: norm of the effect, whitened, after the base model is projected out."""
        raise NotImplementedError

    def write(self, path: str | Path) -> None:
        """Write the long CSV with its header lines."""
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            csv.writer(file)
        raise NotImplementedError
