"""What is asked of each file of a batch; it travels to the workers."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from operator import is_
from typing import Any

from accelcal.arguments.kinds import expect
from accelcal.calibrate.options import Options
from accelcal.calibrate.plan import OnePlan
from accelcal.calibrate.stack import calibration_stack
from accelcal.effects.catalogue import catalogue
from accelcal.effects.effect import Effect
from accelcal.effects.formula import Formula
from accelcal.effects.found import disturbances
from accelcal.errors import DesignError
from accelcal.estimate.estimability import check_names
from accelcal.io.tables import read_table
from accelcal.specification import Specification
from accelcal.version import __version__

_GOOD_TABLE = (
    "# g: 9.8\n"
    "T [degC],angle,stroke,output\n20,0,1,1.3\n20,45,1,0.9\n20,90,1,0.0\n20,135,1,-0.9\n"
    "20,180,1,-1.3\n20,225,1,-0.9\n20,270,1,0.1\n20,315,1,0.9\n"
)


@dataclass(frozen=True, slots=True)
class Settings:
    """How each record of a batch is fitted and judged."""

    options: Options = field(default_factory=Options)
    # of the caller's own that the model has, for workers that do not know them
    effects: tuple[Effect, ...] = ()
    overrides: Mapping[str, Any] = field(default_factory=dict)  # win over the header lines
    specification: Specification | None = None  # data sheet to judge against

    def with_own_effects(self) -> Settings:
        """Take along the effects of the model that come from a file of the caller's."""
        model = self.options.model
        needed = {found.id for found in model.effects} if model else set()
        found = (entry for entry in catalogue() if entry.id in needed)
        return replace(self, effects=tuple(e for e in found if isinstance(e.term, Formula)))

    def try_out(self) -> None:
        """Fit a good table, so that wrong options are told once and before any file.

        Raises InputError if an option breaks a rule, DesignError if a coefficient is unknown or K1
        is not asked for; warns if the method is misprinted.
        """
        if self._is_usual():
            return
        given = dict(self.overrides)
        if isinstance(given.get("resolution"), str) and not given.get("unit"):
            del given["resolution"]  # each table tells whether its outputs have such a unit
        record = read_table(io.StringIO(_GOOD_TABLE), overrides=given)
        self.options.check()
        self.options.warn(stacklevel=4)
        check_names(self.options.coefficients)
        if self.specification is not None:
            expect(self.specification, Specification)
        if self.options.model is not None:
            disturbances(self.options.model.effects)
        with suppress(DesignError):
            calibration_stack(OnePlan.of([record]), self._without_files()).one(0)

    def _is_usual(self) -> bool:
        """Whether nothing has been chosen that could be wrong."""
        usual = all(map(is_, self.options, Options()))
        return usual and not self.overrides and self.specification is None

    def _without_files(self) -> Options:
        return self.options._replace(model=None, head=None)

    def fingerprint(self) -> str:
        """Digest of all that decides the results of a file besides the file."""
        of_files = self.options.model, self.options.head
        files = ["" if file is None else file.to_json() for file in of_files]
        own = [(entry.id, entry.acts_on, entry.formula) for entry in self.effects]
        given = sorted((key, value) for key, value in self.overrides.items() if value is not None)
        plain = replace(self, options=self._without_files(), effects=(), overrides={})
        parts = (__version__, repr(plain), repr(given), repr(own), *files)
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()
