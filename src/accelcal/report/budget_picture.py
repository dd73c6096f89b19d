"""An error budget as a stacked picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import Any

from accelcal.errors import InputError
from accelcal.report.budget import joint_variance, place

__all__ = ["FORMS", "budget_picture"]

Document = Mapping[str, Any]

FORMS = ("png", "svg")
"""Forms of a picture; the name of the file ends in one of them."""

_MICRO = 1e6
_COEFFICIENTS = "all coefficients together"
_LABELLED = 16  # bars; of more, the axis has numbers only


def budget_picture(document: Document, form: str) -> bytes:
    """Draw the components of a budget on top of one another, a bar a point.

    Parameters
    ----------
    document : mapping
        Document of a budget, as of `accelcal.results.error_budget.ErrorBudget.to_document`.
    form : str
        One of `FORMS`.

    Returns
    -------
    bytes
        The picture: systematic parts, bounds of (4), and shares of the expanded uncertainty.

    Raises
    ------
    InputError
        If the form is another, or matplotlib is not installed.

    Notes
    -----
    A component of standard uncertainty u_i has the share U u_i^2 / u_c^2 of the expanded
    uncertainty U, so that the shares add up to U. The errors of the coefficients are correlated and
    cancel in part, so they have one share together.
    """
    if form not in FORMS:
        raise InputError(f"picture {form!r}; name a file that ends in .{' or .'.join(FORMS)}")
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError(
            "a picture needs matplotlib; install it by pip install 'accelcal[plot]'"
        ) from None
    points = document["points"]
    width = max(9.0, min(5.0 + 0.8 * len(points), 16.0))
    figure = Figure(figsize=(width, 9.0), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    figure.suptitle(f"Error by (4), {document['serial'] or document['source']}")
    shown = _draw(panels, points)
    figure.legend(handles=list(shown.values()), loc="outside right center", fontsize="small")
    data = BytesIO()
    figure.savefig(data, format=form, dpi=150)
    return data.getvalue()


def _draw(panels: Sequence[Any], points: Sequence[Document]) -> dict[str, Any]:
    """Fill the panels; return one bar of each component, for the legend."""
    titles = ("systematic part", "bounds behind ± in (4), added", "shares of U (95 %), GUM")
    tables = _parts(points, "value"), _parts(points, "bound"), _shares(points)
    totals = ("systematic", "bound", "expanded_uncertainty")
    colours = _colours(tables)
    shown: dict[str, Any] = {}
    for axes, title, table, total in zip(panels, titles, tables, totals, strict=True):
        shown = _stack(axes, table, colours) | shown
        sums = [_MICRO * point[total] for point in points]
        shown["total"] = axes.plot(range(len(points)), sums, "kD", ms=4, label="total")[0]
        axes.set(title=title, ylabel="error [µg]")
        axes.axhline(0.0, color="black", lw=0.8)
        axes.grid(axis="y", alpha=0.3)
    _name_points(panels[-1], points)
    return shown


def _parts(points: Sequence[Document], key: str) -> dict[str, list[float]]:
    """Component -> its size at each point [ug]; those that are zero everywhere are left out."""
    table: dict[str, list[float]] = {}
    for point in points:
        for part in point["components"]:
            table.setdefault(_label(part), []).append(_MICRO * part[key])
    return {name: sizes for name, sizes in table.items() if any(sizes)}


def _shares(points: Sequence[Document]) -> dict[str, list[float]]:
    """Share of U of each component at each point [ug]; correlated ones have one share together."""
    shares: dict[str, list[float]] = {}
    for point in points:
        weight = _per_variance(point)
        shares.setdefault(_COEFFICIENTS, []).append(weight * joint_variance(point))
        for part in point["components"]:
            if not part["correlated"]:
                share = weight * part["standard_uncertainty"] ** 2
                shares.setdefault(_label(part), []).append(share)
    return {name: sizes for name, sizes in shares.items() if any(sizes)}


def _label(part: Document) -> str:
    return f"{part['symbol']}  {part['name']}"


def _per_variance(point: Document) -> float:
    variance = point["standard_uncertainty"] ** 2
    return _MICRO * point["expanded_uncertainty"] / variance if variance > 0.0 else 0.0


def _stack(
    axes: Any, table: Mapping[str, list[float]], colours: Mapping[str, Any]
) -> dict[str, Any]:
    """Stack the positive parts upwards and the negative ones downwards."""
    bars: dict[str, Any] = {}
    tops: dict[tuple[int, bool], float] = {}
    for name, sizes in table.items():
        bases = [tops.get((i, size < 0.0), 0.0) for i, size in enumerate(sizes)]
        bars[name] = axes.bar(range(len(sizes)), sizes, 0.7, bases, color=colours[name], label=name)
        for i, (base, size) in enumerate(zip(bases, sizes, strict=True)):
            tops[i, size < 0.0] = base + size
    return bars


def _colours(tables: Sequence[Mapping[str, list[float]]]) -> dict[str, Any]:
    """A colour for each component, the same in all panels."""
    from matplotlib import colormaps

    names = dict.fromkeys(name for table in tables for name in table)
    return dict(zip(names, colormaps["tab20"](range(20)), strict=False))


def _name_points(axes: Any, points: Sequence[Document]) -> None:
    if len(points) > _LABELLED:
        axes.set_xlabel("point, counted from 0 in the order of the table")
        return
    labels = [place(point).replace(", ", "\n") for point in points]
    axes.set_xticks(range(len(points)), labels, fontsize="small")
