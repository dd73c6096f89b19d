"""The catalogue as columns of a regression, as a user of a regression package would set it up.

Pooled least squares in the units of the readings: nothing is whitened, no launch has a bias of its
own, no head position an error. The base model is taken out of readings and columns.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from accelcal.discovery.base import base_model, solve
from accelcal.discovery.instance import Instance, column_of, instances_of
from accelcal.effects.catalogue import catalogue
from accelcal.record import TumbleRecord
from accelcal.reference import reference_temperature_of

Floats = NDArray[np.float64]

VISIBLE = 0.01
"""Part of a column that the base model must leave."""

SAME = 0.999
"""Cosine from which columns are one class."""

PHYSICAL = tuple(item for item in catalogue() if item.acts_on != "readings" and item.amplitudes)


class Dictionary(NamedTuple):
    """Readings and columns behind the base model.

    Attributes
    ----------
    reading : ndarray, shape (n,)
        What the base model leaves of the readings [g].
    columns : ndarray, shape (n, N)
        Unit vectors.
    instances : tuple of Instance
        Effect and parameters of each.
    freedom : int
        Readings less coefficients of the base model.
    """

    reading: Floats
    columns: Floats
    instances: tuple[Instance, ...]
    freedom: int

    def kept(self, places: list[int]) -> Dictionary:
        """Keep some of the columns."""
        instances = tuple(self.instances[place] for place in places)
        return self._replace(columns=self.columns[:, places], instances=instances)


def dictionary_of(record: TumbleRecord) -> Dictionary:
    """Set up the columns of all physical effects, at all values of their parameters."""
    pooled = replace(record.apparatus, launch_uncertainty=0.0, launch_sf_uncertainty=0.0)
    reference = reference_temperature_of(record, None)
    model = base_model(replace(record, apparatus=pooled), reference or 0.0)
    parameters = solve(model)
    jacobian = model.jacobian(parameters)
    left, values, _ = np.linalg.svd(jacobian / np.linalg.norm(jacobian, axis=0), False)
    base = left[:, values > 1e-9 * values[0]]
    instances = [item for effect in PHYSICAL for item in instances_of(effect, model.conditions)]
    whole = np.stack([column_of(item, model.conditions) for item in instances], axis=1)
    rest = whole - base @ (base.T @ whole)
    length = np.linalg.norm(rest, axis=0)
    seen = np.flatnonzero(length > VISIBLE * np.linalg.norm(whole, axis=0))
    residual = model.residual(parameters)
    return Dictionary(
        residual - base @ (base.T @ residual),
        rest[:, seen] / length[seen],
        tuple(instances[place] for place in seen),
        residual.size - base.shape[1],
    )


def thinned(full: Dictionary, most: int = 12) -> Dictionary:
    """Keep at most so many columns of each effect, evenly over the values of its parameters."""
    owners = [item.effect.id for item in full.instances]
    kept: list[int] = []
    for name in dict.fromkeys(owners):
        own = [place for place, owner in enumerate(owners) if owner == name]
        taken = np.linspace(0, len(own) - 1, min(most, len(own))).round().astype(int)
        kept += [own[i] for i in taken]
    return full.kept(kept)


def distinct(full: Dictionary) -> Dictionary:
    """Keep one column of each class, the first."""
    alike = np.abs(full.columns.T @ full.columns) > SAME
    kept: list[int] = []
    for place in range(alike.shape[0]):
        if not alike[place, kept].any():
            kept.append(place)
    return full.kept(kept)
