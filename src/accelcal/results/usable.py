"""What of a calibration is there to work with; otherwise it is refused, or told with what to do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from accelcal.errors import InputError
from accelcal.plural import counted
from accelcal.results.calibration import Calibration
from accelcal.results.table import TableCalibration
from accelcal.results.triad import TriadCalibration

_OF_ONE_AXIS = "M", "M_ip"


def is_misprinted(calibration: Calibration) -> bool:
    """Whether a calibration is by the printed equations, which mix up the coefficients."""
    return calibration.method == "printed"


def refuse_misprinted(calibration: Calibration) -> None:
    """Refuse a calibration by the printed equations, which mix up the coefficients.

    Raises
    ------
    InputError
        If it was made by the method ``"printed"``.
    """
    if is_misprinted(calibration):
        raise InputError(
            "the calibration is by method 'printed', which is misprinted; fit by least-squares"
        )


def refuse_undetermined_laws(calibration: Calibration) -> None:
    """Refuse a calibration of several levels whose laws have no values at T0.

    Raises
    ------
    InputError
        If there are temperature laws, but nothing determines them.
    """
    model = calibration.temperature_model
    if model is None or model.k0.at_T0 is not None:
        return
    raise InputError(
        f"the calibration has no coefficients at T0 = {calibration.T0_degC:g} degC: its laws have a"
        " level on each side of it and none at it; measure at T0, or fit with T0 at one of the"
        " levels"
    )


def refuse_without_uncertainty(calibration: Calibration) -> None:
    """Refuse a calibration that knows the uncertainty of nothing, which is no uncertainty of zero.

    Raises
    ------
    InputError
        If no coefficient has an uncertainty.
    """
    found = [q for table in calibration.tables for q in table.coefficients.values()]
    if all(quantity.standard_uncertainty is None for quantity in found):
        raise InputError(
            "the calibration knows the uncertainty of no coefficient, so that of an acceleration"
            " would be too small; repeat strokes, or give the columns std and n, and fit anew"
        )


def gates_that_warn(
    calibration: Calibration | TriadCalibration, tables: Sequence[TableCalibration] = ()
) -> list[str]:
    """Say which gates warn of the test, to who uses its numbers without its report."""
    gates = [gate for table in tables for gate in table.gates]
    found = Counter(gate.name for gate in gates if gate.verdict == "warn")
    names = [f"{name} ({counted(times, 'table')})" for name, times in found.items()]
    names += [gate.name for gate in calibration.gates if gate.verdict == "warn"]
    if not names:
        return []
    return [
        f"checks of the calibration warn, {', '.join(names)}: clear that up before its numbers are"
        " used, its report tells more"
    ]


def tables_of_run(calibration: Calibration, run: str | int | None) -> tuple[TableCalibration, ...]:
    """Take the tables of one run, or all.

    Raises
    ------
    InputError
        If there is no such run.
    """
    return (calibration if run is None else calibration.of_run(run)).tables


def not_determined(groups: Sequence[Sequence[TableCalibration]]) -> list[str]:
    """Say what no table of a group determines, and what then stands for what.

    The tables of a group, all of one mounting, stand for one another, see `undetermined`.
    """
    said = []
    for place, (group, lost) in enumerate(zip(groups, undetermined(groups), strict=True)):
        told = group[0].stands_for.items()
        stands = [f"{name} stands for {what}" for name, what in told if _tells(place, name)]
        if lost:
            verb = "was" if len(lost) == 1 else "were"
            what = f"{', '.join(lost)} {verb} not determined and taken as 0"
            said.append("; ".join([what, *stands]))
    return list(dict.fromkeys(said))


def undetermined(groups: Sequence[Sequence[TableCalibration]]) -> list[list[str]]:
    """List the coefficients of (1) that no table of each group determines.

    The first group tells all of them, one of the other cross axis those of its axis alone.
    """
    return [
        [
            name
            for name in tables[0].coefficients
            if _tells(place, name) and all(t.coefficients[name].value is None for t in tables)
        ]
        for place, tables in enumerate(groups)
    ]


def _tells(place: int, name: str) -> bool:
    return place == 0 or name in _OF_ONE_AXIS
