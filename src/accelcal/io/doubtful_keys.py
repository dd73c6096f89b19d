"""Header lines that may declare something, but under a key that is not known."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from accelcal.io.vocabulary import KEYS

_SHORTEST = 6  # letters of a key below which one that is nearly alike means something else
_ALIKE = 0.85  # least likeness of two keys, of difflib; one wrong letter of seven
_NUMBER = re.compile(r"[+-]?[.,]?[0-9]")
_NAMES = [name for names in KEYS.values() for name in names if len(name) >= _SHORTEST]


def notes_of_keys(declared: Mapping[str, str]) -> Iterator[str]:
    """Say which header lines are kept as metadata, but nearly have a key that declares something.

    Parameters
    ----------
    declared : mapping of str to str
        Header lines by canonical key, or by the key as written where it is not known.

    Yields
    ------
    str
        A note for each line with a number whose key is misspelt.

    Examples
    --------
    >>> list(notes_of_keys({"head_uncertainity": "2e-5", "operator": "3"}))
    ["header line 'head_uncertainity' declares nothing: the key may be meant as head_uncertainty"]
    """
    for key in _with_numbers(declared):
        folded = re.sub(r"[\W_]+", "_", key).strip("_").casefold()
        near = _nearly_alike(folded)
        if near:
            meant = f"the key may be meant as {' or '.join(near)}"
            yield f"header line {key!r} declares nothing: {meant}"


def _with_numbers(declared: Mapping[str, str]) -> Iterable[str]:
    return (key for key, text in declared.items() if key not in KEYS and _NUMBER.match(text))


def _nearly_alike(key: str) -> list[str]:
    from difflib import get_close_matches  # few files have such a key

    return get_close_matches(key, _NAMES, n=2, cutoff=_ALIKE)
