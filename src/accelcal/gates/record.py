"""All gates of tables of one plan, and those on what several tables say together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from accelcal.arrays import Array, Places
from accelcal.estimate.joint import JointEstimate
from accelcal.estimate.launch import same_levels
from accelcal.estimate.reversal import clamping_of, tells_misalignment
from accelcal.estimate.tables import PreparedTable
from accelcal.gates.drift import drift
from accelcal.gates.order import order_of_positions
from accelcal.gates.replicates import closure, forward_against_back, outlier
from accelcal.gates.resolution import are_copies, copy_said, resolution
from accelcal.gates.sizes import proportions, units
from accelcal.gates.stack import TableStack
from accelcal.gates.verdict import SIGNIFICANT, GateStack, acceleration, angle, gate_stack, times
from accelcal.model import BIAS, MISALIGNMENT, SCALE_FACTOR
from accelcal.numerics.probability import f_exceeds, f_survival, written_p_value
from accelcal.plural import degrees_of_freedom

_IMPLAUSIBLE_HEAD = 1e-4  # rad, 20 arcsec
_LARGEST_SPREAD = {"K1": 0.2, "K0": 0.1}  # relative, and [g]
_LARGEST_TURN = 1e-4  # rad, of the misalignment at one temperature
_BEYOND_NOISE = 6.0  # standard uncertainties that it exceeds besides
_SMALLEST = 1e-300
_UNTOLD = (
    ": the head is worse than declared, or the model lacks an effect; U does not count that, and"
    " may be too small by this factor"
)
_SAME = 1e-12  # over K1: a difference of coefficients that rounding alone makes


class RecordStack(NamedTuple):
    """Fits of R records.

    Attributes
    ----------
    contrasts : ndarray, shape (R,)
        Number of contrasts of the position means that show a head error.
    squares : ndarray, shape (R,)
        Their squares over what noise and head error allow.
    head, head_dof : ndarray, shape (R,)
        Head error [rad] and its degrees of freedom.
    head_source : ndarray of str, shape (R,)
        ``"declared"``, ``"estimated"`` or ``"none"``.
    noise_dof : ndarray, shape (R,)
        Fewest degrees of freedom of the reading noise of its tables.
    coefficients : ndarray, shape (R, tables, 6)
        Coefficients [output unit / g^n].
    outputs : sequence of ndarray, shape (R, n)
        Readings of each table, NaN at a gap [output unit].
    noise : ndarray, shape (R, tables)
        Standard deviation of one of them [output unit]; NaN where nothing tells it.
    alike : sequence of ndarray of int
        Tables of one mounting, clamping and temperature that tell the misalignment, where there
        are several.
    tilt_noise : ndarray, shape (R, tables)
        What the reading noise does to M [output unit / g].
    names : callable
        What to call each table of a record.
    """

    contrasts: NDArray[Any]
    squares: Array
    head: Array
    head_dof: Array
    head_source: NDArray[np.str_]
    noise_dof: Array
    coefficients: Array
    outputs: Sequence[Array]
    noise: Array
    alike: Sequence[Places]
    tilt_noise: Array
    names: Callable[[int], Sequence[str]]

    @classmethod
    def of(
        cls,
        estimate: JointEstimate,
        tables: Sequence[PreparedTable],
        levels: Array,
        run_labels: Callable[[int], Sequence[str]],
    ) -> RecordStack:
        """Take what the gates look at from the estimate of R records; the tables are of any."""
        head = estimate.head
        seen = (head.dof > 0.0) | (head.source != "estimated")
        contrasts, squares = estimate.lack_of_fit.against(head.uncertainty)
        return cls(
            contrasts=contrasts,
            squares=squares,
            head=head.uncertainty,
            head_dof=head.dof,
            head_source=np.where(seen, head.source, "none"),
            noise_dof=np.min([noise.dof for noise in estimate.noises], axis=0),
            coefficients=np.stack(estimate.coefficients, axis=1),
            outputs=estimate.outputs,
            noise=np.stack([noise.factor for noise in estimate.noises], axis=1)
            * [table.usual_scatter for table in tables],
            alike=_clamped_alike(estimate, tables, levels[0]),
            tilt_noise=_tilt_noise(estimate),
            names=lambda record: _names(tables, run_labels(record)),
        )


def _names(tables: Sequence[PreparedTable], run_labels: Sequence[str]) -> list[str]:
    """Name tables, such as ``"run 2"``, with the mounting where there are several."""
    runs = [f"run {label}" for label in run_labels]
    if len({table.mounting for table in tables}) == 1:
        return runs
    return [f"{run}, mounting {t.mounting}" for run, t in zip(runs, tables, strict=True)]


def _clamped_alike(
    estimate: JointEstimate, tables: Sequence[PreparedTable], level: Array
) -> list[Places]:
    """Tables that tell one misalignment; in all records of a stack the same ones share a level."""
    kinds = [(table.mounting, clamping_of(table)) for table in tables]
    tell = [tells_misalignment(estimate, i) for i in range(len(tables))]
    found = []
    for kind in dict.fromkeys(kinds):
        own = np.array([t and k == kind for t, k in zip(tell, kinds, strict=True)])
        found += [at for at in same_levels(np.where(own, level, np.nan)) if at.size > 1]
    return found


def _tilt_noise(estimate: JointEstimate) -> Array:
    """Standard uncertainty of M of each table by the reading noise, zero where not estimated."""
    variance = estimate.components["reading"].variances
    nothing = np.zeros(variance.shape[:-1])
    found = [
        variance[..., estimate.place(i, "M")] if "M" in names else nothing
        for i, names in enumerate(estimate.names)
    ]
    return np.asarray(np.sqrt(np.stack(found, axis=-1)))


def gates_of_records(stack: RecordStack) -> tuple[GateStack, ...]:
    """Check what several tables say together, for each of R records.

    These are the lack of fit of the positions, and the agreement of the tables where there are
    several.
    """
    if stack.coefficients.shape[1] < 2:
        return (_lack_of_fit(stack),)
    return (_lack_of_fit(stack), _agreement(stack))


def _lack_of_fit(stack: RecordStack) -> GateStack:
    """Compare the position means with what reading noise and head error allow."""
    count, source = stack.contrasts, stack.head_source
    unknown, estimated = (count == 0) | (source == "none"), source == "estimated"
    declared = ~(unknown | estimated)
    ratio = stack.squares / np.maximum(count, 1)
    test = ratio, np.maximum(count, 1), np.maximum(stack.noise_dof, 1.0)
    bad = np.where(declared, f_exceeds(SIGNIFICANT, *test), stack.head > _IMPLAUSIBLE_HEAD)

    def said(index: int) -> str:
        size = angle(float(stack.head[index]))
        if estimated[index]:
            return (
                f"the positions scatter as if the head had an error of {size};"
                f" {degrees_of_freedom(float(stack.head_dof[index]))}"
            )
        p = written_p_value(f_survival(*(float(each[index]) for each in test)))
        return (
            f"position residuals {times(float(ratio[index]) ** 0.5)} times what reading noise and"
            f" the declared head error of {size} allow, {p}{_UNTOLD if bad[index] else ''}"
        )

    return gate_stack(
        "lack of fit",
        bad,
        said,
        [(unknown, "the errors of the positions cannot be separated from the reading noise")],
    )


def _agreement(stack: RecordStack) -> GateStack:
    """Compare scale factors and biases of the tables, and look for copies."""
    copies = _copies(stack)
    bias, k1 = (np.ascontiguousarray(stack.coefficients[..., i].T) for i in (BIAS, SCALE_FACTOR))
    scale_factor = k1 / np.sort(k1, axis=0)[(len(k1) - 1) // 2]
    far = np.abs(np.log(np.maximum(np.abs(scale_factor), _SMALLEST)))
    odd = np.where(scale_factor < 0.0, np.inf, far).argmax(axis=0)
    apart, spread = np.ptp(scale_factor, axis=0), np.ptp(bias / k1, axis=0)
    over = np.maximum(apart / _LARGEST_SPREAD["K1"], spread / _LARGEST_SPREAD["K0"])
    turned = _turned(stack)

    def said(index: int) -> str:
        if index in copies:
            return copy_said(*(stack.names(index)[table] for table in copies[index]))
        if apart[index] / _LARGEST_SPREAD["K1"] > 1.0:
            ratio = times(float(scale_factor[odd[index], index]))
            other = f"K1 of {stack.names(index)[odd[index]]} is {ratio} times that of the others"
            return f"{other}: another unit, sign or accelerometer"
        if over[index] <= 1.0 and index in turned:
            return _turn_said(stack, index, turned[index])
        percent = f"{100 * apart[index]:.2g} %"
        return f"K1 differs by {percent}, the bias by {acceleration(float(spread[index]))}"

    bad = over > 1.0
    bad[[*copies, *turned]] = True
    return gate_stack("agreement of tables", bad, said)


def _copies(stack: RecordStack) -> dict[int, tuple[int, int]]:
    """Records with two tables of the same readings, and which two, where chance makes none."""
    k1 = stack.coefficients[..., SCALE_FACTOR]
    order = np.argsort(k1, axis=1, kind="stable")  # the same coefficients are neighbours in it
    ordered = np.take_along_axis(stack.coefficients, order[..., None], axis=1)
    apart = np.abs(np.diff(ordered, axis=1)).max(axis=2)
    same = apart <= _SAME * np.abs(k1).max(axis=1, keepdims=True)
    found = {}
    for record, at in np.argwhere(same).tolist():
        first, second = sorted(order[record, at : at + 2].tolist())
        output = stack.outputs[first][record]
        if are_copies(output[~np.isnan(output)], float(stack.noise[record, first])):
            found[record] = (first, second)
    return found


def is_turn(change: ArrayLike, uncertainty: ArrayLike) -> Any:
    """Tell whether a change of the misalignment at one temperature is that of a new mounting.

    It is so beyond 20 arcsec and the noise, a standard uncertainty of a misalignment [rad].

    Examples
    --------
    >>> bool(is_turn(4e-4, 2e-6)), bool(is_turn(4e-4, 1e-4))
    (True, False)
    """
    return np.asarray(change) > _LARGEST_TURN + _BEYOND_NOISE * np.asarray(uncertainty)


def _turned(stack: RecordStack) -> dict[int, tuple[int, int]]:
    """Records with tables of one clamping and temperature whose misalignments differ, and which."""
    k1 = stack.coefficients[..., SCALE_FACTOR]
    delta, noise = stack.coefficients[..., MISALIGNMENT] / k1, stack.tilt_noise / np.abs(k1)
    found = {}
    for at in stack.alike:
        bad = is_turn(np.ptp(delta[:, at], axis=1), noise[:, at].max(axis=1))
        for record in np.flatnonzero(bad).tolist():
            own = delta[record, at]
            first, second = sorted((int(at[own.argmin()]), int(at[own.argmax()])))
            found[record] = (first, second)
    return found


def _turn_said(stack: RecordStack, record: int, pair: tuple[int, int]) -> str:
    first, second = pair
    tilt, k1 = (stack.coefficients[record, list(pair), i] for i in (MISALIGNMENT, SCALE_FACTOR))
    names, size = stack.names(record), angle(float(np.ptp(tilt / k1)))
    return (
        f"delta of {names[second]} differs by {size} from that of {names[first]} at the same"
        " temperature: the unit was mounted anew or turned in its fixture, or the foundation tilts;"
        " delta is that of its run alone, and a law through both is of neither"
    )


def gates_of_stack(stack: TableStack, tables: int = 1) -> tuple[GateStack, ...]:
    """Check T tables of one plan.

    The tables of the record of each share the false alarms of each gate.
    """
    level = SIGNIFICANT / tables
    gates: tuple[Callable[[TableStack], GateStack], ...] = (
        partial(closure, level=level),
        partial(drift, level=level),
        partial(forward_against_back, level=level),
        order_of_positions,
        partial(outlier, level=level),
        proportions,
        resolution,
        units,
    )
    return tuple(_checked(gate, stack) for gate in gates)


def _checked(gate: Callable[[TableStack], GateStack], stack: TableStack) -> GateStack:
    """Check the tables by one gate; those with gaps of which it may warn are looked at alone."""
    found, alone = gate(stack), stack.alone
    if alone is None:
        return found
    at = cache(lambda index: gate(alone(index)))
    for index in found.warned():
        found.verdict[index] = at(index).verdict[0]
    return found._replace(finding=lambda index: at(index).finding(0))
