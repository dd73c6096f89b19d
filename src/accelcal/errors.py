"""The family of errors: each message gives the value, the rule and the remedy in one line.

Every class inherits :class:`AccelcalError` and the builtin that a caller would expect, so that
``except ValueError`` and ``except accelcal.AccelcalError`` both work.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Self, TypeVar

from accelcal.escapes import visible

__all__ = [
    "AccelcalError",
    "AccelcalWarning",
    "DesignError",
    "DocumentError",
    "InputError",
    "TableError",
    "located",
    "not_installed",
]

Result = TypeVar("Result")

MEMORY_FULL = "memory is full; close other programs, or give fewer readings at once"
"""What is wrong, and the remedy, where Python raises `MemoryError`."""


class AccelcalError(Exception):
    """Base class of all errors that accelcal raises on purpose.

    Examples
    --------
    >>> import accelcal
    >>> try:
    ...     accelcal.effect("hysteresys")
    ... except accelcal.AccelcalError as error:
    ...     print(type(error).__name__)
    InputError
    """

    def __str__(self) -> str:
        """One line that can be printed, whatever names stand in it."""
        return visible(super().__str__())


class InputError(AccelcalError, ValueError):
    """An argument or option has a value that breaks a rule.

    Attributes
    ----------
    source : str or None
        Name of the file that the message begins with; None where no file is concerned.

    Examples
    --------
    >>> import accelcal
    >>> try:
    ...     accelcal.effect("backlush")
    ... except accelcal.InputError as error:
    ...     print(str(error).split("; ")[0])
    effect 'backlush' is not in the catalogue
    """

    source: str | None = None

    def at(self, source: str, line: int | None = None) -> Self:
        """Put a place in front of the message.

        Parameters
        ----------
        source : str
            Name of the file.
        line : int, optional
            Line of the file, counted from 1.

        Returns
        -------
        InputError
            An error of the same class; the same error where it names a file already.

        Examples
        --------
        >>> import accelcal
        >>> str(accelcal.InputError("too few angles; add some").at("a.csv", 2))
        'a.csv:2: too few angles; add some'
        """
        if self.source is not None:
            return self
        error = type(self)(f"{_place(source, line)}: {self}")
        error.source = source
        return error


class TableError(InputError):
    """A table of readings is unusable.

    Parameters
    ----------
    problem : str
        What is wrong, with the offending value.
    remedy : str
        What would be right.
    source : str, optional
        Name of the file, ``"<stdin>"`` for standard input.
    line : int, optional
        Line of the file, counted from 1; None where the whole file is meant.

    Examples
    --------
    >>> import accelcal
    >>> print(accelcal.TableError("stroke 0", "strokes count from 1", source="a.csv", line=7))
    a.csv:7: stroke 0; strokes count from 1
    """

    def __init__(
        self, problem: str, remedy: str, *, source: str = "<table>", line: int | None = None
    ) -> None:
        self.problem = problem
        self.remedy = remedy
        self.source = source
        self.line = line
        super().__init__(f"{_place(source, line)}: {problem}; {remedy}")

    def __reduce__(self) -> tuple[object, ...]:
        # keyword-only arguments do not survive the pickling of a plain exception
        made = partial(type(self), source=self.source or "", line=self.line)
        return made, (self.problem, self.remedy)


def located(
    function: Callable[..., Result], *arguments: object, source: str, line: int | None = None
) -> Result:
    """Call a function whose refusal is one of a table.

    Parameters
    ----------
    function : callable
        What may raise an `InputError`.
    *arguments : object
        What it is called with.
    source, line : str and int
        Place that the error is about, as for `TableError`.

    Returns
    -------
    object
        What it returns.

    Raises
    ------
    TableError
        If it raises an `InputError`.

    Examples
    --------
    >>> from accelcal.units import output_unit
    >>> located(output_unit, "volts", source="a.csv", line=1)
    'V'
    """
    try:
        return function(*arguments)
    except TableError:
        raise
    except InputError as error:
        problem, _, remedy = str(error).partition("; ")
        raise TableError(problem, remedy, source=source, line=line) from None


def not_installed(what: str, package: str, extra: str) -> InputError:
    """Make the error of a package that is not installed.

    Parameters
    ----------
    what : str
        What needs it.
    package : str
        Name of the package.
    extra : str
        Name of the extra of accelcal that brings it.

    Returns
    -------
    InputError
        The error, to be raised.

    Examples
    --------
    >>> print(not_installed("Parquet", "pyarrow", "parquet"))
    Parquet needs pyarrow; install it with: pip install "accelcal[parquet]"
    """
    quoted = f'"accelcal[{extra}]"'  # double quotes are those of all shells, also on Windows
    return InputError(f"{what} needs {package}; install it with: pip install {quoted}")


def _place(source: str, line: int | None) -> str:
    name = source or "''"  # as of a variable of the shell that is not set
    return name if line is None else f"{name}:{line}"


class DesignError(InputError):
    """The positions of a test do not determine the coefficients that are asked for.

    Examples
    --------
    >>> import accelcal
    >>> plan = accelcal.TumblePlan(positions=4)
    >>> try:
    ...     accelcal.fit(accelcal.simulate(plan=plan, seed=1), strict=True)
    ... except accelcal.DesignError as error:
    ...     print(str(error).split("; ")[-1])
    add positions or ask for fewer coefficients
    """


class DocumentError(InputError):
    """A JSON document is not what its reader expects (schema, version, units).

    Examples
    --------
    >>> import accelcal
    >>> try:
    ...     accelcal.Calibration.from_json('{"schema": "accelcal/head/1"}')
    ... except accelcal.DocumentError as error:
    ...     print(str(error).split(" in place")[0])
    key schema: 'accelcal/head/1'
    """


class AccelcalWarning(UserWarning):
    """A result is usable, but the reader must know of a weakness.

    Examples
    --------
    >>> import warnings
    >>> import accelcal
    >>> calibration = accelcal.fit(accelcal.simulate(seed=1))
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore", accelcal.AccelcalWarning)
    ...     measured = accelcal.apply(calibration, 1.35, 20.0)
    """
