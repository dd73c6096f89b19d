"""The catalogue as a page of the documentation.

``python -m accelcal.effects.page docs/effects.md`` writes the catalogue into the page again.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from accelcal.effects.catalogue import catalogue
from accelcal.effects.effect import Effect, Parameter

_PLACE = re.compile(r"(?<=<!-- catalogue -->\n).*?(?=<!-- end of the catalogue -->)", re.DOTALL)

_ACTS_ON = {
    "angle": "the true head angle [rad]",
    "temperature": "the true temperature [degC]",
    "output": "the indication Y / K1 [g]",
    "readings": "the reading, after noise [g]",
}


def with_catalogue(page: str, effects: Iterable[Effect]) -> str:
    """Put a list of effects into a page.

    Parameters
    ----------
    page : str
        Text with the marks ``<!-- catalogue -->`` and ``<!-- end of the catalogue -->``.
    effects : iterable of Effect
        The effects.

    Returns
    -------
    str
        The page with what `described` says between the marks.
    """
    return _PLACE.sub(lambda _: "\n" + "\n\n".join(map(described, effects)) + "\n\n", page)


def described(effect: Effect) -> str:
    """Describe an effect in Markdown.

    Parameters
    ----------
    effect : Effect
        The effect.

    Returns
    -------
    str
        All that its entry says.

    Examples
    --------
    >>> from accelcal.effects.catalogue import effect
    >>> print(described(effect("stroke-offset")))
    ### `stroke-offset`: offset between forward and back strokes
    <BLANKLINE>
    The output is higher on forward than on back strokes, by a constant.
    <BLANKLINE>
    - Term: `+c/2 forward, -c/2 back`; acts on the indication Y / K1 [g].
    - Looks like: Forward minus back is the same at all positions.
    - Told apart by: strokes in another order, to exclude a drift.
    - `offset` [g]: forward minus back, c.
    """
    return "\n".join(_lines(effect))


def _lines(effect: Effect) -> Iterator[str]:
    yield f"### `{effect.id}`: {effect.name}\n"
    yield f"{effect.physics}\n"
    yield f"- Term: `{effect.formula}`; acts on {_ACTS_ON[effect.acts_on]}."
    if effect.static:
        yield "- In use: `accelcal apply` takes it up, where the calibration has it."
    yield f"- Looks like: {effect.signature}"
    yield f"- Told apart by: {effect.to_tell_apart}."
    yield from (f"- {_parameter(item)}" for item in effect.parameters)


def _parameter(item: Parameter) -> str:
    default = "" if item.default is None else f"; {item.default:g} where none is given"
    return f"`{item.name}` [{item.unit}]: {item.meaning}{default}."


if __name__ == "__main__":
    file = Path(sys.argv[1])
    file.write_text(with_catalogue(file.read_text("utf-8"), catalogue()), "utf-8")
