"""Columns of a stack of calibrations, and those of one calibration, to compare them."""

import numpy as np

from accelcal.archive.stacked_rows import stacked_tables
from accelcal.arrays import Labels
from accelcal.results.tabular import gate_column


def columns_of(stack):
    cells = stacked_tables(stack).items()
    found = {n: np.array(c.cells()) if isinstance(c, Labels) else c for n, c in cells}
    return found | {"record": np.repeat(np.arange(len(stack)), len(stack.tables))}


def columns_of_one(calibration):
    names = ("run", "mounting", "temperature_degC", "readings", "dof", "residual_rms")
    rows = []
    for table in calibration.tables:
        row = {"record": 0} | {name: getattr(table, name) for name in names}
        for name, quantity in (*table.coefficients.items(), *table.error_model.items()):
            row[name] = quantity.value
            row[f"{name}_standard_uncertainty"] = quantity.standard_uncertainty
            row[f"{name}_expanded_uncertainty"] = quantity.expanded_uncertainty
            row[f"{name}_dof"] = quantity.dof
        row |= {gate_column(gate.name): gate.verdict for gate in (*table.gates, *calibration.gates)}
        rows.append(row)
    return {name: column([row[name] for row in rows]) for name in rows[0]}


def column(cells):
    known = [cell for cell in cells if cell is not None]
    if known and isinstance(known[0], str):
        return np.array(cells)
    return np.array([np.nan if cell is None else cell for cell in cells])
