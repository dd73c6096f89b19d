"""Files of calibrations: frames that a batch wrote, and documents of fits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from accelcal.errors import InputError
from accelcal.io.calibrations import read_calibrations
from accelcal.io.text import read_text
from accelcal.recalibrations.entries import Entry, entries_of

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["read_entries"]


def read_entries(paths: Sequence[str]) -> list[Entry]:
    """Read what some files say of units.

    Parameters
    ----------
    paths : sequence of str
        Frames of ``accelcal batch`` (CSV, or Parquet by its ending) and documents of
        ``accelcal fit`` (JSON).

    Returns
    -------
    list of Entry
        One a table.

    Raises
    ------
    InputError
        If a file cannot be read, or is neither of the two.
    """
    return [entry for path in paths for entry in _read(path)]


def _read(path: str) -> list[Entry]:
    if path.casefold().endswith((".parquet", ".pq")):
        return _named(path, _parquet(path))
    text = read_text(path, "result").text
    if text.lstrip().startswith("{"):
        return entries_of(read_calibrations(path).calibrations)
    return _named(path, _csv(path, text))


def _named(path: str, frame: pd.DataFrame) -> list[Entry]:
    try:
        return entries_of(frame)
    except InputError as error:
        raise error.at(path) from None


def _csv(path: str, text: str) -> pd.DataFrame:
    from io import StringIO

    import pandas as pd

    as_text: Any = {"serial": str, "date": str, "run": str, "source": str}
    try:
        # only what is empty is missing: a serial may be NA
        return pd.read_csv(StringIO(text), dtype=as_text, keep_default_na=False, na_values=[""])
    except ValueError:  # that of the parser is one too
        raise InputError(
            f"{path}: not a frame of results; give what accelcal batch -o RESULTS.csv wrote, or"
            " fit the table first"
        ) from None


def _parquet(path: str) -> pd.DataFrame:
    import pandas as pd

    try:
        return pd.read_parquet(path)
    except ImportError:
        raise InputError(
            f"{path}: Parquet needs pyarrow; install it with: pip install 'accelcal[parquet]'"
        ) from None
    except (OSError, ValueError) as error:
        told = str(error).splitlines()[0]
        raise InputError(f"{path}: cannot be read ({told}); give what batch wrote") from None
