"""Play: the memory of a gear with slack, of a rubbing pivot, of a body that follows late."""

from __future__ import annotations

import numpy as np

from hidden.design import Floats


def play(inputs: Floats, halfwidth: float, start: float) -> Floats:
    """What follows an input through a slack of twice the half-width, input by input.

    Parameters
    ----------
    inputs : ndarray, shape (n,)
        In their order, each reached monotonically from the one before.
    halfwidth : float
        The follower stays where it is until the input is this far from it.
    start : float
        Where the follower is before the first input.

    Returns
    -------
    ndarray, shape (n,)
        Where it is at each.
    """
    follower, path = start, []
    for value in inputs.tolist():
        if follower < value - halfwidth:
            follower = value - halfwidth
        elif follower > value + halfwidth:
            follower = value + halfwidth
        path.append(follower)
    return np.array(path)
