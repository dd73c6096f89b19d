"""What a reader must know before using the numbers of a fit, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable

__all__ = ["record_warnings", "table_warnings"]

_FEW_REPEATS = 5

# Up to this many times the noise of its most telling contrast, a head error of two degrees of
# freedom is not told from the noise: the intervals then held the truth in 93.5 to 98.8 %, measured
# for 1, 2 and 6 strokes on 8 positions.
_AS_LARGE_AS_NOISE = 4.0

# Without the return and with fewer residuals than this, one stroke held the truth in 91 to 96 %.
_FEW_RESIDUALS = 15
_FEW_DOF = 3  # nor with fewer than this, return or not

_OF_METHOD = {
    "printed": (
        "NOT A CALIBRATION: the printed equations (6) are misprinted, and the symbols tell what"
        " they return instead; use least-squares or closed-form"
    ),
    "sign-corrected": "sign-corrected (6) does not estimate K3; K1 stands for K1 + 0.75 K3",
}


def table_warnings(table: PreparedTable, noise: ReadingNoise) -> tuple[str, ...]:
    """Say what one table cannot tell.

    Parameters
    ----------
    table : PreparedTable
        The table.
    noise : ReadingNoise
        Its reading noise.

    Returns
    -------
    tuple of str
        Sentences, without a full stop.
    """
    said = list(table.estimability.sentences())
    if table.record.std is not None and not np.all(table.record.std > 0.0):
        said.append(_unusable(table.record.std))
    elif table.record.count is not None and not np.all(table.record.count >= 1.0):
        said.append("n is missing at some readings, so std is taken as that of each mean")
    if noise.source == "none":
        said.append(
            "no uncertainty: one reading a coefficient and no declared std; repeat strokes or give"
            " the columns std and n"
        )
    if noise.source == "residuals":
        said.append(
            "reading noise from the residuals of the fit, as too few readings are repeated; repeat"
            " strokes for narrower intervals"
        )
    if noise.excess is not None:
        said.append(
            f"the strokes scatter {noise.excess:.2g} times more than the declared std;"
            " uncertainties follow the strokes"
        )
    return tuple(said)


def _unusable(std: NDArray[np.float64]) -> str:
    lacking = {"missing": np.isnan(std).any(), "zero": (std == 0.0).any()}
    what = " or ".join(word for word, found in lacking.items() if found)
    where = "some" if (std > 0.0).any() else "all"
    return f"std is {what} at {where} readings, so the declared scatter is not used at all"


def record_warnings(
    estimate: JointEstimate, method: str, delta0: float, mountings: Sequence[str]
) -> tuple[str, ...]:
    """Say what the record as a whole cannot tell.

    Parameters
    ----------
    estimate : JointEstimate
        The fit.
    method : str
        The estimator.
    delta0 : float
        Fixture angle that was taken as given [rad].
    mountings : sequence of str
        Mountings in the record.

    Returns
    -------
    tuple of str
        Sentences, without a full stop.
    """
    said = [_OF_METHOD[method]] if method in _OF_METHOD else []
    given = "taken as 0" if delta0 == 0.0 else f"taken as {delta0:g} rad"
    effective = f"M is the effective misalignment: it contains the fixture angle delta0, {given};"
    if len({mounting[0] for mounting in mountings}) < len(set(mountings)):
        said.append(
            f"{effective} where both sides met a level, delta and delta0 are told apart below, and"
            " the laws have delta alone"
        )
    else:
        said.append(f"{effective} the reversed mounting would separate them")
    said.append(
        "a mirrored order in all strokes, J counted against the turn, leaves no residual: it only"
        " turns the signs of M and M_ip"
    )
    return (*said, *_of_head(estimate), *_of_launch(estimate))


def _of_head(estimate: JointEstimate) -> list[str]:
    head = estimate.head
    if head.source == "estimated" and _rests_on_few_residuals(estimate):
        return [
            "noise and head error come from the same few residuals: no honest interval can be had,"
            " and those given may hold the truth in fewer than 95 of 100 cases (91 to 96 in"
            " simulations); measure two strokes or declare head_uncertainty"
        ]
    if head.source == "estimated" and _is_lost_in_noise(estimate):
        size = "no head error shows above the noise"
        if head.uncertainty > 0.0:
            size = "head error as large as the noise"
        return [
            f"{size}, and {head.dof:.0f} degrees of freedom cannot tell"
            " the two apart: the intervals may be wider than needed (they held the truth in 93 to"
            " 99 of 100 cases in simulations); declare head_uncertainty or measure more positions"
        ]
    if head.source == "estimated":
        return [
            f"head error estimated from the lack of fit with {head.dof:.0f} degree"
            f"{'' if round(head.dof) == 1 else 's'} of freedom;"
            " declare head_uncertainty or measure more positions for narrower intervals"
        ]
    seen = estimate.lack_of_fit.contrasts.size > 0
    if head.source == "none" and seen and any(n.source == "residuals" for n in estimate.noises):
        return [
            "head error not declared: the intervals hold it as far as the residuals show it;"
            " declare head_uncertainty"
        ]
    if head.source == "none":
        return [
            "head error neither declared nor visible at these angles: the intervals leave it out;"
            " declare head_uncertainty"
        ]
    return []


def _rests_on_few_residuals(estimate: JointEstimate) -> bool:
    """Whether noise and head error were told apart without a residual that is free of the head."""
    dof = estimate.noises[0].dof
    unrepeated = all(noise.source == "residuals" for noise in estimate.noises)
    free = dof - estimate.lack_of_fit.contrasts.size
    return unrepeated and ((free < 1.0 and dof < _FEW_RESIDUALS) or dof < _FEW_DOF)


def _is_lost_in_noise(estimate: JointEstimate) -> bool:
    """Whether an estimated head error is of the size of what the noise makes of it."""
    shown = estimate.head.uncertainty * float(estimate.lack_of_fit.strengths.max())
    return bool(estimate.head.dof < _FEW_REPEATS and shown < _AS_LARGE_AS_NOISE)


def _of_launch(estimate: JointEstimate) -> list[str]:
    shift = estimate.bias_shift
    if shift.source == "estimated" and shift.dof < _FEW_REPEATS:
        return [
            f"shift from launch to launch estimated with {shift.dof:.0f} degrees of freedom: no"
            " honest interval can be had from so few repeats, and those given may hold the truth in"
            " fewer than 95 of 100 cases; declare launch_uncertainty or repeat a temperature more"
            " often"
        ]
    if shift.source != "none":
        return []
    return [
        "K0 is that of its run: the bias shift from launch to launch is neither declared nor"
        " measured; declare launch_uncertainty or repeat a temperature"
    ]
