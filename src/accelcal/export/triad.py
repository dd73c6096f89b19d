"""What an export of a triad says, and its C header."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from accelcal.compensate.ranges import ACCELERATION_MARGIN
from accelcal.compensate.triad import assumptions_of_triad, notes_of_triad
from accelcal.export.c_text import (
    c_comment,
    c_covariance,
    c_matrix,
    c_number,
    c_prefix,
    harmless,
    header_of,
)
from accelcal.results.triad import FRAMES, TriadCalibration
from accelcal.version import SOFTWARE

__all__ = ["triad_content", "triad_header"]

_MEANINGS = {"b": "bias of channel {}", "S": "sensitivity of channel {} along axis {}"}
_OF_COVARIANCE = "Covariance of the parameters; those that the frame fixes are not in it."


def triad_content(triad: TriadCalibration, sha256: str | None = None) -> dict[str, Any]:
    """Collect what an export of a triad says.

    Parameters
    ----------
    triad : TriadCalibration
        The calibration.
    sha256 : str, optional
        SHA-256 of its file.

    Returns
    -------
    dict
        Plain texts, numbers, lists and dictionaries.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> up = np.vstack([np.eye(3), -np.eye(3)])
    >>> noise = 1e-4 * np.random.default_rng(1).normal(size=up.shape)
    >>> content = triad_content(accelcal.calibrate_triad(0.01 + 2.0 * up + noise, up))
    >>> content["model"], content["coefficients"][3]["symbol"]
    ('y = b + S a, so a = S^-1 (y - b)', 'S_xx')
    """
    return {
        "schema": "accelcal/export-triad/1",
        "serial": triad.serial,
        "source": triad.source,
        "calibration_sha256": sha256,
        "calibrated_by": triad.software,
        "exported_by": SOFTWARE,
        "output_unit": triad.output_unit,
        "acceleration_unit": "g_local",
        "g_local_m_s2": triad.g_local_m_s2,
        "model": "y = b + S a, so a = S^-1 (y - b)",
        "frame": FRAMES.get(triad.frame, triad.frame),
        "validity": {
            "temperature_degC": triad.temperature_degC,
            "length_g": 1.0,
            "note": "Beyond 1 g the outputs are taken as linear.",
        },
        "assumptions": list(assumptions_of_triad(triad)),
        "notes": notes_of_triad(triad),
        "coefficients": _coefficients(triad),
        "covariance": {
            "note": _OF_COVARIANCE,
            "symbols": list(triad.covariance_names),
            "matrix": [list(row) for row in triad.covariance_matrix],
        },
    }


def _coefficients(triad: TriadCalibration) -> list[dict[str, Any]]:
    return [
        {
            "symbol": symbol,
            "value": quantity.value,
            "standard_uncertainty": quantity.standard_uncertainty,
            "expanded_uncertainty": quantity.expanded_uncertainty,
            "unit": quantity.unit,
            "meaning": _MEANINGS[symbol[0]].format(*symbol[2:]),
        }
        for symbol, quantity in triad.parameters.items()
    ]


def triad_header(content: Mapping[str, Any], triad: TriadCalibration) -> str:
    """Write an export of a triad as a C header.

    Parameters
    ----------
    content : mapping
        What `triad_content` returns.
    triad : TriadCalibration
        The calibration.

    Returns
    -------
    str
        C99 that needs nothing but ``math.h``.
    """
    covariance = content["covariance"]
    rows = list(zip(covariance["symbols"], covariance["matrix"], strict=True))
    parts = {
        "@COMMENT@": c_comment(content, [covariance["note"]]),
        "@COVARIANCE@": c_covariance(rows) if rows else "/* Covariance: unknown. */",
        "@UNIT@": harmless(triad.output_unit or "output unit"),
        "@BIAS@": ", ".join(map(c_number, triad.bias)),
        "@INVERSE@": c_matrix(np.linalg.inv(triad.sensitivity).tolist()),
        "@LONGEST@": c_number(1.0 + ACCELERATION_MARGIN),
    }
    return header_of(_TEMPLATE, parts, c_prefix(triad.serial))


_TEMPLATE = """\
/*
@COMMENT@
 */
@BEGIN@

#include <math.h>

@COVARIANCE@

/*
 * Accelerations along the axes x, y, z of the frame [local g] from the outputs of the channels
 * x, y, z [@UNIT@]. The range is not checked: see @P@_inside.
 */
static inline void @P@_accelerations(const double output[3], double acceleration[3])
{
    static const double bias[3] = {@BIAS@};
    /* the inverse of S */
    static const double inverse[3][3] = @INVERSE@;
    const double x = output[0] - bias[0], y = output[1] - bias[1], z = output[2] - bias[2];
    int axis;

    for (axis = 0; axis < 3; axis++)
        acceleration[axis] = inverse[axis][0] * x + inverse[axis][1] * y + inverse[axis][2] * z;
}

/* 1 where the acceleration [local g] is not longer than what was tested, else 0. */
static inline int @P@_inside(const double acceleration[3])
{
    return sqrt(acceleration[0] * acceleration[0] + acceleration[1] * acceleration[1]
                + acceleration[2] * acceleration[2]) <= @LONGEST@;
}

@END@"""
