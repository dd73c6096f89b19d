"""Records whose fixture was clamped at several angles, which a search cannot take."""

from __future__ import annotations

from accelcal.errors import InputError
from accelcal.head_angles import head_positions
from accelcal.numerics.sorting import distinct
from accelcal.plural import listed
from accelcal.record import TumbleRecord


def refuse_several_clampings(record: TumbleRecord) -> None:
    """Refuse a record whose fixture was clamped at more than one angle.

    The errors of the head and the misalignment are the same in all runs of a search; from one
    clamping to the next both are others, and would look like a missing effect.
    """
    met = [] if record.clamping is None else distinct(head_positions(record.clamping)).tolist()
    if len(met) > 1:
        raise InputError(
            f"{record.source}: clampings at {listed(f'{angle:g}' for angle in met)} deg; head"
            " errors and misalignment differ from one to the next, so give the runs of one clamping"
            " in a file of their own (fit and head take all of them)"
        )
