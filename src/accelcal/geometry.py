"""From the angle of the dividing head to the acceleration along the accelerometer's axes.

The shaft of the head is horizontal. At head angle 0 the input axis (IA) points up and senses +1 g;
the angle turns the second axis of the rotation plane upwards. Accelerations are in units of the
**local** gravity, so no value of gravity is needed here.

Mountings
---------
The rotation plane holds the input axis and one cross axis; the other cross axis lies along the
shaft and senses nothing.

``"o+"``, ``"o-"``
    the output axis (OA) lies along the shaft, the pendulous axis (PA) is in the rotation plane;
``"p+"``, ``"p-"``
    the pendulous axis lies along the shaft, the output axis is in the rotation plane.

The side ``-`` is the same unit turned by 180 deg about its input axis (the reversed mounting): the
cross axis in the plane changes its sign, the input axis does not.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.arguments.kinds import as_given
from accelcal.arguments.numbers import check_number, number_array
from accelcal.arrays import Array, Mask, equal
from accelcal.errors import InputError

__all__ = [
    "MOUNTINGS",
    "Acceleration",
    "accelerations",
    "checked_fixture_angle",
    "is_mounting",
    "side_of",
]

MOUNTINGS = ("o+", "o-", "p+", "p-")


def side_of(mounting: str) -> float:
    """Sign of the side of a mounting: a fixture angle takes as much off M/K1, times this sign.

    Examples
    --------
    >>> side_of("o+"), side_of("p-")
    (1.0, -1.0)
    """
    return -1.0 if mounting.endswith("-") else 1.0


class Acceleration(NamedTuple):
    """Acceleration along the axes of the accelerometer [local g].

    Attributes
    ----------
    input : ndarray
        Along the input axis, a_i.
    pendulous : ndarray
        Along the pendulous axis, a_p.
    output : ndarray
        Along the output axis, a_o.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> accelcal.Acceleration(np.array([1.0]), np.array([0.0]), np.array([0.0])).input
    array([1.])
    """

    input: Array
    pendulous: Array
    output: Array

    @property
    def cross(self) -> Array:
        """Along the cross axis in the plane of rotation: in a tumble test the other one is zero."""
        return self.pendulous + self.output

    def __eq__(self, other: object) -> bool:
        return equal(tuple(self), other)

    def __ne__(self, other: object) -> bool:
        return not self == other


def checked_fixture_angle(delta0: float) -> float:
    """Check a fixture angle.

    Parameters
    ----------
    delta0 : float
        Angle between head zero and input axis [rad].

    Returns
    -------
    float
        The same.

    Raises
    ------
    InputError
        If it is not finite, or larger than a fixture can be: then it was meant in degrees.

    Examples
    --------
    >>> checked_fixture_angle(0.001)
    0.001
    """
    check_number(delta0=delta0)
    if abs(delta0) > math.pi / 4.0:
        raise InputError(
            f"fixture angle {delta0:g} rad is above pi/4; give it in rad, {delta0:g} deg are"
            f" {math.radians(delta0):.6g} rad"
        )
    return delta0


def is_mounting(name: NDArray[Any]) -> Mask:
    """Tell which names are mountings.

    Parameters
    ----------
    name : ndarray of str
        Names.

    Returns
    -------
    ndarray of bool
        True where the name is one of `MOUNTINGS`.

    Examples
    --------
    >>> import numpy as np
    >>> is_mounting(np.array(["o+", "q"])).tolist()
    [True, False]
    """
    found = [np.asarray(name == mounting) for mounting in MOUNTINGS]
    return np.asarray(np.logical_or.reduce(found), dtype=np.bool_)


def accelerations(
    angle: ArrayLike, delta0: float = 0.0, mounting: ArrayLike = "o+"
) -> Acceleration:
    """Acceleration along the three axes at a head angle.

    Parameters
    ----------
    angle : array_like
        Head angle th [deg].
    delta0 : float, default 0
        Fixture angle d0 between the zero of the head and the input axis [rad].
    mounting : str or array_like of str, default "o+"
        One of `MOUNTINGS`, broadcast against `angle`.

    Returns
    -------
    Acceleration
        a_i = cos(th + d0) and, by the mounting, a_p or a_o = +-sin(th + d0) [local g].

    Raises
    ------
    InputError
        If a mounting is not one of `MOUNTINGS`, an angle is not finite, or `delta0` is none in rad.

    Notes
    -----
    Exact for any angle, with no expansion in d0. Multiples of 90 deg give exact zeros and ones
    at d0 = 0, so that what a position cannot show is zero and not 1e-17.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.accelerations([0, 90]).input.tolist()
    [1.0, 0.0]
    >>> accelcal.accelerations(90, mounting="p-").output.tolist()
    -1.0
    """
    checked_fixture_angle(delta0)
    degrees, kind = _with_mounting(number_array(angle, "angle"), mounting)
    if not np.isfinite(degrees).all():
        raise InputError(
            f"angle {degrees[~np.isfinite(degrees)].flat[0]}; it is a finite number of deg"
        )
    unknown = ~is_mounting(kind)
    if unknown.any():
        raise InputError(
            f"mounting {as_given(str(kind[unknown].flat[0]))} is unknown;"
            f" it is one of {', '.join(MOUNTINGS)}"
        )
    cosine, sine = _cos_sin_deg(degrees, delta0)
    cross = np.where((kind == "o-") | (kind == "p-"), -sine, sine)
    about_output_axis = (kind == "o+") | (kind == "o-")
    return Acceleration(
        input=cosine,
        pendulous=np.where(about_output_axis, cross, 0.0),
        output=np.where(about_output_axis, 0.0, cross),
    )


def _with_mounting(angle: Array, mounting: ArrayLike) -> tuple[Array, NDArray[np.str_]]:
    """Angles and mountings of one shape."""
    try:
        angle, kind = np.broadcast_arrays(angle, np.asarray(np.asarray(mounting), dtype=np.str_))
    except ValueError:
        raise InputError(
            f"mounting does not fit the angles of shape {angle.shape}; give one for all, or one for"
            " each"
        ) from None
    return angle, kind


def _cos_sin_deg(angle_deg: Array, delta0: float) -> tuple[Array, Array]:
    """Cosine and sine of (angle + delta0), exact at multiples of 90 deg when delta0 is 0."""
    quarter = np.round(angle_deg / 90.0)
    rest = np.radians(angle_deg - 90.0 * quarter) + delta0
    c, s = np.cos(rest), np.sin(rest)
    turn = np.mod(quarter, 4).astype(np.int64)
    cosine = np.choose(turn, [c, -s, -c, s])
    sine = np.choose(turn, [s, c, -s, -c])
    return cosine + 0.0, sine + 0.0  # + 0.0 turns -0.0 into 0.0
