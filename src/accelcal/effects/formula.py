"""Terms of effects as text: formulas of the conditions, read without running any code."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from accelcal.arrays import Array
from accelcal.effects.conditions import Conditions
from accelcal.errors import InputError

__all__ = ["FUNCTIONS", "STATIC", "SYMBOLS", "Formula"]

Value = Callable[[Conditions], Array]

SYMBOLS: dict[str, tuple[str, Value]] = {
    "a_i": ("acceleration along the input axis [g]", lambda c: c.input),
    "a_p": ("acceleration along the cross axis in the rotation plane [g]", lambda c: c.cross),
    "th": ("head angle [rad]", lambda c: np.radians(c.angle)),
    "dT": ("temperature above the reference, T - T0 [degC]", lambda c: c.excess),
    "t": ("time since the first reading of the record [s]", lambda c: c.time),
    "t_run": ("time since the first reading of the run [s]", lambda c: c.run_time),
    "r": ("sense of rotation: 1 on forward strokes, -1 on back strokes", lambda c: c.rotation),
    "h": ("1 after heating, -1 after cooling, 0 at the first level", lambda c: c.heating),
    "pi": ("3.14159...", lambda _: np.array(np.pi)),
}
"""Symbol -> what it means, and its value for each reading."""

STATIC = frozenset({"a_i", "a_p", "dT", "pi"})
"""Symbols that are known in use, where there is no test: those of a static effect."""

FUNCTIONS: dict[str, tuple[int, Callable[..., Array]]] = {
    "abs": (1, np.abs),
    "sign": (1, np.sign),
    "sqrt": (1, np.sqrt),
    "exp": (1, np.exp),
    "sin": (1, np.sin),
    "cos": (1, np.cos),
    "min": (2, np.minimum),
    "max": (2, np.maximum),
}
"""Function -> the number of its arguments, and the function."""

_OPERATORS: dict[type[ast.operator], Callable[..., Array]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
}
_SIGNS: dict[type[ast.unaryop], Callable[..., Array]] = {
    ast.UAdd: np.positive,
    ast.USub: np.negative,
}

_LONGEST = 300


@dataclass(frozen=True, slots=True)
class Formula:
    """A formula of the conditions, as the term of an effect.

    Attributes
    ----------
    text : str
        The formula: numbers, `SYMBOLS`, ``+ - * / ^ ( )`` and `FUNCTIONS`. ``theta`` is ``th``,
        ``**`` is ``^``.

    Raises
    ------
    InputError
        If there is anything else in it.

    Examples
    --------
    >>> Formula("a_i * abs(a_i)")
    Formula(text='a_i * abs(a_i)')
    >>> Formula("open('file')")
    Traceback (most recent call last):
    ...
    accelcal.errors.InputError: formula has "open('file')"; it takes numbers, a_i, a_p, th, dT, t, \
t_run, r, h, pi, + - * / ^ ( ) and abs, sign, sqrt, exp, sin, cos, min, max
    """

    text: str

    def __post_init__(self) -> None:
        _value_of(self.text)

    @property
    def symbols(self) -> frozenset[str]:
        """Symbols in it, such as ``a_i``."""
        names = re.findall(r"[A-Za-z_]\w*", self.text.replace("theta", "th"))
        return frozenset(names) & SYMBOLS.keys()

    def __call__(self, conditions: Conditions, coefficient: float = 1.0) -> Array:
        """Evaluate the formula for each reading.

        Parameters
        ----------
        conditions : Conditions
            Of n readings.
        coefficient : float, default 1
            Factor of all values.

        Returns
        -------
        ndarray, shape (n,)
            The values; not finite where the formula has none.
        """
        with np.errstate(all="ignore"):
            values = coefficient * _value_of(self.text)(conditions)
        return np.broadcast_to(values, conditions.angle.shape)


@lru_cache(maxsize=64)
def _value_of(text: str) -> Value:
    """Read a formula. What is not known by name here is refused: nothing is executed."""
    if len(text) > _LONGEST:
        raise InputError(f"formula has {len(text)} characters; it takes {_LONGEST} at most")
    try:
        return _read(ast.parse(" ".join(text.split()).replace("^", "**"), mode="eval").body)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"formula {text!r} is none; write one such as a_i * abs(a_i)") from None


def _read(node: ast.expr) -> Value:
    match node:
        case ast.Constant(value=int() | float() as number) if _is_number(number):
            return lambda _: np.array(float(number))
        case ast.Name(id="theta"):
            return SYMBOLS["th"][1]
        case ast.Name(id=name) if name in SYMBOLS:
            return SYMBOLS[name][1]
        case ast.UnaryOp(op=sign, operand=inner) if type(sign) in _SIGNS:
            return partial(_applied, _SIGNS[type(sign)], [_read(inner)])
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
            return partial(_applied, _OPERATORS[type(operator)], [_read(left), _read(right)])
        case ast.Call(func=ast.Name(id=name), args=given, keywords=[]) if name in FUNCTIONS:
            count, function = FUNCTIONS[name]
            if len(given) != count:
                raise InputError(f"formula has {_told(node)}; {name} takes {count} in brackets")
            return partial(_applied, function, [_read(item) for item in given])
    takes = f"numbers, {', '.join(SYMBOLS)}, + - * / ^ ( ) and {', '.join(FUNCTIONS)}"
    raise InputError(f"formula has {_told(node)}; it takes {takes}")


def _is_number(number: float) -> bool:
    return not isinstance(number, bool) and math.isfinite(number)


def _told(node: ast.expr) -> str:
    text = ast.unparse(node).replace("**", "^")
    return f'"{text}"' if "'" in text else f"'{text}'"


def _applied(function: Callable[..., Array], inner: list[Value], c: Conditions) -> Array:
    return function(*(value(c) for value in inner))
