"""Colours of pictures that the colour-blind tell apart, in light and dark.

They are those of Okabe and Ito (2008), "Color Universal Design", made lighter for dark paper.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours of a theme by what they are for."""

    name: str  # ``"light"`` or ``"dark"``
    # text and axes, what stands back, grid lines, and the ground
    ink: str
    muted: str
    grid: str
    paper: str
    series: tuple[str, ...]  # eight colours of data, the same hues in the same order in all themes
    middle: str  # middle of the scale of heat maps, which the first two of the series end


LIGHT = Palette(
    name="light",
    ink="#1b1f24",
    muted="#6b7178",
    grid="#e4e6e9",
    paper="#ffffff",
    series=(
        *("#0072b2", "#d55e00", "#009e73", "#cc79a7"),
        *("#e69f00", "#56b4e9", "#8c6d1f", "#5b4b9a"),
    ),
    middle="#f7f7f7",
)

DARK = Palette(
    name="dark",
    ink="#e8eaed",
    muted="#9aa0a6",
    grid="#3a3f45",
    paper="#15181c",
    series=(
        *("#56b4e9", "#ff8a4c", "#2ec4a0", "#e39bc4"),
        *("#f0c24b", "#a8d8f7", "#c9a85a", "#a99be0"),
    ),
    middle="#262b31",
)
