"""What all results can do: be a document of JSON, be a table, and be read back."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, Self

from accelcal.errors import DocumentError
from accelcal.results.json_text import document_in, json_text

if TYPE_CHECKING:
    from os import PathLike

    import pandas as pd

__all__ = ["JsonResult", "StoredResult", "TabularResult"]


class JsonResult(ABC):
    """A result that is a document of JSON."""

    __slots__ = ()

    @abstractmethod
    def to_document(self) -> dict[str, Any]:
        """Return the result as the document that `to_json` writes."""

    def to_json(self, path: str | PathLike[str] | None = None) -> str:
        """Write the result as JSON.

        Parameters
        ----------
        path : path, optional
            File to write, whole or not at all; without it the text is only returned.

        Returns
        -------
        str
            The JSON text; numbers keep all their digits.
        """
        return json_text(self.to_document(), path)


class StoredResult(JsonResult):
    """A result that is read back from its document."""

    __slots__ = ()

    WRITER: ClassVar[str]
    """The command that writes such documents, for messages."""

    @classmethod
    @abstractmethod
    def from_document(cls, document: Any) -> Self:
        """Read the result from its document.

        Raises
        ------
        DocumentError
            If it is no such document.
        """

    @classmethod
    def _of_schema(
        cls,
        schema: str,
        document: Any,
        read: Callable[[dict[str, Any]], Self],
        damage: type[Exception] | tuple[type[Exception], ...] = TypeError,
    ) -> Self:
        """Read a document of one schema, and tell what is wrong with another or a damaged one."""
        found = document.get("schema") if isinstance(document, dict) else None
        if found != schema:
            raise DocumentError(f"schema {found!r} is not {schema!r}; give a file of {cls.WRITER}")
        try:
            return read(document)
        except KeyError as error:
            raise DocumentError(f"{error.args[0]} is missing; write it with {cls.WRITER}") from None
        except damage as error:
            raise DocumentError(f"{error}; write the file again with {cls.WRITER}") from None

    @classmethod
    def from_json(cls, source: str | PathLike[str]) -> Self:
        """Read a result from JSON text, or from a file.

        Parameters
        ----------
        source : str or path
            What `to_json` returns, or the path of the file that it wrote.

        Returns
        -------
        StoredResult
            Equal to the one that was written.

        Raises
        ------
        DocumentError
            If there is no such file, or its text is not such a document.
        """
        return cls.from_document(document_in(source, writer=cls.WRITER))


class TabularResult(ABC):
    """A result that is a tidy table."""

    __slots__ = ()

    @abstractmethod
    def rows(self) -> list[dict[str, Any]]:
        """List what was found, a flat dictionary a row."""

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the result.

        Returns
        -------
        pandas.DataFrame
            A line each of `rows`; ``frame.attrs["units"]`` maps columns to units.
        """
        from accelcal.results.frames import frame_of

        return frame_of(self.rows())
