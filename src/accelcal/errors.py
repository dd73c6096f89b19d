"""The family of errors: each message gives the value, the rule and the remedy in one line.

Every class inherits :class:`AccelcalError` and the builtin that a caller would expect, so that
``except ValueError`` and ``except accelcal.AccelcalError`` both work.
"""

from __future__ import annotations

__all__ = [
    "AccelcalError",
    "AccelcalWarning",
    "DesignError",
    "DocumentError",
    "InputError",
    "TableError",
]


class AccelcalError(Exception):
    """Base class of all errors that accelcal raises on purpose."""


class InputError(AccelcalError, ValueError):
    """An argument or option has a value that breaks a rule."""


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
    >>> print(TableError("stroke 0", "strokes count from 1", source="a.csv", line=7))
    a.csv:7: stroke 0; strokes count from 1
    """

    def __init__(
        self, problem: str, remedy: str, *, source: str = "<table>", line: int | None = None
    ) -> None:
        self.problem = problem
        self.remedy = remedy
        self.source = source
        self.line = line
        place = source if line is None else f"{source}:{line}"
        super().__init__(f"{place}: {problem}; {remedy}")

    def __reduce__(self) -> tuple[object, ...]:
        # keyword-only arguments do not survive the pickling of a plain exception
        return _rebuild_table_error, (self.problem, self.remedy, self.source, self.line)


def _rebuild_table_error(problem: str, remedy: str, source: str, line: int | None) -> TableError:
    return TableError(problem, remedy, source=source, line=line)


class DesignError(InputError):
    """The positions of a test do not determine the coefficients that are asked for."""


class DocumentError(InputError):
    """A JSON document is not what its reader expects (schema, version, units)."""


class AccelcalWarning(UserWarning):
    """A result is usable, but the reader must know of a weakness."""
