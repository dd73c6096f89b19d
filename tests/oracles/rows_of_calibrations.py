"""Rows of the two frames of a batch from a calibration, to compare them."""

from contextlib import suppress

import pandas as pd

import accelcal
from accelcal.archive.formats import ROWS
from accelcal.errors import InputError
from accelcal.results.tabular import gate_column

JOINT = " | "


def table_rows(calibration, record):
    common = where(calibration, record) | of_record(calibration, record)
    return [common | of_table(table, calibration) for table in calibration.tables]


def law_rows(calibration, record):
    common = where(calibration, record)
    rows = []
    for mounting in dict.fromkeys(table.mounting for table in calibration.tables):
        laws = calibration.of_mounting(mounting).temperature_model
        for term, quantity in laws.quantities() if laws else ():
            cells = {"mounting": mounting, "coefficient": term, **quantity.to_document()}
            rows.append(common | cells | {"warnings": JOINT.join(laws.warnings)})
    return rows


def where(calibration, record):
    names = ("source", "serial", "date", "software", "T0_degC")
    line = {"line": None if record.line is None else int(record.line[0])}
    return line | {name: getattr(calibration, name) for name in names}


def of_record(calibration, record):
    names = ("output_unit", "method", "robust", "g_local_m_s2", "delta0_rad")
    return {
        **{name: getattr(calibration, name) for name in names},
        **{name: None for name in ROWS if name.startswith("gate_")},
        "notes": JOINT.join(record.notes),
        "verdict": None,
        "failed_limits": "",
        "sha256": record.sha256,
        "lot": record.metadata.get("lot"),
        **verdicts(calibration.gates),
    }


def of_table(table, calibration):
    names = ("run", "mounting", "temperature_degC", "readings", "dof", "residual_rms")
    cells = {name: getattr(table, name) for name in names}
    cells["stands_for"] = JOINT.join(f"{name}: {said}" for name, said in table.stands_for.items())
    cells["warnings"] = JOINT.join(warnings(table, calibration))
    for name, quantity in (*table.coefficients.items(), *table.error_model.items()):
        cells[name] = quantity.value
        cells[f"{name}_standard_uncertainty"] = quantity.standard_uncertainty
        cells[f"{name}_expanded_uncertainty"] = quantity.expanded_uncertainty
        cells[f"{name}_dof"] = quantity.dof
    return cells | verdicts(table.gates)


def warnings(table, calibration):
    gates = (*table.gates, *calibration.gates)
    found = [f"gate {gate.name}: {gate.finding}" for gate in gates if gate.verdict == "warn"]
    return (*table.warnings, *calibration.warnings, *found)


def verdicts(gates):
    return {gate_column(gate.name): gate.verdict for gate in gates}


def assert_rows_are_those_of_fits(folder, files, **options):
    found = accelcal.batch(folder, **options)
    overrides = options.get("overrides")
    asked = {name: value for name, value in options.items() if name != "overrides"}
    fits = []
    for path in sorted(folder.glob("*.csv")):
        record = accelcal.read_table(path, overrides=overrides)
        with suppress(InputError):
            fits.append((accelcal.fit(record, **asked), record))
    assert len(fits) + len(found.errors) == files
    for frame, rows_of in ((found.tables, table_rows), (found.laws, law_rows)):
        rows = [row for fitted in fits for row in rows_of(*fitted)]
        expected = pd.DataFrame(rows, columns=list(frame), dtype=object).astype(frame.dtypes)
        pd.testing.assert_frame_equal(frame, expected, rtol=1e-8, atol=1e-14)
    return found
