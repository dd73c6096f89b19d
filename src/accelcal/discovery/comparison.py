"""A record beside the base model: what is left, in the measure of its noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from accelcal.apparatus import Apparatus
from accelcal.arrays import Array, Mask
from accelcal.discovery.base import BaseModel, base_model, solve
from accelcal.discovery.columns import orthonormal, saturated
from accelcal.discovery.instance import Instance, column_of, columns_of, own_columns
from accelcal.discovery.noise.of_readings import (
    FEWEST_REPLICATES,
    ReadingNoise,
    covariance,
    reading_noise,
    refuse_too_many,
    relative_noise,
)
from accelcal.discovery.noise.pure_error import with_noise_of_runs
from accelcal.discovery.space import Covariance, Space, space_of, whitener_of
from accelcal.record import TumbleRecord


class Comparison(NamedTuple):
    """A record and the base model, fitted to it by generalised least squares."""

    record: TumbleRecord  # the record of n readings
    model: BaseModel
    parameters: Array  # its parameters, (p,)
    noise: ReadingNoise
    space: Space  # what the model leaves
    seen: Array  # coordinates of the readings in it, (n,)
    spread: Covariance  # covariance of the errors of the readings
    possible: tuple[Covariance, ...]
    """The same for each of several values that the correlation of neighbours may have, where it is
    estimated, also where it is not significant. None where the errors are known to be those that
    the space makes independent."""

    @property
    def step(self) -> float:
        """Declared step of the readings [g]."""
        return _step(self.record, self.model)

    @property
    def residual(self) -> Array:
        """Reading minus base model [g], shape (n,)."""
        return self.model.residual(self.parameters)

    def less(self, taken: Array) -> Comparison:
        """The comparison of readings less something [g], in the space that it has."""
        model = replace(self.model, reading=self.model.reading - taken)
        parameters = solve(model, self.space.whiten)
        seen = self.space.see(model.residual(parameters))
        return self._replace(model=model, parameters=parameters, seen=seen)

    @property
    def counted(self) -> Apparatus:
        """Errors that count: those that are declared, but no launches where runs are apart."""
        record = self.record
        if self.model.apart:
            record = record.with_apparatus(launch_uncertainty=None, launch_sf_uncertainty=None)
        return record.apparatus

    def anew(self, record: TumbleRecord, known: tuple[Instance, ...]) -> Comparison:
        """Compare another record with the model beside effects that are known to be there."""
        model = self.model
        return compared(record, model.T0, model.delta0, known, apart=model.apart)

    def judged_beside(self, known: Sequence[Instance], *, memory: bool = True) -> Comparison:
        """The same with the noise judged beside known effects, see `compared`.

        Without `memory`, neighbouring readings count as independent.
        """
        return _judged(self.record, self.model, known, None, memory=memory)

    def directions(self, *instances: Instance) -> Array:
        """Unit vectors of effects in the space, shape (n, h)."""
        c = self.model.conditions
        seen = [self.space.see(column_of(item, c)) for item in instances]
        return np.stack([each / float(np.sqrt(each @ each)) for each in seen], axis=1)

    def span(self, instances: Sequence[Instance]) -> Array:
        """Orthonormal basis of what effects do in the space, whatever their amplitudes, (n, h)."""
        c = self.model.conditions
        columns = [self.space.see(own_columns(item, c)) for item in instances]
        return orthonormal(np.hstack([self.space.nothing(), *columns]))


def compared(
    record: TumbleRecord,
    reference_temperature: float,
    delta0: float = 0.0,
    known: tuple[Instance, ...] = (),
    *,
    noise: ReadingNoise | None = None,
    silent: Mask | None = None,
    apart: bool = False,
) -> Comparison:
    """Compare a record with the base model at T0 [degC], with a fixture angle [rad].

    Effects that are `known` to be there are not in the model, but do not count as noise unless they
    leave too little to tell it. The noise is by default that of replicates. Readings that a dead
    zone silences are `silent`, shape (n,), and runs may be `apart`, see `accelcal.discovery.base`.

    Raises
    ------
    InputError
        If the record is too small or too large, see `accelcal.discovery.noise.of_readings`.
    """
    refuse_too_many(record)
    model = base_model(record, reference_temperature, delta0, silent, apart=apart)
    return _judged(record, model, known, noise, memory=True)


def _judged(
    record: TumbleRecord,
    model: BaseModel,
    known: Sequence[Instance],
    noise: ReadingNoise | None,
    *,
    memory: bool,
) -> Comparison:
    if noise is None:
        repeating = saturated(model.conditions, record.mounting)
        within = np.hstack([repeating, columns_of(known, model.conditions)])
        if len(within) - orthonormal(within).shape[1] < FEWEST_REPLICATES:
            within = repeating  # known effects leave too little to tell the noise
        first = model.residual(solve(model))
        step, by_std = _step(record, model), relative_noise(record)
        relative = with_noise_of_runs(model.conditions, first, within, by_std, step)
        noise = reading_noise(model.conditions, first, within, step, relative)
    if not memory:
        noise = noise._replace(rho=0.0, possible=())
    spread = covariance(model.conditions, noise, record.apparatus, _step(record, model))
    possible = tuple(spread._replace(rho=rho) for rho in noise.possible)
    return with_errors(record, model, noise, spread, possible)


def with_errors(
    record: TumbleRecord,
    model: BaseModel,
    noise: ReadingNoise,
    spread: Covariance,
    possible: tuple[Covariance, ...],
) -> Comparison:
    """Compare a record with a model by the covariance of its errors, as in `Comparison`."""
    whitener = whitener_of(spread)
    parameters = solve(model, whitener.whitened)
    repeating = saturated(model.conditions, record.mounting)
    space = space_of(whitener, model.jacobian(parameters), repeating)
    seen = space.see(model.residual(parameters))
    return Comparison(record, model, parameters, noise, space, seen, spread, possible)


def _step(record: TumbleRecord, model: BaseModel) -> float:
    """Declared step of the readings [g]."""
    return (record.apparatus.resolution or 0.0) / abs(model.nominal)
