"""Whether a record disagrees with its calibration, by all that is uncertain in both.

What few degrees of freedom leave open counts in the chances. An error of a size s that was
estimated with v degrees of freedom may have the size s sqrt(v / x), x of a chi-square distribution
of v. The chance under each of these sizes, averaged over them, is that of Student's distribution
(of one direction) or of Fisher's (of several) where no other error is there, and lies between
theirs and that of known errors where there are others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import (
    head_columns,
    lengths,
    orthonormal,
    saturated,
    without,
)
from accelcal.discovery.factors import Block, blocks, by_factor, pattern, shares, structure
from accelcal.discovery.family import chance
from accelcal.discovery.new_record.changes import Changed, Uncertain, changes, wider
from accelcal.discovery.new_record.errors_counted import (
    HEAT,
    by_usual_heat,
    freedom,
    of_undetermined,
    size_counted,
    too_little_told,
    undetermined,
    untold,
)
from accelcal.discovery.new_record.same_clamping import Seen, head_difference, is_turned_over
from accelcal.discovery.noise.of_readings import FEWEST_REPLICATES, acting, covariance
from accelcal.discovery.space import Covariance, Space, space_of, whitener_of
from accelcal.numerics.covariance import covariance_root
from accelcal.numerics.one_thread import in_one_thread
from accelcal.numerics.probability import LEVEL, NORMAL_FACTOR, student_quantile
from accelcal.results.agreement import (
    ALPHA,
    HIDING,
    HIDING_HEAT,
    chance_if_known,
    chance_of,
    least_of,
)
from accelcal.results.disagreement import RunChange
from accelcal.results.findings import Share
from accelcal.results.quantity import ErrorSource, Quantity

_LEVEL = 0.5 * ALPHA
"""Chance below which a factor disagrees: it is one of two tests, see `_chance_of_runs`."""


class Judged(NamedTuple):
    """What disagrees, by what was taken as uncertain; changes as they are `seen` best."""

    where: tuple[Share, ...]
    reduced_chi2: float
    structure: str
    runs: tuple[RunChange, ...]
    p_value: float
    seen: tuple[Quantity, ...]
    explained_by: tuple[str, ...] = ()

    def told(self) -> dict[str, Any]:
        """What a result has of it."""
        return {name: own for name, own in self._asdict().items() if name != "seen"}


def judge(seen: Seen, same: bool | None) -> Judged:
    """Judge a record, measured on the `same` head as its calibration, on another, or on either.

    What errors that nothing tells, or too little, may have made is explained by them.
    """
    judged = _whatever_the_head(seen, same)
    if judged.p_value < ALPHA:
        return judged._replace(explained_by=_untold(seen, same))
    known = least_of([chance_if_known(own) for own in judged.seen])
    if known >= _LEVEL:
        return judged
    return judged._replace(explained_by=too_little_told(seen.fixtures.calibration, seen.known))


def _untold(seen: Seen, same: bool | None) -> tuple[str, ...]:
    """Errors that nothing tells: all of them, where nothing disagrees if they may hide it.

    A calibration tells nothing of another head, nor of one whose known errors were taken out of it.
    """
    calibration, found, _ = seen.fixtures
    names = untold(calibration, seen.known)
    told = same and "head_uncertainty" in seen.known
    if seen.record.apparatus.head_uncertainty is None and not told:
        names = list(dict.fromkeys(["head_uncertainty", *names]))
    sizes = {name: HIDING_HEAT if name == HEAT else HIDING for name in names}
    lost = HIDING * of_undetermined(calibration, found)
    free = seen._replace(
        errors=seen.errors._replace(rest=seen.errors.rest + lost @ lost.T),
        declared=replace(seen.declared, **sizes),
        known={name: own for name, own in seen.known.items() if name not in names},
    )
    explaining = (*names, *found.undetermined)
    if not explaining or _whatever_the_head(free, same).p_value < ALPHA:
        return ()
    return explaining


@in_one_thread()
def _whatever_the_head(seen: Seen, same: bool | None) -> Judged:
    """Judge by one head, or by two; where nothing tells which, by what is more uncertain.

    On the same side of an axis two heads always leave more uncertain than one.
    """
    turned_over = is_turned_over(seen.fixtures.calibration, seen.record)
    if same is not None or not turned_over or not seen.errors.positions.size:
        return _judged(seen, bool(same))
    one, two = _judged(seen, same=True), _judged(seen, same=False)
    nearer = max(one, two, key=lambda judged: judged.p_value)
    runs = tuple(map(wider, one.runs, two.runs))
    return nearer._replace(runs=runs)


def _judged(seen: Seen, same: bool) -> Judged:
    """Judge with the head of the calibration under the record, or with another one."""
    c, by_error = seen.simulated.conditions, seen.simulated.by_error
    larger, by_head = seen.errors.larger(seen.dof, head=not same), _by_head(seen, same)
    sizes = np.sqrt(np.diagonal(larger))
    of_calibration = by_error @ covariance_root(larger, np.where(sizes > 0.0, sizes, 1.0))
    by_fixture = seen.fixtures.difference(by_error, same=same)
    spread = _spread(seen).with_shared(np.hstack([of_calibration, by_head, by_fixture]))
    space = _space(seen, spread)
    coordinates = space.see(seen.simulated.residual)
    factors = blocks(space, c, first="run")
    single = chances(space, coordinates, factors, seen.dof, _estimated(seen, same, larger))
    where = shares(coordinates, factors, single)
    worst = max(range(len(where)), key=lambda i: (where[i].p_value < _LEVEL, where[i].share))
    told, block = "", factors[worst]
    if where[worst].p_value < _LEVEL:
        shape = pattern(space, coordinates, block)
        told = structure(c, seen.record.run_labels, block.factor, shape)
    factor, dof = _head_as_counted(seen)
    known = Uncertain(
        spread=spread,
        larger=larger,
        by_head=by_head,
        head_factor=factor,
        head_dof=dof,
        one_head=same,
        lost=undetermined(seen.fixtures.found),
        columns=_columns(seen),
    )
    by_factors, found = by_factor(where), list(changes(seen, known))
    return Judged(
        where=by_factors,
        reduced_chi2=float(coordinates @ coordinates) / coordinates.size,
        structure=told,
        runs=tuple(run.told for run in found),
        p_value=least_of([min(own.p_value for own in by_factors), _chance_of_runs(seen, found)]),
        seen=tuple(own for run in found for own in run.seen.values()),
    )


def _columns(seen: Seen) -> Array:
    """What a change of each error does to the readings, see `Uncertain`."""
    calibration, found, _ = seen.fixtures
    columns = seen.simulated.by_error.copy()
    columns[:, undetermined(found)] = columns @ of_undetermined(calibration, found)
    return columns


def _chance_of_runs(seen: Seen, runs: Sequence[Changed]) -> float:
    """Chance of any change in a run.

    A factor has many directions. Where few degrees of freedom tell the launches, a change in one
    of them is seen by itself only. Its own degrees of freedom are those of 95 %; farther out, those
    of what shifts it from launch to launch count.
    """
    shifted = {"bias": "launch_uncertainty", "scale_factor": "launch_sf_uncertainty"}
    told = {name: seen.known.get(error) for name, error in shifted.items()}
    fewest = {name: freedom(source) for name, source in told.items() if source is not None}
    seen_by_name = [pair for run in runs for pair in run.seen.items()]
    return least_of([chance_of(own, fewest.get(name, np.inf)) for name, own in seen_by_name])


def _estimated(seen: Seen, same: bool, larger: Array) -> Estimated:
    """Errors whose sizes the calibration tells: its own, those of the head and of launches."""
    c, by_error = seen.simulated.conditions, seen.simulated.by_error
    columns = acting(c)
    if same:
        columns["head_uncertainty"] = head_difference(seen.errors, seen.simulated, seen.record)
    others = [(columns[name], source) for name, source in seen.known.items()]

    def covariance(of_calibration: Array, size: Callable[[ErrorSource], float]) -> Array:
        sizes = [np.full(own.shape[1], size(source)) for own, source in others]
        whole = np.diag(np.concatenate([np.zeros(len(of_calibration)), *sizes]) ** 2)
        whole[: len(of_calibration), : len(of_calibration)] = of_calibration
        return whole

    return Estimated(
        acting=np.hstack([by_error, *(own for own, _ in others)]),
        counted=covariance(larger, size_counted),
        sized=lambda factor: covariance(
            seen.errors.sized(factor, head=not same),
            lambda source: (source.value or 0.0) * factor(freedom(source)),
        ),
    )


def _by_head(seen: Seen, same: bool) -> Array:
    """What the errors of the head do to the differences, of the size that they count with [g]."""
    size = seen.declared.head_uncertainty or 0.0
    if same:
        return size * head_difference(seen.errors, seen.simulated, seen.record)
    return size * head_columns(seen.simulated.conditions)


def _head_as_counted(seen: Seen) -> tuple[float, float]:
    """Size of the head's errors over its estimate, and the degrees of freedom of that."""
    if seen.record.apparatus.head_uncertainty is not None:
        return 1.0, np.inf
    dof = seen.errors.head_dof
    return student_quantile(LEVEL, dof) / NORMAL_FACTOR, dof


def _spread(seen: Seen) -> Covariance:
    """Covariance of all errors but those of the head and of the calibration's coefficients."""
    others = replace(seen.declared, head_uncertainty=None)
    own = covariance(seen.simulated.conditions, seen.noise, others, seen.step)
    return own.with_shared(np.hstack([seen.paused, by_usual_heat(seen)]))


def _space(seen: Seen, spread: Covariance) -> Space:
    record, noise, c = seen.record, seen.noise, seen.simulated.conditions
    # Noise without degrees of freedom is taken as known. All that is left then counts as repeating,
    # and no replicates are set apart to estimate the noise anew.
    repeating = saturated(c, record.mounting) if noise.dof else np.eye(len(record))
    return space_of(whitener_of(spread), np.empty((len(record), 0)), repeating)


_ENDLESS = 10**6
_LOGITS = np.linspace(-14.0, 14.0, 41)
"""Logits of the probabilities at which sizes are tried; the trapezoidal rule is exact enough."""

_NEW = 1e-6
"""Part of a column beyond others above which it is not rounding."""


class Estimated(NamedTuple):
    """Errors of which some sizes were estimated."""

    acting: Array  # change of the n readings by each error, (n, k) [g per unit]
    counted: Array  # covariance of the errors that the space is whitened by, (k, k)
    sized: Callable[[Callable[[float], float]], Array]
    """The covariance, were the sizes other than estimated: of a function that gives the size over
    its estimate, of the degrees of freedom of that."""


def chances(
    space: Space,
    seen: Array,
    blocks: Sequence[Block],
    known_dof: float,
    errors: Estimated,
) -> list[float]:
    """Chance that noise makes each factor disagree as much, not yet honest for their number.

    Each of the blocks is orthogonal to those before it. Of the noise that the space is whitened by,
    the degrees of freedom are known, where no replicates tell it anew.
    """
    repeated = space.dof >= FEWEST_REPLICATES
    dof = space.dof if repeated else min(known_dof, _ENDLESS)
    variance = float(space.pure_error(seen)) / dof if repeated else 1.0
    sizes = [block.basis.shape[1] for block in blocks]
    tried = list(_under_all_sizes(space, seen, blocks, errors))
    return [
        float(
            sum(
                weight * chance(np.array(each[i] / size / variance), dof, size)
                for weight, each in tried
            )
        )
        for i, size in enumerate(sizes)
    ]


def _under_all_sizes(
    space: Space, seen: Array, blocks: Sequence[Block], errors: Estimated
) -> Iterator[tuple[float, list[float]]]:
    """Weight of each size that is tried, and the sums of squares of the blocks under it.

    Under another covariance, what a factor has beyond those before it are innovations: Cholesky's
    factor forms them, of the factors in the reverse of their order.
    """
    from scipy.linalg import solve_triangular  # type: ignore[import-untyped]

    acting = space.see(errors.acting)
    bases = np.hstack([block.basis for block in reversed(blocks)])
    left = without(acting, bases)
    beyond = orthonormal(left[:, lengths(left) > _NEW * lengths(acting)])
    coordinates = np.hstack([beyond, bases]).T
    shown, acted = coordinates @ seen, coordinates @ acting
    ends = np.cumsum([block.basis.shape[1] for block in blocks])
    for weight, factor in sizes_left_open():
        change = acted @ (errors.sized(factor) - errors.counted) @ acted.T
        lower = np.linalg.cholesky(np.eye(shown.size) + change)
        squares = np.cumsum(solve_triangular(lower, shown, lower=True)[::-1] ** 2)[ends - 1]
        yield weight, np.diff(squares, prepend=0.0).tolist()


def sizes_left_open() -> Iterator[tuple[float, Callable[[float], float]]]:
    """Weights, and the sizes over their estimates, all large together or all small.

    A size is given by a function of the degrees of freedom of its estimate.
    """
    from scipy.special import expit, gammaincinv  # type: ignore[import-untyped]

    levels = expit(_LOGITS)
    weights = levels * expit(-_LOGITS)
    for level, weight in zip(levels.tolist(), (weights / weights.sum()).tolist(), strict=True):

        def factor(dof: float, level: float = level) -> float:
            return (
                1.0 if np.isinf(dof) else float(np.sqrt(0.5 * dof / gammaincinv(0.5 * dof, level)))
            )

        yield weight, factor
