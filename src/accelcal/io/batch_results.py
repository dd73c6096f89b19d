"""Which files are results of a batch: they are no tables of readings."""

from __future__ import annotations

import re

_FRAMES = (
    {"serial", "K1", "K1_standard_uncertainty"},
    {"serial", "coefficient", "T0_degC"},
)
"""Columns that tell the two frames of a batch from all other tables."""

_FAILURES = {"source", "message"}


def is_batch_result(text: str) -> bool:
    r"""Tell whether a text is a result of a batch.

    Parameters
    ----------
    text : str
        The text, or its first line.

    Returns
    -------
    bool
        True where it is, even if a spreadsheet has written it anew.

    Examples
    --------
    >>> is_batch_result("source,message\n"), is_batch_result("temperature,position,output\n")
    (True, False)
    """
    names = set(re.split("[,;\t]", text.partition("\n")[0].replace('"', "").strip("\ufeff\r")))
    return names == _FAILURES or any(names >= frame for frame in _FRAMES)
