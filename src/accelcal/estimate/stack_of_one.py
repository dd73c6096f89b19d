"""The estimate of one record as that of a stack of one, for what works on stacks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

from accelcal.estimate.joint import JointEstimate, JointStack
from accelcal.estimate.noise import NoiseStack, ReadingNoise
from accelcal.estimate.uncertainty import Component

__all__ = ["stack_of_one"]

Part = TypeVar("Part", bound=Any)


def stack_of_one(estimate: JointEstimate) -> JointStack:
    """Give the estimate of one record a leading axis.

    Parameters
    ----------
    estimate : JointEstimate
        The estimate.

    Returns
    -------
    JointStack
        The same; its `one` gives the estimate back.

    Examples
    --------
    >>> import accelcal
    >>> from accelcal.calibrate.options import Options
    >>> from accelcal.calibrate.plan import OnePlan
    >>> from accelcal.calibrate.stack import calibration_stack
    >>> plan = OnePlan.of([accelcal.simulate(seed=1)])
    >>> one = calibration_stack(plan, Options()).estimate.one(0)
    >>> stack_of_one(one).one(0).head.dof == one.head.dof
    True
    """
    shift = ("uncertainty", "of_run", "scatter")
    return JointStack(
        outputs=tuple(y[None] for y in estimate.outputs),
        names=estimate.names,
        stands_for=estimate.stands_for,
        coefficients=tuple(k[None] for k in estimate.coefficients),
        judged=tuple(k[None] for k in estimate.judged),
        residuals=tuple(r[None] for r in estimate.residuals),
        noises=tuple(map(_noise, estimate.noises)),
        head=_alone(estimate.head, "uncertainty", "dof"),
        lack_of_fit=estimate.lack_of_fit.alone(),
        bias_shift=_alone(estimate.bias_shift, *shift),
        scale_factor_shift=_alone(estimate.scale_factor_shift, *shift),
        components=_components(estimate.components),
        alike=_components(estimate.alike),
    )


def _alone(part: Part, *names: str) -> Part:
    alone: Part = part._replace(**{name: np.asarray(getattr(part, name))[None] for name in names})
    return alone


def _noise(noise: ReadingNoise) -> NoiseStack:
    excess = np.nan if noise.excess is None else noise.excess
    parts = (noise.factor, noise.dof, noise.source, excess)
    return NoiseStack(*(np.array([part]) for part in parts))


def _components(components: Mapping[str, Component]) -> dict[str, Component]:
    return {name: _alone(part, "covariance", "dof") for name, part in components.items()}
