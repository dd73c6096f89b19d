"""The tables with one axis along the shaft, apart from those with the other one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component

__all__ = ["tables_of_axis"]

Part = TypeVar("Part")


def tables_of_axis(
    tables: Sequence[PreparedTable], estimate: JointEstimate, axis: str
) -> tuple[list[PreparedTable], JointEstimate]:
    """Choose the tables of one axis.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of one record.
    estimate : JointEstimate
        Their coefficients.
    axis : str
        Axis along the shaft, ``"o"`` or ``"p"``.

    Returns
    -------
    tables : list of PreparedTable
        Those of the axis.
    estimate : JointEstimate
        Their coefficients alone, with the components of their errors.
    """
    kept = [i for i, t in enumerate(tables) if t.axis == axis]
    if not kept:
        return [], estimate
    places = np.concatenate([np.r_[estimate.part(i)] for i in kept])

    def own(errors: Mapping[str, Component]) -> dict[str, Component]:
        return {
            name: Component(part.covariance[np.ix_(places, places)], part.dof[places])
            for name, part in errors.items()
        }

    def of(parts: Sequence[Part]) -> tuple[Part, ...]:
        return tuple(parts[i] for i in kept)

    return [tables[i] for i in kept], estimate._replace(
        outputs=of(estimate.outputs),
        names=of(estimate.names),
        stands_for=of(estimate.stands_for),
        coefficients=of(estimate.coefficients),
        judged=of(estimate.judged),
        residuals=of(estimate.residuals),
        noises=of(estimate.noises),
        components=own(estimate.components),
        alike=own(estimate.alike),
    )
