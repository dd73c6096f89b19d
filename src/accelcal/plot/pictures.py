"""What all that draws the pictures of a result have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, NoReturn, TypeVar

from accelcal.errors import InputError

__all__ = ["Pictures"]

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Pictures(Generic[R]):
    """Pictures of a result, a method each.

    Each method draws into the matplotlib axes that it is given, or makes a figure of its own, and
    returns the axes; ``ax.figure`` is the figure. `accelcal.plot.style.theme` chooses dark colours.

    Attributes
    ----------
    result : object
        The result.
    """

    result: R

    def __call__(self, *_: Any, **__: Any) -> NoReturn:
        """Say which pictures there are, where one is asked for as pandas has it.

        Raises
        ------
        InputError
            Always.
        """
        mine = {name for name, value in vars(type(self)).items() if callable(value)}
        names = ", ".join(f".plot.{name}()" for name in sorted(mine) if not name.startswith("_"))
        raise InputError(f".plot() is no picture; choose {names}")
