"""What is asked of a fit."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple, TypedDict, get_args

import numpy as np

from accelcal.arguments.kinds import expect
from accelcal.arguments.options import check_choice, check_flag
from accelcal.arguments.temperatures import check_temperature
from accelcal.arrays import Mask
from accelcal.errors import AccelcalWarning
from accelcal.estimate.tables import METHODS, Method
from accelcal.model import COEFFICIENTS

if TYPE_CHECKING:
    from accelcal.record import TumbleRecord
    from accelcal.results.discovery import Discovery
    from accelcal.results.head_calibration import HeadCalibration

LawsOf = Literal["tables", "readings"]

TEMPERATURE_LAWS: tuple[LawsOf, ...] = get_args(LawsOf)
"""What the temperature laws are fitted to; the first is the default."""


class FitOptions(TypedDict, total=False):
    """Arguments of `accelcal.fit` by their names, as others hand them on."""

    method: Method
    robust: bool
    delta0: float | None
    reference_temperature: float | None
    coefficients: Sequence[str]
    strict: bool
    temperature_laws: LawsOf
    model: Discovery | None
    head: HeadCalibration | None


class Options(NamedTuple):
    """Arguments of `accelcal.fit`, see there."""

    method: Method = METHODS[0]
    robust: bool = False
    delta0: float | None = None
    reference_temperature: float | None = None
    coefficients: tuple[str, ...] = COEFFICIENTS
    strict: bool = False
    temperature_laws: LawsOf = TEMPERATURE_LAWS[0]
    model: Discovery | None = None
    head: HeadCalibration | None = None

    @property
    def takes_gaps(self) -> bool:
        """Whether records that lack readings, each its own, can be calibrated together."""
        usual = self.method == METHODS[0] and self.temperature_laws == TEMPERATURE_LAWS[0]
        return usual and not self.robust and self.model is None and self.head is None

    def head_for(self, record: TumbleRecord) -> HeadCalibration | None:
        """What others than this record tell of the head."""
        return None if self.head is None else self.head.without(record.sha256)

    def left_out(self, records: Sequence[TumbleRecord]) -> Mask:
        """Which records themselves told of the head, shape (R,)."""
        if self.head is None:
            return np.zeros(len(records), dtype=np.bool_)
        return np.array([self.head_for(record) is not self.head for record in records])

    def check(self) -> None:
        """Refuse what no fit takes, by an `InputError`."""
        check_choice(METHODS, method=self.method)
        check_choice(TEMPERATURE_LAWS, temperature_laws=self.temperature_laws)
        check_flag(robust=self.robust, strict=self.strict)
        if self.reference_temperature is not None:
            check_temperature(reference_temperature=self.reference_temperature)
        if self.model is not None:
            from accelcal.results.discovery import Discovery

            expect(self.model, Discovery)
        if self.head is not None:
            from accelcal.results.head_calibration import HeadCalibration

            expect(self.head, HeadCalibration)

    def warn(self, stacklevel: int) -> None:
        """Warn of the misprinted method, once and not for every file.

        The level is that of `warnings.warn`; 1 is the line that calls this.
        """
        if self.method == "printed":
            warnings.warn(
                "method 'printed' uses the misprinted equations (6); it is there for the record",
                AccelcalWarning,
                stacklevel=stacklevel + 1,
            )

    def asked(self) -> dict[str, object]:
        """What was asked of the fit and stands nowhere else in the calibration."""
        return {
            "coefficients": [name for name in COEFFICIENTS if name in self.coefficients],
            "strict": self.strict,
            "temperature_laws": self.temperature_laws,
            "model": None if self.model is None else self.model.source,
            "head": None if self.head is None else self.head.source,
        }
