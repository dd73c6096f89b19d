"""Numbers that pandas reads from text without losing a digit."""

from __future__ import annotations


def exact_numbers() -> dict[str, str]:
    r"""Options of `pandas.read_csv` by which each number becomes the float nearest to it.

    Returns
    -------
    dict of str
        Nothing from pandas 3.1 on, which has no other converter.

    Examples
    --------
    >>> import io
    >>> import pandas as pd
    >>> float(pd.read_csv(io.StringIO("K1\n1.3111044712102817"), **exact_numbers())["K1"][0])
    1.3111044712102817
    """
    import pandas as pd

    major, minor = map(int, pd.__version__.split(".")[:2])
    return {} if (major, minor) >= (3, 1) else {"float_precision": "round_trip"}
