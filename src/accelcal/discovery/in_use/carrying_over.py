"""Effects of a discovery in another record: which of them have the size there that was found.

What a record shows is fitted to it. What it does not show has there the size that was found only
where nothing else can be expected: an error of the head in all units on it, an effect of the
accelerometer in the same accelerometer. Any other is left in the readings, as without a discovery,
and the coefficients have it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.arrays import Array
from accelcal.discovery.base import BaseModel
from accelcal.discovery.instance import Instance, column_of, contribution, instance_of
from accelcal.discovery.space import VISIBLE
from accelcal.effects.conditions import Conditions, conditions_of
from accelcal.effects.effect import Disturbance
from accelcal.effects.found import disturbances
from accelcal.errors import InputError
from accelcal.estimate.same_head import HEAD, STAND, names_of, same_head
from accelcal.record import TumbleRecord
from accelcal.results.discovery import Discovery
from accelcal.results.findings import FoundEffect

OF_THE_STAND = "angle"
"""What effects act on that are of the head, the fixture and the foundation."""


class LeftIn(NamedTuple):
    """An effect that a record does not show and that is left in its n readings."""

    name: str
    why: str  # why its size is not known here
    remedy: str  # what would tell it
    adds: Array
    """What it adds to the readings if it has the size that was found, (n,) [output unit]."""


class Meeting(NamedTuple):
    """A record and a discovery whose effects are to be taken out of it."""

    record: TumbleRecord
    model: Discovery  # the discovery
    T0: float  # reference temperature of the record [degC]
    delta0: float  # its fixture angle [rad]

    @property
    def of_one_unit(self) -> bool:
        """Whether both are known to be of the same accelerometer."""
        ours, theirs = self.record, self.model
        if None in (ours.serial, theirs.serial):
            return of_one_file(ours, theirs)
        return ours.serial == theirs.serial

    def foreign(self, item: Instance, c: Conditions) -> tuple[str, str] | None:
        """Say why an effect may have another size here, and what would tell; None where not."""
        if item.effect.acts_on == OF_THE_STAND:
            return self._of_another_stand()
        model, unit = self.model, (self.model.serial, self.record.serial)
        if not self.of_one_unit and None in unit:
            named = "name the serial numbers of both"
            return "may be of another unit, as a serial number is missing", named
        if not self.of_one_unit:
            shown = f"discover it in this unit: {item.effect.to_tell_apart}"
            return f"was found in another unit, serial {model.serial}", shown
        here, there = column_of(item, c), column_of(item, self._there(c))
        if np.linalg.norm(here - there) > VISIBLE * np.linalg.norm(there):
            made = f"T0 = {model.T0_degC:g} degC"
            return f"was found as a law about {made}", f"calibrate with {made}"
        return None

    def _of_another_stand(self) -> tuple[str, str] | None:
        model, made = self.model, f"{self.model.delta0_rad:g} rad"
        if on_one_head(self.record, model) is False:
            name = model.head_name or model.stand_name
            return f"was found on another head or stand, {name}", "discover it on this one"
        if self.delta0 != model.delta0_rad:
            return f"was found with delta0 = {made}", f"calibrate with delta0 = {made}"
        return None

    def left_in(self, known: Disturbance, model: BaseModel) -> LeftIn | None:
        """Tell of an effect that it is left in; None where its size is that of the discovery."""
        item = instance_of(known)
        if (said := self.foreign(item, model.conditions)) is None:
            return None
        adds = model.nominal * contribution(known, self._there(model.conditions))
        return LeftIn(item.effect.id, *said, adds)

    def _there(self, c: Conditions) -> Conditions:
        """Conditions with temperatures above the T0 of the discovery."""
        return replace(c, excess=c.excess + (self.T0 - self.model.T0_degC))


def of_one_file(record: TumbleRecord, model: Discovery) -> bool:
    """Whether a discovery was made in the file of a record."""
    return record.sha256 is not None and record.sha256 == model.sha256


def on_one_head(record: TumbleRecord, model: Discovery) -> bool | None:
    """Whether a record and a discovery are of one head; None where nothing tells it."""
    if of_one_file(record, model):
        return True
    theirs = {HEAD: model.head_name, STAND: model.stand_name}
    return same_head(theirs, names_of(record.metadata))


def with_a_place(meeting: Meeting) -> tuple[tuple[FoundEffect, ...], tuple[str, ...]]:
    """Return the effects of a discovery that can act in a record, and say why others cannot.

    The error of a position that was not measured cannot, nor a step behind the last reading.
    """
    c = conditions_of(meeting.record, meeting.T0, meeting.delta0)
    effects = meeting.model.effects
    placed, said = [], []
    for found, known in zip(effects, disturbances(effects), strict=True):
        try:
            column_of(instance_of(known), c)
            placed.append(found)
        except InputError as error:
            said.append(f"nothing is taken out of these readings for {error}")
    return tuple(placed), tuple(said)
