"""The head calibrates itself: its errors together with the coefficients of units measured on it.

A position of the head is wrong by the same angle whatever stands on it. On one clamping, what looks
like coefficients cannot be told from them; where the fixture is clamped at another angle, the same
errors look like others, and K2, K3 and M_ip do not change. So k2, k3 and delta_ip are common to all
clampings of one unit (for each axis along the shaft), while k0, K1 and delta are free in each run,
where the launch and the angle of the clamp change them. The declared uncertainty of a position is
the start, and where nothing tells more, it stays.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from accelcal.arguments.kinds import each_of
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.estimate.at_positions import at_positions, refuse_twice
from accelcal.estimate.declared_scatter import moderated
from accelcal.estimate.noise import ALIKE, LEAST_NOISE, ReadingNoise, noise_of_stack
from accelcal.estimate.same_head import declared_uncertainty, names_of_one_head
from accelcal.estimate.tables import PreparedTable, linear_estimator, prepare
from accelcal.estimate.unrepeated import Evidence, noise_beside_head, together
from accelcal.model import COEFFICIENTS, ERROR_TERMS, ERROR_UNITS, WITHOUT_LAWS
from accelcal.numerics.decimal_steps import decimal_steps
from accelcal.numerics.grouping import distinct
from accelcal.numerics.probability import (
    LEVEL,
    NORMAL_FACTOR,
    dof_of_student_quantile,
    f_survival,
    student_quantile,
    written_p_value,
)
from accelcal.record import TumbleRecord, naming
from accelcal.reference import fixture_angle
from accelcal.results.covariance import rows_of
from accelcal.results.findings import Change
from accelcal.results.head_calibration import (
    LEFT_OVER,
    HeadCalibration,
    HeadHarmonic,
    UnitOnHead,
)
from accelcal.results.quantity import Gate, Quantity
from accelcal.version import SOFTWARE

__all__ = ["calibrate_head"]

_ABSORBED = {
    "mean": "M",
    "cos 1": "M_ip",
    "sin 1": "K0, K2",
    "cos 2": "M, in part",
    "sin 2": "K1, K3",
}
_FALSE_ALARM = 0.01


@dataclass(frozen=True, eq=False)
class _Unit:
    """One record in units of g over its noise: z = nuisance x + head e + noise of 1.

    The noise has some degrees of freedom, of which `pure` are those of replicates; `residuals`
    tells that it is what the fits of its tables leave, errors of the head included, of `size` [g].
    """

    record: TumbleRecord
    names: tuple[str, ...]
    nuisance: Array
    head: Array
    z: Array
    dof: float
    pure: float
    residuals: bool
    size: float

    @cached_property
    def exact(self) -> Evidence:
        """What is told of e beside the nuisance."""
        basis = _basis(self.nuisance)
        shown = self.head - basis @ (basis.T @ self.head)
        residual = self.z - basis @ (basis.T @ self.z)
        left = float(self.z.size - basis.shape[1])
        return Evidence(shown.T @ shown, shown.T @ residual, float(residual @ residual), left)

    def in_units_of(self, noise: float, dof: float) -> _Unit:
        """Return the same where the noise is `noise` times what it was, with these degrees."""
        nuisance, head, z = (part / noise for part in (self.nuisance, self.head, self.z))
        return replace(self, nuisance=nuisance, head=head, z=z, dof=dof)

    @property
    def caution(self) -> float:
        """Student's factor over the normal one: the head's errors are told as if it were sure."""
        return student_quantile(LEVEL, self.dof) / NORMAL_FACTOR

    @cached_property
    def cautious(self) -> Evidence:
        """The evidence as if its noise were sure."""
        return self.exact.in_units_of(self.caution)

    @property
    def scatter(self) -> Array:
        """Covariance of the cautious pull by the noise."""
        return self.exact.in_units_of(self.caution**2).information


def calibrate_head(
    records: Sequence[TumbleRecord], *, delta0: float | None = None
) -> HeadCalibration:
    """Estimate the errors of a head from records of units that were measured on it.

    Parameters
    ----------
    records : sequence of TumbleRecord
        One unit in two clampings or more, several units of one stand, or both. All declare the
        same uncertainty of a head position.
    delta0 : float, optional
        Fixture angle of all; by default each record declares its own [rad].

    Returns
    -------
    HeadCalibration
        Error of each position, its covariance, its harmonics with what cannot be told of them,
        and the coefficients of each unit fitted alone and jointly.

    Raises
    ------
    InputError
        If no uncertainty is declared, or several are, if records name different heads, or nothing
        tells the noise of a record.

    Notes
    -----
    The joint posterior of e and the coefficients x of all units, e having the prior N(0, u^2) of
    the declaration and x none. Each record adds S^T S to what is known of e, with S the part of
    its dependence on e that its x cannot absorb; then x given e is least squares.

    Examples
    --------
    >>> import accelcal
    >>> found = accelcal.calibrate_head([accelcal.simulate(seed=seed) for seed in (1, 2)])
    >>> len(found.errors), found.harmonics[0].name, round(found.harmonics[0].told, 3)
    (8, 'mean', 0.0)
    """
    records = each_of(records, TumbleRecord)
    refuse_twice(records)
    names, declared = names_of_one_head(records), declared_uncertainty(records)
    records = [at_positions(record, delta0) for record in records]
    tables = [_tables(record, delta0) for record in records]
    positions = distinct(np.concatenate([t.at_head.key for own in tables for t in own]))
    units = _units(records, tables, positions, declared)
    errors, covariance = together([unit.cautious for unit in units], declared)
    return HeadCalibration(
        angles_deg=tuple(positions.tolist()),
        errors=tuple(errors.tolist()),
        covariance_matrix=rows_of(covariance),
        origin="self-calibration",
        declared_uncertainty_rad=declared,
        harmonics=tuple(_harmonics(positions, errors, covariance, declared)),
        units=tuple(
            UnitOnHead(
                name=name,
                sha256=unit.record.sha256,
                information=rows_of(unit.cautious.information),
                pull=tuple(unit.cautious.pull.tolist()),
                coefficients=_changes(unit, units, (errors, covariance), declared),
            )
            for name, unit in zip(_names(records), units, strict=True)
        ),
        gates=(_clampings(records), _left_over(units, declared)),
        source=", ".join(dict.fromkeys(record.source for record in records)),
        software=SOFTWARE,
        **names,
    )


def _names(records: Sequence[TumbleRecord]) -> list[str]:
    """Serial numbers; of a unit with several records, and of one without a number, the sources."""
    count = Counter(record.serial for record in records)
    return [r.serial if r.serial and count[r.serial] == 1 else r.source for r in records]


def _tables(record: TumbleRecord, delta0: float | None) -> list[PreparedTable]:
    found = []
    for table in record.tables():
        with naming(table):
            found.append(prepare(table, delta0=fixture_angle(record, delta0)))
    return found


def _unit(record: TumbleRecord, tables: Sequence[PreparedTable], positions: Array) -> _Unit:
    """Stack the tables of a record, each divided by its scale factor and its noise."""
    factors, dof, pure, residuals = _noise(record, tables)
    names: list[str] = []
    rows, heads, outputs, sizes = [], [], [], []
    for number, (table, factor) in enumerate(zip(tables, factors, strict=True)):
        k = linear_estimator(table).coefficients(table.record.output)
        size = factor * table.scatter / k[1]
        sizes.append(float(np.mean(size)))
        own = _places(names, table, number)
        block = np.zeros((len(size), len(names)))
        block[:, own] = table.design / size[:, None]
        rows.append(block)
        at = np.equal(table.head[:, None], positions)
        heads.append((table.angular @ k / k[1] / size)[:, None] * at)
        outputs.append(table.record.output / k[1] / size)
    nuisance = np.vstack([np.pad(b, ((0, 0), (0, len(names) - b.shape[1]))) for b in rows])
    z, head = np.concatenate(outputs), np.vstack(heads)
    common = float(np.mean(sizes))
    if min(map(abs, sizes)) < LEAST_NOISE:
        with naming(record):
            raise InputError(ALIKE)
    return _Unit(record, tuple(names), nuisance, head, z, dof, pure, residuals, common)


def _units(
    records: Sequence[TumbleRecord],
    tables: Sequence[Sequence[PreparedTable]],
    positions: Array,
    declared: float,
) -> list[_Unit]:
    """Units in their noise; where only residuals show it, in what is left beside the head."""
    units = [_unit(r, own, positions) for r, own in zip(records, tables, strict=True)]
    told, sizes = [unit.exact for unit in units], [unit.size for unit in units]
    found = noise_beside_head(told, [unit.residuals for unit in units], sizes, declared)
    return [
        unit.in_units_of(float(noise), float(dof)) if unit.residuals else unit
        for unit, noise, dof in zip(units, *found, strict=True)
    ]


def _noise(
    record: TumbleRecord, tables: Sequence[PreparedTable]
) -> tuple[list[float], float, float, bool]:
    """Reading noise of each table, its degrees of freedom, and those of replicates among them.

    At last, whether residuals told it, errors of the head included. Noises of tables that differ by
    no more than chance are one; what all tables told counts once.
    """
    found = _rounded_noises(record, tables)
    factors, dofs = [n.factor for n in found], [n.dof for n in found]
    if not all(factor > 0.0 for factor in factors):
        with naming(record):
            raise InputError("the reading noise is unknown; read each position twice or more")
    sources = {n.source for n in found}
    own = sum(n.dof for n in found if n.source == "replicates")
    of_all = max((n.dof for n in found if n.source == "replicates of all tables"), default=0.0)
    if sources == {"replicates"} or (sources == {"declared"} and all(map(math.isfinite, dofs))):
        squares, doubt = moderated(np.square(factors), np.array(dofs))
        dof = 1.0 / (0.5 * float(doubt.max()) + 1.0 / sum(dofs))
        return np.sqrt(squares).tolist(), dof, own, False
    return factors, min(dofs), max(own, of_all), sources == {"residuals"}


def _rounded_noises(record: TumbleRecord, tables: Sequence[PreparedTable]) -> list[ReadingNoise]:
    """Noise of each table with what rounding leaves in all readings at a position."""
    outputs, step = [table.record.output[None] for table in tables], record.apparatus.resolution
    each = zip(noise_of_stack(tables, outputs), tables, outputs, strict=True)
    whole = [n.with_rounding(t, decimal_steps(y) if step is None else step) for n, t, y in each]
    return [ReadingNoise(*(part.item() for part in noise)) for noise in whole]


def _places(names: list[str], table: PreparedTable, number: int) -> list[int]:
    """Columns of the coefficients of a table among those of its unit, new ones added."""
    own = [
        f"{ERROR_TERMS[name]}_{table.axis}" if name in WITHOUT_LAWS else f"{name} of table {number}"
        for name in COEFFICIENTS
    ]
    names.extend(name for name in own if name not in names)
    return [names.index(name) for name in own]


def _basis(matrix: Array) -> Array:
    """Orthonormal basis of the columns, as many as they have rank."""
    scale = np.linalg.norm(matrix, axis=0)
    left, values, _ = np.linalg.svd(matrix / np.where(scale > 0.0, scale, 1.0), full_matrices=False)
    return np.asarray(left[:, values > 1e-9 * values[0]])


def _changes(
    unit: _Unit, units: Sequence[_Unit], joint: tuple[Array, Array], declared: float
) -> dict[str, Change]:
    """Coefficients that all clampings have in common, with what each tells of the head."""
    inverse = np.asarray(np.linalg.pinv(unit.nuisance, rcond=1e-9), dtype=np.float64)
    told = np.abs(np.diagonal(inverse @ unit.nuisance) - 1.0) < 1e-6
    shared = [i for i, name in enumerate(unit.names) if " of table " not in name and told[i]]
    names, inverse = [unit.names[i] for i in shared], inverse[shared]
    alone = together([unit.cautious], declared)
    before = _quantities(unit, names, inverse, [unit], alone, declared)
    after = _quantities(unit, names, inverse, units, joint, declared)
    return {n: Change(n, b, a) for n, b, a in zip(names, before, after, strict=True)}


def _quantities(
    unit: _Unit,
    names: Sequence[str],
    inverse: Array,
    told: Sequence[_Unit],
    known: tuple[Array, Array],
    declared: float,
) -> list[Quantity]:
    """Coefficients beside the errors that `told` units tell.

    Their errors are the noise of the own readings, that of each unit in the errors of the head, and
    what of these is missed; each noise has its own factor of Student, added by the squares.
    """
    errors, covariance = known
    reach = inverse @ unit.head @ covariance
    noises = [np.sum(inverse**2, axis=1)]
    noises += [np.einsum("ij,jk,ik->i", reach, each.scatter, reach) for each in told]
    cautions = [unit.caution, *(each.caution for each in told)]
    missed = np.sum(reach**2, axis=1) / declared**2
    standard = np.sqrt(np.sum(noises, axis=0) + missed)
    expanded = NORMAL_FACTOR * np.sqrt(np.square(cautions) @ np.array(noises) + missed)
    values = inverse @ (unit.z - unit.head @ errors)
    units = [ERROR_UNITS[name[:-2]] for name in names]
    each = zip(values.tolist(), standard.tolist(), expanded.tolist(), units, strict=True)
    return [_quantity(*one) for one in each]


def _quantity(value: float, standard: float, expanded: float, unit: str) -> Quantity:
    dof = dof_of_student_quantile(LEVEL, expanded / standard)
    return Quantity(value, standard, unit, expanded, dof if math.isfinite(dof) else None)


def _harmonics(
    positions: Array, errors: Array, covariance: Array, declared: float
) -> Iterator[HeadHarmonic]:
    for name, pattern in _patterns(np.deg2rad(positions)):
        weight = pattern / (pattern @ pattern)
        variance = float(weight @ covariance @ weight)
        u = math.sqrt(max(variance, 0.0))
        yield HeadHarmonic(
            name=name,
            amplitude=Quantity(float(weight @ errors), u, "rad", NORMAL_FACTOR * u),
            told=min(1.0, max(0.0, 1.0 - variance / (declared**2 * float(weight @ weight)))),
            absorbed_by=_ABSORBED.get(name, ""),
        )


def _patterns(phi: Array) -> Iterator[tuple[str, Array]]:
    yield "mean", np.ones(phi.size)
    for order in range(1, phi.size // 2 + 1):
        yield f"cos {order}", np.cos(order * phi)
        if np.abs(np.sin(order * phi)).max() > 1e-6:
            yield f"sin {order}", np.sin(order * phi)


def _clampings(records: Sequence[TumbleRecord]) -> Gate:
    each = [np.zeros(1) if r.clamping is None else r.clamping for r in records]
    found = set((np.concatenate(each) % 360.0).tolist())
    told = f"clamped at {', '.join(f'{c:g}' for c in sorted(found))} deg"
    if len(found) > 1:
        return Gate("clampings", "pass", told)
    told += " alone: what looks like coefficients in every unit stays as uncertain as declared"
    return Gate("clampings", "warn", told + "; clamp the fixture at another angle too")


def _left_over(units: Sequence[_Unit], declared: float) -> Gate:
    """Whether head and coefficients explain the readings within their noise.

    Of several records, the one whose own readings they explain least is named.
    """
    square, dof, pure = _beside_head(units, declared)
    if dof < 1 or not (pure or all(math.isinf(unit.dof) for unit in units)):
        return Gate(LEFT_OVER, "not assessed", "too few readings")
    chance = f_survival(square, dof, pure or math.inf)
    p = written_p_value(chance)
    told = f"residuals are {math.sqrt(square):.2f} times what noise and head explain ({p})"
    if chance < _FALSE_ALARM:
        if len(units) > 1:
            worst = max(units, key=lambda unit: _beside_head([unit], declared)[0])
            told += f", those of {worst.record.source} most"
        told += "; something else disturbs them, which accelcal discover names, or the head is"
        return Gate(LEFT_OVER, "warn", f"{told} worse than declared")
    return Gate(LEFT_OVER, "pass", told)


def _beside_head(units: Sequence[_Unit], declared: float) -> tuple[float, float, float]:
    """Mean square beside noise and head, and the degrees of freedom of it and of the replicates.

    Beside the coefficients, readings scatter by the noise and the head as declared; the sum of
    squares in the measure of both is that beside the noise alone less what the head explains.
    Replicates tell the noise, and what is left beside them is held against it.
    """
    exact = [unit.exact for unit in units]
    squares, dofs = np.sum([(own.squares, own.left) for own in exact], axis=0)
    of_head = float(np.sum([own.pull for own in exact], axis=0) @ together(exact, declared)[0])
    pure = sum(unit.pure for unit in units)
    dof = float(dofs - pure)
    return max(float(squares - of_head - pure), 0.0) / max(dof, 1.0), dof, pure
