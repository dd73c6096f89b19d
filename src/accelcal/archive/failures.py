"""What goes wrong with one file, in the one line that `accelcal fit` would print."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from accelcal.errors import MEMORY_FULL, AccelcalError

Result = TypeVar("Result")


def attempt(source: str, function: Callable[..., Result], *arguments: object) -> Result | str:
    """Call a function that must not end a batch; a text tells why this file failed."""
    try:
        return function(*arguments)
    except AccelcalError as error:
        return one_line(error)
    except OSError as error:
        return f"{source}: cannot be read ({error.strerror or error}); give a file that can be"
    except MemoryError:
        return f"{source}: {MEMORY_FULL}"
    except Exception as error:  # a bug on one file must not cost the other thousands
        told = f"{type(error).__name__}: {' '.join(str(error).split())}"
        return f"{source}: a bug in accelcal ({told}); please report it with this file"


def one_line(error: AccelcalError) -> str:
    """Word an error as the command line does: behind ``error:`` where it names no file."""
    text = " ".join(str(error).splitlines())
    return text if getattr(error, "source", None) else f"error: {text}"


def reason(error: Exception) -> str:
    r"""Word an error of somebody else's in one line, by its name if it says nothing.

    Examples
    --------
    >>> reason(ValueError("no\nbucket")), reason(TimeoutError())
    ('no bucket', 'TimeoutError')
    """
    return " ".join(str(error).split()) or type(error).__name__
