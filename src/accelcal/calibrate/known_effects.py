"""Effects of a discovery taken out of records of one plan, and what is uncertain in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from accelcal.calibrate.options import Options
from accelcal.calibrate.plan import OnePlan
from accelcal.estimate.linear import linear_estimator
from accelcal.estimate.tables import PreparedTable
from accelcal.estimate.uncertainty import Component
from accelcal.plural import listed
from accelcal.record import TumbleRecord, naming
from accelcal.reference import reference_temperature_of
from accelcal.results.beyond_uncertainty import NOT_COUNTED

if TYPE_CHECKING:
    from accelcal.discovery.correction import Correction
    from accelcal.results.discovery import Discovery


def corrections(plan: OnePlan, options: Options, delta0: float) -> tuple[Correction, ...]:
    """Take the effects that are known out of the readings, whose sizes are those of each record.

    Parameters
    ----------
    plan : OnePlan
        The records.
    options : Options
        What is asked.
    delta0 : float
        Fixture angle [rad].

    Returns
    -------
    tuple of Correction
        One a record, with the gaps where it is alone; none without a model.
    """
    if options.model is None:
        return ()
    from accelcal.discovery.correction import correction

    found, alone = [], len(plan.records) == 1
    for record in plan.records:
        reference = reference_temperature_of(record, options.reference_temperature)
        with naming(record):
            found.append(correction(record, options.model, reference or 0.0, delta0, gaps=alone))
    return tuple(found)


def effects_component(
    tables: Sequence[PreparedTable], known: Sequence[Correction], method: str, delta0: float
) -> Component:
    """Find the component of error that the uncertainty of the effects gives to all coefficients.

    Parameters
    ----------
    tables : sequence of PreparedTable
        The tables of any of the R records.
    known : sequence of Correction
        Of each record.
    method : str
        One of `accelcal.estimate.linear.METHODS`.
    delta0 : float
        Fixture angle [rad].

    Returns
    -------
    Component
        Of the coefficients, table after table, with a leading axis of length R.
    """
    acting = np.array([item.acting for item in known])
    masks = known[0].record.table_masks()
    through = np.concatenate(
        [
            linear_estimator(table, method, delta0).map @ acting[:, mask]
            for table, mask in zip(tables, masks, strict=True)
        ],
        axis=1,
    )
    dof = np.array([item.dof for item in known], dtype=np.float64)
    shape = through.shape[:2]
    return Component(through @ through.mT, np.broadcast_to(dof[:, None], shape))


def said_of_unit(record: TumbleRecord, model: Discovery, as_found: Sequence[str]) -> Iterator[str]:
    """Say that the effects which are taken out were found in another unit.

    Parameters
    ----------
    record : TumbleRecord
        The readings.
    model : Discovery
        Whose effects are taken out of them.
    as_found : sequence of str
        Those of them whose sizes these readings do not tell.

    Yields
    ------
    str
        A sentence, where the serial numbers of both are known and differ.
    """
    known = None not in (model.serial, record.serial)
    if model.effects and known and model.serial != record.serial:
        but_for = (
            f", but for {listed(as_found)}, of which these tell nothing: the size in the other unit"
            f" is taken out, and {NOT_COUNTED} how it differs"
        )
        yield (
            f"the discovery of another unit, serial {model.serial}, says which effects are taken"
            f" out; their sizes are fitted to these readings{but_for if as_found else ''}"
        )
