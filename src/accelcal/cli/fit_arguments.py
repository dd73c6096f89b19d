"""Options of a calibration as arguments of `accelcal.fit`, with the files that they name read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from accelcal.cli.deliver import remark

if TYPE_CHECKING:
    from accelcal.io.documents import ResultFile
    from accelcal.specification import Specification

_PLAIN = ("method", "robust", "delta0", "strict", "temperature_laws")


class FitArguments(NamedTuple):
    """What is asked of a calibration."""

    of_all: dict[str, Any]  # arguments of `accelcal.fit` for all records
    specification: Specification | None  # the data sheet to judge against
    models: ResultFile | None  # discoveries whose effects are to be taken out, each of its unit


def fit_arguments(options: dict[str, Any]) -> FitArguments:
    """Take what is asked of a calibration out of the options of a command.

    What is left of the options is declared of the test.

    Raises
    ------
    AccelcalError
        If one of the files cannot be used.
    """
    arguments = {name: options.pop(name) for name in _PLAIN}
    asked = options.pop("coefficients")
    if asked is not None:
        arguments["coefficients"] = [name.strip() for name in asked.split(",")]
        arguments["strict"] = True  # who names coefficients wants them all
    head, sheet, model = (options.pop(name) for name in ("head", "spec", "model"))
    specification = models = None
    if head is not None:
        if options.get("head_uncertainty") is not None:
            remark(
                f"note: {head} tells how uncertain the head is; --head-uncertainty counts for the"
                " units alone that it was calibrated with"
            )
        from accelcal.io.head import read_head

        arguments["head"] = read_head(head)
    if sheet is not None:
        from accelcal.io.toml.specification import read_specification

        specification = read_specification(sheet)
    if model is not None:
        from accelcal.io.documents import read_models

        models = read_models(model)
    return FitArguments(arguments, specification, models)
