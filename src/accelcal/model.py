"""The accelerometer's output (1), its error (2) and the bound of its random bias (3).

Accelerations are in units of local g, so a coefficient of order n is per power n of local g.

======  ================  ======================  =============================================
symbol  multiplies        unit                    IEEE 1293 term
======  ================  ======================  =============================================
K0      1                 output unit             bias
K1      a_i               output unit / g         scale factor
K2      a_i^2             output unit / g^2       second-order nonlinearity coefficient
K3      a_i^3             output unit / g^3       third-order nonlinearity coefficient
M_O     a_p               output unit / g         misalignment of IA towards PA (about OA)
M_P     a_o               output unit / g         misalignment of IA towards OA (about PA)
M_ip    a_i a_p           output unit / g^2       cross-coupling coefficient of IA and PA
M_io    a_i a_o           output unit / g^2       cross-coupling coefficient of IA and OA
======  ================  ======================  =============================================

The paper writes the misalignment terms with + for both axes; IEEE 1293 writes
+ delta_o a_p - delta_p a_o. accelcal follows the paper.

One tumble test turns about one cross axis and sees the other only. What it sees is called **M** and
**M_ip** whatever the mounting (the paper's index "o(p)"): M_O and M_ip where OA lies along the
shaft, M_P and M_io where PA does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.kinds import expect, kind_of
from accelcal.arguments.numbers import number_array
from accelcal.arguments.options import check_choice
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.geometry import MOUNTINGS, Acceleration

__all__ = [
    "BIAS",
    "COEFFICIENTS",
    "COEFFICIENT_OF",
    "CROSS_AXES",
    "ERROR_TERMS",
    "ERROR_UNITS",
    "LAWS",
    "LAW_COEFFICIENTS",
    "MISALIGNMENT",
    "POWERS",
    "SCALE_FACTOR",
    "SEEN_IN_MOUNTING",
    "SLOPES",
    "WITHOUT_LAWS",
    "AxisTerms",
    "acceleration_error",
    "bias_bound",
    "coefficient_unit",
    "design_matrix",
    "law_units",
    "output",
    "symbol_of",
]

_TERMS: Mapping[str, Callable[[Acceleration], Array]] = MappingProxyType(
    {  # eq. (1), one entry a coefficient
        "K0": lambda a: np.ones_like(a.input),
        "K1": lambda a: a.input,
        "K2": lambda a: a.input**2,
        "K3": lambda a: a.input**3,
        "M_O": lambda a: a.pendulous,
        "M_P": lambda a: a.output,
        "M_ip": lambda a: a.input * a.pendulous,
        "M_io": lambda a: a.input * a.output,
    }
)

COEFFICIENTS = ("K0", "K1", "K2", "K3", "M", "M_ip")
"""Symbols of what one tumble test determines, in the order used everywhere."""

BIAS, SCALE_FACTOR, MISALIGNMENT = map(COEFFICIENTS.index, ("K0", "K1", "M"))
"""Places of K0, K1 and M among them."""

POWERS: Mapping[str, int] = MappingProxyType(
    {"K0": 0, "K1": 1, "K2": 2, "K3": 3, "M": 1, "M_ip": 2}
)
"""Power of g that each coefficient multiplies."""

ERROR_TERMS: Mapping[str, str] = MappingProxyType(
    {"K0": "k0", "K2": "k2", "K3": "k3", "M": "delta", "M_ip": "delta_ip"}
)
"""Coefficient of (1) -> coefficient of the error model (2), which is its quotient by K1."""

COEFFICIENT_OF: Mapping[str, str] = MappingProxyType(
    {"K1": "K1", **{error: name for name, error in ERROR_TERMS.items()}}
)
"""The other way round; K1 stands in both."""

ERROR_UNITS: Mapping[str, str] = MappingProxyType(
    {"k0": "g", "k2": "g/g^2", "k3": "g/g^3", "delta": "rad", "delta_ip": "g/g^2"}
)
"""Coefficient of the error model (2) -> its unit."""

LAWS: Mapping[str, str] = MappingProxyType({"k0": "lam", "K1": "beta", "delta": "gam"})
"""What follows a bilinear law of temperature in (4) -> symbol of the slopes of this law."""

LAW_COEFFICIENTS = tuple(COEFFICIENT_OF[law] for law in LAWS)
"""Coefficients of (1) that follow these laws."""

WITHOUT_LAWS = tuple(name for name in COEFFICIENTS if name not in LAW_COEFFICIENTS)
"""The others, whose quotients by K1 do not depend on temperature."""

SLOPES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        f"{symbol}{number}": (law, side)
        for law, symbol in LAWS.items()
        for number, side in ((1, "above"), (2, "below"))
    }
)
"""Symbol of a slope -> its law, and its side of T0."""

_SYMBOLS: Mapping[str, str] = MappingProxyType(
    {**ERROR_TERMS, "M_O": "delta_O", "M_P": "delta_P", "M_io": "delta_io"}
    | {
        f"{COEFFICIENT_OF[law]}{axis} {side} T0": symbol + axis
        for symbol, (law, side) in SLOPES.items()
        for axis in (("", "_O", "_P") if law == "delta" else ("",))
    }
)

SEEN_IN_MOUNTING: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "o": ("K0", "K1", "K2", "K3", "M_O", "M_ip"),
        "p": ("K0", "K1", "K2", "K3", "M_P", "M_io"),
    }
)
"""Terms of (1) that `COEFFICIENTS` stand for, by the axis that lies along the shaft."""


def symbol_of(name: str) -> str:
    """Symbol in (2) and (4) of a coefficient over K1, or of its slope on a side of T0.

    Parameters
    ----------
    name : str
        Such as ``"K0"`` or ``"K0 above T0"``.

    Returns
    -------
    str
        Such as ``"k0"`` or ``"lam1"``; the name itself if it has none.

    Examples
    --------
    >>> symbol_of("M"), symbol_of("M_O below T0"), symbol_of("K1")
    ('delta', 'gam2_O', 'K1')
    """
    return _SYMBOLS.get(name, name)


class AxisTerms(NamedTuple):
    """What a cross axis that a tumble test turns through the vertical is called, with its terms.

    Attributes
    ----------
    acceleration : str
        The acceleration along it, ``"a_p"`` or ``"a_o"``.
    name : str
        The same as a field of `accelcal.geometry.Acceleration`.
    misalignment, coupling : str
        Its terms in the error model (2).
    """

    acceleration: str
    name: str
    misalignment: str
    coupling: str


CROSS_AXES: Mapping[str, AxisTerms] = MappingProxyType(
    {
        "o": AxisTerms("a_p", "pendulous", "delta_O", "delta_ip"),
        "p": AxisTerms("a_o", "output", "delta_P", "delta_io"),
    }
)
"""Axis along the shaft of the head -> the cross axis that is turned."""


def coefficient_unit(name: str, output_unit: str | None = None) -> str:
    """Unit of a coefficient of a tumble test.

    Parameters
    ----------
    name : str
        One of `COEFFICIENTS`.
    output_unit : str, optional
        Output unit.

    Returns
    -------
    str
        The unit.

    Examples
    --------
    >>> coefficient_unit("K0", "mA"), coefficient_unit("K1", "mA"), coefficient_unit("K2")
    ('mA', 'mA/g', 'output unit/g^2')
    """
    power = POWERS[name]
    suffix = {0: "", 1: "/g"}.get(power, f"/g^{power}")
    return f"{output_unit or 'output unit'}{suffix}"


def law_units(output_unit: str | None = None) -> dict[str, tuple[str, str]]:
    """Units of the laws of temperature.

    Parameters
    ----------
    output_unit : str, optional
        Output unit.

    Returns
    -------
    dict of str to tuple of str
        Law -> unit of its value at T0, and of its slopes; those of K1 are relative.

    Examples
    --------
    >>> law_units("mA")["K1"]
    ('mA/g', '1/degC')
    """
    return {
        "k0": ("g", "g/degC"),
        "K1": (coefficient_unit("K1", output_unit), "1/degC"),
        "delta": ("rad", "rad/degC"),
    }


def output(coefficients: Mapping[str, ArrayLike], acceleration: Acceleration) -> Array:
    """Output of the accelerometer, equation (1).

    Parameters
    ----------
    coefficients : mapping of str to array_like
        Any of K0, K1, K2, K3, M_O, M_P, M_ip, M_io; those left out are zero [output unit / g^n].
    acceleration : Acceleration
        Along the three axes [local g]; the arrays broadcast.

    Returns
    -------
    ndarray
        Output Y [output unit].

    Raises
    ------
    InputError
        If a coefficient is not one of (1), or no number, or of a shape that does not broadcast.

    Examples
    --------
    >>> import accelcal
    >>> turn = accelcal.accelerations([0, 90, 180])
    >>> accelcal.output({"K0": 0.004, "K1": 1.3}, turn).round(3).tolist()
    [1.304, 0.004, -1.296]
    """
    if not hasattr(coefficients, "items"):
        raise InputError(
            f"{kind_of(coefficients)} in place of coefficients; give a mapping of names to numbers,"
            " such as {'K0': 0.004, 'K1': 1.3}"
        )
    expect(acceleration, Acceleration)
    unknown = [name for name in coefficients if name not in _TERMS]
    if unknown:
        raise InputError(
            f"coefficient {unknown[0]!r} is not in (1); it has {', '.join(_TERMS)} (M and M_ip of a"
            " calibration are M_O and M_ip of a mounting o, M_P and M_io of a mounting p)"
        )
    numbers = {name: number_array(value, name) for name, value in coefficients.items()}
    shapes = [np.shape(part) for part in (*acceleration, *numbers.values())]
    try:
        total = np.zeros(np.broadcast_shapes(*shapes))
    except ValueError:
        told = ", ".join(map(str, dict.fromkeys(shapes)))
        raise InputError(
            f"accelerations and coefficients of the shapes {told}; give arrays that broadcast"
        ) from None
    for name, value in numbers.items():
        total = total + value * _TERMS[name](acceleration)  # eq. (1)
    return total


def design_matrix(acceleration: Acceleration, mounting: str = "o+") -> Array:
    """Matrix that maps `COEFFICIENTS` to the outputs at the given accelerations.

    Its columns are the outputs (1) of an accelerometer with one coefficient equal to 1, so the
    expanded equations (5) are never written out.

    Parameters
    ----------
    acceleration : Acceleration
        Arrays of shape (n,) [local g].
    mounting : str, default "o+"
        That of the accelerations, one of `accelcal.geometry.MOUNTINGS`; its side is in their signs.

    Returns
    -------
    ndarray, shape (n, 6)
        Design matrix in powers of g.

    Raises
    ------
    InputError
        If the mounting is unknown.

    Examples
    --------
    >>> import accelcal
    >>> accelcal.design_matrix(accelcal.accelerations([0, 90])).tolist()
    [[1.0, 1.0, 1.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]]
    """
    check_choice(MOUNTINGS, mounting=mounting)
    names = SEEN_IN_MOUNTING[mounting[:1]]
    return np.stack([output({name: 1.0}, acceleration) for name in names], axis=-1)


def _error_name(coefficient: str) -> str:
    return coefficient.replace("M", "delta").replace("K", "k")


def acceleration_error(errors: Mapping[str, float], acceleration: Acceleration) -> Array:
    """Error of the measured acceleration, equation (2).

    Parameters
    ----------
    errors : mapping of str to float
        Any of k0, k1, k2, k3, delta_O, delta_P, delta_ip, delta_io [g/g^n].
    acceleration : Acceleration
        Along the three axes [local g].

    Returns
    -------
    ndarray
        (Y_R - Y_I) / K1 with Y_I = K10 a_i [local g].

    Raises
    ------
    InputError
        If a coefficient is not one of (2).

    Notes
    -----
    The printed (2) leaves out delta_ip a_i a_p, which the printed (4) has; it is kept here.

    Examples
    --------
    >>> from accelcal.geometry import accelerations
    >>> acceleration_error({"k0": 3e-3, "k2": 1e-4}, accelerations([0, 90])).round(6).tolist()
    [0.0031, 0.003]
    """
    names = {_error_name(name): name for name in _TERMS}
    unknown = [name for name in errors if name not in names]
    if unknown:
        raise InputError(f"coefficient {unknown[0]!r} is not in (2); it has {', '.join(names)}")
    return output({names[name]: value for name, value in errors.items()}, acceleration)


def bias_bound(time: ArrayLike, launch: float, drift_rate: float, fluctuation: float) -> Array:
    """Bound of the random bias error, equation (3).

    Parameters
    ----------
    time : array_like
        Time since the start of the launch, in the unit of `drift_rate`.
    launch : float
        Bound of the launch-to-launch bias k0L = t_P sigma_L [g].
    drift_rate : float
        Drift of the bias in a launch gamma_D [g per unit of time].
    fluctuation : float
        Bound of the fluctuation about the drift line k0F = t_P sigma_F [g].

    Returns
    -------
    ndarray
        0.5 sqrt(k0L^2 + (gamma_D t)^2 + k0F^2), never negative [g].

    Examples
    --------
    >>> float(bias_bound(0.0, 3e-5, 1e-6, 4e-5).round(9))
    2.5e-05
    """
    drift = drift_rate * np.asarray(time, dtype=np.float64)
    return 0.5 * np.sqrt(launch**2 + drift**2 + fluctuation**2)  # eq. (3)
