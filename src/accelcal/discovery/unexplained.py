"""What no effect explains: the pattern that is left, what comes and goes, a run that scatters.

A pattern of the head position can be taken up by terms of its own. And what a reader must know of
the noise, in which a disturbance may hide.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.columns import orthonormal, saturated, squares_in
from accelcal.discovery.comparison import Comparison
from accelcal.discovery.doubts.caveats import Caveat
from accelcal.discovery.explanation import Explanation
from accelcal.discovery.factors import Block, pattern, structure
from accelcal.discovery.family import Family, judge
from accelcal.discovery.instance import Instance, columns_of
from accelcal.discovery.noise.of_readings import relative_noise
from accelcal.discovery.noise.pure_error import TOO_LOUD, LoudRun, loud_run
from accelcal.discovery.search import Findings
from accelcal.discovery.unnamed.passing import passing
from accelcal.discovery.unnamed.slow import drift_anew, slow
from accelcal.effects.effect import Effect
from accelcal.effects.empirical import FACTORS, empirical
from accelcal.head_angles import head_positions
from accelcal.numerics.grouping import grouped
from accelcal.plural import are, listed
from accelcal.results.findings import Unexplained


def what_is_left(
    family: Family,
    findings: Findings,
    instead: Unexplained | None,
    loud: LoudRun | None,
    alpha: float,
    seed: int,
) -> Unexplained | None:
    """Tell what the effects that were found, if any, do not explain.

    A shift for a time or silent readings may have been found instead, and the loudest run be too
    loud.
    """
    found, comparison = findings.explanations, family.comparison
    beside = findings.instances
    if not found and findings.chance_without_name < alpha:
        told = None if findings.main else drift_anew(family, alpha)
        left: Unexplained | None = told or instead or _pattern(family, findings)
    else:
        left = passing(comparison, beside, alpha, seed) or slow(comparison, beside, alpha, seed)
    if loud is None or loud.ratio < TOO_LOUD or loud.p_value >= alpha:
        return left
    return _scattering(comparison, loud, left)


def loudest(comparison: Comparison, instances: tuple[Instance, ...]) -> LoudRun | None:
    """Find the run that scatters most beside the others, whatever some effects do."""
    c, record = comparison.model.conditions, comparison.record
    within = np.hstack([saturated(c, record.mounting), columns_of(instances, c)])
    residual = comparison.residual
    return loud_run(c, residual, within, relative_noise(record), comparison.step)


def _scattering(comparison: Comparison, loud: LoudRun, left: Unexplained | None) -> Unexplained:
    """Tell of a run that scatters far more than the others, and what else is left."""
    label = comparison.record.run_labels[loud.run]
    told = (
        f"run {label} scatters {loud.ratio:.2g} times as much as the others: its noise is another,"
        " or something acts in it for a time; look at its readings, or repeat it"
    )
    whole = comparison.noise.sigma**2 * float((comparison.seen**2).sum())
    share, p_value = min(1.0, loud.squares / whole), loud.p_value
    if left is not None:
        told = f"{left.structure}; {told}"
        share, p_value = max(share, left.share), min(p_value, left.p_value)
    return Unexplained(told, share, p_value)


def _pattern(family: Family, findings: Findings) -> Unexplained:
    """Pattern of the factor that disagrees most."""
    near = findings.main or findings.nearest
    block, taken, p_value = _worst(family, near)
    space, seen = family.space, family.comparison.seen
    share = squares_in(block.basis, seen) / float(seen @ seen)
    shape = pattern(space, seen, block, taken)
    c, labels = family.comparison.model.conditions, family.comparison.record.run_labels
    told = structure(c, labels, block.factor, shape)
    if findings.main is not None:
        told = f"beside {_named(findings.main)}: {told}"
    elif near is not None and taken is not None:
        told = f"beside {_named(near)}, nearest in the catalogue but not accepted: {told}"
    elif near is not None:
        told += f"; nearest in the catalogue, but not accepted: {_named(near)}"
        if near.bent:
            told += f", as the readings do not follow the law of {listed(near.bent)}"
    return Unexplained(told, share, p_value)


def _named(near: Explanation) -> str:
    return listed(sorted(near.ids))


def _worst(family: Family, near: Explanation | None) -> tuple[Block, Array | None, float]:
    """Factor that disagrees most beside the nearest effects, these, and the chance of noise.

    Effects that leave nothing, and have no name for another reason, are not taken out.
    """
    if near is not None and near.passes:
        near = None
    taken = None if near is None else orthonormal(near.directions)
    judged = judge(family, taken)
    return family.blocks[int(np.argmin(judged.blocks))], taken, judged.p_value


_NEEDED = 0.01


def empirical_explanation(family: Family) -> Explanation | None:
    """Explain a disagreement by terms of the head position that have no other cause.

    There is one for each factor that needs it, the worst first; None where none can have one.
    """
    comparison, space, seen = family.comparison, family.space, family.comparison.seen
    c = comparison.model.conditions
    angles = grouped(head_positions(c.angle))[0]
    terms: list[Effect] = []
    columns, p_values = space.nothing(), []
    for _ in FACTORS:
        judged = judge(family, orthonormal(columns) if terms else None)
        p, factor = min(
            (float(p), block.factor)
            for block, p in zip(family.blocks, judged.blocks, strict=True)
            if block.factor in FACTORS
        )
        if p * family.tests >= _NEEDED:
            break
        terms.append(empirical(factor, angles.tolist()))
        columns = np.hstack([columns, space.see(c.gain[:, None] * terms[-1].columns(c))])
        p_values.append(p)
    if not terms:
        return None
    sizes = np.linalg.lstsq(columns, seen, rcond=1e-6)[0].reshape(len(terms), -1)
    mixtures = sizes / np.linalg.norm(sizes, axis=1, keepdims=True)
    instances = tuple(
        Instance(term, tuple(mixture), {})
        for term, mixture in zip(terms, mixtures.tolist(), strict=True)
    )
    directions = comparison.directions(*instances)
    squares = squares_in(orthonormal(directions), seen)
    return Explanation(instances, directions, squares, tuple(p_values), passes=False)


_UNEVEN = 1.2
"""Ratio of the noise of two readings that is told."""

_SLOW = 0.5
"""Correlation of neighbours from which the verdict tells it."""

_LOUD, _CHANCE = 4.0, 1e-3
"""Scatter of a run over that of the others from which the verdict tells it, and the chance of it
below which it is one."""

_BEYOND_STD = 3.0
"""Noise over the declared one from which the verdict tells it."""


def noise_caveats(
    comparison: Comparison, instances: tuple[Instance, ...], loud: LoudRun | None
) -> Iterator[Caveat]:
    """Tell what a reader must know of the noise, beside some effects, and of its loudest run."""
    yield from _of_memory(comparison)
    yield from _of_runs(comparison, instances, loud)
    yield from _of_std(comparison)
    if comparison.noise.heavy:
        yield Caveat("the noise has heavier tails than a normal one, and is judged accordingly")


def _of_memory(comparison: Comparison) -> Iterator[Caveat]:
    rho = comparison.noise.rho
    if comparison.noise.remembers:
        slow = ": a slow disturbance that no entry of the catalogue describes looks like it"
        yield Caveat(
            f"neighbouring readings are correlated ({rho:+.2f}), which counts as noise with a"
            f" memory{slow if rho > 0.0 else ''}",
            reservation=f"neighbouring readings are correlated by {rho:+.2f}, as a slow disturbance"
            " makes them"
            if rho >= _SLOW
            else "",
        )


def _of_runs(
    comparison: Comparison, instances: tuple[Instance, ...], loud: LoudRun | None
) -> Iterator[Caveat]:
    """Readings that are weighted, and a run that scatters much more than the others."""
    relative = comparison.noise.relative
    ratio = 1.0 if relative is None else float(relative.max() / relative.min())
    if ratio >= _UNEVEN:
        by = "the scatter of their run" if comparison.record.std is None else "their std"
        yield Caveat(
            f"the readings are weighted by {by}, the largest of which is {ratio:.2g} times the"
            " smallest"
        )
    if loud is None or loud.ratio < _LOUD or loud.p_value >= _CHANCE:
        return
    label = comparison.record.run_labels[loud.run]
    told = f"run {label} scatters {loud.ratio:.2g} times as much as the others"
    unsure = [item.effect.id for item in instances] if loud.ratio >= TOO_LOUD else []
    not_sure = f"{listed(unsure)} {are(unsure)} not sure: " if unsure else ""
    yield Caveat(
        f"{not_sure}{told}, by noise or by what acts in it for a time; look at its readings, or"
        " repeat it",
        unsure,
        reservation=told,
    )


def _of_std(comparison: Comparison) -> Iterator[Caveat]:
    """Readings that scatter by far more than their samples do."""
    std, count = comparison.record.std, comparison.record.count
    if std is None or not np.all(std > 0.0):
        return
    squares = std**2 / (1.0 if count is None else np.maximum(count, 1.0))
    declared = float(np.sqrt(np.mean(squares))) / abs(comparison.model.nominal)
    ratio = comparison.noise.sigma / declared
    if ratio >= _BEYOND_STD:
        told = f"the readings scatter {ratio:.2g} times more than their std says"
        yield Caveat(
            f"{told}: something acts between them that is not in the samples of one reading",
            reservation=told,
        )
