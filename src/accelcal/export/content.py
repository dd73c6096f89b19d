"""What an export says, whatever its format."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from accelcal.compensate.choice import compensation
from accelcal.compensate.coefficients import PARAMETERS, Compensation, Law
from accelcal.compensate.ranges import TEMPERATURE_MARGIN
from accelcal.effects.left_in_use import static_in_use
from accelcal.errors import InputError
from accelcal.model import law_units
from accelcal.numerics.probability import LEVEL, student_quantile
from accelcal.results.calibration import Calibration
from accelcal.results.documents.fields import finite_or_none
from accelcal.version import SOFTWARE

__all__ = ["SIGN_CONVENTION", "covariance_rows", "export_content", "refuse_effects"]

SIGN_CONVENTION = (
    "Misalignment terms are added with + for both cross axes, + delta_O a_p + delta_P a_o, as in"
    " the paper. IEEE 1293 writes + delta_o a_p - delta_p a_o, so that delta_o = delta_O and"
    " delta_p = -delta_P. Input axis up at head angle 0 is +1 g."
)

_MODEL = "Y = K1(T) [k0(T) + a_i + k2 a_i^2 + k3 a_i^3 + {cross}]"
_LAWS = (
    "With dT = T - T0 and the slope above for T > T0, below for T < T0: k0(T) = k0 + slope dT,"
    " K1(T) = K1 (1 + slope dT), delta(T) = delta + slope dT."
)
_OF_COVARIANCE = (
    "Covariance of the values at T0 and of the slopes; that of K1 is relative (dK1/K1), and so are"
    " its slopes. Below T0 the slopes above count for nothing, and the reverse."
)
_WITHOUT_OTHER_AXIS = (
    " The errors of {names} and their slopes are not in it, and may go with these: add what their"
    " standard uncertainties make of the acceleration to the standard uncertainty by this"
    " covariance, not in squares."
)
_LAUNCH = (
    "Standard uncertainties of the shift to a new launch, of the bias [g] and of the scale factor"
    " (relative), and the hysteresis of the bias [g], which are not in the covariance; add them in"
    " squares. The degrees of freedom are infinite where null; a half is one alone, as it counts"
    " beside other errors, and all errors together have one at least."
)


def export_content(
    calibration: Calibration, sha256: str | None = None, run: str | int | None = None
) -> dict[str, Any]:
    """Collect what an export says.

    Parameters
    ----------
    calibration : Calibration
        The calibration.
    sha256 : str, optional
        SHA-256 of its file.
    run : str or int, optional
        Use the table of this run only.

    Returns
    -------
    dict
        Plain texts, numbers, lists and dictionaries; None stands for what is not determined.

    Raises
    ------
    InputError
        As `accelcal.compensate.choice.compensation`; or if the calibration has effects that
        `accelcal.apply` takes up, which an export cannot.

    Examples
    --------
    >>> import accelcal
    >>> content = export_content(accelcal.fit(accelcal.simulate(seed=1)))
    >>> content["validity"]["temperature_degC"], content["coefficients"][0]["symbol"]
    ([-40.0, 80.0], 'k0')
    """
    refuse_effects(calibration)
    found = compensation(calibration, run, effects=False)
    return {
        "schema": "accelcal/export/1",
        "serial": calibration.serial,
        "date": calibration.date,
        "source": calibration.source,
        "calibration_sha256": sha256,
        "calibrated_by": calibration.software,
        "exported_by": SOFTWARE,
        "output_unit": calibration.output_unit,
        "acceleration_unit": "g_local",
        "g_local_m_s2": calibration.g_local_m_s2,
        "T0_degC": found.T0_degC,
        "model": _MODEL.format(cross=_cross_terms(found)),
        "temperature_laws": _LAWS if found.several_levels else None,
        "sign_convention": SIGN_CONVENTION,
        "validity": _validity(found),
        "assumptions": list(found.assumptions),
        "notes": list(found.notes),
        "coefficients": coefficients(found),
        "ieee_1293": _ieee(found),
        "new_launch": _new_launch(found),
        "covariance": _covariance(found),
    }


def _new_launch(found: Compensation) -> dict[str, Any]:
    return {
        "note": _LAUNCH,
        "bias": found.launch.bias,
        "bias_dof": finite_or_none(found.launch.bias_dof),
        "scale_factor": found.launch.scale_factor,
        "scale_factor_dof": finite_or_none(found.launch.scale_factor_dof),
        "hysteresis": found.hysteresis,
    }


def _covariance(found: Compensation) -> dict[str, Any]:
    rows, note = covariance_rows(found), _OF_COVARIANCE
    if found.other is not None:
        names = f"{found.other.delta_symbol}, {found.other.coupling_symbol}"
        note += _WITHOUT_OTHER_AXIS.format(names=names)
    return {
        "note": note,
        "symbols": [symbol for symbol, _ in rows],
        "matrix": [[finite_or_none(value) for value in row] for _, row in rows],
    }


def refuse_effects(calibration: Calibration) -> None:
    """Refuse a calibration whose coefficients alone do not give the acceleration.

    Parameters
    ----------
    calibration : Calibration
        The calibration.

    Raises
    ------
    InputError
        If it has effects that are functions of acceleration and temperature.
    """
    names = [item.id for item in static_in_use(calibration)]
    if names:
        raise InputError(
            f"{', '.join(names)}: the coefficients are free of it, the outputs are not, and an"
            " export has no more than the coefficients; use accelcal apply, or export a fit without"
            " a model"
        )


def covariance_rows(found: Compensation) -> list[tuple[str, list[float]]]:
    """List the rows of the covariance, each with its symbol; slopes that were not measured not."""
    laws = (found.k0, found.K1, found.cross.delta)
    measured = [getattr(law, side).determined for side in ("above", "below") for law in laws]
    kept = [True] * len(PARAMETERS) + measured
    return [
        (symbol, [value for value, keep in zip(row, kept, strict=True) if keep])
        for symbol, row, keep in zip(found.symbols, found.covariance, kept, strict=True)
        if keep
    ]


def coefficients(found: Compensation) -> list[dict[str, Any]]:
    """List the coefficients, a dictionary each: symbol, value, uncertainties, unit, meaning."""
    units, known = law_units(found.output_unit), _known_errors(found)
    rows = [
        *_law_rows("k0", found.k0, units["k0"], "bias"),
        *_law_rows("K1", found.K1, units["K1"], "scale factor"),
        _row("k2", found.k2, "g/g^2", "second-order nonlinearity"),
        _row("k3", found.k3, "g/g^3", "third-order nonlinearity"),
    ]
    for axis in found.axes:
        meaning = f"misalignment, times {axis.name}"
        rows += _law_rows(axis.delta_symbol, axis.delta, units["delta"], meaning)
        coupling = f"cross-coupling, times a_i {axis.name}"
        rows.append(_row(axis.coupling_symbol, axis.delta_ip, "g/g^2", coupling))
    for row in rows:
        if row["symbol"] in found.undetermined:
            row["value"] = None
        elif "slope" not in row["symbol"]:
            row["standard_uncertainty"] = finite_or_none(known[row["symbol"]][0])
        if row["standard_uncertainty"] is not None:
            factor = student_quantile(LEVEL, known[row["symbol"]][1])
            row["expanded_uncertainty"] = factor * row["standard_uncertainty"]
    return rows


def _known_errors(found: Compensation) -> dict[str, tuple[float, float]]:
    """Standard uncertainty and degrees of freedom by symbol, of both cross axes."""
    known: dict[str, tuple[float, float]] = {}
    for part in (found, found.other):
        if part is not None:
            sigma = np.sqrt(np.diagonal(part.covariance))
            each = zip(sigma.tolist(), np.maximum(part.dof, 1.0).tolist(), strict=True)
            known |= zip(part.symbols, each, strict=True)
    sigma_K1, dof = known["K1"]
    return known | {"K1": (sigma_K1 * abs(found.K1.at_T0), dof)}


def _law_rows(
    symbol: str, law: Law, units: tuple[str, str], meaning: str
) -> Iterator[dict[str, Any]]:
    yield _row(symbol, law.at_T0, units[0], meaning)
    for side, slope in (("above", law.above), ("below", law.below)):
        value, u = slope.value, finite_or_none(slope.standard_uncertainty)
        told = (value, u) if slope.determined else (None, None)
        of = f"slope {side} T0 of the {meaning}"
        yield _row(f"{symbol}_slope_{side}", told[0], units[1], of, told[1])


def _row(
    symbol: str, value: float | None, unit: str, meaning: str, standard: float | None = None
) -> dict[str, Any]:
    return {
        "symbol": symbol,
        "value": value,
        "standard_uncertainty": standard,
        "expanded_uncertainty": None,
        "unit": unit,
        "meaning": meaning,
    }


def _cross_terms(found: Compensation) -> str:
    terms = []
    for axis in found.axes:
        law = "(T)" if axis.delta.above.determined or axis.delta.below.determined else ""
        terms.append(f"{axis.delta_symbol}{law} {axis.name}")
        terms.append(f"{axis.coupling_symbol} a_i {axis.name}")
    return " + ".join(terms)


def _validity(found: Compensation) -> dict[str, Any]:
    return {
        "temperature_degC": list(found.temperatures) if found.temperatures else None,
        "temperature_margin_degC": TEMPERATURE_MARGIN,
        "acceleration_g": list(found.accelerations),
        "note": "Beyond the tested accelerations the nonlinearity is extrapolated.",
    }


def _ieee(found: Compensation) -> dict[str, Any]:
    """Misalignments with the signs of IEEE 1293."""
    signs = {"a_p": ("delta_o", 1.0), "a_o": ("delta_p", -1.0)}
    return {
        signs[axis.name][0]: (
            None
            if axis.delta_symbol in found.undetermined
            else signs[axis.name][1] * axis.delta.at_T0
        )
        for axis in found.axes
    }
