"""Damage of documents of JSON: the one place that words what is wrong with one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from accelcal.errors import DocumentError

Part = TypeVar("Part")


class DamageError(DocumentError):
    """A part of a document is not what it must be.

    Parameters
    ----------
    rule : str
        What stands there, and what belongs there.
    *keys : str or int
        Way to the part: keys of objects, and places in lists.
    remedy : str, optional
        What would be right; by default a file of the command that writes such documents.

    Examples
    --------
    >>> str(DamageError("'x' in place of a number", "tables", 0, "dof"))
    "key tables[0].dof: 'x' in place of a number"
    """

    def __init__(self, rule: str, *keys: str | int, remedy: str = "") -> None:
        self.rule = rule
        self.keys = keys
        self.remedy = remedy
        super().__init__(f"key {_way(keys)}: {rule}" if keys else rule)

    def within(self, key: str | int) -> DamageError:
        """Return the damage as one of the part that holds this one under a key."""
        return DamageError(self.rule, key, *self.keys, remedy=self.remedy)

    def told(self, writer: str) -> DocumentError:
        """Return the error of the whole document, which a command should have written."""
        return DocumentError(f"{self}; {self.remedy or f'give a file as {writer} writes it'}")


def read_as(kind: Callable[[Any], Part], document: Any, writer: str) -> Part:
    """Read a document.

    Parameters
    ----------
    kind : callable
        Takes the document, and gives what it holds or raises `DamageError`.
    document : object
        The document.
    writer : str
        The command that writes such documents.

    Returns
    -------
    object
        What it holds.

    Raises
    ------
    DocumentError
        If it is damaged, or another document.
    """
    try:
        return kind(document)
    except DamageError as damage:
        raise damage.told(writer) from None
    except RecursionError:
        raise DamageError("parts within parts without end").told(writer) from None


def _way(keys: tuple[str | int, ...]) -> str:
    steps = [
        f".{key}" if isinstance(key, str) and key.isidentifier() else f"[{repr(key)[:40]}]"
        for key in keys
    ]
    return "".join(steps).removeprefix(".")
