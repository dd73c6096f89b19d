"""Effects that a calibration was freed of, and that the accelerometer has in use all the same."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from accelcal.results.beyond_uncertainty import NOT_COUNTED, beyond_uncertainty
from accelcal.results.calibration import Calibration
from accelcal.results.findings import FoundEffect
from accelcal.results.table import TableCalibration

if TYPE_CHECKING:
    from accelcal.effects.effect import Effect

_NOT_IN_USE = ("angle", "temperature", "readings")
"""What effects of the stand, the chamber and the voltmeter act on."""


def left_in_use(calibration: Calibration, taken_up: Collection[str] = ()) -> list[str]:
    """Say which effects are in the outputs that a calibration is used for.

    Those of some ids are taken up by whoever asks. It is one sentence, or none where there are no
    others but those of the test.

    Notes
    -----
    A fit with the model of a discovery takes effects out of the readings, so that the coefficients
    are free of them. (1) and (4) know the coefficients only.
    """
    if not calibration.effects:
        return []
    names = [item.id for item in calibration.effects if item.id not in taken_up]
    beside = of_the_test(names)
    left = [name for name in names if name not in beside]
    if not left:
        return []
    it = "it" if len(left) == 1 else "them"
    return [
        f"{', '.join(left)}: the fit took {it} out of the readings by its model, so the"
        f" coefficients are free of {it}; in use the accelerometer has {it}, and neither the"
        f" accelerations nor their uncertainty count {it}; a fit without a model leaves in the"
        " coefficients what they can take up"
    ]


def of_the_test(names: Collection[str]) -> list[str]:
    """Keep the ids of effects of the stand, the chamber and the voltmeter."""
    if not names:
        return []
    from accelcal.effects.catalogue import catalogue  # here, as few calibrations need it

    acts_on = {entry.id: entry.acts_on for entry in catalogue()}
    return [name for name in names if acts_on.get(name) in _NOT_IN_USE]


def is_counted_in_use(effect: Effect, other: Effect) -> bool:
    """Whether use that takes up an effect counts that another one may be in its place.

    Both are functions of acceleration and temperature, the other one with amplitudes alone.
    """
    return effect.static and other.static and len(other.amplitudes) == len(other.parameters)


def static_in_use(calibration: Calibration) -> list[FoundEffect]:
    """Tell which effects of a calibration the catalogue has as static."""
    if not calibration.effects:
        return []
    from accelcal.effects.catalogue import catalogue  # here, as few calibrations need it

    static = [entry.id for entry in catalogue() if entry.static]
    return [item for item in calibration.effects if item.id in static]


def beyond_in_use(
    calibration: Calibration, tables: Sequence[TableCalibration], *, by_laws: bool
) -> list[str]:
    """List the sentences by which uncertainties are too small, to who uses the coefficients.

    To those of `accelcal.results.beyond_uncertainty.beyond_uncertainty` comes what else the effects
    of the calibration could be: of a static effect its use counts that, see
    `accelcal.effects.static`.
    """
    other = calibration.effects and not static_in_use(calibration)
    also = (NOT_COUNTED,) if other else ()
    return beyond_uncertainty(calibration, tables, by_laws=by_laws, also=also)
