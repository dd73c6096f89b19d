"""Reader of the NIST Statistical Reference Datasets in the folder beside this file."""

import re
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent / "nist_strd"
DEGREE = {"Norris": 1, "Pontius": 2, "Filip": 10} | {f"Wampler{i}": 5 for i in range(1, 6)}


class Dataset:
    """Design matrix, response and certified values of one dataset."""

    def __init__(self, name):
        lines = (FOLDER / f"{name}.dat").read_text("ascii").splitlines()
        first, last = _place(lines, "Certified Values")
        certified = [line.split() for line in lines[first:last] if re.match(r"\s+B\d", line)]
        self.coefficients = np.array([float(row[1]) for row in certified])
        self.deviations = np.array([float(row[2]) for row in certified])
        first, last = _place(lines, "Data")
        data = np.array([line.split() for line in lines[first:last]], dtype=float)
        self.response, self.predictors = data[:, 0], data[:, 1:]
        self.design = self._design(name)

    def _design(self, name):
        if name in DEGREE:
            return np.vander(self.predictors[:, 0], DEGREE[name] + 1, increasing=True)
        if name == "Longley":
            return np.column_stack([np.ones(self.response.size), self.predictors])
        return self.predictors  # NoInt: a line through zero


def _place(lines, what):
    found = re.search(rf"{what}\s*\(lines (\d+) to (\d+)\)", "\n".join(lines[:12]))
    return int(found[1]) - 1, int(found[2])


def digits(value, certified):
    """Fewest correct significant digits, 15.9 where all are (log relative error, NIST)."""
    size = np.where(certified == 0.0, 1.0, np.abs(certified))
    return float(np.min(-np.log10(np.maximum(np.abs(value - certified) / size, 10**-15.9))))
