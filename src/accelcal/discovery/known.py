"""Effects of known size as directions and sizes of a search, and what they add to the readings."""

from __future__ import annotations

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.candidates import Instance, amplitude_columns
from accelcal.effects.conditions import Conditions
from accelcal.effects.effect import Disturbance


def instance_of(known: Disturbance) -> Instance:
    """Take the size out of an effect.

    Parameters
    ----------
    known : Disturbance
        An effect with its size.

    Returns
    -------
    Instance
        The effect with its nonlinear parameters and the mixture of its amplitudes.
    """
    sizes = sizes_of(known)
    norm = float(np.sqrt(sizes @ sizes))
    mixture = sizes / norm if norm else np.eye(sizes.size)[0]
    shape = {item.name: known.values[item.name] for item in known.effect.shapes}
    return Instance(known.effect, tuple(mixture.tolist()), shape)


def sizes_of(known: Disturbance) -> Array:
    """Amplitudes of an effect."""
    return np.array([known.values[item.name] for item in known.effect.amplitudes])


def contribution(known: Disturbance, c: Conditions) -> Array:
    """What an effect adds to the readings over K1 at T0 [g], shape (n,)."""
    return np.asarray(amplitude_columns(instance_of(known), c) @ sizes_of(known))
