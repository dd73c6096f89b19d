"""Gates: checks that warn before anyone believes a fit.

Each looks at one way in which a tumble test goes wrong without the fit noticing. A gate passes,
warns, or says why it could not look.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.noise import ReadingNoise
from accelcal.estimate.tables import PreparedTable
from accelcal.geometry import accelerations
from accelcal.model import COEFFICIENTS, design_matrix
from accelcal.probability import f_survival, student_survival
from accelcal.results.quantity import Gate

__all__ = ["record_gates", "table_gates"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_SIGNIFICANT = 0.01
_MUCH_BETTER = 9.0  # another order must leave a ninth of the squared residuals, a third of the rms
_OUT_OF_PROPORTION = {"K0": 0.2, "K2": 0.1, "K3": 0.1, "M": 0.1, "M_ip": 0.1}
_MICRO = 1e6


def table_gates(
    table: PreparedTable, coefficients: Array, noise: ReadingNoise, delta0: float = 0.0
) -> tuple[Gate, ...]:
    """Check one table.

    Parameters
    ----------
    table : PreparedTable
        The table.
    coefficients : ndarray, shape (6,)
        Its least-squares coefficients, zero where not estimated [output unit / g^n].
    noise : ReadingNoise
        Its reading noise.
    delta0 : float, default 0
        Fixture angle of the fit [rad].

    Returns
    -------
    tuple of Gate
        Closure, forward against back, order of positions, outlier, proportions, units.
    """
    return (
        _closure(table, coefficients, noise),
        _forward_against_back(table, coefficients),
        _order(table, delta0),
        _outlier(table, coefficients),
        _proportions(coefficients),
        _units(table),
    )


def record_gates(estimate: JointEstimate) -> tuple[Gate, ...]:
    """Check what several tables say together.

    Parameters
    ----------
    estimate : JointEstimate
        The fit of all tables of a record.

    Returns
    -------
    tuple of Gate
        Lack of fit of the positions, and agreement of the tables with one another.
    """
    return (_lack_of_fit(estimate), _agreement(estimate.coefficients))


def _warn_if(name: str, bad: bool, finding: str) -> Gate:
    return Gate(name, "warn" if bad else "pass", finding)


# ------------------------------------------------------------------------------------ closure


def _closure(table: PreparedTable, coefficients: Array, noise: ReadingNoise) -> Gate:
    """Y9 - Y1 of each stroke, and the same as end minus start in the order of time."""
    pairs = list(_returns(table))
    if not pairs or not noise.dof:
        return Gate("closure", "not assessed", "no stroke holds both J = 1 and the return to it")
    difference = np.array([after - before for after, before, _ in pairs])
    forward = np.array([1.0 if odd else -1.0 for _, _, odd in pairs])
    scale = abs(coefficients[1])
    error = noise.factor * float(np.median(table.scatter)) * np.sqrt(2.0 / len(pairs))
    means = difference.mean(), (forward * difference).mean()
    p = 2.0 * min(2.0 * student_survival(abs(m) / error, noise.dof) for m in means)
    text = ", ".join(
        f"{label} {m / scale * _MICRO:.2f} ug"
        for label, m in zip(("Y(return) - Y1", "end - start of a stroke"), means, strict=True)
    )
    return _warn_if(
        "closure", p < _SIGNIFICANT, f"{text}, standard error {error / scale * _MICRO:.2f} ug"
    )


def _returns(table: PreparedTable) -> Iterator[tuple[float, float, bool]]:
    """Output at the return, output at the start, whether the stroke goes forward."""
    record = table.record
    first = np.abs(record.angle) < 1e-6
    last = np.abs(record.angle - 360.0) < 1e-6
    for stroke in np.unique(record.stroke):
        own = record.stroke == stroke
        if (own & first).any() and (own & last).any():
            yield (
                float(record.output[own & last].mean()),
                float(record.output[own & first].mean()),
                bool(stroke % 2),
            )


# ---------------------------------------------------------------------- forward against back


def _forward_against_back(table: PreparedTable, coefficients: Array) -> Gate:
    """F test of the difference of the two directions at each position."""
    name = "forward against back"
    head, cell = np.unique(table.head, return_inverse=True)
    direction = table.record.stroke % 2
    both = np.bincount(cell * 2 + direction, minlength=2 * head.size).reshape(-1, 2)
    compared = (both > 0).all(axis=1)
    dof = int((both[compared] - 1).sum())
    if not compared.any() or dof < 1:
        return Gate(name, "not assessed", "needs two strokes or more in each direction")
    sums = np.bincount(cell * 2 + direction, table.record.output, minlength=2 * head.size)
    mean = sums.reshape(-1, 2) / np.maximum(both, 1)
    within = (table.record.output - mean[cell, direction]) ** 2
    variance = within[compared[cell]].sum() / dof
    difference = (mean[:, 1] - mean[:, 0])[compared]
    weight = 1.0 / (1.0 / both[compared]).sum(axis=1)
    ratio = float((weight * difference**2).mean() / max(variance, 1e-300))
    worst = int(np.argmax(np.abs(difference)))
    size = difference / abs(coefficients[1]) * _MICRO
    return _warn_if(
        name,
        f_survival(ratio, int(compared.sum()), dof) < _SIGNIFICANT,
        f"mean {size.mean():.2f} ug, largest {size[worst]:.2f} ug at {head[compared][worst]:g} deg",
    )


# ---------------------------------------------------------------------------- order of positions


def _order(table: PreparedTable, delta0: float) -> Gate:
    """Look for a mirrored, shifted or negated order under which the fit would be far better."""
    labels, angles, signs = _other_orders(table)
    if len(labels) < 2 or len(table.record) <= len(table.estimability.kept):
        return Gate("order of positions", "not assessed", "no residual to compare orders by")
    mounting = str(table.record.mounting[0])
    designs = design_matrix(accelerations(angles, delta0, mounting), mounting)
    squares = _residual_squares(
        designs[..., table.estimability.columns], signs * table.record.output
    )
    best = int(np.argmin(squares[1:])) + 1
    better = squares[0] > _MUCH_BETTER * squares[best]
    ratio = np.sqrt(squares[0] / squares[best]) if squares[best] > 0 else np.inf
    finding = (
        f"the residuals would be {ratio:.3g} times smaller with {labels[best]}"
        if better
        else "no other order of positions fits far better"
    )
    return _warn_if("order of positions", better, finding)


def _other_orders(table: PreparedTable) -> tuple[list[str], Array, Array]:
    """Angles and signs of the orders to compare; the first is the order as given."""
    record = table.record
    step = float(np.diff(np.unique(table.head)).min()) if np.unique(table.head).size > 1 else 0.0
    given = np.ones(len(record))
    labels, angles, signs = ["the order as given"], [record.angle], [given]
    for where, chosen in _groups_of_strokes(record.stroke):
        for how, angle in (
            ("mirrored (J counted against the turn)", -record.angle),
            ("shifted by one position", record.angle + step),
            ("shifted by one position the other way", record.angle - step),
            ("turned by half a turn", record.angle + 180.0),
        ):
            labels.append(f"{where} {how}")
            angles.append(np.where(chosen, angle, record.angle))
            signs.append(given)
        labels.append(f"the sign of the output of {where} changed")
        angles.append(record.angle)
        signs.append(np.where(chosen, -1.0, 1.0))
    return labels, np.array(angles), np.array(signs)


def _groups_of_strokes(stroke: NDArray[np.int64]) -> Iterator[tuple[str, Mask]]:
    numbers = np.unique(stroke)
    if numbers.size < 2:
        return
    even = stroke % 2 == 0
    if even.any() and not even.all():
        yield "the back strokes", even
    if numbers.size > 2:
        for number in numbers:
            yield f"stroke {number}", stroke == number


def _residual_squares(designs: Array, outputs: Array) -> Array:
    """Sum of squared residuals of each design, shape (designs,)."""
    basis = np.linalg.qr(designs).Q
    fitted = np.einsum("dnp,dmp,dm->dn", basis, basis, outputs, optimize=True)
    return np.asarray(((outputs - fitted) ** 2).sum(axis=1))


# ------------------------------------------------------------------------------------- outlier


def _outlier(table: PreparedTable, coefficients: Array) -> Gate:
    """Test the reading that its replicates contradict most (Bonferroni over all readings)."""
    record = table.record
    _, cell, members = np.unique(table.head, return_inverse=True, return_counts=True)
    size = members[cell]
    deviation = record.output - (np.bincount(cell, record.output) / members)[cell]
    dof = len(record) - members.size - 1
    if dof < 1 or members.max() < 3:
        return Gate("outlier", "not assessed", "needs three strokes at a position")
    leverage = np.where(size >= 3, 1.0 - 1.0 / size, np.inf)
    rest = np.maximum((deviation**2).sum() - deviation**2 / leverage, 1e-300)
    t = np.abs(deviation) / np.sqrt(leverage * rest / dof)
    worst = int(np.argmax(t))
    p = 2.0 * len(record) * student_survival(float(t[worst]), dof)
    place = f"stroke {record.stroke[worst]} at {record.angle[worst]:g} deg"
    if record.line is not None:
        place += f" (line {record.line[worst]})"
    away = deviation[worst] / leverage[worst] / abs(coefficients[1]) * _MICRO
    return _warn_if(
        "outlier",
        p < _SIGNIFICANT,
        f"{place} is {away:.2f} ug from the other strokes, t = {t[worst]:.1f}",
    )


# --------------------------------------------------------------------------- sizes and units


def _proportions(coefficients: Array) -> Gate:
    """Compare the error coefficients with what any accelerometer has."""
    scale_factor = coefficients[COEFFICIENTS.index("K1")]
    if scale_factor <= 0:
        finding = (
            f"K1 = {scale_factor:.6g} is not positive: the sign of the output is turned, or the"
            " positions are shifted by half a turn"
        )
        return Gate("proportions", "warn", finding)
    ratios = dict(zip(COEFFICIENTS, coefficients / scale_factor, strict=True))
    odd = [
        f"{name}/K1 = {ratios[name]:.3g} is above {limit}"
        for name, limit in _OUT_OF_PROPORTION.items()
        if abs(ratios[name]) > limit
    ]
    if abs(ratios["M"]) > _OUT_OF_PROPORTION["M"]:
        turn = np.degrees(np.arctan2(-ratios["M"], 1.0))
        odd.append(f"as if the positions were shifted by {turn:.1f} deg")
    return _warn_if(
        "proportions", bool(odd), ", ".join(odd) or "all coefficients in proportion to K1"
    )


def _units(table: PreparedTable) -> Gate:
    """Compare each reading with the median of its replicates."""
    record = table.record
    head, cell = np.unique(table.head, return_inverse=True)
    median = np.array([np.median(record.output[cell == k]) for k in range(head.size)])
    telling = np.abs(median[cell]) > 0.2 * np.abs(median).max()
    ratio = np.abs(record.output) / np.where(telling, np.abs(median[cell]), np.nan)
    wrong = telling & ((ratio > 5.0) | (ratio < 0.2))
    if not wrong.any():
        return Gate("units", "pass", "all strokes of one size")
    worst = int(np.flatnonzero(wrong)[0])
    return Gate(
        "units",
        "warn",
        f"{int(wrong.sum())} readings, the first in stroke {record.stroke[worst]} at"
        f" {record.angle[worst]:g} deg, are {ratio[worst]:.3g} times the other strokes:"
        " another unit or range",
    )


# ------------------------------------------------------------------------------- whole record

_IMPLAUSIBLE_HEAD = 1e-4  # rad, 20 arcsec


def _lack_of_fit(estimate: JointEstimate) -> Gate:
    """Compare the position means with what reading noise and head error allow."""
    found, head = estimate.lack_of_fit, estimate.head
    if found.contrasts.size == 0 or head.source == "none":
        return Gate(
            "lack of fit", "not assessed", "the positions leave no residual apart from the noise"
        )
    size = f"{head.uncertainty * _MICRO:.3g} urad"
    if head.source == "estimated":
        return _warn_if(
            "lack of fit",
            head.uncertainty > _IMPLAUSIBLE_HEAD,
            f"the positions scatter as if the head had an error of {size};"
            f" {found.contrasts.size} degrees of freedom",
        )
    allowed = 1.0 + (head.uncertainty * found.strengths) ** 2
    ratio = float((found.contrasts**2 / allowed).mean())
    dof = min(max(min(noise.dof for noise in estimate.noises), 1.0), 1e9)
    p = f_survival(ratio, found.contrasts.size, dof)
    return _warn_if(
        "lack of fit",
        p < _SIGNIFICANT,
        f"position residuals {np.sqrt(ratio):.2f} times what reading noise and the declared head"
        f" error of {size} allow, p = {p:.2g}",
    )


def _agreement(coefficients: Sequence[Array]) -> Gate:
    """Compare scale factors and biases of the tables."""
    k = np.array(coefficients)
    if len(k) < 2:
        return Gate("agreement of tables", "not assessed", "one table only")
    spread: Mapping[str, float] = {
        "K1": float(np.ptp(k[:, 1]) / np.abs(k[:, 1]).max()),
        "K0/K1": float(np.ptp(k[:, 0] / k[:, 1])),
    }
    text = f"K1 differs by {100 * spread['K1']:.2g} %, the bias by {spread['K0/K1']:.2g} g"
    return _warn_if("agreement of tables", spread["K1"] > 0.2 or spread["K0/K1"] > 0.1, text)
