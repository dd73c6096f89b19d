"""A page for each effect of the catalogue, made from the catalogue itself when the docs are built.

What a page says of designs is computed: the directions of all effects in a test of 4, 8, 12 or 24
positions, in a loop of temperatures, with times. Sphinx calls `write_pages` before it reads the
sources; ``python docs/effect_pages.py`` does the same, and writes the list of effects.md again.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from accelcal.discovery.columns import orthonormal
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.instance import candidates, column_of, instances_of, searched_among
from accelcal.discovery.noise.of_readings import ReadingNoise
from accelcal.discovery.prospects.audit import Aliases, aliases, carriers_in, designed
from accelcal.effects.catalogue import catalogue
from accelcal.effects.effect import Effect
from accelcal.effects.parameter import Parameter
from accelcal.model import symbol_of
from accelcal.plot.style import palette, picture
from accelcal.simulation import NOISE_FREE, TumblePlan, simulate

FOLDER = Path(__file__).parent / "effects"
LIST = Path(__file__).parent / "effects.md"
POSITIONS = (4, 8, 12, 24)
LEVELS = (20.0, 80.0, 20.0, -40.0)
NOISE = ReadingNoise(sigma=5e-6, rho=0.0, dof=0, tails=np.inf)

_UNSEEN = 0.02
"""Part of an effect that a test must leave to be drawn as a picture of it."""

_PLACE = re.compile(r"(?<=<!-- catalogue -->\n).*?(?=<!-- end of the catalogue -->)", re.DOTALL)

_ACTS_ON = {
    "angle": "the true head angle [rad]",
    "temperature": "the true temperature [degC]",
    "output": "the indication Y / K1 [g]",
    "readings": "the reading, after noise [g]",
}

Array = NDArray[np.float64]


class Design(NamedTuple):
    """What one test shows of the catalogue."""

    comparison: Comparison
    alike: dict[str, Aliases]
    absorbed: dict[str, tuple[str, ...]]


@cache
def design(positions: int) -> Design:
    """Work out what a test of some positions shows."""
    plan = TumblePlan(positions=positions, strokes=4, temperatures=LEVELS, timed=True)
    comparison = designed(simulate(plan=plan, noise=NOISE_FREE, seed=0), LEVELS[0], NOISE)
    found = candidates(searched_among(catalogue()), comparison.space, comparison.model.conditions)
    carriers = carriers_in(comparison.model, comparison.parameters)
    absorbed = {item.id: carriers(item) for item in found.hidden}
    return Design(comparison, {each.id: each for each in aliases(found)}, absorbed)


def with_catalogue(text: str) -> str:
    """Put the list of effects into a page, between its marks."""
    return _PLACE.sub(lambda _: "\n" + "\n\n".join(map(described, catalogue())) + "\n\n", text)


def described(effect: Effect) -> str:
    """Describe an effect in Markdown."""
    return "\n".join(_entry(effect))


def _entry(effect: Effect) -> Iterator[str]:
    yield f"### `{effect.id}`: {effect.name}\n"
    yield f"{effect.physics}\n"
    yield f"- Term: `{effect.formula}`; acts on {_ACTS_ON[effect.acts_on]}."
    if effect.static:
        yield "- In use: `accelcal apply` includes it, if the calibration has it."
    yield f"- Looks like: {effect.signature}"
    yield f"- Told apart by: {effect.to_tell_apart}."
    yield from (f"- {_parameter(item)}" for item in effect.parameters)


def _parameter(item: Parameter) -> str:
    default = "" if item.default is None else f"; {item.default:g} where none is given"
    return f"`{item.name}` [{item.unit}]: {item.meaning}{default}."


def page(effect: Effect) -> str:
    """Write the page of an effect in Markdown."""
    return "\n".join(_lines(effect)) + "\n"


def _lines(effect: Effect) -> Iterator[str]:
    yield described(effect).replace("### `", "# `", 1)
    if effect not in searched_among(catalogue()):
        yield "\nIt is no term in proportion to its size. It is found as a fault of readings, by"
        yield "replicates, before other effects are searched ([discovery](../discovery.md))."
        return
    yield f"\n## What it looks like\n\n![Signature of {effect.name}]({effect.id}.svg)\n"
    yield "Left: the mean effect on the readings, relative to its largest value in one of them."
    yield "Right: what is left of it after a fit of the base model, on 24 and 8 positions.\n"
    yield "## What a test sees of it\n"
    yield f"Computed for tests of 4 strokes at {', '.join(f'{level:g}' for level in LEVELS)} degC,"
    yield "with times. *The same as*: the cosine of the two is above 0.999, and no test of this"
    yield "design can separate them. *Hard to tell from*: the cosine is above 0.9.\n"
    yield "| positions | seen | the same as | hard to tell from |"
    yield "| --- | --- | --- | --- |"
    yield from (_row(effect, positions) for positions in POSITIONS)


def _row(effect: Effect, positions: int) -> str:
    shown = design(positions)
    if effect.id in shown.absorbed:
        taken = ", ".join(map(symbol_of, shown.absorbed[effect.id])) or "the base model"
        return f"| {positions} | no, absorbed by {taken} | | |"
    alike = shown.alike[effect.id]
    near = [f"{_link(name)} {cosine:.2f}" for name, cosine in alike.near]
    same = [_link(name) for name in alike.exact]
    return f"| {positions} | yes | {', '.join(same)} | {', '.join(near)} |"


def _link(name: str) -> str:
    return f"[{name}]({name}.md)"


class Along(NamedTuple):
    """What an effect is drawn along: a quantity, and a line for each of some groups."""

    label: str
    quantity: Array
    group: NDArray[np.intp]
    names: tuple[str, ...]

    def means(self, values: Array, number: int) -> tuple[Array, Array]:
        """Mean of the readings of a group at each value of the quantity."""
        own = self.group == number
        x, cell = np.unique(self.quantity[own], return_inverse=True)
        return x, np.bincount(cell, values[own]) / np.bincount(cell)

    def followed(self, values: Array) -> float:
        """Part of the squares that the means hold, less what chance gives them."""
        _, cell = np.unique(np.stack([self.quantity, self.group]), axis=1, return_inverse=True)
        mean = np.bincount(cell.ravel(), values) / np.bincount(cell.ravel())
        held = float((mean[cell.ravel()] ** 2).sum() / (values @ values))
        return held - mean.size / values.size


def _ways(positions: int) -> tuple[Along, ...]:
    c = design(positions).comparison.model.conditions
    sense, senses = (c.rotation < 0.0).astype(np.intp), ("forward", "back")
    levels, level = np.unique(c.excess, return_inverse=True)
    names = tuple(f"{LEVELS[0] + excess:g} degC" for excess in levels)
    one = np.zeros(sense.size, dtype=np.intp)
    return (
        Along("head angle [deg]", c.angle, sense, senses),
        Along("head angle [deg]", c.angle, level, names),
        Along("temperature [degC]", c.excess + LEVELS[0], one, ("",)),
        Along("time since the start of the run [min]", c.run_time / 60.0, one, ("",)),
        Along("time [h]", c.time / 3600.0, one, ("",)),
    )


def signature(effect: Effect) -> Figure:
    """Draw what an effect adds, and what the base model leaves of it."""
    column = _column(effect, 24)
    rest = _rest(column, 24)
    shown = rest if _is_left(rest, column) else column
    way = int(np.argmax([along.followed(shown) for along in _ways(24)]))
    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    _draw(left, _ways(24)[way], column, 24)
    for positions in (24, 8):
        own = _column(effect, positions)
        left_over = _rest(own, positions)
        if _is_left(left_over, own):
            _draw(right, _ways(positions)[way], left_over, positions)
        else:
            right.plot([], [], " ", label=f"{positions} positions: nothing")
    for ax, title in ((left, "the effect"), (right, "left by the base model")):
        ax.set_title(title, fontsize=9, loc="left")
        ax.set_xlabel(_ways(24)[way].label, fontsize=9)
        ax.axhline(0.0, color=palette().muted, lw=0.6)
        ax.tick_params(labelsize=8)
        if way < 2:
            ax.set_xticks(np.arange(0, 361, 90))
    left.set_ylabel("effect over its largest", fontsize=9)
    figure.legend(
        *right.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=3,
        fontsize=8,
        frameon=False,
    )
    return figure


def _is_left(rest: Array, column: Array) -> bool:
    return bool(np.abs(rest).max() > _UNSEEN * np.abs(column).max())


def _draw(ax: Axes, along: Along, values: Array, positions: int) -> None:
    in_time = "time" in along.label
    for number, name in enumerate(along.names):
        said = ", ".join(filter(None, [f"{positions} positions", name]))
        style = ("." if in_time else "-") if positions == 24 else "ox+"[number % 3]
        if positions == 24 and not in_time:
            style = ("-", "--", ":")[number % 3]
        colour = palette().series[number if along.names != ("",) else int(positions == 8)]
        x, mean = along.means(values, number)
        ax.plot(x, mean, style, color=colour, lw=1.3, ms=2 if style == "." else 4.5, label=said)


def _column(effect: Effect, positions: int) -> Array:
    """What an effect adds, where it leaves most, scaled to 1."""
    c = design(positions).comparison.model.conditions
    columns = [column_of(item, c) for item in instances_of(effect, c)]
    most = int(np.argmax([np.linalg.norm(_rest(each, positions)) for each in columns]))
    return np.asarray(columns[most] / np.abs(columns[most]).max())


def _rest(column: Array, positions: int) -> Array:
    comparison = design(positions).comparison
    basis = orthonormal(comparison.model.jacobian(comparison.parameters))
    return np.asarray(column - basis @ (basis.T @ column))


def write_pages(effects: Sequence[Effect] | None = None, folder: Path = FOLDER) -> None:
    """Write the pages and pictures of the catalogue into a folder."""
    folder.mkdir(exist_ok=True)
    for effect in effects or catalogue():
        (folder / f"{effect.id}.md").write_text(page(effect), "utf-8")
        if effect in searched_among(catalogue()):
            (folder / f"{effect.id}.svg").write_bytes(picture(signature(effect), "svg"))


if __name__ == "__main__":
    LIST.write_text(with_catalogue(LIST.read_text("utf-8")), "utf-8")
    write_pages()
