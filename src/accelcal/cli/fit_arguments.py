"""Options of a calibration as arguments of `accelcal.fit`, with the files that they name read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from accelcal.io.discoveries import DiscoveryFile
    from accelcal.results.head_calibration import HeadCalibration
    from accelcal.specification import Specification

_PLAIN = ("method", "robust", "delta0", "strict", "temperature_laws")


def fit_arguments(options: dict[str, Any]) -> dict[str, Any]:
    """Take the arguments of `accelcal.fit`, but for the model, out of the options of a command.

    Parameters
    ----------
    options : dict
        Values of `accelcal.cli.options.calibration_options`; what is left is declared of the test.

    Returns
    -------
    dict
        The arguments.

    Raises
    ------
    AccelcalError
        If the file of a head cannot be used.
    """
    return {
        **{name: options.pop(name) for name in _PLAIN},
        "coefficients": [name.strip() for name in options.pop("coefficients").split(",")],
        "head": _head_in(options.pop("head")),
    }


def models_in(path: str | None) -> DiscoveryFile | None:
    """Read discoveries whose effects are to be taken out; None where none are given."""
    if path is None:
        return None
    from accelcal.io.discoveries import read_models

    return read_models(path)


def _head_in(path: str | None) -> HeadCalibration | None:
    if path is None:
        return None
    from accelcal.io.head import read_head

    return read_head(path)


def specification_in(path: str | None) -> Specification | None:
    """Read a data sheet; None where none is given."""
    if path is None:
        return None
    from accelcal.io.specification import read_specification

    return read_specification(path)
