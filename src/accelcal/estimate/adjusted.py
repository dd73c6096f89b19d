"""Coefficients of some tables changed by what the others tell, with all of their errors."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from accelcal.arrays import Array, Places
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.linearised import place_of
from accelcal.estimate.uncertainty import Component
from accelcal.model import COEFFICIENTS


def adjusted(
    estimate: JointEstimate, names: list[tuple[int, str]], change: Array, through: Array
) -> JointEstimate:
    """Add to some coefficients what depends on all of them.

    Parameters
    ----------
    estimate : JointEstimate
        Coefficients of all tables of a record, or of a stack of records.
    names : list of tuple of int and str
        Table and name of each of m coefficients to change.
    change : ndarray, shape (..., m)
        What is added to them [output unit / g^n].
    through : ndarray, shape (..., m, P)
        Its derivatives by all coefficients.

    Returns
    -------
    JointEstimate
        With these coefficients and their error components changed, by the law of propagation.
    """
    coefficients = [values.copy() for values in estimate.coefficients]
    for row, (table, name) in enumerate(names):
        coefficients[table][..., COEFFICIENTS.index(name)] += change[..., row]
    at = np.array([place_of(estimate, table, name) for table, name in names])

    def passed(components: Mapping[str, Component]) -> dict[str, Component]:
        return {source: _passed(part, at, through) for source, part in components.items()}

    return estimate._replace(
        coefficients=tuple(coefficients),
        components=passed(estimate.components),
        alike=passed(estimate.alike),
    )


def _passed(part: Component, at: Places, through: Array) -> Component:
    """Component of coefficients of which those at some places have `through` times all added.

    The others stay, and few columns of `through` are not zero: this takes a small share of the
    time that a matrix of all coefficients would.
    """
    used = np.flatnonzero(through.any(axis=tuple(range(through.ndim - 1))))
    few, back = through[..., used], through[..., used].mT
    more = few @ part.covariance[..., used, :]
    covariance = part.covariance.copy()
    covariance[..., at, :] += more
    covariance[..., at] += more.mT
    covariance[..., at[:, None], at] += more[..., used] @ back
    dof = part.dof.copy()
    fewest = np.where(few != 0.0, dof[..., None, used], np.inf).min(axis=-1)
    dof[..., at] = np.minimum(dof[..., at], fewest)
    return Component(covariance, dof)
