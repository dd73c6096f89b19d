"""What all that draws the pictures of a result have in common."""

from __future__ import annotations

from typing import Any, NoReturn

from accelcal.errors import InputError


class Pictures:
    """Pictures of a result, a method each."""

    __slots__ = ()

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
