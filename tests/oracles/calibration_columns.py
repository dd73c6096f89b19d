"""Columns of a stack of calibrations, and those of one calibration, to compare them."""

import numpy as np

from accelcal.calibrate.columns import mountings_of, numbers_of, verdict_codes
from accelcal.gates.verdict import VERDICTS


def columns_of(stack):
    verdicts = verdict_codes(stack).items()
    return {
        "record": np.repeat(np.arange(len(stack)), len(stack.tables)),
        "run": np.ravel([stack.plan.run_labels(i) for i in range(len(stack))]),
        "mounting": np.tile(mountings_of(stack), len(stack)),
        **numbers_of(stack),
        **{name: np.array(VERDICTS)[code] for name, code in verdicts},
    }


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
        row |= {gate.name: gate.verdict for gate in (*table.gates, *calibration.gates)}
        rows.append(row)
    return {name: column([row[name] for row in rows]) for name in rows[0]}


def column(cells):
    known = [cell for cell in cells if cell is not None]
    if known and isinstance(known[0], str):
        return np.array(cells)
    return np.array([np.nan if cell is None else cell for cell in cells])
