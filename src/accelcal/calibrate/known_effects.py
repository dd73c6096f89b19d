"""Effects of a discovery taken out of records of one plan, and what is uncertain in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from accelcal.arrays import Array, Mask
from accelcal.calibrate.options import Options
from accelcal.calibrate.plan import OnePlan
from accelcal.estimate.tables import LinearEstimator, PreparedTable, linear_estimator
from accelcal.estimate.uncertainty import Component
from accelcal.model import ERROR_TERMS, ERROR_UNITS, SCALE_FACTOR
from accelcal.plural import listed
from accelcal.record import TumbleRecord, naming
from accelcal.reference import reference_temperature_of
from accelcal.results.beyond_uncertainty import LEFT_OUT
from accelcal.results.covariance import ALTERNATIVES, EFFECTS, LOOK_ALIKES
from accelcal.shown_units import in_small_unit

if TYPE_CHECKING:
    from accelcal.discovery.in_use.carrying_over import LeftIn
    from accelcal.discovery.in_use.correction import Correction
    from accelcal.results.discovery import Discovery

_NOTABLE = 0.02
"""Part of the largest change of a coefficient below which one is not told."""


def corrections(plan: OnePlan, options: Options, delta0: float) -> tuple[Correction, ...]:
    """Take the effects that are known out of the readings, whose sizes are those of each record.

    There is one correction a record, with the gaps where it is alone; none without a model.
    """
    if options.model is None:
        return ()
    from accelcal.discovery.in_use.correction import correction

    found, alone = [], len(plan.records) == 1
    for record in plan.records:
        reference = reference_temperature_of(record, options.reference_temperature)
        with naming(record):
            found.append(correction(record, options.model, reference or 0.0, delta0, gaps=alone))
    return tuple(found)


def effects_components(
    known: Sequence[Correction], passed: Callable[[Array], Array]
) -> dict[str, Component]:
    """Find the components of error that taking effects out of R records gives to estimates.

    Changes of the readings, shape (R, n, k), are `passed` on to what is estimated, shape (R, P, k).
    The components are by the sizes of the effects and, where others may be in their place, by what
    they would be beside these.
    """
    through = passed(_side_by_side([item.acting for item in known]))
    dof, readings = np.array([float(item.dof) for item in known]), len(known[0].record)
    found = {
        EFFECTS: Component(through @ through.mT, np.broadcast_to(dof[:, None], through.shape[:2]))
    }
    for source, in_use in ((LOOK_ALIKES, True), (ALTERNATIVES, False)):
        adds = [[o.adds for o in item.in_place if o.in_use is in_use] for item in known]
        if any(adds):
            columns = [np.array(own).reshape(-1, readings).T for own in adds]
            found[source] = _as_likely(passed(_side_by_side(columns)))
    return found


def to_coefficients(
    tables: Sequence[PreparedTable], masks: Sequence[Mask], method: str, delta0: float
) -> Callable[[Array], Array]:
    """Pass changes of the readings of records on to the coefficients, table after table.

    The tables are of any of the records, and the masks tell which readings are theirs; the method
    is one of `METHODS`, with a fixture angle [rad].
    """
    estimators = [linear_estimator(table, method, delta0) for table in tables]

    def passed(changes: Array) -> Array:
        each = zip(estimators, masks, strict=True)
        return np.concatenate([own.map @ changes[:, mask] for own, mask in each], axis=1)

    return passed


def _side_by_side(columns: Sequence[Array]) -> Array:
    """Columns of the readings of each record, shape (R, n, most)."""
    most = max(own.shape[1] for own in columns)  # fewer where some effects were left in
    return np.array([np.pad(own, ((0, 0), (0, most - own.shape[1]))) for own in columns])


def _as_likely(changes: Array) -> Component:
    """Component of what one of several changes may do, which counts as likely as none.

    The correlations are those of all together, the variances those of the largest.
    """
    from accelcal.discovery.doubts.otherwise import as_likely

    together, variance = changes @ changes.mT, as_likely(changes)
    scale = np.linalg.diagonal(together).copy()
    scale[scale > 0.0] = np.sqrt(variance[scale > 0.0] / scale[scale > 0.0])
    covariance = scale[..., None] * together * scale[..., None, :]
    return Component(covariance, np.full(scale.shape, np.inf))


def said_of_effects(
    plan: OnePlan,
    known: Sequence[Correction],
    model: Discovery,
    estimators: Sequence[LinearEstimator],
) -> list[tuple[str, ...]]:
    """Say whose effects were taken out, and which of them not with a size in these readings.

    There are sentences about each record, without a full stop.
    """
    each = zip(plan.records, known, strict=True)
    return [
        (
            *_said_of_unit(record, item, model),
            *_said_of_sizes(record, item, model),
            *(_left_in(one, item.record, estimators) for one in item.left_in),
            *item.said,
        )
        for record, item in each
    ]


def _said_of_unit(record: TumbleRecord, known: Correction, model: Discovery) -> Iterator[str]:
    serials = model.serial, record.serial
    if len(known.effects) > len(known.as_found) and None not in serials and len(set(serials)) > 1:
        yield (
            f"the discovery of another unit, serial {model.serial}, says which effects are taken"
            " out; their sizes are fitted to these readings"
        )


def _said_of_sizes(record: TumbleRecord, known: Correction, model: Discovery) -> Iterator[str]:
    if not known.as_found:
        return
    from accelcal.discovery.in_use.carrying_over import OF_THE_STAND, on_one_head
    from accelcal.effects.found import disturbances

    acts_on = {item.effect.id: item.effect.acts_on for item in disturbances(known.effects)}
    to_tell = (
        "" if on_one_head(record, model) else "; name the head in a line '# head: NAME' of both"
    )
    for stands in (False, True):
        own = [name for name in known.as_found if (acts_on[name] == OF_THE_STAND) is stands]
        if own:
            yield (
                f"these readings do not show {listed(own)}: taken out with the size that the"
                " discovery found"
                + f", which holds on the same stand, clamped alike{to_tell}"
                * stands
            )


def _left_in(item: LeftIn, record: TumbleRecord, estimators: Sequence[LinearEstimator]) -> str:
    adds = listed(_added(item.adds, record, estimators))
    return (
        f"{item.name} is not taken out: these readings do not show it, and it {item.why}; the"
        f" coefficients have it in them, and {LEFT_OUT}: as large as there it adds {adds}; to"
        f" correct it, {item.remedy}"
    )


def _added(
    adds: Array, record: TumbleRecord, estimators: Sequence[LinearEstimator]
) -> Iterator[str]:
    """Tell what an addition to the readings adds to the coefficients, the most of all tables."""
    found: dict[str, float] = {}
    for mask, estimator in zip(record.table_masks(), estimators, strict=True):
        scale_factor = estimator.coefficients(record.output[mask])[SCALE_FACTOR]
        changes = estimator.map @ adds[mask] / scale_factor
        for name, change in zip(estimator.names, changes.tolist(), strict=True):
            found[name] = max(found.get(name, 0.0), change, key=abs)
    largest = max(map(abs, found.values()))
    for name, change in found.items():
        if abs(change) > _NOTABLE * largest:
            symbol = ERROR_TERMS.get(name, name)
            factor, unit = in_small_unit(ERROR_UNITS.get(symbol, "1"))
            size = factor * change
            told = f"{size:.0f}" if abs(size) > 100.0 else f"{size:.3g}"
            yield f"{told} {unit} to {symbol}"
