"""Gates on what several tables say together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.gates.verdict import (
    SIGNIFICANT,
    acceleration,
    angle,
    not_assessed,
    times,
    warn_if,
)
from accelcal.probability import f_survival
from accelcal.results.quantity import Gate

__all__ = ["record_gates"]

Array = NDArray[np.float64]

_IMPLAUSIBLE_HEAD = 1e-4  # rad, 20 arcsec
_LARGEST_SPREAD = {"K1": 0.2, "K0": 0.1}  # relative, and [g]


def record_gates(estimate: JointEstimate, names: Sequence[str]) -> tuple[Gate, ...]:
    """Check what several tables say together.

    Parameters
    ----------
    estimate : JointEstimate
        The fit of all tables of a record.
    names : sequence of str
        What to call each table.

    Returns
    -------
    tuple of Gate
        Lack of fit of the positions, and agreement of the tables where there are several.
    """
    if len(names) < 2:
        return (_lack_of_fit(estimate),)
    return (_lack_of_fit(estimate), _agreement(estimate.coefficients, names))


def _lack_of_fit(estimate: JointEstimate) -> Gate:
    """Compare the position means with what reading noise and head error allow."""
    found, head = estimate.lack_of_fit, estimate.head
    if found.contrasts.size == 0 or head.source == "none":
        return not_assessed(
            "lack of fit", "nothing tells the errors of the positions from the reading noise"
        )
    size = angle(head.uncertainty)
    dof = head.dof if head.source == "estimated" else found.contrasts.size
    if head.source == "estimated":
        return warn_if(
            "lack of fit",
            head.uncertainty > _IMPLAUSIBLE_HEAD,
            f"the positions scatter as if the head had an error of {size}; {dof:.0f} degrees of"
            " freedom",
        )
    allowed = 1.0 + (head.uncertainty * found.strengths) ** 2
    ratio = float((found.contrasts**2 / allowed).mean())
    dof_of_noise = max(min(noise.dof for noise in estimate.noises), 1.0)
    p = f_survival(ratio, dof, dof_of_noise)
    return warn_if(
        "lack of fit",
        p < SIGNIFICANT,
        f"position residuals {times(ratio**0.5)} times what reading noise and the declared head"
        f" error of {size} allow, p = {p:.2g}",
    )


def _agreement(coefficients: Sequence[Array], names: Sequence[str]) -> Gate:
    """Compare scale factors and biases of the tables."""
    name = "agreement of tables"
    k = np.array(coefficients)
    scale_factor = k[:, 1] / float(np.sort(k[:, 1])[(len(k) - 1) // 2])
    bias = k[:, 0] / k[:, 1]
    odd = int(np.argmax(np.abs(np.log(np.maximum(np.abs(scale_factor), 1e-300)))))
    if np.ptp(scale_factor) > _LARGEST_SPREAD["K1"]:
        said = f"K1 of {names[odd]} is {times(float(scale_factor[odd]))} times that of the others"
        return warn_if(name, True, f"{said}: another unit, sign or accelerometer")
    spread = float(np.ptp(bias))
    text = f"K1 differs by {100 * np.ptp(scale_factor):.2g} %, the bias by {acceleration(spread)}"
    return warn_if(name, spread > _LARGEST_SPREAD["K0"], text)
