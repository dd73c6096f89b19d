"""The paper's equations (5) and (6) as printed, their errata, and the forms that replace them.

The print has errors, listed in `ERRATA`, so the printed forms are here for the record and for
tests, never as a default. There are three closed forms, each linear in the means Y1 .. Y9:

``"printed"``
    (6) letter by letter, `printed_estimates`;
``"sign-corrected"``
    what a reader guesses from (6): "+" in K1, M turned, no K3, `sign_corrected_estimates`;
``"closed-form"``
    exact at d0 = 0, made of the same readings, `corrected_estimates`.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.errors import InputError
from accelcal.geometry import accelerations
from accelcal.head_angles import turn_angles
from accelcal.model import COEFFICIENTS, design_matrix

__all__ = [
    "CLOSED_FORMS",
    "ERRATA",
    "Erratum",
    "corrected_estimates",
    "documented_bias",
    "estimator_matrix",
    "printed_estimates",
    "printed_outputs",
    "sign_corrected_estimates",
]

Array = NDArray[Any]
Number = Any  # a float, an array or a symbol: whatever adds, multiplies and divides
ROOT2: Number = math.sqrt(2.0)  # the tests put the symbolic root here and prove ERRATA exactly


def _printed_rows(d: Number, g: Number) -> tuple[tuple[Number, ...], ...]:
    """Factors of K0, K1, K2, K3, M and M_ip in each line of the printed (5)."""
    r, h = ROOT2, g / ROOT2  # h^2 = g^2/2 and h^3 = g^3/(2 sqrt2) in the print
    a1, a2, a3 = h * (1 - d), h**2 * (1 - 2 * d), h**3 * (1 - 3 * d)
    b1, b2, b3 = h * (1 + d), h**2 * (1 + 2 * d), h**3 * (1 + 3 * d)
    c1, c2, c3 = g * (1 - d**2 / 2), g**2 * (1 - d**2), g**3 * (1 - 3 * d**2 / 2)
    e1, e2, e3 = g * d, g**2 * d**2, g**3 * d**3
    return (
        (1, c1, c2, c3, e1, 0),  # eq. (5), Y1
        (1, a1, a2, a3, a1, g / 2 * (1 - r * d)),  # eq. (5), Y2
        (1, -e1, e2, -e3, c1, -g * d),  # eq. (5), Y3
        (1, -b1, b2, -b3, b1, g / 2 * (-1 - r * d)),  # eq. (5), Y4
        (1, -c1, c2, -c3, -e1, 0),  # eq. (5), Y5
        (1, -a1, a2, -a3, -a1, g / 2 * (1 + r * d)),  # eq. (5), Y6
        (1, e1, e2, e3, -c1, g * d),  # eq. (5), Y7
        (1, b1, b2, b3, -b1, g / 2 * (-1 + r * d)),  # eq. (5), Y8
    )


def printed_outputs(
    coefficients: Mapping[str, Number], delta0: Number = 0.0, g: Number = 1.0
) -> Array:
    """Outputs by the printed (5), misprints included; `accelcal.model.output` is exact.

    Parameters
    ----------
    coefficients : mapping of str to float or array_like
        Any of `accelcal.model.COEFFICIENTS`; those left out are zero [output unit / g^n].
    delta0 : float or array_like, default 0
        Fixture angle d0 [rad].
    g : float, default 1
        Local gravity in the unit that the coefficients use; 1 where that unit is local g.

    Returns
    -------
    ndarray, shape (..., 9)
        Y1 .. Y8 of (5), and Y9 = Y1 [output unit].

    Raises
    ------
    InputError
        If a coefficient is not one of `COEFFICIENTS`.

    Examples
    --------
    >>> printed_outputs({"K0": 0.004, "K1": 1.3})[[0, 2, 4]].round(3).tolist()
    [1.304, 0.004, -1.296]
    """
    unknown = [name for name in coefficients if name not in COEFFICIENTS]
    if unknown:
        raise InputError(f"{unknown[0]!r} is not a coefficient of (5): {', '.join(COEFFICIENTS)}")
    values = [coefficients.get(name, 0) for name in COEFFICIENTS]
    rows = _printed_rows(delta0, g)
    lines = [sum(map(operator.mul, row, values)) for row in rows]
    return np.stack(np.broadcast_arrays(*lines, lines[0]), axis=-1)  # Y9 is the return to Y1


def printed_estimates(
    position_means: ArrayLike, delta0: Number = 0.0, g: Number = 1.0
) -> dict[str, Array]:
    """Coefficients by the printed (6), misprints included.

    Parameters
    ----------
    position_means : array_like, shape (..., 9)
        Mean output in each position, Y1 .. Y9 [output unit].
    delta0 : float, default 0
        Fixture angle d0, which the printed M_ip uses [rad].
    g : float, default 1
        Local gravity in the unit of acceleration wanted; 1 for local g.

    Returns
    -------
    dict of str to ndarray, shape (...)
        K0, K1, K2, K3, M, M_ip as printed [output unit / g^n].

    Raises
    ------
    InputError
        If the last axis does not hold nine means.

    Notes
    -----
    On exact data K1 returns K3 g^2 / 4 and nothing of K1, K3 returns mostly bias, and M has the
    opposite sign: see `ERRATA` and `documented_bias`.

    Examples
    --------
    >>> means = printed_outputs({"K0": 0.004, "K1": 1.3, "M": 0.002})
    >>> {name: round(float(value), 6) for name, value in printed_estimates(means).items()}
    {'K0': 0.004, 'K1': 0.0, 'K2': 0.0, 'K3': 0.011314, 'M': -0.002, 'M_ip': 0.0}
    """
    y1, y2, y3, y4, y5, y6, y7, y8, y9 = _nine(position_means)
    K0 = (y3 + y7) / 2  # eq. (6), K0
    K1 = (y1 + y9 - 2 * y5 - ROOT2 * (y2 + y8 - y4 - y6)) / (8 * g)  # eq. (6), K1
    K2 = (y2 + y4 + y6 + y8 - 4 * K0) / (2 * g**2)  # eq. (6), K2
    K3 = ROOT2 / g**3 * (y2 + y6 - ROOT2 * g * K1)  # eq. (6), K3
    M = (y7 - y3) / (2 * g)  # eq. (6), M
    M_ip = (y2 + y6 - y4 - y8) / (2 * g) + 2 * K2 * g * delta0  # eq. (6), M_ip
    return {"K0": K0, "K1": K1, "K2": K2, "K3": K3, "M": M, "M_ip": M_ip}


def sign_corrected_estimates(position_means: ArrayLike, g: Number = 1.0) -> dict[str, Array]:
    """Coefficients by (6) with its signs put right: what a reader of the paper would guess.

    Parameters
    ----------
    position_means : array_like, shape (..., 9)
        Mean output in each position, Y1 .. Y9 [output unit].
    g : float, default 1
        Local gravity in the unit of acceleration wanted; 1 for local g.

    Returns
    -------
    dict of str to ndarray, shape (...)
        K0, K1, K2, M, M_ip [output unit / g^n]. There is no K3.

    Raises
    ------
    InputError
        If the last axis does not hold nine means.

    Notes
    -----
    K1, with "+" before the root, returns K1 + 0.75 K3 g^2 at d0 = 0.
    K3 is left out because this K1 has swallowed it: with it, and with Y2 - Y6 for the printed
    Y2 + Y6, the printed K3 would return 2 M / g^2 - K3 / 2. `corrected_estimates` has a K3.

    Examples
    --------
    >>> means = printed_outputs({"K1": 1.3, "K3": 0.0004, "M": 0.002})
    >>> {name: round(float(value), 6) for name, value in sign_corrected_estimates(means).items()}
    {'K0': 0.0, 'K1': 1.3003, 'K2': 0.0, 'M': 0.002, 'M_ip': 0.0}
    """
    y1, y2, y3, y4, y5, y6, y7, y8, y9 = _nine(position_means)
    K0 = (y3 + y7) / 2  # eq. (6), K0
    K1 = (y1 + y9 - 2 * y5 + ROOT2 * (y2 + y8 - y4 - y6)) / (8 * g)  # "+" for the printed "-"
    K2 = (y2 + y4 + y6 + y8 - 4 * K0) / (2 * g**2)  # eq. (6), K2
    M = (y3 - y7) / (2 * g)  # Y3 - Y7 for the printed Y7 - Y3
    M_ip = (y2 + y6 - y4 - y8) / (2 * g**2)  # g^2 for the printed g
    return {"K0": K0, "K1": K1, "K2": K2, "M": M, "M_ip": M_ip}


def corrected_estimates(position_means: ArrayLike, g: Number = 1.0) -> dict[str, Array]:
    """Coefficients by the corrected closed form, exact at d0 = 0.

    Parameters
    ----------
    position_means : array_like, shape (..., 9)
        Mean output in each position, Y1 .. Y9 [output unit].
    g : float, default 1
        Local gravity in the unit of acceleration wanted; 1 for local g.

    Returns
    -------
    dict of str to ndarray, shape (...)
        K0, K1, K2, K3, M, M_ip [output unit / g^n].

    Raises
    ------
    InputError
        If the last axis does not hold nine means.

    Notes
    -----
    From the same two sums as the printed K1, S90 = Y1 + Y9 - 2 Y5 = 4 g (K1 + K3 g^2) and
    S45 = Y2 + Y8 - Y4 - Y6 = sqrt2 g (2 K1 + K3 g^2)::

        K1 = (2 sqrt2 S45 - S90) / 4g        K3 = (S90 - sqrt2 S45) / 2g^3

    The rest is as in `sign_corrected_estimates`. What d0 adds is on the errata page.

    Examples
    --------
    >>> means = printed_outputs({"K1": 1.3, "K3": 0.0004, "M": 0.002})
    >>> {name: round(float(value), 6) for name, value in corrected_estimates(means).items()}
    {'K0': 0.0, 'K1': 1.3, 'K2': 0.0, 'K3': 0.0004, 'M': 0.002, 'M_ip': 0.0}
    """
    y1, y2, _, y4, y5, y6, _, y8, y9 = _nine(position_means)
    s90 = y1 + y9 - 2 * y5
    s45 = y2 + y8 - y4 - y6
    K1 = (2 * ROOT2 * s45 - s90) / (4 * g)
    K3 = (s90 - ROOT2 * s45) / (2 * g**3)
    found = sign_corrected_estimates(position_means, g) | {"K1": K1, "K3": K3}
    return {name: found[name] for name in COEFFICIENTS}


def _nine(position_means: ArrayLike) -> Array:
    """Position means with the position as the first axis."""
    means = np.asarray(position_means)
    if means.shape[-1:] != (9,):
        raise InputError(f"position means of shape {means.shape}; the last axis holds Y1 to Y9")
    return np.moveaxis(means, -1, 0)


CLOSED_FORMS: Mapping[str, Callable[..., dict[str, Array]]] = MappingProxyType(
    {
        "printed": printed_estimates,
        "sign-corrected": sign_corrected_estimates,
        "closed-form": corrected_estimates,
    }
)
"""The closed forms, by the names that they have as methods; only the printed one takes d0."""


def estimator_matrix(which: str, delta0: float = 0.0) -> NDArray[np.float64]:
    """Matrix of a closed form: estimate = matrix @ position means, in units of local g.

    Parameters
    ----------
    which : str
        One of `CLOSED_FORMS`.
    delta0 : float, default 0
        Fixture angle d0; only ``"printed"`` uses it [rad].

    Returns
    -------
    ndarray, shape (6, 9)
        A row for each of `accelcal.model.COEFFICIENTS`; NaN where the form has no estimate.

    Raises
    ------
    InputError
        If the closed form is unknown.

    Examples
    --------
    >>> estimator_matrix("closed-form")[0].tolist()
    [0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0]
    """
    if which not in CLOSED_FORMS:
        raise InputError(f"closed form {which!r} is unknown; it is {' or '.join(CLOSED_FORMS)}")
    fixed = {"delta0": delta0} if which == "printed" else {}
    rows = CLOSED_FORMS[which](np.eye(9), **fixed)
    return np.stack([rows.get(name, np.full(9, np.nan)) for name in COEFFICIENTS])


def documented_bias(which: str) -> NDArray[np.float64]:
    """Matrix that maps the true coefficients to what a closed form returns on exact data.

    Parameters
    ----------
    which : str
        One of `CLOSED_FORMS`.

    Returns
    -------
    ndarray, shape (6, 6)
        B in estimate = B @ truth at d0 = 0, in units of local g and in the order of
        `accelcal.model.COEFFICIENTS`; the identity, up to rounding, for ``"closed-form"``.

    Raises
    ------
    InputError
        If the closed form is unknown.

    Examples
    --------
    >>> abs(documented_bias("printed")[1]).round(12).tolist()
    [0.0, 0.0, 0.0, 0.25, 0.0, 0.0]
    """
    return estimator_matrix(which) @ design_matrix(accelerations(turn_angles(8)))


@dataclass(frozen=True, slots=True)
class Erratum:
    """One error of the print, in Markdown with formulas between dollar signs.

    Attributes
    ----------
    where : str
        Equation, lines and coefficient; unique, and plain text.
    printed, exact, consequence, remedy : str
        What is printed, what is right, what follows on exact data, and what accelcal does.
    """

    where: str
    printed: str
    exact: str
    consequence: str
    remedy: str = "the design matrix comes from (1) and the angles, never from (5)"


ERRATA = (
    Erratum(
        "(5) Y1, Y5: M_ip",
        "no term",
        r"$+M_{ip}\,g^2\delta_0$ in both",
        r"an output error of $M_{ip}\,g^2\delta_0$",
    ),
    Erratum(
        "(5) Y2, Y4, Y6, Y8: M",
        r"$\pm M\frac{g}{\sqrt2}(1\mp\delta_0)$ with the signs of $K_1$",
        r"$(1+\delta_0-\frac12\delta_0^2)$ in Y2, Y6, $(1-\delta_0-\frac12\delta_0^2)$ in Y4, Y8",
        r"an output error of $\sqrt2\,M g\,\delta_0$",
    ),
    Erratum(
        "(5) Y2, Y4, Y6, Y8: M_ip",
        r"$\pm M_{ip}\frac{g}{2}(1\mp\sqrt2\,\delta_0)$",
        r"$\pm M_{ip}\frac{g^2}{2}(1-2\delta_0^2)$",
        r"the wrong power of $g$, and a false output of $M_{ip}\,g\,\delta_0/\sqrt2$",
    ),
    Erratum(
        "(5) Y3, Y7: M_ip",
        r"$-M_{ip}\,g\,\delta_0$ in Y3, $+M_{ip}\,g\,\delta_0$ in Y7",
        r"$-M_{ip}\,g^2\delta_0$ in both",
        r"the wrong power of $g$, and an output error of $2M_{ip}\,g\,\delta_0$ in Y7",
    ),
    Erratum(
        "(5) Y2, Y4, Y6, Y8: K1, K3",
        r"$(1\mp\delta_0)$ and $(1\mp3\delta_0)$: nothing of second order",
        r"$(1\mp\delta_0-\frac12\delta_0^2)$ and $(1\mp3\delta_0+\frac32\delta_0^2)$",
        r"an output error of $K_1 g\,\delta_0^2/(2\sqrt2)$, though Y1 and Y5 keep such terms",
    ),
    Erratum(
        "(6) K1: sign",
        r"$-\sqrt2\,(Y_2+Y_8-Y_4-Y_6)$",
        r"$+\sqrt2\,(Y_2+Y_8-Y_4-Y_6)$",
        r"returns $K_3 g^2/4$: nothing of $K_1$ is left",
        r"sign-corrected: $+$; corrected: $K_1=(2\sqrt2\,S_{45}-S_{90})/4g$",
    ),
    Erratum(
        "(6) K1: claim",
        r"$\hat K_1\approx K_1(1-\frac12\delta_0^2)$",
        r"with $+$: $\hat K_1\approx K_1(1-\frac12\delta_0^2)+\frac34K_3g^2+M\delta_0$",
        r"$K_1$ takes up three quarters of $K_3$, and $M\delta_0$",
        r"corrected: $K_1$ free of $K_3$ at $\delta_0=0$",
    ),
    Erratum(
        "(6) K3",
        r"$\frac{\sqrt2}{g^3}[Y_2+Y_6-\sqrt2\,g\hat K_1]$",
        r"$(S_{90}-\sqrt2\,S_{45})/2g^3$",
        r"returns $2\sqrt2K_0/g^3+\sqrt2(K_2+M_{ip})/g-\frac12K_3$: mostly bias",
        "corrected: the exact form; sign-corrected: no K3",
    ),
    Erratum(
        "(6) M",
        r"$\frac{1}{2g}(Y_7-Y_3)$",
        r"$\frac{1}{2g}(Y_3-Y_7)$",
        r"returns $K_1\delta_0-M$: the opposite sign",
        r"$\frac{1}{2g}(Y_3-Y_7)=M-K_1\delta_0$, the effective misalignment",
    ),
    Erratum(
        "(6) M_ip",
        r"$\frac{1}{2g}[Y_2+Y_6-Y_4-Y_8]+2K_2g\,\delta_0$",
        r"$\frac{1}{2g^2}[Y_2+Y_6-Y_4-Y_8]+2K_2\delta_0$",
        r"returns $M_{ip}\,g$: the dimension of (5) as printed",
        r"divided by $g^2$; the same number in units of local $g$",
    ),
)
"""Every misprint of (5) and (6); the errata page shows and the tests prove each."""
