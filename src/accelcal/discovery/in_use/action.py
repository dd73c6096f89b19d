"""What a discovered effect does to the readings, beyond what the coefficients take up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from accelcal.arguments.kinds import expect
from accelcal.arguments.options import check_text
from accelcal.arrays import Array
from accelcal.discovery.comparison import compared
from accelcal.discovery.instance import contribution, instance_of
from accelcal.discovery.large_effects import silent_by
from accelcal.effects.conditions import Conditions
from accelcal.effects.found import disturbances
from accelcal.errors import InputError
from accelcal.numerics.grouping import cells
from accelcal.record import TumbleRecord
from accelcal.results.discovery import Discovery


@dataclass(frozen=True, slots=True, eq=False)
class Action:
    """An effect beside the readings that it explains."""

    name: str
    conditions: Conditions  # of the n readings
    residual: Array  # reading minus model with all other effects, but without this one, (n,) [g]
    change: Array
    """What the effect explains of it [g]; the rest is what all effects together leave, (n,)."""

    def follows(self, *quantities: Array) -> float:
        """Part of its squares that the mean over readings of equal quantities has, each (n,)."""
        group = cells(*quantities)
        if group.max() + 1 > 0.5 * group.size:
            return 0.0
        means = np.bincount(group, self.change) / np.bincount(group)
        whole = float(self.change @ self.change)
        return float(means[group] @ means[group]) / whole if whole > 0.0 else 0.0


def action(discovery: Discovery, record: TumbleRecord, effect: str | None = None) -> Action:
    """Show what an effect does to the readings, beyond what the coefficients take up.

    The effect, by default the first one found, has the size that was found; the coefficients are
    fitted with and without it.

    Raises
    ------
    InputError
        If no such effect was found, or the record is too small, or of another file.

    Examples
    --------
    >>> import accelcal
    >>> record = accelcal.simulate(effects=[accelcal.effect("backlash").of(5e-5)], seed=1)
    >>> found = action(accelcal.discover(record), record)
    >>> bool(np.std(found.residual - found.change) < np.std(found.residual))
    True
    """
    expect(record, TumbleRecord)
    check_text(effect=effect)
    if record.sha256 and discovery.sha256 and record.sha256 != discovery.sha256:
        raise InputError(
            f"{record.source} is not the file in which the effects were found; give"
            f" {discovery.source}, unchanged"
        )
    ids = [item.id for item in discovery.effects]
    if not ids:
        raise InputError("no effect was found; there is no signature to show")
    chosen = ids[0] if effect is None else effect
    if chosen not in ids:
        raise InputError(f"effect {chosen!r} was not found; the discovery has {', '.join(ids)}")
    place = ids.index(chosen)
    given = disturbances(discovery.effects)
    t0, delta0 = discovery.T0_degC, discovery.delta0_rad
    silent = silent_by(record, t0, delta0, given)
    with_all = compared(record, t0, delta0, tuple(map(instance_of, given)), silent=silent)
    c = with_all.model.conditions
    added = [contribution(item, c) for item in given]
    whole = np.sum(added, axis=0)
    left, without = (with_all.less(taken) for taken in (whole, whole - added[place]))
    residual = without.residual
    return Action(discovery.effects[place].name, c, residual, residual - left.residual)
