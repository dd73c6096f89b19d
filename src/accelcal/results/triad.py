"""Calibration of a triad: three accelerometers in one block."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from accelcal.arguments.axes import AXES, by_axis
from accelcal.arrays import Array
from accelcal.errors import InputError
from accelcal.escapes import visible
from accelcal.results.covariance import CorrelatedByName, Rows
from accelcal.results.documents.checked import (
    Kind,
    checked,
    mapping_of,
    member,
    number,
    size_or_none,
)
from accelcal.results.documents.fields import Document, members
from accelcal.results.documents.stored import StoredResult
from accelcal.results.quantity import Gate, Quantity
from accelcal.results.tabular import TabularResult

if TYPE_CHECKING:
    from accelcal.plot.triad import TriadPlot

__all__ = ["FRAMES", "NAMES", "TriadCalibration"]


NAMES = (*(f"b_{i}" for i in AXES), *(f"S_{i}{j}" for i in AXES for j in AXES))
"""Bias of each channel, and its sensitivity to the acceleration along each axis of the frame."""

FRAMES: Mapping[str, str] = MappingProxyType(
    {
        "block": "axes of the block, by the attitudes as given",
        "x": "axis x along the sensitive axis of channel x, that of y in the plane xy",
        "z": "axis z along the sensitive axis of channel z, that of y in the plane yz",
    }
)
"""Each frame in words."""


def _parameters(value: Any) -> Mapping[str, Quantity]:
    """Take all parameters, which always have values."""
    found = mapping_of(Quantity.from_document, NAMES)(value)
    for name in NAMES:
        checked(value, name, member("value", number))
    return found


@dataclass(frozen=True, slots=True)
class TriadCalibration(CorrelatedByName, StoredResult, TabularResult):
    """Bias, scale factors and misalignments of a triad, y = b + S a.

    Attributes
    ----------
    frame : str
        Where the axes of S come from: ``"block"`` where the attitudes were known; ``"x"`` or
        ``"z"`` where only the length of the acceleration was, see `accelcal.calibrate_triad`.
    parameters : mapping of str to Quantity
        ``b_x`` ... [output unit] and ``S_xx`` ... [output unit per local g]; those that the frame
        fixes are zero without uncertainty.
    scale_factors : mapping of str to Quantity
        ``K_x`` ...: length of a row of S, the answer along the channel's own sensitive axis.
    misalignments : mapping of str to Quantity
        ``m_xy`` ...: component of the sensitive axis of x along the axis y of the frame, a small
        angle [rad].
    axis_angles : mapping of str to Quantity
        ``xy``, ``xz``, ``yz``: 90 deg minus the angle between two sensitive axes [rad]. No choice
        of a frame changes them.
    covariance_names, covariance_matrix
        Names of the free parameters and their covariance, which is the array `covariance` as well;
        empty where nothing tells the noise.
    attitudes : int
        Number of attitudes.
    dof : int
        Degrees of freedom of the residuals; each quantity has its own.
    residual_rms : float
        Of the length of a less 1, or of the channels over their scale factors where attitudes were
        known [g].
    gates : tuple of Gate
        Checks with their findings.
    temperature_degC : float or None
        Mean temperature of the attitudes [degC].
    g_local_m_s2 : float or None
        Local gravity [m/s^2].
    output_unit, serial : str or None
        Of the outputs; of the triad.
    source : str
        Where the record came from.
    notes : tuple of str
        What the reader set aside.
    software : str
        Name and version of what made the calibration.

    Examples
    --------
    >>> import numpy as np
    >>> import accelcal
    >>> up = np.vstack([np.eye(3), -np.eye(3)])
    >>> noise = 1e-4 * np.random.default_rng(1).normal(size=up.shape)
    >>> triad = accelcal.calibrate_triad(0.01 + 2.0 * up + noise, up)
    >>> round(triad.scale_factors["K_x"].value, 2), triad.frame
    (2.0, 'block')
    """

    SCHEMA: ClassVar[str] = "accelcal/triad/1"
    _WRITER: ClassVar[str] = "accelcal triad"
    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {
        "g_local_m_s2": size_or_none,
        "parameters": _parameters,
    }
    _MISSING: ClassVar[Mapping[str, Any]] = {"temperature_degC": None}

    frame: str
    parameters: Mapping[str, Quantity]
    scale_factors: Mapping[str, Quantity]
    misalignments: Mapping[str, Quantity]
    axis_angles: Mapping[str, Quantity]
    covariance_names: tuple[str, ...]
    covariance_matrix: Rows
    attitudes: int
    dof: int
    residual_rms: float
    gates: tuple[Gate, ...]
    temperature_degC: float | None = None
    g_local_m_s2: float | None = None
    output_unit: str | None = None
    serial: str | None = None
    source: str = "<table>"
    notes: tuple[str, ...] = ()
    software: str = ""

    @property
    def temperatures(self) -> tuple[float, float] | None:
        """The lowest and the highest for which it is good, None where nothing tells it [degC]."""
        level = self.temperature_degC
        return None if level is None else (level, level)

    @property
    def bias(self) -> Array:
        """Output at zero acceleration, shape (3,) [output unit]."""
        return np.array([self.parameters[f"b_{i}"].value for i in AXES], dtype=np.float64)

    @property
    def sensitivity(self) -> Array:
        """Matrix S, shape (3, 3) [output unit per local g]."""
        values = [self.parameters[f"S_{i}{j}"].value for i in AXES for j in AXES]
        return np.array(values, dtype=np.float64).reshape(3, 3)

    def accelerations(self, output: ArrayLike) -> Array:
        """Turn outputs into accelerations along the axes of the frame.

        Parameters
        ----------
        output : array_like, shape (..., 3)
            Outputs of the channels x, y, z [output unit]; columns of a DataFrame that are named so
            count by their names.

        Returns
        -------
        ndarray, shape (..., 3)
            Acceleration [local g].

        Raises
        ------
        InputError
            If they are no numbers, or the last axis does not hold three.

        See Also
        --------
        accelcal.apply : Gives their uncertainty too.
        """
        values = by_axis(output, "output")
        if values.shape[-1:] != (3,):
            raise InputError(f"outputs of shape {values.shape}; the last axis holds x, y, z")
        inverse = np.linalg.inv(self.sensitivity)
        # unlike a matrix product, each sample is worked out alike however many there are
        return np.asarray(np.einsum("...j,ij->...i", values - self.bias, inverse))

    @property
    def plot(self) -> TriadPlot:
        """Pictures, each a method that returns matplotlib axes."""
        from accelcal.plot.triad import TriadPlot

        return TriadPlot(self)

    def export(self, path: str | PathLike[str], *, form: str | None = None) -> None:
        """Write the calibration for navigation code, as a C header, YAML or CSV.

        Parameters
        ----------
        path : path
            File to write, whole or not at all.
        form : {"c", "yaml", "csv"}, optional
            The form; by default that of the file's extension: .h, .hpp, .yaml, .yml or .csv.

        Raises
        ------
        InputError
            If the form is another.

        Warns
        -----
        AccelcalWarning
            About what the calibration does not know.
        """
        from accelcal.export.write import write_export

        write_export(self, path, form=form)

    def __repr__(self) -> str:
        name = f"serial {self.serial}" if self.serial else self.source
        rms = f"{1e3 * self.residual_rms:.3g} mg rms"
        return visible(f"<TriadCalibration {name}: {self.attitudes} attitudes, {rms}>")

    def rows(self) -> list[dict[str, Any]]:
        """List all quantities, a flat dictionary each."""
        named = {**self.parameters, **self.scale_factors, **self.misalignments}
        named |= {f"angle_{pair}": q for pair, q in self.axis_angles.items()}
        return [{"quantity": name, **quantity.to_document()} for name, quantity in named.items()]

    def _contents(self) -> dict[str, Any]:
        return {
            "software": self.software,
            "acceleration_unit": "g_local",
            **members(self, "g_local_m_s2 temperature_degC attitudes frame dof residual_rms"),
            **members(self, "output_unit serial source"),
            **members(self, "parameters scale_factors misalignments axis_angles"),
            "covariance": self._covariance_document(),
            **members(self, "gates notes"),
        }

    @classmethod
    def _read(cls, document: Document) -> TriadCalibration:
        return cls._of_fields(document, **cls._covariance_fields(document))
